"""A training: who learns, whose turn it is, and a round's jobs.

Clauses: C1, D1, D6, E1, E2, E3, E6.  Robots and fire play the same episodes and learn
from them, both at once, or one of them against somebody who does not learn.
"""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from itertools import chain
from statistics import mean
from typing import Any

import numpy as np

from reference.building import building_of
from reference.fire import NoFire
from reference.learning.adversarial import learner_for, player_of
from reference.learning.experience import Trajectory
from reference.learning.players import Learned
from reference.learning.ppo import Learner
from reference.learning.rollouts import Episode, Job
from reference.learning.settings import SIDES, Side
from reference.simulation import Simulation
from reference.workshop.storage.records import SettingsError, record_from
from reference.workshop.storage.workers import chunks
from reference.workshop.strategies import FIRES, SCRIPTS
from reference.workshop.training.checkpoints import (
    Checkpoint,
    Task,
    names_of,
    restore,
    state_of,
)
from reference.workshop.training.gradient import figures
from reference.workshop.training.imitation import Demonstration, clone
from reference.workshop.training.summaries import PRETRAINING, Row, Summary

OF_LEARNERS, ROUNDS, DEMONSTRATIONS = range(3)  # what seeds are for
OF_NETWORK = ("head", "hidden_units", "num_layers", "normalize", "commitment", "spread")
"""Rows of settings on which the meaning of a network's weights depends."""

EARLIER = 4
"""[E6, chosen] earlier versions of a side in the league, at even distances: at least
these, at most twice as many."""


@dataclass(frozen=True)
class Progress:
    """What a checkpoint keeps of a training beside learners: see `Training`."""

    episodes: int
    imitated: bool
    kept: dict[Side, tuple[int, ...]]
    latest: dict[str, float]
    summaries: dict[Side, Summary]


