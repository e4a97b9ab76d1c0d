"""The page of an experiment: a table, a picture, and what the intervals say.

Clauses: F12.  The unit is the training: intervals are of interquartile means over an
arm's trainings, see `of_trainings`.  Robots written by hand count as one training.

    T  trainings of an arm;  N  evacuations, each from a seed of its own
"""

from collections.abc import Iterable, Iterator, Mapping
from typing import Any

import numpy as np

import reference
from reference.building import building_of
from reference.workshop.crossplay.contestants import WORST
from reference.workshop.crossplay.intervals import Interval, of_trainings
from reference.workshop.crossplay.results import Cell, table
from reference.workshop.crossplay.runs import RunResult
from reference.workshop.experiment.design import FIXED, Experiment
from reference.workshop.experiment.jobs import arm_of
from reference.workshop.training.shipping import TRAINERS

OWN = "own fire"  # the one that a team has learned with
ENOUGH = 5  # trainings of an arm; with fewer a result is preliminary
SHOWN = ("survival", "reward", "difficulty")
OVER = (
    "interquartile means over an arm's trainings, with 95 % bootstrap intervals over "
    "trainings and evacuations; robots written by hand count as one training"
)


class Results:
    """Tests by row (an arm, or robots written by hand) and column (a kind of fire).

    runs  by row and column, all that were played
    """

    def __init__(self, experiment: Experiment, found: Iterable[RunResult]):
        self.experiment = experiment
        self.runs: dict[tuple[str, str], list[RunResult]] = {}
        for run in found:
            place = arm_of(run.robots), self._column(run)
            self.runs.setdefault(place, []).append(run)

    def _column(self, run: RunResult) -> str:
        """Name a fire's kind, or tell whether it learned with these robots."""
        if run.fire in (*FIXED, WORST):
            return run.fire
        return OWN if run.fire == run.robots else f"{arm_of(run.fire)}'s fires"

    @property
    def columns(self) -> list[str]:
        """Fires that were met; a team's own comes last."""
        return sorted(dict.fromkeys(column for _, column in self.runs), key=OWN.__eq__)

    def values(self, row: str, column: str, figure: str) -> np.ndarray:
        """Collect a figure of a row's trainings: (T, N), means over several fires."""
        found: dict[str, dict[int, list[float]]] = {}
        for run in self.runs[row, column]:
            of_training = found.setdefault(run.robots, {})
            of_training.setdefault(run.seed, []).append(getattr(run, figure))
        return np.array(
            [[np.mean(of[seed]) for seed in sorted(of)] for of in found.values()]
        )

    def cells(self) -> list[Cell]:
        """List the matrix, row by row."""
        rows = dict.fromkeys(row for row, _ in self.runs)
        places = [(row, column) for row in rows for column in self.columns]
        return [self._cell(*place) for place in places if place in self.runs]

    def _cell(self, row: str, column: str) -> Cell:
        none: dict[str, Any] = dict.fromkeys(Cell.__dataclass_fields__)
        shown = {name: of_trainings(self.values(row, column, name)) for name in SHOWN}
        named = {"robots": row, "fire": column, "n": len(self.runs[row, column])}
        return Cell(**none | named | shown)

    def more_saved(self, one: str, other: str, column: str) -> Interval | None:
        """Estimate survivors of `one` less `other`, same seeds; None without runs."""
        if not {(one, column), (other, column)} <= self.runs.keys():
            return None
        both = (self.values(row, column, "survival") for row in (one, other))
        return of_trainings(*both)


def page(results: Results, matrix: str, curves: str) -> str:
    """Write the page in Markdown; matrix, curves: the paths of its pictures."""
    return (
        f"# {results.experiment.question}\n\n{answer(results)}\n\n"
        f"## What was done\n\n{set_up(results.experiment)}\n\n"
        f"## Who beats whom\n\n![Survivors of all arms under all fires]({matrix})\n\n"
        f"```\n{table(results.cells(), SHOWN)}\n```\n\nFigures: {OVER}.\n\n"
        f"## How they learned\n\n![Survivors in training]({curves})\n"
    )


def answer(results: Results) -> str:
    """Say what intervals say about each pair, with a caution about few trainings."""
    trainings, lines = len(results.experiment.seeds), list(_differences(results))
    told = "Survivors, percentage points, on the same seeds:" if lines else ""
    if trainings < ENOUGH:
        lines.append(
            f"This is preliminary, trainings of an arm: {trainings}. So intervals are "
            "too narrow (of three they hold the truth in some 74 of 100 experiments)."
        )
    return "\n".join([told, "", *(f"* {line}" for line in lines)]).strip()


def _differences(results: Results) -> Iterator[str]:
    """How many more the first of each pair saves than the second."""
    for one, other in results.experiment.compare:
        for column in results.columns:
            if more := results.more_saved(one, other, column):
                mean, low, high = (100 * value for value in more)
                saves = f"`{one if low > 0 else other}` saves more"
                said = "they cannot be told apart" if low <= 0 <= high else saves
                points = f"{mean:.1f} [{low:.1f}, {high:.1f}]"
                yield f"`{one}` less `{other}` under {column}: {points}: {said}."


def set_up(experiment: Experiment) -> str:
    """Describe the experiment in a paragraph."""
    arms = "; ".join(f"`{name}`: {_arm(experiment, name)}" for name in experiment.arms)
    arena, test = experiment.arena, experiment.test
    return (
        f"{building_of(arena.plan).title}, people: {arena.people}, preset "
        f"`{experiment.preset}` of version {reference.__version__}"
        f"{_changes(experiment.settings)}. Decisions of the robots in every training: "
        f"{experiment.decisions:,}; seeds: {', '.join(map(str, experiment.seeds))}. "
        f"{arms}. Tests: likeliest actions, evacuations of each team against each "
        f"fire: {test.episodes}, from seed {test.seed:,} on."
    )


def _arm(experiment: Experiment, name: str) -> str:
    settings, fire = experiment.arm(name)
    rows = {k: v for k, v in experiment.arms[name].items() if (k, v) != ("fire", fire)}
    whom = "a fire that learns" if fire is None else f"the fire `{fire}`"
    return f"{TRAINERS[settings.robots.trainer_type]} against {whom}{_changes(rows)}"


def _changes(rows: Mapping[str, Any]) -> str:
    """Rows that differ from the preset's, as the file has them."""
    told = (f"`{name} = {value}`" for name, value in _flat(rows))
    return f" with {', '.join(told)}" if rows else ""


def _flat(rows: Mapping[str, Any], over: str = "") -> Iterator[tuple[str, Any]]:
    """Nested rows by their dotted names."""
    for name, value in rows.items():
        if isinstance(value, Mapping):
            yield from _flat(value, f"{over}{name}.")
        else:
            yield over + name, value
