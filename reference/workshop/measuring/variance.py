"""What the noise of a decision is made of: actions, mates, and all that follows.

A robot's gradient learns from what came after its action.  That varies with the state
in which it acted, with the action, with what its mates did at the same moment, and with
all that was drawn later.  Only what the action itself changes can be learned.

Every own action meets every action of the mates, in every future: crossed random
effects (Searle, Casella and McCulloch 1992), whose components are estimated without
bias, so that estimates of one that is 0 lie on both sides of it.

    A, M, F  own actions, actions of the mates, futures;  S  states
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.random import Generator as Rng

from reference.game.codec import Moment, decision_in
from reference.game.observations import robots_at_work
from reference.simulation import Simulation
from reference.workshop.measuring.branching import (
    Order,
    played_on,
    players_of,
    saved,
)
from reference.world import Robot

STATE = "the state"
OWN = "own action"
MATES = "mates' actions"
LATER = "what follows"
OWN_MATES = "own action x mates'"
OWN_LATER = "own action x what follows"
MATES_LATER = "mates' actions x what follows"
ALL_THREE = "all three"
PARTS = (
    STATE,
    OWN,
    MATES,
    LATER,
    OWN_MATES,
    OWN_LATER,
    MATES_LATER,
    ALL_THREE,
)
"""Parts of a variance; with a cross: what two change together, beyond each alone."""


def crossed(
    run: Simulation, robot: Robot, actions: int, rng: Rng, seeds: Sequence[int]
) -> np.ndarray:
    """Play all combinations to their end: people saved, (A, M, F) with A = M.

    run      stopped at a decision, with robots that a network plays
    actions  A, how often the network draws for the robot, and as often for its mates
    seeds    F, of the futures, in which robots draw their actions, too
    """
    player = players_of(run)["robots"]
    own = [_drawn(run, player, rng) for _ in range(actions)]
    mates = [_drawn(run, player, rng) for _ in range(actions)]
    body = robot.body
    orders = [others | {body: mine[body]} for mine in own for others in mates]
    people = saved(played_on(run, orders, seeds, sample=True))
    return people.reshape(actions, actions, len(seeds)).astype(float)


def _drawn(run: Simulation, player: Any, rng: Rng) -> dict[int, Order]:
    """Draw an action for each robot: where its body is sent, once."""
    world = run.world
    (vectors,) = player.codec.observe([world])
    moment = Moment(vectors, robots_at_work(world), world, rng)
    (rows,), _ = player.act([moment])
    bodies = [robot.body for robot in world.robots]
    orders = [Order(decision_in(row), 1) for row in rows]
    return dict(zip(bodies, orders, strict=True))


def components(results: np.ndarray) -> dict[str, float]:
    """Estimate parts of the variance within one state, (A, M, F): PARTS but STATE.

    Each from its mean square, less what other parts add to that.
    """
    A, M, F = results.shape
    whole = results.mean()
    a = results.mean(axis=(1, 2), keepdims=True) - whole
    m = results.mean(axis=(0, 2), keepdims=True) - whole
    f = results.mean(axis=(0, 1), keepdims=True) - whole
    am = results.mean(axis=2, keepdims=True) - whole - a - m
    af = results.mean(axis=1, keepdims=True) - whole - a - f
    mf = results.mean(axis=0, keepdims=True) - whole - m - f
    amf = results - whole - a - m - f - am - af - mf

    # mean squares, each the sum of squares over its degrees of freedom
    of_a = M * F * np.square(a).sum() / (A - 1)
    of_m = A * F * np.square(m).sum() / (M - 1)
    of_f = A * M * np.square(f).sum() / (F - 1)
    of_am = F * np.square(am).sum() / ((A - 1) * (M - 1))
    of_af = M * np.square(af).sum() / ((A - 1) * (F - 1))
    of_mf = A * np.square(mf).sum() / ((M - 1) * (F - 1))
    of_amf = np.square(amf).sum() / ((A - 1) * (M - 1) * (F - 1))

    estimates = {
        OWN: (of_a - of_am - of_af + of_amf) / (M * F),
        MATES: (of_m - of_am - of_mf + of_amf) / (A * F),
        LATER: (of_f - of_af - of_mf + of_amf) / (A * M),
        OWN_MATES: (of_am - of_amf) / F,
        OWN_LATER: (of_af - of_amf) / M,
        MATES_LATER: (of_mf - of_amf) / A,
        ALL_THREE: of_amf,
    }
    return {name: float(value) for name, value in estimates.items()}


def parts_of(results: np.ndarray) -> dict[str, float]:
    """Estimate all PARTS of the variance of results in S states, (S, A, M, F)."""
    within = [components(one) for one in results]
    parts = {name: float(np.mean([one[name] for one in within])) for name in within[0]}

    # what the mean of a state owes to luck, not to the state
    _, A, M, F = results.shape
    samples = {
        OWN: A,
        MATES: M,
        LATER: F,
        OWN_MATES: A * M,
        OWN_LATER: A * F,
        MATES_LATER: M * F,
        ALL_THREE: A * M * F,
    }
    luck = sum(parts[name] / count for name, count in samples.items())
    means = results.mean(axis=(1, 2, 3))
    return {STATE: float(means.var(ddof=1) - luck)} | parts
