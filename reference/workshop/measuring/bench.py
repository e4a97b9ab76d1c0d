"""Measure how fast crowds walk, rollouts are played and learners learn.

By the book and by the engine, which compute the same. On one core; seconds are the
processor's, so that what else runs on a machine changes little.
"""

import os
import subprocess
import sys
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory
from time import process_time

from tqdm import tqdm

from reference import paper
from reference.building import Building
from reference.game.environment import Advance, until_next_decision
from reference.learning.experience import Trajectory
from reference.learning.ppo import Learner
from reference.learning.rollouts import Episode, Job, play
from reference.learning.settings import Side
from reference.paper import InputError, Scenario
from reference.simulation import Simulation
from reference.workshop import engine
from reference.workshop.maps import find_map, plan_of, read_map
from reference.workshop.storage.workers import one_thread
from reference.workshop.strategies import SCRIPTS
from reference.workshop.training.checkpoints import Task
from reference.workshop.training.presets import preset
from reference.workshop.training.rounds import Training

BENCH_PRESETS = ("paper", "laptop")
BATCHES = 4  # minibatches of a measured update, at least

Figures = dict[str, float | None]
"""By who plays, "book" and "engine", or "both" where that makes no difference."""

_bar = partial(tqdm, disable=None, leave=False)  # shown on a terminal


@dataclass(frozen=True)
class TimedRuns:
    """Evacuations to play: who guides, what burns, until when, how many."""

    people: int
    robots: str
    fire: str
    seconds: float
    runs: int


def cases_to_time() -> dict[str, TimedRuns]:
    """List what is played and timed, by what it is called."""
    forty = paper.PEOPLE
    many = 10 * forty
    whole = Scenario().time_limit
    return {
        f"{forty} people, no guide, no fire, 8 runs": TimedRuns(
            forty, "none", "none", whole, 8
        ),
        f"{many} people, the same, first 20 s, 4 runs": TimedRuns(
            many, "none", "none", 20.0, 4
        ),
        f"{forty} people, escort, busiest, 16 runs": TimedRuns(
            forty, "escort", "busiest", whole, 16
        ),
    }


def measure_speed(name: str, seed: int) -> dict[str, dict[str, Figures]]:
    """Measure a building, by path or name; return figures of each thing measured.

    load_seconds        until the first tick can begin: text, checks, ways and sight
    compile_seconds     until the engine has played a first decision: from nothing, and
                        from what an earlier process has compiled
    microseconds_per_tick  of one world, in each of `cases_to_time` whose people fit
    person_seconds_per_second  simulated there
    decisions_per_second  of robots in a preset's first round, networks and world
                        included
    samples_per_second  agent-decisions that a preset's learner takes in, each epoch of
                        an update counted; robots by MA-POCA, fire by PPO

    What the engine would have measured is None where it stands aside. Networks are
    untrained, so episodes last long. Raises what reading a map raises, and InputError
    for a building in which the people of the presets do not fit.
    """
    start = process_time()
    building = Building(read_map(find_map(name)))
    try:
        Simulation(building)
    except InputError as error:
        raise InputError(
            f"{name}: is too small: {paper.PEOPLE} people take part in what is "
            "measured. Name a larger map."
        ) from error
    loading = process_time() - start

    ticks: dict[str, Figures] = {}
    speeds: dict[str, Figures] = {}
    for case, asked in _bar(cases_to_time().items(), "crowds"):
        with suppress(InputError):  # they do not fit
            ticks[case], speeds[case] = _measure_runs(building, asked, seed)

    decisions: dict[str, Figures] = {}
    samples: dict[str, Figures] = {}
    for each in _bar(BENCH_PRESETS, "presets"):
        decisions[each], learners = _measure_learning(each, building, seed)
        for side, speed in learners.items():
            samples[f"{each}, {side}"] = {"both": speed}

    return {
        "load_seconds": {name: {"both": loading}},
        "compile_seconds": _measure_compilation(),
        "microseconds_per_tick": ticks,
        "person_seconds_per_second": speeds,
        "decisions_per_second": decisions,
        "samples_per_second": samples,
    }


def why_no_engine() -> str:
    """Say why the engine stands aside; "" where it plays."""
    if find_spec("numba") is None:
        return "numba is not installed"
    return "" if engine.engine_is_ready() else "see what it said above"


