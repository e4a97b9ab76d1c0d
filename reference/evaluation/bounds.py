"""How bad and how good a run can be: R_w, R_b, and a bound for a given placement.

Clauses: F4, F5, F6, F7, F8, F12.  Three bests, from the coarsest to the sharpest: Eq. 7
gives everybody every floor, each at full health; `best_reward_carried` starts people on
their own floors and carries health over; `best_reward_of` knows where each one stands.

    n     people;  hp  health at the start;  len  way to a floor's nearest way out, m
    loss  health lost on that way
    mark  index of a landmark;  zone  cells joined without treading on a landmark
"""

from collections.abc import Sequence
from functools import lru_cache

import networkx as nx
import numpy as np
from scipy import ndimage

from reference.beginning import beginning
from reference.building import Building, Kind
from reference.navigation import navigation_of
from reference.paper import (
    BEST_POINT,
    FIXED_PENALTY,
    FIXED_REWARD,
    FRAMES_PER_SECOND,
    HEALTH,
    HEALTH_RATE,
    PEOPLE,
    STAIRS_SECONDS,
    WALKING_SPEED,
    WORST_POINT,
    Scenario,
)
from reference.world import World

LOSS_PER_SECOND = FRAMES_PER_SECOND * HEALTH_RATE
"""[F7] health a second: framesp and rate of Eq. 7 multiply the seconds."""

DIGITS = 2
"""[F12, chosen] of an estimate: the paper rounds its own to -12000, 14000 and 15000."""

PUSHED = 0.1
"""[F8, chosen] metres that others may push somebody ahead on the way off a floor. Who
overlap are moved apart: in crowds of up to 400 that made a step of 0.3 m 5 % longer at
most, and nobody was ahead of their own pace over five steps."""

BESIDE = np.pad(np.ones((1, 3, 3), dtype=bool), ((1, 1), (0, 0), (0, 0)))
"""All cells around one on its own floor: bodies slip over corners."""


# -- The paper's bounds -------------------------------------------------------------


def worst_reward(people: int = PEOPLE, penalty: float = FIXED_PENALTY) -> float:
    """R_w: everybody dies [F4, Eq. 6] [F5]; -12000 for the paper's forty."""
    return -penalty * people


def best_reward(
    building: Building, people: int = PEOPLE, speed: float = WALKING_SPEED
) -> float:
    """R_b, health points [F6, Eq. 7]: n · (Σ_j (hp − loss_j) + FixReward).

    The sum goes over all floors of the building; on the paper's it is 15000 within 2 %.
    Everybody gets every floor, each begun at full health, so that no run comes near it
    unless all start at the top. speed: metres per second.
    """
    floors = sum(HEALTH - loss for loss in losses(building, speed))
    return people * (floors + FIXED_REWARD)


def losses(building: Building, speed: float = WALKING_SPEED) -> tuple[float, ...]:
    """Health lost on the mean way off each floor, lowest first [F6] [F7].

    loss = seconds × frames per second × rate: Eq. 7 as printed divides by the product.
    """
    return tuple(way / speed * LOSS_PER_SECOND for way in mean_ways(building))


def mean_ways(building: Building) -> tuple[float, ...]:
    """Avg[Min(len_j)] of Eq. 7, metres, lowest floor first [F6].

    The mean over the cells of a floor's rooms, as people may start in any, of the walk
    to the nearest exit or entrance of stairs down. A checked floor plan has one.
    """
    nav, ways = navigation_of(building), []
    for floor in range(building.floors):
        nearest = nav.distance[building.ways_out(floor)].min(axis=0)
        of_floor = nearest.reshape(building.kind.shape)[floor]
        ways.append(float(of_floor[building.kind[floor] == Kind.FLOOR].mean()))
    return tuple(ways)


# -- Health carried over ------------------------------------------------------------


def best_reward_carried(losses: Sequence[float], starters: Sequence[float]) -> float:
    """Best reward when what is lost on one floor is missing on the next [F8].

    losses: health lost on the way off each floor; starters: people who start there;
    both lowest first. For 25/3 on each of three floors: 14000 when all forty start on
    the third, about 10970 when they are spread evenly. Raises ValueError where the two
    tell of different floors.
    """
    if len(losses) != len(starters):
        raise ValueError(
            f"losses on {len(losses)} floors, people on {len(starters)}: name both "
            "for every floor, lowest first."
        )
    best = 0.0
    for floor, people in enumerate(starters):
        left = HEALTH - np.cumsum(losses[floor::-1])
        best += people * float(left.clip(0).sum() + FIXED_REWARD)
    return best


def critical_points(
    building: Building, scenario: Scenario | None = None
) -> tuple[tuple[float, float], tuple[float, float]]:
    """Critical Points 1 and 2, (reward, y) each, of any building [F12, chosen].

    The first is R_w. The second is the best reward with health carried over, for people
    who start as in the scenario (where rooms or places are drawn, as from seed 0). So
    the steep part of E begins where the best runs of this very scenario end, as in the
    paper: with all forty on its third floor this gives the paper's points exactly, both
    rounded to DIGITS as there.
    """
    scenario = scenario or Scenario()
    start = beginning(building, scenario, np.random.default_rng(0))
    best = best_reward_carried(losses(building), start.occupancy)
    worst = worst_reward(sum(start.occupancy))
    return (_rounded(worst), WORST_POINT[1]), (_rounded(best), BEST_POINT[1])


