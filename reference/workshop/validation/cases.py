"""Standard cases of pedestrian dynamics: what each expects, and what is measured.

Clauses: A3, A7, F8.  Cases and what they accept are those of the guidelines of RiMEA
(2016), IMO (MSC.1/Circ.1533) and ISO 20414; what these leave open is marked [chosen].
In all but `sweep` everybody knows the nearest way out and nobody thinks.

    n   people;  rows, cols  of a floor's drawing, walls included
"""

from collections.abc import Callable, Sequence
from functools import cache
from itertools import pairwise
from math import exp, inf, isfinite
from typing import Any, NamedTuple

import numpy as np

from reference import motion
from reference.beginning import beginning
from reference.building import Building, load
from reference.paper import FLIGHT, WALKING_SPEED, WALKING_SPREAD, Scenario
from reference.simulation import Simulation
from reference.workshop.strategies.robots import Sweep
from reference.workshop.validation.crowd import (
    TICK,
    Crowd,
    Past,
    built,
    densest,
    east_of,
    flow,
    out,
    people,
    times,
)

LEAST_FLOW, MOST_FLOW = 0.6, 1.33
"""People per metre and second: what crowds were seen to pass at least, and IMO 4."""

MOST_DOWN = 1.1  # people per metre and second on stairs down: IMO
SLOWEST_DOWN, FASTEST_DOWN = 0.64, 1.07  # m/s down stairs: IMO
CONGESTED = 3.5  # people per square metre: IMO
MEAN_SPEED, SPREAD = 1.34, 0.26  # m/s: Weidmann (1993)
BESIDE = 0.2  # m/s: about as far as other published curves are from Weidmann's
RING = (20.0, 4.0)  # metres, length and width
DENSITIES = (0.5, 1.0, 2.0, 3.0, 4.0, 5.0)  # people per square metre
WIDTHS = (1, 2, 3)  # metres of a door
AGAINST = (0, 10, 50, 100)  # people who come towards a hundred
CROWDS = (100, 200, 400)  # people in the paper's building
CROWDING = 28  # points of survival that bodies may cost two hundred: once it was 56

RUNS = 3  # seeds of each case

Numbers = dict[str, float]


class Case(NamedTuple):
    """A case of the guidelines; measure: seed -> does it pass, and what came out.

    What is measured, the docstring of `measure` says.
    """

    source: str
    accepted: str
    measure: Callable[[int], tuple[bool, Numbers]]

    @property
    def what(self) -> str:
        """What is measured."""
        return str(self.measure.__doc__).rstrip(".")


def measured(name: str, seeds: Sequence[int]) -> dict[str, Any]:
    """Measure one of the CASES with each seed: a row of the table, with means.

    It passes if it does so with every seed.
    """
    case = CASES[name]
    passed, numbers = zip(*(case.measure(seed) for seed in seeds), strict=True)
    means = {key: float(np.mean([each[key] for each in numbers])) for key in numbers[0]}
    return {
        "case": name,
        "source": case.source,
        "what": case.what,
        "accepted": case.accepted,
        "measured": {k: round(v, 3) if isfinite(v) else None for k, v in means.items()},
        "failed": passed.count(False),
        "verdict": "passes" if all(passed) else "fails",
    }


def within(numbers: Numbers, low: float, high: float) -> tuple[bool, Numbers]:
    """Pass if every number lies between two bounds."""
    return all(low <= number <= high for number in numbers.values()), numbers


# -- Speeds -------------------------------------------------------------------------


def corridor(seed: int) -> tuple[bool, Numbers]:
    """Seconds for 40 m, alone, at 1.33 and 1 m/s."""
    building = built(["#" * 45, *2 * ["#" + "." * 43 + "E"], "#" * 45])

    def seconds(pace: float, col: int) -> float:
        world = people(building, seed, (1, (0, slice(1, 2), slice(1, 2))))
        world.bodies.pace[:] = pace
        return float(times(Crowd(world), east_of(building, col))[0])

    fast, slow = (seconds(pace, 42) - seconds(pace, 2) for pace in (1.33, 1.0))
    return 26 <= fast <= 34 and 38 <= slow <= 42, {"1.33 m/s": fast, "1 m/s": slow}


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
        moved = motion.step(at, floor, target, pace[near % n], TICK, _in_ring, rng)
        moved = moved[:n]
        walked.append((moved - position)[:, 0].mean() / TICK)
        position = moved % [length, inf]
    return float(np.mean(walked[round(10 / TICK) :]))


