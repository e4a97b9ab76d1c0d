"""Tutorial 6: a robot that guides.

You learn what a robot decides and says. You write a strategy of your own, compare it
with `sweep`, which ships, and find out why it fails. It takes 5 seconds.
"""

from math import dist
from pathlib import Path

from reference import Simulation, load
from reference.fire import RandomFire
from reference.robots import NoRobots, actual_target, followers_of, said_on_the_way
from reference.workshop import drawing
from reference.workshop.engine import run_to_end
from reference.workshop.strategies.guides import Sweep, unguided
from reference.world import NOWHERE

# %% What a robot decides
# Two numbers, x and y: where to go next [C5]. Near a stairwell, its middle is the
# target: Eq. 1 [C6]. What the robot says depends on the target [C7]. On the way to a
# stairwell it names an entrance: followers who see it go there alone. In code floors
# count from 0, so 1 is the second.

institute = load("paper")


def words(landmark):
    """What a robot says, in words."""
    if landmark == NOWHERE:
        return "follow me"
    return institute.landmarks[landmark].id


x, y = institute.stairwells[0].centre
for metres in (3, 9):
    target = actual_target(institute, 1, x, y + metres)
    says = words(said_on_the_way(institute, 1, target))
    print(f"{metres} m north of the stairwell's middle: to {target}, {says}")
#> 3 m north of the stairwell's middle: to (-7.0, -21.5), 2/entrance-2
#> 9 m north of the stairwell's middle: to (-7.0, -12.5), follow me

# %% A strategy of your own
# Every five seconds the simulation asks it for the destinations of all robots at work.
# It may look at the whole world: robots know the map, and where people are [C1].


class Shepherd:
    """Fetch the nearest lost person; with three followers, take the nearest way out."""

    def decide(self, world, robots, rng):
        return [self.goal(world, robot) for robot in robots]

    def goal(self, world, robot):
        """The nearest of its goals, in metres through walls."""
        goals = self.goals(world, robot)
        return min(goals, key=lambda goal: dist(goal, robot.position))

    def goals(self, world, robot):
        """Where lost people are; where ways out are, once enough follow."""
        lost = unguided(world) & (world.bodies.floor == robot.floor)
        if lost.any() and len(followers_of(world, robot)) < 3:
            return world.bodies.position[lost].tolist()
        ways = world.building.ways_out(robot.floor)
        return [world.building.landmarks[way].position for way in ways]


# %% Watch it
# Algorithm 3 [C7] walks the robot to its destination, and waits for those who follow.
# In the picture, two minutes later, a straight dashed line joins each robot to its
# destination. The robot itself walks round the walls, its people behind it. Seed 7 is
# chosen to show a robot that leads three to an exit. `followers_of` counts those who
# follow the robot itself, not those who follow a follower.

simulation = Simulation(institute, robots=Shepherd(), seed=7, fire=RandomFire())
history = [drawing.tally(simulation.world)]
while simulation.world.time < 125:
    simulation.step()
    history.append(drawing.tally(simulation.world))
for robot in simulation.world.robots:
    led = len(followers_of(simulation.world, robot))
    print(f"floor {robot.floor + 1}: leads {led}, says {words(robot.says)}")
#> floor 1: leads 3, says 1/exit-2
#> floor 1: leads 1, says follow me
#> floor 2: leads 0, says 2/entrance-2
#> floor 2: leads 1, says 2/entrance-2
#> floor 3: leads 0, says 3/entrance-2
#> floor 3: leads 0, says 3/entrance-2

Path("out").mkdir(exist_ok=True)
figure = drawing.frame(simulation.world, history)
print(drawing.save(figure, "out/06_shepherds.png"))
#> out/06_shepherds.png

# %% Compare strategies
# The same seed means the same people, and fires at the same places and times. Only the
# robots differ.

fire = RandomFire()
for robots in (NoRobots(), Shepherd(), Sweep()):
    runs = [Simulation(institute, None, robots, fire, seed) for seed in range(4)]
    run_to_end(runs)
    out = [run.outcome().evacuated for run in runs]
    print(f"{type(robots).__name__:<8} {out}, {sum(out)} of 160 get out")
#> NoRobots [34, 29, 31, 24], 118 of 160 get out
#> Shepherd [31, 40, 40, 32], 143 of 160 get out
#> Sweep    [36, 37, 40, 38], 151 of 160 get out

# %% Look at a failure
# With shepherds more people get out than without robots, but not with seed 0. A mean
# does not say why. So look at both robots of the first floor in that evacuation, after
# three minutes.

simulation = Simulation(institute, robots=Shepherd(), seed=0, fire=fire)
while simulation.world.time < 180:
    simulation.step()
exit_1 = institute.landmark_of["1/exit-1"].position  # the nearest to both
for robot in simulation.world.robots[:2]:
    metres = dist(robot.position, exit_1)
    led = len(followers_of(simulation.world, robot))
    says = words(robot.says)
    print(f"{metres:.0f} m from the exit, leads {led}, says {says}")
#> 20 m from the exit, leads 2, says follow me
#> 20 m from the exit, leads 3, says follow me

# Both lead people, far from any exit, and go to fetch the same last person. (The robot
# that leads three now had only two when it decided.) Twenty seconds later nobody has
# health left: of the nine who die in this evacuation seven die then, on this floor.
# Health falls all the time [B7], so waiting for others costs lives.

# %% Your guide on the command line
# Copy the class, and the imports and names that it needs, to a file mine.py:
#
#     .venv/bin/python -m reference evaluate --robots none escort mine:Shepherd \
#         --fire random --baseline escort
#
# The column `over baseline` tells what yours saves more than `escort`, on the same
# evacuations. What a guide may look at stands in `reference/world.py`: read its records
# `World`, `Bodies`, `Robot` and `Flames`, where units stand beside each field.
# `.venv/bin/python -m pydoc reference.workshop.strategies.own` tells the rules for code
# of one's own.

# %% Exercise
# How many followers should a shepherd wait for? Try 1, 2, 3 and 5. Then let those
# who wait for one or two choose what is nearest on foot, instead of through walls and
# flames.
# Hint: `navigation_of(building).distances([robot.place], cost)` with
# `cost = flame_cost(world, robot.floor)`, from reference.navigation and
# reference.robots, are metres to every cell, flames counted. The cell of a goal has the
# number `navigation_of(building).nearest_free(robot.floor, x, y)`.
