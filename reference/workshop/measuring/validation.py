"""Measure the model by standard cases of pedestrian dynamics.

The cases, and what they accept, are those of the guidelines of RiMEA (2016), IMO
(MSC.1/Circ.1533) and ISO 20414; what these leave open is marked [chosen]. Everybody
knows the nearest way out and nobody thinks.

    n   people;  rows, cols  of a floor's drawing, walls included
"""

import tomllib
from collections.abc import Callable
from functools import cache
from itertools import pairwise
from math import exp, inf, isfinite
from pathlib import Path
from typing import Any

import numpy as np

from reference import motion, paper
from reference.beginning import starting_world
from reference.building import Building
from reference.paper import Scenario
from reference.workshop.maps import load
from reference.workshop.measuring.halls import (
    Crowd,
    Past,
    Spot,
    build_floors,
    east_of,
    flow,
    hall,
    passing_times,
    peak_density,
    put_people,
)
from reference.workshop.storage.numbers import paper_numbers

CASE_TEXTS = tomllib.loads(
    Path(__file__).with_name("validation.toml").read_text("utf-8")
)
CASES: dict[str, dict[str, Any]] = {
    name: {"runs": 3, "note": ""} | case for name, case in CASE_TEXTS["cases"].items()
}
"""Each case's source, what is accepted, the number of seeds and a note."""
NOT_MODELLED: dict[str, list[str]] = CASE_TEXTS["not_modelled"]
"""Cases that need what the model does not have, by source: what, why not."""

BAND = 0.2  # m/s [A9, chosen]: other published curves are as far from Weidmann's
DENSITIES = (0.5, 1.0, 2.0, 3.0, 4.0, 5.0)  # people per square metre

ONE_WAY = {0.6: 1.35, 1.1: 1.21, 1.6: 1.0, 2.05: 0.65, 2.5: 0.41, 3.05: 0.31}
OPPOSED = {0.75: 1.05, 1.25: 1.01}
"""Real people, m/s by people per square metre: all one way, and in a counterflow 4 m
wide, in the middle of 0.5 to 1 and of 1 to 1.5 people."""
REAL_PEOPLE_SOURCE = (
    "PedPy's demonstration data, trajectories of the Jülich data archive"
)
"""The source of both, and of real people's flow through exits, 1.9 to 2.4.

Our densities are people per area, counted. Who compares them with Voronoi densities of
PedPy 1.5 sets `Cutoff(radius=..., quad_segments=16)`: by default the circle is a
polygon of 12 corners, 4.5 % smaller, and people who stand alone are that much denser.
"""

CASES["fundamental-diagram"]["note"] = "real people: " + ", ".join(
    f"{speed} at {density}" for density, speed in ONE_WAY.items()
)

Numbers = dict[str, float]
CaseResult = tuple[bool, Numbers]
"""Does a case pass, and what came out; a measure's docstring says what that is."""


def all_between(numbers: Numbers, low: float, high: float) -> CaseResult:
    """Pass if every number lies between two bounds."""
    return all(low <= number <= high for number in numbers.values()), numbers


def seconds(building: Building, seed: int, count: int, spot: Spot) -> float:
    """Seconds until `count` people in a spot have left the building, inf for never."""
    return float(
        passing_times(Crowd(put_people(building, seed, (count, spot)), seed)).max()
    )


# -- Speeds -------------------------------------------------------------------------


def corridor(seed: int) -> CaseResult:
    """Seconds for 40 m, alone, at 1.33 and 1 m/s."""

    def alone(pace: float) -> float:
        """Seconds at this speed."""
        world = put_people(hall("#" + "." * 43 + "E"), seed, (1, np.s_[0, 1:2, 1:2]))
        world.bodies.pace[:] = pace
        end = world.bodies.position[:, 0] + 40
        return float(
            passing_times(Crowd(world, seed), lambda b: b.position[:, 0] >= end)[0]
        )

    fast = alone(1.33)
    slow = alone(1.0)
    return 26 <= fast <= 34 and 38 <= slow <= 42, {"1.33 m/s": fast, "1 m/s": slow}


def speeds(seed: int) -> CaseResult:
    """Free speeds of a thousand people, m/s."""
    rng = np.random.default_rng(seed)
    pace = starting_world(load("paper"), Scenario(people=1000), rng).bodies.pace
    mean = float(pace.mean())
    spread = float(pace.std())
    near = abs(mean / 1.34 - 1) < 0.05 and abs(spread / 0.26 - 1) < 0.2
    return near, {"mean": mean, "deviation": spread}


def weidmann(density: float) -> float:
    """Mean speed, m/s, at a density, people per square metre."""
    return max(0.0, 1.34 * (1 - exp(-1.913 * (1 / density - 1 / 5.4))))


def speed_in_ring(density: float, seed: int) -> float:
    """Mean speed, m/s, in 20 m x 4 m whose ends are joined, from 10 s to 30 s."""
    return _speed_in_ring(density, seed, tuple(paper_numbers().values()))


