"""Hints that are followed: each brings a plan nearer to a map that is fine.

`maps/cases` holds plans as people draw and send them, `NAME.txt` beside `NAME.fixed`,
what is right. `disguises` makes more of them from the maps that ship.
"""

import json
from pathlib import Path
from random import Random

import pytest
from disguises import disguise
from drawings import HOUSE
from refusals import refusal

from reference.__main__ import main
from reference.workshop.maps import FINE, MistakesError, parse_map, to_text
from reference.workshop.maps.repairs import follow_hints, repair_text
from reference.workshop.maps.wrapping import find_wrapping

HERE = Path(__file__).parent / "maps"
SHIPPED = sorted((HERE.parents[2] / "floors").glob("*.txt"))
GOOD = sorted((HERE / "good").glob("*.txt"))
BAD = sorted((HERE / "bad").glob("*.txt"))
CASES = sorted((HERE / "cases").glob("*.txt"))
ROUNDS = 3


def named(path):
    """The name of a map, for the report of a test."""
    return path.stem


def standing(text):
    """The stage that finds mistakes and, below 0, how many; and the mistakes."""
    try:
        parse_map(text)
    except MistakesError as error:
        return (error.stage, -len(error.mistakes)), error.mistakes
    return FINE, []


def told(text):
    """What is wrong with a text, in words."""
    return [mistake.what for mistake in standing(text)[1]]


# -- Plans that people send ---------------------------------------------------------


@pytest.mark.parametrize("path", CASES, ids=named)
def test_a_plan_is_right_after_three_rounds_of_its_hints(path):
    """Whoever does what is said arrives, and at the plan that was meant."""
    repair = repair_text(path.read_text())
    assert repair.left is None and len(repair.rounds) <= ROUNDS
    assert repair.text == path.with_suffix(".fixed").read_text()


@pytest.mark.parametrize("path", SHIPPED, ids=named)
def test_of_ten_disguises_of_a_map_nine_are_right_after_three_rounds(path):
    """And right means as it was: rooms, doors and exits in their places."""
    text = path.read_text()
    right = 0
    for number in range(10):
        repair = repair_text(disguise(text, number))
        fine = repair.left is None and len(repair.rounds) <= ROUNDS
        right += fine and _differ(repair.text, text) <= 20
    assert right >= 9


def _differ(text, other):
    """How many cells of two plans are drawn in another way; letters of names count."""
    pairs = zip(parse_map(text).storeys, parse_map(other).storeys, strict=True)
    signs = [
        zip("".join(one.rows), "".join(two.rows), strict=True) for one, two in pairs
    ]
    return sum(a != b for floor in signs for a, b in floor)


@pytest.mark.parametrize("path", [*GOOD, *SHIPPED], ids=named)
def test_nothing_is_taken_off_a_plan_that_is_fine(path):
    """No wall for a mark, no note for a listing."""
    found = find_wrapping(path.read_text().splitlines())
    assert not (found.words or found.bare or found.listing)


FLAT = """building: Flat
size: 13 x 5
floor 1:
#############
#...#...#...#
E...+...+...#
#...#...#...#
#############
"""


def each_row(change):
    """The flat with something done to each of its rows."""
    head, rows = FLAT.splitlines()[:3], FLAT.splitlines()[3:]
    return "\n".join([*head, *map(change, rows)])


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (",".join, "',' stands between all signs"),
        (" ".join, "blanks stand between all signs"),
        ("  ".join, "blanks stand between all signs"),
        (";".join, "';' stands between all signs"),
        ("\t".join, r"'\t' stands between all signs"),
        (lambda row: f"[{', '.join(map(repr, row))}],", "',' stands between all signs"),
        (lambda row: f"> {row}", "each row begins with '> '"),
        (lambda row: f"// {row}", "each row begins with '// '"),
        (lambda row: f"'{row}',", 'each row stands between "\'" and "\',"'),
        (lambda row: f"| {' | '.join(row)} |", "'|' stands between all signs"),
    ],
)
def test_what_is_around_rows_or_between_signs_is_told_once_before_any_sign(
    change, words
):
    """One message, the first; obeyed, the plan is as it was."""
    text = each_row(change)
    assert told(text) == [words]
    assert parse_map(repair_text(text).text) == parse_map(FLAT)


