"""Find the rooms and doors of each floor, and join them to the graph of rooms.

Clauses: A1 (unit cells), A2 (rooms, doors), A3 (stairwells, entrances), A4 (exits).
Both the checks of a drawing and the building read what is found here.

    cell    row and column, counted from 1; row 0 and column 0 are a rim of outside
    area    a room, or a stairwell on one floor
    gate    a door, a stairwell entrance or an exit
    beside  sharing a side: touching at a corner is no contact
"""

import re
from collections import defaultdict
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations, pairwise
from math import dist
from typing import Literal

import networkx as nx
import numpy as np
from scipy import ndimage

from reference.paper import STAIRS_METRES

STAIRWELLS = "ABCD"
OUTSIDE = "outside"
Cell = Iterable[int]


@dataclass(frozen=True, eq=False)
class Part:
    """An area or a gate of one floor.

    kind     "room", "stairwell"; "door", "entrance" or "exit"
    cells    (k, 2) rows and columns
    words    of a room, the names in it, and where; if it has none, its id and first
             cell
    sides    of a gate, the areas beside it;  outside  is a blank beside it?
    """

    name: str
    kind: str
    cells: np.ndarray
    words: tuple[tuple[str, Cell], ...] = ()
    sides: tuple["Part", ...] = ()
    outside: bool = False

    def __str__(self) -> str:
        if self.kind == "stairwell":
            return f"stairwell {self.name}"
        return "an unnamed room" if "-" in self.name else f"the room '{self.name}'"


@dataclass(frozen=True)
class Storey:
    """One floor: its name and its rows, all of the plan's width, north first."""

    name: str
    rows: tuple[str, ...]

    @cached_property
    def signs(self) -> np.ndarray:
        """(rows + 2, columns + 2) one character each, with a rim of outside."""
        rim = " " * len(self.rows[0])
        rows = np.array([f" {row} " for row in (rim, *self.rows, rim)])
        return rows.view("U1").reshape(len(rows), -1)

    @cached_property
    def rooms(self) -> np.ndarray:
        """(rows + 2, columns + 2) bool: floor, and names written on it."""
        return (self.signs == ".") | (self.signs >= "a")

    @cached_property
    def area(self) -> np.ndarray:
        """(rows + 2, columns + 2) index into `areas`, -1 where there is none."""
        area = np.full(self.signs.shape, -1)
        wells = [p for letter in STAIRWELLS for p in pieces(self.signs == letter)]
        wells.sort(key=lambda cells: tuple(cells[0]))
        for index, cells in enumerate(pieces(self.rooms) + wells):
            area[tuple(cells.T)] = index
        return area

    @cached_property
    def areas(self) -> tuple[Part, ...]:
        """Rooms, then stairwells, each in reading order."""
        words: dict[int, list[tuple[str, Cell]]] = defaultdict(list)
        for row, line in enumerate(self.rows, 1):
            for word in re.finditer("[a-z]+", line):
                cell = row, word.start() + 1
                words[int(self.area[cell])].append((word[0], cell))
        found = []
        for index, cells in enumerate(pieces(self.area + 1)):
            name = str(self.signs[tuple(cells[0])])
            if name in STAIRWELLS:
                found.append(Part(name, "stairwell", cells))
            else:
                mine = words[index] or [(f"room-{index + 1}", cells[0])]
                found.append(Part(mine[0][0], "room", cells, tuple(mine)))
        return tuple(found)

    @cached_property
    def gates(self) -> tuple[Part, ...]:
        """Doors, then entrances, then exits, each in reading order."""
        found: dict[str, list[Part]] = {"door": [], "entrance": [], "exit": []}
        for sign in "+E":
            for cells in pieces(self.signs == sign):
                around = tuple(neighbours(cells).T)
                sides = [self.areas[k] for k in np.unique(self.area[around]) if k >= 0]
                stairs = any(side.kind == "stairwell" for side in sides)
                kind = "exit" if sign == "E" else "entrance" if stairs else "door"
                name = f"{kind}-{len(found[kind]) + 1}"
                outside = bool((self.signs[around] == " ").any())
                found[kind].append(Part(name, kind, cells, (), tuple(sides), outside))
        return (*found["door"], *found["entrance"], *found["exit"])


