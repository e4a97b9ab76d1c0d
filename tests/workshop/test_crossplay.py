"""Robots × fires × seeds: who plays, paired runs, and what they come to."""

import json
import shutil
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from outcomes import result
from trainings import Stopped, begun, room_for, tiny, trained

from reference.evaluation.bounds import critical_points
from reference.evaluation.difficulty import arrival_of, difficulty, people_in
from reference.evaluation.score import RulerError, paper_ruler
from reference.fire import RandomFire
from reference.paper import InputError, Scenario
from reference.simulation import Simulation
from reference.workshop.comparing import (
    begin_evaluation,
    cells,
    play_evaluation,
    resume_evaluation,
    runs,
    table,
)
from reference.workshop.comparing.intervals import Interval, interval_of_mean
from reference.workshop.comparing.matches import notes, write_evaluation
from reference.workshop.comparing.results import (
    baseline_of,
    evaluation_as_json,
    mean_and_interval,
)
from reference.workshop.maps import find_map, load
from reference.workshop.storage import progress
from reference.workshop.storage.workers import InProcess, one_thread, workers
from reference.workshop.strategies.guides import Sweep
from reference.workshop.training.checkpoints import load_checkpoint as load_checkpoint
from reference.workshop.training.checkpoints import save_checkpoint

pytestmark = pytest.mark.usefixtures("in_an_empty_folder")

SMALL = {"robots": ("none", "sweep"), "fires": ("random",), "building": "tiny"}
SMALL |= {"people": 4, "episodes": 2}


@pytest.fixture(scope="module")
def small():
    """All results of SMALL."""
    return play_evaluation(begin_evaluation(**SMALL), None, InProcess())


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """The folder of a training that was stopped after its first round."""
    folder = tmp_path_factory.mktemp("trainings") / "run"
    with one_thread():
        trained(begun(), folder, rounds=1)
    return folder


def interrupted(evaluation, folder, jobs=0):
    """Begin an evaluation, which Ctrl-C ends after so many jobs."""
    with pytest.raises(KeyboardInterrupt):
        play_evaluation(evaluation, folder, Stopped(jobs))


NOBODY_OUT = {"times": (), "reward": -12000.0}


# -- Runs ---------------------------------------------------------------------------


def test_a_result_tells_what_the_simulation_did(small):
    """Run by hand, from the same seed."""
    scenario = Scenario(people=4)
    run = Simulation(load("tiny"), scenario, Sweep(), RandomFire(), seed=1)
    people = people_in(run.world)
    outcome = run.run()
    found = small[3]
    assert found.survival == outcome.evacuated / 4
    assert found.reward == pytest.approx(outcome.reward)
    assert found.difficulty == pytest.approx(
        difficulty(run.building, arrival_of(run), people), abs=1e-5
    )
    assert len(found.times) == found.evacuated == outcome.evacuated
    assert found.evacuation_time == max(found.times) <= found.simulated_seconds


def test_runs_of_one_seed_have_the_same_fire_whoever_guides(small):
    """They are paired; until somebody stands where one is to be lit, as D6 has it."""
    none, another, sweep, _ = (run.difficulty for run in small)
    assert none == sweep != another


@pytest.mark.slow
def test_it_does_not_matter_who_does_the_jobs(small):
    """Threads or processes, in whichever order they are done."""
    evaluation = begin_evaluation(**SMALL)
    with ThreadPoolExecutor(2) as threads:
        assert play_evaluation(evaluation, None, threads) == small
    with workers(1) as processes:
        assert play_evaluation(evaluation, Path("out"), processes) == small
    assert runs.read_runs(Path("out/runs.csv"), evaluation) == small


# -- What is kept -------------------------------------------------------------------


def test_what_is_over_is_kept_and_not_played_again(small, monkeypatch):
    """Stopped after two runs; then only the others are played, to the same end."""
    monkeypatch.setattr(runs, "RUNS_PER_JOB", 2)
    monkeypatch.setattr(runs, "JOBS_PER_WORKER", 1)
    folder = Path("stopped")
    whole = Path("whole")
    interrupted(begin_evaluation(**SMALL), folder, jobs=1)
    assert runs.read_runs(folder / "runs.csv", begin_evaluation(**SMALL)) == small[:2]
    assert play_evaluation(resume_evaluation(folder), folder, Stopped(jobs=1)) == small
    play_evaluation(begin_evaluation(**SMALL), whole, InProcess())
    assert (folder / "runs.csv").read_bytes() == (whole / "runs.csv").read_bytes()


