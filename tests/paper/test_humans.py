"""People: Algorithms 1 and 2 branch by branch, and the words they leave open."""

from copy import copy

import numpy as np
import pytest
from movies import (
    PEOPLE,
    body,
    decide,
    drawn,
    follow,
    lead,
    light,
    mark,
    mind,
    play,
    play_until,
    shipped,
    stage,
    view,
    wait,
)

from reference import walking
from reference.building import Kind
from reference.humans import desired, pass_landmark, stuck
from reference.paper import (
    FOLLOW_DISTANCE,
    GOAL_HYSTERESIS,
    LEADER_GRACE_SECONDS,
    LEADER_PAUSE_SECONDS,
    MOST_FOLLOWERS,
    RECKLESS_SECONDS,
    STAIRS_SECONDS,
    STUCK_SECONDS,
    STUCK_WAIT_SECONDS,
    Scenario,
)
from reference.perception import look
from reference.robots import followers_of
from reference.simulation import Simulation
from reference.workshop.lockstep import to_the_end
from reference.workshop.strategies import FIRES
from reference.workshop.strategies.robots import Sweep
from reference.world import (
    NOBODY,
    NOWHERE,
    Aim,
    Died,
    Evacuated,
    Fate,
    Goal,
    LeftFloor,
    Mind,
    Mode,
    Passed,
)

SOON = 0.8  # seconds: everybody thinks again within this time


def leading(board, **scenario):
    """A simulation that begins as drawn, and p leads."""
    sim = stage(board, **scenario)
    lead(sim, "p")
    return sim


def halt(sim, letter):
    """Let somebody stand still for good."""
    sim.world.bodies.pace[body(letter)] = 0.0


def passed(sim, letter, *doors):
    """Let somebody remember these doors, the last one last."""
    mind(sim, letter).doors.update(doors)
    mind(sim, letter).trail.extend(Passed(door, NOWHERE) for door in doors)


def events_of(sim, kind):
    """The events of one kind so far."""
    return [event for event in sim.events if isinstance(event, kind)]


# -- Algorithm 1: the follower ------------------------------------------------------


@pytest.mark.paper("B5", "Alg. 1:1")
@pytest.mark.paper("B6", "Alg. 2:1")
@pytest.mark.paper("A4")
def test_at_an_exit_a_human_is_deregistered():
    """Both loops end there: q thinks, walks and suffers no more."""
    sim = stage("#######\n#p..q.E\n#######")
    halt(sim, "p")
    assert play(sim, 3) == drawn("#######\n#p....E\n#######")
    assert sim.world.bodies.fate.tolist() == [Fate.INSIDE, Fate.EVACUATED]
    assert [type(event) for event in sim.events] == [LeftFloor, Evacuated]
    health = sim.world.bodies.health[body("q")]
    play(sim, 3)
    assert sim.world.bodies.health[body("q")] == health


@pytest.mark.paper("B5", "Alg. 1:2-3")
@pytest.mark.paper("B4")
def test_a_follower_without_leader_who_is_not_stuck_leads():
    """Everybody begins like this, and so finds the exit alone."""
    sim = stage("########\n#p.....E\n########")
    assert mind(sim, "p").mode is Mode.FOLLOWER
    play(sim, 0.2)
    assert mind(sim, "p").mode is Mode.LEADER
    assert play(sim, 8) == drawn("########\n#......E\n########")


@pytest.mark.paper("B5", "Alg. 1:2", "Alg. 1:10")
def test_a_follower_whose_leader_is_in_sight_does_not_switch_mode():
    """Line 2 is for those without one, line 10 for those who see it no longer."""
    sim = stage("############\n#p..q......E\n############")
    follow(sim, "p", body("q"))
    decide(sim, "p")
    assert (mind(sim, "p").mode, mind(sim, "p").leader) == (Mode.FOLLOWER, body("q"))


@pytest.mark.paper("B5", "Alg. 1:5-6")
def test_a_follower_moves_towards_the_leader_in_sight():
    """Away from the exit in view: who follows does not look for it."""
    sim = stage("############\n#q.....p...E\n############", sight_range=8)
    halt(sim, "q")
    lead(sim, "q")
    follow(sim, "p", body("q"))
    assert play(sim, 1.6) == drawn("############\n#q...p.....E\n############")


@pytest.mark.paper("B5", "Alg. 1:6, chosen")
@pytest.mark.parametrize(("farther", "goes"), [(-0.1, False), (0.1, True)])
def test_a_follower_stops_short_of_the_leader(farther, goes):
    """At FOLLOW_DISTANCE: whoever presses on would box the leader in."""
    sim = stage("########\n#..pq..E\n########")
    lead(sim, "q")
    follow(sim, "p", body("q"))
    x, y = sim.world.bodies.position[body("q")]
    sim.world.bodies.position[body("p")] = x - FOLLOW_DISTANCE - farther, y
    assert (decide(sim, "p").place != NOWHERE) is goes


INSTRUCTED = """
       #########
       #...R...#
    ####.......#
    #AA+.......E
    ####.......#
       #########

       #########
       #...R...#
    ####.......#
    #AA+...p...E
    ####.......#
       #########
    """


def say(sim, robot, kind):
    """Let a robot say "this stairwell", "this exit", or for None "follow me"."""
    marks = [m for m in sim.building.landmarks if m.floor == robot.floor]
    ways = [m.index for m in marks if m.kind is kind]
    robot.says = ways[0] if kind else NOWHERE


