"""Scripted fires beyond the simplest; to add one, see the folder's `__init__`.

p   place
"""

from collections.abc import Iterable, Sequence

import numpy as np

from reference.building import Building, Kind, Landmark, lengths
from reference.fire import Decision, RandomFire, decision_at, free_places, lightable
from reference.navigation import Navigation, navigation_of
from reference.workshop.strategies.observed import nearest_places
from reference.workshop.strategies.traffic import places_walked, traffic
from reference.world import World

APART_METRES = 4.0  # [D2, chosen] between cells that `busiest` lists: fires are apart


class GreedyFire:
    """Lights the cell that most people cross on the way to their next goal."""

    def decide(self, world: World, rng: np.random.Generator) -> Decision | None:
        """Choose the busiest free cell of all floors, at random among equals."""
        crossed = self._crossings(world)
        crossed[~free_places(world)] = 0
        if not crossed.any():
            return RandomFire().decide(world, rng)
        return decision_at(world, rng.choice(np.flatnonzero(crossed == crossed.max())))

    @staticmethod
    def _crossings(world: World) -> np.ndarray:
        """Walk everyone to their goals; (places,) how many people cross each place."""
        nav = navigation_of(world.building)
        bodies = world.bodies
        who = np.flatnonzero(bodies.walking)
        targets = nav.places_at(bodies.floor[who], bodies.target[who])
        crossed = np.zeros(nav.places)
        for i, target in zip(who.tolist(), targets.tolist(), strict=True):
            p = int(bodies.place[i])
            mark = int(bodies.landmark[i])
            way = (
                places_walked(nav, p, mark)
                if mark >= 0
                else nav.straight_way(p, target)
            )
            crossed[list(set(way))] += 1
        return crossed


class CloserFire:
    """Closes the ways out in turn: lights the free cell nearest to each.

    [D2] Exits come first, then entrances to stairs that lead down; lowest floors first.
    """

    def decide(self, world: World, rng: np.random.Generator) -> Decision | None:
        """Choose by the number of sources so far; a random cell where none is free."""
        ways = [way for way in exits_first(world.building) if way.leads_out]
        way = ways[len(world.flames.sources) % len(ways)].index
        places = nearest_places(world.building, [way], free_places(world))
        if not places:
            return RandomFire().decide(world, rng)
        return decision_at(world, places[0])


class FixedFire:
    """Lights the same cells in the same order, near exits first.

    Cells that other flames have reached are left out. The yardstick: a fire is adaptive
    only if it does more harm than its own most frequent sequence.
    """

    def __init__(self, places: Sequence[Decision] | None = None):
        """places: what to light, in order; by default `beside_ways_out`."""
        self.places = places

    def decide(self, world: World, rng: np.random.Generator) -> Decision | None:
        """Choose by the number of sources so far; nothing after the last place."""
        if self.places is None:
            self.places = beside_ways_out(world)
        return next_unburnt(world, self.places)


def next_unburnt(world: World, places: Sequence[Decision]) -> Decision | None:
    """Find the next cell of a sequence, by the number of sources, not yet burnt."""
    nav = navigation_of(world.building)
    burnt = (world.flames.burning | world.flames.ash).ravel()
    for at in places[len(world.flames.sources) :]:
        if not burnt[nav.place(*at)]:
            return at
    return None


def beside_ways_out(world: World) -> list[Decision]:
    """Find the cells nearest to exits, then to entrances, lowest floors first."""
    ways = [way.index for way in exits_first(world.building)]
    return [decision_at(world, p) for p in places_beside(world.building, ways)]


def exits_first(building: Building) -> list[Landmark]:
    """List the exits, then the entrances, lowest floors first."""
    marks = [mark for mark in building.landmarks if mark.kind is not Kind.DOOR]
    return sorted(marks, key=lambda mark: (mark.kind is not Kind.EXIT, mark.floor))


def places_beside(building: Building, marks: Iterable[int]) -> list[int]:
    """Find the cell nearest to each landmark that fire may enter, where one is [D6]."""
    return nearest_places(building, marks, lightable(building).ravel())


class BusiestFire:
    """Lights the cell that most cross on the cheapest ways off their floors."""

    def decide(self, world: World, rng: np.random.Generator) -> Decision | None:
        """Choose among all free cells; a random one if nobody is to cross any."""
        places = busiest(world, 1)
        return places[0] if places else RandomFire().decide(world, rng)


def busiest(world: World, count: int) -> list[Decision]:
    """List free cells that most people will cross, none within APART_METRES.

    At most `count` are listed. Everybody takes the cheapest way off the floor, and from
    the foot of the stairs on again. Among equals, those nearest to the way out come
    first.
    """
    nav = navigation_of(world.building)
    bodies = world.bodies
    stairs = bodies.stairwell[bodies.inside & (bodies.stairwell >= 0)]
    walking = bodies.place[bodies.walking]
    passed, out = traffic(world.building, walking, stairs, world.flames.cost)
    people = passed * free_places(world)
    return [decision_at(world, p) for p in apart(nav, people, out, count)]


def apart(
    nav: Navigation, people: np.ndarray, out: np.ndarray, count: int
) -> list[int]:
    """List at most `count` places that most people cross, none within APART_METRES.

    people, out: (places,) how many cross each, and metres from there to the way out;
    among equals, those nearest to the way out come first
    """
    order = np.flatnonzero(people)
    order = order[np.lexsort((out[order], -people[order]))]  # the last key counts first

    # take the first, leave out all that lie near it, and so on
    places: list[int] = []
    while len(order) and len(places) < count:
        p = int(order[0])
        places.append(p)
        metres = lengths(nav.centres[order] - nav.centres[p])
        same_floor = order // nav.floor_size == p // nav.floor_size
        order = order[~same_floor | (metres >= APART_METRES)]
    return places
