"""MA-POCA in one file, against PPO, in a game for two agents. It takes 15 seconds.

    .venv/bin/python tutorials/ma_poca.py       # in its own small game
    .venv/bin/python tutorials/ma_poca.py mpe2.simple_spread_v3 75  # in PettingZoo's

MA-POCA (Cohen et al. 2021, arXiv 2111.05992) trains a group that is rewarded together
and whose members may finish at different times. It is PPO (Schulman et al. 2017, arXiv
1707.06347) with a critic for the group. This file needs torch alone, the second command
`pip install mpe2` too. Targets, losses and networks are those of `poca` and `ppo` in
ML-Agents 0.29.0: a test finds the same gradients in `reference.learning`. Left out are
schedules, time_horizon and normalised inputs. Four mistakes are easy to make, and the
program runs all the same: see `TRAP`.

    T, t   decisions of a group in one episode;  G  agents of the group
    B      decisions of the group in a minibatch;  M  decisions of single agents in it
    D      numbers that an agent observes;  K  components of an action;  H  hidden units
    o, a   what all agents observe and do;  alive  which of them still decide
    logp   log-probabilities of a's components when it was sampled
    r      reward of the group;  V  value of the group;  y  λ-return, the target of V
    Q      counterfactual baseline: value of the group without one agent's action
    A      advantage;  γ, λ, ε, β  as in the papers
"""

import sys
from dataclasses import dataclass
from importlib import import_module
from math import prod, sqrt
from typing import Any, NamedTuple

import torch
from torch import Tensor, nn
from torch.distributions import Normal
from torch.nn.functional import layer_norm


@dataclass(frozen=True)
class Settings:
    """What one tunes; in brackets what the robots' paper has (its Table I)."""
    gamma: float = 1.0  # γ, discount [0.9]
    lam: float = 0.5  # λ of the returns [0.95]
    epsilon: float = 0.2  # ε, clip range [0.2, falling to 0.1]
    beta: float = 0.005  # β, weight of the entropy [0.005]
    learning_rate: float = 0.003  # [0.0001, falling to 0]
    epochs: int = 3  # times that an update goes through its decisions [3]
    batch_size: int = 40  # group decisions in a minibatch [1024, of single agents]
    hidden: int = 32  # H [256]
    layers: int = 2  # [3]
    heads: int = 4  # of the attention [4]


# -- Games --------------------------------------------------------------------------


class Game:
    """Three decisions of two agents; only the first decision of agent 0 matters.

    Above 0 it goes, and is done: the group earns 3 on average, otherwise 1."""
    G, D, K = 2, 4, 1

    def reset(self) -> Tensor:
        """Begin an episode; return o (G, D)."""
        self.t = 0
        self.gone = False
        return self._observed()

    def step(self, a: Tensor) -> tuple[Tensor, Tensor, float, bool]:
        """a (G, K) in [-1, 1] -> o (G, D), alive (G,), the group's reward, over."""
        if self.t == 0:
            self.gone = a[0, 0].item() > 0
        luck = 1.0 if torch.rand(()) < 0.5 else 3.0
        rewards = (0.0, 1.0, luck) if self.gone else (0.0, 0.0, 1.0)
        r = rewards[self.t]
        self.t += 1
        alive = torch.tensor([not self.gone, True]) & (self.t < 3)
        return self._observed(), alive, r, self.t == 3

    def _observed(self) -> Tensor:  # who one is, the time, whether agent 0 has gone
        return torch.tensor([[1.0, 0, self.t, self.gone], [0.0, 1, self.t, self.gone]])


