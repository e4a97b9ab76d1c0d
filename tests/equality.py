"""Is the engine equal to the book, to the last bit?  Whole simulations, tick by tick.

`python tests/equality.py --states 1000000` plays emergencies drawn by lot, each twice:
the book steps one, the engine the other, until so many states are compared, in some
forty minutes of one core.  `python tests/equality.py --only 17` plays number 17 again.
It stops at the first tick, person and field that differ.

It compares bodies, who is due, full doors, where people walked, robots, flames, burnt
doors, events, clocks, the random generators and minds, all to the bit: after every
tick, or in one emergency of ten at each decision, so that the engine plays from one to
the next in one go.  Minds are copied out of the engine, which keeps its own.
Three in ten are odd: the world is changed, copied or pickled meanwhile, and book and
engine take turns.
"""

import argparse
import pickle
import sys
import time
from collections.abc import Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from dataclasses import fields
from functools import lru_cache
from itertools import zip_longest
from typing import Any, NamedTuple

import numpy as np
from numpy.random import Generator as Rng

from reference.building import Kind
from reference.paper import InputError, Scenario
from reference.simulation import Simulation
from reference.workshop.engine.going import advance, make_ready
from reference.workshop.engine.state import Minds
from reference.workshop.maps import MistakesError, load
from reference.workshop.strategies import SCRIPTS
from reference.world import FireLit, Mind

TOGETHER = 20  # emergencies that share a building and a range of sight
SHIPPED = ("tiny", "paper", "tower", "school", "museum", "maze")
AT_DECISIONS = 0.1  # share of emergencies that go from decision to decision
MEDDLED_WITH = 0.3  # share of emergencies that are odd
PATIENCE = 1200.0  # seconds in which one of the workers is done; else all hang


# -- What is compared ---------------------------------------------------------------


def unlike(book: Simulation, other: Simulation) -> str:
    """The first field that differs, and whose; "" if none does."""
    for found in _differences(book, other):
        return found
    return ""


def _differences(book: Simulation, other: Simulation) -> Iterator[str]:
    yield from _unlike_records("body", [book.world.bodies], [other.world.bodies])
    yield from _unlike_records("robot", book.world.robots, other.world.robots)
    for name in ("ticks", "person_seconds", "_flames_change", "due", "turn"):
        yield from _unlike(name, getattr(book, name), getattr(other, name))
    for name in ("full_until", "walked_to"):
        yield from _unlike(name, getattr(book, name), getattr(other, name))
    yield from _unlike("time", book.world.time, other.world.time)
    yield from _unlike("burnt", book.world.burnt, other.world.burnt)
    for k, (mine, yours) in enumerate(zip_longest(book.events, other.events)):
        yield from _unlike(f"event {k}", mine, yours)
    yield from _unlike_records("flames", [book.world.flames], [other.world.flames])
    for name, rng in book.rng.items():
        state = other.rng[name].bit_generator.state
        yield from _unlike(f"generator {name}", rng.bit_generator.state, state)
    yield from _unlike_records("mind", book.world.minds, _minds_of(other))


def _minds_of(run: Simulation) -> list[Mind]:
    """Its minds; those that the engine has are copied, and stay with it."""
    minds = run.world.minds
    if isinstance(minds, Minds) and minds.arrays.has_minds:
        return minds.arrays.written_minds([])
    return minds


def _unlike_records(kind: str, some: list[Any], others: list[Any]) -> Iterator[str]:
    if len(some) != len(others):
        yield f"{len(some)} and {len(others)} of {kind}"
    for k, (one, other) in enumerate(zip(some, others, strict=True)):
        for part in fields(one):
            name = f"{kind} {k}: {part.name}" if len(some) > 1 else part.name
            mine = getattr(one, part.name)
            yours = getattr(other, part.name)
            yield from _unlike(name, mine, yours)
            if part.name == "been" and list(mine) != list(yours):
                yield f"{name}: other orders"
            if part.name == "facing" and repr(mine) != repr(yours):
                yield f"{name}: {mine} and {yours}"


def _unlike(name: str, one: Any, other: Any) -> Iterator[str]:
    """Arrays to the bit and by kind, so that 0 is not -0 and nan is nan."""
    if not isinstance(one, np.ndarray):
        if one != other or type(one) is not type(other):
            yield f"{name}: {one} and {other}"
    elif one.dtype != other.dtype or one.shape != other.shape:
        yield f"{name}: {one.dtype} {one.shape} and {other.dtype} {other.shape}"
    elif one.tobytes() != other.tobytes():
        for k in np.ndindex(one.shape):
            if one[k].tobytes() != other[k].tobytes():
                yield f"{name}: at {k} it is {one[k]!r} and {other[k]!r}"


