"""Where code and tests carry each clause, line, equation, table and figure.

Code cites them in brackets, clause first; a class whose docstring begins by citing an
algorithm has its lines' numbers as comments, `# 5`.  Tests are marked
`@pytest.mark.paper("D3", "Eq. 2")`.  Files are parsed, none is imported.

    key   a clause or a place: "B5", "Alg. 2:13"
"""

import ast
import re
from collections.abc import Iterator
from functools import cache
from inspect import cleandoc
from itertools import pairwise
from operator import attrgetter
from pathlib import Path
from textwrap import dedent
from typing import NamedTuple

from reference.paper import InputError
from reference.workshop.annotated.words import CLAUSES, KINDS, TITLES, keys_named_in

PACKAGE = Path(__file__).resolve().parents[2]
ROOT = PACKAGE.parent

Marks = tuple[tuple[str, ...], ...]
SIGNS = re.compile(r"[#.+:EA-DR*,o-z!?_0-9 ]*")  # a row of a board, as in tests/movies

# -- What stands in a file ----------------------------------------------------------


class Symbol(NamedTuple):
    """A module, class, function, assignment or test: where it stands, what it says.

    name   dotted within its file, "" for the module
    marks  what each `pytest.mark.paper` of a test names: its clause, then places
    """

    path: Path
    first: int
    last: int
    name: str
    doc: str
    marks: Marks = ()

    @property
    def title(self) -> str:
        """Its name, or its module's; of a test in words."""
        if self.marks:
            return self.name.removeprefix("test_").replace("_", " ")
        return self.name or self.path.stem.replace("__init__", self.path.parent.name)

    @property
    def where(self) -> str:
        """File and line, from the checkout's root."""
        return f"{self.path.relative_to(ROOT)}:{self.first}"

    @property
    def sentence(self) -> str:
        """The first paragraph of its docstring, without citations."""
        return without_citations(self.doc.split("\n\n")[0])

    @property
    def source(self) -> str:
        """Its lines of the file, without the indentation they share."""
        return dedent("\n".join(lines_of(self.path)[self.first - 1 : self.last]))

    @property
    def keys(self) -> frozenset[str]:
        """All keys that its marks name."""
        return frozenset(key for mark in self.marks for key in mark)


@cache
def lines_of(path: Path) -> list[str]:
    """The lines of a file."""
    return path.read_text(encoding="utf-8").splitlines()


@cache
def symbols(path: Path) -> tuple[Symbol, ...]:
    """All symbols of a file, each before those within it."""
    tree = ast.parse("\n".join(lines_of(path)))
    module = Symbol(path, 1, len(lines_of(path)), "", ast.get_docstring(tree) or "")
    return module, *_within(tree, path, "")


def _within(
    parent: ast.Module | ast.ClassDef, path: Path, prefix: str
) -> Iterator[Symbol]:
    """All symbols of a module or class; a `pytestmark` marks all tests below it."""
    marks: Marks = ()
    nodes = [*parent.body, ast.Pass()]
    for node, after in pairwise(nodes):
        last = node.end_lineno or node.lineno
        if isinstance(node, ast.ClassDef | ast.FunctionDef):
            name = prefix + node.name
            doc = ast.get_docstring(node) or ""
            first = min([node.lineno, *(d.lineno for d in node.decorator_list)])
            shared = marks if node.name.startswith("test_") else ()
            own = _marks(node.decorator_list)
            yield Symbol(path, first, last, name, doc, own + shared)
            if isinstance(node, ast.ClassDef):
                yield from _within(node, path, f"{name}.")
        elif isinstance(node, ast.Assign | ast.AnnAssign):
            target = node.targets[0] if isinstance(node, ast.Assign) else node.target
            name = prefix + ast.unparse(target).strip("()")
            if name == "pytestmark" and node.value:
                marks = _marks([node.value])
            # a string below an assignment is its docstring
            doc = ast.get_docstring(ast.Module([after], [])) or ""
            if doc:
                last = after.end_lineno or last
            yield Symbol(path, node.lineno, last, name, doc)


