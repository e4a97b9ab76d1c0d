"""A text file becomes a checked drawing of a building, or a page of mistakes.

Clauses: A1 (floors of unit cells), A2 (rooms, doors), A3 (stairwells), A4 (exits).
[A1, chosen] The paper shows its building in figures only; here it is text, so that a
student can redraw it with any editor.

    #  wall      +  door; an entrance where it touches a stairwell      ;  note
    .  floor     E  exit        A-D  stairwell        a-z  a room's name on its floor
    a blank is outside, also between walls

A file says `building: NAME`, `size: COLUMNS x ROWS`, and for each floor from 1 upwards
`floor 1: NAME` above its drawing; `floor 2-3:` draws once and builds twice. Every floor
fills all the rows. Mistakes are looked for in STAGES, at the end of this module; reading
stops after the first stage that finds any, so that causes come before consequences.

    cells      (k, 2) rows and columns, counted from 1 as in the file
    a finding  line, column, what is wrong, and a hint that says what to type
"""

import re
import unicodedata
from collections import defaultdict
from dataclasses import dataclass, field
from difflib import get_close_matches
from functools import cached_property
from os import PathLike
from pathlib import Path

MOST_FLOORS = 30  # [A1, chosen] ten times the paper's, and still quick to check
MOST_CELLS = 400  # [A1, chosen] in a row or a column: ten times the paper's
SHOWN = 4  # mistakes on a page: more would hide the first
SETTINGS = ("building", "size")
STAIRWELLS = "ABCD"
OUTSIDE, WALL, DOOR, EXIT = " #+E"

Finding = tuple[int, int, str, str]


@dataclass(frozen=True)
class Storey:
    """One floor: its name and its rows, all of the plan's width, north first."""

    name: str
    rows: tuple[str, ...]


@dataclass(frozen=True)
class Plan:
    """A drawing without mistakes; width and height in cells of 1 m."""

    title: str
    width: int
    height: int
    storeys: tuple[Storey, ...]


@dataclass(frozen=True)
class Mistake:
    """What is wrong, where, and one thing to do; line and column count from 1."""

    path: str
    line: int
    column: int
    what: str
    written: str
    hint: str

    def __str__(self) -> str:
        """`path:line:column: what`, the line, a caret, a hint."""
        shown = self.written[: max(self.column, MOST_CELLS)]
        shown = re.sub(r"[\x00-\x08\x0a-\x1f\x7f-\x9f]", "?", shown)
        caret = "".join(map(_gap, shown[: self.column - 1].ljust(self.column - 1)))
        return (
            f"{self.path}:{self.line}:{self.column}: {self.what}\n    {shown}".rstrip()
            + f"\n    {caret}^\n    hint: {self.hint}"
        )


class FloorPlanError(ValueError):
    """A drawing with mistakes, all of one stage; its text is the whole page."""

    def __init__(self, mistakes: tuple[Mistake, ...]) -> None:
        page = [str(mistake) for mistake in mistakes[:SHOWN]]
        if len(mistakes) > SHOWN:
            page.append(f"… and {len(mistakes) - SHOWN} more")
        super().__init__("\n".join(page))
        self.mistakes = mistakes


def parse(text: str, path: str = "<text>") -> Plan:
    """The drawing in a text; path names it in messages. Raises FloorPlanError."""
    page = _page(text.removeprefix("\ufeff"))
    for checks in STAGES:
        findings = sorted({found for check in checks for found in check(page)})
        if findings:
            raise FloorPlanError(
                tuple(
                    Mistake(
                        path, line, column, what, page.lines[line - 1].written, hint
                    )
                    for line, column, what, hint in findings
                )
            )
    return page.plan()


def read(path: str | PathLike[str]) -> Plan:
    """The drawing in a file. Raises FloorPlanError, or OSError if it cannot be read."""
    try:
        raw = Path(path).read_bytes()
    except IsADirectoryError:
        raise IsADirectoryError(f"{path} is a folder; name a file in it") from None
    except OSError as error:
        raise type(error)(f"cannot read {path}: {error.strerror}") from None
    return parse(_decoded(raw, str(path)), str(path))


def to_text(plan: Plan) -> str:
    """The file that draws a plan: `parse(to_text(plan)) == plan`."""
    head = f"building: {plan.title}\nsize:     {plan.width} x {plan.height}\n"
    floors = [
        "\n".join(line.rstrip() for line in ("", f"floor {n}: {s.name}", *s.rows))
        for n, s in enumerate(plan.storeys, 1)
    ]
    return head + "\n".join(floors) + "\n"


def find(name: str | PathLike[str]) -> Path:
    """A floor file by its path, or by the bare name of one that ships.

    Raises FileNotFoundError with the names that ship.
    """
    path, bare = Path(name), str(name).removesuffix(".txt")
    shipped = _shipped()
    if path.exists() and not (path.is_dir() and bare in shipped):
        return path
    if bare in shipped:
        return shipped[bare]
    close = get_close_matches(bare, shipped, 1)
    meant = f" Did you mean '{close[0]}'?" if close else ""
    raise FileNotFoundError(
        f"there is no floor file '{name}'.{meant} These ship: {', '.join(shipped)}."
    )


