"""The networks that both trainers share: encoders and actors.

What ML-Agents 0.29.0 builds from Tables I and II [E1] [E2]. The image that a group's
agents share is encoded once [E3, chosen]; other differences stand at the end of `ppo`.

    B    group decisions in a batch;  G  agents of the group;  V  numbers it reads
    C    continuous components of an action;  D  discrete branches;  K = C + D
    H    hidden units
"""

from collections.abc import Sequence
from math import sqrt

import torch
from torch import Tensor, nn
from torch.distributions import Categorical, Normal
from torch.nn import functional

from reference.game.codec import Sizes
from reference.game.observations import GRID_KINDS
from reference.learning.settings import TrainerSettings

MOST_DEVIATIONS = 5.0  # [E3, torch/encoders.py] normalised inputs are clipped there
RELU_GAIN = 1.41  # [E3, torch/encoders.py] of the layer after the convolutions
MEAN_GAIN = 0.2  # [E3, torch/distributions.py] a new policy hardly has a preference
BRANCH_GAIN = 0.1  # [E3, torch/distributions.py]
REFUSED = -1e9  # the score of what may not be attended to, or chosen


# -- Inputs -------------------------------------------------------------------------


class Normaliser(nn.Module):
    """Running mean and variance of a vector [E4]; begins with one pseudo-sample."""

    count: Tensor  # samples
    mean: Tensor  # (V,)
    squares: Tensor  # (V,), the sum of squared deviations

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
        flat = 32 * _cells_left(height) * _cells_left(width)
        self.dense = linear(flat, hidden, RELU_GAIN / sqrt(flat))

    def forward(self, grids: Tensor) -> Tensor:
        """(B, channels, height, width) of 0 and 1 -> (B, H).

        The first convolution is summed over the kinds of channels. A kind that is the
        same in the whole batch, such as walls of one building, is convolved once.
        """
        x = self.conv1.get_parameter("bias")[:, None, None]
        kernels = self.conv1.weight.chunk(len(GRID_KINDS), dim=1)
        kinds = grids.chunk(len(GRID_KINDS), dim=1)
        for cells, kernel in zip(kinds, kernels, strict=True):
            if cells.amax(0).equal(cells.amin(0)):
                cells = cells[:1]
            cells = cells.to(kernel.dtype)
            x = x + functional.conv2d(cells, kernel, stride=self.conv1.stride)
        x = x.expand(len(grids), -1, -1, -1)
        x = x.contiguous(memory_format=torch.channels_last)  # conv2 is quicker so
        x = functional.leaky_relu(x)
        x = functional.leaky_relu(self.conv2(x))
        return functional.leaky_relu(self.dense(x.flatten(1)))


def _cells_left(cells: int) -> int:
    """How many of the cells along a side are left after both convolutions."""
    after_first = (cells - 8) // 4 + 1
    return (after_first - 4) // 2 + 1


class Encoder(nn.Module):
    """Concatenate the vector, normalised or not, and the encoded grid [E4].

    [E4, erratum] Printed: "we apply normalization ... to form residual connections".
    Normalised inputs are no residual connections; of what the tables configure only
    MA-POCA's attention has one, `poca.SelfAttention` [E3, torch/attention.py].
    """

    def __init__(self, sizes: Sizes, settings: TrainerSettings):
        super().__init__()
        self.normaliser = Normaliser(sizes.vector) if settings.normalize else None
        self.grid = GridEncoder(sizes.grid, settings.hidden_units)
        self.size = sizes.vector + settings.hidden_units

    def forward(self, vectors: Tensor, grids: Tensor) -> Tensor:
        """(B, G, V) -> (B, G, V + H); grids: (B, channels, height, width).

        The agents of a group share their grid, so it is encoded once [C4].
        """
        if self.normaliser is not None:
            vectors = self.normaliser(vectors)
        image = self.grid(grids)[:, None].expand(-1, vectors.shape[1], -1)
        return torch.cat([vectors, image], dim=-1)


def linear(size: int, out: int, deviation: float) -> nn.Linear:
    """A layer of normal weights and zero biases [E3, torch/layers.py]."""
    layer = nn.Linear(size, out)
    nn.init.normal_(layer.weight, std=deviation)
    nn.init.zeros_(layer.bias)
    return layer


def value_head(size: int) -> nn.Linear:
    """To a value: Glorot's uniform, zero bias [E3, torch/layers.py]."""
    layer = nn.Linear(size, 1)
    nn.init.xavier_uniform_(layer.weight)
    nn.init.zeros_(layer.bias)
    return layer


