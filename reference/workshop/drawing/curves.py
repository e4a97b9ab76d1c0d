"""Learning curves of both sides over the episodes played, from a training's table.

Clauses: E6.  Both sides play each episode, so they can share this axis; their decisions
differ in number.

    x  episodes played up to a row;  y  what a column says there
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, MaxNLocator, NullFormatter

from reference.building import Kind
from reference.paper import InputError
from reference.workshop.drawing import page
from reference.workshop.drawing.evacuation import DROP, EMBER
from reference.workshop.drawing.page import COLOURS
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

    side  "robots" or "fire", or "" for the rows of both;  times  factor on the values
    """

    panel: str
    side: str
    column: str
    colour: str
    label: str
    dashes: str = "-"
    times: float = 1.0


ROBOTS, FIRE, PEOPLE = "#1b5e9e", EMBER, COLOURS[Kind.EXIT]
MARKERS: dict[str, Any] = {ROBOTS: "D", FIRE: DROP, PEOPLE: "o"}
REWARDS, SURVIVORS = "reward of an episode", "survivors"
ENTROPIES, LOSSES = "entropy of the policies", "losses of the critics"

UNITS = {
    REWARDS: "health points",
    SURVIVORS: "% of all people",
    ENTROPIES: "nats",
    LOSSES: "(scaled return)²",
}
"""Panels from top to bottom, and the units of their y axes; losses on a log scale."""

CURVES = (
    Curve(REWARDS, "", GROUP_REWARD, ROBOTS, "robots"),
    Curve(REWARDS, "fire", OWN_REWARD, FIRE, "fire"),
    Curve(SURVIVORS, "", SURVIVAL, PEOPLE, "people", times=100),
    Curve(ENTROPIES, "robots", "Policy/Entropy", ROBOTS, "robots"),
    Curve(ENTROPIES, "fire", "Policy/Entropy", FIRE, "fire"),
    Curve(LOSSES, "robots", "Losses/Value Loss", ROBOTS, "robots"),
    Curve(LOSSES, "robots", "Losses/Baseline Loss", ROBOTS, "robots' baseline", "--"),
    Curve(LOSSES, "fire", "Losses/Value Loss", FIRE, "fire"),
)


def points(run: Run, curve: Curve) -> Line:
    """Find where the table of a run has values for a curve."""
    y = run.columns[curve.column] * curve.times
    known = np.isfinite(y) & (not curve.side or run.columns["side"] == curve.side)
    return run.columns["episodes"][known], y[known]


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
    first, last = max(x[0] for x, _ in lines), min(x[-1] for x, _ in lines)
    x = np.linspace(first, last, 400 if first < last else 0)
    return x, np.mean([np.interp(x, *line) for line in lines], axis=0)


# -- Pages --------------------------------------------------------------------------

_WIDTH, _PANEL, _REST = 11.0, 1.9, 1.5  # inches
_COLOURS = colormaps["tab10"]


def figure(runs: Sequence[Run]) -> Figure:
    """Draw reward, survivors, entropy and losses over the episodes played [E6].

    One run: its values faint, their running means bold. Several, such as seeds: the
    running means of each thin, their mean bold. Raises ValueError where there is
    nothing to draw.
    """
    found = {c: [xy for run in runs if len((xy := points(run, c))[0])] for c in CURVES}
    panels = list(dict.fromkeys(curve.panel for curve in CURVES if found[curve]))
    if not panels:
        raise InputError(
            "no rewards, entropies and losses to draw: train for longer first."
        )
    names = page.shortened(", ".join(run.name for run in runs), 70)
    height = _PANEL * len(panels) + _REST
    whole = page.sheet(f"Learning curves: {names}", _WIDTH, height)
    rest = whole.subplots(len(panels), sharex=True, squeeze=False)[:, 0]
    end = max(run.columns["episodes"][-1] for run in runs)
    rest[-1].set(xlim=(0, end or 1), xlabel="episodes played by both sides")
    whole.align_ylabels(rest)
    for axes, panel in zip(rest, panels, strict=True):
        axes.grid(axis="y")
        axes.set_title(panel)
        axes.set_ylabel(UNITS[panel], fontsize=8)
        for curve in (c for c in CURVES if c.panel == panel and found[c]):
            _draw_curve(axes, curve, found[curve], SMOOTHING * end)
        _place_numbers(axes, panel)
    page.foot(whole, caption=_caption(len(runs), SMOOTHING * end), handlelength=2.8)
    return whole


