"""The command evaluate: all robots against all fires, by one ruler."""

from argparse import Namespace
from dataclasses import replace
from functools import partial
from pathlib import Path

from reference.evaluation.bounds import best_reward, critical_points
from reference.evaluation.score import paper_ruler
from reference.workshop.commands import options
from reference.workshop.commands.common import print_note, print_report, run_in_folder
from reference.workshop.comparing import matches, results, runs
from reference.workshop.comparing.matches import Arena, Evaluation
from reference.workshop.comparing.results import Baseline, Cell
from reference.workshop.comparing.runs import RunResult
from reference.workshop.storage.files import write_json
from reference.workshop.storage.records import did_you_mean
from reference.workshop.storage.runs import ContradictionError, refuse_options
from reference.workshop.storage.scenarios import kept_fields, list_keys

CROSSED = "each plays against all of --{}; default: {}"
NO_BASELINE = (
    "no E on a baseline of this building: name a scripted guide among --robots, such "
    "as escort, or take --baseline"
)


@options.command(
    "evaluate --robots none patrol sweep --fire none random greedy \\\n"
    "      --baseline sweep --episodes 10 --out out/evaluation",
    options.player("robots", CROSSED.format("fire", "sweep"), nargs="+"),
    options.player("fire", CROSSED.format("robots", "random"), nargs="+"),
    options.BUILDING,
    options.PEOPLE_OPTION,
    options.SCENARIO,
    options.number(
        "--episodes", 1, f"of each pair; default: {matches.DEFAULT_EPISODES}"
    ),
    options.SAMPLE,
    options.ERRORS,
    options.WORKERS,
    options.folder("--out", "keep runs, tables and pictures there"),
    options.flag("--resume", "go on in DIR, also with further --robots and --fire"),
    options.option(
        "--baseline",
        "robots to compare with, and of the second E, which is 1 for them on average "
        "over the fires; default: the best scripted guide of --robots, for E alone",
        metavar="S",
    ),
    options.SEED,
    options.JSON,
    end=options.list_players() + "\n" + list_keys(),
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
    with run_in_folder(
        arguments, out, partial(_begin_or_resume, arguments), *same
    ) as work:
        evaluation, executor = work
        if baseline and baseline not in evaluation.robots:
            told = f"--baseline {baseline}: add it to --robots."
            raise ContradictionError(told + did_you_mean(baseline, evaluation.robots))
        print_note(evaluation.about())
        for line in matches.notes(evaluation):
            print_note(line)
        played = runs.play_evaluation(evaluation, out, executor)
        _print_and_keep(arguments, evaluation, played)


def _begin_or_resume(arguments: Namespace) -> Evaluation:
    """Begin an evaluation, or resume one with further robots and fires."""
    asked = options.evaluation_options(arguments)
    robots = arguments.robots or ()
    fires = arguments.fire or ()
    if arguments.resume:
        begun = matches.resume_evaluation(arguments.out, robots, fires)
        stated = asked.get("scenario", {})
        arena = {"building": begun.arena.building, "people": begun.arena.people}
        arena["scenario"] = kept_fields(begun.arena.scenario, stated)
        refuse_options(asked, vars(begun) | arena)
        return begun
    return matches.begin_evaluation(robots or ["sweep"], fires or ["random"], **asked)


def _print_and_keep(
    arguments: Namespace, evaluation: Evaluation, played: list[RunResult]
) -> None:
    """Print and keep what the runs come to."""
    arena = evaluation.arena
    ruler = paper_ruler()
    baseline = None
    if arena.people:
        points = critical_points(arena.drawn, arena.scenario)
        baseline = results.baseline_of(played, arguments.baseline, *points)
    cells = results.cells(
        played, ruler, arguments.baseline, baseline.ruler if baseline else None
    )
    report = results.evaluation_as_json(evaluation, ruler, cells, baseline)
    text = [
        evaluation.about(),
        *report["notes"],
        results.table(cells, baseline=baseline.robots if baseline else None),
        "[95 % bootstrap intervals over runs]",
        f"score E: by the paper's ruler, on which 1 is the paper's baseline in the "
        f"paper's building: k = {ruler.k:.3g}, beta = {ruler.beta:,.4g}",
        baseline.about() if baseline else NO_BASELINE,
    ]
    print_report(arguments, report, "\n".join(text))
    if arguments.out:  # last: whatever cannot be written, the table has been told
        write_json(arguments.out / "cells.json", report)
        _draw(arguments.out, arena, baseline, cells, played)


def _draw(
    folder: Path,
    arena: Arena,
    baseline: Baseline | None,
    cells: list[Cell],
    played: list[RunResult],
) -> None:
    """Draw pictures beside the runs; E on the baseline's ruler, if there is one."""
    from reference.workshop.drawing import crossplay, save
    from reference.workshop.drawing.ruler import contours, curve

    save(crossplay.matrix(cells), folder / "matrix.png")
    save(crossplay.evacuation_curves(played), folder / "evacuations.png")
    ruler = paper_ruler()
    one = "the paper's baseline"
    if baseline:
        ruler = baseline.ruler
        one = f"{baseline.robots} here"
        cells = [replace(cell, score=cell.score_on_baseline) for cell in cells]
    best = best_reward(arena.drawn, arena.people)
    save(curve(ruler, best), folder / "ruler.png")
    save(contours(ruler, cells, one), folder / "scores.png")
    print_note(f"tables and pictures are in {folder}")
