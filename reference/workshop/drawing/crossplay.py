"""Who beats whom, and how fast people get out: the pictures of a cross-play.

Clause: F12.  Curves are told apart by dashes as well as by colours; brackets and bands
are 95 % bootstrap intervals of the mean over runs.

    t  seconds since the evacuation began;  n  runs
"""

from collections.abc import Sequence
from math import ceil
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LinearSegmentedColormap, Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, MaxNLocator

from reference.workshop.drawing.page import FAINT, TEXT, blank, heading
from reference.workshop.evaluation.crossplay import Cell, Record, figure_of, written
from reference.workshop.evaluation.intervals import band

WHAT = {
    "survival": "survivors, %",
    "reward": "reward R, health points",
    "difficulty": "difficulty h",
    "score": "score E",
}
"""What a matrix can show, and in which units."""

EVEN = LinearSegmentedColormap.from_list("even", ["#dc7d33", "#fbf7ef", "#62a0d8"])
"""Survival: orange where the fire wins, blue where the robots do, for every eye."""
AMOUNT = LinearSegmentedColormap.from_list("amount", ["#f4f6f9", "#62a0d8"])
UNKNOWN = "#dfe3e8"

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


# -- Names --------------------------------------------------------------------------

LONGEST = 19  # letters of a line


def names(words: Sequence[str]) -> list[str]:
    """Short names, all different: of the path of a checkpoint no more than will do.

    A name may have several lines.
    """
    for kept in range(1, 2 + max(word.count("/") for word in words)):
        short = [_name(word, kept) for word in words]
        if len(set(short)) == len(words):
            return short
    return [f"{_name(word, 1)} ({k})" for k, word in enumerate(words, 1)]


def _name(word: str, kept: int) -> str:
    """What stands before a path, such as `critic:`, and the path's last parts."""
    before, colon, path = word.rpartition(":")
    *folders, last = path.rstrip("/").split("/")
    end = [*folders[-kept:], last.removesuffix(".pt")]
    if last == end[-1]:  # a folder, which says by itself what was trained
        end = end[-kept:]
    return "\n".join(map(_fitted, [before + colon] * bool(colon) + end))


def _fitted(line: str) -> str:
    """Its beginning and its end."""
    half = LONGEST // 2
    return line if len(line) <= LONGEST else f"{line[:half]}…{line[-half:]}"


# -- Who beats whom -----------------------------------------------------------------

_BOX = (1.4, 0.66)  # inches of a match
_LEFT, _RIGHT, _BELOW, _NARROWEST = 1.85, 1.25, 0.45, 6.4
_ABOVE, _LINE = 0.95, 0.14  # for the title, and for each line of the fires' names


def matrix(cells: Sequence[Cell], what: str = "survival") -> Figure:
    """Every match's mean with its interval, as a map of robots × fires [F12].

    what: one of `WHAT`. Raises ValueError for another, and if there are no cells.
    """
    if what not in WHAT or not cells:
        raise ValueError(f"there is nothing to draw: no cells, or none of {[*WHAT]}.")
    robots, fires = _words(cells, "robots"), _words(cells, "fire")
    page, axes = _map(robots, fires)
    found = {(c.robots, c.fire): c for c in cells if getattr(c, what) is not None}
    shades = _shades([getattr(c, what).mean for c in found.values()], what)
    for row, one in enumerate(robots):
        for column, other in enumerate(fires):
            _match(axes, (column, row), found.get((one, other)), what, shades)
    _colour_bar(page, axes, shades, what)
    heading(page, f"Who beats whom: {WHAT[what]}")
    caption = _caption([cell.n for cell in cells])
    page.text(0.5, 0.02, caption, fontsize=8, color=FAINT, ha="center", va="bottom")
    return page


def _caption(runs: Sequence[int]) -> str:
    """How many stand behind a box."""
    fewest, most = min(runs), max(runs)
    if most == 1:
        return "one run a match, which tells nothing of how runs scatter"
    counted = f"{most}" if fewest == most else f"{fewest} to {most}"
    return f"means over {counted} runs a match; in brackets 95 % bootstrap intervals"


def _words(found: Sequence[Cell] | Sequence[Record], side: str) -> list[str]:
    return list(dict.fromkeys(getattr(each, side) for each in found))


