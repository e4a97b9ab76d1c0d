"""Bodies walk: free speed, gaps, doors, counterflow; nobody in anybody or a wall."""

from itertools import combinations
from math import atan2

import numpy as np
import pytest
from conftest import at_most
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.distance import pdist

from reference import motion, paper
from reference.paper import BODY_RADIUS, WALKING_SPEED, Scenario
from reference.workshop.measuring.halls import Crowd, build_floors, put_people

TICK = Scenario().tick
TOUCHING = 2 * BODY_RADIUS - 1e-6
STRIDE = WALKING_SPEED * TICK


def walk(position, aim, ticks, free=None, pace=WALKING_SPEED):
    """Positions of bodies at every tick; free: (k, 2) metres -> (k,) bool."""
    track = [np.array(position, float)]
    aim = np.array(aim, float)
    floor = np.zeros(len(aim), int)
    speed = np.full(len(aim), pace)
    rng = np.random.default_rng(0)
    free = free or everywhere
    for _ in range(ticks):
        track.append(moved(track[-1], floor, aim, speed, lambda at, _: free(at), rng))
    return np.array(track)


def everywhere(at):
    """There is no wall."""
    return np.ones(len(at), bool)


def moved(position, floor, aim, pace, free, rng):
    """Positions a tick later."""
    return motion.step(position, floor, aim, pace, TICK, free, rng)


def corridor(width):
    """May a body stand there: a corridor along x, so many metres wide."""
    return lambda at: np.abs(at[:, 1]) < width / 2


class NoChance:
    """In the place of a generator: all that is drawn is 0."""

    def uniform(self, low, high, count):
        """In the middle between these, if they are -1 and 1."""
        return np.zeros(count)


def shuffled(position, aim):
    """How far bodies get in a tick in which there is room for one small step only."""
    start = np.array(position, float)
    n = len(start)
    stride = paper.SHUFFLE_SPEED * TICK

    def free(at, who):
        return np.hypot(*(at - start[who]).T) <= stride + 1e-9

    pace = np.full(n, WALKING_SPEED)
    return moved(start, np.zeros(n, int), aim, pace, free, NoChance()) - start


# -- One body -----------------------------------------------------------------------


def test_a_body_stops_at_its_aim():
    """It neither shoots past it nor circles around it."""
    track = walk([[0, 0]], [[2, 1]], ticks=30)
    assert np.hypot(*(track[-1, 0] - [2, 1])) < 0.5
    assert np.hypot(*(track[-1, 0] - track[-2, 0])) < 0.1 * WALKING_SPEED * TICK


@pytest.mark.paper("A9", "chosen")
@pytest.mark.parametrize("along", [0, 1], ids=["x", "y"])
def test_a_body_slides_along_a_wall_towards_its_aim(along):
    """Along either axis; it does not stop at the first touch."""
    aim = [2, 2]
    aim[along] = 5
    track = walk([[0, 0]], [aim], 60, lambda at: np.abs(at[:, 1 - along]) < 0.5)
    assert track[-1, 0, along] > 4


@pytest.mark.paper("A9", "chosen")
def test_all_who_can_go_nowhere_stay_where_they_are():
    """Two in niches of their own, nine metres apart."""
    start = [[0, 0], [9, 9]]
    aim = [[5, 5], [14, 14]]
    track = walk(start, aim, 5, lambda at: (at % 9 < 0.1).all(axis=1))
    assert np.array_equal(track[-1], track[0])


@pytest.mark.paper("A9", "chosen")
def test_where_both_ways_along_a_wall_are_free_a_body_slides_east_or_west():
    """At a corner it meets on the diagonal; then it goes on northwards."""
    track = walk([[0, 0]], [[5, 5]], 1, lambda at: (at <= 0.1).any(axis=1))
    assert track[1, 0, 0] > 0.1 and track[1, 0, 1] == 0