@pytest.mark.paper("B5", "Alg. 1:7-8")
@pytest.mark.paper("C7", "chosen")
@pytest.mark.parametrize(
    ("this", "row"),
    [
        (None, "#AA+.......E"),
        (Kind.ENTRANCE, "#AA+.p.....E"),
        (Kind.EXIT, "#AA+.....p.E"),
    ],
)
def test_a_follower_acts_on_the_robots_instruction(this, row):
    """North to the robot, west to the stairwell or east to the exit."""
    sim = stage(INSTRUCTED)
    robot = sim.world.robots[1]
    say(sim, robot, this)
    follow(sim, "p", robot.body)
    assert play(sim, 1.6).splitlines()[-3] == row


@pytest.mark.paper("C7", "chosen")
@pytest.mark.paper("B5", "Alg. 1:8")
@pytest.mark.parametrize(("which", "nearer"), [(0, True), (1, False)])
def test_this_exit_means_the_one_the_robot_goes_to(which, nearer):
    """Of two exits only the nearer is in view. If the other is meant, p follows on."""
    sim = stage("##################\nE..pR............E\n##################")
    robot = sim.world.robots[0]
    robot.says = sorted(sim.building.exits)[which]
    follow(sim, "p", robot.body)
    assert (decide(sim, "p").aim is Aim.LANDMARK) is nearer


@pytest.mark.paper("B5", "Alg. 1:8")
@pytest.mark.paper("B3")
@pytest.mark.parametrize("heard", [False, True])
def test_an_instruction_is_heard_only_in_sight_and_remembered(heard):
    """The robot is behind the wall; p, who sees the exit, knows what it said before."""
    sim = stage("#######\n#.R...#\n###+###\n#p....E\n#######", sight_range=7)
    robot = sim.world.robots[0]
    for seen in (heard, not heard):
        say(sim, robot, Kind.EXIT if seen else None)
        if seen is heard:
            follow(sim, "p", robot.body)
    assert robot.body not in view(sim, "p").bodies
    assert (decide(sim, "p").aim is Aim.LANDMARK) is heard


@pytest.mark.paper("C7", "chosen")
@pytest.mark.paper("B5", "Alg. 1:7-8")
def test_who_follows_a_human_no_longer_obeys_the_robot_before():
    """A robot said: this exit. q, whom p follows now, walks the other way."""
    sim = stage("############\n#q.....p...E\n############", sight_range=8)
    lead(sim, "q")
    follow(sim, "p", body("q"))
    mind(sim, "p").told = mark(sim, Kind.EXIT)
    assert mark(sim, Kind.EXIT) in view(sim, "p").landmarks
    assert decide(sim, "p")[:2] == (Aim.LEADER, body("q"))
    assert mind(sim, "p").told is None


APART = """
    ###############
    #p............#
    #######+#######
    #q............E
    ###############
    """


@pytest.mark.paper("B5", "Alg. 1:5", "Alg. 1:10-11")
def test_a_follower_whose_leader_is_out_of_sight_disconnects_and_leads():
    """q stands behind the wall, and was seen long ago."""
    sim = stage(APART)
    follow(sim, "p", body("q"))
    mind(sim, "p").seen_at = -10.0
    decide(sim, "p")
    assert (mind(sim, "p").mode, mind(sim, "p").leader) == (Mode.LEADER, NOBODY)


@pytest.mark.paper("B5", "Alg. 1:11")
def test_a_stuck_follower_without_leader_waits_before_leading():
    """Line 3 is not for the stuck; line 11 comes STUCK_WAIT_SECONDS later."""
    sim = stage("##########\n#p.......E\n##########")
    sim.world.bodies.anchor_time[:] = -STUCK_SECONDS - 0.1
    play_until(sim, lambda: mind(sim, "p").mode is Mode.LEADER)
    assert 0 <= sim.world.time - STUCK_WAIT_SECONDS <= SOON


@pytest.mark.paper("B5", "Alg. 1:10-11", "deviation")
@pytest.mark.parametrize(
    ("after", "mode"), [(-0.5, Mode.FOLLOWER), (SOON, Mode.LEADER)]
)
def test_a_leader_out_of_sight_is_forgiven_for_a_while(after, mode):
    """One walks on to where q was seen last, here twelve metres away."""
    sim = stage(APART)
    halt(sim, "q")
    follow(sim, "p", body("q"))
    mind(sim, "p").seen_place += 12 - 2 * sim.navigation.cols
    play(sim, LEADER_GRACE_SECONDS + after)
    assert mind(sim, "p").mode is mode


@pytest.mark.paper("B5", "chosen")
def test_where_the_leader_was_seen_last_and_is_not_the_search_ends():
    """Nobody waits there for the grace to run out."""
    sim = stage(APART)
    follow(sim, "p", body("q"))
    mind(sim, "p").seen_place = int(sim.world.bodies.place[body("p")])
    decide(sim, "p")
    assert mind(sim, "p").mode is Mode.LEADER


@pytest.mark.paper("B5", "Alg. 1:5")
def test_a_follower_comes_along_through_a_door():
    """The leader goes first and is out of sight for a moment, but not let go of."""
    sim = stage(
        """
        ##############
        #.....#......#
        #.p.q.+......#
        #.....#......E
        ##############
        """
    )
    lead(sim, "q")
    follow(sim, "p", body("q"))
    play_until(sim, lambda: mind(sim, "p").doors)
    assert mind(sim, "p").leader == body("q")
    play(sim, 8)
    first, second = events_of(sim, Evacuated)
    assert (first.person, second.person) == (body("q"), body("p"))


# -- Algorithm 2: the leader --------------------------------------------------------


