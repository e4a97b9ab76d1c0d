"""People: Algorithms 1 and 2, what they remember, and how the two modes switch.

Clauses: B3, B4, B5, B6.  `Follower` and `Leader` are the paper's algorithms, to be read
beside their printed lines; each call is one pass of the outermost loop, whose line 1
("while not at exit") the simulation keeps.  Everything else here is what the algorithms
leave open: "stuck", "suitable leader", "desired" and the memory, each defined once.

    me       the Mind that thinks: "input parameters" and memory
    observe  the View: what this human sees now;  setoff  the Goal that comes out
    world    who leads whom, and where bodies are; nobody reads the map in it [B3]
"""

from math import dist

import numpy as np

from reference import paper
from reference.navigation import navigation_of
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
    Robot,
    World,
)

# -- The algorithms -----------------------------------------------------------------


class Follower:
    """Algorithm 1: the human follower [B5, Alg. 1]."""

    def setoff(self, me: Mind, observe: View, world: World) -> Goal:
        """One pass of lines 2-12."""
        if not stuck(me, world) and me.leader == NOBODY:  # 2
            return switch_mode(me)  # 3, which ends the pass [B5, chosen]
        if leader_in_sight(me, observe, world):  # 5
            setoff = towards_leader(me, world)  # 6
            if (robot := robot_of(me.leader, world)) is not None:  # 7
                setoff = act_on_instruction(robot, observe, world, setoff)  # 8
            return setoff
        return disconnect(me, world)  # 10, 11


class Leader:
    """Algorithm 2: the human leader [B6, Alg. 2]."""

    def setoff(self, me: Mind, observe: View, world: World) -> Goal:
        """One pass of lines 2-22."""
        if (found := exit_in_view(observe, world)) is not None:  # 2
            return go_to(found)  # 3, which ends the pass [B6, chosen]
        wanted = desired(me, observe, world)
        if wanted is not None or observe.robots:  # 5
            if (leader := suitable_leader(me, observe, world, wanted)) is not None:  # 6
                return follow(me, leader, world)  # 7
            if wanted is not None:  # 8
                return go_to(wanted)  # 9
        fresh = not_yet_visited(me, observe, world)  # 12
        if fresh is None:  # 13
            if (direction := unexplored(me, observe)) is not None:  # 14
                return direction  # 15
            return back_to_last_door(me, observe)  # 16, 17
        return go_to(fresh)  # 19, 20


ALGORITHMS: dict[Mode, Follower | Leader] = {
    Mode.FOLLOWER: Follower(),
    Mode.LEADER: Leader(),
}


def think(me: Mind, observe: View, world: World) -> None:
    """Let one human decide once where to go, by the algorithm of their mode."""
    me.patches.add(observe.surroundings.sight.patches[observe.place])
    if _still_crossing(me, observe, world):
        return
    before = me.goal
    me.goal = ALGORITHMS[me.mode].setoff(me, observe, world)
    if me.goal != before:
        me.facing = _towards(me.goal, observe.place, world) or me.facing


def _towards(goal: Goal, place: int, world: World) -> tuple[float, float] | None:
    """Unit vector from a place to a goal, None where there is no way to go."""
    centres = navigation_of(world.building).centres
    here = there = centres[place].tolist()
    if goal.aim is Aim.LANDMARK:
        there = world.building.landmarks[goal.which].position
    elif goal.place != NOWHERE:
        there = centres[goal.place].tolist()
    x, y = there[0] - here[0], there[1] - here[1]
    far = (x * x + y * y) ** 0.5
    return (x / far, y / far) if far else None


def _still_crossing(me: Mind, observe: View, world: World) -> bool:
    """Is this human still on the way past the door just entered?"""
    return (
        me.goal.aim is Aim.THRESHOLD
        and observe.place != me.goal.place
        and me.goal.place not in observe.surroundings.burning
        and not stuck(me, world)
    )


# -- The words that the algorithms leave open ---------------------------------------


def stuck(me: Mind, world: World) -> bool:
    """Has one meant to move, yet got no farther for STUCK_SECONDS? [B5, chosen]"""
    time, since = world.time, world.bodies.anchor_time[me.person]
    return bool(time - since > paper.STUCK_SECONDS or time < me.waits_until)


def exit_in_view(observe: View, world: World) -> int | None:
    """The nearest exit that a ray meets, flames or not, or None [B6, Alg. 2:2]."""
    exits = world.building.exits
    return next((mark for mark in observe.landmarks if mark in exits), None)


def desired(me: Mind, observe: View, world: World) -> int | None:
    """The stair or door in view that one wants to go to, or None [B6, chosen].

    Intact, not passed lately, and no flame in sight on or beside the way. Stairs that
    lead down come before doors.
    """
    ways = [m for m in _not_passed(me, observe, world) if observe.safe(m)]
    stairs = [m for m in ways if m in world.building.entrances]
    return _kept_or_nearest(me, observe, world, stairs or ways)


def not_yet_visited(me: Mind, observe: View, world: World) -> int | None:
    """A door or stair in view, not passed lately, that can be reached [B6, chosen].

    Wider than `desired`: the way may lead beside flames, though not through them.
    """
    ways = [m for m in _not_passed(me, observe, world) if observe.passable(m)]
    return _kept_or_nearest(me, observe, world, ways)


