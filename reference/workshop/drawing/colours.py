"""Colours of those who play: a strategy's is the same in every picture.

What ships has Petroff's eight, which every eye tells apart. Anything else, such as code
of one's own or a checkpoint, has one of nine others, by its name alone. None of them is
faint on white, and no line is dotted, as that of `none` is.
"""

from collections.abc import Iterable
from zlib import crc32

from reference.workshop.drawing.page import Style
from reference.workshop.strategies import ANY_MAP, LEARNED

OF_THOSE_THAT_SHIP: dict[str, tuple[str, str]] = {
    "none": ("#656364", ":"),
    "random": ("#adad7d", "-."),
    "patrol": ("#578dff", "--"),
    "sweep": ("#86c8dd", "-"),
    "escort": ("#c849a9", "-"),
    "observer": ("#ff5e02", "--"),
    "guard": ("#c91f16", "-."),
    LEARNED: ("#1845fb", "-"),
    ANY_MAP: ("#1845fb", "-"),
}
"""Colour and dashes of robots that ship, by the word that pictures call them."""

OTHERS: tuple[str, ...] = ("#732222", "#3e2a8c", "#158c45", "#9900bf")
OTHERS += ("#00bf36", "#73396a", "#1b593b", "#006b8c", "#000000")
"""Each as far as may be, for four kinds of eye, from Petroff's and those before it."""

DASHES = ("-", "--", ":", "-.")
DASHES_OF_OTHERS = ("-", "--", "-.")
LINES: tuple[Style, ...] = tuple(
    {"ls": dashes, "lw": width}
    for width in (1.9, 1.0, 2.8)
    for dashes in DASHES_OF_OTHERS
)
"""Lines that tell those apart whose names come to one colour."""


def colour_of(name: str) -> str:
    """The colour of robots, by the word that pictures call them."""
    if name in OF_THOSE_THAT_SHIP:
        return OF_THOSE_THAT_SHIP[name][0]
    return OTHERS[crc32(name.encode()) % len(OTHERS)]


def lines_of(names: Iterable[str]) -> dict[str, Style]:
    """Choose a line for each of the robots: its colour, and dashes that nobody has."""
    looks: dict[str, Style] = {}
    for name in names:
        look: Style = {"color": colour_of(name)}
        if name in OF_THOSE_THAT_SHIP:
            looks[name] = look | LINES[0] | {"ls": OF_THOSE_THAT_SHIP[name][1]}
            continue
        first = crc32(name.encode()) // len(OTHERS) % len(DASHES_OF_OTHERS)
        lines = [look | LINES[(first + k) % len(LINES)] for k in range(len(LINES))]
        free = [line for line in lines if line not in looks.values()]
        looks[name] = (free or lines)[0]
    return looks
