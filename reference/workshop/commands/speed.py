"""How fast it is: bench."""

import json
import os
from argparse import ArgumentParser, Namespace

from reference.building import load
from reference.workshop.bench import measure, table
from reference.workshop.commands.common import MAP, Command, for_people


def bench(arguments: Namespace) -> None:
    """Measures what one second computes: person-seconds, decisions, samples."""
    os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")  # before torch is loaded
    building = load(arguments.building)
    with for_people():
        facts = measure(arguments.building, arguments.seed or 0)
    print(json.dumps(facts) if arguments.json else table(building.title, facts))


def _bench_options(parser: ArgumentParser) -> None:
    parser.add_argument("--building", default="paper", help=f"{MAP}; default: paper")


BENCH = Command(bench, _bench_options, "bench --json")
