"""Trajectories and the on-policy buffer.

The trainers of Tables I and II update when the buffer holds more than `buffer_size`
experiences, use all of it, and empty it.

    T  decisions of an episode;  G  agents;  V, K  as in `networks`
    N  group decisions in the buffer

A step is one agent's decision, as ML-Agents counts: the environment's are up to G each.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

RECORDED = ("vectors", "grids", "alive", "actions", "log_probs")
"""Columns of a `Trajectory` and of `Decisions`."""

TARGETS = ("values", "baselines", "returns", "advantages")
"""Columns that `Decisions` has besides, to learn from."""

Record = dict[str, np.ndarray]  # one decision of a side: a row of these columns


@dataclass(kw_only=True)
class Trajectory:
    """One side's T decisions in one episode, and the rewards that followed.

    vectors, grids and alive have T + 1 rows. The last row is observed after the last
    decision; for an agent that is done, it is its last observation. alive[T] marks
    agents that time cut off with something left to decide: they are bootstrapped [C8].
    """

    vectors: np.ndarray  # (T + 1, G, V) float32, what each agent's network reads
    grids: np.ndarray  # (T + 1, channels, height, width) uint8, of all agents [C4]
    alive: np.ndarray  # (T + 1, G) bool, which agents decide
    actions: np.ndarray  # (T, G, K) float32, as an `ActionDistribution` stores them
    log_probs: np.ndarray  # (T, G, K) float32, of the actions when sampled
    rewards: np.ndarray  # (T,) of the group, or of the only agent; health points

    def __len__(self) -> int:
        """Group decisions, T."""
        return len(self.rewards)

    @property
    def steps(self) -> int:
        """Agents' decisions [E3, trainer/rl_trainer.py]."""
        return int(self.alive[:-1].sum())


@dataclass(kw_only=True)
class Decisions:
    """N group decisions of the buffer, and their learning targets, (N, G) each.

    The first five are a trajectory's, without its last row; PPO's baselines are 0.
    """

    vectors: Tensor
    grids: Tensor
    alive: Tensor
    actions: Tensor
    log_probs: Tensor
    values: Tensor
    baselines: Tensor
    returns: Tensor
    advantages: Tensor

    def __len__(self) -> int:
        return len(self.alive)

    def rows(self, which: Tensor) -> "Decisions":
        """Select group decisions by their indices."""
        columns = vars(self).items()
        return Decisions(**{name: x.index_select(0, which) for name, x in columns})

    @staticmethod
    def joined(parts: "Sequence[Decisions]") -> "Decisions":
        """Concatenate parts in their order."""
        columns = [vars(part) for part in parts]
        joined = {name: torch.cat([c[name] for c in columns]) for name in columns[0]}
        return Decisions(**joined)


def decisions_of(t: Trajectory) -> Decisions:
    """Convert a trajectory to decisions; values, advantages and so on are still 0."""
    shape = t.alive[:-1].shape
    return Decisions(
        **{name: torch.from_numpy(getattr(t, name)[: len(t)]) for name in RECORDED},
        **{name: torch.zeros(shape) for name in TARGETS},
    )


def segments(alive: np.ndarray, horizon: int) -> Iterator[tuple[int, int, list[int]]]:
    """Cut each agent's decisions into segments [E3, agent_processor.py].

    alive: (T + 1, G), True from row 0 to an agent's last decision, or never. Yields
    where a segment starts and stops, at most `horizon` later, and who share it.
    """
    lives = alive[:-1].sum(axis=0)
    for start in range(0, int(lives.max(initial=0)), horizon):
        there = lives > start
        stops = np.minimum(lives, start + horizon)
        for stop in np.unique(stops[there]).tolist():
            agents = np.flatnonzero(there & (stops == stop))
            yield start, stop, agents.tolist()


def minibatches(
    decisions: Decisions, batch_size: int, rng: torch.Generator
) -> Iterator[Decisions]:
    """Shuffle group decisions into minibatches of about batch_size steps each.

    Each has as many group decisions as fit into batch_size by the mean number of agents
    that decide, but at least one. There are as many minibatches as there are whole
    batches of steps, and the rest is dropped. Since decisions are not split, it may be
    much: with six agents 16 steps make 2 decisions, 12 steps, and a quarter is dropped.
    """
    steps = int(decisions.alive.sum())
    size = max(1, len(decisions) * batch_size // max(1, steps))
    count = min(steps // batch_size, len(decisions) // size)
    order = torch.randperm(len(decisions), generator=rng)
    for which in order.split(size)[:count]:
        yield decisions.rows(which)
