"""The command experiment: arms, seeds and tests from a file, as jobs; then a page.

Clauses: E6, F12.
"""

import json
import sys
from argparse import Namespace
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Executor
from contextlib import contextmanager, suppress
from functools import partial
from itertools import chain
from pathlib import Path
from textwrap import fill
from typing import Any

from reference.paper import InputError
from reference.workshop.commands import options
from reference.workshop.commands.common import (
    Command,
    again,
    ctrl_c,
    quoted,
    workforce,
    writable,
)
from reference.workshop.files import make_folder, write_whole
from reference.workshop.runs import ContradictionError, RunError, held
from reference.workshop.workers import cluster


def experiment(arguments: Namespace) -> None:
    """Trains and tests the arms of an experiment's file, and writes a page about it."""
    if arguments.seed is not None:
        raise ContradictionError("An experiment's seeds are in its file; drop --seed.")
    if arguments.out is None:
        arguments.out = Path("out") / arguments.file.stem
    if arguments.page:
        writable(arguments.page, (".md",), "a page")
        if (folder := arguments.page.with_suffix(".pictures")).is_file():
            raise RunError(f"{folder}: is a file. Name another page.")
    with held(arguments.out, arguments.resume, partial(_asked, arguments)) as asked:
        failed = _performed(asked, arguments)
        _tell(asked, arguments)
    if failed:
        raise RunError("\n".join(f"{name}: {why}" for name, why in failed.items()))


def _asked(arguments: Namespace) -> Any:
    """Read the file; on resume, refuse changes to what was begun."""
    from reference.workshop.experiment.asked import read
    from reference.workshop.experiment.begun import refuse_changed

    found = read(arguments.file)
    if arguments.resume:
        refuse_changed(found, arguments.out)
    return found


# -- Jobs ---------------------------------------------------------------------------


def _performed(asked: Any, arguments: Namespace) -> dict[str, str]:
    """Do missing steps; return which failed, and why."""
    from reference.workshop.experiment.begun import begin
    from reference.workshop.experiment.steps import Plan, perform

    begin(asked, arguments.out)
    here = arguments.cluster is None
    steps = list(Plan(asked, arguments.out, here).steps())
    file = quoted(arguments.file)
    resumed = again(f"experiment {file}", out=arguments.out, page=arguments.page)
    about = f"{len(asked.trainings)} trainings, {len(steps)} jobs in all"
    with _hands(arguments, about, resumed) as (executor, width, stop):
        failed = perform(steps, executor, width, stop)
        if stop():
            raise KeyboardInterrupt(f"stopped; go on with:\n  {resumed}")
    return failed


@contextmanager
def _hands(
    arguments: Namespace, about: str, resumed: str
) -> Iterator[tuple[Executor, Callable[[], int], Callable[[], bool]]]:
    """Yield an executor, how many jobs run at once, and a check for Ctrl-C."""
    if arguments.cluster is not None:
        print(f"{about}; cluster {arguments.cluster}", file=sys.stderr)
        with ctrl_c() as stop, cluster(arguments.cluster) as (executor, width):
            yield executor, width, stop
    else:
        count = arguments.workers
        with workforce(count, about, f"Go on with: {resumed}") as (executor, stop):
            yield executor, lambda: max(1, count), stop


# -- The page -----------------------------------------------------------------------


def _tell(asked: Any, arguments: Namespace) -> None:
    """Write page and pictures of all tests that are there; print the answer."""
    from reference.workshop.crossplay import results as crossplay
    from reference.workshop.experiment.page import answer, page
    from reference.workshop.experiment.results import Results
    from reference.workshop.experiment.steps import Plan

    plan = Plan(asked, arguments.out, here=True)
    if not (records := plan.records()):
        return
    results = Results(asked, records)
    path, folder = arguments.out / "page.md", arguments.out
    if arguments.page:
        path, folder = arguments.page, arguments.page.with_suffix(".pictures")
        make_folder(folder)
    pictures = [
        (told, file.relative_to(path.parent).as_posix())
        for told, file in _pictures(plan, results, folder)
    ]
    write_whole(path, page(results, pictures).encode())
    if arguments.json:
        cells = [crossplay.as_plain(vars(cell)) for cell in results.cells()]
        print(json.dumps({"answer": answer(results), "cells": cells}))
    else:
        print(crossplay.table(results.cells()))
        print(answer(results))
    print(f"the page is {path}", file=sys.stderr)


def _pictures(plan: Any, results: Any, folder: Path) -> Iterator[tuple[str, Path]]:
    """Draw matrix, curves and films into a folder: what each shows, and its file."""
    from reference.workshop.drawing import page
    from reference.workshop.drawing.crossplay import matrix
    from reference.workshop.drawing.experiment import last_gain, survivors
    from reference.workshop.experiment.page import OVER, points

    yield (
        "Survivors of all arms under all fires",
        page.save(matrix(results.cells(), fill(OVER, 80)), folder / "matrix.png"),
    )
    for name, title, side in (
        ("trainings", "Survivors while robots learned", "robots"),
        ("responses", "Survivors while best responses learned", "fire"),
    ):
        if arms := _curves(plan, name):
            figure = survivors(title, arms, side)
            if side == "fire":
                gain = points(last_gain(chain(*arms.values())))
                title += f"; in the fourth fifth less those in the last: {gain} points"
            yield title, page.save(figure, folder / f"{name}.png")
    yield from _films(plan, results, folder)


def _curves(plan: Any, name: str) -> dict[str, list[Any]]:
    """Read the curves of finished trainings in a folder, by arm, as in tables."""
    from reference.workshop.drawing.runs import read
    from reference.workshop.experiment.jobs import DONE
    from reference.workshop.experiment.results import arm_of

    asked = plan.experiment
    found: dict[str, list[Any]] = {arm: [] for arm in (*asked.arms, *asked.test.robots)}
    for done in sorted((plan.folder / name).glob(f"*/{DONE}")):
        with suppress(InputError):  # too short to draw
            run = read(done.parent)
            found[arm_of(run.name)].append(run)
    return {arm: runs for arm, runs in found.items() if runs}


def _films(plan: Any, results: Any, folder: Path) -> Iterable[tuple[str, Path]]:
    """Film nobody, the best by hand and a team that learned, under one fire."""
    from reference.workshop.drawing import film
    from reference.workshop.experiment.results import telling

    for team, evacuation in telling(results, plan):
        path = folder / f"film-{team}.gif"
        film.animate(evacuation.simulation(), path)
        yield f"`{team}`, seed {evacuation.seed}, under the same best response", path


EXPERIMENT_OPTIONS: options.Table = {
    "file": options.path("FILE", "what to train and test, its seeds too, in TOML"),
    **options.WORKERS,
    "--cluster": {
        "metavar": "ADDRESS",
        "help": "a Dask scheduler whose workers do it instead, such as "
        "tcp://10.0.0.1:8786",
    },
    "--out": options.path("DIR", "default: out/NAME, which is FILE's without .toml"),
    "--resume": options.flag("go on in DIR; more seeds and arms may be asked for"),
    "--seed": options.SEED["--seed"] | {"help": "refused: the seeds are in FILE"},
    "--page": options.path(
        "FILE",
        "where the page goes, its pictures beside it into "
        "NAME.pictures; default: DIR/page.md",
    ),
}

EXPERIMENT = Command(
    experiment, EXPERIMENT_OPTIONS, "experiment tutorials/experiments/tiny.toml"
)
