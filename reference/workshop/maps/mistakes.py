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
from dataclasses import dataclass, field
from pathlib import Path

from reference.floorplan import FloorPlanError

MISTAKE_TEXTS: dict[str, tuple[str, str]] = tomllib.loads(
    Path(__file__).with_name("mistakes.toml").read_text("utf-8")
)
# Mistakes shown at once. Those with the same hint count as one.
MISTAKES_SHOWN = 4
MORE_PLACES = 9  # places of one hint
MOST_MISTAKES = 1000  # mistakes looked for: with so many, only the first help
LONGEST_LINE = 400  # characters of a line that are shown, the mistake among them


@dataclass(frozen=True)
class Edit:
    """Type `new` in the place of the signs from `start` up to `stop` of a line.

    line counts from 1, start and stop from 0; where `new` is None, the line goes.
    """

    line: int
    start: int
    stop: int
    new: str | None


@dataclass(frozen=True, order=True)
class Mistake:
    """What is wrong, where, and one thing to do; line and column count from 1.

    more: further places of the same mistake;  edits: the first thing the hint says
    """

    line: int
    column: int
    what: str
    hint: str
    written: str
    more: int = field(default=0, compare=False)
    edits: tuple[Edit, ...] = field(default=(), compare=False)

    @property
    def place(self) -> str:
        """Line and column, after the word in quotes that `what` begins with, if any."""
        about = self.what.split()[0] + " at " if self.what.startswith("'") else ""
        return f"{about}{self.line}:{self.column}"

    def __str__(self) -> str:
        """`line:column: what`, the line as written, a caret, the hint."""
        start = max(0, self.column - LONGEST_LINE)
        line = _CONTROL.sub("?", self.written[start : start + LONGEST_LINE])
        caret = re.sub(r"[^\t]", " ", line[: self.column - 1 - start]) + "^"
        shown = "\n".join(f"    {text}".rstrip() for text in (line, caret))
        return f"{self.line}:{self.column}: {self.what}\n{shown}\n    hint: {self.hint}"


class MistakesError(FloorPlanError):
    """A drawing with mistakes, all of one stage; its text shows the first of them."""

    def __init__(self, path: str, mistakes: Sequence[Mistake], stage: int = 0) -> None:
        super().__init__(path, mistakes, stage)
        self.path = path
        self.mistakes = mistakes
        self.stage = stage

    @property
    def standing(self) -> tuple[int, int]:
        """How far the drawing gets: to this stage and, below 0, how many mistakes."""
        return self.stage, -len(self.mistakes)

    def __str__(self) -> str:
        """Show the first mistake of each hint in full, and where its others are."""
        alike: dict[str, list[Mistake]] = {}
        for mistake in self.mistakes:
            alike.setdefault(mistake.hint, []).append(mistake)

        page = []
        for first, *others in [*alike.values()][:MISTAKES_SHOWN]:
            page.append(f"{self.path}:{first}")
            if others or first.more:
                page.append(f"    also: {_places_of(first, others)}")
        if len(alike) > MISTAKES_SHOWN:
            page.append(f"… and {len(alike) - MISTAKES_SHOWN} more")
        return "\n".join(page)


def _places_of(first: Mistake, others: Sequence[Mistake]) -> str:
    """Say where mistakes like the first are, at most MORE_PLACES.

    Of mistakes with a word in quotes, the first for each word.
    """
    said = {_quoted(first)}
    places = []
    for mistake in others:
        if _quoted(mistake) not in said:
            said.add(_quoted(mistake))
            places.append(mistake.place)
    places = places[:MORE_PLACES]
    left_out = first.more + sum(1 + mistake.more for mistake in others) - len(places)
    if left_out:
        places.append(f"{left_out} more")
    return ", ".join(places)


def _quoted(mistake: Mistake) -> str:
    """Name a mistake among others with its hint: by its word, else by its place."""
    return mistake.place.partition(" at")[0]


_CONTROL = re.compile(r"[\x00-\x08\x0a-\x1f\x7f-\x9f]")
