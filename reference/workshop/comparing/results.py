"""Summarise the runs of each match, as a table, as CSV and as JSON.

Every figure is a mean over runs with its bootstrap interval.  The
score E is that of the mean reward and the mean difficulty, never a mean of scores: E is
convex, so that a mean of scores would reward unreliable robots.
"""

from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from reference import paper
from reference.evaluation.score import (
    Case,
    Point,
    Ruler,
    RulerError,
    base_and_control,
    calibrate,
)
from reference.workshop.comparing.intervals import (
    Interval,
    format_interval,
    interval_of_mean,
    interval_of_means,
)
from reference.workshop.comparing.matches import Arena, Evaluation, notes
from reference.workshop.comparing.runs import DECIMALS_WRITTEN, RunResult
from reference.workshop.strategies import GUIDES


@dataclass(frozen=True, kw_only=True)
class Cell:
    """One match: n runs, and each figure's mean, low and high, in units of `RunResult`.

    gain   survival less the baseline's of the same fire and seeds [F12]
           None without a baseline, or where it has none of these runs
    score  E by one ruler for all [F9, Eq. 8]
           None without a ruler, or where the mean reward or an end of its interval
           lies off it
    score_on_baseline  as score, by the ruler on which a baseline scores 1
    evacuation_time, mean_health  over the runs in which somebody got out
           None if there are none
    """

    robots: str
    fire: str
    n: int
    survival: Interval
    gain: Interval | None = None
    reward: Interval
    difficulty: Interval
    score: Interval | None = None
    score_on_baseline: Interval | None = None
    evacuation_time: Interval | None = None
    mean_health: Interval | None = None


FEWEST_RUNS = 6  # [F12, chosen] two in each third
CLEARLY = 2.0  # [F12, chosen] standard errors between easy and hard thirds: 95 %

FIGURES = ("survival", "reward", "difficulty", "evacuation_time", "mean_health")


@dataclass(frozen=True)
class Baseline:
    """Robots that score 1 on average over the fires, and the ruler of that.

    robots  by the word asked for;  why  they are the baseline;  how  k was found

    Intervals of E take the ruler as exact, though it comes from the same runs: who is
    compared with the baseline is compared by `gain`, which is paired.
    """

    robots: str
    ruler: Ruler
    why: str
    how: str

    def about(self) -> str:
        """Say which E is 1, by which ruler, and what its intervals leave out."""
        k = f"k = {self.ruler.k:.3g}, {self.how}"
        return "\n".join(
            [
                f"E, {self.robots} = 1: {self.why}, it scores 1 on average over these "
                "fires",
                f"its ruler: beta = {self.ruler.beta:,.4g}, {k}",
                "intervals of this E take the ruler as exact",
            ]
        )


def cells(
    results: Iterable[RunResult],
    ruler: Ruler | None,
    baseline: str | None = None,
    on_baseline: Ruler | None = None,
) -> list[Cell]:
    """Average every match that has runs, in the order in which they appear.

    baseline: the robots that others are compared with, seed by seed.
    on_baseline: the ruler of a second E, on which a baseline scores 1
    """
    matches: dict[tuple[str, str], dict[int, RunResult]] = {}
    for run in results:
        matches.setdefault((run.robots, run.fire), {})[run.seed] = run
    averaged = []
    for (robots, fire), by_seed in matches.items():
        runs = list(by_seed.values())
        others = matches.get((baseline or "", fire), {})
        shared = [(by_seed[k], others[k]) for k in sorted(by_seed) if k in others]
        figures: dict[str, Any] = {
            "gain": _interval(run.survival - other.survival for run, other in shared),
            "score": _score(runs, ruler) if ruler else None,
            "score_on_baseline": _score(runs, on_baseline) if on_baseline else None,
        }
        for name in FIGURES:
            figures[name] = _interval(getattr(run, name) for run in runs)
        averaged.append(Cell(robots=robots, fire=fire, n=len(runs), **figures))
    return averaged


def _score(runs: Sequence[RunResult], ruler: Ruler) -> Interval | None:
    """E of mean reward and mean difficulty [F9, chosen]."""
    try:
        rows = np.array([(run.reward, run.difficulty) for run in runs])
        return interval_of_means(ruler.score, rows)
    except RulerError:
        return None


def _interval(values: Iterable[float | None]) -> Interval | None:
    known = [value for value in values if value is not None]
    return interval_of_mean(known) if known else None


