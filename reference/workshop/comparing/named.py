"""Who can play: strategies by the words of the command line.

torch is loaded only when a checkpoint is named.
"""

from collections.abc import Callable, Mapping, Sequence
from os.path import exists  # False for what no path can be, too
from pathlib import Path
from typing import Any

from reference.building import Building
from reference.learning.settings import Side
from reference.paper import InputError, Scenario
from reference.robots import NoRobots
from reference.simulation import Simulation
from reference.workshop.storage.files import refuse_no_file
from reference.workshop.storage.runs import digest_of_file
from reference.workshop.storage.words import did_you_mean, first_line
from reference.workshop.strategies import ANY_MAP, ANYWHERE, LEARNED, SCRIPTS, SHIPPED
from reference.workshop.strategies.own import (
    CODE,
    class_in,
    code_digests,
    from_code,
    is_code,
)
from reference.workshop.strategies.worst_case import DisturbedRobots, WorstCase

WORST = "worst-case"

FILE = "FILE"
LEARNED_ROBOTS = "a network that copied `guard`, in other maps `observer`"
LEARNED_FIRE = "a network for the paper's building, another for any map"

PLAYERS: dict[Side, Mapping[str, Callable[[], Any]]] = {
    **SCRIPTS,
    "fire": {**SCRIPTS["fire"], WORST: WorstCase},
}


def _descriptions(side: Side, do: str, learned: str) -> dict[str, str]:
    """Describe who can play a side, by word.

    do: the verb of what has no docstring;  learned: what ships
    """
    scripts = {word: first_line(player) for word, player in PLAYERS[side].items()}
    return {
        **scripts,
        LEARNED: f"{do} what ships: {learned}.",
        FILE: f"{do} what a network has learned: a checkpoint, or a training's folder.",
        CODE: f"{do} what your code decides, imported from the current folder.",
    }


DESCRIPTIONS: dict[Side, dict[str, str]] = {
    "robots": _descriptions("robots", "Do", LEARNED_ROBOTS),
    "fire": _descriptions("fire", "Does", LEARNED_FIRE),
}
"""All words a user may write, and what they do: docstrings' first lines."""

PLAYER_NAMES = {side: tuple(words) for side, words in DESCRIPTIONS.items()}


def describe(word: str, side: Side) -> str:
    """Say who plays a side in words: "escort, lead people out at once ..."."""
    if word == ANY_MAP:
        return f"{word}: a network that knows no building"
    if is_code(word):
        return f"{word}: code of your own"
    words = DESCRIPTIONS[side]
    about = words.get(word, words[FILE]).replace("`", "").rstrip(".")
    return f"{word}, {about[0].lower()}{about[1:]}"


def strategy_named(word: str, side: Side, sample: bool = False) -> Any:
    """Make the strategy that one of PLAYER_NAMES names [C7] [D2].

    FILE is the policy that was learned for this side; sample: draw its actions instead
    of taking the likeliest.

    Raises InputError for an unknown word, with the nearest known one, for a checkpoint
    that lacks what is asked of it and for code that is not there; OSError for a file
    that cannot be read.
    """
    refuse_unknown(word, side, PLAYER_NAMES[side])
    if word in PLAYERS[side]:
        return PLAYERS[side][word]()
    if is_code(word):
        return from_code(word, side)
    from reference.workshop.training.policies import learned_policy

    return learned_policy(word, side, sample)


def meaning_of(word: str, building: Building, scenario: Scenario) -> dict[str, str]:
    """Digest the files that a word of PLAYER_NAMES means there, by their names.

    None for a script. A network's bytes; of code, the module and all that it imports
    from its folder. Raises InputError for code that is not there, OSError for a file
    it cannot read.
    """
    if any(word in players for players in PLAYERS.values()):
        return {}
    if word == LEARNED:
        ships = SHIPPED
        if title_of(word, building, scenario) == ANY_MAP:
            ships = ANYWHERE
        return {ships.name: digest_of_file(ships)}
    if is_code(word):
        return code_digests(word)
    refuse_no_file(Path(word))
    return {word: digest_of_file(Path(word))}


def strategy_of(given: Any, side: Side, building: Building, scenario: Scenario) -> Any:
    """Make a strategy that is given by a word; of what has learned, what plays there.

    Raises as `strategy_named` does, and InputError for what cannot play there.
    """
    made = strategy_named(given, side) if isinstance(given, str) else given
    if hasattr(made, "playing_in"):
        return made.playing_in(building, scenario)
    return made


def title_of(word: str, building: Building, scenario: Scenario) -> str:
    """What tables and pictures call who plays by a word there."""
    if word != LEARNED:
        return word
    title: str = strategy_of(word, "robots", building, scenario).title
    return title


def refuse_unknown(word: str, side: Side, known: Sequence[str]) -> None:
    """Raise InputError for a word that is not known; files are not opened yet."""
    if word in known:
        return
    module = word.removesuffix(".py")
    names_file = word != module or not exists(word)
    may_be_code = CODE in known and names_file and module.isidentifier()
    if may_be_code and exists(f"{module}.py"):
        player = class_in(Path(f"{module}.py"), side)
        raise InputError(
            f"code is named by its file and who plays in it: write {module}:{player}"
        )
    if CODE in known and word != module and exists(word):
        raise InputError(
            f"{word}: code is named by a file in the current folder: copy it to "
            f"mine.py there, and write mine:{class_in(Path(word), side)}"
        )
    code = CODE in known and is_code(word)
    if not exists(word) and not code:
        raise InputError(
            f"'{word}' is no file and names nobody who plays the {side}: "
            f"{', '.join(known)}.{did_you_mean(word, known)}"
        )


def set_up_match(
    building: Building,
    scenario: Scenario,
    robots: Any,
    fire: Any,
    seed: int,
    errors: float = 0.0,
) -> Simulation:
    """Let two strategies meet in a simulation, before its first tick.

    errors: metres that robots observe wrongly by, in the worst case [F4]
    """
    if errors and not isinstance(robots, NoRobots):
        robots = DisturbedRobots(robots, fire, scenario, errors)
    if isinstance(fire, WorstCase):
        fire.meet(robots, scenario)
    return Simulation(building, scenario, robots, fire, seed)
