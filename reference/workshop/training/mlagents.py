"""Trainer files of ML-Agents: find the rows of Tables I and II in their sections.

Clauses: E3 (ML-Agents 0.29.0), E1, E2 (its keys are the rows of Tables I and II).
This module knows where keys stand; `learning.settings` knows which values are valid.

    behaviors:
      Robot:                  one table: its rows lie in the sections that `Row` names
        trainer_type: poca
        hyperparameters: {batch_size: 1024, ...}
      Fire: ...
    default_settings: ...     what a behaviour leaves out
    reference: ...            ours, see OURS

[E3, chosen] ML-Agents refuses unknown keys: in a file for both, ours stand behind
`#= `, a comment to it. Keys of ML-Agents that have no counterpart here pass if their
value switches them off, and always if they are about Unity's program or the machine;
others are refused, each with a sentence.
"""

import math
import os
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from typing import Any

from reference.learning.settings import (
    Rows,
    SettingsError,
    rows_of,
    unknown,
)
from reference.workshop.files import read_text
from reference.workshop.plain import mapping
from reference.workshop.remedies import SideSettings

_ROWS = rows_of(SideSettings)
OWN_ROWS = tuple(name for name, row in _ROWS.items() if row.section is None)
HOMES = {n: row.section for n, row in _ROWS.items() if row.section is not None}
PATHS = tuple((*section, name) for name, section in HOMES.items())
SECTIONS = tuple(dict.fromkeys(p[:k] for p in PATHS for k in range(1, len(p))))

NO_OTHER_REWARD = "the paper's reward is the only one here"
OFF = {  # keys that are not built, and what to do instead; null and false pass
    "init_path": "name the checkpoint after --initialize-from",
    "even_checkpoints": "write a checkpoint_interval",
    "self_play": "the fire is the opponent, and both learn at once",
    "behavioral_cloning": "a strategy is imitated first with --imitate",
    "hyperparameters.shared_critic": "actor and critic are separate networks here",
    "network_settings.memory": "policies here have no memory, as in Tables I and II",
    "network_settings.deterministic": "learners explore; evaluation takes the mean",
    "network_settings.goal_conditioning_type": "there is no goal signal",
    "reward_signals.curiosity": NO_OTHER_REWARD,
    "reward_signals.gail": NO_OTHER_REWARD,
    "reward_signals.rnd": NO_OTHER_REWARD,
}
NO_EFFECT = (
    "threaded",  # nothing is in flight between rounds
    "reward_signals.extrinsic.network_settings",  # this signal has none
)

TOP = (
    *("behaviors", "default_settings", "reference", "environment_parameters"),
    # the command line says seeds, devices, folders:
    *("env_settings", "engine_settings", "checkpoint_settings", "torch_settings"),
    "debug",
)

OURS = "reference"
"""The block of what ML-Agents has no key for: {Robot: {head, reward_scale}, Fire: ...,
scenario: {...}, episodes_per_job, ...}."""
MARK = re.compile(r"^#= ?", re.MULTILINE)
MOST_BYTES, MOST_ENTRIES = 1 << 16, 10_000  # of a file, its anchors written out


@dataclass(frozen=True)
class TrainerFile:
    """What a file says: the rows of each side by name, and our own block."""

    robots: Rows
    fire: Rows
    ours: Rows


def read(path: str | os.PathLike[str]) -> TrainerFile:
    """Read the rows that a file states; the caller checks their values.

    Raises SettingsError, also without PyYAML, and OSError for an unreadable file.
    """
    try:
        text = read_text(Path(path), MOST_BYTES)
    except OSError as error:
        raise type(error)(f"cannot read {path}: {error.strerror}") from None
    return _file(_parsed(MARK.sub("", text)))


def _parsed(text: str) -> Any:
    """Parse a text of YAML into plain dicts, lists, numbers and words."""
    try:
        import yaml
    except ImportError:
        raise SettingsError(
            "ML-Agents' files need PyYAML: pip install PyYAML"
        ) from None
    try:
        _entries(yaml.compose(text, yaml.SafeLoader), {})
        return yaml.safe_load(text)
    except SettingsError:
        raise
    except yaml.MarkedYAMLError as error:
        place = error.problem_mark or error.context_mark
        raise SettingsError(f"line {place.line + 1}: {error.problem}") from None
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        raise SettingsError(f"this is no YAML: {error}") from None


def _entries(node: Any, counted: dict[int, float]) -> float:
    """Count a node's entries, those of an anchor each time that it is used.

    Raises SettingsError for too many, as in anchors of anchors, and for a repeated
    key: YAML would keep the last.
    """
    if node is None or isinstance(node.value, str):
        return 1
    if id(node) in counted:
        return counted[id(node)]
    counted[id(node)] = math.inf  # until it is known: it may contain itself
    lines: dict[str, int] = {}
    entries = 1.0
    for item in node.value:
        pair = item if isinstance(item, tuple) else (item,)
        key, line = pair[0].value, pair[0].start_mark.line + 1
        if len(pair) == 2 and isinstance(key, str):
            if key in lines:
                raise SettingsError(
                    f"line {line}: '{key}' stands here again, first on line "
                    f"{lines[key]}: keep one"
                )
            lines[key] = line
        entries += sum(_entries(child, counted) for child in pair)
        if entries > MOST_ENTRIES:
            raise SettingsError(f"line {line}: too many anchors in anchors: use fewer")
    counted[id(node)] = entries
    return entries


