"""Robots that are deceived: within the bound, never to their good, exactly at zero."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from movies import shipped, wait
from trainings import begun, tiny

from reference.game.moments import Moment
from reference.game.observations import robot_vectors, robots_at_work
from reference.paper import Scenario
from reference.simulation import Simulation
from reference.strategies import RandomFire
from reference.workshop.evaluation.worst_case.perturbed import (
    PerturbedRobots,
    perturbable,
)
from reference.workshop.strategies.robots import Sweep
from reference.workshop.training.checkpoints import CheckpointError
from reference.workshop.training.policies import LearnedRobots

HEADS = ["pointer", "gaussian"]


@cache
def checkpoint(head="pointer", trainer="poca"):
    """Robots of the tiny building that have learned nothing yet."""
    return begun(tiny(robots={"head": head, "trainer_type": trainer})).checkpoint()


def moment(robots, seconds, seed=1):
    """An evacuation of the tiny building after some seconds."""
    scenario = replace(robots.scenario_to_evaluate(), time_limit=60.0)
    sim = Simulation(shipped("tiny"), scenario, Sweep(), RandomFire(), seed)
    wait(sim, seconds)
    return sim.world


def attacked(robots, world, seed=0):
    """What robots observe in truth, and the worst that was found."""
    seen = robot_vectors(world, robots.scenario)
    truth = Moment.of(world, seen, robots_at_work(world))
    return seen, robots.attack(truth, np.random.default_rng(seed))


@pytest.mark.paper("F4", "Eq. 5")
@pytest.mark.parametrize("head", HEADS)
def test_with_nothing_off_robots_do_exactly_what_they_would(head):
    """From the first decision to the last."""
    saved = checkpoint(head)
    pair = LearnedRobots(saved), PerturbedRobots(saved, epsilon=0)
    plain, same = (
        Simulation(
            shipped("tiny"), robots.scenario_to_evaluate(), robots, RandomFire(), seed=2
        )
        for robots in pair
    )
    assert str(plain.run()) == str(same.run()) and plain.events == same.events


@pytest.mark.paper("F4", "Eq. 5")
@pytest.mark.parametrize("head", HEADS)
@given(epsilon=st.floats(0.01, 30), seconds=st.integers(0, 40), seed=st.integers(0, 99))
@settings(max_examples=8)
def test_nothing_is_off_by_more_than_epsilon(head, epsilon, seconds, seed):
    """And only what may be: positions of those who are there."""
    robots = PerturbedRobots(checkpoint(head), epsilon)
    truth, worst = attacked(robots, moment(robots, seconds, seed), seed)
    free = [perturbable(row, robots.building, robots.scenario) for row in truth]
    off = np.abs(worst.seen - truth)
    assert off.max() <= epsilon + 1e-4 and not off[~np.array(free)].any()


@pytest.mark.paper("F4", "Eq. 5")
@pytest.mark.parametrize("head", HEADS)
def test_the_worst_that_is_found_is_what_the_robots_then_do(head):
    """It is an action of theirs, one that they take when they observe that."""
    robots = PerturbedRobots(checkpoint(head), epsilon=3.0)
    world = moment(robots, 12)
    _, worst = attacked(robots, world)
    alive = np.ones(len(worst.seen), dtype=bool)
    (emitted,), _ = robots.player.act([Moment.of(world, worst.seen, alive)])
    np.testing.assert_allclose(emitted, worst.emitted, atol=1e-6)


@pytest.mark.paper("F4", "Eq. 5")
@pytest.mark.parametrize("head", HEADS)
def test_the_critic_never_thinks_better_of_it(head):
    """Worse at once with a large error; more tries find no less."""
    world = moment(PerturbedRobots(checkpoint(head)), 0)
    found = []
    for epsilon, tries in ((0.0, 1), (5.0, 1), (5.0, 16)):
        robots = PerturbedRobots(checkpoint(head), epsilon)
        robots.tries = tries
        _, worst = attacked(robots, world)
        found.append(worst.value)
    plain, one, many = found
    assert one <= plain and many < plain


def test_the_order_of_people_and_all_that_is_no_position_stay():
    """Of the paper's 167 numbers 108 may be off once all fires are lit."""
    building, scenario = shipped("paper"), Scenario()
    sim = Simulation(building, scenario, Sweep(), RandomFire(), seed=0)
    row = robot_vectors(sim.world, scenario)[0]
    assert perturbable(row, building, scenario).sum() == 2 * (40 + 6)
    row[142:164:3] = 0  # storeys of all fires: they are there
    free = perturbable(row, building, scenario)
    assert free.sum() == 108
    assert not free[2:164:3][:46].any() and not free[138:140].any()
    assert not free[164:].any()


def test_the_same_generator_finds_the_same():
    """Its chances are the simulation's."""
    robots = PerturbedRobots(checkpoint(), epsilon=2.0)
    world = moment(robots, 12)
    one, other = (attacked(robots, world, seed=5)[1] for _ in range(2))
    assert np.array_equal(one.seen, other.seen) and one[2:] == other[2:]


@pytest.mark.parametrize("epsilon", [-1, np.nan, np.inf])
def test_refuses_an_error_that_is_none(epsilon):
    """Negative or endless."""
    with pytest.raises(ValueError, match="give metres from 0 upwards"):
        PerturbedRobots(checkpoint("pointer"), epsilon)


def test_refuses_robots_whose_critic_judges_no_actions():
    """PPO's values know nothing of what is done."""
    with pytest.raises(CheckpointError, match=r"Name robots that learned by poca"):
        PerturbedRobots(checkpoint(trainer="ppo"))