def baseline_of(
    results: Sequence[RunResult], asked: str | None, worst: Point, best: Point
) -> Baseline | None:
    """Make the baseline of all fires: who is asked for, else the best scripted guide.

    The best has the highest mean over the fires of E, by the paper's k [F12, chosen].
    None where nobody is asked for and no scripted guide has played.

    worst, best: the critical points, reward and y each. Raises RulerError where these
    make no ruler, or a baseline's mean reward lies off it.
    """
    there = dict.fromkeys(run.robots for run in results)
    guides = [robots for robots in there if robots in GUIDES]
    if not asked and not guides:
        return None

    unit = _unit_ruler(worst, best)
    robots = asked or max(guides, key=lambda name: _mean_score(results, name, unit))
    why = "as asked" if asked else "the best scripted guide here"
    try:
        ruler = ruler_of(results, robots, worst, best)
    except RulerError as error:
        beta = _mean_score(results, robots, unit)
        how = f"the paper's, as these runs do not measure it ({error})"
        return Baseline(robots, replace(unit, beta=beta), why, how)
    return Baseline(robots, ruler, why, "by its runs")


def _unit_ruler(worst: Point, best: Point) -> Ruler:
    """Make the ruler of these critical points with the paper's k, and beta 1."""
    base, control = base_and_control(worst, best)
    return Ruler(paper.ALPHA, base, control, k=paper.K, beta=1.0)


def _mean_score(results: Iterable[RunResult], robots: str, ruler: Ruler) -> float:
    """Average E over the fires that robots met, each fire's by its mean runs."""
    by_fire = dict[str, list[tuple[float, float]]]()
    for run in results:
        if run.robots == robots:
            by_fire.setdefault(run.fire, []).append((run.reward, run.difficulty))
    scores = []
    for cases in by_fire.values():
        reward, h = np.mean(cases, axis=0)
        scores.append(ruler.score(float(reward), float(h)))
    return float(np.mean(scores))


def ruler_of(
    results: Iterable[RunResult], baseline: str, worst: Point, best: Point
) -> Ruler:
    """Calibrate the ruler on which a baseline scores 1 over its fires [F12, chosen].

    The two equal cases are the means of the third of its runs with the easiest fires
    and of the third with the hardest: the same robots deserve the same score. They are
    to score 1 on average over the fires, each fire's runs taken by their means.

    worst, best: the critical points, reward and y each. Take runs against weak and
    strong fires alike. Raises RulerError for fewer than FEWEST_RUNS, and where the hard
    third did not CLEARLY earn less than the easy one.
    """
    runs = [run for run in results if run.robots == baseline]
    if len(runs) < FEWEST_RUNS:
        raise RulerError(f"a ruler takes at least {FEWEST_RUNS} runs: {len(runs)} here")
    R, h = np.array([(run.reward, run.difficulty) for run in runs], dtype=float).T
    fires = np.array([run.fire for run in runs])

    def mean(part: np.ndarray) -> Case:
        return float(R[part].mean()), float(h[part].mean())

    # The easiest and the hardest third, with ties
    ranked = np.sort(h)
    third = len(h) // 3
    easy = h <= ranked[third - 1]
    hard = h >= ranked[-third]

    # Standard error of the difference of their means
    error = np.sqrt(sum(R[part].var(ddof=1) / part.sum() for part in (easy, hard)))
    if not R[easy].mean() - R[hard].mean() > CLEARLY * error:
        raise RulerError(
            f"the baseline earned {R[easy].mean():.0f} in the easiest third of the "
            f"fires, {R[hard].mean():.0f} in the hardest, give or take {error:.0f}: "
            "run more seeds, or weak and strong fires alike"
        )
    of_fires = [mean(fires == name) for name in np.unique(fires)]
    return calibrate(worst, best, (mean(easy), mean(hard)), of_fires)


# -- For people ---------------------------------------------------------------------

COLUMN_TITLES = {
    "survival": "survivors, %",
    "gain": "over baseline",
    "reward": "reward R",
    "difficulty": "difficulty h",
    "score": "score E",
    "score_on_baseline": "E on baseline",
    "evacuation_time": "last out, s",
    "mean_health": "health",
}
OF_BASELINE = ("gain", "score_on_baseline")
MEANS_ONLY = ("evacuation_time", "mean_health")  # shown without their intervals
DIGITS_SHOWN = {"survival": 1, "gain": 1, "score": 2, "score_on_baseline": 2}
DASH_NOTE = "-: nobody got out, or the reward lies off the ruler of E"


