"""What is seen from a place, through holes: mirrors `rays`, for rows of the tables.

Sets of places are bits of the square around the place.

    p  place;  k  number of a ray, or of a bit of the square;  h  holes
    S  what does not move: `Still`;  R  where a row goes: `Room`
"""

from math import sqrt
from typing import Any, NamedTuple

import numpy as np

from reference.building import Building, Kind
from reference.rays import Sight, sight_of
from reference.workshop.engine.mirrors import compiled, mirrors

IN_LINE = 1  # bits of `square`
SEEN = 2
GROUND = 4
SEEN_ON_ALL_SIDES = 8
STOP = 16  # while a row is made

HITS = 0  # of `counts`
OPENS = 1
LOOKED = 2


class Still(NamedTuple):
    """What a Sight knows, for every row."""

    numbers: np.ndarray  # one record
    cells: np.ndarray  # (places,) CELL
    marks: np.ndarray  # (L,) MARK
    useful: np.ndarray  # (L,) bool
    clear: np.ndarray  # (places,) bool
    rooms: np.ndarray  # (places,) bool
    line: np.ndarray  # (places, k) bool, see StraightLines
    hits: np.ndarray  # (RAYS, places)
    ends: np.ndarray  # (RAYS, places)
    along: np.ndarray  # (RAYS, most, 2) cells that a ray enters; 0, 0 from its end on


class Room(NamedTuple):
    """Where a row goes; what is found is counted."""

    square: np.ndarray  # (side * side,) bits, all 0
    hits: np.ndarray  # HIT
    opens: np.ndarray  # OPEN
    looked: np.ndarray  # patches
    counts: np.ndarray  # (3,) hits, opens, patches looked at
    stops: np.ndarray  # (RAYS,) room for places where rays stop
    metres: np.ndarray  # (RAYS,) and how far
    plain: np.ndarray  # (L,) bool, landmarks in view without holes


@compiled
def bit_of(S, p, q):
    """Which bit of p's square is q's."""
    N = S.numbers[0]
    down = S.cells[q].down - S.cells[p].down + N.half
    return down * N.side + S.cells[q].right - S.cells[p].right + N.half