@dataclass(frozen=True)
class Plan:
    """A drawing without mistakes; width and height in cells of 1 m [A1]."""

    title: str
    width: int
    height: int
    storeys: tuple[Storey, ...]

    def parts(self, what: Literal["areas", "gates"]) -> list[tuple[int, str, Part]]:
        """Parts of all floors: floor from 1 upwards, id in the graph, and the part."""
        floors = enumerate(self.storeys, 1)
        return [(n, f"{n}/{p.name}", p) for n, s in floors for p in getattr(s, what)]

    @cached_property
    def graph(self) -> nx.MultiGraph:
        """Rooms, stairwells and the outside, joined by doors, entrances, exits, stairs.

        An edge's `length` goes, as the crow flies, from the middle of one side through
        the middle of the door to the middle of the other (metres).
        """
        graph = nx.MultiGraph()
        for n, name, area in self.parts("areas"):
            facts = {"kind": area.kind, "floor": n - 1, "area": len(area.cells)}
            graph.add_node(name, name=area.name, **facts)
        graph.add_node(OUTSIDE, name=OUTSIDE, kind=OUTSIDE)
        for n, name, gate in self.parts("gates"):
            graph.add_edges_from(_edges(n, name, gate))
        for letter in STAIRWELLS:
            floors = range(1, len(self.storeys) + 1)
            mine = [n for n in floors if f"{n}/{letter}" in graph]
            for low, up in pairwise(mine):
                facts = {"kind": "stairs", "width": 1, "length": STAIRS_METRES}
                ends = f"{low}/{letter}", f"{up}/{letter}", f"{letter}:{low}-{up}"
                graph.add_edge(*ends, **facts)
        return graph

    @cached_property
    def ways(self) -> nx.MultiDiGraph:
        """The graph as people walk it: out by exits, into stairs that lead down [A3].

        Nobody walks up: stairs are left by the entrances of the lowest floor only.
        """
        both, floor = nx.MultiDiGraph(self.graph), dict(self.graph.nodes(data="floor"))
        kinds = self.graph.nodes(data="kind")
        stairs = [edge for edge in both.edges(data="kind") if edge[2] == "stairs"]
        above = {start for start, end, _ in stairs if floor[start] > floor[end]}
        lowest = {node for node, kind in kinds if kind == "stairwell"} - above

        def walked(start: str, end: str, key: str) -> bool:
            match both.edges[start, end, key]["kind"]:
                case "stairs":
                    return bool(floor[start] > floor[end])
                case "entrance":
                    return end in above or start in lowest
                case _:
                    return start != OUTSIDE

        return nx.subgraph_view(both, filter_edge=walked)


def _edges(n: int, name: str, gate: Part) -> Iterator[tuple[str, str, str, dict]]:
    """Join the areas beside a gate of floor n, two by two."""
    middle = gate.cells.mean(axis=0)
    half = {f"{n}/{s.name}": dist(s.cells.mean(axis=0), middle) for s in gate.sides}
    if gate.kind == "exit":
        half[OUTSIDE] = 0.0
    for one, other in combinations(half, 2):
        facts = {"kind": gate.kind, "width": len(gate.cells)}
        yield one, other, name, facts | {"length": half[one] + half[other]}


def pieces(mask: np.ndarray) -> list[np.ndarray]:
    """Find the (k, 2) cells of each connected part of a mask, or of each label."""
    labels = ndimage.label(mask)[0] if mask.dtype == bool else mask
    cells, label = np.argwhere(labels), labels[labels > 0]
    ends = np.cumsum(np.bincount(label)[1:])
    return np.split(cells[np.argsort(label, kind="stable")], ends)[:-1]


def neighbours(cells: np.ndarray) -> np.ndarray:
    """(4 k, 2) the cells above, left, right and below each of (k, 2) cells."""
    return (cells[:, None] + [(-1, 0), (0, -1), (0, 1), (1, 0)]).reshape(-1, 2)
