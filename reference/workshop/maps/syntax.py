"""Check how a drawing is written: the page, its characters, its shape.

Clauses: A1 (how many floors, rows and columns one may draw).  A check goes through a
page and yields what it finds; STAGES, at the end, orders them.
"""

import re
import unicodedata
from collections.abc import Callable, Iterator
from itertools import pairwise
from math import inf

from reference.workshop.maps.mistakes import Mistake
from reference.workshop.maps.page import (
    MOST_CELLS,
    MOST_FLOORS,
    SIZE_VALUE,
    Line,
    Page,
)

# -- Stage 1: the page --------------------------------------------------------------

NOTE = "Type ';' in front of it to make it a note."


def _headings(page: Page) -> Iterator[Mistake]:
    """Headings that nobody can read, and rows without one."""
    follows = 1
    for drawing in page.drawings:
        line = drawing.heading
        if not drawing.numbers:
            what, word = f"'{line.key:.80}' is no heading", line.key_word
            if word and not line.key.startswith(word):
                what += f"; did you mean '{word}:'?"
            hint = _mended(page, line, follows if drawing.rows else 0)
            yield line.mistake(what, hint)
        follows = drawing.numbers[-1] + 1 if drawing.numbers else follows + 1
    for row in page.strays[:1]:
        hint = "Write 'floor 1:' above the drawing." if "#" in row.code else NOTE
        yield row.mistake("this row stands before any floor", hint)
    if not page.drawings and not page.strays:
        hint = "Write 'building: NAME', 'size: 30 x 9', 'floor 1:' and a drawing."
        yield page.lines[-1].mistake("no floor is drawn", hint)


def _mended(page: Page, line: Line, number: int) -> str:
    """Advise to write a heading as it was probably meant; number: of its floor."""
    if line.key_word == "building":
        return f"Write 'building: {line.value:.80}'."
    if line.key_word == "size":
        return _write_size(page)
    if not line.key_word and not number:
        return NOTE
    name = re.sub(r"^[0-9\s-]*+", "", line.value)[:80]
    alike = f"'floor {number or 1}-{(number or 1) + 1}:' for floors that are alike"
    return f"Write 'floor {number or 1}: {name}".rstrip() + f"', or {alike}."


def _settings(page: Page) -> Iterator[Mistake]:
    top = min((d.heading.number for d in page.drawings), default=inf)
    advice = {"building:": "Write 'building: NAME'.", "size:": _write_size(page)}
    for key, lines in page.settings.items():
        if not lines:
            yield page.lines[0].mistake(f"no line says '{key}'", advice[key])
        for k, line in enumerate(lines):
            if k > 0 or line.number > top:
                what = f"'{key}' is written once, above the first floor"
                yield line.mistake(what, "Move this line up, or take it out.")
            elif not _reads(line):
                what = f"a size is columns x rows, {MOST_CELLS} at most"
                if key == "building:":
                    what = "the building has no name"
                yield line.mistake_in_value(what, advice[key])


def _reads(setting: Line) -> bool:
    """Whether the value of a setting is one."""
    if setting.key == "building:":
        return bool(setting.value)
    size = SIZE_VALUE.fullmatch(setting.value)
    return size is not None and all(1 <= int(n) <= MOST_CELLS for n in size.groups())


def _write_size(page: Page) -> str:
    width, height = page.drawn
    if max(width, height) > MOST_CELLS:
        return f"Draw at most {MOST_CELLS} columns and {MOST_CELLS} rows."
    return f"Write 'size: {width} x {height}'."


def _floor_numbers(page: Page) -> Iterator[Mistake]:
    """Report the first only: what follows may well be right once it is mended."""
    last = 0
    for drawing in page.drawings:
        first, here = drawing.numbers[0], drawing.heading
        if first != last + 1:
            what = f"floor {first} stands where floor {last + 1} is expected"
            hint = f"Write 'floor {last + 1}:', or draw that one above this line."
            yield here.mistake(what, hint)
            return
        last = drawing.numbers[-1]
        if last > MOST_FLOORS:
            what = f"a building has at most {MOST_FLOORS} floors"
            yield here.mistake(what, "Draw fewer floors.")
            return


def _blanks(page: Page) -> Iterator[Mistake]:
    blank = {line.number for line in page.lines if not line.written.strip(" \t")}
    for drawing in page.drawings:
        for above, below in pairwise(drawing.rows):
            if between := blank.intersection(range(above.number, below.number)):
                hint = "Take it out, or write a heading such as 'floor 2:' here."
                line = page.lines[min(between) - 1]
                yield line.mistake("a blank line cuts this drawing in two", hint)


# -- Stage 2: characters ------------------------------------------------------------

