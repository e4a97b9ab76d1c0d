"""Where do people die, and what did they do before? For teams of robots under a fire.

    python tutorials/experiments/where_people_die.py none escort learned --fire busiest

Every five seconds it is noted who is on the ground floor, who of them is led by a
robot, or no longer, and who could walk to an exit without crossing flames. In the
paper's building, the same evacuations for every team.
"""

import sys
from argparse import ArgumentParser

import numpy as np

from reference import Scenario, Simulation, load
from reference.navigation import navigation_of
from reference.workshop.commands.common import exit_status
from reference.workshop.commands.options import whole
from reference.workshop.comparing.named import strategy_named
from reference.workshop.engine import run_to_decision
from reference.workshop.storage.workers import one_thread
from reference.workshop.strategies.guides import guided_by
from reference.world import Fate

GROUND = 0


def reaches_exit(world):
    """(n,) bool: could each walk from where they are to an exit, past the flames?"""
    building = world.building
    nav = navigation_of(building)
    goals = np.concatenate([nav.goals[exit_] for exit_ in building.exits])
    passable = np.where(world.flames.burning, np.inf, 1.0)
    metres = nav.distances(goals, passable)
    return np.isfinite(metres[world.bodies.place])


class Notes:
    """What is noted of one evacuation, of each person: arrays (n,)."""

    def __init__(self, run):
        self.run = run
        bodies = run.world.bodies
        self.began = bodies.floor.copy()  # the floor where they began
        self.floor = bodies.floor.copy()  # the floor where they were last
        self.ground = np.zeros(len(bodies))  # seconds on the ground floor
        self.led = np.zeros(len(bodies))  # of these, led by a robot
        self.open = np.zeros(len(bodies))  # of these, with a way to an exit
        self.losses = np.zeros(len(bodies))  # how often they lost a robot there
        self.now = np.zeros(len(bodies), bool)  # are they led there just now?

    def note(self, seconds):
        """Note how people are now, and count it for some seconds."""
        world = self.run.world
        bodies = world.bodies
        self.floor = np.where(bodies.inside, bodies.floor, self.floor)
        here = bodies.walking & (bodies.floor == GROUND)
        led = here & (guided_by(world) >= len(bodies))
        self.ground += seconds * here
        self.led += seconds * led
        self.losses += self.now & here & ~led
        self.now = np.where(here, led, self.now)
        if here.any():
            self.open += seconds * (here & reaches_exit(world))


def evacuations(team, fire, seeds):
    """Play them together; return notes of each."""
    scenario = Scenario()
    team = strategy_named(team, "robots")
    fire = strategy_named(fire, "fire")
    runs = [Simulation(load("paper"), scenario, team, fire, seed) for seed in seeds]
    notes = [Notes(run) for run in runs]
    going = notes
    with one_thread():
        while going:
            for one in going:
                one.note(scenario.decision_seconds)
            run_to_decision([one.run for one in going])
            going = [one for one in going if not one.run.done]
    return notes


def tell(team, notes):
    """Print what came of a team's evacuations."""
    began = np.concatenate([one.began for one in notes])
    floor = np.concatenate([one.floor for one in notes])
    ground = np.concatenate([one.ground for one in notes])
    led = np.concatenate([one.led for one in notes])
    open_ = np.concatenate([one.open for one in notes])
    now = np.concatenate([one.now for one in notes])
    dead = np.concatenate([one.run.world.bodies.fate == Fate.DEAD for one in notes])

    print(f"{team}: {dead.sum() / len(notes):.1f} die; by floors, the lowest first")
    for words, floors in (("began there", began), ("were there last", floor)):
        each = np.bincount(floors[dead], minlength=3) / len(notes)
        print(f"    {words:16}", *(f"{some:5.1f}" for some in each))

    above = began > GROUND
    for words, who in (("got out", ~dead & above), ("died", dead & above)):
        seconds = ground[who]
        if not seconds.any():
            continue
        share_led = led[who].sum() / seconds.sum()
        share_open = open_[who].sum() / seconds.sum()
        print(f"    those from above who {words}: {seconds.mean():.0f} s on the lowest")
        print(f"        floor, {share_led:.0%} led, {share_open:.0%} with a way out")

    losses = sum(one.losses.sum() for one in notes) / len(notes)
    print(f"    {losses:.1f} times somebody loses a robot there")
    led_at_death = now[dead & (floor == GROUND)]
    if led_at_death.size:
        share = led_at_death.mean()
        print(f"    {share:.0%} of those who die there are led then", flush=True)


def main():
    parser = ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("teams", nargs="+", metavar="TEAM")
    parser.add_argument("--fire", default="busiest", metavar="S")
    parser.add_argument("--episodes", type=whole(1), default=40, metavar="N")
    parser.add_argument("--seed", type=whole(0), default=5000, metavar="N")
    asked = parser.parse_args()
    seeds = range(asked.seed, asked.seed + asked.episodes)
    for team in asked.teams:  # an unknown one is refused before anything is played
        strategy_named(team, "robots")
    for team in asked.teams:
        tell(team, evacuations(team, asked.fire, seeds))


if __name__ == "__main__":
    sys.exit(exit_status(main))
