"""Records of runs, and the table of them that grows while they are played.

Clause: F12.  A run is one row of runs.csv, written at once when it is over, so that an
interruption loses no more than the runs that were being played.
"""

import csv
from collections.abc import Callable, Iterable, Sequence
from dataclasses import astuple, dataclass, fields
from io import StringIO
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from reference.events import Evacuated
from reference.simulation import Simulation
from reference.workshop.files import write_whole


class EvaluationError(ValueError):
    """What was asked for cannot be evaluated; one message for people."""


class Match(NamedTuple):
    """Who guides and who burns, by the words that were asked for."""

    robots: str
    fire: str


@dataclass(frozen=True)
class Record:
    """One run of a match, from one seed.

    inside            people whom the time limit found neither out nor dead
    survival          evacuated / people;  reward  R and difficulty  h of Eq. 8
    evacuation_time   s, when the last of those who got out did; None if nobody did,
                      as for the next two [F12, chosen]
    mean_evacuation_time  s, over those who got out;  mean_health  theirs
    simulated_seconds  until nobody was inside any more
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
        """Who met."""
        return Match(self.robots, self.fire)


COLUMNS = tuple(field.name for field in fields(Record))
DIGITS = 6  # of a number that is written, after the point

Key = tuple[str, str, int]
"""Robots, fire and seed: what a run follows from, in one building and scenario."""


def key(record: Record) -> Key:
    """What the run follows from."""
    return record.robots, record.fire, record.seed


def record_of(
    match: Match, seed: int, simulation: Simulation, difficulty: float
) -> Record:
    """What became of a run that is over; difficulty: its h."""
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


class Table:
    """The CSV file of an evaluation's runs."""

    def __init__(self, path: Path):
        """With what is there of whole rows; a half-written last one is dropped.

        Raises EvaluationError for a file that holds anything else, OSError where it
        cannot be read or written.
        """
        self.path = path
        self.records = read(path) if path.exists() else []
        self.replace(self.records)

    def append(self, record: Record) -> None:
        """One more row, at the end. Raises OSError with a message for people."""
        try:
            with self.path.open("ab", buffering=0) as file:
                file.write(_text([_cells(record)]))
        except OSError as error:
            raise OSError(
                f"{self.path}: cannot be written ({error.strerror}); the runs in it are"
                " whole. Make room, and go on with --resume."
            ) from error

    def replace(self, records: Iterable[Record]) -> None:
        """These rows and no others, all at once."""
        write_whole(self.path, _text([COLUMNS, *map(_cells, records)]))


def read(path: Path) -> list[Record]:
    """The whole rows of a table of runs, and nothing of a row without an end.

    Raises EvaluationError for a file that is none, OSError for one it cannot read.
    """
    text = path.read_text(encoding="utf-8", errors="replace")
    rows = list(csv.reader(StringIO(text[: text.rfind("\n") + 1])))
    if rows and rows[0] != list(COLUMNS):
        raise EvaluationError(f"{path}: is no table of runs. Name another folder.")
    try:
        return [_record(row) for row in rows[1:]]
    except (ValueError, IndexError) as error:
        raise EvaluationError(
            f"{path}: a row is damaged ({error}). Remove that row, or begin anew in "
            "another folder."
        ) from error


def _text(rows: Sequence[Sequence[object]]) -> bytes:
    text = StringIO()
    csv.writer(text, lineterminator="\n").writerows(rows)
    return text.getvalue().encode()


def _cells(record: Record) -> list[object]:
    """None is an empty cell; times stand in one, with spaces between."""
    *most, times = astuple(record)
    return [*most, " ".join(map(str, times))]


def _record(row: list[str]) -> Record:
    given = zip(fields(Record), row, strict=True)
    return Record(**{field.name: READERS[field.type](cell) for field, cell in given})


def _optional(cell: str) -> float | None:
    return float(cell) if cell else None


def _times(cell: str) -> tuple[float, ...]:
    return tuple(map(float, cell.split()))


READERS: dict[Any, Callable[[str], Any]] = {
    str: str,
    int: int,
    float: float,
    float | None: _optional,
    tuple[float, ...]: _times,
}
