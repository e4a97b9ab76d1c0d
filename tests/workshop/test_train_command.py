"""The command `train`, and checkpoints where `evacuate` takes a strategy."""

import json
import os
import re
import shutil
import signal
import time
from argparse import Namespace
from concurrent.futures.process import BrokenProcessPool
from dataclasses import replace
from importlib.util import find_spec
from multiprocessing import active_children
from pathlib import Path
from subprocess import PIPE

import pytest
from processes import ended, python
from trainings import begun, equal, tiny, trained

from reference.__main__ import main
from reference.paper import InputError
from reference.workshop.commands.training import JOBS_NEED
from reference.workshop.storage.records import SettingsError
from reference.workshop.training import loop, starting
from reference.workshop.training.checkpoints import (
    load_checkpoint,
    newest_checkpoint,
    save_checkpoint,
)

pytestmark = pytest.mark.usefixtures("in_an_empty_folder")

PROMISED = """building preset robots fire seed rounds episodes steps reward fire_reward
survival evacuated died inside checkpoint summaries"""


@pytest.fixture
def once(monkeypatch):
    """Preset tiny, smaller still, and with a single round."""
    settings = tiny(robots={"max_steps": 40}, fire={"max_steps": 3, "buffer_size": 2})
    monkeypatch.setattr(starting, "preset", lambda name: settings)


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """The folder of a training that was stopped after its first round."""
    folder = tmp_path_factory.mktemp("run")
    trained(begun(), folder, rounds=1)
    return folder


def train(*options):
    """Exit status of `train`, in this process."""
    return status("train", "--preset", "tiny", "--workers", "0", *options)


def resumed(folder, *options):
    """Exit status of `train --resume`, in this process."""
    resume = "train", "--resume", "--workers", "0", "--json", "--out", folder
    return status(*resume, *options)


def status(*command):
    """Exit status of a command, in this process."""
    try:
        return main([str(word) for word in command])
    except SystemExit as end:
        return end.code


# -- train --------------------------------------------------------------------------


@pytest.mark.paper("E1")
@pytest.mark.paper("E2")
def test_train_prints_one_object_with_final_figures(once, capsys):
    """The contract for programs that read it."""
    assert train("--out", "new", "--json", "--seed", "4") == 0
    facts = json.loads(capsys.readouterr().out)
    assert list(facts) == PROMISED.split()
    assert (facts["building"], facts["seed"]) == ("tiny", 4)
    assert facts["robots"] == "poca (mixture head)"
    assert facts["steps"]["robots"] >= 40 and facts["steps"]["fire"] >= 4
    assert 0 <= facts["survival"] <= 1
    assert facts["evacuated"] + facts["died"] + facts["inside"] == 6
    assert load_checkpoint(facts["checkpoint"]).round == facts["rounds"]
    assert os.path.exists(facts["summaries"])


def test_train_tells_people_what_begins_and_how_to_look_at_it(once, capsys):
    """Notes go to stderr; their last line is a command that works."""
    assert train("--out", "new", "--fire", "random") == 0
    out, err = capsys.readouterr()
    first, *_, command = err.splitlines()
    assert first == (
        "Tiny office, people=6, sources=3, time_limit=40: "
        "robots poca (mixture head), fire random, seed 0; 40 decisions to go"
    )
    assert re.search(r"^reward +-?[\d,.]+$", out, re.MULTILINE)
    assert re.search(r"^survival +0\.\d+$", out, re.MULTILINE)
    assert "ends before anything is learned" in err
    became = re.search(r"of 6 people in the last round.*", err)[0]
    counts = re.findall(r"([\d.]+) (?:got out|died|were inside)", became)
    assert len(counts) == 3 and sum(map(float, counts)) == pytest.approx(6, abs=0.02)
    words = command.split()
    assert words[:3] == ["python", "-m", "reference"]
    assert main(words[3:]) == 0
    assert os.path.exists("learned.html")


@pytest.mark.slow
def test_curves_draws_what_a_training_wrote(tmp_path_factory, capsys):
    """By its folder; a run too short for a curve is told so, in one message."""
    folder = tmp_path_factory.mktemp("curves")
    trained(begun(), folder)
    assert status("curves", folder, "-o", "c.png") == 0
    assert os.path.getsize("c.png") > 10_000
    assert status("curves", folder.parent) == 1
    assert status("curves", folder, "-o", "c.txt") == 2


