"""Learned policies as strategies: a checkpoint can replace a strategy's name.

It decides as the hand-written ones do, in metres. A network with a head of sets plays
in every building, for any number of people, robots and sources; others where they have
learned. What ships as `learned` is one of each.
"""

import sys
from copy import copy
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

import reference
from reference.building import Building, building_of
from reference.learning.players import LearnedNetwork
from reference.learning.settings import Side
from reference.paper import Scenario
from reference.workshop.maps import load
from reference.workshop.storage.files import errors_naming
from reference.workshop.storage.numbers import paper_numbers
from reference.workshop.storage.runs import FileState, file_state, other_numbers
from reference.workshop.storage.workers import one_thread
from reference.workshop.strategies import ANY_MAP, ANYWHERE, LEARNED, SCRIPTS
from reference.workshop.strategies.trained import (
    Trained,
    TrainedFire,
    TrainedRobots,
    decide_all,
)
from reference.workshop.training.checkpoints import (
    Checkpoint,
    CheckpointError,
    checkpoint_file,
    load_checkpoint,
    must_fit,
)
from reference.workshop.training.families import HEADS_OF_SEVERAL
from reference.world import World

CHECKPOINTS_KEPT = 4  # files of checkpoints that were read last
POLICIES_KEPT = 8  # that were made last, and as many in other places


class LearnedPolicy(Trained):
    """One side of a checkpoint.

    learned  its network;  task  the training;  where  it has learned, in words
    title    what tables and pictures call it
    building, scenario  what it has learned in, the paper's building where it learned in
             several; of `playing_in`, where it plays
    """

    def __init__(self, source: str | Path | Checkpoint, sample: bool = False):
        """Take the mean or most likely action; with `sample`, draw from the policy.

        Raises CheckpointError for a file that is no checkpoint, or one in which this
        side was not learned; OSError for a file that cannot be read.
        """
        checkpoint = source if isinstance(source, Checkpoint) else _read(source)
        self.task = checkpoint.task
        family = self.task.family
        self.name = "paper" if family else self.task.building
        self.building = load("paper") if family else building_of(self.task.plan)
        self.where = family.about() if family else self.building.title
        self.varied = family.varied() if family else {}
        self.scenario = self.task.settings.scenario
        self.numbers = checkpoint.numbers

        name = "the checkpoint" if source is checkpoint else source
        self.title = ANY_MAP if source == ANYWHERE else str(name)
        who = checkpoint.learned(self.side)
        if who is None:
            raise CheckpointError(
                f"{name}: nobody learned for the {self.side} there. "
                + _instead(checkpoint.player(self.side), self.side)
            )
        self.learned = who
        self.sample = sample
        # Damaged files are refused here, not in the middle of an evaluation.
        made = checkpoint.version
        old = "" if made == reference.__version__ else f", made by version {made},"
        with must_fit(name, f"its network{old} does not fit its settings"):
            self.player = who.player(self.side, self.building, self.scenario)

    @property
    def anywhere(self) -> bool:
        """Whether there is no building in its network."""
        return getattr(self.learned.settings, "head", "") in HEADS_OF_SEVERAL

    def misfit(self, building: Building, scenario: Scenario) -> str:
        """Say why it cannot read such a world; nothing if it can."""
        if self.anywhere or self.title == LEARNED:
            return ""
        return super().misfit(building, scenario)

    def playing_in(self, building: Building, scenario: Scenario) -> "LearnedPolicy":
        """Return the policy that plays there; LEARNED is another one elsewhere.

        Raises InputError where none can.
        """
        if not super().misfit(building, scenario):
            return self
        if self.title == LEARNED:
            anywhere = _policy(type(self), ANYWHERE, self.sample)
            return anywhere.playing_in(building, scenario)
        self.refuse_elsewhere(building, scenario)
        if not _is_ours(type(self)):
            return self.copied_into(building, scenario)
        return _moved(self, building, scenario, _numbers())

    def copied_into(self, building: Building, scenario: Scenario) -> "LearnedPolicy":
        """Copy the policy into a world that it can read."""
        there = copy(self)
        there.building = building
        there.scenario = scenario
        if scenario.robots_per_floor or self.side == "fire":  # there is who decides
            there.player = self.learned.player(self.side, building, scenario)
        return there

    def decisions(
        self, vectors: np.ndarray, world: World, rng: np.random.Generator
    ) -> list[Any]:
        """A decision for each agent of the side, from (G, V) observations."""
        drawn_by = rng if self.sample else None
        with one_thread():  # as when it was trained: sums in one order
            (decided,) = decide_all(self.player, vectors[None], [world], [drawn_by])
        return decided


