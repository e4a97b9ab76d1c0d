"""A training: who learns, whose turn it is, and a round's jobs.

Robots and fire play the same episodes and learn from them [E6], both at once, or one of
them against somebody who does not learn.
"""

from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass, replace
from itertools import chain
from statistics import mean
from typing import Any

import numpy as np

from reference.building import building_of
from reference.fire import NoFire
from reference.learning.adversarial import learner_for, player_of, trajectories_of
from reference.learning.experience import Trajectory
from reference.learning.players import LearnedNetwork
from reference.learning.ppo import Learner
from reference.learning.rollouts import Episode, Job
from reference.learning.settings import SIDES, Side
from reference.paper import Scenario
from reference.simulation import Simulation
from reference.workshop.storage.records import SettingsError, record_from
from reference.workshop.storage.scenarios import differing, in_words
from reference.workshop.storage.words import unknown_name
from reference.workshop.storage.workers import chunks, one_thread, torch_threads
from reference.workshop.strategies import FIRES, SCRIPTS
from reference.workshop.training.batches import LEARNERS_OF_SEVERAL
from reference.workshop.training.checkpoints import (
    Checkpoint,
    Task,
    player_names,
    restore,
    state_of,
)
from reference.workshop.training.families import HEADS_OF_SEVERAL, Family, job_in
from reference.workshop.training.gradient import measure_signal
from reference.workshop.training.imitation import Demonstration, clone
from reference.workshop.training.summaries import (
    FACTS,
    PRETRAINING,
    RunningMeans,
    SummaryRow,
)

# What seeds are for: those of one purpose never meet another's.
OF_LEARNERS = 0
ROUNDS = 1
DEMONSTRATIONS = 2

NETWORK_ROWS = (
    "head",
    "hidden_units",
    "num_layers",
    "normalize",
    "commitment",
    "masks",
    "spread",
)
"""Rows of settings on which the meaning of a network's weights depends."""

NOBODY_INSIDE = "there is nobody to evacuate: raise people"

VERSIONS_KEPT = 4
"""[E6, chosen] earlier versions of a side in the league, at even distances: at least
these, at most twice as many."""


@dataclass(frozen=True)
class Progress:
    """What a checkpoint keeps of a training beside learners: see `Training`."""

    episodes: int
    imitated: bool
    kept: dict[Side, tuple[int, ...]]
    latest: dict[str, float]
    summaries: dict[Side, RunningMeans]

    def __post_init__(self) -> None:
        if self.latest and not {*FACTS} <= self.latest.keys():
            raise SettingsError("facts of the last round are missing")


