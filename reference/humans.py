"""People: Algorithms 1 and 2, what they remember, and how the two modes switch.

`Follower` and `Leader` are the paper's algorithms, to be read beside their printed
lines, as `python -m reference paper` shows them (a scan shifts their numbers and loses
Alg. 2:16, "else").  Each call is one pass of the outermost loop, whose line 1 ("while
not at exit") is the simulation's.  Everything else here is what the algorithms leave
open: "stuck", "suitable leader", "desired" and the memory, each defined once.

    me       the Mind that thinks: "input parameters" and memory
    observe  the View: what this human sees now, and nothing else exists here [B3]
    setoff   the Goal that comes out
"""

import numpy as np

from reference import paper
from reference.navigation import Navigation, navigation_of
from reference.view import View
from reference.world import NOBODY, NOWHERE, STAY, Aim, Goal, Mind, Mode, Passed, World

# -- The algorithms -----------------------------------------------------------------


class Follower:
    """Algorithm 1: the human follower [B5, Alg. 1]."""

    def setoff(self, me: Mind, observe: View) -> Goal:
        """One pass of lines 2-12."""
        if not stuck(me, observe) and me.leader == NOBODY:  # 2
            return switch_mode(me)  # 3, which ends the pass [B5, chosen]
        if leader_in_sight(me, observe):  # 5
            setoff = towards_leader(me, observe)  # 6
            if leader_is_robot(me):  # 7
                setoff = act_on_instruction(me, observe, setoff)  # 8
            return setoff
        return disconnect(me, observe)  # 10, 11


class Leader:
    """Algorithm 2: the human leader [B6, Alg. 2]."""

    def setoff(self, me: Mind, observe: View) -> Goal:
        """One pass of lines 2-22."""
        if (nearest := exit_in_view(observe)) is not None:  # 2
            return go_to(nearest)  # 3, which ends the pass [B6, chosen]
        if observe.robots:  # robots lead, door or no door [B6, deviation]
            return follow(me, next(iter(observe.robots)), observe)  # 6, 7: the nearest
        if (wanted := desired(me, observe)) is not None:  # 5
            if (leader := suitable_leader(me, observe, wanted)) is not None:  # 6
                return follow(me, leader, observe)  # 7
            return go_to(wanted)  # 8, 9
        fresh = not_yet_visited(me, observe)  # 11, 12
        if fresh is None:  # 13
            if (direction := unexplored(me, observe)) is not None:  # 14
                return direction  # 15
            return back_to_last_door(me, observe)  # 16, 17
        return go_to(fresh)  # 19, 20


FOLLOWER = Follower()
LEADER = Leader()


def think(me: Mind, observe: View) -> None:
    """Let one human decide once where to go, by the algorithm of their mode.

    Who has just entered a door walks to the place beyond it first, unless that burns
    or they are stuck.
    """
    remember(me, observe)
    crossing = me.goal.aim is Aim.THRESHOLD and observe.place != me.goal.place
    if crossing and not (observe.burns([me.goal.place]) or stuck(me, observe)):
        return
    algorithm = LEADER if me.mode is Mode.LEADER else FOLLOWER
    before = me.goal
    me.goal = algorithm.setoff(me, observe)
    if me.goal != before:
        me.facing = observe.towards(me.goal) or me.facing


# -- Terms that the algorithms leave open: questions, which change nothing -----------


def stuck(me: Mind, observe: View) -> bool:
    """Has this human made no headway for STUCK_SECONDS, or does it wait since then?

    [B5, chosen]
    """
    halted = observe.time - observe.headway_time > paper.STUCK_SECONDS + 1e-9
    return halted or observe.time < me.waits_until


def leader_is_robot(me: Mind) -> bool:
    """Is the leader a robot? People tell followers nothing [B5]."""
    return me.told is not None


