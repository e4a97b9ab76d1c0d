"""Robots that know where a fire will be lit next, and stand there.

Clauses: C7, D2, D6.  A fire that repeats itself can be guarded against.

    p   place;  d  metres on foot
"""

from collections.abc import Sequence

from numpy.random import Generator as Rng

from reference import paper
from reference.fire import Decision
from reference.navigation import navigation_of
from reference.paper import ROBOT_SPEED
from reference.robots import Destinations, actual_target
from reference.workshop.strategies.fires import beside_ways_out
from reference.workshop.strategies.guides import Observer
from reference.world import Robot, World

SPARE = 1.0  # [C7, chosen] seconds that a robot plans to be early


class Guard(Observer):
    """Do as `observer`, but stand where `fixed` will light its next fire.

    [D6] No fire starts in a cell where a robot stands. The nearest robot of that floor
    sets off at the last decision that lets it arrive in time. If none can, or if Eq. 1
    would send it elsewhere, all do as `observer`.
    """

    def __init__(self, places: Sequence[Decision] | None = None):
        """places: what the fire lights, in order; by default as `FixedFire`."""
        self.places = places

    def decide(self, world: World, robots: Sequence[Robot], rng: Rng) -> Destinations:
        """Decide as `observer` for all but the one that has to go and guard."""
        destinations = super().decide(world, robots, rng)
        if self.places is None:
            self.places = beside_ways_out(world)
        if (lit := len(world.flames.sources)) < len(self.places):
            floor, x, y = self.places[lit]
            team = [robot for robot in robots if robot.floor == floor]
            if team and actual_target(world.building, floor, x, y) == (x, y):
                nav = navigation_of(world.building)
                d = nav.distances([nav.place(floor, x, y)])
                nearest = min(team, key=lambda robot: d[robot.place])
                needs = SPARE + d[nearest.place] / ROBOT_SPEED
                left = seconds_to_next_fire(world.time)
                if needs <= left < needs + paper.DECISION_SECONDS:
                    destinations[robots.index(nearest)] = x, y
        return destinations


def seconds_to_next_fire(time: float) -> float:
    """Seconds until the fire decides again, after its decision at this time [D2]."""
    every = paper.FIRE_EVERY_DECISIONS * paper.DECISION_SECONDS
    first = paper.FIRE_FIRST_DECISION * paper.DECISION_SECONDS
    return every - (time - first) % every if time >= first else first - time
