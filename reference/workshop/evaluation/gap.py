"""Re-score fires' placements in fresh futures.

Clause: F4.  Neither a critic nor a look-ahead is trusted: several fires choose at the
same moments, and each choice is then simulated to the end in the same futures, which no
fire has seen, with the same rule for later fires.

    M  moments;  K  futures of each
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from reference.events import FireLit
from reference.fire import Decision
from reference.game.rewards import group_reward
from reference.paper import Scenario
from reference.simulation import Simulation
from reference.strategies import RandomFire
from reference.workshop.evaluation.contestants import WORST, Evacuation, contestant
from reference.workshop.evaluation.intervals import Interval, of_mean
from reference.workshop.evaluation.worst_case.look_ahead import FirstAt

FUTURES = 8
"""[F4, chosen] futures of each moment: their flames differ a lot."""

LATEST = 4
"""[F4, chosen] moments have 0 to 3 fires before them; later there is little to lose."""


# -- Re-scoring ---------------------------------------------------------------------


@dataclass(frozen=True)
class Comparison:
    """Fires that each choose a place at one moment of an evacuation.

    evacuation  that contains the moment, with random fires till then
    fires       words that `contestant` knows
    before      sources that have broken out by then
    futures     K
    """

    evacuation: Evacuation
    fires: tuple[str, ...]
    before: int
    futures: int


@dataclass(frozen=True)
class Result:
    """The rewards that each fire's placement leaves.

    rewards   by fire, K from the moment on; "none": no fire breaks out then
    foreseen  what `worst-case` expected of its placement; None if it was not asked,
              or found no place for a fire
    """

    comparison: Comparison
    rewards: dict[str, tuple[float, ...]]
    foreseen: float | None


def comparisons(
    plan: str,
    scenario: Scenario,
    robots: str,
    fires: Sequence[str],
    seeds: Sequence[int],
) -> Iterator[Comparison]:
    """Take one moment of each evacuation, so that moments are independent."""
    for k, seed in enumerate(seeds):
        before = k % min(LATEST, max(1, scenario.sources))
        evacuation = Evacuation(plan, scenario, robots, "random", seed)
        yield Comparison(evacuation, tuple(fires), before, FUTURES)


def rescore(comparison: Comparison) -> Result | None:
    """Let every fire choose, and simulate every choice in the same futures.

    None if the evacuation was over before the moment came. Raises ValueError for words
    that name nobody.
    """
    now = moment_of(comparison)
    if now is None:
        return None
    fires = {word: contestant(word, "fire") for word in comparison.fires}
    placements: dict[str, Decision | None] = {"none": None}
    placements |= {word: placement_of(fire, now) for word, fire in fires.items()}
    seeds = np.random.SeedSequence((comparison.evacuation.seed, comparison.before))
    drawn = seeds.generate_state(comparison.futures).tolist()
    futures = [now.another_future(seed) for seed in drawn]
    scored = {
        place: tuple(_reward(future, place) for future in futures)
        for place in set(placements.values())
    }
    foreseen = fires[WORST].foreseen if WORST in fires else []
    return Result(
        comparison,
        rewards={word: scored[place] for word, place in placements.items()},
        foreseen=foreseen[0].reward if foreseen else None,
    )


class _Pause(RandomFire):
    """Random fires that save the simulation once `before` have broken out."""

    def __init__(self, before: int):
        self.before = before
        self.now: Simulation | None = None

    def watch(self, now: Simulation) -> None:
        """Save the simulation, if this is the moment."""
        if len(now.world.flames.sources) == self.before:
            self.now = now


def moment_of(comparison: Comparison) -> Simulation | None:
    """Play the evacuation until the moment; None if it ends before."""
    simulation = comparison.evacuation.simulation()
    simulation.fire_strategy = pause = _Pause(comparison.before)
    while pause.now is None and not simulation.done:
        simulation.step()
    return pause.now


def placement_of(fire: Any, now: Simulation) -> Decision | None:
    """Let a fire choose now, by all the rules; None if it does not break out."""
    run = now.copy()
    run.fire_strategy = fire
    lit = [event for event in run.step() if isinstance(event, FireLit)]
    return (lit[0].floor, lit[0].x, lit[0].y) if lit else None


def _reward(future: Simulation, placement: Decision | None) -> float:
    """Simulate a future to its end: a fire there, later ones on the busiest ways."""
    run = future.copy()
    run.fire_strategy = FirstAt(placement)
    run.run()
    return group_reward(run.events[len(future.events) :])


# -- Averages over moments ----------------------------------------------------------


def gap(results: Sequence[Result], one: str, other: str) -> Interval:
    """Average how much more reward `one` leaves than `other`; from "none": its harm.

    Raises ValueError for no results.
    """
    return of_mean(gaps(results, one, other))


def gaps(results: Sequence[Result], one: str, other: str) -> np.ndarray:
    """Compute the same at each moment, over its futures: (M,) means."""
    return _means(results, one) - _means(results, other)


def optimism(results: Sequence[Result]) -> Interval | None:
    """Average how much more reward came than `worst-case`, a minimum, foresaw.

    None where it foresaw nothing.
    """
    asked = [result for result in results if result.foreseen is not None]
    foreseen = np.array([result.foreseen for result in asked], dtype=float)
    return of_mean(_means(asked, WORST) - foreseen) if asked else None


def _means(results: Sequence[Result], fire: str) -> np.ndarray:
    return np.array([np.mean(result.rewards[fire]) for result in results])
