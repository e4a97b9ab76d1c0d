"""A training by tenths: how its robots fare under five fires as they grow older.

    python tutorials/experiments/tenths.py out/paper --episodes 40

Each tenth's robots, and those that have learned nothing yet, meet four fires of rules
and the fire of their own age, on the contest's seeds; nobody and `escort` meet the same
four. Runs are kept in DIR/tenths: what was played there is not played again. tenths.png
shows the whole training: reward, entropy, survivors, difficulty h and score E, and as
the paper tells it, the reward by its E.
"""

import sys
from argparse import ArgumentParser
from dataclasses import replace
from pathlib import Path

from by_age import ages

from reference.evaluation.score import paper_ruler
from reference.workshop.commands.common import exit_status
from reference.workshop.commands.options import whole
from reference.workshop.comparing import begin_evaluation, cells, play_evaluation
from reference.workshop.comparing.results import cell_as_json, table
from reference.workshop.drawing.curves import PANELS, curves_of, read_summaries, smooth
from reference.workshop.drawing.page import legend, save, sheet
from reference.workshop.storage.files import write_json
from reference.workshop.storage.workers import workers
from reference.workshop.training.checkpoints import checkpoints_in, load_checkpoint

OWN = "of its age"
THROUGH = "100%, fire through"
FIRES = {
    "none": "tab:green",
    "random": "tab:olive",
    "busiest": "tab:purple",
    "fixed": "tab:brown",
    OWN: "tab:red",
}
ROBOTS = "tab:blue"
NOBODY = "none"
GUIDES = (NOBODY, "escort")  # they meet the fires of rules
SEED = 5000  # the contest's
REWARD = "reward of an episode, health points"
ENTROPY = "entropy of the policies, nats"
FIGURES = {
    "survival": "share of people who survive; dotted: with nobody",
    "difficulty": "difficulty h",
    "score": "score E, by the paper's ruler",
}


def checkpoints(training, tenths):
    """Find the checkpoint of each age: its path by its share of robots' decisions.

    Robots that are through are held while their fire goes on: then its end is one more.
    """
    paths = {age: path for path, age in ages(training, tenths).items()}
    there = [*map(str, checkpoints_in(training))]
    first = there[0]
    last = there[-1]
    if first.endswith("-000000.pt"):
        paths = {"0%": first} | paths
    if last not in paths.values():
        paths[THROUGH] = last
    return paths


def play(paths, folder, episodes, executor):
    """Let every age meet FIRES; yield runs in which players have an age for a name.

    paths: of checkpoints, by age
    """
    age_of = {path: age for age, path in paths.items()}
    rules = [fire for fire in FIRES if fire != OWN]
    by_rules = begin_evaluation([*GUIDES, *age_of], rules, seed=SEED, episodes=episodes)
    runs = list(play_evaluation(by_rules, folder / "rules", executor))
    for path in age_of:
        its_own = begin_evaluation([path], [path], seed=SEED, episodes=episodes)
        runs += play_evaluation(its_own, folder / Path(path).stem, executor)

    for run in runs:
        fire = OWN if run.fire in age_of else run.fire
        yield replace(run, robots=age_of.get(run.robots, run.robots), fire=fire)


def drawn(title, written, played, found):
    """Draw the whole training in six panels.

    written: its table;  played: episodes until each age, by its name;  found: cells
    """
    figure = sheet(title, 14, 8)
    earned, entropy, *of_ages, told = figure.subplots(2, 3).flat
    draw_written(earned, REWARD, written)
    draw_written(entropy, ENTROPY, written)
    draw_ages(of_ages, played, found)
    for axes in (earned, entropy, *of_ages):
        axes.set_xlabel("episodes, thousands")
    draw_worth(told, played, found)
    legend(figure, told.get_legend_handles_labels()[0], title="fire")
    return figure


def draw_written(axes, name, written):
    """Draw what the training wrote itself: a panel of its curves."""
    for source in PANELS[name]:
        colour = FIRES[OWN] if source.side == "fire" else ROBOTS
        for x, y in curves_of([written], source.side, source.column):
            axes.plot(x / 1000, smooth(x, y), color=colour, label=source.label)
    axes.set_title(name, fontsize=10)
    axes.legend()


def draw_ages(of_ages, played, found):
    """Draw what each age did under each fire: a figure a panel."""
    x = [episodes / 1000 for episodes in played.values()]
    for axes, (figure_of, name) in zip(of_ages, FIGURES.items(), strict=True):
        for fire, colour in FIRES.items():
            aged = of_ages_under(fire, played, found)
            y = [mean_of(cell, figure_of) for cell in aged]
            axes.plot(x, y, "o-", ms=3, color=colour, label=fire)
        axes.set_title(name, fontsize=10)
    for cell in found:
        if cell.robots == NOBODY:
            of_ages[0].axhline(cell.survival[0], color=FIRES[cell.fire], ls=":")


def draw_worth(told, played, found):
    """Draw as the paper tells it: what a reward is worth."""
    for fire, colour in FIRES.items():
        cells_of_fire = of_ages_under(fire, played, found)
        R = [mean_of(cell, "reward") for cell in cells_of_fire]
        E = [mean_of(cell, "score") for cell in cells_of_fire]
        told.plot(R, E, "o-", ms=3, color=colour, label=fire)
        told.plot(R[-1:], E[-1:], "o", ms=8, mfc="none", color=colour)
    told.set_title("E over reward; a ring: the end", fontsize=10)
    told.set_xlabel("reward of an episode")


def of_ages_under(fire, played, found):
    """Cells of the robots of every age under a fire, youngest first."""
    return [cell for cell in found if cell.fire == fire and cell.robots in played]


def mean_of(cell, figure):
    """The mean of a figure; nan where there is none."""
    interval = getattr(cell, figure)
    return interval[0] if interval else float("nan")


def main():
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("training", type=Path, help="its folder")
    parser.add_argument("--tenths", type=whole(1), default=10, help="how many ages")
    parser.add_argument("--episodes", type=whole(1), default=40, help="of each match")
    parser.add_argument("--workers", type=whole(0), default=2)
    parser.add_argument("--picture", type=Path, help="DIR/tenths/tenths.png")
    asked = parser.parse_args()
    folder = asked.training / "tenths"
    paths = checkpoints(asked.training, asked.tenths)

    with workers(asked.workers) as executor:
        runs = list(play(paths, folder, asked.episodes, executor))
    found = cells(runs, paper_ruler(), baseline=NOBODY)
    figures = ["survival", "gain", "reward", "difficulty", "score"]
    print(table(found, figures))
    write_json(folder / "tenths.json", {"cells": [cell_as_json(c) for c in found]})

    played = {
        age: load_checkpoint(path).progress["episodes"] for age, path in paths.items()
    }
    written = read_summaries(asked.training)
    figure = drawn(f"A training by tenths: {asked.training}", written, played, found)
    save(figure, asked.picture or folder / "tenths.png")


if __name__ == "__main__":
    sys.exit(exit_status(main))
