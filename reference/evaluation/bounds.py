"""The worst reward R_w, the best R_b by Eq. 7, and the critical points.

Two estimates of the best: Eq. 7 counts everybody on every floor, each at full health;
`best_reward_carried` starts people on their own floors and carries health over from
floor to floor. Both take mean ways, so neither is a bound in every map: who comes from
above crosses a floor from stairs to stairs, which may be nearer.

    n     people;  hp  health at the start;  len  way to a floor's nearest way out, m
    loss  health lost on that way;  j  floor
"""

from collections.abc import Sequence

import numpy as np

from reference import paper
from reference.beginning import starting_world
from reference.building import Building, Kind
from reference.navigation import navigation_of
from reference.paper import Scenario

DIGITS = 2  # [F12, chosen] significant digits of an estimate, like the paper's


def worst_reward(people: int) -> float:
    """R_w: everybody dies [F4, Eq. 6] [F5]; -12000 for the paper's forty."""
    return -paper.FIXED_PENALTY * people


def best_reward(building: Building, people: int) -> float:
    """R_b, health points [F6, Eq. 7]: n · (Σ_j (hp − loss_j) + FixReward).

    The sum goes over all floors. For the paper's building R_b is 15000 within 2 %.
    """
    on_floors = sum(paper.HEALTH - loss for loss in health_losses(building))
    return people * (on_floors + paper.FIXED_REWARD)


def health_losses(building: Building) -> tuple[float, ...]:
    """Health lost on the mean way off each floor, lowest first [F6] [F7].

    loss = seconds × frames per second × rate: Eq. 7 as printed divides by the product.
    Its mean is of len / speed; ours divides the mean way by the mean speed, although
    the slow take longer than that: in the paper's building R_b is 36 points higher.
    """
    lost = paper.loss_per_second()
    return tuple(way / paper.WALKING_SPEED * lost for way in mean_ways(building))


def mean_ways(building: Building) -> tuple[float, ...]:
    """Avg[Min(len_j)] of Eq. 7, metres, lowest floor first [F6].

    From every cell of the floor's rooms to the nearest exit or entrance of stairs down.
    """
    nav = navigation_of(building)
    ways = []
    for floor in range(building.floors):
        nearest = nav.distance_to(*building.ways_out(floor))
        of_floor = nearest.reshape(building.kind.shape)[floor]
        in_rooms = building.kind[floor] == Kind.FLOOR
        ways.append(float(of_floor[in_rooms].mean()))
    return tuple(ways)


def best_reward_carried(losses: Sequence[float], starters: Sequence[float]) -> float:
    """Estimate the best reward if health lost on a floor is not restored [F8].

    Stairs cost nothing here, as in the paper; in a run a storey costs 7.5. Who has no
    health left dies, and leaves no further floor.

    losses: health lost on the way off each floor; starters: people who start there;
    both lowest first. For 25/3 on each of three floors: 14000 when all forty start on
    the third, 10808 when 14, 13 and 13 do on the first to the third, as by default.
    """
    best = 0.0
    for floor, people in enumerate(starters):
        left = paper.HEALTH - np.cumsum(losses[floor::-1])
        end = paper.FIXED_REWARD if left[-1] > 0 else -paper.FIXED_PENALTY
        best += people * float(left.clip(0).sum() + end)
    return best


def critical_points(
    building: Building, scenario: Scenario
) -> tuple[tuple[float, float], tuple[float, float]]:
    """Critical Points 1 and 2, (reward, y) each, of any building [F12, chosen].

    The first is R_w. The second is the best reward with health carried over, for people
    who start as in the scenario. With all forty on the paper's third floor these are
    the paper's points.
    """
    start = starting_world(building, scenario, np.random.default_rng(0))
    worst = worst_reward(sum(start.occupancy))
    best = best_reward_carried(health_losses(building), start.occupancy)
    _, worst_y = paper.WORST_POINT
    _, best_y = paper.BEST_POINT
    return (_rounded(worst), worst_y), (_rounded(best), best_y)


def _rounded(reward: float) -> float:
    """Round to DIGITS significant digits."""
    return float(f"{reward:.{DIGITS - 1}e}")
