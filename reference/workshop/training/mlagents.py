"""Trainer files of ML-Agents: find the rows of Tables I and II in their sections.

Its keys are the rows of the tables [E1] [E2].

    behaviors:
      Robot:                  one table: its rows lie in the sections that `Row` names
        trainer_type: poca
        hyperparameters: {batch_size: 1024, ...}
      Fire: ...
    default_settings: ...     what a behaviour leaves out
    reference: ...            what ML-Agents has no key for: {Robot: {head, ...},
                              Fire: ..., scenario: {...}, episodes_per_job, ...}

[E3, chosen] What the file leaves out stays as in the preset, not as ML-Agents would
have it: files of a few lines can then vary one of the tables.  The head alone is
ML-Agents' own, one Gaussian, unless `reference` or the command line names another.
Keys without a counterpart here pass if their value switches them off, or if they are
about Unity's program or the machine; others are refused, all at once.
"""

import sys
from collections.abc import Mapping
from itertools import accumulate
from pathlib import Path
from typing import Any

from reference.learning.settings import Side
from reference.workshop.anchors.settings import SideSettings
from reference.workshop.storage.files import read_text
from reference.workshop.storage.records import (
    SettingsError,
    checked_mapping,
    did_you_mean,
    rows_of,
)
from reference.workshop.training.presets import Settings, with_rows

PLACES = {
    ".".join((*row.section, name)): name
    for name, row in rows_of(SideSettings).items()
    if row.section is not None
}
"""Rows of the tables by where ML-Agents keeps them, as in hyperparameters.beta."""

PASSED_OVER = {
    "hyperparameters.shared_critic": (False,),
    "network_settings.deterministic": (False,),
    "network_settings.goal_conditioning_type": ("hyper", "none"),
    "even_checkpoints": (False,),
    "threaded": (False, True),
}
"""What passes without a counterpart: values that switch it off or have no effect."""

NO_EFFECT = "reward_signals.extrinsic.network_settings."
OF_UNITY = ("env_settings", "engine_settings", "torch_settings", "debug")
TOP = ("behaviors", "default_settings", "reference", "checkpoint_settings", *OF_UNITY)
BEHAVIOUR_NAMES: dict[Side, str] = {"robots": "Robot", "fire": "Fire"}  # of behaviours


def read_yaml(path: Path, base: Settings) -> Settings:
    """Replace in `base` what a trainer file of ML-Agents, or one of ours, states.

    Notes on stderr which behaviour is taken for which side. Raises SettingsError, also
    without PyYAML, and OSError for an unreadable file.
    """
    text = read_text(path)
    try:
        top = checked_mapping(_parsed(text), "the file")
        for key, value in top.items():
            if value is not None and key not in TOP:
                lost = f"unknown, or not built here: {key}. Leave it out."
                raise SettingsError(lost + did_you_mean(key, TOP))
        behaviours = checked_mapping(top.get("behaviors"), "behaviors")
        names = _sides(behaviours)
        parts = {"default_settings": top.get("default_settings"), **behaviours}
        rows = _stated(
            _rows(parts), names, checked_mapping(top.get("reference"), "reference")
        )
    except SettingsError as error:
        raise SettingsError(f"{path}: {error}") from None
    made = with_rows(base, rows, str(path))
    for side, name in names.items():
        print(f"note: {path}: '{name}' is taken for {side}", file=sys.stderr)
    return made


def _parsed(text: str) -> Any:
    """Parse a text of YAML into plain dicts, lists, numbers and words."""
    try:
        import yaml
    except ImportError:
        raise SettingsError("a YAML file needs PyYAML: pip install PyYAML") from None
    try:
        # Aliases of aliases make a gigabyte of a few lines.
        if any(isinstance(event, yaml.AliasEvent) for event in yaml.parse(text)):
            raise ValueError("write out what *aliases stand for")
        return yaml.safe_load(text)
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        words = " ".join(str(error).replace('in "<unicode string>",', "at").split())
        raise SettingsError(f"this is no YAML: {words}") from None


def _sides(behaviours: Mapping[str, Any]) -> dict[Side, str]:
    """Match sides to behaviours: by name, or as a poca, which is the robots'."""
    of_sides: dict[Side, list[str]] = {"robots": [], "fire": []}
    clear = not behaviours
    for name, rows in behaviours.items():
        poca = isinstance(rows, Mapping) and rows.get("trainer_type") == "poca"
        fire = "fire" in name.lower()
        robot = "robot" in name.lower()
        # FireRobots, or neither word: a group can only be the robots.
        robots = robot if fire != robot else poca
        of_sides["robots" if robots else "fire"].append(name)
        clear |= poca or fire or robot
    if not clear or max(map(len, of_sides.values())) > 1:
        names = ", ".join(behaviours)
        raise SettingsError(
            f"behaviors: who are {names}? Name the robots' Robot, the fire's Fire, and "
            "leave others out"
        )
    return {side: names[0] for side, names in of_sides.items() if names}


def _stated(
    parts: Mapping[str, dict[str, Any]], names: Mapping[Side, str], ours: dict[str, Any]
) -> dict[str, Any]:
    """Collect the rows of whole settings that a file states.

    parts: rows of the defaults and of behaviours;  names: of behaviours;  ours: rows
    that ML-Agents does not have
    """
    for side, name in BEHAVIOUR_NAMES.items():
        own = checked_mapping(ours.pop(name, ours.get(side)), f"reference: {name}")
        own = {row: _number(value) for row, value in own.items()}
        rows = parts["default_settings"]
        if side in names:  # written for ML-Agents, which has that head alone
            rows = rows | {"head": "floor"} | parts[names[side]]
        if "learning_rate_schedule" in rows:  # as ML-Agents documents
            both = ("beta_schedule", "epsilon_schedule")
            rows = dict.fromkeys(both, rows["learning_rate_schedule"]) | rows
        ours[side] = rows | own
    return ours


def _rows(parts: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Collect the rows of the defaults and of behaviours from their sections.

    Raises SettingsError that names all keys without a counterpart.
    """
    rows: dict[str, dict[str, Any]] = {}
    lost = set[tuple[str, str]]()
    for part, sections in parts.items():
        rows[part] = {}
        for at, value in _flat(checked_mapping(sections, part)).items():
            passes = value in PASSED_OVER.get(at, ()) or at.startswith(NO_EFFECT)
            if at in PLACES:
                rows[part][PLACES[at]] = _number(value)
            elif not passes:
                lost.add((part, _section(at)))
    if lost:
        hint = did_you_mean(min(lost)[1], PLACES) if len(lost) == 1 else ""
        words = "; ".join(f"{part}: {at}" for part, at in sorted(lost))
        raise SettingsError(f"unknown, or not built here: {words}. Leave it out.{hint}")
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


def _section(at: str) -> str:
    """The part of a path that ends where no row of the tables is below any more."""
    for head in accumulate(at.split("."), "{}.{}".format):
        if not any(place.startswith(f"{head}.") for place in PLACES):
            return head
    return at


def _number(value: Any) -> Any:
    """Read 1e-4, a word to YAML, and 5.0e6, none whole [E3, settings.py]."""
    try:
        real = float(value) if isinstance(value, str | float) else value
    except ValueError:
        return value
    return int(real) if isinstance(real, float) and real.is_integer() else real
