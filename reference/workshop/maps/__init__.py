"""Maps: find a floor file, explain its mistakes, and build it.

The book's `floorplan` refuses in one line what it cannot read; here a drawing is
checked in stages, and all mistakes of the first stage that finds any are shown with the
line, a caret and one thing to do. Read on in `mistakes` (what one looks like), `pages`
(a file's lines, sorted), `wrapping` (what is around rows), `columns` (tabs and wide
signs), `signs` (what each stands for), `syntax` (how a drawing is written), `semantics`
(what is drawn), `repairs` (doing what hints say).
`generated` draws new maps by lot, with rooms from `dividing`.
"""

import copyreg
import re
from collections.abc import Iterable
from itertools import islice
from os import PathLike
from pathlib import Path

import numpy as np

import reference
from reference import floorplan
from reference.building import Building, build, building_of, is_room, signs_of
from reference.floorplan import Drawing
from reference.navigation import Navigation, navigation_of
from reference.paper import InputError
from reference.rays import Sight, sight_of
from reference.workshop.maps import semantics, syntax
from reference.workshop.maps.mistakes import MOST_MISTAKES, Mistake, MistakesError
from reference.workshop.maps.pages import MOST_LINES, MOST_SIGNS, Line, Page
from reference.workshop.storage.files import open_to_read
from reference.workshop.storage.words import did_you_mean

__all__ = [
    "FINE",
    "FIRST_OF_DRAWN",
    "MOST_LINES",
    "MOST_MISTAKES",
    "MOST_SIGNS",
    "Line",
    "Mistake",
    "MistakesError",
    "Page",
    "drawing_now",
    "find_map",
    "lines_of_plan",
    "load",
    "parse_map",
    "plan_of",
    "read_map",
    "same_cells",
    "shipped_floors",
    "standing",
    "text_of_map",
    "to_text",
]

FIRST_OF_DRAWN = 10  # the number of the first stage that checks what is drawn
FINE = (99, 0)  # beyond all stages


def load(name: str | PathLike[str]) -> Building:
    """Read a floor file by path or shipped name, or a map's text, and build it.

    Its arrays are read-only: whoever loads the same drawing may get the same object.
    Raises MistakesError for mistakes in the drawing, OSError for an unreadable file,
    InputError for what is no text and no path.
    """
    if not isinstance(name, str | PathLike):
        raise InputError(
            "load takes the name of a map that ships, the path of a floor file, or a "
            f"map's text, not {name!r:.60}"
        )
    text = str(name)
    if "\n" in text:  # no path has line ends: it is the map itself
        return build(parse_map(text))
    return build(read_map(find_map(name)))


def drawing_now(name: str | PathLike[str]) -> Drawing | None:
    """Read the drawing that a map's name loads now; None where no file can be read.

    What a pipe held has been read. Raises MistakesError.
    """
    try:
        if Path(name).is_fifo():
            return None
        return load(name).drawing
    except OSError:
        return None


def read_map(path: str | PathLike[str]) -> Drawing:
    """Read the drawing in a file. Raises MistakesError, OSError, InputError."""
    return parse_map(text_of_map(path), str(path))


def text_of_map(path: str | PathLike[str]) -> str:
    """Read the text of a file. Raises OSError if there is none.

    Reads no more than the largest drawing, even from a device without end. Raises
    InputError for a pipe that nobody writes to.
    """
    with open_to_read(Path(path)) as text:
        raw = text.read(MOST_SIGNS + 4)  # with a byte order mark
    if not raw and Path(path).is_fifo():
        raise InputError(f"{path}: is a pipe that nobody writes to. Name a file.")
    return raw.decode("utf-8", "replace")


