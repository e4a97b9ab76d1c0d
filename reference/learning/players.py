"""Players: decide for one side of an episode, and record its decisions.

S    episodes played at once;  G  agents of a side;  A  numbers of a decision
V, K  as in `networks`
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from torch import Tensor

from reference.building import Building
from reference.game.codec import Moment
from reference.learning.experience import Record
from reference.learning.networks import ActionDistribution, Actor
from reference.learning.settings import Side, TrainerSettings
from reference.paper import Scenario


class Player:
    """Decide for one side by its actor network, and record the decisions."""

    def __init__(
        self,
        side: Side,
        building: Building,
        scenario: Scenario,
        settings: TrainerSettings,
    ):
        self.codec = settings.codec(side, building, scenario)
        with torch.random.fork_rng(devices=[]):  # weights follow; nobody sees the draw
            self.actor = settings.network(Actor)(self.codec.sizes, settings).eval()

    def act(self, moments: Sequence[Moment]) -> tuple[np.ndarray, list[Record]]:
        """Decide at all these moments by one call of the network.

        Returns (S, G, A) float64, decisions in metres [C5] [D2], and what to
        record.
        """
        return self.act_on(self.codec.read(moments), self.codec.grids(moments), moments)

    @torch.no_grad()
    def act_on(
        self, seen: np.ndarray, grids: np.ndarray, moments: Sequence[Moment]
    ) -> tuple[np.ndarray, list[Record]]:
        """Decide as `act` does; seen, grids: what the codec has read and drawn."""
        policy = self.actor(torch.from_numpy(seen), torch.from_numpy(grids))
        raw = policy.act(_noise(moments, policy))
        log_probs = policy.log_probs(raw).numpy()
        actions = raw.numpy()
        records = [
            {
                "vectors": seen[k],
                "grids": grids[k],
                "alive": moment.alive,
                "actions": actions[k],
                "log_probs": log_probs[k],
            }
            for k, moment in enumerate(moments)
        ]
        return self.codec.actions(actions, moments), records


def _noise(moments: Sequence[Moment], policy: ActionDistribution) -> Tensor | None:
    """Draw the noise of `act`, (S, G, C + sum n), by each episode's generator.

    None, likeliest actions for all, if one has no generator.
    """
    continuous, *branches = policy.noise_sizes()
    rows = []
    for moment in moments:
        if moment.rng is None:
            return None
        agents = len(moment.alive)
        normal = moment.rng.standard_normal((agents, continuous), dtype=np.float32)
        gumbel = moment.rng.gumbel(size=(agents, sum(branches))).astype(np.float32)
        rows.append(np.concatenate([normal, gumbel], axis=1))
    return torch.from_numpy(np.stack(rows))


@dataclass(frozen=True)
class LearnedNetwork:
    """A side that a network plays: its settings, and its weights by name."""

    settings: TrainerSettings
    weights: dict[str, Any]

    def player(self, side: Side, building: Building, scenario: Scenario) -> Player:
        """Make a player with these weights. Raises RuntimeError for another shape."""
        player = Player(side, building, scenario, self.settings)
        tensors = {name: torch.as_tensor(array) for name, array in self.weights.items()}
        player.actor.load_state_dict(tensors)
        return player
