"""Algorithms 1 and 2 and the memory of people: mirrors `humans`, in its order.

A goal is three numbers: aim, which, place.  Memory is one row of numbers, see `State`.

    N  the numbers;  me  a record MIND;  mine  its memory;  observe  the view
    W  what ways are found with;  clear  where one may walk straight
    N.patches + 1 + patch  column 0 is patch NOWHERE, which the book's set may hold
    np.int64(x)  a variable, and what a function returns, have one type in all branches
"""

from math import sqrt

import numpy as np

from reference.workshop.engine.mirrors import compiled, mirrors
from reference.workshop.engine.rows import GROUND
from reference.workshop.engine.sees import (
    AIM_LANDMARK,
    ENTRANCE,
    EXIT,
    burns,
    burns_towards,
    hit_of,
    is_burnt,
    is_seen_on_all_sides,
    passable,
    safe,
    sighted,
)
from reference.workshop.engine.state import NOT_TOLD
from reference.workshop.engine.ways import next_place, reaches
from reference.world import Aim, Mode

AIM_NOTHING = int(Aim.NOTHING)
AIM_DIRECTION = int(Aim.DIRECTION)
AIM_LEADER = int(Aim.LEADER)
AIM_THRESHOLD = int(Aim.THRESHOLD)
FOLLOWER = int(Mode.FOLLOWER)
LEADER = int(Mode.LEADER)
STAY = (AIM_NOTHING, -1, -1)


# -- The algorithms -----------------------------------------------------------------


@mirrors(
    "humans.Follower.setoff bdfafb",
    "humans.leader_is_robot b9864a",
    "humans.act_on_instruction 7a90f3",
)
def follower_sets_off(N, me, observe):
    """Algorithm 1: one pass of lines 2-12 [B5, Alg. 1]."""
    if not stuck(N, me, observe) and me.leader == -1:  # Alg. 1:2
        return switch_mode(me)  # Alg. 1:3
    if leader_in_sight(N, me, observe):  # Alg. 1:5
        if me.told != NOT_TOLD and hit_of(observe, me.told) >= 0:  # Alg. 1:7
            return AIM_LANDMARK, me.told, -1  # Alg. 1:8
        return towards_leader(N, me, observe)  # Alg. 1:6
    return disconnect(N, me, observe)  # Alg. 1:10, 11


@mirrors("humans.Leader.setoff ecbd0a", "humans.go_to c61ec8")
def leader_sets_off(N, me, mine, observe, some):
    """Algorithm 2: one pass of lines 2-22 [B6, Alg. 2]."""
    nearest = exit_in_view(observe)
    if nearest >= 0:  # Alg. 2:2
        return AIM_LANDMARK, nearest, -1  # Alg. 2:3
    if observe.now[0].robot >= 0:  # robots lead [B6]
        return follow(N, me, observe, observe.now[0].robot)
    wanted = desired(N, me, mine, observe)
    if wanted >= 0:  # Alg. 2:5
        leader = suitable_leader(N, me, observe, wanted)
        if leader >= 0:  # Alg. 2:6
            return follow(N, me, observe, leader)  # Alg. 2:7
        return AIM_LANDMARK, wanted, -1  # Alg. 2:8, 9
    fresh = not_yet_visited(N, me, mine, observe)  # Alg. 2:11, 12
    if fresh < 0:  # Alg. 2:13
        direction = unexplored(N, me, mine, observe)
        if direction[0] != AIM_NOTHING:  # Alg. 2:14
            return direction  # Alg. 2:15
        return back_to_last_door(N, me, mine, observe, some)  # Alg. 2:16, 17
    return AIM_LANDMARK, fresh, -1  # Alg. 2:19, 20


@mirrors("humans.think 757297")
def think(N, me, mine, observe, some):
    """Let one human decide once where to go; True: not where they went before."""
    remember(N, me, mine, observe)
    if me.aim == AIM_THRESHOLD and observe.now[0].place != me.place:
        if not (burns(N, observe, me.place) or stuck(N, me, observe)):
            return False  # on past the door just entered
    if me.mode == LEADER:
        goal = leader_sets_off(N, me, mine, observe, some)
    else:
        goal = follower_sets_off(N, me, observe)
    if goal[0] != me.aim or goal[1] != me.which or goal[2] != me.place:
        me.aim = goal[0]
        me.which = goal[1]
        me.place = goal[2]
        return True
    return False


# -- Terms that the algorithms leave open -------------------------------------------


