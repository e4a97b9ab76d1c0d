"""Divide a floor of a new building into rooms, by lot.

Corridors are cut through the largest boxes, then walls, until there are some more rooms
than wanted. Then neighbours are joined, as many as are too many: those rooms bend.

box      a rectangle of cells with its walls; boxes side by side share a wall
block    a box that no wall cuts, and that is in no room: stairs, a yard, a lost corner
rooms    (rows, columns) of each cell the number of its room from 1, or a sign below
axis     0 from north to south, 1 from west to east
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations, pairwise

import numpy as np
from numpy.random import Generator as Rng

WALL = 0
OUTDOORS = -1
YARD = -2  # no way out leads there
STAIR_ROOMS = (-3, -4)  # of stairwells A and B

LEAST_ROOM = 3  # [A1, chosen] metres between the walls of a room
LEAST_WING = 4  # [A1, chosen] metres of what lies on either side of a corridor
CORRIDOR_METRES = (2, 3)  # [A1, chosen] a corridor is as wide as one of these

Cells = tuple[slice, slice]
"""Index of a rectangle of cells."""


@dataclass(frozen=True)
class Box:
    """A rectangle; row and column of its north-west and its south-east corner."""

    low: tuple[int, int]
    high: tuple[int, int]

    @property
    def metres(self) -> tuple[int, int]:
        """Between its walls, along both axes."""
        return self.high[0] - self.low[0] - 1, self.high[1] - self.low[1] - 1

    @property
    def area(self) -> int:
        """Square metres between its walls."""
        rows, columns = self.metres
        return rows * columns

    @property
    def inside(self) -> Cells:
        """The cells between its walls."""
        (top, left), (bottom, right) = self.low, self.high
        return slice(top + 1, bottom), slice(left + 1, right)

    @property
    def whole(self) -> Cells:
        """Its cells and those of its walls."""
        (top, left), (bottom, right) = self.low, self.high
        return slice(top, bottom + 1), slice(left, right + 1)

    def part(self, axis: int, first: int, last: int) -> "Box":
        """Cut out the part between two walls across an axis."""
        low = list(self.low)
        high = list(self.high)
        low[axis] = first
        high[axis] = last
        return Box((low[0], low[1]), (high[0], high[1]))

    def gap(self, other: "Box") -> int:
        """Cells from wall to wall of two boxes; less than 0 where they overlap."""
        gaps = [
            max(self.low[axis] - other.high[axis], other.low[axis] - self.high[axis])
            for axis in (0, 1)
        ]
        return max(gaps)


@dataclass(frozen=True, eq=False)
class FloorLayout:
    """A floor that is divided; corridors: numbers of the rooms that are one."""

    rooms: np.ndarray
    corridors: frozenset[int]

    @property
    def count(self) -> int:
        """How many rooms there are, corridors counted."""
        return int(self.rooms.max())

    @cached_property
    def sizes(self) -> np.ndarray:
        """(count + 1,) square metres of rooms by their numbers; 0 of none."""
        return np.bincount(self.rooms[self.rooms > WALL])


def divide(
    rng: Rng,
    shape: tuple[int, int],
    body: Box,
    blocks: Sequence[Box],
    wanted: int,
    corridors: int,
) -> FloorLayout:
    """Divide the body into so many rooms, or as many as fit, corridors counted.

    shape: rows and columns of the drawing
    """
    boxes, passages = _cut_corridors(rng, body, blocks, corridors)
    more = 1 + wanted // 4
    boxes = _cut_rooms(rng, boxes, blocks, wanted + more - len(passages))

    rooms = _Rooms(shape, passages)
    for box in boxes:
        rooms.add(_without_blocks(box, blocks))
    rooms.find_walls()
    _join_corridors(rng, rooms)
    while rooms.count > wanted and _join_two(rng, rooms):
        pass
    return rooms.layout()


# -- Corridors and walls ------------------------------------------------------------


def _cut_corridors(
    rng: Rng, body: Box, blocks: Sequence[Box], count: int
) -> tuple[list[Box], list[Box]]:
    """Cut corridors through the largest boxes; return the boxes, and the corridors."""
    boxes = [body]
    corridors = list[Box]()
    along = int(body.metres[1] > body.metres[0])  # the first runs the longer way
    for _ in range(count):
        box = max(boxes, key=lambda box: box.area)
        wide = int(rng.choice(CORRIDOR_METRES))
        across = 1 - along
        places = _places(box, across, blocks, LEAST_WING, thick=wide + 1)
        if places:
            at = _near_the_middle(rng, box, across, places)
            boxes.remove(box)
            boxes.append(box.part(across, box.low[across], at))
            boxes.append(box.part(across, at + wide + 1, box.high[across]))
            corridors.append(box.part(across, at, at + wide + 1))
        if rng.random() < 0.7:  # the next one meets it, or lies beside it
            along = 1 - along
    return boxes, corridors


def _cut_rooms(
    rng: Rng, boxes: Sequence[Box], blocks: Sequence[Box], wanted: int
) -> list[Box]:
    """Cut boxes in two, the larger ones first, until there are as many as wanted."""
    large = list(boxes)
    small = list[Box]()  # that cannot be cut
    while large and len(large) + len(small) < wanted:
        ranks = [box.area * (0.5 + rng.random()) for box in large]
        box = large.pop(int(np.argmax(ranks)))
        halves = _halves(rng, box, blocks)
        large += halves
        if not halves:
            small.append(box)
    return large + small


def _halves(rng: Rng, box: Box, blocks: Sequence[Box]) -> list[Box]:
    """Cut a box in two across its longer side, or either if it is nearly square."""
    longer = int(box.metres[1] > box.metres[0])
    is_square = 3 * min(box.metres) > 2 * max(box.metres)
    if is_square and rng.random() < 0.5:
        longer = 1 - longer
    for axis in (longer, 1 - longer):
        places = _places(box, axis, blocks, LEAST_ROOM)
        if places:
            at = _near_the_middle(rng, box, axis, places)
            first = box.part(axis, box.low[axis], at)
            return [first, box.part(axis, at, box.high[axis])]
    return []


def _places(
    box: Box, axis: int, blocks: Sequence[Box], least: int, thick: int = 0
) -> list[int]:
    """Find where a wall may stand across an axis, with another so far behind it.

    On both sides this many metres are left, or at least a room's beside a block.
    """
    spans = [(b.low[axis], b.high[axis]) for b in blocks if b.gap(box) < 0]
    places = []
    for at in range(box.low[axis] + least + 1, box.high[axis] - thick - least):
        gaps = [max(at - high, low - at - thick) for low, high in spans]
        if all(gap == 0 or gap > LEAST_ROOM for gap in gaps):
            places.append(at)
    return places


def _near_the_middle(rng: Rng, box: Box, axis: int, places: Sequence[int]) -> int:
    """Draw a place, in the middle half of the box if there is one."""
    low = box.low[axis]
    high = box.high[axis]
    central = [at for at in places if 3 * low + high <= 4 * at <= low + 3 * high]
    return int(rng.choice(central or places))


def _without_blocks(box: Box, blocks: Sequence[Box]) -> list[Box]:
    """Cut a box into parts beside the blocks in it."""
    for block in blocks:
        if block.gap(box) < 0:
            (top, left), (bottom, right) = block.low, block.high
            (north, _), (south, _) = box.low, box.high
            # where no cell is left between two walls, what is beside the block goes on
            # to the far one: else nothing would join it to what lies behind
            first = top if top > north + 1 else north
            last = bottom if bottom < south - 1 else south
            middle = box.part(0, first, last)
            parts = [
                box.part(0, north, top),
                box.part(0, bottom, south),
                middle.part(1, box.low[1], left),
                middle.part(1, right, box.high[1]),
            ]
            others = [part for part in parts if min(part.metres) > 0]
            return [each for part in others for each in _without_blocks(part, blocks)]
    return [box]


# -- Rooms that bend ----------------------------------------------------------------


class _Rooms:
    """Boxes, and which of them are one room.

    boxes  those of corridors first;  corridors  how many
    room   of each box, the index of the first box of its room
    walls  the cells of wall between two boxes, by their indices
    """

    def __init__(self, shape: tuple[int, int], corridors: Sequence[Box]) -> None:
        self.shape = shape
        self.corridors = len(corridors)
        self.boxes = list(corridors)
        self.room = list(range(self.corridors))
        self.walls: dict[tuple[int, int], Cells] = {}

    @property
    def count(self) -> int:
        """How many rooms there are."""
        return len({*self.room})

    def add(self, parts: Sequence[Box]) -> None:
        """Add the parts of a room, or of several if a block keeps them apart."""
        first = len(self.boxes)
        for part in parts:
            index = len(self.boxes)
            self.boxes.append(part)
            self.room.append(index)
            for other in range(first, index):
                if _wall_between(self.boxes[other], part):
                    self.join(other, index)

    def find_walls(self) -> None:
        """Find the walls between boxes, once all are there."""
        for (one, box), (two, other) in combinations(enumerate(self.boxes), 2):
            cells = _wall_between(box, other)
            if cells:
                self.walls[one, two] = cells

    def join(self, one: int, two: int) -> None:
        """Make one room of those of two boxes."""
        low, high = sorted((self.room[one], self.room[two]))
        self.room = [low if room == high else room for room in self.room]

    def is_corridor(self, room: int) -> bool:
        """Is one of its boxes a corridor?"""
        return room < self.corridors

    def layout(self) -> FloorLayout:
        """Paint the rooms, without walls in them."""
        number = {room: k for k, room in enumerate(sorted({*self.room}), 1)}
        rooms = np.full(self.shape, WALL)
        for box, room in zip(self.boxes, self.room, strict=True):
            rooms[box.inside] = number[room]
        for (one, two), cells in self.walls.items():
            if self.room[one] == self.room[two]:
                rooms[cells] = number[self.room[one]]
        _take_pillars_away(rooms)
        corridors = {k for room, k in number.items() if self.is_corridor(room)}
        return FloorLayout(rooms, frozenset(corridors))


def _wall_between(one: Box, other: Box) -> Cells | None:
    """The cells of wall that lie between the insides of two boxes, if any."""
    for across in (0, 1):
        if one.high[across] == other.low[across]:
            at = one.high[across]
        elif one.low[across] == other.high[across]:
            at = one.low[across]
        else:
            continue
        along = 1 - across
        first = max(one.low[along], other.low[along]) + 1
        last = min(one.high[along], other.high[along])
        if first >= last:  # they meet at a corner, or not at all
            return None
        thick = slice(at, at + 1)
        long = slice(first, last)
        return (thick, long) if across == 0 else (long, thick)
    return None


def _take_pillars_away(rooms: np.ndarray) -> None:
    """Make floor of single cells of wall in the midst of a room."""
    inner = rooms[1:-1, 1:-1]
    north = rooms[:-2, 1:-1]
    same = (north == rooms[2:, 1:-1]) & (north == rooms[1:-1, :-2])
    same &= north == rooms[1:-1, 2:]
    inner[:] = np.where(same & (inner == WALL), north, inner)


def _join_corridors(rng: Rng, rooms: _Rooms) -> None:
    """Join most corridors that meet; a door will part the others."""
    for one, two in rooms.walls:
        if max(one, two) < rooms.corridors and rng.random() < 0.75:
            rooms.join(one, two)


def _join_two(rng: Rng, rooms: _Rooms) -> bool:
    """Join two small rooms to one, rather one that bends; False if there are none."""
    parts: dict[int, list[Box]] = {}
    for box, room in zip(rooms.boxes, rooms.room, strict=True):
        parts.setdefault(room, []).append(box)
    area = {room: sum(box.area for box in boxes) for room, boxes in parts.items()}

    costs: dict[tuple[int, int], float] = {}
    for (one, two), cells in rooms.walls.items():
        pair = rooms.room[one], rooms.room[two]
        sides = [part.stop - part.start for part in cells]
        along = int(np.argmax(sides))
        opening = sides[along]
        if pair[0] == pair[1] or opening < LEAST_ROOM:
            continue
        cost = (area[pair[0]] + area[pair[1]]) * (1 + rng.random())
        if opening == rooms.boxes[one].metres[along] == rooms.boxes[two].metres[along]:
            cost *= 4  # one room as wide as both: it would not bend
        if rooms.is_corridor(pair[0]) or rooms.is_corridor(pair[1]):
            cost *= 9
        costs[one, two] = cost
    if costs:
        rooms.join(*min(costs, key=costs.__getitem__))
    return bool(costs)


# -- Walls between rooms ------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class Border:
    """A straight piece of wall; sides: what lies on both, the smaller number first."""

    sides: tuple[int, int]
    cells: np.ndarray  # (k, 2) rows and columns, in a line


def borders(rooms: np.ndarray) -> Iterator[Border]:
    """Find the pieces of wall between any two rooms, or rooms and what is none."""
    yield from _borders_of_rows(rooms)
    for border in _borders_of_rows(rooms.T):
        yield Border(border.sides, border.cells[:, ::-1])


def _borders_of_rows(rooms: np.ndarray) -> Iterator[Border]:
    """Find the pieces from west to east."""
    north = rooms[:-2]
    south = rooms[2:]
    parts = (rooms[1:-1] == WALL) & (north != WALL) & (south != WALL) & (north != south)
    cells = np.argwhere(parts)
    cells[:, 0] += 1  # of the wall, not of what is north of it
    sides = np.sort(np.column_stack([north[parts], south[parts]]), axis=1)

    follows = (np.diff(cells, axis=0) == (0, 1)).all(axis=1)
    follows &= (np.diff(sides, axis=0) == 0).all(axis=1)
    ends = [0, *(np.flatnonzero(~follows) + 1).tolist(), len(cells)]
    for start, stop in pairwise(ends):
        if start < stop:
            low, high = sides[start].tolist()
            yield Border((low, high), cells[start:stop])
