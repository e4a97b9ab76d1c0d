"""MA-POCA as ML-Agents 0.29.0 computes it: the robots' trainer.

Clauses: E1, E3, E5, C8.  The difference from `ppo`: the critic sees the whole group,
the advantage is the λ-return less a counterfactual baseline, and an agent that
finishes early learns from what its group does after it.  The group's critic and its
attention stand below the learner.

    r    reward of the group;  V  value of the group;  b  baseline of one agent
    R    λ-return;  A  advantage, R − b;  γ, λ, ε, β, T, M  as in `ppo`
    B    group decisions in a batch;  G  agents of the group;  H  hidden units
    f    an agent with its action;  g  without it: the inputs of the attention
"""

from math import sqrt

import torch
from torch import Tensor, nn
from torch.nn import functional

from reference.learning import ppo
from reference.learning.experience import Decisions, Trajectory
from reference.learning.networks import (
    REFUSED,
    Encoder,
    Sizes,
    layers,
    linear,
    value_head,
)
from reference.learning.ppo import Summary, value_loss
from reference.learning.settings import ATTENTION_HEADS, TrainerSettings

NORM_EPSILON = 1e-5  # [E3] under the root of a layer norm
POOLING_EPSILON = 1e-7  # [E3] added to the number of live agents

# -- Formulas -----------------------------------------------------------------------


def lambda_returns(
    rewards: Tensor, values: Tensor, next_value: Tensor, gamma: float, lambd: float
) -> Tensor:
    """λ-returns of one trajectory, bootstrapped from the group's value [E1] [E5].

    rewards, values: (T, ...); next_value: (...), the value after the last decision, 0
    where nothing follows. Returns (T, ...):
    R_t = r_t + γ((1 − λ)V_t+1 + λR_t+1), and R_T−1 = r_T−1 + γ·next_value.
    """
    returns = torch.empty_like(rewards)
    returns[-1] = rewards[-1] + gamma * next_value
    for t in reversed(range(len(rewards) - 1)):
        following = (1 - lambd) * values[t + 1] + lambd * returns[t + 1]
        returns[t] = rewards[t] + gamma * following
    return returns


def baseline_loss(
    baselines: Tensor, old_baselines: Tensor, returns: Tensor, epsilon: float
) -> Tensor:
    """Mean max((b − R)², (b_old + clip(b − b_old, ±ε) − R)²) [E3]; all (M,).

    Unlike the value loss, it is clipped around the old baseline, with the policy's ε.
    """
    change = (baselines - old_baselines).clamp(-epsilon, epsilon)
    clipped = old_baselines + change
    return torch.maximum(
        (baselines - returns).square(), (clipped - returns).square()
    ).mean()


# -- The learner --------------------------------------------------------------------


class Learner(ppo.Learner):
    """The robots' trainer: PPO's policy loss with the group's critic."""

    critic: "GroupCritic"

    def _critic(self) -> "GroupCritic":
        return GroupCritic(self.sizes, self.settings)

    def _values(self, decisions: Decisions) -> tuple[Tensor, Tensor]:
        """Compute the group's value for each agent, and its baseline: (T, G) each."""
        values, baselines = self.critic.with_baselines(
            decisions.vectors, decisions.grids, decisions.alive, decisions.shown
        )
        return values[:, None].expand_as(baselines).clone(), baselines

    def _next_values(self, t: Trajectory, ends: list[int]) -> Tensor:
        """Compute the values after the decisions `ends`: (len(ends), G).

        Posthumous credit [C8]: an agent that is done while mates go on still gets the
        group's next value, with its own last observation in it; 0 if all are done.
        """
        after = [end + 1 for end in ends]
        values = self.critic(
            torch.from_numpy(t.vectors[after]),
            torch.from_numpy(t.grids[after]),
            torch.from_numpy(t.alive[ends]),
        )
        goes_on = torch.from_numpy(t.alive[after].any(axis=1))
        return (values * goes_on)[:, None].expand(-1, t.alive.shape[1])

    def _targets(
        self, rewards: Tensor, values: Tensor, baselines: Tensor, next_value: Tensor
    ) -> tuple[Tensor, Tensor]:
        """Advantages, λ-return less baseline, and λ-returns; (T, agents) each."""
        s = self.settings
        R = lambda_returns(rewards, values, next_value, s.gamma, s.lambd)
        return R - baselines, R

    def critic_terms(
        self, batch: Decisions, epsilon: float
    ) -> tuple[Tensor, dict[str, Tensor]]:
        """0.5·(value + 0.5·baseline), of the live agents [E1] [E3]."""
        live = batch.alive
        values, baselines = self.critic.with_baselines(
            batch.vectors, batch.grids, live, batch.shown
        )
        returns = batch.returns[live]
        value = value_loss(values[:, None].expand_as(live)[live], returns)
        baseline = baseline_loss(
            baselines[live], batch.baselines[live], returns, epsilon
        )
        parts = {"Losses/Value Loss": value, "Losses/Baseline Loss": baseline}
        return 0.5 * (value + 0.5 * baseline), parts

    def _estimates(self, buffer: Decisions) -> Summary:
        baselines = buffer.baselines[buffer.alive]
        return super()._estimates(buffer) | {
            "Policy/Extrinsic Baseline Estimate": float(baselines.mean())
        }


