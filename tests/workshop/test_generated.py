"""New buildings: each is one that `check` passes, that people get out of, and new."""

from hashlib import sha256
from itertools import pairwise

import networkx as nx
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import ndimage

from reference import Scenario, Simulation
from reference.building import OUTSIDE, Kind, build, building_of
from reference.paper import InputError
from reference.robots import actual_target, said_on_the_way
from reference.workshop.maps import lines_of_plan, parse_map
from reference.workshop.maps.generated import generated_text
from reference.workshop.maps.pages import Page
from reference.workshop.maps.semantics import notes_on
from reference.workshop.strategies.observed import at_way_out

SIZES = [(15, 10), (24, 16), (40, 40), (60, 40)]


def floors_of(seed):
    """One to five, in turn."""
    return 1 + seed % 5


def checked(seed, width, height, floors):
    """A new building that `check` passes, without a note."""
    text = generated_text(seed, width, height, floors)
    building = build(parse_map(text))
    assert notes_on(building, Page(lines_of_plan(text))) == []
    return building


def assert_is_sound(seed, width, height, floors):
    """All that is promised of a new building."""
    building = checked(seed, width, height, floors)
    left, bottom, right, top = building.body
    assert (right - left, top - bottom) == (width, height)
    assert building.floors == floors
    assert 1 <= len(building.exits) <= 4
    assert len(building.stairwells) in ((0,) if floors == 1 else (1, 2))

    # everybody can reach a way out, from every room and from every cell
    outside = nx.ancestors(building.ways, OUTSIDE)
    assert {area.id for area in building.areas} <= outside
    for floor in range(floors):
        assert building.ways_out(floor)
        assert ndimage.label(building.walkable[floor])[1] == 1

    # robots can mean every way out [C6]
    for mark in building.landmarks:
        if mark.leads_out:
            target = actual_target(building, mark.floor, *at_way_out(building, mark))
            said = said_on_the_way(building, mark.floor, target)
            assert said in building.ways_out(mark.floor)
            assert building.landmarks[said].stairwell == mark.stairwell
            assert mark.stairwell >= 0 or said == mark.index

    # rooms have names, and there are fewer above [A2]
    rooms = [building.rooms(floor) for floor in range(floors)]
    for below, above in pairwise(map(len, rooms)):
        assert above < below or above == below <= 4
    names = [area.name for floor in rooms for area in floor]
    assert not any(name.startswith("room-") for name in names)


@pytest.mark.paper("A2")
@pytest.mark.paper("A3")
@pytest.mark.parametrize("size", SIZES, ids=lambda size: "{}x{}".format(*size))
@pytest.mark.parametrize("seeds", [10, pytest.param(1000, marks=pytest.mark.slow)])
def test_a_new_building_is_one_that_everybody_can_leave(seeds, size):
    """Of each of these sizes, without a mistake or a note, whatever the seed."""
    for seed in range(seeds):
        assert_is_sound(seed, *size, floors_of(seed))


@pytest.mark.paper("A2")
def test_no_strip_without_a_cell_parts_a_floor():
    """Stairs in the same part of a floor may begin a cell further than others."""
    assert_is_sound(9001, 26, 29, 4)


sides = st.integers(6, 70)


@given(st.integers(0, 2**53), sides, sides, st.integers(1, 4))
def test_new_buildings_of_odd_sizes_are_sound_too(seed, width, height, floors):
    """Long and narrow ones, and those of a single room."""
    building = checked(seed, width, height, floors)
    for floor in range(floors):
        assert building.ways_out(floor)
        assert ndimage.label(building.walkable[floor])[1] == 1


TEXTS = {
    (0, 15, 10, 1): "2920726bc9f7b52c",
    (1, 40, 40, 3): "8c80185016f0224f",
    (2, 60, 40, 5): "67e85bbee3a33e91",
}


@pytest.mark.parametrize("asked", TEXTS)
def test_the_same_seed_draws_the_same_building_everywhere(asked):
    """Letter by letter, on every platform: runs are named by such seeds."""
    text = generated_text(*asked)
    assert sha256(text.encode()).hexdigest()[:16] == TEXTS[asked]


def test_other_seeds_draw_other_buildings():
    """And floors of one building differ from each other."""
    assert len({generated_text(seed, 15, 10, 1) for seed in range(100)}) == 100
    for seed in range(10):
        signs = building_of(generated_text(seed, 24, 16, 3)).signs
        for one, other in ((0, 1), (0, 2), (1, 2)):
            assert not np.array_equal(signs[one], signs[other])


def bends(area):
    """Is a room no rectangle?"""
    rows, columns = np.ptp(area.cells, axis=0) + 1
    return area.size < rows * columns


def test_new_buildings_have_all_that_makes_ways_differ():
    """Rooms that bend, narrow and wide doors, few and many ways out, stairs inside."""
    exits, stairwells, doors, inside = set(), set(), set(), set()
    for seed in range(30):
        building = building_of(generated_text(seed))
        assert any(map(bends, building.areas))
        exits.add(len(building.exits))
        stairwells.add(len(building.stairwells))
        doors |= {mark.width for mark in building.landmarks if mark.kind is Kind.DOOR}
        left, bottom, right, top = building.body
        for x, y in (well.centre for well in building.stairwells):
            inside.add(left < x < right and bottom < y < top)
    assert exits == {1, 2, 3, 4}
    assert stairwells == {1, 2}
    assert doors == {1, 2}
    assert inside == {True, False}


@pytest.mark.parametrize(
    "size",
    [SIZES[0], *(pytest.param(size, marks=pytest.mark.slow) for size in SIZES[1:])],
    ids=lambda size: "{}x{}".format(*size),
)
def test_whoever_is_alone_in_a_new_building_finds_out(size):
    """By Algorithm 2, from the top, if there is no fire, and health without end."""
    for seed in range(1, 7):
        building = building_of(generated_text(seed, *size, floors_of(seed)))
        start = (*[0] * (building.floors - 1), 1)
        scenario = Scenario(people_per_floor=start, time_limit=3600)
        simulation = Simulation(building, scenario, seed=seed)
        simulation.world.bodies.health[:] = np.inf
        assert simulation.run().evacuated == 1


@pytest.mark.parametrize(
    ("asked", "why"),
    [
        ((0, 3, 3, 1), "no new building is 3x3 cells large. Take 6 to 180 each way"),
        ((0, 40, 5, 1), "no new building is 40x5 cells large"),
        ((0, 10_000, 10_000, 3), "no new building is 10000x10000 cells large"),
        ((0, 40, 40, 0), "no new building has 0 floors. Take 1 to 30"),
        ((0, 40, 40, 31), "no new building has 31 floors"),
        ((0, 180, 180, 4), "4 floors of 180x180 cells. Take at most 100,000 cells"),
        ((-1, 40, 40, 3), "-1 is no seed of a new building. Take 0 or more"),
    ],
)
def test_refuses_a_size_that_no_building_has(asked, why):
    """In one sentence with what to take instead, before anything is drawn."""
    with pytest.raises(InputError, match=why):
        generated_text(*asked)
