"""The adversarial loop: PLAY, LEARN, TELL, KEEP, round after round.

Clauses: C1, D1, D6, E1, E2, E3, E6.  Robots and fire play the same episodes and learn
from them, both at once or in turn, or one of them against somebody who does not learn.

A round's episodes are pure jobs of whoever plays, so that neither how many workers
there are nor an interruption between two rounds changes what comes out.
"""

import contextlib
import sys
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from statistics import mean
from time import perf_counter
from typing import Any

import numpy as np
from tqdm import tqdm

from reference.building import building_of
from reference.files import make_folder
from reference.learning import checkpoints, poca, ppo
from reference.learning.checkpoints import Checkpoint, CheckpointError, Task
from reference.learning.experience import Trajectory
from reference.learning.imitation import Lesson, clone, demonstrate
from reference.learning.networks import one_thread
from reference.learning.players import SIDES, Player, Side
from reference.learning.rollouts import Episode, Job, Learned, play
from reference.learning.settings import SettingsError
from reference.learning.summaries import (
    COLUMNS,
    OWN_REWARD,
    PRETRAINING,
    SURVIVAL,
    TIMES,
    Board,
    Row,
    Summary,
    Table,
)
from reference.simulation import Simulation
from reference.workers import in_order

LEARNERS, ROUNDS, LESSONS = 0, 1, 2  # what seeds are for
SUMMARIES, CLOCK = "summaries.csv", "times.csv"


