"""The commands: `python -m reference`, and check, draw, evacuate and bench under it.

Clauses: A8 (draw).  Numbers go to stdout, progress and notes to stderr.  Exit status:
0 done, 1 the input or the run is at fault, 2 the command line is, 130 after Ctrl-C.
"""

import json
import os
import sys
import tempfile
from argparse import SUPPRESS, ArgumentParser, ArgumentTypeError, Namespace
from argparse import RawDescriptionHelpFormatter as Formatter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict
from math import isnan
from pathlib import Path
from statistics import mean
from time import perf_counter
from typing import Any, NamedTuple

from tqdm import tqdm

from reference import fire, robots
from reference.bench import measure, table
from reference.building import Building, Kind, load
from reference.floorplan import FloorPlanError, find
from reference.paper import PEOPLE, Scenario
from reference.simulation import Simulation

ROBOTS = tuple(robots.STRATEGIES)
FIRES = tuple(fire.STRATEGIES)
VIEWS = ("top", "oblique", "walkable", "closeup", "graph")
VIEWS_OF_ONE_FLOOR = ("top", "graph")


class CommandError(Exception):
    """One message for people; the command ends with this exit status."""

    def __init__(self, message: str, status: int = 1) -> None:
        super().__init__(message)
        self.status = status


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line, by default this process's own; returns the exit status."""
    arguments = _parser().parse_args(argv)
    try:
        arguments.run(arguments)
        print(end="", flush=True)
    except KeyboardInterrupt:
        return _complain("stopped; nothing half-written is left", 130)
    except CommandError as error:
        return _complain(str(error), error.status)
    except BrokenPipeError:  # `| head -1`: whoever asked has read enough
        _drop_unprinted()
        return 1
    except (FloorPlanError, OSError) as error:
        _drop_unprinted()
        return _complain(str(error), 1)
    return 0


def _complain(message: str, status: int) -> int:
    print(message, file=sys.stderr)
    return status


def _drop_unprinted() -> None:
    """What cannot be printed now is not tried again, with noise, at the exit."""
    try:
        print(end="", flush=True)
    except OSError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


# -- The commands -------------------------------------------------------------------


def check(arguments: Namespace) -> None:
    """Says that a map is fine and what is in it, or explains its mistakes."""
    building = load(arguments.file)
    kinds = [landmark.kind for landmark in building.landmarks]
    facts: dict[str, Any] = {
        "title": building.title,
        "floors": building.floors,
        "rooms": [len(building.rooms(floor)) for floor in range(building.floors)],
        "doors": kinds.count(Kind.DOOR),
        "exits": kinds.count(Kind.EXIT),
        "stairwells": len(building.stairwells),
    }
    if arguments.json:
        print(json.dumps(facts))
        return
    rooms = "/".join(map(str, facts["rooms"]))
    counts = [_count(facts[word], word) for word in ("doors", "exits", "stairwells")]
    floors = _count(building.floors, "floors")
    print(f"ok: {building.title}, {floors}, rooms {rooms}, {', '.join(counts)}")


def _count(number: int, plural: str) -> str:
    return f"{number} {plural[:-1] if number == 1 else plural}"


def draw(arguments: Namespace) -> None:
    """Draws a map: the counterparts of the paper's six figures [A8], and its graph."""
    building = load(arguments.file)
    name, floor = f"{find(arguments.file).stem}-{arguments.view}", {}
    if arguments.floor is not None:
        name = f"{name}-{arguments.floor}"
        floor = {"floor": _floor(arguments, building)}
    from reference import drawing

    path = arguments.output or Path(f"{name}.png")
    _writable(path, drawing.page.PICTURES, "a picture")
    drawing.save(getattr(drawing, arguments.view)(building, **floor), path)
    print(path)


def _floor(arguments: Namespace, building: Building) -> int:
    """Index of the floor asked for, if there is one to show alone."""
    if arguments.view not in VIEWS_OF_ONE_FLOOR:
        views = " or ".join(VIEWS_OF_ONE_FLOOR)
        raise CommandError(f"--floor goes with --view {views}. Leave it out here.", 2)
    if arguments.floor > building.floors:
        floors = _count(building.floors, "floors")
        raise CommandError(
            f"--floor {arguments.floor}: {building.title} has {floors}. "
            f"Give a number from 1 to {building.floors}.",
            2,
        )
    return arguments.floor - 1


