"""Tutorials and answers run, and print what stands beneath their prints as `#> `."""

from pathlib import Path
from subprocess import PIPE

import pytest
from conftest import ROOT
from processes import python

TUTORIALS = sorted((ROOT / "tutorials").glob("[0-9][0-9]_*.py"))
ANSWERS = sorted((ROOT / "tutorials" / "answers").glob("*.py"))
QUICK = (
    ("01", "02", "03", "05"),
    ("01", "02", "07", "11"),
)  # the others take over 5 seconds, need an extra or play by the engine
EXTRAS = {"10": "pedpy", "11": "pettingzoo"}
WARNINGS = ("-W", "error", "-W", "default::DeprecationWarning")
"""A library's own use of what another one deprecates is no fault of a tutorial."""

SCRIPTS = [
    pytest.param(
        path,
        marks=() if path.name.startswith(quick) else pytest.mark.slow,
        id="-".join(path.with_suffix("").parts[-2:]),
    )
    for paths, quick in zip((TUTORIALS, ANSWERS), QUICK, strict=True)
    for path in paths
]


def promised(tutorial: Path) -> list[str]:
    """The lines that a tutorial says it prints."""
    lines = map(str.strip, tutorial.read_text(encoding="utf-8").splitlines())
    return [line[2:].removeprefix(" ") for line in lines if line.startswith("#>")]


def printed(tutorial: Path, folder: Path) -> list[str]:
    """The lines that it does print; its pictures go to `out/` in the folder."""
    agg = {"MPLBACKEND": "Agg"}
    process = python(*WARNINGS, tutorial, cwd=folder, env=agg, stdout=PIPE, stderr=PIPE)
    out, err = process.communicate()
    assert process.returncode == 0, err
    return [line.rstrip() for line in out.splitlines()]


@pytest.mark.parametrize("tutorial", TUTORIALS, ids=lambda path: path.stem)
def test_a_tutorial_ends_with_one_exercise(tutorial):
    """And a hint; the folder `answers` has a script of the same name."""
    *_, last = tutorial.read_text(encoding="utf-8").split("# %% ")
    assert last.startswith("Exercise\n")
    assert last.count("# Hint: ") == 1
    assert tutorial.parent / "answers" / tutorial.name in ANSWERS


@pytest.mark.slow
def test_ma_poca_in_one_file_learns_what_ppo_does_not(tmp_path):
    """It prints both curves, and after each where it ends."""
    script = ROOT / "tutorials" / "ma_poca.py"
    first, poca, second, ppo = printed(script, tmp_path)
    assert [poca, ppo] == promised(script)
    assert len(first.split()) == len(second.split()) == 3 + 20


@pytest.mark.parametrize("tutorial", SCRIPTS)
def test_a_tutorial_prints_what_it_says_it_prints(tutorial, tmp_path):
    """A student who runs it sees the lines that stand in it, in their order."""
    extra = EXTRAS.get(tutorial.name[:2])
    if extra:
        pytest.importorskip(extra, reason=f"needs pip install -e '.[{extra}]'")
    assert printed(tutorial, tmp_path) == promised(tutorial) != []


@pytest.mark.parametrize("number", EXTRAS)
def test_without_its_extra_a_tutorial_says_how_to_install_it(number, tmp_path):
    """In one line, without a traceback."""
    (path,) = (path for path in TUTORIALS if path.name.startswith(number))
    extra = EXTRAS[number]
    code = f"import sys, runpy; sys.modules[{extra!r}] = None; "
    code += f"runpy.run_path({str(path)!r})"
    process = python("-c", code, cwd=tmp_path, stdout=PIPE, stderr=PIPE)
    _, err = process.communicate(timeout=120)
    assert process.returncode == 1
    assert err.count("\n") == 1
    assert err.endswith(f"pip install -c constraints.txt -e '.[{extra}]'\n")
    assert extra in path.read_text(encoding="utf-8").partition('"""\n\n')[0]
