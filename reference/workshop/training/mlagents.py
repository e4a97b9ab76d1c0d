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

[E3, chosen] Keys of ML-Agents that have no counterpart here pass if their value
switches them off, and always if they are about Unity's program or the machine; others
are refused, each with a sentence.
"""

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from reference.learning.settings import SIDES, Rows, Side
from reference.workshop.files import read_text
from reference.workshop.plain import SettingsError, mapping, rows_of, unknown
from reference.workshop.remedies import SideSettings

_ROWS = rows_of(SideSettings)
OWN_ROWS = tuple(name for name, row in _ROWS.items() if row.section is None)
PLACES = {
    ".".join((*row.section, name)): name
    for name, row in _ROWS.items()
    if row.section is not None
}
"""Rows of the tables by where ML-Agents keeps them, as in hyperparameters.beta."""

OFF = {  # keys that are not built, and what to do instead; null and false pass
    "environment_parameters": "state `reference: scenario:`",
    "checkpoint_settings.initialize_from": "use --initialize-from on the command line",
    "checkpoint_settings.resume": "use --resume on the command line",
    "init_path": "use --initialize-from on the command line",
    "even_checkpoints": "write a checkpoint_interval",
    "self_play": "the fire is the opponent, and both learn at once",
    "behavioral_cloning": "use --imitate on the command line",
    "hyperparameters.shared_critic": "actor and critic are separate networks here",
    "network_settings.memory": "policies here have no memory",
    "network_settings.deterministic": "learners explore; evaluation takes the mean",
    "network_settings.goal_conditioning_type": "there is no goal signal",
    **{
        f"reward_signals.{name}": "the paper's reward is the only one here"
        for name in ("curiosity", "gail", "rnd")
    },
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
MOST_BYTES = 1 << 16  # of a file


def read(path: str | os.PathLike[str]) -> tuple[Rows, dict[Side, str]]:
    """Read the rows that a file states, and the name of each side's behaviour.

    The rows are those of whole settings, with robots, fire and scenario nested; the
    caller checks their values. Raises SettingsError, also without PyYAML, and OSError
    for an unreadable file.
    """
    top = mapping(_parsed(read_text(Path(path), MOST_BYTES)), "the file")
    again = mapping(top.get("checkpoint_settings"), "checkpoint_settings")
    for key in top.keys() - {*TOP}:
        raise SettingsError(unknown(key, TOP))
    again = {f"checkpoint_settings.{key}": value for key, value in again.items()}
    for key, value in (top | again).items():
        _refuse_unless_off(key, value, "the file")
    behaviours = mapping(top.get("behaviors"), "behaviors")
    names, ours = _sides(behaviours), mapping(top.get(OURS), OURS)
    for key in ours.keys() & {*SIDES, "preset"}:
        raise SettingsError(f"{OURS}: {unknown(key, [*NAMES.values(), 'scenario'])}")
    for side, name in NAMES.items():
        own = mapping(ours.pop(name, None), f"{OURS}: {name}")
        for row in own.keys() - {*OWN_ROWS}:
            raise SettingsError(f"{OURS}: {name}: {unknown(row, OWN_ROWS)}")
        sections = {"default_settings": top.get("default_settings")}
        if side in names:
            sections[names[side]] = behaviours[names[side]]
        ours[side] = _side(sections) | own
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
        events = yaml.parse(text, yaml.SafeLoader)
        if any(isinstance(event, yaml.AliasEvent) for event in events):
            raise SettingsError(
                "write out what *aliases stand for: they may be endless"
            )
        return yaml.safe_load(text)
    except SettingsError:
        raise
    except yaml.MarkedYAMLError as error:
        place = error.problem_mark or error.context_mark
        raise SettingsError(f"line {place.line + 1}: {error.problem}") from None
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        raise SettingsError(f"this is no YAML: {error}") from None


def _side(sections: Mapping[str, Any]) -> dict[str, Any]:
    """Collect one side's rows; those of later sections override.

    Schedules left out are the learning rate's, as ML-Agents documents.
    """
    rows: dict[str, Any] = {}
    for where, section in sections.items():
        rows |= _rows(section, "", where)
    if "learning_rate_schedule" in rows:
        both = ("beta_schedule", "epsilon_schedule")
        rows = dict.fromkeys(both, rows["learning_rate_schedule"]) | rows
    return rows


def _rows(section: Any, over: str, where: str) -> dict[str, Any]:
    """Collect the rows of a behaviour from its sections."""
    rows: dict[str, Any] = {}
    for key, value in mapping(section, where).items():
        path = over + key
        if path in PLACES:
            rows[key] = value
        elif path in OFF:
            _refuse_unless_off(path, value, where)
        elif any(place.startswith(f"{path}.") for place in PLACES):
            rows |= _rows(value, f"{path}.", f"{where}: {key}")
        elif path not in NO_EFFECT:
            elsewhere = [place for place, row in PLACES.items() if row == key]
            belongs = f" It belongs to {elsewhere[0]}." if elsewhere else ""
            raise SettingsError(f"{where}: {unknown(path, PLACES)}{belongs}")
    return rows


def _refuse_unless_off(path: str, value: Any, where: str) -> None:
    """Raise SettingsError for a key that is not built, unless it is switched off."""
    if path in OFF and value not in (None, False, *NO_GOAL):
        raise SettingsError(f"{where}: {path} is not built: {OFF[path]}; leave it out")


def _sides(behaviours: Mapping[str, Any]) -> dict[Side, str]:
    """Match sides to behaviours; one of two without a sign gets the side left."""
    found = {name: _sign(name, rows) for name, rows in behaviours.items()}
    left = [side for side in SIDES if side not in found.values()]
    if len(found) == 2 and len(left) == 1:
        found = {name: side or left[0] for name, side in found.items()}
    names = {side: name for name, side in found.items() if side}
    if len(names) < len(found):
        raise SettingsError(
            f"behaviors: this file has {', '.join(found)}: name them "
            f"{' and '.join(NAMES.values())}"
        )
    return names


def _sign(name: str, rows: Any) -> Side | None:
    """Infer a behaviour's side from poca, for the fire is alone, or from its name."""
    if isinstance(rows, dict) and rows.get("trainer_type") == "poca":
        return "robots"
    shown = [s for s in SIDES if NAMES[s].casefold() in name.casefold()]
    return shown[0] if len(shown) == 1 else None
