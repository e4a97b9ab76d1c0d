"""The command line: `python -m reference` and its commands check, draw, evacuate, ...

Numbers go to stdout, progress and notes to stderr. Exit status: 0 done, 1 wrong input
or a failed run, 2 a wrong command line, 130 after Ctrl-C, SIGTERM or SIGHUP.
"""

import os
import re
import signal
import sys

if __name__ == "__main__":
    if signal.getsignal(signal.SIGINT) != signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.SIG_DFL)  # silent while modules are loaded
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:  # closed: nobody listens
            setattr(sys, name, open(os.devnull, "w"))  # noqa: SIM115

    from reference.workshop.commands.missing import tell_what_is_missing

    sys.excepthook = tell_what_is_missing  # also of what is imported below

from argparse import ArgumentParser, Namespace
from argparse import RawDescriptionHelpFormatter as Formatter
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Any, NoReturn

import reference
from reference.workshop.commands.building import check, draw, floors
from reference.workshop.commands.common import STOPPED, complain, exit_status
from reference.workshop.commands.evacuation import evacuate, first_look, strategies
from reference.workshop.commands.evaluation import evaluate
from reference.workshop.commands.experiment import experiment
from reference.workshop.commands.measures import bench, paper, validate
from reference.workshop.commands.options import Command
from reference.workshop.commands.training import curves, train
from reference.workshop.storage.files import is_text
from reference.workshop.storage.workers import STOPPED_BY, STOPS, stop, stop_again

MAP_COMMANDS = (check, draw, floors)
RUN_COMMANDS = (strategies, evacuate, evaluate, train, curves, experiment)
MODEL_COMMANDS = (validate, bench, paper)
COMMANDS = {
    each.run.__name__: each for each in (*MAP_COMMANDS, *RUN_COMMANDS, *MODEL_COMMANDS)
}


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line, by default `sys.argv`; return the exit status."""
    os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")  # before torch is loaded

    def run() -> None:
        arguments = _arguments(argv)
        arguments.run(arguments)

    return exit_status(run)


class _Parser(ArgumentParser):
    """Tells a mistake in one line, without the usage above it.

    wanted  what each option takes, in words, by its names
    """

    wanted: Mapping[str, str] = MappingProxyType({})

    def error(self, message: str) -> NoReturn:
        """Exit with status 2."""
        option = re.match(r"argument (-[\w-]*).*: expected .*argument", message)
        if option:  # it may have one that looks like an option: --size -3x4
            message += f", {self.wanted[option[1]]}"
        self.exit(2, f"{self.prog}: {message}\n")


def _arguments(argv: Sequence[str] | None) -> Namespace:
    """Read the command line; say how a map is named, if one can be."""
    look: Any = {"formatter_class": Formatter, "allow_abbrev": False}
    top = _Parser(prog="python -m reference", **look)
    _describe(top, first_look)
    version = f"fire-rescue-reference {reference.__version__}"
    top.add_argument("--version", action="version", version=version)

    commands = top.add_subparsers(title="commands", metavar="COMMAND")
    for name, command in COMMANDS.items():
        parser = commands.add_parser(name, help=command.run.__doc__, **look)
        _describe(parser, command)

    words = sys.argv[1:] if argv is None else argv
    for word in words:
        if not is_text(word):
            top.error(f"{word!a} is no UTF-8, and no record could name it: rename it")
    arguments, unknown = top.parse_known_args(words)
    if arguments.run is not first_look.run and words[0].startswith("-"):
        top.error(f"{words[0]}: write options behind the command")
    if unknown:
        may_be_map = "building" in arguments and not unknown[0].startswith("-")
        hint = "a map is named by --building; " if may_be_map else ""
        asked = commands.choices.get(words[0], top)
        asked.error(f"unrecognized arguments: {' '.join(unknown)}; {hint}see --help")
    return arguments


def _describe(parser: _Parser, command: Command) -> None:
    """Give a parser what a command does and takes."""
    parser.description = command.run.__doc__
    parser.epilog = command.end
    for names, asked in command.options:
        parser.add_argument(*names, **asked)
    parser.wanted = {
        name: _wanted(asked) for names, asked in command.options for name in names
    }
    parser.set_defaults(run=command.run)


def _wanted(asked: Mapping[str, Any]) -> str:
    """Say what an option takes."""
    if "choices" in asked:
        return f"one of {', '.join(asked['choices'])}"
    return f"{asked.get('metavar', 'none')}: {asked['help']}"


def _process() -> int:
    """Run the command line; signals that stop it raise KeyboardInterrupt, as Ctrl-C."""
    os.environ.pop("MPLBACKEND", None)  # may name what is not installed here
    for number in STOPS:
        if signal.getsignal(number) != signal.SIG_IGN:  # as `nohup` has it
            signal.signal(number, stop)
    sys.unraisablehook = stop_again
    try:
        status = main()
        for number in STOPS:  # all is done: what comes now would only spoil the status
            signal.signal(number, signal.SIG_IGN)
    except (Exception, KeyboardInterrupt):  # a library's own, perhaps a stop's
        if not STOPPED_BY:
            raise
        status = complain(STOPPED, 130)
    if status == 130:
        sys.stderr.flush()
        os._exit(status)  # Python may crash when it unloads what is half loaded
    return status


if __name__ == "__main__":
    sys.exit(_process())
