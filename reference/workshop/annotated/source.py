"""What stands in a Python file: its symbols, its lines in colour, a test's boards.

Nothing is imported: files are parsed.
"""

import ast
import re
from collections.abc import Iterator, Mapping
from functools import cache
from html import escape
from inspect import cleandoc
from keyword import kwlist
from pathlib import Path
from textwrap import dedent
from typing import NamedTuple

PACKAGE = Path(__file__).resolve().parents[2]

# -- Symbols ------------------------------------------------------------------------


class Symbol(NamedTuple):
    """A module, class, function or assignment: where it stands and what it says.

    name   dotted within its file, "" for the module;  value  what is assigned
    """

    path: Path
    first: int
    last: int
    name: str
    doc: str
    value: str = ""

    @property
    def title(self) -> str:
        """Its name, or its module's."""
        path = self.path
        return self.name or (path.parent.name if path.stem == "__init__" else path.stem)

    @property
    def where(self) -> str:
        """File and line, from the checkout's root."""
        return f"{self.path.relative_to(PACKAGE.parent)}:{self.first}"

    @property
    def sentence(self) -> str:
        """The first sentence of its docstring, without citations."""
        short = re.sub(r"\b(Alg|Eqs?|Tab|Figs?)\. ", r"\1.\0", uncited(self.doc))
        return re.split(r"(?<=[.?]) ", short)[0].replace("\0", " ")


@cache
def lines_of(path: Path) -> list[str]:
    """The lines of a file."""
    return path.read_text(encoding="utf-8").splitlines()


@cache
def tree_of(path: Path) -> ast.Module:
    """A file, parsed."""
    return ast.parse("\n".join(lines_of(path)))


@cache
def symbols(path: Path) -> tuple[Symbol, ...]:
    """All symbols of a file, each before those within it."""
    tree = tree_of(path)
    doc = ast.get_docstring(tree) or ""
    return Symbol(path, 1, len(lines_of(path)), "", doc), *_within(tree, path, "")


def _within(
    parent: ast.Module | ast.ClassDef | ast.FunctionDef, path: Path, prefix: str
) -> Iterator[Symbol]:
    for k, node in enumerate(parent.body, 1):
        last = node.end_lineno or node.lineno
        if isinstance(node, ast.ClassDef | ast.FunctionDef):
            name = f"{prefix}{node.name}"
            first = min([node.lineno, *(d.lineno for d in node.decorator_list)])
            yield Symbol(path, first, last, name, ast.get_docstring(node) or "")
            yield from _within(node, path, f"{name}.")
        elif isinstance(node, ast.Assign | ast.AnnAssign):
            target = node.targets[0] if isinstance(node, ast.Assign) else node.target
            doc = ast.get_docstring(ast.Module(parent.body[k:], [])) or ""
            last = parent.body[k].end_lineno or last if doc else last
            name, value = f"{prefix}{_flat(target)}", _flat(node.value)
            if not isinstance(parent, ast.FunctionDef):
                yield Symbol(path, node.lineno, last, name, doc, value)


def _flat(node: ast.expr | None) -> str:
    """The source of an expression; a tuple without its brackets."""
    parts = node.elts if isinstance(node, ast.Tuple) else [node]
    return ", ".join(ast.unparse(part) for part in parts if part)


def symbol_at(path: Path, line: int) -> Symbol:
    """The innermost symbol around a line."""
    return [s for s in symbols(path) if s.first <= line <= s.last][-1]


def symbol(dotted: str) -> Symbol:
    """Find the symbol of a dotted name such as "learning.ppo.gae"; else KeyError."""
    parts = dotted.split(".")
    for k in range(len(parts), 0, -1):
        path = PACKAGE.joinpath(*parts[:k]).with_suffix(".py")
        for found in symbols(path) if path.exists() else ():
            if ".".join(parts[k:]) in found.name.split(", "):
                return found
    raise KeyError(f"{dotted} is nowhere in reference/")


def uncited(text: str) -> str:
    """A text in one line, without citations."""
    bare = re.sub(r"\s*\[[A-F]\d{1,2}\b[^\[\]]*\]", "", text)
    return " ".join(bare.split())


# -- Colour -------------------------------------------------------------------------

_TOKENS = re.compile(
    r"""(?P<s>[rbf]*(?:\"{3}.*?\"{3}|"(?:\\.|[^"\\\n])*"|'(?:\\.|[^'\\\n])*'))"""
    rf"""|(?P<c>\#[^\n]*)|(?P<n>\b\d[\w.]*)|(?P<k>\b(?:{"|".join(kwlist)})\b)""",
    re.DOTALL,
)


def snippet(path: Path, first: int, last: int) -> str:
    """Lines first to last as HTML, without the indentation they share.

    Keywords are of class k, strings s, numbers n, comments c.
    """
    text = escape(dedent("\n".join(lines_of(path)[first - 1 : last])), quote=False)
    return _TOKENS.sub(lambda found: f"<i class={found.lastgroup}>{found[0]}</i>", text)


# -- Boards -------------------------------------------------------------------------

_SIGNS = set("#.+EABCDR*pqrstuvwxyz \n")


def boards(path: Path, test: ast.FunctionDef) -> list[tuple[str, str]]:
    """Boards that a test draws, each once: "before" or "after", and the rows."""
    known: dict[str, str] = {}
    for given in (*tree_of(path).body, *test.body):
        if isinstance(given, ast.Assign) and (text := _text(given.value, known)):
            known[ast.unparse(given.targets[0])] = text
    found: dict[str, str] = {}
    for statement in test.body:
        when = "after" if isinstance(statement, ast.Assert) else "before"
        for node in ast.walk(statement):
            if isinstance(node, ast.expr) and (text := _text(node, known)):
                board = cleandoc(text)
                if board.count("\n") > 1 and "#" in board and set(board) <= _SIGNS:
                    found.setdefault(board, when)
    return [(when, board) for board, when in found.items()]


def _text(node: ast.expr, known: Mapping[str, str]) -> str | None:
    """The text that an expression is, where that can be told without running it."""
    match node:
        case ast.Constant(value=str(text)):
            return text
        case ast.Name(id=name):
            return known.get(name)
        case ast.Call(func=ast.Attribute(value=base, attr="replace"), args=[old, new]):
            whole, was, now = (_text(each, known) for each in (base, old, new))
            return whole.replace(was, now) if whole and was and now else None
    return None
