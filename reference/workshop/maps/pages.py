"""A map's file, sorted into lines, whatever is wrong with them.

code     a line without its note and the blanks at its end
heading  a line with a word and a colon, or with a heading's key word; behind a row also
         one of words that names a storey
comment  a line of words behind a mark of another language, such as `# my map`; above
         `building:` or `size:`, where that is the first heading, whatever it says
prose    before a drawing's first row, or behind a blank line, any other line that
         begins with a word; before the first row a ruler, too
row      any other line with code: one row of a drawing
"""

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from difflib import get_close_matches
from functools import cached_property
from itertools import dropwhile, groupby, islice, pairwise
from typing import Any

from reference.floorplan import HEADING_PATTERNS
from reference.workshop.maps.mistakes import MISTAKE_TEXTS, Edit, Mistake
from reference.workshop.maps.signs import Board, read_signs

MOST_FLOORS = 30  # [A1, chosen] ten times the paper's
MOST_CELLS = 200  # [A1, chosen] in a row or a column: five times the paper's
MOST_LINES = 2 * MOST_FLOORS * MOST_CELLS  # [A1, chosen] rows, and as many notes
MOST_SIGNS = MOST_LINES * MOST_CELLS  # [A1, chosen] in a file: no more is read
MOST_EDITS = 5_000  # of one mistake; the others follow in the next round


_HEADING = re.compile(r"\s*((?!.*::)\w[^#.+:]*:|(?i:building|size|floor)\b)")
_PROSE = re.compile(r"\s*([A-Za-z])(?!\1)[A-Za-z](?!.*\.\.)[^#+|=_]*$")
_STOREY = re.compile(r"(?i)\b(?:floor|level|storey|story)\b")
MARK = r"(?:\#{1,3}|//+|--+|%+|/\*+|\*+/|\*)"
_COMMENT = re.compile(
    rf"""\s*{MARK}(?:\s+ | (?=\w+\s+\w))   # with a blank behind it, or two words
    (?=\w)(?=.*([A-Za-z])(?!\1)[A-Za-z])  # a word: two letters that differ
    (?!.*\.\.)[^#+|=_]*""",  # no sign of a drawing
    re.VERBOSE,
)
_TOP_COMMENT = re.compile(
    rf"""\s*(?: \# | //+ | /\*+ | \*+/  # a mark alone
    | {MARK}(?!\s*\.)(?!.*\.\.)(?=.*\w)[^#+]* )""",  # no other wall, no floor
    re.VERBOSE,
)
_RULE = re.compile(rf"\s*{MARK}(?:\s+[-=*~_]+)?")  # among comments: `#`, `# ---`


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

    def mistake(
        self,
        kind: str,
        column: int = 1,
        *,
        edits: Iterable[Edit] = (),
        more: int = 0,
        **facts: Any,
    ) -> Mistake:
        """Make a mistake in this line.

        kind: a key of MISTAKE_TEXTS;  facts: what its words need
        edits: what its hint says first;  more: further places that it stands for
        """
        what, hint = (words.format(**facts) for words in MISTAKE_TEXTS[kind])
        some = tuple(islice(edits, MOST_EDITS))
        return Mistake(self.number, column, what, hint, self.written, more, some)

    def typed(self, new: str | None, start: int = 0, stop: int | None = None) -> Edit:
        """Type something in the place of the line, or of a part; None: take it out."""
        return Edit(
            self.number, start, len(self.written) if stop is None else stop, new
        )

    def above(self, *lines: str) -> Edit:
        """Write lines above this one."""
        return self.typed("".join(f"{line}\n" for line in lines), 0, 0)


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
        first = read[1]
        last = read[2] or first
        return range(int(first), int(last) + 1)

    @property
    def index(self) -> int:
        """Its number less one, or its first number's, once the heading is read."""
        return self.numbers[0] - 1

    def mistake(self, kind: str, cell: Iterable[int], **facts: Any) -> Mistake:
        """Make a mistake at a cell: row and column, counted from 0."""
        row, column = map(int, cell)
        return self.rows[row].mistake(kind, column + 1, floor=self.index + 1, **facts)

    def typed(self, sign: str, cells: Iterable[Iterable[int]]) -> list[Edit]:
        """Type a sign at cells: rows and columns, counted from 0."""
        edits = []
        beyond: dict[int, list[int]] = {}  # of each row, columns behind its ragged end
        for cell in cells:
            row, column = map(int, cell)
            if column < len(self.rows[row].code):
                edits.append(self.rows[row].typed(sign, column, column + 1))
            else:
                beyond.setdefault(row, []).append(column)
        for row, columns in beyond.items():
            end = len(self.rows[row].code)
            new = [sign if n in columns else " " for n in range(end, max(columns) + 1)]
            edits.append(self.rows[row].typed("".join(new), end, end))
        return edits


