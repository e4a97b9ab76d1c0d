"""A `Simulation` as arrays of records and back, field by field in the order of `world`.

Bodies are shared: the book's arrays become columns of the engine's records. Minds are
copied back when somebody asks for them.

    n  people;  L  landmarks;  S  places of a floor
"""

from collections import UserList
from collections.abc import Sequence
from copy import deepcopy
from dataclasses import fields
from math import isfinite
from operator import itemgetter
from sys import getrefcount
from typing import Any, NamedTuple, cast, get_type_hints
from weakref import ref

import numpy as np

from reference import paper
from reference.fire import NoFire
from reference.simulation import Simulation
from reference.workshop.engine.tables import Tables, record_kind, tables_of
from reference.world import (
    NOWHERE,
    Aim,
    Bodies,
    Died,
    DoorBurnt,
    Evacuated,
    Goal,
    LeftFloor,
    Mind,
    Mode,
    Passed,
)

BEEN = 64  # places that one remembers for which there is room at first
TRAIL = 16  # doors of a way back for which there is room at first
ROOM_IN_FRONT = 4  # of a way: a robot that would cut a corner puts a place there
NOT_TOLD = -2
LEFT_FLOOR, EVACUATED, DIED, DOOR_BURNT = range(4)

# what others see of a body comes first: a body is three lines of the processor's cache
BODY = record_kind(
    x="f8", y="f8", place="i8", floor="i8", rank="f8", leader="i8", landmark="i8",
    fate="i1", mode="i1", stairwell="i8", health="f8", pace="f8", headway_time="f8",
    stairs_until="f8", reckless_until="f8", headway_x="f8", headway_y="f8", goal_x="f8",
    goal_y="f8", target_x="f8", target_y="f8",
)  # fmt: skip
COLUMNS = tuple(part.name for part in fields(Bodies))
POINTS = {
    "position": "x",
    "target": "target_x",
    "goal": "goal_x",
    "headway": "headway_x",
}


class MindRecord(NamedTuple):
    """A mind without its memory, as a record; been and trail: how many there are."""

    mode: int
    leader: int
    seen_at: float
    seen_place: int
    told: int
    pause_until: float
    waits_until: float
    aim: int
    which: int
    place: int
    facing_x: float
    facing_y: float
    been: int
    trail: int


OF_KIND = {int: "i8", float: "f8"}
MIND = record_kind(
    **{name: OF_KIND[kind] for name, kind in get_type_hints(MindRecord).items()}
)
ROBOT = record_kind(
    x="f8", y="f8", place="i8", body="i8", floor="i8", says="i8", at="i8", end="i8",
    active="i8", to_x="f8", to_y="f8", decided="i8",
)  # fmt: skip
CLOCK = record_kind(
    time="f8", person_seconds="f8", flames_change="f8", ticks="i8", left="i8",
    phase="i8", events="i8", thinking="i8", walked="i8", alight="i8", sources="i8",
    touched="i8", fire="i8", flames_moved="i8",
)  # fmt: skip
EVENT = record_kind(
    time="f8", health="f8", kind="i8", person="i8", floor="i8", mark="i8"
)
VIEW = record_kind(
    time="f8", rank="f8", headway_time="f8", row="i8", place="i8", patch="i8",
    room="i8", here="i8", here_burnt="i8", seen="i8", robot="i8", alight="i8",
    hits="i8", hits_end="i8", opens="i8", opens_end="i8", holes="i8", holes_end="i8",
    looked="i8", looked_end="i8",
)  # fmt: skip
SPOT = record_kind(x="f8", y="f8", cell="i8", later="i8")
GRID = record_kind(wide="f8", across="i8", down="i8")
SIGHTED = record_kind(
    metres="f8", rank="f8", j="i8", place="i8", told="i8", leader="i8", landmark="i8"
)
WALKER = record_kind(
    i="i8", floor="i8", inside="i8", fearless="i8", x="f8", y="f8", pace="f8",
    to_x="f8", to_y="f8", e_x="f8", e_y="f8", far="f8", v="f8", turned_x="f8",
    turned_y="f8", sum_x="f8", sum_y="f8", walked_x="f8", walked_y="f8", moved_x="f8",
    moved_y="f8", tried_x="f8", tried_y="f8", on_x="f8", on_y="f8", right="f8",
    standing="i8", held="i8", meets="i8", back="i8", cell="i8", later="i8",
)  # fmt: skip
PAIR = record_kind(
    i="i8", j="i8", to_x="f8", to_y="f8", apart="f8", room="f8", facing="i8",
    i_yields="i8", push_i="f8", push_j="f8",
)  # fmt: skip
TOUCH = record_kind(i="i8", before="i8")

