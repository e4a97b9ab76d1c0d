"""The index of the paper in 80 columns, and what `--paper` asks for."""

import re
import textwrap
from collections.abc import Iterable, Iterator

import pytest

from reference.workshop.annotated.index import (
    PACKAGE,
    Citation,
    code_of,
    kinds_of,
    marked_with,
)
from reference.workshop.annotated.words import CLAUSES, PLACES, TITLES, named_in
from reference.workshop.plain import did_you_mean

WIDTH, INDENT = 80, 10


def asked_for(text: str) -> list[str]:
    """The clauses and places that somebody asks for; an algorithm means all its lines.

    Raises UsageError where none is named.
    """
    found = named_in(text)
    if not found:
        raise pytest.UsageError(
            f"'{text}' is nothing of the paper.{did_you_mean(text, CLAUSES)}"
            " Write one like B5, A1-A8, Alg. 2:13-15, Eq. 3, Tab. I or Fig. 1"
        )
    whole = {name for name in found if re.fullmatch(r"Alg\. \d", name)}
    lines = [place for place in PLACES if place.split(":")[0] in whole]
    return list(dict.fromkeys([*found, *lines]))


def paper_index(keys: Iterable[str] = TITLES) -> Iterator[str]:
    """The lines of the index: each clause or place, its kinds, code and tests."""
    for key in keys:
        title = f"{key}  {TITLES[key]}"
        kinds = ", ".join(kinds_of(key)) if key in CLAUSES else ""
        yield ""
        if len(title) + len(kinds) + 2 > WIDTH:
            yield title
            title = ""
        yield f"{title:{WIDTH - len(kinds)}}{kinds}".rstrip()
        yield from _wrapped("code", "  ".join(_files(code_of(key))))
        for test in marked_with(key):
            yield from _wrapped("test", f"{test.where} {test.title}")


def _files(found: list[Citation]) -> Iterator[str]:
    """Files of the package, each with its lines."""
    for path in dict.fromkeys(cited.symbol.path for cited in found):
        lines = sorted({cited.line for cited in found if cited.symbol.path == path})
        yield f"{path.relative_to(PACKAGE)}:{' '.join(map(str, lines))}"


def _wrapped(what: str, text: str) -> Iterator[str]:
    """Breaks only at blanks, so no name or number is cut."""
    yield from textwrap.wrap(
        text,
        WIDTH,
        initial_indent=f"    {what:{INDENT - 4}}",
        subsequent_indent=" " * INDENT,
        break_long_words=False,
        break_on_hyphens=False,
    )
