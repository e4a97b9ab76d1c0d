"""Begin a training by the options of `train`, or resume one from its folder."""

import sys
from argparse import Namespace
from collections.abc import Collection, Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from reference.building import Building, building_of
from reference.fire import lightable
from reference.learning.players import LearnedNetwork
from reference.learning.settings import SIDES, Side
from reference.paper import InputError, Scenario
from reference.workshop import maps
from reference.workshop.storage.runs import refuse_numbers, refuse_version
from reference.workshop.storage.scenarios import kept_fields, with_stated
from reference.workshop.storage.settings import read_yaml_file
from reference.workshop.training import checkpoints
from reference.workshop.training.checkpoints import CheckpointError, Task, player_names
from reference.workshop.training.families import RANDOM, family_of, map_named
from reference.workshop.training.mlagents import with_trainer_file
from reference.workshop.training.policies import fixed_player, network_of
from reference.workshop.training.presets import Settings, preset
from reference.workshop.training.rounds import NETWORK_ROWS, Training

OPTIONS = ("preset", "settings", "building", "trainer", "head", *SIDES, "imitate")
OPTIONS += ("initialize_from", "seed", "scenario")
"""What defines a training; None where it was not asked for."""

DEFAULT_BUILDINGS = {"tiny": "tiny", "any": RANDOM}
"""Of presets; else paper."""


def begin_training(asked: Namespace) -> Training:
    """Begin a training; by default preset laptop on the paper's building.

    Raises SettingsError, CheckpointError for a side that does not fit, MistakesError
    for the map, OSError for an unreadable file.
    """
    read = None if asked.settings is None else read_yaml_file(asked.settings)
    settings, notes = _settings(asked, read)
    names = asked.building or [DEFAULT_BUILDINGS.get(settings.preset, "paper")]
    family = family_of(names, _stated_scenario(asked, read, settings.scenario))
    building = map_named(names[0]) if family is None else None

    fixed = _fixed_players(asked, settings, building)
    initial = _networks_to_begin_with(asked, fixed, building, settings.scenario)
    if initial:
        settings, notes = _settings(asked, read, initial)
    if initial and asked.imitate:
        notes.append(
            "robots imitate, and begin with random weights: of "
            f"{asked.initialize_from} only the fire is taken"
        )
    for note in notes:
        print(f"note: {note}", file=sys.stderr)

    if building is not None and "fire" not in fixed and not lightable(building).any():
        raise InputError(
            f"{building.title}: nothing can burn there. Draw more, or take --fire none."
        )
    task = Task(
        building=" ".join(names),
        plan="" if building is None else maps.plan_of(building),
        settings=settings,
        seed=asked.seed or 0,
        fixed=fixed,
        initial=initial,
        imitate=asked.imitate,
        family=family,
    )
    return Training(task)


def _fixed_players(
    asked: Namespace,
    settings: Settings,
    building: Building | None,
) -> dict[Side, tuple[LearnedNetwork | str, ...]]:
    """Find who plays the sides that do not learn, by what was asked for.

    building: None for a family. Raises as `fixed_player` does.
    """
    fixed: dict[Side, tuple[LearnedNetwork | str, ...]] = {}
    for side in SIDES:
        words = getattr(asked, side)
        if side == "fire" and words is None and _never_plays(asked, settings):
            words = list(settings.stand_ins)
        if words is not None:
            fixed[side] = tuple(
                fixed_player(word, side, building, settings.scenario) for word in words
            )
    return fixed


def _networks_to_begin_with(
    asked: Namespace,
    fixed: Collection[Side],
    building: Building | None,
    scenario: Scenario,
) -> dict[Side, Any]:
    """Take the networks of a checkpoint for those who learn there and here.

    Robots that imitate begin with random ones. Raises CheckpointError if nobody learned
    there who learns here, else as `network_of`.
    """
    path = asked.initialize_from
    if path is None:
        return {}
    made = checkpoints.load_checkpoint(path)
    taken = set(fixed)
    if asked.imitate:
        taken.add("robots")
    initial = {
        side: network_of(path, side, building, scenario)
        for side in SIDES
        if side not in taken and made.learned(side) is not None
    }
    if not initial:
        raise CheckpointError(f"{path}: nobody learned there who learns here.")
    return initial


def _never_plays(asked: Namespace, settings: Settings) -> bool:
    """Is there no fire to learn, since scripted ones stand in for it in every job?"""
    return settings.random_fires == 1 and asked.robots is None


