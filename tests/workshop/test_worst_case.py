"""The worst case: what the fire tries out, what it takes, and what that costs."""

from itertools import pairwise

import numpy as np
import pytest
from movies import built, found, robots_named, shipped, stage
from scipy.stats import ks_2samp

from reference.beginning import with_people_at
from reference.fire import Spread, free_places
from reference.game.rewards import group_reward
from reference.navigation import navigation_of
from reference.paper import Scenario
from reference.simulation import Simulation
from reference.strategies import NoFire, NoRobots
from reference.workshop.crossplay.contestants import encounter
from reference.workshop.strategies.fires import APART, busiest
from reference.workshop.worst_case import FirstAt, WorstCase, another_future
from reference.world import FireLit

BRIEF = {"people": 8, "sources": 2, "time_limit": 50.0}


def against(robots="sweep", seed=0, **scenario):
    """An evacuation of a small building against the worst case, not yet begun."""
    scene = Scenario(**{"people": 12, **scenario})
    plan = shipped("tiny")
    return encounter(plan, scene, robots_named(robots), WorstCase(), seed)


# -- What it chooses among ----------------------------------------------------------


@pytest.mark.paper("F4", "chosen")
@pytest.mark.paper("D6")
def test_it_chooses_among_free_cells_that_people_cross_and_that_lie_apart():
    """The busiest first."""
    sim = Simulation(shipped("paper"), Scenario())
    nav, free = navigation_of(sim.building), free_places(sim.world)
    places = [nav.place(*decision) for decision in busiest(sim.world, 6)]
    assert len(places) == 6 and free[places].all()
    for one, other in pairwise(places):
        same_floor = one // nav.floor_size == other // nav.floor_size
        metres = np.hypot(*(nav.centres[one] - nav.centres[other]))
        assert not same_floor or metres >= APART


# -- What it takes ------------------------------------------------------------------


@pytest.mark.paper("F4", "Eq. 5")
def test_it_takes_the_cell_that_leaves_least_reward_to_the_end():
    """Of the busiest, each played out in the same future."""
    sim = against("none", people=10, seed=2)
    for _ in range(50):
        sim.step()
    fire, world, rng = sim.fire_strategy, sim.world, np.random.default_rng(5)
    taken = fire.decide(world, rng)
    seed = int(np.random.default_rng(5).integers(2**32))
    left = {}
    for place in busiest(world, 4):
        robots = NoRobots()
        future = another_future(world, sim.scenario, robots, FirstAt(place), seed)
        future.run()
        left[place] = group_reward(future.events)
    assert len(left) == 4 and left[taken] == min(left.values()) < max(left.values())


@pytest.mark.paper("F4", "Eq. 5")
def test_it_burns_the_only_way_out():
    """One source against four people behind a door: before the way, not behind them."""
    sim = stage(
        """
        #################
        #......#........#
        #.pq...#........#
        #......+........E
        #.rs...#........#
        #......#........#
        #################
        """,
        fire=WorstCase(),
        sources=1,
    )
    sim.run()
    (source,) = sim.world.flames.sources
    assert sim.building.cell(source.x, source.y)[1] > 3


def test_it_asks_copies_of_the_robots():
    """What these imagine does not change what they do."""
    sim = against("patrol", seed=4, **BRIEF)
    for _ in range(50):
        sim.step()
    before = repr(vars(sim.robot_strategy))
    sim.fire_strategy.decide(sim.world, np.random.default_rng(0))
    assert repr(vars(sim.robot_strategy)) == before


# -- What it costs ------------------------------------------------------------------


@pytest.mark.paper("F4", "linear complexity")
def test_its_cost_is_linear_in_the_number_of_decisions(monkeypatch):
    """Four futures at most at every decision, whatever was decided before."""
    begun = []
    monkeypatch.setattr(
        "reference.workshop.worst_case.to_the_end",
        lambda futures: begun.append(len(futures)),
    )
    for sources in (0, 1, 2):
        begun.clear()
        sim = against(people=6, sources=sources, time_limit=60.0)
        sim.world.bodies.pace[:] = 0  # nobody gets out, so that every turn comes
        sim.run()
        assert len(begun) == sources and max(begun, default=0) <= 4


# -- Another future -----------------------------------------------------------------


@pytest.mark.paper("F4", "chosen")
def test_another_future_has_the_same_past_and_draws_the_rest_anew():
    """What burns has burnt since the same time; flames spread otherwise from there."""
    sim = Simulation(shipped("tiny"), Scenario(), fire=FirstAt((0, 5.5, 0.5)))
    for _ in range(100):
        sim.step()
    before, now = sim.world.flames.arrival.copy(), sim.world.time
    one, other = (
        another_future(sim.world, sim.scenario, NoRobots(), NoFire(), seed).world
        for seed in (1, 2)
    )
    past = before <= now
    assert past.any() and np.array_equal(one.flames.arrival[past], before[past])
    assert one.flames.arrival[~past].min() > now
    assert not np.array_equal(one.flames.arrival, other.flames.arrival)
    assert np.array_equal(sim.world.flames.arrival, before)


@pytest.mark.paper("D7", "chosen")
@pytest.mark.usefixtures("unprotected")
@pytest.mark.parametrize("lane", ["#.pq..E", "#p+q..E"])
def test_fresh_delays_are_distributed_like_what_is_left_of_the_old(lane):
    """A delay that is not over forgets how long it has lasted, a door's too."""
    building = built(f"{'#' * len(lane)}\n{lane}\n{'#' * len(lane)}")
    (_, _, p), (_, _, q) = found([[lane]], "pq")
    source, rng = FireLit(0.0, 0, *building.metres(1, p)), np.random.default_rng(0)
    scenario, came, comes = Scenario(people=0), [], []
    empty = np.zeros(0, dtype=int), np.zeros((0, 2))
    while len(came) < 200:
        world = with_people_at(building, scenario, *empty, rng)
        Spread(building, rng).ignite(world.flames, source)
        world.time, arrival = 12.0, world.flames.arrival
        if (arrival <= 12).sum() == 2 and arrival[0, 1, q] > 12:
            came.append(arrival[0, 1, q])
            seed = len(came)
            after = another_future(world, scenario, NoRobots(), NoFire(), seed)
            comes.append(after.world.flames.arrival[0, 1, q])
    assert ks_2samp(came, comes).pvalue > 0.01
