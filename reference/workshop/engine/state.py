"""A `Simulation` as arrays of records and back, field by field in the order of `world`.

Bodies are shared: the book's arrays become columns of the engine's records. Minds are
copied back when somebody asks for them.

    n  people;  L  landmarks;  S  places of a floor
"""

from typing import Any, NamedTuple, cast

import numpy as np

from reference import paper
from reference.fire import NoFire
from reference.simulation import Simulation
from reference.workshop.engine.tables import Arrays, Tables, record, tables_of
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
    World,
)

TRAIL = 16  # doors of a way back for which there is room at first
NOT_TOLD = -2
LEFT_FLOOR, EVACUATED, DIED, DOOR_BURNT = range(4)

BODY = record(
    x="f8", y="f8", floor="i8", place="i8", pace="f8", health="f8", fate="i1",
    mode="i1", landmark="i8", target_x="f8", target_y="f8", goal_x="f8", goal_y="f8",
    leader="i8", stairwell="i8", stairs_until="f8", rank="f8", anchor_x="f8",
    anchor_y="f8", anchor_time="f8", reckless_until="f8",
)  # fmt: skip
POINTS = {"position": "x", "target": "target_x", "goal": "goal_x", "anchor": "anchor_x"}
MIND = record(
    mode="i8", leader="i8", seen_at="f8", seen_place="i8", told="i8", pause_until="f8",
    waits_until="f8", aim="i8", which="i8", place="i8", facing_x="f8", facing_y="f8",
    trail="i8", stamp="i8", home="i8",
)  # fmt: skip
ROBOT = record(
    x="f8", y="f8", place="i8", body="i8", floor="i8", says="i8", at="i8", end="i8",
    active="i8", to_x="f8", to_y="f8", decided="i8",
)  # fmt: skip
CLOCK = record(
    time="f8", person_seconds="f8", flames_change="f8", ticks="i8", left="i8",
    phase="i8", events="i8", walked="i8", alight="i8", sources="i8", touched="i8",
    fire="i8", flames_moved="i8",
)  # fmt: skip
EVENT = record(time="f8", health="f8", kind="i8", person="i8", floor="i8", mark="i8")
VIEW = record(
    time="f8", rank="f8", halted_since="f8", row="i8", place="i8", patch="i8",
    room="i8", here="i8", here_burnt="i8", seen="i8", robot="i8", alight="i8",
    hits="i8", hits_end="i8", opens="i8", opens_end="i8", holes="i8", holes_end="i8",
    looked="i8", looked_end="i8",
)  # fmt: skip
SIGHTED = record(
    metres="f8", rank="f8", j="i8", place="i8", told="i8", leader="i8", landmark="i8"
)
WALKER = record(
    i="i8", floor="i8", inside="i8", fearless="i8", x="f8", y="f8", pace="f8",
    to_x="f8", to_y="f8", e_x="f8", e_y="f8", far="f8", v="f8", turned_x="f8",
    turned_y="f8", sum_x="f8", sum_y="f8", walked_x="f8", walked_y="f8", moved_x="f8",
    moved_y="f8", tried_x="f8", tried_y="f8", on_x="f8", on_y="f8", right="f8",
    standing="i8", held="i8", meets="i8", back="i8", cell="i8", later="i8",
)  # fmt: skip
PAIR = record(
    i="i8", j="i8", to_x="f8", to_y="f8", apart="f8", room="f8", facing="i8",
    i_yields="i8", push_i="f8", push_j="f8",
)  # fmt: skip
TOUCH = record(i="i8", before="i8")

