"""A drawing becomes a graph of rooms, doors and stairwells, and a grid of cells.

Clauses: A1, A2, A3, A4, A6 and the coordinates of A8.  A student asks the graph with
networkx, the simulator asks the grid.

    row, col   place in the text, row 0 is the north edge
    x, y       metres, east and north; the main body's middle is the origin
    floor      0 is the first floor
"""

from collections.abc import Iterable
from dataclasses import dataclass, field
from enum import IntEnum
from functools import cached_property, lru_cache
from itertools import combinations, pairwise
from math import dist

import networkx as nx
import numpy as np
from scipy import ndimage

from reference.floorplan import Plan, find, parse, read, to_text
from reference.paper import STAIRS_SECONDS, WALKING_SPEED

OUTSIDE = "outside"


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
    graph: nx.MultiGraph = field(repr=False)

    @property
    def title(self) -> str:
        """What the drawing calls the building."""
        return self.plan.title

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

    def metres(self, row: float, col: float) -> tuple[float, float]:
        """Centre of a cell, metres east and north of the origin."""
        return col + 0.5 - self.origin[1], self.origin[0] - row - 0.5

    def cell(self, x: float, y: float) -> tuple[int, int]:
        """Row and column of the cell around a point."""
        return int(np.ceil(self.origin[0] - y)) - 1, int(np.floor(x + self.origin[1]))

    def ways_out(self, floor: int) -> list[int]:
        """Landmarks that lead off a floor: exits, and entrances to stairs down."""
        return [m.index for m in self.landmarks if m.floor == floor and m.leads_out]

    def rooms(self, floor: int) -> list[Area]:
        """The rooms of a floor, corridors included, stairwells not."""
        return [a for a in self.areas if a.floor == floor and a.kind == "room"]


def burn(graph: nx.MultiGraph, doors: Iterable[str]) -> nx.MultiGraph:
    """A copy of the graph in which the edges with these ids are burnt [A6].

    Raises KeyError for an id that no edge of the graph has.
    """
    edges = {key: (one, other, key) for one, other, key in graph.edges(keys=True)}
    burnt = graph.copy()
    nx.set_edge_attributes(burnt, {edges[door]: {"state": "burnt"} for door in doors})
    return burnt


def intact(graph: nx.MultiGraph) -> nx.MultiGraph:
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
    letters = np.array([[list(row) for row in s.rows] for s in plan.storeys])
    kind = _kinds(letters)
    origin, body = _main_body(kind)
    area, areas = _areas(letters, kind, origin)
    landmark, landmarks = _landmarks(kind, area, areas, origin)
    stairwells = _stairwells(areas, landmarks)
    graph = _graph(areas, landmarks, stairwells)
    return Building(
        plan, kind, area, landmark, areas, landmarks, stairwells, origin, body, graph
    )


def _kinds(letters: np.ndarray) -> np.ndarray:
    kind = np.full(letters.shape, Kind.FLOOR, dtype=np.uint8)
    for letter, meaning in ((" ", 0), ("#", 1), ("+", 3), ("E", 5)):
        kind[letters == letter] = meaning
    kind[(letters >= "A") & (letters <= "D")] = Kind.STAIRS
    for floor in kind:  # a '+' that touches a stairwell is its entrance [A3]
        doors, _ = ndimage.label(floor == Kind.DOOR)
        beside = ndimage.binary_dilation(floor == Kind.STAIRS)
        for number in np.unique(doors[beside & (doors > 0)]):
            floor[doors == number] = Kind.ENTRANCE
    return kind


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


def _middle(cells: np.ndarray, origin: tuple[int, int]) -> tuple[float, float]:
    row, col = cells.mean(axis=0) + 0.5
    return float(col - origin[1]), float(origin[0] - row)


def _areas(
    letters: np.ndarray, kind: np.ndarray, origin: tuple[int, int]
) -> tuple[np.ndarray, tuple[Area, ...]]:
    area = np.full(kind.shape, -1, dtype=np.int16)
    areas: list[Area] = []
    for floor in range(len(kind)):
        for what, mask in (
            ("room", kind[floor] == Kind.FLOOR),
            ("stairwell", kind[floor] == Kind.STAIRS),
        ):
            labels, count = ndimage.label(mask)
            for number in range(1, count + 1):
                cells = np.argwhere(labels == number)
                written = "".join(letters[floor][labels == number]).replace(".", "")
                if what == "stairwell":
                    written = written[0]
                name = written or f"room-{number}"
                centre = _middle(cells, origin)
                area[floor][labels == number] = len(areas)
                areas.append(
                    Area(
                        len(areas),
                        f"{floor + 1}/{name}",
                        name,
                        what,
                        floor,
                        cells,
                        centre,
                    )
                )
    return area, tuple(areas)


