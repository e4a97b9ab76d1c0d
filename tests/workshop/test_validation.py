"""Standard cases of pedestrian dynamics: those that take a moment are tests too."""

import json

import numpy as np
import pytest
from pages import overlaps, writing

from reference.__main__ import main
from reference.navigation import navigation_of
from reference.workshop.commands import measures
from reference.workshop.drawing import validation as drawing
from reference.workshop.measuring.halls import (
    Crowd,
    build_floors,
    flow,
    peak_density,
    put_people,
)
from reference.workshop.measuring.validation import (
    CASES,
    DENSITIES,
    MEASURES,
    NOT_MODELLED,
    ONE_WAY,
    OPPOSED,
    REAL_PEOPLE_SOURCE,
    measure_case,
    weidmann,
)

FAST = ("corridor", "speeds", "corner", "stairs", "doors", "large-room")
LONG = ("fundamental-diagram", "everybody-knows")
ROOM = build_floors(["#######", "#.....E", "#######"])


@pytest.mark.paper("A3")
@pytest.mark.paper("A5")
@pytest.mark.paper("A9")
@pytest.mark.paper("F8")
@pytest.mark.parametrize(
    "name", [*FAST, *(pytest.param(name, marks=pytest.mark.slow) for name in LONG)]
)
def test_the_model_passes_standard_cases(name, monkeypatch):
    """As the guidelines of RiMEA and IMO define them; `validate` shows all of them."""
    monkeypatch.setitem(CASES[name], "runs", 1)
    row = measure_case(name, seed=0)
    assert row["verdict"] == "passes", row


@pytest.mark.slow
@pytest.mark.paper("A9")
def test_two_crowds_that_meet_pass_each_other(monkeypatch):
    """Those against them cost time; a hundred against a hundred may jam, but seldom."""
    monkeypatch.setitem(CASES["counterflow"], "runs", 3)
    row = measure_case("counterflow", seed=0)
    assert row["failed"] <= 1, row
    assert set(row["never"]) <= {"100"}
    assert list(row["measured"].values()) == sorted(row["measured"].values())


def test_people_stand_apart_where_they_are_put():
    """Four to a square metre, each with half a metre to the next, in their cells."""
    world = put_people(ROOM, 0, (8, np.s_[0, 1:2, 2:4]))
    x = world.bodies.position
    centres = navigation_of(world.building).centres
    assert np.abs(x - centres[world.bodies.place]) == pytest.approx(0.25)
    gaps = np.hypot(*(x[:, None] - x).T)[np.triu_indices(8, 1)]
    assert gaps.min() == pytest.approx(0.5)
    assert np.ptp(x, axis=0) == pytest.approx([1.5, 0.5])


def test_flow_counts_from_the_first_to_the_last():
    """Three in two seconds; and who never passes costs the time until the end."""
    assert flow(np.array([1.0, 2.0, 3.0])) == 1.0
    assert flow(np.array([100.0, 200.0, np.inf])) == pytest.approx(1 / 200)
    assert flow(np.array([100.0, np.inf])) == flow(np.array([np.inf])) == 0


def test_density_is_that_of_the_most_crowded_ten_seconds():
    """Two in 2 m², for two of the fifty ticks, are 0.04 per square metre."""
    crowd = Crowd(put_people(ROOM, 0, (2, np.s_[0, 1:2, 5:6])), seed=0, limit=20)
    assert peak_density(crowd, np.s_[0, 1:2, 4:6]) == pytest.approx(0.04)


def test_weidmanns_curve_has_its_known_points():
    """Free speed at the left, 1.06 m/s at one per square metre, a standstill at 5.4."""
    assert weidmann(0.05) == pytest.approx(1.34, abs=0.01)
    assert weidmann(1.0) == pytest.approx(1.06, abs=0.01)
    assert weidmann(5.4) == weidmann(6.0) == 0


def test_the_command_prints_a_table_with_what_is_not_modelled(capsys, monkeypatch):
    """A paragraph for each, as wide as the terminal; it says how long all take."""
    monkeypatch.setenv("COLUMNS", "60")
    assert main(["validate", "--only", "corridor"]) == 0
    assert "not modelled" not in capsys.readouterr().out  # nobody asked for these
    monkeypatch.setattr(measures, "CASES", {"corridor": CASES["corridor"]})
    assert main(["validate"]) == 0
    told = capsys.readouterr()
    assert "minute" in told.err
    lines = told.out.splitlines()
    assert max(map(len, lines)) <= 60
    heads = [line for line in lines if not line.startswith(" ")]
    assert heads[0].startswith("passes  RiMEA 1")
    assert len(heads) == 1 + len(NOT_MODELLED)
    assert all(line.startswith("not modelled") for line in heads[1:])
    assert sum("accepted: " in line for line in lines) == 1
    assert sum("measured: " in line for line in lines) == 1


def test_a_case_that_fails_is_no_error_and_says_how_often(capsys, monkeypatch):
    """Numbers are means over the seeds that end; how many do not is told too."""
    monkeypatch.setitem(CASES["corridor"], "note", "icy")
    for ends, mean, count, told in (
        ((4, 6, np.inf), 5, 1, "5 (never in 1/3)"),
        ((np.inf, np.inf, np.inf), None, 3, "- (never in 3/3)"),
    ):
        found = [(end < np.inf, {"s": end}) for end in ends]
        monkeypatch.setitem(MEASURES, "corridor", found.__getitem__)
        assert main(["validate", "--only", "corridor", "--json"]) == 0
        (row,) = json.loads(capsys.readouterr().out)["cases"]
        assert (row["measured"], row["never"]) == ({"s": mean}, {"s": count})
        assert (row["failed"], row["runs"], row["verdict"]) == (count, 3, "fails")
        assert main(["validate", "--only", "corridor"]) == 0
        out = capsys.readouterr().out
        assert f"fails {count}/3" in out and f"s: {told} (icy)" in out


def test_real_people_stand_beside_the_model_in_the_picture(monkeypatch, tmp_path):
    """Eight points, where they come from, and no words on each other; a dot is each of
    the table's three seeds, the line their means."""
    monkeypatch.setattr(drawing.validation, "speed_in_ring", lambda d, seed: seed / d)
    figure = drawing.diagram(4)
    lines = [np.transpose(line.get_data()).tolist() for line in figure.axes[0].lines]
    for table in (ONE_WAY, OPPOSED, {d: 5 / d for d in DENSITIES}):
        assert [list(point) for point in table.items()] in lines
    assert [[d, seed / d] for seed in (4, 5, 6) for d in DENSITIES] in lines
    assert any(REAL_PEOPLE_SOURCE in text for text in writing(figure))
    assert overlaps(figure) == []
    path = tmp_path / "diagram.png"
    assert main(["validate", "--only", "corner", "-o", str(path)]) == 0
    assert path.stat().st_size > 10_000
