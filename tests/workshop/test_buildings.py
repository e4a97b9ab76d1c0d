"""Buildings compared: the same robots, fires, people and seeds in each of them."""

import json
from dataclasses import asdict, replace
from errno import ENOSPC
from pathlib import Path
from shutil import copy

import numpy as np
import pytest
from conftest import ROOT
from matplotlib.text import Annotation
from outcomes import result
from pages import overlaps, writing
from refusals import refusal
from trainings import Stopped

from reference.__main__ import main
from reference.paper import InputError, Scenario
from reference.robots import NoRobots
from reference.simulation import Simulation
from reference.workshop.comparing import buildings, runs
from reference.workshop.comparing.buildings import (
    begin_in_buildings,
    compare_buildings,
    play_in_buildings,
    resume_in_buildings,
    table_of_buildings,
)
from reference.workshop.comparing.intervals import (
    Interval,
    format_interval,
    interval_of_mean,
)
from reference.workshop.comparing.matches import write_evaluation
from reference.workshop.comparing.results import cell_as_json
from reference.workshop.comparing.runs import Death, deaths_in
from reference.workshop.drawing.buildings import side_by_side
from reference.workshop.maps import load
from reference.workshop.storage.workers import InProcess
from reference.workshop.strategies import ANYWHERE
from reference.workshop.strategies.fires import CloserFire
from reference.world import Died, Fate

pytestmark = pytest.mark.usefixtures("in_an_empty_folder")

HUT = """building: Hut
size: 12 x 5
floor 1:
############
#....+.....#
#....#.....E
#....#.....#
############
"""
README = (ROOT / "README.md").read_text(encoding="utf-8")
OFFICE = (
    "building: My office" + README.split("```\nbuilding: My office")[1].split("```")[0]
)
"""The reader's own office."""

SMALL = "evaluate --people 5 --episodes 2 --workers 0 --robots none --fire random"


@pytest.fixture
def huts():
    """Two maps by their files: the second has another exit."""
    Path("hut.txt").write_text(HUT)
    Path("wide.txt").write_text(HUT.replace("#....#.....E", "E....#.....E"))
    return "hut.txt", "wide.txt"


def begun(*buildings, robots=("none",), fires=("random",), people=5, episodes=2):
    """Evaluations of a few people in buildings."""
    asked = {"people": people, "episodes": episodes}
    return begin_in_buildings(buildings, robots, fires, **asked)


# -- Where people die ---------------------------------------------------------------


@pytest.mark.paper("B7")
def test_a_death_is_where_the_body_lies():
    """As many as died, each on the floor of its event, in its body's cell."""
    scenario = Scenario(people=10)
    run = Simulation(load(OFFICE), scenario, NoRobots(), CloserFire(), seed=1)
    run.run()
    bodies = run.world.bodies
    died = [event for event in run.events if isinstance(event, Died)]
    found = deaths_in(run)
    assert len(found) == (bodies.fate == Fate.DEAD).sum() > 0
    assert [death.floor for death in found] == [event.floor for event in died]
    for death, event in zip(found, died, strict=True):
        cell = (death.floor, *run.building.cell(death.x, death.y))
        place = np.ravel_multi_index(cell, run.building.kind.shape)
        assert place == bodies.place[event.person]


def test_deaths_are_kept_and_read_again():
    """Floor and metres, to the digit; refused where they cannot be."""
    Path("office.txt").write_text(OFFICE)
    (evaluation,) = begun("office.txt", fires=("busiest",), people=10).values()
    played = runs.play_evaluation(evaluation, Path("out"), InProcess())
    assert all(run.deaths for run in played)
    assert runs.read_runs(Path("out/runs.csv"), evaluation) == played
    outside = Death(0, 0.0, 4.5)  # in the wall to the north
    for changed in (
        lambda deaths: deaths[1:],
        lambda deaths: (*deaths, deaths[0]),
        lambda deaths: (*deaths[1:], outside),
        lambda deaths: (*deaths[1:], deaths[0]._replace(floor=2)),
        lambda deaths: (*deaths[1:], deaths[0]._replace(floor=-1)),
        lambda deaths: (*deaths[1:], deaths[0]._replace(x=1e9)),
    ):
        row = replace(played[0], deaths=changed(played[0].deaths))
        runs.table_of(Path("runs.csv"), [row])
        with pytest.raises(InputError, match=r"runs.csv:2: .*(deaths, but|can have)"):
            runs.read_runs(Path("runs.csv"), evaluation)


