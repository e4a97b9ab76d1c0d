"""The engine: ticks of many simulations, compiled, equal to the book to the bit.

It plays where numba is installed and no rule of the book has changed; else the book
plays, with one note on stderr.  Nothing that comes of a run says which.
"""

import sys
from collections.abc import Sequence
from functools import cache
from multiprocessing import parent_process
from threading import RLock
from typing import TYPE_CHECKING

from reference.fire import Spread
from reference.robots import RobotAlgorithm
from reference.simulation import Simulation

if TYPE_CHECKING:
    from reference.workshop.engine.mirrors import Rules

SLOWER = "the book plays, 5 to 20 times slower"
ONE_AT_A_TIME = RLock()  # threads share tables


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


def plays(run: Simulation) -> bool:
    """Does the engine play this simulation? Else the book does."""
    return knows_all_rules() and is_the_books(run)


def is_the_books(run: Simulation) -> bool:
    """Is nothing of this simulation replaced by somebody's own?"""
    parts = {run: Simulation, run.algorithm: RobotAlgorithm, run.spread: Spread}
    return all(
        type(part) is kind and vars(part).keys().isdisjoint(vars(kind))
        for part, kind in parts.items()
    )


def _advance(run: Simulation, ticks: int) -> None:
    from reference.workshop.engine.going import advance

    with ONE_AT_A_TIME:
        advance(run, ticks)


def make_ready() -> None:
    """Compile, or load what was compiled before: workers find it then."""
    knows_all_rules()


def knows_all_rules() -> bool:
    """Is numba there, and is every rule the one that the engine was written from?"""
    with ONE_AT_A_TIME:
        rules = _rules()
        if rules is None:
            return False
        if not rules.same:
            rules.learn()
            _say_what_changed(rules)
        if rules.changed:
            return False
        _make_ready()
    return True


@cache
def _rules() -> "Rules | None":
    """The rules of the book; None: without numba nobody asks for them."""
    try:
        from reference.workshop.engine import going
        from reference.workshop.engine.mirrors import Rules
    except ImportError as error:
        _say(f"numba is not there ({error}): {SLOWER}.")
        return None
    rules = Rules()
    _say_what_changed(rules)
    return rules


@cache
def _make_ready() -> None:
    from reference.workshop.engine.going import make_ready

    make_ready(_say)


def _say_what_changed(rules: "Rules") -> None:
    names = ", ".join(one.book for one in rules.changed)
    if names:
        verb = "have" if "," in names else "has"
        _say(f"{names} {verb} changed: {SLOWER}.")


def _say(text: str) -> None:
    """Say something on stderr; workers leave it to who started them."""
    if parent_process() is None:
        print(text, file=sys.stderr)
