"""The engine: ticks of many simulations, compiled, equal to the book to the bit.

It plays where numba is installed and no rule of the book has changed; else the book
plays, with one note on stderr.  Nothing that comes of a run says which.
"""

import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import cache, cached_property
from multiprocessing import parent_process
from threading import RLock
from typing import TYPE_CHECKING, Any

from reference.fire import Spread
from reference.navigation import Navigation
from reference.rays import Sight
from reference.robots import RobotAlgorithm
from reference.simulation import Simulation

if TYPE_CHECKING:
    from reference.workshop.engine.mirrors import Rules

SLOWER = "several times slower"
GET_NUMBA = "To go on fast: pip install -e '.[fast]'"
WHAT_TO_DO = "What to do: pytest tests/workshop/test_engine_mirrors.py tells"
ONE_ASKS = RLock()  # for the rules; meanwhile other threads wait


def run_to_decision(runs: Sequence[Simulation]) -> None:
    """Run simulations to their next decision or end."""
    engine = engine_is_ready()
    for run in runs:
        _play(run, run.decision_ticks, engine)


def run_to_end(runs: Sequence[Simulation]) -> None:
    """Run simulations to their end."""
    engine = engine_is_ready()
    for run in runs:
        _play(run, sys.maxsize, engine)


def _play(run: Simulation, ticks: int, engine: bool) -> None:
    """Run so many ticks, or to the end: by the engine, if it may and can."""
    if engine and is_the_books(run):
        from reference.workshop.engine.going import advance

        advance(run, ticks)
        return
    for _ in range(ticks):
        if run.done:
            break
        run.step()


def is_the_books(run: Simulation) -> bool:
    """Is nothing of this simulation replaced by somebody's own?

    No attribute of its objects hides a method of its class.
    """
    nav = run.navigation
    parts = [
        (run, Simulation),
        (run.algorithm, RobotAlgorithm),
        (run.spread, Spread),
        (nav, Navigation),
        (run.sight, Sight),
    ]
    own = all(type(part) is kind and not _hidden(part) for part, kind in parts)
    return own and _searches_as_the_book(nav)


def _hidden(part: Any) -> list[str]:
    """Methods that an object hides, but for those that `rays.kept` keeps answers of."""
    mine = vars(part)
    books = vars(type(part))
    if mine.keys().isdisjoint(books):
        return []
    return [
        name
        for name in mine.keys() & books.keys()
        if not _answers(mine[name], books[name])
    ]


def _answers(kept: Any, method: Any) -> bool:
    """Are these the answers of a method that `rays.kept` has put in its place?"""
    if not isinstance(method, cached_property):
        return False
    asked = getattr(getattr(kept, "__wrapped__", None), "func", None)
    bind: Any = method.func
    return asked is bind.__closure__[0].cell_contents


def _searches_as_the_book(nav: Navigation) -> bool:
    """Are ways found by the book's search, or by the compiled one in its place?"""
    if nav._search is vars(nav).get("_engine_search"):
        return True
    method = nav._search.__wrapped__ if hasattr(nav._search, "cache_info") else None
    return getattr(method, "__func__", None) is Navigation._search_floor


@contextmanager
def quick_searches(nav: Navigation) -> Iterator[None]:
    """Let searches of ways go by the engine meanwhile, if it is ready: equal results.

    It is where evacuations were played by it before; nobody waits for it here.
    """
    if not _make_ready.cache_info().currsize or not engine_is_ready():
        yield
        return
    from reference.workshop.engine.ways import quick_ways

    with quick_ways(nav):
        yield


def make_ready() -> None:
    """Compile, or load what was compiled before: workers find it then."""
    engine_is_ready()


def engine_is_ready() -> bool:
    """Is numba there, and is every rule the one that the engine was written from?"""
    with ONE_ASKS:
        rules = _rules()
        if rules is None:
            return False
        if not rules.same:
            rules.learn()
            _say_what_changed(rules)
        if rules.changed:
            return False
        _make_ready()
        from reference.workshop.engine.state import odd_number

        odd = odd_number()
        if odd:
            _say_once(f"paper.{odd} is not for the engine: the book plays, {SLOWER}.")
    return not odd


@cache
def _rules() -> "Rules | None":
    """The rules of the book; None: without numba nobody asks for them."""
    try:
        from reference.workshop.engine import going
        from reference.workshop.engine.mirrors import Rules
    except (ImportError, OSError) as error:  # OSError: LLVM cannot be loaded
        known = isinstance(error, ModuleNotFoundError)
        _say(
            f"numba is not there ({error}): the book plays, {SLOWER}."
            f"{' ' + GET_NUMBA if known else ''}"
        )
        return None
    rules = Rules()
    _say_what_changed(rules)
    return rules


@cache
def _make_ready() -> None:
    from reference.workshop.engine.going import make_ready

    make_ready(_say)


def _say_what_changed(rules: "Rules") -> None:
    """Name some of it; whoever installed no sources is told that all has."""
    from reference.workshop.engine.mirrors import in_words

    names = in_words(rules.changed)
    if names:
        some = ", ".join(names[:3]) + (", ..." if names[3:] else "")
        is_not = "are not the rules" if names[1:] else "is not the rule"
        _say(
            f"{some} {is_not} that the engine was compiled from: "
            f"the book plays, by your rule, {SLOWER}. {WHAT_TO_DO}"
        )


@cache
def _say_once(text: str) -> None:
    _say(text)


def _say(text: str) -> None:
    """Say something on stderr; workers leave it to who started them."""
    if parent_process() is None:
        print(text, file=sys.stderr)
