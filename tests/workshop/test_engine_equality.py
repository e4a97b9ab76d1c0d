"""The engine against the book: whole simulations, tick by tick, to the last bit."""

import pickle
import time
from typing import Any

import numpy as np
import pytest

pytest.importorskip("numba")

import equality
from equality import (
    ODD,
    TOGETHER,
    Emergency,
    Meddler,
    compare,
    emergency,
    first_difference,
    meddle,
    unlike,
)

from reference import paper
from reference.building import Kind
from reference.fire import NoFire
from reference.simulation import Simulation
from reference.workshop import engine
from reference.workshop.engine.going import advance
from reference.workshop.engine.state import OF_PAPER
from reference.world import Died, Evacuated

pytestmark = pytest.mark.usefixtures("engine_plays")

INDIRECT = (
    "STAIRS_SPEED",
    "WALKING_SPEED",
    "LOOK_AHEAD_METRES",
    "FIRE_FIRST_DECISION",
    "FIRE_EVERY_DECISIONS",
)  # numbers of `paper` that others are made of, or that pass by another name


def planned(
    building: str = "tiny",
    robots: str = "escort",
    fire: str = "random",
    seed: int = 2,
    **scenario: Any,
) -> Emergency:
    """An emergency as said, compared after every tick."""
    return Emergency(0, building, robots, fire, seed, scenario, True, odd=False)


def both(**said: Any) -> tuple[Simulation, Simulation]:
    """The same simulation twice, ready to begin."""
    one = planned(**said)
    return one.begin(), one.begin()


def same_after(book: Simulation, other: Simulation, ticks: int) -> str:
    """Step both, one by the book and one by the engine; the first difference."""
    for _ in range(ticks):
        if not book.done:
            book.step()
        advance(other, 1)
        if found := unlike(book, other):
            return f"tick {book.ticks}: {found}"
    return ""


# -- As the scenario says -----------------------------------------------------------


@pytest.mark.paper("A5")
@pytest.mark.paper("A9")
@pytest.mark.paper("B3")
@pytest.mark.paper("B7")
@pytest.mark.paper("C7")
@pytest.mark.parametrize(
    ("building", "robots", "fire"),
    [
        ("tiny", "none", "none"),
        ("tiny", "escort", "busiest"),
        ("tower", "none", "random"),
        ("tower", "escort", "busiest"),
        ("paper", "escort", "none"),
        ("paper", "none", "busiest"),
        ("paper", "sweep", "greedy"),
    ],
)
def test_a_compiled_tick_equals_the_books_to_the_last_bit(
    building: str, robots: str, fire: str
) -> None:
    """After every tick all that a simulation is, down to its random generators."""
    one = planned(building, robots, fire, 1, time_limit=50.0)
    assert first_difference(one) == (250, "")


@pytest.mark.parametrize(
    "settings",
    [
        {"frames_per_tick": 5},
        {"frames_per_tick": 25},
        {"sight_range": 3.0},
        {"sight_range": 12.0},
        {"people": 1},
        {"people": 200, "time_limit": 12.0},
        {"robots_per_floor": 0},
        {"robots_per_floor": 3},
        {"spread_rate": 1.0, "burn_seconds": 5.0},
        {"decision_seconds": 1.0, "sources": 2},
    ],
)
def test_other_ticks_sights_crowds_and_fires_are_equal_too(
    settings: dict[str, Any],
) -> None:
    """Nothing in the engine knows the defaults."""
    settings = {"time_limit": 30.0, **settings}
    assert (
        first_difference(planned("tower", "escort", "busiest", 3, **settings))[1] == ""
    )


@pytest.mark.parametrize("first", range(0, 60, TOGETHER))
def test_emergencies_by_lot_are_equal(first: int) -> None:
    """Of any floors, guide, fire and scenario; some change the world meanwhile."""
    for number in range(first, first + TOGETHER):
        one = emergency(number, small=True)
        assert first_difference(one)[1] == ""


