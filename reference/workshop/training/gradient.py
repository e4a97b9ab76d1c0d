"""Signal and noise of an update: is it worth going on?

Both figures are measured on the buffer, just before an update.

    N  episodes;  g  an episode's part of the policy's gradient;  Σ  its covariance
"""

from dataclasses import dataclass

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
    gradients = _gradients(learner, buffer)
    measured = {
        SIGNAL: gradients.signal_to_noise(gradients.episodes),
        EXPLAINED: 1 - (returns - values).var() / returns.var(),
    }
    return {name: float(x) for name, x in measured.items() if x.isfinite()}


@dataclass
class Gradients:
    """Sums over N episodes of the policy's gradients g: enough for signal and noise.

    Those of several buffers may be added; the policy must be the same.
    """

    episodes: int
    totals: list[Tensor]  # sum of g over episodes, of the shape of each weight
    squares: Tensor  # (), sum of |g|² over episodes; |g|² is over all weights

    def __add__(self, others: "Gradients") -> "Gradients":
        """Both together."""
        return Gradients(
            self.episodes + others.episodes,
            [a + b for a, b in zip(self.totals, others.totals, strict=True)],
            self.squares + others.squares,
        )

    def signal_to_noise(self, episodes: int) -> Tensor:
        """|E g|² / (tr Σ / episodes): the gradient without its noise, and the noise.

        [E3, chosen] episodes over the "simple noise scale" tr Σ / |E g|² of McCandlish
        et al. (2018). An episode is the sample, not a decision: those of one share
        their luck. With S the unbiased trace, |mean g|² − S / N estimates |E g|²
        without bias. Below 1 the noise of an update is larger than what it follows.

        episodes: of the update; NaN where N is 1, since one episode tells no variance
        """
        N = self.episodes
        if N < 2:
            return torch.full((), torch.nan)
        square_of_sum = torch.stack([g.square().sum() for g in self.totals]).sum()
        square_of_mean = square_of_sum / N**2  # |mean g|²
        S = (self.squares - N * square_of_mean) / (N - 1)
        signal = square_of_mean - S / N  # |E g|²
        return signal / (S / episodes)


def measure_gradients(learner: Learner) -> Gradients:
    """Measure the gradients of the episodes that wait in the buffer."""
    return _gradients(learner, learner.joined(learner.buffer))


def _gradients(learner: Learner, buffer: Decisions) -> Gradients:
    """Sum the gradients of a joined buffer, whose advantages are normalised here."""
    live = buffer.alive
    buffer.advantages[live] = normalised(buffer.advantages[live])
    weights = list(learner.actor.parameters())
    totals = [torch.zeros_like(weight) for weight in weights]
    squares = torch.zeros(())
    rows = torch.arange(len(buffer)).split([len(part) for part in learner.buffer])
    for which in rows:
        episode = buffer.rows(which)
        if not episode.alive.any():
            continue
        loss = _summed_loss(learner, episode)
        gradient = torch.autograd.grad(loss, weights)
        for total, g in zip(totals, gradient, strict=True):
            total += g
            squares += g.square().sum()
    return Gradients(len(rows), totals, squares)


def _summed_loss(learner: Learner, episode: Decisions) -> Tensor:
    """Sum the policy's loss over an episode, so that episodes' gradients add up."""
    ((_, episode),) = pieces_of(episode)  # an episode has one shape
    live = episode.alive
    policy = learner.actor(episode.vectors, episode.grids)
    log_probs = policy.log_probs(episode.actions)[live]
    A = episode.advantages[live]
    old = episode.log_probs[live]
    return policy_loss(log_probs, old, A, learner.settings.epsilon) * len(A)
