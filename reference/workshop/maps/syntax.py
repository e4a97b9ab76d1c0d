"""Check how a drawing is written: its characters, headings, settings and shape.

code     a line without its note and the blanks at its end
heading  a line with a word and a colon, or with a heading's key word
comment  a line of words behind a mark of another language, such as `# my map`
prose    before a drawing's first row, any other line that begins with a word
row      any other line with code: one row of a drawing
"""

import re
import unicodedata
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from difflib import get_close_matches
from functools import cached_property, partial
from itertools import (
    accumulate,
    chain,
    dropwhile,
    groupby,
    islice,
    pairwise,
    zip_longest,
)
from math import inf
from typing import Any

import numpy as np
from scipy import ndimage

from reference.floorplan import HEADING_PATTERNS
from reference.workshop.maps.mistakes import MISTAKE_TEXTS, Edit, Mistake
from reference.workshop.maps.signs import (
    Board,
    ascii_of,
    changes,
    has_no_width,
    is_wide,
    read_signs,
    rim_of,
)
from reference.workshop.maps.wrapping import find_wrapping

MOST_FLOORS = 30  # [A1, chosen] ten times the paper's
MOST_CELLS = 200  # [A1, chosen] in a row or a column: five times the paper's
MOST_LINES = 2 * MOST_FLOORS * MOST_CELLS  # [A1, chosen] rows, and as many notes
MOST_SIGNS = MOST_LINES * MOST_CELLS  # [A1, chosen] in a file: no more is read
MOST_EDITS = 5_000  # of one mistake; the others follow in the next round

# -- A file, sorted -----------------------------------------------------------------

_HEADING = re.compile(r"\s*((?!.*::)\w[^#.+:]*:|(?i:building|size|floor)\b)")
_PROSE = re.compile(r"\s*([A-Za-z])(?!\1)[A-Za-z](?!.*\.\.)[^#+|=_]*$")
_MARK = r"(?:\#{1,3}|//+|--+|%+|\*)"
_COMMENT = re.compile(
    rf"""\s*{_MARK}(?:\s+ | (?=\w+\s+\w))   # with a blank behind it, or two words
    (?=\w)(?=.*([A-Za-z])(?!\1)[A-Za-z])  # a word: two letters that differ
    (?!.*\.\.)[^#+|=_]*""",  # no sign of a drawing
    re.VERBOSE,
)
_RULE = re.compile(rf"\s*{_MARK}(?:\s+[-=*~_]+)?")  # among comments: `#`, `# ---`


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
        if setting:
            self.settings[setting].append(line)
        elif _is_heading(line):
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
        rows = max((len(floor.rows) for floor in self.floors if floor.rows), default=9)
        return {"columns": columns, "rows": rows}


# -- Comments -----------------------------------------------------------------------


def _comments(lines: Sequence[Line]) -> Iterator[Line]:
    """Find comments in the way of another language, block by block.

    A row begins with `#` too, but words alone close no room. Between two rows, what
    ends with one letter may still be a row with an exit: `#  lobby  E`.
    """
    start = 0
    for is_marked, group in groupby(lines, _is_marked):
        block = list(group)
        stop = start + len(block)
        above, below = _may_draw(lines[start - 1 : start]), _may_draw(lines[stop:][:1])
        start = stop
        if not is_marked or not any(_is_comment(line) for line in block):
            continue
        if above:
            block = [*dropwhile(_is_wall, block)]
        if below:
            block = [*dropwhile(_is_wall, block[::-1])][::-1]
        is_edge = not (above and below)
        for line in block:
            if is_edge or re.search(r"\w\w\W*$", line.code):
                yield line


def _is_marked(line: Line) -> bool:
    """Whether a line may belong to a block of comments."""
    rule = len(line.code) <= 2 * MOST_CELLS and _RULE.fullmatch(line.code)
    return bool(rule) or _is_comment(line)


def _is_comment(line: Line) -> bool:
    """Whether a line is made of words behind a mark."""
    is_short = len(line.code) <= 2 * MOST_CELLS
    return is_short and bool(_COMMENT.fullmatch(line.code))


