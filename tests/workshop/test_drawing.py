"""Pictures: what is where on the page, what is refused, and films that end well."""

import os
import re
import time
import warnings
from collections import Counter
from dataclasses import replace
from functools import cache
from itertools import combinations, pairwise
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_rgb
from matplotlib.text import Text
from movies import shipped
from pages import overlaps, to_lab, words, writing
from PIL import Image, ImageSequence
from scipy.spatial import KDTree

from reference.building import Building, Kind, building_of
from reference.fire import NoFire, RandomFire
from reference.paper import InputError, Scenario
from reference.robots import NoRobots
from reference.simulation import Simulation
from reference.workshop import drawing
from reference.workshop.drawing import film, plans, web_film
from reference.workshop.drawing.evacuation import (
    CURVES,
    INKS,
    NUMBERED,
    STEPS,
    TRAIL,
    TRAIL_SECONDS,
    Scene,
    tally,
)
from reference.workshop.drawing.page import COLOURS, MEANINGS, extent_of, sheet
from reference.workshop.drawing.relief import SOLID, add_boxes, lift_of, project
from reference.workshop.maps import find_map, load, plan_of
from reference.workshop.maps.generated import generated_text
from reference.workshop.strategies.guides import Sweep
from reference.world import Fate, Mode

TINY = shipped("tiny")
VIEWS = ("top", "oblique", "walkable", "closeup", "graph", "anchors")


MAPS = {
    "many rooms": building_of(generated_text(7, 60, 30, 4)),
    "many floors": building_of(generated_text(5, 20, 14, 30)),
}


@cache
def drawn(view, name):
    """A view of a building above, or that ships, drawn once for all who look at it."""
    return getattr(drawing, view)(MAPS.get(name) or shipped(name))


def empty(high, wide):
    """A house of one room, with an exit in the middle of its south."""
    inner = wide - 2
    rows = ["#" * wide, *[f"#{'.' * inner}#"] * (high - 2)]
    rows.append(f"{'#' * (inner // 2)}E".ljust(wide, "#"))
    plan = "\n".join(rows)
    return load(f"building: Hall\nsize: {wide} x {high}\nfloor 1: entry\n{plan}\n")


CORRIDOR = empty(7, 200)


def evacuation(limit=6.0, building=TINY, **rule):
    """Some seconds, in which everything happens that can be drawn."""
    rule = Scenario(people=8, robots_per_floor=1, time_limit=limit, **rule)
    return Simulation(building, rule, Sweep(), RandomFire(), seed=1)


@pytest.fixture
def simulation():
    """Six seconds in two small floors."""
    return evacuation()


def frames(gif):
    """The pictures of a film, and what the last one says of itself."""
    with Image.open(gif) as film:
        shown = [np.array(f.convert("RGB")) for f in ImageSequence.Iterator(film)]
        return shown, film.info


def assert_on_page(figure):
    """Nothing of a figure is clipped by the edges of its page."""
    figure.draw_without_rendering()
    width, height = figure.get_size_inches()
    box = figure.get_tightbbox()
    assert 0 <= box.x0 < box.x1 <= width
    assert 0 <= box.y0 < box.y1 <= height


def colour_at(axes, x, y):
    """The colour of the page at a place of some axes."""
    canvas = FigureCanvasAgg(axes.figure)
    canvas.draw()
    image = np.asarray(canvas.buffer_rgba())[::-1, :, :3] / 255
    across, up = axes.transData.transform((x, y)).astype(int)
    return image[up, across]


# -- Buildings ----------------------------------------------------------------------


@pytest.mark.paper("A8", "Figs. 4-6")
def test_every_cell_has_the_colour_of_its_kind_at_its_place_in_metres():
    """Walls are dark, doors blue, entrances purple, exits green: where they stand."""
    axes = drawn("top", "tiny").axes[0]
    for kind in Kind:
        x, y = TINY.metres(*np.argwhere(TINY.kind[0] == kind)[0])
        colour = colour_at(axes, x - 0.4, y + 0.4)
        np.testing.assert_allclose(colour, to_rgb(COLOURS[kind]), atol=0.01)


def test_the_legend_names_no_kind_that_does_not_occur():
    """The museum has one floor, so that no stairs lead anywhere."""
    for view, kinds in (("top", "wall floor door exit"), ("graph", "room door exit")):
        (legend,) = drawn(view, "museum").legends
        assert " ".join(text.get_text() for text in legend.get_texts()) == kinds


@pytest.mark.paper("A8")
@pytest.mark.parametrize("view", VIEWS)
@pytest.mark.parametrize("name", ["paper", "tower", "maze", "school"])
def test_nothing_is_clipped_in_any_view_of_any_building(name, view):
    """One storey or five, wide or tall: all that is drawn lies inside its page."""
    assert_on_page(drawn(view, name))


@pytest.mark.paper("A8", "Figs. 4-6")
def test_every_name_lies_inside_its_room():
    """All four corners of the writing are in the room that is written on."""
    institute = shipped("paper")
    figure = drawn("top", "paper")
    figure.draw_without_rendering()
    named = [area for area in institute.areas if not area.name.startswith("room-")]
    for area in named:
        axes = figure.axes[area.floor]
        text = next(t for t in axes.texts if t.get_text() == area.name)
        box = text.get_window_extent().transformed(axes.transData.inverted())
        for x, y in box.corners():
            assert institute.area[(area.floor, *institute.cell(x, y))] == area.index
    assert len(named) > 30


def test_robots_on_one_spot_are_counted_and_letters_of_stairwells_are_over_people():
    """One of eight would be seen; a robot in the middle of stairs hides no letter."""
    run = Simulation(TINY, Scenario(people=4, robots_per_floor=3), Sweep())
    (panel,) = (scene := Scene(TINY, 4)).sides
    robots = run.world.robots
    for robot, x in zip(robots, [0, 0.3, 5, 0, 0.2, 0.1], strict=True):
        robot.position = np.array([x, 0.0])
    scene.show(run.world, [tally(run.world)])
    there = {
        count: signs[0].get_xydata().tolist() for count, signs in panel.counts.items()
    }
    shown = {count: spots for count, spots in there.items() if spots}
    first = [panel.on_page(robot.floor, robot.position).T.tolist() for robot in robots]
    assert shown == {2: first[0], 3: first[3]}

    order = scene.moving.index
    for signs in panel.letters:
        assert len(signs[0].get_xydata()) == TINY.floors
        assert order(signs[0]) > max(map(order, panel.people.values()))


