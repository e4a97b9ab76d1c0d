"""Bodies walk, give way and push; stairs: mirrors `motion` and `walking`.

One body after the other: what the book computes for all at once is computed here for
all before anything of it is used.  Sums over neighbours add in the book's order: of a
body's pairs first those with higher numbers, then those with lower ones.

    N  the numbers;  T  the tables;  S  the state;  W  what ways are found with
    w  who walks, a record WALKER;  pair  two neighbours, i < j
    np.int64(x)  a variable, and what a function returns, have one type in all branches
"""

from math import ceil, floor, inf, sqrt
from typing import NamedTuple

import numpy as np

from reference.workshop.engine.mirrors import compiled, mirrors
from reference.workshop.engine.sees import (
    FATE_INSIDE,
    grid_cell,
    grid_position,
    lay_grid,
)
from reference.workshop.engine.thinks import arrive
from reference.workshop.engine.ways import next_place


class Obstacles(NamedTuple):
    """What a body may not walk into."""

    cells: np.ndarray
    full_until: np.ndarray
    burning: np.ndarray
    clock: np.ndarray


# -- motion: who is near ------------------------------------------------------------


@mirrors("motion.neighbours 11aba2")
def neighbours(N, walkers, n, pairs, grid, heads):
    """Pairs on the same floor that are near each other; -1: no room for all."""
    if n < 2:
        return 0
    pace = walkers[0].pace
    for k in range(1, n):
        pace = max(pace, walkers[k].pace)
    near = max(N.NEIGHBOUR_METRES, N.body_diameter + 2 * pace * N.tick)
    square = near * near

    # chains of bodies in each cell of a grid, low numbers first
    lay_grid(N, grid, heads, near)
    for i in range(n - 1, -1, -1):
        w = walkers[i]
        w.cell = grid_cell(N, grid, w.floor, w.x, w.y)
        w.later = heads[w.cell]
        heads[w.cell] = i

    count = 0
    for i in range(n):
        w = walkers[i]
        across, down = grid_position(grid, w.cell)
        begin = count
        for d_row in range(-1 if down else 0, 2 if down < grid.down - 1 else 1):
            for d_col in range(
                -1 if across else 0, 2 if across < grid.across - 1 else 1
            ):
                j = heads[w.cell + d_row * grid.across + d_col]
                while j >= 0:
                    if j > i:
                        x = walkers[j].x - w.x
                        y = walkers[j].y - w.y
                        if x * x + y * y <= square:
                            if count == len(pairs):
                                return -1
                            k = count  # sorted by j
                            while k > begin and pairs[k - 1].j > j:
                                pairs[k].j = pairs[k - 1].j
                                k -= 1
                            pairs[k].j = j
                            pairs[count].i = i
                            count += 1
                    j = walkers[j].later
    return count


@mirrors(
    "motion._heading a60a40", "motion._right_of 11970d", "motion._directions 6d5f51"
)
def heading(N, w):
    """Head for the target, a little to the right of one that is far."""
    x = w.to_x - w.x
    y = w.to_y - w.y
    far = sqrt(x * x + y * y)
    e_x = x / max(far, 1e-9)
    e_y = y / max(far, 1e-9)
    aside = N.ASIDE_METRES if far > N.FAR_METRES else 0.0
    x = w.to_x + e_y * aside - w.x
    y = w.to_y + -e_x * aside - w.y
    far = sqrt(x * x + y * y)
    w.e_x = x / max(far, 1e-9)
    w.e_y = y / max(far, 1e-9)
    w.far = far
    w.v = min(w.pace, far / N.tick)


@mirrors("motion._pairs 2686ae")
def describe_pair(N, walkers, pair):
    """Describe neighbours: where they are from each other, who yields."""
    one = walkers[pair.i]
    other = walkers[pair.j]
    pair.i_yields = one.far > other.far  # of equals j, the higher number, yields
    x = other.x - one.x
    y = other.y - one.y
    apart = sqrt(x * x + y * y)
    pair.to_x = x / max(apart, 1e-9)
    pair.to_y = y / max(apart, 1e-9)
    pair.apart = apart
    along = one.e_x * other.e_x + one.e_y * other.e_y
    pair.facing = along < -N.TOWARDS and one.far + other.far > apart + N.body_diameter
    pair.room = N.SHOULDER_METRES if pair.facing else N.body_diameter


