"""Experiments: one file of arms, seeds and budgets, done as jobs by anybody."""

import json
import re
import signal
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from io import BytesIO
from pathlib import Path
from shutil import copytree, rmtree
from statistics import mean
from threading import Event

import numpy as np
import pytest
from clauses import ROOT
from trainings import equal, trained

import reference
from reference.__main__ import main
from reference.learning.networks import one_thread
from reference.learning.settings import SettingsError
from reference.paper import InputError
from reference.workshop import workers as workforce
from reference.workshop.crossplay.runs import RunResult, table_of
from reference.workshop.drawing.experiment import last_gain
from reference.workshop.drawing.runs import Run
from reference.workshop.experiment import asked as asked_module
from reference.workshop.experiment import page, steps
from reference.workshop.experiment import results as results_module
from reference.workshop.experiment.asked import BEST, Experiment, read
from reference.workshop.experiment.begun import begin, refuse_changed
from reference.workshop.experiment.results import OWN, Results, telling
from reference.workshop.experiment.steps import Plan, perform
from reference.workshop.files import make_folder
from reference.workshop.plain import record_from
from reference.workshop.runs import RunError
from reference.workshop.strategies import SHIPPED
from reference.workshop.training.checkpoints import load, unpacked
from reference.workshop.training.session import Training
from reference.workshop.training.summaries import SURVIVAL
from reference.workshop.workers import InProcess, cluster, workers

FILES = ROOT / "tutorials" / "experiments"
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
    "test": {"fires": ["random"], "robots": ["sweep"], "episodes": 2},
}


def small(**changes) -> Experiment:
    """Two arms, one training each, and six evacuations."""
    return record_from(Experiment, SMALL | changes, "small")


def performed(experiment, folder, executor=None, width=1, stop=lambda: False, **plan):
    """Do what is missing; what failed."""
    plan = Plan(experiment, folder, **{"here": True, **plan})
    return perform(list(plan.steps()), executor or InProcess(), lambda: width, stop)


def tables(folder: Path) -> dict[str, bytes]:
    """Everything that says how an experiment came out."""
    found = [*folder.glob("tests/*"), *folder.glob("*/*/summaries.csv")]
    return {str(path.relative_to(folder)): path.read_bytes() for path in found}


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """The small experiment, done in this process."""
    folder = tmp_path_factory.mktemp("whole")
    assert performed(small(), folder) == {}
    return folder


# -- Jobs ---------------------------------------------------------------------------


def test_what_is_done_is_not_done_again(whole):
    """No job is submitted."""
    before = tables(whole)
    assert performed(small(), whole, executor=object()) == {}
    assert tables(whole) == before
    assert len(before) == 5


def test_a_worker_without_our_disk_gives_the_same(whole, tmp_path):
    """What comes back through the future is enough."""
    with ThreadPoolExecutor(1) as executor:
        assert performed(small(), tmp_path, executor, here=False) == {}
    assert tables(tmp_path) == tables(whole)


def test_whoever_stopped_goes_on_where_it_was(whole, tmp_path):
    """Only jobs under way are lost; the end is the same."""
    looks = iter(range(100))
    performed(small(), tmp_path, stop=lambda: next(looks) > 1)
    begun = tables(tmp_path)
    assert 0 < len(begun) < 5
    performed(small(), tmp_path)
    assert tables(tmp_path) == tables(whole)


def test_after_a_job_that_ctrl_c_interrupted_none_begins(tmp_path, monkeypatch):
    """In this process, where the signal comes in the middle of one."""
    begun, pressed = [], Event()

    def interrupted(job):
        begun.append(job)
        pressed.set()
        raise KeyboardInterrupt

    monkeypatch.setattr(steps, "fit", interrupted)
    assert performed(small(), tmp_path, stop=pressed.is_set) == {}
    assert len(begun) == 1


