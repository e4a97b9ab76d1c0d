"""What ties the engine to the book: digests; it stands aside where a rule changed."""

import inspect
import sys
from functools import wraps
from typing import Any

import pytest

pytest.importorskip("numba")

from equality import emergency, simulation, unlike

from reference import fire, humans, motion, walking
from reference import simulation as simulations
from reference.simulation import Simulation
from reference.view import View
from reference.workshop import engine
from reference.workshop.engine import mirrors

TESTS = "pytest tests/workshop/test_engine_equality.py"


def where_to_look(one: mirrors.Mirror) -> str:
    """What to do about a rule that has changed: one line a step."""
    module, _, name = one.engine.rpartition(".")
    written = sys.modules[f"reference.workshop.engine.{module}"]
    function = getattr(written, name).py_func
    file = inspect.getsourcefile(function)
    line = inspect.getsourcelines(function)[1]
    now = mirrors.digest_of(mirrors.found(one.book))
    return (
        f"{one.book} has changed, and the engine stands aside until it has, too.\n"
        f"1. Write `{name}` again, which was written from it: {file}:{line}\n"
        f'2. Put "{one.book} {now}" above it, in the place of "{one.book} {one.digest}"'
        f"\n3. Run {TESTS}"
    )


@pytest.mark.parametrize("one", mirrors.MIRRORS, ids=lambda one: one.book)
def test_each_mirror_was_written_from_the_rule_that_the_book_has(
    one: mirrors.Mirror,
) -> None:
    """A digest of the rule's syntax tree; comments and docstrings do not count."""
    same = mirrors.digest_of(mirrors.found(one.book)) == one.digest
    assert same, where_to_look(one)


def test_a_mirror_says_where_it_stands() -> None:
    """File and line of the engine's function, and the digest to write."""
    one = next(one for one in mirrors.MIRRORS if one.book == "humans.stuck")
    told = where_to_look(one)
    assert "engine/thinks.py:" in told
    assert f'"humans.stuck {one.digest}" above it' in told


# -- Nothing is forgotten -----------------------------------------------------------


ASKED = {
    "simulation.Simulation.strategies_decide": "strategies, new fires",
    "robots.actual_target": "asked at decisions",
    "robots.said_on_the_way": "asked at decisions",
    "navigation.navigation_of": "tables are made from it",
    "navigation.Navigation.places_of": "in the tables",
    "rays.Sight.landmarks": "in the tables",
    "rays.Sight.in_line": "in the tables",
    "rays.Sight.looked_at": "in the tables",
    "rays.Sight.open": "in the tables",
    "rays.Sight.seen": "in the tables",
    "rays.Sight._rays": "in the tables",
    "building.Landmark.width": "in the tables",
    "building.Stairwell.lowest": "in the tables",
    "paper.body_diameter": "a number, read when a run begins",
    "paper.stairs_metres": "a number, read when a run begins",
}
"""What the engine asks the book itself, or has from it; and all below that."""


def reached() -> set[str]:
    """The functions of the book that ticks reach, but for those below ASKED."""
    found = set()
    named: dict[Any, str] = {}

    def name_of(frame: Any) -> str:
        code = frame.f_code
        if code not in named:
            module = frame.f_globals.get("__name__", "")
            named[code] = f"{module.removeprefix('reference.')}.{code.co_qualname}"
        return named[code]

    def note(frame: Any, event: str, _: Any) -> None:
        module = frame.f_globals.get("__name__", "")
        if event != "call" or not module.startswith("reference."):
            return
        name = name_of(frame)
        if name in found:
            return
        outer = frame.f_back
        while outer is not None and outer.f_code is not Simulation.step.__code__:
            if name_of(outer) in ASKED:
                return
            outer = outer.f_back
        found.add(name)

    for number in (0, 1, 20, 23, 40, 47):
        run = emergency(number, small=True).begin()
        sys.setprofile(note)
        try:
            for _ in range(150):
                if not run.done:
                    run.step()
        finally:
            sys.setprofile(None)
    within = (
        "<lambda>",
        "<genexpr>",
        "comp>",
        "__init__",
    )  # what has no name of its own
    return {
        name for name in found if not name.endswith(within) and "<locals>" not in name
    }


