"""The robot's frame: what a robot sees from where it stands, and how it means it."""

from dataclasses import replace

import numpy as np
import pytest
from hall import BUILDINGS, HALL
from movies import shipped, stage, wait

from reference.building import Kind
from reference.fire import RandomFire, burnable
from reference.game.codec import decision_in
from reference.game.observations import vector_layout
from reference.navigation import navigation_of
from reference.paper import SIGHT_RANGE, Scenario
from reference.robots import actual_target, said_on_the_way
from reference.simulation import Simulation
from reference.workshop.anchors.frame import (
    ASTRAY,
    FIRST_MARK,
    KEEP,
    UNIT,
    nearness,
    robot_destinations,
    to_normalised,
)
from reference.workshop.anchors.settings import RobotsFrame
from reference.workshop.strategies.fires import places_beside
from reference.workshop.strategies.guides import Sweep
from reference.workshop.strategies.observed import guard_points, guess_guides, way_marks
from reference.workshop.training.presets import preset
from reference.world import NOBODY, NOWHERE

WIDTH = 5  # numbers of a point


def frame_of(sim, masks=False):
    """How robots read and speak in a simulation."""
    settings = replace(preset("tiny").robots, masks=masks)
    return RobotsFrame(sim.building, sim.scenario, settings)


def seen(sim, masks=False, going=None):
    """A frame and what all robots of a simulation see.

    going: where all of them are headed, metres, if not where the simulation says
    """
    frame = frame_of(sim, masks)
    aims = robot_destinations(sim.world)
    if going is not None:
        aims[:] = to_normalised(sim.building, np.array(going))
    found = frame._view(frame.observe([sim.world])[0], aims, []).numbers()
    assert np.isfinite(found).all() and found.shape[1] == frame.size
    return frame, found


def anchors(frame, numbers):
    """(B, K, 2) where anchors are, and (B, K) which are allowed."""
    K = frame.anchors
    return numbers[:, : 2 * K].reshape(-1, K, 2), numbers[:, 2 * K : 3 * K] > 0


def people(frame, numbers, n):
    """(B, n, 5) what robots see of people."""
    first = 3 * frame.anchors
    return numbers[:, first : first + n * WIDTH].reshape(-1, n, WIDTH)


def evacuation(name, every=10.0):
    """A simulation as it is at a few decisions of an evacuation."""
    sim = Simulation(shipped(name), Scenario(), Sweep(), RandomFire(), seed=3)
    while not sim.done:
        wait(sim, every)
        yield sim


@pytest.mark.paper("C4", "chosen")
def test_people_whom_nobody_leads_come_first_the_nearest_on_foot_first():
    """Then mine, then my mates'; p follows the first robot, s the second."""
    first, second = people(*seen(stage(HALL)), 4)
    assert first[:, 4].tolist() == second[:, 4].tolist() == [1, 1, 0, 0]
    x = {"p": 0.0, "q": -0.8, "r": 0.6, "s": 1.3}
    assert np.allclose(first[:, 0], [x["r"], x["q"], x["p"], x["s"]], atol=1e-6)
    assert np.allclose(second[:, 0] + 1.2, [x["r"], x["q"], x["s"], x["p"]], atol=1e-6)
    assert first[0, 3] == pytest.approx(nearness(6.0)) == pytest.approx(1 / (1 + 6 / 5))


@pytest.mark.paper("C4", "chosen")
def test_what_moves_together_looks_the_same_to_a_robot():
    """Only what stands still, the way out, has come nearer: the hall may be longer."""
    sim = stage(HALL, sources=2)
    frame = frame_of(sim)
    layout = vector_layout(sim.building, sim.scenario)
    (vectors,) = frame.observe([sim.world])
    layout.block_of(vectors, "fires")[:] = (3.0, 1.0, 0.0)
    moved = vectors.copy()
    for part in ("humans", "robots", "fires"):
        layout.block_of(moved, part)[..., 0] += 2
    nowhere = np.full((2, 2), np.nan)
    one = frame._view(vectors, nowhere, []).numbers()
    other = frame._view(moved, nowhere, []).numbers()
    first = 3 * frame.anchors
    same = slice(first, first + (4 + 1 + 2) * WIDTH)  # people, a mate, fires
    assert np.allclose(one[:, same], other[:, same], atol=1e-6)
    off = anchors(frame, other)[0] - anchors(frame, one)[0]
    still = FIRST_MARK, FIRST_MARK + 1  # the exit, and where to guard it
    assert np.allclose(off[:, still], (-2 / UNIT, 0), atol=1e-6)
    assert np.allclose(np.delete(off, still, axis=1), 0, atol=1e-6)