def evacuate(arguments: Namespace) -> None:
    """Evacuates a building and tells who got out; episode i uses seed + i."""
    building = load(arguments.building)
    people, robots, fire = arguments.people, arguments.robots, arguments.fire

    def begin(seed: int) -> Simulation:
        return _simulation(building, people, seed, robots, fire)

    if arguments.animate:
        _animate(begin(arguments.seed), arguments.animate)
    seeds = range(arguments.seed, arguments.seed + arguments.episodes)
    progress = tqdm(seeds, unit="episode", disable=None, leave=False)
    runs = [_episode(begin, seed) for seed in progress]
    asked = ("building", "robots", "fire", "seed", "episodes")
    facts = {name: getattr(arguments, name) for name in asked} | _means(runs)
    if arguments.json:
        print(json.dumps(facts | {"runs": runs}))
    else:
        _summarise(building, facts, runs)


def _simulation(
    building: Building,
    people: int,
    seed: int,
    robots: str = "sweep",
    fire: str = "random",
) -> Simulation:
    try:
        return Simulation(building, Scenario(people=people), robots, fire, seed)
    except ValueError as error:
        raise CommandError(str(error)) from error


def _animate(simulation: Simulation, path: Path) -> None:
    """One evacuation as a moving picture."""
    from reference.drawing import film

    _writable(path, film.FORMATS, "an animation")
    try:
        film.animate(simulation, path)
    except ValueError as error:
        raise CommandError(str(error)) from error
    print(f"the animation is in {path}", file=sys.stderr)


def _episode(begin: Callable[[int], Simulation], seed: int) -> dict[str, Any]:
    start = perf_counter()
    outcome = asdict(begin(seed).run())
    known = {name: None if isnan(value) else value for name, value in outcome.items()}
    return {"seed": seed, **known, "wall_seconds": perf_counter() - start}


def _means(runs: list[dict[str, Any]]) -> dict[str, Any]:
    """The mean of every figure over the episodes that have one."""
    values = {name: _known(runs, name) for name in runs[0] if name != "seed"}
    return {name: mean(known) if known else None for name, known in values.items()}


def _known(runs: list[dict[str, Any]], name: str) -> list[float]:
    return [run[name] for run in runs if run[name] is not None]


def _summarise(
    building: Building, facts: dict[str, Any], runs: list[dict[str, Any]]
) -> None:
    first, last = runs[0]["seed"], runs[-1]["seed"]
    seeds = f"seed {first}" if first == last else f"seeds {first} to {last}"
    print(f"{building.title}: robots {facts['robots']}, fire {facts['fire']}, {seeds}")
    if len(runs) > 1:
        print(f"{'':18}{'mean':>10}{'lowest':>10}{'highest':>10}")
    for name in list(runs[0])[1:]:
        known = _known(runs, name)
        spread = [min(known), max(known)] if known and len(runs) > 1 else []
        print(f"{name.replace('_', ' '):18}{_figures([facts[name], *spread])}")


def _figures(values: list[float | None]) -> str:
    """Figures of one row, all with the same number of decimals."""
    known = [value for value in values if value is not None]
    whole = all(value == int(value) for value in known)
    largest = max(map(abs, known), default=0)
    decimals = 0 if whole or largest >= 1000 else 1 if largest >= 10 else 2
    cells = ("-" if value is None else f"{value:,.{decimals}f}" for value in values)
    return "".join(f"{cell:>10}" for cell in cells)


def bench(arguments: Namespace) -> None:
    """Measures how many person-seconds one second computes, on one core."""
    building = load(arguments.building)
    try:
        facts = measure(arguments.building, arguments.seed)
    except ValueError as error:
        raise CommandError(str(error)) from error
    print(json.dumps(facts) if arguments.json else table(building.title, facts))


# -- The command line ---------------------------------------------------------------


class Command(NamedTuple):
    """A command: what it does, its options, one example, whether it tells numbers."""

    run: Callable[[Namespace], None]
    options: Callable[[ArgumentParser], None]
    example: str
    numbers: bool = True


