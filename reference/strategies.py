"""Strategies: who decides for the robots and for the fire, an algorithm or a model.

Clauses: C7, D2.  The two interfaces and the simplest strategies behind them.
"""

from collections.abc import Sequence
from typing import Protocol

import numpy as np

from reference.building import Building, Kind
from reference.fire import Decision
from reference.robots import Destination
from reference.world import Robot, World


class RobotStrategy(Protocol):
    """Decides where the robots go next [C7]."""

    def decide(
        self, world: World, robots: Sequence[Robot], rng: np.random.Generator
    ) -> list[Destination | None]:
        """The next destination of each of these robots; None keeps the old one."""


class FireStrategy(Protocol):
    """Decides where fires break out [D2]."""

    def decide(self, world: World, rng: np.random.Generator) -> Decision | None:
        """Floor and metres of the next source, or None for none."""


class NoRobots:
    """No robots at all."""

    def decide(
        self, world: World, robots: Sequence[Robot], rng: np.random.Generator
    ) -> list[Destination | None]:
        """Decide nothing."""
        return [None] * len(robots)


class RandomRobots:
    """Each robot walks to a random room cell of its floor."""

    def decide(
        self, world: World, robots: Sequence[Robot], rng: np.random.Generator
    ) -> list[Destination | None]:
        """Draw uniformly from the floor's room cells."""
        return [_random_room_cell(world.building, r.floor, rng) for r in robots]


class NoFire:
    """Nothing ever burns."""

    def decide(self, world: World, rng: np.random.Generator) -> None:
        """Decide nothing."""


class RandomFire:
    """A fire breaks out in a random room cell of a random floor."""

    def decide(self, world: World, rng: np.random.Generator) -> Decision:
        """Draw the floor first, then one of its room cells."""
        floor = int(rng.integers(world.building.floors))
        return (floor, *_random_room_cell(world.building, floor, rng))


def _random_room_cell(
    building: Building, floor: int, rng: np.random.Generator
) -> Destination:
    cells = np.argwhere(building.kind[floor] == Kind.FLOOR)
    return building.metres(*rng.choice(cells).tolist())
