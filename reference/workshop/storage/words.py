"""Names in words: which are known, which may be meant, some of many."""

from collections.abc import Iterable
from difflib import get_close_matches
from inspect import getdoc

# similarities from 0 to 1, from which a name may be the one that is meant
ALIKE = 0.65
LESS_ALIKE = 0.5  # if both begin with the same three letters


def unknown_name(name: object, known: Iterable[str]) -> str:
    """Say that a name is none of the known ones, and which may be meant."""
    known = tuple(known)
    near = did_you_mean(name, known)
    return f"'{name!s:.60}' is unknown.{near} There is: {some_of(known, 40)}"


def some_of(names: Iterable[object], most: int = 10, between: str = ", ") -> str:
    """List names, the first few of many with a count of the others."""
    listed = [f"{name!s:.60}" for name in names]
    more = len(listed) - most
    told = f"{between}and {more:,} more" if more > 0 else ""
    return between.join(listed[:most]) + told


def first_line(thing: object) -> str:
    """The first line of a docstring: what a thing does."""
    return (getdoc(thing) or "").partition("\n")[0]


def did_you_mean(name: object, known: Iterable[str]) -> str:
    """Suggest the closest known name in a question; empty where none is alike.

    Of names with points, such as hyperparameters.beta, the last words are compared: a
    section that both have would make any two alike.
    """
    words = {place.rpartition(".")[2]: place for place in known}
    word = f"{name!s:.60}".lower().rpartition(".")[2]
    close = get_close_matches(word, list(words), 1, cutoff=ALIKE) or [
        near
        for near in get_close_matches(word, list(words), 3, cutoff=LESS_ALIKE)
        if near[:3] == word[:3]
    ]
    return f" Did you mean '{words[close[0]]}'?" if close else ""
