"""Difficulty h of a fire: how much of people's ways out it takes, and how early.

The main text, which defines h, was not at hand; ours uses the graph of rooms, doors and
stairwells [A3], and when each cell begins to burn.
Its last digits depend on the machine, since products of matrices add in any order.

    h   difficulty, from 0 to `hardest()`
    d   shortest way out, metres, inf where there is none;  d0  the same without fire
    t   seconds since the evacuation began;  T  how long health lasts
"""

from math import inf, sqrt
from typing import NamedTuple

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra

from reference import paper
from reference.building import Building, distance
from reference.fire import burnable, cells_around_clearance
from reference.paper import Scenario
from reference.simulation import Simulation
from reference.world import World

LEAST_METRES = 1e-9  # added to each way, so that shares of a way of 0 m are defined


def hardest() -> float:
    """The h at which no way out was ever open: 3853.

    A fire that closes everything is worth E = 1 by itself [F10, chosen].
    """
    return paper.ALPHA * sqrt(paper.K * paper.BETA)


def moments() -> np.ndarray:
    """Seconds at which ways are compared: whenever flames move on, from 0 until T.

    [F11, chosen] T, 200 s, is left out: nobody has health left to lose then.
    """
    count = round(paper.health_seconds() / paper.FLAME_SECONDS)
    return np.arange(count) * paper.FLAME_SECONDS


def difficulty(
    building: Building,
    arrival: np.ndarray,
    people: np.ndarray,
    scenario: Scenario | None = None,
) -> float:
    """Compute h from x, the share of their ways out that people lose [F11].

    arrival   (floors, rows, cols) seconds when each cell begins to burn, inf for never
    people    (areas,) how many start in each area
    scenario  says for how long a cell burns

    h = hardest · √x, where x is the share of ways out that the fire takes, a mean over

    * people, and each metre of the way from where they start;
    * the time from 0 to T, each moment weighted by the health left then: if all ways
      are cut for good at t, that makes x = (1 - t/T)².

    Without fire x = 0; if no way is ever open x = 1. A way counts as open again when
    what closed it has burnt out [D7]. If all of a building burnt at once, from 0 s on,
    x would be 0.36 and h 2312: for more, fires must take turns. More burning cells, the
    others as before, never lower h.

    The root is there because Eq. 8 squares h: on the paper's ruler the fire's part of E
    is x itself [F11, chosen].
    """
    if not people.any():
        return 0.0
    starters = people / people.sum()
    to_walk = starters @ _ways_by_area(building)  # sums to 1
    count = len(moments())
    time = np.arange(count + 1) / count
    health_left = -np.diff((1 - time) ** 2)  # sums to 1
    burn_seconds = (scenario or Scenario()).burn_seconds
    lost = health_left @ ways_lost(building, arrival, burn_seconds) @ to_walk
    return hardest() * sqrt(min(lost, 1.0))


def ways_lost(
    building: Building, arrival: np.ndarray, burn_seconds: float
) -> np.ndarray:
    """Compute the share of its way out that each area has lost, (moments, areas) [F11].

    A way that grows from d0 to d has lost 1 - d0/d: nothing if it is as before, half
    if it is twice as long, all if it is cut. Flames take ways as follows [F11, chosen]:

    * a door is shut while a cell of it burns [A6], and a hole in the wall later;
    * a protected exit, entrance or door is shut while everything that can burn around
      its clearance burns, but never for a room wholly inside a clearance;
    * the way from a room's middle to its doors grows as the room's free area shrinks:
      it is twice as long when half of the room burns.
    """
    links = _links(building)

    # what flames do to links, (moments, k)
    burning = _burning(arrival, burn_seconds)
    free = _free(building, burning)[:, links.area]
    longer = np.full(free.shape, inf)
    np.divide(links.metres, free, out=longer, where=free > 0)
    shut = _shut(building, burning)
    at_shut = shut[:, links.start] | shut[:, links.end]
    may_burn = np.isin(links.area, building.area[burnable(building)])
    longer[at_shut & may_burn] = inf

    # ways without fire, then at each moment
    ways, _ = _ways_out(building, links, np.vstack([links.metres, longer]))
    of_areas = ways[:, : len(building.areas)]
    d0 = of_areas[0]
    d = of_areas[1:]
    known = np.isfinite(d0) & (d > 0)
    return 1 - np.divide(d0, d, out=np.ones_like(d), where=known)


# -- Measuring a run ----------------------------------------------------------------


def people_in(world: World) -> np.ndarray:
    """Count people in each room and on each storey of the stairs, (areas,).

    People in doorways are not counted; at the beginning there are none.
    """
    areas = world.building.area.ravel()[world.bodies.place[world.bodies.inside]]
    return np.bincount(areas[areas >= 0], minlength=len(world.building.areas))


