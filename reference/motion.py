"""Pedestrian dynamics: bodies walk to their targets, round each other, not into walls.

The collision-free speed model of Tordeux, Chraibi and Seyfried (2016), as in JuPedSim:
speed falls with the gap ahead [A9].  Ours besides: people keep to the right of oncoming
people and turn their shoulders; a body that is held up, or that stands in the way of
others and cannot make room, tries a small random step.

    n    bodies;  k  pairs of neighbours, each counted both ways (i looks at j)
    e_i  unit vector i means to walk along;  v_i  its speed, m/s
    s    metres from the edge of i to the edge of j
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.random import Generator as Rng
from scipy.spatial import cKDTree

from reference import paper
from reference.world import FLOOR_APART

Free = Callable[[np.ndarray, np.ndarray], np.ndarray]
"""(k, 2) positions of (k,) bodies -> (k,) bool: may they stand there?"""


class Heading(NamedTuple):
    """What n bodies would do if nobody were in their way."""

    e: np.ndarray  # (n, 2) unit vectors, zero exactly at the target
    far: np.ndarray  # (n,) metres to go
    v: np.ndarray  # (n,) m/s


class Pairs(NamedTuple):
    """Neighbours, each pair counted both ways; all are (k,), to_j is (k, 2)."""

    i: np.ndarray  # the body that looks
    j: np.ndarray  # the one looked at
    to_j: np.ndarray  # unit vector from i to j
    apart: np.ndarray  # metres between their middles
    least_apart: np.ndarray  # metres that the middles keep apart
    facing: np.ndarray  # bool, headed in opposite directions, maybe past each other
    yields: np.ndarray  # bool, i gives way

    def off(self, points: np.ndarray) -> np.ndarray:
        """(k, 2) metres from each i to its j, if bodies stand at points (n, 2)."""
        return points.take(self.j, 0) - points.take(self.i, 0)


def neighbours(
    position: np.ndarray, floor: np.ndarray, pace: np.ndarray, seconds: float
) -> np.ndarray:
    """(2, k / 2) bodies on the same floor that are near each other, each pair once.

    Sorted: the lower number of a pair comes first, and pairs with lower numbers do. So
    sums over neighbours do not depend on the tree, which finds pairs in any order.
    """
    if len(position) < 2:
        return np.empty((2, 0), np.int64)
    meeting = paper.body_diameter() + 2 * float(pace.max()) * seconds
    near = max(paper.NEIGHBOUR_METRES, meeting)
    where = position + (floor * FLOOR_APART)[:, None]
    tree = cKDTree(where, balanced_tree=False, compact_nodes=False)
    i, j = tree.query_pairs(near + 1e-6, output_type="ndarray").T
    off = position.take(j, 0) - position.take(i, 0)
    n = len(position)
    # one number a pair, so that one sort orders both
    pairs = np.sort((i * n + j)[_along(off, off) <= near * near])
    return np.array(np.divmod(pairs, n))


def step(
    position: np.ndarray,
    floor: np.ndarray,
    target: np.ndarray,
    pace: np.ndarray,
    seconds: float,
    free: Free,
    rng: Rng,
) -> np.ndarray:
    """Move n bodies by one tick; return their new positions, (n, 2) metres.

    position, target: (n, 2) metres; floor: (n,); pace: (n,) m/s.
    """
    heading = _heading(position, target, pace, seconds)
    near = neighbours(position, floor, pace, seconds)
    if not near.size:  # nobody is in anybody's way: nobody shuffles [A9, chosen]
        return _walk(position, heading.e, heading.v * seconds, free)
    pairs = _pairs(near, position, heading)
    turned, v = _heed_neighbours(heading, pairs)

    walked = _walk(position, turned, v * seconds, free)
    pushed = _push(walked, pairs, free)
    moved = _not_into_each_other(position, pushed, pairs, pairs.yields)

    # Who has arrived means to go where neighbours turn them: aside.
    there = heading.far <= paper.ARRIVED_METRES
    onward = np.where(there[:, None], turned, heading.e)
    advanced = _along(moved - position, onward)
    held_up = (advanced < paper.HELD_UP_SPEED * seconds) & onward.any(axis=1)
    if not held_up.any():
        return moved
    stride = paper.SHUFFLE_SPEED * seconds
    return _shuffle(moved, onward, held_up, stride, pairs, free, rng)


# -- Where to, and who is near ------------------------------------------------------


def _heading(
    position: np.ndarray, target: np.ndarray, pace: np.ndarray, seconds: float
) -> Heading:
    """Head for the targets, a little to the right of those that are far."""
    e, far = _directions(target - position)
    aside = np.where(far > paper.FAR_METRES, paper.ASIDE_METRES, 0)
    e, far = _directions(target + _right_of(e) * aside[:, None] - position)
    return Heading(e, far, np.minimum(pace, far / seconds))


def _pairs(near: np.ndarray, position: np.ndarray, heading: Heading) -> Pairs:
    """Describe neighbours; near: (2, k / 2), each pair once."""
    one, other = near
    i = np.concatenate([one, other])
    j = np.concatenate([other, one])
    far_i = heading.far[i]
    far_j = heading.far[j]
    yields = (far_i > far_j) | ((far_i == far_j) & (i > j))

    to_j, apart = _directions(position.take(j, 0) - position.take(i, 0))
    facing = _along(heading.e.take(i, 0), heading.e.take(j, 0)) < -paper.TOWARDS
    # only where the ways to go add up to more than the gap: they would meet
    facing &= far_i + far_j > apart + paper.body_diameter()
    least_apart = np.where(facing, paper.SHOULDER_METRES, paper.body_diameter())
    return Pairs(i, j, to_j, apart, least_apart, facing, yields)


def _heed_neighbours(heading: Heading, pairs: Pairs) -> tuple[np.ndarray, np.ndarray]:
    """Turn directions away from neighbours, and slow down to keep the gap ahead.

    Returns (n, 2) unit vectors and (n,) m/s.
    """
    standing = heading.v < paper.IDLE_SPEED
    turned, strength = _turn_away(heading.e, standing, pairs)
    give_way = np.minimum(strength, 1) * paper.GIVE_WAY_SPEED
    v = np.where(standing, give_way, heading.v)
    return turned, _keep_gap(turned, v, pairs)


def _turn_away(
    e: np.ndarray, standing: np.ndarray, pairs: Pairs
) -> tuple[np.ndarray, np.ndarray]:
    """Turn away from neighbours; who stands heeds only those who walk at them.

    Returns (n, 2) unit vectors, and (n,) how strongly each is turned.
    """
    i = pairs.i
    to_j = pairs.to_j
    s = pairs.apart - paper.body_diameter()
    at_me = _along(e.take(pairs.j, 0), to_j) < -paper.TOWARDS
    towards = _along(e.take(i, 0), to_j) > paper.TOWARDS
    push = _push_weight(s) * (at_me | ~standing[i])
    right = np.zeros(len(e))
    right[i[at_me & towards]] = paper.KEEP_RIGHT
    aside = _right_of(e) * right[:, None]
    swerve = aside - _sums(i, push[:, None] * to_j, len(e))
    return _directions(np.where(standing[:, None], 0, e) + swerve)


def _keep_gap(turned: np.ndarray, v: np.ndarray, pairs: Pairs) -> np.ndarray:
    """Slow down behind whoever is in front; of two in each other's way one waits.

    v: (n,) m/s that each would walk;  returns what each may.
    """
    i = pairs.i
    to_j = pairs.to_j
    turned_i = turned.take(i, 0)
    ahead = _along(turned_i, to_j)
    aside = np.abs(turned_i[:, 0] * to_j[:, 1] - turned_i[:, 1] * to_j[:, 0])
    front = (ahead > 0) & (aside * pairs.apart < paper.body_diameter())
    half = len(i) // 2  # pairs k and k + half are the same two, each looking once
    mutual = np.concatenate([front[half:], front[:half]])
    front &= pairs.yields | ~mutual
    s = (pairs.apart - paper.body_diameter())[front]
    slower = v.copy()
    np.minimum.at(slower, i[front], np.maximum(s, 0) / paper.GAP_SECONDS)
    return slower


def _push_weight(s: np.ndarray) -> np.ndarray:
    """(k,) how strongly neighbours turn a body away, by the gaps to them.

    The model's exp(-s / PUSH_RANGE) is the limit of (1 + s / (n PUSH_RANGE)) ** -n for
    large n. Ours is 16 [A9, chosen]: IEEE 754 does not say how to round exp.
    """
    root = 1 + s / (16 * paper.PUSH_RANGE)
    for _ in range(4):
        root *= root
    return paper.PUSH_STRENGTH * (1 / root)


# -- Walk, push, shuffle ------------------------------------------------------------


def _walk(
    position: np.ndarray, e: np.ndarray, metres: np.ndarray, free: Free
) -> np.ndarray:
    """Walk so many metres along e, but not into walls."""
    return _not_into_walls(position, position + e * metres[:, None], free)


def _push(walked: np.ndarray, pairs: Pairs, free: Free) -> np.ndarray:
    """Push overlapping bodies apart, each by half, so that they slide round each other.

    Nobody is pushed into a wall.
    """
    pushed = walked
    for _ in range(paper.PUSH_ROUNDS):
        to_j, apart = _directions(pairs.off(pushed))
        half = np.maximum(paper.body_diameter() - apart, 0) / 2
        if not half.any():
            break
        pushed = pushed - _sums(pairs.i, half[:, None] * to_j, len(pushed))
    return _not_into_walls(walked, pushed, free)


def _shuffle(
    moved: np.ndarray,
    e: np.ndarray,
    held_up: np.ndarray,
    stride: float,
    pairs: Pairs,
    free: Free,
    rng: Rng,
) -> np.ndarray:
    """Let those who are held up try a random step, if there is room; stride: metres."""
    who = np.flatnonzero(held_up)
    mine = held_up[pairs.i]
    pairs = Pairs(*(column[mine] for column in pairs))

    met = pairs.facing & (_along(e.take(pairs.i, 0), pairs.to_j) > 0)
    meets = np.isin(who, pairs.i[met])
    way = e[who]
    way[meets] = _turned(way[meets], -paper.SHUFFLE_RIGHT)
    # A random turn without cos and sin, see `_turned`: a uniform tangent gives nearly
    # uniform angles only for small ones, so half of the turn is drawn and made twice.
    half = paper.SHUFFLE_TURN * rng.uniform(-1, 1, len(who))
    tried = moved.copy()
    tried[who] += stride * _turned(_turned(way, half), half)

    barred = who[~free(tried[who], who)]
    tried[barred] = moved[barred]
    all_yield = np.ones(len(pairs.i), bool)
    return _not_into_each_other(moved, tried, pairs, all_yield)


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


def _not_into_each_other(
    position: np.ndarray, wished: np.ndarray, pairs: Pairs, yields: np.ndarray
) -> np.ndarray:
    """Of two who would overlap, keep in place the one that yields; if need be, both."""
    _, apart = _directions(pairs.off(position))
    # who overlap already may stay so, but come no nearer; two in one spot cannot
    least = np.maximum(np.minimum(pairs.least_apart, apart) - 1e-9, 0)
    moved = wished.copy()
    while True:
        off = pairs.off(moved)
        clash = _along(off, off) < least * least
        if not clash.any():
            return moved
        who = pairs.i[clash & yields]
        moved[who] = position[who]
        yields = np.ones_like(yields)


# -- Vectors ------------------------------------------------------------------------


def _directions(off: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(n, 2) unit vectors, zero where there is no way to go, and (n,) lengths."""
    far = np.sqrt(_along(off, off))
    return off / np.maximum(far, 1e-9)[:, None], far


def _along(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """(k,) dot products of (k, 2) vectors."""
    return one[:, 0] * other[:, 0] + one[:, 1] * other[:, 1]


def _right_of(e: np.ndarray) -> np.ndarray:
    """(n, 2) vectors turned to the right."""
    return np.array([e[:, 1], -e[:, 0]]).T


def _turned(e: np.ndarray, t: np.ndarray | float) -> np.ndarray:
    """(k, 2) vectors turned to the left by the angles whose halves have tangents t."""
    x, y = e.T
    square = t * t
    cos = (1 - square) / (1 + square)
    sin = 2 * t / (1 + square)
    return np.array([x * cos - y * sin, x * sin + y * cos]).T


def _sums(i: np.ndarray, vectors: np.ndarray, n: int) -> np.ndarray:
    """(n, 2) sums of the (k, 2) vectors of each i."""
    return np.array([np.bincount(i, axis, n) for axis in vectors.T]).T
