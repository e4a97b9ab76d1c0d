"""A text file becomes a checked drawing of a building, or a page of mistakes.

Clauses: A1 (floors of unit cells), A2 (rooms, doors), A3 (stairwells), A4 (exits).
[A1, chosen] The paper shows its building in figures only; here it is text, so that a
student can redraw it with any editor.

    #  wall      +  door; an entrance where it touches a stairwell      ;  note
    .  floor     E  exit      A-D  stairwell      a-z  a room's name on its floor
    a blank is outside, also between walls

A file says `building: NAME`, `size: COLUMNS x ROWS` and then, for each floor from 1
upwards, `floor 1: NAME` above its drawing; `floor 2-3:` draws once and builds twice.
Every drawing has all the rows, and something in each. Read on in `mistakes` (what one
looks like), `page` and `writing` (stages 1 to 3), `grid` (stages 4 and 5).
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from difflib import get_close_matches
from os import PathLike
from pathlib import Path
from typing import TypeVar

from reference.floorplan import grid, page, writing
from reference.floorplan.mistakes import Finding, FloorPlanError, Mistake

__all__ = [
    "FloorPlanError",
    "Mistake",
    "Plan",
    "Storey",
    "find",
    "parse",
    "read",
    "to_text",
]

T = TypeVar("T")


@dataclass(frozen=True)
class Storey:
    """One floor: its name and its rows, all of the plan's width, north first."""

    name: str
    rows: tuple[str, ...]


@dataclass(frozen=True)
class Plan:
    """A drawing without mistakes; width and height in cells of 1 m [A1]."""

    title: str
    width: int
    height: int
    storeys: tuple[Storey, ...]


def parse(text: str, path: str = "<text>") -> Plan:
    """The drawing in a text; `path` names it in messages. Raises FloorPlanError."""
    sheet = page.sort(text.removeprefix("\ufeff"))
    _stop_at_mistakes(writing.STAGES, sheet, sheet, path)
    _stop_at_mistakes(grid.STAGES, grid.grids(sheet), sheet, path)
    return _plan(sheet)


def read(path: str | PathLike[str]) -> Plan:
    """The drawing in a file. Raises FloorPlanError, or OSError if it cannot be read."""
    path = Path(path)
    try:
        raw = path.read_bytes()
    except IsADirectoryError:
        raise IsADirectoryError(f"{path} is a folder: name a file in it") from None
    except OSError as error:
        raise type(error)(f"cannot read {path}: {error.strerror}") from None
    return parse(_decoded(raw, str(path)), str(path))


def to_text(plan: Plan) -> str:
    """The file that draws a plan: `parse(to_text(plan)) == plan`."""
    head = f"building: {plan.title}\nsize:     {plan.width} x {plan.height}\n"
    floors = [
        "\n".join(line.rstrip() for line in ("", f"floor {n}: {s.name}", *s.rows))
        for n, s in enumerate(plan.storeys, 1)
    ]
    return head + "\n".join(floors) + "\n"


def find(name: str | PathLike[str]) -> Path:
    """A floor file by its path, or by the bare name of one that ships.

    Raises FileNotFoundError with the names that ship.
    """
    path, bare = Path(name), str(name).removesuffix(".txt")
    shipped = _shipped()
    if path.exists() and not (path.is_dir() and bare in shipped):
        return path
    if bare in shipped:
        return shipped[bare]
    close = get_close_matches(bare.lower(), shipped, 1)
    meant = f" Did you mean '{close[0]}'?" if close else ""
    raise FileNotFoundError(
        f"there is no floor file '{name}'.{meant}\n"
        f"hint: Give the path of one, or a name that ships: {', '.join(shipped)}."
    )


def _shipped() -> dict[str, Path]:
    """The floors beside the checkout, or in the installed package, by name."""
    package = Path(__file__).parent.parent
    files = [*package.glob("floors/*.txt"), *package.parent.glob("floors/*.txt")]
    return {file.stem: file for file in sorted(files)}


def _decoded(raw: bytes, path: str) -> str:
    """Raises FloorPlanError at the first byte that stands in no text."""
    text = raw.decode("utf-8", "replace")
    bad = min((at for at in map(text.find, "\0\ufffd") if at >= 0), default=None)
    if bad is None:
        return text
    before = page.lines_of(text[:bad])
    written = page.lines_of(text)[len(before) - 1]
    what = "this is not plain text"
    hint = "Save the file as plain text (ASCII)."
    place = (len(before), len(before[-1]) + 1)
    raise FloorPlanError((Mistake(path, *place, written, what, hint),))


def _stop_at_mistakes(
    stages: Iterable[Iterable[Callable[[T], Iterable[Finding]]]],
    drawn: T,
    sheet: page.Page,
    path: str,
) -> None:
    """Raises FloorPlanError with all that the first stage to find anything finds."""
    for checks in stages:
        if findings := sorted({found for check in checks for found in check(drawn)}):
            raise FloorPlanError(tuple(_mistake(sheet, path, f) for f in findings))


def _mistake(sheet: page.Page, path: str, finding: Finding) -> Mistake:
    line, column, what, hint = finding
    return Mistake(path, line, column, sheet.lines[line - 1].written, what, hint)


def _plan(sheet: page.Page) -> Plan:
    width, height = sheet.size
    storeys = (
        Storey(drawing.name, tuple(row.code.ljust(width) for row in drawing.rows))
        for drawing in sheet.drawings
        for _ in drawing.numbers
    )
    return Plan(sheet.settings["building:"][0].value, width, height, tuple(storeys))
