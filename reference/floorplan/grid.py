"""What a drawing means: rooms, doors, stairwells, exits; and the mistakes in that.

Clauses: A2 (rooms, doors), A3 (stairwells, entrances), A4 (exits).

    cell    row and column, counted from 1; row 0 and column 0 are a rim of outside
    area    a room, or a stairwell on one floor; its number, 0 where there is none
    beside  sharing a side: touching at a corner is no contact
"""

import re
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator
from functools import cached_property
from itertools import pairwise

import networkx as nx
import numpy as np
from scipy import ndimage

from reference.floorplan.mistakes import Finding
from reference.floorplan.page import Drawing, Page

OUTSIDE, WALL, FLOOR, DOOR, EXIT = " #.+E"
STAIRWELLS = "ABCD"
SIDES = np.array([(-1, 0), (0, -1), (0, 1), (1, 0)])

Cell = Iterable[int]


class Grid:
    """One drawing as an array.

    signs   (rows + 2, columns + 2) one character each
    areas   the same shape, int: numbers of the areas
    letter  number of an area -> its letter, for stairwells
    """

    def __init__(self, drawing: Drawing, width: int) -> None:
        rows = [f" {row.code.ljust(width)} " for row in drawing.rows]
        rim = " " * (width + 2)
        self.drawing = drawing
        self.signs = np.array([list(row) for row in (rim, *rows, rim)])
        self.rooms = (self.signs == FLOOR) | (self.signs >= "a")
        self.areas, rooms = ndimage.label(self.rooms)
        self.letter: dict[int, str] = {}
        for letter in STAIRWELLS:
            for cells in pieces(self.signs == letter):
                self.letter[rooms + len(self.letter) + 1] = letter
                self.areas[tuple(cells.T)] = rooms + len(self.letter)

    @cached_property
    def names(self) -> dict[int, list[tuple[str, Cell]]]:
        """What is written in each room, and where; in the order of the page."""
        found: dict[int, list[tuple[str, Cell]]] = defaultdict(list)
        for row, line in enumerate(self.drawing.rows, 1):
            for word in re.finditer("[a-z]+", line.code):
                cell = (row, word.start() + 1)
                found[int(self.areas[cell])].append((word[0], cell))
        return found

    @cached_property
    def stairwells(self) -> dict[str, np.ndarray]:
        """The cells of each stairwell, by its letter."""
        found = {letter: np.argwhere(self.signs == letter) for letter in STAIRWELLS}
        return {letter: cells for letter, cells in found.items() if len(cells)}

    def beside(self, cells: np.ndarray) -> tuple[set[int], set[str]]:
        """Areas and signs that share a side with some of these cells."""
        around = tuple(neighbours(cells).T)
        areas = {int(area) for area in self.areas[around]} - {0}
        return areas, {str(sign) for sign in self.signs[around]}

    def ways(self, floor: int) -> nx.Graph:
        """Rooms, stairwells and the outside, joined by doors and exits.

        Nodes: (floor, area) of a room, the letter of a stairwell, OUTSIDE.
        """
        graph = nx.Graph()
        graph.add_nodes_from(
            (floor, int(area)) for area in np.unique(self.areas[self.rooms])
        )
        for cells in pieces(self.signs == DOOR) + pieces(self.signs == EXIT):
            areas, signs = self.beside(cells)
            joined = [self.letter.get(area) or (floor, area) for area in areas]
            nx.add_path(graph, joined + [OUTSIDE] * (OUTSIDE in signs))
        return graph

    def called(self, area: int) -> str:
        """The area in words."""
        if area in self.letter:
            return f"stairwell {self.letter[area]}"
        if area in self.names:
            return f"the room '{self.names[area][0][0]}'"
        return "an unnamed room"

    def first_cell(self, area: int) -> Cell:
        """Where the area's name begins, or its first cell."""
        if area in self.names:
            return self.names[area][0][1]
        return np.argwhere(self.areas == area)[0]

    def finding(self, cell: Cell, what: str, hint: str) -> Finding:
        """A mistake at a cell."""
        row, column = map(int, cell)
        return self.drawing.rows[row - 1].finding(what, hint, column)


def grids(page: Page) -> list[Grid]:
    """The drawings as arrays; the page has passed its stages."""
    return [Grid(drawing, page.size[0]) for drawing in page.drawings]


