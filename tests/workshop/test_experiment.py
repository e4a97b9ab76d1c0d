"""Experiments: one file of arms, seeds and tests, done as jobs by anybody."""

import json
import os
import re
import signal
import time
from argparse import Namespace
from concurrent.futures import ThreadPoolExecutor
from contextlib import nullcontext, redirect_stdout
from dataclasses import replace
from io import StringIO
from pathlib import Path
from shutil import copytree, rmtree
from subprocess import DEVNULL

import pytest
from conftest import ROOT
from outcomes import result
from processes import python
from refusals import refusal

import reference
from reference import paper
from reference.__main__ import main
from reference.paper import InputError, Scenario
from reference.workshop.commands import common
from reference.workshop.comparing import jobs, report
from reference.workshop.comparing.design import Experiment, arm_of, read_experiment
from reference.workshop.comparing.jobs import (
    finish_trainings,
    play_tests,
    train_in,
    training_folders,
)
from reference.workshop.comparing.report import OWN_FIRE, Results, about_tests
from reference.workshop.storage import workers as workforce
from reference.workshop.storage.records import SettingsError, record_from
from reference.workshop.storage.runs import locked
from reference.workshop.storage.workers import InProcess, cluster
from reference.workshop.strategies import ANY_MAP
from reference.workshop.training.checkpoints import (
    load_checkpoint,
    newest_checkpoint,
    save_checkpoint,
)
from reference.workshop.training.rounds import Training

FILES = ROOT / "tutorials" / "experiments"
TINY = ["experiment", str(FILES / "tiny.toml"), "--workers", "0", "--out"]
SMALL = {
    "arms": {"learning": {}, "ppo": {"robots": {"trainer_type": "ppo"}}},
    "decisions": 20,
    "preset": "tiny",
    "building": "tiny",
    "seeds": [3],
    "settings": {
        "episodes_per_job": 1,
        "jobs_per_round": 1,
        "scenario": {"time_limit": 20.0},
        "robots": {"hidden_units": 8, "num_epoch": 1},
        "fire": {"hidden_units": 8, "num_epoch": 1},
    },
    "test": {"fires": ["random", "learning"], "robots": ["sweep"], "episodes": 2},
}


def small(**changes) -> Experiment:
    """Two arms, one training each, and twelve evacuations."""
    return record_from(Experiment, SMALL | changes, "small")


def performed(experiment, folder, executor=None):
    """Do what is missing; return the results of all tests."""
    executor = executor or InProcess()
    assert finish_trainings(experiment, folder, executor) == {}
    return play_tests(experiment, folder, executor)


def tables(folder: Path) -> dict[str, bytes]:
    """Everything that says how an experiment came out."""
    found = [*folder.glob("tests-*/*.csv"), *folder.glob("*/*/summaries.csv")]
    return {str(path.relative_to(folder)): path.read_bytes() for path in found}


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """The small experiment, done in this process."""
    folder = tmp_path_factory.mktemp("whole")
    performed(small(), folder)
    return folder


# -- Jobs ---------------------------------------------------------------------------


def test_an_experiment_goes_on_with_the_numbers_it_began_with(whole, monkeypatch):
    """What is made with others is refused, and what is half made fails."""
    experiment = small()
    kept = training_folders(experiment, whole)["learning-3"] / "training.json"
    assert json.loads(kept.read_text())["numbers"]["ROBOT_SPEED"] == 1.5
    monkeypatch.setattr(paper, "ROBOT_SPEED", 0.5)
    told = r"training\.json: was begun with ROBOT_SPEED=1.5 \(here 0.5\)"
    with pytest.raises(InputError, match=told):
        finish_trainings(experiment, whole, InProcess())
    with pytest.raises(InputError, match=r"evaluation\.json: was begun with ROBOT"):
        play_tests(experiment, whole, InProcess())
    job = experiment.trainings["learning-3"], str(kept.parent)
    assert train_in(job).startswith(f"{kept.parent}: was begun with ROBOT_SPEED=1.5")


def test_an_arm_may_learn_under_another_scenario_than_the_tests():
    """By the same keys as everywhere; what its policy reads stays the same."""
    experiment = small(arms={"learning": {"scenario": {"sight_range": 8}}})
    assert experiment.trainings["learning-3"].settings.scenario.sight_range == 8
    assert experiment.arena.scenario.sight_range == Scenario().sight_range


