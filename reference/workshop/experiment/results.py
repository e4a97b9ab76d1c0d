"""Summarise the tests of an experiment, arm by arm.

Clauses: F9, F12.  The unit is the training: intervals are of interquartile means over
an arm's trainings, see `of_trainings`; E comes from a training's mean reward and mean
difficulty.  Robots written by hand count as one training.

    T  trainings of an arm;  N  episodes, each from a seed of its own
"""

from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cached_property
from itertools import chain

import numpy as np

from reference.evaluation.score import PAPER, Ruler, RulerError
from reference.workshop.crossplay.contestants import WORST, Evacuation
from reference.workshop.crossplay.intervals import Interval, of_trainings
from reference.workshop.crossplay.matches import UNGUIDED
from reference.workshop.crossplay.results import Cell, cells, ruler_of
from reference.workshop.crossplay.runs import RunResult
from reference.workshop.experiment.asked import BEST, Experiment
from reference.workshop.experiment.steps import Plan, checkpoint_of

OWN = "own fire"  # the one that a team has learned with
RANDOM = "random"


class Results:
    """Tests by arm (or robots written by hand) and kind of fire.

    runs  by row and column of the matrix, all that were played
    """

    def __init__(self, experiment: Experiment, records: Sequence[RunResult]):
        self.experiment = experiment
        self.runs: dict[tuple[str, str], list[RunResult]] = {}
        for run in records:
            match = arm_of(run.robots), self._column(run)
            self.runs.setdefault(match, []).append(run)

    def _column(self, run: RunResult) -> str:
        """Name a fire's kind, or tell whether it learned with these robots."""
        if run.fire not in self.experiment.trainings:
            return run.fire
        return OWN if run.fire == run.robots else f"{arm_of(run.fire)}'s fires"

    def values(self, row: str, column: str, figure: str) -> np.ndarray:
        """Collect a figure of a row's trainings: (T, N), means over several fires."""
        found: dict[str, dict[int, list[float]]] = defaultdict(
            lambda: defaultdict(list)
        )
        for run in self.runs.get((row, column), ()):
            found[run.robots][run.seed].append(getattr(run, figure))
        return np.array(
            [[np.mean(of[seed]) for seed in sorted(of)] for of in found.values()]
        )

    @cached_property
    def ruler(self) -> Ruler | None:
        """The ruler on which the baseline scores 1; None if its runs yield none."""
        if (baseline := self.experiment.test.baseline) is None:
            return PAPER
        points = self.experiment.arena.points
        try:
            return ruler_of(list(chain(*self.runs.values())), baseline, *points)
        except RulerError:
            return None

    def cells(self) -> list[Cell]:
        """List the matrix by column; fires made for one row come last."""
        rows = dict.fromkeys(row for row, _ in self.runs)
        last = (OWN, BEST, WORST)
        columns = dict.fromkeys(c for _, c in self.runs if c not in last)
        places = [(row, column) for column in (*columns, *last) for row in rows]
        return [self._cell(*p, self.runs[p]) for p in places if p in self.runs]

    def _cell(self, row: str, column: str, runs: Sequence[RunResult]) -> Cell:
        ruler, named = self.ruler, (replace(r, robots=row, fire=column) for r in runs)
        (cell,) = cells(named, ruler)
        survival, reward, difficulty = (
            self.values(row, column, figure)
            for figure in ("survival", "reward", "difficulty")
        )
        score = cell.score
        if ruler and len(reward) > 1:
            try:
                scores = ruler.score(reward.mean(axis=1), difficulty.mean(axis=1))
                score = of_trainings(np.asarray(scores)[:, None])
            except RulerError:
                score = None
        return replace(
            cell,
            survival=of_trainings(survival),
            reward=of_trainings(reward),
            difficulty=of_trainings(difficulty),
            score=score,
        )

    # -- Differences ----------------------------------------------------------------

    def more_saved(self, one: str, other: str, column: str) -> Interval | None:
        """Estimate survivors of `one` minus `other`, same seeds; None without runs."""
        pair = [(row, column) for row in (one, other)]
        if not all(key in self.runs for key in pair):
            return None
        return of_trainings(*(self.values(*key, "survival") for key in pair))

    def lost(self, row: str) -> np.ndarray:
        """Compute approximate exploitability: (T, N) survivors under random fire minus
        those under the best response."""
        random, best = (self.values(row, fire, "survival") for fire in (RANDOM, BEST))
        return random - best

    @property
    def exploitable(self) -> list[str]:
        """The rows of which `lost` is known: every team has met both fires."""
        teams = {where: {r.robots for r in runs} for where, runs in self.runs.items()}
        rows = [row for row, fire in teams if fire == BEST]
        return [r for r in rows if teams.get((r, RANDOM)) == teams[r, BEST]]


def telling(results: Results, plan: Plan) -> Iterator[tuple[str, Evacuation]]:
    """Yield evacuations by nobody, the best robots written by hand, and learned ones.

    All meet the best response to the learned ones: the first training that met one, of
    the first arm that is compared. The seed is that whose survival is nearest to their
    mean. Nothing where no arm has one. Raises RunError for a damaged checkpoint.
    """
    experiment, known = results.experiment, results.exploitable
    named = [*sum(experiment.compare, ()), *experiment.arms]
    arms = [name for name in named if name in experiment.arms]
    if (arm := next((arm for arm in arms if arm in known), None)) is None:
        return
    team = results.runs[arm, BEST][0].robots
    runs = [run for run in results.runs[arm, BEST] if run.robots == team]
    mean = np.mean([run.survival for run in runs])
    seed = min(runs, key=lambda run: abs(run.survival - mean)).seed
    written = [row for row in experiment.test.robots if (row, RANDOM) in results.runs]
    written = [row for row in written if row != UNGUIDED]
    written.sort(key=lambda row: results.values(row, RANDOM, "survival").mean())
    fire, arena = plan.strongest(team), experiment.arena
    robots = {UNGUIDED: UNGUIDED} | {row: row for row in written[-1:]}
    for folder in (fire, plan.training(team)):
        checkpoint_of(folder)  # refuse a damaged one
    robots[team] = str(plan.training(team))
    for name, word in robots.items():
        yield name, Evacuation(arena.plan, arena.scenario, word, str(fire), seed)


def arm_of(team: str) -> str:
    """The arm of a team, or of a fire that learned against it: without numbers."""
    return team.partition("-")[0]