def test_more_robots_on_one_spot_than_a_digit_counts_are_nine_and_more():
    """Twelve in an exit are not called nine."""
    run = Simulation(TINY, Scenario(people=4, robots_per_floor=12), Sweep())
    (panel,) = (scene := Scene(TINY, 4)).sides
    for robot in run.world.robots:
        robot.position = np.zeros(2)
    scene.show(run.world, [tally(run.world)])
    (signs,) = (signs for signs in panel.counts.values() if len(signs[0].get_xdata()))
    assert len(signs[0].get_xdata()) == TINY.floors
    wide, high = np.ptp(signs[0].get_marker().vertices, axis=0)
    assert wide > 1.5 * high


def test_a_robot_in_an_exit_of_the_outer_wall_is_drawn_whole():
    """It reaches beyond the floor."""
    museum = shipped("museum")
    run = Simulation(museum, Scenario(people=0, robots_per_floor=1), Sweep())
    (exit_,) = (mark for mark in museum.landmarks if mark.kind is Kind.EXIT)
    run.world.robots[0].position = np.array(exit_.position)
    (side,) = scene_of(run.world).sides
    (x,), _ = side.on_page(0, exit_.position)
    low, _ = side.axes.get_ylim()
    assert colour_at(side.axes, x, low - 0.1).max() < 0.5


@pytest.mark.paper("A2")
def test_the_drawn_graph_has_all_nodes_and_its_edges_never_cross_a_wall():
    """An edge leads from a door round the corners of a room to its node."""
    institute = shipped("paper")
    figure = drawn("graph", "paper")
    assert {area.name for area in institute.areas} <= set(writing(figure))
    starts = Counter[tuple[float, float]]()
    for floor, axes in enumerate(figure.axes):
        for way in (line.get_xydata() for line in axes.lines):
            starts[tuple(way[0])] += len(way) > 1
            for start, end in pairwise(way):
                for x, y in np.linspace(start, end, 40):
                    assert institute.kind[(floor, *institute.cell(x, y))] >= Kind.FLOOR
    exits = sum(mark.kind is Kind.EXIT for mark in institute.landmarks)
    assert set(+starts) == {mark.position for mark in institute.landmarks}
    assert starts.total() == 2 * len(institute.landmarks) - exits


@pytest.mark.paper("A2")
@pytest.mark.parametrize("name", ["museum", "paper"])
def test_the_drawn_graph_numbers_its_ways_in_the_wall_beside_them(name):
    """As their ids do; no number lies on another, or on a way."""
    building = shipped(name)
    spots = set()
    ids = []
    figure = drawn("graph", name)
    for floor, axes in enumerate(figure.axes):
        numbers = [text for text in axes.texts if text.get_text().isdigit()]
        marks = [mark for mark in building.landmarks if mark.floor == floor]
        for mark, text in zip(marks, numbers, strict=True):
            x, y = text.get_position()
            assert mark.id.endswith(f"-{text.get_text()}")
            ids.append(mark.id)
            assert np.hypot(x - mark.position[0], y - mark.position[1]) < 3
            assert building.kind[(floor, *building.cell(x, y))] == Kind.WALL
            spots.add((floor, x, y))
    assert len(spots) == len(building.landmarks)
    told = figure.legends[0].get_title().get_text()
    assert told.startswith("numbers: of doors") and told.split()[-1] in ids


def test_a_line_beside_another_keeps_its_ends_and_its_distance():
    """To the left as one walks: round a corner, and straight on."""
    way = np.array([[0, 0], [0, 4], [3, 4], [5, 4], [5, 5]], float).T
    moved = plans.beside(way, 0.2).T.tolist()
    assert moved == [[0, 0], [-0.2, 4.2], [3, 4.2], [4.8, 4.2], [5, 5]]


def test_an_exit_whose_middle_is_a_corner_of_its_way_is_drawn():
    """Exits beside each other are one, round a corner: no length is divided by."""
    rows = "E##E\nE..E\nE###\n"
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        plans.graph(load(f"building: Den\nsize: 4 x 3\nfloor 1:\n{rows}"))


def test_a_map_without_walls_has_ways_without_numbers():
    """There is no wall to write them in."""
    rows = "EEEE\nE..E\nE..E\nEEEE\n"
    figure = plans.graph(load(f"building: Open\nsize: 4 x 4\nfloor 1:\n{rows}"))
    assert not [text for text in figure.axes[0].texts if text.get_text().isdigit()]
    assert "numbers" not in " ".join(writing(figure))


def test_a_graph_too_small_for_numbers_promises_none():
    """Its legend explains only what is drawn."""
    figure = drawn("graph", "many rooms")
    found = [text.get_text() for axes in figure.axes for text in axes.texts]
    assert not any(word.isdigit() for word in found)
    assert "numbers" not in " ".join(writing(figure))


def test_no_name_covers_an_exit_of_the_graph_nor_does_the_edge_of_its_floor():
    """Both arms of each star are green."""
    axes = drawn("graph", "many rooms").axes[0]
    radius = plans.WAYS[Kind.EXIT]["ms"] / 2 / plans.points_per_metre(axes)
    marks = MAPS["many rooms"].landmarks
    exits = [mark.position for mark in marks if mark.kind is Kind.EXIT]
    for x, y in exits:
        for arm in (-radius / 2, radius / 2):
            colour = colour_at(axes, x + arm, y + 0.15 * radius)
            np.testing.assert_allclose(colour, to_rgb(COLOURS[Kind.EXIT]), atol=0.01)
    assert len(exits) == 3


def spread(way, step=0.05):
    """Points along a line, (k, 2), but for its first and last piece."""
    inner = way[1:-1]
    pieces = [
        np.linspace(start, end, int(np.hypot(*(end - start)) / step), endpoint=False)
        for start, end in pairwise(inner)
    ]
    return np.concatenate([np.empty((0, 2)), *pieces])


