"""What README and RESULTS say of the contest is what the kept table says.

`tutorials/tables/contest.json` is the `cells.json` of the command in RESULTS, section
"A contest that can be answered". Whoever makes it anew is told here which lines of text
no longer hold.
"""

import json
from itertools import product

import pytest
from conftest import ROOT

CELLS = {
    (cell["robots"], cell["fire"]): cell
    for cell in json.loads(
        (ROOT / "tutorials" / "tables" / "contest.json").read_text(encoding="utf-8")
    )["cells"]
}
GUIDES = ("none", "sweep", "escort", "observer", "guard", "learned")
FIRES = ("none", "random", "greedy", "closer", "busiest", "fixed", "learned")
SCRIPTED = ("random", "greedy", "closer", "busiest", "fixed")
README = (ROOT / "README.md").read_text(encoding="utf-8")
RESULTS = (ROOT / "RESULTS.md").read_text(encoding="utf-8")


def figure(robots: str, fire: str, name: str = "survival", end: str = "mean") -> float:
    """A figure of a cell: of survival and gain in per cent."""
    share = name in ("survival", "gain")
    return CELLS[robots, fire][name][end] * (100 if share else 1)


def signed(number: float) -> str:
    """With one decimal and a true minus sign, as it is printed."""
    return f"{number:.1f}".replace("-", "−")


def gain(robots: str, fire: str) -> str:
    """Points more than `escort`, with the interval, as it is printed."""
    mean, low, high = (
        signed(figure(robots, fire, "gain", end)) for end in ("mean", "low", "high")
    )
    return f"{mean} [{low}, {high}]"


def row(first: str, cells: list[str]) -> str:
    """A line of a table in Markdown."""
    return f"| {first} | {' | '.join(cells)} |"


def lines_of_readme() -> list[str]:
    """Survivors in whole per cent."""
    return [
        row(f"`{who}`", [f"{figure(who, fire):.0f}" for fire in FIRES])
        for who in GUIDES
    ]


def lines_of_results() -> list[str]:
    """Survivors with R; how hard the fires of `escort` were; differences from it."""
    survivors = [
        row(
            f"`{who}`",
            [
                f"{figure(who, fire):.1f} ({figure(who, fire, 'reward'):,.0f})".replace(
                    "-", "−"
                )
                for fire in FIRES
            ],
        )
        for who in GUIDES
    ]
    h = row("h", [f"{figure('escort', fire, 'difficulty'):,.0f}" for fire in FIRES])
    differences = [
        row(f"`{who}`", [gain(who, fire) for fire in FIRES])
        for who in GUIDES
        if who != "escort"
    ]
    return [*survivors, h, *differences]


@pytest.mark.parametrize(
    ("text", "line"),
    [
        *product(["README"], lines_of_readme()),
        *product(["RESULTS"], lines_of_results()),
    ],
)
def test_a_row_of_a_table_is_that_of_the_kept_table(text, line):
    """Figure by figure, in README rounded to whole per cent."""
    assert line in {"README": README, "RESULTS": RESULTS}[text].splitlines()
