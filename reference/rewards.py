"""Rewards of the robots and of the fire: sums over events, in health points."""

from collections.abc import Iterable

from reference import paper
from reference.world import Died, Evacuated, Event, FireRefused, LeftFloor


def group_reward(events: Iterable[Event]) -> float:
    """Reward of the robots as a group [E5] [F8, chosen].

    Each human who leaves a floor alive adds their remaining health, each who passes an
    exit FixReward more; each who dies costs Fixed Pen [F5].
    """
    reward = 0.0
    for event in events:
        match event:
            case LeftFloor():
                reward += event.health
            case Evacuated():
                reward += paper.FIXED_REWARD
            case Died():
                reward -= paper.FIXED_PENALTY
    return reward


def fire_reward(events: Iterable[Event]) -> float:
    """Minus the group's reward, less a penalty per refusal [D6].

    What one side gains the other loses, but for refusals [D2, chosen].
    """
    events = list(events)
    refused = sum(isinstance(event, FireRefused) for event in events)
    return -group_reward(events) - paper.FIRE_REFUSED_PENALTY * refused
