"""Robots × fires × seeds: every run is a job of its own, whoever does it.

Clause: F12.  Runs of one seed have the same people in the same places, and the same
randomness of the fire, whoever guides: they are paired.
"""

from collections.abc import Callable
from concurrent.futures import Executor
from copy import deepcopy
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

from tqdm import tqdm

from reference.building import building_of
from reference.evaluation.difficulty import difficulty_of, people_in
from reference.simulation import Simulation
from reference.workshop.evaluation.contestants import Side, contestant
from reference.workshop.evaluation.crossplay import asked
from reference.workshop.evaluation.crossplay.asked import Arena, Evaluation
from reference.workshop.evaluation.crossplay.records import (
    Key,
    Match,
    Record,
    key,
    read,
    record_of,
    row_of,
    table_of,
)
from reference.workshop.files import Table, make_folder
from reference.workshop.workers import as_done

RUNS = "runs.csv"


@dataclass(frozen=True)
class Job:
    """One run: where, who meets whom, from which seed.

    robots, fire  words that contestants are made of; match  how they are called
    """

    arena: Arena
    match: Match
    robots: str
    fire: str
    seed: int
    sample: bool = False


def simulation_of(job: Job) -> Simulation:
    """The run before its first tick. Raises ValueError for more people than fit."""
    return Simulation(
        building_of(job.arena.plan),
        job.arena.scenario,
        _player(job.robots, "robots", job.sample),
        _player(job.fire, "fire", job.sample),
        job.seed,
    )


def play(job: Job) -> Record:
    """The run from beginning to end, and how hard its fire was."""
    simulation = simulation_of(job)
    people = people_in(simulation.world)
    simulation.run()
    difficulty = difficulty_of(simulation, people)
    return record_of(job.match, job.seed, simulation, difficulty)


def _player(word: str, side: Side, sample: bool) -> Any:
    """A strategy that remembers nothing of the run before; networks are read once."""
    return deepcopy(_made(word, side, sample))


@lru_cache(maxsize=32)
def _made(word: str, side: Side, sample: bool) -> Any:
    return contestant(word, side, sample)


def _never() -> bool:
    return False


def evaluate(
    evaluation: Evaluation,
    folder: Path | None,
    executor: Executor,
    stop: Callable[[], bool] = _never,
    progress: bool = True,
) -> list[Record]:
    """The records of all its runs, in order; of those that are over, if told to stop.

    What lies in the folder already is not played again; what is played is written
    there at once. Without a folder nothing is written. Raises OSError where something
    cannot be, ValueError for a table of runs that is damaged.
    """
    there = read(folder / RUNS) if folder else []
    kept = _table(evaluation, folder, there) if folder else None
    done = {key(record): record for record in there}
    jobs = [job_of(evaluation, run) for run in evaluation.runs if run not in done]
    with _bar(evaluation, len(jobs), progress) as bar:
        for _, record in as_done(executor, play, jobs, stop):
            done[key(record)] = record
            if kept:
                kept.append([row_of(record)])
            bar.update()
    records = [done[run] for run in evaluation.runs if run in done]
    if folder and len(records) == len(evaluation.runs):
        table_of(folder / RUNS, records)
    return records


def _table(evaluation: Evaluation, folder: Path, there: list[Record]) -> Table:
    """What was asked is written first: without it nobody could go on."""
    make_folder(folder)
    asked.write(evaluation, folder)
    return table_of(folder / RUNS, there)


def job_of(evaluation: Evaluation, run: Key) -> Job:
    """One of its runs as a job."""
    robots, fire, seed = run
    words = evaluation.word(robots), evaluation.word(fire)
    return Job(evaluation.arena, Match(robots, fire), *words, seed, evaluation.sample)


def _bar(evaluation: Evaluation, left: int, progress: bool) -> Any:
    runs = len(evaluation.runs)
    return tqdm(
        total=runs,
        initial=runs - left,
        unit="run",
        disable=None if progress else True,
        leave=False,
    )
