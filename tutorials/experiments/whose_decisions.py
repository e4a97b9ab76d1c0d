"""Which decisions cost a team people? Another team makes one kind of them instead.

    python tutorials/experiments/whose_decisions.py out/DIR --other observer

Each robot asks both teams, and does what its own says, unless the two differ in one of
KINDS. In the paper's building, the same evacuations for every kind.
"""

import sys
from argparse import ArgumentParser
from collections import Counter

from evacuations import played, saved

from reference.robots import actual_target, followers_of, said_on_the_way
from reference.workshop.commands.common import exit_status
from reference.workshop.commands.options import whole
from reference.workshop.comparing.intervals import format_interval, interval_of_mean
from reference.workshop.comparing.named import strategy_named
from reference.world import NOWHERE

KINDS = {
    "alone": "nobody follows",
    "fetches": "people follow; it leads them out, the other fetches more",
    "leads": "people follow; it fetches more, the other leads them out",
    "where": "people follow; both lead them out, by different ways",
    "whom": "people follow; both fetch more, others",
}
ALONE, FETCHES, LEADS, WHERE, WHOM = KINDS


def way_out(world, robot, goal):
    """The landmark that a robot would tell people on its way, or NOWHERE."""
    if goal is not None:
        target = actual_target(world.building, robot.floor, *goal)
        return said_on_the_way(world.building, robot.floor, target)
    return robot.says if robot.way else NOWHERE


def kind(world, robot, own, other):
    """Tell in which of KINDS two goals of a robot differ; None if they do not."""
    if len(followers_of(world, robot)) == 0:
        return ALONE if own != other else None
    mine = way_out(world, robot, own)
    theirs = way_out(world, robot, other)
    if mine != NOWHERE and theirs != NOWHERE:
        return WHERE if mine != theirs else None
    if mine != theirs:
        return LEADS if mine == NOWHERE else FETCHES
    return WHOM if own != other else None


class Advised:
    """A team that follows another one's advice where they differ in one kind."""

    def __init__(self, own, other, follows):
        self.own = own
        self.other = other
        self.follows = follows
        self.differ = Counter()

    def decide(self, world, robots, rng):
        mine = self.own.decide(world, robots, rng)
        theirs = self.other.decide(world, robots, rng)
        goals = []
        for robot, own, other in zip(robots, mine, theirs, strict=True):
            differ = kind(world, robot, own, other)
            self.differ[differ] += 1
            goals.append(other if differ and differ == self.follows else own)
        return goals


def advised(asked, follows):
    """Per cent of people saved in each evacuation, and decisions of each kind."""
    fire = strategy_named(asked.fire, "fire")
    own = strategy_named(asked.team, "robots")
    other = strategy_named(asked.other, "robots")
    team = Advised(own, other, follows)  # each run has its own copy
    runs = played(team, fire, range(asked.seed, asked.seed + asked.episodes))
    return saved(runs), sum((run.robot_strategy.differ for run in runs), Counter())


def main():
    parser = ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("team", metavar="TEAM")
    parser.add_argument("--other", default="observer", metavar="S")
    parser.add_argument("--fire", default="random", metavar="S")
    parser.add_argument("--episodes", type=whole(2), default=100, metavar="N")
    parser.add_argument("--seed", type=whole(0), default=30_000, metavar="N")
    asked = parser.parse_args()
    before, differ = advised(asked, None)
    print(f"{asked.team} saves {before.mean():.1f} %; what {asked.other} adds to it:")
    print(f"{'':12} {'an evacuation':>14} {'points':>20}")
    for follows, words in KINDS.items():
        after, _ = advised(asked, follows)
        often = differ[follows] / asked.episodes
        points = format_interval(interval_of_mean(after - before), 1, ends=True)
        print(f"{follows:12} {often:14.1f} {points:>20}  {words}", flush=True)


if __name__ == "__main__":
    sys.exit(exit_status(main))
