"""What an agent sees, as a picture: the arrays, and every number explained."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from matplotlib.transforms import Affine2D, Bbox
from movies import wait
from pages import overlaps

from reference.game import observations
from reference.paper import Scenario
from reference.simulation import Simulation
from reference.strategies import NoFire, NoRobots
from reference.workshop import decoding, drawing
from reference.workshop.drawing import page, senses
from reference.workshop.maps import load
from reference.workshop.strategies.fires import GreedyFire
from reference.workshop.strategies.robots import Sweep


def after(building, seconds):
    """A simulation with people, robots and fires, some of them gone."""
    simulation = Simulation(building, Scenario(), Sweep(), GreedyFire(), seed=3)
    wait(simulation, seconds)
    return simulation


@pytest.fixture(scope="module")
def simulation():
    """Half a minute in the paper's building."""
    return after(load("paper"), 30)


@pytest.fixture(scope="module")
def robot_page(simulation):
    """What its first robot observes."""
    return drawing.robot_senses(simulation.world, simulation.scenario)


@pytest.fixture(scope="module")
def fire_page(simulation):
    """What its fire observes."""
    return drawing.fire_senses(simulation.world, simulation.scenario)


def seen_by(simulation, robot):
    """What a robot is given, with its meaning."""
    world, scenario = simulation.world, simulation.scenario
    vector = observations.robot_vectors(world, scenario)[robot]
    return senses.Senses(
        "",
        "R1",
        world.building,
        observations.grid(world),
        vector,
        decoding.decode(vector, world.building, scenario),
        observations.vector_layout(world.building, scenario).slots,
    )


def images(figure):
    """The arrays of the grid's channels, in order, by their titles."""
    named = {axes.get_title("left"): axes for axes in figure.axes}
    return {
        title: np.asarray(axes.images[0].get_array())
        for title, axes in named.items()
        if title[:1].isdigit()
    }


# -- The grid -----------------------------------------------------------------------


@pytest.mark.paper("C3")
def test_every_channel_is_drawn_as_it_is_given(simulation, robot_page):
    """Nine images with the very cells of the grid, each named by kind and floor."""
    cells, drawn = observations.grid(simulation.world), images(robot_page)
    assert list(drawn)[3:5] == ["3: fires, floor 1", "4: fires, floor 2"]
    np.testing.assert_array_equal(np.stack(list(drawn.values())), cells)


@pytest.mark.paper("C3")
def test_entrances_that_stand_for_exits_are_in_the_legend(robot_page):
    """The upper floors of the paper's building have no exit of their own."""
    legend = [text.get_text() for text in robot_page.legends[0].get_texts()]
    assert legend[-2:] == ["exit", "stairwell entrance"]


# -- The points ---------------------------------------------------------------------


@pytest.mark.paper("C4")
def test_people_on_the_observers_floor_are_numbered_by_distance(simulation):
    """1 is the nearest; R1 is the observer itself."""
    robot = simulation.world.robots[2]
    me, *others = senses.dots(seen_by(simulation, 2), robot.floor)
    people = [dot for dot in others if dot.look == "human"]
    assert (me.look, me.mark) == ("the observer", "R1")
    assert [dot.mark for dot in people] == [str(k + 1) for k in range(len(people))]
    away = [np.hypot(dot.x - me.x, dot.y - me.y) for dot in people]
    assert len(away) > 2
    assert away == sorted(away)


@pytest.mark.paper("C1")
def test_every_point_inside_is_on_its_floor_and_nobody_else_is(simulation):
    """People and fires by floor, counted against the world; the gone nowhere."""
    world, seen = simulation.world, seen_by(simulation, 0)
    for floor in range(3):
        looks = [dot.look for dot in senses.dots(seen, floor)]
        bodies = world.bodies
        people = (bodies.inside & (bodies.floor == floor)).sum()
        fires = sum(source.floor == floor for source in world.flames.sources)
        assert (looks.count("human"), looks.count("fire source")) == (people, fires)
    assert 0 < (~world.bodies.inside).sum() < 40


@pytest.mark.paper("D1")
def test_the_fire_sees_people_under_their_own_numbers(simulation, fire_page):
    """At its very place; and the fires that burn, as the robots see them."""
    bodies = simulation.world.bodies
    person = np.flatnonzero(bodies.inside & (bodies.floor == 2))[-1]
    axes = next(a for a in fire_page.axes if a.get_title("left").startswith("Floor 3"))
    spots = np.array([line.get_xydata()[0] for line in axes.lines])
    assert np.abs(spots - bodies.position[person]).max(axis=1).min() < 1e-4
    marks = {text.get_text(): text.xy for text in axes.texts}
    for mark in marks.keys() & {str(k + 1) for k in range(len(bodies))}:
        assert marks[mark] == pytest.approx(bodies.position[int(mark) - 1], abs=1e-4)
    legend = [text.get_text() for text in fire_page.legends[0].get_texts()]
    assert {"human", "robot", "fire source", "in flames"} <= set(legend)


