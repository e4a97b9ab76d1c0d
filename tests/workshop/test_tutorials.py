"""Tutorials and answers run, and print what stands beneath their prints as `#> `."""

import re
from importlib.util import find_spec
from pathlib import Path
from subprocess import PIPE

import pytest
from conftest import ROOT
from processes import ended, python
from refusals import refusal

TUTORIALS = sorted((ROOT / "tutorials").glob("[0-9][0-9]_*.py"))
ANSWERS = sorted((ROOT / "tutorials" / "answers").glob("*.py"))
QUICK = (
    ("01", "02", "03", "05"),
    ("01", "02", "07", "11"),
)  # the others take over 5 seconds, need an extra or play by the engine
EXTRAS = {"10": "pedpy", "11": "pettingzoo"}
SB3 = ROOT / "tutorials" / "experiments" / "sb3_robots.py"
LIBRARIES = {
    "pedpy": "import pedpy",
    "pettingzoo": "workshop.zoo import",
    "stable_baselines3": "from stable_baselines3",
}
"""What is not installed by default, and how code asks for it."""
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
    out, err = ended(process)
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
    for line, name in ((first, "MAPOCA"), (second, "PPO")):
        whose, numbers = line.split(": ")
        assert whose == f"{name}, what an episode earns, update by update"
        assert len(numbers.split()) == 20


@pytest.mark.parametrize("tutorial", SCRIPTS)
def test_a_tutorial_prints_what_it_says_it_prints(tutorial, tmp_path):
    """A student who runs it sees the lines that stand in it, in their order."""
    extra = EXTRAS.get(tutorial.name[:2])
    if extra:
        pytest.importorskip(extra, reason=f"needs pip install -e '.[{extra}]'")
    assert printed(tutorial, tmp_path) == promised(tutorial) != []


CODE = {path: path.read_text(encoding="utf-8") for path in (*TUTORIALS, *ANSWERS)}
CODE |= {SB3: SB3.read_text(encoding="utf-8")}
NEEDS = [
    (path, library)
    for path, code in CODE.items()
    for library, said in LIBRARIES.items()
    if said in code
]


@pytest.mark.parametrize(("path", "library"), NEEDS, ids=lambda each: str(each)[-30:])
def test_without_its_extra_a_script_says_how_to_install_it(path, library, tmp_path):
    """In one line, without a traceback; a tutorial's head says so, too."""
    code = f"import sys, runpy; sys.modules[{library!r}] = None; "
    code += f"runpy.run_path({str(path)!r}, run_name='__main__')"
    process = python("-c", code, cwd=tmp_path, stdout=PIPE, stderr=PIPE)
    _, err = ended(process)
    assert process.returncode == 1
    assert err.count("\n") == 1
    install = err.partition(": ")[2].strip()
    assert install.startswith(".venv/bin/pip install ")
    assert install in CODE[path].partition('"""\n\n')[0] or path in ANSWERS


def test_two_tutorials_an_answer_and_an_experiment_need_an_extra():
    """No others import one without a word."""
    found = {str(path.relative_to(ROOT / "tutorials")) for path, _ in NEEDS}
    assert found == {
        "10_measure_a_crowd.py",
        "11_your_own_learner.py",
        "answers/11_your_own_learner.py",
        "experiments/sb3_robots.py",
    }


def test_robots_of_another_library_are_to_be_trained_before_they_play(
    tmp_path, monkeypatch, capsys
):
    """The message names the command; one without the library how to install it."""
    monkeypatch.chdir(tmp_path)
    Path("sb3_robots.py").write_text(CODE[SB3])
    match = ["evaluate", "--fire", "none", "--robots", "sb3_robots:Guide"]
    status, said = refusal(capsys, *match, "--workers", "0")
    assert status == 1 and said.count("\n") == 1
    there = all(map(find_spec, ("stable_baselines3", "supersuit", "pettingzoo")))
    assert ("train it first" if there else "pip install") in said


# -- What makes a course ------------------------------------------------------------


def table_below(heading: str) -> list[list[str]]:
    """The cells of the first table below a heading of the tutorials' README."""
    readme = (ROOT / "tutorials" / "README.md").read_text(encoding="utf-8")
    _, _, after = readme.partition(heading)
    rows = after[after.index("|") :].partition("\n\n")[0].splitlines()
    return [[cell.strip() for cell in row.strip("|").split("|")] for row in rows[2:]]


def minutes_to_read(path: Path) -> float:
    """At a hundred words a minute, as the README says."""
    return len(CODE.get(path, path.read_text(encoding="utf-8")).split()) / 100


def test_the_course_of_90_minutes_takes_90():
    """Each tutorial in it can be read in its time."""
    rows = table_below("### 90 minutes")
    assert sum(int(minutes) for minutes, _ in rows) == 90
    named = 0
    for minutes, what in rows:
        for number in re.findall(r"[Tt]utorial (\d+)", what):
            (path,) = (p for p in TUTORIALS if p.name.startswith(f"{int(number):02}"))
            assert minutes_to_read(path) <= int(minutes)
            named += 1
    assert named >= 4


def test_the_week_has_every_tutorial_once():
    """Its hours are those of reading, and twenty minutes for each exercise."""
    days = [what for _, what, _ in table_below("### A week")]
    numbers = [int(n) for what in days for n in re.findall(r"\b\d+\b", what)]
    assert sorted(numbers) == [*range(1, len(TUTORIALS) + 1)]
    for (_, what, hours), day in zip(table_below("### A week"), days, strict=True):
        files = [TUTORIALS[int(n) - 1] for n in re.findall(r"\b\d+\b", day)]
        if "ma_poca" in what:
            files.append(ROOT / "tutorials" / "ma_poca.py")
        minutes = sum(map(minutes_to_read, files)) + 20 * len(files)
        assert minutes / 60 == pytest.approx(float(hours.split()[0]), abs=0.3)
