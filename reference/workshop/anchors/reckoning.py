"""What an anchor costs: metres to go there and on to the outside, by present flames.

Metres beside flames count more, as hand-written guides reckon [C7]; robots know the map
and see what burns [C3].

    S  worlds;  B  robots of all worlds;  K  anchors;  k  ways out of a floor
    p  places, q  those of one floor
"""

from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from reference.building import Building
from reference.navigation import navigation_of
from reference.workshop.strategies.guides import DETOUR, TRIP, risk
from reference.workshop.strategies.traffic import ways_outside
from reference.world import Flames

FARTHEST = 300.0  # metres: nothing counts as farther; walls are as far as that

MarksOfWays = Sequence[Sequence[Iterable[int]]]  # landmarks of a floor's ways out


class CostsNow:
    """Metres outside in each world, more near its flames, FARTHEST at most.

    outside  (S, p) by the cheapest way
    by_way   (S, floors, k, q) by each way out of a floor, from its places
    """

    def __init__(
        self,
        building: Building,
        ways: MarksOfWays,
        unburnt: Mapping[int, np.ndarray],
        flames: Sequence[Flames | None],
    ):
        """ways: of each floor, the landmarks of each of its k ways out.

        unburnt: `ways_outside` without flames;  flames: of each world, None for none
        """
        self.nav = navigation_of(building)
        self.flames = flames
        most = max(map(len, ways))
        size = self.nav.floor_size
        self.by_way = np.full((len(flames), len(ways), most, size), FARTHEST)
        self.outside = np.full((len(flames), self.nav.places), FARTHEST)
        for s, one in enumerate(flames):
            cost = risk(building, one) if one else None
            found = unburnt if cost is None else ways_outside(building, cost)
            _note_least(self.outside[s], found.values())
            for floor, here in enumerate(ways):
                mine = slice(floor * size, (floor + 1) * size)
                for k, marks in enumerate(here):
                    through = (found[mark][mine] for mark in marks)
                    _note_least(self.by_way[s, floor, k], through)

    def to_places(
        self, world: int, start: int, goals: np.ndarray, unburnt: np.ndarray
    ) -> np.ndarray:
        """Measure metres to goals (K,) of the same floor, round flames, as robots walk.

        unburnt: (K,) the same metres without flames
        """
        flames = self.flames[world]
        if flames is None or not flames.burning[start // self.nav.floor_size].any():
            return unburnt
        return self.nav.distances([start], flames.cost)[goals]


def _note_least(least: np.ndarray, metres: Iterable[np.ndarray]) -> None:
    """Lower metres, (p,) or (q,), to the least of several more."""
    for d in metres:
        np.minimum(least, d, out=least)


def gains(
    total: np.ndarray, here: np.ndarray, lost: np.ndarray, led: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Weigh anchors as `guides.choose` does its groups: (B, K) each.

    total (B, K): metres outside by an anchor;  here (B,): by the cheapest way
    lost (B, K): people in a group there;  led (B,): by the robot

    Returns how many more people a metre it brings than to lead out at once, and the
    detour of all who are led for each person fetched, 1 at the guides' limit.
    """
    led = led[:, None]
    here = here[:, None]
    more = (led + lost) / (TRIP + total) - led / (TRIP + here)
    detour = led * np.maximum(total - here, 0) / (DETOUR * np.maximum(lost, 1))
    return more, detour
