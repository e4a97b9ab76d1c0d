"""Read what each sign of a plan stands for, by where it stands.

People draw floor with `f`, doors with `d`, walls with `W` or with a box of lines. Such
a sign has a place: around the plan, in a gap between two walls, or all over a room.

rim      cells beside the outside
gap      a cell between two walls, with no wall on its two other sides
inside   all cells but the outside, the rim and walls
name     a word of small letters, and digits behind them; it keeps its letters
"""

import re
import unicodedata
from collections.abc import Iterator
from dataclasses import dataclass
from string import ascii_letters, ascii_lowercase, digits

import numpy as np
from scipy import ndimage

OFTEN = 3  # places on one floor at which a letter is no room's name
FEWEST_CELLS = 6  # of a floor's sign
FLOOR_SHARE = 0.25  # of the inside, which a floor's sign fills
RIM_SHARE = 0.2  # of the rim, which a wall's sign fills
GAP_SHARE = 0.7  # of a door's cells are in gaps
MOST_SORTS = 30  # foreign signs that are told apart, the most frequent first

_MEANT = " #.+E"
_OF_NAMES = ascii_lowercase + digits
_LINES = "|-=\\/"  # signs to draw walls with
_JOINING = "_-"  # signs that join the words of a name
_PLAIN = str.maketrans("\u2013\u2014\u2212\u00d7\u00b7\u2022", "---x..")


def ascii_of(char: str) -> str:
    """The plain sign that a character looks like, or nothing."""
    if "\u2500" <= char <= "\u25a1":  # lines, blocks and squares to draw walls with
        return "#"
    plain = unicodedata.normalize("NFKD", char.translate(_PLAIN))[:1]
    return plain if " " <= plain <= "~" else ""


def is_drawn_on(char: str) -> bool:
    """Whether a character is drawn on the one before it: an accent, a joiner."""
    return unicodedata.category(char) in ("Mn", "Me", "Cf")


def has_no_width(char: str) -> bool:
    """Whether a character takes no cell: drawn on another one, or a control sign."""
    return is_drawn_on(char) or unicodedata.category(char) == "Cc"


def is_wide(char: str) -> bool:
    """Whether a terminal shows a character as wide as two."""
    return unicodedata.east_asian_width(char) in "WF"


@dataclass
class Board:
    """All drawings of a page, one below the other, with a blank row between two.

    drawn   (rows, columns) characters, as they stand there, with a blank rim
    plain   the same, as they are meant
    floor   of each row, counted from 0, -1 for a blank row between
    """

    drawn: np.ndarray
    plain: np.ndarray
    floor: np.ndarray


def read_signs(drawings: list[list[str]]) -> Board:
    """Read what is drawn: rows of each drawing, of any lengths."""
    rows = [""]
    floor = [-1]
    for number, drawing in enumerate(drawings):
        rows += [f" {row}" for row in drawing]
        floor += [number] * len(drawing)
        rows.append("")
        floor.append(-1)
    width = max(map(len, rows)) + 1
    padded = np.array([row.ljust(width) for row in rows], f"U{width}")
    drawn = padded.view("U1").reshape(len(rows), width)
    board = Board(drawn, drawn.copy(), np.array(floor))

    _by_look(board)
    _walls(board)
    _floors(board)
    _doors(board)
    _floors(board)  # again: what a door now ends may be no name
    _exits(board)
    _others(board)
    _blanks(board)
    return board


# -- Where signs stand --------------------------------------------------------------


def _outside(board: Board) -> np.ndarray:
    """Blanks that are joined to the edge of the page."""
    parts = ndimage.label(board.plain == " ")[0]
    return parts == parts[0, 0]


def rim_of(board: Board) -> np.ndarray:
    """Cells beside the outside, at a corner too."""
    outside = _outside(board)
    return ndimage.binary_dilation(outside, np.ones((3, 3))) & ~outside


