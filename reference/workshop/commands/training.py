"""Commands for learning: train and curves."""

from argparse import Namespace
from functools import partial
from pathlib import Path
from typing import Any

from reference.learning.settings import SIDES
from reference.workshop.commands import options
from reference.workshop.commands.common import again, note, resumable, table, tell
from reference.workshop.comparing.named import NAMES, WORST
from reference.workshop.remedies.settings import SideSettings
from reference.workshop.storage.records import rows_of
from reference.workshop.storage.runs import ContradictionError, refuse_options
from reference.workshop.strategies import GUIDES
from reference.workshop.strategies.own import CODE
from reference.workshop.training.presets import PRESETS
from reference.workshop.training.summaries import SUMMARIES

FIXED = "if given, this side does not learn; several play in turn"
ROBOTS, FIRES = (
    [name for name in NAMES[side] if name not in (WORST, CODE)] for side in SIDES
)
"""Who can play the side that does not learn."""
ROWS = rows_of(SideSettings)
TINY = "preset tiny ends before anything is learned; to learn, take --preset laptop"


@options.command(
    "train --preset tiny --fire random --out out/tiny\n"
    "  python -m reference train --resume --out out/tiny\n"
    "  python -m reference evacuate --robots out/tiny --fire greedy",
    options.option(
        "--preset",
        "tiny: seconds, in a small building; laptop: under an hour; paper: Tables I "
        "and II, work for a cluster; default: laptop",
        choices=tuple(PRESETS),
    ),
    options.option(
        "--settings",
        "YAML that changes the preset: ML-Agents' keys, and more, as in reference: "
        "{scenario: {people: 12}}",
        type=Path,
        metavar="FILE",
    ),
    options.building("tiny for preset tiny, else paper"),
    options.option(
        "--trainer",
        "of the robots; default: the preset's",
        choices=ROWS["trainer_type"].choices,
    ),
    options.option(
        "--head",
        "of the robots' policy. floor: one Gaussian of the whole floor, as in the "
        "paper; mixture: Gaussians around anchors; default: the preset's",
        choices=ROWS["head"].choices,
    ),
    options.player("robots", FIXED, ROBOTS, nargs="+"),
    options.player("fire", FIXED, FIRES, nargs="+"),
    options.option(
        "--imitate", "robots imitate this first (behavioural cloning)", choices=GUIDES
    ),
    options.option(
        "--initialize-from", "learn on from a checkpoint or 'learned'", metavar="FILE"
    ),
    options.WORKERS,
    options.folder("--out", "default: out/train", default=Path("out/train")),
    options.flag("--resume", "go on with the training in DIR, as it was begun"),
    options.SEED,
    options.JSON,
)
def train(arguments: Namespace) -> None:
    """Trains robots and fire against each other, into a folder one can go on from."""
    out = arguments.out
    with resumable(arguments, out, partial(_training, arguments), "train") as work:
        from reference.workshop.training import loop  # loads torch

        training, executor = work
        note(training.about())
        path = loop.train(training, out, executor)
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
    tell(arguments, report, table(rows, "<>"))

    if report["preset"] == "tiny":
        note(TINY)
    players = list[object]()
    for side in training.learners:
        players += [f"--{side}", path]
    note(f"to see how it was learned, and what:\n  {again('curves', out)}")
    note(f"  {again('evacuate', *players, '--animate', 'learned.html')}")


def _training(arguments: Namespace) -> Any:
    """Begin a training, or resume the one in the folder."""
    if arguments.robots and arguments.fire:
        raise ContradictionError("--robots, --fire: nobody learns. Leave one out.")
    if arguments.robots and arguments.imitate:
        raise ContradictionError("--robots, --imitate: nobody imitates. Leave one out.")
    from reference.workshop.training import starting  # with torch, after the refusals

    if not arguments.resume:
        return starting.begin(arguments)
    training = starting.resume(arguments.out)
    asked = {name: getattr(arguments, name) for name in starting.OPTIONS}
    instead = f"take --initialize-from {arguments.out} into another folder"
    refuse_options(asked, starting.options_of(training.task), instead)
    return training


@options.command(
    "curves out/tiny -o curves.png",
    options.folder("runs", "trainings", nargs="+"),
    options.output("-o --output", options.PICTURES, "the picture", Path("curves.png")),
    end="  after: python -m reference train --preset tiny --out out/tiny",
)
def curves(arguments: Namespace) -> None:
    """Draws the learning curves of one training, or of several that belong together."""
    from reference.workshop.drawing import curves, save  # loads matplotlib

    runs = [curves.read(run) for run in arguments.runs]
    print(save(curves.figure(runs), arguments.output))