@pytest.mark.parametrize(
    ("sign", "other", "words"),
    [
        (".", "f", "'f' stands in too many places to name a room"),
        (".", "F", "'F' stands in too many places to name a room"),
        (".", "B", "'B' stands in too many places to name a room"),
        ("#", "W", "'W' stands around the plan, and names no room"),
        ("#", "w", "'w' stands around the plan, and names no room"),
        ("#", "C", "'C' stands around the plan, and names no room"),
        ("+", "d", "'d' stands in a gap between walls, and names no room"),
        ("+", "D", "'D' stands in a gap between walls, and names no room"),
        ("E", "X", "'X' has no meaning in the outer wall"),
        ("E", "e", "'e' has no meaning in the outer wall"),
    ],
)
def test_a_letter_is_read_by_where_it_stands(sign, other, words):
    """All over rooms it is floor, around the plan a wall, in a gap a door."""
    head, _, rows = FLAT.partition("floor 1:\n")
    text = f"{head}floor 1:\n{rows.replace(sign, other)}"
    assert told(text) == [words]
    assert parse_map(repair_text(text).text) == parse_map(FLAT)


@pytest.mark.parametrize("wall", "█@%")
def test_walls_of_another_sign_around_blank_rooms_separate_no_signs(wall):
    """Though they stand in every row, and often."""
    head, _, rows = FLAT.replace("...", "....").replace("13", "16").partition("floor")
    rows = rows.replace("#############", "################")
    plan = f"{head}floor{rows}"
    drawn = rows.replace("#", wall).replace(".", " ")
    assert parse_map(repair_text(f"{head}floor{drawn}").text) == parse_map(plan)


@pytest.mark.parametrize("sign", ["<", "%", "s", "1", "S", "a"])
def test_a_sign_closed_in_on_two_floors_is_a_stairwell(sign):
    """Whatever it is, though a name may have it, too."""
    text = HOUSE.replace("14 x 5", "14 x 6")
    for row in ("#AA+.hall+lab#", "#AA+.desk+map#"):
        text = text.replace(row, f"#AA#.....#...#\n{row}")
    text = text.replace("   ###########\n####", "##############\n####")
    spoilt = text.replace("AA", 2 * sign)
    assert parse_map(repair_text(spoilt).text) == parse_map(text)


def test_a_name_that_fills_its_room_on_two_floors_is_no_stairwell():
    """As long as it stands in one row."""
    text = HOUSE.replace("lab", "sss").replace("map", "sss")
    parse_map(text.replace("....#...#", "....#####"))


def test_a_name_keeps_the_letter_that_is_drawn_for_floor():
    """Inside its word; at its ends nobody can tell."""
    text = HOUSE.replace(".", "e").replace("Ee", "E.")
    fixed = parse_map(repair_text(text).text)
    assert ".desk+map#" in fixed.storeys[1].rows[2]


# -- Tabs ---------------------------------------------------------------------------


@pytest.mark.parametrize("width", [2, 3, 4, 8])
@pytest.mark.parametrize("path", [*GOOD, *SHIPPED], ids=named)
def test_an_editors_tabs_become_the_blanks_they_stood_for(path, width):
    """Whatever its stops, and wherever a row ends."""

    def with_tabs(line):
        tabs, blanks = divmod(len(line) - len(line.lstrip(" ")), width)
        return tabs * "\t" + blanks * " " + line.lstrip(" ")

    text = path.read_text()
    repair = repair_text("\n".join(map(with_tabs, text.split("\n"))))
    assert len(repair.rounds) <= 1
    assert parse_map(repair.text) == parse_map(text)