def _gaps(here: np.ndarray, wall: np.ndarray, outside: np.ndarray) -> np.ndarray:
    """Cells of a sign between two walls, or in a row of them between two: (k, 2)."""
    row, column = np.nonzero(here)  # never at the edge of the board
    along = wall | here
    open_ = ~(along | outside)

    def between(ends: np.ndarray, sides: np.ndarray, step: int) -> np.ndarray:
        """Whether there are ends before and behind a cell, and sides beside it."""
        down = step
        right = 1 - step
        ended = ends[row - down, column - right] & ends[row + down, column + right]
        return (
            ended
            & sides[row - right, column - down]
            & sides[row + right, column + down]
        )

    found = between(along, open_, 0) | between(along, open_, 1)
    return np.column_stack([row, column])[found]


def _text_of(board: Board) -> str:
    """All signs in one text: a cell's place in it is that in the flat board."""
    return board.plain.tobytes().decode("utf-32-le", "surrogatepass")


def _signs_in(board: Board, *, besides: str) -> list[str]:
    """Signs of the board but these, in an order that does not change."""
    return [sign for sign in np.unique(board.plain).tolist() if sign not in besides]


def _type(board: Board, sign: str, plain: str) -> None:
    """Type another sign wherever this one stands, but for letters of names."""
    where = board.plain == sign
    if sign in _JOINING:
        where &= ~_in_word(board)
    if sign in _OF_NAMES:
        where &= ~_in_names(board, sign, is_wall=plain == "#")
    board.plain[where] = plain


def _in_names(board: Board, sign: str, *, is_wall: bool) -> np.ndarray:
    """Where a small letter or a digit belongs to a name, though it is a sign besides.

    A name loses the letter at its ends, since it cannot be told from the sign there.
    """
    kept = np.zeros(board.plain.shape, bool)
    some = board.plain == sign
    # one or two of them, between other letters
    inner = f"(?<=[a-z0-9])(?<!{sign}){sign}{{1,2}}(?!{sign})(?=[a-z0-9])"
    if sign.isdigit() and is_wall:  # it may end a name, as in lab2
        inner = f"(?<=[a-z][a-z]){sign}"
    flat = kept.reshape(-1)
    for letters in re.finditer(inner, _text_of(board)):
        flat[letters.start() : letters.end()] = True
    if is_wall:
        wall = some | np.isin(board.plain, ["#", "+", "E"])
        above = np.roll(wall, 1, 0)
        below = np.roll(wall, -1, 0)
        kept &= ~(above | below if sign.isdigit() else above & below)
    return kept & some


# -- What they stand for ------------------------------------------------------------


def _by_look(board: Board) -> None:
    """Type plain signs for others that look like them; floor for all sorts of signs."""
    signs, counts = np.unique(board.plain, return_counts=True)
    foreign = signs > "~"
    rare = signs[foreign][np.argsort(-counts[foreign], kind="stable")][MOST_SORTS:]
    board.plain[np.isin(board.plain, rare)] = "."
    for sign in _signs_in(board, besides=""):
        if sign > "~" and not has_no_width(sign):
            plain = ascii_of(sign)
            wall = plain and plain in _LINES
            board.plain[board.plain == sign] = "#" if wall else (plain or sign)


def _walls(board: Board) -> None:
    """Find signs that stand all around: walls."""
    rim = rim_of(board)
    on_rim = board.plain[rim]
    for sign in _signs_in(board, besides=_MEANT):
        count = int((on_rim == sign).sum())
        if sign in _LINES or count >= max(OFTEN, RIM_SHARE * len(on_rim)):
            _type(board, sign, "#")


def _floors(board: Board) -> None:
    """Find signs that fill rooms; beside others a shaft is none."""
    inside = ~rim_of(board) & ~np.isin(board.plain, ["#", "+", "E"]) & ~_outside(board)
    signs = board.plain[inside]
    for sign in _signs_in(board, besides=_MEANT):
        count = int((signs == sign).sum())
        share = FLOOR_SHARE
        if sign in "ABCD":
            share = 0.5
            beside_others = bool((signs != sign).any())
            if beside_others and _is_shaft(board, board.plain == sign):
                continue
        if count >= max(FEWEST_CELLS, share * len(signs)):
            _type(board, sign, ".")


