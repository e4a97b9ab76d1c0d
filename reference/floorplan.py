"""Read a floor plan from text: the floors of a building as rows of cells.

[A1, chosen] The paper shows its building in figures only; here it is text, so that a
student can redraw it with any editor.

    #  wall      +  door [A2]; an entrance where it touches a stairwell [A3]
    .  floor     E  exit [A4]      A-D  stairwell      a-z  a room's name on its floor
    ;  note
    digits may follow in a name, as in `lab2`; a blank is outside, also between walls

A file says `building: NAME`, `size: COLUMNS x ROWS` and then, for each floor from 1
upwards, `floor 1: NAME` above its drawing; `floor 2-3:` draws once and builds twice.
Every drawing has all the rows; a row that is all outside is typed as `#` alone.

A text that cannot be read is refused in one line. `python -m reference check FILE`
explains it, and finds mistakes in what can be read, such as a room without a door.
"""

import re
from dataclasses import dataclass
from functools import lru_cache
from io import StringIO

from reference.paper import InputError

STAIRWELLS = "ABCD"


@dataclass(frozen=True)
class Storey:
    """One floor: its name and its rows, all of the drawing's width, north first."""

    name: str
    rows: tuple[str, ...]


@dataclass(frozen=True)
class Drawing:
    """A drawing; width and height in cells of 1 m [A1]."""

    title: str
    width: int
    height: int
    storeys: tuple[Storey, ...]


class FloorPlanError(InputError):
    """A drawing with a mistake; its text says where and what."""


@lru_cache(maxsize=4)
def parse(text: str) -> Drawing:
    """Read the drawing in a text. Raises FloorPlanError."""
    reader = _Reader()
    try:
        for line in StringIO(text.removeprefix("\ufeff"), newline=None):
            reader.read(line)
        return reader.drawing()
    except FloorPlanError as error:
        raise FloorPlanError(f"line {reader.line}: {error}") from None


HEADING_PATTERNS = {
    "building": re.compile(r"(?i)\s*building\s*:\s*(\S.*)"),
    "size": re.compile(r"(?i)\s*size\s*:\s*0*(\d{1,4})\s*x\s*0*(\d{1,4})"),
    "floor": re.compile(
        r"(?i)\s*floor\s*0*(\d{1,2})(?:\s*-\s*0*(\d{1,2}))?\s*:\s*(.*)"
    ),
}
"""How lines above a drawing read, by their key words."""

_ROW = re.compile(rf"(?:[#.+E{STAIRWELLS}a-z ]|(?<=[a-z0-9])[0-9])*")


class _Reader:
    """Reads a drawing line by line; a row belongs to the floor named last above it."""

    def __init__(self) -> None:
        self.line = 0
        self.title = ""
        self.size = (0, 0)
        self.storeys: list[tuple[str, list[str]]] = []  # names and rows

    def read(self, line: str) -> None:
        """Read the next line of the file."""
        self.line += 1
        code = line.partition(";")[0].rstrip()
        if building := HEADING_PATTERNS["building"].fullmatch(code):
            self.title = building[1]
        elif size := HEADING_PATTERNS["size"].fullmatch(code):
            self._set_size(int(size[1]), int(size[2]))
        elif floor := HEADING_PATTERNS["floor"].fullmatch(code):
            if not any(self.size):
                raise FloorPlanError(
                    "write 'size: COLUMNS x ROWS' above the first floor"
                )
            self._check_height()
            follows = len(self.storeys) + 1
            first = int(floor[1])
            last = int(floor[2] or first)
            if first != follows or last < first:
                raise FloorPlanError(f"this should be floor {follows}")
            rows: list[str] = []  # shared: what is drawn once is built as often as said
            self.storeys += [(floor[3], rows)] * (last - first + 1)
        elif code:
            self._add_row(code)

    def drawing(self) -> Drawing:
        """The whole drawing, once all its lines are read."""
        self._check_height()
        if not self.title or not self.storeys:
            missing = "floor 1: NAME" if self.title else "building: NAME"
            raise FloorPlanError(f"write '{missing}' above the drawing")
        storeys = [Storey(name, tuple(rows)) for name, rows in self.storeys]
        return Drawing(self.title, *self.size, tuple(storeys))

    def _set_size(self, columns: int, rows: int) -> None:
        if any(self.size):
            raise FloorPlanError("the size of all floors is written once")
        if not columns or not rows:
            raise FloorPlanError("a floor has at least one column and one row")
        self.size = columns, rows

    def _add_row(self, code: str) -> None:
        if not self.storeys:
            raise FloorPlanError("this row stands before any floor")
        if not _ROW.fullmatch(code):
            raise FloorPlanError("a sign here has no meaning in a drawing")
        width = self.size[0]
        if len(code) > width:
            raise FloorPlanError(
                f"this row has {len(code)} columns, the size says {width}"
            )
        row = "" if code == "#" else code  # alone it says that there is a row
        self.storeys[-1][1].append(row.ljust(width))

    def _check_height(self) -> None:
        if not self.storeys:
            return
        _, rows = self.storeys[-1]
        height = self.size[1]
        if len(rows) != height:
            raise FloorPlanError(
                f"the drawing above has {len(rows)} rows, the size says {height}"
            )
