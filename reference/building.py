"""A drawing becomes a graph of rooms, doors and stairwells, and a grid of cells.

Clauses: A1, A2, A3, A4, A6 and the coordinates of A8.  A student asks the graph with
networkx, the simulator asks the grid.

    row, col   place in the text, row 0 is the north edge
    x, y       metres, east and north; the main body's middle is the origin
    floor      0 is the first floor
"""

from collections import defaultdict
from collections.abc import Iterable
from dataclasses import dataclass
from enum import IntEnum
from functools import cached_property, lru_cache
from typing import TypeAlias

import networkx as nx
import numpy as np

from reference.floorplan import Plan, find, parse, read, to_text
from reference.floorplan.plan import OUTSIDE

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

    leads_out: off its floor for good, an exit or an entrance to stairs that go down.
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


@dataclass(frozen=True, eq=False)
class Building:
    """The whole building; arrays are (floors, rows, cols).

    kind      Kind of each cell
    area      index into `areas`, -1 where there is none
    landmark  index into `landmarks`, -1 where there is none
    origin    (row, col) of the origin of the metres
    body      main body: left, bottom, right, top in metres [A1]
    """

    plan: Plan
    kind: np.ndarray
    area: np.ndarray
    landmark: np.ndarray
    areas: tuple[Area, ...]
    landmarks: tuple[Landmark, ...]
    stairwells: tuple[Stairwell, ...]
    origin: tuple[int, int]
    body: tuple[float, float, float, float]

    @property
    def title(self) -> str:
        """What the drawing calls the building."""
        return self.plan.title

    @property
    def graph(self) -> Graph:
        """Rooms, stairwells and the outside, joined by doors, exits and stairs."""
        return self.plan.graph

    @property
    def ways(self) -> nx.MultiDiGraph:
        """The graph as people walk it: out by exits, down by stairs [A3]."""
        return self.plan.ways

    @property
    def floors(self) -> int:
        """How many floors."""
        return self.kind.shape[0]

    @cached_property
    def walkable(self) -> np.ndarray:
        """(floors, rows, cols) bool: where a body may stand [A7]."""
        return self.kind >= Kind.FLOOR

    @cached_property
    def exits(self) -> frozenset[int]:
        """Indices of the exits among the landmarks."""
        return frozenset(m.index for m in self.landmarks if m.kind is Kind.EXIT)

    @cached_property
    def entrances(self) -> frozenset[int]:
        """Indices of the stairwell entrances among the landmarks."""
        return frozenset(m.index for m in self.landmarks if m.kind is Kind.ENTRANCE)

    @cached_property
    def dead_ends(self) -> frozenset[int]:
        """Indices of the entrances whose stairs do not go down."""
        return frozenset(m for m in self.entrances if not self.landmarks[m].leads_out)

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
    def area_of(self) -> dict[str, Area]:
        """The room or stairwell that a node of the graph stands for, by its id."""
        return {area.id: area for area in self.areas}

    @cached_property
    def landmark_of(self) -> dict[str, Landmark]:
        """The landmark that an edge of the graph stands for, by its id."""
        return {mark.id: mark for mark in self.landmarks}

    def metres(self, row: float, col: float) -> tuple[float, float]:
        """Centre of a cell, metres east and north of the origin."""
        return col + 0.5 - self.origin[1], self.origin[0] - row - 0.5

    def cell(self, x: float, y: float) -> tuple[int, int]:
        """Row and column of the cell around a point."""
        return int(np.ceil(self.origin[0] - y)) - 1, int(np.floor(x + self.origin[1]))

    def graph_without(self, burnt: np.ndarray) -> Graph:
        """The graph without doors that have burnt; burnt: (landmarks,) bool [A6]."""
        doors = [self.landmarks[mark].id for mark in np.flatnonzero(burnt)]
        return intact(burn(self.graph, doors))

    def ways_out(self, floor: int) -> list[int]:
        """Landmarks that lead off a floor: exits, and entrances to stairs down."""
        return [m.index for m in self.landmarks if m.floor == floor and m.leads_out]

    def rooms(self, floor: int) -> list[Area]:
        """The rooms of a floor, corridors included, stairwells not."""
        return [a for a in self.areas if a.floor == floor and a.kind == "room"]


def burn(graph: Graph, doors: Iterable[str]) -> Graph:
    """A copy of the graph in which the edges with these ids are burnt [A6].

    Raises KeyError for an id that no edge of the graph has.
    """
    edges, burnt = defaultdict(list), graph.copy()
    for edge in graph.edges(keys=True):
        edges[edge[2]].append(edge)
    for edge in (edge for door in doors for edge in dict(edges)[door]):
        burnt.edges[edge]["state"] = "burnt"
    return burnt


def intact(graph: Graph) -> Graph:
    """The graph without what has burnt: a destroyed door is no way [A6, chosen]."""
    return nx.subgraph_view(
        graph, filter_edge=lambda *edge: graph.edges[edge]["state"] == "intact"
    )