class Training:
    """Who learns, and how far they have come. It changes in `imitate` and `learn` only.

    round  rounds that are over;  episodes  that were learned from;  latest  means of
    the last round's facts;  imitated  whether copying, if asked for, is over
    """

    def __init__(self, task: Task):
        """Raises SettingsError if nobody learns, or nobody who could imitate.

        And ValueError for more people than fit into the building.
        """
        self.task, self.settings = task, task.settings
        self.learners: dict[Side, ppo.Learner] = {
            side: _learner(task, side) for side in SIDES if side not in task.fixed
        }
        if not self.learners:
            raise SettingsError("nobody learns: leave one side to a learner")
        if task.imitate and "robots" not in self.learners:
            raise SettingsError("nobody imitates: leave the robots to a learner")
        Simulation(building_of(task.plan), self.settings.scenario, "none", "none")
        self.summaries = {
            side: Summary(side, learner.settings.summary_freq)
            for side, learner in self.learners.items()
        }
        self.round = self.episodes = 0
        self.imitated = task.imitate is None
        self.latest: dict[str, float] = {}

    # -- Whose turn it is -----------------------------------------------------------

    @property
    def over(self) -> bool:
        """Every side that learns is past its max_steps."""
        return not self._unfinished()

    def learning(self) -> tuple[Side, ...]:
        """Who learns in this round."""
        sides = self._unfinished()
        if self._critic_alone():
            return ("robots",)
        if self.settings.schedule == "alternate" and len(sides) > 1:
            return (sides[self.round // self.settings.switch_every % len(sides)],)
        return sides

    @property
    def phase(self) -> str:
        """What a summary calls this round: together, robots, fire, or critic."""
        if self._critic_alone():
            return "critic"
        learning = self.learning()
        return "together" if len(learning) > 1 else learning[0]

    def _unfinished(self) -> tuple[Side, ...]:
        return tuple(
            side
            for side, learner in self.learners.items()
            if learner.steps < learner.settings.max_steps
        )

    def _critic_alone(self) -> bool:
        """After imitation the critic learns first what the imitator is worth."""
        return bool(self.task.imitate) and self.round < self.settings.critic_rounds

    # -- What there is to tell --------------------------------------------------------

    def about(self) -> str:
        """Who trains how, and how far there is to go, in a line for people."""
        sides = ", ".join(f"{side} {who}" for side, who in self._who().items())
        left = sum(
            max(0, learner.settings.max_steps - learner.steps)
            for learner in self.learners.values()
        )
        title = building_of(self.task.plan).title
        share = self.settings.random_fires
        if share and len(self.learners) == len(SIDES):
            sides += f" but for {share:.0%} random fires"
        return f"{title}: {sides}, seed {self.task.seed}; {left:,} decisions to go"

    def _who(self) -> dict[Side, str]:
        """Each side's trainer and head, or who plays it."""
        told: dict[Side, str] = {}
        for side in SIDES:
            if side in self.learners:
                s = self.learners[side].settings
                told[side] = f"{s.trainer_type} ({s.head} head)"
            else:
                who = self.task.fixed[side]
                told[side] = who if isinstance(who, str) else "a fixed checkpoint"
        return told

    @property
    def decisions(self) -> int:
        """All that learners have learned from."""
        return sum(learner.steps for learner in self.learners.values())

    def facts(self) -> dict[str, Any]:
        """Who it was, how far they are, and the means of the last round's episodes."""
        latest = {
            "reward": "group_reward",
            "fire_reward": "fire_reward",
            "survival": "survival",
            "evacuated": "evacuated",
            "died": "died",
        }
        return {
            "preset": self.settings.preset,
            **{str(side): who for side, who in self._who().items()},
            "seed": self.task.seed,
            "rounds": self.round,
            "episodes": self.episodes,
            "steps": {side: learner.steps for side, learner in self.learners.items()},
            **{name: self.latest.get(fact) for name, fact in latest.items()},
        }

    # -- A round --------------------------------------------------------------------

    def jobs(self) -> list[Job]:
        """The round's episodes; seeds follow from the run's and the round's number."""
        s = self.settings
        seeds = seeds_of(
            self.task.seed, ROUNDS, self.round, s.jobs_per_round * s.episodes_per_job
        )
        robots, fire = (self._player(side) for side in SIDES)
        first = self.round * s.jobs_per_round
        return [
            Job(
                self.task.plan,
                s.scenario,
                robots,
                "random" if self._random_fire(first + k) else fire,
                chunk,
            )
            for k, chunk in enumerate(_parts(seeds, s.episodes_per_job))
        ]

    def _random_fire(self, job: int) -> bool:
        """Does random fire stand in for the one that learns? [E6, chosen]

        In `random_fires` of all jobs, evenly spread, while the robots learn: against
        one adversary alone they would learn its habits, or from a strong one nothing.
        """
        if "fire" not in self.learners or "robots" not in self.learning():
            return False
        share = self.settings.random_fires
        return int((job + 1) * share) > int(job * share)

    def _player(self, side: Side) -> Learned | str:
        if side in self.learners:
            learner = self.learners[side]
            return Learned(learner.settings, _numbers(learner.actor.state_dict()))
        who = self.task.fixed[side]
        return (
            who if isinstance(who, str) else replace(who, weights=_numbers(who.weights))
        )

    def learn(self, episodes: Sequence[Episode]) -> list[Row]:
        """Whoever's turn it is learns from the round; the summaries that are due.

        Raises SettingsError if in their first round they had nothing to decide.
        """
        phase, facts = self.phase, [episode.facts for episode in episodes]
        self.episodes += len(episodes)
        self.latest = {name: mean(f[name] for f in facts) for name in facts[0]}
        when = {"round": self.round + 1, "episodes": self.episodes, "phase": phase}
        rows = []
        for side in self.learning():
            learner, summary = self.learners[side], self.summaries[side]
            learner.add(_lived(episodes, side))
            if not learner.steps:
                raise SettingsError(
                    f"{side}: nothing to decide in {len(episodes)} episodes. Give the "
                    "scenario more time, people, robots or sources."
                )
            told = learner.update(phase == "critic") if learner.ready else {}
            summary.add(_facts(episodes, side), told)
            rows.append(summary.row(learner.steps, when))
        self.round += 1
        return [row for row in rows if row is not None]

    # -- Imitation ------------------------------------------------------------------

    def lessons(self) -> list[Lesson]:
        """What the robots copy first, with a scripted fire about."""
        s, fire = self.settings, self.task.fixed.get("fire")
        seeds = seeds_of(self.task.seed, LESSONS, 0, s.imitation_episodes)
        assert self.task.imitate is not None
        return [
            Lesson(
                plan=self.task.plan,
                scenario=s.scenario,
                settings=s.robots,
                teacher=self.task.imitate,
                fire=fire if isinstance(fire, str) else "random",
                seeds=chunk,
            )
            for chunk in _parts(seeds, s.episodes_per_job)
        ]

    def imitate(self, lessons: Sequence[Trajectory]) -> list[Row]:
        """Copy what was demonstrated; a row for each epoch."""
        losses = clone(self.learners["robots"], lessons, self.settings.imitation_epochs)
        self.imitated = True
        when = {"side": "robots", "step": 0, "round": 0, "episodes": 0}
        return [{**when, "phase": "imitation", PRETRAINING: loss} for loss in losses]

    # -- Checkpoints ----------------------------------------------------------------

    def checkpoint(self) -> Checkpoint:
        """Everything that is needed to go on."""
        learners = {side: learner.state() for side, learner in self.learners.items()}
        progress = {
            "episodes": self.episodes,
            "imitated": self.imitated,
            "latest": self.latest,
            "summaries": {side: s.state() for side, s in self.summaries.items()},
        }
        return Checkpoint(self.task, self.round, learners, progress)

    @classmethod
    def resumed(cls, checkpoint: Checkpoint) -> "Training":
        """As it was. Raises CheckpointError if the parts do not fit each other."""
        training = cls(checkpoint.task)
        progress = checkpoint.progress
        try:
            for side, learner in training.learners.items():
                learner.load(checkpoint.learners[side])
                training.summaries[side].load(progress["summaries"][side])
            training.round = checkpoint.round
            training.episodes = progress["episodes"]
            training.imitated = progress["imitated"]
            training.latest = progress["latest"]
        except (KeyError, TypeError, RuntimeError, ValueError) as error:
            raise CheckpointError(
                "the checkpoint's networks do not fit its settings: it was written by "
                "another version, or is damaged."
            ) from error
        return training


def _learner(task: Task, side: Side) -> ppo.Learner:
    settings = getattr(task.settings, side)
    building = building_of(task.plan)
    sizes = Player(side, building, task.settings.scenario, settings).sizes
    (seed,) = seeds_of(task.seed, LEARNERS, SIDES.index(side), 1)
    return poca.LEARNERS[settings.trainer_type](settings, sizes, seed)


def _lived(episodes: Sequence[Episode], side: Side) -> list[Trajectory]:
    """What a side can learn from."""
    lived = (getattr(episode, side) for episode in episodes)
    return [trajectory for trajectory in lived if trajectory is not None]


def _facts(episodes: Sequence[Episode], side: Side) -> list[dict[str, float]]:
    """Of the episodes that a side has played; of all of them if of none."""
    played = [episode for episode in episodes if getattr(episode, side) is not None]
    return [episode.facts for episode in played or episodes]


def _numbers(weights: dict[str, Any]) -> dict[str, np.ndarray]:
    """Copies: tensors would travel to workers as memory shared with the learner."""
    return {name: tensor.numpy().copy() for name, tensor in weights.items()}


def seeds_of(run: int, purpose: int, number: int, count: int) -> tuple[int, ...]:
    """So many seeds, which follow from the three numbers alone."""
    sequence = np.random.SeedSequence(run, spawn_key=(purpose, number))
    return tuple(sequence.generate_state(count, np.uint64).tolist())


def _parts(seeds: tuple[int, ...], size: int) -> Iterator[tuple[int, ...]]:
    for first in range(0, len(seeds), size):
        yield seeds[first : first + size]


# -- The loop -----------------------------------------------------------------------


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
            lessons = in_order(executor, _taught, training.lessons(), stop)
            if lessons is None:
                return begun
            taught = [trajectory for part in lessons for trajectory in part]
            record.tell(training, training.imitate(taught))
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


def _taught(lesson: Lesson) -> list[Trajectory]:
    with one_thread():
        return demonstrate(lesson)


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
        self.summaries = Table(folder / SUMMARIES, COLUMNS, over)
        self.times = Table(folder / CLOCK, TIMES, over)
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