def _doors(board: Board) -> None:
    """Find letters that stand in gaps between walls: doors.

    In a narrow room the letters of a name stand so, too: only those alone are asked.
    """
    outside = _outside(board)
    words = _in_words(board)
    wall = np.isin(board.plain, ["#", "+", "E"])
    for sign in _signs_in(board, besides=_MEANT):
        here = board.plain == sign
        gaps = _gaps(here, wall, outside)
        if not len(gaps) or len(gaps) < GAP_SHARE * here.sum():
            continue
        alone = gaps[~words[*gaps.T]]
        is_name = sign in _OF_NAMES and _most(board, alone) < 2
        if not is_name and not (sign in "ABCD" and _is_shaft(board, here)):
            board.plain[*gaps.T] = "+"
            _type(board, sign, "+")
            wall |= board.plain == "+"


def _most(board: Board, cells: np.ndarray) -> int:
    """The most parts of one size of these (k, 2) cells that one floor has.

    Rooms may be called `b` and `bb`, but no two of a floor are called alike.
    """
    if not len(cells):
        return 0
    where = np.zeros(board.plain.shape, bool)
    where[*cells.T] = True
    parts, _ = ndimage.label(where)
    _, first, sizes = np.unique(parts[*cells.T], return_index=True, return_counts=True)
    alike = np.column_stack([board.floor[cells[first, 0]], sizes])
    return int(np.unique(alike, axis=0, return_counts=True)[1].max())


def _is_shaft(board: Board, here: np.ndarray) -> bool:
    """Whether cells have the same shape on two floors or more, as stairwells have."""
    rows, columns = np.nonzero(here)
    floors = board.floor[rows]
    shapes = []
    for floor in np.unique(floors):
        mine = floors == floor
        first = int(np.argmax(board.floor == floor))
        shapes.append((rows[mine] - first, columns[mine]))
    if len(shapes) < 2:
        return False
    one = shapes[0]
    return all(np.array_equal(one, other) for other in shapes[1:])


def _exits(board: Board) -> None:
    """Find the exit among the signs of the rim, where none is drawn; `e` is one."""
    rim = rim_of(board)
    words = _in_words(board)
    has_exit = bool((board.plain == "E").any())
    found = []
    for sign in _signs_in(board, besides=_MEANT + "ABCD"):
        here = board.plain == sign
        alone = here & rim & ~words
        if alone.any() and not (here & ~rim).sum() > OFTEN * alone.sum():
            if sign == "e":
                board.plain[alone] = "E"
            elif not has_exit and not sign.islower():
                found.append((int(alone.sum()), sign))
    if found:
        _, sign = min(found)
        board.plain[(board.plain == sign) & rim] = "E"


def _in_words(board: Board) -> np.ndarray:
    """Cells of words with two different letters or more; E is an exit besides."""
    found = np.zeros(board.plain.shape, bool)
    flat = found.reshape(-1)
    for word in _WORDS.finditer(_text_of(board)):
        if len({*word[0]}) > 1:
            flat[word.start() : word.end()] = True
    return found


_WORDS = re.compile("[A-DF-Za-z0-9]+")


def _others(board: Board) -> None:
    """Type `#` for what is left on the rim, a stairwell's letter, or `.` elsewhere."""
    free = [letter for letter in "ABCD" if not (board.plain == letter).any()]
    rim = rim_of(board)
    words = _in_words(board)
    within = _in_word(board)
    for sign in _signs_in(board, besides=_MEANT + "ABCD"):
        if free:
            stairs = _closed_in(board, sign)
            if stairs.any() and _is_shaft(board, stairs):
                board.plain[stairs] = free.pop(0)
        here = board.plain == sign
        if sign in _OF_NAMES:
            if _is_everywhere(board, sign):
                _type(board, sign, ".")
            continue
        if has_no_width(sign):
            continue
        if sign.isupper():
            here &= ~words
            if free and here.any() and _is_shaft(board, here):
                board.plain[here] = free.pop(0)
                continue
        if sign in _JOINING:
            here &= ~within
        board.plain[here] = "."
        board.plain[here & rim] = "#"