@pytest.mark.parametrize(
    ("times", "half"),
    [((), None), ((7,), 7), ((1, 9), 1), ((1, 2, 9), 2), (range(1, 21), 10)],
)
def test_half_are_out_when_at_least_half_of_those_who_get_out_are(times, half):
    """The dead do not count."""
    assert result(times=times).half_out == half


# -- What buildings come to ---------------------------------------------------------


def figures_of(first, second, floors=("tiny", "tiny")):
    """What runs made up come to in two buildings, whose names are a and b."""
    arenas = begun(*floors).values()
    evaluations = dict(zip("ab", arenas, strict=True))
    return compare_buildings(evaluations, {"a": first, "b": second})


@pytest.mark.paper("F12")
def test_a_difference_is_of_the_same_seeds_and_bootstrapped_from_them():
    """Whatever runs of a seed share cancels; a constant difference has no width."""
    first = [result(seed=k, times=range(1, 5 * k + 2)) for k in range(4)]
    second = [result(seed=k, times=range(3, 5 * k + 6)) for k in range(4)]
    one, other, less = figures_of(first, second)
    assert (one.building, other.building, less.building) == ("a", "b", "b")
    assert (one.less, other.less, less.less) == (None, None, "a")
    assert one.survival == interval_of_mean([run.survival for run in first])
    assert one.survival.low < one.survival.high
    assert less.survival == pytest.approx((0.05, 0.05, 0.05))
    halves = [b.half_out - a.half_out for a, b in zip(first, second, strict=True)]
    assert less.half_out == interval_of_mean(halves)


@pytest.mark.paper("F12")
def test_times_are_compared_where_somebody_got_out_of_both():
    """A seed in which nobody did has none; where there are none at all, there is -."""
    first = [result(seed=0, times=()), result(seed=1, times=(5, 8))]
    second = [result(seed=0, times=(1,)), result(seed=1, times=(4, 10))]
    one, other, less = figures_of(first, second)
    assert one.half_out == (5, 5, 5)
    assert other.half_out == interval_of_mean([1, 4])
    assert less.half_out == (-1, -1, -1)
    assert less.evacuation_time == (2, 2, 2)
    none, _, less = figures_of(first[:1], second[:1])
    assert none.half_out is less.half_out is less.evacuation_time is None
    assert table_of_buildings([none]).endswith(
        "-: nobody got out in any run; of a difference, in no seed of both"
    )


def test_deaths_are_counted_by_floor_and_compared_on_floors_of_both():
    """People a run; a building of one floor beside one of two."""
    above = Death(1, 0.5, 0.5)
    ground = Death(0, 0.5, 0.5)
    first = [result(seed=k, deaths=(ground, above, above)) for k in range(2)]
    second = [result(seed=k, deaths=(ground,) * 3) for k in range(2)]
    one, other, less = figures_of(first, second, ("tiny", "museum"))
    assert [floor.mean for floor in one.died] == [1, 2]
    assert [floor.mean for floor in other.died] == [3]
    assert [floor.mean for floor in less.died] == [2]
    heads, *rows = table_of_buildings([one, other, less]).splitlines()
    assert heads.endswith("died on floor 1    2")
    assert [row.split()[-1] for row in rows] == ["2.0", "3.0", "+2.0"]


@pytest.mark.paper("F12")
@pytest.mark.parametrize("building", ["tiny", "museum"])
def test_of_the_same_building_twice_every_difference_is_0(building):
    """Exactly, as is its interval; the second is told apart by a number."""
    both = begun(building, building, robots=("none", "sweep"), people=30)
    assert [*both] == [building, f"{building} (2)"]
    played = play_in_buildings(both, None, InProcess())
    figures = compare_buildings(both, played)
    differences = [each for each in figures if each.less]
    assert len(differences) == 2
    for each in differences:
        known = [each.survival, each.half_out, each.evacuation_time, *each.died]
        assert {*known} == {Interval(0, 0, 0)}
    row = table_of_buildings(figures).splitlines()[3]
    assert "0.0 [0.0, 0.0]" in row and "+" not in row and "-" not in row