def _is_wall(line: Line) -> bool:
    """Whether a line is nothing but walls, as rows at the edge of a drawing are."""
    return not line.code.strip("# \t")


def _may_draw(beside: Sequence[Line]) -> bool:
    """Whether the line beside a block, if there is one, may be a row."""
    return any(line.code and not _is_heading(line) for line in beside)


def _comment(line: Line) -> Mistake:
    """Make the mistake of a comment."""
    start, stop = next(re.finditer(_MARK, line.code)).span()
    is_apart = line.code[stop : stop + 1] in ("", " ", "\t")
    edit = line.typed(";" if is_apart else "; ", start, stop)
    return line.mistake("comment", start + 1, mark=line.code[start:stop], edits=[edit])


# -- Around rows --------------------------------------------------------------------


def _wrapping(page: Page) -> Iterator[Mistake]:
    """Find what stands around rows and between signs, once; and lines of a listing."""
    found = find_wrapping([line.written for line in page.lines])
    for index in found.listing:
        line = page.lines[index]
        yield line.mistake("listing", edits=[line.typed(None)])
    if found.bare:
        edits = (page.lines[index].typed(bare) for index, bare in found.bare.items())
        first = page.lines[min(found.bare)]
        words = ", and ".join(found.words)
        yield first.mistake("wrapping", words=words, edits=edits)


def _longest(page: Page) -> Iterator[Mistake]:
    """Find the first row that no size allows, long before any table is made of it."""
    for row in page.rows:
        if len(row.code) > 2 * MOST_CELLS:
            yield row.mistake("row-limit", most=MOST_CELLS)
            return


# -- Characters ---------------------------------------------------------------------


def _foreign_signs(page: Page) -> Iterator[Mistake]:
    """Find what is not ASCII in headings and notes, and what shifts a row.

    Other signs of rows are explained by where they stand.
    """
    rows = {row.number for row in page.rows}
    for line in page.lines:
        code = len(line.code) if line.number in rows else 0
        for foreign in re.finditer(r"[^\t -~]", line.written):
            sign = foreign[0]
            start = foreign.start()
            if sign in "\0\ufffd":
                yield line.mistake("not-text", start + 1)
                return
            if start < code and not has_no_width(sign):
                continue
            plain = "" if has_no_width(sign) else ascii_of(sign)
            yield line.mistake(
                "foreign-alike" if plain else "foreign",
                start + 1,
                name=unicodedata.name(sign, f"U+{ord(sign):04X}"),
                plain=plain,
                edits=[line.typed(plain, start, start + 1)],
            )


Standing = Callable[[str], tuple[int, int]]
"""How far a text gets: the more, the better."""


def _merit(
    page: Page, standing: Standing, rows: Iterable[Line], read: Callable[[str], str]
) -> tuple[int, int, int]:
    """How far the map gets if these rows are read so, and less than 0: open walls."""
    new = {row.number: read(row.code) for row in rows}
    lines = [new.get(line.number, line.written) for line in page.lines]
    return *standing("\n".join(lines)), -_open_walls(Page(lines).board)


def _open_walls(board: Board) -> int:
    """How many cells of walls end there: they have at most one other beside them."""
    wall = np.isin(board.plain, ["#", "+", "E"]).astype(int)
    beside = sum(np.roll(wall, step, axis) for step in (1, -1) for axis in (0, 1))
    return int((wall * (beside < 2)).sum())


def _wide_signs(page: Page, standing: Standing) -> Iterator[Mistake]:
    """Find signs that stand for two columns, as a terminal shows them: a room's name.

    Where the map gets as far with one column for each, or most rows have them, each
    is a cell, and explained by where it stands.
    """
    foreign = [row for row in page.rows if not row.code.isascii()]
    rows = [row for row in foreign if any(map(is_wide, row.code))]
    if not 0 < 2 * len(rows) < len(page.rows):
        return
    two, one = (
        _merit(page, standing, rows, partial(_plain_row, columns)) for columns in (2, 1)
    )
    if two <= one:
        return
    for row in rows:
        for start, run in _wide_runs(row.code):
            plain = _plain_run(2, run)
            name = unicodedata.name(run[0], f"U+{ord(run[0]):04X}")
            edits = [row.typed(plain, start, start + len(run))]
            yield row.mistake(
                "foreign-wide", start + 1, name=name, plain=plain, edits=edits
            )


