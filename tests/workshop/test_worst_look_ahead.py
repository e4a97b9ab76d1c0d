"""The fire that looks ahead: what it tries out, what it takes, and what that costs."""

from itertools import pairwise

import numpy as np
import pytest
from movies import robots_named, shipped, stage, wait

from reference.building import Kind
from reference.events import FireLit
from reference.fire import free_places
from reference.game.rewards import group_reward
from reference.navigation import navigation_of
from reference.paper import PEOPLE, Scenario
from reference.simulation import Simulation
from reference.strategies import RandomFire
from reference.workshop.evaluation.worst_case import WorstCase, placements
from reference.workshop.evaluation.worst_case.look_ahead import FirstAt
from reference.workshop.evaluation.worst_case.value_estimate import value_estimate
from reference.workshop.strategies.fires import BusiestFire

SHORT = (3, 4.0)
"""Three placements, four seconds: enough for a test."""

BRIEF = {"people": 8, "sources": 2, "time_limit": 50.0}


def against(fire, name="tiny", people=12, robots="sweep", seed=0, **scenario):
    """An evacuation of a building that ships, not yet begun."""
    scene = Scenario(people=people, **scenario)
    return Simulation(shipped(name), scene, robots_named(robots), fire, seed)


def lit(sim):
    """Where fires broke out."""
    return [e for e in sim.events if isinstance(e, FireLit)]


# -- What it chooses among ----------------------------------------------------------


@pytest.mark.paper("F4", "chosen")
@pytest.mark.paper("D6")
@pytest.mark.parametrize("seconds", [0, 20, 60])
def test_placements_are_free_cells_of_rooms(seconds):
    """Where a fire can break out: about sixty of them in the paper's building."""
    sim = against(RandomFire(), "paper", PEOPLE)
    wait(sim, seconds)
    choice = placements(sim.world, sim.scenario)
    free, nav = free_places(sim.world), navigation_of(sim.building)
    assert 40 < len(choice) == len(set(choice)) < 70
    assert all(free[nav.place(*placement)] for placement in choice)


@pytest.mark.paper("F4", "chosen")
def test_the_placement_that_most_people_must_come_past_is_the_first():
    """Beside the only exit, not in the far corner."""
    sim = stage(
        """
        ###############
        #p..q..+......E
        #......#......#
        #r..s..#......#
        ###############
        """
    )
    first = placements(sim.world, sim.scenario)[0]
    assert sim.building.cell(*first[1:])[1] >= 6


@pytest.mark.parametrize("fire", [BusiestFire(), WorstCase()])
def test_where_nobody_is_inside_there_is_no_placement(fire):
    """And those who look for the worst one burn anywhere."""
    sim = stage("#######\n#.....E\n#######")
    assert placements(sim.world, sim.scenario) == []
    if isinstance(fire, WorstCase):
        fire.watch(sim.copy())
    assert fire.decide(sim.world, np.random.default_rng(0))[0] == 0


# -- What it takes ------------------------------------------------------------------


@pytest.mark.paper("F4", "Eq. 5")
def test_it_takes_the_worst_of_what_it_has_simulated():
    """Each in a future of its own that the others share; none of them is the real."""
    fire, asked = WorstCase(*SHORT), []

    class Told:
        watch = fire.watch

        def decide(self, world, rng):
            place = fire.decide(world, rng)
            asked.append((place, fire.foreseen))
            return place

    against(Told(), people=20, time_limit=40.0).run()
    assert len(asked) >= 2
    for place, foreseen in asked:
        rewards = [reward for reward, _ in foreseen]
        assert len(foreseen) == 3 and rewards == sorted(rewards)
        assert place == foreseen[0].placement


@pytest.mark.paper("F4", "Eq. 5")
def test_what_it_foresees_to_the_end_is_what_comes_in_that_future():
    """Simulated to the end nothing is estimated: the reward is the reward."""
    sim = against("none", people=10, seed=2)
    for _ in range(50):
        sim.step()
    fire = WorstCase(2, 1e9)
    fire.watch(sim.copy())
    fire.decide(sim.world, np.random.default_rng(5))
    seed = int(np.random.default_rng(5).integers(2**32))
    for reward, placement in fire.foreseen:
        run = sim.another_future(seed)
        run.fire_strategy = FirstAt(placement)
        run.run()
        comes = group_reward(run.events) - group_reward(sim.events)
        assert reward == pytest.approx(comes)


@pytest.mark.paper("F4", "chosen")
def test_what_comes_after_the_horizon_is_an_estimate():
    """A tick after the fire nothing has happened yet, and all is to be hoped for."""
    sim = against("none", people=10, seed=2)
    fire = WorstCase(1, sim.tick)
    fire.watch(sim.copy())
    fire.decide(sim.world, np.random.default_rng(5))
    hoped = value_estimate(sim.world)
    assert fire.foreseen[0].reward == pytest.approx(hoped, rel=0.02)


@pytest.mark.paper("F4", "Eq. 5")
def test_it_burns_the_only_way_out():
    """One source against four people behind a door: before the way, not behind them."""
    fire = WorstCase(8, 30.0)
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
        fire=fire,
        sources=1,
    )
    sim.run()
    (source,) = lit(sim)
    assert sim.building.cell(source.x, source.y)[1] >= 5


def test_the_same_seed_burns_the_same():
    """Looking ahead has no chances of its own, and no memory of the run before."""
    fire = WorstCase(*SHORT)
    runs = [against(each, seed=3, **BRIEF) for each in (fire, WorstCase(*SHORT), fire)]
    for run in runs:
        run.run()
    assert runs[0].events == runs[1].events == runs[2].events and lit(runs[0])


def test_it_does_not_know_how_flames_will_really_spread():
    """Two buildings that differ in what is to come alone: it takes the same place."""
    sim = against("random", people=12, seed=1)
    for _ in range(50):
        sim.step()
    places = []
    for future in (1, 2):
        now, fire = sim.another_future(future), WorstCase(*SHORT)
        fire.watch(now)
        places.append(fire.decide(now.world, np.random.default_rng(0)))
    assert places[0] == places[1]


def test_a_simulation_against_it_can_be_copied():
    """And runs on like the original."""
    sim = against(WorstCase(*SHORT), seed=4, **BRIEF)
    for _ in range(60):
        sim.step()
    other = sim.copy()
    sim.run(), other.run()
    assert sim.events == other.events


# -- What it costs ------------------------------------------------------------------


@pytest.mark.paper("F4", "linear complexity")
def test_its_cost_is_linear_in_the_number_of_decisions(monkeypatch):
    """Four seconds for each of three placements at every decision, never more."""
    step, steps, ticks = Simulation.step, [], []
    monkeypatch.setattr(Simulation, "step", lambda s: [steps.append(s), step(s)][1])
    for sources in (0, 1, 2):
        fire = WorstCase(*SHORT)
        sim = against(fire, people=6, sources=sources, time_limit=60.0)
        sim.world.bodies.pace[:] = 0  # nobody gets out, so that no look is cut short
        sim.run()
        assert len(lit(sim)) == sources
        ticks.append(len(steps) - sim.ticks)
        steps.clear()
    (each,) = {after - before for before, after in pairwise(ticks)}
    assert each == 3 * round(4.0 / sim.tick)


@pytest.mark.paper("A6")
def test_placements_are_never_in_doors_or_entrances():
    """Beside what leads out means on the floor."""
    sim = against("none", "paper", PEOPLE)
    nav, kind = navigation_of(sim.building), sim.building.kind.ravel()
    choice = placements(sim.world, sim.scenario)
    assert {kind[nav.place(*p)] for p in choice} == {Kind.FLOOR}