def test_numbers_of_numpy_and_a_folder_by_its_name_are_as_good(small):
    """What is written is read again; nothing is left to play."""
    numbers = {"people": np.int64(4), "seed": np.int64(0), "errors": np.int64(0)}
    numbers |= {"episodes": np.int64(2), "sample": np.False_}
    assert play_evaluation(begin_evaluation(**SMALL | numbers), "out", InProcess())
    assert play_evaluation(resume_evaluation("out"), "out", Stopped()) == small


def test_who_is_not_asked_for_keeps_the_runs_that_are_there(small, monkeypatch, capsys):
    """Behind those that are; what is told counts none of them."""
    monkeypatch.setattr(progress, "SECONDS_BETWEEN", 0.0)
    monkeypatch.setattr(runs, "RUNS_PER_JOB", 1)
    folder = Path("out")
    both = begin_evaluation(**SMALL)
    write_evaluation(both, folder)
    runs.table_of(folder / "runs.csv", small[:2])
    alone = begin_evaluation(**SMALL | {"robots": ("sweep",)})
    assert play_evaluation(alone, folder, InProcess()) == small[2:]
    told = capsys.readouterr().err
    assert "1 runs, 50% done" in told and "2 runs, 100% done" in told
    assert runs.read_runs(folder / "runs.csv", both) == [*small[2:], *small[:2]]
    assert play_evaluation(both, folder, Stopped()) == small


def test_refuses_runs_of_a_name_that_is_nobodys(small):
    """Nobody can have asked for them."""
    folder = Path("out")
    both = begin_evaluation(**SMALL)
    write_evaluation(both, folder)
    runs.table_of(folder / "runs.csv", [replace(small[0], robots="swoop"), *small[1:]])
    with pytest.raises(InputError, match=r"runs.csv: some runs are of 'swoop'"):
        play_evaluation(both, folder, Stopped())


def test_a_disk_that_fills_up_in_the_middle_of_a_row_keeps_the_rows_before(small):
    """What was written of the new one is not read; the message says what helps."""
    path = Path("runs.csv")
    row = runs.row_of(small[0])
    written = runs.table_of(path, small[:1])
    told = r"written .* Make room"
    with room_for(path.stat().st_size + 10), pytest.raises(OSError, match=told):
        written.append([row])
    assert runs.read_runs(path, begin_evaluation(**SMALL)) == small[:1]


def test_a_disk_that_is_full_after_the_last_run_withholds_no_result(small, monkeypatch):
    """All rows are there; only their order is not, where it was another."""
    table_of = runs.table_of

    def full(path, results):
        rows = [*results]
        if len(rows) == len(small):
            raise OSError("no space left")
        return table_of(path, rows)

    monkeypatch.setattr(runs, "table_of", full)
    done = runs.map_as_done
    monkeypatch.setattr(runs, "map_as_done", lambda *given: reversed([*done(*given)]))
    monkeypatch.setattr(runs, "RUNS_PER_JOB", 1)
    evaluation = begin_evaluation(**SMALL)
    assert play_evaluation(evaluation, Path("out"), InProcess()) == small
    kept = runs.read_runs(Path("out/runs.csv"), evaluation)
    assert kept == small[::-1]


# -- Who is asked for ---------------------------------------------------------------


def test_a_checkpoint_brings_its_building_and_scenario(run):
    """Scripts then play there too, with as many people."""
    evaluation = begin_evaluation(("sweep", str(run)), ("random",), episodes=1)
    assert evaluation.arena.building == "tiny"
    assert evaluation.arena.people == 6
    assert evaluation.arena.scenario == replace(tiny().scenario, training=False)
    found = play_evaluation(evaluation, None, InProcess())
    assert [r.robots for r in found] == ["sweep", str(run)]
    assert all(r.people == 6 for r in found)


def test_a_folder_does_not_take_a_strategys_name(run):
    """A training in it would play, and be called the best scripted guide."""
    shutil.copytree(run, "sweep")
    asked = begin_evaluation(("sweep",), ("none",), building="tiny", episodes=1)
    assert not asked.files


