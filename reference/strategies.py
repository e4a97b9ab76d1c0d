"""The simplest strategies: nobody and nothing, and places at random.

Clauses: C7, D2.  Better ones, and their names, are in the workshop's `strategies`.
"""

from collections.abc import Sequence

import numpy as np

from reference.building import Building, Kind
from reference.fire import Decision
from reference.robots import Destination
from reference.world import Robot, World


class NoRobots:
    """There are no robots, so nobody decides."""

    def decide(
        self, world: World, robots: Sequence[Robot], rng: np.random.Generator
    ) -> list[Destination | None]:
        """Nothing."""
        return [None] * len(robots)


class RandomRobots:
    """A random cell of the robot's floor."""

    def decide(
        self, world: World, robots: Sequence[Robot], rng: np.random.Generator
    ) -> list[Destination | None]:
        """Uniform over the rooms' cells."""
        return [_random_room_cell(world.building, r.floor, rng) for r in robots]


def _random_room_cell(
    building: Building, floor: int, rng: np.random.Generator
) -> Destination:
    cells = np.argwhere(building.kind[floor] == Kind.FLOOR)
    return building.metres(*rng.choice(cells).tolist())


class NoFire:
    """Nothing ever burns."""

    def decide(self, world: World, rng: np.random.Generator) -> None:
        """Never."""


class RandomFire:
    """A random cell of a random floor's rooms."""

    def decide(self, world: World, rng: np.random.Generator) -> Decision:
        """Uniform over floors first, then over the floor's room cells."""
        kind = world.building.kind
        floor = int(rng.integers(len(kind)))
        cells = np.argwhere(kind[floor] == Kind.FLOOR)
        return (floor, *world.building.metres(*rng.choice(cells).tolist()))
