"""What the engine keeps with an object of the book: it goes when the object goes."""

from collections.abc import Callable
from typing import Any, TypeVar

Thing = TypeVar("Thing")


def _fits(thing: Any) -> bool:
    return True


def kept_with(
    owner: Any,
    name: str,
    begin: Callable[[], Thing],
    fits: Callable[[Thing], bool] = _fits,
) -> Thing:
    """What is kept under a name with an object of the book, begun once.

    It is begun again where it does not fit any more, or is None: a copy's.
    """
    attribute = f"_engine_{name}"
    thing: Thing | None = vars(owner).get(attribute)
    if thing is None or not fits(thing):
        thing = begin()
        vars(owner)[attribute] = thing
    return thing