def test_every_rule_that_a_tick_reaches_has_a_mirror() -> None:
    """A new function of the book that a tick calls must be known to the engine."""
    names = reached()
    known = {one.book for one in mirrors.MIRRORS}
    assert sorted(names - known - ASKED.keys()) == []
    assert all(map(mirrors.found, ASKED))


# -- Whoever breaks a rule sees it --------------------------------------------------


def outcome_of(run: Simulation) -> Any:
    """What comes of a run, as `evaluate` plays it."""
    engine.to_the_end([run])
    return run.outcome()


def never_stuck(me: Any, observe: Any) -> bool:
    """Another rule."""
    return False


def nobody_suits(me: Any, observe: Any, wanted: int) -> None:
    """Another rule."""


class DoorsFirst(humans.Leader):
    """Algorithm 2 in another order: nobody looks for exits first."""

    def setoff(self, me: Any, observe: View) -> Any:
        """Doors before exits."""
        fresh = humans.not_yet_visited(me, observe)
        return super().setoff(me, observe) if fresh is None else humans.go_to(fresh)


def wrapped(rule: Any) -> Any:
    """A rule that somebody wraps, as decorators do: the other way round."""

    @wraps(rule)
    def other(*words: Any) -> Any:
        return not rule(*words)

    return other


CHANGES = [
    (humans, "stuck", never_stuck, "humans.stuck"),
    (humans, "stuck", wrapped(humans.stuck), "humans.stuck"),
    (humans, "suitable_leader", nobody_suits, "humans.suitable_leader"),
    (humans.Leader, "setoff", DoorsFirst.setoff, "humans.Leader.setoff"),
    (humans, "LEADER", DoorsFirst(), "humans.think"),
    (walking, "lengths", wrapped(walking.lengths), "walking._step_out"),
    (simulations, "MINE", 1.0, ""),
    (motion, "FLOOR_APART", 1e5, "motion.neighbours"),
    (humans, "NOBODY", -7, "humans.Follower.setoff"),
    (fire.Spread, "advance", lambda *_: float("inf"), "fire.Spread.advance"),
    (View, "safe", lambda *_: True, "view.View.safe"),
]


@pytest.mark.usefixtures("engine_plays")
@pytest.mark.parametrize(("where", "name", "other", "said"), CHANGES)
def test_the_engine_stands_aside_where_a_rule_or_a_constant_has_changed(
    where: Any,
    name: str,
    other: Any,
    said: str,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """At once, saying so once; and plays again when the rule is back."""
    assert engine.knows_all_rules()
    capsys.readouterr()
    monkeypatch.setattr(where, name, other, raising=False)
    for _ in range(3):
        assert engine.knows_all_rules() is not bool(said)
    told = capsys.readouterr().err
    assert told.count("changed") == bool(said) and said in told
    monkeypatch.undo()
    assert engine.knows_all_rules()


@pytest.mark.usefixtures("engine_plays")
@pytest.mark.parametrize(
    ("name", "other"), [("stuck", never_stuck), ("LEADER", DoorsFirst())]
)
def test_what_comes_of_another_rule_is_what_the_book_says(
    name: str, other: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also for a run that the engine has begun."""
    monkeypatch.setattr(humans, name, other)
    book, run = (simulation("tiny", "none", "random", 3) for _ in range(2))
    book.run()
    assert outcome_of(run) == book.outcome()
    assert unlike(book, run) == ""


def test_the_book_plays_a_simulation_with_an_algorithm_of_ones_own() -> None:
    """Whatever is replaced in one simulation, the engine does not know."""
    run = simulation("tiny", "escort", "random", 2)
    assert engine.is_the_books(run)
    run.algorithm = type("Own", (type(run.algorithm),), {})()
    assert not engine.is_the_books(run)
    run = simulation("tiny", "escort", "random", 2)
    run.burn = lambda: None  # type: ignore[method-assign]
    assert not engine.is_the_books(run)
