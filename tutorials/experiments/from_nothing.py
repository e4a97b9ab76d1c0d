"""How long robots must learn: how many people they save, after so many decisions.

    python tutorials/experiments/from_nothing.py out/from_nothing

Robots as they were after 100,000, 200,000, 500,000 decisions and so on, before the
first and after the last meet five fires; so do nobody and three guides, on the same
evacuations, the contest's. Runs are kept in DIR/from_nothing: what was played there is
not played again; from_nothing.json there has every cell.

from_nothing.png has a logarithmic axis, a line for each training, and guides as level
lines. Robots that have decided nothing stand left of the axis's break. Tables that are
kept are drawn as well:

    python tutorials/experiments/from_nothing.py --picture from_nothing.png \
        tutorials/tables/from_nothing.json tutorials/tables/from_nothing_again.json
"""

import sys
from argparse import ArgumentParser
from dataclasses import replace
from pathlib import Path

import numpy as np
from kept_rows import kept_cells

from reference.paper import InputError
from reference.workshop.commands.common import exit_status
from reference.workshop.commands.options import whole
from reference.workshop.comparing import begin_evaluation, cells, play_evaluation
from reference.workshop.comparing.results import cell_as_json, table
from reference.workshop.drawing.colours import lines_of
from reference.workshop.drawing.evacuation import INK
from reference.workshop.drawing.page import FAINT, legend, save, sheet
from reference.workshop.storage.files import write_json
from reference.workshop.storage.workers import workers
from reference.workshop.training.checkpoints import checkpoints_in, load_checkpoint

FIRES = ("none", "random", "busiest", "fixed", "closer")
GUIDES = ("none", "escort", "observer", "guard")
LEARNED = "robots from nothing"
STROKES = ("-", "--", ":")  # of the first, second and third training
MARKERS = ("o", "s", "^")
BASELINE = "escort"
SEED = 5000  # the contest's
MILLION = 1_000_000
LEADING = (1, 2, 5)  # digits of the numbers of decisions that are shown


def checkpoints(training):
    """Find checkpoints by their robots' decisions: none, 1, 2 and 5 of a power, all.

    Returns paths by decisions, fewest first. Raises InputError where robots did not
    learn.
    """
    paths = {}
    for path in checkpoints_in(training):
        learners = load_checkpoint(path).learners
        if "robots" in learners:
            paths.setdefault(learners["robots"]["steps"], str(path))
    if not paths or max(paths) == 0:
        raise InputError(f"{training}: no robots have learned here.")
    last = max(paths)
    goals = [digit * 10**power for power in range(len(str(last))) for digit in LEADING]

    # A round ends after its goal, so it is the first checkpoint beyond; 5 % are near.
    shown = {0, last}
    for goal in goals:
        near = [steps for steps in paths if goal <= steps <= 1.05 * goal]
        shown.update(near[:1])
    return {steps: path for steps, path in sorted(paths.items()) if steps in shown}


def drawn(tables):
    """Draw people saved over decisions, a panel for each fire.

    tables: cells of each training; those of guides are taken from the first
    """
    title = "Robots that learn from nothing, with 95 % intervals over evacuations"
    figure = sheet(title, 15, 4.2)
    panels = figure.subplots(1, len(FIRES), sharey=True)
    counts = sorted({n for found in tables for n in decisions_in(found).values() if n})
    zero = counts[0] / 2.5  # has no place on this axis: left of its break
    for axes, fire in zip(panels, FIRES, strict=True):
        of_guides = {c.robots: c for c in tables[0] if c.fire == fire}
        for guide, line in lines_of(GUIDES).items():
            axes.axhline(100 * of_guides[guide].survival[0], label=guide, **line)
        for number, found in enumerate(tables):
            of_fire = [cell for cell in found if cell.fire == fire]
            _add_training(axes, of_fire, zero, number)
        _break_axis(axes, zero, counts)
        axes.set_title(f"fire: {fire}", fontsize=10)
    panels[0].set_ylabel("people saved, per cent")
    legend(figure, panels[0].get_legend_handles_labels()[0], handlelength=3.6)
    return figure


