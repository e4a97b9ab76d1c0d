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
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from enum import EnumMeta
from functools import cache, cached_property
from inspect import getclosurevars
from operator import is_
from types import CodeType, FunctionType
from typing import Any, NamedTuple

import numba
from numba.core.cpu import CPUTargetOptions

if numba.config.DISABLE_JIT:  # type: ignore[attr-defined]
    raise ImportError("NUMBA_DISABLE_JIT is set")
if not hasattr(CPUTargetOptions, "_nrt"):  # see `compiled`
    raise ImportError(f"numba {numba.__version__} has no option _nrt")

BOOK = "reference."
CachedFunction = type(cache(len))  # what `cache` and `lru_cache` make; it has no name


class Mirror(NamedTuple):
    """A function of the engine, and what it was written from."""

    engine: str  # module and name
    book: str  # module and name
    digest: str


Link = tuple[Mapping[str, Any], str]  # what stands in a module or an object; a name

MIRRORS: list[Mirror] = []
ENTRIES: list[Any] = []  # compiled functions that Python calls
ASKED: dict[str, str] = {
    "simulation.Simulation.strategies_decide": "strategies, new fires",
    "robots.actual_target": "asked at decisions",
    "robots.said_on_the_way": "asked at decisions",
    "navigation.navigation_of": "tables are made from it",
    "navigation.Navigation.places_of": "in the tables",
    "rays.Sight._cells_of_ray": "in the tables",
    "rays.direction": "in the tables",
    "building.Stairwell.lowest": "in the tables",
    "paper.body_diameter": "a number, read when a run begins",
    "paper.stairs_metres": "a number, read when a run begins",
}
"""What the engine asks the book itself, or has from it; and all below that.

Its source may change, since the engine asks it; but somebody's own in its place comes
too late for tables that are made, so the book plays.
"""


def compiled(function: Callable[..., Any], entry: bool = False) -> Any:
    """Compile a function when it is first called; nothing is contracted or reordered.

    Only an entry is kept on disk, by `storing`: all that it calls is inlined into it.
    Nothing compiled makes arrays: counting who holds one, atomically, took half the
    time.  `_nrt=False` leaves that out, an option that numba has for itself.
    """
    options: Any = {"error_model": "numpy", "forceinline": not entry, "_nrt": False}
    made: Any = numba.njit(**options)(function)
    if entry:
        ENTRIES.append(made)
    return made


def mirrors(*books: str, entry: bool = False) -> Callable[[Callable[..., Any]], Any]:
    """Compile a function written from functions of the book: "humans.stuck 5f2c9a"."""
    return lambda function: compiled(written_from(*books)(function), entry)


def written_from(*books: str) -> Callable[[Callable[..., Any]], Any]:
    """Note what a function was written from, as `mirrors` does; Python runs it."""

    def note(function: Callable[..., Any]) -> Any:
        where = f"{function.__module__.rpartition('.')[2]}.{function.__name__}"
        for book in books:
            name, _, digest = book.partition(" ")
            MIRRORS.append(Mirror(where, name, digest))
        return function

    return note


def found(name: str) -> Any:
    """The function of the book that a name such as "humans.Leader.setoff" means.

    None if nothing of this name is there.
    """
    where, key = _links(name)[-1]
    return _plain(where.get(key))


def _links(name: str) -> list[Link]:
    """Where the module and the classes stand that lead to a function, and itself."""
    module, *path = name.split(".")
    holder: Any = importlib.import_module(BOOK + module)
    links: list[Link] = []
    for key in path:
        where = getattr(holder, "__dict__", {})
        links.append((where, key))
        holder = where.get(key)
    return links


def _plain(thing: Any) -> Any:
    """The function inside a method, property or cache; not one that somebody wraps."""
    if isinstance(thing, cached_property):
        return getclosurevars(thing.func).nonlocals.get("method", thing.func)
    if isinstance(thing, CachedFunction):
        return thing.__wrapped__
    for inner in ("__func__", "fget"):
        thing = getattr(thing, inner, thing)
    return thing


# -- Digests ------------------------------------------------------------------------


def digest_of(function: Any) -> str:
    """Six hex digits of a function's rule and the constants that it reads; "" if none.

    Those of `paper` do not count: they are read when a run begins.
    """
    tree = _tree_of(function)
    if tree is None:
        return ""
    known = function.__globals__
    constants = [f"{name} {_value(known, name)}" for name in _names_of(tree)]
    rule = _dump(tree) + "".join(constants)
    return hashlib.sha256(rule.encode()).hexdigest()[:6]


def _tree_of(function: Any) -> ast.AST | None:
    """The syntax tree of a function of the book, with empty docstrings; else None."""
    if not getattr(function, "__globals__", {}).get("__name__", "").startswith(BOOK):
        return None  # somebody's own
    try:  # the code itself: `getsource` looks through whatever wraps a function
        tree = ast.parse(textwrap.dedent(inspect.getsource(function.__code__)))
    except (AttributeError, OSError, SyntaxError, TypeError):
        return None
    for node in ast.walk(tree):
        body = getattr(node, "body", None)
        first = body[0] if isinstance(body, list) and body else None
        if isinstance(first, ast.Expr) and isinstance(first.value, ast.Constant):
            first.value.value = ""
    return tree


def _names_of(tree: ast.AST) -> list[str]:
    """The names that are read or set in a syntax tree."""
    return sorted({node.id for node in ast.walk(tree) if isinstance(node, ast.Name)})


