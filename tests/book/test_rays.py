"""What can be seen from where, against a line drawn cell by cell."""

from functools import partial
from itertools import pairwise
from math import cos, dist, nextafter, sin

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from movies import GAPS, GRIDS, body, built, mark, shipped, stage, view, walled

from reference import paper
from reference.building import Kind, building_of
from reference.paper import RAYS, SIGHT_RANGE, Scenario
from reference.rays import Sight, direction, sight_of
from reference.simulation import Simulation
from reference.view import look


def line_of_sight(building, p, q):
    """Oracle: does a glance from the middle of place p reach the middle of place q?

    Every cell between is see-through, entrances included; at a corner met exactly, one
    cell beside it is.
    """
    here, there = (np.array(np.unravel_index(k, building.kind.shape)) for k in (p, q))
    if here[0] != there[0]:
        return False
    t = (np.arange(1000)[:, None] + 0.3) / 1000  # never exactly at a corner
    points = np.floor(here[1:] + 0.5 + t * (there - here)[1:]).astype(int)
    cells = list(dict.fromkeys(map(tuple, points.tolist())))
    through = (Kind.FLOOR, Kind.STAIRS, Kind.ENTRANCE)
    clear = np.isin(building.kind[here[0]], through)
    beside = [
        clear[one[0], other[1]] or clear[other[0], one[1]]
        for one, other in pairwise(cells)
        if one[0] != other[0] and one[1] != other[1]
    ]
    return all(clear[cell] for cell in cells[1:-1]) and all(beside)


# -- Who sees whom ------------------------------------------------------------------


@given(GRIDS, st.sampled_from([1.5, SIGHT_RANGE, 9.0]))
@settings(max_examples=8)
def test_the_sight_table_agrees_with_a_line_drawn_cell_by_cell(rows, reach):
    """For every pair of places of a random floor."""
    building = walled(rows)
    sight = Sight(building, reach)
    centres = sight.navigation.centres
    places = np.flatnonzero(building.walkable)
    for p in places[::3].tolist():
        near = np.hypot(*(centres[places] - centres[p]).T) <= reach
        expected = [q for q in places[near] if line_of_sight(building, p, q)]
        assert np.array_equal(np.sort(sight.sees.reached_from(p)), expected)


@pytest.mark.paper("B1")
def test_people_see_each_other_exactly_where_there_is_a_line_of_sight():
    """A crowd of 200 on the paper's floors; nobody sees through walls or ceilings."""
    sim = Simulation(shipped("paper"), Scenario(people=200), seed=1)
    bodies = sim.world.bodies
    centres = sim.navigation.centres
    who = np.arange(0, 200, 10)
    views = look(sim.world, sim.sight, who)
    for i, seen in zip(who.tolist(), views, strict=True):
        off = np.abs(bodies.position - bodies.position[i]).max(axis=1)
        near = [j for j in np.flatnonzero(off < SIGHT_RANGE).tolist() if j != i]
        lines = {
            j
            for j in near
            if line_of_sight(sim.building, bodies.place[i], bodies.place[j])
            and dist(*centres[bodies.place[[i, j]]]) <= SIGHT_RANGE
        }
        assert set(seen.bodies) == lines


@pytest.mark.paper("B2")
def test_who_sees_far_sees_from_corner_to_corner():
    """In clear air: a hall's diagonal is longer than its sides."""
    rows = ["#" * 22, "#p" + "." * 19 + "#", *["#" + "." * 20 + "#"] * 18]
    board = "\n".join([*rows, "#" + "." * 19 + "qE", "#" * 22])
    assert body("q") in view(stage(board, sight_range=100.0), "p").bodies


@pytest.mark.paper("B1")
def test_on_the_threshold_one_sees_both_rooms():
    """Rays begin in the door there."""
    sim = stage("#p..+..qE")
    door = int(sim.navigation.places_of(0, sim.building.landmarks[0].cells)[0])
    p, q = sim.world.bodies.place
    assert sim.sight.sees.reaches(np.array([door, door]), np.array([p, q])).all()


