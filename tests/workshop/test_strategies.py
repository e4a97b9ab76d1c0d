"""Strategies written by hand: guides, and fires that have a plan."""

from collections import deque

import numpy as np
import pytest
from changing import BOARD
from movies import body, mark, play, shipped, stage, wait

from reference import paper
from reference.building import Kind, building_of
from reference.fire import NoFire, RandomFire, burnable, cells_around_clearance
from reference.paper import Scenario
from reference.simulation import Simulation
from reference.walking import enter_stairs
from reference.workshop.comparing.named import (
    PLAYERS,
    WORST,
    set_up_match,
    strategy_named,
)
from reference.workshop.strategies.fires import (
    BusiestFire,
    CloserFire,
    FixedFire,
    GreedyFire,
)
from reference.workshop.strategies.guard import Guard
from reference.workshop.strategies.guides import (
    Escort,
    Group,
    Observer,
    Patrol,
    Sweep,
    Way,
    as_observed,
    choose,
    groups,
    guided_by,
    nearest_way,
    unguided,
)
from reference.workshop.strategies.observed import (
    at_way_out,
    before_stairwell,
    keeps_destination,
    known_map_of,
)
from reference.world import NOBODY, FireLit, FireRefused


def decided(robots, sim):
    """Column of the cell that the last robot of a scene is sent to."""
    x, _ = robots.decide(sim.world, sim.world.robots, sim.rng["robots"])[-1]
    return sim.building.cell(x, 0.5)[1]


# -- Memory -------------------------------------------------------------------------

EVERYBODY = [
    *(("robots", name) for name in PLAYERS["robots"]),
    *(("fire", name) for name in PLAYERS["fire"] if name != WORST),
    pytest.param("fire", WORST, marks=pytest.mark.slow),
]


def state(sim):
    """Where a run stands: people, robots and fires."""
    world = sim.world
    robots = [(robot.position.tolist(), robot.destination) for robot in world.robots]
    return world.bodies.position.tolist(), repr(robots), world.flames.sources


@pytest.mark.parametrize(("side", "name"), EVERYBODY)
def test_one_strategy_in_several_simulations_is_as_good_as_a_fresh_one(side, name):
    """One after the other, in another building, and side by side."""
    sides = {"robots": Sweep(), "fire": RandomFire()}
    used = strategy_named(name, side)

    def begun(strategy, building="tiny", seed=2):
        """A run with it."""
        scene = Scenario(people=3, time_limit=11.0 if name == WORST else 16.0)
        run = set_up_match(
            shipped(building), scene, **(sides | {side: strategy}), seed=seed
        )
        for _ in range(round(scene.time_limit / run.tick)):
            yield run
            run.step()

    for building in ("museum", "tiny"):
        deque(begun(used, building, seed=1), maxlen=0)
    both = [begun(used), begun(used)]
    *_, (one, other) = zip(*both, strict=True)
    *_, fresh = begun(strategy_named(name, side))
    assert state(one) == state(other) == state(fresh)


# -- Guides -------------------------------------------------------------------------


def known(title):
    """What guides know of a building, which is the same under every title."""
    building = building_of(BOARD.replace("Two floors", title))
    robots = known_map_of(building)
    return [
        robots.outs.tolist(),
        robots.feet.tolist(),
        robots.rims.tolist(),
        keeps_destination(building).tolist(),
        before_stairwell(building, 1, 0),
        [at_way_out(building, way) for way in building.landmarks],
    ]


@pytest.mark.parametrize(
    ("number", "value"), [("NEAR_STAIRWELL", 2.0), ("PROTECTED_METRES", 2.0)]
)
def test_guides_know_a_building_by_the_numbers_as_they_are(number, value, monkeypatch):
    """What is kept of a building is not used under other numbers."""
    before = repr(known("seen before"))
    monkeypatch.setattr(paper, number, value)
    assert repr(known("seen before")) == repr(known(f"new, {number}")) != before


def test_patrolling_robots_go_from_room_to_way_out_to_room():
    """The next stop as soon as the last one is reached, not before."""
    sim = Simulation(shipped("tiny"), Scenario(people=0), Patrol(), NoFire())
    patrol = Patrol()
    rng = np.random.default_rng(0)
    stairs = sim.building.stairwells
    robot = sim.world.robots[-1]
    stops = [patrol.decide(sim.world, [robot], rng)[0] for _ in range(6)]
    assert all(stop in [well.centre for well in stairs] for stop in stops[1::2])
    rooms = {sim.building.area[1, *sim.building.cell(*stop)] for stop in stops[::2]}
    assert rooms <= {room.index for room in sim.building.rooms(1)}
    robot.way = [robot.place]
    assert patrol.decide(sim.world, [robot], rng) == [None]


