"""Policies that have learned, as strategies: what all share, and yours on flat numbers.

class Guide(FlatRobots):  # in mine.py: `evaluate --robots sweep mine:Guide`
    def __init__(self):
        super().__init__(policy, "tiny", Scenario(people=12))

G  agents of a side;  V  numbers observed;  A  numbers of an action
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.random import Generator as Rng

from reference.building import Building
from reference.fire import Decision
from reference.game.codec import Moment, decision_in
from reference.game.environment import (
    FIRE,
    action_size,
    destination,
    fire_decision,
)
from reference.game.observations import (
    Layout,
    fire_vectors,
    robot_vectors,
    robots_at_work,
    vector_layout,
)
from reference.learning.settings import Side
from reference.paper import InputError, Scenario, check_action
from reference.robots import Destinations
from reference.workshop.maps import load, same_cells
from reference.world import Robot, World


class Trained(ABC):
    """A policy of one building and scenario; it remembers no decision.

    name, building, scenario  what it has learned in
    title  what tables and pictures call it, if not by the word that names it
    numbers  of the paper, by name, as they were then; none where nobody knows
    varied  least and most of the scenario's fields that were drawn by lot, by name
    """

    side: Side
    name: str
    building: Building
    scenario: Scenario
    title: str = ""
    numbers: Mapping[str, Any] = MappingProxyType({})
    varied: Mapping[str, tuple[int, ...]] = MappingProxyType({})

    def __deepcopy__(self, memo: dict[int, Any]) -> "Trained":
        """Itself: copies of a simulation share the network."""
        return self

    def misfit(self, building: Building, scenario: Scenario) -> str:
        """Say why the policy cannot read such a world; nothing if it can.

        It needs the same cells and numbers of people, robots, sources and seconds
        between decisions as in training. Names in the map, where people start, how far
        they see, how flames spread, rule D6 and the time limit may differ.
        """
        if not same_cells(self.building.drawing, building.drawing):
            return (
                f"it has learned in {self.building.title}, not in this drawing of "
                f"{building.title}. Name the building that it learned in."
            )
        return other_counts(self.side, building, self.scenario, scenario)

    def refuse_elsewhere(self, building: Building, scenario: Scenario) -> None:
        """Raise InputError unless the policy can read such a world."""
        if why := self.misfit(building, scenario):
            raise InputError(why)

    def playing_in(self, building: Building, scenario: Scenario) -> "Trained":
        """Return the policy that plays there, which may be another one.

        Raises InputError where none can.
        """
        self.refuse_elsewhere(building, scenario)
        return self

    def refuse_world(self, world: World) -> None:
        """Raise InputError for a world in which it does not play now.

        A fire also burns where nobody guides.
        """
        building = self.building
        here = world.building
        same = here is building or same_cells(here.drawing, building.drawing)
        people = sum(self.scenario.start_counts(building.floors))
        robots = self.scenario.robots_per_floor * building.floors
        counted = len(world.bodies) == people and len(world.robots) in (robots, 0)
        if not same or not counted:
            raise InputError(
                f"{self.title or self.name}: this policy plays in {building.title}, "
                f"with {people} people and {robots} robots. Play there; in code, take "
                "what its `playing_in(building, scenario)` returns."
            )

    @abstractmethod
    def decisions(self, vectors: np.ndarray, world: World, rng: Rng) -> list[Any]:
        """A decision for each agent of the side, from (G, V) observations."""


class TrainedRobots(Trained):
    """Robots that a policy guides [C5] [C7]."""

    side: Side = "robots"

    def decide(self, world: World, robots: Sequence[Robot], rng: Rng) -> Destinations:
        """Choose the next destination of each of these robots, metres."""
        if not robots:
            return []
        self.refuse_world(world)
        layout = vector_layout(world.building, self.scenario)
        (vectors,) = robot_vectors([world], layout)
        decided = self.decisions(vectors, world, rng)
        row = {robot.body: k for k, robot in enumerate(world.robots)}
        return [decided[row[robot.body]] for robot in robots]


class TrainedFire(Trained):
    """A fire that a policy lights [D2]."""

    side: Side = "fire"

    def decide(self, world: World, rng: Rng) -> Decision:
        """Choose floor and metres of the next source."""
        self.refuse_world(world)
        layout = vector_layout(world.building, self.scenario)
        (vectors,) = fire_vectors([world], layout)
        decided: Decision = self.decisions(vectors, world, rng)[0]
        return decided


def decide_all(
    player: Any, seen: np.ndarray, worlds: Sequence[World], rngs: Sequence[Rng | None]
) -> list[list[Any]]:
    """Decide for all agents of a side in each world, by one call of its network.

    player  of the side, see `learning.players`;  seen  (S, G, V) observations
    rngs    of each world, to draw from the policy; one is None: the likeliest of all
    """
    everybody = np.ones(seen.shape[:2], dtype=bool)
    given = zip(seen, everybody, worlds, rngs, strict=True)
    decided, _ = player.act([Moment(*one) for one in given])
    return [[decision_in(row) for row in rows] for rows in decided]


def refuse_other_counts(
    side: Side, building: Building, trained: Scenario, scenario: Scenario
) -> None:
    """Raise InputError where a policy's inputs would mean something else."""
    if why := other_counts(side, building, trained, scenario):
        raise InputError(why)


