"""Scripts beside `experiment` play what they say, and tell what they found."""

from importlib import import_module
from pathlib import Path
from subprocess import PIPE
from types import SimpleNamespace

import numpy as np
import pytest
import torch
from conftest import ROOT
from pages import overlaps
from processes import ended, python
from trainings import begun, equal, tiny

from reference import Scenario, Simulation, load
from reference.__main__ import main
from reference.fire import RandomFire
from reference.paper import InputError
from reference.workshop.comparing.design import Experiment
from reference.workshop.comparing.named import strategy_named
from reference.workshop.drawing.colours import colour_of
from reference.workshop.engine import run_to_end
from reference.workshop.storage.files import read_json
from reference.workshop.storage.settings import read_yaml_file
from reference.workshop.training.checkpoints import (
    Task,
    load_checkpoint,
    save_checkpoint,
)
from reference.workshop.training.families import Family
from reference.workshop.training.gradient import Gradients
from reference.workshop.training.mlagents import with_trainer_file
from reference.workshop.training.presets import preset
from reference.workshop.training.rounds import Training

SCRIPTS = ROOT / "tutorials" / "experiments"

pytestmark = pytest.mark.usefixtures("in_an_empty_folder")


def told(script, *options):
    """What a script prints, line by line."""
    command = (SCRIPTS / script, *options, "--workers", "0")
    process = python(*command, env={"MPLBACKEND": "Agg"}, stdout=PIPE, stderr=PIPE)
    out, err = ended(process)
    assert process.returncode == 0, err
    return out.splitlines()


@pytest.fixture
def script(monkeypatch):
    """Imports a script by its name."""
    monkeypatch.syspath_prepend(SCRIPTS)
    return import_module


@pytest.mark.slow
def test_every_age_of_a_training_meets_every_fire(tmp_path):
    """The fire of its own age, too; guides meet the fires of rules alone."""
    main(["train", "--preset", "tiny", "--workers", "0", "--out", "out"])
    lines = told("tenths.py", "out", "--tenths", "2", "--episodes", "2")
    found = [line.split()[:2] for line in lines if line.split()[1:]]
    ages = list(dict.fromkeys(robots for robots, _ in found if robots.endswith("%")))
    assert len(ages) == 2 and ages[-1] == "100%"
    for robots in (*ages, "none", "escort"):
        fires = [fire for who, fire in found if who == robots]
        own = ["of"] if robots in ages else []  # of its age
        assert fires == ["none", "random", "busiest", "fixed", *own]

    assert told("tenths.py", "out", "--tenths", "2", "--episodes", "2") == lines
    assert (tmp_path / "out" / "tenths" / "tenths.png").stat().st_size > 10_000


@pytest.mark.slow
def test_every_training_and_the_guide_have_a_best_response(tmp_path):
    """As many for the guide as an arm has trainings."""
    file = str(SCRIPTS / "tiny.toml")
    main(["experiment", file, "--workers", "0", "--out", "out"])
    asked = (file, "out", "--decisions", "12")
    head, *rows, less = told("best_responses.py", *asked)[-5:]
    assert head.split()[:2] == ["robots", "trainings"]
    assert [row.split()[:2] for row in rows] == [
        ["random_fire", "2"],
        ["learning", "2"],
        ["escort", "2"],
    ]
    assert less.startswith("learning less random_fire: ")
    made = tmp_path / "out" / "best_responses" / "12"
    kept = read_json(made / "best_responses.json")
    assert {arm: np.shape(shares) for arm, shares in kept.items()} == {
        "random_fire": (2, 2),
        "learning": (2, 2),
        "escort": (2, 2),
    }
    assert len([*made.glob("*/checkpoint-*.pt")]) >= 6


