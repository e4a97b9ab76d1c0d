"""The ruler drawn: what a reward is worth, and E over reward and difficulty.

Clauses: F1, F2, F3, F6, F9, F10.  `curve` explains the ruler, `contours` shows where on
it the evaluated stand.

    R   reward, health points;  h   difficulty;  E   score
    y   what R is worth;        e′  y and what h adds to it
"""

from collections.abc import Iterable, Iterator, Sequence
from functools import partial
from itertools import product
from math import cos, pi, sin
from typing import Any, NamedTuple

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.colors import TwoSlopeNorm
from matplotlib.contour import QuadContourSet
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patheffects import withStroke
from matplotlib.text import Annotation, Text
from matplotlib.ticker import FuncFormatter, MaxNLocator

from reference.building import Kind
from reference.evaluation.score import LARGEST, PAPER, Ruler, RulerError
from reference.paper import BEST_POINT, WORST_POINT
from reference.workshop.drawing.evacuation import EMBER
from reference.workshop.drawing.page import COLOURS, FAINT, TEXT, blank, heading

BEST_REWARD = 15_000.0
"""[F6] R_b as the paper rounds it."""

PRINTED = {WORST_POINT[0]: "0.00004", BEST_POINT[0]: "0.4", BEST_REWARD: "0.5"}
"""[F3] the slopes as the text prints them, by the reward they belong to."""

CURVE, SLOPE, CASE = "#1b5e9e", EMBER, COLOURS[Kind.ENTRANCE]
_HALO = [withStroke(linewidth=3, foreground="white")]


class Reading(NamedTuple):
    """Somebody's mean reward and difficulty; each with its interval, if known."""

    label: str
    reward: float
    difficulty: float
    rewards: tuple[float, float] | None = None
    difficulties: tuple[float, float] | None = None


# -- What a reward is worth ---------------------------------------------------------


class _Marks(NamedTuple):
    """Rewards that a curve is drawn around: R1, R2, R_b, and where y = β."""

    worst: float
    steep: float
    best: float
    baseline: float

    @classmethod
    def of(cls, ruler: Ruler, best_reward: float) -> "_Marks":
        worst, steep = (ruler.reward_at(y) for _, y in (WORST_POINT, BEST_POINT))
        return cls(worst, steep, best_reward, ruler.reward_at(ruler.beta))

    @property
    def span(self) -> tuple[float, float]:
        """The rewards that are shown."""
        room = 0.05 * (max(self) - min(self))
        return min(self) - room, max(self) + room


def curve(
    ruler: Ruler = PAPER,
    best_reward: float = BEST_REWARD,
    cases: Iterable[Sequence[Any]] = (),
) -> Figure:
    """y over R on a linear and on a logarithmic scale, with both critical points.

    best_reward is R_b. Cases stand on the lower scale: as high as their reward lifts
    them, and by how much their difficulty lifts them further. On the paper's ruler the
    slopes carry what the text prints of them [F3]. Raises RulerError where something
    lies off the ruler.
    """
    page = blank(11, 9.6)
    whose = "the paper's ruler" if ruler == PAPER else "a calibrated ruler"
    heading(page, f"What a reward is worth: {whose}")
    marks = _Marks.of(ruler, best_reward)
    upper = page.add_axes((0.085, 0.545, 0.83, 0.355))
    lower = page.add_axes((0.085, 0.06, 0.83, 0.385))
    R = np.linspace(*marks.span, 600)
    for axes in (upper, lower):
        axes.plot(R, ruler.reward_part(R), color=CURVE, lw=2.4, zorder=3)
        axes.plot(_beyond(ruler, marks), [ruler.beta] * 2, color=FAINT, lw=1.2, ls=":")
        axes.set(xlim=marks.span, xlabel="reward R, health points")
        axes.set_ylabel("y = b^(R/α) / c")
    _explode(upper, ruler, marks)
    _straighten(lower, ruler, marks, [Reading(*case) for case in cases])
    return page


