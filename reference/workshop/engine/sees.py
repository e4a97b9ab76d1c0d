"""What one human sees now: mirrors `view`, and what it asks of `rays` and `navigation`.

N  the numbers, one record;  r  a row of the tables, one record
v  the view of who thinks, one record;  p, q  places
np.int64(x)  a variable, and what a function returns, have one type in all branches
"""

from math import sqrt
from typing import NamedTuple

import numpy as np

from reference.building import Kind
from reference.workshop.engine.mirrors import compiled, mirrors
from reference.workshop.engine.rows import IN_LINE, SEEN, SEEN_ON_ALL_SIDES
from reference.workshop.engine.state import NOT_TOLD
from reference.world import FLOOR_APART, Aim, Fate

FATE_INSIDE = int(Fate.INSIDE)
EXIT = int(Kind.EXIT)
ENTRANCE = int(Kind.ENTRANCE)
AIM_LANDMARK = int(Aim.LANDMARK)


class Observe(NamedTuple):
    """What the thinking of one person reads besides their own memory."""

    now: np.ndarray
    seen: np.ndarray
    cells: np.ndarray
    square: np.ndarray
    hits: np.ndarray
    opens: np.ndarray
    lists: np.ndarray
    burning: np.ndarray


# -- navigation, rays ---------------------------------------------------------------


@compiled
def in_square(N, cells, p, q):
    """Which bits of a place's square belong to q; -1: q is not in it."""
    d_row = cells[q].down - cells[p].down
    d_col = cells[q].right - cells[p].right
    if abs(d_row) > N.half or abs(d_col) > N.half:
        return -1
    return (d_row + N.half) * N.side + d_col + N.half


@mirrors("view.View.burns e0bba5")
def burns(N, observe, q):
    """Is there a flame in sight in this place?"""
    if q < 0 or q >= N.places or not observe.burning[q]:
        return False
    v = observe.now[0]
    k = in_square(N, observe.cells, v.place, q)
    return k >= 0 and observe.square[v.row, k] & SEEN != 0


@mirrors("navigation.Navigation.straight_way 320e98", "navigation.cells_crossed f7ab22")
def burns_on_way(N, observe, q, beside):
    """Is there a flame in sight on the straight way to q, or (if so) beside it?"""
    p = observe.now[0].place
    cols = N.cols
    d_row = q // cols - p // cols
    d_col = q % cols - p % cols
    row = 0
    col = 0
    down = 1 if d_row > 0 else -1
    right = 1 if d_col > 0 else -1
    while row != d_row or col != d_col:
        turn = (2 * abs(row) + 1) * abs(d_col) - (2 * abs(col) + 1) * abs(d_row)
        if turn <= 0:
            row += down
        if turn >= 0:
            col += right
        here = p + row * cols + col
        if burns(N, observe, here):
            return True
        if beside:
            for step in (1, -1, cols, -cols):
                if here + step != p and burns(N, observe, here + step):
                    return True
    return False


# -- who is near --------------------------------------------------------------------


@compiled
def lay_grid(N, grid, heads, near):
    """Lay a grid without bodies, its cells larger than `near`, over all floors."""
    grid.wide = near + 1e-6
    while True:
        grid.across = np.int64(N.cols / grid.wide) + 2
        grid.down = np.int64(N.rows / grid.wide) + 2
        cells = N.floors * grid.down * grid.across
        if cells <= len(heads):
            break
        grid.wide *= 2
    for cell in range(cells):
        heads[cell] = -1


@compiled
def grid_cell(N, grid, floor, x, y):
    """The cell of the grid that a point lies in."""
    col = min(max(np.int64((x + N.left) / grid.wide), 0), grid.across - 1)
    row = min(max(np.int64((N.top - y) / grid.wide), 0), grid.down - 1)
    return (floor * grid.down + row) * grid.across + col


@compiled
def grid_position(grid, cell):
    """Column and row of a cell of the grid, on its floor."""
    return cell % grid.across, cell // grid.across % grid.down


# -- view ---------------------------------------------------------------------------


@mirrors("view.View.burns_towards 087198")
def burns_towards(N, observe, place):
    """Is there a flame in sight on the straight way to a place of this floor?"""
    return observe.now[0].alight and burns_on_way(N, observe, place, False)


@mirrors(
    "view.View.passable c5d7c7",
    "rays.Sight.line c6220c",
    "rays.Sight._stops ef0f08",
    "rays.Sight._metres e5df4a",
)
def passable(N, observe, hit):
    """Is there no flame in sight on the straight way to a landmark in view?"""
    if not observe.now[0].alight:
        return True
    return not burns_on_way(N, observe, observe.hits[hit].end, False)


@mirrors("view.View.safe 7d9a46")
def safe(N, observe, hit):
    """Is there no flame in sight on or beside the straight way to a landmark?"""
    if not observe.now[0].alight:
        return True
    return not burns_on_way(N, observe, observe.hits[hit].end, True)


@compiled
def hit_of(observe, mark):
    """Where a landmark stands among those in view, -1 if it is not."""
    v = observe.now[0]
    for k in range(v.hits, v.hits_end):
        if observe.hits[k].mark == mark:
            return k
    return -1


