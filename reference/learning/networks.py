"""The networks that both trainers share: encoders, and actors with three heads.

Clauses: C3, C4, C5, C7, D2, E1-E4.  What ML-Agents 0.29.0 builds from Tables I and II,
with one difference: whatever the agents of a group share is computed once [E3, chosen].

    B    group decisions in a batch;  G  agents of the group;  V  numbers an agent sees
    C    continuous components of an action;  D  discrete branches;  K = C + D
    H    hidden units;  E  numbers of an action that a critic sees
    O    options a head chooses among: places, or a mixture's anchors
    F    features of an option: a pointer's, or where an anchor is
"""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from math import log, sqrt

import torch
from torch import Tensor, nn
from torch.distributions import Categorical, Normal
from torch.nn import functional

from reference.game.frame import UNIT
from reference.learning.settings import TrainerSettings

MOST_DEVIATIONS = 5.0  # [E4] normalised inputs are clipped there
RELU_GAIN = 1.41  # [E3] of the layer after the convolutions
MEAN_GAIN, BRANCH_GAIN = 0.2, 0.1  # [E3] a new policy hardly prefers anything
RAW_LIMIT = 3.0  # [E3] a raw continuous action is clipped to ±this, then divided by it
REFUSED = -1e9  # the score of a masked option
FIRST_SIGMA, SIGMAS = 0.5, (0.02, 1.0)
"""[C5, chosen] of a Gaussian in the robot's frame, in units of 10 m: where it begins,
and between which it stays."""


@contextmanager
def one_thread() -> Iterator[None]:
    """Run torch on one thread: quickest for small networks, and sums in one order."""
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(before)


@dataclass(frozen=True)
class Sizes:
    """Shapes of a network's inputs and outputs, by building and scenario.

    vector      numbers an agent observes;  grid  (channels, height, width)
    continuous  Gaussian components;  branches  options of each discrete branch
    features    of an option, 0 without a pointer head
    anchors     of a mixture head, else 0
    shown       numbers of an action that a critic sees
    """

    vector: int
    grid: tuple[int, int, int]
    continuous: int = 0
    branches: tuple[int, ...] = ()
    features: int = 0
    anchors: int = 0
    shown: int = 0


@dataclass(frozen=True)
class Options:
    """Options of a discrete choice, and which of them are allowed.

    features (..., O, F), of a mixture's anchors their x and y, of a Gaussian none
    action_mask (..., O) bool
    """

    features: Tensor
    action_mask: Tensor


# -- Inputs -------------------------------------------------------------------------


class Normaliser(nn.Module):
    """Running mean and variance of a vector [E4]; begins with one pseudo-sample.

    count n;  mean (V,);  squares S (V,), the sum of squared deviations
    """

    count: Tensor
    mean: Tensor
    squares: Tensor

    def __init__(self, size: int):
        super().__init__()
        self.register_buffer("count", torch.ones((), dtype=torch.float64))
        self.register_buffer("mean", torch.zeros(size, dtype=torch.float64))
        self.register_buffer("squares", torch.ones(size, dtype=torch.float64))

    @torch.no_grad()
    def update(self, x: Tensor) -> None:
        """Take in k more rows; x: (k, V)."""
        x = x.double()
        self.count += len(x)
        before = x - self.mean
        self.mean += before.sum(0) / self.count
        self.squares += (before * (x - self.mean)).sum(0)

    def forward(self, x: Tensor) -> Tensor:
        """(..., V) in standard deviations from the mean, cut at ±MOST_DEVIATIONS."""
        deviation = torch.sqrt(self.squares / self.count)
        z = (x - self.mean.to(x.dtype)) / deviation.to(x.dtype)
        return z.clamp(-MOST_DEVIATIONS, MOST_DEVIATIONS)


