"""Commands that measure the model: validate, how people move, and bench, how fast."""

import json
import sys
from argparse import Namespace
from typing import Any

from tqdm import tqdm

from reference.workshop.commands import options
from reference.workshop.commands.common import Command, writable
from reference.workshop.maps import load
from reference.workshop.validation.cases import CASES, NOT_MODELLED, measured

HEAD = ("verdict", "case", "what", "accepted", "measured")


# -- validate -----------------------------------------------------------------------


def validate(arguments: Namespace) -> None:
    """Measures standard pedestrian cases; exit status 0 also where a case fails."""
    seed, names = arguments.seed or 0, arguments.only or list(CASES)
    if arguments.output:
        writable(arguments.output)
    progress = tqdm(names, unit="case", disable=None, leave=False)
    rows = [measured(name, seed) for name in progress]
    if arguments.json:
        absent = [
            {"source": source, "what": what, "why": why}
            for source, (what, why) in NOT_MODELLED.items()
        ]
        print(json.dumps({"seed": seed, "cases": rows, "not_modelled": absent}))
    else:
        _tell(rows)
    if arguments.output:
        from reference.workshop.drawing import save, validation

        print(save(validation.diagram(seed), arguments.output), file=sys.stderr)


def _tell(rows: list[dict[str, Any]]) -> None:
    """Print the table, as wide as its words."""
    lines = [HEAD, *map(_line, rows)]
    lines += [
        ("not modelled", source, *reason, "") for source, reason in NOT_MODELLED.items()
    ]
    wide = [max(map(len, column)) for column in zip(*lines, strict=True)]
    for line in lines:
        print("  ".join(map(str.ljust, line, wide)).rstrip())


def _line(row: dict[str, Any]) -> tuple[str, ...]:
    """Write a case in words: its verdict, what was measured, and what to know of it."""
    verdict, runs = row["verdict"], row["runs"]
    if row["failed"] and runs > 1:
        verdict += f" {row['failed']}/{runs}"
    words = {k: "-" if v is None else f"{v:.3g}" for k, v in row["measured"].items()}
    for name, count in row["never"].items():
        words[name] += f" (never in {count}/{runs})"
    numbers = ", ".join(f"{name}: {word}" for name, word in words.items())
    numbers += f" ({row['note']})" * bool(row["note"])
    return verdict, row["source"], row["what"], row["accepted"], numbers


# -- bench --------------------------------------------------------------------------


def bench(arguments: Namespace) -> None:
    """Measures what one second computes: person-seconds, decisions, samples."""
    from reference.workshop.bench import measure, table

    building = load(arguments.building)
    facts = measure(arguments.building, arguments.seed or 0)
    print(json.dumps(facts) if arguments.json else table(building.title, facts))


VALIDATE_OPTIONS: options.Table = {
    "--only": options.choice(
        CASES, f"of {', '.join(CASES)}; default: all", nargs="+", metavar="CASE"
    ),
    **options.picture("none; draws the fundamental diagram"),
}

VALIDATE = Command(
    validate, VALIDATE_OPTIONS, "validate --only corridor doors -o diagram.png"
)
BENCH = Command(bench, options.BUILDING, "bench --json")
