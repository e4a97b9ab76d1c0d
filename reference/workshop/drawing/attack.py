"""Chart of worst cases: what each fire's choice costs, and what choosing costs.

Clauses: F4.  Left, placements that several fires chose at the same moments, re-scored
in futures that none of them has seen; right, the work of looking ahead.
"""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from reference.paper import InputError
from reference.workshop.drawing.crossplay import names
from reference.workshop.drawing.evacuation import EMBER
from reference.workshop.drawing.page import FAINT, TEXT, foot, sheet, write_numbers
from reference.workshop.evaluation.contestants import WORST
from reference.workshop.evaluation.gap import Cost, Result, gap, gaps
from reference.workshop.evaluation.intervals import of_mean

FORESEEN = "#1b5e9e"


def figure(results: Sequence[Result], costs: Sequence[Cost]) -> Figure:
    """Draw one more fire's harm, by who chose its place, and the look-ahead's cost.

    The fires stand in the order of the first comparison. Raises ValueError where there
    is nothing to draw.
    """
    if not results or not costs:
        raise InputError("nothing to draw: re-score a moment, and measure a cost first")
    comparison = results[0].comparison
    title = "The worst case: where a fire does most harm, and what finding it takes"
    page = sheet(title, 11, max(2.0, 0.5 * len(comparison.fires)) + 2)
    left, right = page.subplots(1, 2, width_ratios=(0.56, 0.44))
    _draw_harms(left, results, comparison.fires)
    _draw_costs(right, costs)
    foot(page, caption=_caption(results))
    return page


def _draw_harms(axes: Axes, results: Sequence[Result], fires: Sequence[str]) -> None:
    """Draw a row for each fire: a dot per moment, and the mean with its interval."""
    for row, fire in enumerate(fires):
        each = gaps(results, "none", fire)
        spread = row + np.linspace(-0.22, 0.22, len(each))[np.argsort(np.argsort(each))]
        mean, low, high = gap(results, "none", fire)
        bar = axes.plot([low, mean, high], [row] * 3, "-o", color=EMBER, lw=3, ms=8)
        bar[0].set(markevery=[1], zorder=3, label="mean and 95 % interval")
        axes.plot(each, spread, ".", ms=4, c=FAINT, alpha=0.5, label="one moment")
        if fire == WORST and (foreseen := _foreseen(results)):
            mark = axes.plot(of_mean(foreseen).mean, row, "D", color=FORESEEN, ms=8)
            mark[0].set(mfc="none", mew=1.6, label=f"what {WORST} foresaw itself")
    axes.axvline(0, color=FAINT, lw=0.8, ls=(0, (3, 2)), zorder=0.5)
    axes.set_ylim(len(fires) - 0.5, -0.5)
    axes.set_yticks(range(len(fires)), names(fires), fontsize=9, color=TEXT)
    axes.xaxis.set_major_locator(MaxNLocator(6))
    write_numbers(axes.xaxis)
    axes.grid(axis="x")
    axes.set_title("harm of one more fire, by who chose its place")
    axes.set_xlabel("reward lost, health points")


def _foreseen(results: Sequence[Result]) -> list[float]:
    """Harm that looking ahead expected of its own choice, at each moment."""
    both = ((np.mean(result.rewards["none"]), result.foreseen) for result in results)
    return [float(unlit) - foreseen for unlit, foreseen in both if foreseen is not None]


def _draw_costs(axes: Axes, costs: Sequence[Cost]) -> None:
    """Draw a dot per evacuation, and the best line through the origin."""
    x = np.array([cost.decisions for cost in costs], dtype=float)
    y = np.array([cost.simulated_seconds for cost in costs])
    slope = float(x @ y / max(1.0, x @ x))
    end = max(1.0, x.max())
    axes.plot(x, y, "o", ms=5, color=FORESEEN, alpha=0.55, label="one evacuation")
    axes.plot([0, end], [0, slope * end], color=TEXT, lw=1.4)
    axes.set(xlim=0, ylim=0)
    axes.xaxis.set_major_locator(MaxNLocator(8, integer=True))
    axes.yaxis.set_major_locator(MaxNLocator(5))
    write_numbers(axes.yaxis)
    axes.grid(axis="y")
    axes.set_title(f"looking ahead: {slope:,.0f} s for each decision")
    axes.set(xlabel="decisions of the fire", ylabel="simulated seconds")


def _caption(results: Sequence[Result]) -> str:
    """Say how many moments and futures stand behind the dots."""
    comparison = results[0].comparison
    return (
        f"robots: {' '.join(names([comparison.evacuation.robots])[0].splitlines())}; "
        f"{len(results)} moments after 0 or more random fires, each re-scored in "
        f"{comparison.futures} fresh futures with the same rule for the fires after it"
    )
