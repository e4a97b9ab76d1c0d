"""What agents observe: number by number, cell by cell, in the observer's order."""

from functools import cache
from itertools import groupby
from types import SimpleNamespace

import numpy as np
import pytest
from movies import Script, play_until, shipped, stage, wait

from reference import paper
from reference.fire import RandomFire
from reference.game import observations
from reference.game.observations import from_normalised
from reference.paper import Scenario
from reference.robots import NoRobots
from reference.simulation import Simulation
from reference.workshop.anchors.frame import robot_destinations, to_normalised
from reference.workshop.strategies.guides import Sweep
from reference.world import Fate, FireLit

BUILDINGS = ["paper", "tiny", "museum", "school", "tower"]

TWO_FLOORS = """
       ##########
    ####q......p#
    #AA+...R....E
    ####........#
       ##########

       ##########
    ####r.......#
    #AA+...R....#
    ####s.......#
       ##########
    """


def scene(name="paper", seed=0, seconds=0.0, **scenario):
    """A simulation of a building that ships, some seconds after its beginning."""
    return played(name, seed, seconds, **scenario).copy()


@cache
def played(name, seed, seconds, **scenario):
    """The same, played once for all tests."""
    sim = Simulation(shipped(name), Scenario(**scenario), Sweep(), RandomFire(), seed)
    wait(sim, seconds)
    return sim


def vectors(sim):
    """(R, V) what the robots observe."""
    layout = observations.vector_layout(sim.building, sim.scenario)
    return observations.robot_vectors([sim.world], layout)[0]


def fire_vector(sim):
    """(V,) what the fire observes."""
    layout = observations.vector_layout(sim.building, sim.scenario)
    return observations.fire_vectors([sim.world], layout)[0, 0]


def decoded(sim, k=0):
    """What robot k observes."""
    return read(sim, vectors(sim)[k])


def fire_decoded(sim):
    """What the fire observes."""
    return read(sim, fire_vector(sim))


def read(sim, vector):
    """The blocks of a vector by name."""
    layout = observations.vector_layout(sim.building, sim.scenario)
    return SimpleNamespace(
        **{name: layout.block_of(vector, name) for name in layout.blocks}
    )


# -- Sizes --------------------------------------------------------------------------


@pytest.mark.parametrize("name", BUILDINGS)
@pytest.mark.parametrize(("people", "robots", "sources"), [(7, 3, 2), (0, 0, 0)])
def test_sizes_follow_from_the_building_and_the_scenario(name, people, robots, sources):
    """Nobody and nothing are empty parts; the `simple` encoder gets 20 x 20."""
    scenario = dict(people=people, robots_per_floor=robots, sources=sources)
    sim = scene(name, seconds=12, **scenario)
    floors = sim.building.floors
    size = 3 * (people + robots * floors + sources) + 1 + 1 + floors
    assert observations.vector_layout(sim.building, sim.scenario).size == size
    assert vectors(sim).shape == (robots * floors, size)
    assert fire_vector(sim).shape == (size,)
    grid = observations.grid(sim.world)
    assert grid.shape == observations.grid_shape(sim.building)
    assert len(grid) == 3 * floors
    assert min(grid.shape[1:]) >= 20


# -- Number by number ---------------------------------------------------------------


def blocks(sim):
    """Where each block of a vector stands."""
    return observations.vector_layout(sim.building, sim.scenario).blocks


def changed(sim, change):
    """The places in robot 0's vector that are different after a change."""
    before = vectors(sim)[0]
    change(sim.world)
    return np.flatnonzero(vectors(sim)[0] != before).tolist()


@pytest.mark.paper("C1", "C2", "C3", "D1")
def test_in_the_paper_all_observe_167_numbers_and_a_grid_of_9_by_40_by_40():
    """40 people, 6 robots, their team, the time, 8 fires, 3 floors: the rows that
    `vector_layout` itself lists."""
    sim = scene()
    found = {name: (b.start, b.stop, b.rows) for name, b in blocks(sim).items()}
    assert found == {
        "humans": (0, 120, 40),
        "robots": (120, 138, 6),
        "team": (138, 139, 1),
        "time": (139, 140, 1),
        "fires": (140, 164, 8),
        "fires_per_floor": (164, 167, 3),
    }
    assert vectors(sim).shape == (6, 167)
    assert fire_vector(sim).shape == (167,)
    assert vectors(sim).dtype == fire_vector(sim).dtype == np.float32
    assert observations.grid(sim.world).shape == (9, 40, 40)


