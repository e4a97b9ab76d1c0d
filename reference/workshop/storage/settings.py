"""Read settings files, YAML and TOML: no key twice, and one reading of numbers.

YAML is read as ML-Agents writes it: mappings, lists, words, numbers, true and false.
What its versions read in two ways is refused, with what to write instead: TOML refuses
it too.
"""

import re
import tomllib
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any

from reference.workshop.storage.files import read_text
from reference.workshop.storage.records import SettingsError, checked_mapping

LARGEST_SETTINGS = 1 << 16
"""Bytes of a settings file: a small file may keep its reader busy for minutes."""

MOST_LEVELS = 20  # of sections in sections
MOST_POINTS = 200
"""In a line of TOML: its reader needs the square of their number for a dotted key."""

WHOLE = re.compile(r"[-+]?(0|[1-9][0-9_]*|0[xob][0-9a-fA-F_]+)")
REAL = re.compile(r"[-+]?([0-9][0-9_]*\.?[0-9_]*|\.[0-9][0-9_]*)([eE][-+]?[0-9]+)?")
NOT_FINITE = re.compile(r"[-+]?\.?(inf|nan)", re.IGNORECASE)
LEADING_ZERO = re.compile(r"[-+]?0[0-9_]+")
COLONS = re.compile(r"[-+]?[0-9][0-9_]*(:[0-5]?[0-9])+(\.[0-9_]*)?")

NOTHING = ("", "~", "null")
SWITCHES = {"true": True, "yes": True, "on": True}
SWITCHES |= {"false": False, "no": False, "off": False}


class Section(dict[str, Any]):
    """A mapping of a file, which knows the lines of its keys.

    lines: by key, from 1
    """

    def __init__(self) -> None:
        super().__init__()
        self.lines: dict[str, int] = {}

    def add(self, key: str, value: Any, line: int) -> None:
        """Add a key. Raises SettingsError for one that is there already."""
        if key in self:
            raise twice(key, self.lines[key], line)
        self[key] = value
        self.lines[key] = line


def checked_section(value: Any, where: str) -> Section:
    """Check that a value is a Section; None stands for an empty one."""
    checked_mapping(value, where)
    return value if isinstance(value, Section) else Section()


def twice(name: str, one: int, other: int) -> SettingsError:
    """Make the error about what is there twice, in two lines."""
    first, second = sorted((one, other))
    return SettingsError(
        f"{name:.99} is there twice, in lines {first} and {second}. Leave one out."
    )


# -- Files --------------------------------------------------------------------------


@contextmanager
def settings_errors_naming(path: Path) -> Iterator[None]:
    """Let SettingsErrors about a file name it."""
    try:
        yield
    except SettingsError as error:
        raise SettingsError(f"{path}: {error}") from None


def read_toml_file(path: Path) -> dict[str, Any]:
    """Read a settings file in TOML. Raises InputError, OSError."""
    text = read_text(path, LARGEST_SETTINGS)
    with settings_errors_naming(path):
        for number, line in enumerate(text.split("\n"), 1):
            if line.count(".") > MOST_POINTS:
                raise SettingsError(
                    f"line {number} has more than {MOST_POINTS} points. Write it on "
                    "several lines."
                )
        try:
            content = tomllib.loads(text)
        except (ValueError, RecursionError) as error:  # also of 5,000 digits
            raise SettingsError(f"this is no TOML: {error!s:.200}") from None
        _refuse_levels(content)
        return content


def _refuse_levels(plain: Any, left: int = MOST_LEVELS) -> None:
    """Raise SettingsError for sections in sections that no reader can follow."""
    if not left:
        raise _too_many_levels()
    if isinstance(plain, list | dict):
        for part in plain.values() if isinstance(plain, dict) else plain:
            _refuse_levels(part, left - 1)


def _too_many_levels() -> SettingsError:
    return SettingsError(f"more than {MOST_LEVELS} levels. Leave some out.")


