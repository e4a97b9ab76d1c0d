"""What nobody and `escort` achieve in a training's task: levels to measure it by.

They play the task itself: its maps, its scenario, with the rule of training [D6], and
the scripted fires that it meets.  A fire that learns is another one every round, so
that no level could be of it.
"""

from collections.abc import Sequence
from statistics import mean
from typing import Any

from reference.learning.players import LearnedNetwork
from reference.learning.rollouts import Episode, Job, play
from reference.workshop.engine import engine_is_ready, run_to_decision
from reference.workshop.storage.workers import one_thread
from reference.workshop.strategies import FIRES, ROBOTS
from reference.workshop.training.checkpoints import Task, player_names
from reference.workshop.training.summaries import (
    EPISODE_COLUMNS,
    GROUP_REWARD,
    SURVIVAL,
    Levels,
)

EVACUATIONS = 20
"""[F12, chosen] of each; the mean survival is then off by some 3 points."""

GUIDES_MEASURED = ("none", "escort")
Fires = tuple[LearnedNetwork | str, ...]


def why_no_levels(tasks: Sequence[Task]) -> str:
    """Say why trainings have no levels in common; "" where they have."""
    if not all(task.family is None or task.family.plans for task in tasks):
        return "their buildings are drawn by lot"
    if len({_played(task) for task in tasks}) > 1:
        return "they differ in building, scenario or fire"
    if not engine_is_ready():
        return "without the engine they would take long"
    return ""


def levels_of(task: Task) -> Levels:
    """Play the task without guides and with `escort`, if robots stand there."""
    robots = GUIDES_MEASURED if task.settings.scenario.robots_per_floor else ("none",)
    means = {}
    for name in robots:
        facts = [episode.facts for episode in _episodes(task, name)]
        means[name] = {
            column: mean(fact[EPISODE_COLUMNS[column]] for fact in facts)
            for column in (GROUP_REWARD, SURVIVAL)
        }
    fires = player_names(fires_met(task))
    learns = "fire" not in task.fixed and task.settings.random_fires < 1
    under = f"but with fire {fires}" if learns else f"fire {fires}"
    about = f"means of {EVACUATIONS} evacuations each of the same task, {under}"
    return Levels(about, means)


def fires_met(task: Task) -> Fires:
    """List the fires of a training that stay as they are, else a random one."""
    if "fire" in task.fixed:
        return task.fixed["fire"]
    return task.settings.stand_ins if task.settings.random_fires else ("random",)


def _episodes(task: Task, robots: str) -> list[Episode]:
    """Play all maps in turn, and in each all fires in turn."""
    fires = fires_met(task)
    jobs = []
    for seed in range(EVACUATIONS):
        turn, place = divmod(seed, len(task.plans))
        fire: Any = fires[turn % len(fires)]
        job = Job(
            plan=task.plans[place],
            scenario=task.settings.scenario,
            robots=ROBOTS[robots](),
            fire=FIRES[fire]() if isinstance(fire, str) else fire,
            seeds=(seed,),
            record=(),
        )
        jobs.append(job)
    with one_thread():
        return [e for job in jobs for e in play(job, advance=run_to_decision)]


def _played(task: Task) -> tuple[Any, ...]:
    """What an evacuation of a task depends on beside its seed and its robots."""
    return task.plans, task.settings.scenario, player_names(fires_met(task))
