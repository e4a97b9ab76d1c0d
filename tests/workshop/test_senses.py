"""What an agent sees, as a picture: the arrays, and every number explained."""

import numpy as np
import pytest
from movies import wait
from pages import overlaps

from reference.game import observations
from reference.paper import Scenario
from reference.simulation import Simulation
from reference.workshop import drawing
from reference.workshop.drawing import senses
from reference.workshop.maps import load
from reference.workshop.strategies.fires import GreedyFire
from reference.workshop.strategies.guides import Sweep


@pytest.fixture(scope="module")
def simulation():
    """Half a minute in the paper's building: some people are gone."""
    simulation = Simulation(load("paper"), Scenario(), Sweep(), GreedyFire(), seed=3)
    wait(simulation, 30)
    return simulation


@pytest.fixture(scope="module")
def robot_page(simulation):
    """What its first robot observes."""
    return drawing.robot_senses(simulation.world, simulation.scenario)


@pytest.fixture(scope="module")
def fire_page(simulation):
    """What its fire observes."""
    return drawing.fire_senses(simulation.world, simulation.scenario)


@pytest.mark.paper("C3")
def test_every_channel_is_drawn_as_it_is_given(simulation, robot_page):
    """Nine images with the very cells of the grid, each named by kind and floor."""
    shown = {axes.get_title("left"): axes.images[0] for axes in robot_page.axes[:-1]}
    names = sorted(name for name in shown if name[0].isdigit())
    assert names[3:5] == ["3: fires, floor 1", "4: fires, floor 2"]
    cells = np.stack([shown[name].get_array() for name in names])
    np.testing.assert_array_equal(cells, observations.grid(simulation.world))


@pytest.mark.paper("C1")
@pytest.mark.paper("D1")
def test_every_point_inside_is_on_its_floor_and_nobody_else_is(simulation, fire_page):
    """People and fires by floor, at their very places; the gone nowhere."""
    world = simulation.world
    bodies = world.bodies
    panels = [axes for axes in fire_page.axes if "Floor" in axes.get_title("left")]
    for floor in range(3):
        points = {line.get_label(): line.get_xydata() for line in panels[floor].lines}
        people = bodies.position[bodies.inside & (bodies.floor == floor)]
        np.testing.assert_allclose(points["human"], people, atol=1e-4)
        fires = sum(source.floor == floor for source in world.flames.sources)
        assert len(points.get("fire source", [])) == fires
        assert "the observer" not in points
    assert 0 < (~bodies.inside).sum() < 40


@pytest.mark.paper("C1")
@pytest.mark.paper("C2")
def test_the_table_explains_all_167_numbers(simulation):
    """Each is in one line, with the words of the layout and the first values."""
    world = simulation.world
    scenario = simulation.scenario
    layout = observations.vector_layout(world.building, scenario)
    vector = observations.robot_vectors([world], layout)[0, 0]
    lines = senses.number_table(vector, layout.blocks.values())
    assert [line[:2] for line in lines] == [
        ("0 to 119", "40 × human: x, y, storey (m, m, storey)"),
        ("120 to 137", "6 × robot: x, y, storey (m, m, storey)"),
        ("138", "1 × robots of the team at work (count)"),
        ("139", "1 × time since the beginning (s)"),
        ("140 to 163", "8 × fire source: x, y, storey (m, m, storey)"),
        ("164 to 166", "3 × fire sources on floor (count)"),
    ]
    x, y, storey = vector[120:123]
    assert lines[1][2].startswith(f"{x:.3g}, {y:.3g}, {storey:g}, ")
    assert lines[2][2] == "2"


def test_all_can_be_read_in_the_papers_building(robot_page, fire_page):
    """Three tall floors, for a robot and for the fire."""
    assert overlaps(robot_page) == overlaps(fire_page) == []


@pytest.mark.parametrize("name", ["paper", "tiny"])
def test_no_sheet_is_mostly_blank(name):
    """A plan is as large as its grids, or larger; rows and columns are named."""
    scenario = Scenario(people=4)
    world = Simulation(load(name), scenario, seed=0).world
    figure = drawing.fire_senses(world, scenario)
    figure.draw_without_rendering()
    plan, walls = figure.axes[:2]
    assert plan.get_window_extent().width > 0.9 * walls.get_window_extent().width
    assert (walls.get_xlabel(), walls.get_ylabel()) == ("column", "row")
    of_floor = plan.get_window_extent().height * world.building.floors
    assert of_floor > figure.bbox.height / 3
