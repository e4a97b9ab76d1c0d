"""One run of an evacuation, tick by tick: SENSE, DECIDE, MOVE, BURN, SETTLE.

Only this module changes a world, through the modules before it.

In a tick there are only operations that IEEE 754 rounds correctly, + - * / and sqrt,
and sums have a fixed order: so a run is the same on every processor.  What still
depends on the machine is drawn before the first tick, since numpy takes a logarithm
for a few of these draws: people's paces (`beginning`), the delays of flames (`Spread`).
What learns does, too: networks, and the noise with which they explore.

    i   a human;  mark  index of a landmark
"""

from collections import Counter
from copy import deepcopy
from dataclasses import dataclass
from math import inf, nan

import numpy as np

from reference import humans, motion, paper, walking
from reference.beginning import generators, starting_world
from reference.building import Building, Kind
from reference.fire import FireStrategy, NoFire, SourceGenerator, Spread, cells_beside
from reference.navigation import navigation_of
from reference.paper import InputError, Scenario, are_numbers, check_objects, check_seed
from reference.rays import sight_of
from reference.rewards import group_reward
from reference.robots import Destinations, NoRobots, RobotAlgorithm, RobotStrategy
from reference.view import look
from reference.walking import Touched
from reference.world import (
    NOBODY,
    NOWHERE,
    Died,
    DoorBurnt,
    Evacuated,
    Event,
    Fate,
    FireLit,
    LeftFloor,
    Robot,
    World,
)


@dataclass(frozen=True)
class Outcome:
    """Result of a run so far; mean_health: of those who got out, nan for nobody.

    In a world that was given, reward and person_seconds count from where this run
    began; people count from the beginning of the world.
    """

    people: int
    evacuated: int
    died: int
    inside: int
    mean_health: float
    reward: float
    simulated_seconds: float
    person_seconds: float


