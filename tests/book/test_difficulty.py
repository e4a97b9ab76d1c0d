"""The difficulty h: what F11 asks of it, and what flames do to the ways out."""

from math import inf

import networkx as nx
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from movies import body, built, flames, shipped, stage

from reference import paper
from reference.building import OUTSIDE, Kind, without_doors
from reference.evaluation.difficulty import (
    arrival_of,
    difficulty,
    hardest,
    moments,
    people_in,
    ways_lost,
)
from reference.evaluation.score import paper_ruler
from reference.fire import RandomFire, Spread, burnable, cells_around_clearance
from reference.paper import BURN_SECONDS, FIRE_SOURCES, FLAME_SECONDS, Scenario
from reference.simulation import Simulation
from reference.walking import enter_stairs
from reference.workshop.strategies import ROBOTS
from reference.workshop.strategies.guides import Sweep
from reference.world import FireLit

TWO_ROOMS = """
    #########
    #...+...E
    #...#####
    #...#
    #####
    """
HOUSE = """
       #############
    ####.....#.....####
    #AA+.....#.....+BB#
    ####.....#.....####
       ##E########E##

       #############
    ####.....#.....####
    #AA+.....+.....+BB#
    ####.....#.....####
       #############
    """
"""Below, two rooms with no door between them; above, people may choose."""


def h_of(building, arrival):
    """The difficulty for as many people in each room as it has cells."""
    size = [area.size * (area.kind == "room") for area in building.areas]
    return difficulty(building, arrival, np.array(size))


def burning(building, cells, since=0.0):
    """Only these cells burn, (floors, rows, cols) bool."""
    return np.where(cells, since, inf)


def room(building, name):
    """The area of a room by its place in reading order on the ground floor."""
    return [a.index for a in building.areas if a.kind == "room"][name]


def lost(building, cells):
    """(areas,) share of its way out that each area has lost while these burn."""
    return ways_lost(building, burning(building, cells), BURN_SECONDS)[0]


# -- What F11 asks ------------------------------------------------------------------


@pytest.mark.paper("F10", "F11")
@pytest.mark.parametrize("name", ["tiny", "paper", "tower", "maze"])
def test_h_is_0_without_fire_and_2312_if_all_burns_at_once(name):
    """It burns out, so that is 0.6 of the hardest: 1 on the paper's ruler."""
    building = shipped(name)
    never = np.full(building.kind.shape, inf)
    at_once = np.zeros(building.kind.shape)
    assert h_of(building, never) == 0
    assert h_of(building, at_once) == pytest.approx(2312, abs=1)
    assert pytest.approx(2312, abs=1) == 0.6 * hardest()
    assert paper_ruler().score(-40_000, hardest()) == pytest.approx(1, abs=1e-5)


@pytest.mark.paper("F11")
@settings(max_examples=20)
@given(share=st.integers(0, len(moments())))
def test_all_ways_cut_at_once_cost_the_health_lost_till_they_open_again(share):
    """As a share of the hardest, wherever people start: squares of the health left."""
    building = built(TWO_ROOMS)
    t = paper.health_seconds() * share / len(moments())
    h = h_of(building, np.full(building.kind.shape, t))
    shut, opens = (
        max(0, 1 - seconds / paper.health_seconds()) ** 2
        for seconds in (t, t + BURN_SECONDS)
    )
    assert h == pytest.approx(hardest() * (shut - opens) ** 0.5)


FLOORS = ["tiny", "paper", "tower"]
SECONDS = st.floats(0, 150)


@st.composite
def fires(draw):
    """A building, how flames spread in it, and some sources."""
    building = shipped(draw(st.sampled_from(FLOORS)))
    rng = np.random.default_rng(draw(st.integers(0, 99)))
    spread = Spread(building, Scenario(), rng)
    cells = np.argwhere(building.kind == Kind.FLOOR)
    places = draw(st.lists(st.integers(0, len(cells) - 1), min_size=1, max_size=5))
    sources = []
    for floor, row, col in cells[places].tolist():
        sources.append(FireLit(draw(SECONDS), floor, *building.metres(row, col)))
    return spread, sources


@pytest.mark.paper("F11")
@settings(max_examples=25)
@given(fires(), st.floats(0, 60))
def test_what_burns_besides_and_earlier_fire_are_at_least_as_difficult(fire, seconds):
    """More cells, each as before; then all flames some moments sooner."""
    spread, sources = fire
    then, fewer = (flames(spread, *s).arrival for s in (sources, sources[:-1]))
    many = np.where(np.isfinite(fewer), fewer, then)
    sooner = many - FLAME_SECONDS * int(min(seconds, many.min()) / FLAME_SECONDS)
    found = [h_of(spread.building, burns) for burns in (fewer, many, sooner)]
    assert 0 <= found[0] <= found[1] <= found[2] <= hardest()


