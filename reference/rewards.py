"""Rewards of the robots and of the fire: sums over events, in health points.

Clauses: B7, D2, D6, E5, F5, F8.
"""

from collections.abc import Iterable, Sequence

from reference.paper import FIRE_REFUSED_PENALTY, FIXED_PENALTY, FIXED_REWARD
from reference.world import Died, Evacuated, Event, FireRefused, LeftFloor

CREDITS = "group", "floor"
"""What a robot is paid: the group's reward, as in the paper, or its part of that."""


def group_reward(events: Iterable[Event]) -> float:
    """Reward of the robots as a group [E5] [F8, chosen].

    Each human who leaves a floor alive adds their remaining health, each who passes an
    exit FixReward more; each who dies costs Fixed Pen.
    """
    reward = 0.0
    for event in events:
        match event:
            case LeftFloor():
                reward += event.health
            case Evacuated():
                reward += FIXED_REWARD
            case Died():
                reward -= FIXED_PENALTY
    return reward


def robot_reward(
    events: Iterable[Event], credit: str, floor: int, began: Sequence[int]
) -> float:
    """Reward of a robot of this floor; began: each human's first floor [E5].

    [E5, chosen] `floor`, a remedy: the part of the group's reward that it can touch.
    Nobody walks up, so that is what happens on its floor or below to those who began on
    its floor or above.
    """
    if credit == "floor":
        events = (e for e in events if _touches(floor, e, began))
    return group_reward(events)


def _touches(floor: int, event: Event, began: Sequence[int]) -> bool:
    if not isinstance(event, LeftFloor | Evacuated | Died):
        return False
    return event.floor <= floor <= began[event.person]


def fire_reward(events: Iterable[Event]) -> float:
    """Minus the group's reward [D2, chosen], less a penalty per refusal [D6]."""
    events = list(events)
    refused = sum(isinstance(event, FireRefused) for event in events)
    return -group_reward(events) - FIRE_REFUSED_PENALTY * refused
