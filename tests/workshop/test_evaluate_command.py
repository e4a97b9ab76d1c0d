"""The command evaluate: what it prints and keeps."""

import csv
import json
import re
import signal
from pathlib import Path

import pytest
from trainings import room_for

from reference.__main__ import main
from reference.evaluation import score
from reference.workshop import drawing
from reference.workshop.commands import evaluation
from reference.workshop.comparing import runs
from reference.workshop.storage import progress

pytestmark = pytest.mark.usefixtures("in_an_empty_folder")

SMALL = "evaluate --building tiny --people 6 --workers 0 "
AGAIN = "evaluate --resume --out eval --workers 0 "
FIGURES = ("survival", "reward", "difficulty", "score")


def evaluated(capsys, options):
    """The JSON object of a small evaluation, in this process."""
    assert main(f"{SMALL} --json {options}".split()) == 0
    return json.loads(capsys.readouterr().out)


@pytest.mark.paper("F12")
def test_everybody_meets_everybody_and_every_figure_has_an_interval(capsys):
    """The contract for programs: cells with robots, fire, n and four figures."""
    everybody = "--robots none sweep --fire none random --episodes 3 --seed 7"
    facts = evaluated(capsys, everybody)
    pairs = [(cell["robots"], cell["fire"], cell["n"]) for cell in facts["cells"]]
    assert pairs == [(r, f, 3) for r in ("none", "sweep") for f in ("none", "random")]
    for cell in facts["cells"]:
        for figure in FIGURES:
            found = cell[figure]
            assert found["low"] <= found["mean"] <= found["high"]
            assert all(end == round(end, 6) for end in found.values())
    assert (facts["building"], facts["people"]) == ("tiny", 6)
    assert facts["seeds"] == [7, 8, 9]
    assert facts["ruler"]["beta"] == score.paper_ruler().beta
    assert facts["cells"][0]["difficulty"]["mean"] == 0


def test_a_crowd_that_is_off_the_papers_ruler_has_all_other_pictures(tmp_path, capsys):
    """Its reward may be higher than that ruler reads; without a guide there is none."""
    crowd = "evaluate --robots none --fire none --episodes 1 --people 300 --out eval"
    assert main([*crowd.split(), "--scenario", "time_limit=3"]) == 0
    names = {path.name for path in (tmp_path / "eval").iterdir()}
    assert names == {
        "evaluation.json", "runs.csv", "cells.json",
        "scores.png", "matrix.png", "evacuations.png",
    }  # fmt: skip
    assert "no ruler.png: reward " in capsys.readouterr().err


@pytest.mark.slow
def test_a_folder_holds_runs_tables_a_ruler_and_pictures(tmp_path, capsys):
    """On its ruler the baseline scores 1 over the fires; the paper's ruler stays."""
    crowd = "--people 30 --episodes 12"  # fewer would lose too little to calibrate by
    fires = "--robots none --fire none busiest closer --baseline none"
    made = evaluated(capsys, f"{crowd} {fires} --out eval")
    names = {path.name for path in (tmp_path / "eval").iterdir()}
    assert names == {
        "evaluation.json", "runs.csv", "cells.json",
        "ruler.png", "scores.png", "matrix.png", "evacuations.png",
    }  # fmt: skip
    with (tmp_path / "eval/runs.csv").open(newline="") as file:
        assert len(list(csv.DictReader(file))) == 36
    own = [c["score_on_baseline"]["mean"] for c in made["cells"]]
    assert sum(own) / len(own) == pytest.approx(1)
    assert made["ruler"]["beta"] == score.paper_ruler().beta
    assert made["baseline"]["ruler"]["beta"] != score.paper_ruler().beta
    assert made["baseline"]["how"] == "by its runs"


@pytest.mark.paper("F4", "Eq. 5")
def test_robots_may_observe_with_errors(capsys):
    """The worst of a few, told in the title; what is resumed keeps them."""
    alone = "--people 1 --fire none --episodes 1 --out eval"
    assert main(f"{SMALL} {alone} --errors 3".split()) == 0
    title = capsys.readouterr().out.splitlines()[0]
    assert ", 1 person, errors of observation up to 3 m: 1 robot strategy" in title
    assert main(f"{AGAIN} --errors 1".split()) == 2
    assert "--errors: a resumed run keeps its options" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("options", "told"),
    [
        ("--robots none --errors 3", "no robot observes anything: --errors changes no"),
        ("--robots none sweep --scenario robots_per_floor=0", "0: no robot for sweep"),
    ],
)
def test_what_changes_nothing_is_told(options, told, capsys):
    """Also where robots join an evaluation in which none stand."""
    short = f"{SMALL} --fire none --episodes 1 {options}"
    assert main(short.split()) == 0
    assert told in capsys.readouterr().err
    none = short.replace(" sweep", "")
    assert main(f"{none} --out eval".split()) == 0
    assert main(f"{AGAIN} --robots sweep".split()) == 0
    guides = "robots_per_floor is 0: no robot for sweep" in capsys.readouterr().err
    assert guides == ("robots_per_floor" in options)


