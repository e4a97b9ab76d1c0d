"""Runs of a training, as the table that it writes tells of them.

Clauses: E6.  What is wrong with a table is told with its file and line.
"""

import csv
import io
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby
from math import nan
from pathlib import Path
from typing import NamedTuple

import numpy as np

TABLE = "summaries.csv"
"""What the table is called in the folder of a run."""

BOTH = "both"


class Phase(NamedTuple):
    """What went on between two episodes, such as "imitation" from 0 to 256."""

    name: str
    start: float
    end: float


@dataclass(frozen=True)
class Rows:
    """The rows of one side in a table, oldest first.

    episodes  (k,) x
    part      (k,) which phase of its run: 0, 1, 2, ...
    values    (k,) y for each column
    """

    episodes: np.ndarray
    part: np.ndarray
    values: dict[str, np.ndarray]


@dataclass(frozen=True)
class Run:
    """One training: its name, phases in order, and rows.

    sides  by "robots", "fire", or "both": each has rows only while it learns, but what
           becomes of people stands in all of them
    """

    name: str
    sides: dict[str, Rows]
    phases: tuple[Phase, ...]

    @property
    def end(self) -> float:
        """Episodes played."""
        return self.phases[-1].end


def read(path: str | Path) -> Run:
    """The run in a table, or in a folder that holds one.

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
    _check_columns(file, reader.fieldnames or ())
    rows = [_numbers(file, reader.line_num, row) for row in reader]
    _check_rows(file, rows)
    rows.sort(key=lambda row: row.episodes)
    name = file.parent.name if file.name == TABLE else file.stem
    return _run(name, rows)


class _Row(NamedTuple):
    line: int
    side: str
    phase: str
    episodes: float
    values: dict[str, float]


_WORDS = ("side", "phase")


def _check_columns(file: Path, columns: Sequence[str]) -> None:
    missing = [name for name in (*_WORDS, "step", "episodes") if name not in columns]
    if not columns:
        raise ValueError(f"{file}: is empty. Train for longer first.")
    if missing:
        raise ValueError(
            f"{file}: has no column {' and no '.join(missing)}, so it is no table of a "
            f"training. Name one that `train` wrote."
        )


def _numbers(file: Path, line: int, row: dict[str, str]) -> _Row:
    """A row with its cells as numbers, empty ones nan."""
    values = {}
    for name, cell in row.items():
        if name in _WORDS:
            continue
        try:
            values[name] = nan if cell == "" else float(cell)
        except (TypeError, ValueError):
            found = "missing" if cell is None else repr(cell)
            raise ValueError(
                f"{file}, line {line}: {name or 'a cell too many'} is {found}, where a "
                "number should be. Take the line out."
            ) from None
    return _Row(line, row["side"], row["phase"], values["episodes"], values)


def _check_rows(file: Path, rows: Sequence[_Row]) -> None:
    """Two rows of a side at least, in the order of time."""
    sides: dict[str, list[_Row]] = {"robots": [], "fire": []}
    for row in rows:
        if row.side not in sides:
            raise ValueError(
                f"{file}, line {row.line}: the side is {row.side!r}. There is robots "
                "and fire."
            )
        before = sides[row.side][-1].episodes if sides[row.side] else 0
        if not before <= row.episodes:
            raise ValueError(
                f"{file}, line {row.line}: {row.episodes:g} episodes after "
                f"{before:g}. Keep the rows of one training only."
            )
        sides[row.side].append(row)
    if max(map(len, sides.values())) < 2:
        raise ValueError(
            f"{file}: {len(rows) or 'no'} {'row' if len(rows) == 1 else 'rows'}, and a "
            "curve needs two of a side. Train for longer, or set a smaller "
            "summary_freq."
        )


def _run(name: str, rows: Sequence[_Row]) -> Run:
    """A run from its rows, oldest first."""
    phases: list[Phase] = []
    members: dict[str, list[tuple[int, _Row]]] = {}
    for part, (phase, group) in enumerate(groupby(rows, lambda row: row.phase)):
        within = list(group)
        start = phases[-1].end if phases else 0.0
        phases.append(Phase(phase, start, within[-1].episodes))
        for row in within:
            members.setdefault(row.side, []).append((part, row))
            members.setdefault(BOTH, []).append((part, row))
    return Run(name, {side: _rows(m) for side, m in members.items()}, tuple(phases))


def _rows(members: Sequence[tuple[int, _Row]]) -> Rows:
    parts, rows = zip(*members, strict=True)
    return Rows(
        episodes=np.array([row.episodes for row in rows]),
        part=np.array(parts),
        values={
            name: np.array([row.values[name] for row in rows])
            for name in rows[0].values
        },
    )
