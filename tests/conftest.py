"""The mark that ties a test to its clause, and what is made of those marks.

`pytest --paper "Alg. 2:13-15"` runs the tests of some lines, `--paper B5` those of a
clause.  `pytest --paper-index` runs nothing; it prints where the code carries each
clause and each line, and which tests hold it; `--paper-index=B5` prints one.
`pytest --engine` steps the tests of paper and book by the engine.
"""

import os
import signal
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path

import hypothesis
import pytest
from by_engine import STEPS, step_by_engine, summary
from paper_index import asked_for, paper_index
from rules import Board, drawn, keys_of, rules, side_by_side

from reference.workshop.annotated.index import marked_tests
from reference.workshop.storage.workers import STOPS

ROOT = Path(__file__).resolve().parent.parent

os.environ.setdefault("OMP_NUM_THREADS", "1")  # torch: small networks want no more
os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")

for stop in STOPS:  # some tests send them, even to a suite that ignores them (`nohup`)
    if signal.getsignal(stop) == signal.SIG_IGN:
        signal.signal(stop, signal.SIG_DFL)
if signal.getsignal(signal.SIGINT) == signal.SIG_DFL:
    signal.signal(signal.SIGINT, signal.default_int_handler)

EVERYTHING = "all"
# seconds on the clock until a test has failed; on a busy machine the first one that
# asks for the engine waits minutes while it is compiled
LIMIT = 1200

hypothesis.settings.register_profile("same every time", derandomize=True, deadline=None)
hypothesis.settings.load_profile("same every time")


@pytest.fixture
def unprotected(monkeypatch):
    """Let all but the ways out themselves burn, on boards built from here on."""
    monkeypatch.setattr("reference.paper.PROTECTED_METRES", 0.0)


@pytest.fixture
def in_an_empty_folder(tmp_path, monkeypatch):
    """What a command writes lands in a folder of its own."""
    monkeypatch.chdir(tmp_path)


@pytest.fixture
def engine_plays():
    """Leave out what asks for the engine while it stands aside.

    `test_engine_mirrors` fails then, and says what to do.
    """
    from reference.workshop import engine

    if not engine.engine_is_ready():
        pytest.skip("a rule has changed: see test_engine_mirrors")


@contextmanager
def at_most(seconds):
    """Fail what takes longer: nothing hangs.

    Another limit around it waits meanwhile.
    """

    def late(*_):
        pytest.fail(f"not done after {seconds} s")

    before = signal.signal(signal.SIGALRM, late)
    left, _ = signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, left)
        signal.signal(signal.SIGALRM, before)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call():
    """Each test has a limit of time."""
    with at_most(LIMIT):
        return (yield)


pytest_runtest_setup = pytest_runtest_call  # and so have its fixtures


def pytest_runtest_logstart(location):
    """Nobody has stepped anything in the test that begins."""
    STEPS.begin(ROOT / location[0])


def pytest_assertrepr_compare(config, op, left, right):
    """Two boards that differ are shown below the test, under the rule."""
    if op == "==" and Board in (type(left), type(right)):
        told = side_by_side(drawn(left), drawn(right))
        config.boards = [
            *told,
            "",
            "What the signs mean: at the top of tests/movies.py",
        ]
        return ["the board differs, see below"]
    return None


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item, call):
    """A test that fails tells the rule: clause, line and code, then both boards."""
    report = yield
    if item.config.option.engine and report.when == "call":
        report.stepped_by = STEPS.who
    if report.failed and (keys := keys_of(item)):
        told = [*rules(keys), "", *getattr(item.config, "boards", ())]
        report.sections.append(("The rule", "\n".join(told)))
        item.config.boards = ()
    return report


def pytest_addoption(parser):
    """Adds `--paper`, `--paper-index` and `--engine`."""
    parser.addoption(
        "--paper",
        metavar="WHAT",
        help='run the tests of a clause or of a line: B5, "Alg. 2:13-15", "Eq. 3"',
    )
    parser.addoption(
        "--paper-index",
        nargs="?",
        const=EVERYTHING,
        metavar="WHAT",
        help="run nothing; print where code and tests carry the paper, or a part of it",
    )
    parser.addoption(
        "--engine",
        action="store_true",
        help="step the tests of paper and book by the engine",
    )


def pytest_configure(config):
    """Registers the marks; finds the tests that `--paper` asks for."""
    config.addinivalue_line("markers", "slow: takes seconds; run them by `-m slow`")
    config.addinivalue_line("markers", "mutants: takes minutes; run by `-m mutants`")
    config.addinivalue_line("markers", "extra: is skipped without one of the extras")
    config.addinivalue_line(
        "markers",
        "paper(clause, *places): what this test holds of the appendix, "
        'such as paper("B5", "Alg. 1:5")',
    )
    if config.option.paper:
        config.asked = set(asked_for(config.option.paper))
    if config.option.engine:
        if find_spec("numba") is None:
            raise pytest.UsageError("--engine needs numba: pip install -e '.[fast]'")
        step_by_engine()


def pytest_cmdline_main(config):
    """Prints the index instead of running tests, if it is asked for."""
    if (asked := config.option.paper_index) is None:
        return None
    lines = paper_index() if asked == EVERYTHING else paper_index(asked_for(asked))
    print(*lines, sep="\n")
    return pytest.ExitCode.OK


def pytest_terminal_summary(terminalreporter):
    """Prints what tests have counted and recorded."""
    for outcome in ("passed", "failed"):
        for report in terminalreporter.getreports(outcome):
            for name, fact in report.user_properties:
                terminalreporter.write_line(f"{name}: {fact}")
    if terminalreporter.config.option.engine:
        reports = terminalreporter.stats.values()
        told = [one for some in reports for one in some]
        terminalreporter.write_line(summary(told))


def pytest_ignore_collect(collection_path, config):
    """Files without any test that `--paper` asks for are not read."""
    if config.option.paper and collection_path.suffix == ".py":
        asked = {test.path for test in marked_tests() if config.asked & test.keys}
        return collection_path not in asked or None
    return None


def pytest_collection_modifyitems(config, items):
    """Leaves the tests that `--paper` asks for."""
    if config.option.paper:
        asked = [item for item in items if config.asked.intersection(keys_of(item))]
        config.hook.pytest_deselected(items=[i for i in items if i not in asked])
        items[:] = asked
