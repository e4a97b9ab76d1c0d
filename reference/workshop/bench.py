"""Measure how fast maps are read, crowds walk, rollouts are played and learners learn.

Clauses: B8, E1, E2, E3.  All but the learners use one core. The whole simulation
(sight, minds, robots, fire) is timed beside its bodies alone: compare these, not
machines.
"""

from dataclasses import replace
from statistics import median
from time import perf_counter
from typing import Any

import numpy as np
from tqdm import tqdm

from reference import motion
from reference.building import Building, plan_of
from reference.learning.adversarial import learner_for, player_of
from reference.learning.experience import Trajectory
from reference.learning.networks import one_thread
from reference.learning.ppo import Learner
from reference.learning.rollouts import Job, play
from reference.learning.settings import SIDES, Side
from reference.paper import PEOPLE, InputError, Scenario
from reference.simulation import Simulation
from reference.strategies import RandomFire
from reference.workshop.lockstep import together
from reference.workshop.maps import find, read
from reference.workshop.strategies.robots import Sweep
from reference.workshop.training.presets import preset

RUNS = 5  # seeds of a crowd
CASES = {
    "40": (PEOPLE, 20.0),
    "400": (10 * PEOPLE, 20.0),
    "40_whole": (PEOPLE, Scenario.time_limit),
}
"""People, and seconds after which a run stops; in the first 20 everybody is inside."""

Speeds = dict[str, float]
PRESETS = ("paper", "laptop")
EPISODES = 16  # in lockstep, in one process with one thread
BATCHES = 4  # minibatches of a measured update, at least


def measure(name: str, seed: int) -> dict[str, Any]:
    """Measure a building, by path or name; crowds by medians of RUNS seeds from `seed`.

    load_seconds        until the first tick can begin: text, checks, ways and sight
    person_seconds_per_second, bodies_alone  of each of the CASES whose people fit
    decisions_per_second  of robots in a preset's rollouts, networks and world included
    samples_per_second  agent-decisions that a preset's learner takes in, each epoch of
                        an update counted; robots by MA-POCA, fire by PPO; all cores

    Networks are untrained, so episodes last long. Raises what reading a map raises.
    """
    start = perf_counter()
    building = Building(read(find(name)))
    Simulation(building)
    facts: dict[str, Any] = {"building": name, "seed": seed}
    facts["load_seconds"] = perf_counter() - start
    whole, bare = _crowds(building, range(seed, seed + RUNS))
    facts |= {"person_seconds_per_second": whole, "bodies_alone": bare}
    facts |= {"decisions_per_second": {}, "samples_per_second": {}}
    for each in tqdm(PRESETS, unit="preset", disable=None, leave=False):
        decisions, samples = _learning(each, building, seed)
        facts["decisions_per_second"][each] = decisions
        facts["samples_per_second"][each] = samples
    return facts


def table(title: str, facts: dict[str, Any]) -> str:
    """Format the figures as text."""
    crowds, bare = facts["person_seconds_per_second"], facts["bodies_alone"]
    lines = [
        f"{title}: read, checked and prepared in {facts['load_seconds']:.2f} s",
        f"{'person-seconds per second':27}{'everything on':>15}{'bodies alone':>15}",
    ]
    for case, speed in crowds.items():
        people, seconds = CASES[case]
        what = "whole" if case.endswith("whole") else f"first {seconds:.0f} s"
        what = f"{people} people, {what}"
        lines.append(f"{what:27}{speed:15,.0f}{bare[case]:15,.0f}")
    for name, speed in facts["decisions_per_second"].items():
        samples = facts["samples_per_second"][name].items()
        learners = ", ".join(f"{side} {count:,.0f}" for side, count in samples)
        lines.append(
            f"preset {name}: {speed:,.0f} robot decisions per second of rollouts; "
            f"learners, samples per second: {learners}"
        )
    return "\n".join(lines)


def _crowds(building: Building, seeds: range) -> tuple[Speeds, Speeds]:
    """Measure person-seconds per second of each case: everything on, bodies alone."""
    whole, bare = Speeds(), Speeds()
    for case, (people, end) in tqdm(CASES.items(), disable=None, leave=False):
        scenario = Scenario(people=people)
        try:
            runs = [
                Simulation(building, scenario, Sweep(), RandomFire(), seed)
                for seed in seeds
            ]
        except InputError:  # they do not fit
            continue
        bare[case] = median(_bare_speed(run, end) for run in runs)
        whole[case] = median(_speed(run, end) for run in runs)
    return whole, bare


def _speed(simulation: Simulation, end: float) -> float:
    """Person-seconds per second of a run up to a time."""
    start = perf_counter()
    while not simulation.done and simulation.world.time < end:
        simulation.step()
    return simulation.person_seconds / (perf_counter() - start)


def _bare_speed(simulation: Simulation, end: float) -> float:
    """The same of bodies alone: everybody walks to where somebody else began."""
    bodies, tick = simulation.world.bodies, simulation.tick
    position, floor, navigation = bodies.position, bodies.floor, simulation.navigation

    def free(spots: np.ndarray, who: np.ndarray) -> np.ndarray:
        return navigation.walkable[navigation.places_at(floor[who], spots)]

    aim, ticks = np.roll(position, 1, axis=0), round(end / tick)
    rng = simulation.rng["bodies"]
    start = perf_counter()
    for _ in range(ticks):
        position = motion.step(position, floor, aim, bodies.pace, tick, free, rng)
    return len(bodies) * ticks * tick / (perf_counter() - start)


def _learning(name: str, building: Building, seed: int) -> tuple[float, Speeds]:
    """Measure a preset: robot decisions, and each learner's samples, per second."""
    settings, plan = preset(name), plan_of(building)
    learners: dict[Side, Learner] = {}
    players: dict[str, Any] = {}
    for side in SIDES:
        trainer = getattr(settings, side)
        learners[side] = learner_for(side, plan, settings.scenario, trainer, seed)
        players[side] = player_of(learners[side])
    seeds = tuple(range(seed, seed + EPISODES))
    job = Job(plan, settings.scenario, **players, seeds=seeds)
    with one_thread():
        play(replace(job, seeds=job.seeds[:1]), together)  # warm up
        start = perf_counter()
        episodes = play(job, together)
        seconds = perf_counter() - start
    played = {side: [t for e in episodes if (t := getattr(e, side))] for side in SIDES}
    decisions = sum(t.steps for t in played["robots"])
    return decisions / seconds, {s: _samples(learners[s], played[s]) for s in SIDES}


def _samples(learner: Learner, trajectories: list[Trajectory]) -> float:
    """Samples per second of an update that learns from these as often as it takes."""
    s, steps = learner.settings, sum(t.steps for t in trajectories)
    often = -(-BATCHES * s.batch_size // steps)
    for _ in range(2):  # the first one warms up
        learner.add(trajectories * often)
        start = perf_counter()
        learner.update()
        seconds = perf_counter() - start
    return often * steps * s.num_epoch / seconds
