"""PPO: each formula by hand and by an oracle; then the learner, step by step.

What both learners share (schedules, minibatches, Adam) is tested here with the fire's,
`MIXED` sizes; what MA-POCA does otherwise stands in `test_e_poca`. The whole loss and
its gradients are compared with `tutorials/ma_poca.py`.
"""

import math

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st
from lives import MIXED, SIZES, gradients, life, random, settings, tensor

from reference.learning.experience import minibatches
from reference.learning.poca import GroupLearner
from reference.learning.ppo import (
    Learner,
    gae,
    normalised,
    policy_loss,
    scheduled,
    value_loss,
)

# -- What has a formula -------------------------------------------------------------


@pytest.mark.paper("E3")
def test_a_linear_schedule_ends_at_its_floor():
    """0.3 → 0.1 over 1000 steps: 0.25 after a quarter, and 0.1 ever after."""
    assert scheduled(0.3, 0.1, 0, 1000, "linear") == pytest.approx(0.3)
    assert scheduled(0.3, 0.1, 250, 1000, "linear") == pytest.approx(0.25)
    assert [scheduled(0.3, 0.1, n, 1000, "linear") for n in (1000, 5000)] == [0.1, 0.1]
    assert scheduled(0.3, 0.1, 999, 1000, "constant") == 0.3


@pytest.mark.paper("E2")
def test_gae_of_three_decisions_by_hand():
    """γ = λ = ½: δ = (0.5, 0.25, −0.5), A = (0.53125, 0.125, −0.5)."""
    rewards = tensor(1, 0, 1)
    values = tensor(1, 1, 2.5)
    A = gae(rewards, values, tensor(2)[0], gamma=0.5, lambd=0.5)
    deltas = [1 + 0.5 - 1, 0 + 1.25 - 1, 1 + 1 - 2.5]
    assert A[2].item() == deltas[2] == -0.5
    assert A[1].item() == deltas[1] + 0.25 * -0.5 == 0.125
    assert A[0].item() == deltas[0] + 0.25 * 0.125 == 0.53125


@pytest.mark.paper("E2")
@given(st.integers(1, 12), st.floats(0, 1), st.floats(0, 1), st.integers(0, 99))
def test_gae_is_the_sum_over_all_that_follows(T, gamma, lambd, seed):
    """A_t = Σ_k (γλ)^k δ_t+k, column by column."""
    rewards = random(seed, T, 2)
    values = random(seed + 1, T, 2)
    last = random(9, 2)
    A = gae(rewards, values, last, gamma, lambd)
    following = torch.cat([values[1:], last[None]])
    deltas = rewards + gamma * following - values
    for t in range(T):
        expected = torch.zeros(2, dtype=torch.float64)
        for k in range(T - t):
            expected += (gamma * lambd) ** k * deltas[t + k]
        assert torch.allclose(A[t], expected, atol=1e-12)


@pytest.mark.paper("E3")
def test_advantages_are_normalised_with_the_deviation_of_all():
    """1, 2, 3: mean 2, deviation √(2/3), not the sample's 1; equal ones become 0."""
    far = math.sqrt(3 / 2)
    assert normalised(tensor(1, 2, 3)).tolist() == pytest.approx([-far, 0, far])
    assert normalised(tensor(4, 4)).tolist() == [0, 0]


@pytest.mark.paper("E3")
def test_every_component_has_its_own_ratio_and_clip():
    """ρ = (2, ½), A = 1, ε = 0.2: −(min(2, 1.2) + min(½, 0.8))/2; jointly it is −1."""
    log_probs = tensor(math.log(2), math.log(0.5))[None]
    old = tensor(0, 0)[None]
    assert policy_loss(log_probs, old, tensor(1), 0.2).item() == pytest.approx(-0.85)
    worse = policy_loss(log_probs, old, tensor(-1), 0.2).item()
    assert worse == pytest.approx((2 + 0.8) / 2)


