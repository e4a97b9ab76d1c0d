"""How much of the robots' gradient is signal, and does λ change that?

    python tutorials/experiments/signal_by_lambda.py out/league --fire busiest fixed

Robots of a training play evacuations, without learning from them. Their gradient's
signal over its noise is printed for several λ: 1 believes what happened after a
decision, 0 what the critic says of the next one. Near 0, on either side, there is none.
Robots that have learned in several buildings play in the first, or in an example.
"""

import sys
from argparse import ArgumentParser
from dataclasses import replace
from pathlib import Path

from reference.learning.adversarial import player_of
from reference.learning.rollouts import Job, play
from reference.paper import InputError
from reference.workshop.commands.common import exit_status
from reference.workshop.commands.options import whole
from reference.workshop.engine import make_ready, run_to_decision
from reference.workshop.storage.workers import (
    chunks,
    map_in_shares,
    one_thread,
    workers,
)
from reference.workshop.strategies import FIRES
from reference.workshop.training.checkpoints import load_checkpoint
from reference.workshop.training.gradient import measure_signal
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


def main():
    parser = ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("training", type=Path, help="its folder")
    parser.add_argument("--fire", nargs="+", choices=FIRES, default=["busiest"])
    parser.add_argument("--episodes", type=whole(1), default=96, help="under each fire")
    parser.add_argument("--seed", type=whole(0), default=300_000)
    parser.add_argument("--workers", type=whole(0), default=2)
    asked = parser.parse_args()
    training = Training.resumed(load_checkpoint(asked.training))
    if "robots" not in training.learners:
        raise InputError(f"{asked.training}: its robots do not learn.")
    learner = training.learners["robots"]
    plan = training.task.plans[0]
    scenario = training.settings.scenario

    # Robots play as they are.
    who = player_of(learner)
    seeds = chunks(range(asked.seed, asked.seed + asked.episodes), EPISODES_PER_JOB)
    jobs = [
        Job(plan, scenario, who, FIRES[name](), some)
        for name in asked.fire
        for some in seeds
    ]
    make_ready()
    with workers(asked.workers) as pool:
        lives = map_in_shares(pool, played, jobs)
    decisions = sum(life.steps for life in lives)
    print(f"{len(lives)} evacuations, {decisions:,} decisions")

    # What would they learn from it, by each λ? Normalisers stay as they are.
    settings = learner.settings
    for lambd in LAMBDAS:
        learner.settings = replace(settings, lambd=lambd)
        learner.buffer = [learner.with_targets(life) for life in lives]
        signal = measure_signal(learner)
        figures = (f"{name} {figure:.2f}" for name, figure in signal.items())
        print(f"lambda {lambd}: {', '.join(figures)}")


if __name__ == "__main__":
    sys.exit(exit_status(main))
