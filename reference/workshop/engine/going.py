"""Between the book and compiled ticks: who plays what, and in which order."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from copy import copy
from functools import partial
from pathlib import Path
from threading import RLock

import numpy as np

from reference.building import building_of
from reference.paper import Scenario
from reference.rays import NO_HOLES
from reference.robots import Destinations, actual_target, said_on_the_way
from reference.simulation import Simulation
from reference.workshop.engine import storing, ticks
from reference.workshop.engine.apart import compile_apart
from reference.workshop.engine.keeping import kept_with
from reference.workshop.engine.mirrors import written_from
from reference.workshop.engine.rows import cast_rays
from reference.workshop.engine.state import EVENT, PAIR, RunArrays
from reference.workshop.engine.ways import quick_ways
from reference.workshop.storage.workers import stop_delayed

ONE_AT_A_TIME = RLock()  # threads share tables
HUT = """building: Hut
size: 4 x 3
floor 1: ground
####
#..E
####"""


def make_ready(say: Callable[[str], None]) -> None:
    """Compile what a tick needs, or load it from the disk."""
    storing.make_ready(_first_call(), compile_apart, say)


def compile_into(folder: str) -> None:
    """Compile what a tick needs, in a process that does nothing else."""
    storing.compile_here(_first_call(), Path(folder))


def _first_call() -> Callable[[], None]:
    """Make a call of every compiled entry."""
    run = Simulation(building_of(HUT), Scenario(people=0))
    mine = arrays_of(run)
    mine.take()  # what fails here is no fault of what is kept on disk

    def call() -> None:
        sight = copy(run.sight)
        sight.hits = run.sight.hits.copy()  # to be written
        sight.ends = run.sight.ends.copy()
        cast_rays(sight, sight._clear.reshape(run.building.kind.shape))
        mine.tables.add_row(int(np.flatnonzero(run.building.walkable)[0]), NO_HOLES)
        advance(run, 0)
        with quick_ways(run.navigation):
            # a second call would else be answered without a search
            run.navigation._search.cache_clear()
            run.navigation.distances(run.navigation.goals[0])

    return call


def arrays_of(run: Simulation) -> RunArrays:
    """The arrays of a simulation, begun once."""
    return kept_with(run, "arrays", partial(RunArrays, run), lambda it: it.fits(run))


@written_from("robots.RobotAlgorithm.act 4dd1f5")
def instruct(run: Simulation, mine: RunArrays, destinations: Destinations) -> None:
    """Tell robots where to go, as lines 4 and 5 of Algorithm 3 say."""
    occupancy = run.world.occupancy
    each = zip(run.world.robots, destinations, strict=True)
    for k, (robot, decision) in enumerate(each):
        active = any(occupancy[robot.floor :])  # Alg. 3:1
        if not active or decision is None:  # Alg. 3:3
            continue
        target = actual_target(run.building, robot.floor, *decision)
        robot.destination = np.array(target)  # Alg. 3:4
        record = mine.state.robots[k]
        says = said_on_the_way(run.building, robot.floor, target)
        record["says"] = says  # Alg. 3:5
        record["to_x"], record["to_y"] = target
        record["decided"] = True


@contextmanager
def others_may_play() -> Iterator[None]:
    """Let other threads play meanwhile: a strategy may wait for them."""
    ONE_AT_A_TIME.release()
    try:
        yield
    finally:
        ONE_AT_A_TIME.acquire()


def advance(run: Simulation, count: int) -> None:
    """Run so many ticks, or to the end; a stop waits for the strategies or the end.

    Call `make_ready` first: else all is compiled anew, and not kept.
    """
    with ONE_AT_A_TIME:
        _advance(run, count)


def _advance(run: Simulation, count: int) -> None:
    mine = arrays_of(run)
    with stop_delayed():
        mine.take()
        mine.state.clock["left"] = count
        mine.state.clock["phase"] = ticks.SENSE
        asks = _play(run, mine)
    while asks:
        with others_may_play(), quick_ways(run.navigation):
            destinations = run.strategies_decide()
        with stop_delayed():
            mine.take()
            instruct(run, mine, destinations)
            asks = _play(run, mine)


def _play(run: Simulation, mine: RunArrays) -> bool:
    """Play until the strategies are to be asked, or to the end: False.

    A KeyboardInterrupt in it would leave the world as it was before; in numba, which
    calls Python to unpack a generator and does not ask what came of it, it is a crash.
    """
    clock = mine.state.clock
    why = -1
    while why not in (ticks.STRATEGIES, ticks.PLAYED, ticks.OVER):
        why = ticks.play(mine.tables.arrays, mine.state, run.rng["bodies"])
        if why == ticks.ROW:
            place, holes, *marks = mine.state.wanted.tolist()
            mine.tables.add_row(place, frozenset(marks[:holes]))
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
    mine.give()
    return bool(why == ticks.STRATEGIES)