def load(name: str) -> Building:
    """Read a floor file by path or shipped name and build it.

    Raises FloorPlanError for a mistake in the drawing, OSError for an unreadable file.
    """
    return build(read(find(name)))


@lru_cache(maxsize=4)
def building_of(plan: str) -> Building:
    """The building in the text of a floor file: how it travels to other processes.

    One object per drawing, since navigation and sight are kept with it.
    """
    return build(parse(plan))


def plan_of(building: Building) -> str:
    """The text of a building's floor file."""
    return to_text(building.plan)


def build(plan: Plan) -> Building:
    """Everything that follows from a checked drawing."""
    kind = _kinds(plan)
    origin, body = _main_body(kind)
    areas, landmarks = _areas(plan, origin), _landmarks(plan, origin)
    return Building(
        plan,
        kind,
        _indices(kind, areas),
        _indices(kind, landmarks),
        areas,
        landmarks,
        _stairwells(plan.graph, areas, landmarks),
        origin,
        body,
    )


def _kinds(plan: Plan) -> np.ndarray:
    """(floors, rows, cols) Kind of each cell."""
    kinds = []
    for storey in plan.storeys:
        kind = np.where(storey.signs == "#", Kind.WALL, Kind.OUTSIDE).astype(np.uint8)
        kind[storey.rooms] = Kind.FLOOR
        for part in (*storey.areas, *storey.gates):
            kind[tuple(part.cells.T)] = _KINDS[part.kind]
        kinds.append(kind[1:-1, 1:-1])
    return np.array(kinds)


_KINDS = {
    "room": Kind.FLOOR,
    "stairwell": Kind.STAIRS,
    "door": Kind.DOOR,
    "entrance": Kind.ENTRANCE,
    "exit": Kind.EXIT,
}


def _main_body(
    kind: np.ndarray,
) -> tuple[tuple[int, int], tuple[float, float, float, float]]:
    """Origin (row, col) and the box around all rooms and their walls [A1]."""
    rows, cols = np.nonzero((kind == Kind.FLOOR).any(axis=0))
    top, bottom = rows.min() - 1, rows.max() + 2  # the walls, and past the last row
    left, right = cols.min() - 1, cols.max() + 2
    row, col = int(top + bottom) // 2, int(left + right) // 2
    box = (float(left - col), float(row - bottom), float(right - col), float(row - top))
    return (row, col), box


def _areas(plan: Plan, origin: tuple[int, int]) -> tuple[Area, ...]:
    found: list[Area] = []
    for floor, storey in enumerate(plan.storeys):
        for part in storey.areas:
            name, cells = f"{floor + 1}/{part.name}", part.cells - 1
            place = floor, cells, _middle(cells, origin)
            found.append(Area(len(found), name, part.name, part.kind, *place))
    return tuple(found)


def _landmarks(plan: Plan, origin: tuple[int, int]) -> tuple[Landmark, ...]:
    wells = {n for n, kind in plan.ways.nodes(data="kind") if kind == "stairwell"}
    out = {
        key for _, end, key in plan.ways.edges(keys=True) if end in wells | {OUTSIDE}
    }
    found: list[Landmark] = []
    for floor, storey in enumerate(plan.storeys):
        for gate in storey.gates:
            name, kind, cells = (
                f"{floor + 1}/{gate.name}",
                _KINDS[gate.kind],
                gate.cells - 1,
            )
            sides = tuple(f"{floor + 1}/{side.name}" for side in gate.sides)
            sides += (OUTSIDE,) * (kind is Kind.EXIT)
            place = floor, cells, _middle(cells, origin)
            found.append(Landmark(len(found), name, kind, *place, sides, name in out))
    return tuple(found)


def _middle(cells: np.ndarray, origin: tuple[int, int]) -> tuple[float, float]:
    row, col = cells.mean(axis=0) + 0.5
    return float(col - origin[1]), float(origin[0] - row)


def _indices(
    kind: np.ndarray, things: tuple[Area, ...] | tuple[Landmark, ...]
) -> np.ndarray:
    """(floors, rows, cols) index of the thing that a cell belongs to, or -1."""
    index = np.full(kind.shape, -1, dtype=np.int16)
    for thing in things:
        index[thing.floor, *thing.cells.T] = thing.index
    return index


def _stairwells(
    graph: Graph, areas: tuple[Area, ...], landmarks: tuple[Landmark, ...]
) -> tuple[Stairwell, ...]:
    found = []
    mark = {m.id: m.index for m in landmarks}
    storeys = [a for a in areas if a.kind == "stairwell"]
    for letter in sorted({a.name for a in storeys}):
        mine = {a.floor: a for a in storeys if a.name == letter}
        first = next(iter(mine.values()))
        entrances = {
            floor: tuple(
                sorted(
                    {
                        mark[key]
                        for *_, key in graph.edges(a.id, keys=True)
                        if key in mark
                    }
                )
            )
            for floor, a in mine.items()
        }
        indices = {floor: a.index for floor, a in mine.items()}
        found.append(Stairwell(letter, first.cells, first.centre, indices, entrances))
    return tuple(found)
