"""Check what is drawn: rooms, doors and stairwells of a floor, ways between floors.

Clauses: A1, A2 (rooms, doors), A3 (stairwells, entrances), A4 (exits).  A check goes
through a building, or one floor of it, and yields what it finds; STAGES orders them.
"""

import re
from collections.abc import Callable, Iterator
from itertools import pairwise

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
from reference.floorplan import Plan
from reference.workshop.maps.mistakes import Mistake
from reference.workshop.maps.page import Drawing, Page

# -- What is too large --------------------------------------------------------------

MOST_PARTS = 5_000  # [A1, chosen] a hundred times the paper's
MOST_MEMORY = 4.0  # [A1, chosen] GB, of which the paper's building takes 0.04
CELL_BYTES, DOOR_BYTES = 6_500, 12
"""Of the tables of ways and sight: a cell's own, and a door's for each cell of its
floor; a byte more for each cell and door. Measured with sight of 5 m."""


def too_large(plan: Plan, page: Page) -> Iterator[Mistake]:
    """Refuse what takes too long or does not fit, before its rooms are found."""
    signs = signs_of(plan)
    gates = (signs == "+") | (signs == "E")
    doors, rooms = _count(gates), _count(~gates & (signs != "#") & (signs != " "))
    needed = signs.size * (CELL_BYTES + doors) + signs[0].size * doors * DOOR_BYTES
    what = f"to simulate this building takes about {needed / 1e9:.0f} GB of memory"
    hint = f"Draw fewer cells, floors or doors: at most {MOST_MEMORY:.0f} GB."
    if max(doors, rooms) > MOST_PARTS:
        what = f"a building has at most {MOST_PARTS} rooms and as many doors"
        hint = "Draw fewer of them."
    elif needed <= MOST_MEMORY * 1e9:
        return
    yield page.drawings[0].heading.mistake(what, hint)


def _count(mask: np.ndarray) -> int:
    """How many connected parts there are, on all floors."""
    return sum(ndimage.label(floor)[1] for floor in mask)


# -- Stage 4: one floor -------------------------------------------------------------


def _outer_wall(building: Building, drawing: Drawing) -> Iterator[Mistake]:
    """Floor beside the outside; or a blank between two walls, meant as a third."""
    signs = _rimmed(building, drawing)
    room, outside = is_room(signs), signs == " "
    wall = ~(outside | room)
    between = [np.roll(wall, 1, axis) & np.roll(wall, -1, axis) for axis in (0, 1)]
    gap = outside & ndimage.binary_dilation(room) & (between[0] | between[1])
    hole = room & ndimage.binary_dilation(outside & ~gap)
    for cells in pieces(gap) + pieces(hole):
        small = (signs[*cells.T] == "e").all()
        hint = "Type 'E' for an exit, or '#' for a wall." if small else "Type '#' here."
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
            for what, hint in _wrong(building, gate, leads_outside):
                yield drawing.mistake(gate.cells[0], what, hint)


def _wrong(
    building: Building, gate: Landmark, leads_outside: bool
) -> Iterator[tuple[str, str]]:
    kinds = [building.area_of[side].kind for side in gate.sides if side != OUTSIDE]
    rooms, stairs = kinds.count("room"), kinds.count("stairwell")
    if gate.kind is Kind.EXIT:
        if not leads_outside:
            hint = "Put it in the outer wall, or type '+' for a door."
            yield "this exit does not lead outside", hint
        elif not rooms:
            hint = "Put it in the outer wall of a room, or type '#' here."
            yield "this exit leads out of no room", hint
    elif leads_outside:
        hint = "Type 'E' for an exit, or '#' for a wall."
        yield "this door leads outside", hint
    elif rooms < 2 - stairs or stairs > 1 or not rooms:
        what = "this door leads nowhere: it joins two rooms, or a room and a stairwell"
        yield what, "Put it in the wall between the two, or type '#' here."


