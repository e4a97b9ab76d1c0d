"""PPO as ML-Agents 0.29.0 computes it: the fire's trainer, and the robots' ablation.

First the formulas, as pure functions on plain tensors; then the learner, whose `update`
reads from top to bottom.

    r    reward;  V  value;  A  advantage;  R  return;  ρ  ratio of probabilities
    γ    discount (gamma);  λ  (lambd);  ε  clip range (epsilon);  β  weight of entropy
    T    decisions;  M  rows of a minibatch;  K  components of an action:
         the fire's are a place's x and y, then its floor [D2]

Where this differs from ML-Agents on purpose is listed at the end of the file.
"""

from collections import defaultdict
from collections.abc import Sequence
from statistics import mean
from typing import Any

import torch
from torch import Tensor, nn

from reference.game.codec import Sizes
from reference.learning.experience import (
    Decisions,
    Trajectory,
    decisions_of,
    minibatches,
    segments,
)
from reference.learning.networks import Actor, Body, Normaliser, value_head
from reference.learning.settings import TrainerSettings

LEAST_RATE = 1e-10  # [E3, ppo/optimizer_torch.py] floors of the linear schedules
LEAST_EPSILON = 0.1
LEAST_BETA = 1e-5
ADVANTAGE_EPSILON = 1e-10  # [E3, ppo/trainer.py] added to the standard deviation

Summary = dict[str, float]  # means by ML-Agents' summary names


# -- Formulas -----------------------------------------------------------------------


def scheduled(
    start: float, floor: float, step: int, max_steps: int, schedule: str
) -> float:
    """A setting at a step: linear to its floor, or constant [E3, torch/utils.py]."""
    if schedule == "constant":
        return start
    return (start - floor) * (1 - min(step, max_steps) / max_steps) + floor


def gae(
    rewards: Tensor, values: Tensor, next_value: Tensor, gamma: float, lambd: float
) -> Tensor:
    """Generalised advantage estimates of one trajectory [E2] [E5].

    rewards, values: (T, ...); next_value: (...), the value after the last decision, 0
    where nothing follows. Returns (T, ...):
    A_t = δ_t + γλ A_t+1 with δ_t = r_t + γ V_t+1 − V_t.
    """
    next_values = torch.cat([values[1:], next_value[None]])
    deltas = rewards + gamma * next_values - values
    advantages = torch.empty_like(deltas)
    following = torch.zeros_like(next_value)
    for t in reversed(range(len(deltas))):
        following = deltas[t] + gamma * lambd * following
        advantages[t] = following
    return advantages


def normalised(advantages: Tensor) -> Tensor:
    """(N,), mean 0 and deviation 1 over the whole buffer [E3, ppo/trainer.py]."""
    deviation = advantages.std(correction=0)
    return (advantages - advantages.mean()) / (deviation + ADVANTAGE_EPSILON)


def policy_loss(
    log_probs: Tensor, old_log_probs: Tensor, advantages: Tensor, epsilon: float
) -> Tensor:
    """−mean min(ρA, clip(ρ, 1 ± ε)A), per component [E3, torch/utils.py].

    log_probs, old_log_probs: (M, K); advantages: (M,), the same for a row's components.
    """
    A = advantages[:, None]
    rho = torch.exp(log_probs - old_log_probs)
    clipped = rho.clamp(1 - epsilon, 1 + epsilon)
    return -torch.minimum(rho * A, clipped * A).mean()


def value_loss(values: Tensor, returns: Tensor) -> Tensor:
    """Mean (V − R)²; both (M,).

    [E3, torch/utils.py] ML-Agents clips a value's change, but 0.29.0 reads the old
    value from the field of the returns, so its clip does nothing. A baseline has its
    own field, see `poca.baseline_loss`.
    """
    return (values - returns).square().mean()


# -- Critic and learner -------------------------------------------------------------


class Critic(nn.Module):
    """PPO's critic: the value of an agent's own observation [E2]."""

    def __init__(self, sizes: Sizes, settings: TrainerSettings):
        super().__init__()
        self.body = Body(sizes, settings)
        self.value = value_head(settings.hidden_units)

    def forward(self, vectors: Tensor, grids: Tensor) -> Tensor:
        """(B, G, V) and (B, channels, height, width) -> values (B, G)."""
        return self.value(self.body(vectors, grids))[..., 0]


