"""MA-POCA as ML-Agents 0.29.0 computes it: the robots' trainer.

Clauses: E1, E3, E5, C8.  The difference from `ppo`: the critic sees the whole group,
the advantage is the λ-return less a counterfactual baseline, and an agent that
finishes early learns from what its group does after it.

    r    reward of the group;  V  value of the group;  b  baseline of one agent
    R    λ-return;  A  advantage, R − b;  γ, λ, ε, β, T, M  as in `ppo`
    G    agents of the group
"""

import torch
from torch import Tensor

from reference.learning import ppo
from reference.learning.experience import Decisions, Trajectory
from reference.learning.networks import GroupCritic
from reference.learning.ppo import Summary, value_loss

# -- What has a formula -------------------------------------------------------------


def lambda_returns(
    rewards: Tensor, values: Tensor, next_value: Tensor, gamma: float, lambd: float
) -> Tensor:
    """λ-returns of one trajectory, bootstrapped from the group's value [E1] [E5].

    rewards, values: (T, ...); next_value: (...), what follows the last decision, 0
    where nothing does. Returns (T, ...):
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

    Unlike the value's, it is clipped around the old baseline, with the policy's ε.
    """
    change = (baselines - old_baselines).clamp(-epsilon, epsilon)
    clipped = old_baselines + change
    return torch.maximum(
        (baselines - returns).square(), (clipped - returns).square()
    ).mean()


# -- The learner --------------------------------------------------------------------


class Learner(ppo.Learner):
    """The robots' trainer: PPO's policy, the group's critic."""

    critic: GroupCritic

    def _critic(self) -> GroupCritic:
        return GroupCritic(self.sizes, self.settings)

    def _values(self, decisions: Decisions) -> tuple[Tensor, Tensor]:
        """The group's value for each of its agents, and each one's baseline: (T, G)."""
        values, baselines = self.critic.with_baselines(
            decisions.vectors, decisions.grids, decisions.alive, decisions.shown
        )
        return values[:, None].expand_as(baselines).clone(), baselines

    def _next_values(self, t: Trajectory, ends: list[int]) -> Tensor:
        """(len(ends), G): what follows the decisions `ends`, if trajectories end there.

        Posthumous credit [C8]: who is done while mates go on is worth what the group
        is, with its own last observation among theirs. Nothing follows if all who were
        there are done.
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

    def loss(
        self, batch: Decisions, epsilon: float, beta: float, critic_only: bool = False
    ) -> tuple[Tensor, dict[str, Tensor]]:
        """The summed loss of a minibatch, and its parts by their summary names.

        policy + 0.5·(value + 0.5·baseline) − β·entropy [E1] [E3].
        """
        live = batch.alive
        policy, entropy = self.policy_terms(batch, epsilon)
        values, baselines = self.critic.with_baselines(
            batch.vectors, batch.grids, batch.alive, batch.shown
        )
        returns = batch.returns[live]
        value = value_loss(values[:, None].expand_as(live)[live], returns)
        baseline = baseline_loss(
            baselines[live], batch.baselines[live], returns, epsilon
        )
        loss = 0.5 * (value + 0.5 * baseline)
        if not critic_only:
            loss = loss + policy - beta * entropy
        return loss, {
            "Losses/Policy Loss": policy,
            "Losses/Value Loss": value,
            "Losses/Baseline Loss": baseline,
            "Policy/Entropy": entropy,
        }

    def _estimates(self, buffer: Decisions) -> Summary:
        baselines = buffer.baselines[buffer.alive]
        return super()._estimates(buffer) | {
            "Policy/Extrinsic Baseline Estimate": float(baselines.mean())
        }


LEARNERS: dict[str, type[ppo.Learner]] = {"ppo": ppo.Learner, "poca": Learner}
"""Both learners by `trainer_type`."""