# numbers of `paper`, and others that may change from call to call
OF_PAPER = (
    "FLIGHT",
    "DOOR_FLOW",
    "STAIRS_FLOW",
    "HEALTH_RATE",
    "NO_HEALTH",
    "BODY_RADIUS",
    "DETOUR_SECONDS",
    "STUCK_METRES",
    "STUCK_SECONDS",
    "RECKLESS_SECONDS",
    "STUCK_WAIT_SECONDS",
    "MOST_FOLLOWERS",
    "FOLLOW_DISTANCE",
    "LEADER_GRACE_SECONDS",
    "LEADER_PAUSE_SECONDS",
    "RECONSIDER_TICKS",
    "GOAL_HYSTERESIS",
    "SHOULDER_METRES",
    "NEIGHBOUR_METRES",
    "GAP_SECONDS",
    "PUSH_STRENGTH",
    "PUSH_RANGE",
    "ASIDE_METRES",
    "FAR_METRES",
    "TOWARDS",
    "KEEP_RIGHT",
    "ARRIVED_METRES",
    "IDLE_SPEED",
    "GIVE_WAY_SPEED",
    "PUSH_ROUNDS",
    "HELD_UP_SPEED",
    "SHUFFLE_SPEED",
    "SHUFFLE_TURN",
    "SHUFFLE_RIGHT",
    "ROBOT_SPEED",
    "DOORWAY_METRES",
    "FOLLOWER_GAP",
    "CROWD_GAP",
    "BURN_LOSS",
    "BURN_COST",
    "HEAT_LOSS",
    "HEAT_COST",
)
OF_RUN = (
    "body_diameter", "stairs_metres", "health_rate", "tick", "time_limit", "reach",
    "burn_seconds", "decision_ticks", "flame_ticks", "most_sources", "fire_first",
    "fire_every",
)  # fmt: skip
SIZES = (
    "people", "floors", "rows", "cols", "floor_size", "places", "top", "left", "half",
    "side", "clear_reach", "clear_side", "landmarks",
)  # fmt: skip


class MemoryLayout(NamedTuple):
    """Where the parts of a memory are in its row, after `doors`, which come first."""

    seen_from: int  # the columns where parts begin
    patches: int
    been: int
    trail: int
    most_been: int  # places for which there is room
    most_trail: int  # doors of a way back for which there is room

    @property
    def begins(self) -> tuple[int, ...]:
        """The columns where parts begin."""
        return self.seen_from, self.patches, self.been, self.trail


WHOLE = {
    "MOST_FOLLOWERS", "RECONSIDER_TICKS", "PUSH_ROUNDS", "decision_ticks",
    "flame_ticks", "most_sources", "fire_first", "fire_every", *SIZES,
    *MemoryLayout._fields,
}  # fmt: skip
NAMES = (*OF_PAPER, *OF_RUN, *SIZES, *MemoryLayout._fields)
NUMBERS = record_kind(**{name: "i8" if name in WHOLE else "f8" for name in NAMES})
from_paper = itemgetter(*OF_PAPER)
MADE_FROM = ("STAIRS_SPEED", "FIRE_EVERY_DECISIONS")  # numbers of runs, further on
DIVIDE = ("DOOR_FLOW", "STAIRS_FLOW", "STAIRS_SPEED", "BURN_COST", "HEAT_COST")
"""Where 0 is an error in the book, or a way that costs nothing."""


def odd_number() -> str:
    """Name a number of `paper` that compiled code would take otherwise, or ""."""
    for name in (*OF_PAPER, *MADE_FROM):
        value: Any = getattr(paper, name, None)
        counts = name in WHOLE or name == "FIRE_EVERY_DECISIONS"
        usual = type(value) is int or (type(value) is float and not counts)
        if not usual or not isfinite(value):
            return name
        if (name in DIVIDE and value <= 0) or (counts and value < 1):
            return name
    return ""