def pieces(mask: np.ndarray) -> list[np.ndarray]:
    """The (k, 2) cells of each part of a mask that hangs together."""
    labels, count = ndimage.label(mask)
    cells = np.argwhere(labels)
    label = labels[tuple(cells.T)]
    order = np.argsort(label, kind="stable")
    ends = np.cumsum(np.bincount(label, minlength=count + 1)[1:-1])
    return np.split(cells[order], ends) if count else []


def neighbours(cells: np.ndarray) -> np.ndarray:
    """(4 k, 2) the cells above, left, right and below each of (k, 2) cells."""
    return (cells[:, None] + SIDES).reshape(-1, 2)


# -- Stage 4: one floor -------------------------------------------------------------


def _outer_wall(grid: Grid) -> Iterator[Finding]:
    outside = grid.signs == OUTSIDE
    in_line = _between(~(outside | grid.rooms))
    gap = outside & in_line & ndimage.binary_dilation(grid.rooms)
    hole = grid.rooms & ndimage.binary_dilation(outside & ~gap)
    for cells in pieces(gap) + pieces(hole):
        what = "there is a hole in the outer wall"
        yield grid.finding(cells[0], what, "Type '#' here.")


def _between(wall: np.ndarray) -> np.ndarray:
    """Cells with wall on two opposite sides: a blank there was meant as wall."""
    above, below = np.roll(wall, 1, axis=0), np.roll(wall, -1, axis=0)
    left, right = np.roll(wall, 1, axis=1), np.roll(wall, -1, axis=1)
    return (above & below) | (left & right)


def _doors(grid: Grid) -> Iterator[Finding]:
    for cells in pieces(grid.signs == DOOR):
        areas, signs = grid.beside(cells)
        if OUTSIDE in signs:
            hint = "Type 'E' for an exit, or '#' for a wall."
            yield grid.finding(cells[0], "this door leads outside", hint)
        elif len(areas) < 2 or areas <= set(grid.letter):
            beside = f"only {grid.called(*areas)}" if len(areas) == 1 else "no room"
            what = f"this door leads nowhere: {beside} is beside it"
            hint = "Put it in the wall between two rooms, or type '#' here."
            yield grid.finding(cells[0], what, hint)


def _exits(grid: Grid) -> Iterator[Finding]:
    for cells in pieces(grid.signs == EXIT):
        areas, signs = grid.beside(cells)
        if OUTSIDE not in signs:
            hint = "Put it in the outer wall, or type '+' for a door."
            yield grid.finding(cells[0], "this exit does not lead outside", hint)
        elif not areas:
            hint = "Put it in the outer wall of a room, or type '#' here."
            yield grid.finding(cells[0], "this exit leads out of no room", hint)


def _stairwells(grid: Grid) -> Iterator[Finding]:
    for letter, cells in grid.stairwells.items():
        for part in pieces(grid.signs == letter)[1:]:
            hint = "Join the parts, or give this one another letter."
            yield grid.finding(part[0], f"stairwell {letter} is in two parts", hint)
        if opening := _opening(grid, letter, cells):
            yield opening
        elif DOOR not in grid.beside(cells)[1]:
            hint = "Type '+' in its wall, where a room is behind it."
            what = f"stairwell {letter} has no entrance on {grid.drawing.label}"
            yield grid.finding(cells[0], what, hint)


def _opening(grid: Grid, letter: str, cells: np.ndarray) -> Finding | None:
    """The first place where nothing parts a stairwell from what is around it.

    Two stairwells side by side are told once, at the first letter.
    """
    closed = {letter, WALL, DOOR, *STAIRWELLS[: STAIRWELLS.index(letter)]}
    for cell in sorted(map(tuple, neighbours(cells))):
        sign = str(grid.signs[cell])
        if sign not in closed:
            here = np.clip(cell, 1, np.array(grid.signs.shape) - 2)
            other = {OUTSIDE: "the outside", EXIT: "an exit"}.get(sign)
            other = other or grid.called(int(grid.areas[cell]))
            entrance = ", or '+' for an entrance" if grid.rooms[cell] else ""
            what = f"stairwell {letter} is open to {other}"
            return grid.finding(here, what, f"Type '#' here{entrance}.")
    return None


def _names(grid: Grid) -> Iterator[Finding]:
    seen: set[str] = set()
    for area, ((name, cell), *others) in grid.names.items():
        for other, place in others:
            what = f"'{other}' is a second name in {grid.called(area)}"
            hint = "Keep one word on one row, or draw a wall between the two."
            yield grid.finding(place, what, hint)
        if name in seen:
            what = f"two rooms on {grid.drawing.label} are called '{name}'"
            yield grid.finding(cell, what, "Write another name here.")
        seen.add(name)


