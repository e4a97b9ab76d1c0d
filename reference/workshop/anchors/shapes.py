"""Shapes and units of what a network of sets reads, robots' and fire's."""

from dataclasses import dataclass
from typing import NamedTuple

from reference.workshop.anchors.frame import AnchorSizes

NO_IMAGE = (0, 0, 0)  # of the fire's grid: it is told what burns beside each anchor
# what counts as one, in the numbers that a network reads
CREW = 2.0  # robots
GROUP = 5.0  # people at one place
SOURCES = 5.0  # of fire
EXITS = 4.0  # of a building
AWAY = 30.0  # metres from the outside
WIDE = 4.0  # cells of a way out
BLAZE = 10.0  # burning cells; so many are half of very many


class SetShapes(NamedTuple):
    """(elements, numbers of each) of what an agent reads, in this order.

    The numbers of an element do not depend on the building. The last number of each
    is 1 for elements that are there. Before them stand the C numbers of each anchor,
    x and y, the fire's after a storey, and 1 for each that may be chosen; after them
    `counts` further numbers, and at last how many elements there are of each set: so
    numbers of any building can be taken apart.
    """

    anchors: tuple[int, int]
    people: tuple[int, int]
    mates: tuple[int, int]  # for the fire: all robots
    fires: tuple[int, int]
    counts: int


SETS = len(SetShapes._fields) - 1


@dataclass(frozen=True, kw_only=True)
class SetSizes(AnchorSizes):
    """Shapes of a network that reads sets.

    What they tell is scaled, so it has no normaliser, whatever `normalize` says.
    """

    sets: SetShapes