@pytest.mark.paper("B6", "Alg. 2:2-3")
def test_a_leader_goes_to_an_exit_in_view():
    """Though a door is nearer and a robot beside it."""
    sim = leading("###########\n#...+p...R#\n#...#.....E\n###########")
    goal = decide(sim, "p")
    assert goal == Goal(Aim.LANDMARK, mark(sim, Kind.EXIT))
    play(sim, 6)
    assert events_of(sim, Evacuated)


@pytest.mark.paper("B6", "Alg. 2:2-3, chosen")
@pytest.mark.parametrize(("row", "nth"), [("E..p.....E", 1), ("E.....p..E", 2)])
def test_of_two_exits_in_view_the_nearest_is_gone_to(row, nth):
    """Whichever comes first on the map."""
    sim = leading(f"##########\n{row}\n##########", sight_range=9)
    both = {mark(sim, Kind.EXIT), mark(sim, Kind.EXIT, 2)}
    assert set(view(sim, "p").landmarks) == both
    assert decide(sim, "p") == Goal(Aim.LANDMARK, mark(sim, Kind.EXIT, nth))


@pytest.mark.paper("B6", "Alg. 2:5-7")
@pytest.mark.paper("B4")
def test_a_leader_in_view_of_a_door_and_a_suitable_leader_follows():
    """q outranks p and heads for the same door; p remembers when and where q was."""
    sim = stage("############\n#p..q..+...E\n############", sight_range=7)
    lead(sim, "p", "q")
    decide(sim, "q")
    sim.world.time = 7.0
    me, place = mind(sim, "p"), int(sim.world.bodies.place[body("q")])
    assert decide(sim, "p") == Goal(Aim.LEADER, body("q"), place)
    assert (me.mode, me.leader) == (Mode.FOLLOWER, body("q"))
    assert (me.seen_place, me.seen_at) == (place, 7.0)
    assert mind(sim, "q").mode is Mode.LEADER


@pytest.mark.paper("B6", "Alg. 2:8-9")
def test_a_leader_goes_to_the_desired_door():
    """Nobody suitable is in view: q does not outrank anybody."""
    sim = leading("############\n#q...p..+..E\n############")
    halt(sim, "q")
    assert decide(sim, "p") == Goal(Aim.LANDMARK, mark(sim, Kind.DOOR))
    assert play(sim, 1.6) == drawn("############\n#q.....p+..E\n############")


AROUND = """
    ################
    #p.............#
    ##########+#####
    #..............E
    ################
    """


@pytest.mark.paper("B6", "Alg. 2:13-15")
@pytest.mark.paper("B2")
def test_without_doors_in_view_a_leader_takes_an_unexplored_direction():
    """The only one: east, where the rays return nothing. No door is gone back to."""
    sim = leading(AROUND)
    passed(sim, "p", mark(sim, Kind.DOOR))
    assert not view(sim, "p").landmarks
    assert decide(sim, "p").aim is Aim.DIRECTION
    assert play(sim, 2.4) == drawn(AROUND.replace("p...", "...p"))


@pytest.mark.paper("B6", "Alg. 2:13")
def test_one_unvisited_door_in_view_is_enough_to_go_on():
    """East, past a flame: not all doors have been passed, only the one in the west."""
    sim = stage(
        """
        ###############
        #..#....*.#...#
        #..+.p....+...E
        ###############
        """
    )
    lead(sim, "p")
    west, east = mark(sim, Kind.DOOR), mark(sim, Kind.DOOR, 2)
    passed(sim, "p", west)
    assert set(view(sim, "p").landmarks) == {west, east}
    assert decide(sim, "p") == Goal(Aim.LANDMARK, east)


@pytest.mark.paper("B6", "Alg. 2:13-15")
def test_a_leader_whose_doors_in_view_have_all_been_passed_explores():
    """The door beside p was passed just now."""
    sim = leading(
        """
        ################
        #..+p..........E
        ################
        """
    )
    passed(sim, "p", mark(sim, Kind.DOOR))
    assert decide(sim, "p").aim is Aim.DIRECTION
    play(sim, 12)
    assert events_of(sim, Evacuated)


CLOSET = """
    ##############
    #.....#......#
    #.p...+......#
    #.....#......E
    ##############
    """


@pytest.mark.paper("B6", "Alg. 2:16-17")
def test_in_a_dead_end_a_leader_goes_back_to_the_door_passed_last():
    """All is seen there and its only door has been passed."""
    sim = leading(CLOSET)
    passed(sim, "p", mark(sim, Kind.DOOR))
    assert decide(sim, "p") == Goal(Aim.LANDMARK, mark(sim, Kind.DOOR))
    play(sim, 12)
    assert events_of(sim, Evacuated)


BESIDE_FLAMES = """
    ###########
    #....*.#..#
    #p.q...+..E
    ###########
    """


@pytest.mark.paper("B6", "Alg. 2:11-12", "Alg. 2:19-20")
def test_a_leader_goes_to_an_unvisited_door_that_is_not_desired():
    """Past a flame, so p does not want to; and nobody follows q there."""
    sim = stage(BESIDE_FLAMES, sight_range=7)
    lead(sim, "p", "q")
    decide(sim, "q")
    assert decide(sim, "p") == Goal(Aim.LANDMARK, mark(sim, Kind.DOOR))
    assert mind(sim, "p").mode is Mode.LEADER


