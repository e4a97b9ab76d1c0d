"""How many of the eight fires of `fixed` do robots stand in the way of?

    python tutorials/experiments/who_stands_in_the_way.py escort guard out/mine

`fixed` lights the same cells in the same order; one on which somebody stands lights
elsewhere. Of robots that know the order, such as `guard`, it is the plan. Of robots
that learned, it tells whether they have found it out. People stand in the way, too,
seldom: the row of `escort`, who never guards, says how often.
"""

import sys
from argparse import ArgumentParser

import numpy as np
from evacuations import played, saved

from reference import Simulation, load
from reference.workshop.commands.common import exit_status
from reference.workshop.commands.options import whole
from reference.workshop.comparing.intervals import format_interval, interval_of_mean
from reference.workshop.comparing.named import strategy_named
from reference.workshop.comparing.results import align_columns
from reference.workshop.engine import make_ready
from reference.workshop.storage.workers import workers
from reference.workshop.strategies.fires import FixedFire, beside_ways_out


def moved(run, order):
    """Which fires of the order are lit elsewhere in a run, (sources,) bool."""
    lit = [(one.floor, one.x, one.y) for one in run.world.flames.sources]
    asked = run.scenario.sources
    elsewhere = [place != usual for place, usual in zip(lit, order, strict=False)]
    return np.array(elsewhere + [False] * (asked - len(elsewhere)))


def row_of(name, seeds):
    """A row: who, survivors, fires moved in an evacuation, and of each the share."""
    order = beside_ways_out(Simulation(load("paper")).world)
    runs = played(strategy_named(name, "robots"), FixedFire(), seeds)
    of_runs = np.array([moved(run, order) for run in runs])
    figures = (saved(runs), of_runs.sum(axis=1))
    words = [format_interval(interval_of_mean(f), 1, ends=True) for f in figures]
    shares = [f"{share:.0%}" for share in of_runs.mean(axis=0)]
    return [name, *words, " ".join(f"{share:>4}" for share in shares)]


def main():
    parser = ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("robots", nargs="+", help="strategies, or folders of trainings")
    parser.add_argument("--episodes", type=whole(1), default=100, metavar="N")
    parser.add_argument("--seed", type=whole(0), default=5000, metavar="N")
    parser.add_argument("--workers", type=whole(0), default=2, metavar="N")
    asked = parser.parse_args()
    seeds = range(asked.seed, asked.seed + asked.episodes)
    make_ready()
    with workers(asked.workers) as pool:
        rows = pool.map(row_of, asked.robots, [seeds] * len(asked.robots))
        heads = ["robots", "survivors, %", "fires moved", "the 1st, 2nd, ... of them"]
        print(align_columns([heads, *rows], "<>><"))


if __name__ == "__main__":
    sys.exit(exit_status(main))
