"""Exercise 12: who could have won the race? It takes 1 second.

On the upper floors people need about a minute, even if they know the way. By then fires
burn beside both exits. Who first has to find a robot, or a way, is too late.
"""

import numpy as np

from reference.building import Kind
from reference.navigation import navigation_of
from reference.paper import STAIRS_METRES, WALKING_SPEED
from reference.workshop.maps import load

institute = load("paper")
nav, rooms = navigation_of(institute), institute.kind == Kind.FLOOR
to_exit = nav.distance_to(*institute.exits)
for floor in range(institute.floors):
    ways = [to_exit] if floor == 0 else []
    for well in institute.stairwells:
        if well.leads_down(floor):
            (up, *_), (foot, *_) = well.entrances[floor], well.entrances[well.lowest]
            below = to_exit[nav.goals[foot]].min()
            stairs = (floor - well.lowest) * STAIRS_METRES
            ways.append(nav.distance_to(up) + stairs + below)
    metres = np.min(ways, axis=0).reshape(institute.kind.shape)[floor][rooms[floor]]
    seconds = metres[np.isfinite(metres)] / WALKING_SPEED
    print(f"floor {floor + 1}: {seconds.mean():.0f} s, at most {seconds.max():.0f} s")
#> floor 1: 17 s, at most 38 s
#> floor 2: 54 s, at most 65 s
#> floor 3: 67 s, at most 79 s
