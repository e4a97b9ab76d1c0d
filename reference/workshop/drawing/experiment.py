"""Learning curves of an experiment: a panel for each arm, a line for each training.

Clause: E6.

    x  decisions of the side that learns;  y  survivors, %
"""

from collections.abc import Iterable, Mapping, Sequence
from math import ceil

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from reference.workshop.crossplay.intervals import Interval, of_mean
from reference.workshop.drawing.crossplay import LINES
from reference.workshop.drawing.curves import SMOOTHING, Line, mean_of, smooth
from reference.workshop.drawing.page import foot, sheet, write_numbers
from reference.workshop.drawing.runs import Run
from reference.workshop.training.summaries import SURVIVAL

COLUMNS = 4


def survivors(title: str, arms: Mapping[str, Sequence[Run]], side: str) -> Figure:
    """Draw running means of survivors over a side's decisions, arm by arm.

    Robots begin with hardly any; what fires still gain is a few points, shown large.
    """
    rows, columns = ceil(len(arms) / COLUMNS), min(COLUMNS, len(arms))
    figure = sheet(title, max(6.0, 2.8 * columns), 2.4 * rows + 1.2)
    panels = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
    colour = LINES[side == "fire"][0]
    for k, (axes, (arm, runs)) in enumerate(
        zip(panels.flat, arms.items(), strict=False)
    ):
        lines = [_line(run, side) for run in runs]
        for line in lines:
            axes.plot(*line, color=colour, lw=0.8, alpha=0.5)
        axes.plot(*mean_of(lines), color=colour, lw=2)
        axes.set_title(arm)
        if k + columns >= len(arms):  # nothing below
            axes.set_xlabel(f"decisions of the {side}")
            axes.tick_params(labelbottom=True)
        axes.grid(axis="y")
        axes.xaxis.set_major_locator(MaxNLocator(4))
        write_numbers(axes.xaxis)
    if side == "robots":
        axes.set_ylim(0, 100)  # of all panels
    for axes in panels.flat[len(arms) :]:
        axes.remove()
    for axes in panels[:, 0]:
        axes.set_ylabel("survivors, %")
    means = f"running means over {SMOOTHING:.0%} of its decisions".replace("%", " %")
    foot(figure, [], caption=f"thin: each training, {means}; bold: their mean")
    return figure


def last_gain(responses: Iterable[Run]) -> Interval:
    """Measure how much fires still gained at the end of their training.

    Survivors in its fourth fifth minus those in its last, the mean over fires.
    """

    def gain(run: Run) -> float:
        survivors = run.columns[SURVIVAL][run.columns["side"] == "fire"]
        fifth = max(1, len(survivors) // 5)
        before, last = survivors[-2 * fifth : -fifth], survivors[-fifth:]
        return float(before.mean() - last.mean())

    return of_mean([gain(run) for run in responses])


def _line(run: Run, side: str) -> Line:
    """Running means of the episodes that a side has learned from."""
    y = 100 * run.columns[SURVIVAL]
    known = np.isfinite(y) & (run.columns["side"] == side)
    x = run.columns["step"][known]
    return x, smooth(x, y[known], run.part[known], SMOOTHING * x[-1])