def exit_in_view(observe: View) -> int | None:
    """The nearest exit that a ray meets, flames or not, or None [B6, Alg. 2:2]."""
    exits = (mark for mark, hit in observe.landmarks.items() if hit.kind == "exit")
    return next(exits, None)


def desired(me: Mind, observe: View) -> int | None:
    """Find the stair or door in view to go to, or None [B6, chosen].

    It is intact, not yet visited, and has no flame in sight on or beside the way.
    Stairs that lead down come before doors. A goal that has gone out of sight, say
    behind a corner, stays desired: else people walk to and fro.
    """
    kind, mark, _ = me.goal
    hidden = kind is Aim.LANDMARK and mark not in observe.landmarks
    gone = mark in me.doors or mark in observe.burnt
    if hidden and not gone and not stuck(me, observe):
        return mark
    ways = [m for m in observe.landmarks if m not in me.doors and observe.safe(m)]
    stairs = [m for m in ways if observe.landmarks[m].kind == "entrance"]
    return _kept_or_nearest(me, observe, stairs or ways)


def not_yet_visited(me: Mind, observe: View) -> int | None:
    """A door or stair in view, not yet visited, that can be reached [B6, Alg. 2:13].

    Wider than `desired`: the way may lead beside flames, though not through them.
    """
    ways = [m for m in observe.landmarks if m not in me.doors and observe.passable(m)]
    return _kept_or_nearest(me, observe, ways)


def _kept_or_nearest(me: Mind, observe: View, ways: list[int]) -> int | None:
    """Keep the goal if it is less than GOAL_HYSTERESIS farther than the nearest way.

    Else take the nearest. Without hysteresis people dither between two ways
    [B6, chosen].
    """
    if me.goal.aim is Aim.LANDMARK and me.goal.which in ways:
        kept = observe.landmarks[me.goal.which].distance
        nearest = observe.landmarks[ways[0]].distance
        if kept - nearest < paper.GOAL_HYSTERESIS:
            return me.goal.which
    return ways[0] if ways else None


def suitable_leader(me: Mind, observe: View, wanted: int) -> int | None:
    """Find the human in view worth following, or None [B6, chosen].

    They lead, walk where I want to go and have fewer than MOST_FOLLOWERS in view. They
    outrank me, so that nobody follows in circles.
    """
    if observe.time < me.pause_until:
        return None
    for leader in observe.leaders_to(wanted):
        if observe.followers_of(leader) < paper.MOST_FOLLOWERS:
            return leader
    return None


def leader_in_sight(me: Mind, observe: View) -> bool:
    """Is the leader in line of sight, or was it a moment ago? [B5, Alg. 1:5]

    A leader out of sight is kept for LEADER_GRACE_SECONDS, or until the follower is
    where it saw them last and does not see them from there [B5, deviation].
    """
    if me.leader in observe.bodies:
        return True
    if me.leader == NOBODY or observe.place == me.seen_place:
        return False
    return observe.time - me.seen_at < paper.LEADER_GRACE_SECONDS


def unexplored(me: Mind, observe: View) -> Goal | None:
    """Find the unexplored direction that needs the least turning, or None [B2].

    Directions that end in the same patch, a square of floor, are one. People follow a
    direction that they have taken to its patch, unless flames bar it.
    """
    kind, patch, _ = me.goal
    taken = kind is Aim.DIRECTION and patch not in (NOWHERE, observe.patch)
    if taken and not observe.burns_towards(me.goal.place):
        return me.goal
    ways = [way for way in observe.open if way.patch not in me.patches]
    if not ways:
        return None
    x, y = me.facing
    best = max(ways, key=lambda way: way.unit[0] * x + way.unit[1] * y)
    return Goal(Aim.DIRECTION, best.patch, best.place)


# -- What the algorithms do ---------------------------------------------------------


def go_to(landmark: int) -> Goal:
    """Set off to a door, stairwell entrance or exit."""
    return Goal(Aim.LANDMARK, landmark)


