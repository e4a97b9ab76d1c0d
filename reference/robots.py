"""Robots: Algorithm 3 and Eq. 1; who decides where they go.

X_r, Y_r    decided destination;  X_r', Y_r'  the actual one [C6]
p           place
"""

from collections.abc import Sequence
from functools import partial
from math import inf, sqrt
from typing import Protocol

import numpy as np
from numpy.random import Generator as Rng

from reference import paper
from reference.building import Building, distance, lengths
from reference.navigation import Navigation, navigation_of
from reference.world import NOWHERE, Robot, World

Destination = tuple[float, float]  # X_r, Y_r in metres [C5]
Destinations = list[Destination | None]  # of robots; None: it keeps the old one


class RobotAlgorithm:
    """Algorithm 3: one robot of one floor [C7, Alg. 3]."""

    def act(
        self, robot: Robot, world: World, decision: Destination | None, seconds: float
    ) -> None:
        """One pass of the loop, `seconds` long."""
        # "in this level": here, or above, from where people come through [C8, chosen]
        robot.active = world.anybody_at_or_above(robot.floor)  # 1
        if not robot.active:
            return

        nav = navigation_of(world.building)
        speed = speed_while_leading(robot, world)  # 2
        if decision is not None:  # 3
            target = actual_target(world.building, robot.floor, *decision)
            robot.destination = np.array(target)  # 4
            robot.says = said_on_the_way(world.building, robot.floor, target)  # 5
            goal = nav.nearest_free(robot.floor, *target)
            robot.way = nav.way(robot.place, goal, flame_cost(world, robot.floor))
        self._move(robot, nav, speed * seconds)  # 7

    @staticmethod
    def _move(robot: Robot, nav: Navigation, metres: float) -> None:
        """Walk along the way, as far as the metres carry."""
        x, y = robot.position.tolist()
        while robot.way and metres > 0:
            to_x, to_y = nav.centres[robot.way[0]].tolist()
            left = distance((x, y), (to_x, to_y))
            if left > metres:
                x += (to_x - x) * metres / left
                y += (to_y - y) * metres / left
                break
            robot.way.pop(0)
            metres -= left
            x = to_x
            y = to_y
        place = nav.place(robot.floor, x, y)
        if nav.walkable[place]:
            robot.position = np.array((x, y))
            robot.place = place
        else:  # it would cut a corner: go to its cell's middle first
            robot.way.insert(0, robot.place)


def speed_while_leading(robot: Robot, world: World) -> float:
    """Evacuate humans: return the speed (m/s) at which followers keep up [C7, chosen].

    0 while it waits for them. Followers who see the robot take up its instruction [B5].
    """
    followers = followers_of(world, robot)
    to_door = navigation_of(world.building).to_landmarks[robot.place]
    if not robot.way or not len(followers) or to_door < paper.DOORWAY_METRES:
        return paper.ROBOT_SPEED
    off = world.bodies.position[followers] - robot.position
    gap = float(lengths(off).cumsum()[-1]) / len(followers)  # `sum` adds in blocks
    waits = gap > paper.FOLLOWER_GAP + paper.CROWD_GAP * sqrt(len(followers))
    return 0.0 if waits else paper.ROBOT_SPEED


def followers_of(world: World, robot: Robot) -> np.ndarray:
    """(k,) people who follow a robot."""
    return (world.bodies.leader == robot.body).nonzero()[0]


def actual_target(building: Building, floor: int, x: float, y: float) -> Destination:
    """(X_r', Y_r'): the middle of the nearest stairwell if it is near, else (X_r, Y_r).

    [C6, Eq. 1], reconstructed; "near" is NEAR_STAIRWELL, and a destination at an exit
    that is nearer stays [C6, chosen]: else nobody could be led out beside stairs.
    """
    here = (x, y)
    wells = [well.centre for well in building.stairwells if floor in well.areas]
    middle = min(wells, key=partial(distance, here), default=here)
    to_stairs = distance(here, middle)
    to_exit, _ = nearest_exit(building, floor, here)
    at_exit = to_exit <= paper.AT_EXIT_METRES and to_exit < to_stairs
    return here if at_exit or to_stairs > paper.NEAR_STAIRWELL else middle


def said_on_the_way(building: Building, floor: int, target: Destination) -> int:
    """What to tell people on the way to a target [C7, Alg. 3:5]: a landmark's index.

    "This exit" near one, or "this stairwell" if its stairs go down; of several exits or
    entrances the nearest to the target. Else NOWHERE, "follow me" [C7, chosen].
    """
    for well in building.stairwells:
        if well.centre == target and well.leads_down(floor):  # Eq. 1 chose its middle
            entrances = [building.landmarks[k] for k in well.entrances[floor]]
            return min(entrances, key=lambda m: distance(m.position, target)).index
    metres, exit_ = nearest_exit(building, floor, target)
    return exit_ if metres <= paper.AT_EXIT_METRES else NOWHERE


def nearest_exit(
    building: Building, floor: int, point: Destination
) -> tuple[float, int]:
    """Metres to a floor's nearest exit, and its index; (inf, NOWHERE) without any."""
    exits = [building.landmarks[k] for k in building.exits]
    metres = [(distance(e.position, point), e.index) for e in exits if e.floor == floor]
    return min(metres, default=(inf, NOWHERE))


def flame_cost(world: World, floor: int) -> np.ndarray | None:
    """What a metre costs in each place, given flames on this floor; None without."""
    return world.flames.cost if world.flames.burning[floor].any() else None


# -- Who decides --------------------------------------------------------------------


class RobotStrategy(Protocol):
    """Decides where the robots go next [C7]."""

    def decide(self, world: World, robots: Sequence[Robot], rng: Rng) -> Destinations:
        """The next destination of each of these robots; None keeps the old one."""


class NoRobots:
    """Nobody guides."""

    def decide(self, world: World, robots: Sequence[Robot], rng: Rng) -> Destinations:
        """Decide nothing."""
        return [None] * len(robots)
