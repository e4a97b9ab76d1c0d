"""Commands for maps: check, draw [A8] and floors."""

import json
import re
import sys
from argparse import ArgumentTypeError, Namespace
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from pathlib import Path
from time import sleep, strftime

from reference.building import Kind
from reference.paper import InputError
from reference.workshop.commands import options
from reference.workshop.commands.common import print_note, print_report
from reference.workshop.maps import MistakesError, find_map, load, shipped_floors
from reference.workshop.maps.generated import LEAST_SIDE, MOST_SIDE, generated_text
from reference.workshop.maps.semantics import touching
from reference.workshop.maps.syntax import MOST_FLOORS
from reference.workshop.storage.files import message_of, read_text
from reference.workshop.storage.runs import ContradictionError

VIEWS = ("top", "oblique", "walkable", "closeup", "graph")
VIEW_HELP = (
    "walkable: where one may walk; closeup: a door, an exit, stairs; default: top"
)
LOOK_SECONDS = 0.3  # seconds between two looks at a watched file
WATCH = options.flag("--watch", "again each time the file is saved; Ctrl-C ends")


@options.command("check paper", options.MAP_FILE, WATCH, options.JSON)
def check(arguments: Namespace) -> None:
    """Says that a map is fine and what is in it, or explains its mistakes."""
    _at_every_save(arguments, partial(_check, arguments), sleep)


def _check(arguments: Namespace) -> None:
    """Check a map once."""
    try:
        building = load(arguments.file)
    except MistakesError as error:
        if arguments.json:
            mistakes = [
                {"line": m.line, "column": m.column, "message": m.what, "hint": m.hint}
                for m in error.mistakes
            ]
            print(json.dumps({"file": error.path, "mistakes": mistakes}))
        raise  # stderr has the words for people

    for one, other in dict.fromkeys(touching(building)):
        print_note(
            f"note: {one.id} and {other.id} touch at a corner; nobody passes there. "
            "Draw a wall, or a door."
        )

    kinds = [landmark.kind for landmark in building.landmarks]
    counts = {
        "floors": building.floors,
        "rooms": [len(building.rooms(floor)) for floor in range(building.floors)],
        "doors": kinds.count(Kind.DOOR),
        "exits": kinds.count(Kind.EXIT),
        "stairwells": len(building.stairwells),
    }
    words = ", ".join(f"{name} {count}" for name, count in counts.items())
    title = building.title
    print_report(arguments, {"title": title, **counts}, f"ok: {title}, {words}")


@options.command(
    "draw paper --view oblique -o paper.png",
    options.MAP_FILE,
    WATCH,
    options.option("--view", VIEW_HELP, choices=VIEWS, default="top"),
    options.output("-o --output", options.PICTURES, "default: NAME-VIEW.png here"),
)
def draw(arguments: Namespace) -> None:
    """Draws a map as the paper does, from above or obliquely, or as a graph."""
    from reference.workshop import drawing  # matplotlib: `check` need not wait for it

    def work() -> None:
        """Draw it once, and say where."""
        name = f"{find_map(arguments.file).stem}-{arguments.view}.png"
        picture = getattr(drawing, arguments.view)(load(arguments.file))
        path = drawing.save(picture, arguments.output or Path(name))
        print(path)
        if arguments.watch:
            drawing.show(path)

    _at_every_save(arguments, work, drawing.pause)


def _at_every_save(
    arguments: Namespace, work: Callable[[], None], wait: Callable[[float], None]
) -> None:
    """Do the work once; with --watch again after each change, until Ctrl-C."""
    if not arguments.watch:
        work()
        return
    path = find_map(arguments.file)
    done = 0  # when the file was saved that was worked on last, ns
    with suppress(KeyboardInterrupt):
        while True:
            try:
                # Some editors remove a file to write it anew: between, it has no time.
                saved = path.stat().st_mtime_ns if path.exists() else done
                if saved != done:
                    done = saved  # once, also if it fails
                    print_note(strftime(f"{'':-<40} %H:%M:%S"))
                    work()
            except (InputError, OSError) as error:
                print_note(message_of(error))
            sys.stdout.flush()
            wait(LOOK_SECONDS)


def _size(text: str) -> tuple[int, int]:
    """Read width and height, such as 40x40."""
    read = re.fullmatch(r"(\d{1,9})[xX](\d{1,9})", text)
    if read:
        width, height = int(read[1]), int(read[2])
        if min(width, height) >= LEAST_SIDE and max(width, height) <= MOST_SIDE:
            return width, height
    raise ArgumentTypeError(
        f"'{text}' is not WIDTHxHEIGHT, both from {LEAST_SIDE} to {MOST_SIDE}"
    )


SIZE_HELP = "of a new building's main body, in metres with its walls; default: 40x40"


@options.command(
    "floors --new --seed 7 --size 40x40 --floors 3 > mine.txt",
    options.option("name", "a map to print; default: list all", nargs="?"),
    options.flag("--new", "draw a building by lot and print it"),
    options.SEED,
    options.option("--size", SIZE_HELP, type=_size, metavar="WxH"),
    options.number("--floors", 1, "of a new building; default: 3", most=MOST_FLOORS),
)
def floors(arguments: Namespace) -> None:
    """Lists the maps that ship, prints one to be changed, or draws a new building."""
    asked = {name: getattr(arguments, name) for name in ("seed", "size", "floors")}
    given = [f"--{name}" for name, value in asked.items() if value is not None]
    if given and not arguments.new:
        raise ContradictionError(f"{', '.join(given)}: add --new.")
    if arguments.new and arguments.name is not None:
        raise ContradictionError("a new building has no name: leave it out, or --new.")

    if arguments.new:
        width, height = arguments.size or (40, 40)
        seed = arguments.seed or 0
        print(generated_text(seed, width, height, arguments.floors or 3), end="")
    elif arguments.name is not None:
        print(read_text(find_map(arguments.name)), end="")
    else:
        for name in shipped_floors():
            building = load(name)
            print(f"{name:10}{building.title}, floors {building.floors}")
