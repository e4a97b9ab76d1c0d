"""Learning curves of both sides over the episodes played.

Clauses: E6.  Both sides play each episode, so they can share this axis; their decisions
differ in number.

    x  episodes played up to a row;  y  what a column says there, nan if it is empty
"""

from collections.abc import Sequence
from math import nan
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, MaxNLocator, NullFormatter

from reference.building import Kind
from reference.paper import InputError
from reference.workshop.drawing import page
from reference.workshop.drawing.evacuation import DROP, EMBER
from reference.workshop.drawing.page import COLOURS
from reference.workshop.drawing.runs import Phase, Run
from reference.workshop.training.summaries import GROUP_REWARD, OWN_REWARD, SURVIVAL

SMOOTHING = 0.05
"""Share of the time axis that a running mean covers."""

Line = tuple[np.ndarray, np.ndarray]
"""x and y of a line, (k,) each; nan where it is broken."""
Found = tuple[np.ndarray, np.ndarray, np.ndarray]
"""x, y and part, (k,) each, part as in `Run`."""


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


def smooth(x: np.ndarray, y: np.ndarray, part: np.ndarray, window: float) -> np.ndarray:
    """Average y over the points within half a window of each x; all (k,).

    x ascends. Only points of the same part count, so that no mean looks across a
    switch; near the ends the window is cut off.
    """
    means = np.empty(len(y))
    for one in np.unique(part):
        here = part == one
        sums = np.concatenate([[0.0], np.cumsum(y[here])])
        first = np.searchsorted(x[here], x[here] - window / 2, "left")
        last = np.searchsorted(x[here], x[here] + window / 2, "right")
        means[here] = (sums[last] - sums[first]) / (last - first)
    return means


def mean_of(lines: Sequence[Line]) -> Line:
    """Average lines at 400 points where all of them are; x ascends in each.

    nan where any has a gap; no points unless all lines overlap.
    """
    first = max(x[0] for x, _ in lines)
    last = min(x[-1] for x, _ in lines)
    x = np.linspace(first, last, 400 if first < last else 0)
    return x, np.mean([np.interp(x, *line) for line in lines], axis=0)


def points(run: Run, curve: Curve) -> Found:
    """Find where the table of a run has values for a curve."""
    y = run.columns[curve.column] * curve.times
    known = np.isfinite(y) & (not curve.side or run.columns["side"] == curve.side)
    return run.columns["episodes"][known], y[known], run.part[known]


def with_gaps(x: np.ndarray, y: np.ndarray, part: np.ndarray) -> Line:
    """Break the line through points where a whole phase has none."""
    after = np.flatnonzero(np.diff(part) > 1) + 1
    middles = (x[after - 1] + x[after]) / 2
    return np.insert(x, after, middles), np.insert(y, after, nan)


# -- The page -----------------------------------------------------------------------

_WIDTH, _PANEL, _REST = 11.0, 1.9, 1.7  # inches
_LEAD_IN = 0.08  # of the time axis, for what went on before the first episode
_GREYS = ("#e7ebf0", "#f0ebdf", "#d5dce4", "#e0d7c2", "#c3ccd6")  # of phases
_MARKS: dict[str, dict[str, Any]] = {
    ROBOTS: {"marker": "D", "ms": 6},
    FIRE: {"marker": DROP, "ms": 10},
    PEOPLE: {"marker": "o", "ms": 6},
}


def figure(runs: Sequence[Run]) -> Figure:
    """Draw reward, survivors, entropy and losses over the episodes played [E6].

    One run: its values faint, their running means bold. Several, such as seeds: the
    running means of each thin, their mean bold. Values so far apart that no mean takes
    in two of them are drawn as they are. Phases are shaded, where there is more than
    one and all runs have the same. Raises ValueError where there is nothing to draw.
    """
    curves = [c for c in CURVES if any(len(points(run, c)[0]) for run in runs)]
    panels = list(dict.fromkeys(curve.panel for curve in curves))
    if not panels:
        raise InputError(
            "no rewards, entropies and losses to draw: train for longer first."
        )
    phases = _phases(runs)
    names = page.shortened(", ".join(run.name for run in runs), 70)
    height = _PANEL * len(panels) + _REST
    whole = page.sheet(f"Learning curves: {names}", _WIDTH, height)
    look: dict[str, Any] = {"sharex": True, "squeeze": False}
    rest = whole.subplots(len(panels), **look)[:, 0]
    rest[-1].set_xlabel("episodes played by both sides")
    whole.align_ylabels(rest)
    end = max(run.end for run in runs) or 1.0
    early = any(phase.end == 0 for phase in phases)
    rest[0].set_xlim(-_LEAD_IN * end if early else 0.0, end)
    for axes, panel in zip(rest, panels, strict=True):
        _draw_panel(axes, panel, phases)
    found = [[f for f in (points(run, c) for run in runs) if len(f[0])] for c in curves]
    window = _window(found, SMOOTHING * end)
    for curve, lines in zip(curves, found, strict=True):
        _draw_curve(rest[panels.index(curve.panel)], curve, lines, window)
    for axes, panel in zip(rest, panels, strict=True):
        _place_numbers(axes, panel)
    page.foot(whole, caption=_caption(runs, window), handlelength=2.8)
    return whole


