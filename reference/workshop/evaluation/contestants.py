"""Turn words of the command line into strategies; describe who plays where.

Clauses: C7, D2, F4.  torch is loaded only when a checkpoint is named.
"""

from collections.abc import Sequence
from copy import deepcopy
from dataclasses import dataclass
from functools import lru_cache
from os.path import exists  # False for what no path can be, too
from typing import Any

from reference.building import building_of
from reference.learning.settings import Side, did_you_mean
from reference.paper import InputError, Scenario
from reference.simulation import Simulation
from reference.workshop.evaluation.worst_case import WorstCase
from reference.workshop.strategies import LEARNED, SCRIPTS

WORST, CRITIC, PERTURBED = "worst-case", "critic:", "perturbed:"

NAMES: dict[Side, tuple[str, ...]] = {
    "robots": (
        *(*SCRIPTS["robots"], LEARNED, "FILE"),
        *(f"{PERTURBED}FILE", f"{PERTURBED}EPS:FILE"),
    ),
    "fire": (*SCRIPTS["fire"], LEARNED, WORST, "FILE", f"{CRITIC}FILE"),
}
"""All words a user may write; FILE is a checkpoint or the folder of a training.

`worst-case` is the fire that looks ahead, `critic:` the one that asks the critic of a
checkpoint's robots; `perturbed:` are robots whose observations are off by up to EPS
metres."""


@dataclass(frozen=True)
class Evacuation:
    """One evacuation to play, as plain data: any process can do it.

    plan    the text of a floor file;  robots, fire  words that `contestant` knows
    sample  draw learned policies' actions instead of taking the likeliest
    """

    plan: str
    scenario: Scenario
    robots: str
    fire: str
    seed: int
    sample: bool = False

    def simulation(self) -> Simulation:
        """Set it up, before its first tick. Raises ValueError for too many people."""
        return Simulation(
            building_of(self.plan),
            self.scenario,
            deepcopy(_loaded(self.robots, "robots", self.sample)),
            deepcopy(_loaded(self.fire, "fire", self.sample)),
            self.seed,
        )


def contestant(text: str, side: Side, sample: bool = False) -> Any:
    """Make the strategy that one of NAMES names.

    FILE alone is the policy that was learned for this side; sample: draw its actions
    instead of taking the likeliest.

    Raises ValueError for an unknown word, with the nearest known one, and for a
    checkpoint that lacks what is asked of it; OSError for a file that cannot be read.
    """
    refuse_unknown(text, side, NAMES[side])
    if text in SCRIPTS[side]:
        return SCRIPTS[side][text]()
    if side == "fire" and text == WORST:
        return WorstCase()
    if side == "fire" and text.startswith(CRITIC):
        from reference.workshop.evaluation.worst_case.critic import CriticFire

        return CriticFire(text.removeprefix(CRITIC))
    if side == "robots" and text.startswith(PERTURBED):
        from reference.workshop.evaluation.worst_case import perturbed

        metres, file = _metres_and_file(text.removeprefix(PERTURBED))
        epsilon = perturbed.EPSILON if metres is None else metres
        return perturbed.PerturbedRobots(file, epsilon)
    from reference.workshop.training.policies import policy_of

    return policy_of(text, side, sample)


_loaded = lru_cache(maxsize=32)(contestant)  # copies are played: networks are read once


def refuse_unknown(text: str, side: Side, words: Sequence[str]) -> None:
    """Raise ValueError for an unknown word; files are not opened yet.

    words: those of NAMES that may be used.
    """
    prefix = {"robots": PERTURBED, "fire": CRITIC}[side]
    if text.startswith(prefix) and f"{prefix}FILE" in words:
        _, file = _metres_and_file(text.removeprefix(prefix))
        if not file or not exists(file):
            raise InputError(
                f"'{file}': there is no such file. Name a checkpoint that train made, "
                "or its folder."
            )
    elif text not in words and not exists(text):
        raise InputError(
            f"'{text}' is no file and names nobody who plays the {side}: "
            f"{', '.join(words)}.{did_you_mean(text, words)}"
        )


def _metres_and_file(text: str) -> tuple[float | None, str]:
    """Split `EPS:FILE`; None where there is no EPS."""
    metres, _, file = text.partition(":")
    try:
        return float(metres), file
    except ValueError:
        return None, text
