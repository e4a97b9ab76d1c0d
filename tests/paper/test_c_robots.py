"""Robots: Algorithm 3 line by line, Eq. 1, instructions, and the strategies."""

from math import dist

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from movies import (
    Script,
    beside,
    built,
    goes,
    later,
    mark,
    play,
    sets_off,
    shipped,
    stage,
    thinks,
    view,
)

from reference.building import Kind
from reference.fire import NoFire, RandomFire
from reference.paper import DECISION_SECONDS, NEAR_STAIRWELL, ROBOT_SPEED, Scenario
from reference.robots import (
    NoRobots,
    actual_target,
    said_on_the_way,
    speed_while_leading,
)
from reference.simulation import Simulation
from reference.workshop.strategies import ROBOTS
from reference.workshop.strategies.guides import RandomRobots, Sweep
from reference.world import NOWHERE, Evacuated, LeftFloor

UPSTAIRS = "#AA+...R.1.E\n\n#AA+...R.2p#"


def begun(board, **said):
    """The board after the first tick: where robots stand, and their destinations."""
    sim = stage(board, **said)
    sim.step()
    return goes(sim)


# -- Algorithm 3 --------------------------------------------------------------------


@pytest.mark.paper(
    "C7", "Alg. 3:1: repeat while somebody on this level is still inside"
)
@pytest.mark.paper("C8")
def test_robots_work_while_people_are_on_their_level_or_above():
    """From above they still come through: the robot below goes on, too."""
    assert begun(UPSTAIRS, still="p") == UPSTAIRS
    after = "#AA+.....R.E\n\n#AA+.....Rp#"
    assert later(UPSTAIRS, 3, still="p", sight_range=1.5) == after


@pytest.mark.paper(
    "C7", "Alg. 3:1: repeat while somebody on this level is still inside"
)
@pytest.mark.paper("C8")
def test_a_robot_is_done_when_its_level_and_all_above_are_empty():
    """Nobody asks it, and it does not move; the one below goes on."""
    board, after = beside("""
        #AA+...R.1p..E    #AA+.....Rp..E

        #AA+...R..2..#    #AA+...R.....#
        """)
    assert begun(board, still="p") == board.replace("2", ".")
    assert later(board, 2, still="p") == after


@pytest.mark.paper(
    "C7", "Alg. 3:1: repeat while somebody on this level is still inside"
)
@pytest.mark.paper("C8")
def test_a_robot_under_way_stands_still_once_its_work_is_done():
    """q leaves when the robot upstairs has walked a metre; it goes no farther."""
    board = "#p.R.......E\n\n#R.....2..qE"
    assert later(board, 1.2, still="p") == "#p.R.......E\n\n#.R........E"
    assert later(board, 5, still="p") == "#p.R.......E\n\n#.R........E"


@pytest.mark.paper("C7", "Alg. 3", "Alg. 3:2: help people out")
def test_a_robot_leads_those_who_follow_it_out():
    """It waits for p, who is slow, and says: this exit."""
    sim = stage("#p.R...........1E")
    sim.world.bodies.pace[:] = 0.8
    assert play(sim, 6) == "#....p.R........E"
    assert play(sim, 20) == "#..............RE"
    assert [type(event) for event in sim.events] == [LeftFloor, Evacuated]


@pytest.mark.paper("C7", "Alg. 3:2, chosen: help people out")
def test_a_crowd_may_be_farther_behind_than_one_follower():
    """Four are waited for from 2.0 m on, one from 1.6 m; here it is 1.9 and 2.6 m."""
    near, far = beside("""
        ##############    ##############
        #.q..........#    #q...........#
        #.rpR.......1E    #r.pR.......1E
        #.s..........#    #s...........#
        ##############    ##############
        """)
    for board, waits in ((near, False), (far, True)):
        sim = stage(board, still="pqrs", follows="pR qR rR sR")
        robot = sim.world.robots[0]
        robot.way = [robot.place + 1]
        assert (speed_while_leading(robot, sim.world) == 0) is waits


