"""The command experiment: arms, seeds and tests from a file, as jobs; then a page.

Clauses: E6, F12.
"""

import json
import sys
from argparse import Namespace
from collections.abc import Callable, Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from textwrap import fill
from typing import Any

from reference.workshop.commands import options
from reference.workshop.commands.common import (
    Command,
    again,
    counted,
    ctrl_c,
    quoted,
    workforce,
)
from reference.workshop.files import write_whole
from reference.workshop.runs import RunError, held
from reference.workshop.workers import cluster


def experiment(arguments: Namespace) -> None:
    """Trains and tests the arms of an experiment's file, and writes a page about it."""
    from reference.workshop.experiment import design, jobs

    folder = arguments.out or Path("out") / arguments.file.stem
    resumed = again(f"experiment {quoted(arguments.file)}", out=folder)
    with held(folder, arguments.resume, partial(design.read, arguments.file)) as asked:
        about = f"{counted(len(asked.trainings), 'trainings')}, then tests"
        with _hands(arguments, about, resumed) as (executor, stop):
            failed = jobs.train_teams(asked, folder, executor, stop)
            found = [] if stop() else jobs.play_tests(asked, folder, executor, stop)
        if stop():
            raise KeyboardInterrupt(f"stopped; go on with:\n  {resumed}")
        if found:
            _tell(asked, found, folder, arguments.json)
    if failed:
        raise RunError("\n".join(f"{team}: {why}" for team, why in failed.items()))


@contextmanager
def _hands(
    arguments: Namespace, about: str, resumed: str
) -> Iterator[tuple[Executor, Callable[[], bool]]]:
    """Yield an executor, and a check for Ctrl-C."""
    if arguments.cluster is None:
        after = f"Go on with: {resumed}"
        with workforce(arguments.workers, about, after) as work:
            yield work
    else:
        with cluster(arguments.cluster) as executor, ctrl_c() as stop:
            yield executor, stop


def _tell(asked: Any, found: list[Any], folder: Path, as_json: bool) -> None:
    """Write the page and its pictures; print the table and the answer."""
    from reference.workshop.crossplay.results import as_plain, table
    from reference.workshop.drawing import crossplay as charts
    from reference.workshop.drawing import curves
    from reference.workshop.drawing import page as pictures
    from reference.workshop.experiment import jobs, report

    results = report.Results(asked, found)
    cells, answer = results.cells(), results.answer()
    pictures.save(charts.matrix(cells, fill(report.OVER, 80)), folder / "matrix.png")
    arms: dict[str, list[curves.Run]] = {}
    for team, made in jobs.over(asked, folder).items():
        arms.setdefault(jobs.arm_of(team), []).append(curves.read(made))
    pictures.save(curves.of_arms(arms), folder / "curves.png")
    page = report.page(results, "matrix.png", "curves.png")
    write_whole(folder / "page.md", page.encode())
    if as_json:
        told = {"answer": answer, "cells": [as_plain(cell) for cell in cells]}
        print(json.dumps(told))
    else:
        print(table(cells, report.SHOWN), answer, sep="\n")
    print(f"the page is {folder / 'page.md'}", file=sys.stderr)


EXPERIMENT_OPTIONS: options.Table = {
    "file": options.path("FILE", "what to train and test, its seeds too, in TOML"),
    **options.WORKERS,
    "--cluster": {
        "metavar": "ADDRESS",
        "help": "a Dask scheduler whose workers do it instead, such as "
        "tcp://10.0.0.1:8786; they must share DIR",
    },
    "--out": options.path("DIR", "default: out/NAME, which is FILE's without .toml"),
    "--resume": options.flag("go on in DIR; what changed in FILE is made anew"),
}

EXAMPLE = """experiment mine.toml

what stands in mine.toml:
  python -m pydoc reference.workshop.experiment.design"""
EXPERIMENT = Command(experiment, EXPERIMENT_OPTIONS, EXAMPLE, chance=False)
