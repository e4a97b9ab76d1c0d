"""The fire generator: from a decision to a source of fire, Eqs. 2-3 and rule D6.

Clauses: D2, D3, D4, D5, D6.

    p       place
    X, Y    what the fire agent decides, metres;  X', Y'  where the source appears
"""

from math import floor as floor_of

import numpy as np
from numpy.random import Generator as Rng

from reference.building import Building, Kind
from reference.events import FireRefused
from reference.flames import fuel
from reference.navigation import navigation_of
from reference.paper import FIRE_EVERY_DECISIONS, FIRE_FIRST_DECISION, Scenario
from reference.world import Source, World

Decision = tuple[int, float, float]
"""What the fire agent decides: floor, X, Y [D2]."""


def fire_acts(number: int) -> bool:
    """Is the fire's action read at the robots' decision of this number, from 0? [D2]"""
    since_first = number - FIRE_FIRST_DECISION
    return since_first >= 0 and since_first % FIRE_EVERY_DECISIONS == 0


def snapped(x: float) -> float:
    """Centre of the grid cell nearest to a coordinate [D3, Eq. 2] [D5, Eq. 3].

    Written as printed; with the floor of x its first branch is never taken [D4].
    """
    below = floor_of(x)
    if abs(below - x + 0.5) > abs(below - x - 0.5):
        return below - 0.5
    return below + 0.5


class Generator:
    """The fire source generator: Eqs. 2-3, and rule D6 in both modes.

    [D6, chosen] If another place burns, it is the first free one in an order drawn
    once per run: with the same seed the same refused places lead to the same fires,
    whoever guides.
    """

    def __init__(self, building: Building, scenario: Scenario, rng: Rng):
        self.sources, self.training = scenario.sources, scenario.training
        self.order = rng.permutation(building.kind.size)

    def generate(self, world: World, decision: Decision) -> Source | FireRefused:
        """Turn a decision into a source, or say why there is none [D6].

        In training an occupied place yields no fire; otherwise another free one burns.
        """
        floor, x, y = decision[0], snapped(decision[1]), snapped(decision[2])
        if len(world.flames.sources) >= self.sources:
            return FireRefused(world.time, floor, x, y, "no sources left")
        occupant = occupied(world, floor, x, y)
        if occupant and self.training:
            return FireRefused(world.time, floor, x, y, occupant)
        if occupant:
            free = free_places(world)[self.order]
            if not free.any():
                return FireRefused(world.time, floor, x, y, "no free place left")
            floor, x, y = decision_at(world, self.order[free.argmax()])
        return Source(floor, x, y, world.time)


def occupied(world: World, floor: int, x: float, y: float) -> str:
    """What occupies a position, in one word; empty when it is free [D6, chosen]."""
    row, col = world.building.cell(x, y)
    floors, rows, cols = world.building.kind.shape
    if not (0 <= floor < floors and 0 <= row < rows and 0 <= col < cols):
        return "outside"
    kind = Kind(int(world.building.kind[floor, row, col]))
    if kind is not Kind.FLOOR:
        return kind.name.lower()
    if not fuel(world.building)[floor, row, col]:
        return "protected"
    if world.flames.burning[floor, row, col]:
        return "fire"
    p = navigation_of(world.building).place(floor, x, y)
    if any(robot.place == p for robot in world.robots):
        return "robot"
    return "human" if (world.bodies.place[world.bodies.walking] == p).any() else ""


def free_places(world: World) -> np.ndarray:
    """(places,) bool: unprotected room cells without flames, human or robot [D6]."""
    room = world.building.kind == Kind.FLOOR
    free = (room & fuel(world.building) & ~world.flames.burning).ravel()
    free[world.bodies.place[world.bodies.walking]] = False
    free[[robot.place for robot in world.robots]] = False
    return free


def decision_at(world: World, p: int) -> Decision:
    """The decision that lights a place."""
    nav = navigation_of(world.building)
    x, y = nav.centres[p].tolist()
    return int(p) // nav.floor_size, x, y
