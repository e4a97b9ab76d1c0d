"""An arms race by age: robots of each tenth of a training meet fires of each tenth.

    python tutorials/experiments/by_age.py out/league --episodes 30

Above the diagonal robots meet fires of their future, below it those of their past. Runs
are kept in DIR/by_age: what was played there is not played again. Beside them three
ages of robots and fire play the same seed in one film, by_age.html.
"""

import sys
from argparse import ArgumentParser
from dataclasses import replace
from pathlib import Path

from reference import animate
from reference.paper import InputError
from reference.workshop.commands.common import exit_status
from reference.workshop.commands.options import whole
from reference.workshop.comparing import begin_evaluation, cells, play_evaluation
from reference.workshop.comparing.results import table
from reference.workshop.drawing import crossplay, save
from reference.workshop.storage.workers import workers
from reference.workshop.training.checkpoints import checkpoints_in, load_checkpoint


def ages(folder, tenths):
    """Find the checkpoint nearest to each tenth of the robots' decisions.

    Returns its age in per cent by its path. tenths: how many ages. Raises InputError
    where there is no checkpoint, or robots have not learned.
    """
    steps = {}
    for path in checkpoints_in(folder):
        learners = load_checkpoint(path).learners
        if "robots" not in learners:
            raise InputError(f"{folder}: its robots do not learn, so they have no age.")
        steps[path] = learners["robots"]["steps"]
    if not steps:
        raise InputError(f"{folder}: there is no checkpoint in this folder.")
    end = max(steps.values())
    if end == 0:
        raise InputError(f"{folder}: its robots have not learned yet. Let it go on.")
    found = {}
    for k in range(1, tenths + 1):
        goal = end * k / tenths
        path = min(steps, key=lambda path: abs(steps[path] - goal))
        found[str(path)] = f"{steps[path] / end:.0%}"
    return found


def main():
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("training", type=Path, help="the folder of a league")
    parser.add_argument("--tenths", type=whole(1), default=10, help="how many ages")
    parser.add_argument("--episodes", type=whole(1), default=30, help="of each match")
    parser.add_argument("--workers", type=whole(0), default=2)
    parser.add_argument("--seed", type=whole(0), default=5000, help="of the film")
    asked = parser.parse_args()
    found = ages(asked.training, asked.tenths)
    names = list(found)
    folder = asked.training / "by_age"

    # Every age of robots meets every age of fire.
    evaluation = begin_evaluation(names, names, seed=5000, episodes=asked.episodes)
    with workers(asked.workers) as executor:
        results = play_evaluation(evaluation, folder, executor)
    matches = [
        replace(cell, robots=found[cell.robots], fire=found[cell.fire])
        for cell in cells(results, None)
    ]
    print(table(matches, ["survival"]))
    words = "ages in shares of the training; means over runs, 95 % bootstrap intervals"
    print(save(crossplay.matrix(matches, words), folder / "by_age.png"))

    # The film shows the youngest, the middle and the oldest age.
    three = [names[0], names[len(names) // 2], names[-1]]
    runs = evaluation.simulations([(name, name, asked.seed) for name in three])
    headings = [f"robots at {found[name]}\nand the fire of that age" for name in three]
    animate(runs, folder / "by_age.html", headings)


if __name__ == "__main__":
    sys.exit(exit_status(main))
