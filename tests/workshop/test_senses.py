"""What an agent sees, as a picture: the arrays, and every number explained."""

import numpy as np
import pytest
from movies import wait
from pages import overlaps

from reference.game import observations
from reference.paper import Scenario
from reference.simulation import Simulation
from reference.strategies import NoFire, NoRobots
from reference.workshop import drawing
from reference.workshop.drawing import senses
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


# -- The grid -----------------------------------------------------------------------


@pytest.mark.paper("C3")
def test_every_channel_is_drawn_as_it_is_given(simulation, robot_page):
    """Nine images with the very cells of the grid, each named by kind and floor."""
    shown = {axes.get_title("left"): axes.images[0] for axes in robot_page.axes[:-1]}
    names = sorted(name for name in shown if name[0].isdigit())
    assert names[3:5] == ["3: fires, floor 1", "4: fires, floor 2"]
    cells = np.stack([shown[name].get_array() for name in names])
    np.testing.assert_array_equal(cells, observations.grid(simulation.world))


@pytest.mark.paper("C3")
def test_entrances_that_stand_for_exits_are_in_the_legend(robot_page):
    """The upper floors of the paper's building have no exit of their own."""
    legend = [text.get_text() for text in robot_page.legends[0].get_texts()]
    assert legend[-2:] == ["exit", "stairwell entrance"]


# -- The points ---------------------------------------------------------------------


def drawn(figure, floor):
    """(k, 2) places of the points on a floor, by what they are."""
    axes = next(
        a for a in figure.axes if a.get_title("left").startswith(f"Floor {floor}")
    )
    return {line.get_label(): line.get_xydata() for line in axes.lines}, axes.texts


@pytest.mark.paper("C4")
def test_human_1_is_the_nearest_to_the_robot(simulation):
    """On its own floor; it is the only one with a number."""
    robot = simulation.world.robots[2]
    figure = drawing.robot_senses(simulation.world, simulation.scenario, robot=2)
    points, (one,) = drawn(figure, robot.floor + 1)
    away = np.hypot(*(points["human"] - points["the observer"]).T)
    assert (one.get_text(), len(away) > 2) == ("1", True)
    np.testing.assert_allclose(one.xy, points["human"][away.argmin()])


@pytest.mark.paper("C1")
@pytest.mark.paper("D1")
def test_every_point_inside_is_on_its_floor_and_nobody_else_is(simulation, fire_page):
    """People and fires by floor, at their very places; the gone nowhere."""
    world = simulation.world
    bodies = world.bodies
    for floor in range(3):
        points, _ = drawn(fire_page, floor + 1)
        people = bodies.position[bodies.inside & (bodies.floor == floor)]
        np.testing.assert_allclose(points["human"], people, atol=1e-4)
        fires = sum(source.floor == floor for source in world.flames.sources)
        assert len(points.get("fire source", [])) == fires
    assert 0 < (~bodies.inside).sum() < 40


def test_on_the_fires_page_no_robot_is_the_observer(fire_page):
    """All robots look alike to it."""
    legend = {text.get_text() for text in fire_page.legends[0].get_texts()}
    assert {"human", "robot", "fire source", "in flames"} <= legend
    assert "the observer" not in legend


# -- The table ----------------------------------------------------------------------


@pytest.mark.paper("C1")
@pytest.mark.paper("C2")
def test_the_table_explains_all_167_numbers(simulation):
    """Each is in one line, with the words of the layout and the first values."""
    world, scenario = simulation.world, simulation.scenario
    vector = observations.robot_vectors(world, scenario)[0]
    layout = observations.vector_layout(world.building, scenario)
    lines = senses.table(vector, layout.blocks.values())
    assert [line[:2] for line in lines] == [
        ("0 to 119", "40 × human: x, y, storey (m, m, storey)"),
        ("120 to 137", "6 × robot: x, y, storey (m, m, storey)"),
        ("138", "robots of the team at work"),
        ("139", "time since the beginning (s)"),
        ("140 to 163", "8 × fire source: x, y, storey (m, m, storey)"),
        ("164 to 166", "3 × fire sources on floor"),
    ]
    people, robots, team, *_ = (values for *_, values in lines)
    x, y, storey = vector[120:123]
    assert robots.startswith(f"({x:.3g}, {y:.3g}, {storey:g})".replace("-", "−"))
    assert people.endswith(f"…, {(~world.bodies.inside).sum()} not there")
    assert team == "2"


# -- The page -----------------------------------------------------------------------


@pytest.mark.parametrize("name", ["tower", "maze"])
@pytest.mark.slow
def test_all_can_be_read_in_any_building(name):
    """One storey or five, wide or tall: nothing overlaps and nothing is clipped."""
    now = after(load(name), 1)
    assert overlaps(drawing.robot_senses(now.world, now.scenario)) == []


def test_all_can_be_read_in_the_papers_building(robot_page, fire_page):
    """Three tall floors, for a robot and for the fire."""
    assert overlaps(robot_page) == overlaps(fire_page) == []


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
