"""A building: the graph of its rooms, doors and stairwells, and a grid of its cells.

Clauses: A1-A7, B1 and the coordinates of A8.

    row, col   place in the text, row 0 is the north edge
    x, y       metres, east and north; the main body's middle is the origin
    floor      0 is the first floor
"""

from collections import defaultdict
from collections.abc import Collection, Iterable
from dataclasses import dataclass
from enum import IntEnum
from functools import cached_property, lru_cache
from typing import TypeAlias

import networkx as nx
import numpy as np

from reference.floorplan import Plan, find, parse, read, to_text
from reference.floorplan.plan import Part

Graph: TypeAlias = nx.MultiGraph


class Kind(IntEnum):
    """What a cell is; the label a ray returns [B1]."""

    OUTSIDE = 0
    WALL = 1
    FLOOR = 2
    DOOR = 3  # blue [A2]
    ENTRANCE = 4  # purple [A3]
    EXIT = 5  # green [A4]
    STAIRS = 6


LANDMARKS = (Kind.DOOR, Kind.ENTRANCE, Kind.EXIT)  # triggers without volume [A5]
KINDS = {kind.name.lower(): kind for kind in LANDMARKS} | {
    "room": Kind.FLOOR,
    "stairwell": Kind.STAIRS,
}


@dataclass(frozen=True)
class Area:
    """A room, or one storey of a stairwell; cells: (k, 2) rows and columns."""

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


@dataclass(frozen=True)
class Landmark:
    """A door, stairwell entrance or exit; cells: (k, 2) rows and columns.

    leads_out: is it an exit, or an entrance to stairs that go down?
    """

    index: int
    id: str
    kind: Kind
    floor: int
    cells: np.ndarray
    position: tuple[float, float]
    sides: tuple[str, ...]
    leads_out: bool

    @property
    def width(self) -> int:
        """Metres."""
        return len(self.cells)


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


