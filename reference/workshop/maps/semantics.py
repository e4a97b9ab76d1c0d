"""Check what is drawn: rooms, doors and stairwells of a floor, ways between floors.

A check goes through a building, or one floor of it, and yields what it finds;
`semantic_stages` orders them.
"""

import re
from collections.abc import Iterable, Iterator
from itertools import chain, pairwise

import networkx as nx
import numpy as np
from scipy import ndimage

from reference.building import (
    OUTSIDE,
    Area,
    Building,
    Kind,
    Landmark,
    build,
    connected_parts,
    is_room,
    signs_of,
)
from reference.floorplan import STAIRWELLS, Drawing
from reference.workshop.maps.mistakes import Mistake
from reference.workshop.maps.syntax import Floor, Page


def semantic_stages(drawing: Drawing, page: Page) -> Iterator[Iterable[Mistake]]:
    """Yield what each stage of checks finds, once the stages before find nothing.

    Ways come last: else one missing entrance shows as many rooms without a way out.
    """
    yield _too_large(drawing, page)
    building = build(drawing)
    yield chain.from_iterable(_outer_wall(building, floor) for floor in page.floors)
    yield _drawn_on_floors(building, page)
    yield _shafts(building, page)
    yield _ways_out(building, page)


def _drawn_on_floors(building: Building, page: Page) -> Iterator[Mistake]:
    """Check gates, stairwells and rooms, floor by floor."""
    if not building.exits:
        yield page.floors[0].heading.mistake("no-exit")
    for floor in page.floors:
        yield from _gates(building, floor)
        yield from _stairwells(building, floor)
        yield from _rooms(building, floor)


# -- What is too large --------------------------------------------------------------

MOST_PARTS = 5_000  # [A1, chosen] a hundred times the paper's
MOST_MEMORY = 4.0  # [A1, chosen] GB, of which the paper's building takes 0.04
CELL_BYTES = 6_500  # of the tables of ways and sight, measured with sight of 5 m
DOOR_BYTES = 12  # of a door, for each cell of its floor


def _too_large(drawing: Drawing, page: Page) -> Iterator[Mistake]:
    """Refuse what takes too long or does not fit, before its rooms are found."""
    signs = signs_of(drawing)
    gates = (signs == "+") | (signs == "E")
    inside = ~gates & (signs != "#") & (signs != " ")
    doors = _parts(gates)
    rooms = _parts(inside)

    of_cells = signs.size * CELL_BYTES
    of_doors = doors * signs[0].size * DOOR_BYTES
    of_both = doors * signs.size  # a byte for each cell and door
    needed = (of_cells + of_doors + of_both) / 1e9

    first = page.floors[0].heading
    if max(doors, rooms) > MOST_PARTS:
        yield first.mistake("parts-limit", most=MOST_PARTS)
    elif needed > MOST_MEMORY:
        yield first.mistake("memory-limit", needed=needed, most=MOST_MEMORY)


def _parts(mask: np.ndarray) -> int:
    """Count the connected parts of (floors, rows, columns) cells, floor by floor."""
    return sum(ndimage.label(floor)[1] for floor in mask)


# -- One floor ----------------------------------------------------------------------


def _outer_wall(building: Building, floor: Floor) -> Iterator[Mistake]:
    """Find floor beside the outside; or a blank between two walls, meant as a third."""
    signs = _rimmed(building, floor)
    room = is_room(signs)
    outside = signs == " "
    wall = ~(outside | room)

    above_and_below = np.roll(wall, 1, 0) & np.roll(wall, -1, 0)
    left_and_right = np.roll(wall, 1, 1) & np.roll(wall, -1, 1)
    between_walls = above_and_below | left_and_right

    gap = outside & ndimage.binary_dilation(room) & between_walls
    hole = room & ndimage.binary_dilation(outside & ~gap)  # told once, at the gap
    for cells in connected_parts(gap) + connected_parts(hole):
        yield floor.mistake("hole", cells[0] - 1)


def _rimmed(building: Building, floor: Floor) -> np.ndarray:
    """Surround a floor with outside: (rows + 2, columns + 2) characters."""
    return np.pad(building.signs[floor.index], 1, constant_values=" ")


def _gates(building: Building, floor: Floor) -> Iterator[Mistake]:
    """Find doors, entrances and exits that join nothing, or the wrong things."""
    outside = ndimage.binary_dilation(_rimmed(building, floor) == " ")[1:-1, 1:-1]
    for gate in building.landmarks:
        if gate.floor == floor.index:
            leads_outside = bool(outside[*gate.cells.T].any())
            wrong = _wrong(building, gate, leads_outside)
            if wrong:
                yield floor.mistake(wrong, gate.cells[0])


