"""People: Algorithms 1 and 2, what they remember, and how the two modes switch.

Clauses: B3, B4, B5, B6.  `Follower` and `Leader` are the paper's algorithms, to be read
beside their printed lines; each call is one pass of the outermost loop, whose line 1
("while not at exit") the simulation keeps.  Everything else here is what the algorithms
leave open: "stuck", "suitable leader", "desired" and the memory, each defined once.

    me       the Mind that thinks: "input parameters" and memory
    observe  the View: what this human sees now
    setoff   the Goal that comes out
"""

from math import dist
from typing import NamedTuple

import numpy as np

from reference import paper
from reference.navigation import Navigation
from reference.perception import View
from reference.world import (
    NOBODY,
    NOWHERE,
    STAY,
    Aim,
    Goal,
    Instruction,
    Mind,
    Mode,
    World,
)


class Situation(NamedTuple):
    """What minds share at one instant: the world they are in and how to walk in it."""

    world: World
    navigation: Navigation


# -- The algorithms -----------------------------------------------------------------


class Follower:
    """Algorithm 1: the human follower [B5, Alg. 1]."""

    def setoff(self, me: Mind, observe: View, now: Situation) -> Goal:
        """One pass of lines 2-12."""
        if not stuck(me, now) and me.leader == NOBODY:  # 2
            return switch_mode(me)  # 3, which ends the pass [B5, chosen]
        if leader_in_sight(me, observe, now):  # 5
            goal = towards_leader(me, now)  # 6
            if is_robot(me.leader, now):  # 7
                goal = act_on_instruction(me, observe, now, goal)  # 8
            return goal
        return disconnect(me, now)  # 10, 11


class Leader:
    """Algorithm 2: the human leader [B6, Alg. 2]."""

    def setoff(self, me: Mind, observe: View, now: Situation) -> Goal:
        """One pass of lines 2-22."""
        if (found := exit_in_view(observe, now)) is not None:  # 2
            return go_to(found)  # 3, which ends the pass [B6, chosen]
        wanted = desired(me, observe, now)
        if wanted is not None or observe.robots:  # 5
            if (leader := suitable_leader(me, observe, now, wanted)) is not None:  # 6
                return follow(me, leader, now)  # 7
            if wanted is not None:  # 8
                return go_to(wanted)  # 9
        fresh = not_yet_visited(me, observe, now)  # 12
        if fresh is None:  # 13
            if (direction := unexplored(me, observe)) is not None:  # 14
                return direction  # 15
            return back_to_last_door(me, observe)  # 16, 17
        return go_to(fresh)  # 19, 20


ALGORITHMS: dict[Mode, Follower | Leader] = {
    Mode.FOLLOWER: Follower(),
    Mode.LEADER: Leader(),
}


def think(me: Mind, observe: View, now: Situation) -> None:
    """Let one human deliberate once, in the mode they are in."""
    me.patches.add(observe.surroundings.sight.patches[observe.place])
    if _still_crossing(me, observe, now):
        return
    before = me.goal
    me.goal = ALGORITHMS[me.mode].setoff(me, observe, now)
    if me.goal != before:
        me.facing = _towards(me.goal, observe.place, now) or me.facing


def _towards(goal: Goal, place: int, now: Situation) -> tuple[float, float] | None:
    """Unit vector from a place to a goal, None where there is no way to go."""
    if goal.aim is Aim.LANDMARK:
        there = now.world.building.landmarks[goal.which].position
    elif goal.place != NOWHERE:
        there = now.navigation.centres[goal.place].tolist()
    else:
        return None
    here = now.navigation.centres[place].tolist()
    x, y = there[0] - here[0], there[1] - here[1]
    far = (x * x + y * y) ** 0.5
    return (x / far, y / far) if far else None


def _still_crossing(me: Mind, observe: View, now: Situation) -> bool:
    """On the way over a threshold one goes through with it before looking again."""
    return (
        me.goal.aim is Aim.THRESHOLD
        and observe.place != me.goal.place
        and me.goal.place not in observe.surroundings.burning
        and not stuck(me, now)
    )


# -- The words that the algorithms leave open ---------------------------------------


def stuck(me: Mind, now: Situation) -> bool:
    """Meaning to move, yet less than STUCK_METRES in STUCK_SECONDS [B5, chosen]."""
    time, since = now.world.time, now.world.bodies.anchor_time[me.person]
    return bool(time - since > paper.STUCK_SECONDS or time < me.waits_until)


