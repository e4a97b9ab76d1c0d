"""Find what stands around the rows of a plan, and between their signs.

A plan that comes out of a mail, a table or a program has a mark before each row,
quotes around it, or a comma after each sign. They are told once, before any sign.

row      a line that draws; here also a heading or a note that is wrapped like rows
layer    one thing that stands around rows: numbers, quotes, a mark, an end
listing  a line around the plan, such as ```, `rows = [` or `]`
cell     what stands between two separators: one sign
"""

import re
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import partial
from itertools import pairwise, takewhile

from reference.floorplan import HEADING_PATTERNS
from reference.workshop.maps.signs import is_drawn_on

LONGEST_ROW = 2_000  # signs, separators and marks; where one is longer, no row is read
LINES_READ = 300  # the first, by which the wrapping of all is judged
FEWEST_ROWS = 3  # fewer tell nothing
# of the lines that may be rows; others may be prose, or spoilt besides
NEARLY_ALL = 0.7

WIDEST_CELL = 3  # blanks between two separators; more are a room between walls

Lines = Sequence[str]
TakeOff = Callable[[str], str | None]
"""Takes something from a line; None for a line that has nothing of it."""
Found = tuple[str, TakeOff] | None
"""In words, what is wrapped around rows; and how to take it off."""


@dataclass
class Wrapping:
    """In words, what was found; each row without it; the lines of a listing."""

    words: list[str] = field(default_factory=list)
    bare: dict[int, str] = field(default_factory=dict)  # by the index of the line
    listing: list[int] = field(default_factory=list)


def find_wrapping(lines: Lines) -> Wrapping:
    """Find what separates signs and what is around rows, layer by layer."""
    found = Wrapping()
    if max(map(len, lines), default=0) > LONGEST_ROW or _is_no_text(lines):
        return found

    now = list(lines)
    for _ in LAYERS:  # each may be inside another
        layer = next(filter(None, (look(now[:LINES_READ]) for look in LAYERS)), None)
        if not layer:
            break
        words, take_off = layer
        found.words.append(words)
        bare = (take_off(line) for line in now)
        now = [old if new is None else new for old, new in zip(now, bare, strict=True)]

    for index, (line, new) in enumerate(zip(lines, now, strict=True)):
        if _is_listing(new):
            found.listing.append(index)
        elif new != line:
            found.bare[index] = new
    return found


def _is_no_text(lines: Lines) -> bool:
    """Whether there are signs that no text has: another encoding, or a picture."""
    return any("\0" in line or "\ufffd" in line for line in lines)


_LISTING = re.compile(
    r"""(?:```|~~~) [\w\s]*                             # a fence in Markdown
    | </?\w{1,9}>                                      # <pre>
    | (?:\w+\s*=\s*)? (?:[\[({]+ | [rf]? (?:"{3}|'{3}) \\?)   # rows = [
    | [\])}]+ [;,]*                                    # ]
    | (?:"{3}|'{3}) [\])};,.\w]*                       # the end of a text in code""",
    re.VERBOSE,
)


def _is_listing(line: str) -> bool:
    """Whether a line belongs to what is around a plan."""
    return bool(_LISTING.fullmatch(line.strip()))


def _may_be_row(line: str) -> bool:
    """Whether a line may draw: no blank line, no heading, no note, no listing's."""
    bare = line.strip()
    if not bare or (bare[0] == ";" and bare.count(";") < 3) or _is_listing(bare):
        return False
    return not any(pattern.match(bare) for pattern in HEADING_PATTERNS.values())


def _rows_of(lines: Lines, take_off: TakeOff) -> list[str]:
    """Rows without what was taken off; none if some are left that do not have it."""
    bare = [take_off(line) for line in lines if _may_be_row(line)]
    rows = [row for row in bare if row is not None]
    return rows if len(rows) >= max(FEWEST_ROWS, NEARLY_ALL * len(bare)) else []


# -- Around rows --------------------------------------------------------------------