def _wide_runs(code: str) -> Iterator[tuple[int, str]]:
    """Wide signs side by side: where they begin, and which."""
    start = 0
    for wide, group in groupby(code, is_wide):
        run = "".join(group)
        if wide:
            yield start, run
        start += len(run)


def _plain_row(columns: int, code: str) -> str:
    """A row with so many columns of plain signs for each wide one."""
    for start, run in [*_wide_runs(code)][::-1]:
        code = code[:start] + _plain_run(columns, run) + code[start + len(run) :]
    return code


def _plain_run(columns: int, run: str) -> str:
    """What wide signs stand for: floor, unless they look like plain ones."""
    plain = "".join(ascii_of(sign) or "." for sign in run)
    if plain[0].islower() and plain.isalnum():
        return plain.ljust(columns * len(run), ".")
    return "".join(columns * sign for sign in plain)


TAB_WIDTHS = (4, 8, 2, 3)  # columns between two stops, the most frequent first


def _tabs(page: Page, standing: Standing) -> Iterator[Mistake]:
    """Find tabs in rows; those signs replace them with which the map gets farthest.

    Either tabs end at stops of one width, as in an editor, or each row is filled up
    to the usual length. Of two that get as far, the one that leaves fewer walls open.
    """
    tabbed = [row for row in page.rows if "\t" in row.code]
    if not tabbed:
        return
    lengths = Counter(len(row.code) for row in page.rows if "\t" not in row.code)
    usual = lengths.most_common(1)[0][0] if lengths else 0

    def merit(counts: Callable[[str], list[int]]) -> tuple[int, int, int]:
        """How far the map gets if tabs are read so."""
        return _merit(page, standing, tabbed, lambda code: _filled(code, counts(code)))

    readings = [partial(_to_stops, width) for width in TAB_WIDTHS]
    best = max([*readings, partial(_to_length, usual)], key=merit)
    for row in tabbed:
        places = [place for place, sign in enumerate(row.code) if sign == "\t"]
        for place, count in zip(places, best(row.code), strict=True):
            plain = count * _around_tab(row.code, place)
            yield row.mistake(
                "tab" if count else "tab-alone",
                place + 1,
                plain=plain,
                edits=[row.typed(plain, place, place + 1)],
            )


def _to_stops(width: int, code: str) -> list[int]:
    """How many columns each tab of a row takes, with a stop at every `width`."""
    counts = []
    column = 0
    for sign in code:
        columns = width - column % width if sign == "\t" else 1
        column += columns
        if sign == "\t":
            counts.append(columns)
    return counts


def _to_length(usual: int, code: str) -> list[int]:
    """How many columns each tab takes if together they make a row as long as usual."""
    tabs = code.count("\t")
    lost = usual - len(code) + tabs
    share, rest = divmod(max(0, min(lost, MOST_CELLS)), tabs)
    return [share + (number < rest) for number in range(tabs)]


def _filled(code: str, counts: Iterable[int]) -> str:
    """A row with so many signs instead of each tab."""
    left = iter(counts)
    signs = (
        next(left) * _around_tab(code, place) if sign == "\t" else sign
        for place, sign in enumerate(code)
    )
    return "".join(signs)


def _around_tab(code: str, place: int) -> str:
    """What a tab stands for: outside, floor, or wall."""
    before = code[:place].strip()
    behind = code[place:].strip()
    if not before:
        return " "
    return "#" if before[-1] in "#|" and behind[:1] in "#|" else "."


_WORD = re.compile(r"[a-z]+(?:[_-][a-z0-9]+)+|[A-Za-z0-9]+|([^ #.+])\1*")
_MEANS = re.compile(r"E*([A-D]*|[a-z][a-z0-9]*)E*")


