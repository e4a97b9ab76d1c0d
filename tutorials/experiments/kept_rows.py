"""Measure in a table: a row is a job and what came of it; no job is done twice.

A row is a dataclass that extends its job's, and has the `seconds` that it took. Jobs
name an evacuation by `building`, `base` (the robots), `fire` and `seed`. Imported by
`what_a_decision_is_worth.py` and `robots_that_search.py`; `kept_cells`, which reads
tables of matches, by `from_nothing.py`.
"""

import sys
from dataclasses import asdict, fields
from functools import lru_cache
from operator import attrgetter
from pathlib import Path
from types import SimpleNamespace

from reference import Scenario, Simulation, load
from reference.workshop.comparing.intervals import Interval
from reference.workshop.comparing.named import strategy_named
from reference.workshop.engine import make_ready
from reference.workshop.storage.files import Table, read_json, read_table
from reference.workshop.storage.workers import map_as_done, workers


def kept_cells(path):
    """The cells of a JSON table of matches, as far as pictures read them."""
    return [
        SimpleNamespace(**cell | {"survival": Interval(**cell["survival"])})
        for cell in read_json(path)["cells"]
    ]


@lru_cache
def named(word, side):
    """The strategy of a name; a network is read once."""
    return strategy_named(word, side)


def begun(job):
    """The evacuation, before anything has happened."""
    robots = named(job.base, "robots")
    fire = named(job.fire, "fire")
    return Simulation(load(job.building), Scenario(), robots, fire, job.seed)


def read_rows(path, kind):
    """The rows of a table, as they came; kind: the record that each is."""
    types = {field.name: field.type for field in fields(kind)}

    def made(cells):
        return kind(**{name: types[name](cell) for name, cell in cells.items()})

    return read_table(path, list(types), made)


def measure_all(kind, measure, jobs, asked):
    """Measure what is not in the table yet, until all is there or time is up.

    kind     of the rows
    measure  what comes of a job: a row, or None
    asked    table, workers and minutes
    Yields rows as they come; each is in the table by then.
    """
    path = Path(asked.table)
    path.parent.mkdir(parents=True, exist_ok=True)
    rows = read_rows(path, kind)
    table = Table(path, [field.name for field in fields(kind)], map(asdict, rows))
    of_job = attrgetter(*[field.name for field in fields(kind.__base__)])
    there = set(map(of_job, rows))
    left = [job for job in jobs if of_job(job) not in there]
    print(f"{len(rows)} rows are there; {len(left)} to play", file=sys.stderr)

    make_ready()
    spent = 0.0
    with workers(asked.workers) as pool:
        for _, row in map_as_done(pool, measure, left):
            if row is None:
                continue
            table.append([asdict(row)])
            yield row
            spent += row.seconds
            if spent >= 60 * asked.minutes:
                print("time is up; go on with the same command", file=sys.stderr)
                break
