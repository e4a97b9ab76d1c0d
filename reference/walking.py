"""People set off and walk, many at once: what a tick does to bodies and minds.

Clauses: A5, B3, B5.  The people may be those of one world, or of several worlds of one
building that share a clock and have their bodies in common arrays.

    who   (k,) numbers of those who act;  mark  index of a landmark
"""

from collections.abc import Callable

import numpy as np

from reference import paper
from reference.humans import think
from reference.motion import Free
from reference.navigation import navigation_of
from reference.perception import View
from reference.world import NOWHERE, Aim, World

Touched = list[tuple[int, int]]
"""People who have come upon a landmark, and the places they came from."""

Lookup = Callable[[np.ndarray, np.ndarray], np.ndarray]
"""(k,) places or landmarks, and (k,) people who ask -> (k,) bool."""


def decide(world: World, who: np.ndarray, views: list[View]) -> None:
    """Let these people think; then copy their goals to their bodies."""
    minds, bodies = [world.minds[i] for i in who.tolist()], world.bodies
    for me, view in zip(minds, views, strict=True):
        think(me, view)
    bodies.mode[who] = [int(me.mode) for me in minds]
    bodies.leader[who] = [me.leader for me in minds]
    goals = [me.goal for me in minds]
    landmark = Aim.LANDMARK
    marks = [g.which if g.aim is landmark else NOWHERE for g in goals]
    place = np.array([goal.place for goal in goals], dtype=np.int64)
    there, stays = navigation_of(world.building).centres[place], place == NOWHERE
    bodies.landmark[who] = marks
    bodies.target[who] = np.where(stays[:, None], bodies.position[who], there)


def targets(world: World, who: np.ndarray) -> np.ndarray:
    """(k, 2) metres where these people walk straight at."""
    bodies, nav = world.bodies, navigation_of(world.building)
    marks, target = bodies.landmark[who], bodies.target[who]
    guided = np.flatnonzero(marks >= 0)
    waypoint = nav.waypoint(marks[guided], bodies.place[who[guided]])
    target[guided] = nav.centres[waypoint]
    return target


def free_for(world: World, who: np.ndarray, burns: Lookup, full: Lookup) -> Free:
    """Tell where people may stand: not in walls, full doors, or flames if careful.

    burns: is there a flame in a place?  full: is a landmark full?
    """
    bodies, nav = world.bodies, navigation_of(world.building)
    here, floor = bodies.place[who], bodies.floor[who]
    marks = world.building.landmark.ravel()
    inside, reckless = marks[here], bodies.reckless_until[who] > world.time - 1e-9
    fearless = burns(here, np.arange(len(who))) | reckless

    def free(position: np.ndarray, which: np.ndarray) -> np.ndarray:
        """May these stand at these positions?"""
        place = nav.places_at(floor[which], position)
        mark = marks[place]
        room = ~full(mark, which) | (mark == inside[which])
        return room & nav.walkable[place] & (~burns(place, which) | fearless[which])

    return free


def arrive(
    world: World, who: np.ndarray, target: np.ndarray, moved: np.ndarray
) -> Touched:
    """Put people where they walked to; return who stepped onto a landmark [A5]."""
    bodies, marks = world.bodies, world.building.landmark.ravel()
    before, nav = bodies.place[who], navigation_of(world.building)
    bodies.position[who] = moved
    bodies.place[who] = place = nav.places_at(bodies.floor[who], moved)
    _notice_stuck(world, who, target)
    mark = marks[place]
    upon = np.flatnonzero((mark >= 0) & (mark != marks[before]))
    return list(zip(who[upon].tolist(), before[upon].tolist(), strict=True))


def _notice_stuck(world: World, who: np.ndarray, target: np.ndarray) -> None:
    """Find who is stuck; they ignore flames for a while, then try anew [B5]."""
    bodies, time = world.bodies, world.time
    position = bodies.position[who]
    moved = np.maximum(*np.abs(position - bodies.anchor[who]).T)
    left = np.maximum(*np.abs(target - position).T)
    arrived = (left < paper.STUCK_METRES) & (bodies.landmark[who] < 0)
    waited = time - bodies.anchor_time[who] - 1e-9
    anew = waited > paper.STUCK_SECONDS + paper.RECKLESS_SECONDS
    ahead = (moved > paper.STUCK_METRES) | arrived | anew
    bodies.anchor[who[ahead]] = position[ahead]
    bodies.anchor_time[who[ahead]] = time
    calm = bodies.reckless_until[who] < time - 1e-9
    halted = who[~ahead & calm & (waited > paper.STUCK_SECONDS)]
    bodies.reckless_until[halted] = time + paper.RECKLESS_SECONDS
