"""The order of one tick: SENSE, DECIDE, MOVE, BURN, SETTLE.

A test with "before" in its name fails if the two things it names change places; the
others hold what is done at once, when, or in which of the phases.
"""

from itertools import pairwise

import numpy as np
import pytest
from movies import (
    beside,
    body,
    events_of,
    mark,
    mind,
    play,
    play_until,
    remembers,
    shipped,
    show,
    stage,
    thinks,
    ticks,
    view,
)

from reference import paper
from reference.building import Kind
from reference.fire import NoFire, RandomFire
from reference.paper import Scenario
from reference.robots import NoRobots
from reference.simulation import Simulation
from reference.walking import enter_stairs
from reference.workshop.strategies.worst_case import FirstDecision
from reference.world import (
    NOBODY,
    NOWHERE,
    Aim,
    Died,
    Evacuated,
    Fate,
    FireLit,
    Goal,
    Mode,
    Passed,
)

LOSS = paper.HEALTH_RATE * paper.FRAMES_PER_TICK
"""Health that everybody loses in a tick."""


class Probe:
    """A robot or a fire that notes what it is shown, and decides always the same."""

    def __init__(self, look, decision):
        self.look = look
        self.decision = decision
        self.saw = []

    def __deepcopy__(self, memo):
        """Itself: a test reads in it what a simulation's copy was shown."""
        return self

    def decide(self, world, *_):
        """Note it."""
        self.saw.append(self.look(world))
        return self.decision


# -- SENSE and DECIDE ---------------------------------------------------------------


@pytest.mark.paper("B4")
def test_everybody_looks_before_anybody_decides():
    """p sets off to the door now; q, who thinks after p, sees that a turn later."""
    sim = stage("#p..q..+...E", leads="pq", sight_range=7)
    sim.world.bodies.rank[body("p")] = 9
    sim.step()
    assert sim.world.bodies.landmark[body("p")] == mark(sim, Kind.DOOR)
    assert mind(sim, "q").leader == NOBODY
    play_until(sim, lambda: mind(sim, "q").leader == body("p"), seconds=1)


@pytest.mark.paper("B4")
def test_all_who_have_decided_set_off():
    """p, q and r, in the same tick: each has another exit in view."""
    wall = "########"
    board = f"{wall}\n#p.....E\n{wall}\n#q..E###\n{wall}\n#r...E##\n{wall}"
    sim = stage(board, leads="pqr", sight_range=8)
    sim.step()
    assert sim.world.bodies.landmark.tolist() == [mark(sim, f"E{k}") for k in (1, 2, 3)]


@pytest.mark.paper("B4")
def test_people_decide_before_strategies():
    """When the robots' first turn comes, p has become a leader already."""
    robots = Probe(lambda world: world.minds[0].mode, [None])
    stage("#p..R.....E", robots=robots).step()
    assert robots.saw == [Mode.LEADER]


@pytest.mark.paper("A3")
def test_people_on_the_stairs_are_not_seen():
    """Though p stands where q would see it."""
    sim = stage("#p.q..E")
    assert list(view(sim, "q").bodies) == [body("p")]
    sim.world.bodies.stairwell[body("p")] = 0
    assert not view(sim, "q").bodies


@pytest.mark.paper("D2")
def test_robots_and_fire_see_the_same_world():
    """Robots do not see the fire that breaks out now; the fire sees them unmoved."""
    board = "#p..R......E"

    def robot_at(world):
        return world.robots[0].position[0]

    def robot_at_and_fires(world):
        return robot_at(world), len(world.flames.sources)

    robots = Probe(robot_at_and_fires, [(4.5, 0.5)])
    fire = Probe(robot_at, (0, 3.5, 0.5))
    hurry = {"decision_seconds": 1, "sight_range": 1.5}
    sim = stage(board, robots=robots, fire=fire, **hurry)
    sim.world.bodies.pace[:] = 0
    play_until(sim, lambda: events_of(sim, FireLit))
    assert robots.saw[-1] == (fire.saw[0], 0)
    assert sim.world.robots[0].position[0] > fire.saw[0]


# -- MOVE ---------------------------------------------------------------------------


@pytest.mark.paper("B6", "Alg. 2:3: walk to it")
def test_people_decide_before_they_move():
    """Within one tick p sees the exit and has begun to walk there."""
    sim = stage("#p.....E", sight_range=8, leads="p")
    start = sim.world.bodies.position[0, 0]
    sim.step()
    walked = sim.world.bodies.position[0, 0] - start
    assert walked == pytest.approx(paper.WALKING_SPEED * sim.tick, rel=0.01)


