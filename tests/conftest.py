"""The mark that ties a test to its clause, and the index made of those marks.

`pytest --paper-index` runs nothing; it prints for each clause of the appendix where
the code carries it, and which tests hold it.
"""

import os
import signal

import hypothesis
import pytest
from paper_index import paper_index

from reference.workshop.workers import STOPS

os.environ.setdefault("OMP_NUM_THREADS", "1")  # torch: small networks want no more
os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")

for stop in STOPS:  # some tests send them, even to a suite that ignores them (`nohup`)
    if signal.getsignal(stop) == signal.SIG_IGN:
        signal.signal(stop, signal.SIG_DFL)
if signal.getsignal(signal.SIGINT) == signal.SIG_DFL:
    signal.signal(signal.SIGINT, signal.default_int_handler)

hypothesis.settings.register_profile("same every time", derandomize=True, deadline=None)
hypothesis.settings.load_profile("same every time")


@pytest.fixture
def unprotected(monkeypatch):
    """Let all but the ways out themselves burn, on boards built from here on."""
    monkeypatch.setattr("reference.paper.PROTECTED_METRES", 0.0)


def pytest_addoption(parser):
    """Adds `--paper-index`."""
    parser.addoption(
        "--paper-index",
        action="store_true",
        help="run nothing; print clause, code and tests for the whole paper",
    )


def pytest_configure(config):
    """Registers the marks; the index names slow tests too."""
    if config.option.paper_index:
        config.option.markexpr = ""
    config.addinivalue_line("markers", "slow: takes seconds; run them by `-m slow`")
    config.addinivalue_line("markers", "extra: is skipped without one of the extras")
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