def _signs(page: Page) -> Iterator[Mistake]:
    """Find signs without a meaning, blanks in rooms, and words that are no name."""
    board = page.board
    rows = page.rows_of_board
    spaced = dict(_two_words(board))
    for sign, plain, cells in changes(board):
        if sign == " ":
            yield from _closed_blanks(board, rows, plain, cells, spaced)
        else:
            yield _sign(rows, sign, plain, cells)
    for (row, start), words in spaced.items():
        name = words.replace(" ", "")
        new = name.ljust(len(words), ".")
        edits = [rows[row].typed(new, start - 1, start - 1 + len(words))]
        yield rows[row].mistake("two-words", start, words=words, name=name, edits=edits)
    yield from _words(board, rows)


def _sign(rows: Sequence[Line], sign: str, plain: str, cells: np.ndarray) -> Mistake:
    """Make the mistake of a sign: all its places at once."""
    row, column = cells[0].tolist()
    edits = (
        rows[at].typed(plain * n, start - 1, start - 1 + n)
        for at, start, n in _runs(cells)
    )
    facts = {"plain": plain, "more": len(_ends_of_runs(cells)), "edits": edits}
    if sign > "~":
        name = unicodedata.name(sign, f"U+{ord(sign):04X}")
        return rows[row].mistake("foreign-alike", column, name=name, **facts)
    kind = "sign-alike"
    if sign.isalnum():
        kind = {"#": "letter-wall", "+": "letter-door", "E": "letter-exit"}.get(
            plain, "letter-floor" if plain == "." else "letter-stairwell"
        )
    return rows[row].mistake(kind, column, sign=repr(sign), **facts)


def _runs(cells: np.ndarray) -> Iterator[tuple[int, int, int]]:
    """Cells side by side as a row, a first column, and how many."""
    ends = _ends_of_runs(cells)
    starts = np.r_[0, ends]
    counts = np.diff(np.r_[starts, len(cells)])
    for start, count in zip(starts[: MOST_EDITS + 1], counts, strict=False):
        yield int(cells[start, 0]), int(cells[start, 1]), int(count)


def _ends_of_runs(cells: np.ndarray) -> np.ndarray:
    """Where one run ends and another begins."""
    apart = (np.diff(cells[:, 0]) != 0) | (np.diff(cells[:, 1]) != 1)
    return np.flatnonzero(apart) + 1


def _two_words(board: Board) -> Iterator[tuple[tuple[int, int], str]]:
    """Find words with a blank between them, in a room: the place, and the words."""
    spaced = re.compile(r"[a-zA-Z][a-zA-Z0-9]+(?: [a-zA-Z0-9]{2,})+")
    signs = np.where(board.drawn == " ", " ", board.plain)
    for row in np.flatnonzero((board.drawn == " ").any(axis=1)):
        for words in spaced.finditer("".join(signs[row])):
            between = [
                words.start() + n for n, sign in enumerate(words[0]) if sign == " "
            ]
            if (board.plain[row, between] != " ").all():
                yield (int(row), words.start()), words[0].lower()


def _closed_blanks(
    board: Board,
    rows: Sequence[Line],
    plain: str,
    cells: np.ndarray,
    spaced: dict[tuple[int, int], str],
) -> Iterator[Mistake]:
    """Find enclosed blanks, part by part, but for those between two words."""
    here = np.zeros(board.drawn.shape, bool)
    here[*cells.T] = True
    for (row, start), words in spaced.items():
        here[row, start : start + len(words)] = False
    parts, _ = ndimage.label(here)
    where = np.argwhere(here)
    order = np.argsort(parts[*where.T], kind="stable")
    where = where[order]
    cuts = np.flatnonzero(np.diff(parts[*where.T])) + 1
    kind = "blank-wall" if plain == "#" else "blank"
    for part in np.split(where, cuts):
        if len(part):
            row, column = part[0].tolist()
            edits = (
                rows[at].typed(plain * n, start - 1, start - 1 + n)
                for at, start, n in _runs(part)
            )
            yield rows[row].mistake(kind, column, edits=edits)


