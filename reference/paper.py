"""The numbers of the paper's appendix, and the `Scenario` that varies some of them.

Each has its clause and what it means; where the choice matters, why. Before `Scenario`
stand checks of what callers give: skip them on a first reading.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from inspect import iscoroutinefunction, signature
from math import hypot, sqrt
from numbers import Integral, Real
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

# -- The building (Appendix A) ------------------------------------------------------

FLOORS = 3  # [A1] as drawn in floors/paper.txt, which decides
BODY_SIZE = 40  # [A1] cells on each side of the main body, as drawn there
FLIGHT = 12.0  # [A3, chosen] metres of stairs and landing: a storey of 4 m, 30 degrees
STAIRS_SPEED = 0.8  # [A9, chosen] m/s, mean; IMO MSC.1/Circ.1533: 0.64 to 1.07
LOOK_AHEAD_METRES = 6  # [A7, chosen] the longest line tried to pull a way straight

DOOR_FLOW = 1.3
STAIRS_FLOW = 1.1
"""[A5, deviation] most people per second and metre of width, through doors and exits
and through stairwell entrances. The paper's are without volume; ours hold crowds up on
purpose. The values are maximum specific flows of IMO MSC.1/Circ.1533, made for design:
real narrow exits pass 1.9 to 2.4."""

# -- People (Appendix B and F) ------------------------------------------------------

PEOPLE = 40  # [B8]
HEALTH = 100.0  # [B7] hp, at the start
HEALTH_RATE = 0.01  # [B7] health lost per frame
FRAMES_PER_SECOND = 50  # [F8, chosen] Unity's fixed step of 0.02 s reproduces Eq. 7
FRAMES_PER_TICK = 10  # [F8, chosen] one tick of the simulation: 0.2 s, 0.1 health
MOST_FRAMES_PER_TICK = 25  # [F8, chosen] the fastest walk 0.93 m in it, a wall is 1 m
SIGHT_RANGE = 5.0  # [B2, chosen] metres, in smoke: about as wide as a small office

RAYS = 360
"""[B1, chosen] rays all around a human, one per degree. A door 4 m away, in the wall
beside which one stands, fills 2 degrees: with fewer rays people in corners miss it."""

PATCH_METRES = 4  # [B6, chosen] directions that end in one patch of floor are one
DIM_METRES = 3.0
"""[B2, chosen] what lies so near to the limit of sight is seen, but not well, and does
not count as explored. So people who see farther explore a room sooner."""

NO_HEALTH = 1e-9  # [B7, chosen] less is rounding: 1000 ticks of 0.1 leave 1e-12
WALKING_SPEED = 1.34  # [A9, F8, chosen] m/s, mean free speed: Weidmann (1993)
WALKING_SPREAD = 0.26  # [A9, chosen] m/s, their standard deviation: Weidmann, too
BODY_RADIUS = 0.2  # [A9, chosen] metres: two people can pass each other in a door
DETOUR_SECONDS = 2.0  # [A9, chosen] without headway: then one plans again
STUCK_METRES = 1.0  # [B5, chosen] stuck: moved less than this ...
STUCK_SECONDS = 8.0  # [B5, chosen] ... in this long, though meaning to move
RECKLESS_SECONDS = 4.0  # [B5, chosen] the stuck then ignore flames for this long
STUCK_WAIT_SECONDS = 2.0  # [B5, chosen] a stuck follower waits before Alg. 1:11
MOST_FOLLOWERS = 5  # [B6, chosen] of one human: more would only stand in the way
FOLLOW_DISTANCE = 0.6  # [B5, chosen] metres: followers stop this far from a leader
LEADER_GRACE_SECONDS = 3.0
"""[B5, deviation] a leader out of sight is kept so long: else one who turns a corner
would be lost at every door."""

LEADER_PAUSE_SECONDS = 5.0  # [B5, chosen] from losing one to the next human leader
RECONSIDER_TICKS = 3  # [B4, chosen] a mind thinks at least once in this many ticks
GOAL_HYSTERESIS = 3.0  # [B6, chosen] metres that a new goal must be nearer

# -- How bodies move ----------------------------------------------------------------

SHOULDER_METRES = 0.25  # [A9, chosen] people who meet turn sideways, as deep as that
NEIGHBOUR_METRES = 1.6  # [A9, chosen] neighbours farther away are ignored
GAP_SECONDS = 0.6  # [A9, chosen] the model's time gap T: v = s / T
PUSH_STRENGTH = 1.5  # [A9, chosen] of the repulsion between neighbours ...
PUSH_RANGE = 0.2  # [A9, chosen] ... which falls with the gap, metres
ASIDE_METRES = 0.3  # [A9, chosen] people aim right of their target: two streams pass
FAR_METRES = 1.0  # [A9, chosen] nearer targets are walked at straight
TOWARDS = 0.5  # [A9, chosen] cosine, 60 degrees: who walks at somebody
KEEP_RIGHT = 0.6  # [A9, chosen] sideways pull while somebody comes towards me
ARRIVED_METRES = 0.05  # [A9, chosen] whoever is this near their target is there
IDLE_SPEED = 0.05  # [A9, chosen] m/s: bodies that mean to walk more slowly stand ...
GIVE_WAY_SPEED = 0.6  # [A9, chosen] m/s: ... and step aside for who walks at them
PUSH_ROUNDS = 3  # [A9, chosen] rounds in which a crowd passes pushes on
HELD_UP_SPEED = 0.1  # [A9, chosen] m/s: a body that advances more slowly is held up ...
SHUFFLE_SPEED = 0.3  # [A9, chosen] m/s: ... and tries a step at this speed ...
SHUFFLE_TURN = 0.61
"""[A9, chosen] ... turned by at most 2.2 radians, of a quarter of which this is the
tangent: a little backwards too, since arches of people before a door dissolve only if
somebody makes room ..."""

SHUFFLE_RIGHT = 0.55
"""[A9, chosen] ... and to the right by 1 radian, of half of which this is the tangent,
if somebody comes towards them: two crowds that meet sort themselves into lanes."""

# -- Robots (Appendix C) ------------------------------------------------------------

ROBOTS_PER_FLOOR = 2  # [C2, chosen] one for each stairwell: 6 robots in all
ROBOT_SPEED = 1.5  # [C7, chosen] metres per second: a little faster than people
NEAR_STAIRWELL = 6.0  # [C6, chosen] metres from its centre: "near" in Eq. 1
DECISION_SECONDS = 5.0  # [C7, chosen] between two decisions of a robot
AT_EXIT_METRES = 2.5  # [C6, C7, chosen] metres: a destination so near is at an exit
DOORWAY_METRES = 2.0
"""[C7, chosen] on foot: a robot this near a door, entrance or exit does not wait, since
its followers would stand in the doorway and on both sides."""

FOLLOWER_GAP = 1.2
CROWD_GAP = 0.4
"""[C7, chosen] metres: a robot waits while its n followers are on average farther
away than FOLLOWER_GAP + CROWD_GAP * sqrt(n); a root, because a crowd is a disc."""

SMALLEST_GRID = 20  # [C3, chosen] cells: fewer are too small for the convolutions
ABSENT_POINT = (0.0, 0.0, -1.0)
"""[C1, chosen] the point of people out or dead, robots whose work is done and fires not
yet lit: the middle, one storey below the ground, where nothing else can be."""

# -- The fire (Appendix D) ----------------------------------------------------------

FIRE_SOURCES = 8  # [C2, chosen] F = 14 - R
FIRE_FIRST_DECISION = 2  # [D2, chosen] the first source appears at 10 s ...
FIRE_EVERY_DECISIONS = 5  # [D2, chosen] ... 25 s apart: 8 last as long as health
FIRE_REFUSED_PENALTY = 10.0  # [D6, chosen] "a certain reward" deducted, health points
PROTECTED_METRES = 4.0
"""[D7, chosen] nothing burns this near, on foot, to exits and stairwell entrances:
building codes keep ways out free of fuel. A source there is refused, although nothing
stands there [D6, deviation]. The clearance delays the harm of two fires beside two
exits, until flames have walked round it; it does not prevent it."""

SPREAD_RATE = 0.06  # [D7, chosen] ignitions per second and border between two cells
BURN_SECONDS = 40.0
"""[D7, chosen] how long a cell burns. Then it is ash: dark, passable, without heat, and
never lit again. One border in eleven has a longer delay and carries no flames, so a
fire may die out. If flames never ended, two fires at two exits would decide all."""

FLAME_SECONDS = 1.0  # [D7, chosen] flames spread, and new ones appear, this often
BURN_LOSS = 10.0  # [B7, chosen] health lost per second inside flames
HEAT_LOSS = 2.0  # [B7, chosen] health lost per second beside flames
BURN_COST = 50.0
HEAT_COST = 4.0
"""[C7, chosen] what a metre in flames, or beside them, costs when a way is planned, in
metres: robots do not burn, but the people they lead do."""

# -- Rewards and evaluation (Appendix F) --------------------------------------------

ALPHA = 1000.0  # [F1] scaling coefficient
WORST_POINT = (-12000.0, 0.1)  # [F2] Critical Point 1: (R1, y1)
BEST_POINT = (14000.0, 1000.0)  # [F2] Critical Point 2: (R2, y2)
FIXED_PENALTY = 300.0  # [F5] 12000 / 40 humans
FIXED_REWARD = 100.0  # [F8, chosen] the FixReward that reproduces R_b
K = 0.009  # [F9] proportionality of the two parts of E
BETA = 1649.7  # [F9] the baseline's e', at which E = 1

# -- What follows from the numbers --------------------------------------------------


def stairs_seconds() -> float:
    """Seconds that a mean walker takes for one storey; Eq. 7 counts none [A9] [F8]."""
    return FLIGHT / STAIRS_SPEED


def stairs_metres() -> float:
    """Metres that one storey adds to a way: as far as one walks meanwhile [A9]."""
    return stairs_seconds() * WALKING_SPEED


def loss_per_second() -> float:
    """Health lost per second by who is inside: rate and framesp of Eq. 7 [F7]."""
    return HEALTH_RATE * FRAMES_PER_SECOND


def health_seconds() -> float:
    """Seconds until everybody who is inside is dead [B7]: 200."""
    return HEALTH / loss_per_second()


def body_diameter() -> float:
    """Metres that the middles of two bodies keep apart [A9]."""
    return 2 * BODY_RADIUS


# -- Learning (Tables I and II) -----------------------------------------------------

TABLE_I = MappingProxyType(  # [E1, Tab. I] [E4] [E5] evacuation robot agent group
    {
        "trainer_type": "poca",
        "batch_size": 1024,
        "buffer_size": 20480,
        "learning_rate": 0.0001,
        "learning_rate_schedule": "linear",
        "beta": 0.005,
        "beta_schedule": "constant",
        "epsilon": 0.2,
        "epsilon_schedule": "linear",
        "lambd": 0.95,
        "num_epoch": 3,
        "vis_encode_type": "simple",
        "normalize": True,
        "hidden_units": 256,
        "num_layers": 3,
        "gamma": 0.90,
        "strength": 1.0,
        "keep_checkpoints": 100,
        "checkpoint_interval": 1000,
        "max_steps": 10_000_000,
        "time_horizon": 64,
        "summary_freq": 1000,
    }
)
TABLE_II: MappingProxyType[str, Any] = MappingProxyType(  # [E2, Tab. II] the fire
    {
        **TABLE_I,
        "trainer_type": "ppo",
        "buffer_size": 10240,
        "learning_rate": 0.0003,
        "normalize": False,
        "gamma": 0.99,
        "keep_checkpoints": 80,
        "checkpoint_interval": 500,
        "max_steps": 500_000,
        "summary_freq": 500,
    }
)


class InputError(ValueError):
    """Raised for input that cannot be used; its message is meant for people."""


MOST = 10_000  # people, robots of a floor, sources, metres of sight
MOST_SIGHT_BYTES = 2e9  # [B1, chosen] a byte for each pair of places in sight
LONGEST = 1_000_000  # seconds, eleven days, or metres: longer than anything here


# -- One experiment -----------------------------------------------------------------


class Limits(NamedTuple):
    """From where to where a number of a scenario goes, and what it counts."""

    low: float
    high: float
    unit: str


def limits() -> dict[str, Limits]:
    """Tell the limits of a scenario's numbers, by name."""
    return {
        "people": Limits(0, MOST, "people"),
        "robots_per_floor": Limits(0, MOST, "robots"),
        "sources": Limits(0, MOST, "fires at most"),
        "time_limit": Limits(0.1, LONGEST, "seconds"),
        "sight_range": Limits(1, MOST, "metres in smoke"),
        "spread_rate": Limits(0.001, 100, "ignitions per second and border of cells"),
        "burn_seconds": Limits(1, LONGEST, "seconds in flames"),
        "frames_per_tick": Limits(1, MOST_FRAMES_PER_TICK, "frames of 1/50 s"),
        "decision_seconds": Limits(0.02, LONGEST, "seconds between decisions"),
    }


