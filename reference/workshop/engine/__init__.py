"""The engine: ticks of many simulations, compiled, equal to the book to the bit.

`advance` and `run` go by the engine where numba is installed and no rule of the
book has changed; else the book plays, with one note on stderr.
"""

import sys
from collections.abc import Sequence
from functools import cache
from importlib.util import find_spec
from typing import TYPE_CHECKING

from reference.fire import Spread
from reference.robots import RobotAlgorithm
from reference.simulation import Simulation

if TYPE_CHECKING:
    from reference.workshop.engine.mirrors import Rules


def together(runs: Sequence[Simulation]) -> None:
    """Run simulations to their next decision or end."""
    knows = knows_all_rules()
    for run in runs:
        if knows and is_the_books(run):
            _advance(run, run.decision_ticks)
        else:
            for _ in range(run.decision_ticks):
                if not run.done:
                    run.step()


def to_the_end(runs: Sequence[Simulation]) -> None:
    """Run simulations to their end."""
    knows = knows_all_rules()
    for run in runs:
        if knows and is_the_books(run):
            _advance(run, sys.maxsize)
        else:
            run.run()


def is_the_books(run: Simulation) -> bool:
    """Is nothing of this simulation replaced by somebody's own?"""
    parts = {run: Simulation, run.algorithm: RobotAlgorithm, run.spread: Spread}
    return all(
        type(part) is kind and vars(part).keys().isdisjoint(vars(kind))
        for part, kind in parts.items()
    )


def _advance(run: Simulation, ticks: int) -> None:
    from reference.workshop.engine.going import advance

    advance(run, ticks)


def plays(run: Simulation) -> bool:
    """Does the engine play this simulation? Else the book does."""
    return knows_all_rules() and is_the_books(run)


def knows_all_rules() -> bool:
    """Is numba there, and is every rule the one that the engine was written from?"""
    if find_spec("numba") is None:
        _say("numba is not installed")
        return False
    changed = _rules().changed
    if changed:
        _say(f"{changed} has changed")
    else:
        _say.cache_clear()
    return not changed


@cache
def _rules() -> "Rules":
    from reference.workshop.engine import ticks  # noqa: F401
    from reference.workshop.engine.mirrors import Rules

    return Rules()


@cache
def _say(why: str) -> None:
    """Say it once, until the engine plays again."""
    print(f"{why}: the book plays, about 20 times slower.", file=sys.stderr)
