"""Floors as text: what a drawing means, and what is refused in one line."""

import pytest
from drawings import HOUSE

from reference.floorplan import Drawing, FloorPlanError, Storey, parse
from reference.workshop import maps


@pytest.mark.paper("A1")
def test_a_drawing_becomes_rows_of_cells_all_equally_wide():
    """One character is one cell; beyond a ragged right edge is outside.

    Written as text and read again it is the same: `test_maps` does so with all maps.
    """
    plan = parse(
        """building: Hut
        size: 7 x 4
        floor 1: ground
#######
#.hut.E
#...###
#####"""
    )
    ground = Storey("ground", ("#######", "#.hut.E", "#...###", "#####  "))
    assert plan == Drawing("Hut", 7, 4, (ground,)) == parse(maps.to_text(plan))


@pytest.mark.paper("A1")
@pytest.mark.parametrize(("floors", "storeys"), [("2-3", 3), ("2-5", 5)])
def test_a_floor_drawn_once_is_built_as_often_as_said(floors, storeys):
    """`floor 2-3:` saves drawing what is alike."""
    plan = parse(HOUSE.replace("floor 2:", f"floor {floors}:"))
    assert len(plan.storeys) == storeys
    assert len(set(plan.storeys[1:])) == 1


@pytest.mark.parametrize(
    "loosely",
    [
        HOUSE.replace("\n", "\r\n"),
        HOUSE.replace("\n", "\r"),
        HOUSE.replace("\n", "  \t\n"),
        HOUSE.rstrip("\n"),
        "\ufeff" + HOUSE,
    ],
    ids=["CRLF", "CR", "trailing blanks", "no last newline", "BOM"],
)
def test_an_editors_habits_are_tolerated_in_silence(loosely, tmp_path):
    """Nobody sees line endings; nobody is told about them."""
    file = tmp_path / "house.txt"
    file.write_bytes(loosely.encode())
    assert maps.read_map(file) == parse(loosely) == parse(HOUSE)


@pytest.mark.paper("A1")
def test_a_lone_wall_at_the_edge_stands_for_a_row_outside():
    """It says that there is a row, and is no wall."""
    ground, upstairs = HOUSE.replace("x 5", "x 6").split("floor 2")
    wall = "   ####E######\n"
    plan = parse(
        f"{ground.replace(wall, wall.replace('E', '#') + wall)}floor 2{upstairs}#\n"
    )
    assert plan.storeys[1].rows[-1] == 14 * " "
    assert parse(maps.to_text(plan)) == plan


@pytest.mark.parametrize(
    ("was", "becomes", "line", "what"),
    [
        ("building: Small house", "", 16, "write 'building: NAME' above"),
        ("size:     14 x 5", "", 4, "write 'size: COLUMNS x ROWS' above"),
        ("14 x 5", "0 x 5", 2, "a floor has at least one column"),
        ("floor 2", "size: 9 x 5\nfloor 2", 11, "the size of all floors is written"),
        ("floor 1", "floor 2", 4, "this should be floor 1"),
        ("floor 1: ground", "", 5, "this row stands before any floor"),
        ("lab#", "lab|", 7, "a sign here has no meaning"),
        ("+lab#", "+.1b#", 7, "a sign here has no meaning"),
        ("hall+", "hall++", 7, "this row has 15 columns, the size says 14"),
        ("   ####E######\n", "", 10, "the drawing above has 4 rows, the size says"),
    ],
)
def test_refuses_what_cannot_be_read_in_one_line(was, becomes, line, what):
    """It names the line."""
    with pytest.raises(FloorPlanError) as caught:
        parse(HOUSE.replace(was, becomes))
    assert f"{caught.value}".startswith(f"line {line}: {what}")
    assert "\n" not in f"{caught.value}"