@pytest.mark.paper("C1")
def test_a_change_in_the_world_changes_exactly_its_numbers():
    """A step of human 1 to the north, a source on the second floor, and time."""
    sim = scene()
    here = np.flatnonzero(sim.world.bodies.floor == 0)
    off = sim.world.bodies.position[here] - sim.world.robots[0].position
    metres = np.hypot(*off.T)
    nearest = here[metres.argmin()]

    def move(world):
        world.bodies.position[nearest, 1] += 1e-3

    def light(world):
        world.flames.sources.append(FireLit(0.0, 1, 2.5, -3.5))

    def wait(world):
        world.time += 5.0

    assert changed(sim, move) == [1]
    assert changed(sim, light) == [140, 141, 142, 165]
    assert changed(sim, wait) == [139]
    told = vectors(sim)[0, [139, 140, 141, 142, 165]]
    assert told.tolist() == [5.0, 2.5, -3.5, 1, 1]


@pytest.mark.paper("C1")
def test_fire_sources_come_in_the_order_of_lighting():
    """Wherever they are: the second one lit is on the floor below the others. So many
    are on each floor."""
    sim = scene()
    spots = [(1, 2.5, -3.5), (0, -8.5, 15.5), (1, 4.5, 6.5)]
    sim.world.flames.sources.extend(FireLit(10.0, *spot) for spot in spots)
    fires = decoded(sim).fires
    assert fires[:3].tolist() == [[x, y, floor] for floor, x, y in spots]
    assert (fires[3:] == paper.ABSENT_POINT).all()
    assert decoded(sim).fires_per_floor[:, 0].tolist() == [1, 2, 0]


@pytest.mark.paper("D1", "C1")
def test_the_number_of_robots_at_work_in_the_team_is_there():
    """Three on each floor, none above once all there are out; the fire: of all."""
    sim = scene(robots_per_floor=3)
    place = blocks(sim)["team"].start
    assert (vectors(sim)[:, place] == 3).all()
    assert fire_vector(sim)[place] == 9
    sim.world.bodies.fate[sim.world.bodies.floor == 2] = Fate.EVACUATED
    assert vectors(sim)[:, place].tolist() == [3] * 6 + [0] * 3
    assert fire_vector(sim)[place] == 6


@pytest.mark.paper("C1", "D1")
@pytest.mark.paper("C4", "C8")
def test_worlds_observed_at_once_are_observed_as_if_alone():
    """Their people, robots at work, fires and times are their own."""
    sims = [scene(), scene(seconds=30), scene(seconds=30)]
    bodies = sims[2].world.bodies
    bodies.fate[bodies.floor > 0] = Fate.EVACUATED
    worlds = [sim.world for sim in sims]
    layout = observations.vector_layout(sims[0].building, sims[0].scenario)
    for observed in (observations.robot_vectors, observations.fire_vectors):
        alone = [observed([world], layout)[0] for world in worlds]
        assert not np.array_equal(alone[1], alone[2])
        assert np.array_equal(observed(worlds, layout), alone)


# -- Who is gone --------------------------------------------------------------------


@pytest.mark.paper("C1")
@pytest.mark.parametrize("fate", [Fate.EVACUATED, Fate.DEAD])
def test_who_is_out_or_dead_is_below_the_ground_and_last(fate):
    """Wherever they were; all others move up."""
    sim = stage(TWO_FLOORS)
    sim.world.bodies.fate[0] = fate
    humans = decoded(sim).humans
    assert humans[-1].tolist() == list(paper.ABSENT_POINT)
    assert (humans[:-1] != paper.ABSENT_POINT).any(axis=1).all()


@pytest.mark.paper("C8")
def test_a_robot_whose_work_is_done_is_below_the_ground():
    """The second floor is empty, the first is not."""
    sim = stage(TWO_FLOORS)
    bodies = sim.world.bodies
    bodies.fate[bodies.floor == 1] = Fate.EVACUATED
    below = (decoded(sim, k=0).robots == paper.ABSENT_POINT).all(axis=1)
    assert below.tolist() == [False, True]
    below = (fire_decoded(sim).robots == paper.ABSENT_POINT).all(axis=1)
    assert below.tolist() == [False, True]


def test_who_walks_down_the_stairs_is_seen_there():
    """In the stairwell, on the floor they come from."""
    sim = scene(seconds=30)
    bodies = sim.world.bodies
    person = np.flatnonzero(bodies.inside & (bodies.stairwell >= 0))[0]
    well = sim.building.stairwells[bodies.stairwell[person]]
    humans = decoded(sim).humans
    point = np.float32([*bodies.position[person], bodies.floor[person]])
    assert (humans == point).all(axis=1).any()
    assert np.hypot(*(point[:2] - well.centre)) < 3


