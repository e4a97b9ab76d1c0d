"""Measure how fast maps are read, crowds walk, rollouts are played and learners learn.

On one core; seconds are the processor's, so that what else runs
on a machine changes little.
"""

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial
from statistics import median
from time import process_time
from typing import Any

from tqdm import tqdm

from reference import paper
from reference.building import Building
from reference.fire import RandomFire
from reference.learning.experience import Trajectory
from reference.learning.ppo import Learner
from reference.learning.rollouts import Episode, play
from reference.learning.settings import SIDES, Side
from reference.paper import InputError, Scenario
from reference.simulation import Simulation
from reference.workshop.engine import together
from reference.workshop.maps import find_map, plan_of, read_map
from reference.workshop.storage.workers import one_thread
from reference.workshop.strategies.guides import Sweep
from reference.workshop.training.checkpoints import Task
from reference.workshop.training.presets import preset
from reference.workshop.training.rounds import Training

REPEATS = 5  # seeds of a crowd
BENCH_PRESETS = ("paper", "laptop")
BATCHES = 4  # minibatches of a measured update, at least

_bar = partial(tqdm, disable=None, leave=False)  # shown on a terminal


def crowd_cases() -> dict[str, tuple[int, float]]:
    """People, and seconds until a run stops; in the first 20 everybody is inside."""
    forty = paper.PEOPLE
    return {
        f"{forty} people, first 20 s": (forty, 20.0),
        f"{10 * forty} people, first 20 s": (10 * forty, 20.0),
        f"{forty} people, whole": (forty, Scenario().time_limit),
    }


def measure_speed(name: str, seed: int) -> dict[str, Any]:
    """Measure a building, by path or name; return figures by what was measured.

    load_seconds        until the first tick can begin: text, checks, ways and sight
    person_seconds_per_second  of each of `crowd_cases` whose people fit, medians over
    RUNS decisions_per_second  of robots in a preset's first round, networks and world
                        included
    samples_per_second  agent-decisions that a preset's learner takes in, each epoch of
                        an update counted; robots by MA-POCA, fire by PPO

    Networks are untrained, so episodes last long. Raises what reading a map raises.
    """
    start = process_time()
    building = Building(read_map(find_map(name)))
    Simulation(building)
    loading = process_time() - start

    speeds: dict[str, float] = {}
    for case in crowd_cases():
        with suppress(InputError):  # they do not fit
            speeds[case] = median(_walk_crowds(building, case, seed))

    decisions: dict[str, float] = {}
    samples: dict[str, float] = {}
    for each in BENCH_PRESETS:
        decisions[each], learners = _measure_learning(each, building, seed)
        for side, speed in learners.items():
            samples[f"{each}, {side}"] = speed

    return {
        "load_seconds": {name: loading},
        "person_seconds_per_second": speeds,
        "decisions_per_second": decisions,
        "samples_per_second": samples,
    }


def _walk_crowds(building: Building, case: str, seed: int) -> Iterator[float]:
    """Yield person-seconds per second of runs up to a time."""
    people, end = crowd_cases()[case]
    for k in _bar(range(seed, seed + REPEATS), case):
        scenario = Scenario(people=people)
        simulation = Simulation(building, scenario, Sweep(), RandomFire(), k)
        start = process_time()
        while not simulation.done and simulation.world.time < end:
            simulation.step()
        yield simulation.person_seconds / (process_time() - start)


def _measure_learning(
    name: str, building: Building, seed: int
) -> tuple[float, dict[Side, float]]:
    """Measure a preset: robot decisions, and each learner's samples, per second."""
    training = Training(Task("", plan_of(building), preset(name), seed))
    jobs = training.jobs()
    with one_thread():
        # warm up
        play(replace(jobs[0], seeds=jobs[0].seeds[:1]), advance=together)

        start = process_time()
        played = []
        for job in _bar(jobs, name):
            played += play(job, advance=together)
        seconds = process_time() - start

        speeds = {}
        lives = {side: _lives(played, side) for side in SIDES}
        for side, learner in _bar(training.learners.items(), name):
            speeds[side] = _samples(learner, lives[side])
    return sum(life.steps for life in lives["robots"]) / seconds, speeds


def _lives(played: Sequence[Episode], side: Side) -> list[Trajectory]:
    """Collect a side's trajectories; an episode may have none."""
    lives = (getattr(episode, side) for episode in played)
    return [life for life in lives if life]


def _samples(learner: Learner, lives: Sequence[Trajectory]) -> float:
    """Measure samples per second of an update that learns from these, repeated."""
    s = learner.settings
    steps = sum(life.steps for life in lives)
    # so many copies that an update takes at least BATCHES minibatches
    often = -(-BATCHES * s.batch_size // steps)
    for _ in range(2):  # the first one warms up
        learner.add([*lives] * often)
        start = process_time()
        learner.update()
        seconds = process_time() - start
    return often * steps * s.num_epoch / seconds
