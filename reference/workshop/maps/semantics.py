"""Check what is drawn: rooms, doors and stairwells of a floor, ways between floors.

Clauses: A1, A2 (rooms, doors), A3 (stairwells, entrances), A4 (exits).  A check goes
through a building, or one floor of it, and yields what it finds; `stages` orders them.
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
    built,
    is_room,
    pieces,
    signs_of,
)
from reference.floorplan import STAIRWELLS, Drawing
from reference.workshop.maps.mistakes import Mistake
from reference.workshop.maps.syntax import Floor, Page


def stages(drawing: Drawing, page: Page) -> Iterator[Iterable[Mistake]]:
    """What each stage of checks finds, once the stages before find nothing.

    Ways come last: else one missing entrance shows as many rooms without a way out.
    """
    yield _too_large(drawing, page)
    building = built(drawing)
    yield chain.from_iterable(_outer_wall(building, floor) for floor in page.floors)
    checks = [_gates, _stairwells, _rooms]
    wrong = (check(building, floor) for floor in page.floors for check in checks)
    missing = [] if building.exits else [page.floors[0].heading.mistake("no-exit")]
    yield chain(missing, *wrong)
    yield _shafts(building, page)
    yield _ways_out(building, page)


# -- What is too large --------------------------------------------------------------

MOST_PARTS = 5_000  # [A1, chosen] a hundred times the paper's
MOST_MEMORY = 4.0  # [A1, chosen] GB, of which the paper's building takes 0.04
CELL_BYTES, DOOR_BYTES = 6_500, 12
"""Of the tables of ways and sight: a cell's own, and a door's for each cell of its
floor; a byte more for each cell and door. Measured with sight of 5 m."""


def _too_large(drawing: Drawing, page: Page) -> Iterator[Mistake]:
    """Refuse what takes too long or does not fit, before its rooms are found."""
    signs = signs_of(drawing)
    gates = (signs == "+") | (signs == "E")
    doors, rooms = (
        sum(ndimage.label(floor)[1] for floor in mask)
        for mask in (gates, ~gates & (signs != "#") & (signs != " "))
    )
    each = signs.size * (CELL_BYTES + doors) + signs[0].size * doors * DOOR_BYTES
    needed = each / 1e9
    first = page.floors[0].heading
    if max(doors, rooms) > MOST_PARTS:
        yield first.mistake("parts-limit", most=MOST_PARTS)
    elif needed > MOST_MEMORY:
        yield first.mistake("memory-limit", needed=needed, most=MOST_MEMORY)


# -- One floor ----------------------------------------------------------------------


def _outer_wall(building: Building, floor: Floor) -> Iterator[Mistake]:
    """Floor beside the outside; or a blank between two walls, meant as a third."""
    signs = _rimmed(building, floor)
    room, outside = is_room(signs), signs == " "
    wall = ~(outside | room)
    between = [np.roll(wall, 1, axis) & np.roll(wall, -1, axis) for axis in (0, 1)]
    gap = outside & ndimage.binary_dilation(room) & (between[0] | between[1])
    hole = room & ndimage.binary_dilation(outside & ~gap)
    for cells in pieces(gap) + pieces(hole):
        yield floor.mistake("hole", cells[0] - 1)


def _rimmed(building: Building, floor: Floor) -> np.ndarray:
    """(rows + 2, cols + 2) characters of a floor, and outside all around it."""
    return np.pad(building.signs[floor.index], 1, constant_values=" ")


def _gates(building: Building, floor: Floor) -> Iterator[Mistake]:
    """Doors, entrances and exits that join nothing, or the wrong things."""
    outside = ndimage.binary_dilation(_rimmed(building, floor) == " ")[1:-1, 1:-1]
    for gate in building.landmarks:
        if gate.floor == floor.index:
            leads_outside = bool(outside[*gate.cells.T].any())
            if wrong := _wrong(building, gate, leads_outside):
                yield floor.mistake(wrong, gate.cells[0])


def _wrong(building: Building, gate: Landmark, leads_outside: bool) -> str:
    """What is wrong with a gate, if anything."""
    kinds = [building.area_of[side].kind for side in gate.sides if side != OUTSIDE]
    if gate.kind is Kind.EXIT:
        if not leads_outside:
            return "exit-indoors"
        return "" if "room" in kinds else "exit-corner"
    if leads_outside:
        return "door-outside"
    return "" if "room" in kinds and len(kinds) == 2 else "door-nowhere"


def _stairwells(building: Building, floor: Floor) -> Iterator[Mistake]:
    """Stairwells in two parts, open to something else, or without an entrance."""
    signs = _rimmed(building, floor)
    for letter in STAIRWELLS:
        mine = signs == letter
        for part in pieces(mine)[1:]:
            yield floor.mistake("stairwell-split", part[0] - 1, letter=letter)
        unclosed = ~mine & (signs != "#") & (signs != "+")
        openings = np.argwhere(mine & ndimage.binary_dilation(unclosed))
        for cell in openings[:1]:
            yield floor.mistake("stairwell-open", cell - 1, letter=letter)
        if not len(openings) and "+" not in signs[ndimage.binary_dilation(mine)]:
            for cell in np.argwhere(mine)[:1]:
                yield floor.mistake("stairwell-closed", cell - 1, letter=letter)


def _rooms(building: Building, floor: Floor) -> Iterator[Mistake]:
    """A floor without a room, a second name in one room, or one name in two."""
    if not building.rooms(floor.index):
        yield floor.heading.mistake("no-room", floor=floor.index + 1)
    names: dict[int, str] = {}  # of rooms by their index
    for row, text in enumerate(building.drawing.storeys[floor.index].rows):
        for word in re.finditer("[a-z][a-z0-9]*", text):
            cell, name = (row, word.start()), word[0]
            room = int(building.area[floor.index, *cell])
            if room in names:
                yield floor.mistake("second-name", cell, name=name, room=names[room])
            elif name in names.values():
                yield floor.mistake("same-name", cell, name=name)
            names.setdefault(room, name)


# -- Between floors -----------------------------------------------------------------


def _shafts(building: Building, page: Page) -> Iterator[Mistake]:
    """Stairwells on one floor only, with a floor left out, or not above themselves."""
    for well in building.stairwells:
        cells = {floor: building.areas[i].cells for floor, i in well.areas.items()}
        if len(cells) == 1:
            floor = page.floor_of(well.lowest)
            yield floor.mistake("stairwell-alone", well.cells[0], letter=well.letter)
        for lower, upper in pairwise(cells):
            floor, cell = page.floor_of(upper), cells[upper][0]
            facts = {"letter": well.letter, "lower": lower + 1, "upper": upper + 1}
            if upper > lower + 1:
                yield floor.mistake("stairwell-skips", cell, **facts)
            elif not np.array_equal(cells[lower], cells[upper]):
                yield floor.mistake("stairwell-moves", cell, **facts)


def _ways_out(building: Building, page: Page) -> Iterator[Mistake]:
    """Find rooms without a way to an exit; those that are joined are told once."""
    ways = building.ways
    lost = ways.subgraph(set(ways) - nx.ancestors(ways, OUTSIDE) - {OUTSIDE})
    for part in nx.weakly_connected_components(lost):
        room = next(a for a in building.areas if a.id in part and a.kind == "room")
        floor = page.floor_of(room.floor)
        yield floor.mistake("no-way-out", room.cells[0], room=room.name)


# -- What is no mistake, and rarely meant -------------------------------------------


def touching(building: Building) -> Iterator[tuple[Area, Area]]:
    """Find rooms that touch at a corner only, where people see but cannot pass."""
    for area, kind in zip(building.area, building.kind, strict=True):
        for here, kinds in ((area, kind), (area[:, ::-1], kind[:, ::-1])):
            first, second = here[:-1, :-1], here[1:, 1:]
            walls = (kinds[1:, :-1] == Kind.WALL) & (kinds[:-1, 1:] == Kind.WALL)
            touch = walls & (first != second) & (np.minimum(first, second) >= 0)
            for pair in zip(first[touch], second[touch], strict=True):
                yield building.areas[pair[0]], building.areas[pair[1]]
