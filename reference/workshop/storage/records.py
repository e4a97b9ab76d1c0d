"""Build records from plain data (JSON, YAML, checkpoints), checked by their types.

A training's settings are such records [E1] [E2].  `files` reads the data.
A record's fields are its rows; a `Row` says which values one may have.
"""

import math
from collections.abc import Iterable, Mapping
from dataclasses import is_dataclass
from difflib import get_close_matches
from inspect import getdoc, signature
from types import NoneType
from typing import Any, NamedTuple, TypeVar, get_args, get_origin, get_type_hints

from reference.paper import InputError, Scenario, limits
from reference.workshop.storage.files import LARGEST_NUMBER

RecordType = TypeVar("RecordType")


class SettingsError(InputError):
    """A setting with an impossible value: which, why, and what to write instead."""


def record_from(kind: type[RecordType], plain: Any, where: str) -> RecordType:
    """Build a record from a mapping; nested records from mappings, tuples from lists.

    where  the data stand, for messages. Raises SettingsError for unknown, missing or
    invalid rows. A scenario tells the limits of its numbers itself.
    """
    rows = checked_mapping(plain, where)
    known = get_type_hints(kind)
    limited = limits() if kind is Scenario else {}
    try:
        for name, value in rows.items():
            if name not in known:
                raise SettingsError(unknown_name(name, known))
            if name in limited:
                rows[name] = whole_if_wanted(value, known[name])
            else:
                rows[name] = checked_value(name, value, known[name])
        for name, parameter in signature(kind).parameters.items():
            if parameter.default is parameter.empty and name not in rows:
                raise SettingsError(f"{name} is missing")
        return kind(**rows)
    except ValueError as error:
        raise SettingsError(f"{where}: {error}") from None


def checked_value(name: str, value: Any, hint: Any) -> Any:
    """Convert a row's value to its type hint. Raises SettingsError if it misfits."""
    kind = get_origin(hint) or hint
    parts = get_args(hint)
    if kind is Any:
        return value
    if NoneType in parts:
        return None if value is None else checked_value(name, value, parts[0])
    if is_dataclass(kind) or hasattr(kind, "_fields"):
        return value if isinstance(value, kind) else record_from(kind, value, name)
    if kind is tuple:
        if not isinstance(value, list | tuple):
            raise SettingsError(f"{name} is {value!r:.60}: it must be a list")
        return tuple(checked_value(f"one of {name}", part, parts[0]) for part in value)
    if issubclass(kind, Mapping):
        rows = checked_mapping(value, name)
        return {
            key: checked_value(f"{name}: {key}", v, parts[1]) for key, v in rows.items()
        }
    value = whole_if_wanted(value, kind)
    check_type(name, value, kind)
    return value


def whole_if_wanted(value: Any, kind: Any) -> Any:
    """Read 5.0e6 as a whole number where one is wanted, as ML-Agents does."""
    if kind is int and isinstance(value, float) and value.is_integer():
        return int(value)
    return value


def checked_mapping(value: Any, where: str) -> dict[str, Any]:
    """Check that a value is a mapping; None stands for an empty one."""
    if not isinstance(value, Mapping | None):
        raise SettingsError(
            f"{where}: this must be names and values, not {value!r:.60}"
        )
    return {str(key): row for key, row in (value or {}).items()}


# similarities from 0 to 1, from which a name may be the one that is meant
ALIKE = 0.65
LESS_ALIKE = 0.5  # if both begin with the same three letters


# -- Rows ---------------------------------------------------------------------------

ABOVE_0 = math.ulp(0.0)  # the smallest number above 0


class Row(NamedTuple):
    """Allowed values of a setting: one of the choices, or a number from low to high."""

    section: tuple[str, ...] | None = ()  # in ML-Agents' files; (): top; None: ours
    choices: tuple[str, ...] = ()
    low: float = 1
    high: float = math.inf
    kind: Any = None


TYPE_WORDS = {
    int: "a whole number",
    float: "a number",
    bool: "true or false",
    str: "a word",
}


def rows_of(record: type) -> dict[str, Row]:
    """The rows of a dataclass by name; a field without a `Row` has the defaults."""
    kinds = get_type_hints(record)
    rows = {}
    for name, hint in get_type_hints(record, include_extras=True).items():
        (row,) = getattr(hint, "__metadata__", (Row(),))
        rows[name] = row._replace(kind=kinds[name])
    return rows


def check_rows(record: object) -> None:
    """Check all settings of a record. Raises SettingsError for the first wrong one."""
    for name, row in rows_of(type(record)).items():
        value = getattr(record, name)
        check_type(name, value, row.kind)
        if row.choices and value not in row.choices:
            raise SettingsError(f"{name} {unknown_name(value, row.choices)}")
        if row.kind in (int, float) and not row.low <= value <= row.high:
            start = "above 0" if row.low == ABOVE_0 else f"from {row.low}"
            end = "upwards" if row.high == math.inf else f"up to {row.high}"
            must = f"it must be {TYPE_WORDS[row.kind]} {start} {end}"
            raise SettingsError(f"{name} is {value}: {must}")


def check_type(name: str, value: object, kind: Any) -> None:
    """Raise SettingsError unless a value is of a kind; true and nan are not numbers.

    A whole number counts as a float too.
    """
    kind = get_origin(kind) or kind
    fits = isinstance(value, int | float if kind is float else kind)
    odd = isinstance(value, bool) != (kind is bool)
    absurd = isinstance(value, int | float) and not abs(value) <= LARGEST_NUMBER
    if not fits or odd or absurd:
        words = TYPE_WORDS.get(kind) or f"a {kind.__name__}"
        if fits and not odd and value == value:  # too large; nan differs from itself
            words += f" up to {LARGEST_NUMBER:g}"
        raise SettingsError(f"{name} is {value!r:.60}: it must be {words}")


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
