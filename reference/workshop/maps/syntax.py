"""Check how a drawing is written: the page, its characters, its shape.

Clauses: A1 (how many floors, rows and columns one may draw).  A check goes through a
page and yields what it finds; STAGES, at the end, orders them.
"""

import re
import unicodedata
from collections.abc import Callable, Iterator
from itertools import pairwise
from math import inf

from reference.workshop.maps.mistakes import Mistake, clip
from reference.workshop.maps.page import (
    FLOOR_KEY,
    MOST_CELLS,
    MOST_FLOORS,
    MOST_LINES,
    MOST_SIGNS,
    SIZE_VALUE,
    Line,
    Page,
    key_word,
)

# -- Stage 1: the page --------------------------------------------------------------

NOTE = "Type ';' in front of it to make it a note."


def _length(page: Page) -> Iterator[Mistake]:
    if not page.whole:
        what = f"a file has at most {MOST_LINES} lines and {MOST_SIGNS} characters"
        yield page.lines[-1].mistake(what, "Take notes out, or draw less.")


def _nothing(page: Page) -> Iterator[Mistake]:
    if not any(line.code for line in page.lines):
        hint = "Write 'building: NAME', 'size: 30 x 9', 'floor 1:' and a drawing."
        yield page.lines[0].mistake("nothing is drawn here", hint)


def _headings(page: Page) -> Iterator[Mistake]:
    floor = 1
    for above, drawing in zip([None, *page.drawings], page.drawings, strict=False):
        if drawing.numbers:
            floor = drawing.numbers[-1] + 1
            continue
        line = drawing.heading
        what, hint = f"'{clip(line.key)}' is no heading", _mended(line, floor)
        if not line.key.endswith(":"):
            what = "this heading has no ':'"
        elif match := FLOOR_KEY.fullmatch(line.key):
            what = "the floors run backwards here"
            hint = f"Write 'floor {clip(match[2])}-{clip(match[1])}:'."
        elif re.match(r"floor(?![a-z])", line.key):
            what = "this floor has no number that can be read"
            alike = f"'floor {floor}-{floor + 1}:' for floors that are alike"
            hint = f"Write 'floor {floor}:', or {alike}."
        elif word := key_word(line.key):
            what += f"; did you mean '{word}'?"
        elif drawing.rows and (above is None or above.rows):
            hint = f"Write 'floor {floor}: {clip(line.value)}".rstrip() + "'."
        else:
            hint = NOTE
        floor += bool(drawing.rows)
        yield line.mistake(what, hint)


def _mended(line: Line, floor: int) -> str:
    """Advise to write the heading as it was probably meant."""
    word, code = key_word(line.key), clip(line.code)
    pattern = r"\s*\w+?\s*(?P<number>[0-9-]*)\s*(:\s*|\s+|$)(?P<value>.*)"
    if word == "floor" and (parts := re.fullmatch(pattern, code)):
        meant = f"floor {parts['number'] or floor}: {parts['value']}".rstrip()
    else:
        meant = f"{word}: " + re.sub(r"^\s*\w+\s*:?\s*", "", code)
    return f"Write '{meant}'."


def _settings(page: Page) -> Iterator[Mistake]:
    below = min((d.heading.number for d in page.drawings if d.numbers), default=inf)
    unread = any(not drawing.numbers for drawing in page.drawings)
    silent = unread or not any(line.code for line in page.lines)
    hints = {
        "building:": "Write 'building: NAME' at the top.",
        "size:": _write_size(page, " at the top: columns x rows"),
    }
    for key, lines in page.settings.items():
        if not lines and not silent:
            what = f"the building has no '{key}' line"
            yield page.lines[0].mistake(what, hints[key])
        for line in lines[1:]:
            hint = "Take one of the two lines out."
            yield line.mistake(f"'{key}' is written twice", hint)
        if lines and lines[0].number > below:
            hint = "Move this line above the first floor."
            yield lines[0].mistake(f"'{key}' stands below a floor", hint)


def _values(page: Page) -> Iterator[Mistake]:
    for line in page.settings["building:"]:
        if not line.value:
            hint = "Write one: 'building: Tiny office'."
            yield line.mistake_in_value("the building has no name", hint)
    for line in page.settings["size:"]:
        size = SIZE_VALUE.fullmatch(line.value)
        what = "this size cannot be read: it is columns x rows"
        if size and all(1 <= int(cells) <= MOST_CELLS for cells in size.groups()):
            continue
        if size:
            what = f"a drawing has 1 to {MOST_CELLS} columns and 1 to {MOST_CELLS} rows"
        yield line.mistake_in_value(what, _write_size(page))