@pytest.mark.paper(
    "C7",
    "Alg. 3:4: take the decision as the new destination",
    "Alg. 3:7: walk on towards the destination",
)
def test_robots_decide_before_they_move():
    """The first decision is walked in its own tick."""
    sim = stage("#R...1.pE")
    start = sim.world.robots[0].position[0]
    sim.step()
    walked = sim.world.robots[0].position[0] - start
    assert walked == pytest.approx(paper.ROBOT_SPEED * sim.tick)


@pytest.mark.paper("C7", "Alg. 3:2, chosen: help people out")
def test_robots_move_before_people():
    """The robot waits for p, who is a step too far behind when the tick begins."""
    sim = stage("#p..R......E", follows="pR")
    robot = sim.world.robots[0]
    robot.way = [robot.place + 5]
    gap = paper.FOLLOWER_GAP + paper.CROWD_GAP
    start = robot.position.copy()
    sim.world.bodies.position[0] = start - (gap + 0.1, 0)
    sim.world.bodies.place[0] = sim.navigation.place(0, *sim.world.bodies.position[0])
    sim.step()
    assert np.array_equal(robot.position, start)
    assert robot.position[0] - sim.world.bodies.position[0, 0] < gap


# -- BURN ---------------------------------------------------------------------------


@pytest.mark.paper("B7")
def test_people_move_before_flames_hurt_them():
    """p takes its last step out of the heat, and loses what everybody loses."""
    sim = stage("##########\n#*p.....E#\n########E#", leads="p")
    mind(sim, "p").goal = Goal(Aim.DIRECTION, 99, int(sim.world.bodies.place[0]) + 3)
    sim.world.bodies.position[0, 0] += 0.45
    sim.step()
    assert sim.world.bodies.place[0] == sim.navigation.cols + 3
    assert 100 - sim.world.bodies.health[0] == pytest.approx(LOSS)


@pytest.mark.paper("D7")
def test_people_move_before_flames_move_on():
    """p steps into a cell that begins to burn in this tick, not only in the next."""
    fire = FirstDecision((0, -2.5, 0.5), NoFire())
    board = "#.p........E"
    sim = stage(board, fire=fire, decision_seconds=1, sight_range=12)
    bodies = sim.world.bodies
    bodies.pace[:] = 0
    play(sim, 3 - sim.tick)
    bodies.pace[:] = paper.WALKING_SPEED
    bodies.position[0, 0] += 0.45
    assert not sim.world.flames.burning.any()
    sim.step()
    assert show(sim) == "#..p.......E"
    bodies.fate[:] = Fate.EVACUATED  # out of the picture, to see what burns
    assert show(sim) == "#..*.......E"


@pytest.mark.paper("B7")
def test_flames_move_on_before_they_hurt():
    """The tick in which the cell beside p begins to burn costs p more already."""
    fire = FirstDecision((0, -2.5, 0.5), NoFire())
    board = "#.p........E"
    sim = stage(board, fire=fire, decision_seconds=1)
    sim.world.bodies.pace[:] = 0
    health = []

    def burns():
        health.append(sim.world.bodies.health[0])
        return sim.world.flames.burning.any()

    play_until(sim, burns)
    last_two = [LOSS, LOSS + paper.HEAT_LOSS * sim.tick]
    assert -np.diff(health)[-2:] == pytest.approx(last_two)


@pytest.mark.paper("D7")
def test_flames_move_on_once_a_second():
    """At whole seconds and at no other tick, however fast they spread."""
    hurry = Scenario(
        people=1, decision_seconds=1, sources=3, time_limit=14, spread_rate=100
    )
    sim = Simulation(shipped("tiny"), hurry, NoRobots(), RandomFire(), seed=3)
    sim.world.bodies.pace[:] = 0
    states = []
    for _ in ticks(sim):
        states.append((sim.world.time, sim.world.flames.burning.sum()))
    changes = [after for (_, a), (after, b) in pairwise(states) if a != b]
    assert len(changes) > 2
    assert np.mod(changes, paper.FLAME_SECONDS) == pytest.approx(0, abs=1e-9)


# -- SETTLE -------------------------------------------------------------------------


@pytest.mark.paper("B4", "chosen")
def test_people_take_turns_in_thinking():
    """All in the first tick; then one third in each, unless something happens."""
    sim = stage("#pqrst....E", still="pqrst", leads="pqrst")
    turns = []
    for _ in range(6):
        turns.append("".join("pqrst"[i] for i in np.flatnonzero(sim.due)))
        sim.step()
    assert turns == ["pqrst", "qt", "r", "ps", "qt", "r"]


