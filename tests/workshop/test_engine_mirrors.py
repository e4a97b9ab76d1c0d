"""What ties the engine to the book: digests; it stands aside where a rule changed."""

import inspect
import sys
from functools import cache, partial, wraps
from types import ModuleType
from typing import Any

import pytest

pytest.importorskip("numba")

import numba
from equality import emergency, simulation, unlike

from reference import fire, humans, motion, rays, robots, walking
from reference import simulation as simulations
from reference.simulation import Simulation
from reference.view import View, look
from reference.workshop import engine
from reference.workshop.engine import mirrors
from reference.workshop.engine.ways import quick_ways

TESTS = "pytest tests/workshop/test_engine_equality.py"


def written_from(book: str) -> list[mirrors.Mirror]:
    """All that was written from a function of the book."""
    return [one for one in mirrors.MIRRORS if one.book == book]


def place_of(one: mirrors.Mirror) -> str:
    """Name, file and line of a function of the engine."""
    module, _, name = one.engine.rpartition(".")
    made = getattr(sys.modules[f"reference.workshop.engine.{module}"], name)
    function = getattr(made, "py_func", made)
    file = inspect.getsourcefile(function)
    line = inspect.getsourcelines(function)[1]
    return f"`{name}`: {file}:{line}"


def where_to_look(book: str) -> str:
    """What to do about a rule that has changed: one line a step."""
    now = mirrors.digest_of(mirrors.found(book))
    some = written_from(book)
    places = "\n   ".join(map(place_of, some))
    return (
        f"{book} has changed, and the engine stands aside until it has, too.\n"
        f"1. Write again what was written from it:\n   {places}\n"
        f'2. Put "{book} {now}" above it, in the place of "{book} {some[0].digest}"\n'
        f"3. Run {TESTS}"
    )


@pytest.mark.parametrize("book", dict.fromkeys(one.book for one in mirrors.MIRRORS))
def test_each_mirror_was_written_from_the_rule_that_the_book_has(book: str) -> None:
    """A digest of the rule's syntax tree; comments and docstrings do not count."""
    now = mirrors.digest_of(mirrors.found(book))
    assert {one.digest for one in written_from(book)} == {now}, where_to_look(book)


def test_a_mirror_says_where_it_stands() -> None:
    """File and line of the engine's function, and the digest to write."""
    told = where_to_look("humans.stuck")
    digest = written_from("humans.stuck")[0].digest
    assert "engine/thinks.py:" in told
    assert f'"humans.stuck {digest}" above it' in told


def test_a_rule_leads_to_all_that_was_written_from_it() -> None:
    """Lines 4 and 5 of Algorithm 3 stand where the book's strategies are asked."""
    told = where_to_look("robots.RobotAlgorithm.act")
    assert "`act`" in told and "engine/robots.py:" in told
    assert "`instruct`" in told and "engine/going.py:" in told


# -- Nothing is forgotten -----------------------------------------------------------


def reached() -> set[str]:
    """The functions of the book that ticks reach, but for those below what it asks."""
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
            if name_of(outer) in mirrors.ASKED:
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
    assert unknown(names) == []
    assert all(map(mirrors.found, mirrors.ASKED))


def unknown(names: set[str]) -> list[str]:
    """What to do about functions of the book that the engine does not know."""
    known = {one.book for one in mirrors.MIRRORS} | mirrors.ASKED.keys()
    return [
        f"a tick calls {name}, which no function of the engine names: name it in "
        "`@mirrors` above the one that does its work, or in ASKED, with the reason"
        for name in sorted(names - known)
    ]


def test_a_rule_without_a_mirror_says_where_to_name_it() -> None:
    """One line for each."""
    (told,) = unknown({"humans.stuck", "humans.has_room"})
    assert told.startswith("a tick calls humans.has_room,")
    assert "`@mirrors`" in told


# -- Whoever breaks a rule sees it --------------------------------------------------


def outcome_of(run: Simulation) -> Any:
    """What comes of a run, as `evaluate` plays it."""
    engine.run_to_end([run])
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


def own(*_: Any) -> Any:
    """Somebody's own."""


def plain(rule: Any) -> Any:
    """The other way round, as somebody writes it in a notebook: under the same name."""
    words = ", ".join(inspect.signature(rule).parameters)
    name = rule.__name__
    own = f"def {name}({words}):\n    return not the_books({words})\n"
    module = ModuleType("__main__")
    vars(module)["the_books"] = rule
    exec(own, vars(module))
    return vars(module)[name]


