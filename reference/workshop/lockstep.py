"""Lockstep: tick many simulations of one building together, each as if alone.

The people of all worlds are one crowd in shared arrays, so that one look-up serves them
all; minds, robots' ways, flames and events stay with each simulation.  Results equal
those of running each alone, to the last bit.

    K   worlds;  n  people of each
    i   a row of the crowd: n times the number of a world + a person's own number
"""

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import fields, replace
from functools import partial
from itertools import pairwise

import numpy as np

from reference import former_names, humans, motion, walking
from reference.simulation import Simulation
from reference.view import View, bodies_around, crowd_of, see
from reference.walking import Touched
from reference.world import Bodies


def advance_in_lockstep(runs: Sequence[Simulation]) -> None:
    """Run simulations to their next decision or end, in lockstep where they match."""
    alike = defaultdict(list)
    for run in runs:
        if not run.done:
            robots = len(run.world.robots)
            alike[run.building, run.scenario, robots, run.ticks].append(run)
    for some in alike.values():
        one = Lockstep(some) if len(some) > 1 else some[0]
        for _ in range(some[0].decision_ticks):
            if not one.done:
                one.step()


def run_in_lockstep(runs: Sequence[Simulation]) -> None:
    """Run simulations to their end."""
    while any(not run.done for run in runs):
        advance_in_lockstep(runs)


