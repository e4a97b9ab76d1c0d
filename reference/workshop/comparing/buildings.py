"""Compare buildings: the same robots and fires, as many people, the same seeds.

It answers what one draws maps for: what does another door change?  Each building has an
evaluation of its own, kept in a folder of its own.

What pairing means.  In one building, runs of a seed have the same people in the same
places.  Between two drawings a seed shares less.  As many people start from the same
random numbers, but these choose among other cells, so that whoever starts somewhere in
one may start elsewhere in the other; and a fire goes by what it finds.  Nobody is "the
same person in both": a difference is one of means over people and fires.  Its interval
comes from the differences seed by seed.  Seeds are independent, so it holds however
much or little runs of a seed resemble each other.  Where they do, as after a small
edit, it is narrower than that of two separate samples; else it is as wide.  Of the
same drawing twice every difference is 0.

An interval is over people and fires in these very buildings; it says nothing of others.

Times are of those who got out.  A building that saves slow people, too, is the slower.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from pathlib import Path
from shutil import rmtree
from typing import Any

from reference.paper import InputError
from reference.workshop.comparing import matches, runs
from reference.workshop.comparing.intervals import (
    Interval,
    format_interval,
    interval_of_mean,
)
from reference.workshop.comparing.matches import Evaluation
from reference.workshop.comparing.results import align_columns
from reference.workshop.comparing.runs import RunResult
from reference.workshop.storage.files import (
    errors_naming,
    make_folder,
    read_json,
    write_json,
)
from reference.workshop.storage.records import checked_value

BUILDINGS_FILE = "buildings.json"  # in the folder of an evaluation of several

Evaluations = Mapping[str, Evaluation]
"""Of each building, by its name in tables."""

Played = Mapping[str, Sequence[RunResult]]
"""All runs in each building, by its name in tables."""


def begin_in_buildings(
    buildings: Sequence[str], robots: Sequence[str], fires: Sequence[str], **asked: Any
) -> dict[str, Evaluation]:
    """Begin an evaluation in each building; asked: as of `begin_evaluation`.

    buildings: none where checkpoints, or the default, say which
    Raises as `begin_evaluation` does, and InputError for different numbers of people,
    and for nobody.
    """
    where: Sequence[str | None] = buildings or [None]
    begun = [matches.begin_evaluation(robots, fires, each, **asked) for each in where]
    named = _by_name(begun)
    counts = {name: evaluation.arena.people for name, evaluation in named.items()}
    if len({*counts.values()}) > 1:
        words = ", ".join(f"{count} in {name}" for name, count in counts.items())
        raise InputError(
            f"{words}: buildings are compared with as many people in each. Ask for "
            "--people N."
        )
    if not any(counts.values()):
        raise InputError("there is nobody to evacuate: raise people")
    return named


def resume_in_buildings(
    folder: Path, robots: Sequence[str], fires: Sequence[str]
) -> dict[str, Evaluation]:
    """Resume what is in a folder, in all its buildings, with any further players.

    Raises as `resume_evaluation` does, and InputError where the buildings are others
    than those that were begun together, or were not begun alike.
    """
    path = folder / BUILDINGS_FILE
    if not path.exists():
        return _by_name([matches.resume_evaluation(folder, robots, fires)])
    kept = read_json(path).get("buildings")
    with errors_naming(path):
        buildings = checked_value("buildings", kept, tuple[str, ...])
    folders = [_folder_of(folder, k) for k in range(len(buildings))]
    begun = [matches.resume_evaluation(each) for each in folders]
    together = tuple(each.arena.building for each in begun) == buildings
    if not together or len({*map(_terms, begun)}) != 1:
        raise InputError(
            f"{path}: the folders beside it are not of one evaluation. Begin anew in "
            "another folder."
        )
    # of each alone, too
    robots = [*(word for each in begun for word in each.robots), *robots]
    fires = [*(word for each in begun for word in each.fires), *fires]
    with errors_naming(path):
        files = _files_of_all(begun)
    return _by_name(
        matches.resume_evaluation(each, robots, fires, files) for each in folders
    )


def _files_of_all(evaluations: Iterable[Evaluation]) -> dict[str, str]:
    """Collect the checkpoints that words mean. Raises InputError for two of one."""
    files: dict[str, str] = {}
    for evaluation in evaluations:
        for word, file in evaluation.files.items():
            other = files.setdefault(word, file)
            if other != file:
                raise InputError(
                    f"{word} is {other} in one of the folders beside it and {file} in "
                    "another. Begin anew in another folder."
                )
    return files


def _terms(evaluation: Evaluation) -> tuple[Any, ...]:
    """What evaluations must share, so that runs of a seed may be compared."""
    own = evaluation
    return own.seed, own.episodes, own.sample, own.errors, own.arena.scenario


def _by_name(evaluations: Iterable[Evaluation]) -> dict[str, Evaluation]:
    """Name evaluations after their buildings; the second of a name is "name (2)"."""
    named = dict[str, Evaluation]()
    for evaluation in evaluations:
        word = evaluation.arena.building
        name = word
        count = 1
        while name in named:
            count += 1
            name = f"{word} ({count})"
        named[name] = evaluation
    return named


def folders_of(evaluations: Evaluations, folder: Path | None) -> dict[str, Path | None]:
    """The folder of each building's runs: the only one's is the folder itself."""
    if folder is None or len(evaluations) == 1:
        return dict.fromkeys(evaluations, folder)
    return {name: _folder_of(folder, k) for k, name in enumerate(evaluations)}


def _folder_of(folder: Path, k: int) -> Path:
    return folder / f"building-{k + 1}"


def play_in_buildings(
    evaluations: Evaluations, folder: Path | None, executor: Executor
) -> dict[str, list[RunResult]]:
    """Play all runs in all buildings, as `play_evaluation` does, and raises."""
    folders = folders_of(evaluations, folder)
    if folder and len(evaluations) > 1:
        _write_beginning(evaluations, folder)
    return {
        name: runs.play_evaluation(evaluation, folders[name], executor)
        for name, evaluation in evaluations.items()
    }


def _write_beginning(evaluations: Evaluations, folder: Path) -> None:
    """Write what a resume needs, before the first run of the first building.

    Nothing stays of what is stopped on the way: nobody could go on with a part.
    """
    made = list[Path]()
    try:
        make_folder(folder)
        for name, path in folders_of(evaluations, folder).items():
            if path and not (path / matches.EVALUATION_FILE).exists():
                made.append(path)
                make_folder(path)
                matches.write_evaluation(evaluations[name], path)
        names = [evaluation.arena.building for evaluation in evaluations.values()]
        write_json(folder / BUILDINGS_FILE, {"buildings": names})
    except BaseException:
        for path in made:
            rmtree(path, ignore_errors=True)
        raise


# -- What it comes to ---------------------------------------------------------------


@dataclass(frozen=True, kw_only=True)
class BuildingCell:
    """One match in one building: n runs, and each figure's mean, low and high.

    less      the building that is subtracted: then every figure is a difference
    half_out  s, when half of a run's survivors were out;  evacuation_time  s, when the
              last was; None if nobody got out in any of the runs
    died      people a run who died on each floor, the lowest first; of a difference on
              the floors that both have
    """

    robots: str
    fire: str
    building: str
    less: str | None = None
    n: int
    survival: Interval
    half_out: Interval | None
    evacuation_time: Interval | None
    died: tuple[Interval, ...]


Figure = Callable[[RunResult], float | None]


def compare_buildings(evaluations: Evaluations, played: Played) -> list[BuildingCell]:
    """Average every match in every building, and its differences from the first.

    They stand match by match; below each further building stands its difference.
    """
    floors = {name: each.arena.drawn.floors for name, each in evaluations.items()}
    first, *others = evaluations
    figures = []
    for match in dict.fromkeys(run.match for run in played[first]):
        of_match = runs_of(played, match)
        figures.append(_figures(of_match, floors, first))
        for name in others:
            figures.append(_figures(of_match, floors, name))
            figures.append(_figures(of_match, floors, name, first))
    return figures


def runs_of(played: Played, match: tuple[str, str]) -> Played:
    """Take the runs of one match, by building."""
    return {
        name: [run for run in results if run.match == match]
        for name, results in played.items()
    }


def _figures(
    of_match: Played, floors: Mapping[str, int], name: str, less: str | None = None
) -> BuildingCell:
    """Average a match in a building, or the differences from another one's."""
    results = of_match[name]
    others = {run.seed: run for run in of_match[less]} if less else {}
    common = min(floors[each] for each in (name, less) if each)

    def values(figure: Figure) -> list[float]:
        """List a figure of all runs, or its difference, where it is known."""
        known = list[float]()
        for run in results:
            value = figure(run)
            subtracted = figure(others[run.seed]) if less else 0.0
            if value is not None and subtracted is not None:
                known.append(value - subtracted)
        return known

    def died_on(floor: int) -> Figure:
        """Make the figure that counts deaths on a floor."""
        return lambda run: sum(death.floor == floor for death in run.deaths)

    half_out = values(lambda run: run.half_out)
    all_out = values(lambda run: run.evacuation_time)
    robots, fire, _ = results[0].run
    return BuildingCell(
        robots=robots,
        fire=fire,
        building=name,
        less=less,
        n=len(results),
        survival=interval_of_mean(values(lambda run: run.survival)),
        half_out=interval_of_mean(half_out) if half_out else None,
        evacuation_time=interval_of_mean(all_out) if all_out else None,
        died=tuple(interval_of_mean(values(died_on(k))) for k in range(common)),
    )