class Zoo:
    """A parallel environment of PettingZoo as such a game; its agents may leave.

    They are alike; r is the mean of theirs. An action is a box of numbers, or the
    largest of n numbers makes one of n choices.
    """

    def __init__(self, module: str):
        self.env = import_module(module).parallel_env()
        self.names = self.env.possible_agents
        self.box = self.env.action_space(self.names[0])
        self.n = int(getattr(self.box, "n", 0))
        self.G = len(self.names)
        self.K = self.n or prod(self.box.shape)
        self.D = prod(self.env.observation_space(self.names[0]).shape)

    def reset(self) -> Tensor:
        self.seen: dict[str, Any] = {}
        seed = int(torch.randint(2**31, ()))
        seen, _ = self.env.reset(seed=seed)
        return self._observed(seen)

    def step(self, a: Tensor) -> tuple[Tensor, Tensor, float, bool]:
        acts = {n: self._action(x) for n, x in zip(self.names, a, strict=True)}
        chosen = {name: acts[name] for name in self.env.agents}
        seen, rewards, _, cut, _ = self.env.step(chosen)
        r = sum(rewards.values()) / len(rewards)
        over = not self.env.agents
        left = self.env.agents or [n for n in cut if cut[n]]  # at the end: see Episode
        alive = torch.tensor([name in left for name in self.names])
        return self._observed(seen), alive, r, over

    def _action(self, a: Tensor) -> Any:
        if self.n:
            return int(a.argmax() + self.box.start)
        low, high = self.box.low, self.box.high
        share = (a.numpy().reshape(low.shape) + 1) / 2
        return low + share * (high - low)

    def _observed(self, seen: dict[str, Any]) -> Tensor:
        self.seen |= seen  # who has left keeps the last observation
        return torch.tensor([self.seen[n].ravel().tolist() for n in self.names])


class Episode(NamedTuple):
    """What a group observed, did and earned.

    Who is done does not come back; what it observes then is not read. o and alive have
    one row more: after the last decision. There those are alive whom a time limit cut
    off.
    """
    o: Tensor  # (T + 1, G, D)
    alive: Tensor  # (T + 1, G) bool
    a: Tensor  # (T, G, K)
    logp: Tensor  # (T, G, K)
    r: Tensor  # (T,)


@torch.no_grad()
def play(game: Game | Zoo, actor: "Actor") -> Episode:
    """Play one episode with sampled actions."""
    o = [game.reset()]
    alive = [torch.ones(game.G, dtype=torch.bool)]
    done = []
    over = False
    while not over:
        policy = actor(o[-1])
        a = policy.sample()  # (G, K); learners keep it as it is, the game clips it
        o_next, alive_next, r, over = game.step(a.clamp(-3, 3) / 3)
        done.append((a, policy.log_prob(a), torch.tensor(r)))
        o.append(o_next)
        alive.append(alive_next)
    rest = map(torch.stack, zip(*done, strict=True))
    return Episode(torch.stack(o), torch.stack(alive), *rest)


# -- Networks -----------------------------------------------------------------------


def linear(size: int, out: int, std: float) -> nn.Linear:
    """A layer (..., size) -> (..., out) with small normal weights and zero biases."""
    layer = nn.Linear(size, out)
    nn.init.normal_(layer.weight, std=std)
    nn.init.zeros_(layer.bias)
    return layer


def trunk(size: int, s: Settings, gain: float = 1.0) -> nn.Sequential:
    """Layers (..., size) -> (..., H), each with a swish, the last one too."""
    stack: list[nn.Module] = []
    for n in [size] + [s.hidden] * (s.layers - 1):
        stack += [linear(n, s.hidden, gain / sqrt(n)), nn.SiLU()]
    return nn.Sequential(*stack)


def value_head(size: int) -> nn.Linear:
    """A layer (..., size) -> (..., 1)."""
    head = linear(size, 1, 0.0)
    nn.init.xavier_uniform_(head.weight)
    return head


class Actor(nn.Module):
    """The policy, independent Gaussians. Agents share it, and decide without mates."""

    def __init__(self, D: int, K: int, s: Settings):
        super().__init__()
        self.trunk = trunk(D, s)
        self.mean = linear(s.hidden, K, 0.2 / sqrt(s.hidden))
        self.log_sigma = nn.Parameter(torch.zeros(K))  # the same wherever an agent is

    def forward(self, o: Tensor) -> Normal:
        """o (..., D) -> distributions (..., K)."""
        mean = self.mean(self.trunk(o))  # (..., K)
        return Normal(mean, self.log_sigma.exp().expand_as(mean))


