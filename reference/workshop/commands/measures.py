"""Commands about the model: validate, how people move; bench, how fast; and paper."""

from argparse import Namespace
from pathlib import Path
from shutil import get_terminal_size
from textwrap import fill
from typing import Any

from tqdm import tqdm

from reference.workshop.commands import options
from reference.workshop.commands.common import (
    format_figure,
    format_table,
    print_note,
    print_report,
)
from reference.workshop.maps import load
from reference.workshop.measuring.validation import CASES, NOT_MODELLED, measure_case
from reference.workshop.storage.files import refuse_unwritable, write_whole

LASTS = "all cases take half a minute, more on a busy machine; --only names some"


@options.command(
    "validate --only corridor doors -o diagram.png",
    options.option(
        "--only",
        f"one case or more, of {', '.join(CASES)}; default: all",
        metavar="CASE",
        choices=tuple(CASES),
        nargs="+",
    ),
    options.output("-o --output", options.PICTURES, "draw the fundamental diagram"),
    options.SEED,
    options.json("seed", "cases", "not_modelled"),
)
def validate(arguments: Namespace) -> None:
    """Measures standard pedestrian cases; exit status 0 also where a case fails."""
    seed = arguments.seed or 0
    names = list(dict.fromkeys(arguments.only or CASES))
    if not arguments.only:
        print_note(LASTS)
    progress = tqdm(names, unit="case", disable=None, leave=False)
    cases = [measure_case(name, seed) for name in progress]
    missing = {} if arguments.only else NOT_MODELLED

    told = [*map(_case_in_words, cases)]
    told += [
        wrapped(f"not modelled  {name}: {what}", f"why not: {why}")
        for name, (what, why) in missing.items()
    ]
    report = {"seed": seed, "cases": cases, "not_modelled": missing}
    print_report(arguments, report, "\n".join(told))
    if arguments.output:
        from reference.workshop.drawing import save, validation  # loads matplotlib

        print_note(f"written: {save(validation.diagram(seed), arguments.output)}")


def _case_in_words(case: dict[str, Any]) -> str:
    """Write a case in words: its verdict, what was measured, and what to know of it."""
    runs = case["runs"]
    words = {name: format_figure(value) for name, value in case["measured"].items()}
    for name, count in case["never"].items():
        words[name] += f" (never in {count}/{runs})"
    numbers = ", ".join(f"{name}: {word}" for name, word in words.items())
    if case["note"]:
        numbers += f" ({case['note']})"
    verdict = case["verdict"]
    if case["failed"]:
        verdict += f" {case['failed']}/{runs}"
    return wrapped(
        f"{verdict}  {case['source']}: {case['what']}",
        f"accepted: {case['accepted']}",
        f"measured: {numbers}",
    )


def wrapped(head: str, *lines: str) -> str:
    """Fit a line, and others further in below it, into the terminal's width."""
    width = max(40, get_terminal_size().columns)
    parts = [fill(head, width, subsequent_indent="    ")]
    look: dict[str, Any] = {"initial_indent": "    ", "subsequent_indent": "      "}
    return "\n".join([*parts, *(fill(line, width, **look) for line in lines)])


@options.command(
    "bench --json",
    options.building("paper"),
    options.SEED,
    options.json("the table: what, of what, then book and engine"),
)
def bench(arguments: Namespace) -> None:
    """Measures speed: what is simulated, decided and learned from in a second."""
    from reference.workshop.measuring import bench  # loads torch

    name = "paper" if arguments.building is None else arguments.building
    report = bench.measure_speed(name, arguments.seed or 0)
    rows: list[tuple[str, ...]] = [("what", "of what", "book", "engine", "times")]
    for what, cases in report.items():
        words = what.replace("_", " ")
        rows += [(words, case, *_columns(figures)) for case, figures in cases.items()]
    print_report(arguments, report, format_table(rows, "<<>>>"))
    if why := bench.why_no_engine():
        print_note(f"The engine stands aside, so its column is empty: {why}.")


def _columns(figures: dict[str, float | None]) -> tuple[str, ...]:
    """Write three digits of the book's figure, the engine's, and how many times."""
    rounded = {
        player: format_figure(None if value is None else float(f"{value:.3g}"))
        for player, value in figures.items()
    }
    if "both" in figures:
        return rounded["both"], "same", ""
    book = figures.get("book")
    engine = figures["engine"]
    times = ""
    if book and engine:
        times = f"{max(book, engine) / min(book, engine):.1f}"
    return rounded.get("book", format_figure(None)), rounded["engine"], times


@options.command(
    "paper -o paper.html",
    options.output("-o --output", ".html", "the page", Path("paper.html")),
)
def paper(arguments: Namespace) -> None:
    """Writes the annotated paper: one page of clauses, code, tests and pictures."""
    from reference.workshop.annotated.page import annotated_page  # loads matplotlib

    refuse_unwritable(arguments.output)
    write_whole(
        arguments.output,
        annotated_page(load("paper"), arguments.output.parent).encode(),
    )
    print(arguments.output)
