"""Walkable cells and shortest ways, against networkx on the same grid."""

from heapq import heapify, heappop, heappush
from itertools import pairwise, product

import networkx as nx
import numpy as np
import pytest
from hypothesis import given
from movies import GRIDS, built, shipped, walled

from reference.navigation import navigation_of
from reference.workshop.strategies.traffic import places_walked

pytestmark = pytest.mark.paper("A7")


def oracle(building):
    """The same grid in networkx: eight neighbours, no corner cut."""
    free = {tuple(cell) for cell in np.argwhere(building.walkable[0]).tolist()}
    graph = nx.Graph()
    graph.add_nodes_from(free)
    for r, c in free:
        for dr, dc in ((0, 1), (1, 0), (1, 1), (1, -1)):
            if {(r + dr, c + dc), (r + dr, c), (r, c + dc)} <= free:
                graph.add_edge((r, c), (r + dr, c + dc), weight=np.hypot(dr, dc))
    return graph


@given(GRIDS)
def test_shortest_ways_are_as_long_as_networkx_says(rows):
    """From every cell to the first one; where there is no way, it is infinite."""
    building = walled(rows)
    length = nx.single_source_dijkstra_path_length(oracle(building), (1, 1))
    d = navigation_of(building).distances([building.kind.shape[2] + 1])
    cells = np.ndindex(building.kind.shape[1:])
    np.testing.assert_allclose(d, [length.get(cell, np.inf) for cell in cells])


@given(GRIDS)
def test_a_way_pulled_straight_never_cuts_a_corner(rows):
    """A body of two centimetres passes everywhere along it; it is none the longer."""
    building = walled(rows)
    nav = navigation_of(building)
    start = building.kind.shape[2] + 1
    for goal in np.flatnonzero(nav.walkable).tolist():
        length = nav.distances([goal])[start]
        corners = nav.way(start, goal)
        assert bool(corners) == np.isfinite(length)
        line = nav.centres[[start, *corners]]
        assert np.hypot(*np.diff(line, axis=0).T).sum() <= length + 1e-9
        for here, there in pairwise(line):
            assert passable(nav, here, there)


def test_where_the_straight_line_is_free_a_way_has_no_other_corner():
    """From everywhere in an open room: to a point and to the exit alike."""
    room = "#######\n#.....#\n#.....#\n#.....E\n#######"
    nav = navigation_of(built(room))
    (exit,) = nav.goals[0].tolist()
    for p in np.flatnonzero(nav.walkable).tolist():
        assert nav.way(p, exit - 1) == [exit - 1]
        assert nav.waypoint[0, p] == (exit if nav.clear.reaches(p, exit) else exit - 1)


def passable(nav, here, there):
    """Is the straight line walkable, a centimetre to its left and right too?"""
    along = (there - here) / max(np.hypot(*(there - here)), 1e-9)
    aside = 0.01 * np.array([-along[1], along[0]])
    line = here + np.linspace(0, 1, 200)[:, None] * (there - here)
    points = np.concatenate([line + aside, line - aside])
    return nav.walkable[nav.places_at(np.zeros(len(points), int), points)].all()


