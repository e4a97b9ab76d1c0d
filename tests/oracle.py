"""A second, naive computation of MA-POCA's critic, to compare with.

The way ML-Agents arranges it: one row per agent and decision; for every row the image
and every mate are encoded anew; absent mates are rows of nan, masked with −1e6 in the
attention; heads are mixed first and then go through one output layer.

    critic  a `GroupCritic`, whose layers are called one by one
    M       rows;  B, G, V, H  as in `networks`
"""

import math

import torch
from torch import Tensor

from reference.learning.poca import GroupCritic

HEADS = 4
MASK = -1e6


def normed(x: Tensor) -> Tensor:
    """Mean 0 and variance 1 along the last axis."""
    off = x - x.mean(dim=-1, keepdim=True)
    return off / torch.sqrt((off**2).mean(dim=-1, keepdim=True) + 1e-5)


def attended(critic: GroupCritic, entities: Tensor, absent: Tensor) -> Tensor:
    """(M, N, H) entities and (M, N) 1.0 for the absent: pooled to (M, H)."""
    layer, x = critic.attention, normed(entities)
    q, k, v, H = layer.query(x), layer.key(x), layer.to_value(x), x.shape[-1]
    mask, mixed = absent[:, None, :], []
    for part in torch.arange(H).split(H // HEADS):
        scores = q[..., part] @ k[..., part].transpose(1, 2) / math.sqrt(H)
        weights = torch.softmax((1 - mask) * scores + mask * MASK, dim=-1)
        mixed.append(weights @ v[..., part])
    y = normed(layer.out(torch.cat(mixed, dim=-1)) + x)
    there = (1 - absent)[..., None]
    return (y * there).sum(1) / (there.sum(1) + 1e-7)


def worth(
    critic: GroupCritic,
    agents: list[tuple[Tensor, Tensor | None]],
    grids: Tensor,
) -> Tensor:
    """(M,) what M groups are worth: observations (M, V) and actions of their agents.

    No action: it is not known. Absent agents are rows of nan.
    """
    entities, absent = [], []
    for vectors, action in agents:
        missing = vectors[:, :1].isnan()
        alone = torch.where(missing, 0.0, vectors)[:, None]  # groups of one
        x = critic.encoder(alone, grids)[:, 0]
        known = action is not None
        entities.append(critic.f(torch.cat([x, action], 1)) if known else critic.g(x))
        absent.append(missing.to(x))
    mask = torch.cat(absent, dim=1)
    pooled = critic.trunk(attended(critic, torch.stack(entities, dim=1), mask))
    n = (1 - mask).sum(1, keepdim=True)
    share = 2 * n / torch.maximum(critic.most, n.max()) - 1
    return critic.value(torch.cat([pooled, share], dim=1))[:, 0]


@torch.no_grad()
def group_worth(
    critic: GroupCritic, vectors: Tensor, grids: Tensor, alive: Tensor, actions: Tensor
) -> tuple[Tensor, Tensor]:
    """Values and baselines (B, G), each agent's row on its own."""
    seen = torch.where(alive[..., None], vectors, float("nan"))
    values, baselines = [], []
    for j in range(vectors.shape[1]):
        mates = [k for k in range(vectors.shape[1]) if k != j]
        everyone = [(seen[:, k], None) for k in [j, *mates]]
        values.append(worth(critic, everyone, grids))
        acting = [(seen[:, k], actions[:, k]) for k in mates]
        baselines.append(worth(critic, [(seen[:, j], None), *acting], grids))
    return torch.stack(values, dim=1), torch.stack(baselines, dim=1)