class Learner:
    """One side's trainer: networks, buffer, optimiser and steps so far."""

    make_critic: Any = Critic

    def __init__(self, settings: TrainerSettings, sizes: Sizes, seed: int):
        self.settings = settings
        with torch.random.fork_rng(devices=[]):
            torch.manual_seed(seed)
            self.actor = settings.network(Actor)(sizes, settings)
            self.critic = self.make_critic(sizes, settings)
        self.rng = torch.Generator().manual_seed(seed)
        both = [*self.actor.parameters(), *self.critic.parameters()]
        # `update` sets the learning rate
        self.optimiser = torch.optim.Adam(both, fused=True)
        self.buffer: list[Decisions] = []
        self.reward_scale = settings.strength * settings.reward_scale
        self.steps = 0

    def add(self, trajectories: Sequence[Trajectory]) -> None:
        """Add whole episodes: normalise, value them, count their steps."""
        self.update_normalisers(trajectories)
        for t in trajectories:
            self.buffer.append(self.with_targets(t))
            self.steps += t.steps

    @property
    def full(self) -> bool:
        """More than `buffer_size` steps wait for an update [E3, ppo/trainer.py]."""
        steps = sum(int(part.alive.sum()) for part in self.buffer)
        return steps > self.settings.buffer_size

    def update_normalisers(self, trajectories: Sequence[Trajectory]) -> None:
        """Show both networks' normalisers what agents observed when they decided."""
        for module in (*self.actor.modules(), *self.critic.modules()):
            if isinstance(module, Normaliser):
                for decisions in map(decisions_of, trajectories):
                    module.update(decisions.vectors[decisions.alive])

    @torch.no_grad()
    def with_targets(self, t: Trajectory) -> Decisions:
        """Compute a trajectory's values, advantages and returns."""
        decisions = decisions_of(t)
        rewards = torch.from_numpy(t.rewards).float() * self.reward_scale
        spans = list(segments(t.alive, self.settings.time_horizon))

        # values
        ends = sorted({stop - 1 for _, stop, _ in spans})
        decisions.values, decisions.baselines, following = self.evaluate(t, ends)
        next_values = torch.zeros_like(decisions.values)
        next_values[ends] = following

        # targets, segment by segment
        for start, stop, agents in spans:
            span = slice(start, stop)
            A, R = self.targets(
                rewards[span, None].expand(-1, len(agents)),
                decisions.values[span, agents],
                decisions.baselines[span, agents],
                next_values[stop - 1, agents],
            )
            decisions.advantages[span, agents] = A
            decisions.returns[span, agents] = R
        return decisions

    def evaluate(self, t: Trajectory, ends: list[int]) -> tuple[Tensor, Tensor, Tensor]:
        """Compute values and baselines (T, G), and values after the decisions `ends`.

        PPO's baselines are 0. After `ends`: (len(ends), G), 0 for agents that are done,
        the next observation's value for those cut off.
        """
        values = self.critic(torch.from_numpy(t.vectors), torch.from_numpy(t.grids))
        after = [end + 1 for end in ends]
        following = values[after] * torch.from_numpy(t.alive[after])
        return values[:-1], torch.zeros_like(values[:-1]), following

    def targets(
        self, rewards: Tensor, values: Tensor, baselines: Tensor, next_value: Tensor
    ) -> tuple[Tensor, Tensor]:
        """Advantages by GAE, and returns: advantage plus value; (T, agents) each."""
        s = self.settings
        A = gae(rewards, values, next_value, s.gamma, s.lambd)
        return A, A + values

    def joined(self, parts: Sequence[Decisions]) -> Decisions:
        """Join the parts of a buffer."""
        return Decisions.joined(parts)

    def update(self) -> Summary:
        """Learn from the whole buffer, `num_epoch` times, and empty it."""
        s = self.settings
        buffer = self.joined(self.buffer)
        self.buffer = []
        live = buffer.alive
        buffer.advantages[live] = normalised(buffer.advantages[live])
        learning_rate, epsilon, beta = self.schedules()
        for group in self.optimiser.param_groups:
            group["lr"] = learning_rate

        seen: dict[str, list[float]] = defaultdict(list)
        for _ in range(s.num_epoch):
            for batch in minibatches(buffer, s.batch_size, self.rng):
                loss, parts = self.loss(batch, epsilon, beta)
                self.optimiser.zero_grad()
                loss.backward()
                self.optimiser.step()
                for name, value in parts.items():
                    seen[name].append(float(value.detach()))

        return {
            **{name: mean(values) for name, values in seen.items()},
            "Policy/Learning Rate": learning_rate,
            "Policy/Epsilon": epsilon,
            "Policy/Beta": beta,
            **self._estimates(buffer),
        }

    def loss(
        self, batch: Decisions, epsilon: float, beta: float
    ) -> tuple[Tensor, dict[str, Tensor]]:
        """The summed loss of a minibatch, and its parts by their summary names.

        policy + 0.5·value − β·entropy, live agents [E2] [E3, ppo/optimizer_torch.py].
        """
        live = batch.alive
        policy = self.actor(batch.vectors, batch.grids)
        of_policy = policy_loss(
            policy.log_probs(batch.actions)[live],
            batch.log_probs[live],
            batch.advantages[live],
            epsilon,
        )
        entropy = policy.entropy()[live].mean()
        of_critic, parts = self.critic_terms(batch, epsilon)
        parts = {"Losses/Policy Loss": of_policy, **parts, "Policy/Entropy": entropy}
        return of_critic + of_policy - beta * entropy, parts

    def critic_terms(
        self, batch: Decisions, epsilon: float
    ) -> tuple[Tensor, dict[str, Tensor]]:
        """The critic's part of the loss, and what to report of it."""
        values = self.critic(batch.vectors, batch.grids)
        value = value_loss(values[batch.alive], batch.returns[batch.alive])
        return 0.5 * value, {"Losses/Value Loss": value}

    def schedules(self) -> tuple[float, float, float]:
        """Learning rate, ε and β at this step [E3, ppo/optimizer_torch.py]."""
        s = self.settings
        at = self.steps
        end = s.max_steps
        return (
            scheduled(s.learning_rate, LEAST_RATE, at, end, s.learning_rate_schedule),
            scheduled(s.epsilon, LEAST_EPSILON, at, end, s.epsilon_schedule),
            scheduled(s.beta, LEAST_BETA, at, end, s.beta_schedule),
        )

    def _estimates(self, buffer: Decisions) -> Summary:
        values = buffer.values[buffer.alive]
        return {"Policy/Extrinsic Value Estimate": float(values.mean())}


