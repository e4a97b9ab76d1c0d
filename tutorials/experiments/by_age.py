"""An arms race by age: robots of each tenth of a training meet fires of each tenth.

    python tutorials/experiments/by_age.py out/league

Above the diagonal robots meet fires of their future, below it those of their past. Runs
are kept in DIR/by_age: what was played there is not played again. A second table tells
what both sides learned from the first age and the middle one to the end. Three ages of
robots and fire play the same seed in one film, by_age.html.
"""

import sys
from argparse import ArgumentParser
from dataclasses import replace
from pathlib import Path

import numpy as np

from reference import animate
from reference.paper import InputError
from reference.workshop.commands.common import exit_status
from reference.workshop.commands.options import whole
from reference.workshop.comparing import begin_evaluation, cells, play_evaluation
from reference.workshop.comparing.intervals import format_interval, interval_of_mean
from reference.workshop.comparing.results import align_columns, cell_as_json, table
from reference.workshop.drawing import crossplay, save
from reference.workshop.drawing.page import sheet
from reference.workshop.storage.files import write_json
from reference.workshop.storage.workers import workers
from reference.workshop.training.checkpoints import checkpoints_in, load_checkpoint


def ages(folder, tenths):
    """Find the checkpoint nearest to each tenth of the robots' decisions.

    Returns its age in per cent by its path. tenths: how many ages. Raises InputError
    where there is no checkpoint, or robots have not learned.
    """
    steps = {}
    for path in checkpoints_in(folder):
        learners = load_checkpoint(path).learners
        if "robots" not in learners:
            raise InputError(f"{folder}: its robots do not learn, so they have no age.")
        steps[path] = learners["robots"]["steps"]
    if not steps:
        raise InputError(f"{folder}: there is no checkpoint in this folder.")
    end = max(steps.values())
    if end == 0:
        raise InputError(f"{folder}: its robots have not learned yet. Let it go on.")
    found = {}
    for k in range(1, tenths + 1):
        goal = end * k / tenths
        path = min(steps, key=lambda path: abs(steps[path] - goal))
        found[str(path)] = f"{steps[path] / end:.0%}"
    return found


def what_was_learned(results, found):
    """Compare the end with the first age and the middle one, on the same evacuations.

    Returns rows: what is compared, against whom, points with their interval.
    """
    saved = {}
    for run in results:
        saved.setdefault((run.robots, run.fire), []).append(100 * run.survival)
    saved = {match: np.array(shares) for match, shares in saved.items()}
    names = list(found)
    end = names[-1]
    rows = []
    for age in (names[0], names[(len(names) - 1) // 2]):
        robots = saved[end, end] - saved[age, end]
        what = f"robots of the end less those of {found[age]}"
        rows.append([what, "the last fire", points(robots)])
        for who in (age, end):
            harm = saved[who, age] - saved[who, end]
            what = f"harm of the last fire less that of {found[age]}"
            rows.append([what, f"robots of {found[who]}", points(harm)])
    return rows


def points(less):
    """A mean over evacuations, with its interval."""
    return format_interval(interval_of_mean(less), 1, ends=True)


def drawn(matches):
    """Draw the mean survival of every match, in colours from the fewest to the most.

    matches: cells by age. Intervals stand in the table.
    """
    ages_of_robots = crossplay.players(matches, "robots")
    ages_of_fire = crossplay.players(matches, "fire")
    saved = {(cell.robots, cell.fire): 100 * cell.survival.mean for cell in matches}
    means = np.array([[saved[r, f] for f in ages_of_fire] for r in ages_of_robots])

    side = 2.5 + 0.6 * len(ages_of_fire)
    figure = sheet("Who survives, by the ages of robots and fire", side + 1, side)
    axes = figure.subplots()
    image = axes.imshow(means, crossplay.SURVIVAL_COLOURS, aspect="auto")
    for (row, column), mean in np.ndenumerate(means):
        axes.text(column, row, f"{mean:.1f}", ha="center", va="center", fontsize=10)
    axes.set_xticks(range(len(ages_of_fire)), ages_of_fire)
    axes.set_yticks(range(len(ages_of_robots)), ages_of_robots)
    axes.set(xlabel="age of the fire, share of the training")
    axes.set(ylabel="age of the robots, share of the training")
    label = "survivors, per cent, from the fewest to the most"
    figure.colorbar(image, label=label, aspect=40)
    return figure


def main():
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("training", type=Path, help="the folder of a league")
    parser.add_argument("--tenths", type=whole(1), default=10, help="how many ages")
    parser.add_argument("--episodes", type=whole(2), default=30, help="of each match")
    parser.add_argument("--workers", type=whole(0), default=2)
    parser.add_argument("--seed", type=whole(0), default=5000, help="of the film")
    asked = parser.parse_args()
    found = ages(asked.training, asked.tenths)
    names = list(found)
    folder = asked.training / "by_age"

    # Every age of robots meets every age of fire.
    evaluation = begin_evaluation(names, names, seed=5000, episodes=asked.episodes)
    with workers(asked.workers) as executor:
        results = play_evaluation(evaluation, folder, executor)
    matches = [
        replace(cell, robots=found[cell.robots], fire=found[cell.fire])
        for cell in cells(results, None)
    ]
    print(table(matches, ["survival"]))
    print(save(drawn(matches), folder / "by_age.png"))
    learned = what_was_learned(results, found)
    print(align_columns([["", "against", "points"], *learned], "<<>"))
    listed = [cell_as_json(cell) for cell in matches]
    write_json(folder / "by_age.json", {"cells": listed, "learned": learned})

    # The film shows the youngest, the middle and the oldest age.
    three = [names[0], names[(len(names) - 1) // 2], names[-1]]
    runs = evaluation.simulations([(name, name, asked.seed) for name in three])
    headings = [f"robots at {found[name]}\nand the fire of that age" for name in three]
    animate(runs, folder / "by_age.html", headings)


if __name__ == "__main__":
    sys.exit(exit_status(main))
