"""What can be seen from where: rays of limited range, cast once per building.

Walls do not move, so during a simulation a ray is a table look-up.  A ray returns the
first thing it meets.  Doors, entrances and exits stop it too, though they have no
volume [A5, deviation: one room at a time is seen]; so only people standing in a door
see through it.  A destroyed door is a hole: rays pass it [A6, chosen].  Entrances have
no leaf, so bodies are seen through them: a robot that Eq. 1 sends into a stairwell
still leads [A3, C6, chosen].  Neither people nor flames stop a ray [B1, chosen].

Rays find landmarks, and where nobody has looked (`hits`, `ends`).  People and robots
are seen along the line between the middles of two cells (`sees`), flames in both ways.

    p, q   places (see navigation)
    k      number of a ray, counted counter-clockwise from east
"""

from collections.abc import Callable, Iterable
from functools import cache, cached_property, lru_cache, partial
from math import cos, pi, sin
from operator import attrgetter
from typing import Any, NamedTuple, TypeVar, cast

import numpy as np

from reference import paper
from reference.building import Building, Kind, distance, lengths, read_only
from reference.navigation import Navigation, StraightLines, navigation_of, shifted

RAY_STEP = 0.05  # metres between two points of a ray; it may miss a corner it cuts
ROUNDING = 1e-9  # cells: a point on a border lies east or south of it, however rounded
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


class Ray(NamedTuple):
    """A ray that flies on through a hole."""

    passed: list[int]  # places, the one that it comes from first
    stop: int  # the place that it stops at, -1 if it returns nothing


Method = TypeVar("Method", bound=Callable[..., Any])


def kept(method: Method) -> Method:
    """Cache a method's answers in its object; they are freed with the object."""

    def bind(sight: "Sight") -> Any:
        return lru_cache(KEPT)(partial(method, sight))

    return cast(Method, cached_property(bind))