# -- The order of the observer ------------------------------------------------------


@pytest.mark.paper("C4", "deviation")
def test_after_the_observer_come_its_team_and_then_the_others():
    """By floors: own, own, then those of the other floors from below."""
    sim = scene(robots_per_floor=2)
    floors = [decoded(sim, k).robots[:, 2].tolist() for k in range(6)]
    assert floors[0] == floors[1] == [0, 0, 1, 1, 2, 2]
    assert floors[2] == floors[3] == [1, 1, 0, 0, 2, 2]
    assert floors[4] == floors[5] == [2, 2, 0, 0, 1, 1]
    for k, robot in enumerate(sim.world.robots):
        first = decoded(sim, k).robots[0].tolist()
        assert first == pytest.approx([*robot.position, robot.floor])


@pytest.mark.paper("C4", "deviation")
def test_people_of_the_own_floor_come_nearest_first():
    """q is 3 m from the robot of its floor, p is 4 m; then those upstairs."""
    sim = stage(TWO_FLOORS)
    bodies = sim.world.bodies
    p, q, r, s = np.column_stack([bodies.position, bodies.floor]).tolist()
    assert decoded(sim, k=0).humans.tolist() == [q, p, r, s]
    assert decoded(sim, k=1).humans.tolist()[2:] == [q, p]


@pytest.mark.paper("C4")
def test_floors_above_come_before_floors_below():
    """Those above still come through, those below will not."""
    sim = scene("tower", seed=1)
    floors = decoded(sim, k=4).humans[:, 2]  # a robot of the third of five floors
    assert [floor for floor, _ in groupby(floors)] == [2, 3, 4, 1, 0]


# -- The fire -----------------------------------------------------------------------


@pytest.mark.paper("D1")
def test_the_fire_keeps_everybody_at_their_own_number():
    """Human 1 is out: nobody moves up; robots stand as numbered, floor by floor."""
    sim = scene(seconds=30)
    sim.world.bodies.fate[0] = Fate.EVACUATED
    bodies = sim.world.bodies
    seen = fire_decoded(sim)
    points = np.column_stack([bodies.position, bodies.floor])
    points[~bodies.inside] = paper.ABSENT_POINT
    assert np.array_equal(seen.humans, np.float32(points))
    assert seen.humans[0].tolist() == list(paper.ABSENT_POINT)
    assert seen.humans[1].tolist() != list(paper.ABSENT_POINT)
    robots = [[*robot.position, robot.floor] for robot in sim.world.robots]
    assert np.array_equal(seen.robots, np.float32(robots))


@pytest.mark.paper("D1")
def test_robots_that_do_not_play_are_below_the_ground():
    """All that the scenario has: the fire's vector is as long as ever."""
    sim = Simulation(shipped("tiny"), Scenario(), NoRobots(), RandomFire())
    assert (fire_decoded(sim).robots == paper.ABSENT_POINT).all()


@pytest.mark.paper("C4", "D1")
@pytest.mark.parametrize("name", BUILDINGS)
def test_robots_and_the_fire_are_told_the_same(name):
    """The same numbers to the last bit, people and robots in whatever order."""
    sim = scene(name, seconds=30)
    fire = fire_decoded(sim)
    for k in range(len(sim.world.robots)):
        robot = decoded(sim, k)
        assert sorted(robot.humans.tolist()) == sorted(fire.humans.tolist())
        assert sorted(robot.robots.tolist()) == sorted(fire.robots.tolist())
        for block in ("fires", "fires_per_floor", "time"):
            assert np.array_equal(getattr(robot, block), getattr(fire, block))
    assert (fire.fires != paper.ABSENT_POINT).any()
    assert fire.time.item() == pytest.approx(30)


@pytest.mark.paper("E4", "deviation")
@pytest.mark.parametrize("name", BUILDINGS)
def test_a_scaled_vector_lies_between_its_bounds(name):
    """-1 is its lower bound, 1 its upper one, from the beginning to the end."""
    sim = scene(name, time_limit=30.1)  # it ends in the middle of a tick
    layout = observations.vector_layout(sim.building, sim.scenario)
    middle = (layout.low + layout.high) / 2
    for vector, wanted in ((layout.low, -1), (middle, 0), (layout.high, 1)):
        assert layout.scaled(vector) == pytest.approx(wanted, abs=1e-6)
        assert layout.scaled(vector).dtype == np.float32
    while not sim.done:
        wait(sim, 5)
        now = layout.scaled(np.stack([fire_vector(sim), *vectors(sim)]))
        assert (np.abs(now) <= 1 + 1e-6).all()
        assert np.unique(now).size > 20
    sim = scene(name, robots_per_floor=0, sources=0)  # both counts can only be 0
    layout = observations.vector_layout(sim.building, sim.scenario)
    assert (np.abs(layout.scaled(fire_vector(sim))) <= 1).all()