# -- Rays ---------------------------------------------------------------------------


def rays(sim):
    """What every ray of the first human meets of the building."""
    return [sim.sight.cast(int(sim.world.bodies.place[0]), k) for k in range(RAYS)]


@pytest.mark.paper("B1")
def test_people_robots_and_flames_in_sight_are_told_apart():
    """And a robot is known by what it says."""
    sim = stage("#p.qR*..E")
    seen = view(sim, "p")
    (robot,) = sim.world.robots
    assert set(seen.bodies) == {body("q"), robot.body}
    assert seen.robots == {robot.body: robot.says}
    assert seen.burns([robot.place + 1]) and not seen.burns([robot.place])


@pytest.mark.paper("B1")
def test_rays_are_counted_counter_clockwise_from_east():
    """Ray 90 points north, to the exit there; each element has its label."""
    sim = stage("####E####\n#.#...#.#\n#.#.p.+.#\n#.#...#.#\n#########")
    hits = rays(sim)
    kinds = [hits[k].kind for k in (0, RAYS // 4, RAYS // 2, 3 * RAYS // 4)]
    assert kinds == ["door", "exit", "wall", "wall"]


@pytest.mark.paper("B1")
def test_a_ray_names_the_entrance_it_hits():
    """Purple things are told from blue ones, and which one it is."""
    sim = stage("#AA+..p..E\n\n#AA+.....#")
    west = rays(sim)[RAYS // 2]
    assert west.kind == "entrance"
    assert west.landmark == mark(sim, Kind.ENTRANCE)
    assert west.distance == pytest.approx(3)


@pytest.mark.paper("B1", "chosen")
@pytest.mark.parametrize("towards", [-np.inf, np.inf])
def test_rays_do_not_depend_on_the_last_digits_of_sine_and_cosine(towards, monkeypatch):
    """Libraries differ by one unit in the last place; here it is four."""
    expected = [direction(k, RAYS) for k in range(RAYS)]

    def shifted(function, angle):
        value = function(angle)
        for _ in range(4):
            value = nextafter(value, towards)
        return value

    for function in (cos, sin):
        monkeypatch.setattr(
            f"reference.rays.{function.__name__}", partial(shifted, function)
        )
    assert [direction(k, RAYS) for k in range(RAYS)] == expected


@pytest.mark.paper("B2")
def test_a_patch_of_floor_lies_on_one_floor():
    """What one has seen below is not explored above."""
    sight = sight_of(shipped("paper"), SIGHT_RANGE)
    below, middle, above = map(set, sight.patches.reshape(3, -1).tolist())
    assert len(below | middle | above) == 3 * len(below)


@pytest.mark.paper("B2")
def test_a_ray_that_returns_nothing_is_unexplored():
    """Along a corridor longer than sight; the walls on both sides are hit."""
    sim = stage("#p.......E")
    hits = rays(sim)
    assert hits[0] is None
    assert hits[RAYS // 4].kind == hits[RAYS // 2].kind == "wall"
    assert all(way.unit[0] > 0.9 for way in view(sim, "p").open)


@pytest.mark.paper("B2")
def test_the_place_where_a_ray_ends_that_returns_nothing_is_seen():
    """Also where no line of sight reaches the middle of it."""
    sight = sight_of(shipped("tiny"), SIGHT_RANGE)
    places = np.flatnonzero(sight.building.walkable).tolist()
    ends = {p: {way.place for way in sight.open(p)} for p in places}
    assert all(ends[p] <= sight.seen(p) for p in places)
    assert not all(ends[p] <= sight.in_line(p) for p in places)


@pytest.mark.paper("B1")
@pytest.mark.parametrize("name", ["paper", "school"])
def test_no_door_slips_between_two_rays(name):
    """Whatever landmark lies in line of sight is met by some ray."""
    building = shipped(name)
    sight = Sight(building, SIGHT_RANGE)
    marks = building.landmark.ravel()
    for p in np.flatnonzero(building.walkable)[::7].tolist():
        seen = marks[sight.sees.reached_from(p)]
        landmarks = (building.landmarks[mark] for mark in set(seen[seen >= 0]))
        ways = {m.index for m in landmarks if m.kind is Kind.DOOR or m.leads_out}
        assert ways - {marks[p]} <= set(sight.landmarks(p))


@pytest.mark.paper("A6")
def test_a_burnt_door_is_seen_through_as_floor_is():
    """Also to where a wall has a gap: there a ray returns nothing [B1]."""
    shut = sight_of(building_of(GAPS), SIGHT_RANGE)
    no_door = sight_of(building_of(GAPS.replace("+", ".")), SIGHT_RANGE)
    (door,) = (m.index for m in shut.building.landmarks if m.kind is Kind.DOOR)
    for p in np.flatnonzero(no_door.building.walkable).tolist():
        stops, ends = shut._rays(p, frozenset({door}))
        assert stops.tolist() == no_door.hits[:, p].tolist()
        assert ends.tolist() == no_door.ends[:, p].tolist()


def test_the_nearest_landmark_comes_first():
    """By the shortest ray that meets each."""
    sim = stage("###E####\n#..p...E\n########")
    met = view(sim, "p").landmarks.values()
    assert [(hit.kind, hit.distance) for hit in met] == [("exit", 1), ("exit", 4)]


@pytest.mark.paper("B1", "chosen")
def test_of_two_equally_near_landmarks_the_eastern_one_comes_first():
    """Rays are counted from there."""
    sim = stage("E..p..E")
    assert [*view(sim, "p").landmarks] == [mark(sim, "E2"), mark(sim, "E1")]


# -- Flames and ranges --------------------------------------------------------------


@pytest.mark.paper("B6", "desired")
@pytest.mark.parametrize(
    ("north", "row", "safe", "passable"),
    [
        ("#######", "#..p...+", True, True),
        ("#######", "#*.p...+", True, True),
        ("#....*.", "#..p...+", False, True),
        ("#######", "#..p.*.+", False, False),
    ],
)
def test_a_way_is_safe_without_flames_on_or_beside_it(north, row, safe, passable):
    """Behind one's back they do not matter; beside the way one can still pass them."""
    seen = view(stage(f"###########\n{north}#..#\n{row}..E\n###########"), "p")
    assert (seen.safe(0), seen.passable(0)) == (safe, passable)


@pytest.mark.paper("B6", "desired")
def test_a_flame_that_is_seen_counts_though_another_is_not():
    """One beside the way; the other one beside it, too, but behind the door."""
    seen = view(stage("##########\n#...*.#..#\n#p....+*.E\n##########"), "p")
    assert seen.burns([seen.place - 10 + 3])
    assert not seen.burns([seen.place + 6])
    assert not seen.safe(0)


@pytest.mark.paper("B2")
def test_nobody_sees_farther_than_the_building_is_wide():
    """A longer range costs nothing, and changes nothing."""
    hall = built("##########\n#.+......#\n#.#......E\n##########")
    assert np.array_equal(Sight(hall, 500).hits, Sight(hall, 10).hits)


@pytest.mark.parametrize(
    ("name", "value"), [("RAYS", 8), ("PATCH_METRES", 2), ("DIM_METRES", 0.5)]
)
def test_whoever_changes_a_number_sees_by_the_new_one(name, value, monkeypatch):
    """And by the old one again when it is back; a table that is held keeps its own."""
    hall = built("##########\n#.+......#\n#.#......E\n##########")

    def facts(sight):
        at = int(np.flatnonzero(hall.walkable)[-1])
        sizes = len(sight.hits), len(set(sight.patches.tolist()))
        return *sizes, len(sight.looked_at(at))

    before = sight_of(hall, 3.0)
    with monkeypatch.context() as changed:
        changed.setattr(paper, name, value)
        assert facts(sight_of(hall, 3.0)) != facts(before)
    assert sight_of(hall, 3.0) is before
    assert facts(before) == facts(Sight(hall, 3.0))
