"""Play the runs of an evaluation on any executor, and keep each as a row of a table.

Runs of one seed are paired: they have the same people in the same places,
and the same randomness of the fire, whoever guides.  Rows are written as soon as their
job is over, up to some sixteen runs of a match, so that an interruption loses no more
than the jobs that were being played.
"""

import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import Executor
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

from tqdm import tqdm

from reference import paper
from reference.evaluation.difficulty import (
    arrival_of,
    difficulty,
    hardest,
    people_in,
)
from reference.navigation import navigation_of
from reference.paper import InputError
from reference.simulation import Simulation
from reference.workshop.comparing import matches
from reference.workshop.comparing.matches import Arena, Evaluation, RunKey
from reference.workshop.comparing.named import PLAYER_NAMES
from reference.workshop.engine import make_ready, run_to_end
from reference.workshop.storage.files import Table, make_folder, read_number, read_table
from reference.workshop.storage.progress import Pace
from reference.workshop.storage.workers import chunks, import_early, map_as_done
from reference.world import Died, Evacuated

RUNS_FILE = "runs.csv"
RUNS_PER_JOB = 16  # at most: fewer where workers would wait
# of a worker, at least: progress is seen, and all end at about the same time
JOBS_PER_WORKER = 20
DECIMALS_WRITTEN = 6  # of a number that is written, after the point
NO_FIRE = "none"


class Death(NamedTuple):
    """Where somebody died: floor, 0 is the first, and the middle of a cell, metres."""

    floor: int
    x: float
    y: float


