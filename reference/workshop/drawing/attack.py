"""Chart of worst cases: what the places cost that several fires chose.

Clauses: F4.  They chose at the same moments, and were re-scored in futures that none of
them has seen.
"""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from reference.workshop.drawing.crossplay import names
from reference.workshop.drawing.evacuation import EMBER
from reference.workshop.drawing.page import FAINT, TEXT, foot, sheet, write_numbers
from reference.workshop.evaluation.contestants import WORST
from reference.workshop.evaluation.gap import Result, gap, gaps
from reference.workshop.evaluation.intervals import of_mean

FORESEEN = "#1b5e9e"


def figure(results: Sequence[Result]) -> Figure:
    """Draw one more fire's harm, by who chose its place.

    The fires stand in the order of the first comparison. Raises IndexError for no
    results.
    """
    fires = results[0].comparison.fires
    title = "The worst case: harm of one more fire, by who chose its place"
    page = sheet(title, 9, max(2.0, 0.5 * len(fires)) + 2)
    _draw_harms(page.subplots(), results, fires)
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
    axes.set_xlabel("reward lost to one more fire, health points")


def _foreseen(results: Sequence[Result]) -> list[float]:
    """Harm that looking ahead expected of its own choice, at each moment."""
    both = ((np.mean(result.rewards["none"]), result.foreseen) for result in results)
    return [float(unlit) - foreseen for unlit, foreseen in both if foreseen is not None]


def _caption(results: Sequence[Result]) -> str:
    """Say how many moments and futures stand behind the dots."""
    comparison = results[0].comparison
    return (
        f"robots: {' '.join(names([comparison.evacuation.robots])[0].splitlines())}; "
        f"{len(results)} moments after 0 or more random fires, each re-scored in "
        f"{comparison.futures} fresh futures with the same rule for the fires after it"
    )
