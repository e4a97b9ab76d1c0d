"""What each training of an experiment loses to a fire that learned against it alone.

    python tutorials/experiments/best_responses.py tutorials/experiments/league.toml \
        out/league

A best response begins from nothing and learns against robots that learn no more, with
the settings of all arms, for as many decisions as the least that is asked of a fire in
a league, 20,000.  One is made for each finished training, and for `escort`; then robots
meet the one made for them, on the seeds of the experiment's tests.

Whatever is finished is kept, each number of decisions apart; the same command goes on.
A training takes some four minutes of a core.  At the end best_responses.json beside
them has the survivors of each training in each evacuation, in per cent.
"""

import sys
from argparse import ArgumentParser
from pathlib import Path

import numpy as np
from how_many_buildings import finish_training, until_stopped

from reference.workshop.commands.options import whole
from reference.workshop.comparing.design import arm_of, read_experiment
from reference.workshop.comparing.intervals import (
    format_interval,
    interval_over_trainings,
)
from reference.workshop.comparing.jobs import finished
from reference.workshop.comparing.matches import Evaluation, with_digests
from reference.workshop.comparing.results import align_columns
from reference.workshop.comparing.runs import play_evaluation
from reference.workshop.storage.files import make_folder, write_json
from reference.workshop.storage.workers import workers
from reference.workshop.training.checkpoints import newest_checkpoint

GUIDE = "escort"
FIRE = {"batch_size": 32, "buffer_size": 64}


def responses(experiment, folder, decisions, workers_of_it):
    """Make a fire for each training; yield its name, its robots and the fire's folder.

    The guide has one of each seed, as an arm has trainings.
    """
    out = folder / "best_responses" / str(decisions)
    make_folder(out)
    settings = out / "settings.yaml"
    write_json(settings, {"reference": rows_of(experiment, decisions)})  # it is YAML
    trained = finished(experiment, folder)
    robots = {name: str(newest_checkpoint(path)) for name, path in trained.items()}
    robots |= {f"{GUIDE}-{seed}": GUIDE for seed in experiment.seeds}
    for name, word in robots.items():
        begin = ["--preset", experiment.preset, "--building", experiment.building]
        begin += ["--robots", word, "--seed", name.rpartition("-")[2]]
        begin += ["--settings", str(settings)]
        # a training's folder has a digest of all that made it in its name
        fire = out / (trained[name].name if name in trained else name)
        finish_training(fire, begin, workers_of_it)
        yield name, word, fire


def rows_of(experiment, decisions):
    """What differs from the preset: the settings of all arms, and the fire's length."""
    own = experiment.settings.get("fire", {})
    return {**experiment.settings, "fire": {**own, **FIRE, "max_steps": decisions}}


def table(survival):
    """Survivors of each arm, and how many more than with the guide."""
    rows = [["robots", "trainings", "survivors, %", "less " + GUIDE]]
    for arm, values in survival.items():
        own = interval_over_trainings(np.array(values))
        more = less(survival, arm, GUIDE) if arm != GUIDE else ""
        rows.append([arm, str(len(values)), format_interval(own, 1, ends=True), more])
    return align_columns(rows, "<>>>")


def less(survival, one, other):
    """How many points more survive with one arm than with another."""
    both = (np.array(survival[arm]) for arm in (one, other))
    return format_interval(interval_over_trainings(*both), 1, ends=True)


def main():
    parser = ArgumentParser(description="Best responses to each training.")
    parser.add_argument("file", type=Path, help="the experiment's TOML")
    parser.add_argument("folder", type=Path, help="where its trainings are")
    parser.add_argument("--decisions", type=whole(1), default=20_000, help="each")
    parser.add_argument("--workers", type=whole(0), default=2)
    asked = parser.parse_args()

    experiment = read_experiment(asked.file)
    test = experiment.test
    made = responses(experiment, asked.folder, asked.decisions, asked.workers)
    survival = {}
    for name, robots, fire in made:
        asked_of_it = Evaluation(
            experiment.arena,
            (robots,),
            (str(newest_checkpoint(fire)),),
            test.seed,
            test.episodes,
        )
        evaluation = with_digests(asked_of_it)
        with workers(asked.workers) as executor:
            runs = play_evaluation(evaluation, fire / "test", executor)
        shares = [100 * run.survival for run in runs]
        survival.setdefault(arm_of(name), []).append(shares)

    kept = asked.folder / "best_responses" / str(asked.decisions)
    write_json(kept / "best_responses.json", survival)
    print(table(survival))
    for one, other in experiment.compare:
        if {one, other} <= {*survival}:
            print(f"{one} less {other}: {less(survival, one, other)}")


if __name__ == "__main__":
    sys.exit(until_stopped(main))
