"""Play robots × fires × seeds: every run is a job of its own, for any executor.

Clause: F12.  Runs of one seed have the same people in the same places, and the same
randomness of the fire, whoever guides: they are paired.
"""

from collections.abc import Callable
from concurrent.futures import Executor
from pathlib import Path

from tqdm import tqdm

from reference.evaluation.difficulty import difficulty_of, people_in
from reference.simulation import Simulation
from reference.workshop.evaluation.contestants import Evacuation
from reference.workshop.evaluation.crossplay import asked
from reference.workshop.evaluation.crossplay.asked import Evaluation
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
from reference.workshop.files import make_folder
from reference.workshop.workers import as_done

RUNS = "runs.csv"


def play(job: tuple[Match, Evacuation]) -> Record:
    """Run an evacuation from beginning to end, and measure how hard its fire was."""
    match, evacuation = job
    return recorded(match, evacuation.seed, evacuation.simulation())


def recorded(match: Match, seed: int, simulation: Simulation) -> Record:
    """Run a simulation to its end; its record."""
    people = people_in(simulation.world)
    simulation.run()
    difficulty = difficulty_of(simulation, people)
    return record_of(match, seed, simulation, difficulty)


def evacuation_of(evaluation: Evaluation, run: Key) -> Evacuation:
    """One run of an evaluation, with the files that its words mean."""
    robots, fire, seed = run
    return Evacuation(
        evaluation.arena.plan,
        evaluation.arena.scenario,
        evaluation.word(robots),
        evaluation.word(fire),
        seed,
        evaluation.sample,
    )


def evaluate(
    evaluation: Evaluation,
    folder: Path | None,
    executor: Executor,
    stop: Callable[[], bool] = lambda: False,
) -> list[Record]:
    """Play all runs; their records in order, or those that are over if told to stop.

    What lies in the folder already is not played again; what is played is written
    there at once. Without a folder nothing is written. Raises OSError where something
    cannot be, ValueError for a table of runs that is damaged.
    """
    there = read(folder / RUNS) if folder else []
    table = None
    if folder:
        make_folder(folder)
        asked.write(evaluation, folder)  # first: without it nobody could go on
        table = table_of(folder / RUNS, there)
    done = {key(record): record for record in there}
    left = [run for run in evaluation.runs if run not in done]
    jobs = [(Match(*run[:2]), evacuation_of(evaluation, run)) for run in left]
    played = as_done(executor, play, jobs, stop)
    total, already = len(evaluation.runs), len(evaluation.runs) - len(left)
    for _, record in tqdm(
        played, total=total, initial=already, unit="run", disable=None, leave=False
    ):
        done[key(record)] = record
        if table:
            table.append([row_of(record)])
    records = [done[run] for run in evaluation.runs if run in done]
    if folder and len(records) == total:
        table_of(folder / RUNS, records)
    return records
