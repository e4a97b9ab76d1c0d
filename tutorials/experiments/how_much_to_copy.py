"""How much must a copy of a guide have seen, and how large must it be?

    python tutorials/experiments/how_much_to_copy.py

Copies of `guard` as copy_guard.yaml makes them, of 240 to 3,840 evacuations, and with
32 to 256 hidden units.  All play the contest's evacuations under five fires beside
their teacher.  In further ones the teacher is asked at each decision of a copy where it
would send the robot: they agree if both places are as near each other as what still
counts as the same anchor.  Whatever is finished is kept; the same command goes on.  It
takes some three hours of a core.  1,920 evacuations need 7 GB of memory, 3,840 twice
as much.

Said before looking, as of every copy: it is to be within 1 point of its teacher under
every fire.
"""

import json
import sys
from argparse import ArgumentParser
from itertools import product
from pathlib import Path
from typing import NamedTuple

import numpy as np
from evacuations import played
from how_many_buildings import finish_training, until_stopped

from reference import Scenario, load
from reference.robots import actual_target
from reference.workshop.commands.options import whole
from reference.workshop.comparing import begin_evaluation, cells, play_evaluation
from reference.workshop.comparing.buildings import in_percent
from reference.workshop.comparing.intervals import format_interval
from reference.workshop.comparing.named import strategy_named
from reference.workshop.comparing.results import align_columns, cell_as_json
from reference.workshop.drawing.colours import colour_of
from reference.workshop.drawing.page import legend, save, sheet
from reference.workshop.engine import make_ready
from reference.workshop.storage.files import make_folder, read_json, write_json
from reference.workshop.storage.workers import map_as_done, workers
from reference.workshop.strategies.guides import GROUP_RADIUS

TEACHER = "guard"
FIRES = ("none", "random", "busiest", "fixed", "closer")
SEED = 5000  # the contest's
ASKED_FROM = 120_000  # seeds of evacuations in which the teacher is asked
EVACUATIONS = (240, 480, 960, 1920, 3840)
UNITS = (32, 64, 128, 256)
TRAINING_FIRES = ("random", "fixed", "busiest", "fixed", "closer", "none")
ROUNDS = 2  # of DAgger
TITLES = {"evacuations": "evacuations copied", "units": "hidden units"}


class Copy(NamedTuple):
    """How many evacuations a copy has seen, and its network's hidden units."""

    evacuations: int = 1920
    units: int = 128

    @property
    def name(self):
        """Of its folder."""
        return f"{self.evacuations}-{self.units}"


def copies(evacuations, units):
    """List copies of so many evacuations, and of so many units; the cheapest first."""
    of_usual = [Copy(evacuations=number) for number in evacuations]
    made = {*of_usual, *(Copy(units=number) for number in units)}
    return sorted(made, key=lambda copy: copy.evacuations * copy.units)


def make(out, copy, workers_of_it):
    """Make a copy as copy_guard.yaml does, or go on; return its folder."""
    rows = {
        "imitation_rounds": ROUNDS,
        "imitation_episodes": copy.evacuations // ROUNDS,
        "imitation_epochs": 8,
        "jobs_per_round": 8,
        "episodes_per_job": 8,
        "critic_rounds": 0,
        "Robot": {
            "head": "set",
            "hidden_units": copy.units,
            "spread": 0.2,
            "learning_rate": 3e-4,
            "batch_size": 1024,
            "max_steps": 500,
        },
    }
    settings = out / f"{copy.name}.yaml"
    settings.write_text(json.dumps({"reference": rows}), encoding="utf-8")
    begin = ["--imitate", TEACHER, "--seed", "0", "--fire", *TRAINING_FIRES]
    begin += ["--settings", str(settings)]
    finish_training(out / copy.name, begin, workers_of_it)
    return out / copy.name


# -- How often they agree -----------------------------------------------------------


class Asked:
    """A team that asks a teacher at each decision, and does as it likes itself.

    decisions, agreed: how many there were, and in how many both meant one place
    """

    def __init__(self, own, teacher):
        self.own = own
        self.teacher = teacher
        self.decisions = 0
        self.agreed = 0

    def decide(self, world, robots, rng):
        mine = self.own.decide(world, robots, rng)
        theirs = self.teacher.decide(world, robots, rng)
        for robot, own, other in zip(robots, mine, theirs, strict=True):
            apart = aim(world, robot, own) - aim(world, robot, other)
            self.decisions += 1
            self.agreed += bool(np.hypot(*apart) <= GROUP_RADIUS)
        return mine


def aim(world, robot, goal):
    """Where a decision sends a robot, (2,) metres; without one, where it goes or is."""
    if goal is not None:
        return np.array(actual_target(world.building, robot.floor, *goal))
    if robot.destination is not None and robot.way:
        return robot.destination
    return robot.position


def agreement(job):
    """Per cent of a copy's decisions in which its teacher means the same place.

    job: the copy's checkpoint or folder, a fire and seeds
    """
    word, fire, seeds = job
    own = strategy_named(word, "robots").playing_in(load("paper"), Scenario())
    team = Asked(own, strategy_named(TEACHER, "robots"))
    runs = played(team, strategy_named(fire, "fire"), seeds)
    teams = [run.robot_strategy for run in runs]
    return 100 * sum(t.agreed for t in teams) / sum(t.decisions for t in teams)