def test_people_walk_a_little_to_the_right_of_their_target():
    """ASIDE of it, so ten metres away a tenth of that for each metre walked."""
    track = walk([[0, 0]], [[10, 0]], ticks=1)
    assert track[1, 0] == pytest.approx(
        [STRIDE, -STRIDE * paper.ASIDE_METRES / 10], abs=1e-3
    )


# -- Two bodies ---------------------------------------------------------------------


@pytest.mark.paper("A9", "chosen")
def test_of_two_in_each_others_way_only_one_waits():
    """Whoever has farther to go: the gap allows so much; the other walks on."""
    track = walk([[0, 0], [0.8, 0]], [[8.7, 5], [-9.6, -6]], ticks=1)
    steps = np.hypot(*np.diff(track, axis=0)[0].T)
    gap = 0.8 - 2 * BODY_RADIUS
    assert steps == pytest.approx([STRIDE, gap / paper.GAP_SECONDS * TICK], rel=1e-3)


@pytest.mark.paper("A9", "chosen")
def test_of_two_with_equally_far_to_go_the_second_waits():
    """And the first does not."""
    track = walk([[-0.5, 0], [0.5, 0]], [[8.5, 5], [-8.5, -5]], ticks=1)
    steps = np.hypot(*np.diff(track, axis=0)[0].T)
    gap = 1.0 - 2 * BODY_RADIUS
    assert steps == pytest.approx([STRIDE, gap / paper.GAP_SECONDS * TICK], rel=1e-3)


@pytest.mark.paper("A9", "chosen")
def test_speed_falls_with_the_gap_ahead():
    """Behind somebody slow one walks no faster, and touches nobody."""
    pace = np.array([WALKING_SPEED, 0.5])
    track = walk([[0, 0], [3, 0]], [[30, 0], [30, 0]], 60, corridor(0.3), pace)
    speed = np.diff(track[:, 0, 0]) / TICK
    assert speed[0] == pytest.approx(WALKING_SPEED, rel=0.02)
    assert speed[-1] == pytest.approx(0.5, rel=0.1)
    assert min(pdist(at)[0] for at in track) >= TOUCHING


@pytest.mark.paper("A9", "chosen")
@pytest.mark.parametrize("metres", [[0.6, 1.3], [1.3, 0.6]], ids=str)
def test_of_two_ahead_the_nearer_sets_the_pace(metres):
    """Whichever has the lower number."""
    aim = [[9, 0]] + [[x, 0] for x in metres]
    track = walk([[0, 0], *aim[1:]], aim, ticks=1)
    gap = 0.6 - 2 * BODY_RADIUS
    walked = np.hypot(*track[1, 0])
    assert walked == pytest.approx(gap / paper.GAP_SECONDS * TICK, rel=1e-3)


@pytest.mark.paper("A9", "chosen")
def test_one_keeps_as_far_to_the_right_of_two_as_of_one():
    """Who come towards one, so far away that they do not push yet."""
    aside = []
    for ys in ([0.0], [-0.2, 0.2]):
        start = [[0, 0]] + [[1.5, y] for y in ys]
        aim = [[9, 0]] + [[-9, y] for y in ys]
        aside.append(walk(start, aim, ticks=1)[1, 0, 1])
    assert aside[0] < -0.1
    assert aside[1] == pytest.approx(aside[0], abs=0.01)


@pytest.mark.paper("A9", "chosen")
def test_a_push_reaches_those_in_the_middle_of_a_row():
    """Of four who overlap by 10 cm each. In the first of three rounds the pushes on the
    inner two cancel each other; the outer two make room for them."""
    row = [[0, 0], [0.3, 0], [0.6, 0], [0.9, 0]]
    track = walk(row, row, ticks=1)
    assert track[1, :, 0] == pytest.approx([-0.1, 0.275, 0.625, 1.0])


@pytest.mark.paper("A9", "chosen")
def test_nobody_is_pushed_into_a_wall():
    """Of two who overlap beside it, one is pushed."""
    start = [[0.05, 0], [0.15, 0]]
    track = walk(start, start, 1, lambda at: at[:, 0] >= 0)
    assert track[1, :, 0] == pytest.approx([0.05, 0.3])