def _write_size(page: Page, where: str = "") -> str:
    if page.drawn_size:
        return f"Write '{page.drawn_size}'{where}."
    return f"Draw at most {MOST_CELLS} columns and {MOST_CELLS} rows."


def _floor_numbers(page: Page) -> Iterator[Mistake]:
    """Report the first only: what follows may well be right once it is mended."""
    last = 0
    for drawing in [] if page.strays else page.drawings:
        if not drawing.numbers:
            return
        if drawing.numbers[0] != last + 1:
            yield drawing.heading.mistake(*_misnumbered(page, drawing.numbers[0], last))
            return
        last = drawing.numbers[-1]
        if last > MOST_FLOORS:
            what = f"a building has at most {MOST_FLOORS} floors"
            yield drawing.heading.mistake(what, "Draw fewer floors.")
            return


def _misnumbered(page: Page, number: int, last: int) -> tuple[str, str]:
    """What is wrong with a number that does not follow the last, and a hint."""
    here, following = f"floor {number}", f"floor {last + 1}"
    if 0 < number <= last:
        hint = f"Write '{following}:', or take one of the two drawings out."
        return f"{here} is drawn twice", hint
    if any(last + 1 in drawing.numbers for drawing in page.drawings):
        hint = f"Move {following} up: floors are drawn from 1 upwards."
        return f"{here} stands before {following}", hint
    wrong = f"follows floor {last}" if last else "is the first that is drawn"
    return f"{here} {wrong}", f"Write '{following}:', or draw {following} first."


def _misplaced(page: Page) -> Iterator[Mistake]:
    if page.strays:
        hint, first = "Write 'floor 1:' above the drawing.", page.strays[0]
        if "#" not in first.code:
            hint = NOTE
        yield first.mistake("this row stands before any floor", hint)
    elif not page.drawings and any(page.settings.values()):
        last = [line for line in page.lines if line.code][-1]
        hint = "Write 'floor 1:' below, and its rows under it."
        yield last.mistake("no floor is drawn", hint)
    for drawing in page.drawings:
        if drawing.numbers and not drawing.rows:
            what = f"nothing is drawn for {drawing.label}"
            yield drawing.heading.mistake(what, "Draw its rows below this line.")


def _blanks(page: Page) -> Iterator[Mistake]:
    blank = {line.number for line in page.lines if not line.written.strip(" \t")}
    for drawing in page.drawings:
        for above, below in pairwise(drawing.rows):
            if between := blank.intersection(range(above.number, below.number)):
                hint = "Take it out, or write a heading such as 'floor 2:' here."
                line = page.lines[min(between) - 1]
                yield line.mistake("a blank line cuts this drawing in two", hint)


# -- Stage 2: characters ------------------------------------------------------------

_UNKNOWN = re.compile(r"""([\t!"$-*,/:-@[-`{-~-]|(?<![a-z0-9])[0-9])\1*""")  # in a row
_INSIDE_A_NAME = re.compile(r"(?<=[a-z0-9])[_-]+(?=[a-z0-9])")
_FOREIGN = re.compile(r"[^\t -~]+")  # anywhere, also in a note
_LOOKS_LIKE = dict.fromkeys("|-_=/\\*%@", "#") | dict.fromkeys(",:'`", ".")


def _unknown_signs(page: Page) -> Iterator[Mistake]:
    for row in page.rows:
        for sign in _UNKNOWN.finditer(row.code):
            what = f"'{sign[1]}' has no meaning in a drawing"
            hint = _instead(_LOOKS_LIKE.get(sign[1], "")) or (
                "Use '#', '.', '+', 'E', 'A' to 'D', 'a' to 'z' and blanks."
            )
            if sign[1] == "\t":
                what = "there is a tab in the drawing"
                hint = "Type blanks instead: a tab has no fixed width."
            elif sign[1].isdecimal():
                what = f"no room's name begins with '{sign[1]}'"
                hint = "Write it right behind a letter, as in 'room1'."
            elif sign[1] in "_-" and _INSIDE_A_NAME.match(row.code, sign.start()):
                hint = "Take it out: a room's name is 'a' to 'z' and digits."
            elif row.code.startswith("```"):
                hint = "Take this line out."
            yield row.mistake(what, hint, sign.start() + 1)


