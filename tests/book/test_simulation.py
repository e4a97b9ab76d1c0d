"""Whole runs: nobody in a wall, lost or counted twice; the same seed, the same run."""

from copy import copy, deepcopy
from itertools import pairwise
from math import dist, inf, isnan, nan
from pathlib import Path

import numpy as np
import pytest
from alike import same
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st
from movies import (
    body,
    built,
    events_of,
    play,
    play_until,
    shipped,
    stage,
    ticks,
    wait,
)
from scipy.spatial.distance import pdist

from reference import paper
from reference.building import Building, Kind
from reference.fire import RandomFire, burnable, cells_around_clearance
from reference.floorplan import parse
from reference.navigation import navigation_of
from reference.paper import InputError, Scenario
from reference.rays import sight_of
from reference.simulation import Simulation
from reference.walking import enter_stairs, free_for
from reference.workshop import maps
from reference.workshop.engine import run_to_end
from reference.workshop.strategies import FIRES, ROBOTS
from reference.world import Died, Evacuated, Fate, LeftFloor


def run(name="tiny", people=20, robots="sweep", fire="random", seed=0, **scenario):
    """A simulation of a building that ships, not yet begun."""
    scene = Scenario(people=people, **scenario)
    return Simulation(shipped(name), scene, ROBOTS[robots](), FIRES[fire](), seed)


def bodies(sim):
    """All that is known of the bodies now, as a copy."""
    return deepcopy(vars(sim.world.bodies))


@pytest.mark.parametrize(
    ("given", "told"),
    [
        ({"building": "tiny"}, r"building is 'tiny': .* such as load\('tiny'\)"),
        ({"building": None}, r"building is None: .* such as load\('paper'\)"),
        ({"building": Path("tiny")}, r"building is .*Path\('tiny'\): give an object"),
        ({"robots": 3}, r"robots is 3: give an object, such as Sweep\(\)"),
        ({"fire": {}}, r"fire is {}: give an object, such as RandomFire\(\)"),
        ({"world": 3}, "world is 3: give an object"),
        ({"robots": RandomFire()}, r"plays the robots has decide\(self, world, robots"),
        ({"fire": ROBOTS["sweep"]()}, r"the fire has decide\(self, world, rng\)"),
        ({"building": Building}, r"building is the class: .* Building\(\)"),
        ({"robots": "sweep"}, r"robots is 'sweep': .* such as Sweep\(\)"),
        ({"robots": ROBOTS["sweep"]}, r"robots is the class: .* Sweep\(\)"),
        ({"fire": "random"}, r"fire is 'random': .* such as RandomFire\(\)"),
        ({"fire": RandomFire}, r"fire is the class: .* RandomFire\(\)"),
        ({"scenario": {"people": 3}}, r"scenario is {'people': 3}: .* Scenario\("),
        ({"scenario": Scenario}, r"scenario is the class: .* Scenario\(\)"),
        ({"scenario": ROBOTS["sweep"]()}, r"scenario is .*Sweep.*: give an object"),
        ({"seed": -1}, r"seed is -1: it must be a whole number, 0 or more"),
        ({"seed": 0.5}, r"seed is 0.5: it must be a whole number"),
        ({"seed": "1"}, r"seed is '1': it must be a whole number"),
    ],
)
def test_refuses_names_and_other_things_where_objects_are_needed(given, told):
    """In one line, which says what to give; and seeds that are no such numbers."""
    with pytest.raises(InputError, match=told):
        Simulation(**{"building": shipped("tiny")} | given)


def test_refuses_a_world_of_another_building():
    """One that is drawn alike will do: a copied world may have such a one."""
    tiny = shipped("tiny")
    with pytest.raises(InputError, match=r"world is of 'Museum', .* is 'Tiny "):
        Simulation(tiny, world=run("museum").world)
    alike = Building(tiny.drawing)
    assert Simulation(alike, world=run("tiny").world).world.bodies


class AsyncGuide:
    """Its decisions are coroutines, which nobody awaits."""

    async def decide(self, world, *asked):
        """Decide nothing, later."""


@pytest.mark.parametrize("side", ["robots", "fire"])
def test_refuses_who_decides_asynchronously(side):
    """Before Python warns of what it never awaited."""
    told = f"who plays the {side} has decide.*: nobody awaits it, so write no `async`"
    with pytest.raises(InputError, match=told):
        Simulation(shipped("tiny"), **{side: AsyncGuide()})


