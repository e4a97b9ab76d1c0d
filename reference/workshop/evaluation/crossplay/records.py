"""Records of runs, and the table of them that grows while they are played.

Clause: F12.  A run is one row of runs.csv, written at once when it is over, so that an
interruption loses no more than the runs that were being played.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from reference.events import Evacuated
from reference.simulation import Simulation
from reference.workshop.files import Table, number, read_table, whole


class Match(NamedTuple):
    """The robots and the fire, by the words that were asked for."""

    robots: str
    fire: str


@dataclass(frozen=True)
class Record:
    """One run of a match, from one seed.

    inside            people neither out nor dead at the time limit
    survival          evacuated / people;  reward  R and difficulty  h of Eq. 8
    evacuation_time   s, when the last person got out; None if nobody did, as for the
                      next two [F12, chosen]
    mean_evacuation_time  s, over those who got out;  mean_health  theirs
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
    mean_evacuation_time: float | None
    mean_health: float | None
    simulated_seconds: float
    times: tuple[float, ...]

    @property
    def match(self) -> Match:
        """Robots and fire of the run."""
        return Match(self.robots, self.fire)


COLUMNS = tuple(field.name for field in fields(Record))
DIGITS = 6  # of a number that is written, after the point

Key = tuple[str, str, int]
"""Robots, fire and seed: what a run follows from, in one building and scenario."""


def key(record: Record) -> Key:
    """The key of a run."""
    return record.robots, record.fire, record.seed


def record_of(
    match: Match, seed: int, simulation: Simulation, difficulty: float
) -> Record:
    """Record a run that is over; difficulty: its h."""
    outcome = simulation.outcome()
    out = [event.time for event in simulation.events if isinstance(event, Evacuated)]
    times = tuple(round(time, DIGITS) for time in sorted(out))
    return Record(
        *match,
        seed,
        people=outcome.people,
        evacuated=outcome.evacuated,
        died=outcome.died,
        inside=outcome.inside,
        survival=outcome.evacuated / max(1, outcome.people),
        reward=round(outcome.reward, DIGITS),
        difficulty=round(difficulty, DIGITS),
        evacuation_time=times[-1] if times else None,
        mean_evacuation_time=round(float(np.mean(times)), DIGITS) if times else None,
        mean_health=round(outcome.mean_health, DIGITS) if times else None,
        simulated_seconds=round(outcome.simulated_seconds, DIGITS),
        times=times,
    )


# -- The table ----------------------------------------------------------------------


def table_of(path: Path, records: Iterable[Record]) -> Table:
    """The file of an evaluation's runs, with these and no others. Raises OSError."""
    return Table(path, COLUMNS, map(row_of, records))


def read(path: Path) -> list[Record]:
    """Read the whole rows of a table of runs; none if there is no file.

    Raises ValueError for another file, OSError for one it cannot read.
    """
    return read_table(path, COLUMNS, _record)


def row_of(record: Record) -> dict[str, object]:
    """A row of the table: None is an empty cell, times have spaces between."""
    return {**vars(record), "times": " ".join(map(str, record.times))}


def _record(row: dict[str, str]) -> Record:
    return Record(**{f.name: READERS[f.type](row[f.name]) for f in fields(Record)})


READERS: dict[Any, Callable[[str], Any]] = {
    str: str,
    int: whole,
    float: number,
    float | None: lambda cell: number(cell) if cell else None,
    tuple[float, ...]: lambda cell: tuple(map(number, cell.split())),
}
