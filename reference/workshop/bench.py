"""Measure the speed of the simulation, of rollouts and of the learners.

Clauses: B8, E1, E2, E3.  The whole simulation (sight, minds, robots, fire) is timed
beside the bare crowd of `motion`: compare the two, not machines.  Learners use all
cores, the rest one; their sizes are the paper's, minibatches of about 1024 decisions.

    N  group decisions of a buffer;  G  agents
"""

from dataclasses import replace
from statistics import median
from time import perf_counter
from typing import Any

import numpy as np
import torch
from tqdm import tqdm

from reference import motion
from reference.building import Building, plan_of
from reference.game.environment import until_next_decision
from reference.learning.adversarial import learner_for, player_of
from reference.learning.experience import Decisions
from reference.learning.networks import one_thread
from reference.learning.ppo import Learner
from reference.learning.rollouts import Advance, Job, play
from reference.learning.settings import SIDES, Side
from reference.paper import PEOPLE, InputError, Scenario
from reference.simulation import Simulation
from reference.strategies import RandomFire
from reference.workshop.lockstep import together
from reference.workshop.maps import load
from reference.workshop.strategies.robots import Sweep
from reference.workshop.training.presets import preset

RUNS = 5
CASES = {
    "40": (PEOPLE, 20.0),
    "400": (10 * PEOPLE, 20.0),
    "40_whole": (PEOPLE, Scenario.time_limit),
}
"""People, and seconds after which a run stops; in the first 20 everybody is inside."""

BATCHES = 4  # minibatches of a measured update
EPISODES = 16  # in lockstep, in one process with one thread
ROLLOUTS = ("paper", "laptop")  # presets: Gaussian heads, and mixtures


def measure(name: str, seed: int) -> dict[str, Any]:
    """Measure a building; the crowd's speeds are medians over RUNS seeds from this on.

    Cases of more people than fit are left out. Raises what reading a map raises.
    """
    seeds = range(seed, seed + RUNS)
    loads = [_load_seconds(name) for _ in seeds]
    building = load(name)
    speeds, bare = {}, {}
    for case, (people, seconds) in tqdm(CASES.items(), disable=None, leave=False):
        scenario = Scenario(people=people)
        try:
            runs = [
                Simulation(building, scenario, Sweep(), RandomFire(), number)
                for number in seeds
            ]
        except InputError:
            continue
        bare[case] = median(_bare_speed(run, seconds) for run in runs)
        speeds[case] = median(_speed(run, seconds) for run in runs)
    learners = _learners("paper", building, seed)
    decisions = {name: _decisions_per_second(name, building, seed) for name in ROLLOUTS}
    return {
        "building": name,
        "seed": seed,
        "person_seconds_per_second": speeds,
        "bare_step": bare,
        "load_seconds": median(loads),
        "decisions_per_second": {name: speed for name, (speed, _) in decisions.items()},
        "one_by_one": {name: speed for name, (_, speed) in decisions.items()},
        "learner_samples_per_second": {
            learner.settings.trainer_type: _samples_per_second(side, learner, building)
            for side, learner in learners.items()
        },
    }


def table(title: str, facts: dict[str, Any]) -> str:
    """Format the figures as text."""
    last, bodies = facts["seed"] + RUNS - 1, facts["bare_step"]
    lines = [
        f"{title}, one core, median of seeds {facts['seed']} to {last}",
        f"{'person-seconds per second':27}{'everything on':>15}{'bodies alone':>15}",
    ]
    for case, speed in facts["person_seconds_per_second"].items():
        people, seconds = CASES[case]
        what = "whole" if case.endswith("whole") else f"first {seconds:.0f} s"
        lines.append(
            f"{f'{people} people, {what}':27}{speed:15,.0f}{bodies[case]:15,.0f}"
        )
    lines.append(f"read, checked and prepared in {facts['load_seconds']:.2f} s")
    lines.append("rollouts, robot decisions per second, one core")
    for name, speed in facts["decisions_per_second"].items():
        alone = facts["one_by_one"][name]
        gain = f"{alone:,.0f} one by one, {speed / alone:.1f} times"
        lines.append(f"    preset {name:8}{speed:,.0f} in lockstep ({gain})")
    samples = facts["learner_samples_per_second"]
    learners = ", ".join(f"{name} {count:,.0f}" for name, count in samples.items())
    lines.append(f"learners, samples per second, all cores: {learners}")
    return "\n".join(lines)