def _instead(who: LearnedNetwork | str, side: Side) -> str:
    """Say what to write for a player that a training held fixed."""
    if isinstance(who, str):
        return f"Write --{side} {who}, or name another checkpoint."
    return "A network of another training played: name the checkpoint that it is of."


def _read(source: str | Path) -> Checkpoint:
    """Read a checkpoint; one whose file is as when it was read last is kept.

    Raises as `load_checkpoint` does.
    """
    file = file_state(checkpoint_file(source))
    if file is None:
        return load_checkpoint(source)  # which says why
    return _players_in(source, file)


@lru_cache(maxsize=CHECKPOINTS_KEPT)
def _players_in(source: str | Path, file: FileState) -> Checkpoint:
    """Read a checkpoint without what only its training needs; nobody writes into it.

    file: that it is in; another one is read anew
    """
    whole = load_checkpoint(source)
    actors = {side: {"actor": state["actor"]} for side, state in whole.learners.items()}
    return replace(whole, learners=actors, progress={})


class LearnedRobots(LearnedPolicy, TrainedRobots):
    """Robots that a network guides [C5] [C7]."""


class LearnedFire(LearnedPolicy, TrainedFire):
    """A fire that a network lights [D2]."""


POLICIES: dict[Side, Any] = {"robots": LearnedRobots, "fire": LearnedFire}


def learned_policy(
    source: str | Path, side: Side, sample: bool = False
) -> LearnedPolicy:
    """Return the policy of a side in a checkpoint, as `LearnedPolicy` makes it.

    It remembers nothing, so that all may have the same one: it is kept, until its file
    or a number of the paper is another.
    """
    return _policy(POLICIES[side], source, sample)


def _policy(
    kind: type[LearnedPolicy], source: str | Path, sample: bool
) -> LearnedPolicy:
    """Return the policy of a kind that is kept, or make it."""
    file = file_state(checkpoint_file(source))
    if file is None or not _is_ours(kind):
        return kind(source, sample)  # or says why there is none
    return _made(kind, source, sample, file, _numbers())


@lru_cache(maxsize=POLICIES_KEPT)
def _made(
    kind: type[LearnedPolicy],
    source: str | Path,
    sample: bool,
    file: FileState,
    numbers: str,
) -> LearnedPolicy:
    """Make a policy; another file and other numbers make another one."""
    return kind(source, sample)


@lru_cache(maxsize=POLICIES_KEPT)
def _moved(
    policy: LearnedPolicy, building: Building, scenario: Scenario, numbers: str
) -> LearnedPolicy:
    """Copy a policy into another world; other numbers make another one."""
    return policy.copied_into(building, scenario)


def _is_ours(kind: type[LearnedPolicy]) -> bool:
    """Whether policies of a kind remember nothing; nobody knows of your own."""
    return kind in POLICIES.values()


def _numbers() -> str:
    """The paper's numbers: what a policy sees and does depends on them."""
    return repr(paper_numbers())


def fixed_player(
    word: str, side: Side, building: Building | None, scenario: Scenario
) -> LearnedNetwork | str:
    """A strategy's name, or the network of a checkpoint, as `network_of` says."""
    if word in SCRIPTS[side]:
        return word
    return network_of(word, side, building, scenario)


def network_of(
    word: str, side: Side, building: Building | None, scenario: Scenario
) -> LearnedNetwork:
    """The network of a checkpoint, or the one that ships; refuses one that misfits.

    building: None for several, of which the training itself refuses networks.
    Says on stderr if it learned with other numbers of the paper.
    """
    with errors_naming(f"{side} {word}"):
        if building is not None:
            policy = POLICIES[side](word).playing_in(building, scenario)
        else:
            policy = POLICIES[side](ANYWHERE if word == LEARNED else word)
    numbers = other_numbers(policy.numbers)
    if numbers:
        print(f"note: {side} {word}: learned with {numbers}", file=sys.stderr)
    return policy.learned
