"""Lockstep: tick many simulations of one building together, each as if alone.

Clauses: A5, A7, B3, B7, C7.  The people of all worlds are one crowd in shared arrays,
so that one look-up serves them all; minds, robots' ways, flames and events stay with
each simulation.  Results equal those of running each alone, to the last bit.

    K   worlds;  n  people of each
    i   a row of the crowd: n times the number of a world + a person's own number
"""

from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import fields, replace
from itertools import groupby, pairwise

import numpy as np

from reference import motion, paper
from reference.events import Event
from reference.perception import look
from reference.simulation import Simulation, Touched
from reference.world import Bodies


def together(runs: Sequence[Simulation]) -> None:
    """Run simulations to their next decision or end, in lockstep where they match."""
    alike = defaultdict(list)
    for run in runs:
        if not run.done:
            alike[run.building, run.scenario, run.ticks].append(run)
    for some in alike.values():
        one = Lockstep(some) if len(some) > 1 else some[0]
        for _ in range(one.decision_ticks):
            if not one.done:
                one.step()


def to_the_end(runs: Sequence[Simulation]) -> None:
    """Run simulations to their end."""
    while any(not run.done for run in runs):
        together(runs)


class Lockstep(Simulation):
    """Simulations of one building, scenario and time, run as one with all people."""

    def __init__(self, runs: Sequence[Simulation]):
        """runs: their bodies become views of this one's arrays."""
        self.__dict__.update(vars(runs[0]))  # the building, its tables and the clock
        self.runs, self.n = runs, len(self._due)
        self.worlds = worlds = [run.world for run in runs]
        arrays = {
            part.name: np.concatenate([getattr(w.bodies, part.name) for w in worlds])
            for part in fields(Bodies)
        }
        minds = [mind for world in worlds for mind in world.minds]
        bodies = Bodies(**arrays)
        self.world = replace(self.world, bodies=bodies, minds=minds)
        self._turn = np.tile(self._turn, len(runs))
        self._due = np.concatenate([run._due for run in runs])
        self._full_until = np.stack([run._full_until for run in runs])
        for k, run in enumerate(runs):
            own = slice(k * self.n, (k + 1) * self.n)
            run.world.bodies = Bodies(**{name: a[own] for name, a in arrays.items()})
            run._due, run._full_until = self._due[own], self._full_until[k]
        self._ends = self.n * np.arange(len(runs) + 1)
        self._around = [run._surroundings for run in runs]
        self._burning = np.stack([w.flames.burning.ravel() for w in worlds])
        self._harm = np.stack([w.flames.harm.ravel() for w in worlds])

    @property
    def done(self) -> bool:
        """Whether all simulations are done."""
        return all(run.done for run in self.runs)

    def step(self) -> list[Event]:
        """Run one tick of all that are not done; each keeps its own events."""
        going = [run for run in self.runs if not run.done]
        # SENSE
        bodies = self.world.bodies
        who = np.flatnonzero(self._due & bodies.walking)
        views = look(self.worlds, self._around, bodies, who)
        # DECIDE
        self._people_decide(who, views)
        destinations = [run._strategies_decide() for run in going]
        # MOVE
        for run, decided in zip(going, destinations, strict=True):
            for robot, destination in zip(run.world.robots, decided, strict=True):
                run.algorithm.act(robot, run.world, destination, self.tick)
        touched = self._people_move()
        # BURN
        for run in going:
            run._burn()
        self._follow(going[0])
        self._lose_health()
        # SETTLE
        self._settle(touched)
        return []

    # -- What a simulation does for one world, for all at once ----------------------

    def _walk(self, who: np.ndarray, target: np.ndarray) -> np.ndarray:
        bodies, free = self.world.bodies, self._free(who)
        position, floor = bodies.position[who], bodies.floor[who]
        pace = bodies.pace[who]
        parts = list(pairwise(who.searchsorted(self._ends).tolist()))
        pairs = [
            motion.neighbours(position[a:b], floor[a:b], pace[a:b], self.tick) + a
            for a, b in parts
        ]
        lonely = [not part.size for part in pairs]
        if all(lonely):
            return motion.alone(position, target, pace, self.tick, free)

        def turns(held_up: np.ndarray) -> np.ndarray:
            held = np.bincount(who[held_up] // self.n, minlength=len(self.runs))
            limit, drawn = motion.SHUFFLE_TURN, [np.zeros(0)]
            for run, count, idle in zip(self.runs, held.tolist(), lonely, strict=True):
                rng = run.rng["bodies"]
                turn = np.zeros(count) if idle else rng.uniform(-limit, limit, count)
                drawn.append(turn)
            return np.concatenate(drawn)

        both = np.concatenate(pairs, axis=1)
        moved = motion.among(position, target, pace, self.tick, free, both, turns)
        if any(lonely):
            by_oneself = np.repeat(lonely, [b - a for a, b in parts])
            alone = motion.alone(position, target, pace, self.tick, free)
            moved[by_oneself] = alone[by_oneself]
        return moved

    def _free(self, who: np.ndarray) -> motion.Free:
        nav, bodies, time = self.navigation, self.world.bodies, self.world.time
        world, floor, own = who // self.n, bodies.floor[who], bodies.place[who]
        inside, full = self._marks[own], self._full_until > time + 1e-9
        reckless = bodies.reckless_until[who] > time - 1e-9
        fearless = self._burning[world, own] | reckless

        def free(position: np.ndarray, which: np.ndarray) -> np.ndarray:
            place, k = nav.places_at(floor[which], position), world[which]
            mark, burning = self._marks[place], self._burning[k, place]
            room = ~full[k, mark] | (mark == inside[which])
            return room & nav.walkable[place] & (~burning | fearless[which])

        return free

    def _fill_doors(self, touched: Touched) -> None:
        for run, own in self._by_world(touched):
            run._fill_doors(own)

    def _by_world(self, touched: Touched) -> Iterator[tuple[Simulation, Touched]]:
        """Split by world, with each world's own numbers; skip worlds without any."""
        for k, some in groupby(touched, lambda one: one[0] // self.n):
            yield self.runs[k], [(i - k * self.n, before) for i, before in some]

    def _follow(self, one: Simulation) -> None:
        """Copy the clock, and flames that have changed."""
        self.ticks, self.world.time = one.ticks, one.world.time
        for k, run in enumerate(self.runs):
            if run._surroundings is not self._around[k]:
                self._around[k] = run._surroundings
                self._burning[k] = run.world.flames.burning.ravel()
                self._harm[k] = run.world.flames.harm.ravel()

    def _lose_health(self) -> None:
        bodies = self.world.bodies
        rate = paper.HEALTH_RATE * self.scenario.frames_per_tick
        bodies.health -= rate * bodies.inside
        walking = np.flatnonzero(bodies.walking)
        harm = self._harm[walking // self.n, bodies.place[walking]]
        bodies.health[walking] -= harm * self.tick

    def _settle(self, touched: Touched) -> None:
        bodies = self.world.bodies
        self._due[:] = self._turn == self.ticks % paper.RECONSIDER_TICKS
        leaving = (bodies.health <= paper.NO_HEALTH) & bodies.inside
        leaving |= bodies.stairs_until <= self.world.time
        own = {id(run): some for run, some in self._by_world(touched)}
        eventful = leaving.reshape(len(self.runs), -1).any(axis=1).tolist()
        for run, leaves in zip(self.runs, eventful, strict=True):
            if leaves or id(run) in own:
                run._settle(own.get(id(run), []))
