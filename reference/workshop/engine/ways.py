"""Where one may walk straight, and the shortest ways: mirrors `navigation`.

N  the numbers;  p, q  places;  d  metres to a goal
"""

from math import sqrt

import numpy as np

from reference.workshop.engine.mirrors import mirrors


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
    best = -1
    least = np.inf
    for p in range(floor * N.floor_size, (floor + 1) * N.floor_size):
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
def next_place(N, cells, fields, used, heap, found, p, goal):
    """The next place from p on the shortest way to a goal of its floor."""
    size = N.floor_size
    slot = cells[goal].field
    if slot < 0:
        slot = used[-1]
        used[-1] = (slot + 1) % len(fields)
        if used[slot] >= 0:
            cells[used[slot]].field = -1
        search(N, cells, goal, -1, fields[slot, :0], heap, found, fields[slot])
        used[slot] = goal
        cells[goal].field = slot
    return np.int64(fields[slot, p % size])


@mirrors(
    "navigation.Navigation._search_floor 1d6e1d",
    "navigation.Navigation._steps_of 9de8ad",
)
def search(N, cells, goal, stop, cost, heap, found, after):
    """The next place from each place of a floor on the way to a goal, in `after`.

    cost: of places, empty: all cost 1;  stop: a place where it may stop, or -1

    Pops what is nearest, of equally near places the highest number, and replaces only
    what is strictly longer: so scipy's search does.
    """
    size = N.floor_size
    start = goal // size * size
    diagonal = sqrt(2.0)
    cols = N.cols
    offsets = (1, cols, -1, -cols, cols + 1, cols - 1, -cols - 1, 1 - cols)
    for p in range(size):
        after[p] = start + p
        found[p].d = np.inf
        found[p].done = 0
    found[goal - start].d = 0.0
    heap[0].d = 0.0
    heap[0].p = goal - start
    count = 1
    while count:
        d = heap[0].d
        p = heap[0].p
        # the last goes down from the top
        count -= 1
        last_d = heap[count].d
        last_p = heap[count].p
        k = 0
        while True:
            child = 2 * k + 1
            if child >= count:
                break
            other = child + 1
            if other < count and (
                heap[other].d < heap[child].d
                or (heap[other].d == heap[child].d and heap[other].p > heap[child].p)
            ):
                child = other
            if heap[child].d < last_d or (
                heap[child].d == last_d and heap[child].p > last_p
            ):
                heap[k].d = heap[child].d
                heap[k].p = heap[child].p
                k = child
            else:
                break
        heap[k].d = last_d
        heap[k].p = last_p

        if found[p].done:
            continue
        found[p].done = 1
        if start + p == stop:
            return
        for k in range(8):
            if not cells[start + p].steps >> k & 1:
                continue
            q = p + offsets[k]
            if found[q].done:
                continue
            step = 1.0 if k < 4 else diagonal
            if len(cost):
                step *= max(cost[start + p], cost[start + q])
            if d + step < found[q].d:
                found[q].d = d + step
                after[q] = start + p
                at = count
                count += 1
                while at:
                    up = (at - 1) // 2
                    if heap[up].d < d + step or (
                        heap[up].d == d + step and heap[up].p > q
                    ):
                        break
                    heap[at].d = heap[up].d
                    heap[at].p = heap[up].p
                    at = up
                heap[at].d = d + step
                heap[at].p = q
