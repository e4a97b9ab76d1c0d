"""Standard cases of pedestrian dynamics: what each expects, and what is measured.

Clauses: A3, A7, F8.  Cases and what they accept are those of the guidelines of RiMEA
(2016), IMO (MSC.1/Circ.1533) and ISO 20414; what these leave open is marked [chosen].
In all but `ghosts` everybody knows the nearest way out and nobody thinks.

    n   people;  rows, cols  of a floor's drawing, walls included
"""

from collections.abc import Callable
from functools import cache
from itertools import pairwise
from math import exp, inf, isfinite
from typing import Any, NamedTuple

import numpy as np

from reference import motion
from reference.beginning import beginning
from reference.building import Building
from reference.paper import FLIGHT, WALKING_SPEED, WALKING_SPREAD, Scenario
from reference.simulation import Simulation
from reference.workshop.crossplay.intervals import Interval, of_mean
from reference.workshop.maps import load
from reference.workshop.strategies.robots import Sweep
from reference.workshop.validation.crowd import (
    TICK,
    Crowd,
    Past,
    built,
    densest,
    east_of,
    flow,
    people,
    times,
)

# -- What is accepted ---------------------------------------------------------------

MEAN_SPEED, SPREAD = 1.34, 0.26  # m/s: Weidmann (1993)
BESIDE = 0.2  # m/s [A7, chosen]: other published curves are as far from Weidmann's
MOST_FLOW = 1.33  # people per metre and second through a door: IMO 4
LEAST_FLOW = 0.6  # [A7, chosen]: less than half of the most is a jam
MOST_DOWN = 1.1  # people per metre and second on stairs down: IMO
SLOWEST, FASTEST = 0.64, 1.07  # m/s down stairs: IMO
CONGESTED = 3.5  # people per square metre: IMO, where congestion begins
DOUBLE = (1.7, 2.3)  # [A7, chosen]: "about double"
CROWDING = 28  # points [A7, chosen]: half of what bodies cost before they made room

# -- What real people do ------------------------------------------------------------

ONE_WAY = {0.6: 1.35, 1.1: 1.21, 1.6: 1.0, 2.05: 0.65, 2.5: 0.41, 3.05: 0.31}
OPPOSED = {0.75: 1.05, 1.25: 1.01}
"""m/s by people per square metre: all one way, and in a counterflow 4 m wide, in the
middle of 0.5 to 1 and of 1 to 1.5 people."""
EXITS_OF = {0.7: 2.4, 0.95: 1.9, 1.2: 2.0}
"""People per second and metre through an exit, by its width, metres."""
MEASURED = "PedPy's demonstration data, trajectories of the Jülich data archive"
"""The source of all these."""

REAL_SPEEDS = ", ".join(f"{v} at {d}" for d, v in ONE_WAY.items())
BY_CONSTRUCTION = (
    "by construction: the model's flow limit is a parameter; real narrow exits pass "
    f"{min(EXITS_OF.values())} to {max(EXITS_OF.values())}"
)
SHORTEST = (
    "all take the shortest way round one corner; "
    "a rule that forty people never use is not worth it"
)

# -- The table ----------------------------------------------------------------------

RUNS = 3  # seeds of each case
RING = (20.0, 4.0)  # metres, length and width
DENSITIES = (0.5, 1.0, 2.0, 3.0, 4.0, 5.0)  # people per square metre
WIDTHS = (1, 2, 3)  # metres of a door
EXITS = "####E#######E####"  # a long wall of the large room
GATES = {"exit": "E", "door": "+"}  # as they are drawn
AGAINST = (0, 10, 50, 100)  # people who come towards a hundred
CROWDS = (100, 200, 400)  # people in the paper's building
LED = {100: 3, 200: 30, 400: 3}
"""Seeds by people [A7, chosen]: at 200, which decides, as many as patience allows."""

