"""The command bench: how fast it is."""

import json
import os
from argparse import Namespace

from reference.building import load
from reference.workshop.commands import options
from reference.workshop.commands.common import Command


def bench(arguments: Namespace) -> None:
    """Measures what one second computes: person-seconds, decisions, samples."""
    os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")  # before torch is loaded
    from reference.workshop.bench import measure, table

    building = load(arguments.building)
    facts = measure(arguments.building, arguments.seed or 0)
    print(json.dumps(facts) if arguments.json else table(building.title, facts))


BENCH = Command(bench, options.BUILDING, "bench --json")