@pytest.mark.paper("C7", "Alg. 3:2, chosen: help people out")
def test_a_robot_waits_for_its_own_followers_alone():
    """q, who follows the second one, is far from both."""
    sim = stage("#pR...q......R..E", still="pq", follows="pR1 qR2")
    for robot in sim.world.robots:
        robot.way = [robot.place + 1]
    speeds = [speed_while_leading(robot, sim.world) for robot in sim.world.robots]
    assert speeds == [ROBOT_SPEED, 0]


@pytest.mark.paper("C7", "Alg. 3:2, chosen: help people out")
def test_a_robot_does_not_wait_beside_a_door():
    """There its followers would stand in the doorway; it goes on, and waits beyond."""
    board = "#p..R+.....1.E"
    assert later(board, 3, follows="pR", still="p") == "#p...+.R.....E"


@pytest.mark.paper("C7", "Alg. 3:3-5: tell followers what goes with that destination")
def test_a_decision_updates_destination_and_instruction():
    """The stairwell, then the middle of the floor."""
    script = Script((-4.5, -0.5), (2.5, -0.5))
    sim = stage(UPSTAIRS, robots=script, sight_range=1.5, still="p")
    rows = []
    told = []
    for _ in range(2):
        play(sim, DECISION_SECONDS)
        rows.append(goes(sim).splitlines()[-1])
        told.append(sim.world.robots[1].says)
    assert rows == ["#R2+......p#", "#AA+....R2p#"]
    assert told == [mark(sim, "+2"), NOWHERE]


@pytest.mark.paper("C7", "Alg. 3:4: take the decision as the new destination")
def test_a_second_decision_replaces_the_first_one_on_the_way_there():
    """The robot turns round in the middle of the corridor, and does not come back."""
    board = "#....R...........pE"
    there, back = (built(board).metres(1, col) for col in (14, 2))
    sim = stage(board, Script(there, back), decision_seconds=2, still="p")
    assert play(sim, 2) == "#.......R........pE"
    assert play(sim, 2) == "#....R...........pE"
    assert play(sim, 6) == "#.R..............pE"


@pytest.mark.paper("C7", "Alg. 3:6-7: walk on towards the destination")
def test_a_robot_moves_towards_its_destination_at_its_speed():
    """Tick by tick, also when no decision is made; then it stays there."""
    sim = stage("#R.......1.pE", still="p")
    start = sim.world.robots[0].position
    assert play(sim, 2) == "#...R......pE"
    assert sim.world.robots[0].position - start == pytest.approx([2 * ROBOT_SPEED, 0])
    assert play(sim, 8) == "#........R.pE"


@pytest.mark.paper("C7", "Alg. 3:7: walk on towards the destination")
def test_a_step_goes_on_past_a_waypoint():
    """0.1 m east to it, then the other 0.2 m south to the next."""
    sim = stage("#####\n#.R.#\n#...#\n#p..E\n#####", still="p")
    robot = sim.world.robots[0]
    corner = robot.position
    robot.way = [robot.place, robot.place + 2 * sim.navigation.cols]
    robot.position = corner - (0.1, 0)
    sim.step()
    southward = ROBOT_SPEED * sim.tick - 0.1
    assert robot.position == pytest.approx(corner - (0, southward))
    assert len(robot.way) == 1
    assert play(sim, 2) == "#####\n#...#\n#...#\n#pR.E\n#####"


@pytest.mark.paper("C7", "Alg. 3:7: walk on towards the destination")
def test_a_step_that_would_end_in_a_wall_leads_round_its_corner():
    """Straight on from the edge of its cell; from the middle the way is free."""
    board, after = beside("""
        ########    ########
        #R..####    #...####
        ##...###    ##...###
        ##..1###    ##..R###
        #####p.E    #####p.E
        ########    ########
        """)
    sim = stage(board, still="p", sight_range=1)
    robot = sim.world.robots[0]
    robot.position = robot.position - (0, 0.4)
    sim.step()
    assert robot.way[0] == robot.place
    assert play(sim, 3) == after


# -- Equation 1 and instructions ----------------------------------------------------


