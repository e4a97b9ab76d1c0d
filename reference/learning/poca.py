"""MA-POCA as ML-Agents 0.29.0 computes it: the robots' trainer.

The difference from `ppo`: the critic sees the whole group, the advantage is the
λ-return less a counterfactual baseline, and an agent that finishes early learns from
what its group does after it.  The group's critic and its attention come first.

    r    reward of the group;  V  value of the group;  b  baseline of one agent
    R    λ-return;  A  advantage, R − b;  γ, λ, ε, β, T, M  as in `ppo`
    B    group decisions in a batch;  G  agents of the group;  H  hidden units
    f    an agent with its action;  g  without it: the inputs of the attention
"""

from math import sqrt

import torch
from torch import Tensor, nn
from torch.nn import functional

from reference.game.codec import Sizes
from reference.learning.experience import Decisions, Trajectory, decisions_of
from reference.learning.networks import REFUSED, Encoder, layers, linear, value_head
from reference.learning.ppo import Learner, Summary, value_loss
from reference.learning.settings import ATTENTION_HEADS, TrainerSettings

NORM_EPSILON = 1e-5  # [E3, torch/layers.py] under the root of a layer norm
POOLING_EPSILON = 1e-7  # [E3, torch/attention.py] added to the number of live agents

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
    """Mean max((b − R)², (b_old + clip(b − b_old, ±ε) − R)²); all (M,).

    Unlike the value loss, it is clipped around the old baseline, with the policy's ε
    [E3, torch/utils.py].
    """
    clipped = old_baselines + (baselines - old_baselines).clamp(-epsilon, epsilon)
    unclipped_loss = (baselines - returns).square()
    clipped_loss = (clipped - returns).square()
    return torch.maximum(unclipped_loss, clipped_loss).mean()


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
        self.encoder = settings.network(Encoder)(sizes, settings)
        gain = sqrt(0.125 / hidden)  # T-Fixup [E3, torch/attention.py]
        size = self.encoder.size
        self.g = nn.Sequential(linear(size, hidden, gain), nn.SiLU())
        self.f = nn.Sequential(linear(size + sizes.continuous, hidden, gain), nn.SiLU())
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
        self, vectors: Tensor, grids: Tensor, alive: Tensor, actions: Tensor
    ) -> tuple[Tensor, Tensor]:
        """Values (B,) and baselines (B, G); actions: (B, G, C), what the agents did.

        The baseline of an absent agent means nothing.
        """
        encoded = self.encoder(vectors, grids)
        g = self.g(encoded)
        f = self.f(torch.cat([encoded, actions], dim=-1))
        value = self._value(self.attention(g, alive), alive)
        pooled = self.attention.counterfactual(f, g, alive)
        return value, self._value(pooled, alive[:, None])

    def _value(self, pooled: Tensor, alive: Tensor) -> Tensor:
        """(..., H) of sets, (..., G) bool -> (...): trunk, number of agents, head.

        `most` remembers the largest group that was ever valued, also outside training.
        """
        n = alive.sum(dim=-1, dtype=pooled.dtype)
        self.most = torch.maximum(self.most, n.max())
        share = (2 * n / self.most - 1).expand(pooled.shape[:-1])
        x = torch.cat([self.trunk(pooled), share[..., None]], dim=-1)
        value: Tensor = self.value(x)[..., 0]
        return value