def _stairwells(building: Building, drawing: Drawing) -> Iterator[Mistake]:
    seen: set[str] = set()
    signs = _rimmed(building, drawing)
    for well in _here(building, drawing, "stairwell"):
        name, mine = f"stairwell {well.name}", signs == well.name
        unclosed = ~mine & (signs != "#") & (signs != "+")
        openings = np.argwhere(mine & ndimage.binary_dilation(unclosed)) - 1
        if well.name in seen:
            hint = "Join the parts, or give this one another letter."
            yield drawing.mistake(well.cells[0], f"{name} is in two parts", hint)
        elif len(openings):
            rooms = pieces(ndimage.binary_dilation(mine) & is_room(signs))
            hint = "Draw walls and a '+' around it, or fill its room"
            hint += f" with '{well.name}'."
            if well.size == 1 and len(rooms) > 1:
                hint = f"Type '+' for a door in the place of '{well.name}'."
            yield drawing.mistake(openings[0], f"{name} is open here", hint)
        elif "+" not in signs[ndimage.binary_dilation(mine)]:
            hint = "Type '+' in its wall, where a room is behind it."
            what = f"{name} has no entrance on floor {drawing.floor + 1}"
            yield drawing.mistake(well.cells[0], what, hint)
        seen.add(well.name)


def _rooms(building: Building, drawing: Drawing) -> Iterator[Mistake]:
    seen: set[str] = set()
    rooms = _here(building, drawing, "room")
    if not rooms:
        what = f"no room is drawn on floor {drawing.floor + 1}"
        hint = "Draw its floor with '.' between the walls."
        yield drawing.heading.mistake(what, hint)
    for room in rooms:
        first, *others = _words(building, room) or [(room.name, *room.cells[0])]
        for other, *cell in others:
            what = f"'{other:.80}' is a second name in {_called(room)}"
            hint = "Keep one word on one row, or draw a wall between the two."
            yield drawing.mistake(cell, what, hint)
        if first[0] in seen:
            what = f"two rooms on floor {drawing.floor + 1} are called '{first[0]:.80}'"
            yield drawing.mistake(first[1:], what, "Write another name here.")
        seen.add(first[0])


def _here(building: Building, drawing: Drawing, kind: str) -> list[Area]:
    """Rooms or stairwells on the floor of a drawing."""
    floor = drawing.floor
    return [a for a in building.areas if a.floor == floor and a.kind == kind]


def _called(room: Area) -> str:
    return "an unnamed room" if "-" in room.name else f"the room '{room.name:.80}'"


def _words(building: Building, room: Area) -> list[tuple[str, int, int]]:
    """The names on the floor of a room, each with its row and column."""
    rows = building.plan.storeys[room.floor].rows
    cells = {(row, col) for row, col in room.cells.tolist()}
    return [
        (word[0], row, word.start())
        for row in sorted({row for row, _ in cells})
        for word in re.finditer("[a-z][a-z0-9]*", rows[row])
        if (row, word.start()) in cells
    ]


# -- Stage 5: between floors --------------------------------------------------------


def _some_exit(building: Building, page: Page) -> Iterator[Mistake]:
    if not building.exits:
        hint = "Type 'E' in the outer wall of a room on floor 1."
        yield page.drawings[0].heading.mistake("the building has no exit", hint)


def _shafts(building: Building, page: Page) -> Iterator[Mistake]:
    for well in building.stairwells:
        name, floors = f"stairwell {well.letter}", [floor + 1 for floor in well.areas]
        cells = {n: building.areas[well.areas[n - 1]].cells for n in floors}
        if len(floors) == 1:
            what = f"{name} is on floor {floors[0]} only"
            hint = "Draw it on the next floor as well, or take it out."
            first = cells[floors[0]][0]
            yield page.drawing_of(floors[0]).mistake(first, what, hint)
        for lower, upper in pairwise(floors):
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
        hint = "Type '+' in a wall, or 'E', or draw stairs down: nobody walks up."
        first = (_words(building, room) or [("", *room.cells[0])])[0]
        drawing = page.drawing_of(room.floor + 1)
        what = f"no way leads from {_called(room)} to an exit"
        yield drawing.mistake(first[1:], what, hint)


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


Check = Callable[[Building, Page], Iterator[Mistake]]


def _on_each(*checks: Callable[[Building, Drawing], Iterator[Mistake]]) -> Check:
    def on_each(building: Building, page: Page) -> Iterator[Mistake]:
        for drawing in page.drawings:
            for check in checks:
                yield from check(building, drawing)

    return on_each


STAGES: tuple[tuple[Check, ...], ...] = (
    (_on_each(_outer_wall),),
    (_on_each(_gates, _stairwells, _rooms),),
    (_some_exit, _shafts),
    (_ways_out,),
)
"""Ways are checked only once all before them is right: else one missing entrance would
be reported as many rooms that nobody can leave."""
