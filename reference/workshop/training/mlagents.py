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
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from reference.learning.settings import Side
from reference.workshop.files import read_text
from reference.workshop.plain import SettingsError, mapping, rows_of, unknown
from reference.workshop.remedies import SideSettings
from reference.workshop.training.presets import Settings, changed

PLACES = {
    ".".join((*row.section, name)): name
    for name, row in rows_of(SideSettings).items()
    if row.section is not None
}
"""Rows of the tables by where ML-Agents keeps them, as in hyperparameters.beta."""

OFF = (  # keys of a behaviour that are not built
    *("init_path", "even_checkpoints", "self_play", "behavioral_cloning"),
    *("hyperparameters.shared_critic", "network_settings.memory"),
    *("network_settings.deterministic", "network_settings.goal_conditioning_type"),
    *("reward_signals.curiosity", "reward_signals.gail", "reward_signals.rnd"),
)
PASS = (False, "hyper", "none")  # the last two of goal_conditioning_type
NO_EFFECT = ("threaded", "reward_signals.extrinsic.network_settings")
OF_UNITY = ("env_settings", "engine_settings", "torch_settings", "debug")
TOP = ("behaviors", "default_settings", "reference", "checkpoint_settings", *OF_UNITY)
NAMES: dict[Side, str] = {"robots": "Robot", "fire": "Fire"}  # of behaviours
MOST_BYTES = 1 << 16  # of a file


def read_yaml(path: str | os.PathLike[str], base: Settings) -> Settings:
    """Replace in `base` what a trainer file of ML-Agents, or one of ours, states.

    Notes on stderr which behaviour is taken for which side. Raises SettingsError, also
    without PyYAML, and OSError for an unreadable file.
    """
    text = read_text(Path(path), MOST_BYTES)
    try:
        top = mapping(_parsed(text), "the file")
        top["behaviors"] = mapping(top.get("behaviors"), "behaviors")
        rows = _stated(top, names := _sides(top["behaviors"]))
    except SettingsError as error:
        raise SettingsError(f"{path}: {error}") from None
    for side, name in names.items():
        print(f"note: {path}: '{name}' is taken for {side}", file=sys.stderr)
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


def _stated(top: dict[str, Any], names: Mapping[Side, str]) -> dict[str, Any]:
    """Collect the rows of whole settings that a file states; names: of behaviours."""
    for key in {key for key, value in top.items() if value is not None} - {*TOP}:
        raise SettingsError(unknown(key, TOP))
    ours = mapping(top.get("reference"), "reference")
    if "preset" in ours:
        raise SettingsError("reference: preset is an option of the command line")
    for side, name in NAMES.items():
        own = mapping(ours.pop(name, ours.get(side)), f"reference: {name}")
        own = {row: _number(value) for row, value in own.items()}
        rows = _rows(top.get("default_settings"), "default_settings")
        if side in names:
            rows |= _rows(top["behaviors"][names[side]], names[side])
        if "learning_rate_schedule" in rows:  # as ML-Agents documents
            both = ("beta_schedule", "epsilon_schedule")
            rows = dict.fromkeys(both, rows["learning_rate_schedule"]) | rows
        ours[side] = rows | own
    return ours


def _rows(section: Any, where: str) -> dict[str, Any]:
    """Collect the rows of a behaviour from its sections."""
    rows = {}
    for path, value in _flat(mapping(section, where)).items():
        if path in PLACES:
            rows[PLACES[path]] = _number(value)
        elif path.startswith(OFF) and value not in PASS:
            raise SettingsError(f"{where}: {path} is not built here: leave it out")
        elif not path.startswith((*OFF, *NO_EFFECT)):
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
    """Match sides to behaviours: the robots' is poca, or named so; the other is not."""
    found: dict[Side, list[str]] = {"robots": [], "fire": []}
    clear = not behaviours
    for name, rows in behaviours.items():
        poca = isinstance(rows, Mapping) and rows.get("trainer_type") == "poca"
        fire, robot = "fire" in name.lower(), "robot" in name.lower()
        found["robots" if poca or (robot and not fire) else "fire"].append(name)
        clear |= poca or fire or robot
    if not clear or max(map(len, found.values())) > 1:
        names = ", ".join(behaviours)
        raise SettingsError(f"behaviors: name {names} Robot and Fire")
    return {side: names[0] for side, names in found.items() if names}
