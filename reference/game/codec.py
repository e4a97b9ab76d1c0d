"""Encode what a side observes for its network, and decode the network's actions.

Both are as in the paper, but for the fire's numbers, which are scaled [E4, deviation].
Decoded actions are decisions in metres, float64; only `Environment.step` takes actions
from the box [-1, 1].  Here and in `learning`, a file
beside E3, such as torch/utils.py, is one of ML-Agents' package `mlagents.trainers`.

    S    moments;  G  agents of a side: all robots, or one fire
    V    numbers a network reads;  K  of its action;  A  of a decision: x, y in metres,
         the fire's with the floor before them
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from reference.building import Building
from reference.game.observations import (
    fire_vectors,
    from_normalised,
    grid,
    grid_shape,
    robot_vectors,
    vector_layout,
)
from reference.paper import Scenario
from reference.world import World

AXES = 2  # [C5] [D2] continuous numbers: x and y
RAW_LIMIT = 3.0  # [E3, torch/agent_action.py] raw actions are clipped to ±3, then / 3


@dataclass(frozen=True)
class Moment:
    """What a side decides from, at one step of one episode."""

    vectors: np.ndarray  # (G, V) float32, what each agent observed last
    alive: np.ndarray  # (G,) bool, whose action is read now
    world: World  # networks read the grid from it
    rng: np.random.Generator | None = None  # for sampling; None: mean or likeliest


@dataclass(frozen=True)
class Sizes:
    """Shapes of a network's inputs and outputs."""

    vector: int  # V
    grid: tuple[int, int, int]  # channels, height, width
    continuous: int  # Gaussian components
    branches: tuple[int, ...] = ()  # options of each discrete branch


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

    def observe(self, worlds: Sequence[World]) -> np.ndarray:
        """(S, G, V) float32, what each agent of the side observes in S worlds."""
        if self.side == "fire":
            return fire_vectors(worlds, self.layout)
        return robot_vectors(worlds, self.layout)

    def read(self, moments: Sequence[Moment]) -> np.ndarray:
        """(S, G, V) float32, what a network reads at S moments.

        The fire's numbers are scaled, which Table II does not do: metres and seconds as
        they are do not train [E4, deviation].
        """
        vectors = np.stack([moment.vectors for moment in moments])
        if self.side == "fire":
            return self.layout.scaled(vectors)
        return vectors

    def grids(self, moments: Sequence[Moment]) -> np.ndarray:
        """(S, channels, height, width) uint8, the grids of all agents [C4]."""
        return np.stack([grid(moment.world) for moment in moments])

    def actions(self, raw: np.ndarray, moments: Sequence[Moment]) -> np.ndarray:
        """Decisions (S, G, A) of a network's actions (S, G, K).

        x and y are clamp(a, -3, 3) / 3, where ±1 are the edges of the main body. The
        fire's floor, a branch, is last in its action and first in its decision.

        moments: for codecs that decide from where a robot stands; not read here
        """
        axes = raw[..., :AXES].astype(np.float64)
        axes = axes.clip(-RAW_LIMIT, RAW_LIMIT) / RAW_LIMIT
        metres = from_normalised(self.building, axes)
        if self.side == "robots":
            return metres
        return np.concatenate([raw[..., AXES:], metres], axis=-1)


def decision_in(row: np.ndarray) -> Any:
    """Read a decision, (A,): x, y of a robot, None for nan; floor, x, y of the fire."""
    if np.isnan(row).all():
        return None
    if len(row) == AXES:
        x, y = row.tolist()
        return x, y
    floor, x, y = row.tolist()
    return int(floor), x, y
