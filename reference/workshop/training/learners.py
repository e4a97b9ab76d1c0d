"""The learners of a training, with random or with given networks; and its seeds.

Clauses: E1, E2, E3, E6.
"""

import numpy as np

from reference.building import building_of
from reference.learning.adversarial import learner_for
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
                f"{own}. Write its own into the settings; what ships has those of "
                "preset laptop."
            )
    try:
        learner.actor.load_state_dict(dict(who.weights))
    except RuntimeError:
        raise SettingsError(
            f"{side}: the network to begin with learned in another scenario, with "
            "other numbers of people, robots or sources."
        ) from None
