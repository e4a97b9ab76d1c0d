"""How many evacuations must an update have, so that it follows more than its noise?

    python tutorials/experiments/signal_to_noise.py out/copy \
        --fire random fixed busiest fixed closer none

Robots of a training play evacuations, round after round, without learning from them.
The gradients of their policy tell how much of an update is signal:

    |mean gradient|² / (variance of an update's gradient)

Above 1 it follows more than its noise; near 0, on either side, there is nothing to see.
It grows as the evacuations of an update do.

After each round the table is printed anew.  The standard error is the jackknife's, over
rounds.  λ of 1 believes what happened after a decision, 0 what the critic says of the
next one.  Robots that have learned in several buildings play in the first, or in an
example.
"""

import sys
from argparse import ArgumentParser
from dataclasses import replace
from functools import reduce
from operator import add
from pathlib import Path

import numpy as np

from reference.learning.adversarial import player_of
from reference.learning.rollouts import Job, play
from reference.paper import InputError
from reference.workshop.commands.common import exit_status
from reference.workshop.commands.options import whole
from reference.workshop.comparing.results import align_columns
from reference.workshop.engine import make_ready, run_to_decision
from reference.workshop.storage.workers import (
    chunks,
    map_in_shares,
    one_thread,
    workers,
)
from reference.workshop.strategies import FIRES
from reference.workshop.training.checkpoints import load_checkpoint
from reference.workshop.training.gradient import measure_gradients
from reference.workshop.training.rounds import Training

LAMBDAS = 0.0, 0.5, 0.8, 0.95, 1.0
EPISODES_PER_JOB = 8


def played(jobs):
    """Play jobs; return what their robots saw, did and earned."""
    lives = []
    with one_thread():
        for job in jobs:
            lives += [episode.robots for episode in play(job, advance=run_to_decision)]
    return lives


def gradients_of(learner, lives, lambd):
    """What an update from these lives would follow; normalisers stay as they are."""
    learner.settings = replace(learner.settings, lambd=lambd)
    learner.buffer = [learner.with_targets(life) for life in lives]
    found = measure_gradients(learner)
    learner.buffer = []
    return found


def estimate(rounds, episodes):
    """Signal over noise of an update of so many episodes, and its standard error.

    rounds: gradients of each; the error is NaN where there is one round only
    """
    found = float(reduce(add, rounds).signal_to_noise(episodes))
    R = len(rounds)
    if R < 2:
        return found, np.nan
    without = [reduce(add, rounds[:k] + rounds[k + 1 :]) for k in range(R)]
    estimates = [float(others.signal_to_noise(episodes)) for others in without]
    return found, np.sqrt((R - 1) * np.var(estimates))


def table(of_rounds, updates):
    """Rows of every λ and size of an update."""
    rows = [["lambda", "evacuations an update", "signal / noise", "standard error"]]
    for lambd, rounds in of_rounds.items():
        for size in updates:
            found, error = estimate(rounds, size)
            ratio = round(found, 3) + 0  # no sign where it is 0
            rows.append([str(lambd), f"{size:,}", f"{ratio:.3f}", f"{error:.3f}"])
    return align_columns(rows, ">>>>")


def main():
    parser = ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("training", type=Path, help="its folder")
    parser.add_argument("--fire", nargs="+", choices=FIRES, default=["busiest"])
    parser.add_argument("--rounds", type=whole(1), default=8)
    parser.add_argument("--episodes", type=whole(1), default=1000, help="of a round")
    parser.add_argument(
        "--updates",
        nargs="+",
        type=whole(1),
        default=[64, 1000, 4000],
        help="their evacuations",
    )
    parser.add_argument(
        "--lambdas",
        nargs="+",
        type=float,
        choices=LAMBDAS,
        help="default: the training's own",
    )
    parser.add_argument("--seed", type=whole(0), default=300_000, help="the first")
    parser.add_argument("--workers", type=whole(0), default=2)
    asked = parser.parse_args()
    training = Training.resumed(load_checkpoint(asked.training))
    if "robots" not in training.learners:
        raise InputError(f"{asked.training}: its robots do not learn.")
    learner = training.learners["robots"]
    lambdas = asked.lambdas or [learner.settings.lambd]
    plan = training.task.plans[0]
    scenario = training.settings.scenario
    who = player_of(learner)  # as it is
    fires = [FIRES[name]() for name in asked.fire]

    of_rounds = {lambd: [] for lambd in lambdas}
    evacuations = decisions = 0
    make_ready()
    with workers(asked.workers) as pool:
        for number in range(asked.rounds):
            first = asked.seed + number * asked.episodes
            seeds = range(first, first + asked.episodes)
            shares = chunks(seeds, EPISODES_PER_JOB)
            jobs = [
                Job(plan, scenario, who, fires[k % len(fires)], some)  # in turn
                for k, some in enumerate(shares)
            ]
            lives = map_in_shares(pool, played, jobs)
            evacuations += len(lives)
            decisions += sum(life.steps for life in lives)
            for lambd, rounds in of_rounds.items():
                rounds.append(gradients_of(learner, lives, lambd))
            print(f"{evacuations:,} evacuations, {decisions:,} decisions")
            print(table(of_rounds, asked.updates), flush=True)


if __name__ == "__main__":
    sys.exit(exit_status(main))
