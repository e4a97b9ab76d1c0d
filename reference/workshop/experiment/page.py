"""The results page of an experiment: tables, pictures, and an answer made of numbers.

Clauses: F9, F12.  Every sentence that claims something follows from an interval: above
0, below 0, or around it.
"""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import reference
from reference.building import building_of
from reference.workshop.crossplay.intervals import Interval, of_trainings
from reference.workshop.crossplay.results import Cell, formatted, mean_and_interval
from reference.workshop.experiment.asked import BEST, LEARNS, Experiment
from reference.workshop.experiment.results import RANDOM, Results
from reference.workshop.runs import rows_of_both
from reference.workshop.training.shipping import TRAINERS

ENOUGH = 5  # trainings of an arm; with fewer a result is preliminary
OVER = (
    "interquartile means over an arm's trainings, with 95 % bootstrap intervals over "
    "trainings and evacuations; robots written by hand count as one training"
)
FIGURES = {"reward": "R", "difficulty": "h", "score": "E"}


def page(results: Results, pictures: Sequence[tuple[str, str]]) -> str:
    """Write the page in Markdown; pictures: what each shows, and its path."""
    experiment, cells = results.experiment, results.cells()
    fires = list(dict.fromkeys(cell.fire for cell in cells))
    parts = [
        f"# {experiment.question or 'An experiment'}",
        answer(results),
        "## What was done",
        set_up(experiment),
        "## Who beats whom",
        _matrix(cells, fires, ("survival",)),
        f"Survivors in per cent: {OVER}.",
        f"Reward R, difficulty h and score E, each of a training's means; E "
        f"{_by_which_ruler(results)}:",
        _matrix(cells, fires, tuple(FIGURES)),
        *_exploitability(results),
        *_differences(results, fires),
        *(f"![{told}]({path})\n\n*{told}*" for told, path in pictures),
        "## What would change our minds",
        _doubts(experiment),
    ]
    return "\n\n".join(parts) + "\n"


# -- The answer ---------------------------------------------------------------------


def answer(results: Results) -> str:
    """Answer in two sentences, with a caution about few trainings."""
    told, trainings = _robustness(results), len(results.experiment.seeds)
    if trainings < ENOUGH:
        told += (
            f" This is preliminary: {trainings} trainings an arm, and so intervals "
            "that are too narrow (of three they hold the truth in some 74 of 100 "
            "experiments)."
        )
    return told


def _robustness(results: Results) -> str:
    """Compare the first pair.

    A team that saves fewer under random fire has less to lose to another, and so is
    easily less exploitable; that alone is no robustness.
    """
    compare = results.experiment.compare
    if not compare or not set(compare[0]) <= set(results.exploitable):
        return (
            "No best responses were trained to two that are compared, so this says "
            "nothing about robustness."
        )
    one, other = compare[0]
    saved = results.more_saved(one, other, BEST)
    less = of_trainings(results.lost(other), results.lost(one))
    assert saved is not None
    better = verdict(saved, "it is better", "it is worse")
    exploitable = verdict(less, "it is less exploitable", "it is more exploitable")
    told = (
        f"Survivors under best responses, `{one}` less `{other}`: {points(saved)} "
        f"percentage points: {better}. What best responses cost compared with random "
        f"fire, `{other}` less `{one}`: {points(less)} points: {exploitable}."
    )
    there = results.more_saved(one, other, RANDOM)
    if there and there.high < 0 and saved.low <= 0 < less.low:
        told += (
            f" But under random fire, `{one}` less `{other}`: {points(there)} points: "
            "it has less to lose, and is not more robust."
        )
    return told


def verdict(interval: Interval, above: str, below: str) -> str:
    """What an interval says about a difference."""
    if interval.low > 0:
        return above
    return below if interval.high < 0 else "the two cannot be told apart"


def points(interval: Interval) -> str:
    """Format a difference of shares in percentage points."""
    mean, low, high = (100 * value for value in interval)
    return f"{mean:.1f} [{low:.1f}, {high:.1f}]"


# -- Parts --------------------------------------------------------------------------