def _load_seconds(name: str) -> float:
    """Seconds until the first tick can begin."""
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
    """Measure bodies alone: everybody walks to where somebody else began."""
    bodies, tick = simulation.world.bodies, simulation.tick
    position, floor, navigation = bodies.position, bodies.floor, simulation.navigation

    def free(spots: np.ndarray, who: np.ndarray) -> np.ndarray:
        return navigation.walkable[navigation.places_at(floor[who], spots)]

    aim, ticks = np.roll(position, 1, axis=0), round(seconds / tick)
    rng = simulation.rng["bodies"]
    start = perf_counter()
    for _ in range(ticks):
        position = motion.step(position, floor, aim, bodies.pace, tick, free, rng)
    return len(bodies) * ticks * tick / (perf_counter() - start)


# -- Learning -----------------------------------------------------------------------


def _learners(name: str, building: Building, seed: int) -> dict[Side, Learner]:
    """Make new learners with a preset's settings."""
    settings, plan, made = preset(name), plan_of(building), {}
    for side in SIDES:
        trainer = getattr(settings, side)
        made[side] = learner_for(side, plan, settings.scenario, trainer, seed)
    return made


def _decisions_per_second(
    name: str, building: Building, seed: int
) -> tuple[float, float]:
    """Measure robot decisions per second and core in rollouts of a preset's training:
    EPISODES worlds in lockstep, and some of them one after the other.

    They include the world, observations, landmarks and both sides' networks. These
    are untrained, so that episodes last long.
    """
    sides: dict[str, Any] = {
        side: player_of(learner)
        for side, learner in _learners(name, building, seed).items()
    }
    seeds, scenario = tuple(range(seed, seed + EPISODES)), preset(name).scenario
    job = Job(plan_of(building), scenario, **sides, seeds=seeds)
    few = replace(job, seeds=seeds[::4])

    def speed(job: Job, advance: Advance) -> float:
        start = perf_counter()
        played = play(job, advance)
        seconds = perf_counter() - start
        return sum(e.robots.steps for e in played if e.robots) / seconds

    with one_thread():
        play(replace(job, seeds=seeds[:1]), together)  # warm up
        return speed(job, together), speed(few, until_next_decision)


def _samples_per_second(side: Side, learner: Learner, building: Building) -> float:
    """Measure the agent-decisions an epoch learns from per second, on all cores."""
    trainer, team = learner.settings, preset("paper").scenario.robots_per_floor
    agents = team * building.floors if side == "robots" else 1
    made_up = _decisions(learner, BATCHES * trainer.batch_size // agents + 1, agents)
    seconds = []
    for _ in range(2):  # the first one warms up
        learner.buffer.add(made_up)
        start = perf_counter()
        learner.update()
        seconds.append(perf_counter() - start)
    return BATCHES * trainer.batch_size * trainer.num_epoch / seconds[-1]


def _decisions(learner: Learner, N: int, G: int) -> Decisions:
    """Make random experience of the right shapes; all agents are alive."""
    sizes, rng = learner.sizes, learner.rng

    def normal(*shape: int) -> torch.Tensor:
        return torch.randn(N, *shape, generator=rng)

    actions = normal(G, sizes.continuous + len(sizes.branches))
    actions[..., sizes.continuous :] = 0.0  # the first option of each branch
    names = ("values", "baselines", "returns", "advantages")
    return Decisions(
        vectors=normal(G, sizes.vector),
        grids=(normal(*sizes.grid) > 1).to(torch.uint8),
        alive=torch.ones(N, G, dtype=torch.bool),
        actions=actions,
        log_probs=torch.full(actions.shape, -1.0),
        **{name: normal(G) for name in names},
    )
