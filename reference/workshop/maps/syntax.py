"""Check how a drawing is written: its characters, headings, settings and shape.

What lines are called is told in `pages`.
"""

import re
import unicodedata
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import partial
from itertools import (
    accumulate,
    chain,
    pairwise,
    zip_longest,
)
from math import inf
from typing import Any

import numpy as np
from scipy import ndimage

from reference.workshop.maps.columns import Standing, tabs, wide_signs
from reference.workshop.maps.mistakes import Edit, Mistake
from reference.workshop.maps.pages import (
    MARK,
    MOST_CELLS,
    MOST_EDITS,
    MOST_FLOORS,
    Floor,
    Line,
    Page,
    heading_meant,
    is_closed,
)
from reference.workshop.maps.signs import (
    Board,
    ascii_of,
    changes,
    has_no_width,
    rim_of,
)
from reference.workshop.maps.wrapping import find_wrapping

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


def _too_many_floors(page: Page) -> Iterator[Mistake]:
    """Find the first floor too many: whoever draws fewer need not number the others."""
    total = 0
    for floor in page.floors:
        total += len(floor.numbers) or floor.headless
        if total > MOST_FLOORS:
            yield floor.heading.mistake("floor-limit", most=MOST_FLOORS)
            return


# -- Characters ---------------------------------------------------------------------


ELLIPSIS = "\N{HORIZONTAL ELLIPSIS}"


def _foreign_signs(page: Page) -> Iterator[Mistake]:
    """Find what is not ASCII in headings and notes, and what shifts a row.

    Other signs of rows are explained by where they stand.
    """
    rows = {row.number for row in page.rows}
    said = page.size[0] if page.settings["size"] else 0
    columns = said or page.drawn["columns"]
    for line in page.lines:
        code = len(line.code) if line.number in rows else 0
        for foreign in re.finditer(r"[^\t -~]", line.written):
            sign = foreign[0]
            start = foreign.start()
            if sign in "\0\ufffd":
                yield line.mistake("not-text", start + 1)
                return
            plain = "" if has_no_width(sign) else ascii_of(sign)
            if sign == ELLIPSIS and code + 2 * line.code.count(sign) <= columns:
                plain = "..."  # what a word processor makes of it
            elif start < code and not has_no_width(sign):
                continue
            yield line.mistake(
                "foreign-alike" if plain else "foreign",
                start + 1,
                name=unicodedata.name(sign, f"U+{ord(sign):04X}"),
                plain=plain,
                edits=[line.typed(plain, start, start + 1)],
            )


_WORD = re.compile(r"[a-z]+(?:[_-][a-z0-9]+)+|[A-Za-z0-9]+|([^ #.+])\1*")
_MEANS = re.compile(r"E*([A-D]*|[a-z][a-z0-9]*)E*")


def _words_behind(page: Page) -> Iterator[Mistake]:
    """Find words behind a row, apart from it, beyond the width that the file says."""
    width = page.size[0] if page.settings["size"] else 0
    for row in page.rows if width else []:
        behind = row.code[width:].lstrip()
        start = len(row.code) - len(behind)
        is_apart = row.code[start - 1 : start].isspace()
        if is_apart and re.search("[A-Za-z]", behind) and not _DRAWN.search(behind):
            edits = [row.typed("; ", start, start)]
            yield row.mistake("words-behind", start + 1, edits=edits)


_DRAWN = re.compile(r"[#+]|\.\.")