def _shipped() -> dict[str, Path]:
    """The floors beside the checkout, or in the installed package, by name."""
    here = Path(__file__).parent
    files = [*here.glob("floors/*.txt"), *here.parent.glob("floors/*.txt")]
    return {file.stem: file for file in sorted(files)}


def _decoded(raw: bytes, path: str) -> str:
    """Raises FloorPlanError at the first byte that no text has."""
    try:
        before = raw[: raw.index(0)] if 0 in raw else None
        if before is None:
            return raw.decode("utf-8")
    except UnicodeDecodeError as error:
        before = raw[: error.start]
    lines = re.split(r"\r\n?|\n", before.decode("utf-8", "replace"))
    what = "this is not plain text"
    hint = "Save the file as plain text (ASCII)."
    place = (len(lines), len(lines[-1]) + 1)
    raise FloorPlanError((Mistake(path, *place, what, lines[-1], hint),))


def _gap(char: str) -> str:
    """Blanks as wide as a character on the screen."""
    if char == "\t":
        return char
    if unicodedata.combining(char) or unicodedata.category(char) == "Cf":
        return ""
    return "  " if unicodedata.east_asian_width(char) in "WF" else " "


# -- The page: lines, settings, drawings --------------------------------------------


@dataclass(frozen=True)
class _Line:
    """A line as written, and its code: what stands before the note."""

    number: int
    written: str

    @cached_property
    def code(self) -> str:
        return self.written.partition(";")[0].rstrip(" \t")

    @cached_property
    def key(self) -> str:
        """What stands before the colon of a heading; empty for a row."""
        if _HEADING.match(self.code):
            return self.code.partition(":")[0].strip().lower()
        return self.code.strip() if _looks_like_heading(self.code) else ""

    @property
    def value(self) -> str:
        """What stands behind the colon of a heading."""
        return self.code.partition(":")[2].strip()

    @property
    def blank(self) -> bool:
        return not self.written.strip(" \t")


_HEADING = re.compile(r"\s*\w[^#.+:]*:")
_FLOOR = re.compile(r"floor\s*([0-9]{1,4})(?:\s*[-–—]\s*([0-9]{1,4}))?$")
_SIZE = re.compile(r"([0-9]{1,4})\s*[xX×]\s*([0-9]{1,4})$")


def _looks_like_heading(code: str) -> bool:
    word = re.match(r"\s*([A-Za-z]+)\b", code)
    return bool(word and WALL not in code and _meant(word[1], 0.75))


def _meant(key: str, cutoff: float = 0.5) -> str:
    """The key word that somebody who wrote this had in mind, or nothing."""
    word = (key.lower().split() or [""])[0]
    return "".join(get_close_matches(word, (*SETTINGS, "floor"), 1, cutoff))


@dataclass(frozen=True)
class _Drawing:
    """A floor's heading and its rows; no numbers where the heading is unreadable."""

    heading: _Line
    numbers: range
    rows: list[_Line] = field(default_factory=list)

    @property
    def label(self) -> str:
        first, last = self.numbers[0], self.numbers[-1]
        return f"floor {first}" if first == last else f"floors {first}-{last}"


@dataclass(frozen=True)
class _Page:
    """A file sorted into its parts; `strays` are rows before the first heading."""

    lines: tuple[_Line, ...]
    settings: dict[str, list[_Line]]
    drawings: list[_Drawing]
    strays: list[_Line]

    @cached_property
    def size(self) -> tuple[int, int]:
        """Columns and rows; only after the first stage."""
        columns, rows = _SIZE.match(self.settings["size"][0].value).groups()  # type: ignore[union-attr]
        return int(columns), int(rows)

    @cached_property
    def maps(self) -> list["_Map"]:
        """The drawings as arrays; only after the third stage."""
        return [_Map(drawing, self.size) for drawing in self.drawings]

    def plan(self) -> Plan:
        storeys = (
            Storey(
                d.heading.value, tuple(row.code.ljust(self.size[0]) for row in d.rows)
            )
            for d in self.drawings
            for _ in d.numbers
        )
        return Plan(self.settings["building"][0].value, *self.size, tuple(storeys))


def _page(text: str) -> _Page:
    lines = enumerate(re.split(r"\r\n?|\n", text), 1)
    page = _Page(tuple(_Line(*line) for line in lines), defaultdict(list), [], [])
    for line in page.lines:
        if line.key in SETTINGS and ":" in line.code:
            page.settings[line.key].append(line)
        elif line.key:
            page.drawings.append(_Drawing(line, _numbers(line.key)))
        elif line.code:
            (page.drawings[-1].rows if page.drawings else page.strays).append(line)
    return page


def _numbers(key: str) -> range:
    match = _FLOOR.match(key)
    if match is None:
        return range(0)
    first, last = int(match[1]), int(match[2] or match[1])
    return range(first, last + 1)


STAGES = ()


class _Map: ...
