"""MA-POCA: its formulas, who is credited with what, and a task only it can solve.

The whole loss and its gradients are compared with `tutorials/ma_poca.py`. The last
section is the point of it all: a small game with a known answer, played by the learner
and by one with a single line of it taken out.
"""

import numpy as np
import oracle
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st
from lives import SIZES, life, random, settings, tensor

from reference.game.codec import Sizes
from reference.learning.experience import Trajectory
from reference.learning.poca import GroupLearner, baseline_loss, lambda_returns
from reference.learning.ppo import gae

# -- What has a formula -------------------------------------------------------------


@pytest.mark.paper("E1")
def test_lambda_returns_of_three_decisions_by_hand():
    """γ = λ = ½: R₂ = 1 + ½·2, R₁ = 0 + ½(½·3 + ½·2), R₀ = 1 + ½(½·1 + ½·1.25)."""
    rewards = tensor(1, 0, 1)
    values = tensor(9, 1, 3)
    (last,) = tensor(2)
    R = lambda_returns(rewards, values, last, 0.5, 0.5)
    assert R.tolist() == [1.5625, 1.25, 2.0]


@pytest.mark.paper("E1")
@given(st.integers(1, 12), st.floats(0, 1), st.floats(0, 1), st.integers(0, 99))
def test_a_lambda_return_is_gae_and_the_value(T, gamma, lambd, seed):
    """With the same V: so what is new in MA-POCA is the baseline alone."""
    rewards = random(seed, T, 2)
    values = random(seed + 1, T, 2)
    last = random(5, 2)
    R = lambda_returns(rewards, values, last, gamma, lambd)
    advantages = gae(rewards, values, last, gamma, lambd)
    assert torch.allclose(R, advantages + values, atol=1e-9)


@pytest.mark.paper("E3")
def test_the_baseline_s_loss_is_clipped_around_the_old_baseline():
    """b_old = 0, R = 1, ε = 0.2. Too far in one step: b = 1 counts as 0.2, 0.8² and no
    pull; backwards, b = −1 counts as what it is, 2²."""
    b = tensor(1, -1, 0.1).requires_grad_()
    old = tensor(0, 0, 0)
    R = tensor(1, 1, 1)
    loss = baseline_loss(b, old, R, 0.2)
    loss.backward()
    assert loss.item() == pytest.approx((0.64 + 4 + 0.81) / 3)
    assert b.grad.tolist() == pytest.approx([0, -4 / 3, -1.8 / 3])


def made(seed=1, sizes=SIZES, **changes):
    """A learner whose network is small, and its numbers far from zero."""
    learner = GroupLearner(settings("poca", **changes), sizes, seed)
    torch.manual_seed(seed)
    with torch.no_grad():
        for p in [*learner.actor.parameters(), *learner.critic.parameters()]:
            p.add_(0.2 * torch.randn_like(p))
    learner.update_normalisers([life("######", sizes=sizes, seed=7)])
    return learner


# -- Posthumous credit --------------------------------------------------------------


def added(learner, t):
    """What the learner makes of a life: an advantage is the return less a baseline."""
    learner.add([t])
    part = learner.buffer[-1]
    over = part.returns - part.baselines
    live = part.alive
    assert torch.allclose(part.advantages[live], over[live], atol=1e-6)
    return part


def after(learner, t, at, who):
    """What the group `who` is worth in what was observed after decision `at`."""
    alive = torch.zeros(1, t.alive.shape[1], dtype=torch.bool)
    alive[0, who] = True
    vectors = torch.from_numpy(t.vectors[[at + 1]])
    grids = torch.from_numpy(t.grids[[at + 1]])
    none = torch.zeros(*alive.shape, SIZES.continuous)
    values, _ = oracle.group_worth(learner.critic, vectors, grids, alive, none)
    return values[0, who[0]]


def returned(learner, t, part, agent, first, last, follows):
    """Does the agent's part of the life, first to last, return what it should?"""
    rewards = torch.from_numpy(t.rewards[first:last]).float()
    values = part.values[first:last, agent]
    s = learner.settings
    R = lambda_returns(rewards, values, torch.as_tensor(follows), s.gamma, s.lambd)
    return torch.allclose(part.returns[first:last, agent], R, atol=1e-5)


@pytest.mark.paper("C8", "E3")
@pytest.mark.parametrize(
    ("drawn", "parts"),
    [
        (["##..", "####", "####"], [(0, 0, 2, [0, 1, 2]), (1, 0, 4, None)]),
        (["####", "####"], [(0, 0, 4, None), (1, 0, 4, None)]),
        (["##..", "##..", "####"], [(0, 0, 2, [0, 1, 2]), (1, 0, 2, [0, 1, 2])]),
        (["#...", "##..", "####"], [(0, 0, 1, [0, 1, 2]), (1, 0, 2, [1, 2])]),
        (["#...", "####>", "####>"], [(1, 0, 4, [1, 2]), (2, 0, 4, [1, 2])]),
    ],
    ids=["one early", "together", "two at once", "one by one", "time is up"],
)
def test_who_finishes_early_is_credited_with_what_the_group_does_next(drawn, parts):
    """V of its own last observation among what its mates observe then.

    Who had left before is not in that group; nothing follows when all are done. When
    time is up, the group goes on from its value.
    """
    learner = made()
    t = life(*drawn)
    part = added(learner, t)
    for agent, first, last, group in parts:
        follows = after(learner, t, last - 1, group) if group else 0.0
        assert returned(learner, t, part, agent, first, last, follows)
    _, _, end, _ = parts[0]
    assert not returned(learner, t, part, 0, 0, end, 1.0)