def _closed_in(board: Board, sign: str) -> np.ndarray:
    """Where a sign fills a place closed in by walls and a door, as stairs do.

    A small letter in one row may be a name.
    """
    here = board.plain == sign
    upright = here & np.roll(here, 1, 0)
    is_name = sign in ascii_lowercase
    if is_name and not upright.any():
        return np.zeros_like(here)
    door = board.plain == "+"
    open_ = ~(here | door | (board.plain == "#"))
    parts, _ = ndimage.label(here)
    entered = np.unique(parts[here & ndimage.binary_dilation(door)])
    opened = np.unique(parts[here & ndimage.binary_dilation(open_)])
    closed = np.setdiff1d(entered, opened)
    if is_name:
        closed = np.intersect1d(closed, parts[upright])
    return np.isin(parts, closed) & here


def _in_word(board: Board) -> np.ndarray:
    """Cells with letters at their left and right."""
    letter = _are_letters(board)
    return np.roll(letter, 1, 1) & np.roll(letter, -1, 1)


def _are_letters(board: Board) -> np.ndarray:
    return np.isin(board.plain, [*ascii_letters, *digits])


def _is_everywhere(board: Board, sign: str) -> bool:
    """Whether a letter stands by itself too often on a floor to name its rooms."""
    alone = re.compile(f"(?<![a-zA-Z0-9]){sign}+(?![a-zA-Z0-9])")
    starts = np.zeros(board.plain.shape, bool)
    flat = starts.reshape(-1)
    for word in alone.finditer(_text_of(board)):
        flat[word.start()] = True
    counts = np.bincount(board.floor + 1, weights=starts.sum(axis=1))
    return bool(counts.max() >= OFTEN)


def _blanks(board: Board) -> None:
    """Type `.` or `#` for blanks that are closed in, where a room is beside them."""
    blank = board.plain == " "
    parts, count = ndimage.label(blank & ~_outside(board))
    if not count:
        return
    room = (board.plain == ".") | _is_small(board.plain)
    beside_room = ndimage.binary_dilation(room) if room.any() else np.ones_like(room)
    wall = np.isin(board.plain, ["#", "+", "E"])
    left_and_right = np.roll(wall, 1, 1) & np.roll(wall, -1, 1)
    above_and_below = np.roll(wall, 1, 0) & np.roll(wall, -1, 0)
    between_walls = left_and_right | above_and_below

    # of parts by number, 0 for what is none: any cell beside a room, any in the open
    number = parts.reshape(-1)
    meant = np.bincount(number, weights=beside_room.reshape(-1)) > 0
    is_open = np.bincount(number, weights=~between_walls.reshape(-1)) > 0
    meant[0] = False
    board.plain[meant[parts]] = "."
    if room.any():
        board.plain[(meant & ~is_open)[parts]] = "#"


def _is_small(signs: np.ndarray) -> np.ndarray:
    return (signs >= "a") & (signs <= "z")


# -- What differs -------------------------------------------------------------------


def changes(board: Board) -> Iterator[tuple[str, str, np.ndarray]]:
    """Yield a sign, what to type instead, and where: (k, 2) rows and columns.

    The first place comes first, in the order of the page.
    """
    cells = np.argwhere(board.drawn != board.plain)
    signs = board.drawn[*cells.T].view(np.uint32).astype(np.int64)
    plain = board.plain[*cells.T].view(np.uint32).astype(np.int64)
    _, first, kind = np.unique(
        signs << 32 | plain, return_index=True, return_inverse=True
    )
    order = np.argsort(kind, kind="stable")
    groups = np.split(cells[order], np.cumsum(np.bincount(kind))[:-1])
    for group in np.argsort(first).tolist():
        cell = groups[group][0]
        yield str(board.drawn[*cell]), str(board.plain[*cell]), groups[group]