@compiled
def place_of(S, p, k):
    """The place of a bit."""
    N = S.numbers[0]
    return p + (k // N.side - N.half) * N.cols + k % N.side - N.half


@mirrors("rays.Sight._metres e5df4a", "building.distance cdc4c8")
def metres(S, p, q):
    """How far it is."""
    x = S.cells[q].x - S.cells[p].x
    y = S.cells[q].y - S.cells[p].y
    return sqrt(x * x + y * y)


@compiled
def is_hole(holes, mark):
    """Is this landmark one of the holes?"""
    for hole in holes:
        if hole == mark:
            return True
    return False


@mirrors("rays.Sight.cast 93f1bc", "rays.Sight._hit 43678f")
def add_stop(S, R, p, q, count):
    """Add a place where a ray stops, if it is a new one; how many there are then."""
    bit = bit_of(S, p, q)
    if R.square[bit] & STOP:
        return count
    R.square[bit] |= SEEN | STOP
    R.stops[count] = q
    R.metres[count] = metres(S, p, q)
    return count + 1


@mirrors("rays.Sight.open 38ba05", "building.lengths 2a16a2")
def add_open(S, R, p, q):
    """Add the direction of a ray that returns nothing, one for each patch."""
    patch = S.cells[q].patch
    if q == p:
        return
    for k in range(R.counts[OPENS]):
        if R.opens[k].patch == patch:
            return
    x = S.cells[q].x - S.cells[p].x
    y = S.cells[q].y - S.cells[p].y
    length = sqrt(x * x + y * y)
    way = R.opens[R.counts[OPENS]]
    way.x = x / length
    way.y = y / length
    way.patch = patch
    way.place = q
    R.counts[OPENS] += 1
    R.square[bit_of(S, p, q)] |= SEEN


@mirrors("rays.Sight._rays 975dc0", "rays.Sight._beyond 161cf9")
def cast_all(S, R, p, holes):
    """Cast all rays; how many places they stop at, in their order."""
    stops = np.int64(0)
    for k in range(len(S.hits)):
        stop = np.int64(S.hits[k, p])
        end = np.int64(S.ends[k, p])
        mark = np.int64(-1)
        if stop >= 0:
            mark = np.int64(S.cells[stop].mark)
        if mark >= 0 and S.useful[mark]:
            R.plain[mark] = True
        if mark >= 0 and is_hole(holes, mark):
            stop, end = fly_on(S, R, p, k, holes)
        if stop >= 0:
            stops = add_stop(S, R, p, stop, stops)
        else:
            add_open(S, R, p, end)
    return stops


@mirrors("rays.Sight._fly_on 5a0268")
def fly_on(S, R, p, k, holes):
    """Cast a ray through holes; where it stops, -1 for nowhere, and the last place."""
    N = S.numbers[0]
    end = np.int64(p)
    for step in range(S.along.shape[1]):
        d_row = S.along[k, step, 0]
        d_col = S.along[k, step, 1]
        if d_row == 0 and d_col == 0:
            break
        q = np.int64(p + d_row * N.cols + d_col)
        if not S.clear[q] and not is_hole(holes, S.cells[q].mark):
            return np.int64(-1) if S.cells[q].outside else q, end
        end = q
        R.square[bit_of(S, p, q)] |= IN_LINE | SEEN
    return np.int64(-1), end


@mirrors("rays.Sight.landmarks d794f7", "rays.Sight._stops ef0f08")
def add_hits(S, R, stops):
    """Add the nearest hit of each landmark, the nearest first."""
    # a stable order, as sorted() has it
    for k in range(1, stops):
        q = R.stops[k]
        d = R.metres[k]
        at = k
        while at > 0 and R.metres[at - 1] > d:
            R.stops[at] = R.stops[at - 1]
            R.metres[at] = R.metres[at - 1]
            at -= 1
        R.stops[at] = q
        R.metres[at] = d

    for k in range(stops):
        q = R.stops[k]
        mark = S.cells[q].mark
        if mark < 0 or not S.useful[mark]:
            continue
        known = False
        for j in range(R.counts[HITS]):
            hit = R.hits[j]
            if hit.mark == mark:
                known = True
                if R.metres[k] == hit.distance and q < hit.end:
                    hit.end = q  # of equally near ones the lowest
        if not known:
            hit = R.hits[R.counts[HITS]]
            hit.distance = R.metres[k]
            hit.mark = mark
            hit.kind = S.marks[mark].kind
            hit.end = q
            hit.of_room = R.plain[mark]
            R.counts[HITS] += 1


@mirrors("rays.Sight.in_line f9bdc8", "navigation.StraightLines.reached_from 1051c5")
def add_line(S, R, p):
    """Mark the places in line of sight; the ground among them."""
    N = S.numbers[0]
    wide = N.reach * 2 + 1
    for j in range(wide * wide):
        if S.line[p, j]:
            down = j // wide - N.reach + N.half
            right = j % wide - N.reach + N.half
            R.square[down * N.side + right] |= IN_LINE | SEEN


@compiled
def add_ground(S, R, p):
    """Mark what is of rooms in line of sight, or all of it if nothing is."""
    found = False
    for k in range(len(R.square)):
        if R.square[k] & IN_LINE and S.rooms[place_of(S, p, k)]:
            R.square[k] |= GROUND
            found = True
    if not found:
        for k in range(len(R.square)):
            if R.square[k] & IN_LINE:
                R.square[k] |= GROUND


@mirrors("rays.Sight.seen_on_all_sides c8331b", "rays.Sight._beside c744de")
def add_seen_on_all_sides(S, R, p):
    """Mark places in line of sight with all places beside them."""
    N = S.numbers[0]
    for k in range(len(R.square)):
        if R.square[k] & IN_LINE:
            q = place_of(S, p, k)
            if not (
                is_dark(S, R, p, q + 1)
                or is_dark(S, R, p, q - 1)
                or is_dark(S, R, p, q + N.cols)
                or is_dark(S, R, p, q - N.cols)
            ):
                R.square[k] |= SEEN_ON_ALL_SIDES


@compiled
def is_dark(S, R, p, q):
    """Does one walk there, out of sight?"""
    N = S.numbers[0]
    if q < 0 or q >= len(S.cells) or not S.cells[q].walkable:
        return False
    down = S.cells[q].down - S.cells[p].down
    right = S.cells[q].right - S.cells[p].right
    if abs(down) > N.half or abs(right) > N.half:
        return True
    return R.square[bit_of(S, p, q)] & IN_LINE == 0


@mirrors("rays.Sight.looked_at f12953")
def add_looked(S, R, p):
    """List the patches that are seen well, the lowest first."""
    N = S.numbers[0]
    add_patch(R, S.cells[p].patch)
    for k in range(len(R.square)):
        if R.square[k] & SEEN:
            q = place_of(S, p, k)
            if metres(S, p, q) <= N.well:
                add_patch(R, S.cells[q].patch)


@compiled
def add_patch(R, patch):
    """Add a patch to those that are sorted, if it is a new one."""
    at = R.counts[LOOKED]
    while at > 0 and R.looked[at - 1] > patch:
        at -= 1
    if at > 0 and R.looked[at - 1] == patch:
        return
    for k in range(R.counts[LOOKED], at, -1):
        R.looked[k] = R.looked[k - 1]
    R.looked[at] = patch
    R.counts[LOOKED] += 1


@mirrors("rays.Sight.seen cd35fb", entry=True)
def fill_row(S, R, p, holes):
    """Make the row of a place and the holes in view."""
    R.counts[:] = 0
    R.plain[:] = False
    stops = cast_all(S, R, p, holes)
    add_hits(S, R, stops)
    add_line(S, R, p)
    add_ground(S, R, p)
    if not len(holes):
        add_seen_on_all_sides(S, R, p)
    add_looked(S, R, p)
    for k in range(len(R.square)):
        R.square[k] &= ~np.uint8(STOP)


# -- All rays at once ---------------------------------------------------------------


@mirrors("rays.Sight._cast_everywhere 7a65e3", entry=True)
def cast_everywhere(along, known, clear, walkable, hits, ends):
    """Cast each ray from every place, cell by cell; grids are (floors, rows, cols)."""
    _, rows, cols = clear.shape
    for k in range(len(hits)):
        for p in range(hits.shape[1]):
            ends[k, p] = p
            floor = p // (rows * cols)
            row = p // cols % rows
            col = p % cols
            if not walkable[floor, row, col]:
                continue
            for step in range(along.shape[1]):
                down = along[k, step, 0]
                right = along[k, step, 1]
                if down == 0 and right == 0:
                    break
                i = row + down
                j = col + right
                if i < 0 or i >= rows or j < 0 or j >= cols:
                    break
                q = p + down * cols + right
                if not clear[floor, i, j]:
                    if known[floor, i, j]:
                        hits[k, p] = q
                    break
                ends[k, p] = q


def cells_along(sight: Sight) -> np.ndarray:
    """(RAYS, most, 2) offsets of the cells that a ray enters; 0, 0 after the last."""
    rays = [sight._cells_of_ray(k) for k in range(len(sight.hits))]
    along = np.zeros((len(rays), max(map(len, rays), default=0), 2), np.int32)
    for k, cells in enumerate(rays):
        along[k, : len(cells)] = np.reshape(cells, (-1, 2))
    return along


def cast_rays(sight: Sight, clear: np.ndarray) -> None:
    """`Sight._cast_everywhere`, compiled."""
    building = sight.building
    known = building.kind != Kind.OUTSIDE
    along = cells_along(sight)
    walkable = building.walkable.copy()  # it may be read-only: another type to numba
    cast_everywhere(along, known, clear, walkable, sight.hits, sight.ends)


def sight_made_quickly(building: Building, reach: float) -> Sight:
    """The book's Sight, with rays cast by compiled code: equal tables.

    Only where `engine_is_ready`: whoever has replaced the book's method keeps theirs.
    """
    kind: Any = Sight
    book = kind._cast_everywhere
    kind._cast_everywhere = cast_rays
    try:
        return sight_of(building, reach)
    finally:
        kind._cast_everywhere = book
