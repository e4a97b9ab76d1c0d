"""People walk, many at once, and take the stairs one by one.

On the stairs nobody is seen and nobody is in the way; the bottleneck is the entrance on
the way in, and on the way out bodies alone [A3, chosen].  The paper's entrances join a
floor's platform and its staircases; ours stand between room and stairwell, and the
platform is part of the stairs: who enters is on the stairs [A3, deviation].

    who  (k,) numbers of those who walk;  i  a person;  mark  index of a landmark
    p    place;  k  an index into who
"""

from math import inf

import numpy as np

from reference import humans, paper
from reference.building import Stairwell, lengths
from reference.motion import Free
from reference.navigation import navigation_of
from reference.world import NOBODY, NOWHERE, World

Touched = list[tuple[int, int]]  # who stepped onto a landmark, and from which place


def targets(world: World, who: np.ndarray) -> np.ndarray:
    """(k, 2) metres where these people walk straight at.

    A person without headway for DETOUR_SECONDS plans again, from cell to cell [A9,
    chosen]. So nobody leans on a corner for ever.
    """
    bodies = world.bodies
    nav = navigation_of(world.building)
    marks = bodies.landmark[who]
    target = bodies.target[who]
    guided = np.flatnonzero(marks >= 0)
    cells = bodies.place[who[guided]] % nav.floor_size
    target[guided] = nav.centres[nav.waypoint[marks[guided], cells]]

    delayed = world.time - bodies.headway_time[who] > paper.DETOUR_SECONDS
    for k in np.flatnonzero(delayed).tolist():
        place = int(bodies.place[who[k]])
        if marks[k] >= 0:
            goals = nav.goals[marks[k]].tolist()
        else:
            goals = [nav.place(place // nav.floor_size, *target[k].tolist())]
        target[k] = nav.centres[nav.next_place(place, *goals)]
    return target


def free_for(world: World, who: np.ndarray, full: np.ndarray) -> Free:
    """Tell where people may stand: not in walls, full doors, or flames unless reckless.

    full: (landmarks + 1,) bool; no landmark, -1, reads the last, which is never full
    """
    bodies = world.bodies
    nav = navigation_of(world.building)
    marks = world.building.landmark.ravel()
    burning = world.flames.burning.ravel()
    floor = bodies.floor[who]
    inside = marks[bodies.place[who]]
    reckless = bodies.reckless_until[who] > world.time - 1e-9
    fearless = burning[bodies.place[who]] | reckless

    def free(position: np.ndarray, which: np.ndarray) -> np.ndarray:
        """May these stand at these positions?"""
        place = nav.places_at(floor[which], position)
        mark = marks[place]
        room = ~full[mark] | (mark == inside[which])
        return room & nav.walkable[place] & (~burning[place] | fearless[which])

    return free


def advance(world: World, who: np.ndarray, moved: np.ndarray) -> Touched:
    """Put people where they walked to; return who stepped onto a landmark [A5]."""
    bodies = world.bodies
    marks = world.building.landmark.ravel()
    before = bodies.place[who]
    place = navigation_of(world.building).places_at(bodies.floor[who], moved)
    bodies.position[who] = moved
    bodies.place[who] = place
    _notice_stuck(world, who)
    mark = marks[place]
    upon = np.flatnonzero((mark >= 0) & (mark != marks[before]))
    return list(zip(who[upon].tolist(), before[upon].tolist(), strict=True))


def _notice_stuck(world: World, who: np.ndarray) -> None:
    """Find who is stuck; they ignore flames for a while, then try anew [B5].

    No headway for STUCK_SECONDS: reckless for RECKLESS_SECONDS. Still none: the clock
    starts over.
    """
    bodies = world.bodies
    position = bodies.position[who]
    moved = np.abs(position - bodies.headway[who]).max(axis=1)  # east or north
    to_goal = np.abs(bodies.goal[who] - position).max(axis=1)
    arrived = (to_goal < paper.STUCK_METRES) & (bodies.landmark[who] < 0)
    waited = world.time - bodies.headway_time[who] - 1e-9

    starts_over = waited > paper.STUCK_SECONDS + paper.RECKLESS_SECONDS
    made_headway = (moved > paper.STUCK_METRES) | arrived | starts_over
    bodies.headway[who[made_headway]] = position[made_headway]
    bodies.headway_time[who[made_headway]] = world.time

    not_reckless = bodies.reckless_until[who] < world.time - 1e-9
    now_stuck = who[~made_headway & not_reckless & (waited > paper.STUCK_SECONDS)]
    bodies.reckless_until[now_stuck] = world.time + paper.RECKLESS_SECONDS


# -- Stairs -------------------------------------------------------------------------


def enter_stairs(world: World, i: int, entrance: int) -> None:
    """Move a human who has touched an entrance onto its stairs, which lead down."""
    bodies = world.bodies
    nav = navigation_of(world.building)
    well = world.building.landmarks[entrance].stairwell
    cells = nav.places_of(int(bodies.floor[i]), world.building.stairwells[well].cells)
    bodies.stairwell[i] = well
    bodies.leader[i] = NOBODY
    bodies.landmark[i] = NOWHERE
    bodies.stairs_until[i] = world.time + paper.stairs_metres() / float(bodies.pace[i])
    bodies.place[i] = cells[i % len(cells)]  # nobody sees them: spread by number
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
    """Step out into an entrance cell that nobody stands in, if there is one.

    Who steps out does not know this floor [B3].
    """
    bodies = world.bodies
    nav = navigation_of(world.building)
    others = bodies.position[bodies.walking & (bodies.floor == well.lowest)]
    for mark in well.entrances[well.lowest]:
        for p in nav.goals[mark].tolist():
            if (lengths(others - nav.centres[p]) < paper.body_diameter()).any():
                continue
            bodies.place[i] = p
            bodies.position[i] = nav.centres[p]
            bodies.headway[i] = nav.centres[p]
            bodies.headway_time[i] = world.time
            bodies.stairwell[i] = NOWHERE
            bodies.stairs_until[i] = inf
            beyond = nav.place_beyond(p, well.areas[well.lowest])
            humans.arrive(world.minds[i], mark, beyond)
            return