@pytest.mark.parametrize(
    ("right", "wrong"),
    [
        ("#...#...#...#", "#\t#...#...#"),
        ("#...#...#...#", "#...#\t#...#"),
        ("#############", "####\t#####"),
    ],
)
def test_a_tab_between_two_walls_is_a_room_and_in_a_wall_a_wall(right, wrong):
    """An empty room is not walled up."""
    text = FLAT.replace(right, wrong, 1)
    assert parse_map(repair_text(text).text) == parse_map(FLAT)


# -- Signs as wide as two -----------------------------------------------------------

HALL = "\N{CJK UNIFIED IDEOGRAPH-5927}\N{CJK UNIFIED IDEOGRAPH-5EF3}"


@pytest.mark.parametrize(
    ("drawn", "meant"),
    [
        ({"hall": HALL}, {"hall": "...."}),
        ({"hall": HALL, "desk": HALL}, {"hall": "....", "desk": "...."}),
        ({"hall": HALL[0] + ".."}, {"hall": "...."}),
        ({"hall": HALL + ".."}, {"hall": "...."}),
        ({"hall": HALL + HALL}, {"hall": "...."}),
        ({"hall": "\uff48\uff41.."}, {"hall": "ha.."}),
        ({"hall": "\uff48\uff41"}, {"hall": "ha.."}),
        ({"lab": "\N{TOILET}."}, {"lab": "..."}),
    ],
)
def test_a_sign_as_wide_as_two_is_one_column_or_two_as_the_row_needs(drawn, meant):
    """Two in a row that is drawn in a terminal, one if each was typed for a cell."""
    text, right = HOUSE, HOUSE
    for name, signs in drawn.items():
        text = text.replace(name, signs)
        right = right.replace(name, meant[name])
    assert parse_map(repair_text(text).text) == parse_map(right)


def test_three_points_that_a_word_processor_joined_are_three_again():
    """In each row that is so much shorter; its hint says it."""
    ellipsis = "\N{HORIZONTAL ELLIPSIS}"
    text = HOUSE.replace("...", ellipsis)
    assert {mistake.hint for mistake in standing(text)[1]} == {"Type '...' instead."}
    assert repair_text(text).text == HOUSE
    one_each = HOUSE.replace(".....", 5 * ellipsis)
    assert repair_text(one_each).text == HOUSE


# -- Gaps ---------------------------------------------------------------------------


@pytest.mark.parametrize("words", ["hall+lab", "desk+map"])
def test_two_names_that_a_gap_joins_stay_and_the_gap_becomes_a_door(words):
    """It is told where it is; nobody has to look for it."""
    text = HOUSE.replace(words, words.replace("+", "."))
    place = HOUSE.index(words) + 4
    line = HOUSE.count("\n", 0, place) + 1
    column = place - HOUSE.rfind("\n", 0, place)
    (mistake,) = standing(text)[1]
    assert f"Type '+' at {line}:{column} for a door" in mistake.hint
    assert repair_text(text).text == HOUSE


def test_no_gap_is_told_where_two_parts_are_joined_twice():
    """A door in one of two gaps would divide nothing."""
    text = HOUSE.replace("hall+lab", "hall.lab").replace(
        "####.....#...#", "####.........#", 1
    )
    assert told(text) == [
        "'lab' is written in a room that has its name already, 'hall'"
    ]
    assert "Type '.' instead of it" in standing(text)[1][0].hint


# -- Comments -----------------------------------------------------------------------

COMMENTS = {
    "a hash": "# my comment",
    "a hash and two words": "#two words",
    "with an exit's letter": "# from A to E",
    "slashes": "// my office map",
    "as in C": "/* my office map */",
    "a block as in C": "/*\n * my map\n */",
    "dashes": "-- drawn by hand",
    "a list": "* the lab is new",
    "of a title": "## My map (2026): draft",
    "a block": "#\n# my map\n# ======",
}
PLACES = ["building", "size", "floor 1", "   ###########\n####", "floor 2"]