@pytest.mark.paper("B7")
def test_health_falls_before_deaths_are_settled():
    """Who has less than a tick's loss left dies in this tick, not in the next; so do
    two of them."""
    sim = stage("#p.q.r..E", health={"p": LOSS / 2, "r": LOSS / 2})
    assert [type(event) for event in sim.step()] == [Died, Died]
    assert sim.world.bodies.fate.tolist() == [Fate.DEAD, Fate.INSIDE, Fate.DEAD]
    assert sim.world.bodies.health[[0, 2]].tolist() == [0, 0]
    assert show(sim) == "#x.q.x..E"
    assert not sim.step()  # nobody dies twice


@pytest.mark.paper("B7", "A4")
@pytest.mark.parametrize(("ticks_left", "end"), [(0.5, Died), (1.5, Evacuated)])
def test_who_dies_on_the_threshold_of_the_exit_is_not_saved(ticks_left, end):
    """Death and exit in one tick are a death."""
    sim = stage("#....p.E", sight_range=8, leads="p")
    bodies = sim.world.bodies
    bodies.position[0, 0] += 1.4
    bodies.place[0] += 1
    bodies.health[0] = ticks_left * LOSS
    assert type(sim.step()[-1]) is end
    assert not bodies.inside[0]


@pytest.mark.paper("A5")
def test_a_door_fires_once_for_who_walks_through_it():
    """Not in every tick that p spends in it, which would turn p around there."""
    sim = stage("#..+.p.........E", leads="p")
    assert play(sim, 2.6) == "#.p+...........E"
    assert thinks(sim) == "#.p!...........E"


@pytest.mark.paper("A5")
def test_a_wide_door_fires_once_for_who_walks_from_one_of_its_cells_to_the_next():
    """p crosses it askew, after q: it is one door, passed once, and the way back."""
    board, enters, leaves, after = beside("""
        ######    ######    ######    ######
        #p...#    #....#    #....#    #....#
        #++++#    #+p++#    #++p+#    #1111#
        #...q#    #...q#    #...q#    #...q#
        ##E###    ##E###    ##E###    ##E###
        """)
    sim = stage(board, follows="pq", still="q")
    play_until(sim, lambda: show(sim) == enters)
    play_until(sim, lambda: show(sim) == leaves)
    assert remembers(sim) == after


@pytest.mark.paper("A5")
def test_a_door_is_entered_from_the_room_of_who_enters_it():
    """q does; p walks in another room meanwhile."""
    sim = stage("#p.......+...q+....E", leads="pq")
    area = int(sim.building.area.flat[sim.world.bodies.place[body("q")]])
    play_until(sim, lambda: mind(sim, "q").doors)
    assert mind(sim, "q").trail == [Passed(mark(sim, "+2"), area)]


@pytest.mark.paper("A5")
@pytest.mark.parametrize("burnt", [False, True])
def test_a_burnt_door_is_passed_without_being_remembered(burnt):
    """It is no landmark any more [A6]; the hole that it leaves is walked through."""
    sim = stage("#.p+....E", leads="p")
    door = mark(sim, Kind.DOOR)
    me = mind(sim, "p")
    beyond = sim.navigation.cols + 4
    me.goal = Goal(Aim.THRESHOLD, door, beyond)
    sim.world.burnt = {door} if burnt else set()
    play_until(sim, lambda: sim.world.bodies.place[0] == beyond, seconds=5)
    assert list(me.doors) == [passed.door for passed in me.trail]
    assert me.doors == (set() if burnt else {door})


@pytest.mark.paper("B4", "chosen")
@pytest.mark.parametrize("ticks_left", [1, 2, 3])
def test_who_comes_out_of_a_stairwell_thinks_at_once(ticks_left):
    """In the very next tick, whatever one's turn."""
    sim = stage("#AA+....E\n\n#AA+p...#")
    bodies = sim.world.bodies
    enter_stairs(sim.world, 0, sim.building.stairwells[0].entrances[1][0])
    bodies.stairs_until[0] = ticks_left * sim.tick
    play(sim, ticks_left * sim.tick)
    assert bodies.walking[0]
    assert sim.due[0]


@pytest.mark.paper("B4", "chosen")
@pytest.mark.parametrize("start", [0.0, 0.27, 0.54])
def test_after_a_door_one_thinks_at_once(start):
    """In the very next tick, whatever one's turn: the body has the new goal."""
    sim = stage("#.p.+...E", leads="p")
    bodies = sim.world.bodies
    me = mind(sim, "p")
    bodies.position[0, 0] -= start
    bodies.place[0] = sim.navigation.place(0, *bodies.position[0])
    play_until(sim, lambda: me.doors)
    assert bodies.landmark[0] == mark(sim, Kind.DOOR)
    sim.step()
    assert bodies.landmark[0] == NOWHERE
    assert np.array_equal(bodies.target[0], sim.navigation.centres[me.goal.place])
