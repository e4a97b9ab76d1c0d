"""A simulation that the engine plays is the book's, whoever copies or changes it."""

import gc
import pickle
from concurrent.futures import ThreadPoolExecutor
from copy import copy, deepcopy
from dataclasses import replace
from math import inf
from time import process_time
from typing import Any
from weakref import ref

import numpy as np
import pytest

pytest.importorskip("numba")

from by_engine import engine_plays
from equality import unlike

from reference import paper
from reference.paper import Scenario
from reference.rays import sight_of
from reference.robots import Destinations
from reference.simulation import Simulation
from reference.workshop import engine
from reference.workshop.engine.going import advance
from reference.workshop.maps import load
from reference.workshop.strategies import SCRIPTS
from reference.workshop.strategies.guides import RandomRobots
from reference.world import Aim, Mind, World

pytestmark = pytest.mark.usefixtures("engine_plays")


def begun(**kw: Any) -> Simulation:
    """A simulation before its first tick."""
    guide = SCRIPTS["robots"]["escort"]()
    foe = SCRIPTS["fire"]["random"]()
    return Simulation(load("tiny"), Scenario(**kw), guide, foe, 2)


def played(ticks: int = 120, **kw: Any) -> Simulation:
    """A simulation that the engine has begun."""
    run = begun(**kw)
    advance(run, ticks)
    return run


def stepped(ticks: int = 120, **kw: Any) -> Simulation:
    """The same, played by the book."""
    run = begun(**kw)
    for _ in range(ticks):
        run.step()
    return run


def run_to_end(run: Simulation) -> Simulation:
    """Run to the end by the engine."""
    advance(run, 100_000)
    return run


def test_many_futures_of_one_moment_are_alike_and_leave_it_as_it_is() -> None:
    """Copies of copies, played in turn, in any order."""
    run = played()
    twins = [run.copy() for _ in range(3)]
    twins.append(twins[0].copy())
    for _ in range(5):
        for twin in twins:
            advance(twin, 7)
    assert unlike(stepped(), run) == ""
    book = stepped()
    book.run()
    for twin in twins:
        assert unlike(book, run_to_end(twin)) == ""
    assert unlike(book, run_to_end(run)) == ""


def test_a_copy_is_of_arrays_and_costs_less_than_fifty_ticks() -> None:
    """No mind becomes an object on the way."""
    guide = SCRIPTS["robots"]["escort"]()
    run = Simulation(load("paper"), Scenario(), guide, None, 1)
    advance(run, 100)
    run.copy()

    begin = process_time()
    copies = [run.copy() for _ in range(50)]
    between = process_time()
    for copied in copies:
        advance(copied, 50)
    assert between - begin < process_time() - between
    assert vars(run)["_engine_arrays"].has_minds


def test_a_copy_of_the_world_alone_starts_another_simulation() -> None:
    """As the worst case does: the copy goes on in a simulation of its own."""
    futures = []
    for run in (played(), stepped()):
        world = deepcopy(run.world, {id(run.building): run.building})
        guide = SCRIPTS["robots"]["escort"]()
        futures.append(Simulation(run.building, Scenario(), guide, None, 5, world))
        assert not np.shares_memory(world.bodies.health, run.world.bodies.health)
    compiled, book = futures
    book.run()
    assert unlike(book, run_to_end(compiled)) == ""


def test_simulations_are_pickled_with_their_minds() -> None:
    """What is unpickled is the book's and goes on by either."""
    run = played()
    twin = pickle.loads(pickle.dumps(run))
    assert type(twin.world.minds) is list
    assert unlike(run_to_end(run), run_to_end(twin)) == ""


def test_a_world_that_the_engine_plays_is_a_world() -> None:
    """isinstance, vars, replace, shallow copies and equality are the book's."""
    run = played()
    book = stepped()
    assert type(run.world) is World
    assert vars(run.world).keys() == vars(book.world).keys()
    assert vars(run.world)["minds"] == book.world.minds
    advance(run, 1)
    book.step()
    assert replace(run.world, time=0.0).minds == book.world.minds
    advance(run, 1)
    book.step()
    assert copy(run.world).minds == book.world.minds
    other = [Mind() for _ in book.world.minds]
    assert replace(run.world, minds=other).minds is other
    advance(run, 1)
    book.step()
    assert unlike(book, run) == ""


def test_minds_are_a_list_that_may_be_replaced() -> None:
    """Whoever changes a mind, or all of them, is heard by the engine."""
    run = played()
    book = stepped()
    for one in (run, book):
        assert len(one.world.minds) == len(one.world.bodies)
        one.world.minds[3].waits_until = 60.0
        one.world.minds[4].doors.add(1)
    for one in (run, book):
        one.world.minds = [deepcopy(mind) for mind in one.world.minds]
    assert unlike(book, run) == ""
    book.run()
    assert unlike(book, run_to_end(run)) == ""


class Reader(RandomRobots):
    """Robots that read minds at each decision, and change one."""

    def __init__(self) -> None:
        """Nothing is read yet."""
        self.read: list[int] = []

    def decide(self, world: World, robots: Any, rng: Any) -> Destinations:
        """Count who goes in a new direction; the first forgets its doors."""
        aims = [mind.goal.aim for mind in world.minds]
        self.read.append(aims.count(Aim.DIRECTION))
        world.minds[0].doors.clear()
        return super().decide(world, robots, rng)