@pytest.mark.parametrize("before", PLACES)
@pytest.mark.parametrize("comment", COMMENTS.values(), ids=COMMENTS)
def test_a_comment_of_another_language_becomes_a_note_wherever_nothing_is_drawn(
    comment, before
):
    """It is no storey, no row and no heading; the drawing is as it was."""
    text = HOUSE.replace(before, f"{comment}\n{before}", 1)
    assert {*told(text)} == {"this is a comment as in code; a note begins with ';'"}
    repair = repair_text(text)
    assert len(repair.rounds) == 1
    assert parse_map(repair.text) == parse_map(HOUSE)
    assert repair.text.count(";") == comment.count("\n") + 1


@pytest.mark.parametrize("before", ["building", "size"])
@pytest.mark.parametrize(
    "comment",
    ["# c", "#c", "#", "// c", "//", "/* c */", "-- c", "# my_map", "# (c) X"],
)
def test_a_comment_above_the_first_heading_may_be_short(comment, before):
    """Nothing is drawn there."""
    head, rest = HOUSE.split("\n", 1)
    size_first = rest.replace("floor", f"{head}\nfloor", 1)
    text = f"{comment}\n{HOUSE if before == 'building' else size_first}"
    assert told(text) == ["this is a comment as in code; a note begins with ';'"]
    assert parse_map(repair_text(text).text) == parse_map(HOUSE)


@pytest.mark.parametrize("row", ["#", "#  lab  E", "#E"])
def test_a_row_above_a_name_that_stands_too_low_is_no_comment(row):
    """There a floor's heading is the first."""
    rows = FLAT.splitlines()
    rows[5] = row
    rows.append(rows.pop(0))
    assert "a comment" not in " ".join(told("\n".join(rows)))


@pytest.mark.parametrize("row", ["#  hall  lab  E", "#  lab  #", "#AA  lab#"])
def test_a_row_of_words_is_no_comment(row):
    """Among rows a wall is `#` too, and a blank may be drawn for floor."""
    rows = FLAT.splitlines()
    rows[5] = row
    assert "a comment" not in " ".join(told("\n".join(rows)))


@pytest.mark.parametrize(
    "lines",
    [
        ["         1", "12345678901234"],
        ["1    5    10"],
        ["    1    2    3"],
    ],
)
def test_a_ruler_above_a_drawing_is_no_row(lines):
    """It counts columns: `;` makes a note of it."""
    text = HOUSE.replace("ground\n", "\n".join(["ground", *lines, ""]))
    repair = repair_text(text)
    assert {*told(text)} == {"this line is no row of a drawing"}
    assert (repair.left, len(repair.rounds)) == (None, 1)


@pytest.mark.parametrize(
    ("words", "typed"),
    [
        ("Second floor", "floor 2: Second floor"),
        ("level 2 upstairs", "floor 2: level 2 upstairs"),
        (
            "The lab is new\n\nfloor 2: upstairs",
            "; The lab is new\n\nfloor 2: upstairs",
        ),
    ],
)
def test_words_between_two_drawings_are_a_heading_or_a_note(words, typed):
    """A heading where they name a storey; they are told once."""
    text = HOUSE.replace("floor 2: upstairs", words)
    assert len(told(text)) == 1
    assert repair_text(text).text == HOUSE.replace("floor 2: upstairs", typed)


# -- Hints --------------------------------------------------------------------------


@pytest.mark.parametrize("note", ["; wall of room #", ";E", "   ; ##", "; way out E"])
@pytest.mark.parametrize("size", ["14 x 5", "16 x 5"])
def test_a_note_behind_a_row_stays_a_note_whatever_it_ends_with(note, size):
    """It had been drawn: what makes a row too wide stands between no signs of it."""
    row = "#AA+.hall+lab#"
    text = HOUSE.replace(row, f"{row}{note}").replace("14 x 5", size)
    repair = repair_text(text.replace(".....", "..,.."))
    assert (repair.text, repair.left) == (text, None)


@pytest.mark.parametrize("words", ["<- north", "north wing", "the way out (E)"])
@pytest.mark.parametrize("row", ["   ###########", "#AA+.hall+lab#", "#AA+.desk+map#"])
def test_words_behind_a_row_become_a_note(words, row):
    """What is beyond the width and apart draws nothing."""
    text = HOUSE.replace(row, f"{row}  {words}", 1)
    assert told(text) == ["words stand behind this row, outside the drawing"]
    repair = repair_text(text)
    assert (repair.text, repair.left) == (text.replace(words, f"; {words}"), None)


