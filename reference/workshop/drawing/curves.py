"""Learning curves of both sides on one time axis, from the table that training writes.

Clauses: E6.  Time is episodes played: each is one of the robots and one of the fire, so
both share it, while a decision of one side is none of the other.  A row of the table is
written when a summary of one side is due, and tells of the time since its last one.

    x  episodes played up to a row;  y  what a column says there, nan if it is empty
"""

from collections.abc import Iterable, Sequence
from math import nan
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter

from reference.building import Kind
from reference.workshop.drawing.evacuation import DROP, EMBER
from reference.workshop.drawing.page import (
    COLOURS,
    FAINT,
    PICTURES,
    TEXT,
    blank,
    heading,
    save,
    text_size,
    with_suffix,
)
from reference.workshop.drawing.runs import BOTH, Phase, Run, read

SMOOTHING = 0.05
"""Share of the time axis that a running mean looks at."""


Line = tuple[np.ndarray, np.ndarray]
"""x and y, (k,) each; nan where it is broken."""
Found = tuple[np.ndarray, np.ndarray, np.ndarray]
"""x, y and part, (k,) each, part as in `Rows`."""


def draw(paths: Sequence[str | Path], output: str | Path) -> Path:
    """Draw the runs in these tables, or folders of runs, into a picture; its path.

    Raises ValueError for another suffix and for a table with nothing to draw, OSError
    where a file cannot be read or written.
    """
    with_suffix(output, PICTURES, "a picture")
    return save(figure([read(path) for path in paths]), output)


# -- The curves ---------------------------------------------------------------------


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
_BASELINE_DASHES = "--"

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
            Curve("robots", _BASELINE, ROBOTS, _BASELINE_DASHES),
            Curve("fire", _VALUE, FIRE),
        ),
        "log",
    ),
)


