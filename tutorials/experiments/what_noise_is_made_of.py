"""What drowns the signal of an update? The parts of a decision's noise.

    python tutorials/experiments/what_noise_is_made_of.py learned --fire busiest closer

A robot's gradient learns from what came after its action. That varies with the state
in which it acted, with the action, with what its mates did at the same moment, and with
all that was drawn later. Only what the action itself changes can be learned; the
state's part is what a critic can foresee.

At a decision drawn at random, a robot's action is drawn some times from its policy, its
mates' as often, and futures; until then robots have done what is likeliest. All
combinations are played to their end: crossed random effects (Searle, Casella and
McCulloch 1992), whose components are estimated without bias, so that estimates of one
that is 0 lie on both sides of it.

    A, M, F  own actions, actions of the mates, futures;  S  states
"""

import sys
from argparse import ArgumentParser
from functools import partial

import numpy as np

from reference import Scenario, Simulation, load
from reference.paper import InputError
from reference.workshop.commands.common import exit_status
from reference.workshop.commands.options import whole
from reference.workshop.comparing.intervals import interval_of_mean
from reference.workshop.comparing.named import strategy_named
from reference.workshop.engine import make_ready, run_to_decision
from reference.workshop.measuring.branching import (
    Order,
    played_on,
    players_of,
    saved,
)
from reference.workshop.storage.workers import map_in_shares, one_thread, workers
from reference.workshop.strategies.trained import decide_all

ACTIONS = 3  # of the robot, and of its mates
FUTURES = 6

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


def results_of(robots, fire, seeds):
    """For each seed, people saved after a decision of its evacuation: (A, M, F)."""
    with one_thread():
        return [results_at(robots, fire, seed) for seed in seeds]


def results_at(robots, fire, seed):
    """Draw a decision of an evacuation, and a robot: people saved, (A, M, F)."""
    rng = np.random.default_rng([seed, 1])
    who = strategy_named(robots, "robots")
    foe = strategy_named(fire, "fire")
    run = Simulation(load("paper"), Scenario(), who, foe, seed)
    found = []
    while not run.done:
        team = [k for k, robot in enumerate(run.world.robots) if robot.active]
        if team:
            now = run.copy()
            found += [(now, robot) for robot in team]
        run_to_decision([run])
    now, robot = found[rng.integers(len(found))]
    futures = rng.integers(2**62, size=FUTURES).tolist()
    return crossed(now, now.world.robots[robot], ACTIONS, rng, futures)


def crossed(run, robot, actions, rng, seeds):
    """Play all combinations to their end: people saved, (A, M, F) with A = M.

    run      stopped at a decision, with robots that a network plays
    actions  A, how often the network draws for the robot, and as often for its mates
    seeds    F, of the futures, in which robots draw their actions, too
    """
    player = players_of(run)["robots"]
    own = [drawn(run, player, rng) for _ in range(actions)]
    mates = [drawn(run, player, rng) for _ in range(actions)]
    body = robot.body
    orders = [others | {body: mine[body]} for mine in own for others in mates]
    people = saved(played_on(run, orders, seeds, sample=True))
    return people.reshape(actions, actions, len(seeds)).astype(float)


def drawn(run, player, rng):
    """Draw an action for each robot: where its body is sent, once."""
    world = run.world
    (decided,) = decide_all(player, player.codec.observe([world]), [world], [rng])
    pairs = zip(world.robots, decided, strict=True)
    return {robot.body: Order(point, 1) for robot, point in pairs}


def components(results):
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


def parts_of(results):
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


def tell(fire, results):
    """Print each part's share of the whole variance, with its interval."""
    parts = parts_of(results)
    variance = sum(parts.values())
    people = results.mean()
    print(f"{fire}: {len(results)} decisions; {people:.1f} people saved", end="")
    print(f", deviation {variance**0.5:.2f}")
    for name in (OWN, *(part for part in PARTS if part != OWN)):
        words = f"    {name:32}{100 * parts[name] / variance:6.1f} %"
        if name != STATE:
            of_each = [components(one)[name] for one in results]
            _, low, high = interval_of_mean(of_each)
            words += f" [{100 * low / variance:.1f}, {100 * high / variance:.1f}]"
        print(words, flush=True)


def main():
    parser = ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("robots", metavar="S", help="learned, or a training's folder")
    parser.add_argument("--fire", nargs="+", default=["busiest", "closer"], metavar="S")
    parser.add_argument("--decisions", type=whole(2), default=100, metavar="N")
    parser.add_argument("--seed", type=whole(0), default=120_000, metavar="N")
    parser.add_argument("--workers", type=whole(0), default=2, metavar="N")
    asked = parser.parse_args()
    if not hasattr(strategy_named(asked.robots, "robots"), "player"):
        raise InputError(f"{asked.robots}: no network plays it. Name a training.")
    make_ready()
    seeds = range(asked.seed, asked.seed + asked.decisions)
    with workers(asked.workers) as pool:
        for name in asked.fire:
            work = partial(results_of, asked.robots, name)
            tell(name, np.stack(map_in_shares(pool, work, seeds)))


if __name__ == "__main__":
    sys.exit(exit_status(main))
