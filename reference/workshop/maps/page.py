"""Sort the lines of a file: settings, and the headings and rows of its drawings.

Clauses: A1 (how many floors, rows and columns one may draw).

    code     a line without its note and the blanks at its end
    heading  a line with a key word, a colon and a value
    row      any other line with code: one row of a drawing
"""

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from difflib import get_close_matches
from functools import cached_property
from itertools import chain, starmap

from reference.workshop.maps.mistakes import Mistake

MOST_FLOORS = 30  # [A1, chosen] ten times the paper's
MOST_CELLS = 200  # [A1, chosen] in a row or a column: five times the paper's
MOST_LINES = 2 * MOST_FLOORS * MOST_CELLS  # [A1, chosen] rows, and as many notes
MOST_SIGNS = MOST_LINES * MOST_CELLS  # [A1, chosen] in a file: no more is read
SETTINGS = ("building:", "size:")


@dataclass(frozen=True)
class Line:
    """A line of the file; code: without its note and the blanks at its end."""

    number: int
    written: str

    @cached_property
    def code(self) -> str:
        return self.written.partition(";")[0].rstrip(" \t")

    @cached_property
    def key(self) -> str:
        """A heading up to its colon, if it has one, in small letters; '' for a row."""
        if heading := _HEADING.match(self.code):
            return heading[0][:-1].strip().lower() + ":"
        plain = self.code.strip()
        return plain.lower() if _lacks_colon(plain) else ""

    @cached_property
    def value(self) -> str:
        """What stands behind a heading's colon."""
        return self.code.partition(":")[2].strip()

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
    numbers: range
    rows: list[Line] = field(default_factory=list)

    @property
    def label(self) -> str:
        """`floor 1`, or `floors 2-3` drawn once."""
        first, last = self.numbers[0], self.numbers[-1]
        return f"floor {first}" if first == last else f"floors {first}-{last}"

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
    """The file sorted into its parts.

    strays   rows before the first heading;  whole  False if the file was cut off
    """

    lines: tuple[Line, ...]
    settings: dict[str, list[Line]]
    drawings: list[Drawing]
    strays: list[Line]
    whole: bool

    @property
    def rows(self) -> Iterator[Line]:
        """Rows of all drawings."""
        return chain.from_iterable(drawing.rows for drawing in self.drawings)

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

    @property
    def drawn_size(self) -> str:
        """The size as the drawings have it; '' if it is too large."""
        width, height = self.drawn
        return f"size: {width} x {height}" if max(width, height) <= MOST_CELLS else ""


def sort(text: str) -> Page:
    """Sort the lines of a file, whatever is wrong with them, up to MOST_LINES."""
    line_end = r"\r\n?|\n"  # whichever way the editor ends lines
    written = re.split(line_end, text[:MOST_SIGNS], maxsplit=MOST_LINES + 1)
    lines = tuple(starmap(Line, enumerate(written[: MOST_LINES + 1], 1)))
    whole = len(text) <= MOST_SIGNS and len(lines) <= MOST_LINES
    page = Page(lines, {key: [] for key in SETTINGS}, [], [], whole)
    for line in lines:
        if line.key in SETTINGS:
            page.settings[line.key].append(line)
        elif line.key:
            page.drawings.append(Drawing(line, _numbers(line)))
        elif line.code:
            (page.drawings[-1].rows if page.drawings else page.strays).append(line)
    return page


FLOOR_KEY = re.compile(r"floor\s*([0-9]+)(?:\s*-\s*([0-9]+))?:")
SIZE_VALUE = re.compile(r"([0-9]{1,9})\s*[xX]\s*([0-9]{1,9})")
_HEADING = re.compile(r"\s*\w[^#.+:]*:")


def key_word(text: str) -> str:
    """The key word that the first word of a text is, or was probably meant to be."""
    first = re.match(r"\s*([^\W\d_]{0,20})", text)
    words = ("building", "size", "floor")
    return "".join(get_close_matches(first[1].lower() if first else "", words, 1, 0.75))


def _lacks_colon(code: str) -> bool:
    several = re.match(r"[A-Za-z]+(\s+|[0-9]\s*)\S", code)
    return bool(several and not set(":#") & set(code) and key_word(code))


def _numbers(heading: Line) -> range:
    match = FLOOR_KEY.fullmatch(heading.key)
    first, last = (match[1], match[2] or match[1]) if match else ("1", "0")
    return range(int(first[:9]), int(last[:9]) + 1)  # a tenth digit is too large anyway
