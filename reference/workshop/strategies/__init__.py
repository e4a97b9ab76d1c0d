"""Strategies of robots and fires by name.

To add one, write a class with a `decide` as `RobotStrategy` or `FireStrategy` describes
it, in a module here, and name it in the table below: then every command knows it. The
first line of its docstring is what the commands say of it.
"""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from reference.fire import FireStrategy, NoFire, RandomFire
from reference.learning.settings import Side
from reference.robots import NoRobots, RobotStrategy
from reference.workshop.strategies.fires import (
    BusiestFire,
    CloserFire,
    FixedFire,
    GreedyFire,
)
from reference.workshop.strategies.guard import Guard
from reference.workshop.strategies.guides import (
    Escort,
    Observer,
    Patrol,
    RandomRobots,
    Sweep,
)

__all__ = [
    "ANYWHERE",
    "ANY_MAP",
    "FIRES",
    "GUIDES",
    "LEARNED",
    "ROBOTS",
    "SCRIPTS",
    "SHIPPED",
    "BusiestFire",
    "CloserFire",
    "Escort",
    "FixedFire",
    "GreedyFire",
    "Guard",
    "NoFire",
    "NoRobots",
    "Observer",
    "Patrol",
    "RandomFire",
    "RandomRobots",
    "Sweep",
]

ROBOTS: dict[str, type[RobotStrategy]] = {  # [C7]
    "none": NoRobots,
    "random": RandomRobots,
    "patrol": Patrol,
    "sweep": Sweep,
    "escort": Escort,
    "observer": Observer,
    "guard": Guard,
}
GUIDES = tuple(name for name in ROBOTS if name != "none")  # who can be copied
FIRES: dict[str, type[FireStrategy]] = {  # [D2]
    "none": NoFire,
    "random": RandomFire,
    "greedy": GreedyFire,
    "closer": CloserFire,
    "fixed": FixedFire,
    "busiest": BusiestFire,
}
SCRIPTS: Mapping[Side, Mapping[str, Callable[[], Any]]] = {
    "robots": ROBOTS,
    "fire": FIRES,
}
"""Hand-written strategies of each side."""

LEARNED = "learned"
"""Name, on both sides, of the policies that ship."""

SHIPPED = Path(__file__).with_name("learned.pt")
"""Their checkpoint, weights alone, with how they learned; for the paper's building."""

ANYWHERE = Path(__file__).with_name("learned_anywhere.pt")
"""The checkpoint that plays elsewhere, for any number of people and robots."""

ANY_MAP = f"{LEARNED}, any map"
"""What tables and pictures say where it plays."""
