"""Players: decide for one side of an episode, and record its decisions.

Clauses: C5, D2, E3, E4.  All heads emit the environment's action, numbers in [−1, 1].

    S    episodes played at once;  G  agents of a side
    A    numbers of the environment's action;  V, K, E, O, F  as in `networks`
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import torch
from torch import Tensor

from reference.building import Building
from reference.game.frame import Frame
from reference.game.moments import Choices, Chooser, Moment
from reference.game.observations import (
    grid_shape,
    summary,
    summary_size,
    vector_layout,
)
from reference.learning.experience import GroupDecision
from reference.learning.networks import RAW_LIMIT, Actor, Options, Policy, Sizes
from reference.learning.settings import (
    SettingsError,
    Side,
    TrainerSettings,
    refuse_of_robots,
)
from reference.paper import Scenario

AXES = 2  # [C5] [D2] two continuous numbers: x and y

Landmarks = Callable[[Building, Scenario], Chooser]
"""Makes a building's `Chooser`, which finds the options of a pointer head."""


class Player:
    """Decide for one side by its actor network, and record the decisions."""

    def __init__(
        self,
        side: Side,
        building: Building,
        scenario: Scenario,
        settings: TrainerSettings,
        landmarks: Landmarks | None = None,
    ):
        """landmarks: makes a pointer head's options; None for other heads.

        Raises SettingsError where settings and side, or head and landmarks, do not fit.
        """
        if (settings.head == "pointer") != (landmarks is not None):
            raise SettingsError(
                "a head 'pointer' needs landmarks to choose among, and no other head "
                "takes any"
            )
        if side == "fire":
            refuse_of_robots(settings)
        self.side, self.building, self.scenario = side, building, scenario
        self.settings, self.layout = settings, vector_layout(building, scenario)
        self.chooser = landmarks and landmarks(building, scenario)
        self.frame = None
        if settings.in_robots_frame:
            self.frame = Frame(building, scenario, settings.masks)
        self.keeps = settings.head == "gaussian" and settings.commitment > 0
        self.sizes = self._sizes()
        self.actor = Actor(self.sizes, settings).eval()

    def load(self, weights: dict[str, Any]) -> None:
        """Load a learner's weights, tensors or arrays, by name.

        Raises RuntimeError for another shape.
        """
        tensors = {name: torch.as_tensor(array) for name, array in weights.items()}
        self.actor.load_state_dict(tensors)

    def seen(self, moment: Moment) -> np.ndarray:
        """Build the network's input, (G, V) float32; see `read`."""
        return self.read([moment])[0][0]

    def read(
        self, moments: Sequence[Moment]
    ) -> tuple[list[np.ndarray], list[Choices | None]]:
        """Build the network's inputs (G, V), and what there is to choose among.

        In the robot's frame, what it sees of all moments at once; else vectors and what
        settings add.
        """
        if self.frame is None:
            return [*map(self._with_counts, moments)], [*map(self._choices, moments)]
        vectors = np.concatenate([m.vectors for m in moments])
        seen = self.frame.read(vectors, np.concatenate([m.headed for m in moments]))
        places = self.frame.spoken(vectors[:, None], seen.anchors)
        numbers, *anchors = (
            np.split(array, len(moments))
            for array in (seen.numbers, places, seen.anchors, seen.allowed)
        )
        if self.settings.head == "gaussian":
            return numbers, [*map(self._choices, moments)]
        return numbers, [*map(Choices, *anchors)]

    def _with_counts(self, moment: Moment) -> np.ndarray:
        """Append what settings add; scale the fire's numbers [E4, chosen].

        Table II does not normalise them.
        """
        vectors, s = moment.vectors, self.settings
        parts = [self.layout.scaled(vectors) if self.side == "fire" else vectors]
        if s.summary:
            parts.append(summary(vectors, moment.grid, self.building, self.scenario))
        if s.own_state:
            under_way = ~np.isnan(moment.headed[:, :1])
            parts += [np.nan_to_num(moment.headed), under_way.astype(np.float32)]
        return np.concatenate(parts, axis=1)

    @torch.no_grad()
    def act(
        self, moments: Sequence[Moment]
    ) -> tuple[np.ndarray, list[GroupDecision[np.ndarray]]]:
        """Decide at all these moments by one call of the network.

        Returns (S, G, A) float32, the environment's actions, and what to record.
        """
        seen, each = self.read(moments)
        found = [choices for choices in each if choices]
        options = found and Options(
            _stacked([choices.features for choices in found]),
            _stacked([choices.action_mask for choices in found]),
        )
        policy = self.actor(
            _stacked(seen),
            _stacked([m.grid for m in moments]),
            options or None,
        )
        actions = policy.act(_noise(moments, policy))
        raw, log_probs = actions.numpy(), policy.log_probs(actions).numpy()
        if self.chooser:
            places = np.stack([choices.places for choices in found])
            index = raw.astype(np.intp)[..., None]
            emitted = shown = np.take_along_axis(places, index, axis=2)[:, :, 0]
        else:
            emitted, shown = self._emitted(raw, moments)
        return emitted, [
            GroupDecision(
                vectors=seen[k],
                grids=m.grid,
                alive=m.alive,
                actions=raw[k],
                shown=shown[k],
                log_probs=log_probs[k],
                features=found[k].features if found else None,
                action_mask=found[k].action_mask if found else None,
            )
            for k, m in enumerate(moments)
        ]

    def _choices(self, moment: Moment) -> Choices | None:
        """Find a pointer's options; for Gaussians "keep", if under way, and "new"."""
        if self.chooser:
            return self.chooser(moment)
        if not self.keeps:
            return None
        under_way = ~np.isnan(moment.headed[:, 0])
        none = np.zeros((len(under_way), 2, 0), dtype=np.float32)
        return Choices(none, none, np.stack([under_way, under_way | True], axis=1))

    def _emitted(
        self, raw: np.ndarray, moments: Sequence[Moment]
    ) -> tuple[np.ndarray, np.ndarray]:
        """Convert Gaussians: clamp(a, −3, 3)/3 [E3]; the fire's floor, a branch, first.

        In the robot's frame, from units around it. Also returns the raw numbers, for
        the critic. A kept destination replaces both.
        """
        shown = raw[..., :AXES]
        axes = shown.clip(-RAW_LIMIT, RAW_LIMIT) / RAW_LIMIT
        if self.side == "fire":
            floor = (2 * raw[..., AXES:] + 1) / self.building.floors - 1
            return np.concatenate([floor, axes], axis=-1), shown
        vectors = np.stack([m.vectors for m in moments])
        if self.frame:
            axes = self.frame.spoken(vectors, shown)
        if self.keeps:
            kept, headed = raw[..., AXES:] == 0, np.stack([m.headed for m in moments])
            old = self.frame.actions(vectors, headed) if self.frame else headed
            axes = np.where(kept, np.nan_to_num(headed), axes)
            shown = np.where(kept, np.nan_to_num(old), shown)
        return axes, shown

    def _sizes(self) -> Sizes:
        """Compute the input and output sizes of this side's networks."""
        building, s = self.building, self.settings
        of_robots = self.side == "robots"
        branches = (2,) * self.keeps if of_robots else (building.floors,)
        added = summary_size(building) * s.summary + (AXES + 1) * s.own_state
        size = self.layout.size + added
        if self.frame:
            size = self.frame.size
        sizes = Sizes(size, grid_shape(building), shown=AXES)
        if s.head == "mixture":
            assert self.frame is not None
            return replace(sizes, anchors=self.frame.anchors)
        if not self.chooser:
            return replace(sizes, continuous=AXES, branches=branches)
        emitted = AXES if of_robots else 1 + AXES
        return replace(sizes, features=self.chooser.features, shown=emitted)


