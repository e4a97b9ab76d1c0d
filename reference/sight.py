"""What can be seen from where: rays of limited range, cast once per building.

Clauses: A3, B1, B2, B6, C6.  Walls do not move, so during a simulation a ray is a table
look-up.  A ray returns the first thing it meets; doors, entrances and exits stop it too
[B1, chosen: in the paper's engine triggers do], so only people standing
in a door see through it.  Bodies are seen through entrances, which have no leaf: so a
robot that Eq. 1 moves inside a stairwell still leads [A3, C6, chosen].  Rays go all
around, 360 degrees, and neither people nor flames stop one [B1, chosen].

    p, q   places (see navigation)
    k      number of a ray, counted counter-clockwise from east
"""

from dataclasses import dataclass
from functools import cache, lru_cache
from math import dist
from typing import Any, NamedTuple

import numpy as np

from reference.building import Building, Kind
from reference.navigation import Navigation, StraightLines, navigation_of, shifted
from reference.paper import RAYS

PATCH = 4
"""[B6, chosen] metres: directions that end in the same patch of floor count as one."""

DIM = 3.0
"""[B2, chosen] metres short of the limit of sight: what is farther is seen, but not
well, and does not count as explored. So who sees farther explores a room sooner."""


@dataclass(frozen=True)
class Hit:
    """What a ray returns: a label, how far away (m), and which landmark or body."""

    kind: str
    distance: float
    index: int = -1


class Direction(NamedTuple):
    """An unexplored direction: a ray that returns nothing [B2].

    patch  of floor it leads to;  place  its last place;  unit  vector along it
    """

    patch: int
    place: int
    unit: tuple[float, float]