@pytest.mark.slow
def test_a_copy_is_played_beside_its_teacher(tmp_path):
    """Once: what is made, played and asked is told again."""
    asked = ("--evacuations", "4", "--units", "--episodes", "1", "--asked", "1")
    head, line, file = told("how_much_to_copy.py", *asked)[-3:]
    assert head.split()[:2] == ["evacuations", "units"]
    evacuations, units, *_, share = line.split()
    assert (evacuations, units) == ("4", "128") and 20 < float(share) < 100
    assert (tmp_path / file).stat().st_size > 10_000
    assert told("how_much_to_copy.py", *asked)[-3:] == [head, line, file]


@pytest.mark.parametrize(("own", "agrees"), [("escort", True), ("patrol", False)])
def test_a_teacher_that_is_asked_agrees_with_itself_alone(own, agrees, script):
    """And what it says changes nothing."""
    asked = script("how_much_to_copy").Asked(
        strategy_named(own, "robots"), strategy_named("escort", "robots")
    )
    short = Scenario(people=12, time_limit=40)
    alone, run = (
        Simulation(load("tiny"), short, robots, RandomFire(), seed=3)
        for robots in (asked.own, asked)
    )
    run_to_end([alone, run])
    assert run.events == alone.events
    team = run.robot_strategy
    assert team.decisions > 20
    assert (team.agreed == team.decisions) is agrees


@pytest.mark.slow
def test_who_guards_moves_fires_and_who_does_not_moves_none():
    """Of the second fire, that guards are quick enough for; the picture shows it."""
    asked = ("escort", "guard", "--episodes", "3", "--picture", "guards.png")
    _, *lines, file = told("who_stands_in_the_way.py", *asked)
    assert Path(file).stat().st_size > 10_000
    moves = {line.split()[0]: float(line.split()[4]) for line in lines}
    assert moves["escort"] == 0 < moves["guard"] <= 8


@pytest.mark.slow
def test_a_guard_moves_closer_to_another_cell(tmp_path):
    """Where `closer` burns by itself nothing changes; its watches are told apart."""
    asked = ("--episodes", "2", "--picture", "cells.png")
    *lines, file = told("where_guards_push_fires.py", *asked)
    heads = [k for k, line in enumerate(lines) if not line.startswith(" ")]
    assert [lines[k].split(":")[0] for k in heads] == ["fixed", "closer", "closer"]
    gains = [line.split()[2] for line in lines[heads[-1] + 1 :]]
    assert gains[0] == "0.0" and len(gains) == 12
    assert any(gain != "0.0" for gain in gains)
    assert (tmp_path / file).stat().st_size > 10_000


@pytest.mark.slow
def test_the_best_of_many_is_judged_where_it_was_not_chosen(script):
    """What the choice believed in is told apart, and is no less than nothing."""
    asked = ("--episodes", "4", "--fire", "fixed", "random")
    lines = told("what_is_there_to_learn.py", *asked)
    family = script("what_is_there_to_learn").FAMILY
    heads = [k for k, line in enumerate(lines) if not line.startswith(" ")]
    assert [lines[k].split(":")[0] for k in heads] == ["fixed", "random"]
    for k in heads:
        best, _, said = lines[k].split(": ")[1].partition(" is the best in ")
        assert said == "half of the evacuations"
        assert best in family
        believed = [line for line in lines[k + 1 : k + 3] if "points more than" in line]
        assert all(float(line.split()[0]) >= 0 for line in believed)
        assert all(not line.endswith(f"than {best} there") for line in believed)

    found = {"a": np.array([3.0, 3, 0, 0]), "b": np.array([2.0, 2, 9, 9])}
    assert script("what_is_there_to_learn").best_of(found) == "a"


@pytest.mark.slow
def test_parts_of_the_noise_make_the_whole(tmp_path):
    """In per cent of the variance, under each fire."""
    asked = ("learned", "--fire", "busiest", "random", "--decisions", "2")
    lines = told("what_noise_is_made_of.py", *asked)
    heads = [k for k, line in enumerate(lines) if not line.startswith(" ")]
    assert [lines[k].split(":")[0] for k in heads] == ["busiest", "random"]
    shares = [float(line[36:].split()[0]) for line in lines[1 : heads[1]]]
    assert len(shares) == 8 and sum(shares) == pytest.approx(100, abs=0.5)


