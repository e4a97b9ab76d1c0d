"""Where bodies may walk, and the shortest ways that never cut a corner.

The paper's NavMesh becomes a grid of 1 m cells [A7, chosen]: a step goes
to one of eight neighbours, diagonally only where both cells beside it are free; ways
are then pulled straight wherever the straight line is free.  Of equally short ways, the
next place is the one nearest to the goal; of equally near places, the one with the
highest number [A7, chosen]: scipy breaks ties like that.  All floors share one
numbering:

    p   place, a cell of the whole building: (floor * rows + row) * cols + col
    d   way to a goal, metres, inf where there is none
"""

from collections.abc import Iterable
from functools import lru_cache
from itertools import pairwise

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra

from reference import paper
from reference.building import Building, lengths, read_only

KEPT_WAYS = 512  # searches that are kept: some 20 MB for the paper's building
NEIGHBOURS = ((0, 1), (1, 0), (0, -1), (-1, 0), (1, 1), (1, -1), (-1, -1), (-1, 1))


@lru_cache(4096)
def cells_crossed(d_row: int, d_col: int) -> tuple[list[tuple[int, int]], list[list]]:
    """List the cells that a line between two cell centres touches, without its ends.

    Returns the cells it runs through, in order; then, for every corner that it meets
    exactly, the two cells beside that corner. Both are kept: never change them.
    """
    through: list[tuple[int, int]] = []
    corners = []
    row = col = 0
    down = 1 if d_row > 0 else -1
    right = 1 if d_col > 0 else -1
    while (row, col) != (d_row, d_col):
        # The next border of a row is at (2 |row| + 1) / (2 |d_row|) of the line, that
        # of a column likewise. The sign of their difference tells which comes first.
        turn = (2 * abs(row) + 1) * abs(d_col) - (2 * abs(col) + 1) * abs(d_row)
        if turn == 0:
            corners.append([(row + down, col), (row, col + right)])
        if turn <= 0:
            row += down
        if turn >= 0:
            col += right
        through.append((row, col))
    return through[:-1], corners


def shifted(grid: np.ndarray, d_row: int, d_col: int) -> np.ndarray:
    """For every cell, the grid's value at an offset from it; False beyond the edges."""
    _, rows, cols = grid.shape
    down = abs(d_row)
    right = abs(d_col)
    wide = np.zeros((len(grid), rows + 2 * down, cols + 2 * right), dtype=grid.dtype)
    wide[:, down : down + rows, right : right + cols] = grid
    top = down + d_row
    left = right + d_col
    return wide[:, top : top + rows, left : left + cols]


class StraightLines:
    """A table of the places that a straight line from each place reaches.

    `table[p, k]` is for the k-th cell of the square around p that is `2 * reach + 1`
    cells wide, so that one look-up answers for any number of pairs.
    """

    def __init__(self, free: np.ndarray, ends: np.ndarray, reach: float, strict: bool):
        """free, ends: (floors, rows, cols) bool, what the line may cross and end in.

        At a corner that the line meets exactly, `strict` requires both cells beside it
        to be free (a body must pass); otherwise one is enough (for sight).
        """
        self.cols = free.shape[2]
        self.reach = int(reach)
        self.side = 2 * self.reach + 1
        self.table = np.zeros((free.size, self.side * self.side), dtype=bool)
        for k, (row, col) in enumerate(np.ndindex(self.side, self.side)):
            d_row = row - self.reach
            d_col = col - self.reach
            if d_row * d_row + d_col * d_col <= reach * reach:
                self.table[:, k] = _clear(free, ends, d_row, d_col, strict).ravel()

    def reaches(self, p: np.ndarray | int, q: np.ndarray | int) -> np.ndarray:
        """(k,) bool, or one: does the line from p to q of the same floor arrive?"""
        d_row = q // self.cols - p // self.cols
        d_col = q - p - d_row * self.cols
        near = (abs(d_row) <= self.reach) & (abs(d_col) <= self.reach)
        k = (d_row + self.reach) * self.side + d_col + self.reach
        inside = np.where(near, k, 0)  # beyond the square it is False anyway
        return near & self.table[p, inside]

    def reached_from(self, p: int) -> np.ndarray:
        """(k,) places that a straight line from p reaches, p among them."""
        row, col = np.divmod(np.flatnonzero(self.table[p]), self.side)
        return p + (row - self.reach) * self.cols + col - self.reach


def _clear(
    free: np.ndarray, ends: np.ndarray, d_row: int, d_col: int, strict: bool
) -> np.ndarray:
    """(floors, rows, cols) bool: does the line at one offset arrive, from each cell?"""
    through, corners = cells_crossed(d_row, d_col)
    line = ends & shifted(ends, d_row, d_col)
    for cell in through:
        line &= shifted(free, *cell)
    for cells in corners:
        one, other = (shifted(free, *cell) for cell in cells)
        line &= (one & other) if strict else (one | other)
    return line


