"""Charts of a cross-play: who beats whom, and how fast people get out.

Curves are told apart by dashes as well as by colours, which are those of their robots
in every picture; brackets and bands are 95 % bootstrap intervals of the mean over runs.
"""

from collections.abc import Sequence
from math import ceil
from textwrap import fill
from typing import Any

import numpy as np
from matplotlib import color_sequences
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.rcsetup import cycler
from matplotlib.ticker import PercentFormatter

from reference.workshop.comparing.intervals import intervals_of_columns
from reference.workshop.comparing.results import Cell, mean_and_interval
from reference.workshop.comparing.runs import RunResult
from reference.workshop.drawing.colours import DASHES, lines_of
from reference.workshop.drawing.page import Style, label_outer, legend, sheet

SURVIVAL_COLOURS = LinearSegmentedColormap.from_list(
    "even", ["#dc7d33", "#fbf7ef", "#62a0d8"]
)
"""Survival: orange where the fire wins, blue where the robots do, for every eye."""

_TURNS = [DASHES[(k + k // 8) % 4] for k in range(32)]  # one on as colours come again
LINE_STYLES = cycler(color=4 * color_sequences["petroff8"], linestyle=_TURNS)
"""Petroff's eight colours, which every eye tells apart, with all dashes in turn."""


MEANS_OVER = "means over the runs of robots and a fire, with 95 % bootstrap intervals"
ONE_RUN = "one run of robots and a fire"


def players(cells: Sequence[Cell] | Sequence[RunResult], side: str) -> list[str]:
    """List all robots or fires, in the order of first appearance."""
    return list(dict.fromkeys(getattr(cell, side) for cell in cells))


def matrix(cells: Sequence[Cell], caption: str = "") -> Figure:
    """Draw every match's mean survival and interval, as a map of robots × fires.

    caption: where, and what means and intervals are over
    """
    many = any(cell.n > 1 for cell in cells)
    over = caption or (MEANS_OVER if many else ONE_RUN)
    robots = players(cells, "robots")
    fires = players(cells, "fire")
    names = [fill(name, 22) for name in robots]
    lines = max(1 + name.count("\n") for name in names)
    high = max(0.8, 0.17 * lines)  # inches of a row
    page = sheet("Who beats whom", 3 + 1.7 * len(fires), 2.2 + high * len(robots))
    axes = page.subplots()

    means = np.full((len(robots), len(fires)), np.nan)
    for cell in cells:
        row = robots.index(cell.robots)
        column = fires.index(cell.fire)
        means[row, column] = cell.survival.mean
        words = "\n".join(filter(None, mean_and_interval(cell, "survival")))
        axes.text(column, row, words, ha="center", va="center", fontsize=9)

    image = axes.imshow(means, SURVIVAL_COLOURS, vmin=0, vmax=1, aspect="auto")
    axes.set(xlabel="fire", ylabel="robots")
    axes.set_xticks(range(len(fires)), [fill(name, 22) for name in fires])
    axes.set_yticks(range(len(robots)), names)
    page.colorbar(image, format=PercentFormatter(1), label="survivors")
    page.supxlabel(fill(over, 28 + 16 * len(fires)), fontsize=8)
    return page


def evacuation_curves(results: Sequence[RunResult], caption: str = "") -> Figure:
    """Draw evacuation curves: who is out by when, a panel for each fire.

    Means over each strategy's runs, with bands. caption: where, and over what
    """
    robots = players(results, "robots")
    fires = players(results, "fire")
    lines = lines_of(robots)
    columns = min(len(fires), 3)
    rows = ceil(len(fires) / columns)
    width = max(7.5, 3.5 * columns)
    many = len(results) > len({run.match for run in results})
    about = ", with 95 % intervals" if many else ""
    page = sheet("Evacuation curves", width, 2.5 * rows + 1.5, about)
    latest = max(run.evacuation_time or 0 for run in results)
    t = np.arange(0, latest + 2)

    for place, fire in enumerate(fires, 1):
        axes = page.add_subplot(rows, columns, place, xlim=(0, t[-1]), ylim=(0, 102))
        axes.set(xlabel="seconds", ylabel="people out, %")
        axes.set_title(fill(f"fire: {fire}", 40))
        axes.grid(axis="y")
        for name, line in lines.items():
            runs = [run for run in results if run.match == (name, fire)]
            plot_who_is_out(axes, runs, t, fill(name, 24), **line)
    label_outer(page.axes, columns)

    letters = min(24, max(map(len, robots)))
    entry = 0.8 + 0.07 * letters  # inches
    columns = min(4, int(width / entry))
    words = fill(caption, int(13 * width))
    look: Style = {"title": words, "title_fontsize": 8, "handlelength": 3.6}
    legend(page, axes.lines, ncols=columns, **look)
    return page


def plot_who_is_out(
    axes: Axes, runs: Sequence[RunResult], t: np.ndarray, label: str, **look: Any
) -> Line2D:
    """Plot how many people are out at times t (s), per cent: a mean and its band.

    look: of the line, if it is not the next of the axes
    """
    out = [np.searchsorted(run.times, t, "right") / max(1, run.people) for run in runs]
    mean, low, high = (100 * line for line in intervals_of_columns(np.stack(out)))
    (line,) = axes.plot(t, mean, label=label, **{"lw": 1.9} | look)
    axes.fill_between(t, low, high, color=line.get_color(), alpha=0.16, lw=0)
    return line