class Sight:
    """What can be seen from every place of a building, at one range.

    sees     StraightLines: does p see q? (centre to centre)
    hits     (RAYS, places) the place a ray stops at, -1 where it returns nothing
    ends     (RAYS, places) the last free place it passes
    patches  (places,) the patch of floor each lies in
    rooms    places of rooms and their doors
    """

    def __init__(self, building: Building, reach: float):
        """Cast all rays from everywhere; reach: metres."""
        _, rows, cols = building.kind.shape
        reach = min(reach, distance((0, 0), (rows, cols)))  # nobody sees farther
        self.building = building
        self.reach = reach
        self.navigation: Navigation = navigation_of(building)
        clear = np.isin(building.kind, (Kind.FLOOR, Kind.STAIRS))
        self._clear = clear.ravel()
        through = clear | (building.kind == Kind.ENTRANCE)
        rooms = np.isin(building.kind, (Kind.FLOOR, Kind.DOOR))
        self.rooms = frozenset(np.flatnonzero(rooms).tolist())
        self.sees = StraightLines(through, building.walkable, reach, strict=False)
        self.hits = np.full((paper.RAYS, clear.size), -1, dtype=np.int32)
        self.ends = self.hits.copy()
        self._cast_everywhere(clear)
        self.patches = self._number_patches(paper.PATCH_METRES)
        self._clear_metres = reach - paper.DIM_METRES
        ways = [m for m in building.landmarks if m.leads_out or m.kind is Kind.DOOR]
        self._useful = {way.index for way in ways}
        self._walkable = frozenset(np.flatnonzero(building.walkable).tolist())
        self._marks: list[int] = building.landmark.ravel().tolist()
        self._centres: list[list[float]] = self.navigation.centres.tolist()
        read_only(self)

    def _cast_everywhere(self, clear: np.ndarray) -> None:
        """Cast each ray from every place at once, cell by cell."""
        known = self.building.kind != Kind.OUTSIDE
        places = np.arange(clear.size, dtype=np.int32)
        for k in range(paper.RAYS):
            flying = self.building.walkable
            self.ends[k] = places
            for d_row, d_col in self._cells_of_ray(k):
                there = places + d_row * clear.shape[2] + d_col
                stopped = flying & ~shifted(clear, d_row, d_col)
                met = (stopped & shifted(known, d_row, d_col)).ravel()
                flying = flying & ~stopped
                np.copyto(self.hits[k], there, where=met)
                np.copyto(self.ends[k], there, where=flying.ravel())

    def _cells_of_ray(self, k: int) -> list[tuple[int, int]]:
        """Offsets (row, col) of the cells that the k-th ray enters, in order."""
        return _cells_along(direction(k, len(self.hits)), self.reach)

    def _number_patches(self, side: int) -> np.ndarray:
        """(places,) numbers of square patches of floor, `side` cells wide."""
        floor, row, col = np.indices(self.building.kind.shape).reshape(3, -1)
        _, rows, cols = self.building.kind.shape
        down = rows // side + 1
        across = cols // side + 1
        return (floor * down + row // side) * across + col // side

    # -- One ray --------------------------------------------------------------------

    def cast(self, p: int, k: int) -> Hit | None:
        """Cast the k-th ray from the middle of place p; what it meets, if anything."""
        q = int(self.hits[k, p])
        return self._hit(p, q) if q >= 0 else None

    def _hit(self, p: int, q: int) -> Hit:
        """What a ray from p that stops at q returns."""
        kind = Kind(self.building.kind.flat[q]).name.lower()
        return Hit(kind, self._metres(p, q), self._marks[q])

    def _metres(self, p: int, q: int) -> float:
        return distance(self._centres[p], self._centres[q])

    # -- All rays from one place ----------------------------------------------------

    @kept
    def landmarks(self, p: int, holes: Holes = NO_HOLES) -> dict[int, Hit]:
        """Visible landmarks, nearest first: the nearest hit of each.

        Entrances of stairs that end on this floor are left out: a sign says so
        [B6, chosen].
        """
        nearest: dict[int, Hit] = {}
        met = [q for q in self._stops(p, holes) if self._marks[q] in self._useful]
        for hit in sorted((self._hit(p, q) for q in met), key=attrgetter("distance")):
            nearest.setdefault(hit.landmark, hit)
        return nearest

    @kept
    def open(self, p: int, holes: Holes = NO_HOLES) -> list[Direction]:
        """The directions whose rays return nothing, one for each patch [B2]."""
        ways: dict[int, Direction] = {}
        hits, ends = self._rays(p, holes)
        for q in dict.fromkeys(ends[hits < 0].tolist()):
            patch = int(self.patches[q])
            if q != p and patch not in ways:
                off = self.navigation.centres[q] - self.navigation.centres[p]
                x, y = (off / lengths(off)).tolist()
                ways[patch] = Direction(patch, q, (x, y))
        return list(ways.values())

    @kept
    def in_line(self, p: int, holes: Holes = NO_HOLES) -> frozenset[int]:
        """Places in line of sight."""
        line = frozenset(self.sees.reached_from(p).tolist())
        return line.union(*(ray.passed for ray in self._beyond(p, holes).values()))

    @kept
    def seen(self, p: int, holes: Holes = NO_HOLES) -> frozenset[int]:
        """Places in line of sight, and where rays end."""
        ends = (way.place for way in self.open(p, holes))
        return self.in_line(p, holes).union(self._stops(p, holes), ends)

    @kept
    def seen_on_all_sides(self, p: int) -> frozenset[int]:
        """Places in line of sight, all of whose walkable neighbours are, too."""
        line = self.in_line(p, NO_HOLES)
        dark = (self._beside(line) & self._walkable) - line
        return line - self._beside(dark)

    def _beside(self, places: Iterable[int]) -> set[int]:
        """The four neighbours of each of these places."""
        cols = self.navigation.cols
        return {q + step for q in places for step in (1, -1, cols, -cols)}

    @kept
    def looked_at(self, p: int, holes: Holes = NO_HOLES) -> frozenset[int]:
        """Patches of floor seen clearly: nearer than the limit by DIM_METRES [B2]."""
        seen = self.seen(p, holes)
        clear = [q for q in seen if self._metres(p, q) <= self._clear_metres]
        return frozenset(self.patches[[p, *clear]].tolist())

    @kept
    def line(
        self, p: int, landmark: int, holes: Holes
    ) -> tuple[frozenset[int], frozenset[int]]:
        """Places on the line to a landmark in view, and those on or beside it.

        p is in neither: flames where one stands bar no way out.
        """
        met = [q for q in self._stops(p, holes) if self._marks[q] == landmark]
        on = frozenset(self.navigation.straight_way(p, self.nearest(p, met)))
        return on, (on | self._beside(on)) - {p}

    def nearest(self, p: int, places: Iterable[int]) -> int:
        """The place nearest to p."""
        return min(sorted(places), key=lambda q: self._metres(p, q), default=p)

    def _stops(self, p: int, holes: Holes) -> list[int]:
        """The places where the rays from p stop, in the rays' order."""
        hits, _ = self._rays(p, holes)
        return list(dict.fromkeys(hits[hits >= 0].tolist()))

    def _rays(self, p: int, holes: Holes) -> tuple[np.ndarray, np.ndarray]:
        """`hits` and `ends` from p; rays that meet a hole fly on."""
        hits = self.hits[:, p].copy()
        ends = self.ends[:, p].copy()
        for k, ray in self._beyond(p, holes).items():
            hits[k] = ray.stop
            ends[k] = ray.passed[-1]
        return hits, ends

    @kept
    def _beyond(self, p: int, holes: Holes) -> dict[int, Ray]:
        """Rays from p that meet a hole, by their numbers [A6]."""
        hits = self.hits[:, p]
        met = np.isin(self.building.landmark.ravel()[hits], list(holes)) & (hits >= 0)
        return {k: self._fly_on(p, k, holes) for k in np.flatnonzero(met).tolist()}

    def _fly_on(self, p: int, k: int, holes: Holes) -> Ray:
        """Cast the k-th ray from p, through holes."""
        passed = [p]
        for d_row, d_col in self._cells_of_ray(k):
            q = p + d_row * self.navigation.cols + d_col
            if not self._clear[q] and self._marks[q] not in holes:
                wall = self.building.kind.flat[q] != Kind.OUTSIDE  # or a landmark
                return Ray(passed, stop=q if wall else -1)
            passed.append(q)
        return Ray(passed, stop=-1)


def direction(k: int, rays: int) -> tuple[float, float]:
    """Unit vector of the k-th of so many rays, east and north.

    Rounded to 12 decimals: libraries' sines and cosines differ in the 16th.
    """
    angle = 2 * pi * k / rays
    return round(cos(angle), 12), round(sin(angle), 12)


@cache
def _cells_along(unit: tuple[float, float], reach: float) -> list[tuple[int, int]]:
    """Offsets (row, col) of the cells a ray enters, in order, its own left out."""
    east, north = unit
    steps = RAY_STEP * np.arange(1, reach / RAY_STEP)
    rows = np.floor(0.5 - steps * north + ROUNDING).astype(int)
    cols = np.floor(0.5 + steps * east + ROUNDING).astype(int)
    cells = list(dict.fromkeys(zip(rows.tolist(), cols.tolist(), strict=True)))
    return [cell for cell in cells if cell != (0, 0)]


def sight_of(building: Building, reach: float) -> Sight:
    """The sight tables of a building at one range, computed once."""
    return _sight(building, reach, paper.RAYS, paper.PATCH_METRES, paper.DIM_METRES)


@lru_cache(maxsize=8)
def _sight(building: Building, reach: float, *numbers: float) -> Sight:
    """numbers: those of `paper` that the tables are made with."""
    return Sight(building, reach)
