"""Learning, and how it went: train and curves.

Clauses: E1, E2.
"""

import json
import os
import sys
from argparse import ArgumentParser, Namespace
from concurrent.futures import BrokenExecutor
from pathlib import Path
from time import perf_counter
from typing import Any

from reference.learning.settings import SIDES, TrainerSettings, rows_of
from reference.workshop.commands.common import (
    MAP,
    Command,
    CommandError,
    cores,
    counted,
    ctrl_c,
    figures,
    for_people,
    player_option,
    quoted,
    whole_from,
    writable,
)
from reference.workshop.evaluation.contestants import SCRIPTS
from reference.workshop.training.presets import PRESETS, Settings
from reference.workshop.workers import workers

ROWS = rows_of(TrainerSettings) | rows_of(Settings)


def train(arguments: Namespace) -> None:
    """Trains robots and fire against each other, into a folder one can go on from."""
    os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")  # before torch is loaded
    training = _training(arguments)
    start, begun = perf_counter(), training.decisions
    path = _trained(training, arguments)
    seconds = perf_counter() - start
    facts = {
        "building": training.task.building,
        **training.facts(),
        "wall_seconds": seconds,
        "decisions_per_second": (training.decisions - begun) / seconds,
        "checkpoint": str(path),
        "summaries": str(arguments.out / "summaries.csv"),
    }
    _tell_training(training, facts, arguments.json)


def _trained(training: Any, arguments: Namespace) -> Path:
    """Train to the end; the last checkpoint. Before the end, how to go on from it."""
    from reference.workshop.training.loop import train

    count = cores() if arguments.workers is None else arguments.workers
    print(f"{training.about()}; {counted(count, 'workers')}", file=sys.stderr)
    with ctrl_c() as stop, workers(count) as executor, for_people():
        try:
            path = train(training, arguments.out, executor, stop, arguments.tensorboard)
        except BrokenExecutor as error:
            raise CommandError(
                "a worker has died, perhaps for want of memory. Go on with fewer: "
                + _go_on(arguments, max(1, count // 2))
            ) from error
    if training.over:
        return path
    raise CommandError(
        f"stopped after round {training.round}, and saved in {path}. Go on with:\n"
        f"  {_go_on(arguments, arguments.workers)}",
        130,
    )


def _training(arguments: Namespace) -> Any:
    """A new training, or the one in the folder."""
    from reference.workshop.training import starting
    from reference.workshop.training.session import Training

    names = starting.Asked.__dataclass_fields__
    asked = starting.Asked(**{name: getattr(arguments, name) for name in names})
    if asked.robots and asked.fire:
        raise CommandError("nobody learns: name --robots or --fire, not both.", 2)
    with for_people():
        if arguments.resume:
            return Training.resumed(starting.resume(asked, arguments.out))
        return Training(starting.begin(asked, arguments.out))


def _tell_training(training: Any, facts: dict[str, Any], as_json: bool) -> None:
    """What came of it, and how to look at it."""
    if as_json:
        print(json.dumps(facts))
    else:
        print(training.about())
        for name, value in facts.items():
            if isinstance(value, int | float):
                print(f"{name.replace('_', ' '):22}{figures([value])}")
    learned = " ".join(
        f"--{s} {quoted(facts['checkpoint'])}" for s in training.learners
    )
    folder = quoted(Path(facts["summaries"]).parent)
    print(
        "to see how it was learned, and what:\n"
        f"  python -m reference curves {folder}\n"
        f"  python -m reference evacuate {learned} --animate learned.gif",
        file=sys.stderr,
    )


def _go_on(arguments: Namespace, count: int | None) -> str:
    """The command that goes on with a training."""
    words = ["python -m reference train --resume --out", quoted(arguments.out)]
    if count is not None:
        words.append(f"--workers {count}")
    if arguments.tensorboard:
        words.append("--tensorboard")
    return " ".join(words)


def curves(arguments: Namespace) -> None:
    """Draws the learning curves of one training, or of several that belong together."""
    from reference.workshop.drawing import page
    from reference.workshop.drawing.curves import figure
    from reference.workshop.drawing.runs import read

    path = arguments.output or Path("curves.png")
    writable(path, page.PICTURES, "a picture")
    with for_people():
        print(page.save(figure([read(run) for run in arguments.runs]), path))


def _train_options(parser: ArgumentParser) -> None:
    add = parser.add_argument
    add("--preset", choices=tuple(PRESETS), help="default: laptop")
    add(
        "--settings",
        type=Path,
        metavar="FILE",
        help="ML-Agents' YAML; it changes the preset (extra: yaml)",
    )
    add("--building", help=f"{MAP}; default: paper, or tiny with --preset tiny")
    add("--trainer", choices=ROWS["trainer_type"].choices, help="of the robots")
    add(
        "--head",
        choices=ROWS["head"].choices,
        help="of both policies; default: preset's",
    )
    for side in SIDES:
        note = f"if given, the {side} {'do' if side == 'robots' else 'does'} not learn"
        player_option(parser, side, note, words=(*SCRIPTS[side], "FILE"))
    add(
        "--schedule",
        choices=ROWS["schedule"].choices,
        help="both sides learn together, or in turn; default: preset's",
    )
    add(
        "--imitate",
        choices=SCRIPTS["robots"][1:],
        help="robots copy this strategy first; never the default",
    )
    add(
        "--workers",
        type=whole_from(0),
        metavar="K",
        help="processes that play, results are the same; 0: none but this one; "
        "default: the number of cores",
    )
    out = Path("out/train")
    add("--out", type=Path, default=out, metavar="DIR", help=f"default: {out}")
    add("--resume", action="store_true", help="go on with the training in DIR")
    add(
        "--tensorboard",
        action="store_true",
        help="write DIR/tensorboard too (extra: tensorboard)",
    )


def _curves_options(parser: ArgumentParser) -> None:
    add = parser.add_argument
    add("runs", nargs="+", type=Path, metavar="RUN", help="the folder train wrote to")
    add(
        "-o",
        "--output",
        type=Path,
        metavar="FILE",
        help=".png, .svg or .pdf; default: curves.png in this folder",
    )


TRAIN = Command(
    train,
    _train_options,
    "train --preset tiny --fire random --out out/tiny\n"
    "  python -m reference train --resume --out out/tiny\n"
    "  python -m reference evacuate --robots out/tiny --fire greedy",
)
CURVES = Command(
    curves, _curves_options, "curves out/tiny -o curves.png", numbers=False
)