_NUMBER = re.compile(r"\s*(\d{1,6})([^\w#+\"'\[,;]*)")


def _numbers(lines: Lines) -> Found:
    """Take off the numbers of rows, with what stands behind each."""
    matches = [match for line in lines if (match := _NUMBER.match(line))]
    numbers = [int(match[1]) for match in matches]
    ascending = sum(after - before in (1, 2) for before, after in pairwise(numbers))
    if ascending < max(FEWEST_ROWS - 1, NEARLY_ALL * (len(numbers) - 1)):
        return None
    ends = [match[2] for match in matches if match.end() < len(match.string)]
    behind = re.match(r"[^\w\s.]*\.?\s?", _common_start(ends))
    if not behind or not behind[0]:
        return None
    take_off = partial(_without_number, behind[0])
    return (
        ("each row begins with its number", take_off)
        if _rows_of(lines, take_off)
        else None
    )


def _common_start(texts: Sequence[str]) -> str:
    """What all texts begin with."""
    low = min(texts, default="")
    high = max(texts, default="")
    pairs = zip(low, high, strict=False)
    return low[: sum(1 for _ in takewhile(lambda pair: pair[0] == pair[1], pairs))]


def _without_number(behind: str, line: str) -> str | None:
    match = _NUMBER.match(line)
    return line[match.end(1) :].removeprefix(behind) if match else None


_NAMED = re.compile(r"\s*(?:\w+\s*=\s*)?")
_CLOSING = " \t])},;+\\"


def _quotes(lines: Lines) -> Found:
    """Take off quotes and brackets around rows, as in a list in code."""
    if not _rows_of(lines, _without_quotes):
        return None
    for line in lines:
        row = _without_quotes(line)
        if row:
            before, _, after = line.partition(row)
            before = before.rpartition("=")[2].strip()
            words = f"each row stands between {before!r} and {after.strip()!r}"
            return words, _without_quotes
    return None


def _without_quotes(line: str) -> str | None:
    """A row of a list in code; None where it has neither quotes nor brackets."""
    name = _NAMED.match(line)
    rest = line[name.end() if name else 0 :]
    inner = rest.lstrip(" \t[({")
    inner = inner[1:] if inner[:1] in ("r", "f") and inner[1:2] in ("'", '"') else inner
    body = inner.rstrip(_CLOSING)
    quote = inner[:1]
    if quote in ("'", '"') and len(body) > 1 and body.endswith(quote):
        return body[1:-1].removesuffix("\\n")
    closed = inner.rstrip(" \t,;")
    if rest[:1] in ("[", "(", "{") and closed[-1:] in ("]", ")", "}"):
        return closed.rstrip("])}")
    return None


_MARK = re.compile(
    r"\s*(?:[^\w\s#.+\"'(\[{;`\u2500-\u25a1]{1,3}|#(?= ))(?=[\s\w#.+\"'\[(;`]|\Z)"
)


def _marks(lines: Lines) -> Found:
    """Take off a mark that rows begin with, such as `> `."""
    marks = Counter(match[0] for line in lines if (match := _MARK.match(line)))
    if not marks:
        return None
    mark = marks.most_common(1)[0][0]
    marked = [
        line for line in lines if line.startswith(mark) and line.strip() != mark.strip()
    ]
    blank = _common_start([line[len(mark) :] for line in marked])[:1]
    if blank.isspace():
        mark += blank
    take_off = partial(_without_mark, mark)
    rows = _rows_of(lines, take_off)
    headed = any(
        HEADING_PATTERNS["floor"].match(take_off(line) or "") for line in lines
    )
    if not rows or not (headed or _is_apart(mark, rows)):
        return None
    return f"each row begins with {mark!r}", take_off


def _without_mark(mark: str, line: str) -> str | None:
    if line.startswith(mark):
        return line[len(mark) :]
    return "" if line.strip() == mark.strip() else None


