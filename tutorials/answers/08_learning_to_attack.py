"""Exercise 8: a second exit, and an ambush that guards both. It takes 2 seconds.

A second exit helps more than either fire harms. Near exits fires cannot be lit [D7], so
even an ambush at both of them comes too late for most.
"""

import numpy as np

from reference import Scenario, Simulation
from reference.building import building_of
from reference.fire import RandomFire, free_places
from reference.navigation import navigation_of
from reference.workshop.engine import run_to_end
from reference.workshop.strategies.guides import Sweep

PLAN = """
building: Gallery
size:     34 x 12

floor 1: gallery
##################################
#.......#.......#.......#........#
#.......#.......#.......#........#
#.......#.......#.......#........#
#.goya..#.monet.#.klee..#.miro...#
####+#######+#######+#######+#####
#................................#
E......................corridor..E
#................................#
####+########+##########+#########
#.cafe....#.durer....#.rubens....#
##################################
"""
evening = Scenario(
    people=8, robots_per_floor=1, sources=2, training=True, frames_per_tick=25
)


class Ambush:
    """Light the free cell that is nearest to an exit; the exits in turn."""

    def decide(self, world, rng):
        nav = navigation_of(world.building)
        exits = sorted(world.building.exits)
        guarded = exits[len(world.flames.sources) % len(exits)]
        metres = np.where(free_places(world), nav.distance_to(guarded), np.inf)
        x, y = nav.centres[metres.argmin()].tolist()
        return 0, x, y


PLANS = {
    "one exit": PLAN.replace("corridor..E", "corridor..#"),
    "two exits": PLAN,
}
for name, plan in PLANS.items():
    building = building_of(plan)
    for fire in (RandomFire(), Ambush()):
        runs = [
            Simulation(building, evening, Sweep(), fire, seed)
            for seed in range(1000, 1024)
        ]
        run_to_end(runs)
        out = sum(run.outcome().evacuated for run in runs)
        print(f"{name}, {type(fire).__name__}: {out} of 192 get out")
#> one exit, RandomFire: 155 of 192 get out
#> one exit, Ambush: 156 of 192 get out
#> two exits, RandomFire: 190 of 192 get out
#> two exits, Ambush: 189 of 192 get out