def switch_mode(me: Mind) -> Goal:
    """Switch from follower to leader or back, and stay for a moment [B4]."""
    me.mode = Mode.LEADER if me.mode is Mode.FOLLOWER else Mode.FOLLOWER
    return STAY


def follow(me: Mind, leader: int, observe: View) -> Goal:
    """Switch to follower of a body in view [B6, Alg. 2:7]."""
    switch_mode(me)
    me.leader = leader
    _remember_leader(me, observe)
    return towards_leader(me, observe)


def disconnect(me: Mind, observe: View) -> Goal:
    """Let go of a leader out of sight and lead oneself [B5, Alg. 1:11].

    A stuck follower stands still for STUCK_WAIT_SECONDS instead [B5, chosen]. Who
    stands on purpose counts as arrived, so after the wait they are stuck no more:
    line 2 is true, and line 3 makes a leader.
    """
    time = observe.time
    if me.leader != NOBODY:
        me.leader = NOBODY
        me.pause_until = time + paper.LEADER_PAUSE_SECONDS
    if stuck(me, observe) and time >= me.waits_until:
        me.waits_until = time + paper.STUCK_WAIT_SECONDS
    return STAY if time < me.waits_until else switch_mode(me)


def towards_leader(me: Mind, observe: View) -> Goal:
    """Walk to where the leader was seen last, but not into them [B5, Alg. 1:6]."""
    seen = observe.bodies.get(me.leader)
    if seen is not None and seen[1] < paper.FOLLOW_DISTANCE:
        return Goal(Aim.LEADER, me.leader)
    return Goal(Aim.LEADER, me.leader, me.seen_place)


def act_on_instruction(me: Mind, observe: View, goal: Goal) -> Goal:
    """Do what the followed robot said when last in sight [B5, Alg. 1:8].

    "Follow me" keeps the goal; "this stairwell" and "this exit" send people there as
    soon as they see it themselves, since they do not know the map [B3].
    """
    return go_to(me.told) if me.told in observe.landmarks else goal


def back_to_last_door(me: Mind, observe: View) -> Goal:
    """Go back through the door passed last, then the one before [B6, Alg. 2:17].

    Who stands in that door has turned back already, and takes the door before it. With
    no door left, people look again at what they saw longest ago.
    """
    if me.trail and me.trail[-1].door == observe.here:
        me.trail.pop()
    if me.trail:
        return go_to(me.trail[-1].door)
    return look_again(me, observe)


def look_again(me: Mind, observe: View) -> Goal:
    """Go to the floor in view that was looked at longest ago, or never [B6, chosen].

    It stays the goal until it is looked at, or until older floor comes in view. The
    border of what was looked at counts as not looked at, so its turn comes: alone and
    without fire, a person sees every part of a connected floor without doors in the
    end. Between doors they may walk in a circle: see `pass_landmark`.

    Of all floor that could be looked at, what was seen from the newest place drops
    out, then what was seen from the place before it, until nothing would be left.
    """
    ways = {p for p in observe.ground if not observe.burns_towards(p)}
    if me.goal.aim is Aim.DIRECTION and not observe.burns_towards(me.goal.place):
        ways.add(me.goal.place)
    for place in reversed(me.been):
        older = ways - observe.seen_on_all_sides(place)
        if not older:
            break
        ways = older
    to = me.goal.place
    if to not in ways:
        to = observe.nearest(ways)
    return Goal(Aim.DIRECTION, place=to)


# -- Memory -------------------------------------------------------------------------