CHANGES = [
    (humans, "stuck", plain(humans.stuck), "humans.stuck "),
    (simulations, "look", plain(look), "simulation.look, which simulation.Simulation"),
    (robots, "said_on_the_way", plain(robots.said_on_the_way), "robots.said_on_the"),
    (robots, "actual_target", plain(robots.actual_target), "robots.actual_target is"),
    (robots, "lengths", plain(robots.lengths), "robots.lengths, which robots.speed_"),
    (robots, "lengths", partial(robots.lengths), "robots.lengths, which robots.speed_"),
    (humans, "stuck", partial(humans.stuck), "humans.stuck"),
    (humans, "Leader", type("Mine", (humans.Leader,), {}), "humans.Leader.setoff"),
    (humans, "go_to", humans.switch_mode, "humans.go_to is not the rule"),
    (humans.LEADER, "setoff", nobody_suits, "humans.LEADER, which humans.think reads"),
    (humans.stuck, "__code__", never_stuck.__code__, "humans.stuck is not the rule"),
    (rays.Sight, "landmarks", own, "rays.Sight.landmarks is not the rule"),
    (rays.Sight, "_fly_on", own, "rays.Sight._fly_on is not the rule"),
    (humans, "stuck", never_stuck, "humans.stuck"),
    (humans, "stuck", wrapped(humans.stuck), "humans.stuck"),
    (humans, "suitable_leader", nobody_suits, "humans.suitable_leader"),
    (humans.Leader, "setoff", DoorsFirst.setoff, "humans.Leader.setoff"),
    (humans, "LEADER", DoorsFirst(), "humans.LEADER, which humans.think reads"),
    (walking, "lengths", wrapped(walking.lengths), "which walking._step_out reads"),
    (simulations, "MINE", 1.0, ""),
    (motion, "FLOOR_APART", 1e5, "motion.FLOOR_APART, which motion.neighbours reads"),
    (humans, "NOBODY", -7, "humans.NOBODY, which "),
    (fire.NoFire, "decide", own, "fire.NoFire.decide is not the rule"),
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
    assert engine.engine_is_ready()
    capsys.readouterr()
    monkeypatch.setattr(where, name, other, raising=False)
    for _ in range(3):
        assert engine.engine_is_ready() is not bool(said)
    told = capsys.readouterr().err
    assert told.count("the book plays, by your rule") == bool(said) and said in told
    monkeypatch.undo()
    assert engine.engine_is_ready()


@pytest.mark.usefixtures("engine_plays")
def test_the_note_names_three_rules_and_what_to_do(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """In one line."""
    monkeypatch.setattr(humans.LEADER, "setoff", nobody_suits, raising=False)
    assert not engine.engine_is_ready()
    assert capsys.readouterr().err == (
        "humans.LEADER, which humans.think reads, is not the rule that the engine was "
        "compiled from: the book plays, by your rule, several times slower. "
        "What to do: pytest tests/workshop/test_engine_mirrors.py tells\n"
    )
    for name in ("forget", "arrive", "decide", "pass_landmark"):
        monkeypatch.setattr(humans, name, never_stuck)
    assert not engine.engine_is_ready()
    told = capsys.readouterr().err
    assert told.count("\n") == 1
    assert ", ... are not the rules" in told


def test_what_is_as_the_source_says_is_not_named() -> None:
    """Nothing has changed here."""
    assert mirrors.in_words(mirrors.changed()) == []
    rules = [mirrors.found(one.book) for one in mirrors.MIRRORS]
    assert not any(map(mirrors._others_read_by, rules))


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


REPLACED = [
    ("algorithm", type("Own", (robots.RobotAlgorithm,), {})()),
    ("burn", own),
    ("algorithm._move", own),
    ("spread.advance", own),
    ("navigation.nearest_free", own),
    ("navigation._search_floor", own),
    ("navigation._search", own),
    ("navigation._search", cache(own)),
    ("navigation._search", cache(partial(own))),
    ("sight.seen", own),
    ("sight.seen", cache(own)),
    ("sight.seen", cache(partial(own))),
]


@pytest.mark.parametrize(("name", "other"), REPLACED)
def test_the_book_plays_a_simulation_with_something_of_ones_own(
    name: str, other: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whatever is replaced in one simulation, the engine does not know."""
    run = simulation("tiny", "escort", "random", 2)
    assert engine.is_the_books(run)
    *path, last = name.split(".")
    holder = getattr(run, path[0]) if path else run
    monkeypatch.setattr(holder, last, other)
    assert not engine.is_the_books(run)


def test_a_search_around_the_books_is_ones_own(monkeypatch: pytest.MonkeyPatch) -> None:
    """Also one that says of itself what it wraps."""
    run = simulation("tiny", "escort", "random", 2)
    nav = run.navigation
    for books in (nav._search, nav._search_floor):
        monkeypatch.setattr(nav, "_search", wrapped(books))
        assert not engine.is_the_books(run)


@pytest.mark.usefixtures("engine_plays")
def test_what_the_book_and_the_engine_keep_in_a_simulation_is_no_change() -> None:
    """Answers of the sight, searches of ways, arrays."""
    run = simulation("tiny", "sweep", "random", 2)
    for _ in range(30):
        run.step()
    assert "in_line" in vars(run.sight)
    assert engine.is_the_books(run)
    engine.run_to_decision([run])
    assert engine.is_the_books(run)
    with quick_ways(run.navigation):
        assert engine.is_the_books(run)


# -- numba --------------------------------------------------------------------------


def test_an_option_that_numba_does_not_know_is_an_error(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Such as `_nrt`, should another numba have none: nothing is compiled then."""
    njit = numba.njit
    other = {"_of_another_numba": False}
    monkeypatch.setattr(numba, "njit", lambda **options: njit(**options, **other))
    with pytest.raises(KeyError, match="_of_another_numba"):
        mirrors.compiled(abs_of, entry=False)(-1.0)


def abs_of(number: float) -> float:
    """Something to compile."""
    return abs(number)