@pytest.mark.paper("E3")
@given(st.integers(0, 99))
def test_the_policy_loss_pulls_where_the_clip_does_not_hold(seed):
    """Its gradient: −ρA/MK inside the clip and where clipping would flatter, else 0."""
    log_probs = random(seed, 5, 3).requires_grad_()
    old = random(7, 5, 3)
    A = random(8, 5)
    policy_loss(log_probs, old, A, 0.2).backward()
    rho = torch.exp(log_probs - old).detach()
    A = A[:, None].expand(5, 3)
    too_high = (rho > 1.2) & (A > 0)
    too_low = (rho < 0.8) & (A < 0)
    held = too_high | too_low
    expected = torch.where(held, 0.0, -rho * A / 15)
    assert torch.allclose(log_probs.grad, expected, atol=1e-12)


@pytest.mark.paper("E3")
def test_the_value_loss_is_never_clipped():
    """However far the value has moved: (3² + 1²)/2, and a slope of (V − R)."""
    values = tensor(3, 1).requires_grad_()
    loss = value_loss(values, tensor(0, 0))
    loss.backward()
    assert loss.item() == 5
    assert values.grad.tolist() == [3, 1]


# -- What follows the last decision -------------------------------------------------


def made(seed=1, sizes=MIXED, **changes):
    """The fire's learner, its network small, and numbers in it far from zero."""
    learner = Learner(settings("ppo", **changes), sizes, seed)
    torch.manual_seed(seed)
    with torch.no_grad():
        for p in [*learner.actor.parameters(), *learner.critic.parameters()]:
            p.add_(0.1 * torch.randn_like(p))
    return learner


def returns(learner, t):
    """(T, G) what the learner makes of a life, and its values (T + 1, G) of it."""
    learner.add([t])
    with torch.no_grad():
        seen = learner.critic(torch.from_numpy(t.vectors), torch.from_numpy(t.grids))
    return learner.buffer[-1].returns, seen


@pytest.mark.paper("E2", "E3")
@pytest.mark.parametrize(
    ("drawn", "horizon", "parts"),
    [
        (["####"], 9, [(0, 0, 4, 0)]),
        (["####>"], 9, [(0, 0, 4, 1)]),
        (["#####"], 3, [(0, 0, 3, 1), (0, 3, 5, 0)]),
        (["#..", "###"], 9, [(0, 0, 1, 0), (1, 0, 3, 0)]),
    ],
    ids=["done", "time is up", "cut by the horizon", "done before its mate"],
)
def test_a_trajectory_goes_on_from_a_value_unless_the_agent_is_done(
    drawn, horizon, parts
):
    """GAE plus value for each part of an agent's life; its mates do not matter."""
    learner = made(time_horizon=horizon)
    t = life(*drawn, sizes=MIXED)
    found, seen = returns(learner, t)
    rewards = torch.from_numpy(t.rewards).float()
    s = learner.settings
    for agent, first, last, follows in parts:
        values = seen[first:last, agent]
        after = follows * seen[last, agent]
        advantages = gae(rewards[first:last], values, after, s.gamma, s.lambd)
        expected = values + advantages
        assert torch.allclose(found[first:last, agent], expected, atol=1e-6)


@pytest.mark.paper("E4", "deviation")
@pytest.mark.paper("E1", "Tab. I")
@pytest.mark.paper("E2", "Tab. II")
@pytest.mark.paper("E3")
def test_rewards_are_scaled_before_anything_is_learnt_from_them():
    """By `reward_scale`, ours, and `strength`, the original's."""
    t = life("#", sizes=MIXED, rewards=np.array([300.0]))
    found, _ = returns(made(reward_scale=0.001, strength=2.0), t)
    assert found.item() == pytest.approx(0.6, abs=1e-6)


# -- The update ---------------------------------------------------------------------


@pytest.mark.paper("E4")
def test_both_networks_normalise_with_what_the_live_agents_saw():
    """In both episodes, before values are computed; neither the absent nor a last
    observation count."""
    learner = made(normalize=True)
    t = life("###", "#..", sizes=MIXED)
    second = life("##", "##", sizes=MIXED, seed=1)
    learner.add([t, second])
    live = [one.vectors[:-1][one.alive[:-1]] for one in (t, second)]
    counted = np.vstack([np.zeros(MIXED.vector), *live])  # the first count is of zeros
    for network in (learner.actor, learner.critic):
        normaliser = network.body.encoder.normaliser
        assert normaliser.count == len(counted) == 9
        assert normaliser.mean.numpy() == pytest.approx(counted.mean(axis=0), abs=1e-6)
    part = learner.buffer[0]
    vectors = torch.from_numpy(t.vectors[:-1])
    with torch.no_grad():
        values = learner.critic(vectors, part.grids)
    assert torch.allclose(values, part.values, atol=1e-6)


