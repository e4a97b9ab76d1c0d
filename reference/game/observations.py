"""Observations: 167 numbers and a 40 x 40 grid for the robots of the paper's building.

Clauses: C1-C4, C8, D1.  What a vector holds is described once, in a `Layout`: its size,
the meaning and the bounds of its numbers, how it is written and how it is read.

    n   people;  R  robots;  F  fire sources;  V  numbers of a vector
    point       x, y in metres and the storey, 0 is the first floor
    normalised  coordinates in which the main body of the building is [-1, 1] x [-1, 1]
"""

from collections.abc import Iterable, Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from reference.building import Building, Kind
from reference.paper import Scenario
from reference.world import World

SENTINEL = (0.0, 0.0, -1.0)
"""[C1, chosen] the point of people out or dead, robots whose work is done and fires not
yet lit: the middle, one storey below the ground, where nothing else can be."""

GRID_KINDS = ("walls", "fires", "exits")
"""[C3, chosen] kinds of channels, in this order; each has one channel per floor."""

SMALLEST_GRID = 20
"""[C3, chosen] cells: the `simple` encoder's two convolutions need so many."""


# -- What a vector holds ------------------------------------------------------------


class Part(NamedTuple):
    """Rows of a vector that say the same kind of thing.

    rows       what each row says;  unit  of its numbers
    low, high  bounds of a row's numbers
    """

    rows: Sequence[str]
    unit: str
    low: tuple[float, ...]
    high: tuple[float, ...]


class Slot(NamedTuple):
    """Numbers start .. stop - 1 of a vector: what they say, and in which units."""

    start: int
    stop: int
    what: str
    unit: str


class Layout:
    """What each number of a vector says, part by part.

    size       V;  slots  one for each row of each part
    low, high  (V,) float32, the bounds of all numbers
    """

    def __init__(self, **parts: Part):
        self._where: dict[str, tuple[slice, int, int]] = {}
        slots: list[Slot] = []
        low: list[float] = []
        high: list[float] = []
        for name, part in parts.items():
            start, width = len(low), len(part.low)
            for what in part.rows:
                slots.append(Slot(len(low), len(low) + width, what, part.unit))
                low += part.low
                high += part.high
            self._where[name] = slice(start, len(low)), len(part.rows), width
        self.size, self.slots = len(low), tuple(slots)
        self.low, self.high = np.array((low, high), dtype=np.float32)

    def write(self, count: int, **parts: ArrayLike) -> np.ndarray:
        """(count, V) float32 vectors; parts: (..., rows, width), broadcast."""
        vectors = np.empty((count, self.size), dtype=np.float32)
        for name, rows in parts.items():
            self.read(vectors, name)[:] = rows
        return vectors

    def scaled(self, vectors: np.ndarray) -> np.ndarray:
        """Scale each number of vectors (..., V) from its bounds to [-1, 1]."""
        span = np.maximum(self.high - self.low, 1e-9)
        return 2 * (vectors - self.low) / span - 1

    def read(self, vectors: np.ndarray, part: str) -> np.ndarray:
        """A part of vectors (..., V) as a view, (..., rows, width)."""
        where, rows, width = self._where[part]
        return vectors[..., where].reshape(*vectors.shape[:-1], rows, width)


@lru_cache(maxsize=64)
def vector_layout(building: Building, scenario: Scenario) -> Layout:
    """Lay out an agent's vector; 167 numbers for the paper [C1] [C2] [D1].

    In the order of C1, and as C4 says for the observer; for the paper:

          0-119  humans: own floor first, then above, then below; nearest first
        120-137  robots: the observer, its team, those elsewhere; by number
        138      robots of the observer's team that are still at work
        139      time
        140-163  fire sources, in the order of lighting
        164-166  fire sources on each floor, the first floor first

    A human who is out or dead, a robot whose work is done and a fire not yet lit is
    SENTINEL; people who are gone come last. The fire observes the same from nobody's
    point of view [D1, chosen]: people and robots by number, the team is all robots.
    """
    floors, team, most = building.floors, scenario.robots_per_floor, scenario.sources
    point = ("m, m, storey", *_corners(building))
    robots = _points("robot ", range(1, team * floors + 1))
    on_floors = [f"fire sources on floor {k}" for k in range(1, floors + 1)]
    end = scenario.time_limit + scenario.tick
    return Layout(
        humans=Part(_humans(building, scenario), *point),
        robots=Part(robots, *point),
        team=Part(["robots of the team at work"], "1", (0.0,), (team * floors,)),
        time=Part(["time since the beginning"], "s", (0.0,), (end,)),
        fires=Part(_points("fire source ", range(1, most + 1)), *point),
        fires_per_floor=Part(on_floors, "1", (0.0,), (most,)),
    )


