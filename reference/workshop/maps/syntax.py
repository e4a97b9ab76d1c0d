"""Check how a drawing is written: its characters, headings, settings and shape.

Clauses: A1 (how many floors, rows and columns one may draw).

    code     a line without its note and the blanks at its end
    heading  a line with a word and a colon, or one that was meant to be so
    row      any other line with code: one row of a drawing
"""

import re
import unicodedata
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from difflib import get_close_matches
from functools import cached_property
from itertools import chain, pairwise
from math import inf

from reference.workshop.maps.mistakes import Mistake

MOST_FLOORS = 30  # [A1, chosen] ten times the paper's
MOST_CELLS = 200  # [A1, chosen] in a row or a column: five times the paper's
MOST_LINES = 2 * MOST_FLOORS * MOST_CELLS  # [A1, chosen] rows, and as many notes
MOST_SIGNS = MOST_LINES * MOST_CELLS  # [A1, chosen] in a file: no more is read

# -- A file, sorted -----------------------------------------------------------------

_HEADING = re.compile(r"\s*(\w[^#.+:]*:|[A-Za-z][a-z]{3,}[\s0-9-][^#]*$)")
_READS = {
    "building": re.compile(r"(?i)\s*building\s*:\s*\S.*"),
    "size": re.compile(r"(?i)\s*size\s*:\s*0*(\d{1,4})\s*x\s*0*(\d{1,4})"),
    "floor": re.compile(r"(?i)\s*floor\s*0*(\d{1,2})(?:\s*-\s*0*(\d{1,2}))?\s*:.*"),
}


@dataclass(frozen=True)
class Line:
    """A line of the file."""

    number: int
    written: str

    @cached_property
    def code(self) -> str:
        return self.written.partition(";")[0].rstrip(" \t")

    def reads(self, key: str) -> re.Match[str] | None:
        """The parts of a heading with this key word."""
        return _READS[key].fullmatch(self.code)

    def mistake(self, what: str, hint: str, column: int = 1) -> Mistake:
        """A mistake in this line."""
        return Mistake(self.number, column, what, hint, self.written)


@dataclass(frozen=True)
class Drawing:
    """A floor's heading and rows; its numbers are empty where nobody can read them."""

    heading: Line
    rows: list[Line] = field(default_factory=list)

    @cached_property
    def numbers(self) -> range:
        if read := self.heading.reads("floor"):
            return range(int(read[1]), int(read[2] or read[1]) + 1)
        return range(0)

    @property
    def floor(self) -> int:
        """Index of its (first) floor, once its number is read."""
        return self.numbers[0] - 1

    def mistake(self, cell: Iterable[int], what: str, hint: str) -> Mistake:
        """A mistake at a cell: row and column, counted from 0."""
        row, column = map(int, cell)
        return self.rows[row].mistake(what, hint, column + 1)


class Page:
    """The lines of a file, sorted, whatever is wrong with them: settings by key word.

    Rows before any heading are a drawing too; the first one stands for its heading.
    """

    def __init__(self, written: Iterable[str]) -> None:
        self.lines = [Line(number, text) for number, text in enumerate(written, 1)]
        self.settings: dict[str, list[Line]] = {"building": [], "size": []}
        self.drawings: list[Drawing] = []
        for line in filter(lambda line: line.code, self.lines):
            if said := next(filter(line.reads, self.settings), ""):
                self.settings[said].append(line)
            elif _HEADING.match(line.code) or not self.drawings:
                self.drawings.append(Drawing(line))
            else:
                self.drawings[-1].rows.append(line)

    @property
    def rows(self) -> list[Line]:
        """Rows of all drawings."""
        return [row for drawing in self.drawings for row in drawing.rows]

    def drawing_of(self, number: int) -> Drawing:
        """The drawing of a floor, once their numbers are read."""
        return next(d for d in self.drawings if number in d.numbers)

    @cached_property
    def size(self) -> tuple[int, int]:
        """Columns and rows that the file says, once it does."""
        read = self.settings["size"][0].reads("size")
        return (int(read[1]), int(read[2])) if read else (0, 0)

    @cached_property
    def drawn(self) -> tuple[int, int]:
        """Columns and rows of the drawings."""
        width = max((len(row.code) for row in self.rows), default=30)
        return width, max((len(drawing.rows) for drawing in self.drawings), default=9)

    def advice(self, key: str, floor: int = 1) -> str:
        """How to write a heading; floor: the number that one of a floor should have."""
        width, height = self.drawn
        size = f"Write 'size: {width} x {height}'."
        if max(width, height) > MOST_CELLS:
            size = f"Draw at most {MOST_CELLS} columns and {MOST_CELLS} rows."
        alike = f"'floor {floor}-{floor + 1}:' for floors that are alike"
        return {
            "building": "Write 'building: NAME'.",
            "size": size,
            "floor": f"Write 'floor {floor}: NAME', or {alike}.",
            "": f"Type ';' in front of a note, or write 'floor {floor}:' for a floor.",
        }[key]


# -- Characters ---------------------------------------------------------------------

_PLAIN = str.maketrans("\u2013\u2014\u2212\u00d7\u00b7\u2022", "---x..")
_LOOKS_LIKE = dict.fromkeys("|-_=/\\*%@", "#") | dict.fromkeys(",:'", ".")
_LOOKS_LIKE["\t"] = " "


def _foreign_signs(page: Page) -> Iterator[Mistake]:
    """The first sign of each line that is not ASCII, also in a note."""
    rows = {row.number for row in page.rows}
    for line in page.lines:
        if found := re.search(r"[^\t -~]", line.written):
            sign = found[0]
            name = unicodedata.name(sign, f"U+{ord(sign):04X}")
            what, hint = f"{name} is not a plain ASCII sign", "Take it out."
            if sign in "\0\ufffd":
                what, hint = "this is not plain text", "Save the file as plain text."
            elif plain := _ascii(sign):
                plain = _LOOKS_LIKE.get(plain, plain) if line.number in rows else plain
                hint = f"Type {plain!r} instead."
            yield line.mistake(what, hint, found.start() + 1)