def _some_room(grid: Grid) -> Iterator[Finding]:
    if not grid.rooms.any():
        hint = "Draw its floor with '.' between the walls."
        what = f"no room is drawn on {grid.drawing.label}"
        yield grid.drawing.heading.finding(what, hint)


def _ways_off(grid: Grid) -> Iterator[Finding]:
    graph, goals = grid.ways(0), {OUTSIDE, *grid.stairwells}
    if goals.isdisjoint(graph):
        return  # for stage 5: this floor, or the building, has no way out at all
    for _, room in _stranded(graph, goals):
        what = f"nobody can leave {grid.called(room)}"
        hint = "Type '+' in its wall, towards a room with a way out."
        yield grid.finding(grid.first_cell(room), what, hint)


def _stranded(graph: nx.Graph, goals: set[str]) -> Iterator[tuple[int, int]]:
    """The first room of each part of a graph that has none of the goals."""
    for part in nx.connected_components(graph):
        if goals.isdisjoint(part):
            yield min(part - set(STAIRWELLS))


# -- Stage 5: between floors --------------------------------------------------------


def _some_exit(grids: list[Grid]) -> Iterator[Finding]:
    if not any((grid.signs == EXIT).any() for grid in grids):
        hint = "Type 'E' in the outer wall of a room on floor 1."
        yield grids[0].drawing.heading.finding("the building has no exit", hint)


def _shafts(grids: list[Grid]) -> Iterator[Finding]:
    floors = {number: grid for grid in grids for number in grid.drawing.numbers}
    for letter in STAIRWELLS:
        mine = [number for number in floors if letter in floors[number].stairwells]
        if len(mine) == 1:
            grid = floors[mine[0]]
            what = f"stairwell {letter} is on floor {mine[0]} only"
            hint = "Draw it on the next floor as well, or take it out."
            yield grid.finding(grid.stairwells[letter][0], what, hint)
        for lower, upper in pairwise(mine):
            yield from _flight(letter, lower, upper, floors)


def _flight(
    letter: str, lower: int, upper: int, floors: dict[int, Grid]
) -> Iterator[Finding]:
    below, above = floors[lower].stairwells[letter], floors[upper].stairwells[letter]
    if upper > lower + 1:
        what = f"stairwell {letter} goes from floor {lower} to floor {upper}"
        hint = f"Draw it on floor {lower + 1} too, or use another letter here."
        yield floors[upper].finding(above[0], what, hint)
    elif not np.array_equal(below, above):
        (top, left), (bottom, right) = below.min(axis=0), below.max(axis=0)
        where = f"row {top}, column {left} to row {bottom}, column {right}"
        what = f"stairwell {letter} is not above itself on floor {lower}"
        yield floors[upper].finding(above[0], what, f"Draw it as there: {where}.")


def _ways_out(grids: list[Grid]) -> Iterator[Finding]:
    """People only walk down: every room needs a way to an exit that never goes up."""
    floors = {number: grid for grid in grids for number in grid.drawing.numbers}
    ways = nx.DiGraph()
    for number, grid in floors.items():
        wells = {letter: (number, letter) for letter in STAIRWELLS}
        ways.update(nx.relabel_nodes(grid.ways(number), wells).to_directed())
        here = set(wells.values()).intersection(ways)
        ways.add_edges_from((well, (number - 1, well[1])) for well in here)
    lost = ways.subgraph(set(ways) - nx.ancestors(ways, OUTSIDE) - {OUTSIDE})
    for part in nx.weakly_connected_components(lost):
        rooms = [node for node in part if isinstance(node[1], int)]
        if rooms:
            number, room = min(rooms)
            what = f"no way leads from {floors[number].called(room)} to an exit"
            hint = (
                "Type 'E' in an outer wall here, or draw stairs down: nobody walks up."
            )
            yield floors[number].finding(floors[number].first_cell(room), what, hint)


Check = Callable[[list[Grid]], Iterator[Finding]]


def _on_each(*checks: Callable[[Grid], Iterator[Finding]]) -> Check:
    return lambda grids: (f for grid in grids for check in checks for f in check(grid))


STAGES = (
    (_on_each(_outer_wall, _doors, _exits, _stairwells, _names, _some_room),),
    (_on_each(_ways_off),),
    (_some_exit, _shafts),
    (_ways_out,),
)
"""Ways are looked for where the rest of their stage is right: else one missing entrance
would be told as many rooms that nobody can leave."""
