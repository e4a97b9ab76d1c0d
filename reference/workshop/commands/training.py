"""Commands for learning: train and curves."""

from argparse import Namespace
from collections.abc import Iterable
from functools import partial
from pathlib import Path
from typing import Any

from reference.learning.settings import SIDES, Side
from reference.workshop.anchors.settings import SideSettings
from reference.workshop.commands import options
from reference.workshop.commands.common import (
    format_figure,
    format_table,
    print_note,
    print_report,
    run_in_folder,
    shell_line,
)
from reference.workshop.comparing.named import PLAYER_NAMES, WORST
from reference.workshop.storage.files import refuse_unwritable
from reference.workshop.storage.records import allowed_values
from reference.workshop.storage.runs import ContradictionError, refuse_options
from reference.workshop.storage.scenarios import list_keys
from reference.workshop.storage.workers import import_early
from reference.workshop.strategies import GUIDES
from reference.workshop.strategies.own import CODE
from reference.workshop.training.presets import PRESETS, preset
from reference.workshop.training.summaries import SUMMARIES

FIXED_HELP = "if given, this side does not learn; several play in turn"
ROBOT_NAMES, FIRE_NAMES = (
    [name for name in PLAYER_NAMES[side] if name not in (WORST, CODE)] for side in SIDES
)
"""Who can play the side that does not learn."""
SETTING_ROWS = allowed_values(SideSettings)
JOBS_NEED = ("reference.workshop.training.loop", "reference.workshop.engine.going")
"""What is slow to load in a worker: torch and numba."""
LEARN_ON = "to learn on, take --initialize-from {out} into another folder"
TINY = "preset tiny ends before anything is learned; to learn, take --preset laptop"
NO_LEVELS = "No lines of none and escort to compare with"


@options.command(
    "train --preset tiny --fire random --out out/tiny\n"
    "  python -m reference train --resume --out out/tiny\n"
    "  python -m reference evacuate --robots out/tiny --fire greedy",
    options.option(
        "--preset",
        "tiny: seconds, in a small building; laptop: minutes; any: robots for any "
        "building, hours; paper: Tables I and II, hours; default: laptop",
        choices=tuple(PRESETS),
    ),
    options.option(
        "--settings",
        "YAML that changes the preset: ML-Agents' keys, and more, as in reference: "
        "{scenario: {people: 12}}",
        type=Path,
        metavar="FILE",
    ),
    options.option(
        "--building",
        "where, or in several maps; random: in a new generated building in every job, "
        "with people and robots by lot; random:N: in N of them; default: tiny for "
        "preset tiny, random for preset any, else paper",
        nargs="+",
        metavar="MAP",
    ),
    options.scenario("the preset's or --settings'"),
    options.option(
        "--trainer",
        "of the robots; default: the preset's",
        choices=SETTING_ROWS["trainer_type"].choices,
    ),
    options.option(
        "--head",
        "of both sides' policies. floor: one Gaussian of the whole floor, as in the "
        "paper; mixture: Gaussians around anchors; set: the same, and one network "
        "scores each of them, in any building; default: the preset's",
        choices=SETTING_ROWS["head"].choices,
    ),
    options.player("robots", FIXED_HELP, ROBOT_NAMES, nargs="+"),
    options.player("fire", FIXED_HELP, FIRE_NAMES, nargs="+"),
    options.option(
        "--imitate",
        "robots imitate this first (behavioural cloning), from random weights",
        choices=GUIDES,
    ),
    options.option(
        "--initialize-from", "learn on from a checkpoint or 'learned'", metavar="FILE"
    ),
    options.WORKERS,
    options.folder("--out", "default: out/train", default=Path("out/train")),
    options.flag("--resume", "go on with the training in DIR, as it was begun"),
    options.SEED,
    options.json("all figures of the table", "checkpoint", "summaries"),
    end=list_keys(),
)
def train(arguments: Namespace) -> None:
    """Trains robots and fire against each other, into a folder one can go on from."""
    if arguments.robots and arguments.fire:
        raise ContradictionError("--robots, --fire: nobody learns. Leave one out.")
    if arguments.robots and arguments.imitate:
        raise ContradictionError("--robots, --imitate: nobody imitates. Leave one out.")

    out = arguments.out
    begin = partial(_begin_or_resume, arguments)
    # Start early as many workers as the preset has jobs in a round; others start with
    # their first job.
    most = preset(arguments.preset or "laptop").jobs_per_round
    load = partial(import_early, modules=JOBS_NEED, most=most)
    with run_in_folder(arguments, out, begin, "train", meanwhile=load) as work:
        from reference.workshop.training import loop  # loads torch

        training, executor = work
        print_note(training.about())
        if training.finished:
            print_note(LEARN_ON.format(out=out))
        path = loop.run_training(training, out, executor)
    report = {
        "building": training.task.building,
        **training.facts(),
        "checkpoint": str(path),
        "summaries": str(out / SUMMARIES),
    }
    rows = [
        (name.replace("_", " "), value)
        for name, value in report.items()
        if isinstance(value, int | float)
    ]
    print_report(arguments, report, format_table(rows, "<>"))
    if report["inside"] is not None:
        print_note(_what_became(report, training.settings.scenario.time_limit))
    if report["preset"] == "tiny":
        print_note(TINY)
    _say_how_to_see_it(out, path, training.learners)