def _landmarks(
    kind: np.ndarray,
    area: np.ndarray,
    areas: tuple[Area, ...],
    origin: tuple[int, int],
) -> tuple[np.ndarray, tuple[Landmark, ...]]:
    where = np.full(kind.shape, -1, dtype=np.int16)
    found: list[Landmark] = []
    for floor in range(len(kind)):
        for meaning in LANDMARKS:
            labels, count = ndimage.label(kind[floor] == meaning)
            for number in range(1, count + 1):
                mask = labels == number
                beside = area[floor][ndimage.binary_dilation(mask)]
                sides = [areas[i].id for i in np.unique(beside[beside >= 0])]
                if meaning is Kind.EXIT:
                    sides.append(OUTSIDE)
                where[floor][mask] = len(found)
                cells = np.argwhere(mask)
                found.append(
                    Landmark(
                        len(found),
                        f"{floor + 1}/{meaning.name.lower()}-{number}",
                        meaning,
                        floor,
                        cells,
                        _middle(cells, origin),
                        tuple(sides),
                        _leads_out(meaning, floor, sides, areas),
                    )
                )
    return where, tuple(found)


def _leads_out(
    kind: Kind, floor: int, sides: list[str], areas: tuple[Area, ...]
) -> bool:
    below = {f"{floor + 1}/{a.name}" for a in areas if a.floor == floor - 1}
    wells = {a.id for a in areas if a.kind == "stairwell"}
    return kind is Kind.EXIT or not below.isdisjoint(wells.intersection(sides))


def _stairwells(
    areas: tuple[Area, ...], landmarks: tuple[Landmark, ...]
) -> tuple[Stairwell, ...]:
    found = []
    storeys = [a for a in areas if a.kind == "stairwell"]
    for letter in sorted({a.name for a in storeys}):
        mine = {a.floor: a for a in storeys if a.name == letter}
        first = next(iter(mine.values()))
        entrances = {
            floor: tuple(m.index for m in landmarks if a.id in m.sides)
            for floor, a in mine.items()
        }
        indices = {floor: a.index for floor, a in mine.items()}
        found.append(Stairwell(letter, first.cells, first.centre, indices, entrances))
    return tuple(found)


def _graph(
    areas: tuple[Area, ...],
    landmarks: tuple[Landmark, ...],
    stairwells: tuple[Stairwell, ...],
) -> nx.MultiGraph:
    """Rooms, stairwells and the outside, joined by doors, entrances, exits, stairs.

    An edge's `length` goes, as the crow flies, from the middle of one side through the
    middle of the door to the middle of the other (metres).
    """
    graph = nx.MultiGraph()
    for a in areas:
        graph.add_node(a.id, name=a.name, kind=a.kind, floor=a.floor, area=a.size)
    graph.add_node(OUTSIDE, name=OUTSIDE, kind=OUTSIDE)
    centre = {a.id: a.centre for a in areas}
    for mark in landmarks:
        half = {
            s: dist(centre.get(s, mark.position), mark.position) for s in mark.sides
        }
        for one, other in combinations(mark.sides, 2):
            graph.add_edge(
                one,
                other,
                key=mark.id,
                kind=mark.kind.name.lower(),
                width=mark.width,
                length=half[one] + half[other],
                state="intact",
            )
    for shaft in stairwells:
        _add_stairs(graph, shaft, areas)
    return graph


def _add_stairs(
    graph: nx.MultiGraph, shaft: Stairwell, areas: tuple[Area, ...]
) -> None:
    floors = sorted(shaft.areas)
    for lower, upper in pairwise(floors):
        graph.add_edge(
            areas[shaft.areas[lower]].id,
            areas[shaft.areas[upper]].id,
            key=f"{shaft.letter}:{lower + 1}-{upper + 1}",
            kind="stairs",
            width=1,
            length=STAIRS_SECONDS * WALKING_SPEED,
            state="intact",
        )
