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

import os
import re
from collections.abc import Iterator, Mapping
from difflib import get_close_matches
from pathlib import Path
from typing import Any

from reference.learning.settings import SIDES, Rows, Side
from reference.workshop.files import read_text
from reference.workshop.plain import SettingsError, mapping, rows_of, unknown
from reference.workshop.remedies import SideSettings

_ROWS = rows_of(SideSettings)
OWN_ROWS = tuple(name for name, row in _ROWS.items() if row.section is None)
HOMES = {n: row.section for n, row in _ROWS.items() if row.section is not None}
PATHS = tuple((*section, name) for name, section in HOMES.items())
SECTIONS = tuple(dict.fromkeys(p[:k] for p in PATHS for k in range(1, len(p))))

NO_OTHER_REWARD = "the paper's reward is the only one here"
OFF = {  # keys that are not built, and what to do instead; null and false pass
    "environment_parameters": "Unity draws these, or teaches them in lessons; state "
    "`reference: scenario:`",
    "checkpoint_settings.initialize_from": "use --initialize-from on the command line",
    "checkpoint_settings.resume": "use --resume on the command line",
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
NO_GOAL = ("hyper", "none")  # of goal_conditioning_type

OURS = "reference"
"""The block of what ML-Agents has no key for: {Robot: {head, reward_scale}, Fire: ...,
scenario: {...}, episodes_per_job, ...}."""
TOP = (
    *("behaviors", "default_settings", OURS, "environment_parameters"),
    # the command line says seeds, devices, folders:
    *("env_settings", "engine_settings", "checkpoint_settings", "torch_settings"),
    "debug",
)
NAMES: dict[Side, str] = {"robots": "Robot", "fire": "Fire"}  # of behaviours
MARK = re.compile(r"^#= ?", re.MULTILINE)
MOST_BYTES = 1 << 16  # of a file


def read(path: str | os.PathLike[str]) -> tuple[Rows, dict[Side, str]]:
    """Read the rows that a file states, and the name of each side's behaviour.

    The rows are those of whole settings, with robots, fire and scenario nested; the
    caller checks their values. Raises SettingsError, also without PyYAML, and OSError
    for an unreadable file.
    """
    try:
        text = read_text(Path(path), MOST_BYTES)
    except OSError as error:
        raise type(error)(f"cannot read {path}: {error.strerror}") from None
    top = _parsed(MARK.sub("", text))
    if top is None:
        raise SettingsError("this file is empty: give it `behaviors:`")
    top = mapping(top, "the file")
    for key, value in top.items():
        if key not in TOP:
            raise SettingsError(unknown(key, TOP))
        _refuse_unless_off((key,), value, "the file")
    for key, value in mapping(top.get("checkpoint_settings"), "it").items():
        _refuse_unless_off(("checkpoint_settings", key), value, "the file")
    behaviours = mapping(top.get("behaviors"), "behaviors")
    default = mapping(top.get("default_settings"), "default_settings")
    names, ours = _sides(behaviours), mapping(top.get(OURS), OURS)
    known = [*NAMES.values(), "scenario"]
    for key in ours.keys() & {*SIDES, "preset"}:
        raise SettingsError(f"{OURS}: {unknown(key, known)}")
    for side, name in NAMES.items():
        own = _own_rows(ours.pop(name, None), name)
        ours[side] = {**_side(behaviours, names.get(side), side, default), **own}
    return ours, names


def _parsed(text: str) -> Any:
    """Parse a text of YAML into plain dicts, lists, numbers and words."""
    try:
        import yaml
    except ImportError:
        raise SettingsError(
            "ML-Agents' files need PyYAML: pip install PyYAML"
        ) from None
    try:
        for event in yaml.parse(text, yaml.SafeLoader):
            if isinstance(event, yaml.AliasEvent):  # written out they may be endless
                raise SettingsError(
                    f"line {event.start_mark.line + 1}: write out what "
                    f"'*{event.anchor}' stands for"
                )
        _refuse_repeated(yaml.compose(text, yaml.SafeLoader))
        return yaml.safe_load(text)
    except SettingsError:
        raise
    except yaml.MarkedYAMLError as error:
        place = error.problem_mark or error.context_mark
        raise SettingsError(f"line {place.line + 1}: {error.problem}") from None
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        raise SettingsError(f"this is no YAML: {error}") from None


def _refuse_repeated(node: Any) -> None:
    """Raise SettingsError for a key that stands twice: YAML would keep the last."""
    lines: dict[str, int] = {}
    for item in [] if node is None or isinstance(node.value, str) else node.value:
        key, *values = item if isinstance(item, tuple) else (item,)
        line = key.start_mark.line + 1
        if values and str(key.value) in lines:
            raise SettingsError(
                f"line {line}: '{key.value}' stands here again, first on line "
                f"{lines[key.value]}: keep one"
            )
        lines[str(key.value)] = line
        for each in (key, *values):
            _refuse_repeated(each)


# -- A behaviour --------------------------------------------------------------------


def _side(
    behaviours: Mapping[str, Any], name: str | None, side: str, default: Rows
) -> Rows:
    """Collect one side's rows: its behaviour's override the default settings'.

    Schedules left out are the learning rate's, as ML-Agents documents.
    """
    own = behaviours[name] if name else None
    where = name or (f"default_settings, for {side}" if default else side)
    rows = dict(_rows(_merged(default, mapping(own, where)), (), where))
    if "learning_rate_schedule" in rows:
        both = ("beta_schedule", "epsilon_schedule")
        rows = dict.fromkeys(both, rows["learning_rate_schedule"]) | rows
    return rows


def _own_rows(rows: Any, name: str) -> Rows:
    """One side's rows in our block. Raises SettingsError for others."""
    where = f"{OURS}: {name}"
    for row in (rows := mapping(rows, where)):
        if row not in OWN_ROWS:
            raise SettingsError(f"{where}: {unknown(row, OWN_ROWS)}")
    return rows


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
        elif ".".join(path) in OFF:
            _refuse_unless_off(path, value, where)
        elif ".".join(path) not in NO_EFFECT:
            here = [p[-1] for p in (*PATHS, *SECTIONS) if p[:-1] == at]
            why = _misplaced(key, here) or unknown(key, here)
            raise SettingsError(f"{where}: {why}")


def _refuse_unless_off(path: tuple[str, ...], value: Any, where: str) -> None:
    """Raise SettingsError for a key that is not built, unless it is switched off."""
    instead, key = OFF.get(".".join(path)), path[-1]
    no_goal = key == "goal_conditioning_type" and value in NO_GOAL
    if instead and value not in (None, False) and not no_goal:
        raise SettingsError(f"{where}: {key} is not built: {instead}; leave it out")


def _misplaced(key: str, here: list[str]) -> str | None:
    """Say where a key belongs, if it matches, or nearly, one of another section."""
    meant = next(iter(get_close_matches(key, [*HOMES, *here], 1, 0.8)), None)
    if meant is None or meant in here:
        return None
    section = ": ".join(HOMES[meant]) or "the behaviour itself"
    return f"'{key}' is unknown here: '{meant}' belongs under {section}"


# -- Whose behaviour it is ----------------------------------------------------------


def _sides(behaviours: Mapping[str, Any]) -> dict[Side, str]:
    """Match sides to behaviours; one of two without a sign gets the side left."""
    found = {name: _sign(name, rows) for name, rows in behaviours.items()}
    left = [side for side in SIDES if side not in found.values()]
    if len(found) == 2 and len(left) == 1:
        found = {name: side or left[0] for name, side in found.items()}
    names = {side: name for name, side in found.items() if side}
    if len(names) < len(found):
        raise SettingsError(
            "behaviors: one must be the robots' and one the fire's, and this file has "
            f"{', '.join(found)}: name them {' and '.join(NAMES.values())}"
        )
    return names


def _sign(name: str, rows: Any) -> Side | None:
    """Infer a behaviour's side from its name, or from poca: the fire is alone."""
    word = name.casefold()
    shown = [s for s in SIDES if NAMES[s].casefold() in word]
    exact = [s for s in shown if word.rstrip("s") == NAMES[s].casefold()]
    if not exact and isinstance(rows, dict) and rows.get("trainer_type") == "poca":
        return "robots"
    return exact[0] if exact else shown[0] if len(shown) == 1 else None