class Expected(NamedTuple):
    """What an object is known by, and an example of one."""

    attribute: str
    example: str


OBJECTS = {
    "building": Expected("landmarks", "load({!r:.60})"),
    "scenario": Expected("start_counts", "Scenario(people=12)"),
    "robots": Expected("decide", "Sweep() of reference.workshop.strategies.guides"),
    "fire": Expected("decide", "RandomFire() of reference.fire"),
    "world": Expected("bodies", "the `world` of a simulation"),
}
DECIDES = {"robots": ("world", "robots", "rng"), "fire": ("world", "rng")}
"""What each side is given to decide."""


def check_objects(
    building: Any, scenario: Any, robots: Any, fire: Any, world: Any = None
) -> None:
    """Raise InputError where an argument is not what its name says.

    Only the building is required. A world must be of this building, and a strategy
    must decide what its side is asked.
    """
    given = (building, scenario, robots, fire, world)
    for (name, expected), value in zip(OBJECTS.items(), given, strict=True):
        if isinstance(value, type):
            how = f"{value.__name__}()"
            raise InputError(f"{name} is the class: give an object, {how}")
        if value is None and name != "building":
            continue
        if not hasattr(value, expected.attribute):
            how = expected.example.format(value if isinstance(value, str) else "paper")
            raise InputError(f"{name} is {value!r:.60}: give an object, such as {how}")
        if name in DECIDES:
            check_player(value, name)
    if world is not None and world.building.drawing != building.drawing:
        raise InputError(
            f"the world is of {world.building.title!r}, the building is "
            f"{building.title!r}: give the world's own `building`"
        )
    _check_fit(building, scenario or Scenario(), world)