class Simulation:
    """People, robots and a fire in one building, from one seed.

    world   what exists now;  events  all that has happened
    tick    seconds of one step;  decision_ticks  ticks from one decision to the next
    due     (n,) bool, who thinks in the next tick
    turn    (n,) person i thinks at least when ticks % RECONSIDER_TICKS == turn[i]
    full_until  (landmarks + 1,) s, until when each is full; the last, which index -1
            reads, stands for no landmark and is never full
    walked_to  (k, 2) metres, where the last tick's walk led, before any took stairs
    """

    def __init__(
        self,
        building: Building,
        scenario: Scenario | None = None,
        robots: RobotStrategy | None = None,
        fire: FireStrategy | None = None,
        seed: int = 0,
        world: World | None = None,
    ):
        """Set up a run. Same seed and inputs, same run; default: no robots and no fire.

        robots, fire: copied together, so that what they remember is this run's alone
        world: goes on from here, and is changed; else drawn as the scenario says
        Raises InputError for names in place of objects, for a world of another
        building, for a seed that is no whole number of 0 or more, and for more people
        than fit.
        """
        check_objects(building, scenario, robots, fire, world)
        check_seed(seed)
        self.building = building
        self.scenario = scenario or Scenario()
        self.navigation = navigation_of(building)
        self.sight = sight_of(building, self.scenario.sight_range)
        self._marks = building.landmark.ravel()
        self._areas = building.area.ravel()

        # who takes part
        self.rng = generators(seed)
        robots = NoRobots() if robots is None else robots
        fire = NoFire() if fire is None else fire
        self.robot_strategy, self.fire_strategy = deepcopy((robots, fire))
        self.algorithm = RobotAlgorithm()
        self.generator = SourceGenerator(building, self.scenario, self.rng["elsewhere"])
        self.spread = Spread(building, self.scenario, self.rng["flames"])
        guided = not isinstance(self.robot_strategy, NoRobots)
        if world is None:
            world = starting_world(building, self.scenario, self.rng["people"])
            if not guided:
                world.robots = []
        elif guided and self.scenario.robots_per_floor and not world.robots:
            raise InputError(
                "nobody can be guided: the world is of a simulation without robots"
            )
        self.world = world

        # clocks and what has happened
        self.tick = self.scenario.tick
        self.ticks = round(world.time / self.tick)
        self.decision_ticks = round(self.scenario.decision_seconds / self.tick)
        self._flame_ticks = max(1, round(paper.FLAME_SECONDS / self.tick))
        self._flames_change = world.time if world.flames.sources else inf
        self.full_until = np.zeros(len(building.landmarks) + 1)
        self.turn = np.arange(len(world.bodies)) % paper.RECONSIDER_TICKS
        self.due = np.ones(len(world.bodies), dtype=bool)
        self.events: list[Event] = []
        self.person_seconds = 0.0
        self.walked_to = np.empty((0, 2))

    def __repr__(self) -> str:
        """Say in a line how it stands."""
        return f"<Simulation of {self.building.title}: {self.world!r}>"

    # -- The tick -------------------------------------------------------------------

    @property
    def done(self) -> bool:
        """Nobody is inside any more, or time is up."""
        late = self.world.time >= self.scenario.time_limit - 1e-9
        return late or not any(self.world.occupancy)

    def step(self) -> list[Event]:
        """Run one tick; return its events.

        It may be called when all is `done`: the fire goes on, to measure h [F11].
        """
        already = len(self.events)
        # SENSE
        who = np.flatnonzero(self.due & self.world.bodies.walking)
        views = look(self.world, self.sight, who)
        # DECIDE
        humans.decide(self.world, who, views)
        destinations = self.strategies_decide()
        # MOVE
        self.robots_move(destinations)
        touched = self._people_move()
        # BURN
        self.burn()
        self.lose_health()
        # SETTLE
        self.settle(touched)
        return self.events[already:]

    def run(self) -> Outcome:
        """Run to the end."""
        while not self.done:
            self.step()
        return self.outcome()

    def outcome(self) -> Outcome:
        """Count people, health and reward so far."""
        bodies = self.world.bodies
        out = bodies.fate == Fate.EVACUATED
        return Outcome(
            people=len(bodies),
            evacuated=int(out.sum()),
            died=int((bodies.fate == Fate.DEAD).sum()),
            inside=int(bodies.inside.sum()),
            mean_health=float(bodies.health[out].mean()) if out.any() else nan,
            reward=group_reward(self.events),
            simulated_seconds=self.world.time,
            person_seconds=self.person_seconds,
        )

    def copy(self) -> "Simulation":
        """Copy the simulation; the copy runs on like this one, which stays as it is."""
        # these never change: whatever a memo names, deepcopy keeps
        shared = self.building, self.navigation, self.sight, self.spread, self.generator
        return deepcopy(self, {id(one): one for one in (*shared, *self.events)})

    __copy__ = copy

    # -- SENSE and DECIDE -----------------------------------------------------------

    @property
    def fire_turn(self) -> bool:
        """Is it the fire's turn: a k-th decision [D2], with sources left [C2]?"""
        number, between = divmod(self.ticks, self.decision_ticks)
        since = number - paper.FIRE_FIRST_DECISION
        due = since >= 0 and since % paper.FIRE_EVERY_DECISIONS == 0 and not between
        return due and len(self.world.flames.sources) < self.scenario.sources

    def strategies_decide(self) -> Destinations:
        """Ask the robots' strategy at each decision, the fire's at every k-th.

        Both see the same world. Robots that have found their work done are not asked
        [C8]. Returns a destination per robot; None keeps the old. Raises InputError for
        what is no decision.
        """
        robots = self.world.robots
        decided: Destinations = [None] * len(robots)
        active = [k for k, robot in enumerate(robots) if robot.active]
        if active and self.ticks % self.decision_ticks == 0:
            answers = self._ask_robots([robots[k] for k in active])
            for k, answer in zip(active, answers, strict=True):
                decided[k] = answer
        if self.fire_turn:
            self._fire_decides()
        return decided

    def _ask_robots(self, team: list[Robot]) -> Destinations:
        """Ask the strategy where these robots go. Raises InputError for no decision."""
        answers = self.robot_strategy.decide(self.world, team, self.rng["robots"])
        is_list = hasattr(answers, "__len__") and np.iterable(answers)
        if not is_list or len(answers) != len(team):
            raise InputError(
                f"the robots' decide returned {answers!r:.60}: give a list, with "
                f"(x, y) or None for each of the {len(team)} robots at work"
            )
        for answer in answers:
            if answer is not None and not are_numbers(answer, 2):
                raise InputError(
                    f"a robot is sent to {answer!r:.60}, which is no place: give "
                    "(x, y), metres, or None"
                )
        return answers

    def _fire_decides(self) -> None:
        """Light the source that the fire decides for, or record why not [D6]."""
        world = self.world
        decision = self.fire_strategy.decide(world, self.rng["fire"])
        if decision is None:
            return
        floors = range(world.building.floors)
        if not are_numbers(decision, 3) or decision[0] not in floors:
            raise InputError(
                f"the fire decides for {decision!r:.60}, which is no place: give "
                f"(floor, x, y), floor 0 to {floors[-1]} and metres, or None"
            )
        event = self.generator.generate(world, decision)
        self.events.append(event)
        if isinstance(event, FireLit):
            self.spread.ignite(world.flames, event)
            self._flames_change = world.time

    # -- MOVE -----------------------------------------------------------------------

    def robots_move(self, destinations: Destinations) -> None:
        """Walk the robots, on their way or to a destination just decided [C7]."""
        for robot, destination in zip(self.world.robots, destinations, strict=True):
            self.algorithm.act(robot, self.world, destination, self.tick)

    def _people_move(self) -> Touched:
        """Walk people one tick; return who stepped onto a landmark [A5]."""
        bodies = self.world.bodies
        who = np.flatnonzero(bodies.walking)
        full = self.full_until > self.world.time + 1e-9
        self.walked_to = motion.step(
            position=bodies.position[who],
            floor=bodies.floor[who],
            target=walking.targets(self.world, who),
            pace=bodies.pace[who],
            seconds=self.tick,
            free=walking.free_for(self.world, who, full),
            rng=self.rng["bodies"],
        )
        touched = walking.advance(self.world, who, self.walked_to)
        self.fill_doors(touched)
        return touched

    def fill_doors(self, touched: Touched) -> None:
        """Close the doors, entrances and exits just entered until they have room [A5].

        Each person keeps a way full for 1 / (flow · width) seconds: from the moment at
        which it became free, if that was during the last tick. From now, each person
        would cost up to a tick more than the flow says.
        """
        place = self.world.bodies.place
        now = self.world.time
        entered = Counter(int(self._marks[place[i]]) for i, _ in touched)
        for mark, count in entered.items():
            way = self.building.landmarks[mark]
            flow = paper.STAIRS_FLOW if way.kind is Kind.ENTRANCE else paper.DOOR_FLOW
            since = float(self.full_until[mark])
            if since <= now - self.tick + 1e-9:  # free for a tick or longer
                since = now
            self.full_until[mark] = since + count / (flow * way.width)

    # -- BURN -----------------------------------------------------------------------

    def burn(self) -> None:
        """Advance the clock; spread flames and burn doors [A6] [D7]."""
        world = self.world
        self.ticks += 1
        world.time = self.ticks * self.tick
        self.person_seconds += self.tick * sum(world.occupancy)
        if world.time >= self._flames_change and self.ticks % self._flame_ticks == 0:
            self._flames_change = self.spread.advance(world.flames, world.time)
            self._burn_doors()

    def lose_health(self) -> None:
        """Lower everybody's health, and more in and beside flames [B7]."""
        bodies = self.world.bodies
        flames = self.world.flames
        rate = paper.HEALTH_RATE * self.scenario.frames_per_tick  # points a tick
        bodies.health -= rate * bodies.inside
        if flames.sources:
            walking = np.flatnonzero(bodies.walking)
            harm = flames.harm.ravel()[bodies.place[walking]]  # points a second
            bodies.health[walking] -= harm * self.tick

    def _burn_doors(self) -> None:
        """Destroy the regular doors that have flames beside them [A6]."""
        burning = self.world.flames.burning
        burnt = self.world.burnt
        touched = burning | cells_beside(self.building, burning)
        doors = self._marks[(touched & (self.building.kind == Kind.DOOR)).ravel()]
        for mark in sorted(set(doors.tolist()) - burnt):
            burnt.add(mark)
            self.events.append(DoorBurnt(self.world.time, landmark=mark))

    # -- SETTLE ---------------------------------------------------------------------

    def settle(self, touched: Touched) -> None:
        """Settle deaths, triggers and stairs; set who thinks in the next tick [B4]."""
        bodies = self.world.bodies
        dead = np.flatnonzero((bodies.health <= paper.NO_HEALTH) & bodies.inside)
        for i in dead.tolist():
            bodies.health[i] = 0.0
            self._leave(i, Fate.DEAD)
            died = Died(self.world.time, person=i, floor=int(bodies.floor[i]))
            self.events.append(died)

        self.due[:] = self.turn == self.ticks % paper.RECONSIDER_TICKS
        for i, before in touched:
            if bodies.fate[i] == Fate.INSIDE:
                self._touch(i, before, int(self._marks[bodies.place[i]]))

        landing = np.flatnonzero(bodies.stairs_until <= self.world.time)
        for i in landing.tolist():
            passed = walking.descend(self.world, i)
            if passed is not None:
                self._record_floor_left(i, passed)
            self.due[i] = bodies.walking[i]

    def _touch(self, i: int, before: int, mark: int) -> None:
        """Fire the trigger of the door, entrance or exit that a body touches [A5]."""
        bodies = self.world.bodies
        landmark = self.building.landmarks[mark]
        if landmark.leads_out:
            self._record_floor_left(i, landmark.floor)
        if landmark.kind is Kind.EXIT:  # out: the loop ends [A4, Alg. 1:1, Alg. 2:1]
            self._leave(i, Fate.EVACUATED)
            evacuated = Evacuated(
                self.world.time,
                person=i,
                floor=landmark.floor,
                health=float(bodies.health[i]),
                landmark=mark,
            )
            self.events.append(evacuated)
        elif landmark.leads_out:
            walking.enter_stairs(self.world, i, mark)
        elif mark not in self.world.burnt:
            side = int(self._areas[before])
            beyond = self.navigation.place_beyond(int(bodies.place[i]), side)
            humans.pass_landmark(self.world.minds[i], mark, side, beyond)
            self.due[i] = True

    def _leave(self, i: int, fate: Fate) -> None:
        """Take a human out of the simulation."""
        bodies = self.world.bodies
        bodies.fate[i] = fate
        bodies.leader[i] = NOBODY
        bodies.landmark[i] = NOWHERE
        bodies.stairwell[i] = NOWHERE
        bodies.stairs_until[i] = inf

    def _record_floor_left(self, i: int, floor: int) -> None:
        health = float(self.world.bodies.health[i])
        left = LeftFloor(self.world.time, person=i, floor=floor, health=health)
        self.events.append(left)