@dataclass(frozen=True)
class RunResult:
    """The result of one run.

    inside            people neither out nor dead at the time limit
    survival          evacuated / people;  reward  R and difficulty  h of Eq. 8
    evacuation_time   s, when the last person got out; None if nobody did, as for
                      mean_health, of those who got out [F12, chosen]
    simulated_seconds  until nobody was inside, or time was up
    times             s, when each got out, ascending
    deaths            where each died, in the order of their deaths
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
    deaths: tuple[Death, ...]

    @property
    def run(self) -> RunKey:
        """What the result is of."""
        return self.robots, self.fire, self.seed

    @property
    def match(self) -> tuple[str, str]:
        """Who played whom."""
        return self.robots, self.fire

    @property
    def half_out(self) -> float | None:
        """When half of those who got out were out, s; None if nobody did."""
        return self.times[(len(self.times) - 1) // 2] if self.times else None


def play_evaluation(
    evaluation: Evaluation, folder: str | Path | None, executor: Executor
) -> list[RunResult]:
    """Play all runs; return their results in order.

    Runs already in the folder are not played again, and stay there, also those that are
    not asked for; without a folder nothing is written. Raises OSError where something
    cannot be written, ValueError for a damaged table of runs and for runs of files that
    have changed since or of names that are nobody's.
    """
    done = dict[RunKey, RunResult]()
    table = None
    if folder is not None:
        folder = Path(folder)
        done = _done_already(evaluation, folder)
        table = table_of(folder / RUNS_FILE, done.values())

    left = [run for run in evaluation.runs if run not in done]
    for results in _played(evaluation, left, executor):
        done |= {result.run: result for result in results}
        if table:
            table.append(map(row_of, results))

    written = [*done]
    ordered = [done.pop(run) for run in evaluation.runs]
    if table and written != [*evaluation.runs, *done]:
        with suppress(OSError):  # all rows are there, in another order
            table_of(table.path, [*ordered, *done.values()])
    return ordered


def _done_already(evaluation: Evaluation, folder: Path) -> dict[RunKey, RunResult]:
    """Read the runs in a folder; write down there what is asked for now."""
    make_folder(folder)
    done = {result.run: result for result in read_runs(folder / RUNS_FILE, evaluation)}
    played = {word for robots, fire, _ in done for word in (robots, fire)}
    kept = matches.refuse_mixing(evaluation, folder, played)
    asked = {*evaluation.robots, *evaluation.fires}
    nobody = played.difference(*PLAYER_NAMES.values(), asked, kept)
    if nobody:
        raise InputError(
            f"{folder / RUNS_FILE}: some runs are of '{min(nobody):.60}', who is "
            "nobody. Put the name back, or take another folder."
        )
    # Without it nobody could go on. It tells the files of all runs that are kept.
    digests = {**kept, **evaluation.digests}
    matches.write_evaluation(replace(evaluation, digests=digests), folder)
    return done


def _played(
    evaluation: Evaluation, left: Sequence[RunKey], executor: Executor
) -> Iterator[list[RunResult]]:
    """Play these runs in jobs; yield the results of each as it is over. Show progress.

    The bar also counts the evaluation's other runs, which are done.
    """
    share = len(left) // (JOBS_PER_WORKER * getattr(executor, "workers", 1))
    size = max(1, min(RUNS_PER_JOB, share))
    jobs = [(evaluation, some) for some in chunks(left, size)]
    if jobs:
        import_early(executor, (__name__, "reference.workshop.engine.going"), len(jobs))
        make_ready()
    total = len(evaluation.runs)
    over = total - len(left)
    pace = Pace(total, over)
    with tqdm(total=total, initial=over, unit="run", disable=None, leave=False) as bar:
        for _, results in map_as_done(executor, play_runs, jobs):
            yield results
            bar.update(len(results))
            over += len(results)
            if bar.disable and pace.due:
                print(f"{over} runs, {pace.in_words(over)}", file=sys.stderr)


def play_runs(job: tuple[Evaluation, tuple[RunKey, ...]]) -> list[RunResult]:
    """Play some runs to their end; measure how hard their fires were."""
    evaluation, runs = job
    each = zip(runs, evaluation.simulations(runs), strict=True)
    return [_play(run, simulation) for run, simulation in each]


def _play(run: RunKey, simulation: Simulation) -> RunResult:
    """Play a run to its end, and sum it up."""
    people = people_in(simulation.world)
    run_to_end([simulation])
    arrival = arrival_of(simulation)
    h = difficulty(simulation.building, arrival, people, simulation.scenario)
    out = [event.time for event in simulation.events if isinstance(event, Evacuated)]
    outcome = simulation.outcome()
    times = tuple(round(time, DECIMALS_WRITTEN) for time in sorted(out))
    return RunResult(
        *run,
        people=outcome.people,
        evacuated=outcome.evacuated,
        died=outcome.died,
        inside=outcome.inside,
        survival=outcome.evacuated / max(1, outcome.people),
        reward=round(outcome.reward, DECIMALS_WRITTEN),
        difficulty=round(h, DECIMALS_WRITTEN),
        evacuation_time=times[-1] if times else None,
        mean_health=round(outcome.mean_health, DECIMALS_WRITTEN) if times else None,
        simulated_seconds=round(outcome.simulated_seconds, DECIMALS_WRITTEN),
        times=times,
        deaths=deaths_in(simulation),
    )


def deaths_in(simulation: Simulation) -> tuple[Death, ...]:
    """List where people have died so far, in the order of their deaths [B7]."""
    place = simulation.world.bodies.place
    centres = navigation_of(simulation.building).centres
    died = [event for event in simulation.events if isinstance(event, Died)]
    return tuple(
        Death(event.floor, *centres[place[event.person]].tolist()) for event in died
    )


# -- The table ----------------------------------------------------------------------


def _read_death(words: str) -> Death:
    """Read floor:x:y. Raises ValueError."""
    floor, x, y = words.split(":")
    return Death(int(floor), read_number(x), read_number(y))


READERS: dict[Any, Callable[[str], Any]] = {
    str: str,
    int: int,
    float: read_number,
    float | None: lambda cell: read_number(cell) if cell else None,
    tuple[float, ...]: lambda cell: tuple(map(read_number, cell.split())),
    tuple[Death, ...]: lambda cell: tuple(map(_read_death, cell.split())),
}
"""How a cell is read, by the type of its column."""

COLUMN_READERS = {
    name: READERS[kind] for name, kind in RunResult.__annotations__.items()
}


def table_of(path: Path, results: Iterable[RunResult]) -> Table:
    """The file of an evaluation's runs, with these and no others. Raises OSError."""
    return Table(path, [*COLUMN_READERS], map(row_of, results))


def read_runs(path: Path, evaluation: Evaluation) -> list[RunResult]:
    """Read the whole rows of a table of runs; none if there is no file.

    Raises ValueError for another file, for a row that contradicts itself, the
    evaluation or another row of the same run; OSError for a file it cannot read.
    """
    known = dict[RunKey, RunResult]()

    def result(row: dict[str, str]) -> RunResult:
        """Read a row. Raises ValueError for one that cannot be."""
        made = RunResult(
            **{name: COLUMN_READERS[name](cell) for name, cell in row.items()}
        )
        wrong = contradiction(made, evaluation.arena)
        if wrong:
            raise ValueError(wrong)
        if known.setdefault(made.run, made) != made:
            raise ValueError("another row of this run says something else")
        return made

    return read_table(path, [*COLUMN_READERS], result)


ROUNDED = 10.0**-DECIMALS_WRITTEN  # how far a written number may be off