# -- Compilation --------------------------------------------------------------------

FIRST_DECISION = """
from os import times
from reference.simulation import Simulation
from reference.workshop.engine import run_to_decision
from reference.workshop.maps import load
run = Simulation(load("tiny"))
start = sum(times()[:4])
run_to_decision([run])
print(sum(times()[:4]) - start)
"""
"""A process that prints how many CPU seconds the engine takes to begin: its own, and
those of the process that compiles for it."""


def _measure_compilation() -> dict[str, Figures]:
    """Begin twice, in processes that share a cache which is empty at first."""
    cases = ("from nothing", "from the cache")
    if why_no_engine():
        return {case: {"engine": None} for case in cases}
    with TemporaryDirectory() as folder:
        return {case: {"engine": _first_decision(folder)} for case in _bar(cases)}


def _first_decision(cache: str) -> float:
    """Let another process play one decision; return its seconds."""
    package = str(Path(paper.__file__).parent.parent)
    environment = os.environ | {"XDG_CACHE_HOME": cache, "PYTHONPATH": package}
    command = [sys.executable, "-c", FIRST_DECISION]
    done = subprocess.run(
        command, env=environment, check=True, stdout=subprocess.PIPE, text=True
    )
    return float(done.stdout.split()[-1])


# -- Crowds -------------------------------------------------------------------------


def _measure_runs(
    building: Building, asked: TimedRuns, seed: int
) -> tuple[Figures, Figures]:
    """Measure microseconds per tick, and person-seconds per second."""
    ticks: Figures = {"book": None, "engine": None}
    speeds: Figures = {"book": None, "engine": None}
    # warm up: what is seen from where, and compilation
    engine.run_to_end(_begin(building, asked, seed))

    for player in _players():
        runs = _begin(building, asked, seed)
        start = process_time()
        _TO_THE_END[player](runs)
        seconds = process_time() - start
        ticks[player] = 1e6 * seconds / sum(run.ticks for run in runs)
        speeds[player] = sum(run.person_seconds for run in runs) / seconds
    return ticks, speeds


def _begin(building: Building, asked: TimedRuns, seed: int) -> list[Simulation]:
    """Begin the evacuations. Raises InputError if the people do not fit."""
    scenario = Scenario(people=asked.people, time_limit=asked.seconds)
    robots = SCRIPTS["robots"][asked.robots]
    fire = SCRIPTS["fire"][asked.fire]
    return [
        Simulation(building, scenario, robots(), fire(), k)
        for k in range(seed, seed + asked.runs)
    ]


def _run_each(runs: Sequence[Simulation]) -> None:
    for run in runs:
        run.run()


_TO_THE_END: dict[str, Callable[[Sequence[Simulation]], None]] = {
    "book": _run_each,
    "engine": engine.run_to_end,
}


def _players() -> list[str]:
    """Who plays: the engine too, unless it stands aside."""
    return ["book"] if why_no_engine() else ["book", "engine"]


# -- Learning -----------------------------------------------------------------------

_ADVANCE: dict[str, Advance] = {
    "book": until_next_decision,
    "engine": engine.run_to_decision,
}


def _measure_learning(
    name: str, building: Building, seed: int
) -> tuple[Figures, dict[Side, float]]:
    """Measure a preset: robot decisions, and each learner's samples, per second."""
    training = Training(Task("", plan_of(building), preset(name), seed))
    jobs = training.jobs()
    decisions: Figures = {"book": None, "engine": None}
    with one_thread():
        # warm up
        play(replace(jobs[0], seeds=jobs[0].seeds[:1]), advance=engine.run_to_decision)

        for player in _players():
            decisions[player], played = _measure_rollouts(jobs, _ADVANCE[player])

        speeds = {}
        for side, learner in training.learners.items():
            speeds[side] = _samples(learner, _lives(played, side))
    return decisions, speeds


def _measure_rollouts(
    jobs: Sequence[Job], advance: Advance
) -> tuple[float, list[Episode]]:
    """Play jobs; return robot decisions per second, and the episodes."""
    start = process_time()
    played = []
    for job in jobs:
        played += play(job, advance=advance)
    seconds = process_time() - start
    return sum(life.steps for life in _lives(played, "robots")) / seconds, played


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