class Lockstep:
    """Simulations of one building, scenario and time, which tick together.

    world  the clock, and all worlds' people and robots;  n  people of each
    """

    def __init__(self, runs: Sequence[Simulation]):
        """runs: their bodies become views of this one's arrays."""
        worlds = [run.world for run in runs]
        self.runs = runs
        self.tick = runs[0].tick
        self.n = len(worlds[0].bodies)
        arrays = {
            part.name: np.concatenate([getattr(w.bodies, part.name) for w in worlds])
            for part in fields(Bodies)
        }
        minds = [mind for world in worlds for mind in world.minds]
        robots = [robot for world in worlds for robot in world.robots]
        bodies = Bodies(**arrays)
        self.world = replace(worlds[0], bodies=bodies, minds=minds, robots=robots)
        self.due = np.concatenate([run.due for run in runs])
        self.full_until = np.stack([run.full_until for run in runs])

        # what each simulation changes is a part of the arrays of all
        self._ends = self.n * np.arange(len(runs) + 1)
        for k, run in enumerate(runs):
            own = slice(self._ends[k], self._ends[k + 1])
            parts = {name: array[own] for name, array in arrays.items()}
            run.world.bodies = Bodies(**parts)
            run.due = self.due[own]
            run.full_until = self.full_until[k]

        # (K, n + robots) the bodies of each world, by their numbers among those of all
        people = np.arange(len(minds)).reshape(len(runs), -1)
        machines = len(minds) + np.arange(len(robots)).reshape(len(runs), -1)
        self._in_world = np.hstack([people, machines])

    @property
    def done(self) -> bool:
        """Whether all simulations are done."""
        return all(run.done for run in self.runs)

    def step(self) -> None:
        """Run one tick of all that are not done; each keeps its own events."""
        going = [run for run in self.runs if not run.done]
        # SENSE
        who = np.flatnonzero(self.due & self.world.bodies.walking)
        views = self._look(who)
        # DECIDE
        humans.decide(self.world, who, views)
        destinations = [run.strategies_decide() for run in going]
        # MOVE: robots, then people [C7]
        for run, decided in zip(going, destinations, strict=True):
            run.robots_move(decided)
        touched = self._people_move()
        # BURN: flames, then who is in them [B7]
        for run in going:
            run.burn()
            run.lose_health()
        self.world.time = going[0].world.time
        # SETTLE
        for run in going:
            run.settle(touched.get(run, []))

    # -- What a simulation does for one world, for all at once ----------------------

    def _look(self, who: np.ndarray) -> list[View]:
        """What `view.look` does; each looks at their own world [B3]."""
        crowd = crowd_of(self.world)
        world, me = np.divmod(who, self.n)
        others = self._in_world[world]
        reach = self.runs[0].sight.reach
        off_x = crowd.x[others] - crowd.x[who, None]
        off_y = crowd.y[others] - crowd.y[who, None]
        near = (np.abs(off_x) < reach) & (np.abs(off_y) < reach) & crowd.present[others]
        near[np.arange(len(who)), me] = False

        k, j = np.divmod(np.flatnonzero(near), near.shape[1])
        place = crowd.place[others[k, j]]
        x = off_x[k, j]
        y = off_y[k, j]
        metres = np.sqrt(x * x + y * y)
        around = bodies_around(len(who), k, j, place, metres)
        each = zip(world.tolist(), me.tolist(), around, strict=True)
        return [
            see(self.runs[w].world, self.runs[w].sight, i, bodies)
            for w, i, bodies in each
        ]

    def _people_move(self) -> dict[Simulation, Touched]:
        """Walk people one tick; return who stepped onto a landmark [A5]."""
        who = np.flatnonzero(self.world.bodies.walking)
        moved = self._walk(who, walking.targets(self.world, who))
        touched = self._by_world(walking.advance(self.world, who, moved))
        for run, own in touched.items():
            run.fill_doors(own)
        return touched

    def _walk(self, who: np.ndarray, target: np.ndarray) -> np.ndarray:
        """(k, 2) metres where these people get to in a tick [A9]."""
        bodies = self.world.bodies
        position = bodies.position[who]
        floor = bodies.floor[who]
        pace = bodies.pace[who]
        parts = self._parts(who)
        pairs = [
            motion.neighbours(position[a:b], floor[a:b], pace[a:b], self.tick) + a
            for a, b in parts
        ]
        lonely = [not part.size for part in pairs]

        def turns(held_up: np.ndarray) -> np.ndarray:
            """Draw from each world's own generator."""
            drawn = [np.zeros(0)]
            own = self._parts(who[held_up])
            for run, (a, b), idle in zip(self.runs, own, lonely, strict=True):
                draw = motion.turns(run.rng["bodies"])
                drawn.append(np.zeros(b - a) if idle else draw(held_up[a:b]))
            return np.concatenate(drawn)

        # whose world has no two people near each other walks without shuffling
        free = self._free(who)
        step = partial(motion.step, position, target, pace, self.tick, free)
        moved = step(np.concatenate(pairs, axis=1), turns)
        if any(lonely):
            by_oneself = np.repeat(lonely, [b - a for a, b in parts])
            alone = step(np.empty((2, 0), int), turns)
            moved[by_oneself] = alone[by_oneself]
        return moved

    def _free(self, who: np.ndarray) -> motion.Free:
        """What `walking.free_for` does, with each world's own flames and full doors."""
        bodies = self.world.bodies
        nav = self.runs[0].navigation
        world = who // self.n
        burning = np.stack([run.world.flames.burning.ravel() for run in self.runs])
        full = self.full_until > self.world.time + 1e-9
        marks = self.world.building.landmark.ravel()
        floor = bodies.floor[who]
        inside = marks[bodies.place[who]]
        reckless = bodies.reckless_until[who] > self.world.time - 1e-9
        fearless = burning[world, bodies.place[who]] | reckless

        def free(position: np.ndarray, which: np.ndarray) -> np.ndarray:
            place = nav.places_at(floor[which], position)
            mark = marks[place]
            room = ~full[world[which], mark] | (mark == inside[which])
            burns = burning[world[which], place]
            return room & nav.walkable[place] & (~burns | fearless[which])

        return free

    # -- Parts of the crowd ---------------------------------------------------------

    def _parts(self, who: np.ndarray) -> list[tuple[int, int]]:
        """Where the people of each world begin and end among these."""
        return list(pairwise(who.searchsorted(self._ends).tolist()))

    def _by_world(self, touched: Touched) -> dict[Simulation, Touched]:
        """Split by world, with each world's own numbers; skip worlds without any."""
        split: dict[Simulation, Touched] = defaultdict(list)
        for i, before in touched:
            world, own = divmod(i, self.n)
            split[self.runs[world]].append((own, before))
        return split


__getattr__ = former_names(
    __name__, {"together": "advance_in_lockstep", "to_the_end": "run_in_lockstep"}
)