@pytest.mark.paper("C5")
@pytest.mark.paper("C6", "Eq. 1")
@given(x=st.floats(-25, 25), y=st.floats(-30, 30))
def test_a_destination_near_a_stairwell_becomes_its_centre(x, y):
    """A in the south, B in the north; every other destination is taken as it is."""
    building = shipped("paper")
    centres = [stairwell.centre for stairwell in building.stairwells]
    nearest = min(centres, key=lambda centre: dist(centre, (x, y)))
    near = dist(nearest, (x, y)) <= NEAR_STAIRWELL
    expected = nearest if near else (x, y)
    assert actual_target(building, 1, x, y) == expected


@pytest.mark.paper("C6", "Eq. 1")
def test_a_robot_decided_beside_a_stairwell_walks_onto_the_stairs():
    """Eq. 1 corrects where it goes, and there it ends: q's robot, three metres off."""
    board = "#AA+...R..pE\n\n#AA+2..R..q#"
    assert begun(board, sight_range=1.5).splitlines()[2] == "#A2+...R..q#"
    after = later(board, 6, sight_range=1.5, still="pq")
    assert after.splitlines()[2] == "#RA+......q#"


@pytest.mark.paper("C6", "Eq. 1")
def test_a_stairwell_attracts_on_its_own_floors_only():
    """A does not reach the third floor."""
    board = "#AA+1..R.pE\n\n#AA+2..R.q#\n\n####3..R.r#"
    after = "#A1+...R.pE\n\n#A2+...R.q#\n\n####3..R.r#"
    assert begun(board) == after


@pytest.mark.paper("C6", "Eq. 1, chosen: at an exit that is nearer it stays")
@pytest.mark.parametrize(
    ("hall", "column", "floor", "way"),
    [
        ("#AA+.E", 5, 0, "exit"),
        ("#AA+.E", 4, 0, "exit"),
        ("#AA+.E", 3, 0, "stairs"),  # nearer to their middle
        ("#AA+.E", 5, 1, "stairs"),  # an exit of another floor
        ("#AA+.....E", 7, 0, "exit"),
        ("#AA+.....E", 6, 0, "stairs"),  # nearer to the exit, but not at it
    ],
)
def test_of_stairs_and_an_exit_nearby_the_nearer_is_meant(hall, column, floor, way):
    """Also a little aside, where drawn actions are."""
    building = built(f"{hall}\n\n{hall.replace('E', '#')}")
    (exit_,) = building.exits
    (well,) = building.stairwells
    x, y = building.metres(1, column)
    for point in [(x, y), (x, y + 0.2), (x + 0.2, y), (x, y - 0.2)]:
        target = actual_target(building, floor, *point)
        assert target == (point if way == "exit" else well.centre)
        said = said_on_the_way(building, floor, target)
        assert (said == exit_) == (way == "exit")


@pytest.mark.paper("C6", "Eq. 1")
@pytest.mark.paper(
    "C7", "Alg. 3:5, chosen: tell followers what goes with that destination"
)
def test_of_two_stairwells_nearby_the_nearer_one_is_meant():
    """And its own entrance: B's is nearer to A's middle, but leads up only."""
    both = """
        ##############
        #AA###.......#
        #AA###.......#
        #AA#BB+......#
        #AA###.......#
        #AA###.......#
        #AA+.........#
        ##############
        """
    below = both.replace("BB+", "###").replace("##############", "########E#####")
    above = both.replace("AA+", "###").replace("AA", "##")
    building = built(below + both + above)
    a, b = building.stairwells
    assert dist(a.centre, b.centre) < NEAR_STAIRWELL
    for well in (a, b):
        assert actual_target(building, 1, *well.centre) == well.centre
    assert said_on_the_way(building, 1, b.centre) == NOWHERE
    said = said_on_the_way(building, 1, a.centre)
    assert said == a.entrances[1][0]


@pytest.mark.paper(
    "C7", "Alg. 3:5, chosen: tell followers what goes with that destination"
)
def test_of_two_stairwells_over_the_same_cells_the_one_that_leads_down_is_meant():
    """A joins floors 1 and 2, B floors 3 and 4; robots of floor 4 mean B."""
    building = built("#AA+.....E\n\n#AA+.....#\n\n#BB+.....E\n\n#BB+.....#")
    a, b = building.stairwells
    assert a.centre == b.centre
    said = said_on_the_way(building, 3, b.centre)
    assert said == b.entrances[3][0]
    assert said_on_the_way(building, 2, b.centre) == NOWHERE


