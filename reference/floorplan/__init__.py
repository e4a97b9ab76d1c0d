"""Read a floor plan from text: a checked drawing, or a page of mistakes.

Clauses: A1 (floors of unit cells), A2 (rooms, doors), A3 (stairwells), A4 (exits).
[A1, chosen] The paper shows its building in figures only; here it is text, so that a
student can redraw it with any editor.

    #  wall      +  door; an entrance where it touches a stairwell      ;  note
    .  floor     E  exit      A-D  stairwell      a-z  a room's name on its floor
    a blank is outside, also between walls

A file says `building: NAME`, `size: COLUMNS x ROWS` and then, for each floor from 1
upwards, `floor 1: NAME` above its drawing; `floor 2-3:` draws once and builds twice.
Every drawing has all the rows, none of them blank. Read on in `mistakes` (what one
looks like), `page` and `syntax` (stages 1 to 3), `plan` (rooms and their graph) and
`semantics` (stages 4 and 5).
"""

import re
from codecs import BOM_UTF16_BE, BOM_UTF16_LE
from collections.abc import Iterable
from difflib import get_close_matches
from itertools import islice
from os import PathLike
from pathlib import Path

from reference.floorplan import page, semantics, syntax
from reference.floorplan.mistakes import MOST, FloorPlanError, Mistake
from reference.floorplan.plan import Plan, Storey


def parse(text: str, path: str = "<text>") -> Plan:
    """Read the drawing in a text, called `path` in messages. Raises FloorPlanError."""
    sheet = page.sort(text.removeprefix("\ufeff"))
    for checks in syntax.STAGES:
        _refuse((found for check in checks for found in check(sheet)), path)
    plan = _plan(sheet)
    for stage in semantics.STAGES:
        _refuse((found for check in stage for found in check(plan, sheet)), path)
    return plan


def read(path: str | PathLike[str]) -> Plan:
    """Read the drawing in a file. Raises FloorPlanError, OSError if there is none.

    Reads no more than the largest drawing, even from a device without end.
    """
    try:
        with Path(path).open("rb") as text:
            raw = text.read(page.MOST_SIGNS + 4)  # with a byte order mark
    except OSError as error:
        raise _unreadable(path, error) from None
    return parse(_decoded(raw, str(path)), str(path))


def to_text(plan: Plan) -> str:
    """Write a plan as text: `parse(to_text(plan)) == plan`."""
    head = f"building: {plan.title}\nsize:     {plan.width} x {plan.height}\n"
    floors = [
        "\n".join(line.rstrip() for line in ("", f"floor {n}: {s.name}", *s.rows))
        for n, s in enumerate(plan.storeys, 1)
    ]
    return head + "\n".join(floors) + "\n"


def find(name: str | PathLike[str]) -> Path:
    """Find a floor file by its path, or by the bare name of one that ships.

    Raises FileNotFoundError with the names that ship, OSError for no possible path.
    """
    path, bare, shipped = Path(name), str(name).removesuffix(".txt"), shipped_floors()
    try:
        if path.exists() and not (path.is_dir() and bare in shipped):
            return path
    except OSError as error:
        raise _unreadable(path, error) from None
    if bare in shipped:
        return shipped[bare]
    close = get_close_matches(bare.lower(), shipped, 1)
    meant = f" Did you mean '{close[0]}'?" if close else ""
    raise FileNotFoundError(
        f"there is no floor file '{name}'.{meant}\n"
        f"hint: Give the path of one, or a name that ships: {', '.join(shipped)}."
    )


def shipped_floors() -> dict[str, Path]:
    """Floors beside the checkout, or in the installed package, by name."""
    package = Path(__file__).parent.parent
    files = [*package.glob("floors/*.txt"), *package.parent.glob("floors/*.txt")]
    return {file.stem: file for file in sorted(files)}


def _unreadable(path: str | PathLike[str], error: OSError) -> OSError:
    return type(error)(f"cannot read {path}: {error.strerror}")


def _decoded(raw: bytes, path: str) -> str:
    """Decode UTF-8; FloorPlanError at the first byte that is not text."""
    text = raw.decode("utf-8", "replace")
    if bad := re.search("[\0\ufffd]", text):
        sheet = page.sort(text[: bad.end()])
        wide = raw.startswith((BOM_UTF16_LE, BOM_UTF16_BE)) or raw[:4].count(0) == 2
        what = "this is UTF-16, not plain text" if wide else "this is not plain text"
        hint, last = "Save the file as plain text (ASCII).", sheet.lines[-1]
        _refuse([last.mistake(what, hint, len(last.written))], path)
    return text


def _refuse(found: Iterable[Mistake], path: str) -> None:
    """Raise FloorPlanError with all that a stage has found, if anything."""
    if mistakes := sorted(set(islice(found, MOST))):
        raise FloorPlanError(path, mistakes)


def _plan(sheet: page.Page) -> Plan:
    width, height = sheet.size
    storeys: list[Storey] = []
    for drawing in sheet.drawings:
        rows = tuple(row.code.ljust(width) for row in drawing.rows)
        storeys += len(drawing.numbers) * [Storey(drawing.heading.value, rows)]
    return Plan(sheet.settings["building:"][0].value, width, height, tuple(storeys))