def _dump(tree: ast.AST) -> str:
    """A syntax tree as text, the same in every version of Python."""
    all_fields = {"show_empty": True} if sys.version_info >= (3, 13) else {}
    return ast.dump(tree, **all_fields).replace(", type_params=[]", "")


def _value(known: Mapping[str, Any], name: str) -> str:
    """What a module of the book knows by a name: a constant, or an object, as text.

    "" for what is none, and for functions and classes of the book in their own place.
    """
    thing = known.get(name)
    if isinstance(thing, EnumMeta):
        return str({one.name: one.value for one in thing})  # type: ignore[var-annotated]
    if isinstance(thing, int | float | str | tuple | frozenset):
        return repr(thing)
    kind = type(thing)
    if kind.__module__.startswith(BOOK):
        return "another" if _hides_methods(thing) else kind.__qualname__
    written = _written(known["__name__"]).get(name)
    if written is None or written.value:
        return ""
    home = vars(sys.modules[written.home])
    own = thing is home.get(name) and thing.__module__ == written.home
    return "" if own else "another"


class Written(NamedTuple):
    """What a name of the book stands for, as the source says."""

    home: str  # the module that defines it
    value: str  # a constant, the class of an object; "" for functions and classes


@cache
def _written(module: str) -> dict[str, Written]:
    """What the source of a module of the book defines or has from others of the book.

    Something else may stand there by now.  Not all constants are found.
    """
    names: dict[str, Written] = {}
    for node in ast.parse(inspect.getsource(sys.modules[module])).body:
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            names[node.name] = Written(module, "")
        elif isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name):
            value = _value_in(node.value)
            if value:
                names[node.targets[0].id] = Written(module, value)
        elif isinstance(node, ast.ImportFrom) and str(node.module).startswith(BOOK):
            others = _written(str(node.module))
            both = others.keys() & {one.name for one in node.names}
            names.update({name: others[name] for name in both})
    return names


def _value_in(node: ast.expr) -> str:
    """What `_value` says of something in the source; "" where that is not known."""
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
        alone = not node.args and not node.keywords
        return node.func.id if alone else ""
    with suppress(ValueError):
        return repr(ast.literal_eval(node))
    return ""


def _hides_methods(thing: Any) -> bool:
    """Does an attribute of an object, such as LEADER, hide a method of its class?"""
    mine = getattr(thing, "__dict__", {})
    return not mine.keys().isdisjoint(vars(type(thing)))


# -- What has changed ---------------------------------------------------------------


def changed() -> list[str]:
    """Functions of the book that are not what the engine was written from, or asks."""
    written = [one.book for one in MIRRORS if digest_of(found(one.book)) != one.digest]
    asked = [name for name in ASKED if not digest_of(found(name))]
    return list(dict.fromkeys(written + asked))


def in_words(changed: list[str]) -> list[str]:
    """What has changed: functions, or what they read."""
    words: dict[str, str] = {}
    for book in changed:
        others = _others_read_by(found(book))
        for name in others:
            words.setdefault(name, f"{name}, which {book} reads,")
        if not others:
            words[book] = book
    return list(words.values())


def _others_read_by(rule: Any) -> list[str]:
    """What a rule of the book reads that is not what the source says."""
    tree = _tree_of(rule)
    if tree is None:
        return []
    known = rule.__globals__
    module = known["__name__"]
    written = _written(module)
    names = [name for name in _names_of(tree) if name in written]
    return [
        f"{module.removeprefix(BOOK)}.{name}"
        for name in names
        if _value(known, name) != written[name].value
        and not isinstance(known.get(name), EnumMeta)
    ]


class Rules:
    """What the engine was written from, and all that it names, as objects.

    changed  functions of the book that are not what the engine was written from
    """

    def __init__(self) -> None:
        """Digest the rules for the first time."""
        self.learn()

    def learn(self) -> None:
        """Find every rule where it stands now, and digest it."""
        links = list(_all_links())  # alive, all of them: so each has an id of its own
        self._links = list({(id(link[0]), link[1]): link for link in links}.values())
        rules = map(found, _names())
        self._rules = [rule for rule in rules if isinstance(rule, FunctionType)]
        self._things = self._now()
        self.changed = changed()

    @property
    def same(self) -> bool:
        """Nobody has put something else in the place of one since."""
        return all(map(is_, self._now(), self._things))

    def _now(self) -> list[Any]:
        things = [where.get(key) for where, key in self._links]
        return things + [rule.__code__ for rule in self._rules]


def _names() -> list[str]:
    """The functions of the book that the engine knows."""
    return list(dict.fromkeys([*(one.book for one in MIRRORS), *ASKED]))


def _all_links() -> Iterator[Link]:
    """Where the book's rules stand, and what they read."""
    for name in _names():
        yield from _links(name)
        rule = found(name)
        if isinstance(rule, FunctionType):
            known = rule.__globals__
            for key in _names_in(rule.__code__) & known.keys():
                yield known, key
                yield from _links_of(known[key])


def _links_of(thing: Any) -> Iterator[Link]:
    """Where an object of the book, such as LEADER, would hide methods of its class."""
    if type(thing).__module__.startswith(BOOK) and hasattr(thing, "__dict__"):
        for key in vars(type(thing)):
            yield vars(thing), key


def _names_in(code: CodeType) -> set[str]:
    """The names that a function reads, and functions inside it."""
    inner = [const for const in code.co_consts if isinstance(const, CodeType)]
    return set(code.co_names).union(*map(_names_in, inner))