def test_a_folder_means_the_checkpoint_that_was_newest_at_the_beginning(run, tmp_path):
    """Though the training goes on meanwhile; so an evaluation has one opponent."""
    training = tmp_path / "training"
    folder = tmp_path / "out"
    shutil.copytree(run, training)
    word = str(training)
    first = str(training / "checkpoint-000001.pt")
    play_evaluation(
        begin_evaluation((word,), ("none",), episodes=1), folder, InProcess()
    )
    shutil.copy(first, training / "checkpoint-000002.pt")
    again = resume_evaluation(folder, fires=("random",))
    assert (again.robots, again.files[word]) == ((word,), first)
    assert {r.robots for r in play_evaluation(again, folder, InProcess())} == {word}


def test_each_run_has_strategies_of_its_own_and_the_worst_case_knows_whom_it_meets():
    """They begin as they were made, though they are made once."""
    evaluation = begin_evaluation(("patrol",), ("worst-case",), "tiny", people=2)
    runs = list(evaluation.simulations(evaluation.runs[:2]))
    one, other = (run.robot_strategy for run in runs)
    assert one is not other and vars(one) == vars(other)
    assert all(run.fire_strategy.robots is run.robot_strategy for run in runs)
    assert runs[0].fire_strategy.scenario == evaluation.arena.scenario


def changed_scenario(run, path, **fields):
    """A checkpoint like the training's, as if it had learned under another scenario."""
    checkpoint = load_checkpoint(run)
    settings = checkpoint.task.settings
    scenario = replace(settings.scenario, **fields)
    task = replace(checkpoint.task, settings=replace(settings, scenario=scenario))
    save_checkpoint(replace(checkpoint, task=task), path)
    return str(path)


def test_the_heading_says_under_what_a_table_was_played(run, tmp_path):
    """Every field that is not the default, for people and for programs."""
    odd = changed_scenario(run, tmp_path / "odd.pt", sight_range=2.0, rooms=["1/hall"])
    evaluation = begin_evaluation((odd,), episodes=1)
    title = evaluation.about().partition(":")[0]
    under = "rooms=1/hall, sources=3, time_limit=40, sight_range=2"
    assert title == f"Tiny office, 6 people, {under}"
    facts = evaluation_as_json(evaluation, paper_ruler(), [])
    told = {"people": 6, "rooms": ["1/hall"], "sources": 3}
    assert facts["scenario"] == told | {"time_limit": 40.0, "sight_range": 2.0}
    calm = begin_evaluation(("none",), building="tiny", scenario={"sources": 0})
    assert calm.about().startswith("Tiny office, 40 people, sources=0: ")
    alone = begin_evaluation(("none",), building="tiny", people=1)
    assert alone.about().startswith("Tiny office, 1 person: 1 robot strategy, ")
    small = begin_evaluation(**SMALL).about()
    assert small.startswith("Tiny office, 4 people: 2 robot strategies, ")


def test_refuses_checkpoints_of_two_scenarios_in_whichever_order(run, tmp_path):
    """The first would have ruled all rows; what is stated may differ, and is told."""
    one = str(run)
    two = changed_scenario(run, tmp_path / "tz.pt", sight_range=2.0, time_limit=50.0)
    for words in ((one, two), (two, one), ("none", two, one)):
        with pytest.raises(InputError) as refused:
            begin_evaluation(words, ("none",))
        assert f"--robots {two}: " in str(refused.value) or two in str(refused.value)
        assert "time_limit=50, sight_range=2" in str(refused.value)
    stated = {"sight_range": 4.0, "time_limit": 50.0}
    tables = [
        play_evaluation(
            begin_evaluation(words, ("random",), episodes=2, scenario=stated),
            None,
            Stopped(9),
        )
        for words in ((one, two), (two, one))
    ]
    assert sorted(map(str, tables[0])) == sorted(map(str, tables[1]))
    told = notes(begin_evaluation((one, two), ("random",), scenario=stated))
    assert told[1] == f"--robots {two}: learned under sight_range=2; here it plays " + (
        "under sight_range=4"
    )


