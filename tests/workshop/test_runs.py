"""Runs in folders: one at a time, and what is told to a second one."""

import ast
import os
import tracemalloc
from subprocess import PIPE

import pytest
from conftest import ROOT
from processes import python

from reference.__main__ import main
from reference.paper import InputError
from reference.workshop.maps import find_map
from reference.workshop.storage import files
from reference.workshop.storage.files import Table, read_table
from reference.workshop.storage.runs import (
    digests_of_code,
    locked,
    refuse_changed,
    remove_left_lock,
)

TINY = ROOT / "tutorials" / "experiments" / "tiny.toml"
HOLDING = """
import sys, time
from pathlib import Path
from reference.workshop.storage.runs import locked

with locked(Path(sys.argv[1]), False, list):
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
        locked(tmp_path / "out", True, list),
        pytest.raises(InputError, match="another run is at work"),
        locked(tmp_path / "out", True, list),
    ):
        pass
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["notes.txt"]


def test_a_lock_that_was_left_can_be_removed_one_that_is_held_cannot(holder, tmp_path):
    """A worker that is ended leaves its training's; another may be at work still."""
    lock = tmp_path / "out" / ".lock"
    remove_left_lock(tmp_path / "out")
    assert lock.exists()
    holder.kill()
    holder.wait()
    remove_left_lock(tmp_path / "out")
    assert not lock.exists()
    remove_left_lock(tmp_path / "out")  # there is none


@pytest.fixture
def part(tmp_path):
    """What a process that was killed in its first write has left in a folder."""
    with files.replacing(tmp_path / "out" / "checkpoint-000000.pt") as part:
        part.touch()
    return (tmp_path / "out" / "checkpoint-000000.pt").rename(part)


@pytest.mark.parametrize("resume", [False, True])
def test_what_was_half_written_by_a_killed_process_is_removed(resume, part):
    """Nobody sees it, and a new run would be refused."""
    with locked(part.parent, resume, list):
        assert [path.name for path in part.parent.iterdir()] == [".lock"]


def test_what_a_killed_worker_was_writing_goes_with_its_lock(part):
    """Of an experiment that was stopped."""
    (part.parent / ".lock").touch()
    remove_left_lock(part.parent)
    assert not [*part.parent.iterdir()]


def test_a_folder_that_somebody_else_made_stays(tmp_path):
    """Also where nothing was written into it; what the run made itself goes."""
    theirs = tmp_path / "theirs"
    ours = tmp_path / "ours"
    theirs.mkdir()
    assert main(["train", "--resume", "--out", str(theirs)]) == 1
    for folder in (theirs, ours):
        with locked(folder, False, list):
            assert folder.is_dir()
    assert theirs.is_dir() and not ours.exists()


def test_refuses_a_used_folder_before_the_run_starts(tmp_path):
    """A start may load networks; and again after it, when somebody has come first."""
    used = tmp_path / "used"
    used.mkdir()
    (used / "notes.txt").touch()

    def never():
        pytest.fail("it started")

    refused = pytest.raises(InputError, match="is not empty")
    with refused, locked(used, False, never):
        pass
    assert [path.name for path in used.iterdir()] == ["notes.txt"]

    new = tmp_path / "new"

    def slow():
        new.mkdir()
        (new / "notes.txt").touch()

    refused = pytest.raises(InputError, match="is not empty")
    with refused, locked(new, False, slow):
        pytest.fail("it went on")


# -- What words mean ----------------------------------------------------------------

MODULES = {
    "mine.py": "import json, random\nfrom kit import paces, nobody\nimport reference",
    "random.py": "",  # found before Python's own
    "kit/__init__.py": "",
    "kit/paces.py": "def walk():\n    from . import maths\n    import other",
    "kit/maths.py": "import mine",  # in a circle
    "kit/unused.py": "",
    "other.py": "this is no Python",
    "reference/__init__.py": "",
}


@pytest.fixture
def own_code(tmp_path):
    """A folder with modules that import each other, in every way."""
    for name, content in MODULES.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(content)
    return tmp_path


def test_code_is_all_modules_that_it_imports_from_its_folder(own_code):
    """Also within functions, by relative names, through others and in circles."""
    found = digests_of_code("mine", own_code / "mine.py")
    kit = {"kit/__init__.py", "kit/paces.py", "kit/maths.py"}
    assert {*found} == {"mine.py", "random.py", "other.py", *kit}
    assert next(iter(found)) == "mine.py"


def test_a_module_of_a_package_is_looked_for_from_where_the_package_lies(own_code):
    """Its package is imported too, and what lies beside it."""
    found = digests_of_code("kit.maths", own_code / "kit" / "maths.py")
    assert next(iter(found)) == "kit/maths.py"
    assert {"kit/__init__.py", "mine.py", "random.py", "kit/paces.py"} < {*found}


