"""Check how a drawing is written: its characters, headings, settings and shape.

code     a line without its note and the blanks at its end
heading  a line with a word and a colon, or with a heading's key word
prose    before a drawing's first row, any other line that begins with a word
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
from typing import Any

import numpy as np
from scipy import ndimage

from reference.floorplan import HEADING_PATTERNS
from reference.workshop.maps.mistakes import MISTAKE_TEXTS, Mistake

MOST_FLOORS = 30  # [A1, chosen] ten times the paper's
MOST_CELLS = 200  # [A1, chosen] in a row or a column: five times the paper's
MOST_LINES = 2 * MOST_FLOORS * MOST_CELLS  # [A1, chosen] rows, and as many notes
MOST_SIGNS = MOST_LINES * MOST_CELLS  # [A1, chosen] in a file: no more is read

# -- A file, sorted -----------------------------------------------------------------

_HEADING = re.compile(r"\s*(\w[^#.+:]*:|(?i:building|size|floor)\b)")
_PROSE = re.compile(r"\s*([A-Za-z])(?!\1)[A-Za-z](?!.*\.\.)[^#+|=_]*$")


@dataclass(frozen=True)
class Line:
    """A line of the file."""

    number: int
    written: str

    @cached_property
    def code(self) -> str:
        """What it draws or says, without its note."""
        return self.written.partition(";")[0].rstrip(" \t")

    def reads(self, key: str) -> re.Match[str] | None:
        """Match a heading with this key word; its groups are the parts."""
        return HEADING_PATTERNS[key].fullmatch(self.code)

    def mistake(self, kind: str, column: int = 1, **facts: Any) -> Mistake:
        """Make a mistake in this line; kind: a key of WORDS, facts: what it needs."""
        what, hint = (words.format(**facts) for words in MISTAKE_TEXTS[kind])
        return Mistake(self.number, column, what, hint, self.written)


@dataclass(frozen=True)
class Floor:
    """A floor's heading and rows; its numbers are empty where nobody can read them.

    Rows before any heading are a drawing too; the first one stands for its heading.
    """

    heading: Line
    rows: list[Line] = field(default_factory=list)

    @property
    def headless(self) -> bool:
        """Whether its first row stands for its heading."""
        return self.heading in self.rows[:1]

    @cached_property
    def numbers(self) -> range:
        """The floors that the drawing stands for, counted from 1."""
        read = self.heading.reads("floor")
        if not read:
            return range(0)
        first, last = read[1], read[2] or read[1]
        return range(int(first), int(last) + 1)

    @property
    def index(self) -> int:
        """Its number less one, or its first number's, once the heading is read."""
        return self.numbers[0] - 1

    def mistake(self, kind: str, cell: Iterable[int], **facts: Any) -> Mistake:
        """Make a mistake at a cell: row and column, counted from 0."""
        row, column = map(int, cell)
        return self.rows[row].mistake(kind, column + 1, floor=self.index + 1, **facts)


class Page:
    """The lines of a file, sorted, whatever is wrong with them."""

    def __init__(self, written: Iterable[str]) -> None:
        self.lines = [Line(number, text) for number, text in enumerate(written, 1)]
        self.settings: dict[str, list[Line]] = {"building": [], "size": []}
        self.floors: list[Floor] = []
        self.prose: list[Line] = []
        for line in self.lines:
            if line.code:
                self._sort(line)

    def _sort(self, line: Line) -> None:
        """Put a line with code where it belongs: a setting, heading, note or row."""
        setting = next((key for key in self.settings if line.reads(key)), "")
        before_rows = not (self.floors and self.floors[-1].rows)
        if setting:
            self.settings[setting].append(line)
        elif _HEADING.match(line.code) or _meant(line) != "heading":
            self.floors.append(Floor(line))
        elif before_rows and _PROSE.match(line.code):
            self.prose.append(line)
        else:
            if not self.floors:  # no heading yet: the row stands for one
                self.floors.append(Floor(line))
            self.floors[-1].rows.append(line)

    @property
    def rows(self) -> list[Line]:
        """Rows of all drawings."""
        return [row for floor in self.floors for row in floor.rows]

    def floor_of(self, index: int) -> Floor:
        """Find the drawing of a floor by its index, once their numbers are read."""
        return next(floor for floor in self.floors if index + 1 in floor.numbers)

    @cached_property
    def size(self) -> tuple[int, int]:
        """Columns and rows that the file says, once it does."""
        read = self.settings["size"][0].reads("size")
        return (int(read[1]), int(read[2])) if read else (0, 0)

    @cached_property
    def drawn(self) -> dict[str, int]:
        """Columns and rows of the drawings."""
        columns = max((len(row.code) for row in self.rows), default=30)
        rows = max((len(floor.rows) for floor in self.floors if floor.rows), default=9)
        return {"columns": columns, "rows": rows}


