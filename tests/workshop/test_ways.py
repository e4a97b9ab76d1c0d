"""Compiled ways: scipy's, to the last bit."""

from typing import Any

import numpy as np
import pytest

pytest.importorskip("numba")

from reference import paper
from reference.fire import RandomFire
from reference.navigation import Navigation, navigation_of
from reference.paper import Scenario
from reference.rays import sight_of
from reference.simulation import Simulation
from reference.workshop import engine
from reference.workshop.engine.mirrors import compiled
from reference.workshop.engine.state import NUMBERS
from reference.workshop.engine.tables import tables_of
from reference.workshop.engine.ways import nearest_free, next_place, quick_ways
from reference.workshop.maps import load
from reference.workshop.strategies.guides import Sweep

MAPS = ("paper", "tower", "tiny", "school", "museum", "maze")
PRICES: dict[str, tuple[float, ...]] = {
    "none": (),
    "flames": (1.0, 1.0, 1.0, 1.0, 4.0, 50.0),
    "cheap and dear": (0.1, 0.5, 1.0, 2.0, 7777.0),
    "barred": (1.0, 1.0, 1.0, np.inf),
    "some free": (0.0, 1.0, 1.0),
}


@pytest.fixture(params=MAPS)
def nav(request: pytest.FixtureRequest) -> Navigation:
    """The ways of a building that ships."""
    return navigation_of(load(request.param))


def some_goals(nav: Navigation, rng: np.random.Generator, count: int) -> list[int]:
    """Some places of one floor, perhaps one of them twice."""
    floor = rng.integers(nav.floors)
    places = np.flatnonzero(nav.walkable)
    places = places[places // nav.floor_size == floor]
    return rng.choice(places, count).tolist()


def both(
    nav: Navigation, goals: list[int], cost: np.ndarray | None
) -> tuple[tuple[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]:
    """What the book finds, and what the engine finds."""
    book = nav.shortest(goals, cost)
    with quick_ways(nav):
        return book, nav.shortest(goals, cost)


@pytest.mark.paper("A7")
@pytest.mark.parametrize("name", PRICES)
def test_compiled_ways_are_scipys_to_the_last_bit(nav: Navigation, name: str) -> None:
    """Metres and next places, to one goal and to many, whatever a metre costs."""
    rng = np.random.default_rng(7)
    for count in (1, 1, 1, 2, 5, 30):
        cost = rng.choice(PRICES[name], nav.places) if PRICES[name] else None
        book, mine = both(nav, some_goals(nav, rng, count), cost)
        assert np.array_equal(book[0], mine[0])
        assert np.array_equal(book[1], mine[1])


def test_prices_of_any_size_change_nothing(nav: Navigation) -> None:
    """No two prices alike, below 1 and above: places then wait more than once."""
    rng = np.random.default_rng(8)
    for most in (1.0, 3.0, 1e3, 1e6):
        cost = rng.uniform(most / 100, most, nav.places)
        book, mine = both(nav, some_goals(nav, rng, 3), cost)
        assert np.array_equal(book[0], mine[0])
        assert np.array_equal(book[1], mine[1])


@compiled
def _next_places(N: Any, W: Any, goal: int, found: np.ndarray) -> None:
    for k in range(len(found)):
        found[k] = next_place(N[0], W, found[k], goal)


@compiled
def _nearest(N: Any, cells: Any, floor: int, x: float, y: float) -> int:
    return nearest_free(N[0], cells, floor, x, y)


def numbers_of(nav: Navigation) -> np.ndarray:
    """The numbers that ways ask for."""
    numbers = np.zeros(1, NUMBERS)
    for name in ("floor_size", "rows", "cols", "places"):
        numbers[name] = getattr(nav, name)
    numbers["top"], numbers["left"] = nav.building.origin
    return numbers


def test_the_next_place_is_the_books(nav: Navigation) -> None:
    """To more goals than are kept, and to the first of them again."""
    rng = np.random.default_rng(9)
    tables = tables_of(sight_of(nav.building, 8.0)).arrays
    numbers = numbers_of(nav)
    goals = [some_goals(nav, rng, 1)[0] for _ in range(600)]
    for goal in goals + goals[:20]:
        floor = goal // nav.floor_size
        found = np.arange(floor * nav.floor_size, (floor + 1) * nav.floor_size)
        _next_places(numbers, tables.ways, goal, found)
        assert np.array_equal(found, nav._search(floor, None, (goal,))[1])


def test_the_nearest_free_place_is_the_books(nav: Navigation) -> None:
    """Of points on borders and corners too, in walls, and outside the drawing."""
    rng = np.random.default_rng(10)
    cells = tables_of(sight_of(nav.building, 8.0)).arrays.cells
    numbers = numbers_of(nav)
    low = nav.centres.min(axis=0) - 3
    high = nav.centres.max(axis=0) + 3
    points = rng.uniform(low, high, (300, 2))
    points[100:200] = points[100:200].round()
    points[200:, 0] = points[200:, 0].round()
    for x, y in points.tolist():
        for floor in range(nav.floors):
            mine = _nearest(numbers, cells, floor, x, y)
            assert mine == nav.nearest_free(floor, x, y)


@pytest.mark.parametrize("price", [0.5, 7.7, 1e5])
def test_robots_go_round_flames_whatever_these_cost(
    monkeypatch: pytest.MonkeyPatch, price: float
) -> None:
    """Other numbers in `paper` change ways, and engine and book alike."""
    monkeypatch.setattr(paper, "BURN_COST", price)
    monkeypatch.setattr(paper, "HEAT_COST", price / 2)
    book, other = (
        Simulation(load("tiny"), Scenario(people=12), Sweep(), RandomFire(), 4)
        for _ in range(2)
    )
    book.run()
    engine.run_to_end([other])
    assert book.events == other.events
    assert [robot.way for robot in book.world.robots] == [
        robot.way for robot in other.world.robots
    ]


def test_the_book_has_its_own_search_back(nav: Navigation) -> None:
    """Also after an error; and meanwhile searches are kept as the book keeps them."""
    books = nav._search
    with pytest.raises(KeyError), quick_ways(nav):
        assert nav._search is not books
        nav.distances(nav.goals[0])
        nav.distances(nav.goals[0])
        assert nav._search.cache_info().hits
        raise KeyError
    assert nav._search is books


def test_a_search_of_ones_own_stays(
    nav: Navigation, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Who has replaced the book's search is heard."""

    def nothing(*asked: Any) -> tuple[np.ndarray, np.ndarray]:
        return np.zeros(nav.floor_size), np.zeros(nav.floor_size, np.int32)

    monkeypatch.setattr(nav, "_search", nothing)
    with quick_ways(nav):
        assert nav._search is nothing