@mirrors("motion._push_weight abd95a")
def push_weight(N, s):
    """How strongly a neighbour turns a body away, by the gap to it."""
    root = 1 + s / (16 * N.PUSH_RANGE)
    for _ in range(4):
        root *= root
    return N.PUSH_STRENGTH * (1 / root)


@mirrors(
    "motion._heed_neighbours 485f08",
    "motion._turn_away 44d175",
    "motion._keep_gap c0d882",
    "motion._sums 6679bf",
    "motion._along 1862a8",
)
def heed_neighbours(N, walkers, n, pairs, count):
    """Turn away from neighbours, and slow down to keep the gap ahead."""
    for k in range(n):
        w = walkers[k]
        w.standing = w.v < N.IDLE_SPEED
        w.right = 0.0
        w.sum_x = 0.0
        w.sum_y = 0.0

    # turn: away from neighbours; who stands heeds only those who walk at them
    for k in range(count):
        pair = pairs[k]
        one = walkers[pair.i]
        other = walkers[pair.j]
        weight = push_weight(N, pair.apart - N.body_diameter)
        one_ahead = one.e_x * pair.to_x + one.e_y * pair.to_y
        other_ahead = other.e_x * -pair.to_x + other.e_y * -pair.to_y
        other_away = other.e_x * pair.to_x + other.e_y * pair.to_y
        one_away = one.e_x * -pair.to_x + one.e_y * -pair.to_y
        at_one = other_away < -N.TOWARDS
        at_other = one_away < -N.TOWARDS
        pair.push_i = weight if at_one or not one.standing else 0.0
        pair.push_j = weight if at_other or not other.standing else 0.0
        if at_one and one_ahead > N.TOWARDS:
            one.right = N.KEEP_RIGHT
        if at_other and other_ahead > N.TOWARDS:
            other.right = N.KEEP_RIGHT
        one.sum_x += pair.push_i * pair.to_x
        one.sum_y += pair.push_i * pair.to_y
    for k in range(count):
        pair = pairs[k]
        other = walkers[pair.j]
        other.sum_x += pair.push_j * -pair.to_x
        other.sum_y += pair.push_j * -pair.to_y
    for k in range(n):
        w = walkers[k]
        x = w.e_y * w.right - w.sum_x
        y = -w.e_x * w.right - w.sum_y
        x = (0.0 if w.standing else w.e_x) + x
        y = (0.0 if w.standing else w.e_y) + y
        strength = sqrt(x * x + y * y)
        w.turned_x = x / max(strength, 1e-9)
        w.turned_y = y / max(strength, 1e-9)
        if w.standing:
            w.v = min(strength, 1.0) * N.GIVE_WAY_SPEED

    # slow down: behind whoever is in front
    for k in range(count):
        pair = pairs[k]
        one = walkers[pair.i]
        other = walkers[pair.j]
        s = pair.apart - N.body_diameter
        one_front = in_front(N, one, pair.to_x, pair.to_y, pair.apart)
        other_front = in_front(N, other, -pair.to_x, -pair.to_y, pair.apart)
        gap = max(s, 0.0) / N.GAP_SECONDS
        if one_front and (pair.i_yields or not other_front):
            one.v = min(one.v, gap)
        if other_front and (not pair.i_yields or not one_front):
            other.v = min(other.v, gap)


@compiled
def in_front(N, w, to_x, to_y, apart):
    """Is a neighbour in the way of a body?"""
    ahead = w.turned_x * to_x + w.turned_y * to_y
    aside = abs(w.turned_x * to_y - w.turned_y * to_x)
    return ahead > 0 and aside * apart < N.body_diameter


# -- motion: walk, push, shuffle ----------------------------------------------------


@mirrors("navigation.Navigation.place 14a61e", "building.Building.cell 2190dc")
def place_around(N, level, x, y):
    """The place around a point; rounds otherwise than `place_at` beside a border."""
    row = np.int64(ceil(N.top - y)) - 1
    col = np.int64(floor(x + N.left))
    return (level * N.rows + row) * N.cols + col