@pytest.mark.paper(
    "C7", "Alg. 3:5, chosen: tell followers what goes with that destination"
)
def test_of_two_stairwells_that_lead_down_each_is_meant_by_its_middle():
    """On every floor above the first."""
    building = shipped("paper")
    for well in building.stairwells:
        for floor in (1, 2):
            said = said_on_the_way(building, floor, well.centre)
            assert said == well.entrances[floor][0]


@pytest.mark.paper("A3")
@pytest.mark.paper(
    "C7", "Alg. 3:5, chosen: tell followers what goes with that destination"
)
@pytest.mark.parametrize(
    ("floor", "where", "leads_out"),
    [
        (1, "stairwell", True),
        (0, "stairwell", False),
        (0, "exit", True),
        (1, "exit", False),
        (0, "middle", False),
    ],
)
def test_the_instruction_goes_with_the_destination(floor, where, leads_out):
    """Nobody is sent into stairs that lead nowhere, or to an exit of another floor."""
    building = built(UPSTAIRS)
    targets = {
        "stairwell": building.stairwells[0].centre,
        "exit": next(building.landmarks[m].position for m in building.exits),
        "middle": (0.0, 0.0),
    }
    sim = stage(UPSTAIRS, robots=Script(targets[where]))
    sim.step()
    (way_out,) = building.ways_out(floor)
    assert sim.world.robots[floor].says == (way_out if leads_out else NOWHERE)


@pytest.mark.paper(
    "C7", "Alg. 3:5, chosen: tell followers what goes with that destination"
)
def test_of_two_exits_the_nearest_to_the_destination_is_meant():
    """Both are near it."""
    building = built("#E####\n#....#\n####E#")
    for exit in building.exits:
        place = building.landmarks[exit].position
        assert said_on_the_way(building, 0, place) == exit


# -- Robots among people and flames -------------------------------------------------


@pytest.mark.paper("A3", "C6, chosen")
@pytest.mark.paper("C6", "Eq. 1")
def test_a_robot_inside_a_stairwell_is_seen_by_those_it_leads():
    """Eq. 1 moves it in; the entrance in between has no leaf."""
    board = "ER.....+A#\n\n#p...R.+A#"
    sim = stage(board, leads="p", sight_range=8)
    robot = sim.world.robots[1]
    robot.place += 3
    robot.position = sim.navigation.centres[robot.place]
    assert sim.building.kind.flat[robot.place] == Kind.STAIRS
    assert robot.body in view(sim, "p").robots


@pytest.mark.paper("C7", "chosen")
def test_a_robot_stands_in_nobodys_way():
    """p walks through it to the exit in view, as if it were not there."""
    for seconds in (0.8, 1.6, 2.4):
        with_robot = later("#p..R..E", seconds, leads="p", sight_range=8)
        without = later("#p.....E", seconds, leads="p", sight_range=8)
        assert with_robot.replace("R", ".") == without
    assert later("#p..R..E", 5, leads="p", sight_range=8) == "#...R..E"


@pytest.mark.paper("C7", "chosen")
def test_a_robot_does_not_burn():
    """It passes flames that it cannot avoid, and works on."""
    assert later("#R..*....1..pE", 8, still="p") == "#...*....R..pE"


@pytest.mark.paper("C7", "chosen")
@pytest.mark.parametrize(("flame", "passes"), [("*", "south"), (",", "straight on")])
def test_a_robot_leads_around_flames_where_it_can(flame, passes):
    """They do not hurt it, but those who follow; ash hurts nobody."""
    board = f"""
        ###########
        #R...{flame}..1pE
        #.........#
        #.........#
        #.........#
        ###########
        """
    sim = stage(board, still="p")
    rows = set()
    for _ in range(40):
        sim.step()
        row, _ = sim.building.cell(*sim.world.robots[0].position)
        rows.add(row)
    assert rows == ({1, 2, 3} if passes == "south" else {1})


