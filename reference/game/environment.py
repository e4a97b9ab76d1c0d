"""The game that is learnt: PettingZoo's parallel API, robots and the fire as agents.

Clauses: C1, C4, C5, C7, C8, D1, D2, D6, E5.  It needs no PettingZoo; `zoo` makes it one
of its environments for whoever has it.

    step      one decision of the robots, 5 s; the fire's action is read at every k-th
    agents    "robot_0", ..., "fire_0"; a side that a strategy plays is not among them
    spot      x, y in normalised metres: the main body is [-1, 1] x [-1, 1]

All agents are there after a reset.  A robot leaves when its floor and all above it are
empty [C8].  In the end all who are still there are terminated if nobody is inside any
more, and truncated if time is up.
"""

from collections.abc import Mapping, Sequence
from copy import deepcopy
from typing import Any, ClassVar

import numpy as np

from reference.building import Building
from reference.events import Died, Evacuated, Event, FireRefused
from reference.fire import Decision
from reference.game import observations
from reference.game.rewards import fire_reward, group_reward
from reference.paper import Scenario
from reference.robots import Destination
from reference.simulation import Simulation, fire_acts
from reference.strategies import FireStrategy, RobotStrategy
from reference.world import Robot, World

FIRE = "fire_0"
ROBOT_NUMBERS, FIRE_NUMBERS = 2, 3  # [C5] x, y;  [D2] floor, x, y

DECIMALS = 4
"""[C5, chosen] of metres: so that in float32 an agent can say exactly what a strategy
says, such as the middle of a door between two cells."""

Observation = dict[str, np.ndarray]
Returns = tuple[
    dict[str, Observation],
    dict[str, float],
    dict[str, bool],
    dict[str, bool],
    dict[str, dict[str, float]],
]
"""Observations, rewards, terminations, truncations and infos, by agent."""


# -- Spaces -------------------------------------------------------------------------


class Box:
    """Arrays of float32 between two bounds, as gymnasium's space of this name.

    low, high: arrays of the space's shape
    """

    def __init__(self, low: np.ndarray, high: np.ndarray):
        self.low = np.asarray(low, dtype=np.float32)
        self.high = np.asarray(high, dtype=np.float32)
        self.shape, self.dtype = self.low.shape, self.low.dtype
        self._rng = np.random.default_rng()

    def seed(self, seed: int | None = None) -> None:
        """Samples from now on follow from the seed."""
        self._rng = np.random.default_rng(seed)

    def sample(self) -> np.ndarray:
        """Uniform between the bounds."""
        return np.asarray(self._rng.uniform(self.low, self.high), dtype=self.dtype)

    def contains(self, x: np.ndarray) -> bool:
        """Is it an array of this shape and type, between the bounds?"""
        fits = x.shape == self.shape and x.dtype == self.dtype
        return bool(fits and (self.low <= x).all() and (x <= self.high).all())

    __contains__ = contains


class Dict:
    """Named spaces, as gymnasium's space of this name."""

    def __init__(self, spaces: dict[str, Box]):
        self.spaces = spaces

    def __getitem__(self, name: str) -> Box:
        return self.spaces[name]

    def seed(self, seed: int | None = None) -> None:
        """Samples of all of them from now on follow from the seed."""
        for space in self.spaces.values():
            space.seed(seed)

    def sample(self) -> Observation:
        """One sample of each."""
        return {name: space.sample() for name, space in self.spaces.items()}

    def contains(self, x: Mapping[str, np.ndarray]) -> bool:
        """Are these the names, and is what they name in its space?"""
        return x.keys() == self.spaces.keys() and all(
            space.contains(x[name]) for name, space in self.spaces.items()
        )

    __contains__ = contains


# -- What agents say, as strategies -------------------------------------------------


class SpokenRobots:
    """Robots that go where their agents have said; said: destinations by body."""

    def __init__(self) -> None:
        self.said: dict[int, Destination | None] = {}

    def decide(
        self, world: World, robots: Sequence[Robot], rng: np.random.Generator
    ) -> list[Destination | None]:
        """What was said last."""
        return [self.said.get(robot.body) for robot in robots]


class SpokenFire:
    """A fire that breaks out where its agent has said."""

    def __init__(self) -> None:
        self.said: Decision | None = None

    def decide(self, world: World, rng: np.random.Generator) -> Decision | None:
        """What was said last."""
        return self.said


def destination(building: Building, action: np.ndarray) -> Destination | None:
    """A robot's action, (2,) a spot, in metres [C5]; all nan: keep the old one."""
    return None if np.isnan(action).all() else _metres(building, action)


def fire_decision(building: Building, action: np.ndarray) -> Decision:
    """The fire's action, (3,) a floor and a spot, in storeys and metres [D2].

    The floor is the share of [-1, 1] that the first number is in, from below.
    """
    share = (float(action[0].clip(-1, 1)) + 1) / 2
    floor = min(int(share * building.floors), building.floors - 1)
    return floor, *_metres(building, action[1:])


