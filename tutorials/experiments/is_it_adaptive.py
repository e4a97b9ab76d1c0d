"""Does a fire react to people, or does it repeat itself?

    python tutorials/experiments/is_it_adaptive.py learned

A fire is adaptive only if it does more harm than its own most frequent sequence: the
place that it lights most often first, second, and so on. The sequence is read from
other evacuations; then both burn in the same ones, in the paper's building. And
`guard`, who knows that sequence, meets the fire.
"""

import sys
from argparse import ArgumentParser
from collections import Counter, defaultdict

from evacuations import played, saved

from reference.workshop.commands.common import exit_status
from reference.workshop.commands.options import whole
from reference.workshop.comparing.intervals import format_interval, interval_of_mean
from reference.workshop.comparing.named import strategy_named
from reference.workshop.strategies.fires import FixedFire
from reference.workshop.strategies.guard import Guard


def most_frequent(runs):
    """Find the place lit most often first, second, and so on.

    Returns these places, and of each the share of runs in which it was lit then.
    """
    counts = defaultdict(Counter)  # of places, by their number in the sequence
    for run in runs:
        for number, source in enumerate(run.world.flames.sources):
            counts[number][source.floor, source.x, source.y] += 1
    places = []
    shares = []
    for number in sorted(counts):
        ((place, often),) = counts[number].most_common(1)
        places.append(place)
        shares.append(often / len(runs))
    return places, shares


def main():
    parser = ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("fire", metavar="FIRE")
    parser.add_argument("--robots", default="observer", metavar="S")
    parser.add_argument("--episodes", type=whole(2), default=60, metavar="N")
    parser.add_argument("--seed", type=whole(0), default=80_000, metavar="N")
    asked = parser.parse_args()
    robots = strategy_named(asked.robots, "robots")
    fire = strategy_named(asked.fire, "fire")
    seeds = range(asked.seed, asked.seed + asked.episodes)
    others = range(seeds.stop, seeds.stop + asked.episodes)
    places, shares = most_frequent(played(robots, fire, others))
    for (floor, x, y), share in zip(places, shares, strict=True):
        print(f"floor {floor + 1}, ({x:.1f}, {y:.1f}) in {share:.0%}")
    own = saved(played(robots, fire, seeds))
    repeated = saved(played(robots, FixedFire(places), seeds))
    guarded = saved(played(Guard(places), fire, seeds))
    print(f"{asked.robots} saves {own.mean():.1f} % from {asked.fire}, and")
    for values, words in ((repeated, "from its sequence"), (guarded, "as a guard")):
        more = format_interval(interval_of_mean(values - own), 1, ends=True)
        print(f"{more} points more {words}")


if __name__ == "__main__":
    sys.exit(exit_status(main))
