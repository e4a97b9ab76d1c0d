"""The command evaluate: all robots against all fires, by one ruler."""

from argparse import Namespace
from functools import partial
from pathlib import Path
from typing import Any

from reference.evaluation.bounds import best_reward, critical_points
from reference.evaluation.score import Ruler, RulerError, paper_ruler
from reference.workshop.commands import options
from reference.workshop.commands.common import note, resumable, tell
from reference.workshop.comparing import matches, results, runs
from reference.workshop.comparing.matches import Arena, Evaluation
from reference.workshop.comparing.results import Cell
from reference.workshop.comparing.runs import RunResult
from reference.workshop.storage.files import write_json
from reference.workshop.storage.records import did_you_mean
from reference.workshop.storage.runs import ContradictionError, refuse_options


@options.command(
    "evaluate --robots none patrol sweep --fire none random greedy \\\n"
    "      --baseline sweep --episodes 10 --out out/evaluation",
    options.player("robots", "default: sweep", nargs="+"),
    options.player("fire", "default: random", nargs="+"),
    options.BUILDING,
    options.PEOPLE,
    options.number("--episodes", 1, f"of each pair; default: {matches.EPISODES}"),
    options.SAMPLE,
    options.ERRORS,
    options.WORKERS,
    options.folder("--out", "keep runs, tables and pictures there"),
    options.flag("--resume", "go on in DIR, also with further --robots and --fire"),
    options.option(
        "--baseline", "robots to compare with; E is 1 for them on average", metavar="S"
    ),
    options.SEED,
    options.JSON,
    end=options.strategies(),
)
def evaluate(arguments: Namespace) -> None:
    """Plays all robots against all fires: survival, reward R, difficulty h, score E."""
    out = arguments.out
    baseline = arguments.baseline
    if arguments.resume and not out:
        raise ContradictionError("--resume goes with --out: which folder?")
    same = ["evaluate"]
    if baseline:
        same += ["--baseline", baseline]
    with resumable(arguments, out, partial(_evaluation, arguments), *same) as work:
        evaluation, executor = work
        if baseline and baseline not in evaluation.robots:
            told = f"--baseline {baseline}: add it to --robots."
            raise ContradictionError(told + did_you_mean(baseline, evaluation.robots))
        note(evaluation.about())
        played = runs.evaluate(evaluation, out, executor)
        _tell(arguments, evaluation, played)


def _evaluation(arguments: Namespace) -> Evaluation:
    """Begin an evaluation, or resume one with further robots and fires."""
    asked = options.of_evaluation(arguments)
    robots = arguments.robots or ()
    fires = arguments.fire or ()
    if arguments.resume:
        begun = matches.resume(arguments.out, robots, fires)
        arena = {"building": begun.arena.building, "people": begun.arena.people}
        refuse_options(asked, vars(begun) | arena)
        return begun
    return matches.begin(robots or ["sweep"], fires or ["random"], **asked)


def _tell(
    arguments: Namespace, evaluation: Evaluation, played: list[RunResult]
) -> None:
    """Print and keep what the runs come to."""
    ruler, of_ruler = _ruler(evaluation, played, arguments.baseline)
    cells = results.cells(played, ruler, arguments.baseline)
    report = results.as_json(evaluation, ruler, cells)
    shown = [name for name in results.HEADINGS if ruler or name != "score"]
    table = results.table(cells, shown)
    below = f"[95 % bootstrap intervals over runs]  {of_ruler}"
    head = [evaluation.about(), *report["notes"]]
    tell(arguments, report, "\n".join([*head, table, below]))
    if arguments.out:  # last: whatever cannot be written, the table has been told
        write_json(arguments.out / "cells.json", report)
        _draw(arguments.out, evaluation.arena, ruler, cells, played)


def _ruler(
    evaluation: Evaluation, played: list[RunResult], baseline: str | None
) -> tuple[Ruler | None, str]:
    """The paper's ruler, or one that a baseline calibrates; and which, or why none."""
    ruler = paper_ruler()
    which = "the paper's ruler"
    if baseline:
        which = f"a ruler on which {baseline} scores 1 over its fires"
        arena = evaluation.arena
        points = critical_points(arena.drawn, arena.scenario)
        try:
            ruler = results.ruler_of(played, baseline, *points)
        except RulerError as error:
            return None, f"no E, since the runs of {baseline} calibrate none: {error}"
    return ruler, f"E by {which}: k = {ruler.k:.3g}, beta = {ruler.beta:,.4g}"


def _draw(
    folder: Path, arena: Arena, ruler: Ruler | None, cells: list[Cell], played: Any
) -> None:
    """Draw pictures beside the runs; those of a ruler only where there is one."""
    from reference.workshop.drawing import crossplay, save
    from reference.workshop.drawing.ruler import contours, curve

    save(crossplay.matrix(cells), folder / "matrix.png")
    save(crossplay.curves(played), folder / "evacuations.png")
    for name in ("ruler.png", "scores.png"):  # fewer runs may have yielded a ruler
        (folder / name).unlink(missing_ok=True)
    if ruler:
        best = best_reward(arena.drawn, arena.people)
        save(curve(ruler, best), folder / "ruler.png")
        save(contours(ruler, cells), folder / "scores.png")
    note(f"tables and pictures are in {folder}")