class Page:
    """The lines of a file, sorted, whatever is wrong with them."""

    def __init__(self, written: Iterable[str]) -> None:
        self.lines = [Line(number, text) for number, text in enumerate(written, 1)]
        self.settings: dict[str, list[Line]] = {"building": [], "size": []}
        self.floors: list[Floor] = []
        self.prose: list[Line] = []
        self.comments = list(_comments(self.lines))
        not_drawn = {line.number for line in self.comments}
        for line in self.lines:
            if line.code and line.number not in not_drawn:
                self._sort(line)

    def _sort(self, line: Line) -> None:
        """Put a line with code where it belongs: a setting, heading, note or row."""
        setting = next((key for key in self.settings if line.reads(key)), "")
        before_rows = not (self.floors and self.floors[-1].rows)
        is_prose = bool(_PROSE.match(line.code))
        is_note = is_prose and (before_rows or self._is_behind_blank(line))
        is_note |= before_rows and _is_ruler(line)
        names_storey = is_prose and not before_rows and _STOREY.search(line.code)
        if setting:
            self.settings[setting].append(line)
        elif _is_heading(line) or names_storey:
            self.floors.append(Floor(line))
        elif is_note:
            self.prose.append(line)
        else:
            if not self.floors:  # no heading yet: the row stands for one
                self.floors.append(Floor(line))
            self.floors[-1].rows.append(line)

    def _is_behind_blank(self, line: Line) -> bool:
        """Whether the line above is blank."""
        above = self.lines[line.number - 2 : line.number - 1]
        return bool(above) and not above[0].written.strip(" \t")

    @property
    def rows(self) -> list[Line]:
        """Rows of all drawings."""
        return [row for floor in self.floors for row in floor.rows]

    def floor_of(self, index: int) -> Floor:
        """Find the drawing of a floor by its index, once their numbers are read."""
        return next(floor for floor in self.floors if index + 1 in floor.numbers)

    @cached_property
    def board(self) -> Board:
        """What is drawn, and what it is meant as."""
        return read_signs([[row.code for row in floor.rows] for floor in self.floors])

    @cached_property
    def rows_of_board(self) -> list[Line]:
        """The line of each of the board's rows; an empty one between drawings."""
        rows = [Line(0, "")]
        for floor in self.floors:
            rows += [*floor.rows, Line(0, "")]
        return rows

    @cached_property
    def size(self) -> tuple[int, int]:
        """Columns and rows that the file says, once it does."""
        read = self.settings["size"][0].reads("size")
        return (int(read[1]), int(read[2])) if read else (0, 0)

    @cached_property
    def drawn(self) -> dict[str, int]:
        """Columns and rows of the drawings."""
        columns = max((len(row.code) for row in self.rows), default=30)
        heights = [self._height_of(floor) for floor in self.floors if floor.rows]
        return {"columns": columns, "rows": max(heights, default=9)}

    def blanks_between(self, above: Line, below: Line) -> list[Line]:
        """Blank lines from one row to another."""
        between = self.lines[above.number : below.number - 1]
        return [line for line in between if not line.written.strip(" \t")]

    def _height_of(self, floor: Floor) -> int:
        """Rows of a drawing; of one part, where blank lines part it into floors.

        Floors are as high as each other, and have walls above and below.
        """
        parts = [[floor.rows[0]]]
        for above, below in pairwise(floor.rows):
            if self.blanks_between(above, below):
                parts.append([])
            parts[-1].append(below)
        alike = len({len(part) for part in parts}) == 1
        if alike and all(is_closed(part) for part in parts):
            return len(parts[0])
        return len(floor.rows)


