"""How dense is code? Ours by default, or what stands in the files and folders named.

It takes a few seconds:

    python tutorials/experiments/density.py
    python tutorials/experiments/density.py .venv/lib/python3.11/site-packages/networkx

A line of code is neither blank nor a comment alone, and no docstring. The columns:

    packed    assignments with tuples on both sides, `a, b = x, y`, in 1,000 lines
    walrus    `:=` in 1,000 lines
    a line    expressions in a line of code: names, constants, calls, operations, ...
    body      lines of code in a function's body: the median, and nine in ten have less
    comments  comments for each line of code
"""

import ast
import sys
import tokenize
from collections.abc import Iterable, Iterator
from io import StringIO
from pathlib import Path
from statistics import median
from typing import NamedTuple

import reference
from reference.paper import InputError
from reference.workshop.commands.common import exit_status

PACKAGE = Path(reference.__file__).parent


class File(NamedTuple):
    """A file's text, syntax tree, and numbers of its lines of code."""

    text: str
    tree: ast.Module
    code: frozenset[int]


def parsed(path: Path) -> File:
    """Read a file of Python. Raises InputError for another one, OSError."""
    text = path.read_text(encoding="utf-8")
    try:
        tree = ast.parse(text)
    except SyntaxError as error:
        raise InputError(f"{path}:{error.lineno}: is no Python ({error.msg})") from None
    said = set[int]()
    for node in ast.walk(tree):
        if is_docstring(node):
            said.update(range(node.lineno, node.end_lineno + 1))
    code = set[int]()
    for number, line in enumerate(text.splitlines(), 1):
        bare = line.strip()
        if bare and not bare.startswith("#") and number not in said:
            code.add(number)
    return File(text, tree, frozenset(code))


def is_docstring(node: ast.AST) -> bool:
    """Is it a string that stands alone, below a definition or a constant?"""
    if not isinstance(node, ast.Expr) or not isinstance(node.value, ast.Constant):
        return False
    return isinstance(node.value.value, str)


def is_packed(node: ast.AST) -> bool:
    """Is it an assignment with tuples on both sides?"""
    if not isinstance(node, ast.Assign) or not isinstance(node.value, ast.Tuple):
        return False
    return isinstance(node.targets[0], ast.Tuple)


def bodies(file: File) -> Iterator[int]:
    """Count the lines of code in the body of each function."""
    for node in ast.walk(file.tree):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            lines = range(node.body[0].lineno, node.end_lineno + 1)
            yield len(file.code.intersection(lines))


def comments(file: File) -> int:
    """Count the comments of a file."""
    tokens = tokenize.generate_tokens(StringIO(file.text).readline)
    return sum(token.type == tokenize.COMMENT for token in tokens)


def row(name: str, paths: Iterable[Path]) -> str:
    """Measure all files together, and write a row of the table."""
    files = [parsed(path) for path in paths]
    nodes = [node for file in files for node in ast.walk(file.tree)]
    lines = sum(len(file.code) for file in files) or 1
    packed = sum(map(is_packed, nodes)) / lines
    walrus = sum(isinstance(node, ast.NamedExpr) for node in nodes) / lines
    expressions = sum(isinstance(node, ast.expr) for node in nodes) / lines
    said = sum(map(comments, files)) / lines
    body = sorted(count for file in files for count in bodies(file)) or [0]
    most = body[9 * len(body) // 10]
    return (
        f"{name:24}{lines:8,}{1000 * packed:9.1f}{1000 * walrus:9.1f}"
        f"{expressions:9.2f}{median(body):7.0f} /{most:3.0f}{said:11.2f}"
    )


def ours() -> Iterator[tuple[str, list[Path]]]:
    """The book, each room of the workshop, the tests, and the tutorials."""
    chapters = [PACKAGE / name for name in reference.BOOK if "." not in name]
    yield "the book", [path for chapter in chapters for path in modules(chapter)]
    for name in reference.WORKSHOP:
        room, *inner = name.split(".")[1:] or [""]
        if room and not inner:
            yield f"workshop.{room}", modules(PACKAGE / "workshop" / room)
    for folder in ("tests", "tutorials"):
        yield folder, modules(PACKAGE.parent / folder)


def modules(path: Path) -> list[Path]:
    """All files of Python in a folder, or the one of this name."""
    return sorted(path.rglob("*.py")) if path.is_dir() else [path.with_suffix(".py")]


def theirs(words: Iterable[str]) -> Iterator[tuple[str, list[Path]]]:
    """The files and folders that are named."""
    for path in map(Path, words):
        yield path.name, modules(path) if path.is_dir() else [path]


def main() -> None:
    words = sys.argv[1:]
    print(f"{'':24}   lines   packed   walrus   a line       body   comments")
    for name, paths in theirs(words) if words else ours():
        print(row(name, paths))


if __name__ == "__main__":
    sys.exit(exit_status(main))