def _in_ring(position: np.ndarray, who: np.ndarray) -> np.ndarray:
    return (position[:, 1] > 0) & (position[:, 1] < RING[1])


def fundamental_diagram(seed: int) -> tuple[bool, Numbers]:
    """Mean speed, m/s, by people per m²."""
    speed = {each: speed_in_ring(each, seed) for each in DENSITIES}
    falls = all(one >= other for one, other in pairwise(speed.values()))
    near = all(abs(v - weidmann(d)) < BESIDE for d, v in speed.items() if d <= 4)
    return falls and near, {f"{d:g}": v for d, v in speed.items()}


# -- Doors --------------------------------------------------------------------------


@cache
def passages(gate: str, width: int, seed: int) -> np.ndarray:
    """Seconds at which a hundred from 8 m x 5 m pass an exit, E, or inner door, +."""
    first = (6 - width) // 2
    gates = [gate if first <= k < first + width else "#" for k in range(5)]
    beyond = "........E" if gate == "+" else ""
    rows = ["#........" + each + beyond for each in gates]
    wall = "#" * len(rows[0])
    building = built([wall, *rows, wall])
    world = people(building, seed, (100, (0, slice(1, 6), slice(1, 9))))
    return times(Crowd(world), east_of(building, 10))


def exits(seed: int) -> tuple[bool, Numbers]:
    """People per metre and second, by width of an exit."""
    return within(_flows("E", seed), LEAST_FLOW, MOST_FLOW)


def doors(seed: int) -> tuple[bool, Numbers]:
    """People per metre and second, by width of an inner door."""
    return within(_flows("+", seed), LEAST_FLOW, MOST_FLOW)


def _flows(gate: str, seed: int) -> Numbers:
    return {f"{w} m": flow(passages(gate, w, seed)) / w for w in WIDTHS}


def large_room(seed: int) -> tuple[bool, Numbers]:
    """Seconds in which a thousand leave a large room."""
    four, seconds = "#######E################E#######", []
    for south in (four, "#" * 32):
        building = built([four, *20 * ["#" + "." * 30 + "#"], south])
        world = people(building, seed, (1000, (0, slice(1, 21), slice(1, 31))))
        seconds.append(float(times(Crowd(world, limit=600), out).max()))
    numbers = {"4 exits": seconds[0], "2 exits": seconds[1]}
    return 1.7 <= seconds[1] / seconds[0] <= 2.3, numbers


def bottleneck(seed: int) -> tuple[bool, Numbers]:
    """People per m² before a 1 m corridor, and its exit."""
    wide = "#..........#####..........#"
    rows = [wide if k != 5 else "#" + "." * 25 + "E" for k in range(10)]
    building = built(["#" * 27, *rows, "#" * 27])
    world = people(building, seed, (150, (0, slice(1, 11), slice(1, 11))))
    spots = [(0, slice(5, 8), slice(end, end + 2)) for end in (9, 24)]
    numbers = densest(Crowd(world), dict(zip(("corridor", "exit"), spots, strict=True)))
    return numbers["exit"] < CONGESTED <= numbers["corridor"], numbers


