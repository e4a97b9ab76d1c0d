"""Charts of the score: what a reward is worth, and E over reward and difficulty.

Clauses: F1, F2, F3, F6, F9, F10.  `curve` explains the ruler, `contours` shows where on
it the evaluated stand.

    R   reward, health points;  h   difficulty;  E   score
    y   what R is worth;        e′  y and what h adds to it
"""

from collections.abc import Iterable, Sequence
from functools import partial
from itertools import product
from typing import NamedTuple

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.colors import TwoSlopeNorm
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from reference.building import Kind
from reference.evaluation.score import LARGEST, PAPER, Ruler, RulerError
from reference.paper import BEST_POINT, WORST_POINT
from reference.workshop.drawing import page
from reference.workshop.drawing.evacuation import EMBER
from reference.workshop.drawing.page import COLOURS, Style
from reference.workshop.evaluation.intervals import Interval

BEST_REWARD = 15_000.0
"""[F6] R_b as the paper rounds it."""

PRINTED = {WORST_POINT[0]: "0.00004", BEST_POINT[0]: "0.4", BEST_REWARD: "0.5"}
"""[F3] the slopes as the text prints them, by the reward they belong to."""

CURVE, SLOPE, POINT = "#1b5e9e", EMBER, COLOURS[Kind.ENTRANCE]

_three = partial(page.number, digits=3)


# -- What a reward is worth ---------------------------------------------------------


def curve(ruler: Ruler = PAPER, best_reward: float = BEST_REWARD) -> Figure:
    """Draw y over R on a linear and on a logarithmic scale, with both critical points.

    best_reward is R_b. On the paper's ruler the slopes carry what the text prints of
    them [F3]. Raises RulerError where something lies off the ruler.
    """
    whose = "the paper's ruler" if ruler == PAPER else "a calibrated ruler"
    figure = page.sheet(f"What a reward is worth: {whose}", 11, 9)
    R1, R2 = (ruler.reward_at(y) for _, y in (WORST_POINT, BEST_POINT))
    marks = np.array([R1, R2, best_reward, ruler.reward_at(ruler.beta)])
    room = 0.05 * np.ptp(marks)
    R = np.linspace(marks.min() - room, marks.max() + room, 600)
    linear, logarithmic = figure.subplots(2)
    for axes in (linear, logarithmic):
        axes.plot(R, ruler.reward_part(R), color=CURVE, lw=2.4, zorder=3)
        axes.plot([marks[3], R[-1]], [ruler.beta] * 2, color=page.FAINT, lw=1.2, ls=":")
        axes.set(xlim=R[[0, -1]], xlabel="reward R, health points")
        axes.set_ylabel("y = b^(R/α) / c")
    _draw_linear(linear, ruler, marks)
    _draw_logarithmic(logarithmic, ruler)
    for axes in (linear, logarithmic):
        _add_score_axis(axes, ruler)
    words = [f"{name}: {_at(ruler, R)}" for name, R in zip(_MARKS, marks, strict=True)]
    _label(linear, ruler, marks, words)
    three = np.array([R1, 0.0, R2])
    y = [page.number(y, digits=4) for y in ruler.reward_part(three)]
    names = ("Critical Point 1: y", "y(0) = 1/c", "Critical Point 2: y")
    _label(logarithmic, ruler, three, map(" = ".join, zip(names, y, strict=True)))
    return figure


