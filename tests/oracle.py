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
    variance = (off**2).mean(dim=-1, keepdim=True)
    return off / torch.sqrt(variance + 1e-5)


def attended(critic: GroupCritic, entities: Tensor, absent: Tensor) -> Tensor:
    """(M, N, H) entities and (M, N) 1.0 for the absent: pooled to (M, H)."""
    layer = critic.attention
    x = normed(entities)
    H = x.shape[-1]
    q = layer.query(x)
    k = layer.key(x)
    v = layer.to_value(x)

    # each head has its part of the H numbers
    mask = absent[:, None, :]
    mixed = []
    for part in torch.arange(H).split(H // HEADS):
        products = q[..., part] @ k[..., part].transpose(1, 2)
        scores = products / math.sqrt(H)
        masked = (1 - mask) * scores + mask * MASK
        weights = torch.softmax(masked, dim=-1)
        mixed.append(weights @ v[..., part])
    added = layer.out(torch.cat(mixed, dim=-1)) + x

    # the mean over those who are there
    y = normed(added)
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
    entities = []
    absent = []
    for vectors, action in agents:
        missing = vectors[:, :1].isnan()
        alone = torch.where(missing, 0.0, vectors)[:, None]  # groups of one
        x = critic.encoder(alone, grids)[:, 0]
        if action is None:
            entity = critic.g(x)
        else:
            entity = critic.f(torch.cat([x, action], dim=1))
        entities.append(entity)
        absent.append(missing.to(x))
    mask = torch.cat(absent, dim=1)
    pooled = attended(critic, torch.stack(entities, dim=1), mask)
    features = critic.trunk(pooled)

    # how many are there, of the most that ever were, from -1 to 1
    n = (1 - mask).sum(1, keepdim=True)
    most = torch.maximum(critic.most, n.max())
    share = 2 * n / most - 1
    return critic.value(torch.cat([features, share], dim=1))[:, 0]


@torch.no_grad()
def group_worth(
    critic: GroupCritic, vectors: Tensor, grids: Tensor, alive: Tensor, actions: Tensor
) -> tuple[Tensor, Tensor]:
    """Values and baselines (B, G), each agent's row on its own."""
    seen = torch.where(alive[..., None], vectors, float("nan"))
    values = []
    baselines = []
    for j in range(vectors.shape[1]):
        mates = [k for k in range(vectors.shape[1]) if k != j]
        everyone = [(seen[:, k], None) for k in [j, *mates]]
        values.append(worth(critic, everyone, grids))
        itself = (seen[:, j], None)
        acting = [(seen[:, k], actions[:, k]) for k in mates]
        baselines.append(worth(critic, [itself, *acting], grids))
    return torch.stack(values, dim=1), torch.stack(baselines, dim=1)