def test_a_training_under_way_goes_on_from_its_checkpoint(whole, tmp_path):
    """Here at least, where its folder is the worker's."""
    plan = Plan(small(), tmp_path, here=True)
    job = next(plan.steps()).job()
    folder = Path(job.folder)
    make_folder(folder)
    (folder / "checkpoint-000000.pt").write_bytes(job.beginning)
    with one_thread():
        trained(Training.resumed(load(folder)), folder, rounds=1)
    assert load(folder).round == 1
    steps.fit(job)
    name = "trainings/learning-3/summaries.csv"
    assert tables(tmp_path)[name] == tables(whole)[name]


def test_a_job_that_fails_is_named_and_the_others_go_on(tmp_path, monkeypatch):
    """What needs it is left out."""

    def broken(job):
        if "ppo" in job.folder:
            raise RuntimeError("no more")
        return fit(job)

    fit = steps.fit
    monkeypatch.setattr(steps, "fit", broken)
    failed = performed(small(), tmp_path)
    assert failed == {"trainings/ppo-3": "RuntimeError: no more"}
    assert sorted(path.stem for path in tmp_path.glob("tests/*")) == [
        "learning-3 random",
        "sweep random",
    ]


def test_damage_is_told_with_what_to_remove(whole, tmp_path):
    """A checkpoint or a table; the rest goes on, and what is removed is made anew."""
    copytree(whole, tmp_path, dirs_exist_ok=True)
    folder = tmp_path / "trainings" / "learning-3"
    (path,) = folder.glob("*.pt")
    path.write_bytes(path.read_bytes()[:5000])
    (tmp_path / "tests" / "learning-3 random.csv").unlink()
    ((name, why),) = performed(small(), tmp_path).items()
    assert name == "tests/learning-3 random"
    assert f"{folder}: its checkpoint is gone or damaged. Remove this folder" in why
    rmtree(folder)
    assert performed(small(), tmp_path) == {}
    assert tables(tmp_path) == tables(whole)
    table = tmp_path / "tests" / "ppo-3 random.csv"
    table.write_text(table.read_text().replace("ppo-3", "ppo-4"))
    with pytest.raises(RunError, match=r"ppo-3 random\.csv: is damaged\. Remove it"):
        Plan(small(), tmp_path, here=True).records()
    table.write_text("\0")
    with pytest.raises(RunError, match=r"ppo-3 random\.csv: is damaged\. Remove it"):
        Plan(small(), tmp_path, here=True).records()


@pytest.mark.paper("E6")
def test_best_responses_may_begin_with_a_fire_that_learned(
    whole, tmp_path, monkeypatch
):
    """And arms with copies of robots written by hand; neither may change later."""
    fire = whole / "trainings" / "learning-3"
    own = load(fire).player("fire")
    another = replace(own, weights={n: w + 1 for n, w in own.weights.items()})
    asked = small(
        arms={"copies": {"imitate": "sweep", "fire": "random"}},
        decisions=70,
        settings={**SMALL["settings"], "imitation_episodes": 2, "imitation_epochs": 1},
        best_response={"decisions": 12, "seeds": 1, "initialize_from": str(fire)},
    )
    assert performed(asked, tmp_path) == {}
    copies = load(tmp_path / "trainings" / "copies-3").task
    assert (copies.imitate, copies.fixed) == ("sweep", {"fire": "random"})
    for team in ("copies-3", "sweep"):
        begun = load(tmp_path / "responses" / f"{team}-0").task.initial["fire"]
        assert equal(begun.weights, own.weights)
        assert (tmp_path / "tests" / f"{team} {BEST}.csv").exists()
    assert not (tmp_path / "choices").exists()  # there is but one
    begin(asked, tmp_path)
    refuse_changed(asked, tmp_path)
    refuse_changed(replace(asked, best_response=None), tmp_path)
    for changed in (
        replace(asked, arms={"copies": {"fire": "random"}}),
        replace(
            asked, best_response=replace(asked.best_response, initialize_from=None)
        ),
    ):
        with pytest.raises(RunError, match=r"nothing was asked for, but .* has"):
            refuse_changed(changed, tmp_path)
    monkeypatch.setattr(asked_module, "initial_of", lambda *_: {"fire": another})
    with pytest.raises(RunError, match=r"^best_response\.network: "):
        refuse_changed(replace(asked, seeds=(3, 4)), tmp_path)


