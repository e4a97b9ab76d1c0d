"""What a failing test of the paper says: the rule, its line and code, both boards."""

import textwrap
from inspect import cleandoc
from itertools import zip_longest

from reference.workshop.annotated.index import code_of
from reference.workshop.annotated.words import (
    ANNOTATIONS,
    CLAUSES,
    TITLES,
    keys_named_in,
)

WIDTH = 88
GAP = "    "


class Board(str):
    """A board as it was found; equal to one that is drawn with any indentation.

    Its rows are boards, too: so a failing test shows a row as it shows a board. So is
    what one sign becomes another on.
    """

    __hash__ = str.__hash__

    def splitlines(self, keepends=False):
        return [Board(row) for row in super().splitlines(keepends)]

    def replace(self, old, new):
        return Board(super().replace(old, new))

    def __eq__(self, other):
        return str.__eq__(self, drawn(other))

    def __ne__(self, other):
        return not self == other


def drawn(board):
    """A board as `show` draws it, however it is indented in a test."""
    if isinstance(board, Board):
        return str(board)
    return "\n".join(row.rstrip() for row in cleandoc(board).splitlines())


def rules(keys):
    """The sentence of each clause, and the code of each place, that a test is for."""
    for key in keys:
        if key in CLAUSES:
            statement = ANNOTATIONS["statements"][key]
            rule = f"[{key}] {TITLES[key]}: {statement}"
            yield from textwrap.wrap(rule, WIDTH, subsequent_indent=GAP)
        else:
            yield f"{key}  {TITLES[key]}"
            for code in code_of(key):
                line = code.code or code.symbol.title
                yield f"{GAP}{line}{GAP}{code.where}"


def keys_of(item):
    """What the marks of a test name, each once: clauses, then lines and the like."""
    texts = [text for mark in item.iter_markers("paper") for text in mark.args]
    keys = dict.fromkeys(key for text in texts for key in keys_named_in(text))
    return sorted(keys, key=lambda key: key not in CLAUSES)


def side_by_side(found, wanted):
    """Two boards, and under each row which of its cells differ."""
    rows = list(zip_longest(found.splitlines(), wanted.splitlines(), fillvalue=""))
    wide = max(len(row) for row in ["it is", *found.splitlines()])
    yield f"{'it is':{wide}}{GAP}it should be"
    for one, other in rows:
        yield f"{one:{wide}}{GAP}{other}"
        marks = ""
        for a, b in zip_longest(one, other, fillvalue=" "):
            marks += " " if a == b else "^"
        if "^" in marks:
            yield f"{marks:{wide}}{GAP}{marks}".rstrip()