def read_yaml_file(path: Path) -> Any:
    """Read a settings file in YAML; mappings are Sections.

    Raises InputError, also without PyYAML, and OSError.
    """
    text = read_text(path, LARGEST_SETTINGS)
    with settings_errors_naming(path), _refusals_of_yaml():
        content = _plain(_tree(text))
        _refuse_levels(content)
        return content


@contextmanager
def _refusals_of_yaml() -> Iterator[None]:
    """Put into words what PyYAML says, or that it is not there."""
    try:
        import yaml
    except ImportError:
        raise SettingsError("a YAML file needs PyYAML: pip install PyYAML") from None
    try:
        yield
    except RecursionError:
        raise _too_many_levels() from None
    except yaml.YAMLError as error:
        words = " ".join(str(error).replace('in "<unicode string>",', "at").split())
        raise SettingsError(f"this is no YAML: {words:.200}") from None


def _tree(text: str) -> Any:
    """Parse a text of YAML into nodes, which tell their lines; None for no text."""
    loader = _loader()(text)
    try:
        return loader.get_single_node()
    finally:
        loader.dispose()


@cache
def _loader() -> Any:
    """Make the class that parses YAML, all scalars as words."""
    import yaml

    class Loader(yaml.BaseLoader):
        """Refuses aliases: aliases of aliases make a gigabyte of a few lines."""

        def compose_node(self, parent: Any, index: Any) -> Any:
            """Make a node."""
            if self.check_event(yaml.AliasEvent):
                event = self.peek_event()
                raise SettingsError(
                    f"line {event.start_mark.line + 1}: *{event.anchor:.60} stands for "
                    "something else. Write it out here, please."
                )
            return super().compose_node(parent, index)

    return Loader


PLAIN_TAGS = tuple(f"tag:yaml.org,2002:{kind}" for kind in ("str", "seq", "map"))


def _plain(node: Any) -> Any:
    """Turn a node into Sections, lists, words, numbers, true, false and None."""
    if node is None:
        return None
    line = node.start_mark.line + 1
    if node.tag not in PLAIN_TAGS:
        raise SettingsError(f"line {line}: leave out the tag {node.tag:.60}.")
    if node.id == "scalar":
        # style: how it is quoted
        return node.value if node.style else _value_of(node.value, line)
    if node.id == "sequence":
        return [_plain(part) for part in node.value]
    section = Section()
    for key, value in node.value:
        at = key.start_mark.line + 1
        if key.id != "scalar":
            raise SettingsError(f"line {at}: a name must be a word.")
        section.add(key.value, _plain(value), at)
    return section


# -- Values -------------------------------------------------------------------------


def _value_of(word: str, line: int) -> Any:
    """Read an unquoted word of YAML."""
    if word.lower() in NOTHING:
        return None
    if word.lower() in SWITCHES:
        return SWITCHES[word.lower()]
    try:
        return number_or_word(word)
    except SettingsError as error:
        raise SettingsError(f"line {line}: {error}") from None


def number_or_word(word: str) -> int | float | str:
    """Read a number as TOML and YAML 1.2 do: 12, 1_000, 0x10, 0.5, 1e-4, 1.0e6, inf.

    What is none stays a word. Raises SettingsError for what some read in another way:
    010 (10, or 8 as an octal number), 1:30 (90, or a word).
    """
    if LEADING_ZERO.fullmatch(word):
        decimal = word.lstrip("+-0_") or "0"
        raise SettingsError(
            f"{word:.60} begins with 0, and some count by eights then. Write "
            f"{'-' if word[0] == '-' else ''}{decimal:.60}."
        )
    if COLONS.fullmatch(word):
        raise SettingsError(
            f"{word:.60} is minutes and seconds to some. Write one number."
        )
    try:
        if WHOLE.fullmatch(word):
            return int(word, 0)
        if REAL.fullmatch(word):
            return float(word)
        if NOT_FINITE.fullmatch(word):
            return float(word.replace(".", ""))
    except ValueError:  # 1__0, or 5,000 digits
        return word
    return word