class Watched(Learner):
    """Notes every minibatch that it is asked for the loss of."""

    def loss(self, batch, epsilon, beta):
        """As always."""
        self.seen = [*getattr(self, "seen", []), (batch, epsilon, beta)]
        return super().loss(batch, epsilon, beta)


def watched(*agents, **changes):
    """A watched learner after one update from one life."""
    learner = Watched(settings("ppo", **changes), MIXED, 0)
    learner.add([life(*agents, sizes=MIXED)])
    before = learner.buffer[0].advantages.clone()
    return learner, before, learner.update()


@pytest.mark.paper("E3")
def test_an_update_goes_num_epoch_times_through_whole_minibatches():
    """Eleven rows of two episodes in fours, three epochs: six steps, and the buffer is
    empty."""
    learner = Watched(settings("ppo", num_epoch=3), MIXED, 0)
    learner.add([life("#" * 6, sizes=MIXED), life("#" * 5, sizes=MIXED, seed=1)])
    learner.update()
    assert [len(batch) for batch, *_ in learner.seen] == [4] * 6
    assert not learner.buffer and not learner.full
    step = learner.optimiser.state_dict()["state"][0]["step"]
    assert step == 6


@pytest.mark.paper("E3")
def test_advantages_are_normalised_once_over_the_whole_buffer():
    """Not minibatch by minibatch, nor again in the next epoch; without the absent."""
    learner, before, _ = watched("####", "##..", batch_size=6, num_epoch=2)
    alive = learner.seen[0][0].alive
    assert alive.sum() == 6
    used = torch.cat([batch.advantages[batch.alive] for batch, *_ in learner.seen])
    live = torch.from_numpy(life("####", "##..", sizes=MIXED).alive[:-1])
    expected = normalised(before[live]).sort().values
    for epoch in (used[:6], used[6:]):
        assert torch.allclose(epoch.sort().values, expected, atol=1e-6)


@pytest.mark.paper("E3")
def test_schedules_stand_still_within_an_update():
    """Read at the steps so far: 11 of 22 are half the way; β of the tables stays."""
    learner, _, summary = watched("#" * 11, max_steps=22, num_epoch=2)
    used = {(epsilon, beta) for _, epsilon, beta in learner.seen}
    left = 1 - 11 / 22
    assert used == {(0.1 + 0.1 * left, 0.005)}
    assert len(learner.seen) == 4
    rate = learner.settings.learning_rate
    assert summary["Policy/Learning Rate"] == pytest.approx(rate / 2, rel=1e-5)
    assert learner.optimiser.param_groups[0]["lr"] == summary["Policy/Learning Rate"]


@pytest.mark.paper("E3")
def test_at_max_steps_all_three_schedules_are_at_their_floors():
    """Learning rate 1e-10, ε 0.1, β 1e-5, where they decay."""
    names = ("learning_rate_schedule", "epsilon_schedule", "beta_schedule")
    learner = made(max_steps=9, **dict.fromkeys(names, "linear"))
    s = learner.settings
    assert learner.schedules() == (s.learning_rate, s.epsilon, s.beta)
    learner.add([life("#" * 9, sizes=MIXED)])
    assert learner.schedules() == (1e-10, 0.1, 1e-5)


@pytest.mark.paper("E1", "Tab. I")
@pytest.mark.paper("E3")
def test_the_loss_is_by_the_epsilon_and_beta_of_the_schedules():
    """ε in the policy's part and in the baseline's, β before the entropy; the settings
    have only their first values."""
    learner = GroupLearner(settings("poca"), SIZES, 0)
    learner.add([life("######", "######")])
    rows = learner.buffer[0]
    rows.baselines += 5  # beyond either clip
    early, wide = learner.loss(rows, 0.2, 0.005)
    late, narrow = learner.loss(rows, 0.01, 0.005)
    for part in ("Losses/Policy Loss", "Losses/Baseline Loss"):
        assert wide[part].item() != pytest.approx(narrow[part].item(), rel=1e-3)
    assert early.item() != pytest.approx(late.item(), rel=1e-3)
    eager, _ = learner.loss(rows, 0.2, 0.5)
    more = (early - eager).item() / (0.5 - 0.005)
    assert more == pytest.approx(wide["Policy/Entropy"].item(), rel=1e-3)