@pytest.mark.paper("B6", "Alg. 2:19-20, chosen")
@pytest.mark.parametrize(("row", "nth"), [("+..p...+", 1), ("+...p..+", 2)])
def test_of_two_unvisited_doors_the_nearest_is_gone_to(row, nth):
    """A flame beside either way: neither door is desired."""
    sim = leading(f"##############\n#..#.*..*.#..#\n#..{row}..E\n##############")
    doors = [mark(sim, Kind.DOOR), mark(sim, Kind.DOOR, 2)]
    seen = view(sim, "p")
    assert set(seen.landmarks) == set(doors) and not any(map(seen.safe, doors))
    assert decide(sim, "p") == Goal(Aim.LANDMARK, doors[nth - 1])


DOOR_OR_DIRECTION = """
    ####################
    #...........*.#....#
    #..........p..+....E
    #.............#....#
    ####################
    """


@pytest.mark.paper("B6", "Alg. 2:13-14")
def test_an_unvisited_door_comes_before_an_unexplored_direction():
    """The door is not desired, beside a flame as it is; and the west lies open."""
    sim = leading(DOOR_OR_DIRECTION)
    assert view(sim, "p").open and not view(sim, "p").safe(mark(sim, Kind.DOOR))
    assert decide(sim, "p") == Goal(Aim.LANDMARK, mark(sim, Kind.DOOR))


@pytest.mark.paper("B6", "Alg. 2:2")
def test_an_exit_in_view_behind_flames_is_gone_for():
    """Flames in the way make a door undesired, but not an exit."""
    sim = leading(BLOCKED, sight_range=10)
    assert not view(sim, "p").passable(mark(sim, Kind.EXIT))
    assert decide(sim, "p") == Goal(Aim.LANDMARK, mark(sim, Kind.EXIT))


@pytest.mark.paper("B6", "Alg. 2:6-7, chosen")
def test_of_two_suitable_leaders_the_higher_rank_is_followed():
    """Both head for the door where p wants to go; r outranks q, though q is nearer."""
    sim = stage("#############\n#p.q.r.+...E\n#############", sight_range=8)
    lead(sim, "p", "q", "r")
    decide(sim, "q")
    decide(sim, "r")
    decide(sim, "p")
    assert mind(sim, "p").leader == body("r")


# -- Stuck --------------------------------------------------------------------------


BLOCKED = "###########\n#p...*....E\n###########"


@pytest.mark.paper("B5", "stuck, chosen")
def test_nobody_walks_into_flames_until_stuck():
    """The exit is in view behind them; p waits in front of them."""
    sim = stage(BLOCKED, sight_range=10)
    assert play(sim, STUCK_SECONDS) == drawn("###########\n#...p*....E\n###########")


@pytest.mark.paper("B5", "stuck, chosen")
def test_the_stuck_ignore_flames_for_a_while():
    """And get out, burnt, if the fire is narrow."""
    sim = stage(BLOCKED, sight_range=10)
    assert play(sim, 20) == drawn("###########\n#....*....E\n###########")
    assert events_of(sim, Evacuated) and not events_of(sim, Died)


@pytest.mark.paper("B5", "Alg. 1:2, stuck, chosen")
@pytest.mark.parametrize(
    ("seconds", "mode"), [(-0.1, Mode.LEADER), (0.1, Mode.FOLLOWER)]
)
def test_who_has_not_got_ahead_for_long_enough_is_stuck(seconds, mode):
    """Just below STUCK_SECONDS a follower without leader leads, just above it waits."""
    sim = stage("##########\n#p.......E\n##########")
    sim.world.bodies.anchor_time[:] = -STUCK_SECONDS - seconds
    decide(sim, "p")
    assert mind(sim, "p").mode is mode


@pytest.mark.paper("B5", "stuck, chosen")
def test_who_has_no_wish_to_move_is_not_stuck():
    """A follower beside a robot that waits is content."""
    sim = stage("#####\n#pR.#\n#...E\n#####")
    robot = sim.world.robots[0]
    follow(sim, "p", robot.body)
    play(sim, 2 * STUCK_SECONDS)
    assert mind(sim, "p").leader == robot.body
    assert sim.world.time - sim.world.bodies.anchor_time[0] < STUCK_SECONDS


@pytest.mark.paper("B5", "stuck, chosen")
def test_who_means_to_pass_a_door_gets_stuck_before_it_too():
    """Less than STUCK_METRES away from it, and held up."""
    sim = leading("########\n#..p+..E\n########")
    play(sim, 0.2)
    halt(sim, "p")
    assert sim.world.bodies.landmark[0] == mark(sim, Kind.DOOR)
    play(sim, STUCK_SECONDS + 0.6)
    assert sim.world.bodies.reckless_until[0] > sim.world.time


@pytest.mark.paper("B5", "stuck, chosen")
def test_recklessness_lasts_as_long_whenever_it_begins():
    """The stuck may enter flames for RECKLESS_SECONDS, however ticks round."""
    for begun in (0, 13, 26, 39):
        sim = stage(BLOCKED, sight_range=10)
        halt(sim, "p")
        sim.ticks = begun * 3
        sim.world.time = sim.ticks * sim.tick
        sim.world.bodies.anchor_time[:] = sim.world.time
        flame = sim.navigation.centres[sim.world.flames.burning.ravel()][:1]
        reckless, p = 0, np.array([0])
        for _ in range(round((STUCK_SECONDS + RECKLESS_SECONDS + 1) / sim.tick)):
            reckless += sim._free(p)(flame, p)[0]
            sim.step()
        assert reckless == round(RECKLESS_SECONDS / sim.tick)


# -- Desired, not yet visited -------------------------------------------------------

TOWER = """
       #########
    ####.......#
    #AA+.......E
    ####.......#
       #########

       #########
    ####...#...#
    #AA+..p+...#
    ####...#...#
       #########

       #########
    ####...#...#
    #AA+...+.q.#
    ####...#...#
       #########
    """


