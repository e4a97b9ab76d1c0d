"""How long robots must learn: how many people they save, after so many decisions.

    python tutorials/experiments/from_nothing.py out/from_nothing

Robots as they were after 100,000, 200,000, 500,000 decisions and so on, before the
first and after the last meet five fires; so do nobody and three guides, on the same
evacuations, the contest's. Runs are kept in DIR/from_nothing: what was played there is
not played again. from_nothing.png has a logarithmic axis, and guides as lines. Robots
that have decided nothing stand left of the axis's break.
"""

import sys
from argparse import ArgumentParser
from dataclasses import replace
from pathlib import Path

import numpy as np

from reference.paper import InputError
from reference.workshop.commands.common import exit_status
from reference.workshop.commands.options import whole
from reference.workshop.comparing import begin_evaluation, cells, play_evaluation
from reference.workshop.comparing.results import cell_as_json, table
from reference.workshop.drawing.colours import lines_of
from reference.workshop.drawing.page import FAINT, legend, save, sheet
from reference.workshop.storage.files import write_json
from reference.workshop.storage.workers import workers
from reference.workshop.training.checkpoints import checkpoints_in, load_checkpoint

FIRES = ("none", "random", "busiest", "fixed", "closer")
GUIDES = ("none", "escort", "observer", "guard")
LEARNED = "robots from nothing"
BASELINE = "escort"
SEED = 5000  # the contest's
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


def drawn(steps_of, found):
    """Draw people saved over decisions, a panel for each fire.

    steps_of: decisions by the name of a team that learned;  found: cells
    """
    figure = sheet("Robots that learn from nothing, by their decisions", 15, 4.2)
    panels = figure.subplots(1, len(FIRES), sharey=True)
    *lines, own = lines_of([*GUIDES, LEARNED]).values()
    own |= {"ls": "-", "marker": "o"}
    decisions = np.array([steps for steps in steps_of.values() if steps])
    zero = decisions[0] / 2.5  # has no place on this axis: left of its break
    for axes, fire in zip(panels, FIRES, strict=True):
        of_fire = {cell.robots: cell for cell in found if cell.fire == fire}
        for guide, line in zip(GUIDES, lines, strict=True):
            axes.axhline(100 * of_fire[guide].survival[0], label=guide, **line)

        figures = {
            steps: 100 * np.array(of_fire[name].survival)
            for name, steps in steps_of.items()
        }
        mean, low, high = np.transpose([figures[steps] for steps in decisions])
        axes.plot(decisions, mean, label=LEARNED, **own)
        axes.fill_between(decisions, low, high, color=own["color"], alpha=0.2, lw=0)
        if 0 in figures:
            mean, low, high = figures[0]
            spread = [[mean - low], [high - mean]]
            axes.errorbar(zero, mean, spread, color=own["color"], marker="o")
        _break_axis(axes, zero, decisions)
        axes.set_title(f"fire: {fire}", fontsize=10)
    panels[0].set_ylabel("people saved, per cent")
    legend(figure, panels[0].get_legend_handles_labels()[0], handlelength=3.6)
    return figure


def _break_axis(axes, zero, decisions):
    """Make a logarithmic axis of decisions, with a place for none left of a break."""
    first, last = decisions[0], decisions[-1]
    powers = 10.0 ** np.arange(np.floor(np.log10(first)), np.ceil(np.log10(last)))
    between = np.outer(powers, range(1, 10)).ravel()
    axes.set_xscale("log")
    marked = [power for power in powers if power >= 0.9 * first]
    axes.set_xticks([zero, *marked], ["0", *(f"{power:,.0f}" for power in marked)])
    shown = [count for count in between if 0.9 * first < count < 1.1 * last]
    axes.set_xticks(shown, [""] * len(shown), minor=True)
    axes.set_xlabel("decisions")

    # Two strokes, and no axis between them.
    ends = np.sqrt(zero * first) * np.array([0.93, 1.07])
    on_axis = {"transform": axes.get_xaxis_transform(), "clip_on": False, "zorder": 5}
    axes.plot(ends, [0, 0], color="white", lw=3, solid_capstyle="butt", **on_axis)
    stroke = {"marker": [(-0.4, -1), (0.4, 1)], "ms": 10, "mec": FAINT, "ls": ""}
    axes.plot(ends, [0, 0], **stroke, **on_axis)


def main():
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("training", type=Path, help="its folder")
    parser.add_argument("--episodes", type=whole(1), default=100, help="of each match")
    parser.add_argument("--workers", type=whole(0), default=2)
    parser.add_argument("--picture", type=Path, help="instead of in DIR/from_nothing")
    asked = parser.parse_args()
    folder = asked.training / "from_nothing"
    paths = checkpoints(asked.training)
    name_of = {path: f"{steps:,}" for steps, path in paths.items()}

    robots = [*GUIDES, *name_of]
    evaluation = begin_evaluation(robots, FIRES, seed=SEED, episodes=asked.episodes)
    with workers(asked.workers) as executor:
        played = [
            replace(run, robots=name_of.get(run.robots, run.robots))
            for run in play_evaluation(evaluation, folder, executor)
        ]
    found = cells(played, None, baseline=BASELINE)
    print(table(found, ["survival", "gain"]))
    listed = [cell_as_json(cell) for cell in found]
    write_json(folder / "from_nothing.json", {"cells": listed})

    steps_of = {name_of[path]: steps for steps, path in paths.items()}
    figure = drawn(steps_of, found)
    print(save(figure, asked.picture or folder / "from_nothing.png"))


if __name__ == "__main__":
    sys.exit(exit_status(main))