def arrival_of(simulation: Simulation) -> np.ndarray:
    """Find when each cell begins to burn, once all fire sources are lit [F11].

    (floors, rows, cols) seconds, inf for never. Good robots end a run before the last
    source, but h must not depend on that: so a copy of the run goes on until the fire
    has no sources left, or nobody could have any health left. A fire that looks at
    people, or finds them in its way [D6], lights other sources if robots do otherwise.
    """
    after = simulation.copy()
    flames = after.world.flames
    end = paper.health_seconds()
    while len(flames.sources) < after.scenario.sources and after.world.time < end:
        after.step()
    return flames.arrival


# -- The graph, each edge cut in two at its landmark --------------------------------


class Links(NamedTuple):
    """The k halves of edges; nodes are numbered, first all areas, then landmarks."""

    start: np.ndarray  # (k,) nodes
    end: np.ndarray
    area: np.ndarray  # (k,) in which a half lies
    metres: np.ndarray  # (k,) without fire


def _links(building: Building) -> Links:
    """Cut the edges of `building.ways` at their landmarks; stairs stay whole."""
    metres: dict[tuple[int, int, int], float] = {}
    for one, other, key in building.ways.edges(keys=True):
        here = building.area_of[one]
        there = building.area_of.get(other)  # None: outside
        mark = building.landmark_of.get(key)
        if mark:
            node = len(building.areas) + mark.index
            half = distance(here.centre, mark.position)
            metres[here.index, node, here.index] = half
            if there:
                half = distance(there.centre, mark.position)
                metres[node, there.index, there.index] = half
        elif there:
            metres[here.index, there.index, here.index] = paper.stairs_metres()
    start, end, area = np.array(list(metres)).T
    return Links(start, end, area, np.array(list(metres.values())))


def _ways_out(
    building: Building, links: Links, metres: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Search from the exits against the links: metres, and the next node on the way.

    metres: (times, k) of the links; returns (times, nodes) each. One big graph holds
    the graphs of all times, and next nodes are numbered through all of it.
    """
    times = len(metres)
    areas = len(building.areas)
    nodes = areas + len(building.landmarks)
    first = nodes * np.arange(times)[:, None]
    backwards = (first + links.end).ravel(), (first + links.start).ravel()
    graph = csr_matrix(
        (metres.ravel(), backwards), shape=(nodes * times, nodes * times)
    )
    exits = (first + areas + sorted(building.exits)).ravel()
    d, after, _ = dijkstra(
        graph, indices=exits, min_only=True, return_predecessors=True
    )
    return d.reshape(times, nodes), after.reshape(times, nodes)


def _ways_by_area(building: Building) -> np.ndarray:
    """Compute the share of an area's way out that lies in each area, (areas, areas).

    The way is the shortest without fire, in metres; rows sum to 1.
    """
    links = _links(building)
    ways, nexts = _ways_out(building, links, links.metres[None])
    d0 = ways[0]
    after = nexts[0]
    areas = len(building.areas)
    metres = np.zeros((areas, areas))
    for area in range(areas):
        metres[area, area] = LEAST_METRES
        node = area
        while after[node] >= 0:
            further = after[node]
            inside = node if node < areas else further
            metres[area, inside] += d0[node] - d0[further]
            node = further
    return metres / metres.sum(axis=1, keepdims=True)


# -- What flames do to it -----------------------------------------------------------


def _burning(arrival: np.ndarray, burn_seconds: float) -> np.ndarray:
    """Find which cells burn, (moments, floors, rows, cols) bool [D7]."""
    # one moment after the other: numbers of all would take a gigabyte in a large map
    return np.stack([(arrival <= t) & (t - arrival < burn_seconds) for t in moments()])


def _free(building: Building, burning: np.ndarray) -> np.ndarray:
    """Share of each area's cells that do not burn, (moments, areas)."""
    cells = (burning[:, area.floor, *area.cells.T] for area in building.areas)
    return np.stack([1 - some.mean(axis=1) for some in cells], axis=1)


def _shut(building: Building, burning: np.ndarray) -> np.ndarray:
    """Find landmarks that are shut, (moments, nodes) bool."""
    areas = len(building.areas)
    count = len(burning)
    shut = np.zeros((count, areas + len(building.landmarks)), dtype=bool)
    for node, mark in enumerate(building.landmarks, areas):
        own = (building.landmark == mark.index) & burnable(building)
        if own.any():
            shut[:, node] = burning[:, own].any(axis=1)
        elif len(around := cells_around_clearance(building, mark.index)):
            shut[:, node] = burning.reshape(count, -1)[:, around].all(axis=1)
    return shut
