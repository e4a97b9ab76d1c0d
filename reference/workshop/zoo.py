"""The environment as a PettingZoo one with gymnasium's spaces; an optional extra.

Clauses: none of its own.  It plays the same episodes as `Environment`, step by step,
and adds what frameworks ask for: spaces, pictures, and infos.
"""

from collections.abc import Callable, Mapping
from functools import cached_property
from typing import Any, ClassVar

import numpy as np

from reference.building import Building
from reference.game import observations
from reference.game.environment import (
    Environment,
    Observation,
    Returns,
    action_size,
)
from reference.paper import Scenario
from reference.strategies import FireStrategy, RobotStrategy
from reference.workshop.drawing.evacuation import TRAIL, Scene, tally
from reference.workshop.drawing.film import painter, scene_of
from reference.workshop.maps import load

try:
    from gymnasium import spaces
    from pettingzoo import AECEnv, ParallelEnv
    from pettingzoo.utils import parallel_to_aec
except ImportError as missing:
    raise ImportError(
        f"{missing.name} is not installed, and reference.workshop.zoo needs it.\n"
        "hint: pip install pettingzoo gymnasium, or use "
        "reference.game.environment, which has the same methods."
    ) from missing


SO_FAR = ("evacuated", "died", "inside", "reward", "simulated_seconds")


class ZooEnvironment(ParallelEnv[str, Observation, np.ndarray]):
    """Wrap `Environment`, which documents everything, in PettingZoo's class.

    Infos also hold the outcome so far: the fields SO_FAR of `Outcome`.
    """

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
        robots: RobotStrategy | None = None,
        fire: FireStrategy | None = None,
        render_mode: str | None = None,
    ):
        """building: a `Building`, or the name or path of a floor file.

        Raises ValueError as `Environment` does, and MistakesError or OSError for a
        file.
        """
        here = load(building) if isinstance(building, str) else building
        self.environment = Environment(here, scenario, robots, fire)
        self.render_mode = render_mode
        self.possible_agents = self.environment.possible_agents
        self.agents: list[str] = []
        self._history = [tally(self.environment.simulation.world)]
        self.observation_spaces = {a: self._observed(a) for a in self.possible_agents}
        self.action_spaces = {
            a: spaces.Box(-1, 1, (action_size(a),)) for a in self.possible_agents
        }

    def _observed(self, agent: str) -> spaces.Dict:
        building, scenario = self.environment.building, self.environment.scenario
        numbers = observations.vector_layout(building, scenario)
        vector = spaces.Box(numbers.low, numbers.high)
        grid = spaces.Box(0, 1, observations.grid_shape(building))
        return spaces.Dict({"vector": vector, "grid": grid})

    def observation_space(self, agent: str) -> spaces.Dict:
        """Look up an agent's observations; the same object each time."""
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> spaces.Box:
        """Look up an agent's actions; the same object each time."""
        return self.action_spaces[agent]

    def reset(
        self, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Observation], dict[str, dict[str, float]]]:
        """Begin a new episode; see `Environment.reset`."""
        seen, infos = self.environment.reset(seed, options)
        self._history.clear()
        return seen, self._with_outcome(infos)

    def step(self, actions: Mapping[str, Any]) -> Returns:
        """Take one decision of all agents; see `Environment.step`."""
        seen, rewards, ended, cut, infos = self.environment.step(actions)
        return seen, rewards, ended, cut, self._with_outcome(infos)

    def _with_outcome(
        self, infos: dict[str, dict[str, float]]
    ) -> dict[str, dict[str, float]]:
        self.agents = self.environment.agents.copy()
        simulation = self.environment.simulation
        self._history.append(tally(simulation.world))
        outcome = simulation.outcome()
        so_far = {name: float(getattr(outcome, name)) for name in SO_FAR}
        return {agent: info | so_far for agent, info in infos.items()}

    def render(self) -> np.ndarray:
        """Draw the picture of a film's frame: (height, width, 3) uint8.

        Raises ValueError for a render_mode that is not "rgb_array".
        """
        if self.render_mode not in (None, "rgb_array"):
            raise ValueError(f"no render_mode {self.render_mode!r}; there is rgb_array")
        scene, paint = self._film
        scene.show(self.environment.simulation.world, self._history)
        return paint()[..., :3].copy()

    @cached_property
    def _film(self) -> tuple[Scene, Callable[[], np.ndarray]]:
        simulation = self.environment.simulation
        scene = scene_of([simulation], without={TRAIL})  # decisions are seconds apart
        return scene, painter(scene)


parallel_env = ZooEnvironment  # as PettingZoo's modules call it


def env(*args: Any, **kwargs: Any) -> AECEnv:
    """Make the environment with agents that act in turn."""
    return parallel_to_aec(ZooEnvironment(*args, **kwargs))
