"""Read the table that a training writes: its phases, and its columns as arrays.

Clauses: E6.
"""

import csv
import io
from dataclasses import dataclass
from itertools import groupby
from math import nan
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

TABLE = "summaries.csv"
"""What the table is called in the folder of a run."""

BOTH = "both"
SIDES = ("robots", "fire")
_WORDS = ("side", "phase")


class Phase(NamedTuple):
    """What went on between two episodes, such as "imitation" from 0 to 256."""

    name: str
    start: float
    end: float


@dataclass(frozen=True)
class Run:
    """One training: (k,) summaries of both sides in the order of episodes.

    side     "robots" or "fire";  part  the phase of each row: 0, 1, 2, ...
    columns  numbers by name, nan where a cell is empty
    """

    name: str
    side: np.ndarray
    part: np.ndarray
    columns: dict[str, np.ndarray]
    phases: tuple[Phase, ...]

    @property
    def end(self) -> float:
        """Episodes played."""
        return self.phases[-1].end

    def rows_of(self, side: str) -> np.ndarray:
        """(k,) bool: the rows of "robots", of "fire", or of both."""
        return np.full(len(self.side), True) if side == BOTH else self.side == side


def read(path: str | Path) -> Run:
    """Read a table, or the one in a folder.

    A last line without its end is still being written and left out. Raises ValueError
    for a table that cannot be drawn, OSError where there is none.
    """
    file = Path(path) / TABLE if Path(path).is_dir() else Path(path)
    if not file.is_file():
        raise FileNotFoundError(
            f"{file}: there is no such table. Name the folder of a training, or the "
            f"{TABLE} in it."
        )
    text = file.read_text(encoding="utf-8")
    reader = csv.DictReader(io.StringIO(text[: text.rfind("\n") + 1]))
    missing = {*_WORDS, "step", "episodes"}.difference(reader.fieldnames or ())
    if missing:
        raise ValueError(
            f"{file}: has no column {' and no '.join(sorted(missing))}. Name a table "
            "that `train` wrote."
        )
    rows = [_numbers(f"{file}, line {reader.line_num}", row) for row in reader]
    _check_rows(file, rows)
    rows.sort(key=lambda row: row["episodes"])
    return _run(file.parent.name if file.name == TABLE else file.stem, rows)


def _numbers(where: str, row: dict[str, Any]) -> dict[str, Any]:
    """Turn the cells of a row into numbers, empty ones into nan; note where it is."""
    found: dict[str, Any] = {"where": where}
    for name, cell in row.items():
        try:
            found[name] = cell if name in _WORDS else nan if cell == "" else float(cell)
        except (TypeError, ValueError):
            raise ValueError(
                f"{where}: {name or 'a cell too many'} is "
                f"{'missing' if cell is None else repr(cell)}, where a number should "
                "be. Take the line out."
            ) from None
    return found


def _check_rows(file: Path, rows: list[dict[str, Any]]) -> None:
    """Check that a side has two rows at least, and that time goes on."""
    times: dict[str, list[float]] = {side: [0.0] for side in SIDES}
    for row in rows:
        if row["side"] not in times:
            raise ValueError(
                f"{row['where']}: the side is {row['side']!r}, not robots or fire."
            )
        before = times[row["side"]]
        if not before[-1] <= row["episodes"]:
            raise ValueError(
                f"{row['where']}: {row['episodes']:g} episodes after {before[-1]:g}. "
                "Keep the rows of one training only."
            )
        before.append(row["episodes"])
    if max(map(len, times.values())) < 3:
        raise ValueError(
            f"{file}: a curve needs two rows of a side, and there are {len(rows)} in "
            "all. Train for longer, or set a smaller summary_freq."
        )


def _run(name: str, rows: list[dict[str, Any]]) -> Run:
    """Gather the columns and phases of rows, oldest first."""
    phases: list[Phase] = []
    part: list[int] = []
    for phase, group in groupby(rows, lambda row: row["phase"]):
        ends = [row["episodes"] for row in group]
        part += [len(phases)] * len(ends)
        phases.append(Phase(phase, phases[-1].end if phases else 0.0, ends[-1]))
    numbers = [name for name in rows[0] if name not in (*_WORDS, "where")]
    return Run(
        name,
        np.array([row["side"] for row in rows]),
        np.array(part),
        {column: np.array([row[column] for row in rows]) for column in numbers},
        tuple(phases),
    )