@pytest.mark.parametrize("name", ["paper", "maze"])
def test_walking_at_the_aim_leads_to_the_landmark_without_leaving_the_floor(name):
    """From every cell that has a way to it, over walkable cells only."""
    nav = navigation_of(shipped(name))
    for mark in nav.building.landmarks:
        reached = np.flatnonzero(np.isfinite(nav.distance_to(mark.index)))
        for p in reached[:: len(reached) // 20].tolist():
            chain = [p, *places_walked(nav, p, mark.index)]
            assert nav.walkable[chain].all()
            assert nav.building.landmark.ravel()[chain[-1]] == mark.index


def test_tables_hold_each_landmarks_own_floor_alone():
    """Six floors take six times as much as one, not 36 times; several are merged."""
    nav = navigation_of(shipped("tower"))
    assert nav.metres.size * nav.floors == len(nav.goals) * nav.places
    assert nav.waypoint.shape == nav.metres.shape
    each = [nav.distances(goals) for goals in nav.goals]
    assert np.array_equal(nav.to_landmarks, np.min(each, axis=0))
    assert np.isinf(nav.distance_to()).all()


def test_a_dear_place_is_walked_around():
    """Cost is a factor per metre: a detour is taken as soon as it is cheaper."""
    nav = navigation_of(
        built("""
        #######
        #.....#
        #.###.#
        #.....E
        #######
    """)
    )
    start, goal, dear = (3 * nav.cols + col for col in (1, 5, 3))
    assert nav.distances([goal])[start] == 4
    cost = np.ones(nav.places)
    cost[dear] = 10
    assert nav.distances([goal], cost)[start] == 8
    assert dear not in nav.way(start, goal, cost)


@pytest.mark.parametrize("dtype", [int, np.float32, float])
def test_a_dear_place_costs_on_the_way_in_and_on_the_way_out(dtype):
    """A way is as long in either direction; at infinite cost there is none."""
    nav = navigation_of(built("#.....E"))
    cost = np.ones(nav.places, dtype)
    cost[nav.cols + 3] = 5
    there = nav.distances([nav.cols + 1], cost)[nav.cols + 3]
    back = nav.distances([nav.cols + 3], cost)[nav.cols + 1]
    assert there == back == 6
    barred = np.where(cost == 5, np.inf, 1)
    assert nav.way(nav.cols + 1, nav.cols + 5, barred) == []


def test_the_nearest_free_place_to_a_wall_is_beside_it():
    """A destination inside a wall is corrected to where one can stand."""
    nav = navigation_of(built("#.....E"))
    x, y = nav.building.metres(0, 3)
    assert nav.nearest_free(0, x, y) == nav.cols + 3


def test_of_two_equally_near_free_places_the_first_is_taken():
    """In reading order: of four around a corner the one in the north-west."""
    nav = navigation_of(built("#####\n#...#\n#...E\n#####"))
    x, y = nav.building.metres(1.5, 2.5)
    assert nav.nearest_free(0, x, y) == nav.cols + 2


def test_the_next_place_of_a_way_is_on_its_own_floor():
    """On the second floor the way round the pillar is the other one."""
    lower = "#####\n#..##\n#.#.#\n#...E\n#####"
    upper = "#####\n#...#\n#.#.#\n##..#\n#####"
    nav = navigation_of(built(f"{lower}\n\n{upper}"))
    start, goal, south, east = (
        row * nav.cols + col for row, col in ((1, 1), (3, 3), (2, 1), (1, 2))
    )
    assert nav.next_place(start, goal) == south
    up = nav.floor_size
    assert nav.next_place(up + start, up + goal) == up + east


def test_the_place_beyond_a_door_is_on_its_other_side():
    """Seen from either room."""
    building = built("#..+..E")
    nav = navigation_of(building)
    door = nav.cols + 3
    west, east = (int(building.area.ravel()[door + step]) for step in (-1, 1))
    assert nav.place_beyond(door, west) == door + 1
    assert nav.place_beyond(door, east) == door - 1


def test_a_straight_line_is_the_places_it_crosses_in_order():
    """Its own left out, each once, the last one the goal; none to where one is."""
    nav = navigation_of(shipped("paper"))
    p = nav.place(0, 5.5, 5.5)
    row, col = divmod(p, nav.cols)
    for d_row, d_col in product(range(-5, 6), repeat=2):
        q = p + d_row * nav.cols + d_col
        line = nav.straight_way(p, q)
        assert p not in line and len(set(line)) == len(line)
        assert line[-1:] == [q] * (p != q)
        cells = {(a // nav.cols - row, a % nav.cols - col) for a in line}
        for share in np.linspace(0.01, 0.99, 97):
            point = share * np.array([d_row, d_col])
            if (abs(point % 1 - 0.5) > 1e-9).all():  # on no border
                assert tuple(point.round().astype(int).tolist()) in cells | {(0, 0)}


# -- Of equally short ways always the same one --------------------------------------


def test_of_equally_short_ways_the_one_by_the_nearest_then_highest_place_is_taken():
    """Round a pillar southwards; in the open the diagonal step first."""
    nav = navigation_of(built("#####\n#...#\n#.#.#\n#...E\n#####"))
    p, goal, south = (row * nav.cols + col for row, col in ((1, 1), (3, 3), (2, 1)))
    assert nav.shortest([goal])[1][p] == south
    nav = navigation_of(built("#####\n#...#\n#...E\n#####"))
    p, goal, diagonal = (row * nav.cols + col for row, col in ((1, 1), (2, 3), (2, 2)))
    assert nav.shortest([goal])[1][p] == diagonal


@pytest.mark.parametrize("name", ["maze", "museum", "paper", "school", "tiny", "tower"])
def test_a_plain_search_by_that_rule_finds_the_same_ways(name):
    """To single places and to landmarks, with and without flames that cost more."""
    nav = navigation_of(shipped(name))
    rng = np.random.default_rng(0)
    costs = None, rng.choice([1.0, 4.0, 50.0], nav.places)
    free = np.flatnonzero(nav.walkable)
    places = [[p] for p in rng.choice(free, 4).tolist()]
    for goals, cost in product([*places, *(g.tolist() for g in nav.goals[::5])], costs):
        d, after = nav.shortest(goals, cost)
        metres, found = searched(
            nav, goals, np.ones(nav.places) if cost is None else cost
        )
        assert np.array_equal(d, metres)
        assert np.array_equal(after, found)


def searched(nav, goals, cost):
    """Dijkstra's search: the nearest place first, of equally near ones the highest."""
    floor = goals[0] // nav.floor_size
    steps = nav.steps[floor]
    first = floor * nav.floor_size
    d = np.full(nav.places, np.inf)
    after = np.arange(nav.places)
    d[goals] = 0
    heap = [(0.0, -p) for p in goals]
    done = set()
    heapify(heap)
    while heap:
        metres, p = heappop(heap)
        p = -p
        if p in done:
            continue
        done.add(p)
        row = slice(*steps.indptr[p - first : p - first + 2])
        for q, step in zip(steps.indices[row] + first, steps.data[row], strict=True):
            further = metres + step * max(cost[p], cost[q])
            if further < d[q]:  # only what is strictly shorter
                d[q] = further
                after[q] = p
                heappush(heap, (further, -q))
    return d, after