def _explode(axes: Axes, ruler: Ruler, marks: _Marks) -> None:
    """On a linear scale: the slopes, and how high R_b and E = 1 lie."""
    _title(axes, "Linear scale: flat while all is lost, steep where little can be won")
    top = 1.35 * max(ruler.reward_part(R) for R in marks)
    axes.set_ylim(-0.05 * top, top)
    half = 0.06 * (marks.span[1] - marks.span[0])
    for R in marks[:3]:
        x = np.array([R - half, R + half])
        y = ruler.reward_part(R) + ruler.slope(R) * (x - R)
        axes.plot(x, y, color=SLOPE, lw=1.7, ls=(0, (4, 1.5)), zorder=4)
    _quiet(axes, ruler)
    points = [(R, ruler.reward_part(R)) for R in marks]
    _dots(axes, points, CURVE)
    axes.text(0.02, 0.95, _gains(ruler, marks), transform=axes.transAxes, **_NOTE)
    equal = f"R = {_short(marks.baseline)}, y = β = {_short(ruler.beta)}"
    words = [
        f"Critical Point 1, at R_w: {_at(ruler, marks.worst)}",
        f"Critical Point 2: {_at(ruler, marks.steep)}",
        f"R_b: {_at(ruler, marks.best)}",
        f"E = 1 without fire: {equal}",
    ]
    label(axes, points, words)


def _straighten(
    axes: Axes, ruler: Ruler, marks: _Marks, cases: Sequence[Reading]
) -> None:
    """On a logarithmic scale: b is a slope, c a height; what difficulty adds."""
    _title(axes, "Logarithmic scale: a straight line, which two points fix")
    axes.set_yscale("log")
    low, high = (ruler.reward_part(R) for R in marks.span)
    axes.set_ylim(low, 6 * max([high, *(ruler.unscaled(*c[1:3]) for c in cases)]))
    _quiet(axes, ruler)
    points = [(R, ruler.reward_part(R)) for R in (marks.worst, 0.0, marks.steep)]
    words = [
        f"Critical Point 1: y = {_short(points[0][1])}",
        f"y(0) = 1/c = {points[1][1]:.4g}",
        f"Critical Point 2: y = {_short(points[2][1])}",
    ]
    _dots(axes, points, CURVE)
    for case in cases:
        ends = ruler.reward_part(case.reward), ruler.unscaled(*case[1:3])
        axes.plot([case.reward] * 2, ends, color=CASE, lw=1.4, zorder=3)
    lifted = [(case.reward, ruler.unscaled(*case[1:3])) for case in cases]
    _dots(axes, lifted, CASE, "D")
    axes.text(0.98, 0.06, _line(ruler, bool(cases)), transform=axes.transAxes, **_RULE)
    label(axes, [*points, *lifted], [*words, *(_cut(c.label) for c in cases)])


_NOTE: dict[str, Any] = {
    "fontsize": 9,
    "color": TEXT,
    "va": "top",
    "linespacing": 1.5,
    "parse_math": False,
}
_RULE = _NOTE | {"va": "bottom", "ha": "right", "multialignment": "left"}


def _beyond(ruler: Ruler, marks: _Marks) -> tuple[float, float]:
    """From where E = 1 without fire to the right edge."""
    return marks.baseline, marks.span[1]


def _at(ruler: Ruler, R: float) -> str:
    """Where a point lies, and how steep the curve is there."""
    slope = _short(ruler.slope(R))
    if ruler == PAPER and round(R) in PRINTED:
        slope = f"{slope} (paper: {PRINTED[round(R)]})"
    return f"R = {_short(R)}, y = {_short(ruler.reward_part(R))}, slope {slope}"


def _gains(ruler: Ruler, marks: _Marks) -> str:
    """What the same step up is worth at the bottom, in the middle and at the top."""
    lines = [f"What {_short(ruler.alpha)} health points more add to y:"]
    for R in (marks.worst, 0.0, marks.steep):
        more = ruler.reward_part(R + ruler.alpha) - ruler.reward_part(R)
        lines.append(f"    from R = {_short(R)}:  {_short(more)}")
    return "\n".join([*lines, "", "Dashed: the slopes dy/dR"])


