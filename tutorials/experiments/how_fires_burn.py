"""How fast flames spread and how long they burn: what that decides.

    python tutorials/experiments/how_fires_burn.py --spread 0.08 --burns 40

Per cent of people saved, and the robots' reward R, with other numbers than those of
`reference.paper`, on the same evacuations of the paper's building.
"""

import sys
from argparse import ArgumentParser
from itertools import product

import numpy as np
from evacuations import played, saved

from reference import Scenario
from reference.workshop.commands.common import exit_status
from reference.workshop.commands.options import whole
from reference.workshop.strategies import FIRES, ROBOTS


def main():
    parser = ArgumentParser(description=__doc__.split("\n")[0])
    usual = Scenario()
    parser.add_argument("--spread", type=float, default=usual.spread_rate)
    parser.add_argument("--burns", type=float, default=usual.burn_seconds)
    parser.add_argument("--episodes", type=whole(1), default=24, metavar="N")
    parser.add_argument("--seed", type=whole(0), default=98_001, metavar="N")
    guides = ["none", "sweep", "escort"]
    foes = ["random", "busiest", "fixed"]
    parser.add_argument("--robots", nargs="+", choices=ROBOTS, default=guides)
    parser.add_argument("--fire", nargs="+", choices=FIRES, default=foes)
    asked = parser.parse_args()
    seeds = range(asked.seed, asked.seed + asked.episodes)
    scenario = Scenario(spread_rate=asked.spread, burn_seconds=asked.burns)
    for robots, fire in product(asked.robots, asked.fire):
        runs = played(ROBOTS[robots](), FIRES[fire](), seeds, scenario)
        reward = np.mean([run.outcome().reward for run in runs])
        share = saved(runs).mean()
        print(f"{robots:8} {fire:8} {share:5.1f} {reward:8.0f}", flush=True)


if __name__ == "__main__":
    sys.exit(exit_status(main))
