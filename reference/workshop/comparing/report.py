"""The page of an experiment: a table, a picture, and what the intervals say.

The unit is the training: intervals are of interquartile means over an arm's trainings,
see `interval_over_trainings` [F12, chosen].  Robots written by hand count as one.

    T  trainings of an arm;  N  evacuations, each from a seed of its own
"""

import json
from collections.abc import Iterable, Iterator
from dataclasses import asdict
from itertools import product
from textwrap import indent
from typing import Any

import numpy as np

import reference
from reference.workshop.comparing.buildings import in_percent
from reference.workshop.comparing.design import FIXED_FIRES, Experiment, arm_of
from reference.workshop.comparing.intervals import (
    format_interval,
    interval_over_trainings,
)
from reference.workshop.comparing.named import WORST, title_of
from reference.workshop.comparing.results import Cell, table
from reference.workshop.comparing.runs import RunResult
from reference.workshop.strategies import ANY_MAP, LEARNED
from reference.workshop.strategies.own import is_code

OWN_FIRE = "own fire"  # the one of the same training
ENOUGH_TRAININGS = 5  # trainings of an arm; with fewer a result is preliminary
SHOWN = ("survival", "reward", "difficulty")
INTERVALS_NOTE = (
    "interquartile means over an arm's trainings, with 95 % bootstrap intervals over "
    "trainings and evacuations; robots written by hand count as one training; fires of "
    "an arm are averaged, so intervals do not cover other fires; its own trainings do "
    "not meet their own there, so they meet one fewer than others do"
)


def column_of(run: RunResult) -> str:
    """Name the column of a run: its fire, or the fires of an arm."""
    if run.fire in (*FIXED_FIRES, WORST) or is_code(run.fire):
        return run.fire
    if run.fire == run.robots:
        return OWN_FIRE
    return f"{arm_of(run.fire)}'s fires"


class Results:
    """Tests by row (an arm, or robots written by hand) and column (a kind of fire)."""

    def __init__(self, experiment: Experiment, results: Iterable[RunResult]):
        self.experiment = experiment
        self.runs: dict[tuple[str, str], list[RunResult]] = {}
        for run in results:
            cell = (arm_of(run.robots), column_of(run))
            self.runs.setdefault(cell, []).append(run)
        columns = dict.fromkeys(column for _, column in self.runs)
        # own last
        self.columns = sorted(columns, key=lambda column: column == OWN_FIRE)

    def values(self, row: str, column: str, figure: str) -> np.ndarray:
        """Collect a figure of a row's trainings: (T, N), means over several fires."""
        trainings: dict[str, dict[int, list[float]]] = {}
        for run in self.runs[row, column]:
            by_seed = trainings.setdefault(run.robots, {})
            by_seed.setdefault(run.seed, []).append(getattr(run, figure))
        means = [
            [np.mean(by_seed[seed]) for seed in sorted(by_seed)]
            for by_seed in trainings.values()
        ]
        return np.array(means)

    def cells(self) -> list[Cell]:
        """List the matrix, row by row."""
        cells = []
        rows = dict.fromkeys(row for row, _ in self.runs)
        for row, column in product(rows, self.columns):
            runs = self.runs.get((row, column))
            if runs:
                figures: dict[str, Any] = {
                    name: interval_over_trainings(self.values(row, column, name))
                    for name in SHOWN
                }
                cells.append(Cell(robots=row, fire=column, n=len(runs), **figures))
        return cells

    def fewest_trainings(self, cells: Iterable[tuple[str, str]]) -> int | None:
        """Count the trainings of the arm that has fewest; None where nobody learned.

        cells: rows and columns; robots written by hand do not count, fires that learned
        do
        """
        trainings: dict[str, set[str]] = {}
        for row, column in cells:
            for run in self.runs[row, column]:
                for who in (run.robots, run.fire):
                    if arm_of(who) in self.experiment.arms:
                        trainings.setdefault(arm_of(who), set()).add(who)
        return min(map(len, trainings.values()), default=None)

    def answer(self) -> str:
        """Say what intervals say about each pair; caution about few trainings."""
        trainings = self.fewest_trainings(self.runs)
        lines = list(self._differences())
        told = "Survivors, percentage points, on the same seeds:" if lines else ""
        if trainings is not None and trainings < ENOUGH_TRAININGS:
            lines.append(
                f"This is preliminary, trainings of an arm: {trainings}. So intervals "
                "are too narrow (of three they hold the truth in some 74 of 100 "
                "experiments)."
            )
        return "\n".join([told, "", *(f"* {line}" for line in lines)]).strip()

    def _differences(self) -> Iterator[str]:
        """How many more the first of each pair saves than the second.

        Not under their own fires: there each meets another.
        """
        columns = [column for column in self.columns if column != OWN_FIRE]
        for (one, other), column in product(self.experiment.compare, columns):
            cells = [(one, column), (other, column)]
            if {*cells} <= self.runs.keys():
                both = (self.values(*cell, "survival") for cell in cells)
                less = in_percent(interval_over_trainings(*both))
                points = format_interval(less, 1, ends=True)
                if self.fewest_trainings(cells) == 1:
                    said = "one training tells nothing of others"
                elif less.low > 0:
                    said = f"`{one}` saves more"
                elif less.high < 0:
                    said = f"`{other}` saves more"
                else:
                    said = "they cannot be told apart"
                yield f"`{one}` less `{other}` under {column}: {points}: {said}."


def about_tests(experiment: Experiment) -> str:
    """Say where the tests are, and if the network for any map plays there."""
    arena = experiment.arena
    told = arena.about()
    if LEARNED in (*experiment.test.robots, *experiment.test.fires):
        title = title_of(LEARNED, arena.drawn, arena.scenario)
        if title == ANY_MAP:
            told += f"; {title}"
    return told


def report_page(results: Results, matrix: str, curves: str) -> str:
    """Write the page in Markdown; matrix, curves: the paths of its pictures."""
    experiment = results.experiment
    rows = [f"{name} = {json.dumps(v)}" for name, v in asdict(experiment).items()]
    design = indent("\n".join(rows), "    ")
    return (
        f"# {experiment.question}\n\n{results.answer()}\n\n"
        f"## What was done\n\n{about_tests(experiment)}, version "
        f"{reference.__version__}; the file's rows, and the defaults of the others:\n\n"
        f"{design}\n\n"
        f"## Who beats whom\n\n![Survivors of all arms under all fires]({matrix})\n\n"
        f"```\n{table(results.cells(), SHOWN)}\n```\n\nFigures: {INTERVALS_NOTE}.\n\n"
        f"## How they learned\n\n![Survivors in training]({curves})\n"
    )
