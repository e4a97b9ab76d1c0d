"""Where code and tests carry each clause, line, equation, table and figure.

Code cites them in brackets, clause first; a class whose docstring begins by citing an
algorithm has its lines' numbers as comments, `# 5`.  Tests are marked
`@pytest.mark.paper("D3", "Eq. 2")`.  Both are found without importing anything.

    key   a clause or a place: "B5", "Alg. 2:13"
"""

import ast
import re
from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path
from typing import NamedTuple

import reference
from reference.paper import InputError
from reference.workshop.annotated.source import (
    PACKAGE,
    Symbol,
    lines_of,
    symbol_at,
    symbols,
    tree_of,
    uncited,
)
from reference.workshop.annotated.words import CLAUSES, KINDS, PLACES, named_in

TESTS = PACKAGE.parent / "tests"
SHORT, LONG = 90, 280  # letters of a reason
COLUMNS = re.compile(r"[^.;\s]  +\S")  # of a table; two blanks may end a sentence

# -- Code ---------------------------------------------------------------------------


class Citation(NamedTuple):
    """A citation in the code: keys it names, kinds it tags, and where it stands."""

    keys: tuple[str, ...]
    kinds: tuple[str, ...]
    path: Path
    line: int
    text: str = ""

    @property
    def symbol(self) -> Symbol:
        """What it stands in."""
        return symbol_at(self.path, self.line)

    @property
    def where(self) -> str:
        """File and line, from the checkout's root."""
        return f"{self.path.relative_to(PACKAGE.parent)}:{self.line}"

    @property
    def source(self) -> str:
        """Its line of the file."""
        return lines_of(self.path)[self.line - 1]

    @property
    def beside_code(self) -> bool:
        """Is it a comment beside code, not a part of a docstring?"""
        code, comment, _ = self.source.partition("  # ")
        return bool(code.strip() and comment)


@cache
def citations() -> tuple[Citation, ...]:
    """All of reference/, in the order of files and lines."""
    return tuple(
        cited for path in sorted(PACKAGE.rglob("*.py")) for cited in _cited(path)
    )


def _cited(path: Path) -> Iterator[Citation]:
    for number, line in enumerate(lines_of(path), 1):
        for cited in re.findall(r"\[([A-F]\d{1,2}\b[^\[\]]*)\]", line):
            parts = re.split(r"[,;:] *", cited)
            clauses = [part for part in parts if re.fullmatch(r"[A-F]\d{1,2}", part)]
            places = [name for name in named_in(cited) if name in PLACES]
            kinds = tuple(kind for kind in KINDS if kind in parts)
            yield Citation((*clauses, *places), kinds, path, number, cited)
    if any("Alg. " in line for line in lines_of(path)):
        yield from _numbered(path)


def _numbered(path: Path) -> Iterator[Citation]:
    """Lines of an algorithm, by the numbers beside its code."""
    for found in symbols(path):
        cited = re.search(r"\[.*(Alg\. \d)\]", found.doc.split("\n")[0])
        for row in range(found.first, found.last + 1) if cited else ():
            comment = re.search(r"  # ([\d, ]+)(?:\D|$)", lines_of(path)[row - 1])
            numbers = re.findall(r"\d+", comment[1]) if comment else ()
            if cited and numbers:
                yield Citation(tuple(f"{cited[1]}:{k}" for k in numbers), (), path, row)


def code_of(key: str) -> list[Citation]:
    """Where the code carries a key: the book and numbered lines first, `paper` last."""
    found = [cited for cited in citations() if key in cited.keys]
    files = [cited.path for cited in found]
    return sorted(
        found, key=lambda c: (_shelf(c.path), bool(c.text), -files.count(c.path))
    )


def _shelf(path: Path) -> int:
    module = ".".join(path.relative_to(PACKAGE).with_suffix("").parts)
    if module == "paper":
        return 2
    return int(not module.startswith(reference.BOOK))


def kinds_of(clause: str) -> list[str]:
    """The kind of a clause, then those that the code tags it with."""
    tagged = {kind for c in citations() if clause in c.keys for kind in c.kinds}
    kind, _ = CLAUSES[clause]
    return [kind, *(each for each in KINDS if each in tagged - {kind})]


