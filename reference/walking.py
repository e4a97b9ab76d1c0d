"""People walk, many at once, and take the stairs one by one.

Clauses: A3, A5, A9, B3, B5, F8.  The people may be of one world, or of several worlds
of one building that share a clock and keep their bodies in common arrays.

On the stairs nobody is seen and nobody is in the way; the bottleneck is the entrance on
the way in, and on the way out bodies alone [A3, chosen].  The paper's entrances join a
floor's platform and its staircases; ours stand between room and stairwell, and the
platform is part of the stairs: who enters is on the stairs [A3, deviation].

    who  (k,) numbers of those who walk;  i  a person;  mark  index of a landmark
    p    place;  k  stairwell
"""

from collections.abc import Callable
from math import inf

import numpy as np

from reference import humans, paper
from reference.building import Stairwell
from reference.motion import Free
from reference.navigation import navigation_of
from reference.world import NOBODY, NOWHERE, World

Touched = list[tuple[int, int]]  # who stepped onto a landmark, and from which place
Lookup = Callable[[np.ndarray, np.ndarray], np.ndarray]
"""(k,) places or landmarks, and (k,) people who ask -> (k,) bool."""


def targets(world: World, who: np.ndarray) -> np.ndarray:
    """(k, 2) metres where these people walk straight at.

    A person without headway for DETOUR_SECONDS plans again, from cell to cell [A9,
    chosen]. So nobody leans on a corner for ever.
    """
    bodies, nav = world.bodies, navigation_of(world.building)
    marks, target = bodies.landmark[who], bodies.target[who]
    guided = np.flatnonzero(marks >= 0)
    cells = bodies.place[who[guided]] % nav.floor_size
    waypoint = nav.waypoint[marks[guided], cells]
    target[guided] = nav.centres[waypoint]
    held_up = world.time - bodies.anchor_time[who] > paper.DETOUR_SECONDS
    for k in np.flatnonzero(held_up).tolist():
        place, mark = int(bodies.place[who[k]]), int(marks[k])
        there = nav.place(place // nav.floor_size, *target[k].tolist())
        goals = nav.goals[mark].tolist() if mark >= 0 else [there]
        target[k] = nav.centres[nav.onward(place, *goals)]
    return target


def free_for(world: World, who: np.ndarray, burns: Lookup, full: Lookup) -> Free:
    """Tell where people may stand: not in walls, full doors, or flames unless reckless.

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


def advance(world: World, who: np.ndarray, moved: np.ndarray) -> Touched:
    """Put people where they walked to; return who stepped onto a landmark [A5]."""
    bodies, marks = world.bodies, world.building.landmark.ravel()
    before, nav = bodies.place[who], navigation_of(world.building)
    bodies.position[who] = moved
    bodies.place[who] = place = nav.places_at(bodies.floor[who], moved)
    _notice_stuck(world, who)
    mark = marks[place]
    upon = np.flatnonzero((mark >= 0) & (mark != marks[before]))
    return list(zip(who[upon].tolist(), before[upon].tolist(), strict=True))


def _notice_stuck(world: World, who: np.ndarray) -> None:
    """Find who is stuck; they ignore flames for a while, then try anew [B5]."""
    bodies, time = world.bodies, world.time
    position = bodies.position[who]
    moved = np.maximum(*np.abs(position - bodies.anchor[who]).T)
    left = np.maximum(*np.abs(bodies.goal[who] - position).T)
    arrived = (left < paper.STUCK_METRES) & (bodies.landmark[who] < 0)
    waited = time - bodies.anchor_time[who] - 1e-9
    anew = waited > paper.STUCK_SECONDS + paper.RECKLESS_SECONDS
    ahead = (moved > paper.STUCK_METRES) | arrived | anew
    bodies.anchor[who[ahead]] = position[ahead]
    bodies.anchor_time[who[ahead]] = time
    calm = bodies.reckless_until[who] < time - 1e-9
    halted = who[~ahead & calm & (waited > paper.STUCK_SECONDS)]
    bodies.reckless_until[halted] = time + paper.RECKLESS_SECONDS


# -- Stairs -------------------------------------------------------------------------


def enter_stairs(world: World, i: int, entrance: int) -> None:
    """Move a human who has touched an entrance onto its stairs, which lead down."""
    building, bodies = world.building, world.bodies
    nav, k = navigation_of(building), building.landmarks[entrance].stairwell
    cells = nav.places_of(int(bodies.floor[i]), building.stairwells[k].cells)
    bodies.stairwell[i], bodies.leader[i], bodies.landmark[i] = k, NOBODY, NOWHERE
    bodies.stairs_until[i] = world.time + paper.stairs_metres() / float(bodies.pace[i])
    bodies.place[i] = cells[i % len(cells)]
    bodies.position[i] = nav.centres[bodies.place[i]]


def descend(world: World, i: int) -> int | None:
    """Bring a human one storey down; return the floor of a landing passed, if any.

    At the lowest floor the human steps out, or waits for a free place to do so.
    """
    bodies = world.bodies
    well = world.building.stairwells[bodies.stairwell[i]]
    if bodies.floor[i] > well.lowest:
        bodies.floor[i] -= 1
        bodies.place[i] -= world.building.kind[0].size
        if bodies.floor[i] > well.lowest:
            bodies.stairs_until[i] += paper.stairs_metres() / float(bodies.pace[i])
            return int(bodies.floor[i])
    _step_out(world, i, well)
    return None


def _step_out(world: World, i: int, well: Stairwell) -> None:
    """Step out into an entrance cell that nobody stands in, if there is one."""
    bodies, nav = world.bodies, navigation_of(world.building)
    others = bodies.position[bodies.walking & (bodies.floor == well.lowest)]
    for mark in well.entrances[well.lowest]:
        for p in nav.goals[mark].tolist():
            if (np.hypot(*(others - nav.centres[p]).T) >= paper.body_diameter()).all():
                bodies.place[i], bodies.position[i] = p, nav.centres[p]
                bodies.anchor[i], bodies.anchor_time[i] = nav.centres[p], world.time
                bodies.stairwell[i], bodies.stairs_until[i] = NOWHERE, inf
                beyond = nav.beyond(p, well.areas[well.lowest])
                humans.arrive(world.minds[i], mark, beyond)
                return
