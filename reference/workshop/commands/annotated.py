"""The command that writes the paper beside the code: paper."""

from argparse import Namespace
from pathlib import Path

from reference.workshop.commands import options
from reference.workshop.commands.common import Command, writable
from reference.workshop.files import write_whole
from reference.workshop.maps import load


def paper(arguments: Namespace) -> None:
    """Writes the annotated paper: one page of clauses, code, tests and pictures."""
    from reference.workshop.annotated.index import marked_tests
    from reference.workshop.annotated.page import page

    writable(arguments.output, "a page", (".html",))
    marked_tests()
    write_whole(arguments.output, page(load("paper")).encode())
    print(arguments.output)


OPTIONS: options.Table = {
    "-o/--output": options.path(
        "FILE", "a .html file; default: paper.html", default=Path("paper.html")
    )
}

PAPER = Command(paper, OPTIONS, "paper -o paper.html", numbers=False, chance=False)
