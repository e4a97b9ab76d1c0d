"""Standard cases of pedestrian dynamics: those that take a moment are tests too."""

import json

import numpy as np
import pytest
from pages import overlaps

from reference.__main__ import main
from reference.navigation import navigation_of
from reference.workshop.drawing import validation as drawing
from reference.workshop.validation.cases import (
    CASES,
    EXITS_OF,
    MEASURED,
    NOT_MODELLED,
    ONE_WAY,
    OPPOSED,
    Case,
    measured,
    weidmann,
)
from reference.workshop.validation.crowd import (
    Crowd,
    built,
    densest,
    flow,
    people,
    times,
)

FAST = ("corridor", "speeds", "corner", "stairs", "doors", "large-room")
LONG = ("fundamental-diagram", "counterflow", "everybody-knows")
ROOM = ["#######", "#.....E", "#######"]


@pytest.mark.paper("A3")
@pytest.mark.paper("A5")
@pytest.mark.paper("A7")
@pytest.mark.paper("F8")
@pytest.mark.parametrize(
    "name", [*FAST, *(pytest.param(name, marks=pytest.mark.slow) for name in LONG)]
)
def test_the_model_passes_standard_cases(name):
    """As the guidelines of RiMEA and IMO define them; `validate` shows all of them."""
    row = measured(name, seed=0, runs=1)
    assert row["verdict"] == "passes", row


def test_a_crowd_leaves_and_nobody_dies():
    """However long it takes."""
    building = built(ROOM)
    world = people(building, 0, (12, (0, slice(1, 2), slice(1, 6))))
    crowd = Crowd(world, seed=0)
    assert crowd.run().evacuated == 12
    assert crowd.world.time < 60


def test_people_stand_apart_where_they_are_put():
    """Four to a square metre, each with half a metre to the next, in their cells."""
    world = people(built(ROOM), 0, (8, (0, slice(1, 2), slice(2, 4))))
    x, centres = world.bodies.position, navigation_of(world.building).centres
    assert np.abs(x - centres[world.bodies.place]) == pytest.approx(0.25)
    gaps = np.hypot(*(x[:, None] - x).T)[np.triu_indices(8, 1)]
    assert gaps.min() == pytest.approx(0.5)
    assert np.ptp(x, axis=0) == pytest.approx([1.5, 0.5])


def test_a_goal_is_walked_to_though_another_is_nearer():
    """Exits by their number."""
    building = built(["#######", "E.....E", "#######"])
    world = people(building, 0, (1, (0, slice(1, 2), slice(1, 2))))
    east = max(building.landmarks, key=lambda mark: mark.position).index
    (near,) = times(Crowd(world, seed=0))
    world = people(building, 0, (1, (0, slice(1, 2), slice(1, 2))))
    (far,) = times(Crowd(world, 0, [east]))
    assert far > near + 2


def test_flow_counts_from_the_first_to_the_last():
    """Three in two seconds; and who never passes costs the time until the end."""
    assert flow(np.array([1.0, 2.0, 3.0])) == 1.0
    assert flow(np.array([100.0, 200.0, np.inf])) == pytest.approx(1 / 200)
    assert flow(np.array([100.0, np.inf])) == 0


def test_density_is_that_of_the_most_crowded_ten_seconds():
    """Two who wait 2 s in 2 m² are 0.2 per square metre."""
    building = built(ROOM)
    world = people(building, 0, (2, (0, slice(1, 2), slice(5, 6))))
    found = densest(
        Crowd(world, seed=0, limit=20), {"end": (0, slice(1, 2), slice(4, 6))}
    )
    assert 0 < found["end"] < 0.2


def test_weidmanns_curve_has_its_known_points():
    """Free speed at the left, 1.06 m/s at one per square metre, a standstill at 5.4."""
    assert weidmann(0.05) == pytest.approx(1.34, abs=0.01)
    assert weidmann(1.0) == pytest.approx(1.06, abs=0.01)
    assert weidmann(5.4) == weidmann(6.0) == 0


def test_the_command_prints_a_table_with_what_is_not_modelled(capsys):
    """A row for each case, and a reason for each that needs more than there is."""
    assert main(["validate", "--only", "corridor"]) == 0
    head, row, *absent = capsys.readouterr().out.splitlines()
    assert head.split() == ["verdict", "case", "what", "accepted", "measured"]
    assert row.startswith("passes ") and "RiMEA 1" in row
    assert len(absent) == len(NOT_MODELLED)
    assert all(line.startswith("not modelled") for line in absent)


