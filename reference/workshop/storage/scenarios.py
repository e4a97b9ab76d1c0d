"""Scenarios in words: what can be varied, KEY=VALUE, and where two of them differ."""

from collections.abc import Iterable, Mapping, Sequence
from types import NoneType
from typing import Any, get_args, get_origin, get_type_hints

from reference.paper import Scenario, limits
from reference.workshop.storage.files import LARGEST_NUMBER
from reference.workshop.storage.records import (
    SettingsError,
    record_from,
    whole_if_wanted,
)
from reference.workshop.storage.settings import number_or_word
from reference.workshop.storage.words import unknown_name

EXAMPLES = {
    "people_per_floor": "2,0,5: instead, on each floor, lowest first",
    "rooms": "1/hall,1/store: where people start; default: anywhere",
}
"""Examples of the fields that are lists."""

HINTS = get_type_hints(Scenario)
# each command sets `training` itself
KEYS = tuple(name for name in HINTS if name != "training")


def list_keys() -> str:
    """List what a scenario can vary, with units, ranges and defaults."""
    default = Scenario()
    about = dict(EXAMPLES)
    for name, (low, high, unit) in limits().items():
        about[name] = f"{low:,} to {high:,} {unit}; default: {getattr(default, name):g}"
    lines = ["", "scenario:"]
    lines += [f"  {name:<17} {about[name]}" for name in KEYS]
    return "\n".join(lines)


def read_stated(words: Sequence[str], already: Mapping[str, Any]) -> dict[str, Any]:
    """Read words like sight_range=8 or rooms=1/hall,1/store; add them to others.

    Raises InputError for an unknown key, one that is there already and a value that no
    scenario can have.
    """
    stated = dict(already)
    for word in words:
        key, _, text = word.partition("=")
        if key not in KEYS:
            raise SettingsError(unknown_name(key, KEYS))
        if not text:
            raise SettingsError(f"{key} has no value: write {key}=VALUE")
        if key in stated:
            raise SettingsError(f"{key} is there twice: name it once")
        stated[key] = _plain(text, HINTS[key])
    Scenario(**stated)  # refuses what cannot be
    return stated


def _plain(text: str, hint: Any) -> Any:
    """Read a number, or a list with commas; what is neither stays a word."""
    parts = get_args(hint)
    if NoneType in parts:
        return _plain(text, parts[0])
    if get_origin(hint) is tuple:
        return [_plain(part, parts[0]) for part in text.split(",")]
    if hint not in (int, float):
        return text
    number = number_or_word(text)
    if isinstance(number, str):
        return text
    if hint is float and abs(number) <= LARGEST_NUMBER:
        return float(number)
    return whole_if_wanted(number, hint)


def with_stated(base: Scenario, stated: Mapping[str, Any], where: str) -> Scenario:
    """Change fields of a scenario; people who are counted anew stand on all floors.

    where: the fields stand, for messages. Raises SettingsError.
    """
    rows = {**vars(base), **stated}
    if "people" in stated and "people_per_floor" not in stated:
        rows["people_per_floor"] = None
    if "people_per_floor" in stated and "people" not in stated:
        rows["people"] = Scenario().people  # as if nobody had counted
    made = record_from(Scenario, rows, where)
    counts = made.people_per_floor
    if "people" in stated and counts and sum(counts) != made.people:
        raise SettingsError(
            f"{where}: people is {made.people}, people_per_floor comes to "
            f"{sum(counts)}: leave one out"
        )
    return made


def kept_fields(scenario: Scenario, stated: Mapping[str, Any]) -> dict[str, Any]:
    """Tell what a scenario has where fields are stated; these, if they change nothing.

    They may be written in another way, as a list or as seconds between two ticks.
    """
    if with_stated(scenario, stated, "scenario") == scenario:
        return dict(stated)
    return {name: getattr(scenario, name) for name in stated}


def differing(one: Scenario, other: Scenario) -> list[str]:
    """Name the fields in which two scenarios differ, but for the rule of training."""
    return [name for name in KEYS if getattr(one, name) != getattr(other, name)]


def in_words(scenario: Scenario, names: Iterable[str]) -> str:
    """Write fields of a scenario as sight_range=2, rooms=1/hall,1/store."""
    words = []
    for name in names:
        value = getattr(scenario, name)
        if isinstance(value, tuple):
            shown = ",".join(map(str, value))
        else:
            shown = f"{value:g}" if isinstance(value, float) else str(value)
        words.append(f"{name}={shown}")
    return ", ".join(words)
