"""Where one may walk straight, and the shortest ways: mirrors `navigation`.

N  the numbers;  W  what ways are found with;  p, q  places;  d  metres to a goal
np.int64(x)  a variable, and what a function returns, have one type in all branches
"""

from collections.abc import Iterator
from contextlib import contextmanager
from functools import lru_cache, partial
from math import ceil, inf, sqrt
from math import floor as floor_of
from typing import Any, NamedTuple

import numpy as np

from reference.navigation import NEIGHBOURS, Navigation
from reference.workshop.engine.keeping import kept_with
from reference.workshop.engine.mirrors import compiled, mirrors

FIELDS = 512  # ways to single places that are kept
RING = 128  # queues of a search, in turn: more than the metres of the dearest step
DEAREST = 80.0  # what a metre may cost for that
KEPT_SEARCHES = 64  # of strategies, which ask again within a decision only


class Ways(NamedTuple):
    """What ways are found with, in one building."""

    steps: np.ndarray  # (places,) bits: to which of NEIGHBOURS may one step?
    slot: np.ndarray  # (places,) the field of ways to each place, or -1
    fields: np.ndarray  # (FIELDS, S) the next place to single places
    used: np.ndarray  # (FIELDS,) the place that each field is of, or -1
    oldest: np.ndarray  # (1,) the field that is used next
    goal: np.ndarray  # (1,) of a search to one place, on its floor
    d: np.ndarray  # (S,) found by a search
    after: np.ndarray  # (S,) found by a search: the next place
    best: np.ndarray  # (S,) how near that is
    all_cost_1: np.ndarray  # (S,)
    first: np.ndarray  # (RING,) where each queue begins in `queued`, or -1
    queued: np.ndarray  # places that wait
    following: np.ndarray  # where the queue of each goes on, or -1


@mirrors("navigation.StraightLines.reaches 3a9521")
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
            if square < least or best < 0:  # the first, where a square overflows
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
        k = np.int64(W.oldest[0])
        W.oldest[0] = (k + 1) % len(W.fields)
        if W.used[k] >= 0:
            W.slot[W.used[k]] = -1
        search_to(N, W, W.all_cost_1, goal, -1)
        for q in range(size):
            W.fields[k, q] = W.after[q]
        W.used[k] = goal
        W.slot[goal] = k
    return start + np.int64(W.fields[k, p % size])


@compiled
def search_to(N, W, cost, goal, stop):
    """Search the ways to one place of its floor; the answer: `W.d` and `W.after`.

    cost: (S,) of places of that floor;  stop: as in `search`
    """
    start = goal // N.floor_size * N.floor_size
    steps = W.steps[start : start + N.floor_size]
    W.goal[0] = goal - start
    search(W, steps, N.cols, W.goal, cost, stop, W.d)
    note_next_places(W, steps, N.cols, cost, W.d, W.after)


@mirrors(
    "navigation.Navigation._search_floor 1d6e1d",
    "navigation.Navigation._steps_of 9de8ad",
)
def search(W, steps, cols, goals, cost, stop, d):
    """Find metres from each place of a floor to the nearest goal, quickly if possible.

    False: some metre costs less than 1 or more than DEAREST. Then `note_next_places`
    may miss the way: a step that costs nothing leads no nearer.

    Places are counted from the floor's first.
    cost: (S,) of places;  stop: a place, or -1: whoever asks only for its way, which is
    found then

    Dijkstra's algorithm, with a queue for each metre: a place waits in that of the
    whole metres of d.  Since every step costs 1 or more, no place shortens the way of
    another in its queue, which so needs no order.
    """
    odd = 0
    for k in range(len(steps)):
        d[k] = inf
        odd += (cost[k] < 1.0) | (cost[k] > DEAREST)
    for k in range(len(goals)):
        d[goals[k]] = 0.0
    if odd:
        search_slowly(steps, cols, cost, d)
        return False

    diagonal = sqrt(2.0)
    offsets = (1, cols, -1, -cols, cols + 1, cols - 1, -cols - 1, 1 - cols)
    for k in range(RING):
        W.first[k] = -1
    count = 0
    for k in range(len(goals)):
        W.queued[k] = goals[k]
        W.following[k] = W.first[0]
        W.first[0] = k
        count += 1
    waiting = count
    metre = 0
    while waiting:
        if stop >= 0 and d[stop] <= metre:
            break
        at = np.int64(W.first[metre % RING])
        W.first[metre % RING] = -1
        while at >= 0:
            p = np.int64(W.queued[at])
            at = np.int64(W.following[at])
            waiting -= 1
            if d[p] < metre:
                continue  # it was in the queue of an earlier metre, too
            for k in range(8):
                # no step: then q is p, whose way gets no shorter
                q = p + offsets[k] if steps[p] >> k & 1 else p
                step = 1.0 if k < 4 else diagonal
                way = d[p] + step * max(cost[p], cost[q])
                if way < d[q]:
                    d[q] = way
                    queue = np.int64(way) % RING
                    W.queued[count] = q
                    W.following[count] = W.first[queue]
                    W.first[queue] = count
                    count += 1
                    waiting += 1
        metre += 1
    return True


