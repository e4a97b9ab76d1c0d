"""What can be seen from where: rays of limited range, cast once per building.

Clauses: A3, A5, A6, B1, B2, B6, C6.  Walls do not move, so during a simulation a ray is
a table look-up.  A ray returns the first thing it meets.  Doors, entrances and exits
stop it too, though they have no volume [A5, deviation: one room at a time is seen]; so
only people standing in a door see through it.  A destroyed door is a hole: rays pass it
[A6, chosen].  Entrances have no leaf, so bodies are seen through them: a robot that
Eq. 1 sends into a stairwell still leads [A3, C6, chosen].  Neither people nor flames
stop a ray [B1, chosen].

    p, q   places (see navigation)
    k      number of a ray, counted counter-clockwise from east
"""

from collections.abc import Iterable
from functools import cache, lru_cache
from math import dist
from operator import attrgetter
from typing import Any, NamedTuple

import numpy as np

from reference import paper
from reference.building import Building, Kind
from reference.navigation import Navigation, StraightLines, navigation_of, shifted

KEPT = 1 << 15  # answers of each kind that are kept
Holes = frozenset[int]  # destroyed doors in view, which rays pass [A6]
NO_HOLES: Holes = frozenset()


class Hit(NamedTuple):
    """What a ray returns: a label, metres, and which landmark, if any [B1]."""

    kind: str
    distance: float
    landmark: int


class Direction(NamedTuple):
    """An unexplored direction: a ray that returns nothing [B2]."""

    patch: int  # of floor it leads to
    place: int  # the last that it passes
    unit: tuple[float, float]  # vector along it