@pytest.mark.paper("B6", "Alg. 2:8-9")
@pytest.mark.paper("B6", "desired, chosen")
def test_above_the_first_floor_stairs_come_before_doors():
    """p stands beside a door, three metres from the stairs."""
    sim = leading(TOWER)
    stairs = sim.building.stairwells[0].entrances[1][0]
    assert list(view(sim, "p").landmarks)[-1] == stairs
    assert decide(sim, "p") == Goal(Aim.LANDMARK, stairs)


@pytest.mark.paper("B6", "desired, chosen")
def test_on_the_first_floor_stairs_are_never_desired():
    """They lead nowhere."""
    sim = leading(
        """
           #########
        ####...#...#
        #AA+..p+...E
        ####...#...#
           #########

           #########
        ####.......#
        #AA+.......#
        ####.......#
           #########
        """
    )
    passed(sim, "p", mark(sim, Kind.DOOR))
    mind(sim, "p").trail.clear()
    goal = decide(sim, "p")
    assert goal.aim is not Aim.LANDMARK


@pytest.mark.paper("B6", "desired, chosen")
def test_a_burnt_door_is_neither_desired_nor_unvisited():
    """It is seen no more."""
    sim = leading("#########\n#..+p.+.E\n#########")
    sim.world.burnt.add(mark(sim, Kind.DOOR))
    assert decide(sim, "p")[1] == mark(sim, Kind.DOOR, 2)


@pytest.mark.paper("B6", "desired, chosen")
def test_a_way_through_flames_is_not_gone():
    """Neither desired nor reachable: p stays on this side of them."""
    sim = leading("#########\n#p.*.+..E\n#########")
    assert decide(sim, "p").aim is not Aim.LANDMARK


@pytest.mark.paper("B6", "hysteresis, chosen")
@pytest.mark.parametrize(("metres_nearer", "kept"), [(2, True), (4, False)])
def test_a_goal_is_kept_until_another_is_much_nearer(metres_nearer, kept):
    """GOAL_HYSTERESIS lies between the two cases."""
    assert 2 < GOAL_HYSTERESIS < 4
    far = "." * metres_nearer
    board = f"#..+.p.{far}+..E"
    wall = "#" * len(board)
    sim = leading(f"{wall}\n{board}\n{wall}", sight_range=9)
    near, farther = mark(sim, Kind.DOOR), mark(sim, Kind.DOOR, 2)
    mind(sim, "p").goal = Goal(Aim.LANDMARK, farther)
    assert decide(sim, "p")[1] == (farther if kept else near)


# -- Suitable leaders ---------------------------------------------------------------

PAIR = """
    ################
    #..+.p..q..+...E
    ################
    """


@pytest.mark.paper("B6", "suitable, chosen")
@pytest.mark.parametrize(
    ("change", "suits"),
    [
        (lambda sim: None, True),
        (lambda sim: sim.world.bodies.rank.put(1, -1), False),
        (lambda sim: sim.world.bodies.leader.put(1, 0), False),
        (lambda sim: sim.world.bodies.landmark.put(1, NOWHERE), False),
        (lambda sim: mind(sim, "p").doors.clear(), False),
    ],
    ids=["suitable", "outranked", "follows", "explores", "to the farther door"],
)
def test_a_human_suits_who_leads_outranks_me_and_heads_where_i_want(change, suits):
    """Anything else would lead people in circles; p has passed the door in the west."""
    sim = stage(PAIR, sight_range=7)
    lead(sim, "p", "q")
    decide(sim, "q")
    passed(sim, "p", mark(sim, Kind.DOOR))
    change(sim)
    decide(sim, "p")
    assert mind(sim, "p").leader == (body("q") if suits else NOBODY)


@pytest.mark.paper("B6", "suitable, chosen")
@pytest.mark.parametrize("places_left", [0, 1])
def test_a_human_leads_only_so_many(places_left):
    """MOST_FOLLOWERS: more would only stand in the way; p finds the door alone."""
    others = PEOPLE[1:][: MOST_FOLLOWERS - places_left]
    leader = PEOPLE[len(others) + 1]
    row = f"#p{others}{leader}...+...E"
    sim = stage("\n".join(["#" * len(row), row, "#" * len(row)]), sight_range=15)
    lead(sim, "p", leader)
    decide(sim, leader)
    for letter in others:
        follow(sim, letter, body(leader))
    decide(sim, "p")
    assert mind(sim, "p").leader == (body(leader) if places_left else NOBODY)


@pytest.mark.paper("B6", "Alg. 2:6-7")
@pytest.mark.paper("B6", "suitable, chosen")
def test_a_robot_in_view_is_always_suitable():
    """Also in a dead end, where no door is wanted, and right after losing a leader."""
    sim = leading(
        """
        #######
        #p.R..#
        #.....#
        ###+###
        #.....E
        #######
        """
    )
    passed(sim, "p", mark(sim, Kind.DOOR))
    mind(sim, "p").pause_until = 99.0
    decide(sim, "p")
    assert mind(sim, "p").leader == sim.world.robots[0].body


@pytest.mark.paper("B6", "Alg. 2:5-7", "deviation")
def test_a_robot_in_view_is_followed_though_a_door_is_wanted():
    """The door is nearer, and without the robot p would go there."""
    sim = leading("############\n#..+p..R...E\n############")
    assert desired(mind(sim, "p"), view(sim, "p")) == mark(sim, Kind.DOOR)
    decide(sim, "p")
    assert mind(sim, "p").leader == sim.world.robots[0].body


