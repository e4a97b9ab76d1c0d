"""The adversarial loop: PLAY, LEARN, TELL, KEEP, round after round.

Clauses: E1, E2, E6.  A round's episodes are pure jobs of whoever plays, so that neither
how many workers there are nor an interruption between two rounds changes what comes
out.
"""

import contextlib
import sys
from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from contextlib import ExitStack
from pathlib import Path
from time import perf_counter
from typing import Any

from tqdm import tqdm

from reference.learning.networks import one_thread
from reference.learning.rollouts import Episode, Job, play
from reference.learning.settings import Side
from reference.workshop.files import make_folder
from reference.workshop.training import checkpoints
from reference.workshop.training.session import Training
from reference.workshop.training.summaries import (
    COLUMNS,
    OWN_REWARD,
    PRETRAINING,
    SURVIVAL,
    TIMES,
    Board,
    Row,
    table_to,
)
from reference.workshop.workers import in_order

SUMMARIES, CLOCK = "summaries.csv", "times.csv"


def train(
    training: Training,
    folder: Path,
    executor: Executor,
    stop: Callable[[], bool] = lambda: False,
    tensorboard: bool = False,
    progress: bool = True,
) -> Path:
    """Rounds until every side is past its max_steps, or until told to stop.

    What is learned lies in the folder: checkpoints, summaries.csv and times.csv. A
    round that is being played when `stop` says so is dropped, one that is being
    learned from is finished. Returns the last checkpoint's path. Raises OSError where
    nothing can be written; the checkpoints that are there stay whole.
    """
    with ExitStack() as closing:
        record = Record(training, folder, tensorboard, progress, closing)
        begun = record.keep(training)
        if not training.imitated:
            played = in_order(executor, _played, training.demonstrations(), stop)
            if played is None:
                return begun
            shown = [episode for job in played for episode in job]
            record.tell(training, training.imitate(shown))
            record.keep(training)
        while not training.over and not stop():
            # PLAY
            start = perf_counter()
            played = in_order(executor, _played, training.jobs(), stop)
            if played is None:
                break
            episodes = [episode for job in played for episode in job]
            # LEARN
            between = perf_counter()
            rows = training.learn(episodes)
            # TELL
            record.tell(training, rows)
            record.time(training, episodes, between - start, perf_counter() - between)
            # KEEP
            if record.due():
                record.keep(training)
        return record.keep(training)


def _played(job: Job) -> list[Episode]:
    """`play`, with sums in the same order in a worker as here."""
    with one_thread():
        return play(job)


# -- What is written ----------------------------------------------------------------


class Record:
    """The folder of a training: checkpoints, summaries and times; and the progress."""

    def __init__(
        self,
        training: Training,
        folder: Path,
        tensorboard: bool,
        progress: bool,
        closing: ExitStack,
    ):
        """What the folder has from later rounds, after an interruption, is dropped."""
        self.folder, self.learners = folder, training.learners
        self.boards = []
        if tensorboard:
            board = Board(folder / "tensorboard", self._steps())
            self.boards.append(closing.enter_context(contextlib.closing(board)))
        make_folder(folder)
        over = training.round if training.imitated else -1
        self.summaries = table_to(folder / SUMMARIES, COLUMNS, over)
        self.times = table_to(folder / CLOCK, TIMES, over)
        self.bar = closing.enter_context(self._bar(progress))
        self.kept: tuple[int, ...] = ()
        self.saved: tuple[int, bool] | None = None
        self.path = folder

    def tell(self, training: Training, rows: Sequence[Row]) -> None:
        """Summaries that are due, and how far it has come."""
        self.summaries.append(rows)
        for board in self.boards:
            board.append(rows)
        self.bar.update(self._done() - self.bar.n)
        if training.latest:
            self.bar.set_postfix(
                reward=f"{training.latest['group_reward']:,.0f}",
                survivors=f"{training.latest['survival']:.0%}",
            )
        if self.bar.disable and self.lines:
            for row in rows:
                print(_line(row), file=sys.stderr)

    def time(
        self, training: Training, episodes: Sequence[Episode], play: float, learn: float
    ) -> None:
        """What the clock says about the round that is over."""
        sides = [t for e in episodes for t in (e.robots, e.fire) if t is not None]
        decisions = sum(trajectory.steps for trajectory in sides)
        row = (training.round, decisions, play, learn, decisions / (play + learn))
        self.times.append([dict(zip(TIMES, row, strict=True))])

    def due(self) -> bool:
        """A side is past another multiple of its checkpoint_interval."""
        return self._intervals() != self.kept

    def keep(self, training: Training) -> Path:
        """A checkpoint of now, unless there is one; its path."""
        now = (training.round, training.imitated)
        if now != self.saved:
            most = max(s.settings.keep_checkpoints for s in self.learners.values())
            self.path = checkpoints.keep(training.checkpoint(), self.folder, most)
            self.kept, self.saved = self._intervals(), now
        return self.path

    def _intervals(self) -> tuple[int, ...]:
        return tuple(
            learner.steps // learner.settings.checkpoint_interval
            for learner in self.learners.values()
        )

    def _steps(self) -> dict[Side, int]:
        return {side: learner.steps for side, learner in self.learners.items()}

    def _done(self) -> int:
        """Decisions of the sides that learn, those beyond max_steps not counted."""
        sides = self.learners.values()
        return sum(min(side.steps, side.settings.max_steps) for side in sides)

    def _bar(self, progress: bool) -> Any:
        self.lines = progress
        return tqdm(
            total=sum(side.settings.max_steps for side in self.learners.values()),
            initial=self._done(),
            unit=" decisions",
            unit_scale=True,
            disable=None if progress else True,
        )


def _line(row: Row) -> str:
    """A summary for people who read a log."""
    reward, survival = row.get(OWN_REWARD), row.get(SURVIVAL)
    if reward is None or survival is None:
        return f"{row['side']}: {row['phase']}, loss {row[PRETRAINING]:.3f}"
    return (
        f"{row['side']}: step {row['step']:,}, round {row['round']}, "
        f"reward {reward:,.0f}, survival {survival:.0%}"
    )
