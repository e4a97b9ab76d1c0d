"""Draw new buildings by lot, any number of them: the same for the same seed.

A building gets an outline, stairwells through all floors, beside the main body as in
the paper or in it [A3], rooms by `dividing`, fewer above [A2], doors that join all
rooms of a floor, exits [A4], and names.

side     of the main body: 0 north, 1 west, 2 south, 3 east
walls    pieces of wall by what lies on both sides, as in `dividing.Border`
signs    (rows, columns) characters of a floor's drawing
"""

import tomllib
from collections.abc import Mapping, Sequence
from itertools import pairwise
from math import sqrt
from pathlib import Path
from typing import Any, TypeAlias

import networkx as nx
import numpy as np
from numpy.random import Generator as Rng

from reference.floorplan import STAIRWELLS
from reference.paper import InputError
from reference.workshop.maps.dividing import (
    LEAST_ROOM,
    OUTDOORS,
    STAIR_ROOMS,
    WALL,
    YARD,
    Border,
    Box,
    FloorLayout,
    borders,
    divide,
)
from reference.workshop.maps.pages import MOST_FLOORS

LEAST_SIDE = 6  # [A1, chosen] cells of a main body's side: one room of 4 m
MOST_SIDE = 180  # [A1, chosen] with stairwells beside it, a drawing holds it
MOST_AREA = 100_000  # [A1, chosen] cells of all floors: 0.7 GB to simulate

SHAFT = (4, 5)  # rows and columns of a stairwell from wall to wall, as in the paper
LEAST_INSIDE = 16  # cells of the sides of a main body that may have stairs in it
LEAST_WINGS = 24  # cells of the sides of a main body that may have a yard or wings

# by how many of the rooms on both sides of a wall are corridors: 0, 1 or 2
TREE_WEIGHTS = (3, 1, 0)  # the lighter, the rather a door joins them
DOOR_CHANCES = (0.2, 0.3, 0.9)  # of a door beyond those that join all rooms
WIDE_CHANCES = (0.25, 0.25, 0.9)  # of a door of 2 m
DOOR_CHANCE = 0.4  # of a door beyond those, on a floor without corridors

ROOM_NAMES: dict[str, Any] = tomllib.loads(
    Path(__file__).with_name("names.toml").read_text("utf-8")
)
HOUSE_KINDS = [kind for kind in ROOM_NAMES if kind.istitle()]

Walls: TypeAlias = Mapping[tuple[int, int], Sequence[Border]]
Blocks: TypeAlias = list[tuple[int, Box]]
"""Boxes that are in no room, each with the sign of what is in it."""


def generated_text(
    seed: int, width: int = 40, height: int = 40, floors: int = 3
) -> str:
    """Draw a building by lot, as the text of its floor file.

    width, height: of its main body in cells, outer walls included. Raises InputError.
    """
    _refuse(seed, width, height, floors)
    rng = np.random.default_rng((seed, width, height, floors))
    kind = str(rng.choice(HOUSE_KINDS))

    # a main body, with place around it for stairs
    around = SHAFT[0] + 1
    body = Box((around, around), (around + height - 1, around + width - 1))
    shape = height + 2 * around, width + 2 * around
    blocks = _outline(rng, body)
    sides = _sides_of_stairs(rng, floors)
    beside = _put_stairs_inside(rng, body, blocks, sides)

    layouts = _divided(rng, shape, body, blocks, floors)
    _put_stairs_beside(rng, body, blocks, beside, layouts)

    storeys = []
    for number, layout in enumerate(layouts):
        rooms = _with_blocks(layout.rooms, body, blocks)
        storeys.append(_drawn(rng, kind, FloorLayout(rooms, layout.corridors), number))

    head = [
        "; Drawn by lot. The same command draws it again:",
        f"; python -m reference floors --new --seed {seed} --size {width}x{height} "
        f"--floors {floors}",
        "",
        f"building: {kind} {seed}",
    ]
    return _written(head, ROOM_NAMES[kind]["floors"], storeys)


def _refuse(seed: int, width: int, height: int, floors: int) -> None:
    """Raise InputError for a size that no new building has, or a seed below 0."""
    size = f"{width}x{height}"
    if min(width, height) < LEAST_SIDE or max(width, height) > MOST_SIDE:
        raise InputError(
            f"no new building is {size} cells large. Take {LEAST_SIDE} to {MOST_SIDE} "
            "each way, such as 40x40."
        )
    if not 1 <= floors <= MOST_FLOORS:
        raise InputError(
            f"no new building has {floors} floors. Take 1 to {MOST_FLOORS}."
        )
    if width * height * floors > MOST_AREA:
        raise InputError(
            f"no new building has {floors} floors of {size} cells. Take at most "
            f"{MOST_AREA:,} cells in all."
        )
    if seed < 0:
        raise InputError(f"{seed} is no seed of a new building. Take 0 or more.")


