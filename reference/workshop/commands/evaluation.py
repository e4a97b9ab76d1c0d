"""The command evaluate: all robots against all fires, by one ruler.

Clauses: F9, F12.
"""

import json
import sys
from argparse import Namespace
from collections.abc import Sequence
from functools import partial
from pathlib import Path

from reference.evaluation.bounds import best_reward, critical_points
from reference.evaluation.score import PAPER, Ruler, RulerError
from reference.workshop.commands import options
from reference.workshop.commands.common import Command, again, workforce
from reference.workshop.crossplay import matches, results, runs
from reference.workshop.crossplay.matches import Evaluation
from reference.workshop.crossplay.results import Cell
from reference.workshop.crossplay.runs import RunResult
from reference.workshop.files import write_json
from reference.workshop.runs import ContradictionError, held, refuse_options

ASKED = ("building", "people", "seed", "episodes", "sample")


def evaluate(arguments: Namespace) -> None:
    """Lets all robots meet all fires on the same seeds: survivors, R, h and E."""
    if arguments.resume and not arguments.out:
        raise ContradictionError("--resume goes with --out: which folder?")
    start = partial(_evaluation, arguments)
    with held(arguments.out, arguments.resume, start) as evaluation:
        baseline = arguments.baseline
        if baseline and baseline not in evaluation.robots:
            raise ContradictionError(
                f"--baseline {baseline}: is not among the robots. Add it to --robots."
            )
        _tell(arguments, evaluation, _played(evaluation, arguments))


def _evaluation(arguments: Namespace) -> Evaluation:
    """Begin an evaluation, or resume one with further robots and fires."""
    asked = {name: getattr(arguments, name) for name in ASKED}
    who = {"robots": arguments.robots, "fires": arguments.fire}
    given = {name: value for name, value in who.items() if value is not None}
    if arguments.resume:
        begun = matches.resume(arguments.out, **given)
        where = {"building": begun.arena.building, "people": begun.arena.people}
        refuse_options(asked, vars(begun) | where)
        return begun
    given |= {name: value for name, value in asked.items() if value is not None}
    return matches.begin(**given)


def _played(evaluation: Evaluation, arguments: Namespace) -> list[RunResult]:
    """Play all runs; if interrupted, say how to resume."""
    folder = arguments.out
    resumed = folder and again("evaluate", out=folder, baseline=arguments.baseline)
    after = f"Go on with: {resumed}" if resumed else "Take fewer:"
    with workforce(arguments.workers, evaluation.about(), after) as (executor, stop):
        found = runs.evaluate(evaluation, folder, executor, stop)
    if len(found) == len(evaluation.runs):
        return found
    if not resumed:
        raise KeyboardInterrupt("stopped; nothing was kept, since no --out was named")
    raise KeyboardInterrupt(
        f"stopped after {len(found)} runs, which are kept. Go on with:\n  {resumed}"
    )


def _tell(arguments: Namespace, evaluation: Evaluation, found: list[RunResult]) -> None:
    """Print and keep what the runs come to."""
    baseline = arguments.baseline
    ruler, note = _ruler(evaluation, found, baseline)
    cells = results.cells(found, ruler, baseline)
    if arguments.out:
        _keep(arguments.out, evaluation, ruler, cells, found)
    if arguments.json:
        print(json.dumps(results.as_json(evaluation, ruler, cells)))
        if not ruler:
            print(note, file=sys.stderr)
    else:
        print(evaluation.about())
        shown = [name for name in results.HEADINGS if ruler or name != "score"]
        print(results.table(cells, shown))
        print(f"[95 % bootstrap intervals over runs]  {note}")


def _ruler(
    evaluation: Evaluation, found: list[RunResult], baseline: str | None
) -> tuple[Ruler | None, str]:
    """The paper's ruler, or one that a baseline calibrates; and which, or why none."""
    ruler, whose = PAPER, "the paper's"
    if baseline:
        whose = f"calibrated so that {baseline} scores 1 over its fires"
        arena = evaluation.arena
        points = critical_points(arena.drawn, arena.scenario)
        try:
            ruler = results.ruler_of(found, baseline, *points)
        except RulerError as error:
            return None, f"no E, since no ruler comes of {baseline}: {error}"
    return ruler, f"E by a ruler {whose}: k = {ruler.k:.3g}, beta = {ruler.beta:,.4g}"


def _keep(
    folder: Path,
    evaluation: Evaluation,
    ruler: Ruler | None,
    cells: Sequence[Cell],
    found: Sequence[RunResult],
) -> None:
    """Write tables and pictures beside the runs."""
    from reference.workshop.drawing import crossplay as charts
    from reference.workshop.drawing import page
    from reference.workshop.drawing import ruler as rulers

    told = results.as_json(evaluation, ruler, cells)
    write_json(folder / "cells.json", told)
    pictures = {
        "matrix.png": charts.matrix(cells),
        "evacuations.png": charts.curves(found),
    }
    if ruler:
        best = best_reward(evaluation.arena.drawn, evaluation.arena.people)
        pictures["ruler.png"] = rulers.curve(ruler, best)
        pictures["scores.png"] = rulers.contours(ruler, cells)
    else:  # fewer runs may have yielded one
        for name in ("ruler.png", "scores.png"):
            (folder / name).unlink(missing_ok=True)
    for name, figure in pictures.items():
        page.save(figure, folder / name)
    print(f"tables and pictures are in {folder}", file=sys.stderr)


EVALUATE_OPTIONS: options.Table = {
    **options.player("robots", "default: sweep", **options.SEVERAL),
    **options.player("fire", "default: random", **options.SEVERAL),
    **options.PLACE,
    "--episodes": options.number(
        1, f"of each pair, number i with seed + i; default: {matches.EPISODES}"
    ),
    **options.SAMPLE,
    **options.WORKERS,
    "--out": options.path("DIR", "keep runs, tables and pictures there"),
    "--resume": options.flag("go on in DIR, also with further --robots and --fire"),
    "--baseline": {
        "metavar": "S",
        "help": "compare all with these robots, seed by seed, and calibrate the "
        "ruler: they score 1 on average over the fires; give weak and strong fires",
    },
}

EVALUATE = Command(
    evaluate,
    EVALUATE_OPTIONS,
    "evaluate --robots none patrol sweep --fire none random greedy \\\n"
    "      --baseline sweep --out out/evaluation",
)