@pytest.mark.parametrize("name", ["tower", "paper", "school", "maze"])
def test_no_way_of_the_graph_hides_one_of_another_kind(name):
    """They may cross, but do not lie on each other: exits do not vanish."""
    compared = 0
    for axes in drawn("graph", name).axes:
        by_colour = {}
        for line in axes.lines:
            if len(line.get_xydata()) > 1:
                spots = spread(line.get_xydata())
                by_colour.setdefault(line.get_color(), []).append(spots)
        kinds = {colour: np.concatenate(ways) for colour, ways in by_colour.items()}
        for colour, spots in kinds.items():
            others = [kinds[other] for other in kinds if other != colour]
            other = np.concatenate([np.empty((0, 2)), *others])
            if len(spots) and len(other):
                nearest, _ = KDTree(other).query(spots)
                assert (nearest < 0.1).mean() < 0.1
                compared += 1
    assert compared or name != "tower"


@pytest.mark.paper("A8", "Fig. 1")
def test_what_is_nearer_is_painted_later():
    """The eye is south-west: first the north row, in a row first the east."""
    axes = sheet("Six walls", 3, 3).subplots()
    add_boxes(axes, np.full((2, 3), Kind.WALL), SOLID)
    (sides,) = axes.collections
    bright = sides.get_facecolors()[:, 0] == sides.get_facecolors()[:, 0].max()
    lids = [np.array(sides.get_paths()[k].vertices[:4]) for k in np.flatnonzero(bright)]
    order = [(2, 0), (1, 0), (0, 0), (2, 1), (1, 1), (0, 1)]
    high = SOLID.heights[Kind.WALL]
    middles = project(np.array([(col + 0.5, -row - 0.5, high) for col, row in order]))
    np.testing.assert_allclose([lid.mean(axis=0) for lid in lids], middles)


@pytest.mark.paper("A8", "Fig. 1")
def test_a_room_of_two_rows_is_seen_behind_its_wall():
    """Walls are so low that half of its northern row is in view."""
    axes = sheet("A narrow room", 4, 3).subplots()
    kinds = np.pad(np.full((2, 4), Kind.FLOOR), 1, constant_values=Kind.WALL)
    add_boxes(axes, kinds, SOLID)
    colour = colour_at(axes, *project(np.array((3, -1.5, 0))))
    np.testing.assert_allclose(colour, to_rgb(COLOURS[Kind.FLOOR]), atol=0.01)


@pytest.mark.paper("A8", "Fig. 1")
@pytest.mark.parametrize("name", ["paper", "tower", "school"])
def test_the_relief_names_its_rooms_and_no_name_lies_on_another(name):
    """Most of the rooms; each name's middle is seen within its own room."""
    building = shipped(name)
    figure = drawn("oblique", name)
    assert overlaps(figure) == []
    (axes,) = figure.axes
    rooms = [area for area in building.areas if area.kind == "room"]
    left, _, _, north = extent_of(building)
    found = 0
    for area in building.areas:
        corners = area.cells[:, None] + [(0, 0), (0, 1), (1, 0), (1, 1)]
        x, y = np.moveaxis(building.metres(*np.moveaxis(corners - 0.5, -1, 0)), 0, 0)
        seen = project(np.stack([x - left, y - north, 0 * x], axis=-1))
        seen[..., 1] += area.floor * lift_of(building)
        low, high = seen.min(axis=(0, 1)), seen.max(axis=(0, 1))
        found += any(
            text.get_text() == area.name
            and np.all((low < text.get_position()) & (text.get_position() < high))
            for text in axes.texts
        )
    assert found > 0.8 * len(rooms)


@pytest.mark.paper("A8", "Fig. 2")
def test_the_walkable_picture_says_how_much_one_may_walk_on():
    """The number is the building's own."""
    area = (TINY.kind >= Kind.FLOOR).sum()
    title = f"Tiny office: where one may walk, {area} m²"
    assert title in writing(drawn("walkable", "tiny"))


@pytest.mark.paper("A8", "Fig. 3")
@pytest.mark.parametrize("name", ["paper", "maze"])
def test_the_close_up_finds_every_kind_of_passage_there_is(name):
    """An exit, an entrance and a door, wherever the building has them."""
    named = {axes.get_title() for axes in drawn("closeup", name).axes}
    assert {MEANINGS[mark.kind] for mark in shipped(name).landmarks} == named


@pytest.mark.paper("A8", "Fig. 1")
@pytest.mark.parametrize("view", ["oblique", "closeup", "walkable"])
def test_the_legend_of_a_relief_has_its_colours_and_its_lines(view):
    """Walls as they are painted, and lines between storeys, where there are some."""
    figure = drawn(view, "tiny")
    (legend,) = figure.legends
    words = [text.get_text() for text in legend.get_texts()]
    handles = dict(zip(words, legend.legend_handles, strict=True))
    painted = np.concatenate([c.get_facecolors() for c in figure.axes[0].collections])
    wall = to_rgb(handles["wall"].get_facecolor())
    assert np.abs(painted[:, :3] - wall).max(axis=1).min() < 0.01
    lines = {line.get_linestyle() for axes in figure.axes for line in axes.lines}
    assert ("stairwell, floor to floor" in words) == bool(lines) == (view != "closeup")


LONG_TITLE = "A house that goes on and on for ever and ever, to see what becomes of it"


@pytest.mark.parametrize(
    ("view", "end"),
    [
        ("oblique", ", seen from the south-west"),
        ("walkable", " m²"),
        ("closeup", ": ways through, up close"),
        ("graph", ": the graph"),
        ("anchors", ": what robots choose between after 10 s"),
    ],
)
def test_a_long_title_keeps_its_end_which_says_what_the_view_is(view, end):
    """It is the building's own name that is cut off."""
    house = Building(replace(TINY.drawing, title=LONG_TITLE * 2))
    title = getattr(drawing, view)(house).get_suptitle()
    assert title.startswith("A house that goes on") and title.endswith(end)