def _foreign_signs(page: Page) -> Iterator[Mistake]:
    rows = {row.number for row in page.rows}
    for line in page.lines:
        for signs in _FOREIGN.finditer(line.written.rstrip(" \t")):
            sign = line.written[signs.start()]
            plain = _ascii(sign)
            if line.number in rows:
                plain = _LOOKS_LIKE.get(plain, plain)
            name = unicodedata.name(sign, f"U+{ord(sign):04X}")
            what = f"{name} is not a plain ASCII sign"
            hint = _instead(plain) or "Take it out."
            yield line.mistake(what, hint, signs.start() + 1)


def _instead(sign: str) -> str:
    """A hint to type a sign, if there is one."""
    quoted = "a blank" if sign == " " else f"'{sign}'"
    return f"Type {quoted} instead." if sign else ""


def _ascii(char: str) -> str:
    """The plain sign that a character looks like, or nothing."""
    if "\u2500" <= char <= "\u25a1":  # lines, blocks and squares to draw walls with
        return "#"
    if unicodedata.category(char) == "Pd" or char == "\u2212":  # dashes, minus
        return "-"
    plain = {"\u00d7": "x", "\u00b7": ".", "\u2022": "."}.get(char)  # times, dots
    plain = plain or unicodedata.normalize("NFKD", char)[0]
    return plain if " " <= plain <= "~" else ""


_WORD = re.compile("(?!E)[A-Za-z][A-Za-z0-9]*(?<!E)")  # without exits beside it


def _capitals(page: Page) -> Iterator[Mistake]:
    for row in page.rows:
        for word in _WORD.finditer(row.code):
            capital, strange = (re.search(s, word[0]) for s in ("[A-Z]", "[F-Z]"))
            if capital and (not word[0].isupper() or len(set(word[0])) > 2):
                what = "there is a capital in a room's name"
                meant = clip(word[0].lower())
                hint = f"Write '{meant}'; stairwells and exits stand apart."
                yield row.mistake(what, hint, word.start() + capital.start() + 1)
            elif strange:
                what = f"no stairwell is called '{strange[0]}'"
                hint = "Type 'A', 'B', 'C' or 'D' for a stairwell, 'E' for an exit."
                yield row.mistake(what, hint, word.start() + strange.start() + 1)


# -- Stage 3: shape -----------------------------------------------------------------


def _size(page: Page) -> Iterator[Mistake]:
    """Both numbers are wrong: most often the two are exchanged."""
    width, height = page.size
    columns, rows = page.drawn
    alike = all(len(drawing.rows) == rows for drawing in page.drawings)
    if alike and rows != height and columns != width and page.drawn_size:
        what = f"{columns} columns and {rows} rows are drawn"
        yield page.settings["size:"][0].mistake_in_value(what, _write_size(page))


def _wide_rows(page: Page) -> Iterator[Mistake]:
    width, height = page.size
    widest = max(len(row.code) for row in page.rows)
    for row in page.rows:
        if len(row.code) > width:
            what = f"this row has {len(row.code)} columns, the size says {width}"
            wider = f", or write 'size: {widest} x {height}'"
            hint = f"Shorten it{wider if widest <= MOST_CELLS else ''}."
            yield row.mistake(what, hint, width + 1)


def _number_of_rows(page: Page) -> Iterator[Mistake]:
    width, height = page.size
    for drawing in page.drawings:
        rows, count = drawing.rows, len(drawing.rows)
        resize = f", or write 'size: {width} x {count}'"
        what = f"this drawing has {_counted(count)}, the size says {height}"
        if count < height:
            hint = f"Draw {_counted(height - count)} more{resize}."
            yield drawing.heading.mistake(what, hint)
        elif count > height:
            resize = resize if count <= MOST_CELLS else ""
            hint = f"Take {_counted(count - height)} out{resize}."
            yield rows[height].mistake(what, hint)


def _counted(rows: int) -> str:
    return "1 row" if rows == 1 else f"{rows} rows"


Check = Callable[[Page], Iterator[Mistake]]

STAGES: tuple[tuple[Check, ...], ...] = (
    (_length,),
    (_foreign_signs,),
    (_nothing, _headings, _settings, _values, _floor_numbers, _misplaced, _blanks),
    (_unknown_signs, _capitals),
    (_size,),
    (_wide_rows, _number_of_rows),
)