def _not_passed(me: Mind, observe: View, world: World) -> list[int]:
    """Landmarks in view not passed lately, without stairs that do not go down."""
    useless = world.building.dead_ends
    return [m for m in observe.landmarks if m not in me.doors and m not in useless]


def _kept_or_nearest(
    me: Mind, observe: View, world: World, ways: list[int]
) -> int | None:
    """The nearest, unless the goal is among them and less than GOAL_HYSTERESIS farther.

    Without hysteresis people dither between two ways [B6, chosen].
    """
    if me.goal.aim is Aim.LANDMARK and me.goal.which in ways[1:]:
        d = navigation_of(world.building).distance[:, observe.place]
        if d[me.goal.which] - d[ways[0]] < paper.GOAL_HYSTERESIS:
            return me.goal.which
    return ways[0] if ways else None


def suitable_leader(
    me: Mind, observe: View, world: World, wanted: int | None
) -> int | None:
    """A body in view worth following, or None [B6, chosen].

    A robot always is, the nearest first. A human is who leads, heads where I want to
    go and outranks me, so that nobody follows in circles, with MOST_FOLLOWERS at most.
    """
    minds, followed = world.minds, world.bodies.leader
    if observe.robots:
        here = world.bodies.position[me.person]
        return min(observe.robots, key=lambda j: dist(_position(j, world), here))
    if wanted is None or world.time < me.pause_until:
        return None
    better = [
        j
        for j in observe.people
        if minds[j].mode is Mode.LEADER
        and minds[j].rank > me.rank
        and minds[j].goal == go_to(wanted)
        and (followed == j).sum() < paper.MOST_FOLLOWERS
    ]
    return max(better, key=lambda j: minds[j].rank, default=None)


def leader_in_sight(me: Mind, observe: View, world: World) -> bool:
    """Is the leader in line of sight, or was it a moment ago? [B5, Alg. 1:5]

    A leader who turns a corner or passes a door is not lost for LEADER_GRACE_SECONDS:
    one walks to where they were seen last [B5, chosen].
    """
    if me.leader in observe.people or me.leader in observe.robots:
        _remember_leader(me, world)
        return True
    if me.leader == NOBODY or observe.place == me.seen_place:
        return False
    return world.time - me.seen_at < paper.LEADER_GRACE_SECONDS


# -- What the algorithms do ---------------------------------------------------------


def go_to(landmark: int) -> Goal:
    """Set off to a door, stairwell entrance or exit."""
    return Goal(Aim.LANDMARK, landmark)


def switch_mode(me: Mind) -> Goal:
    """Switch from follower to leader or back, and stay for a moment [B4]."""
    me.mode = Mode.LEADER if me.mode is Mode.FOLLOWER else Mode.FOLLOWER
    return STAY


def follow(me: Mind, leader: int, world: World) -> Goal:
    """Switch to follower of a body in view [B6, Alg. 2:7]."""
    switch_mode(me)
    me.leader = leader
    _remember_leader(me, world)
    return towards_leader(me, world)


def disconnect(me: Mind, world: World) -> Goal:
    """Let go of a leader out of sight and lead oneself [B5, Alg. 1:11].

    A stuck follower waits STUCK_WAIT_SECONDS between the two [B5, chosen].
    """
    time = world.time
    if me.leader != NOBODY:
        me.leader, me.pause_until = NOBODY, time + paper.LEADER_PAUSE_SECONDS
    if stuck(me, world) and time >= me.waits_until:
        me.waits_until = time + paper.STUCK_WAIT_SECONDS
    return STAY if time < me.waits_until else switch_mode(me)


def towards_leader(me: Mind, world: World) -> Goal:
    """Walk to where the leader was seen last, but not into them [B5, Alg. 1:6]."""
    if me.seen_at == world.time:
        off = _position(me.leader, world) - _position(me.person, world)
        if off @ off < paper.FOLLOW_DISTANCE**2:
            return Goal(Aim.LEADER, me.leader)
    return Goal(Aim.LEADER, me.leader, me.seen_place)


def act_on_instruction(robot: Robot, observe: View, world: World, goal: Goal) -> Goal:
    """Do what the robot one follows says [B5, Alg. 1:8].

    "Follow me" keeps the goal; "this stairwell" and "this exit" send people there as
    soon as they see it themselves, since they do not know the map [B3]. "This" is the
    one nearest to the robot's destination [C7, chosen]: no other will do.
    """
    if robot.instruction is Instruction.FOLLOW_ME or robot.destination is None:
        return goal
    building, there = world.building, robot.destination.tolist()
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
    """Remember a door or entrance just entered; a leader goes on past it [B6, chosen].

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
    """Forget the floor above; begin on this one as a leader who knows its entrance."""
    me.mode, me.leader = Mode.LEADER, NOBODY
    me.trail.clear()
    me.doors.clear()
    me.patches.clear()
    pass_landmark(me, landmark, beyond)


def robot_of(body: int, world: World) -> Robot | None:
    """The robot that a body is, None for a human."""
    people = len(world.minds)
    return world.robots[body - people] if body >= people else None


def _remember_leader(me: Mind, world: World) -> None:
    robot = robot_of(me.leader, world)
    me.seen_at = world.time
    me.seen_place = robot.place if robot else int(world.bodies.place[me.leader])


def _position(body: int, world: World) -> np.ndarray:
    robot = robot_of(body, world)
    return robot.position if robot else world.bodies.position[body]
