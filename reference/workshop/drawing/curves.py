"""Learning curves of both sides over the episodes played, from a training's table.

Both sides play each episode, so they can share this axis; their decisions differ in
number.

    x  episodes played up to a row;  y  what a column says there
"""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from textwrap import fill
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from reference.building import Kind
from reference.paper import InputError
from reference.workshop.drawing import page
from reference.workshop.drawing.colours import OTHERS, lines_of
from reference.workshop.drawing.crossplay import LINE_STYLES
from reference.workshop.drawing.evacuation import EMBER
from reference.workshop.drawing.page import BLUE, COLOURS, Style
from reference.workshop.storage.files import read_number, read_table
from reference.workshop.training import summaries
from reference.workshop.training.summaries import Levels

SMOOTHING = 0.05  # share of the time axis that a running mean covers
MOST_SIGNS = 110  # of a line below the panels
Curve = tuple[np.ndarray, np.ndarray]  # x and y, (k,) each; x ascends


class TrainingTable(NamedTuple):
    """One training: (k,) summaries of both sides in the order of episodes.

    columns  by name: words of "side" and "phase", numbers else, nan where one is empty
    """

    name: str
    columns: dict[str, np.ndarray]


def read_summaries(path: str | Path) -> TrainingTable:
    """Read a table, or the one in a folder.

    A last line without its end is still being written and left out. Raises ValueError
    for what is no such table or is not in its order, OSError where there is none.
    """
    path = Path(path)
    file = path / summaries.SUMMARIES if path.is_dir() else path
    if not file.is_file():
        raise FileNotFoundError(
            f"{file}: there is no such table. Name the folder of a training, or the "
            f"{summaries.SUMMARIES} in it."
        )
    rows = read_table(file, summaries.SUMMARY_COLUMNS, _numbers)
    columns = {
        name: np.array([row[name] for row in rows])
        for name in summaries.SUMMARY_COLUMNS
    }
    counts = [columns["episodes"]]
    for side in set(columns["side"]):
        counts.append(columns["step"][columns["side"] == side])
    if not all((np.diff(count) >= 0).all() for count in counts):
        raise InputError(
            f"{file}: its rows are not in the order of episodes and steps. Put them in "
            "the order in which the training wrote them, or name another folder."
        )
    return TrainingTable(path.name, columns)


def _numbers(row: dict[str, str]) -> dict[str, Any]:
    """Turn cells into numbers, empty ones into nan; two columns hold words."""
    values: dict[str, Any] = {}
    for name, cell in row.items():
        if name in ("side", "phase"):
            values[name] = cell
        else:
            values[name] = read_number(cell) if cell else np.nan
    return values


class CurveSource(NamedTuple):
    """A line of a panel: a column of one side's rows, of both sides' where it is ""."""

    label: str
    side: str
    column: str


LOOKS: dict[str, Style] = {
    "robots": {"color": BLUE, "ls": "-"},
    "robots' baseline": {"color": BLUE, "ls": "--"},
    "fire": {"color": EMBER, "ls": "-."},
    "people": {"color": COLOURS[Kind.EXIT], "ls": "-"},
}
SURVIVORS = "share of people who survive"


def _lines_of_both_sides(column: str) -> list[CurveSource]:
    """Make two lines of a panel: what a column says of each side."""
    return [CurveSource(side, side, column) for side in ("robots", "fire")]


PANELS = {
    "reward of an episode, health points": [
        CurveSource("robots", "", summaries.GROUP_REWARD),
        CurveSource("fire", "fire", summaries.OWN_REWARD),
    ],
    SURVIVORS: [CurveSource("people", "", summaries.SURVIVAL)],
    "entropy of the policies, nats": _lines_of_both_sides("Policy/Entropy"),
    "losses of the critics, (scaled return)²": [
        CurveSource("robots", "robots", "Losses/Value Loss"),
        CurveSource("robots' baseline", "robots", "Losses/Baseline Loss"),
        CurveSource("fire", "fire", "Losses/Value Loss"),
    ],
    "variance of returns that the critics explain": _lines_of_both_sides(
        summaries.EXPLAINED
    ),
    "signal / noise of the policies' gradients": _lines_of_both_sides(summaries.SIGNAL),
}


def curves_of(
    runs: Sequence[TrainingTable], side: str, column: str, over: str = "episodes"
) -> list[Curve]:
    """Find where the tables of runs have values; x is the column `over`.

    side: "" for both.  Runs with less than two points are left out.
    """
    lines = []
    for _, columns in runs:
        known = np.isfinite(columns[column])
        if side:
            known &= columns["side"] == side
        if known.sum() > 1:
            lines.append((columns[over][known], columns[column][known]))
    return lines


