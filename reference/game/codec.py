"""Encode what a side observes for its network, and decode the network's actions.

Here both are as in the paper; subclasses in `workshop.anchors` do it otherwise.  The
environment's actions are coordinates of the whole floor, in [-1, 1].

    G    agents of a side;  R  robots, the fire's G is 1
    V    numbers a network reads;  K  of its action;  A  of the environment's action
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from reference.building import Building
from reference.game.observations import grid_shape, vector_layout
from reference.paper import Scenario
from reference.world import World

AXES = 2  # [C5] [D2] continuous numbers: x and y
RAW_LIMIT = 3.0  # [E3, torch/action_model.py] a raw action is clipped, then divided


@dataclass(frozen=True)
class Moment:
    """What a side decides from, at one step of one episode."""

    vectors: np.ndarray  # (G, V) float32, what each agent observed last
    alive: np.ndarray  # (G,) bool, who has not left
    world: World  # of it networks read the grid
    rng: np.random.Generator | None = None  # for sampling; None: mean or likeliest
    seed: int = 0  # of the episode


@dataclass(frozen=True)
class Sizes:
    """Shapes of a network's inputs and outputs."""

    vector: int  # V
    grid: tuple[int, int, int]  # channels, height, width
    continuous: int  # Gaussian components
    branches: tuple[int, ...] = ()  # options of each discrete branch
    head: Callable[[int], Any] | None = None  # given H, another than the paper's


class PolicyCodec:
    """Encode observations for one side's network, and decode its actions."""

    def __init__(self, side: str, building: Building, scenario: Scenario):
        self.side = side
        self.building = building
        self.scenario = scenario
        self.layout = vector_layout(building, scenario)

    @property
    def sizes(self) -> Sizes:
        """Shapes of what goes in [C1] [C3] [D1] and of what comes out [C5] [D2]."""
        return Sizes(
            vector=self.layout.size,
            grid=grid_shape(self.building),
            continuous=AXES,
            branches=(self.building.floors,) if self.side == "fire" else (),
        )

    def read(self, moments: Sequence[Moment]) -> np.ndarray:
        """(S, G, V) float32, what a network reads at S moments.

        The fire's numbers are scaled; Table II does not scale them [E4, deviation].
        """
        vectors = np.stack([moment.vectors for moment in moments])
        if self.side == "fire":
            return self.layout.scaled(vectors)
        return vectors

    def actions(self, raw: np.ndarray, moments: Sequence[Moment]) -> np.ndarray:
        """The environment's actions (S, G, A) in [-1, 1] of a network's (S, G, K).

        clamp(a, -3, 3)/3; the fire's floor, a branch, comes first.
        """
        axes = raw[..., :AXES].clip(-RAW_LIMIT, RAW_LIMIT) / RAW_LIMIT
        if self.side == "robots":
            return axes
        floor = (2 * raw[..., AXES:] + 1) / self.building.floors - 1
        return np.concatenate([floor, axes], axis=-1)