@mirrors("navigation.Navigation.places_at 36077b")
def place_at(N, level, x, y):
    """The place of a point inside the drawing."""
    right = np.int64(floor(x))
    up = np.int64(floor(y))
    return (level * N.rows + N.top - 1 - up) * N.cols + N.left + right


@mirrors("walking.free_for 3bcca6")
def free(N, obstacles, w, x, y):
    """May one stand there? Not in walls, full doors, or flames unless reckless."""
    place = place_at(N, w.floor, x, y)
    # outside the drawing, where nobody gets; the book would look elsewhere or fail
    if place < 0 or place >= N.places:
        return False
    cell = obstacles.cells[place]
    mark = cell.mark
    if mark != w.inside and obstacles.full_until[mark] > obstacles.clock[0].time + 1e-9:
        return False
    return cell.walkable != 0 and (w.fearless != 0 or not obstacles.burning[place])


@mirrors("motion._not_into_walls 3ec4e0")
def not_into_walls(N, obstacles, w, x, y, to_x, to_y):
    """Slide along what is in the way: both coordinates, then one, then none."""
    if free(N, obstacles, w, to_x, to_y):
        return to_x, to_y
    if free(N, obstacles, w, to_x, y):
        return to_x, y
    if free(N, obstacles, w, x, to_y):
        return x, to_y
    return x, y


@mirrors("motion._push 0793c7")
def push(N, obstacles, walkers, n, pairs, count):
    """Push overlapping bodies apart, each by half; from `walked` to `moved`."""
    for k in range(n):
        w = walkers[k]
        w.moved_x = w.walked_x
        w.moved_y = w.walked_y
    for _ in range(N.PUSH_ROUNDS):
        overlap = False
        for k in range(count):
            pair = pairs[k]
            one = walkers[pair.i]
            other = walkers[pair.j]
            x = other.moved_x - one.moved_x
            y = other.moved_y - one.moved_y
            apart = sqrt(x * x + y * y)
            half = max(N.body_diameter - apart, 0.0) / 2
            pair.push_i = half * (x / max(apart, 1e-9))
            pair.push_j = half * (y / max(apart, 1e-9))
            overlap = overlap or half != 0.0
        if not overlap:
            break
        for k in range(n):
            walkers[k].sum_x = 0.0
            walkers[k].sum_y = 0.0
        for k in range(count):
            pair = pairs[k]
            walkers[pair.i].sum_x += pair.push_i
            walkers[pair.i].sum_y += pair.push_j
        for k in range(count):
            pair = pairs[k]
            walkers[pair.j].sum_x += -pair.push_i
            walkers[pair.j].sum_y += -pair.push_j
        for k in range(n):
            w = walkers[k]
            w.moved_x -= w.sum_x
            w.moved_y -= w.sum_y

    same = True
    for k in range(n):
        w = walkers[k]
        same = same and w.moved_x == w.walked_x and w.moved_y == w.walked_y
    if same:
        return
    for k in range(n):
        w = walkers[k]
        w.moved_x, w.moved_y = not_into_walls(
            N, obstacles, w, w.walked_x, w.walked_y, w.moved_x, w.moved_y
        )


@mirrors("motion._not_into_each_other 580b8e", "motion.Pairs.off 3cc630")
def not_into_each_other(walkers, n, pairs, count, shuffling):
    """Of two who would overlap, keep in place the one that yields; if need be, both.

    Goes from `walked` (where they may stay) to `tried`; shuffling: only pairs of which
    one is held up, and that one yields.
    """
    yields = not shuffling  # all do after the first round
    while True:
        clashes = False
        for k in range(n):
            walkers[k].back = 0
        for k in range(count):
            pair = pairs[k]
            one = walkers[pair.i]
            other = walkers[pair.j]
            one_counts = not shuffling or one.held
            other_counts = not shuffling or other.held
            if not (one_counts or other_counts):
                continue
            x = other.walked_x - one.walked_x
            y = other.walked_y - one.walked_y
            room = max(min(pair.room, sqrt(x * x + y * y)) - 1e-9, 0.0)
            x = other.tried_x - one.tried_x
            y = other.tried_y - one.tried_y
            if x * x + y * y < room * room:
                clashes = True
                if one_counts and (not yields or pair.i_yields):
                    one.back = 1
                if other_counts and (not yields or not pair.i_yields):
                    other.back = 1
        if not clashes:
            return
        for k in range(n):
            w = walkers[k]
            if w.back:
                w.tried_x = w.walked_x
                w.tried_y = w.walked_y
        yields = False


