"""Pedestrian dynamics: bodies walk to their targets, not into walls or each other.

Clause: A9.  The collision-free speed model of Tordeux, Chraibi and Seyfried (2016), as
in JuPedSim: speed falls with the gap ahead.  Ours besides: people keep to the right of
oncoming people and turn their shoulders; a body that is held up, or that stands in the
way of others and cannot make room, tries a small random step.

    n    bodies;  k  pairs of neighbours, each counted both ways (i looks at j)
    e_i  unit vector i means to walk along;  v_i  its speed, m/s
    s    metres from the edge of i to the edge of j
    far  (n,) metres to the target
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from reference import paper
from reference.world import FLOOR_APART

Free = Callable[[np.ndarray, np.ndarray], np.ndarray]
"""(k, 2) positions of (k,) bodies -> (k,) bool: may they stand there?"""


class Pairs(NamedTuple):
    """Neighbours, each pair counted both ways; all are (k,), to_j is (k, 2)."""

    i: np.ndarray  # the body that looks
    j: np.ndarray  # the one looked at
    to_j: np.ndarray  # unit vector from i to j
    apart: np.ndarray  # metres between their middles
    room: np.ndarray  # metres that the middles keep apart
    facing: np.ndarray  # bool, they walk at each other
    yields: np.ndarray  # bool, i gives way

    def off(self, points: np.ndarray) -> np.ndarray:
        """(k, 2) metres from each i to its j, if bodies stand at points (n, 2)."""
        return points.take(self.j, 0) - points.take(self.i, 0)


def turns(rng: np.random.Generator) -> Callable[[np.ndarray], np.ndarray]:
    """Make a function that draws for (k,) bodies (k,) angles up to SHUFFLE_TURN."""
    return lambda who: rng.uniform(-paper.SHUFFLE_TURN, paper.SHUFFLE_TURN, len(who))


def step(
    position: np.ndarray,
    target: np.ndarray,
    pace: np.ndarray,
    seconds: float,
    free: Free,
    near: np.ndarray,
    turns: Callable[[np.ndarray], np.ndarray],
) -> np.ndarray:
    """Move n bodies by one tick; return their new positions, (n, 2) metres.

    position, target: (n, 2) metres; pace: (n,) m/s; near: what `neighbours` found.
    """
    e, far, v = _heading(position, target, pace, seconds)
    if not near.size:
        wished = position + e * (v * seconds)[:, None]
        return _not_into_walls(position, wished, free)
    pairs = _pairs(near, position, e, far)
    turned, v = _heed_neighbours(e, v, pairs)
    wished = position + turned * (v * seconds)[:, None]
    moved = _not_into_walls(position, wished, free)
    if (pushed := _pushed_apart(moved, pairs)) is not moved:
        pushed = _not_into_walls(moved, pushed, free)
    moved = _not_into_each_other(position, pushed, pairs)
    e = np.where((far > paper.ARRIVED_METRES)[:, None], e, turned)
    least = paper.HELD_UP_SPEED * seconds
    held_up = (_along(moved - position, e) < least) & e.any(axis=1)
    if not held_up.any():
        return moved
    mine = held_up[pairs.i]
    pairs = Pairs(*(column[mine] for column in pairs))
    meets = np.zeros(len(e), bool)
    meets[pairs.i[pairs.facing & (_along(e.take(pairs.i, 0), pairs.to_j) > 0)]] = True
    tried, who = moved.copy(), np.flatnonzero(held_up)
    tried[who] += paper.SHUFFLE_SPEED * seconds * _about(e[who], meets[who], turns(who))
    barred = who[~free(tried[who], who)]
    tried[barred] = moved[barred]
    pairs = pairs._replace(yields=np.ones_like(pairs.yields))
    return _not_into_each_other(moved, tried, pairs)


def _pairs(
    near: np.ndarray, position: np.ndarray, e: np.ndarray, far: np.ndarray
) -> Pairs:
    """Describe neighbours; near: (2, k / 2), each pair once."""
    i, j = np.concatenate(near), np.concatenate(near[::-1])
    far_i, far_j = far[i], far[j]
    yields = (far_i > far_j) | ((far_i == far_j) & (i > j))
    to_j, apart = _directions(position.take(j, 0) - position.take(i, 0))
    facing = _along(e.take(i, 0), e.take(j, 0)) < -0.5
    facing &= far_i + far_j > apart + paper.body_diameter()
    room = np.where(facing, paper.SHOULDER_METRES, paper.body_diameter())
    return Pairs(i, j, to_j, apart, room, facing, yields)


def _heading(
    position: np.ndarray, target: np.ndarray, pace: np.ndarray, seconds: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """e, metres to go and v of bodies that nobody hinders; they keep to the right."""
    e, far = _directions(target - position)
    aside = _right_of(e) * np.where(far > 1, paper.ASIDE_METRES, 0)[:, None]
    e, far = _directions(target + aside - position)
    return e, far, np.minimum(pace, far / seconds)


def _directions(off: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(n, 2) unit vectors, zero where there is no way to go, and (n,) lengths."""
    far = np.sqrt(_along(off, off))
    return off / np.maximum(far, 1e-9)[:, None], far