def _humans(building: Building, scenario: Scenario) -> list[str]:
    people = sum(scenario.start_counts(building.floors))
    return _points("human ", range(1, people + 1))


def _points(name: str, numbers: Iterable[int]) -> list[str]:
    return [f"{name}{number}: x, y, storey" for number in numbers]


def _corners(building: Building) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """The lowest and the highest point of the drawing, SENTINEL among them."""
    rows, cols = building.kind.shape[1:]
    left, top = building.metres(-0.5, -0.5)
    right, bottom = building.metres(rows - 0.5, cols - 0.5)
    return (left, bottom, SENTINEL[2]), (right, top, float(building.floors - 1))


# -- From the world to vectors ------------------------------------------------------


def robot_vectors(world: World, scenario: Scenario) -> np.ndarray:
    """(R, V) float32: row k is what robot k observes, see `vector_layout` [C1] [C4].

    scenario: as asked for.
    """
    humans, robots = points(world)
    floor = tuple(robot.floor for robot in world.robots)
    work = robots_at_work(world)
    team = [work[np.equal(floor, own)].sum() for own in floor]
    humans = humans[_nearest_first(world, humans)]
    robots = robots[_observer_first(floor)]
    return _written(world, scenario, humans, robots, np.reshape(team, (-1, 1, 1)))


def fire_vector(world: World, scenario: Scenario) -> np.ndarray:
    """(V,) float32: what the fire observes, see `vector_layout` [D1].

    scenario: as asked for; its robots are SENTINEL where `NoRobots` plays.
    """
    humans, robots = points(world)
    if not len(robots):
        robots = np.array(SENTINEL)
    team = robots_at_work(world).sum()
    return _written(world, scenario, humans[None], robots[None], team)[0]


def _written(
    world: World,
    scenario: Scenario,
    humans: np.ndarray,
    robots: np.ndarray,
    team: ArrayLike,
) -> np.ndarray:
    """Write vectors (k, V) from points (k, n, 3) and (k, R, 3) and robots at work."""
    fires = np.tile(SENTINEL, (scenario.sources, 1))
    for k, source in enumerate(world.flames.sources[: scenario.sources]):
        fires[k] = source.x, source.y, source.floor
    counts = [[(fires[:, 2] == f).sum()] for f in range(world.building.floors)]
    return vector_layout(world.building, scenario).write(
        len(humans),
        humans=humans,
        robots=robots,
        team=team,
        time=world.time,
        fires=fires,
        fires_per_floor=counts,
    )


def points(world: World) -> tuple[np.ndarray, np.ndarray]:
    """(n, 3) and (R, 3) points of all people and robots, in order of their numbers.

    People on the stairs are in a cell of the stairwell, on the floor they come from.
    """
    bodies = world.bodies
    humans = np.column_stack([bodies.position, bodies.floor])
    humans[~bodies.inside] = SENTINEL
    team = _robot_points(world)
    team[~robots_at_work(world)] = SENTINEL
    return humans, team


def _robot_points(world: World) -> np.ndarray:
    """(R, 3) points of the robots, those whose work is done too."""
    where = [(*robot.position, robot.floor) for robot in world.robots]
    return np.array(where, dtype=np.float64).reshape(-1, 3)


def robots_at_work(world: World) -> np.ndarray:
    """(R,) bool: is anybody inside on the robot's floor or above it? [C8]"""
    here = [world.anybody_at_or_above(robot.floor) for robot in world.robots]
    return np.array(here, dtype=bool)


def _nearest_first(world: World, humans: np.ndarray) -> np.ndarray:
    """Sort people for each robot, (R, n) indices [C4, chosen].

    First its own floor, then those above, whose people will come through, then those
    below; nearer floors first, SENTINEL last. Within a floor by distance in metres.
    """
    robots = _robot_points(world)
    off = humans - robots[:, None]
    up = off[..., 2]
    rank = np.where(up >= 0, up, world.building.floors - up)
    return np.lexsort((np.hypot(off[..., 0], off[..., 1]), rank), axis=1)


