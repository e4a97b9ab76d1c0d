"""The environment for others' learners: PettingZoo's class, gymnasium's spaces.

It needs the extra `pettingzoo`; episodes are those of `Environment`, whose methods are
the same.

Agents.  "robot_0", "robot_1", ... are a team with one reward; "fire_0". A side that a
strategy plays is not among them: `robots=` or `fire=`, by a name that `evacuate` knows
or as an object with `decide`. With `fire="random"` robots alone are agents.

Who acts when [D2].  A step is one decision of the robots, 5 s. The fire's action is
read at every k-th step while it has sources left: its info `acts` is 1 if the next one
is read, and else 0. A robot whose floor and all above it are empty leaves: it is
terminated. In the end the others are terminated if nobody is inside any more, truncated
if time is up.

Observations [C1] [C3] [D1].  "vector", 167 numbers for the paper's building (people,
robots, fire sources as x and y in metres and storey; seconds; see
`observations.vector_layout`), and "grid", 0 or 1, (channels, rows, columns): walls,
fires, exits of each floor.

Actions [C5].  A robot's: x and y of its next destination, the main body of the building
is [-1, 1] x [-1, 1]; all nan keeps the old one. The fire's: a floor (equal shares of
[-1, 1]), x and y.

Rewards [E5].  In health points, 100 to a person. The robots': the health of each person
who leaves a floor alive, 100 more at an exit, -300 for a death. The fire's: what the
robots lose, less 10 for a place that is refused.

Infos.  `acts`, and the outcome so far: the fields SO_FAR of `Outcome`. Those of `reset`
tell how the episode before it ended, 0 for none. The reason: SuperSuit begins the next
episode by itself, and lays the infos of `reset` over those of the last step; TorchRL
refuses a key in `step` that was not in `reset`.

Seeds.  `reset(seed)` repeats an episode; later ones without a seed follow from it. One
that was never reset begins by chance, and so does each copy of it. So copy before the
first `reset`: copies made later all play the same episodes.

`state()` is the vector from nobody's point of view, for a central critic. `flat=True`
makes what common wrappers and learners expect, see `FlatEnvironment`. For agents that
act in turn there is PettingZoo's `parallel_to_aec`.

Speed.  With numba the engine plays from one decision to the next; without it, or where
a rule of the book has changed, the book does, to the same end, several times slower.
The first step compiles the engine, once.

Others' wrappers.  TorchRL 0.14: `PettingZooWrapper` ends an episode when the first
robot leaves, unless it is called with `use_mask=True, done_on_any=False`; its
`set_seed` spends the seed, so that the reset after it plays another episode.
SuperSuit 3.11: with `num_cpus` above 1 and several environments on each,
`concat_vec_envs_v1` hands the same seeds out more than once; with `num_cpus=1` all
differ. Its environments have no `seed`, which stable-baselines3 asks for.
"""

from collections.abc import Callable, Mapping
from functools import cached_property
from secrets import randbits
from typing import Any, ClassVar

import numpy as np
from gymnasium import spaces
from pettingzoo import ParallelEnv

from reference import paper
from reference.building import Building
from reference.fire import FireStrategy
from reference.game import observations
from reference.game.environment import (
    Environment,
    Infos,
    Observations,
    action_size,
)
from reference.paper import Scenario, check_seed
from reference.robots import RobotStrategy
from reference.workshop.comparing.named import strategy_of
from reference.workshop.drawing.evacuation import Scene, tally
from reference.workshop.drawing.film import painter
from reference.workshop.engine import run_to_decision
from reference.workshop.maps import load
from reference.workshop.strategies.trained import flat_vectors

SO_FAR = ("evacuated", "died", "inside", "reward", "simulated_seconds")

ZooStep = tuple[
    dict[str, Any], dict[str, float], dict[str, bool], dict[str, bool], Infos
]
"""What `step` gives, as `StepResult`, with observations in an agent's space."""