def _draw_linear(axes: Axes, ruler: Ruler, marks: np.ndarray) -> None:
    """Draw the slopes; say what the same step up adds at three rewards."""
    axes.set_title(
        "Linear scale: flat while all is lost, steep where nearly all is won"
    )
    top = 1.35 * ruler.reward_part(marks).max()
    axes.set_ylim(-0.05 * top, top)
    half = 0.054 * np.diff(axes.get_xlim())
    lines = [f"What {_three(ruler.alpha)} health points more add to y:"]
    for R in marks[:3]:
        x = R + np.array([-half, half])
        y = ruler.reward_part(R) + ruler.slope(R) * (x - R)
        axes.plot(x, y, color=SLOPE, lw=1.7, ls=(0, (4, 1.5)), zorder=4)
    for R in (marks[0], 0.0, marks[1]):
        more = ruler.reward_part(R + ruler.alpha) - ruler.reward_part(R)
        lines.append(f"    from R = {_three(R)}:  {_three(more)}")
    words = "\n".join([*lines, "", "Dashed: the slopes dy/dR"])
    axes.text(0.02, 0.95, words, transform=axes.transAxes, va="top", **_NOTE)


def _draw_logarithmic(axes: Axes, ruler: Ruler) -> None:
    """Say what makes the straight line: b is its slope, c its height."""
    axes.set_title("Logarithmic scale: a straight line, which two points fix")
    low, high = (ruler.reward_part(R) for R in axes.get_xlim())
    axes.set(yscale="log", ylim=(low, 6 * high))
    tenfold = ruler.reward_at(10) - ruler.reward_at(1)
    words = (
        f"y = b^(R/α) / c,  α = {_three(ruler.alpha)}\n"
        f"steepness: b = {ruler.base:.5g}, tenfold every {_three(tenfold)}\n"
        f"height: c = 1/{1 / ruler.control:.4g}"
    )
    axes.text(0.65, 0.06, words, transform=axes.transAxes, va="bottom", **_NOTE)


_MARKS = (
    "Critical Point 1, at R_w",
    "Critical Point 2",
    "R_b",
    "y = β, so that E = 1 without fire",
)
_NOTE: Style = {"fontsize": 9, "linespacing": 1.5}
_DOT: Style = {"mec": "white", "ms": 8, "zorder": 5, "clip_on": False}


def _add_score_axis(axes: Axes, ruler: Ruler) -> None:
    """Add an axis on the right that reads E = e′ / β."""
    β = ruler.beta
    times = (partial(np.multiply, 1 / β), partial(np.multiply, β))
    score = axes.secondary_yaxis("right", functions=times)
    score.set_ylabel("E = e′ / β")
    score.spines["right"].set_visible(True)
    axes.xaxis.set_major_locator(MaxNLocator(9))
    page.write_numbers(axes.xaxis, axes.yaxis, score.yaxis)


def _at(ruler: Ruler, R: float) -> str:
    """Coordinates of a point on the curve, and the slope there."""
    slope = _three(ruler.slope(R))
    if ruler == PAPER and round(R) in PRINTED:
        slope = f"{slope} (paper: {PRINTED[round(R)]})"
    return f"R = {_three(R)}, y = {_three(ruler.reward_part(R))}, slope {slope}"


def _label(axes: Axes, ruler: Ruler, R: np.ndarray, words: Iterable[str]) -> None:
    """Draw dots on the curve, and words beside them."""
    y = ruler.reward_part(R)
    axes.plot(R, y, "o", color=CURVE, **_DOT)
    page.write_labels(axes, list(zip(R, y, strict=True)), list(words))


# -- E over reward and difficulty ---------------------------------------------------


class Reading(NamedTuple):
    """Mean reward and difficulty of a match, each with its interval."""

    label: str
    reward: Interval
    difficulty: Interval


LEVELS = (0, 0.1, 0.25, 0.5, 0.75, 1, 1.25, 1.5, 1.75, 2)
"""Levels of E between two shades; above the last there is one shade more."""

PALE = TwoSlopeNorm(1, vmin=-0.8, vmax=3.2)
SHADES = colormaps["BrBG"].with_extremes(over=colormaps["BrBG"](PALE(2.3)))
"""Colours: brown below E = 1, green above, without the map's darkest shades."""