@cache  # the picture asks again what the table has asked
def _speed_in_ring(density: float, seed: int, numbers: tuple[Any, ...]) -> float:
    """numbers: those of the paper that it was measured under."""
    length = 20.0
    width = 4.0
    tick = 0.2
    rng = np.random.default_rng(seed)

    def inside(position: np.ndarray, who: np.ndarray) -> np.ndarray:
        return (position[:, 1] > 0) & (position[:, 1] < width)

    n = round(density * length * width)
    size = width / 9
    spots = rng.choice(9 * round(length / size), n, replace=False)
    position = (np.stack(np.divmod(spots, 9), axis=1) + 0.5) * size
    pace = rng.normal(paper.WALKING_SPEED, paper.WALKING_SPREAD, n).clip(0.8, 1.9)
    shift = np.repeat([[0.0, 0], [length, 0], [-length, 0]], n, axis=0)
    walked = []
    for _ in range(150):
        again = np.tile(position, (3, 1)) + shift  # people, and both ends once more
        near = np.flatnonzero(np.abs(again[:, 0] - length / 2) < length / 2 + 4)
        at = again[near]
        floor = np.zeros(len(near), int)
        ahead = at + np.array([40.0, 0.0])
        paces = pace[near % n]
        moved = motion.step(at, floor, ahead, paces, tick, inside, rng)[:n]
        walked.append((moved - position)[:, 0].mean() / tick)
        position = moved % [length, inf]
    return float(np.mean(walked[50:]))


def fundamental_diagram(seed: int) -> CaseResult:
    """Mean speed, m/s, by people per m²."""
    speed = {each: speed_in_ring(each, seed) for each in DENSITIES}
    falls = all(one >= other for one, other in pairwise(speed.values()))
    flows = {each: each * v for each, v in speed.items()}  # people per m and second
    moderate = max(flow for each, flow in flows.items() if each <= 2)
    falls &= flows[DENSITIES[-1]] < moderate
    near = all(abs(v - weidmann(d)) < BAND for d, v in speed.items() if d <= 4)
    return falls and near, {f"{d:g}": v for d, v in speed.items()}


# -- Doors --------------------------------------------------------------------------


def doors(seed: int) -> CaseResult:
    """People per metre and second, by width, of exits and inner doors."""
    numbers = Numbers()
    for name, gate, beyond in (("exit", "E", ""), ("door", "+", "........E")):
        for wide in (1, 2, 3):
            column = ["#"] * 5
            first = (6 - wide) // 2
            column[first : first + wide] = gate * wide
            building = hall(*("#........" + each + beyond for each in column))
            crowd = Crowd(put_people(building, seed, (100, np.s_[0, 1:6, 1:9])), seed)
            passed = passing_times(crowd, east_of(building, 10))
            numbers[f"{name} {wide} m"] = flow(passed) / wide
    return all_between(numbers, 0.6, 1.33)


def large_room(seed: int) -> CaseResult:
    """Seconds in which 250 leave a quarter of the guidelines' room."""
    exits = "####E#######E####"
    inside = ["#" + "." * 15 + "#"] * 10
    spot = np.s_[0, 1:11, 1:16]
    four = seconds(build_floors([exits, *inside, exits]), seed, 250, spot)
    two = seconds(build_floors([exits, *inside, "#" * 17]), seed, 250, spot)
    return 1.7 <= two / four <= 2.3, {"4 exits": four, "2 exits": two}


def counterflow(seed: int) -> CaseResult:
    """Seconds of a hundred through 10 m x 2 m, by those against them."""
    rows = ["E" + "." * 10 + "#" * 10 + "." * 10 + "E"] * 10
    rows[4:6] = ["E" + "." * 30 + "E"] * 2
    building = hall(*rows)
    west, east = sorted(building.landmarks, key=lambda mark: mark.position)
    numbers = Numbers()
    for n in (0, 10, 50, 100):
        from_west = (100, np.s_[0, 1:11, 1:11])
        from_east = (n, np.s_[0, 1:11, 21:31])
        goals = [east.index] * 100 + [west.index] * n
        crowd = Crowd(put_people(building, seed, from_west, from_east), seed, goals)
        numbers[f"{n}"] = float(passing_times(crowd, east_of(building, 21))[:100].max())
    return all(a < b < inf for a, b in pairwise(numbers.values())), numbers


# -- Corners and stairs -------------------------------------------------------------


def bent_corridor(width: int, along: int, up: int) -> Building:
    """A corridor round a left corner: metres along, then up, on its inside."""
    wall = "#" * (along + 1)
    rows = [wall + "." * width + "#"] * up
    rows += ["#" + "." * (along + width) + "#"] * width
    return build_floors([wall + "E" * width + "#", *rows, "#" * (along + width + 2)])