def _notes_in_rows(page: Page) -> Iterator[Mistake]:
    """Find a `;` between the signs of a row: what is behind it is drawn, too.

    What makes the row wider than the drawing is a note.
    """
    said = page.size[0] if page.settings["size"] else 0
    columns = min(said or MOST_CELLS, page.drawn["columns"])
    for row in page.rows:
        start = len(row.code)
        if len(row.written.rstrip()) > columns:
            continue
        if re.fullmatch(r";[#.+EA-Da-z0-9 ]*[#+E]\s*", row.written[start:]):
            beside = {row.code[-1:], row.written[start + 1]}
            plain = beside.pop() if len(beside) == 1 else "."
            edits = [row.typed(plain, start, start + 1)]
            yield row.mistake("note-in-row", start + 1, plain=plain, edits=edits)


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
    yield from _words(board, rows, spaced)


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
    spaced = re.compile(r"[a-zA-Z][a-zA-Z0-9]+(?: (?:[0-9]+|[a-zA-Z0-9]{2,}))+")
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


def _words(
    board: Board, rows: Sequence[Line], spaced: dict[tuple[int, int], str]
) -> Iterator[Mistake]:
    """Find words that are no room's name, but for those that are parts of one."""
    parts = {
        (row, start + n)
        for (row, start), words in spaced.items()
        for n in range(len(words))
    }
    rim = rim_of(board)
    for number, row in enumerate(rows):
        text = "".join(board.plain[number]) if row else ""
        for match in _WORD.finditer(text):
            word = match[0]
            place = match.start()
            capital = re.match(r"E(?=[a-z])", word) and not rim[number, place]
            if _MEANS.fullmatch(word) and not capital:
                continue
            if (number, place) in parts:
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
                alike = _range_meant(floor.heading) or range(1)
                follows += len(alike) if len(alike) <= MOST_FLOORS else 1
        previous = floor
    if not page.floors:
        yield page.lines[-1].mistake("no-floor")


def _comment(line: Line) -> Mistake:
    """Make the mistake of a comment."""
    start, stop = next(re.finditer(MARK, line.code)).span()
    is_apart = line.code[stop : stop + 1] in ("", " ", "\t")
    edit = line.typed(";" if is_apart else "; ", start, stop)
    return line.mistake("comment", start + 1, mark=line.code[start:stop], edits=[edit])


def _heading(page: Page, floor: Floor, follows: int, *, draws: bool) -> Mistake:
    """Make the mistake of a heading; draws: whether a drawing needs it."""
    line = floor.heading
    kind = heading_meant(line)
    if kind == "heading" and draws:
        kind = "heading-drawing"
    alike = _range_meant(line)
    if alike is not None and kind in ("heading-floor", "heading-drawing"):
        return _range_heading(line, alike, follows)
    key = r"\w+\s*[\d-]*\s*:|\w+"
    if kind == "heading-floor":  # its number, or a word for one
        key = r"\w+(?:\s+\w+|\s*[\d-]+)?\s*:|\w+\s*[\d-]*"
    words = re.sub(rf"^\W*({key})\s*:?", "", line.code).strip(" :.-")
    words = words.rpartition(":")[2].strip()
    facts = {"floor": follows, "above": follows + 1, **page.drawn}
    new = {
        "heading-building": f"building: {words or 'NAME'}",
        "heading-size": _SIZE.format(**page.drawn),
        "heading-floor": f"floor {follows}: {words}".rstrip(),
    }.get(kind, f"; {line.written}")
    if kind == "heading-drawing":
        name = line.code.strip(" :").rpartition(":")[2].strip()
        new = f"floor {follows}: {name}"
    return line.mistake(kind, edits=[line.typed(new)], **facts)


_RANGE = re.compile(r"(?i)\W*[a-z]+\s*0*(\d+)\s*(?:-+|to)\s*0*(\d+)[ :]*")


def _range_meant(line: Line) -> range | None:
    """The floors that a heading was meant to draw once; None where it has no range."""
    read = _RANGE.match(line.code)
    if not read:
        return None
    first, last = (int(digits[:9]) for digits in read.groups())
    return range(first, last + 1)


