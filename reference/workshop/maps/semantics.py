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
    is_room,
    pieces,
    signs_of,
)
from reference.floorplan import STAIRWELLS, Plan
from reference.workshop.maps.mistakes import Mistake
from reference.workshop.maps.syntax import Drawing, Page


def stages(plan: Plan, page: Page) -> Iterator[Iterable[Mistake]]:
    """What each stage of checks finds, once the stages before find nothing.

    Ways come last: else a missing entrance is many rooms that nobody can leave.
    """
    yield _too_large(plan, page)
    building = Building(plan)
    for checks in ((_outer_wall,), (_gates, _stairwells, _rooms)):
        yield chain.from_iterable(
            check(building, drawing) for drawing in page.drawings for check in checks
        )
    yield chain(_some_exit(building, page), _shafts(building, page))
    yield _ways_out(building, page)


# -- What is too large --------------------------------------------------------------

MOST_PARTS = 5_000  # [A1, chosen] a hundred times the paper's
MOST_MEMORY = 4.0  # [A1, chosen] GB, of which the paper's building takes 0.04
CELL_BYTES, DOOR_BYTES = 6_500, 12
"""Of the tables of ways and sight: a cell's own, and a door's for each cell of its
floor; a byte more for each cell and door. Measured with sight of 5 m."""


def _too_large(plan: Plan, page: Page) -> Iterator[Mistake]:
    """Refuse what takes too long or does not fit, before its rooms are found."""
    signs = signs_of(plan)
    gates = (signs == "+") | (signs == "E")
    doors, rooms = (
        sum(ndimage.label(floor)[1] for floor in mask)
        for mask in (gates, ~gates & (signs != "#") & (signs != " "))
    )
    needed = signs.size * (CELL_BYTES + doors) + signs[0].size * doors * DOOR_BYTES
    first = page.drawings[0].heading
    if max(doors, rooms) > MOST_PARTS:
        what = f"a building has at most {MOST_PARTS} rooms and as many doors"
        yield first.mistake(what, "Draw fewer of them.")
    elif needed > MOST_MEMORY * 1e9:
        what = f"to simulate this building takes about {needed / 1e9:.0f} GB of memory"
        hint = f"Draw fewer cells, floors or doors: at most {MOST_MEMORY:.0f} GB."
        yield first.mistake(what, hint)


# -- One floor ----------------------------------------------------------------------


def _outer_wall(building: Building, drawing: Drawing) -> Iterator[Mistake]:
    """Floor beside the outside; or a blank between two walls, meant as a third."""
    signs = _rimmed(building, drawing)
    room, outside = is_room(signs), signs == " "
    wall = ~(outside | room)
    between = [np.roll(wall, 1, axis) & np.roll(wall, -1, axis) for axis in (0, 1)]
    gap = outside & ndimage.binary_dilation(room) & (between[0] | between[1])
    hole = room & ndimage.binary_dilation(outside & ~gap)
    for cells in pieces(gap) + pieces(hole):
        hint = "Type '#' here, or 'E' for an exit."
        yield drawing.mistake(cells[0] - 1, "there is a hole in the outer wall", hint)


def _rimmed(building: Building, drawing: Drawing) -> np.ndarray:
    """(rows + 2, cols + 2) characters of a floor, and outside all around it."""
    return np.pad(building.signs[drawing.floor], 1, constant_values=" ")


def _gates(building: Building, drawing: Drawing) -> Iterator[Mistake]:
    """Doors, entrances and exits that join nothing, or the wrong things."""
    outside = ndimage.binary_dilation(_rimmed(building, drawing) == " ")[1:-1, 1:-1]
    for gate in building.landmarks:
        if gate.floor == drawing.floor:
            leads_outside = bool(outside[*gate.cells.T].any())
            if wrong := _wrong(building, gate, leads_outside):
                yield drawing.mistake(gate.cells[0], *wrong)


def _wrong(
    building: Building, gate: Landmark, leads_outside: bool
) -> tuple[str, str] | None:
    """What is wrong with a gate, and what to do."""
    kinds = [building.area_of[side].kind for side in gate.sides if side != OUTSIDE]
    rooms, stairs = kinds.count("room"), kinds.count("stairwell")
    if gate.kind is not Kind.EXIT and leads_outside:
        return "this door leads outside", "Type 'E' for an exit, or '#' for a wall."
    if gate.kind is not Kind.EXIT and (stairs > 1 or rooms < 2 - stairs or not rooms):
        what = "this door leads nowhere: it joins two rooms, or a room and a stairwell"
        return what, "Put it in the wall between the two, or type '#' here."
    if gate.kind is Kind.EXIT and not (leads_outside and rooms):
        what = "this exit does not lead from a room to the outside"
        return what, "Put it in the outer wall of a room, or type '+' for a door."
    return None