def _ascii(char: str) -> str:
    """The plain sign that a character looks like, or nothing."""
    if "\u2500" <= char <= "\u25a1":  # lines, blocks and squares to draw walls with
        return "#"
    plain = unicodedata.normalize("NFKD", char.translate(_PLAIN))[0]
    return plain if " " <= plain <= "~" else ""


_WORD = re.compile(r"[A-Za-z0-9]+(?:[_-]+[A-Za-z0-9]+)*+|([^ #.+])\1*+")
_MEANS = re.compile(r"E*([A-D]*|[a-z][a-z0-9]*)E*")
_MEANINGS = "Use '#', '.', '+', 'E', 'A' to 'D', blanks and names such as 'lab2'."


def _signs(page: Page) -> Iterator[Mistake]:
    """Signs without a meaning, and words that are no room's name."""
    for row in page.rows:
        for found in _WORD.finditer(row.code):
            if not _MEANS.fullmatch(found[0]):
                sign = found[0][:80] if found[1] is None else found[1]
                what = "a tab" if sign == "\t" else repr(sign)
                alike = _LOOKS_LIKE.get(sign)
                hint = f"Type {alike!r} instead." if alike else _MEANINGS
                what += " has no meaning in a drawing"
                yield row.mistake(what, hint, found.start() + 1)


# -- Headings and settings ----------------------------------------------------------


def _headings(page: Page) -> Iterator[Mistake]:
    """Headings that nobody can read, and rows without one."""
    floor = 1
    for drawing in page.drawings:
        line = drawing.heading
        if not drawing.numbers:
            word = str(re.sub(r"[^a-z].*", "", line.code[:20].lstrip().lower()))
            meant = "".join(get_close_matches(word, _READS, 1, 0.75))
            what = "this row stands before any floor"
            if _HEADING.match(line.code):
                what = "this heading cannot be read"
                what += f"; did you mean '{meant}:'?" if meant not in ("", word) else ""
            yield line.mistake(what, page.advice(meant, floor))
        floor = (
            drawing.numbers[-1] + 1 if drawing.numbers else floor + bool(drawing.rows)
        )
    if not page.drawings:
        hint = "Write 'building: NAME', 'size: 30 x 9', 'floor 1:' and a drawing."
        yield page.lines[-1].mistake("no floor is drawn", hint)


def _settings(page: Page) -> Iterator[Mistake]:
    top = min((d.heading.number for d in page.drawings), default=inf)
    for key, lines in page.settings.items():
        if not lines:
            yield page.lines[0].mistake(f"no line says '{key}:'", page.advice(key))
        for line in lines:
            if line is not lines[0] or line.number > top:
                what = f"'{key}:' is written once, above the first floor"
                yield line.mistake(what, "Move this line up, or take it out.")
            elif key == "size" and not (
                min(page.size) and max(page.size) <= MOST_CELLS
            ):
                what = f"a floor has 1 to {MOST_CELLS} columns and as many rows"
                yield line.mistake(what, page.advice(key))


def _floor_numbers(page: Page) -> Iterator[Mistake]:
    """Report the first only: what follows may well be right once it is mended."""
    follows = 1
    for drawing in page.drawings:
        if (first := drawing.numbers[0]) != follows:
            what = f"floor {first} stands where floor {follows} is expected"
            hint = f"Write 'floor {follows}:', or draw that one above this line."
            yield drawing.heading.mistake(what, hint)
            return
        follows = drawing.numbers[-1] + 1
    if follows > MOST_FLOORS + 1:
        what = f"a building has at most {MOST_FLOORS} floors"
        yield page.drawings[-1].heading.mistake(what, "Draw fewer floors.")


def _blanks(page: Page) -> Iterator[Mistake]:
    blank = {line.number for line in page.lines if not line.written.strip(" \t")}
    for drawing in page.drawings:
        for above, below in pairwise(drawing.rows):
            if between := blank.intersection(range(above.number, below.number)):
                hint = "Take it out, or write a heading such as 'floor 2:' here."
                line = page.lines[min(between) - 1]
                yield line.mistake("a blank line cuts this drawing in two", hint)


# -- Shape --------------------------------------------------------------------------


def _shape(page: Page) -> Iterator[Mistake]:
    """Rows that are too wide, lost or doubled, or a size that is wrong altogether."""
    (width, height), (columns, rows) = page.size, page.drawn
    if columns != width and all(len(d.rows) == rows != height for d in page.drawings):
        what = f"{columns} columns and {rows} rows are drawn"
        yield page.settings["size"][0].mistake(what, page.advice("size"))
        return
    for row in page.rows:
        if (wide := len(row.code)) > width:
            what = f"this row has {wide} columns, the size says {width}"
            yield row.mistake(what, "Shorten it, or change the size.", width + 1)
    for drawing in page.drawings:
        if (count := len(drawing.rows)) != height:
            what = f"this drawing has {count} rows, the size says {height}"
            line = drawing.rows[height] if count > height else drawing.heading
            yield line.mistake(what, f"Draw {height} rows, or change the size.")


def stages(page: Page) -> Iterator[Iterable[Mistake]]:
    """What each stage of checks finds, once the stages before find nothing."""
    yield _foreign_signs(page)
    yield _headings(page)
    yield chain(_settings(page), _floor_numbers(page), _blanks(page))
    yield _signs(page)
    yield _shape(page)
