"""A building: a grid of cells, its rooms, doors and stairwells, and their graph.

row, col   place in the text, row 0 is the north edge
x, y       metres, east and north; the main body's middle is the origin
floor      0 is the first floor; ids, which people read, count from 1
beside     with a common side; two cells that share a corner only are not
"""

import re
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass
from enum import IntEnum
from functools import lru_cache
from itertools import pairwise, permutations
from math import sqrt
from typing import TypeAlias

import networkx as nx
import numpy as np
from numpy.random import Generator as Rng
from scipy import ndimage

from reference import paper
from reference.floorplan import STAIRWELLS, Drawing, parse

Graph: TypeAlias = nx.MultiGraph
OUTSIDE = "outside"  # a node of the graph


class Kind(IntEnum):
    """What a cell is; in lower case it is the label a ray returns [B1]."""

    OUTSIDE = 0
    WALL = 1
    FLOOR = 2
    DOOR = 3  # blue [A2]
    ENTRANCE = 4  # purple [A3]
    EXIT = 5  # green [A4]
    STAIRS = 6


@dataclass(frozen=True, eq=False)
class Area:
    """A room, or one storey of a stairwell.

    cells   (k, 2) rows and columns
    centre  their mean, metres: perhaps outside a room that bends
    """

    index: int
    id: str
    name: str
    kind: str  # "room" | "stairwell"
    floor: int
    cells: np.ndarray
    centre: tuple[float, float]

    @property
    def size(self) -> int:
        """Square metres."""
        return len(self.cells)


@dataclass(frozen=True, eq=False)
class Landmark:
    """A door, stairwell entrance or exit [A5]; cells: (k, 2) rows and columns."""

    index: int
    id: str
    kind: Kind
    floor: int
    cells: np.ndarray
    position: tuple[float, float]
    width: int  # metres, on its narrower side
    sides: tuple[str, ...]  # ids of the areas beside it, and OUTSIDE of an exit
    stairwell: int  # index of the one it leads into, -1 for none
    leads_out: bool  # is it an exit, or an entrance to stairs that go down?


@dataclass(frozen=True)
class Stairwell:
    """A shaft through all its floors; entrances: landmark indices, floor by floor."""

    letter: str
    cells: np.ndarray
    centre: tuple[float, float]
    areas: dict[int, int]  # floor -> index of its area there
    entrances: dict[int, tuple[int, ...]]

    @property
    def lowest(self) -> int:
        """The floor where its stairs end and people come out [A3]."""
        return min(self.areas)

    def leads_down(self, floor: int) -> bool:
        """Do its stairs lead down from this floor?"""
        return floor in self.areas and floor > self.lowest