def test_code_in_a_package_itself_is_looked_for_from_beside_the_package(own_code):
    """`kit:Guide` stands in `kit/__init__.py`, and needs the modules in `kit`."""
    package = own_code / "kit" / "__init__.py"
    package.write_text("from .paces import walk")
    found = digests_of_code("kit", package)
    assert next(iter(found)) == "kit/__init__.py"
    assert {"kit/paces.py", "kit/maths.py", "mine.py"} < {*found}


def test_code_that_stays_is_parsed_once(own_code, monkeypatch):
    """Every run digests it; a module that has changed is parsed anew."""
    parsed = []
    parse = ast.parse

    def counted(code, *more, **options):
        parsed.append(code)
        return parse(code, *more, **options)

    monkeypatch.setattr(ast, "parse", counted)
    mine = own_code / "mine.py"
    before = digests_of_code("mine", mine)
    parsed.clear()
    assert digests_of_code("mine", mine) == before
    assert not parsed
    mine.write_text("import kit.unused")
    assert "kit/unused.py" in digests_of_code("mine", mine)
    assert b"import kit.unused" in parsed


@pytest.mark.parametrize(
    ("now", "named"),
    [
        ({"net.pt": "c", "a.py": "a"}, "^net.pt has changed since"),
        ({"net.pt": "b", "a.py": "b"}, "^a.py, which net.pt imports, has changed"),
        ({"net.pt": "b"}, "^a.py, which net.pt imports, has changed since"),
        ({"net.pt": "b", "a.py": "a", "c.py": ""}, "^c.py, which net.pt imports"),
    ],
)
def test_refuses_a_file_that_has_changed_by_its_name(now, named):
    """The word's own, one that it needs, one that is gone and one that is new."""
    begun = {"word": {"net.pt": "b", "a.py": "a"}}
    refuse_changed(begun, begun | {"another": {"new.pt": "a"}})
    with pytest.raises(InputError, match=named):
        refuse_changed(begun, {"word": now})


def test_a_training_does_not_go_on_when_its_map_has_changed(
    tmp_path, monkeypatch, capsys
):
    """It goes on without the file, in the drawing that it has kept."""
    monkeypatch.chdir(tmp_path)
    drawing = find_map("tiny").read_text()
    (tmp_path / "office.txt").write_text(drawing)
    train = ["train", "--preset", "tiny", "--building", "office.txt", "--workers", "0"]
    assert main([*train, "--fire", "random", "--out", "out"]) == 0
    again = ["train", "--resume", "--workers", "0", "--out", "out"]
    (tmp_path / "office.txt").write_text(find_map("paper").read_text())
    capsys.readouterr()
    assert main(again) == 1
    assert "office.txt has changed since" in capsys.readouterr().err
    (tmp_path / "office.txt").unlink()
    assert main(again) == 0


# -- Tables -------------------------------------------------------------------------


def test_a_table_of_any_size_is_read_row_by_row(tmp_path):
    """What is still being written at its end is left out."""
    path = tmp_path / "runs.csv"
    row = {"name": "sweep", "times": "9.5 " * 500}
    Table(path, [*row], [row] * 2000)
    with path.open("a") as file:
        file.write("sweep,9.5 ")
    tracemalloc.start()
    try:
        found = read_table(path, [*row], lambda cells: cells == row)
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert found == [True] * 2000
    assert peak < path.stat().st_size / 10


def test_rows_are_on_disk_before_anything_that_is_written_after_them(
    tmp_path, monkeypatch
):
    """Else a checkpoint might outlast the rows of its rounds."""
    table = Table(tmp_path / "runs.csv", ["name"], [])
    sizes = []
    monkeypatch.setattr("os.fsync", lambda file: sizes.append(os.fstat(file).st_size))
    table.append([{"name": "sweep"}])
    assert sizes == [len("name\nsweep\n")]


def test_a_cell_may_be_as_long_as_a_row(tmp_path):
    """Of an evacuation in which ten thousand die, it says where each did."""
    row = {"robots": "sweep", "died": "1:-110.5:-100.5 " * 10_000}
    path = tmp_path / "runs.csv"
    path.write_text(f"robots,died\nsweep,{row['died']}\n")
    assert read_table(path, [*row], dict) == [row]


@pytest.mark.parametrize("end", ["", "\n"])
def test_refuses_a_foreign_file_without_lines(end, tmp_path, monkeypatch):
    """It is not read whole; nor is a row without end."""
    monkeypatch.setattr(files, "LONGEST_LINE", 100)
    path = tmp_path / "runs.csv"
    path.write_text("x" * 1000 + end)
    with pytest.raises(InputError, match="is no table of these runs"):
        read_table(path, ["name"], dict)
    path.write_text("name,times\n" + "x" * 1000 + end)
    with pytest.raises(InputError, match=r"runs\.csv:2: this row is damaged"):
        read_table(path, ["name", "times"], dict)