@pytest.mark.paper("C7", "chosen")
def test_a_robot_goes_straight_though_it_burns_on_another_floor():
    """Around flames of its own floor it goes from cell to cell."""
    lower = "#######\n#R....#\n#..*..#\n#....1E\n#p....#\n#######"
    upper = lower.replace("1E", "2#").replace("*", ".")
    sim = stage(f"{lower}\n\n{upper}", still="pq")
    sim.step()
    below, above = sim.world.robots
    assert len(above.way) == 1
    assert len(below.way) > 3


@pytest.mark.paper("C7", "chosen")
def test_a_metre_in_flames_counts_more_than_one_beside_them():
    """The robot takes the longer way, beside two flames instead of through one."""
    board, after = beside("""
        #############    #############
        #R...*...1.pE    #....*.....pE
        #.#######.###    #.#######.###
        #.........###    #....R....###
        ####*#*######    ####*#*######
        #############    #############
        """)
    assert later(board, 4, still="p") == after


@pytest.mark.paper("C8")
def test_robots_above_everybody_have_finished_before_they_begin():
    """Nobody will come through their floors."""
    scene = Scenario(people_per_floor=(5, 0, 0))
    robots = Simulation(shipped("paper"), scene, Sweep()).world.robots
    assert [robot.active for robot in robots] == [True] * 2 + [False] * 4


@pytest.mark.paper("C8")
def test_a_robot_that_has_finished_is_followed_no_more():
    """Who still sees it walks on alone."""
    assert sets_off("#p.R.+....E") == "#p.!.+....E"
    sim = stage("#p.R.+....E", leads="p")
    sim.world.robots[0].active = False
    assert thinks(sim) == "#p.R.!....E"


# -- Strategies ---------------------------------------------------------------------


@pytest.mark.paper("C7")
@pytest.mark.parametrize("name", ROBOTS)
def test_a_strategy_names_one_destination_for_each_robot_or_none(name):
    """Two floats where one can stand: the interface of a learned policy, too."""
    sim = Simulation(shipped("paper"), Scenario(), RandomRobots(), NoFire(), seed=1)
    robots = sim.world.robots
    rng = np.random.default_rng(0)
    destinations = ROBOTS[name]().decide(sim.world, robots, rng)
    assert len(destinations) == len(robots)
    for robot, wanted in zip(robots, destinations, strict=True):
        if wanted is not None:
            assert sim.navigation.walkable[sim.navigation.place(robot.floor, *wanted)]


@pytest.mark.paper("C2")
def test_none_means_that_there_are_no_robots():
    """Otherwise two on each floor, one at each stairwell."""
    building = shipped("paper")
    assert Simulation(building, robots=NoRobots(), fire=RandomFire()).world.robots == []
    robots = Simulation(building, robots=Sweep(), fire=RandomFire()).world.robots
    assert [robot.floor for robot in robots] == [0, 0, 1, 1, 2, 2]
    north = [bool(robot.position[1] > 0) for robot in robots]
    assert north == [False, True] * 3


@pytest.mark.paper("C2", "chosen")
@pytest.mark.parametrize(
    ("board", "cols"),
    [("#AA+...+BB#\n\n#AA+...+BB#", [1, 8, 1]), ("#...+...E", [2, 6, 2])],
    ids=["stairwells", "rooms"],
)
def test_a_third_robot_begins_where_the_first_one_does(board, cols):
    """At the stairwells in turn; on a floor without, in its rooms in turn."""
    scene = Scenario(people=1, robots_per_floor=3)
    robots = Simulation(built(board), scene, Sweep()).world.robots
    found = [built(board).cell(*robot.position)[1] for robot in robots]
    assert found == cols * built(board).floors


@pytest.mark.paper("C7")
def test_robots_decide_every_few_seconds():
    """Every DECISION_SECONDS, beginning at once."""
    script = Script()
    sim = stage("#p..R.....E", robots=script, still="p")
    play(sim, 3 * DECISION_SECONDS)
    assert script.asked == pytest.approx([0, DECISION_SECONDS, 2 * DECISION_SECONDS])