def test_the_trainer_is_the_robots_and_the_head_of_both(once, capsys):
    """The fire keeps its trainer; what was learned plays, and goes on learning."""
    assert train("--out", "new", "--trainer", "ppo", "--head", "floor") == 0
    assert "robots ppo (floor head)" in capsys.readouterr().err
    settings = load_checkpoint("new").task.settings
    assert (settings.robots.head, settings.fire.head) == ("floor", "floor")
    assert status("evaluate", "--robots", "new", "--fire", "none", "--episodes", 2) == 0
    assert resumed("new") == 0


def test_train_takes_a_file_of_settings_and_a_checkpoint_as_opponent(run, capsys):
    """ML-Agents' keys; and a folder of a training stands for its newest."""
    pytest.importorskip("yaml")
    Path("mine.yaml").write_text("behaviors: {Robot: {max_steps: 40}}")
    assert train("--settings", "mine.yaml", "--out", "new", "--fire", run) == 0
    task = load_checkpoint("new").task
    assert task.settings.robots.max_steps == 40
    assert equal(
        task.fixed["fire"][0].weights, load_checkpoint(run).player("fire").weights
    )


def test_what_settings_state_of_a_scenario_does_not_vary_by_lot(tmp_path):
    """As with `--scenario`; the heading tells it once; one building's is refused."""
    pytest.importorskip("yaml")
    asked = Namespace(**dict.fromkeys(starting.OPTIONS))
    asked.preset = "any"
    asked.building = ["random"]
    asked.settings = tmp_path / "mine.yaml"
    asked.settings.write_text("reference: {scenario: {people: 40, sight_range: 6}}")
    training = starting.begin_training(asked)
    family = training.task.family
    assert (family.people, family.robots_per_floor) == ((40, 40), (1, 8))
    assert "40 people, 1 to 8 robots a floor), sight_range=6: " in training.about()

    asked.scenario = {"people": 12}
    training = starting.begin_training(asked)
    assert training.task.family.people == (12, 12)
    assert training.about().count("people") == 1

    asked.settings.write_text("reference: {scenario: {rooms: [1/hall]}}")
    with pytest.raises(InputError, match="rooms is of one building"):
        starting.begin_training(asked)


def test_refuses_buildings_by_lot_with_nobody_in_them():
    """As in a map that is named."""
    asked = Namespace(**dict.fromkeys(starting.OPTIONS))
    asked.preset = "any"
    asked.scenario = {"people": 0}
    with pytest.raises(SettingsError, match="nobody to evacuate"):
        starting.begin_training(asked)


def test_preset_any_trains_in_a_single_map_too():
    """Its fires are scripted there as in any."""
    asked = Namespace(**dict.fromkeys(starting.OPTIONS))
    asked.preset = "any"
    asked.building = ["tiny"]
    training = starting.begin_training(asked)
    assert [*training.learners] == ["robots"]
    assert training.task.fixed["fire"] == training.settings.stand_ins


def test_fire_learns_without_robots_in_generated_buildings():
    """None stand there, as in one building."""
    asked = Namespace(**dict.fromkeys(starting.OPTIONS))
    asked.preset = "any"
    asked.robots = ["none"]
    training = starting.begin_training(asked)
    jobs = [job.lot for job in training.jobs()]
    assert jobs and not any(lot.robots_per_floor for lot in jobs)


def test_refuses_a_side_that_a_network_of_another_training_played(once, run, capsys):
    """It would play under this training's name; who learned here learns on."""
    assert train("--out", "new", "--fire", run, "random") == 0
    assert resumed("new") == 0
    capsys.readouterr()
    assert status("evacuate", "--robots", "new", "--fire", "new") == 1
    told = capsys.readouterr().err
    assert "nobody learned for the fire there. A network of another" in told
    assert "name the checkpoint that it is of" in told
    assert train("--out", "x", "--fire", "new") == 1
    assert "nobody learned for the fire there" in capsys.readouterr().err
    assert train("--out", "on", "--initialize-from", "new") == 0
    assert list(load_checkpoint("on").task.initial) == ["robots"]
    assert status("evacuate", "--robots", "new", "--fire", run) == 0


