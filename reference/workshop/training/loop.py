"""The adversarial loop with files: PLAY, LEARN, TELL, KEEP, round after round.

Clauses: E1, E2, E6.  A round's episodes are pure jobs, so that neither the number of
workers nor an interruption between two rounds changes the result.  Playing and learning
themselves are in `learning.adversarial`.
"""

import sys
from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from contextlib import ExitStack, closing
from pathlib import Path

from tqdm import tqdm

from reference.learning.networks import one_thread
from reference.learning.rollouts import Episode, Job, play_all
from reference.workshop.files import Table, make_folder
from reference.workshop.lockstep import together
from reference.workshop.training import checkpoints
from reference.workshop.training.session import Training
from reference.workshop.training.summaries import (
    COLUMNS,
    OWN_REWARD,
    PRETRAINING,
    SUMMARIES,
    SURVIVAL,
    Board,
    Row,
    table_until,
)
from reference.workshop.workers import as_done, chunks, shares


def train(
    training: Training,
    folder: Path,
    executor: Executor,
    stop: Callable[[], bool] = lambda: False,
    tensorboard: bool = False,
) -> Path:
    """Train until every side is past its max_steps, or until told to stop.

    The folder gets checkpoints and summaries.csv. When `stop` says so, a round that is
    being played is dropped, one that is being learned from is finished.
    Returns the last checkpoint's path. Raises OSError where nothing can be written;
    the checkpoints that are there stay whole.
    """
    with ExitStack() as stack:
        log = Log(training, folder, tensorboard, stack)
        if not training.imitated:
            each = chunks(training.demonstrations(), 1)
            if (episodes := _played(executor, each, stop)) is None:
                return log.path
            log.tell(training.imitate(episodes))
            log.keep()
        while not training.over and not stop():
            # PLAY
            each = shares(training.jobs(), executor)
            if (episodes := _played(executor, each, stop)) is None:
                break
            # LEARN
            rows = training.learn(episodes)
            # TELL
            log.tell(rows)
            # KEEP
            if log.due():
                log.keep()
        return log.keep()


def _played(
    executor: Executor, jobs: Sequence[Sequence[Job]], stop: Callable[[], bool]
) -> list[Episode] | None:
    """Play all jobs, those of a share in one lockstep; None if told to stop."""
    played = dict(as_done(executor, _play, jobs, stop))
    if len(played) < len(jobs):
        return None
    return [e for k in range(len(jobs)) for job in played[k] for e in job]


def _play(jobs: Sequence[Job]) -> list[list[Episode]]:
    """Play a worker's share, with sums in the same order in a worker as here."""
    with one_thread():
        return play_all(jobs, together)


# -- What is written ----------------------------------------------------------------


class Log:
    """The folder of a training: checkpoints and summaries; and the progress.

    path  of the newest checkpoint
    """

    def __init__(
        self, training: Training, folder: Path, tensorboard: bool, stack: ExitStack
    ):
        """Save where it begins; drop later rows, which an interruption may have left.

        What is resumed is saved already. The checkpoint comes first: where it does not
        fit, the folder stays empty.
        """
        self.training, self.folder = training, folder
        self.learners = training.learners.values()
        self.summaries: list[Table | Board] = []
        if tensorboard:
            steps = {side: who.steps for side, who in training.learners.items()}
            board = closing(Board(folder / "tensorboard", steps))
            self.summaries.append(stack.enter_context(board))
        make_folder(folder)
        self.intervals, self.saved = self._intervals(), self._now()
        self.path = checkpoints.newest(folder) or self._save()
        over = training.round if training.imitated else -1
        self.summaries.append(table_until(folder / SUMMARIES, COLUMNS, over))
        bar = tqdm(
            total=sum(who.settings.max_steps for who in self.learners),
            initial=self._done(),
            unit=" decisions",
            unit_scale=True,
            disable=None,
        )
        self.bar = stack.enter_context(bar)

    def tell(self, rows: Sequence[Row]) -> None:
        """Write the summaries that are due; show the progress."""
        for summaries in self.summaries:
            summaries.append(rows)
        self.bar.update(self._done() - self.bar.n)
        if latest := self.training.latest:
            reward, share = latest["group_reward"], latest["survival"]
            self.bar.set_postfix(reward=f"{reward:,.0f}", survivors=f"{share:.0%}")
        if self.bar.disable:
            for row in rows:
                print(_line(row), file=sys.stderr)

    def due(self) -> bool:
        """Whether a side is past another multiple of its checkpoint_interval."""
        return self._intervals() != self.intervals

    def keep(self) -> Path:
        """Save a checkpoint of now, unless there is one; return its path."""
        if self._now() != self.saved:
            self.path = self._save()
        return self.path

    def _save(self) -> Path:
        most = max(who.settings.keep_checkpoints for who in self.learners)
        path = checkpoints.keep(self.training.checkpoint(), self.folder, most)
        self.intervals, self.saved = self._intervals(), self._now()
        return path

    def _now(self) -> tuple[int, bool]:
        return self.training.round, self.training.imitated

    def _intervals(self) -> list[int]:
        return [w.steps // w.settings.checkpoint_interval for w in self.learners]

    def _done(self) -> int:
        """Decisions of the sides that learn, those beyond max_steps not counted."""
        return sum(min(who.steps, who.settings.max_steps) for who in self.learners)


def _line(row: Row) -> str:
    """Put a summary row into words, for people who read a log."""
    if PRETRAINING in row:
        return f"{row['side']}: {row['phase']}, loss {row[PRETRAINING]:.3f}"
    return (
        f"{row['side']}: step {row['step']:,}, round {row['round']}, "
        f"reward {row[OWN_REWARD]:,.0f}, survival {row[SURVIVAL]:.0%}"
    )
