"""The state of a training: learners, whose turn it is, and a round's jobs.

Clauses: C1, D1, D6, E1, E2, E3, E6.  Robots and fire play the same episodes and learn
from them, both at once or in turn, or one of them against somebody who does not learn.
"""

from collections.abc import Sequence
from dataclasses import replace
from statistics import mean
from typing import Any

import torch

from reference.building import building_of
from reference.learning.adversarial import learn, player_of
from reference.learning.players import Learned
from reference.learning.ppo import Learner
from reference.learning.rollouts import Episode, Job
from reference.learning.settings import SIDES, SettingsError, Side
from reference.strategies import RandomFire
from reference.workshop.plain import checked
from reference.workshop.strategies import FIRES, SCRIPTS
from reference.workshop.training.checkpoints import Checkpoint, Task, must_fit
from reference.workshop.training.imitation import Demonstration, clone
from reference.workshop.training.learners import (
    DEMONSTRATIONS,
    PAST,
    ROUNDS,
    learners_of,
    seeds_of,
)
from reference.workshop.training.states import restore, state_of
from reference.workshop.training.summaries import (
    OF_EPISODES,
    PRETRAINING,
    Row,
    Summary,
)
from reference.workshop.workers import chunks

PAST_EVERY, MOST_PAST = 5, 10
"""[E6, chosen] rounds between two fires that are remembered, and how many of them; when
there are more, every second is forgotten, and the rounds between two are doubled."""

FACTS = (*OF_EPISODES.values(), "fire_reward")  # of an episode