SIGNED = {"digits": 1, "signed": True, "ends": True}


@pytest.mark.slow
def test_a_guide_and_a_second_exit_matter_in_the_office_of_the_readme():
    """By 15 points each at least; the README tells of 100 evacuations."""
    Path("one.txt").write_text(OFFICE)
    Path("two.txt").write_text(OFFICE.replace("#......lobby", "E......lobby"))
    asked = {"robots": ("none", "escort"), "fires": ("busiest",)}
    both = begun("one.txt", "two.txt", people=12, episodes=30, **asked)
    figures = compare_buildings(both, play_in_buildings(both, None, InProcess()))
    found = {(x.robots, x.building, x.less): x.survival for x in figures}
    alone = found["none", "one.txt", None].mean
    guided = found["escort", "one.txt", None].mean
    assert guided - alone > 0.15
    assert found["none", "two.txt", "one.txt"].low > 0.15


WRITTEN = [
    ((1.26, -0.04, 2.0), {"digits": 1}, "1.3"),
    ((1.26, -0.04, 2.0), {"digits": 1, "ends": True}, "1.3 [0.0, 2.0]"),
    ((1.26, -3.0, 0.04), SIGNED, "+1.3 [-3.0, 0.0]"),
    ((1234.0, 0.0, 0.0), {"digits": 0, "signed": True}, "+1,234"),
    (None, {"digits": 0}, "-"),
]


@pytest.mark.parametrize(("interval", "how", "words"), WRITTEN)
def test_a_figure_in_words(interval, how, words):
    """What rounds to 0 has no sign."""
    assert format_interval(interval and Interval(*interval), **how) == words


def test_programs_read_every_figure(huts):
    """Intervals as objects, floors as a list of them."""
    evaluations = begun(*huts)
    played = play_in_buildings(evaluations, None, InProcess())
    *_, less = compare_buildings(evaluations, played)
    facts = cell_as_json(less)
    assert facts.keys() == asdict(less).keys()
    assert json.loads(json.dumps(facts, allow_nan=False)) == facts
    assert facts["died"][0].keys() == {"mean", "low", "high"}


# -- The command --------------------------------------------------------------------


def test_the_command_tells_both_buildings_and_their_difference(huts, capsys):
    """One table; for programs each building's report, too."""
    assert main(f"{SMALL} --building hut.txt wide.txt".split()) == 0
    one, other, heads, *rows = capsys.readouterr().out.splitlines()
    assert one.startswith("hut.txt: Hut, 5 people: 1 robot strategy, 1 fire, 2 seeds")
    assert other.startswith("wide.txt: Hut, 5 people")
    assert heads.split()[:4] == ["robots", "fire", "building", "runs"]
    assert [row.split()[2] for row in rows[:3]] == ["hut.txt", "wide.txt", "difference"]
    assert main(f"{SMALL} --json --building hut.txt wide.txt hut.txt".split()) == 0
    facts = json.loads(capsys.readouterr().out)
    assert [each["building"] for each in facts["buildings"]] == [*huts, "hut.txt"]
    told = [(each["building"], each["less"]) for each in facts["comparison"]]
    assert told == [
        ("hut.txt", None), ("wide.txt", None), ("wide.txt", "hut.txt"),
        ("hut.txt (2)", None), ("hut.txt (2)", "hut.txt"),
    ]  # fmt: skip


def test_what_holds_in_all_buildings_is_noted_once(huts, capsys):
    """Such as that one network plays in any of them."""
    command = "evaluate --people 5 --workers 0 --robots learned --episodes 1"
    assert main(f"{command} --building hut.txt wide.txt".split()) == 0
    assert capsys.readouterr().err.count("the network that knows no building") == 1