class SelfAttention(nn.Module):
    """Residual self-attention over a set, pooled to the mean of live agents [E1].

    Scores are divided by the root of H, norms have no parameters, and the residual
    adds the normalised input [E3, torch/attention.py].
    """

    def __init__(self, hidden: int):
        super().__init__()
        deviation = sqrt(0.125 / hidden)  # T-Fixup, too
        self.query = linear(hidden, hidden, deviation)
        self.key = linear(hidden, hidden, deviation)
        self.to_value = linear(hidden, hidden, deviation)
        self.out = linear(hidden, hidden, deviation)

    def forward(self, entities: Tensor, alive: Tensor) -> Tensor:
        """(B, G, H) and (B, G) bool -> (B, H); absent agents do not count."""
        return self._pooled(self._projected(entities), alive)

    def counterfactual(self, f: Tensor, g: Tensor, alive: Tensor) -> Tensor:
        """Attend to the group without agent j's action, in row j: (B, G, H).

        Set j has f of every agent but j, and g of j; all sets pass the same attention.
        """
        G = f.shape[1]
        j = torch.arange(G)
        sets = self._projected(f)[:, None].repeat(1, G, 1, 1)  # (B, j, G, 4H)
        sets[:, j, j] = self._projected(g)
        return self._pooled(sets, alive[:, None])

    def _projected(self, entities: Tensor) -> Tensor:
        """(B, G, H) -> (B, G, 4H): normalised, then query, key and value of it."""
        x = layer_norm(entities)
        return torch.cat([x, self.query(x), self.key(x), self.to_value(x)], dim=-1)

    def _pooled(self, projected: Tensor, alive: Tensor) -> Tensor:
        """Attend, add, normalise and take the mean: (..., G, 4H) -> (..., H)."""
        x, q, k, v = projected.chunk(4, dim=-1)
        q = _by_head(q)
        k = _by_head(k)
        v = _by_head(v)
        scores = q @ k.transpose(-2, -1) / sqrt(x.shape[-1])  # (..., heads, G, G)
        scores = scores.masked_fill(~alive[..., None, None, :], REFUSED)
        attended = (scores.softmax(dim=-1) @ v).transpose(-3, -2).flatten(-2)
        rows = layer_norm(self.out(attended) + x) * alive[..., None]
        n = alive.sum(dim=-1, keepdim=True, dtype=x.dtype)
        return rows.sum(dim=-2) / (n + POOLING_EPSILON)


def _by_head(x: Tensor) -> Tensor:
    """(..., G, H) -> (..., heads, G, H / heads)."""
    return x.unflatten(-1, (ATTENTION_HEADS, -1)).transpose(-3, -2)


def layer_norm(x: Tensor) -> Tensor:
    """(..., H), mean 0 and variance 1, no parameters [E3, torch/layers.py]."""
    return functional.layer_norm(x, x.shape[-1:], eps=NORM_EPSILON)


# -- The learner --------------------------------------------------------------------


class GroupLearner(Learner):
    """The robots' trainer: PPO's policy loss with the group's critic."""

    make_critic = GroupCritic

    def evaluate(self, t: Trajectory, ends: list[int]) -> tuple[Tensor, Tensor, Tensor]:
        """Compute the group's value for each agent, its baseline, and what follows."""
        values, baselines = self.values_and_baselines(decisions_of(t))
        return values, baselines, self.next_values(t, ends)

    def values_and_baselines(self, decisions: Decisions) -> tuple[Tensor, Tensor]:
        """Compute the group's value for each agent, and its baseline: (T, G) each."""
        values, baselines = self.critic.with_baselines(
            decisions.vectors, decisions.grids, decisions.alive, decisions.actions
        )
        return values[:, None].expand_as(baselines).clone(), baselines

    def next_values(self, t: Trajectory, ends: list[int]) -> Tensor:
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

    def targets(
        self, rewards: Tensor, values: Tensor, baselines: Tensor, next_value: Tensor
    ) -> tuple[Tensor, Tensor]:
        """Advantages, λ-return less baseline, and λ-returns; (T, agents) each."""
        s = self.settings
        R = lambda_returns(rewards, values, next_value, s.gamma, s.lambd)
        return R - baselines, R

    def critic_terms(
        self, batch: Decisions, epsilon: float
    ) -> tuple[Tensor, dict[str, Tensor]]:
        """0.5·value + 0.25·baseline, live agents [E1] [E3, poca/optimizer_torch.py]."""
        live = batch.alive
        values, baselines = self.values_and_baselines(batch)
        value = value_loss(values[live], batch.returns[live])
        baseline = baseline_loss(
            baselines[live], batch.baselines[live], batch.returns[live], epsilon
        )
        parts = {"Losses/Value Loss": value, "Losses/Baseline Loss": baseline}
        return 0.5 * (value + 0.5 * baseline), parts

    def _estimates(self, buffer: Decisions) -> Summary:
        baseline = float(buffer.baselines[buffer.alive].mean())
        estimates = super()._estimates(buffer)
        return estimates | {"Policy/Extrinsic Baseline Estimate": baseline}


LEARNERS: dict[str, type[Learner]] = {"ppo": Learner, "poca": GroupLearner}
"""Both learners by `trainer_type`."""
