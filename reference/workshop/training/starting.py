"""Begin a training by the options of `train`, or resume one.

Clauses: E1, E2, E6.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from reference.building import Building, plan_of
from reference.learning.players import Learned
from reference.learning.settings import SIDES, Side
from reference.paper import Scenario
from reference.workshop.files import naming
from reference.workshop.maps import load
from reference.workshop.runs import RunError, refuse_version
from reference.workshop.strategies import LEARNED, SCRIPTS, SHIPPED
from reference.workshop.training.checkpoints import (
    CheckpointError,
    Task,
    newest,
)
from reference.workshop.training.checkpoints import load as load_checkpoint
from reference.workshop.training.policies import POLICIES, policy_of
from reference.workshop.training.presets import Settings, preset, read_yaml
from reference.workshop.training.session import Training


@dataclass(frozen=True)
class Asked:
    """What was asked for by the options of `train`; None where nothing was."""

    preset: str | None = None
    settings: Path | None = None
    building: str | None = None
    trainer: str | None = None
    head: str | None = None
    robots: str | None = None
    fire: str | None = None
    imitate: str | None = None
    initialize_from: str | None = None
    seed: int | None = None


def begin(asked: Asked) -> Task:
    """Make a new training's task; by default preset laptop on the paper's building.

    Raises SettingsError, CheckpointError for a side that does not fit, MistakesError
    for the map, OSError for an unreadable file.
    """
    settings, name = _settings(asked), asked.building
    if name is None:
        name = "tiny" if settings.preset == "tiny" else "paper"
    building = load(name)
    fixed: dict[Side, Learned | str] = {}
    for side in SIDES:
        if (who := getattr(asked, side)) is not None:
            fixed[side] = fixed_player(who, side, building, settings.scenario)
    initial: dict[Side, Learned] = {}
    if (source := asked.initialize_from) is not None:
        taken = {*fixed, "robots"} if asked.imitate else {*fixed}
        learning = [side for side in SIDES if side not in taken]
        initial = initial_of(source, learning, building, settings.scenario)
    seed, plan = asked.seed or 0, plan_of(building)
    return Task(name, plan, settings, seed, fixed, initial, asked.imitate)


def _settings(asked: Asked) -> Settings:
    """Change a preset by the file and the options. Raises SettingsError."""
    made = preset(asked.preset or "laptop")
    if asked.settings is not None:
        made = read_yaml(asked.settings, made)
    given = {"trainer_type": asked.trainer, "head": asked.head}
    rows: Any = {name: word for name, word in given.items() if word is not None}
    scenario = made.scenario
    if asked.robots == "none":
        scenario = replace(scenario, robots_per_floor=0)
    return replace(made, robots=replace(made.robots, **rows), scenario=scenario)


def resume(folder: Path) -> Training:
    """Resume from the newest checkpoint in a folder.

    Raises RunError if there is none or if it is another version's, InputError for one
    that is damaged.
    """
    path = newest(folder)
    if path is None:
        raise RunError(
            f"{folder}: there is no checkpoint to go on from. Leave --resume out to "
            "begin, or name the folder of a training."
        )
    checkpoint = load_checkpoint(path)
    refuse_version(path, checkpoint.version)
    with naming(path):
        return Training.resumed(checkpoint)


def options_of(task: Task) -> dict[str, Any]:
    """The options that began a training, as far as its task tells them."""
    robots = task.settings.robots
    return {
        "preset": task.settings.preset,
        "building": task.building,
        "trainer": robots.trainer_type,
        "head": robots.head,
        **{side: task.fixed.get(side) for side in SIDES},
        "imitate": task.imitate,
        "seed": task.seed,
    }


def fixed_player(
    who: str, side: Side, building: Building, scenario: Scenario
) -> Learned | str:
    """Find who does not learn: a strategy's name, or a checkpoint's network.

    Raises CheckpointError for a network that does not fit here.
    """
    if who in SCRIPTS[side]:
        return who
    policy = policy_of(who, side)
    policy.refuse_elsewhere(building, scenario)
    return policy.learned


def initial_of(
    word: str, sides: Iterable[Side], building: Building, scenario: Scenario
) -> dict[Side, Learned]:
    """Find networks with which these sides can begin: all that a checkpoint holds.

    word: its path, or LEARNED. Raises CheckpointError if none of the sides did, or
    where they do not fit.
    """
    checkpoint = load_checkpoint(SHIPPED if word == LEARNED else word)
    found: dict[Side, Learned] = {}
    for side in sides:
        if isinstance(checkpoint.player(side), Learned):
            policy = POLICIES[side](checkpoint)
            policy.refuse_elsewhere(building, scenario)
            found[side] = policy.learned
    if not found:
        raise CheckpointError(f"{word}: nobody learned there who learns here.")
    return found