class Training:
    """Learners and their progress, which only `imitate` and `learn` change.

    round  rounds that are over;  episodes  that were learned from;  latest  means of
    the last round's facts;  imitated  whether copying, if asked for, is over
    past  weights of the fire as it was, oldest first, one every `past_every` rounds
    """

    def __init__(self, task: Task):
        """Make the learners. Raises what `learners_of` does."""
        self.task, self.settings = task, task.settings
        self.learners = learners_of(task)
        self.summaries = {
            side: Summary(side, learner.settings.summary_freq)
            for side, learner in self.learners.items()
        }
        self.round = self.episodes = 0
        self.imitated = task.imitate is None
        self.latest: dict[str, float] = {}
        self.past: list[dict[str, torch.Tensor]] = []
        self.past_every = PAST_EVERY

    # -- Whose turn it is -----------------------------------------------------------

    @property
    def over(self) -> bool:
        """Whether every side that learns is past its max_steps."""
        return not self._unfinished()

    def learning(self) -> tuple[Side, ...]:
        """The sides that learn in this round."""
        sides = self._unfinished()
        if self._critic_only():
            return self._known()
        if self.settings.schedule == "alternate" and len(sides) > 1:
            return (sides[self.round // self.settings.switch_every % len(sides)],)
        return sides

    @property
    def phase(self) -> str:
        """What a summary calls this round: together, robots, fire, or critic."""
        learning = self.learning()
        if self._critic_only():
            return "critic"
        return "together" if len(learning) > 1 else learning[0]

    def _unfinished(self) -> tuple[Side, ...]:
        both = self.learners.items()
        return tuple(side for side, who in both if who.steps < who.settings.max_steps)

    def _critic_only(self) -> bool:
        """Whether the critic alone learns, for some rounds and at least one update.

        What a policy that was learned or copied before is worth here is not known yet.
        """
        rounds, known = self.settings.critic_rounds, self._known()
        untaught = (not self.learners[side].optimiser.state for side in known)
        return bool(known and rounds) and (self.round < rounds or any(untaught))

    def _known(self) -> tuple[Side, ...]:
        """The sides that do not begin with a random policy."""
        copying: tuple[Side, ...] = ("robots",) if self.task.imitate else ()
        return (*copying, *self.task.initial)

    # -- Reports --------------------------------------------------------------------

    def about(self) -> str:
        """Tell in a line who trains how, and how many decisions are left."""
        sides = ", ".join(f"{side} {who}" for side, who in self._who().items())
        ends = ((who.settings.max_steps, who.steps) for who in self.learners.values())
        left = sum(max(0, end - steps) for end, steps in ends)
        shares = {"random": self.settings.random_fires}
        shares["past"] = self.settings.past_fires
        if len(self.learners) == len(SIDES):
            sides += "".join(f", {s:.0%} {of} fires" for of, s in shares.items() if s)
        title = building_of(self.task.plan).title
        return f"{title}: {sides}, seed {self.task.seed}; {left:,} decisions to go"

    def _who(self) -> dict[str, str]:
        """Name each side's trainer and head, or its fixed player."""
        names: dict[str, str] = {}
        for side in SIDES:
            who = self.learners.get(side) or self.task.fixed[side]
            if isinstance(who, Learner):
                settings = getattr(self.settings, side)
                who = f"{settings.trainer_type} ({settings.head} head)"
            names[side] = who if isinstance(who, str) else "a fixed checkpoint"
        return names

    @property
    def decisions(self) -> int:
        """How many decisions the learners have learned from."""
        return sum(learner.steps for learner in self.learners.values())

    def facts(self) -> dict[str, Any]:
        """Report players, progress, and the means of the last round's episodes."""
        names = ("fire_reward", "survival", "evacuated", "died")
        return {
            "preset": self.settings.preset,
            **self._who(),
            "seed": self.task.seed,
            "rounds": self.round,
            "episodes": self.episodes,
            "steps": {side: learner.steps for side, learner in self.learners.items()},
            "reward": self.latest.get("group_reward"),
            **{name: self.latest.get(name) for name in names},
        }

    # -- A round --------------------------------------------------------------------

    def jobs(self) -> list[Job]:
        """Make the round's jobs; seeds follow from the run's and the round's number."""
        s = self.settings
        count = s.jobs_per_round * s.episodes_per_job
        seeds = seeds_of(self.task.seed, ROUNDS, self.round, count)
        robots, learned = (self._player(side) for side in SIDES)
        fires = {"learned": learned, "random": RandomFire()}
        jobs = []
        for k, chunk in enumerate(chunks(seeds, s.episodes_per_job), self._first):
            name = self._fire(k)
            fire = self._past_fire(k, learned) if name == "past" else fires[name]
            jobs.append(Job(self.task.plan, s.scenario, robots, fire, chunk))
        return jobs

    @property
    def _first(self) -> int:
        """The number of the round's first job among all of the training."""
        return self.round * self.settings.jobs_per_round

    def _fire(self, job: int) -> str:
        """Choose a job's fire: "learned", or one that stands in [E6, chosen].

        While the robots learn, a share `random_fires` of all jobs has "random" fire and
        a share `past_fires` a "past" one, evenly spread: from one adversary alone they
        would learn its habits, or, if it is strong, nothing.
        """
        if "fire" not in self.learners or "robots" not in self.learning():
            return "learned"
        share, past = self.settings.random_fires, self.settings.past_fires
        if _due(job, share):
            return "random"
        others = job - int(job * share)  # of the jobs before, those without random fire
        due = past and _due(others, past / (1 - share))
        return "past" if due and self.past else "learned"

    def _past_fire(self, job: int, learned: Learned) -> Learned:
        """Draw one of the remembered fires for a job."""
        (seed,) = seeds_of(self.task.seed, PAST, job, 1)
        weights = self.past[seed % len(self.past)]
        copies = {name: tensor.numpy().copy() for name, tensor in weights.items()}
        return replace(learned, weights=copies)

    def _remember(self) -> None:
        """Remember the fire as it is, if robots are to meet it again, and it is due."""
        both = len(self.learners) == len(SIDES)
        if not (both and self.settings.past_fires) or self.round % self.past_every:
            return
        weights = self.learners["fire"].actor.state_dict()
        self.past.append({name: tensor.clone() for name, tensor in weights.items()})
        if len(self.past) > MOST_PAST:
            self.past, self.past_every = self.past[1::2], 2 * self.past_every

    def _player(self, side: Side) -> Any:
        """Make a side's player; networks are copies, which do not change in play."""
        if side in self.learners:
            learner = self.learners[side]
            return player_of(learner)
        who = self.task.fixed[side]
        if isinstance(who, str):
            return SCRIPTS[side][who]()
        weights = {name: tensor.numpy().copy() for name, tensor in who.weights.items()}
        return replace(who, weights=weights)

    def learn(self, episodes: Sequence[Episode]) -> list[Row]:
        """Update the learners whose turn it is; return the summary rows due.

        Raises SettingsError if in their first round they had nothing to decide, or if
        the last one ends before a network that was copied or given could learn.
        """
        phase, facts = self.phase, [episode.facts for episode in episodes]
        jobs = range(self._first, self._first + self.settings.jobs_per_round)
        played = {"robots": True, "fire": "learned" in map(self._fire, jobs)}
        episodes = self._without_past(episodes)
        self.episodes += len(episodes)
        self.latest = {name: mean(f[name] for f in facts) for name in facts[0]}
        when = {"round": self.round + 1, "episodes": self.episodes, "phase": phase}
        rows = []
        for side in self.learning():
            learner, summary = self.learners[side], self.summaries[side]
            update = learn(side, learner, episodes, phase == "critic")
            if played[side] and not learner.steps:
                raise SettingsError(
                    f"{side}: nothing to decide in {len(episodes)} episodes. Give the "
                    "scenario more time, people, robots or sources."
                )
            summary.add(_facts(episodes, side), update)
            rows.append(summary.row(learner.steps, when))
        self.round += 1
        if self._critic_only() and not set(self._known()) <= set(self._unfinished()):
            raise SettingsError(
                "max_steps ends before a policy that was learned or copied can learn: "
                "for critic_rounds its critic learns alone. Raise the one, or lower "
                "the other."
            )
        self._remember()
        return [row for row in rows if row is not None]

    def _without_past(self, episodes: Sequence[Episode]) -> list[Episode]:
        """Drop the fire's part of episodes that a past fire has played."""
        size = self.settings.episodes_per_job
        jobs = (self._first + k // size for k in range(len(episodes)))
        return [
            replace(episode, fire=None) if self._fire(job) == "past" else episode
            for job, episode in zip(jobs, episodes, strict=False)
        ]

    # -- Imitation ------------------------------------------------------------------

    def demonstrations(self) -> list[Job]:
        """Make the jobs of the teacher that robots copy first, with a scripted fire."""
        s, fire, teacher = self.settings, self.task.fixed.get("fire"), self.task.imitate
        seeds = seeds_of(self.task.seed, DEMONSTRATIONS, 0, s.imitation_episodes)
        assert teacher is not None
        robots = Demonstration(s.robots, teacher)
        scripted = FIRES[fire if isinstance(fire, str) else "random"]()
        return [
            Job(self.task.plan, s.scenario, robots, scripted, chunk)
            for chunk in chunks(seeds, s.episodes_per_job)
        ]

    def imitate(self, demonstrations: Sequence[Episode]) -> list[Row]:
        """Clone what was demonstrated; return a summary row for each epoch."""
        trajectories = [e.robots for e in demonstrations if e.robots is not None]
        epochs = self.settings.imitation_epochs
        losses = clone(self.learners["robots"], trajectories, epochs)
        self.imitated = True
        when = {"side": "robots", "step": 0, "round": 0, "episodes": 0}
        return [{**when, "phase": "imitation", PRETRAINING: loss} for loss in losses]

    # -- Checkpoints ----------------------------------------------------------------

    def checkpoint(self) -> Checkpoint:
        """Collect everything that is needed to resume."""
        learners = {side: state_of(who) for side, who in self.learners.items()}
        if self.past:
            learners["fire"] |= {"past": self.past, "past_every": self.past_every}
        progress = {
            "episodes": self.episodes,
            "imitated": self.imitated,
            "latest": self.latest,
            "summaries": {side: s.state() for side, s in self.summaries.items()},
        }
        return Checkpoint(self.task, self.round, learners, progress)

    @classmethod
    def resumed(cls, checkpoint: Checkpoint) -> "Training":
        """Restore a training. Raises CheckpointError if its parts do not fit."""
        training = cls(checkpoint.task)
        progress = checkpoint.progress
        with must_fit("networks do not fit its settings"):
            for side, learner in training.learners.items():
                restore(learner, checkpoint.learners[side])
                training.summaries[side].load(progress["summaries"][side])
            training._restore_past(checkpoint.learners.get("fire", {}))
            training.round = checkpoint.round
            training.episodes = checked("episodes", progress["episodes"], int)
            training.imitated = checked("imitated", progress["imitated"], bool)
            latest = checked("latest", progress["latest"], dict[str, float])
            training.latest = {name: latest[name] for name in FACTS if latest}
        return training

    def _restore_past(self, state: dict[str, Any]) -> None:
        """Remember the fires of a checkpoint. Raises ValueError for other networks."""
        self.past = checked("past", state.get("past", []), list)
        every = checked("past_every", state.get("past_every", PAST_EVERY), int)
        self.past_every = max(1, every)
        for weights in self.past:
            now = self.learners["fire"].actor.state_dict()
            if {n: t.shape for n, t in weights.items()} != {
                n: t.shape for n, t in now.items()
            }:
                raise ValueError("a past fire's network is of another shape")


def _facts(episodes: Sequence[Episode], side: Side) -> list[dict[str, float]]:
    """Facts of the episodes that a side has played; of all if it played none."""
    played = [episode for episode in episodes if getattr(episode, side) is not None]
    return [episode.facts for episode in played or episodes]


def _due(number: int, share: float) -> bool:
    """Tell whether, of jobs counted from 0, this one belongs to a share of them."""
    return int((number + 1) * share) > int(number * share)
