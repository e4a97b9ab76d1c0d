"""The state of a training: learners, whose turn it is, and a round's jobs.

Clauses: C1, D1, D6, E1, E2, E3, E6.  Robots and fire play the same episodes and learn
from them, both at once, or one of them against somebody who does not learn.
"""

from collections.abc import Sequence
from dataclasses import replace
from statistics import mean
from typing import Any

from reference.building import building_of
from reference.learning.adversarial import learn, player_of
from reference.learning.rollouts import Episode, Job
from reference.learning.settings import SIDES, Side
from reference.strategies import NoFire, RandomFire
from reference.workshop.plain import SettingsError, checked
from reference.workshop.strategies import FIRES, SCRIPTS
from reference.workshop.training.checkpoints import Checkpoint, Task, must_fit
from reference.workshop.training.imitation import Demonstration, clone
from reference.workshop.training.learners import (
    DEMONSTRATIONS,
    ROUNDS,
    learners_of,
    restore,
    seeds_of,
    state_of,
)
from reference.workshop.training.summaries import (
    OF_EPISODES,
    PRETRAINING,
    Row,
    Summary,
)
from reference.workshop.workers import chunks

FACTS = (*OF_EPISODES.values(), "fire_reward")  # of an episode


class Training:
    """Learners and their progress, which only `imitate` and `learn` change.

    round  rounds that are over;  episodes  that were learned from;  latest  means of
    the last round's facts;  imitated  whether copying, if asked for, is over
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

    # -- Whose turn it is -----------------------------------------------------------

    @property
    def over(self) -> bool:
        """Whether every side that learns is past its max_steps."""
        return not self.learning()

    def learning(self) -> tuple[Side, ...]:
        """The sides that learn in this round: those not past their max_steps."""
        both = self.learners.items()
        left = [side for side, who in both if who.steps < who.settings.max_steps]
        return tuple(side for side in left if side == "robots" or not self.calm)

    @property
    def calm(self) -> bool:
        """Whether nobody sets fires yet [E6, chosen]: robots learn the building first.

        To beginners fires are noise: what they lose to them hides what they do.
        """
        robots, share = self.learners.get("robots"), self.settings.calm
        return robots is not None and robots.steps < share * robots.settings.max_steps

    @property
    def phase(self) -> str:
        """What a summary calls this round: together, robots or fire."""
        learning = self.learning()
        return "together" if len(learning) > 1 else learning[0]

    # -- Reports --------------------------------------------------------------------

    def about(self) -> str:
        """Tell in a line who trains how, and how many decisions are left."""
        sides = ", ".join(f"{side} {who}" for side, who in self._who().items())
        ends = ((who.settings.max_steps, who.steps) for who in self.learners.values())
        left = sum(max(0, end - steps) for end, steps in ends)
        title = building_of(self.task.plan).title
        return f"{title}: {sides}, seed {self.task.seed}; {left:,} decisions to go"

    def _who(self) -> dict[str, str]:
        """Name each side's trainer and head, or its fixed player."""
        names: dict[str, str] = {}
        for side in SIDES:
            who, settings = self.task.fixed.get(side), getattr(self.settings, side)
            learner = f"{settings.trainer_type} ({settings.head} head)"
            fixed = who if isinstance(who, str) else "a fixed checkpoint"
            names[side] = learner if side in self.learners else fixed
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
        robots, fire = (self._player(side) for side in SIDES)
        fire = NoFire() if self.calm else fire
        first = self.round * s.jobs_per_round
        return [
            Job(
                self.task.plan,
                s.scenario,
                robots,
                RandomFire() if self._random_fire(number) else fire,
                chunk,
            )
            for number, chunk in enumerate(chunks(seeds, s.episodes_per_job), first)
        ]

    def _random_fire(self, job: int) -> bool:
        """Whether random fire stands in for the one that learns [E6, chosen].

        While the robots learn, it does in a share `random_fires` of all jobs, evenly
        spread: from a strong adversary alone they would learn nothing.
        """
        if self.calm or "fire" not in self.learners or "robots" not in self.learning():
            return False
        share = self.settings.random_fires
        return int((job + 1) * share) > int(job * share)

    def _player(self, side: Side) -> Any:
        """Make a side's player; networks are copies, which do not change in play."""
        if side in self.learners:
            return player_of(self.learners[side])
        who = self.task.fixed[side]
        if isinstance(who, str):
            return SCRIPTS[side][who]()
        weights = {name: tensor.numpy().copy() for name, tensor in who.weights.items()}
        return replace(who, weights=weights)

    def learn(self, episodes: Sequence[Episode]) -> list[Row]:
        """Update the learners whose turn it is; return the summary rows due.

        Raises SettingsError if in their first round they had nothing to decide.
        """
        phase, facts = self.phase, [episode.facts for episode in episodes]
        played = {"robots": True, "fire": self.settings.random_fires < 1}
        self.episodes += len(episodes)
        self.latest = {name: mean(f[name] for f in facts) for name in facts[0]}
        when = {"round": self.round + 1, "episodes": self.episodes, "phase": phase}
        rows = []
        for side in self.learning():
            learner, summary = self.learners[side], self.summaries[side]
            update = learn(side, learner, episodes)
            if played[side] and not learner.steps:
                raise SettingsError(
                    f"{side}: nothing to decide in {len(episodes)} episodes. Give the "
                    "scenario more time, people, robots or sources."
                )
            summary.add(_facts(episodes, side), update)
            rows.append(summary.row(learner.steps, when))
        self.round += 1
        return [row for row in rows if row is not None]

    # -- Imitation ------------------------------------------------------------------

    def demonstrations(self) -> list[Job]:
        """Make the jobs of the teacher that robots copy first, with a scripted fire."""
        s, fire, teacher = self.settings, self.task.fixed.get("fire"), self.task.imitate
        seeds = seeds_of(self.task.seed, DEMONSTRATIONS, 0, s.imitation_episodes)
        assert teacher is not None
        robots = Demonstration(s.robots, {}, teacher)
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
        progress = checkpoint.progress
        with must_fit("parts do not fit each other"):
            training = cls(checkpoint.task)
            for side, learner in training.learners.items():
                restore(learner, checkpoint.learners[side])
                training.summaries[side].load(progress["summaries"][side])
            training.round = checkpoint.round
            training.episodes = checked("episodes", progress["episodes"], int)
            training.imitated = checked("imitated", progress["imitated"], bool)
            latest = checked("latest", progress["latest"], dict[str, float])
            training.latest = {name: latest[name] for name in FACTS if latest}
        return training


def _facts(episodes: Sequence[Episode], side: Side) -> list[dict[str, float]]:
    """Facts of the episodes that a side has played; of all if it played none."""
    played = [episode for episode in episodes if getattr(episode, side) is not None]
    return [episode.facts for episode in played or episodes]