def exit_in_view(observe: View, now: Situation) -> int | None:
    """The nearest exit that a ray meets, flames or not, or None [B6, Alg. 2:2]."""
    exits = now.world.building.exits
    return next((mark for mark in observe.landmarks if mark in exits), None)


def desired(me: Mind, observe: View, now: Situation) -> int | None:
    """The stair or door in view that one wants to go to, or None [B6, chosen].

    Intact, not passed lately, and no flame in sight on or beside the way. Stairs that
    lead down come before doors; stairs that do not are never desired.
    """
    ways = [m for m in _not_passed(me, observe, now) if observe.safe(m)]
    stairs = [m for m in ways if m in now.world.building.entrances]
    return _kept_or_nearest(me, observe, now, stairs or ways)


def not_yet_visited(me: Mind, observe: View, now: Situation) -> int | None:
    """A door or stair in view, not passed lately, that can be reached [B6, chosen].

    Wider than `desired`: the way may lead beside flames, though not through them.
    """
    ways = [m for m in _not_passed(me, observe, now) if observe.passable(m)]
    return _kept_or_nearest(me, observe, now, ways)


def _not_passed(me: Mind, observe: View, now: Situation) -> list[int]:
    """Doors in view not passed lately, and stairs that go down."""
    useless = now.world.building.dead_ends
    return [m for m in observe.landmarks if m not in me.doors and m not in useless]


def _kept_or_nearest(
    me: Mind, observe: View, now: Situation, ways: list[int]
) -> int | None:
    """The nearest, unless the goal is among them and less than GOAL_HYSTERESIS farther.

    Without hysteresis people dither between two ways [B6, chosen].
    """
    if me.goal.aim is Aim.LANDMARK and me.goal.which in ways[1:]:
        d = now.navigation.distance[:, observe.place]
        if d[me.goal.which] - d[ways[0]] < paper.GOAL_HYSTERESIS:
            return me.goal.which
    return ways[0] if ways else None


def suitable_leader(
    me: Mind, observe: View, now: Situation, wanted: int | None
) -> int | None:
    """A body in view worth following, or None [B6, chosen].

    A robot always is, the nearest first. A human is who leads, heads where I want to
    go and outranks me, so that nobody follows in circles, with MOST_FOLLOWERS at most.
    """
    if observe.robots:
        here = _position(me.person, now)
        return min(observe.robots, key=lambda j: dist(_position(j, now), here))
    if wanted is None or now.world.time < me.pause_until:
        return None
    minds, followed = now.world.minds, now.world.bodies.leader
    better = [
        j
        for j in observe.people
        if minds[j].mode is Mode.LEADER
        and minds[j].rank > me.rank
        and minds[j].goal == go_to(wanted)
        and (followed == j).sum() < paper.MOST_FOLLOWERS
    ]
    return max(better, key=lambda j: minds[j].rank, default=None)


def leader_in_sight(me: Mind, observe: View, now: Situation) -> bool:
    """Is the leader in line of sight, or was it a moment ago? [B5, Alg. 1:5]

    A leader is forgiven LEADER_GRACE_SECONDS out of sight [B5, chosen]: whoever turns a
    corner or passes a door is not lost, one walks to where they were seen last.
    """
    if me.leader in observe.people or me.leader in observe.robots:
        _remember_leader(me, now)
        return True
    if me.leader == NOBODY or observe.place == me.seen_place:
        return False
    return now.world.time - me.seen_at < paper.LEADER_GRACE_SECONDS


# -- What the algorithms do ---------------------------------------------------------


def go_to(landmark: int) -> Goal:
    """Set off to a door, stairwell entrance or exit."""
    return Goal(Aim.LANDMARK, landmark)


def switch_mode(me: Mind) -> Goal:
    """Switch from follower to leader or back [B4]; one looks again a moment later."""
    me.mode = Mode.LEADER if me.mode is Mode.FOLLOWER else Mode.FOLLOWER
    return STAY


def follow(me: Mind, leader: int, now: Situation) -> Goal:
    """Switch to follower of a body in view [B6, Alg. 2:7]."""
    switch_mode(me)
    me.leader = leader
    _remember_leader(me, now)
    return towards_leader(me, now)


def disconnect(me: Mind, now: Situation) -> Goal:
    """Let go of a leader out of sight and lead oneself [B5, Alg. 1:11].

    A stuck follower waits STUCK_WAIT_SECONDS between the two [B5, chosen].
    """
    time = now.world.time
    if me.leader != NOBODY:
        me.leader, me.pause_until = NOBODY, time + paper.LEADER_PAUSE_SECONDS
    if stuck(me, now) and time >= me.waits_until:
        me.waits_until = time + paper.STUCK_WAIT_SECONDS
    return STAY if time < me.waits_until else switch_mode(me)


