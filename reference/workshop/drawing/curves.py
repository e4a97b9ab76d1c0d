"""Learning curves of both sides over the episodes played.

Clauses: E6.  Each episode is one of the robots and one of the fire, so both sides share
the time axis, while a decision of one is none of the other.

    x  episodes played up to a row;  y  what a column says there, nan if it is empty
"""

from collections.abc import Iterable, Sequence
from math import nan
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import LogLocator, MaxNLocator, NullFormatter

from reference.building import Kind
from reference.workshop.drawing.evacuation import DROP, EMBER
from reference.workshop.drawing.page import (
    COLOURS,
    FAINT,
    PICTURES,
    foot,
    save,
    sheet,
    with_suffix,
    write_numbers,
)
from reference.workshop.drawing.runs import BOTH, SIDES, Phase, Run, read

SMOOTHING = 0.05
"""Share of the time axis that a running mean looks at."""

Line = tuple[np.ndarray, np.ndarray]
"""x and y, (k,) each; nan where it is broken."""
Found = tuple[np.ndarray, np.ndarray, np.ndarray]
"""x, y and part, (k,) each, part as in `Run`."""


def draw(paths: Sequence[str | Path], output: str | Path) -> Path:
    """Draw the runs in these tables, or folders of runs, into a picture; its path.

    Raises ValueError for another suffix and for a table with nothing to draw, OSError
    where a file cannot be read or written.
    """
    with_suffix(output, PICTURES, "a picture")
    return save(figure([read(path) for path in paths]), output)


# -- What is drawn ------------------------------------------------------------------


class Curve(NamedTuple):
    """A line of a panel: whose rows, which column, times what, and how it looks."""

    side: str
    column: str
    colour: str
    dashes: str = "-"
    times: float = 1.0


class Panel(NamedTuple):
    """What goes up, in which units and on which scale, and the lines in it."""

    title: str
    unit: str
    curves: tuple[Curve, ...]
    scale: str = "linear"


ROBOTS, FIRE, PEOPLE = "#1b5e9e", EMBER, COLOURS[Kind.EXIT]
_VALUE, _BASELINE = "Losses/Value Loss", "Losses/Baseline Loss"

PANELS = (
    Panel(
        "reward of an episode",
        "health points",
        (
            Curve(BOTH, "Environment/Group Cumulative Reward", ROBOTS),
            Curve("fire", "Environment/Cumulative Reward", FIRE),
        ),
    ),
    Panel(
        "survivors",
        "% of all people",
        (Curve(BOTH, "Environment/Survival", PEOPLE, times=100),),
    ),
    Panel(
        "entropy of the policies",
        "nats",
        (
            Curve("robots", "Policy/Entropy", ROBOTS),
            Curve("fire", "Policy/Entropy", FIRE),
        ),
    ),
    Panel(
        "losses of the critics",
        "(scaled return)²",
        (
            Curve("robots", _VALUE, ROBOTS),
            Curve("robots", _BASELINE, ROBOTS, "--"),
            Curve("fire", _VALUE, FIRE),
        ),
        "log",
    ),
)
_NAMES = {
    (ROBOTS, "-"): "robots",
    (ROBOTS, "--"): "robots' baseline",
    (FIRE, "-"): "fire",
}


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

    nan where any has a gap; no points where no two lines meet.
    """
    first = max(x[0] for x, _ in lines)
    last = min(x[-1] for x, _ in lines)
    x = np.linspace(first, last, 400 if first < last else 0)
    return x, np.mean([np.interp(x, *line) for line in lines], axis=0)


def points(run: Run, curve: Curve) -> Found:
    """Find where the table of a run has values for a curve."""
    y = run.columns.get(curve.column, np.full(len(run.part), nan)) * curve.times
    known = run.rows_of(curve.side) & np.isfinite(y)
    return run.columns["episodes"][known], y[known], run.part[known]


def with_gaps(x: np.ndarray, y: np.ndarray, part: np.ndarray) -> Line:
    """Break the line through points where a whole phase has none."""
    after = np.flatnonzero(np.diff(part) > 1) + 1
    middles = (x[after - 1] + x[after]) / 2
    return np.insert(x, after, middles), np.insert(y, after, nan)


# -- The page -----------------------------------------------------------------------

_WIDTH, _PANEL, _STRIP, _REST = 11.0, 1.9, 0.26, 1.7  # inches
_LEAD_IN = 0.08  # of the time axis, for what went on before the first episode
_LETTER = 0.0075  # of the time axis, in the name of a phase
_GREYS = ("#e7ebf0", "#cbd3dc", "#aeb8c4", "#dfd6c4", "#c4b99f")  # dark on none is lost
_MARKS: dict[str, dict[str, Any]] = {
    ROBOTS: {"marker": "D", "ms": 6},
    FIRE: {"marker": DROP, "ms": 10},
    PEOPLE: {"marker": "o", "ms": 6},
}


class Track(NamedTuple):
    """A strip above the panels: whose it is, "" for everybody's, and the phases."""

    name: str
    phases: tuple[Phase, ...]


