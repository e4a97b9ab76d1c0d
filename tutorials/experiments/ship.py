"""Ship what was learned: the policies of two trainings in one file, weights alone.

    python tutorials/experiments/ship.py ROBOTS FIRE
    python tutorials/experiments/ship.py ROBOTS FIRE --anywhere

The first writes SHIPPED anew from two checkpoints of one building and scenario: the
robots of the first and the fire of the second, with how they were made. `--robots
learned` and `--fire learned` play them there. The second writes ANYWHERE, which they
play in every other building and scenario, from checkpoints with a head of sets.
"""

import sys
from argparse import ArgumentParser
from dataclasses import replace
from typing import Any

from reference.learning.settings import Side
from reference.paper import InputError
from reference.workshop.commands.common import exit_status
from reference.workshop.strategies import ANYWHERE, SHIPPED
from reference.workshop.training.checkpoints import (
    Checkpoint,
    load_checkpoint,
    player_names,
    save_checkpoint,
)
from reference.workshop.training.policies import LearnedFire, LearnedRobots


def shipped(robots: Checkpoint, fire: Checkpoint) -> Checkpoint:
    """Combine two checkpoints into one in which both sides are fixed networks.

    Raises CheckpointError where a side was not learned, or in another world, and
    InputError where they learned with other numbers of the paper.
    """
    if robots.numbers != fire.numbers:
        raise InputError("both sides learned with other numbers. Train one anew.")
    guide = LearnedRobots(robots)
    foe = LearnedFire(fire)
    foe.refuse_elsewhere(guide.building, guide.scenario)
    settings = replace(robots.task.settings, fire=fire.task.settings.fire)
    fixed: dict[Side, Any] = {"robots": (guide.learned,), "fire": (foe.learned,)}
    task = replace(
        robots.task, settings=settings, fixed=fixed, initial={}, imitate=None
    )
    made: dict[str, Any] = {"robots": how(robots, "robots"), "fire": how(fire, "fire")}
    return Checkpoint(task, robots.round, {}, made, robots.version, robots.numbers)


def how(checkpoint: Checkpoint, side: Side) -> dict[str, Any]:
    """Describe how a side learned; of what ships already, as it was said before."""
    if side in checkpoint.progress:
        return dict(checkpoint.progress[side])
    task = checkpoint.task
    learners = checkpoint.learners
    return {
        "preset": task.settings.preset,
        "seed": task.seed,
        "version": checkpoint.version,
        "decisions": {name: state["steps"] for name, state in learners.items()},
        "against": {name: player_names(who) for name, who in task.fixed.items()},
        "imitated": task.imitate if side == "robots" else None,
        "initial": side in task.initial,
    }


def shipped_anywhere(robots: Checkpoint, fire: Checkpoint) -> Checkpoint:
    """Combine as `shipped` does; InputError for a network with a building in it."""
    for policy in (LearnedRobots(robots), LearnedFire(fire)):
        if not policy.anywhere:
            raise InputError(f"its {policy.side} is of one building: train --head set")
    return shipped(robots, fire)


def main():
    parser = ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("robots", metavar="ROBOTS.pt")
    parser.add_argument("fire", metavar="FIRE.pt")
    parser.add_argument("--anywhere", action="store_true", help="no building in it")
    asked = parser.parse_args()
    robots = load_checkpoint(asked.robots)
    fire = load_checkpoint(asked.fire)
    if asked.anywhere:
        save_checkpoint(shipped_anywhere(robots, fire), ANYWHERE)
    else:
        save_checkpoint(shipped(robots, fire), SHIPPED)


if __name__ == "__main__":
    sys.exit(exit_status(main))