@pytest.mark.paper("E6")
def test_a_side_of_an_arm_may_begin_with_a_network(whole, tmp_path, monkeypatch):
    """Which may not change later."""
    fire = whole / "trainings" / "learning-3"
    own = load(fire).player("fire")
    another = replace(own, weights={n: w + 1 for n, w in own.weights.items()})
    words = {"fire": {"initialize_from": str(fire)}}
    two = {"fires": ["random"], "episodes": 2}
    asked = small(arms={"strong": words}, compare=[], test=two)
    assert asked.adversarial == ["strong"]
    assert performed(asked, tmp_path) == {}
    task = load(tmp_path / "trainings" / "strong-3").task
    assert (list(task.initial), task.fixed) == (["fire"], {})
    assert equal(task.initial["fire"].weights, own.weights)
    assert "`fire.initialize_from = " in page.set_up(asked)
    both = {"imitate": "sweep", "robots": words["fire"]}
    with pytest.raises(SettingsError, match="not both"):
        small(arms={"both": both}, compare=[])
    begin(asked, tmp_path)
    refuse_changed(asked, tmp_path)
    monkeypatch.setattr(asked_module, "initial_of", lambda *_: {"fire": another})
    with pytest.raises(RunError, match=r"^arms\.strong\.initial\.fire: "):
        refuse_changed(asked, tmp_path)


@pytest.mark.slow
def test_a_pool_gives_the_same(whole, tmp_path):
    """However many processes there are."""
    with workers(2) as executor:
        assert performed(small(), tmp_path, executor, width=2) == {}
    assert tables(tmp_path) == tables(whole)


@pytest.mark.slow
@pytest.mark.filterwarnings("default:::(distributed|dask|tornado)")
def test_a_dask_cluster_of_two_processes_gives_the_same(whole, tmp_path):
    """Which has no disk of ours."""
    distributed = pytest.importorskip("distributed")
    local = {"n_workers": 2, "threads_per_worker": 1, "dashboard_address": None}
    with (
        distributed.LocalCluster(**local) as machines,
        cluster(machines.scheduler_address) as (executor, width),
    ):
        assert width() == 4
        plan = {"executor": executor, "width": 4, "here": False}
        assert performed(small(), tmp_path, **plan) == {}
    assert tables(tmp_path) == tables(whole)


def test_refuses_a_cluster_that_does_not_answer(monkeypatch):
    """Or Dask that is not there; in one message."""
    monkeypatch.setattr(workforce, "ANSWER", 0.2)
    with (
        pytest.raises(InputError, match=r"no Dask scheduler answers|is not installed"),
        cluster("tcp://127.0.0.1:9"),
    ):
        pytest.fail("it answered")


def test_who_stops_is_told_how_to_go_on(tmp_path, monkeypatch, capsys):
    """With the page where it was asked for."""

    def stopped(*_):
        signal.raise_signal(signal.SIGINT)
        return {}

    monkeypatch.setattr(steps, "perform", stopped)
    file, out, told = str(FILES / "tiny.toml"), str(tmp_path), str(tmp_path / "told.md")
    command = ["experiment", file, "--out", out, "--page", told]
    assert main([*command, "--workers", "0"]) == 130
    again = capsys.readouterr().err.splitlines()[-1].split()[3:]
    assert again == [*command[:2], "--resume", *command[2:]]


