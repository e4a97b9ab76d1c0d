"""A second, naive computation of the trainers' networks, to compare with.

The way ML-Agents arranges them: one row per agent and decision; for every row the image
and every mate are encoded anew; absent mates are rows of nan, masked with −1e6 in the
attention; heads are mixed first and then go through one output layer. Nothing of
`reference.learning.networks` is called: weights are read by name, so gradients arrive
in the same parameters.

    p  parameters by name;  B, G, V, H  as in `networks`
"""

import math

import torch
from torch import Tensor
from torch.nn import functional

HEADS = 4
MASK = -1e6


def parameters(module: torch.nn.Module) -> dict[str, Tensor]:
    """Parameters and buffers by name, with their gradients' history."""
    return module.state_dict(keep_vars=True)


def dense(p: dict[str, Tensor], name: str, x: Tensor) -> Tensor:
    """One linear layer."""
    return x @ p[f"{name}.weight"].T + p[f"{name}.bias"]


def swished(p: dict[str, Tensor], name: str, x: Tensor) -> Tensor:
    """Linear layers name.0, name.2, ..., each followed by x·sigmoid(x)."""
    index = 0
    while f"{name}.{index}.weight" in p:
        x = dense(p, f"{name}.{index}", x)
        x, index = x * torch.sigmoid(x), index + 2
    return x


def leaky(x: Tensor) -> Tensor:
    """The negative at a hundredth."""
    return torch.where(x > 0, x, 0.01 * x)


def convolved(p: dict[str, Tensor], name: str, x: Tensor, stride: int) -> Tensor:
    """A convolution as what it is: each patch times the weights."""
    weight = p[f"{name}.weight"]
    out, _, k, _ = weight.shape
    side = (x.shape[-1] - k) // stride + 1
    patches = functional.unfold(x, k, stride=stride)
    y = weight.flatten(1) @ patches + p[f"{name}.bias"][:, None]
    return leaky(y.view(len(x), out, -1, side))


def encoded(p: dict[str, Tensor], name: str, vectors: Tensor, grids: Tensor) -> Tensor:
    """(M, V) and (M, channels, height, width): one image for each row, (M, V + H)."""
    if f"{name}.normaliser.mean" in p:
        n, mean, squares = (
            p[f"{name}.normaliser.{what}"] for what in ("count", "mean", "squares")
        )
        vectors = ((vectors - mean) / (squares / n) ** 0.5).clamp(-5, 5).to(grids)
    x = convolved(p, f"{name}.grid.conv1", grids, 4)
    x = convolved(p, f"{name}.grid.conv2", x, 2)
    image = leaky(dense(p, f"{name}.grid.dense", x.flatten(1)))
    return torch.cat([vectors, image], dim=1)


def normed(x: Tensor) -> Tensor:
    """Mean 0 and variance 1 along the last axis."""
    off = x - x.mean(dim=-1, keepdim=True)
    return off / torch.sqrt((off**2).mean(dim=-1, keepdim=True) + 1e-5)


def attended(p: dict[str, Tensor], entities: Tensor, absent: Tensor) -> Tensor:
    """(M, N, H) entities and (M, N) 1.0 for the absent: pooled to (M, H)."""
    x = normed(entities)
    H = x.shape[-1]
    q, k, v = (dense(p, f"attention.{n}", x) for n in ("query", "key", "to_value"))
    mixed = []
    for part in torch.arange(H).split(H // HEADS):
        scores = q[..., part] @ k[..., part].transpose(1, 2) / math.sqrt(H)
        mask = absent[:, None, :]
        weights = torch.softmax((1 - mask) * scores + mask * MASK, dim=-1)
        mixed.append(weights @ v[..., part])
    y = normed(dense(p, "attention.out", torch.cat(mixed, dim=-1)) + x)
    there = (1 - absent)[..., None]
    return (y * there).sum(1) / (there.sum(1) + 1e-7)


def worth(
    p: dict[str, Tensor],
    alone: list[Tensor],
    acting: list[tuple[Tensor, Tensor]],
    grids: Tensor,
) -> Tensor:
    """(M,) what M rows are worth.

    alone   observations (M, V) of agents whose actions are not actions
    acting  the same with their actions (M, E); absent agents are rows of nan
    """
    entities, absent = [], []
    for vectors, action in [(x, None) for x in alone] + acting:
        missing = vectors[:, 0].isnan()
        vectors = torch.where(missing[:, None], torch.zeros_like(vectors), vectors)
        x, embedder = encoded(p, "encoder", vectors, grids), "g"
        if action is not None:
            x, embedder = torch.cat([x, action], dim=1), "f"
        entities.append(swished(p, embedder, x))
        absent.append(missing.to(grids))
    mask = torch.stack(absent, dim=1)
    pooled = swished(p, "trunk", attended(p, torch.stack(entities, dim=1), mask))
    n = (1 - mask).sum(1, keepdim=True)
    most = torch.maximum(p["most"], n.max())
    return dense(p, "value", torch.cat([pooled, 2 * n / most - 1], dim=1))[:, 0]


def group_worth(
    p: dict[str, Tensor], vectors: Tensor, grids: Tensor, alive: Tensor, actions: Tensor
) -> tuple[Tensor, Tensor]:
    """Values and baselines (B, G), each agent's row on its own."""
    grids = grids.to(p["value.weight"])
    G = vectors.shape[1]
    seen = torch.where(alive[..., None], vectors, float("nan"))
    did = torch.where(alive[..., None], actions, 0.0)
    values, baselines = [], []
    for j in range(G):
        mates = [k for k in range(G) if k != j]
        everyone = [seen[:, k] for k in [j, *mates]]
        values.append(worth(p, everyone, [], grids))
        acting = [(seen[:, k], did[:, k]) for k in mates]
        baselines.append(worth(p, [seen[:, j]], acting, grids))
    return torch.stack(values, dim=1), torch.stack(baselines, dim=1)


def body(p: dict[str, Tensor], vectors: Tensor, grids: Tensor) -> Tensor:
    """(B, G, V) -> (B, G, H), every agent with an image of its own."""
    grids = grids.to(p["body.layers.0.weight"])
    x = [encoded(p, "body.encoder", row, grids) for row in vectors.unbind(1)]
    return torch.stack([swished(p, "body.layers", row) for row in x], dim=1)


def acted(
    p: dict[str, Tensor], vectors: Tensor, grids: Tensor, actions: Tensor
) -> tuple[Tensor, Tensor]:
    """Log-probabilities (B, G, K) and entropies (B, G) of Gaussians and branches."""
    x = body(p, vectors, grids)
    mean, log_sigma = dense(p, "head.mean", x), p["head.log_sigma"]
    C = len(log_sigma)
    z = (actions[..., :C] - mean) / torch.exp(log_sigma)
    parts = [-(z**2) / 2 - log_sigma - math.log(2 * math.pi) / 2]
    entropy = (0.5 + 0.5 * math.log(2 * math.pi) + log_sigma).mean().expand(x.shape[:2])
    for branch in range(actions.shape[-1] - C):
        scores = torch.exp(dense(p, f"head.branches.{branch}", x))
        probs = scores / scores.sum(-1, keepdim=True)
        chosen = actions[..., C + branch].long()[..., None]
        parts.append(torch.log(probs.gather(-1, chosen)))
        entropy = entropy - (probs * torch.log(probs)).sum(-1)
    return torch.cat(parts, dim=-1), entropy