def test_a_kept_drawing_is_told_where_its_file_has_changed(run, tmp_path, monkeypatch):
    """A checkpoint is played in its own."""
    drawing = tmp_path / "office.txt"
    checkpoint = load_checkpoint(run)
    task = replace(checkpoint.task, building=str(drawing))
    save_checkpoint(replace(checkpoint, task=task), tmp_path / "net.pt")
    evaluation = begin_evaluation((str(tmp_path / "net.pt"),), ("none",), episodes=1)
    assert notes(evaluation) == []
    drawing.write_text(find_map("tiny").read_text())
    assert notes(evaluation) == []
    drawing.write_text(find_map("paper").read_text())
    changed = f"{drawing} has changed since; this plays the kept drawing"
    assert notes(evaluation) == [changed]
    assert evaluation_as_json(evaluation, None, [])["notes"] == [changed]


# -- What it comes to ---------------------------------------------------------------


@pytest.mark.paper("F12")
def test_a_gain_is_the_mean_difference_from_the_baseline_of_the_same_seeds():
    """Of one fire; a seed that the baseline has not played counts for nothing."""
    ours = [result("patrol", seed=k, survival=s) for k, s in enumerate((0.5, 1.0, 0))]
    theirs = [result("sweep", seed=k, survival=s) for k, s in ((1, 0.5), (0, 0.25))]
    elsewhere = result("patrol", fire="greedy")
    found = cells([*ours, *theirs, elsewhere], paper_ruler(), "sweep")
    assert [cell.gain for cell in found] == [
        interval_of_mean([0.25, 0.5]),
        (0, 0, 0),
        None,
    ]
    first, line, *_ = table(found).splitlines()
    assert "over baseline" in first
    assert "+37.5 [+25.0, +50.0]" in line
    assert "baseline" not in table(cells(ours, paper_ruler()))


@pytest.mark.paper("F12")
def test_the_best_scripted_guide_scores_1_whatever_else_plays():
    """On the fires of the table: by the mean of E over them, and by the paper's k."""
    points = critical_points(load("paper"), Scenario())
    worse = [result("patrol", seed=k, reward=7000.0) for k in range(3)]
    better = [result("sweep", seed=k, reward=9000.0) for k in range(3)]
    learned = [result("out/net.pt", seed=k, reward=9500.0) for k in range(3)]
    none = [result("none", seed=k, reward=9900.0) for k in range(3)]
    found = baseline_of([*worse, *better, *learned, *none], None, *points)
    assert (found.robots, found.ruler.k) == ("sweep", paper_ruler().k)
    played = [*worse, *better, *learned]
    averaged = cells(played, paper_ruler(), on_baseline=found.ruler)
    scores = [cell.score_on_baseline.mean for cell in averaged]
    assert scores[1] == pytest.approx(1)
    assert scores[0] < 1 < scores[2]
    heads = table(averaged, baseline=found.robots).splitlines()[0]
    assert "score E" in heads and "E, sweep = 1" in heads
    assert "= 1" not in table(cells(played, paper_ruler()))
    assert baseline_of([*learned, *none], None, *points) is None
    assert baseline_of([*learned, *none], "none", *points).why == "as asked"


@pytest.mark.paper("F12")
@pytest.mark.parametrize(
    ("best", "told"),
    [
        ((-1_800.0, 1000.0), "the best reward is the worst"),
        ((-1_700.0, 1000.0), "lies off this ruler"),
    ],
)
def test_refuses_a_baseline_where_nobody_is_to_get_out(best, told):
    """The mean way kills, or nearly; some near a way out get out all the same."""
    runs = [result("sweep", seed=k, reward=-1310.0) for k in range(3)]
    with pytest.raises(RulerError, match=told):
        baseline_of(runs, None, (-1_800.0, 0.1), best)


@pytest.mark.paper("F9")
def test_the_score_of_a_cell_is_that_of_its_means():
    """E is convex: a mean of scores would pay for being unreliable."""
    steady = [result("steady", seed=k, reward=8000.0) for k in range(8)]
    gamble = [result("gamble", seed=k, reward=16000.0 * (k % 2)) for k in range(8)]
    one, other = cells([*steady, *gamble], paper_ruler())
    assert one.score.mean == pytest.approx(paper_ruler().score(8000.0, 1000.0))
    assert other.score.mean == pytest.approx(one.score.mean)
    scores = [paper_ruler().score(run.reward, run.difficulty) for run in gamble]
    assert np.mean(scores) > 4 * one.score.mean
    assert other.score.low < one.score.low == one.score.high < other.score.high