def _map(robots: Sequence[str], fires: Sequence[str]) -> tuple[Figure, Axes]:
    """An empty map with the names along its edges, a box of fixed size a match."""
    wide, high = len(fires) * _BOX[0], len(robots) * _BOX[1]
    lines = max(name.count("\n") + 1 for name in names(fires))
    width = max(_LEFT + wide + _RIGHT, _NARROWEST)
    height = _ABOVE + lines * _LINE + high + _BELOW
    page = blank(width, height)
    left = (width - wide + _LEFT - _RIGHT) / 2
    axes = page.add_axes((left / width, _BELOW / height, wide / width, high / height))
    axes.set(xlim=(-0.5, len(fires) - 0.5), ylim=(len(robots) - 0.5, -0.5))
    axes.xaxis.tick_top()
    axes.xaxis.set_label_position("top")
    axes.set_xticks(range(len(fires)), names(fires))
    axes.set_yticks(range(len(robots)), names(robots))
    for label in (*axes.get_xticklabels(), *axes.get_yticklabels()):
        label.set_parse_math(False)
    axes.tick_params(length=0, labelsize=8.5, labelcolor=TEXT)
    axes.set_xlabel("fire", fontsize=9, color=FAINT)
    axes.set_ylabel("robots", fontsize=9, color=FAINT)
    axes.spines[:].set_visible(False)
    return page, axes


def _shades(means: Sequence[float], what: str) -> ScalarMappable:
    """Survival from nobody to everybody; amounts from 0, or a loss, to the most."""
    if what == "survival":
        return ScalarMappable(Normalize(0, 1), EVEN)
    low, high = min([0.0, *means]), max([0.0, *means])
    return ScalarMappable(Normalize(low, high if high > low else 1.0), AMOUNT)


def _match(
    axes: Axes,
    place: tuple[int, int],
    cell: Cell | None,
    what: str,
    shades: ScalarMappable,
) -> None:
    """One box: the mean large, its interval small beneath."""
    x, y = place
    value = getattr(cell, what).mean if cell else None
    fill = UNKNOWN if value is None else shades.to_rgba(np.array(value))
    axes.fill(
        [x - 0.5, x + 0.5, x + 0.5, x - 0.5],
        [y - 0.5, y - 0.5, y + 0.5, y + 0.5],
        facecolor=fill,
        edgecolor="white",
        linewidth=1.5,
    )
    if cell is None:
        axes.text(x, y, "–", ha="center", va="center", color=FAINT)
        return
    mean, ends = figure_of(cell, what)
    centred: dict[str, Any] = {"ha": "center", "va": "center", "color": TEXT}
    axes.text(x, y - 0.14, mean, fontsize=12, **centred)
    axes.text(x, y + 0.24, ends, fontsize=8, **centred)


def _colour_bar(page: Figure, map_: Axes, shades: ScalarMappable, what: str) -> None:
    """To the right of the map, as high as its boxes."""
    box, width = map_.get_position(), page.get_size_inches()[0]
    axes = page.add_axes((box.x1 + 0.25 / width, box.y0, 0.14 / width, box.height))
    bar = page.colorbar(shades, cax=axes)
    bar.outline.set_visible(False)
    bar.locator = MaxNLocator(4)
    bar.formatter = FuncFormatter(lambda v, _: written(v, what).removesuffix(".0"))
    bar.update_ticks()
    axes.tick_params(labelsize=8, color=FAINT, labelcolor=FAINT, length=2)


# -- How fast people get out --------------------------------------------------------

_PANEL, _MARGIN = (3.2, 2.1), 0.75  # inches
_APART = (0.35, 0.7)
_TITLE, _AXIS, _ROW, _NARROW = 0.85, 0.5, 0.22, 7.5
_ENTRY, _LETTER = 0.85, 0.08  # inches in a legend, beside the name and of it


def curves(records: Sequence[Record]) -> Figure:
    """Evacuation curves: who is out by when, a panel for each fire [F12].

    Means over the runs of each robots, with bands. Raises ValueError without records.
    """
    if not records:
        raise ValueError("there is nothing to draw: no runs. Evaluate some first.")
    robots, fires = _words(records, "robots"), _words(records, "fire")
    labels = [name.replace("\n", " ") for name in names(robots)]
    page, panels = _panels(len(fires), labels)
    last = max(run.evacuation_time or 0.0 for run in records)
    t = np.arange(0.0, last + 2 * STEP, STEP)
    for axes, fire, name in zip(panels, fires, names(fires), strict=True):
        for word, look in zip(robots, _looks(len(robots)), strict=True):
            runs = [run for run in records if run.match == (word, fire)]
            if runs:
                _curve(axes, t, runs, look)
        _rule(axes, "fire: " + name.replace("\n", " "), t[-1])
    heading(page, "Evacuation curves: who is out by when, with 95 % intervals")
    _legend(page, labels)
    return page