def test_robots_learn_against_several_fires_in_turn(once, capsys):
    """What is resumed keeps them."""
    fires = "--fire", "random", "busiest"
    assert train("--out", "new", *fires) == 0
    assert "fire random, busiest" in capsys.readouterr().err
    assert load_checkpoint("new").task.fixed["fire"] == ("random", "busiest")
    assert resumed("new", *fires) == 0
    assert resumed("new", "--fire", "busiest") == 2


@pytest.mark.paper("E3")
def test_train_begins_with_the_networks_of_a_checkpoint(once, run, capsys):
    """With all that learn here and learned there."""
    begin = ("--out", "new", "--initialize-from", run)
    assert train(*begin, "--fire", "random") == 0
    task = load_checkpoint("new").task
    assert list(task.initial) == ["robots"]
    assert equal(
        task.initial["robots"].weights, load_checkpoint(run).player("robots").weights
    )
    assert resumed("new") == 0
    assert train("--out", "both", "--initialize-from", run) == 0
    assert list(load_checkpoint("both").task.initial) == ["robots", "fire"]
    capsys.readouterr()
    assert train("--out", "x", "--robots", "sweep", "--initialize-from", "new") == 1
    assert "nobody learned there who learns here" in capsys.readouterr().err
    assert train("--out", "x", "--head", "floor", "--initialize-from", "learned") == 1
    assert "the network to begin with has head set. Ask for" in capsys.readouterr().err
    assert not os.path.exists("x")


def test_says_that_robots_who_imitate_begin_with_random_weights(once, run, capsys):
    """Of the checkpoint only the fire is taken."""
    begin = ("--out", "new", "--initialize-from", run)
    assert train(*begin, "--imitate", "sweep") == 0
    assert list(load_checkpoint("new").task.initial) == ["fire"]
    told = f"random weights: of {run} only the fire is taken\n"
    assert capsys.readouterr().err.count(told) == 1


def test_train_begins_with_a_folder_that_is_called_as_a_strategy(once, run):
    """Nobody begins with a strategy: its networks are meant."""
    shutil.copytree(run, "fixed")
    assert train("--out", "new", "--initialize-from", "fixed") == 0
    assert list(load_checkpoint("new").task.initial) == ["robots", "fire"]


def test_a_file_of_settings_is_read_once_and_each_note_told_once(once, run, capsys):
    """Also with a network to begin with."""
    pytest.importorskip("yaml")
    Path("mine.yaml").write_text(
        "default_settings: {hyperparameters: {num_epoch: 2}}\nenv_settings: {seed: 7}"
    )
    begin = ("--settings", "mine.yaml", "--initialize-from", run)
    assert train("--out", "new", "--fire", "random", *begin) == 0
    assert capsys.readouterr().err.count("env_settings.seed is not read") == 1
    assert load_checkpoint("new").task.settings.robots.num_epoch == 2


@pytest.mark.paper("E3")
def test_settings_say_of_a_network_to_begin_with_only_what_is_asked(once, capsys):
    """The preset takes its head, its size and its masks."""
    Path("bare.yaml").write_text("reference: {Robot: {masks: false}}")
    begin = ("--out", "new", "--initialize-from", "learned")
    assert train(*begin, "--fire", "random", "--settings", "bare.yaml") == 1
    assert "the network to begin with has masks True" in capsys.readouterr().err
    assert train(*begin, "--fire", "random") == 0
    told = capsys.readouterr().err
    assert "robots poca (set head, begun from a network), fire random" in told
    task = load_checkpoint("new").task
    assert task.settings.robots.head == task.initial["robots"].settings.head == "set"
    assert task.settings.fire.head == tiny().fire.head
    assert resumed("new", "--preset", "tiny") == 0


def test_fire_can_be_trained_in_a_building_without_robots(once, capsys):
    """What a fire learns alone."""
    assert train("--out", "new", "--robots", "none") == 0
    assert load_checkpoint("new").task.settings.scenario.robots_per_floor == 0
    assert status("evacuate", "--robots", "none", "--fire", "new") == 0
    assert status("evacuate", "--robots", "sweep", "--fire", "new") == 1
    assert (
        "with robots_per_floor=0; here it is 2. Take the same"
        in capsys.readouterr().err
    )