Numbers = dict[str, float]
Measure = Callable[[int], tuple[bool, Numbers]]
"""Seed -> does it pass, and what came out; its docstring says what is measured."""


class Case(NamedTuple):
    """A case of the guidelines.

    why   the reason, where it is known to fail
    runs  how many seeds measure it
    note  what to know whatever the verdict
    """

    source: str
    accepted: str
    measure: Measure
    why: str
    runs: int = RUNS
    note: str = ""


CASES: dict[str, Case] = {}


def case(
    source: str, accepted: str, why: str = "", runs: int = RUNS, note: str = ""
) -> Callable[[Measure], Measure]:
    """Register a function in CASES under its own name."""

    def enter(measure: Measure) -> Measure:
        name = measure.__name__.replace("_", "-")
        CASES[name] = Case(source, accepted, measure, why, runs, note)
        return measure

    return enter


def measured(name: str, seed: int, runs: int | None = None) -> dict[str, Any]:
    """Measure one of the CASES over its seeds, from this one on; return a table row.

    It passes if it does so with every seed.  A number is the mean over the seeds where
    it is finite, None if there are none; `never` counts the others.
    """
    source, accepted, measure, why, usual, note = CASES[name]
    count = runs or usual
    passed, numbers = zip(*map(measure, range(seed, seed + count)), strict=True)
    found = {k: [each[k] for each in numbers if isfinite(each[k])] for k in numbers[0]}
    means = {k: round(float(np.mean(v)), 3) if v else None for k, v in found.items()}
    return {
        "case": name,
        "source": source,
        "what": str(measure.__doc__).rstrip("."),
        "accepted": accepted,
        "measured": means,
        "never": {k: count - len(v) for k, v in found.items() if len(v) < count},
        "runs": count,
        "failed": passed.count(False),
        "verdict": "passes" if all(passed) else "fails",
        "why": "" if all(passed) else why,
        "note": note,
    }


def within(numbers: Numbers, low: float, high: float) -> tuple[bool, Numbers]:
    """Pass if every number lies between two bounds."""
    return all(low <= number <= high for number in numbers.values()), numbers


# -- Speeds -------------------------------------------------------------------------


@case("RiMEA 1, IMO 1", "26 to 34; 40 within 5 % [chosen]")
def corridor(seed: int) -> tuple[bool, Numbers]:
    """Seconds for 40 m, alone, at 1.33 and 1 m/s."""

    def seconds(pace: float) -> float:
        corridor = built(["#" * 45, "#" + "." * 43 + "E", "#" * 45])
        world = people(corridor, seed, (1, (0, slice(1, 2), slice(1, 2))))
        world.bodies.pace[:] = pace
        end = world.bodies.position[:, 0] + 40
        return float(times(Crowd(world, seed), lambda b: b.position[:, 0] >= end)[0])

    fast, slow = seconds(1.33), seconds(1.0)
    return 26 <= fast <= 34 and 38 <= slow <= 42, {"1.33 m/s": fast, "1 m/s": slow}


@case("RiMEA 7", f"{MEAN_SPEED} and {SPREAD} within 5 and 20 % [chosen]")
def speeds(seed: int) -> tuple[bool, Numbers]:
    """Free speeds of a thousand people, m/s."""
    rng = np.random.default_rng(seed)
    pace = beginning(load("paper"), Scenario(people=1000), rng).bodies.pace
    mean, spread = float(pace.mean()), float(pace.std())
    near = abs(mean / MEAN_SPEED - 1) < 0.05 and abs(spread / SPREAD - 1) < 0.2
    return near, {"mean": mean, "deviation": spread}


def weidmann(density: float) -> float:
    """Mean speed, m/s, at so many people per square metre."""
    return max(0.0, MEAN_SPEED * (1 - exp(-1.913 * (1 / density - 1 / 5.4))))


