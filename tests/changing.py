"""A short run that many numbers change, and the same in a process that knew no other.

`python changing.py` reads `[number, value]` from each line of its input and writes what
happens under it alone, with the package imported anew each time.
"""

import json
import sys
from hashlib import sha256
from importlib import import_module

BOARD = """building: Two floors
size: 17 x 7
floor 1: ground
    #############
    #.....#.....#
#####.....#.....#
#AA+......+.....E
#####.....#.....#
    #.....#.....#
    #####EE######
floor 2: above
    #############
    #.....#.....#
#####.....#.....#
#AA+......+.....#
#####.....#######
    #.....+.....#
    #############
"""

SECONDS = 40


def what_happens():
    """A digest of a run with people, robots and a fire, and of what the maps say."""
    from reference.building import building_of
    from reference.fire import RandomFire, burnable, cells_around_clearance
    from reference.paper import Scenario
    from reference.simulation import Simulation
    from reference.workshop.strategies.guides import RandomRobots

    building = building_of(BOARD)
    sim = Simulation(building, Scenario(), RandomRobots(), RandomFire(), seed=3)
    digest = sha256()
    while sim.world.time < SECONDS:
        sim.step()
        digest.update(sim.world.bodies.position.tobytes())
        digest.update(sim.world.bodies.health.tobytes())
    facts = [sim.outcome(), sim.events, sim.world.flames.burning.tolist()]
    facts += [burnable(building).tolist(), sim.navigation.waypoint.tolist()]
    facts += [sim.sight.hits.tolist(), sim.sight.patches.tolist()]
    rooms = sorted(sim.sight.rooms)
    facts += [sorted(sim.sight.looked_at(place, frozenset())) for place in rooms]
    facts += [
        cells_around_clearance(building, mark.index).tolist()
        for mark in building.landmarks
    ]
    facts += [list(graph.edges(data=True)) for graph in (building.ways, building.graph)]
    digest.update(repr(facts).encode())
    return digest.hexdigest()


def main():
    """Play under each number, as if it had always been so."""
    for number, value in map(json.loads, sys.stdin):
        for module in [name for name in sys.modules if name.startswith("reference")]:
            del sys.modules[module]
        setattr(import_module("reference.paper"), number, value)
        print(what_happens(), flush=True)


if __name__ == "__main__":
    main()
