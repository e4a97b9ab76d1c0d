"""Play robots × fires × seeds, a few runs per job, on any executor.

Clause: F12.  Runs of one seed are paired: they have the same people in the same places,
and the same randomness of the fire, whoever guides.
"""

from collections.abc import Callable, Sequence
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
from reference.workshop.lockstep import to_the_end
from reference.workshop.workers import as_done, chunks

RUNS = "runs.csv"
IN_LOCKSTEP = 16  # runs of a job


def play(jobs: Sequence[tuple[Match, Evacuation]]) -> list[Record]:
    """Run evacuations from beginning to end; measure how hard their fires were."""
    return recorded([(match, who.seed, who.simulation()) for match, who in jobs])


def recorded(runs: Sequence[tuple[Match, int, Simulation]]) -> list[Record]:
    """Run simulations, given match and seed, to their end; return their records."""
    people = [people_in(simulation.world) for _, _, simulation in runs]
    to_the_end([simulation for _, _, simulation in runs])
    return [
        record_of(match, seed, run, difficulty_of(run, there))
        for (match, seed, run), there in zip(runs, people, strict=True)
    ]


def evacuation_of(evaluation: Evaluation, run: Key) -> Evacuation:
    """Make one run of an evaluation, with the files that its words mean."""
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
    """Play all runs; return their records in order, or the finished ones if stopped.

    Runs already in the folder are not played again; new ones are written there at
    once. Without a folder nothing is written. Raises OSError where something cannot
    be written, ValueError for a damaged table of runs.
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
    total, already = len(evaluation.runs), len(evaluation.runs) - len(left)
    with tqdm(
        total=total, initial=already, unit="run", disable=None, leave=False
    ) as bar:
        for _, played in as_done(executor, play, chunks(jobs, IN_LOCKSTEP), stop):
            done |= {key(record): record for record in played}
            if table:
                table.append([row_of(record) for record in played])
            bar.update(len(played))
    records = [done[run] for run in evaluation.runs if run in done]
    if folder and len(records) == total:
        table_of(folder / RUNS, records)
    return records
