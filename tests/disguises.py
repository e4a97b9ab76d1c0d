"""Plans as people send them: wrapped, with separators, in other letters."""

from random import Random

SEPARATORS = ["", ",", ", ", ";", " ", "\t", "|", "','"]
MARKS = ["", "> ", "| ", "* ", "// ", "numbers", "quotes", "fence"]
LETTERS = [
    {},
    {"#": "W"},
    {".": "f"},
    {"+": "d"},
    {"#": "X", ".": "o"},
    {".": "_", "+": "D"},
    {"#": "w", ".": "F", "+": "T"},
    {"#": "1", ".": "0"},
    {"#": "1", ".": "0", "+": "2", "E": "3"},
    {"#": "\N{FULL BLOCK}", ".": "\N{MIDDLE DOT}"},
    {"#": "W", ".": " ", "E": "X"},
    {"#": "D", ".": "_"},
]
"""What is drawn instead of our signs: each is told by its place."""

FOREIGN = ["", "\N{GREEK SMALL LETTER PI}", "\N{SNOWMAN}", "%", "?"]
"""Furniture, on three cells of floor."""


def disguise(text: str, number: int) -> str:
    """A plan in the disguise of this number; all of one number are alike."""
    lot = Random(number)
    separator = lot.choice(SEPARATORS)
    mark = lot.choice(MARKS)
    letters = str.maketrans(lot.choice(LETTERS))
    foreign = lot.choice(FOREIGN)

    lines = text.splitlines()
    if lot.random() < 0.3:
        lines = [line for line in lines if not line.startswith(";")]
    rows = [n for n, line in enumerate(lines) if _is_row(line)]
    if foreign:
        _furnish(lines, rows, foreign, lot)
    for n in rows:
        lines[n] = separator.join(lines[n].translate(letters))
    return "\n".join(_marked(lines, rows, mark)) + "\n"


def _is_row(line: str) -> bool:
    code = line.partition(";")[0].rstrip()
    return bool(code) and ":" not in code


def _furnish(lines: list[str], rows: list[int], sign: str, lot: Random) -> None:
    """Put a sign on three cells, with floor at their left and right."""
    places = [
        (n, column)
        for n in rows
        for column in range(1, len(lines[n]) - 1)
        if lines[n][column - 1 : column + 2] == "..."
    ]
    for n, column in lot.sample(places, 3):
        lines[n] = lines[n][:column] + sign + lines[n][column + 1 :]


def _marked(lines: list[str], rows: list[int], mark: str) -> list[str]:
    """Lines with a mark; quotes stand around rows only."""
    if mark == "fence":
        return ["```", *lines, "```"]
    if mark == "numbers":
        return [f"{n:3}: {line}" for n, line in enumerate(lines, 1)]
    if mark == "quotes":
        quoted = [f'  "{ln}",' if n in rows else ln for n, ln in enumerate(lines)]
        return ["plan = [", *quoted, "]"]
    return [f"{mark}{line}" for line in lines]