@pytest.mark.parametrize("path", [*BAD, *CASES], ids=named)
def test_every_hint_obeyed_leaves_fewer_mistakes(path):
    """Each by itself and all together: fewer of its stage, or a later stage."""
    text = path.read_text()
    before, mistakes = standing(text)
    typed = [mistake for mistake in mistakes if mistake.edits]
    for mistake in typed:
        assert standing(follow_hints(text, [mistake]))[0] > before, mistake
    if typed:
        assert standing(follow_hints(text, mistakes))[0] > before


@pytest.mark.parametrize(
    "heading",
    [
        "floor 2 upstairs",
        "floor two: upstairs",
        "floor 2 - upstairs",
        "flor: upstairs",
        "2nd floor: upstairs",
        "flo+r 2: upstairs",
    ],
)
def test_a_heading_keeps_its_name_and_nothing_else(heading):
    """Neither its number, nor a word for that, nor what stands between."""
    text = HOUSE.replace("floor 2: upstairs", heading)
    assert repair_text(text).text == HOUSE


@pytest.mark.parametrize("words", ["ab 1", "lab 1", "ab 22"])
def test_a_name_with_a_number_behind_it_is_one_word(words):
    """It is told once, not the number for a room of its own."""
    text = HOUSE.replace("####.....#...#", f"####{words:.<5}#...#", 1).replace(
        "hall", "...."
    )
    name = words.replace(" ", "")
    right = HOUSE.replace("####.....#...#", f"####{name:.<5}#...#", 1)
    assert parse_map(repair_text(text).text) == parse_map(right.replace("hall", "...."))
    assert len(standing(text)[1]) == 1


@pytest.mark.parametrize(
    ("heading", "right"),
    [
        ("floors 2-4: upstairs", "floor 2-4: upstairs"),
        ("floor 2 - 4 upstairs", "floor 2-4: upstairs"),
        ("level 2 to 4: upstairs", "floor 2-4: upstairs"),
        ("floor 3-5: upstairs", "floor 2-4: upstairs"),
        ("floor 2-300: upstairs", None),
        ("floor 4-2: upstairs", None),
    ],
)
def test_a_range_of_floors_is_never_shortened(heading, right):
    """As many floors are built as were drawn at once, or nothing is typed."""
    text = HOUSE.replace("floor 2: upstairs", heading)
    repair = repair_text(text)
    assert repair.text == (HOUSE.replace("floor 2: upstairs", right) if right else text)


@pytest.mark.parametrize("numbers", [(2, 1), (1, 0)])
def test_a_plan_drawn_top_floor_first_is_moved_by_hand(numbers):
    """With other numbers the upper floor would be the ground, and get an exit."""
    head, ground, upstairs = HOUSE.split("\nfloor ")
    above, below = numbers
    text = f"{head}\nfloor {above}{upstairs[1:]}\nfloor {below}{ground[1:]}"
    assert "Move the drawings" in standing(text)[1][0].hint
    assert repair_text(text).text == text


def test_no_exit_is_typed_upstairs_where_stairs_are_missing():
    """Nobody leaves through the wall of an upper floor; stairs are drawn by hand."""
    text = HOUSE.replace("#AA+", "####")
    repair = repair_text(text)
    (mistake,) = repair.left.mistakes
    assert repair.text == text
    assert mistake.what == "no way leads from room 'desk' to an exit"
    assert mistake.hint.startswith("Draw stairs down, or '+' to a room that has some")


@pytest.mark.parametrize(
    ("row", "told_at"),
    [("####.....#...#", "7:1"), ("#AA+.hall+lab#", "8:1"), ("####.bath#...#", None)],
)
def test_only_a_doubled_row_is_taken_out_and_told_by_its_line(row, told_at):
    """Where no row is doubled, nobody can tell which one is too many."""
    at = HOUSE.index(HOUSE.splitlines()[6] if "hall" in row else "####.....#...#")
    text = HOUSE[:at] + row + "\n" + HOUSE[at:]
    repair = repair_text(text)
    (mistake,) = standing(text)[1]
    if told_at:
        assert mistake.place == told_at and "Take out this row" in mistake.hint
        assert repair.text == HOUSE
    else:
        assert repair.text == text