class Building:
    """A building from its drawing; arrays of cells are (floors, rows, cols).

    signs       character that each cell is drawn with
    area        index into `areas` of each cell, -1 where there is none
    landmark    index into `landmarks` of each cell, -1 where there is none
    kind        Kind of each cell;  walkable  bool: may a body stand there? [A7]
    areas       rooms and stairwells, floor by floor;  area_of  by their ids
    landmarks   doors, entrances, exits, floor by floor;  landmark_of  by their ids
    stairwells  shafts in the order of their letters
    exits       indices of the exits among the landmarks
    body        of the main body: left, bottom, right, top in metres [A1]
    origin      (row, col) of the main body's middle, where metres begin
    """

    def __init__(self, drawing: Drawing):
        self.drawing = drawing
        self.title = drawing.title
        self.floors = len(drawing.storeys)
        self.signs: np.ndarray = signs_of(drawing)

        # where metres begin
        rooms = np.any(is_room(self.signs), axis=0)  # on any floor
        if not rooms.any():  # nothing but stairs or walls: all of the drawing
            rooms[:] = True
        cells = np.argwhere(rooms)
        top, left = (cells.min(axis=0) - 1).tolist()  # with the outer walls
        bottom, right = (cells.max(axis=0) + 2).tolist()
        row = (top + bottom) // 2
        col = (left + right) // 2
        self.origin = row, col
        self.body = (
            float(left - col),
            float(row - bottom),
            float(right - col),
            float(row - top),
        )

        # rooms, stairwells, landmarks
        self.areas = self._find_areas()
        self.area_of = {area.id: area for area in self.areas}
        self.area = self._indices(self.areas)
        shafts = self._find_shafts()
        self.landmarks = self._find_landmarks(shafts)
        self.landmark_of = {mark.id: mark for mark in self.landmarks}
        self.landmark = self._indices(self.landmarks)
        self.stairwells = self._find_stairwells(shafts)
        self.exits = frozenset(m.index for m in self.landmarks if m.kind is Kind.EXIT)

        # what each cell is
        self.kind: np.ndarray = np.full(self.signs.shape, Kind.STAIRS, np.uint8)
        self.kind[self.signs == " "] = Kind.OUTSIDE
        self.kind[self.signs == "#"] = Kind.WALL
        self.kind[is_room(self.signs)] = Kind.FLOOR
        for mark in self.landmarks:
            self.kind[mark.floor, *mark.cells.T] = mark.kind
        self.walkable = self.kind >= Kind.FLOOR
        read_only(self, *self.areas, *self.landmarks)

    def __repr__(self) -> str:
        """Say in a line what it has."""
        parts = f"{len(self.exits)} exits, {len(self.stairwells)} stairwells"
        return f"<Building {self.title}: {self.floors} floors, {parts}>"

    # -- Cells and metres -----------------------------------------------------------

    def random_point(self, cells: np.ndarray, rng: Rng) -> tuple[float, float]:
        """Draw one of these cells, (rows, cols) bool; return its middle."""
        return self.metres(*rng.choice(np.argwhere(cells)).tolist())

    def metres(self, row: float, col: float) -> tuple[float, float]:
        """Centre of a cell, metres east and north of the origin."""
        return col + 0.5 - self.origin[1], self.origin[0] - (row + 0.5)

    def cell(self, x: float, y: float) -> tuple[int, int]:
        """Row and column of a point's cell; on a border, the east or north one."""
        row = int(np.ceil(self.origin[0] - y)) - 1
        col = int(np.floor(x + self.origin[1]))
        return row, col

    def _middle(self, cells: np.ndarray) -> tuple[float, float]:
        return self.metres(*cells.mean(axis=0).tolist())

    def _indices(self, things: Iterable[Area | Landmark]) -> np.ndarray:
        index = np.full(self.signs.shape, -1)
        for thing in things:
            index[thing.floor, *thing.cells.T] = thing.index
        return index

    # -- Rooms, stairwells, landmarks -----------------------------------------------

    def _find_areas(self) -> tuple[Area, ...]:
        """Find rooms, then stairwells of each floor, in reading order."""
        areas: list[Area] = []
        for floor, signs in enumerate(self.signs):
            rooms = connected_parts(is_room(signs))
            wells = [
                some for sign in STAIRWELLS for some in connected_parts(signs == sign)
            ]
            wells.sort(key=lambda cells: tuple(cells[0]))
            for number, cells in enumerate(rooms + wells, 1):
                name = self._word_on(floor, cells) or f"room-{number}"
                area = Area(
                    index=len(areas),
                    id=f"{floor + 1}/{name}",
                    name=name,
                    kind="room" if number <= len(rooms) else "stairwell",
                    floor=floor,
                    cells=cells,
                    centre=self._middle(cells),
                )
                areas.append(area)
        return tuple(areas)

    def _word_on(self, floor: int, cells: np.ndarray) -> str:
        """The first word on the cells of a room, or a stairwell's letter; else ''."""
        lettered = cells[self.signs[floor, *cells.T] != "."]
        if not len(lettered):
            return ""
        row, col = lettered[0].tolist()
        written = self.drawing.storeys[floor].rows[row][col:]
        word = re.match("[a-z][a-z0-9]*|[A-D]", written)
        return word[0] if word else ""

    def _find_shafts(self) -> dict[str, list[Area]]:
        """Find the areas of each stairwell, the lowest first, by letter."""
        shafts = {}
        for letter in STAIRWELLS:
            storeys = [area for area in self.areas if area.name == letter]
            if storeys:
                shafts[letter] = storeys
        return shafts

    def _find_landmarks(self, shafts: dict[str, list[Area]]) -> tuple[Landmark, ...]:
        """Find doors, then entrances, then exits of each floor, in reading order."""
        landmarks: list[Landmark] = []
        for floor in range(self.floors):
            for kind, found in self._passages(floor).items():
                for number, cells in enumerate(found, 1):
                    beside = self._areas_beside(floor, cells)
                    sides = [area.id for area in beside]
                    leads_out = kind is Kind.EXIT
                    if leads_out:
                        sides.append(OUTSIDE)
                    well = -1
                    if kind is Kind.ENTRANCE:
                        letter = next(a.name for a in beside if a.kind == "stairwell")
                        well = list(shafts).index(letter)
                        leads_out = shafts[letter][0].floor < floor
                    mark = Landmark(
                        index=len(landmarks),
                        id=f"{floor + 1}/{kind.name.lower()}-{number}",
                        kind=kind,
                        floor=floor,
                        cells=cells,
                        position=self._middle(cells),
                        width=self._width(floor, cells),
                        sides=tuple(sides),
                        stairwell=well,
                        leads_out=leads_out,
                    )
                    landmarks.append(mark)
        return tuple(landmarks)

    def _passages(self, floor: int) -> dict[Kind, list[np.ndarray]]:
        """Find the cells of each passage of a floor, by kind, in reading order."""
        signs = self.signs[floor]
        found = {
            Kind.DOOR: [],
            Kind.ENTRANCE: [],
            Kind.EXIT: connected_parts(signs == "E"),
        }
        for cells in connected_parts(signs == "+"):
            kinds = [area.kind for area in self._areas_beside(floor, cells)]
            kind = Kind.ENTRANCE if "stairwell" in kinds else Kind.DOOR
            found[kind].append(cells)
        return found

    def _areas_beside(self, floor: int, cells: np.ndarray) -> list[Area]:
        """The areas that share a side with any of these cells, in reading order."""
        mask = np.zeros_like(self.signs[floor], dtype=bool)
        mask[*cells.T] = True
        around = ndimage.binary_dilation(mask)
        beside = np.unique(self.area[floor, around]).tolist()
        return [self.areas[index] for index in beside if index >= 0]

    def _width(self, floor: int, cells: np.ndarray) -> int:
        """Count the cells of a passage that an area touches on one side [A2].

        Of two opposite sides the smaller number counts; an exit has an area on one of
        them only. In a thick wall the cells between touch none.
        """
        areas = self.area[floor] >= 0
        widths = []
        for axis in (0, 1):
            here, there = (np.roll(areas, k, axis)[*cells.T].sum() for k in (1, -1))
            widths.append(min(here, there) or max(here, there))
        return int(max(widths))

    def _find_stairwells(self, shafts: dict[str, list[Area]]) -> tuple[Stairwell, ...]:
        """Join each stairwell's storeys and the entrances that lead into them."""
        stairwells = []
        for number, (letter, storeys) in enumerate(shafts.items()):
            marks = [mark for mark in self.landmarks if mark.stairwell == number]
            entrances = {
                storey.floor: tuple(m.index for m in marks if m.floor == storey.floor)
                for storey in storeys
            }
            well = Stairwell(
                letter=letter,
                cells=storeys[0].cells,
                centre=storeys[0].centre,
                areas={storey.floor: storey.index for storey in storeys},
                entrances=entrances,
            )
            stairwells.append(well)
        return tuple(stairwells)

    def ways_out(self, floor: int) -> list[int]:
        """Landmarks that lead off a floor: exits, and entrances to stairs down."""
        return [m.index for m in self.landmarks if m.floor == floor and m.leads_out]

    def rooms(self, floor: int) -> list[Area]:
        """The rooms of a floor, corridors included, stairwells not."""
        return [a for a in self.areas if a.floor == floor and a.kind == "room"]

    # -- The graph ------------------------------------------------------------------

    @property
    def ways(self) -> nx.MultiDiGraph:
        """Rooms, stairwells and the outside, joined as people walk: out, and down [A3].

        An edge is a door, entrance, exit or storey of stairs. Its `length` (metres) is
        that of straight lines from the middles of its rooms to that of the door, of
        stairs `paper.stairs_metres`.
        Nobody walks up [A3, chosen]: people leave stairs on the lowest floor only.
        """
        return _ways_of(self, paper.stairs_metres())

    @property
    def graph(self) -> Graph:
        """The same graph without directions."""
        return self.ways.to_undirected()


