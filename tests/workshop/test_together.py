"""Many simulations together, by the engine or the book, and nobody can tell."""

from dataclasses import fields, replace
from typing import Any

import numpy as np
import pytest

from reference.learning.adversarial import learner_for, player_of
from reference.learning.rollouts import Job, play
from reference.paper import Scenario
from reference.simulation import Simulation
from reference.workshop.comparing.named import set_up_match
from reference.workshop.engine import run_to_decision, run_to_end
from reference.workshop.maps import load, to_text
from reference.workshop.strategies import SCRIPTS
from reference.workshop.strategies.guides import Sweep
from reference.workshop.strategies.worst_case import WorstCase
from reference.workshop.training.presets import preset


def everything(run: Simulation) -> list[Any]:
    """All that a simulation is at the end, down to its random generators."""
    world = run.world
    bodies = world.bodies
    found: list[Any] = [repr(run.outcome()), run.ticks, run.person_seconds, world.minds]
    found += [(type(e).__name__, *vars(e).values()) for e in run.events]
    found += [getattr(bodies, part.name).tobytes() for part in fields(bodies)]
    found += [world.flames.burning.tobytes(), world.burnt]
    found += [run.full_until.tobytes()]
    found += [(*r.position, r.place, r.active, r.says, r.way) for r in world.robots]
    return [*found, *(rng.bit_generator.state for rng in run.rng.values())]


def runs(name: str, robots: str, fire: str, **settings: Any) -> list[Simulation]:
    """Four simulations of a building, ready to begin."""
    building = load(name)
    scenario = Scenario(**settings)
    guide = SCRIPTS["robots"][robots]
    foe = SCRIPTS["fire"][fire]
    return [Simulation(building, scenario, guide(), foe(), k) for k in range(4)]


def same_end(alone: list[Simulation], others: list[Simulation]) -> bool:
    """Run the first ones by the book, the others together; do all end the same?"""
    for run in alone:
        run.run()
    run_to_end(others)
    return [everything(run) for run in others] == [everything(run) for run in alone]


@pytest.mark.paper("A5")
@pytest.mark.paper("A9")
@pytest.mark.paper("B3")
@pytest.mark.paper("B7")
@pytest.mark.paper("C7")
@pytest.mark.parametrize(
    "name, robots, fire, settings",
    [
        ("paper", "sweep", "greedy", {"time_limit": 40.0}),
        ("paper", "none", "none", {"time_limit": 20.0}),
        ("tiny", "patrol", "random", {"people": 6}),
        ("tiny", "random", "none", {"time_limit": 30.0}),
    ],
)
def test_all_ends_as_if_each_had_been_alone(name, robots, fire, settings):
    """To the last bit: people, minds, robots, flames, events and random numbers."""
    single = runs(name, robots, fire, **settings)
    others = runs(name, robots, fire, **settings)
    assert same_end(single, others)
    assert robots != "patrol" or len({run.ticks for run in single}) > 1


def test_simulations_that_are_not_alike_run_beside_each_other():
    """Other buildings, people or robots; some are over before the others."""

    def mixed():
        some = runs("tiny", "sweep", "random", people=6, time_limit=30.0)
        return some + runs("tiny", "none", "none", time_limit=20.0)

    assert same_end(mixed(), mixed())


def test_a_copy_of_a_simulation_that_runs_with_others_is_its_own():
    """It may run on alone."""
    lone = runs("tiny", "sweep", "random", time_limit=30.0)
    some = runs("tiny", "sweep", "random", time_limit=30.0)
    run_to_decision(some)
    copies = [run.copy() for run in some]
    run_to_end(some)
    assert same_end(copies, lone)


@pytest.mark.paper("F4")
def test_a_fire_that_looks_ahead_finds_each_world_as_it_is():
    """Beside others it burns where it burns alone."""
    building = load("tiny")
    scene = Scenario(people=6, time_limit=40.0)

    def matches():
        return [
            set_up_match(building, scene, Sweep(), WorstCase(), seed)
            for seed in range(2)
        ]

    some = matches()
    assert same_end(matches(), some)
    assert all(run.world.flames.sources for run in some)


def learned(side, settings, plan, scenario, head="mixture"):
    """A new policy of one side."""
    trainer = replace(getattr(settings, side), head=head)
    return player_of(learner_for(side, plan, scenario, trainer, 0))


@pytest.mark.parametrize("head", ["floor", "mixture", "set"])
def test_episodes_are_the_same_whoever_steps_the_worlds(head):
    """Learned robots and fires: facts, and every number of the trajectories."""
    settings = preset("tiny")
    plan = to_text(load("tiny").drawing)
    sides: dict[str, Any] = {
        "robots": learned("robots", settings, plan, settings.scenario, head),
        "fire": learned("fire", settings, plan, settings.scenario),
    }
    job = Job(plan, settings.scenario, **sides, seeds=(1, 2, 3))
    alone = play(job)
    others = play(job, advance=run_to_decision)
    for one, other in zip(alone, others, strict=True):
        assert one.facts == other.facts
        for side in sides:
            mine = vars(getattr(one, side))
            theirs = vars(getattr(other, side))
            for name in mine:
                assert np.array_equal(mine[name], theirs[name]), name
