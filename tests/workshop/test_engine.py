"""The engine: compiled ticks, and nobody can tell."""

import sys
from dataclasses import fields
from typing import Any

import numpy as np
import pytest

pytest.importorskip("numba")

from reference import humans
from reference.paper import Scenario
from reference.simulation import Simulation
from reference.workshop import engine
from reference.workshop.engine import mirrors
from reference.workshop.engine.going import advance
from reference.workshop.maps import load
from reference.workshop.strategies import SCRIPTS


def simulation(name: str, robots: str, fire: str, seed: int, **kw: Any) -> Simulation:
    """A simulation, ready to begin."""
    guide = SCRIPTS["robots"][robots]()
    foe = SCRIPTS["fire"][fire]()
    return Simulation(load(name), Scenario(**kw), guide, foe, seed)


def unlike(book: Simulation, other: Simulation) -> str:
    """The first field that differs, and whose; "" if none does."""
    for part in fields(book.world.bodies):
        one = getattr(book.world.bodies, part.name)
        two = getattr(other.world.bodies, part.name)
        if not np.array_equal(one, two):
            i = int(np.argwhere(one != two)[0, 0])
            return f"body {i}: {part.name} is {one[i]} and {two[i]}"
    minds = zip(book.world.minds, other.world.minds, strict=True)
    for i, (mind, twin) in enumerate(minds):
        for part in fields(mind):
            one = getattr(mind, part.name)
            two = getattr(twin, part.name)
            if one != two or (part.name == "been" and list(one) != list(two)):
                return f"mind {i}: {part.name} is {one} and {two}"
    robots = zip(book.world.robots, other.world.robots, strict=True)
    for k, (robot, machine) in enumerate(robots):
        for part in fields(robot):
            one = getattr(robot, part.name)
            two = getattr(machine, part.name)
            if not np.array_equal(one, two):
                return f"robot {k}: {part.name} is {one} and {two}"
    for name in ("due", "full_until", "walked_to", "ticks", "person_seconds"):
        if not np.array_equal(getattr(book, name), getattr(other, name)):
            return name
    if book.events != other.events:
        return f"events: {book.events[-2:]} and {other.events[-2:]}"
    if (book.world.time, book.world.burnt) != (other.world.time, other.world.burnt):
        return "time or burnt doors"
    for name, rng in book.rng.items():
        if rng.bit_generator.state != other.rng[name].bit_generator.state:
            return f"generator {name}"
    return ""


def first_difference(name: str, robots: str, fire: str, seed: int, **kw: Any) -> str:
    """The first tick, person and field in which the engine differs; "" if none does."""
    book = simulation(name, robots, fire, seed, **kw)
    other = simulation(name, robots, fire, seed, **kw)
    while not book.done:
        book.step()
        advance(other, 1)
        if found := unlike(book, other):
            return f"{name}, {robots}, {fire}, seed {seed}, tick {book.ticks}: {found}"
    return ""


@pytest.mark.paper("A5")
@pytest.mark.paper("A9")
@pytest.mark.paper("B3")
@pytest.mark.paper("B7")
@pytest.mark.paper("C7")
@pytest.mark.parametrize("robots", ["none", "escort"])
@pytest.mark.parametrize("fire", ["none", "random", "busiest"])
@pytest.mark.parametrize("name", ["tiny", "tower", "paper"])
def test_a_compiled_tick_equals_the_books_to_the_last_bit(
    name: str, robots: str, fire: str
) -> None:
    """After every tick all that a simulation is, down to its random generators."""
    assert first_difference(name, robots, fire, 1, time_limit=60.0) == ""


@pytest.mark.parametrize(
    "settings",
    [
        {"frames_per_tick": 5},
        {"frames_per_tick": 25},
        {"sight_range": 3.0},
        {"sight_range": 12.0},
        {"people": 1},
        {"people": 200, "time_limit": 20.0},
        {"robots_per_floor": 0},
    ],
)
def test_other_ticks_sights_and_crowds_are_equal_too(settings: dict[str, Any]) -> None:
    """Nothing in the engine knows the defaults."""
    settings = {"time_limit": 40.0, **settings}
    assert first_difference("paper", "escort", "busiest", 3, **settings) == ""


