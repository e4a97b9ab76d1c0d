"""What an anchor costs by present flames: what hand-written guides reckon with."""

import numpy as np
import pytest
from test_sets import BUILDINGS, codec_of, evacuations, moment_of

from reference.workshop.anchors.frame import FIRST_MARK, robot_destinations
from reference.workshop.anchors.reckoning import FARTHEST, gains
from reference.workshop.anchors.sets import SetView
from reference.workshop.strategies.guides import (
    DETOUR,
    Group,
    Way,
    choose,
    metres_from,
    risk,
)
from reference.workshop.strategies.observed import FAR
from reference.workshop.strategies.traffic import ways_outside


def view_of(sim):
    """What robots read in a simulation."""
    codec = codec_of(sim)
    vectors = moment_of(sim).vectors
    headed = robot_destinations(sim.world)
    return SetView(codec, vectors, headed, masks=False, flames=[sim.world.flames])


def least(metres):
    """(places,) the least of several, as far as robots reckon."""
    return np.minimum(np.min(metres, axis=0), FARTHEST)


@pytest.mark.paper("C7", "chosen")
@pytest.mark.parametrize("name", BUILDINGS)
def test_metres_are_those_that_escort_and_its_robots_reckon_with(name):
    """To an anchor round flames, from there outside, and outside by each way out."""
    for sim in evacuations(name):
        world = sim.world
        view = view_of(sim)
        outside = ways_outside(sim.building, risk(sim.building, world.flames))
        cheapest = least([*outside.values()])
        for b, robot in enumerate(world.robots):
            if not robot.active:
                continue
            real = view.way[b] < FAR
            at = view.at[b]
            assert view.outside[b] == pytest.approx(cheapest[robot.place])
            assert view.out[b] == pytest.approx(cheapest[at])
            d = metres_from(world, robot)[at]
            assert view.to[b][real] == pytest.approx(d[real], rel=1e-6)
            for k, marks in enumerate(view.ways.marks[robot.floor], FIRST_MARK):
                through = least([outside[mark] for mark in marks])
                assert view.total[b, k] == pytest.approx(through[robot.place])
    assert world.flames.burning.any()


@pytest.mark.paper("C5", "chosen")
@pytest.mark.parametrize("name", BUILDINGS)
def test_one_way_out_at_least_is_the_cheapest(name):
    """It costs what the cheapest way does; and no other does."""
    for sim in evacuations(name):
        view = view_of(sim)
        cheapest = view._guide_columns(np.zeros(view.allowed.shape))[4].astype(bool)
        for b, robot in enumerate(sim.world.robots):
            if robot.active:
                assert cheapest[b].any()
                assert (view.total[b, cheapest[b]] == view.outside[b]).all()


@pytest.mark.paper("C7", "chosen")
def test_a_gain_is_highest_for_the_group_that_a_guide_chooses():
    """Within its detour; nobody is fetched where leading out at once saves more."""
    rng = np.random.default_rng(0)
    chosen = 0
    for _ in range(500):
        counts = rng.integers(1, 6, size=5)
        metres, out = rng.uniform(2, 30, size=(2, 5))
        here = rng.uniform(2, 30)
        led = int(rng.integers(0, 5))
        found = [
            Group(np.ones(count, bool), k, (0.0, 0.0), float(metres[k]))
            for k, count in enumerate(counts)
        ]
        group = choose(found, Way(0, here, out), led, DETOUR)
        more, detour = gains(
            (metres + out)[None], np.array([here]), counts[None], np.array([led])
        )
        worth = np.where(detour[0] <= 1, more[0], -1)
        if group is None:
            assert worth.max() <= 0
        else:
            assert worth.argmax() == group.place
            chosen += 1
    assert 100 < chosen < 500
