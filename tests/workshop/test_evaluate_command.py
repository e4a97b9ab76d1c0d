"""The command evaluate: what it prints and keeps."""

import csv
import json
import signal

import pytest
from trainings import room_for

from reference.__main__ import main
from reference.evaluation import score
from reference.workshop import drawing
from reference.workshop.comparing import runs

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


@pytest.mark.slow
def test_a_folder_holds_runs_tables_a_ruler_and_pictures(tmp_path, capsys):
    """On its ruler the baseline scores 1 on average over the fires."""
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
    own = [c["score"]["mean"] for c in made["cells"]]
    assert sum(own) / len(own) == pytest.approx(1)


@pytest.mark.paper("F4", "Eq. 5")
def test_robots_may_observe_with_errors(capsys):
    """The worst of a few, told in the title; what is resumed keeps them."""
    alone = "--people 1 --fire none --episodes 1 --out eval"
    assert main(f"{SMALL} {alone} --errors 3".split()) == 0
    title = capsys.readouterr().out.splitlines()[0]
    assert title.endswith("1 runs, errors of observation up to 3 m")
    assert main(f"{AGAIN} --errors 1".split()) == 2
    assert "--errors: a resumed run keeps its options" in capsys.readouterr().err


@pytest.mark.slow
def test_a_resumed_evaluation_takes_in_more(tmp_path, capsys, monkeypatch):
    """What is there is not played again; who is named besides is."""
    monkeypatch.setattr(drawing, "save", lambda figure, path: path.touch())
    evaluated(capsys, "--episodes 2 --out eval")
    before = (tmp_path / "eval/runs.csv").read_text()
    assert main(f"{AGAIN} --people 6 --episodes 2 --fire greedy".split()) == 0
    title, heads, random, greedy, note = capsys.readouterr().out.splitlines()
    assert title.endswith("1 robots x 2 fires x 2 seeds from 0 on, 4 runs")
    assert heads.split()[:3] == ["robots", "fire", "runs"]
    assert (random.split()[1], greedy.split()[1]) == ("random", "greedy")
    assert (tmp_path / "eval/runs.csv").read_text().startswith(before)
    assert "the paper's" in note


@pytest.mark.paper("F12")
def test_a_baseline_that_makes_no_ruler_costs_the_score_alone(tmp_path, capsys):
    """The table stands without E, and a sentence says why; so it is for programs."""
    small = "--episodes 1 --baseline sweep"
    facts = evaluated(capsys, f"{small} --out eval")
    assert facts["ruler"] is facts["cells"][0]["score"] is None
    ruler = tmp_path / "eval/ruler.png"
    ruler.touch()  # of a table with other runs
    assert main(f"{AGAIN} --baseline sweep".split()) == 0
    assert not ruler.exists() and (tmp_path / "eval/matrix.png").exists()
    _, heads, _, why = capsys.readouterr().out.splitlines()
    assert "reward R" in heads and "score E" not in heads
    assert "no E, since the runs of sweep calibrate none: 1 runs make no ruler" in why


@pytest.mark.parametrize(
    "command", [f"{SMALL} --out eval", "evacuate --building tiny --density dense.png"]
)
def test_what_was_played_is_told_though_no_picture_can_be_written(command, capsys):
    """The numbers come first; the disk is full when it is a picture's turn."""
    with room_for(5000):
        assert main([*command.split(), "--episodes=1"]) == 1
    said = capsys.readouterr()
    assert "sweep" in said.out
    assert "cannot be written" in said.err.splitlines()[-1]


def test_who_stops_is_told_how_to_go_on(monkeypatch, capsys):
    """On the same ruler."""

    def stopped(_, folder, *rest):
        (folder / "runs.csv").touch()
        signal.raise_signal(signal.SIGINT)
        return []

    monkeypatch.setattr(runs, "evaluate", stopped)
    assert main(f"{SMALL} --out eval --baseline sweep".split()) == 130
    again = capsys.readouterr().err.splitlines()[-1]
    assert again.split()[3:] == [
        "evaluate", "--baseline", "sweep", "--resume", "--out", "eval"
    ]  # fmt: skip
