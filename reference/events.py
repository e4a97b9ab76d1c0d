"""What can happen in a run: facts with a time.

Clauses: A4, A6, B7, D3, D6.
"""

from dataclasses import dataclass


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
