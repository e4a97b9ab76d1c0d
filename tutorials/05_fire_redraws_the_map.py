"""Tutorial 5: fire redraws the map.

You learn where a fire source appears, how flames spread from it, and what is left of
the graph of rooms once doors have burnt. It takes 2 seconds.
"""

from pathlib import Path

import networkx as nx
import numpy as np

from reference import Scenario, Simulation, load
from reference.fire import SourceGenerator, snapped
from reference.robots import NoRobots
from reference.workshop import drawing
from reference.world import DoorBurnt

# %% Where a source appears
# The fire's player decides on a floor and two real numbers [D2]. The source appears in
# the middle of the cell nearest to them: Eq. 2 for x and Eq. 3 for y [D3].

for metres in (-9.2, -0.1, 0.0, 7.5):
    print(f"{metres:5} m becomes {snapped(metres):5} m")
#>  -9.2 m becomes  -9.5 m
#>  -0.1 m becomes  -0.5 m
#>   0.0 m becomes   0.5 m
#>   7.5 m becomes   7.5 m

# %% A strategy for the fire
# A strategy is any object that decides. This one always decides the same; in a scenario
# with one source it is asked once. Only one person, a watchman, is in the museum.


class Candle:
    """Always in the gallery of modern art."""

    def decide(self, world, rng):
        return 0, 15.2, -10.4  # floor (a map's floor 1 is 0), x and y in metres


museum = load("museum")
night = Simulation(museum, Scenario(people=1, sources=1), NoRobots(), Candle(), seed=2)

# %% Occupied places
# No fire starts where somebody stands. In training, such a choice lights no fire and
# costs a penalty. Otherwise the fire appears at a random free place instead [D6].

x, y = night.world.bodies.position[0].tolist()  # where the watchman stands
for training in (True, False):
    scenario = Scenario(sources=1, training=training)
    generator = SourceGenerator(museum, scenario, night.rng["elsewhere"])
    print(generator.generate(night.world, (0, x, y)))
#> FireRefused(time=0.0, floor=0, x=-10.5, y=8.5)
#> FireLit(time=0.0, floor=0, x=7.5, y=-6.5)

# %% First passage
# Flames take a random time from a cell to its neighbour. These times are drawn once. A
# cell begins to burn when the quickest path from a source arrives [D7]. This is called
# first-passage percolation (Hammersley and Welsh 1965). Dijkstra's algorithm finds the
# times. Each cell burns for 40 s and is ash then. Where crossing takes longer, the cell
# has burnt out before, and flames stop.

graphs = {}  # seconds: the graph of rooms by then
while night.world.time < 300:
    night.step()
    graphs[night.world.time] = night.world.graph
arrival = night.world.flames.arrival[0]
for seconds in (30, 60, 120, 240):
    print(f"after {seconds:3} s {np.sum(arrival <= seconds):3} m2 burn or are ash")
#> after  30 s  16 m2 burn or are ash
#> after  60 s  66 m2 burn or are ash
#> after 120 s 114 m2 burn or are ash
#> after 240 s 195 m2 burn or are ash

# %% Burnt doors leave the graph
# A door burns as soon as flames are beside it, and its edge leaves the graph [A6]. The
# first door that burns doubles the way out of the room with the maps. In the end ten
# rooms are cut off, as far as doors go. What is left of a door is a hole in the wall:
# once its cell is ash, people see and walk through it.


def ways(graph: nx.Graph) -> dict[str, float]:
    """Metres from each room to the outside, where there is a way."""
    return nx.single_source_dijkstra_path_length(graph, "outside", weight="length")


print(f"before the fire: {ways(museum.graph)['1/maps']:3.0f} m")
for event in night.events:
    if isinstance(event, DoorBurnt):
        door = museum.landmarks[event.landmark].id
        left = graphs[event.time]
        metres = ways(left)
        way = metres.get("1/maps", np.inf)
        lost = len(left) - len(metres)
        print(f"{event.time:3.0f} s {door:>9}: {way:3.0f} m, rooms cut off: {lost}")
#> before the fire:  41 m
#>  39 s 1/door-11:  85 m, rooms cut off: 0
#>  61 s  1/door-8:  85 m, rooms cut off: 1
#> 138 s  1/door-9:  85 m, rooms cut off: 2
#> 201 s 1/door-10: inf m, rooms cut off: 10
#> 285 s  1/door-7: inf m, rooms cut off: 10

# %% The picture
# Red cells burn first, yellow ones last. The white floor in front of the exit never
# burns: it is protected [D7]. More than two thirds of the rest has not burnt within
# these five minutes.
#
# In the graph a door is gone for good once flames come beside it. On the map its cells
# may catch fire later, or never. The door between `modern` and `asia` (8) left the
# graph after 61 s, but never burned: it is blue. Of the door between `baroque` and
# `gothic` (7) half has burnt. Tutorial 2's picture has the doors' numbers.

figure = drawing.top(museum)
axes = figure.axes[0]
shown = np.ma.masked_greater(arrival, night.world.time)
heat = axes.imshow(shown, "autumn", extent=axes.images[0].get_extent())
figure.colorbar(heat, ax=axes, shrink=0.8, pad=0.02, label="flames arrive, seconds")
Path("out").mkdir(exist_ok=True)
print(drawing.save(figure, "out/05_first_passage.png"))
#> out/05_first_passage.png

# %% Exercise
# In which room does a candle cut off most others within three minutes? Is it the same
# room for every seed?
# Hint: let a Candle remember a room, decide on its `centre`, and try museum.rooms(0).