def test_resume_of_a_training_that_is_over_tells_what_came_of_it(tmp_path, capsys):
    """It has nothing more to do, and changes nothing."""
    trained(begun(), tmp_path / "done")
    path = newest_checkpoint(Path("done"))
    before = path.read_bytes()
    rounds = load_checkpoint("done").round
    assert resumed("done") == 0
    out, told = capsys.readouterr()
    assert json.loads(out)["rounds"] == rounds
    assert "finished already, nothing is left to learn" in told
    assert "take --initialize-from done into another folder" in told
    assert newest_checkpoint(Path("done")) == path
    assert path.read_bytes() == before


@pytest.mark.parametrize(
    ("options", "told"),
    [
        (["--head", "floor", "--seed", "5"], "--head, --seed: a resumed run keeps"),
        (["--initialize-from", "learned"], "--initialize-from: a resumed run keeps"),
        (["--settings", "my.yaml"], "take --initialize-from "),
    ],
)
def test_refuses_to_resume_as_something_else(run, options, told, capsys):
    """Before anything is written; what it was begun with may be said again."""
    Path("my.yaml").write_text("reference: {random_fires: 0.9}")
    before = sorted(path.name for path in run.iterdir())
    options = [*options, "--preset", "tiny", "--building", "tiny", "--trainer", "poca"]
    assert status("train", "--resume", "--out", run, *options) == 2
    assert told in capsys.readouterr().err
    assert sorted(path.name for path in run.iterdir()) == before


def test_a_training_against_a_network_may_be_resumed_by_the_word_of_it(run, capsys):
    """What it was begun with may be said again; another fire is refused."""
    assert train("--fire", run, "--out", "against") == 0
    assert resumed("against", "--fire", run) == 0
    assert resumed("against", "--fire", "random") == 2
    assert "--fire: a resumed run keeps its options" in capsys.readouterr().err


def test_a_training_may_be_resumed_by_its_whole_command_line(once, run, capsys):
    """Files that it names mean the same as long as their content does."""
    Path("mine.yaml").write_text("reference: {Robot: {num_epoch: 2}}")
    begin = ("--preset", "tiny", "--building", "tiny", "--settings", "mine.yaml")
    begin += ("--initialize-from", run, "--fire", "random", "--out", "new")
    assert train(*begin) == 0
    assert resumed("new", *begin) == 0
    Path("mine.yaml").write_text("reference: {Robot: {num_epoch: 3}}")
    capsys.readouterr()
    assert resumed("new", *begin) == 2
    assert "--settings: a resumed run keeps its options" in capsys.readouterr().err


def test_refuses_to_resume_with_another_version(run, tmp_path, capsys):
    """In which the world may behave otherwise; as a strategy it still plays."""
    (tmp_path / "old").mkdir()
    old = replace(load_checkpoint(run), version="0.0.1")
    save_checkpoint(old, tmp_path / "old" / "checkpoint-000001.pt")
    assert status("train", "--resume", "--out", "old") == 1
    assert "was written by version 0.0.1" in capsys.readouterr().err
    assert status("evacuate", "--robots", "old") == 0


HUT = "building: Hut\nsize: 5 x 5\nfloor 1:\n#####\n#...#\n#...E\n#...#\n#####\n"


def test_a_training_that_cannot_be_leaves_no_workers(capsys):
    """They have begun to load what its jobs would need, if it is there."""
    assert [*map(find_spec, JOBS_NEED)].count(None) == 0
    options = ("--settings", "missing.yaml", "--workers", "2")
    assert status("train", *options) == 1
    assert "missing.yaml" in capsys.readouterr().err
    assert not active_children()