def test_patrolling_robots_visit_bent_rooms_and_each_begins_elsewhere():
    """The room in the north is bent around the one in the south."""
    sim = stage(
        """
        #############
        #R..........E
        #R.#######+##
        #..#R.......#
        #############
        """
    )
    firsts = Patrol().decide(sim.world, sim.world.robots, sim.rng["robots"])
    areas = [sim.building.area[0, *sim.building.cell(*stop)] for stop in firsts]
    assert len({*areas}) == 2 and min(areas) >= 0


@pytest.mark.parametrize("robots", [Sweep(), Escort()])
@pytest.mark.parametrize(("full", "first"), [(1, "way out"), (10, "q")])
def test_robots_lead_no_more_than_can_pass_doors(full, first, robots, monkeypatch):
    """With as many as that they go to the way out, else first to who is nearby."""
    monkeypatch.setattr("reference.workshop.strategies.guides.FULL", full)
    sim = stage("#....q..pR.......E", follows="pR")
    x, _ = robots.decide(sim.world, sim.world.robots, sim.rng["robots"])[0]
    assert (x > 7) == (first == "way out")


def test_sweeping_robots_share_the_groups():
    """The first takes the largest that nobody guides yet, the second what is left."""
    sim = stage(
        """
        ###################
        #.......R........q#
        #p......R........r#
        #................s#
        ########E##########
        """
    )
    one, other = Sweep().decide(sim.world, sim.world.robots, sim.rng["robots"])
    assert one[0] > 5 and other[0] < -5


@pytest.mark.paper("C7", "chosen")
def test_sweeping_robots_see_the_flames_on_the_way_of_those_they_may_fetch():
    """Three are worth the way back, unless their short way to the exit burns."""
    for flames, column in ((".", 2), ("*", 0)):
        board = """
        ###############
        E...pR........#
        #.###########.#
        #fqrs.........#
        ###############
        """
        sim = stage(board.replace("f", flames), follows="pR")
        assert decided(Sweep(), sim) == column


@pytest.mark.paper("C7")
@pytest.mark.parametrize("robots", [Sweep(), Escort()])
def test_idle_robots_wait_before_stairs_that_end_on_their_floor(robots):
    """People still come down B in the east, which ends here; A goes on down."""
    sim = stage("#AA+...R...E\n\n#AA+...R...+BB#\n\n#AA+...R...+BB#")
    here = [robot for robot in sim.world.robots if robot.floor == 1]
    there = robots.decide(sim.world, here, sim.rng["robots"])
    assert there == [before_stairwell(sim.building, 1, 1)]


@pytest.mark.paper("C6", "Eq. 1")
def test_before_a_stairwell_is_the_nearest_cell_that_eq_1_leaves_alone():
    """At an exit is one; where there is none, it is the cell beside the entrance."""
    for room, columns in (("...........", [8, 8]), ("...", [5, 4])):
        wall = "#" * len(room)
        plan = f"   #{wall}#\n####{wall}##\n#AA+{room}*\n####{wall}##\n   #{wall}#"
        sim = stage(f"{plan}\n\n{plan}".replace("*", "E", 1).replace("*", "#"))
        for floor, column in enumerate(columns):
            x, y = before_stairwell(sim.building, floor, 0)
            assert sim.building.cell(x, y) == (2, column)


TWO_STAIRS = """
       ############
    ####...*.......####
    #AA+...*.......+BB#
    ####...*....R..####
       ######E#####

       ############
    ####...........####
    #AA+....pR.....+BB#
    ####...........####
       ############
    """


@pytest.mark.paper("C7")
def test_an_escort_counts_the_way_from_the_foot_of_the_stairs():
    """Down the farther stairs in the east, when the ground floor burns in the west."""
    for flames, column in (("*", 17), (".", 2)):
        sim = stage(TWO_STAIRS.replace("*", flames), follows="pR2")
        assert decided(Escort(), sim) == column


@pytest.mark.paper("C7")
def test_an_escort_fetches_only_who_is_near_its_way():
    """With p it turns back for r who is 3 m away, not for r who is 11 m away."""
    for metres, column in ((3, 15), (11, 0)):
        row = f"E..........pR{'.' * (metres - 1)}r".ljust(25, ".") + "#"
        sim = stage(row, follows="pR")
        assert decided(Escort(), sim) == column


@pytest.mark.paper("C7")
def test_an_escort_waits_at_the_foot_for_people_on_the_stairs():
    """Nobody is on its floor yet; p will be in some seconds."""
    sim = stage(TWO_STAIRS.replace("*", "."))
    enter_stairs(sim.world, 0, sim.building.stairwells[0].entrances[1][0])
    to = Escort().decide(sim.world, sim.world.robots, sim.rng["robots"])[0]
    assert to == before_stairwell(sim.building, 0, 0)


