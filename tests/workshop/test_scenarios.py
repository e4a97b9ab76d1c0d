"""--scenario KEY=VALUE, and files that keep the scenario and the paper's numbers."""

import json
import sys
from dataclasses import replace
from pathlib import Path

import pytest
from refusals import refusal
from trainings import begun, tiny, trained

from reference import paper
from reference.__main__ import _arguments, main
from reference.paper import Scenario
from reference.workshop.comparing import begin_evaluation
from reference.workshop.comparing.matches import notes
from reference.workshop.storage.numbers import paper_numbers
from reference.workshop.storage.scenarios import KEYS, in_words, list_keys, read_stated
from reference.workshop.training import starting
from reference.workshop.training.checkpoints import load_checkpoint, save_checkpoint

pytestmark = pytest.mark.usefixtures("in_an_empty_folder")

EVACUATE = ("evacuate", "--building", "tiny")
EVALUATE = ("evaluate", "--building", "tiny", "--people", "4", "--workers", "0")
EVALUATE += ("--episodes", "1", "--out", "eval")
AGAIN = ("evaluate", "--resume", "--workers", "0", "--out", "eval")


@pytest.fixture
def run(tmp_path):
    """The checkpoint of a training that was stopped after its first round."""
    return str(trained(begun(), tmp_path / "run", rounds=1))


def edit(path, change):
    """Change a JSON file in place."""
    content = json.loads(Path(path).read_text())
    change(content)
    Path(path).write_text(json.dumps(content))


# -- On the command line ------------------------------------------------------------


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["sihgt_range=3"], "'sihgt_range' is unknown. Did you mean 'sight_range'?"),
        (["training=1"], "'training' is unknown"),
        (["sight_range"], "sight_range has no value: write sight_range=VALUE"),
        (["sight_range="], "sight_range has no value: write sight_range=VALUE"),
        (["rooms="], "rooms has no value: write rooms=VALUE"),
        (["people_per_floor="], "people_per_floor has no value: write people_per_"),
        (["sight_range=far"], "sight_range is 'far': it must be a number from 1 to 10"),
        (
            ["spread_rate=0"],
            "spread_rate is 0.0: it must be a number from 0.001 to 100",
        ),
        (["spread_rate=-1"], "spread_rate is -1.0: it must be"),
        (["spread_rate=nan"], "spread_rate is nan: it must be"),
        (
            ["burn_seconds=inf"],
            "burn_seconds is inf: it must be a number from 1 to 1,0",
        ),
        (["people=2.5"], "people is 2.5: it must be a whole number from 0 to 10,000"),
        (
            ["people_per_floor=1,x"],
            "one of people_per_floor is 'x': it must be a whole",
        ),
        (["people=3", "people=4"], "people is there twice"),
        (["people=3", "--scenario", "people=3"], "people is there twice"),
        (["people_per_floor=1,2", "rooms=1/hall"], "in rooms or per floor, not both"),
        (
            ["frames_per_tick=25", "decision_seconds=0.2"],
            "must be a tick or more, 0.5 s",
        ),
    ],
)
@pytest.mark.parametrize("command", ["evacuate", "evaluate", "train"])
def test_refuses_what_no_scenario_can_have(command, words, told, capsys):
    """Before anything is done, with the nearest name or the range."""
    status, message = refusal(capsys, command, "--scenario", *words)
    assert (status, told in message) == (2, True)
    assert message.startswith(f"python -m reference {command}: argument --scenario: ")


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["rooms=1/nowhere"], "no room '1/nowhere' in 'Tiny office'"),
        (["people_per_floor=1"], "floors of people_per_floor: 1, of the building: 2"),
    ],
)
def test_refuses_what_the_building_does_not_have(words, told, capsys):
    """Which is known when the map is."""
    status, message = refusal(capsys, *EVACUATE, "--scenario", *words)
    assert (status, told in message) == (1, True)