def test_a_building_and_how_a_run_stands_are_said_in_a_line():
    """Not as pages of arrays."""
    sim = run(people=3)
    assert (
        repr(sim.building) == "<Building Tiny office: 2 floors, 2 exits, 2 stairwells>"
    )
    assert repr(sim.world) == "<World at 0 s: 3 people inside>"
    assert repr(sim) == f"<Simulation of Tiny office: {sim.world!r}>"


class EmptyGuide(dict):
    """A strategy that remembers nothing yet: as an object it counts as false."""

    def decide(self, world, robots, rng):
        return [(0.0, 0.0) for _ in robots]


def test_a_strategy_that_is_empty_is_no_absent_one():
    """What it remembers may have a length."""
    sim = Simulation(shipped("tiny"), Scenario(people=3), EmptyGuide())
    assert type(sim.robot_strategy) is EmptyGuide
    assert sim.world.robots


def test_refuses_a_world_between_two_ticks():
    """Its clock would jump; where a tick ends in both, the run goes on from there."""
    sim = Simulation(shipped("tiny"), Scenario(people=2))
    for _ in range(5):
        sim.step()
    with pytest.raises(InputError, match=r"world is at 1 s, between two ticks of 0.14"):
        Simulation(sim.building, Scenario(frames_per_tick=7), world=sim.world)
    on = Simulation(sim.building, Scenario(frames_per_tick=25), world=sim.world)
    on.step()
    assert on.world.time == 1.5


def test_refuses_a_sight_whose_tables_would_not_fit_into_memory():
    """Of a large map they grow with the square of sight; in a small one all is seen."""
    rows = ["#" * 200, *["#" + "." * 198 + "#"] * 198, "E" * 200]
    text = "\n".join(["building: Hall", "size: 200 x 200", "floor 1: ground", *rows])
    hall = Building(parse(text))
    told = "sight_range is 10000: in a building as large as 'Hall' it must be at most"
    with pytest.raises(InputError, match=f"{told} 111 metres"):
        Simulation(hall, Scenario(people=1, sight_range=10_000))
    Simulation(shipped("tiny"), Scenario(people=1, sight_range=10_000)).step()


@pytest.mark.parametrize("number", ["WALKING_SPEED", "WALKING_SPREAD"])
def test_refuses_people_who_would_step_through_walls(number, monkeypatch):
    """A step of a metre or more may end beyond a wall."""
    monkeypatch.setattr(paper, number, 5.0)
    told = rf"in a tick of 0.2 s, .* walls: lower {number}|or {number}"
    with pytest.raises(InputError, match=told):
        Scenario()
    Scenario(frames_per_tick=3)


class Saying:
    """Robots, or a fire, that always decide the same."""

    def __init__(self, answer):
        self.answer = answer

    def decide(self, world, *asked):
        return self.answer


@pytest.mark.parametrize(
    ("answer", "told"),
    [
        (None, r"returned None: give a list, with \(x, y\) or None for each of the 4"),
        ([(1.0, 1.0)], r"returned \[\(1.0, 1.0\)\]: give a list"),
        (iter([(1.0, 1.0)] * 4), "returned <list_iterator .*: give a list"),
        (
            [(nan, 1.0)] * 4,
            r"to \(nan, 1.0\), which is no place: give \(x, y\)",
        ),
        ([(inf, 1.0)] * 4, "which is no place"),
        ([(1.0, -1e300)] * 4, "which is no place"),
        ([(1.0, 1.0, 0)] * 4, "which is no place"),
        (["here"] * 4, "which is no place"),
        ([("1", "2")] * 4, "which is no place"),
        ([(10**400, 2)] * 4, "which is no place"),
        (np.array(3.0), "give a list"),
        (np.ma.masked_all((4, 2)), "which is no place"),
        ([np.array([inf, 1.0], np.float16)] * 4, "which is no place"),
    ],
)
def test_refuses_to_send_robots_nowhere(answer, told):
    """A run that went on would end with figures that mean nothing."""
    with pytest.raises(InputError, match=told):
        Simulation(shipped("tiny"), robots=Saying(answer)).step()