def reasons(clause: str, kind: str) -> dict[str, Citation]:
    """What the code says where it tags a clause with a kind; numbers first."""
    tagged = [c for c in citations() if clause in c.keys and kind in c.kinds]
    found: dict[str, Citation] = {}
    for cited in sorted(tagged, key=lambda cited: not cited.symbol.value):
        found.setdefault(_reason(cited), cited)
    return found


def _reason(cited: Citation) -> str:
    """The words around a citation: a comment, or a paragraph of a docstring.

    Of a long paragraph only the sentence that ends with the citation, or the two that
    it begins; after a short first line the next paragraph too; of a table its row.
    """
    bare, mark = cited.source.strip().strip('"'), f"[{cited.text}]"
    first, *others = re.split(r"\n\s*\n", cited.symbol.doc)
    told = next((text for text in (first, *others) if bare in text), None)
    if told is None:
        return uncited(cited.source.split("#", 1)[1]).lstrip(": ")
    if COLUMNS.search(told):
        return uncited(bare)
    if told == first and len(told) < SHORT:
        told = "\n".join([told, *(t for t in others[:1] if not COLUMNS.search(t))])
    marked = uncited(told.replace(bare, bare.replace(mark, "\0", 1)))
    sentences = re.split(r"(?<=[.:]) (?=[A-Z\0\"])", marked)
    k = next(k for k, sentence in enumerate(sentences) if "\0" in sentence)
    if len(told) > LONG or told.startswith("Clause"):
        sentences = sentences[k : k + 1 + sentences[k].startswith("\0")]
    said = re.sub(r" ?\0", "", " ".join(sentences)).strip()
    return re.sub(":$", ": see there.", said)


# -- Tests --------------------------------------------------------------------------


class MarkedTest(NamedTuple):
    """A marked test: what its sentence says, and the keys it is filed under."""

    path: Path
    node: ast.FunctionDef
    keys: frozenset[str]
    marks: tuple[tuple[str, ...], ...]

    @property
    def where(self) -> str:
        """File and line, from the checkout's root."""
        return f"{self.path.relative_to(TESTS.parent)}:{self.node.lineno}"

    @property
    def first(self) -> int:
        """The line of its first mark."""
        return min(mark.lineno for mark in self.node.decorator_list)

    @property
    def title(self) -> str:
        """What the function is called, in words."""
        return self.node.name.removeprefix("test_").replace("_", " ")

    @property
    def sentence(self) -> str:
        """Its docstring in one line."""
        return uncited(ast.get_docstring(self.node) or "")


@cache
def marked_tests() -> tuple[MarkedTest, ...]:
    """All marked tests. Raises InputError where there are none, as in a wheel."""
    found = tuple(
        MarkedTest(path, node, frozenset(key for mark in marks for key in mark), marks)
        for path in sorted(TESTS.rglob("test_*.py"))
        if any(".paper(" in line for line in lines_of(path))
        for node in tree_of(path).body
        if isinstance(node, ast.FunctionDef) and (marks := _marks(node))
    )
    if not found:
        raise InputError(
            "the tests are not here: this is made from the tests too. Run it in a "
            "checkout of the repository, not from an installed wheel."
        )
    return found


def _marks(test: ast.FunctionDef) -> tuple[tuple[str, ...], ...]:
    """What each `pytest.mark.paper` of a test names: its clause, then places."""
    return tuple(
        tuple(key for text in call.args for key in named_in(ast.literal_eval(text)))
        for call in test.decorator_list
        if isinstance(call, ast.Call)
        and ast.unparse(call.func) in ("pytest.mark.paper", "mark.paper")
    )


def marked_with(key: str) -> list[MarkedTest]:
    """The tests filed under a key."""
    return [test for test in marked_tests() if key in test.keys]


def beside(key: str, others: Iterable[str]) -> list[str]:
    """Those of the others that tests name together with a key."""
    marks = [mark for test in marked_with(key) for mark in test.marks if key in mark]
    return [other for other in others if any(other in mark for mark in marks)]


def read_at(setting: str) -> list[str]:
    """Where trainers and trainings read a setting, as file:line."""
    read = re.compile(rf"\b(s|settings|robots|fire|made)\.{setting}\b")
    return [
        f"{path.relative_to(PACKAGE.parent)}:{number}"
        for folder in ("learning", "workshop/training")
        for path in sorted((PACKAGE / folder).glob("*.py"))
        for number, line in enumerate(lines_of(path), 1)
        if read.search(line)
    ]