@pytest.mark.slow
@pytest.mark.parametrize("first", range(0, 6 * TOGETHER, TOGETHER))
def test_large_emergencies_by_lot_are_equal(first: int) -> None:
    """`python tests/equality.py` goes on with more of them."""
    assert compare(range(first, first + TOGETHER // 4)).found == ""


# -- Nobody there, all dead, nobody to guide ----------------------------------------


def test_nobody_is_played_too() -> None:
    """An empty building is done at once."""
    book, other = both(people=0)
    book.run()
    engine.run_to_end([other])
    assert unlike(book, other) == ""


def test_all_may_die_in_one_tick() -> None:
    """And then nothing happens any more."""
    book, other = both()
    for run in (book, other):
        run.world.bodies.health[:] = 0.0
    assert same_after(book, other, 3) == ""
    assert {type(event) for event in other.events} == {Died}
    assert other.done


def test_robots_without_anybody_to_guide_are_equal() -> None:
    """The only human is out at some time; the fire goes on till then."""
    book, other = both(people=1, fire="busiest", time_limit=60.0)
    assert same_after(book, other, 300) == ""
    assert {type(event) for event in other.events} & {Died, Evacuated}


def test_a_world_may_be_handed_in() -> None:
    """With its clock, its flames and its burnt doors."""
    earlier, _ = both(fire="busiest", spread_rate=1.0)
    for _ in range(150):
        earlier.step()
    runs = []
    for _ in range(2):
        copied = earlier.copy()
        guide = planned().begin().robot_strategy
        building, scene = copied.building, copied.scenario
        runs.append(Simulation(building, scene, guide, seed=4, world=copied.world))
    assert same_after(*runs, 100) == ""


@pytest.mark.parametrize("x", [1e3, 999_999.0])
def test_robots_may_be_sent_beyond_all_walls(x: float) -> None:
    """They walk to the nearest place."""

    class FarAway:
        def decide(self, world: Any, robots: Any, rng: Any) -> Any:
            return [(x, -x) for _ in robots]

    book, other = both(people=4)
    for run in (book, other):
        run.robot_strategy = FarAway()
    assert same_after(book, other, 60) == ""


def test_two_in_one_spot_are_no_end_of_time() -> None:
    """As a world that is handed in may have them."""
    book, other = both(people=2)
    for run in (book, other):
        bodies = run.world.bodies
        bodies.position[1] = bodies.position[0]
        bodies.place[1] = bodies.place[0]
        bodies.floor[1] = bodies.floor[0]
    assert same_after(book, other, 60) == ""


class Stay:
    """Robots keep the way that they have."""

    def decide(self, world: Any, robots: Any, rng: Any) -> Any:
        """Decide nothing."""
        return [None] * len(robots)


def test_a_robot_is_where_its_position_is() -> None:
    """Though it has no way to go, and nobody has said in which cell it is."""
    book, other = both(people=4)
    for run in (book, other):
        run.robot_strategy = Stay()
        robot = run.world.robots[0]
        rooms = run.building.kind[robot.floor] == Kind.FLOOR
        there = run.building.random_point(rooms, np.random.default_rng(1))
        assert run.navigation.place(robot.floor, *there) != robot.place
        robot.position = np.array(there)
    assert same_after(book, other, 10) == ""


def test_the_way_of_a_robot_in_a_wall_has_no_end() -> None:
    """It would cut a corner in every tick: the book puts one more place before it."""
    book, other = both(people=4)
    size = book.navigation.floor_size
    for run in (book, other):
        run.robot_strategy = Stay()
        robot = run.world.robots[0]
        robot.position = run.navigation.centres[robot.floor * size].copy()
        robot.way = [robot.place] * (size - 4)
    assert same_after(book, other, 30) == ""
    assert len(other.world.robots[0].way) == size + 26
    other = pickle.loads(pickle.dumps(other))
    assert same_after(book, other, 5) == ""


def test_no_fire_that_decides_is_a_fire() -> None:
    """Whoever puts a method of their own into the book's strategy is asked."""

    def decide(world: Any, rng: Any) -> Any:
        return 0, *world.bodies.position[0].tolist()

    book, other = both(robots="none", fire="none", decision_seconds=1.0)
    for run in (book, other):
        assert isinstance(run.fire_strategy, NoFire)
        vars(run.fire_strategy)["decide"] = decide
    assert same_after(book, other, 60) == ""
    assert other.world.flames.sources


# -- Whoever changes the world ------------------------------------------------------


@pytest.mark.parametrize("odd", ODD, ids=lambda odd: odd.__name__.strip("_"))
def test_what_somebody_changes_has_the_effect_that_it_has_in_the_book(odd: Any) -> None:
    """Between ticks, in the arrays and objects that are there, or by others."""
    book, other = both(fire="busiest", spread_rate=0.3, people=20)
    for round in range(4):
        for run in (book, other):
            odd(run, np.random.default_rng(round), round)
        assert same_after(book, other, 12) == ""


def test_a_strategy_may_change_the_world_that_it_is_asked_about() -> None:
    """At its decisions, in the middle of a tick."""
    book, other = both(fire="busiest", decision_seconds=1.0, people=20)
    for run in (book, other):
        run.robot_strategy = Meddler(run.robot_strategy, run)
        run.fire_strategy = Meddler(run.fire_strategy, run)
    assert same_after(book, other, 150) == ""


def test_minds_and_arrays_that_somebody_holds_stay_current() -> None:
    """Since before the engine began; what is changed in a mind counts."""
    book, other = both()
    held = [(run.world.minds[0], run.world.bodies.position) for run in (book, other)]
    for _ in range(20):
        book.step()
        advance(other, 1)
        (mind, position), (twin, at) = held
        assert mind == twin
        assert np.array_equal(position, at)
        mind.trail, twin.trail = [], []
    assert unlike(book, other) == ""


MATTERS: dict[str, tuple[float, dict[str, Any]]] = {
    "NO_HEALTH": (95.0, {}),
    "STUCK_SECONDS": (0.4, {}),
    "RECKLESS_SECONDS": (0.4, {}),
    "STUCK_WAIT_SECONDS": (0.2, {}),
    "MOST_FOLLOWERS": (1, {"people": 60}),
    "GOAL_HYSTERESIS": (0.0, {"building": "paper", "robots": "none", "people": 60}),
    "SHOULDER_METRES": (0.4, {"people": 150}),
    "IDLE_SPEED": (0.5, {}),
    "PUSH_ROUNDS": (1, {"people": 150}),
    "DOORWAY_METRES": (6.0, {}),
    "FIRE_EVERY_DECISIONS": (1, {"decision_seconds": 1.0}),
}
"""To what a number is changed, and in what runs, where less changes nothing soon."""


@pytest.mark.parametrize("name", [*OF_PAPER, *INDIRECT])
def test_a_number_changed_during_a_run_is_heard_as_in_the_book(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Every number of `paper` that the engine takes over, and it changes the run."""
    if name in ("RECKLESS_SECONDS", "STUCK_WAIT_SECONDS"):  # few people are stuck
        monkeypatch.setattr(paper, "STUCK_SECONDS", 0.6)
    old = getattr(paper, name)
    less = old + 1 if isinstance(old, int) else 0.7 * old
    new, said = MATTERS.get(name, (less, {}))
    book, other = both(**{"fire": "busiest", "spread_rate": 0.5, "people": 30, **said})
    assert same_after(book, other, 10) == ""
    unchanged = book.copy()
    for _ in range(100):
        unchanged.step()
    monkeypatch.setattr(paper, name, new)
    assert same_after(book, other, 100) == ""
    assert unlike(book, unchanged) != ""


# -- Copies, pickles, turns ---------------------------------------------------------


def test_what_the_engine_began_the_book_ends() -> None:
    """Each goes on from where the other stopped, many times."""
    book, other = both()
    while not book.done:
        for _ in range(7):
            if not book.done:
                book.step()
        advance(other, 3)
        for _ in range(4):
            if not other.done:
                other.step()
    assert unlike(book, other) == ""


def test_copies_at_any_moment_go_on_like_the_one_copied() -> None:
    """By the engine or by the book; and the one copied stays as it is."""
    book, run = both(fire="busiest", time_limit=40.0)
    book.run()
    while not run.done:
        by_engine = run.copy()
        by_book = run.copy()
        engine.run_to_end([by_engine])
        by_book.run()
        assert unlike(book, by_engine) == unlike(book, by_book) == ""
        advance(run, 41)
    assert unlike(book, run) == ""


def test_a_simulation_goes_through_a_pickle_in_the_middle() -> None:
    """As it does on the way to a worker."""
    book, run = both(fire="busiest", time_limit=40.0)
    for ticks in (1, 60, 25):
        advance(run, ticks)
        for _ in range(ticks):
            book.step()
        run = pickle.loads(pickle.dumps(run))
        assert unlike(book, run) == ""
    engine.run_to_end([run])
    book.run()
    assert unlike(book, run) == ""


def test_meddling_is_no_idle_threat() -> None:
    """Somebody who meddles with one world only is found out."""
    book, other = both()
    assert same_after(book, other, 5) == ""
    meddle(other, np.random.default_rng(1))
    assert same_after(book, other, 30) != ""


# -- The command --------------------------------------------------------------------


def hangs(numbers: range) -> equality.Part:
    """In the place of `compare`, where some emergency has no end."""
    time.sleep(600 if numbers[0] else 0)
    return equality.Part(len(numbers), 1, "")


def test_what_hangs_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    """By the numbers among which it is; nobody goes on waiting."""
    monkeypatch.setattr(equality, "compare", hangs)
    monkeypatch.setattr(equality, "make_ready", print)
    monkeypatch.setattr(equality, "PATIENCE", 3.0)
    assert equality.compare_many(1000, 2) == equality.Part(
        20, 1, "no end of an emergency in range(20, 40) or range(40, 60)"
    )