@cache
def speed_in_ring(density: float, seed: int) -> float:
    """Mean speed, m/s, in a corridor whose ends are joined, from 10 s to 30 s."""
    (length, width), rng = RING, np.random.default_rng(seed)

    def inside(position: np.ndarray, who: np.ndarray) -> np.ndarray:
        return (position[:, 1] > 0) & (position[:, 1] < width)

    n, size = round(density * length * width), width / 9
    spots = rng.choice(9 * round(length / size), n, replace=False)
    position = (np.stack(np.divmod(spots, 9), axis=1) + 0.5) * size
    pace = rng.normal(WALKING_SPEED, WALKING_SPREAD, n).clip(0.8, 1.9)
    shift = np.repeat([[0.0, 0], [length, 0], [-length, 0]], n, axis=0)
    walked = []
    for _ in range(round(30 / TICK)):
        again = np.tile(position, (3, 1)) + shift  # people, and both ends once more
        near = np.flatnonzero(np.abs(again[:, 0] - length / 2) < length / 2 + 4)
        at, floor = again[near], np.zeros(len(near), int)
        target = at + np.array([40.0, 0.0])
        moved = motion.step(at, floor, target, pace[near % n], TICK, inside, rng)[:n]
        walked.append((moved - position)[:, 0].mean() / TICK)
        position = moved % [length, inf]
    return float(np.mean(walked[round(10 / TICK) :]))


@case(
    "RiMEA 4, IMO 12",
    f"falls; up to 4 within {BESIDE} of Weidmann's [chosen]",
    note=f"real people: {REAL_SPEEDS}",
)
def fundamental_diagram(seed: int) -> tuple[bool, Numbers]:
    """Mean speed, m/s, by people per m²."""
    speed = {each: speed_in_ring(each, seed) for each in DENSITIES}
    falls = all(one >= other for one, other in pairwise(speed.values()))
    near = all(abs(v - weidmann(d)) < BESIDE for d, v in speed.items() if d <= 4)
    return falls and near, {f"{d:g}": v for d, v in speed.items()}


# -- Doors --------------------------------------------------------------------------


@cache
def passages(gate: str, width: int, seed: int) -> np.ndarray:
    """Time how a hundred from 8 m x 5 m pass an exit, E, or inner door, +: seconds."""
    first = (6 - width) // 2
    gates = [gate if first <= k < first + width else "#" for k in range(5)]
    beyond = "........E" if gate == "+" else ""
    rows = ["#........" + each + beyond for each in gates]
    wall = "#" * len(rows[0])
    building = built([wall, *rows, wall])
    world = people(building, seed, (100, (0, slice(1, 6), slice(1, 9))))
    return times(Crowd(world, seed), east_of(building, 10))


@case("IMO 4", f"{LEAST_FLOW} [chosen] to {MOST_FLOW}", note=BY_CONSTRUCTION)
def doors(seed: int) -> tuple[bool, Numbers]:
    """People per metre and second, by width, of exits and inner doors."""
    gates = [(name, gate, w) for name, gate in GATES.items() for w in WIDTHS]
    flows = {f"{n} {w} m": flow(passages(gate, w, seed)) / w for n, gate, w in gates}
    return within(flows, LEAST_FLOW, MOST_FLOW)


@case("RiMEA 9, IMO 9", f"about double [chosen: {DOUBLE[0]} to {DOUBLE[1]}]")
def large_room(seed: int) -> tuple[bool, Numbers]:
    """Seconds in which 250 leave a quarter of the guidelines' room."""

    def seconds(north: str, south: str) -> float:
        building = built([north, *10 * ["#" + "." * 15 + "#"], south])
        world = people(building, seed, (250, (0, slice(1, 11), slice(1, 16))))
        return float(times(Crowd(world, seed)).max())

    two, four = seconds(EXITS, "#" * 17), seconds(EXITS, EXITS)
    return DOUBLE[0] <= two / four <= DOUBLE[1], {"4 exits": four, "2 exits": two}