class ZooEnvironment(ParallelEnv[str, Any, np.ndarray]):
    """Wrap `Environment` in PettingZoo's class; this module says what is what."""

    metadata: ClassVar[dict[str, Any]] = {
        "name": "fire_rescue_v0",
        "is_parallelizable": True,
        "render_modes": ["rgb_array"],
        "render_fps": 4,
    }

    def __init__(
        self,
        building: Building | str = "paper",
        scenario: Scenario | None = None,
        robots: RobotStrategy | str | None = None,
        fire: FireStrategy | str | None = None,
        render_mode: str | None = None,
    ):
        """building: a `Building`, or the name or path of a floor file.

        robots, fire: who plays this side, by name or as a strategy; None: agents.

        Raises ValueError as `Environment` does, for an unknown name or render mode and
        for a policy that learned elsewhere, MistakesError or OSError for a file.
        """
        modes = self.metadata["render_modes"]
        if render_mode not in (None, *modes):
            raise ValueError(f"render_mode={render_mode!r}: there is None, {modes}")
        here = load(building) if isinstance(building, str) else building
        self.scenario = Scenario() if scenario is None else scenario
        self.render_mode = render_mode
        self.environment = Environment(
            here,
            self.scenario,
            robots=strategy_of(robots, "robots", here, self.scenario),
            fire=strategy_of(fire, "fire", here, self.scenario),
            advance=run_to_decision,
        )
        self.agents = list[str]()  # before the first episode
        self._begun = False
        self.np_random = np.random.default_rng()  # for others' wrappers
        self._so_far = dict.fromkeys(SO_FAR, 0.0)
        self.possible_agents = self.environment.possible_agents
        self._history = [tally(self.environment.simulation.world)]

        self.layout = observations.vector_layout(here, self.scenario)
        vector = spaces.Box(self.layout.low, self.layout.high)
        grid = spaces.Box(0, 1, observations.grid_shape(here))
        self.state_space: spaces.Space = vector
        self._observed: spaces.Space = spaces.Dict({"vector": vector, "grid": grid})
        self._actions = {
            agent: spaces.Box(-1, 1, (action_size(agent),))
            for agent in self.possible_agents
        }

    def observation_space(self, agent: str) -> spaces.Space:
        """Look up an agent's observations; the same object each time."""
        return self._observed

    def action_space(self, agent: str) -> spaces.Box:
        """Look up an agent's actions; the same object each time."""
        return self._actions[agent]

    def reset(
        self, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Any], Infos]:
        """Begin a new episode; see `Environment.reset`. There are no options.

        Raises ValueError for what is no seed.
        """
        if seed is not None:
            check_seed(seed)
            seed = int(seed)
        elif not self._begun:  # drawn as late as this, so that copies differ
            seed = randbits(32)
        if seed is not None:
            self.np_random = np.random.default_rng([seed, 1])
        seen, infos = self.environment.reset(seed)
        self._begun = True
        self._history.clear()
        return self._seen(seen), self._with_outcome(infos)

    def _seen(self, seen: Observations) -> dict[str, Any]:
        return seen

    def step(self, actions: Mapping[str, Any]) -> ZooStep:
        """Take one decision of all agents; see `Environment.step`."""
        seen, rewards, ended, cut, infos = self.environment.step(actions)
        outcome = self.environment.simulation.outcome()
        self._so_far = {name: float(getattr(outcome, name)) for name in SO_FAR}
        return self._seen(seen), rewards, ended, cut, self._with_outcome(infos)

    def _with_outcome(self, infos: Infos) -> Infos:
        self.agents = self.environment.agents.copy()
        self._history.append(tally(self.environment.simulation.world))
        return {agent: info | self._so_far for agent, info in infos.items()}

    def state(self) -> np.ndarray:
        """(V,) float32: everything, from nobody's point of view, now."""
        world = self.environment.simulation.world
        ((vector,),) = observations.fire_vectors([world], self.layout)
        return vector

    def render(self) -> np.ndarray:
        """Draw the picture of a film's frame: (height, width, 3) uint8."""
        scene, paint = self._film  # made once: the background does not change
        scene.show(self.environment.simulation.world, self._history)
        return paint()[..., :3].copy()

    @cached_property
    def _film(self) -> tuple[Scene, Callable[[], np.ndarray]]:
        simulation = self.environment.simulation
        scene = Scene(simulation.building, len(simulation.world.bodies))
        return scene, painter(scene)

    def __getstate__(self) -> dict[str, Any]:
        """Leave the page of pictures behind, when it is copied to another process."""
        return {name: value for name, value in vars(self).items() if name != "_film"}


class FlatEnvironment(ZooEnvironment):
    """One box of numbers in [-1, 1]; every agent stays to the end of the episode.

    Observations are the scaled vector without the grid; rewards are shares of the
    health with which all people begin. An agent that has left observes zeros at once
    and is paid nothing more; all end together. Where all agents must be alike, a
    strategy plays one side, as `fire="random"`.
    """

    def __init__(self, *args: Any, **chosen: Any):
        """What `ZooEnvironment` takes."""
        super().__init__(*args, **chosen)
        self.unit = paper.HEALTH * max(len(self.environment.simulation.world.bodies), 1)
        self.state_space = spaces.Box(-1, 1, (self.layout.size,))
        self._observed = self.state_space

    def step(self, actions: Mapping[str, Any]) -> ZooStep:
        """Take one decision of all agents; see `Environment.step`."""
        if not self.agents:  # over, or not begun
            _, rewards, ended, cut, infos = super().step({})
            return {}, rewards, ended, cut, infos
        seen, paid, ended, cut, told = super().step(actions)
        seen |= {agent: np.zeros_like(seen[agent]) for agent in ended if ended[agent]}
        everybody = self.possible_agents
        over = not self.agents
        late = over and any(cut.values())
        self.agents = [] if over else everybody.copy()

        # who has left is paid nothing and told how it stands
        gone = next(iter(told.values())) | {"acts": 0.0}
        rewards = {agent: paid.get(agent, 0.0) / self.unit for agent in everybody}
        infos = {agent: told.get(agent, gone) for agent in everybody}
        terminated = dict.fromkeys(everybody, over and not late)
        truncated = dict.fromkeys(everybody, late)
        return seen, rewards, terminated, truncated, infos

    def _seen(self, seen: Observations) -> dict[str, Any]:
        gone = np.zeros(self.layout.size, dtype=np.float32)
        there = {
            agent: flat_vectors(self.layout, each["vector"])
            for agent, each in seen.items()
        }
        return {agent: there.get(agent, gone) for agent in self.possible_agents}

    def state(self) -> np.ndarray:
        """(V,) float32 in [-1, 1]: everything, from nobody's point of view, now."""
        return flat_vectors(self.layout, super().state())


def parallel_env(*args: Any, flat: bool = False, **chosen: Any) -> ZooEnvironment:
    """Make an environment of these; arguments are those of `ZooEnvironment`."""
    kind = FlatEnvironment if flat else ZooEnvironment
    return kind(*args, **chosen)
