"""What could an adversary teach? A family of guides under every fire.

    python tutorials/experiments/what_is_there_to_learn.py

The value of adaptation: how much the guide that is best under a fire saves more there
than the guide that is best under random fire, on the same evacuations. Where it is
nothing, no adversary can teach, however well one learns. All guides know only what a
robot observes, and `guard` one sequence of fires.
"""

from argparse import ArgumentParser
from concurrent.futures import ProcessPoolExecutor
from itertools import product
from math import inf
from unittest.mock import patch

import numpy as np

from reference import Scenario, Simulation, load
from reference.workshop.comparing.intervals import of_mean
from reference.workshop.comparing.named import strategy_named
from reference.workshop.lockstep import to_the_end
from reference.workshop.storage.workers import one_thread
from reference.workshop.strategies import guides
from reference.workshop.strategies.guard import Guard
from reference.workshop.strategies.guides import Observer, Sweep, as_observed


class SweepAsObserved(Sweep):
    """`sweep`, with a robot's knowledge."""

    def decide(self, world, robots, rng):
        return super().decide(as_observed(world), robots, rng)


class OneWayOutEach(Observer):
    """`observer`, but each robot of a floor keeps to a way out of its own."""

    def _way_out(self, world, robot, d, led):
        ways = world.building.ways_out(robot.floor)
        on = self._outside[ways[robot.number % len(ways)]]
        return ways[robot.number % len(ways)], on, float(on[robot.place])


class Faithful(Observer):
    """`observer`, but people who are led go on to their way out.

    Another has to be less than a third as far, flames counted.
    """

    def __init__(self):
        self.chosen = {}  # by robot, the way out of those it leads

    def _way_out(self, world, robot, d, led):
        way, on, here = super()._way_out(world, robot, d, led)
        kept = self.chosen.get(robot.body, way)
        if not led:
            self.chosen.pop(robot.body, None)
            return way, on, here
        if self._outside[kept, robot.place] < 3 * here:
            way, on = kept, self._outside[kept]
        self.chosen[robot.body] = way
        return way, on, float(on[robot.place])


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
"""A class, and what is different in it or in its module."""

UNDER = ("random", "busiest", "fixed", "closer", "greedy")


def saved(name, fire, seeds):
    """Per cent of people saved in each evacuation."""
    guide, differs = FAMILY[name]
    owner = {key: guide if hasattr(guide, key) else guides for key in differs}
    patches = [patch.object(owner[key], key, value) for key, value in differs.items()]
    for one in patches:
        one.start()
    runs = [
        Simulation(
            load("paper"), Scenario(), guide(), strategy_named(fire, "fire"), seed
        )
        for seed in seeds
    ]
    with one_thread():
        to_the_end(runs)
    patch.stopall()
    return np.array([100 * r.outcome().evacuated / r.outcome().people for r in runs])


if __name__ == "__main__":
    parser = ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--episodes", type=int, default=60, metavar="N")
    parser.add_argument("--seed", type=int, default=70_000, metavar="N")
    parser.add_argument("--workers", type=int, default=2, metavar="N")
    parser.add_argument("--fire", nargs="+", default=UNDER, metavar="S")
    asked = parser.parse_args()
    seeds = range(asked.seed, asked.seed + asked.episodes)
    with ProcessPoolExecutor(asked.workers) as pool:
        jobs = {
            (name, fire): pool.submit(saved, name, fire, seeds)
            for fire, name in product(asked.fire, FAMILY)
        }
        usual = ""  # best under the first fire
        for fire in asked.fire:
            found = {name: jobs[name, fire].result() for name in FAMILY}
            best = max(FAMILY, key=lambda name: found[name].mean())
            usual = usual or best
            more, low, high = of_mean(found[best] - found[usual])
            print(f"{fire}: {best} saves {more:.1f} [{low:.1f}, {high:.1f}] points")
            print(f"more than {usual}, the best under {asked.fire[0]}")
            for name in FAMILY:
                print(f"    {name:18}{found[name].mean():6.1f}", flush=True)