def _window(curves: Sequence[Sequence[Found]], window: float) -> float:
    """Episodes that a running mean covers; 0 where that many would change nothing."""
    found = [each for curve in curves for each in curve]
    same = (np.allclose(smooth(x, y, part, window), y) for x, y, part in found)
    return 0.0 if all(same) else window


def _phases(runs: Sequence[Run]) -> list[Phase]:
    """Phases that all runs have, if more than one; the means of when they switch."""
    names = {tuple(phase.name for phase in run.phases) for run in runs}
    if len(names) > 1 or len(runs[0].phases) == 1:
        return []
    ends = np.mean([[phase.end for phase in run.phases] for run in runs], axis=0)
    ends[-1] = max(run.end for run in runs)
    return list(map(Phase, *names, [0.0, *ends[:-1]], ends))


def _draw_panel(axes: Axes, panel: str, phases: Sequence[Phase]) -> None:
    """Draw title, scale, grid, and the phases as shades."""
    if panel == LOSSES:
        axes.set_yscale("log")
    axes.grid(axis="y")
    axes.set_title(panel)
    axes.set_ylabel(UNITS[panel], fontsize=8)
    shades = dict(zip(dict.fromkeys(p.name for p in phases), _GREYS, strict=False))
    left, _ = axes.get_xlim()
    for name, start, end in phases:
        bar = axes.axvspan(start if end else left, end, color=shades[name], lw=0)
        bar.set(label=f"phase {name}", zorder=0)


def _place_numbers(axes: Axes, panel: str) -> None:
    """Number both axes; on a log scale 1, 2 and 5, of less than tenfold even steps."""
    low, high = axes.get_ylim()
    axes.yaxis.set_major_locator(MaxNLocator(4))
    if panel == LOSSES and high >= 10 * low:
        axes.yaxis.set_major_locator(LogLocator(subs=(1, 2, 5), numticks=6))
    axes.yaxis.set_minor_formatter(NullFormatter())
    axes.xaxis.set_major_locator(MaxNLocator(8, integer=True))
    page.write_numbers(axes.xaxis, axes.yaxis)


def _draw_curve(axes: Axes, curve: Curve, runs: Sequence[Found], window: float) -> None:
    """Draw a line for each run that has the column, and a bold one; see `figure`."""
    look: dict[str, Any] = {"color": curve.colour, "ls": curve.dashes}
    smoothed = [with_gaps(x, smooth(x, y, part, window), part) for x, y, part in runs]
    if len(runs) == 1:
        bold, thin = smoothed[0], [with_gaps(*runs[0])] if window else []
    else:
        bold, thin = mean_of(smoothed), smoothed
    for line in thin:
        axes.plot(*line, lw=0.9, alpha=0.4, marker=".", ms=2, **look)
    mark = _MARKS[curve.colour] if curve.dashes == "-" else {}
    look |= {"markevery": [-1], "clip_on": False, "label": curve.label}
    axes.plot(*bold, lw=2, **mark, **look)


def _caption(runs: Sequence[Run], window: float) -> str:
    """Say how the lines were made, and how many decisions stand behind them."""
    means = f"running means over {window:,.0f} episode{'s' * (round(window) != 1)}"
    if any(len(run.phases) > 1 for run in runs):
        means += ", none across a switch of phase"
    if not window:
        means = "as recorded"
    lines = f"thin: each run, {means}; bold: mean of the runs, where all have values"
    if len(runs) == 1:
        lines = f"bold: {means}; faint: as recorded" if window else f"lines: {means}"
    known = [(side, _decisions(runs, side)) for side in ("robots", "fire")]
    learned = ", ".join(f"{side} {count:,.0f}" for side, count in known if count)
    return f"{lines}\ndecisions learned from: {learned}"


def _decisions(runs: Sequence[Run], side: str) -> float:
    """Decisions of a side up to its last summary; of several runs, on average."""
    steps = [run.columns["step"][run.columns["side"] == side] for run in runs]
    last = [float(step[-1]) for step in steps if len(step)]
    return float(np.mean(last)) if last else 0.0