@pytest.mark.parametrize(
    ("wrong", "right"),
    [
        ("##AA.desk", "#AA+.desk"),
        ("##AA+desk", "#AA+.desk"),
        ("#AAA.desk", "#AA+.desk"),
        ("#A.+.desk", "#AA+.desk"),
        ("#A...desk", "#AA+.desk"),
    ],
)
def test_a_stairwell_out_of_line_is_told_first_and_put_back_at_once(wrong, right):
    """Before the walls and doors that touch it; floor comes where it stood."""
    text = HOUSE.replace(right, wrong)
    if wrong == "#A...desk":  # a room is in its way: nothing is typed
        wrong = right = ""
    assert told(text) == ["stairwell A does not stand on floor 2 as on floor 1"]
    repair = repair_text(text)
    assert len(repair.rounds) == bool(right)
    assert parse_map(repair.text) == parse_map(HOUSE) if right else repair.left


def test_of_three_storeys_the_one_that_differs_is_told():
    """The lowest is not always right."""
    top = HOUSE[HOUSE.index("floor 2") :].replace("floor 2", "floor 3")
    text = f"{HOUSE}\n{top}".replace("#AA+.hall", "##AA+hall")
    assert told(text) == ["stairwell A does not stand on floor 1 as on floor 2"]


def test_hints_that_lead_back_are_not_followed():
    """With A for B the stairwell would be out of line, which is an earlier stage."""
    text = HOUSE.replace("####.", "##B#.", 1)
    repair = repair_text(text)
    assert repair.text == text and not repair.rounds
    assert repair.left.mistakes[0].what == "stairwell B is open to stairwell A"


@pytest.mark.parametrize("signs", ["AA.", ".AA", "A.."])
def test_floor_typed_in_a_shaft_is_no_room_in_the_way(signs):
    """All of it lies where the stairwell should be."""
    text = HOUSE.replace("AA", "AAA").replace("14 x", "15 x").replace("   #", "    #")
    text = text.replace("####.", "#####.")
    spoilt = text.replace("#AAA+.desk", f"#{signs}+.desk")
    assert parse_map(repair_text(spoilt).text) == parse_map(text)


SPOILS = "#.+EABCD abcxyz:|-19XZ\n\N{LATIN SMALL LETTER E WITH ACUTE}"


def test_hints_end_and_lead_further_however_a_plan_is_spoilt():
    """Of a hundred spoilt by lot four in five come right; none comes out worse."""
    right = 0
    for number in range(100):
        lot = Random(number)
        text = HOUSE
        for _ in range(lot.randint(1, 3)):
            place = lot.randrange(len(text))
            signs = "".join(lot.choices(SPOILS, k=lot.randint(0, 2)))
            text = text[:place] + signs + text[place + lot.randint(0, 2) :]
        repair = repair_text(text)
        right += repair.left is None
        assert standing(repair.text)[0] >= standing(text)[0]
    assert right >= 80


# -- check --fix --------------------------------------------------------------------


@pytest.fixture
def plan(in_an_empty_folder, tmp_path):
    """A plan with marks before its rows, in the current folder."""
    path = tmp_path / "plan.txt"
    path.write_text("".join(f"> {line}\n" for line in FLAT.splitlines()))
    return path


def test_fix_writes_a_new_map_and_says_what_it_changed(plan, capsys):
    """The old one stays; what comes next can be typed."""
    old = plan.read_text()
    assert main(["check", "plan.txt", "--fix"]) == 0
    said = capsys.readouterr()
    assert said.out.splitlines() == [
        "written: plan-fixed.txt",
        "round 1; of two remedies the first was taken:",
        "  1:1: each row begins with '> '. Take this out of all rows.",
        "ok: Flat, floors 1, rooms [3], doors 2, exits 1, stairwells 0",
    ]
    assert said.err == "next: python -m reference draw plan-fixed.txt\n"
    assert plan.read_text() == old
    assert plan.with_name("plan-fixed.txt").read_text() == FLAT