def test_an_evacuation_is_under_what_is_asked_for(capsys):
    """The note says it, as it was typed; nobody to evacuate is no mistake."""
    words = ["rooms=1/hall,1/store", "sight_range=3", "spread_rate=0.2"]
    assert main([*EVACUATE, "--scenario", "people=7", *words, "--json"]) == 0
    told = capsys.readouterr()
    assert json.loads(told.out)["people"] == 7
    assert told.err == f"Tiny office, 7 people, {', '.join(words)}\n"
    assert main([*EVACUATE, "--scenario", "people=0", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["people"] == 0
    assert main([*EVACUATE, "--scenario", "people_per_floor=0,3", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["people"] == 3


def test_an_evaluation_of_nobody_is_refused(capsys):
    """No share of them survives."""
    status, message = refusal(capsys, "evaluate", "--building", "tiny", "--people", "0")
    assert (status, message) == (1, "there is nobody to evacuate: raise people\n")


def test_a_fire_that_spreads_fast_and_burns_for_long_does_more_harm(capsys):
    """So both are heard; h is that of the same scenario."""
    found = []
    for words in (["spread_rate=0.02"], ["spread_rate=0.3", "burn_seconds=500"]):
        folder = f"out{len(found)}"
        match = ["--robots", "none", "--building", "tiny", "--episodes", "3"]
        match += ["--workers", "0", "--out", folder, "--json"]
        assert main(["evaluate", *match, "--scenario", *words]) == 0
        (cell,) = json.loads(capsys.readouterr().out)["cells"]
        found.append((cell["difficulty"]["mean"], -cell["survival"]["mean"]))
    assert found[0][0] < found[1][0]
    assert found[0][1] < found[1][1]
    kept = json.loads(Path("out1/evaluation.json").read_text())["arena"]["scenario"]
    assert (kept["spread_rate"], kept["burn_seconds"]) == (0.3, 500)
    cells = json.loads(Path("out1/cells.json").read_text())
    assert cells["scenario"] == {"spread_rate": 0.3, "burn_seconds": 500}


def test_people_are_counted_once(capsys):
    """By --people or by --scenario, if both do not say the same."""
    for words in ("people=5", "people_per_floor=2,2"):
        status, message = refusal(
            capsys, *EVACUATE, "--people", "4", "--scenario", words
        )
        assert (status, "they count people differently" in message) == (2, True)
    assert main([*EVACUATE, "--people", "4", "--scenario", "people=4"]) == 0


def test_robots_that_are_asked_away_stay_away(capsys):
    """None are put back for a guide then."""
    asked = ["--scenario", "robots_per_floor=0", "people=4", "--json"]
    assert main([*EVACUATE, "--robots", "sweep", *asked]) == 0
    alone = json.loads(capsys.readouterr().out)
    assert main([*EVACUATE, "--robots", "none", "--people", "4", "--json"]) == 0
    none = json.loads(capsys.readouterr().out)
    assert alone["simulated_seconds"] == none["simulated_seconds"]


def test_what_is_written_can_be_typed():
    """The words of a heading, read again; and the help lists every key."""
    scenario = Scenario(people=3, rooms=("1/hall", "1/store"), sight_range=2.5)
    words = in_words(scenario, ("people", "rooms", "sight_range")).split(", ")
    assert Scenario(**read_stated(words, {})) == scenario
    listed = [line.split()[0] for line in list_keys().splitlines()[2:]]
    assert listed == list(KEYS)
    assert "  sight_range       1 to 10,000 metres in smoke; default: 5" in list_keys()


# -- Checkpoints --------------------------------------------------------------------


def test_a_training_is_under_what_is_asked_for(monkeypatch, capsys):
    """A resumed one keeps it, and takes no other."""
    settings = tiny(robots={"max_steps": 40}, fire={"max_steps": 3, "buffer_size": 2})
    monkeypatch.setattr(starting, "preset", lambda name: settings)
    train = ["train", "--preset", "tiny", "--workers", "0", "--out", "new"]
    assert main([*train, "--scenario", "people=5", "sight_range=3"]) == 0
    scenario = load_checkpoint("new").task.settings.scenario
    assert (scenario.people, scenario.sight_range, scenario.training) == (5, 3, True)
    again = ["train", "--workers", "0", "--resume", "--out", "new", "--scenario"]
    capsys.readouterr()
    assert main([*again, "people=5", "sight_range=3.0"]) == 0
    capsys.readouterr()
    status, message = refusal(capsys, *again, "people=6")
    assert (status, "--scenario: a resumed run keeps its" in message) == (2, True)
    status, message = refusal(capsys, *train[:-1], "x", "--scenario", "people=0")
    assert (status, message) == (1, "there is nobody to evacuate: raise people\n")


def test_a_policy_plays_under_what_it_can_read(run, capsys):
    """Others of its numbers are refused by the field's name."""
    match = ("evacuate", "--robots", run, "--scenario")
    assert main([*match, "sight_range=8", "burn_seconds=80"]) == 0
    assert "learned under sight_range=5, burn_seconds=40; here it plays under " in (
        capsys.readouterr().err
    )
    for word, own in (
        ("people=7", "people=6; here it is 7"),
        ("robots_per_floor=1", "robots_per_floor=2; here it is 1"),
        ("sources=1", "sources=3; here it is 1"),
        ("decision_seconds=2", "decision_seconds=5; here it is 2"),
    ):
        status, message = refusal(capsys, *match, word)
        assert (status, f"its robots learned with {own}" in message) == (1, True)


def test_people_of_all_floors_are_as_many_as_people(capsys):
    """Both may be stated, if they come to the same."""
    floors = "people_per_floor=3,2"
    status, message = refusal(capsys, *EVACUATE, "--scenario", "people=6", floors)
    assert status == 2
    assert "people is 6, people_per_floor comes to 5: leave one out" in message
    assert main([*EVACUATE, "--scenario", "people=5", floors]) == 0


def test_an_evaluation_keeps_its_scenario(capsys):
    """What is typed again may not differ."""
    assert main([*EVALUATE, "--scenario", "spread_rate=0.2", "rooms=1/hall"]) == 0
    assert main([*AGAIN, "--scenario", "rooms=1/hall", "spread_rate=0.2"]) == 0
    capsys.readouterr()
    status, message = refusal(capsys, *AGAIN, "--scenario", "spread_rate=0.3")
    assert (status, "--scenario: a resumed run keeps its" in message) == (2, True)


# -- Numbers ------------------------------------------------------------------------


def test_numbers_are_by_name_as_they_are_now(monkeypatch):
    """Points too; no tables, and nothing that is no number."""
    monkeypatch.setattr(paper, "HEALTH", 50.0)
    now = paper_numbers()
    assert (now["HEALTH"], now["PEOPLE"]) == (50.0, 40)
    assert now["WORST_POINT"] == paper.WORST_POINT
    assert not {"TABLE_I", "TABLE_II"} & {*now}
    assert json.loads(json.dumps(now)).keys() == now.keys()


def test_an_evaluation_goes_on_with_the_numbers_it_began_with(capsys, monkeypatch):
    """Others are told by name, with both values; one that is only new is none."""
    assert main([*EVALUATE]) == 0
    kept = json.loads(Path("eval/evaluation.json").read_text())["numbers"]
    assert kept == json.loads(json.dumps(paper_numbers()))
    edit("eval/evaluation.json", lambda content: content["numbers"].pop("HEALTH"))
    assert main([*AGAIN, "--fire", "none"]) == 0
    capsys.readouterr()
    with monkeypatch.context() as patched:
        patched.setattr(paper, "FIXED_PENALTY", 1000.0)
        patched.setattr(paper, "WORST_POINT", (-40_000.0, 0.1))
        status, message = refusal(capsys, *AGAIN)
        assert status == 1
        assert (
            "begun with WORST_POINT=(-12000.0, 0.1) (here (-40000.0, 0.1))" in message
        )
        assert "), FIXED_PENALTY=300.0 (here 1000.0). Go on with these" in message
    edit("eval/evaluation.json", lambda content: content.pop("numbers"))
    monkeypatch.setattr(paper, "BURN_LOSS", 9.0)
    assert main([*AGAIN]) == 0  # nobody knows with which


def test_code_of_your_own_may_change_numbers(monkeypatch):
    """They are those of its evaluation, whoever has not imported it yet."""
    monkeypatch.syspath_prepend(Path.cwd())
    Path("changes.py").write_text(
        "from reference import paper\n"
        "from reference.workshop.strategies.guides import Sweep\n"
        "paper.FIXED_PENALTY = 1000.0\n"
    )
    for words in ([*EVALUATE, "--robots", "changes:Sweep"], [*AGAIN, "--fire", "none"]):
        monkeypatch.setattr(paper, "FIXED_PENALTY", 300.0)
        sys.modules.pop("changes", None)
        assert main(words) == 0


def test_refuses_numbers_that_are_no_names_and_values(capsys):
    """In a file that somebody edited."""
    assert main([*EVALUATE]) == 0
    capsys.readouterr()
    edit("eval/evaluation.json", lambda content: content.update(numbers=[1]))
    status, message = refusal(capsys, *AGAIN)
    assert (status, "numbers: this must be names and values" in message) == (1, True)


def test_a_training_goes_on_with_the_numbers_it_began_with(run, capsys, monkeypatch):
    """A checkpoint keeps them; resuming with others is refused."""
    folder = str(Path(run).parent)
    assert load_checkpoint(run).numbers == paper_numbers()
    monkeypatch.setattr(paper, "ROBOT_SPEED", 0.5)
    again = ("train", "--resume", "--workers", "0", "--out", folder)
    status, message = refusal(capsys, *again)
    told = f"{folder}: was begun with ROBOT_SPEED=1.5 (here 0.5). Go on with these"
    assert (status, message.startswith(told)) == (1, True)


def test_a_policy_that_learned_with_other_numbers_is_told(run, capsys, monkeypatch):
    """In a line on stderr, once; of what ships, too."""
    monkeypatch.setattr(paper, "ROBOT_SPEED", 0.5)
    line = f"--robots {run}: learned with ROBOT_SPEED=1.5 (here 0.5)\n"
    assert main(["evacuate", "--robots", run]) == 0
    assert capsys.readouterr().err.count(line) == 1
    match = ["evaluate", "--robots", run, "--episodes", "1", "--workers", "0"]
    assert main(match) == 0
    assert capsys.readouterr().err.count(line) == 1
    starting.begin_training(_arguments(["train", "--preset", "tiny", "--robots", run]))
    told = f"note: robots {run}: learned with ROBOT_SPEED=1.5 (here 0.5)\n"
    assert capsys.readouterr().err == told
    ships = begin_evaluation(("learned",), ("none",), episodes=1)
    assert notes(ships) == [line.replace(run, "learned").strip()]


def test_a_checkpoint_without_numbers_is_no_difference(run, tmp_path, monkeypatch):
    """As older versions wrote them; nor is a number that is only new."""
    checkpoint = load_checkpoint(run)
    few = {"HEALTH": paper.HEALTH, "GONE": 3}
    for numbers in ({}, few):
        save_checkpoint(replace(checkpoint, numbers=numbers), tmp_path / "old.pt")
        old = str(tmp_path / "old.pt")
        assert load_checkpoint(old).numbers == numbers
        monkeypatch.setattr(paper, "ROBOT_SPEED", 0.5)
        assert notes(begin_evaluation((old,), ("none",), episodes=1)) == []
