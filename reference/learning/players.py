"""Whoever plays one side by a network: from observations to actions, many at once.

Clauses: C5, D2, E3.  Both heads end in the environment's action, numbers in [−1, 1].

    S    episodes played at once;  G  agents of the side;  V, K, E, O, F  as in
         `networks`;  A  numbers of the environment's action
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from torch import Tensor

from reference.building import Building
from reference.game.observations import fire_layout, grid_shape, robot_layout
from reference.learning.networks import RAW_LIMIT, Actor, Options, Policy, Sizes
from reference.learning.settings import Side, TrainerSettings
from reference.paper import Scenario

Observation = tuple[np.ndarray, np.ndarray]
"""Vectors (G, V) and the grid (channels, height, width) that the agents share."""

Landmarks = Callable[[Building, Scenario], Any]
"""Makes, for a building, what turns observations into options of a pointer head."""

AXES = 2  # [C5] [D2] two continuous numbers: x and y


@dataclass(frozen=True)
class Acted:
    """What was done; arrays as in `Trajectory`, with S in the place of T.

    emitted  (S, G, A) float32, the environment's actions
    """

    emitted: np.ndarray
    actions: np.ndarray
    shown: np.ndarray
    log_probs: np.ndarray
    features: np.ndarray | None
    action_mask: np.ndarray | None


class Player:
    """One side's actor, with the map its options are on."""

    def __init__(
        self,
        side: Side,
        building: Building,
        scenario: Scenario,
        settings: TrainerSettings,
        landmarks: Landmarks | None = None,
    ):
        """landmarks: what makes a pointer head's options; None for the Gaussian one."""
        self.side, self.floors = side, building.floors
        self.options = landmarks and landmarks(building, scenario)
        self.sizes = _sizes(side, building, scenario, self.options)
        self.actor = Actor(self.sizes, settings).eval()

    def load(self, weights: dict[str, Any]) -> None:
        """Take over a learner's weights, tensors or arrays, by name.

        Raises RuntimeError for another shape.
        """
        tensors = {name: torch.as_tensor(array) for name, array in weights.items()}
        self.actor.load_state_dict(tensors)

    @torch.no_grad()
    def act(
        self,
        seen: Sequence[Observation],
        rngs: Sequence[np.random.Generator] | None = None,
    ) -> Acted:
        """Samples, each episode's from its own generator, or the mean actions."""
        vectors = torch.from_numpy(np.stack([vector for vector, _ in seen]))
        grids = torch.from_numpy(np.stack([grid for _, grid in seen]))
        places, options = self._choices(seen)
        policy = self.actor(vectors, grids, options)
        noise = None
        if rngs is not None:
            agents = vectors.shape[1]
            noise = torch.from_numpy(
                np.stack([_noise(rng, agents, policy) for rng in rngs])
            )
        actions = policy.act(noise)
        return self._acted(policy, actions, places, options)

    def _choices(
        self, seen: Sequence[Observation]
    ) -> tuple[np.ndarray | None, Options | None]:
        """Places (S, G, O, A) and options of a pointer head."""
        if self.options is None:
            return None, None
        found = [self.options(*observation) for observation in seen]
        features = torch.from_numpy(np.stack([f.features for f in found]))
        action_mask = torch.from_numpy(np.stack([f.action_mask for f in found]))
        return np.stack([f.places for f in found]), Options(features, action_mask)

    def _acted(
        self,
        policy: Policy,
        actions: Tensor,
        places: np.ndarray | None,
        options: Options | None,
    ) -> Acted:
        log_probs = policy.log_probs(actions).numpy()
        raw = actions.numpy()
        if places is None or options is None:
            emitted = self._emitted(raw)
            return Acted(emitted, raw, raw[..., :AXES], log_probs, None, None)
        index = raw.astype(np.intp)[..., None]
        emitted = np.take_along_axis(places, index, axis=2)[:, :, 0]
        features, action_mask = options.features.numpy(), options.action_mask.numpy()
        return Acted(emitted, raw, emitted, log_probs, features, action_mask)

    def _emitted(self, raw: np.ndarray) -> np.ndarray:
        """Gaussians: clamp(a, −3, 3)/3 [E3]; the fire's branch, its floor, first."""
        axes = raw[..., :AXES].clip(-RAW_LIMIT, RAW_LIMIT) / RAW_LIMIT
        if self.side == "robots":
            return axes
        floor = (2 * raw[..., AXES:] + 1) / self.floors - 1
        return np.concatenate([floor, axes], axis=-1)


def _sizes(
    side: Side,
    building: Building,
    scenario: Scenario,
    options: Any,
) -> Sizes:
    robots = side == "robots"
    layout = robot_layout if robots else fire_layout
    branches = () if robots else (building.floors,)
    emitted = AXES if robots else 1 + AXES
    return Sizes(
        vector=layout(building, scenario).size,
        grid=grid_shape(building),
        continuous=0 if options else AXES,
        branches=() if options else branches,
        features=options.features if options else 0,
        shown=emitted if options else AXES,
    )


def _noise(rng: np.random.Generator, agents: int, policy: Policy) -> np.ndarray:
    """(G, C + sum n): what `Policy.act` makes a sample from."""
    continuous = policy.gaussian.mean.shape[-1]
    counts = sum(branch.logits.shape[-1] for branch in policy.branches)
    normal = rng.standard_normal((agents, continuous), dtype=np.float32)
    gumbel = rng.gumbel(size=(agents, counts)).astype(np.float32)
    return np.concatenate([normal, gumbel], axis=1)