class State(NamedTuple):
    """One simulation as compiled functions take it."""

    clock: np.ndarray  # (1,) CLOCK
    bodies: np.ndarray  # (n,) BODY
    minds: np.ndarray  # (n,) MIND
    memory: np.ndarray  # (n, k) doors, seen_from, patches, been, trail, side by side
    robots: np.ndarray  # ROBOT
    ways: np.ndarray  # (robots, k) places on the way, from `at` to `end`
    due: np.ndarray  # (n,) bool
    turn: np.ndarray  # (n,)
    full_until: np.ndarray  # (L + 1,) s
    burnt: np.ndarray  # (L,) bool
    burning: np.ndarray  # (places,) bool
    arrival: np.ndarray  # (places,) s, the book's
    ash: np.ndarray  # (places,) bool
    harm: np.ndarray  # (places,)
    cost: np.ndarray  # (places,)
    walkers: np.ndarray  # (n,) WALKER

    # copies of a simulation share these: they are of use in one call only
    numbers: np.ndarray  # (1,) NUMBERS; another array when one changes
    fresh: np.ndarray  # (L,) bool: doors that burn now
    events: np.ndarray  # EVENT, not yet told
    now: np.ndarray  # (1,) VIEW, of who thinks
    who: np.ndarray  # (n,) who thinks
    spots: np.ndarray  # (n,) SPOT: where people walk, floors set apart
    seen: np.ndarray  # SIGHTED, bodies in view
    row_of: np.ndarray  # (n,) row of the tables of who is due
    wanted: np.ndarray  # a place, how many holes, these: a row that is missing
    pairs: np.ndarray  # PAIR
    grid: np.ndarray  # (1,) GRID, to find who is near
    heads: np.ndarray  # the first body in each of its cells, -1: none
    touched: np.ndarray  # (n,) TOUCH
    some: np.ndarray  # places, for whoever looks again


OWN = State._fields[: State._fields.index("numbers")]


def references(things: list[Any]) -> list[int]:
    """How often each of these is held, by this list and by others.

    Somebody who took `bodies.position`, or a mind, before the engine began holds an
    array, or a mind, that the book would go on changing. Python's count of references
    tells whether there is somebody; then `give` writes into what they hold.
    """
    return [getrefcount(thing) for thing in things]


ONCE = references([object()])[0]  # held by a list alone


class Minds(UserList[Mind]):
    """A world's minds while the engine plays: copied back when somebody asks."""

    def __init__(self, arrays: "RunArrays"):
        """Make the list; the minds stay with the engine."""
        self.arrays = arrays
        self.last: list[Mind] | None = None  # when the engine took others instead
        arrays.lent = ref(self)

    @property
    def data(self) -> list[Mind]:  # type: ignore[override]
        """The minds as they are now; from now on, they are copied after every call."""
        if self.last is not None:
            return self.last
        self.arrays.asked_for_minds = True
        return self.arrays.minds_given()

    def __getitem__(self, i: Any) -> Any:
        """As of a list; a slice of minds is one."""
        return self.data[i]

    def __add__(self, other: Any) -> Any:
        """As of a list."""
        return self.data + list(other)

    def __radd__(self, other: Any) -> Any:
        """As of a list."""
        return list(other) + self.data

    def copy(self) -> Any:
        """As of a list."""
        return self.data.copy()

    __copy__ = copy

    def __deepcopy__(self, memo: dict[int, Any]) -> Any:
        """Copy the arrays, not the objects."""
        if self.last is not None or not self.arrays.has_minds:
            return deepcopy(self.data, memo)
        twin = self.arrays.copied(memo.get(id(self.arrays.run)))
        memo[id(self.arrays)] = twin
        return Minds(twin)

    def __reduce_ex__(self, protocol: Any) -> Any:
        """Pickle a list of minds."""
        return list, (list(self.data),)


