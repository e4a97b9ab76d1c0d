"""`pytest --engine`: the tests of paper and book, stepped by the engine.

`Simulation.step` and `run` are replaced once, for the whole session, and told to the
engine as the book's own.  Where it stands aside, and where somebody watches which lines
of the book run, the book steps.
"""

import sys
from functools import wraps

BY_ENGINE = "engine"
BY_BOOK = "book"
BY_NOBODY = "none"

SAID = """\
engine: {engine} tests stepped by the engine, {none} as they are, {book} stepped by \
the book since something was replaced"""


class Steps:
    """Who has stepped the simulations of one test; `here`: is it one of them?"""

    def __init__(self):
        self.here = False
        self.by = set()

    def begin(self, path):
        """A test of this path begins."""
        self.here = path.parent.name in ("paper", "book")
        self.by = set()

    @property
    def who(self):
        """The book if it stepped once, the engine, or nobody."""
        if BY_BOOK in self.by:
            return BY_BOOK
        return BY_ENGINE if self.by else BY_NOBODY


STEPS = Steps()


def engine_plays(simulation):
    """Does the engine play this simulation? Else the book does."""
    from reference.workshop import engine

    return engine.engine_is_ready() and engine.is_the_books(simulation)


def step_by_engine():
    """Replace `Simulation.step` and `run`, until the process ends."""
    # late: what is broken there fails tests, not this file
    from reference.simulation import Simulation
    from reference.workshop.engine import mirrors
    from reference.workshop.engine.going import advance

    book_step = Simulation.step
    book_run = Simulation.run

    def plays(simulation):
        """Does the engine play this one?"""
        if not STEPS.here or simulation.done:
            return False
        watched = sys.gettrace() is not None
        by_book = watched or not engine_plays(simulation)
        STEPS.by.add(BY_BOOK if by_book else BY_ENGINE)
        return not by_book

    @wraps(book_step)
    def step(self):
        if not plays(self):
            return book_step(self)
        already = len(self.events)
        advance(self, 1)
        return self.events[already:]

    @wraps(book_run)
    def run(self):
        if not plays(self):
            return book_run(self)
        advance(self, sys.maxsize)
        return self.outcome()

    Simulation.step = step
    Simulation.run = run

    # the engine knows this step for the book's
    found = mirrors.found

    def known(name):
        mine = name == "simulation.Simulation.step" and Simulation.step is step
        return book_step if mine else found(name)

    mirrors.found = known


def summary(reports):
    """One line: how many tests were stepped by whom."""
    stepped = [getattr(one, "stepped_by", "") for one in reports]
    counts = {who: stepped.count(who) for who in (BY_ENGINE, BY_BOOK, BY_NOBODY)}
    return SAID.format(**counts)