@pytest.mark.parametrize(
    "decision",
    [
        (2, 1.0, 1.0),
        (-1, 1.0, 1.0),
        (0, nan, 1.0),
        (0, "1", "2"),
        (1.0, 1.0),
        np.ma.array([0.0, 1.0, 1.0], mask=[True, False, False]),
        7,
    ],
)
def test_refuses_a_fire_where_there_is_no_floor(decision):
    """It would burn somewhere else, as an occupied place does [D6]."""
    told = (
        r"(?s)for .*, which is no place: give \(floor, x, y\), floor 0 to 1 and metres"
    )
    sim = Simulation(shipped("tiny"), fire=Saying(decision))
    with pytest.raises(InputError, match=told):
        for _ in ticks(sim):
            pass


def test_a_fires_floor_may_stand_among_floats():
    """As in an array of three numbers."""
    sim = Simulation(shipped("tiny"), Scenario(people=1), fire=Saying(np.ones(3)))
    while not sim.world.flames.sources:
        sim.step()
    (source,) = sim.world.flames.sources
    assert (source.floor, type(source.floor)) == (1, int)


# -- Invariants ---------------------------------------------------------------------


def audit(sim):
    """Run to the end, and check after every tick and then what must never happen."""
    before = bodies(sim)
    robots = deepcopy(sim.world.robots)
    for _ in ticks(sim):
        now = bodies(sim)
        robots_keep_their_floor_and_speed(sim, robots)
        robots = deepcopy(sim.world.robots)
        nobody_is_lost(sim, now)
        nobody_is_in_a_wall(sim, now)
        nobody_is_in_anybody(sim, now)
        assert (now["health"] <= before["health"]).all()
        out = before["fate"] != Fate.INSIDE
        assert np.array_equal(now["fate"][out], before["fate"][out])
        before = now
    everybody_has_one_end(sim)
    events_come_in_order(sim)


def nobody_is_lost(sim, now):
    """Everybody is inside, out or dead, and inside on one floor."""
    fates = np.bincount(now["fate"], minlength=3)
    assert fates.sum() == len(now["fate"])
    assert sum(sim.world.occupancy) == fates[Fate.INSIDE]
    on_floor = np.bincount(now["floor"][now["fate"] == Fate.INSIDE], minlength=9)
    assert sim.world.occupancy == on_floor[: sim.building.floors].tolist()


def nobody_is_in_a_wall(sim, now):
    """The cell around every position is walkable, and the one in the record."""
    inside = now["fate"] == Fate.INSIDE
    place = sim.navigation.places_at(now["floor"], now["position"])
    assert np.array_equal(place[inside], now["place"][inside])
    assert sim.navigation.walkable[place[inside]].all()


def nobody_is_in_anybody(sim, now):
    """Middles keep apart, those of people who meet by the depth of a body."""
    at = np.column_stack([now["position"], 1e3 * now["floor"]])
    far = pdist(at[sim.world.bodies.walking])
    assert far.min(initial=9) > paper.SHOULDER_METRES - 1e-6


def everybody_has_one_end(sim):
    """Evacuated or dead once, or still inside; down floor by floor before."""
    world = sim.world
    ends = [event.person for event in events_of(sim, Evacuated | Died)]
    assert sorted(ends) == np.flatnonzero(~world.bodies.inside).tolist()
    for person in range(len(world.bodies)):
        mine = [e for e in sim.events if getattr(e, "person", None) == person]
        left = [e.floor for e in mine if isinstance(e, LeftFloor)]
        assert all(above == below + 1 for above, below in pairwise(left))
        if mine:
            assert not any(isinstance(e, Evacuated | Died) for e in mine[:-1])


def events_come_in_order(sim):
    """And whoever passes an exit has left the floor in the same tick."""
    times = [event.time for event in sim.events]
    assert times == sorted(times)
    for before, event in pairwise(sim.events):
        if isinstance(event, Evacuated):
            left = event.time, event.person, event.floor, event.health
            assert before == LeftFloor(*left)


@pytest.mark.parametrize(
    ("people", "limit"),
    [(paper.PEOPLE, 240), pytest.param(1000, 20, marks=pytest.mark.slow)],
)
def test_nobody_is_ever_in_a_wall_lost_or_counted_twice(people, limit):
    """In the paper's building, from the first tick to the last; `audit` asserts it."""
    audit(run("paper", people, "patrol", "greedy", seed=7, time_limit=limit))


