"""Observations: 167 numbers and a 40 x 40 grid for the robots of the paper's building.

What a vector holds is described once, by `vector_layout`: the meaning and the bounds of
its numbers, and where each part of it stands.

    S   worlds;  n  people;  R  robots;  F  fire sources;  V  numbers of a vector
    point       x, y in metres and the storey, 0 is the first floor
    normalised  coordinates in which the main body of the building is [-1, 1] x [-1, 1]
"""

from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from reference import paper
from reference.building import Building, Kind, lengths
from reference.paper import Scenario
from reference.world import World

GRID_KINDS = ("walls", "fires", "exits")
"""[C3, chosen] kinds of channels, in this order; each has one channel per floor."""


# -- What a vector holds ------------------------------------------------------------


class Block(NamedTuple):
    """Rows of a vector that say the same kind of thing: numbers start .. stop - 1."""

    what: str  # each row says
    unit: str  # of its numbers
    rows: int  # how many
    low: tuple[float, ...]  # bounds of a row's numbers
    high: tuple[float, ...]
    start: int = 0

    @property
    def stop(self) -> int:
        """The number after its last one."""
        return self.start + self.rows * len(self.low)


class Layout:
    """Where each block of a vector stands.

    size       V;  blocks  by name
    low, high  (V,) float32, the bounds of all numbers
    """

    def __init__(self, **blocks: Block):
        self.blocks: dict[str, Block] = {}
        self.size = 0
        for name, block in blocks.items():
            self.blocks[name] = block._replace(start=self.size)
            self.size = self.blocks[name].stop
        lows = [np.tile(block.low, block.rows) for block in blocks.values()]
        highs = [np.tile(block.high, block.rows) for block in blocks.values()]
        self.low = np.concatenate(lows, dtype=np.float32)
        self.high = np.concatenate(highs, dtype=np.float32)

    def block_of(self, vectors: np.ndarray, name: str) -> np.ndarray:
        """View a block of vectors (..., V), to read or to fill: (..., rows, width)."""
        block = self.blocks[name]
        shape = *vectors.shape[:-1], block.rows, len(block.low)
        return vectors[..., block.start : block.stop].reshape(shape)

    def scaled(self, vectors: np.ndarray) -> np.ndarray:
        """Scale each number of vectors (..., V) from its bounds to [-1, 1]."""
        span = np.maximum(self.high - self.low, 1e-9)
        return 2 * (vectors - self.low) / span - 1


def vector_layout(building: Building, scenario: Scenario) -> Layout:
    """Lay out an agent's vector; 167 numbers for the paper [C1] [C2] [D1].

    In the order of C1, rows ordered for the observer; for the paper:

          0-119  humans: own floor first, then above, then below; nearest first
        120-137  robots: the observer, its team, those elsewhere; by number
        138      robots of the observer's team that are still at work
        139      time
        140-163  fire sources, in the order of lighting
        164-166  fire sources on each floor, the first floor first

    A human who is out or dead, a robot whose work is done and a fire not yet lit is
    `ABSENT_POINT`; people who are gone come last. The fire observes the same from
    nobody's point of view [D1, chosen]: people and robots by number, the team is all
    robots.
    """
    rows, cols = building.kind.shape[1:]
    left, top = building.metres(-0.5, -0.5)
    right, bottom = building.metres(rows - 0.5, cols - 0.5)
    floors = building.floors
    lowest = (left, bottom, paper.ABSENT_POINT[2])
    highest = (right, top, float(floors - 1))
    people = sum(scenario.start_counts(floors))
    robots = scenario.robots_per_floor * floors
    fires = scenario.sources
    end = scenario.time_limit + scenario.tick

    def points(what: str, count: int) -> Block:
        return Block(f"{what}: x, y, storey", "m, m, storey", count, lowest, highest)

    return Layout(
        humans=points("human", people),
        robots=points("robot", robots),
        team=Block("robots of the team at work", "count", 1, (0.0,), (robots,)),
        time=Block("time since the beginning", "s", 1, (0.0,), (end,)),
        fires=points("fire source", fires),
        fires_per_floor=Block(
            "fire sources on floor", "count", floors, (0.0,), (fires,)
        ),
    )


# -- From worlds to vectors ---------------------------------------------------------


def robot_vectors(worlds: Sequence[World], layout: Layout) -> np.ndarray:
    """(S, R, V) float32: row k is what robot k observes, see `vector_layout` [C1] [C4].

    worlds: S of one building and scenario
    """
    humans, robots, work = _points(worlds)
    floor = robots[0, :, 2]
    order = me_first(floor)
    nearest = _nearest_first(robots, humans, worlds[0].building.floors)
    team = (np.equal.outer(floor, floor) & work[:, None]).sum(axis=2)
    robots[~work] = paper.ABSENT_POINT
    each = np.arange(len(worlds))[:, None, None]
    return _write(worlds, layout, humans[each, nearest], robots[:, order], team)


def me_first(floor: np.ndarray) -> np.ndarray:
    """(R, R) robots in each one's own order: itself, its mates, those elsewhere [C1].

    floor: (R,) of each; mates are on one floor
    """
    # itself -1, mates 0, others 1
    rank = np.not_equal.outer(floor, floor) - np.eye(len(floor))
    return rank.argsort(axis=1, kind="stable")


def fire_vectors(worlds: Sequence[World], layout: Layout) -> np.ndarray:
    """(S, 1, V) float32: what the fire observes, see `vector_layout` [D1].

    Where `NoRobots` plays, all robots of the scenario are `ABSENT_POINT`.
    """
    humans, robots, work = _points(worlds)
    robots[~work] = paper.ABSENT_POINT
    if not work.size:
        robots = np.array([[paper.ABSENT_POINT]])  # written to every row
    team = work.sum(axis=1, keepdims=True)
    return _write(worlds, layout, humans[:, None], robots[:, None], team)