def _marks(calls: list[ast.expr]) -> Marks:
    return tuple(
        tuple(
            key for text in call.args for key in keys_named_in(ast.literal_eval(text))
        )
        for call in calls
        if isinstance(call, ast.Call) and ast.unparse(call.func) == "pytest.mark.paper"
    )


def find_symbol(dotted: str) -> Symbol:
    """Find the symbol of a dotted name such as "learning.ppo.gae"; else KeyError."""
    parts = dotted.split(".")
    for k in range(len(parts), 0, -1):
        path = PACKAGE.joinpath(*parts[:k]).with_suffix(".py")
        for each in symbols(path) if path.exists() else ():
            if ".".join(parts[k:]) in each.name.split(", "):
                return each
    raise KeyError(f"{dotted} is nowhere in reference/")


def without_citations(text: str) -> str:
    """A text in one line, without citations."""
    bare = re.sub(r"\s*\[[A-F]\d{1,2}\b[^\[\]]*\]", "", text)
    return " ".join(bare.split())


# -- Code ---------------------------------------------------------------------------


class Citation(NamedTuple):
    """A citation in the code: keys and kinds that it names, and where it stands.

    line, text   of its file
    """

    keys: tuple[str, ...]
    kinds: tuple[str, ...]
    symbol: Symbol
    line: int
    text: str

    @property
    def where(self) -> str:
        """File and line, from the checkout's root."""
        return f"{self.symbol.path.relative_to(ROOT)}:{self.line}"

    @property
    def code(self) -> str:
        """The code that a comment stands beside, "" in a docstring."""
        return self.text.partition("  # ")[0].strip() if "  # " in self.text else ""

    @property
    def reason(self) -> str:
        """What is said there: a comment or a paragraph; after a first one, or one that
        ends in a colon, the next, too.
        """
        if self.text.startswith("# --"):  # a heading: the comment below it
            below = lines_of(self.symbol.path)[self.line :]
            return without_citations(" ".join(line.strip("# ") for line in below))
        if "#" in self.text:
            return without_citations(self.text.split("#", 1)[1]).lstrip(": ")
        paragraphs = self.symbol.doc.split("\n\n")
        citing = [self.text.strip(' "') in paragraph for paragraph in paragraphs]
        k = citing.index(True)
        leads_on = k == 0 or paragraphs[k].endswith(":")  # the reason, or a list
        count = 2 if leads_on else 1
        return without_citations(" ".join(paragraphs[k : k + count]))


@cache
def citations() -> tuple[Citation, ...]:
    """All of reference/: the book, the workshop, and the bare numbers last."""
    files = sorted(
        PACKAGE.rglob("*.py"),
        key=lambda path: (path.name == "paper.py", "workshop" in path.parts, path),
    )
    return tuple(cited for path in files for cited in _citations_in(path))


def _citations_in(path: Path) -> Iterator[Citation]:
    for number, line in enumerate(lines_of(path), 1):
        around = [s for s in symbols(path) if s.first <= number <= s.last]

        # in brackets
        for text in re.findall(r"\[([A-F]\d{1,2}\b[^\[\]]*)\]", line):
            keys = [*re.findall(r"\b[A-F]\d{1,2}\b", text), *keys_named_in(text)]
            once = tuple(dict.fromkeys(keys))
            kinds = tuple(k for k in KINDS if k in re.split("[,;:] *", text))
            yield Citation(once, kinds, around[-1], number, line)

        # by the number of an algorithm's line
        heads = " ".join(symbol.doc.split("\n")[0] for symbol in around)
        algorithm = re.search(r"Alg\. \d(?=\])", heads)
        numbers = re.search(r"  # ([\d, ]+)(?:\D|$)", line)
        if algorithm and numbers:
            lines = [f"{algorithm[0]}:{k}" for k in re.findall(r"\d+", numbers[1])]
            yield Citation(tuple(lines), (), around[-1], number, line)


