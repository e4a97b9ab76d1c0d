"""Who can play: strategies by the words of the command line.

Clauses: C7, D2, F4.  torch is loaded only when a checkpoint is named.
"""

from collections.abc import Sequence
from os.path import exists  # False for what no path can be, too
from typing import Any

from reference.building import Building
from reference.learning.settings import Side
from reference.paper import InputError, Scenario
from reference.simulation import Simulation
from reference.workshop.plain import did_you_mean
from reference.workshop.strategies import LEARNED, SCRIPTS
from reference.workshop.worst_case import WorstCase

WORST = "worst-case"

NAMES: dict[Side, tuple[str, ...]] = {
    "robots": (*SCRIPTS["robots"], LEARNED, "FILE"),
    "fire": (*SCRIPTS["fire"], LEARNED, WORST, "FILE"),
}
"""All words a user may write; FILE is a checkpoint or the folder of a training."""


def contestant(word: str, side: Side, sample: bool = False) -> Any:
    """Make the strategy that one of NAMES names.

    FILE is the policy that was learned for this side; sample: draw its actions instead
    of taking the likeliest.

    Raises ValueError for an unknown word, with the nearest known one, and for a
    checkpoint that lacks what is asked of it; OSError for a file that cannot be read.
    """
    refuse_unknown(word, side, NAMES[side])
    if word in SCRIPTS[side]:
        return SCRIPTS[side][word]()
    if side == "fire" and word == WORST:
        return WorstCase()
    from reference.workshop.training.policies import POLICIES

    return POLICIES[side](word, sample)


def refuse_unknown(word: str, side: Side, known: Sequence[str]) -> None:
    """Raise ValueError for a word that is not known; files are not opened yet."""
    if word not in known and not exists(word):
        raise InputError(
            f"'{word}' is no file and names nobody who plays the {side}: "
            f"{', '.join(known)}.{did_you_mean(word, known)}"
        )


def encounter(
    building: Building, scenario: Scenario, robots: Any, fire: Any, seed: int
) -> Simulation:
    """Let two strategies meet in a simulation, before its first tick."""
    if isinstance(fire, WorstCase):
        fire.meet(robots, scenario)
    return Simulation(building, scenario, robots, fire, seed)