def counterflow(seed: int) -> tuple[bool, Numbers]:
    """Seconds of a hundred through 10 m x 2 m, by those against them."""
    rows = ["E" + "." * 10 + "#" * 10 + "." * 10 + "E"] * 10
    rows[4:6] = ["E" + "." * 30 + "E"] * 2
    building = built(["#" * 32, *rows, "#" * 32])
    west, east = (m.index for m in sorted(building.landmarks, key=lambda m: m.position))
    seconds = {}
    for against in AGAINST:
        groups = [
            (n, (0, slice(1, 11), slice(end, end + 10)))
            for n, end in ((100, 1), (against, 21))
        ]
        world = people(building, seed, *groups)
        crowd = Crowd(world, [east] * 100 + [west] * against)
        line = east_of(building, 21)
        seconds[f"{against}"] = float(times(crowd, line)[:100].max())
    return all(a < b < inf for a, b in pairwise(seconds.values())), seconds


# -- Corners and stairs -------------------------------------------------------------


def bend(width: int, leg: int) -> Building:
    """A corridor of two legs round a left corner, so many metres along its inside."""
    end = "#" * (leg + 1)
    up = [end + "." * width + "#"] * leg
    along = ["#" + "." * (leg + width) + "#"] * width
    return built([end + "E" * width + "#", *up, *along, "#" * (leg + width + 2)])


def corner(seed: int) -> tuple[bool, Numbers]:
    """Twenty people turn left: arrived, and seen in walls."""
    building = bend(2, 10)
    world = people(building, seed, (20, (0, slice(11, 13), slice(1, 8))))
    crowd, walkable, walls = Crowd(world), building.walkable.ravel(), 0
    while not crowd.done:
        crowd.step()
        place = crowd.navigation.places_at(world.bodies.floor, world.bodies.position)
        walls += int((~walkable[place]).sum())
    left = int(out(world.bodies).sum())
    return left == 20 and not walls, {"arrived": left, "in walls": walls}


def large_corner(seed: int) -> tuple[bool, Numbers]:
    """Seconds of 150 people round a corner, and straight."""
    width, leg = 5, 20

    def seconds(building: Building, top: int) -> float:
        spot = (0, slice(top, top + width), slice(1, 11))
        return float(times(Crowd(people(building, seed, (150, spot))), out).max())

    def straight(length: int) -> float:
        walls = ["#" * (length + 2)]
        return seconds(built(walls + ["#" + "." * length + "E"] * width + walls), 1)

    inside, outside = straight(2 * leg), straight(2 * leg + 2 * width)
    round_it = seconds(bend(width, leg), leg + 1)
    numbers = {"inside": inside, "corner": round_it, "outside": outside}
    return inside <= round_it <= outside < inf, numbers


def down() -> Building:
    """A room of 8 m x 5 m, a corridor and stairs 2 m wide; the same below, an exit."""
    floors = []
    for west in "E#":
        rows = [west + "........" + "#" * 17 for _ in range(5)]
        rows[1:3] = [west + "." * 20 + "+AA##"] * 2
        floors.append(["#" * 26, *rows, "#" * 26])
    return built(*floors)


@cache
def descents(count: int, seed: int) -> np.ndarray:
    """(2, n) seconds at which people enter the stairs of `down`, and leave them."""
    building = down()

    def when(past: Past) -> np.ndarray:
        spot = (1, slice(1, 6), slice(1, 9))
        return times(Crowd(people(building, seed, (count, spot))), past)

    enter = when(lambda bodies: bodies.stairwell >= 0)
    return np.stack([enter, when(lambda bodies: bodies.walking & (bodies.floor == 0))])


def stairs(seed: int) -> tuple[bool, Numbers]:
    """Down stairs: m/s alone, m/s and flow of a crowd."""
    alone, many = descents(1, seed), descents(100, seed)
    slow, fast = sorted(float(FLIGHT / np.mean(t[1] - t[0])) for t in (alone, many))
    down = flow(many[1]) / 2
    numbers = {"alone": fast, "in a crowd": slow, "flow": down}
    return SLOWEST_DOWN <= slow <= fast <= FASTEST_DOWN and down <= MOST_DOWN, numbers


def before_stairs(seed: int) -> tuple[bool, Numbers]:
    """People per m² where a room ends, and before stairs."""
    building = down()
    world = people(building, seed, (150, (1, slice(1, 6), slice(1, 9))))
    room, foot = (1, slice(2, 4), slice(7, 9)), (1, slice(2, 4), slice(19, 21))
    return within(densest(Crowd(world), {"room": room, "stairs": foot}), CONGESTED, 9)