def test_where_nobody_gets_out_there_is_no_time_and_no_health():
    """Neither nan nor 0 in any of what is printed and written."""
    dead = cells([result(**NOBODY_OUT), result("none", reward=1e9)], paper_ruler())
    assert dead[0].evacuation_time is dead[0].mean_health is dead[1].score is None
    facts = evaluation_as_json(begin_evaluation(**SMALL), paper_ruler(), dead)
    assert json.loads(json.dumps(facts, allow_nan=False)) == facts
    assert "nan" not in table(dead) and "inf" not in table(dead)


def test_the_table_is_aligned_and_says_what_is_missing():
    """A line for each match, under a line of heads."""
    dead = [result("none", seed=seed, **NOBODY_OUT) for seed in (0, 1)]
    first, *lines, note = table(cells([result(), *dead], paper_ruler())).splitlines()
    assert first.split()[:3] == ["robots", "fire", "runs"]
    assert [line.split()[:5] for line in lines] == [
        ["sweep", "random", "1", "50.0", "0"],  # a single run has no interval
        ["none", "random", "2", "0.0", "[0.0,"],
    ]
    assert len({len(line) for line in (first, *lines)}) == 1
    assert note.startswith("-: nobody got out")
    assert "nobody" not in table(cells([result()], paper_ruler()))


def test_what_rounds_to_nothing_has_no_sign():
    """Neither in points nor in health points."""
    least = Interval(-0.0004, -0.0002, 0.01)
    cell = SimpleNamespace(gain=least, reward=least, n=2)
    assert mean_and_interval(cell, "gain") == ("0.0", "[0.0, +1.0]")
    assert mean_and_interval(cell, "reward") == ("0", "[0, 0]")


# -- Refusals -----------------------------------------------------------------------


@pytest.mark.parametrize(
    ("asked", "message"),
    [
        ({"errors": 1.5}, "errors is 1.5: it must be a whole number"),
        ({"errors": True}, "errors is True: it must be a whole number"),
        ({"errors": -1}, "errors is -1: it must be a whole number from 0 upwards"),
        ({"seed": True}, "seed is True: it must be a whole number"),
        ({"seed": -1}, "seed is -1: it must be a whole number from 0 upwards"),
        ({"episodes": 2.5}, "episodes is 2.5: it must be a whole number"),
        ({"episodes": 0}, "episodes is 0: it must be a whole number from 1 upwards"),
        ({"episodes": 10**6}, "2000000 runs from seed 0 on: ask for 1 to 1,000,000"),
        ({"sample": 0}, "sample is 0: it must be true or false"),
        ({"robots": "sweep"}, r"robots is 'sweep': give a list, \['sweep'\]"),
        ({"fires": None}, "fires is None: give a list"),
        ({"robots": (Sweep(),)}, "one of robots is <.*: it must be a word"),
    ],
)
def test_refuses_what_no_evaluation_can_be_of(asked, message):
    """When it begins: what is written could not be read again."""
    with pytest.raises(InputError, match=message):
        begin_evaluation(**SMALL | asked)
    with pytest.raises(InputError, match=message):
        replace(begin_evaluation(**SMALL), **asked)


def test_refuses_to_resume_with_the_letters_of_a_word():
    """A word alone is no list of words."""
    write_evaluation(begin_evaluation(**SMALL), Path("out"))
    with pytest.raises(InputError, match="fires is 'none': give a list"):
        resume_evaluation("out", fires="none")


