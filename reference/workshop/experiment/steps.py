"""The steps of an experiment: its jobs, what each needs, and the file it makes.

Clauses: E6, F12.  A step is done when its file is there; it can be done when the files
that it needs are.  So nothing is done twice, and a resumed experiment continues.

    trainings/TEAM/    of an arm and a seed: checkpoint, curve, log
    responses/TEAM-K/  the K-th fire that learned against the frozen team
    choices/           that fire's evacuations, by which the strongest is chosen
    tests/             evacuations of every team against every fire
"""

import sys
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Executor, Future, wait
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import partial
from itertools import product
from pathlib import Path
from statistics import mean
from typing import Any

from tqdm import tqdm

from reference.learning.players import Learned
from reference.learning.settings import Side
from reference.paper import InputError
from reference.workshop.crossplay.contestants import WORST
from reference.workshop.crossplay.matches import Match
from reference.workshop.crossplay.runs import RunResult, read, table_of
from reference.workshop.experiment.asked import (
    BEST,
    FIXED_FIRES,
    RESPONSES,
    Experiment,
)
from reference.workshop.experiment.jobs import DONE, Fit, Trial, fit, trial
from reference.workshop.files import make_folder, write_whole
from reference.workshop.runs import RunError
from reference.workshop.strategies import ROBOTS
from reference.workshop.training.checkpoints import Checkpoint, Task, load, packed
from reference.workshop.training.session import Training
from reference.workshop.workers import POLL


@dataclass(frozen=True)
class Step:
    """One job: `work` on what `job` gives, anywhere; then `keep` the result, here.

    made  the file that exists when it is done;  needs  files that must exist before
    """

    name: str
    made: Path
    needs: tuple[Path, ...]
    work: Callable[[Any], Any]
    job: Callable[[], Any]
    keep: Callable[[Any], None]


class Plan:
    """The steps of an experiment in a folder; here: workers share this folder."""

    def __init__(self, experiment: Experiment, folder: Path, here: bool):
        self.experiment, self.folder, self.here = experiment, folder, here

    def steps(self) -> Iterator[Step]:
        """All steps there are, done or not."""
        experiment = self.experiment
        for team in experiment.trainings:
            task = partial(experiment.trainings.__getitem__, team)
            yield self._training(self.training(team), (), task, "robots")
        for team, k in product(experiment.teams, experiment.responses):
            yield self._response(team, k)
            if len(experiment.responses) > 1:
                yield self._test(team, str(k), experiment.choices)
        for (fire, seeds), team in product(experiment.fires.items(), experiment.teams):
            yield self._test(team, fire, seeds)

    # -- Where things are -----------------------------------------------------------

    def training(self, team: str) -> Path:
        """The folder of a team's training."""
        return self.folder / "trainings" / team

    def response(self, team: str, number: int | str) -> Path:
        """The folder of a fire that learned against a team."""
        return self.folder / RESPONSES / f"{team}-{number}"

    def test(self, team: str, fire: str) -> Path:
        """The table of a team's evacuations; fire: a number for a choice's."""
        kind = "choices" if fire.isdecimal() else "tests"
        return self.folder / kind / f"{team} {fire}.csv"

    def records(self) -> list[RunResult]:
        """All evacuations of tests that are there. Raises RunError for damaged ones."""
        return [
            run
            for team in self.experiment.teams
            for fire, seeds in self.experiment.fires.items()
            for run in self._runs(team, fire, seeds)
        ]

    def _runs(self, team: str, fire: str, seeds: range) -> list[RunResult]:
        """Read all evacuations of one table; none where there is no table."""
        path = self.test(team, fire)
        if not path.exists():
            return []
        with suppress(InputError):
            runs = read(path)
            if [run.run for run in runs] == [(team, fire, seed) for seed in seeds]:
                return runs
        raise RunError(f"{path}: is damaged. Remove it, and go on with --resume.")

    def strongest(self, team: str) -> Path:
        """The folder of the response that costs a team most, on the choices' seeds."""

        def reward(number: int) -> float:
            runs = self._runs(team, str(number), self.experiment.choices)
            return mean(run.reward for run in runs)

        first, *others = self.experiment.responses
        number = min((first, *others), key=reward) if others else first
        return self.response(team, number)

    # -- Steps ----------------------------------------------------------------------

    def _training(
        self,
        folder: Path,
        needs: tuple[Path, ...],
        task: Callable[[], Task],
        side: Side,
    ) -> Step:
        """Make a training's step; task: called once what it needs is there."""

        def job() -> Fit:
            beginning = packed(Training(task()).checkpoint())
            return Fit(beginning, side, str(folder) if self.here else None)

        def keep(files: dict[str, bytes]) -> None:
            make_folder(folder)
            for name, content in files.items():
                write_whole(folder / name, content)

        name = f"{folder.parent.name}/{folder.name}"
        return Step(name, folder / DONE, needs, fit, job, keep)

    def _response(self, team: str, number: int) -> Step:
        def task() -> Task:
            return self.experiment.response(self._robots(team), number)

        folder, needs = self.response(team, number), self._needed(team)
        return self._training(folder, needs, task, "fire")

    def _test(self, team: str, fire: str, seeds: range) -> Step:
        path = self.test(team, fire)
        needs = self._needed(team) + self._needed_fire(team, fire)

        def job() -> Trial:
            found: dict[Side, bytes] = {}
            if team not in ROBOTS:
                found["robots"] = packed(checkpoint_of(self.training(team)))
            if folder := self._fire(team, fire):
                found["fire"] = packed(checkpoint_of(folder))
            return Trial(self.experiment.arena, Match(team, fire), seeds, found)

        def keep(runs: list[RunResult]) -> None:
            make_folder(path.parent)
            table_of(path, runs)

        return Step(f"{path.parent.name}/{path.stem}", path, needs, trial, job, keep)

    def _robots(self, team: str) -> Learned | str:
        if team in ROBOTS:
            return team
        return checkpoint_of(self.training(team)).player("robots")

    def _fire(self, team: str, fire: str) -> Path | None:
        """The folder of the fire that a team meets; None for one that is a script."""
        if fire in FIXED_FIRES or fire == WORST:
            return None
        if fire == BEST:
            return self.strongest(team)
        return self.response(team, fire) if fire.isdecimal() else self.training(fire)

    def _needed(self, team: str) -> tuple[Path, ...]:
        return () if team in ROBOTS else (self.training(team) / DONE,)

    def _needed_fire(self, team: str, fire: str) -> tuple[Path, ...]:
        if fire == BEST and len(self.experiment.responses) > 1:
            return tuple(self.test(team, str(k)) for k in self.experiment.responses)
        folder = self._fire(team, fire)
        return (folder / DONE,) if folder else ()