def _check_fit(building: Any, scenario: "Scenario", world: Any) -> None:
    """Raise InputError for a sight too far here, or a world between two ticks."""
    diagonal = hypot(*building.kind.shape[1:])  # nobody sees farther
    # around each place as many bytes as cells, (2 most + 1)²
    most = (sqrt(MOST_SIGHT_BYTES / building.kind.size) - 1) / 2
    if min(scenario.sight_range, diagonal) > most:
        raise InputError(
            f"sight_range is {scenario.sight_range:g}: in a building as large as "
            f"{building.title!r} it must be at most {int(most)} metres, since what is "
            "seen from where is kept in memory"
        )
    ticks = 0.0 if world is None else world.time / scenario.tick
    if abs(ticks - round(ticks)) > 1e-6:
        raise InputError(
            f"the world is at {world.time:g} s, between two ticks of "
            f"{scenario.tick:g} s: go on with ticks that end there"
        )


def check_player(player: Any, side: str, where: str = "") -> None:
    """Raise InputError for who has no `decide` that takes what its side is given.

    where: begins the message
    """
    given = DECIDES[side]
    needs = f"{where}who plays the {side} has decide(self, {', '.join(given)})"
    try:
        signature(player.decide).bind(*given)
    except (AttributeError, TypeError, ValueError):  # the last of a built-in
        raise InputError(f"{needs}.") from None
    if iscoroutinefunction(player.decide):
        raise InputError(f"{needs}: nobody awaits it, so write no `async`.")