def _stairwells(building: Building, drawing: Drawing) -> Iterator[Mistake]:
    signs = _rimmed(building, drawing)
    for letter in STAIRWELLS:
        name, parts = f"stairwell {letter}", pieces(signs == letter)
        for part in parts[1:]:
            hint = "Join the parts, or give this one another letter."
            yield drawing.mistake(part[0] - 1, f"{name} is in two parts", hint)
        for part in parts[:1]:
            mine = signs == letter
            unclosed = ~mine & (signs != "#") & (signs != "+")
            openings = np.argwhere(mine & ndimage.binary_dilation(unclosed)) - 1
            if len(openings):
                hint = f"Draw '#' and a '+' around it, fill its room with '{letter}'"
                hint += ", or type '+' for a door."
                yield drawing.mistake(openings[0], f"{name} is open here", hint)
            elif "+" not in signs[ndimage.binary_dilation(mine)]:
                what = f"{name} has no entrance on floor {drawing.floor + 1}"
                hint = "Type '+' in its wall, where a room is behind it."
                yield drawing.mistake(part[0] - 1, what, hint)


def _rooms(building: Building, drawing: Drawing) -> Iterator[Mistake]:
    """A floor without a room, a second name in one room, or one name in two."""
    if not building.rooms(drawing.floor):
        what = f"no room is drawn on floor {drawing.floor + 1}"
        hint = "Draw its floor with '.' between the walls."
        yield drawing.heading.mistake(what, hint)
    names: dict[int, str] = {}  # of rooms by their index
    for row, text in enumerate(building.plan.storeys[drawing.floor].rows):
        for word in re.finditer("[a-z][a-z0-9]*", text):
            cell, name = (row, word.start()), word[0]
            room = int(building.area[drawing.floor, *cell])
            if room in names:
                what = f"'{name:.80}' is a second name in room '{names[room]:.80}'"
                hint = "Keep one word on one row, or draw a wall between the two."
                yield drawing.mistake(cell, what, hint)
            elif name in names.values():
                what = f"two rooms on floor {drawing.floor + 1} are called '{name:.80}'"
                yield drawing.mistake(cell, what, "Write another name here.")
            names.setdefault(room, name)


# -- Between floors -----------------------------------------------------------------


def _some_exit(building: Building, page: Page) -> Iterator[Mistake]:
    if not building.exits:
        hint = "Type 'E' in the outer wall of a room on floor 1."
        yield page.drawings[0].heading.mistake("the building has no exit", hint)


def _shafts(building: Building, page: Page) -> Iterator[Mistake]:
    for well in building.stairwells:
        name = f"stairwell {well.letter}"
        cells = {floor + 1: building.areas[i].cells for floor, i in well.areas.items()}
        if len(cells) == 1:
            ((floor, (first, *_)),) = cells.items()
            hint = "Draw it on the next floor as well, or take it out."
            what = f"{name} is on floor {floor} only"
            yield page.drawing_of(floor).mistake(first, what, hint)
        for lower, upper in pairwise(cells):
            if upper > lower + 1:
                what = f"{name} goes from floor {lower} to floor {upper}"
                hint = f"Draw it on floor {lower + 1} too, or use another letter here."
            elif not np.array_equal(cells[lower], cells[upper]):
                what = f"{name} is not above itself on floor {lower}"
                hint = "Draw it in the same rows and columns as there."
            else:
                continue
            yield page.drawing_of(upper).mistake(cells[upper][0], what, hint)


def _ways_out(building: Building, page: Page) -> Iterator[Mistake]:
    """Find rooms without a way to an exit; those that are joined are told once."""
    ways = building.ways
    lost = ways.subgraph(set(ways) - nx.ancestors(ways, OUTSIDE) - {OUTSIDE})
    for part in nx.weakly_connected_components(lost):
        room = next(a for a in building.areas if a.id in part and a.kind == "room")
        what = f"no way leads from room '{room.name:.80}' to an exit"
        hint = "Type '+' in a wall, or 'E', or draw stairs down: nobody walks up."
        yield page.drawing_of(room.floor + 1).mistake(room.cells[0], what, hint)


# -- What is no mistake, and rarely meant -------------------------------------------


def touching(building: Building) -> Iterator[tuple[Area, Area]]:
    """Find rooms that touch at a corner only, where people see but cannot pass."""
    for area, kind in zip(building.area, building.kind, strict=True):
        for here, what in ((area, kind), (area[:, ::-1], kind[:, ::-1])):
            first, second = here[:-1, :-1], here[1:, 1:]
            walls = (what[1:, :-1] == Kind.WALL) & (what[:-1, 1:] == Kind.WALL)
            found = walls & (first != second) & (np.minimum(first, second) >= 0)
            for pair in zip(first[found], second[found], strict=True):
                yield building.areas[pair[0]], building.areas[pair[1]]