def test_refuses_to_mix_networks_or_maps_under_one_name(run, tmp_path):
    """At a resume, by whoever fills the same folder, and in the middle of a run."""
    network = tmp_path / "net.pt"
    drawing = tmp_path / "office.txt"
    first = run / "checkpoint-000001.pt"
    shutil.copy(first, network)
    drawing.write_text(find_map("tiny").read_text())
    words = {"robots": (str(network),), "fires": ("none",), "building": str(drawing)}
    evaluation = begin_evaluation(**words, episodes=1)
    play_evaluation(evaluation, tmp_path / "out", InProcess())
    assert resume_evaluation(tmp_path / "out").digests == evaluation.digests

    checkpoint = load_checkpoint(first)
    save_checkpoint(replace(checkpoint, round=2), network)
    changed = rf"evaluation.json: {network} has changed since\. Take another folder"
    with pytest.raises(InputError, match=changed):
        resume_evaluation(tmp_path / "out", fires=("random",))
    with pytest.raises(InputError, match=changed):
        play_evaluation(
            begin_evaluation(**words, episodes=2), tmp_path / "out", InProcess()
        )
    with pytest.raises(InputError, match=rf"^{network} has changed since"):
        list(evaluation.simulations(evaluation.runs))

    shutil.copy(first, network)
    drawing.write_text(drawing.read_text().replace("Tiny", "Small"))  # the same cells
    assert resume_evaluation(tmp_path / "out").digests == evaluation.digests
    drawing.write_text(drawing.read_text().replace("#........#", "##.......#", 1))
    with pytest.raises(InputError, match=rf"{drawing} has changed since"):
        resume_evaluation(tmp_path / "out")
    drawing.unlink()  # nothing else can be meant: the kept one is played
    assert resume_evaluation(tmp_path / "out").digests.keys() == {str(network)}


@pytest.mark.parametrize(
    ("old", "new"),
    [('"sight_range": 5.0', '"sight_range": 3.0'), ('"errors": 0', '"errors": 2')],
)
def test_refuses_to_mix_runs_of_two_scenarios_or_errors(old, new):
    """Changed by hand: the runs that are kept would stand under the new heading."""
    folder = Path("out")
    path = folder / "evaluation.json"
    interrupted(begin_evaluation(**SMALL), folder, jobs=2)
    kept = path.read_text()
    assert kept.count(old) == 1
    path.write_text(kept.replace(old, new))
    with pytest.raises(InputError, match="are of another scenario, --sample or"):
        play_evaluation(resume_evaluation(folder), folder, InProcess())
    older = {name: part for name, part in json.loads(kept).items() if name != "terms"}
    path.write_text(json.dumps(older))
    assert len(play_evaluation(resume_evaluation(folder), folder, InProcess())) == 4


def test_refuses_runs_of_which_nothing_tells_what_they_are(small):
    """They may be of other numbers or files."""
    runs.table_of(Path("out/runs.csv"), small)
    with pytest.raises(InputError, match=r"evaluation\.json: is gone"):
        play_evaluation(begin_evaluation(**SMALL), Path("out"), InProcess())


@pytest.mark.parametrize(
    ("file", "old", "new", "message"),
    [
        ("evaluation.json", '"version": "', '"version": "0.0.', "by version 0.0."),
        ("evaluation.json", '"game": ', '"game": 1', "version .* of game 1., this is"),
        ("runs.csv", "robots,fire,", "fire,", "is no table of these runs"),
        (
            "runs.csv",
            "times,deaths\n",
            "times,deaths\nsweep,random\n",
            r"runs.csv:2: this row is damaged \(it has 2 cells, the table 15 columns\)",
        ),
    ],
)
def test_refuses_files_that_are_not_its_own(file, old, new, message):
    """Or that another version wrote, in which runs may end otherwise."""
    path = Path("out") / file
    interrupted(begin_evaluation(**SMALL), Path("out"))
    path.write_text(path.read_text().replace(old, new))
    with pytest.raises(ValueError, match=message):
        play_evaluation(resume_evaluation(Path("out")), Path("out"), InProcess())


@pytest.fixture(scope="module")
def edited(small):
    """Write one row of SMALL's runs with changes, read it back with others."""

    def read(folder, *rows):
        evaluation = begin_evaluation(**SMALL)
        runs.table_of(folder / "runs.csv", rows)
        return runs.read_runs(folder / "runs.csv", evaluation)

    return read


def sweep_run(small):
    """A run in which several got out."""
    return next(run for run in small if run.evacuated > 2)