@pytest.mark.paper("E3")
def test_an_update_is_adam_s_step_on_the_summed_loss():
    """First step: p − lr·g/(|g| + 10⁻⁸), both networks at once, no gradient clipped."""
    learner = made(batch_size=8, learning_rate_schedule="constant")
    learner.add([life("#" * 8, sizes=MIXED)])
    rows = learner.buffer[0].rows(torch.arange(8))
    rows.advantages[:, 0] = normalised(rows.advantages[:, 0])
    _, epsilon, beta = learner.schedules()
    loss, _ = learner.loss(rows, epsilon, beta)
    loss.backward()
    before = []
    for network in (learner.actor, learner.critic):
        slopes = gradients(network)
        for name, p in network.named_parameters():
            before.append((p, p.detach().clone(), slopes[name]))
    rate = learner.update()["Policy/Learning Rate"]
    for p, old, g in before:
        expected = old - rate * g / (g.abs() + 1e-8)
        assert torch.allclose(p, expected, atol=0.02 * rate)


@pytest.mark.paper("E3")
def test_each_minibatch_s_step_is_by_its_own_gradient():
    """Nothing of the one before is left in it: Adam's two steps, by another Adam."""
    changes = {"batch_size": 4, "learning_rate_schedule": "constant"}
    learner = made(**changes)
    again = made(**changes)
    for one in (learner, again):
        one.add([life("#" * 8, sizes=MIXED)])
    rate = learner.update()["Policy/Learning Rate"]
    rows = again.buffer[0]
    rows.advantages[:, 0] = normalised(rows.advantages[:, 0])
    _, epsilon, beta = again.schedules()
    parameters = [*again.actor.parameters(), *again.critic.parameters()]
    adam = torch.optim.Adam(parameters, rate)
    for batch in minibatches(rows, 4, again.rng):
        loss, _ = again.loss(batch, epsilon, beta)
        slopes = torch.autograd.grad(loss, parameters)
        for p, slope in zip(parameters, slopes, strict=True):
            p.grad = slope
        adam.step()
    found = [*learner.actor.parameters(), *learner.critic.parameters()]
    for p, expected in zip(found, parameters, strict=True):
        assert torch.allclose(p, expected, atol=0.02 * rate)


@pytest.mark.paper("E2")
def test_an_update_reports_by_the_original_s_names():
    """Means over its minibatches, plain numbers."""
    _, _, summary = watched("#" * 9)
    assert set(summary) == {
        "Losses/Policy Loss",
        "Losses/Value Loss",
        "Policy/Entropy",
        "Policy/Learning Rate",
        "Policy/Epsilon",
        "Policy/Beta",
        "Policy/Extrinsic Value Estimate",
    }
    assert all(type(x) is float and math.isfinite(x) for x in summary.values())


@pytest.mark.paper("E3")
@pytest.mark.parametrize("kind", [Learner, GroupLearner])
def test_estimates_are_means_over_agents_that_are_there(kind):
    """An agent that left early counts for its own decisions alone."""
    learner = kind(settings(), SIZES, 0)
    learner.add([life("#####", "##...")])
    part = learner.buffer[0]
    summary = learner.update()
    kinds = ("Value", "Baseline") if kind is GroupLearner else ("Value",)
    for name in kinds:
        column = getattr(part, f"{name.lower()}s")
        total = column[:, 0].sum() + column[:2, 1].sum()
        estimate = summary[f"Policy/Extrinsic {name} Estimate"]
        assert estimate == pytest.approx(total.item() / 7, rel=1e-5)


def test_the_same_seed_begins_with_the_same_networks():
    """And leaves torch's own random numbers alone."""
    before = torch.random.get_rng_state()

    def begun(seed):
        return Learner(settings("ppo"), MIXED, seed).actor.state_dict()

    one = begun(1)
    same = begun(1)
    other = begun(2)
    assert all(torch.equal(x, same[name]) for name, x in one.items())
    assert not torch.equal(one["body.layers.0.weight"], other["body.layers.0.weight"])
    assert torch.equal(torch.random.get_rng_state(), before)