def _line(ruler: Ruler, cases: bool) -> str:
    """How the straight line is to be read."""
    tenfold = ruler.reward_at(10) - ruler.reward_at(1)
    lines = [
        f"y = b^(R/α) / c,  α = {_short(ruler.alpha)}",
        f"steepness: b = {ruler.base:.5g}, tenfold every {_short(tenfold)}",
        f"height: c = 1/{1 / ruler.control:.4g}",
    ]
    if cases:
        lines.append(f"{_CASE_NOTE}, k = {ruler.k:.3g}")
    return "\n".join(lines)


_CASE_NOTE = "upright: what difficulty adds, h²/(kα²)"


def _quiet(axes: Axes, ruler: Ruler) -> None:
    """Thin axes, with y or e′ on the left and the E of so much on the right."""
    _frame(axes)
    β = ruler.beta
    times = (partial(np.multiply, 1 / β), partial(np.multiply, β))
    score = axes.secondary_yaxis("right", functions=times)
    score.set_ylabel("E = e′ / β", fontsize=9, color=TEXT)
    score.tick_params(labelsize=8, color=FAINT, labelcolor=FAINT, length=3)
    score.yaxis.set_major_formatter(FuncFormatter(_number))
    score.spines["right"].set_color(FAINT)


# -- E over reward and difficulty ---------------------------------------------------

LEVELS = (0, 0.1, 0.25, 0.5, 0.75, 1, 1.25, 1.5, 1.75, 2)
"""Of E, between two shades; what lies above the last has a shade of its own."""

PALE = TwoSlopeNorm(1, vmin=-0.8, vmax=3.2)
SHADES = colormaps["BrBG"].with_extremes(over=colormaps["BrBG"](PALE(2.3)))
"""Brown below E = 1, green above; the darkest shades of the map are left out."""


def contours(ruler: Ruler = PAPER, readings: Iterable[Sequence[Any]] = ()) -> Figure:
    """E over R and h, the line E = 1, and each reading as a labelled point [F9] [F10].

    readings: `Reading`, or as much of it as there is. Those that lie off the ruler are
    not drawn but named.
    """
    found = [Reading(*reading) for reading in readings]
    shown = [reading for reading in found if _lies_on(ruler, reading)]
    page = blank(10, 7)
    heading(page, "The score E of reward and difficulty")
    axes = page.add_axes((0.09, 0.085, 0.77, 0.8))
    wide, high = _region(ruler, shown)
    shades = _shade(axes, ruler, wide, high)
    _draw_one(axes, ruler, wide[0])
    _frame(axes)
    axes.set(xlabel="reward R, health points", ylabel="difficulty h")
    _scale(page, shades)
    _place(axes, ruler, shown)
    _caption(axes, found, shown)
    return page


def _lies_on(ruler: Ruler, r: Reading) -> bool:
    """Can it be read, with its intervals?"""
    rewards = (r.reward, *(r.rewards or ()))
    corners = product(rewards, (r.difficulty, *(r.difficulties or ())))
    try:
        return all(ruler.score(*corner) >= 0 for corner in corners)
    except RulerError:
        return False


def _region(
    ruler: Ruler, readings: Sequence[Reading]
) -> tuple[tuple[float, float], tuple[float, float]]:
    """Rewards and difficulties that are shown: the line E = 1 and all readings."""
    rewards = [R for r in readings for R in (r.reward, *(r.rewards or ()))]
    hard = [h for r in readings for h in (r.difficulty, *(r.difficulties or ()))]
    worst, one = ruler.reward_at(WORST_POINT[1]), ruler.reward_at(ruler.beta)
    left = min([0.0, one + (worst - one) / 4, *rewards]) if rewards else worst
    right = max([one, *rewards])
    room = 0.05 * (right - left)
    wide = left - room, min(right + room, ruler.reward_at(LARGEST) - 1)
    return wide, (0.0, 1.1 * max([ruler.difficulty_at(wide[0]), *hard]))


def _shade(
    axes: Axes, ruler: Ruler, wide: tuple[float, float], high: tuple[float, float]
) -> QuadContourSet:
    """The shades of E, with thin lines between."""
    R, h = np.meshgrid(np.linspace(*wide, 300), np.linspace(*high, 300))
    E = ruler.score(R, h)
    axes.contour(R, h, E, LEVELS, colors="white", linewidths=0.8)
    return axes.contourf(R, h, E, LEVELS, cmap=SHADES, norm=PALE, extend="max")