@pytest.mark.slow
@pytest.mark.paper("E6")
@pytest.mark.paper("F12")
def test_the_tiny_experiment_makes_every_part(tmp_path, capsys):
    """By the command: the matrix with its own and others' fires and best responses."""
    command = ["experiment", str(FILES / "tiny.toml"), "--out", str(tmp_path / "new")]
    assert main([*command, "--workers", "0", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    cells, text = told["cells"], (tmp_path / "new" / "page.md").read_text()
    fires = {cell["fire"] for cell in cells if cell["robots"] == "learning"}
    assert fires == {"random", OWN, "learning's fires", BEST}
    assert {cell["robots"] for cell in cells} == {
        "random_fire",
        "learning",
        "none",
        "sweep",
    }
    assert told["answer"] in text
    assert "in the fourth fifth" in text
    pictures = re.findall(r"\]\(([^)]+)\)", text)
    assert len(pictures) == 6
    assert all((tmp_path / "new" / name).stat().st_size > 5_000 for name in pictures)
    assert main(command) == 1  # it is there
    again = [*command, "--resume", "--page", str(tmp_path / "RESULTS.md")]
    assert main(again) == 0
    assert "](RESULTS.pictures/matrix.png)" in (tmp_path / "RESULTS.md").read_text()


# -- Best responses -----------------------------------------------------------------


@pytest.fixture
def chosen(tmp_path):
    """A plan of which all choices are there, made by hand.

    Of three fires the second costs teams most.
    """
    asked = small(
        test={**SMALL["test"], "fires": ["random", "learning"], "looking_ahead": 1},
        best_response={"decisions": 7},
    )
    plan = Plan(asked, tmp_path, here=True)
    for team in asked.teams:
        for k, survival in enumerate((0.5, 0.2, 0.8)):
            make_folder(plan.test(team, str(k)).parent)
            runs = [run(team, str(k), seed, survival) for seed in asked.choices]
            table_of(plan.test(team, str(k)), runs)
    return plan


def jobs(plan):
    """Every step of a plan by its name."""
    return {step.name: step for step in plan.steps()}


@pytest.mark.paper("E6")
def test_the_strongest_response_is_the_one_that_costs_a_team_most(chosen):
    """Chosen by the mean reward, once all are known, on seeds that no test has."""
    asked = chosen.experiment
    for team in asked.teams:
        assert chosen.strongest(team) == chosen.response(team, 1)
        needs = jobs(chosen)[f"tests/{team} {BEST}"].needs
        assert {chosen.test(team, str(k)) for k in asked.responses} <= {*needs}
    assert len(asked.choices) > 0
    for seeds in asked.fires.values():
        assert not {*asked.choices} & {*seeds}


@pytest.mark.paper("E6")
@pytest.mark.parametrize(
    ("step", "learned"),
    [
        ("tests/ppo-3 random", {"robots": b"ppo-3"}),
        ("tests/ppo-3 learning-3", {"robots": b"ppo-3", "fire": b"learning-3"}),
        ("tests/sweep learning-3", {"fire": b"learning-3"}),
        ("choices/ppo-3 2", {"robots": b"ppo-3", "fire": b"ppo-3-2"}),
        (f"tests/ppo-3 {BEST}", {"robots": b"ppo-3", "fire": b"ppo-3-1"}),
        (f"tests/sweep {BEST}", {"fire": b"sweep-1"}),
        ("tests/ppo-3 worst-case", {"robots": b"ppo-3"}),
    ],
)
def test_everybody_meets_the_fire_that_the_table_names(
    chosen, step, learned, monkeypatch
):
    """A script, an arm's own, a response by its number, or the strongest of them.

    Here a checkpoint is its folder's name.
    """
    monkeypatch.setattr(steps, "checkpoint_of", lambda folder: folder.name.encode())
    monkeypatch.setattr(steps, "packed", bytes)
    assert jobs(chosen)[step].job().learned == learned


@pytest.mark.paper("F12")
def test_few_evacuations_meet_the_fire_that_looks_ahead(chosen):
    """It is slow: as many as asked for, of the others' seeds."""
    steps_ = jobs(chosen)
    assert steps_["tests/sweep random"].job().seeds == range(5000, 5002)
    assert steps_["tests/sweep worst-case"].job().seeds == range(5000, 5001)


@pytest.mark.paper("E6")
def test_each_response_learns_with_a_seed_and_a_budget_of_its_own(chosen):
    """And against the frozen team alone; all else is as the experiment asks."""
    fits = [jobs(chosen)[f"responses/sweep-{k}"].job() for k in range(3)]
    tasks = [unpacked(BytesIO(fit.beginning), Path()).task for fit in fits]
    assert [task.seed for task in tasks] == [10_000, 10_001, 10_002]
    assert {task.settings.fire.max_steps for task in tasks} == {7}
    assert all(task.fixed == {"robots": "sweep"} for task in tasks)


@pytest.mark.paper("E6")
def test_a_training_ends_when_its_own_side_has_had_its_decisions(whole):
    """Robots have had their 20 long before the fire."""
    for team in ("learning-3", "ppo-3"):
        learners = Training.resumed(load(whole / "trainings" / team)).learners
        assert learners["fire"].steps < 20 <= learners["robots"].steps


# -- Results ------------------------------------------------------------------------

COMPARED = {
    "seeds": [0, 1, 2],
    "compare": [["learning", "ppo"]],
    "test": {"fires": ["random", "learning"], "robots": ["none", "sweep"]},
    "best_response": {"decisions": 9},
}


def run(robots, fire, seed, survival):
    """The record of an evacuation of ten people."""
    out = round(10 * survival)
    rest = (10, out, 10 - out, 0, survival, 100.0 * out, 50.0, 9.0, 80.0, 90.0)
    return RunResult(robots, fire, seed, *rest, times=tuple(range(out)))


def outcome(best, random=0.8):
    """Tests in which so many survive random fire, and of each arm its best response."""
    return Results(
        small(**COMPARED),
        [
            run(f"{arm}-{k}", fire, seed, share + 0.1 * (k % 2))
            for arm, response in best.items()
            for k in range(3)
            for seed in range(20)
            for fire, share in (
                ("random", random),
                (BEST, response),
                ("learning-1", 0.6),
            )
        ],
    )


def test_an_arm_has_a_row_and_a_kind_of_fire_a_column():
    """Its own fire stands beside those of other trainings; intervals are over arms."""
    results = outcome({"learning": 0.5, "ppo": 0.3})
    cells = {(cell.robots, cell.fire): cell for cell in results.cells()}
    assert [fire for robots, fire in cells if robots == "learning"] == [
        "random",
        "learning's fires",
        OWN,
        BEST,
    ]
    assert cells["learning", OWN].n == 20
    assert cells["learning", "learning's fires"].n == 40
    random = cells["learning", "random"].survival
    assert random == pytest.approx((2.5 / 3, 0.8, 0.9))
    assert results.values("ppo", BEST, "survival").shape == (3, 20)


@pytest.mark.parametrize(
    ("best", "words"),
    [
        (
            (0.6, 0.3),
            "best responses, `learning` less `ppo`: 30.0 [23.3, 36.7] percentage "
            "points: it is better",
        ),
        (
            (0.6, 0.3),
            "`ppo` less `learning`: 30.0 [30.0, 30.0] points: it is less exploitable",
        ),
        ((0.3, 0.6), "-30.0 [-30.0, -30.0] points: it is more exploitable"),
        ((0.5, 0.5), "cannot be told apart"),
        ((0.5, 0.5), "This is preliminary: 3 trainings an arm,"),
    ],
)
def test_the_answer_is_what_the_intervals_say(best, words):
    """Above 0, below 0 or around it; preliminary with fewer than five trainings."""
    results = outcome(dict(zip(("learning", "ppo"), best, strict=True)))
    assert words in page.answer(results)
    assert page.answer(results) in page.page(results, [("a picture", "a.png")])


def test_who_has_less_to_lose_is_not_called_more_robust():
    """Half as many survive random fire, and equally few the best response."""
    results = outcome({"ppo": 0.2})
    for (_, fire), runs in outcome({"learning": 0.2}, random=0.4).runs.items():
        results.runs["learning", fire] = runs
    told = page.answer(results)
    less = r"it is less exploitable\. But under random fire, `learning` less `ppo`:"
    fewer = r"-\S+ \[-\S+, -\S+\] points: it has less to lose, and is not"
    assert re.search(f"{less} {fewer} more robust", told)


def test_without_best_responses_there_is_no_answer():
    """And no exploitability; the matrix is there all the same."""
    results = Results(small(), [run("learning-3", "random", k, 0.5) for k in range(4)])
    text = page.page(results, [])
    assert "No best responses were trained" in text
    assert "exploitability" not in text
    assert "| `learning` | 50.0 [50.0, 50.0] |" in text
    half = Results(
        small(**COMPARED),
        [run(f"learning-{k}", "random", 0, 0.5) for k in range(3)]
        + [run(f"learning-{k}", BEST, 0, 0.5) for k in range(2)],
    )
    assert half.exploitable == []
    assert list(telling(half, Plan(half.experiment, Path(), here=True))) == []


@pytest.mark.paper("F9", "F12")
@pytest.mark.parametrize(
    ("baseline", "told"),
    [
        (None, "E by the paper's ruler:"),
        ("sweep", "E by the ruler on which `sweep` scores 1 on average over its fires"),
        ("none", "E is not known, since `none` yields no ruler:"),
    ],
)
def test_the_page_says_by_which_ruler_e_is_measured(baseline, told):
    """The paper's, or the baseline's; who never was in a test yields none."""
    test = COMPARED["test"] | {"baseline": baseline}
    runs = [
        replace(run("sweep", fire, seed, share + 0.1 * (seed % 2)), difficulty=h)
        for fire, share, h in (("random", 0.8, 20.0), ("busiest", 0.2, 200.0))
        for seed in range(9)
    ]
    results = Results(small(**COMPARED | {"test": test}), runs)
    assert told in page.page(results, [])
    scores = [cell.score for cell in results.cells()]
    if baseline == "none":
        assert scores == [None, None]
    else:
        average = mean(score.mean for score in scores)
        assert (average == pytest.approx(1)) == (baseline == "sweep")


def test_a_film_needs_whole_checkpoints_and_says_what_to_remove(tmp_path):
    """As a test does."""
    results = outcome({"learning": 0.5, "ppo": 0.3})
    one = {"best_response": {"decisions": 9, "seeds": 1}, "test": {}}
    results.experiment = small(**COMPARED | one)
    plan = Plan(results.experiment, tmp_path, here=True)
    with pytest.raises(RunError, match=r"learning-0-0: its checkpoint .* Remove this"):
        next(telling(results, plan))


def test_a_film_shows_robots_that_learned_whatever_is_compared_first(
    tmp_path, monkeypatch
):
    """A pair of robots written by hand has no training to show."""
    monkeypatch.setattr(results_module, "checkpoint_of", lambda folder: None)
    results = outcome({"learning": 0.5, "ppo": 0.3})
    for robots, survival in (("none", 0.2), ("sweep", 0.4)):
        for fire in ("random", BEST):
            results.runs[robots, fire] = [run(robots, fire, 0, survival)]
    pairs = [["none", "sweep"], ["ppo", "learning"]]
    one = {"best_response": {"decisions": 9, "seeds": 1}, "compare": pairs}
    results.experiment = small(**COMPARED | one)
    plan = Plan(results.experiment, tmp_path, here=True)
    assert [name for name, _ in telling(results, plan)] == ["none", "sweep", "ppo-0"]


def test_a_film_shows_the_first_training_that_did_not_fail(tmp_path, monkeypatch):
    """The others have their page all the same."""
    monkeypatch.setattr(results_module, "checkpoint_of", lambda folder: None)
    one = {"best_response": {"decisions": 9, "seeds": 1}, "seeds": [3, 4]}
    experiment = small(**COMPARED | one)
    runs = [run("ppo-4", fire, 0, 0.5) for fire in ("random", BEST)]
    plan = Plan(experiment, tmp_path, here=True)
    films = list(telling(Results(experiment, runs), plan))
    assert [name for name, _ in films][-1] == "ppo-4"


def test_the_page_says_what_an_arm_changes():
    """Two arms that differ in one number are told apart."""
    arms = {"short": {"robots": {"gamma": 0.9}}, "long": {"robots": {"gamma": 0.99}}}
    told = page.set_up(small(arms=arms))
    assert (
        "`short`: MA-POCA against a fire that learns with `robots.gamma = 0.9`" in told
    )
    assert "`robots.gamma = 0.99`" in told
    assert f"preset `tiny` of version {reference.__version__} with" in told
    assert "`robots.hidden_units = 8`" in told


@pytest.mark.paper("F12")
def test_a_best_response_that_is_flat_gains_nothing_at_the_end():
    """Survivors of the fourth fifth less the last's, of the fire's rows alone."""
    falling = [0.9, 0.8, 0.7, 0.6, 0.6, 0.6, 0.5, 0.5, 0.4, 0.4]
    assert last_gain([learned(falling)]).mean == pytest.approx(0.1)
    assert last_gain([learned([0.5] * 7), learned(falling)]).mean == pytest.approx(0.05)
    assert last_gain([learned([0.9, 0.5])]).mean == pytest.approx(0.4)


def learned(survivors):
    """The run of a fire that learned, with a row of the robots' between all of its."""
    side = np.array(["fire", "robots"] * len(survivors))
    columns = {"side": side, SURVIVAL: np.repeat(survivors, 2) + 9 * (side == "robots")}
    return Run("a fire", np.zeros(len(side)), columns, ())


# -- Files --------------------------------------------------------------------------


@pytest.mark.parametrize("file", sorted(FILES.glob("*.toml")), ids=lambda f: f.name)
def test_the_files_that_ship_can_be_read(file):
    """And every arm has the same budget."""
    experiment = read(file)
    for settings, *_ in map(experiment.of_arm, experiment.arms):
        assert settings.robots.max_steps == experiment.decisions
        assert settings.fire.max_steps >= experiment.decisions  # never before robots


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"armz": {}}, "Did you mean 'arms'"),
        ({"arms": {}}, "at least one arm"),
        ({"arms": {"a": {"fire": "bussiest"}}}, "Did you mean 'busiest'"),
        ({"arms": {"a": {"robots": {"gama": 1}}}}, "Did you mean 'gamma'"),
        ({"arms": {"a": {"scenario": {}}}}, "scenario is everybody's"),
        ({"arms": {"sweep": {}}}, "no arm's name"),
        ({"arms": {"../a": {}}}, "no arm's name"),
        ({"arms": {"a": 3}}, "must be"),
        ({"seeds": [-1]}, "upwards"),
        ({"seeds": 3}, "must be a list"),
        ({"decisions": 0}, "upwards"),
        ({"decisions": "many"}, "whole number"),
        ({"preset": "laptob"}, "Did you mean 'laptop'"),
        ({"test": {"fires": ["learnin"]}}, "Did you mean 'learning'"),
        ({"test": {"robots": ["sweeep"]}}, "Did you mean 'sweep'"),
        ({"test": {"baseline": "patrol"}}, "baseline"),
        ({"compare": [["learning"]]}, "two in each pair"),
        ({"compare": [["learning", "nobody"]]}, "'nobody' is unknown"),
        ({"best_response": {}}, "decisions is missing"),
        ({"arms": {"a": {"imitate": "none"}}}, "'none' is unknown"),
        ({"arms": {"a": {"robots": {"initialize_from": 3}}}}, "initialize_from"),
        ({"arms": {"learned": {}}}, "no arm's name"),
        ({"seeds": [3, 3]}, "seeds: name each once"),
        ({"settings": {"scenario": {"robots_per_floor": 0}}}, "robots_per_floor is 0"),
        ({"settings": {"scenario": {"people": 5000}}}, "do not fit"),
        ({"test": {"robots": ["sweep", "sweep"]}}, "robots: name each once"),
        ({"test": {"episodes": 10**12}}, "evacuations in all: ask for 1,000,000 at"),
        ({"best_response": {"decisions": 9, "seeds": 10**9}}, "evacuations in all"),
    ],
)
def test_refuses_what_no_experiment_can_be_made_of(changes, message):
    """With what is wrong, and what may have been meant."""
    with pytest.raises(SettingsError, match=message):
        small(**changes)