@mirrors("motion._turned 9a5816")
def turned(x, y, t):
    """A vector turned to the left by the angle whose half has the tangent t."""
    square = t * t
    cos = (1 - square) / (1 + square)
    sin = 2 * t / (1 + square)
    return x * cos - y * sin, x * sin + y * cos


@mirrors("motion._shuffle 046594")
def shuffle(N, obstacles, walkers, n, pairs, count, rng):
    """Let those who are held up try a random step, if there is room."""
    stride = N.SHUFFLE_SPEED * N.tick
    for k in range(n):
        walkers[k].meets = 0
        walkers[k].walked_x = walkers[k].tried_x
        walkers[k].walked_y = walkers[k].tried_y
    for k in range(count):
        pair = pairs[k]
        if pair.facing:
            one = walkers[pair.i]
            other = walkers[pair.j]
            if one.held and one.on_x * pair.to_x + one.on_y * pair.to_y > 0:
                one.meets = 1
            if other.held and other.on_x * -pair.to_x + other.on_y * -pair.to_y > 0:
                other.meets = 1
    for k in range(n):
        w = walkers[k]
        if not w.held:
            continue
        x = w.on_x
        y = w.on_y
        if w.meets:
            x, y = turned(x, y, -N.SHUFFLE_RIGHT)
        half = N.SHUFFLE_TURN * rng.uniform(-1.0, 1.0)
        x, y = turned(x, y, half)
        x, y = turned(x, y, half)
        x = w.walked_x + stride * x
        y = w.walked_y + stride * y
        if free(N, obstacles, w, x, y):
            w.tried_x = x
            w.tried_y = y
    not_into_each_other(walkers, n, pairs, count, True)


@mirrors("motion.step 2e6c0c", "motion._walk b8decd")
def step(N, obstacles, walkers, n, pairs, count, rng):
    """Move n bodies by one tick, from x, y to `tried`."""
    for k in range(n):
        heading(N, walkers[k])
    for k in range(count):
        describe_pair(N, walkers, pairs[k])
    if count:
        heed_neighbours(N, walkers, n, pairs, count)
    for k in range(n):
        w = walkers[k]
        e_x = w.turned_x if count else w.e_x
        e_y = w.turned_y if count else w.e_y
        metres = w.v * N.tick
        w.walked_x, w.walked_y = not_into_walls(
            N, obstacles, w, w.x, w.y, w.x + e_x * metres, w.y + e_y * metres
        )
        w.tried_x = w.walked_x
        w.tried_y = w.walked_y
    if not count:
        return

    push(N, obstacles, walkers, n, pairs, count)
    for k in range(n):
        w = walkers[k]
        w.tried_x = w.moved_x
        w.tried_y = w.moved_y
        w.walked_x = w.x
        w.walked_y = w.y
    not_into_each_other(walkers, n, pairs, count, False)

    any_held = False
    for k in range(n):
        w = walkers[k]
        there = w.far <= N.ARRIVED_METRES  # who is there may step aside
        w.on_x = w.turned_x if there else w.e_x
        w.on_y = w.turned_y if there else w.e_y
        advanced = (w.tried_x - w.x) * w.on_x + (w.tried_y - w.y) * w.on_y
        means_to = w.on_x != 0.0 or w.on_y != 0.0
        w.held = advanced < N.HELD_UP_SPEED * N.tick and means_to
        any_held = any_held or w.held != 0
    if any_held:
        shuffle(N, obstacles, walkers, n, pairs, count, rng)


# -- walking ------------------------------------------------------------------------