def _draw_one(axes: Axes, ruler: Ruler, left: float) -> None:
    """The line E = 1, from reward alone to the left edge."""
    h = np.linspace(0, ruler.difficulty_at(left), 200)
    missing = ruler.beta - ruler.difficulty_part(h)
    axes.plot([ruler.reward_at(y) for y in missing], h, color=TEXT, lw=2.4, zorder=2)


def _scale(page: Figure, shades: QuadContourSet) -> None:
    """Which shade is which E."""
    bar = page.add_axes((0.885, 0.085, 0.022, 0.8))
    scale = page.colorbar(shades, cax=bar, spacing="proportional")
    scale.outline.set_visible(False)
    scale.set_label("E, 1 for the baseline", fontsize=9, color=TEXT)
    scale.set_ticks(LEVELS, labels=[_short(E) for E in LEVELS])
    scale.ax.tick_params(labelsize=8, color=FAINT, labelcolor=FAINT, length=3)


def _place(axes: Axes, ruler: Ruler, readings: Sequence[Reading]) -> None:
    """Dots with their intervals; and the line E = 1 has its name."""
    look: dict[str, Any] = {"color": TEXT, "lw": 1, "zorder": 3}
    for r in readings:
        if r.rewards:
            axes.plot(r.rewards, [r.difficulty] * 2, **look)
        if r.difficulties:
            axes.plot([r.reward] * 2, r.difficulties, **look)
    R = ruler.reward_at(0.6 * ruler.beta)
    points = [(r.reward, r.difficulty) for r in readings]
    _dots(axes, points, CASE, "D")
    names = [f"{_cut(r.label)}  {ruler.score(*r[1:3]):.2f}" for r in readings]
    label(axes, [*points, (R, ruler.difficulty_at(R))], [*names, "E = 1"])


def _caption(axes: Axes, found: Sequence[Reading], shown: Sequence[Reading]) -> None:
    """What a point is, and who has none."""
    lines = []
    if shown:
        lines.append("Each point: mean reward and difficulty, intervals, and its E")
    if off := [_cut(reading.label) for reading in found if reading not in shown]:
        more = f" and {len(off) - 2} more" if len(off) > 2 else ""
        lines.append(f"Off this ruler: {', '.join(off[:2])}{more}")
    _title(axes, ".  ".join(lines))


# -- Words that do not get into each other's way ------------------------------------

TURNS = (0, 1, 0.5, 1.5, *(n / 8 for n in (1, 15, 7, 9, 2, 14, 6, 10, 3, 13, 5, 11)))
"""Directions in which a label is tried, in half turns from the right."""

REACH = (7, 20, 36, 54, 76, 100)
"""Points from a dot to its label, nearest first."""

LONGEST = 28  # characters of a label; longer ones lose their middle


def label(
    axes: Axes, points: Sequence[tuple[float, float]], words: Sequence[str]
) -> None:
    """Write words beside points where they hide nothing.

    Each in turn takes the nearest place that hides neither a point nor a line or text
    of the axes, or the place that hides least. The axes must have their limits by now.
    """
    dot = axes.figure.dpi / 72
    lines = [line for line in axes.lines if line.get_linestyle() != "None"]
    taken = _squares(axes.transData.transform(points), 5 * dot)
    texts = [np.array(text.get_window_extent().extents) for text in axes.texts]
    taken = np.vstack([taken, *map(_trail, lines), *texts])
    for point, word in zip(points, words, strict=True):
        text = axes.annotate(word, point, (0, 0), **_LABEL)
        offset, shape = min(
            _places(axes, text), key=lambda place: _hidden(axes, place[1], taken)
        )
        text.set_position(tuple(offset))
        if text.arrow_patch is not None:
            text.arrow_patch.set_visible(len(shape) > 1)
        taken = np.vstack([taken, shape])


