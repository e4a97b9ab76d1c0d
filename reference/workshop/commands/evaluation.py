"""The command evaluate: all robots against all fires, in one building or several."""

from argparse import Namespace
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

from reference.evaluation.bounds import best_reward, critical_points
from reference.evaluation.score import RulerError, paper_ruler
from reference.workshop.commands import options
from reference.workshop.commands.common import (
    one_terminal,
    print_note,
    print_report,
    run_in_folder,
)
from reference.workshop.comparing import buildings, matches, results
from reference.workshop.comparing.buildings import Evaluations, Played
from reference.workshop.comparing.matches import Evaluation
from reference.workshop.comparing.results import Baseline, Cell
from reference.workshop.comparing.runs import RunResult
from reference.workshop.storage.files import write_json
from reference.workshop.storage.runs import ContradictionError, refuse_options
from reference.workshop.storage.scenarios import kept_fields, list_keys
from reference.workshop.storage.words import did_you_mean

CROSSED = "each plays against all of --{}; default: {}"
Met = TypeVar("Met", Cell, RunResult)

NO_BASELINE = (
    "no E on a baseline of this building: name a scripted guide among --robots, such "
    "as escort, or take --baseline"
)
OVER_RUNS = "[95 % bootstrap intervals over runs]"
COLUMNS_NOTE = "last out, health: of those who got out"
GAIN_NOTE = "over baseline: percentage points, on the same seeds"
ONE_RUN = "one run of each match; several have intervals: --episodes"


@options.command(
    "evaluate --robots none patrol sweep --fire none random greedy \\\n"
    "      --baseline sweep --episodes 10 --out out/evaluation",
    options.player("robots", CROSSED.format("fire", "sweep"), nargs="+"),
    options.player("fire", CROSSED.format("robots", "random"), nargs="+"),
    options.BUILDINGS,
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
        "robots to compare with; they also define the second E, on which they score 1 "
        "on average over the fires; default: the best scripted guide of --robots, "
        "for E alone",
        metavar="S",
    ),
    options.SEED,
    options.json("what was asked for", "ruler", "baseline", "cells (the table)"),
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
        evaluations, executor = work
        robots = next(iter(evaluations.values())).robots
        if baseline and baseline not in robots:
            wanted = f"--baseline {baseline}: add it to --robots."
            raise ContradictionError(wanted + did_you_mean(baseline, robots))
        heading = _what_is_played(evaluations)
        print_note(heading)
        above = "" if one_terminal() else f"{heading}\n"  # there it stands already
        played = buildings.play_in_buildings(evaluations, out, executor)
        if len(evaluations) > 1:
            _keep_and_print_all(arguments, evaluations, played, above)
        else:
            (evaluation,) = evaluations.values()
            (found,) = played.values()
            summary = _sum_up(arguments, evaluation, found)
            try:
                if out:
                    _keep(out, summary)
                    print_note(f"tables and pictures are in {out}")
            finally:  # whatever cannot be written, the table is told
                print_report(arguments, summary.report, above + summary.text())


def _what_is_played(evaluations: Evaluations) -> str:
    """Say what is played in each building, and what is unexpected there, once."""
    lines = list[str]()
    for name, evaluation in evaluations.items():
        head = f"{name}: " if len(evaluations) > 1 else ""
        lines += [head + evaluation.about(), *matches.notes(evaluation)]
    return "\n".join(dict.fromkeys(lines))


def _begin_or_resume(arguments: Namespace) -> dict[str, Evaluation]:
    """Begin an evaluation in each building, or resume with further robots and fires."""
    asked = options.evaluation_options(arguments)
    robots = arguments.robots or ()
    fires = arguments.fire or ()
    if not arguments.resume:
        where = asked.pop("building", [])
        return buildings.begin_in_buildings(
            where, robots or ["sweep"], fires or ["random"], **asked
        )
    begun = buildings.resume_in_buildings(arguments.out, robots, fires)
    where = [evaluation.arena.building for evaluation in begun.values()]
    stated = asked.get("scenario", {})
    for evaluation in begun.values():
        arena = {"building": where, "people": evaluation.arena.people}
        arena["scenario"] = kept_fields(evaluation.arena.scenario, stated)
        refuse_options(asked, vars(evaluation) | arena)
    return begun


@dataclass(frozen=True)
class SummedUp:
    """What the runs in one building come to.

    report  for programs;  no_baseline  why there is none, where there is none
    """

    evaluation: Evaluation
    played: Sequence[RunResult]
    baseline: Baseline | None
    cells: list[Cell]
    report: dict[str, Any]
    no_baseline: str

    def text(self) -> str:
        """Write it for people, as a table and what to know of it."""
        ruler = paper_ruler()
        baseline = self.baseline
        lines = [
            results.table(self.cells, baseline=baseline.robots if baseline else None),
            OVER_RUNS if self.evaluation.episodes > 1 else ONE_RUN,
            COLUMNS_NOTE,
            *([GAIN_NOTE] if any(cell.gain for cell in self.cells) else []),
            f"score E: by the paper's ruler, on which 1 is the paper's baseline in the "
            f"paper's building: k = {ruler.k:.3g}, beta = {ruler.beta:,.4g}",
            baseline.about() if baseline else self.no_baseline,
        ]
        return "\n".join(lines)