@pytest.mark.parametrize("view", [*VIEWS, "frame"])
def test_a_title_of_wide_letters_is_not_clipped(view):
    """As many of them are kept as fit, not as many as of others."""
    house = Building(replace(TINY.drawing, title="MWWM " * 40))
    if view == "frame":
        assert overlaps(drawing.frame(evacuation(building=house).world)) == []
        return
    figure = getattr(drawing, view)(house)
    figure.draw_without_rendering()
    title = next(text for text in figure.texts if text.get_text().startswith("MWWM"))
    box = title.get_window_extent()
    assert 0 < box.x0 < box.x1 < figure.bbox.width
    assert box.width > 0.8 * figure.bbox.width


@pytest.mark.parametrize("view", ["top", "oblique", "graph", "anchors"])
def test_no_floor_s_title_lies_on_another_in_a_tall_building(view):
    """Where a name has no room, the number stays."""
    figure = drawn(view, "many floors")
    figure.draw_without_rendering()
    titles = [text for text in words(figure) if text.get_text().startswith("Floor")]
    boxes = [Text.get_window_extent(text).padded(-1) for text in titles]
    assert len(boxes) == 30
    assert not any(one.overlaps(other) for one, other in combinations(boxes, 2))


@pytest.mark.parametrize("name", ["paper", "tower", "school"])
def test_a_floor_s_title_has_its_name_where_there_is_room(name):
    """Beside another panel, and over one."""
    storeys = shipped(name).drawing.storeys
    named = [f"Floor {k}: {storey.name}" for k, storey in enumerate(storeys, 1)]
    axes = drawn("top", name).axes
    assert [each.get_title(loc="left") for each in axes] == named


@pytest.mark.parametrize("view", ["top", "graph", "anchors"])
def test_x_is_labelled_where_no_floor_is_below(view):
    """Five floors in three columns: also the third, over an empty place."""
    figure = drawn(view, "tower")
    figure.draw_without_rendering()
    labels = [axes.get_xlabel() for axes in figure.axes]
    assert labels == ["", "", *["x, metres east"] * 3]
    for axes, label in zip(figure.axes, labels, strict=True):
        shown = [text.get_visible() for text in axes.get_xticklabels()]
        assert shown == len(shown) * [bool(label)]


@pytest.mark.parametrize("view", ["top", "graph", "anchors"])
def test_nothing_overlaps_on_the_page_of_a_corridor(view):
    """Though it is a strip."""
    assert overlaps(getattr(drawing, view)(CORRIDOR)) == []


# -- One instant --------------------------------------------------------------------


def scene_of(world, headings=("",)):
    """A page with a world on it."""
    scene = Scene(world.building, len(world.bodies), headings)
    scene.show(world, [drawing.tally(world)])
    return scene


@pytest.mark.paper("B4")
def test_followers_are_discs_and_leaders_triangles(simulation):
    """A mode is told by its shape, so that no colour is needed for it."""
    simulation.world.bodies.mode[:] = [Mode.LEADER] * 3 + [Mode.FOLLOWER] * 5
    (side,) = scene_of(simulation.world).sides
    counts = {mode: len(crowd.get_offsets()) for mode, crowd in side.people.items()}
    assert counts == {Mode.FOLLOWER: 5, Mode.LEADER: 3}
    corners = {m: len(c.get_paths()[0].vertices) for m, c in side.people.items()}
    assert corners[Mode.LEADER] == 4 < corners[Mode.FOLLOWER]


@pytest.mark.paper("B7")
def test_health_is_a_colour_that_darkens(simulation):
    """Bright at 100, dark near 0, and ever darker between."""
    world = simulation.world
    world.bodies.mode[:] = Mode.FOLLOWER
    world.bodies.health[:] = np.linspace(99, 1, 8)
    scene = scene_of(world)
    scene.figure.draw_without_rendering()
    light = scene.sides[0].people[Mode.FOLLOWER].get_facecolors()[:, :3].sum(axis=1)
    assert (np.diff(light) <= 0).all()
    assert light[0] > 2 * light[-1]


@pytest.mark.parametrize("building", [TINY, CORRIDOR])
def test_a_step_of_health_ends_where_the_scale_has_a_number(building):
    """Every 20 of 100: who is paler has passed a number that can be read."""
    figure = scene_of(evacuation(building=building).world).figure
    scale = next(axes for axes in figure.axes if axes.get_ylabel() == "health")
    borders = np.linspace(0, 100, len(STEPS) + 1)
    assert {*scale.get_yticks()} <= {*borders.tolist()}


def test_the_scale_of_health_can_be_read_beside_a_corridor():
    """Its colours, too, though the floor is half an inch high."""
    figure = scene_of(evacuation(building=CORRIDOR).world).figure
    assert overlaps(figure) == []
    floors, _, scale = (axes.get_window_extent() for axes in figure.axes)
    assert floors.height < 0.5 * figure.dpi
    assert scale.height > 0.8 * figure.dpi and scale.width > 0.1 * figure.dpi


def test_a_narrow_floor_is_called_by_its_number():
    """Where its whole title has no place; the number is what tells it from others."""
    said = writing(scene_of(evacuation(building=empty(80, 9)).world).figure)
    assert "Floor 1" in said and "Floor 1: entry" not in said
    assert "Floor 1: entry" in writing(
        scene_of(evacuation(building=CORRIDOR).world).figure
    )


@pytest.mark.parametrize("name", ["tiny", "paper"])
def test_the_scale_of_health_stands_beside_the_floors_and_is_as_high(name):
    """Also where the floors do not fill the page's width."""
    figure = scene_of(evacuation(building=shipped(name)).world).figure
    figure.draw_without_rendering()
    floors, _, scale = (axes.get_window_extent() for axes in figure.axes)
    assert 0 < (scale.x0 - floors.x1) / figure.dpi < 0.3
    assert (scale.y0, scale.y1) == pytest.approx((floors.y0, floors.y1), abs=1)


def told_in_legend(figure):
    """The words of a figure's legend."""
    (legend,) = figure.legends
    return {text.get_text() for text in legend.get_texts()}