def robots_keep_their_floor_and_speed(sim, before):
    """They walk through no wall; before: the robots a tick ago."""
    for robot, was in zip(sim.world.robots, before, strict=True):
        assert robot.floor == was.floor and sim.navigation.walkable[robot.place]
        step = dist(robot.position, was.position)
        assert step <= paper.ROBOT_SPEED * sim.tick + 1e-6


@st.composite
def buildings(draw):
    """Rooms in rows and columns, on one or two floors with stairs in a corner room."""
    floors, across, down = (draw(st.integers(low, 3)) for low in (1, 2, 2))
    east = np.cumsum([0, *(draw(st.integers(3, 6)) for _ in range(across))])
    south = np.cumsum([0, *(draw(st.integers(3, 6)) for _ in range(down))])
    text = f"building: any\nsize: {east[-1] + 1} x {south[-1] + 1}\n"
    for floor in range(floors):
        rows = np.full((south[-1] + 1, east[-1] + 1), ".")
        rows[south] = "#"
        rows[:, east] = "#"
        for row, col in np.ndindex(down, across):
            y = south[row] + 1
            x = east[col] + 1  # of doors west and north
            west, north = draw(st.sampled_from([(1, 0), (0, 1), (1, 1)]))
            if col and (west or not row):
                rows[y, east[col]] = "+"
            if row and (north or not col):
                rows[south[row], x] = "+"
        if floors > 1:
            rows[1 : south[1], 1 : east[1]] = "A"
        if not floor or draw(st.booleans()):
            rows[-1, draw(st.integers(1, east[1] - 1))] = "E"
        text += f"floor {floor + 1}:\n" + "\n".join(map("".join, rows)) + "\n"
    try:
        return Building(maps.parse_map(text))
    except maps.MistakesError:
        assume(False)


@given(
    buildings(),
    st.builds(
        Scenario,
        people=st.integers(0, 20),
        sources=st.integers(0, 3),
        frames_per_tick=st.sampled_from((2, 5, 10, 25)),
        decision_seconds=st.sampled_from((1.0, 5.0)),
        sight_range=st.sampled_from((1.0, 5.0, 12.0)),
        time_limit=st.just(30.0),
    ),
    st.sampled_from(("none", "random", "sweep")),
    st.integers(0, 2**32),
)
@settings(max_examples=12, suppress_health_check=[HealthCheck.too_slow])
def test_nothing_impossible_happens_in_any_building(building, scene, robots, seed):
    """Whatever map `check` accepts; a copy, and a run of many together, end alike."""
    sides = [(ROBOTS[robots](), RandomFire()) for _ in range(3)]
    sim, twin, beside = (
        Simulation(building, scene, *side, seed + k)
        for side, k in zip(sides, (0, 0, 1), strict=True)
    )
    audit(sim)
    wait(twin, 10)
    wait(beside, 10)
    copied = twin.copy()
    run_to_end([twin, beside])
    copied.run()
    assert same(bodies(sim), bodies(copied)) and same(bodies(sim), bodies(twin))
    assert sim.events == copied.events == twin.events


# -- Same seed, same run ------------------------------------------------------------


@pytest.mark.parametrize("robots", ["sweep", "patrol", "random"])
def test_a_copy_runs_on_like_the_original_and_leaves_it_alone(robots):
    """Copied at 12 s, in the middle of everything."""
    sim = run("paper", robots=robots, seed=3)
    wait(sim, 12)
    frozen = bodies(sim)
    events = list(sim.events)
    ahead = sim.copy()
    outcome = ahead.run()
    assert same(bodies(sim), frozen) and sim.events == events
    assert str(sim.run()) == str(outcome)
    assert same(bodies(sim), bodies(ahead)) and sim.events == ahead.events


def test_copies_of_the_standard_library_are_whole_copies():
    """`copy.copy`, too: half a copy would share people and not the clock."""
    sim = run()
    sim.step()
    for other in (copy(sim), deepcopy(sim)):
        assert other.world is not sim.world
        assert same(other.run(), sim.copy().run())


def test_nobody_can_write_into_what_all_runs_share():
    """A strategy that did would change every later run in silence."""
    building = shipped("tiny")
    nav = navigation_of(building)
    sight = sight_of(building, paper.SIGHT_RANGE)
    shared = [burnable(building), cells_around_clearance(building, 0)]
    for tables in (building, nav, sight):
        shared += [one for one in vars(tables).values() if isinstance(one, np.ndarray)]
    assert len(shared) > 10
    for array in shared:
        with pytest.raises(ValueError, match="read-only"):
            array[:] = array