def code_of(key: str) -> list[Citation]:
    """Where the code carries a key."""
    return [cited for cited in citations() if key in cited.keys]


def reasons(clause: str, kind: str) -> list[Citation]:
    """Where the code tags a clause with a kind; of equal reasons the last."""
    tagged = {c.reason: c for c in code_of(clause) if kind in c.kinds}
    return list(tagged.values())


def symbols_of(key: str) -> list[Symbol]:
    """What carries a key, each once."""
    return list(dict.fromkeys(cited.symbol for cited in code_of(key)))


def cited_together(key: str) -> list[str]:
    """The clauses that code cites together with a place; the places with a clause."""
    together = {each for cited in code_of(key) for each in cited.keys}
    others = [each for each in TITLES if (each in CLAUSES) != (key in CLAUSES)]
    return [each for each in others if each in together]


def kinds_of(clause: str) -> list[str]:
    """The kind of a clause, then those that the code tags it with."""
    tagged = {kind for cited in code_of(clause) for kind in cited.kinds}
    kind = CLAUSES[clause]
    return [kind, *(each for each in KINDS if each in tagged - {kind})]


def clauses_with(kind: str) -> list[str]:
    """The clauses that are of a kind, or that the code tags with it."""
    return [clause for clause in CLAUSES if kind in kinds_of(clause)]


# -- Tests --------------------------------------------------------------------------


@cache
def marked_tests() -> tuple[Symbol, ...]:
    """All marked tests. Raises InputError where there are none, as in a wheel."""
    paths = sorted((ROOT / "tests").rglob("test_*.py"))
    tests = tuple(each for path in paths for each in symbols(path) if each.marks)
    if not tests:
        raise InputError(
            "the tests are not here: this is made from the tests too. Run it in a "
            "checkout of the repository, not from an installed wheel."
        )
    return tests


def marked_with(key: str) -> list[Symbol]:
    """The tests filed under a key."""
    return [test for test in marked_tests() if key in test.keys]


def boards_of(test: Symbol) -> list[str]:
    """The boards that a test draws or names, or that a helper does which it names."""
    around = [s for s in symbols(test.path) if s.name and not s.marks]
    words = set(re.findall(r"\w+", test.source))
    helpers = [s for s in around if s.name in words and not s.name.isupper()]
    for helper in helpers:
        constants = re.findall(r"\b[A-Z_]+\b", helper.source)
        words.update(constants)
    named = [s for s in around if s.name in words]
    texts = [text for each in (*named, test) for text in _texts(each)]
    return list(dict.fromkeys(filter(is_board, texts)))


def _texts(of: Symbol) -> list[str]:
    """The strings in a symbol's source, in their order."""
    nodes = [n for n in ast.walk(ast.parse(of.source)) if isinstance(n, ast.Constant)]
    nodes.sort(key=attrgetter("lineno", "col_offset"))
    return [cleandoc(node.value) for node in nodes if isinstance(node.value, str)]


def is_board(text: str) -> bool:
    """Has it floor, and rows of six signs or more, or several rows? Not walls alone."""
    if "." not in text:
        return False
    rows = [row for _, rows in captioned_boards(text) for row in rows]
    long = [row for row in rows if re.search(r"##|\.\.", row) and len(row) > 5]
    return bool(long) or (len(rows) > 2 and any("##" in row for row in rows))


def captioned_boards(board: str) -> list[tuple[str, list[str]]]:
    """The boards of a text: each its caption, if it has one, and its rows.

    A line that is no row parts two: "then", or a film's caption.
    """
    passes: list[tuple[str, list[str]]] = [("", [])]  # before the first caption
    for row in board.split("\n"):
        if SIGNS.fullmatch(row):
            passes[-1][1].append(row)
        else:
            passes.append((row, []))
    return [(caption, rows) for caption, rows in passes if any(rows)]
