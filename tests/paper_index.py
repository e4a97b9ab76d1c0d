"""The index of the paper: clause by clause, and line by line of its algorithms.

Each entry names the code that carries it, the main place first, and the tests that
hold it; a clause's also what kinds of statement it is: its own, and those that the code
tags. `test_house` sees to it that none lacks code or a test.
"""

import ast
import re
import textwrap
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import NamedTuple

import pytest
from clauses import CITATION, CLAUSES, PRINTED, ROOT, citations, kinds_of

from reference import BOOK

WIDTH, INDENT = 96, 10
MANY = 4
"""From so many tests of one file on, their names are told, not their lines."""


class Test(NamedTuple):
    """One test that is marked: its file, line and name."""

    file: str
    line: int
    name: str


def paper_index(items: Iterable[pytest.Item]) -> Iterator[str]:
    """The lines of the index, for the tests in `items`."""
    clauses, printed = _tests(items)
    code, code_of_printed = _code()
    yield "CLAUSES"
    for clause, (_, title) in CLAUSES.items():
        yield from _entry(f"{clause}  {title}", ", ".join(kinds_of(clause)))
        yield from _places("code", code[clause])
        yield from _held_by(clauses[clause])
    yield ""
    yield "ALGORITHMS, EQUATIONS, TABLES AND FIGURES"
    for place, text in PRINTED.items():
        yield from _entry(f"{place}  {text}", "")
        yield from _places("code", code_of_printed[place])
        yield from _held_by(printed[place])


def _tests(
    items: Iterable[pytest.Item],
) -> tuple[dict[str, list[Test]], dict[str, list[Test]]]:
    """By clause, and by printed place; a test with parameters counts once."""
    clauses, printed = defaultdict(list), defaultdict(list)
    for item in items:
        name = getattr(item, "originalname", item.name)
        test = Test(item.path.name, item.location[1] + 1, name)
        for mark in item.iter_markers("paper"):
            found = [(clauses, mark.args[0])]
            found += [(printed, p) for text in mark.args[1:] for p in places_in(text)]
            for index, key in found:
                if test not in index[key]:
                    index[key].append(test)
    return clauses, printed


def _code() -> tuple[dict[str, list[tuple[str, int]]], dict[str, list]]:
    """Files and lines that cite a clause, and that cite a printed place."""
    clauses, printed = defaultdict(list), defaultdict(list)
    for clause, path, line in citations():
        clauses[clause].append((_file(path), line))
    for path in sorted((ROOT / "reference").rglob("*.py")):
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
            for cited in CITATION.findall(line):
                for place in places_in(cited):
                    printed[place].append((_file(path), number))
        for place, number in _numbered(path):
            printed[place].append((_file(path), number))
    return clauses, printed


def _numbered(path: Path) -> Iterator[tuple[str, int]]:
    """Lines of an algorithm: a class that cites it has their numbers as comments."""
    text = path.read_text(encoding="utf-8")
    lines = text.splitlines()
    for node in ast.walk(ast.parse(text)):
        cited = re.search(r"\[.*(Alg\. \d)\]", _first_line(node))
        if isinstance(node, ast.ClassDef) and cited:
            for number in range(node.lineno, (node.end_lineno or 0) + 1):
                comment = re.search(r"  # ([\d, ]+)(?:\D|$)", lines[number - 1])
                for k in re.findall(r"\d+", comment[1] if comment else ""):
                    yield f"{cited[1]}:{k}", number


def _first_line(node: ast.AST) -> str:
    return (ast.get_docstring(node) or "") if isinstance(node, ast.ClassDef) else ""


def _file(path: Path) -> str:
    return str(path.relative_to(ROOT / "reference"))


def places_in(text: str) -> list[str]:
    """The entries of PRINTED that a citation or a mark names.

    "Alg. 2:13-15" are three lines, "Figs. 4-6" three figures, "Alg. 1" is the whole.
    """
    found = []
    for kind, first, last in re.findall(
        r"(Alg\. \d:|Alg\. |Eq\. |Tab\. |Fig\. )([0-9IVX]+)(?:-(\d+))?",
        re.sub(r"\b(Eq|Tab|Fig)s\.", r"\1.", text),
    ):
        numbers = range(int(first), int(last or first) + 1) if first.isdigit() else ()
        found += [f"{kind}{number}" for number in numbers or [first]]
    return [place for place in found if place in PRINTED]


def _entry(title: str, kind: str) -> Iterator[str]:
    yield ""
    yield f"{title:{WIDTH - len(kind)}}{kind}".rstrip()


def _places(what: str, found: list[tuple[str, int]]) -> Iterator[str]:
    """Files with their lines: the book's, most cited first; workshop; `paper` last."""
    counts = Counter(file for file, _ in found)
    files = sorted(counts, key=lambda file: (_shelf(file), -counts[file], file))
    lines = {file: sorted({n for f, n in found if f == file}) for file in files}
    yield from _wrapped(what, [f"{f}:{' '.join(map(str, lines[f]))}" for f in files])


def _shelf(file: str) -> int:
    module = file.removesuffix(".py").removesuffix("/__init__").replace("/", ".")
    if module == "paper":
        return 2
    return int(not any(module.startswith(chapter) for chapter in BOOK))


def _held_by(tests: list[Test]) -> Iterator[str]:
    by_file: dict[str, list[Test]] = defaultdict(list)
    for test in sorted(tests):
        by_file[test.file].append(test)
    few = {f: t for f, t in by_file.items() if len(t) < MANY}
    lines = [f"{f}:{' '.join(str(t.line) for t in few[f])}" for f in few]
    yield from _wrapped("tests", lines)
    for file in [f for f in by_file if f not in few]:
        yield from _wrapped("tests", [f"{file}:"])
        for test in by_file[file]:
            yield " " * (INDENT + 2) + test.name.removeprefix("test_").replace("_", " ")


def _wrapped(what: str, parts: list[str]) -> Iterator[str]:
    """Parts side by side; breaks only at blanks, so no name or number is cut."""
    text = "  ".join(parts)
    if text:
        yield from textwrap.wrap(
            text,
            WIDTH,
            initial_indent=f"    {what:{INDENT - 4}}",
            subsequent_indent=" " * INDENT,
            break_long_words=False,
            break_on_hyphens=False,
        )
