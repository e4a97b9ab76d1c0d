"""What do teams of robots do with their time?

    python tutorials/experiments/what_robots_do.py sweep observer out/DIR --fire random

Every decision of a robot at work on the first floor is counted as one of DEEDS, and the
people who follow it. The last column is the return, discounted by GAMMA.
"""

import sys
from argparse import ArgumentParser
from collections import Counter
from typing import NamedTuple

import numpy as np

from reference import Scenario, Simulation, load
from reference.paper import DECISION_SECONDS
from reference.rewards import group_reward
from reference.robots import followers_of
from reference.workshop.commands.common import exit_status
from reference.workshop.commands.options import whole
from reference.workshop.comparing.named import strategy_named
from reference.workshop.strategies.guides import GROUP_RADIUS, unguided
from reference.workshop.training.presets import preset
from reference.world import NOWHERE

GAMMA = preset("laptop").robots.gamma

DEEDS = {
    "leads": "walks to a way out, people follow",
    "fetches": "walks to people whom nobody guides, alone",
    "fetches more": "... people follow",
    "walks": "walks, nobody follows, nobody to guide is there",
    "other": "walks elsewhere, people follow",
    "waits": "stands",
}


def deed(world, robot):
    """Tell which of DEEDS a robot is about."""
    if not robot.way:
        return "waits"
    lost = unguided(world) & (world.bodies.floor == robot.floor)
    off = world.bodies.position - robot.destination
    there = np.linalg.norm(off, axis=1) <= GROUP_RADIUS
    followed = len(followers_of(world, robot)) > 0
    if (lost & there).any():
        return "fetches more" if followed else "fetches"
    if not followed:
        return "walks"
    return "other" if robot.says == NOWHERE else "leads"


class Evacuation(NamedTuple):
    """What came of one evacuation."""

    deeds: Counter[str]  # decisions of each kind
    led: list[int]  # people who followed, at each decision
    saved: float  # share of people
    reward: float  # discounted


def evacuation(team, fire, seed):
    """Play one evacuation, and note what robots decide."""
    robots = strategy_named(team, "robots")
    fire = strategy_named(fire, "fire")
    now = Simulation(load("paper"), Scenario(), robots, fire, seed)
    deeds = Counter()
    led = []
    while not now.done:
        decides = now.ticks % now.decision_ticks == 0
        now.step()
        for robot in now.world.robots:
            if decides and robot.active and robot.floor == 0:
                deeds[deed(now.world, robot)] += 1
                led.append(len(followers_of(now.world, robot)))
    outcome = now.outcome()
    saved = outcome.evacuated / outcome.people
    return Evacuation(deeds, led, saved, discounted(now.events))


def discounted(events):
    """The group's reward, health points, as it is worth at the first decision."""
    worth = 0.0
    for event in events:
        decisions = event.time // DECISION_SECONDS
        worth += group_reward([event]) * GAMMA**decisions
    return worth


def main():
    parser = ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("teams", nargs="+", metavar="TEAM")
    parser.add_argument("--fire", default="random", metavar="S")
    parser.add_argument("--episodes", type=whole(1), default=20, metavar="N")
    parser.add_argument("--seed", type=whole(0), default=7000, metavar="N")
    asked = parser.parse_args()
    seeds = range(asked.seed, asked.seed + asked.episodes)
    for team in asked.teams:  # an unknown one is refused before anything is played
        strategy_named(team, "robots")
    for name, words in DEEDS.items():
        print(f"{name:>12}  {words}")
    columns = " ".join(f"{name:>12}" for name in DEEDS)
    print(f"\n{'% of decisions':24} {columns}   led  saved  return")
    for team in asked.teams:
        runs = [evacuation(team, asked.fire, seed) for seed in seeds]
        deeds = sum((run.deeds for run in runs), Counter())
        shares = [100 * deeds[name] / deeds.total() for name in DEEDS]
        led = np.mean([people for run in runs for people in run.led])
        saved = 100 * np.mean([run.saved for run in runs])
        reward = np.mean([run.reward for run in runs])
        numbers = " ".join(f"{share:12.1f}" for share in shares)
        print(f"{team[-24:]:24} {numbers} {led:5.2f}  {saved:5.1f} {reward:7.0f}")


if __name__ == "__main__":
    sys.exit(exit_status(main))