class Training:
    """Learners and their progress, which only `learn` changes.

    round  rounds that are over;  episodes  that were learned from;  latest  means of
    the last round's facts;  imitated  whether copying, if asked for, is over
    shown  what the strategy that is copied has decided, an item for each round of it
    kept   rounds of the checkpoints that each side keeps, oldest first
    versions  of each side in the league: its actor's weights after earlier rounds
    """

    def __init__(self, task: Task):
        """Make a learner for each side that nobody else plays.

        Raises SettingsError if there is nothing to learn, or if a network to begin with
        means something else, and ValueError for more people than fit into the building.
        """
        self.task, self.settings = task, task.settings
        building, scenario = building_of(task.plan), task.settings.scenario
        if not sum(scenario.start_counts(building.floors)):
            raise SettingsError("there is nobody to evacuate: raise people")
        Simulation(building, scenario)
        self.learners = {s: _learner(task, s) for s in SIDES if s not in task.fixed}
        self.summaries = {side: Summary(0, {}, {}) for side in self.learners}
        self.round = self.episodes = 0
        self.imitated = task.imitate is None
        self.shown: list[list[Trajectory]] = []
        self.latest: dict[str, float] = {}
        self.kept: dict[Side, tuple[int, ...]] = dict.fromkeys(self.learners, ())
        self.versions: dict[Side, dict[int, Any]] = {side: {} for side in self.learners}

    # -- Whose turn it is -----------------------------------------------------------

    @property
    def left(self) -> int:
        """How many decisions the learners have to go."""
        both = self.learners.values()
        return sum(max(0, who.settings.max_steps - who.steps) for who in both)

    @property
    def over(self) -> bool:
        """Whether every side that learns is past its max_steps."""
        return not self.left

    def learning(self) -> list[Side]:
        """The sides that learn in this round: those not past their max_steps."""
        both = self.learners.items()
        left = [side for side, who in both if who.steps < who.settings.max_steps]
        return [side for side in left if side == "robots" or not self.calm]

    @property
    def calm(self) -> bool:
        """Whether nobody sets fires yet [E6, chosen]: robots learn the building first.

        To beginners fires are noise: what they lose to them hides what they do.
        """
        robots, share = self.learners.get("robots"), self.settings.calm
        return robots is not None and robots.steps < share * robots.settings.max_steps

    # -- A round --------------------------------------------------------------------

    def jobs(self) -> list[Job]:
        """Make the round's jobs; seeds follow from the run's and the round's number.

        Before the first round, robots that imitate ask their teacher. There a fire on
        an occupied place is moved, as in evaluation [D6, chosen]: one that the teacher
        guards against would else try the same place for ever.
        """
        s, task = self.settings, self.task
        now: dict[Side, Any] = {s: player_of(who) for s, who in self.learners.items()}
        which = ROUNDS, self.round, s.jobs_per_round * s.episodes_per_job
        scenario = replace(s.scenario, training=self.imitated)
        if not self.imitated:
            which = DEMONSTRATIONS, len(self.shown), s.imitation_episodes
            weights = now["robots"].weights if self.shown else {}
            now["robots"] = Demonstration(s.robots, weights, str(task.imitate))
        seeds = seeds_of(task.seed, *which)
        jobs, first = [], self.round * s.jobs_per_round
        for number, chunk in enumerate(chunks(seeds, s.episodes_per_job), first):
            who: Any = now | self._others(number)
            record = tuple(side for side in now if who[side] is now[side])
            jobs.append(Job(task.plan, scenario, **who, seeds=chunk, record=record))
        return jobs

    def _others(self, job: int) -> dict[Side, Any]:
        """Choose who plays a job without learning [E6, chosen].

        Fixed players take turns. While robots learn, scripted fires stand in for one
        that learns in a share of all jobs, evenly spread: from a strong adversary alone
        they would learn nothing.
        """
        fixed, share = self.task.fixed.items(), self.settings.random_fires
        others = {side: _player(side, who[job % len(who)]) for side, who in fixed}
        if self.imitated and self.calm:
            return others | {"fire": NoFire()}
        if "fire" in others or "robots" not in self.learning():
            return others
        if _due(job, share):
            names = self.settings.stand_ins
            return {"fire": FIRES[names[int(job * share) % len(names)]]()}
        return self._earlier(job - int(job * share))

    def _earlier(self, job: int) -> dict[Side, Any]:
        """Let a side play as it was earlier, in the league's share of jobs.

        [E6, chosen] So that neither forgets: fictitious play (Brown 1951). Robots and
        fire take turns, and so do their versions. job: among those without stand-ins.
        """
        if not _due(job, self.settings.league):
            return {}
        turn = int(job * self.settings.league)
        side = SIDES[turn % 2] if "fire" in self.learning() else "fire"
        past = [w for r, w in self.versions[side].items() if r < self.round]
        if not past:
            return {}
        weights = past[turn // 2 % len(past)]
        return {side: _player(side, Learned(getattr(self.settings, side), weights))}

    def _remember(self) -> None:
        """Add both sides to the league, as of now; keep versions at even distances."""
        spacing = 1
        while self.round // spacing > 2 * EARLIER:
            spacing *= 2
        for side, learner in self.learners.items():
            now = {n: t.clone() for n, t in learner.actor.state_dict().items()}
            versions = self.versions[side] | {self.round: now}
            self.versions[side] = {r: w for r, w in versions.items() if not r % spacing}

    def learn(self, episodes: Sequence[Episode]) -> list[Row]:
        """Update the learners whose turn it is; return the summary rows due.

        Raises SettingsError if in their first round they had nothing to decide.
        """
        if not self.imitated:
            return self._imitate(episodes)
        learning, facts = self.learning(), [episode.facts for episode in episodes]
        self.episodes += len(episodes)
        self.latest = {name: mean(f[name] for f in facts) for name in facts[0]}
        phase = "together" if len(learning) > 1 else learning[0]
        when = {"round": self.round + 1, "episodes": self.episodes, "phase": phase}
        rows: list[Row] = []
        for side in learning:
            learner, summary = self.learners[side], self.summaries[side]
            played = [e.facts for e in episodes if getattr(e, side) is not None]
            learner.add([t for e in episodes if (t := getattr(e, side)) is not None])
            update = self._update(side) if learner.full else {}
            if not learner.steps:
                raise SettingsError(
                    f"{side}: nothing to decide in a whole round. Give the scenario "
                    "more time, people, robots or sources."
                )
            summary.add(side, played or facts, update)
            means = summary.row(learner.steps, learner.settings.summary_freq)
            if means is not None:
                rows.append({"side": side, "step": learner.steps, **when, **means})
        self.round += 1
        if self.settings.league:
            self._remember()
        return rows

    def _update(self, side: Side) -> dict[str, float]:
        """Update a learner.

        [E1, chosen] A policy that was copied, or that learned elsewhere, stays as it is
        for `critic_rounds`; only its critic learns then.
        """
        learner, task = self.learners[side], self.task
        measured = figures(learner)
        given = side in task.initial or (side == "robots" and task.imitate is not None)
        alone = given and self.round < self.settings.critic_rounds
        learner.actor.requires_grad_(not alone)
        update = learner.update()
        learner.actor.requires_grad_(True)
        return measured | update

    def _imitate(self, demonstrations: Sequence[Episode]) -> list[Row]:
        """Clone all that was demonstrated; return a summary row for each epoch."""
        self.shown.append([e.robots for e in demonstrations if e.robots is not None])
        shown, epochs = [*chain(*self.shown)], self.settings.imitation_epochs
        losses = clone(self.learners["robots"], shown, epochs)
        self.imitated = len(self.shown) == self.settings.imitation_rounds
        self.shown = [] if self.imitated else self.shown  # it may be a gigabyte
        when = {"side": "robots", "step": 0, "round": 0, "episodes": 0}
        return [{**when, "phase": "imitation", PRETRAINING: loss} for loss in losses]

    # -- Reports --------------------------------------------------------------------

    def about(self) -> str:
        """Tell in a line who trains how, and how many decisions are left."""
        sides = ", ".join(f"{side} {who}" for side, who in self._who().items())
        title = building_of(self.task.plan).title
        return f"{title}: {sides}, seed {self.task.seed}; {self.left:,} decisions to go"

    def _who(self) -> dict[str, str]:
        """Name each side's trainer and head, or its fixed player."""
        both: dict[str, Any] = {side: getattr(self.settings, side) for side in SIDES}
        names = {side: f"{s.trainer_type} ({s.head} head)" for side, s in both.items()}
        return names | {side: names_of(who) for side, who in self.task.fixed.items()}

    def facts(self) -> dict[str, Any]:
        """Report players, progress, and the means of the last round's episodes."""
        told = ("fire_reward", "survival", "evacuated", "died")
        return {
            "preset": self.settings.preset,
            **self._who(),
            "seed": self.task.seed,
            "rounds": self.round,
            "episodes": self.episodes,
            "steps": {side: learner.steps for side, learner in self.learners.items()},
            "reward": self.latest.get("group_reward"),
            **{name: self.latest.get(name) for name in told},
        }

    # -- Checkpoints ----------------------------------------------------------------

    def checkpoint(self) -> Checkpoint:
        """Collect everything that is needed to resume."""
        learners = {
            side: state_of(who) | {"versions": self.versions[side]}
            for side, who in self.learners.items()
        }
        progress = Progress(
            self.episodes, self.imitated, self.kept, self.latest, self.summaries
        )
        return Checkpoint(self.task, self.round, learners, asdict(progress))

    @classmethod
    def resumed(cls, checkpoint: Checkpoint) -> "Training":
        """Restore a training. Raises ValueError and others where parts do not fit.

        Robots that have not copied all they were to copy begin anew.
        """
        training = cls(checkpoint.task)
        progress = record_from(Progress, checkpoint.progress, "progress")
        if not progress.imitated:
            return training
        training.round, training.episodes = checkpoint.round, progress.episodes
        training.imitated, training.latest = progress.imitated, progress.latest
        for side, learner in training.learners.items():
            restore(learner, checkpoint.learners[side])
            training.kept[side] = progress.kept[side]
            training.versions[side] = dict(checkpoint.learners[side]["versions"])
            training.summaries[side] = progress.summaries[side]
        return training


def _due(job: int, share: float) -> bool:
    """Whether a job is one of a share of all, evenly spread."""
    return int((job + 1) * share) > int(job * share)


def _player(side: Side, who: Learned | str) -> Any:
    """Make a player that does not learn; any process can have a network's arrays."""
    if isinstance(who, str):
        return SCRIPTS[side][who]()
    return replace(who, weights={n: w.numpy() for n, w in who.weights.items()})


# -- Learners -----------------------------------------------------------------------


def _learner(task: Task, side: Side) -> Learner:
    """Make a side's learner, with random networks or one to begin with."""
    settings, scenario = getattr(task.settings, side), task.settings.scenario
    row = "robots_per_floor" if side == "robots" else "sources"
    if not getattr(scenario, row):
        raise SettingsError(f"{side}: nothing to learn while {row} is 0")
    stood_in = task.settings.random_fires == 1 and "robots" not in task.fixed
    if side == "fire" and stood_in:
        raise SettingsError("fire: it never plays where random_fires is 1")
    (seed,) = seeds_of(task.seed, OF_LEARNERS, SIDES.index(side), 1)
    learner = learner_for(side, task.plan, scenario, settings, seed)
    if (who := task.initial.get(side)) is not None:
        for name in OF_NETWORK:
            if (theirs := getattr(who.settings, name)) != getattr(settings, name):
                raise SettingsError(
                    f"{side}: the network to begin with has {name} {theirs}. Write it "
                    "into the settings."
                )
        learner.actor.load_state_dict(dict(who.weights))
    return learner


def seeds_of(run: int, purpose: int, number: int, count: int) -> tuple[int, ...]:
    """Derive seeds from a run's seed, a purpose and a number."""
    sequence = np.random.SeedSequence(run, spawn_key=(purpose, number))
    return tuple(sequence.generate_state(count, np.uint64).tolist())