@pytest.mark.paper("A9", "chosen")
@pytest.mark.parametrize("fast", [0, 1])
def test_in_long_ticks_two_who_run_at_each_other_heed_each_other_from_afar(fast):
    """Half a second: either of them gets as far as a metre and a half."""
    pace = np.array([0.1, 0.1])
    pace[fast] = 3.0
    found = motion.neighbours(
        np.array([[0.0, 0], [3.3, 0]]), np.zeros(2, int), pace, seconds=0.5
    )
    assert found.T.tolist() == [[0, 1]]


def test_people_on_different_floors_do_not_meet():
    """They stand in the same spot and walk as if alone."""
    at = np.zeros((2, 2))
    floors = np.array([0, 1])
    aim = np.array([[5.0, 0], [5.0, 0]])
    speed = np.full(2, WALKING_SPEED)
    rng = np.random.default_rng(0)
    one, other = moved(at, floors, aim, speed, lambda p, _: everywhere(p), rng)
    assert np.array_equal(one, other)
    assert np.hypot(*one) == pytest.approx(WALKING_SPEED * TICK)


@pytest.mark.paper("A9", "chosen")
def test_neighbours_are_found_in_the_order_of_their_numbers():
    """Each pair once, as far apart as NEIGHBOUR_METRES at most, on one floor."""
    rng = np.random.default_rng(0)
    at = rng.uniform(0, 9, (60, 2))
    floor = rng.integers(0, 2, 60)
    found = motion.neighbours(at, floor, np.full(60, WALKING_SPEED), TICK)
    pairs = combinations(range(60), 2)
    expected = [
        (i, j)
        for i, j in pairs
        if floor[i] == floor[j] and pdist(at[[i, j]])[0] <= paper.NEIGHBOUR_METRES
    ]
    assert list(map(tuple, found.T.tolist())) == expected


# -- Crowds -------------------------------------------------------------------------


