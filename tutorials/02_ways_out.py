"""Tutorial 2: ways out.

You learn to use a building as a graph: rooms are nodes, doors are the edges between
them. The library networkx then finds shortest ways, bottlenecks, and what burning doors
cut off. It takes 2 seconds.
"""

from pathlib import Path

import networkx as nx

from reference import load
from reference.building import without_doors
from reference.workshop import drawing

# %% Rooms are nodes, doors are edges
# "outside" is a node too. Between two nodes there may be several doors, hence "multi".

museum = load("museum")
graph = museum.graph
print(graph)
#> MultiGraph with 12 nodes and 12 edges
print(graph.nodes["1/coins"])
#> {'name': 'coins', 'kind': 'room', 'floor': 0, 'area': 25}
door = graph.edges["1/coins", "1/greece", "1/door-1"]
print(door["kind"], door["width"], "m wide", round(door["length"]), "m")
#> door 1 m wide 9 m

# %% The shortest way out of a room
# An edge is as long as the way from the middle of one room, through the door, to the
# middle of the other. People cut corners, so here their ways are up to 11 m shorter.
# That is good enough to compare ways.

way = nx.shortest_path(graph, "1/coins", "outside", weight="length")
print(" > ".join(way))
#> 1/coins > 1/greece > 1/rome > 1/gothic > 1/baroque > 1/foyer > outside

metres = nx.single_source_dijkstra_path_length(graph, "outside", weight="length")
farthest = max(metres, key=metres.get)
print(f"farthest from outside is {farthest}, {metres[farthest]:.0f} m")
#> farthest from outside is 1/coins, 61 m

# %% What burning a door cuts off
# Flames destroy a door that they touch [A6]. `without_doors` removes doors from the
# graph. Rooms that are then no longer connected to "outside" are cut off. The picture
# at the end has the doors' numbers.


def cut_off(*doors: str) -> set[str]:
    """Rooms from which there is no way out once these doors have burnt."""
    left = without_doors(graph, doors)
    return set(left) - nx.node_connected_component(left, "outside")


print("one door: ", sorted(cut_off("1/door-1")))
#> one door:  ['1/coins']
print("two doors:", sorted(cut_off("1/door-2", "1/door-11")))
#> two doors: ['1/asia', '1/coins', '1/egypt', '1/greece', '1/maps', '1/modern']

# %% Bridges
# A bridge is an edge without which the graph falls apart. The exit is one too, but
# exits do not burn.

bridges = []
for one, other in nx.bridges(graph):
    (name,) = graph[one][other]  # a bridge is the only edge between its nodes
    if graph.edges[one, other, name]["kind"] == "door":
        bridges.append(name)
for door in bridges:
    print(f"{door} is the only way out of {', '.join(cut_off(door))}")
#> 1/door-1 is the only way out of 1/coins
#> 1/door-6 is the only way out of 1/maps
#> 1/door-9 is the only way out of 1/shop

# An articulation point is to nodes what a bridge is to edges: without this room, others
# have no way out.

print("articulation points:", sorted(nx.articulation_points(graph)))
#> articulation points: ['1/asia', '1/foyer', '1/greece']

# %% The picture
# All rooms but three lie on one ring. One of its doors may burn, but not two. The three
# rooms behind the circled doors have no second way. A number in a wall is that of the
# door beside it: 7 is `1/door-7`.

figure = drawing.graph(museum)
axes = figure.axes[0]
axes.set_title("Circled: doors that are bridges", loc="left")
for mark in museum.landmarks:
    if mark.id in bridges:
        axes.plot(*mark.position, "o", ms=18, mfc="none", mec="#c43c00", mew=2)
Path("out").mkdir(exist_ok=True)
print(drawing.save(figure, "out/02_museum_graph.png"))
#> out/02_museum_graph.png

# %% Exercise
# Which two doors, burnt together, cut off the most square metres?
# Hint: itertools.combinations gives all pairs of doors, and every node but "outside"
# knows its area.
