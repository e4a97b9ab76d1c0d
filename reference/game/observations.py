"""What the agents observe: 167 numbers and a 40 x 40 grid for the paper's building.

Clauses: C1, C2, C3, C4, D1.  Everything is computed from the world by pure functions;
sizes follow from the building and the scenario.

    n   people;  R  robots;  F  fire sources;  V  numbers of a vector
    point       x, y in metres and the storey, 0 is the first floor
    normalised   metres from the middle of the main body, divided by half its size: the
                body is [-1, 1] x [-1, 1]
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from reference.building import Building, Kind
from reference.paper import HEALTH, Scenario
from reference.world import World

SENTINEL = (0.0, 0.0, -1.0)
"""[C1, chosen] who is out or dead, robots whose work is done and fires not yet lit are
in the middle, one storey below the ground: a place where nothing else can be."""

GRID_KINDS = ("walls", "fires", "exits")
"""[C3, chosen] kinds of channels, in this order; each has one channel per floor."""

SMALLEST_GRID = 20
"""[C3, chosen] cells: the `simple` encoder's two convolutions need so many."""


class Slot(NamedTuple):
    """Numbers start .. stop - 1 of a vector: what they say, and in which units."""

    start: int
    stop: int
    what: str
    unit: str


@dataclass(frozen=True)
class Scene:
    """What a vector says, in metres and storeys; gone ones are rows of SENTINEL.

    humans (..., n, 3);  robots (..., R, 3);  fires (..., F, 3);  time (...) s
    The fire agent is told neither fires, F = 0, nor the time, nan.
    """

    humans: np.ndarray
    robots: np.ndarray
    fires: np.ndarray
    time: np.ndarray


class Parts(NamedTuple):
    """Where the parts of a vector are, in the order of C1."""

    humans: slice
    robots: slice
    team: slice
    time: slice
    fires: slice
    fires_per_floor: slice


@lru_cache(maxsize=64)
def _parts(floors: int, scenario: Scenario) -> Parts:
    people = sum(scenario.start_counts(floors))
    robots = scenario.robots_per_floor * floors
    sizes = (3 * people, 3 * robots, 1, 1, 3 * scenario.sources, floors)
    ends = np.cumsum(sizes).tolist()
    return Parts(*(slice(e - s, e) for s, e in zip(sizes, ends, strict=True)))


# -- A robot's vector ---------------------------------------------------------------


def vector_size(building: Building, scenario: Scenario) -> int:
    """V = 3n + 3R + 1 + 1 + 3F + floors; 167 for the paper [C1] [C2]."""
    return _parts(building.floors, scenario).fires_per_floor.stop


def robot_vectors(world: World, scenario: Scenario) -> np.ndarray:
    """(R, V) float32: row k is what robot k observes, as `layout` says [C1] [C4].

    scenario: the simulation's own.
    """
    floors, (humans, robots) = world.building.floors, points(world)
    parts = _parts(floors, scenario)
    where = _places_of_robots(world)
    floor = tuple(robot.floor for robot in world.robots)
    rows = np.empty((len(robots), parts.fires_per_floor.stop), dtype=np.float32)
    nearest = _nearest_first(where, np.array(floor, dtype=int), humans, floors)
    rows[:, parts.humans] = _flat(humans[nearest])
    rows[:, parts.robots] = _flat(robots[_observer_first(floor)])
    rows[:, parts.team] = scenario.robots_per_floor
    rows[:, parts.time] = world.time
    fires = sources(world, scenario.sources)
    rows[:, parts.fires] = fires.ravel()
    rows[:, parts.fires_per_floor] = [(fires[:, 2] == f).sum() for f in range(floors)]
    return rows


def points(world: World) -> tuple[np.ndarray, np.ndarray]:
    """(n, 3) and (R, 3) points of all people and robots, in order of their numbers.

    People on the stairs are in a cell of the stairwell, on the floor they come from.
    """
    bodies, robots = world.bodies, world.robots
    humans = np.column_stack([bodies.position, bodies.floor])
    humans[~bodies.inside] = SENTINEL
    floor = np.array([robot.floor for robot in robots])
    team = np.column_stack([_places_of_robots(world), floor.reshape(len(robots), 1)])
    team[~robots_at_work(world)] = SENTINEL
    return humans, team


def _places_of_robots(world: World) -> np.ndarray:
    """(R, 2) metres, those whose work is done too."""
    return np.array([robot.position for robot in world.robots]).reshape(-1, 2)


