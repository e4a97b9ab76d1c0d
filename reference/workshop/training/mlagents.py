"""Trainer files of ML-Agents: find the rows of Tables I and II in their sections.

Clauses: E3 (ML-Agents 0.29.0), E1, E2 (its keys are the rows of Tables I and II).

    behaviors:
      Robot:                  one table: its rows lie in the sections that `Row` names
        trainer_type: poca
        hyperparameters: {batch_size: 1024, ...}
      Fire: ...
    default_settings: ...     what a behaviour leaves out
    reference: ...            what ML-Agents has no key for: {Robot: {head, ...},
                              Fire: ..., scenario: {...}, episodes_per_job, ...}

[E3, chosen] What the file leaves out stays as in the preset, not as ML-Agents would
have it: files of a few lines can then vary one of the tables.  Keys without a
counterpart here pass if their value switches them off, or if they are about Unity's
program or the machine; others are refused.
"""

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from reference.learning.settings import SIDES, Side
from reference.workshop.files import read_text
from reference.workshop.plain import SettingsError, mapping, rows_of, unknown
from reference.workshop.remedies import SideSettings
from reference.workshop.training.presets import Settings, changed

SECTIONS = {name: row.section for name, row in rows_of(SideSettings).items()}
OWN_ROWS = tuple(name for name, section in SECTIONS.items() if section is None)
PLACES = {
    ".".join((*section, name)): name
    for name, section in SECTIONS.items()
    if section is not None
}
"""Rows of the tables by where ML-Agents keeps them, as in hyperparameters.beta."""

OFF = {  # keys of a behaviour that are not built, and what is here instead
    "init_path": "--initialize-from on the command line",
    "even_checkpoints": "checkpoint_interval",
    "self_play": "the fire is the opponent, and both learn at once",
    "behavioral_cloning": "--imitate on the command line",
    "hyperparameters.shared_critic": "separate networks",
    "network_settings.memory": "none",
    "network_settings.deterministic": "evaluation takes the mean",
    "network_settings.goal_conditioning_type": "none",
    "reward_signals.curiosity": "the paper's reward",
    "reward_signals.gail": "the paper's reward",
    "reward_signals.rnd": "the paper's reward",
}
PASS = (False, "hyper", "none")  # the last two of goal_conditioning_type
NO_EFFECT = ("threaded", "reward_signals.extrinsic.network_settings")
OF_UNITY = ("env_settings", "engine_settings", "torch_settings", "debug")
TOP = ("behaviors", "default_settings", "reference", "checkpoint_settings", *OF_UNITY)
NAMES: dict[Side, str] = {"robots": "Robot", "fire": "Fire"}  # of behaviours
MOST_BYTES = 1 << 16  # of a file


def read_yaml(path: str | os.PathLike[str], base: Settings) -> Settings:
    """Replace in `base` what a trainer file of ML-Agents, or one of ours, states.

    Raises SettingsError, also without PyYAML, and OSError for an unreadable file.
    """
    text = read_text(Path(path), MOST_BYTES)
    try:
        rows = _stated(_parsed(text))
    except SettingsError as error:
        raise SettingsError(f"{path}: {error}") from None
    return changed(base, rows, str(path))


def _parsed(text: str) -> Any:
    """Parse a text of YAML into plain dicts, lists, numbers and words."""
    try:
        import yaml
    except ImportError:
        raise SettingsError(
            "ML-Agents' files need PyYAML: pip install PyYAML"
        ) from None
    try:
        if any(isinstance(event, yaml.AliasEvent) for event in yaml.parse(text)):
            raise ValueError("write out what *aliases stand for")
        return yaml.safe_load(text)
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        words = " ".join(str(error).split())
        raise SettingsError(f"this is no YAML: {words}") from None


def _stated(content: Any) -> dict[str, Any]:
    """Collect the rows of whole settings that a file states."""
    top = mapping(content, "the file")
    for key in {key for key, value in top.items() if value is not None} - {*TOP}:
        raise SettingsError(unknown(key, TOP))
    behaviours = mapping(top.get("behaviors"), "behaviors")
    names, ours = _sides(behaviours), mapping(top.get("reference"), "reference")
    for key in ours.keys() & {*SIDES, "preset"}:
        raise SettingsError(f"reference: {unknown(key, [*NAMES.values(), 'scenario'])}")
    for side, name in NAMES.items():
        stated = mapping(ours.pop(name, None), f"reference: {name}")
        own = {row: _number(value) for row, value in stated.items()}
        for row in own.keys() - {*OWN_ROWS}:
            raise SettingsError(f"reference: {name}: {unknown(row, OWN_ROWS)}")
        rows = _rows(top.get("default_settings"), "default_settings")
        if side in names:
            rows |= _rows(behaviours[names[side]], names[side])
        if "learning_rate_schedule" in rows:  # as ML-Agents documents
            both = ("beta_schedule", "epsilon_schedule")
            rows = dict.fromkeys(both, rows["learning_rate_schedule"]) | rows
        ours[side] = rows | own
    return ours


def _rows(section: Any, where: str) -> dict[str, Any]:
    """Collect the rows of a behaviour from its sections."""
    rows = {}
    for path, value in _flat(mapping(section, where)).items():
        off = [key for key in OFF if f"{path}.".startswith(f"{key}.")]
        if path in PLACES:
            rows[PLACES[path]] = _number(value)
        elif off and value not in PASS:
            raise SettingsError(
                f"{where}: {off[0]} is not built; leave it out. Here: {OFF[off[0]]}"
            )
        elif not off and not path.startswith(NO_EFFECT):
            raise SettingsError(f"{where}: {unknown(path, PLACES)}")
    return rows


def _flat(section: Mapping[Any, Any], over: str = "") -> dict[str, Any]:
    """Values by their paths, as in {"hyperparameters.beta": 0.01}; nulls left out."""
    flat: dict[str, Any] = {}
    for key, value in section.items():
        if isinstance(value, Mapping):
            flat |= _flat(value, f"{over}{key}.")
        elif value is not None:
            flat[f"{over}{key}"] = value
    return flat


def _number(value: Any) -> Any:
    """Read 1e-4, a word to YAML, and 5.0e6, no whole number to it, as numbers [E3]."""
    try:
        real = float(value) if isinstance(value, str | float) else value
    except ValueError:
        return value
    return int(real) if isinstance(real, float) and real.is_integer() else real


def _sides(behaviours: Mapping[str, Any]) -> dict[Side, str]:
    """Match sides to behaviours; one of two without a sign gets the side left."""
    found = {name: _sign(name, rows) for name, rows in behaviours.items()}
    left = [side for side in SIDES if side not in found.values()]
    if len(found) == 2 and len(left) == 1:
        found = {name: side or left[0] for name, side in found.items()}
    names = {side: name for name, side in found.items() if side}
    if len(names) < len(found):
        raise SettingsError(
            f"behaviors: this file has {', '.join(found)}: name them Robot and Fire"
        )
    return names


def _sign(name: str, rows: Any) -> Side | None:
    """Infer a behaviour's side from poca, for the fire is alone, or from its name."""
    if isinstance(rows, dict) and rows.get("trainer_type") == "poca":
        return "robots"
    shown: list[Side] = [side for side in SIDES if NAMES[side].lower() in name.lower()]
    return shown[-1] if shown else None