# -- Deliberate differences from ML-Agents, here and in `poca` [E3, deviation] -------
#
# * minibatches shuffle whole group decisions, not single agents' rows: a group is
#   encoded once; mates' targets are alike, so the critic's gradient is noisier (6.7
#   times, measured on one buffer); for the fire there is no difference;
# * normalisers of both networks take in all trajectories that arrive together before
#   their values are computed (the original: trajectory by trajectory), in float64;
# * an agent that finishes early is bootstrapped with what its mates observe after it
#   has gone, and its last decision is valued with what they saw and did just then; in
#   the original both are one decision older;
# * log-probabilities and entropies are exact; the original adds 1e-7 within logarithms
#   and to 2σ²: less than 1e-5 of difference for options above 1 %, and for σ above
#   0.2 within 4 σ of the mean;
# * "Losses/Policy Loss" keeps its sign (the original drops it); "Policy/Entropy" is
#   measured on the minibatches (the original: when agents act); estimates are means
#   over decisions, in scaled reward (the original: of trajectories' means);
# * whole rounds arrive before the buffer is checked: an update uses more steps than the
#   original's, with preset `paper` less than 19 %; training ends after the
#   round that reaches `max_steps`, the original at the first step beyond;
# * agents cut off by time are bootstrapped, as in the original, but not a fire that has
#   lit its last source: it has nothing left to do, and no value was learned for that;
#   a robot that finishes in the step that cuts off its mates is bootstrapped, too (the
#   original takes mates cut off for done: 0);
# * beta_schedule and epsilon_schedule that a file leaves unset are the learning rate's,
#   as the original documents (its code takes "linear", unless `trainer_type` stands
#   before the hyperparameters in the file);
# * an episode's length counts the robots' decisions, for the fire too (the original:
#   each agent's own); a summary's row and a checkpoint stand where a round ended, one
#   for all multiples of `summary_freq` or `checkpoint_interval` in it (the original: at
#   each), so that `keep_checkpoints` reach farther back;
# * a training that begins with a policy learned before takes the actor alone, and at
#   first its new critic learns alone (the original: whatever fits);
# * rewards are scaled by `reward_scale`, too (the original: by `strength` alone);
# * MA-POCA's critic takes continuous actions alone: our robots have no branch (C5).
