"""What does a guard change? Where it stands no fire starts, so one starts elsewhere.

    python tutorials/experiments/where_guards_push_fires.py --picture cells.png

First, which of its watches count: `guard` that watches for one source only, under
`fixed`, which repeats itself, and under `closer`, which lights the next cell instead.
Then where `closer` would be pushed: nobody guards, and its second source is lit in each
of the cells nearest to that way out. Points more than `observer`, same evacuations.
"""

import sys
from argparse import ArgumentParser
from itertools import product

import numpy as np
from evacuations import played, saved
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.patches import Rectangle

from reference import load
from reference.fire import decision_at, lightable
from reference.navigation import navigation_of
from reference.workshop.commands.common import exit_status
from reference.workshop.commands.options import whole
from reference.workshop.comparing.intervals import format_interval, interval_of_mean
from reference.workshop.comparing.named import strategy_named
from reference.workshop.drawing import page
from reference.workshop.engine import make_ready
from reference.workshop.storage.workers import workers
from reference.workshop.strategies.fires import CloserFire, exits_first
from reference.workshop.strategies.guard import Guard
from reference.workshop.strategies.guides import Observer

BUILDING = "paper"
SECOND = 1  # the number of the source that both fires light at the second way out
CELLS = 12
MOST_SHADED = 12.0  # points
UNDER = ("fixed", "closer")


class Watch:
    """`guard`, but it stands in the way of some sources only, by number from 0 on."""

    def __init__(self, sources):
        self.sources = sources
        self.guard = Guard()

    def decide(self, world, robots, rng):
        answers = self.guard.decide(world, robots, rng)  # it remembers what it awaits
        if len(world.flames.sources) in self.sources:
            return answers
        return Observer().decide(world, robots, rng)


WATCHES = {
    "every source": range(99),
    "the first": range(1),
    "the second": range(SECOND, SECOND + 1),
    "all but the second": [k for k in range(99) if k != SECOND],
}


class Pushed(CloserFire):
    """`closer`, but its second source is lit in another cell."""

    def __init__(self, place):
        self.place = place

    def decide(self, world, rng):
        if len(world.flames.sources) == SECOND:
            return decision_at(world, self.place)
        return super().decide(world, rng)


def cells_at_second_way():
    """List the cells nearest to the second way out that fire may enter: places."""
    building = load(BUILDING)
    ways = [way for way in exits_first(building) if way.leads_out]
    metres = navigation_of(building).distance_to(ways[SECOND].index)
    metres = np.where(lightable(building).ravel(), metres, np.inf)
    return metres.argsort(kind="stable")[:CELLS].tolist()


def saved_by(robots, fire, seeds):
    """Per cent of people saved in each evacuation."""
    return saved(played(robots, fire, seeds))


def told(name, points):
    """A row: a name, and points with their interval."""
    words = format_interval(interval_of_mean(points), 1, signed=True, ends=True)
    print(f"    {name:24}{words:>22}", flush=True)


def picture(places, points):
    """Draw the cells of the second way out, and what a source in each changes."""
    building = load(BUILDING)
    nav = navigation_of(building)
    title = "Points gained if closer's second source burns elsewhere"
    figure = page.sheet(title, 8, 7.5)
    axes = figure.subplots()
    page.paint_floor(axes, building, 0)
    shades = ScalarMappable(Normalize(-MOST_SHADED, MOST_SHADED), "RdBu")
    for place, value in zip(places, points, strict=True):
        x, y = nav.centres[place].tolist()
        colour = shades.to_rgba(value)
        corner = x - 0.5, y - 0.5
        axes.add_patch(Rectangle(corner, 1, 1, ec=page.FAINT, fc=colour))
        ink = "white" if abs(value) > MOST_SHADED / 2 else page.TEXT
        gain = format_interval((value, value, value), 0, signed=True)
        words = "closer" if place == places[0] else gain.replace("-", "−")
        axes.annotate(words, (x, y), ha="center", va="center", size=9, color=ink)
    left, low = nav.centres[places].min(axis=0) - 2
    right, high = nav.centres[places].max(axis=0) + 2
    axes.set(xlim=(left, right), ylim=(low, high))
    return figure


def main():
    parser = ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--episodes", type=whole(2), default=100, metavar="N")
    parser.add_argument("--seed", type=whole(0), default=80_000, metavar="N")
    parser.add_argument("--workers", type=whole(0), default=2, metavar="N")
    parser.add_argument("--picture", metavar="FILE")
    asked = parser.parse_args()
    seeds = range(asked.seed, asked.seed + asked.episodes)
    places = cells_at_second_way()
    make_ready()
    with workers(asked.workers) as pool:
        fires = {name: strategy_named(name, "fire") for name in UNDER}
        usual = {
            name: pool.submit(saved_by, Observer(), fires[name], seeds)
            for name in UNDER
        }
        watched = {
            (fire, name): pool.submit(
                saved_by, Watch(WATCHES[name]), fires[fire], seeds
            )
            for fire, name in product(UNDER, WATCHES)
        }
        pushed = [
            pool.submit(saved_by, Observer(), Pushed(place), seeds) for place in places
        ]
        for fire in UNDER:
            base = usual[fire].result()
            print(f"{fire}: observer saves {base.mean():.1f}; with a guard for")
            for name in WATCHES:
                told(name, watched[fire, name].result() - base)
        print("closer: observer, with the second source in this cell")
        points = []
        for place, future in zip(places, pushed, strict=True):
            more = future.result() - usual["closer"].result()
            x, y = navigation_of(load(BUILDING)).centres[place].tolist()
            told(f"{x:.1f}, {y:.1f}", more)
            points.append(float(more.mean()))
    if asked.picture:
        print(page.save(picture(places, points), asked.picture))


if __name__ == "__main__":
    sys.exit(exit_status(main))
