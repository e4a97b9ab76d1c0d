"""Commands for maps: check, draw [A8] and floors."""

import json
import re
import sys
from argparse import ArgumentTypeError, Namespace
from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import partial
from pathlib import Path
from time import sleep, strftime
from typing import Any

from reference.building import Kind, build
from reference.paper import InputError
from reference.workshop.commands import options
from reference.workshop.commands.common import print_note, print_report, shell_line
from reference.workshop.maps import (
    MistakesError,
    find_map,
    lines_of_plan,
    load,
    parse_map,
    shipped_floors,
    text_of_map,
)
from reference.workshop.maps.generated import LEAST_SIDE, MOST_SIDE, generated_text
from reference.workshop.maps.mistakes import Mistake
from reference.workshop.maps.pages import MOST_FLOORS, Page
from reference.workshop.maps.repairs import Repair, repair_file, write_new
from reference.workshop.maps.semantics import notes_on
from reference.workshop.storage.files import (
    message_of,
    read_text,
    refuse_no_file,
    refuse_unwritable,
)
from reference.workshop.storage.runs import ContradictionError

VIEWS = ("top", "oblique", "walkable", "closeup", "graph", "anchors")
VIEW_HELP = (
    "walkable: where one may walk; closeup: a door, an exit, stairs; anchors: what "
    "robots that learn choose between; default: top"
)
LOOK_SECONDS = 0.3  # seconds between two looks at a watched file
WATCH = options.flag("--watch", "again each time the file is saved; Ctrl-C ends")
FIX = options.flag(
    "--fix", "write what the hints say as a new map, and what was changed; FILE stays"
)
CHECK_JSON = options.json(
    "file, title, floors, rooms, doors, exits, stairwells; or file and mistakes; with "
    "--fix written and changes, too"
)


@options.command("check paper", options.MAP_FILE, WATCH, FIX, CHECK_JSON)
def check(arguments: Namespace) -> None:
    """Says that a map is fine and what is in it, or explains its mistakes."""
    if arguments.fix and arguments.watch:
        raise ContradictionError("--fix, --watch: they exclude each other.")
    work = _fix if arguments.fix else _check
    _at_every_save(arguments, partial(work, arguments), sleep)


def _check(arguments: Namespace) -> None:
    """Check a map once, and say what to try next."""
    try:
        text, facts = _counted(arguments.file)
    except MistakesError as error:
        if arguments.json:
            print(json.dumps({"file": error.path, "mistakes": _listed(error.mistakes)}))
        if arguments.watch:
            raise
        flag = "--fix" if _can_be_fixed(arguments.file) else "--watch"
        raise _with_next(error, "check", arguments.file, flag) from None

    print_report(arguments, {"file": arguments.file, **facts}, text)
    if not arguments.watch:
        _say_next(arguments.file)


def _say_next(name: object) -> None:
    """Print what to try once a map is fine, if it could be told that it is."""
    sys.stdout.flush()
    print_note(f"next: {shell_line('draw', name)}")


def _can_be_fixed(name: str) -> bool:
    """Whether --fix does something: a hint leads further, or how it is encoded."""
    path = find_map(name)
    if not path.is_file():  # a pipe has been read, once and for all
        return False
    return bool(repair_file(path, most=1).rounds)


def _with_next(error: Exception, *words: object) -> InputError:
    """Add to a page of mistakes the command to try next."""
    return InputError(f"{error}\nnext: {shell_line(*words)}")


def _listed(mistakes: Sequence[Mistake]) -> list[dict[str, Any]]:
    """List mistakes for programs."""
    return [
        {
            "line": m.line,
            "column": m.column,
            "message": m.what,
            "hint": m.hint,
            "more": m.more,  # places with the same mistake
        }
        for m in mistakes
    ]


NOTHING_WRITTEN = "nothing is written: what --fix could type leads no further"


