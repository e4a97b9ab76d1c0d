"""Ship what was learned: the policies of two trainings in one file, weights alone.

Clauses: C5, C7, D2.

    python -m reference.workshop.training.shipping ROBOTS FIRE

writes SHIPPED anew from two checkpoints of one building and scenario: the robots of the
first and the fire of the second, with how they were made. `--robots learned` and
`--fire learned` play them.
"""

import sys
from dataclasses import replace
from typing import Any

from reference.learning.rollouts import Learned
from reference.learning.settings import SIDES
from reference.workshop.strategies import SHIPPED
from reference.workshop.training.checkpoints import Checkpoint, load, save
from reference.workshop.training.policies import LearnedFire, LearnedRobots


def shipped(robots: Checkpoint, fire: Checkpoint) -> Checkpoint:
    """A checkpoint in which nobody learns any more and both sides are networks.

    Raises CheckpointError where a side was not learned, or in another world.
    """
    policies = LearnedRobots(robots), LearnedFire(fire)
    policies[1].refuse_elsewhere(policies[0].building, policies[0].scenario)
    fixed: dict[Any, Any] = {
        side: Learned(policy.learned.settings, policy.learned.weights)
        for side, policy in zip(SIDES, policies, strict=True)
    }
    settings = replace(robots.task.settings, fire=fire.task.settings.fire)
    task = replace(robots.task, settings=settings, fixed=fixed, imitate=None)
    made: dict[str, Any] = {
        side: how(each) for side, each in zip(SIDES, (robots, fire), strict=True)
    }
    return Checkpoint(task, robots.round, {}, made, robots.version)


def how(checkpoint: Checkpoint) -> dict[str, Any]:
    """What made a checkpoint: the options of its training, and how far it went."""
    task = checkpoint.task
    steps = {side: state["steps"] for side, state in checkpoint.learners.items()}
    fixed = {s: w if isinstance(w, str) else "a network" for s, w in task.fixed.items()}
    return {
        "preset": task.settings.preset,
        "building": task.building,
        "seed": task.seed,
        "version": checkpoint.version,
        "decisions": steps,
        "against": fixed,
    }


if __name__ == "__main__":
    save(shipped(*map(load, sys.argv[1:3])), SHIPPED)
    print(SHIPPED, f"{SHIPPED.stat().st_size / 1e6:.1f} MB")
