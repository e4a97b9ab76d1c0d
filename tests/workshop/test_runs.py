"""Runs in folders: one at a time, and what is told to a second one."""

from subprocess import PIPE

import pytest
from conftest import ROOT
from processes import python

from reference.__main__ import main
from reference.paper import InputError
from reference.workshop.storage.runs import held

TINY = ROOT / "tutorials" / "experiments" / "tiny.toml"
HOLDING = """
import sys, time
from pathlib import Path
from reference.workshop.storage.runs import held

with held(Path(sys.argv[1]), False, list):
    (Path(sys.argv[1]) / "notes.txt").touch()
    print("held", flush=True)
    time.sleep(600)
"""


@pytest.fixture
def holder(tmp_path):
    """Another process that holds the folder `out` in the test's own."""
    with python("-c", HOLDING, str(tmp_path / "out"), stdout=PIPE) as process:
        assert process.stdout.readline() == "held\n"
        yield process
        process.kill()


@pytest.mark.parametrize(
    "command",
    ["train", "train --resume", "evaluate --resume", f"experiment {TINY} --resume"],
)
def test_a_second_run_is_told_that_another_has_the_folder(
    holder, command, tmp_path, capsys
):
    """Two would mix their tables; nothing of the first is touched."""
    (tmp_path / "out" / "notes.txt").unlink()
    out = ["--out", str(tmp_path / "out"), "--workers", "0"]
    assert main([*command.split(), *out]) == 1
    assert "out: another run is at work in it" in capsys.readouterr().err
    assert [path.name for path in (tmp_path / "out").iterdir()] == [".lock"]


def test_a_lock_ends_with_its_process(holder, tmp_path):
    """Also with one that was killed: whoever resumes has the folder."""
    holder.kill()
    holder.wait()
    with (
        held(tmp_path / "out", True, list),
        pytest.raises(InputError, match="another run is at work"),
        held(tmp_path / "out", True, list),
    ):
        pass
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["notes.txt"]


def test_a_folder_that_somebody_else_made_stays(tmp_path):
    """Also where nothing was written into it; what the run made itself goes."""
    theirs, ours = tmp_path / "theirs", tmp_path / "ours"
    theirs.mkdir()
    assert main(["train", "--resume", "--out", str(theirs)]) == 1
    for folder in (theirs, ours):
        with held(folder, False, list):
            assert folder.is_dir()
    assert theirs.is_dir() and not ours.exists()
