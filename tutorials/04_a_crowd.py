"""Tutorial 4: a crowd.

You learn how forty people leave a building that none of them knows: who leads, who
follows, how many get out, and what that depends on. It takes 10 seconds.
"""

from pathlib import Path

import numpy as np

from reference import Scenario, Simulation, load
from reference.fire import NoFire, RandomFire
from reference.robots import NoRobots
from reference.workshop import drawing
from reference.workshop.engine import run_to_end
from reference.workshop.measuring.crowding import measure_crowding
from reference.workshop.strategies.guides import guided_by
from reference.world import Mode

# %% Forty people on three floors
# The paper's building and number of people [B8]; still no robots and no fire.

institute = load("paper")
simulation = Simulation(institute, robots=NoRobots(), fire=NoFire(), seed=1)
world = simulation.world
bodies = world.bodies
print(len(bodies), "people, floor by floor", world.occupancy)
#> 40 people, floor by floor [14, 13, 13]

# %% Leaders and followers
# Everybody is in one of two modes [B4]. Leaders decide alone, like the visitor of the
# last tutorial. A leader who sees somebody to follow becomes a follower [B6, Alg. 2:7].
# A follower who has lost that person leads again [B5, Alg. 1:11]. One may follow a
# follower, too. All who follow one leader, directly or through others, are a group.
# Everybody begins as a follower of nobody, and leads at once [B5, Alg. 1:3].

print("time  leaders  followers  largest group  on stairs  out")
#> time  leaders  followers  largest group  on stairs  out
history = [drawing.tally(world)]
while world.time < 120:
    simulation.step()
    history.append(drawing.tally(world))
    if simulation.ticks % 100 == 0:  # every 20 s
        modes = bodies.mode[bodies.walking]
        leaders = np.sum(modes == Mode.LEADER)
        followers = np.sum(modes == Mode.FOLLOWER)
        heads = guided_by(world)  # of each person, who leads the group; -1 if nobody
        largest = np.bincount(heads[heads >= 0], minlength=1).max()
        on_stairs = np.sum(bodies.stairwell >= 0)
        print(
            f"{world.time:4.0f}  {leaders:7}  {followers:9}  {largest:13}"
            f"  {on_stairs:9}  {history[-1].out:3}"
        )
    if simulation.ticks == 300:
        figure = drawing.frame(world, history)
#>   20       23          5              2          8    4
#>   40       18         10              3          6    6
#>   60       16          6              2          4   14
#>   80       13          8              2          1   18
#>  100       12          6              2          0   22
#>  120       10          3              1          0   27

# %% The picture
# One minute after the start: triangles lead, discs follow. A faint line is where a
# person walked in the last ten seconds. The colour is their health. It falls without a
# fire too [B7]: after 200 s those who are still inside are dead. The curve below the
# floors shows that most of the fourteen who are out left in the last twenty seconds.

Path("out").mkdir(exist_ok=True)
print(drawing.save(figure, "out/04_a_crowd.png"))
#> out/04_a_crowd.png

# %% What does it depend on?
# In smoke people see a few metres [B2]. Does it help to see farther? The same seeds put
# the same people in the same places. Only the range of sight changes. `run_to_end`
# runs simulations by the engine, a compiled tick with the same results, much sooner.


def out(metres: float, seeds: range = range(5)) -> int:
    """Count who gets out, over all seeds."""
    rule = Scenario(sight_range=metres)
    runs = [Simulation(institute, rule, NoRobots(), NoFire(), seed) for seed in seeds]
    run_to_end(runs)
    return sum(run.outcome().evacuated for run in runs)


print("of 200 people, five runs:")
#> of 200 people, five runs:
for metres in (5, 6.5, 8, 10, 12):
    print(f"{metres:4} m of sight: {out(metres):3} get out")
#>    5 m of sight: 151 get out
#>  6.5 m of sight: 168 get out
#>    8 m of sight: 191 get out
#>   10 m of sight: 198 get out
#>   12 m of sight: 195 get out

# Those who see farther explore a room sooner: from 8 m on more get out than with 5 m.
# Floor in the last 3 m of their range is seen, but not well: it counts as unexplored.
# Five runs are few. With forty, 5 and 6.5 m do not differ (79 and 77 %, RESULTS.md): a
# difference of seventeen people is luck here.

# %% Where is it dense, and where do people die?
# Six evacuations of the same building, now with fires at random places [D7]. Density is
# people per square metre: the highest of each evacuation, averaged over the six.

runs = [Simulation(institute, fire=RandomFire(), seed=seed) for seed in range(6)]
seen = measure_crowding(runs)
print("of 240 people died, floor by floor:", seen.deaths.sum(axis=(1, 2)))
#> of 240 people died, floor by floor: [27 31  1]
by_floor = seen.density.max(axis=(1, 2))
print(f"densest: {by_floor.max():.2f} per m2 on floor {by_floor.argmax() + 1}")
#> densest: 0.64 per m2 on floor 1
print(drawing.save(drawing.crowding_map(seen), "out/04_where.png"))
#> out/04_where.png

# It is densest near doors, in the corridors between them, and in a corner of the porch.
# Even there it is about six people on ten square metres: nobody is crushed.
# People die where time has run out while they searched, or where flames cut them off.

# %% Exercise
# Do more people get out if they start together? Put all forty into the reading room on
# the third floor, and compare with forty spread over that floor.
# Hint: Scenario(rooms=("3/reading",)), Scenario(people_per_floor=(0, 0, 40)).