def layers(size: int, hidden: int, count: int, gain: float = 1.0) -> nn.Sequential:
    """Linear layers, each followed by swish, the last one too [E3, torch/layers.py]."""
    stack: list[nn.Module] = []
    for fan_in in [size] + [hidden] * (count - 1):
        stack += [linear(fan_in, hidden, gain / sqrt(fan_in)), nn.SiLU()]
    return nn.Sequential(*stack)


class Body(nn.Module):
    """Encoder and `num_layers` layers, for the actor and for PPO's critic."""

    def __init__(self, sizes: Sizes, settings: TrainerSettings):
        super().__init__()
        self.encoder = settings.network(Encoder)(sizes, settings)
        self.layers = layers(
            self.encoder.size, settings.hidden_units, settings.num_layers
        )

    def forward(self, vectors: Tensor, grids: Tensor) -> Tensor:
        """(B, G, V) and (B, channels, height, width) -> (B, G, H)."""
        return self.layers(self.encoder(vectors, grids))


# -- Policies -----------------------------------------------------------------------


class ActionDistribution:
    """A distribution over actions: C Gaussians, then D branches, all independent.

    Actions are stored as (..., C + D) floats: raw samples, then indices.
    """

    def __init__(self, mean: Tensor, log_sigma: Tensor, branches: Sequence[Tensor]):
        """mean (..., C), log_sigma (..., C), and each branch's logits (..., n)."""
        sigma = log_sigma.exp().expand_as(mean)
        self.gaussian = Normal(mean, sigma, validate_args=False)
        self.branches = [Categorical(logits=b, validate_args=False) for b in branches]

    def log_probs(self, actions: Tensor) -> Tensor:
        """(..., C + D), one for every component [E3, torch/distributions.py]."""
        C = self.gaussian.mean.shape[-1]
        parts = [self.gaussian.log_prob(actions[..., :C])]
        for k, branch in enumerate(self.branches, start=C):
            parts.append(branch.log_prob(actions[..., k].long())[..., None])
        return torch.cat(parts, dim=-1)

    def entropy(self) -> Tensor:
        """(...): mean of Gaussians + sum of branches [E3, torch/action_model.py]."""
        total = self.gaussian.entropy().mean(dim=-1)
        for branch in self.branches:
            total = total + branch.entropy()
        return total

    def noise_sizes(self) -> list[int]:
        """Tell how many numbers `act` takes: normal, then Gumbel's for each branch."""
        counts = (branch.logits.shape[-1] for branch in self.branches)
        return [self.gaussian.mean.shape[-1], *counts]

    def act(self, noise: Tensor | None = None) -> Tensor:
        """Sample actions (..., C + D) with `noise`; without it, the mean or likeliest.

        noise: (..., C + sum n): standard normal, then Gumbel numbers for each branch:
        the option with the highest sum of logit and Gumbel number is a sample of it.
        """
        mean = self.gaussian.mean
        scores = [branch.logits for branch in self.branches]
        if noise is not None:
            normal, *gumbel = noise.split(self.noise_sizes(), dim=-1)
            mean = mean + self.gaussian.stddev * normal
            scores = [s + g for s, g in zip(scores, gumbel, strict=True)]
        chosen = [s.argmax(dim=-1, keepdim=True).to(mean.dtype) for s in scores]
        return torch.cat([mean, *chosen], dim=-1)


class GaussianHead(nn.Module):
    """The paper's head: unsquashed Gaussians, and discrete branches [C5] [D2].

    A linear layer gives the mean; log sigma is a free vector that begins at 0.
    """

    def __init__(self, hidden: int, sizes: Sizes):
        super().__init__()
        self.mean = linear(hidden, sizes.continuous, MEAN_GAIN / sqrt(hidden))
        self.log_sigma = nn.Parameter(torch.zeros(sizes.continuous))
        self.branches = nn.ModuleList(
            linear(hidden, n, BRANCH_GAIN / sqrt(hidden)) for n in sizes.branches
        )

    def forward(self, x: Tensor) -> ActionDistribution:
        """From the body's (..., H)."""
        branches = [branch(x) for branch in self.branches]
        return ActionDistribution(self.mean(x), self.log_sigma, branches)


class Actor(nn.Module):
    """Map what an agent observes to a distribution over its actions."""

    def __init__(self, sizes: Sizes, settings: TrainerSettings):
        super().__init__()
        self.body = Body(sizes, settings)
        self.head = GaussianHead(settings.hidden_units, sizes)

    def forward(self, vectors: Tensor, grids: Tensor) -> ActionDistribution:
        """(B, G, V) and (B, channels, height, width)."""
        policy: ActionDistribution = self.head(self.body(vectors, grids))
        return policy
