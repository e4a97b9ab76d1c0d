"""The house itself: who imports whom, what is installed, what the README promises."""

import ast
import os
import re
import shutil
import subprocess
import sys
import tokenize
import tomllib
from collections import Counter
from collections.abc import Iterator
from io import StringIO
from pathlib import Path
from textwrap import dedent
from time import sleep

import pytest
from conftest import ROOT, at_most
from paper_index import paper_index

import reference
from reference import BOOK, FRONT_DOOR, READING_ORDER, __version__
from reference.__main__ import main
from reference.workshop.annotated.index import (
    boards_of,
    citations,
    clauses_with,
    kinds_of,
    marked_tests,
    symbols,
)
from reference.workshop.annotated.words import CLAUSES, KINDS, TITLES
from reference.workshop.commands.missing import REQUIRED
from reference.workshop.comparing.named import DESCRIPTIONS

PACKAGE = ROOT / "reference"
MODULES = {
    str(path.relative_to(PACKAGE))
    .removesuffix(".py")
    .removesuffix("/__init__")
    .replace("/", "."): path
    for path in sorted(PACKAGE.rglob("*.py"))
    if path != PACKAGE / "__init__.py"
}
README = (ROOT / "README.md").read_text(encoding="utf-8")
RESULTS = (ROOT / "RESULTS.md").read_text(encoding="utf-8")
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
CONSTRAINTS = (ROOT / "constraints.txt").read_text(encoding="utf-8")


# -- Who imports whom ---------------------------------------------------------------


def imported(path: Path) -> Iterator[str]:
    """Full dotted names of all that a file imports, at its top or inside functions."""
    package = ["reference", *path.relative_to(PACKAGE).parent.parts]
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            above = package[: len(package) + 1 - node.level] if node.level else []
            source = ".".join([*above, *filter(None, [node.module])])
            yield from (f"{source}.{alias.name}" for alias in node.names)


def importers(library: str) -> set[str]:
    """The entries of the reading order that import a library."""
    return {
        in_reading_order(module)
        for module, path in MODULES.items()
        if any(name.split(".")[0] == library for name in imported(path))
    }


def in_reading_order(name: str) -> str:
    """The entry of the reading order that a module, or a name in it, belongs to."""
    parts = name.removeprefix("reference.").split(".")
    prefixes = [".".join(parts[:count]) for count in range(len(parts), 0, -1)]
    return next((prefix for prefix in prefixes if prefix in READING_ORDER), name)


@pytest.mark.parametrize("module", MODULES)
def test_a_module_imports_only_modules_that_stand_before_it(module):
    """Read front to back, no name comes before its meaning; the workshop is last."""
    home = in_reading_order(module)
    for name in imported(MODULES[module]):
        if name.startswith("reference.") and (other := in_reading_order(name)) != home:
            assert READING_ORDER.index(other) < READING_ORDER.index(home), name


def test_every_module_of_the_reading_order_exists():
    """The order is a table of contents, not a plan."""
    assert set(READING_ORDER) == {in_reading_order(module) for module in MODULES}


def test_the_workshop_has_twelve_rooms():
    """A capability each, and none that the reading order does not list."""
    listed, there = (
        {name.split(".")[1] for name in names if name.startswith("workshop.")}
        for names in (READING_ORDER, MODULES)
    )
    assert listed == there and len(there) == 12


@pytest.mark.parametrize(
    ("library", "homes"),
    [
        ("matplotlib", ("workshop.drawing",)),
        ("networkx", ("building", "workshop.maps")),
        ("numba", ("workshop.engine",)),
        ("torch", ("learning", "workshop")),
    ],
)
def test_a_library_is_imported_only_where_it_is_needed(library, homes):
    """Whoever neither draws, nor makes graphs, nor learns does not wait for it."""
    found = importers(library)
    assert found and all(entry.startswith(homes) for entry in found)


MATCH = "--robots none --fire worst-case --episodes 1 --workers 0"