@pytest.mark.slow
def test_robots_that_search_are_played_beside_their_own_team():
    """Once: what is in the table is told, not played again."""
    asked = ("search.csv", "--building", "tiny", "--base", "observer")
    asked += ("--fires", "random", "--evacuations", "1", "--futures", "1", "1")
    lines = told("robots_that_search.py", *asked)
    assert lines[1].split()[:5] == ["observer", "random", "4", "1+1", "1"]
    (table,) = Path.cwd().glob("*.csv")
    before = table.read_bytes()
    assert told("robots_that_search.py", *asked) == lines
    assert table.read_bytes() == before


@pytest.mark.slow
@pytest.mark.parametrize(
    ("command", "status", "message"),
    [
        ("tenths.py nowhere", 1, "nowhere: there is no checkpoint in this folder."),
        ("what_robots_do.py escrot", 1, "Did you mean 'escort'?"),
        ("what_a_decision_is_worth.py show none.csv", 1, "there is no row in it"),
        ("where_people_die.py escort --episodes 0", 2, "must be a whole number from 1"),
        ("how_fires_burn.py --fire closr", 2, "invalid choice: 'closr'"),
        ("any_map.py --first -1", 2, "must be a whole number from 0"),
        ("clock.py old new --rounds 0", 2, "--rounds: it must be 1 or more"),
        ("density.py nothing.txt", 1, "nothing.txt: cannot be read"),
    ],
)
def test_a_script_tells_a_mistake_in_a_line(command, status, message):
    """As the commands do, without a traceback."""
    script, *words = command.split()
    process = python(SCRIPTS / script, *words, stdout=PIPE, stderr=PIPE)
    _, err = ended(process)
    assert (process.returncode, message in err) == (status, True)
    assert "Traceback" not in err


# -- In this process ----------------------------------------------------------------


def test_buildings_are_counted_for_each_number_of_decisions_apart(script, monkeypatch):
    """What five decisions have taught is not told of seven."""
    counting = script("how_many_buildings")
    trained = []

    def note(folder, begin, workers_of_it):
        trained.append(folder)

    def lacks_one(*asked):
        return dict.fromkeys(counting.FIRES, 1.0)

    monkeypatch.setattr(counting, "finish_training", note)
    monkeypatch.setattr(counting, "less_than_guide", lacks_one)
    monkeypatch.setattr(counting, "PLACES", 1)
    for decisions in ("5", "7"):
        asked = ["", "--numbers", "1", "--seeds", "0", "--workers", "0"]
        monkeypatch.setattr("sys.argv", [*asked, "--decisions", decisions])
        counting.main()
    tables = [Path("out/how_many", decisions) for decisions in ("5", "7")]
    assert trained == [table / "1-0" for table in tables]
    found = [read_json(table / "how_many.json")["trainings"] for table in tables]
    assert [[row["decisions"] for row in rows] for rows in found] == [[5], [7]]


def test_best_responses_of_other_lengths_are_others(script, monkeypatch):
    """A fire of five decisions is not taken for one of seven, nor of other robots."""
    best = script("best_responses")
    trained = []

    def note(folder, begin, workers_of_it):
        trained.append(folder)

    monkeypatch.setattr(best, "finish_training", note)
    monkeypatch.setattr(best, "newest_checkpoint", lambda path: path / "newest.pt")
    there = {"arm-0": Path("arm-0-1234abcd")}
    monkeypatch.setattr(best, "finished", lambda experiment, folder: there)
    experiment = SimpleNamespace(
        preset="tiny", building="tiny", seeds=(0, 1), settings={}
    )
    for decisions in (5, 7):
        made = [*best.responses(experiment, Path("out"), decisions, 0)]
        assert [fire for _, _, fire in made] == trained[-3:]
        assert made[0][2].name == "arm-0-1234abcd"
    assert len(set(trained)) == 6


