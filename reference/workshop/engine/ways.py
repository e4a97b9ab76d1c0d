"""Where one may walk straight, and the shortest ways: mirrors `navigation`.

N  the numbers;  W  what ways are found with;  p, q  places;  d  metres to a goal
"""

from collections.abc import Iterator
from contextlib import contextmanager
from functools import lru_cache
from math import ceil, inf, sqrt
from math import floor as floor_of
from typing import Any, NamedTuple

import numpy as np

from reference.navigation import KEPT_WAYS, NEIGHBOURS, Navigation
from reference.workshop.engine.mirrors import compiled, mirrors

FIELDS = 512  # ways to single places that are kept
RING = 128  # queues of a search, in turn: metres of the dearest step, or more


class Ways(NamedTuple):
    """What ways are found with, in one building."""

    steps: np.ndarray  # (places,) bits: to which of NEIGHBOURS may one step?
    slot: np.ndarray  # (places,) the field of ways to each place, or -1
    fields: np.ndarray  # (FIELDS, S) the next place to single places
    used: np.ndarray  # (FIELDS + 1,) place that each field is of; the last: the oldest
    goal: np.ndarray  # (1,) of a search to one place, on its floor
    d: np.ndarray  # (S,) found by a search
    after: np.ndarray  # (S,) found by a search
    first: np.ndarray  # (RING,) the first place in each queue, or -1
    queue: np.ndarray  # (S,) where each place waits, or -1
    before: np.ndarray  # (S,) and before and after which place of that queue, or -1
    following: np.ndarray  # (S,)


@mirrors("navigation.StraightLines.reaches 0f95a7")
def reaches(N, clear, p, q):
    """Can a body walk straight from p to q?"""
    d_row = q // N.cols - p // N.cols
    d_col = q - p - d_row * N.cols
    if abs(d_row) > N.clear_reach or abs(d_col) > N.clear_reach:
        return False
    return clear[p, (d_row + N.clear_reach) * N.clear_side + d_col + N.clear_reach]


@mirrors("navigation.Navigation.nearest_free e02afb")
def nearest_free(N, cells, floor, x, y):
    """The walkable place of a floor whose centre is nearest to a point."""
    begin = floor * N.floor_size
    end = begin + N.floor_size
    row = np.int64(ceil(N.top - y)) - 1
    col = np.int64(floor_of(x + N.left))
    if 0 <= row < N.rows and 0 <= col < N.cols:
        p = begin + row * N.cols + col
        if cells[p].walkable:  # then it is this one, or one beside it on the border
            begin = max(begin, p - N.cols - 1)
            end = min(end, p + N.cols + 2)
    best = -1
    least = inf
    for p in range(begin, end):
        cell = cells[p]
        if cell.walkable:
            east = cell.x - x
            north = cell.y - y
            square = east * east + north * north
            if square < least:
                least = square
                best = p
    return best


@mirrors("navigation.Navigation.place_beyond a8b458")
def place_beyond(N, cells, door, side):
    """The place across a door cell from one side, an area; else the cell."""
    for step in (1, -1, N.cols, -N.cols):
        area = cells[door + step].area
        if area != -1 and area != side:
            return door + step
    return door


@mirrors("navigation.Navigation.next_place cd66a7")
def next_place(N, W, p, goal):
    """The next place from p on the shortest way to a goal of its floor."""
    size = N.floor_size
    start = goal // size * size
    k = np.int64(W.slot[goal])
    if k < 0:
        k = np.int64(W.used[-1])
        W.used[-1] = (k + 1) % len(W.fields)
        if W.used[k] >= 0:
            W.slot[W.used[k]] = -1
        search_to(N, W, W.d[:0], goal, -1)
        for q in range(size):
            W.fields[k, q] = W.after[q]
        W.used[k] = goal
        W.slot[goal] = k
    return start + np.int64(W.fields[k, p % size])


@compiled
def search_to(N, W, cost, goal, stop):
    """Search the ways to one place of its floor; the answer is in `W.d`, `W.after`.

    cost: (places,) or empty: all cost 1;  stop: as in `search`, a place
    """
    start = goal // N.floor_size * N.floor_size
    end = start + N.floor_size
    W.goal[0] = goal - start
    if stop >= 0:
        stop -= start
    search(W, W.steps[start:end], N.cols, W.goal, cost[start:end], stop, W.d, W.after)