@pytest.mark.paper("B6", "suitable, chosen")
def test_the_nearest_of_two_robots_is_followed():
    """Whichever was first in the list."""
    sim = leading("##########\n#R..p.R..E\n##########", sight_range=4)
    decide(sim, "p")
    assert mind(sim, "p").leader == sim.world.robots[1].body


@pytest.mark.paper("B5", "chosen")
@pytest.mark.parametrize(
    ("seconds", "mode"), [(-0.1, Mode.LEADER), (0.1, Mode.FOLLOWER)]
)
def test_after_losing_a_leader_one_leads_oneself_for_a_while(seconds, mode):
    """LEADER_PAUSE_SECONDS, then q is followed again."""
    sim = stage(PAIR, sight_range=7)
    lead(sim, "p", "q")
    decide(sim, "q")
    passed(sim, "p", mark(sim, Kind.DOOR))
    follow(sim, "p", body("q"))
    mind(sim, "p").seen_at = -99.0
    sim.world.bodies.fate[body("q")] = Fate.EVACUATED  # out of sight ...
    decide(sim, "p")
    sim.world.bodies.fate[body("q")] = Fate.INSIDE  # ... and back again
    sim.world.time += LEADER_PAUSE_SECONDS + seconds
    decide(sim, "p")
    assert mind(sim, "p").mode is mode


# -- Memory -------------------------------------------------------------------------

SUITE = """
    #################
    #...#...#...#...#
    #.p.+...+...+...E
    #...#...#...#...#
    #################
    """


@pytest.mark.paper("B6", "chosen")
def test_every_door_passed_on_this_floor_is_remembered():
    """All three, and the way back in their order: line 13 forgets nothing."""
    sim = stage(SUITE)
    play_until(sim, lambda: events_of(sim, Evacuated))
    doors = [mark(sim, Kind.DOOR, nth) for nth in (1, 2, 3)]
    assert mind(sim, "p").doors == set(doors)
    assert [passed.door for passed in mind(sim, "p").trail] == doors


TWO_DOORS = """
    ###########
    #....#....#
    #.p..+....#
    #....#....#
    #....+....#
    #....#....E
    ###########
    """


@pytest.mark.paper("B6", "Alg. 2:13, chosen")
def test_a_door_seen_from_both_sides_has_been_visited():
    """p has passed one of two doors between the same rooms: the other is known, too."""
    sim = leading(TWO_DOORS)
    one, other = mark(sim, Kind.DOOR), mark(sim, Kind.DOOR, 2)
    decide(sim, "p")
    assert not mind(sim, "p").doors
    sim.world.bodies.place[0] += 5  # p is in the other room now
    decide(sim, "p")
    assert mind(sim, "p").doors == {one, other}


@pytest.mark.paper("B6", "chosen")
def test_who_steps_into_a_door_and_back_has_not_passed_it_twice():
    """The way back stays the same; who crosses it the other way drops it."""
    me = Mind()
    pass_landmark(me, 4, side=1, beyond=9)
    pass_landmark(me, 4, side=1, beyond=9)
    assert me.trail == [Passed(4, 1)]
    pass_landmark(me, 4, side=2, beyond=8)
    assert me.trail == [] and me.doors == {4}


CLOSETS = """
    ####################
    #...#...#..........#
    #.p.+...+..........#
    #...#...#..........E
    ####################
    """


def nested():
    """CLOSETS when p, who leads, has passed the outer and then the inner door."""
    sim = leading(CLOSETS)
    outer, inner = mark(sim, Kind.DOOR, 2), mark(sim, Kind.DOOR)
    passed(sim, "p", outer, inner)
    return sim, outer, inner


@pytest.mark.paper("B6", "Alg. 2:17, chosen")
def test_out_of_nested_dead_ends_one_walks_back_door_by_door():
    """Through the door passed last, then the one before: no swinging between rooms."""
    sim, _, _ = nested()
    play_until(sim, lambda: not mind(sim, "p").trail)
    assert play(sim, 1).splitlines()[2].index("p") > 8
    assert play(sim, 12).count("p") == 0


@pytest.mark.paper("B6", "Alg. 2:17, chosen")
def test_who_turns_back_in_a_door_leaves_it():
    """The door that one stands in is not walked to; the one before it is."""
    sim, outer, inner = nested()
    (sim.world.bodies.place[0],) = np.flatnonzero(sim.building.landmark == inner)
    assert decide(sim, "p") == Goal(Aim.LANDMARK, outer)
    assert [passed.door for passed in mind(sim, "p").trail] == [outer]


@pytest.mark.paper("B6", "Alg. 2:17, chosen")
def test_a_burnt_door_is_no_way_back():
    """The one before it is tried."""
    sim, outer, inner = nested()
    sim.world.burnt.add(inner)
    assert decide(sim, "p") == Goal(Aim.LANDMARK, outer)


@pytest.mark.paper("B6", "Alg. 2:17, chosen")
def test_without_any_door_to_go_back_to_everything_is_tried_again():
    """All memories of doors are dropped; p starts from the far end of the room."""
    sim = leading(CLOSETS)
    passed(sim, "p", mark(sim, Kind.DOOR))
    sim.world.burnt.update(range(len(sim.building.landmarks)))
    mind(sim, "p").patches.add(0)
    goal = decide(sim, "p")
    assert goal == view(sim, "p").far_end and goal.place != NOWHERE
    me = mind(sim, "p")
    assert not me.doors and not me.trail and not me.patches


CROSSROADS = """
    ########################
    #..........p...........E
    ########################
    """