class Navigation:
    """Shortest ways through one building.

    walkable  (places,) bool
    centres   (places, 2) metres
    steps     of each floor, (floor_size, floor_size) metres
    clear     StraightLines: can a body walk straight from p to q?
    goals     of each landmark, (k,) places of its cells
    metres    (landmarks, floor_size) from a place p of the landmark's floor to it, at
              [landmark, p % floor_size]
    waypoint  likewise: the place to walk straight at on that way
    to_landmarks  (places,) metres to the nearest landmark
    """

    def __init__(self, building: Building):
        self.building = building
        self.floors, self.rows, self.cols = building.kind.shape
        self.places = building.kind.size
        self.floor_size = self.rows * self.cols
        self.walkable = building.walkable.ravel()
        row, col = np.divmod(np.arange(self.places) % self.floor_size, self.cols)
        self.centres = np.stack(building.metres(row, col), axis=1)

        free = building.walkable
        self.clear = StraightLines(free, free, paper.LOOK_AHEAD_METRES, strict=True)
        self.steps = [self._steps_of(floor) for floor in range(self.floors)]
        self._search = lru_cache(KEPT_WAYS)(self._search_floor)

        self.goals = [self.places_of(m.floor, m.cells) for m in building.landmarks]
        self.metres = np.zeros((len(self.goals), self.floor_size))
        self.waypoint = np.zeros(self.metres.shape, dtype=np.int32)
        for mark, goal in enumerate(self.goals):
            self.metres[mark], self.waypoint[mark] = self._to_landmark(goal)
        self.to_landmarks = self.distance_to(*range(len(self.goals)))
        read_only(self)

    def _steps_of(self, floor: int) -> csr_matrix:
        """(floor_size, floor_size) metres of every step on one floor."""
        free = self.building.walkable[floor : floor + 1]
        starts = []
        for d_row, d_col in NEIGHBOURS:
            ok = free & shifted(free, d_row, d_col)
            if d_row and d_col:  # never cut a corner
                ok &= shifted(free, d_row, 0) & shifted(free, 0, d_col)
            starts.append(np.flatnonzero(ok))
        start = np.concatenate(starts)
        off = np.repeat(NEIGHBOURS, [len(some) for some in starts], axis=0)
        down, right = off.T
        ends = (start, start + down * self.cols + right)
        shape = (self.floor_size, self.floor_size)
        return csr_matrix((lengths(off), ends), shape=shape)

    # -- Places and points ----------------------------------------------------------

    def place(self, floor: int, x: float, y: float) -> int:
        """The place around a point inside the drawing."""
        row, col = self.building.cell(x, y)
        return int((floor * self.rows + row) * self.cols + col)

    def places_at(self, floor: np.ndarray, position: np.ndarray) -> np.ndarray:
        """(n,) places of points inside the drawing; floor (n,), position (n, 2) m."""
        top, left = self.building.origin
        right, up = np.floor(position).astype(np.int64).T
        return (floor * self.rows + top - 1 - up) * self.cols + left + right

    def places_of(self, floor: int, cells: np.ndarray) -> np.ndarray:
        """(k,) places of (k, 2) rows and columns on one floor."""
        return (floor * self.rows + cells[:, 0]) * self.cols + cells[:, 1]

    def nearest_free(self, floor: int, x: float, y: float) -> int:
        """Find the walkable place of a floor whose centre is nearest to a point."""
        start = floor * self.floor_size
        free = start + np.flatnonzero(self.walkable[start : start + self.floor_size])
        east, north = (self.centres[free] - (x, y)).T
        return int(free[np.argmin(east * east + north * north)])

    def place_beyond(self, door: int, side: int) -> int:
        """Find the place across a door cell, seen from one side; else the cell itself.

        side: index of the area that one comes from
        """
        areas = self.building.area.ravel()
        around = (door + 1, door - 1, door + self.cols, door - self.cols)
        across = (p for p in around if areas[p] not in (-1, side))
        return next(across, door)

    def straight_way(self, p: int, q: int) -> list[int]:
        """The places on the straight line from p to q of the same floor, p left out."""
        d_row = q // self.cols - p // self.cols
        d_col = q % self.cols - p % self.cols
        through, _ = cells_crossed(d_row, d_col)
        places = [p + row * self.cols + col for row, col in through]
        return places if p == q else [*places, q]

    # -- Ways -----------------------------------------------------------------------

    def distance_to(self, *landmarks: int) -> np.ndarray:
        """(places,) metres to the nearest of some landmarks; inf on other floors."""
        d = np.full((self.floors, self.floor_size), np.inf)
        for mark in landmarks:
            here = d[self.building.landmarks[mark].floor]
            np.minimum(here, self.metres[mark], out=here)
        return d.ravel()

    def _to_landmark(self, goals: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(floor_size,) metres to the nearest goal, and the place to walk at.

        That is the farthest on the way that can be walked to straight, as far as one
        step after the other is tried: where a step fails, a place keeps what it has.
        """
        floor = int(goals[0]) // self.floor_size
        start = floor * self.floor_size
        d, after = self._search_floor(floor, None, tuple(goals.tolist()))
        waypoint = after.copy()
        here = start + np.flatnonzero(np.isfinite(d))
        at = after[here - start]
        while len(here):  # pull ways straight by one more step, as long as it works
            further = after[at - start]
            longer = (further != at) & self.clear.reaches(here, further)
            here = here[longer]
            at = further[longer]
            waypoint[here - start] = at
        return d, waypoint

    def way(self, start: int, goal: int, cost: np.ndarray | None = None) -> list[int]:
        """The corners of the shortest way, the goal last; with cost: all its places.

        Empty if there is no way.
        """
        d, after = self.shortest([goal], cost)
        if not np.isfinite(d[start]):
            return []
        chain = [start]
        while chain[-1] != goal:
            chain.append(int(after[chain[-1]]))
        if cost is not None:  # a straight line might graze what the way avoids
            return chain[1:] or chain  # the chain is the goal alone
        return [*self.corners(chain), goal]

    def corners(self, chain: list[int]) -> list[int]:
        """List the places between a chain's straight walks, without its ends.

        A walk is at most LOOK_AHEAD_METRES long.
        """
        corners = [chain[0]]
        for here, there in pairwise(chain):
            if not self.clear.reaches(corners[-1], there):
                corners.append(here)
        return corners[1:]

    def next_place(self, p: int, *goals: int) -> int:
        """The next place from p on the shortest way to a goal of its floor."""
        floor, place = divmod(p, self.floor_size)
        return int(self._search(floor, None, goals)[1][place])

    def distances(
        self, goals: Iterable[int], cost: np.ndarray | None = None
    ) -> np.ndarray:
        """(places,) metres to the nearest of the goals, times costs; see `shortest`."""
        return self.shortest(goals, cost)[0]

    def shortest(
        self, goals: Iterable[int], cost: np.ndarray | None = None
    ) -> tuple[np.ndarray, np.ndarray]:
        """(places,) metres to the nearest goal, (places,) the next place on the way.

        At a goal, and where there is no way, the next place is the place itself.
        goals: places of one floor; cost: factor on every step into or out of a place
        (inf: no way), (places,) or (floors, rows, cols).
        """
        d = np.full(self.places, np.inf)
        after = np.arange(self.places)
        ends = tuple(map(int, goals))
        if not ends:
            return d, after
        floor = ends[0] // self.floor_size
        here = slice(floor * self.floor_size, (floor + 1) * self.floor_size)
        price = None
        if cost is not None:
            # as bytes, which a cache can look up: robots share the flames they avoid
            price = cost.ravel()[here].astype(float).tobytes()
        d[here], after[here] = self._search(floor, price, ends)
        return d, after

    def _search_floor(
        self, floor: int, price: bytes | None, goals: tuple[int, ...]
    ) -> tuple[np.ndarray, np.ndarray]:
        """`shortest` on one floor, (floor_size,) each; price: bytes of its costs."""
        steps = self.steps[floor]
        if price is not None:  # weigh each step by the higher cost of its two ends
            cost = np.frombuffer(price)
            left = np.repeat(cost, np.diff(steps.indptr))  # CSR: a row's entries
            steps = steps.copy()
            steps.data *= np.maximum(left, cost[steps.indices])
        start = floor * self.floor_size
        # The search begins at the goals: its predecessor of a place is the next place
        # on the way to a goal.
        ends = np.subtract(goals, start)
        d, before, _ = dijkstra(
            steps, indices=ends, min_only=True, return_predecessors=True
        )
        here = np.arange(self.floor_size)
        after = np.where(before < 0, here, before) + start
        return d, after.astype(np.int32)


def navigation_of(building: Building) -> Navigation:
    """The navigation of a building, computed once."""
    return _navigation_of(building, paper.LOOK_AHEAD_METRES)


@lru_cache(maxsize=8)
def _navigation_of(building: Building, look_ahead: float) -> Navigation:
    """Keep it, as long as the number that it reads does not change."""
    return Navigation(building)
