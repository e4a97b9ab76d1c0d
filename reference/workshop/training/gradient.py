"""Signal and noise of an update: is it worth going on?

Both figures are measured on the buffer, just before an update.

    N  episodes;  g  an episode's part of the policy's gradient;  Σ  its covariance
"""

import torch
from torch import Tensor

from reference.learning.experience import Decisions
from reference.learning.ppo import Learner, Summary, normalised, policy_loss
from reference.workshop.training.batches import pieces_of
from reference.workshop.training.summaries import EXPLAINED, SIGNAL


def measure_signal(learner: Learner) -> Summary:
    """Measure what waits in the buffer; what cannot be measured is left out."""
    buffer = learner.joined(learner.buffer)
    live = buffer.alive
    values = buffer.values[live]
    returns = buffer.returns[live]
    measured = {
        SIGNAL: _signal_to_noise(learner, buffer),
        EXPLAINED: 1 - (returns - values).var() / returns.var(),
    }
    return {name: float(x) for name, x in measured.items() if x.isfinite()}


def _signal_to_noise(learner: Learner, buffer: Decisions) -> Tensor:
    """|E g|² / (tr Σ / N): the gradient without its noise, and the noise [E3, chosen].

    N over the "simple noise scale" tr Σ / |E g|² of McCandlish et al. (2018). An
    episode is the sample, not a decision: those of one share their luck. With S the
    unbiased trace, |mean g|² − S / N estimates |E g|² without bias. Below 1 the noise
    of an update is larger than what it follows.
    """
    live = buffer.alive
    buffer.advantages[live] = normalised(buffer.advantages[live])
    N = len(learner.buffer)
    if N < 2:
        return torch.full((), torch.nan)  # one episode tells no variance

    # sums over episodes: of g, for each weight, and of |g|²
    weights = list(learner.actor.parameters())
    sums = [torch.zeros_like(weight) for weight in weights]
    squares = torch.zeros(())
    rows = torch.arange(len(buffer)).split([len(part) for part in learner.buffer])
    for which in rows:
        episode = buffer.rows(which)
        if not episode.alive.any():
            continue
        loss = _summed_loss(learner, episode)
        gradient = torch.autograd.grad(loss, weights)
        for total, g in zip(sums, gradient, strict=True):
            total += g
            squares += g.square().sum()

    whole = torch.stack([total.square().sum() for total in sums]).sum()  # N² |mean g|²
    S = (squares - whole / N) / (N - 1)
    # both N times as large: |mean g|², and the noise S that it contains
    return (whole / N) / S - 1


def _summed_loss(learner: Learner, episode: Decisions) -> Tensor:
    """Sum the policy's loss over an episode, so that episodes' gradients add up."""
    ((_, episode),) = pieces_of(episode)  # an episode has one shape
    live = episode.alive
    policy = learner.actor(episode.vectors, episode.grids)
    log_probs = policy.log_probs(episode.actions)[live]
    A = episode.advantages[live]
    old = episode.log_probs[live]
    return policy_loss(log_probs, old, A, learner.settings.epsilon) * len(A)
