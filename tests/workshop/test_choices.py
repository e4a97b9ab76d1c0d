"""The view of anchors: what a robot that learns chooses between."""

from dataclasses import replace

import numpy as np
import pytest
from movies import shipped
from pages import overlaps, writing

from reference.building import Kind, building_of, lengths
from reference.game.codec import Moment
from reference.workshop import drawing
from reference.workshop.anchors.sets import GROUPS
from reference.workshop.drawing.choices import (
    ANCHOR_LOOKS,
    FOOT_OF_STAIRS,
    GUARDED,
    KEEPING,
    LOST,
    STAYING,
    WAY_OUT,
    anchors_of,
    moment_of,
    ways_on_floor,
)
from reference.workshop.maps import load
from reference.workshop.maps.generated import generated_text
from reference.workshop.strategies.observed import way_marks
from reference.workshop.training.presets import preset

SHIPPED = ("paper", "museum", "school", "tiny", "tower", "maze")
HUT = """building: Hut
size: 6 x 4
floor 1:
######
#....#
#....E
######
"""


@pytest.mark.paper("C5", "chosen")
@pytest.mark.parametrize("name", SHIPPED)
def test_what_is_drawn_is_what_networks_read(name):
    """Each robot's anchors, as many as may be chosen, where its numbers say."""
    simulation = moment_of(shipped(name))
    world = simulation.world
    settings = replace(preset("tiny").robots, masks=False, head="set")
    frame = settings.codec("robots", simulation.building, simulation.scenario)
    (seen,) = frame.observe([world])
    moment = Moment(seen, np.ones(len(seen), dtype=bool), world)
    (numbers,) = frame.read([moment])
    K = frame.anchors
    found = anchors_of(simulation)
    assert [*found] == [robot.floor for robot in world.robots if robot.active]
    for robot, row in zip(world.robots, numbers, strict=True):
        allowed = row[2 * K : 3 * K] > 0
        units = row[: 2 * K].reshape(K, 2)[allowed]
        spots = np.concatenate([*found[robot.floor].values()])
        assert np.allclose((spots - robot.position) / 10, units, atol=1e-5)


OFFICE = HUT.replace("Hut", "The office that we have moved into")


def test_a_title_is_not_cut_off_in_a_small_building():
    """Its page is the narrowest there is."""
    title = drawing.anchors(load(OFFICE)).get_suptitle()
    assert title.startswith("The office that we have moved into: what robots")


def test_the_view_names_its_moment_and_a_person_whom_nobody_leads_is_no_disc():
    """Discs are followers, as in other pictures."""
    title = drawing.anchors(shipped("tiny")).get_suptitle()
    assert title == "Tiny office: what robots choose between after 10 s"
    assert ANCHOR_LOOKS[LOST]["marker"] == "^"


@pytest.mark.parametrize("name", SHIPPED)
def test_the_anchors_of_the_map_are_all_there_by_kind(name):
    """Ways out are exits and stairs down; feet are where stairs end."""
    building = shipped(name)
    simulation = moment_of(building)
    for floor, by_kind in anchors_of(simulation).items():
        exits = [
            mark
            for mark in building.landmarks
            if mark.kind is Kind.EXIT and mark.floor == floor
        ]
        down = [well for well in building.stairwells if well.leads_down(floor)]
        ends = [well for well in building.stairwells if well.lowest == floor]
        assert len(by_kind[WAY_OUT]) == len(exits) + len(down)
        assert len(by_kind.get(FOOT_OF_STAIRS, ())) == len(ends)
        assert len(by_kind[STAYING]) == 1
        assert len(by_kind.get(KEEPING, ())) <= 1
        assert GUARDED in by_kind
        assert len(by_kind.get(LOST, ())) <= GROUPS
        bodies = simulation.world.bodies
        here = bodies.position[bodies.walking & (bodies.floor == floor)]
        for spot in by_kind.get(LOST, ()):
            assert lengths(here - spot).min() < 1e-3


@pytest.mark.parametrize("seed", range(30))
def test_ways_out_are_drawn_where_one_can_stand(seed):
    """Also those whose points lie in a wall; the others are drawn as they are."""
    size = (20 + seed % 30, 15 + seed % 20, 1 + seed % 3)
    building = building_of(generated_text(seed, *size))
    for floor in range(building.floors):
        outs, _ = way_marks(building, floor)
        drawn = ways_on_floor(building, floor, outs)
        walkable = building.walkable[floor]
        around = np.pad(walkable, 1)
        for spot, star in zip(outs, drawn, strict=True):
            assert walkable[building.cell(*star)]
            row, col = building.cell(*spot)
            if around[row + 1, col + 1]:
                assert tuple(star) == tuple(spot)


def test_the_picture_has_no_star_in_a_wall():
    """In a building where one would be."""
    building = building_of(generated_text(4, 24, 19, 2))
    for floor, axes in enumerate(drawing.anchors(building).axes):
        (stars,) = (line for line in axes.lines if line.get_marker() == "*")
        for x, y in stars.get_xydata():
            assert building.walkable[(floor, *building.cell(x, y))]


@pytest.mark.parametrize("name", SHIPPED)
def test_nothing_overlaps_and_every_floor_says_how_many(name):
    """Neither legend nor titles, wide or tall."""
    figure = drawing.anchors(shipped(name))
    assert overlaps(figure) == []
    for floor, by_kind in anchors_of(moment_of(shipped(name))).items():
        signs = {
            (kind, *spot.round(6)) for kind, found in by_kind.items() for spot in found
        }
        count = len(signs)  # some guard two ways at once
        assert figure.axes[floor].get_title(loc="left").endswith(f", {count} anchors")


@pytest.mark.parametrize("text", [HUT, HUT.replace("....", "#..#", 1)])
def test_a_hut_without_doors_and_stairs_is_drawn_too(text):
    """Its legend names no feet of stairs, and no more people stand there than fit."""
    building = load(text)
    assert len(moment_of(building).world.bodies) <= 8
    said = writing(drawing.anchors(building))
    assert WAY_OUT in said and STAYING in said and FOOT_OF_STAIRS not in said


def test_kinds_are_told_apart_by_their_shape():
    """So that no colour is needed for it."""
    shapes = [(look["marker"], look["mfc"] == "none") for look in ANCHOR_LOOKS.values()]
    assert len({*shapes}) == len(shapes)
