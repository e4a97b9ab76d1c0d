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
from reference.workshop.plain import SettingsError, checked
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

    Raises SettingsError if none learns, none can imitate, or networks to begin with do
    not fit, and ValueError for more people than fit into the building.
    """
    building, scenario = building_of(task.plan), task.settings.scenario
    if not sum(scenario.start_counts(building.floors)):
        raise SettingsError("there is nobody to evacuate: raise people")
    Simulation(building, scenario)
    made = {side: _learner(task, side) for side in SIDES if side not in task.fixed}
    if not made:
        raise SettingsError("nobody learns: leave one side to a learner")
    if task.imitate and "robots" not in made:
        raise SettingsError("nobody imitates: leave the robots to a learner")
    if task.imitate and "robots" in task.initial:
        raise SettingsError("robots copy, or begin with a network: not both")
    for side, who in task.initial.items():
        _begin_with(made[side], who, side)
    return made


def _learner(task: Task, side: Side) -> Learner:
    """Make a side's learner with random networks. Raises SettingsError."""
    settings, scenario = getattr(task.settings, side), task.settings.scenario
    row = "robots_per_floor" if side == "robots" else "sources"
    if not getattr(scenario, row):
        raise SettingsError(
            f"{side}: nobody learns where {row} is 0. Raise it, or let --{side} none "
            "play."
        )
    (seed,) = seeds_of(task.seed, OF_LEARNERS, SIDES.index(side), 1)
    return learner_for(side, task.plan, scenario, settings, seed)


def _begin_with(learner: Learner, who: Learned, side: Side) -> None:
    """Give a learner a policy. Raises SettingsError if it means something else here."""
    for name in OF_NETWORK:
        theirs, own = (getattr(s, name) for s in (who.settings, learner.settings))
        if theirs != own:
            raise SettingsError(
                f"{side}: the network to begin with has {name} {theirs}, here it is "
                f"{own}. Write its own into the settings."
            )
    try:
        learner.actor.load_state_dict(dict(who.weights))
    except RuntimeError:
        raise SettingsError(
            f"{side}: the network to begin with learned with other numbers of people, "
            "robots or sources."
        ) from None


# -- As plain data ------------------------------------------------------------------


def state_of(learner: Learner) -> dict[str, Any]:
    """Collect all that a learner needs to resume, as plain data and its own tensors."""
    return {
        "actor": learner.actor.state_dict(),
        "critic": learner.critic.state_dict(),
        "optimiser": learner.optimiser.state_dict(),
        "buffer": [
            part.columns() | {"grids": _packed(part.grids)} for part in learner.buffer
        ],
        "rng": learner.rng.get_state(),
        "steps": learner.steps,
    }


def restore(learner: Learner, state: dict[str, Any]) -> None:
    """Load a state; all shapes must fit. Raises ValueError, RuntimeError, ...

    Of Adam, only moments and rate are loaded; the rest follows from the settings. Of
    the decisions that wait for an update, one is checked.
    """
    adam, moments = learner.optimiser.state_dict(), state["optimiser"]["state"]
    (group,), (there,) = adam["param_groups"], state["optimiser"]["param_groups"]
    group["lr"] = checked("lr", there["lr"], float)
    learner.actor.load_state_dict(state["actor"])
    learner.critic.load_state_dict(state["critic"])
    learner.optimiser.load_state_dict({**adam, "state": moments})
    for parameter, found in learner.optimiser.state.items():
        shapes = {"step": (), "exp_avg": parameter.shape, "exp_avg_sq": parameter.shape}
        if {name: moment.shape for name, moment in found.items()} != shapes:
            raise ValueError("the optimiser's moments are of another shape")
    learner.buffer = [
        Decisions(**part | {"grids": _unpacked(part["grids"])})
        for part in state["buffer"]
    ]
    learner.rng.set_state(state["rng"])
    learner.steps = checked("steps", state["steps"], int)
    if learner.buffer:
        one = Decisions.joined(learner.buffer).rows(torch.tensor([0]))
        one.grids = one.grids.float()
        with torch.no_grad():
            learner.loss(one, *learner.schedules()[1:])


def _packed(grids: Tensor) -> dict[str, Any]:
    """Pack cells of 0 and 1 into bits."""
    bits = np.packbits(grids.numpy().reshape(len(grids), -1), axis=1)
    return {"bits": torch.from_numpy(bits), "shape": list(grids.shape)}


def _unpacked(packed: dict[str, Any]) -> Tensor:
    shape = packed["shape"]
    count = int(np.prod(shape[1:]))
    bits = np.unpackbits(packed["bits"].numpy(), axis=1, count=count)
    return torch.from_numpy(bits.reshape(shape))