def _fix(arguments: Namespace) -> None:
    """Do what the hints say in a new file beside the old one, and say what was done."""
    path = find_map(arguments.file)
    repair = repair_file(path)
    if not repair.rounds:
        if repair.left:
            page = InputError(f"{repair.left}\n{NOTHING_WRITTEN}")
            raise _with_next(page, "check", arguments.file, "--watch")
        text, facts = _counted(path)
        facts = {"file": arguments.file, **facts, "written": None, "changes": []}
        print_report(arguments, facts, text)
        print_note("nothing to fix: no file is written")
        return

    new = write_new(path, repair.text)
    changes = [_listed(mistakes) for mistakes in repair.rounds]
    facts = {"file": arguments.file, "written": str(new), "changes": changes}
    if repair.left:
        facts["mistakes"] = _listed(repair.left.mistakes)
        print_report(arguments, facts, f"written: {new}\n{_told(repair)}")
        left = MistakesError(str(new), repair.left.mistakes)
        raise _with_next(left, "check", new, "--watch")
    text, counts = _counted(new)
    print_report(arguments, facts | counts, f"written: {new}\n{_told(repair)}\n{text}")
    _say_next(new)


CHANGES_TOLD = 20  # of a round
FIX_DOES_IT = ": 'check --fix' does it for you"


def _told(repair: Repair) -> str:
    """Say what was changed, round by round: of each hint its first part."""
    lines = []
    for number, mistakes in enumerate(repair.rounds, 1):
        lines.append(f"round {number}; of two remedies the first was taken:")
        for mistake in mistakes[:CHANGES_TOLD]:
            count = f" ({mistake.more + 1} places)" if mistake.more else ""
            place = f"{mistake.line}:{mistake.column}"
            hint = mistake.hint.replace(FIX_DOES_IT, "")  # it has done it
            end = "" if mistake.what.endswith("?") else "."
            lines.append(f"  {place}: {mistake.what}{end} {hint}{count}")
        if len(mistakes) > CHANGES_TOLD:
            lines.append(f"  … and {len(mistakes) - CHANGES_TOLD} more")
    return "\n".join(lines)


def _counted(name: str | Path) -> tuple[str, dict[str, Any]]:
    """Count what is in a map that is fine: in words, and for programs.

    Notes what is rarely meant. Raises MistakesError.
    """
    path = find_map(name)
    text = text_of_map(path)
    building = build(parse_map(text, str(path)))
    for note in notes_on(building, Page(lines_of_plan(text))):
        print_note(f"note: {path}:{note}")

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
    return f"ok: {title}, {words}", {"title": title, **counts}


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
        path = arguments.output or Path(name)
        refuse_unwritable(path)
        picture = getattr(drawing, arguments.view)(load(arguments.file))
        print(drawing.save(picture, path))
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
    done: object = None  # the save that was worked on last
    with suppress(KeyboardInterrupt):
        while True:
            try:
                saved = _save_of(path)
                if saved and saved != done:
                    done = saved  # once, also if it fails
                    print_note(strftime(f"{'':-<40} %H:%M:%S"))
                    refuse_no_file(path)  # a pipe would keep us waiting
                    work()
            except (InputError, OSError) as error:
                print_note(message_of(error))
            sys.stdout.flush()
            wait(LOOK_SECONDS)


def _save_of(path: Path) -> tuple[int, ...]:
    """What differs from one save of a file to the next, even if it keeps its time.

    Some editors remove a file to write it anew: between, it has nothing.
    """
    try:
        status = path.stat()
    except FileNotFoundError:
        return ()
    return status.st_mtime_ns, status.st_ctime_ns, status.st_size, status.st_ino


def _size(text: str) -> tuple[int, int]:
    """Read width and height, such as 40x40."""
    read = re.fullmatch(r"(\d{1,9})[xX](\d{1,9})", text)
    if read:
        width = int(read[1])
        height = int(read[2])
        if min(width, height) >= LEAST_SIDE and max(width, height) <= MOST_SIDE:
            return width, height
    raise ArgumentTypeError(
        f"'{text}' is not WIDTHxHEIGHT, both from {LEAST_SIDE} to {MOST_SIDE}"
    )


SIZE_HELP = (
    "of a new building's main body, in metres with its walls; stairwells stick out of "
    "it; default: 40x40"
)


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
        try:
            text = generated_text(seed, width, height, arguments.floors or 3)
        except InputError as error:  # too many floors of that size
            raise ContradictionError(str(error)) from None
        print(text, end="")
    elif arguments.name is not None:
        print(read_text(find_map(arguments.name)), end="")
    else:
        for name in shipped_floors():
            building = load(name)
            print(f"{name:10}{building.title}, floors {building.floors}")