@pytest.mark.slow
def test_a_folder_holds_each_building_and_the_comparison(huts, capsys):
    """A building's folder is an evaluation as any other; it is resumed with others."""
    assert main(f"{SMALL} --out out --building hut.txt wide.txt".split()) == 0
    names = {path.name for path in Path("out").iterdir()}
    assert names == {
        "building-1", "building-2", "buildings.json", "buildings.png",
        "comparison.json",
    }  # fmt: skip
    before = Path("out/building-2/runs.csv").read_text()
    alone = "evaluate --workers 0 --json --resume --out"
    assert main(f"{alone} out/building-2 --fire none".split()) == 0
    capsys.readouterr()
    assert main(f"{alone} out --robots sweep".split()) == 0
    facts = json.loads(capsys.readouterr().out)
    pairs = {(each["robots"], each["fire"]) for each in facts["comparison"]}
    assert pairs == {(r, f) for r in ("none", "sweep") for f in ("random", "none")}
    assert len(facts["comparison"]) == 3 * len(pairs)
    assert Path("out/building-2/runs.csv").read_text().startswith(before)


def test_who_is_stopped_in_the_first_building_goes_on_in_both(huts):
    """What is over is kept; the other building is known before its first run."""
    whole = play_in_buildings(begun(*huts), None, InProcess())
    folder = Path("out")
    with pytest.raises(KeyboardInterrupt):
        play_in_buildings(begun(*huts), folder, Stopped(1))
    kept = resume_in_buildings(folder, (), ())
    assert [*kept] == [*huts]
    assert play_in_buildings(kept, folder, InProcess()) == whole
    assert play_in_buildings(kept, folder, Stopped(0)) == whole


def test_a_training_means_one_checkpoint_in_all_buildings(huts):
    """Though it goes on after a stop in the first of them; two at once are refused."""
    folder = Path("out")
    play_in_buildings(begun(*huts), folder, InProcess())
    first = Path("calm/checkpoint-000001.pt")
    first.parent.mkdir()
    copy(ANYWHERE, first)
    with pytest.raises(KeyboardInterrupt):
        play_in_buildings(
            resume_in_buildings(folder, ("calm",), ()), folder, Stopped(0)
        )
    copy(ANYWHERE, "calm/checkpoint-000002.pt")
    both = resume_in_buildings(folder, ("calm",), ())
    assert [each.files for each in both.values()] == [{"calm": str(first)}] * 2

    (alone,) = resume_in_buildings(folder / "building-2", ("calm",), ()).values()
    write_evaluation(alone, folder / "building-2")
    with pytest.raises(InputError, match=r"calm is calm/.* in one of the"):
        resume_in_buildings(folder, (), ())


def test_who_is_stopped_before_all_is_written_begins_anew(huts, monkeypatch):
    """Of the first building nothing is left that would be in the way."""

    def full(path, _):
        raise OSError(ENOSPC, "No space left on device", str(path))

    folder = Path("out")
    with monkeypatch.context() as patched:
        patched.setattr(buildings, "write_json", full)
        with pytest.raises(OSError, match="No space left"):
            play_in_buildings(begun(*huts), folder, InProcess())
    assert list(folder.iterdir()) == []
    play_in_buildings(begun(*huts), folder, InProcess())
    assert [*resume_in_buildings(folder, (), ())] == [*huts]


def test_one_building_is_evaluated_as_ever(huts):
    """In the folder itself, without a list of buildings."""
    one = begun("hut.txt")
    played = play_in_buildings(one, Path("out"), InProcess())
    assert Path("out/runs.csv").exists()
    assert not Path("out/buildings.json").exists()
    assert resume_in_buildings(Path("out"), (), ()) == one
    assert [*played] == ["hut.txt"]


# -- Refusals -----------------------------------------------------------------------


def test_refuses_a_map_with_mistakes_before_anything_is_played(huts, capsys):
    """In the words of `check`, whichever of them it is, and no folder is left."""
    Path("bad.txt").write_text(HUT.replace("+", "|"))
    _, page = refusal(capsys, "check", "bad.txt")
    page = page[: page.index("next: ")]
    for order in ("hut.txt bad.txt", "bad.txt hut.txt"):
        asked = f"{SMALL} --out out --building {order}"
        assert refusal(capsys, *asked.split()) == (1, page)
    assert not Path("out").exists()