def check_seed(seed: Any) -> None:
    """Raise InputError for what is no whole number of 0 or more."""
    if isinstance(seed, bool) or not isinstance(seed, Integral) or seed < 0:
        raise InputError(f"seed is {seed!r:.60}: it must be a whole number, 0 or more")


def are_numbers(value: Any, count: int) -> bool:
    """Is it `count` numbers, none masked, each below LONGEST in size?"""
    try:
        numbers = np.asarray(value)
    except ValueError:
        return False
    if numbers.shape != (count,) or numbers.dtype.kind not in "biuf":
        return False
    small = abs(numbers.astype(float)) < LONGEST
    return bool(small.all()) and not np.ma.is_masked(value)


def check_action(agent: str, actions: Any, size: int, keep: bool) -> np.ndarray:
    """Read an agent's action: (size,) numbers; all nan only where that means to keep.

    Raises InputError, which names the agent.
    """
    if not isinstance(actions, Mapping):
        raise InputError(
            f"actions are a {type(actions).__name__}: give a dict with an action "
            "for each of `agents`"
        )
    if agent not in actions:
        raise InputError(f"{agent} is still there, but has no action")
    action = actions[agent]
    wanted = f"{agent}: an action is {size} numbers from -1 to 1"
    try:
        if np.iscomplexobj(action) or np.ma.is_masked(action):
            raise TypeError
        numbers = np.asarray(action, dtype=np.float64)
    except (TypeError, ValueError):
        raise InputError(f"{wanted}, not {action!r:.60}") from None
    kept = keep and np.isnan(numbers).all()
    if numbers.shape != (size,) or not (kept or np.isfinite(numbers).all()):
        raise InputError(f"{wanted}, not {numbers.tolist()!s:.60}")
    return numbers