def _metres(building: Building, spot: np.ndarray) -> tuple[float, float]:
    """A spot of the main body in metres, to so many DECIMALS."""
    metres = observations.from_normalised(building, spot.clip(-1, 1))
    x, y = metres.astype(np.float64).round(DECIMALS).tolist()
    return x, y


# -- The environment ----------------------------------------------------------------


class Environment:
    """One building and one scenario, episode after episode.

    simulation  what runs underneath;  decision  decisions taken in this episode
    agents      who acts at the next step, of possible_agents

    An observation has a "vector", as in `observations.layout` or `.fire_layout`, and
    the "grid", both float32.  An action is float32 in [-1, 1], cut off there: a robot's
    is (2,) a spot, or all nan to keep the old destination; the fire's is (3,) a floor
    and a spot.  Robots are paid the group's reward, the fire its own [E5] [D6].

    Infos are floats: `acts`, 1 if the agent's next action is read and else 0; and of
    the episode so far `people_inside`, `evacuated`, `died`, `refused` (fires),
    `sources`, `group_reward`, `fire_reward` and `seconds`.
    """

    metadata: ClassVar[dict[str, Any]] = {
        "name": "fire_rescue_v0",
        "is_parallelizable": True,
    }

    def __init__(
        self,
        building: Building,
        scenario: Scenario | None = None,
        robots: RobotStrategy | None = None,
        fire: FireStrategy | None = None,
    ):
        """robots, fire: None for agents, or the strategy that plays this side.

        Raises ValueError for an unknown strategy, for more people than fit, and if
        there is nobody to act.
        """
        self.building = building
        self._asked = scenario or Scenario()
        self._robots, self._fire = robots, fire
        self._begin(seed=0)
        count = len(self.simulation.world.robots) if robots is None else 0
        self._robot_agents = [f"robot_{k}" for k in range(count)]
        self.possible_agents = self._robot_agents + [FIRE] * (fire is None)
        if not self.possible_agents:
            raise ValueError("nobody acts: leave the robots or the fire to an agent")
        self._observation_spaces = self._spaces_to_observe()
        self._action_spaces = {a: _action_box(a) for a in self.possible_agents}
        self.state_space = Box(*observations.state_limits(building, self.scenario))
        self.agents: list[str] = []
        self._seeds: np.random.Generator | None = None

    @property
    def unwrapped(self) -> "Environment":
        """Itself."""
        return self

    @property
    def num_agents(self) -> int:
        """How many agents act at the next step."""
        return len(self.agents)

    @property
    def max_num_agents(self) -> int:
        """How many agents there are at most."""
        return len(self.possible_agents)

    @property
    def scenario(self) -> Scenario:
        """What is played; without robots if "none" play them."""
        return self.simulation.scenario

    def observation_space(self, agent: str) -> Dict:
        """What an agent may observe; the same object each time."""
        return self._observation_spaces[agent]

    def action_space(self, agent: str) -> Box:
        """What an agent may do; the same object each time."""
        return self._action_spaces[agent]

    def reset(
        self, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Observation], dict[str, dict[str, float]]]:
        """A new episode: observations and infos. The same seed, the same episode.

        Without a seed the next one follows from the last that was given, or from
        nothing. There are no options. Raises ValueError for a negative seed.
        """
        if seed is not None and seed < 0:
            raise ValueError(f"a seed is 0 or more, not {seed}")
        if seed is not None or self._seeds is None:
            self._seeds = np.random.default_rng(seed)
        self._begin(int(self._seeds.integers(2**32)) if seed is None else seed)
        self.agents = self.possible_agents.copy()
        return self._observed(self.agents), self._infos(self.agents)

    def step(self, actions: Mapping[str, Any]) -> Returns:
        """One decision of all agents, and what becomes of it until the next one.

        Actions of agents that have left are ignored. Raises ValueError, which names
        the agent, for an action that is missing or is none, and RuntimeError before
        the first reset.
        """
        if self._seeds is None:
            raise RuntimeError("call reset() before step()")
        there = self.agents
        if not there:
            return {}, {}, {}, {}, {}
        self._take(actions)
        events = self._until_next_decision()
        self.decision += 1
        terminations, truncations = self._ends(there)
        self.agents = [a for a in there if not (terminations[a] or truncations[a])]
        return (
            self._observed(there),
            self._rewards(there, events),
            terminations,
            truncations,
            self._infos(there),
        )

    def state(self) -> np.ndarray:
        """(S,) float32, all that is going on; see `observations.state`."""
        return observations.state(self.simulation.world, self.scenario)

    def close(self) -> None:
        """Nothing is open."""

    # -- Inside ---------------------------------------------------------------------

    def _begin(self, seed: int) -> None:
        """A new simulation; what agents play listens to them."""
        self._spoken_robots, self._spoken_fire = SpokenRobots(), SpokenFire()
        self.simulation = Simulation(
            self.building,
            self._asked,
            self._spoken_robots if self._robots is None else deepcopy(self._robots),
            self._spoken_fire if self._fire is None else deepcopy(self._fire),
            seed,
        )
        self.decision = 0

    def _spaces_to_observe(self) -> dict[str, Dict]:
        robot = observations.limits(self.building, self.scenario)
        fire = observations.fire_limits(self.building, self.scenario)
        grid = np.zeros(observations.grid_shape(self.building))
        return {
            agent: Dict(
                {
                    "vector": Box(*(fire if agent == FIRE else robot)),
                    "grid": Box(grid, grid + 1),
                }
            )
            for agent in self.possible_agents
        }

    def _take(self, actions: Mapping[str, Any]) -> None:
        """Tell the strategies what the agents want."""
        for agent in actions.keys() - set(self.possible_agents):
            raise ValueError(f"there is no agent {agent!r}")
        robots = self.simulation.world.robots
        for agent in self.agents:
            if agent not in actions:
                raise ValueError(f"{agent} is still there, but has no action")
            action = _checked(agent, actions[agent])
            if agent == FIRE:
                self._spoken_fire.said = fire_decision(self.building, action)
            else:
                body = robots[self._robot_agents.index(agent)].body
                self._spoken_robots.said[body] = destination(self.building, action)

    def _until_next_decision(self) -> list[Event]:
        """Tick by tick, or until it is done; what happened."""
        events: list[Event] = []
        for _ in range(self.simulation.decision_ticks):
            if not self.simulation.done:
                events += self.simulation.step()
        return events

    def _ends(self, agents: list[str]) -> tuple[dict[str, bool], dict[str, bool]]:
        """Who is terminated and who is truncated [C8]."""
        done, inside = self.simulation.done, any(self.simulation.world.occupancy)
        if done:
            ends = not inside, inside
            return dict.fromkeys(agents, ends[0]), dict.fromkeys(agents, ends[1])
        at_work = self._at_work()
        return {a: not at_work[a] for a in agents}, dict.fromkeys(agents, False)

    def _at_work(self) -> dict[str, bool]:
        """Has an agent something to do? The fire has, as long as there are people."""
        at_work = {FIRE: True}
        if self._robot_agents:
            robots = observations.robots_at_work(self.simulation.world).tolist()
            at_work |= zip(self._robot_agents, robots, strict=True)
        return at_work

    def _observed(self, agents: list[str]) -> dict[str, Observation]:
        """Fresh arrays in fresh dicts."""
        world, scenario = self.simulation.world, self.scenario
        vectors = {FIRE: observations.fire_vector(world, scenario)}
        if self._robot_agents:
            rows = observations.robot_vectors(world, scenario)
            vectors |= zip(self._robot_agents, rows, strict=True)
        grid = observations.grid(world)
        return {
            agent: {"vector": vectors[agent], "grid": grid.astype(np.float32)}
            for agent in agents
        }

    def _rewards(self, agents: list[str], events: list[Event]) -> dict[str, float]:
        """The robots' as a group [E5], the fire's own [D6]."""
        of_group, of_fire = group_reward(events), fire_reward(events)
        return {agent: of_fire if agent == FIRE else of_group for agent in agents}

    def _infos(self, agents: list[str]) -> dict[str, dict[str, float]]:
        now, at_work, done = self._so_far(), self._at_work(), self.simulation.done
        acts = {agent: at_work[agent] and not done for agent in agents}
        if FIRE in acts:
            left = now["sources"] < self.scenario.sources
            acts[FIRE] = acts[FIRE] and left and fire_acts(self.decision)
        return {agent: {"acts": float(acts[agent]), **now} for agent in agents}

    def _so_far(self) -> dict[str, float]:
        """What has become of the episode by now."""
        world, events = self.simulation.world, self.simulation.events
        return {
            "people_inside": float(sum(world.occupancy)),
            "evacuated": _count(events, Evacuated),
            "died": _count(events, Died),
            "refused": _count(events, FireRefused),
            "sources": float(len(world.flames.sources)),
            "group_reward": group_reward(events),
            "fire_reward": fire_reward(events),
            "seconds": world.time,
        }


def _count(events: list[Event], kind: type[Event]) -> float:
    return float(sum(isinstance(event, kind) for event in events))


def _action_box(agent: str) -> Box:
    ones = np.ones(FIRE_NUMBERS if agent == FIRE else ROBOT_NUMBERS)
    return Box(-ones, ones)


def _checked(agent: str, action: Any) -> np.ndarray:
    """An action as numbers. Raises ValueError, which names the agent."""
    size = FIRE_NUMBERS if agent == FIRE else ROBOT_NUMBERS
    wanted = f"{agent}: an action is {size} numbers from -1 to 1"
    try:
        numbers = np.asarray(action, dtype=np.float64)
    except (TypeError, ValueError):
        raise ValueError(f"{wanted}, not {action!r}") from None
    if numbers.shape != (size,):
        raise ValueError(f"{wanted}, not an array of shape {numbers.shape}")
    keep = agent != FIRE and np.isnan(numbers).all()
    if not (keep or np.isfinite(numbers).all()):
        raise ValueError(f"{wanted}, not {numbers.tolist()}")
    return numbers