def smooth(x: np.ndarray, y: np.ndarray, part: np.ndarray, window: float) -> np.ndarray:
    """Means of y over the points within half a window of each x; all (k,).

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
    """The mean of some lines, 400 points where all of them are; x ascends in each.

    nan where any has a gap; no points where no two lines meet.
    """
    first = max(x[0] for x, _ in lines)
    last = min(x[-1] for x, _ in lines)
    x = np.linspace(first, last, 400 if first < last else 0)
    ys = [np.interp(x, *line) for line in lines]
    return x, np.mean(ys, axis=0)


def points(run: Run, curve: Curve) -> Found:
    """Where the table of a run has values for a curve."""
    nothing = np.empty(0)
    rows = run.sides.get(curve.side)
    if rows is None or curve.column not in rows.values:
        return nothing, nothing, nothing
    y = rows.values[curve.column] * curve.times
    known = np.isfinite(y)
    return rows.episodes[known], y[known], rows.part[known]


def with_gaps(x: np.ndarray, y: np.ndarray, part: np.ndarray) -> Line:
    """The line through points, broken where a whole phase has none."""
    after = np.flatnonzero(np.diff(part) > 1) + 1
    middles = (x[after - 1] + x[after]) / 2
    return np.insert(x, after, middles), np.insert(y, after, nan)


# -- The page -----------------------------------------------------------------------

_WIDTH, _LEFT, _RIGHT = 11.0, 1.0, 0.35  # inches
_PANEL, _APART = 1.65, 0.3
_TITLE, _STRIP, _BELOW = 0.62, 0.26, 1.1
_LEAD_IN = 0.08  # of the time axis, for what went on before the first episode
_SMALLEST = 6.5  # points of a phase's name in its strip
_GREYS = ("#e7ebf0", "#cbd3dc", "#aeb8c4", "#8e9aa8", "#5f6873")  # for every eye
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
    """Reward, survivors, entropy and losses over the episodes played [E6].

    One run: its values faint, their running means bold. Several, such as seeds: the
    running means of each thin, their mean bold. Phases stand in a strip above, where
    there is more than one. Raises ValueError where there is nothing to draw.
    """
    sheet = Sheet(runs)
    for number, track in enumerate(sheet.tracks):
        _draw_strip(sheet, sheet.strip(number), track)
    for number, panel in enumerate(sheet.panels):
        axes = sheet.panel(number)
        _draw_panel(sheet, axes, panel)
        _mark_switches(axes, sheet.tracks)
        axes.tick_params(labelbottom=panel is sheet.panels[-1])
    axes.set_xlabel("episodes played by both sides", fontsize=9, color=TEXT)
    heading(sheet.page, _title(runs))
    _legend(sheet)
    _caption(sheet)
    return sheet.page


class Sheet:
    """An empty page for some runs, with places for what goes onto it.

    panels  those that have something to show;  tracks  the strips above them
    start   of the time axis, and its end: episodes;  window  of the running means
    shades  a grey for each name of a phase
    """

    def __init__(self, runs: Sequence[Run]):
        self.runs = runs
        self.panels = [panel for panel in PANELS if self.has(panel.curves)]
        if not self.panels:
            raise ValueError(
                "no rewards, entropies and losses to draw: train for longer first."
            )
        self.tracks = _tracks(runs)
        names = [phase.name for track in self.tracks for phase in track.phases]
        order = enumerate(dict.fromkeys(names))
        self.shades = {name: _GREYS[k % len(_GREYS)] for k, name in order}
        self.end = max(run.end for run in runs) or 1.0
        early = any(track.phases[0].end == 0 for track in self.tracks)
        self.start = -_LEAD_IN * self.end if early else 0.0
        self.window = SMOOTHING * self.end
        self.below = _BELOW + (_STRIP if self.tracks else 0)
        self.height = self.below + len(self.panels) * (_PANEL + _APART)
        self.page = blank(_WIDTH, self.height + len(self.tracks) * _STRIP + _TITLE)

    def has(self, curves: Iterable[Curve]) -> bool:
        """Is there a value of any of these curves?"""
        return any(len(points(run, c)[0]) for run in self.runs for c in curves)

    def panel(self, number: int) -> Axes:
        """The place of a panel, 0 is the highest."""
        return self._axes(self.height - (number + 1) * (_PANEL + _APART), _PANEL)

    def strip(self, number: int) -> Axes:
        """The place of a strip, 0 is the highest."""
        above = len(self.tracks) - number - 1
        return self._axes(self.height + above * _STRIP, _STRIP - 0.05)

    def _axes(self, bottom: float, height: float) -> Axes:
        """Over the whole time, at so many inches above the lower edge."""
        up, wide = self.up(1), (_WIDTH - _LEFT - _RIGHT) / _WIDTH
        axes = self.page.add_axes((_LEFT / _WIDTH, bottom * up, wide, height * up))
        axes.set_xlim(self.start, self.end)
        return axes

    def up(self, inches: float) -> float:
        """The share of the page's height that so many inches are."""
        return float(inches / self.page.get_size_inches()[1])


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


def _draw_strip(sheet: Sheet, axes: Axes, track: Track) -> None:
    """The phases as a bar, each with its name where that fits."""
    axes.set_axis_off()
    axes.set_ylim(0, 1)
    inches = (_WIDTH - _LEFT - _RIGHT) / (sheet.end - sheet.start)
    for name, start, end in track.phases:
        first = start if end else sheet.start
        shade = sheet.shades[name]
        axes.broken_barh([(first, end - first)], (0, 1), color=shade, ec="white")
        size = text_size(name, (end - first) * inches, 9)
        if size >= _SMALLEST:
            ink = "white" if shade == _GREYS[-1] else TEXT
            _write(axes, (first + end) / 2, name, size=size, color=ink, ha="center")
    size = text_size(track.name or " ", _LEFT - 0.15, 8)
    place = sheet.start - 0.1 / inches
    _write(axes, place, track.name, size=size, color=FAINT, ha="right")


def _write(axes: Axes, place: float, words: str, **look: Any) -> None:
    axes.text(place, 0.47, words, va="center", parse_math=False, **look)


def _mark_switches(axes: Axes, tracks: Sequence[Track]) -> None:
    for phase in (phase for track in tracks for phase in track.phases[1:]):
        axes.axvline(phase.start, color=FAINT, lw=0.8, ls=(0, (3, 2)), zorder=0.5)