# -- Characters ---------------------------------------------------------------------

_PLAIN = str.maketrans("\u2013\u2014\u2212\u00d7\u00b7\u2022", "---x..")
_LINES = "|-=\\"  # signs to draw walls with
_NO_SIGN = {"\t": ("sign-alike", " "), "`": ("sign", "")}  # the last: of a listing


def _foreign_signs(page: Page) -> Iterator[Mistake]:
    """Find the first sign of each line that is not ASCII, also in a note."""
    rows = {row.number for row in page.rows}
    for line in page.lines:
        foreign = re.search(r"[^\t -~]", line.written)
        if not foreign:
            continue
        sign = foreign[0]
        place = foreign.start() + 1
        name = unicodedata.name(sign, f"U+{ord(sign):04X}")
        plain = _ascii(sign)
        if plain and plain in _LINES and line.number in rows:
            plain = "#"  # in a drawing a line is a wall
        if sign in "\0\ufffd":
            yield line.mistake("not-text", place)
        elif plain:
            yield line.mistake("foreign-alike", place, name=name, plain=plain)
        else:
            yield line.mistake("foreign", place, name=name)


def _ascii(char: str) -> str:
    """The plain sign that a character looks like, or nothing."""
    if "\u2500" <= char <= "\u25a1":  # lines, blocks and squares to draw walls with
        return "#"
    plain = unicodedata.normalize("NFKD", char.translate(_PLAIN))[0]
    return plain if " " <= plain <= "~" else ""


_WORD = re.compile(r"[a-z]+(?:[_-][a-z0-9]+)+|[A-Za-z0-9]+|([^ #.+])\1*")
_MEANS = re.compile(r"E*([A-D]*|[a-z][a-z0-9]*)E*")


def _signs(page: Page) -> Iterator[Mistake]:
    """Find signs without a meaning, and words that are no room's name.

    A sign at an end of any row is a wall, whatever it is; inside, it is floor.
    """
    rim = {row.code.lstrip()[0] for row in page.rows}
    rim |= {row.code[-1] for row in page.rows}
    for row in page.rows:
        for match in _WORD.finditer(row.code):
            word = match[0]
            one = word[0] if len({*word}) == 1 else ""  # what it repeats, if one sign
            drawn_as_wall = one.islower() and one in rim
            if _MEANS.fullmatch(word) and not drawn_as_wall:
                continue
            kind, plain = _instead(word, one, rim)
            sign = "a tab" if one == "\t" else repr((one or word)[:80])
            yield row.mistake(kind, match.start() + 1, sign=sign, plain=plain)


def _instead(word: str, one: str, rim: set[str]) -> tuple[str, str]:
    """The kind of mistake that a word is, and what to type instead.

    one: the sign that the word repeats, "" for several;  rim: signs at ends of rows
    """
    if one in _NO_SIGN:
        return _NO_SIGN[one]
    if not one:
        small = word.lower()
        return ("sign-name" if _MEANS.fullmatch(small) else "sign"), small
    if one in rim or one in _LINES:
        return "sign-alike", "#"
    return ("sign-capital" if one.isalpha() else "sign-alike"), "."


def _closed_blanks(page: Page) -> Iterator[Mistake]:
    """Find enclosed blanks beside a room; where no room is drawn, all of them."""
    width = max((len(row.code) for row in page.rows), default=0)
    for floor in page.floors:
        rows = ["", *(f" {row.code}" for row in floor.rows), ""]
        signs = np.array([[*row.ljust(width + 2)] for row in rows])
        room = np.char.islower(signs) | (signs == ".")
        parts = ndimage.label(signs == " ")[0]
        outside = 1  # the first part: it has the corner of the rim around the rows
        beside = parts[ndimage.binary_dilation(room)] if room.any() else parts
        for closed in np.unique(beside[beside > outside]):
            row, column = np.argwhere(parts == closed)[0] - 1
            yield floor.rows[row].mistake("blank", int(column) + 1)