def _words(board: Board, rows: Sequence[Line]) -> Iterator[Mistake]:
    """Find words that are no room's name."""
    rim = rim_of(board)
    for number, row in enumerate(rows):
        text = "".join(board.plain[number]) if row else ""
        for match in _WORD.finditer(text):
            word = match[0]
            place = match.start()
            capital = re.match(r"E(?=[a-z])", word) and not rim[number, place]
            if _MEANS.fullmatch(word) and not capital:
                continue
            name = _name_for(word)
            edits = [row.typed(name.ljust(len(word), "."), place - 1, match.end() - 1)]
            facts: dict[str, Any] = {"sign": repr(word[:80]), "name": name[:80]}
            yield row.mistake("sign-name", place, edits=edits, **facts)


def _name_for(word: str) -> str:
    """The name that a word was meant as: small letters, digits behind them."""
    signs = [sign for sign in word.lower() if sign.isalnum()]
    letters = "".join(sign for sign in signs if sign.isalpha())
    digits = "".join(sign for sign in signs if sign.isdigit())
    if word[0].isalpha():
        return "".join(signs)
    if letters:
        return letters + digits
    return f"r{digits[1:]}" if len(digits) > 1 else "abcdefghij"[int(digits or 0)]


# -- Headings and settings ----------------------------------------------------------

_SIZE = "size: {columns} x {rows}"


def _headings(page: Page) -> Iterator[Mistake]:
    """Find headings that nobody can read, and comments."""
    for line in page.comments:
        yield _comment(line)
    follows = 1
    previous: Floor | None = None
    for floor in page.floors:
        if floor.numbers:
            follows = floor.numbers[-1] + 1
        elif floor.headless:
            follows += 1
        else:
            draws = bool(floor.rows) and (previous is None or bool(previous.rows))
            yield _heading(page, floor, follows, draws=draws)
            if floor.rows:
                follows += 1
        previous = floor
    if not page.floors:
        yield page.lines[-1].mistake("no-floor")


def _heading(page: Page, floor: Floor, follows: int, *, draws: bool) -> Mistake:
    """Make the mistake of a heading; draws: whether a drawing needs it."""
    line = floor.heading
    kind = _meant(line)
    words = re.sub(r"(?i)^\W*(\w+\s*[\d-]*\s*:|\w+)\s*:?", "", line.code).strip(" :")
    facts = {"floor": follows, "above": follows + 1, **page.drawn}
    new = {
        "heading-building": f"building: {words or 'NAME'}",
        "heading-size": _SIZE.format(**page.drawn),
        "heading-floor": f"floor {follows}: {words}".rstrip(),
    }.get(kind, f"; {line.written}")
    if kind == "heading" and draws:
        kind = "heading-drawing"
        new = f"floor {follows}: {line.code.strip(' :')}"
    return line.mistake(kind, edits=[line.typed(new)], **facts)


def _head(page: Page) -> Iterator[Mistake]:
    """Find all that is missing above the first row, and lines that are no row."""
    first = page.floors[0]
    missing = []
    if not page.settings["building"]:
        missing.append("building: NAME")
    if not page.settings["size"]:
        missing.append(_SIZE.format(**page.drawn))
    if first.headless:
        missing.append("floor 1:")
    if missing:
        told = ", ".join(f"'{line.partition(':')[0]}:'" for line in missing)
        write = ", ".join(f"'{line}'" for line in missing)
        top = first.heading.above(*missing)
        yield first.heading.mistake("no-head", told=told, write=write, edits=[top])
    for line in page.prose:
        yield line.mistake("prose", edits=[line.typed("; ", 0, 0)])


def _is_heading(line: Line) -> bool:
    """Whether a line says what follows, as well as somebody could write it."""
    return bool(_HEADING.match(line.code)) or _meant(line) != "heading"


