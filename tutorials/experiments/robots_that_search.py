"""What would robots save that search before they decide? Play whole evacuations so.

    python tutorials/experiments/robots_that_search.py out/search.csv

Each evacuation is played twice from the same seed: by a team that does what its own
strategy says, and by one that searches first (`play_searching` of
`workshop/measuring/branching.py`). Futures of a search are drawn anew, so that nobody
knows what the evacuation itself will bring. A row is appended to the table for each;
what is in the table is not played again. An evacuation takes some minutes of a core.

Robots have no such time while it burns: it tells how much better they could be.
"""

import sys
from argparse import ArgumentParser
from dataclasses import asdict, dataclass
from itertools import product
from pathlib import Path
from time import process_time

import numpy as np
from kept_rows import begun, measure_all, read_rows

from reference.workshop.commands.common import exit_status
from reference.workshop.commands.options import whole
from reference.workshop.comparing.intervals import format_interval, interval_of_mean
from reference.workshop.comparing.results import align_columns
from reference.workshop.engine import run_to_end
from reference.workshop.measuring.branching import FUTURES, play_searching
from reference.workshop.storage.workers import one_thread

FIRES = ("closer", "busiest")
BASES = ("observer", "learned")
ROUNDS = FUTURES[:2]  # of a search: it measures nothing


@dataclass(frozen=True)
class Job:
    """One evacuation to play.

    held     decisions from one search to the next
    futures  of a search: in how many all choices are played on, and the best
    """

    building: str
    held: int
    futures: str
    base: str
    fire: str
    seed: int


@dataclass(frozen=True)
class Row(Job):
    """What came of it, in people.

    own     saved by the team's own strategy;  searching  saved by robots that search
    chosen  how often one believed in something better;  seconds  of a processor
    """

    people: int
    own: int
    searching: int
    chosen: int
    seconds: float


def measured(job):
    """Play one evacuation both ways: a Row."""
    began = process_time()
    with one_thread():
        own = begun(job)
        run_to_end([own])
        searching = begun(job)
        rng = np.random.default_rng([job.seed, 2])
        futures = [int(number) for number in job.futures.split("+")]
        chosen = play_searching(searching, job.held, futures, rng)
    usual = own.outcome()
    return Row(
        **asdict(job),
        people=usual.people,
        own=usual.evacuated,
        searching=searching.outcome().evacuated,
        chosen=chosen,
        seconds=round(process_time() - began, 2),
    )


def play(asked):
    """Play what is not in the table yet: one of each cell, then the next."""
    seeds = range(asked.seed, asked.seed + asked.evacuations)
    futures = "+".join(map(str, asked.futures))
    jobs = [
        Job(asked.building, asked.held, futures, base, fire, seed)
        for seed, base, fire in product(seeds, asked.base, asked.fires)
    ]
    for row in measure_all(Row, measured, jobs, asked):
        print(
            f"{row.base} {row.fire} {row.seed}: {row.own} to {row.searching} people, "
            f"{row.chosen} choices, {row.seconds:.0f} s",
            file=sys.stderr,
        )


def tell(rows):
    """Print survivors in per cent and the difference in points, by team and fire."""
    cells = {}
    for row in rows:
        cells.setdefault((row.base, row.fire, row.held, row.futures), []).append(row)
    head = ["robots", "fire", "held", "futures"]
    lines = [[*head, "runs", "own", "searching", "more", "chosen"]]
    for (base, fire, held, futures), rows in sorted(cells.items()):
        own = 100 * np.array([row.own / row.people for row in rows])
        searching = 100 * np.array([row.searching / row.people for row in rows])
        more = interval_of_mean(searching - own)
        lines.append(
            [
                base,
                fire,
                str(held),
                futures,
                str(len(rows)),
                f"{own.mean():.1f}",
                f"{searching.mean():.1f}",
                format_interval(more, 1, signed=True, ends=True),
                f"{np.mean([row.chosen for row in rows]):.1f}",
            ]
        )
    print(align_columns(lines, "<<>>>>>>>"))


def main():
    parser = ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("table", metavar="CSV")
    parser.add_argument("--evacuations", type=whole(1), default=8, metavar="N")
    parser.add_argument("--fires", nargs="+", default=FIRES, metavar="S")
    parser.add_argument("--base", nargs="+", default=BASES, metavar="S")
    parser.add_argument("--held", type=whole(1), default=4, metavar="H")
    parser.add_argument(
        "--futures", nargs=2, type=whole(1), default=ROUNDS, metavar="S"
    )
    parser.add_argument("--building", default="paper", metavar="NAME")
    parser.add_argument("--seed", type=whole(0), default=110_000, metavar="N")
    parser.add_argument("--workers", type=whole(0), default=2, metavar="N")
    parser.add_argument("--minutes", type=float, default=240, metavar="CPU")
    asked = parser.parse_args()
    play(asked)
    tell(read_rows(Path(asked.table), Row))


if __name__ == "__main__":
    sys.exit(exit_status(main))
