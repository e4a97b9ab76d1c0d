"""The command line: `python -m reference` and its commands check, draw, evacuate, ...

Numbers go to stdout, progress and notes to stderr. Exit status: 0 done, 1 wrong input
or a failed run, 2 a wrong command line, 130 after Ctrl-C, SIGTERM or SIGHUP.
"""

import os
import signal
import sys

if __name__ == "__main__":  # if stopped during the imports below: exit silently
    # (what this process was told to ignore, as by `nohup`, stays ignored)
    STOPS = [signal.SIGINT, signal.SIGTERM]
    STOPS += [signal.SIGHUP] if hasattr(signal, "SIGHUP") else []
    STOPS = [stop for stop in STOPS if signal.getsignal(stop) != signal.SIG_IGN]
    for stop in STOPS:
        signal.signal(stop, lambda *_: os._exit(130))
    if sys.stderr is None:  # closed, which some libraries do not expect
        sys.stderr = open(os.devnull, "w")  # noqa: SIM115

from argparse import ArgumentParser, Namespace
from argparse import RawDescriptionHelpFormatter as Formatter
from collections.abc import Sequence
from contextlib import suppress
from threading import Event
from typing import Any, NoReturn

import reference
from reference.paper import InputError
from reference.workshop.commands import (
    annotated,
    building,
    evacuation,
    evaluation,
    experiment,
    measures,
    options,
    training,
)
from reference.workshop.commands.common import Command
from reference.workshop.files import told
from reference.workshop.runs import ContradictionError

COMMANDS = {
    "check": building.CHECK,
    "draw": building.DRAW,
    "floors": building.FLOORS,
    "evacuate": evacuation.EVACUATE,
    "evaluate": evaluation.EVALUATE,
    "train": training.TRAIN,
    "curves": training.CURVES,
    "experiment": experiment.EXPERIMENT,
    "validate": measures.VALIDATE,
    "bench": measures.BENCH,
    "paper": annotated.PAPER,
}

STOPPED = "stopped; nothing half-written is left"


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line, by default `sys.argv`; return the exit status."""
    os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")  # before torch is loaded
    try:
        try:
            arguments = _arguments(sys.argv[1:] if argv is None else argv)
            arguments.run(arguments)
        finally:
            print(end="", flush=True)
    except KeyboardInterrupt as stopped:  # its text, if any, says what is kept
        return _complain(str(stopped) or STOPPED, 130)
    except ContradictionError as error:
        return _complain(str(error), 2)
    except BrokenPipeError:  # `| head -1`: the reader has closed the pipe
        _drop_unprinted()
        return 1
    except MemoryError:
        return _complain("there is not enough memory. Ask for less.", 1)
    except (InputError, OSError) as error:  # other errors are ours: a traceback
        _drop_unprinted()
        unnamed = isinstance(error, OSError) and error.strerror and not error.filename
        return _complain("the output " * bool(unnamed) + told(error), 1)
    return 0


def _arguments(words: Sequence[str]) -> Namespace:
    """Parse the command line; exits with status 2 where it is at fault."""
    parser = _parser()
    for word in words:
        if word != word.encode("utf-8", "replace").decode():
            parser.error(f"{word!a} is not UTF-8. Give the file another name")
    arguments, unknown = parser.parse_known_args(words)
    for word in unknown:
        meant = f"--building {word}"
        known = "building" in arguments and not word.startswith("-")
        hint = f"Did you mean {meant}?" if known else "See --help."
        parser.error(f"{word!r} is no option of this command. {hint}")
    return arguments


def _complain(message: str, status: int) -> int:
    with suppress(OSError):  # stderr is closed
        print(message, file=sys.stderr)
    return status


def _drop_unprinted() -> None:
    """Drop output that cannot be printed: Python would retry it loudly at exit."""
    try:
        print(end="", flush=True)
    except OSError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


# -- The command line --------------------------------------------------------------


class _Parser(ArgumentParser):
    """Tells a mistake in one line, without the usage above it."""

    def error(self, message: str) -> NoReturn:
        """Exit with status 2."""
        self.exit(2, f"{self.prog}: {message}\n")


def _parser() -> ArgumentParser:
    top = _Parser(prog="python -m reference", formatter_class=Formatter)
    _describe(top, evacuation.FIRST_LOOK)
    version = f"fire-rescue-reference {reference.__version__}"
    top.add_argument("--version", action="version", version=version)
    top.set_defaults(seed=None, json=False)
    commands = top.add_subparsers(title="commands", metavar="COMMAND")
    for name, command in COMMANDS.items():
        told = command.run.__doc__
        _describe(
            commands.add_parser(name, help=told, formatter_class=Formatter), command
        )
    return top


def _describe(parser: ArgumentParser, command: Command) -> None:
    """Give a parser what a command does and takes."""
    parser.description = command.run.__doc__
    parser.epilog = f"example:\n  python -m reference {command.example}"
    chance = options.SEED if command.chance else {}
    numbers = options.JSON if command.numbers else {}
    options.add(parser, command.options | chance | numbers | command.options)
    parser.set_defaults(run=command.run)


# -- The process -------------------------------------------------------------------


def _process() -> int:
    """Run the command line as this process, even if its output is closed."""
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:  # closed: nobody listens
            setattr(sys, name, open(os.devnull, "w"))  # noqa: SIM115
        getattr(sys, name).reconfigure(errors="backslashreplace")
    os.environ["MPLBACKEND"] = "agg"  # no command opens a window
    heard = Event()

    def stop(*_: Any) -> NoReturn:
        """Handle a signal."""
        heard.set()
        raise KeyboardInterrupt

    for number in STOPS:
        signal.signal(number, stop)
    try:
        status = main()
    except Exception:
        if not heard.is_set():
            raise
        status = _complain(STOPPED, 130)  # a library put its own error in its place
    if heard.is_set():
        sys.stderr.flush()
        os._exit(status)  # Python may crash when it unloads what is half loaded
    return status


if __name__ == "__main__":
    sys.exit(_process())
