"""Networks of sets: they know neither the building nor how many there are [C5, chosen].

Every element of a set passes the same small network; the mean and the greatest of what
comes out tell of the whole set. So their order means nothing, and weights fit any
number. What they read is laid out as `SetShapes` says, and tells how many there are:
one network reads the numbers of every building.

    B    group decisions in a batch;  G  agents of the group;  V  numbers read
    k    elements of a set;  N  numbers of an element;  W  hidden units of an element
    K    anchors;  C  numbers of an action;  H  hidden units
"""

from math import sqrt

import torch
from torch import Tensor, nn
from torch.nn import functional

from reference.learning.networks import (
    BRANCH_GAIN,
    REFUSED,
    Actor,
    Encoder,
    GridEncoder,
    linear,
)
from reference.learning.settings import TrainerSettings
from reference.workshop.anchors.crop import CROP_SHAPE
from reference.workshop.anchors.frame import KEEP, UNIT
from reference.workshop.anchors.heads import Mixture, MixtureActor
from reference.workshop.anchors.shapes import NO_IMAGE, SetShapes, SetSizes

LEAST_WIDTH = 8
"""[C5, chosen] hidden units of an element, at least; else a quarter of those of all."""


class ReadSets:
    """What a side reads, (..., V), taken apart.

    at       (..., K, C) anchors, in units of its actions
    allowed  (..., K) bool
    sets     anchors, people, mates and fires: (..., k, N) each
    counts   (..., further numbers)
    """

    def __init__(self, vectors: Tensor, shapes: SetShapes, axes: int):
        """shapes: of any building; how many elements there are the vectors tell."""
        *sets, counts = shapes
        # All agents of a batch are of one building and scenario.
        elements = vectors.flatten(0, -2)[0, -len(sets) :].int().tolist()
        here = [(k, n) for k, (_, n) in zip(elements, sets, strict=True)]
        K = elements[0]
        sizes = [K * axes, K, *(k * n for k, n in here), counts, len(sets)]
        at, allowed, *parts, self.counts, _ = vectors.split(sizes, dim=-1)
        self.at = at.unflatten(-1, (K, axes))
        self.allowed = allowed > 0.5
        pairs = zip(parts, here, strict=True)
        self.sets = [part.unflatten(-1, shape) for part, shape in pairs]


class PooledSet(nn.Module):
    """Pass each element through one layer; pool those that are there."""

    def __init__(self, numbers: int, width: int):
        super().__init__()
        self.layer = linear(numbers, width, 1 / sqrt(numbers))

    def forward(self, elements: Tensor) -> Tensor:
        """(..., k, N) -> (..., 2 W), mean and greatest; zeros where nothing is there.

        An element's last number is 1 if it is there.
        """
        present = elements[..., -1:]
        # Absent elements become 0. After relu nothing is less, so they add nothing to
        # the sum and never are the greatest.
        x = functional.relu(self.layer(elements)) * present
        mean = x.sum(dim=-2) / present.sum(dim=-2).clamp(min=1)
        return torch.cat([mean, x.amax(dim=-2)], dim=-1)


class SetEncoder(nn.Module):
    """Encode what a side reads: its sets, pooled, its counts and a robot's crop."""

    def __init__(self, sizes: SetSizes, settings: TrainerSettings):
        super().__init__()
        self.shapes = sizes.sets
        self.axes = sizes.continuous
        *sets, counts = sizes.sets
        width = max(LEAST_WIDTH, settings.hidden_units // 4)
        self.sets = nn.ModuleList(PooledSet(n, width) for _, n in sets)
        self.size = 2 * width * len(sets) + counts
        self.grid = None
        if sizes.grid != NO_IMAGE:
            self.grid = GridEncoder(CROP_SHAPE, width)
            self.size += width

    def forward(self, vectors: Tensor, grids: Tensor) -> Tensor:
        """(B, G, V) and (B, 3 G, CROP, CROP), or no image -> (B, G, size)."""
        B, G, _ = vectors.shape
        read = ReadSets(vectors, self.shapes, self.axes)
        parts = [one(x) for one, x in zip(self.sets, read.sets, strict=True)]
        parts.append(read.counts)
        if self.grid is not None:
            image = self.grid(grids.reshape(B * G, *CROP_SHAPE))
            parts.append(image.view(B, G, -1))
        return torch.cat(parts, dim=-1)


class SetHead(nn.Module):
    """Score each anchor by one network, from its numbers and the robot's situation.

    The anchor where the robot is headed has the commitment as a bonus.
    """

    def __init__(self, hidden: int, sizes: SetSizes):
        super().__init__()
        self.shapes = sizes.sets
        self.axes = sizes.continuous
        self.sigma = sizes.spread / UNIT
        self.commitment = sizes.commitment
        _, numbers = sizes.sets.anchors
        self.anchor = linear(numbers, hidden, 1 / sqrt(numbers))
        self.situation = nn.Linear(hidden, hidden, bias=False)
        nn.init.normal_(self.situation.weight, std=1 / sqrt(hidden))
        self.second = linear(hidden, hidden // 2, 1 / sqrt(hidden))
        self.score = linear(hidden // 2, 1, BRANCH_GAIN / sqrt(hidden // 2))

    def forward(self, x: Tensor, vectors: Tensor) -> Mixture:
        """Mixture from the body's (..., H) and the numbers read (..., V)."""
        read = ReadSets(vectors, self.shapes, self.axes)
        each = self.anchor(read.sets[0]) + self.situation(x)[..., None, :]
        each = functional.silu(self.second(functional.silu(each)))
        logits = self.score(each)[..., 0]
        keep = torch.arange(logits.shape[-1]) == KEEP
        logits = logits + self.commitment * keep
        return Mixture(read.at, self.sigma, logits.masked_fill(~read.allowed, REFUSED))


class SetActor(MixtureActor):
    """An actor that reads sets."""

    make_head = SetHead


SET = {Actor: SetActor, Encoder: SetEncoder}
"""Networks of the head `set`, by the paper's whose place they take."""
