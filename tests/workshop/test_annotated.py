"""The annotated paper: all of the appendix, beside its code and its tests."""

import re
import shutil
import subprocess
import sys
import tomllib
from html import unescape
from html.parser import HTMLParser

import pytest
from clauses import PRINTED, ROOT
from paper_index import asked_for

from reference.__main__ import main
from reference.paper import TABLE_I
from reference.workshop.annotated import source
from reference.workshop.annotated.index import (
    code_of,
    marked_tests,
    marked_with,
    reasons,
)
from reference.workshop.annotated.page import anchor
from reference.workshop.annotated.words import CLAUSES, KINDS, PLACES, WORDS, named_in

LARGEST = 1_500_000  # bytes of the page


@pytest.fixture(scope="module")
def html(tmp_path_factory):
    """The page, written by the command."""
    path = tmp_path_factory.mktemp("paper") / "paper.html"
    assert main(["paper", "-o", str(path)]) == 0
    return path.read_text(encoding="utf-8")


class Elements(HTMLParser):
    """All elements of a page, each with its attributes; text by the ids around it."""

    def __init__(self, html):
        super().__init__()
        self.found, self.inside, self.text = [], [], {}
        self.feed(html)

    def handle_starttag(self, tag, attrs):
        """Note an element, and open those that are closed again."""
        self.found.append((tag, dict(attrs)))
        if tag not in ("meta", "img", "input", "wbr"):
            self.inside.append(dict(attrs).get("id"))

    def handle_endtag(self, tag):
        """Close the last element."""
        self.inside.pop()

    def handle_data(self, data):
        """Note a text under all ids around it."""
        for name in filter(None, self.inside):
            self.text[name] = self.text.get(name, "") + data


@pytest.fixture(scope="module")
def elements(html):
    """What the page is made of."""
    return Elements(html)


# -- The page -----------------------------------------------------------------------


SAID = [p for p, text in PLACES.items() if text != "end" and p[:-1] != "Alg. "]
"""Lines, equations, tables and figures; "end" says nothing of its own."""


def test_every_line_equation_table_and_figure_has_code_and_a_test():
    """Nothing of the appendix is left out."""
    assert [place for place in SAID if not code_of(place)] == []
    assert [place for place in SAID if not marked_with(place)] == []


def test_each_line_and_equation_stands_beside_its_code_and_tests(elements):
    """By file and line, and by the sentences of the tests."""
    for place in SAID:
        shown = " ".join(elements.text[anchor(place)].split())
        for cited in code_of(place) if place[:3] in ("Alg", "Eq.") else ():
            where = cited.where if cited.beside_code else cited.symbol.where
            assert where in shown, place
        for test in marked_with(place) if place[:3] != "Tab" else ():
            assert test.where in shown and test.title in shown, place


def test_each_line_of_ours_stands_for_a_printed_one():
    """As many, and an end where an end is printed."""
    ours = {place: text for place, text in PLACES.items() if ":" in place}
    assert ours.keys() == PRINTED.keys()
    assert {p for p in ours if ours[p] == "end"} == {
        p for p, text in PRINTED.items() if text == "end"
    }


def test_the_page_shows_every_clause_with_its_kinds(elements):
    """And a filter for each kind."""
    for clause, (kind, title) in CLAUSES.items():
        assert kind in elements.text[clause] and title in elements.text[clause]
    filters = {attrs["id"] for tag, attrs in elements.found if tag == "input"}
    assert filters == {f"only-{kind}" for kind in ("all", *KINDS)}


def test_the_page_shows_every_row_of_the_tables(elements):
    """With the value that is printed; and with what it was found to cost, if known."""
    assert WORDS["costs"].keys() <= WORDS["rows"].keys() == TABLE_I.keys()
    assert "0.9" in elements.text["row-gamma"]
    assert "settings.py" in elements.text["row-gamma"]
    for row, cost in WORDS["costs"].items():
        assert cost in elements.text[f"row-{row}"]


def test_the_page_is_small_and_needs_no_network(html, elements):
    """Nothing is loaded from elsewhere, no script runs, and all elements are closed."""
    assert (len(html.encode()) < LARGEST, elements.inside) == (True, [])
    loaded = [value for _, a in elements.found for k, value in a.items() if k == "src"]
    assert loaded and all(value.startswith("data:") for value in loaded)
    assert {"script", "link", "iframe"}.isdisjoint(tag for tag, _ in elements.found)
    assert "http" not in html.split("</style>")[0]
    assert "@import" not in html and "url(" not in html


def test_every_link_leads_to_one_place_on_the_page(elements):
    """No id is there twice, and none is missing."""
    ids = [attrs["id"] for _, attrs in elements.found if "id" in attrs]
    links = [attrs["href"] for tag, attrs in elements.found if tag == "a"]
    assert len(ids) == len(set(ids))
    assert {link.removeprefix("#") for link in links} <= set(ids)
    assert {anchor(key) for key in (*CLAUSES, *PLACES)} <= set(ids)


# -- What it is made of -------------------------------------------------------------


def test_a_test_shows_its_board_before_and_after():
    """Also where the second is made from the first."""
    (found,) = [
        t for t in marked_tests() if "takes_an_unexplored_direction" in t.node.name
    ]
    (first, before), (then, after) = source.boards(found.path, found.node)
    assert (first, then) == ("before", "after")
    assert ("#p..." in before, "#...p" in after) == (True, True)


def test_a_chosen_number_has_its_reason():
    """As the code says it."""
    told = {c.symbol.name: text for text, c in reasons("B2", "chosen").items()}
    assert told["SIGHT_RANGE"].startswith("metres, in smoke")


@pytest.mark.parametrize("term", WORDS["glossary"])
def test_each_term_of_the_glossary_has_a_place_in_the_code(term):
    """A class, a function or a number that is there."""
    dotted, meaning = WORDS["glossary"][term]
    assert source.symbol(dotted).path.exists()
    assert meaning.endswith(".")


def test_colours_leave_the_code_as_it_is():
    """Without its tags a file is what it was."""
    path = source.PACKAGE / "humans.py"
    coloured = source.snippet(path, 1, len(source.lines_of(path)))
    text = unescape(re.sub("<[^>]+>", "", coloured))
    assert text == path.read_text("utf-8").rstrip()


def test_from_a_wheel_the_command_says_what_is_missing(tmp_path):
    """The tests are not installed: one line, and exit status 1."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    wheel = project["tool"]["hatch"]["build"]["targets"]["wheel"]
    for folder in wheel["only-include"]:
        shutil.copytree(ROOT / folder, tmp_path / wheel["sources"].get(folder, folder))
    command = [sys.executable, "-m", "reference", "paper"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    assert (done.returncode, done.stderr.count("\n")) == (1, 1)
    assert "checkout" in done.stderr


# -- What is asked for --------------------------------------------------------------


def test_ranges_are_understood():
    """Of lines, figures and clauses."""
    assert named_in("B6, Alg. 2:13-15") == ["B6", "Alg. 2:13", "Alg. 2:14", "Alg. 2:15"]
    assert named_in("A1-A3") == named_in("A1-3") == ["A1", "A2", "A3"]
    assert named_in("Figs. 4-6 and Tab. II") == [
        "Fig. 4",
        "Fig. 5",
        "Fig. 6",
        "Tab. II",
    ]


def test_an_algorithm_means_all_its_lines():
    """Who asks for Algorithm 3 gets the tests of each line."""
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