EDITS = {  # what is written: who says so
    "survival 5.0": ({"survival": 5.0}, "survival is 5, evacuated / people"),
    "survival 0": ({"survival": 0.0}, "survival is 0"),
    "survival of others": ({"survival": 0.999999}, "survival is 0.999999"),
    "nobody there": ({"people": 0}, "people do not add up"),
    "more people": ({"people": 5}, "people do not add up"),
    "more out": ({"evacuated": 5}, "people do not add up"),
    "fewer than none": ({"died": -1, "inside": 1}, "people do not add up"),
    "out and dead": ({"died": 4}, "people do not add up"),
    "inside and out": ({"inside": 1}, "people do not add up"),
    "health 900": ({"mean_health": 900.0}, "mean_health is 900, outside 0"),
    "health below 0": ({"mean_health": -1.0}, "mean_health is -1"),
    "health 0": ({"mean_health": 0.0}, "mean_health is 0"),
    "health that time has taken": ({"mean_health": 100.0}, "by its times"),
    "no health": ({"mean_health": None}, "does not go with times"),
    "nobody's times": ({"times": ()}, "0 times, but"),
    "one time more": ({"times": lambda t: (*t, t[-1])}, "times, but"),
    "one time less": ({"times": lambda t: t[:-1]}, "times, but"),
    "times descend": ({"times": lambda t: t[::-1]}, "do not ascend"),
    "a time below 0": ({"times": lambda t: (-1.0, *t[1:])}, "do not ascend"),
    "a time after the end": ({"times": lambda t: (*t[:-1], 999.0)}, "do not ascend"),
    "another last time": ({"evacuation_time": 1.0}, "evacuation_time is 1.0, the last"),
    "no last time": ({"evacuation_time": None}, "evacuation_time is None"),
    "a later last time": ({"times": lambda t: (*t[:-1], t[-1] + 0.1)}, "do not ascend"),
    "after the time limit": ({"simulated_seconds": 999.0}, "outside 0 to 240.2"),
    "before it began": ({"simulated_seconds": -1.0}, "outside 0 to"),
    "before the last was out": ({"simulated_seconds": 1.0}, "do not ascend"),
    "after all were out": (
        {"simulated_seconds": 200.0},
        "simulated_seconds is 200, though all were out",
    ),
    "hurt without fire": (
        {"fire": "none", "difficulty": 0.0, "mean_health": 50.0},
        "mean_health is 50, outside",
    ),
    "harder than all": (
        {"difficulty": 5000.0},
        "difficulty is 5000, outside 0 to 3853",
    ),
    "easier than none": ({"difficulty": -1.0}, "difficulty is -1"),
    "hard without fire": ({"fire": "none"}, "outside 0 to 0"),
    "reward of more people": ({"reward": 1e6}, "reward is 1e[+]06, outside"),
    "reward of the dead": ({"reward": -1200.0}, "reward is -1200, outside"),
    "all dead": (
        {"evacuated": 0, "died": 4, "survival": 0.0, "inside": 0},
        "times, but 0 people got out",
    ),
    "all inside, before the end": (
        {"evacuated": 0, "died": 0, "inside": 4, "survival": 0.0, "times": ()},
        "people are inside, though it ended before",
    ),
}


@pytest.mark.parametrize("name", EDITS)
def test_refuses_a_row_that_contradicts_itself(name, small, edited, tmp_path):
    """Somebody has edited it; what follows from other columns is computed again."""
    changes, message = EDITS[name]
    run = sweep_run(small)
    if callable(changes.get("times")):
        changes = {"times": changes["times"](run.times)}
    assert edited(tmp_path, *small) == small
    with pytest.raises(InputError, match=rf"runs.csv:2: .*{message}"):
        edited(tmp_path, replace(run, **changes))


def test_refuses_one_run_with_two_results(small, edited, tmp_path):
    """Twice the same is once; the second of two is the one that is refused."""
    assert edited(tmp_path, small[0], small[0]) == [small[0], small[0]]
    other = replace(small[1], seed=small[0].seed)
    with pytest.raises(InputError, match=r"runs.csv:3: .*another row of this run"):
        edited(tmp_path, small[0], other)


def test_refuses_rows_that_do_not_add_up_and_those_of_other_people(small):
    """Somebody has edited one of the files; the row's file is named."""
    path = Path("out/runs.csv")
    folder = Path("out")
    folder.mkdir()
    for row, people in ((replace(small[0], died=5), 4), (small[0], 5)):
        runs.table_of(path, [row])
        with pytest.raises(InputError, match=r"runs.csv:2: .*people do not add up, or"):
            play_evaluation(
                begin_evaluation(**SMALL | {"people": people}), folder, Stopped()
            )
