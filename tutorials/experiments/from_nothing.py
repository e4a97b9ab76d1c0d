"""How long robots must learn: how many people they save, after so many decisions.

    python tutorials/experiments/from_nothing.py out/from_nothing

Robots as they were after 100,000, 200,000, 500,000 decisions and so on, before the
first and after the last meet five fires; so do nobody and three guides, on the same
evacuations, the contest's. Runs are kept in DIR/from_nothing: what was played there is
not played again. from_nothing.png has a logarithmic axis, and guides as lines.
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
from reference.workshop.drawing.page import legend, save, sheet
from reference.workshop.storage.files import write_json
from reference.workshop.storage.workers import workers
from reference.workshop.training.checkpoints import checkpoints_in, load_checkpoint

FIRES = ("none", "random", "busiest", "fixed", "closer")
GUIDES = {  # and their lines
    "none": ("tab:gray", ":"),
    "escort": ("black", "-"),
    "observer": ("tab:green", "--"),
    "guard": ("tab:orange", "-."),
}
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
    first = min(filter(None, steps_of.values()))
    for axes, fire in zip(panels, FIRES, strict=True):
        of_fire = {cell.robots: cell for cell in found if cell.fire == fire}
        for guide, (colour, line) in GUIDES.items():
            saved = 100 * of_fire[guide].survival[0]
            axes.axhline(saved, color=colour, ls=line, label=guide)

        # Zero has no place on this axis: who has learned nothing stands at its left.
        decisions = [steps or first / 2 for steps in steps_of.values()]
        means, lows, highs = zip(
            *(of_fire[name].survival for name in steps_of), strict=True
        )
        axes.fill_between(
            decisions, *(100 * np.array([lows, highs])), color="tab:blue", alpha=0.2
        )
        label = "robots from nothing"
        axes.plot(decisions, 100 * np.array(means), "o-", color="tab:blue", label=label)
        axes.set_xscale("log")
        axes.xaxis.set_major_formatter(lambda count, _: f"{count:,.0f}")
        axes.set_xlabel("decisions; left: none yet")
        axes.set_title(f"fire: {fire}", fontsize=10)
    panels[0].set_ylabel("people saved, per cent")
    legend(figure, panels[0].get_legend_handles_labels()[0])
    return figure


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
