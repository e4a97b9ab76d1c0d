"""Draw new buildings by lot, any number of them: the same for the same seed.

The floors are divided by `dividing`; here they get stairwells through all of them
[A3], doors that join all rooms of a floor [A2], exits [A4], names, and a text.
"""

import tomllib
from collections.abc import Sequence
from math import sqrt
from pathlib import Path
from typing import Any

import networkx as nx
import numpy as np
from numpy.random import Generator as Rng

from reference.building import Building, building_of
from reference.floorplan import STAIRWELLS
from reference.paper import InputError
from reference.workshop.maps.dividing import (
    OUTSIDE,
    STAIRS,
    WALL,
    Border,
    Box,
    Floor,
    borders,
    divide,
)
from reference.workshop.maps.syntax import MOST_FLOORS

LEAST_SIDE = 6  # [A1, chosen] cells of a main body: a room of 4 m
MOST_SIDE = 180  # [A1, chosen] with stairwells beside it, it still is a drawing
MOST_GROUND = 100_000  # [A1, chosen] cells of all floors: 0.7 GB to simulate

DEPTH = 4  # rows from a wall to the other wall of a stairwell
LENGTH = 5  # and columns

NAMES: dict[str, Any] = tomllib.loads(
    Path(__file__).with_name("names.toml").read_text("utf-8")
)


def generated(
    seed: int, width: int = 40, height: int = 40, floors: int = 3
) -> Building:
    """Build what `generated_text` draws. Raises InputError."""
    return building_of(generated_text(seed, width, height, floors))


def generated_text(
    seed: int, width: int = 40, height: int = 40, floors: int = 3
) -> str:
    """Draw a building by lot, as the text of its floor file.

    width, height: of its main body in cells, outer walls included. Raises InputError.
    """
    _refuse(seed, width, height, floors)
    rng = np.random.default_rng((seed, width, height, floors))
    margin = DEPTH + 1
    body = Box((margin, margin), (margin + height - 1, margin + width - 1))
    shape = (height + 2 * margin, width + 2 * margin)

    sides = _sides_with_stairs(rng, floors)
    inside = min(width, height) >= 16 and rng.random() < 0.4
    blocks = _blocks_inside(rng, body, sides) if inside else {}
    storeys = _divided(rng, shape, body, blocks, floors)
    if not inside:
        blocks = _blocks_beside(rng, body, sides, storeys)

    signs = []
    for number, floor in enumerate(storeys):
        rooms = _around(floor.rooms, body, blocks)
        signs.append(_drawn(rng, rooms, floor.corridors, is_ground=number == 0))
    return _written(rng, (seed, width, height, floors), storeys, signs)


def _refuse(seed: int, width: int, height: int, floors: int) -> None:
    """Raise InputError for a size that no building has, or a seed below 0."""
    if not (LEAST_SIDE <= min(width, height) and max(width, height) <= MOST_SIDE):
        raise InputError(
            f"a new building cannot have {width}x{height} cells. Take {LEAST_SIDE} to "
            f"{MOST_SIDE} in each direction, such as 40x40."
        )
    if not 1 <= floors <= MOST_FLOORS:
        raise InputError(
            f"a new building cannot have {floors} floors. Take 1 to {MOST_FLOORS}."
        )
    if width * height * floors > MOST_GROUND:
        raise InputError(
            f"a new building cannot have {width}x{height} cells on {floors} floors. "
            f"Take at most {MOST_GROUND:,} cells in all."
        )
    if seed < 0:
        raise InputError(f"{seed} is no seed of a new building. Take 0 or more.")


def _divided(
    rng: Rng, shape: tuple[int, int], body: Box, blocks: dict[int, Box], floors: int
) -> list[Floor]:
    """Divide all floors, each into fewer rooms than the one below [A2]."""
    free = body.area - sum(block.area for block in blocks.values())
    wanted = max(2, round(sqrt(free) * (0.34 + 0.2 * rng.random())))
    corridors = int(rng.integers(0, 1 + round(sqrt(free) / 10)))
    corridors = max(corridors, int(free > 200))
    storeys = list[Floor]()
    for _ in range(floors):
        floor = divide(rng, shape, body, blocks, wanted, corridors)
        storeys.append(floor)
        count = len(floor.numbers)
        fewer = max(round(count * (0.6 + 0.25 * rng.random())), 3)
        wanted = min(fewer, count)
        corridors = int(rng.integers(int(free > 400), max(corridors, 1) + 1))
    return storeys


# -- Stairwells ---------------------------------------------------------------------


def _sides_with_stairs(rng: Rng, floors: int) -> list[int]:
    """Draw the sides with stairwells: 0 north, 1 east, 2 south, 3 west."""
    if floors == 1:
        return []
    first = int(rng.integers(4))
    if rng.random() < 0.3:
        return [first]
    other = 2 if rng.random() < 0.6 else int(rng.integers(1, 4))
    return [first, (first + other) % 4]


