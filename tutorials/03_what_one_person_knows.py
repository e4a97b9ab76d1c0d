"""Tutorial 3: what one person knows.

You learn to see a building as one visitor sees it, by rays of a few metres. You also
learn to read what the visitor remembers. Nobody here knows the map [B3]. It takes 2
seconds.
"""

from collections import Counter
from pathlib import Path

import numpy as np

from reference import Scenario, Simulation, load
from reference.building import Kind
from reference.fire import NoFire
from reference.paper import RAYS
from reference.robots import NoRobots
from reference.workshop import drawing

# %% One visitor
# A scenario says how many people start where. No robots and no fire yet.

museum = load("museum")
one = Scenario(people=1, rooms=("1/greece",))
simulation = Simulation(museum, one, robots=NoRobots(), fire=NoFire(), seed=5)
bodies = simulation.world.bodies
mind = simulation.world.minds[0]
place = bodies.place[0]  # number of the visitor's cell

# %% Rays
# Rays go out in all directions from the middle of the visitor's cell, the first to the
# east. Each returns the first thing that it meets, and the distance to the middle of
# that cell [B1]. A ray that meets nothing within its range returns nothing. In that
# direction the building is unexplored [B2].

hits = [simulation.sight.cast(place, k) for k in range(RAYS)]
print(len(hits), "rays of", simulation.sight.reach, "m")
#> 360 rays of 5.0 m
print("the first:", hits[0])
#> the first: Hit(kind='wall', distance=1.0, landmark=-1)
print(Counter(hit.kind if hit else "nothing" for hit in hits))
#> Counter({'wall': 219, 'nothing': 114, 'door': 27})

doors = {hit.landmark for hit in hits if hit and hit.kind == "door"}
print("sees", len(doors), "of", len(museum.landmarks), "doors and exits")
#> sees 1 of 12 doors and exits

# %% A way out, door by door
# This is Algorithm 2 [B6] at work. The visitor goes to an exit in view, else to a door
# in view that is not yet visited, else in an unexplored direction, else back. A door is
# visited once it was passed, or seen from both sides. The first door leads into the
# coin room, which has no other door. The visitor comes back through it, and does not
# try it again. A tick is 0.2 s; `step()` runs one.

path = []  # positions, tick by tick
known = set()  # places seen so far
memory = set()  # doors visited so far
while not simulation.done:
    path.append(bodies.position[0].copy())
    known.update(simulation.sight.sees.reached_from(bodies.place[0]))
    simulation.step()
    for door in sorted(mind.doors - memory):
        memory.add(door)
        name = museum.landmarks[door].id
        print(f"{simulation.world.time:6.1f} s  {name:>9}, {len(memory)} visited")
#>    1.4 s   1/door-1, 1 visited
#>   18.4 s   1/door-2, 2 visited
#>   25.6 s   1/door-4, 3 visited
#>   38.8 s   1/door-7, 4 visited
#>   46.6 s  1/door-10, 5 visited

# %% Compared with the shortest way
# `navigation` knows the shortest way. People do not.

(way_out,) = museum.exits
steps = np.diff(path, axis=0)
walked = np.linalg.norm(steps, axis=1).sum()
shortest = simulation.navigation.distance_to(way_out)[place]
print("got out" if simulation.outcome().evacuated else "did not get out")
#> got out
print(f"walked {walked:.0f} m")
#> walked 63 m
print(f"shortest way {shortest:.0f} m")
#> shortest way 47 m
print(f"saw {len(known) / museum.walkable.sum():.0%} of the floor")
#> saw 50% of the floor

# %% The picture
# Follow the thick line from the rays into the coin room, back, and round to the exit.
# There is another way out, through the eastern rooms. The visitor never saw them.

figure = drawing.top(museum)
axes = figure.axes[0]
axes.set_title(
    "Thin: rays at the start, dotted where they meet nothing. "
    "Thick: the walk. Grey: never seen",
    loc="left",
)
unknown = museum.kind == Kind.FLOOR
unknown.flat[list(known)] = False
page = axes.images[0].get_extent()
axes.imshow(unknown[0], "Greys", alpha=0.35 * unknown[0], extent=page)
x, y = simulation.navigation.centres[place]
for k in range(0, len(hits), 10):
    hit = hits[k]
    angle = 2 * np.pi * k / len(hits)
    far = hit.distance if hit else simulation.sight.reach
    east = x + far * np.cos(angle)
    north = y + far * np.sin(angle)
    axes.plot([x, east], [y, north], "-" if hit else ":", color="#c43c00", lw=1)
axes.plot(*np.transpose(path), color="#c43c00", lw=2.5)
Path("out").mkdir(exist_ok=True)
print(drawing.save(figure, "out/03_one_visitor.png"))
#> out/03_one_visitor.png

# %% Exercise
# What is memory worth? Let a visitor forget everything every 40, 20 or 10 seconds. How
# many of ten visitors, with ten seeds, still get out? After 200 s health is gone [B7].
# Hint: `forget(mind)`, from reference.humans, after a step.