spots = st.lists(st.tuples(st.integers(0, 60), st.integers(0, 60)), max_size=25)


def labelled(places):
    """A small panel, in points, with marks at places; the texts of those with room."""
    figure = page.blank(70 / 72, 70 / 72)
    axes = figure.add_axes((0, 0, 1, 1), xlim=(0, 70), ylim=(0, 70))
    axes.plot(*np.reshape(places, (-1, 2)).T, "o", ms=4, mew=0)
    marks = [str(k) for k in range(len(places))]
    senses.write_marks(axes, places, marks)
    return axes.texts


@settings(max_examples=8, deadline=None)
@given(spots)
def test_no_mark_lies_on_another_or_on_a_point(places):
    """Whatever the crowd: who finds no room goes without, the others can be read."""
    texts = labelled(places)
    boxes = [text.get_window_extent() for text in texts]
    points = [Bbox.from_extents(x - 2, y - 2, x + 2, y + 2) for x, y in places]
    dot = Affine2D().scale(page.DPI / 72)
    boxes += [box.transformed(dot) for box in points]
    marks = boxes[: len(texts)]
    assert not any(a is not b and a.overlaps(b) for a in marks for b in boxes)


def test_a_mark_stands_right_of_a_lonely_point():
    """The first choice, near; and inside the panel, else at the left."""
    lonely, edge = (text.xyann for text in labelled([(30, 30), (68, 30)]))
    assert 3 < lonely[0] < 8
    assert -8 < edge[0] < -3


def test_on_the_fires_page_no_robot_is_the_observer(simulation):
    """All robots look alike to it."""
    figure = drawing.fire_senses(simulation.world, simulation.scenario)
    legend = [text.get_text() for text in figure.legends[0].get_texts()]
    assert "robot" in legend
    assert "the observer" not in legend


# -- The table ----------------------------------------------------------------------


@pytest.mark.paper("C1")
@pytest.mark.paper("C2")
def test_the_table_explains_all_167_numbers(simulation):
    """Each number is in one line; the words are those of the layout."""
    lines = senses.table(seen_by(simulation, 0))
    assert [(line.numbers, line.marks, line.what) for line in lines] == [
        ("0 to 119", "1 to 40", "human: x, y, storey (m, m, storey)"),
        ("120 to 137", "R1 to R6", "robot: x, y, storey (m, m, storey)"),
        ("138", "", "robots of the team at work"),
        ("139", "", "time since the beginning (s)"),
        ("140 to 163", "F1 to F8", "fire source: x, y, storey (m, m, storey)"),
        ("164 to 166", "", "fire sources on floor 1, …"),
    ]


@pytest.mark.paper("C1")
def test_the_table_tells_what_the_first_numbers_are_now(simulation):
    """As they stand in the vector, and how many of the points are gone."""
    seen = seen_by(simulation, 0)
    by_what = {line.what.split(":")[0]: line.values for line in senses.table(seen)}
    gone = (~simulation.world.bodies.inside).sum()
    assert by_what["human"].endswith(f"…, {gone} not there")
    x, y, storey = seen.vector[120:123]
    me = f"({x:.3g}, {y:.3g}, {storey:g})".replace("-", "−")
    assert by_what["robot"].startswith(me)
    assert by_what["robots of the team at work"] == "2"


# -- The page -----------------------------------------------------------------------


@pytest.mark.parametrize("name", ["tower", "maze"])
@pytest.mark.slow
def test_all_can_be_read_in_any_building(name):
    """One storey or five, wide or tall: nothing overlaps and nothing is clipped."""
    now = after(load(name), 1)
    assert_readable(drawing.robot_senses(now.world, now.scenario))


def test_all_can_be_read_in_the_papers_building(robot_page, fire_page):
    """Three tall floors, for a robot and for the fire."""
    assert_readable(robot_page)
    assert_readable(fire_page)


def assert_readable(figure):
    """No words on others, and all of them on the page."""
    assert overlaps(figure) == []
    (width, height), box = figure.get_size_inches(), figure.get_tightbbox()
    assert 0 <= box.x0 < box.x1 <= width
    assert 0 <= box.y0 < box.y1 <= height


def test_refuses_a_robot_that_is_not_there(simulation):
    """The message counts as the agents' names do."""
    with pytest.raises(ValueError, match=r"no robot 6 among 6.*robot_0"):
        drawing.robot_senses(simulation.world, simulation.scenario, robot=6)


def test_a_world_without_robots_and_fires_can_be_seen_by_the_fire():
    """Before anything burns, and with nobody to guide."""
    building = load("tiny")
    simulation = Simulation(building, Scenario(), NoRobots(), NoFire(), seed=1)
    figure = drawing.fire_senses(simulation.world, simulation.scenario)
    legend = [text.get_text() for text in figure.legends[0].get_texts()]
    assert legend == ["human", "wall", "exit", "stairwell entrance"]