def _block_at(body: Box, side: int, at: int, is_inside: bool) -> Box:
    """Place a stairwell at a side of the body; at: its first row or column."""
    axis = side % 2
    first_side = side in (0, 3)
    axis = 0 if side in (0, 2) else 1  # the axis that the side is at right angles to
    edge = body.low[axis] if first_side else body.high[axis]
    grows = first_side == is_inside
    span = (edge, edge + DEPTH) if grows else (edge - DEPTH, edge)
    along = (at, at + LENGTH)
    (top, bottom), (left, right) = (span, along) if axis == 0 else (along, span)
    return Box((top, left), (bottom, right))


def _starts(body: Box, side: int) -> list[int]:
    """Rows or columns where a stairwell may begin at a side."""
    axis = 1 if side in (0, 2) else 0
    return list(range(body.low[axis], body.high[axis] - LENGTH + 1))


def _blocks_inside(rng: Rng, body: Box, sides: Sequence[int]) -> dict[int, Box]:
    """Place stairwells inside the body, at its outer walls."""
    blocks: dict[int, Box] = {}
    for sign, side in zip(STAIRS, sides, strict=False):
        starts = _starts(body, side)
        low, high = starts[0], starts[-1]
        free = [at for at in starts if at in (low, high) or low + 3 < at < high - 3]
        at = free[int(rng.integers(len(free)))]
        block = _block_at(body, side, at, is_inside=True)
        if not any(_close(block, other) for other in blocks.values()):
            blocks[sign] = block
    return blocks


def _close(one: Box, other: Box) -> bool:
    """Do two blocks leave too little between them for a room?"""
    gaps = [
        max(one.low[axis] - other.high[axis], other.low[axis] - one.high[axis])
        for axis in (0, 1)
    ]
    return max(gaps) < 5


def _blocks_beside(
    rng: Rng, body: Box, sides: Sequence[int], storeys: Sequence[Floor]
) -> dict[int, Box]:
    """Place stairwells beside the body, where corridors end if there are any."""
    blocks: dict[int, Box] = {}
    for sign, side in zip(STAIRS, sides, strict=False):
        starts = _starts(body, side)
        scores = []
        for at in starts:
            behind = _block_at(body, side, at, is_inside=True)
            score = 1.5 * rng.random()
            for floor in storeys:
                near = np.unique(floor.rooms[behind.inside]).tolist()
                score += bool(floor.corridors & {*near})
            scores.append(score)
        at = starts[int(np.argmax(scores))]
        blocks[sign] = _block_at(body, side, at, is_inside=False)
    return blocks


def _around(rooms: np.ndarray, body: Box, blocks: dict[int, Box]) -> np.ndarray:
    """Put stairwells and the outside around the rooms of a floor."""
    around = np.full(rooms.shape, OUTSIDE)
    around[body.all] = rooms[body.all]
    for sign, block in blocks.items():
        around[block.all] = np.where(
            around[block.all] == OUTSIDE, WALL, around[block.all]
        )
        around[block.inside] = sign
    return around


# -- Doors, entrances, exits --------------------------------------------------------


def _drawn(
    rng: Rng, rooms: np.ndarray, corridors: set[int], is_ground: bool
) -> np.ndarray:
    """Draw a floor: (rows, columns) characters."""
    signs = np.full(rooms.shape, ".")
    signs[rooms == WALL] = "#"
    signs[rooms == OUTSIDE] = " "
    for letter, sign in zip(STAIRWELLS, STAIRS, strict=False):
        signs[rooms == sign] = letter

    walls: dict[tuple[int, int], list[Border]] = {}
    for border in borders(rooms):
        walls.setdefault(border.sides, []).append(border)
    _cut_doors(rng, signs, walls, corridors)
    _cut_entrances(rng, signs, walls, corridors)
    if is_ground:
        _cut_exits(rng, signs, walls)
    return signs


def _cut_doors(
    rng: Rng,
    signs: np.ndarray,
    walls: dict[tuple[int, int], list[Border]],
    corridors: set[int],
) -> None:
    """Join all rooms by doors, at corridors where there are any; make some rings."""
    graph = nx.Graph()
    pairs = sorted(sides for sides in walls if sides[0] > 0)
    for pair in pairs:
        lanes = len(corridors & {*pair})
        graph.add_edge(*pair, weight=rng.random() + (3, 1, 0)[lanes])
    needed = {(min(e), max(e)) for e in nx.minimum_spanning_edges(graph, data=False)}

    for pair in pairs:
        lanes = len(corridors & {*pair})
        if pair in needed or rng.random() < (0.2, 0.25, 0.8)[lanes]:
            is_wide = rng.random() < (0.25, 0.25, 0.9)[lanes]
            _open(rng, signs, _piece(rng, walls[pair]), "+", 2 if is_wide else 1)


def _cut_entrances(
    rng: Rng,
    signs: np.ndarray,
    walls: dict[tuple[int, int], list[Border]],
    corridors: set[int],
) -> None:
    """Give each stairwell an entrance, from a corridor if one is beside it [A3]."""
    for sign in STAIRS:
        rooms = [b for a, b in sorted(walls) if a == sign and b > 0]
        if rooms:
            ranks = [(room in corridors) + rng.random() for room in rooms]
            room = rooms[int(np.argmax(ranks))]
            _open(rng, signs, _piece(rng, walls[sign, room]), "+", 2)


