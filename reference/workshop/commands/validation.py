"""The command validate: standard cases of pedestrian dynamics, one after another."""

import json
import sys
from argparse import Namespace
from pathlib import Path
from typing import Any

from tqdm import tqdm

from reference.workshop.commands import options
from reference.workshop.commands.common import Command
from reference.workshop.validation.cases import CASES, NOT_MODELLED, RUNS, measured

HEAD = ("verdict", "case", "what", "accepted", "measured")


def validate(arguments: Namespace) -> None:
    """Measures standard pedestrian cases; exit status 0 also where a case fails."""
    seed = arguments.seed or 0
    seeds, names = range(seed, seed + RUNS), arguments.only or list(CASES)
    if arguments.out:
        arguments.out.mkdir(parents=True, exist_ok=True)
    progress = tqdm(names, unit="case", disable=None, leave=False)
    rows = [measured(name, seeds) for name in progress]
    absent = [
        {"source": source, "what": what, "reason": reason}
        for source, (what, reason) in NOT_MODELLED.items()
    ]
    if arguments.json:
        print(json.dumps({"seeds": [*seeds], "cases": rows, "not_modelled": absent}))
    else:
        _tell(rows, absent)
    if arguments.out:
        _draw(arguments.out, seed)


def _tell(rows: list[dict[str, Any]], absent: list[dict[str, str]]) -> None:
    """Print the table, as wide as its words."""
    lines = [HEAD]
    for row in rows:
        verdict = f"fails {row['failed']}/{RUNS}" if row["failed"] else "passes"
        words = (row[name] for name in ("source", "what", "accepted"))
        lines.append((verdict, *words, _shown(row["measured"])))
    for row in absent:
        lines.append(("not modelled", row["source"], row["what"], row["reason"], ""))
    wide = [max(map(len, column)) for column in zip(*lines, strict=True)]
    for line in lines:
        cells = (word.ljust(w) for word, w in zip(line, wide, strict=True))
        print("  ".join(cells).rstrip())


def _shown(numbers: dict[str, float | None]) -> str:
    """Write numbers with their names."""
    words = {k: "never" if v is None else f"{v:.3g}" for k, v in numbers.items()}
    return ", ".join(f"{name}: {word}" for name, word in words.items())


def _draw(folder: Path, seed: int) -> None:
    """Draw what two of the cases measured."""
    from reference.workshop import drawing
    from reference.workshop.drawing import validation

    drawing.save(validation.diagram(seed), folder / "fundamental-diagram.png")
    drawing.save(validation.door(seed), folder / "door.png")
    print(f"the pictures are in {folder}", file=sys.stderr)


VALIDATE_OPTIONS: options.Table = {
    "--only": options.choice(
        CASES, f"of {', '.join(CASES)}; default: all", nargs="+", metavar="CASE"
    ),
    "--out": options.path("FOLDER", "draw the fundamental diagram and a door's flow"),
}

VALIDATE = Command(validate, VALIDATE_OPTIONS, "validate --only density door --out out")
