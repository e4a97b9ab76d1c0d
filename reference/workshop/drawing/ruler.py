"""Charts of the score: what a reward is worth, and E over reward and difficulty.

`curve` explains the ruler [F1] [F2] [F3], `contours` shows where on it evaluated
strategies stand.

    R   reward, health points;  h   difficulty;  E   score;  y   what R is worth
"""

from collections.abc import Mapping, Sequence
from functools import partial
from textwrap import fill
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from reference import paper
from reference.evaluation.score import Ruler, paper_ruler
from reference.workshop.comparing.results import Cell
from reference.workshop.drawing.colours import colour_of
from reference.workshop.drawing.crossplay import players
from reference.workshop.drawing.evacuation import EMBER
from reference.workshop.drawing.page import BLUE, TEXT, Style, legend, sheet, shortened

BEST_REWARD = 15_000.0  # R_b as the paper rounds it [F6]
MARKERS = "oDs^vPX<>*hp"
LEVELS = (0, 0.1, 0.25, 0.5, 0.75, 1, 1.25, 1.5, 1.75, 2)


def difficulty_at(ruler: Ruler, reward: float) -> float:
    """Invert Eq. 8: the h with which this reward scores 1, at least 0 [F10]."""
    y = ruler.reward_part(reward)
    k = ruler.k
    α = ruler.alpha
    β = ruler.beta
    return (max(β - y, 0.0) * k) ** 0.5 * α


def curve(ruler: Ruler | None = None, best_reward: float = BEST_REWARD) -> Figure:
    """Draw y over R, with both critical points and the slopes there.

    ruler: default: the paper's;  best_reward: R_b. Raises RulerError where something
    lies off the ruler.
    """
    if ruler is None:
        ruler = paper_ruler()
    figure = sheet("What a reward is worth", 11, 6)
    axes = figure.subplots()
    β = ruler.beta
    points = {
        "Critical Point 1, at R_w": ruler.reward_at(paper.WORST_POINT[1]),
        "Critical Point 2": ruler.reward_at(paper.BEST_POINT[1]),
        "R_b": best_reward,
        "y = β, so that E = 1 without fire": ruler.reward_at(β),
        "y = 1/c": 0.0,
    }
    least = min(points.values())
    most = max(points.values())
    room = 0.05 * (most - least)
    R = np.linspace(least - room, most + room, 600)
    axes.plot(R, ruler.reward_part(R), color=BLUE, lw=2.4)
    _mark_points(axes, ruler, points, room)

    axes.set_title(
        f"α = {ruler.alpha:g}, b = {ruler.base:.5g}, c = {ruler.control:.4g}"
    )
    axes.set(xlabel="reward R, health points", ylabel="y = b^(R/α) / c")
    axes.legend(loc="upper left", title="dashed: the slopes dy/dR", alignment="left")
    to_score = partial(np.multiply, 1 / β)
    from_score = partial(np.multiply, β)
    score = axes.secondary_yaxis("right", functions=(to_score, from_score))
    score.set_ylabel("E = y / β, without fire")
    score.spines["right"].set_visible(True)
    return figure


def _mark_points(
    axes: Axes, ruler: Ruler, points: Mapping[str, float], room: float
) -> None:
    """Mark rewards on the curve by name, each with its slope, so far to both sides."""
    for (name, at), marker in zip(points.items(), MARKERS, strict=False):
        y = ruler.reward_part(at)
        slope = ruler.slope(at)
        words = f"{name}: R = {at:,.0f}, y = {y:,.4g}, slope {slope:.3g}"
        axes.plot(at, y, marker, color=BLUE, mec="white", ms=8, zorder=5, label=words)
        x = np.array((at - room, at + room))
        axes.plot(x, y + slope * (x - at), color=EMBER, lw=1.7, ls="--", zorder=4)


def contours(
    ruler: Ruler,
    cells: Sequence[Cell],
    baseline: str = "the baseline",
    caption: str = "",
) -> Figure:
    """Draw E over R and h, the line E = 1, and each match as a point [F9] [F10].

    Colours tell robots, as in every picture, with a dark edge where others before have
    the same; shapes tell fires.
    Matches that lie off the ruler are left out.

    caption: where, and what means and intervals are over
    """
    shown = [cell for cell in cells if cell.score]
    figure = sheet("The score E by reward and difficulty", 11, 7.5)
    axes = figure.subplots()
    wide, high = _steps(ruler, shown)
    E = ruler.score(*np.meshgrid(wide, high))
    shades = axes.contourf(wide, high, E, LEVELS, cmap="BrBG", alpha=0.6, extend="max")
    axes.contour(wide, high, E, [1], colors=TEXT, linewidths=2.4)

    robots = players(cells, "robots")
    fires = players(cells, "fire")
    colours = [colour_of(name) for name in robots]
    for cell in shown:
        x, *across = cell.reward
        y, *up = cell.difficulty
        axes.plot(across, (y, y), (x, x), up, color=TEXT, lw=1)
        marker = MARKERS[fires.index(cell.fire) % len(MARKERS)]
        name = fill(f"{cell.robots}, fire {cell.fire}", 30)
        team = robots.index(cell.robots)
        edge = TEXT if colours[team] in colours[:team] else "white"
        look: Style = {"color": colours[team], "mec": edge}
        look |= {"ls": "", "marker": marker, "ms": 8, "clip_on": False}
        axes.plot(x, y, label=f"{name}  {ruler.score(x, y):.2f}", **look)

    axes.set_title(
        f"Bold line: E = 1, as good as {shortened(baseline, 40)}.  "
        "Points: means with 95 % intervals, and their E"
    )
    axes.set(xlabel="reward R, health points", ylabel="difficulty h")
    figure.colorbar(shades, pad=0.02, label="score E")
    handles, _ = axes.get_legend_handles_labels()
    words = fill(caption, 140)
    legend(figure, handles, ncols=4, fontsize=8, title=words, title_fontsize=8)
    return figure


def _steps(ruler: Ruler, shown: Sequence[Cell]) -> tuple[np.ndarray, np.ndarray]:
    """Choose steps of R and of h that show all matches, and little more.

    Without any match they show the upper ruler.
    """
    rewards = [R for cell in shown for R in cell.reward]
    hard = [h for cell in shown for h in cell.difficulty]
    worst = ruler.reward_at(paper.WORST_POINT[1])
    one = ruler.reward_at(ruler.beta)  # where E = 1 without fire
    if not rewards:
        rewards = [min(0.0, one + (worst - one) / 4), one]
    wide = _fitting(rewards, (one - worst) / 80)
    hardest = difficulty_at(ruler, wide[0])
    return wide, _fitting(hard or [0.0, hardest], hardest / 40, lowest=0.0)


def _fitting(values: Sequence[float], room: float, lowest: float = -np.inf) -> Any:
    """Make 200 steps from the least to the greatest value, and a little further.

    room: the least to leave on each side;  lowest: where the axis may begin
    """
    left = min(values)
    right = max(values)
    room = max(room, 0.05 * (right - left))
    return np.linspace(max(left - room, lowest), right + room, 200)