FLOATS = (
    "FLIGHT", "DOOR_FLOW", "STAIRS_FLOW", "HEALTH_RATE", "NO_HEALTH", "BODY_RADIUS",
    "DETOUR_SECONDS", "STUCK_METRES", "STUCK_SECONDS", "RECKLESS_SECONDS",
    "STUCK_WAIT_SECONDS", "MOST_FOLLOWERS", "FOLLOW_DISTANCE", "LEADER_GRACE_SECONDS",
    "LEADER_PAUSE_SECONDS", "RECONSIDER_TICKS", "GOAL_HYSTERESIS", "SHOULDER_METRES",
    "NEIGHBOUR_METRES", "GAP_SECONDS", "PUSH_STRENGTH", "PUSH_RANGE", "ASIDE_METRES",
    "KEEP_RIGHT", "ARRIVED_METRES", "IDLE_SPEED", "GIVE_WAY_SPEED", "PUSH_ROUNDS",
    "HELD_UP_SPEED", "SHUFFLE_SPEED", "SHUFFLE_TURN", "SHUFFLE_RIGHT", "ROBOT_SPEED",
    "DOORWAY_METRES", "FOLLOWER_GAP", "CROWD_GAP", "BURN_LOSS", "BURN_COST",
    "HEAT_LOSS", "HEAT_COST",
)  # fmt: skip
WHOLE = {"MOST_FOLLOWERS", "RECONSIDER_TICKS", "PUSH_ROUNDS"}
NUMBERS = record(
    **{name: "i8" if name in WHOLE else "f8" for name in FLOATS},
    body_diameter="f8", stairs_metres="f8", tick="f8", time_limit="f8", reach="f8",
    health_rate="f8", burn_seconds="f8", decision_ticks="i8", flame_ticks="i8", most_sources="i8",
    fire_first="i8", fire_every="i8", people="i8", floors="i8", rows="i8", cols="i8",
    floor_size="i8", places="i8", top="i8", left="i8", half="i8", side="i8",
    clear_reach="i8", clear_side="i8", landmarks="i8", seen_from="i8", patches="i8",
    been="i8", trail="i8", most_trail="i8",
)  # fmt: skip


class State(NamedTuple):
    """One simulation as compiled functions take it."""

    numbers: np.ndarray  # (1,) NUMBERS: those of `paper`, the scenario, sizes
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
    arrival: np.ndarray  # (places,) s
    ash: np.ndarray  # (places,) bool
    harm: np.ndarray  # (places,)
    cost: np.ndarray  # (places,)
    fresh: np.ndarray  # (L,) bool: doors that burn now
    events: np.ndarray  # EVENT, not yet told
    now: np.ndarray  # (1,) VIEW, of who thinks
    spots: np.ndarray  # (n, 2) m, where people walk, floors set apart; inf: do not
    seen: np.ndarray  # SIGHTED, bodies in view
    row_of: np.ndarray  # (n,) row of the tables of who is due
    wanted: np.ndarray  # a place, how many holes, these: a row that is missing
    walkers: np.ndarray  # (n,) WALKER
    pairs: np.ndarray  # PAIR
    heads: np.ndarray  # the first walker in each cell of a coarse grid, -1: none
    touched: np.ndarray  # (n,) TOUCH
    some: np.ndarray  # places, for whoever looks again


class Played(World):
    """A world whose minds are with the engine until somebody asks for them."""

    @property  # type: ignore[override]
    def minds(self) -> list[Mind]:
        """Take the minds back: the engine copies them again when it goes on."""
        return cast(Kept, self.__dict__["kept"]).give_minds_back()

    @minds.setter
    def minds(self, minds: list[Mind]) -> None:
        if "kept" in self.__dict__:
            self.minds  # noqa: B018
        self.__class__ = World
        self.minds = minds

    def __reduce_ex__(self, protocol: Any) -> Any:
        self.minds  # noqa: B018
        return self.__reduce_ex__(protocol)


