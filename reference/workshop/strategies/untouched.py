"""Refuse to let code of one's own change the world: who decides only looks at it.

`robot.position += 1` would move the robot, and no run would tell.  A change of the map,
or of the paper's numbers, would change all runs that follow.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from copy import copy
from typing import Any

import numpy as np

from reference.paper import InputError
from reference.workshop.storage.numbers import paper_numbers
from reference.world import World


@contextmanager
def untouched(world: World, word: str) -> Iterator[None]:
    """Let code decide, and see whether the world is as before; minds are not compared.

    word: names the code, for the message.
    Raises InputError that names what has changed.
    """
    before = list(_parts(world))
    yield
    for (name, old), (_, new) in zip(before, _parts(world), strict=False):
        if new != old:
            raise InputError(
                f"{word}: decide changes {name}. Who decides only looks at the world; "
                "change copies of what is in it, such as robot.position.copy()."
            )


def _parts(world: World) -> Iterator[tuple[str, Any]]:
    """Yield copies of what a world is made of, by the names that a strategy uses."""
    yield "world.time", world.time
    yield "world.robots", [id(robot) for robot in world.robots]
    yield "world.burnt", copy(world.burnt)
    for kind in ("bodies", "flames"):
        for name, value in vars(getattr(world, kind)).items():
            yield f"world.{kind}.{name}", _copied(value)
    for robot in world.robots:
        for name, value in vars(robot).items():
            yield f"robot.{name}", _copied(value)
    for name in ("kind", "walkable", "area", "landmark"):
        yield f"world.building.{name}", _copied(getattr(world.building, name))
    for name, number in paper_numbers().items():
        yield f"paper.{name}", number


def _copied(value: Any) -> Any:
    """Copy a value, so that it can be compared; of an array, its bytes."""
    return value.tobytes() if isinstance(value, np.ndarray) else copy(value)