def _meant(line: Line) -> str:
    """The kind of a mistake in a heading, by what it was meant to be."""
    word = re.sub(r"[^a-z].*", "", line.code[:20].lstrip().lower())
    return "-".join(["heading", *get_close_matches(word, HEADING_PATTERNS, 1, 0.75)])


def _settings(page: Page) -> Iterator[Mistake]:
    """Find settings that stand twice or below a floor, and sizes out of range."""
    top = min((floor.heading.number for floor in page.floors), default=inf)
    for key, lines in page.settings.items():
        for line in lines:
            if line is not lines[0]:
                yield line.mistake("setting-again", key=key, edits=[line.typed(None)])
            elif line.number > top:
                moved = page.floors[0].heading.above(line.code)
                edits = [moved, line.typed(None)]
                yield line.mistake("setting-below", key=key, edits=edits)
            elif key == "size" and not all(0 < n <= MOST_CELLS for n in page.size):
                drawn = all(0 < n <= MOST_CELLS for n in page.drawn.values())
                edits = [line.typed(_SIZE.format(**page.drawn))] if drawn else []
                yield line.mistake("size-limit", most=MOST_CELLS, edits=edits)


def _floor_numbers(page: Page) -> Iterator[Mistake]:
    """Find the first floor out of order; once it is mended, the next may be right."""
    follows = 1
    for at, floor in enumerate(page.floors):
        if floor.headless:  # only the first can be
            follows = 2
            continue
        first = floor.numbers[0]
        if first != follows:
            edits = list(_counted_on(page.floors[at:], follows))
            facts = {"first": first, "follows": follows}
            yield floor.heading.mistake("floor-order", edits=edits, **facts)
            return
        follows = floor.numbers[-1] + 1
    if follows > MOST_FLOORS + 1:
        yield page.floors[-1].heading.mistake("floor-limit", most=MOST_FLOORS)


def _counted_on(floors: Iterable[Floor], follows: int) -> Iterator[Edit]:
    """Number floors from one on, each as often as it is built."""
    for floor in floors:
        last = follows + len(floor.numbers) - 1
        number = f"{follows}-{last}" if last > follows else f"{follows}"
        head = re.match(r"(?i)\s*floor\s*[\d\s-]*", floor.heading.code)
        yield floor.heading.typed(f"floor {number}", 0, head.end() if head else 0)
        follows = last + 1


def _blanks(page: Page) -> Iterator[Mistake]:
    """Find blank lines between two rows of a drawing; behind a whole one, a heading."""
    height = page.size[1] if page.settings["size"] else 0
    for floor in page.floors:
        for number, (above, below) in enumerate(pairwise(floor.rows), 1):
            between = page.lines[above.number : below.number - 1]
            blank = [line for line in between if not line.written.strip(" \t")]
            follows = floor.numbers[-1] + 1 if floor.numbers else 2
            if blank and number == height and not height % len(floor.rows[number:]):
                edits = [below.above(f"floor {follows}:")]
                yield blank[0].mistake("blank-heading", floor=follows, edits=edits)
                break
            for line in blank:
                yield line.mistake("blank-line", edits=[line.typed(None)])


# -- Shape --------------------------------------------------------------------------


def _shape(page: Page) -> Iterator[Mistake]:
    """Find rows that are too wide, lost or doubled, or a size that is all wrong."""
    width, height = page.size
    columns, rows = page.drawn["columns"], page.drawn["rows"]
    alike = all(len(floor.rows) == rows for floor in page.floors)
    fits = 0 < columns <= MOST_CELLS and 0 < rows <= MOST_CELLS
    size = page.settings["size"][0]
    resize = [size.typed(_SIZE.format(**page.drawn))] if fits else []
    if columns != width and alike and rows != height:
        yield size.mistake("size", edits=resize, **page.drawn)
        return

    wide = [row for row in page.rows if len(row.code) > width]
    for row in wide:
        over = len(row.code) - width
        start = _surplus(row, wide, page, over)
        facts: dict[str, Any] = {
            "wide": len(row.code),
            "width": width,
            "resize": _SIZE.format(**page.drawn),
        }
        if start is None:
            yield row.mistake("row-width-size", width + 1, edits=resize, **facts)
        else:
            out = row.code[start : start + over]
            cut = [row.typed("", start, start + over)]
            yield row.mistake("row-width", start + 1, out=out[:80], edits=cut, **facts)
    yield from _heights(page, height, resize if alike else [])


