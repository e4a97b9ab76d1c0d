"""The book plays where the engine cannot: the same, and said once.

These tests run with numba and without.
"""

import json
from pathlib import Path
from subprocess import PIPE

import pytest
from conftest import ROOT
from processes import ended, python
from trainings import begun, equal, trained

from reference.__main__ import main
from reference.workshop import engine
from reference.workshop.storage.workers import InProcess
from reference.workshop.training.checkpoints import load_checkpoint
from reference.workshop.training.loop import run_training
from reference.workshop.training.rounds import Training

MATCH = "evaluate --building tiny --people 8 --robots sweep --fire random --episodes 4"


@pytest.fixture
def absent(tmp_path):
    """What an environment without numba is like, for workers too."""
    (tmp_path / "absent").mkdir()
    gone = "raise ModuleNotFoundError(\"No module named 'numba'\")"
    (tmp_path / "absent" / "numba.py").write_text(gone)
    return {"PYTHONPATH": f"{tmp_path / 'absent'}:{ROOT}"}


@pytest.mark.parametrize("workers", [0, 2])
def test_without_numba_everything_is_the_same_and_a_note_says_why_it_takes_longer(
    workers, absent, capsys
):
    """The note comes once, not from every worker."""
    words = [*MATCH.split(), "--json", "--workers", str(workers)]
    process = python("-m", "reference", *words, env=absent, stdout=PIPE, stderr=PIPE)
    out, err = ended(process)
    assert main(words) == 0
    assert json.loads(out) == json.loads(capsys.readouterr().out)
    assert err.count("numba is not there (No module named 'numba')") == 1
    assert err.count("the book plays") == 1
    assert "pip install -e '.[fast]'" in err


@pytest.mark.parametrize("why", ["OSError('no LLVM here')", "ImportError('too new')"])
def test_a_numba_that_cannot_be_loaded_is_as_good_as_none(why, tmp_path):
    """It says why it could not."""
    (tmp_path / "numba.py").write_text(f"raise {why}")
    env = {"PYTHONPATH": f"{tmp_path}:{ROOT}"}
    words = [*MATCH.split(), "--workers", "0"]
    process = python("-m", "reference", *words, env=env, stdout=PIPE, stderr=PIPE)
    _, err = ended(process)
    assert process.returncode == 0
    assert f"numba is not there ({eval(why)}): the book plays" in err
    assert "pip install" not in err  # it is installed


def test_numba_may_be_switched_off():
    """By its own variable, as one does to step into what it compiles."""
    pytest.importorskip("numba")
    words = [*MATCH.split(), "--workers", "0"]
    off = {"NUMBA_DISABLE_JIT": "1"}
    process = python("-m", "reference", *words, env=off, stdout=PIPE, stderr=PIPE)
    _, err = ended(process)
    assert process.returncode == 0
    assert "numba is not there (NUMBA_DISABLE_JIT is set): the book plays" in err


def test_a_numba_without_an_option_that_the_engine_needs_is_as_good_as_none():
    """The option is numba's own: a later version may have none."""
    pytest.importorskip("numba")
    words = [*MATCH.split(), "--workers", "0"]
    program = (
        "from numba.core.cpu import CPUTargetOptions\n"
        "for kind in CPUTargetOptions.__mro__:\n"
        "    if '_nrt' in vars(kind):\n"
        "        del kind._nrt\n"
        "from reference.__main__ import main\n"
        f"raise SystemExit(main({words!r}))"
    )
    process = python("-c", program, stdout=PIPE, stderr=PIPE)
    _, err = ended(process)
    assert process.returncode == 0, err
    assert "has no option _nrt): the book plays" in err


@pytest.fixture
def book_alone(monkeypatch):
    """A function: from here on the engine stands aside."""
    return lambda: monkeypatch.setattr(engine, "engine_is_ready", lambda: False)


def test_a_training_begun_with_the_engine_ends_with_the_book(tmp_path, book_alone):
    """The weights, what is written down, and all that goes on: to the last bit."""
    whole = tmp_path / "whole"
    apart = tmp_path / "apart"
    trained(begun(), whole)
    trained(begun(), apart, rounds=2)
    book_alone()
    trained(Training.resumed(load_checkpoint(apart)), apart)
    assert equal(load_checkpoint(apart).learners, load_checkpoint(whole).learners)
    assert equal(load_checkpoint(apart).progress, load_checkpoint(whole).progress)
    summaries = [(at / "summaries.csv").read_bytes() for at in (apart, whole)]
    assert summaries[0] == summaries[1]


def test_a_training_begun_with_the_book_ends_with_the_engine(tmp_path, monkeypatch):
    """Imitation too, which plays evacuations of its own."""
    whole = tmp_path / "whole"
    apart = tmp_path / "apart"
    trained(begun(imitate="patrol"), whole, rounds=3)
    with monkeypatch.context() as patch:
        patch.setattr(engine, "engine_is_ready", lambda: False)
        run_training(begun(imitate="patrol"), apart, InProcess(), lambda: True)
        trained(Training.resumed(load_checkpoint(apart)), apart, rounds=1)
    trained(Training.resumed(load_checkpoint(apart)), apart, rounds=2)
    assert equal(load_checkpoint(apart).learners, load_checkpoint(whole).learners)
    assert equal(load_checkpoint(apart).progress, load_checkpoint(whole).progress)


def test_files_of_an_evaluation_do_not_say_which_played(
    tmp_path, book_alone, in_an_empty_folder
):
    """Runs of the one and of the other lie in one table, which is the same anyway."""
    play = [*MATCH.split(), "--workers", "0"]
    assert main([*play, "--out", "engine"]) == 0
    rows = (tmp_path / "engine" / "runs.csv").read_text().splitlines(keepends=True)
    assert main([*play, "--out", "both"]) == 0
    (tmp_path / "both" / "runs.csv").write_text("".join(rows[:3]))
    book_alone()
    assert main(["evaluate", "--resume", "--out", "both", "--workers", "0"]) == 0
    assert main([*play, "--out", "book"]) == 0
    assert files("engine") == files("both") == files("book")


def files(folder):
    """The names of all files there, and what stands in those that are text."""
    return {
        path.name: path.read_bytes() if path.suffix in (".csv", ".json") else b""
        for path in Path(folder).iterdir()
    }