def test_a_strategy_reads_and_changes_minds_in_a_decision() -> None:
    """It sees what the book would show it, and what it changes has its effect."""
    runs = [Simulation(load("tiny"), Scenario(), Reader(), None, 4) for _ in range(2)]
    book, run = runs
    book.run()
    assert unlike(book, run_to_end(run)) == ""
    assert run.robot_strategy.read == book.robot_strategy.read  # type: ignore[attr-defined]


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("KEEP_RIGHT", 0.0),
        ("BODY_RADIUS", 0.1),
        ("MOST_FOLLOWERS", 1),
        ("RECONSIDER_TICKS", 2),
        ("HEALTH_RATE", 0.2),
        ("LOOK_AHEAD_METRES", 2.0),
    ],
)
def test_a_number_of_the_paper_that_changes_between_two_calls_is_heard(
    monkeypatch: pytest.MonkeyPatch, name: str, value: float
) -> None:
    """In a notebook: `paper.X = ...`, and on with the same simulation."""
    run = played()
    book = stepped()
    monkeypatch.setattr(paper, name, value)
    book.run()
    assert unlike(book, run_to_end(run)) == ""


def test_another_sight_is_heard() -> None:
    """A simulation whose `sight` is replaced goes on with what is seen then."""
    run = played()
    book = stepped()
    for one in (run, book):
        one.sight = sight_of(one.building, 4.0)
    book.run()
    assert unlike(book, run_to_end(run)) == ""


def test_a_simulation_goes_when_nobody_holds_it() -> None:
    """No circle of references: a hundred evacuations need no more memory than one."""
    gc.disable()
    try:
        run = played()
        gone = ref(vars(run)["_engine_arrays"])
        twin = run.copy()
        del run
        assert gone() is None
        gone = ref(vars(twin)["_engine_arrays"])
        del twin
        assert gone() is None
    finally:
        gc.enable()


# -- What strategies do with worlds -------------------------------------------------


def test_minds_are_a_list_to_whoever_takes_parts_of_them():
    """Slices, sums and copies hold the minds themselves."""
    run = played()
    minds = list(run.world.minds)
    assert run.world.minds[:3] == minds[:3]
    assert run.world.minds[1] is minds[1]
    assert run.world.minds + minds == minds + run.world.minds == 2 * minds
    assert copy(run.world.minds) == run.world.minds.copy() == minds


def test_a_strategy_may_hang_something_on_bodies():
    """The engine leaves what it does not know where it is."""
    run = played()
    run.world.bodies.visited = run.world.bodies.place.copy()
    visited = run.world.bodies.visited.copy()
    assert unlike(run_to_end(stepped()), run_to_end(run)) == ""
    assert np.array_equal(run.world.bodies.visited, visited)


def test_a_world_that_was_replaced_stays_as_it_was():
    """Who holds it, or its arrays, sees nothing of what comes."""
    run = played()
    before = run.world
    frozen = deepcopy(before)
    run.world = deepcopy(before)
    health = run.world.bodies.health
    assert unlike(run_to_end(stepped()), run_to_end(run)) == ""
    assert np.array_equal(before.bodies.health, frozen.bodies.health)
    assert not np.array_equal(before.bodies.health, health)
    assert list(before.minds) == list(frozen.minds)


def test_an_array_that_was_replaced_stays_as_it_was():
    """As in the book, where another array is moved on."""
    book = stepped()
    run = played()
    for one in (book, run):
        one.world.bodies.health = one.world.bodies.health + 1
    held = [(one.world.bodies.health, one.world.bodies.position) for one in (book, run)]
    old = [health for health, _ in held]
    for one in (book, run):
        one.world.bodies.health = one.world.bodies.health + 1
    as_it_was = old[1].copy()
    run_to_end(book)
    run_to_end(run)
    assert unlike(book, run) == ""
    assert np.array_equal(old[1], as_it_was)
    assert np.array_equal(held[0][1], held[1][1])


def test_a_strategy_may_wait_for_threads_that_play():
    """The engine is nobody's while strategies decide."""

    class Asks(RandomRobots):
        def decide(self, world, robots, rng):
            with ThreadPoolExecutor(2) as pool:
                ends = pool.map(run_to_end, [begun(people=3) for _ in range(2)])
            self.ends = [end.ticks for end in ends]
            return super().decide(world, robots, rng)

    run = begun(people=3, time_limit=6.0)
    run.robot_strategy = Asks()
    run_to_end(run)
    assert len(set(run.robot_strategy.ends)) == 1


@pytest.mark.parametrize(
    ("name", "value"), [("HEAT_COST", 0.0), ("MOST_FOLLOWERS", inf), ("DOOR_FLOW", 0)]
)
def test_odd_numbers_are_the_books(name, value, monkeypatch, capsys):
    """What the book makes of them, compiled code would not."""
    run = begun()
    engine._say_once.cache_clear()
    assert engine_plays(run)
    monkeypatch.setattr(paper, name, value)
    assert not engine_plays(run)
    assert not engine_plays(run)
    assert capsys.readouterr().err.count(f"paper.{name} is not for the engine") == 1
