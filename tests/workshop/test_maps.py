"""Maps: what is found, what is refused, and what is said about a mistake.

`maps/good` holds drawings that are fine in every tolerated way, `maps/bad` one for each
kind of mistake, `NAME.txt` beside `NAME.expected`, the whole message. The names begin
with the stage: page, characters, shape, floor, building.
"""

import os
import pickle
import re
from pathlib import Path
from threading import Thread
from time import process_time

import pytest
from drawings import HOUSE
from hypothesis import given
from hypothesis import strategies as st

from reference.paper import InputError
from reference.workshop.comparing.matches import begin_evaluation, notes
from reference.workshop.maps import (
    MistakesError,
    find_map,
    load,
    parse_map,
    read_map,
    to_text,
)
from reference.workshop.maps.mistakes import MISTAKE_TEXTS
from reference.workshop.storage import files
from reference.workshop.storage.files import message_of

HERE = Path(__file__).parent
SHIPPED = sorted((HERE.parents[1] / "floors").glob("*.txt"))
GOOD = sorted((HERE / "maps" / "good").glob("*.txt"))
BAD = sorted((HERE / "maps" / "bad").glob("*.txt"))


def named(path):
    """The name of a map, for the report of a test."""
    return path.stem


def refusal(text):
    """What is raised for a drawing that is not fine."""
    with pytest.raises(MistakesError) as caught:
        parse_map(text)
    return caught.value


def drawn(text):
    """The rows of a file as they stand there, without notes and headings."""
    code = (line.partition(";")[0].rstrip() for line in text.splitlines())
    return [line for line in code if line and ":" not in line]


@pytest.mark.paper("A2")
@pytest.mark.paper("A3")
@pytest.mark.paper("A4")
@pytest.mark.parametrize("path", [*GOOD, *SHIPPED], ids=named)
def test_a_good_drawing_is_read_and_drawn_again_as_it_was(path):
    """Text to plan to text is the identity, up to notes and the order of rows."""
    plan = read_map(path)
    rows = {row.rstrip() or "#" for storey in plan.storeys for row in storey.rows}
    assert parse_map(to_text(plan)) == plan
    assert set(drawn(path.read_text())) == rows


# -- What is refused ----------------------------------------------------------------


@pytest.mark.paper("A1")
@pytest.mark.paper("A2")
@pytest.mark.paper("A3")
@pytest.mark.paper("A4")
@pytest.mark.parametrize("path", BAD, ids=named)
def test_refuses_a_drawing_and_says_where_why_and_what_to_type(path, monkeypatch):
    """The whole page of mistakes, as somebody who draws will read it."""
    monkeypatch.chdir(path.parent)
    with pytest.raises(MistakesError) as caught:
        read_map(path.name)
    assert f"{caught.value}\n" == path.with_suffix(".expected").read_text("utf-8")


@pytest.mark.parametrize("kind", MISTAKE_TEXTS)
def test_every_mistake_has_a_map_and_one_thing_to_do(kind):
    """In the imperative; what is too much for a map is drawn by other tests."""
    what, hint = MISTAKE_TEXTS[kind]
    verbs = "Draw|Join|Move|Save|Take|Type|Write"
    assert re.fullmatch(rf"({verbs}) [^\n]+\.", hint)
    limits = ("too-long", "row-limit", "parts-limit", "memory-limit")
    if kind not in (*limits, "not-text"):
        said = re.sub(r"\\{.*?\\}", ".+", re.escape(what))
        pages = [path.with_suffix(".expected").read_text("utf-8") for path in BAD]
        assert any(re.search(rf":\d+: {said}$", page, re.MULTILINE) for page in pages)


def test_a_stage_is_silent_until_the_one_before_is_satisfied():
    """Causes come before consequences: each repair brings the next stage's mistakes."""
    heading = "this heading cannot be read"
    repairs = (
        ("flour 2", "floor 2", f"{heading}; did you mean 'floor NUMBER: NAME'?"),
        ("lab|", "lab#", "'|' has no meaning in a drawing"),
        (".hall..+", ".hall+", "this row has 16 columns, the size says 14"),
        ("###########", "####E######", "the building has no exit"),
    )
    text = HOUSE
    for wrong, right, _ in repairs:
        text = text.replace(right, wrong, 1)
    for wrong, right, what in repairs:
        assert refusal(text).mistakes[0].what == what
        text = text.replace(wrong, right)
    parse_map(text)


def test_the_caret_stands_under_its_column():
    """A tab before it stays a tab, so both lines reach as far."""
    mistake = refusal(HOUSE.replace("desk+map#", "d\tsk\tmap#")).mistakes[-1]
    assert str(mistake).splitlines()[1:3] == ["    #AA+.d\tsk\tmap#", "          \t  ^"]