def _cut_exits(
    rng: Rng, signs: np.ndarray, walls: dict[tuple[int, int], list[Border]]
) -> None:
    """Cut one to four exits into the outer wall, far from each other [A4]."""
    pieces = [p for (a, _), found in walls.items() if a == OUTSIDE for p in found]
    cells = np.concatenate([piece.cells for piece in pieces])
    of_piece = np.repeat(np.arange(len(pieces)), [len(p.cells) for p in pieces])
    count = int(np.searchsorted((0.15, 0.55, 0.85), rng.random())) + 1
    count = min(count, 1 + len(cells) // 16)
    wide = 1 + int(rng.random() < 0.8) + int(len(cells) > 100 and rng.random() < 0.4)
    taken = list[np.ndarray]()
    used = set[int]()
    for _ in range(count):
        drawn = rng.integers(len(cells), size=8)
        drawn = np.array([i for i in drawn.tolist() if int(of_piece[i]) not in used])
        if not len(drawn):
            continue
        gaps = [min((abs(cells[i] - t).sum() for t in taken), default=0) for i in drawn]
        chosen = int(drawn[int(np.argmax(gaps))])
        piece = pieces[int(of_piece[chosen])]
        used.add(int(of_piece[chosen]))
        _open(rng, signs, piece, "E", wide)
        taken.append(cells[chosen])


def _piece(rng: Rng, found: Sequence[Border]) -> Border:
    """Draw a piece of the wall between two rooms, a longer one more likely."""
    lengths = [len(piece.cells) * rng.random() for piece in found]
    return found[int(np.argmax(lengths))]


def _open(rng: Rng, signs: np.ndarray, piece: Border, sign: str, wide: int) -> None:
    """Cut an opening into a piece of wall, beside no corner if it is long enough."""
    length = len(piece.cells)
    wide = min(wide, length)
    corner = int(length >= wide + 2)
    start = int(rng.integers(corner, length - wide - corner + 1))
    signs[*piece.cells[start : start + wide].T] = sign


# -- Names and text -----------------------------------------------------------------


def _written(
    rng: Rng,
    asked: tuple[int, int, int, int],
    storeys: Sequence[Floor],
    signs: Sequence[np.ndarray],
) -> str:
    """Write the floor file, with names of rooms."""
    seed, width, height, floors = asked
    kinds = sorted(kind for kind in NAMES if kind[0].isupper())
    kind = kinds[int(rng.integers(len(kinds)))]
    for number, floor in enumerate(storeys):
        _name_rooms(rng, floor, signs[number], NAMES[kind]["rooms"])

    drawn = np.argwhere((np.array(signs) != " ").any(axis=0))
    top, left = drawn.min(axis=0).tolist()
    bottom, right = (drawn.max(axis=0) + 1).tolist()
    lines = [
        f"; python -m reference floors --new --seed {seed} --size {width}x{height} "
        f"--floors {floors}",
        "",
        f"building: {kind} {seed}",
        f"size:     {right - left} x {bottom - top}",
    ]
    for number, canvas in enumerate(signs):
        names = NAMES[kind]["floors"]
        lines += ["", f"floor {number + 1}: {names[min(number, len(names) - 1)]}"]
        lines += ["".join(row).rstrip() for row in canvas[top:bottom, left:right]]
    return "".join(f"{line}\n" for line in lines)


def _name_rooms(
    rng: Rng, floor: Floor, signs: np.ndarray, words: Sequence[str]
) -> None:
    """Write names on the floor of rooms, the first words on the largest."""
    sizes = np.bincount(floor.rooms[floor.rooms > 0])
    used = set[str]()
    for room in sorted(floor.numbers, key=lambda number: -sizes[number]):
        pool = NAMES["corridors"] if room in floor.corridors else words
        row, column, length = _longest_line(floor.rooms == room)
        fitting = [w for w in [*pool, *NAMES["spare"]] if len(w) <= length - 2]
        fitting = fitting or [w for w in NAMES["spare"] if len(w) <= length]
        free = [word for word in fitting if word not in used]
        if free:
            word = free[int(rng.integers(min(len(free), 4)))]
        else:
            word = f"r{len(used)}"
        if len(word) > length:  # no room for a word: it is called by its number
            continue
        used.add(word)
        start = column + (length - len(word)) // 2
        signs[row, start : start + len(word)] = [*word]


def _longest_line(mask: np.ndarray) -> tuple[int, int, int]:
    """Find where a word fits best: row, first column, and cells of the line."""
    cells = np.argwhere(mask)
    middle = cells.mean(axis=0)
    breaks = (np.diff(cells, axis=0) != (0, 1)).any(axis=1)
    starts = [0, *(np.flatnonzero(breaks) + 1).tolist(), len(cells)]
    best = (0.0, 0, 0, 0)
    for start, stop in zip(starts[:-1], starts[1:], strict=True):
        row, column = cells[start].tolist()
        length = stop - start
        off = abs(row - float(middle[0]))
        score = min(length, 12) - off
        if not best[3] or score > best[0]:
            best = (score, row, column, length)
    return best[1:]