def test_settings_of_all_arms_may_be_for_some_of_them():
    """Fires that stand in for one that learns serve the arms in which one learns."""
    arms = {"learning": {}, "random_fire": {"fire": "random"}}
    experiment = small(arms=arms, settings={"random_fires": 0.25})
    assert experiment.arm("learning")[0].random_fires == 0.25
    assert experiment.arm("random_fire")[1] == ("random",)


def test_trainings_of_one_seed_come_before_those_of_the_next():
    """So what an interrupted experiment has made compares all arms."""
    names = [*small(seeds=[3, 4]).trainings]
    assert names == ["learning-3", "ppo-3", "learning-4", "ppo-4"]


def test_robots_that_ship_are_tested_beside_those_that_learned(whole, tmp_path):
    """By their word, as a fire that ships is."""
    copytree(whole, tmp_path, dirs_exist_ok=True)
    asked = small(test=SMALL["test"] | {"robots": ["learned"]})
    robots = {result.robots for result in play_tests(asked, tmp_path, InProcess())}
    assert "learned" in robots and len(robots) == 3


def test_what_is_made_is_not_made_again(whole):
    """No job is submitted."""
    before = tables(whole)
    assert len(performed(small(), whole, executor=object())) == 12
    assert tables(whole) == before and len(before) == 3


def test_what_has_changed_is_made_anew_and_the_rest_stays(whole, tmp_path):
    """One arm's gamma, and one more seed: three trainings, beside those there are."""
    copytree(whole, tmp_path, dirs_exist_ok=True)
    arms = SMALL["arms"] | {"learning": {"robots": {"gamma": 0.5}}}
    assert finish_trainings(small(arms=arms, seeds=[3, 4]), tmp_path, InProcess()) == {}
    names = [path.name[:-9] for path in (tmp_path / "trainings").iterdir()]
    assert sorted(names) == ["learning-3", "learning-3", "learning-4", "ppo-3", "ppo-4"]


@pytest.mark.parametrize("ships", ["SHIPPED", "ANYWHERE"])
def test_a_network_that_ships_anew_makes_trainings_against_it_anew(
    ships, monkeypatch, tmp_path
):
    """The fire `learned` of an arm is one of two: for the paper's building, or any."""
    asked = small(arms=SMALL["arms"] | {"met": {"fire": "learned"}})
    before = training_folders(asked, tmp_path)
    other = tmp_path / "other.pt"
    other.write_bytes(b"another network")
    monkeypatch.setattr(jobs, ships, other)
    after = training_folders(asked, tmp_path)
    assert [name for name in before if before[name] != after[name]] == ["met-3"]


def test_a_training_that_fails_is_named_and_the_others_go_on(tmp_path, monkeypatch):
    """Who did learn is tested; where it broke stands in its log."""

    def broken(training, *rest):
        if training.settings.robots.trainer_type == "ppo":
            raise KeyError("no more")
        return train(training, *rest)

    train = jobs.run_training
    monkeypatch.setattr(jobs, "run_training", broken)
    failed = finish_trainings(small(), tmp_path, InProcess())
    log = training_folders(small(), tmp_path)["ppo-3"] / "log.txt"
    assert failed == {"ppo-3": f"KeyError: 'no more'; see {log}"}
    assert "in broken" in log.read_text()
    results = play_tests(small(), tmp_path, InProcess())
    assert {arm_of(r.robots) for r in results} == {"learning", "sweep"}


def test_a_worker_that_trains_elsewhere_is_told(tmp_path, monkeypatch):
    """On a machine that does not share the folder."""
    monkeypatch.setattr(jobs, "train_in", lambda job: "")
    (why, _) = finish_trainings(small(), tmp_path, InProcess()).values()
    assert "learning-3" in why and "Name one that all share" in why


def test_damage_is_told_and_what_is_removed_is_made_anew(whole, tmp_path):
    """A checkpoint, and its training, to the same end."""
    copytree(whole, tmp_path, dirs_exist_ok=True)
    folder = training_folders(small(), tmp_path)["learning-3"]
    rmtree(next(tmp_path.glob("tests-*")))
    first, path = sorted(folder.glob("*.pt"))  # the fire keeps the first
    path.write_bytes(path.read_bytes()[:5000])
    with pytest.raises(InputError, match=rf"{path}: is damaged"):
        play_tests(small(), tmp_path, InProcess())
    first.unlink()
    path.unlink()
    performed(small(), tmp_path)
    assert {*tables(whole).values()} == {*tables(tmp_path).values()}


