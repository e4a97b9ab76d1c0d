"""The commands: `python -m reference`, and under it check, draw, evacuate, train, ...

Clauses: A8 (draw), E1, E2 (train).  Numbers go to stdout, progress and notes to stderr.
Exit status: 0 done, 1 the input or the run is at fault, 2 the command line is, 130
after Ctrl-C.
"""

import json
import os
import shlex
import signal
import sys
import tempfile
from argparse import SUPPRESS, ArgumentParser, ArgumentTypeError, Namespace
from argparse import RawDescriptionHelpFormatter as Formatter
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, replace
from difflib import get_close_matches
from math import isnan
from pathlib import Path
from statistics import mean
from threading import Event
from time import perf_counter
from typing import Any, Literal, NamedTuple

from tqdm import tqdm

from reference import fire, robots
from reference.bench import measure, table
from reference.building import Building, Kind, load
from reference.floorplan import FloorPlanError, find
from reference.learning.settings import CHOICES, PRESETS
from reference.paper import PEOPLE, ROBOTS_PER_FLOOR, Scenario
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
    robots = _player(arguments.robots, "robots", arguments.sample)
    fire = _player(arguments.fire, "fire", arguments.sample)
    name, building, scenario = _place(arguments, robots, fire)
    first = arguments.seed or 0

    def begin(seed: int) -> Simulation:
        return _simulation(building, scenario, seed, robots, fire)

    if arguments.animate:
        _animate(begin(first), arguments.animate)
    seeds = range(first, first + arguments.episodes)
    progress = tqdm(seeds, unit="episode", disable=None, leave=False)
    runs = [_episode(begin, seed) for seed in progress]
    facts: dict[str, Any] = {
        "building": name,
        "robots": arguments.robots,
        "fire": arguments.fire,
        "seed": first,
        "episodes": arguments.episodes,
        **_means(runs),
    }
    if arguments.json:
        print(json.dumps(facts | {"runs": runs}))
    else:
        _summarise(building, facts, runs)


Side = Literal["robots", "fire"]
NAMED: dict[Side, tuple[str, ...]] = {"robots": ROBOTS, "fire": FIRES}


def _player(text: str, side: Side, sample: bool) -> Any:
    """A strategy's name, or the policy in a checkpoint."""
    if text in NAMED[side]:
        return text
    from reference.learning.policies import named_or_file

    with _for_people():
        return named_or_file(text, side, sample)


def _place(
    arguments: Namespace, robots: Any, fire: Any
) -> tuple[str, Building, Scenario]:
    """Where and with whom: as a learned policy knows it, unless asked otherwise."""
    learned = [player for player in (robots, fire) if not isinstance(player, str)]
    if not learned:
        if arguments.sample:
            raise CommandError("--sample goes with a checkpoint. Leave it out here.", 2)
        name = arguments.building or "paper"
        return name, load(name), Scenario(people=arguments.people or PEOPLE)
    name = arguments.building or learned[0].named
    building = load(arguments.building) if arguments.building else learned[0].building
    scenario = learned[0].evaluation(arguments.people)
    if robots in ROBOTS[1:] and not scenario.robots_per_floor:
        scenario = replace(scenario, robots_per_floor=ROBOTS_PER_FLOOR)
    with _for_people():
        for policy in learned:
            policy.refuse_elsewhere(building, scenario)
    return name, building, scenario


@contextmanager
def _for_people() -> Iterator[None]:
    """What is wrong with the input, in one message instead of a traceback."""
    try:
        yield
    except ValueError as error:
        raise CommandError(str(error)) from error


def _simulation(
    building: Building, scenario: Scenario, seed: int, robots: Any, fire: Any
) -> Simulation:
    with _for_people():
        return Simulation(building, scenario, robots, fire, seed)


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
    from concurrent.futures import BrokenExecutor

    from reference.learning.training import train
    from reference.learning.workers import workers

    count = _cores() if arguments.workers is None else arguments.workers
    print(f"{training.about()}; {_count(count, 'workers')}", file=sys.stderr)
    with _ctrl_c() as stop, workers(count) as executor, _for_people():
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
    from reference.learning import starting
    from reference.learning.training import Training

    names = starting.Asked.__dataclass_fields__
    asked = starting.Asked(**{name: getattr(arguments, name) for name in names})
    if asked.robots and asked.fire:
        raise CommandError("nobody learns: name --robots or --fire, not both.", 2)
    try:
        if arguments.resume:
            return Training.resumed(starting.resume(asked, arguments.out))
        return Training(starting.begin(asked, arguments.out))
    except starting.ContradictionError as error:
        raise CommandError(str(error), 2) from error
    except ValueError as error:
        raise CommandError(str(error)) from error


