"""Charts of a cross-play: who beats whom, and how fast people get out.

Clause: F12.  Curves are told apart by dashes as well as by colours; brackets and bands
are 95 % bootstrap intervals of the mean over runs.

    t  seconds since the evacuation began;  n  runs
"""

from collections.abc import Sequence
from itertools import cycle
from math import ceil
from typing import Any

import numpy as np
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator, PercentFormatter

from reference.paper import InputError
from reference.workshop.crossplay.intervals import band
from reference.workshop.crossplay.results import Cell, mean_and_interval
from reference.workshop.crossplay.runs import RunResult
from reference.workshop.drawing.page import TEXT, Style, foot, sheet, shortened

EVEN = LinearSegmentedColormap.from_list("even", ["#dc7d33", "#fbf7ef", "#62a0d8"])
"""Survival: orange where the fire wins, blue where the robots do, for every eye."""

LINES: tuple[tuple[str, Any], ...] = (
    ("#0072b2", "-"),
    ("#d55e00", (0, (5, 1.5))),
    ("#009e73", (0, (1, 1))),
    ("#cc79a7", (0, (6, 1.5, 1, 1.5))),
    ("#16191d", (0, (10, 2))),
    ("#e69f00", (0, (3, 1, 1, 1, 1, 1))),
    ("#56b4e9", (0, (2, 2))),
    ("#8a6d3b", (0, (8, 1.5, 3, 1.5))),
)
"""Colours of Okabe and Ito, which every eye tells apart, each with its dashes."""

STEP = 1.0  # seconds between two points of a curve
LONGEST = 24  # letters in a line of a name


def names(words: Sequence[str]) -> list[str]:
    """Shorten names, but keep them different: of a path, only as much as needed.

    A name may have several lines.
    """
    for kept in range(1, 2 + max((word.count("/") for word in words), default=0)):
        short = [_name(word, kept) for word in words]
        if len(set(short)) == len(words):
            return short
    return [f"{_name(word, 1)} ({k})" for k, word in enumerate(words, 1)]


def _name(word: str, kept: int) -> str:
    """Keep a path's last parts, a line each."""
    *folders, last = word.rstrip("/").split("/")
    lines = [*folders[-kept:], last.removesuffix(".pt")]
    if last == lines[-1]:  # a folder, which says by itself what was trained
        lines = lines[-kept:]
    return "\n".join(shortened(line, LONGEST) for line in lines)


def labels(
    found: Sequence[Cell] | Sequence[RunResult], side: str, between: str = "\n"
) -> dict[str, str]:
    """Name robots or fires shortly, in the order of first appearance.

    between: lines of a name
    """
    players = list(dict.fromkeys(getattr(each, side) for each in found))
    short = (name.replace("\n", between) for name in names(players))
    return dict(zip(players, short, strict=True))


# -- Who beats whom -----------------------------------------------------------------


def matrix(cells: Sequence[Cell], caption: str = "") -> Figure:
    """Draw every match's mean survival and interval, as a map of robots × fires [F12].

    caption: what means and intervals are over, if not over a match's runs.
    Raises ValueError if there are no cells.
    """
    if not cells:
        raise InputError(
            "there is nothing to draw: no cells. Evaluate some runs first."
        )
    robots, fires = labels(cells, "robots"), labels(cells, "fire")
    size = max(6.4, 1.4 * len(fires) + 2.6), 0.66 * len(robots) + 1.8
    page = sheet("Who beats whom: survivors, %", *size)
    axes = page.subplots()
    means = np.full((len(robots), len(fires)), np.nan)
    for cell in cells:
        place = [*robots].index(cell.robots), [*fires].index(cell.fire)
        means[*place] = cell.survival.mean
        middle: Style = {"x": place[1] + 0.5, "ha": "center", "va": "center"}
        mean, ends = mean_and_interval(cell, "survival")
        axes.text(y=place[0] + 0.36, s=mean, fontsize=12, **middle)
        axes.text(y=place[0] + 0.74, s=ends, fontsize=8, **middle)
    boxes = axes.pcolormesh(means, cmap=EVEN, vmin=0, vmax=1, ec="white", lw=1.5)
    axes.invert_yaxis()
    axes.xaxis.tick_top()
    axes.xaxis.set_label_position("top")
    axes.set_xticks(np.arange(len(fires)) + 0.5, fires.values())
    axes.set_yticks(np.arange(len(robots)) + 0.5, robots.values())
    axes.tick_params(length=0, labelcolor=TEXT)
    axes.set_ylabel("robots")
    axes.set_xlabel("fire", labelpad=9)  # else it reads as part of a fire's name
    axes.spines[:].set_visible(False)
    bar = page.colorbar(boxes, ticks=MaxNLocator(4), format=PercentFormatter(1, 0, ""))
    bar.outline.set_visible(False)
    foot(page, [], caption=caption or _caption([cell.n for cell in cells]))
    return page


def _caption(runs: Sequence[int]) -> str:
    """Say how many runs stand behind a box."""
    fewest, most = min(runs), max(runs)
    if most == 1:
        return "one run a match, which tells nothing of how runs scatter"
    counted = f"{most}" if fewest == most else f"{fewest} to {most}"
    return f"means over {counted} runs a match; in brackets 95 % bootstrap intervals"


# -- How fast people get out --------------------------------------------------------


def curves(results: Sequence[RunResult]) -> Figure:
    """Draw evacuation curves: who is out by when, a panel for each fire [F12].

    Means over each strategy's runs, with bands. Raises ValueError without results.
    """
    if not results:
        raise InputError("there is nothing to draw: no runs. Evaluate some first.")
    robots, fires = labels(results, "robots", " "), labels(results, "fire", " ")
    columns = min(len(fires), 2 if len(fires) == 4 else 3)
    rows = ceil(len(fires) / columns)
    title = "Evacuation curves: who is out by when, with 95 % intervals"
    page = sheet(title, max(7.5, 3.5 * columns), 2.5 * rows + 1.2)
    panels = page.subplots(rows, columns, sharey=True, squeeze=False)
    t = np.arange(0, max(r.evacuation_time or 0 for r in results) + 2 * STEP, STEP)
    for axes, (fire, name) in zip(panels.flat, fires.items(), strict=False):
        axes.set(xlim=(0, t[-1]), ylim=(0, 102), xlabel="seconds")
        axes.set_title(f"fire: {name}")
        axes.grid(axis="y")
        for (word, label), (colour, dashes) in zip(
            robots.items(), cycle(LINES), strict=False
        ):
            runs = [run for run in results if run.run[:2] == (word, fire)]
            mean, low, high = (100 * line for line in band(shares(runs, t)))
            axes.fill_between(t, low, high, color=colour, alpha=0.16, lw=0)
            axes.plot(t, mean, lw=1.9, color=colour, ls=dashes, label=label)
    for axes in panels[:, 0]:
        axes.set_ylabel("people out, %")
    for axes in panels.flat[len(fires) :]:
        axes.remove()
    foot(page, handlelength=3.6)
    return page


def shares(results: Sequence[RunResult], t: np.ndarray) -> np.ndarray:
    """(n, T) shares of all people who are out by each of (T,) times, run by run."""
    out = [np.searchsorted(run.times, t, side="right") for run in results]
    people = np.array([run.people for run in results])
    return np.stack(out) / people[:, None]