def headed(world: World) -> np.ndarray:
    """(R, 2) float32 normalised: where robots under way go to, nan for the others.

    The actual target of their last decision (Eq. 1), clipped to the main body: deciding
    it again changes nothing.
    """
    spots = [r.destination if r.way else (np.nan, np.nan) for r in world.robots]
    metres = np.array(spots, dtype=np.float64).reshape(-1, 2)
    return to_normalised(world.building, metres).clip(-1, 1).astype(np.float32)


@lru_cache(maxsize=64)
def _observer_first(floor: tuple[int, ...]) -> np.ndarray:
    """Sort robots for each of them, (R, R) indices: itself, its team, others."""
    number = np.arange(len(floor))
    other_floor = np.not_equal.outer(floor, floor)
    not_me = number[:, None] != number
    return np.lexsort((np.broadcast_to(number, not_me.shape), not_me, other_floor))


# -- Normalised coordinates --------------------------------------------------------


def to_normalised(building: Building, metres: np.ndarray) -> np.ndarray:
    """Normalise metres (..., 2) or (..., 3), a storey as its share of the highest."""
    middle, half = _middle_and_half(building)
    axes = metres.shape[-1]
    return (metres - middle[:axes]) / half[:axes]


def from_normalised(building: Building, normalised: np.ndarray) -> np.ndarray:
    """Invert `to_normalised`."""
    middle, half = _middle_and_half(building)
    axes = normalised.shape[-1]
    return normalised * half[:axes] + middle[:axes]


@lru_cache(maxsize=64)
def _middle_and_half(building: Building) -> tuple[np.ndarray, np.ndarray]:
    """(3,) the middle of the main body on the first floor, and (3,) half its size."""
    left, bottom, right, top = building.body
    middle = np.array([(left + right) / 2, (bottom + top) / 2, 0.0])
    highest = max(1.0, building.floors - 1.0)
    return middle, np.array([(right - left) / 2, (top - bottom) / 2, highest])


# -- The grid -----------------------------------------------------------------------


def grid_shape(building: Building) -> tuple[int, int, int]:
    """Channels, height and width; 9 x 40 x 40 for the paper [C3]."""
    left, bottom, right, top = building.body
    height, width = max(top - bottom, SMALLEST_GRID), max(right - left, SMALLEST_GRID)
    return len(GRID_KINDS) * building.floors, int(height), int(width)


def grid(world: World) -> np.ndarray:
    """(channels, height, width) uint8, 0 or 1; every agent sees the same [C3] [D1].

    Channels: walls of all floors, then burning cells, then exits. [C3, chosen] Where a
    floor has no exit, the stairwell entrances take its channel, being the way out.
    Row 0 is the north edge of the main body, stairwells lie outside; a smaller body
    fills the north-west corner and the rest is 0.
    """
    cells = _without_fire(world.building).copy()
    burning = main_body(world.flames.burning, world.building)
    channels(cells, world.building, "fires")[:] = burning
    return cells


@lru_cache(maxsize=64)
def _without_fire(building: Building) -> np.ndarray:
    """The grid while nothing burns; computed once, cannot be written to."""
    kind = main_body(building.kind, building)
    exits = (building.kind == Kind.EXIT).any(axis=(1, 2))[:, None, None]
    cells = np.zeros(grid_shape(building), dtype=np.uint8)
    channels(cells, building, "walls")[:] = kind == Kind.WALL
    channels(cells, building, "exits")[:] = np.where(
        exits, kind == Kind.EXIT, kind == Kind.ENTRANCE
    )
    cells.flags.writeable = False
    return cells


def main_body(cells: np.ndarray, building: Building) -> np.ndarray:
    """View the main body in an array of all cells, (floors, rows, cols)."""
    left, bottom, right, top = (int(edge) for edge in building.body)
    row, col = building.origin
    return cells[:, row - top : row - bottom, col + left : col + right]


def channels(cells: np.ndarray, building: Building, kind: str) -> np.ndarray:
    """View the main body in a grid's channels of one kind."""
    start = GRID_KINDS.index(kind) * building.floors
    height, width = main_body(building.kind, building).shape[1:]
    return cells[start : start + building.floors, :height, :width]
