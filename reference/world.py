"""What exists at one instant: records, no behaviour.

Clauses: A6, B4, B7, C5, C7, D3.  A human is a body and a mind.  Bodies live in arrays
and move all at once; minds are small objects that think one at a time.

    n   number of people;  R  number of robots
    i   a body: people are 0 .. n-1, robots n .. n+R-1
"""

from collections import deque
from dataclasses import dataclass, field, fields, replace
from enum import IntEnum
from typing import Any, NamedTuple

import numpy as np

from reference.building import Building, Graph

NOBODY = -1
NOWHERE = -1


class Mode(IntEnum):
    """The two modes of a human [B4]."""

    FOLLOWER = 0
    LEADER = 1


class Fate(IntEnum):
    """What has become of a human."""

    INSIDE = 0
    EVACUATED = 1
    DEAD = 2


INSIDE = int(Fate.INSIDE)  # looked up many times a tick


class Aim(IntEnum):
    """What a human is heading for."""

    NOTHING = 0
    LANDMARK = 1  # a door, entrance or exit; which: the landmark
    DIRECTION = 2  # an unexplored direction; which: its patch
    LEADER = 3  # a body that leads; which: the body
    THRESHOLD = 4  # past the door just entered; which: the landmark


class Goal(NamedTuple):
    """Where a human sets off to: which one, as told in `Aim`, or a place to walk at."""

    aim: Aim
    which: int = -1
    place: int = NOWHERE


STAY = Goal(Aim.NOTHING)


class Instruction(IntEnum):
    """What a robot tells people who follow it [C7]."""

    FOLLOW_ME = 0
    THIS_STAIRWELL = 1
    THIS_EXIT = 2


def _copied(record: Any) -> Any:
    """A record with arrays and lists of its own."""
    return replace(
        record, **{f.name: getattr(record, f.name).copy() for f in fields(record)}
    )


@dataclass
class Bodies:
    """The bodies of n people.

    position      (n, 2) metres
    floor         (n,) 0 is the first floor
    place         (n,) the cell a body stands in
    pace          (n,) walking speed, m/s
    health        (n,) 100 at the start, dead at 0 [B7]
    fate          (n,) Fate
    mode          (n,) Mode, as the mind has it
    landmark      (n,) landmark headed for, -1: walk straight at `target`
    target        (n, 2) metres
    leader        (n,) body followed, -1 for nobody
    stairwell     (n,) the one walked down, -1 when not on stairs
    stairs_until  (n,) seconds, when the next storey is reached; inf off the stairs
    anchor        (n, 2) metres, and anchor_time (n,) s: last place and time that the
                  body got ahead [B5]
    reckless      (n,) s: until then the body ignores flames [B5]
    """

    position: np.ndarray
    floor: np.ndarray
    place: np.ndarray
    pace: np.ndarray
    health: np.ndarray
    fate: np.ndarray
    mode: np.ndarray
    landmark: np.ndarray
    target: np.ndarray
    leader: np.ndarray
    stairwell: np.ndarray
    stairs_until: np.ndarray
    anchor: np.ndarray
    anchor_time: np.ndarray
    reckless: np.ndarray

    copy = _copied

    def __len__(self) -> int:
        return len(self.health)

    @property
    def inside(self) -> np.ndarray:
        """(n,) bool: neither out nor dead."""
        return self.fate == INSIDE

    @property
    def walking(self) -> np.ndarray:
        """(n,) bool: inside and on a floor, not on the stairs."""
        return (self.fate == INSIDE) & (self.stairwell < 0)


@dataclass(slots=True)
class Mind:
    """What one human remembers; nobody knows the map [B3].

    person       index of the body
    rank         who leads whom when people meet: the higher rank
    mode         leader or follower
    leader       body followed, or NOBODY; last seen at `seen_at` s in `seen_place`
    pause_until  s: no new leader before then
    waits_until  s: a stuck follower without leader waits till then
    goal         where it has set off to
    doors        landmarks passed lately [B6]
    trail        doors to walk back through, the last one last
    patches      patches of floor seen or tried: directions no longer unexplored [B2]
    facing       unit vector of the last direction walked
    """

    person: int
    rank: float
    doors: deque[int]
    mode: Mode = Mode.LEADER
    leader: int = NOBODY
    seen_at: float = 0.0
    seen_place: int = NOWHERE
    pause_until: float = 0.0
    waits_until: float = 0.0
    goal: Goal = STAY
    trail: list[int] = field(default_factory=list)
    patches: set[int] = field(default_factory=set)
    facing: tuple[float, float] = (0.0, 0.0)

    def copy(self) -> "Mind":
        """A mind of its own with the same memories."""
        return replace(
            self,
            doors=self.doors.copy(),
            trail=self.trail.copy(),
            patches=self.patches.copy(),
        )


@dataclass
class Robot:
    """A rescue robot; it stays on its floor, hinders nobody and does not burn [C5].

    body         its index among all bodies
    team         its number on its floor, 0 is the first
    position     (2,) metres;  place  the cell it stands in
    destination  (2,) metres after Eq. 1, None before the first decision
    instruction  what it tells people in sight
    way          places on the way to its destination
    active       False once its level and all above are empty [C8]
    """

    body: int
    floor: int
    team: int
    position: np.ndarray
    place: int
    destination: np.ndarray | None = None
    instruction: Instruction = Instruction.FOLLOW_ME
    way: list[int] = field(default_factory=list)
    active: bool = True

    def copy(self) -> "Robot":
        """A robot of its own; arrays are replaced, never written to."""
        return replace(self, way=self.way.copy())


class Source(NamedTuple):
    """A fire source: where (metres) and since when (s)."""

    floor: int
    x: float
    y: float
    time: float


@dataclass
class Flames:
    """The fire; arrays are (floors, rows, cols).

    arrival  seconds, when each cell begins to burn (inf: never, as far as now known)
    burning  bool
    harm     health lost per second there, heat and flames [B7]
    cost     metres that a metre there counts as, when a way is planned
    sources  in order of time
    """

    arrival: np.ndarray
    burning: np.ndarray
    harm: np.ndarray
    cost: np.ndarray
    sources: list[Source]

    copy = _copied


@dataclass
class World:
    """Everything at one instant; only the simulation writes to it.

    time       seconds since the evacuation began
    occupancy  people inside on each floor, those on the stairs included
    burnt      (landmarks,) bool: doors that flames have destroyed [A6]
    """

    building: Building
    time: float
    occupancy: list[int]
    bodies: Bodies
    minds: list[Mind]
    robots: list[Robot]
    flames: Flames
    burnt: np.ndarray

    def copy(self) -> "World":
        """A world that can run on without touching this one."""
        return replace(
            self,
            occupancy=self.occupancy.copy(),
            bodies=self.bodies.copy(),
            minds=[m.copy() for m in self.minds],
            robots=[r.copy() for r in self.robots],
            flames=self.flames.copy(),
            burnt=self.burnt.copy(),
        )

    @property
    def graph(self) -> Graph:
        """The building's graph of rooms without the doors that have burnt [A6]."""
        return self.building.graph_without(self.burnt)

    def people_at_or_above(self, floor: int) -> int:
        """How many people inside are on a floor or still come through it [C8]."""
        return sum(self.occupancy[floor:])