def _add_training(axes, of_fire, zero, number):
    """Add a line with its intervals, of robots by their decisions under one fire."""
    label = LEARNED if number == 0 else f"the same, training {number + 1}"
    look = {"color": INK, "ls": STROKES[number % 3], "marker": MARKERS[number % 3]}
    steps_of = decisions_in(of_fire)
    told = {
        steps_of[cell.robots]: 100 * np.array(cell.survival)
        for cell in of_fire
        if cell.robots in steps_of
    }
    decisions = [steps for steps in sorted(told) if steps]
    mean, low, high = np.transpose([told[steps] for steps in decisions])
    axes.plot(decisions, mean, label=label, ms=5, zorder=4, **look)
    axes.fill_between(decisions, low, high, color=INK, alpha=0.15, lw=0)
    if 0 in told:
        mean, low, high = told[0]
        spread = [[mean - low], [high - mean]]
        axes.errorbar(zero, mean, spread, ms=5, color=INK, marker=look["marker"])


def decisions_in(found):
    """How many decisions each team that learned has made, by its name: "100,214"."""
    names = {cell.robots for cell in found} - {*GUIDES}
    return {name: int(name.replace(",", "")) for name in names}


def _break_axis(axes, zero, decisions):
    """Make a logarithmic axis of decisions, with a place for none left of a break."""
    first, last = decisions[0], decisions[-1]
    powers = 10.0 ** np.arange(np.floor(np.log10(first)), np.ceil(np.log10(last)))
    between = np.outer(powers, range(1, 10)).ravel()
    axes.set_xscale("log")
    marked = [power for power in powers if power >= 0.9 * first]
    labels = [f"{power / MILLION:g}" for power in marked]
    axes.set_xticks([zero, *marked], ["0", *labels])
    shown = [count for count in between if 0.9 * first < count < 1.1 * last]
    axes.set_xticks(shown, [""] * len(shown), minor=True)
    axes.set_xlabel("million decisions")

    # Two strokes, and no axis between them.
    ends = np.sqrt(zero * first) * np.array([0.93, 1.07])
    on_axis = {"transform": axes.get_xaxis_transform(), "clip_on": False, "zorder": 5}
    axes.plot(ends, [0, 0], color="white", lw=3, solid_capstyle="butt", **on_axis)
    stroke = {"marker": [(-0.4, -1), (0.4, 1)], "ms": 10, "mec": FAINT, "ls": ""}
    axes.plot(ends, [0, 0], **stroke, **on_axis)


def evaluated(training, episodes, executor):
    """Let robots of all ages of a training, and guides, play; return their cells."""
    name_of = {path: f"{steps:,}" for steps, path in checkpoints(training).items()}
    robots = [*GUIDES, *name_of]
    folder = training / "from_nothing"
    evaluation = begin_evaluation(robots, FIRES, seed=SEED, episodes=episodes)
    played = [
        replace(run, robots=name_of.get(run.robots, run.robots))
        for run in play_evaluation(evaluation, folder, executor)
    ]
    found = cells(played, None, baseline=BASELINE)
    print(table(found, ["survival", "gain"]))
    listed = [cell_as_json(cell) for cell in found]
    write_json(folder / "from_nothing.json", {"cells": listed})
    return found


def main():
    parser = ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("trainings", nargs="+", type=Path, help="folders, or tables")
    parser.add_argument("--episodes", type=whole(2), default=100, help="of each match")
    parser.add_argument("--workers", type=whole(0), default=2)
    parser.add_argument("--picture", type=Path, help="instead of in DIR/from_nothing")
    asked = parser.parse_args()
    first = asked.trainings[0]
    if first.is_file() and asked.picture is None:
        parser.error("--picture: say where tables are drawn")
    with workers(asked.workers) as executor:
        tables = [
            kept_cells(path)
            if path.is_file()
            else evaluated(path, asked.episodes, executor)
            for path in asked.trainings
        ]
    picture = asked.picture or first / "from_nothing" / "from_nothing.png"
    print(save(drawn(tables), picture))


if __name__ == "__main__":
    sys.exit(exit_status(main))
