"""Check what is drawn: rooms, doors and stairwells of a floor, ways between floors.

Clauses: A1, A2 (rooms, doors), A3 (stairwells, entrances), A4 (exits).  A check goes
through a building, or one floor of it, and yields what it finds; STAGES orders them.
"""

import re
from collections.abc import Callable, Iterable, Iterator
from itertools import pairwise

import networkx as nx
import numpy as np
from scipy import ndimage

from reference.building import (
    OUTSIDE,
    Area,
    Building,
    Kind,
    is_room,
    pieces,
    signs_of,
)
from reference.floorplan import STAIRWELLS, Plan
from reference.workshop.maps.mistakes import Mistake
from reference.workshop.maps.page import Drawing, Page

# -- Stage 4: one floor -------------------------------------------------------------

MOST_PARTS = 5_000  # [A1, chosen] a hundred times the paper's
WALL = "Type '#' here."


def parts(plan: Plan, page: Page) -> Iterator[Mistake]:
    """Refuse more rooms or doors than can be told apart, before they are found."""
    signs = signs_of(plan)

    def count(mask: np.ndarray) -> int:
        return sum(ndimage.label(floor)[1] for floor in mask)

    areas = count(is_room(signs)) + sum(count(signs == well) for well in STAIRWELLS)
    if max(areas, count(signs == "+") + count(signs == "E")) > MOST_PARTS:
        what = f"a building has at most {MOST_PARTS} rooms and as many doors"
        yield page.drawings[0].heading.mistake(what, "Draw fewer of them.")


def _outer_wall(building: Building, drawing: Drawing) -> Iterator[Mistake]:
    signs = _rimmed(building, drawing)
    gap, hole = _holes(signs)
    for cells in pieces(gap) + pieces(hole):
        what = "there is a hole in the outer wall"
        small = (signs[tuple(cells.T)] == "e").all()
        hint = "Type 'E' for an exit, or '#' for a wall." if small else WALL
        yield drawing.mistake(cells[0] - 1, what, hint)