MAP = "a map, by path or by the name of one that ships"


def _check_options(parser: ArgumentParser) -> None:
    parser.add_argument("file", help=MAP)


def _draw_options(parser: ArgumentParser) -> None:
    _check_options(parser)
    parser.add_argument("--view", choices=VIEWS, default="top", help="default: top")
    parser.add_argument(
        "--floor", type=_from(1), metavar="N", help="one floor only, 1 is the lowest"
    )
    parser.add_argument(
        "-o",
        "--output",
        type=Path,
        metavar="FILE",
        help=".png, .svg or .pdf; default: NAME-VIEW.png in this folder",
    )


def _evacuate_options(parser: ArgumentParser) -> None:
    add = parser.add_argument
    add("--building", default="paper", help=f"{MAP}; default: paper")
    add("--robots", choices=ROBOTS, default="sweep", help="default: sweep")
    add("--fire", choices=FIRES, default="random", help="default: random")
    add("--people", type=_from(1), default=PEOPLE, help=f"default: {PEOPLE}")
    add("--episodes", type=_from(1), default=1, help="how many, default: 1")
    add(
        "--animate",
        type=Path,
        metavar="FILE",
        help="film the first episode as .gif, .html or .mp4",
    )


def _bench_options(parser: ArgumentParser) -> None:
    parser.add_argument("--building", default="paper", help=f"{MAP}; default: paper")


COMMANDS = {
    "check": Command(check, _check_options, "check floors/paper.txt"),
    "draw": Command(
        draw, _draw_options, "draw paper --view oblique -o paper.png", numbers=False
    ),
    "evacuate": Command(
        evacuate, _evacuate_options, "evacuate --robots patrol --episodes 20 --json"
    ),
    "bench": Command(bench, _bench_options, "bench --json"),
}


def _parser() -> ArgumentParser:
    top = ArgumentParser(
        prog="python -m reference",
        description="One evacuation of the paper's building, the best robots against "
        "the best fire;\na summary, and an animation in evacuation.gif.",
        epilog="example:\n  python -m reference --seed 7",
        formatter_class=Formatter,
    )
    _seed_option(top, 0)
    _json_option(top, False)
    top.set_defaults(
        run=evacuate,
        building="paper",
        robots="sweep",
        fire="greedy",
        people=PEOPLE,
        episodes=1,
        animate=Path("evacuation.gif"),
    )
    commands = top.add_subparsers(title="commands", metavar="COMMAND")
    for name, command in COMMANDS.items():
        text = command.run.__doc__ or ""
        parser = commands.add_parser(
            name,
            help=text,
            description=text,
            epilog=f"example:\n  python -m reference {command.example}",
            formatter_class=Formatter,
        )
        command.options(parser)
        _seed_option(parser, SUPPRESS)
        if command.numbers:
            _json_option(parser, SUPPRESS)
        parser.set_defaults(run=command.run)
    return top


def _seed_option(parser: ArgumentParser, default: Any) -> None:
    what = "same seed, same run; default: 0"
    parser.add_argument("--seed", type=_from(0), default=default, help=what)


def _json_option(parser: ArgumentParser, default: Any) -> None:
    what = "print one JSON object"
    parser.add_argument("--json", action="store_true", default=default, help=what)


def _from(least: int) -> Callable[[str], int]:
    """A whole number that is not below the least."""

    def number(text: str) -> int:
        if not text.isdecimal() or int(text) < least:
            raise ArgumentTypeError(f"'{text}' is not a whole number from {least} on")
        return int(text)

    return number


def _writable(path: Path, formats: Iterable[str], what: str) -> None:
    """Refuse a file that cannot be written, before there is anything to write."""
    from reference.drawing.page import with_suffix

    try:
        with_suffix(path, formats, what)
    except ValueError as error:
        raise CommandError(str(error), 2) from error
    if path.is_dir():
        raise CommandError(f"{path}: is a folder. Name a file in it.")
    try:
        tempfile.TemporaryFile(dir=path.parent).close()
    except OSError as error:
        raise CommandError(
            f"{path}: cannot be written ({error.strerror}). "
            "Name a file in a folder that exists and is yours."
        ) from error


if __name__ == "__main__":
    sys.exit(main())