@pytest.mark.paper("A9", "chosen")
@given(st.integers(0, 2**32 - 1))
@settings(max_examples=10)
def test_nobody_ever_overlaps_anybody(seed):
    """Forty people in ten metres square, each with an aim of their own."""
    rng = np.random.default_rng(seed)
    cells = rng.choice(100, 40, replace=False)
    start = np.stack([cells // 10, cells % 10], axis=1) + 0.5
    aim = rng.uniform(0, 10, (40, 2))
    track = walk(start, aim, 100, lambda at: ((at > 0) & (at < 10)).all(axis=1))
    assert min(pdist(at).min() for at in track) >= paper.SHOULDER_METRES - 1e-6
    assert track.min() > 0 and track.max() < 10


@pytest.mark.parametrize("width", [0.3, 1.0])
def test_nobody_overtakes_through_anybody_in_a_narrow_corridor(width):
    """Ten people, the fastest last; without room to pass, the order stays."""
    start = np.stack([np.arange(10) * 0.6, np.zeros(10)], axis=1)
    pace = np.linspace(1.7, 0.9, 10)
    aim = start + np.array([40.0, 0.0])
    track = walk(start, aim, 150, corridor(width), pace)
    assert min(pdist(at).min() for at in track) >= TOUCHING
    in_order = (np.diff(track[..., 0], axis=1) > 0).all()
    assert in_order or width > 2 * BODY_RADIUS


@pytest.mark.parametrize("apart", [0.0, 3e-10, 7e-10])
def test_two_who_stand_in_one_spot_do_not_halt_time(apart):
    """A world that is handed in may have them so; a little apart, they step aside."""
    start = [[0, 0], [apart, 0]]
    with at_most(60):
        track = walk(start, start, 3)
    assert np.array_equal(track[-1], start) is (apart == 0.0)


@pytest.mark.paper("A9", "chosen")
def test_people_who_meet_turn_their_shoulders():
    """In a corridor where two abreast would overlap they pass each other."""
    track = walk([[0, 0.1], [4, -0.1]], [[9, 0], [-9, 0]], 60, corridor(0.38))
    assert track[-1, 0, 0] > 4 and track[-1, 1, 0] < 0
    assert paper.SHOULDER_METRES - 1e-6 < min(pdist(at)[0] for at in track) < TOUCHING


@pytest.mark.paper("A9", "chosen")
def test_people_who_stop_before_they_meet_do_not_turn_their_shoulders():
    """They walk at each other, but not so far."""
    track = walk([[0, 0], [0.5, 0]], [[0.15, 0], [0.35, 0]], 30)
    assert min(pdist(at)[0] for at in track) >= TOUCHING


@pytest.mark.paper("A9", "chosen")
def test_who_meets_somebody_and_is_held_up_shuffles_to_the_right():
    """By a radian, if chance does not turn them."""
    one, other = shuffled([[0, 0], [0.4, 0]], [[9, 0], [-9, 0]])
    assert atan2(one[1], one[0]) == pytest.approx(-1, abs=0.05)
    assert other == pytest.approx(-one, abs=1e-3)


@pytest.mark.paper("A9", "chosen")
def test_who_stands_and_cannot_step_aside_shuffles():
    """Away from who walks at them."""
    (stride, _), _ = shuffled([[0, 0], [-0.5, 0]], [[0, 0], [9, 0]])
    assert stride == pytest.approx(paper.SHUFFLE_SPEED * TICK)


@pytest.mark.paper("A9", "chosen")
def test_who_steps_aside_does_so_at_one_speed():
    """GIVE_WAY_SPEED at most, also if three walk at them."""
    three = [[-0.6, 0], [-0.48, -0.36], [-0.48, 0.36]]
    track = walk([[0, 0], *three], [[0, 0], [9, 0], [8, 6], [8, -6]], 1)
    assert track[1, 0] == pytest.approx([paper.GIVE_WAY_SPEED * TICK, 0], abs=1e-3)


@pytest.mark.paper("A9", "chosen")
def test_who_stands_steps_aside_for_who_walks_at_them_and_comes_back():
    """A hand's breadth is enough."""
    track = walk([[0, 0], [2, 0.1]], [[9, 0], [2, 0.1]], 40)
    aside = np.hypot(*(track[:, 1] - [2, 0.1]).T)
    assert 0.05 < aside.max() < 0.2 and aside[-1] < 0.01
    assert track[-1, 0, 0] > 8.5


def test_chance_moves_only_who_is_held_up():
    """Whoever walks freely walks the same way, however the others shuffle."""
    start = np.array([[0.0, 0], [9.8, 0], [9.3, 0]])
    aim = np.array([[-40.0, 0], [40, 0], [40, 0]])
    floor = np.zeros(3, int)
    pace = np.full(3, WALKING_SPEED)
    ends = []
    for seed in range(2):
        at = start
        rng = np.random.default_rng(seed)
        for _ in range(5):
            at = moved(at, floor, aim, pace, lambda p, _: p[:, 0] < 10, rng)
        ends.append(at)
    assert np.array_equal(ends[0][0], ends[1][0])
    assert not np.array_equal(ends[0][1], ends[1][1])


@pytest.mark.paper("A9", "chosen")
def test_two_crowds_pass_each_other_in_a_door():
    """Twenty each way through one metre, in less time than a minute and a half."""
    room = "......"
    wall = "###############"
    rows = [f"E{room}+{room}E", *3 * [f"#{room}#{room}#"]]
    building = build_floors([wall, *rows, wall])
    west, east = sorted(building.exits, key=lambda m: building.landmarks[m].position)
    sides = [(20, (0, slice(1, 5), slice(first, first + 6))) for first in (1, 8)]
    goals = [east] * 20 + [west] * 20
    crowd = Crowd(put_people(building, 0, *sides), 0, goals, limit=90)
    assert crowd.run().evacuated == 40