def other_counts(
    side: Side, building: Building, trained: Scenario, scenario: Scenario
) -> str:
    """Say which of a policy's inputs would mean something else; nothing if none.

    trained: the scenario in which the policy of a side has learned
    """
    own = _counts(building, trained)
    for name, count in _counts(building, scenario).items():
        if count != own[name]:
            return (
                f"its {side} learned with {name}={own[name]:g}; here it is {count:g}. "
                "Take the same, or train for it."
            )
    return ""


def _counts(building: Building, scenario: Scenario) -> dict[str, float]:
    """Collect the fields that a policy's inputs depend on; people wherever they are."""
    return {
        "people": sum(scenario.start_counts(building.floors)),
        "robots_per_floor": scenario.robots_per_floor,
        "sources": scenario.sources,
        "decision_seconds": scenario.decision_seconds,
    }


def flat_vectors(layout: Layout, vectors: np.ndarray) -> np.ndarray:
    """Scale observations (..., V) to float32 in [-1, 1], as `flat=True` shows them."""
    return layout.scaled(vectors).clip(-1, 1).astype(np.float32)


class Flat(Trained):
    """A policy on the observations of `parallel_env(..., flat=True)`.

    policy  (G, V) float32, a row for each agent of the side, zeros for who has left
            -> (G, A) in [-1, 1]
    """

    def __init__(
        self,
        policy: Callable[[np.ndarray], np.ndarray],
        building: str = "paper",
        scenario: Scenario | None = None,
    ):
        """building, scenario: those that it has learned in."""
        self.policy = policy
        self.scenario = Scenario() if scenario is None else scenario
        self.name = building
        self.building = load(building)
        self.layout = vector_layout(self.building, self.scenario)

    def decisions(self, vectors: np.ndarray, world: World, rng: Rng) -> list[Any]:
        """What the policy's actions, (G, A) in [-1, 1], mean in metres.

        Raises InputError for actions of another shape, and for what is no number.
        """
        seen = flat_vectors(self.layout, vectors)
        if self.side == "robots":
            seen[~robots_at_work(world)] = 0  # who has left, as `FlatEnvironment` shows
        read = destination if self.side == "robots" else fire_decision
        actions = self.policy(seen)
        if len(actions) != len(seen):
            raise InputError(f"a policy gave {len(actions)} actions for {len(seen)}")
        agent = FIRE if self.side == "fire" else "a robot"
        size = action_size(agent)
        found = []
        for action in actions:
            numbers = check_action(agent, {agent: action}, size, keep=agent != FIRE)
            found.append(read(self.building, numbers))
        return found


class FlatRobots(Flat, TrainedRobots):
    """Robots that such a policy guides."""


class FlatFire(Flat, TrainedFire):
    """A fire that such a policy lights."""