@mirrors(
    "navigation.Navigation._search_floor 1d6e1d",
    "navigation.Navigation._steps_of 9de8ad",
)
def search(W, steps, cols, goals, cost, stop, d, after):
    """Metres from each place of a floor to the nearest goal, and the next place.

    Places are counted from the floor's first.
    cost: (S,) of places, empty: all cost 1;  stop: a place, or -1: whoever asks only
    for its way, which is found then

    Dijkstra's algorithm, with a queue for each metre: a place waits in that of the
    whole metres of d.  Where steps cost 1 or more, no place shortens the way of another
    in its queue, which so needs no order; where they cost less, places wait once more.
    Of equally short ways the next place is the one nearest to the goal, of equally near
    ones that of the highest number: so scipy's search decides.
    """
    diagonal = sqrt(2.0)
    offsets = (1, cols, -1, -cols, cols + 1, cols - 1, -cols - 1, 1 - cols)
    for p in range(len(steps)):
        d[p] = inf
        after[p] = p
        W.queue[p] = -1
    for queue in range(RING):
        W.first[queue] = -1
    waiting = 0
    for k in range(len(goals)):
        goal = goals[k]
        if d[goal] > 0.0:
            d[goal] = 0.0
            waiting += wait(W, goal, 0)

    metre = 0
    while waiting:
        if stop >= 0 and d[stop] <= metre:
            return
        while W.first[metre % RING] >= 0:
            p = np.int64(W.first[metre % RING])
            leave(W, p)
            waiting -= 1
            for k in range(8):
                if not steps[p] >> k & 1:
                    continue
                q = p + offsets[k]
                step = 1.0 if k < 4 else diagonal
                if len(cost):
                    step *= max(cost[p], cost[q])
                way = d[p] + step
                if way < d[q]:
                    d[q] = way
                    after[q] = p
                    waiting += wait(W, q, min(int(way), metre + RING - 1) % RING)
                elif way == d[q] and d[p] < way:
                    other = after[q]
                    if d[p] < d[other] or (d[p] == d[other] and p > other):
                        after[q] = p
        metre += 1


@compiled
def wait(W, p, queue):
    """Let a place wait in a queue, and no longer in another; 1: it did not wait."""
    waited = W.queue[p]
    if waited == queue:
        return 0
    if waited >= 0:
        leave(W, p)
    next_one = W.first[queue]
    if next_one >= 0:
        W.before[next_one] = p
    W.following[p] = next_one
    W.before[p] = -1
    W.first[queue] = p
    W.queue[p] = queue
    return 0 if waited >= 0 else 1


@compiled
def leave(W, p):
    """Take a place out of its queue."""
    one = W.before[p]
    other = W.following[p]
    if one >= 0:
        W.following[one] = other
    else:
        W.first[W.queue[p]] = other
    if other >= 0:
        W.before[other] = one
    W.queue[p] = -1


@mirrors("navigation.Navigation._search_floor 1d6e1d", entry=True)
def search_floor(W, start, end, cols, goals, cost, d, after):
    """`search` of all places of a floor, for the book."""
    search(W, W.steps[start:end], cols, goals, cost, -1, d, after)


# -- Before and after ---------------------------------------------------------------


def ways_of(nav: Navigation) -> Ways:
    """What ways are found with, begun once for a building."""
    kept: Ways = vars(nav).get("_ways") or begin(nav)
    vars(nav)["_ways"] = kept
    return kept


def begin(nav: Navigation) -> Ways:
    """Copy the steps of the book; make room to search."""
    size = nav.floor_size
    return Ways(
        steps=_steps(nav),
        slot=np.full(nav.places, -1, np.int32),
        fields=np.zeros((FIELDS, size), np.int32),
        used=np.append(np.full(FIELDS, -1), 0),
        goal=np.zeros(1, np.int64),
        d=np.zeros(size),
        after=np.zeros(size, np.int32),
        first=np.zeros(RING, np.int32),
        queue=np.zeros(size, np.int32),
        before=np.zeros(size, np.int32),
        following=np.zeros(size, np.int32),
    )


def _steps(nav: Navigation) -> np.ndarray:
    """(places,) bits: to which of NEIGHBOURS may one step?"""
    bits = np.zeros((nav.floors, nav.floor_size), np.uint8)
    for floor, steps in enumerate(nav.steps):
        start = np.repeat(np.arange(nav.floor_size), np.diff(steps.indptr))
        for k, (down, right) in enumerate(NEIGHBOURS):
            there = steps.indices - start == down * nav.cols + right
            bits[floor, start[there]] |= 1 << k
    return bits.ravel()


@contextmanager
def quick_ways(nav: Navigation) -> Iterator[None]:
    """Let strategies' searches of ways go by the compiled one meanwhile, equal results.

    Whoever has replaced the book's search keeps their own.
    """
    books = nav._search
    searched = getattr(books, "__wrapped__", None)
    if getattr(searched, "__func__", None) is Navigation._search_floor:
        nav._search = _quick_search(nav)
    try:
        yield
    finally:
        nav._search = books


def _quick_search(nav: Navigation) -> Any:
    """`Navigation._search`, compiled, with a memory of its own."""
    kept = vars(nav).get("_quick_search")
    if kept is not None:
        return kept
    W = ways_of(nav)
    size = nav.floor_size
    all_cost_1 = np.frombuffer(b"")

    @lru_cache(KEPT_WAYS)
    def search_of(
        floor: int, price: bytes | None, goals: tuple[int, ...]
    ) -> tuple[np.ndarray, np.ndarray]:
        start = floor * size
        ends = np.subtract(goals, start)
        cost = all_cost_1 if price is None else np.frombuffer(price)
        odd = price is not None and not 0 < cost.min() <= cost.max() < inf
        if odd or not 0 <= ends.min() <= ends.max() < size:
            return nav._search_floor(floor, price, goals)
        d = np.empty(size)
        after = np.empty(size, np.int32)
        search_floor(W, start, start + size, nav.cols, ends, cost, d, after)
        after += start
        return d, after

    vars(nav)["_quick_search"] = search_of
    return search_of
