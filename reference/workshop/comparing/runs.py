"""Play the runs of an evaluation on any executor, and keep each as a row of a table.

Runs of one seed are paired: they have the same people in the same places,
and the same randomness of the fire, whoever guides.  A row is written at once when its
run is over, so that an interruption loses no more than the runs that were being played.
"""

from collections.abc import Callable, Iterable
from concurrent.futures import Executor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tqdm import tqdm

from reference.evaluation.difficulty import arrival_of, difficulty, people_in
from reference.simulation import Simulation
from reference.workshop.comparing import matches
from reference.workshop.comparing.matches import Evaluation, Run
from reference.workshop.lockstep import to_the_end
from reference.workshop.storage.files import Table, make_folder, number, read_table
from reference.workshop.storage.workers import as_done, chunks
from reference.world import Evacuated

RUNS = "runs.csv"
IN_LOCKSTEP = 16  # runs of a job, at most: fewer where workers would wait
JOBS = 4  # of a worker, at least: progress is seen, and all end at about the same time
DIGITS = 6  # of a number that is written, after the point


@dataclass(frozen=True)
class RunResult:
    """The result of one run.

    inside            people neither out nor dead at the time limit
    survival          evacuated / people;  reward  R and difficulty  h of Eq. 8
    evacuation_time   s, when the last person got out; None if nobody did, as for
                      mean_health, of those who got out [F12, chosen]
    simulated_seconds  until nobody was inside, or time was up
    times             s, when each got out, ascending
    """

    robots: str
    fire: str
    seed: int
    people: int
    evacuated: int
    died: int
    inside: int
    survival: float
    reward: float
    difficulty: float
    evacuation_time: float | None
    mean_health: float | None
    simulated_seconds: float
    times: tuple[float, ...]

    @property
    def run(self) -> Run:
        """What the result is of."""
        return self.robots, self.fire, self.seed


def evaluate(
    evaluation: Evaluation, folder: Path | None, executor: Executor
) -> list[RunResult]:
    """Play all runs; return their results in order.

    Runs already in the folder are not played again; without a folder nothing is
    written. Raises OSError where something cannot be written, ValueError for a damaged
    table of runs and for runs of files that have changed since.
    """
    # What is done already
    done = dict[Run, RunResult]()
    table = None
    if folder:
        make_folder(folder)
        matches.refuse_mixing(evaluation, folder)
        done = {result.run: result for result in read(folder / RUNS, evaluation)}
        matches.write(evaluation, folder)  # first: without it nobody could go on
        table = table_of(folder / RUNS, done.values())

    # The rest, in jobs
    runs = evaluation.runs
    left = [run for run in runs if run not in done]
    share = len(left) // (JOBS * getattr(executor, "workers", 1))
    size = max(1, min(IN_LOCKSTEP, share))
    jobs = [(evaluation, some) for some in chunks(left, size)]
    begun = len(runs) - len(left)
    bar = tqdm(total=len(runs), initial=begun, unit="run", disable=None, leave=False)
    with bar:
        for _, results in as_done(executor, play, jobs):
            done |= {result.run: result for result in results}
            if table:
                table.append(map(row_of, results))
            bar.update(len(results))

    ordered = [done[run] for run in runs]
    if folder:
        table_of(folder / RUNS, ordered)
    return ordered


def play(job: tuple[Evaluation, tuple[Run, ...]]) -> list[RunResult]:
    """Play some runs to their end, in lockstep; measure how hard their fires were."""
    evaluation, runs = job
    simulations = evaluation.simulations(runs)
    people = [people_in(simulation.world) for simulation in simulations]
    to_the_end(simulations)
    return [_result(*each) for each in zip(runs, simulations, people, strict=True)]


def _result(run: Run, simulation: Simulation, people: Any) -> RunResult:
    """Sum up a run that is over; people: those who were there at its beginning."""
    h = difficulty(simulation.building, arrival_of(simulation), people)
    out = [event.time for event in simulation.events if isinstance(event, Evacuated)]
    outcome = simulation.outcome()
    times = tuple(round(time, DIGITS) for time in sorted(out))
    return RunResult(
        *run,
        people=outcome.people,
        evacuated=outcome.evacuated,
        died=outcome.died,
        inside=outcome.inside,
        survival=outcome.evacuated / max(1, outcome.people),
        reward=round(outcome.reward, DIGITS),
        difficulty=round(h, DIGITS),
        evacuation_time=times[-1] if times else None,
        mean_health=round(outcome.mean_health, DIGITS) if times else None,
        simulated_seconds=round(outcome.simulated_seconds, DIGITS),
        times=times,
    )


# -- The table ----------------------------------------------------------------------

READERS: dict[Any, Callable[[str], Any]] = {
    str: str,
    int: int,
    float: number,
    float | None: lambda cell: number(cell) if cell else None,
    tuple[float, ...]: lambda cell: tuple(map(number, cell.split())),
}
"""How a cell is read, by the type of its column."""

COLUMNS = {name: READERS[kind] for name, kind in RunResult.__annotations__.items()}


def table_of(path: Path, results: Iterable[RunResult]) -> Table:
    """The file of an evaluation's runs, with these and no others. Raises OSError."""
    return Table(path, [*COLUMNS], map(row_of, results))


def read(path: Path, evaluation: Evaluation) -> list[RunResult]:
    """Read the whole rows of a table of runs; none if there is no file.

    Raises ValueError for another file, for a row that does not add up and one with
    other people than the evaluation's; OSError for a file it cannot read.
    """

    def result(row: dict[str, str]) -> RunResult:
        """Refuse a row that does not add up."""
        made = RunResult(**{name: COLUMNS[name](cell) for name, cell in row.items()})
        total = made.evacuated + made.died + made.inside
        if not total == made.people == evaluation.arena.people:
            raise ValueError("its people do not add up, or are others")
        return made

    return read_table(path, [*COLUMNS], result)


def row_of(result: RunResult) -> dict[str, object]:
    """A row of the table: None is an empty cell, times have spaces between."""
    return {**vars(result), "times": " ".join(map(str, result.times))}
