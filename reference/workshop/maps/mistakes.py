"""Mistakes in a floor plan, shown with the line, a caret, and one thing to do.

school.txt:7:13: there is a hole in the outer wall
    #AA+.lobby...
                ^
    hint: Type '#' here, or 'E' for an exit.

All that can be said stands in `mistakes.toml`.
"""

import re
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from reference.floorplan import FloorPlanError

WORDS: dict[str, tuple[str, str]] = tomllib.loads(
    Path(__file__).with_name("mistakes.toml").read_text("utf-8")
)
SHOWN = 4  # mistakes shown at once, those with one hint as one: more would hide it
MORE = 9  # places of one hint
MOST = 1000  # mistakes looked for: with so many, only the first help
LONGEST = 400  # characters of a line that are shown, the mistake among them


@dataclass(frozen=True, order=True)
class Mistake:
    """What is wrong, where, and one thing to do; line and column count from 1."""

    line: int
    column: int
    what: str
    hint: str
    written: str

    @property
    def place(self) -> str:
        """Line and column, after the word in quotes that `what` begins with, if any."""
        about = self.what.split()[0] + " at " if self.what.startswith("'") else ""
        return f"{about}{self.line}:{self.column}"

    def __str__(self) -> str:
        """`line:column: what`, the line as written, a caret, the hint."""
        start = max(0, self.column - LONGEST)
        line = _CONTROL.sub("?", self.written[start : start + LONGEST])
        caret = re.sub(r"[^\t]", " ", line[: self.column - 1 - start]) + "^"
        shown = "\n".join(f"    {text}".rstrip() for text in (line, caret))
        return f"{self.line}:{self.column}: {self.what}\n{shown}\n    hint: {self.hint}"


class MistakesError(FloorPlanError):
    """A drawing with mistakes, all of one stage; its text shows the first of them."""

    def __init__(self, path: str, mistakes: Sequence[Mistake]) -> None:
        super().__init__(path, mistakes)
        self.path, self.mistakes = path, mistakes

    def __str__(self) -> str:
        alike: dict[str, list[Mistake]] = {}
        for mistake in self.mistakes:
            alike.setdefault(mistake.hint, []).append(mistake)
        page = []
        for same in [*alike.values()][:SHOWN]:
            page.append(f"{self.path}:{same[0]}")
            each = {m.place.partition(" at")[0]: m.place for m in reversed(same)}
            places = [p for p in reversed(each.values()) if p != same[0].place][:MORE]
            if more := len(same) - 1 - len(places):
                places.append(f"{more} more")
            if places:
                page.append(f"    also: {', '.join(places)}")
        if (more := len(alike) - SHOWN) > 0:
            page.append(f"… and {more} more")
        return "\n".join(page)


_CONTROL = re.compile(r"[\x00-\x08\x0a-\x1f\x7f-\x9f]")