def figure(runs: Sequence[Run]) -> Figure:
    """Draw reward, survivors, entropy and losses over the episodes played [E6].

    One run: its values faint, their running means bold. Several, such as seeds: the
    running means of each thin, their mean bold. Phases stand in a strip above, where
    there is more than one. Raises ValueError where there is nothing to draw.
    """
    panels = [panel for panel in PANELS if _known(runs, panel.curves)]
    if not panels:
        raise ValueError(
            "no rewards, entropies and losses to draw: train for longer first."
        )
    tracks = _tracks(runs)
    heights = [_STRIP] * len(tracks) + [_PANEL] * len(panels)
    page = sheet(_title(runs), _WIDTH, sum(heights) + _REST)
    rows = page.subplots(
        len(heights), sharex=True, squeeze=False, height_ratios=heights
    )[:, 0]
    end = max(run.end for run in runs) or 1.0
    early = any(track.phases[0].end == 0 for track in tracks)
    rows[0].set_xlim(-_LEAD_IN * end if early else 0.0, end)
    names = [phase.name for track in tracks for phase in track.phases]
    shades = {
        name: _GREYS[k % len(_GREYS)] for k, name in enumerate(dict.fromkeys(names))
    }
    for axes, track in zip(rows, tracks, strict=False):
        _draw_strip(axes, track, shades)
    for axes, panel in zip(rows[len(tracks) :], panels, strict=True):
        _draw_panel(axes, panel, runs, SMOOTHING * end)
        for phase in (phase for track in tracks for phase in track.phases[1:]):
            axes.axvline(phase.start, color=FAINT, lw=0.8, ls=(0, (3, 2)), zorder=0.5)
    rows[-1].set_xlabel("episodes played by both sides")
    page.align_ylabels(rows[len(tracks) :])
    samples = [*_samples(runs, panels), *_phase_samples(shades)]
    foot(
        page,
        samples,
        caption=_caption(runs, SMOOTHING * end, bool(tracks)),
        handlelength=2.8,
    )
    return page


def _known(runs: Sequence[Run], curves: Iterable[Curve]) -> bool:
    """Is there a value of any of these curves?"""
    return any(len(points(run, curve)[0]) for run in runs for curve in curves)


def _tracks(runs: Sequence[Run]) -> list[Track]:
    """None without a switch; one if all go through the same phases; or each its own.

    Runs of the same phases switch at nearly the same episodes: at their mean.
    """
    names = {tuple(phase.name for phase in run.phases) for run in runs}
    if all(len(each) == 1 for each in names):
        return []
    if len(names) > 1:
        return [Track(run.name, run.phases) for run in runs]
    ends = np.mean([[phase.end for phase in run.phases] for run in runs], axis=0)
    ends[-1] = max(run.end for run in runs)
    starts = [0.0, *ends[:-1]]
    return [Track("", tuple(map(Phase, *names, starts, ends)))]


def _title(runs: Sequence[Run]) -> str:
    names = [run.name for run in runs]
    if len(names) == 1:
        return f"Learning curves: {names[0]}"
    shown = names if len(names) <= 4 else [*names[:2], "…", names[-1]]
    return f"Learning curves of {len(names)} runs: {', '.join(shown)}"


