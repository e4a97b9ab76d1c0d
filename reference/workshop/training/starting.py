"""Begin a training by the options of `train`, or resume one.

Clauses: E1, E2, E6.  A resumed training keeps the options it was begun with: they are
left out, or all given again.
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
    building = load(name)
    settings = settings_of(asked, base)
    fixed: dict[Side, Learned | str] = {}
    for side in SIDES:
        if (who := getattr(asked, side)) is not None:
            fixed[side] = fixed_player(who, side, building, settings.scenario)
    initial: dict[Side, Learned] = {}
    if asked.initialize_from is not None:
        taken = {*fixed, "robots"} if asked.imitate else {*fixed}
        learning = [side for side in SIDES if side not in taken]
        initial = initial_of(
            asked.initialize_from, learning, building, settings.scenario
        )
    seed, plan = asked.seed or 0, plan_of(building)
    return Task(name, plan, settings, seed, fixed, initial, asked.imitate)


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
    task = checkpoint.task
    if asked != Asked():
        known: dict[str, Any] = {"preset": task.settings.preset}
        known |= {"building": task.building, "seed": task.seed}
        known |= {name: word for name, word in vars(asked).items() if word is not None}
        rows = rows_of_both(_rows(begin(Asked(**known))), _rows(task), "")
        refuse_contradictions(f"the training in {folder}", rows)
    with naming(path):
        return Training.resumed(checkpoint)


def settings_of(asked: Asked, base: Settings) -> Settings:
    """Change a preset by the file and the options. Raises SettingsError."""
    made = base if asked.settings is None else read_yaml(asked.settings, base)
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