MOST_SURPLUS = 4  # signs of a row too wide that are taken out; with more it is the size


def _surplus(row: Line, wide: Sequence[Line], page: Page, over: int) -> int | None:
    """Where a row has signs too many: without them it is most like those beside it.

    None where many rows are as wide, so that the size is wrong, or by much.
    """
    if over > MOST_SURPLUS or len(wide) > max(1, len(page.rows) // 4):
        return None
    lines = page.lines[row.number - 2 : row.number - 1], page.lines[row.number :][:1]
    beside = [line.code for line in chain(*lines)]

    def likeness(sign: str, others: Iterable[str]) -> int:
        """How many of the signs above and below are the same."""
        return sum(sign == other for other in others)

    def loss(place: int) -> int:
        """How many signs go that are no floor, wall or outside."""
        return sum(sign not in ".# " for sign in row.code[place : place + over])

    return _best_place(row.code, [*zip_longest(*beside)], over, likeness, loss)


def _best_place(
    mine: Sequence[str],
    whole: Sequence[Any],
    over: int,
    likeness: Callable[..., int],
    loss: Callable[[int], int] = lambda _: 0,
) -> int:
    """Where to take some out of a sequence to make it like a whole one.

    over: how many to take out; below 0, how many to put in;  loss: of places alike
    """
    before = [likeness(one, other) for one, other in zip(mine, whole, strict=False)]
    moved = zip(mine[max(0, over) :], whole[max(0, -over) :], strict=False)
    behind = [likeness(one, other) for one, other in moved]
    places = range(len(mine) - max(0, over) + 1)
    front = [0, *accumulate(before)]
    back = [0, *accumulate(behind)]

    def gain(place: int) -> tuple[int, int]:
        """How alike they are then, but for what is the same for all places."""
        alike = front[min(place, len(before))] - back[min(place, len(behind))]
        return alike, -loss(place)

    return max(places, key=gain)


def _heights(page: Page, height: int, resize: list[Edit]) -> Iterator[Mistake]:
    """Find drawings with rows too many or too few."""
    whole = next((floor for floor in page.floors if len(floor.rows) == height), None)
    for floor in page.floors:
        count = len(floor.rows)
        if count == height:
            continue
        line = floor.rows[height] if count > height else floor.heading
        edits = resize
        if whole and count:
            edits = _rows_made_right(floor, [row.code for row in whole.rows])
        yield line.mistake("rows", count=count, height=height, edits=edits)


def _rows_made_right(floor: Floor, whole: Sequence[str]) -> list[Edit]:
    """Take rows out, or put in its own, where it gets most like another floor."""
    codes = [row.code for row in floor.rows]
    over = len(codes) - len(whole)
    place = _best_place(codes, whole, over, _likeness)
    if over > 0:
        return [row.typed(None) for row in floor.rows[place : place + over]]
    lost = whole[place : place - over]
    new = [max(codes, key=partial(_likeness, other)) for other in lost]
    if place < len(codes):
        return [floor.rows[place].above(*new)]
    last = floor.rows[-1]
    return [last.typed("".join(f"\n{row}" for row in new), len(last.written))]


def _likeness(one: str, other: str) -> int:
    """How many signs of two rows are the same."""
    return sum(a == b for a, b in zip(one, other, strict=False))


def syntax_stages(page: Page, standing: Standing) -> Iterator[Iterable[Mistake]]:
    """Yield what each stage of checks finds, once the stages before find nothing."""
    yield _wrapping(page)
    yield chain(_foreign_signs(page), _wide_signs(page, standing), _longest(page))
    yield chain(_headings(page), _tabs(page, standing))
    yield chain(
        _head(page),
        _settings(page),
        _floor_numbers(page),
        _blanks(page),
        _signs(page),
    )
    yield _shape(page)