def test_fix_writes_over_nothing(plan, capsys):
    """Each time another name; the fix of a fix counts on."""
    for name in ("plan-fixed", "plan-fixed-2", "plan-fixed-3"):
        assert main(["check", "plan.txt", "--fix", "--json"]) == 0
        report = json.loads(capsys.readouterr().out)
        assert report["written"] == f"{name}.txt"
        assert [len(changes) for changes in report["changes"]] == [1]
    spoilt = plan.with_name("plan-fixed-2.txt")
    spoilt.write_text(FLAT.replace("+", "|"))
    assert main(["check", spoilt.name, "--fix"]) == 0
    assert capsys.readouterr().out.startswith("written: plan-fixed-4.txt\n")


def test_fix_writes_nothing_where_nothing_is_wrong(plan, capsys):
    """It says so, and what is in the map."""
    plan.write_text(FLAT)
    assert main(["check", "plan.txt", "--fix"]) == 0
    said = capsys.readouterr()
    assert said.out.startswith("ok: Flat")
    assert said.err == "nothing to fix: no file is written\n"
    assert [path.name for path in plan.parent.iterdir()] == ["plan.txt"]


@pytest.mark.parametrize(
    ("left", "what"),
    [
        (b"building: Flat\n", "no floor is drawn"),
        (b"building: Flat\r\rhello", "no floor is drawn"),
        (b"\x89PNG\r\n\x1a\n\0\xff\x93", "this is not plain text in UTF-8"),
        (100 * b"\0", "this is not plain text in UTF-8"),
    ],
)
def test_refuses_to_fix_what_no_hint_can(left, what, plan, capsys):
    """Nothing is drawn: somebody has to draw; a picture is no map."""
    plan.write_bytes(left)
    status, page = refusal(capsys, "check", "plan.txt", "--fix")
    assert status == 1 and what in page
    assert "nothing is written: what --fix could type leads no further\n" in page
    assert [path.name for path in plan.parent.iterdir()] == ["plan.txt"]


def test_fix_says_what_is_left_to_do(plan, capsys):
    """What can be done is written; the rest is explained in the new file."""
    plan.write_text(FLAT.replace("floor 1:", "flor 1:").replace(".", "#"))
    assert main(["check", "plan.txt", "--fix"]) == 1
    said = capsys.readouterr()
    assert said.out.startswith("written: plan-fixed.txt\n")
    assert "plan-fixed.txt:3:1: no room is drawn on floor 1" in said.err
    assert said.err.endswith("next: python -m reference check plan-fixed.txt --watch\n")


@pytest.mark.parametrize("encoding", ["utf-16", "utf-16-le", "utf-16-be", "cp1252"])
def test_fix_saves_another_encoding_as_utf_8(encoding, plan, capsys):
    """As the hint says; it is the first that is told."""
    plan.write_bytes(FLAT.replace("Flat", "Fl\u00e4t").encode(encoding))
    assert main(["check", "plan.txt"]) == 1
    page = capsys.readouterr().err
    assert "hint: Save the file as plain text, as UTF-8." in page
    assert page.endswith("next: python -m reference check plan.txt --fix\n")
    assert main(["check", "plan.txt", "--fix"]) == 0
    fixed = plan.with_name("plan-fixed.txt").read_text("utf-8")
    assert parse_map(fixed) == parse_map(to_text(parse_map(FLAT)))


def test_refuses_to_fix_a_pipe_or_while_watching(plan, capsys):
    """A new file stands beside an old one, and is written once."""
    status, said = refusal(capsys, "check", "/dev/null", "--fix")
    assert status == 1 and "Name a file." in said
    status, said = refusal(capsys, "check", "plan.txt", "--fix", "--watch")
    assert (status, said) == (2, "--fix, --watch: they exclude each other.\n")
