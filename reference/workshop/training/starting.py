"""Begin a training by the options of `train`, or resume one from its folder."""

from argparse import Namespace
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from reference.building import building_of
from reference.learning.players import LearnedNetwork
from reference.learning.settings import SIDES, Side
from reference.paper import InputError
from reference.workshop import maps
from reference.workshop.storage.runs import refuse_numbers, refuse_version
from reference.workshop.storage.scenarios import kept_fields, with_stated
from reference.workshop.training import checkpoints
from reference.workshop.training.checkpoints import CheckpointError, Task
from reference.workshop.training.mlagents import read_yaml
from reference.workshop.training.policies import fixed_player
from reference.workshop.training.presets import Settings, preset
from reference.workshop.training.rounds import Training

OPTIONS = ("preset", "settings", "building", "trainer", "head", *SIDES, "imitate")
OPTIONS += ("initialize_from", "seed", "scenario")
"""What defines a training; None where it was not asked for."""


def begin_training(asked: Namespace) -> Training:
    """Begin a training; by default preset laptop on the paper's building.

    Raises SettingsError, CheckpointError for a side that does not fit, MistakesError
    for the map, OSError for an unreadable file.
    """
    settings = _settings(asked)
    name = "tiny" if settings.preset == "tiny" else "paper"
    if asked.building is not None:
        name = asked.building
    building = maps.load(name)
    scenario = settings.scenario

    # who does not learn
    fixed: dict[Side, tuple[LearnedNetwork | str, ...]] = {}
    for side in SIDES:
        words = getattr(asked, side)
        if words is not None:
            fixed[side] = tuple(
                fixed_player(word, side, building, scenario) for word in words
            )

    # networks to begin with; robots that imitate begin with random ones
    initial: dict[Side, Any] = {}
    path = asked.initialize_from
    if path is not None:
        taken = set(fixed)
        if asked.imitate:
            taken.add("robots")
        made = checkpoints.load_checkpoint(path)
        for side in SIDES:
            if side not in taken and isinstance(made.player(side), LearnedNetwork):
                initial[side] = fixed_player(path, side, building, scenario)
        if not initial:
            raise CheckpointError(f"{path}: nobody learned there who learns here.")

    task = Task(
        building=name,
        plan=maps.plan_of(building),
        settings=settings,
        seed=asked.seed or 0,
        fixed=fixed,
        initial=initial,
        imitate=asked.imitate,
    )
    return Training(task)


def _settings(asked: Namespace) -> Settings:
    """Change a preset by the file and the options. Raises SettingsError."""
    made = preset(asked.preset or "laptop")
    if asked.settings is not None:
        made = read_yaml(asked.settings, made)
    robots = replace(
        made.robots,
        trainer_type=asked.trainer or made.robots.trainer_type,
        head=asked.head or made.robots.head,
    )
    fire = replace(made.fire, head=asked.head or made.fire.head)
    stated = asked.scenario or {}
    if asked.robots == ["none"]:  # none stand there, and the fire observes none
        stated = {"robots_per_floor": 0, **stated}
    scenario = with_stated(made.scenario, stated, "scenario")
    return replace(made, robots=robots, fire=fire, scenario=scenario)


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
    if "\n" in task.building:  # it is the map itself
        return
    now = maps.drawing_now(task.building)
    if now is not None and now != building_of(task.plan).drawing:
        raise InputError(
            f"{task.building} has changed since. Give it its old drawing, or begin "
            "anew in another folder."
        )


def options_of(task: Task, stated: Mapping[str, Any]) -> dict[str, Any]:
    """The options that began a training, as far as its task tells them.

    stated: fields of a scenario that are asked for now
    """
    robots = task.settings.robots
    own = {
        "preset": task.settings.preset,
        "trainer": robots.trainer_type,
        "head": robots.head,
        "scenario": kept_fields(task.settings.scenario, stated),
    }
    return own | {side: list(who) for side, who in task.fixed.items()} | vars(task)
