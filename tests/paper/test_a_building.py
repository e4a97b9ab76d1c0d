"""A drawing becomes a grid and a graph: kinds, rooms, landmarks, stairwells, metres."""

import networkx as nx
import numpy as np
import pytest
from conftest import ROOT
from movies import built, stage

from reference.building import (
    OUTSIDE,
    Building,
    Kind,
    building_of,
    without_doors,
)
from reference.floorplan import parse
from reference.navigation import navigation_of
from reference.paper import BODY_SIZE, FLOORS, WALKING_SPEED, stairs_seconds
from reference.workshop.maps import load, plan_of

HOUSE = """\
building: House
size: 13 x 6

floor 1:
   ##########
####...#....#
#AA+...+....E
#AA#.a2+....E
####...#....#
   ##########

floor 2:
   ##########
####........#
#AA+...c....#
#AA#........#
####........#
   ##########
"""


@pytest.fixture(scope="module")
def house():
    """Rooms a2 and one without a name below, c above, a stairwell, two-metre doors."""
    return Building(parse(HOUSE))


@pytest.fixture(scope="module")
def paper():
    """The paper's building."""
    return load("paper")


TWO_DOORS = """
    #######
    #..+..#
    #..#+##
    #.....E
    #######
    """


# -- The grid -----------------------------------------------------------------------


def test_every_sign_of_the_drawing_becomes_a_kind_of_cell(house):
    """The second row from above shows nearly all of them."""
    row = [Kind(kind).name.lower() for kind in house.kind[0, 2, :8]]
    assert " ".join(row) == "wall stairs stairs entrance floor floor floor door"
    assert house.kind[0, 2, 12] == Kind.EXIT
    assert house.kind[0, 0, 0] == Kind.OUTSIDE


@pytest.mark.paper("A2")
def test_rooms_are_found_named_and_numbered(house):
    """A name may end in digits; a room without one gets a number."""
    sizes = {room.id: room.size for room in house.rooms(0) + house.rooms(1)}
    assert sizes == {"1/a2": 12, "1/room-2": 16, "2/c": 32}


@pytest.mark.paper("A3")
def test_a_plus_beside_a_stairwell_is_its_entrance(house):
    """Purple, not blue: it cannot burn."""
    shaft = house.stairwells[0]
    (below,) = shaft.entrances[0]
    (above,) = shaft.entrances[1]
    assert shaft.letter == "A"
    assert house.landmarks[below].id == "1/entrance-1"
    assert house.landmarks[above].id == "2/entrance-1"


def test_adjacent_cells_are_one_landmark_as_wide_as_they_are_many(house):
    """A door of two cells is one door of two metres."""
    (door,) = (mark for mark in house.landmarks if mark.id == "1/door-1")
    assert (door.width, door.sides) == (2, ("1/a2", "1/room-2"))
    assert (house.landmark[0, 2:4, 7] == door.index).all()


THICK = """building: Thick
size: 12 x 4
floor 1: ground
############
#...++....EE
#...++....##
############"""
SHARED = """building: Shared
size: 9 x 6
floor 1: ground
#########
#.......#
##+++++##
#.....#.#
#.....#.#
#EEEEEEE#"""


@pytest.mark.paper("A2")
@pytest.mark.parametrize(
    ("drawn", "door", "exit_"), [(THICK, (4, 2), (2, 1)), (SHARED, (5, 4), (7, 6))]
)
def test_a_passage_is_as_wide_as_the_narrower_of_its_sides(drawn, door, exit_):
    """Cells behind each other in a thick wall add nothing; two rooms behind do."""
    marks = load(drawn).landmarks
    assert [(len(mark.cells), mark.width) for mark in marks] == [door, exit_]


@pytest.mark.paper("A2")
def test_two_doors_that_only_share_a_corner_are_two():
    """Each joins the same two rooms."""
    one, other = built(TWO_DOORS).landmarks[:2]
    assert (one.width, other.width) == (1, 1)
    assert one.sides == other.sides == ("1/room-1", "1/room-2")