@dataclass(frozen=True, eq=False)
class Building:
    """Facts computed from a checked plan; arrays of cells are (floors, rows, cols)."""

    plan: Plan

    @property
    def title(self) -> str:
        """The building's name in the drawing."""
        return self.plan.title

    @property
    def floors(self) -> int:
        """Number of floors."""
        return len(self.plan.storeys)

    # -- The graph ------------------------------------------------------------------

    @property
    def graph(self) -> Graph:
        """Rooms, stairwells and the outside, joined by doors, exits and stairs."""
        return self.plan.graph

    @cached_property
    def area_of(self) -> dict[str, Area]:
        """The room or stairwell that a node of the graph stands for, by its id."""
        return {area.id: area for area in self.areas}

    @cached_property
    def landmark_of(self) -> dict[str, Landmark]:
        """The landmark that an edge of the graph stands for, by its id."""
        return {mark.id: mark for mark in self.landmarks}

    # -- Cells and metres -----------------------------------------------------------

    @cached_property
    def kind(self) -> np.ndarray:
        """Kind of each cell, uint8."""
        kind = np.zeros((self.floors, self.plan.height, self.plan.width), np.uint8)
        for floor, storey in zip(kind, self.plan.storeys, strict=True):
            floor[storey.signs[1:-1, 1:-1] == "#"] = Kind.WALL
            for part in (*storey.areas, *storey.gates):
                floor[tuple(part.cells.T - 1)] = KINDS[part.kind]
        return kind

    @cached_property
    def walkable(self) -> np.ndarray:
        """(floors, rows, cols) bool: where a body may stand [A7]."""
        return self.kind >= Kind.FLOOR

    @cached_property
    def area(self) -> np.ndarray:
        """Index into `areas` of each cell, -1 where there is none."""
        return self._indices(self.areas)

    @cached_property
    def landmark(self) -> np.ndarray:
        """Index into `landmarks` of each cell, -1 where there is none."""
        return self._indices(self.landmarks)

    def _indices(self, things: Iterable[Area | Landmark]) -> np.ndarray:
        index = np.full(self.kind.shape, -1, dtype=np.int16)
        for thing in things:
            index[thing.floor, *thing.cells.T] = thing.index
        return index

    @cached_property
    def _box(self) -> np.ndarray:
        """Main body: first row and column, and past its last row and column."""
        cells = np.argwhere((self.kind == Kind.FLOOR).any(axis=0))
        return np.array([cells.min(axis=0) - 1, cells.max(axis=0) + 2])  # with walls

    @cached_property
    def origin(self) -> tuple[int, int]:
        """(row, col) of the origin of the metres: the main body's middle [A8]."""
        row, col = (self._box.sum(axis=0) // 2).tolist()
        return row, col

    @cached_property
    def body(self) -> tuple[float, float, float, float]:
        """Main body: left, bottom, right, top in metres [A1]."""
        (top, left), (bottom, right) = (self._box - self.origin).astype(float).tolist()
        return left, -bottom, right, -top

    def metres(self, row: float, col: float) -> tuple[float, float]:
        """Centre of a cell, metres east and north of the origin."""
        return col + 0.5 - self.origin[1], self.origin[0] - (row + 0.5)

    def cell(self, x: float, y: float) -> tuple[int, int]:
        """Row and column of the cell around a point."""
        return int(np.ceil(self.origin[0] - y)) - 1, int(np.floor(x + self.origin[1]))

    # -- Rooms, stairwells, landmarks -----------------------------------------------

    @cached_property
    def areas(self) -> tuple[Area, ...]:
        """Rooms and stairwells, floor by floor."""
        found = []
        for index, (n, name, part) in enumerate(self.plan.parts("areas")):
            place = n - 1, part.cells - 1, self._middle(part)
            found.append(Area(index, name, part.name, part.kind, *place))
        return tuple(found)

    @cached_property
    def landmarks(self) -> tuple[Landmark, ...]:
        """Doors, entrances and exits, floor by floor."""
        kinds = self.graph.nodes(data="kind")
        into = {node for node, kind in kinds if kind != "room"}
        out = {key for _, end, key in self.plan.ways.edges(keys=True) if end in into}
        sides: dict[str, dict[str, None]] = defaultdict(dict)  # in the graph's order
        for one, other, key in self.graph.edges(keys=True):
            sides[key] |= {one: None, other: None}
        found = []
        for index, (n, name, gate) in enumerate(self.plan.parts("gates")):
            place = n - 1, gate.cells - 1, self._middle(gate), tuple(sides[name])
            found.append(Landmark(index, name, KINDS[gate.kind], *place, name in out))
        return tuple(found)

    def _middle(self, part: Part) -> tuple[float, float]:
        return self.metres(*(part.cells - 1).mean(axis=0).tolist())

    @cached_property
    def stairwells(self) -> tuple[Stairwell, ...]:
        """Shafts in the order of their letters."""
        found: dict[str, Stairwell] = {}
        for area in self.areas:
            if area.kind == "stairwell":
                new = Stairwell(area.name, area.cells, area.centre, {}, {})
                well = found.setdefault(area.name, new)
                at = [m.index for m in self.landmarks if area.id in m.sides]
                well.areas[area.floor] = area.index
                well.entrances[area.floor] = tuple(at)
        return tuple(found[letter] for letter in sorted(found))

    @cached_property
    def stairwell_of(self) -> dict[int, int]:
        """Index of a stairwell by the index of each of its entrances."""
        return {
            mark: k
            for k, well in enumerate(self.stairwells)
            for marks in well.entrances.values()
            for mark in marks
        }

    @cached_property
    def exits(self) -> frozenset[int]:
        """Indices of the exits among the landmarks."""
        return frozenset(m.index for m in self.landmarks if m.kind is Kind.EXIT)

    @cached_property
    def dead_ends(self) -> frozenset[int]:
        """Indices of the entrances whose stairs do not go down."""
        entrances = (self.landmarks[mark] for mark in self.stairwell_of)
        return frozenset(mark.index for mark in entrances if not mark.leads_out)

    def ways_out(self, floor: int) -> list[int]:
        """Landmarks that lead off a floor: exits, and entrances to stairs down."""
        return [m.index for m in self.landmarks if m.floor == floor and m.leads_out]

    def rooms(self, floor: int) -> list[Area]:
        """The rooms of a floor, corridors included, stairwells not."""
        return [a for a in self.areas if a.floor == floor and a.kind == "room"]


def burn(graph: Graph, doors: Collection[str]) -> Graph:
    """View a graph of rooms without the doors with these ids [A6].

    [A6, chosen] A destroyed door is no way out any more; its cell burns, so only who is
    stuck or stands in flames walks through. Raises KeyError for an unknown id.
    """
    edges = [edge for edge in graph.edges(keys=True) if edge[2] in doors]
    if missing := set(doors) - {key for *_, key in edges}:
        raise KeyError(min(missing))
    return nx.restricted_view(graph, [], edges)


def load(name: str) -> Building:
    """Read a floor file by path or shipped name and build it; see `building_of`.

    Raises FloorPlanError for a mistake in the drawing, OSError for an unreadable file.
    """
    return building_of(to_text(read(find(name))))


@lru_cache(maxsize=4)
def building_of(plan: str) -> Building:
    """Build from the text of a floor file; other processes are sent this text.

    One object per drawing, since navigation and sight are cached per object: of the
    last few drawings, so do not write into its arrays.
    """
    return Building(parse(plan))


def plan_of(building: Building) -> str:
    """Write a building as the text of its floor file."""
    return to_text(building.plan)
