"""How well does the robots' critic tell what a training's team will still earn?

    python tutorials/experiments/what_critics_know.py out/DIR

The team plays as in training, by sampled actions. For each part of an evacuation:

    return      standard deviation of the discounted reward that still comes
    explained   share of its variance that the critic's value explains
    advantage   standard deviation of what the policy learns from
    own         of this, between robots that decide at the same moment
    entropy     of decisions, in nats: how much the team still tries
"""

from argparse import ArgumentParser
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import torch

from reference.learning.networks import one_thread
from reference.learning.poca import lambda_returns
from reference.learning.rollouts import play
from reference.workshop.lockstep import together
from reference.workshop.training.checkpoints import load
from reference.workshop.training.session import Training

PARTS = (0, 6, 12, 18, 24, 30, 36)  # decisions, one every five seconds


def moments(training, seeds):
    """Yield each decision's number, return, value, and agents' advantages (live,)."""
    learner = training.learners["robots"]
    job = replace(training.jobs()[0], seeds=seeds)
    trajectories = [episode.robots for episode in play(job, together)]
    learner.add(trajectories)
    for t, known in zip(trajectories, learner.buffer.parts, strict=True):
        rewards = torch.from_numpy(t.rewards).float() * learner.reward_scale
        nothing, gamma = torch.zeros(()), learner.settings.gamma
        returns = lambda_returns(rewards, torch.zeros(len(t)), nothing, gamma, 1.0)
        entropy = learner.actor(known.vectors, known.grids, known.options).entropy()
        for k, live in enumerate(known.alive):
            yield (
                k,
                returns[k],
                known.values[k, live].mean(),
                known.advantages[k, live],
                entropy[k, live].mean(),
            )
    learner.buffer.emptied()


def row(found):
    """Tell a part's numbers in a line."""
    returns, values, entropy = (
        torch.stack([moment[i] for moment in found]) for i in (1, 2, 4)
    )
    advantages = torch.cat([moment[3] for moment in found])
    own = torch.cat([moment[3] - moment[3].mean() for moment in found])
    explained = 1 - (returns - values).var() / returns.var()
    columns = (returns.std(), explained, advantages.std(), own.std(), entropy.mean())
    return " ".join(f"{float(column):10.2f}" for column in columns)


if __name__ == "__main__":
    parser = ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("training", type=Path, metavar="DIR")
    parser.add_argument("--episodes", type=int, default=96, metavar="N")
    parser.add_argument("--seed", type=int, default=7000, metavar="N")
    asked = parser.parse_args()
    training = Training.resumed(load(asked.training))
    last = asked.seed + asked.episodes
    with one_thread(), torch.no_grad():
        found = [
            moment
            for first in range(asked.seed, last, 8)
            for moment in moments(training, tuple(range(first, min(first + 8, last))))
        ]
    names = ("return", "explained", "advantage", "own", "entropy")
    print(f"{'decisions':>12} " + " ".join(f"{name:>10}" for name in names))
    for first, end in pairwise(PARTS):
        part = [moment for moment in found if first <= moment[0] < end]
        if len(part) > 1:
            print(f"{first:>5} to {end - 1:>3} {row(part)}")
