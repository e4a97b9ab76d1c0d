"""Maps: find a floor file, explain its mistakes, and build it.

Clauses: A1 to A4.  The book's `floorplan` refuses what it cannot read in one line;
here a drawing is checked in stages, and all mistakes of the first stage that finds any
are shown with the line, a caret and one thing to do. Read on in `mistakes` (what one
looks like), `page` and `syntax` (stages 1 to 3: how it is written) and `semantics`
(stages 4 and 5: what is drawn).
"""

import re
from codecs import BOM_UTF16_BE, BOM_UTF16_LE
from collections.abc import Iterable
from difflib import get_close_matches
from itertools import islice
from os import PathLike
from pathlib import Path

import reference
from reference import floorplan
from reference.building import Building, building_of
from reference.floorplan import Plan, to_text
from reference.workshop.maps import page, semantics, syntax
from reference.workshop.maps.mistakes import MOST, Mistake, MistakesError


def load(name: str) -> Building:
    """Read a floor file by path or shipped name and build it; see `building_of`.

    Raises MistakesError for mistakes in the drawing, OSError for an unreadable file.
    """
    return building_of(to_text(read(find(name))))


def read(path: str | PathLike[str]) -> Plan:
    """Read the drawing in a file. Raises MistakesError, OSError if there is none.

    Reads no more than the largest drawing, even from a device without end.
    """
    try:
        with Path(path).open("rb") as text:
            raw = text.read(page.MOST_SIGNS + 4)  # with a byte order mark
    except OSError as error:
        raise _unreadable(path, error) from None
    return parse(_decoded(raw, str(path)), str(path))


def parse(text: str, path: str = "<text>") -> Plan:
    """Read the drawing in a text, called `path` in messages. Raises MistakesError."""
    written = _lines(text.removeprefix("\ufeff"), path)
    sheet = page.sort(written)
    for checks in syntax.STAGES:
        _refuse((found for check in checks for found in check(sheet)), path)
    plan = floorplan.parse(text, path)
    _refuse(semantics.too_large(plan, sheet), path)
    building = Building(plan)
    for stage in semantics.STAGES:
        _refuse((found for check in stage for found in check(building, sheet)), path)
    return plan


def _lines(text: str, path: str) -> list[str]:
    """Split a text, whichever way its lines end. Raises MistakesError if it is long."""
    lines = re.split(r"\r\n?|\n", text[: page.MOST_SIGNS], maxsplit=page.MOST_LINES)
    if len(text) > page.MOST_SIGNS or len(lines) > page.MOST_LINES:
        what = f"a file has at most {page.MOST_LINES} lines"
        what += f" and {page.MOST_SIGNS} characters"
        _refuse([Mistake(len(lines), 1, what, "Draw less.", lines[-1])], path)
    return lines


def _refuse(found: Iterable[Mistake], path: str) -> None:
    """Raise MistakesError with all that a stage has found, if anything."""
    if mistakes := sorted(set(islice(found, MOST))):
        raise MistakesError(path, mistakes)


def _decoded(raw: bytes, path: str) -> str:
    """Decode UTF-8; MistakesError at the first byte that is not text."""
    text = raw.decode("utf-8", "replace")
    if bad := re.search("[\0\ufffd]", text):
        before = text[: bad.start()].splitlines() or [""]
        wide = raw.startswith((BOM_UTF16_LE, BOM_UTF16_BE)) or raw[:4].count(0) == 2
        what = f"this is {'UTF-16, ' * wide}not plain text"
        place = len(before), len(before[-1]) + 1
        _refuse(
            [Mistake(*place, what, "Save the file as plain text.", before[-1])], path
        )
    return text


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
    package = Path(reference.__file__).parent
    files = [*package.glob("floors/*.txt"), *package.parent.glob("floors/*.txt")]
    return {file.stem: file for file in sorted(files)}


def _unreadable(path: str | PathLike[str], error: OSError) -> OSError:
    return type(error)(f"cannot read {path}: {error.strerror}")