@pytest.mark.paper("C5", "chosen")
def test_a_destination_is_the_robot_s_place_and_ten_metres_for_each_unit():
    """Clipped to the main body; `raw` reads it back."""
    sim = stage(HALL)
    frame, _ = seen(sim)
    vectors = frame.observe([sim.world])[0, :1]
    robot = sim.world.robots[0]
    said = frame.metres(np.array([[0.2, -0.1]]), vectors)
    x, y = robot.position
    assert said[0] == pytest.approx((x + 2, y - 1), abs=1e-3)
    assert np.allclose(frame.raw(said, vectors), (0.2, -0.1), atol=1e-5)
    far = frame.metres(np.array([[9.0, 9.0]]), vectors)
    assert far.tolist() == [list(sim.building.body[2:])]
    assert np.isnan(frame.raw(np.full((1, 2), np.nan), vectors)).all()


@pytest.mark.paper("C5", "chosen")
@pytest.mark.parametrize("name", BUILDINGS)
def test_to_keep_is_to_decide_once_more_what_was_decided(name):
    """Under way; others have no such anchor, and everybody may stay."""
    kept = 0
    for sim in evacuation(name):
        frame, found = seen(sim)
        (vectors,) = frame.observe([sim.world])
        places, allowed = anchors(frame, found)
        said = frame.metres(places[:, KEEP], vectors)
        for k, robot in enumerate(sim.world.robots):
            if not robot.active:
                continue
            assert allowed[k, KEEP] == bool(robot.way)
            if robot.way:
                target = actual_target(sim.building, robot.floor, *decision_in(said[k]))
                assert target == pytest.approx(tuple(robot.destination), abs=2e-3)
                kept += 1
    assert kept > 3


@pytest.mark.paper("C6")
@pytest.mark.parametrize("name", BUILDINGS)
def test_an_anchor_at_a_way_out_tells_people_to_take_it(name):
    """Nearest first; and one at the foot of stairs tells them to follow."""
    building = shipped(name)
    for floor in range(building.floors):
        outs, feet = way_marks(building, floor)
        assert outs or feet
        for points, leads_out in ((outs, True), (feet, False)):
            for point in points:
                target = actual_target(building, floor, *point)
                said = said_on_the_way(building, floor, target)
                assert (said != NOWHERE) == leads_out


@pytest.mark.paper("D6")
@pytest.mark.parametrize("name", BUILDINGS)
def test_a_rim_is_the_nearest_cell_to_a_way_that_flames_may_enter(name):
    """Or the nearest at which a robot can stand, by Eq. 1: there no source is lit."""
    building = shipped(name)
    nav = navigation_of(building)
    for floor in range(building.floors):
        marks = [m for m in building.landmarks if m.floor == floor]
        ways = [m.index for m in marks if m.kind is not Kind.DOOR]
        found = guard_points(building, floor)
        assert len(found) == len(ways)
        for point, way in zip(found, ways, strict=True):
            assert actual_target(building, floor, *point) == tuple(point)
            (place,) = nav.places_at(np.array([floor]), point[None])
            assert burnable(building).ravel()[place]
            (first,) = places_beside(building, [way])
            at = tuple(nav.centres[first].tolist())
            assert place == first or actual_target(building, floor, *at) != at


@pytest.mark.paper("C4", "chosen")
def test_a_robot_reads_when_the_next_fire_comes():
    """At 10 s and every 25 s after; a whole interval is left when one has just come."""
    sim = stage(HALL)
    for time, left in ((0.0, 10), (5.0, 5), (10.0, 25), (30.0, 5), (35.0, 25)):
        sim.world.time = time
        _, found = seen(sim)
        assert found[:, -5] == pytest.approx(left / 25)


@pytest.mark.paper("C5", "chosen")
def test_where_to_guard_is_told_in_the_same_order_wherever_one_stands():
    """Ways out are told by their distance."""
    sim = stage("E.............R.E\n#.......p.......#\nE.R.............E")
    frame, found = seen(sim)
    at = [robot.position for robot in sim.world.robots]
    spots = anchors(frame, found)[0] * UNIT + np.array(at)[:, None]
    ways, marks = np.split(spots[:, FIRST_MARK : FIRST_MARK + 8], 2, axis=1)
    assert np.allclose(marks[0], marks[1], atol=1e-4)
    assert not np.allclose(ways[0], ways[1], atol=1e-4)


