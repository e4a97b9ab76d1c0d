"""What ties the engine to the book: each function names what it was written from.

A digest is of a book function's syntax tree without docstrings and comments, so that a
changed rule is heard and a changed comment is not.
"""

import ast
import hashlib
import importlib
import inspect
import sys
import textwrap
from collections.abc import Callable, Iterator
from enum import EnumMeta
from functools import cache, cached_property
from inspect import getclosurevars
from operator import is_
from types import CodeType, FunctionType
from typing import Any, NamedTuple

import numba

BOOK = "reference."
_Kept = type(cache(len))


class Mirror(NamedTuple):
    """A function of the engine, and what it was written from."""

    engine: str  # module and name
    book: str  # module and name
    digest: str


MIRRORS: list[Mirror] = []
ENTRIES: list[Any] = []  # compiled functions that Python calls


def compiled(function: Callable[..., Any], entry: bool = False) -> Any:
    """Compile a function when it is first called; nothing is contracted or reordered.

    Only an entry is kept on disk, by `storing`: all that it calls is inlined into it.
    Nothing compiled makes arrays (`_nrt=False`): counting who holds one, atomically,
    took half the time.
    """
    options: Any = {"error_model": "numpy", "forceinline": not entry}
    made = numba.njit(_nrt=False, **options)(function)
    if entry:
        ENTRIES.append(made)
    return made


def mirrors(*books: str, entry: bool = False) -> Callable[[Callable[..., Any]], Any]:
    """Compile a function written from functions of the book: "humans.stuck 5f2c9a"."""

    def note(function: Callable[..., Any]) -> Any:
        where = f"{function.__module__.rpartition('.')[2]}.{function.__name__}"
        for book in books:
            name, _, digest = book.partition(" ")
            MIRRORS.append(Mirror(where, name, digest))
        return compiled(function, entry)

    return note


def found(name: str) -> Any:
    """The function of the book that a name such as "humans.Leader.setoff" means."""
    holder, key = _links(name)[-1]
    return _plain(vars(holder)[key])


def _links(name: str) -> list[tuple[Any, str]]:
    """The module and classes that lead to a function, each with the name in it."""
    module, *path = name.split(".")
    holder: Any = importlib.import_module(BOOK + module)
    links = []
    for key in path:
        links.append((holder, key))
        holder = vars(holder).get(key)
    return links


def _plain(thing: Any) -> Any:
    """The function inside a method, property or cache; not one that somebody wraps."""
    if isinstance(thing, cached_property):
        return getclosurevars(thing.func).nonlocals.get("method", thing.func)
    if isinstance(thing, _Kept):
        return thing.__wrapped__
    for inner in ("__func__", "fget"):
        thing = getattr(thing, inner, thing)
    return thing


def digest_of(function: Any) -> str:
    """Six hex digits of a function's rule and the constants that it reads; "" if none.

    Those of `paper` do not count: they are read when a run begins.
    """
    try:  # the code itself: `getsource` looks through whatever wraps a function
        tree = ast.parse(textwrap.dedent(inspect.getsource(function.__code__)))
    except (AttributeError, OSError, SyntaxError, TypeError):
        return ""
    for node in ast.walk(tree):
        body = getattr(node, "body", None)
        first = body[0] if isinstance(body, list) and body else None
        if isinstance(first, ast.Expr) and isinstance(first.value, ast.Constant):
            first.value.value = ""
    names = {node.id for node in ast.walk(tree) if isinstance(node, ast.Name)}
    known = function.__globals__
    constants = [f"{name} {_value(known.get(name))}" for name in sorted(names)]
    rule = _dump(tree) + "".join(constants)
    return hashlib.sha256(rule.encode()).hexdigest()[:6]


def _dump(tree: ast.AST) -> str:
    """A syntax tree as text, the same in every version of Python."""
    all_fields = {"show_empty": True} if sys.version_info >= (3, 13) else {}
    return ast.dump(tree, **all_fields).replace(", type_params=[]", "")


def _value(thing: Any) -> str:
    """A constant as text, and whose a thing of the book is; "" for what is none."""
    if isinstance(thing, EnumMeta):
        return str({one.name: one.value for one in thing})  # type: ignore[var-annotated]
    if isinstance(thing, int | float | str | tuple | frozenset):
        return repr(thing)
    if isinstance(thing, type | FunctionType | _Kept):
        module = sys.modules.get(thing.__module__)
        same = getattr(module, thing.__qualname__, thing) is thing
        return "" if same else "another"
    kind = type(thing)
    return kind.__qualname__ if kind.__module__.startswith(BOOK) else ""


def changed() -> list[Mirror]:
    """The mirrors whose original is no longer what they were written from."""
    return [one for one in MIRRORS if digest_of(found(one.book)) != one.digest]


class Rules:
    """What the engine was written from, and all that it names, as objects.

    changed  mirrors whose original is no longer what they were written from
    """

    def __init__(self) -> None:
        """Find where each of them stands; digest the rules."""
        links = {(id(vars(h)), key): (vars(h), key) for h, key in _all_links()}
        self._links = list(links.values())
        self.learn()

    def learn(self) -> None:
        """Digest every rule as it is now."""
        self._things = self._now()
        self.changed = changed()

    @property
    def same(self) -> bool:
        """Nobody has put something else in the place of one since."""
        return all(map(is_, self._now(), self._things))

    def _now(self) -> list[Any]:
        return [where.get(key) for where, key in self._links]


def _all_links() -> Iterator[tuple[Any, str]]:
    """Where the book's rules stand, and what they read."""
    for one in MIRRORS:
        yield from _links(one.book)
        function = found(one.book)
        module = sys.modules[function.__module__]
        for name in _names_in(function.__code__):
            if name in vars(module):
                yield module, name


def _names_in(code: CodeType) -> set[str]:
    """The names that a function reads, and functions inside it."""
    inner = [const for const in code.co_consts if isinstance(const, CodeType)]
    return set(code.co_names).union(*map(_names_in, inner))