class GroupCritic(nn.Module):
    """MA-POCA's critic: V of the group and Q of every agent, by one network.

    V   = value(attention({g(o_i): all i}))
    Q_j = value(attention({g(o_j)} + {f(o_i, a_i): all i but j})), without what j did
    """

    def __init__(self, D: int, K: int, s: Settings):
        super().__init__()
        std = sqrt(0.125 / s.hidden)
        self.g = nn.Sequential(linear(D, s.hidden, std), nn.SiLU())
        self.f = nn.Sequential(linear(D + K, s.hidden, std), nn.SiLU())
        self.attention = ResidualSelfAttention(s, std)
        self.trunk = trunk(s.hidden, s, gain=std)
        self.head = value_head(s.hidden + 1)
        self.register_buffer("most", torch.ones(()))  # agents ever alive at once

    def forward(self, o: Tensor, alive: Tensor) -> Tensor:
        """o (B, G, D), alive (B, G) -> V (B,)."""
        return self._value(self.g(o), alive)

    def counterfactual(self, o: Tensor, a: Tensor, alive: Tensor) -> Tensor:
        """o (B, G, D), a (B, G, K), alive (B, G) -> Q (B, G)."""
        g = self.g(o)  # (B, G, H)
        f = self.f(torch.cat([o, a], dim=-1))  # (B, G, H)
        own = torch.eye(g.shape[1], dtype=torch.bool)[..., None]  # (G, G, 1)
        sets = torch.where(own, g[:, None], f[:, None])  # (B, G, G, H): sets of Q_j
        return self._value(sets, alive[:, None].expand(sets.shape[:3]))

    def _value(self, agents: Tensor, alive: Tensor) -> Tensor:
        """Sets of agents (..., G, H), alive (..., G) -> one number each (...)."""
        x = self.trunk(self.attention(agents, alive))  # (..., H)
        n = alive.sum(dim=-1, keepdim=True).to(x.dtype)  # (..., 1)
        self.most = torch.maximum(self.most, n.max())
        share = 2 * n / self.most - 1  # (..., 1): the mean of a set hides its size
        return self.head(torch.cat([x, share], dim=-1))[..., 0]


class ResidualSelfAttention(nn.Module):
    """Each agent attends to all (Vaswani et al. 2017); then the mean over agents.

    As in ML-Agents scores are divided by √H, not by √(H / heads), norms have no
    parameters, and what is added is the normalised input.
    """

    def __init__(self, s: Settings, std: float):
        super().__init__()
        self.heads = s.heads
        self.query = linear(s.hidden, s.hidden, std)
        self.key = linear(s.hidden, s.hidden, std)
        self.to_value = linear(s.hidden, s.hidden, std)
        self.out = linear(s.hidden, s.hidden, std)

    def forward(self, x: Tensor, alive: Tensor) -> Tensor:
        """x (..., G, H), alive (..., G) -> (..., H). Absent agents have no effect."""
        H = x.shape[-1]
        x = layer_norm(x, (H,))
        projections = self.query, self.key, self.to_value
        q, k, v = (p(x).unflatten(-1, (self.heads, -1)) for p in projections)
        scores = torch.einsum("...ihd,...jhd->...hij", q, k) / sqrt(H)
        absent = ~alive[..., None, None, :]  # (..., 1, 1, G)
        weights = scores.masked_fill(absent, -1e9).softmax(-1)  # (..., heads, G, G)
        mixed = torch.einsum("...hij,...jhd->...ihd", weights, v)  # (..., G, heads, d)
        x = layer_norm(x + self.out(mixed.flatten(-2)), (H,))  # (..., G, H)
        there = alive[..., None].to(x.dtype)  # (..., G, 1)
        return (x * there).sum(-2) / (there.sum(-2) + 1e-7)


# -- Learners -----------------------------------------------------------------------


def lambda_returns(e: Episode, V: Tensor, V_end: Tensor, s: Settings) -> Tensor:
    """y_t = r_t + γ((1 − λ)V_t+1 + λy_t+1), at an agent's last decision r_t + γV_end_t.

    V, V_end (T, G) -> y (T, G).
    """
    y = torch.empty_like(V, memory_format=torch.contiguous_format)
    y[-1] = e.r[-1] + s.gamma * V_end[-1]
    for t in reversed(range(len(V) - 1)):
        goes_on = (1 - s.lam) * V[t + 1] + s.lam * y[t + 1]  # (G,)
        y[t] = e.r[t] + s.gamma * torch.where(e.alive[t + 1], goes_on, V_end[t])
    return y


