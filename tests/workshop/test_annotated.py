"""The annotated paper: all of the appendix, beside its code and its tests."""

import re
from base64 import b64decode
from html import unescape
from io import BytesIO
from xml.etree import ElementTree

import numpy as np
import pytest
from conftest import ROOT
from matplotlib.colors import to_rgb
from paper_index import asked_for
from PIL import Image

from reference.__main__ import main
from reference.building import Kind
from reference.paper import TABLE_I
from reference.workshop import drawing
from reference.workshop.annotated import index
from reference.workshop.annotated.index import (
    boards_of,
    captioned_boards,
    code_of,
    marked_tests,
    marked_with,
)
from reference.workshop.annotated.page import anchor, snippet
from reference.workshop.annotated.words import (
    ANNOTATIONS,
    CLAUSES,
    KINDS,
    TITLES,
    keys_named_in,
)
from reference.workshop.drawing.annotated import data_uri
from reference.workshop.drawing.page import COLOURS
from reference.workshop.maps import load

LARGEST = 1_600_000  # bytes of the page


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    """The file of the page, written by the command."""
    path = tmp_path_factory.mktemp("paper") / "paper.html"
    assert main(["paper", "-o", str(path)]) == 0
    return path


@pytest.fixture(scope="module")
def elements(page):
    """The page's elements by their ids, and all of them; it is well-formed XML too."""
    everything = list(ElementTree.parse(page).iter())
    return {e.get("id"): e for e in everything if e.get("id")}, everything


def text_of(element):
    """What one reads in an element."""
    return " ".join("".join(element.itertext()).split())


# -- The page -----------------------------------------------------------------------


SAID = [
    place
    for place, said in TITLES.items()
    if place not in CLAUSES and place[:-1] != "Alg. " and said != "end"
]
"""Lines, equations, tables and figures; "end" says nothing of its own."""


@pytest.mark.parametrize("place", SAID)
def test_each_place_of_the_paper_stands_beside_its_code_and_tests(place, elements):
    """By file and line; none is without."""
    code = code_of(place)
    tests = marked_with(place)
    assert code and tests
    shown = text_of(elements[0][anchor(place)])
    if place[:3] in ("Alg", "Eq."):
        for cited in code:
            assert (cited.where if cited.code else cited.symbol.where) in shown
        assert all(test.where in shown and test.title in shown for test in tests)


ENDS = {"Alg. 1": [4, 9, 12, 13], "Alg. 2": [4, 10, 18, 21, 22, 23], "Alg. 3": [6, 8]}
"""Printed lines that say no more than "end"; an algorithm's last line does."""


@pytest.mark.parametrize("name", ENDS)
def test_each_line_of_ours_stands_for_a_printed_one(name):
    """As many, and an end where an end is printed."""
    ours = ANNOTATIONS["lines"][name].splitlines()
    ends = [k for k, line in enumerate(ours, 1) if line.strip() == "end"]
    assert ends == ENDS[name] and len(ours) == ends[-1]


def test_the_page_shows_every_clause_with_its_kinds(elements):
    """And a filter for each kind; the legend counts the clauses of each."""
    named, everything = elements
    for clause, (kind, title) in ANNOTATIONS["clauses"].items():
        shown = text_of(named[anchor(clause)])
        assert kind in shown and title in shown
        assert ANNOTATIONS["statements"][clause] in shown
    legend = text_of(next(e for e in everything if e.get("class") == "legend"))
    for kind, meaning in ANNOTATIONS["kinds"].items():
        count = sum(f" {kind}" in e.get("class", "") for e in everything if e.get("id"))
        assert f"{kind} {count} clauses: {meaning}" in legend
    filters = {element.get("id") for element in everything if element.tag == "input"}
    assert filters == {f"only-{kind}" for kind in ("all", *KINDS)}


def test_the_page_shows_every_row_of_the_tables(elements):
    """With the value that is printed."""
    assert ANNOTATIONS["rows"].keys() == TABLE_I.keys()
    gamma = text_of(elements[0]["row-gamma"])
    assert "0.9" in gamma and "settings.py" in gamma


def test_the_page_is_small_and_needs_no_network(page, elements):
    """Nothing is loaded from elsewhere, and no script runs."""
    assert page.stat().st_size < LARGEST
    loaded = [element.get("src") for element in elements[1] if element.get("src")]
    assert loaded and all(value.startswith("data:") for value in loaded)
    assert {"script", "link", "iframe"}.isdisjoint(e.tag for e in elements[1])
    links = {e.get("href") for e in elements[1] if e.get("href", "").startswith("http")}
    assert links == {"https://doi.org/10.1109/TCSS.2024.3502420"}
    assert not re.search(r"@import|url\(", page.read_text(encoding="utf-8"))


def test_every_link_leads_to_one_place_on_the_page_or_to_a_file(elements, page):
    """No id is there twice, and none is missing; files are found from the page."""
    named, everything = elements
    links = {e.get("href") for e in everything if e.get("href")}
    here = {link[1:] for link in links if link[0] == "#"}
    assert len(named) == sum("id" in element.attrib for element in everything)
    assert here | set(map(anchor, TITLES)) <= named.keys()
    files = {link for link in links if link[0] not in "#h"}
    assert len(files) > 40 and all((page.parent / link).exists() for link in files)


