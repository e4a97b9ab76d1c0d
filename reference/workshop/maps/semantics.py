"""Check what is drawn: rooms, doors and stairwells of a floor, ways between floors.

A check goes through a building, or one floor of it, and yields what it finds;
`semantic_stages` orders them.
"""

import re
from collections.abc import Collection, Iterable, Iterator, Sequence
from functools import cache, partial
from itertools import chain, groupby, pairwise
from operator import itemgetter
from typing import Any, NamedTuple

import networkx as nx
import numpy as np
from scipy import ndimage

from reference.building import (
    OUTSIDE,
    Building,
    Kind,
    Landmark,
    build,
    connected_parts,
    is_room,
    signs_of,
)
from reference.floorplan import STAIRWELLS, Drawing
from reference.workshop.maps.mistakes import Edit, Mistake
from reference.workshop.maps.pages import Floor, Page

Gaps = dict[tuple[int, int], Any]
"""Row and column of the gap between two parts of rooms, by their numbers."""


def semantic_stages(drawing: Drawing, page: Page) -> Iterator[Iterable[Mistake]]:
    """Yield what each stage of checks finds, once the stages before find nothing.

    Ways come last: else one missing entrance shows as many rooms without a way out.
    """
    yield _too_large(drawing, page)
    building = build(drawing)
    yield _askew(building, page)
    yield chain.from_iterable(_outer_wall(building, floor) for floor in page.floors)
    yield chain.from_iterable(_gates(building, floor) for floor in page.floors)
    yield _drawn_on_floors(building, page)
    yield _shafts(building, page)
    yield _ways_out(building, page)


def _drawn_on_floors(building: Building, page: Page) -> Iterator[Mistake]:
    """Check stairwells and rooms, floor by floor."""
    if not building.exits:
        yield _no_exit(building, page.floors[0])
    for floor in page.floors:
        yield from _stairwells(building, floor)
        yield from _rooms(building, floor)


def _no_exit(building: Building, floor: Floor) -> Mistake:
    """Make the mistake of a building without exit; one fits into floor 1's wall."""
    cell = _outer_place(building, floor, {area.id for area in building.rooms(0)})
    if cell is None:
        return floor.heading.mistake("no-exit-anywhere")
    edits = floor.typed("E", [cell])
    return floor.heading.mistake("no-exit", place=_place(floor, cell), edits=edits)


