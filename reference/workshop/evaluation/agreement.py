"""How well two measures of a fire's difficulty agree: h, and a simulated loss.

Clause: F11.  The second measure is simulated: the reward that people without robots
lose to the fire.  Where the two disagree, it shows what each leaves out.

    h   difficulty of a fire;  R   reward, health points
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from reference.evaluation.difficulty import difficulty_of, people_in
from reference.fire import Decision, decision_at, free_places
from reference.flames import rim
from reference.paper import FIRE_SOURCES, InputError, Scenario
from reference.strategies import FireStrategy, RandomFire
from reference.workshop.evaluation.contestants import Evacuation
from reference.workshop.strategies.fires import GreedyFire
from reference.world import World

FIRES = 200
"""[F11, chosen] how many fires are compared: a correlation is then known to ±0.1."""


class DoorstepFire:
    """A fire at a random free cell around a random way out, as fires learn to."""

    def decide(self, world: World, rng: np.random.Generator) -> Decision | None:
        """Choose around any exit, or any entrance to stairs that lead down."""
        ways = [mark.index for mark in world.building.landmarks if mark.leads_out]
        around = rim(world.building, rng.choice(ways))
        places = around[free_places(world)[around]]
        if not len(places):
            return RandomFire().decide(world, rng)
        return decision_at(world, rng.choice(places))


KINDS: dict[str, type[FireStrategy]] = {
    "random": RandomFire,
    "greedy": GreedyFire,
    "doorstep": DoorstepFire,
}
"""[F11, chosen] fires of every strength, each with none to eight sources."""


@dataclass(frozen=True)
class Measured:
    """A fire with its two measures: difficulty h, and loss in health points."""

    fire: str
    sources: int
    seed: int
    difficulty: float
    loss: float


def fires_to_measure(
    plan: str, scenario: Scenario, count: int, seed: int
) -> list[Evacuation]:
    """List `count` unguided evacuations; kinds and numbers of sources take turns."""
    arms = [(fire, n) for n in range(FIRE_SOURCES + 1) for fire in KINDS]
    turns = (arms[k % len(arms)] for k in range(count))
    return [
        Evacuation(plan, replace(scenario, sources=n), "none", fire, seed + k)
        for k, (fire, n) in enumerate(turns)
    ]


def measure(evacuation: Evacuation) -> Measured:
    """Measure a fire's h, and its loss: R without any fire less R with it [F11].

    [F11, chosen] Two runs of one seed: the same people in the same places, the same
    spread of flames. The loss is negative where a fire helps: people without a map walk
    in circles, and a burnt door is one wrong door less.
    """
    spared = replace(evacuation, fire="none").simulation()
    met = spared.copy()
    met.fire_strategy = KINDS[evacuation.fire]()
    people = people_in(met.world)
    loss = spared.run().reward - met.run().reward
    h, sources = difficulty_of(met, people), evacuation.scenario.sources
    return Measured(evacuation.fire, sources, evacuation.seed, h, loss)


@dataclass(frozen=True)
class Agreement:
    """Measured fires, and how the two measures of them correlate.

    spearman, pearson  over all fires
    within  Spearman's coefficient among fires of equally many sources, pooled
    """

    fires: tuple[Measured, ...]
    spearman: float
    pearson: float
    within: float


def agreement(fires: Sequence[Measured]) -> Agreement:
    """Correlate the two measures over all fires [F11].

    Raises ValueError where a measure is equal for all fires, or for all with equally
    many sources: nothing can be compared then.
    """
    from scipy import stats  # takes a second to load

    both = np.reshape([(fire.difficulty, fire.loss) for fire in fires], (-1, 2)).T
    ranks = np.zeros(both.shape)
    sources = np.array([fire.sources for fire in fires])
    for number in np.unique(sources):
        same = sources == number
        order = stats.rankdata(both[:, same], axis=1)
        ranks[:, same] = order - order.mean(axis=1, keepdims=True)
    if not ranks.any(axis=1).all():
        raise InputError(
            f"{len(fires)} fires cannot be compared: those of equally many sources are "
            "all equally hard. Judge more of them, with people in the building."
        )
    return Agreement(
        tuple(fires),
        spearman=float(stats.spearmanr(*both).statistic),
        pearson=float(stats.pearsonr(*both).statistic),
        within=float(stats.pearsonr(*ranks).statistic),
    )
