"""What worst cases are worth: their placements re-scored in fresh futures, their cost.

Clauses: F4.  Neither a critic nor a look-ahead is believed: several fires choose at the
same moments, and what each chose is then run to the end in the same futures, which none
of them has seen, with the same rule for later fires.  The functions that do it are
pure, so that any executor may call them.

    M  moments;  K  futures of each
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from time import process_time
from typing import Any

import numpy as np

from reference.building import building_of
from reference.events import FireLit
from reference.fire import Decision
from reference.game.rewards import group_reward
from reference.paper import Scenario
from reference.simulation import Simulation
from reference.strategies import RandomFire
from reference.workshop.evaluation.contestants import WORST, contestant
from reference.workshop.evaluation.intervals import Interval, of_difference, of_mean
from reference.workshop.evaluation.worst_case import WorstCase
from reference.workshop.evaluation.worst_case.look_ahead import First
from reference.workshop.strategies import FIRES

FUTURES = 8
"""[F4, chosen] of each moment: flames of one future differ much from another's."""

LATEST = 4
"""[F4, chosen] moments have 0 to 3 fires before them; later there is little to lose."""


# -- Re-scoring ---------------------------------------------------------------------


@dataclass(frozen=True)
class Question:
    """Where would these fires break out at one moment, and what does that do?

    plan     the text of a floor file;  scenario  of the evacuation
    robots   a word that `contestant` knows;  fires  such words
    before   random fires that have broken out when it is the turn of these
    futures  K
    """

    plan: str
    scenario: Scenario
    robots: str
    fires: tuple[str, ...]
    seed: int
    before: int
    futures: int = FUTURES


@dataclass(frozen=True)
class Answer:
    """What became of it.

    time        of the moment, s
    placements  by fire, None where it does not break out
    rewards     by fire, K: from the moment on
    unlit       K: the same if no fire breaks out at this turn
    foreseen    what `worst-case` expected of its placement, None if it was not asked
    """

    question: Question
    time: float
    placements: dict[str, Decision | None]
    rewards: dict[str, tuple[float, ...]]
    unlit: tuple[float, ...]
    foreseen: float | None


def questions(
    plan: str,
    scenario: Scenario,
    robots: str,
    fires: Sequence[str],
    seeds: Sequence[int],
    futures: int = FUTURES,
) -> Iterator[Question]:
    """One moment of each evacuation, so that moments do not depend on each other."""
    for k, seed in enumerate(seeds):
        before = k % min(LATEST, max(1, scenario.sources))
        yield Question(plan, scenario, robots, tuple(fires), seed, before, futures)


def answer(question: Question) -> Answer | None:
    """None if the evacuation was over before the moment came.

    Raises ValueError for words that name nobody.
    """
    now = _moment(question)
    if now is None:
        return None
    fires = {word: _fire(word) for word in question.fires}
    placements = {word: _placement(now, fire) for word, fire in fires.items()}
    seeds = np.random.SeedSequence((question.seed, question.before))
    drawn = seeds.generate_state(question.futures).tolist()
    futures = [now.another_future(seed) for seed in drawn]
    scored = {
        place: tuple(_reward(future, place) for future in futures)
        for place in {None, *placements.values()}
    }
    worst = fires.get(WORST)
    return Answer(
        question,
        now.world.time,
        placements,
        {word: scored[place] for word, place in placements.items()},
        scored[None],
        worst.foreseen[0].reward if worst is not None else None,
    )


class _Pause(RandomFire):
    """Random fires, and how things stood when so many had broken out."""

    def __init__(self, before: int):
        self.before = before
        self.now: Simulation | None = None

    def watch(self, now: Simulation) -> None:
        """Keep it, if this is the moment."""
        if len(now.world.flames.sources) == self.before:
            self.now = now


def _moment(question: Question) -> Simulation | None:
    """How things stand when it is the turn of the fires that are asked."""
    pause = _Pause(question.before)
    simulation = Simulation(
        building_of(question.plan),
        replace(question.scenario, training=False),
        contestant(question.robots, "robots"),
        pause,
        question.seed,
    )
    while pause.now is None and not simulation.done:
        simulation.step()
    return pause.now


def _fire(word: str) -> Any:
    """A fire that can be asked."""
    fire = contestant(word, "fire")
    return FIRES[fire]() if isinstance(fire, str) else fire


def _placement(now: Simulation, fire: Any) -> Decision | None:
    """Where a fire breaks out now, by all the rules; None if it does not."""
    trial = now.copy()
    trial.fire_strategy = fire
    lit = [event for event in trial.step() if isinstance(event, FireLit)]
    return (lit[0].floor, lit[0].x, lit[0].y) if lit else None


def _reward(future: Simulation, placement: Decision | None) -> float:
    """To the end of a future, with a fire there and then beside the busiest ways."""
    run = future.copy()
    run.fire_strategy = First(placement)
    run.run()
    return group_reward(run.events[len(future.events) :])


# -- What the answers say -----------------------------------------------------------


def rescored(answers: Sequence[Answer], fire: str) -> Interval:
    """The reward that a fire's placements leave, over moments.

    Raises ValueError for no answers, as all of these do.
    """
    return of_mean(_means(answers, fire))


def harm(answers: Sequence[Answer], fire: str) -> Interval:
    """How much reward it costs, compared with no fire at this turn."""
    return of_mean(harms(answers, fire))


def harms(answers: Sequence[Answer], fire: str) -> np.ndarray:
    """(M,) the same at each moment."""
    unlit = np.array([np.mean(answer.unlit) for answer in answers])
    return unlit - _means(answers, fire)


def gap(answers: Sequence[Answer], one: str, other: str) -> Interval:
    """How much more reward one fire leaves than another at the same moments."""
    return of_difference(_means(answers, one), _means(answers, other))


def optimism(answers: Sequence[Answer]) -> Interval:
    """How much more reward there is than `worst-case` foresaw of its own placements.

    It takes the least of many noisy values: some are low by chance.
    """
    known = [a for a in answers if a.foreseen is not None]
    foreseen = [a.foreseen for a in known if a.foreseen is not None]
    return of_difference(_means(known, WORST), foreseen)


def _means(answers: Sequence[Answer], fire: str) -> np.ndarray:
    """(M,) over the futures of each moment."""
    return np.array([np.mean(answer.rewards[fire]) for answer in answers])


# -- Cost ---------------------------------------------------------------------------


@dataclass(frozen=True)
class Attempt:
    """One evacuation against `worst-case`, with so many sources; as in `Question`."""

    plan: str
    scenario: Scenario
    robots: str
    seed: int
    sources: int


@dataclass(frozen=True)
class Cost:
    """What it took: decisions of the fire, seconds simulated in looking ahead.

    process_seconds  of this process, for the whole evacuation
    """

    decisions: int
    simulated_seconds: float
    process_seconds: float


def cost(attempt: Attempt) -> Cost:
    """Evacuate, and measure."""
    start, fire = process_time(), WorstCase()
    simulation = Simulation(
        building_of(attempt.plan),
        replace(attempt.scenario, sources=attempt.sources),
        contestant(attempt.robots, "robots"),
        fire,
        attempt.seed,
    )
    simulation.run()
    lit = sum(isinstance(event, FireLit) for event in simulation.events)
    looked = fire.ticks * simulation.tick
    return Cost(lit, looked, process_time() - start)