def _divided(
    rng: Rng, shape: tuple[int, int], body: Box, blocks: Blocks, floors: int
) -> list[FloorLayout]:
    """Divide all floors, each into fewer rooms than the one below [A2]."""
    boxes = [box for _, box in blocks]
    side = sqrt(body.area - sum(box.area for box in boxes))  # of a square as large
    wanted = max(round(side * (0.32 + 0.2 * rng.random())), 2)
    corridors = int(rng.integers(int(side > 14), 2 + int(side) // 20))

    layouts = list[FloorLayout]()
    for _ in range(floors):
        corridors = min(corridors, 1 + wanted // 5)
        layout = divide(rng, shape, body, boxes, wanted, corridors)
        layouts.append(layout)
        fewer = round(layout.count * (0.55 + 0.3 * rng.random()))
        wanted = min(max(fewer, 3), layout.count)
        corridors = int(rng.integers(int(side > 20), max(corridors, 1) + 1))
    return layouts


# -- Outline and stairwells ---------------------------------------------------------


def _outline(rng: Rng, body: Box) -> Blocks:
    """Take nothing away from the main body, or a corner, or a yard in its middle."""
    if min(body.metres) + 2 < LEAST_WINGS:
        return []
    form = rng.random()
    sizes = [int(metres * (0.25 + 0.2 * rng.random())) for metres in body.metres]
    if form < 0.2:
        # with the outer walls of the corner: beyond them nothing is left
        starts = [
            low - 1 if rng.random() < 0.5 else high + 1 - size
            for low, high, size in zip(body.low, body.high, sizes, strict=True)
        ]
        return [(OUTDOORS, _box_at(starts, sizes))]
    if form < 0.35:
        starts = [
            low + int((high - low - size) * (0.4 + 0.2 * rng.random()))
            for low, high, size in zip(body.low, body.high, sizes, strict=True)
        ]
        return [(YARD, _box_at(starts, sizes))]
    return []


def _box_at(start: Sequence[int], size: Sequence[int]) -> Box:
    """Make a box from its first corner, and its size from wall to wall."""
    return Box((start[0], start[1]), (start[0] + size[0], start[1] + size[1]))


def _sides_of_stairs(rng: Rng, floors: int) -> list[int]:
    """Draw the sides that have a stairwell, opposite ones more often."""
    if floors == 1:
        return []
    first = int(rng.integers(4))
    if rng.random() < 0.3:
        return [first]
    turn = 2 if rng.random() < 0.6 else int(rng.choice((1, 3)))
    return [first, (first + turn) % 4]


def _put_stairs_inside(
    rng: Rng, body: Box, blocks: Blocks, sides: Sequence[int]
) -> list[tuple[int, int]]:
    """Add stairwells in the main body to the blocks; return the others, with sides."""
    beside = []
    for sign, side in zip(STAIR_ROOMS, sides, strict=False):
        starts = _starts(body, side)
        low = starts[0]
        high = starts[-1]
        shafts = [
            _shaft_at(body, side, at, is_inside=True)
            for at in starts
            if at in (low, high) or low + LEAST_ROOM < at < high - LEAST_ROOM
        ]
        least = LEAST_ROOM + 1  # a room fits between
        free = [s for s in shafts if all(s.gap(box) >= least for _, box in blocks)]
        is_large = min(body.metres) + 2 >= LEAST_INSIDE
        if free and is_large and rng.random() < 0.4:
            blocks.append((sign, free[int(rng.integers(len(free)))]))
        else:
            beside.append((sign, side))
    return beside


def _put_stairs_beside(
    rng: Rng,
    body: Box,
    blocks: Blocks,
    wanted: Sequence[tuple[int, int]],
    layouts: Sequence[FloorLayout],
) -> None:
    """Add stairwells beside the main body to the blocks, behind corridors if it can."""
    for sign, side in wanted:
        shafts = list[Box]()
        ranks = list[float]()
        for at in _starts(body, side):
            behind = _shaft_at(body, side, at, is_inside=True)
            if all(behind.gap(box) >= 0 for _, box in blocks):
                shafts.append(_shaft_at(body, side, at, is_inside=False))
                at_corridor = [
                    bool(layout.corridors & {*layout.rooms[behind.inside].flat})
                    for layout in layouts
                ]
                ranks.append(sum(at_corridor) + 1.5 * rng.random())
        blocks.append((sign, shafts[int(np.argmax(ranks))]))


def _starts(body: Box, side: int) -> range:
    """Rows or columns of a side where a stairwell may begin."""
    along = 1 - side % 2
    return range(body.low[along], body.high[along] - SHAFT[1] + 1)


def _shaft_at(body: Box, side: int, at: int, is_inside: bool) -> Box:
    """Place a stairwell at a side of the main body, with a wall in common."""
    across = side % 2
    is_first = side < 2
    edge = body.low[across] if is_first else body.high[across]
    if is_first != is_inside:
        edge -= SHAFT[0]
    if across == 0:
        return _box_at((edge, at), SHAFT)
    return _box_at((at, edge), SHAFT[::-1])


def _with_blocks(rooms: np.ndarray, body: Box, blocks: Blocks) -> np.ndarray:
    """Put stairwells, yards and the outside around the rooms of a floor."""
    whole = np.full(rooms.shape, OUTDOORS)
    whole[body.whole] = rooms[body.whole]
    for sign, box in blocks:
        if sign in STAIR_ROOMS:
            within = whole[box.whole]
            whole[box.whole] = np.where(within == OUTDOORS, WALL, within)
        whole[box.inside] = sign
    return whole


# -- Doors, entrances, exits --------------------------------------------------------


def _drawn(rng: Rng, kind: str, layout: FloorLayout, number: int) -> np.ndarray:
    """Draw the signs of a floor; number: 0 for the ground floor, which has exits."""
    rooms = layout.rooms
    signs = np.full(rooms.shape, ".")
    signs[rooms == WALL] = "#"
    signs[(rooms == OUTDOORS) | (rooms == YARD)] = " "
    for letter, sign in zip(STAIRWELLS, STAIR_ROOMS, strict=False):
        signs[rooms == sign] = letter

    walls: dict[tuple[int, int], list[Border]] = {}
    for border in borders(rooms):
        walls.setdefault(border.sides, []).append(border)
    _cut_doors(rng, signs, walls, layout.corridors)
    _cut_entrances(rng, signs, walls, layout.corridors)
    entered = set[int]()
    if number == 0:
        entered = _cut_exits(rng, signs, walls, layout)
    _write_names(rng, signs, layout, entered, ROOM_NAMES[kind]["rooms"])
    return signs


def _cut_doors(
    rng: Rng, signs: np.ndarray, walls: Walls, corridors: frozenset[int]
) -> None:
    """Join all rooms by as few doors as can be, to corridors first; then some more."""
    pairs = sorted(sides for sides in walls if min(sides) > WALL)
    beside = {pair: len(corridors & {*pair}) for pair in pairs}  # corridors, 0 to 2
    graph = nx.Graph()
    for pair in pairs:
        graph.add_edge(*pair, weight=TREE_WEIGHTS[beside[pair]] + rng.random())
    tree = {
        (min(ends), max(ends)) for ends in nx.minimum_spanning_edges(graph, data=False)
    }

    for pair in pairs:
        chance = DOOR_CHANCES[beside[pair]] if corridors else DOOR_CHANCE
        if pair in tree or rng.random() < chance:
            is_wide = rng.random() < WIDE_CHANCES[beside[pair]]
            _open(rng, signs, walls[pair], "+", 2 if is_wide else 1)


def _cut_entrances(
    rng: Rng, signs: np.ndarray, walls: Walls, corridors: frozenset[int]
) -> None:
    """Let each stairwell be entered, from a corridor if one is beside it [A3]."""
    for sign in STAIR_ROOMS:
        rooms = sorted(room for well, room in walls if well == sign and room > WALL)
        if rooms:
            ranks = [(room in corridors) + rng.random() for room in rooms]
            _open(rng, signs, walls[sign, rooms[int(np.argmax(ranks))]], "+", 2)


def _cut_exits(
    rng: Rng, signs: np.ndarray, walls: Walls, layout: FloorLayout
) -> set[int]:
    """Cut one to four exits, far from each other [A4]; return the rooms behind.

    They lie rather at the end of a corridor than in a closet.
    """
    # the rooms' pieces of outer wall, and how likely an exit lies in each
    pieces = [
        (room, piece)
        for (out, room), found in sorted(walls.items())
        if out == OUTDOORS and room > WALL
        for piece in found
    ]
    weights = []
    for room, piece in pieces:
        weight = 6.0 if room in layout.corridors else min(1.0, layout.sizes[room] / 50)
        weights.append(weight * len(piece.cells))

    # how many exits, and how wide
    perimeter = sum(len(piece.cells) for _, piece in pieces)
    count = int(rng.choice((1, 2, 3, 4), p=(0.15, 0.4, 0.3, 0.15)))
    count = min(count, 1 + perimeter // 20, len(pieces))
    wide = int(rng.integers(1, 3 + (perimeter > 100)))

    # one by one: of three pieces, the one that is farthest from the exits before
    rooms = set[int]()
    places = list[np.ndarray]()
    for _ in range(count):
        chances = np.array(weights) / sum(weights)
        drawn = rng.choice(len(pieces), 3, p=chances).tolist()
        far = [_metres_to(places, pieces[k][1]) for k in drawn]
        chosen = drawn[int(np.argmax(far))]
        room, piece = pieces.pop(chosen)
        weights.pop(chosen)
        _open(rng, signs, [piece], "E", wide)
        places.append(piece.cells.mean(axis=0))
        rooms.add(room)
    return rooms


def _metres_to(places: Sequence[np.ndarray], piece: Border) -> float:
    """Metres from the middle of a piece to the nearest place, along both axes."""
    middle = piece.cells.mean(axis=0)
    return min((float(abs(middle - place).sum()) for place in places), default=0.0)


def _open(
    rng: Rng, signs: np.ndarray, pieces: Sequence[Border], sign: str, wide: int
) -> None:
    """Cut an opening into one of these pieces of wall, in no corner if it can be."""
    ranks = [min(len(piece.cells), wide + 1) + rng.random() for piece in pieces]
    cells = pieces[int(np.argmax(ranks))].cells
    wide = min(wide, len(cells))
    corner = int(len(cells) >= wide + 2)
    first = int(rng.integers(corner, len(cells) - wide - corner + 1))
    signs[*cells[first : first + wide].T] = sign


# -- Names and text -----------------------------------------------------------------


def _write_names(
    rng: Rng,
    signs: np.ndarray,
    layout: FloorLayout,
    entered: set[int],
    words: Sequence[str],
) -> None:
    """Write a name on the floor of each room, large rooms first."""
    sizes = layout.sizes
    used = set[str]()
    for room in np.argsort(-sizes, kind="stable")[: layout.count].tolist():
        pool = [*words, *ROOM_NAMES["spare"]]
        if room in layout.corridors:
            pool = ROOM_NAMES["corridors"]
        elif room in entered:
            pool = ROOM_NAMES["entrances"] + pool
        row, column, length = _line_for_a_name(layout.rooms == room)
        name = _name_of(rng, pool, used, length)
        used.add(name)
        start = column + (length - len(name)) // 2
        signs[row, start : start + len(name)] = [*name]


def _name_of(rng: Rng, words: Sequence[str], used: set[str], length: int) -> str:
    """Draw one of the first free words, with place around it if it can be.

    Where no word fits or all are taken, one has a number; "" if that is too long too.
    """
    for around in (2, 0):
        fit = [word for word in words if len(word) + around <= length]
        free = [word for word in fit if word not in used]
        if free:
            return free[int(rng.integers(min(len(free), 4)))]
    numbered = (f"{word}{k}" for k in range(2, 100) for word in fit)
    return next((n for n in numbered if n not in used and len(n) <= length), "")


def _line_for_a_name(mask: np.ndarray) -> tuple[int, int, int]:
    """Find cells of a room in a row, many and near its middle: row, column, count."""
    cells = np.argwhere(mask)
    middle = float(cells[:, 0].mean())
    gaps = (np.diff(cells, axis=0) != (0, 1)).any(axis=1)
    ends = [0, *(np.flatnonzero(gaps) + 1).tolist(), len(cells)]
    lines = [(*cells[start].tolist(), stop - start) for start, stop in pairwise(ends)]
    return max(lines, key=lambda line: min(line[2], 12) - abs(line[0] - middle))


def _written(
    head: Sequence[str], names: Sequence[str], storeys: Sequence[np.ndarray]
) -> str:
    """Write the floor file, without what is empty around all floors."""
    drawn = np.argwhere((np.array(storeys) != " ").any(axis=0))
    top, left = drawn.min(axis=0).tolist()
    bottom, right = (drawn.max(axis=0) + 1).tolist()
    width = right - left
    lines = [*head, f"size:     {width} x {bottom - top}"]
    for number, signs in enumerate(storeys, 1):
        lines += ["", f"floor {number}: {names[(number - 1) % len(names)]}"]
        lines += _ruler(width)
        lines += ["".join(row) for row in signs[top:bottom, left:right].tolist()]
    return "".join(f"{line.rstrip()}\n" for line in lines)


def _ruler(width: int) -> list[str]:
    """Two notes that count columns."""
    columns = range(2, width + 1)
    tens = [str(column // 10 % 10) if column % 10 == 0 else " " for column in columns]
    ones = [str(column % 10) for column in columns]
    return [";" + "".join(tens), ";" + "".join(ones)]