# -- Emergencies by lot -------------------------------------------------------------


class Emergency(NamedTuple):
    """What is played, and how it is compared."""

    number: int
    building: str  # a shipped name, or a map
    robots: str
    fire: str
    seed: int
    scenario: dict[str, Any]
    each_tick: bool  # compared, or at decisions only, between which the engine goes on
    odd: bool  # somebody changes the world, copies, pickles, takes turns

    def begin(self) -> Simulation:
        """The simulation, ready to begin."""
        return simulation(*self[1:5], **self.scenario)

    def __str__(self) -> str:
        name = "random floors" if "\n" in self.building else self.building
        said = ", ".join(f"{name} {value}" for name, value in self.scenario.items())
        return f"emergency {self.number} ({name}, {self.robots}, {self.fire}; {said})"


_building = lru_cache(4)(load)


def simulation(
    building: str, robots: str, fire: str, seed: int, **scenario: Any
) -> Simulation:
    """A simulation of strategies by name, ready to begin."""
    guide = SCRIPTS["robots"][robots]()
    foe = SCRIPTS["fire"][fire]()
    return Simulation(_building(building), Scenario(**scenario), guide, foe, seed)


def emergency(number: int, small: bool = False) -> Emergency:
    """Draw one by lot; small: on small floors, and short.

    TOGETHER of them share a building and a range of sight, which take long to prepare.
    """
    shared = np.random.default_rng([number // TOGETHER, small])
    drawn = shared.random() < (0.7 if small else 0.4)
    building = random_map(shared) if drawn else str(shared.choice(SHIPPED))
    if small and not drawn:
        building = "tiny"
    sight = float(shared.choice((3.0, 5.0, 5.0, 12.0)))
    rng = np.random.default_rng([number, small, 1])
    most = 40 if drawn or small or rng.random() < 0.9 else 300
    scenario = {
        "people": int(rng.integers(1, most + 1)),
        "frames_per_tick": int(rng.choice((5, 10, 10, 25))),
        "sight_range": sight,
        "robots_per_floor": int(rng.integers(0, 4)),
        "sources": int(rng.integers(0, 9)),
        "spread_rate": float(rng.choice((0.02, 0.06, 0.06, 0.5))),
        "burn_seconds": float(rng.choice((5.0, 40.0, 40.0, 1000.0))),
        "decision_seconds": float(rng.choice((1.0, 5.0, 5.0, 7.5))),
        "training": bool(rng.random() < 0.5),
        "time_limit": float(rng.choice((20.0, 30.0) if small else (60.0, 240.0))),
    }
    return Emergency(
        number,
        building,
        str(rng.choice(list(SCRIPTS["robots"]))),
        str(rng.choice(list(SCRIPTS["fire"]))),
        int(rng.integers(2**31)),
        scenario,
        bool(rng.random() >= AT_DECISIONS),
        bool(rng.random() < MEDDLED_WITH),
    )


def random_map(rng: Rng) -> str:
    """Rooms in rows and columns, with doors by lot, on one to three floors."""
    while True:
        text = _random_map(rng)
        try:
            load(text)
        except MistakesError:
            continue
        return text


def _random_map(rng: Rng) -> str:
    floors = int(rng.integers(1, 4))
    east = np.cumsum([0, *rng.integers(3, 8, rng.integers(2, 5))])
    south = np.cumsum([0, *rng.integers(3, 7, rng.integers(2, 4))])
    text = f"building: any\nsize: {east[-1] + 1} x {south[-1] + 1}\n"
    for floor in range(floors):
        rows = np.full((south[-1] + 1, east[-1] + 1), ".")
        rows[south] = "#"
        rows[:, east] = "#"
        for row, col in np.ndindex(len(south) - 1, len(east) - 1):
            west, north = [(1, 0), (0, 1), (1, 1)][rng.integers(3)]
            if col and (west or not row):
                y = rng.integers(south[row] + 1, south[row + 1])
                rows[y, east[col]] = "+"
            if row and (north or not col):
                x = rng.integers(east[col] + 1, east[col + 1])
                rows[south[row], x] = "+"
        if floors > 1:
            rows[1 : south[1], 1 : east[1]] = "A"
        if not floor or rng.random() < 0.3:
            rows[-1, rng.integers(1, east[1])] = "E"
        text += f"floor {floor + 1}:\n" + "\n".join(map("".join, rows)) + "\n"
    return text


# -- Odd things ---------------------------------------------------------------------


def meddle(run: Simulation, rng: Rng) -> None:
    """Change something in the world, as a strategy or a notebook may."""
    odd = ODD[rng.integers(len(ODD))]
    odd(run, rng, int(rng.integers(len(run.world.bodies))))


def _move(run: Simulation, rng: Rng, i: int) -> None:
    """Somebody is put elsewhere on their floor, in arrays of their own."""
    bodies = run.world.bodies
    if bodies.walking[i]:
        floor = int(bodies.floor[i])
        rooms = run.building.kind == Kind.FLOOR
        x, y = run.building.random_point(rooms[floor], rng)
        bodies.position = bodies.position.copy()
        bodies.place = bodies.place.copy()
        bodies.position[i] = x, y
        bodies.place[i] = run.navigation.place(floor, x, y)


def _join(run: Simulation, rng: Rng, i: int) -> None:
    """Somebody is put where another stands."""
    bodies = run.world.bodies
    there = np.flatnonzero(bodies.walking & (bodies.floor == bodies.floor[i]))
    if bodies.walking[i]:
        j = rng.choice(there)
        bodies.position[i] = bodies.position[j]
        bodies.place[i] = bodies.place[j]


def _hurt(run: Simulation, rng: Rng, i: int) -> None:
    run.world.bodies.health[i] -= 50.0


def _speed_up(run: Simulation, rng: Rng, i: int) -> None:
    run.world.bodies.pace = run.world.bodies.pace * 1.1


def _lose_memory(run: Simulation, rng: Rng, i: int) -> None:
    run.world.minds[i] = Mind()


def _change_mind(run: Simulation, rng: Rng, i: int) -> None:
    mind = run.world.minds[i]
    mind.doors = set(mind.doors) | {0}
    mind.patches.clear()
    mind.trail = mind.trail[1:]


def _new_minds(run: Simulation, rng: Rng, i: int) -> None:
    run.world.minds = list(run.world.minds)


def _halt_robots(run: Simulation, rng: Rng, i: int) -> None:
    for robot in run.world.robots:
        robot.way = []


def _move_robots(run: Simulation, rng: Rng, i: int) -> None:
    for robot in run.world.robots:
        robot.place = run.navigation.nearest_free(robot.floor, 0.0, 0.0)
        robot.position = run.navigation.centres[robot.place].copy()
        robot.way = []


def _shift_robots(run: Simulation, rng: Rng, i: int) -> None:
    """Robots are put elsewhere; their place follows by itself."""
    rooms = run.building.kind == Kind.FLOOR
    for robot in run.world.robots:
        there = run.building.random_point(rooms[robot.floor], rng)
        robot.position = np.array(there)


def _burn_door(run: Simulation, rng: Rng, i: int) -> None:
    doors = [m.index for m in run.building.landmarks if m.kind is Kind.DOOR]
    if doors:
        run.world.burnt.add(doors[i % len(doors)])


def _ignite(run: Simulation, rng: Rng, i: int) -> None:
    world = run.world
    x, y = run.navigation.centres[world.bodies.place[i]].tolist()
    run.spread.ignite(
        world.flames, FireLit(world.time, int(world.bodies.floor[i]), x, y)
    )
    run._flames_change = world.time


def _light(run: Simulation, rng: Rng, i: int) -> None:
    """As boards do it: in the array that is there."""
    world = run.world
    world.flames.arrival.ravel()[world.bodies.place[i]] = world.time
    run.spread.advance(world.flames, world.time)


def _fill_door(run: Simulation, rng: Rng, i: int) -> None:
    run.full_until[i % len(run.building.landmarks)] = run.world.time + 3.0


def _all_think(run: Simulation, rng: Rng, i: int) -> None:
    run.due = np.ones_like(run.due)


def _die(run: Simulation, rng: Rng, i: int) -> None:
    if rng.random() < 0.1:
        run.world.bodies.health[:] = 0.0


ODD = (
    _move, _join, _hurt, _speed_up, _lose_memory, _change_mind, _new_minds,
    _halt_robots, _move_robots, _shift_robots, _burn_door, _ignite, _light, _fill_door,
    _all_think, _die,
)  # fmt: skip


class Meddler:
    """A strategy that changes the world and then decides like another one."""

    def __init__(self, strategy: Any, run: Simulation):
        self.strategy = strategy
        self.run = run
        self.rng = np.random.default_rng(5)

    def decide(self, world: Any, *others: Any) -> Any:
        """Meddle now and then."""
        if self.rng.random() < 0.3:
            meddle(self.run, self.rng)
        return self.strategy.decide(world, *others)


def _another(run: Simulation, rng: Rng) -> Simulation:
    """The same simulation: itself, a copy, or out of a pickle."""
    kind = rng.integers(3)
    if kind == 0:
        return run
    if kind == 1:
        return run.copy()
    return pickle.loads(pickle.dumps(run))


# -- Both, side by side -------------------------------------------------------------


def first_difference(one: Emergency, most: int = sys.maxsize) -> tuple[int, str]:
    """States compared, and the first tick, person and field that differ, "" if none."""
    try:
        book = one.begin()
    except InputError:  # more people than fit
        return 0, ""
    other = one.begin()
    rng = np.random.default_rng(one.seed)
    if one.odd:
        for run in (book, other):
            run.robot_strategy = Meddler(run.robot_strategy, run)
            run.fire_strategy = Meddler(run.fire_strategy, run)
    compared = 0
    while not book.done and book.ticks < most:
        stride = 1 if one.each_tick else book.decision_ticks
        by_book = one.odd and rng.random() < 0.05
        for _ in range(stride):
            if not book.done:
                book.step()
                if by_book:
                    other.step()
        if not by_book:
            advance(other, stride)
        compared += 1
        if found := unlike(book, other):
            return compared, f"{one}, tick {book.ticks}: {found}"
        if one.odd and not book.done and rng.random() < 0.05:
            seed = rng.integers(2**31)
            for run in (book, other):
                meddle(run, np.random.default_rng(seed))
            if rng.random() < 0.2:
                other = _another(other, rng)
                book.robot_strategy.run = book
    if book.done != other.done:
        return compared, f"{one}: only one of them is done"
    return compared, ""


# -- The command --------------------------------------------------------------------


class Part(NamedTuple):
    """Of some emergencies: how many, states compared, and what differs first."""

    emergencies: int
    compared: int
    found: str


def say(text: str) -> None:
    """Say something on stderr."""
    print(text, file=sys.stderr)


def compare(numbers: range) -> Part:
    """Play these emergencies, up to the first difference."""
    done = Part(0, 0, "")
    for number in numbers:
        compared, found = first_difference(emergency(number))
        done = Part(done.emergencies + 1, done.compared + compared, found)
        if found:
            break
    return done


def compare_many(least: int, workers: int) -> Part:
    """Play emergencies until so many states are compared, or one differs."""
    begun = time.monotonic()
    total = Part(0, 0, "")
    first = 0
    # workers load what is compiled
    with ProcessPoolExecutor(workers, initializer=make_ready, initargs=(say,)) as pool:
        running: dict[Future[Part], range] = {}
        while True:
            goes_on = total.compared < least and not total.found
            while goes_on and len(running) < workers:
                numbers = range(first, first + TOGETHER)
                running[pool.submit(compare, numbers)] = numbers
                first += TOGETHER
            if not running:
                break
            done, others = wait(running, PATIENCE, FIRST_COMPLETED)
            if not done:
                for worker in pool._processes.values():
                    worker.kill()
                late = " or ".join(sorted(str(running[job]) for job in others))
                return total._replace(found=f"no end of an emergency in {late}")
            for job in done:
                del running[job]
                part = job.result()
                total = Part(
                    total.emergencies + part.emergencies,
                    total.compared + part.compared,
                    total.found or part.found,
                )
            minutes = (time.monotonic() - begun) / 60
            say(f"{minutes:.1f} min: {total.compared:,} states")
    return total


def main() -> int:
    """Compare; 1 if anything differs."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--states", type=int, default=20_000, help="at least so many")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--only", type=int, metavar="N", help="only the N-th emergency")
    asked = parser.parse_args()
    make_ready(say)
    if asked.only is not None:
        total = compare(range(asked.only, asked.only + 1))
    else:
        total = compare_many(asked.states, asked.workers)
    print(f"{total.compared:,} states of {total.emergencies} emergencies compared")
    print(total.found or "all equal")
    return bool(total.found)


if __name__ == "__main__":
    sys.exit(main())
