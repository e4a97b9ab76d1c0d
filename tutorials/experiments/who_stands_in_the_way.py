"""How many of the eight fires of `fixed` do robots stand in the way of?

    python tutorials/experiments/who_stands_in_the_way.py escort guard out/mine \\
        --picture out/guards.png

`fixed` lights the same cells in the same order; one on which somebody stands lights
elsewhere. Of robots that know the order, such as `guard`, it is the plan. Of robots
that learned, it tells whether they have found it out. People stand in the way, too,
seldom: the row of `escort`, who never guards, says how often.

The picture has a panel for each team: where its robots are when the second fire is due,
and where it burns then. The larger a mark, the more evacuations.
"""

import sys
from argparse import ArgumentParser
from pathlib import Path
from typing import NamedTuple

import numpy as np
from evacuations import played, saved

from reference import Simulation, load
from reference.workshop.commands.common import exit_status
from reference.workshop.commands.options import whole
from reference.workshop.comparing.intervals import format_interval, interval_of_mean
from reference.workshop.comparing.named import strategy_named
from reference.workshop.comparing.results import align_columns
from reference.workshop.drawing.evacuation import INK, SOURCE, marker
from reference.workshop.drawing.page import legend, paint_floor, samples, save, sheet
from reference.workshop.engine import make_ready
from reference.workshop.storage.workers import workers
from reference.workshop.strategies.fires import FixedFire, beside_ways_out


def moved(run, order):
    """Which fires of the order are lit elsewhere in a run, (sources,) bool."""
    lit = [(one.floor, one.x, one.y) for one in run.world.flames.sources]
    asked = run.scenario.sources
    elsewhere = [place != usual for place, usual in zip(lit, order, strict=False)]
    return np.array(elsewhere + [False] * (asked - len(elsewhere)))


class WatchingFire(FixedFire):
    """Lights as `fixed` does; remembers where robots were when the second was due.

    stood: (n, 2) metres, of those on the ground floor, where it burns
    """

    def __init__(self):
        super().__init__()
        self.stood = np.empty((0, 2))

    def decide(self, world, rng):
        if len(world.flames.sources) == 1:
            there = [robot.position for robot in world.robots if robot.floor == 0]
            self.stood = np.reshape(there, (-1, 2))
        return super().decide(world, rng)


class Found(NamedTuple):
    """What came of a team's evacuations.

    row    who, survivors, fires moved in an evacuation, and of each the share
    stood  (n, 2) metres: where robots were when the second fire was due
    burnt  (k, 2) metres: where it burnt
    """

    row: list[str]
    stood: np.ndarray
    burnt: np.ndarray


def found_of(name, seeds):
    """Play a team's evacuations; say what came of them."""
    order = beside_ways_out(Simulation(load("paper")).world)
    runs = played(strategy_named(name, "robots"), WatchingFire(), seeds)
    of_runs = np.array([moved(run, order) for run in runs])
    figures = (saved(runs), of_runs.sum(axis=1))
    words = [format_interval(interval_of_mean(f), 1, ends=True) for f in figures]
    shares = [f"{share:.0%}" for share in of_runs.mean(axis=0)]
    stood = [run.fire_strategy.stood for run in runs]
    sources = [run.world.flames.sources for run in runs]
    burnt = [(lit[1].x, lit[1].y) for lit in sources if len(lit) > 1]
    return Found(
        row=[name, *words, " ".join(f"{share:>4}" for share in shares)],
        stood=np.concatenate(stood),
        burnt=np.reshape(burnt, (-1, 2)),
    )


def drawn(found, titles, episodes):
    """Draw where robots are when the second fire is due, a panel for each team."""
    building = load("paper")
    title = "Where robots are when the second fire is due, and where it burns then"
    figure = sheet(title, 3.7 * len(found), 5)
    panels = figure.subplots(1, len(found), sharey=True, squeeze=False)[0]
    for axes, of_team, title in zip(panels, found, titles, strict=True):
        paint_floor(axes, building, 0, alpha=0.4)
        axes.set_title(title)
        _add_shares(axes, of_team.burnt, episodes, c=SOURCE, marker="*")
        _add_shares(axes, of_team.stood, episodes, c="none", ec=INK, marker="D", lw=1.5)
        axes.label_outer()
    robot = marker("D", 8, "none", INK, 1.5)
    fire = marker("*", 12, SOURCE, SOURCE, 0)
    told = f"areas: shares of {episodes} evacuations"
    none = marker("", 0, "none", "none", 0)
    legend(figure, samples({"a robot": robot, "the fire": fire, told: none}))
    return figure


def _add_shares(axes, spots, episodes, **look):
    """Mark the cells of (n, 2) metres; areas are shares of the evacuations."""
    cells, counts = np.unique(np.floor(spots), axis=0, return_counts=True)
    areas = 400 * counts / episodes
    axes.scatter(*(cells.T + 0.5), areas, **look, zorder=5, clip_on=False)


def main():
    parser = ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("robots", nargs="+", help="strategies, or folders of trainings")
    parser.add_argument("--episodes", type=whole(2), default=100, metavar="N")
    parser.add_argument("--seed", type=whole(0), default=5000, metavar="N")
    parser.add_argument("--workers", type=whole(0), default=2, metavar="N")
    parser.add_argument("--picture", type=Path, metavar="FILE")
    parser.add_argument("--titles", nargs="+", help="of its panels; default: the names")
    asked = parser.parse_args()
    seeds = range(asked.seed, asked.seed + asked.episodes)
    make_ready()
    titles = asked.titles or asked.robots
    if len(titles) != len(asked.robots):
        parser.error(f"--titles: write {len(asked.robots)}, one for each team")
    with workers(asked.workers) as pool:
        found = [*pool.map(found_of, asked.robots, [seeds] * len(asked.robots))]
    heads = ["robots", "survivors, %", "fires moved", "the 1st, 2nd, ... of them"]
    print(align_columns([heads, *(of_team.row for of_team in found)], "<>><"))
    if asked.picture:
        print(save(drawn(found, titles, asked.episodes), asked.picture))


if __name__ == "__main__":
    sys.exit(exit_status(main))
