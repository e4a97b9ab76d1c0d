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
from typing import Any

from reference.workshop.maps.mistakes import WORDS, Mistake

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

    def mistake(self, kind: str, column: int = 1, **facts: Any) -> Mistake:
        """A mistake in this line; kind: a key of WORDS, facts: what they ask for."""
        what, hint = (words.format(**facts) for words in WORDS[kind])
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

    def mistake(self, kind: str, cell: Iterable[int], **facts: Any) -> Mistake:
        """A mistake at a cell: row and column, counted from 0."""
        row, column = map(int, cell)
        return self.rows[row].mistake(kind, column + 1, floor=self.floor + 1, **facts)


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

    def drawing_of(self, floor: int) -> Drawing:
        """The drawing of a floor by its index, once their numbers are read."""
        return next(d for d in self.drawings if floor + 1 in d.numbers)

    @cached_property
    def size(self) -> tuple[int, int]:
        """Columns and rows that the file says, once it does."""
        read = self.settings["size"][0].reads("size")
        return (int(read[1]), int(read[2])) if read else (0, 0)

    @cached_property
    def drawn(self) -> dict[str, int]:
        """Columns and rows of the drawings."""
        columns = max((len(row.code) for row in self.rows), default=30)
        rows = max((len(drawing.rows) for drawing in self.drawings), default=9)
        return {"columns": columns, "rows": rows}


# -- Characters ---------------------------------------------------------------------

_PLAIN = str.maketrans("\u2013\u2014\u2212\u00d7\u00b7\u2022", "---x..")
_LOOKS_LIKE = dict.fromkeys("|-_=/\\*%@", "#") | dict.fromkeys(",:'", ".")
_LOOKS_LIKE["\t"] = " "


def _foreign_signs(page: Page) -> Iterator[Mistake]:
    """The first sign of each line that is not ASCII, also in a note."""
    rows = {row.number for row in page.rows}
    for line in page.lines:
        if found := re.search(r"[^\t -~]", line.written):
            sign, place = found[0], found.start() + 1
            name = unicodedata.name(sign, f"U+{ord(sign):04X}")
            if sign in "\0\ufffd":
                yield line.mistake("not-text", place)
            elif plain := _ascii(sign):
                plain = _LOOKS_LIKE.get(plain, plain) if line.number in rows else plain
                yield line.mistake("foreign-alike", place, name=name, plain=plain)
            else:
                yield line.mistake("foreign", place, name=name)


def _ascii(char: str) -> str:
    """The plain sign that a character looks like, or nothing."""
    if "\u2500" <= char <= "\u25a1":  # lines, blocks and squares to draw walls with
        return "#"
    plain = unicodedata.normalize("NFKD", char.translate(_PLAIN))[0]
    return plain if " " <= plain <= "~" else ""


_WORD = re.compile(r"[A-Za-z0-9]+(?:[_-]+[A-Za-z0-9]+)*|([^ #.+])\1*")
_MEANS = re.compile(r"E*([A-D]*|[a-z][a-z0-9]*)E*")


def _signs(page: Page) -> Iterator[Mistake]:
    """Signs without a meaning, and words that are no room's name."""
    for row in page.rows:
        for found in _WORD.finditer(row.code):
            if not _MEANS.fullmatch(found[0]):
                word, place = found[1] or found[0][:80], found.start() + 1
                sign = "a tab" if word == "\t" else repr(word)
                plain = _LOOKS_LIKE.get(word)
                kind = "sign-alike" if plain else "sign"
                yield row.mistake(kind, place, sign=sign, plain=plain)


# -- Headings and settings ----------------------------------------------------------


def _headings(page: Page) -> Iterator[Mistake]:
    """Headings that nobody can read, and rows without one."""
    floor = 1
    for drawing in page.drawings:
        if drawing.numbers:
            floor = drawing.numbers[-1] + 1
        else:
            kind, facts = _meant(drawing.heading), {"floor": floor, "above": floor + 1}
            yield drawing.heading.mistake(kind, **facts, **page.drawn)
            floor += bool(drawing.rows)
    if not page.drawings:
        yield page.lines[-1].mistake("no-floor")


def _meant(line: Line) -> str:
    """The kind of a mistake in a heading, by what it was meant to be."""
    if not _HEADING.match(line.code):
        return "no-heading"
    word = re.sub(r"[^a-z].*", "", line.code[:20].lstrip().lower())
    return "-".join(["heading", *get_close_matches(word, _READS, 1, 0.75)])


def _settings(page: Page) -> Iterator[Mistake]:
    top = min((d.heading.number for d in page.drawings), default=inf)
    for key, lines in page.settings.items():
        if not lines:
            yield page.lines[0].mistake(f"no-{key}", **page.drawn)
        for line in lines:
            if line is not lines[0] or line.number > top:
                yield line.mistake("setting-again", key=key)
            elif (
                key == "size"
                and not 1 <= min(page.size) <= max(page.size) <= MOST_CELLS
            ):
                yield line.mistake("size-limit", most=MOST_CELLS)


def _floor_numbers(page: Page) -> Iterator[Mistake]:
    """Report the first only: what follows may well be right once it is mended."""
    follows = 1
    for drawing in page.drawings:
        if (first := drawing.numbers[0]) != follows:
            yield drawing.heading.mistake("floor-order", first=first, follows=follows)
            return
        follows = drawing.numbers[-1] + 1
    if follows > MOST_FLOORS + 1:
        yield page.drawings[-1].heading.mistake("floor-limit", most=MOST_FLOORS)


def _blanks(page: Page) -> Iterator[Mistake]:
    blank = {line.number for line in page.lines if not line.written.strip(" \t")}
    for drawing in page.drawings:
        for above, below in pairwise(drawing.rows):
            if between := blank.intersection(range(above.number, below.number)):
                yield page.lines[min(between) - 1].mistake("blank-line")


# -- Shape --------------------------------------------------------------------------


def _shape(page: Page) -> Iterator[Mistake]:
    """Rows that are too wide, lost or doubled, or a size that is wrong altogether."""
    (width, height), (columns, rows) = page.size, page.drawn.values()
    if columns != width and all(len(d.rows) == rows != height for d in page.drawings):
        yield page.settings["size"][0].mistake("size", **page.drawn)
        return
    for row in page.rows:
        if (wide := len(row.code)) > width:
            yield row.mistake("row-width", width + 1, wide=wide, width=width)
    for drawing in page.drawings:
        if (count := len(drawing.rows)) != height:
            line = drawing.rows[height] if count > height else drawing.heading
            yield line.mistake("rows", count=count, height=height)


def stages(page: Page) -> Iterator[Iterable[Mistake]]:
    """What each stage of checks finds, once the stages before find nothing."""
    yield _foreign_signs(page)
    yield _headings(page)
    yield chain(_settings(page), _floor_numbers(page), _blanks(page))
    yield _signs(page)
    yield _shape(page)