# -- The paper's building -----------------------------------------------------------


def everybody_knows(seed: int) -> tuple[bool, Numbers]:
    """Percent out alive who know the way, by their number."""
    share = {}
    for count in CROWDS:
        rng = np.random.default_rng(seed)
        world = beginning(
            load("paper"), Scenario(people=count, robots_per_floor=0), rng
        )
        outcome = Crowd(world, limit=Scenario.time_limit).run()
        share[f"{count}"] = 100 * outcome.evacuated / count
    return within(share, 100, 100)


def guided(seed: int) -> tuple[bool, Numbers]:
    """Percent out alive led by sweep, and as ghosts: without bodies."""
    share, building = {}, load("paper")
    for count in CROWDS:
        for ghosts in (False, True):
            scenario = Scenario(people=count, ghosts=ghosts)
            outcome = Simulation(building, scenario, Sweep(), seed=seed).run()
            name = f"{count} ghosts" if ghosts else f"{count}"
            share[name] = 100 * outcome.evacuated / count
    return share["200 ghosts"] - share["200"] <= CROWDING, share


# -- The table ----------------------------------------------------------------------

PER_METRE = f"{LEAST_FLOW} [chosen] to {MOST_FLOW}"
BY_CURVE = f"falls; up to 4 within {BESIDE} of Weidmann's [chosen]"
DOWN = f"{SLOWEST_DOWN} to {FASTEST_DOWN}, flow at most {MOST_DOWN}"
CASES = {
    "corridor": Case("RiMEA 1, IMO 1", "26 to 34; 40 within 5 % [chosen]", corridor),
    "speeds": Case("RiMEA 7", "1.34 and 0.26 within 5 and 20 % [chosen]", speeds),
    "density": Case("RiMEA 4, IMO 12", BY_CURVE, fundamental_diagram),
    "corner": Case("RiMEA 6, IMO 6", "all and none", corner),
    "large-corner": Case("RiMEA 15", "inside < corner < outside", large_corner),
    "exit": Case("IMO 4", PER_METRE, exits),
    "door": Case("IMO 4, inside", PER_METRE, doors),
    "large-room": Case(
        "RiMEA 9, IMO 9", "about double [chosen: 1.7 to 2.3]", large_room
    ),
    "bottleneck": Case("RiMEA 12", f"{CONGESTED} or more; less", bottleneck),
    "counterflow": Case("IMO 8", "rises", counterflow),
    "congestion": Case("ISO 16, IMO 11", f"{CONGESTED} or more", before_stairs),
    "stairs": Case("RiMEA 3, IMO 3", DOWN, stairs),
    "everybody": Case("our own", "100", everybody_knows),
    "ghosts": Case("our own", f"200: at most {CROWDING} points apart [chosen]", guided),
}
NOT_MODELLED = {
    "RiMEA 2, IMO 2": ("stairs up", "nobody walks up"),
    "RiMEA 5, IMO 5, ISO 1": ("premovement", "everybody sets off at 0 s"),
    "RiMEA 10, IMO 10, ISO 12": ("assigned ways", "nobody is told a way beforehand"),
    "RiMEA 11": ("the less crowded exit", "nobody weighs queues against ways"),
    "RiMEA 14": ("the long or the short way", "nobody compares ways out of sight"),
    "ISO 6": ("smoke", "sight is equally short everywhere, and slows nobody"),
    "ISO 7": ("gases", "only flames and time harm"),
    "ISO 8": ("lifts", "there are none"),
    "ISO 10": ("groups that stay together", "people come alone"),
    "ISO 11": ("wheelchairs", "all bodies are of one kind"),
    "ISO 14": ("familiar exits", "nobody knows the building"),
    "ISO 15": ("an exit closes", "only inner doors can be lost"),
}
"""Cases that need what the model does not have: what, and why not."""