def _draw_strip(axes: Axes, track: Track, shades: dict[str, str]) -> None:
    """Draw the phases as a bar, each with its name where that fits."""
    axes.spines[:].set_visible(False)
    axes.tick_params(length=0, labelbottom=False)
    axes.set_yticks([0.5], [track.name])
    left, right = axes.get_xlim()
    for name, start, end in track.phases:
        start = start if end else left
        axes.broken_barh([(start, end - start)], (0, 1), color=shades[name], ec="white")
        if len(name) * _LETTER < (end - start) / (right - left):
            middle = (start + end) / 2
            axes.text(middle, 0.45, name, fontsize=8, ha="center", va="center")


def _draw_panel(axes: Axes, panel: Panel, runs: Sequence[Run], window: float) -> None:
    axes.set_yscale(panel.scale)
    for curve in panel.curves:
        found = [points(run, curve) for run in runs]
        if known := [each for each in found if len(each[0])]:
            _draw_curve(axes, curve, known, window)
    axes.yaxis.set_major_locator(MaxNLocator(4))
    if panel.scale == "log":
        axes.yaxis.set_major_locator(LogLocator(subs=(1, 2, 5), numticks=6))
        axes.yaxis.set_minor_formatter(NullFormatter())
    axes.xaxis.set_major_locator(MaxNLocator(8, integer=True))
    write_numbers(axes.xaxis, axes.yaxis)
    axes.grid(axis="y")
    axes.set_title(panel.title)
    axes.set_ylabel(panel.unit, fontsize=8)


def _draw_curve(axes: Axes, curve: Curve, runs: Sequence[Found], window: float) -> None:
    """Draw a line for each run that has the column, and a bold one; see `figure`."""
    look: dict[str, Any] = {"color": curve.colour, "ls": curve.dashes}
    smoothed = [with_gaps(x, smooth(x, y, part, window), part) for x, y, part in runs]
    if len(runs) == 1:
        bold, thin = smoothed[0], [with_gaps(*runs[0])]
    else:
        bold, thin = mean_of(smoothed), smoothed
    for x, y in thin:
        axes.plot(x, y, lw=0.9, alpha=0.4, **look)
        lone = _lone(y)
        axes.plot(x[lone], y[lone], ls="", marker=".", ms=4, color=curve.colour)
    mark = _MARKS[curve.colour] if curve.dashes == "-" else {}
    axes.plot(*bold, lw=2, markevery=[-1], clip_on=False, **mark, **look)


def _lone(y: np.ndarray) -> np.ndarray:
    """(k,) bool: values between two gaps, which a line does not show."""
    gap = np.concatenate([[True], np.isnan(y), [True]])
    return gap[:-2] & gap[2:] & ~gap[1:-1]


# -- Below the panels ---------------------------------------------------------------


def _samples(runs: Sequence[Run], panels: Iterable[Panel]) -> list[Artist]:
    """Legend entries of the lines; people have a panel of their own."""
    curves = [curve for panel in panels for curve in panel.curves]
    drawn = {(c.colour, c.dashes) for c in curves if _known(runs, [c])}
    return [
        Line2D([], [], color=look[0], ls=look[1], lw=2, label=name)
        for look, name in _NAMES.items()
        if look in drawn
    ]


def _phase_samples(shades: dict[str, str]) -> list[Artist]:
    return [Patch(color=shade, label=f"phase {name}") for name, shade in shades.items()]


def _caption(runs: Sequence[Run], window: float, switches: bool) -> str:
    """How the lines were made, and how many decisions stand behind them."""
    means = f"running means over {window:,.0f} episode{'s' * (round(window) != 1)}"
    if switches:
        means += ", none across a switch of phase"
    lines = f"thin: each run, {means}; bold: mean of the runs, where all have values"
    if len(runs) == 1:
        lines = f"bold: {means}; faint: as recorded"
    decisions = ", ".join(f"{side} {_decisions(runs, side)}" for side in SIDES)
    return f"{lines}\ndecisions by the end: {decisions}"


def _decisions(runs: Sequence[Run], side: str) -> str:
    """How many a side has taken, in words; in several runs, on average."""
    steps = [run.columns["step"][run.rows_of(side)] for run in runs]
    last = [step[-1] for step in steps if len(step)]
    return f"{np.mean(last):,.0f}" if last else "none learned from"