def test_a_robot_has_a_position_of_its_own():
    """Moving it would else move the middle of a cell, for every later run."""
    sim = run(people=0)
    centres = sim.navigation.centres.copy()
    for robot in sim.world.robots:
        robot.position += 0.5
    assert (sim.navigation.centres == centres).all()


def test_another_seed_gives_other_people_and_flames_and_other_robots_do_not():
    """So that strategies are compared on the same emergencies."""
    begun = [run(robots=r, seed=k) for r, k in (("sweep", 0), ("none", 0), ("none", 1))]
    people = [sim.world.bodies.position for sim in begun]
    flames = [sim.spread.delays.data for sim in begun]
    for one, again, other in (people, flames):
        assert np.array_equal(one, again) and not np.array_equal(one, other)


# -- A world that exists already ----------------------------------------------------


@pytest.mark.parametrize("seed", [3, 4])
def test_a_simulation_may_begin_with_a_world_that_exists(seed):
    """Without a fire and a crowd the same comes of it, at the same time."""
    sim = run("paper", fire="none", seed=3, people=3)
    wait(sim, 30)
    robots = deepcopy(sim.robot_strategy)
    other = Simulation(
        sim.building, sim.scenario, robots, seed=seed, world=deepcopy(sim.world)
    )
    assert other.world.time == sim.world.time
    events = len(sim.events)
    sim.run()
    other.run()
    assert other.events == sim.events[events:]


def test_refuses_a_guide_for_a_world_without_robots():
    """It would never be asked, and come out as nobody does."""
    world = run(robots="none").world
    guide = ROBOTS["sweep"]()
    with pytest.raises(InputError, match="nobody can be guided"):
        Simulation(shipped("tiny"), robots=guide, world=world)
    none_wanted = Scenario(robots_per_floor=0)
    Simulation(shipped("tiny"), none_wanted, guide, world=world).step()


# -- Health, time, outcome ----------------------------------------------------------


@pytest.mark.paper("B7")
@pytest.mark.parametrize("frames", [5, 10, 25])
def test_health_falls_with_every_frame(frames):
    """0.01 of 100, half a point a second: after 200 s all are dead without any fire."""
    board = "#p.........E"
    sim = stage(board, frames_per_tick=frames)
    sim.world.bodies.pace[:] = 0
    play(sim, 10)
    lost = paper.HEALTH - sim.world.bodies.health[0]
    assert lost == pytest.approx(paper.HEALTH_RATE * paper.FRAMES_PER_SECOND * 10) == 5
    assert play(sim, 200) == board.replace("p", "x")
    (death,) = sim.events
    assert isinstance(death, Died) and death.time == pytest.approx(200, abs=0.02)
    assert sim.outcome().reward == -paper.FIXED_PENALTY


@pytest.mark.paper("B7")
def test_health_falls_on_the_stairs_too():
    """Half a point a second, as everywhere."""
    sim = stage(LANDING.replace("p", "."))
    people = sim.world.bodies
    play_until(sim, lambda: people.stairwell[0] >= 0)
    before = people.health[0]
    play(sim, 10)
    assert people.stairwell[0] >= 0
    assert before - people.health[0] == pytest.approx(5)


@pytest.mark.paper("B7")
def test_the_dead_stand_in_nobodys_way():
    """Where q has died p walks as if nobody had ever been there."""
    ways = []
    gone = str.maketrans("qx", "..")
    for board in ("#p..q..E", "#p.....E"):
        sim = stage(board, sight_range=8, leads="p")
        sim.world.bodies.health[1:] = 0
        sim.world.bodies.pace[1:] = 0
        ways.append([play(sim, 0.2).translate(gone) for _ in range(20)])
    assert ways[0] == ways[1]


@pytest.mark.parametrize("limit", [20.0, 240.0])
def test_the_outcome_adds_up(limit):
    """People, mean health of who got out, person-seconds, and the reward, by hand."""
    sim = run(seed=6, time_limit=limit)
    inside = 0.0
    before = sim.world.bodies.inside.sum()
    for _ in ticks(sim):
        inside += before * sim.tick
        before = sim.world.bodies.inside.sum()
    outcome = sim.outcome()
    out = [event.health for event in events_of(sim, Evacuated)]
    assert outcome.people == outcome.evacuated + outcome.died + outcome.inside == 20
    assert outcome.mean_health == pytest.approx(np.mean(out))
    assert outcome.person_seconds == pytest.approx(inside)
    earned = sum(event.health for event in events_of(sim, LeftFloor))
    earned += paper.FIXED_REWARD * len(out) - paper.FIXED_PENALTY * outcome.died
    assert outcome.reward == pytest.approx(earned)
    assert (outcome.inside > 0) == (outcome.simulated_seconds == pytest.approx(limit))