@pytest.mark.paper("E3")
def test_the_horizon_cuts_a_group_s_trajectories_too():
    """Two and two decisions, and the mate that leaves just then is still counted."""
    learner = made(time_horizon=2)
    t = life("##..", "####")
    part = added(learner, t)
    follows = after(learner, t, 1, [0, 1])
    assert returned(learner, t, part, 0, 0, 2, follows)
    assert returned(learner, t, part, 1, 0, 2, follows)
    assert returned(learner, t, part, 1, 2, 4, 0.0)


# -- A task with a known answer -----------------------------------------------------

GAME = Sizes(vector=3, grid=(1, 20, 20), continuous=1)
WHO = np.array([[1, 0, 0], [0, 1, 0]], dtype=np.float32)  # and what has happened


def player(kind=GroupLearner, **changes):
    """A learner small enough to learn a game in a second or two."""
    table = {
        "hidden_units": 16,
        "num_layers": 1,
        "normalize": False,
        "num_epoch": 3,
        "learning_rate": 0.01,
        "batch_size": 64,
        "buffer_size": 64,
    }
    return kind(settings("poca", **table | changes), GAME, seed=1)


def moves(learner, vectors, rng):
    """What the learner's agents do, and how likely that was."""
    noise = rng.standard_normal((*vectors.shape[:2], 1)).astype(np.float32)
    grids = torch.zeros(len(vectors), *GAME.grid)
    with torch.no_grad():
        policy = learner.actor(torch.from_numpy(vectors), grids)
        actions = policy.act(torch.from_numpy(noise))
        return actions.numpy(), policy.log_probs(actions).numpy()


def lived(vectors, alive, actions, log_probs, rewards):
    """A trajectory under an empty sky."""
    grids = np.zeros((len(vectors), *GAME.grid), dtype=np.uint8)
    seen = {"vectors": vectors, "grids": grids, "alive": alive}
    return Trajectory(**seen, actions=actions, log_probs=log_probs, rewards=rewards)


def bandit(learner, rng, rounds=128):
    """Agent 0 earns 1 whenever it says more than 0; agent 1 is along for the ride."""
    vectors = np.tile(WHO, (rounds + 1, 1, 1))
    actions, log_probs = moves(learner, vectors[:-1], rng)
    alive = np.ones((rounds + 1, 2), bool)
    alive[-1] = False
    right = actions[:, 0, 0] > 0
    t = lived(vectors, alive, actions, log_probs, right.astype(float))
    return t, right.mean()


class WithoutCounterfactual(GroupLearner):
    """The baseline is the value: everybody is praised for what anybody did."""

    def targets(self, rewards, values, baselines, next_value):
        return super().targets(rewards, values, values, next_value)


def credit(kind):
    """How far the lazy one's advantages spread, compared with the useful one's."""
    learner = player(kind, gamma=0.0)
    rng = np.random.default_rng(1)
    learner.actor.requires_grad_(False)  # the critic finds out who earns what
    for _ in range(16):
        t, _ = bandit(learner, rng)
        learner.add([t])
        useful, lazy = learner.buffer[-1].advantages.std(dim=0)
        learner.update()
    learner.actor.requires_grad_(True)
    return learner, rng, (lazy / useful).item()


@pytest.mark.paper("E1")
@pytest.mark.slow
def test_a_lazy_team_mate_gets_no_credit():
    """Knowing what the useful one did, its own part in it is nothing; and the useful
    one learns what is good. With V for a baseline it gets as much as the other."""
    learner, rng, share = credit(GroupLearner)
    assert share < 0.3
    for _ in range(8):
        t, _ = bandit(learner, rng)
        learner.add([t])
        learner.update()
    _, right = bandit(learner, rng)
    assert right > 0.95
    _, _, share = credit(WithoutCounterfactual)
    assert share == pytest.approx(1.0)


def door(learner, rng):
    """Leaving at once (more than 0) costs agent 0 a bird in the hand, 0.3; then, when
    it is gone, its mate earns the group 1."""
    actions, log_probs = moves(learner, WHO[None], rng)
    left = actions[0, 0, 0] > 0
    then = WHO.copy()
    then[:, 2] = 1 if left else -1
    more, more_log_probs = moves(learner, then[None], rng)
    alive = np.array([[True, True], [not left, True], [False, False]])
    return lived(
        np.stack([WHO, then, then]),
        alive,
        np.concatenate([actions, more]),
        np.concatenate([log_probs, more_log_probs]),
        np.array([0.0, 1.0] if left else [0.3, 0.0]),
    )


class WithoutPosthumousCredit(GroupLearner):
    """Nothing follows for who has left."""

    def next_values(self, t, ends):
        return torch.zeros(len(ends), t.alive.shape[1])


def leaving(kind):
    """How often agent 0 leaves, once it has learnt."""
    learner = player(kind)
    rng = np.random.default_rng(1)
    for _ in range(16):
        played = [door(learner, rng) for _ in range(48)]
        learner.add(played)
        learner.update()
    return np.mean([not t.alive[1, 0] for t in played])


@pytest.mark.paper("C8")
@pytest.mark.slow
def test_an_agent_learns_to_leave_for_what_its_group_earns_without_it():
    """MA-POCA's own case [C8]; without posthumous credit it learns to stay."""
    assert leaving(GroupLearner) > 0.85
    assert leaving(WithoutPosthumousCredit) < 0.15