def test_refuses_buildings_with_other_numbers_of_people():
    """Counts of floors that only one of them has."""
    scenario = {"people_per_floor": (3, 2)}
    with pytest.raises(InputError, match="people_per_floor"):
        begin_in_buildings(("tiny", "museum"), ("none",), ("none",), scenario=scenario)


def test_refuses_to_resume_in_other_buildings(huts, capsys):
    """A resumed run keeps its options, maps and their order among them."""
    play_in_buildings(begun(*huts), Path("out"), InProcess())
    again = "evaluate --workers 0 --resume --out out --building"
    for others in ("hut.txt", "wide.txt hut.txt", "hut.txt wide.txt tiny"):
        status, told = refusal(capsys, *f"{again} {others}".split())
        assert status == 2
        assert "--building: a resumed run keeps its options" in told


def test_refuses_folders_that_were_not_begun_alike(huts):
    """Somebody has put another evaluation there: its seeds are not the same."""
    play_in_buildings(begun(*huts), Path("out"), InProcess())
    path = Path("out/building-2/evaluation.json")
    path.write_text(path.read_text().replace('"seed": 0', '"seed": 9'))
    with pytest.raises(InputError, match="not of one evaluation"):
        resume_in_buildings(Path("out"), (), ())


# -- The picture --------------------------------------------------------------------

LONG = "a-folder-of-mine/with-a-long-name/office-before-the-second-exit.txt"
ROBOTS = ("none", "out/a-training/checkpoint-000120.pt", "escort", "sweep")


def played_in(buildings, robots, fires=("random",)):
    """Runs made up: some get out, all others die where they may."""
    rng = np.random.default_rng(0)
    found = {}
    for name, building in buildings.items():
        floor, row, col = rng.choice(np.argwhere(building.walkable)).tolist()
        death = Death(floor, *building.metres(row, col))
        some = [
            result(
                robot, fire, seed, sorted(rng.gamma(4, 10, 30)), deaths=(death,) * 10
            )
            for robot in robots
            for fire in fires
            for seed in range(3)
        ]
        found[name] = some
    return found


@pytest.mark.parametrize(
    ("names", "shipped", "robots"),
    [
        ((LONG, f"{LONG} (2)"), ("tiny", "tiny"), ROBOTS[:2]),
        (("one", "two", "three"), ("museum", "tower", "school"), ROBOTS[:1]),
        (("paper", "maze"), ("paper", "maze"), ROBOTS),
    ],
)
def test_nothing_overlaps_with_long_names_or_many_buildings(names, shipped, robots):
    """Of one floor or five, few matches or many."""
    buildings = dict(zip(names, map(load, shipped), strict=True))
    played = played_in(buildings, robots)
    evaluations = dict(zip(names, begun(*shipped).values(), strict=True))
    figures = compare_buildings(evaluations, played)
    assert overlaps(side_by_side(buildings, played, figures)) == []


def test_crosses_are_where_people_died_and_headings_say_how_many(huts):
    """A row for each match: curves, then a plan of each building."""
    buildings = {name: load(name) for name in huts}
    played = played_in(buildings, ("none", "sweep"))
    figures = compare_buildings(begun(*huts), played)
    figure = side_by_side(buildings, played, figures)
    assert len(figure.axes) == 2 * 3
    assert {line.get_marker() for line in figure.axes[0].lines} == {"None"}
    for axes, name in zip(figure.axes[1:3], huts, strict=True):
        (crosses,) = axes.collections
        death = played[name][0].deaths[0]
        assert crosses.get_offsets().tolist() == [[death.x, death.y]]
        texts = [t.get_text() for t in axes.texts if isinstance(t, Annotation)]
        assert "Floor 1: 10 die" in texts
        assert f"{name}: 75.0 [75.0, 75.0] % survive" in writing(axes)[-1]
    assert "0.0 [0.0, 0.0] points against hut.txt" in "\n".join(writing(figure))
    told = " ".join(figure.legends[0].get_title().get_text().split())
    assert told.startswith("3 runs of each match; bands and brackets: 95 % boot")
    assert told.endswith("floors: deaths a run; crosses: all runs")
    curve = figure.axes[0]
    ends = [line.get_ydata()[-1] for line in curve.lines if len(line.get_xdata()) > 1]
    assert ends == pytest.approx([75, 75])
