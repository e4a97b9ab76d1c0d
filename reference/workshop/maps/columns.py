"""Which columns a row's signs take: tabs, and signs as wide as two.

Where several readings are possible, take the one with which the map passes most checks.
"""

import re
import unicodedata
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from functools import partial
from itertools import groupby

import numpy as np

from reference.workshop.maps.mistakes import Mistake
from reference.workshop.maps.pages import MOST_CELLS, Line, Page
from reference.workshop.maps.signs import Board, ascii_of, is_wide

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


def wide_signs(page: Page, standing: Standing) -> Iterator[Mistake]:
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


def tabs(page: Page, standing: Standing) -> Iterator[Mistake]:
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
    """What a tab stands for: outside, floor, or wall where one goes on behind it.

    Between two single signs of walls there is a room.
    """
    before = code[:place].strip()
    behind = code[place:].strip()
    if not before:
        return " "
    along = re.fullmatch(r"[#|+E]{2}\|[#|+E]{2}", f"{before[-2:]}|{behind[:2]}")
    return "#" if along else "."