class RunArrays:
    """One simulation's arrays, from one call to the next."""

    def __init__(self, run: Simulation):
        """Make arrays for a simulation's people, robots and building."""
        self._run = ref(run)  # else they hold each other
        self.tables: Tables = tables_of(run.sight)
        self.has_minds = False  # are they newer here than the book's?
        self.asked_for_minds = False  # by anybody, who may hold some
        self.lent: ref[Minds] | None = None  # what stands in their place in the world
        self._minds: list[Mind] = []
        self._bodies: dict[str, np.ndarray] = {}
        self._held: dict[str, np.ndarray] = {}  # columns that somebody has from before
        self._flames: dict[str, np.ndarray] = {}
        self._settings: tuple[Any, ...] = ()

        n = len(run.world.bodies)
        marks = len(run.building.landmarks)
        robots = len(run.world.robots)
        places = run.building.kind.size
        floors = run.building.floors
        self.state = State(
            numbers=np.zeros(1, NUMBERS),
            clock=np.zeros(1, CLOCK),
            bodies=np.zeros(n, BODY),
            minds=np.zeros(n, MIND),
            memory=np.zeros((n, 0), np.int32),
            robots=np.zeros(robots, ROBOT),
            ways=np.zeros(
                (robots, run.navigation.floor_size + 2 * ROOM_IN_FRONT), np.int32
            ),
            due=np.zeros(n, bool),
            turn=np.zeros(n, np.int64),
            full_until=np.zeros(marks + 1),
            burnt=np.zeros(marks, bool),
            burning=np.zeros(places, bool),
            arrival=np.zeros(places),
            ash=np.zeros(places, bool),
            harm=np.zeros(places),
            cost=np.zeros(places),
            walkers=np.zeros(n, WALKER),
            fresh=np.zeros(marks, bool),
            events=np.zeros(8 * n + 64, EVENT),
            now=np.zeros(1, VIEW),
            who=np.zeros(n, np.int32),
            spots=np.zeros(n, SPOT),
            seen=np.zeros(n + robots, SIGHTED),
            row_of=np.zeros(n, np.int32),
            wanted=np.zeros(marks + 2, np.int32),
            pairs=np.zeros(8 * n + 64, PAIR),
            grid=np.zeros(1, GRID),
            heads=np.zeros(places + 4 * floors, np.int32),
            touched=np.zeros(n, TOUCH),
            some=np.zeros(self.tables.side**2 + 1, np.int32),
        )
        self._lay_out_memory(BEEN, TRAIL)

    @property
    def run(self) -> Simulation:
        """The simulation that these arrays are of."""
        return cast(Simulation, self._run())

    def fits(self, run: Simulation) -> bool:
        """Are these the arrays of this run, and of as many people and robots?"""
        people = len(run.world.bodies) == len(self.state.bodies)
        robots = len(run.world.robots) == len(self.state.robots)
        return self.run is run and people and robots

    def __reduce_ex__(self, protocol: Any) -> Any:
        """Unpickle as None, which `kept_with` takes for not begun."""
        return type(None), ()

    def __deepcopy__(self, memo: dict[int, Any]) -> "RunArrays | None":
        """What was copied with the minds; else a copy begins arrays of its own."""
        return memo.get(id(self))

    def copied(self, run: Simulation | None) -> "RunArrays":
        """A copy, for a copy of the simulation (not complete yet) or of its world."""
        twin = RunArrays.__new__(RunArrays)
        vars(twin).update(vars(self))
        if run is not None:
            twin._run = ref(run)
        twin._minds = []
        twin.lent = None
        twin.asked_for_minds = False
        twin._bodies = {}
        twin._held = {}
        twin._flames = {}
        own = {name: getattr(self.state, name).copy() for name in OWN}
        twin.state = self.state._replace(**own)
        return twin

    # -- Numbers and room -----------------------------------------------------------

    def _lay_out_memory(self, most_been: int, most_trail: int) -> None:
        """Make room for so many places where one has been and doors of a way back."""
        run = self.run
        old = self.state.memory
        marks = len(run.building.landmarks)
        patches = 2 * marks
        been = patches + self.tables.patches
        trail = been + most_been
        self._memory = MemoryLayout(
            seen_from=marks,
            patches=patches,
            been=been,
            trail=trail,
            most_been=most_been,
            most_trail=most_trail,
        )
        wide = np.zeros((len(old), trail + 2 * most_trail), np.int32)
        if old.size:
            numbers = self.state.numbers[0]
            wide[:, :trail][:, : numbers["trail"]] = old[:, : numbers["trail"]]
            steps = old[:, numbers["trail"] :]
            wide[:, trail : trail + steps.shape[1]] = steps
        self.state = self.state._replace(memory=wide)
        self._settings = ()
        self._read_numbers()

    def make_room(self) -> None:
        """Make room to remember twice as much, and for ways twice as long."""
        numbers = self.state.numbers[0]
        most_been = 2 * int(numbers["most_been"])
        self._lay_out_memory(most_been, 2 * int(numbers["most_trail"]))
        ways = np.hstack([self.state.ways, np.zeros_like(self.state.ways)])
        self.state = self.state._replace(ways=ways)

    def _read_numbers(self) -> None:
        """Read the numbers again, if any has changed: compiled functions keep none."""
        run = self.run
        of_paper = from_paper(vars(paper))
        of_run = {
            "body_diameter": paper.body_diameter(),
            "stairs_metres": paper.stairs_metres(),
            "health_rate": paper.HEALTH_RATE * run.scenario.frames_per_tick,
            "tick": run.tick,
            "time_limit": run.scenario.time_limit,
            "reach": run.sight.reach,
            "burn_seconds": run.spread.burn_seconds,
            "decision_ticks": run.decision_ticks,
            "flame_ticks": run._flame_ticks,
            "most_sources": run.scenario.sources,
            "fire_first": paper.FIRE_FIRST_DECISION,
            "fire_every": paper.FIRE_EVERY_DECISIONS,
        }
        settings = (of_paper, of_run)
        if settings == self._settings:
            return
        self._settings = settings
        nav = self.tables.navigation
        top, left = run.building.origin
        sizes = {
            "people": len(self.state.bodies),
            "floors": nav.floors,
            "rows": nav.rows,
            "cols": nav.cols,
            "floor_size": nav.floor_size,
            "places": nav.places,
            "top": top,
            "left": left,
            "half": self.tables.half,
            "side": self.tables.side,
            "clear_reach": nav.clear.reach,
            "clear_side": nav.clear.side,
            "landmarks": len(run.building.landmarks),
        }
        values = dict(zip(OF_PAPER, of_paper, strict=True))
        values |= of_run | sizes | self._memory._asdict()
        numbers = np.array([tuple(values[name] for name in NAMES)], NUMBERS)
        self.state = self.state._replace(numbers=numbers)

    # -- From the book --------------------------------------------------------------

    def take(self) -> None:
        """Take over all that the book or a strategy may have changed."""
        run = self.run
        world = run.world
        self._take_tables()
        self._read_numbers()
        self._take_bodies(world.bodies)
        lent = self.lent and self.lent()
        mine = world.minds is lent
        if not mine and lent:
            lent.last = self.minds_given()  # no longer those of this world
        if not (mine and self.has_minds):
            self._take_minds(world.minds)
            self.has_minds = True
            world.minds = cast(list[Mind], Minds(self))
        self._take_robots()
        self._take_arrays()
        self.take_flames()
        clock = self.state.clock
        clock["time"] = world.time
        clock["ticks"] = run.ticks
        clock["person_seconds"] = run.person_seconds
        fire = run.fire_strategy
        clock["fire"] = type(fire) is not NoFire or "decide" in vars(fire)

    def _take_tables(self) -> None:
        """See to it that the tables are those of the Sight and the ways of today."""
        tables = tables_of(self.run.sight)
        if tables is self.tables:
            return
        self.minds_given()
        self.tables = tables
        some = np.zeros(tables.side**2 + 1, np.int32)
        self.state = self.state._replace(some=some, memory=self.state.memory[:, :0])
        self._lay_out_memory(self._memory.most_been, self._memory.most_trail)

    def _take_bodies(self, bodies: Bodies) -> None:
        """Make the book's arrays columns of the records."""
        theirs = {name: vars(bodies)[name] for name in COLUMNS}
        others = [n for n, mine in self._bodies.items() if theirs[n] is not mine]
        if others:  # whoever has the old ones keeps them as they are
            self.state = self.state._replace(bodies=self.state.bodies.copy())
            self._bodies = {}
            for name in others:
                self._held.pop(name, None)
        all_mine = self.state.bodies
        holders = references(list(theirs.values()))
        for (name, now), count in zip(theirs.items(), holders, strict=True):
            if now is self._bodies.get(name):
                continue
            column = all_mine[POINTS.get(name, name)]
            if name in POINTS:
                strides = (all_mine.itemsize, 8)
                shape = (len(all_mine), 2)
                column = np.lib.stride_tricks.as_strided(column, shape, strides)
            column[:] = now
            if count > ONCE + 2:  # by more than `bodies`, `theirs` and their list
                self._held[name] = now
            self._bodies[name] = column
            setattr(bodies, name, column)

    def _take_minds(self, minds: Sequence[Mind]) -> None:
        """Write minds into the records; at the start they remember nothing."""
        there = isinstance(minds, Minds) and minds.last is None
        if there and self._take_copied(cast(Minds, minds).arrays):
            return
        self._minds = minds.data if isinstance(minds, Minds) else cast(list, minds)
        if max(references(self._minds), default=0) > ONCE:  # not by their list alone
            self.asked_for_minds = True
        been = max((len(mind.been) for mind in self._minds), default=0)
        trail = max((len(mind.trail) for mind in self._minds), default=0)
        while been >= self._memory.most_been or trail >= self._memory.most_trail:
            self.make_room()
        state = self.state
        _write_records(self._minds, state.minds)
        state.memory[:] = 0
        state.memory[:, self._memory.seen_from : self._memory.patches] = NOWHERE
        for i, mind in enumerate(self._minds):
            if mind.been or mind.doors or mind.seen_from or mind.patches or mind.trail:
                self._take_memory(state.memory[i], mind)

    def _take_copied(self, other: "RunArrays") -> bool:
        """Take minds over from other arrays, if they are there and laid out alike."""
        alike = other.tables is self.tables and other._memory == self._memory
        alike = alike and len(other.state.minds) == len(self.state.minds)
        if not (alike and other.has_minds):
            return False
        self.state.minds[:] = other.state.minds
        self.state.memory[:] = other.state.memory
        self._minds = []
        return True

    def _take_memory(self, row: np.ndarray, mind: Mind) -> None:
        at = self._memory
        row[list(mind.doors)] = 1
        for mark, room in mind.seen_from.items():
            row[at.seen_from + mark] = room
        # the first column of patches is NOWHERE, which may be among them
        row[np.array(list(mind.patches), int) + (at.patches + 1)] = 1
        row[at.been : at.been + len(mind.been)] = list(mind.been)
        row[at.trail : at.trail + 2 * len(mind.trail)] = np.ravel(mind.trail)
        self.tables.need(mind.been)

    def _take_robots(self) -> None:
        robots = self.run.world.robots
        longest = max((len(robot.way) for robot in robots), default=0)
        while ROOM_IN_FRONT + longest >= self.state.ways.shape[1]:
            self.make_room()
        for k, robot in enumerate(robots):
            end = ROOM_IN_FRONT + len(robot.way)
            x, y = robot.position.tolist()
            self.state.robots[k] = (
                x, y, robot.place, robot.body, robot.floor, robot.says,
                ROOM_IN_FRONT, end, robot.active, x, y, False,
            )  # fmt: skip
            self.state.ways[k, ROOM_IN_FRONT:end] = robot.way

    def _take_arrays(self) -> None:
        """Share who is due, and which doors are full."""
        run = self.run
        for name in ("due", "turn", "full_until"):
            mine = getattr(self.state, name)
            now = getattr(run, name)
            if now is not mine:
                mine[:] = now
                setattr(run, name, mine)

    def take_flames(self) -> None:
        """Take over what burns."""
        flames = self.run.world.flames
        state = self.state
        if flames.arrival is not self._flames.get("arrival"):
            self._flames["arrival"] = flames.arrival
            state = state._replace(arrival=flames.arrival.ravel())
            self.state = state
        written = bool(flames.sources) or flames.burning.any()
        for name in ("burning", "ash", "harm", "cost"):
            now = getattr(flames, name)
            if written or now is not self._flames.get(name):
                self._flames[name] = now
                getattr(state, name)[:] = now.ravel()
        state.burnt[:] = False
        if self.run.world.burnt:
            state.burnt[list(self.run.world.burnt)] = True
        state.clock["alight"] = bool(flames.alight)
        state.clock["sources"] = len(flames.sources)
        state.clock["flames_change"] = self.run._flames_change
        state.clock["flames_moved"] = 0

    # -- To the book ----------------------------------------------------------------

    def give(self) -> None:
        """Make the book's world current; minds only when somebody asks."""
        run = self.run
        clock = self.state.clock[0]
        run.world.time = float(clock["time"])
        if run.ticks != clock["ticks"]:
            walkers = self.state.walkers[: clock["walked"]]
            run.walked_to = np.stack([walkers["tried_x"], walkers["tried_y"]], axis=1)
        run.ticks = int(clock["ticks"])
        run.person_seconds = float(clock["person_seconds"])
        self._tell_events()
        if clock["flames_moved"]:
            self._give_flames()
        robots = zip(run.world.robots, self.state.robots.tolist(), strict=True)
        for k, (robot, mine) in enumerate(robots):
            x, y, place, _, _, says, at, end, active, *_ = mine
            robot.position = np.array((x, y))
            robot.place = place
            robot.says = says
            robot.active = bool(active)
            robot.way = self.state.ways[k, at:end].tolist()
        for name, array in self._held.items():
            array[:] = self._bodies[name]
        if self.asked_for_minds:
            self.minds_given()

    def _give_flames(self) -> None:
        """Give the book what burns now, in new arrays: old ones may be kept."""
        flames = self.run.world.flames
        for name in ("burning", "ash", "harm", "cost"):
            now = getattr(self.state, name).reshape(flames.arrival.shape).copy()
            self._flames[name] = now
            setattr(flames, name, now)
        flames.alight = frozenset(np.flatnonzero(self.state.burning).tolist())
        self.run._flames_change = float(self.state.clock["flames_change"][0])
        self.state.clock["flames_moved"] = 0

    def _tell_events(self) -> None:
        clock = self.state.clock
        told = self.state.events[: int(clock["events"][0])].tolist()
        clock["events"] = 0
        for time, health, kind, person, floor, mark in told:
            if kind == LEFT_FLOOR:
                event: Any = LeftFloor(time, person, floor, health)
            elif kind == EVACUATED:
                event = Evacuated(time, person, floor, health, mark)
            elif kind == DOOR_BURNT:
                event = DoorBurnt(time, mark)
                self.run.world.burnt.add(mark)
            else:
                event = Died(time, person, floor)
            self.run.events.append(event)

    def minds_given(self) -> list[Mind]:
        """The book's minds, as they are now."""
        if self.has_minds:
            self.written_minds(self._minds)
            self.has_minds = False
        return self._minds

    def written_minds(self, minds: list[Mind]) -> list[Mind]:
        """Write the records into minds; into new ones where there are none."""
        minds.extend(Mind() for _ in range(len(minds), len(self.state.minds)))
        rows = np.split(self.state.memory, self._memory.begins, axis=1)
        records = map(MindRecord._make, self.state.minds.tolist())
        each = zip(minds, records, *rows, strict=True)
        for mind, mine, doors, seen_from, patches, been, trail in each:
            mind.mode = Mode(mine.mode)
            mind.leader = mine.leader
            mind.seen_at = mine.seen_at
            mind.seen_place = mine.seen_place
            mind.told = None if mine.told == NOT_TOLD else mine.told
            mind.pause_until = mine.pause_until
            mind.waits_until = mine.waits_until
            mind.goal = Goal(Aim(mine.aim), mine.which, mine.place)
            mind.facing = (mine.facing_x, mine.facing_y)
            mind.doors = set(np.flatnonzero(doors).tolist())
            known = np.flatnonzero(seen_from != NOWHERE).tolist()
            mind.seen_from = {mark: int(seen_from[mark]) for mark in known}
            mind.patches = set((np.flatnonzero(patches) - 1).tolist())
            mind.been = dict.fromkeys(been[: mine.been].tolist())
            steps = trail[: 2 * mine.trail].tolist()
            mind.trail = [
                Passed(*both) for both in zip(steps[::2], steps[1::2], strict=True)
            ]
        return minds


def _write_records(minds: Sequence[Mind], records: np.ndarray) -> None:
    """Write minds without their memory into records MIND, column by column."""
    told = [mind.told for mind in minds]
    records["mode"] = [mind.mode for mind in minds]
    records["leader"] = [mind.leader for mind in minds]
    records["seen_at"] = [mind.seen_at for mind in minds]
    records["seen_place"] = [mind.seen_place for mind in minds]
    records["told"] = [NOT_TOLD if mark is None else mark for mark in told]
    records["pause_until"] = [mind.pause_until for mind in minds]
    records["waits_until"] = [mind.waits_until for mind in minds]
    records["aim"] = [mind.goal.aim for mind in minds]
    records["which"] = [mind.goal.which for mind in minds]
    records["place"] = [mind.goal.place for mind in minds]
    records["facing_x"] = [mind.facing[0] for mind in minds]
    records["facing_y"] = [mind.facing[1] for mind in minds]
    records["been"] = [len(mind.been) for mind in minds]
    records["trail"] = [len(mind.trail) for mind in minds]