def neighbours(
    position: np.ndarray, floor: np.ndarray, pace: np.ndarray, seconds: float
) -> np.ndarray:
    """(2, k) bodies on the same floor that are near each other, each pair once."""
    if len(position) < 2:
        return np.empty((2, 0), np.int64)
    meeting = paper.body_diameter() + 2 * float(pace.max()) * seconds
    near = max(paper.NEIGHBOUR_METRES, meeting)
    where = position + (floor * FLOOR_APART)[:, None]
    tree = cKDTree(where, balanced_tree=False, compact_nodes=False)
    return tree.query_pairs(near, output_type="ndarray").T


def _heed_neighbours(
    e: np.ndarray, v: np.ndarray, pairs: Pairs
) -> tuple[np.ndarray, np.ndarray]:
    """Turn directions away from neighbours, and slow down to keep the gap ahead.

    Of two who are in each other's way only one waits.
    """
    i, j, to_j, apart, _, _, yields = pairs
    s = apart - paper.body_diameter()
    standing = v < paper.IDLE_SPEED
    at_me = _along(e.take(j, 0), to_j) < -0.5
    towards = _along(e.take(i, 0), to_j) > 0.5
    push = paper.PUSH_STRENGTH * np.exp(-s / paper.PUSH_RANGE) * (at_me | ~standing[i])
    right = np.zeros(len(e))
    right[i[at_me & towards]] = paper.KEEP_RIGHT
    swerve = _right_of(e) * right[:, None] - _sums(i, push[:, None] * to_j, len(e))
    turned, strength = _directions(np.where(standing[:, None], 0, e) + swerve)
    v = np.where(standing, np.minimum(strength, 1) * paper.GIVE_WAY_SPEED, v)
    turned_i = turned.take(i, 0)
    ahead = _along(turned_i, to_j)
    aside = np.abs(turned_i[:, 0] * to_j[:, 1] - turned_i[:, 1] * to_j[:, 0]) * apart
    front = (ahead > 0) & (aside < paper.body_diameter())
    half = len(i) // 2  # pair k and pair half + k: the same two, seen from the other
    mutual = np.concatenate([front[half:], front[:half]])
    front &= yields | ~mutual
    np.minimum.at(v, i[front], np.maximum(s[front], 0) / paper.GAP_SECONDS)
    return turned, v


def _along(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """(k,) dot products of (k, 2) vectors."""
    return one[:, 0] * other[:, 0] + one[:, 1] * other[:, 1]


def _right_of(e: np.ndarray) -> np.ndarray:
    """(n, 2) vectors turned to the right."""
    return np.array([e[:, 1], -e[:, 0]]).T


def _sums(i: np.ndarray, vectors: np.ndarray, n: int) -> np.ndarray:
    """(n, 2) sums of the (k, 2) vectors of each i."""
    return np.array([np.bincount(i, axis, n) for axis in vectors.T]).T


def _not_into_walls(position: np.ndarray, wished: np.ndarray, free: Free) -> np.ndarray:
    """Slide along what is in the way: both coordinates, then one, then none.

    Only where a step ends is looked at [A9, chosen]: where two barred cells meet at a
    corner, a body may slip through between them.
    """
    everybody = np.arange(len(position))
    barred = everybody[~free(wished, everybody)]
    if not len(barred):
        return wished
    moved = wished.copy()
    for axis in (1, 0):
        slid = wished[barred].copy()
        slid[:, axis] = position[barred, axis]
        fits = free(slid, barred)
        moved[barred[fits]] = slid[fits]
        barred = barred[~fits]
    moved[barred] = position[barred]
    return moved


def _pushed_apart(moved: np.ndarray, pairs: Pairs) -> np.ndarray:
    """Push overlapping bodies apart, each by half, so that they slide round each other.

    Returns `moved` itself if none overlap.
    """
    for _ in range(paper.PUSH_ROUNDS):
        to_j, far = _directions(pairs.off(moved))
        half = np.maximum(paper.body_diameter() - far, 0) / 2
        if not half.any():
            break
        moved = moved - _sums(pairs.i, half[:, None] * to_j, len(moved))
    return moved


def _about(e: np.ndarray, meets: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """(k, 2) directions turned away from e, more to the right where somebody comes."""
    angle = angle - paper.SHUFFLE_RIGHT * meets
    x, y, cos, sin = *e.T, np.cos(angle), np.sin(angle)
    return np.array([x * cos - y * sin, x * sin + y * cos]).T


def _not_into_each_other(
    position: np.ndarray, moved: np.ndarray, pairs: Pairs
) -> np.ndarray:
    """Of two who would overlap, keep in place the one that yields; if need be, both."""
    before, yields = pairs.off(position), pairs.yields
    room = np.minimum(pairs.room, np.sqrt(_along(before, before))) - 1e-9
    moved = moved.copy()
    while True:
        off = pairs.off(moved)
        clash = _along(off, off) < room**2
        if not clash.any():
            return moved
        who = pairs.i[clash & yields]
        moved[who] = position[who]
        yields = np.ones_like(yields)