def agreements(out, made, episodes, executor):
    """Per cent by copy and fire; what is known already is not played again."""
    path = out / "agreement.json"
    known = read_json(path) if path.exists() else {}
    seeds = range(ASKED_FROM, ASKED_FROM + episodes)
    left = {
        f"{copy.name} {fire} {episodes}": (str(folder), fire, seeds)
        for (copy, folder), fire in product(made.items(), FIRES)
    }
    names = [name for name in left if name not in known]
    for k, found in map_as_done(executor, agreement, [left[name] for name in names]):
        known[names[k]] = found
        write_json(path, known)
    return {
        (copy, fire): known[f"{copy.name} {fire} {episodes}"]
        for copy, fire in product(made, FIRES)
    }


# -- What came ----------------------------------------------------------------------


def drawn(found, agreed):
    """Draw points less than the teacher, and agreement, by data and by size.

    found: cells by copy and fire;  agreed: per cent by copy and fire
    """
    columns = {
        title: (name, made)
        for name, title in TITLES.items()
        if (made := varying(name, {copy for copy, _ in found}))
    }
    figure = sheet(f"Copies of {TEACHER}: how much they saw, how large they are", 11, 7)
    panels = figure.subplots(2, len(columns), sharey="row", squeeze=False)
    for (title, (name, made)), (above, below) in zip(
        columns.items(), panels.T, strict=True
    ):
        x = [getattr(copy, name) for copy in made]
        for fire in FIRES:
            look = {"color": colour_of(fire), "marker": "o"}
            gains = 100 * np.array([found[copy, fire].gain for copy in made])
            mean, low, high = gains.T
            label = "no fire" if fire == "none" else f"fire {fire}"
            above.plot(x, mean, label=label, **look)
            above.fill_between(x, low, high, color=look["color"], alpha=0.12, lw=0)
            below.plot(x, [agreed[copy, fire] for copy in made], **look)
        above.axhline(0, color="0.4", lw=1)
        for axes in (above, below):
            axes.set_xscale("log")
            axes.set_xticks(x, [f"{number:,}" for number in x])
            axes.minorticks_off()
            axes.set_xlabel(title)
    panels[0, 0].set_ylabel(f"survivors less {TEACHER}'s, points")
    panels[1, 0].set_ylabel("decisions that agree, per cent")
    legend(figure, panels[0, 0].get_legend_handles_labels()[0], handlelength=3.6)
    return figure


def varying(name, made):
    """List copies that differ from the usual one in a field at most, by that field."""
    usual = Copy()
    alike = [c for c in made if c._replace(**{name: getattr(usual, name)}) == usual]
    return sorted(alike, key=lambda copy: getattr(copy, name))


def rows_of(found, agreed):
    """A line for each copy: points less than its teacher under each fire; agreement."""
    rows = [["evacuations", "units", *FIRES, "agree, %"]]
    for copy in dict.fromkeys(copy for copy, _ in found):
        less = []
        for fire in FIRES:
            points = in_percent(found[copy, fire].gain)
            less.append(format_interval(points, 1, ends=True))
        mean = np.mean([agreed[copy, fire] for fire in FIRES])
        numbers = [f"{copy.evacuations:,}", str(copy.units)]
        rows.append([*numbers, *less, f"{mean:.1f}"])
    return align_columns(rows, ">" * len(rows[0]))


def main():
    parser = ArgumentParser(description="How much must a copy have seen?")
    add = parser.add_argument
    add("--evacuations", type=whole(1), nargs="+", default=EVACUATIONS, help="copied")
    add("--units", type=whole(8), nargs="*", default=UNITS, help="hidden units")
    add("--episodes", type=whole(1), default=200, help="of each copy and fire; 200")
    add("--asked", type=whole(1), default=20, help="in which the teacher is asked; 20")
    add("--out", type=Path, default=Path("out/to_copy"), help="out/to_copy")
    add("--workers", type=whole(0), default=2, help="processes; 0: this one; 2")
    add("--picture", type=Path, help="OUT/copies.png")
    asked = parser.parse_args()

    make_folder(asked.out)
    make_ready()
    made = {
        copy: make(asked.out, copy, asked.workers)
        for copy in copies(asked.evacuations, asked.units)
    }
    with workers(asked.workers) as executor:
        copy_of = {str(folder): copy for copy, folder in made.items()}
        evaluation = begin_evaluation(
            [TEACHER, *copy_of], FIRES, seed=SEED, episodes=asked.episodes
        )
        runs = play_evaluation(evaluation, asked.out / "runs", executor)
        agreed = agreements(asked.out, made, asked.asked, executor)
    of_copies = [
        cell for cell in cells(runs, None, baseline=TEACHER) if cell.robots in copy_of
    ]
    found = {(copy_of[cell.robots], cell.fire): cell for cell in of_copies}
    listed = [
        {**copy._asdict(), "agreement": agreed[copy, fire], **cell_as_json(cell)}
        for (copy, fire), cell in found.items()
    ]
    write_json(asked.out / "to_copy.json", {"teacher": TEACHER, "cells": listed})
    print(rows_of(found, agreed))
    print(save(drawn(found, agreed), asked.picture or asked.out / "copies.png"))


if __name__ == "__main__":
    sys.exit(until_stopped(main))