def _sum_up(
    arguments: Namespace, evaluation: Evaluation, played: Sequence[RunResult]
) -> SummedUp:
    """Sum up all runs in one building."""
    arena = evaluation.arena
    ruler = paper_ruler()
    baseline = None
    no_baseline = NO_BASELINE
    if arena.people:
        points = critical_points(arena.drawn, arena.scenario)
        try:
            baseline = results.baseline_of(played, arguments.baseline, *points)
        except RulerError as error:
            no_baseline = f"no E on a baseline of this building: {error}"
    cells = results.cells(
        played, ruler, arguments.baseline, baseline.ruler if baseline else None
    )
    report = results.evaluation_as_json(evaluation, ruler, cells, baseline)
    # as people are to read who played
    cells = _with_titles(cells, evaluation)
    played = _with_titles(played, evaluation)
    if baseline:
        baseline = replace(baseline, robots=evaluation.titles[baseline.robots])
    return SummedUp(evaluation, played, baseline, cells, report, no_baseline)


def _keep(folder: Path, summary: SummedUp) -> None:
    """Write table and pictures beside the runs in one building."""
    write_json(folder / "cells.json", summary.report)
    _draw(folder, summary.evaluation, summary.baseline, summary.cells, summary.played)


def _keep_and_print_all(
    arguments: Namespace, evaluations: Evaluations, played: Played, above: str
) -> None:
    """Keep and print what several buildings come to, and their differences.

    above: what stands above the table
    """
    summaries = {
        name: _sum_up(arguments, evaluation, played[name])
        for name, evaluation in evaluations.items()
    }
    figures = buildings.compare_buildings(evaluations, played)
    report = {
        "buildings": [summary.report for summary in summaries.values()],
        "comparison": [results.cell_as_json(each) for each in figures],
    }
    text = [
        buildings.table_of_buildings(figures),
        "[95 % bootstrap intervals over runs; of differences, over seeds]",
        "half out, last out: of those who got out; died on floor: people a run",
        "reward, h, E and gains over a baseline are of one building each: --json and "
        "--out tell them",
    ]
    out = arguments.out
    try:
        if out:
            for name, folder in buildings.folders_of(evaluations, out).items():
                if folder:
                    _keep(folder, summaries[name])
            _keep_comparison(out, evaluations, played, figures, report)
            print_note(
                f"tables and pictures are in {out}, those of a building below it"
            )
    finally:  # whatever cannot be written, the table is told
        print_report(arguments, report, above + "\n".join(text))


def _keep_comparison(
    folder: Path,
    evaluations: Evaluations,
    played: Played,
    figures: Any,
    report: dict[str, Any],
) -> None:
    """Write what several buildings come to, and draw them side by side."""
    from reference.workshop.drawing import save
    from reference.workshop.drawing.buildings import side_by_side

    write_json(folder / "comparison.json", report)
    drawn = {name: each.arena.drawn for name, each in evaluations.items()}
    save(side_by_side(drawn, played, figures), folder / "buildings.png")


def _with_titles(rows: Sequence[Met], evaluation: Evaluation) -> list[Met]:
    """Rows of robots and fires by their titles: which `learned` it was."""
    titles = evaluation.titles
    return [
        replace(row, robots=titles[row.robots], fire=titles[row.fire]) for row in rows
    ]


def _caption(evaluation: Evaluation) -> str:
    """Say where and over what means are, below a picture."""
    from reference.workshop.drawing.crossplay import MEANS_OVER, ONE_RUN

    count = evaluation.episodes
    over = MEANS_OVER.replace("the runs", f"{count:,} runs") if count > 1 else ONE_RUN
    return f"{evaluation.where()}: {over}"


def _draw(
    folder: Path,
    evaluation: Evaluation,
    baseline: Baseline | None,
    cells: list[Cell],
    played: Sequence[RunResult],
) -> None:
    """Draw pictures beside the runs; E on the baseline's ruler, if there is one."""
    from reference.workshop.drawing import crossplay, save
    from reference.workshop.drawing.ruler import contours, curve

    told = _caption(evaluation)
    save(crossplay.matrix(cells, told), folder / "matrix.png")
    save(crossplay.evacuation_curves(played, told), folder / "evacuations.png")
    ruler = paper_ruler()
    one = "the paper's baseline"
    if baseline:
        ruler = baseline.ruler
        one = f"{baseline.robots} here"
        cells = [replace(cell, score=cell.score_on_baseline) for cell in cells]
    best = best_reward(evaluation.arena.drawn, evaluation.arena.people)
    try:
        save(curve(ruler, best), folder / "ruler.png")
    except RulerError as error:
        print_note(f"no ruler.png: {error}")
    save(contours(ruler, cells, one, told), folder / "scores.png")