@pytest.mark.parametrize(
    "command",
    [
        "evacuate --building tiny --people 1",
        f"evaluate --building tiny --people 1 {MATCH}",
        "train --help",
    ],
)
def test_torch_is_loaded_by_nothing_that_does_not_learn(command, tmp_path):
    """Not even behind the back, through something else; nor by the environment."""
    unwanted = {"torch", "matplotlib", "pettingzoo", "gymnasium"}
    assert not unwanted & loaded_by(command, tmp_path)


@pytest.mark.parametrize(
    "command",
    [
        "check tiny",
        "floors",
        "draw tiny -o tiny.png",
        "draw tiny --view anchors -o tiny.png",
        "evacuate --building tiny --people 2 --robots sweep --episodes 2",
        "evaluate --help",
        pytest.param("--animate film.html", marks=pytest.mark.slow),
    ],
)
def test_numba_is_loaded_only_where_many_evacuations_are_played(command, tmp_path):
    """Other commands, the first look too, neither load nor compile anything."""
    assert not {"numba", "llvmlite"} & loaded_by(command, tmp_path)


def loaded_by(command, folder):
    """All modules that a command loads."""
    code = (
        "import sys, reference.game.environment; from reference.__main__ import main\n"
        "try: status = main(sys.argv[1:])\n"
        "except SystemExit as end: status = end.code\n"
        "print(f'status {status}', *sys.modules)"
    )
    done = subprocess.check_output(
        [sys.executable, "-c", code, *command.split()],
        env=os.environ | {"PYTHONPATH": str(ROOT)},
        cwd=folder,
        text=True,
    )
    loaded = done.splitlines()[-1].removeprefix("status 0 ").split()
    assert loaded[0] == "sys"
    return set(loaded)


def test_what_pip_installs_is_missed_by_its_name():
    """Whoever lacks one of these is told how to get it."""
    names = [re.match(r"\w+", name)[0] for name in PROJECT["project"]["dependencies"]]
    assert [*REQUIRED] == [name.lower() for name in names]


def test_nothing_is_imported_that_is_not_declared():
    """What pip installs for us is enough: no library by accident."""
    declared = {
        re.match(r"\w+", name)[0].lower() for name in PROJECT["project"]["dependencies"]
    }
    extras = PROJECT["project"]["optional-dependencies"]
    for extra in ("fast", "pettingzoo", "yaml", "cluster"):
        declared |= {re.match(r"\w+", name)[0] for name in extras[extra]}
    declared |= {"PIL", "yaml"}  # matplotlib's own, and PyYAML's other name
    names = {name.split(".")[0] for path in MODULES.values() for name in imported(path)}
    assert names - set(sys.stdlib_module_names) - {"reference"} <= declared


def test_the_front_door_knows_five_names():
    """They are a contract; nothing of them is imported before it is asked for."""
    assert [*FRONT_DOOR] == ["load", "Scenario", "Simulation", "draw", "animate"]
    assert sorted(FRONT_DOOR) == reference.__all__
    assert {*FRONT_DOOR} < {*dir(reference)}
    code = "import sys, reference; print(*{'numpy', 'networkx'} & set(sys.modules))"
    assert subprocess.check_output([sys.executable, "-c", code], cwd=ROOT) == b"\n"
    for name in FRONT_DOOR:
        assert getattr(reference, name).__name__ == name


def test_the_package_leads_from_a_maps_text_to_a_picture(tmp_path, monkeypatch, capsys):
    """The lines at its head, which are the README's, do what they say."""
    monkeypatch.chdir(tmp_path)
    lines = re.search(r"picture:\n\n(.+?)\n\n`load`", reference.__doc__, re.DOTALL)[1]
    lines = dedent(lines)
    assert blocks("python") == [lines.replace("'''", '"""') + "\n"]
    names = {}
    exec(lines, names)
    assert capsys.readouterr().out == "4 of 4 got out\n"
    assert (tmp_path / "hut.png").read_bytes().startswith(b"\x89PNG")
    assert names["simulation"].world.robots and names["simulation"].world.flames.sources


# -- How much, and how dense --------------------------------------------------------


def in_workshop(path: Path) -> bool:
    """Whether a module belongs to the workshop, as the command line does."""
    first = path.relative_to(PACKAGE).parts[0]
    return first in ("workshop", "__main__.py")


