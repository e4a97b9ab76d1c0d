"""The mark that ties a test to its clause, and the index made of those marks.

`pytest --paper-index` runs nothing; it prints for each clause of the appendix where
the code carries it, which tests hold it, and how it stands.
"""

import os
import textwrap
from collections import defaultdict
from collections.abc import Iterable, Iterator
from itertools import zip_longest

import hypothesis
import pytest
from clauses import CLAUSES, ROOT, citations

os.environ.setdefault("OMP_NUM_THREADS", "1")  # torch: small networks want no more
os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")

hypothesis.settings.register_profile("same every time", derandomize=True, deadline=None)
hypothesis.settings.load_profile("same every time")

WIDTHS = {"": 3, "clause": 30, "kind": 7, "code": 24, "tests": 27, "status": 14}

Places = dict[str, list[int]]  # file: line numbers


def pytest_addoption(parser):
    """Adds `--paper-index`."""
    parser.addoption(
        "--paper-index",
        action="store_true",
        help="run nothing; print clause, code, tests and status for the whole paper",
    )


def pytest_configure(config):
    """Registers the marks `paper` and `slow`."""
    config.addinivalue_line("markers", "slow: takes seconds; run them by `-m slow`")
    config.addinivalue_line(
        "markers",
        "paper(clause, *places): what this test holds of the appendix, "
        'such as paper("B5", "Alg. 1:5")',
    )


@pytest.hookimpl(tryfirst=True)
def pytest_runtestloop(session):
    """Prints the index instead of running the tests, if it is asked for."""
    if not session.config.option.paper_index:
        return None
    write = session.config.get_terminal_writer().line
    write()
    for line in paper_index(session.items):
        write(line)
    return True


def paper_index(items: Iterable[pytest.Item]) -> Iterator[str]:
    """The lines of the index, for the tests in `items`."""
    code, tests, missing = defaultdict(dict), defaultdict(dict), set()
    for clause, path, line in citations():
        name = str(path.relative_to(ROOT / "reference"))
        code[clause].setdefault(name, []).append(line)
    for item in items:
        for mark in item.iter_markers("paper"):
            lines = tests[mark.args[0]].setdefault(item.path.name, [])
            lines.append(item.location[1] + 1)
            if item.get_closest_marker("xfail"):
                missing.add(mark.args[0])
    yield from _row(WIDTHS)
    yield "─" * (sum(WIDTHS.values()) + len(WIDTHS) - 1)
    for clause, (kind, title) in CLAUSES.items():
        status = _status(kind, code[clause], tests[clause], clause in missing)
        places = (_places(code[clause]), _places(tests[clause]))
        yield from _row((clause, title, kind, *places, status))
    yield ""
    yield "holds, chosen, erratum: as long as the tests named pass."
    yield "number only: the numbers stand in paper.py, what they belong to is to come."


def _status(kind: str, code: Places, tests: Places, missing: bool) -> str:
    if not code:
        return "not built yet"
    if missing:
        return "not reproduced"
    if not tests:
        return "not tested"
    if set(code) == {"paper.py"}:
        return "number only"
    return "holds" if kind in ("stated", "derived") else kind


def _places(found: Places) -> str:
    return "\n".join(
        f"{name}:{' '.join(map(str, sorted(set(lines))))}"
        for name, lines in found.items()
    )


def _row(cells: Iterable[str]) -> Iterator[str]:
    """The lines of one row, every cell wrapped to the width of its column."""
    columns = [
        [part for line in cell.split("\n") for part in _wrap(line, width)]
        for cell, width in zip(cells, WIDTHS.values(), strict=True)
    ]
    for parts in zip_longest(*columns, fillvalue=""):
        padded = zip(parts, WIDTHS.values(), strict=True)
        yield " ".join(part.ljust(width) for part, width in padded).rstrip()


def _wrap(line: str, width: int) -> list[str]:
    """A place that needs more lines goes on indented."""
    return textwrap.wrap(line, width, subsequent_indent="  " * (".py:" in line))