@pytest.mark.paper("F11")
def test_it_does_not_depend_on_the_robots():
    """One random fire, met by all kinds of robots: the same h, however it ended."""
    scenario = Scenario(people=8)
    ends = set()
    found = set()
    for robots in ROBOTS:
        sides = ROBOTS[robots](), RandomFire()
        run = Simulation(shipped("tiny"), scenario, *sides, seed=0)
        people = people_in(run.world)
        ends.add(run.run().simulated_seconds)
        found.add(difficulty(run.building, arrival_of(run), people))
    assert len(ends) == len(ROBOTS)
    assert len(found) == 1


@pytest.mark.paper("F11")
def test_the_only_door_of_a_full_room_counts_more_than_an_empty_closet():
    """Nobody has to leave the closet."""
    building = built(
        """
        #########
        #...#...#
        #...#...#
        #...#...#
        ##+###+##
        #.......E
        #########
        """
    )
    doors = [building.landmark == m.index for m in building.landmarks[:2]]
    people = np.zeros(len(building.areas))
    people[room(building, 0)] = 10
    full, closet = (
        difficulty(building, burning(building, cells, since=20.0), people)
        for cells in doors
    )
    assert full > closet == 0


@pytest.mark.paper("F11")
def test_each_of_the_people_counts_the_same():
    """Three in the room that burns and one in the other: three quarters, on the scale
    of squares."""
    building = built("#...+..E..+...#")
    fire = burning(building, building.area == room(building, 0))
    squares = []
    for counts in ([1, 0, 0, 0], [0, 0, 0, 1], [3, 0, 0, 1]):
        squares.append(difficulty(building, fire, np.array(counts)) ** 2)
    burns, safe, all_four = squares
    assert burns > safe == 0
    assert all_four == pytest.approx(0.75 * burns)


# -- Ways and flames ----------------------------------------------------------------


def by_networkx(building, burnt=()):
    """(areas,) metres of each area's shortest way out without some doors."""
    towards = without_doors(building.ways, burnt).reverse()
    d = nx.single_source_dijkstra_path_length(towards, OUTSIDE, weight="length")
    return np.array([d.get(area.id, inf) for area in building.areas])


@pytest.mark.paper("F11")
@settings(max_examples=30)
@given(st.sampled_from(FLOORS), st.sets(st.integers(0, 40)))
def test_a_burnt_door_costs_what_it_costs_in_the_graph(name, burnt):
    """As networkx finds the ways in a copy of the graph without these doors."""
    building = shipped(name)
    doors = [m for m in building.landmarks if m.kind is Kind.DOOR and m.index in burnt]
    before = by_networkx(building)
    now = by_networkx(building, [m.id for m in doors])
    cells = np.isin(building.landmark, [m.index for m in doors])
    np.testing.assert_allclose(lost(building, cells), 1 - before / now, atol=1e-12)


@pytest.mark.paper("A6")
@pytest.mark.usefixtures("unprotected")
def test_a_door_is_no_way_once_a_cell_of_it_burns():
    """The room behind it has lost its way, the one before it has not."""
    building = built("##EE##\n#....#\n##++##\n#....#\n######")
    left = (building.kind == Kind.DOOR) & (np.arange(6) == 2)
    assert lost(building, left).tolist() == [0, 1]


@pytest.mark.paper("D7", "chosen")
def test_an_exit_is_shut_once_all_that_can_burn_around_its_clearance_does():
    """Before that the way is longer, since the room has become smaller."""
    building = built("##########\n#........E\n#........#\n##########")
    around = np.zeros(building.kind.shape, dtype=bool)
    around[0, 1, 4] = True
    assert 0 < lost(building, around)[0] < 1
    around[0, 2, 5] = True
    assert lost(building, around)[0] == 1


@pytest.mark.paper("D7", "chosen")
def test_a_room_wholly_inside_a_clearance_is_never_shut():
    """Whatever burns around it; the room before it is."""
    building = built("#....+....E")
    hall, porch = (a.index for a in building.rooms(0))
    everything = burning(building, burnable(building))
    shut = ways_lost(building, everything, BURN_SECONDS)[0]
    assert shut[[hall, porch]].tolist() == [1, 0]
    assert h_of(building, everything) < hardest()


@pytest.mark.paper("A3")
@pytest.mark.usefixtures("unprotected")
def test_an_entrance_is_no_way_once_all_cells_before_it_burn():
    """It never burns itself."""
    building = built(HOUSE)
    before = np.zeros(building.kind.shape, dtype=bool)
    before[1, 2, 4] = True  # the one cell before A upstairs
    left, right = (a.index for a in building.rooms(1))
    assert 0.1 < lost(building, before)[left] < 1
    before[1, 2, 14] = True  # and the one before B
    assert lost(building, before)[[left, right]].tolist() == [1, 1]