def check_number(name: str, value: Any, limit: Limits, whole: bool) -> None:
    """Raise InputError unless a value is a number within limits.

    name: of the value;  whole: it must be a whole number
    """
    number = isinstance(value, Integral if whole else Real)
    if isinstance(value, bool) or not number or not limit.low <= value <= limit.high:
        kind = "whole number" if whole else "number"
        raise InputError(
            f"{name} is {value!r:.60}: it must be a {kind} from {limit.low:,} to "
            f"{limit.high:,} {limit.unit}"
        )


def current(number: Callable[[], float]) -> Any:
    """Make a field whose default is read when a scenario is made, not before."""
    return field(default_factory=number)


@dataclass(frozen=True)
class Scenario:
    """What is varied from one experiment to the next; the defaults are the paper's.

    Who guides and who sets fires are arguments of `Simulation`, not of this. After
    200 s nobody has health left [F8, chosen]; the time limit comes later. The numbers
    above are read when a scenario is made, not when this class is.
    """

    people: int = current(lambda: PEOPLE)  # [B8] spread over the floors [F8, chosen]
    people_per_floor: tuple[int, ...] | None = None  # `people` is not read then
    rooms: tuple[str, ...] = ()  # ids of rooms to start in ("1/hall"); empty: anywhere
    robots_per_floor: int = current(lambda: ROBOTS_PER_FLOOR)  # [C2]
    sources: int = current(lambda: FIRE_SOURCES)  # fires at most [C2]
    training: bool = False  # rule D6: no fire on an occupied place (else on another)
    time_limit: float = 240.0  # s; people inside then are neither saved nor dead
    sight_range: float = current(lambda: SIGHT_RANGE)  # metres, in smoke [B2]
    spread_rate: float = current(lambda: SPREAD_RATE)  # of flames, to a next cell [D7]
    burn_seconds: float = current(lambda: BURN_SECONDS)  # of flames in a cell [D7]
    frames_per_tick: int = current(lambda: FRAMES_PER_TICK)  # of 1/50 s [F8]
    # of robots, rounded to ticks; the fire decides at every fifth [D2]
    decision_seconds: float = current(lambda: DECISION_SECONDS)

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if hasattr(value, "tolist"):  # numpy's; its small integers overflow
                object.__setattr__(self, name, value.tolist())
        self._check_numbers()
        self._check_lists()
        object.__setattr__(self, "rooms", tuple(self.rooms))
        if self.people_per_floor is not None:
            counts = tuple(map(int, self.people_per_floor))
            object.__setattr__(self, "people_per_floor", counts)
        self._check_counts()
        self._round_to_ticks()
        self._check_steps()

    def _check_numbers(self) -> None:
        limit_of = limits()
        for row in fields(self):
            if row.name in limit_of:
                value = getattr(self, row.name)
                check_number(row.name, value, limit_of[row.name], row.type is int)
        if not isinstance(self.training, bool):
            raise InputError(f"training is {self.training!r:.60}: give True or False")

    def _check_lists(self) -> None:
        for name in ("rooms", "people_per_floor"):
            value = getattr(self, name)
            missing = value is None and name == "people_per_floor"
            if isinstance(value, str) or not (missing or isinstance(value, Sequence)):
                word = f"{value!r:.60}"
                inside = "" if value is None else word
                raise InputError(f"{name} is {word}: give a list, [{inside}]")
        for room in self.rooms:
            if not isinstance(room, str):
                raise InputError(
                    f"one of rooms is {room!r:.60}: it must be an id, such as '1/hall'"
                )
        for count in self.people_per_floor or ():
            check_number("one of people_per_floor", count, limits()["people"], True)

    def _check_counts(self) -> None:
        if self.rooms and self.people_per_floor is not None:
            raise InputError("people start in rooms or per floor, not both")
        if self.people_per_floor is not None:
            count = sum(self.people_per_floor)
            if self.people not in (PEOPLE, count):  # the default was not asked for
                raise InputError(
                    f"people is {self.people}, people_per_floor comes to {count}: "
                    "leave one out"
                )

    def _round_to_ticks(self) -> None:
        if self.decision_seconds < self.tick:
            raise InputError(
                f"decision_seconds is {self.decision_seconds:g}: it must be a tick or "
                f"more, {self.tick:g} seconds"
            )
        ticks = round(self.decision_seconds / self.tick)
        object.__setattr__(self, "decision_seconds", ticks * self.tick)

    def _check_steps(self) -> None:
        fastest = WALKING_SPEED + 2 * WALKING_SPREAD
        if fastest * self.tick >= 1:  # a cell
            raise InputError(
                f"people walk at up to {fastest:g} m/s, a metre or more in a tick of "
                f"{self.tick:g} s, and would pass through walls: lower WALKING_SPEED "
                "or WALKING_SPREAD of reference/paper.py, or take fewer frames_per_tick"
            )

    @property
    def tick(self) -> float:
        """Seconds of one tick."""
        return self.frames_per_tick / FRAMES_PER_SECOND

    def start_counts(self, floors: int) -> tuple[int, ...]:
        """How many people start on each floor of a building, lowest first."""
        counts = self.people_per_floor
        if counts is None:
            share, rest = divmod(self.people, floors)
            return tuple(share + (floor < rest) for floor in range(floors))
        if len(counts) != floors:
            raise InputError(
                f"floors of people_per_floor: {len(counts)}, of the building: {floors}"
            )
        return counts