def _rounded(reward: float) -> float:
    return float(f"{reward:.{DIGITS - 1}e}")


# -- A bound for one placement ------------------------------------------------------


def best_reward_of(world: World) -> float:
    """What these people can earn at most, from where they stand at 0 s [F8, chosen].

    Everybody walks at their own pace along a way that nobody can shorten, takes the
    stairs that pay best, waits for nobody and is never burnt. Neither robots nor luck
    beat that. Raises ValueError for a world that has gone on already.
    """
    if world.time > 0:
        raise ValueError(
            f"the world is at {world.time:g} s: a bound is known at 0 s only. "
            "Take it before the run."
        )
    ways, bodies = _ways(world.building), world.bodies
    starts = ways.from_people(bodies.place, bodies.position)
    return sum(
        _onwards(ways, floor, start, pace, 0.0)
        for floor, start, pace in zip(bodies.floor, starts, bodies.pace, strict=True)
    )


def _onwards(
    ways: "Ways", floor: int, metres: np.ndarray, pace: float, seconds: float
) -> float:
    """The most that one person earns from here on.

    metres: (marks,) ways to the landmarks; pace: m/s; seconds: gone by now.
    """
    walks = np.maximum(metres - PUSHED, 0) / pace
    out = ways.building.ways_out(floor)
    return max(_through(ways, mark, pace, seconds + walks[mark]) for mark in out)


def _through(ways: "Ways", mark: int, pace: float, seconds: float) -> float:
    """The most from a way out on: past landings, off the stairs, and further."""
    building = ways.building
    way, reward = building.landmarks[mark], _health(seconds)
    if not reward:
        return 0.0
    if way.kind is Kind.EXIT:
        return reward + FIXED_REWARD
    well = next(
        w for w in building.stairwells if mark in w.entrances.get(way.floor, ())
    )
    lowest = min(well.areas)
    for _landing in range(way.floor - 1, lowest, -1):
        seconds += STAIRS_SECONDS
        reward += _health(seconds)
    seconds += STAIRS_SECONDS
    return reward + max(
        _onwards(ways, lowest, ways.between[entrance], pace, seconds)
        for entrance in well.entrances[lowest]
    )


def _health(seconds: float) -> float:
    """What is left of it so late, without any fire [B7]."""
    return max(0.0, HEALTH - seconds * LOSS_PER_SECOND)


class Ways:
    """Ways through a building that no body can shorten [F8, chosen].

    From landmark to landmark as the crow flies, even over the walls of a zone: bodies
    may cut a wall's corner, and ways on the grid are up to 8 % too long.

    zone     (floors, rows, cols) which zone a cell belongs to, 0 for none; a landmark
             is one of its own, so that neighbours are joined
    touches  (marks, zones) bool: may one step from the zone into the landmark?
    between  (marks, marks) metres on foot, inf where there is no way
    """

    def __init__(self, building: Building):
        self.building, nav = building, navigation_of(building)
        marks = building.landmarks
        self.cells = [nav.centres[nav.places_of(m.floor, m.cells)] for m in marks]
        trod = building.landmark >= 0
        self.zone, zones = ndimage.label(building.walkable & ~trod, BESIDE)
        self.zone[trod] = building.landmark[trod] + zones + 1
        self.touches = np.zeros((len(marks), zones + 1 + len(marks)), dtype=bool)
        for mark in marks:
            around = ndimage.binary_dilation(building.landmark == mark.index, BESIDE)
            zone = self.zone[around & building.walkable]
            self.touches[mark.index, zone] = True
        self.between = self._between()

    def _between(self) -> np.ndarray:
        """Shortest sums of flights, none of which goes on from a way out."""
        graph = nx.DiGraph()
        marks = self.building.landmarks
        graph.add_nodes_from(range(len(marks)))
        for one, other in np.argwhere(self.touches @ self.touches.T).tolist():
            if not marks[one].leads_out:
                cells = self.cells[one][:, None], self.cells[other]
                graph.add_edge(one, other, metres=_apart(*cells, 1.0).min())
        return nx.floyd_warshall_numpy(graph, range(len(marks)), weight="metres")

    def from_people(self, place: np.ndarray, position: np.ndarray) -> np.ndarray:
        """(n, marks) metres from (n,) cells and (n, 2) points to each landmark."""
        first = np.full((len(place), len(self.cells)), np.inf)
        zone = self.zone.ravel()[place]
        for mark, cells in enumerate(self.cells):
            beside = self.touches[mark, zone]
            flight = _apart(position[beside, None], cells, 0.5).min(axis=1)
            first[beside, mark] = flight
        return (first[:, :, None] + self.between).min(axis=1)


def _apart(one: np.ndarray, other: np.ndarray, free: float) -> np.ndarray:
    """Metres between squares of cells, given by their middles, or points and squares.

    free: what of dx and dy lies inside them, 1 between two squares, 0.5 from a point.
    """
    off = (np.abs(one - other) - free).clip(0)
    return np.hypot(off[..., 0], off[..., 1])


_ways = lru_cache(maxsize=8)(Ways)
