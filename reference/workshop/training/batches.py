"""Batches of several buildings: groups that differ in size and in what they read.

A batch of one building is a few tensors. Of several it has columns with room for the
largest group, but keeps what is read in parts, one for each shape: a network reads
part after part, and nothing is padded. A loss is then the parts' mean, weighted by
decisions: the same as if all could be read at once. Where there is one shape, nothing
differs from the book's.

    N  group decisions;  G  agents of a group;  V  numbers that an agent reads
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import fields
from typing import Any

import torch
from torch import Tensor
from torch.nn import functional

from reference.learning import poca, ppo
from reference.learning.experience import Decisions
from reference.learning.ppo import Learner
from reference.workshop.anchors.shapes import SETS

READ = ("vectors", "grids")
"""Columns whose shape depends on the building and the scenario."""

STRIP = 16
"""[C7, chosen] rows of one shape that stay together where a policy copies."""


class Ragged:
    """Rows of several tensors that have different shapes, in any order.

    parts  tensors (k, ...);  at  (N, 2) part and row in it, of each row
    """

    def __init__(self, parts: Sequence[Tensor], at: Tensor):
        self.parts = parts
        self.at = at

    def index_select(self, dim: int, which: Tensor) -> "Ragged":
        """Select rows by their indices; dim: 0."""
        return Ragged(self.parts, self.at.index_select(dim, which))


def joined_mixed(parts: Sequence[Decisions]) -> Decisions:
    """Concatenate decisions of one building or several, in their order.

    Where shapes differ, `vectors` and `grids` are `Ragged`.
    """
    shapes = [_shape(part) for part in parts]
    kinds = list(dict.fromkeys(shapes))
    if len(kinds) == 1:
        return Decisions.joined(parts)

    # parts of each shape, and where each row stands: which shape, and row of it
    alike: list[list[Decisions]] = [[] for _ in kinds]
    ends = [0] * len(kinds)
    places = []
    for part, shape in zip(parts, shapes, strict=True):
        k = kinds.index(shape)
        alike[k].append(part)
        rows = torch.arange(ends[k], ends[k] + len(part))
        ends[k] += len(part)
        places.append(torch.stack([torch.full_like(rows, k), rows], dim=1))
    at = torch.cat(places)

    # what is read stays in parts; the rest has room for the largest group
    most = max(part.alive.shape[1] for part in parts)
    columns: dict[str, Any] = {}
    for name in (field.name for field in fields(Decisions)):
        if name in READ:
            same = [torch.cat([getattr(p, name) for p in some]) for some in alike]
            columns[name] = Ragged(same, at)
        else:
            wide = [_widened(getattr(part, name), most) for part in parts]
            columns[name] = torch.cat(wide)
    return Decisions(**columns)


def _shape(part: Decisions) -> tuple[int, ...]:
    """What parts must share to be read at once."""
    counts = part.vectors[0, 0, -SETS:].int().tolist() if len(part) else []
    return (*part.vectors.shape[1:], *part.grids.shape[1:], *counts)


def _widened(column: Tensor, most: int) -> Tensor:
    """(N, G, ...) -> (N, most, ...), zeros or False for agents that are not there."""
    lacking = most - column.shape[1]
    return functional.pad(column, (0, 0) * (column.dim() - 2) + (0, lacking))


def pieces_of(batch: Decisions) -> Iterator[tuple[float, Decisions]]:
    """Yield the pieces of a batch that have one shape, with their share of decisions.

    Pieces in which nobody decides are left out.
    """
    vectors: Any = batch.vectors
    if not isinstance(vectors, Ragged):
        yield 1.0, batch
        return
    everybody = batch.alive.sum()
    for k in vectors.at[:, 0].unique().tolist():
        which = (vectors.at[:, 0] == k).nonzero()[:, 0]
        rows = vectors.at[which, 1]
        agents = vectors.parts[k].shape[1]
        columns = {}
        for name, column in vars(batch).items():
            if name in READ:
                columns[name] = column.parts[k].index_select(0, rows)
            else:
                columns[name] = column.index_select(0, which)[:, :agents]
        piece = Decisions(**columns)
        share = float(piece.alive.sum() / everybody)
        if share:
            yield share, piece


def averaged(batch: Decisions, loss: Callable[[Decisions], Tensor]) -> Tensor:
    """Average a loss, which is a mean over decisions, over the pieces of a batch."""
    return torch.stack([share * loss(piece) for share, piece in pieces_of(batch)]).sum()


def strips(batch: Decisions, size: int, rng: torch.Generator) -> Iterator[Tensor]:
    """Shuffle group decisions into batches of `size`; yield their indices.

    Where shapes differ, STRIP rows of one shape stay together: else each batch would
    hold nearly as many shapes as rows.
    """
    vectors: Any = batch.vectors
    if not isinstance(vectors, Ragged):
        yield from torch.randperm(len(batch), generator=rng).split(size)
        return
    pieces = []
    for k in range(len(vectors.parts)):
        which = (vectors.at[:, 0] == k).nonzero()[:, 0]
        order = torch.randperm(len(which), generator=rng)
        pieces += which[order].split(STRIP)
    turns = torch.randperm(len(pieces), generator=rng).tolist()
    yield from torch.cat([pieces[k] for k in turns]).split(size)


class _OfSeveral(Learner):
    """A learner whose buffer may hold several buildings."""

    def joined(self, parts: Sequence[Decisions]) -> Decisions:
        """Join the parts of a buffer, of any buildings."""
        return joined_mixed(parts)

    def loss(
        self, batch: Decisions, epsilon: float, beta: float
    ) -> tuple[Tensor, dict[str, Tensor]]:
        """The summed loss of a minibatch, and its parts, as the book's."""
        total = torch.zeros(())
        parts: dict[str, Tensor] = {}
        for share, piece in pieces_of(batch):
            loss, some = super().loss(piece, epsilon, beta)
            total = total + share * loss
            for name, part in some.items():
                parts[name] = parts.get(name, torch.zeros(())) + share * part
        return total, parts


class PPOOfSeveral(_OfSeveral, ppo.Learner):
    """PPO in several buildings."""


class POCAOfSeveral(_OfSeveral, poca.GroupLearner):
    """MA-POCA in several buildings."""


LEARNERS_OF_SEVERAL: dict[str, type[Learner]] = {
    "ppo": PPOOfSeveral,
    "poca": POCAOfSeveral,
}
"""Both learners by `trainer_type`, as the book's LEARNERS."""