@mirrors("walking.targets cac0c6")
def target(N, cells, W, after, waypoint, clock, body, w):
    """Where one walks straight at; without headway, from cell to cell [A9, chosen]."""
    p = body.place
    mark = body.landmark
    cell = p % N.floor_size
    delayed = clock.time - body.headway_time > N.DETOUR_SECONDS
    w.to_x = body.target_x
    w.to_y = body.target_y
    if mark >= 0:
        at = np.int64(after[mark, cell] if delayed else waypoint[mark, cell])
    elif delayed:
        goal = place_around(N, p // N.floor_size, body.target_x, body.target_y)
        at = next_place(N, W, p, goal)
    else:
        return
    w.to_x = cells[at].x
    w.to_y = cells[at].y


@mirrors("walking.advance 2c1718", "walking._notice_stuck aa54cf")
def advance(N, cells, clock, bodies, touched, w):
    """Put one where they walked to; see whether they are stuck [B5]."""
    body = bodies[w.i]
    before = body.place
    place = place_at(N, w.floor, w.tried_x, w.tried_y)
    body.x = w.tried_x
    body.y = w.tried_y
    body.place = place

    moved = max(abs(body.x - body.headway_x), abs(body.y - body.headway_y))
    left = max(abs(body.goal_x - body.x), abs(body.goal_y - body.y))
    arrived = left < N.STUCK_METRES and body.landmark < 0
    waited = clock.time - body.headway_time - 1e-9
    anew = waited > N.STUCK_SECONDS + N.RECKLESS_SECONDS
    calm = body.reckless_until < clock.time - 1e-9
    if moved > N.STUCK_METRES or arrived or anew:
        body.headway_x = body.x
        body.headway_y = body.y
        body.headway_time = clock.time
    elif calm and waited > N.STUCK_SECONDS:
        body.reckless_until = clock.time + N.RECKLESS_SECONDS

    mark = cells[place].mark
    if mark >= 0 and mark != cells[before].mark:
        touched[clock.touched].i = w.i
        touched[clock.touched].before = before
        clock.touched += 1


@mirrors("walking.enter_stairs 43bb66")
def enter_stairs(N, T, clock, S, i, mark):
    """Move a human who has touched an entrance onto its stairs, which lead down."""
    body = S.bodies[i]
    k = T.marks[mark].stairwell
    well = T.wells[k]
    cell = T.lists[well.cells + i % (well.cells_end - well.cells)]
    body.stairwell = k
    body.leader = -1
    body.landmark = -1
    body.stairs_until = clock.time + N.stairs_metres / body.pace
    body.place = body.floor * N.floor_size + cell
    body.x = T.cells[body.place].x
    body.y = T.cells[body.place].y


@mirrors("walking.descend 4afe59")
def descend(N, T, clock, S, i):
    """Bring a human one storey down; the floor of a landing passed, else -1."""
    body = S.bodies[i]
    well = T.wells[body.stairwell]
    if body.floor > well.lowest:
        body.floor -= 1
        body.place -= N.floor_size
        if body.floor > well.lowest:
            body.stairs_until += N.stairs_metres / body.pace
            return body.floor
    step_out(N, T, clock, S, i, well)
    return np.int64(-1)


@mirrors("walking._step_out 2e050b", "building.lengths 2a16a2")
def step_out(N, T, clock, S, i, well):
    """Step out into an entrance cell that nobody stands in, if there is one."""
    body = S.bodies[i]
    for k in range(well.landings, well.landings_end):
        landing = T.landings[k]
        centre = T.cells[landing.place]
        taken = False
        for j in range(N.people):
            them = S.bodies[j]
            if them.fate != FATE_INSIDE or them.stairwell >= 0:
                continue
            if them.floor != well.lowest:
                continue
            x = them.x - centre.x
            y = them.y - centre.y
            if sqrt(x * x + y * y) < N.body_diameter:
                taken = True
                break
        if not taken:
            body.place = landing.place
            body.x = centre.x
            body.y = centre.y
            body.headway_x = centre.x
            body.headway_y = centre.y
            body.headway_time = clock.time
            body.stairwell = -1
            body.stairs_until = inf
            arrive(N, S.minds[i], S.memory[i], landing.mark, landing.beyond)
            return