def _range_heading(line: Line, alike: range, follows: int) -> Mistake:
    """Make the mistake of a heading with a range: as many floors stay as it draws."""
    if not alike:
        return line.mistake("heading-backwards", floor=follows, above=follows + 1)
    if len(alike) > MOST_FLOORS:
        return line.mistake("floor-limit", most=MOST_FLOORS)
    name = _RANGE.sub("", line.code, count=1)
    write = f"floor {follows}-{follows + len(alike) - 1}: {name}".rstrip()
    return line.mistake("heading-range", write=write[:80], edits=[line.typed(write)])


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
    """Find the first floor out of order: the next may be right then.

    Where no number is missing, the drawings are in the wrong order: nothing is typed.
    """
    numbers = [number for floor in page.floors for number in floor.numbers]
    ordered = sorted(numbers)
    no_gap = all(after - before == 1 for before, after in pairwise(ordered))
    moved = no_gap and numbers != ordered
    follows = 1
    for at, floor in enumerate(page.floors):
        if floor.headless:  # only the first can be
            follows = 2
            continue
        first = floor.numbers[0]
        above = page.floors[at - 1]
        if at and above.numbers == floor.numbers and not above.rows:
            edits = [above.heading.typed(None)]
            yield above.heading.mistake("heading-again", first=first, edits=edits)
            return
        facts: dict[str, Any] = {"first": first, "follows": follows}
        if first != follows and moved:
            yield floor.heading.mistake("floor-move", **facts)
            return
        if first != follows:
            edits = list(_counted_on(page.floors[at:], follows))
            yield floor.heading.mistake("floor-order", edits=edits, **facts)
            return
        follows = floor.numbers[-1] + 1


def _counted_on(floors: Iterable[Floor], follows: int) -> Iterator[Edit]:
    """Number floors from one on, each as often as it is built."""
    for floor in floors:
        last = follows + len(floor.numbers) - 1
        number = f"{follows}-{last}" if last > follows else f"{follows}"
        head = re.match(r"(?i)\s*floor\s*[\d\s-]*", floor.heading.code)
        yield floor.heading.typed(f"floor {number}", 0, head.end() if head else 0)
        follows = last + 1


def _blanks(page: Page) -> Iterator[Mistake]:
    """Find blank lines between two rows of a drawing.

    Behind a whole one there should be a heading, and behind each further one.
    """
    height = page.size[1] if page.settings["size"] else page.drawn["rows"]
    for floor in page.floors:
        for number, (above, below) in enumerate(pairwise(floor.rows), 1):
            blank = page.blanks_between(above, below)
            follows = floor.numbers[-1] + 1 if floor.numbers else 2
            if blank and number == height and len(floor.rows) % height == 0:
                edits = [
                    row.above(f"floor {storey}:")
                    for storey, row in enumerate(floor.rows[height::height], follows)
                ]
                yield blank[0].mistake("blank-heading", floor=follows, edits=edits)
                break
            for line in blank:
                yield line.mistake("blank-line", edits=[line.typed(None)])


# -- Shape --------------------------------------------------------------------------


