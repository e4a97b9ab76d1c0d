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
from itertools import chain

from reference.floorplan.mistakes import Finding

MOST_FLOORS = 30  # [A1, chosen] ten times the paper's
MOST_CELLS = 400  # [A1, chosen] in a row or a column: ten times the paper's
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
        if heading := _HEADING.match(self._plain):
            return heading[0][:-1].strip().lower() + ":"
        return self._plain.strip().lower() if _lacks_colon(self._plain) else ""

    @cached_property
    def value(self) -> str:
        """What stands behind a heading's colon."""
        return self._plain.partition(":")[2].strip()

    @property
    def _plain(self) -> str:
        """The code with signs that stage 2 will find fault with, as they were meant."""
        return self.code.translate(_ALIKE)

    def finding(self, what: str, hint: str, column: int = 1) -> Finding:
        """A mistake in this line."""
        return self.number, column, what, hint

    def finding_in_value(self, what: str, hint: str) -> Finding:
        """A mistake behind the colon."""
        return self.finding(what, hint, len(self.code) - len(self.value) + 1)


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

    def finding(self, cell: Iterable[int], what: str, hint: str) -> Finding:
        """A mistake at a cell: row and column, counted from 1."""
        row, column = map(int, cell)
        return self.rows[row - 1].finding(what, hint, column)


@dataclass(frozen=True)
class Page:
    """The file sorted into its parts; strays are rows before the first heading."""

    lines: tuple[Line, ...]
    settings: dict[str, list[Line]]
    drawings: list[Drawing]
    strays: list[Line]

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
    def drawn_size(self) -> str:
        """The size as somebody should have written it, judged by the drawings."""
        width = max((len(row.code) for row in self.rows), default=30)
        height = max((len(drawing.rows) for drawing in self.drawings), default=9)
        return f"size: {min(width, MOST_CELLS)} x {min(height, MOST_CELLS)}"


def sort(text: str) -> Page:
    """Sort the lines of a file, whatever is wrong with them."""
    written = re.split(r"\r\n?|\n", text)  # whichever way the editor ends lines
    lines = tuple(Line(number, line) for number, line in enumerate(written, 1))
    page = Page(lines, {key: [] for key in SETTINGS}, [], [])
    for line in lines:
        if line.key in SETTINGS:
            page.settings[line.key].append(line)
        elif line.key:
            page.drawings.append(Drawing(line, _numbers(line)))
        elif line.code:
            (page.drawings[-1].rows if page.drawings else page.strays).append(line)
    return page


FLOOR_KEY = re.compile(r"floor\s*([0-9]{1,4})(?:\s*-\s*([0-9]{1,4}))?:")
SIZE_VALUE = re.compile(r"([0-9]{1,9})\s*[xX]\s*([0-9]{1,9})")
_HEADING = re.compile(r"\s*\w[^#.+:]*:")
_ALIKE = str.maketrans("：–—−×", ":---x")


def key_word(text: str) -> str:
    """The key word that the first word of a text is, or was probably meant to be."""
    first = re.match(r"\s*([^\W\d_]*)", text)
    words = ("building", "size", "floor")
    return "".join(get_close_matches(first[1].lower() if first else "", words, 1, 0.75))


def _lacks_colon(code: str) -> bool:
    several = re.match(r"\s*[A-Za-z]+\s*[\s0-9]\s*\S", code)
    return bool(several and not set(":#") & set(code) and key_word(code))


def _numbers(heading: Line) -> range:
    match = FLOOR_KEY.fullmatch(heading.key)
    return range(int(match[1]), int(match[2] or match[1]) + 1) if match else range(0)