def _draw_panel(sheet: Sheet, axes: Axes, panel: Panel) -> None:
    axes.set_yscale(panel.scale)
    for curve in panel.curves:
        found = [points(run, curve) for run in sheet.runs]
        if known := [each for each in found if len(each[0])]:
            _draw_curve(axes, curve, known, sheet.window)
    axes.spines[["top", "right"]].set_visible(False)
    axes.spines[["left", "bottom"]].set_color(FAINT)
    axes.tick_params(labelsize=8, color=FAINT, labelcolor=FAINT, length=3)
    _label_ticks(axes)
    axes.grid(axis="y", color=FAINT, alpha=0.2, linewidth=0.6)
    axes.set_title(panel.title, fontsize=10, color=TEXT, loc="left", pad=4)
    axes.set_ylabel(panel.unit, fontsize=8, color=FAINT)
    axes.yaxis.set_label_coords(-0.062, 0.5)


def _label_ticks(axes: Axes) -> None:
    """Numbers as people write them, few of them; none before the first episode."""
    if axes.get_yscale() == "log":
        axes.yaxis.set_major_locator(LogLocator(subs=(1, 2, 5), numticks=6))
        axes.yaxis.set_minor_formatter(NullFormatter())
    else:
        axes.yaxis.set_major_locator(MaxNLocator(4))
    axes.yaxis.set_major_formatter(FuncFormatter(_number))
    axes.xaxis.set_major_formatter(FuncFormatter(_number))
    axes.xaxis.set_major_locator(MaxNLocator(8, integer=True))
    ticks = np.asarray(axes.get_xticks())
    axes.set_xticks(ticks[(ticks >= 0) & (ticks <= axes.get_xlim()[1])])


def _number(value: float, _: object) -> str:
    """1234.5 is 1,234.5, and -2 is −2."""
    return f"{value:,.10g}".replace("-", "−")


def _draw_curve(axes: Axes, curve: Curve, runs: Sequence[Found], window: float) -> None:
    """A line for each run that has the column, and a bold one; see `figure`."""
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


def _legend(sheet: Sheet) -> None:
    """The lines in a first row, the phases in a second."""
    phases = [Patch(facecolor=sheet.shades[name], label=name) for name in sheet.shades]
    if phases:
        phases.insert(0, Patch(facecolor="none", label="phases:"))
    for handles, below in ((_samples(sheet), 0.62), (phases, 0.88)):
        if handles:
            sheet.page.legend(
                handles=handles,
                loc="center",
                bbox_to_anchor=(0.5, sheet.up(sheet.below - below)),
                ncols=len(handles),
                fontsize=9,
                frameon=False,
                labelcolor=TEXT,
                handlelength=2.8,
                columnspacing=1.8,
            )


def _samples(sheet: Sheet) -> list[Line2D]:
    """Legend entries of the lines in the panels; people have a panel of their own."""
    curves = (curve for panel in sheet.panels for curve in panel.curves)
    drawn = {(curve.colour, curve.dashes) for curve in curves if sheet.has([curve])}
    names = {
        (ROBOTS, "-"): "robots",
        (ROBOTS, _BASELINE_DASHES): "robots' baseline",
        (FIRE, "-"): "fire",
    }
    return [
        Line2D([], [], color=colour, ls=dashes, lw=2, label=names[colour, dashes])
        for colour, dashes in names
        if (colour, dashes) in drawn
    ]


def _caption(sheet: Sheet) -> None:
    """How the lines were made, and how many decisions stand behind them."""
    episodes = "episode" if round(sheet.window) == 1 else "episodes"
    means = f"running means over {sheet.window:,.0f} {episodes}"
    if sheet.tracks:
        means = f"{means}, none across a switch of phase"
    lines = (
        f"bold: {means}; faint: as recorded"
        if len(sheet.runs) == 1
        else f"thin: each run, {means}; bold: mean of the runs, where all have values"
    )
    steps = (f"{side} {_decisions(sheet.runs, side)}" for side in ("robots", "fire"))
    sheet.page.text(
        0.5,
        sheet.up(0.07),
        f"{lines}\ndecisions by the end: {', '.join(steps)}",
        fontsize=8,
        color=FAINT,
        ha="center",
        va="bottom",
        linespacing=1.3,
    )


def _decisions(runs: Sequence[Run], side: str) -> str:
    """How many a side has taken, in words; in several runs, on average."""
    known = [run.sides[side].values["step"][-1] for run in runs if side in run.sides]
    return f"{np.mean(known):,.0f}" if known else "none learned from"