WORKSHOP = [path for path in MODULES.values() if in_workshop(path)]
PARTS = {
    "book": sorted({*PACKAGE.rglob("*.py")} - {*WORKSHOP}),
    "workshop": WORKSHOP,
    "tests": sorted((ROOT / "tests").rglob("*.py")),
    "tutorials": sorted((ROOT / "tutorials").rglob("*.py")),
}
MOST_TOKENS = 37_400
"""Of the book without `paper`: whoever moves a number there pays nothing for it."""

LAYOUT = {
    tokenize.COMMENT,
    tokenize.NL,
    tokenize.NEWLINE,
    tokenize.INDENT,
    tokenize.DEDENT,
    tokenize.ENDMARKER,
}


def tokens(path: Path) -> int:
    """Count the tokens of a file, without comments, docstrings and layout."""
    text = path.read_text(encoding="utf-8")
    docstrings = {
        (node.lineno, node.col_offset)
        for node in ast.walk(ast.parse(text))
        if isinstance(node, ast.Expr)
        and isinstance(node.value, ast.Constant)
        and isinstance(node.value.value, str)
    }
    found = tokenize.generate_tokens(StringIO(text).readline)
    return sum(t.type not in LAYOUT and t.start not in docstrings for t in found)


def names_in(node: ast.AST) -> frozenset[str]:
    """The names that stand in an expression."""
    return frozenset(n.id for n in ast.walk(node) if isinstance(n, ast.Name))


def is_packed(node: ast.AST) -> bool:
    """Does an assignment take several things, not one apart: `a, b = x, y`?"""
    if not isinstance(node, ast.Assign) or not isinstance(node.value, ast.Tuple):
        return False
    roots = {names_in(each) for each in node.value.elts} - {frozenset()}
    return isinstance(node.targets[0], ast.Tuple) and len(roots) > 1


@pytest.mark.parametrize("part", PARTS)
def test_a_line_assigns_one_thing(part, record_property):
    """Or takes one thing apart: `x, y = position`, `low, high = -limit, limit`."""
    packed = []
    lines = expressions = statements = 0
    for path in PARTS[part]:
        text = path.read_text(encoding="utf-8")
        lines += sum(bool(line.strip()) for line in text.splitlines())
        for node in ast.walk(ast.parse(text)):
            expressions += isinstance(node, ast.expr)
            statements += isinstance(node, ast.stmt)
            if is_packed(node):
                packed.append(f"{path.name}:{node.lineno}")
    facts = (
        f"{sum(map(tokens, PARTS[part])):,} tokens, "
        f"{expressions / statements:.2f} expressions a statement, "
        f"{len(packed)} packed assignments in {lines:,} lines"
    )
    record_property(part, facts)
    allowed = 0 if part == "book" else 5 * lines / 1000
    assert len(packed) <= allowed, packed


def test_the_book_is_no_longer_than_it_has_to_be():
    """Only the book has a limit; nothing else, and no lines, are counted."""
    counted = [path for path in PARTS["book"] if path.name != "paper.py"]
    assert sum(map(tokens, counted)) <= MOST_TOKENS


def test_numbers_of_the_paper_are_read_where_they_are_used():
    """`paper.SIGHT`, not SIGHT: whoever changes it is heard by every module."""
    for module, path in MODULES.items():
        for name in imported(path):
            is_number = re.fullmatch(r"reference\.paper\.[A-Z][A-Z\d_]*", name)
            assert not is_number, f"{module} imports {name}"


def public_names(path: Path) -> set[str]:
    """What a module defines at its top: functions, classes, constants, kinds."""
    found = set[str]()
    for node in ast.parse(path.read_text(encoding="utf-8")).body:
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            found.add(node.name)
        elif isinstance(node, ast.Assign | ast.AnnAssign):
            targets = node.targets if isinstance(node, ast.Assign) else [node.target]
            parts = [part for target in targets for part in ast.walk(target)]
            found |= {part.id for part in parts if isinstance(part, ast.Name)}
    return {name for name in found if not name.startswith("_")}


