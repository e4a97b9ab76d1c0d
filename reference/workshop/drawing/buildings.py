"""Buildings side by side: who is out by when, and where people died.

A row for each match of robots and fire: curves of all buildings, then each building's
floors, with a cross wherever people died.  Bands and brackets are 95 % intervals.
"""

from collections.abc import Mapping, Sequence
from textwrap import fill
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from reference.building import Building, Kind
from reference.workshop.comparing.buildings import (
    BuildingCell,
    Played,
    in_percent,
    runs_of,
)
from reference.workshop.comparing.intervals import format_interval
from reference.workshop.comparing.runs import RunResult
from reference.workshop.drawing import page, plans
from reference.workshop.drawing.crossplay import LINE_STYLES, plot_who_is_out
from reference.workshop.drawing.crowding import CROSS, mark_deaths
from reference.workshop.drawing.evacuation import paint_floors

# inches
PLAN_WIDTH = 4.4
CURVE_WIDTH = 4.0
LOWEST = 2.4  # of a row
HIGHEST = 7.0  # of a row
TITLE_HIGH = 0.3  # above a floor
HEADING_HIGH = 0.8  # above a building

NAME = 24  # letters of a building's name


def side_by_side(
    buildings: Mapping[str, Building], played: Played, figures: Sequence[BuildingCell]
) -> Figure:
    """Draw all matches in all buildings; figures: of `compare_buildings`."""
    matches = list(dict.fromkeys((each.robots, each.fire) for each in figures))
    shapes = [_floors_shape(building) for building in buildings.values()]
    metre = min(PLAN_WIDTH / across for _, across, _ in shapes)  # in inches
    high = max(down * metre + TITLE_HIGH * rows for down, _, rows in shapes)
    high = float(np.clip(high, LOWEST, HIGHEST))

    width = CURVE_WIDTH + PLAN_WIDTH * len(buildings)
    height = (high + HEADING_HIGH) * len(matches) + 1.5
    title = "Where people get out, and where they die"
    figure = page.sheet(title, width, height)
    widths = [CURVE_WIDTH, *[PLAN_WIDTH] * len(buildings)]
    look: dict[str, Any] = {"width_ratios": widths, "squeeze": False}
    rows = figure.subplots(len(matches), len(widths), **look)

    latest = max(
        run.evacuation_time or 0 for results in played.values() for run in results
    )
    t = np.arange(0, latest + 2)
    plan_axes = []
    for match, (curve, *panels) in zip(matches, rows, strict=True):
        of_match = [each for each in figures if (each.robots, each.fire) == match]
        runs = runs_of(played, match)
        _draw_curves(curve, runs, of_match, t)
        for axes, (name, building) in zip(panels, buildings.items(), strict=True):
            mine = [each for each in of_match if each.building == name]
            down, across, _ = _floors_shape(building)
            points = 72 * min(PLAN_WIDTH / across, high / down)
            moves = _draw_floors(axes, building, runs[name], points)
            axes.set_title(_heading(mine), fontsize=10, pad=18)
            plan_axes.append((axes, building, moves))

    _add_legend(figure, rows[0, 0], [*buildings.values()], _words_over(figures[0].n))
    figure.draw_without_rendering()
    for axes, building, moves in plan_axes:
        for area in building.areas:
            plans.write_in_corner(axes, building, area, moves[area.floor])
    return figure


def _floors_shape(building: Building) -> tuple[int, float, int]:
    """Metres down and across that all floors of a building take, and their rows."""
    rows, columns = page.arranged(building, building.floors)
    down, across = building.kind.shape[1:]
    return rows * down, columns * across * 1.1, rows


def _draw_curves(
    axes: Axes,
    runs: Mapping[str, Sequence[RunResult]],
    figures: Sequence[BuildingCell],
    t: np.ndarray,
) -> None:
    """Draw who is out by when in each building."""
    robots, fire = figures[0].robots, figures[0].fire
    guides = "nobody guides" if robots == "none" else f"robots: {robots}"
    words = (guides, f"fire: {fire}")
    title = "\n".join(page.shortened(line, 2 * NAME) for line in words)
    axes.set_title(title, fontsize=11)
    axes.set(xlabel="seconds", ylabel="people out, %", xlim=(0, t[-1]), ylim=(0, 102))
    axes.grid(axis="y")
    axes.set_prop_cycle(LINE_STYLES)
    means = [each for each in figures if not each.less]
    for each in means:
        name = page.shortened(each.building, NAME)
        plot_who_is_out(axes, runs[each.building], t, name)


def _heading(figures: Sequence[BuildingCell]) -> str:
    """Say how many get out of a building, and how many more than of the first."""
    lines = []
    for each in figures:
        signed = bool(each.less)
        percent = format_interval(in_percent(each.survival), 1, signed, each.n > 1)
        if each.less:
            lines.append(f"{percent} points against {page.shortened(each.less, NAME)}")
        else:
            name = page.shortened(each.building, NAME)
            lines.append(f"{name}: {percent} % survive")
    return "\n".join(lines)


def _draw_floors(
    axes: Axes, building: Building, runs: Sequence[RunResult], metre: float
) -> np.ndarray:
    """Draw floors, where people died on them, and how many in a run; return moves.

    metre: in points
    """
    deaths = np.zeros(building.kind.shape, int)
    for run in runs:
        for floor, x, y in run.deaths:
            deaths[(floor, *building.cell(x, y))] += 1
    counts = deaths.sum(axis=(1, 2)) / len(runs)
    # a narrow floor has room for no more digits
    names = [
        f"Floor {k}: {count:.{1 if count < 9.95 else 0}f} die"
        for k, count in enumerate(counts, 1)
    ]
    moves = paint_floors(axes, building, metre, names)
    for floor, (x, y) in enumerate(moves.tolist()):
        mark_deaths(axes, building, deaths[floor], len(runs), (x, y))
    return moves


def _words_over(runs: int) -> str:
    """Say of how many runs a match is made, and what tells of all of them."""
    deaths = "floors: deaths a run; crosses: all runs"
    if runs == 1:
        return f"one run of each match; {deaths}"
    bands = "bands and brackets: 95 % bootstrap intervals"
    return f"{runs:,} runs of each match; {bands}; {deaths}"


def _add_legend(
    figure: Figure, curve: Axes, buildings: Sequence[Building], words: str
) -> None:
    """Explain lines, crosses and cells; words: a line above."""
    named = [line for line in curve.lines if not str(line.get_label()).startswith("_")]
    kinds = np.concatenate([building.kind.ravel() for building in buildings])
    cells = page.swatches(kinds[kinds != Kind.FLOOR])
    columns = int(figure.get_figwidth() / 2.1)
    handles = [*named, *page.samples(CROSS), *cells]
    title = fill(words, int(12 * figure.get_figwidth()))
    page.legend(figure, handles, ncols=columns, title=title, title_fontsize=8)