@pytest.mark.parametrize(
    "raw",
    [
        b"building: B\xfcro\n",
        b"\x89PNG\r\n\x1a\n\0\0",
        HOUSE.encode("utf-16-le"),
        HOUSE.encode("utf-16"),
    ],
    ids=["latin 1", "a picture", "utf-16", "utf-16 with its mark"],
)
def test_refuses_a_file_that_is_not_plain_text(raw, tmp_path):
    """A picture or another encoding gets one message, with its place and what to do."""
    file = tmp_path / "map.txt"
    file.write_bytes(raw)
    with pytest.raises(
        MistakesError, match=r"map.txt:1:\d+: this is not plain text"
    ) as e:
        read_map(file)
    assert {mistake.hint for mistake in e.value.mistakes} == {
        "Save the file as plain text, as UTF-8."
    }


HEAD = "building: x\nsize: 200 x 200\n"


def floors(row):
    """As many floors of one row, each drawn, as a building may have."""
    return HEAD + "".join(f"floor {n}:\n{200 * (row + chr(10))}" for n in range(1, 31))


def cells(wall):
    """Rooms of one square metre, on one floor."""
    rows = ["#" * 199, *["#" + f".{wall}" * 98 + ".#", "#" * 199] * 99]
    return "building: x\nsize: 199 x 199\nfloor 1:\n" + "\n".join(rows)


HUGE = {
    "blanks of another alphabet": HEAD + "floor" + 30_000 * "\u3000" + "\n",
    "rows without end": HEAD + "floor 1:\n" + 1_000_000 * "##\n",
    "a heading without end": HEAD + "colour" + 2_000_000 * "x" + ": red\n",
    "a size nobody can have": f"building: x\nsize: 100000x3\nfloor 1:\n{100_000 * '#'}",
    "words with exits beside them": floors("EABE#" * 40),
    "floors of doors": floors("+#" * 100),
    "floors of names": floors("a." * 100),
    "ten thousand rooms and doors": cells("+"),
    "one row of two million": f"{HEAD}floor 1:\n{2_000_000 * '#'}" + 11_000 * "\n#",
    "commas between all signs": HEAD + "floor 1:\n" + 11_000 * f"{99 * '#,'}#\n",
    "brackets that nobody closes": 11_900 * f"{190 * '['}\n",
    "quotes and blanks": 1_100 * f"{chr(34) * 2}{1_900 * ' '}x\n",
}


def refused(text):
    """The whole message about a text, and the seconds until it comes."""
    start = process_time()
    return str(refusal(text)), process_time() - start


WALLS = min(refused(floors("#" * 200))[1] for _ in range(2))
"""Seconds for the largest building of nothing but walls."""


@pytest.mark.parametrize("text", HUGE.values(), ids=HUGE)
def test_refuses_a_huge_text_at_once_and_in_few_words(text):
    """None takes much longer than plain walls, and none is repeated on the screen."""
    message, seconds = refused(text)
    assert seconds < 5 * WALLS
    assert len(message) < 4_000


def test_says_how_much_it_reads():
    """A file ends where the largest building would, with as many notes as rows."""
    mistake = refusal(HUGE["rows without end"]).mistakes[0]
    assert mistake.what.startswith("a file has at most 12000 lines")
    assert mistake.line == 12_001
    parse_map(HOUSE + 10_000 * "; a note\n")


@pytest.mark.parametrize("last", [31, 101])
def test_floors_too_many_are_told_before_a_heading_is(last):
    """A number of three digits is no heading, and another one would not help."""
    floor = "floor {}:\n#####\n#...E\n#####\n"
    floors = [floor.format(number) for number in range(1, last + 1)]
    (mistake,) = refusal("building: x\nsize: 5 x 3\n" + "".join(floors)).mistakes
    assert mistake.what == "a building has at most 30 floors"
    assert mistake.written == "floor 31:"


@pytest.mark.parametrize("sign", "AE.")
def test_counts_stairwells_and_exits_among_rooms_and_doors(sign):
    """All of them have a 16-bit number in a building's cells."""
    rows = cells("#").splitlines()
    step = 6 if sign == "A" else 2  # more of them would be a letter for floor
    rows[4::step] = [row.replace(".", sign) for row in rows[4::step]]
    (mistake,) = refusal("\n".join(rows)).mistakes
    assert mistake.what == "a building has at most 5000 rooms and as many doors"


def test_refuses_a_building_whose_tables_would_not_fit_into_memory():
    """It says how much they take, instead of filling the machine later."""
    rows = ["#" * 200, *["#" + "." * 198 + "E"] * 198, "#" * 200]
    text = HEAD + "floor 1-{}:\n" + "\n".join(rows)
    what = "to simulate this building takes about 8 GB of memory"
    assert [mistake.what for mistake in refusal(text.format(30)).mistakes] == [what]
    parse_map(text.format(5))


def test_reads_a_pipe_to_its_end(tmp_path):
    """So `cat map.txt | python -m reference check /dev/stdin` works."""
    path = tmp_path / "map.txt"
    os.mkfifo(path)
    Thread(target=path.write_text, args=(HOUSE,), daemon=True).start()
    assert read_map(path) == parse_map(HOUSE)


def test_what_a_pipe_held_has_not_changed(tmp_path):
    """It is not read again, nor waited for: nobody says that the map is another."""
    path = tmp_path / "map.txt"
    os.mkfifo(path)
    Thread(target=path.write_text, args=(HOUSE,), daemon=True).start()
    evaluation = begin_evaluation(building=str(path), people=2)
    assert evaluation.arena.drawn.drawing == parse_map(HOUSE)
    assert notes(evaluation) == []