def contradiction(result: RunResult, arena: Arena) -> str:
    """Say what cannot be in a result, or nothing.

    What follows from other columns is computed again; what does not lies in its range.
    """
    return (
        _contradiction_of_people(result, arena)
        or _contradiction_of_times(result, arena)
        or _contradiction_of_health(result, arena)
        or _contradiction_of_reward(result, arena)
        or _contradiction_of_deaths(result, arena)
    )


def _contradiction_of_people(result: RunResult, arena: Arena) -> str:
    """Check who got out, died or stayed, survival and h."""
    counts = (result.evacuated, result.died, result.inside)
    if min(counts) < 0 or not sum(counts) == result.people == arena.people:
        return "its people do not add up, or are others"
    survival = result.evacuated / max(1, result.people)
    if result.survival != survival:
        return f"survival is {result.survival:g}, evacuated / people {survival:g}"
    most = 0.0 if _is_calm(result, arena) else hardest()
    if not 0 <= result.difficulty <= most + ROUNDED:
        return f"difficulty is {result.difficulty:g}, outside 0 to {most:.0f}"
    return ""


def _contradiction_of_times(result: RunResult, arena: Arena) -> str:
    """Check when everybody got out, and when the run ended."""
    tick = arena.scenario.tick
    latest = arena.scenario.time_limit + tick
    times = result.times
    end = result.simulated_seconds
    if not 0 <= end <= latest:
        return f"simulated_seconds is {end:g}, outside 0 to {latest:g}"
    if result.inside and end < arena.scenario.time_limit - tick:
        return "people are inside, though it ended before the time limit"
    if len(times) != result.evacuated:
        return f"{len(times)} times, but {result.evacuated} people got out"
    if list(times) != sorted(times) or any(not 0 <= time <= end for time in times):
        return f"times do not ascend from 0 to simulated_seconds, {end:g}"
    last = times[-1] if times else None
    if result.evacuation_time != last:
        return f"evacuation_time is {result.evacuation_time}, the last of times {last}"
    if times and result.evacuated == result.people and end != last:
        return f"simulated_seconds is {end:g}, though all were out at {last:g}"
    return ""


def _is_calm(result: RunResult, arena: Arena) -> bool:
    """Tell whether nothing can have burned."""
    return result.fire == NO_FIRE or not arena.scenario.sources


def _contradiction_of_health(result: RunResult, arena: Arena) -> str:
    """Check the mean health of those who got out: time alone takes some [B7]."""
    times = result.times
    health = result.mean_health
    if (health is None) != (not times):
        return "mean_health does not go with times"
    if health is None:
        return ""
    most = paper.HEALTH - paper.loss_per_second() * sum(times) / len(times)
    least = most - ROUNDED if _is_calm(result, arena) else 0.0
    if not least < health <= most + ROUNDED:
        return (
            f"mean_health is {health:g}, outside {least:.2f} to {most:.2f}, by its "
            "times"
        )
    return ""


def _contradiction_of_reward(result: RunResult, arena: Arena) -> str:
    """Check R: who got out has had their health once and at most full on each floor."""
    health = result.mean_health or 0.0
    fixed = paper.FIXED_REWARD * result.evacuated - paper.FIXED_PENALTY * result.died
    least = fixed + health * result.evacuated
    most = fixed + paper.HEALTH * result.people * arena.drawn.floors
    room = ROUNDED * (1 + result.people)
    if not least - room <= result.reward <= most + room:
        return f"reward is {result.reward:g}, outside {least:.1f} to {most:.1f}"
    return ""


def _contradiction_of_deaths(result: RunResult, arena: Arena) -> str:
    """Check that everybody who died did so where one can be."""
    if len(result.deaths) != result.died:
        return f"{len(result.deaths)} deaths, but {result.died} people died"
    walkable = arena.drawn.walkable
    for death in result.deaths:
        cell = (death.floor, *arena.drawn.cell(death.x, death.y))
        sizes = zip(cell, walkable.shape, strict=True)
        if not all(0 <= k < size for k, size in sizes) or not walkable[cell]:
            return f"nobody can have died at {_death_in_words(death)}"
    return ""


def row_of(result: RunResult) -> dict[str, object]:
    """A row of the table: None is an empty cell; spaces between times, and deaths."""
    times = " ".join(map(str, result.times))
    deaths = " ".join(map(_death_in_words, result.deaths))
    return {**vars(result), "times": times, "deaths": deaths}


def _death_in_words(death: Death) -> str:
    return f"{death.floor}:{death.x:g}:{death.y:g}"
