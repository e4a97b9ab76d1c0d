"""What happened, and what it is worth to the robots and to the fire.

Clauses: F5, F8, D6, E5.  Events are facts with a time in seconds; rewards are sums over
events, in health points.
"""

from collections.abc import Iterable
from dataclasses import dataclass

from reference.paper import FIRE_REFUSED_PENALTY, FIXED_PENALTY, FIXED_REWARD


@dataclass(frozen=True)
class Event:
    """Something that happened at a time, seconds."""

    time: float


@dataclass(frozen=True)
class LeftFloor(Event):
    """A human left a floor alive: by the stairs, past a landing, or by an exit."""

    person: int
    floor: int
    health: float


@dataclass(frozen=True)
class Evacuated(Event):
    """A human passed an exit and is deregistered [A4]."""

    person: int
    floor: int
    health: float
    landmark: int


@dataclass(frozen=True)
class Died(Event):
    """A human's health reached 0 [B7]."""

    person: int
    floor: int


@dataclass(frozen=True)
class DoorBurnt(Event):
    """Flames touched a regular door and destroyed it [A6]."""

    landmark: int


@dataclass(frozen=True)
class FireLit(Event):
    """A fire source appeared [D3]."""

    floor: int
    x: float
    y: float


@dataclass(frozen=True)
class FireRefused(Event):
    """A fire source could not appear where it was decided [D6]."""

    floor: int
    x: float
    y: float
    reason: str


def group_reward(events: Iterable[Event]) -> float:
    """Reward of the robots as a group [E5] [F8, chosen].

    Whoever leaves a floor alive pays their remaining health, whoever passes the exit
    FixReward more, whoever dies costs Fixed Pen.
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


def fire_reward(events: Iterable[Event]) -> float:
    """Reward of the fire: what the robots lose, less a penalty per refusal [D6]."""
    events = list(events)
    refused = sum(isinstance(event, FireRefused) for event in events)
    return -group_reward(events) - FIRE_REFUSED_PENALTY * refused