def _outer_place(
    building: Building, floor: Floor, rooms: Collection[str]
) -> np.ndarray | None:
    """A place for an exit of one of these rooms: in the middle of those that fit."""
    signs = _rimmed(building, floor)
    index = [building.area_of[room].index for room in rooms]
    area = np.pad(building.area[floor.index], 1, constant_values=-1)
    room = np.isin(area, index)
    places = []
    for step, axis in ((1, 0), (-1, 0), (1, 1), (-1, 1)):
        outside = np.roll(signs == " ", -step, axis)
        places += [*np.argwhere((signs == "#") & np.roll(room, step, axis) & outside)]
    return places[len(places) // 2] - 1 if places else None


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
    """Find room cells that touch the outside, and blanks that are gaps in a wall."""
    signs = _rimmed(building, floor)
    room = is_room(signs)
    outside = signs == " "
    wall = ~(outside | room)

    above_and_below = np.roll(wall, 1, 0) & np.roll(wall, -1, 0)
    left_and_right = np.roll(wall, 1, 1) & np.roll(wall, -1, 1)
    between_walls = above_and_below | left_and_right

    gap = outside & ndimage.binary_dilation(room) & between_walls
    hole = room & ndimage.binary_dilation(outside & ~gap)  # told once, at the gap
    no_exit = not building.exits and floor.index == 0
    for cells in connected_parts(gap) + connected_parts(hole):
        here = cells - 1  # without the rim
        if _letters_in(floor, here) >= MOST_LETTERS:
            yield floor.mistake("hole-name", here[0])
            continue
        sign = "E" if no_exit and _fits_exit(signs, cells) else "#"
        kind = "hole-exit" if sign == "E" else "hole"
        yield floor.mistake(kind, here[0], edits=floor.typed(sign, here))


MOST_LETTERS = 3  # in a hole: so much of a name is no wall that was forgotten


def _letters_in(floor: Floor, cells: np.ndarray) -> int:
    """Count the letters of rooms' names that are drawn in these cells."""
    drawn = [floor.rows[row].code[column : column + 1] for row, column in cells]
    return sum(sign.islower() for sign in drawn)


WIDEST_EXIT = 6  # metres of a hole that may have been meant as one


def _fits_exit(signs: np.ndarray, cells: np.ndarray) -> bool:
    """Whether a hole is a piece of the wall between a room and the outside."""
    straight = len({*cells[:, 0].tolist()}) == 1 or len({*cells[:, 1].tolist()}) == 1
    here = _mask(signs, cells)
    beside = ndimage.binary_dilation(here) & ~here
    room = bool(is_room(signs)[beside].any())
    return straight and len(cells) <= WIDEST_EXIT and room


def _rimmed(building: Building, floor: Floor) -> np.ndarray:
    """Surround a floor with outside: (rows + 2, columns + 2) characters."""
    return np.pad(building.signs[floor.index], 1, constant_values=" ")


def _gates(building: Building, floor: Floor) -> Iterator[Mistake]:
    """Find doors, entrances and exits that join nothing, or the wrong things."""
    outside = ndimage.binary_dilation(_rimmed(building, floor) == " ")[1:-1, 1:-1]
    find_gaps = cache(partial(_gaps, building.signs[floor.index]))
    for gate in building.landmarks:
        if gate.floor != floor.index:
            continue
        leads_outside = bool(outside[*gate.cells.T].any())
        wrong = _wrong(building, gate, leads_outside)
        gap = None
        if wrong == "door-nowhere" and len(gate.sides) == 1:
            gap = _gap_beside(gate, *find_gaps())
        if gap:
            edits = floor.typed("#", [gap])
            place = _place(floor, np.array(gap))
            yield floor.mistake("door-gap", gate.cells[0], edits=edits, place=place)
        elif wrong:
            sign = _instead(building, gate, wrong)
            edits = floor.typed(sign, gate.cells)
            kind = f"{wrong}-plain" if (wrong, sign) in _PLAIN_FIRST else wrong
            yield floor.mistake(kind, gate.cells[0], edits=edits, plain=sign)


_PLAIN_FIRST = [("door-outside", "#"), ("exit-indoors", "#"), ("exit-indoors", ".")]


def _gap_beside(gate: Landmark, parts: np.ndarray, gaps: Gaps) -> Any:
    """The gap that joins what lies on opposite sides of a door; None if there is none.

    parts, gaps: see `_gaps`
    """
    for row, column in gate.cells.tolist():
        for down, right in ((1, 0), (0, 1)):
            one = int(parts[row - down, column - right])
            other = int(parts[row + down, column + right])
            if gaps.get((one, other)):
                return gaps[one, other]
    return None


def _wrong(building: Building, gate: Landmark, leads_outside: bool) -> str:
    """Name the mistake in a gate; "" if there is none."""
    kinds = _kinds_beside(building, gate)
    if gate.kind is Kind.EXIT:
        if not leads_outside:
            return "exit-indoors"
        return "" if "room" in kinds else "exit-corner"
    if leads_outside:
        return "door-outside"
    return "" if "room" in kinds and len(kinds) == 2 else "door-nowhere"


def _instead(building: Building, gate: Landmark, wrong: str) -> str:
    """What to type for a gate that is wrong: another gate, if it is one; else a wall.

    In the open it is floor.
    """
    kinds = _kinds_beside(building, gate)
    if wrong == "exit-indoors" and "room" in kinds and len(kinds) == 2:
        return "+"
    if wrong == "door-outside" and kinds == ["room"] and gate.floor == 0:
        return "E"
    indoors = wrong in ("door-nowhere", "exit-indoors")
    return "." if indoors and _is_in_the_open(building, gate) else "#"


def _is_in_the_open(building: Building, gate: Landmark) -> bool:
    """Whether a gate has one room around it, and no wall at two opposite sides."""
    low = gate.cells.min(axis=0)
    high = gate.cells.max(axis=0)
    here = building.area[gate.floor][low[0] - 1 : high[0] + 2, low[1] - 1 : high[1] + 2]
    rooms = np.unique(here[here >= 0])
    above, below = (here[row, 1:-1] < 0 for row in (0, -1))
    left, right = (here[1:-1, column] < 0 for column in (0, -1))
    ends = (above & below).any() or (left & right).any()
    return len(rooms) == 1 and not ends


def _kinds_beside(building: Building, gate: Landmark) -> list[str]:
    """List the kinds of areas at the sides of a gate, but for the outside."""
    return [building.area_of[side].kind for side in gate.sides if side != OUTSIDE]


def _stairwells(building: Building, floor: Floor) -> Iterator[Mistake]:
    """Find stairwells in two parts, open to something else, or without entrance."""
    signs = _rimmed(building, floor)
    for letter in STAIRWELLS:
        parts = sorted(connected_parts(signs == letter), key=len, reverse=True)
        stray = [part for part in parts if _is_stray(signs, part, parts)]
        for part in stray:
            cell = part[0] - 1
            beside = signs[ndimage.binary_dilation(_mask(signs, part))]
            facts = {"letter": letter, "plain": "#" if " " in beside else "."}
            edits = floor.typed(facts["plain"], [cell])
            yield floor.mistake("stairwell-stray", cell, edits=edits, **facts)
        if stray:
            continue
        for part in parts[1:]:
            sign, cells = _joined(signs, letter, parts[0], part)
            edits = floor.typed(sign, cells)
            cell = part[0] - 1
            yield floor.mistake("stairwell-split", cell, letter=letter, edits=edits)
        if parts:
            yield from _around_stairwell(floor, signs, letter)


def _is_stray(signs: np.ndarray, part: np.ndarray, parts: Sequence[np.ndarray]) -> bool:
    """Whether a letter stands alone in a room, or in one beside a larger part."""
    here = _mask(signs, part)
    beside = ndimage.binary_dilation(here) & ~here
    open_sides = int(is_room(signs)[beside].sum())
    least = 1 if len(parts[0]) > 1 else 2
    return len(part) == 1 and open_sides >= least


def _around_stairwell(
    floor: Floor, signs: np.ndarray, letter: str
) -> Iterator[Mistake]:
    """Find another stairwell beside this one, no wall around it, or no entrance."""
    mine = signs == letter
    around = ndimage.binary_dilation(mine)
    unclosed = ~mine & (signs != "#") & (signs != "+")
    openings = np.argwhere(mine & ndimage.binary_dilation(unclosed))
    others = [other for other in STAIRWELLS if other in signs[around & unclosed]]
    facts: dict[str, Any] = {"letter": letter}
    if others:
        loser, winner = _merged(signs, letter, others[0])
        edits = floor.typed(winner, np.argwhere(signs == loser) - 1)
        facts |= {"other": others[0], "one": winner}
        yield floor.mistake("stairwell-beside", openings[0] - 1, edits=edits, **facts)
    elif len(openings):
        edits = _closed(floor, signs, mine, unclosed)
        yield floor.mistake("stairwell-open", openings[0] - 1, edits=edits, **facts)
    elif "+" not in signs[around]:
        first = np.argwhere(mine)[0] - 1
        cell = _beside_room(signs, mine)
        if cell is None:
            yield floor.mistake("stairwell-enclosed", first, **facts)
        else:
            edits = floor.typed("+", [cell - 1])
            facts["place"] = _place(floor, cell - 1)
            yield floor.mistake("stairwell-closed", first, edits=edits, **facts)


def _merged(signs: np.ndarray, one: str, other: str) -> tuple[str, str]:
    """Of two stairwells side by side, the letter that goes and the one that stays."""
    first, second = sorted((one, other))
    for goes, stays in ((second, first), (first, second)):
        if "+" not in signs[ndimage.binary_dilation(signs == goes)]:
            return goes, stays
    return second, first


def _place(floor: Floor, cell: np.ndarray) -> str:
    """Line and column of a cell, as messages give them."""
    row, column = map(int, cell)
    return f"{floor.rows[row].number}:{column + 1}"


def _joined(
    signs: np.ndarray, letter: str, first: np.ndarray, other: np.ndarray
) -> tuple[str, np.ndarray]:
    """What to type where, for a stairwell in two parts: its letter between, or a wall.

    A part goes whose entrance is not missed.
    """
    box = np.array([*first, *other])
    for axis in (0, 1):
        if len({*box[:, axis].tolist()}) == 1:  # both in one row, or column
            low = min(first[:, 1 - axis].max(), other[:, 1 - axis].max()) + 1
            high = max(first[:, 1 - axis].min(), other[:, 1 - axis].min())
            between = np.full((high - low, 2), box[0, axis])
            between[:, 1 - axis] = np.arange(low, high)
            if (signs[*between.T] == "#").all():
                return letter, between - 1
    free = [sign for sign in STAIRWELLS if not (signs == sign).any()]
    first_entered = "+" in signs[ndimage.binary_dilation(_mask(signs, first))]
    other_entered = "+" in signs[ndimage.binary_dilation(_mask(signs, other))]
    if first_entered and other_entered and free:
        return free[0], other - 1
    return "#", (other if first_entered else first) - 1


def _mask(signs: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """Cells as a mask."""
    mask = np.zeros(signs.shape, bool)
    mask[*cells.T] = True
    return mask


def _closed(
    floor: Floor, signs: np.ndarray, mine: np.ndarray, unclosed: np.ndarray
) -> list[Edit]:
    """Draw a wall around a stairwell, in what is beside it, and one entrance.

    At the edge of the page its own cells become the wall.
    """
    edge = np.pad(np.zeros(np.subtract(signs.shape, 2), bool), 1, constant_values=True)
    lost = mine & ndimage.binary_dilation(edge)
    left = mine & ~lost
    beside = ndimage.binary_dilation(left) & unclosed & ~edge
    around = ndimage.binary_dilation(left)
    needs_entrance = bool(left.any()) and "+" not in signs[around]
    edits = []
    for cell in np.argwhere(lost | beside):
        sign = "#"
        if needs_entrance and beside[*cell] and signs[*cell] not in "E ":
            sign = "+"
            needs_entrance = False
        edits += floor.typed(sign, [cell - 1])
    return edits


def _beside_room(signs: np.ndarray, mine: np.ndarray) -> np.ndarray | None:
    """The first cell of a wall with a stairwell on one side and a room opposite."""
    room = is_room(signs)
    for step, axis in ((1, 0), (-1, 0), (1, 1), (-1, 1)):
        wall = np.roll(mine, step, axis) & np.roll(room, -step, axis) & (signs == "#")
        cells = np.argwhere(wall)
        if len(cells):
            return cells[0]
    return None


def _rooms(building: Building, floor: Floor) -> Iterator[Mistake]:
    """Find a floor without a room, a second name in one room, or one name in two."""
    if not building.rooms(floor.index):
        yield floor.heading.mistake("no-room", floor=floor.index + 1)
    first: dict[int, RoomName] = {}  # of each room by its index
    taken = set[str]()  # the words of these
    find_gaps = cache(partial(_gaps, building.signs[floor.index]))
    rows = building.drawing.storeys[floor.index].rows
    words = set(re.findall("[a-z][a-z0-9]*", " ".join(rows)))
    for row, text in enumerate(rows):
        for word in re.finditer("[a-z][a-z0-9]*", text):
            found = RoomName(word[0], (row, word.start()))
            room = int(building.area[floor.index, *found.cell])
            if room not in first:
                if found.word in taken:
                    other = _other_name(found.word, taken | words)
                    yield _same_name(floor, found, other)
                    found = RoomName(other, found.cell)
            elif len(first[room].word) == 1 < len(found.word):
                yield _slip(floor, first[room], found)
                taken.discard(first[room].word)
            else:
                yield _second_name(floor, first[room], found, find_gaps())
                continue
            first[room] = found
            taken.add(found.word)


class RoomName(NamedTuple):
    """A room's name on its floor, and the row and column where it begins."""

    word: str
    cell: tuple[int, int]

    @property
    def cells(self) -> list[tuple[int, int]]:
        """Row and column of each letter."""
        row, column = self.cell
        return [(row, column + k) for k in range(len(self.word))]


def _slip(floor: Floor, letter: RoomName, name: RoomName) -> Mistake:
    """A lone letter before the room's name goes."""
    facts = {"name": letter.word, "room": name.word}
    edits = floor.typed(".", [letter.cell])
    return floor.mistake("second-name", letter.cell, edits=edits, **facts)


def _second_name(
    floor: Floor, first: RoomName, second: RoomName, gaps: tuple[np.ndarray, Gaps]
) -> Mistake:
    """A second name goes; or a door goes where a gap joins the rooms of both.

    gaps: parts of rooms, and what lies between two of them, see `_gaps`
    """
    facts = {"name": second.word, "room": first.word}
    parts, gap_between = gaps
    gap = gap_between.get((int(parts[*first.cell]), int(parts[*second.cell])))
    if gap:
        edits = floor.typed("+", [gap])
        facts["place"] = _place(floor, np.array(gap))
        return floor.mistake("second-name-gap", second.cell, edits=edits, **facts)
    edits = floor.typed(".", second.cells)
    return floor.mistake("second-name", second.cell, edits=edits, **facts)


def _same_name(floor: Floor, name: RoomName, other: str) -> Mistake:
    """A name that another room has becomes another one."""
    signs = zip(other, name.cells, strict=True)
    edits = [edit for sign, at in signs for edit in floor.typed(sign, [at])]
    facts = {"name": name.word, "other": other}
    return floor.mistake("same-name", name.cell, edits=edits, **facts)


def _gaps(signs: np.ndarray) -> tuple[np.ndarray, Gaps]:
    """Find parts of rooms that one cell alone joins: a gap in a wall, a lost door.

    Returns the number of each cell's part, and the gap by the numbers of two parts.
    """
    room = np.pad(is_room(signs), 1)
    above = np.roll(room, 1, 0)
    below = np.roll(room, -1, 0)
    left = np.roll(room, 1, 1)
    right = np.roll(room, -1, 1)
    across = above & below & ~left & ~right
    along = left & right & ~above & ~below
    parts, _ = ndimage.label(room & ~across & ~along)

    joined = nx.Graph()
    for row, column in np.argwhere(room & (across | along)).tolist():
        down, aside = (1, 0) if across[row, column] else (0, 1)
        one = int(parts[row - down, column - aside])
        other = int(parts[row + down, column + aside])
        if one and other and one != other:
            twice = joined.has_edge(one, other)
            joined.add_edge(one, other, gap=None if twice else (row - 1, column - 1))

    gaps = {}
    for one, other in nx.bridges(joined):
        gaps[one, other] = gaps[other, one] = joined[one][other]["gap"]
    return parts[1:-1, 1:-1], gaps


def _other_name(name: str, taken: Collection[str]) -> str:
    """A name of the same length that no room has: its last sign counts on."""
    for sign in "23456789abcdefghijklmnopqrstuvwxyz":
        if len(name) == 1 and not sign.isalpha():
            continue
        if name[:-1] + sign not in taken:
            return name[:-1] + sign
    return name


# -- Between floors -----------------------------------------------------------------


def _shafts(building: Building, page: Page) -> Iterator[Mistake]:
    """Find stairwells that are on one floor only, or leave one out."""
    for well in building.stairwells:
        if len(well.areas) == 1:
            floor = page.floor_of(well.lowest)
            facts: dict[str, Any] = {"letter": well.letter}
            other = well.lowest + (1 if well.lowest + 1 < building.floors else -1)
            edits = _copied(building, page, well.letter, well.lowest, other)
            kind = "stairwell-alone" if edits else "stairwell-needless"
            edits = edits or _taken_out(building, page, well.letter, well.lowest)
            yield floor.mistake(kind, well.cells[0], edits=edits, **facts)
        for lower, upper in pairwise(well.areas):
            if upper > lower + 1:
                floor = page.floor_of(upper)
                cell = building.areas[well.areas[upper]].cells[0]
                facts = {"letter": well.letter, "lower": lower + 1, "upper": upper + 1}
                edits = _copied(building, page, well.letter, lower, lower + 1)
                yield floor.mistake("stairwell-skips", cell, edits=edits, **facts)


def _askew(building: Building, page: Page) -> Iterator[Mistake]:
    """Find stairwells that stand elsewhere than in most drawings above and below.

    They come first: whatever touches them is wrong, too.
    """
    for letter in STAIRWELLS:
        signs = building.signs
        drawn = [(floor, letter in signs[floor.index]) for floor in page.floors]
        for is_drawn, group in groupby(drawn, itemgetter(1)):
            if is_drawn:
                floors = [floor for floor, _ in group]
                yield from _out_of_line(building, page, letter, floors)


def _out_of_line(
    building: Building, page: Page, letter: str, floors: Sequence[Floor]
) -> Iterator[Mistake]:
    """Compare a stairwell's storeys, one above the other, if each is whole."""
    mine = building.signs == letter
    if not all(_is_whole(building.signs[floor.index], letter) for floor in floors):
        return
    places = [mine[floor.index].tobytes() for floor in floors]
    shaped = [_is_shaped(building, floor, letter) for floor in floors]
    rank = [*zip(map(places.count, places), shaped, strict=True)]
    usual = floors[rank.index(max(rank))].index  # the lowest of those alike
    for floor in floors:
        differs = mine[floor.index] ^ mine[usual]
        if differs.any():
            edits = _copied(building, page, letter, usual, floor.index)
            facts = {"letter": letter, "other": usual + 1}
            cells = np.argwhere(differs & mine[floor.index])
            cell = cells[0] if len(cells) else np.argwhere(differs)[0]
            yield floor.mistake("stairwell-moves", cell, edits=edits, **facts)


def _is_whole(signs: np.ndarray, letter: str) -> bool:
    """Whether a stairwell is in one part, and none with another letter beside it."""
    mine = signs == letter
    beside = signs[ndimage.binary_dilation(mine) & ~mine]
    return len(connected_parts(mine)) == 1 and not np.isin(beside, [*STAIRWELLS]).any()


def _is_shaped(building: Building, floor: Floor, letter: str) -> bool:
    """Whether a stairwell is a rectangle with nothing but walls and doors around it."""
    signs = _rimmed(building, floor)
    mine = signs == letter
    around = ndimage.binary_dilation(mine)
    rows, columns = (np.ptp(axis) + 1 for axis in np.nonzero(mine))
    is_walled = np.isin(signs[around], ["#", "+", letter]).all()
    return bool(is_walled and rows * columns == mine.sum())


def _entrances(signs: np.ndarray, mine: np.ndarray) -> np.ndarray:
    """The mask of the doors beside a stairwell."""
    return ndimage.binary_dilation(mine) & (signs == "+")


def _copied(
    building: Building, page: Page, letter: str, source: int, target: int
) -> list[Edit]:
    """Draw a floor's stairwell on another one, in the same place.

    Nothing where a room is in its way, but for one that is all within its shaft. What
    was drawn elsewhere becomes a wall, or floor where the other has some.
    """
    if not 0 <= target < building.floors:
        return []
    signs = building.signs[source]
    there = building.signs[target]
    mine = signs == letter
    beside = ndimage.binary_dilation(mine) & ~mine
    old = there == letter
    old_doors = _entrances(there, old)
    doors = old_doors & beside
    if not doors.any():
        doors = _entrances(signs, mine)

    named = is_room(there) & (there != ".")
    parts, _ = ndimage.label(is_room(there))
    rooms = np.isin(parts, parts[~mine]) & (parts > 0)
    taken = rooms | (there == "E") | ((there == "+") & ~old_doors)
    if taken[mine].any() or named[beside].any():
        return []

    new = there.copy()
    new[old | old_doors] = "#"
    around = ndimage.binary_dilation(mine, np.ones((3, 3)))
    new[around & (new == " ")] = "#"
    indoors = ~ndimage.binary_dilation(np.pad(new, 1, constant_values=" ") == " ")
    new[(old | old_doors) & is_room(signs) & indoors[1:-1, 1:-1]] = "."
    new[beside & (new == ".")] = "#"
    new[mine] = letter
    new[doors] = "+"
    floor = page.floor_of(target)
    changed = np.argwhere(new != there)
    return [edit for cell in changed for edit in floor.typed(str(new[*cell]), [cell])]


def _taken_out(building: Building, page: Page, letter: str, index: int) -> list[Edit]:
    """Take a floor's stairwell out, and its entrances."""
    signs = building.signs[index]
    mine = signs == letter
    return page.floor_of(index).typed("#", np.argwhere(mine | _entrances(signs, mine)))


def _ways_out(building: Building, page: Page) -> Iterator[Mistake]:
    """Find rooms without a way to an exit; those that are joined are told once."""
    ways = building.ways
    saved = nx.ancestors(ways, OUTSIDE) | {OUTSIDE}
    lost = ways.subgraph(set(ways) - saved)
    for part in nx.weakly_connected_components(lost):
        room = next(a for a in building.areas if a.id in part and a.kind == "room")
        floor = page.floor_of(room.floor)
        opening = _opening(building, page, part)
        facts = {"room": room.name}
        if opening is None:
            upstairs = all(building.area_of[name].floor for name in part)
            kind = "no-way-down" if upstairs else "no-way"
            yield floor.mistake(kind, room.cells[0], **facts)
            continue
        edits = opening.floor.typed(opening.sign, [opening.cell])
        facts["place"] = _place(opening.floor, opening.cell)
        kind = "no-way-door" if opening.sign == "+" else "no-way-exit"
        yield floor.mistake(kind, room.cells[0], edits=edits, **facts)


class Opening(NamedTuple):
    """What to type where, so that rooms get a way out."""

    sign: str
    floor: Floor
    cell: np.ndarray


def _opening(building: Building, page: Page, part: Collection[str]) -> Opening | None:
    """Find an opening for these rooms: a door to others, else an exit.

    Above the ground no exit: what is missing there are stairs.
    """
    for sign, floors in (("+", building.floors), ("E", 1)):
        for number in range(floors):
            rooms = [area.id for area in building.rooms(number) if area.id in part]
            if not rooms:
                continue
            floor = page.floor_of(number)
            find = _door_place if sign == "+" else _outer_place
            cell = find(building, floor, rooms)
            if cell is not None:
                return Opening(sign, floor, cell)
    return None


def _door_place(
    building: Building, floor: Floor, rooms: Collection[str]
) -> np.ndarray | None:
    """A place for a door between one of these rooms and another one."""
    signs = building.signs[floor.index]
    area = building.area[floor.index]
    mine = np.isin(area, [building.area_of[room].index for room in rooms])
    other = is_room(signs) & ~mine
    wall = signs == "#"
    for axis in (0, 1):
        for step in (1, -1):
            between = np.roll(mine, step, axis) & np.roll(other, -step, axis) & wall
            sides = np.roll(wall, 1, 1 - axis) & np.roll(wall, -1, 1 - axis)
            cells = np.argwhere(between & sides)
            if len(cells):
                return cells[len(cells) // 2]
    return None


# -- What is no mistake, and rarely meant -------------------------------------------


class Note(NamedTuple):
    """What may be meant, and where; line and column count from 1."""

    line: int
    column: int
    what: str

    def __str__(self) -> str:
        return f"{self.line}:{self.column}: {self.what}"


def notes_on(building: Building, page: Page) -> list[Note]:
    """Find what is rarely meant, in the order of the page."""
    notes = [*_short_rows(page)]
    what = "two rooms touch at this corner; nobody passes there. Draw a wall, or a door"
    for floor in page.floors:
        for row, column in touching(building, floor.index):
            notes.append(Note(floor.rows[row].number, column + 1, f"{what}."))
    return sorted(notes)


MOST_MISSING = 2  # signs of a row; one that is shorter ends so


def _short_rows(page: Page) -> Iterator[Note]:
    """Find rows a little shorter than both beside them, which are equally long."""
    for floor in page.floors:
        for above, row, below in zip(
            floor.rows, floor.rows[1:], floor.rows[2:], strict=False
        ):
            columns = len(row.code)
            around = len(above.code)
            if around == len(below.code) and 0 < around - columns <= MOST_MISSING:
                what = f"this row has {columns} columns, those above and below {around}"
                yield Note(row.number, columns, f"{what}: is a sign missing?")


def touching(building: Building, floor: int) -> list[tuple[int, int]]:
    """Find where rooms touch at a corner only: people see through, but cannot pass.

    Of each two rooms of a floor the first cell there, as row and column.
    """
    area = building.area[floor]
    kind = building.kind[floor]
    last = area.shape[1] - 1
    corners: dict[frozenset[int], tuple[int, int]] = {}
    found = [
        *_across(area, kind),
        *(
            (*pair, row, last - c)
            for *pair, row, c in _across(area[:, ::-1], kind[:, ::-1])
        ),
    ]
    for one, other, row, column in sorted(found, key=itemgetter(2, 3)):
        corners.setdefault(frozenset((one, other)), (row, column))
    return [*corners.values()]


def _across(area: np.ndarray, kind: np.ndarray) -> list[list[int]]:
    """Find rooms that meet south-east of a cell, where two walls meet as well.

    Of each place both rooms, and the row and column of the first one's cell.
    area, kind: (rows, columns) of a floor; for south-west, mirror both
    """
    north_west = area[:-1, :-1]
    south_east = area[1:, 1:]
    rooms = (north_west >= 0) & (south_east >= 0) & (north_west != south_east)
    walls = (kind[1:, :-1] == Kind.WALL) & (kind[:-1, 1:] == Kind.WALL)
    touch = rooms & walls
    cells = np.argwhere(touch)
    found: list[list[int]] = np.column_stack(
        [north_west[touch], south_east[touch], cells]
    ).tolist()
    return found