@pytest.mark.paper("A8")
def test_a_picture_s_legend_names_what_is_there_a_film_s_all_that_may_come(simulation):
    """Before the first tick nobody leads, burns or has died."""
    moving = {"leader", "flames", "ash", "burnt door", "fire source", "died here"}
    moving |= {"destination", TRAIL}
    of_film = told_in_legend(scene_of(simulation.world).figure)
    assert moving < of_film
    now = told_in_legend(drawing.draw(simulation))
    assert now == of_film - moving - {NUMBERED} | {"robot"}
    assert {"follower", "robot", "out", "wall"} < now
    alone = Simulation(TINY, Scenario(people=0), NoRobots(), NoFire())
    assert told_in_legend(drawing.draw(alone)) == now - {"follower", "robot"}


def test_a_picture_s_legend_explains_numbers_of_robots_where_there_are_some():
    """Two on one spot have a number, two apart none."""
    run = Simulation(TINY, Scenario(people=4, robots_per_floor=2), Sweep())
    for x, robot in enumerate(run.world.robots):
        robot.position = np.array([2.0 * x, 0.0])
    apart = told_in_legend(drawing.frame(run.world))
    run.world.robots[0].position = run.world.robots[1].position
    together = told_in_legend(drawing.frame(run.world))
    assert apart - together == {"robot"}
    assert together - apart == {NUMBERED}


def test_everybody_is_drawn_on_the_floor_they_are_on(simulation):
    """The place on the page is the colour of that floor's cell."""
    building = simulation.building
    (side,) = scene_of(simulation.world).sides
    for floor in (0, 1):
        row, col = np.argwhere(building.kind[floor] == Kind.ENTRANCE)[0]
        ((x,), (y,)) = side.on_page(floor, building.metres(row, col))
        colour = colour_at(side.axes, x, y)
        np.testing.assert_allclose(colour, to_rgb(COLOURS[Kind.ENTRANCE]), atol=0.01)


def test_the_title_and_the_curve_count_the_same_people(simulation):
    """Two out and one dead of eight."""
    world = simulation.world
    world.bodies.fate[:3] = (Fate.EVACUATED, Fate.EVACUATED, Fate.DEAD)
    figure = drawing.frame(world, [drawing.tally(world)])
    assert {"after 0 s:", "5 inside, 2 out, 1 dead"} <= set(writing(figure))
    lines = next(a for a in figure.axes if a.get_ylabel() == "people").lines
    ends = dict(zip(CURVES, (line.get_ydata()[-1] for line in lines), strict=True))
    assert ends == {"out": 2, "inside": 5, "dead": 1}


@pytest.mark.paper("C5")
@pytest.mark.paper("D3")
@pytest.mark.paper("D7")
def test_robots_destinations_flames_and_burnt_doors_have_marks_of_their_own(simulation):
    """A line and a cross to a destination, a star at a source, boxes where it burnt."""
    simulation.run()
    world = simulation.world
    world.burnt |= {0, 1}
    world.flames.ash[0, 2, 6:9] = True
    marks = scene_of(world).sides[0].marks
    count = {name: len(mark.get_xdata()) for name, mark in marks.items()}
    sent = sum(r.active and r.destination is not None for r in world.robots)
    assert count["robot"] == len(world.robots) == 2
    assert count["destination"] == 3 * sent
    assert count["flames"] == world.flames.burning.sum()
    assert count["ash"] == 3
    assert count["fire source"] == len(world.flames.sources)
    assert count["burnt door"] == 2


@pytest.mark.parametrize("cells", ["burning", "ash"])
def test_flames_do_not_hide_the_names_of_rooms(simulation, cells):
    """In a film's frame, where all of the floor burns, as much of them is seen."""
    world = simulation.world
    scene = scene_of(world)
    (side,) = scene.sides
    paint = film.painter(scene)
    names = {area.name for area in TINY.areas}
    still = [text for text in side.axes.texts if text not in scene.moving]
    boxes = [text.get_window_extent() for text in still if text.get_text() in names]

    def written():
        """Dark pixels of each name."""
        pixels = paint()[::-1, :, :3]
        for box in boxes:
            left, low, right, high = np.array(box.extents).astype(int)
            yield (pixels[low:high, left:right].max(axis=2) < 90).sum()

    before = [*written()]
    getattr(world.flames, cells)[:] = world.building.kind == Kind.FLOOR
    scene.show(world, [drawing.tally(world)])
    assert (np.array([*written()]) >= before).all()
    assert len(boxes) == 8 and sum(before) > 80


def walked(world, spots, seconds=1.0):
    """The trail after a past in which person 0 stood in these spots, nobody else."""
    scene = scene_of(world)
    history = []
    for k, spot in enumerate(spots):
        others = np.full((7, 3), [0, np.nan, np.nan])
        history.append(drawing.Tally(k * seconds, 0, 8, 0, np.vstack([spot, others])))
    scene.show(world, history)
    trail = scene.sides[0].marks[TRAIL].get_xydata()
    return trail[: np.isfinite(trail).all(axis=1).sum()].round(6).tolist()


def test_a_trail_is_where_a_person_walked_lately(simulation):
    """Older spots are forgotten: so many seconds of them, one spot a second."""
    spots = [(0, k, 2.0 * k) for k in range(30)]
    trail = walked(simulation.world, spots)
    assert trail == [[k, 2.0 * k] for k in range(30 - TRAIL_SECONDS, 30)]
    assert walked(simulation.world, spots[:12], seconds=5) == []  # too far apart
    simulation.world.bodies.fate[0] = Fate.EVACUATED
    assert walked(simulation.world, spots) == []


@pytest.mark.parametrize("name", ["paper", "tower"])
def test_no_instant_of_any_building_is_clipped(name):
    """The floors, the curve and the legend find room on the same page; so do two, of
    which maps are as large as ever where names are paths."""
    world = evacuation(building=shipped(name)).world
    assert overlaps(scene_of(world).figure) == []
    names = "sweep", f"out/{'of-a-long-name/' * 9}checkpoint-000120.pt"
    heads = (f"guided by {who}, fire {who}\nrobots: {who}, who lead" for who in names)
    pages = [scene_of(world, [head, head]) for head in heads]
    assert [overlaps(page.figure) for page in pages] == [[], []]
    one, other = (page.sides[0].axes.get_position().bounds for page in pages)
    assert one == pytest.approx(other)


