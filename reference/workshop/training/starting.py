"""Begin a training by the options of `train`, or resume one.

Clauses: E1, E2, E6.  A resumed training keeps the options it was begun with; those that
are given again must say the same.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np

from reference.building import Building, building_of, plan_of
from reference.learning.players import Learned
from reference.learning.settings import SIDES, Side
from reference.paper import Scenario
from reference.workshop.files import naming
from reference.workshop.maps import load
from reference.workshop.runs import (
    RunError,
    refuse_contradictions,
    refuse_version,
    rows_of_both,
)
from reference.workshop.strategies import LEARNED, SCRIPTS, SHIPPED
from reference.workshop.training.checkpoints import (
    PLAYERS,
    CheckpointError,
    Task,
    newest,
    plain_task,
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
    base = preset(asked.preset or "laptop")
    name = asked.building
    if name is None:
        name = "tiny" if base.preset == "tiny" else "paper"
    return _changed(Task(name, plan_of(load(name)), base), asked)


def resume(asked: Asked, folder: Path) -> Training:
    """Resume from the newest checkpoint in a folder, if the options do not contradict.

    Raises RunError if there is none or if it is another version's, ContradictionError
    for the first thing that contradicts it, InputError for one that is damaged.
    """
    path = newest(folder)
    if path is None:
        raise RunError(
            f"{folder}: there is no checkpoint to go on from. Leave --resume out to "
            "begin, or name the folder of a training."
        )
    checkpoint = load_checkpoint(path)
    refuse_version(path, checkpoint.version)
    rows = _rows(_changed(checkpoint.task, asked)), _rows(checkpoint.task)
    refuse_contradictions(f"the training in {folder}", rows_of_both(*rows, ""))
    with naming(path):
        return Training.resumed(checkpoint)


def _changed(task: Task, asked: Asked) -> Task:
    """Change in a task what was asked for. Raises what `begin` does."""
    plan = task.plan if asked.building is None else plan_of(load(asked.building))
    settings, building = _settings(task.settings, asked), building_of(plan)
    fixed, initial = dict(task.fixed), task.initial
    imitate = asked.imitate or task.imitate
    for side in SIDES:
        if (who := getattr(asked, side)) is not None:
            fixed[side] = fixed_player(who, side, building, settings.scenario)
    if (source := asked.initialize_from) is not None:
        taken = {*fixed, "robots"} if imitate else {*fixed}
        learning = [side for side in SIDES if side not in taken]
        initial = initial_of(source, learning, building, settings.scenario)
    seed = task.seed if asked.seed is None else asked.seed
    return Task(task.building, plan, settings, seed, fixed, initial, imitate)


def _settings(made: Settings, asked: Asked) -> Settings:
    """Change settings by the preset, the file and the options. Raises SettingsError."""
    if asked.preset not in (None, made.preset):
        made = preset(asked.preset)
    if asked.settings is not None:
        made = read_yaml(asked.settings, made)
    given = {"trainer_type": asked.trainer, "head": asked.head}
    rows: Any = {name: word for name, word in given.items() if word is not None}
    scenario = made.scenario
    if asked.robots == "none":
        scenario = replace(scenario, robots_per_floor=0)
    return replace(made, robots=replace(made.robots, **rows), scenario=scenario)


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


def _rows(task: Task) -> dict[str, Any]:
    """A task's rows, to compare; a map and a network are digests."""
    rows, nobody = plain_task(task, _digest), dict.fromkeys(SIDES)
    drawing = sha256(rows.pop("plan").encode()).hexdigest()
    rows["building"] = f"{building_of(task.plan).title}, drawing {drawing:.8}"
    return rows | {name: nobody | rows[name] for name in PLAYERS}


def _digest(network: Learned) -> str:
    """A network's settings and weights, in a word."""
    sha = sha256(repr(network.settings).encode())
    for name, tensor in sorted(network.weights.items()):
        sha.update(name.encode() + np.asarray(tensor).tobytes())
    return f"network {sha.hexdigest():.8}"