def robots_at_work(world: World) -> np.ndarray:
    """(R,) bool: is anybody inside on the robot's floor or above it? [C8]"""
    here = [world.people_at_or_above(robot.floor) > 0 for robot in world.robots]
    return np.array(here, dtype=bool)


def sources(world: World, most: int) -> np.ndarray:
    """(F, 3) points of the sources in the order of lighting."""
    fires = np.tile(SENTINEL, (most, 1))
    for k, source in enumerate(world.flames.sources[:most]):
        fires[k] = source.x, source.y, source.floor
    return fires


def _nearest_first(
    where: np.ndarray, floor: np.ndarray, humans: np.ndarray, floors: int
) -> np.ndarray:
    """(R, n) people in the order in which each robot sees them [C4, chosen].

    First its own floor, then the floors above, who will come through, the next one
    first; then the floors below, the next one first, and SENTINEL, the lowest, last.
    Within a floor by distance in metres, equal ones by number.
    """
    up = humans[:, 2] - floor[:, None]
    rank = np.where(up >= 0, up, floors - up)
    off = humans[:, :2] - where[:, None]
    distance = np.hypot(off[..., 0], off[..., 1])
    return np.lexsort((distance, rank), axis=1)


@lru_cache(maxsize=64)
def _observer_first(floor: tuple[int, ...]) -> np.ndarray:
    """(R, R) robots in the order in which each sees them: itself, its team, others."""
    number = np.arange(len(floor))
    other_floor = np.not_equal.outer(floor, floor)
    not_me = number[:, None] != number
    return np.lexsort((np.broadcast_to(number, not_me.shape), not_me, other_floor))


def layout(building: Building, scenario: Scenario) -> tuple[Slot, ...]:
    """What each number of a robot's vector is; together they are the whole vector.

    For the paper, in the order of C1, and as C4 says for the observer:

          0-119  humans: own floor first, then above, then below; nearest first
        120-137  robots: the observer, its team, those elsewhere; by number
        138      robots in the observer's team
        139      time
        140-163  fire sources, in the order of lighting
        164-166  fire sources on each floor, the first floor first

    A human who is out or dead, a robot whose work is done and a fire not yet lit is
    SENTINEL; people who are gone come last.
    """
    parts = _parts(building.floors, scenario)
    team, fires = scenario.robots_per_floor, scenario.sources
    mates = [f"team mate {k}" for k in range(1, team)]
    others = [
        f"robot elsewhere {k}" for k in range(1, team * (building.floors - 1) + 1)
    ]
    observer = ["the observer"] if team else []
    floors = [f"fire sources on floor {k}" for k in range(1, building.floors + 1)]
    return (
        *_slots_of_points(parts.humans, _numbered("human", _people(parts))),
        *_slots_of_points(parts.robots, observer + mates + others),
        Slot(parts.team.start, parts.team.stop, "robots in the observer's team", "1"),
        Slot(parts.time.start, parts.time.stop, "time since the beginning", "s"),
        *_slots_of_points(parts.fires, _numbered("fire source", fires)),
        *_slots(parts.fires_per_floor, floors, 1, "1"),
    )


def limits(building: Building, scenario: Scenario) -> tuple[np.ndarray, np.ndarray]:
    """(V,) float32 each: what no number of a robot's vector is below or above."""
    parts = _parts(building.floors, scenario)
    low = np.zeros(parts.fires_per_floor.stop, dtype=np.float32)
    high = low.copy()
    lowest, highest = _corners(building)
    for part in (parts.humans, parts.robots, parts.fires):
        low[part].reshape(-1, 3)[:], high[part].reshape(-1, 3)[:] = lowest, highest
    high[parts.team] = scenario.robots_per_floor
    high[parts.time] = scenario.time_limit + scenario.tick
    high[parts.fires_per_floor] = scenario.sources
    return low, high


def decode(vectors: np.ndarray, building: Building, scenario: Scenario) -> Scene:
    """What robots' vectors say; vectors: (..., V)."""
    parts = _parts(building.floors, scenario)
    return Scene(
        humans=_rows_of_3(vectors[..., parts.humans]),
        robots=_rows_of_3(vectors[..., parts.robots]),
        fires=_rows_of_3(vectors[..., parts.fires]),
        time=vectors[..., parts.time.start],
    )


def _flat(rows: np.ndarray) -> np.ndarray:
    """(R, k, 3) -> (R, 3k), also for nobody."""
    return rows.reshape(len(rows), 3 * rows.shape[1])


