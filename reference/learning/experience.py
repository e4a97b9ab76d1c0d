"""What has been lived through: trajectories of one side, and the buffer they fill.

Clauses: C4, C8, E3.  The trainers of Tables I and II update when the buffer holds more
than `buffer_size` experiences, use all of it, and empty it.

    T  decisions of an episode;  G  agents;  V, E, K, O, F  as in `networks`
    N  group decisions in the buffer;  a step is one agent's decision
"""

from collections.abc import Iterator
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
import torch
from torch import Tensor

from reference.learning.networks import Options


@dataclass(frozen=True)
class Trajectory:
    """One side's part of one episode.

    vectors    (T + 1, G, V) float32; after an agent's last decision, its last
               observation
    grids      (T + 1, channels, height, width) uint8, shared by the agents
    alive      (T + 1, G) bool: who decides at t; in row T, who was cut off by time
    actions    (T, G, K) float32, as a `Policy` stores them
    shown      (T, G, E) float32, what a critic is shown of them
    log_probs  (T, G, K) float32, when they were taken
    rewards    (T,) of the group, or of the only agent; health points
    features   (T, G, O, F), action_mask (T, G, O): a pointer head's options, or None
    """

    vectors: np.ndarray
    grids: np.ndarray
    alive: np.ndarray
    actions: np.ndarray
    shown: np.ndarray
    log_probs: np.ndarray
    rewards: np.ndarray
    features: np.ndarray | None = None
    action_mask: np.ndarray | None = None

    def __len__(self) -> int:
        """Group decisions, T."""
        return len(self.rewards)

    @property
    def steps(self) -> int:
        """Agents' decisions [E3]."""
        return int(self.alive[:-1].sum())


@dataclass
class Decisions:
    """N group decisions: the first axis of every tensor is N.

    Names as in `Trajectory`; besides, for each agent and decision, (N, G) each:
    values, baselines (MA-POCA's only), returns, advantages.
    """

    vectors: Tensor
    grids: Tensor
    alive: Tensor
    actions: Tensor
    shown: Tensor
    log_probs: Tensor
    values: Tensor
    baselines: Tensor
    returns: Tensor
    advantages: Tensor
    features: Tensor | None = None
    action_mask: Tensor | None = None

    def __len__(self) -> int:
        return len(self.alive)

    @property
    def options(self) -> Options | None:
        """What a pointer head chooses among."""
        if self.features is None or self.action_mask is None:
            return None
        return Options(self.features, self.action_mask)

    def rows(self, which: Tensor) -> "Decisions":
        """Some of them; which: indices."""
        return Decisions(**{name: x[which] for name, x in self.tensors()})

    def tensors(self) -> Iterator[tuple[str, Tensor]]:
        """Name and tensor of every field that there is."""
        for field in fields(self):
            if (value := getattr(self, field.name)) is not None:
                yield field.name, value

    @staticmethod
    def joined(parts: "list[Decisions]") -> "Decisions":
        """One after the other."""
        names = [name for name, _ in parts[0].tensors()]
        return Decisions(
            **{name: torch.cat([getattr(p, name) for p in parts]) for name in names}
        )


def decisions_of(t: Trajectory) -> Decisions:
    """A trajectory's decisions, not valued yet."""
    unknown = torch.zeros(t.alive[:-1].shape)
    return Decisions(
        vectors=torch.from_numpy(t.vectors[:-1]),
        grids=torch.from_numpy(t.grids[:-1]),
        alive=torch.from_numpy(t.alive[:-1]),
        actions=torch.from_numpy(t.actions),
        shown=torch.from_numpy(t.shown),
        log_probs=torch.from_numpy(t.log_probs),
        values=unknown,
        baselines=unknown,
        returns=unknown.clone(),
        advantages=unknown.clone(),
        features=None if t.features is None else torch.from_numpy(t.features),
        action_mask=None if t.action_mask is None else torch.from_numpy(t.action_mask),
    )


def segments(alive: np.ndarray, horizon: int) -> Iterator[tuple[int, int, list[int]]]:
    """First decision, the one after the last, and which agents: trajectories [E3].

    alive: (T + 1, G). Each agent's decisions, cut every `horizon` of them; agents that
    decide from and to the same moment come together.
    """
    lives = alive[:-1].sum(axis=0)
    for first in range(0, int(lives.max(initial=0)), horizon):
        ends = np.minimum(lives, first + horizon)
        for last in np.unique(ends[lives > first]).tolist():
            agents = np.flatnonzero((ends == last) & (lives > first))
            yield first, last, agents.tolist()


class Buffer:
    """Decisions until there are more than `size` steps."""

    def __init__(self, size: int):
        self.size = size
        self.parts: list[Decisions] = []

    def __len__(self) -> int:
        """Agents' decisions in it."""
        return sum(int(part.alive.sum()) for part in self.parts)

    @property
    def full(self) -> bool:
        """More than `size` experiences [E3]."""
        return len(self) > self.size

    def add(self, decisions: Decisions) -> None:
        """Behind what is there."""
        self.parts.append(decisions)

    def emptied(self) -> Decisions:
        """All of it; the buffer is empty then."""
        everything = Decisions.joined(self.parts)
        self.parts = []
        return everything

    def state(self) -> list[dict[str, Any]]:
        """Tensors for a checkpoint; grids are packed to bits."""
        return [dict(p.tensors()) | {"grids": _packed(p.grids)} for p in self.parts]

    def load(self, state: list[dict[str, Any]]) -> None:
        """What `state` gave."""
        self.parts = [
            Decisions(**part | {"grids": _unpacked(part["grids"])}) for part in state
        ]


def minibatches(
    decisions: Decisions, batch_size: int, rng: torch.Generator
) -> Iterator[Decisions]:
    """Shuffled minibatches of whole group decisions, about batch_size steps each.

    As many as there are whole batches of steps; the tail is dropped. The original
    shuffles single agents' rows; for a group of one this is the same [E3, chosen].
    A batch smaller than the group still holds one decision of it.
    """
    steps = int(decisions.alive.sum())
    size = max(1, len(decisions) * batch_size // max(1, steps))
    count = min(steps // batch_size, len(decisions) // size)
    order = torch.randperm(len(decisions), generator=rng)
    for k in range(count):
        yield decisions.rows(order[k * size : (k + 1) * size])


def _packed(grids: Tensor) -> dict[str, Any]:
    bits = np.packbits(grids.numpy().reshape(len(grids), -1), axis=1)
    return {"bits": torch.from_numpy(bits), "shape": list(grids.shape)}


def _unpacked(packed: dict[str, Any]) -> Tensor:
    shape = packed["shape"]
    count = int(np.prod(shape[1:]))
    bits = np.unpackbits(packed["bits"].numpy(), axis=1, count=count)
    return torch.from_numpy(bits.reshape(shape))