class Sight:
    """What can be seen from every place of a building, at one range.

    sees     StraightLines: does p see q? (centre to centre)
    hits     (RAYS, places) the place a ray stops at, -1 where it returns nothing
    ends     (RAYS, places) the last free place it passes
    patches  (places,) the patch of floor each lies in
    rooms    places of rooms and their doors

    Once asked for, these are kept:

    landmarks(p, holes)  the nearest hit of each landmark that rays meet, by distance
    open(p, holes)       the directions whose rays return nothing, one per patch
    in_line(p, holes)    places in line of sight
    seen(p, holes)       those, and where rays end
    overlooked(p)        places in line of sight with all places beside them
    looked_at(p, holes)  patches of floor seen well: nearer than the limit by DIM
    line(p, landmark, holes)  places on the line to a landmark in view, and those on or
               beside it; p is in neither: flames where one stands bar no way out
    """

    def __init__(self, building: Building, reach: float):
        reach = min(reach, float(np.hypot(*building.kind.shape[1:])))  # see no farther
        self.building, self.reach = building, reach
        self.navigation: Navigation = navigation_of(building)
        clear = np.isin(building.kind, (Kind.FLOOR, Kind.STAIRS))
        self._clear, through = clear.ravel(), clear | (building.kind == Kind.ENTRANCE)
        rooms = np.isin(building.kind, (Kind.FLOOR, Kind.DOOR))
        self.rooms = frozenset(np.flatnonzero(rooms).tolist())
        self.sees = StraightLines(through, building.walkable, reach, strict=False)
        self.hits = np.full((paper.RAYS, clear.size), -1, dtype=np.int32)
        self.ends = self.hits.copy()
        self._cast_everywhere(clear)
        floor, row, col = np.indices(building.kind.shape).reshape(3, -1)
        _, down, across = np.array(building.kind.shape) // paper.PATCH_METRES + 1
        self.patches = (
            floor * down + row // paper.PATCH_METRES
        ) * across + col // paper.PATCH_METRES
        ways = [m for m in building.landmarks if m.leads_out or m.kind is Kind.DOOR]
        self._useful = {way.index for way in ways}
        self._walked = frozenset(np.flatnonzero(building.walkable).tolist())
        self._marks: list[int] = building.landmark.ravel().tolist()
        self._centres: list[list[float]] = self.navigation.centres.tolist()
        kept = lru_cache(KEPT)
        self._beyond = kept(self._flown_on)
        self.landmarks = kept(self._landmarks_from)
        self.open = kept(self._open_from)
        self.in_line = kept(self._in_line)
        self.seen = kept(self._seen_from)
        self.overlooked = kept(self._overlooked)
        self.looked_at = kept(self._looked_at_from)
        self.line = kept(self._line_to)

    def __reduce__(self) -> tuple[Any, tuple[Building, float]]:
        """Travel between processes as the building and the range."""
        return sight_of, (self.building, self.reach)

    def _cast_everywhere(self, clear: np.ndarray) -> None:
        """Cast all rays from every place at once.

        A ray flies on from where it parts from the one before: up to there both enter
        the same cells.
        """
        known, cells = self.building.kind != Kind.OUTSIDE, list[tuple[int, int]]()
        places = np.arange(clear.size, dtype=np.int32)
        cast = [(self.building.walkable, self.hits[0].copy(), places)]  # cell by cell
        for k in range(paper.RAYS):
            before, cells = cells, _cells_along(2 * np.pi * k / paper.RAYS, self.reach)
            same = [one == other for one, other in zip(before, cells, strict=False)]
            shared = [*same, False].index(False)
            del cast[shared + 1 :]
            for d_row, d_col in cells[shared:]:
                flying, hits, ends = cast[-1]
                there = places + d_row * clear.shape[2] + d_col
                stopped = flying & ~shifted(clear, d_row, d_col)
                met = (stopped & shifted(known, d_row, d_col)).ravel()
                flying = flying & ~stopped
                ends = np.where(flying.ravel(), there, ends)
                cast.append((flying, np.where(met, there, hits), ends))
            _, self.hits[k], self.ends[k] = cast[-1]

    def cast(self, p: int, k: int) -> Hit | None:
        """Cast the k-th ray from the middle of place p; what it meets, if anything."""
        q = int(self.hits[k, p])
        return self._hit(p, q) if q >= 0 else None

    def _hit(self, p: int, q: int) -> Hit:
        """What a ray from p that stops at q returns."""
        kind = Kind(self.building.kind.flat[q]).name.lower()
        return Hit(kind, self._metres(p, q), self._marks[q])

    def _metres(self, p: int, q: int) -> float:
        return dist(self._centres[p], self._centres[q])

    def _flown_on(self, p: int, holes: Holes) -> dict[int, tuple[list[int], int]]:
        """Rays from p that meet a hole: places passed, and where each stops, or -1."""
        hits = self.hits[:, p]
        met = np.isin(self.building.landmark.ravel()[hits], list(holes)) & (hits >= 0)
        beyond = {}
        for k in np.flatnonzero(met).tolist():
            passed, stop = [p], -1
            for d_row, d_col in _cells_along(2 * np.pi * k / paper.RAYS, self.reach):
                q = p + d_row * self.navigation.cols + d_col
                if not self._clear[q] and self._marks[q] not in holes:
                    stop = q
                    break
                passed.append(q)
            beyond[k] = passed, stop
        return beyond

    def _rays(self, p: int, holes: Holes) -> tuple[np.ndarray, np.ndarray]:
        """`hits` and `ends` from p; rays that meet a hole fly on."""
        hits, ends = self.hits[:, p], self.ends[:, p]
        if holes and (beyond := self._beyond(p, holes)):
            hits, ends = hits.copy(), ends.copy()
            for k, (passed, stop) in beyond.items():
                hits[k], ends[k] = stop, passed[-1]
        return hits, ends

    def _in_line(self, p: int, holes: Holes = NO_HOLES) -> frozenset[int]:
        line = frozenset(self.sees.reached_from(p).tolist())
        beyond = self._beyond(p, holes).values() if holes else ()
        return line.union(*(passed for passed, _ in beyond))

    def _overlooked(self, p: int) -> frozenset[int]:
        line, cols = self.in_line(p, NO_HOLES), self.navigation.cols
        around = {q + step for q in line for step in (1, -1, cols, -cols)}
        dark = self._walked & around - line
        return line - {q + step for q in dark for step in (1, -1, cols, -cols)}

    def nearest(self, p: int, places: Iterable[int]) -> int:
        """The place nearest to p."""
        return min(sorted(places), key=lambda q: self._metres(p, q), default=p)

    def _stops(self, p: int, holes: Holes) -> list[int]:
        """The places where the rays from p stop, in the rays' order."""
        hits, _ = self._rays(p, holes)
        return list(dict.fromkeys(hits[hits >= 0].tolist()))

    def _landmarks_from(self, p: int, holes: Holes = NO_HOLES) -> dict[int, Hit]:
        """Leave out entrances of stairs that end here: a sign says so [B6, chosen]."""
        nearest: dict[int, Hit] = {}
        met = [q for q in self._stops(p, holes) if self._marks[q] in self._useful]
        for hit in sorted((self._hit(p, q) for q in met), key=attrgetter("distance")):
            nearest.setdefault(hit.landmark, hit)
        return nearest

    def _open_from(self, p: int, holes: Holes = NO_HOLES) -> list[Direction]:
        ways: dict[int, Direction] = {}
        hits, ends = self._rays(p, holes)
        for q in dict.fromkeys(ends[hits < 0].tolist()):
            patch = int(self.patches[q])
            if q != p and patch not in ways:
                off = self.navigation.centres[q] - self.navigation.centres[p]
                x, y = (off / np.linalg.norm(off)).tolist()
                ways[patch] = Direction(patch, q, (x, y))
        return list(ways.values())

    def _seen_from(self, p: int, holes: Holes = NO_HOLES) -> frozenset[int]:
        ends = (way.place for way in self.open(p, holes))
        return self.in_line(p, holes).union(self._stops(p, holes), ends)

    def _looked_at_from(self, p: int, holes: Holes = NO_HOLES) -> frozenset[int]:
        seen = self.seen(p, holes)
        well = [q for q in seen if self._metres(p, q) <= self.reach - paper.DIM_METRES]
        return frozenset(self.patches[[p, *well]].tolist())

    def _line_to(
        self, p: int, landmark: int, holes: Holes
    ) -> tuple[frozenset[int], frozenset[int]]:
        met = sorted(q for q in self._stops(p, holes) if self._marks[q] == landmark)
        end = min(met, key=lambda q: self._metres(p, q))
        on = frozenset(self.navigation.straight(p, end))
        steps = (0, 1, -1, self.navigation.cols, -self.navigation.cols)
        beside = {q + step for q in on for step in steps}
        return on, frozenset(beside - {p})


@cache
def _cells_along(angle: float, reach: float) -> list[tuple[int, int]]:
    """Offsets (row, col) of the cells a ray enters, in order, its own left out."""
    east, south = np.cos(angle), -np.sin(angle)
    steps = np.arange(0.05, reach, 0.05)
    rows = np.floor(0.5 + steps * south + 1e-9).astype(int)
    cols = np.floor(0.5 + steps * east + 1e-9).astype(int)
    cells = list(dict.fromkeys(zip(rows.tolist(), cols.tolist(), strict=True)))
    return [cell for cell in cells if cell != (0, 0)]


@lru_cache(maxsize=8)
def sight_of(building: Building, reach: float) -> Sight:
    """The sight tables of a building at one range, computed once."""
    return Sight(building, reach)
