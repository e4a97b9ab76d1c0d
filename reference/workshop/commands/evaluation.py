"""The command evaluate: all robots against all fires, by one ruler.

Clauses: F9, F12.
"""

import json
import sys
from argparse import Namespace
from collections.abc import Sequence
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any

from reference.building import building_of
from reference.evaluation.bounds import best_reward
from reference.evaluation.score import PAPER, Ruler, RulerError
from reference.workshop.commands import options
from reference.workshop.commands.common import (
    Command,
    again,
    noted,
    workforce,
)
from reference.workshop.evaluation import crossplay
from reference.workshop.files import write_json
from reference.workshop.runs import ContradictionError, held

RULER = "ruler.json"


def evaluate(arguments: Namespace) -> None:
    """Lets all robots meet all fires on the same seeds: survivors, R, h and E."""
    if arguments.resume and not arguments.out:
        raise ContradictionError("--resume goes with --out: which folder?")
    start = partial(_evaluation, arguments)
    with held(arguments.out, arguments.resume, start) as evaluation:
        _evaluate(evaluation, arguments)


def _evaluate(evaluation: crossplay.Evaluation, arguments: Namespace) -> None:
    """Play missing runs, then write and print the results."""
    noted(evaluation)
    ruler, baseline = _given(arguments, evaluation), arguments.baseline
    records = _played(evaluation, arguments)
    try:
        if not ruler:
            ruler = crossplay.ruler_of(records, baseline, *evaluation.arena.points)
        note = _explained(arguments, ruler)
    except RulerError as error:
        note = f"no E, since no ruler comes of {baseline}: {error}"
    cells = crossplay.cells(records, ruler, baseline)
    if arguments.out:
        _keep(arguments.out, evaluation, ruler, cells, records)
    if arguments.json:
        print(json.dumps(crossplay.as_json(evaluation, ruler, cells)))
        if not ruler:
            print(note, file=sys.stderr)
    else:
        print(evaluation.about())
        shown = [name for name in crossplay.HEADINGS if ruler or name != "score"]
        print(crossplay.table(cells, shown))
        print(f"[95 % bootstrap intervals over runs]  {note}")


def _evaluation(arguments: Namespace) -> crossplay.Evaluation:
    """Begin an evaluation, or resume one with further robots and fires."""
    names = crossplay.Asked.__dataclass_fields__
    asked = crossplay.Asked(**{name: getattr(arguments, name) for name in names})
    start = crossplay.resume if arguments.resume else crossplay.begin
    return start(asked, arguments.out)


def _given(arguments: Namespace, evaluation: crossplay.Evaluation) -> Ruler | None:
    """The ruler, where it is known before anything is played."""
    if arguments.baseline is None:
        return crossplay.read_ruler(arguments.ruler) if arguments.ruler else PAPER
    if arguments.ruler:
        raise ContradictionError(
            "--ruler has a baseline already: leave out one of the two."
        )
    if arguments.baseline not in evaluation.robots:
        raise ContradictionError(
            f"--baseline {arguments.baseline}: is not among the robots. Add it to "
            "--robots."
        )
    return None


def _played(
    evaluation: crossplay.Evaluation, arguments: Namespace
) -> list[crossplay.Record]:
    """Play all runs; if interrupted, say how to resume."""
    folder = arguments.out
    same = {"baseline": arguments.baseline, "ruler": arguments.ruler}
    resumed = folder and again("evaluate", out=folder, **same)
    after = f"Go on with: {resumed}" if resumed else "Take fewer:"
    with workforce(arguments.workers, evaluation.about(), after) as (executor, stop):
        records = crossplay.evaluate(evaluation, folder, executor, stop)
    if len(records) == len(evaluation.runs):
        return records
    if not resumed:
        raise KeyboardInterrupt("stopped; nothing was kept, since no --out was named")
    raise KeyboardInterrupt(
        f"stopped after {len(records)} runs, which are kept. Go on with:\n  {resumed}"
    )


def _keep(
    folder: Path,
    evaluation: crossplay.Evaluation,
    ruler: Ruler | None,
    cells: Sequence[crossplay.Cell],
    records: Sequence[crossplay.Record],
) -> None:
    """Write tables and pictures beside the runs; with a ruler, also its own."""
    from reference.workshop.drawing import crossplay as played
    from reference.workshop.drawing import page
    from reference.workshop.drawing import ruler as rulers

    crossplay.write_cells(folder, evaluation, ruler, cells)
    pictures = {
        "matrix.png": played.matrix(cells),
        "evacuations.png": played.curves(records),
    }
    if ruler:
        building = building_of(evaluation.arena.plan)
        best = best_reward(building, evaluation.arena.people)
        write_json(folder / RULER, asdict(ruler))
        pictures["ruler.png"] = rulers.curve(ruler, best)
        pictures["scores.png"] = rulers.contours(ruler, _readings(cells))
    else:  # fewer runs may have yielded one
        for name in (RULER, "ruler.png", "scores.png"):
            (folder / name).unlink(missing_ok=True)
    for name, figure in pictures.items():
        page.save(figure, folder / name)
    print(f"tables and pictures are in {folder}", file=sys.stderr)


def _readings(cells: Sequence[crossplay.Cell]) -> list[Any]:
    """Points of each pair for the chart, with labels short even for long paths."""
    from reference.workshop.drawing.crossplay import names
    from reference.workshop.drawing.ruler import Reading

    def short(side: str) -> dict[str, str]:
        players = list(dict.fromkeys(getattr(cell, side) for cell in cells))
        labels = [name.replace("\n", " ") for name in names(players)]
        return dict(zip(players, labels, strict=True))

    robots, fire = short("robots"), short("fire")
    return [
        Reading(robots[cell.robots], fire[cell.fire], cell.reward, cell.difficulty)
        for cell in cells
    ]


def _explained(arguments: Namespace, ruler: Ruler) -> str:
    """Say which ruler was used."""
    if arguments.baseline:
        whose = f"calibrated so that {arguments.baseline} scores 1 over its fires"
    else:
        whose = f"read from {arguments.ruler}" if arguments.ruler else "the paper's"
    return f"E by a ruler {whose}: k = {ruler.k:.3g}, beta = {ruler.beta:,.4g}"


EVALUATE_OPTIONS: options.Table = {
    **options.player("robots", "default: sweep", **options.SEVERAL),
    **options.player("fire", "default: random", **options.SEVERAL),
    **options.PLACE,
    "--episodes": options.number(
        1, f"of each pair, number i with seed + i; default: {crossplay.EPISODES}"
    ),
    **options.SAMPLE,
    **options.WORKERS,
    "--out": options.path("DIR", "keep runs, tables and pictures there"),
    "--resume": options.flag("go on in DIR; more may be asked for"),
    "--ruler": options.path(
        "FILE", "a ruler.json, which evaluate --out writes; default: the paper's"
    ),
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
