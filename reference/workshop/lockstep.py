"""Lockstep: tick many simulations of one building together, each as if alone.

The people of all worlds are one crowd in shared arrays, so that one look-up serves them
all; minds, robots' ways, flames and events stay with each simulation.  Results equal
those of running each alone, to the last bit.

    K   worlds;  n  people of each
    i   a row of the crowd: n times the number of a world + a person's own number
"""

from collections import defaultdict
from collections.abc import Callable, Sequence
from dataclasses import fields, replace
from functools import partial
from itertools import pairwise

import numpy as np

from reference import former_names, humans, motion, paper, walking
from reference.simulation import Simulation
from reference.view import View, see
from reference.walking import Touched
from reference.world import FLOOR_APART, Bodies

Turns = Callable[[np.ndarray], np.ndarray]
"""(k,) numbers of those held up -> (k,) half turns, drawn by each world's generator."""


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
        # where everybody is: people of all worlds, then robots
        bodies = self.world.bodies
        robots = self.world.robots
        at = np.array([robot.position for robot in robots]).reshape(-1, 2)
        floors = np.array([robot.floor for robot in robots], int)
        places = np.array([robot.place for robot in robots], int)
        active = np.array([robot.active for robot in robots], bool)
        floor = np.concatenate([bodies.floor, floors])
        place = np.concatenate([bodies.place, places])
        present = np.concatenate([bodies.walking, active])
        x, y = np.concatenate([bodies.position, at]).T
        x = x + FLOOR_APART * floor

        # who is near whom in the same world
        world, me = np.divmod(who, self.n)
        others = self._in_world[world]
        reach = self.runs[0].sight.reach
        off_x = x[others] - x[who, None]
        off_y = y[others] - y[who, None]
        near = (np.abs(off_x) < reach) & (np.abs(off_y) < reach) & present[others]
        near[np.arange(len(who)), me] = False
        k, j = np.divmod(np.flatnonzero(near), near.shape[1])
        x = off_x[k, j]
        y = off_y[k, j]
        metres = np.sqrt(x * x + y * y)

        there = place[others[k, j]]
        around = list(zip(j.tolist(), there.tolist(), metres.tolist(), strict=True))
        ends = k.searchsorted(np.arange(len(who) + 1)).tolist()
        each = zip(world.tolist(), me.tolist(), pairwise(ends), strict=True)
        return [
            see(self.runs[w].world, self.runs[w].sight, i, around[first:last])
            for w, i, (first, last) in each
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
                half = np.zeros(b - a)
                if not idle:
                    half = paper.SHUFFLE_TURN * run.rng["bodies"].uniform(-1, 1, b - a)
                drawn.append(half)
            return np.concatenate(drawn)

        # whose world has no two people near each other walks without shuffling
        free = self._free(who)
        step = partial(_step, position, target, pace, self.tick, free)
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


# -- `motion.step`, with each world's own neighbours and random numbers ----------------


def _step(
    position: np.ndarray,
    target: np.ndarray,
    pace: np.ndarray,
    seconds: float,
    free: motion.Free,
    near: np.ndarray,
    turns: Turns,
) -> np.ndarray:
    """What `motion.step` does; near: what `motion.neighbours` found in each world."""
    heading = motion._heading(position, target, pace, seconds)
    if not near.size:
        return motion._walk(position, heading.e, heading.v * seconds, free)
    pairs = motion._pairs(near, position, heading)
    turned, v = motion._heed_neighbours(heading, pairs)

    walked = motion._walk(position, turned, v * seconds, free)
    pushed = motion._push(walked, pairs, free)
    moved = motion._not_into_each_other(position, pushed, pairs, pairs.yields)

    there = heading.far <= paper.ARRIVED_METRES
    onward = np.where(there[:, None], turned, heading.e)
    advanced = motion._along(moved - position, onward)
    held_up = (advanced < paper.HELD_UP_SPEED * seconds) & onward.any(axis=1)
    if not held_up.any():
        return moved
    stride = paper.SHUFFLE_SPEED * seconds
    return _shuffle(moved, onward, held_up, stride, pairs, free, turns)


def _shuffle(
    moved: np.ndarray,
    e: np.ndarray,
    held_up: np.ndarray,
    stride: float,
    pairs: motion.Pairs,
    free: motion.Free,
    turns: Turns,
) -> np.ndarray:
    """What `motion._shuffle` does."""
    who = np.flatnonzero(held_up)
    mine = held_up[pairs.i]
    pairs = motion.Pairs(*(column[mine] for column in pairs))

    met = pairs.facing & (motion._along(e.take(pairs.i, 0), pairs.to_j) > 0)
    meets = np.zeros(len(e), bool)
    meets[pairs.i[met]] = True
    way = e[who]
    way[meets[who]] = motion._turned(e[meets & held_up], -paper.SHUFFLE_RIGHT)
    half = turns(who)
    tried = moved.copy()
    tried[who] += stride * motion._turned(motion._turned(way, half), half)

    barred = who[~free(tried[who], who)]
    tried[barred] = moved[barred]
    all_yield = np.ones(len(pairs.i), bool)
    return motion._not_into_each_other(moved, tried, pairs, all_yield)


__getattr__ = former_names(
    __name__, {"together": "advance_in_lockstep", "to_the_end": "run_in_lockstep"}
)