def test_a_case_that_fails_is_no_error(capsys, monkeypatch):
    """It is a measurement: exit status 0, the verdict says it."""
    failing = Case("RiMEA 1", "30", lambda seed: (False, {"s": np.inf}), "it is icy")
    monkeypatch.setitem(CASES, "corridor", failing)
    assert main(["validate", "--only", "corridor", "--json"]) == 0
    (row,) = json.loads(capsys.readouterr().out)["cases"]
    assert row["verdict"] == "fails" and row["measured"] == {"s": None}
    assert row["never"] == {"s": 3}
    assert main(["validate", "--only", "corridor"]) == 0
    told = capsys.readouterr().out
    assert "fails 3/3" in told and "s: - (never in 3/3) (it is icy)" in told


def test_what_to_know_of_a_case_is_told_whatever_its_verdict(capsys, monkeypatch):
    """That the flow through doors is a parameter: IMO 4 cannot but pass."""
    doors = CASES["doors"]
    passing = doors._replace(measure=lambda seed: (True, {"exit 1 m": 1.3}))
    monkeypatch.setitem(CASES, "doors", passing)
    assert main(["validate", "--only", "doors", "--json"]) == 0
    (row,) = json.loads(capsys.readouterr().out)["cases"]
    assert (row["verdict"], row["why"]) == ("passes", "")
    assert row["note"].startswith("by construction: ") and "1.9 to 2.4" in row["note"]
    assert main(["validate", "--only", "doors"]) == 0
    assert f"exit 1 m: 1.3 ({row['note']})" in capsys.readouterr().out


def test_people_who_never_get_through_are_counted_and_not_averaged(monkeypatch):
    """A mean over the seeds that end, and how many do not: the verdict says it too."""
    late = Case(
        "IMO 8", "ends", lambda seed: (seed < 2, {"s": (4, 6, np.inf)[seed]}), ""
    )
    monkeypatch.setitem(CASES, "corridor", late)
    row = measured("corridor", seed=0)
    assert (row["measured"], row["never"]) == ({"s": 5}, {"s": 1})
    assert (row["failed"], row["runs"], row["verdict"]) == (1, 3, "fails")


def test_a_crowd_takes_its_random_steps_from_its_seed():
    """The same people in the same places, another seed: another way through."""
    building, ends = built(ROOM), []
    for seed in (0, 0, 1):
        crowd = Crowd(people(building, 0, (12, (0, slice(1, 2), slice(1, 6)))), seed)
        crowd.run()
        ends.append(crowd.world.bodies.position.tolist())
    assert ends[0] == ends[1] != ends[2]


def test_refuses_a_case_that_does_not_exist(capsys):
    """With the cases that there are."""
    with pytest.raises(SystemExit, match="2"):
        main(["validate", "--only", "lifts"])
    assert "corridor" in capsys.readouterr().err


@pytest.fixture
def quick(monkeypatch):
    """Pictures of what nobody waits for: cases that answer at once."""
    cases = drawing.cases
    monkeypatch.setattr(cases, "speed_in_ring", lambda d, seed: weidmann(d) * 0.9)
    passages = np.arange(1, 80, 0.8)
    monkeypatch.setattr(cases, "passages", lambda gate, width, seed: passages)


@pytest.mark.parametrize("draw", [drawing.diagram, drawing.door])
def test_no_words_of_the_pictures_overlap(draw, quick):
    """And all lie on the page."""
    assert overlaps(draw(0)) == []


def test_real_people_stand_beside_the_model(quick):
    """A dozen points, and where they come from."""
    facts = {drawing.diagram: (ONE_WAY, OPPOSED), drawing.door: (EXITS_OF,)}
    for draw, tables in facts.items():
        figure = draw(0)
        lines = [line for axes in figure.axes for line in axes.lines]
        drawn = [np.transpose(line.get_data()).tolist() for line in lines]
        for table in tables:
            assert [list(point) for point in table.items()] in drawn
        assert MEASURED in figure.legends[0].get_title().get_text()


def test_the_pictures_go_to_a_folder(quick, tmp_path, capsys):
    """Which is made if need be."""
    folder = tmp_path / "new"
    assert main(["validate", "--only", "corner", "--out", str(folder)]) == 0
    assert {file.name for file in folder.iterdir()} == {
        "fundamental-diagram.png",
        "door.png",
    }
