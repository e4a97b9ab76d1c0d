"""Divide the floors of a new building into rooms, by lot.

A floor is cut by corridors, then by walls, the roomiest part first; then some rooms are
joined until there are as many as wanted: those bend [A2].

box     a rectangle of cells with its walls; boxes side by side share a wall
block   a box that is the same on all floors, and that no wall cuts
rooms   (rows, columns) number of each cell's room from 1, or one of the signs below
axis    0: a wall from west to east cuts a box in two; 1: from north to south
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.random import Generator as Rng
from scipy import ndimage

WALL = 0
OUTSIDE = -1
YARD = -2  # outside as well, but no way out
STAIRS = (-3, -4)  # stairwells A and B

LEAST_ROOM = 3  # [A1, chosen] metres from wall to wall
CORRIDORS = (2, 3)  # [A1, chosen] metres from wall to wall


@dataclass(frozen=True)
class Box:
    """Rows and columns of its first and of its last corner."""

    low: tuple[int, int]
    high: tuple[int, int]

    def metres(self, axis: int) -> int:
        """Metres between its walls, from north to south or from west to east."""
        return self.high[axis] - self.low[axis] - 1

    @property
    def area(self) -> int:
        """Square metres between its walls."""
        return self.metres(0) * self.metres(1)

    @property
    def inside(self) -> tuple[slice, slice]:
        """Index of the cells between its walls."""
        rows, columns = zip(self.low, self.high, strict=True)
        return slice(rows[0] + 1, rows[1]), slice(columns[0] + 1, columns[1])

    @property
    def all(self) -> tuple[slice, slice]:
        """Index of its cells and those of its walls."""
        rows, columns = zip(self.low, self.high, strict=True)
        return slice(rows[0], rows[1] + 1), slice(columns[0], columns[1] + 1)

    def between(self, axis: int, first: int, last: int) -> "Box":
        """Take the part between two of its rows, or columns."""
        low, high = list(self.low), list(self.high)
        low[axis] = first
        high[axis] = last
        return Box((low[0], low[1]), (high[0], high[1]))

    def meets(self, other: "Box") -> bool:
        """Have the two cells in common, walls not counted?"""
        return all(
            self.low[axis] < other.high[axis] and other.low[axis] < self.high[axis]
            for axis in (0, 1)
        )


@dataclass(frozen=True, eq=False)
class Border:
    """A straight piece of wall; sides: what lies on both, the smaller number first."""

    sides: tuple[int, int]
    cells: np.ndarray  # (k, 2) rows and columns, side by side


def borders(rooms: np.ndarray) -> list[Border]:
    """Find the straight pieces of wall between any two rooms, or stairs, or outside."""
    found = list(_borders_between_rows(rooms))
    for border in _borders_between_rows(rooms.T):
        found.append(Border(border.sides, border.cells[:, ::-1]))
    return found


def _borders_between_rows(rooms: np.ndarray) -> Iterator[Border]:
    """Find those whose sides are north and south."""
    north = rooms[:-2]
    south = rooms[2:]
    parts = (rooms[1:-1] == WALL) & (north != WALL) & (south != WALL) & (north != south)
    cells = np.argwhere(parts)
    if not len(cells):
        return
    sides = np.sort(np.column_stack([north[parts], south[parts]]), axis=1)
    steps = np.diff(cells, axis=0)
    ends = (steps != (0, 1)).any(axis=1) | np.diff(sides, axis=0).any(axis=1)
    starts = [0, *(np.flatnonzero(ends) + 1).tolist(), len(cells)]
    for start, stop in zip(starts[:-1], starts[1:], strict=True):
        low, high = sides[start].tolist()
        yield Border((low, high), cells[start:stop] + (1, 0))


@dataclass
class Floor:
    """One floor: its rooms, and which of them are corridors."""

    rooms: np.ndarray
    corridors: set[int] = field(default_factory=set)

    @property
    def numbers(self) -> list[int]:
        """Of its rooms, corridors among them."""
        found = np.unique(self.rooms)
        return found[found > 0].tolist()

    def join(self, one: int, other: int) -> None:
        """Make one room of two: take the walls between them away."""
        for border in borders(self.rooms):
            if border.sides == (min(one, other), max(one, other)):
                self.rooms[*border.cells.T] = one
        self.rooms[self.rooms == other] = one
        self.rooms[_pillars(self.rooms, one)] = one
        if other in self.corridors:
            self.corridors.discard(other)
            self.corridors.add(one)


def _pillars(rooms: np.ndarray, room: int) -> np.ndarray:
    """Find single cells of wall in the midst of a room, (rows, columns) bool."""
    mine = rooms == room
    around = mine[:-2, 1:-1] & mine[2:, 1:-1] & mine[1:-1, :-2] & mine[1:-1, 2:]
    return np.pad(around, 1) & (rooms == WALL)


def divide(
    rng: Rng,
    shape: tuple[int, int],
    body: Box,
    blocks: dict[int, Box],
    wanted: int,
    corridors: int,
) -> Floor:
    """Divide a floor of the main body into about so many rooms, corridors counted.

    shape: rows and columns of the drawing;  blocks: by the sign of what is in them
    """
    obstacles = list(blocks.values())
    boxes, passages = _cut_corridors(rng, body, obstacles, corridors)
    bends = 1 + wanted // 4
    _cut_rooms(rng, boxes, obstacles, wanted + bends - len(passages))

    is_floor = np.zeros(shape, bool)
    for box in boxes + passages:
        is_floor[box.inside] = True
    for block in obstacles:
        is_floor[block.all] = False
    rooms: np.ndarray = ndimage.label(is_floor)[0].astype(int)
    lanes = {int(rooms[box.inside].max()) for box in passages}
    floor = Floor(rooms, lanes - {WALL})

    _join_corridors(rng, floor)
    _join_rooms(rng, floor, wanted)
    return floor


# -- Corridors and walls ------------------------------------------------------------


def _cut_corridors(
    rng: Rng, body: Box, blocks: Sequence[Box], count: int
) -> tuple[list[Box], list[Box]]:
    """Cut corridors through the largest boxes; return the boxes, and the corridors."""
    boxes = [body]
    corridors = list[Box]()
    for _ in range(count):
        wide = int(rng.integers(CORRIDORS[0], CORRIDORS[1] + 1))
        boxes.sort(key=lambda box: box.area)
        box = boxes[-1]
        shorter = int(box.metres(1) < box.metres(0))
        axis = shorter if rng.random() < 0.8 else 1 - shorter
        places = _places(box, axis, blocks, wide)
        if not places:
            continue
        at = _near_the_middle(rng, box, axis, places)
        low, high = box.low[axis], box.high[axis]
        corridors.append(box.between(axis, at, at + wide + 1))
        boxes.pop()
        boxes.append(box.between(axis, low, at))
        boxes.append(box.between(axis, at + wide + 1, high))
    return boxes, corridors


def _cut_rooms(rng: Rng, boxes: list[Box], blocks: Sequence[Box], wanted: int) -> None:
    """Cut boxes in two until there are as many as wanted, or none is large enough."""
    small = list[Box]()
    while boxes and len(boxes) + len(small) < wanted:
        sizes = [box.area * (0.5 + rng.random()) for box in boxes]
        box = boxes.pop(int(np.argmax(sizes)))
        longer = int(box.metres(1) > box.metres(0))
        nearly_square = 3 * min(box.metres(0), box.metres(1)) > 2 * box.metres(longer)
        if nearly_square and rng.random() < 0.5:
            longer = 1 - longer
        for axis in (longer, 1 - longer):
            places = _places(box, axis, blocks, 0)
            if places:
                at = _near_the_middle(rng, box, axis, places)
                boxes.append(box.between(axis, box.low[axis], at))
                boxes.append(box.between(axis, at, box.high[axis]))
                break
        else:
            small.append(box)
    boxes += small


def _places(box: Box, axis: int, blocks: Sequence[Box], wide: int) -> list[int]:
    """Find where a wall may stand, or the first wall of a corridor so wide.

    What lies on either side is wide enough for a room, beside a block too.
    """
    thick = wide + 1 if wide else 0
    first = box.low[axis] + LEAST_ROOM + 1
    last = box.high[axis] - thick - LEAST_ROOM - 1
    spans = [(b.low[axis], b.high[axis]) for b in blocks if b.meets(box)]
    places = []
    for at in range(first, last + 1):
        gaps = [max(at - high, low - (at + thick)) for low, high in spans]
        if all(gap == 0 or gap > LEAST_ROOM for gap in gaps):
            places.append(at)
    return places


def _near_the_middle(rng: Rng, box: Box, axis: int, places: Sequence[int]) -> int:
    """Draw a place in the middle half of a box, if there is one."""
    quarter = box.metres(axis) / 4
    low, high = box.low[axis] + quarter, box.high[axis] - quarter
    central = [at for at in places if low <= at <= high] or places
    return central[int(rng.integers(len(central)))]


# -- Rooms that bend ----------------------------------------------------------------


def _join_corridors(rng: Rng, floor: Floor) -> None:
    """Join corridors that meet, mostly; else a door will be between them."""
    for one, other in sorted(_neighbours(floor)):
        lanes = floor.corridors
        if one in lanes and other in lanes and rng.random() < 0.75:
            floor.join(one, other)


def _join_rooms(rng: Rng, floor: Floor, wanted: int) -> None:
    """Join small neighbours until there are as many rooms as wanted.

    Two that make a room that bends come before two that make a longer one.
    """
    while len(floor.numbers) > wanted:
        sizes = np.bincount(floor.rooms[floor.rooms > 0])
        costs = {}
        for one, other in sorted(_neighbours(floor)):
            together = int(sizes[one] + sizes[other])
            straight = together + _wall_between(floor, one, other) == _hull(
                floor.rooms, one, other
            )
            lanes = len(floor.corridors & {one, other})
            costs[one, other] = (
                together * (1 + rng.random()) * (4 if straight else 1) * 9**lanes
            )
        if not costs:
            return
        floor.join(*min(costs, key=costs.__getitem__))


def _neighbours(floor: Floor) -> set[tuple[int, int]]:
    """Pairs of rooms with a wall between them."""
    return {border.sides for border in borders(floor.rooms) if border.sides[0] > 0}


def _wall_between(floor: Floor, one: int, other: int) -> int:
    """Count the cells of the wall between two rooms."""
    found = [b.cells for b in borders(floor.rooms) if b.sides == (one, other)]
    return sum(map(len, found))


def _hull(rooms: np.ndarray, one: int, other: int) -> int:
    """Square metres of the smallest rectangle around two rooms."""
    cells = np.argwhere((rooms == one) | (rooms == other))
    rows, columns = np.ptp(cells, axis=0) + 1
    return int(rows * columns)
