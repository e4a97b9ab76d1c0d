"""Build records from plain data (JSON, YAML, checkpoints), checked by their types.

A training's settings are such records [E1] [E2].  `files` reads the data.
A record's fields are its rows; `Allowed` says which values one may have.
"""

import math
from collections.abc import Mapping
from dataclasses import is_dataclass
from inspect import signature
from types import NoneType
from typing import Any, NamedTuple, TypeVar, get_args, get_origin, get_type_hints

from reference.paper import InputError, Scenario, limits
from reference.workshop.storage.files import LARGEST_NUMBER
from reference.workshop.storage.words import unknown_name

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


# -- Values -------------------------------------------------------------------------

ABOVE_0 = math.ulp(0.0)  # the smallest number above 0


class Allowed(NamedTuple):
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


def allowed_values(record: type) -> dict[str, Allowed]:
    """Find the allowed values of a dataclass's fields; the default is `Allowed()`."""
    kinds = get_type_hints(record)
    found = {}
    for name, hint in get_type_hints(record, include_extras=True).items():
        (allowed,) = getattr(hint, "__metadata__", (Allowed(),))
        found[name] = allowed._replace(kind=kinds[name])
    return found


def check_values(record: object) -> None:
    """Check all settings of a record. Raises SettingsError for the first wrong one."""
    for name, allowed in allowed_values(type(record)).items():
        value = getattr(record, name)
        check_type(name, value, allowed.kind)
        if allowed.choices and value not in allowed.choices:
            raise SettingsError(f"{name} {unknown_name(value, allowed.choices)}")
        if allowed.kind in (int, float) and not allowed.low <= value <= allowed.high:
            start = "above 0" if allowed.low == ABOVE_0 else f"from {allowed.low}"
            end = "upwards" if allowed.high == math.inf else f"up to {allowed.high}"
            must = f"it must be {TYPE_WORDS[allowed.kind]} {start} {end}"
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
