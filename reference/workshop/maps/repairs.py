"""Do what hints say: apply their edits to a text, round by round."""

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import chain, count
from pathlib import Path

from reference.workshop.maps import MOST_SIGNS, Line, lines_of_plan, parse_map
from reference.workshop.maps.mistakes import Edit, Mistake, MistakesError
from reference.workshop.storage.files import refuse_no_file, write_whole

# A round may uncover new mistakes; each floor out of order takes a round of its own.
MOST_ROUNDS = 60


@dataclass(frozen=True)
class Repair:
    """A text in which hints were followed, round by round; left: what remains."""

    text: str
    rounds: tuple[tuple[Mistake, ...], ...]
    left: MistakesError | None


def repair_file(path: Path, most: int = MOST_ROUNDS) -> Repair:
    """Follow the hints about a file; it may be in UTF-16, or in Windows' encoding.

    most: rounds at which it stops. Raises OSError, InputError for what is no file.
    """
    refuse_no_file(path)
    with path.open("rb") as file:
        raw = file.read(2 * MOST_SIGNS)
    encoding = _encoding_of(raw)
    text = raw.decode(encoding, "replace")
    repair = repair_text(text, str(path), most)
    if encoding == "utf-8":
        return repair
    first = Line(1, lines_of_plan(text)[0]).mistake("not-text")
    return Repair(repair.text, ((first,), *repair.rounds), repair.left)


def _encoding_of(raw: bytes) -> str:
    """Guess how a text is encoded: UTF-8 unless it cannot be."""
    start = raw[:200]
    wide = ""
    if raw[:2] in (b"\xff\xfe", b"\xfe\xff"):
        wide = "utf-16"
    elif 2 * start.count(0) >= 0.8 * len(start) > 0:  # every second byte
        wide = "utf-16-le" if start[1:2] == b"\0" else "utf-16-be"
    if wide and "\0" not in raw.decode(wide, "replace"):
        return wide
    try:
        raw.decode("utf-8")
    except UnicodeDecodeError:
        binary = re.search(rb"[\x00-\x08\x0e-\x1f]", raw)
        return "utf-8" if binary else "cp1252"
    return "utf-8"


def write_new(path: Path, text: str) -> Path:
    """Write a text beside a file, under a name that nobody has; return its path.

    Raises OSError.
    """
    stem = re.sub(r"-fixed(-\d+)?$", "", path.stem)
    ends = chain(["-fixed"], (f"-fixed-{number}" for number in count(2)))
    for end in ends:
        new = path.with_name(f"{stem}{end}{path.suffix}")
        try:
            new.open("x").close()  # from now on it is ours
        except FileExistsError:
            continue
        try:
            write_whole(new, text.encode("utf-8", "replace"))
        except BaseException:
            new.unlink(missing_ok=True)
            raise
        break
    return new


def repair_text(text: str, path: str = "<text>", most: int = MOST_ROUNDS) -> Repair:
    """Follow the hints until the text is fine, or following them leads no further."""
    rounds: list[tuple[Mistake, ...]] = []
    seen = {text}
    left = _mistakes_in(text, path)
    while left and len(rounds) < most:
        followed = tuple(mistake for mistake in left.mistakes if mistake.edits)
        new = follow_hints(text, followed)
        if not followed or new in seen:  # hints that undo each other
            break
        then = _mistakes_in(new, path)
        if then and then.standing < left.standing:
            break
        rounds.append(followed)
        seen.add(new)
        text = new
        left = then
    return Repair(text, tuple(rounds), left)


def _mistakes_in(text: str, path: str) -> MistakesError | None:
    """Find the mistakes in a text; None if it is fine."""
    try:
        parse_map(text, path)
    except MistakesError as error:
        return error
    return None


def follow_hints(text: str, mistakes: Iterable[Mistake]) -> str:
    """Type what these mistakes' hints say first."""
    edits = (edit for mistake in mistakes for edit in mistake.edits)
    return "\n".join(apply(lines_of_plan(text), edits))


def apply(lines: Sequence[str], edits: Iterable[Edit]) -> list[str]:
    """Apply edits to lines; of two that meet, the one that begins first."""
    of_line: dict[int, list[Edit]] = {}
    for edit in sorted(set(edits), key=_order):
        of_line.setdefault(edit.line, []).append(edit)
    new: list[str] = []
    for number, line in enumerate(lines, 1):
        new += _edited(line, of_line[number]) if number in of_line else [line]
    return new


def _edited(line: str, edits: Sequence[Edit]) -> list[str]:
    """Lines that take the place of one: none, if it goes, or several."""
    above = [edit.new or "" for edit in edits if edit.start == edit.stop == 0]
    within = [edit for edit in edits if edit.new is not None and edit.stop > 0]
    parts = list(above)
    end = 0
    for edit in within:
        if edit.start >= end:
            parts += [line[end : edit.start], edit.new or ""]
            end = edit.stop
    parts.append(line[end:])
    if any(edit.new is None for edit in edits):
        return "".join(above).splitlines()
    return "".join(parts).split("\n")


def _order(edit: Edit) -> tuple[int, int, bool, int, str]:
    """Sort by place; at one place, what is put before comes first, then the longest."""
    inserts = edit.start == edit.stop
    return edit.line, edit.start, not inserts, -edit.stop, str(edit.new)