def test_refuses_tests_of_two_networks_under_the_name_of_one_training(whole, tmp_path):
    """Somebody has put another checkpoint in its folder; the table would mix both."""
    copytree(whole, tmp_path, dirs_exist_ok=True)
    folder = training_folders(small(), tmp_path)["learning-3"]
    path = newest_checkpoint(folder)
    save_checkpoint(replace(load_checkpoint(path), round=9), path)
    (table,) = tmp_path.glob("tests-*/evaluation.json")
    with pytest.raises(InputError, match=rf"{table}: {path} has changed since"):
        play_tests(small(), tmp_path, InProcess())


@pytest.mark.paper("E6")
def test_a_training_ends_when_its_robots_have_had_their_decisions(whole):
    """They have their 20 long before the fire."""
    for folder in training_folders(small(), whole).values():
        learners = Training.resumed(load_checkpoint(folder)).learners
        assert learners["fire"].steps < 20 <= learners["robots"].steps


# -- A cluster ----------------------------------------------------------------------


@pytest.fixture
def machines():
    """Two workers of a Dask cluster."""
    distributed = pytest.importorskip("distributed")
    local = {"n_workers": 2, "threads_per_worker": 1, "dashboard_address": None}
    with distributed.LocalCluster(**local) as machines:
        yield machines


dask = pytest.mark.filterwarnings("default:::(distributed|dask|tornado)")


@dask
@pytest.mark.slow
def test_a_worker_of_a_cluster_may_be_killed_in_the_middle_of_a_training(
    whole, tmp_path, machines
):
    """Another one goes on with its job, to the same end."""
    with cluster(machines.scheduler_address) as executor, ThreadPoolExecutor(1) as here:
        ends = here.submit(finish_trainings, small(), tmp_path, executor)
        while not list(tmp_path.glob("trainings/*/log.txt")) and not ends.done():
            time.sleep(0.02)
        os.kill(machines.workers[0].pid, signal.SIGKILL)
        assert ends.result(120) == {}
        play_tests(small(), tmp_path, executor)
    assert tables(tmp_path) == tables(whole)


@dask
@pytest.mark.slow
def test_refuses_workers_of_another_version(machines, monkeypatch):
    """Their numbers may differ."""
    monkeypatch.setattr(reference, "__version__", "0.0.1")
    with (
        pytest.raises(InputError, match=r"workers have version .*; here it is 0\.0\.1"),
        cluster(machines.scheduler_address),
    ):
        pytest.fail("they were taken")


@dask
@pytest.mark.slow
def test_a_cluster_is_waited_for_and_told_when_it_ends(machines, capsys):
    """Until a worker comes; then in one message, with how to go on."""
    machines.scale(0)
    while machines.scheduler.workers:
        time.sleep(0.05)
    with (
        ThreadPoolExecutor(1) as later,
        pytest.raises(InputError, match=r"scheduler is gone.* go on with --resume"),
    ):
        later.submit(lambda: (time.sleep(1), machines.scale(1)))
        with cluster(machines.scheduler_address) as executor:
            waits = executor.submit(time.sleep, 600)
            machines.close()
            waits.result(60)
    assert "waiting for a worker; start one" in capsys.readouterr().err


@dask
def test_refuses_a_worker_with_several_threads():
    """Dask's default: two trainings in one process would share their log."""
    distributed = pytest.importorskip("distributed")
    local = {"n_workers": 1, "threads_per_worker": 2, "processes": False}
    with (
        distributed.LocalCluster(**local, dashboard_address=None) as machines,
        pytest.raises(InputError, match="start its workers with --nthreads 1"),
        cluster(machines.scheduler_address),
    ):
        pytest.fail("it was taken")


def test_refuses_a_cluster_that_does_not_answer(monkeypatch):
    """Or Dask that is not there; in one message."""
    monkeypatch.setattr(workforce, "ANSWER_SECONDS", 0.2)
    with (
        pytest.raises(InputError, match="no Dask scheduler answers"),
        cluster("tcp://127.0.0.1:9"),
    ):
        pytest.fail("it answered")


def test_two_processes_never_write_one_training(tmp_path):
    """A worker of a cluster may be at it still when its command has been stopped."""
    experiment = small()
    (team, folder), *_ = training_folders(experiment, tmp_path).items()
    with locked(folder, True, list):
        why = jobs.train_in((experiment.trainings[team], str(folder)))
    assert f"{folder}: another run is at work in it" in why


