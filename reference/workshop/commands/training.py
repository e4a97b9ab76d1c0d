"""Commands for learning: train and curves.

Clauses: E1, E2.
"""

import json
import sys
from argparse import Namespace
from functools import partial
from pathlib import Path
from time import perf_counter
from typing import Any

from reference.workshop.commands import options
from reference.workshop.commands.common import (
    Command,
    again,
    figures,
    quoted,
    workforce,
    writable,
)
from reference.workshop.plain import rows_of
from reference.workshop.remedies import SideSettings
from reference.workshop.runs import ContradictionError, held, refuse_options
from reference.workshop.strategies import GUIDES, LEARNED, SCRIPTS
from reference.workshop.training.presets import PRESETS
from reference.workshop.training.summaries import SUMMARIES

TINY = """\
note: preset tiny shows in seconds how a training runs; it ends before anything is
learned. To learn, take --preset laptop."""
ROWS = rows_of(SideSettings)


def train(arguments: Namespace) -> None:
    """Trains robots and fire against each other, into a folder one can go on from."""
    start = partial(_training, arguments)
    with held(arguments.out, arguments.resume, start) as training:
        begin, before = perf_counter(), training.left
        path = _trained(training, arguments)
    seconds = perf_counter() - begin
    facts = {
        "building": training.task.building,
        **training.facts(),
        "wall_seconds": seconds,
        "decisions_per_second": (before - training.left) / seconds,
        "checkpoint": str(path),
        "summaries": str(arguments.out / SUMMARIES),
    }
    _tell_training(training, facts, arguments.json)


def _trained(training: Any, arguments: Namespace) -> Path:
    """Train to the end; return the last checkpoint. If stopped, say how to resume."""
    from reference.workshop.training.loop import train

    resumed = (
        again("train", out=arguments.out) + " --tensorboard" * arguments.tensorboard
    )
    after = f"Go on with: {resumed}"
    with workforce(arguments.workers, training.about(), after) as work:
        path = train(training, arguments.out, *work, arguments.tensorboard)
    if training.over:
        return path
    raise KeyboardInterrupt(
        f"stopped after round {training.round}, and saved in {path}. Go on with:\n"
        f"  {resumed} --workers {arguments.workers}"
    )


def _training(arguments: Namespace) -> Any:
    """Begin a training, or resume the one in the folder."""
    if arguments.robots and arguments.fire:
        raise ContradictionError("nobody learns: name --robots or --fire, not both.")
    if arguments.robots and arguments.imitate:
        raise ContradictionError("nobody imitates: leave out --robots or --imitate.")
    from reference.workshop.training import session

    if arguments.resume:
        training = session.resume(arguments.out)
        asked = {name: getattr(arguments, name) for name in session.OPTIONS}
        refuse_options(asked, session.options_of(training.task))
        return training
    return session.begin(arguments)


def _tell_training(training: Any, facts: dict[str, Any], as_json: bool) -> None:
    """Print final figures, and commands to look at what was learned."""
    if as_json:
        print(json.dumps(facts))
    else:
        print(training.about())
        for name, value in facts.items():
            if isinstance(value, int | float):
                print(f"{name.replace('_', ' '):22}{figures([value])}")
        if facts["preset"] == "tiny":
            print(TINY, file=sys.stderr)
    fixed = training.task.fixed.items()
    players = {side: who for side, who in fixed if isinstance(who, str)}
    players |= dict.fromkeys(training.learners, facts["checkpoint"])
    learned = " ".join(f"--{side} {quoted(players[side])}" for side in sorted(players))
    folder = quoted(Path(facts["summaries"]).parent)
    print(
        "to see how it was learned, and what:\n"
        f"  python -m reference curves {folder}\n"
        f"  python -m reference evacuate {learned} --animate learned.html",
        file=sys.stderr,
    )


def curves(arguments: Namespace) -> None:
    """Draws the learning curves of one training, or of several that belong together."""
    from reference.workshop.drawing import curves, save

    path = arguments.output or Path("curves.png")
    writable(path)
    print(save(curves.figure([curves.read(run) for run in arguments.runs]), path))


NOTE = "if given, this side does not learn"
TRAIN_OPTIONS: options.Table = {
    "--preset": options.choice(
        PRESETS,
        "tiny: seconds, in a small building; laptop: under an hour; paper: Tables I "
        "and II, work for a cluster; default: laptop",
    ),
    "--settings": options.path(
        "FILE", "ML-Agents' YAML; changes the preset (needs PyYAML)"
    ),
    "--building": {
        "help": f"{options.MAP}; default: paper, or tiny with --preset tiny"
    },
    "--trainer": options.choice(
        ROWS["trainer_type"].choices, "of the robots; default: preset's"
    ),
    "--head": options.choice(
        ROWS["head"].choices,
        "of the robots' policy. floor: one Gaussian of the whole floor, as in the "
        "paper; frame: one around where the robot stands; mixture: Gaussians around "
        "anchors; default: preset's",
    ),
    **options.player("robots", NOTE, (*SCRIPTS["robots"], LEARNED, "FILE")),
    **options.player("fire", NOTE, (*SCRIPTS["fire"], LEARNED, "FILE")),
    "--imitate": options.choice(
        GUIDES, "robots imitate this strategy first (behavioural cloning)"
    ),
    "--initialize-from": {
        "metavar": "FILE",
        "help": f"sides that learn begin with the policy of a checkpoint, or of "
        f"'{LEARNED}'; robots that --imitate do not",
    },
    **options.WORKERS,
    "--out": options.path("DIR", "default: out/train", default=Path("out/train")),
    "--resume": options.flag("go on with the training in DIR, as it was begun"),
    "--tensorboard": options.flag("write DIR/tensorboard too (needs TensorBoard)"),
}
CURVES_OPTIONS: options.Table = {
    "runs": options.path("DIR", "a training's folder", **options.SEVERAL),
    **options.picture("curves.png in this folder"),
}

TRAIN = Command(
    train,
    TRAIN_OPTIONS,
    "train --preset tiny --fire random --out out/tiny\n"
    "  python -m reference train --resume --out out/tiny\n"
    "  python -m reference evacuate --robots out/tiny --fire greedy",
)
CURVES = Command(
    curves, CURVES_OPTIONS, "curves out/tiny -o curves.png", numbers=False, chance=False
)