def towards_leader(me: Mind, now: Situation) -> Goal:
    """Walk to where the leader was seen last, but not into them [B5, Alg. 1:6]."""
    if me.seen_at == now.world.time:
        off = _position(me.leader, now) - _position(me.person, now)
        if off @ off < paper.FOLLOW_DISTANCE**2:
            return Goal(Aim.LEADER, me.leader)
    return Goal(Aim.LEADER, me.leader, me.seen_place)


def act_on_instruction(me: Mind, observe: View, now: Situation, goal: Goal) -> Goal:
    """Do what the robot one follows says [B5, Alg. 1:8].

    "Follow me" keeps the goal; "this stairwell" and "this exit" send people there as
    soon as they see it themselves, since they do not know the map [B3]. "This" is the
    one nearest to the robot's destination [C7, chosen]: no other will do.
    """
    robot = now.world.robots[me.leader - len(now.world.minds)]
    if robot.instruction is Instruction.FOLLOW_ME or robot.destination is None:
        return goal
    building, there = now.world.building, robot.destination.tolist()
    exits = robot.instruction is Instruction.THIS_EXIT
    of_kind = building.exits if exits else building.entrances
    here = (mark for mark in building.landmarks if mark.floor == robot.floor)
    ways = (mark for mark in here if mark.index in of_kind)
    this = min(ways, key=lambda mark: dist(mark.position, there)).index
    return go_to(this) if this in observe.landmarks else goal


def unexplored(me: Mind, observe: View) -> Goal | None:
    """The unexplored direction that asks for the least turning, or None [B2].

    A direction once taken is followed to its end.
    """
    if me.goal.aim is Aim.DIRECTION and me.goal.which not in me.patches:
        if me.goal.place not in observe.surroundings.burning:
            return me.goal
        me.patches.add(me.goal.which)
    ways = [way for way in observe.open if way.patch not in me.patches]
    if not ways:
        return None
    x, y = me.facing
    best = max(ways, key=lambda way: way.unit[0] * x + way.unit[1] * y)
    return Goal(Aim.DIRECTION, best.patch, best.place)


def back_to_last_door(me: Mind, observe: View) -> Goal:
    """Go back through the door passed last, then the one before [B6, Alg. 2:17].

    Without a door left to go back to, everything is forgotten and tried again from
    the far end of the room.
    """
    while me.trail and me.trail[-1] in observe.surroundings.burnt:
        me.trail.pop()
    if me.trail:
        return go_to(me.trail[-1])
    me.doors.clear()
    me.patches.clear()
    sight = observe.surroundings.sight
    far = sight.farthest[observe.place]
    return Goal(Aim.DIRECTION, sight.patches[far], far)


# -- Memory -------------------------------------------------------------------------


def pass_landmark(me: Mind, landmark: int, beyond: int) -> None:
    """Remember a door or entrance just entered, and go through with it [B6, chosen].

    beyond: the place on its other side.
    """
    if me.trail and me.trail[-1] == landmark:
        me.trail.pop()  # walked back through it: drop it
    else:
        me.trail.append(landmark)
    if landmark in me.doors:
        me.doors.remove(landmark)
    me.doors.append(landmark)
    if me.mode is Mode.LEADER:
        me.goal = Goal(Aim.THRESHOLD, landmark, beyond)


def arrive(me: Mind, landmark: int, beyond: int) -> None:
    """Begin anew on another floor, as a leader who knows only the entrance there."""
    me.mode, me.leader = Mode.LEADER, NOBODY
    me.trail.clear()
    me.doors.clear()
    me.patches.clear()
    pass_landmark(me, landmark, beyond)


def is_robot(body: int, now: Situation) -> bool:
    """Is this body a robot?"""
    return body >= len(now.world.minds)


def _remember_leader(me: Mind, now: Situation) -> None:
    me.seen_at = now.world.time
    if is_robot(me.leader, now):
        me.seen_place = now.world.robots[me.leader - len(now.world.minds)].place
    else:
        me.seen_place = int(now.world.bodies.place[me.leader])


def _position(body: int, now: Situation) -> np.ndarray:
    if is_robot(body, now):
        return now.world.robots[body - len(now.world.minds)].position
    return now.world.bodies.position[body]