def contours(ruler: Ruler = PAPER, readings: Iterable[Reading] = ()) -> Figure:
    """Draw E over R and h, the line E = 1, and each reading as a point [F9] [F10].

    Readings that lie off the ruler are not drawn but named.
    """
    found = list(readings)
    shown = [reading for reading in found if _lies_on(ruler, reading)]
    figure = page.sheet("The score E of reward and difficulty", 10, 7)
    axes = figure.subplots()
    wide, high = _region(ruler, shown)
    R, h = np.meshgrid(np.linspace(*wide, 200), np.linspace(*high, 200))
    E = ruler.score(R, h)
    axes.contour(R, h, E, LEVELS, colors="white", linewidths=0.8)
    shades = axes.contourf(R, h, E, LEVELS, cmap=SHADES, norm=PALE, extend="max")
    hard = np.linspace(0, ruler.difficulty_at(wide[0]), 200)
    even = [ruler.reward_at(y) for y in ruler.beta - ruler.difficulty_part(hard)]
    axes.plot(even, hard, color=page.TEXT, lw=2.4, zorder=2)
    axes.set(xlabel="reward R, health points", ylabel="difficulty h")
    axes.set_title(_caption(found, shown))
    axes.xaxis.set_major_locator(MaxNLocator(9))
    bar = figure.colorbar(shades, pad=0.02, label="E, 1 for the baseline")
    bar.outline.set_visible(False)
    bar.set_ticks(LEVELS)
    page.write_numbers(axes.xaxis, axes.yaxis, bar.ax.yaxis)
    _draw_readings(axes, ruler, shown)
    return figure


def _lies_on(ruler: Ruler, r: Reading) -> bool:
    """Whether a reading and its intervals lie on the ruler."""
    try:
        return all(ruler.score(R, h) >= 0 for R, h in product(*r[1:]))
    except RulerError:
        return False


def _region(
    ruler: Ruler, readings: Sequence[Reading]
) -> tuple[tuple[float, float], tuple[float, float]]:
    """Limits of both axes, so that the line E = 1 and all readings are in view."""
    rewards = [R for reading in readings for R in reading.reward]
    hard = [h for reading in readings for h in reading.difficulty]
    worst, one = ruler.reward_at(WORST_POINT[1]), ruler.reward_at(ruler.beta)
    left = min([0.0, one + (worst - one) / 4, *rewards]) if rewards else worst
    right = max([one, *rewards])
    room = 0.05 * (right - left)
    wide = left - room, min(right + room, ruler.reward_at(LARGEST) - 1)
    return wide, (0.0, 1.1 * max([ruler.difficulty_at(wide[0]), *hard]))


def _caption(found: Sequence[Reading], shown: Sequence[Reading]) -> str:
    """Say what a point is, and which readings have none."""
    lines = []
    if shown:
        lines.append("Each point: mean reward and difficulty, intervals, and its E")
    if off := [reading.label for reading in found if reading not in shown]:
        more = f" and {len(off) - 2} more" if len(off) > 2 else ""
        lines.append(f"Off this ruler: {', '.join(off[:2])}{more}")
    return ".  ".join(lines)


def _draw_readings(axes: Axes, ruler: Ruler, readings: Sequence[Reading]) -> None:
    """Draw dots with their intervals; name them, and the line E = 1."""
    look: Style = {"color": page.TEXT, "lw": 1, "zorder": 3}
    points = [(r.reward.mean, r.difficulty.mean) for r in readings]
    for (R, h), r in zip(points, readings, strict=True):
        axes.plot(r.reward[1:], [h, h], **look)
        axes.plot([R, R], r.difficulty[1:], **look)
        axes.plot(R, h, "D", color=POINT, **_DOT)
    words = [
        f"{r.label}  {ruler.score(*p):.2f}"
        for r, p in zip(readings, points, strict=True)
    ]
    R = ruler.reward_at(0.6 * ruler.beta)
    page.write_labels(axes, [*points, (R, ruler.difficulty_at(R))], [*words, "E = 1"])
