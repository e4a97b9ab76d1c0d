"""Strategies: who decides for the robots and for the fire, an algorithm or a model.

Clauses: C7, D2.  The two interfaces and the simplest strategies behind them.
"""

from collections.abc import Sequence
from typing import Protocol

import numpy as np
from numpy.random import Generator as Rng

from reference.building import Building, Kind
from reference.fire import Decision, fuel
from reference.robots import Destination, Destinations
from reference.world import Robot, World


class RobotStrategy(Protocol):
    """Decides where the robots go next [C7]."""

    def decide(self, world: World, robots: Sequence[Robot], rng: Rng) -> Destinations:
        """The next destination of each of these robots; None keeps the old one."""


class FireStrategy(Protocol):
    """Decides where fires break out [D2]."""

    def decide(self, world: World, rng: Rng) -> Decision | None:
        """Floor and metres of the next source, or None for none."""


class NoRobots:
    """Nobody guides."""

    def decide(self, world: World, robots: Sequence[Robot], rng: Rng) -> Destinations:
        """Decide nothing."""
        return [None] * len(robots)


class RandomRobots:
    """Walk to random places, each on its floor."""

    def decide(self, world: World, robots: Sequence[Robot], rng: Rng) -> Destinations:
        """Draw uniformly from the floor's room cells."""
        building = world.building
        rooms = building.kind == Kind.FLOOR
        return [_random_cell(building, rooms[robot.floor], rng) for robot in robots]


class NoFire:
    """Nothing ever burns."""

    def decide(self, world: World, rng: Rng) -> None:
        """Decide nothing."""


class RandomFire:
    """Lights a random cell that may burn, on a random floor."""

    def decide(self, world: World, rng: Rng) -> Decision | None:
        """Draw the floor first, then one of its cells; None where nothing can burn."""
        building = world.building
        cells = fuel(building) & (building.kind == Kind.FLOOR)
        floors = np.flatnonzero(cells.any(axis=(1, 2)))
        if not len(floors):
            return None
        floor = int(rng.choice(floors))
        return (floor, *_random_cell(building, cells[floor], rng))


def _random_cell(building: Building, cells: np.ndarray, rng: Rng) -> Destination:
    """The middle, in metres, of one of these cells, (rows, cols) bool."""
    return building.metres(*rng.choice(np.argwhere(cells)).tolist())
