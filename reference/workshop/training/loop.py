"""The adversarial loop with files: PLAY, LEARN, TELL, KEEP, round after round.

Clauses: E1, E2, E6.  A round's episodes are pure jobs, so that neither the number of
workers nor an interruption between two rounds changes the result.
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
    OWN_REWARD,
    PRETRAINING,
    SURVIVAL,
    Board,
    Row,
    table_until,
)
from reference.workshop.workers import in_order


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
        while not training.over and not stop():
            # PLAY
            episodes = in_order(executor, _play, training.jobs(), stop)
            if episodes is None:
                break
            # LEARN
            rows = training.learn(episodes)
            # TELL
            log.tell(rows)
            # KEEP
            if log.due():
                log.keep()
        return log.keep()


def _play(jobs: Sequence[Job]) -> list[Episode]:
    """Play a worker's share, with sums in the same order in a worker as here."""
    with one_thread():
        return [e for job in play_all(jobs, together) for e in job]


class Log:
    """The folder of a training: checkpoints and summaries; and the progress."""

    def __init__(
        self, training: Training, folder: Path, tensorboard: bool, stack: ExitStack
    ):
        """Save where it begins; drop later rows, which an interruption may have left.

        The checkpoint comes first: where it does not fit, the folder stays empty.
        """
        self.training, self.folder, learners = training, folder, training.learners
        self.summaries: list[Table | Board] = []
        if tensorboard:
            steps = {side: who.steps for side, who in learners.items()}
            board = closing(Board(folder / "tensorboard", steps))
            self.summaries.append(stack.enter_context(board))
        make_folder(folder)
        self.kept = self._marks()
        if checkpoints.newest(folder) is None:
            self.keep()
        over = training.round if training.imitated else -1
        self.summaries.append(table_until(folder, over))
        total = sum(who.settings.max_steps for who in learners.values())
        done = total - training.left
        bar = tqdm(
            total=total, initial=done, unit=" decisions", unit_scale=True, disable=None
        )
        self.bar = stack.enter_context(bar)

    def tell(self, rows: Sequence[Row]) -> None:
        """Write the summaries that are due; show the progress."""
        for summaries in self.summaries:
            summaries.append(rows)
        self.bar.update(self.bar.total - self.training.left - self.bar.n)
        if latest := self.training.latest:
            reward, share = latest["group_reward"], latest["survival"]
            self.bar.set_postfix(reward=f"{reward:,.0f}", survivors=f"{share:.0%}")
        if self.bar.disable:
            for row in rows:
                print(_line(row), file=sys.stderr)

    def due(self) -> bool:
        """Whether a side is past another multiple of its checkpoint_interval."""
        return self._marks() != self.kept

    def keep(self) -> Path:
        """Save a checkpoint of now; return its path."""
        self.kept, both = self._marks(), self.training.learners.values()
        most = max(who.settings.keep_checkpoints for who in both)
        return checkpoints.keep(self.training.checkpoint(), self.folder, most)

    def _marks(self) -> list[int]:
        """How many intervals are over; robots that imitate have one more."""
        both = self.training.learners.values()
        over = [who.steps // who.settings.checkpoint_interval for who in both]
        return [self.training.imitated, *over]


def _line(row: Row) -> str:
    """Put a summary row into words, for people who read a log."""
    if PRETRAINING in row:
        return f"{row['side']}: {row['phase']}, loss {row[PRETRAINING]:.3f}"
    return (
        f"{row['side']}: step {row['step']:,}, round {row['round']}, "
        f"reward {row[OWN_REWARD]:,.0f}, survival {row[SURVIVAL]:.0%}"
    )
