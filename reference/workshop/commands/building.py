"""Commands for a map: check and draw.

Clauses: A8 (draw).
"""

import json
from argparse import Namespace
from pathlib import Path
from typing import Any

from reference.building import Building, Kind
from reference.workshop.commands import options
from reference.workshop.commands.common import Command, counted, writable
from reference.workshop.maps import find, load
from reference.workshop.runs import ContradictionError

VIEWS = ("top", "oblique", "walkable", "closeup", "graph")
VIEWS_OF_ONE_FLOOR = ("top", "graph")


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
    counts = [counted(facts[word], word) for word in ("doors", "exits", "stairwells")]
    floors = counted(building.floors, "floors")
    print(f"ok: {building.title}, {floors}, rooms {rooms}, {', '.join(counts)}")


def draw(arguments: Namespace) -> None:
    """Draws a map: the counterparts of the paper's six figures [A8], and its graph."""
    building = load(arguments.file)
    name, floor = f"{find(arguments.file).stem}-{arguments.view}", {}
    if arguments.floor is not None:
        name = f"{name}-{arguments.floor}"
        floor = {"floor": _floor(arguments, building)}
    from reference.workshop import drawing

    path = arguments.output or Path(f"{name}.png")
    writable(path, drawing.page.PICTURES, "a picture")
    drawing.save(getattr(drawing, arguments.view)(building, **floor), path)
    print(path)


def _floor(arguments: Namespace, building: Building) -> int:
    """Index of the floor asked for, if there is one to show alone."""
    if arguments.view not in VIEWS_OF_ONE_FLOOR:
        views = " or ".join(VIEWS_OF_ONE_FLOOR)
        raise ContradictionError(f"--floor goes with --view {views}. Leave it out.")
    if arguments.floor > building.floors:
        floors = counted(building.floors, "floors")
        raise ContradictionError(
            f"--floor {arguments.floor}: {building.title} has {floors}. "
            f"Give a number from 1 to {building.floors}."
        )
    return arguments.floor - 1


CHECK_OPTIONS: options.Table = {"file": {"help": options.MAP}}
DRAW_OPTIONS: options.Table = {
    **CHECK_OPTIONS,
    "--view": options.choice(VIEWS, "default: top", default="top"),
    "--floor": options.number(
        1, "with --view top or graph: one floor only, 1 is the lowest"
    ),
    **options.picture("NAME-VIEW.png in this folder"),
}

CHECK = Command(check, CHECK_OPTIONS, "check floors/paper.txt")
DRAW = Command(
    draw, DRAW_OPTIONS, "draw paper --view oblique -o paper.png", numbers=False
)