# -- The critic ---------------------------------------------------------------------


class GroupCritic(nn.Module):
    """MA-POCA's critic: one network for the value and all baselines [E1].

    For the value, every live agent enters as g. For the baseline of agent j, j enters
    as g and its mates as f: the group's value without knowing what j did.
    """

    most: Tensor

    def __init__(self, sizes: Sizes, settings: TrainerSettings):
        super().__init__()
        hidden = settings.hidden_units
        self.encoder = Encoder(sizes, settings)
        gain = sqrt(0.125 / hidden)
        self.g = nn.Sequential(linear(self.encoder.size, hidden, gain), nn.SiLU())
        with_action = self.encoder.size + sizes.shown
        self.f = nn.Sequential(linear(with_action, hidden, gain), nn.SiLU())
        self.attention = SelfAttention(hidden)
        self.trunk = layers(hidden, hidden, settings.num_layers, gain)
        self.value = value_head(hidden + 1)
        self.register_buffer("most", torch.ones(()))

    def forward(self, vectors: Tensor, grids: Tensor, alive: Tensor) -> Tensor:
        """Values (B,) of groups: (B, G, V), (B, channels, height, width), (B, G) bool.

        Rows of absent agents have no effect, but must be finite.
        """
        g = self.g(self.encoder(vectors, grids))
        return self._value(self.attention(g, alive), alive)

    def with_baselines(
        self, vectors: Tensor, grids: Tensor, alive: Tensor, shown: Tensor
    ) -> tuple[Tensor, Tensor]:
        """Values (B,) and baselines (B, G); shown: (B, G, E), what the agents did.

        The baseline of an absent agent means nothing.
        """
        encoded = self.encoder(vectors, grids)
        g = self.g(encoded)
        f = self.f(torch.cat([encoded, shown], dim=-1))
        value = self._value(self.attention(g, alive), alive)
        baselines = self._value(
            self.attention.counterfactual_at_once(f, g, alive), alive
        )
        return value, baselines

    def _value(self, pooled: Tensor, alive: Tensor) -> Tensor:
        """(B, H) -> (B,), or (B, G, H) -> (B, G): trunk, number of agents, head."""
        n = alive.sum(dim=1, dtype=pooled.dtype)
        self.most = torch.maximum(self.most, n.max())
        share = 2 * n / self.most - 1
        share = share.reshape(-1, *[1] * (pooled.dim() - 1))
        share = share.expand(*pooled.shape[:-1], 1)
        return self.value(torch.cat([self.trunk(pooled), share], dim=-1))[..., 0]


