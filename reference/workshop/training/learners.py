"""The learners of a training: made anew or restored; and its seeds.

Clauses: E1, E2, E3, E6.
"""

from typing import Any

import numpy as np
import torch
from torch import Tensor

from reference.building import building_of
from reference.learning.adversarial import learner_for
from reference.learning.experience import Decisions
from reference.learning.players import Learned
from reference.learning.ppo import Learner
from reference.learning.settings import SIDES, Side
from reference.simulation import Simulation
from reference.workshop.plain import SettingsError
from reference.workshop.training.checkpoints import Task

OF_LEARNERS, ROUNDS, DEMONSTRATIONS = range(3)  # what seeds are for

OF_NETWORK = ("head", "hidden_units", "num_layers", "normalize", "commitment", "spread")
"""Rows of settings on which the meaning of a network's weights depends."""


def seeds_of(run: int, purpose: int, number: int, count: int) -> tuple[int, ...]:
    """Derive seeds from a run's seed, a purpose and a number."""
    sequence = np.random.SeedSequence(run, spawn_key=(purpose, number))
    return tuple(sequence.generate_state(count, np.uint64).tolist())


def learners_of(task: Task) -> dict[Side, Learner]:
    """Make a learner for each side that nobody else plays.

    Raises SettingsError if there is nothing to learn, or if a network to begin with
    means something else, and ValueError for more people than fit into the building.
    """
    building, scenario = building_of(task.plan), task.settings.scenario
    if not sum(scenario.start_counts(building.floors)):
        raise SettingsError("there is nobody to evacuate: raise people")
    Simulation(building, scenario)
    return {side: _learner(task, side) for side in SIDES if side not in task.fixed}


def _learner(task: Task, side: Side) -> Learner:
    """Make a side's learner, with random networks or one to begin with."""
    settings, scenario = getattr(task.settings, side), task.settings.scenario
    row = "robots_per_floor" if side == "robots" else "sources"
    if not getattr(scenario, row):
        raise SettingsError(
            f"{side}: nobody learns where {row} is 0. Raise it, or let --{side} none "
            "play."
        )
    (seed,) = seeds_of(task.seed, OF_LEARNERS, SIDES.index(side), 1)
    learner = learner_for(side, task.plan, scenario, settings, seed)
    if side in task.initial:
        _begin_with(learner, task.initial[side], side)
    return learner


def _begin_with(learner: Learner, who: Learned, side: Side) -> None:
    """Give a learner a policy. Raises SettingsError if it means something else here."""
    for name in OF_NETWORK:
        theirs, own = (getattr(s, name) for s in (who.settings, learner.settings))
        if theirs != own:
            raise SettingsError(
                f"{side}: the network to begin with has {name} {theirs}, here it is "
                f"{own}. Write its own into the settings."
            )
    learner.actor.load_state_dict(dict(who.weights))


# -- As plain data ------------------------------------------------------------------

NETWORKS = ("actor", "critic", "optimiser")


def state_of(learner: Learner) -> dict[str, Any]:
    """Collect all that a learner needs to resume, as plain data and its own tensors."""
    parts = learner.buffer
    return {
        **{name: getattr(learner, name).state_dict() for name in NETWORKS},
        "buffer": [part.columns() | {"grids": _packed(part.grids)} for part in parts],
        "rng": learner.rng.get_state(),
        "steps": learner.steps,
    }


def restore(learner: Learner, state: dict[str, Any]) -> None:
    """Load what `state_of` gave."""
    for name in NETWORKS:
        getattr(learner, name).load_state_dict(state[name])
    learner.buffer = [
        Decisions(**part | {"grids": _unpacked(part["grids"])})
        for part in state["buffer"]
    ]
    learner.rng.set_state(state["rng"])
    learner.steps = state["steps"]


def _packed(grids: Tensor) -> dict[str, Any]:
    """Pack cells of 0 and 1 into bits."""
    bits = np.packbits(grids.numpy().reshape(len(grids), -1), axis=1)
    return {"bits": torch.from_numpy(bits), "shape": list(grids.shape)}


def _unpacked(packed: dict[str, Any]) -> Tensor:
    shape = packed["shape"]
    count = int(np.prod(shape[1:]))
    bits = np.unpackbits(packed["bits"].numpy(), axis=1, count=count)
    return torch.from_numpy(bits.reshape(shape))