def policy_loss(logp: Tensor, old_logp: Tensor, A: Tensor, epsilon: float) -> Tensor:
    """−mean min(ρA, clip(ρ, 1 ± ε)A); logp, old_logp (M, K), A (M,)."""
    # TRAP 1. Each component of an action has its own ratio ρ and its own clip. Do not
    # sum log-probabilities over components.
    rho = (logp - old_logp).exp()  # (M, K)
    clipped = rho.clamp(1 - epsilon, 1 + epsilon)
    A = A[:, None]  # (M, 1)
    return -torch.minimum(rho * A, clipped * A).mean()


def baseline_loss(Q: Tensor, old_Q: Tensor, y: Tensor, epsilon: float) -> Tensor:
    """mean max((Q − y)², (Q_old + clip(Q − Q_old, ±ε) − y)²); all (M,)."""
    clipped = old_Q + (Q - old_Q).clamp(-epsilon, epsilon)  # so scale y to about 1
    return torch.maximum((Q - y).square(), (clipped - y).square()).mean()


class Batch(NamedTuple):
    """Group decisions and what to learn from them, for agents that are alive."""
    o: Tensor  # (B, G, D)
    alive: Tensor  # (B, G) bool
    a: Tensor  # (B, G, K)
    logp: Tensor  # (B, G, K)
    A: Tensor  # (B, G)
    y: Tensor  # (B, G)
    Q: Tensor  # (B, G), as it was before the update


class PPO:
    """Each agent for itself: V of its own observation, and nothing after its end."""

    def __init__(self, D: int, K: int, s: Settings):
        self.s = s
        self.actor = Actor(D, K, s)
        self.critic = self.new_critic(D, K, s)
        both = [*self.actor.parameters(), *self.critic.parameters()]
        self.adam = torch.optim.Adam(both, lr=s.learning_rate)

    def new_critic(self, D: int, K: int, s: Settings) -> nn.Module:
        """o (..., G, D) -> V (..., G)."""
        return nn.Sequential(trunk(D, s), value_head(s.hidden), nn.Flatten(-2))

    @torch.no_grad()
    def targets(self, e: Episode) -> Batch:
        """A = y − V: this is GAE, the advantage of Schulman et al. (2016)."""
        V = self.critic(e.o[:-1])  # (T, G)
        V_end = self.critic(e.o[1:]) * e.alive[1:]  # (T, G)
        y = lambda_returns(e, V, V_end, self.s)
        return Batch(e.o[:-1], e.alive[:-1], e.a, e.logp, y - V, y, V)

    def critic_loss(self, b: Batch) -> Tensor:
        """0.5 · value loss, mean (V − y)²."""
        # TRAP 2. Many versions of PPO clip this loss. Here it is not; Q's is, below.
        V = self.critic(b.o)[b.alive]  # (M,)
        y = b.y[b.alive]  # (M,)
        return 0.5 * (V - y).square().mean()

    def loss(self, b: Batch) -> Tensor:
        """policy loss + critic loss − β · entropy, over agents that are alive."""
        live = b.alive
        policy = self.actor(b.o)
        logp = policy.log_prob(b.a)  # (B, G, K)
        of_policy = policy_loss(logp[live], b.logp[live], b.A[live], self.s.epsilon)
        entropy = policy.entropy()[live].mean()  # over components and agents
        return of_policy + self.critic_loss(b) - self.s.beta * entropy

    def update(self, episodes: list[Episode]) -> None:
        """Learn from some episodes, and forget them."""
        parts = [self.targets(e) for e in episodes]
        b = Batch(*(torch.cat(column) for column in zip(*parts, strict=True)))
        live = b.A[b.alive]  # normalised once, not in every minibatch
        b = b._replace(A=(b.A - live.mean()) / (live.std(correction=0) + 1e-10))
        for _ in range(self.s.epochs):
            for rows in torch.randperm(len(b.o)).split(self.s.batch_size):
                minibatch = Batch(*(x[rows] for x in b))
                self.adam.zero_grad()
                self.loss(minibatch).backward()
                self.adam.step()


