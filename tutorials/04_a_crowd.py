"""Tutorial 4: a crowd.

You learn how forty people leave a building that none of them knows: who leads, who
follows, how many get out, and what that depends on.
"""

from pathlib import Path

import numpy as np

from reference.paper import Scenario
from reference.simulation import Simulation
from reference.strategies import NoFire, NoRobots
from reference.workshop import drawing
from reference.workshop.maps import load
from reference.workshop.strategies.robots import guided_by
from reference.world import Mode

# %% Forty people on three floors
# The paper's building and number of people [B8]; still no robots and no fire.

institute = load("paper")
simulation = Simulation(institute, robots=NoRobots(), fire=NoFire(), seed=1)
world, bodies = simulation.world, simulation.world.bodies
print(len(bodies), "people, floor by floor", world.occupancy)
#> 40 people, floor by floor [14, 13, 13]

# %% Leaders and followers
# Everybody is in one of two modes [B4]. Leaders decide alone, like the visitor of the
# last tutorial. A leader who sees somebody to follow becomes a follower [B6, Alg. 2:7];
# a follower who has lost that person leads again [B5, Alg. 1:11]. Followers may follow
# other followers: all who follow the same leader, directly or through others, are a
# group.

print("time  leaders  followers  largest group  on stairs  out")
#> time  leaders  followers  largest group  on stairs  out
history = [drawing.tally(world)]
while world.time < 120:
    simulation.step()
    history.append(drawing.tally(world))
    if simulation.ticks % 100 == 0:
        here = bodies.mode[bodies.walking]
        heads = guided_by(world)
        print(
            f"{world.time:4.0f}  {np.sum(here == Mode.LEADER):7}"
            f"  {np.sum(here == Mode.FOLLOWER):9}"
            f"  {np.bincount(heads[heads >= 0], minlength=1).max():13}"
            f"  {np.sum(bodies.stairwell >= 0):9}  {history[-1].out:3}"
        )
    if simulation.ticks == 300:
        figure = drawing.frame(world, history)
#>   20       23          5              2          8    4
#>   40       20          7              2          7    6
#>   60       17          5              2          4   14
#>   80       14          7              2          1   18
#>  100       12          7              2          0   21
#>  120       10          2              1          0   28

# %% The picture
# One minute after the start: triangles lead, discs follow. A faint line is where a
# person walked in the last ten seconds. The colour is their health. It falls without a
# fire too [B7]: whoever is not out after 200 s is dead. The curve at the lower right
# shows that most of the fourteen who are out got there in the last twenty seconds.

Path("out").mkdir(exist_ok=True)
print(drawing.save(figure, "out/04_a_crowd.png"))
#> out/04_a_crowd.png

# %% What does it depend on?
# In smoke people see a few metres [B2]. Does seeing farther help? The same seeds put
# the same people in the same places; only the range of sight changes.


def out(metres: float, seeds: range = range(3)) -> int:
    """Count who gets out, over all seeds."""
    rule = Scenario(sight_range=metres)
    runs = (Simulation(institute, rule, NoRobots(), NoFire(), seed) for seed in seeds)
    return sum(run.run().evacuated for run in runs)


print("of 120 people, three runs:")
#> of 120 people, three runs:
for metres in (5, 6.5, 8, 10, 12):
    print(f"{metres:4} m of sight: {out(metres):3} get out")
#>    5 m of sight:  95 get out
#>  6.5 m of sight:  98 get out
#>    8 m of sight: 117 get out
#>   10 m of sight: 112 get out
#>   12 m of sight: 118 get out

# Who sees farther explores a room sooner, so more get out. People see what is farther
# than 3 m short of their range, but not well: it counts as unexplored. Three runs are
# few: a step of some people up or down is luck. Try more seeds.

# %% Exercise
# Do more people get out if they start together? Put all forty into one room of the
# third floor, and compare with forty spread over that floor.
# Hint: Scenario(rooms=("3/reading",)), Scenario(people_per_floor=(0, 0, 40)).