@pytest.mark.paper("C3")
def test_an_observer_takes_whoever_is_in_sight_of_a_robot_for_its_follower():
    """The nearer robot's, behind no wall; flames do not hide t, and q is too far."""
    sim = stage(
        """
        #####################
        #p.R..r..R*t#s......#
        #.................q.E
        #####################
        """,
        follows="qR",
    )
    first, second = (robot.body for robot in sim.world.robots)
    leader = as_observed(sim.world).bodies.leader.tolist()
    seen = dict(zip("pqrst", leader, strict=True))
    assert seen == dict(p=first, q=NOBODY, r=first, s=NOBODY, t=second)
    assert sim.world.bodies.leader.max() == first  # the world itself is as it was


@pytest.mark.paper("C1", "chosen")
@pytest.mark.parametrize(
    ("plan", "go"),
    [
        ("#..pR.R....E", [True, True]),  # either may lead p
        ("#..pR.........R.E", [True, False]),  # the second does not see p
        ("#...R.R....E", [False, False]),
    ],
)
def test_an_observer_in_doubt_leads_out(plan, go):
    """By the guess the nearer robot leads p, though p may follow the other."""
    sim = stage(f"{'#' * len(plan)}\n{plan}\n{'#' * len(plan)}")
    robots = sim.world.robots
    (exit_,) = sim.building.landmarks
    to = Observer().decide(sim.world, robots, np.random.default_rng(0))
    assert [spot == at_way_out(sim.building, exit_) for spot in to] == go


@pytest.mark.paper("C3")
def test_an_observer_decides_the_same_whatever_people_have_in_mind():
    """Whom they follow, where they are headed, and how far down the stairs they are."""
    sim = Simulation(shipped("paper"), Scenario(), Escort(), RandomFire(), seed=3)
    wait(sim, 40)
    world = sim.world
    rng = np.random.default_rng(0)
    before = Observer().decide(world, world.robots, rng)
    bodies = world.bodies
    n = len(world.bodies)
    assert before != Escort().decide(world, world.robots, rng)
    assert np.isfinite(bodies.stairs_until).any()
    bodies.leader[:] = rng.integers(-1, n + len(world.robots), n)
    bodies.landmark[:] = rng.integers(-1, len(sim.building.landmarks), n)
    bodies.stairs_until += 3
    assert Observer().decide(world, world.robots, rng) == before


@pytest.mark.parametrize(
    ("led", "detour", "fetches"),
    [
        (1, np.inf, True),  # two in 25 m are more than one in 15 m
        (1, 10.0, True),
        (1, 9.0, False),  # the detour is 10 m for one
        (2, np.inf, False),  # three in 25 m are less than two in 15 m
        (0, 0.0, True),  # nobody makes a detour
    ],
)
def test_a_guide_chooses_what_saves_most_people_per_metre(led, detour, fetches):
    """10 m from the way out; by who is 5 m away it is 5 and 15 m. 5 m to come back."""
    way = Way(landmark=0, here=10.0, metres=np.array([10.0, 15.0]))
    alone = Group(np.array([True, False]), place=1, point=(5.5, 0.5), metres=5.0)
    assert (choose([alone], way, led, detour) is alone) == fetches


class Usher:
    """A guide of one's own: it fetches people, and never makes followers wait."""

    def decide(self, world, robots, rng):
        """Put three functions together."""
        return [self.goal(world, robot) for robot in robots]

    def goal(self, world, robot):
        """A group for who leads nobody, else the way out."""
        led = (guided_by(world) == robot.body).sum()
        way = nearest_way(world, robot)
        group = choose(groups(world, robot, unguided(world)), way, led, detour=0.0)
        return group.point if group else world.building.landmarks[way.landmark].position


def test_who_follows_a_long_chain_follows_its_head():
    """Each follows the one before; the first follows the robot."""
    sim = stage("E.Rpqrstuvw.#", follows="pR qp rq sr ts ut vu wv")
    assert set(guided_by(sim.world).tolist()) == {sim.world.robots[0].body}
    sim.world.bodies.leader[0] = NOBODY
    assert guided_by(sim.world).tolist() == [NOBODY, 0, 0, 0, 0, 0, 0, 0]


def test_a_guide_of_ones_own_is_put_together_from_three_functions():
    """Where `sweep` goes on to fetch q, r and s, this one leads p out."""
    for follows, column in (("", 10), ("pR", 0)):
        sim = stage("E...pR....qrs.....#", follows=follows)
        sim.world.bodies.landmark[0] = 0  # p is on its way out
        assert decided(Usher(), sim) == column
        assert decided(Sweep(), sim) == 10


# -- Fires --------------------------------------------------------------------------


