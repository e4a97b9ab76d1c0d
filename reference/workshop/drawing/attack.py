"""Worst cases in a picture: what each fire's choice costs, and what choosing costs.

Clauses: F4.  Left, placements that several fires chose at the same moments, re-scored
in futures that none of them has seen; right, the work of looking ahead.

    M  moments;  K  futures of each
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, MaxNLocator

from reference.workshop.drawing.crossplay import names
from reference.workshop.drawing.evacuation import EMBER
from reference.workshop.drawing.page import FAINT, TEXT, blank, heading
from reference.workshop.evaluation.contestants import WORST
from reference.workshop.evaluation.gap import Answer, Cost, harm, harms
from reference.workshop.evaluation.intervals import of_mean

FORESEEN = "#1b5e9e"

_WIDTH, _ROW = 11.0, 0.5  # inches
_ABOVE, _BELOW, _LEAST = 0.95, 1.35, 2.0
_LEFT, _BETWEEN, _RIGHT = 1.75, 1.0, 0.35
_SHARE = 0.56  # of the width of both panels: the left one's


def figure(answers: Sequence[Answer], costs: Sequence[Cost]) -> Figure:
    """What one more fire costs, by who chose its place; and looking ahead's own cost.

    The fires stand in the order of the first question. Raises ValueError where there
    is nothing to draw.
    """
    if not answers or not costs:
        raise ValueError("nothing to draw: re-score a moment, and measure a cost first")
    fires = answers[0].question.fires
    height = max(_LEAST, _ROW * len(fires))
    page = blank(_WIDTH, height + _ABOVE + _BELOW)
    heading(
        page, "The worst case: where a fire does most harm, and what finding it takes"
    )
    free = _WIDTH - _LEFT - _BETWEEN - _RIGHT
    left = _panel(page, _LEFT, free * _SHARE, height)
    right = _panel(page, _LEFT + free * _SHARE + _BETWEEN, free * (1 - _SHARE), height)
    _draw_harms(left, answers, fires)
    _draw_costs(right, costs)
    _legend(page, WORST in fires)
    _caption(page, answers)
    return page


def _panel(page: Figure, left: float, width: float, height: float) -> Axes:
    """Axes at so many inches from the left."""
    wide, high = page.get_size_inches()
    axes = page.add_axes((left / wide, _BELOW / high, width / wide, height / high))
    axes.spines[["top", "right"]].set_visible(False)
    axes.spines[["left", "bottom"]].set_color(FAINT)
    axes.tick_params(labelsize=8, color=FAINT, labelcolor=FAINT, length=3)
    return axes


def _titles(axes: Axes, title: str, across: str) -> None:
    axes.set_title(title, fontsize=10, color=TEXT, loc="left", pad=6)
    axes.set_xlabel(across, fontsize=9, color=TEXT, labelpad=4)


# -- Harm ---------------------------------------------------------------------------


def _draw_harms(axes: Axes, answers: Sequence[Answer], fires: Sequence[str]) -> None:
    """A row for each fire: a dot a moment, and the mean with its interval."""
    for row, fire in enumerate(fires):
        each = harms(answers, fire)
        spread = row + np.linspace(-0.22, 0.22, len(each))[np.argsort(np.argsort(each))]
        axes.plot(each, spread, ls="", marker=".", ms=4, color=FAINT, alpha=0.5)
        mean, low, high = harm(answers, fire)
        axes.plot([low, high], [row, row], color=EMBER, lw=3, solid_capstyle="butt")
        axes.plot(mean, row, marker="o", ms=8, color=EMBER)
        if fire == WORST and (foreseen := _foreseen(answers)):
            axes.plot(
                of_mean(foreseen).mean,
                row,
                marker="D",
                ms=8,
                mfc="none",
                mec=FORESEEN,
                mew=1.6,
                ls="",
            )
    axes.axvline(0, color=FAINT, lw=0.8, ls=(0, (3, 2)), zorder=0.5)
    axes.set_ylim(len(fires) - 0.5, -0.5)
    axes.set_yticks(range(len(fires)), names(fires), fontsize=9, color=TEXT)
    axes.xaxis.set_major_locator(MaxNLocator(6))
    axes.xaxis.set_major_formatter(FuncFormatter(_number))
    axes.grid(axis="x", color=FAINT, alpha=0.2, linewidth=0.6)
    _titles(
        axes,
        "harm of one more fire, by who chose its place",
        "reward lost, health points",
    )


def _foreseen(answers: Sequence[Answer]) -> list[float]:
    """The harm that looking ahead expected of its own choice, at each moment."""
    return [
        float(np.mean(a.unlit)) - a.foreseen for a in answers if a.foreseen is not None
    ]


# -- Cost ---------------------------------------------------------------------------


def _draw_costs(axes: Axes, costs: Sequence[Cost]) -> None:
    """A dot for each evacuation, and the line through the origin that fits best."""
    x = np.array([cost.decisions for cost in costs], dtype=float)
    y = np.array([cost.simulated_seconds for cost in costs])
    axes.plot(x, y, ls="", marker="o", ms=5, color=FORESEEN, alpha=0.55, mec="none")
    slope = float(x @ y / max(1.0, x @ x))
    end = max(1.0, x.max())
    axes.plot([0, end], [0, slope * end], color=TEXT, lw=1.4)
    axes.set_xlim(0, end + 0.5)
    axes.set_ylim(0, max(1.0, y.max(), slope * end) * 1.12)
    axes.xaxis.set_major_locator(MaxNLocator(8, integer=True))
    axes.yaxis.set_major_locator(MaxNLocator(5))
    axes.yaxis.set_major_formatter(FuncFormatter(_number))
    axes.grid(axis="y", color=FAINT, alpha=0.2, linewidth=0.6)
    axes.set_ylabel("simulated seconds", fontsize=9, color=TEXT, labelpad=4)
    _titles(
        axes,
        f"looking ahead: {slope:,.0f} s for each decision",
        "decisions of the fire",
    )


def _number(value: float, _: object) -> str:
    return f"{value:,.10g}".replace("-", "−")


# -- Below --------------------------------------------------------------------------


def _legend(page: Figure, foreseen: bool) -> None:
    hollow = {"mfc": "none", "mec": FORESEEN, "mew": 1.6, "ms": 8}
    pale = {"color": FORESEEN, "ms": 5, "alpha": 0.55, "mec": "none"}
    marks: dict[str, dict[str, Any]] = {
        "mean and 95 % interval": {"color": EMBER, "marker": "o", "ms": 8, "lw": 3},
        "one moment": {"color": FAINT, "marker": ".", "ls": "", "ms": 6},
        f"what {WORST} foresaw itself": {"marker": "D", "ls": "", **hollow},
        "one evacuation": {"marker": "o", "ls": "", **pale},
    }
    if not foreseen:
        del marks[f"what {WORST} foresaw itself"]
    handles = [Line2D([], [], label=label, **mark) for label, mark in marks.items()]
    page.legend(
        handles=handles,
        loc="center",
        bbox_to_anchor=(0.5, 0.52 / page.get_size_inches()[1]),
        ncols=len(handles),
        fontsize=9,
        frameon=False,
        labelcolor=TEXT,
        columnspacing=1.8,
    )


def _caption(page: Figure, answers: Sequence[Answer]) -> None:
    """What stands behind the dots."""
    question = answers[0].question
    page.text(
        0.5,
        0.1 / page.get_size_inches()[1],
        f"robots: {' '.join(names([question.robots])[0].splitlines())}; "
        f"{len(answers)} moments after 0 or more random fires, each re-scored in "
        f"{question.futures} fresh futures with the same rule for the fires after it",
        fontsize=8,
        color=FAINT,
        ha="center",
        va="bottom",
        parse_math=False,
    )