def test_stopped_on_a_cluster_it_says_who_goes_on_and_how(monkeypatch, tmp_path):
    """With the cluster's address, so that the line can be typed as it is."""
    monkeypatch.setattr(common, "cluster", lambda address: nullcontext(InProcess()))
    (tmp_path / "experiment.json").touch()
    with (
        pytest.raises(
            KeyboardInterrupt, match=r"Workers finish .*\n.* --cluster tcp:x"
        ),
        common.run_in_folder(Namespace(cluster="tcp:x", resume=True), tmp_path, list),
    ):
        signal.raise_signal(signal.SIGINT)


# -- The command --------------------------------------------------------------------


def test_a_cluster_brings_its_own_workers(capsys, tmp_path):
    """A number of them would be asked for in vain, so it is refused."""
    assert main([*TINY, str(tmp_path / "out"), "--cluster", "tcp://127.0.0.1:9"]) == 1
    assert "leave --workers out" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """The tiny experiment, made by the command: its folder, and what is printed."""
    folder = tmp_path_factory.mktemp("made") / "new"
    printed = StringIO()
    with redirect_stdout(printed):
        assert main([*TINY, str(folder), "--json"]) == 0
    return folder, json.loads(printed.getvalue())


@pytest.mark.slow
@pytest.mark.paper("E6")
@pytest.mark.paper("F12")
def test_the_tiny_experiment_makes_every_part(made):
    """Page and picture; the matrix with its own and others' fires."""
    folder, told = made
    fires = {c["fire"] for c in told["cells"] if c["robots"] == "learning"}
    assert fires == {"random", OWN_FIRE, "learning's fires"}
    rows = {cell["robots"] for cell in told["cells"]}
    assert rows == {"random_fire", "learning", "none", "sweep"}
    text = (folder / "page.md").read_text()
    assert told["answer"] in text and "](matrix.png)" in text
    for picture in ("matrix.png", "curves.png"):
        assert (folder / picture).stat().st_size > 5_000
    assert main([*TINY, str(folder)]) == 1  # it is there
    assert main([*TINY, str(folder), "--resume"]) == 0


@pytest.mark.slow
def test_an_experiment_that_is_killed_goes_on_to_the_same_end(made, tmp_path):
    """Nothing half-written is in the way, and nothing that was done is lost."""
    killed = tmp_path / "killed"
    process = python("-m", "reference", *TINY, str(killed))
    while not list(killed.glob("trainings/*/training.json")):
        time.sleep(0.02)
    process.kill()
    process.wait()
    done = {path: path.stat().st_mtime for path in killed.glob("*/*/training.json")}
    assert main([*TINY, str(killed), "--resume"]) == 0
    assert tables(killed) == tables(made[0])
    assert all(path.stat().st_mtime == when for path, when in done.items())


@pytest.mark.slow
def test_an_experiment_that_is_stopped_leaves_no_lock(tmp_path):
    """Its workers are ended in the middle of their trainings."""
    words = ["-m", "reference", *TINY, str(tmp_path / "out"), "--workers", "2"]
    process = python(*words, stderr=DEVNULL)
    while len([*tmp_path.glob("out/trainings/*/checkpoint*.pt")]) < 2:
        time.sleep(0.02)
    assert [*tmp_path.rglob(".lock")]
    process.terminate()
    assert process.wait() == 130
    assert not [*tmp_path.rglob(".lock")]


# -- Results ------------------------------------------------------------------------

COMPARED = {"seeds": [0, 1, 2], "compare": [["learning", "ppo"]]}


def outcome(**survivors):
    """Tests in which so many of ten survive random fire, and six survive others."""
    return Results(
        small(**COMPARED),
        [
            result(f"{arm}-{k}", fire, seed, range(out + k % 2), people=10)
            for arm, random in survivors.items()
            for k in range(3)
            for seed in range(20)
            for fire, out in (("random", random), ("learning-1", 6))
        ],
    )


def test_an_arm_has_a_row_and_a_kind_of_fire_a_column():
    """Its own fire stands beside those of other trainings; intervals are over arms."""
    results = outcome(learning=8, ppo=5)
    cells = {(cell.robots, cell.fire): cell for cell in results.cells()}
    assert [fire for robots, fire in cells if robots == "learning"] == [
        "random",
        "learning's fires",
        OWN_FIRE,
    ]
    assert cells["learning", OWN_FIRE].n == 20
    assert cells["learning", "learning's fires"].n == 40
    random = cells["learning", "random"].survival
    assert random == pytest.approx((2.5 / 3, 0.8, 0.9))
    assert results.values("ppo", "random", "survival").shape == (3, 20)


