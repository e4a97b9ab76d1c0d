"""The environment as one of PettingZoo's, with gymnasium's spaces; an optional extra.

Clauses: none of its own.  For frameworks that ask for PettingZoo's classes; what is
learnt here needs neither.  It plays the same episodes as `Environment`, step by step.
"""

from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np

from reference.building import Building, load
from reference.game import environment
from reference.paper import Scenario
from reference.strategies import FireStrategy, RobotStrategy
from reference.workshop.pixels import picture

try:
    from gymnasium import spaces
    from pettingzoo import AECEnv, ParallelEnv
    from pettingzoo.utils import parallel_to_aec
except ImportError as missing:
    raise ImportError(
        f"{missing.name} is not installed, and reference.workshop.zoo needs it.\n"
        "hint: pip install 'fire-rescue-reference[pettingzoo]', or use "
        "reference.game.environment, which has the same methods."
    ) from missing


class ZooEnvironment(ParallelEnv[str, environment.Observation, np.ndarray]):
    """`Environment` behind PettingZoo's class; see there for what everything means."""

    metadata: ClassVar[dict[str, Any]] = {
        **environment.Environment.metadata,
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
        """building: also the name or the path of a floor file.

        Raises ValueError as `Environment` does, and FloorPlanError or OSError for a
        file.
        """
        here = load(building) if isinstance(building, str) else building
        self.environment = environment.Environment(here, scenario, robots, fire)
        self.render_mode = render_mode
        self.possible_agents = self.environment.possible_agents
        self.agents: list[str] = []
        self.observation_spaces = {
            agent: _dict(self.environment.observation_space(agent))
            for agent in self.possible_agents
        }
        self.action_spaces = {
            agent: _box(self.environment.action_space(agent))
            for agent in self.possible_agents
        }
        self.state_space = _box(self.environment.state_space)

    def observation_space(self, agent: str) -> spaces.Dict:
        """What an agent may observe; the same object each time."""
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> spaces.Box:
        """What an agent may do; the same object each time."""
        return self.action_spaces[agent]

    def reset(
        self, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, environment.Observation], dict[str, dict[str, float]]]:
        """A new episode; see `Environment.reset`."""
        result = self.environment.reset(seed, options)
        self.agents = self.environment.agents.copy()
        return result

    def step(self, actions: Mapping[str, Any]) -> environment.Returns:
        """One decision of all agents; see `Environment.step`."""
        result = self.environment.step(actions)
        self.agents = self.environment.agents.copy()
        return result

    def state(self) -> np.ndarray:
        """All that is going on; see `Environment.state`."""
        return self.environment.state()

    def render(self) -> np.ndarray:
        """(height, width, 3) uint8: all floors side by side, the first one left.

        Raises ValueError for a render_mode that is not "rgb_array".
        """
        if self.render_mode not in (None, "rgb_array"):
            raise ValueError(f"no render_mode {self.render_mode!r}; there is rgb_array")
        return picture(self.environment.simulation.world)

    def close(self) -> None:
        """Nothing is open."""


def parallel_env(*args: Any, **kwargs: Any) -> ZooEnvironment:
    """What PettingZoo's modules call their parallel environment."""
    return ZooEnvironment(*args, **kwargs)


def env(*args: Any, **kwargs: Any) -> AECEnv:
    """The same with agents that act in turn, for who needs that."""
    return parallel_to_aec(ZooEnvironment(*args, **kwargs))


def _box(box: environment.Box) -> spaces.Box:
    return spaces.Box(box.low, box.high, dtype=np.float32)


def _dict(named: environment.Dict) -> spaces.Dict:
    return spaces.Dict({name: _box(space) for name, space in named.spaces.items()})