def _rows_of_3(numbers: np.ndarray) -> np.ndarray:
    """(..., 3k) -> (..., k, 3), also for no numbers at all."""
    return numbers.reshape(*numbers.shape[:-1], numbers.shape[-1] // 3, 3)


def _corners(building: Building) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """The lowest and the highest point of the drawing, SENTINEL among them."""
    rows, cols = building.kind.shape[1:]
    left, top = building.metres(-0.5, -0.5)
    right, bottom = building.metres(rows - 0.5, cols - 0.5)
    return (left, bottom, SENTINEL[2]), (right, top, float(building.floors - 1))


def _people(parts: Parts) -> int:
    return parts.humans.stop // 3


def _numbered(name: str, count: int) -> list[str]:
    return [f"{name} {k}" for k in range(1, count + 1)]


def _slots_of_points(
    part: slice, names: list[str], unit: str = "m, m, storey"
) -> tuple[Slot, ...]:
    return _slots(part, [f"{name}: x, y, storey" for name in names], 3, unit)


def _slots(part: slice, names: list[str], size: int, unit: str) -> tuple[Slot, ...]:
    """One slot of so many numbers for each name; together they are the part."""
    starts = range(part.start, part.stop, size)
    return tuple(
        Slot(at, at + size, name, unit) for at, name in zip(starts, names, strict=True)
    )


# -- The fire agent's vector --------------------------------------------------------


def fire_vector_size(building: Building, scenario: Scenario) -> int:
    """3 (n + R); 138 for the paper [D1]."""
    return _parts(building.floors, scenario).robots.stop


def fire_vector(world: World, scenario: Scenario) -> np.ndarray:
    """(3 (n + R),) float32: points of all humans, then of all robots [D1].

    In order of their numbers. Table II does not normalise, so they are [D1, chosen] in
    normalised metres, and storeys in shares of the highest: about 1 for everything. The
    scenario is the simulation's own.
    """
    everybody = np.concatenate(points(world))
    return to_normalised(world.building, everybody).astype(np.float32).ravel()


def fire_layout(building: Building, scenario: Scenario) -> tuple[Slot, ...]:
    """What each number of the fire's vector is; together they are the whole vector."""
    parts = _parts(building.floors, scenario)
    robots = scenario.robots_per_floor * building.floors
    unit = "normalised, normalised, share of the highest storey"
    return (
        *_slots_of_points(parts.humans, _numbered("human", _people(parts)), unit),
        *_slots_of_points(parts.robots, _numbered("robot", robots), unit),
    )


def fire_limits(
    building: Building, scenario: Scenario
) -> tuple[np.ndarray, np.ndarray]:
    """(3 (n + R),) float32 each: what no number of it is below or above."""
    count = fire_vector_size(building, scenario) // 3
    low, high = to_normalised(building, np.array(_corners(building)))
    return (
        np.tile(low.astype(np.float32), count),
        np.tile(high.astype(np.float32), count),
    )


def decode_fire(vectors: np.ndarray, building: Building, scenario: Scenario) -> Scene:
    """What the fire's vectors say; vectors: (..., 3 (n + R))."""
    everybody = from_normalised(building, _rows_of_3(vectors))
    everybody[..., 2] = everybody[..., 2].round()
    everybody[everybody[..., 2] < 0] = SENTINEL
    people = _people(_parts(building.floors, scenario))
    return Scene(
        humans=everybody[..., :people, :],
        robots=everybody[..., people:, :],
        fires=everybody[..., :0, :],
        time=np.full(vectors.shape[:-1], np.nan, dtype=np.float32),
    )


def to_normalised(building: Building, metres: np.ndarray) -> np.ndarray:
    """Metres, (..., 2), or (..., 3) with the storey, in normalised metres.

    A storey becomes a share of the highest one, SENTINEL's a negative share.
    """
    middle, half = _half_body(building)
    axes = metres.shape[-1]
    return (metres - middle[:axes]) / half[:axes]


def from_normalised(building: Building, spots: np.ndarray) -> np.ndarray:
    """The inverse of `to_normalised`."""
    middle, half = _half_body(building)
    axes = spots.shape[-1]
    return spots * half[:axes] + middle[:axes]


@lru_cache(maxsize=64)
def _half_body(building: Building) -> tuple[np.ndarray, np.ndarray]:
    """(3,) the middle of the main body on the first floor, and (3,) half its size."""
    left, bottom, right, top = building.body
    middle = np.array([(left + right) / 2, (bottom + top) / 2, 0.0])
    highest = max(1.0, building.floors - 1.0)
    return middle, np.array([(right - left) / 2, (top - bottom) / 2, highest])


# -- All there is -------------------------------------------------------------------


def state(world: World, scenario: Scenario) -> np.ndarray:
    """(S,) float32, all that is going on, for critics that may see everything.

    Seconds; of each human a point and health; of each robot a point and its
    destination, metres; of each fire source a point; last the grid's channels of fires.
    """
    humans, robots = points(world)
    floors = world.building.floors
    aims = [
        r.position if r.destination is None else r.destination for r in world.robots
    ]
    parts = (
        [world.time],
        np.column_stack([humans, world.bodies.health]),
        np.column_stack([robots, np.array(aims).reshape(-1, 2)]),
        sources(world, scenario.sources),
        grid(world)[floors : 2 * floors],
    )
    return np.concatenate([np.ravel(part) for part in parts]).astype(np.float32)


def state_limits(
    building: Building, scenario: Scenario
) -> tuple[np.ndarray, np.ndarray]:
    """(S,) float32 each: what no number of the state is below or above."""
    parts = _parts(building.floors, scenario)
    people, robots = _people(parts), scenario.robots_per_floor * building.floors
    cells = int(np.prod(grid_shape(building))) // len(GRID_KINDS)
    ends = (0.0, 0.0, 0), (scenario.time_limit + scenario.tick, HEALTH, 1)
    low, high = (
        np.concatenate(
            [
                [seconds],
                np.tile((*point, health), people),
                np.tile((*point, *point[:2]), robots),
                np.tile(point, scenario.sources),
                np.full(cells, burning),
            ]
        ).astype(np.float32)
        for point, (seconds, health, burning) in zip(
            _corners(building), ends, strict=True
        )
    )
    return low, high


# -- The grid -----------------------------------------------------------------------


def grid_shape(building: Building) -> tuple[int, int, int]:
    """Channels, height and width; 9 x 40 x 40 for the paper [C3]."""
    left, bottom, right, top = building.body
    height, width = max(top - bottom, SMALLEST_GRID), max(right - left, SMALLEST_GRID)
    return len(GRID_KINDS) * building.floors, int(height), int(width)


def grid(world: World) -> np.ndarray:
    """(channels, height, width) uint8, 0 or 1; every agent sees the same [C3] [D1].

    Channels: walls of all floors, then burning cells, then exits. [C3, chosen] Where a
    floor has no exit, the stairwell entrances take its channel,
    being the way out there.
    Row 0 is the north edge of the main body, stairwells lie outside; a smaller body
    fills the north-west corner and the rest is 0.
    """
    floors = world.building.floors
    cells = still(world.building).copy()
    rows, cols = _window(world.building)
    burning = world.flames.burning[:, rows, cols]
    height, width = burning.shape[1:]
    cells[floors : 2 * floors, :height, :width] = burning
    return cells


def burning(cells: np.ndarray, building: Building) -> np.ndarray:
    """(floors, rows, cols) bool, which cells of the building a grid shows in flames."""
    floors, (rows, cols) = building.floors, _window(building)
    everywhere = np.zeros(building.kind.shape, dtype=bool)
    height, width = everywhere[0, rows, cols].shape
    everywhere[:, rows, cols] = cells[floors : 2 * floors, :height, :width]
    return everywhere


@lru_cache(maxsize=64)
def still(building: Building) -> np.ndarray:
    """The grid while nothing burns; computed once, cannot be written to."""
    kind, floors = building.kind, building.floors
    rows, cols = _window(building)
    cells = np.zeros(grid_shape(building), dtype=np.uint8)
    height, width = kind[0, rows, cols].shape
    cells[:floors, :height, :width] = (kind == Kind.WALL)[:, rows, cols]
    cells[2 * floors :, :height, :width] = _ways_out(building)[:, rows, cols]
    cells.flags.writeable = False
    return cells


def _window(building: Building) -> tuple[slice, slice]:
    """Rows and columns of the main body."""
    left, bottom, right, top = (int(edge) for edge in building.body)
    row, col = building.origin
    return slice(row - top, row - bottom), slice(col + left, col + right)


def _ways_out(building: Building) -> np.ndarray:
    """(floors, rows, cols) bool: exits, or else entrances of stairs."""
    exits = building.kind == Kind.EXIT
    entrances = building.kind == Kind.ENTRANCE
    none = ~exits.any(axis=(1, 2), keepdims=True)
    return exits | (none & entrances)