def _wrong(building: Building, gate: Landmark, leads_outside: bool) -> str:
    """Name the mistake in a gate; "" if there is none."""
    kinds = [building.area_of[side].kind for side in gate.sides if side != OUTSIDE]
    if gate.kind is Kind.EXIT:
        if not leads_outside:
            return "exit-indoors"
        return "" if "room" in kinds else "exit-corner"
    if leads_outside:
        return "door-outside"
    return "" if "room" in kinds and len(kinds) == 2 else "door-nowhere"


def _stairwells(building: Building, floor: Floor) -> Iterator[Mistake]:
    """Find stairwells in two parts, open to something else, or without entrance."""
    signs = _rimmed(building, floor)
    for letter in STAIRWELLS:
        mine = signs == letter
        for part in connected_parts(mine)[1:]:
            yield floor.mistake("stairwell-split", part[0] - 1, letter=letter)
        if not mine.any():
            continue
        unclosed = ~mine & (signs != "#") & (signs != "+")
        openings = np.argwhere(mine & ndimage.binary_dilation(unclosed))
        if len(openings):
            yield floor.mistake("stairwell-open", openings[0] - 1, letter=letter)
        elif "+" not in signs[ndimage.binary_dilation(mine)]:
            first = np.argwhere(mine)[0] - 1
            yield floor.mistake("stairwell-closed", first, letter=letter)


def _rooms(building: Building, floor: Floor) -> Iterator[Mistake]:
    """Find a floor without a room, a second name in one room, or one name in two."""
    if not building.rooms(floor.index):
        yield floor.heading.mistake("no-room", floor=floor.index + 1)
    names: dict[int, str] = {}  # of rooms by their index
    for row, text in enumerate(building.drawing.storeys[floor.index].rows):
        for word in re.finditer("[a-z][a-z0-9]*", text):
            cell = (row, word.start())
            name = word[0]
            room = int(building.area[floor.index, *cell])
            if room in names:
                yield floor.mistake("second-name", cell, name=name, room=names[room])
            elif name in names.values():
                yield floor.mistake("same-name", cell, name=name)
            names.setdefault(room, name)


# -- Between floors -----------------------------------------------------------------


def _shafts(building: Building, page: Page) -> Iterator[Mistake]:
    """Find stairwells that are on one floor, leave one out, or stand askew."""
    for well in building.stairwells:
        cells = {floor: building.areas[i].cells for floor, i in well.areas.items()}
        if len(cells) == 1:
            floor = page.floor_of(well.lowest)
            yield floor.mistake("stairwell-alone", well.cells[0], letter=well.letter)
        for lower, upper in pairwise(cells):
            floor = page.floor_of(upper)
            cell = cells[upper][0]
            facts = {"letter": well.letter, "lower": lower + 1, "upper": upper + 1}
            if upper > lower + 1:
                yield floor.mistake("stairwell-skips", cell, **facts)
            elif not np.array_equal(cells[lower], cells[upper]):
                yield floor.mistake("stairwell-moves", cell, **facts)


def _ways_out(building: Building, page: Page) -> Iterator[Mistake]:
    """Find rooms without a way to an exit; those that are joined are told once."""
    ways = building.ways
    saved = nx.ancestors(ways, OUTSIDE) | {OUTSIDE}
    lost = ways.subgraph(set(ways) - saved)
    for part in nx.weakly_connected_components(lost):
        room = next(a for a in building.areas if a.id in part and a.kind == "room")
        floor = page.floor_of(room.floor)
        yield floor.mistake("no-way-out", room.cells[0], room=room.name)


# -- What is no mistake, and rarely meant -------------------------------------------


def touching(building: Building) -> Iterator[tuple[Area, Area]]:
    """Find rooms that touch at a corner only, where people see but cannot pass."""
    for area, kind in zip(building.area, building.kind, strict=True):
        for pairs in (_across(area, kind), _across(area[:, ::-1], kind[:, ::-1])):
            for first, second in pairs:
                yield building.areas[first], building.areas[second]


def _across(area: np.ndarray, kind: np.ndarray) -> np.ndarray:
    """Find rooms that meet south-east of a cell, where two walls meet as well: (k, 2).

    area, kind: (rows, columns) of a floor; for south-west, mirror both
    """
    north_west = area[:-1, :-1]
    south_east = area[1:, 1:]
    rooms = (north_west >= 0) & (south_east >= 0) & (north_west != south_east)
    walls = (kind[1:, :-1] == Kind.WALL) & (kind[:-1, 1:] == Kind.WALL)
    touch = rooms & walls
    return np.column_stack([north_west[touch], south_east[touch]])