# -- Comments and headings ----------------------------------------------------------


def _comments(lines: Sequence[Line]) -> Iterator[Line]:
    """Find comments in the way of another language, block by block.

    A row begins with `#` too, but words alone close no room. Between two rows, what
    ends with one letter may still be a row with an exit: `#  lobby  E`.
    """
    start = 0
    top = _top_of(lines)

    def is_comment(line: Line) -> bool:
        """Whether it is one, at the top also a short one."""
        return _reads_as(line, _TOP_COMMENT if line.number < top else _COMMENT)

    def is_marked(line: Line) -> bool:
        """Whether a line may belong to a block of comments."""
        return _reads_as(line, _RULE) or is_comment(line)

    for marked, group in groupby(lines, is_marked):
        block = list(group)
        stop = start + len(block)
        above = _may_draw(lines[start - 1 : start])
        below = _may_draw(lines[stop:][:1])
        start = stop
        if not marked or not any(map(is_comment, block)):
            continue
        if above:
            block = [*dropwhile(_is_wall, block)]
        if below:
            block = [*dropwhile(_is_wall, block[::-1])][::-1]
        is_edge = not (above and below)
        for line in block:
            if is_edge or re.search(r"\w\w\W*$", line.code):
                yield line


def _top_of(lines: Iterable[Line]) -> int:
    """The number of the first heading, if it is a setting: nothing is drawn above."""
    headings = (line for line in lines if any(map(line.reads, HEADING_PATTERNS)))
    first = next(headings, None)
    return first.number if first and not first.reads("floor") else 0


def _reads_as(line: Line, comment: re.Pattern[str]) -> bool:
    """Whether a line that is not too long reads as a kind of comment."""
    return len(line.code) <= 2 * MOST_CELLS and bool(comment.fullmatch(line.code))


def _is_wall(line: Line) -> bool:
    """Whether a line is nothing but walls, as rows at the edge of a drawing are."""
    return not line.code.strip("# \t")


def is_closed(rows: Sequence[Line]) -> bool:
    """Whether rows can be a whole drawing: outer walls above and below, maybe exits."""
    edges = rows[0].code + rows[-1].code
    return len(rows) > 2 and not edges.strip("#E \t")


def _is_ruler(line: Line) -> bool:
    """Whether a line counts columns, digit by digit or in tens: no grid does."""
    words = line.code.split()
    signs = "".join(words)
    if not signs.isdecimal() or len(signs) > 2 * MOST_CELLS:
        return False
    digits = all((int(b) - int(a)) % 10 == 1 for a, b in pairwise(signs))
    numbers = [int(word) for word in words]
    ascending = all(after > before for before, after in pairwise(numbers))
    return digits or len(signs) < 3 or (len(words) > 2 and ascending)


def _may_draw(beside: Sequence[Line]) -> bool:
    """Whether the line beside a block, if there is one, may be a row."""
    return any(line.code and not _is_heading(line) for line in beside)


def _is_heading(line: Line) -> bool:
    """Whether a line says what follows, as well as somebody could write it."""
    return bool(_HEADING.match(line.code)) or heading_meant(line) != "heading"


def heading_meant(line: Line) -> str:
    """The kind of a mistake in a heading, by what it was meant to be."""
    word = re.sub(r"[^a-z].*", "", line.code[:20].lstrip().lower())
    return "-".join(["heading", *get_close_matches(word, HEADING_PATTERNS, 1, 0.75)])