def of_arms(arms: Mapping[str, Sequence[Run]]) -> Figure:
    """Draw how survivors rise with the robots' decisions, a line for each arm [E6].

    arms: the trainings of each; a line is the mean of their running means, and the
    legend has the order of their ends.
    """
    whole = page.sheet("Survivors in training, by arm", _WIDTH, 5.2)
    axes = whole.subplots()
    lines = {}
    for name, runs in arms.items():
        robots = [run.columns["side"] == "robots" for run in runs]
        xy = [
            (run.columns["step"][of], 100 * run.columns[SURVIVAL][of])
            for run, of in zip(runs, robots, strict=True)
        ]
        smoothed = [(x, smooth(x, y, SMOOTHING * x[-1])) for x, y in xy]
        lines[name] = mean_of(smoothed) if len(runs) > 1 else smoothed[0]
    for k, name in enumerate(sorted(lines, key=lambda name: -lines[name][1][-1])):
        look: dict[str, Any] = {
            "color": _COLOURS(k % 10),
            "ls": "-" if k < 10 else "--",
        }
        axes.plot(*lines[name], lw=1.8, label=name, **look)
    axes.grid(axis="y")
    axes.set(xlabel="decisions of the robots", ylabel=UNITS[SURVIVORS], ylim=(0, 100))
    axes.set_xlim(left=0)
    page.write_numbers(axes.xaxis, axes.yaxis)
    whole.legend(loc="outside right center")
    return whole


def _draw_curve(axes: Axes, curve: Curve, lines: list[Line], window: float) -> None:
    """Draw a line for each run that has the column, and a bold one; see `figure`."""
    smoothed = [(x, smooth(x, y, window)) for x, y in lines]
    bold, thin = mean_of(smoothed), smoothed
    if len(lines) == 1:
        (bold,), thin = smoothed, lines
    look: dict[str, Any] = {"color": curve.colour, "ls": curve.dashes}
    for line in thin:
        axes.plot(*line, lw=0.9, alpha=0.4, marker=".", ms=2, **look)
    mark = MARKERS[curve.colour] if curve.dashes == "-" else None
    clipped = not len(bold[0])  # else the layout makes room for a line of no points
    look |= {"marker": mark, "ms": 8, "markevery": [-1], "clip_on": clipped}
    axes.plot(*bold, lw=2, label=curve.label, **look)


def _place_numbers(axes: Axes, panel: str) -> None:
    """Number both axes; on a log scale 1, 2 and 5, of less than tenfold even steps."""
    if panel == LOSSES:
        axes.set_yscale("log")
    low, high = axes.get_ylim()
    axes.yaxis.set_major_locator(MaxNLocator(4))
    if panel == LOSSES and high >= 10 * low:
        axes.yaxis.set_major_locator(LogLocator(subs=(1, 2, 5), numticks=6))
    axes.yaxis.set_minor_formatter(NullFormatter())
    axes.xaxis.set_major_locator(MaxNLocator(8, integer=True))
    page.write_numbers(axes.xaxis, axes.yaxis)


def _caption(runs: int, window: float) -> str:
    """Say how the lines were made."""
    means = f"running means over {window:,.3g} episodes"
    if runs == 1:
        return f"bold: {means}; faint: as recorded"
    return f"thin: each run, {means}; bold: mean of the runs, where all have values"
