"""Hand-made lives for the learners' tests: settings, sizes, trajectories, batches.

A life is drawn as one row of text for each agent, one letter a decision:

    "###"   it decides three times, and is done
    "##>"   it decides twice and is cut off by the time limit, still there

so that `life("###", "#..")` is a group whose second agent finishes early.
"""

from dataclasses import replace
from typing import Any

import numpy as np
import torch
from torch import Tensor

from reference.game.codec import Sizes
from reference.learning.experience import Decisions, Trajectory, decisions_of
from reference.workshop.anchors.settings import SideSettings
from reference.workshop.training.presets import preset

torch.set_num_threads(1)  # of tensors this small, threads only wait for each other

SIZES = Sizes(vector=5, grid=(2, 20, 20), continuous=2)
"""Small enough for a test; 20 x 20 is the least that `simple` can encode."""

MIXED = replace(SIZES, branches=(3,))
"""With a discrete branch, as the fire has."""


def tensor(*numbers: float) -> Tensor:
    """In float64, as an oracle would have it."""
    return torch.tensor(numbers, dtype=torch.float64)


def random(seed: int, *shape: int) -> Tensor:
    """Normal numbers in float64."""
    generator = torch.Generator().manual_seed(seed)
    return torch.randn(shape, generator=generator, dtype=torch.float64)


def settings(trainer_type: str = "poca", **changes: Any) -> SideSettings:
    """Table I with a small network, rewards as they are and no end of training."""
    small = {
        "trainer_type": trainer_type,
        "hidden_units": 16,
        "num_layers": 2,
        "reward_scale": 1.0,
        "num_epoch": 1,
        "batch_size": 4,
        "buffer_size": 8,
        "max_steps": 10**9,
    }
    return replace(preset("paper").robots, **small | changes)


def life(*agents: str, sizes: Sizes = SIZES, seed: int = 0, **given: Any) -> Trajectory:
    """A trajectory as drawn; what is not given is drawn by lot."""
    rng = np.random.default_rng(seed)
    cut = np.array([row.endswith(">") for row in agents])
    drawn = [row.rstrip(">").rstrip(".") for row in agents]
    T = max(map(len, drawn))
    G = len(agents)
    lengths = np.array([len(row) for row in drawn])
    alive = np.arange(T + 1)[:, None] < lengths
    alive[T] = cut
    components = sizes.continuous + len(sizes.branches)
    fields = {
        "vectors": rng.normal(1, 2, (T + 1, G, sizes.vector)).astype(np.float32),
        "grids": rng.integers(0, 2, (T + 1, *sizes.grid)).astype(np.uint8),
        "alive": alive,
        "actions": acts(rng, (T, G), sizes),
        "log_probs": rng.normal(-1.2, 0.2, (T, G, components)).astype(np.float32),
        "rewards": rng.normal(0, 1, T),
    }
    fields |= given
    return Trajectory(**fields)


def acts(rng: np.random.Generator, shape: tuple[int, ...], sizes: Sizes) -> np.ndarray:
    """Actions as a `ActionDistribution` stores them: raw numbers, then indices."""
    raw = [rng.normal(size=(*shape, sizes.continuous))]
    raw += [rng.integers(0, n, (*shape, 1)) for n in sizes.branches]
    return np.concatenate(raw, axis=-1).astype(np.float32)


def batch(B: int = 6, G: int = 3, sizes: Sizes = SIZES, seed: int = 0) -> Decisions:
    """B group decisions of whoever happens to be there, at least one of G."""
    rng = np.random.default_rng(seed)
    alive = rng.random((B, G)) < 0.6
    alive[np.arange(B), rng.integers(0, G, B)] = True
    everybody = ["#" * B] * G
    rows = decisions_of(life(*everybody, sizes=sizes, seed=seed))
    numbers = torch.from_numpy(rng.normal(0, 0.7, (4, B, G)).astype(np.float32))
    return replace(
        rows,
        alive=torch.from_numpy(alive),
        values=numbers[0],
        baselines=numbers[1],
        returns=numbers[2],
        advantages=numbers[3],
    )


def doubled(rows: Decisions) -> Decisions:
    """The same in float64."""
    wide = vars(rows).copy()
    for name, column in wide.items():
        if column.is_floating_point():
            wide[name] = column.double()
    return Decisions(**wide)


def gradients(module: torch.nn.Module) -> dict[str, Tensor]:
    """Of every parameter, zeros where it has none; and forget them."""
    found = {}
    for name, p in module.named_parameters():
        found[name] = torch.zeros_like(p) if p.grad is None else p.grad.clone()
    module.zero_grad()
    return found
