"""Signal and noise of an update, against plain formulas and known answers."""

import pytest
import torch
from lives import SIZES, life, settings

from reference.learning.experience import Decisions
from reference.learning.poca import GroupLearner
from reference.learning.ppo import normalised
from reference.workshop.training.gradient import EXPLAINED, SIGNAL, measure_signal


def filled(count=8, seed=0):
    """A learner in whose buffer so many lives wait, which the actor has lived."""
    learner = GroupLearner(settings("poca", normalize=False), SIZES, seed=1)
    learner.add([life("#####", "##...", seed=seed + k) for k in range(count)])
    for part in learner.buffer:
        policy = learner.actor(part.vectors, part.grids)
        part.actions = policy.act(torch.randn(part.actions.shape)).detach()
        part.log_probs = policy.log_probs(part.actions).detach()
    return learner


def gradients(learner):
    """(N, weights) of each life: minus the sum of its advantages times log p."""
    buffer = Decisions.joined(learner.buffer)
    buffer.advantages[buffer.alive] = normalised(buffer.advantages[buffer.alive])
    rows = []
    for part, A in zip(learner.buffer, buffer.advantages.split(5), strict=True):
        log_probs = learner.actor(part.vectors, part.grids).log_probs(part.actions)
        loss = -(log_probs.sum(dim=-1) * A)[part.alive].sum()
        found = torch.autograd.grad(loss, list(learner.actor.parameters()))
        rows.append(torch.cat([g.flatten() for g in found]).double())
    return torch.stack(rows)


@pytest.mark.paper("E3", "chosen")
def test_signal_to_noise_is_of_the_lives_gradients():
    """The squared mean less its own noise, over that noise: a trace over N."""
    learner = filled()
    g = gradients(learner)
    noise = g.var(dim=0).sum() / len(g)
    signal = g.mean(dim=0).square().sum() - noise
    before = learner.buffer[0].advantages.clone()
    found = measure_signal(learner)[SIGNAL]
    assert found == pytest.approx((signal / noise).item(), rel=1e-3)
    assert torch.equal(learner.buffer[0].advantages, before)


@pytest.mark.paper("E3", "chosen")
def test_where_advantages_are_noise_there_is_no_signal():
    """On average; where each action has the advantage of its number, there is."""
    torch.manual_seed(0)
    noise = []
    signal = []
    for k in range(12):
        learner = filled(seed=100 * k)
        for part in learner.buffer:
            part.advantages = torch.randn(part.advantages.shape)
        noise.append(measure_signal(learner)[SIGNAL])
        for part in learner.buffer:
            part.advantages = part.actions[..., 0]
        signal.append(measure_signal(learner)[SIGNAL])
    assert abs(sum(noise) / 12) < 0.2 < 2 < sum(signal) / 12


def test_what_the_critic_explains_is_a_share_of_the_variance_of_returns():
    """All of it, half of it, or none; one life alone tells of no noise."""
    learner = filled(1)
    (part,) = learner.buffer
    off = part.returns - part.returns[part.alive].mean()
    for share, explained in ((1.0, 1.0), (0.5, 0.75), (0.0, 0.0)):
        part.values = share * off
        found = measure_signal(learner)
        assert found[EXPLAINED] == pytest.approx(explained, abs=1e-6)
        assert SIGNAL not in found