def test_a_public_name_is_one_thing():
    """At most ten stand in several modules; `engine` mirrors the book on purpose."""
    modules = Counter(
        name
        for module, path in MODULES.items()
        if not module.startswith("workshop.engine")
        for name in public_names(path)
    )
    shared = sorted(name for name, count in modules.items() if count > 1)
    assert len(shared) <= 10, shared


# -- Code, clauses and tests --------------------------------------------------------


CITED = {
    (key, cited.symbol.path)
    for cited in citations()
    for key in cited.keys
    if re.fullmatch(r"[A-F]\d+", key)
}
"""Clauses that the code cites, each with the file."""


def test_every_clause_cited_in_the_code_is_marked_in_a_test():
    """Nothing of the paper is claimed that no test holds."""
    marked = {key for test in marked_tests() for key in test.keys}
    assert {
        (clause, path.name) for clause, path in CITED if clause not in marked
    } == set()


def test_every_clause_is_cited_in_the_code_and_not_by_a_number_alone():
    """No statement of the paper is left out; the numbers stand in `paper`."""
    assert {clause for clause, path in CITED if path.name != "paper.py"} == set(CLAUSES)


def test_no_module_lists_clauses_at_its_head():
    """The index finds them by the brackets, beside the code that carries them."""
    for module, path in MODULES.items():
        assert not re.search(r"\bClauses?: [A-F]\d", path.read_text("utf-8")), module


def test_what_ml_agents_computes_is_cited_with_its_module():
    """So that one can look it up; a bare E3 says nothing."""
    named = r"\[E3, (([a-z_]+/)?[a-z_]+\.py|chosen|deviation)\b"
    for path in sorted({path for clause, path in CITED if clause == "E3"}):
        for found in re.findall(r"\[E3[^]]*", path.read_text("utf-8")):
            assert re.match(named, found), f"{path.name}: {found}"


def test_every_citation_and_every_mark_names_a_real_clause():
    """A slip such as C9 or B12 is found here."""
    assert {clause for clause, _ in CITED} <= set(CLAUSES)
    for test in marked_tests():
        assert all(mark and mark[0] in CLAUSES for mark in test.marks), test.where


def test_the_index_tells_the_kinds_that_the_code_tags():
    """A clause may be stated, and what we do about it a deviation or chosen."""
    assert set(CLAUSES.values()) <= set(KINDS)
    assert kinds_of("A4") == ["stated"]
    assert kinds_of("A3") == ["stated", "deviation", "chosen"]
    assert " ".join(clauses_with("deviation")) == "A3 A5 B5 B6 C4 D2 D6 E3 E4"
    index = {line[:2]: line.split("  ")[-1].strip() for line in paper_index()}
    assert (index["A5"], index["C8"]) == ("stated, deviation", "chosen")


def test_the_index_fits_into_eighty_columns():
    """A terminal's width."""
    assert max(map(len, paper_index())) <= 80


def test_every_test_says_in_a_sentence_what_it_shows():
    """The tests are read as the specification."""
    for path in sorted((ROOT / "tests").rglob("test_*.py")):
        for symbol in symbols(path):
            if symbol.name.startswith("test_"):
                assert symbol.doc.endswith("."), symbol.where


SPECIFICATION = {
    path: ast.parse(path.read_text(encoding="utf-8"))
    for path in sorted((ROOT / "tests" / "paper").glob("test_*.py"))
}


def test_a_test_of_a_line_begins_with_the_line_in_our_words():
    """Of several lines with the last one: "Alg. 2:16-17: return to the door ..."."""
    marks = [
        ast.literal_eval(text)
        for tree in SPECIFICATION.values()
        for call in ast.walk(tree)
        if isinstance(call, ast.Call) and ast.unparse(call.func) == "pytest.mark.paper"
        for text in call.args
    ]
    lines = [mark for mark in marks if re.match(r"Alg\. \d:", mark)]
    for mark in lines:
        place = re.match(r"(Alg\. \d:)(?:\d+-)?(\d+)", mark)
        assert mark.endswith(f": {TITLES[place[1] + place[2]].rstrip(':')}"), mark
    assert len(lines) > 40


def test_most_of_the_specification_is_drawn():
    """A rule is a picture before and a picture after."""
    tests = [test for path in SPECIFICATION for test in symbols(path)]
    boards = [t for t in tests if t.name.startswith("test_") and boards_of(t)]
    assert len(boards) >= 120


