"""Floors as text: what a drawing means, and what is refused in one line."""

import pytest
from drawings import HOUSE
from hypothesis import given, settings
from hypothesis import strategies as st

from reference.floorplan import Drawing, FloorPlanError, Storey, parse, to_text
from reference.workshop import maps


@pytest.mark.paper("A1")
def test_a_drawing_becomes_rows_of_cells_all_equally_wide():
    """One character is one cell; beyond a ragged right edge is outside."""
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
    assert plan == Drawing("Hut", 7, 4, (ground,))


@pytest.mark.paper("A1")
def test_a_floor_drawn_once_is_built_twice():
    """`floor 2-3:` saves drawing what is alike."""
    plan = parse(HOUSE.replace("floor 2:", "floor 2-3:"))
    assert len(plan.storeys) == 3
    assert plan.storeys[1] == plan.storeys[2]


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
    assert maps.read(file) == parse(loosely) == parse(HOUSE)


@st.composite
def houses(draw):
    """Rooms in a row behind a stairwell, and an exit; as many floors alike."""
    rooms = ["." * width for width in draw(st.lists(st.integers(1, 6), min_size=1))]
    solid, open_ = "#".join(rooms), "+".join(rooms)
    rows = [f"###{solid}#"] * draw(st.integers(0, 4))
    rows.insert(draw(st.integers(0, len(rows))), f"#A+{open_}#")
    walls = "####" + "#" * len(solid), "###E" + "#" * len(solid)
    drawing = "\n".join([walls[0], *rows, walls[1]])
    floors = draw(st.integers(2, 4))
    size = f"{len(walls[0])} x {len(rows) + 2}"
    return f"building: Row\nsize: {size}\nfloor 1-{floors}:\n{drawing}", floors


@settings(max_examples=25)
@given(houses())
def test_every_drawing_comes_back_from_its_text(house):
    """`parse(to_text(plan)) == plan`, for rows of rooms of all sizes."""
    text, floors = house
    plan = parse(text)
    assert len(plan.storeys) == floors
    assert parse(to_text(plan)) == plan
    assert to_text(parse(to_text(plan))) == to_text(plan)


@pytest.mark.parametrize(
    ("was", "becomes", "line", "what"),
    [
        ("building: Small house", "", 16, "no building"),
        ("floor 1", "floor 2", 4, "this should be floor 1"),
        ("floor 1: ground", "", 5, "this row stands before any floor"),
        ("lab#", "lab|", 7, "a sign here has no meaning"),
        ("+lab#", "+.1b#", 7, "a sign here has no meaning"),
        ("hall+", "hall++", 7, "this row has 15 columns, the size says 14"),
        ("   ####E######\n", "", 10, "the drawing above has 4 rows, the size says"),
    ],
)
def test_refuses_what_cannot_be_read_in_one_line(was, becomes, line, what):
    """It names the line, and the command that explains the mistake."""
    with pytest.raises(FloorPlanError) as caught:
        parse(HOUSE.replace(was, becomes), "house.txt")
    explained = "`python -m reference check house.txt` explains"
    assert f"{caught.value}".startswith(f"house.txt:{line}: {what}")
    assert f"{caught.value}".endswith(explained)
    assert "\n" not in f"{caught.value}"