def test_who_plays_is_told_in_whole_beside_two_others(simulation):
    """In two lines where one is too short; nothing overlaps."""
    words = "robots: escort, lead people out at once by the safest way; fetch only near"
    figure = scene_of(simulation.world, [f"escort\n{words}"] * 3).figure
    assert " ".join(writing(figure)).count("lead people out at once") == 3
    assert " ".join(writing(figure)).count("only near") == 3
    assert "…" not in "".join(writing(figure))
    assert overlaps(figure) == []


def test_an_empty_house_can_be_drawn():
    """No people, no robots, no fire."""
    scenario = Scenario(people=0, robots_per_floor=0)
    world = Simulation(TINY, scenario, NoRobots(), NoFire()).world
    assert "0 inside, 0 out, 0 dead" in " ".join(writing(drawing.frame(world)))


DARK = dict(
    re.findall(r"--(\w+): (#\w{6})", web_film.TEMPLATE.read_text().split("dark)")[1])
)
"""Inks of a film's page in the dark that are others than in the light."""


@pytest.mark.paper("A8")
@pytest.mark.parametrize("dark", [{}, DARK])
def test_colour_blind_readers_can_tell_everything_apart(dark):
    """Seen by any of three kinds of eye, no two colours come close in CIE L*a*b*.

    The eyes are those of Machado et al. (2009) at full severity; 10 is far more than
    the just noticeable difference of 2.3.
    """
    inks = {k.name.lower(): ink for k, ink in COLOURS.items()} | INKS | dark
    names = [k.name.lower() for k in Kind if k is not Kind.OUTSIDE]
    colours = [inks[name] for name in [*names, "flame", "ash"]]
    colours.append(STEPS[-1])  # of full health
    assert least_apart(colours) > 10


@pytest.mark.paper("B7")
@pytest.mark.parametrize("ash", [INKS["ash"], DARK["ash"]])
def test_nobody_has_the_colour_of_ash(ash):
    """Whatever their health, in the light and in the dark."""
    assert least_apart([ash, *STEPS]) > 15


def least_apart(colours):
    """The least distance in L*a*b* of two of these colours, for any kind of eye."""
    light = np.array([to_rgb(colour) for colour in colours]) ** 2.2
    least = np.inf
    for eye in (np.eye(3), PROTANOPE, DEUTERANOPE, TRITANOPE):
        lab = to_lab(np.clip(light @ np.array(eye).T, 0, 1))
        apart = np.linalg.norm(lab[:, None] - lab[None], axis=2)
        least = min(least, apart[np.triu_indices(len(colours), 1)].min())
    return least


PROTANOPE = ((0.152, 1.053, -0.205), (0.115, 0.786, 0.099), (-0.004, -0.048, 1.052))
DEUTERANOPE = ((0.367, 0.861, -0.228), (0.280, 0.673, 0.047), (-0.012, 0.043, 0.969))
TRITANOPE = ((1.256, -0.077, -0.179), (-0.078, 0.931, 0.148), (0.005, 0.691, 0.304))


# -- Films --------------------------------------------------------------------------


def test_a_blitted_frame_is_the_frame_painted_anew(simulation):
    """Nothing of the frame before shines through."""
    used = scene_of(simulation.world)
    fresh = scene_of(simulation.world)
    paint = film.painter(used)
    history = []
    for _ in range(30):
        history.append(drawing.tally(simulation.world))
        used.show(simulation.world, history)
        last = paint()
        simulation.step()
    simulation.world.time = history[-1].time
    for scene in (used, fresh):
        scene.show(simulation.world, history)
    assert len(used.sides[0].marks[TRAIL].get_xdata())
    last = paint()
    np.testing.assert_array_equal(last, film.painter(fresh)())


FRAMES = 11  # of six seconds: at the beginning, then every 0.6 s


def test_a_gif_has_a_frame_for_every_instant_and_ends_with_the_page(
    simulation, tmp_path
):
    """It holds the end for three seconds, drawn but for a palette of 256 colours; the
    outcome is that of the run unseen."""
    drawing.animate([simulation], tmp_path / "film.gif")
    assert simulation.outcome() == evacuation().run()
    shown, said = frames(tmp_path / "film.gif")
    assert (len(shown), said["duration"], said["loop"]) == (FRAMES, 3000, 0)
    page = film.painter(scene_of(simulation.world))()[..., :3].astype(int)
    floors = slice(0, len(page) - 300)  # the curve knows the past
    off = np.abs(page - shown[-1])[floors].max(axis=2)
    assert (off < 24).mean() > 0.995


def test_a_gif_has_the_inks_of_pictures(scenes, tmp_path):
    """To the bit, as its legend shows: white is no pale yellow."""
    run = evacuation(0.2)
    drawing.animate([run], tmp_path / "film.gif")
    (first, *_), _ = frames(tmp_path / "film.gif")
    (scene,) = scenes
    page = film.painter(scene)()[..., :3]
    legend = slice(-int(scene.figure.legends[0].get_window_extent().y1), None)
    inks = ["#ffffff", *COLOURS.values(), *INKS.values(), *STEPS]
    found = 0
    for ink in np.rint(255 * np.array([to_rgb(ink) for ink in inks])):
        here = (page[legend] == ink).all(axis=2)
        found += here.any()
        assert (first[legend][here] == ink).all()
    assert found > 10


@pytest.mark.parametrize("ticks", [10, 4])  # a frame of 0.6 s and of 0.64 s
def test_a_gif_takes_a_sixth_of_the_time_whatever_the_tick(ticks, tmp_path):
    """Also where a frame is no whole hundredth of a second, nothing gets lost."""
    run = evacuation(frames_per_tick=ticks)
    drawing.animate([run], tmp_path / "film.gif")
    with Image.open(tmp_path / "film.gif") as shown:
        seconds = [f.info["duration"] / 1000 for f in ImageSequence.Iterator(shown)]
    pace = web_film.seconds_per_frame(run) / 6
    assert sum(seconds[:-1]) == pytest.approx(pace * (len(seconds) - 1), abs=0.006)
    assert seconds[-1] == pytest.approx(3, abs=0.01)
    assert max(seconds[:-1]) - min(seconds[:-1]) < 0.011