def _settings(
    asked: Namespace,
    read: Any,
    initial: Mapping[Side, LearnedNetwork] | None = None,
) -> tuple[Settings, list[str]]:
    """Change a preset by the file and the options; return notes on the file, too.

    read: the content of the file of settings, if there is one
    initial: networks to begin with; of them the preset takes what their weights mean
    Raises SettingsError.
    """
    notes = list[str]()
    made = preset(asked.preset or "laptop")
    for side, who in (initial or {}).items():
        rows = {name: getattr(who.settings, name) for name in NETWORK_ROWS}
        made = replace(made, **{side: replace(getattr(made, side), **rows)})
    if asked.settings is not None:
        made, notes = with_trainer_file(made, read, asked.settings)
    robots = replace(
        made.robots,
        trainer_type=asked.trainer or made.robots.trainer_type,
        head=asked.head or made.robots.head,
    )
    fire = replace(made.fire, head=asked.head or made.fire.head)
    scenario = with_stated(made.scenario, _asked_scenario(asked), "scenario")
    return replace(made, robots=robots, fire=fire, scenario=scenario), notes


def _asked_scenario(asked: Namespace) -> dict[str, Any]:
    """Collect the fields of a scenario that the options state."""
    stated = dict(asked.scenario or {})
    if asked.robots == ["none"]:  # none stand there, and the fire observes none
        stated.setdefault("robots_per_floor", 0)
    return stated


def _stated_scenario(asked: Namespace, read: Any, made: Scenario) -> dict[str, Any]:
    """Collect what the file of settings or the options state of a scenario.

    read: the file's content, which has been checked;  made: the scenario they make
    """
    ours = (read or {}).get("reference") or {}
    names = {*(ours.get("scenario") or {}), *_asked_scenario(asked)}
    return {name: getattr(made, name) for name in names}


def resume_training(folder: Path) -> Training:
    """Resume from the newest checkpoint in a folder.

    Raises InputError if it is another version's, was begun with other numbers or its
    map has changed, CheckpointError if there is none or if it is damaged.
    """
    checkpoint = checkpoints.load_checkpoint(folder)
    refuse_version(folder, checkpoint.version)
    refuse_numbers(folder, checkpoint.numbers)
    _refuse_other_map(checkpoint.task)
    with checkpoints.must_fit(folder, "its parts do not fit each other"):
        return Training.resumed(checkpoint)


def _refuse_other_map(task: Task) -> None:
    """Raise InputError if the file of the map has another drawing than at the start."""
    names = [task.building] if task.family is None else task.family.names
    for name, plan in zip(names, task.plans, strict=False):  # none of generated ones
        if "\n" in name:  # it is the map itself
            continue
        now = maps.drawing_now(name)
        known = building_of(plan).drawing
        if now is not None and not maps.same_cells(now, known):
            raise InputError(
                f"{name} has changed since. Give it its old drawing, or begin anew in "
                "another folder."
            )


def repeated_options(task: Task, asked: Namespace) -> Iterator[str]:
    """Yield which options that name files mean what a training began with.

    Networks are compared by their weights, a file of settings by what it makes. Raises
    as `begin_training`.
    """
    building = building_of(task.plan) if task.plan else None
    scenario = task.settings.scenario
    for side in SIDES:
        words = getattr(asked, side) or ()
        who = [fixed_player(word, side, building, scenario) for word in words]
        if player_names(who) == player_names(task.fixed.get(side, ())):
            yield side

    as_begun = {"preset": task.settings.preset, "imitate": task.imitate}
    asked = Namespace(**vars(asked) | as_begun)
    if asked.settings:
        read = read_yaml_file(asked.settings)
        settings, _ = _settings(asked, read, task.initial)
        if settings == task.settings:
            yield "settings"
    if asked.initialize_from:
        initial = _networks_to_begin_with(asked, task.fixed, building, scenario)
        if _names_of(initial) == _names_of(task.initial):
            yield "initialize_from"


def _names_of(networks: Mapping[Side, LearnedNetwork]) -> dict[Side, str]:
    return {side: player_names([who]) for side, who in networks.items()}


def options_of(task: Task, stated: Mapping[str, Any]) -> dict[str, Any]:
    """The options that began a training, as far as its task tells them.

    stated: fields of a scenario that are asked for now
    """
    robots = task.settings.robots
    family = task.family
    return {
        "preset": task.settings.preset,
        "building": list(family.names if family and family.names else [task.building]),
        "trainer": robots.trainer_type,
        "head": robots.head,
        **{side: list(who) for side, who in task.fixed.items()},
        "imitate": task.imitate,
        "seed": task.seed,
        "scenario": kept_fields(task.settings.scenario, stated),
    }
