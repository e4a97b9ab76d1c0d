"""The adversarial loop with files: PLAY, LEARN, TELL, KEEP, round after round.

A round's episodes are pure jobs, so that neither the number of workers nor an
interruption between two rounds changes the result [E6]; torch's threads would, so their
number is a setting.
"""

import sys
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from time import process_time
from typing import NoReturn

from tqdm import tqdm

from reference.learning.rollouts import Episode, Job, play
from reference.learning.settings import Side
from reference.workshop.engine import make_ready, run_to_decision
from reference.workshop.storage.files import make_folder
from reference.workshop.storage.progress import Pace
from reference.workshop.storage.records import SettingsError
from reference.workshop.storage.workers import (
    map_in_order,
    map_in_shares,
    one_thread,
    stop_delayed,
)
from reference.workshop.training.checkpoints import keep_checkpoint, newest_checkpoint
from reference.workshop.training.families import LotJob, prepare
from reference.workshop.training.rounds import Training
from reference.workshop.training.summaries import (
    EXPLAINED,
    OWN_REWARD,
    SIGNAL,
    SURVIVAL,
    SummaryRow,
    table_until,
)


def run_training(
    training: Training,
    folder: Path,
    executor: Executor,
    stop: Callable[[], bool] = lambda: False,
) -> Path:
    """Train until the round after which every side has reached its max_steps, or stop.

    The folder gets checkpoints, the first before anything else, and summaries.csv.
    Returns the last checkpoint's path. Raises OSError where nothing can be written. A
    KeyboardInterrupt, or whatever a job raises, drops a round that is being played; one
    that is being learned from ends first. Then a checkpoint is saved, and it is raised.
    Raises SettingsError where there is nothing to decide: a folder that was empty is
    empty again then, but for a copy that is done.
    """
    make_folder(folder)
    begun = newest_checkpoint(folder)
    first = begun or _save(training, folder, training.learners)
    table = table_until(folder, training.round if training.imitated else -1)
    over = _intervals(training)
    costs = _Costs()
    if not training.finished:
        make_ready()
    try:
        with _bar(training) as bar:
            pace = Pace(bar.total, bar.n)
            while not training.finished and not stop():
                if not training.imitated:
                    pace = Pace(bar.total, bar.n)  # copying takes no decisions
                # PLAY
                try:
                    episodes = _play_round(training, executor, costs)
                except Exception:  # of any kind: nothing is half-learned
                    _save_to_resume(training, folder)
                    raise
                with stop_delayed("stopping as soon as this round is learned from"):
                    # LEARN
                    rows = training.learn(episodes)
                    # TELL
                    table.append(rows)
                    _show(bar, pace, training, rows)
                    # KEEP
                    before = over
                    over = _intervals(training)
                    due = [side for side in over if over[side] != before[side]]
                    if due:
                        _save(training, folder, due)
    except KeyboardInterrupt:
        _save_to_resume(training, folder)
        raise
    except SettingsError:
        copied = training.task.imitate and training.imitated
        if not (begun or training.round or copied):
            first.unlink()
            table.path.unlink()
        raise
    costs.tell()
    return _save(training, folder, training.learners if training.finished else ())


def _play_round(
    training: Training, executor: Executor, costs: "_Costs"
) -> list[Episode]:
    """Play a round's jobs; those of one building take equally long, so by shares."""
    if training.task.family is None:
        return map_in_shares(executor, _play, training.jobs())
    episodes = list[Episode]()
    for played, *seconds in map_in_order(executor, _play_in_family, training.jobs()):
        episodes += played
        costs.add(*seconds)
    return episodes


def _play(jobs: Sequence[Job]) -> list[Episode]:
    """Play a worker's share, with sums in the same order in a worker as here."""
    with one_thread():
        return [e for job in jobs for e in play(job, advance=run_to_decision)]


@dataclass
class _Costs:
    """What the buildings of a family cost, in seconds of whoever played the jobs."""

    jobs: int = 0
    preparing: float = 0.0
    playing: float = 0.0

    def add(self, preparing: float, playing: float) -> None:
        """Count what a job has cost."""
        self.jobs += 1
        self.preparing += preparing
        self.playing += playing

    def tell(self) -> None:
        """Say on stderr what it came to."""
        if self.jobs:
            each = 1000 * self.preparing / self.jobs
            share = self.preparing / (self.preparing + self.playing)
            print(
                f"making buildings took {each:,.0f} ms a job, {share:.0%} of the time "
                f"of {self.jobs:,} jobs",
                file=sys.stderr,
            )


def _play_in_family(job: Job) -> tuple[list[Episode], float, float]:
    """Play a job in its building; also return seconds to prepare that, and to play."""
    make_ready()  # no building's doing
    begin = process_time()
    if isinstance(job, LotJob):
        job = job.placed()
    prepare(job)
    ready = process_time()
    episodes = _play([job])
    return episodes, ready - begin, process_time() - ready


def _save(training: Training, folder: Path, due: Iterable[Side]) -> Path:
    """Write a checkpoint; delete those that no side keeps.

    due: the sides that keep it. No side keeps what a stop leaves: it is deleted when
    the next one is written.
    """
    training.keep(due)
    return keep_checkpoint(
        training.checkpoint(), folder, chain(*training.kept.values())
    )


def _save_to_resume(training: Training, folder: Path) -> None:
    """Write a checkpoint that no side keeps; a stop that comes again waits.

    Not while robots copy: the first one is there, and nothing resumes from half a copy.
    """
    if not training.imitated:
        print("robots have not copied all: they begin anew", file=sys.stderr)
        return
    with stop_delayed("saving"):
        _save(training, folder, ())


def _intervals(training: Training) -> dict[Side, int]:
    """How many checkpoint_intervals of each side are over; imitation is one more."""
    over = {}
    for side, learner in training.learners.items():
        intervals = learner.steps // learner.settings.checkpoint_interval
        over[side] = intervals + int(training.imitated)
    return over


def _bar(training: Training) -> "tqdm[NoReturn]":
    total = sum(who.settings.max_steps for who in training.learners.values())
    done = total - training.left
    return tqdm(
        total=total, initial=done, unit=" decisions", unit_scale=True, disable=None
    )


def _show(
    bar: "tqdm[NoReturn]", pace: Pace, training: Training, rows: Sequence[SummaryRow]
) -> None:
    """Show the progress; where there is no terminal, print the rows."""
    bar.update(bar.total - training.left - bar.n)
    if latest := training.latest:
        reward, share = latest["group_reward"], latest["survival"]
        bar.set_postfix(reward=f"{reward:,.0f}", survivors=f"{share:.0%}")
    if not bar.disable:
        return
    for row in rows:
        line = f"{row['side']}: {row['phase']}, step {row['step']:,}"
        if OWN_REWARD in row:
            line += f", reward {row[OWN_REWARD]:,.0f}, survival {row[SURVIVAL]:.0%}"
        if SIGNAL in row and EXPLAINED in row:
            line += f", signal / noise {row[SIGNAL]:.2f}"
            line += f", the critic explains {row[EXPLAINED]:.0%}"
        done = bar.total - training.left
        print(f"{line}; {pace.in_words(done)}", file=sys.stderr)