class GridEncoder(nn.Module):
    """`vis_encode_type: simple`: two convolutions without padding, one layer [C3] [E4].

    9 x 40 x 40 becomes 16 x 9 x 9, then 32 x 3 x 3 = 288, then H.
    """

    def __init__(self, shape: tuple[int, int, int], hidden: int):
        super().__init__()
        channels, height, width = shape
        self.conv1 = nn.Conv2d(channels, 16, kernel_size=8, stride=4)
        self.conv2 = nn.Conv2d(16, 32, kernel_size=4, stride=2)
        rows, cols = (((side - 8) // 4 + 1 - 4) // 2 + 1 for side in (height, width))
        flat = 32 * rows * cols
        self.dense = linear(flat, hidden, RELU_GAIN / sqrt(flat))

    def forward(self, grids: Tensor) -> Tensor:
        """(B, channels, height, width) of 0 and 1 -> (B, H)."""
        dtype, last = self.conv1.weight.dtype, torch.channels_last  # in memory
        x = functional.leaky_relu(self.conv1(grids.to(dtype, memory_format=last)))
        x = functional.leaky_relu(self.conv2(x))
        return functional.leaky_relu(self.dense(x.flatten(1)))


class Encoder(nn.Module):
    """Concatenate the vector, normalised or not, and the encoded grid [E4]."""

    def __init__(self, sizes: Sizes, settings: TrainerSettings):
        super().__init__()
        self.normaliser = Normaliser(sizes.vector) if settings.normalize else None
        self.grid = GridEncoder(sizes.grid, settings.hidden_units)
        self.size = sizes.vector + settings.hidden_units

    def forward(self, vectors: Tensor, grids: Tensor) -> Tensor:
        """(B, V) -> (B, V + H), or (B, G, V) -> (B, G, V + H); grids: one per B.

        The agents of a group share their grid, so it is encoded once [C4].
        """
        if self.normaliser is not None:
            vectors = self.normaliser(vectors)
        image = self.grid(grids)
        if vectors.dim() == 3:
            image = image[:, None].expand(-1, vectors.shape[1], -1)
        return torch.cat([vectors, image], dim=-1)


def linear(size: int, out: int, deviation: float) -> nn.Linear:
    """A layer with normal weights of this standard deviation and zero biases [E3]."""
    layer = nn.Linear(size, out)
    nn.init.normal_(layer.weight, std=deviation)
    nn.init.zeros_(layer.bias)
    return layer


def value_head(size: int) -> nn.Linear:
    """A linear layer to one number, Glorot's uniform weights and zero bias [E3]."""
    layer = nn.Linear(size, 1)
    nn.init.xavier_uniform_(layer.weight)
    nn.init.zeros_(layer.bias)
    return layer


def layers(size: int, hidden: int, count: int, gain: float = 1.0) -> nn.Sequential:
    """Linear layers, each followed by swish, the last one too [E3]."""
    stack: list[nn.Module] = []
    for fan_in in [size] + [hidden] * (count - 1):
        stack += [linear(fan_in, hidden, gain / sqrt(fan_in)), nn.SiLU()]
    return nn.Sequential(*stack)


class Body(nn.Module):
    """Encoder and `num_layers` layers, for the actor and for PPO's critic."""

    def __init__(self, sizes: Sizes, settings: TrainerSettings):
        super().__init__()
        self.encoder = Encoder(sizes, settings)
        self.layers = layers(
            self.encoder.size, settings.hidden_units, settings.num_layers
        )

    def forward(self, vectors: Tensor, grids: Tensor) -> Tensor:
        """(B, [G,] V) and (B, channels, height, width) -> (B, [G,] H)."""
        return self.layers(self.encoder(vectors, grids))


# -- Policies -----------------------------------------------------------------------


class Policy:
    """A distribution over actions: C Gaussians, then D branches, all independent.

    Actions are stored as (..., C + D) floats: raw samples, then indices.
    """

    def __init__(
        self,
        mean: Tensor,
        log_sigma: Tensor,
        branches: Sequence[Tensor],
        keeps: bool = False,
    ):
        """mean (..., C), log_sigma (..., C), and for each branch its logits (..., n).

        keeps: where the first branch takes option 0, "keep", the Gaussians' samples
        are not used, and their log-probabilities count as 0.
        """
        self.keeps = keeps
        self.gaussian = Normal(
            mean, log_sigma.exp().expand_as(mean), validate_args=False
        )
        self.branches = [Categorical(logits=b, validate_args=False) for b in branches]

    def log_probs(self, actions: Tensor) -> Tensor:
        """(..., C + D), one log-probability for every component [E3]."""
        C = self.gaussian.mean.shape[-1]
        of_gaussians = self.gaussian.log_prob(actions[..., :C])
        if self.keeps:
            of_gaussians = of_gaussians * (actions[..., C : C + 1] > 0)
        parts = [of_gaussians]
        for k, branch in enumerate(self.branches, start=C):
            parts.append(branch.log_prob(actions[..., k].long())[..., None])
        return torch.cat(parts, dim=-1)

    def entropy(self) -> Tensor:
        """(...): mean over the continuous dimensions + sum over the branches [E3]."""
        total = sum(branch.entropy() for branch in self.branches)
        if self.gaussian.mean.shape[-1]:
            total = total + self.gaussian.entropy().mean(dim=-1)
        assert isinstance(total, Tensor)
        return total

    def noise(self) -> tuple[int, int]:
        """How many standard normal and Gumbel numbers `act` needs for an agent."""
        counts = (branch.logits.shape[-1] for branch in self.branches)
        return self.gaussian.mean.shape[-1], sum(counts)

    def act(self, noise: Tensor | None = None) -> Tensor:
        """Sample actions (..., C + D) with `noise`; without it, the mean or likeliest.

        noise: (..., C + sum n): standard normal, then Gumbel numbers for each branch.
        """
        mean, sigma = self.gaussian.mean, self.gaussian.stddev
        at = mean.shape[-1]
        parts = [mean if noise is None else mean + sigma * noise[..., :at]]
        for branch in self.branches:
            scores = branch.logits
            if noise is not None:
                scores = scores + noise[..., at : at + scores.shape[-1]]
            at += scores.shape[-1]
            parts.append(scores.argmax(dim=-1, keepdim=True).to(mean.dtype))
        return torch.cat(parts, dim=-1)


class GaussianHead(nn.Module):
    """The paper's head: unsquashed Gaussians, and discrete branches [C5] [D2].

    A linear layer gives the mean; log sigma is a free vector that begins at 0. With
    commitment there is one branch: keep the current destination, or take the new one.

    [C5, chosen] In the robot's frame a linear layer gives log sigma too, from
    FIRST_SIGMA on: a free number hardly moves in a short training.
    """

    def __init__(
        self,
        hidden: int,
        continuous: int,
        branches: tuple[int, ...],
        commitment: float = 0.0,
        robots_frame: bool = False,
    ):
        super().__init__()
        self.commitment = commitment
        self.mean = linear(hidden, continuous, MEAN_GAIN / sqrt(hidden))
        self.log_sigma: nn.Parameter | nn.Linear
        if robots_frame:
            self.log_sigma = linear(hidden, continuous, BRANCH_GAIN / sqrt(hidden))
            nn.init.constant_(self.log_sigma.bias, log(FIRST_SIGMA))
        else:
            self.log_sigma = nn.Parameter(torch.zeros(continuous))
        self.branches = nn.ModuleList(
            linear(hidden, n, BRANCH_GAIN / sqrt(hidden)) for n in branches
        )

    def forward(self, x: Tensor, options: Options | None = None) -> Policy:
        """Policy from the body's (..., H); options: mask the only branch, if given."""
        logits = [branch(x) for branch in self.branches]
        if options is not None:
            logits = [_committed(logits[0], options, self.commitment)]
        log_sigma = self.log_sigma
        if isinstance(log_sigma, nn.Linear):
            log_sigma = log_sigma(x).clamp(*map(log, SIGMAS))
        return Policy(self.mean(x), log_sigma, logits, options is not None)


class Mixture(Policy):
    """A mixture of Gaussians around anchors: two floats, one log-probability.

    log p(a) = log sum_k w_k N(a; m_k, sigma)
    """

    def __init__(self, anchors: Tensor, sigma: float, logits: Tensor):
        """anchors m (..., O, 2) and their logits (..., O)."""
        log_sigma = anchors.new_tensor(log(sigma))
        super().__init__(anchors, log_sigma, [logits])
        self.choice = self.branches[0]

    def log_probs(self, actions: Tensor) -> Tensor:
        """(..., 1), exact: whichever anchor an action (..., 2) was drawn around."""
        near = self.gaussian.log_prob(actions[..., None, :]).sum(dim=-1)
        return torch.logsumexp(self.choice.logits + near, dim=-1, keepdim=True)

    def entropy(self) -> Tensor:
        """(...): of the choice + of a Gaussian, which does not change [C5, chosen].

        The mixture's own has no formula; it is less where anchors are close.
        """
        return self.choice.entropy() + self.gaussian.entropy()[..., 0, :].mean(dim=-1)

    def noise(self) -> tuple[int, int]:
        """One Gaussian's, and one for each anchor."""
        return self.gaussian.mean.shape[-1], self.choice.logits.shape[-1]

    def act(self, noise: Tensor | None = None) -> Tensor:
        """Sample (..., 2) around a sampled anchor; without noise, the likeliest one."""
        scores, anchors = self.choice.logits, self.gaussian.mean
        if noise is not None:
            scores = scores + noise[..., 2:]
        chosen = scores.argmax(dim=-1)[..., None, None].expand(*scores.shape[:-1], 1, 2)
        spot = anchors.gather(-2, chosen)[..., 0, :]
        sigma = self.gaussian.stddev[..., 0, :]
        return spot if noise is None else spot + sigma * noise[..., :2]


class MixtureHead(nn.Module):
    """Weights anchors of the robot's frame by one linear layer [C5, chosen].

    The first anchor, "keep", has the commitment as a bonus; `game.frame` says which
    there are, and which may be meant now.
    """

    def __init__(self, hidden: int, anchors: int, sigma: float, commitment: float):
        super().__init__()
        self.sigma, self.commitment = sigma, commitment
        self.weights = linear(hidden, anchors, BRANCH_GAIN / sqrt(hidden))

    def forward(self, x: Tensor, options: Options) -> Mixture:
        """Mixture from the body's (..., H) and the anchors, as features (..., O, 2)."""
        logits = _committed(self.weights(x), options, self.commitment)
        return Mixture(options.features, self.sigma, logits)


class PointerHead(nn.Module):
    """Scores options by one small network that all of them share [C5, chosen].

    The choice is one discrete branch; the chosen option's coordinates are the action.
    Without context the scores depend on the options' features alone.
    """

    def __init__(
        self,
        hidden: int,
        features: int,
        commitment: float = 0.0,
        context: bool = True,
    ):
        super().__init__()
        self.commitment = commitment
        self.context = linear(hidden, hidden, 1 / sqrt(hidden)) if context else None
        self.option = linear(features, hidden, 1 / sqrt(features))
        self.between = layers(hidden, hidden, 1)
        self.score = linear(hidden, 1, BRANCH_GAIN / sqrt(hidden))

    def forward(self, x: Tensor | None, options: Options) -> Policy:
        """Policy from the body's (..., H), None without context, and the options."""
        both = self.option(options.features)
        if self.context is not None:
            assert x is not None
            both = self.context(x)[..., None, :] + both
        scores = self.score(self.between(functional.silu(both)))[..., 0]
        scores = _committed(scores, options, self.commitment)
        return Policy(both[..., 0, :0], both.new_zeros(0), [scores])


def _committed(logits: Tensor, options: Options, bonus: float) -> Tensor:
    """Mask missing options; give the first, "keep", a bonus [C7, chosen]."""
    keep = torch.arange(logits.shape[-1]) == 0
    return (logits + bonus * keep).masked_fill(~options.action_mask, REFUSED)


class Actor(nn.Module):
    """Map what an agent observes to a distribution over its actions."""

    def __init__(self, sizes: Sizes, settings: TrainerSettings):
        super().__init__()
        hidden, context = settings.hidden_units, settings.context
        self.pointer = self.gaussian = self.mixture = None
        self.body = None
        if context or not sizes.features:
            self.body = Body(sizes, settings)
        if sizes.anchors:
            sigma = settings.spread / UNIT
            self.mixture = MixtureHead(
                hidden, sizes.anchors, sigma, settings.commitment
            )
        elif sizes.features:
            self.pointer = PointerHead(
                hidden, sizes.features, settings.commitment, context
            )
        else:
            self.gaussian = GaussianHead(
                hidden,
                sizes.continuous,
                sizes.branches,
                settings.commitment,
                settings.in_robots_frame,
            )

    def forward(
        self, vectors: Tensor, grids: Tensor, options: Options | None = None
    ) -> Policy:
        """(B, [G,] V), (B, channels, height, width) and options, if there are any."""
        x = None if self.body is None else self.body(vectors, grids)
        if self.pointer is not None:
            assert options is not None
            return self.pointer(x, options)
        assert x is not None
        if self.mixture is not None:
            assert options is not None
            return self.mixture(x, options)
        assert self.gaussian is not None
        return self.gaussian(x, options)