@pytest.mark.paper("C5", "chosen")
def test_masks_never_forbid_to_guard():
    """To a rim or on the way to one, though nobody is lost there and nobody led."""
    sim = stage(HALL.replace("q", ".").replace("p", ".").replace("r", "."))
    (rim,) = guard_points(sim.building, 0)
    for going, keeps in ((rim, True), (rim - (5, 0), False)):
        _, allowed = anchors(*seen(sim, masks=True, going=going))
        kept, way_out, guarded = allowed[0, [KEEP, FIRST_MARK, FIRST_MARK + 1]]
        assert (kept, way_out, guarded) == (keeps, False, True)


@pytest.mark.paper("C5", "chosen")
def test_without_masks_a_robot_may_mean_whatever_is_there():
    """The way out, its rim, q and r, whom nobody leads; no old destination."""
    _, allowed = anchors(*seen(stage(HALL)))
    assert allowed.tolist() == [[False, *[True] * 5, False, False]] * 2


@pytest.mark.paper("C5", "chosen")
def test_masks_forbid_what_helps_nobody():
    """A way out to who leads nobody, and to go on to where nobody is lost any more."""
    sim = stage(HALL.replace("s", "."))  # the second robot leads nobody
    r = (1.5, 0.0)
    exit_ = (14.0, 0.0)
    for going, keeps in ((r, [True, True]), (exit_, [True, False])):
        _, allowed = anchors(*seen(sim, masks=True, going=going))
        assert allowed[:, KEEP].tolist() == keeps
        assert allowed[:, FIRST_MARK].tolist() == [True, False]
    _, allowed = anchors(*seen(sim, masks=True, going=(-1.5, 2.5)))
    assert ASTRAY > 5 and allowed[:, KEEP].all()  # r is less than 5 m from there


@pytest.mark.paper("C1", "chosen")
def test_the_nearest_robot_in_sight_on_foot_is_the_guide():
    """Against ways one by one; whose work is done leads nobody, nor on the stairs."""
    nav = navigation_of(shipped("paper"))
    rng = np.random.default_rng(0)
    free = np.flatnonzero(nav.walkable)
    robots = rng.choice(free, (3, 6))
    folk = rng.choice(free, (3, 40))
    at_work = rng.random((3, 6)) < 0.7
    walking = rng.random((3, 40)) < 0.9
    robots[:, 1] = folk[:, 0]
    found = guess_guides(nav, robots, at_work, folk, walking)
    for world in range(3):
        for k, place in enumerate(folk[world].tolist()):
            way = [nav.distances([p])[place] for p in robots[world].tolist()]
            way = np.where(at_work[world], way, np.inf)
            led = walking[world, k] and way.min() <= SIGHT_RANGE
            assert found[world, k] == (way.argmin() if led else NOBODY)
    assert (found != NOBODY).any()
    nobody = np.zeros((3, 0), dtype=int)
    assert (guess_guides(nav, nobody, nobody > 0, folk, walking) == NOBODY).all()


@pytest.mark.paper("C1", "chosen")
@pytest.mark.parametrize(
    ("plan", "to", "guide"),
    [
        ("#..R.p...R..E", (10, 10), 1),  # the nearer one comes, the other goes away
        ("#..R...p.R..E", (1, 1), 0),
        ("#..R.p..R...E", (1, 10), 0),  # both go away: the nearer one
        ("#..R..pR....E", (3, 1), 0),  # the nearer one comes, the other stands
        ("#..R..pR....E", (10, 1), 1),  # both come
        ("#..R..pR....E", (3, 7), 1),  # both stand
    ],
)
def test_who_follows_a_robot_under_way_walks_behind_it(plan, to, guide):
    """Columns where two robots go; a robot that comes towards somebody leads others."""
    sim = stage(f"{'#' * len(plan)}\n{plan}\n{'#' * len(plan)}")
    world = sim.world
    nav = navigation_of(sim.building)
    first = int(world.robots[0].place) - plan.index("R")
    robots = np.array([robot.place for robot in world.robots])
    headed = first + np.array(to)
    asked = (robots, np.array([True, True]), world.bodies.place, world.bodies.walking)
    assert guess_guides(nav, *asked, headed).tolist() == [guide]