@pytest.mark.paper("A3", "A4")
def test_a_floor_may_have_two_exits_and_a_stairwell_two_entrances():
    """All are ways out, on their floors."""
    lower = "#AA+....E\n#AA#....#\n#AA+....E"
    building = built(f"{lower}\n\n{lower.replace('E', '#')}")
    below, above = building.stairwells[0].entrances.values()
    assert len(below) == len(above) == 2
    assert building.ways_out(0) == sorted(building.exits)
    assert len(building.exits) == 2
    assert building.ways_out(1) == [*above]


@pytest.mark.paper("A3", "A4")
def test_ways_out_are_exits_and_stairs_that_go_down(house):
    """On the lowest floor the stairs lead nowhere."""
    (below,) = house.ways_out(0)
    (above,) = house.ways_out(1)
    assert house.landmarks[below].id == "1/exit-1"
    assert house.landmarks[above].id == "2/entrance-1"


# -- Metres -------------------------------------------------------------------------


@pytest.mark.paper("A8")
def test_metres_begin_in_the_middle_of_the_main_body(house):
    """The stairwell sticks out of it and does not count; y grows northwards."""
    assert house.body == (-5, -3, 5, 3)
    assert house.metres(2, 8) == (0.5, 0.5)
    assert house.metres(0, 3) == (-4.5, 2.5)


def test_a_body_of_odd_size_keeps_its_cell_centres_at_halves():
    """The origin is then the nearest corner of a cell."""
    building = Building(
        parse("building: x\nsize: 5 x 3\nfloor 1:\n#####\n#...E\n#####")
    )
    centres = [building.metres(1, col)[0] for col in range(5)]
    assert [x % 1 for x in centres] == [0.5] * 5
    assert min(centres) <= -1.5 and max(centres) >= 1.5


def test_every_cell_is_found_again_from_its_metres(paper):
    """`cell` undoes `metres`, also off the middle of a cell."""
    for row, col in np.ndindex(paper.kind.shape[1:]):
        x, y = paper.metres(row, col)
        assert paper.cell(x + 0.49, y - 0.49) == paper.cell(x, y) == (row, col)


@pytest.mark.paper("A8", "chosen")
def test_a_point_where_cells_meet_lies_in_the_north_eastern_one(paper):
    """For one point as for a crowd of them, on both sides of the origin."""
    points = [[x, y] for x in range(-19, 20) for y in range(-19, 20)]
    cells = [paper.cell(x, y) for x, y in points]
    assert cells == [paper.cell(x + 0.5, y + 0.5) for x, y in points]
    nav = navigation_of(paper)
    places = nav.places_at(np.zeros(len(points), int), np.array(points))
    assert places.tolist() == nav.places_of(0, np.array(cells)).tolist()


# -- The graph ----------------------------------------------------------------------


@pytest.mark.paper("A3")
def test_an_edge_tells_what_it_is_how_wide_and_how_long(house):
    """A door's length goes from the middle of one room to the middle of the other."""
    door = house.graph.edges["1/a2", "1/room-2", "1/door-1"]
    assert door == {"kind": "door", "width": 2, "length": 4.5}
    stairs = house.graph.edges["1/A", "2/A", "A:1-2"]
    assert stairs["kind"] == "stairs"
    assert stairs["length"] == stairs_seconds() * WALKING_SPEED


def test_a_node_tells_what_it_is_and_where(house):
    """Rooms, stairwells and the outside."""
    kinds = dict(house.graph.nodes(data="kind"))
    assert kinds["1/a2"] == "room"
    assert kinds["2/A"] == "stairwell"
    assert kinds[OUTSIDE] == OUTSIDE
    assert house.graph.nodes["2/c"]["floor"] == 1