@pytest.mark.parametrize(
    ("options", "code", "hint"),
    [
        (["--out", "full"], 1, "is not empty. Name another folder, or add --resume"),
        (["--out", "notes.txt"], 1, "File exists"),
        (["--out", "notes.txt/new"], 1, "notes.txt/new: cannot be written"),
        (["--robots", "sweep", "--fire", "random"], 2, "--fire: nobody learns"),
        (["--imitate", "sweep", "--robots", "sweep"], 2, "--imitate: nobody"),
        (["--initialize-from", "notes.txt"], 1, "notes.txt: is damaged"),
        (["--settings", "alone.yaml"], 1, "robots_per_floor is 0"),
        (["--fire", "notes.txt"], 1, "notes.txt: is damaged"),
        (["--building", "nowhere"], 1, "nowhere"),
        (["--building", "randon"], 1, "Did you mean 'random'?"),
        (["--building", "tiny", "randon"], 1, "Did you mean 'random'?"),
        (["--building", "hut.txt"], 1, "Hut: nothing can burn there"),
        (["--scenario", "time_limit=1"], 1, "fire: nothing to decide in a whole round"),
        (["--resume", "--out", "no/such/run"], 1, "no/such/run: "),
    ],
)
def test_refuses_a_training_that_cannot_be(options, code, hint, capsys, tmp_path):
    """One message with a hint, the right exit status, and nothing is written."""
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "mine.txt").touch()
    (tmp_path / "notes.txt").write_text("my notes")
    empty = {"reference": {"scenario": {"robots_per_floor": 0}}}
    Path("alone.yaml").write_text(json.dumps(empty))
    Path("hut.txt").write_text(HUT)
    assert train(*options) == code
    out, err = capsys.readouterr()
    assert out == ""
    assert hint in err
    left = sorted(path.name for path in tmp_path.rglob("*"))
    assert left == ["alone.yaml", "full", "hut.txt", "mine.txt", "notes.txt"]


@pytest.mark.parametrize("last", [0, 1])
def test_a_full_disk_ends_the_training_with_one_message(
    last, once, capsys, monkeypatch
):
    """The checkpoint before stays, and can be gone on from; without one, nothing."""
    kept = save_checkpoint

    def full(checkpoint, path):
        if checkpoint.round == last:
            raise OSError(f"{path}: cannot be written (No space left on device)")
        kept(checkpoint, path)

    monkeypatch.setattr("reference.workshop.training.checkpoints.save_checkpoint", full)
    assert train("--out", "new") == 1
    told = capsys.readouterr().err.partition("No space left on device")[2]
    how = "Go on with:\n  python -m reference train --workers 0 --resume --out new\n"
    assert told == (f") {how}" if last else ")\n")
    assert load_checkpoint("new").round == 0 if last else not os.path.exists("new")


def test_a_worker_that_dies_ends_the_training_with_one_message(
    once, capsys, monkeypatch
):
    """Such as by the kernel, for want of memory; what is saved can be gone on from."""

    def killed(*given):
        raise BrokenProcessPool("a process was terminated abruptly")

    monkeypatch.setattr(loop, "map_in_shares", killed)
    assert train("--out", "new") == 1
    assert "a worker has died" in capsys.readouterr().err
    assert load_checkpoint("new").round == 0


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGHUP])
def test_stopped_it_saves_and_says_how_to_go_on(number, tmp_path):
    """All of its processes are told: exit status 130, and nothing half-written."""
    words = ["--preset", "tiny", "--workers", "1", "--out", "long"]
    command = "-m", "reference", "train", *words
    process = python(*command, stderr=PIPE, start_new_session=True)
    while not (tmp_path / "long" / "checkpoint-000000.pt").exists():
        assert process.poll() is None
        time.sleep(0.05)
    os.killpg(process.pid, number)
    _, err = ended(process)
    assert process.returncode == 130
    assert "Traceback" not in err
    how = re.escape("Go on with:\n  python -m reference train")
    assert re.search(how + "( --workers 1)? --resume --out long\n$", err)
    assert not list((tmp_path / "long").glob(".*-part*"))
    assert load_checkpoint("long").task.settings.preset == "tiny"


# -- Checkpoints as strategies ------------------------------------------------------


def test_evacuate_takes_the_mean_action_unless_asked_for_sampling(run, capsys):
    """Either is the same again with the same seed; the building is the checkpoint's."""
    players = ["--robots", run, "--fire", run / "checkpoint-000001.pt"]
    rewards = []
    for more in ([], [], ["--sample"], ["--sample"]):
        assert status("evacuate", *players, "--episodes", "2", "--json", *more) == 0
        facts = json.loads(capsys.readouterr().out)
        rewards.append([one["reward"] for one in facts["runs"]])
    likeliest, once_more, sampled, sampled_again = rewards
    assert likeliest == once_more
    assert sampled == sampled_again
    assert likeliest != sampled
    assert (facts["building"], facts["people"]) == ("tiny", 6)
