"""Strategies of robots and fires by name, in order of skill and of harm.

Clauses: C7, D2.  To add one, write a class with a `decide` as `reference.strategies`
describes it, in `robots.py` or `fires.py` here, and name it in the table below: then
every command knows it.
"""

from reference.strategies import (
    FireStrategy,
    NoFire,
    NoRobots,
    RandomFire,
    RandomRobots,
    RobotStrategy,
)
from reference.workshop.strategies.fires import GreedyFire
from reference.workshop.strategies.robots import Patrol, Sweep

ROBOTS: dict[str, type[RobotStrategy]] = {
    "none": NoRobots,
    "random": RandomRobots,
    "patrol": Patrol,
    "sweep": Sweep,
}
FIRES: dict[str, type[FireStrategy]] = {
    "none": NoFire,
    "random": RandomFire,
    "greedy": GreedyFire,
}


def robots_named(name: str | RobotStrategy) -> RobotStrategy:
    """Robots by a name of ROBOTS, or the strategy itself. Raises ValueError."""
    if isinstance(name, str) and name not in ROBOTS:
        raise ValueError(
            f"no robots are called {name!r}; there are {', '.join(ROBOTS)}"
        )
    return ROBOTS[name]() if isinstance(name, str) else name


def fire_named(name: str | FireStrategy) -> FireStrategy:
    """A fire by a name of FIRES, or the strategy itself. Raises ValueError."""
    if isinstance(name, str) and name not in FIRES:
        raise ValueError(f"no fire is called {name!r}; there are {', '.join(FIRES)}")
    return FIRES[name]() if isinstance(name, str) else name
