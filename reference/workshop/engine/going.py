"""Between the book and compiled ticks: who plays what, and in which order."""

import sys
from collections.abc import Callable

import numpy as np

from reference.building import building_of
from reference.paper import Scenario
from reference.robots import Destinations, actual_target, said_on_the_way
from reference.simulation import Simulation
from reference.workshop.engine import storing, ticks
from reference.workshop.engine.state import EVENT, PAIR, Kept
from reference.workshop.engine.ways import quick_ways

HUT = """building: Hut
size: 4 x 3
floor 1: ground
####
#..E
####"""


def make_ready(say: Callable[[str], None]) -> None:
    """Compile what a tick needs, or load it from the disk."""

    def first_call() -> None:
        run = Simulation(building_of(HUT), Scenario(people=0))
        advance(run, 0)
        with quick_ways(run.navigation):
            run.navigation._search.cache_clear()
            run.navigation.distances(run.navigation.goals[0])

    storing.make_ready(first_call, say)


def kept(run: Simulation) -> Kept:
    """The arrays of a simulation, begun once."""
    mine: Kept = vars(run).get("_engine") or Kept(run)
    vars(run)["_engine"] = mine
    return mine


def instruct(run: Simulation, mine: Kept, destinations: Destinations) -> None:
    """Tell robots where to go, as lines 4 and 5 of Algorithm 3 say."""
    occupancy = run.world.occupancy
    each = zip(run.world.robots, destinations, strict=True)
    for k, (robot, decision) in enumerate(each):
        if decision is None or not any(occupancy[robot.floor :]):
            continue
        target = actual_target(run.building, robot.floor, *decision)
        robot.destination = np.array(target)
        record = mine.state.robots[k]
        record["says"] = said_on_the_way(run.building, robot.floor, target)
        record["to_x"], record["to_y"] = target
        record["decided"] = True


def advance(run: Simulation, count: int) -> None:
    """Run so many ticks, or to the end."""
    mine = kept(run)
    mine.take()
    clock = mine.state.clock
    clock["left"] = min(count, sys.maxsize)
    clock["phase"] = ticks.SENSE
    rng = run.rng["bodies"]
    while True:
        why = ticks.play(mine.arrays, mine.state, rng)
        if why == ticks.ROW:
            place, holes, *marks = mine.state.wanted.tolist()
            mine.tables.add_row(place, frozenset(marks[:holes]))
        elif why == ticks.STRATEGIES:
            mine.give()
            with quick_ways(run.navigation):
                destinations = run.strategies_decide()
            mine.take()
            instruct(run, mine, destinations)
        elif why == ticks.MEMORY:
            mine.make_room()
        elif why == ticks.PAIRS:
            pairs = np.zeros(2 * len(mine.state.pairs), PAIR)
            mine.state = mine.state._replace(pairs=pairs)
        elif why == ticks.EVENTS:
            if not int(clock["events"][0]):
                events = np.zeros(2 * len(mine.state.events), EVENT)
                mine.state = mine.state._replace(events=events)
            mine.give()
        else:
            break
    mine.give()