@compiled
def sighted(observe, body):
    """Where a body stands among those in sight, -1 if it is not."""
    if body < 0:
        return -1
    for k in range(observe.now[0].seen):
        if observe.seen[k].j == body:
            return k
    return -1


@mirrors("view.View.burnt 7eb1b0")
def is_burnt(observe, mark):
    """Is this a destroyed door that rays meet, or that one stands in? [A6]"""
    v = observe.now[0]
    if v.here_burnt and v.here == mark:
        return True
    for k in range(v.holes, v.holes_end):
        if observe.lists[k] == mark:
            return True
    return False


@mirrors("view.see b1ea18")
def find_row(rows, cells, hits, lists, burnt, wanted, p):
    """The row of what is seen from p; -1: it is wanted first."""
    row = np.int64(cells[p].row)
    holes = 0
    wanted[0] = p
    while row >= 0:
        more = 0
        for k in range(rows[row].hits, rows[row].hits_end):
            mark = hits[k].mark
            known = False
            for h in range(holes):
                known = known or wanted[2 + h] == mark
            if burnt[mark] and not known:
                wanted[2 + holes + more] = mark
                more += 1
        if not more:
            return row
        holes += more
        row = np.int64(cells[p].row)
        while row >= 0:
            one = rows[row]
            same = one.holes_end - one.holes == holes
            for h in range(holes):
                if same:
                    there = False
                    for k in range(one.holes, one.holes_end):
                        there = there or lists[k] == wanted[2 + h]
                    same = there
            if same:
                break
            row = np.int64(one.next)
    wanted[1] = holes
    return row


@mirrors("view.look 420447")
def look(
    N, clock, bodies, spots, grid, heads, robots, burnt, cells, r, observe, row, i
):
    """Fill the view of one person; r: their row of the tables, number `row`."""
    me = bodies[i]
    v = observe.now[0]
    p = me.place
    cell = cells[p]
    v.time = clock.time
    v.rank = me.rank
    v.headway_time = me.headway_time
    v.row = row
    v.place = p
    v.patch = cell.patch
    v.room = cell.area
    v.here = cell.mark
    v.here_burnt = cell.mark >= 0 and burnt[cell.mark]
    v.alight = clock.alight
    v.hits = r.hits
    v.hits_end = r.hits_end
    v.opens = r.opens
    v.opens_end = r.opens_end
    v.holes = r.holes
    v.holes_end = r.holes_end
    v.looked = r.looked
    v.looked_end = r.looked_end

    # people, in any order, and then robots
    count = 0
    spot = spots[i]
    across, down = grid_position(grid, spot.cell)
    for d_row in range(-1 if down else 0, 2 if down < grid.down - 1 else 1):
        for d_col in range(-1 if across else 0, 2 if across < grid.across - 1 else 1):
            j = heads[spot.cell + d_row * grid.across + d_col]
            while j >= 0:
                x = spots[j].x - spot.x
                y = spots[j].y - spot.y
                if abs(x) < N.reach and abs(y) < N.reach and j != i:
                    k = in_square(N, cells, p, bodies[j].place)
                    if k >= 0 and observe.square[row, k] & IN_LINE:
                        them = bodies[j]
                        one = observe.seen[count]
                        one.j = j
                        one.place = them.place
                        one.metres = sqrt(x * x + y * y)
                        one.told = NOT_TOLD
                        one.rank = them.rank
                        one.leader = them.leader
                        one.landmark = them.landmark
                        count += 1
                j = spots[j].later

    v.robot = -1
    nearest = np.inf
    for k in range(len(robots)):
        robot = robots[k]
        if not robot.active:
            continue
        x = robot.x + FLOOR_APART * robot.floor - spot.x
        y = robot.y - spot.y
        if abs(x) < N.reach and abs(y) < N.reach:
            bit = in_square(N, cells, p, robot.place)
            if bit >= 0 and observe.square[row, bit] & IN_LINE:
                one = observe.seen[count]
                one.j = N.people + k
                one.place = robot.place
                one.metres = sqrt(x * x + y * y)
                one.told = robot.says
                if one.metres < nearest:
                    nearest = one.metres
                    v.robot = N.people + k
                count += 1
    v.seen = count


@mirrors("view.View.towards 415ab0")
def turn_towards_goal(me, p, cells, marks):
    """Turn from p to the goal, in sight or remembered, unless one is there."""
    here = cells[p]
    to_x = here.x
    to_y = here.y
    if me.aim == AIM_LANDMARK:
        mark = marks[me.which]
        to_x = mark.x
        to_y = mark.y
    elif me.place >= 0:
        there = cells[me.place]
        to_x = there.x
        to_y = there.y
    x = to_x - here.x
    y = to_y - here.y
    far = sqrt(x * x + y * y)
    if far:
        me.facing_x = x / far
        me.facing_y = y / far


@compiled
def is_seen_on_all_sides(N, observe, been, q):
    """Is q seen from a place where one has been, with all beside it?"""
    k = in_square(N, observe.cells, been, q)
    row = observe.cells[been].row
    return k >= 0 and observe.square[row, k] & SEEN_ON_ALL_SIDES != 0
