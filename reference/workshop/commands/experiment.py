"""The command experiment: arms, seeds and tests from a file, as jobs.

Clauses: E6, F12.
"""

import json
import os
import sys
from argparse import Namespace
from functools import partial
from pathlib import Path
from typing import Any

from reference.workshop.commands import options
from reference.workshop.commands.common import Command, quoted, workforce
from reference.workshop.runs import RunError, held


def experiment(arguments: Namespace) -> None:
    """Trains and tests the arms of an experiment's file; what they come to."""
    os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")  # before torch is loaded
    if arguments.out is None:
        arguments.out = Path("out") / arguments.file.stem
    with held(arguments.out, arguments.resume, partial(_asked, arguments)) as asked:
        failed = _performed(asked, arguments)
        _tell(asked, arguments)
    if failed:
        raise RunError("\n".join(f"{name}: {why}" for name, why in failed.items()))


def _asked(arguments: Namespace) -> Any:
    """Read the file; on resume, what was begun may not have changed."""
    from reference.workshop.experiment import asked

    found = asked.read(arguments.file)
    if arguments.resume:
        asked.refuse_changed(found, arguments.out)
    return found


def _performed(asked: Any, arguments: Namespace) -> dict[str, str]:
    """Do what is missing; which steps failed, and why."""
    from reference.workshop.experiment import asked as files
    from reference.workshop.experiment.steps import Plan, perform

    files.begin(asked, arguments.out)
    steps = list(Plan(asked, arguments.out, here=True).steps())
    again = (
        f"python -m reference experiment {quoted(arguments.file)} --resume "
        f"--out {quoted(arguments.out)}"
    )
    about = f"{len(asked.trainings)} trainings, {len(steps)} jobs in all"
    with workforce(arguments.workers, about, again) as (executor, stop):
        failed = perform(steps, executor, lambda: max(1, arguments.workers), stop)
        if stop():
            raise KeyboardInterrupt(f"stopped; go on with:\n  {again}")
    return failed


def _tell(asked: Any, arguments: Namespace) -> None:
    """Print the matrix of all tests that are there."""
    from reference.workshop.evaluation import crossplay
    from reference.workshop.experiment.results import Results
    from reference.workshop.experiment.steps import Plan

    records = Plan(asked, arguments.out, here=True).records()
    if not records:
        return
    cells = Results(asked, records).cells()
    if arguments.json:
        print(json.dumps({"cells": [crossplay.as_plain(cell) for cell in cells]}))
    else:
        print(crossplay.table(cells))
    print(f"everything is in {arguments.out}", file=sys.stderr)


EXPERIMENT_OPTIONS: options.Table = {
    "file": options.path("FILE", "what to train and test, in TOML"),
    **options.WORKERS,
    "--out": options.path("DIR", "default: out/ and FILE's name"),
    "--resume": options.flag("go on in DIR; more seeds and arms may be asked for"),
}

EXPERIMENT = Command(
    experiment, EXPERIMENT_OPTIONS, "experiment tutorials/experiments/tiny.toml"
)