@case("IMO 8", "rises, within 300 s", f"against a hundred may jam: {SHORTEST}", runs=6)
def counterflow(seed: int) -> tuple[bool, Numbers]:
    """Seconds of a hundred through 10 m x 2 m, by those against them."""
    rows = ["E" + "." * 10 + "#" * 10 + "." * 10 + "E"] * 10
    rows[4:6] = ["E" + "." * 30 + "E"] * 2
    building = built(["#" * 32, *rows, "#" * 32])
    west, east = (m.index for m in sorted(building.landmarks, key=lambda m: m.position))
    here, there = ((0, slice(1, 11), slice(col, col + 10)) for col in (1, 21))

    def seconds(against: int) -> float:
        world = people(building, seed, (100, here), (against, there))
        crowd = Crowd(world, seed, [east] * 100 + [west] * against)
        return float(times(crowd, east_of(building, 21))[:100].max())

    numbers = {f"{against}": seconds(against) for against in AGAINST}
    return all(a < b < inf for a, b in pairwise(numbers.values())), numbers


# -- Corners and stairs -------------------------------------------------------------


def bend(width: int, along: int, up: int) -> Building:
    """A corridor round a left corner: so many metres along, then up, on its inside."""
    wall = "#" * (along + 1)
    rows = [wall + "." * width + "#"] * up
    rows += ["#" + "." * (along + width) + "#"] * width
    return built([wall + "E" * width + "#", *rows, "#" * (along + width + 2)])


@case("RiMEA 6, IMO 6", "all and none")
def corner(seed: int) -> tuple[bool, Numbers]:
    """Twenty people turn left: arrived, and seen in walls."""
    building = bend(2, 10, 10)
    world = people(building, seed, (20, (0, slice(11, 13), slice(1, 8))))
    crowd, bodies, walls = Crowd(world, seed), world.bodies, 0
    while not crowd.done:
        crowd.step()
        place = crowd.navigation.places_at(bodies.floor, bodies.position)
        walls += int((~building.walkable.flat[place]).sum())
    left = int((~bodies.inside).sum())
    return left == 20 and not walls, {"arrived": left, "in walls": walls}


@case("RiMEA 15", "inside < corner < outside", SHORTEST)
def large_corner(seed: int) -> tuple[bool, Numbers]:
    """Seconds of 500 on 20 m: straight 44 m, round a corner, straight 75 m."""

    def seconds(building: Building, top: int) -> float:
        spot = (0, slice(top, top + 20), slice(1, 8))
        return float(times(Crowd(people(building, seed, (500, spot)), seed)).max())

    def straight(length: int) -> float:
        wall = "#" * (length + 9)
        return seconds(built([wall, *20 * ["#" + "." * (length + 7) + "E"], wall]), 1)

    inside, turn, outside = straight(44), seconds(bend(20, 41, 10), 11), straight(75)
    numbers = {"inside": inside, "corner": turn, "outside": outside}
    return inside <= turn <= outside < inf, numbers


def down() -> Building:
    """A room of 8 m x 5 m, a corridor and stairs 2 m wide; the same below, an exit."""
    floors = []
    for west in "E#":
        rows = [west + "........" + "#" * 17 for _ in range(5)]
        rows[1:3] = [west + "." * 20 + "+AA##"] * 2
        floors.append(["#" * 26, *rows, "#" * 26])
    return built(*floors)


def descent(count: int, seed: int) -> tuple[float, float]:
    """Mean speed, m/s, and flow of so many people down the stairs of `down`."""

    def when(past: Past) -> np.ndarray:
        spot = (1, slice(1, 6), slice(1, 9))
        return times(Crowd(people(down(), seed, (count, spot)), seed), past)

    enter = when(lambda bodies: bodies.stairwell >= 0)
    leave = when(lambda bodies: bodies.walking & (bodies.floor == 0))
    return float(FLIGHT / np.mean(leave - enter)), flow(leave)


