"""The state of the world at one instant, and what can happen in it: records.

A human is a body and a mind.  Bodies live in arrays and move all at once; minds are
small objects that think one at a time.

    n   number of people;  R  number of robots
    i   a body: people are 0 .. n-1, robots n .. n+R-1
"""

from dataclasses import dataclass, field
from enum import IntEnum
from typing import NamedTuple

import numpy as np

from reference.building import Building, Graph, without_doors

NOBODY = -1
NOWHERE = -1
FLOOR_APART = 1e4  # metres: floors are set this far apart to measure all at once


class Mode(IntEnum):
    """The two modes of a human [B4]."""

    FOLLOWER = 0
    LEADER = 1


class Fate(IntEnum):
    """What has become of a human."""

    INSIDE = 0
    EVACUATED = 1
    DEAD = 2


class Aim(IntEnum):
    """What kind of thing a human is heading for; which one, a `Goal` tells."""

    NOTHING = 0
    LANDMARK = 1  # a door, entrance or exit; which: the landmark
    DIRECTION = 2  # an unexplored direction; which: its patch, -1: to look again
    LEADER = 3  # a body that leads; which: the body
    THRESHOLD = 4  # past the door just entered; which: the landmark


class Goal(NamedTuple):
    """What a human sets off to: a kind, which one of it, or a place to walk to."""

    aim: Aim
    which: int = -1
    place: int = NOWHERE


STAY = Goal(Aim.NOTHING)


@dataclass
class Bodies:
    """The bodies of n people: arrays (n,), points (n, 2) in metres."""

    position: np.ndarray  # metres
    floor: np.ndarray  # 0 is the first floor
    place: np.ndarray  # the cell a body stands in
    pace: np.ndarray  # walking speed, m/s
    health: np.ndarray  # 100 at the start, dead at 0 [B7]
    fate: np.ndarray  # Fate
    mode: np.ndarray  # Mode, copied from the mind
    landmark: np.ndarray  # headed for by the shortest way; -1: walk to `goal` instead
    goal: np.ndarray  # metres: where that walk ends
    target: np.ndarray  # metres: the next point on that walk, to go straight at
    leader: np.ndarray  # body followed, -1 for nobody
    stairwell: np.ndarray  # the one walked down, -1 when not on stairs
    stairs_until: np.ndarray  # s, when the next storey is reached; inf off the stairs
    rank: np.ndarray  # who leads whom when people meet: the higher rank [B6, chosen]
    headway: np.ndarray  # metres: where the body last made headway [B5]
    headway_time: np.ndarray  # s: when it was there
    reckless_until: np.ndarray  # s: until then the body ignores flames [B5]

    def __len__(self) -> int:
        return len(self.health)

    @property
    def inside(self) -> np.ndarray:
        """(n,) bool: neither out nor dead."""
        return self.fate == Fate.INSIDE.value  # with the enum itself: five times slower

    @property
    def walking(self) -> np.ndarray:
        """(n,) bool: inside and on a floor, not on the stairs."""
        return self.inside & (self.stairwell < 0)


class Passed(NamedTuple):
    """A door passed, and the area from which it was entered."""

    door: int
    side: int


@dataclass(slots=True)
class Mind:
    """What one human remembers; nobody knows the map [B3]."""

    mode: Mode = Mode.FOLLOWER
    leader: int = NOBODY  # body followed
    seen_at: float = 0.0  # s: when the leader was seen last
    seen_place: int = NOWHERE  # and where
    told: int | None = None  # a landmark, or NOWHERE: "follow me"; by a robot alone
    pause_until: float = 0.0  # s: no new human leader before then
    waits_until: float = 0.0  # s: a stuck follower without leader waits till then
    goal: Goal = STAY  # where it has set off to
    doors: set[int] = field(default_factory=set)  # visited on this floor [B6]
    seen_from: dict[int, int] = field(default_factory=dict)  # door -> room, at first
    trail: list[Passed] = field(default_factory=list)  # the way back, newest last
    patches: set[int] = field(default_factory=set)  # of floor explored [B2]
    been: dict[int, None] = field(default_factory=dict)  # places, newest last
    facing: tuple[float, float] = (0.0, 0.0)  # unit vector, to the last goal


@dataclass
class Robot:
    """A rescue robot; it stays on its floor and leads people out [C7].

    It hinders nobody and does not burn [C7, chosen]: people, not robots, are at risk.
    """

    body: int  # its index among all bodies
    floor: int
    number: int  # on its floor, 0 is the first
    position: np.ndarray  # (2,) metres
    place: int  # the cell it stands in
    destination: np.ndarray | None = None  # (2,) metres after Eq. 1; None: not decided
    says: int = NOWHERE  # a landmark: "this exit", "this stairwell"; else "follow me"
    way: list[int] = field(default_factory=list)  # places on the way there
    active: bool = True  # False once its level and all above are empty [C8]


@dataclass
class Flames:
    """The fire; arrays are (floors, rows, cols)."""

    arrival: np.ndarray  # s, when each cell begins to burn; inf: never, so far
    burning: np.ndarray  # bool
    ash: np.ndarray  # bool: burnt out [D7]
    alight: frozenset[int]  # the places that burn
    harm: np.ndarray  # health lost per second there, heat and flames [B7]
    cost: np.ndarray  # metres that a metre there counts as, when a way is planned
    sources: list["FireLit"]  # in order of time


@dataclass
class World:
    """Everything at one instant; only a simulation changes it, and what it calls."""

    building: Building
    time: float  # seconds since the evacuation began
    bodies: Bodies
    minds: list[Mind]
    robots: list[Robot]
    flames: Flames
    burnt: set[int]  # landmarks: the doors that flames have destroyed [A6]

    def __repr__(self) -> str:
        """Say in a line how it stands."""
        return f"<World at {self.time:g} s: {sum(self.occupancy)} people inside>"

    @property
    def graph(self) -> Graph:
        """The building's graph of rooms without the doors that have burnt [A6]."""
        marks = self.building.landmarks
        return without_doors(self.building.graph, [marks[k].id for k in self.burnt])

    @property
    def occupancy(self) -> list[int]:
        """People inside on each floor, those on the stairs included."""
        floors = self.bodies.floor[self.bodies.inside]
        return np.bincount(floors, minlength=self.building.floors).tolist()

    def anybody_at_or_above(self, floor: int) -> bool:
        """Is anybody inside on a floor, or above, to come through it? [C8, chosen]"""
        return any(self.occupancy[floor:])


# -- Events -------------------------------------------------------------------------


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
    """A fire source appeared [D3], at x, y metres."""

    floor: int
    x: float
    y: float


@dataclass(frozen=True)
class FireRefused(Event):
    """A fire source could not appear where it was decided [D6]."""

    floor: int
    x: float
    y: float
