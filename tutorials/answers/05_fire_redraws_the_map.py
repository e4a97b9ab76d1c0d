"""Exercise 5: in which room does a candle cut off most others? It takes 10 seconds.

In the foyer, which has the only exit, and then in the shop beside it; but not with
every seed: with the second one only one of the foyer's two doors on the ring burns, so
all but the shop can go round. Then greece, gothic and asia cut off most, two rooms.
"""

import networkx as nx

from reference import Scenario, Simulation, load
from reference.building import Area, without_doors
from reference.robots import NoRobots

museum = load("museum")


class Candle:
    """Always in the middle of one room."""

    def __init__(self, room: Area):
        self.room = room

    def decide(self, world, rng):
        return self.room.floor, *self.room.centre


def cut_off(room: Area, seed: int) -> int:
    """Count other rooms without a way out after three minutes."""
    night = Simulation(
        museum, Scenario(people=1, sources=1), NoRobots(), Candle(room), seed
    )
    while night.world.time < 180:
        night.step()
    burnt = [museum.landmarks[k].id for k in night.world.burnt]
    left = without_doors(museum.graph, burnt)
    return len(set(left) - nx.node_connected_component(left, "outside") - {room.id})


for room in museum.rooms(0):
    print(f"{room.id:9}", [cut_off(room, seed) for seed in range(4)])
#> 1/rome    [1, 1, 2, 2]
#> 1/greece  [2, 2, 2, 3]
#> 1/coins   [0, 0, 0, 1]
#> 1/egypt   [2, 1, 2, 3]
#> 1/gothic  [2, 2, 2, 2]
#> 1/asia    [3, 2, 2, 2]
#> 1/maps    [1, 0, 2, 0]
#> 1/baroque [1, 1, 2, 1]
#> 1/foyer   [10, 1, 10, 10]
#> 1/shop    [9, 0, 9, 9]
#> 1/modern  [3, 0, 1, 0]