def _shape(page: Page) -> Iterator[Mistake]:
    """Find rows that are too wide, lost or doubled, or a size that is all wrong."""
    width, height = page.size
    columns = page.drawn["columns"]
    rows = page.drawn["rows"]
    alike = all(len(floor.rows) == rows for floor in page.floors)
    fits = 0 < columns <= MOST_CELLS and 0 < rows <= MOST_CELLS
    size = page.settings["size"][0]
    resize = [size.typed(_SIZE.format(**page.drawn))] if fits else []
    wide = [row for row in page.rows if len(row.code) > width]
    few = 0 < len(wide) <= max(1, len(page.rows) // 4)
    both_differ = columns != width and rows != height
    if both_differ and alike and not few:
        yield size.mistake("size", edits=resize, **page.drawn)
        return

    for row in wide:
        over = len(row.code) - width
        start = _surplus(row, page, over) if few else None
        facts: dict[str, Any] = {
            "wide": len(row.code),
            "width": width,
            "resize": _SIZE.format(**page.drawn),
        }
        if start is None and few:
            yield row.mistake("row-width-long", width + 1, **facts)
        elif start is None:
            yield row.mistake("row-width-size", width + 1, edits=resize, **facts)
        else:
            out = row.code[start : start + over]
            cut = [row.typed("", start, start + over)]
            yield row.mistake("row-width", start + 1, out=out[:80], edits=cut, **facts)
    yield from _heights(page, height, resize if alike and not few else [])


MOST_SURPLUS = 4  # signs of a row too wide that are taken out; with more it is the size


def _surplus(row: Line, page: Page, over: int) -> int | None:
    """Where a row has signs too many: without them it is most like those beside it.

    None where it is too wide by much.
    """
    if over > MOST_SURPLUS:
        return None
    lines = page.lines[row.number - 2 : row.number - 1], page.lines[row.number :][:1]
    beside = [_without_names(line.code) for line in chain(*lines)]

    def likeness(sign: str, others: Iterable[str]) -> int:
        """How many of the signs above and below are the same."""
        return sum(sign == other for other in others)

    def loss(place: int) -> int:
        """How many signs go that are no floor, wall or outside; doors count twice."""
        out = row.code[place : place + over]
        return sum((sign not in ".# ") + (sign in "+E") for sign in out)

    mine = _without_names(row.code)
    return _best_place(mine, [*zip_longest(*beside)], over, likeness, loss)


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
        if count > height and _are_floors(floor.rows, height):
            yield _floors_in_one(floor, height)
            continue
        if whole and count:
            codes = [row.code for row in whole.rows]
            yield _rows_outside(floor, codes) or _rows_made_right(floor, codes)
            continue
        line = floor.rows[height] if count > height else floor.heading
        kind = "rows-size" if resize else "rows"
        facts: dict[str, Any] = {"count": count, "height": height}
        facts["resize"] = _SIZE.format(**page.drawn)
        yield line.mistake(kind, edits=resize, **facts)


def _are_floors(rows: Sequence[Line], height: int) -> bool:
    """Whether rows are several drawings of this height, one below the other."""
    parts = (rows[start : start + height] for start in range(0, len(rows), height))
    return len(rows) % height == 0 and all(map(is_closed, parts))


def _floors_in_one(floor: Floor, height: int) -> Mistake:
    """Write a heading above each further drawing; none if one heading says several."""
    follows = floor.numbers[0] + 1 if floor.numbers else 2
    edits = [
        row.above(f"floor {storey}:")
        for storey, row in enumerate(floor.rows[height::height], follows)
    ]
    return floor.rows[height].mistake(
        "rows-heading",
        floor=follows,
        count=len(floor.rows),
        height=height,
        edits=edits if len(floor.numbers) < 2 else [],
    )


def _rows_outside(floor: Floor, whole: Sequence[str]) -> Mistake | None:
    """Find rows left out of a closed drawing: all is outside there.

    They are typed where the stairwells are in line with another floor's then, unless
    both drawings begin and end alike: some in the middle may be lost.
    """
    rows = floor.rows
    lost = len(whole) - len(rows)
    alike = all(
        len(rows[end].code.lstrip()) == len(whole[end].lstrip())
        and len(rows[end].code) == len(whole[end])
        for end in (0, -1)
    )
    if lost < 1 + alike or not is_closed(rows):
        return None
    facts: dict[str, Any] = {"count": len(rows), "height": len(whole)}
    stairs = [re.sub("[^A-D]", " ", row).rstrip() for row in whole]
    mine = [re.sub("[^A-D]", " ", row.code).rstrip() for row in rows]
    above = [k for k in range(lost + 1) if stairs[k : k + len(mine)] == mine]
    if not above:  # what is lost stood in the middle
        return rows[0].mistake("rows-missing", lost=lost, **facts)
    if alike or len(above) != 1:
        return rows[0].mistake("rows-outside", **facts)
    facts["above"] = above[0]
    facts["below"] = lost - above[0]
    edits = [rows[0].above(*above[0] * ["#"])] if above[0] else []
    if facts["below"]:
        end = len(rows[-1].written)
        edits.append(rows[-1].typed(facts["below"] * "\n#", end))
    return rows[0].mistake("rows-outside-at", edits=edits, **facts)


def _rows_made_right(floor: Floor, whole: Sequence[str]) -> Mistake:
    """Take doubled rows out, or put in its own, where it gets most like another floor.

    None goes that is not there twice, one below the other.
    """
    codes = [row.code for row in floor.rows]
    over = len(codes) - len(whole)
    facts: dict[str, Any] = {"count": len(codes), "height": len(whole)}
    if over > 0:
        place = _doubled_at(codes, over, whole)
        if place is None:
            return floor.rows[len(whole)].mistake("rows", **facts)
        out = floor.rows[place : place + over]
        facts["out"] = f"this row and {over - 1} below it" if over > 1 else "this row"
        edits = [row.typed(None) for row in out]
        return out[0].mistake("rows-over", edits=edits, **facts)

    place = _best_place(codes, whole, over, _likeness)
    lost = whole[place : place - over]
    plain = [_without_names(code) for code in codes]
    new = [max(plain, key=partial(_likeness, other)) for other in lost]
    if 0 < place < len(codes):  # the plainer one beside it: rooms go on
        new = len(lost) * [min(plain[place - 1 : place + 1], key=_walls_across)]
    below = place == len(codes)
    line = floor.rows[-1 if below else place]
    facts |= {"another": f"{-over} more rows" if over < -1 else "another row"}
    facts |= {"where": "below" if below else "above", "row": new[0][:80]}
    edit = line.above(*new)
    if below:
        edit = line.typed("".join(f"\n{row}" for row in new), len(line.written))
    return line.mistake("rows-lost", edits=[edit], **facts)


def _doubled_at(codes: Sequence[str], over: int, whole: Sequence[str]) -> int | None:
    """Where so many rows repeat those above them; None if nowhere.

    A name or a wall across is hardly meant twice; else what leaves the drawing most
    like another floor.
    """

    def rank(place: int) -> tuple[bool, int, int]:
        """How probably these rows are too many."""
        out = codes[place : place + over]
        left = [*codes[:place], *codes[place + over :]]
        has_name = any(re.search("[a-z]", code) for code in out)
        across = sum(map(_walls_across, out))
        return has_name, across, sum(map(_likeness, left, whole))

    doubled = (
        place
        for place in range(over, len(codes) - over + 1)
        if codes[place - over : place] == codes[place : place + over]
    )
    return max(doubled, key=rank, default=None)


def _walls_across(code: str) -> int:
    """How many cells of walls along it a row has; a door counts as much as some."""
    walls = re.findall("[#+E]{3,}", code)
    return sum(map(len, walls)) + 4 * len(re.findall("[+E]", code))


def _without_names(code: str) -> str:
    """A row with floor where names are written; a letter alone may be a slip."""
    return re.sub("[a-z][a-z0-9]+", lambda name: "." * len(name[0]), code)


def _likeness(one: str, other: str) -> int:
    """How many signs of two rows are the same."""
    return sum(a == b for a, b in zip(one, other, strict=False))


def syntax_stages(page: Page, standing: Standing) -> Iterator[Iterable[Mistake]]:
    """Yield what each stage of checks finds, once the stages before find nothing."""
    yield _wrapping(page)
    yield chain(
        _foreign_signs(page),
        wide_signs(page, standing),
        _longest(page),
        _too_many_floors(page),
    )
    yield chain(_headings(page), tabs(page, standing), _words_behind(page))
    yield chain(
        _head(page),
        _settings(page),
        _floor_numbers(page),
        _blanks(page),
        _notes_in_rows(page),
        _signs(page),
    )
    yield _shape(page)
