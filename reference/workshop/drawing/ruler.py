"""Charts of the score: what a reward is worth, and E over reward and difficulty.

Clauses: F1, F2, F3, F6, F9, F10.  `curve` explains the ruler, `contours` shows where on
it evaluated strategies stand.

    R   reward, health points;  h   difficulty;  E   score
    y   what R is worth;        e′  y and what h adds to it
"""

from collections.abc import Sequence
from functools import partial
from itertools import cycle, product

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.colors import TwoSlopeNorm
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from reference.building import Kind
from reference.evaluation.score import LARGEST, PAPER, Ruler, RulerError
from reference.paper import BEST_POINT, WORST_POINT
from reference.workshop.crossplay.results import Cell
from reference.workshop.drawing import page
from reference.workshop.drawing.crossplay import labels
from reference.workshop.drawing.evacuation import EMBER
from reference.workshop.drawing.page import COLOURS, Style

BEST_REWARD = 15_000.0
"""[F6] R_b as the paper rounds it."""

PRINTED = {WORST_POINT[0]: "0.00004", BEST_POINT[0]: "0.4", BEST_REWARD: "0.5"}
"""[F3] the slopes as the text prints them, by the reward they belong to."""

CURVE, SLOPE = "#1b5e9e", EMBER
SHAPES, INKS = "Dos^vPX", (COLOURS[Kind.ENTRANCE], CURVE, EMBER, "#16191d", "#e69f00")
"""Markers of points, one for each fire, and colours, one for each team of robots."""

_three = partial(page.number, digits=3)


# -- What a reward is worth ---------------------------------------------------------


def curve(ruler: Ruler = PAPER, best_reward: float = BEST_REWARD) -> Figure:
    """Draw y over R, with both critical points and the slopes there.

    best_reward is R_b. On the paper's ruler, labels also give the slopes that the text
    prints [F3]. Raises RulerError where something lies off the ruler.
    """
    whose = "the paper's ruler" if ruler == PAPER else "a calibrated ruler"
    figure = page.sheet(f"What a reward is worth: {whose}", 11, 6)
    axes, β = figure.subplots(), ruler.beta
    marks = [*(ruler.reward_at(y) for _, y in (WORST_POINT, BEST_POINT)), best_reward]
    marks += [ruler.reward_at(β), 0.0]
    room = 0.05 * np.ptp(marks)
    R = np.linspace(min(marks) - room, max(marks) + room, 600)
    axes.plot(R, ruler.reward_part(R), color=CURVE, lw=2.4, zorder=3)
    axes.plot([marks[3], R[-1]], [β, β], color=page.FAINT, lw=1.2, ls=":")
    for (name, marker), R0 in zip(_MARKS.items(), marks, strict=True):
        words = f"{name}: {_at(ruler, R0)}"
        axes.plot(R0, ruler.reward_part(R0), marker, color=CURVE, label=words, **_DOT)
    for R0 in marks[:3]:
        x = R0 + np.array([-room, room])
        y = ruler.reward_part(R0) + ruler.slope(R0) * (x - R0)
        axes.plot(x, y, color=SLOPE, lw=1.7, ls=(0, (4, 1.5)), zorder=4)
    top = 1.35 * ruler.reward_part(np.array(marks)).max()
    axes.set(xlim=R[[0, -1]], ylim=(-0.05 * top, top))
    axes.set(xlabel="reward R, health points", ylabel="y = b^(R/α) / c")
    axes.set_title(_caption_of(ruler))
    axes.legend(loc="upper left", title="dashed: the slopes dy/dR", alignment="left")
    times = (partial(np.multiply, 1 / β), partial(np.multiply, β))
    score = axes.secondary_yaxis("right", functions=times)
    score.set_ylabel("E = e′ / β")
    score.spines["right"].set_visible(True)
    axes.xaxis.set_major_locator(MaxNLocator(9))
    page.write_numbers(axes.xaxis, axes.yaxis, score.yaxis)
    return figure


_MARKS = {
    "Critical Point 1, at R_w": "o",
    "Critical Point 2": "D",
    "R_b": "s",
    "y = β, so that E = 1 without fire": "^",
    "y = 1/c": "v",
}
"""What is marked on the curve, and by which marker."""

_DOT: Style = {"ls": "", "mec": "white", "ms": 8, "zorder": 5, "clip_on": False}


def _at(ruler: Ruler, R: float) -> str:
    """Coordinates of a point on the curve, and the slope there."""
    slope = _three(ruler.slope(R))
    if ruler == PAPER and round(R) in PRINTED:
        slope = f"{slope} (paper: {PRINTED[round(R)]})"
    return f"R = {_three(R)}, y = {_three(ruler.reward_part(R))}, slope {slope}"


def _caption_of(ruler: Ruler) -> str:
    """Say what b and c are: how steep the curve is, and how high."""
    tenfold = ruler.reward_at(10) - ruler.reward_at(1)
    return (
        f"α = {_three(ruler.alpha)}, b = {ruler.base:.5g} (tenfold every "
        f"{_three(tenfold)} health points), c = 1/{1 / ruler.control:.4g}"
    )