@lru_cache(maxsize=8)
def _ways_of(building: Building, stairs_metres: float) -> nx.MultiDiGraph:
    ways = nx.MultiDiGraph()
    for area in building.areas:
        ways.add_node(
            area.id,
            name=area.name,
            kind=area.kind,
            floor=area.floor,
            area=area.size,
        )
    ways.add_node(OUTSIDE, name=OUTSIDE, kind=OUTSIDE)

    for mark in building.landmarks:
        kind = mark.kind.name.lower()
        rooms = [building.area_of[side] for side in mark.sides if side != OUTSIDE]
        metres = sum(distance(room.centre, mark.position) for room in rooms)
        for here, there in permutations(mark.sides, 2):
            if here != OUTSIDE and _can_leave(building.area_of[here], mark):
                ways.add_edge(
                    here, there, mark.id, kind=kind, width=mark.width, length=metres
                )

    for well in building.stairwells:
        for low, up in pairwise(floor + 1 for floor in well.areas):
            ways.add_edge(
                f"{up}/{well.letter}",
                f"{low}/{well.letter}",
                f"{well.letter}:{low}-{up}",
                kind="stairs",
                width=1,
                length=stairs_metres,
            )
    return nx.freeze(ways)


def _can_leave(here: Area, mark: Landmark) -> bool:
    """Do people leave an area by a landmark?

    By an entrance they leave a room where stairs go down, and stairs where these end.
    """
    return mark.kind is not Kind.ENTRANCE or (here.kind == "room") == mark.leads_out


