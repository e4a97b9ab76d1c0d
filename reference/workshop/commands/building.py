"""Commands for maps: check, draw and floors.

Clauses: A8 (draw).
"""

import json
import sys
from argparse import Namespace
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from time import sleep
from typing import Any

from reference.building import Kind
from reference.paper import InputError
from reference.workshop.commands import options
from reference.workshop.commands.common import Command, counted, writable
from reference.workshop.files import told
from reference.workshop.maps import find, load, shipped_floors
from reference.workshop.maps.semantics import touching
from reference.workshop.runs import ContradictionError

VIEWS = ("top", "oblique", "walkable", "closeup", "graph")
VIEWS_OF_ONE_FLOOR = ("top", "graph")
POLL = 0.3  # seconds between two looks at a watched file


def check(arguments: Namespace) -> None:
    """Says that a map is fine and what is in it, or explains its mistakes."""
    _at_every_save(arguments, lambda: _check(arguments), sleep)


def _check(arguments: Namespace) -> None:
    building = load(arguments.file)
    for one, other in dict.fromkeys(touching(building)):
        where = f"{one.id} and {other.id} touch at a corner; nobody passes there."
        print(f"note: {where} Draw a wall, or a door.", file=sys.stderr)
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
    counts = [counted(facts[word], word) for word in ("doors", "exits", "stairwells")]
    floors = counted(building.floors, "floors")
    print(f"ok: {building.title}, {floors}, rooms {rooms}, {', '.join(counts)}")


def draw(arguments: Namespace) -> None:
    """Draws a map: the counterparts of the paper's six figures [A8], and its graph."""
    wait: Callable[[float], None] = sleep
    if arguments.watch:
        from reference.workshop import drawing

        wait = drawing.pause
    _at_every_save(arguments, lambda: _draw(arguments), wait)


def _draw(arguments: Namespace) -> None:
    building, floor = load(arguments.file), {}
    name = f"{find(arguments.file).stem}-{arguments.view}"
    if arguments.floor is not None:
        if arguments.view not in VIEWS_OF_ONE_FLOOR:
            views = " or ".join(VIEWS_OF_ONE_FLOOR)
            raise ContradictionError(f"--floor goes with --view {views}. Leave it out.")
        name, floor = f"{name}-{arguments.floor}", {"floor": arguments.floor - 1}
    from reference.workshop import drawing

    path = arguments.output or Path(f"{name}.png")
    writable(path)
    try:
        figure = getattr(drawing, arguments.view)(building, **floor)
    except InputError as error:  # there is no such floor
        raise ContradictionError(str(error)) from error
    print(drawing.save(figure, path))
    if arguments.watch:
        drawing.show(path)


def floors(arguments: Namespace) -> None:
    """Lists the maps that ship, or prints one, to be copied and changed."""
    if arguments.name is not None:
        print(find(arguments.name).read_text("utf-8"), end="")
        return
    for name in shipped_floors():
        building = load(name)
        floors = counted(building.floors, "floors")
        print(f"{name:10}{building.title}, {floors}")


def _at_every_save(
    arguments: Namespace,
    work: Callable[[], None],
    wait: Callable[[float], None],
) -> None:
    """Do the work once; with --watch again after each change, until Ctrl-C."""
    if not arguments.watch:
        work()
        return
    done, path = None, find(arguments.file)
    with suppress(KeyboardInterrupt):
        while True:
            with suppress(OSError):  # some editors remove a file to write it anew
                now = path.stat()
                if done != (done := (now.st_mtime_ns, now.st_size)):
                    _tried(work)
            wait(POLL)


def _tried(work: Callable[[], None]) -> None:
    """Do the work, or tell what hinders it."""
    try:
        work()
    except (InputError, OSError) as error:
        print(told(error), file=sys.stderr)
    print(end="", flush=True)


CHECK_OPTIONS: options.Table = {
    "file": {"help": options.MAP},
    "--watch": options.flag("again at every save of the file; Ctrl-C ends"),
}
DRAW_OPTIONS: options.Table = {
    **CHECK_OPTIONS,
    "--watch": options.flag(
        "again at every save of the file, also in a window where there is one; Ctrl-C "
        "ends"
    ),
    "--view": options.choice(VIEWS, "default: top", default="top"),
    "--floor": options.number(
        1, "with --view top or graph: one floor only, 1 is the lowest"
    ),
    **options.picture("NAME-VIEW.png in this folder"),
}

FLOORS_OPTIONS: options.Table = {
    "name": {"nargs": "?", "help": "print this one; default: list all"}
}

CHECK = Command(check, CHECK_OPTIONS, "check paper", chance=False)
DRAW = Command(
    draw,
    DRAW_OPTIONS,
    "draw paper --view oblique -o paper.png",
    numbers=False,
    chance=False,
)
FLOORS = Command(
    floors, FLOORS_OPTIONS, "floors tiny > mine.txt", numbers=False, chance=False
)