@pytest.mark.paper("A3")
def test_people_walk_out_by_exits_and_down_by_stairs_only(house):
    """Into the stairs above, out of them below; nobody enters by an exit."""
    walked = set(house.ways.edges())
    assert {("2/c", "2/A"), ("2/A", "1/A"), ("1/A", "1/a2")} < walked
    assert ("1/room-2", OUTSIDE) in walked
    up = {("2/A", "2/c"), ("1/A", "2/A"), ("1/a2", "1/A"), (OUTSIDE, "1/room-2")}
    assert walked.isdisjoint(up)


@pytest.mark.paper("A6")
def test_a_burnt_door_is_no_way_any_more(house):
    """Burning the only door cuts the room off; the building's own graph stays."""
    left = without_doors(house.graph, ["1/door-1"])
    assert not nx.has_path(left, "1/a2", OUTSIDE)
    assert nx.has_path(house.graph, "1/a2", OUTSIDE)


@pytest.mark.paper("A6")
@pytest.mark.parametrize(
    ("first", "second", "way"),
    [("+", "+", True), (":", "+", True), ("+", ":", True), (":", ":", False)],
)
def test_a_room_with_two_doors_is_cut_off_once_both_have_burnt(first, second, way):
    """Whichever burns first, the other one is a way."""
    board = TWO_DOORS.replace("#+##", f"#{second}##").replace("..+..", f"..{first}..")
    assert nx.has_path(stage(board).world.graph, "1/room-2", OUTSIDE) is way


def test_a_drawing_is_one_building_by_whatever_name_it_is_loaded(tmp_path):
    """So what is computed once for a building is computed once for its copies too."""
    copy = tmp_path / "copy.txt"
    copy.write_bytes((ROOT / "floors" / "tiny.txt").read_bytes())
    assert load(str(copy)) is load("tiny") is building_of(plan_of(load("tiny")))


# -- The paper's building -----------------------------------------------------------


@pytest.mark.paper("A1")
def test_the_papers_building_has_three_floors_of_forty_by_forty(paper):
    """The main body, walls included, is [-20, 20] in both directions."""
    assert paper.floors == FLOORS
    assert paper.body == (-BODY_SIZE / 2, -BODY_SIZE / 2, BODY_SIZE / 2, BODY_SIZE / 2)


@pytest.mark.paper("A2")
def test_rooms_grow_fewer_and_simpler_from_floor_to_floor(paper):
    """Number of rooms and of doors fall from the first floor to the third."""
    rooms = [len(paper.rooms(floor)) for floor in range(FLOORS)]
    all_doors = [m for m in paper.landmarks if m.kind is Kind.DOOR]
    doors = [sum(m.floor == floor for m in all_doors) for floor in range(FLOORS)]
    assert rooms[0] > rooms[1] > rooms[2]
    assert doors[0] > doors[1] > doors[2]


@pytest.mark.paper("A3")
def test_two_stairwells_stand_north_and_south_outside_the_main_body(paper):
    """A in the south, B in the north, each with an entrance on every floor."""
    south, north = paper.stairwells
    assert (south.letter, north.letter) == ("A", "B")
    assert south.centre[1] < -BODY_SIZE / 2
    assert north.centre[1] > BODY_SIZE / 2
    assert set(south.entrances) == set(north.entrances) == set(range(FLOORS))


@pytest.mark.paper("A4", "chosen")
def test_exits_are_on_the_first_floor_and_not_beside_a_stairwell(paper):
    """Who comes down the stairs has to cross the house."""
    exits = [paper.landmarks[m] for m in paper.exits]
    assert len(exits) >= 2
    assert {m.floor for m in exits} == {0}
    for mark in exits:
        for well in paper.stairwells:
            assert np.hypot(*np.subtract(mark.position, well.centre)) > 10


@pytest.mark.paper("A2")
def test_the_papers_floors_have_loops_as_well_as_dead_ends(paper):
    """Some doors can burn without cutting anybody off, others cannot."""
    for floor in range(FLOORS):
        here = [a.id for a in paper.areas if a.floor == floor]
        rooms = nx.Graph(paper.graph.subgraph(here))
        assert nx.cycle_basis(rooms), floor
        assert any(True for _ in nx.bridges(rooms)), floor