def _write(
    worlds: Sequence[World],
    layout: Layout,
    humans: np.ndarray,
    robots: np.ndarray,
    team: np.ndarray,
) -> np.ndarray:
    """Write vectors (S, k, V) from points (S, k, n, 3) and (S, k, R, 3).

    team: (S, k) robots at work
    """
    most = layout.blocks["fires"].rows
    fires = np.tile(paper.ABSENT_POINT, (len(worlds), 1, most, 1))
    for k, world in enumerate(worlds):
        for j, source in enumerate(world.flames.sources[:most]):
            fires[k, 0, j] = source.x, source.y, source.floor
    floors = np.arange(worlds[0].building.floors)
    blocks = {
        "humans": humans,
        "robots": robots,
        "team": team[..., None, None],
        "time": np.reshape([world.time for world in worlds], (-1, 1, 1, 1)),
        "fires": fires,
        "fires_per_floor": (fires[..., 2:] == floors).sum(axis=2)[..., None],
    }
    vectors = np.empty((*humans.shape[:2], layout.size), dtype=np.float32)
    for name, rows in blocks.items():
        layout.block_of(vectors, name)[:] = rows
    return vectors


def _points(worlds: Sequence[World]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points of people, (S, n, 3), and robots, (S, R, 3); who is at work, (S, R) bool.

    In order of their numbers. People on the stairs are in a cell of the stairwell, on
    the floor they come from; robots whose work is done are where they stand.
    """
    bodies = [world.bodies for world in worlds]
    humans = np.stack([np.column_stack([b.position, b.floor]) for b in bodies])
    humans[~np.stack([b.inside for b in bodies])] = paper.ABSENT_POINT
    robots = [
        (*robot.position.tolist(), robot.floor)
        for world in worlds
        for robot in world.robots
    ]
    work = [robots_at_work(world) for world in worlds]
    return humans, np.reshape(robots, (len(worlds), -1, 3)), np.stack(work)


def robots_at_work(world: World) -> np.ndarray:
    """(R,) bool: is anybody inside on the robot's floor or above it? [C8]

    Asked now; `Robot.active` is as of the robot's last move.
    """
    work = [world.anybody_at_or_above(robot.floor) for robot in world.robots]
    return np.array(work, dtype=bool)


def _nearest_first(robots: np.ndarray, humans: np.ndarray, floors: int) -> np.ndarray:
    """Sort people for each robot, (S, R, n) indices.

    [C4, deviation] The paper's agents of a floor observe the same. Ours do too, but
    each sorts people by its own position: identical inputs could not tell two mates
    apart. Its own floor comes first, then the floors above, whose people will come
    through, then those below; nearer floors first. Within a floor the nearest come
    first. `ABSENT_POINT` is last.
    """
    off = humans[:, None] - robots[:, :, None]
    metres = lengths(off)
    up = off[..., 2]
    rank = np.where(up >= 0, up, floors - up)
    return np.lexsort((metres, rank), axis=-1)


# -- Normalised coordinates --------------------------------------------------------


def from_normalised(building: Building, normalised: np.ndarray) -> np.ndarray:
    """Convert (..., 2) to metres: the main body is [-1, 1] x [-1, 1]."""
    low, high = np.reshape(building.body, (2, 2))
    return normalised * ((high - low) / 2) + (low + high) / 2


# -- The grid -----------------------------------------------------------------------


def grid_shape(building: Building) -> tuple[int, int, int]:
    """Channels, height and width; 9 x 40 x 40 for the paper [C3]."""
    left, bottom, right, top = building.body
    height = int(max(top - bottom, paper.SMALLEST_GRID))
    width = int(max(right - left, paper.SMALLEST_GRID))
    return len(GRID_KINDS) * building.floors, height, width


def grid(world: World) -> np.ndarray:
    """(channels, height, width) uint8, 0 or 1; every agent sees the same [C3] [D1].

    Channels: walls of all floors, then burning cells, then exits. [C3, chosen] If a
    floor has no exit, its channel shows the stairwell entrances, the way out there.
    Row 0 is the north edge of the main body, stairwells lie outside; a smaller body
    fills the north-west corner and the rest is 0.
    """
    building = world.building
    burning = _main_body(world.flames.burning, building)
    floors, rows, cols = burning.shape
    cells = _unchanging(building, grid_shape(building)).copy()
    cells[floors : 2 * floors, :rows, :cols] = burning
    return cells


@lru_cache(maxsize=8)
def _unchanging(building: Building, shape: tuple[int, int, int]) -> np.ndarray:
    """Draw the grid's walls and ways out."""
    kind = _main_body(building.kind, building)
    has_exit = (building.kind == Kind.EXIT).any(axis=(1, 2), keepdims=True)
    ways_out = np.where(has_exit, kind == Kind.EXIT, kind == Kind.ENTRANCE)

    floors, rows, cols = kind.shape
    cells = np.zeros(shape, dtype=np.uint8)
    cells[:floors, :rows, :cols] = kind == Kind.WALL
    cells[-floors:, :rows, :cols] = ways_out
    return cells


def _main_body(cells: np.ndarray, building: Building) -> np.ndarray:
    """View the main body in an array of all cells, (floors, rows, cols)."""
    left, bottom, right, top = (int(edge) for edge in building.body)
    row, col = building.origin
    return cells[:, row - top : row - bottom, col + left : col + right]