def without_doors(graph: Graph, doors: Collection[str]) -> Graph:
    """View a graph of rooms without the doors with these ids [A6].

    [A6, chosen] A destroyed door is no longer a way out. It is a hole: people see
    through it, and walk through it while its cell does not burn.
    """
    edges = [edge for edge in graph.edges(keys=True) if edge[2] in doors]
    return nx.restricted_view(graph, [], edges)


# Not hypot: processors and libraries round its last digit differently,
# whereas IEEE 754 prescribes the last digit of + - * / and sqrt.


def distance(one: Sequence[float], other: Sequence[float]) -> float:
    """Metres between two points."""
    x = other[0] - one[0]
    y = other[1] - one[1]
    return sqrt(x * x + y * y)


def read_only(*things: object) -> None:
    """Refuse writing to arrays of these objects, since all runs share them."""
    for thing in things:
        for value in vars(thing).values():
            if isinstance(value, np.ndarray):
                value.flags.writeable = False


def lengths(off: np.ndarray) -> np.ndarray:
    """(...) metres of vectors (..., 2)."""
    x = off[..., 0]
    y = off[..., 1]
    return np.sqrt(x * x + y * y)


def signs_of(drawing: Drawing) -> np.ndarray:
    """(floors, rows, cols) the characters of a drawing."""
    rows = np.array([storey.rows for storey in drawing.storeys])
    return rows[..., None].view("U1")


def is_room(signs: np.ndarray) -> np.ndarray:
    """Which characters are the floor of a room, or a name on it?"""
    return (signs == ".") | (signs >= "a") | ((signs >= "0") & (signs <= "9"))


def connected_parts(mask: np.ndarray) -> list[np.ndarray]:
    """Find the (k, 2) cells of each connected part of a mask, in reading order."""
    labels, count = ndimage.label(mask)
    return [np.argwhere(labels == k) for k in range(1, count + 1)]


@lru_cache(maxsize=4)
def build(drawing: Drawing) -> Building:
    """Build a drawing; equal drawings give the same object, if it is still kept."""
    return Building(drawing)


def building_of(plan: str) -> Building:
    """Build from the text of a floor file. Raises FloorPlanError."""
    return build(parse(plan))