def checkpoint_of(folder: Path) -> Checkpoint:
    """Read what a finished training has made. Raises RunError."""
    with suppress(InputError, OSError):
        return load(folder)
    raise RunError(
        f"{folder}: its checkpoint is gone or damaged. Remove this folder, and go on "
        "with --resume: it is trained anew."
    )


# -- Doing them ---------------------------------------------------------------------


def perform(
    steps: list[Step],
    executor: Executor,
    width: Callable[[], int],
    stop: Callable[[], bool],
) -> dict[str, str]:
    """Do all steps, each once what it needs is there; return what failed, and why.

    width: how many jobs may run at once. Steps that need a failed one are left out.
    Raises BrokenExecutor for a worker that has died.
    """
    left = [step for step in steps if not step.made.exists()]
    running: dict[Future[Any], Step] = {}
    failed: dict[str, str] = {}
    done = len(steps) - len(left)
    with tqdm(total=len(steps), initial=done, unit="job", disable=None) as bar:
        while not stop():
            while len(running) < width() and not stop() and (step := _ready(left)):
                left.remove(step)
                with _noted(step, failed, stop):
                    running[executor.submit(step.work, step.job())] = step
            if not running:
                break
            for future in wait(running, POLL, FIRST_COMPLETED).done:
                step = running.pop(future)
                with _noted(step, failed, stop):
                    step.keep(future.result())
                    bar.update()
                    if bar.disable:
                        print(f"done: {step.name}", file=sys.stderr)
    for future in running:
        future.cancel()
    return failed


@contextmanager
def _noted(
    step: Step, failed: dict[str, str], stop: Callable[[], bool]
) -> Iterator[None]:
    """Note why a step failed; a worker that has died and Ctrl-C end everything."""
    try:
        yield
    except BrokenExecutor:
        raise
    except KeyboardInterrupt:  # in this process
        if not stop():
            raise
    except Exception as error:
        failed[step.name] = f"{type(error).__name__}: {error}"
        tqdm.write(f"failed: {step.name}: {failed[step.name]}", file=sys.stderr)


def _ready(steps: list[Step]) -> Step | None:
    """The first step that can be done now."""
    ready = (step for step in steps if all(path.exists() for path in step.needs))
    return next(ready, None)