@mirrors("humans.stuck d3a8cc")
def stuck(N, me, observe):
    """Has this human tried to move without headway for STUCK_SECONDS? [B5, chosen]"""
    v = observe.now[0]
    halted = v.time - v.headway_time > N.STUCK_SECONDS + 1e-9
    return halted or v.time < me.waits_until


@mirrors("humans.exit_in_view 5f88ff")
def exit_in_view(observe):
    """The nearest exit that a ray meets, flames or not, or -1 [B6, Alg. 2:2]."""
    v = observe.now[0]
    for k in range(v.hits, v.hits_end):
        if observe.hits[k].kind == EXIT:
            return np.int64(observe.hits[k].mark)
    return -1


@mirrors("humans.desired 4c9fbe")
def desired(N, me, mine, observe):
    """The stair or door in view to go to, or -1 [B6, chosen]."""
    v = observe.now[0]
    if me.aim == AIM_LANDMARK and hit_of(observe, me.which) < 0:
        gone = mine[me.which] or is_burnt(observe, me.which)
        if not gone and not stuck(N, me, observe):
            return me.which
    first = -1
    first_stairs = -1
    kept = -1
    kept_stairs = -1
    for k in range(v.hits, v.hits_end):
        hit = observe.hits[k]
        if mine[hit.mark] or not safe(N, observe, k):
            continue
        mine_already = me.aim == AIM_LANDMARK and me.which == hit.mark
        if first < 0:
            first = k
        if mine_already:
            kept = k
        if hit.kind == ENTRANCE:
            if first_stairs < 0:
                first_stairs = k
            if mine_already:
                kept_stairs = k
    if first_stairs >= 0:
        return kept_or_nearest(N, observe, kept_stairs, first_stairs)
    return kept_or_nearest(N, observe, kept, first)


@mirrors("humans.not_yet_visited 6f20f2")
def not_yet_visited(N, me, mine, observe):
    """A door or stair in view, not yet visited, to be reached, or -1 [Alg. 2:13]."""
    v = observe.now[0]
    first = -1
    kept = -1
    for k in range(v.hits, v.hits_end):
        hit = observe.hits[k]
        if mine[hit.mark] or not passable(N, observe, k):
            continue
        if first < 0:
            first = k
        if me.aim == AIM_LANDMARK and me.which == hit.mark:
            kept = k
    return kept_or_nearest(N, observe, kept, first)


@mirrors("humans._kept_or_nearest 2020d7")
def kept_or_nearest(N, observe, kept, first):
    """The nearest, unless the goal is less than GOAL_HYSTERESIS farther."""
    if kept >= 0:
        farther = observe.hits[kept].distance - observe.hits[first].distance
        if farther < N.GOAL_HYSTERESIS:
            return np.int64(observe.hits[kept].mark)
    return np.int64(observe.hits[first].mark) if first >= 0 else -1


@mirrors(
    "view.View.leaders_to ec7e62",
    "view.View.followers_of b1901e",
    "humans.suitable_leader 580196",
)
def suitable_leader(N, me, observe, wanted):
    """The human in view worth following, or -1."""
    v = observe.now[0]
    if v.time < me.pause_until:
        return -1
    tried = np.inf  # the highest rank first
    last = -1  # of equals the lowest number first
    while True:
        best = -1
        rank = -1.0
        for k in range(v.seen):
            j = observe.seen[k].j
            if j >= N.people:
                break
            them = observe.seen[k]
            if them.landmark != wanted or them.leader >= 0 or not them.rank > v.rank:
                continue
            later = them.rank < tried or (them.rank == tried and j > last)
            equal = them.rank == rank and j < best
            if later and (best < 0 or them.rank > rank or equal):
                best = j
                rank = them.rank
        if best < 0:
            return -1
        followers = 0
        for k in range(v.seen):
            one = observe.seen[k]
            followers += one.j < N.people and one.leader == best
        if followers < N.MOST_FOLLOWERS:
            return best
        tried = rank
        last = best


@mirrors("humans.leader_in_sight 6424de")
def leader_in_sight(N, me, observe):
    """Is the leader in line of sight, or was it a moment ago? [B5, Alg. 1:5]"""
    if sighted(observe, me.leader) >= 0:
        return True
    if me.leader == -1 or observe.now[0].place == me.seen_place:
        return False
    return observe.now[0].time - me.seen_at < N.LEADER_GRACE_SECONDS