def _holes(signs: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Where blanks, and where floor, stand in the place of an outer wall."""
    room, outside = is_room(signs), signs == " "
    wall = ~(outside | room)
    gap = outside & _between(wall) & ndimage.binary_dilation(room)
    return gap, room & ndimage.binary_dilation(outside & ~gap)


def _rimmed(building: Building, drawing: Drawing) -> np.ndarray:
    """(rows + 2, cols + 2) characters of a floor, and outside all around it."""
    return np.pad(building.signs[drawing.floor], 1, constant_values=" ")


def _between(wall: np.ndarray) -> np.ndarray:
    """Cells with wall on two opposite sides: a blank there was meant as wall."""
    both = [np.roll(wall, 1, axis) & np.roll(wall, -1, axis) for axis in (0, 1)]
    return both[0] | both[1]


def _doors(building: Building, drawing: Drawing) -> Iterator[Mistake]:
    outside = _beside_outside(building, drawing)
    doors = (mark for mark in building.landmarks if mark.kind is not Kind.EXIT)
    for door in (mark for mark in doors if mark.floor == drawing.floor):
        sides = [building.area_of[side] for side in door.sides]
        stairs = sum(side.kind == "stairwell" for side in sides)
        if outside[tuple(door.cells.T)].any():
            hint = "Type 'E' for an exit, or '#' for a wall."
            yield drawing.mistake(door.cells[0], "this door leads outside", hint)
        elif len(sides) < 2 or stairs == len(sides):
            beside = f"only {_called(sides[0])}" if len(sides) == 1 else "no room"
            what = f"this door leads nowhere: {beside} is beside it"
            hint = "Put it in the wall between two rooms, or type '#' here."
            yield drawing.mistake(door.cells[0], what, hint)
        elif stairs > 1:
            what = "this entrance belongs to two stairwells"
            hint = "Type '#' here, and a '+' in a wall of each."
            yield drawing.mistake(door.cells[0], what, hint)


def _beside_outside(building: Building, drawing: Drawing) -> np.ndarray:
    """(rows, cols) bool: is a blank beside a cell, or the edge of the drawing?"""
    return ndimage.binary_dilation(_rimmed(building, drawing) == " ")[1:-1, 1:-1]


def _exits(building: Building, drawing: Drawing) -> Iterator[Mistake]:
    outside = _beside_outside(building, drawing)
    exits = (building.landmarks[mark] for mark in sorted(building.exits))
    for gate in (mark for mark in exits if mark.floor == drawing.floor):
        if not outside[tuple(gate.cells.T)].any():
            what = "this exit does not lead outside"
            hint = "Put it in the outer wall, or type '+' for a door."
            yield drawing.mistake(gate.cells[0], what, hint)
        elif gate.sides == (OUTSIDE,):
            hint = "Put it in the outer wall of a room, or type '#' here."
            yield drawing.mistake(gate.cells[0], "this exit leads out of no room", hint)


def _stairwells(building: Building, drawing: Drawing) -> Iterator[Mistake]:
    seen: set[str] = set()
    signs = _rimmed(building, drawing)
    for well in _here(building, drawing, "stairwell"):
        if well.name in seen:
            hint = "Join the parts, or give this one another letter."
            what = f"{_called(well)} is in two parts"
            yield drawing.mistake(well.cells[0], what, hint)
            continue
        seen.add(well.name)
        around = ndimage.binary_dilation(signs == well.name)
        if (opening := _opening(signs, well.name, around)) is not None:
            cell = np.clip(opening - 1, 0, np.array(building.signs.shape[1:]) - 1)
            sign = str(signs[tuple(opening)])
            other = {" ": "the outside", "E": "an exit"}.get(sign)
            other = other or _called(_area_at(building, drawing, cell))
            what = f"{_called(well)} is open to {other}"
            hint = _closing(signs, well, around)
            yield drawing.mistake(cell, what, hint if is_room(np.array(sign)) else WALL)
        elif "+" not in signs[around]:
            hint = "Type '+' in its wall, where a room is behind it."
            what = f"{_called(well)} has no entrance on {drawing.label}"
            yield drawing.mistake(well.cells[0], what, hint)


def _closing(signs: np.ndarray, well: Area, around: np.ndarray) -> str:
    """Advise somebody who drew a stairwell that is open to a room."""
    beside = around & (signs != well.name)
    if well.size == 1 and len(pieces(beside & is_room(signs))) > 1:
        return f"Type '+' for a door in the place of '{well.name}'."
    if is_room(signs[beside]).all():
        return f"Draw walls around it, or fill its room with '{well.name}'."
    return "Type '#' here, or '+' for an entrance."


def _opening(signs: np.ndarray, letter: str, around: np.ndarray) -> np.ndarray | None:
    """Find the first cell where nothing separates a stairwell from what is around it.

    Two stairwells side by side are reported once, at the first letter.
    """
    closed = letter + "#+" + STAIRWELLS[: STAIRWELLS.index(letter)]
    found = np.argwhere(around & ~np.isin(signs, list(closed)))
    return found[0] if len(found) else None


def _names(building: Building, drawing: Drawing) -> Iterator[Mistake]:
    seen: set[str] = set()
    hole = _holes(_rimmed(building, drawing))[1][1:-1, 1:-1]
    for room in _here(building, drawing, "room"):
        (name, cell), *others = _words(building, room)
        others = [(word, place) for word, place in others if not hole[*place]]
        hint = "Keep one word on one row, or draw a wall between the two."
        hint = _as_stairs(building, room) or hint
        for other, place in others:
            what = f"'{other}' is a second name in {_called(room)}"
            yield drawing.mistake(place, what, hint)
        if name in seen:
            what = f"two rooms on {drawing.label} are called '{name}'"
            yield drawing.mistake(cell, what, "Write another name here.")
        seen.add(name)


def _some_room(building: Building, drawing: Drawing) -> Iterator[Mistake]:
    if not _here(building, drawing, "room"):
        hint = "Draw its floor with '.' between the walls."
        what = f"no room is drawn on {drawing.label}"
        yield drawing.heading.mistake(what, hint)


# -- Areas and their names ----------------------------------------------------------


def _here(building: Building, drawing: Drawing, kind: str) -> list[Area]:
    """Rooms or stairwells on the floor of a drawing."""
    floor = drawing.floor
    return [a for a in building.areas if a.floor == floor and a.kind == kind]


def _area_at(building: Building, drawing: Drawing, cell: np.ndarray) -> Area:
    return building.areas[building.area[drawing.floor, *cell]]


def _called(area: Area) -> str:
    if area.kind == "stairwell":
        return f"stairwell {area.name}"
    return "an unnamed room" if "-" in area.name else f"the room '{area.name}'"


def _words(building: Building, room: Area) -> list[tuple[str, Iterable[int]]]:
    """The names on the floor of a room, and where; else its own and its first cell."""
    rows = building.plan.storeys[room.floor].rows
    found: list[tuple[str, Iterable[int]]] = []
    for row in np.unique(room.cells[:, 0]).tolist():
        mine = set(room.cells[room.cells[:, 0] == row, 1].tolist())
        words = re.finditer("[a-z][a-z0-9]*", rows[row])
        found += [(w[0], (row, w.start())) for w in words if w.start() in mine]
    return found or [(room.name, room.cells[0])]


def _as_stairs(building: Building, room: Area) -> str:
    """A hint at capitals for a room that is full of a stairwell's small letter."""
    letter = room.name[0]
    signs = building.signs[room.floor, *room.cells.T]
    if letter.upper() not in STAIRWELLS or (signs != letter).any():
        return ""
    return f"Write '{room.name.upper()}' if this is a stairwell."


# -- Stage 5: the graph of rooms ----------------------------------------------------


def _ways_off(building: Building, page: Page) -> Iterator[Mistake]:
    """Find rooms without a way to an exit or a stairwell, on floors that have any."""
    graph = building.graph
    floors, kinds = graph.nodes(data="floor"), graph.nodes(data="kind")
    for floor in range(building.floors):
        here = graph.subgraph([node for node, n in floors if n in (floor, None)])
        some = [part for part in nx.connected_components(here) if part != {OUTSIDE}]
        shut = [part for part in some if all(kinds[node] == "room" for node in part)]
        for part in shut if len(shut) < len(some) else []:  # else see `_ways_out`
            hint = "Type '+' in its wall, towards a room with a way out."
            yield _in_first_room(building, page, part, "nobody can leave {}", hint)


def _ways_out(building: Building, page: Page) -> Iterator[Mistake]:
    """Find rooms without a way to an exit: people only walk down."""
    ways = building.ways
    lost = ways.subgraph(set(ways) - nx.ancestors(ways, OUTSIDE) - {OUTSIDE})
    for part in nx.weakly_connected_components(lost):
        hint = "Type 'E' in an outer wall here, or draw stairs down: nobody walks up."
        what = "no way leads from {} to an exit"
        yield _in_first_room(building, page, part, what, hint)


def _in_first_room(
    building: Building, page: Page, part: set[str], what: str, hint: str
) -> Mistake:
    """A mistake in the first of some rooms; one that looks like stairs comes first."""
    rooms = [a for a in building.areas if a.id in part and a.kind == "room"]
    room = min(rooms, key=lambda room: not _as_stairs(building, room))
    cell, stairs = _words(building, room)[0][1], _as_stairs(building, room)
    drawing = page.drawing_of(room.floor + 1)
    return drawing.mistake(cell, what.format(_called(room)), stairs or hint)


def _some_exit(building: Building, page: Page) -> Iterator[Mistake]:
    if not building.exits:
        hint = "Type 'E' in the outer wall of a room on floor 1."
        yield page.drawings[0].heading.mistake("the building has no exit", hint)


def _shafts(building: Building, page: Page) -> Iterator[Mistake]:
    for well in building.stairwells:
        letter, mine = well.letter, [floor + 1 for floor in well.areas]
        cells = {n: np.argwhere(building.signs[n - 1] == letter) for n in mine}
        if len(mine) == 1:
            what = f"stairwell {letter} is on floor {mine[0]} only"
            hint = "Draw it on the next floor as well, or take it out."
            here = building.signs[:, *cells[mine[0]].T] == letter.lower()
            for floor in np.flatnonzero(here.all(axis=1)) + 1:
                hint = f"Write '{letter}' for '{letter.lower()}' on floor {floor} too."
            yield page.drawing_of(mine[0]).mistake(cells[mine[0]][0], what, hint)
        for lower, upper in pairwise(mine):
            below, above, drawing = cells[lower], cells[upper], page.drawing_of(upper)
            if upper > lower + 1:
                what = f"stairwell {letter} goes from floor {lower} to floor {upper}"
                hint = f"Draw it on floor {lower + 1} too, or use another letter here."
                yield drawing.mistake(above[0], what, hint)
            elif not np.array_equal(below, above):
                (top, left), (bottom, right) = below.min(axis=0), below.max(axis=0)
                where = f"row {top + 1}, column {left + 1} to "
                where += f"row {bottom + 1}, column {right + 1}"
                what = f"stairwell {letter} is not above itself on floor {lower}"
                yield drawing.mistake(above[0], what, f"Draw it as there: {where}.")


MOST_MEMORY = 4.0  # [A1, chosen] GB, of which the paper's building takes 0.04
CELL_BYTES, DOOR_BYTES = 6_500, 12
"""Of the tables of ways and sight: a cell's own, and a door's for each cell of its
floor; a byte more for each cell and door. Measured with sight of 5 m."""


def _memory(building: Building, page: Page) -> Iterator[Mistake]:
    """Refuse a building whose tables would not fit."""
    cells, doors = building.kind.size, len(building.landmarks)
    needed = cells * (CELL_BYTES + doors) + building.kind[0].size * doors * DOOR_BYTES
    if needed > MOST_MEMORY * 1e9:
        what = f"to simulate this building takes about {needed / 1e9:.0f} GB of memory"
        hint = f"Draw fewer cells, floors or doors: at most {MOST_MEMORY:.0f} GB."
        yield page.drawings[0].heading.mistake(what, hint)


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
    (_on_each(_outer_wall, _doors, _exits, _stairwells, _names, _some_room),),
    (_ways_off,),
    (_some_exit, _shafts),
    (_ways_out,),
    (_memory,),
)
"""Ways are checked only once all before them is right: else one missing entrance would
be reported as many rooms that nobody can leave."""