@compiled
def search_slowly(steps, cols, cost, d):
    """Shorten ways until none is shorter, whatever a metre costs."""
    offsets = (1, cols, -1, -cols, cols + 1, cols - 1, -cols - 1, 1 - cols)
    is_new = True
    while is_new:
        is_new = False
        for p in range(len(steps)):
            for k in range(8):
                if steps[p] >> k & 1:
                    q = p + offsets[k]
                    step = 1.0 if k < 4 else sqrt(2.0)
                    way = d[p] + step * max(cost[p], cost[q])
                    if way < d[q]:
                        d[q] = way
                        is_new = True


@compiled
def note_next_places(W, steps, cols, cost, d, after):
    """Note the next place on the way from each, itself at a goal or where none leads.

    Of equally short ways that to the place nearest to the goal, of equally near ones
    that of the highest number: so scipy's search decides.
    """
    size = len(steps)
    for p in range(size):
        W.best[p] = inf
        after[p] = p
    offsets = (-cols - 1, -cols, 1 - cols, -1, 1, cols - 1, cols, cols + 1)
    bits = (6, 3, 7, 2, 0, 5, 1, 4)  # of these offsets among NEIGHBOURS
    for k in range(8):  # low numbers first
        p = max(0, -offsets[k])
        end = min(size, size - offsets[k])
        q = p + offsets[k]
        q_end = end + offsets[k]
        note_those_beside(
            q, 1 << bits[k], 1.0 if bits[k] < 4 else sqrt(2.0), steps[p:end],
            cost[p:end], d[p:end], W.best[p:end], after[p:end], cost[q:q_end],
            d[q:q_end],
        )  # fmt: skip


@compiled
def note_those_beside(q, bit, metres, steps, cost, d, best, after, its_cost, its_d):
    """Note each place's neighbour in one direction, the first is q, if it is better.

    Without branches, so that places are looked at four at a time.
    """
    for k in range(len(steps)):
        way = its_d[k] + metres * max(cost[k], its_cost[k])
        is_there = (steps[k] & bit) != 0
        is_on_way = is_there & (way == d[k]) & (its_d[k] < d[k])
        is_better = is_on_way & (its_d[k] <= best[k])
        best[k] = its_d[k] if is_better else best[k]
        after[k] = q + k if is_better else after[k]


@mirrors("navigation.Navigation._search_floor 1d6e1d", entry=True)
def search_floor(W, start, end, cols, goals, cost, d, after):
    """`search` of all places of a floor, and what follows each, for the book."""
    steps = W.steps[start:end]
    if not search(W, steps, cols, goals, cost, -1, d):
        return False
    note_next_places(W, steps, cols, cost, d, after)
    for p in range(len(after)):
        after[p] += start
    return True


# -- Before and after ---------------------------------------------------------------


def ways_of(nav: Navigation) -> Ways:
    """What ways are found with, begun once for a building."""
    return kept_with(nav, "ways", partial(begin, nav))


def begin(nav: Navigation) -> Ways:
    """Copy the steps of the book; make room to search."""
    size = nav.floor_size
    return Ways(
        steps=_steps(nav),
        slot=np.full(nav.places, -1, np.int32),
        fields=np.zeros((FIELDS, size), np.int32),
        used=np.full(FIELDS, -1),
        oldest=np.zeros(1, np.int64),
        goal=np.zeros(1, np.int64),
        d=np.zeros(size),
        after=np.zeros(size, np.int32),
        best=np.zeros(size),
        all_cost_1=np.ones(size),
        first=np.zeros(RING, np.int32),
        queued=np.zeros(9 * size + 1, np.int32),
        following=np.zeros(9 * size + 1, np.int32),
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
    if getattr(searched, "__func__", None) is not Navigation._search_floor:
        yield
        return
    nav._search = kept_with(nav, "search", partial(_quick_search, nav))
    try:
        yield
    finally:
        nav._search = books


def _quick_search(nav: Navigation) -> Any:
    """`Navigation._search`, compiled, with a memory of its own."""
    W = ways_of(nav)
    size = nav.floor_size
    all_cost_1 = np.ones(size).tobytes()

    @lru_cache(KEPT_SEARCHES)
    def search_of(
        floor: int, price: bytes | None, goals: tuple[int, ...]
    ) -> tuple[np.ndarray, np.ndarray]:
        start = floor * size
        ends = np.subtract(goals, start)
        cost = np.frombuffer(price or all_cost_1)
        d = np.empty(size)
        after = np.empty(size, np.int32)
        fits = len(ends) <= size and 0 <= ends.min() <= ends.max() < size
        asked = start, start + size, nav.cols, ends, cost
        if fits and search_floor(W, *asked, d, after):
            return d, after
        return nav._search_floor(floor, price, goals)

    return search_of