class SelfAttention(nn.Module):
    """Residual self-attention over a set, pooled to the mean of live agents [E1].

    Scores are divided by the root of H, norms have no parameters, and the residual
    adds the normalised input [E3].
    """

    def __init__(self, hidden: int):
        super().__init__()
        deviation = sqrt(0.125 / hidden)
        self.query = linear(hidden, hidden, deviation)
        self.key = linear(hidden, hidden, deviation)
        self.to_value = linear(hidden, hidden, deviation)
        self.out = linear(hidden, hidden, deviation)

    def forward(self, entities: Tensor, alive: Tensor) -> Tensor:
        """(B, G, H) and (B, G) bool -> (B, H)."""
        x = layer_norm(entities)
        q, k, v = self._projected(x)
        weights = self._weights(torch.einsum("bahd,bchd->bhac", q, k), alive)
        attended = torch.einsum("bhac,bchi->bai", weights, v) + self.out.bias
        return self._pooled(attended + x, alive)

    def counterfactual(self, f: Tensor, g: Tensor, alive: Tensor) -> Tensor:
        """Attend to the group without agent j's action, in row j: (B, G, H).

        Set j has f of every agent but j, and g of j; all sets pass the same attention.
        This version is for readers: learners compute `counterfactual_at_once`, which a
        test holds equal to it.
        """
        rows = []
        for j in range(f.shape[1]):
            without_j = torch.cat([f[:, :j], g[:, j : j + 1], f[:, j + 1 :]], dim=1)
            rows.append(self(without_j, alive))
        return torch.stack(rows, dim=1)

    def counterfactual_at_once(self, f: Tensor, g: Tensor, alive: Tensor) -> Tensor:
        """Compute `counterfactual` faster: the sets differ in one entity each.

        So project once per entity, score once per pair; only the softmax is for each j.
            j  whose action is taken out;  a  who asks (query);  c  who is asked (key)
        """
        G = f.shape[1]
        f, g = layer_norm(f), layer_norm(g)
        (q_f, k_f, v_f), (q_g, k_g, v_g) = self._projected(f), self._projected(g)
        same = torch.eye(G, dtype=torch.bool, device=f.device)
        j_asks, j_asked = same[:, :, None], same[:, None, :]
        pair = "bahd,bchd->bhac"
        ff, fg = torch.einsum(pair, q_f, k_f), torch.einsum(pair, q_f, k_g)
        gf, gg = torch.einsum(pair, q_g, k_f), torch.einsum(pair, q_g, k_g)
        asked_by_f = torch.where(j_asked, fg[:, :, None], ff[:, :, None])
        asked_by_g = torch.where(j_asked, gg[:, :, None], gf[:, :, None])
        scores = torch.where(j_asks, asked_by_g, asked_by_f)  # (B, heads, j, a, c)
        weights = self._weights(scores, alive)
        of_f = weights.masked_fill(j_asked, 0.0)
        of_g = weights.diagonal(dim1=2, dim2=4)  # (B, heads, a, j): c = j
        attended = torch.einsum("bhjac,bchi->bjai", of_f, v_f)
        attended = attended + torch.einsum("bhaj,bjhi->bjai", of_g, v_g)
        x = torch.where(same[:, :, None], g[:, None], f[:, None])
        return self._pooled(attended + self.out.bias + x, alive)

    def _projected(self, x: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """Compute queries, keys (B, G, heads, d), and values that have passed `out`.

        Attention and `out` are both linear in the values, so each head's values may
        pass its part of `out` before they are mixed: (B, G, heads, H).
        """
        B, G, H = x.shape
        inner = (self.query, self.key, self.to_value)
        q, k, v = (p(x).view(B, G, ATTENTION_HEADS, -1) for p in inner)
        part = self.out.weight.view(H, ATTENTION_HEADS, -1)
        return q / sqrt(H), k, torch.einsum("bchd,ihd->bchi", v, part)

    @staticmethod
    def _weights(scores: Tensor, alive: Tensor) -> Tensor:
        """Take the softmax over the last axis; absent agents get weight 0."""
        there = alive.view(alive.shape[0], *[1] * (scores.dim() - 2), alive.shape[1])
        return scores.masked_fill(~there, REFUSED).softmax(dim=-1)

    @staticmethod
    def _pooled(x: Tensor, alive: Tensor) -> Tensor:
        """Average the live agents' normalised rows: (B, ..., G, H) -> (B, ..., H)."""
        n = alive.sum(dim=1, dtype=x.dtype).view(-1, *[1] * (x.dim() - 2))
        there = alive.view(alive.shape[0], *[1] * (x.dim() - 3), -1, 1)
        return (layer_norm(x) * there).sum(dim=-2) / (n + POOLING_EPSILON)


def layer_norm(x: Tensor) -> Tensor:
    """(..., H) with mean 0 and variance 1 along H, without parameters [E3]."""
    return functional.layer_norm(x, x.shape[-1:], eps=NORM_EPSILON)


LEARNERS: dict[str, type[ppo.Learner]] = {"ppo": ppo.Learner, "poca": Learner}
"""Both learners by `trainer_type`."""