def corner(seed: int) -> CaseResult:
    """Twenty people turn left: arrived, and seen in walls."""
    world = put_people(bent_corridor(2, 10, 10), seed, (20, np.s_[0, 11:13, 1:8]))
    crowd = Crowd(world, seed)
    bodies = world.bodies
    walls = 0
    while not crowd.done:
        crowd.step()
        place = crowd.navigation.places_at(bodies.floor, bodies.position)
        walls += int((~world.building.walkable.flat[place]).sum())
    left = int((~bodies.inside).sum())
    return left == 20 and not walls, {"arrived": left, "in walls": walls}


def large_corner(seed: int) -> CaseResult:
    """Seconds of 500 on 20 m: straight 44 m, round a corner, straight 75 m."""
    spot = np.s_[0, 1:21, 1:8]

    def straight(metres: int) -> float:
        """Seconds so far to the exit."""
        row = "#" + "." * (metres + 7) + "E"
        return seconds(hall(*20 * [row]), seed, 500, spot)

    inside = straight(44)
    outside = straight(75)
    turn = seconds(bent_corridor(20, 41, 10), seed, 500, np.s_[0, 11:31, 1:8])
    numbers = {"inside": inside, "corner": turn, "outside": outside}
    return inside <= turn <= outside < inf, numbers


def two_storeys() -> Building:
    """Build a room, 8 m x 5 m, a corridor, stairs 2 m wide; below, an exit too [A3]."""
    floors = []
    for west in "E#":
        rows = [west + "........" + "#" * 17 for _ in range(5)]
        rows[1:3] = [west + "." * 20 + "+AA##"] * 2
        floors.append(["#" * 26, *rows, "#" * 26])
    return build_floors(*floors)


def stairs(seed: int) -> CaseResult:
    """Down stairs: m/s alone, m/s and flow of a crowd."""

    def when(count: int, past: Past) -> np.ndarray:
        crowd = put_people(two_storeys(), seed, (count, np.s_[1, 1:6, 1:9]))
        return passing_times(Crowd(crowd, seed), past)

    numbers = Numbers()
    for name, count in (("alone", 1), ("in a crowd", 100)):
        enter = when(count, lambda bodies: bodies.stairwell >= 0)
        leave = when(count, lambda bodies: bodies.walking & (bodies.floor == 0))
        numbers[name] = float(paper.FLIGHT / np.mean(leave - enter))
    crowd_leaves = leave  # seconds, of the last: the crowd
    passed, _ = all_between(numbers, 0.64, 1.07)
    numbers["flow"] = flow(crowd_leaves) / 2
    return passed and numbers["flow"] <= 1.1, numbers


def before_stairs(seed: int) -> CaseResult:
    """People per m² where a room ends, and before stairs."""
    numbers = Numbers()
    for name, first in (("room", 7), ("stairs", 19)):
        spot = np.s_[1, 2:4, first : first + 2]
        world = put_people(two_storeys(), seed, (150, np.s_[1, 1:6, 1:9]))
        numbers[name] = peak_density(Crowd(world, seed), spot)
    return all_between(numbers, 3.5, 9)  # IMO: where congestion begins


# -- The paper's building -----------------------------------------------------------


def everybody_knows(seed: int) -> CaseResult:
    """Percent out alive who know the way, by their number."""
    numbers = Numbers()
    for count in (100, 200, 400):
        scenario = Scenario(people=count, robots_per_floor=0)
        world = starting_world(load("paper"), scenario, np.random.default_rng(seed))
        crowd = Crowd(world, seed, limit=Scenario().time_limit)
        numbers[f"{count}"] = 100 * crowd.run().evacuated / count
    return all_between(numbers, 100, 100)


# -- The table ----------------------------------------------------------------------

MEASURES: dict[str, Callable[[int], CaseResult]] = {
    measure.__name__.replace("_", "-"): measure
    for measure in (
        *(corridor, speeds, fundamental_diagram),
        *(doors, large_room, counterflow),
        *(corner, large_corner, stairs, before_stairs),
        everybody_knows,
    )
}
"""How each case is measured, by a seed."""


def measure_case(name: str, seed: int) -> dict[str, Any]:
    """Measure one of the CASES over its seeds, from this one on; return a table row.

    It passes if it does so with every seed.  A number is the mean over the seeds where
    it is finite, None if there are none; `never` counts the others.
    """
    count = CASES[name]["runs"]
    results = [MEASURES[name](each) for each in range(seed, seed + count)]
    failed = sum(not passed for passed, _ in results)

    means: dict[str, float | None] = {}
    never: dict[str, int] = {}
    for key in results[0][1]:
        values = [numbers[key] for _, numbers in results if isfinite(numbers[key])]
        means[key] = round(float(np.mean(values)), 3) if values else None
        if len(values) < count:
            never[key] = count - len(values)

    return CASES[name] | {
        "case": name,
        "what": str(MEASURES[name].__doc__).rstrip("."),
        "measured": means,
        "never": never,
        "runs": count,
        "failed": failed,
        "verdict": "fails" if failed else "passes",
    }