@pytest.mark.paper("B2")
@pytest.mark.paper("B6", "Alg. 2:14-15")
@pytest.mark.parametrize("seen", [-1, 1], ids=["west", "east"])
def test_a_patch_of_floor_already_seen_is_no_unexplored_direction(seen):
    """Both ways lie open; p has been at the end of one and takes the other."""
    sim = leading(CROSSROADS)
    west_or_east = [way for way in view(sim, "p").open if way.unit[0] * seen > 0]
    mind(sim, "p").patches.update(way.patch for way in west_or_east)
    goal = decide(sim, "p")
    x = sim.navigation.centres[goal.place][0] - sim.world.bodies.position[0, 0]
    assert goal.aim is Aim.DIRECTION and x * seen < 0


@pytest.mark.paper("B2")
def test_every_patch_walked_over_counts_as_explored():
    """Where p has been it need not look again."""
    sim = stage(CROSSROADS)
    walked = set()

    def far():
        walked.add(sim.sight.patches[int(sim.world.bodies.place[0])])
        return len(walked) == 3

    play_until(sim, far)
    play(sim, SOON)
    assert walked <= mind(sim, "p").patches


@pytest.mark.paper("B2")
def test_a_direction_that_begins_to_burn_is_given_up():
    """For the other one; and it counts as tried."""
    sim = leading(CROSSROADS)
    goal = decide(sim, "p")
    light(sim, goal.place)
    other = decide(sim, "p")
    assert other.aim is Aim.DIRECTION and other.which != goal.which
    assert goal.which in mind(sim, "p").patches


@pytest.mark.paper("B2")
def test_a_direction_behind_flames_is_none():
    """They reach from wall to wall; the floor beyond them is in sight all the same."""
    sim = leading("###########\n#p.*......E\n#..*......E\n###########", sight_range=6)
    assert view(sim, "p").open == []
    sim.world.flames.alight = frozenset()
    assert view(sim, "p").open != []


@pytest.mark.paper("B6", "not yet visited, chosen")
def test_who_stands_in_flames_may_still_leave():
    """Only flames on the rest of the way bar a door."""
    sim = stage("########\n#.p..+.E\n########")
    place = sim.world.bodies.place[0]
    light(sim, place)
    door = mark(sim, Kind.DOOR)
    seen = view(sim, "p")
    assert seen.passable(door) and seen.safe(door)
    light(sim, place + 1)
    assert not view(sim, "p").passable(door)


@pytest.mark.paper("B6", "chosen")
def test_a_follower_passes_a_door_after_its_leader():
    """It remembers the door, but is not made to walk on into the room."""
    me = Mind(mode=Mode.FOLLOWER, goal=Goal(Aim.LEADER, 1))
    pass_landmark(me, 4, side=1, beyond=9)
    assert (me.doors, me.trail) == ({4}, [Passed(4, 1)])
    assert me.goal == Goal(Aim.LEADER, 1)


CORNER = """
    #########
    #...#...#
    #.p.+...#
    #...#...#
    #####+###
    #.......E
    #########
    """


@pytest.mark.paper("B6", "chosen")
@pytest.mark.parametrize("change", ["nothing", "flames", "stuck"])
def test_a_threshold_is_crossed_unless_it_burns_or_one_is_stuck(change):
    """Then p decides anew; the next door is not straight ahead."""
    sim = stage(CORNER)
    play_until(sim, lambda: mind(sim, "p").doors)
    goal = mind(sim, "p").goal
    beyond = int(sim.navigation.places_of(0, np.array([[2, 5]]))[0])
    assert goal == Goal(Aim.THRESHOLD, mark(sim, Kind.DOOR), beyond)
    if change == "flames":
        light(sim, beyond)
    if change == "stuck":
        sim.world.bodies.anchor_time[:] = sim.world.time - STUCK_SECONDS - 0.1
    assert (decide(sim, "p") == goal) is (change == "nothing")


@pytest.mark.paper("B6", "Alg. 2:17, chosen")
def test_beyond_a_threshold_one_looks_again():
    """From there p goes to the door round the corner."""
    sim = stage(CORNER)
    next_door = Goal(Aim.LANDMARK, mark(sim, Kind.DOOR, 2))
    play_until(sim, lambda: mind(sim, "p").goal == next_door)
    assert sim.world.bodies.position[0, 0] > sim.building.metres(0, 4)[0]


@pytest.mark.paper("B6", "Alg. 2:15, chosen")
def test_of_several_unexplored_directions_the_straightest_is_taken():
    """p comes from the east to a crossing, and goes on westwards."""
    arm = ["#######.#######"] * 6
    rows = ["###############", *arm, "E............p#", *arm, "###############"]
    sim = stage("\n".join(rows))
    play(sim, 14)
    assert events_of(sim, Evacuated)


@pytest.mark.paper("B6", "Alg. 2:15, chosen")
def test_a_direction_once_taken_is_followed_to_its_end():
    """The same goal as long as its patch of floor has not been reached."""
    sim = leading("####################\n#p.................E\n####################")
    goal = decide(sim, "p")
    play(sim, 0.6)
    assert decide(sim, "p") == goal


# -- Stairs -------------------------------------------------------------------------


@pytest.mark.paper("A3")
def test_people_walk_down_past_the_middle_floor_without_entering_it():
    """From the third floor to the first: two flights, one landing."""
    sim = stage(TOWER.replace("p", "."))
    bodies, met = sim.world.bodies, []

    def out():
        met.append((int(bodies.floor[0]), bool(bodies.walking[0])))
        return events_of(sim, Evacuated)

    play_until(sim, out)
    assert (1, True) not in met
    assert [event.floor for event in events_of(sim, LeftFloor)] == [2, 1, 0]


