"""Where bodies may walk, and the shortest ways that never cut a corner [A7].

The paper's NavMesh becomes a grid of 1 m cells [A7, chosen]: a step goes to one of
eight neighbours, diagonally only where both cells beside it are free; ways are then
pulled straight wherever the straight line is free.  All floors share one numbering:

    p   place, a cell of the whole building: (floor * rows + row) * cols + col
    d   way to a goal, metres, inf where there is none
"""

from collections.abc import Iterable
from functools import lru_cache
from itertools import pairwise

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra

from reference.building import Building

LOOK_AHEAD = 6
"""[A7, chosen] metres over which a way is pulled straight at once."""

NEIGHBOURS = ((0, 1), (1, 0), (0, -1), (-1, 0), (1, 1), (1, -1), (-1, -1), (-1, 1))


def crossed(d_row: int, d_col: int) -> tuple[list[tuple[int, int]], list[list]]:
    """Cells that a straight line between two cell centres touches, ends left out.

    First those it runs through, in order; then, for every corner that it runs through
    exactly, the two cells beside that corner.
    """
    through: list[tuple[int, int]] = []
    corners = []
    row = col = 0
    n_row, n_col = abs(d_row), abs(d_col)
    down, right = (1 if d_row > 0 else -1), (1 if d_col > 0 else -1)
    i = j = 0  # borders crossed so far
    while (i, j) != (n_row, n_col):
        # the next border: at (2i + 1) / 2n_row or (2j + 1) / 2n_col of the line
        turn = (2 * i + 1) * n_col - (2 * j + 1) * n_row
        if turn == 0:
            corners.append([(row + down, col), (row, col + right)])
        if turn <= 0:
            i, row = i + 1, row + down
        if turn >= 0:
            j, col = j + 1, col + right
        through.append((row, col))
    return through[:-1], corners


def shifted(grid: np.ndarray, d_row: int, d_col: int) -> np.ndarray:
    """The grid seen from every cell at an offset; False beyond its edges."""
    rows, cols = grid.shape[1:]
    out = np.zeros_like(grid)
    if abs(d_row) < rows and abs(d_col) < cols:
        out[:, _overlap(-d_row, rows), _overlap(-d_col, cols)] = grid[
            :, _overlap(d_row, rows), _overlap(d_col, cols)
        ]
    return out


def _overlap(d: int, size: int) -> slice:
    return slice(max(0, d), size + min(0, d))