def test_what_the_engine_began_the_book_ends() -> None:
    """Each goes on from where the other stopped, many times."""
    book = simulation("tiny", "escort", "random", 2)
    other = simulation("tiny", "escort", "random", 2)
    while not book.done:
        for _ in range(7):
            if not book.done:
                book.step()
        advance(other, 3)
        for _ in range(4):
            if not other.done:
                other.step()
    assert unlike(book, other) == ""


def test_a_copy_goes_on_like_the_one_copied() -> None:
    """A simulation that the engine plays can be copied, and both play on."""
    run = simulation("tiny", "escort", "random", 2)
    advance(run, 120)
    twin = run.copy()
    engine.to_the_end([run])
    twin.run()
    assert unlike(twin, run) == ""


def test_the_engine_stands_aside_where_a_rule_has_changed(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A broken Algorithm 2 is seen at once: the book plays it, and says so once."""

    def never(me: Any, observe: Any) -> bool:
        return False

    assert engine.knows_all_rules()
    monkeypatch.setattr(humans, "stuck", never)
    assert not engine.knows_all_rules()
    assert not engine.knows_all_rules()
    assert capsys.readouterr().err.count("humans.stuck has changed") == 1
    monkeypatch.undo()
    assert engine.knows_all_rules()


def test_the_book_plays_a_simulation_with_an_algorithm_of_ones_own() -> None:
    """Whatever is replaced in one simulation, the engine does not know."""
    run = simulation("tiny", "escort", "random", 2)
    assert engine.is_the_books(run)
    run.algorithm = type("Own", (type(run.algorithm),), {})()
    assert not engine.is_the_books(run)
    run = simulation("tiny", "escort", "random", 2)
    run.burn = lambda: None  # type: ignore[method-assign]
    assert not engine.is_the_books(run)


@pytest.mark.parametrize("one", mirrors.MIRRORS, ids=lambda one: one.book)
def test_each_mirror_was_written_from_the_rule_that_the_book_has(
    one: mirrors.Mirror,
) -> None:
    """A digest of the rule's syntax tree; comments and docstrings do not count."""
    now = mirrors.digest_of(mirrors.found(one.book))
    assert now == one.digest, (
        f"{one.book} has changed. reference/workshop/engine/{one.engine} was written "
        "from it: write it again, run `pytest tests/workshop/test_engine.py`, and put "
        f'"{one.book} {now}" above it.'
    )


BY_THE_BOOK = {
    # the engine calls these themselves, or what they say is in its tables
    "rays", "fire", "strategies", "navigation", "building",
    # where a mirror has no function of its own
    "walking.free_for.<locals>.free", "motion.Pairs.off", "world.Bodies.__len__",
    "world.Bodies.inside", "world.Bodies.walking",
    "simulation.Simulation.strategies_decide", "simulation.Simulation._fire_decides",
    "simulation.Simulation._burn_doors",
}  # fmt: skip


def test_every_rule_that_a_tick_reaches_has_a_mirror() -> None:
    """A new function of the book that a tick calls must be known to the engine."""
    reached = set()

    def note(frame: Any, event: str, _: Any) -> None:
        module = frame.f_globals.get("__name__", "")
        if event == "call" and module.startswith("reference."):
            reached.add((module.removeprefix("reference."), frame.f_code.co_qualname))

    for robots, fire in (("none", "none"), ("escort", "busiest")):
        run = simulation("tiny", robots, fire, 1)
        sys.setprofile(note)
        try:
            while not run.done:
                run.step()
        finally:
            sys.setprofile(None)
    known = {one.book for one in mirrors.MIRRORS} | BY_THE_BOOK
    rules = {
        f"{module}.{name}"
        for module, name in reached
        if module in ("humans", "motion", "simulation", "view", "walking")
        and not name.endswith(("<lambda>", "<genexpr>", "comp>", "__init__"))
    }
    assert sorted(rules - known) == []