@pytest.mark.parametrize(
    ("ppo", "words"),
    [
        (5, "under random: 30.0 [23.3, 36.7]: `learning` saves more"),
        (9, "under random: -10.0 [-16.7, -3.3]: `ppo` saves more"),
        (8, "they cannot be told apart"),
        (8, "This is preliminary, trainings of an arm: 3."),
    ],
)
def test_the_answer_is_what_the_intervals_say(ppo, words):
    """Above 0, below 0 or around it; preliminary with fewer than five trainings."""
    results = outcome(learning=8, ppo=ppo)
    assert words in results.answer()
    assert results.answer() in report.report_page(results, "a.png", "b.png")


def test_arms_are_not_compared_under_their_own_fires():
    """There each meets another: that would compare fires."""
    assert "learning" in outcome(learning=8, ppo=5).answer()
    assert OWN_FIRE not in outcome(learning=8, ppo=5).answer()


def test_one_fire_that_learned_tells_nothing_of_others():
    """However many robots, written by hand, meet it."""
    asked = {**COMPARED, "seeds": [0], "compare": [["sweep", "none"]]}
    asked["test"] = {"robots": ["sweep", "none"]}
    runs = [
        result(robots, "learning-0", seed, range(out), people=10)
        for robots, out in (("sweep", 9), ("none", 2))
        for seed in range(20)
    ]
    told = Results(small(**asked), runs).answer()
    assert "70.0 [70.0, 70.0]: one training tells nothing of others" in told


def test_one_training_tells_nothing_of_others():
    """However far apart they are; the interval is over evacuations alone."""
    alone = small(**COMPARED | {"seeds": [0]})
    runs = [
        result(f"{arm}-0", "random", seed, range(out), people=10)
        for arm, out in (("learning", 9), ("ppo", 2))
        for seed in range(20)
    ]
    told = Results(alone, runs).answer()
    assert "under random: 70.0 [70.0, 70.0]: one training tells nothing of" in told
    assert "saves more" not in told


def test_trainings_are_counted_that_came_to_an_end():
    """However many seeds are asked for; robots written by hand are no trainings."""
    pairs = [["learning", "ppo"], ["learning", "sweep"], ["sweep", "none"]]
    asked = {**COMPARED, "compare": pairs, "test": {"robots": ["sweep", "none"]}}
    out = {"learning-0": 9, "learning-1": 9, "ppo-0": 2, "sweep": 3, "none": 1}
    played = [
        result(robots, "random", seed, range(count), people=10)
        for robots, count in out.items()
        for seed in range(20)
    ]
    pair, guided, by_hand, caution = (
        Results(small(**asked), played).answer().splitlines()[2:]
    )
    assert pair.endswith("one training tells nothing of others.")
    assert guided.endswith("`learning` saves more.")
    assert by_hand.endswith("`sweep` saves more.")
    assert "preliminary, trainings of an arm: 1." in caution


def test_the_page_says_what_was_asked_and_done():
    """Every row of the file, and the version, under the question."""
    asked = small(question="Is it *so*?")
    told = report.report_page(Results(asked, [result("ppo-3")]), "a", "b")
    assert f"version {reference.__version__}" in told
    assert '"trainer_type": "ppo"' in told and '"hidden_units": 8' in told
    assert told.startswith("# Is it *so*?\n\n")
    assert re.search(r"^    question = ", told, re.MULTILINE)


# -- Files --------------------------------------------------------------------------


