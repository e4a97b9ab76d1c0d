"""What could an adversary teach? A family of guides under every fire.

    python tutorials/experiments/what_is_there_to_learn.py

The value of adaptation: how much the guide that is best under a fire saves more there
than the guide that is best under random fire, on the same evacuations. Where it is
nothing, no adversary can teach, however well one learns. All guides know only what a
robot observes, and `guard` one sequence of fires.

The best of many looks better than it is where it was chosen. So half of the evacuations
choose, and the others tell what the choice is worth.
"""

import sys
from argparse import ArgumentParser
from contextlib import ExitStack
from functools import partial
from itertools import product
from math import inf
from unittest.mock import patch

import numpy as np
from evacuations import played, saved

from reference.workshop.commands.common import exit_status
from reference.workshop.commands.options import whole
from reference.workshop.comparing.intervals import format_interval, interval_of_mean
from reference.workshop.comparing.named import strategy_named
from reference.workshop.engine import make_ready
from reference.workshop.storage.workers import workers
from reference.workshop.strategies import guides
from reference.workshop.strategies.guard import Guard
from reference.workshop.strategies.guides import (
    Observer,
    Sweep,
    Way,
    as_observed,
    decide_in_turn,
    risk,
    safest_way,
    unguided,
)
from reference.workshop.strategies.traffic import ways_outside


class SweepAsObserved:
    """`sweep`, with a robot's knowledge."""

    def decide(self, world, robots, rng):
        return Sweep().decide(as_observed(world), robots, rng)


def as_observer(world, robots, way_of):
    """Decide as `observer`, but take another way out: way_of(outside, robot, led)."""
    seen = as_observed(world)
    outside = ways_outside(seen.building, risk(seen.building, seen.flames))
    on_stairs = seen.bodies.inside & ~seen.bodies.walking
    lost = unguided(seen) | on_stairs
    return decide_in_turn(seen, robots, lost, partial(way_of, outside), guides.DETOUR)


def way_by(outside, robot, landmark):
    """The way out by a landmark, wherever it is cheaper by another."""
    return Way(landmark, float(outside[landmark][robot.place]), outside[landmark])


class OneWayOutEach:
    """`observer`, but each robot of a floor keeps to a way out of its own."""

    def decide(self, world, robots, rng):
        def way_of(outside, robot, led):
            ways = world.building.ways_out(robot.floor)
            own = ways[robot.number % len(ways)]
            return way_by(outside, robot, own)

        return as_observer(world, robots, way_of)


class Faithful:
    """`observer`, but people who are led go on to their way out.

    Another has to be less than a third as far, flames counted.
    """

    def __init__(self):
        self.chosen = {}  # by robot, the way out of those it leads

    def decide(self, world, robots, rng):
        return as_observer(world, robots, self.way_of)

    def way_of(self, outside, robot, led):
        way = safest_way(outside, robot, led)
        kept = self.chosen.pop(robot.body, way.landmark)
        if not led:
            return way
        if outside[kept][robot.place] < 3 * way.here:
            way = way_by(outside, robot, kept)
        self.chosen[robot.body] = way.landmark
        return way


FAMILY = {
    "observer": (Observer, {}),
    "no detour": (Observer, {"DETOUR": 0.0}),
    "short detours": (Observer, {"DETOUR": 4.0}),
    "long detours": (Observer, {"DETOUR": 16.0}),
    "any detour": (Observer, {"DETOUR": inf}),
    "hasty": (Observer, {"FULL": 4, "TRIP": 1.0}),
    "bold": (Observer, {"SOON_COST": 0.0}),
    "careful": (Observer, {"SOON": 10.0, "SOON_COST": 8.0}),
    "a way out each": (OneWayOutEach, {}),
    "faithful": (Faithful, {}),
    "sweep as observed": (SweepAsObserved, {}),
    "guard": (Guard, {}),
}
"""A class, and which numbers of its module are others."""

UNDER = ("random", "busiest", "fixed", "closer", "greedy")


def saved_by(name, fire, seeds):
    """Per cent of people saved in each evacuation."""
    guide, changes = FAMILY[name]
    with ExitStack() as stack:
        for number, value in changes.items():
            stack.enter_context(patch.object(guides, number, value))
        return saved(played(guide(), strategy_named(fire, "fire"), seeds))


def best_of(found):
    """Who saves most in the first half of the evacuations."""
    return max(found, key=lambda name: halves(found[name])[0].mean())


def halves(values):
    """Those that choose, and those that tell what the choice is worth."""
    return np.array_split(values, 2)


def told(gain):
    """Points more, evacuation by evacuation: the mean, and its interval."""
    return format_interval(interval_of_mean(gain), 1, ends=True)


def main():
    parser = ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--episodes", type=whole(4), default=120, metavar="N")
    parser.add_argument("--seed", type=whole(0), default=70_000, metavar="N")
    parser.add_argument("--workers", type=whole(0), default=2, metavar="N")
    parser.add_argument("--fire", nargs="+", default=UNDER, metavar="S")
    asked = parser.parse_args()
    seeds = range(asked.seed, asked.seed + asked.episodes)
    make_ready()
    with workers(asked.workers) as pool:
        jobs = {
            (name, fire): pool.submit(saved_by, name, fire, seeds)
            for fire, name in product(asked.fire, FAMILY)
        }
        usual = None  # the best under the first fire
        for fire in asked.fire:
            found = {name: jobs[name, fire].result() for name in FAMILY}
            best = best_of(found)
            if usual is None:
                usual = best
            print(f"{fire}: {best} is the best in half of the evacuations")
            for other in sorted({"observer", usual} - {best}):
                chosen, fresh = halves(found[best] - found[other])
                print(f"    {chosen.mean():.1f} points more than {other} there", end="")
                print(f", {told(fresh)} in the others")
            for name in FAMILY:
                print(f"    {name:18}{found[name].mean():6.1f}", flush=True)


if __name__ == "__main__":
    sys.exit(exit_status(main))