def test_best_responses_learn_and_play_under_what_the_experiment_states(
    script, monkeypatch
):
    """Lists, too; not under what one of its arms has for itself."""
    best = script("best_responses")
    people = {"people_per_floor": [2, 1], "sources": 2}
    stated = {"episodes_per_job": 1, "scenario": people, "fire": {"num_epoch": 2}}
    experiment = Experiment(
        arms={"near": {"fire": "random", "scenario": {"sight_range": 3.0}}},
        decisions=20,
        preset="tiny",
        building="tiny",
        seeds=(0,),
        settings=stated,
    )
    played = []

    def note(evaluation, *rest):
        played.append(evaluation)
        return [SimpleNamespace(survival=0.5)]

    monkeypatch.setattr(best, "finish_training", lambda *asked: None)
    monkeypatch.setattr(best, "newest_checkpoint", lambda path: path / "newest.pt")
    monkeypatch.setattr(best, "with_digests", lambda evaluation: evaluation)
    monkeypatch.setattr(best, "play_evaluation", note)
    monkeypatch.setattr(best, "read_experiment", lambda path: experiment)
    there = {"near-0": Path("near-0-1234abcd")}
    monkeypatch.setattr(best, "finished", lambda experiment, folder: there)
    asked = ["--decisions", "7", "--workers", "0"]
    monkeypatch.setattr("sys.argv", ["", "asked.toml", "out", *asked])
    best.main()
    assert [evaluation.arena for evaluation in played] == [experiment.arena] * 2
    written = Path("out/best_responses/7/settings.yaml")
    learned, _ = with_trainer_file(preset("tiny"), read_yaml_file(written), written)
    assert learned.scenario.people_per_floor == (2, 1) and learned.scenario.sources == 2
    assert (learned.episodes_per_job, learned.fire.num_epoch) == (1, 2)
    assert (learned.fire.max_steps, learned.fire.buffer_size) == (7, 64)


def test_where_nobody_dies_nothing_is_told_of_deaths(script, capsys):
    """No share of nothing: numpy's warnings would be errors here."""
    dying = script("where_people_die")
    notes = dying.Notes(Simulation(load("paper")))
    notes.ground[:] = 5
    dying.tell("none", [notes])
    told = capsys.readouterr().out
    assert "none: 0.0 die" in told and "who got out" in told
    assert "who died" not in told and "who die there" not in told


def kept(training):
    """A folder with the only checkpoint of a training."""
    path = Path("out", "checkpoint-000000.pt")
    path.parent.mkdir()
    save_checkpoint(training.checkpoint(), path)
    return path.parent


@pytest.mark.parametrize("name", ["by_age", "tenths", "signal_to_noise"])
def test_robots_that_do_not_learn_have_no_age_and_no_signal(script, monkeypatch, name):
    """It is said in words."""
    folder = kept(begun(fixed={"robots": ("escort",)}))
    monkeypatch.setattr("sys.argv", ["", str(folder)])
    with pytest.raises(InputError, match="its robots do not learn"):
        script(name).main()


def test_who_has_only_begun_has_no_age(script):
    """A copy of another strategy has made no decision of its own."""
    folder = kept(begun())
    with pytest.raises(InputError, match="have not learned yet"):
        script("by_age").ages(folder, 10)


TABLES = SCRIPTS.parent / "tables"


def test_ages_have_colours_from_the_fewest_to_the_most_who_survive(script):
    """A scale from 0 to 100 % left a hundred cells nearly white."""
    cells = script("kept_rows").kept_cells(TABLES / "by_age.json")
    figure = script("by_age").drawn(cells)
    axes = figure.axes[0]
    (image,) = axes.images
    means = [100 * cell.survival.mean for cell in cells]
    assert image.get_clim() == pytest.approx((min(means), max(means)))
    assert len(axes.texts) == len(cells)
    assert overlaps(figure) == []