class Window:
    """For every place, which places around it a straight line reaches.

    `table[p, k]` answers for the k-th offset of a square of `2 * reach + 1` cells, so
    that a question about any number of pairs is one look-up.
    """

    def __init__(self, free: np.ndarray, ends: np.ndarray, reach: float, strict: bool):
        """free, ends: (floors, rows, cols) bool, what the line may cross and end in.

        At a corner that the line meets exactly, `strict` asks both cells beside it to
        be free (a body must pass), otherwise one is enough (a glance slips through).
        """
        self.cols = free.shape[2]
        self.reach = int(reach)
        self.side = 2 * self.reach + 1
        self.table = np.zeros((free.size, self.side**2), dtype=bool)
        for d_row in range(-self.reach, self.reach + 1):
            for d_col in range(-self.reach, self.reach + 1):
                if d_row**2 + d_col**2 <= reach**2:
                    line = self._line(free, ends, d_row, d_col, strict)
                    self.table[:, self._column(d_row, d_col)] = line.ravel()

    def _column(self, d_row: int, d_col: int) -> int:
        return (d_row + self.reach) * self.side + d_col + self.reach

    @staticmethod
    def _line(
        free: np.ndarray, ends: np.ndarray, d_row: int, d_col: int, strict: bool
    ) -> np.ndarray:
        through, corners = crossed(d_row, d_col)
        line = ends & shifted(ends, d_row, d_col)
        for cell in through:
            line &= shifted(free, *cell)
        for one, other in corners:
            pair = (shifted(free, *one), shifted(free, *other))
            line &= (pair[0] & pair[1]) if strict else (pair[0] | pair[1])
        return line

    def reaches(self, p: np.ndarray, q: np.ndarray) -> np.ndarray:
        """(k,) bool: does the line from place p to place q of the same floor arrive?"""
        d_row = q // self.cols - p // self.cols
        d_col = q % self.cols - p % self.cols
        near = (np.abs(d_row) <= self.reach) & (np.abs(d_col) <= self.reach)
        column = (d_row + self.reach) * self.side + d_col + self.reach
        return near & self.table[p, np.where(near, column, 0)]

    def reached_from(self, p: int) -> np.ndarray:
        """(k,) places that a straight line from p reaches, p among them."""
        k = np.flatnonzero(self.table[p])
        return (
            p + (k // self.side - self.reach) * self.cols + k % self.side - self.reach
        )


class Navigation:
    """Shortest ways through one building.

    walkable   (places,) bool
    centres    (places, 2) metres
    distance   (landmarks, places) metres to each landmark on its floor
    waypoint   (landmarks, places) the place to walk straight at on the way there
    """

    def __init__(self, building: Building):
        self.building = building
        self.floors, self.rows, self.cols = building.kind.shape
        self.places = building.kind.size
        self.walkable = building.walkable.ravel()
        self.floor_size = self.rows * self.cols
        self.centres = self._centres()
        self._steps = self._steps_of_floors()
        self._weighted: dict[int, tuple[np.ndarray, csr_matrix]] = {}
        self.clear = Window(building.walkable, building.walkable, LOOK_AHEAD, True)
        goals = [self.places_of(m.floor, m.cells) for m in building.landmarks]
        self.distance = np.full((len(goals), self.places), np.inf)
        self.waypoint = np.zeros((len(goals), self.places), dtype=np.int32)
        for index, goal in enumerate(goals):
            self.distance[index], self.waypoint[index] = self.field(goal)

    def _centres(self) -> np.ndarray:
        row, col = np.divmod(np.arange(self.places) % self.floor_size, self.cols)
        x, y = self.building.metres(row, col)
        return np.stack([x, y], axis=1)

    def _steps_of_floors(self) -> list[csr_matrix]:
        """(floor_size, floor_size) metres of every step, floor by floor."""
        free = self.building.walkable
        starts, ends, lengths = [], [], []
        for d_row, d_col in NEIGHBOURS:
            ok = free & shifted(free, d_row, d_col)
            if d_row and d_col:  # never cut a corner
                ok &= shifted(free, d_row, 0) & shifted(free, 0, d_col)
            p = np.flatnonzero(ok)
            starts.append(p)
            ends.append(p + d_row * self.cols + d_col)
            lengths.append(np.full(len(p), np.hypot(d_row, d_col)))
        where = (np.concatenate(starts), np.concatenate(ends))
        shape = (self.places, self.places)
        steps = csr_matrix((np.concatenate(lengths), where), shape=shape)
        parts = (self._part(floor) for floor in range(self.floors))
        return [steps[part, part] for part in parts]

    def _part(self, floor: int) -> slice:
        return slice(floor * self.floor_size, (floor + 1) * self.floor_size)

    def place(self, floor: int, x: float, y: float) -> int:
        """The place around a point; ValueError outside the drawing."""
        row, col = self.building.cell(x, y)
        if not (0 <= row < self.rows and 0 <= col < self.cols):
            raise ValueError(f"({x:g}, {y:g}) lies outside the drawing")
        return int((floor * self.rows + row) * self.cols + col)

    def places_at(self, floor: np.ndarray, position: np.ndarray) -> np.ndarray:
        """(n,) places of points inside the drawing; floor (n,), position (n, 2) m."""
        top, left = self.building.origin
        row = top - 1 - np.floor(position[:, 1]).astype(np.int64)
        col = left + np.floor(position[:, 0]).astype(np.int64)
        return (floor * self.rows + row) * self.cols + col

    def places_of(self, floor: int, cells: np.ndarray) -> np.ndarray:
        """(k,) places of (k, 2) rows and columns on one floor."""
        return (floor * self.rows + cells[:, 0]) * self.cols + cells[:, 1]

    def nearest_free(self, floor: int, x: float, y: float) -> int:
        """The walkable place of a floor whose centre is nearest to any point."""
        part = self._part(floor)
        free = np.flatnonzero(self.walkable[part]) + part.start
        off = self.centres[free] - (x, y)
        return int(free[np.argmin((off**2).sum(axis=1))])

    def beyond(self, door: int, side: int) -> int:
        """The place across a door cell from one of its sides (area index).

        The door cell itself where there is no other side.
        """
        areas = self.building.area.ravel()
        around = (door + 1, door - 1, door + self.cols, door - self.cols)
        across = (p for p in around if areas[p] not in (-1, side))
        return next(across, door)

    def distances(
        self, goals: Iterable[int], cost: np.ndarray | None = None
    ) -> np.ndarray:
        """(places,) metres to the nearest of the goals, which are all on one floor.

        cost: factor on every step into or out of a place (inf: no way), either
        (places,) or (floors, rows, cols); not to be written to afterwards.
        """
        goals = np.asarray(list(goals), dtype=np.int64)
        return self.shortest(goals, cost)[0]

    def way(
        self, start: int, goal: int, cost: np.ndarray | None = None
    ) -> tuple[float, list[int]]:
        """Length and corners of the shortest way, the goal last; (inf, []) if none."""
        d, after = self.shortest(np.array([goal]), cost)
        if not np.isfinite(d[start]):
            return np.inf, []
        chain = [start]
        while chain[-1] != goal:
            chain.append(int(after[chain[-1]]))
        return float(d[start]), self._pulled(chain, cost)

    def field(self, goals: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(places,) metres to the nearest goal, and (places,) where to walk at."""
        d, after = self.shortest(goals, None)
        aim, from_here = after, np.arange(self.places)
        while True:  # pull every way straight by one more step
            further = after[aim]
            longer = (further != aim) & self.clear.reaches(from_here, further)
            if not longer.any():
                return d, aim.astype(np.int32)
            aim = np.where(longer, further, aim)

    def shortest(
        self, goals: np.ndarray, cost: np.ndarray | None
    ) -> tuple[np.ndarray, np.ndarray]:
        """(places,) metres to the nearest goal, (places,) the next place on the way.

        At a goal, and where there is no way, the next place is the place itself.
        """
        d, after = np.full(self.places, np.inf), np.arange(self.places)
        if len(goals):
            floor = int(goals[0]) // self.floor_size
            part = self._part(floor)
            steps = self._steps[floor] if cost is None else self._dear(floor, cost)
            d[part], before, _ = dijkstra(
                steps,
                indices=goals - part.start,
                min_only=True,
                return_predecessors=True,
            )
            after[part] = np.where(before < 0, after[part], before + part.start)
        return d, after

    def _dear(self, floor: int, cost: np.ndarray) -> csr_matrix:
        """The steps of a floor, each as long as its dearer end makes it.

        The last answer is kept, since all robots ask about the same flames.
        """
        if floor not in self._weighted or self._weighted[floor][0] is not cost:
            steps, price = self._steps[floor], cost.ravel()[self._part(floor)]
            start = np.repeat(np.arange(self.floor_size), np.diff(steps.indptr))
            dear = steps.copy()
            dear.data *= np.maximum(price[start], price[steps.indices])
            self._weighted[floor] = cost, dear
        return self._weighted[floor][1]

    def straight(self, p: int, q: int) -> list[int]:
        """The places on the straight line from p to q of the same floor, p left out."""
        steps = int(4 * np.abs(self.centres[q] - self.centres[p]).max()) + 1
        points = np.linspace(self.centres[p], self.centres[q], steps + 1)[1:]
        floor = np.full(len(points), p // self.floor_size)
        return self.places_at(floor, points).tolist()

    def walk(self, p: int, landmark: int) -> list[int]:
        """The places one walks over from p to a landmark, p left out."""
        chain: list[int] = []
        while 0 < self.distance[landmark, p] < np.inf:
            waypoint = int(self.waypoint[landmark, p])
            chain += self.straight(p, waypoint)
            p = waypoint
        return chain

    def _pulled(self, chain: list[int], cost: np.ndarray | None) -> list[int]:
        """The corners that remain of a chain of neighbouring places."""
        if cost is not None:  # a straight line might graze what the way avoids
            return chain[1:] or chain
        corners = [chain[0]]
        for here, there in pairwise(chain):
            straight = self.clear.reaches(np.array([corners[-1]]), np.array([there]))
            if not straight[0]:
                corners.append(here)
        return [*corners[1:], chain[-1]]


@lru_cache(maxsize=8)
def navigation_of(building: Building) -> Navigation:
    """The navigation of a building, computed once."""
    return Navigation(building)