@pytest.mark.parametrize("file", sorted(FILES.glob("*.toml")), ids=lambda f: f.name)
def test_the_files_that_ship_can_be_read(file):
    """And every arm has the same budget."""
    experiment = read_experiment(file)
    for name in experiment.arms:
        settings, _ = experiment.arm(name)
        both = settings.robots.max_steps, settings.fire.max_steps
        assert both == (experiment.decisions, experiment.decisions)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"armz": {}}, "Did you mean 'arms'"),
        ({"arms": {}}, "at least one arm"),
        ({"arms": {"a": {"fire": "bussiest"}}}, "Did you mean 'busiest'"),
        ({"arms": {"learning": {"fire": []}}}, "arms: learning: fire names nobody"),
        ({"arms": {"a": {"robots": {"gama": 1}}}}, "Did you mean 'gamma'"),
        (
            {"arms": {"learning": {"scenario": {"sihgt_range": 8}}}},
            "arms: learning: scenario: 'sihgt_range' is unknown. Did you mean 'sight_r",
        ),
        (
            {"arms": {"learning": {"scenario": {"people": 7}}}},
            "arms: learning: its robots learned with people=7; here it is 6. Take the",
        ),
        ({"arms": {"a": {"preset": "paper"}}}, "preset stands at the top"),
        ({"arms": {"a": {"robots": {"max_steps": 9}}}}, "follows from `decisions`"),
        ({"arms": {"a": {"fire": "random", "random_fires": 0.5}}}, "needs a fire that"),
        ({"arms": {"a" * 300: {}}}, "'a{60}' can be no arm's name: take up to 40"),
        ({"settings": {"random_fires": 1.0}}, "never plays where random_fires is 1"),
        ({"arms": {"a": {"imitation_rounds": 5}}}, "leave out imitation_rounds"),
        (
            {"settings": {"scenario": {"sources": 10**12}}},
            "sources is 10+: it must be a whole number from 0 to 10,000 fires",
        ),
        ({"decisions": 0}, "decisions is 0: it must be a whole number from 1 upwards"),
        ({"seeds": [-1]}, "upwards"),
        ({"seeds": [0, 1, 0]}, "seeds: name each once"),
        ({"test": {"robots": ["sweep", "sweep"]}}, "robots: name each once"),
        ({"test": {"fires": []}}, "fires: name at least one"),
        ({"test": {"seed": -1}}, "seed is -1: it must be a whole number from 0 upw"),
        (
            {"settings": {"scenario": {"time_limit": float("nan")}}},
            "must be a number fr",
        ),
        ({"test": {"episodes": 10**12}}, "seed 5000 on: ask for 1 to 1,000,000"),
        ({"compare": [["learning"]]}, "compare: name two"),
        ({"settings": {"scenario": {"people": 5000}}}, "fewer: the scenario's"),
    ],
)
def test_refuses_what_no_experiment_can_be_made_of(changes, message):
    """With what is wrong, and what may have been meant."""
    with pytest.raises(SettingsError, match=message):
        small(**changes)


def test_counts_only_the_fires_that_are_met():
    """Of 1,000 trainings against scripted fires none plays the fire."""
    asked = small(
        arms={"learning": {"fire": "random"}},
        seeds=list(range(1000)),
        test={"fires": ["random"], "episodes": 100},
    )
    assert len(asked.trainings) == 1000


def test_a_fire_may_have_summaries_of_its_own():
    """They do not follow from the decisions of the robots."""
    rows = SMALL["settings"]["fire"] | {"summary_freq": 7}
    asked = small(settings=SMALL["settings"] | {"fire": rows})
    assert asked.base.fire.summary_freq == 7


@pytest.mark.parametrize("side", ["robots", "fires"])
def test_an_experiment_says_that_the_network_for_any_map_plays(side):
    """On either side."""
    assert ANY_MAP not in about_tests(small())
    asked = small(test=SMALL["test"] | {side: ["learned"]})
    assert about_tests(asked).endswith(f"; {ANY_MAP}")


@pytest.mark.parametrize("there", [None, [], [".lock"], ["summaries.csv"]])
def test_does_not_go_on_where_no_experiment_has_begun(there, tmp_path, capsys):
    """Such as a mistyped folder, or a training's: nothing is written there."""
    folder = tmp_path / "out"
    if there is not None:
        folder.mkdir()
        for name in there:
            (folder / name).touch()
    status, message = refusal(capsys, *TINY, str(folder), "--resume")
    told = f"{folder}: there is no experiment to go on with. Leave --resume out to beg"
    assert (status, message.startswith(told)) == (1, True)
    assert folder.exists() == (there is not None)
    assert [path.name for path in tmp_path.glob("out/*")] in ([], ["summaries.csv"])


def test_an_experiment_stopped_before_its_first_training_goes_on(tmp_path, monkeypatch):
    """Its folder shows that it has begun."""

    def stop():
        raise KeyboardInterrupt

    with monkeypatch.context() as patched, pytest.raises(KeyboardInterrupt):
        patched.setattr(jobs, "make_ready", stop)
        finish_trainings(small(), tmp_path, InProcess())
    jobs.refuse_not_begun(tmp_path)
