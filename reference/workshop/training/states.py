"""Convert learners to plain data, tensors and numbers only, and back.

Clause: E3.
"""

from typing import Any

import numpy as np
import torch
from torch import Tensor

from reference.learning.experience import Decisions
from reference.learning.ppo import Learner
from reference.workshop.plain import checked


def state_of(learner: Learner) -> dict[str, Any]:
    """Collect all that a learner needs to resume.

    The tensors are the networks' own: write or copy them before learning goes on.
    """
    return {
        "actor": learner.actor.state_dict(),
        "critic": learner.critic.state_dict(),
        "optimiser": learner.optimiser.state_dict(),
        "buffer": [
            part.columns() | {"grids": _packed(part.grids)}
            for part in learner.buffer.parts
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
    learner.buffer.parts = [
        Decisions(**part | {"grids": _unpacked(part["grids"])})
        for part in state["buffer"]
    ]
    learner.rng.set_state(state["rng"])
    learner.steps = checked("steps", state["steps"], int)
    if learner.buffer.parts:
        one = Decisions.joined(learner.buffer.parts).rows(torch.tensor([0]))
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
