"""Begin a training by the options of `train`, or resume one.

Clauses: E1, E2, E6.  A resumed training must keep the options it was begun with.
"""

from collections.abc import Iterable, Iterator
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import torch

from reference.building import Building, building_of, plan_of
from reference.learning.players import Learned
from reference.learning.settings import SIDES, Side
from reference.paper import Scenario
from reference.workshop.files import naming
from reference.workshop.maps import load
from reference.workshop.runs import (
    RunError,
    building_asked,
    refuse_contradictions,
    refuse_used,
    refuse_version,
    rows_of_both,
)
from reference.workshop.strategies import LEARNED, SCRIPTS, SHIPPED
from reference.workshop.training.checkpoints import CheckpointError, Task, newest
from reference.workshop.training.checkpoints import load as load_checkpoint
from reference.workshop.training.policies import POLICIES, policy_of
from reference.workshop.training.presets import Settings, preset, read_yaml
from reference.workshop.training.session import Training

DEFAULT_PRESET = "laptop"
SMALL_BUILDING, BUILDING = "tiny", "paper"  # of preset tiny, and of the others


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

    @property
    def players(self) -> dict[Side, str | None]:
        """Who plays a side that does not learn, as asked for."""
        return {"robots": self.robots, "fire": self.fire}


def begin(asked: Asked, folder: Path) -> Task:
    """Make a new training's task; its folder is empty or not there yet.

    Raises RunError for any other folder, SettingsError, CheckpointError for a
    side that does not fit, MistakesError for the map, OSError for an unreadable file.
    """
    refuse_used(folder)
    base = preset(asked.preset or DEFAULT_PRESET)
    small = base.preset == SMALL_BUILDING
    usual = SMALL_BUILDING if small else BUILDING
    name = usual if asked.building is None else asked.building
    building = load(name)
    settings = settings_of(asked, base)
    fixed = {
        side: fixed_player(who, side, building, settings.scenario)
        for side, who in asked.players.items()
        if who is not None
    }
    initial: dict[Side, Learned] = {}
    if asked.initialize_from is not None:
        taken = {*fixed, "robots"} if asked.imitate else {*fixed}
        learning = [side for side in SIDES if side not in taken]
        initial = initial_of(
            asked.initialize_from, learning, building, settings.scenario
        )
    return Task(
        building=name,
        plan=plan_of(building),
        settings=settings,
        seed=asked.seed or 0,
        fixed=fixed,
        initial=initial,
        imitate=asked.imitate,
    )


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
    compared = _asked_and_begun(asked, checkpoint.task)
    refuse_contradictions(f"the training in {folder}", compared)
    with naming(path):
        return Training.resumed(checkpoint)


def settings_of(asked: Asked, base: Settings) -> Settings:
    """Change a preset by the file and the options. Raises SettingsError."""
    made = base if asked.settings is None else read_yaml(asked.settings, base)
    robots, fire, scenario = made.robots, made.fire, made.scenario
    robots = replace(robots, trainer_type=asked.trainer or robots.trainer_type)
    if asked.head:
        robots = replace(robots, head=asked.head)
    if asked.robots == "none":
        scenario = replace(scenario, robots_per_floor=0)
    return replace(made, robots=robots, fire=fire, scenario=scenario)


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


# -- Contradictions -----------------------------------------------------------------


def _asked_and_begun(asked: Asked, task: Task) -> Iterator[tuple[str, Any, Any]]:
    """Compare: option, what was asked for, and what the training has."""
    settings = task.settings
    yield "--preset", asked.preset, settings.preset
    yield "--trainer", asked.trainer, settings.robots.trainer_type
    yield "--head", asked.head, settings.robots.head
    yield "--imitate", asked.imitate, task.imitate or "nobody to imitate"
    if asked.initialize_from is not None:
        yield "--initialize-from", *_beginnings(asked.initialize_from, task)
    yield "--seed", asked.seed, task.seed
    yield building_asked(asked.building, task.building, task.plan)
    for side, who in asked.players.items():
        fixed = task.fixed.get(side, "a learner there")
        if who is not None and not _same(who, side, fixed):
            begun = fixed if isinstance(fixed, str) else "another network there"
            yield f"--{side}", who, begun
    if asked.settings:
        alone = asked.robots or ("none" if task.fixed.get("robots") == "none" else None)
        as_begun = replace(asked, robots=alone)
        wanted = asdict(settings_of(as_begun, preset(settings.preset)))
        yield from rows_of_both(wanted, asdict(settings), "settings: ")


def _same(who: str, side: Side, fixed: Learned | str) -> bool:
    """Tell whether this word names a fixed side's player."""
    if isinstance(fixed, str) or who in SCRIPTS[side]:
        return who == fixed
    return _equal(policy_of(who, side).learned, fixed)


def _beginnings(word: str, task: Task) -> tuple[str, str]:
    """Compare networks to begin with: those of this word, and the training's."""
    if not task.initial:
        return word, "networks of no training"
    scenario = task.settings.scenario
    asked = initial_of(word, task.initial, building_of(task.plan), scenario)
    same = asked.keys() == task.initial.keys() and all(
        _equal(who, task.initial[side]) for side, who in asked.items()
    )
    return word, word if same else "other networks"


def _equal(one: Learned, other: Learned) -> bool:
    """Tell whether two networks are the same, of the same settings."""
    here, there = one.weights, other.weights
    return (
        one.settings == other.settings
        and here.keys() == there.keys()
        and all(torch.equal(here[name], there[name]) for name in there)
    )
