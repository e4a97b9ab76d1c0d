"""Exercise 2: which two doors cut off the most square metres? It takes a second.

The two doors of the foyer, which has the only exit. Nine of eleven rooms are behind
them; the shop is the other one that still has a way out.
"""

from itertools import combinations

import networkx as nx

from reference import load
from reference.building import without_doors

graph = load("museum").graph
area = dict(graph.nodes(data="area", default=0))
doors = [
    door
    for _, _, door, edge in graph.edges(keys=True, data=True)
    if edge["kind"] == "door"
]


def lost(pair: tuple[str, str]) -> int:
    """Square metres from which there is no way out once both doors have burnt."""
    left = without_doors(graph, pair)
    reached = nx.node_connected_component(left, "outside")
    return sum(area[room] for room in set(left) - reached)


worst = max(combinations(doors, 2), key=lost)
total = sum(area.values())
print(" and ".join(worst), "cut off", lost(worst), "of", total, "m2")
#> 1/door-10 and 1/door-11 cut off 695 of 828 m2