@pytest.mark.paper("A3")
@pytest.mark.usefixtures("unprotected")
def test_nobody_walks_up_the_stairs_to_get_out():
    """Cut off below, a room has lost its way, though the upper floor joins both."""
    building = built(HOUSE)
    cells = np.zeros(building.kind.shape, dtype=bool)
    cells.ravel()[cells_around_clearance(building, min(building.exits))] = True
    left, right = (a.index for a in building.rooms(0))
    assert lost(building, cells)[[left, right]].tolist() == [1, 0]
    assert 0 < lost(building, cells)[building.rooms(1)[0].index] < 1


@pytest.mark.paper("F11")
@pytest.mark.parametrize("half", [4, 2, 1])
def test_a_way_gets_as_much_longer_as_its_room_has_become_smaller(half):
    """With half of the room gone it is twice as long, and half of it is lost."""
    building = built("#....E")
    cells = (building.area >= 0) & (np.arange(6) > 4 - half)
    assert lost(building, cells)[0] == pytest.approx(half / 4)


@pytest.mark.paper("F11")
def test_ways_open_again_when_the_scenarios_flames_have_burnt_out():
    """All that burns for good from the start is the hardest fire."""
    building = built(TWO_ROOMS)
    at_once = np.zeros(building.kind.shape)
    people = np.ones(len(building.areas))
    found = [
        difficulty(building, at_once, people, Scenario(burn_seconds=seconds))
        for seconds in (10, BURN_SECONDS, 1_000_000)
    ]
    assert found == sorted(set(found))
    assert found[1] == difficulty(building, at_once, people)
    assert found[2] == pytest.approx(hardest())


# -- Who is there -------------------------------------------------------------------


@pytest.mark.paper("F11")
@pytest.mark.usefixtures("unprotected")
def test_every_metre_of_the_way_counts_the_same():
    """Who is cut off in the first room has not lost the rest, if out of it by then."""
    building = built(TWO_ROOMS)
    inner = 5**0.5  # metres to the door
    outer = 4.0  # metres from there to the exit
    people = np.zeros(2)
    people[room(building, 0)] = 3
    h = difficulty(building, burning(building, building.kind == Kind.DOOR), people)
    at_once = h_of(building, np.zeros(building.kind.shape))
    assert h == pytest.approx(at_once * (inner / (inner + outer)) ** 0.5)


@pytest.mark.paper("F11")
def test_people_are_counted_where_they_are():
    """In rooms and on the stairs; nobody, no difficulty."""
    sim = stage("#AA+pq.+r..E\n\n#AA+.stu...#")
    for letter in "su":  # into the same cell
        (entrance,) = sim.building.stairwells[0].entrances[1]
        enter_stairs(sim.world, body(letter), entrance)
    counts = [2, 1, 0, 1, 2]  # rooms, then stairs, floor by floor
    assert people_in(sim.world).tolist() == counts
    nobody = np.zeros(len(counts))
    assert difficulty(sim.building, np.zeros(sim.building.kind.shape), nobody) == 0


@pytest.mark.paper("F11")
def test_a_fire_burns_on_when_everybody_is_out():
    """All its sources count, and the run itself is left alone."""
    slow = Scenario(people=4, spread_rate=0.001)  # nothing burns but the sources
    sim = Simulation(shipped("tiny"), slow, Sweep(), RandomFire(), seed=1)
    sim.run()
    ended = sim.world.time
    lit = len(sim.world.flames.sources)
    later = arrival_of(sim)
    assert lit < FIRE_SOURCES and ended < 60
    assert np.isfinite(later).sum() == FIRE_SOURCES
    assert (sim.world.time, len(sim.world.flames.sources)) == (ended, lit)


@pytest.mark.paper("F11")
def test_stairs_are_as_long_as_paper_says_now(monkeypatch):
    """For who is slow on stairs, less of the way lies on a floor that burns."""
    building = built(HOUSE)
    rooms = [area.kind == "room" and area.floor == 1 for area in building.areas]
    upstairs = np.array(rooms, dtype=int)
    every_other = np.zeros(building.kind.shape, dtype=bool)
    every_other[0, :, ::2] = building.kind[0, :, ::2] == Kind.FLOOR
    fire = burning(building, every_other)
    before = difficulty(building, fire, upstairs)
    monkeypatch.setattr(paper, "STAIRS_SPEED", paper.STAIRS_SPEED / 4)
    assert 0 < difficulty(building, fire, upstairs) < before