def set_up(experiment: Experiment) -> str:
    """Describe the experiment in a paragraph."""
    arms = "; ".join(f"`{arm}`: {_arm(experiment, arm)}" for arm in experiment.arms)
    test, response = experiment.test, experiment.best_response
    told = (
        f"{building_of(experiment.arena.plan).title}, {experiment.arena.people} "
        f"people, preset `{experiment.preset}` of version {reference.__version__}"
        f"{_changes(experiment.settings)}. Every training has "
        f"{experiment.decisions:,} decisions of the robots; seeds "
        f"{', '.join(map(str, experiment.seeds))}. {arms}. Tests: likeliest actions, "
        f"{test.episodes} evacuations from seed {test.seed:,} on, the same for all."
    )
    if test.looking_ahead:
        told += f" The fire that looks ahead burns in {test.looking_ahead} of them."
    if response:
        told += (
            f" Best response: a new fire, trained for {response.decisions:,} decisions "
            "against the frozen team"
        )
        if response.initialize_from:
            told += f", which begins as `{response.initialize_from}`"
        if response.seeds > 1:
            told += f"; of {response.seeds} the strongest on {len(experiment.choices)} "
            told += "other seeds"
        told += "."
    return told


def _arm(experiment: Experiment, arm: str) -> str:
    """An arm in words."""
    settings, fire, imitate, _ = experiment.of_arm(arm)
    trainer = TRAINERS[settings.robots.trainer_type]
    named = (("fire", fire), ("imitate", imitate))
    rows = {k: v for k, v in experiment.arms[arm].items() if (k, v) not in named}
    whom = "a fire that learns" if fire == LEARNS else f"the fire `{fire}`"
    first = f"a copy of `{imitate}`, then " if imitate else ""
    return f"{first}{trainer} against {whom}{_changes(rows)}"


def _changes(rows: Mapping[str, Any]) -> str:
    """Rows that differ from the preset's, as the file has them."""
    named = rows_of_both(rows, None, "")
    told = ", ".join(f"`{name} = {value}`" for name, value, _ in named)
    return told and f" with {told}"


def _by_which_ruler(results: Results) -> str:
    if (baseline := results.experiment.test.baseline) is None:
        return "by the paper's ruler"
    if results.ruler is None:
        return f"is not known, since `{baseline}` yields no ruler"
    return f"by the ruler on which `{baseline}` scores 1 on average over its fires"


def _matrix(cells: Sequence[Cell], fires: list[str], figures: tuple[str, ...]) -> str:
    found = {(cell.robots, cell.fire): cell for cell in cells}
    rows = [
        [f"`{row}`", *(_entry(found.get((row, fire)), figures) for fire in fires)]
        for row in dict.fromkeys(cell.robots for cell in cells)
    ]
    return _table(["robots", *fires], rows)


def _entry(cell: Cell | None, figures: tuple[str, ...]) -> str:
    """One figure with its interval, or the means of several."""
    if cell is None:
        return "-"
    if len(figures) == 1:
        return " ".join(mean_and_interval(cell, figures[0])).strip()
    known = ((name, getattr(cell, name)) for name in figures)
    return ", ".join(f"{FIGURES[n]} {formatted(i.mean, n)}" for n, i in known if i)


def _exploitability(results: Results) -> Iterable[str]:
    """Survivors under random fire less those under the best response."""
    if rows := results.exploitable:
        yield "## Approximate exploitability"
        yield (
            f"Survivors under {RANDOM} fire less those under the best response, in "
            "percentage points of the same seeds. Who saves few has little to lose."
        )
        lost = {row: of_trainings(results.lost(row)) for row in rows}
        yield _table(["robots", "lost"], [[f"`{r}`", points(lost[r])] for r in rows])


def _differences(results: Results, fires: list[str]) -> Iterable[str]:
    """How many more the first of each pair saves than the second."""
    if compare := results.experiment.compare:
        yield "## Differences"
        yield "Survivors of the first less the second's, percentage points, same seeds:"
        rows = []
        for one, other in compare:
            found = (results.more_saved(one, other, fire) for fire in fires)
            rows.append(
                [f"`{one}` − `{other}`", *(points(i) if i else "-" for i in found)]
            )
        yield _table(["pair", *fires], rows)


def _doubts(experiment: Experiment) -> str:
    trainings = len(experiment.seeds)
    doubts = [
        f"More trainings: intervals over {trainings} are too narrow, and "
        f"{2 * trainings} may tell otherwise."
    ]
    if experiment.best_response:
        doubts.append(
            "A stronger adversary: a best response is as strong as its training; is "
            "its curve flat?"
        )
    doubts.append(
        "Another budget, building or crowd: nothing here says that the order stays."
    )
    return "\n".join(f"* {doubt}" for doubt in doubts)


def _table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)