@pytest.fixture
def scenes(monkeypatch):
    """The scenes of all films of a test."""
    made = []

    class Kept(Scene):
        def __init__(self, *args):
            super().__init__(*args)
            made.append(self)

    monkeypatch.setattr(film, "Scene", Kept)
    return made


def test_a_film_s_legend_names_only_what_can_come(scenes, tmp_path):
    """Neither robots where there are none in any run, nor fire where none is lit."""
    rule = Scenario(people=4, time_limit=0.4)
    guided = Scenario(people=4, time_limit=0.4, robots_per_floor=1)
    calm = Simulation(TINY, rule)
    drawing.animate([calm], tmp_path / "calm.gif")
    of_robots = {"robot", "destination"}
    of_fire = {"flames", "ash", "burnt door", "fire source"}
    pair = [Simulation(TINY, rule), Simulation(TINY, guided, Sweep(), RandomFire())]
    drawing.animate(pair, tmp_path / "both.gif")
    alone, both = (told_in_legend(scene.figure) for scene in scenes)
    assert alone == both - of_robots - of_fire
    assert of_robots | of_fire | {"died here"} < both
    several = Scenario(people=4, time_limit=0.4, robots_per_floor=2)
    drawing.animate([Simulation(TINY, several, Sweep())], tmp_path / "several.gif")
    assert NUMBERED in told_in_legend(scenes[-1].figure)


def test_a_film_s_curves_begin_at_0_s_and_end_where_their_run_ends(scenes, tmp_path):
    """Also where it is filmed from later on, or another run goes on beside it."""
    short = evacuation(2.0)
    long = evacuation(3.2)
    for run in (short, long):
        for _ in range(4):
            run.step()
    drawing.animate([short, long], tmp_path / "both.gif")
    curves = [side.lines["inside"].get_xdata() for side in scenes[0].sides]
    for run, times in zip((short, long), curves, strict=True):
        assert (times[0], times[-1]) == (0, run.world.time)
        assert (np.diff(times) > 0).all()


def test_two_evacuations_are_shown_side_by_side_until_both_are_over(tmp_path):
    """Each under its own heading and with its own curve; who ends first stays."""
    short = evacuation(1.2)
    long = evacuation(2.4)
    drawing.animate([short, long], tmp_path / "both.gif", ["brief", "long"])
    assert (short.ticks, long.ticks) == (6, 12)
    shown, _ = frames(tmp_path / "both.gif")
    middle = shown[0].shape[1] // 2
    left, right = ([f[:300, k : k + middle] for f in shown] for k in (0, middle))
    assert [np.any(a != b) for a, b in pairwise(left)] == [True, True, False, False]
    assert all(np.any(a != b) for a, b in pairwise(right))


@pytest.mark.parametrize(
    "headings", [{}, {"headings": ""}, {"headings": []}, {"headings": ["", ""]}]
)
@pytest.mark.parametrize("suffix", ["gif", "html"])
def test_each_of_several_evacuations_has_a_heading_by_default(
    suffix, headings, tmp_path
):
    """The building's title, in every format; a generator of simulations will do."""
    path = tmp_path / f"two.{suffix}"
    drawing.animate((evacuation(0.4) for _ in range(2)), path, **headings)
    assert path.stat().st_size > 1000
    if suffix == "html":
        assert path.read_text(encoding="utf-8").count("<h2>Tiny office</h2>") == 2


def test_a_single_heading_may_be_a_word(tmp_path):
    """It is not taken letter by letter."""
    path = tmp_path / "one.html"
    drawing.animate(evacuation(0.4), path, "Tonight")
    assert path.read_text(encoding="utf-8").count("<h2>Tonight</h2>") == 1


def ended():
    """A simulation that has been run."""
    run = evacuation(0.4)
    run.run()
    return run


@pytest.mark.parametrize(
    ("shown", "headings", "told"),
    [
        (lambda: [evacuation(0.4)] * 2, "", "the same simulation is there twice"),
        (
            lambda: [evacuation(0.4), evacuation(0.4)],
            "Tonight",
            "2 evacuations have 1 headings",
        ),
        (lambda: [evacuation(0.4)], ["a", "b"], "1 evacuations have 2 headings"),
        (list, "", "takes a Simulation, or a list of them, not nothing"),
        (lambda: "tiny", "", "takes a Simulation, or a list of them, not 'tiny'"),
        (lambda: TINY, "", "takes a Simulation, or a list of them, not <Building"),
        (lambda: Simulation, "", "takes a Simulation, or a list of them, not <class"),
        (ended, "", "this evacuation has ended"),
        (lambda: [evacuation(0.4), ended()], "", "this evacuation has ended"),
        (
            lambda: [evacuation(0.4), evacuation(building=shipped("museum"))],
            "",
            "need the same building",
        ),
    ],
)
def test_refuses_to_film_what_makes_no_film(shown, headings, told, tmp_path):
    """In a line, before anything is played; no file is left."""
    with pytest.raises(InputError, match=told):
        drawing.animate(shown(), tmp_path / "film.gif", headings)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    "shown", ["tiny", "tiny.txt", TINY, plan_of(TINY), find_map("tiny")]
)
def test_draw_takes_a_map_as_the_commands_do_and_a_notebook_shows_it(shown):
    """A name, a path or a text; what comes back is a PNG by itself."""
    picture = drawing.draw(shown)
    assert "Tiny office" in " ".join(writing(picture))
    assert picture._repr_png_().startswith(b"\x89PNG")


def test_a_notebook_shows_a_simulation_that_is_drawn(simulation):
    """Without matplotlib's inline mode, and without our extension."""
    assert drawing.draw(simulation)._repr_png_().startswith(b"\x89PNG")


@pytest.mark.parametrize("shown", [None, 3, Simulation, ["tiny"]])
def test_refuses_to_draw_what_has_no_picture(shown):
    """And names what has one."""
    with pytest.raises(InputError, match="draw takes a map, a building or a simu"):
        drawing.draw(shown)


@pytest.mark.parametrize("name", ["plan", "plan.jpg"])
def test_refuses_to_write_a_picture_of_another_kind(name, tmp_path):
    """Nothing is written."""
    with pytest.raises(InputError, match=rf"{name}: write a \.png, \.svg or \.pdf"):
        drawing.draw(shipped("tiny"), tmp_path / name)
    assert not list(tmp_path.iterdir())