@mirrors("humans.unexplored 051184", "view.View.open ffc6c9")
def unexplored(N, me, mine, observe):
    """The unexplored direction that needs the least turning, or STAY [B2]."""
    v = observe.now[0]
    if me.aim == AIM_DIRECTION and me.which != -1 and me.which != v.patch:
        if not burns_towards(N, observe, me.place):
            return me.aim, me.which, me.place
    best = -1
    least = 0.0
    for k in range(v.opens, v.opens_end):
        way = observe.opens[k]
        if mine[N.patches + 1 + way.patch] or burns_towards(N, observe, way.place):
            continue
        turn = way.x * me.facing_x + way.y * me.facing_y
        if best < 0 or turn > least:
            best = k
            least = turn
    if best < 0:
        return STAY
    way = observe.opens[best]
    return AIM_DIRECTION, np.int64(way.patch), np.int64(way.place)


# -- What the algorithms do ---------------------------------------------------------


@mirrors("humans.switch_mode d32410")
def switch_mode(me):
    """Switch from follower to leader or back, and stay for a moment [B4]."""
    me.mode = LEADER if me.mode == FOLLOWER else FOLLOWER
    return STAY


@mirrors("humans.follow 69acc3")
def follow(N, me, observe, leader):
    """Switch to follower of a body in view [B6, Alg. 2:7]."""
    switch_mode(me)
    me.leader = leader
    remember_leader(me, observe)
    return towards_leader(N, me, observe)


@mirrors("humans.disconnect 227e53")
def disconnect(N, me, observe):
    """Let go of a leader out of sight and lead oneself [B5, Alg. 1:11]."""
    time = observe.now[0].time
    if me.leader != -1:
        me.leader = -1
        me.pause_until = time + N.LEADER_PAUSE_SECONDS
    if stuck(N, me, observe) and time >= me.waits_until:
        me.waits_until = time + N.STUCK_WAIT_SECONDS
    if time < me.waits_until:
        return STAY
    return switch_mode(me)


@mirrors("humans.towards_leader 31912a")
def towards_leader(N, me, observe):
    """Walk to where the leader was seen last, but not into them [B5, Alg. 1:6]."""
    k = sighted(observe, me.leader)
    if k >= 0 and observe.seen[k].metres < N.FOLLOW_DISTANCE:
        return AIM_LEADER, me.leader, -1
    return AIM_LEADER, me.leader, me.seen_place


@mirrors("humans.back_to_last_door 594324")
def back_to_last_door(N, me, mine, observe, some):
    """Go back through the door passed last, then the one before [B6, Alg. 2:17]."""
    if me.trail and mine[N.trail + 2 * me.trail - 2] == observe.now[0].here:
        me.trail -= 1
    if me.trail:
        return AIM_LANDMARK, np.int64(mine[N.trail + 2 * me.trail - 2]), -1
    return look_again(N, me, mine, observe, some)


