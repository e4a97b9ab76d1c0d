"""The command line: `python -m reference`, and under it check, draw, evacuate, ...

Numbers go to stdout, progress and notes to stderr. Exit status: 0 done, 1 the input or
the run is at fault, 2 the command line is, 130 after Ctrl-C.
"""

import os
import sys
from argparse import ArgumentParser
from argparse import RawDescriptionHelpFormatter as Formatter
from collections.abc import Sequence
from pathlib import Path

from reference.paper import PEOPLE
from reference.workshop.commands import (
    building,
    checks,
    evacuation,
    evaluation,
    options,
    speed,
    training,
)
from reference.workshop.runs import ContradictionError

COMMANDS = {
    "check": building.CHECK,
    "draw": building.DRAW,
    "evacuate": evacuation.EVACUATE,
    "evaluate": evaluation.EVALUATE,
    "agree": checks.AGREE,
    "gap": checks.GAP,
    "train": training.TRAIN,
    "curves": training.CURVES,
    "bench": speed.BENCH,
}


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line, by default this process's own; returns the exit status."""
    arguments = _parser().parse_args(argv)
    try:
        arguments.run(arguments)
        print(end="", flush=True)
    except KeyboardInterrupt as stopped:  # its text, if any, says what is kept
        return _complain(str(stopped) or "stopped; nothing half-written is left", 130)
    except ContradictionError as error:
        return _complain(str(error), 2)
    except BrokenPipeError:  # `| head -1`: whoever asked has read enough
        _drop_unprinted()
        return 1
    except (ValueError, OSError) as error:  # the input's, told for people
        _drop_unprinted()
        return _complain(str(error), 1)
    return 0


def _complain(message: str, status: int) -> int:
    print(message, file=sys.stderr)
    return status


def _drop_unprinted() -> None:
    """Drop what cannot be printed: Python would try again, with noise, at exit."""
    try:
        print(end="", flush=True)
    except OSError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


# -- The command line --------------------------------------------------------------


def _parser() -> ArgumentParser:
    top = ArgumentParser(
        prog="python -m reference",
        description="One evacuation of the paper's building, the best robots against "
        "the best fire;\na summary, and an animation in evacuation.gif.",
        epilog="example:\n  python -m reference --seed 7",
        formatter_class=Formatter,
    )
    options.add(top, options.SEED | options.JSON)
    top.set_defaults(
        seed=None,
        json=False,
        run=evacuation.evacuate,
        building="paper",
        robots="sweep",
        fire="greedy",
        people=PEOPLE,
        episodes=1,
        sample=False,
        animate=Path("evacuation.gif"),
    )
    commands = top.add_subparsers(title="commands", metavar="COMMAND")
    for name, command in COMMANDS.items():
        parser = commands.add_parser(
            name,
            help=command.run.__doc__,
            description=command.run.__doc__,
            epilog=f"example:\n  python -m reference {command.example}",
            formatter_class=Formatter,
        )
        options.add(parser, command.options | options.SEED)
        if command.numbers:
            options.add(parser, options.JSON)
        parser.set_defaults(run=command.run)
    return top


if __name__ == "__main__":
    sys.exit(main())