def test_refuses_a_pipe_that_nobody_writes_to(tmp_path, monkeypatch):
    """The system would wait for a writer for ever."""
    monkeypatch.setattr(files, "PIPE_SECONDS", 0.01)
    path = tmp_path / "map.txt"
    os.mkfifo(path)
    with pytest.raises(InputError, match="is a pipe that nobody writes to"):
        read_map(path)


def test_refuses_an_endless_device(tmp_path):
    """No more of it is read than of the largest drawing."""
    path = tmp_path / "map.txt"
    path.symlink_to("/dev/zero")
    with pytest.raises(MistakesError, match=r"map.txt:1:1: a file has at most"):
        read_map(path)


def test_refuses_a_folder_and_a_missing_file_in_words(tmp_path):
    """What the system says, with the file's name."""
    for name in (tmp_path, tmp_path / "map.txt"):
        with pytest.raises(OSError) as caught:
            read_map(name)
        assert message_of(caught.value).startswith(f"{name}: cannot be read")
    with pytest.raises(OSError, match="File name too long"):
        find_map(300 * "x")


SCRIBBLES = st.tuples(
    st.integers(0, len(HOUSE)),
    st.sampled_from([0, 1, 15]),
    st.text("#.+EABCD abcxyz;:\t|-19XZ\n\r\0é広", max_size=2),
)
"""Where, how much is taken out, and what is put there."""


@given(st.lists(SCRIBBLES, max_size=6))
def test_refuses_a_scribbled_drawing_only_in_its_own_words(scribbles):
    """However a drawing is spoilt, it is read or explained, and the place exists."""
    text = HOUSE
    for place, out, sign in scribbles:
        text = text[:place] + sign + text[place + out :]
    try:
        parse_map(text)
    except MistakesError as error:
        lines = re.split(r"\r\n?|\n", text)
        assert all(m.written == lines[m.line - 1] for m in error.mistakes)
        assert all(m.column >= 1 for m in error.mistakes) and str(error)


# -- Where floors are found ---------------------------------------------------------


@pytest.mark.usefixtures("in_an_empty_folder")
def test_a_floor_is_found_by_its_path_or_by_the_name_it_ships_under(tmp_path):
    """A student's own file and `paper`, also where a folder or a file is called so."""
    own = tmp_path / "paper.txt"
    own.write_text(HOUSE)
    assert find_map(own) == own
    own.rename(tmp_path / "mine.txt")
    (tmp_path / "paper").mkdir()
    assert find_map("paper") in SHIPPED
    assert find_map("paper.txt") == find_map("paper")
    (tmp_path / "paper").rmdir()
    (tmp_path / "paper").write_text(HOUSE)
    assert find_map("paper") in SHIPPED
    assert find_map("./paper") == Path("paper")


@pytest.mark.parametrize("name", [3, None, b"tiny", ["tiny"]])
def test_refuses_to_load_what_names_no_map(name):
    """It says what it takes."""
    with pytest.raises(InputError, match="load takes the name of a map that ships"):
        load(name)


def test_refuses_an_unknown_floor_and_names_those_that_ship():
    """The closest match comes first: most are slips of the pen."""
    with pytest.raises(FileNotFoundError) as caught:
        find_map("papper")
    assert "Did you mean 'paper'?" in str(caught.value)
    assert all(path.stem in str(caught.value) for path in SHIPPED)


@pytest.mark.parametrize(
    ("name", "error", "said"),
    [
        ("", FileNotFoundError, "there is no floor file ''"),
        (".", IsADirectoryError, "'.' is a folder, no floor file"),
        ("here", IsADirectoryError, "'here' is a folder, no floor file"),
    ],
)
def test_a_folder_is_no_floor_file(name, error, said, tmp_path, monkeypatch):
    """Nor is a name without a letter; the hint says what ships."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "here").mkdir()
    with pytest.raises(error) as caught:
        find_map(name)
    assert str(caught.value).startswith(said)
    assert "a name that ships: maze, museum" in str(caught.value)


def test_nobody_can_write_into_a_building_that_others_load():
    """Who loads the same map gets the same object; an array's copy is one's own."""
    tiny = load("tiny")
    assert load("tiny") is tiny
    of_parts = [part.cells for part in (*tiny.areas, *tiny.landmarks, *tiny.stairwells)]
    for cells in (tiny.signs, tiny.area, tiny.landmark, tiny.kind, *of_parts):
        with pytest.raises(ValueError, match="read-only"):
            cells[0] = cells[0]
    with pytest.raises(ValueError, match="read-only"):
        tiny.walkable[:] = True
    assert tiny.walkable.copy().flags.writeable


def test_mistakes_travel_between_processes():
    """A job with a bad map fails with its page, and not the pool."""
    error = refusal("floor 1:\n####\n#..#\n####\n")
    again = pickle.loads(pickle.dumps(error))
    assert (str(again), again.mistakes) == (str(error), error.mistakes)
