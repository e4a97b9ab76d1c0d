"""How fast it runs: the world, rollouts in it, and what learns from them.

Clauses: B8.  Everything on, sight and minds and robots and fire, beside the bare crowd
of `motion`: compare the two, not machines.  Learners use all cores, the rest one.
"""

from statistics import median
from time import perf_counter
from typing import Any

import numpy as np
from tqdm import tqdm

from reference import motion
from reference.building import Building, load
from reference.paper import PEOPLE, Scenario
from reference.simulation import Simulation
from reference.strategies import RandomFire
from reference.workshop.strategies.robots import Sweep

RUNS = 5
CASES = {
    "40": (PEOPLE, 20.0),
    "400": (10 * PEOPLE, 20.0),
    "40_whole": (PEOPLE, Scenario.time_limit),
}
"""People, and seconds at which the clock stops; everybody is inside in the first 20."""


def measure(name: str, seed: int) -> dict[str, Any]:
    """All figures of a building, medians over RUNS seeds from this one on.

    Raises ValueError for more people than fit, and what reading a map raises.
    """
    seeds = range(seed, seed + RUNS)
    loads = [_load_seconds(name) for _ in seeds]
    building = load(name)
    speeds, bare = {}, {}
    for case, (people, seconds) in tqdm(CASES.items(), disable=None, leave=False):
        scenario = Scenario(people=people)
        runs = [
            Simulation(
                building, scenario, seed=number, fire=RandomFire(), robots=Sweep()
            )
            for number in seeds
        ]
        bare[case] = median(_bare_speed(run, seconds) for run in runs)
        speeds[case] = median(_speed(run, seconds) for run in runs)
    return {
        "building": name,
        "seed": seed,
        "person_seconds_per_second": speeds,
        "bare_step": bare,
        "load_seconds": median(loads),
        **_learning_speeds(building, seed),
    }


def _learning_speeds(building: Building, seed: int) -> dict[str, Any]:
    """What rollouts and learners do in a second; torch is loaded only now."""
    from reference.workshop import learning_speed

    return {
        "decisions_per_second": learning_speed.decisions_per_second(building, seed),
        "learner_samples_per_second": learning_speed.learner_samples_per_second(
            building, seed
        ),
    }


def table(title: str, facts: dict[str, Any]) -> str:
    """What was measured, for people."""
    last = facts["seed"] + RUNS - 1
    lines = [
        f"{title}, one core, median of seeds {facts['seed']} to {last}",
        f"{'person-seconds per second':27}{'everything on':>15}{'bodies alone':>15}",
    ]
    for case, (people, seconds) in CASES.items():
        what = "whole" if case.endswith("whole") else f"first {seconds:.0f} s"
        speed, bare = (
            facts["person_seconds_per_second"][case],
            facts["bare_step"][case],
        )
        lines.append(f"{f'{people} people, {what}':27}{speed:15,.0f}{bare:15,.0f}")
    lines.append(f"read, checked and prepared in {facts['load_seconds']:.2f} s")
    decisions = facts["decisions_per_second"]
    lines.append(f"rollouts: {decisions:,.0f} robot decisions per second, one core")
    samples = facts["learner_samples_per_second"]
    learners = ", ".join(f"{name} {count:,.0f}" for name, count in samples.items())
    lines.append(f"learners, samples per second, all cores: {learners}")
    return "\n".join(lines)


def _load_seconds(name: str) -> float:
    """How long it takes until the first tick can begin."""
    start = perf_counter()
    Simulation(load(name), fire=RandomFire(), robots=Sweep())
    return perf_counter() - start


def _speed(simulation: Simulation, seconds: float) -> float:
    """Person-seconds per second of a run up to a time, with everything on."""
    start = perf_counter()
    while not simulation.done and simulation.world.time < seconds:
        simulation.step()
    return simulation.person_seconds / (perf_counter() - start)


def _bare_speed(simulation: Simulation, seconds: float) -> float:
    """The same for bodies alone: everybody walks to where somebody else began."""
    bodies, tick = simulation.world.bodies, simulation.tick
    position, floor = bodies.position, bodies.floor
    navigation = simulation.navigation

    def free(spots: np.ndarray, who: np.ndarray) -> np.ndarray:
        return navigation.walkable[navigation.places_at(floor[who], spots)]

    aim = np.roll(position, 1, axis=0)
    ticks = round(seconds / tick)
    start = perf_counter()
    for _ in range(ticks):
        position = motion.step(position, floor, aim, bodies.pace, tick, free)
    return len(bodies) * ticks * tick / (perf_counter() - start)
