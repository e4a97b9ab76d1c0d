"""Robots that know where a fire will be lit next, and stand there.

A fire that repeats itself can be guarded against.

    p   place;  d  metres on foot
"""

from collections.abc import Sequence
from itertools import starmap

from numpy.random import Generator as Rng

from reference import paper
from reference.building import distance
from reference.fire import Decision
from reference.navigation import navigation_of
from reference.robots import Destinations, actual_target
from reference.workshop.strategies.fires import beside_ways_out, next_unburnt
from reference.workshop.strategies.guides import Observer
from reference.workshop.strategies.observed import decisions_to_next_fire
from reference.world import FireLit, Robot, World

SPARE = 1.0  # [C7, chosen] seconds that a robot plans to be early
BESIDE = 4.0  # [C7, chosen] metres: a fire so near a guarded cell saw the guard


class Guard:
    """Do as `observer`, but stand where `fixed` will light its next fire.

    [D6] No fire starts in a cell where a robot stands. The nearest robot of that floor
    sets off at the last decision that lets it arrive in time; it reckons with decisions
    every DECISION_SECONDS. If none can, or if Eq. 1 would send it elsewhere, all do as
    `observer`.

    It gives up for good when a fire is lit elsewhere though nobody stood in the cell,
    or within BESIDE of a cell where somebody stood. It then does as `observer`.
    """

    def __init__(self, places: Sequence[Decision] | None = None):
        """places: what the fire lights, in order; by default as `FixedFire`."""
        self.places = places
        # by number: where a source was awaited, and whether a robot stood there
        self._awaited: dict[int, tuple[Decision, bool]] = {}

    def decide(self, world: World, robots: Sequence[Robot], rng: Rng) -> Destinations:
        """Decide as `observer` for all but the one that has to go and guard."""
        destinations = Observer().decide(world, robots, rng)
        if self.places is None:
            self.places = beside_ways_out(world)
        awaited = next_unburnt(world, self.places)
        if awaited is None:
            return destinations

        # remember what a fire that repeats itself would do now
        sources = world.flames.sources
        p = navigation_of(world.building).place(*awaited)
        stood = any(robot.place == p for robot in world.robots)
        self._awaited[len(sources)] = awaited, stood

        if all(starmap(self._was_awaited, enumerate(sources))):
            guard = _who_sets_off(world, robots, awaited)
            if guard is not None:
                destinations[robots.index(guard)] = awaited[1:]
        return destinations

    def _was_awaited(self, number: int, source: FireLit) -> bool:
        """Does a source fit a fire that repeats itself?

        If nobody stood in the awaited cell, it must be lit there. If a robot did, it
        must not be lit within BESIDE: a fire that avoids the guard is no such fire.
        """
        if number not in self._awaited:
            return True
        lit = source.floor, source.x, source.y
        awaited, stood = self._awaited[number]
        if not stood:
            return lit == awaited
        return lit[0] != awaited[0] or distance(lit[1:], awaited[1:]) > BESIDE


def _who_sets_off(
    world: World, robots: Sequence[Robot], awaited: Decision
) -> Robot | None:
    """Find the robot that has to set off now to guard a cell in time; None if none.

    [D2] The nearest goes, with the last decision that lets it be there before the fire.
    """
    floor, x, y = awaited
    team = [robot for robot in robots if robot.floor == floor]
    if not team or actual_target(world.building, floor, x, y) != (x, y):
        return None
    nav = navigation_of(world.building)
    d = nav.distances([nav.place(floor, x, y)])
    nearest = min(team, key=lambda robot: d[robot.place])
    needs = SPARE + d[nearest.place] / paper.ROBOT_SPEED
    decisions = decisions_to_next_fire(world.time, paper.DECISION_SECONDS)
    spare = decisions * paper.DECISION_SECONDS - needs
    return nearest if 0 <= spare < paper.DECISION_SECONDS else None