@mirrors(
    "humans.look_again a049e8",
    "view.View.nearest 76f0f9",
    "view.View.ground a30e04",
    "view.View.seen_on_all_sides 46ebd4",
    "rays.Sight.nearest 6064c5",
    "rays.Sight.seen_on_all_sides c8331b",
)
def look_again(N, me, mine, observe, some):
    """Go to the floor in view that was looked at longest ago, or never [B6, chosen]."""
    v = observe.now[0]
    here = v.place
    count = 0
    there = False
    for k in range(N.side * N.side):
        if observe.square[v.row, k] & GROUND:
            q = here + (k // N.side - N.half) * N.cols + k % N.side - N.half
            if not burns_towards(N, observe, q):
                some[count] = q
                count += 1
                there = there or q == me.place
    if (
        me.aim == AIM_DIRECTION
        and not there
        and not burns_towards(N, observe, me.place)
    ):
        some[count] = me.place
        count += 1

    for latest in range(me.been - 1, -1, -1):
        place = np.int64(mine[N.been + latest])
        older = 0
        for k in range(count):
            older += not is_seen_on_all_sides(N, observe, place, some[k])
        if not older:
            break
        kept = 0
        for k in range(count):
            q = some[k]
            if not is_seen_on_all_sides(N, observe, place, q):
                some[kept] = q
                kept += 1
        count = kept

    for k in range(count):
        if some[k] == me.place:
            return AIM_DIRECTION, -1, me.place
    best = here
    nearest = np.inf
    for k in range(count):
        q = np.int64(some[k])
        x = observe.cells[q].x - observe.cells[here].x
        y = observe.cells[q].y - observe.cells[here].y
        metres = sqrt(x * x + y * y)
        if metres < nearest or (metres == nearest and q < best):
            nearest = metres
            best = q
    return AIM_DIRECTION, -1, best


# -- Memory -------------------------------------------------------------------------


@mirrors(
    "humans.remember dc2da9", "view.View.looked_at 81ea5d", "view.View.of_room 746ecb"
)
def remember(N, me, mine, observe):
    """Update the memory from the view, before the algorithm asks about it."""
    v = observe.now[0]
    for k in range(v.looked, v.looked_end):
        mine[N.patches + 1 + observe.lists[k]] = 1
    been_in(N, me, mine, v.place)
    if v.room != -1:
        for k in range(v.hits, v.hits_end):
            hit = observe.hits[k]
            if hit.of_room:
                if mine[N.seen_from + hit.mark] == -1:
                    mine[N.seen_from + hit.mark] = v.room
                elif mine[N.seen_from + hit.mark] != v.room:
                    mine[hit.mark] = 1
    if me.aim == AIM_DIRECTION and burns_towards(N, observe, me.place):
        mine[N.patches + 1 + me.which] = 1
    kept = 0
    for k in range(me.trail):
        door = mine[N.trail + 2 * k]
        side = mine[N.trail + 2 * k + 1]
        if not is_burnt(observe, door):
            mine[N.trail + 2 * kept] = door
            mine[N.trail + 2 * kept + 1] = side
            kept += 1
    me.trail = kept
    remember_leader(me, observe)


@compiled
def been_in(N, me, mine, place):
    """Note a place as the newest of those where one has been."""
    at = me.been - 1
    while at >= 0 and mine[N.been + at] != place:
        at -= 1
    if at < 0:
        at = me.been
        me.been += 1
    for k in range(at, me.been - 1):
        mine[N.been + k] = mine[N.been + k + 1]
    mine[N.been + me.been - 1] = place


@mirrors("humans._remember_leader 05de1c")
def remember_leader(me, observe):
    """Note when and where the leader is seen and what it says, if it is in sight."""
    k = sighted(observe, me.leader)
    if k >= 0:
        me.seen_at = observe.now[0].time
        me.seen_place = observe.seen[k].place
        me.told = observe.seen[k].told


@mirrors("humans.pass_landmark 7ba4a1")
def pass_landmark(N, me, mine, landmark, side, beyond):
    """Remember a door or entrance just entered; a leader goes on past it [B6]."""
    door = -1
    from_side = -1
    if me.trail:
        door = mine[N.trail + 2 * me.trail - 2]
        from_side = mine[N.trail + 2 * me.trail - 1]
    passing_by = me.aim == AIM_DIRECTION or (
        me.aim == AIM_LANDMARK and me.which != landmark
    )
    if me.trail and door == landmark and from_side != side:
        me.trail -= 1  # walked back through it: drop it
    elif (not me.trail or door != landmark or from_side != side) and not passing_by:
        mine[N.trail + 2 * me.trail] = landmark
        mine[N.trail + 2 * me.trail + 1] = side
        me.trail += 1
    mine[landmark] = 1
    if me.mode == LEADER:
        me.aim = AIM_THRESHOLD
        me.which = landmark
        me.place = beyond


@mirrors("humans.forget 6962cf")
def forget(N, me, mine):
    """Forget doors, the way back and what was explored, all together [B6]."""
    mine[: N.trail] = 0
    mine[N.seen_from : N.patches] = -1
    me.trail = 0
    me.been = 0


@mirrors("humans.arrive 208c08")
def arrive(N, me, mine, landmark, beyond):
    """Forget the floor above; begin on this one as a leader who knows its entrance."""
    me.mode = LEADER
    me.leader = -1
    forget(N, me, mine)
    pass_landmark(N, me, mine, landmark, -1, beyond)
    me.trail = 0


# -- Minds and bodies ---------------------------------------------------------------


@mirrors("humans._show_decision 6611a6", "humans._straight aebd63")
def show_decision(N, me, body, cells, clear, W):
    """Copy mode, leader and goal of one mind to its body, which then walks there."""
    body.mode = me.mode
    body.leader = me.leader
    body.landmark = me.which if me.aim == AIM_LANDMARK else -1
    if me.place == -1:
        body.goal_x = body.x
        body.goal_y = body.y
        body.target_x = body.x
        body.target_y = body.y
        return
    at = me.place
    body.goal_x = cells[at].x
    body.goal_y = cells[at].y
    if me.aim == AIM_DIRECTION and not reaches(N, clear, body.place, at):
        at = next_place(N, W, body.place, at)
    body.target_x = cells[at].x
    body.target_y = cells[at].y