def smooth(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Average y over the points around each x, half a window to each side; all (k,).

    Near the ends the window is cut off.
    """
    half = SMOOTHING * x[-1] / 2
    sums = np.concatenate([[0.0], np.cumsum(y)])  # a window's sum is a difference
    first = np.searchsorted(x, x - half, "left")
    last = np.searchsorted(x, x + half, "right")
    return (sums[last] - sums[first]) / (last - first)


def mean_curve(lines: Sequence[Curve]) -> Curve:
    """Average lines at 400 points where all of them are; none unless all overlap."""
    if len(lines) == 1:
        return lines[0]
    first = max(x[0] for x, _ in lines)
    last = min(x[-1] for x, _ in lines)
    x = np.linspace(first, last, 400 if first < last else 0)
    return x, np.mean([np.interp(x, *line) for line in lines], axis=0)


def learning_curves(
    runs: Sequence[TrainingTable], about: str = "", levels: Levels | None = None
) -> Figure:
    """Draw reward, survivors, entropy and losses over the episodes played [E6].

    One run: faint as recorded, bold its running mean, in the colours of the sides.
    Several: running means, a colour for each run, and dashes tell the sides apart.

    about: a line above the legend, such as what differs between the runs
    levels: what guides achieve in the runs' task, as level lines
    Raises ValueError where there is nothing to draw.
    """
    panels = {title: _found(curves, runs) for title, curves in PANELS.items()}
    panels = {title: found for title, found in panels.items() if found}
    short = [run.name for run in runs if len(run.columns["step"]) < 2]
    if short or not panels:
        names = ", ".join(short or [run.name for run in runs])
        raise InputError(f"{names}: too few rows to draw: train for longer first.")
    names = ", ".join(run.name for run in runs)
    whole = page.sheet(f"Learning curves: {names}", 11, 1.9 * len(panels) + 1.5)
    column = whole.subplots(len(panels), sharex=True, squeeze=False)[:, 0]
    several = len(runs) > 1
    teams = [OTHERS[k % len(OTHERS)] for k in range(len(runs))] if several else []

    smoothed = False
    for axes, (title, found) in zip(column, panels.items(), strict=True):
        axes.set_title(title)
        smoothed |= _draw_panel(axes, found, teams)
    column[-1].set_xlabel("episodes played")
    column[-1].xaxis.set_major_formatter(_in_thousands)

    colour = {"color": page.TEXT} if several else {}
    looks: dict[str, Style] = {
        label: LOOKS[label] | {"lw": 2} | colour
        for title, found in panels.items()
        for label in found
        if not several or len(PANELS[title]) > 1  # else its panel's title names it
    }
    words = list[str]()
    if smoothed:  # else there are so few rows that each is its own mean
        bold = "" if several else "bold: "
        words.append(f"{bold}running means over {SMOOTHING:.0%} of the episodes")
    if levels:
        looks |= _add_levels(dict(zip(panels, column, strict=True)), levels)
        words.append(f"{', '.join(levels.means)}: {levels.about}")
    if several:
        words.append(about)
    else:
        _add_decisions(column[0], runs[0])
    named = zip(map(_name_of, runs), teams, strict=False)  # one run has no team
    _add_legend(whole, looks, named, words)
    return whole


def _draw_panel(
    axes: Axes, found: Mapping[str, Mapping[int, Curve]], teams: Sequence[str]
) -> bool:
    """Draw a panel's lines; tell whether running means differ from what was recorded.

    found: lines by label and run;  teams: the colour of each of several runs
    """
    smoothed = False
    axes.grid(axis="y")
    for label, lines in found.items():
        look = LOOKS[label] | {"lw": 2}
        for which, (x, y) in lines.items():
            if teams:
                look = look | {"color": teams[which]}
            else:
                axes.plot(x, y, **LOOKS[label], lw=0.9, alpha=0.4)
            means = smooth(x, y)
            smoothed |= not np.allclose(means, y)
            axes.plot(x, means, **look)
    return smoothed


def _add_legend(
    whole: Figure,
    looks: Mapping[str, Style],
    named: Iterable[tuple[str, str]],
    words: Sequence[str],
) -> None:
    """Explain the lines' looks, and the colours of named runs; words: lines above."""
    handles = page.samples(looks)
    handles += [Patch(color=colour, label=name) for name, colour in named]
    title = "\n".join(fill(line, MOST_SIGNS) for line in words if line)
    page.legend(whole, handles, title=title, handlelength=2.8, ncols=4)


def _add_levels(panels: Mapping[str, Axes], levels: Levels) -> dict[str, Style]:
    """Add a level line for each guide to the panels that have its figures.

    Returns looks by their words; of equal lines the first of the guides lies above.
    """
    looks: dict[str, Style] = {}
    styles = lines_of(levels.means)
    for order, (name, means) in enumerate(levels.means.items()):
        look = styles[name] | {"lw": 1.4}
        looks[f"{name}: {means[summaries.SURVIVAL]:.0%} survive"] = look
        for title, axes in panels.items():
            for curve in PANELS[title]:
                if curve.column in means:
                    y = means[curve.column]
                    axes.axhline(y, zorder=1.9 - 0.1 * order, **look)
    return looks


def _name_of(run: TrainingTable) -> str:
    """Name a run, with its decisions: runs do not share an axis of these."""
    name = page.shortened(run.name, 30)
    return f"{name}: {decisions_of(run)[-1]:,.0f} decisions"


def decisions_of(run: TrainingTable) -> np.ndarray:
    """Count the decisions of both sides up to each row, as a training's bar does."""
    columns = run.columns
    total = np.zeros(len(columns["step"]))
    for side in set(columns["side"]):  # a side's count stays until its next row
        of_side = np.where(columns["side"] == side, columns["step"], 0.0)
        total += np.maximum.accumulate(of_side)
    return np.maximum.accumulate(total)


def _add_decisions(axes: Axes, run: TrainingTable) -> None:
    """Tell decisions of those who learned above a panel."""
    # of rows after as many episodes, the last one counts
    rows = run.columns["episodes"][::-1]
    episodes, last = np.unique(rows, return_index=True)
    decisions = decisions_of(run)[::-1][last]
    if len(episodes) < 2 or decisions[-1] == 0:
        return

    # axes reach beyond the data: there it goes on at the mean pace
    far = 10 * episodes[-1]
    most = far * decisions[-1] / episodes[-1]
    episodes = np.concatenate([[-far], episodes, [far]])
    decisions = np.concatenate([[-most], decisions, [most]])
    decisions = decisions + 1e-6 * np.arange(len(decisions))  # to have an inverse
    above = axes.secondary_xaxis(
        "top",
        functions=(
            lambda x: np.interp(np.asarray(x), episodes, decisions),
            lambda x: np.interp(np.asarray(x), decisions, episodes),
        ),
    )
    sides = dict.fromkeys(run.columns["side"])
    whose = f"the {next(iter(sides))}" if len(sides) == 1 else "all sides"
    above.set_xlabel(f"decisions of {whose}")
    above.xaxis.set_major_formatter(_in_thousands)
    axes.set_title(axes.get_title("left"), pad=34, loc="left")


def _in_thousands(count: float, tick: float) -> str:
    """Write a number of an axis: 2,500,000. tick: which one, not needed."""
    return f"{count:,.10g}"


def _found(
    curves: Sequence[CurveSource], runs: Sequence[TrainingTable]
) -> dict[str, dict[int, Curve]]:
    """Find a panel's lines by label and run; without points there is none."""
    found = {}
    for curve in curves:
        lines = {
            which: line
            for which, run in enumerate(runs)
            for line in curves_of([run], curve.side, curve.column)
        }
        if lines:
            found[curve.label] = lines
    return found


def curves_of_arms(arms: Mapping[str, Sequence[TrainingTable]]) -> Figure:
    """Draw how survivors rise with the robots' decisions, a line for each arm [E6].

    arms: the trainings of each; a line is the mean of their running means, and the
    legend has the order of their ends.
    """
    whole = page.sheet("Survivors in training, by arm", 11, 5.2)
    axes = whole.subplots()
    lines = {}
    for name, runs in arms.items():
        survivors = curves_of(runs, "robots", summaries.SURVIVAL, "step")
        if survivors:
            line = mean_curve([(x, smooth(x, y)) for x, y in survivors])
            if len(line[0]):  # its trainings overlap
                lines[name] = line

    axes.set_prop_cycle(LINE_STYLES)
    for name in sorted(lines, key=lambda name: -lines[name][1][-1]):
        axes.plot(*lines[name], lw=1.8, label=name)

    axes.grid(axis="y")
    axes.set(xlabel="decisions of the robots", ylabel=SURVIVORS, ylim=(0, 1))
    axes.xaxis.set_major_formatter(_in_thousands)
    axes.set_xlim(left=0)
    if lines:
        whole.legend(loc="outside right center", handlelength=3.2)
    else:
        told = "the trainings are too short for curves"
        axes.text(0.5, 0.5, told, transform=axes.transAxes, ha="center")
    return whole
