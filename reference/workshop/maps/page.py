"""Sort the lines of a file: settings, and the headings and rows of its drawings.

Clauses: A1 (how much one may draw).

    code     a line without its note and the blanks at its end
    heading  a line with a key word, a colon and a value
    row      any other line with code: one row of a drawing
"""

import re
from collections.abc import Iterable
from dataclasses import dataclass, field
from difflib import get_close_matches
from functools import cached_property

from reference.workshop.maps.mistakes import Mistake

MOST_FLOORS = 30  # [A1, chosen] ten times the paper's
MOST_CELLS = 200  # [A1, chosen] in a row or a column: five times the paper's
MOST_LINES = 2 * MOST_FLOORS * MOST_CELLS  # [A1, chosen] rows, and as many notes
MOST_SIGNS = MOST_LINES * MOST_CELLS  # [A1, chosen] in a file: no more is read

SETTINGS = ("building:", "size:")
FLOOR_KEY = re.compile(r"floor\s*([0-9]{1,9})(?:\s*-\s*([0-9]{1,9}))?:")
SIZE_VALUE = re.compile(r"([0-9]{1,9})\s*[xX]\s*([0-9]{1,9})")
_HEADING = re.compile(r"\s*(\w[^#.+:]*):\s*(.*)")
_NO_COLON = re.compile(r"\s*([A-Za-z][a-z]{3,})[\s0-9-]\s*+([^#]*)$")


@dataclass(frozen=True)
class Line:
    """A line of the file.

    key    a heading up to its colon, in small letters, or the first word of one that
           lacks the colon; '' for a row
    value  what stands behind the key
    """

    number: int
    written: str

    @cached_property
    def code(self) -> str:
        return self.written.partition(";")[0].rstrip(" \t")

    @cached_property
    def _parts(self) -> tuple[str, str]:
        if heading := _HEADING.match(self.code):
            return heading[1].strip().lower() + ":", heading[2]
        heading = _NO_COLON.match(self.code)
        return (heading[1].lower(), heading[2]) if heading else ("", "")

    @property
    def key(self) -> str:
        return self._parts[0]

    @property
    def value(self) -> str:
        return self._parts[1]

    @property
    def key_word(self) -> str:
        """The key word that a heading begins with, or was probably meant to."""
        word = re.match(r"[a-z]{0,20}", self.key)
        words = ("building", "size", "floor")
        return "".join(get_close_matches(word[0] if word else "", words, 1, 0.75))

    def mistake(self, what: str, hint: str, column: int = 1) -> Mistake:
        """A mistake in this line."""
        return Mistake(self.number, column, what, hint, self.written)

    def mistake_in_value(self, what: str, hint: str) -> Mistake:
        """A mistake behind the colon."""
        return self.mistake(what, hint, len(self.code) - len(self.value) + 1)


@dataclass(frozen=True)
class Drawing:
    """A floor's heading and rows; its numbers are empty where nobody can read them."""

    heading: Line
    rows: list[Line] = field(default_factory=list)

    @cached_property
    def numbers(self) -> range:
        if match := FLOOR_KEY.fullmatch(self.heading.key):
            return range(int(match[1]), int(match[2] or match[1]) + 1)
        return range(0)

    @property
    def floor(self) -> int:
        """Index of its (first) floor, after stage 1."""
        return self.numbers[0] - 1

    def mistake(self, cell: Iterable[int], what: str, hint: str) -> Mistake:
        """A mistake at a cell: row and column, counted from 0."""
        row, column = map(int, cell)
        return self.rows[row].mistake(what, hint, column + 1)


@dataclass(frozen=True)
class Page:
    """The file sorted into its parts; strays: rows before the first heading."""

    lines: list[Line]
    settings: dict[str, list[Line]]
    drawings: list[Drawing]
    strays: list[Line]

    @property
    def rows(self) -> list[Line]:
        """Rows of all drawings."""
        return [row for drawing in self.drawings for row in drawing.rows]

    def drawing_of(self, number: int) -> Drawing:
        """The drawing of a floor, after stage 1."""
        return next(d for d in self.drawings if number in d.numbers)

    @cached_property
    def size(self) -> tuple[int, int]:
        """Columns and rows, after stage 1."""
        columns, rows = SIZE_VALUE.findall(self.settings["size:"][0].value)[0]
        return int(columns), int(rows)

    @cached_property
    def drawn(self) -> tuple[int, int]:
        """Columns and rows of the drawings."""
        width = max((len(row.code) for row in self.rows), default=30)
        return width, max((len(drawing.rows) for drawing in self.drawings), default=9)


def sort(written: Iterable[str]) -> Page:
    """Sort the lines of a file, whatever is wrong with them."""
    lines = [Line(number, text) for number, text in enumerate(written, 1)]
    page = Page(lines, {key: [] for key in SETTINGS}, [], [])
    for line in lines:
        if line.key in SETTINGS:
            page.settings[line.key].append(line)
        elif line.key:
            page.drawings.append(Drawing(line))
        elif line.code:
            (page.drawings[-1].rows if page.drawings else page.strays).append(line)
    return page