def test_the_fire_that_ships_may_be_an_arms_and_a_tests():
    """A network, which learns nothing."""
    asked = {"arms": {"a": {"fire": "learned"}}, "test": {"fires": ["learned"]}}
    experiment = record_from(Experiment, asked | {"decisions": 9}, "experiment")
    assert experiment.adversarial == []
    assert experiment.fires == {"learned": range(5000, 5100)}
    fixed = experiment.trainings["a-0"].fixed["fire"]
    assert equal(fixed.weights, load(SHIPPED).player("fire").weights)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("[best_response]", '[best_response]\ninitialize_from = "learned"'),
        ('fires = ["random"', 'fires = ["learned"'),
        ('fire = "random"', 'fire = "learned"'),
    ],
)
def test_refuses_the_fire_of_another_building(tmp_path, capsys, old, new):
    """In one message, before anything is trained or tested."""
    path, text = tmp_path / "x.toml", (FILES / "tiny.toml").read_text()
    path.write_text(text.replace(old, new))
    assert main(["experiment", str(path), "--out", str(tmp_path / "out")]) == 1
    assert "has learned Institute" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_refuses_a_file_that_is_no_toml(tmp_path, capsys):
    """In one message, before anything is written."""
    path = tmp_path / "x.toml"
    path.write_text("arms = [")
    assert main(["experiment", str(path), "--out", str(tmp_path / "out")]) == 1
    assert "this is no TOML" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_refuses_a_seed_of_its_own(tmp_path, capsys):
    """It would be ignored: the file has the seeds."""
    out = tmp_path / "out"
    command = ["experiment", str(FILES / "tiny.toml"), "--out", str(out)]
    assert main([*command, "--seed", "5"]) == 2
    assert "seeds are in its file" in capsys.readouterr().err
    assert not out.exists()