def parse_map(text: str, path: str = "<text>") -> Drawing:
    """Read the drawing in a text, called `path` in messages. Raises MistakesError."""
    text = text.removeprefix("\ufeff")
    lines = lines_of_plan(text[:MOST_SIGNS])
    if len(text) > MOST_SIGNS or len(lines) > MOST_LINES:
        end = Line(len(lines), lines[-1])
        _refuse([end.mistake("too-long", lines=MOST_LINES, signs=MOST_SIGNS)], path)
    page = Page(lines)
    for stage, mistakes in enumerate(syntax.syntax_stages(page, standing), 1):
        _refuse(mistakes, path, stage)
    drawing = floorplan.parse(text)
    for stage, mistakes in enumerate(
        semantics.semantic_stages(drawing, page), FIRST_OF_DRAWN
    ):
        _refuse(mistakes, path, stage)
    return drawing


def standing(text: str) -> tuple[int, int]:
    """How far a text gets: the stage that finds mistakes and, below 0, how many."""
    try:
        parse_map(text)
    except MistakesError as error:
        return error.standing
    return FINE


def lines_of_plan(text: str) -> list[str]:
    """Split a text into lines. After MOST_LINES of them, the rest is one line."""
    return re.split(r"\r\n?|\n", text.removeprefix("\ufeff"), maxsplit=MOST_LINES)


def _refuse(mistakes: Iterable[Mistake], path: str, stage: int = 0) -> None:
    """Raise MistakesError with the mistakes of a stage, if there are any."""
    # two checks may find the same one
    found = dict.fromkeys(islice(mistakes, MOST_MISTAKES))
    if found:
        # A stable sort: on one line, what is wrong with the head stays before its rows.
        ordered = sorted(found, key=lambda mistake: (mistake.line, mistake.column))
        raise MistakesError(path, ordered, stage)


def find_map(name: str | PathLike[str], also: Iterable[str] = ()) -> Path:
    """Find a floor file by its path, or by the bare name of one that ships.

    also: other words that may be meant, for the message. Raises FileNotFoundError with
    the names that ship, IsADirectoryError for a folder, OSError for no possible path.
    """
    path = Path(name)
    bare = str(name).removesuffix(".txt")
    shipped = shipped_floors()
    # What happens to be called "paper" does not hide the map of that name.
    if str(name) in shipped:
        return shipped[bare]
    if path.exists() and not path.is_dir():
        return path
    if bare in shipped:
        return shipped[bare]
    hint = f"Give the path of one, or a name that ships: {', '.join(shipped)}."
    if str(name) and path.is_dir():
        raise IsADirectoryError(f"'{name}' is a folder, no floor file.\nhint: {hint}")
    raise FileNotFoundError(
        f"there is no floor file '{name}'.{did_you_mean(bare, [*shipped, *also])}\n"
        f"hint: {hint}"
    )


def shipped_floors() -> dict[str, Path]:
    """List the floors that ship, by name: beside the checkout, or in the package."""
    package = Path(reference.__file__).parent
    files = [*package.glob("floors/*.txt"), *package.parent.glob("floors/*.txt")]
    return {file.stem: file for file in sorted(files)}


def same_cells(one: Drawing, other: Drawing) -> bool:
    """Tell whether two drawings are the same but for titles, names and labels.

    Nobody walks, sees, burns or decides by what a room is called.
    """
    mine, theirs = (
        np.where(is_room(signs), ".", signs)
        for signs in (signs_of(one), signs_of(other))
    )
    return np.array_equal(mine, theirs)


def to_text(drawing: Drawing) -> str:
    """Write a drawing as text: `parse_map(to_text(drawing)) == drawing`."""
    text = [
        f"building: {drawing.title}",
        f"size:     {drawing.width} x {drawing.height}",
    ]
    for number, storey in enumerate(drawing.storeys, 1):
        rows = [row.rstrip() or "#" for row in storey.rows]  # alone: all is outside
        text += ["", f"floor {number}: {storey.name}", *rows]
    return "".join(f"{line.rstrip()}\n" for line in text)


def plan_of(building: Building) -> str:
    """Write a building as the text of its floor file."""
    return to_text(building.drawing)


# Copies, and what travels between processes, are what is kept for the same text.
copyreg.pickle(Building, lambda b: (building_of, (plan_of(b),)))
copyreg.pickle(Navigation, lambda nav: (navigation_of, (nav.building,)))
copyreg.pickle(Sight, lambda sight: (sight_of, (sight.building, sight.reach)))