@pytest.mark.slow
def test_a_resumed_evaluation_takes_in_more(tmp_path, capsys, monkeypatch):
    """What is there is not played again; who is named besides is."""
    monkeypatch.setattr(drawing, "save", lambda figure, path: path.touch())
    evaluated(capsys, "--episodes 2 --out eval")
    before = (tmp_path / "eval/runs.csv").read_text()
    assert main(f"{AGAIN} --people 6 --episodes 2 --fire greedy".split()) == 0
    title, heads, random, greedy, *notes = capsys.readouterr().out.splitlines()
    assert title.endswith("1 robot strategy, 2 fires, 2 seeds each from 0 on: 4 runs")
    assert heads.split()[:3] == ["robots", "fire", "runs"]
    assert (random.split()[1], greedy.split()[1]) == ("random", "greedy")
    assert (tmp_path / "eval/runs.csv").read_text().startswith(before)
    assert "of those who got out" in notes[1] and "the paper's" in notes[2]


@pytest.mark.paper("F12")
def test_a_baseline_whose_runs_give_no_k_is_measured_by_the_papers(capsys):
    """It scores 1 all the same, and a sentence says why; so it is for programs."""
    facts = evaluated(capsys, "--episodes 1 --baseline sweep --out eval")
    of_one_run = {"mean": 1, "low": None, "high": None}
    assert facts["cells"][0]["score_on_baseline"] == of_one_run
    assert facts["baseline"]["ruler"]["k"] == score.paper_ruler().k
    assert main(f"{AGAIN} --baseline sweep".split()) == 0
    _, heads, *_, which, ruler, exact = capsys.readouterr().out.splitlines()
    assert "score E" in heads and "E, sweep = 1" in heads
    assert which.startswith("E, sweep = 1: as asked, it scores 1 on average")
    assert re.search("k = 0.009, the paper's, as .*at least 6 runs: 1 here", ruler)
    assert exact == "intervals of this E take the ruler as exact"


@pytest.mark.paper("F12")
def test_without_a_baseline_the_best_guide_among_the_robots_is_it(capsys):
    """The heading names it; without guides nothing is said to be 1 here."""
    robots = "--robots none escort sweep random --fire none busiest --episodes 2"
    facts = evaluated(capsys, f"{robots} --people 30")
    mean = {
        robots: [
            c["score_on_baseline"]["mean"]
            for c in facts["cells"]
            if c["robots"] == robots
        ]
        for robots in ("none", "escort", "sweep", "random")
    }
    best = facts["baseline"]["robots"]
    assert sum(mean[best]) / 2 == pytest.approx(1, abs=1e-5)
    assert best == max({*mean} - {"none"}, key=lambda robots: sum(mean[robots]))
    assert all(cell["gain"] is None for cell in facts["cells"])
    assert main(f"{SMALL} --robots none --episodes 1".split()) == 0
    *_, note = capsys.readouterr().out.splitlines()
    assert "no E on a baseline of this building: name a scripted guide" in note


@pytest.mark.parametrize(
    "command", [f"{SMALL} --out eval", "evacuate --building tiny --density dense.png"]
)
def test_what_was_played_is_told_though_no_picture_can_be_written(command, capsys):
    """The disk is full when it is a picture's turn."""
    with room_for(5000):
        assert main([*command.split(), "--episodes=1"]) == 1
    said = capsys.readouterr()
    assert "sweep" in said.out
    assert "cannot be written" in said.err
    resume = "python -m reference evaluate --workers 0 --resume --out eval\n"
    assert said.err.endswith(resume) == ("--out" in command)


@pytest.mark.parametrize("seen", [True, False])
def test_what_is_played_is_told_once_where_all_is_seen(seen, capsys, monkeypatch):
    """Before anything is played; the table in a file has it as its heading."""
    monkeypatch.setattr(evaluation, "one_terminal", lambda: seen)
    played = "1 robot strategy, 1 fire, 2 seeds each from 0 on: 2 runs"
    head = f"Tiny office, 6 people: {played}"
    assert main([*SMALL.split(), "--episodes=2"]) == 0
    out, err = capsys.readouterr()
    assert (out.count(head), err.count(head)) == (not seen, 1)


def test_where_no_bar_is_seen_a_line_tells_what_is_done(capsys, monkeypatch):
    """At most one a minute, and how long the rest takes."""
    monkeypatch.setattr(progress, "SECONDS_BETWEEN", 0.0)
    assert main([*SMALL.split(), "--episodes=2"]) == 0
    told = [line for line in capsys.readouterr().err.splitlines() if "done" in line]
    assert [line.split(",")[:2] for line in told] == [
        ["1 runs", " 50% done"],
        ["2 runs", " 100% done"],
    ]
    assert all(re.search(r"done, \d\d:\d\d left$", line) for line in told)


def test_what_is_kept_is_there_though_nothing_can_be_printed(monkeypatch):
    """Files first: stdout may be a full disk."""

    def full(*_):
        raise OSError("stdout: cannot be written (No space left on device)")

    monkeypatch.setattr(evaluation, "print_report", full)
    assert main(f"{SMALL} --out eval --episodes 1".split()) == 1
    assert Path("eval/cells.json").exists() and Path("eval/matrix.png").exists()


def test_who_stops_is_told_how_to_go_on(monkeypatch, capsys):
    """On the same ruler."""

    def stopped(_, folder, *rest):
        (folder / "runs.csv").touch()
        signal.raise_signal(signal.SIGINT)
        return []

    monkeypatch.setattr(runs, "play_evaluation", stopped)
    assert main(f"{SMALL} --out eval --baseline sweep".split()) == 130
    again = capsys.readouterr().err.splitlines()[-1]
    assert again.split()[3:] == [
        "evaluate", "--baseline", "sweep", "--workers", "0", "--resume", "--out", "eval"
    ]  # fmt: skip