def _stacked(arrays: Sequence[np.ndarray]) -> Tensor:
    return torch.from_numpy(np.stack(arrays))


def _noise(moments: Sequence[Moment], policy: Policy) -> Tensor | None:
    """Draw `Policy.act`'s noise (S, G, C + sum n), by each episode's generator."""
    continuous, counts = policy.noise()
    rows = []
    for rng, agents in ((m.rng, len(m.alive)) for m in moments if m.rng is not None):
        normal = rng.standard_normal((agents, continuous), dtype=np.float32)
        gumbel = rng.gumbel(size=(agents, counts)).astype(np.float32)
        rows.append(np.concatenate([normal, gumbel], axis=1))
    return _stacked(rows) if rows else None


class Recorded(ABC):
    """A side whose decisions become trajectories."""

    @abstractmethod
    def player(self, side: Side, building: Building, scenario: Scenario) -> Player:
        """Make a new player of this side."""


@dataclass(frozen=True)
class Learned(Recorded):
    """A side that a network plays: its settings, and its weights by name.

    landmarks  makes a pointer head's options; None for other heads
    """

    settings: TrainerSettings
    weights: dict[str, Any]
    landmarks: Landmarks | None = None

    def player(self, side: Side, building: Building, scenario: Scenario) -> Player:
        """Make a player with these weights. Raises RuntimeError for another shape."""
        player = Player(side, building, scenario, self.settings, self.landmarks)
        player.load(self.weights)
        return player