@pytest.mark.paper("C5", "D2")
@pytest.mark.parametrize("name", ["paper", "tiny"])
def test_actions_are_in_coordinates_of_the_main_body(name):
    """Its corners are at 1 and -1; not all bodies are as long as they are wide."""
    building = shipped(name)
    left, bottom, right, top = building.body
    assert (name == "paper") == (right - left == top - bottom)
    middle = [(left + right) / 2, (bottom + top) / 2]
    points = np.array([[right, bottom], middle, [left, top]])
    spots = to_normalised(building, points)
    assert spots == pytest.approx(np.array([[1, -1], [0, 0], [-1, 1]]))
    assert from_normalised(building, spots) == pytest.approx(points)


# -- The grid -----------------------------------------------------------------------


def channel(sim, kind, floor):
    """One channel as rows of '.' and '#', its padding left out."""
    k = observations.GRID_KINDS.index(kind) * sim.building.floors + floor
    rows, cols = main_body(sim)
    part = observations.grid(sim.world)[k, :rows, :cols]
    return ["".join(".#"[cell] for cell in row) for row in part]


def main_body(sim):
    """How many rows and columns of cells it has."""
    left, bottom, right, top = sim.building.body
    return int(top - bottom), int(right - left)


@pytest.mark.paper("C3")
def test_the_grid_has_channels_for_walls_and_for_the_way_out():
    """The main body alone: the stairwell lies outside. Where a floor has no exit, the
    stairwell's entrances are the way out."""
    sim = stage(TWO_FLOORS)
    walls = "##########"
    no = "#........#"
    nothing = ".........."
    assert channel(sim, "walls", 1) == [walls, no, ".........#", no, walls]
    for floor, way_out in enumerate((".........#", "#.........")):
        rows = [nothing, nothing, way_out, nothing, nothing]
        assert channel(sim, "exits", floor) == rows


@pytest.mark.paper("C3")
def test_the_grid_has_a_channel_for_what_burns():
    """Cells in flames, north above south, on their floor only; not ash."""
    lower = "#########\n#R.*....E\n#..**...#\n#########"
    upper = "#########\n#R...*,.E\n#.......#\n#########"
    sim = stage(f"{lower}\n\n{upper}")
    none = "." * 9
    assert channel(sim, "fires", 0) == [none, "...#.....", "...##....", none]
    assert channel(sim, "fires", 1) == [none, ".....#...", none, none]


@pytest.mark.paper("C3")
@pytest.mark.parametrize("name", ["tiny", "museum"])
def test_a_small_building_is_padded_with_nothing(name):
    """It fills the north-west corner."""
    sim = scene(name, seconds=30)
    rows, cols = main_body(sim)
    grid = observations.grid(sim.world).copy()
    assert grid[:, 0, :cols].any()
    grid[:, :rows, :cols] = 0
    assert not grid.any()


@pytest.mark.paper("C3")
def test_a_grid_belongs_to_whoever_asked_for_it():
    """Flames of one moment do not stay in the grid of the next."""
    sim = scene(seconds=30)
    before = observations.grid(sim.world)
    assert before[3:6].any()
    before[:] = 7
    calm = scene()
    assert observations.grid(calm.world).max() == 1
    assert not observations.grid(calm.world)[3:6].any()


@pytest.mark.paper("C7", "Alg. 3:3: if a model or a strategy decides now")
def test_a_robot_remembers_where_it_goes_until_it_is_there():
    """Normalised; nan before and on arrival."""
    sim = stage("#p#R.1...E")
    (robot,) = sim.world.robots
    assert np.isnan(robot_destinations(sim.world)).all()
    sim.step()
    (told,) = robot_destinations(sim.world)
    there = sim.building.metres(1, 5)
    assert from_normalised(sim.building, told) == pytest.approx(there)
    play_until(sim, lambda: not robot.way)
    assert np.isnan(robot_destinations(sim.world)).all()


@pytest.mark.paper("C6")
def test_a_destination_is_cut_off_at_the_main_body_like_every_action():
    """The middle of a stairwell lies outside; the second robot is not there yet."""
    building = shipped("paper")
    well = building.stairwells[0].centre
    run = Simulation(building, Scenario(), Script(well))
    run.step()
    _, told, *_ = robot_destinations(run.world)
    spot = to_normalised(building, np.array(well)).clip(-1, 1)
    assert np.abs(spot).max() == 1
    assert told == pytest.approx(spot)