# -- Headings and settings ----------------------------------------------------------


def _headings(page: Page) -> Iterator[Mistake]:
    """Find headings that nobody can read."""
    follows = 1
    for floor in page.floors:
        if floor.numbers:
            follows = floor.numbers[-1] + 1
        elif floor.headless:
            follows += 1
        else:
            numbers = {"floor": follows, "above": follows + 1}
            yield floor.heading.mistake(_meant(floor.heading), **numbers, **page.drawn)
            if floor.rows:
                follows += 1
    if not page.floors:
        yield page.lines[-1].mistake("no-floor")


def _head(page: Page) -> Iterator[Mistake]:
    """Find all that is missing above the first row, and lines that are no row."""
    first = page.floors[0]
    missing = []
    if not page.settings["building"]:
        missing.append("building: NAME")
    if not page.settings["size"]:
        missing.append("size: {columns} x {rows}".format(**page.drawn))
    if first.headless:
        missing.append("floor 1:")
    if missing:
        told = ", ".join(f"'{line.partition(':')[0]}:'" for line in missing)
        write = ", ".join(f"'{line}'" for line in missing)
        yield first.heading.mistake("no-head", told=told, write=write)
    for line in page.prose:
        yield line.mistake("prose")


def _meant(line: Line) -> str:
    """The kind of a mistake in a heading, by what it was meant to be."""
    word = re.sub(r"[^a-z].*", "", line.code[:20].lstrip().lower())
    return "-".join(["heading", *get_close_matches(word, HEADING_PATTERNS, 1, 0.75)])


def _settings(page: Page) -> Iterator[Mistake]:
    """Find settings that stand twice or below a floor, and sizes out of range."""
    top = min((floor.heading.number for floor in page.floors), default=inf)
    for key, lines in page.settings.items():
        for line in lines:
            if line is not lines[0] or line.number > top:
                yield line.mistake("setting-again", key=key)
            elif key == "size" and not all(0 < n <= MOST_CELLS for n in page.size):
                yield line.mistake("size-limit", most=MOST_CELLS)


def _floor_numbers(page: Page) -> Iterator[Mistake]:
    """Find the first floor out of order; once it is mended, the next may be right."""
    follows = 1
    for floor in page.floors:
        if floor.headless:  # only the first can be
            follows = 2
            continue
        first = floor.numbers[0]
        if first != follows:
            yield floor.heading.mistake("floor-order", first=first, follows=follows)
            return
        follows = floor.numbers[-1] + 1
    if follows > MOST_FLOORS + 1:
        yield page.floors[-1].heading.mistake("floor-limit", most=MOST_FLOORS)


def _blanks(page: Page) -> Iterator[Mistake]:
    """Find the first blank line between two rows of a drawing."""
    blank = {line.number for line in page.lines if not line.written.strip(" \t")}
    for floor in page.floors:
        for above, below in pairwise(floor.rows):
            between = blank.intersection(range(above.number, below.number))
            if between:
                yield page.lines[min(between) - 1].mistake("blank-line")


# -- Shape --------------------------------------------------------------------------


def _shape(page: Page) -> Iterator[Mistake]:
    """Find rows that are too wide, lost or doubled, or a size that is all wrong."""
    width, height = page.size
    columns, rows = page.drawn["columns"], page.drawn["rows"]
    alike = all(len(floor.rows) == rows for floor in page.floors)
    if columns != width and alike and rows != height:
        yield page.settings["size"][0].mistake("size", **page.drawn)
        return

    for row in page.rows:
        wide = len(row.code)
        if wide > width:
            yield row.mistake("row-width", width + 1, wide=wide, width=width)
    for floor in page.floors:
        count = len(floor.rows)
        if count != height:
            line = floor.rows[height] if count > height else floor.heading
            yield line.mistake("rows", count=count, height=height)


def syntax_stages(page: Page) -> Iterator[Iterable[Mistake]]:
    """Yield what each stage of checks finds, once the stages before find nothing."""
    yield _foreign_signs(page)
    yield _headings(page)
    yield chain(
        _head(page),
        _settings(page),
        _floor_numbers(page),
        _blanks(page),
        _signs(page),
        _closed_blanks(page),
    )
    yield _shape(page)
