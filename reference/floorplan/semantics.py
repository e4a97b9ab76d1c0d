"""Check what is drawn: rooms, doors and stairwells of a floor, ways between floors.

Clauses: A1, A2 (rooms, doors), A3 (stairwells, entrances), A4 (exits).  A check goes
through a plan, or one storey of it, and yields what it finds; STAGES orders them.
"""

from collections.abc import Callable, Iterator
from itertools import pairwise

import networkx as nx
import numpy as np
from scipy import ndimage

from reference.floorplan.mistakes import Mistake
from reference.floorplan.page import Drawing, Page
from reference.floorplan.plan import OUTSIDE, STAIRWELLS, Part, Plan, Storey, pieces

# -- Stage 4: one floor -------------------------------------------------------------

MOST_PARTS = 5_000  # [A1, chosen] a hundred times the paper's; fits 16-bit indices


def _parts(plan: Plan, page: Page) -> Iterator[Mistake]:
    def parts(sign: str) -> int:
        return sum(ndimage.label(storey.signs == sign)[1] for storey in plan.storeys)

    rooms = sum(ndimage.label(storey.rooms)[1] for storey in plan.storeys)
    if max(rooms + sum(map(parts, STAIRWELLS)), parts("+") + parts("E")) > MOST_PARTS:
        what = f"a building has at most {MOST_PARTS} rooms and as many doors"
        yield page.drawings[0].heading.mistake(what, "Draw fewer of them.")


def _outer_wall(storey: Storey, drawing: Drawing) -> Iterator[Mistake]:
    outside = storey.signs == " "
    wall = ~(outside | storey.rooms)
    gap = outside & _between(wall) & ndimage.binary_dilation(storey.rooms)
    hole = storey.rooms & ndimage.binary_dilation(outside & ~gap)
    for cells in pieces(gap) + pieces(hole):
        what = "there is a hole in the outer wall"
        yield drawing.mistake(cells[0], what, "Type '#' here.")


def _between(wall: np.ndarray) -> np.ndarray:
    """Cells with wall on two opposite sides: a blank there was meant as wall."""
    both = [np.roll(wall, 1, axis) & np.roll(wall, -1, axis) for axis in (0, 1)]
    return both[0] | both[1]


def _doors(storey: Storey, drawing: Drawing) -> Iterator[Mistake]:
    for door in (gate for gate in storey.gates if gate.kind != "exit"):
        if door.outside:
            hint = "Type 'E' for an exit, or '#' for a wall."
            yield drawing.mistake(door.cells[0], "this door leads outside", hint)
        elif len(door.sides) < 2 or all(s.kind == "stairwell" for s in door.sides):
            beside = f"only {door.sides[0]}" if len(door.sides) == 1 else "no room"
            what = f"this door leads nowhere: {beside} is beside it"
            hint = "Put it in the wall between two rooms, or type '#' here."
            yield drawing.mistake(door.cells[0], what, hint)
        elif sum(side.kind == "stairwell" for side in door.sides) > 1:
            what = "this entrance belongs to two stairwells"
            hint = "Type '#' here, and a '+' in a wall of each."
            yield drawing.mistake(door.cells[0], what, hint)


def _exits(storey: Storey, drawing: Drawing) -> Iterator[Mistake]:
    for gate in (gate for gate in storey.gates if gate.kind == "exit"):
        if not gate.outside:
            what = "this exit does not lead outside"
            hint = "Put it in the outer wall, or type '+' for a door."
            yield drawing.mistake(gate.cells[0], what, hint)
        elif not gate.sides:
            hint = "Put it in the outer wall of a room, or type '#' here."
            yield drawing.mistake(gate.cells[0], "this exit leads out of no room", hint)


def _stairwells(storey: Storey, drawing: Drawing) -> Iterator[Mistake]:
    seen: set[str] = set()
    for well in (area for area in storey.areas if area.kind == "stairwell"):
        if well.name in seen:
            hint = "Join the parts, or give this one another letter."
            yield drawing.mistake(well.cells[0], f"{well} is in two parts", hint)
            continue
        seen.add(well.name)
        around = ndimage.binary_dilation(storey.signs == well.name)
        if opening := _opening(storey, well.name, around):
            sign, area = str(storey.signs[opening]), storey.area[opening]
            other = {" ": "the outside", "E": "an exit"}.get(sign)
            what = f"{well} is open to {other or storey.areas[area]}"
            entrance = ", or '+' for an entrance" if storey.rooms[opening] else ""
            last = np.array(storey.signs.shape) - 2
            cell = np.clip(opening, 1, last)
            yield drawing.mistake(cell, what, f"Type '#' here{entrance}.")
        elif "+" not in storey.signs[around]:
            hint = "Type '+' in its wall, where a room is behind it."
            what = f"{well} has no entrance on {drawing.label}"
            yield drawing.mistake(well.cells[0], what, hint)


def _opening(storey: Storey, letter: str, around: np.ndarray) -> tuple[int, ...] | None:
    """Find the first cell where nothing separates a stairwell from what is around it.

    Two stairwells side by side are reported once, at the first letter.
    """
    closed = letter + "#+" + STAIRWELLS[: STAIRWELLS.index(letter)]
    found = np.argwhere(around & ~np.isin(storey.signs, list(closed)))
    return tuple(found[0].tolist()) if len(found) else None