@pytest.mark.paper("D6", "stated")
def test_a_guard_stands_where_the_next_fire_is_due():
    """It comes at 10 s, and in training not at all while the robot stands there."""
    sim = stage("#p#.R.........E", "guard", "fixed", training=True)
    assert play(sim, 10) == "#p#......R....E"
    assert not sim.events
    wait(sim, 1)
    assert [type(event) for event in sim.events] == [FireRefused]


@pytest.mark.parametrize(
    ("board", "goes"),
    [("#R.................E", True), ("#R..................E", False)],
)
def test_a_guard_goes_only_if_it_is_in_time(board, goes):
    """Before the first fire, at 10 s, it walks 13.5 m at most; else it leads on."""
    sim = stage(board, people=0)
    (robot,) = sim.world.robots
    (decided,) = Guard().decide(sim.world, [robot], np.random.default_rng(0))
    assert (decided == sim.building.metres(1, len(board) - 6)) == goes


@pytest.mark.parametrize(
    ("stands", "lit", "goes"),
    [
        (6, 16, True),  # in the cell, and it was lit far away: moved [D6]
        (6, 7, False),  # in the cell, and it was lit beside: this fire looks
        (4, 6, True),  # elsewhere, and it was lit there
        (4, 16, False),  # elsewhere, and it was lit elsewhere: another fire
    ],
)
def test_a_guard_stands_there_till_another_fire_shows_itself(stands, lit, goes):
    """It awaited the first in column 6; the second is due in column 9, in 5 s."""
    board = "#" + "." * 17 + "E"
    sim = stage(board[:stands] + "R" + board[stands + 1 :], people=0)
    places = [(0, *sim.building.metres(1, column)) for column in (6, 9, lit)]
    guard = Guard(places[:2])
    rng = sim.rng["robots"]
    guard.decide(sim.world, sim.world.robots, rng)
    sim.world.flames.sources.append(FireLit(10.0, *places[2]))
    sim.world.time = 30.0
    assert (guard.decide(sim.world, sim.world.robots, rng) == [places[1][1:]]) == goes


def test_a_greedy_fire_strikes_on_the_way_of_people():
    """Three people are on their way to the door in the south."""
    sim = stage(
        """
        ###############
        #......#.....sE
        #......#......#
        #......#......#
        #......#......#
        #pqr...+......#
        ###############
        """
    )
    play(sim, 1)
    decision = GreedyFire().decide(sim.world, np.random.default_rng(0))
    assert sim.building.cell(*decision[1:]) in {(5, 4), (5, 5), (5, 6)}


@pytest.mark.paper("D2", "chosen")
def test_a_busiest_fire_counts_who_comes_from_above():
    """One is upstairs and one on the stairs, both of whom p on the ground joins."""
    sim = stage("#AA+.....p......E\n\n#AA+..........qr#")
    enter_stairs(sim.world, body("r"), mark(sim, Kind.ENTRANCE, 2))
    decision = BusiestFire().decide(sim.world, np.random.default_rng(0))
    assert (decision[0], *sim.building.cell(*decision[1:])) == (0, 1, 11)


@pytest.mark.paper("D2", "chosen")
def test_a_fixed_fire_lights_the_same_places_whoever_is_there():
    """Beside the exits, then the entrances, lowest floors first; then no more."""
    sim = Simulation(shipped("paper"), Scenario(people=0, sources=9), seed=1)
    fire = FixedFire()
    rng = np.random.default_rng(0)
    marks = [m for m in sim.building.landmarks if m.kind is not Kind.DOOR]
    marks.sort(key=lambda m: (m.kind is not Kind.EXIT, m.floor))
    for way in marks:
        floor, x, y = fire.decide(sim.world, rng)
        nearest = sim.navigation.distance_to(way.index)
        p = sim.navigation.place(floor, x, y)
        assert nearest[p] == nearest[burnable(sim.building).ravel()].min()
        sim.world.flames.sources.append(FireLit(0.0, floor, x, y))
    assert fire.decide(sim.world, rng) is None
    sim.world.flames.sources[:] = []
    sim.world.flames.ash[0] = True
    assert fire.decide(sim.world, rng)[0] == 1  # all of the first floor is ash


@pytest.mark.paper("D2", "chosen")
def test_a_closer_fire_closes_exits_first_then_entrances():
    """The nearest cell that can burn; then it begins anew."""
    sim = stage("#AA+..................E\n\n#AA+..................#")
    way_out = mark(sim, Kind.EXIT)
    upstairs = mark(sim, Kind.ENTRANCE, 2)
    for way in (way_out, upstairs, way_out):
        decision = CloserFire().decide(sim.world, np.random.default_rng(0))
        assert sim.navigation.place(*decision) in cells_around_clearance(
            sim.building, way
        )
        sim.world.flames.sources.append(FireLit(0.0, *decision))
