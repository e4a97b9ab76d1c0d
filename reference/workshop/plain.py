"""Build records from plain data (JSON, YAML, checkpoints), checked by their types.

Clauses: E1, E2 (a training's settings are such records).  `files` reads the data.
"""

from collections.abc import Mapping
from dataclasses import is_dataclass
from inspect import signature
from types import NoneType
from typing import Any, TypeVar, get_args, get_origin

from reference.learning.settings import SettingsError, check_type, rows_of, unknown

Record = TypeVar("Record")


def record_from(kind: type[Record], plain: Any, where: str) -> Record:
    """Build a record from a mapping; nested records from mappings, tuples from lists.

    where  the data stand, for messages. Raises SettingsError for unknown, missing or
    invalid rows.
    """
    rows, known = mapping(plain, where), rows_of(kind)
    try:
        for name, value in rows.items():
            if name not in known:
                raise SettingsError(unknown(name, known))
            rows[name] = checked(name, value, known[name].kind)
        for name, parameter in signature(kind).parameters.items():
            if parameter.default is parameter.empty and name not in rows:
                raise SettingsError(f"{name} is missing")
        return kind(**rows)
    except ValueError as error:
        raise SettingsError(f"{where}: {error}") from None


def checked(name: str, value: Any, hint: Any) -> Any:
    """Convert a row's value to its type hint. Raises SettingsError if it misfits."""
    kind, parts = get_origin(hint) or hint, get_args(hint)
    if kind is Any:
        return value
    if NoneType in parts:
        return None if value is None else checked(name, value, parts[0])
    if is_dataclass(kind) or hasattr(kind, "_fields"):
        return value if isinstance(value, kind) else record_from(kind, value, name)
    if kind is tuple:
        if not isinstance(value, list | tuple):
            raise SettingsError(f"{name} is {value!r:.60}: it must be a list")
        return tuple(checked(f"one of {name}", part, parts[0]) for part in value)
    if issubclass(kind, Mapping):
        found = mapping(value, name)
        return {key: checked(f"{name}: {key}", v, parts[1]) for key, v in found.items()}
    check_type(name, value, kind)
    return value


def mapping(value: Any, where: str) -> dict[str, Any]:
    """Check that a value is a mapping; None stands for an empty one."""
    if not isinstance(value, Mapping | None):
        raise SettingsError(
            f"{where}: this must be `key: value` lines, not {value!r:.60}"
        )
    return {str(key): row for key, row in (value or {}).items()}