class MAPOCA(PPO):
    """The group together: V of all, a baseline for each, and credit after its end."""
    def new_critic(self, D: int, K: int, s: Settings) -> nn.Module:
        return GroupCritic(D, K, s)

    @torch.no_grad()
    def targets(self, e: Episode) -> Batch:
        """A = y − Q: more than was to be expected, knowing what the mates did."""
        o = e.o[:-1]  # (T, G, D)
        alive = e.alive[:-1]  # (T, G)
        V = self.critic(o, alive)[:, None].expand(alive.shape)  # (T, G)
        # TRAP 3. Posthumous credit: after the end of an agent whose mates go on, V_end
        # is not 0. It is V of them, and of its own last observation. Only when all are
        # done, it is 0. (In Cohen et al. y goes on with the rewards of the mates.)
        V_end = self.critic(e.o[1:], alive) * e.alive[1:].any(dim=1)  # (T,)
        y = lambda_returns(e, V, V_end[:, None].expand(alive.shape), self.s)
        # TRAP 4. y is made of V alone. Q is subtracted only now: A is not GAE with Q.
        Q = self.critic.counterfactual(o, e.a, alive)  # (T, G)
        return Batch(o, alive, e.a, e.logp, y - Q, y, Q)

    def critic_loss(self, b: Batch) -> Tensor:
        """0.5 · (value loss + 0.5 · baseline loss)."""
        live = b.alive  # (B, G)
        y = b.y[live]  # (M,)
        V = self.critic(b.o, live)[:, None].expand(live.shape)[live]  # (M,)
        Q = self.critic.counterfactual(b.o, b.a, live)[live]  # (M,)
        of_value = (V - y).square().mean()
        of_baseline = baseline_loss(Q, b.Q[live], y, self.s.epsilon)
        return 0.5 * (of_value + 0.5 * of_baseline)


UPDATES = 20
EPISODES = 40
SEEDS = 3
LARGER = Settings(gamma=0.95, lam=0.9, learning_rate=0.0003, batch_size=125, hidden=64)


def trained(kind: Any, seed: int, module: str = "", updates: int = UPDATES) -> Any:
    """Train a learner; return (updates,) what its episodes earned on average."""
    torch.manual_seed(seed)
    game = Zoo(module) if module else Game()
    s = LARGER if module else Settings()
    learner = kind(game.D, game.K, s)
    curve = []
    unit = 0.0
    for _ in range(updates):
        episodes = [play(game, learner.actor) for _ in range(EPISODES)]
        earned = torch.stack([e.r.sum() for e in episodes])
        curve.append(earned.mean())
        unit = unit or earned.abs().mean().item() or 1.0  # y is about 1
        learner.update([e._replace(r=e.r / unit) for e in episodes])
    return torch.stack(curve)


def main(module: str = "", updates: int = UPDATES) -> dict[str, Tensor]:
    """Train both learners; print mean curves, return all of them (SEEDS, updates)."""
    torch.set_num_threads(1)  # networks as small as these are quickest on one core
    found = {}
    for kind in (MAPOCA, PPO):
        runs = torch.stack([trained(kind, n, module, updates) for n in range(SEEDS)])
        found[kind.__name__] = runs
        mean = runs.mean(dim=0).tolist()
        earned = " ".join(f"{each:.1f}" for each in mean)
        print(f"{kind.__name__}, what an episode earns, update by update: {earned}")
        print(kind.__name__, "ends at", round(mean[-1]))
    return found


if __name__ == "__main__":
    asked = sys.argv[1:]
    module = asked[0] if asked else ""
    updates = int(asked[1]) if len(asked) > 1 else UPDATES
    main(module, updates)
#> MAPOCA ends at 3
#> PPO ends at 1

# Exercise. Agent 1's first decision changes nothing. How far do its advantages spread,
# and how far would they with A = y − V? Hint: `targets` in a subclass of MAPOCA.