def _marks_of_headings(lines: Lines) -> Found:
    """Take off a mark that headings begin with too: no sign of the plan can be that."""
    found = _marks(lines)
    if not found:
        return None
    take_off = found[1]
    headed = any(
        HEADING_PATTERNS["floor"].match(take_off(line) or "") for line in lines
    )
    return found if headed else None


def _is_apart(mark: str, rows: Lines) -> bool:
    """Whether a mark is none of the plan's own signs, such as its wall."""
    if "#" in mark:
        return False
    return mark[-1].isspace() or _are_closed(
        mark, rows, [row.lstrip()[:1] for row in rows]
    )


def _are_closed(mark: str, rows: Lines, ends: Sequence[str]) -> bool:
    """Whether rows without a mark still end at a wall: the first row's sign."""
    signs = Counter(sign for sign in rows[0] if sign not in " ,;\t")
    wall = signs.most_common(1)[0][0] if signs else ""
    closed = sum(end in (wall, "E", "#") for end in ends)
    return wall not in mark and closed >= NEARLY_ALL * len(rows)


_AT_ENDS = " \t,\\|<>*:/!"


def _ends(lines: Lines) -> Found:
    """Take off what rows end with, such as a comma or the rim of a table."""
    ends = Counter(line[len(line.rstrip(_AT_ENDS)) :] for line in lines)
    end = next((end for end, _ in ends.most_common() if end.strip()), "")
    if not end:
        return None
    take_off = partial(_without_end, end)
    rows = [row for row in _rows_of(lines, take_off) if row]
    if not rows or not _are_closed(end, rows, [row.rstrip()[-1:] for row in rows]):
        return None
    return f"each row ends with {end!r}", take_off


def _without_end(end: str, line: str) -> str | None:
    return line.removesuffix(end) if line.endswith(end) else None


# -- Between signs ------------------------------------------------------------------


def _separator(lines: Lines) -> Found:
    """Take out what stands between all signs."""
    rows = [line for line in lines if _may_be_row(line)]
    for separator in _separators(rows):
        take_out = partial(_cells, separator)
        if _rows_of(lines, take_out):
            return f"{separator!r} stands between all signs", take_out
    dense = [row for row in rows if 3 * len(row.split()) > len(row.strip())]
    if len(dense) < FEWEST_ROWS - 1:
        return None
    for step in (2, 3):
        for start in range(step):
            take_out = partial(_every, start, step)
            kept = _rows_of(lines, take_out)
            if kept and any(take_out(row) is not None for row in dense):
                return "blanks stand between all signs", take_out
    return None


def _separators(rows: Lines) -> Iterator[str]:
    """Signs that nearly all rows have, the most frequent first."""
    counts = Counter(sign for row in rows for sign in {*row})
    for sign, count in counts.most_common():
        if sign.isalnum() or sign in "#.+ \"'" or is_drawn_on(sign):
            continue
        if count >= NEARLY_ALL * len(rows):
            yield sign


def _cells(separator: str, line: str) -> str | None:
    """A row without its separators; None if it is no row of single signs."""
    row = line.rstrip(" ")
    if row[:1] == row[-1:] == separator == "|":  # a table's rim
        row = row[1:-1]
    if row.count(separator) < 2:
        return None
    signs = []
    for cell in row.split(separator):
        if len(cell) > WIDEST_CELL and not cell.strip():
            return None
        sign = cell.strip(" \"'[](){}") or " "
        if sum(not is_drawn_on(part) for part in sign) > 1:
            return None
        signs.append(sign)
    return "".join(signs).rstrip()


def _every(start: int, step: int, line: str) -> str | None:
    """A row with blanks in all columns but every second or third, without them."""
    rest = (line[other::step] for other in range(step) if other != start)
    if any(part.strip(" ") for part in rest):
        return None
    return line[start::step].rstrip()


LAYERS: tuple[Callable[[Lines], Found], ...] = (
    _marks_of_headings,
    _separator,
    _numbers,
    _quotes,
    _marks,
    _ends,
)