def test_an_empty_building_is_done_at_once():
    """Nobody gets out, nobody dies, and there is no mean health."""
    outcome = run(people=0).run()
    assert outcome.simulated_seconds == 0 and isnan(outcome.mean_health)


@pytest.mark.parametrize("frames", [2, 5, 10])
def test_the_length_of_a_tick_does_not_change_the_time_things_take(frames):
    """Twelve metres to the exit at walking speed."""
    said = {"frames_per_tick": frames, "sight_range": 14, "leads": "p"}
    sim = stage("#p............E", **said)
    seconds = sim.run().simulated_seconds
    assert seconds == pytest.approx(12.5 / paper.WALKING_SPEED, abs=1.5)


# -- The beginning ------------------------------------------------------------------


@pytest.mark.paper("B8")
def test_everybody_begins_in_a_room_cell_of_their_own():
    """Spread over the floors, with full health, neither in doors nor on stairs."""
    sim = run("paper", people=200, seed=8)
    now = sim.world.bodies
    assert len(set(now.place.tolist())) == 200
    assert (sim.building.kind.ravel()[now.place] == Kind.FLOOR).all()
    assert np.bincount(now.floor).tolist() == [67, 67, 66]
    assert (now.health == paper.HEALTH).all()


@pytest.mark.paper("A9", "chosen")
@pytest.mark.paper("F8", "chosen")
def test_everybody_has_a_pace_of_their_own():
    """Normally distributed, no farther from the mean than two deviations."""
    pace = run("paper", people=1000).world.bodies.pace
    assert pace.mean() == pytest.approx(paper.WALKING_SPEED, abs=0.03)
    assert pace.std() == pytest.approx(paper.WALKING_SPREAD, rel=0.1)
    off = np.abs(pace - paper.WALKING_SPEED)
    assert off.max() <= 2 * paper.WALKING_SPREAD + 1e-9


@pytest.mark.paper("B8")
def test_people_can_begin_on_some_floors_by_number():
    """As many on each as is said, the lowest floor first."""
    sim = run("paper", people=paper.PEOPLE, people_per_floor=(1, 3, 2))
    assert np.bincount(sim.world.bodies.floor).tolist() == [1, 3, 2]


@pytest.mark.paper("B8")
@pytest.mark.parametrize("rooms", [("1/lobby",), ("1/lobby", "1/store")])
def test_people_can_begin_in_rooms_by_name(rooms):
    """As a teacher says it: twelve in the lobby, or in the lobby and the store."""
    sim = run(people=12, rooms=rooms)
    areas = sim.building.area.ravel()[sim.world.bodies.place]
    assert {sim.building.areas[index].id for index in areas} == {*rooms}


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        ({"people": 5000}, r"2500 people do not fit on floor 1 of 'Tiny office'; "),
        ({"people": 5000}, r"; there is room for \d+\. Ask for fewer"),
        ({"rooms": ("1/attic",)}, "no room '1/attic' in 'Tiny office'"),
    ],
)
def test_refuses_more_people_than_fit_and_rooms_that_do_not_exist(asked, said):
    """With the numbers, or the names."""
    with pytest.raises(ValueError, match=said):
        run(**asked)


# -- Triggers -----------------------------------------------------------------------


LANDING = "#AA+p...E\n\n#AA+q...#"


@pytest.mark.paper("A3", "chosen")
def test_people_wait_on_the_stairs_until_the_entrance_is_free():
    """p stands in it for a while; q comes out only when p has gone."""
    sim = stage(LANDING)
    people = sim.world.bodies
    entrance = sim.building.stairwells[0].entrances[0][0]
    people.pace[0] = 0
    people.position[0] = sim.building.landmarks[entrance].position
    people.place[0] -= 1
    play(sim, paper.stairs_seconds() + 6)
    assert not people.walking[1]
    people.pace[0] = paper.WALKING_SPEED
    play(sim, 3)
    assert people.walking[1] and people.floor[1] == 0