# -- What it is made of -------------------------------------------------------------


def test_a_test_is_shown_with_its_boards(elements):
    """Those that it names, then those within it; one that is there is used again."""
    (found,) = [t for t in marked_tests() if "takes_an_unexplored_dir" in t.name]
    assert boards_of(found)[0].startswith("################\n#p")
    shown = [e for e in elements[1] if e.tag == "figure" and e.find("svg") is not None]
    again = {e.get("href", "#")[1:] for e in elements[1] if e.tag == "use"}
    assert len(shown) > 100 and again <= elements[0].keys()


def test_a_picture_on_the_page_keeps_floors_apart_from_its_white():
    """To the bit, though it has few colours: the legend's floor is seen."""
    kept = data_uri(drawing.top(load("tiny"), 0)).split(",")[1]
    picture = np.asarray(Image.open(BytesIO(b64decode(kept))).convert("RGB"))
    colours, counts = np.unique(picture.reshape(-1, 3), axis=0, return_counts=True)
    most = colours[np.argsort(-counts)[:3]].tolist()
    for ink in ("white", COLOURS[Kind.FLOOR]):
        assert [round(255 * part) for part in to_rgb(ink)] in most


def test_a_text_is_parted_into_its_passes():
    """By "then", or by a caption, as each board of a film has it, from the first on."""
    film = "0.2 s: lines 2, 3\n#p..E\nthen\n#..!E"
    assert captioned_boards(film) == [
        ("0.2 s: lines 2, 3", ["#p..E"]),
        ("then", ["#..!E"]),
    ]
    for test in (test for test in marked_tests() if "_a_film_of_" in test.name):
        passes = [
            shown for board in boards_of(test) for shown in captioned_boards(board)
        ]
        assert passes[0][0] == "0.0 s: the beginning" and all(dict(passes))


def test_a_module_s_mark_is_each_of_its_tests_mark():
    """`pytestmark` at the head of test_navigation files them all under A7."""
    ways = [test for test in marked_with("A7") if test.path.stem == "test_navigation"]
    assert len(ways) > 9


@pytest.mark.parametrize(
    ("clause", "code", "reason"),
    [
        ("B2", "SIGHT_RANGE = ", "metres, in smoke"),
        ("D7", "", "How flames spread and burn out in one run: first passage."),
        ("A7", "", "The paper's NavMesh becomes a grid of 1 m cells"),
    ],
)
def test_a_choice_has_its_reason(clause, code, reason):
    """A comment, a paragraph after a first line, a module's words."""
    told = [c for c in code_of(clause) if "chosen" in c.kinds]
    assert any(c.code.startswith(code) and c.reason.startswith(reason) for c in told)


def test_colours_leave_the_code_as_it_is():
    """Without its tags the beginning of a file is what it was."""
    code = (ROOT / "reference" / "humans.py").read_text(encoding="utf-8")
    shown = unescape(re.sub("<[^>]+>", "", snippet(code)))
    assert shown.endswith("…") and code.startswith(shown[:-1])
    inked = snippet("return 'a # < b', 1  # c")
    assert re.findall(r"class='(\w)'>([^<]+)<", inked) == [
        ("k", "return"), ("s", "'a # &lt; b'"), ("n", "1"), ("c", "# c")
    ]  # fmt: skip


def test_from_a_wheel_the_command_says_what_is_missing(tmp_path, monkeypatch, capsys):
    """The tests are not installed: one line, and exit status 1."""
    monkeypatch.setattr(index, "ROOT", tmp_path)
    monkeypatch.setattr(index, "marked_tests", index.marked_tests.__wrapped__)
    assert main(["paper", "-o", str(tmp_path / "paper.html")]) == 1
    assert "checkout" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


# -- What is asked for --------------------------------------------------------------


def test_ranges_are_understood():
    """Of lines, figures and clauses; an algorithm means all its lines."""
    assert keys_named_in("B6, Alg. 2:13-15") == [
        "B6",
        "Alg. 2:13",
        "Alg. 2:14",
        "Alg. 2:15",
    ]
    assert keys_named_in("A1-A3") == keys_named_in("A1-3") == ["A1", "A2", "A3"]
    assert keys_named_in("Figs. 4-5 and Tab. II") == ["Fig. 4", "Fig. 5", "Tab. II"]
    assert asked_for("Alg. 3") == ["Alg. 3", *(f"Alg. 3:{k}" for k in range(1, 9))]


def test_refuses_what_is_nothing_of_the_paper():
    """And says how to write what is."""
    with pytest.raises(pytest.UsageError, match=r"'B55' .* Write one like B5"):
        asked_for("B55")


def test_pytest_runs_the_tests_of_one_line(capsys):
    """And no others."""
    options = ["--collect-only", "-q", "-p", "no:cacheprovider"]
    pytest.main([*options, "--paper", "Alg. 2:16", str(ROOT / "tests" / "paper")])
    assert re.findall(r"::(\w+)", capsys.readouterr().out) == [
        "test_in_a_dead_end_a_leader_goes_back_to_the_door_passed_last"
    ]
