"""The index of the paper in 80 columns, and what `--paper` asks for."""

import re
import textwrap
from collections.abc import Iterable, Iterator

import pytest

from reference.workshop.annotated.index import code_of, kinds_of, marked_with
from reference.workshop.annotated.words import CLAUSES, TITLES, keys_named_in
from reference.workshop.storage.words import did_you_mean

WIDTH = 80
INDENT = 10


def asked_for(text: str) -> list[str]:
    """The clauses and places that somebody asks for; an algorithm means all its lines.

    Raises UsageError where none is named.
    """
    found = keys_named_in(text)
    if not found:
        raise pytest.UsageError(
            f"'{text}' is nothing of the paper.{did_you_mean(text, CLAUSES)}"
            " Write one like B5, A1-A8, Alg. 2:13-15, Eq. 3, Tab. I or Fig. 1"
        )
    whole = {name for name in found if re.fullmatch(r"Alg\. \d", name)}
    lines = [place for place in TITLES if place.split(":")[0] in whole]
    return list(dict.fromkeys([*found, *lines]))


def paper_index(keys: Iterable[str] = TITLES) -> Iterator[str]:
    """The lines of the index: each clause or place, its kinds, code and tests."""
    for key in keys:
        kinds = ", ".join(kinds_of(key)) if key in CLAUSES else ""
        yield ""
        yield from _wrapped(f"{key}  ", f"{TITLES[key]}  {kinds}")
        code = dict.fromkeys(cited.where for cited in code_of(key))
        yield from _wrapped("    code  ", "  ".join(code))
        for test in marked_with(key):
            yield from _wrapped("    test  ", f"{test.where} {test.title}")


def _wrapped(what: str, text: str) -> list[str]:
    """Break at blanks only, so that no name or number is cut."""
    return textwrap.wrap(
        text,
        WIDTH,
        initial_indent=what,
        subsequent_indent=" " * INDENT,
        break_long_words=False,
        break_on_hyphens=False,
    )