@pytest.mark.paper("A3", "chosen")
def test_who_stands_above_the_entrance_holds_nobody_up():
    """q stands for good above the lower entrance; p comes out on time."""
    sim = stage("#AA+.......E\n\n#A+q......p#", still="q")
    upper = sim.building.stairwells[0].entrances[1][0]
    enter_stairs(sim.world, body("p"), upper)
    play(sim, sim.world.bodies.stairs_until[body("p")] + sim.tick)
    assert sim.world.bodies.walking[body("p")]


@pytest.mark.paper("A3")
@pytest.mark.paper("B7")
@pytest.mark.paper("F8")
def test_who_dies_on_the_stairs_leaves_no_further_floor():
    """p enters them on the third floor and dies before the second; q stays inside."""
    board = "#AA+....q..E\n\n#AA+...+...#\n\n#AA+p......#"
    sim = stage(board, leads="p", still="q", health={"p": 5})
    wait(sim, 80)
    assert [type(event) for event in sim.events] == [LeftFloor, Died]


FOOT = """
    #########
    #AA+...pE
    #AA+...q#
    #AA#...r#
    #AA+....#
    #########

    #########
    #AA+....#
    #AA+...s#
    #AA#....#
    #AA+....#
    #########
    """


@pytest.mark.paper("A3", "chosen")
@pytest.mark.parametrize(("standing", "row"), [("", 1), ("p", 2), ("pq", 4)])
def test_who_comes_down_steps_out_into_the_first_free_cell(standing, row):
    """Of both entrances; r is out of the way."""
    sim = stage(FOOT, still="pqr")
    people = sim.world.bodies
    for letter, taken in zip(standing, (1, 2), strict=False):
        people.place[body(letter)] -= 4
        people.position[body(letter)] = sim.building.metres(taken, 3)
    s = body("s")
    enter_stairs(sim.world, s, sim.building.stairwells[0].entrances[1][0])
    people.stairs_until[s] = sim.tick
    sim.step()
    assert (people.walking[s], people.floor[s]) == (True, 0)
    assert sim.building.cell(*people.position[s]) == (row, 3)


@pytest.mark.paper("A3")
def test_whoever_goes_down_a_stairwell_comes_out_of_the_same():
    """p by A and q by B; on the stairs each is in a cell of theirs."""
    sim = stage("#AA+......+BB#\n\n#AA+.p..q.+BB#")
    people = sim.world.bodies
    cells = []
    for i, well in enumerate(sim.building.stairwells):
        enter_stairs(sim.world, i, *well.entrances[1])
        people.stairs_until[i] = sim.tick
        cells.append(sim.building.cell(*people.position[i]))
    sim.step()
    assert people.walking.all() and not people.floor.any()
    assert [sim.building.signs[0, row, col] for row, col in cells] == ["A", "B"]
    out = [sim.building.cell(*position) for position in people.position]
    assert out == [(1, 3), (1, 10)]


@pytest.mark.paper("A3", "chosen")
def test_two_who_enter_the_stairs_together_pass_every_landing_together():
    """Three landings and 20.1 s a flight, to the tick: the second flight begins when
    the first ends, between two ticks."""
    floor = "#AA+.....#"
    sim = stage("\n\n".join([floor[:-1] + "E", *3 * [floor], "#AA+.pq..#"]))
    people = sim.world.bodies
    people.pace[:] = 1.0
    flight = paper.stairs_metres() / 1.0
    assert flight % sim.tick == pytest.approx(sim.tick / 2)
    for i in (0, 1):
        enter_stairs(sim.world, i, sim.building.stairwells[0].entrances[4][0])
    play_until(sim, lambda: not people.floor.any())
    assert (people.place < sim.navigation.floor_size).all()
    for i in (0, 1):
        passed = [event.time for event in sim.events if event.person == i]
        late = np.subtract(passed, flight * np.arange(1, 4))
        assert ((late > -1e-6) & (late < sim.tick)).all()


