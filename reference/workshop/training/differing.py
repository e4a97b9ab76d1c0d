"""What differs between trainings that are compared: their buildings and settings."""

from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

from reference.learning.settings import SIDES
from reference.workshop.training.checkpoints import (
    Task,
    load_checkpoint,
    newest_checkpoint,
    player_names,
)

MOST_TOLD = 6  # settings


def tasks_of(folders: Mapping[str, Path]) -> dict[str, Task]:
    """Read the tasks of trainings by name; a folder without a checkpoint has none.

    folders: or the tables in them
    """
    tasks = {}
    for name, path in folders.items():
        newest = newest_checkpoint(path if path.is_dir() else path.parent)
        if newest:
            tasks[name] = load_checkpoint(newest).task
    return tasks


def differences(tasks: Mapping[str, Task]) -> str:
    """Say in a line what differs: "head: floor | mixture; seed: 1 | 2"; "" for nothing.

    The values stand in the order of the trainings; one may have commas in it.
    """
    settings = [settings_of(task) for task in tasks.values()]
    told = []
    for name in dict.fromkeys(name for each in settings for name in each):
        values = [each.get(name) for each in settings]
        if any(value != values[0] for value in values):
            told.append(f"{name}: {' | '.join(map(_in_words, values))}")
    if len(told) > MOST_TOLD:
        told[MOST_TOLD:] = [f"and {len(told) - MOST_TOLD} more"]
    return "; ".join(told)


def settings_of(task: Task) -> dict[str, Any]:
    """List all that defines a training, by dotted names such as robots.head."""
    facts = {
        "building": task.building,
        "seed": task.seed,
        "imitate": task.imitate or "nobody",
        "begins with": player_names(task.initial.values()) or "random weights",
    }
    for side in SIDES:
        players = task.fixed.get(side)
        facts[side] = player_names(players) if players else "learns"
    return facts | _flat(asdict(task.settings))


def _flat(values: Mapping[str, Any], within: str = "") -> dict[str, Any]:
    """Turn nested mappings into one, with names joined by dots."""
    flat: dict[str, Any] = {}
    for name, value in values.items():
        if isinstance(value, Mapping):
            flat |= _flat(value, f"{within}{name}.")
        else:
            flat[within + name] = value
    return flat


def _in_words(value: object) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)