def test_a_page_of_two_names_both_and_gives_each_its_curves(simulation):
    """Who plays stands below the names; all curves end when nobody can be alive."""
    heads = ["nobody guides", "robots\nrobots: sweep, fetch"]
    scene = scene_of(simulation.world, heads)
    scene.show(simulation.world, [drawing.Tally(70.0, 5, 3, 0)], 1)
    assert set("\n".join(heads).split("\n")) <= set(writing(scene.figure))
    ends = [side.lines["out"].get_ydata()[-1] for side in scene.sides]
    assert ends == [0, 5]
    assert {side.curve.get_xlim() for side in scene.sides} == {(0, 200)}


def ffmpeg(folder, monkeypatch, script):
    """A stand-in for ffmpeg, the first on the path."""
    program = folder / "ffmpeg"
    program.write_text(f"#!/bin/sh\n{script}\n")
    program.chmod(0o755)
    monkeypatch.setenv("PATH", f"{folder}{os.pathsep}{os.environ['PATH']}")


def test_an_mp4_hands_every_frame_to_ffmpeg(simulation, tmp_path, monkeypatch):
    """Raw pixels, as many as were announced, the last ones for three seconds."""
    script = 'for last; do :; done; echo "$@" > said; cat > "$last"'
    ffmpeg(tmp_path, monkeypatch, script)
    monkeypatch.chdir(tmp_path)
    drawing.animate([simulation], tmp_path / "film.mp4")
    size = re.search(r"(\d+)x(\d+)", Path("said").read_text()).groups()
    raw = (tmp_path / "film.mp4").stat().st_size
    count = FRAMES - 1 + 30  # 3 s at ten frames a second
    assert raw == int(size[0]) * int(size[1]) * 4 * count


def test_refuses_an_mp4_without_ffmpeg_at_once(simulation, tmp_path, monkeypatch):
    """The hint names what works everywhere."""
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(ValueError, match=r"needs ffmpeg.*write a \.gif"):
        drawing.animate([simulation], tmp_path / "film.mp4")
    with pytest.raises(ValueError, match=r"film\.avi: write a \.gif, \.html or \.mp4"):
        drawing.animate([simulation], tmp_path / "film.avi")
    assert simulation.world.time == 0


@pytest.mark.parametrize("script", ["exit 3", "cat > /dev/null; echo No space >&2"])
def test_an_ffmpeg_that_fails_or_complains_leaves_the_old_film(
    simulation, tmp_path, monkeypatch, script
):
    """Some versions exit with status 0 though the end could not be written."""
    ffmpeg(tmp_path, monkeypatch, script)
    film = tmp_path / "film.mp4"
    film.write_text("yesterday's")
    with pytest.raises(OSError, match=r"film\.mp4: cannot be written \(ffmpeg: "):
        drawing.animate([simulation], film)
    assert film.read_text() == "yesterday's"
    assert {path.name for path in tmp_path.iterdir()} == {"ffmpeg", "film.mp4"}


def test_a_stop_ends_ffmpeg_before_it_writes_anything(
    simulation, tmp_path, monkeypatch
):
    """It may take a while to begin; a film that nobody waits for is not left behind."""
    begins = 'sleep 0.5; for last; do :; done; cat > "$last"'
    ffmpeg(tmp_path, monkeypatch, begins)

    def stopped():
        yield
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        drawing.animate([simulation], tmp_path / "film.mp4", going=stopped())
    time.sleep(1)
    assert [path.name for path in tmp_path.iterdir()] == ["ffmpeg"]


def test_a_notebook_shows_buildings_and_simulations(simulation):
    """The extension tells IPython how to make a PNG of either."""
    shown = {}
    formats = {"image/png": SimpleNamespace(for_type=shown.__setitem__)}
    shell = SimpleNamespace(display_formatter=SimpleNamespace(formatters=formats))
    drawing.load_ipython_extension(shell)
    for thing in (simulation.building, simulation):
        assert shown[type(thing)](thing).startswith(b"\x89PNG")


def test_a_notebook_draws_a_simulation_s_curves_from_its_events():
    """From its beginning, everybody inside, to what is counted now."""
    run = Simulation(TINY, Scenario(people=6), seed=1)
    run.run()
    first, *others = drawing.history_of(run)
    assert (first.time, first.inside) == (0, 6)
    assert others[-2][1:4] == others[-1][1:4] == drawing.tally(run.world)[1:4]


def test_curves_of_a_world_that_goes_on_count_who_had_left_before():
    """From the first event on: what was at 0 s is not known."""
    run = Simulation(TINY, Scenario(people=6), seed=1)
    while run.world.occupancy[0] == 3:
        run.step()
    later = Simulation(TINY, run.scenario, world=run.world, seed=2)
    later.run()
    tallies = drawing.history_of(later)
    assert len(tallies) == len(later.events) + 1
    counts = [(each.out, each.inside, each.dead) for each in tallies]
    assert counts == sorted(counts, key=lambda c: (c[0], c[2]))
    assert counts[-1] == counts[-2] == drawing.tally(later.world)[1:4]


# -- Saving -------------------------------------------------------------------------


@pytest.mark.parametrize("suffix", [".png", ".svg", ".pdf", ".PNG"])
def test_a_figure_is_saved_whole_and_alone(tmp_path, suffix):
    """The partial file beside it is gone."""
    target = tmp_path / f"plan{suffix}"
    assert drawing.save(sheet("A plan", 3, 2), target) == target
    assert target.stat().st_size > 1000
    assert list(tmp_path.iterdir()) == [target]


def test_a_name_may_hold_any_sign_and_any_length():
    """A dollar is a dollar, not the beginning of a formula; nothing is clipped."""
    name = r"Dollar $\frac{$ " + "bank " * 30
    plan = TINY.drawing
    storeys = tuple(replace(storey, name=name) for storey in plan.storeys)
    bank = Building(replace(plan, title=name, storeys=storeys))
    for view in ("top", "oblique", "closeup"):
        assert_on_page(getattr(drawing, view)(bank))
    assert_on_page(drawing.frame(evacuation(building=bank).world))