class Training:
    """Learners and their progress, which only `learn` and `keep` change.

    round      how many rounds are over
    episodes   how many episodes were learned from
    latest     means of the last round's facts
    summaries  of each side, what waits for its next row
    kept       of each side, rounds of the checkpoints that it keeps, oldest first
    versions   of each side in the league, its actor's weights by earlier rounds
    imitated   whether copying a strategy, if that is asked for, is over
    shown      what that strategy has decided, a list for each round of copying
    """

    def __init__(self, task: Task):
        """Make a learner for each side that nobody else plays.

        Raises SettingsError if there is nothing to learn, or if a network to begin with
        means something else, and InputError for more people than fit into the building.
        """
        self.task = task
        self.settings = task.settings
        if task.family is None:
            _refuse_place(task.plan, task.settings.scenario)
        else:
            _refuse_family(task, task.family)
        self.learners = {s: _learner(task, s) for s in SIDES if s not in task.fixed}
        self.summaries = {side: RunningMeans(0, {}, {}) for side in self.learners}
        self.round = 0
        self.episodes = 0
        self.imitated = task.imitate is None
        self.shown: list[list[Trajectory]] = []
        self.latest: dict[str, float] = {}
        self.kept: dict[Side, tuple[int, ...]] = dict.fromkeys(self.learners, ())
        self.versions: dict[Side, dict[int, Any]] = {side: {} for side in self.learners}

    # -- Whose turn it is -----------------------------------------------------------

    @property
    def left(self) -> int:
        """How many decisions the learners have to go."""
        learners = self.learners.values()
        return sum(max(0, who.settings.max_steps - who.steps) for who in learners)

    @property
    def finished(self) -> bool:
        """Whether every side that learns has reached its max_steps."""
        return not self.left

    def learning(self) -> list[Side]:
        """The sides that learn in this round: those below their max_steps.

        A fire that learns waits while robots learn without fires, see `calm`.
        """
        sides: list[Side] = []
        for side, learner in self.learners.items():
            waits = side == "fire" and self.calm
            if learner.steps < learner.settings.max_steps and not waits:
                sides.append(side)
        return sides

    @property
    def calm(self) -> bool:
        """Whether nobody sets fires yet [E6, chosen]: robots learn the building first.

        To beginners fires are noise: what they lose to them hides what they do.
        """
        robots = self.learners.get("robots")
        if robots is None:
            return False
        return robots.steps < self.settings.calm * robots.settings.max_steps

    # -- A round --------------------------------------------------------------------

    def jobs(self) -> list[Job]:
        """Make the round's jobs; seeds follow from the run's and the round's number.

        Before the first round, robots that imitate ask their teacher.
        """
        players: dict[Side, Any] = {}
        for side, learner in self.learners.items():
            players[side] = player_of(learner)
        if self.imitated:
            return self._jobs_to_learn(players)
        return self._jobs_to_imitate(players)

    def _jobs_to_learn(self, players: dict[Side, Any]) -> list[Job]:
        """Make the jobs of a round in which all sides play as they have learned."""
        settings = self.settings
        episodes = settings.jobs_per_round * settings.episodes_per_job
        seeds = seeds_of(self.task.seed, ROUNDS, self.round, episodes)
        jobs = self._jobs_with(players, seeds)
        return self._in_family(jobs, ROUNDS, self.round * settings.jobs_per_round)

    def _jobs_to_imitate(self, players: dict[Side, Any]) -> list[Job]:
        """Make the jobs of a round of copying: robots ask their teacher.

        There a fire on an occupied place is moved, as in evaluation [D6, chosen]: one
        that the teacher guards against would else try the same place for ever.
        """
        settings = self.settings
        asked = len(self.shown)
        episodes = settings.imitation_episodes
        seeds = seeds_of(self.task.seed, DEMONSTRATIONS, asked, episodes)
        weights = players["robots"].weights if asked else {}
        teacher = str(self.task.imitate)
        players["robots"] = Demonstration(settings.robots, weights, teacher)
        jobs = [
            replace(job, record=("robots",)) for job in self._jobs_with(players, seeds)
        ]
        return self._in_family(jobs, DEMONSTRATIONS, asked * len(jobs))

    def _jobs_with(self, players: dict[Side, Any], seeds: Sequence[int]) -> list[Job]:
        """Share seeds among jobs, in each of which others may stand in for players."""
        settings = self.settings
        scenario = replace(settings.scenario, training=self.imitated)
        first = self.round * settings.jobs_per_round
        jobs: list[Job] = []
        shares = chunks(seeds, settings.episodes_per_job)
        for number, chunk in enumerate(shares, first):
            others = self._others(number)
            sides: Any = players | others
            record = tuple(side for side in players if side not in others)
            plan = self.task.plan
            jobs.append(Job(plan, scenario, **sides, seeds=chunk, record=record))
        return jobs

    def _in_family(self, jobs: list[Job], phase: int, before: int) -> list[Job]:
        """Give each job a building of the family, if there is one.

        before: jobs of this phase in earlier rounds
        """
        task = self.task
        if task.family is None:
            return jobs
        return [
            job_in(task.family, task.seed, phase, number, job)
            for number, job in enumerate(jobs, before)
        ]

    def _others(self, job: int) -> dict[Side, Any]:
        """Choose who plays a job without learning [E6, chosen].

        Fixed players take turns. While robots learn, scripted fires stand in for one
        that learns in a share of all jobs, evenly spread: from a strong adversary alone
        they would learn nothing.
        """
        others: dict[Side, Any] = {}
        for side, who in self.task.fixed.items():
            others[side] = _player(side, who[job % len(who)])
        if self.imitated and self.calm:
            return others | {"fire": NoFire()}
        if "fire" in others or "robots" not in self.learning():
            return others
        share = self.settings.random_fires
        before = int(job * share)  # jobs with stand-ins, of those before this one
        if _due(job, share):
            names = self.settings.stand_ins
            name = names[before % len(names)]
            return {"fire": FIRES[name]()}
        return self._earlier(job - before)

    def _sides_with_jobs(self) -> set[Side]:
        """The sides that play in this round: others may stand in all through."""
        first = self.round * self.settings.jobs_per_round
        jobs = range(first, first + self.settings.jobs_per_round)
        return {side for job in jobs for side in SIDES if side not in self._others(job)}

    def _earlier(self, job: int) -> dict[Side, Any]:
        """Let a side play as it was earlier, in the league's share of jobs.

        [E6, chosen] So that neither forgets: fictitious play (Brown 1951). Robots and
        fire take turns, and so do their versions. job: among those without stand-ins.
        """
        if not _due(job, self.settings.league):
            return {}
        turn = int(job * self.settings.league)  # league jobs before this one
        side = SIDES[turn % 2] if "fire" in self.learning() else "fire"
        versions = self.versions[side]
        past = [weights for number, weights in versions.items() if number < self.round]
        if not past:
            return {}
        # each side has every other turn, and goes through its versions in them
        weights = past[turn // 2 % len(past)]
        return {
            side: _player(side, LearnedNetwork(getattr(self.settings, side), weights))
        }

    def _remember(self) -> None:
        """Add both sides to the league, as of now; keep versions at even distances."""
        spacing = 1
        while self.round // spacing > 2 * VERSIONS_KEPT:
            spacing *= 2
        for side, learner in self.learners.items():
            # Copies: the actor's own tensors change at the next update.
            now = {n: t.clone() for n, t in learner.actor.state_dict().items()}
            versions = self.versions[side] | {self.round: now}
            self.versions[side] = {
                number: weights
                for number, weights in versions.items()
                if number % spacing == 0
            }

    def learn(self, episodes: Sequence[Episode]) -> list[SummaryRow]:
        """Update the learners whose turn it is; return the summary rows due.

        Raises SettingsError if in their first jobs they had nothing to decide.
        """
        with one_thread():
            if not self.imitated:
                return self._imitate(episodes)
            return self._learn(episodes)

    def _learn(self, episodes: Sequence[Episode]) -> list[SummaryRow]:
        learning = self.learning()
        facts = [episode.facts for episode in episodes]
        self.episodes += len(episodes)
        self.latest = {name: mean(f[name] for f in facts) for name in facts[0]}
        phase = "together" if len(learning) > 1 else learning[0]
        when = {"round": self.round + 1, "episodes": self.episodes, "phase": phase}
        with_jobs = self._sides_with_jobs()

        rows: list[SummaryRow] = []
        for side in learning:
            learner = self.learners[side]
            learner.add(trajectories_of(side, episodes))
            update = self._update(side) if learner.full else {}
            if not learner.steps and side in with_jobs:
                raise SettingsError(
                    f"{side}: nothing to decide in a whole round. Give the scenario "
                    "more time, people, robots or sources."
                )
            # Its own episodes' means, without those in which somebody stood in.
            played = [e.facts for e in episodes if getattr(e, side) is not None]
            summary = self.summaries[side]
            summary.add(side, played, update)
            means = summary.row(learner.steps, learner.settings.summary_freq)
            if means is not None:
                rows.append({"side": side, "step": learner.steps, **when, **means})

        self.round += 1
        if self.settings.league:
            self._remember()
        return rows

    def _update(self, side: Side) -> dict[str, float]:
        """Update a learner.

        [E1, chosen] The weights of a policy that was copied, or that learned elsewhere,
        stay as they are in the first `critic_rounds`; only its critic learns then. The
        first update is the critic's alone even if it comes later, as it may where the
        buffer takes many rounds to fill. With 0 critic_rounds both learn at once.
        """
        learner = self.learners[side]
        # before the update, which empties the buffer
        measured = measure_signal(learner)
        copied = side == "robots" and self.task.imitate is not None
        given = copied or side in self.task.initial
        never_updated = not learner.optimiser.state
        rounds = self.settings.critic_rounds
        critic_alone = given and rounds > 0 and (never_updated or self.round < rounds)
        learner.actor.requires_grad_(not critic_alone)
        with torch_threads(self.settings.threads):
            update = learner.update()
        learner.actor.requires_grad_(True)
        return measured | update

    def _imitate(self, demonstrations: Sequence[Episode]) -> list[SummaryRow]:
        """Clone all that was demonstrated; return a summary row for each epoch."""
        self.shown.append([e.robots for e in demonstrations if e.robots is not None])
        everything = list(chain.from_iterable(self.shown))
        epochs = self.settings.imitation_epochs
        losses = clone(self.learners["robots"], everything, epochs)
        self.imitated = len(self.shown) == self.settings.imitation_rounds
        if self.imitated:
            self.shown = []  # it may be gigabytes
        when = {"side": "robots", "step": 0, "round": 0, "episodes": 0}
        return [{**when, "phase": "imitation", PRETRAINING: loss} for loss in losses]

    # -- Reports --------------------------------------------------------------------

    def about(self) -> str:
        """Tell in a line where, under what and how who trains, and what is left."""
        sides = ", ".join(f"{side} {who}" for side, who in self._who().items())
        family = self.task.family
        where = family.about() if family else building_of(self.task.plan).title
        scenario = self.settings.scenario
        told = family.bounds() if family else {}
        changed = [x for x in differing(scenario, Scenario()) if x not in told]
        if changed:
            where += f", {in_words(scenario, changed)}"
        left = f"{self.left:,} decisions to go"
        if not self.imitated:
            left += f", once robots have copied {self.task.imitate}, from its beginning"
        if self.finished:
            left = "finished already, nothing is left to learn"
        return f"{where}: {sides}, seed {self.task.seed}; {left}"

    def _who(self) -> dict[str, str]:
        """Name each side's trainer and head, or its fixed player."""
        names: dict[str, str] = {}
        for side in SIDES:
            settings = getattr(self.settings, side)
            begun = ", begun from a network" if side in self.task.initial else ""
            names[side] = f"{settings.trainer_type} ({settings.head} head{begun})"
        return names | {
            side: player_names(who) for side, who in self.task.fixed.items()
        }

    def facts(self) -> dict[str, Any]:
        """Report players, progress, and the means of the last round's episodes.

        inside: people whom the time limit found there; None where buildings are by lot
        """
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
            "inside": self._mean_inside(),
        }

    def _mean_inside(self) -> float | None:
        """Average who was neither out nor dead when time was up, last round."""
        family = self.task.family
        if not self.latest or (family and not family.plans):
            return None
        floors = building_of(self.task.plans[0]).floors
        people = sum(self.settings.scenario.start_counts(floors))
        return people - self.latest["evacuated"] - self.latest["died"]

    # -- Checkpoints ----------------------------------------------------------------

    def keep(self, sides: Iterable[Side]) -> None:
        """Let sides keep this round's checkpoint: each its newest `keep_checkpoints`.

        [E1] [E2] Without repeats: at the end a side may keep the last round already.
        """
        for side in sides:
            most = self.learners[side].settings.keep_checkpoints
            rounds = dict.fromkeys([*self.kept[side], self.round])
            self.kept[side] = tuple(rounds)[-most:]

    def checkpoint(self) -> Checkpoint:
        """Collect everything that is needed to resume."""
        learners = {
            side: state_of(who, self.versions[side])
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
        task = checkpoint.task
        training = cls(task)
        building = building_of(task.plans[0])  # of a family: an example
        # What cannot play fails here, not in a worker.
        for side, players in task.fixed.items():
            if side not in SIDES or not players:
                raise ValueError(f"nobody plays {side!s:.60}")
            for who in players:
                if isinstance(who, LearnedNetwork):
                    who.player(side, building, task.settings.scenario)
                elif who not in SCRIPTS[side]:
                    raise ValueError(f"{side} {unknown_name(who, SCRIPTS[side])}")
        progress = record_from(Progress, checkpoint.progress, "progress")
        if not progress.imitated:
            return training
        training.round = checkpoint.round
        training.episodes = progress.episodes
        training.imitated = progress.imitated
        training.latest = progress.latest
        for side, learner in training.learners.items():
            state = checkpoint.learners[side]
            restore(learner, state)
            training.kept[side] = progress.kept[side]
            training.versions[side] = dict(state["versions"])
            training.summaries[side] = progress.summaries[side]
        return training


def _due(job: int, share: float) -> bool:
    """Whether a job is one of a share of all, evenly spread.

    It is where the whole part of share × jobs grows: with 0.4 jobs 2, 4, 7, 9, ... No
    draws, so no luck.
    """
    return int((job + 1) * share) > int(job * share)


def _player(side: Side, who: LearnedNetwork | str) -> Any:
    """Make a player that does not learn; any process can have a network's arrays."""
    if isinstance(who, str):
        return SCRIPTS[side][who]()
    arrays = {name: weight.numpy() for name, weight in who.weights.items()}
    return replace(who, weights=arrays)


def _refuse_place(plan: str, scenario: Scenario) -> None:
    """Refuse here what would fail in a worker. Raises SettingsError, ValueError."""
    building = building_of(plan)
    if not sum(scenario.start_counts(building.floors)):
        raise SettingsError(NOBODY_INSIDE)
    Simulation(building, scenario)


def _refuse_family(task: Task, family: Family) -> None:
    """Refuse heads that know one building, and maps in which people do not fit."""
    for plan in family.plans:
        _refuse_place(plan, task.settings.scenario)
    if not max(family.people):
        raise SettingsError(NOBODY_INSIDE)
    for side in SIDES:
        played = task.fixed.get(side)
        if played is None:
            tables = [getattr(task.settings, side)]
        else:
            tables = [who.settings for who in played if not isinstance(who, str)]
        heads = [table.head for table in tables]
        for head in {*heads} - {*HEADS_OF_SEVERAL}:
            raise SettingsError(
                f"{side}: head {head} knows one building, and here are several. Take "
                "--head set."
            )


# -- Learners -----------------------------------------------------------------------


def _learner(task: Task, side: Side) -> Learner:
    """Make a side's learner [E1] [E2], with random networks or one to begin with."""
    settings = getattr(task.settings, side)
    scenario = task.settings.scenario
    row = "robots_per_floor" if side == "robots" else "sources"
    if not getattr(scenario, row):
        raise SettingsError(f"{side}: nothing to learn while {row} is 0")
    stood_in = task.settings.random_fires == 1 and "robots" not in task.fixed
    if side == "fire" and stood_in:
        raise SettingsError("fire: it never plays where random_fires is 1")
    (seed,) = seeds_of(task.seed, OF_LEARNERS, SIDES.index(side), 1)
    if task.family is None:
        learner = learner_for(side, task.plan, scenario, settings, seed)
    else:
        sizes = settings.codec(side, building_of(task.plans[0]), scenario).sizes
        learner = LEARNERS_OF_SEVERAL[settings.trainer_type](settings, sizes, seed)
    who = task.initial.get(side)
    if who is not None:
        theirs = {name: getattr(who.settings, name) for name in NETWORK_ROWS}
        others = [
            name for name in NETWORK_ROWS if theirs[name] != getattr(settings, name)
        ]
        if others:
            has = ", ".join(f"{name} {theirs[name]}" for name in others)
            raise SettingsError(
                f"{side}: the network to begin with has {has}. Ask for nothing else."
            )
        learner.actor.load_state_dict(dict(who.weights))
    return learner


def seeds_of(run: int, purpose: int, number: int, count: int) -> tuple[int, ...]:
    """Derive seeds from a run's seed, a purpose and a number."""
    sequence = np.random.SeedSequence(run, spawn_key=(purpose, number))
    return tuple(sequence.generate_state(count, np.uint64).tolist())