_FOREIGN = re.compile(r"[^\t -~]+")  # anywhere, also in a note
_PLAIN = str.maketrans("\u2013\u2014\u2212\u00d7\u00b7\u2022", "---x..")
_LOOKS_LIKE = dict.fromkeys("|-_=/\\*%@", "#") | dict.fromkeys(",:'", ".")
_LOOKS_LIKE["\t"] = " "


def _foreign_signs(page: Page) -> Iterator[Mistake]:
    rows = {row.number for row in page.rows}
    for line in page.lines:
        for signs in _FOREIGN.finditer(line.written):
            sign = signs[0][0]
            name = unicodedata.name(sign, f"U+{ord(sign):04X}")
            what, hint = f"{name} is not a plain ASCII sign", "Take it out."
            if plain := _ascii(sign):
                hint = _instead(plain, line.number in rows)
            yield line.mistake(what, hint, signs.start() + 1)


def _ascii(char: str) -> str:
    """The plain sign that a character looks like, or nothing."""
    if "\u2500" <= char <= "\u25a1":  # lines, blocks and squares to draw walls with
        return "#"
    plain = unicodedata.normalize("NFKD", char.translate(_PLAIN))[0]
    return plain if " " <= plain <= "~" else ""


def _instead(sign: str, in_row: bool = True) -> str:
    plain = _LOOKS_LIKE.get(sign, sign) if in_row else sign
    return f"Type {'a blank' if plain == ' ' else repr(plain)} instead."


_WORD = r"(?P<word>[A-Za-z0-9]+(?:[_-]+[A-Za-z0-9]+)*+)"
_SIGNS = re.compile(rf"{_WORD}|(?P<sign>[^ #.+])(?P=sign)*+")
_READS = re.compile(r"E*([A-D]*|[a-z][a-z0-9]*)E*")


def _signs(page: Page) -> Iterator[Mistake]:
    """Signs without a meaning, and words that are no room's name."""
    for row in page.rows:
        for found in _SIGNS.finditer(row.code):
            word, sign = found["word"], found["sign"]
            if sign:
                what = f"{sign!r} has no meaning in a drawing"
                what = "there is a tab in the drawing" if sign == "\t" else what
                hint = "Use '#', '.', '+', 'E', 'A' to 'D', 'a' to 'z' and blanks."
                hint = _instead(sign) if sign in _LOOKS_LIKE else hint
                yield row.mistake(what, hint, found.start() + 1)
            elif not _READS.fullmatch(word):
                yield row.mistake(*_renamed(word), found.start() + 1)


def _renamed(word: str) -> tuple[str, str]:
    if word.isupper() and len(set(word)) == 1:
        hint = "Type 'A', 'B', 'C' or 'D' for a stairwell, 'E' for an exit."
        return f"no stairwell is called '{word[0]}'", hint
    name = re.sub("[_-]", "", word.lower())[:80]
    name = f"room{name}" if name[0].isdecimal() else name
    what = f"'{word:.80}' cannot be a room's name"
    return what, f"Write '{name}': 'a' to 'z', then digits; stairs and exits apart."


# -- Stage 3: shape -----------------------------------------------------------------


def _both_sizes(page: Page) -> Iterator[Mistake]:
    """Both numbers are wrong: most often the two are exchanged."""
    (width, height), (columns, rows) = page.size, page.drawn
    alike = all(len(drawing.rows) == rows for drawing in page.drawings)
    if alike and rows != height and columns != width:
        what = f"{columns} columns and {rows} rows are drawn"
        yield page.settings["size:"][0].mistake_in_value(what, _write_size(page))


def _shape(page: Page) -> Iterator[Mistake]:
    """Rows that are too wide, lost or doubled."""
    width, height = page.size
    for row in page.rows:
        if len(row.code) > width:
            what = f"this row has {len(row.code)} columns, the size says {width}"
            hint = _write_size(page)
            hint = f"Shorten it, or {hint[0].lower()}{hint[1:]}"
            yield row.mistake(what, hint, width + 1)
    for drawing in page.drawings:
        count = len(drawing.rows)
        what = f"this drawing has {count} rows, the size says {height}"
        resize = f", or write 'size: {width} x {count}'." if count else "."
        if count < height:
            hint = f"Draw {height - count} more below{resize}"
            yield drawing.heading.mistake(what, hint)
        elif count > height:
            hint = f"Take {count - height} out{resize}"
            yield drawing.rows[height].mistake(what, hint)


Check = Callable[[Page], Iterator[Mistake]]

STAGES: tuple[tuple[Check, ...], ...] = (
    (_foreign_signs,),
    (_headings,),
    (_settings, _floor_numbers, _blanks),
    (_signs,),
    (_both_sizes,),
    (_shape,),
)