def test_the_specification_knows_no_private_name():
    """What a test has to say beforehand is drawn, or said in words of the scene."""
    for path, tree in SPECIFICATION.items():
        names = {n.attr for n in ast.walk(tree) if isinstance(n, ast.Attribute)}
        names |= {n.name for n in ast.walk(tree) if isinstance(n, ast.FunctionDef)}
        assert not {n for n in names if re.match("_[a-z]", n)}, path.name


# -- What is installed --------------------------------------------------------------


def test_the_version_is_the_same_wherever_it_stands():
    """In the package, in pyproject.toml and in CITATION.cff."""
    citation = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert PROJECT["project"]["version"] == __version__
    assert f"\nversion: {__version__}\n" in citation


def test_every_dependency_has_a_version_among_the_constraints():
    """The figures of the README can be made again with the same versions."""
    project = PROJECT["project"]
    needed = sum(project["optional-dependencies"].values(), project["dependencies"])
    for requirement in needed:
        name = re.match(r"[\w-]+", requirement)[0]
        assert re.search(rf"^{name}==\d", CONSTRAINTS, re.MULTILINE), name


def test_an_installed_wheel_finds_its_floors(tmp_path):
    """Laid out as pyproject.toml says, far from any checkout, it checks `paper`."""
    wheel = PROJECT["tool"]["hatch"]["build"]["targets"]["wheel"]
    for folder in wheel["only-include"]:
        shutil.copytree(ROOT / folder, tmp_path / wheel["sources"].get(folder, folder))
    command = [sys.executable, "-m", "reference", "check", "paper"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    assert done.stdout.startswith("ok: "), done.stderr


def test_the_console_script_is_the_command_line():
    """`fire-rescue` does what `python -m reference` does."""
    assert PROJECT["project"]["scripts"] == {
        "fire-rescue": "reference.workshop:command_line"
    }
    code = "from reference.workshop import command_line; command_line()"
    command = [sys.executable, "-c", code, "--version"]
    told = subprocess.check_output(command, cwd=ROOT, text=True)
    assert told == f"fire-rescue-reference {__version__}\n"


# -- What the README promises -------------------------------------------------------


def blocks(language: str) -> list[str]:
    """The fenced blocks of the README in one language."""
    fenced = re.findall(r"^```(\w*)\n(.*?)^```$", README, re.DOTALL | re.MULTILINE)
    return [text for named, text in fenced if named == language]


def rows(header: str) -> str:
    """The table with this header, without it."""
    return README.split(f"| {header} |", 1)[1].split("\n\n", 1)[0]


def table(header: str) -> list[str]:
    """What stands as code in the first column of the table with this header."""
    return re.findall(r"^\| `([^`]+)`", rows(header), re.MULTILINE)


def test_the_readme_begins_with_two_commands_that_do_it_all():
    """Set up with the pinned versions, then test; `.ci/run` calls these very lines."""
    set_up, test = blocks("sh")[0].splitlines()
    assert set_up.endswith("pip install -c constraints.txt -e '.[test,fast]'")
    assert test == ".venv/bin/python -m pytest -n auto"


def test_the_readme_names_chapters_and_rooms_in_reading_order():
    """What each module does stands once, in `reference/__init__.py`."""
    chapters = re.findall(r"`([^`]+)`", rows("chapter | modules"))
    assert chapters == [name.rpartition(".")[2] for name in BOOK]
    inner = [name.split(".")[1] for name in READING_ORDER if name[:9] == "workshop."]
    assert table("room | what you find there") == list(dict.fromkeys(inner))


def test_the_readme_says_what_everybody_in_its_table_of_results_does():
    """In the words of the docstrings, which `strategies` prints."""
    said = dict(re.findall(r"^\* `(\S+)`: (.+)$", README, re.MULTILINE))
    heads = re.search(r"^\| (robots .*) \|$", README, re.MULTILINE)[1]
    robots = table(heads)
    fires = ["random", *re.findall(r"`(\w+)`", heads)]
    about = [DESCRIPTIONS["robots"][word] for word in robots]
    assert [*said] == [*robots, *dict.fromkeys(fires)]
    assert [*said.values()] == about + [DESCRIPTIONS["fire"][word] for word in fires]


def test_the_map_in_the_readme_is_a_map(tmp_path):
    """Whoever copies it from there and runs `check` is told that it is fine."""
    path = tmp_path / "tiny.txt"
    path.write_text(next(text for text in blocks("") if "building:" in text))
    assert main(["check", str(path)]) == 0


TYPED = """from reference.learning.adversarial import adversarial_rounds
from reference.learning.ppo import Learner
from reference.learning.settings import Side
from reference.paper import Scenario
from reference.workshop.comparing import begin_evaluation
from reference.workshop.drawing import save
from reference.workshop.maps import MistakesError
from reference.workshop.strategies import Sweep
from reference.workshop.zoo import FlatEnvironment

learners: dict[Side, Learner] = {}
rounds = adversarial_rounds("", Scenario(), learners, [])
seen, *_ = FlatEnvironment("tiny").step({})
print(seen["fire_0"].shape, begin_evaluation, save, MistakesError, Sweep)
"""


@pytest.mark.slow
@pytest.mark.extra
@pytest.mark.parametrize("lines", [blocks("python")[0], TYPED], ids=["readme", "rooms"])
def test_mypy_is_content_with_who_uses_the_package(lines, tmp_path):
    """In its strict mode: what is imported is exported, and has the types it says."""
    pytest.importorskip("mypy", reason="mypy is not installed: pip install -e '.[dev]'")
    (tmp_path / "mine.py").write_text(lines)
    done = subprocess.run(
        [sys.executable, "-m", "mypy", "--strict", "mine.py"],
        env=os.environ | {"PYTHONPATH": str(ROOT)},
        cwd=tmp_path,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stdout + done.stderr


def test_the_readme_names_no_file_that_is_missing():
    """Its links and the paths it mentions lead somewhere."""
    named = re.findall(
        r"\]\((?!http)([^)#]+)\)|`((?:[\w.]+/)+[\w.]*|\w+\.(?:md|cff|txt))`",
        README + RESULTS,
    )
    made = ("out/", ".venv/")
    for name in {link or path for link, path in named}:
        assert name.startswith(made) or (ROOT / name).exists(), name


def seconds(script: Path) -> str:
    """How long a tutorial or an answer takes, as its docstring says."""
    said = re.search(r"It\s+takes\s+(a|\d+)\s+seconds?", script.read_text("utf-8"))
    return said[1].replace("a", "1")


def test_the_tutorials_readme_lists_them_with_their_times():
    """In their order, each with its answer."""
    folder = ROOT / "tutorials"
    listed = re.findall(
        r"^\| .*\[.+\]\((\w+\.py)\) \| .+ \| (\d+) s \| "
        r"\[answer\]\(answers/(\w+\.py)\), (\d+) s \|$",
        (folder / "README.md").read_text(encoding="utf-8"),
        re.MULTILINE,
    )
    names = [path.name for path in sorted(folder.glob("*.py"))]
    assert listed == [
        (name, seconds(folder / name), name, seconds(folder / "answers" / name))
        for name in names
    ]


def test_the_tutorials_readme_lists_the_experiments():
    """Every file to change and to run for longer."""
    text = (ROOT / "tutorials" / "README.md").read_text(encoding="utf-8")
    listed = re.findall(r"^\| `(\w+\.\w+)` \|", text, re.MULTILINE)
    there = (ROOT / "tutorials" / "experiments").glob("*.*")
    assert sorted(listed) == sorted(path.name for path in there)


def test_a_test_that_hangs_fails():
    """Each has a limit of time, its fixtures too."""
    late = pytest.raises(pytest.fail.Exception, match=r"not done after 0\.05 s")
    with late, at_most(0.05):
        sleep(60)


def test_a_limit_within_another_leaves_it():
    """The outer one goes on when the inner one has ended."""
    late = pytest.raises(pytest.fail.Exception, match=r"not done after 0\.05 s")
    with late, at_most(0.05):
        with at_most(60):
            pass
        sleep(1)