def test_who_has_decided_nothing_stands_at_0_and_guides_look_as_anywhere(script):
    """Left of a break of the axis, which is logarithmic."""
    nothing = script("from_nothing")
    names = "from_nothing", "from_nothing_again"
    tables = [nothing.kept_cells(TABLES / f"{name}.json") for name in names]
    figure = nothing.drawn(tables)
    assert len(figure.axes) == len(nothing.FIRES)
    assert overlaps(figure) == []
    for axes in figure.axes:
        labels = [label.get_text() for label in axes.get_xticklabels()]
        assert labels == ["0", "0.1", "1", "10"]
        lines = {line.get_label(): line for line in axes.lines}
        for guide in nothing.GUIDES:
            assert lines[guide].get_color() == colour_of(guide)


def test_a_single_checkpoint_is_the_only_age(script, monkeypatch):
    """There is none before it, and none after its end."""
    tenths = script("tenths")
    path = str(Path("out", "checkpoint-000003.pt"))
    Path("out").mkdir()
    Path(path).touch()
    monkeypatch.setattr(tenths, "ages", lambda folder, tenths: {path: "100%"})
    assert tenths.checkpoints(Path("out"), 10) == {"100%": path}


def test_the_signal_of_every_lambda_is_that_of_the_same_network(script, monkeypatch):
    """It is measured, not changed: nor are its normalisers."""
    folder = kept(begun(fixed={"fire": ("none",)}))
    measuring = script("signal_to_noise")
    seen = []

    def note(learner):
        seen.append({k: x.clone() for k, x in learner.actor.state_dict().items()})
        return Gradients(1, [torch.zeros(1)], torch.zeros(()))

    monkeypatch.setattr(measuring, "measure_gradients", note)
    asked = ["--fire", "none", "--rounds", "2", "--episodes", "1", "--workers", "0"]
    asked += ["--lambdas", *map(str, measuring.LAMBDAS)]
    monkeypatch.setattr("sys.argv", ["", str(folder), *asked])
    measuring.main()
    before = load_checkpoint(folder).learners["robots"]["actor"]
    assert len(seen) == 2 * len(measuring.LAMBDAS)
    assert all(equal(state, before) for state in seen)


def test_rounds_together_tell_the_signal_that_one_large_round_does(script):
    """And the jackknife's error is near what many such estimates differ by."""
    measuring = script("signal_to_noise")
    generator = torch.Generator().manual_seed(0)

    def of_round(count):
        g = 0.2 + torch.randn(count, 50, generator=generator)
        return Gradients(count, [g.sum(dim=0)], g.square().sum())

    # |E g|² is 50 times 0.04, and the trace 50: a ratio of 0.04 an episode
    made = [
        measuring.estimate([of_round(40) for _ in range(10)], 100) for _ in range(60)
    ]
    estimates, errors = map(np.array, zip(*made, strict=True))
    assert estimates.mean() == pytest.approx(4, rel=0.05)
    assert np.sqrt((errors**2).mean()) == pytest.approx(estimates.std(), rel=0.25)


@pytest.mark.slow
def test_robots_of_many_buildings_have_a_signal_in_one(capsys, script, monkeypatch):
    """In an example; the number of processes changes nothing."""
    settings = tiny(robots={"head": "set"})
    family = Family(widths=(15, 18), heights=(10, 12), floors=(1, 2), people=(3, 9))
    task = Task("some", "", settings, fixed={"fire": ("none",)}, family=family)
    folder = kept(Training(task))
    asked = ["", str(folder), "--fire", "none", "--rounds", "1", "--episodes", "2"]
    asked += ["--workers"]
    heard = []
    for number in ("0", "1"):
        monkeypatch.setattr("sys.argv", [*asked, number])
        script("signal_to_noise").main()
        heard.append(capsys.readouterr().out)
    assert heard[0] == heard[1]
    assert heard[0].startswith("2 evacuations") and "0.95  " in heard[0]
