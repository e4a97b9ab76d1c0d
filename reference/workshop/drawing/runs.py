"""Read the table that a training writes: its phases, and its columns as arrays.

Clauses: E6.
"""

from collections import Counter
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from reference.paper import InputError
from reference.workshop.files import number, read_table
from reference.workshop.training.summaries import COLUMNS, SUMMARIES

_WORDS = ("side", "phase")


class Phase(NamedTuple):
    """Who learned between two episodes, such as "imitation" from 0 to 256."""

    name: str
    start: float
    end: float


@dataclass(frozen=True)
class Run:
    """One training: (k,) summaries of both sides in the order of episodes.

    part     the phase of each row: 0, 1, 2, ...
    columns  by name: words of "side" and "phase", numbers else, nan where one is empty
    """

    name: str
    part: np.ndarray
    columns: dict[str, np.ndarray]
    phases: tuple[Phase, ...]

    @property
    def end(self) -> float:
        """Episodes played."""
        return self.phases[-1].end


def read(path: str | Path) -> Run:
    """Read a table, or the one in a folder.

    A last line without its end is still being written and left out. Raises ValueError
    for a table that cannot be drawn, OSError where there is none.
    """
    file = Path(path) / SUMMARIES if Path(path).is_dir() else Path(path)
    if not file.is_file():
        raise FileNotFoundError(
            f"{file}: there is no such table. Name the folder of a training, or the "
            f"{SUMMARIES} in it."
        )
    rows = read_table(file, COLUMNS, _numbers)
    if max(Counter(row["side"] for row in rows).values(), default=0) < 2:
        raise InputError(
            f"{file}: a curve needs two rows of a side, and there are {len(rows)} in "
            "all. Train for longer, or set a smaller summary_freq."
        )
    rows.sort(key=lambda row: row["episodes"])
    return _run(file.parent.name if file.name == SUMMARIES else file.stem, rows)


def _numbers(row: dict[str, str]) -> dict[str, Any]:
    """Turn cells into numbers, empty ones into nan."""
    return {
        name: cell if name in _WORDS else number(cell) if cell else np.nan
        for name, cell in row.items()
    }


def _run(name: str, rows: list[dict[str, Any]]) -> Run:
    """Gather the columns and phases of rows, oldest first."""
    phases: list[Phase] = []
    part: list[int] = []
    for phase, group in groupby(rows, lambda row: row["phase"]):
        ends = [row["episodes"] for row in group]
        part += [len(phases)] * len(ends)
        phases.append(Phase(phase, phases[-1].end if phases else 0.0, ends[-1]))
    columns = {column: np.array([row[column] for row in rows]) for column in COLUMNS}
    return Run(name, np.array(part), columns, tuple(phases))
