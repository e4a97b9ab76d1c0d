"""Exercise 13: a guard who is told the place. It takes 2 seconds.

At the mouth the guard saves everybody. Against a fire at the door it loses hardly
anybody: one person here, ten of 864 in 72 other evenings. In the tutorial robots that
learned saved almost as many without being told: the fire has shown them the place.
"""

from reference import Scenario, Simulation
from reference.building import building_of
from reference.workshop.engine import run_to_end
from reference.workshop.strategies.fires import FixedFire
from reference.workshop.strategies.guard import Guard
from reference.workshop.strategies.guides import Escort

PLAN = """
building: Cellar
size:     27 x 9

floor 1: cellar
      #####################
      #............#......#
      #............#......#
#######............#......#
E..................+......#
#######............#......#
      #............#......#
      #............#......#
      #####################
"""
cellar = building_of(PLAN)
evening = Scenario(
    people=12, robots_per_floor=1, sources=1, training=True, frames_per_tick=25
)
MOUTH = (0, -7.5, -0.5)
DOOR = (0, 5.5, -0.5)
for name, place in {"mouth": MOUTH, "door": DOOR}.items():
    for guides in (Escort(), Guard([MOUTH])):
        runs = [
            Simulation(cellar, evening, guides, FixedFire([place]), seed)
            for seed in range(24)
        ]
        run_to_end(runs)
        out = sum(run.outcome().evacuated for run in runs)
        print(f"{name}, {type(guides).__name__}: {out} of 288 get out")
#> mouth, Escort: 235 of 288 get out
#> mouth, Guard: 288 of 288 get out
#> door, Escort: 275 of 288 get out
#> door, Guard: 274 of 288 get out