@case("RiMEA 3, IMO 3", f"{SLOWEST} to {FASTEST}, flow at most {MOST_DOWN}")
def stairs(seed: int) -> tuple[bool, Numbers]:
    """Down stairs: m/s alone, m/s and flow of a crowd."""
    (fast, _), (slow, many) = descent(1, seed), descent(100, seed)
    numbers = {"alone": fast, "in a crowd": slow, "flow": many / 2}
    passed = SLOWEST <= min(slow, fast) <= max(slow, fast) <= FASTEST
    return passed and many / 2 <= MOST_DOWN, numbers


@case("ISO 16, IMO 11", f"{CONGESTED} or more", "a crowd that flows so well is thinner")
def before_stairs(seed: int) -> tuple[bool, Numbers]:
    """People per m² where a room ends, and before stairs."""
    building = down()
    world = people(building, seed, (150, (1, slice(1, 6), slice(1, 9))))
    room, foot = (1, slice(2, 4), slice(7, 9)), (1, slice(2, 4), slice(19, 21))
    found = densest(Crowd(world, seed), {"room": room, "stairs": foot})
    return within(found, CONGESTED, 9)


# -- The paper's building -----------------------------------------------------------


@case("our own", "100")
def everybody_knows(seed: int) -> tuple[bool, Numbers]:
    """Percent out alive who know the way, by their number."""

    def share(count: int) -> float:
        scenario = Scenario(people=count, robots_per_floor=0)
        world = beginning(load("paper"), scenario, np.random.default_rng(seed))
        crowd = Crowd(world, seed, limit=Scenario.time_limit)
        return 100 * crowd.run().evacuated / count

    return within({f"{count}": share(count) for count in CROWDS}, 100, 100)


def led(count: int, ghosts: bool, seed: int) -> float:
    """Percent out alive of so many people led by sweep."""
    scenario = Scenario(people=count, ghosts=ghosts)
    run = Simulation(load("paper"), scenario, Sweep(), seed=seed)
    return 100 * run.run().evacuated / count


@case(
    "our own",
    f"200: at most {CROWDING} points apart, interval included [chosen]",
    "open where the interval holds the bound",
    runs=1,
)
def ghosts(seed: int) -> tuple[bool, Numbers]:
    """Percent out alive led by sweep, as ghosts without bodies, and points apart."""
    apart, numbers = dict[int, Interval](), Numbers()
    for count, runs in LED.items():
        pairs = [[led(count, g, seed + k) for g in (False, True)] for k in range(runs)]
        apart[count] = of_mean(np.diff(pairs).ravel())
        bodies, bare = np.mean(pairs, axis=0).tolist()
        numbers |= {f"{count}": bodies, f"{count} ghosts": bare}
    mean, low, high = apart[200]
    numbers |= {"200 apart": mean, "at least": low, "at most": high}
    return high <= CROWDING, numbers


NOT_MODELLED = (
    ("RiMEA 2, IMO 2", "stairs up", "nobody walks up"),
    ("RiMEA 5, IMO 5, ISO 1", "premovement", "everybody sets off at 0 s"),
    ("RiMEA 10, IMO 10, ISO 12", "assigned ways", "nobody is told a way beforehand"),
    ("RiMEA 11", "the less crowded exit", "nobody weighs queues against ways"),
    ("RiMEA 12", "a jam before one exit only", "exits hold up as much as corridors do"),
    ("RiMEA 14", "the long or the short way", "nobody compares ways out of sight"),
    ("ISO 6", "smoke", "sight is equally short everywhere, and slows nobody"),
    ("ISO 7", "gases", "only flames and time harm"),
    ("ISO 8", "lifts", "there are none"),
    ("ISO 10", "groups that stay together", "people come alone"),
    ("ISO 11", "wheelchairs", "all bodies are of one kind"),
    ("ISO 14", "familiar exits", "nobody knows the building"),
    ("ISO 15", "an exit closes", "only inner doors can be lost"),
)
"""Cases that need what the model does not have: source, what, why not."""