@pytest.mark.paper("A3", "chosen")
def test_the_second_flight_of_stairs_takes_as_long_as_the_first():
    """From the third floor to the landing, and from there to the first floor."""
    sim = stage(TOWER.replace("p", "."))
    bodies, times = sim.world.bodies, []
    reached = {
        "the stairs": lambda: bodies.stairwell[0] >= 0,
        "the landing": lambda: bodies.floor[0] == 1,
        "the first floor": lambda: bodies.walking[0],
    }
    for where in reached.values():
        play_until(sim, where)
        times.append(sim.world.time)
    assert np.diff(times) == pytest.approx([STAIRS_SECONDS] * 2, abs=sim.tick)


@pytest.mark.paper("A3", "chosen")
@pytest.mark.paper("B5", "chosen")
def test_on_the_stairs_people_follow_nobody():
    """Their robot stays on its floor, and no longer waits for them."""
    sim = stage(INSTRUCTED)
    robot = sim.world.robots[1]
    say(sim, robot, Kind.ENTRANCE)
    follow(sim, "p", robot.body)
    assert followers_of(sim.world, robot).tolist() == [body("p")]
    play_until(sim, lambda: sim.world.bodies.stairwell[0] >= 0)
    assert followers_of(sim.world, robot).tolist() == []


@pytest.mark.paper("B5", "stuck, chosen")
def test_who_comes_out_of_a_stairwell_is_not_stuck():
    """Though the stairs have taken longer than STUCK_SECONDS."""
    assert STAIRS_SECONDS > STUCK_SECONDS
    sim = stage(TOWER.replace("q", "."))
    bodies = sim.world.bodies
    play_until(sim, lambda: not bodies.floor[0] and bodies.walking[0])
    assert not stuck(mind(sim, "p"), view(sim, "p"))


@pytest.mark.paper("B5", "chosen")
def test_out_of_a_stairwell_people_are_leaders_who_remember_one_entrance():
    """p followed a robot through a door and down; nobody walks back up."""
    sim = stage(TOWER.replace("p", ".").replace("q", "p"))
    me, bodies = mind(sim, "p"), sim.world.bodies
    play_until(sim, lambda: len(me.trail) and bodies.stairwell[0] >= 0)
    me.mode, me.leader = Mode.FOLLOWER, 0
    play_until(sim, lambda: not bodies.floor[0] and bodies.walking[0])
    assert (me.mode, me.leader) == (Mode.LEADER, NOBODY)
    assert list(me.doors) == [sim.building.stairwells[0].entrances[0][0]]
    assert not me.trail


# -- What nobody knows --------------------------------------------------------------


@pytest.mark.paper("B3")
@pytest.mark.parametrize("fire", ["random", "greedy"])
def test_what_is_out_of_sight_changes_no_decision(fire):
    """People, robots, flames and doors elsewhere are altered; all decide as before."""
    scene = Scenario(people=60)
    sim = Simulation(shipped("museum"), scene, Sweep(), FIRES[fire](), seed=1)
    rng = np.random.default_rng(0)
    for _ in range(15):
        wait(sim, 4)
        for i in np.flatnonzero(sim.world.bodies.walking)[::3].tolist():
            same, other = twin(sim), twin(sim)
            alter_elsewhere(other, i, rng)
            assert look_and_think(same, i) == look_and_think(other, i)


def twin(sim):
    """A simulation with a world of its own."""
    other = copy(sim)
    other.world = sim.world.copy()
    return other


def look_and_think(sim, i):
    """Let human i decide once, and nothing else; all that they remember then."""
    views = look(sim.world, sim.sight, np.array([i]))
    walking.decide(sim.world, np.array([i]), views)
    return sim.world.minds[i]


def alter_elsewhere(sim, i, rng):
    """Change whatever can change where no ray of human i arrives."""
    world, bodies, p = sim.world, sim.world.bodies, sim.world.bodies.place[i]
    hidden = np.ones(sim.navigation.places, dtype=bool)
    hidden[[p, *sim.sight.seen(p)]] = False
    for door in range(len(sim.building.landmarks)):
        if hidden[sim.building.landmark.ravel() == door].all():
            world.burnt ^= {door}
    flip = hidden & (rng.random(len(hidden)) < 0.5)
    world.flames.alight ^= frozenset(np.flatnonzero(flip).tolist())
    for array in (world.flames.burning, world.flames.harm):
        array.ravel()[flip] = array.ravel()[flip] == 0
    away = np.flatnonzero(hidden[bodies.place] | ~bodies.walking)
    for j in away.tolist():
        other = world.minds[j]
        other.mode, other.goal = Mode.FOLLOWER, Goal(Aim.LANDMARK, 0)
        bodies.mode[j], bodies.leader[j], bodies.landmark[j] = 0, rng.integers(60), 0
    bodies.position[away] += 0.1
    bodies.fate[away[::2]] = Fate.DEAD
    for robot in world.robots:
        if hidden[robot.place]:
            say(sim, robot, Kind.EXIT)


@pytest.mark.slow
@pytest.mark.paper("B2", "chosen")
def test_who_sees_farther_gets_out_no_less():
    """In the paper's building, 40 evacuations; up to five points are left to chance."""
    saved = []
    for metres in (5, 6.5, 8, 10, 12):
        rule, seeds = Scenario(sight_range=metres), range(91_001, 91_041)
        runs = [Simulation(shipped("paper"), rule, seed=seed) for seed in seeds]
        to_the_end(runs)
        out = np.mean([run.outcome().evacuated / len(run.world.bodies) for run in runs])
        assert out > max(saved, default=0) - 0.05
        saved.append(out)


# -- How well one sees --------------------------------------------------------------
