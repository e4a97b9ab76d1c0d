"""A second candidate for the difficulty, and how well it agrees with h over many fires.

Clauses: D6, F11.  The second candidate is simulated: the reward that people without any
robots lose to a fire.  Where the two disagree, one sees what either leaves out.

    h   difficulty of a fire;  R   reward, health points
"""

from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace

import numpy as np
from scipy import stats
from tqdm import tqdm

from reference.building import Building, building_of
from reference.evaluation.difficulty import difficulty_of, people_in
from reference.fire import Decision, free_places
from reference.navigation import navigation_of
from reference.paper import FIRE_SOURCES, Scenario
from reference.simulation import Simulation
from reference.strategies import FireStrategy, NoFire, NoRobots, RandomFire
from reference.workshop.strategies.fires import GreedyFire, Replay
from reference.workshop.workers import InProcess, as_done
from reference.world import Source, World

FIRES = 200
"""[F11, chosen] how many fires are compared: a correlation is then known to ±0.1."""

DOORSTEP = 4.0
"""[F11, chosen] metres around a way out: what burns there blocks it in seconds."""


def unguided_loss(
    building: Building, scenario: Scenario, seed: int, sources: Sequence[Source]
) -> float:
    """What people without robots lose to these sources: R without fire less R with it.

    [F11, chosen] Two runs of one seed, so the same people in the same places, and the
    same spread of flames. A source whose place somebody happens to stand on appears
    elsewhere [D6]. Negative where a fire helps: people without a map walk in circles,
    and a burnt door is one wrong door less. So unlike h it may fall with one more
    source, and it tells of the ways that such people try more than of those there are.
    """
    scenario = replace(scenario, sources=len(sources))
    spared = _unguided(building, scenario, seed, NoFire())
    return _lost(spared, _unguided(building, scenario, seed, Replay(sources)))


def _unguided(
    building: Building, scenario: Scenario, seed: int, fire: FireStrategy
) -> Simulation:
    simulation = Simulation(building, scenario, NoRobots(), fire, seed)
    simulation.run()
    return simulation


def _lost(spared: Simulation, met: Simulation) -> float:
    return spared.outcome().reward - met.outcome().reward


# -- Many fires ---------------------------------------------------------------------


class Doorstep:
    """A random free cell right before a random way out: what learned fires do."""

    def decide(self, world: World, rng: np.random.Generator) -> Decision:
        """Any exit or entrance to stairs that lead down, of all floors."""
        nav = navigation_of(world.building)
        ways = [mark.index for mark in world.building.landmarks if mark.leads_out]
        near = nav.distance[rng.choice(ways)] <= DOORSTEP
        places = np.flatnonzero(near & free_places(world))
        if not len(places):
            return RandomFire().decide(world, rng)
        p = int(rng.choice(places))
        return p // nav.floor_size, *nav.centres[p].tolist()


KINDS: dict[str, type[FireStrategy]] = {
    "random": RandomFire,
    "greedy": GreedyFire,
    "doorstep": Doorstep,
}
"""[F11, chosen] fires of every strength, each with none to eight sources."""


@dataclass(frozen=True)
class Job:
    """A fire to judge; plan: the text of a floor file, fire: one of KINDS."""

    plan: str
    scenario: Scenario
    fire: str
    seed: int


@dataclass(frozen=True)
class Judged:
    """A fire by both candidates: difficulty h, and loss in health points."""

    fire: str
    sources: int
    seed: int
    difficulty: float
    loss: float


def jobs(plan: str, scenario: Scenario, count: int, seed: int) -> list[Job]:
    """So many fires, all kinds and all numbers of sources in turn, a seed each."""
    arms = [(fire, n) for n in range(FIRE_SOURCES + 1) for fire in KINDS]
    turns = (arms[k % len(arms)] for k in range(count))
    return [
        Job(plan, replace(scenario, sources=n), fire, seed + k)
        for k, (fire, n) in enumerate(turns)
    ]


def judge(job: Job) -> Judged:
    """One fire, lit among unguided people; as `unguided_loss` of its sources."""
    building = building_of(job.plan)
    spared = _unguided(building, job.scenario, job.seed, NoFire())
    met = Simulation(building, job.scenario, NoRobots(), KINDS[job.fire](), job.seed)
    people = people_in(met.world)
    met.run()
    h = difficulty_of(met, people)
    return Judged(job.fire, job.scenario.sources, job.seed, h, _lost(spared, met))


@dataclass(frozen=True)
class Agreement:
    """Fires judged by both candidates.

    Raises ValueError where either calls all fires equal: nothing can be compared then.
    """

    fires: tuple[Judged, ...]

    def __post_init__(self) -> None:
        if min(len(set(values)) for values in self._both.tolist()) < 2:
            raise ValueError(
                f"{len(self.fires)} fires that are all equally hard cannot be "
                "compared. Judge more of them, with people in the building."
            )

    @property
    def _both(self) -> np.ndarray:
        """(2, n) difficulty and loss of each fire."""
        pairs = [(fire.difficulty, fire.loss) for fire in self.fires]
        return np.reshape(pairs, (-1, 2)).T

    @property
    def spearman(self) -> float:
        """Do both put the fires in the same order? 1: in the very same."""
        return float(stats.spearmanr(*self._both).statistic)

    @property
    def pearson(self) -> float:
        """Does one grow in proportion to the other? 1: as a straight line."""
        return float(stats.pearsonr(*self._both).statistic)

    @property
    def within(self) -> float:
        """Spearman's coefficient among fires of equally many sources, pooled."""
        sources = np.array([fire.sources for fire in self.fires])
        ranks = np.zeros(self._both.shape)
        for number in np.unique(sources):
            same = sources == number
            order = stats.rankdata(self._both[:, same], axis=1)
            ranks[:, same] = order - order.mean(axis=1, keepdims=True)
        if not ranks.any(axis=1).all():
            raise ValueError(
                "no two fires that differ have equally many sources. "
                "Judge more of them."
            )
        return float(stats.pearsonr(*ranks).statistic)

    def of(self, kind: str) -> "Agreement":
        """The fires of one kind alone."""
        return Agreement(tuple(fire for fire in self.fires if fire.fire == kind))


def agreement(
    plan: str,
    scenario: Scenario | None = None,
    count: int = FIRES,
    seed: int = 0,
    executor: Executor | None = None,
) -> Agreement:
    """Judge so many fires in the building of a floor file's text [F11].

    Two runs a fire, by any executor; with none, in this process.
    """
    todo = jobs(plan, scenario or Scenario(), count, seed)
    done = as_done(executor or InProcess(), judge, todo, lambda: False)
    judged = dict(tqdm(done, total=count, unit="fire", disable=None, leave=False))
    return Agreement(tuple(judged[k] for k in range(count)))