def remember(me: Mind, observe: View) -> None:
    """Update the memory from the view, before the algorithm asks about it.

    Patches of floor looked at, and a direction that burns, count as tried; a door seen
    from two rooms counts as visited, since it joins rooms that one has been in
    [B6, chosen]; doors seen destroyed are no way back.
    """
    me.patches |= observe.looked_at
    me.been.pop(observe.place, None)
    me.been[observe.place] = None  # at the end: the newest
    if observe.room != NOWHERE:
        for mark in observe.of_room:
            first_room = me.seen_from.setdefault(mark, observe.room)
            if first_room != observe.room:
                me.doors.add(mark)
    if me.goal.aim is Aim.DIRECTION and observe.burns_towards(me.goal.place):
        me.patches.add(me.goal.which)
    burnt = observe.burnt
    me.trail = [passed for passed in me.trail if passed.door not in burnt]
    _remember_leader(me, observe)


def _remember_leader(me: Mind, observe: View) -> None:
    """Note when and where the leader is seen and what it says, if it is in sight."""
    if (seen := observe.bodies.get(me.leader)) is not None:
        me.seen_at = observe.time
        me.seen_place = seen[0]
        me.told = observe.robots.get(me.leader)


def pass_landmark(me: Mind, landmark: int, side: int, beyond: int) -> None:
    """Remember a door or entrance just entered; a leader goes on past it [B6, chosen].

    side: area it was entered from;  beyond: the place on its other side. There are
    four cases. Who walks back through the newest door of the trail drops it. Who comes
    into it from the same side again has only stepped back: nothing changes. A door that
    was the goal, or that a leader led through, is added. A door that only lies on the
    way to another goal is left out: one would turn round in it for ever.

    Past a door on the way a leader may lose sight of that other goal, and come back to
    this door for it. Where doors are near each other this may go on for ever, so not
    everybody who is alone sees every part of a floor [B6, deviation].
    """
    aim, which, _ = me.goal
    passing_by = aim is Aim.DIRECTION or (aim is Aim.LANDMARK and which != landmark)
    last = me.trail[-1] if me.trail else None
    if last is not None and last.door == landmark:
        if last.side != side:
            me.trail.pop()
    elif not passing_by:
        me.trail.append(Passed(landmark, side))
    me.doors.add(landmark)
    if me.mode is Mode.LEADER:
        me.goal = Goal(Aim.THRESHOLD, landmark, beyond)


def forget(me: Mind) -> None:
    """Forget doors, the way back and what was explored, all together [B6]."""
    for memory in (me.doors, me.seen_from, me.trail, me.patches, me.been):
        memory.clear()


def arrive(me: Mind, landmark: int, beyond: int) -> None:
    """Forget the floor above; begin on this one as a leader who knows its entrance."""
    me.mode = Mode.LEADER
    me.leader = NOBODY
    forget(me)
    pass_landmark(me, landmark, NOWHERE, beyond)
    me.trail.clear()  # nobody goes back by this entrance: nobody walks up


# -- Minds and bodies ---------------------------------------------------------------


def decide(world: World, who: np.ndarray, views: list[View]) -> None:
    """Let these people think; then show on their bodies what they have decided."""
    people = who.tolist()
    for i, view in zip(people, views, strict=True):
        think(world.minds[i], view)
    for i in people:
        _show_decision(world, i)


def _show_decision(world: World, i: int) -> None:
    """Copy mode, leader and goal of one mind to its body, which then walks there."""
    me = world.minds[i]
    bodies = world.bodies
    bodies.mode[i] = me.mode
    bodies.leader[i] = me.leader
    bodies.landmark[i] = me.goal.which if me.goal.aim is Aim.LANDMARK else NOWHERE
    if me.goal.place == NOWHERE:
        bodies.goal[i] = bodies.position[i]
        bodies.target[i] = bodies.position[i]
        return
    nav = navigation_of(world.building)
    bodies.goal[i] = nav.centres[me.goal.place]
    bodies.target[i] = nav.centres[_straight(nav, int(bodies.place[i]), me.goal)]


def _straight(nav: Navigation, p: int, goal: Goal) -> int:
    """Choose where to walk straight: the goal, or the next place round a corner."""
    if goal.aim is not Aim.DIRECTION or nav.clear.reaches(p, goal.place):
        return goal.place
    return nav.next_place(p, goal.place)