def _file(top: Any) -> TrainerFile:
    """Sort a whole file into the rows of the two sides and ours."""
    if top is None:
        raise SettingsError("this file is empty: give it `behaviors:`")
    top = mapping(top, "the file")
    for key in top:
        if key not in TOP:
            raise SettingsError(unknown(key, TOP))
    if top.get("environment_parameters"):
        raise SettingsError(
            "environment_parameters: parameters that Unity draws or teaches in lessons "
            "have no counterpart here: leave them out, state `reference: scenario:`"
        )
    run = mapping(top.get("checkpoint_settings"), "checkpoint_settings")
    for key in ("initialize_from", "resume"):
        if run.get(key):
            raise SettingsError(
                f"checkpoint_settings: {key} is asked for on the command line: "
                f"--{key.replace('_', '-')}; leave it out here"
            )
    behaviours = mapping(top.get("behaviors"), "behaviors")
    default = mapping(top.get("default_settings"), "default_settings")
    names = {side: name for name, side in _sides(behaviours).items()}
    robots, fire = (_side(behaviours, names.get(s), s, default) for s in SIDES)
    return TrainerFile(robots, fire, mapping(top.get(OURS), OURS))


def _side(
    behaviours: Mapping[str, Any], name: str | None, side: str, default: Rows
) -> Rows:
    """Collect one side's rows: its behaviour's override the default settings'."""
    own = behaviours[name] if name else None
    where = name or (f"default_settings, for {side}" if default else side)
    return dict(_rows(_merged(default, mapping(own, where)), (), where))


def _merged(under: Any, over: Any) -> Any:
    """Merge section by section; `over` wins."""
    if not (isinstance(under, dict) and isinstance(over, dict)):
        return over
    both = {key: _merged(under[key], over[key]) for key in over if key in under}
    return {**under, **over, **both}


def _rows(section: Any, at: tuple[str, ...], where: str) -> Iterator[tuple[str, Any]]:
    """Collect the rows of a behaviour from its sections."""
    where = ": ".join((where, *at[-1:]))
    for key, value in mapping(section, where).items():
        path = (*at, key)
        if path in SECTIONS:
            yield from _rows(value, path, where)
        elif path in PATHS:
            yield key, value
        elif ".".join(path) not in NO_EFFECT:
            _refuse_unless_off(key, value, at, where)


def _refuse_unless_off(key: str, value: Any, at: tuple[str, ...], where: str) -> None:
    """Raise SettingsError for an unknown key, or for one that is not built."""
    instead = OFF.get(".".join((*at, key)))
    if instead is None:
        here = [path[-1] for path in (*PATHS, *SECTIONS) if path[:-1] == at]
        raise SettingsError(f"{where}: {_misplaced(key, here) or unknown(key, here)}")
    no_goal = key == "goal_conditioning_type" and value in ("hyper", "none")
    if value not in (None, False) and not no_goal:
        raise SettingsError(f"{where}: {key} is not built: {instead}; leave it out")


def _misplaced(key: str, here: list[str]) -> str | None:
    """Say where a key belongs, if it matches, or nearly, one of another section."""
    meant = next(iter(get_close_matches(key, [*HOMES, *here], 1, 0.8)), None)
    if meant is None or meant in here:
        return None
    section = ": ".join(HOMES[meant]) or "the behaviour itself"
    return f"'{key}' is unknown here: '{meant}' belongs under {section}"


# -- Whose behaviour it is ----------------------------------------------------------

SIDES = ("Robot", "Fire")


def _sides(behaviours: Mapping[str, Any]) -> dict[str, str]:
    """Match behaviours to sides; one of two without a sign gets the side left."""
    found = {str(name): _sign(name, rows) for name, rows in behaviours.items()}
    left = [side for side in SIDES if side not in found.values()]
    if len(found) == 2 and len(left) == 1:
        found = {name: side or left[0] for name, side in found.items()}
    sides = {name: side for name, side in found.items() if side}
    if len(sides) < len(found) or len(set(sides.values())) < len(sides):
        raise SettingsError(
            "behaviors: one must be the robots' and one the fire's, and this file has "
            f"{', '.join(found)}: name them {' and '.join(SIDES)}"
        )
    return sides


def _sign(name: str, rows: Any) -> str | None:
    """Infer a behaviour's side from its name, or from poca: the fire is alone."""
    word = str(name).casefold()
    for side in SIDES:
        if word in (side.casefold(), f"{side.casefold()}s"):
            return side
    if isinstance(rows, dict) and rows.get("trainer_type") == "poca":
        return SIDES[0]
    shown = [side for side in SIDES if side.casefold() in word]
    return shown[0] if len(shown) == 1 else None