class Sight:
    """Tables of what can be seen from every place of a building, at one range.

    sees       StraightLines: does p see q? (centre to centre)
    hits       (RAYS, places) the place a ray stops at, -1 where it returns nothing
    landmarks  per place, the nearest hit of each landmark that rays meet, by landmark,
               the nearest first
    open       per place, the directions whose rays return nothing, one per patch
    farthest   per place, the last free place of its longest ray
    patches    per place, the patch of floor it lies in
    rooms      per place, the room, or NOWHERE
    seen(p)       places in line of sight, and where rays end
    looked_at(p)  patches of floor seen well: nearer than the limit by DIM
    line(p, landmark)  places on the line to a landmark in view, and those on or
               beside it; both without p: flames one stands in do not bar the way out
    """

    def __init__(self, building: Building, reach: float):
        reach = min(reach, float(np.hypot(*building.kind.shape[1:])))  # see no farther
        self.building, self.reach = building, reach
        self.navigation: Navigation = navigation_of(building)
        clear = np.isin(building.kind, (Kind.FLOOR, Kind.STAIRS))
        through = clear | (building.kind == Kind.ENTRANCE)
        self.sees = StraightLines(through, building.walkable, reach, strict=False)
        self.hits = np.full((RAYS, building.kind.size), -1, dtype=np.int32)
        ends = np.empty_like(self.hits)
        centres, farthest = self.navigation.centres, np.arange(building.kind.size)
        longest = np.zeros(len(farthest))  # squared
        for k in range(RAYS):
            ends[k] = self._cast(k, clear)
            length = ((centres[ends[k]] - centres) ** 2).sum(axis=1)
            longer = length > longest
            farthest[longer], longest[longer] = ends[k, longer], length[longer]
        self.farthest: list[int] = farthest.tolist()
        self.landmarks = self._landmarks_met()
        self.open = self._open_directions(ends)
        self.patches: list[int] = self._patch_of(np.arange(building.kind.size)).tolist()
        self.rooms: list[int] = building.area.ravel().tolist()
        self.seen = cache(self._seen_from)
        self.looked_at = cache(self._looked_at_from)
        self.line = cache(self._line_to)

    def __reduce__(self) -> tuple[Any, tuple[Building, float]]:
        """Travel between processes as the building and the range."""
        return sight_of, (self.building, self.reach)

    def _cast(self, k: int, clear: np.ndarray) -> np.ndarray:
        """Cast one ray from every place; (places,) the last free place it passes."""
        known = self.building.kind != Kind.OUTSIDE
        everywhere = np.arange(clear.size)
        flying, ends = self.building.walkable.copy(), everywhere.copy()
        for d_row, d_col in _cells_along(2 * np.pi * k / RAYS, self.reach):
            there = everywhere + d_row * clear.shape[2] + d_col
            stopped = flying & ~shifted(clear, d_row, d_col)
            met = (stopped & shifted(known, d_row, d_col)).ravel()
            self.hits[k, met] = there[met]
            flying &= ~stopped
            ends[flying.ravel()] = there[flying.ravel()]
        return ends

    def _landmarks_met(self) -> list[dict[int, Hit]]:
        """Per place, the nearest hit of each landmark that rays meet, nearest first."""
        marks, centres = self.building.landmark.ravel(), self.navigation.centres
        k, p = np.nonzero((self.hits >= 0) & (marks[self.hits] >= 0))
        q = self.hits[k, p]
        metres = np.hypot(*(centres[q] - centres[p]).T)
        first = np.lexsort((metres, p))
        found: list[dict[int, Hit]] = [{} for _ in marks]
        met = (a[first].tolist() for a in (p, marks[q], metres))
        for here, mark, far in zip(*met, strict=True):
            if mark not in found[here]:
                kind = self.building.landmarks[mark].kind.name.lower()
                found[here][mark] = Hit(kind, far, mark)
        return found

    def _open_directions(self, ends: np.ndarray) -> list[tuple[Direction, ...]]:
        """List, per place, where rays that meet nothing end, one ray per patch.

        ends: (RAYS, places) the last free place that each ray passes.
        """
        centres = self.navigation.centres
        found: list[list[Direction]] = [[] for _ in range(ends.shape[1])]
        for floor in np.split(np.arange(len(found)), self.building.floors):
            k, p = np.nonzero((self.hits[:, floor] < 0) & (ends[:, floor] != floor))
            p = floor[p]
            end = ends[k, p]
            patch = self._patch_of(end)
            each = p * (patch.max(initial=0) + 1) + patch
            _, first = np.unique(each, return_index=True)
            first.sort()  # by ray: counter-clockwise from east
            p, end, patch = p[first], end[first], patch[first]
            off = centres[end] - centres[p]
            unit = off / np.linalg.norm(off, axis=1, keepdims=True)
            ways = (p.tolist(), patch.tolist(), end.tolist(), unit.tolist())
            for here, leads_to, there, along in zip(*ways, strict=True):
                found[here].append(Direction(leads_to, there, tuple(along)))
        return [tuple(directions) for directions in found]

    def _patch_of(self, p: np.ndarray) -> np.ndarray:
        """The patch of floor each place lies in."""
        floor, row, col = np.unravel_index(p, self.building.kind.shape)
        _, down, across = np.array(self.building.kind.shape) // PATCH + 1
        return (floor * down + row // PATCH) * across + col // PATCH

    def _seen_from(self, p: int) -> frozenset[int]:
        inside, hits = self.sees.reached_from(p), self.hits[:, p]
        met, ends = hits[hits >= 0], (way.place for way in self.open[p])
        return frozenset((*inside.tolist(), *met.tolist(), *ends))

    def _looked_at_from(self, p: int) -> frozenset[int]:
        seen = np.array([p, *self.seen(p)])
        off = self.navigation.centres[seen] - self.navigation.centres[p]
        well = seen[np.hypot(*off.T) <= self.reach - DIM]
        return frozenset(self.patches[q] for q in (p, *well.tolist()))

    def _line_to(self, p: int, landmark: int) -> tuple[frozenset[int], frozenset[int]]:
        marks, centres = self.building.landmark.ravel(), self.navigation.centres
        met = np.unique(self.hits[self.hits[:, p] >= 0, p])
        ends = met[marks[met] == landmark].tolist()
        end = min(ends, key=lambda q: dist(centres[q], centres[p]))
        on = frozenset(self.navigation.straight(p, end))
        steps = (0, 1, -1, self.navigation.cols, -self.navigation.cols)
        beside = {q + step for q in on for step in steps}
        return on, frozenset(beside - {p})

    def cast(self, p: int, k: int) -> Hit | None:
        """Cast the k-th ray from the middle of place p; what it meets, if anything."""
        q = int(self.hits[k, p])
        if q < 0:
            return None
        off = self.navigation.centres[q] - self.navigation.centres[p]
        kind = Kind(int(self.building.kind.ravel()[q]))
        mark = int(self.building.landmark.ravel()[q])
        return Hit(kind.name.lower(), float(np.hypot(*off)), mark)


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
