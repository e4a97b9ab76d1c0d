"""From a word of the command line to whoever plays: scripts, checkpoints, worst cases.

Clauses: C7, D2, F4.  torch is loaded only when a checkpoint is named.
"""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from reference.learning.settings import Side, did_you_mean
from reference.workshop.evaluation.worst_case import BusiestWay, WorstCase
from reference.workshop.strategies import FIRES, ROBOTS, fire_named, robots_named

SCRIPTS: dict[Side, tuple[str, ...]] = {
    "robots": tuple(ROBOTS),
    "fire": tuple(FIRES),
}
"""Those that are written by hand."""

WORST, BUSIEST, CRITIC, PERTURBED = "worst-case", "busiest", "critic:", "perturbed:"

NAMES: dict[Side, tuple[str, ...]] = {
    "robots": (*SCRIPTS["robots"], "FILE", f"{PERTURBED}FILE", f"{PERTURBED}EPS:FILE"),
    "fire": (*SCRIPTS["fire"], BUSIEST, WORST, "FILE", f"{CRITIC}FILE"),
}
"""All words there are, for people: FILE is a checkpoint or the folder of a training,
EPS are metres."""


def contestant(text: str, side: Side, sample: bool = False) -> Any:
    """Whoever a word names, as `Simulation` takes it.

    `busiest` is the fire beside the busiest ways,
    `worst-case` the one that looks ahead, `critic:FILE` the one that asks the critic of
    a checkpoint's robots; `perturbed:EPS:FILE` are a checkpoint's robots whose
    observations are off by up to EPS metres; FILE alone is the policy that was learned
    for this side. sample: draw its actions instead of taking the likeliest; it changes
    nobody else's.

    Raises ValueError for a word that means nothing, with the nearest that does, and
    for a checkpoint that does not have what is asked of it; OSError for a file that
    cannot be read.
    """
    if text in SCRIPTS[side]:
        return robots_named(text) if side == "robots" else fire_named(text)
    if side == "fire" and text in _WORST:
        return _WORST[text]()
    for prefix, made in _MADE[side].items():
        if text.startswith(prefix):
            return made(text.removeprefix(prefix))
    if not Path(text).exists():
        raise ValueError(_unknown(text, side, NAMES[side]))
    from reference.workshop.training.policies import named_or_file

    return named_or_file(text, side, sample)


def refuse_nobody(text: str, side: Side, words: Sequence[str]) -> None:
    """Raises ValueError for a word that means nothing; files are not opened yet.

    words: those of NAMES that may be used.
    """
    for prefix in _MADE[side]:
        if text.startswith(prefix) and f"{prefix}FILE" in words:
            _file(_without_metres(text.removeprefix(prefix))[1])
            return
    if text not in words and not Path(text).exists():
        raise ValueError(_unknown(text, side, words))


_WORST: dict[str, Callable[[], Any]] = {BUSIEST: BusiestWay, WORST: WorstCase}


def _critic(text: str) -> Any:
    from reference.workshop.evaluation.worst_case.critic import CriticFire

    return CriticFire(_file(text))


def _perturbed(text: str) -> Any:
    from reference.workshop.evaluation.worst_case.perturbed import (
        EPSILON,
        PerturbedRobots,
    )

    epsilon, file = _without_metres(text)
    return PerturbedRobots(_file(file), EPSILON if epsilon is None else epsilon)


def _without_metres(text: str) -> tuple[float | None, str]:
    """EPS, if it is there, and FILE."""
    metres, _, file = text.partition(":")
    try:
        return float(metres), file
    except ValueError:
        return None, text


_MADE: dict[Side, dict[str, Callable[[str], Any]]] = {
    "robots": {PERTURBED: _perturbed},
    "fire": {CRITIC: _critic},
}


def _file(text: str) -> str:
    """A path, if there is something."""
    if text and Path(text).exists():
        return text
    raise ValueError(
        f"'{text}': there is no such file. Name a checkpoint that train made, "
        "or its folder."
    )


def _unknown(text: str, side: Side, words: Sequence[str]) -> str:
    """What is wrong with a word, and what may have been meant."""
    meant = f"{', '.join(words)}.{did_you_mean(text, words)}"
    return f"'{text}' is no file and names nobody who plays the {side}: {meant}"