def test_refuses_a_page_whose_pictures_have_no_place(tmp_path, capsys):
    """Before anything is trained."""
    page = tmp_path / "page.md"
    page.with_suffix(".pictures").touch()
    out = tmp_path / "out"
    command = ["experiment", str(FILES / "tiny.toml"), "--out", str(out)]
    assert main([*command, "--page", str(page)]) == 1
    assert "page.pictures: is a file. Name another page." in capsys.readouterr().err
    assert not out.exists()


def test_refuses_to_go_on_with_another_experiment(tmp_path):
    """More seeds and arms may be asked for; nothing that was begun may change."""
    begin(small(), tmp_path)
    more = {"arms": {**SMALL["arms"], "third": {}}, "seeds": [3, 4]}
    refuse_changed(small(**more), tmp_path)
    for changes in (
        {"decisions": 30},
        {"test": {"fires": ["random"], "episodes": 3}},
        {"arms": {"learning": {"random_fires": 0.5}}},
    ):
        with pytest.raises(RunError, match="was asked for"):
            refuse_changed(small(**changes), tmp_path)
    with pytest.raises(RunError, match="map differs"):
        refuse_changed(small(building="paper"), tmp_path)
    with pytest.raises(RunError, match="no experiment"):
        refuse_changed(small(), tmp_path / "elsewhere")


def test_remembers_arms_that_are_not_asked_for_now(tmp_path):
    """And the best responses: whoever asks for them again asks for the same."""
    begun = small(best_response={"decisions": 9})
    one = {"arms": {"ppo": SMALL["arms"]["ppo"]}}
    for asked in (begun, small(**one), begun):
        if asked is not begun:
            refuse_changed(asked, tmp_path)
        begin(asked, tmp_path)
    refuse_changed(begun, tmp_path)
    other = {**SMALL["arms"], "learning": {"random_fires": 0.5}}
    message = r"^arms\.learning\.random_fires: 0\.5 was asked for, but .* has 0\.0\."
    with pytest.raises(RunError, match=message):
        refuse_changed(small(arms=other), tmp_path)
    refuse_changed(small(best_response={"decisions": 8}), tmp_path)  # none has begun
    (tmp_path / "responses").mkdir()
    with pytest.raises(RunError, match=r"^best_response\.decisions: 8 was asked for"):
        refuse_changed(small(best_response={"decisions": 8}), tmp_path)