def _say_how_to_see_it(out: Path, checkpoint: Path, sides: Iterable[Side]) -> None:
    """Print the commands that show how it was learned, and what."""
    players = list[object]()
    for side in sides:
        players += [f"--{side}", checkpoint]
    print_note(f"to see how it was learned, and what:\n  {shell_line('curves', out)}")
    print_note(f"  {shell_line('evacuate', *players, '--animate', 'learned.html')}")


def _what_became(report: dict[str, Any], limit: float) -> str:
    """Say what became of everybody in the last round, on average."""
    ends = {
        "got out": report["evacuated"],
        "died": report["died"],
        f"were inside when {limit:g} s were over": report["inside"],
    }
    people = sum(ends.values())
    told = ", ".join(f"{format_figure(count)} {end}" for end, count in ends.items())
    return f"of {people:g} people in the last round, on average: {told}"


def _begin_or_resume(arguments: Namespace) -> Any:
    """Begin a training, or resume the one in the folder."""
    from reference.workshop.training import starting  # loads torch

    if not arguments.resume:
        return starting.begin_training(arguments)
    training = starting.resume_training(arguments.out)
    asked = {name: getattr(arguments, name) for name in starting.OPTIONS}
    instead = f"take --initialize-from {arguments.out} into another folder"
    for name in starting.repeated_options(training.task, arguments):
        del asked[name]
    begun = starting.options_of(training.task, arguments.scenario or {})
    refuse_options(asked, begun, instead)
    return training


@options.command(
    "curves out/tiny -o curves.png",
    options.folder("runs", "folders of trainings", nargs="+"),
    options.output("-o --output", options.PICTURES, "the picture", Path("curves.png")),
    end="  after: python -m reference train --preset tiny --out out/tiny\n\n"
    "level lines: what nobody and escort reach in the trainings' own task\n"
    "signal / noise: below 1 an update is mostly luck, at 0 or below it sees nothing\n"
    "variance explained: 1 is a perfect critic, 0 one as good as a constant\n"
    "baseline: MA-POCA's, what is expected while one agent's action is not known",
)
def curves(arguments: Namespace) -> None:
    """Draws the learning curves of one training, or compares several."""
    from reference.workshop.drawing import curves, save  # loads matplotlib

    refuse_unwritable(arguments.output)
    folders = {str(run): run for run in arguments.runs}
    short = {run.resolve().name: run for run in folders.values()}
    if len(short) == len(folders):
        folders = short
    runs = [
        curves.read_summaries(run)._replace(name=name) for name, run in folders.items()
    ]
    tasks = _tasks(folders)
    about = _differences(tasks) if len(runs) > 1 else ""
    levels = _levels(list(tasks.values())) if len(tasks) == len(runs) else None
    print(save(curves.learning_curves(runs, about, levels), arguments.output))


def _tasks(folders: dict[str, Path]) -> dict[str, Any]:
    """Read what trainings are of; none where a checkpoint cannot be read."""
    from reference.workshop.training.checkpoints import CheckpointError
    from reference.workshop.training.differing import tasks_of

    try:
        tasks = tasks_of(folders)
    except CheckpointError as error:
        print_note(f"Only tables are drawn, without what trainings are of: {error}")
        return {}
    lost = [name for name in folders if name not in tasks]
    if lost:
        print_note(f"{NO_LEVELS}: there is no checkpoint of {', '.join(lost)}.")
    return tasks


def _levels(tasks: list[Any]) -> Any:
    """Measure nobody and a guide in the task of trainings; None, with why, if not."""
    from reference.workshop.training.levels import levels_of, why_no_levels

    why = why_no_levels(tasks)
    if why:
        print_note(f"{NO_LEVELS}: {why}.")
        return None
    return levels_of(tasks[0])


def _differences(tasks: dict[str, Any]) -> str:
    """Say what differs between trainings, on stderr too, above all their buildings."""
    from reference.workshop.training.differing import differences

    about = differences(tasks)
    if about:
        print_note(f"What differs ({', '.join(tasks)}): {about}")
    if len({(task.plan, task.family) for task in tasks.values()}) > 1:
        print_note("Their buildings differ: rewards and survivors do not compare.")
    return about