def _tell_training(training: Any, facts: dict[str, Any], as_json: bool) -> None:
    """What came of it, and how to look at it."""
    if as_json:
        print(json.dumps(facts))
    else:
        print(training.about())
        for name, value in facts.items():
            if isinstance(value, int | float):
                print(f"{name.replace('_', ' '):22}{_figures([value])}")
    learned = " ".join(
        f"--{s} {_quoted(facts['checkpoint'])}" for s in training.learners
    )
    folder = _quoted(Path(facts["summaries"]).parent)
    print(
        "to see how it was learned, and what:\n"
        f"  python -m reference curves {folder}\n"
        f"  python -m reference evacuate {learned} --animate learned.gif",
        file=sys.stderr,
    )


def _go_on(arguments: Namespace, count: int | None) -> str:
    """The command that goes on with a training."""
    words = ["python -m reference train --resume --out", _quoted(arguments.out)]
    if count is not None:
        words.append(f"--workers {count}")
    if arguments.tensorboard:
        words.append("--tensorboard")
    return " ".join(words)


def _quoted(path: str | Path) -> str:
    return shlex.quote(str(path))


def _cores() -> int:
    """Cores this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


@contextmanager
def _ctrl_c() -> Iterator[Callable[[], bool]]:
    """Has Ctrl-C been pressed? Pressed once more, it stops at once."""
    pressed, before = Event(), signal.getsignal(signal.SIGINT)

    def note(number: int, frame: Any) -> None:
        pressed.set()
        signal.signal(signal.SIGINT, before)
        print("\nstopping; Ctrl-C once more drops what is unsaved", file=sys.stderr)

    signal.signal(signal.SIGINT, note)
    try:
        yield pressed.is_set
    finally:
        signal.signal(signal.SIGINT, before)


def curves(arguments: Namespace) -> None:
    """Draws the learning curves of one training, or of several that belong together."""
    from reference.drawing import curves, page

    path = arguments.output or Path("curves.png")
    _writable(path, page.PICTURES, "a picture")
    with _for_people():
        print(curves.draw(arguments.runs, path))


def bench(arguments: Namespace) -> None:
    """Measures what one second computes: person-seconds, decisions, samples."""
    os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")  # before torch is loaded
    building = load(arguments.building)
    try:
        facts = measure(arguments.building, arguments.seed or 0)
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
    add("--building", help=f"{MAP}; default: the checkpoint's, else paper")
    _player_option(parser, "robots", "default: sweep", "sweep")
    _player_option(parser, "fire", "default: random", "random")
    add("--people", type=_from(1), help=f"default: the checkpoint's, else {PEOPLE}")
    add("--episodes", type=_from(1), default=1, help="how many, default: 1")
    add(
        "--sample",
        action="store_true",
        help="draw a learned policy's actions instead of taking the likeliest",
    )
    add(
        "--animate",
        type=Path,
        metavar="FILE",
        help="film the first episode as .gif, .html or .mp4",
    )


def _player_option(
    parser: ArgumentParser, side: Side, note: str, default: str | None = None
) -> None:
    names = ", ".join(NAMED[side])
    what = f"{names}, or a checkpoint that train made (or its folder); {note}"
    known = _strategy(NAMED[side])
    parser.add_argument(
        f"--{side}", type=known, default=default, metavar="S", help=what
    )


def _strategy(names: tuple[str, ...]) -> Callable[[str], str]:
    """The name of a strategy, or a file; what is in it is looked at later."""

    def known(text: str) -> str:
        if text in names or Path(text).exists():
            return text
        close = get_close_matches(text.lower(), names, 1)
        meant = f" Did you mean '{close[0]}'?" if close else ""
        raise ArgumentTypeError(
            f"invalid choice: '{text}' is no file and none of the strategies "
            f"{', '.join(names)}.{meant}"
        )

    return known


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
    add("--trainer", choices=CHOICES["trainer_type"], help="of the robots")
    add("--head", choices=CHOICES["head"], help="of both policies; default: preset's")
    _player_option(parser, "robots", "if given, the robots do not learn")
    _player_option(parser, "fire", "if given, the fire does not learn")
    add(
        "--schedule",
        choices=CHOICES["schedule"],
        help="both sides learn together, or in turn; default: preset's",
    )
    add(
        "--imitate",
        choices=ROBOTS[1:],
        help="robots copy this strategy first; never the default",
    )
    add(
        "--workers",
        type=_from(0),
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
    "train": Command(
        train,
        _train_options,
        "train --preset tiny --fire random --out out/tiny\n"
        "  python -m reference train --resume --out out/tiny\n"
        "  python -m reference evacuate --robots out/tiny --fire greedy",
    ),
    "curves": Command(
        curves, _curves_options, "curves out/tiny -o curves.png", numbers=False
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
    _seed_option(top, None)
    _json_option(top, False)
    top.set_defaults(
        run=evacuate,
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