@pytest.mark.paper("A3", "chosen")
def test_the_slow_take_longer_on_the_stairs():
    """STAIRS_SECONDS at the mean pace, twice that at half of it."""
    seconds = []
    for pace in (paper.WALKING_SPEED, paper.WALKING_SPEED / 2):
        sim = stage(LANDING.replace("p", "."))
        sim.world.bodies.pace[0] = pace
        play_until(sim, lambda sim=sim: sim.world.bodies.stairwell[0] >= 0)
        seconds.append(sim.world.bodies.stairs_until[0] - sim.world.time)
    assert seconds == pytest.approx(
        [paper.stairs_seconds(), 2 * paper.stairs_seconds()], abs=sim.tick
    )


PARLOUR = """
    ###########
    #.........#
    #.........#
    #.........E
    #.........E
    #.........#
    #.........#
    ###########
    """


class NeverFull(Simulation):
    """Doors let everybody through as they come."""

    def fill_doors(self, touched):
        """Fill nothing."""


@pytest.mark.paper("A5", "deviation")
@pytest.mark.parametrize("frames", [2, 10])
def test_an_exit_lets_a_limited_flow_through(frames):
    """DOOR_FLOW people per second and metre, whatever the tick."""
    scene = Scenario(people=48, sight_range=14, frames_per_tick=frames)
    seconds = []
    for kind in (Simulation, NeverFull):
        sim = kind(built(PARLOUR), scene)
        sim.run()
        times = [event.time for event in events_of(sim, Evacuated)]
        assert len(times) == 48
        seconds.append(times[-1] - times[0])
    least = 47 / (2 * paper.DOOR_FLOW) - sim.tick
    assert 1.1 * least > seconds[0] >= least > 1.4 * seconds[1]


@pytest.mark.paper("A5", "deviation")
@pytest.mark.paper("A4")
def test_two_who_pass_an_exit_in_one_tick_are_both_out_and_fill_it_twice():
    """They leave through it side by side; two metres have room again after a while."""
    sim = stage("####\n#p.E\n#q.E\n####", leads="pq")
    play_until(sim, lambda: events_of(sim, Evacuated))
    now = sim.world.time
    out = [(event.person, event.time) for event in events_of(sim, Evacuated)]
    assert out == [(0, now), (1, now)]
    full = sim.full_until[0] - (now - sim.tick)
    assert full == pytest.approx(2 / (2 * paper.DOOR_FLOW))


@pytest.mark.paper("A5", "deviation")
def test_an_exit_that_became_free_during_a_tick_is_full_from_then_on():
    """q leaves a tick after p; four metres had room again a little before."""
    sim = stage("####\n#p.E\n#..E\n#..E\n#q.E\n####", leads="pq")
    sim.world.bodies.position[body("q"), 0] -= 0.25
    play_until(sim, lambda: len(events_of(sim, Evacuated)) == 2)
    one, other = (event.time for event in events_of(sim, Evacuated))
    assert other == pytest.approx(one + sim.tick)
    full = sim.full_until[0] - (one - sim.tick)
    assert full == pytest.approx(2 / (4 * paper.DOOR_FLOW))


@pytest.mark.paper("A5", "deviation")
def test_stairs_let_fewer_people_through_than_doors():
    """STAIRS_FLOW people per second and metre, here from a queue before them."""
    sim = stage("#AA+...........E\n\n#AA+pqrstuvwxyz#", sight_range=14)
    sim.run()
    times = [event.time for event in events_of(sim, LeftFloor) if event.floor == 1]
    assert len(times) == 11
    assert times[-1] - times[0] >= 10 / paper.STAIRS_FLOW - sim.tick


@pytest.mark.paper("A5", "deviation")
def test_a_full_door_lets_nobody_in_but_who_is_there():
    """p stands in it, q before it."""
    sim = stage("#p.q+...E", at="p+")
    full = np.array([True, False, False])  # the door, the exit, no landmark
    door = np.array([sim.building.landmarks[0].position] * 2)
    free = free_for(sim.world, np.arange(2), full)
    assert free(door, np.arange(2)).tolist() == [True, False]


@pytest.mark.paper("A5", "deviation")
def test_who_is_in_a_full_door_walks_on():
    """It is full for others: p, who fills it, does not slow down in it."""
    sim = stage("#p..+....E")
    play_until(sim, lambda: sim.world.minds[0].doors)
    assert sim.full_until[0] > sim.world.time
    assert not sim.full_until[1:].any()  # no other door is
    x = sim.world.bodies.position[0, 0]
    play(sim, 0.6)
    walked = sim.world.bodies.position[0, 0] - x
    assert walked == pytest.approx(0.6 * paper.WALKING_SPEED, rel=0.05)
