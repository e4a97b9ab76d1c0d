"""What drowns the signal of an update? The parts of a decision's noise.

    python tutorials/experiments/what_noise_is_made_of.py learned --fire busiest closer

At a decision drawn at random, a robot's action is drawn some times from its policy, its
mates' as often, and futures; all combinations are played to their end. How much of the
variance of the people saved is due to what? Only the first row can be learned from; the
state's part is what a critic can foresee. How: `workshop/measuring/variance.py`.
"""

import sys
from argparse import ArgumentParser
from functools import partial

import numpy as np

from reference import Scenario, Simulation, load
from reference.workshop.commands.common import exit_status
from reference.workshop.commands.options import whole
from reference.workshop.comparing.intervals import interval_of_mean
from reference.workshop.comparing.named import strategy_named
from reference.workshop.engine import make_ready, run_to_decision
from reference.workshop.measuring.variance import (
    OWN,
    PARTS,
    STATE,
    components,
    crossed,
    parts_of,
)
from reference.workshop.storage.workers import map_in_shares, one_thread, workers

ACTIONS = 3  # of the robot, and of its mates
FUTURES = 6


def results_of(robots, fire, seeds):
    """For each seed, people saved after a decision of its evacuation: (A, M, F)."""
    with one_thread():
        return [results_at(robots, fire, seed) for seed in seeds]


def results_at(robots, fire, seed):
    """Draw a decision of an evacuation, and a robot: people saved, (A, M, F)."""
    rng = np.random.default_rng([seed, 1])
    who = strategy_named(robots, "robots")
    foe = strategy_named(fire, "fire")
    run = Simulation(load("paper"), Scenario(), who, foe, seed)
    found = []
    while not run.done:
        team = [k for k, robot in enumerate(run.world.robots) if robot.active]
        if team:
            now = run.copy()
            found += [(now, robot) for robot in team]
        run_to_decision([run])
    now, robot = found[rng.integers(len(found))]
    futures = rng.integers(2**62, size=FUTURES).tolist()
    return crossed(now, now.world.robots[robot], ACTIONS, rng, futures)


def tell(fire, results):
    """Print each part's share of the whole variance, with its interval."""
    parts = parts_of(results)
    variance = sum(parts.values())
    people = results.mean()
    print(f"{fire}: {len(results)} decisions; {people:.1f} people saved", end="")
    print(f", deviation {variance**0.5:.2f}")
    for name in (OWN, *(part for part in PARTS if part != OWN)):
        words = f"    {name:32}{100 * parts[name] / variance:6.1f} %"
        if name != STATE:
            of_each = [components(one)[name] for one in results]
            _, low, high = interval_of_mean(of_each)
            words += f" [{100 * low / variance:.1f}, {100 * high / variance:.1f}]"
        print(words, flush=True)


def main():
    parser = ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("robots", metavar="S", help="learned, or a training's folder")
    parser.add_argument("--fire", nargs="+", default=["busiest", "closer"], metavar="S")
    parser.add_argument("--decisions", type=whole(1), default=100, metavar="N")
    parser.add_argument("--seed", type=whole(0), default=120_000, metavar="N")
    parser.add_argument("--workers", type=whole(0), default=2, metavar="N")
    asked = parser.parse_args()
    make_ready()
    seeds = range(asked.seed, asked.seed + asked.decisions)
    with workers(asked.workers) as pool:
        for name in asked.fire:
            work = partial(results_of, asked.robots, name)
            tell(name, np.stack(map_in_shares(pool, work, seeds)))


if __name__ == "__main__":
    sys.exit(exit_status(main))