def table_of_buildings(figures: Sequence[BuildingCell]) -> str:
    """Write a line for each building and difference: means with 95 % intervals.

    Deaths are means alone; a run alone has no intervals.
    """
    floors = max(len(each.died) for each in figures)
    heads = ["robots", "fire", "building", "runs"]
    heads += ["survivors, %", "half out, s", "last out, s", "died on floor 1"]
    heads += [f"{floor + 1}" for floor in range(1, floors)]
    rows = [heads, *(_row(each, floors) for each in figures)]
    missing = any(not each.half_out for each in figures)
    note = (
        "\n-: nobody got out in any run; of a difference, in no seed of both"
        if missing
        else ""
    )
    return align_columns(rows, "<<<>" + ">" * (3 + floors)) + note


def _row(figures: BuildingCell, floors: int) -> list[str]:
    """Write a line's words."""
    signed = bool(figures.less)
    ends = figures.n > 1
    died = [format_interval(each, 1, signed) for each in figures.died]
    died += [""] * (floors - len(died))
    return [
        figures.robots,
        figures.fire,
        f"  difference from {figures.less}" if figures.less else figures.building,
        f"{figures.n:,}",
        format_interval(in_percent(figures.survival), 1, signed, ends),
        format_interval(figures.half_out, 0, signed, ends),
        format_interval(figures.evacuation_time, 0, signed, ends),
        *died,
    ]


def in_percent(share: Interval) -> Interval:
    """Convert a share and its ends to per cent."""
    return Interval(*(100 * value for value in share))