def table(
    cells: Sequence[Cell],
    names: Sequence[str] = tuple(COLUMN_TITLES),
    baseline: str | None = None,
) -> str:
    """Write a line for each match: means with their 95 % intervals, or means alone.

    Columns of gains and of E on the baseline are there only if they have anything.

    baseline: the robots whose E is 1, for the heading
    """
    headings = dict(COLUMN_TITLES)
    if baseline:
        headings["score_on_baseline"] = f"E, {baseline} = 1"
    for name in OF_BASELINE:
        if not any(getattr(cell, name) for cell in cells):
            names = [shown for shown in names if shown != name]
    columns = [
        ["robots", *(cell.robots for cell in cells)],
        ["fire", *(cell.fire for cell in cells)],
        ["runs", *(f"{cell.n:,}" for cell in cells)],
        *([headings[name], *_figures(cells, name)] for name in names),
    ]
    lines = align_columns(list(zip(*columns, strict=True)), "<<>" + ">" * len(names))
    missing = any(getattr(cell, name) is None for cell in cells for name in names)
    return f"{lines}\n{DASH_NOTE}" if missing else lines


def align_columns(rows: Sequence[Sequence[str]], align: str) -> str:
    """Lay out rows in columns as wide as their words; align: < or > for each column."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    form = "  ".join(f"{{:{a}{width}}}" for a, width in zip(align, widths, strict=True))
    return "\n".join(form.format(*row).rstrip() for row in rows)


def _figures(cells: Sequence[Cell], name: str) -> list[str]:
    """Format a column like 83.2 [81.0, 85.1], both parts aligned."""
    means, ends = zip(*(mean_and_interval(cell, name) for cell in cells), strict=True)
    if name in MEANS_ONLY or not any(ends):
        return list(means)
    width = max(map(len, ends))
    return [f"{mean} {end:>{width}}" for mean, end in zip(means, ends, strict=True)]


def mean_and_interval(cell: Cell, name: str) -> tuple[str, str]:
    """Format a figure's mean and its interval; "-" if there is none.

    A single run has no interval: it tells nothing of how runs scatter. Survival is in
    percent, a gain in points with its sign, the score has two digits.
    """
    interval = getattr(cell, name)
    if interval is None:
        return "-", ""
    times = 100 if name in ("survival", "gain") else 1
    shown = Interval(*(times * value for value in interval))
    digits = DIGITS_SHOWN.get(name, 0)
    words = format_interval(shown, digits, signed=name == "gain", ends=True)
    mean, ends = words.split(" ", 1)
    return mean, ends if cell.n > 1 else ""


# -- For programs -------------------------------------------------------------------


def evaluation_as_json(
    evaluation: Evaluation,
    ruler: Ruler | None,
    cells: Iterable[Cell],
    baseline: Baseline | None = None,
) -> dict[str, Any]:
    """Describe what was evaluated, which files played, the rulers, cells' figures."""
    return {
        "building": evaluation.arena.building,
        "people": evaluation.arena.people,
        "scenario": scenario_as_json(evaluation.arena),
        "notes": notes(evaluation),
        "seeds": list(evaluation.seeds),
        "sample": evaluation.sample,
        "errors": evaluation.errors,
        "files": dict(evaluation.files),
        "digests": {word: dict(of) for word, of in evaluation.digests.items()},
        "ruler": asdict(ruler) if ruler else None,
        "baseline": asdict(baseline) if baseline else None,
        "cells": [cell_as_json(cell) for cell in cells],
    }


def scenario_as_json(arena: Arena) -> dict[str, Any]:
    """The scenario's fields that differ from the default, by name."""
    changes = arena.changes.items()
    return {name: list(v) if isinstance(v, tuple) else v for name, v in changes}


def cell_as_json(cell: Any) -> dict[str, Any]:
    """A record's figures by name, each with the ends of its interval; of one run None.

    cell: has n, its runs
    """
    return {name: _plain(value, cell.n == 1) for name, value in vars(cell).items()}


def _plain(value: Any, alone: bool) -> Any:
    """An interval as an object of rounded numbers; several as a list."""
    if isinstance(value, Interval):
        ends = value._asdict()
        written = {name: round(end, DECIMALS_WRITTEN) for name, end in ends.items()}
        return written | {"low": None, "high": None} if alone else written
    if isinstance(value, tuple):
        return [_plain(each, alone) for each in value]
    return value
