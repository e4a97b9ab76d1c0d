"""A head beside the paper's: a mixture of Gaussians around anchors [C5] [D2].

H  hidden units;  V  numbers a network reads;  K  anchors;  C  numbers it emits
"""

from math import log, sqrt
from typing import Any

import torch
from torch import Tensor, nn

from reference.learning.networks import (
    BRANCH_GAIN,
    REFUSED,
    ActionDistribution,
    Actor,
    Body,
    linear,
)
from reference.learning.settings import TrainerSettings
from reference.workshop.anchors.frame import KEEP, UNIT, AnchorSizes


class Mixture(ActionDistribution):
    """A mixture of Gaussians around anchors, whose samples have one log-probability.

    log p(a) = log sum_k w_k N(a; m_k, sigma)
    """

    def __init__(self, anchors: Tensor, sigma: float, logits: Tensor):
        """anchors m (..., K, C) and their logits (..., K)."""
        # One Gaussian an anchor, and the choice of an anchor as the only branch.
        super().__init__(anchors, anchors.new_tensor(log(sigma)), [logits])
        self.choice = self.branches[0]

    def log_probs(self, actions: Tensor) -> Tensor:
        """(..., 1), exact: whichever anchor an action (..., C) was drawn around."""
        near = self.gaussian.log_prob(actions[..., None, :]).sum(dim=-1)
        return torch.logsumexp(self.choice.logits + near, dim=-1, keepdim=True)

    def entropy(self) -> Tensor:
        """(...): of the choice + of a Gaussian, which does not change [C5, chosen].

        The mixture's own has no formula; it is less where anchors are close.
        """
        return self.choice.entropy() + self.gaussian.entropy()[..., 0, :].mean(dim=-1)

    def act(self, noise: Tensor | None = None) -> Tensor:
        """Sample (..., C) around a sampled anchor; without noise, the likeliest one."""
        scores = self.choice.logits
        anchors = self.gaussian.mean
        C = anchors.shape[-1]
        if noise is not None:
            scores = scores + noise[..., C:]
        chosen = scores.argmax(dim=-1)[..., None, None]
        index = chosen.expand(*scores.shape[:-1], 1, C)
        spot = anchors.gather(-2, index)[..., 0, :]
        if noise is None:
            return spot
        sigma = self.gaussian.stddev[..., 0, :]  # the same around every anchor
        return spot + sigma * noise[..., :C]


class MixtureHead(nn.Module):
    """Weigh anchors by one linear layer [C5, chosen]."""

    def __init__(self, hidden: int, sizes: AnchorSizes):
        super().__init__()
        K = sizes.anchors
        self.shape = K, sizes.continuous
        self.sigma = sizes.spread / UNIT
        self.commitment = sizes.commitment
        self.weights = linear(hidden, K, BRANCH_GAIN / sqrt(hidden))

    def forward(self, x: Tensor, vectors: Tensor) -> Mixture:
        """Mixture from the body's (..., H) and the numbers read (..., V)."""
        K, C = self.shape
        anchors = vectors[..., : K * C].unflatten(-1, (K, C))
        allowed = vectors[..., K * C : K * C + K] > 0.5
        logits = self.weights(x) + self.commitment * (torch.arange(K) == KEEP)
        return Mixture(anchors, self.sigma, logits.masked_fill(~allowed, REFUSED))


class MixtureActor(Actor):
    """An actor whose head also reads the numbers that the body reads."""

    make_head: Any = MixtureHead

    def __init__(self, sizes: AnchorSizes, settings: TrainerSettings):
        nn.Module.__init__(self)  # not Actor's, which makes the paper's head
        self.body = Body(sizes, settings)
        self.head = self.make_head(settings.hidden_units, sizes)

    def forward(self, vectors: Tensor, grids: Tensor) -> Mixture:
        """(B, G, V) and (B, channels, height, width)."""
        mixture: Mixture = self.head(self.body(vectors, grids), vectors)
        return mixture


MIXTURE = {Actor: MixtureActor}
"""Networks of the head `mixture`, by the paper's whose place they take."""
