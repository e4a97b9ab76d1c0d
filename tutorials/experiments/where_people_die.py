"""Where do people die, and what did they do before? For teams of robots under a fire.

    python tutorials/experiments/where_people_die.py none escort learned --fire busiest

Every five seconds it is noted who is on the ground floor, who of them is led by a
robot, or no longer, and who could walk to an exit without crossing flames. In the
paper's building, the same evacuations for every team.
"""

from argparse import ArgumentParser
from copy import deepcopy

import numpy as np

from reference import Scenario, Simulation, load
from reference.navigation import navigation_of
from reference.workshop.comparing.named import strategy_named
from reference.workshop.lockstep import advance_in_lockstep
from reference.workshop.storage.workers import one_thread
from reference.workshop.strategies.guides import guided_by
from reference.world import Fate

GROUND = 0


def reaches_exit(world):
    """(n,) bool: could each walk from where they are to an exit, past the flames?"""
    nav, building = navigation_of(world.building), world.building
    goals = np.concatenate([nav.goals[exit_] for exit_ in building.exits])
    passable = np.where(world.flames.burning, np.inf, 1.0)
    return np.isfinite(nav.distances(goals, passable))[world.bodies.place]


class Notes:
    """What is noted of one evacuation, (n,) each.

    began, floor  where people began, and were last
    ground        s on the ground floor;  led, open: s of these led by a robot, and s
                  with a way to an exit
    now, losses   bool, led there just now; how often they lost a robot there
    """

    def __init__(self, run):
        self.run, bodies = run, run.world.bodies
        self.began, self.floor = bodies.floor.copy(), bodies.floor.copy()
        self.ground, self.led, self.open, self.losses = np.zeros((4, len(bodies)))
        self.now = bodies.walking & False

    def note(self, seconds):
        """Note how people are now, and count it for some seconds."""
        world, bodies = self.run.world, self.run.world.bodies
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
    """Play them in lockstep; return notes of each."""
    scenario = Scenario()
    team, fire = strategy_named(team, "robots"), strategy_named(fire, "fire")
    runs = [
        Simulation(load("paper"), scenario, deepcopy(team), deepcopy(fire), seed)
        for seed in seeds
    ]
    notes = [Notes(run) for run in runs]
    with one_thread():
        while going := [one for one in notes if not one.run.done]:
            for one in going:
                one.note(scenario.decision_seconds)
            advance_in_lockstep([one.run for one in going])
    return notes


def tell(team, notes):
    """Print what came of a team's evacuations."""
    facts = {
        name: np.concatenate([getattr(one, name) for one in notes])
        for name in ("began", "floor", "ground", "led", "open", "losses", "now")
    }
    fate = np.concatenate([one.run.world.bodies.fate for one in notes])
    dead, above = fate == Fate.DEAD, facts["began"] > GROUND
    low = facts["floor"] == GROUND
    print(f"{team}: {dead.sum() / len(notes):.1f} die; by floors, the lowest first")
    for words, name in (("began there", "began"), ("were there last", "floor")):
        each = np.bincount(facts[name][dead], minlength=3) / len(notes)
        print(f"    {words:16}", *(f"{some:5.1f}" for some in each))
    for words, who in (("got out", ~dead & above), ("died", dead & above)):
        seconds = facts["ground"][who]
        led, free = (facts[k][who].sum() / seconds.sum() for k in ("led", "open"))
        print(f"    those from above who {words}: {seconds.mean():.0f} s on the lowest")
        print(f"        floor, {led:.0%} led, {free:.0%} with a way out")
    lost, last = facts["losses"].sum() / len(notes), facts["now"][dead & low]
    print(f"    {lost:.1f} times somebody loses a robot there")
    print(f"    {last.mean():.0%} of those who die there are led then", flush=True)


if __name__ == "__main__":
    parser = ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("teams", nargs="+", metavar="TEAM")
    parser.add_argument("--fire", default="busiest", metavar="S")
    parser.add_argument("--episodes", type=int, default=40, metavar="N")
    parser.add_argument("--seed", type=int, default=5000, metavar="N")
    asked = parser.parse_args()
    seeds = range(asked.seed, asked.seed + asked.episodes)
    for team in asked.teams:
        tell(team, evacuations(team, asked.fire, seeds))