def shares(records: Sequence[Record], t: np.ndarray) -> np.ndarray:
    """(n, T) shares of all people who are out by each of (T,) times, run by run."""
    out = [np.searchsorted(run.times, t, side="right") for run in records]
    people = np.array([run.people for run in records])
    return np.stack(out) / people[:, None]


def _looks(count: int) -> list[dict[str, Any]]:
    """Colours and dashes; after so many they come again."""
    chosen = (LINES[k % len(LINES)] for k in range(count))
    return [{"color": colour, "ls": dashes} for colour, dashes in chosen]


def _curve(
    axes: Axes, t: np.ndarray, runs: Sequence[Record], look: dict[str, Any]
) -> None:
    mean, low, high = (100 * line for line in band(shares(runs, t)))
    axes.fill_between(t, low, high, color=look["color"], alpha=0.16, lw=0)
    axes.plot(t, mean, lw=1.9, **look)


def _panels(count: int, labels: Sequence[str]) -> tuple[Figure, list[Axes]]:
    """A page with so many panels, side by side and in rows, and room for a legend."""
    columns = min(count, 3 if count != 4 else 2)
    rows = ceil(count / columns)
    width = 2 * _MARGIN + columns * _PANEL[0] + (columns - 1) * _APART[0]
    width = max(width, _NARROW)
    below = _AXIS + _ROW * ceil(len(labels) / _beside(labels, width)) + 0.1
    height = _TITLE + rows * _PANEL[1] + (rows - 1) * _APART[1] + below
    page = blank(width, height)
    spare = (width - columns * _PANEL[0] - (columns - 1) * _APART[0]) / 2
    panels = []
    for number in range(count):
        row, column = divmod(number, columns)
        x = spare + column * (_PANEL[0] + _APART[0])
        y = below + (rows - 1 - row) * (_PANEL[1] + _APART[1])
        size = (_PANEL[0] / width, _PANEL[1] / height)
        axes = page.add_axes((x / width, y / height, *size))
        axes.tick_params(labelleft=column == 0)
        if column == 0:
            axes.set_ylabel("people out, %", fontsize=8, color=FAINT)
        if number + columns >= count:
            axes.set_xlabel("seconds", fontsize=8, color=FAINT, labelpad=2)
        panels.append(axes)
    return page, panels


def _rule(axes: Axes, title: str, end: float) -> None:
    axes.set(xlim=(0, end), ylim=(0, 102))
    axes.set_title(title, fontsize=10, color=TEXT, loc="left", pad=4, parse_math=False)
    axes.spines[["top", "right"]].set_visible(False)
    axes.spines[["left", "bottom"]].set_color(FAINT)
    axes.tick_params(labelsize=8, color=FAINT, labelcolor=FAINT, length=3)
    axes.xaxis.set_major_locator(MaxNLocator(6, integer=True))
    axes.yaxis.set_major_locator(MaxNLocator(5))
    axes.grid(axis="y", color=FAINT, alpha=0.2, linewidth=0.6)


def _beside(labels: Sequence[str], width: float) -> int:
    """How many labels of a legend fit beside each other into so many inches."""
    longest = _ENTRY + _LETTER * max(map(len, labels))
    return min(len(labels), max(1, int((width - 0.2) / longest)))


def _legend(page: Figure, labels: Sequence[str]) -> None:
    """Along the lower edge, with lines long enough to show their dashes."""
    named = zip(labels, _looks(len(labels)), strict=True)
    page.legend(
        handles=[Line2D([], [], lw=1.9, label=name, **look) for name, look in named],
        loc="lower center",
        bbox_to_anchor=(0.5, 0.005),
        ncols=_beside(labels, page.get_size_inches()[0]),
        fontsize=9,
        frameon=False,
        labelcolor=TEXT,
        handlelength=3.6,
        columnspacing=1.6,
    )
