"""What stands in a Python file: its symbols, its lines in colour, a test's boards.

Nothing is imported: files are parsed.
"""

import ast
import io
import keyword
import re
import tokenize
from collections.abc import Iterator, Mapping
from contextlib import suppress
from functools import cache
from html import escape
from inspect import cleandoc
from pathlib import Path
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

_STRINGS = ("STRING", "FSTRING_START", "FSTRING_MIDDLE", "FSTRING_END")
_INK = {getattr(tokenize, name, None): "s" for name in _STRINGS} | {
    tokenize.NUMBER: "n",
    tokenize.COMMENT: "c",
}


@cache
def coloured(path: Path) -> list[str]:
    """The lines of a file as HTML: keywords k, strings s, numbers n, comments c."""
    lines = lines_of(path)
    html, done = [""] * len(lines), [0] * len(lines)  # done: columns that are written
    source = io.StringIO("\n".join(lines) + "\n")
    for token in tokenize.generate_tokens(source.readline):
        ink = "k" if keyword.iskeyword(token.string) else _INK.get(token.type)
        (first, start), (last, end) = token.start, token.end
        for row in range(first - 1, last) if ink else ():
            a = start if row == first - 1 else 0
            b = end if row == last - 1 else len(lines[row])
            html[row] += escape(lines[row][done[row] : a], quote=False)
            html[row] += f"<i class={ink}>{escape(lines[row][a:b], quote=False)}</i>"
            done[row] = b
    return [
        h + escape(line[d:], quote=False)
        for h, line, d in zip(html, lines, done, strict=True)
    ]


def snippet(path: Path, first: int, last: int) -> str:
    """Lines first to last in colour, without the indentation they share."""
    lines = lines_of(path)[first - 1 : last]
    indent = min(len(line) - len(line.lstrip()) for line in lines if line.strip())
    margin = re.compile(rf"^(<i class=\w>)? {{{indent}}}")
    return "\n".join(
        margin.sub(r"\1", line).rstrip() for line in coloured(path)[first - 1 : last]
    )


# -- Boards -------------------------------------------------------------------------

_SIGNS = set("#.+EABCDR*pqrstuvwxyz \n")


def boards(path: Path, test: ast.FunctionDef) -> list[tuple[str, str]]:
    """Boards that a test draws, each once: "before" or "after", and the rows."""
    known = dict(_texts(tree_of(path).body)) | dict(_first_case(test))
    known |= dict(_texts(test.body, known))
    found: dict[str, str] = {}
    for statement in test.body:
        when = "after" if isinstance(statement, ast.Assert) else "before"
        for node in ast.walk(statement):
            if isinstance(node, ast.expr) and (text := _text(node, known)):
                board = cleandoc(text)
                if board.count("\n") > 1 and "#" in board and set(board) <= _SIGNS:
                    found.setdefault(board, when)
    return [(when, board) for board, when in found.items()]


def _texts(
    body: list[ast.stmt], known: Mapping[str, str] | None = None
) -> Iterator[tuple[str, str]]:
    """Names that are given a text, and the text."""
    for node in body:
        if isinstance(node, ast.Assign) and (text := _text(node.value, known or {})):
            yield ast.unparse(node.targets[0]), text


def _first_case(test: ast.FunctionDef) -> Iterator[tuple[str, str]]:
    """Parameters that are texts, in the first case of each `parametrize`."""
    for call in test.decorator_list:
        if isinstance(call, ast.Call) and "parametrize" in ast.unparse(call.func):
            with suppress(ValueError):  # cases that are not plain
                names, (case, *_) = map(ast.literal_eval, call.args[:2])
                one = isinstance(names, str)
                pairs = [(names, case)] if one else zip(names, case, strict=True)
                yield from (pair for pair in pairs if isinstance(pair[1], str))


def _text(node: ast.expr, known: Mapping[str, str]) -> str | None:
    """The text that an expression is, where that can be told without running it."""
    match node:
        case ast.Constant(value=str(text)):
            return text
        case ast.Name(id=name):
            return known.get(name)
        case ast.FormattedValue(value=inner):
            return _text(inner, known)
        case ast.JoinedStr(values=parts):
            texts = [_text(part, known) for part in parts]
            return None if None in texts else "".join(filter(None, texts))
        case ast.Call(func=ast.Attribute(value=base, attr="replace"), args=[old, new]):
            whole, was, now = (_text(each, known) for each in (base, old, new))
            return whole.replace(was, now) if whole and was and now else None
    return None