_LABEL: dict[str, Any] = {
    "textcoords": "offset points",
    "ha": "center",
    "va": "center",
    "fontsize": 9,
    "color": TEXT,
    "zorder": 6,
    "linespacing": 1.3,
    "parse_math": False,
    "path_effects": [withStroke(linewidth=3, foreground="white")],
    "arrowprops": {"arrowstyle": "-", "lw": 0.8, "color": TEXT, "shrinkB": 6},
}


def _squares(middle: np.ndarray, half: float) -> np.ndarray:
    """(k, 4) left, bottom, right and top of squares around (k, 2) middles."""
    return np.hstack([middle - half, middle + half])


def _trail(line: Line2D) -> np.ndarray:
    """(k, 4) squares, pixels, along a line, four pixels apart."""
    x, y = line.get_transform().transform(np.asarray(line.get_xydata())).T
    way = np.concatenate([[0], np.cumsum(np.hypot(np.diff(x), np.diff(y)))])
    t = np.linspace(0, way[-1], int(way[-1] / 4) + 2)
    return _squares(np.stack([np.interp(t, way, x), np.interp(t, way, y)], 1), 2)


def _places(axes: Axes, text: Annotation) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Where a label may stand: its offset, points, and what it would cover there.

    That is (k, 4) pixels, as of `_squares`: its box, then the line that leads to it if
    it does not stand close by.
    """
    dot = axes.figure.dpi / 72
    box = Text.get_window_extent(text)
    half = np.array([box.width, box.height]) / 2 + dot
    point = axes.transData.transform(text.xy)
    for reach, turn in product(REACH, TURNS):
        way = np.array([cos(pi * turn), sin(pi * turn)])
        off = way * (reach * dot + half)
        there = np.concatenate([point + off - half, point + off + half])
        far = np.hypot(*off)
        first = 7 * dot if reach > REACH[0] else far
        line = point + off / far * np.arange(first, far, 3)[:, None]
        yield off / dot, np.vstack([there, _squares(line, 1.5)])


def _hidden(axes: Axes, shape: np.ndarray, taken: np.ndarray) -> float:
    """Square pixels of what is taken, or beyond the axes, under a label's shape."""
    low = np.maximum(shape[:, None, :2], taken[:, :2])
    high = np.minimum(shape[:, None, 2:], taken[:, 2:])
    covered = (high - low).clip(0).prod(axis=2).sum()
    box, inside = shape[0], axes.bbox.extents
    seen = np.minimum(box[2:], inside[2:]) - np.maximum(box[:2], inside[:2])
    beyond = (box[2:] - box[:2]).prod() - seen.clip(0).prod()
    return float(covered + beyond)


# -- Small things -------------------------------------------------------------------


def _dots(
    axes: Axes, points: Sequence[tuple[float, float]], colour: str, marker: str = "o"
) -> None:
    x, y = np.array(points).reshape(-1, 2).T
    axes.plot(x, y, marker, color=colour, mec="white", ms=8, zorder=5, clip_on=False)


def _title(axes: Axes, words: str) -> None:
    axes.set_title(words, fontsize=11, color=TEXT, loc="left", pad=8, parse_math=False)


def _frame(axes: Axes) -> None:
    """Thin and quiet axes, with numbers as people write them."""
    axes.spines[["top", "right"]].set_visible(False)
    axes.spines[["left", "bottom"]].set_color(FAINT)
    axes.tick_params(labelsize=8, color=FAINT, labelcolor=FAINT, length=3)
    axes.xaxis.set_major_locator(MaxNLocator(9))
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_formatter(FuncFormatter(_number))
        axis.label.set(fontsize=9, color=TEXT)


def _number(value: float, _: object = None) -> str:
    """1234.5 is 1,234.5, and -2 is −2."""
    return f"{value:,.10g}".replace("-", "−")


def _short(value: float) -> str:
    """Three digits where there are not more: 0.0000354, 0.354, 3, 425 and 1,650."""
    if abs(value) >= 100:
        return _number(round(value))
    words = np.format_float_positional(value, 3, fractional=False, trim="-")
    return words.replace("-", "−")


def _cut(words: str) -> str:
    """A long label without its middle."""
    if len(words) <= LONGEST:
        return words
    half = LONGEST // 2
    return f"{words[: half - 1]}…{words[-half:]}"