def _names(storey: Storey, drawing: Drawing) -> Iterator[Mistake]:
    seen: set[str] = set()
    for room in (area for area in storey.areas if area.kind == "room"):
        (name, cell), *others = room.words
        hint = "Keep one word on one row, or draw a wall between the two."
        hint = _as_stairs(room) or hint
        for other, place in others:
            what = f"'{other}' is a second name in {room}"
            yield drawing.mistake(place, what, hint)
        if name in seen:
            what = f"two rooms on {drawing.label} are called '{name}'"
            yield drawing.mistake(cell, what, "Write another name here.")
        seen.add(name)


def _some_room(storey: Storey, drawing: Drawing) -> Iterator[Mistake]:
    if not storey.rooms.any():
        hint = "Draw its floor with '.' between the walls."
        what = f"no room is drawn on {drawing.label}"
        yield drawing.heading.mistake(what, hint)


# -- Stage 5: the graph of rooms ----------------------------------------------------


def _ways_off(plan: Plan, page: Page) -> Iterator[Mistake]:
    """Find rooms without a way to an exit or a stairwell, on floors that have any."""
    floors, kinds = plan.graph.nodes(data="floor"), plan.graph.nodes(data="kind")
    for floor in range(len(plan.storeys)):
        here = plan.graph.subgraph([node for node, n in floors if n in (floor, None)])
        parts = [part for part in nx.connected_components(here) if part != {OUTSIDE}]
        shut = [part for part in parts if all(kinds[node] == "room" for node in part)]
        for part in shut if len(shut) < len(parts) else []:  # else see `_ways_out`
            hint = "Type '+' in its wall, towards a room with a way out."
            yield _in_first_room(plan, page, part, "nobody can leave {}", hint)


def _ways_out(plan: Plan, page: Page) -> Iterator[Mistake]:
    """Find rooms without a way to an exit: people only walk down."""
    ways = plan.ways
    lost = ways.subgraph(set(ways) - nx.ancestors(ways, OUTSIDE) - {OUTSIDE})
    for part in nx.weakly_connected_components(lost):
        hint = "Type 'E' in an outer wall here, or draw stairs down: nobody walks up."
        yield _in_first_room(plan, page, part, "no way leads from {} to an exit", hint)


def _in_first_room(
    plan: Plan, page: Page, part: set[str], what: str, hint: str
) -> Mistake:
    """A mistake in the first of some rooms; one that looks like stairs comes first."""
    areas = [(n, area) for n, name, area in plan.parts("areas") if name in part]
    rooms = [(n, area) for n, area in areas if area.kind == "room"]
    n, room = min(rooms, key=lambda found: not _as_stairs(found[1]))
    cell, stairs = room.words[0][1], _as_stairs(room)
    return page.drawing_of(n).mistake(cell, what.format(room), stairs or hint)


def _as_stairs(room: Part) -> str:
    """A hint at capitals for a room that is full of a stairwell's small letter."""
    letter = room.name[0]
    full = "".join(word for word, _ in room.words) == letter * len(room.cells)
    if not full or letter.upper() not in STAIRWELLS:
        return ""
    return f"Write '{room.name.upper()}' if this is a stairwell."


def _some_exit(plan: Plan, page: Page) -> Iterator[Mistake]:
    if not plan.graph.degree(OUTSIDE):
        hint = "Type 'E' in the outer wall of a room on floor 1."
        yield page.drawings[0].heading.mistake("the building has no exit", hint)


def _shafts(plan: Plan, page: Page) -> Iterator[Mistake]:
    storeys = list(enumerate(plan.storeys, 1))
    for letter in STAIRWELLS:
        mine = [n for n, _ in storeys if f"{n}/{letter}" in plan.graph]
        cells = {n: np.argwhere(s.signs == letter) for n, s in storeys if n in mine}
        if len(mine) == 1:
            what = f"stairwell {letter} is on floor {mine[0]} only"
            hint = "Draw it on the next floor as well, or take it out."
            small, here = letter.lower(), tuple(cells[mine[0]].T)
            for floor in [n for n, s in storeys if (s.signs[here] == small).all()]:
                hint = f"Write '{letter}' for '{small}' on floor {floor} too."
            yield page.drawing_of(mine[0]).mistake(cells[mine[0]][0], what, hint)
        for lower, upper in pairwise(mine):
            below, above, drawing = cells[lower], cells[upper], page.drawing_of(upper)
            if upper > lower + 1:
                what = f"stairwell {letter} goes from floor {lower} to floor {upper}"
                hint = f"Draw it on floor {lower + 1} too, or use another letter here."
                yield drawing.mistake(above[0], what, hint)
            elif not np.array_equal(below, above):
                (top, left), (bottom, right) = below.min(axis=0), below.max(axis=0)
                where = f"row {top}, column {left} to row {bottom}, column {right}"
                what = f"stairwell {letter} is not above itself on floor {lower}"
                yield drawing.mistake(above[0], what, f"Draw it as there: {where}.")


Check = Callable[[Plan, Page], Iterator[Mistake]]


def _on_each(*checks: Callable[[Storey, Drawing], Iterator[Mistake]]) -> Check:
    def on_each(plan: Plan, page: Page) -> Iterator[Mistake]:
        for drawing in page.drawings:
            for check in checks:
                yield from check(plan.storeys[drawing.numbers[0] - 1], drawing)

    return on_each


STAGES: tuple[tuple[Check, ...], ...] = (
    (_parts,),
    (_on_each(_outer_wall, _doors, _exits, _stairwells, _names, _some_room),),
    (_ways_off,),
    (_some_exit, _shafts),
    (_ways_out,),
)
"""Ways are checked only once all before them is right: else one missing entrance would
be reported as many rooms that nobody can leave."""