class Kept:
    """One simulation's arrays, from one call to the next."""

    def __reduce_ex__(self, protocol: Any) -> Any:
        """Copies of a simulation begin their own arrays."""
        return type(None), ()

    def __init__(self, run: Simulation):
        """Make arrays for a simulation's people, robots and building."""
        self.run = run
        self.tables: Tables = tables_of(run.sight)
        n = len(run.world.bodies)
        marks = len(run.building.landmarks)
        robots = len(run.world.robots)
        places = run.building.kind.size
        self.state = State(
            numbers=np.zeros(1, NUMBERS),
            clock=np.zeros(1, CLOCK),
            bodies=np.zeros(n, BODY),
            minds=np.zeros(n, MIND),
            memory=np.zeros((n, 0), np.int32),
            robots=np.zeros(robots, ROBOT),
            ways=np.zeros((robots, run.navigation.floor_size + 8), np.int32),
            due=np.zeros(n, bool),
            turn=np.zeros(n, np.int64),
            full_until=np.zeros(marks + 1),
            burnt=np.zeros(marks, bool),
            burning=np.zeros(places, bool),
            arrival=np.zeros(places),
            ash=np.zeros(places, bool),
            harm=np.zeros(places),
            cost=np.zeros(places),
            fresh=np.zeros(marks, bool),
            events=np.zeros(8 * n + 64, EVENT),
            now=np.zeros(1, VIEW),
            spots=np.zeros((n, 2)),
            seen=np.zeros(n + robots, SIGHTED),
            row_of=np.zeros(n, np.int32),
            wanted=np.zeros(marks + 2, np.int32),
            walkers=np.zeros(n, WALKER),
            pairs=np.zeros(8 * n + 64, PAIR),
            heads=np.zeros(places + 4 * run.building.floors, np.int32),
            touched=np.zeros(n, TOUCH),
            some=np.zeros(self.tables.side**2 + 1, np.int32),
        )
        self._flames: dict[str, np.ndarray] = {}
        self._minds: list[Mind] = []
        self._bodies: dict[str, np.ndarray] = {}
        self.lengthen_trails(TRAIL)

    @property
    def arrays(self) -> Arrays:
        """The tables, as long as they are now."""
        return self.tables.arrays

    def lengthen_trails(self, most: int) -> None:
        """Make room for so many doors of a way back."""
        run = self.run
        marks = len(run.building.landmarks)
        ends = {"seen_from": marks, "patches": 2 * marks}
        ends["been"] = ends["patches"] + self.tables.patches
        ends["trail"] = ends["been"] + run.navigation.floor_size
        wide = np.zeros((len(self.state.minds), ends["trail"] + 2 * most), np.int32)
        old = self.state.memory
        wide[:, : old.shape[1]] = old
        self.state = self.state._replace(memory=wide)
        self._numbers(most, ends)

    def _numbers(self, most_trail: int, ends: dict[str, int]) -> None:
        """Read the numbers: compiled functions keep none of their own."""
        run = self.run
        nav = run.navigation
        top, left = run.building.origin
        values = {name: getattr(paper, name) for name in FLOATS} | ends
        values |= {
            "body_diameter": paper.body_diameter(),
            "stairs_metres": paper.stairs_metres(),
            "tick": run.tick,
            "time_limit": run.scenario.time_limit,
            "reach": run.sight.reach,
            "health_rate": paper.HEALTH_RATE * run.scenario.frames_per_tick,
            "burn_seconds": run.spread.burn_seconds,
            "decision_ticks": run.decision_ticks,
            "flame_ticks": run._flame_ticks,
            "most_sources": run.scenario.sources,
            "fire_first": paper.FIRE_FIRST_DECISION,
            "fire_every": paper.FIRE_EVERY_DECISIONS,
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
            "most_trail": most_trail,
        }
        for name, value in values.items():
            self.state.numbers[name] = value

    # -- From the book --------------------------------------------------------------

    def take(self) -> None:
        """Take over all that the book or a strategy may have changed."""
        run = self.run
        world = run.world
        self._take_bodies(world.bodies)
        if not isinstance(world, Played):
            self._take_minds(world.minds)
            world.__dict__["kept"] = self
            world.__class__ = Played
        self._take_robots()
        self._take_arrays()
        self.take_flames()
        clock = self.state.clock
        clock["time"] = world.time
        clock["ticks"] = run.ticks
        clock["person_seconds"] = run.person_seconds
        clock["fire"] = type(run.fire_strategy) is not NoFire

    def _take_bodies(self, bodies: Bodies) -> None:
        """Make the book's arrays columns of the records."""
        all_mine = self.state.bodies
        for name, now in vars(bodies).items():
            if now is self._bodies.get(name):
                continue
            column = all_mine[POINTS.get(name, name)]
            if name in POINTS:
                strides = (all_mine.itemsize, 8)
                shape = (len(all_mine), 2)
                column = np.lib.stride_tricks.as_strided(column, shape, strides)
            column[:] = now
            self._bodies[name] = column
            setattr(bodies, name, column)

    def _take_minds(self, minds: list[Mind]) -> None:
        self._minds = minds
        numbers = self.state.numbers[0]
        longest = max((len(mind.trail) for mind in minds), default=0)
        if longest + 2 > numbers["most_trail"]:
            self.lengthen_trails(2 * longest + 2)
        numbers = self.state.numbers[0]
        seen_from, patches, been, trail = (
            int(numbers[name]) for name in ("seen_from", "patches", "been", "trail")
        )
        size = self.run.navigation.floor_size
        memory = self.state.memory
        memory[:] = 0
        memory[:, seen_from:patches] = -1
        for i, mind in enumerate(minds):
            goal = mind.goal
            self.state.minds[i] = (
                mind.mode,
                mind.leader,
                mind.seen_at,
                mind.seen_place,
                NOT_TOLD if mind.told is None else mind.told,
                mind.pause_until,
                mind.waits_until,
                goal.aim,
                goal.which,
                goal.place,
                *mind.facing,
                len(mind.trail),
                len(mind.been),
                next(iter(mind.been), 0) // size,
            )
            row = memory[i]
            if mind.doors:
                row[list(mind.doors)] = 1
            for mark, room in mind.seen_from.items():
                row[seen_from + mark] = room
            if mind.patches:
                row[np.array(list(mind.patches)) + (patches + 1)] = 1
            for stamp, place in enumerate(mind.been, 1):
                row[been + place % size] = stamp
            for k, passed in enumerate(mind.trail):
                row[trail + 2 * k] = passed.door
                row[trail + 2 * k + 1] = passed.side
            self.tables.need(mind.been)

    def _take_robots(self) -> None:
        for k, robot in enumerate(self.run.world.robots):
            end = 4 + len(robot.way)
            x, y = robot.position.tolist()
            self.state.robots[k] = (
                x, y, robot.place, robot.body, robot.floor, robot.says, 4, end,
                robot.active, x, y, False,
            )  # fmt: skip
            self.state.ways[k, 4:end] = robot.way

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
        for name in ("arrival", "burning", "ash", "harm", "cost"):
            now = getattr(flames, name)
            if now is not self._flames.get(name):
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
        run.ticks = int(clock["ticks"])
        run.person_seconds = float(clock["person_seconds"])
        self._tell_events()
        if clock["flames_moved"]:
            self._give_flames()
        walkers = self.state.walkers[: clock["walked"]]
        run.walked_to = np.stack([walkers["tried_x"], walkers["tried_y"]], axis=1)
        robots = zip(run.world.robots, self.state.robots.tolist(), strict=True)
        for k, (robot, mine) in enumerate(robots):
            x, y, place, _, _, says, at, end, active, *_ = mine
            robot.position = np.array((x, y))
            robot.place = place
            robot.says = says
            robot.active = bool(active)
            robot.way = self.state.ways[k, at:end].tolist()

    def _give_flames(self) -> None:
        """Give the book what burns now, in new arrays: old ones may be kept."""
        flames = self.run.world.flames
        for name in ("burning", "ash", "harm", "cost"):
            self._flames[name] = getattr(self.state, name).reshape(flames.arrival.shape)
            self._flames[name] = self._flames[name].copy()
            setattr(flames, name, self._flames[name])
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

    def give_minds_back(self) -> list[Mind]:
        """Write the minds into the book's objects, and leave them there."""
        world = self.run.world
        world.__class__ = World
        del world.__dict__["kept"]
        world.minds = self._minds
        numbers = self.state.numbers[0]
        names = ("seen_from", "patches", "been", "trail")
        cuts = [int(numbers[name]) for name in names]
        rows = np.split(self.state.memory, cuts, axis=1)
        size = self.run.navigation.floor_size
        for i, mine in enumerate(self.state.minds.tolist()):
            mind = world.minds[i]
            mind.mode = Mode(mine[0])
            mind.leader, mind.seen_at, mind.seen_place = mine[1:4]
            mind.told = None if mine[4] == NOT_TOLD else mine[4]
            mind.pause_until, mind.waits_until = mine[5:7]
            mind.goal = Goal(Aim(mine[7]), mine[8], mine[9])
            mind.facing = mine[10], mine[11]
            doors, seen_from, patches, been, trail = (part[i] for part in rows)
            mind.doors = set(np.flatnonzero(doors).tolist())
            known = np.flatnonzero(seen_from != NOWHERE).tolist()
            mind.seen_from = {mark: int(seen_from[mark]) for mark in known}
            mind.patches = set((np.flatnonzero(patches) - 1).tolist())
            places = np.flatnonzero(been)
            order = places[np.argsort(been[places], kind="stable")] + mine[14] * size
            mind.been = dict.fromkeys(order.tolist())
            steps = trail[: 2 * mine[12]].tolist()
            mind.trail = [
                Passed(*both) for both in zip(steps[::2], steps[1::2], strict=True)
            ]
        return world.minds
