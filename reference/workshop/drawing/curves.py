"""Learning curves of both sides over the episodes played, from a training's table.

Clauses: E6.  Both sides play each episode, so they can share this axis; their decisions
differ in number.

    x  episodes played up to a row;  y  what a column says there
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from itertools import cycle
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from matplotlib.artist import Artist
from matplotlib.figure import Figure

from reference.building import Kind
from reference.paper import InputError
from reference.workshop.drawing import page
from reference.workshop.drawing.crossplay import LINES
from reference.workshop.drawing.evacuation import EMBER
from reference.workshop.drawing.page import BLUE, COLOURS
from reference.workshop.files import number, read_table
from reference.workshop.training.summaries import (
    COLUMNS,
    GROUP_REWARD,
    OWN_REWARD,
    SUMMARIES,
    SURVIVAL,
)

SMOOTHING = 0.05
"""Share of the time axis that a running mean covers."""

Line = tuple[np.ndarray, np.ndarray]
"""x and y of a line, (k,) each; x ascends."""


# -- The table ----------------------------------------------------------------------


class Run(NamedTuple):
    """One training: (k,) summaries of both sides in the order of episodes.

    columns  by name: words of "side" and "phase", numbers else, nan where one is empty
    """

    name: str
    columns: dict[str, np.ndarray]


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
    columns = {column: np.array([row[column] for row in rows]) for column in COLUMNS}
    return Run(file.parent.name if file.name == SUMMARIES else file.stem, columns)


def _numbers(row: dict[str, str]) -> dict[str, Any]:
    """Turn cells into numbers, empty ones into nan."""
    return {
        name: cell if name in ("side", "phase") else number(cell) if cell else np.nan
        for name, cell in row.items()
    }


# -- What is drawn ------------------------------------------------------------------


class Curve(NamedTuple):
    """A line of a chart: its panel, its rows and column of the table, and its look.

    side  "robots" or "fire", or "" for the rows of both
    """

    panel: str
    side: str
    column: str
    colour: str
    label: str
    dashes: str = "-"


ROBOTS, FIRE, PEOPLE = BLUE, EMBER, COLOURS[Kind.EXIT]
REWARDS, SURVIVORS = (
    "reward of an episode, health points",
    "share of people who survive",
)
ENTROPIES, LOSSES = (
    "entropy of the policies, nats",
    "losses of the critics, (scaled return)²",
)

CURVES = (
    Curve(REWARDS, "", GROUP_REWARD, ROBOTS, "robots"),
    Curve(REWARDS, "fire", OWN_REWARD, FIRE, "fire", "-."),
    Curve(SURVIVORS, "", SURVIVAL, PEOPLE, "people"),
    Curve(ENTROPIES, "robots", "Policy/Entropy", ROBOTS, "robots"),
    Curve(ENTROPIES, "fire", "Policy/Entropy", FIRE, "fire", "-."),
    Curve(LOSSES, "robots", "Losses/Value Loss", ROBOTS, "robots"),
    Curve(LOSSES, "robots", "Losses/Baseline Loss", ROBOTS, "robots' baseline", "--"),
    Curve(LOSSES, "fire", "Losses/Value Loss", FIRE, "fire", "-."),
)


def points(run: Run, curve: Curve, over: str = "episodes") -> Line:
    """Find where the table of a run has values for a curve; x is the column `over`."""
    y = run.columns[curve.column]
    known = np.isfinite(y) & (not curve.side or run.columns["side"] == curve.side)
    return run.columns[over][known], y[known]


def smooth(x: np.ndarray, y: np.ndarray, window: float) -> np.ndarray:
    """Average y over the points within half a window of each x; all (k,).

    Near the ends the window is cut off.
    """
    sums = np.concatenate([[0.0], np.cumsum(y)])
    first = np.searchsorted(x, x - window / 2, "left")
    last = np.searchsorted(x, x + window / 2, "right")
    return (sums[last] - sums[first]) / (last - first)


def mean_of(lines: Sequence[Line]) -> Line:
    """Average lines at 400 points where all of them are; none unless all overlap."""
    if len(lines) == 1:
        return lines[0]
    first, last = max(x[0] for x, _ in lines), min(x[-1] for x, _ in lines)
    x = np.linspace(first, last, 400 if first < last else 0)
    return x, np.mean([np.interp(x, *line) for line in lines], axis=0)


# -- Pages --------------------------------------------------------------------------


def figure(runs: Sequence[Run]) -> Figure:
    """Draw reward, survivors, entropy and losses over the episodes played [E6].

    Faint: each run as recorded. Bold: its running mean, or the mean of several runs'.
    Raises ValueError where there is nothing to draw.
    """
    found = {c: [xy for run in runs if len((xy := points(run, c))[0])] for c in CURVES}
    panels = list(dict.fromkeys(curve.panel for curve in CURVES if found[curve]))
    if not panels:
        raise InputError(
            "no rewards, entropies and losses to draw: train for longer first."
        )
    names = ", ".join(run.name for run in runs)
    whole = page.sheet(f"Learning curves: {names}", 11, 1.9 * len(panels) + 1.5)
    rest = whole.subplots(len(panels), sharex=True, squeeze=False)[:, 0]
    legend: dict[str, Artist] = {}
    for curve in (curve for curve in CURVES if found[curve]):
        axes, look = rest[panels.index(curve.panel)], {"color": curve.colour}
        end = max(x[-1] for x, _ in found[curve])
        smoothed = [(x, smooth(x, y, SMOOTHING * end)) for x, y in found[curve]]
        for line in smoothed if len(runs) > 1 else found[curve]:
            axes.plot(*line, lw=0.9, alpha=0.4, **look)
        (legend[curve.label],) = axes.plot(
            *mean_of(smoothed), curve.dashes, lw=2, **look
        )
    for axes, panel in zip(rest, panels, strict=True):
        axes.grid(axis="y")
        axes.set_title(panel)
        for axis in (axes.xaxis, axes.yaxis):
            axis.set_major_formatter(page.NUMBERS)
    rest[-1].set_xlabel("episodes played by both sides")
    for name, handle in legend.items():
        handle.set_label(name)
    page.legend(
        whole, [*legend.values()], title="bold: running means over 5 % of the episodes"
    )
    return whole


def of_arms(arms: Mapping[str, Sequence[Run]]) -> Figure:
    """Draw how survivors rise with the robots' decisions, a line for each arm [E6].

    arms: the trainings of each; a line is the mean of their running means, and the
    legend has the order of their ends.
    """
    whole = page.sheet("Survivors in training, by arm", 11, 5.2)
    axes, lines = whole.subplots(), {}
    survivors = Curve(SURVIVORS, "robots", SURVIVAL, PEOPLE, "people")
    for name, runs in arms.items():
        found = [points(run, survivors, "step") for run in runs]
        lines[name] = mean_of([(x, smooth(x, y, SMOOTHING * x[-1])) for x, y in found])
    looks = cycle(LINES)
    for name in sorted(lines, key=lambda name: -lines[name][1][-1]):
        colour, dashes = next(looks)
        axes.plot(*lines[name], lw=1.8, color=colour, ls=dashes, label=name)
    axes.grid(axis="y")
    axes.set(xlabel="decisions of the robots", ylabel=SURVIVORS)
    axes.set(xlim=(0, None), ylim=(0, 1))
    axes.xaxis.set_major_formatter(page.NUMBERS)
    whole.legend(loc="outside right center", handlelength=3)
    return whole
