"""The command experiment: arms, seeds and tests from a file, as jobs; then a page."""

from argparse import Namespace
from pathlib import Path
from textwrap import fill
from typing import Any

from reference.paper import InputError
from reference.workshop.commands import options
from reference.workshop.commands.common import print_note, print_report, run_in_folder
from reference.workshop.storage.files import write_whole

PAGE = "page.md"


@options.command(
    "experiment tutorials/experiments/tiny.toml\n\nwhat stands in such a file:\n"
    "  python -m pydoc reference.workshop.comparing.design",
    options.option("file", "TOML: what to train and test, from which seeds", type=Path),
    options.WORKERS,
    options.option(
        "--cluster",
        "a Dask scheduler, as tcp://10.0.0.1:8786, whose workers all write into DIR",
        metavar="ADDRESS",
    ),
    options.folder("--out", "default: out/NAME for NAME.toml"),
    options.flag("--resume", "go on in DIR; what changed in the file is made anew"),
    options.json("building", "scenario", "answer", "cells (the table)"),
)
def experiment(arguments: Namespace) -> None:
    """Trains all variants in a file, tests them, and writes a page about it."""
    from reference.workshop.comparing import design, jobs, report

    if arguments.cluster and arguments.workers != options.CORES:
        raise InputError("--cluster brings its own workers: leave --workers out")
    folder = arguments.out or Path("out") / arguments.file.stem

    def read() -> Any:
        """Read the file, once there is something to go on with, if that is asked."""
        if arguments.resume:
            jobs.refuse_not_begun(folder)
        return design.read_experiment(arguments.file)

    running = run_in_folder(arguments, folder, read, "experiment", arguments.file)
    try:
        with running as (asked, executor):
            print_note(f"trainings: {len(asked.trainings)}, then tests")
            failed = jobs.finish_trainings(asked, folder, executor)
            if played := jobs.play_tests(asked, folder, executor):
                results = report.Results(asked, played)
                _write_page(results, folder)
                _print_answer(arguments, results)
                print_note(f"the page is {folder / PAGE}")
    finally:
        jobs.remove_left_locks(folder)  # of workers that were ended
    if failed:
        raise InputError("\n".join(f"{name}: {why}" for name, why in failed.items()))


def _write_page(results: Any, folder: Path) -> None:
    """Write the page and its pictures."""
    from reference.workshop.comparing import jobs, report
    from reference.workshop.drawing import crossplay, curves, save

    matrix = crossplay.matrix(results.cells(), fill(report.INTERVALS_NOTE, 80))
    save(matrix, folder / "matrix.png")
    arms: dict[str, list[curves.TrainingTable]] = {}
    for name, made in jobs.finished(results.experiment, folder).items():
        arms.setdefault(jobs.arm_of(name), []).append(curves.read_summaries(made))
    save(curves.curves_of_arms(arms), folder / "curves.png")
    page = report.report_page(results, "matrix.png", "curves.png")
    write_whole(folder / PAGE, page.encode())


def _print_answer(arguments: Namespace, results: Any) -> None:
    """Print the table and the answer."""
    from reference.workshop.comparing import report
    from reference.workshop.comparing.results import (
        cell_as_json,
        scenario_as_json,
        table,
    )

    asked = results.experiment
    arena = asked.arena
    cells = results.cells()
    answer = results.answer()
    facts = {
        "building": arena.building,
        "scenario": scenario_as_json(arena),
        "answer": answer,
        "cells": [cell_as_json(cell) for cell in cells],
    }
    text = f"{report.about_tests(asked)}\n{table(cells, report.SHOWN)}\n{answer}"
    print_report(arguments, facts, text)