# -- E over reward and difficulty ---------------------------------------------------


Limits = tuple[float, float]  # of an axis

LEVELS = (0, 0.1, 0.25, 0.5, 0.75, 1, 1.25, 1.5, 1.75, 2)
"""Levels of E between two shades; above the last there is one shade more."""

PALE = TwoSlopeNorm(1, vmin=-0.8, vmax=3.2)
SHADES = colormaps["BrBG"].with_extremes(over=colormaps["BrBG"](PALE(2.3)))
"""Colours: brown below E = 1, green above, without the map's darkest shades."""


def contours(ruler: Ruler = PAPER, cells: Sequence[Cell] = ()) -> Figure:
    """Draw E over R and h, the line E = 1, and each match as a point [F9] [F10].

    Matches that lie off the ruler are not drawn but named.
    """
    shown = [cell for cell in cells if _lies_on(ruler, cell)]
    figure = page.sheet("The score E by reward and difficulty", 10, 7.5)
    axes = figure.subplots()
    _draw_score(figure, axes, ruler, *_region(ruler, shown))
    robots, fires = labels(cells, "robots", " "), labels(cells, "fire", " ")
    inks = dict(zip(robots, cycle(INKS), strict=False))
    shapes = dict(zip(fires, cycle(SHAPES), strict=False))
    lines = ["Bold line: E = 1"]
    if shown:
        lines[0] += ".  Points: means with 95 % intervals.  Below: E of each pair"
    for cell in cells:
        label = f"{robots[cell.robots]}, fire {fires[cell.fire]}"
        if cell in shown:
            look = {"marker": shapes[cell.fire], "mfc": inks[cell.robots]}
            _draw_point(axes, ruler, cell, label, look)
        else:
            lines.append(f"Off this ruler: {label}")
    axes.set_title("\n".join(lines[:4] + ["…"] * (len(lines) > 4)))
    if shown:
        tight: Style = {"handletextpad": 0.3, "columnspacing": 1.0, "fontsize": 8}
        page.foot(figure, columns=len(inks), **tight)
    return figure


def _draw_score(
    figure: Figure, axes: Axes, ruler: Ruler, wide: Limits, high: Limits
) -> None:
    """Shade E over a region of R and h, with a bar, and draw the line E = 1."""
    R, h = np.meshgrid(np.linspace(*wide, 200), np.linspace(*high, 200))
    E = ruler.score(R, h)
    axes.contour(R, h, E, LEVELS, colors="white", linewidths=0.8)
    shades = axes.contourf(R, h, E, LEVELS, cmap=SHADES, norm=PALE, extend="max")
    hard = np.linspace(0, ruler.difficulty_at(wide[0]), 200)
    even = [ruler.reward_at(y) for y in ruler.beta - ruler.difficulty_part(hard)]
    axes.plot(even, hard, color=page.TEXT, lw=2.4, zorder=2)
    axes.set(xlabel="reward R, health points", ylabel="difficulty h")
    axes.xaxis.set_major_locator(MaxNLocator(9))
    bar = figure.colorbar(shades, pad=0.02, ticks=LEVELS)
    bar.set_label("score E; 1: as good as the baseline", labelpad=6)
    bar.outline.set_visible(False)
    page.write_numbers(axes.xaxis, axes.yaxis, bar.ax.yaxis)


def _lies_on(ruler: Ruler, cell: Cell) -> bool:
    """Whether a match's means and their intervals lie on the ruler."""
    try:
        ends = product(cell.reward, cell.difficulty)
        return all(ruler.score(R, h) >= 0 for R, h in ends)
    except RulerError:
        return False


def _region(ruler: Ruler, cells: Sequence[Cell]) -> tuple[Limits, Limits]:
    """Limits of both axes, so that the line E = 1 and all points are in view."""
    rewards = [R for cell in cells for R in cell.reward]
    hard = [h for cell in cells for h in cell.difficulty]
    worst, one = ruler.reward_at(WORST_POINT[1]), ruler.reward_at(ruler.beta)
    left = min([0.0, one + (worst - one) / 4, *rewards]) if rewards else worst
    right = max([one, *rewards])
    room = 0.05 * (right - left)
    wide = left - room, min(right + room, ruler.reward_at(LARGEST) - 1)
    return wide, (0.0, 1.1 * max([ruler.difficulty_at(wide[0]), *hard]))


def _draw_point(axes: Axes, ruler: Ruler, cell: Cell, label: str, look: Style) -> None:
    """Draw a match with its intervals; its label tells E."""
    (R, *across), (h, *up) = cell.reward, cell.difficulty
    wide, high = (np.abs([np.subtract(x, m)]).T for x, m in ((across, R), (up, h)))
    look |= {"ecolor": page.TEXT, "elinewidth": 1, **_DOT}
    dot, *_ = axes.errorbar(R, h, high, wide, **look)
    dot.set_label(f"{label}  {ruler.score(R, h):.2f}")
