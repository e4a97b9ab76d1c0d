"""Measure what one decision is worth: branch there, and play each choice to its end.

One robot is sent to a point for some decisions; then the team's own strategy goes on.
Every future has new random numbers, so no choice profits from what this evacuation
would have drawn. All choices share them (common random numbers), so that
luck cancels in a difference: TRPO's vine estimates (Schulman et al. 2015).

The best of many looks better than it is.  So three rounds, each in futures of its own:
all choices in a few, the best in more; and what was chosen is measured in fresh ones.

    own  what the team's strategy decides if nobody interferes;  S  futures
"""

from collections.abc import Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
from numpy.random import Generator as Rng

from reference.game.codec import PolicyCodec
from reference.game.environment import DECIMALS, AgentFire, AgentRobots
from reference.game.observations import robots_at_work
from reference.learning.settings import Side
from reference.robots import (
    Destination,
    Destinations,
    RobotStrategy,
    actual_target,
)
from reference.simulation import Simulation
from reference.workshop.anchors.frame import (
    FIRST_MARK,
    KEEP,
    WAIT,
    RobotView,
    robot_destinations,
)
from reference.workshop.engine import run_to_decision
from reference.workshop.strategies.trained import decide_all
from reference.workshop.strategies.worst_case import another_future
from reference.world import Robot, World

TO_WAY_OUT = "way out"
TO_FOOT = "foot of stairs"
TO_RIM = "rim"
TO_PERSON = "person"
TO_STAY = "stay"
GO_ON = "go on"
CHOICE_KINDS = (TO_WAY_OUT, TO_FOOT, TO_RIM, TO_PERSON, TO_STAY, GO_ON)
"""What an anchor is.  Where two are one point, the first of these is its name."""

FUTURES = (4, 16, 32)  # of the three rounds: to sift, to choose, to measure
SIFTED = 3  # choices that the first round leaves for the second


@dataclass(frozen=True)
class Choice:
    """A point to which a robot may be sent.

    kind  one of CHOICE_KINDS;  point  metres;  way  metres on foot from the robot
    helps  whether the robot's frame lets it be chosen where it has masks
    """

    kind: str
    point: Destination
    way: float
    helps: bool


@dataclass(frozen=True)
class Worth:
    """What a decision is worth, in people saved beyond those of the own decision.

    best      None: the own decision; then all figures are 0
    believed  where it was chosen;  gain  in fresh futures; both with standard errors
    """

    choices: int
    best: Choice | None = None
    believed: float = 0.0
    believed_error: float = 0.0
    gain: float = 0.0
    gain_error: float = 0.0


class Order(NamedTuple):
    """Where a robot is sent, and for how many decisions; None: it goes on."""

    point: Destination | None
    decisions: int


Orders = Mapping[int, Order]
"""Who is sent where, by body."""


class Held:
    """Do as another strategy, but send some robots elsewhere for some decisions."""

    def __init__(self, strategy: RobotStrategy, orders: Orders | None = None):
        self.strategy: Any = strategy
        self.orders = dict(orders or {})

    def decide(self, world: World, robots: Sequence[Robot], rng: Rng) -> Destinations:
        """Ask the strategy for all, and overrule it for those who are sent."""
        answers = self.strategy.decide(world, robots, rng)
        destinations = []
        for robot, answer in zip(robots, answers, strict=True):
            order = self.orders.get(robot.body)
            destinations.append(order.point if order else answer)

        self.orders = {
            body: order._replace(decisions=order.decisions - 1)
            for body, order in self.orders.items()
            if order.decisions > 1
        }
        return destinations


# -- What may be chosen -------------------------------------------------------------


def choices_of(run: Simulation, robot: Robot) -> list[Choice]:
    """List where a robot may be sent: its anchors, each actual target (Eq. 1) once.

    Ways out and old destinations are among them even where masks would forbid them.
    """
    view = _view_of(run, masks=False)
    helps = _view_of(run, masks=True).allowed
    row = run.world.robots.index(robot)
    found: dict[Destination, Choice] = {}
    for kind in CHOICE_KINDS:
        for k in _numbers_of(view, kind):
            if not view.allowed[row, k]:
                continue
            x, y = view.spots[row, k].round(DECIMALS).tolist()
            target = actual_target(run.building, robot.floor, x, y)
            way = float(view.way[row, k])
            found.setdefault(target, Choice(kind, (x, y), way, bool(helps[row, k])))
    return list(found.values())


def _view_of(run: Simulation, masks: bool) -> RobotView:
    codec = PolicyCodec("robots", run.building, run.scenario)
    (vectors,) = codec.observe([run.world])
    return RobotView(codec, vectors, robot_destinations(run.world), masks)


def _numbers_of(view: RobotView, kind: str) -> Sequence[int]:
    """List the numbers of a frame's anchors of one kind."""
    marks = range(FIRST_MARK, FIRST_MARK + view.marks.shape[1])
    of_kind = {
        TO_WAY_OUT: marks[view.of_outs],
        TO_FOOT: marks[view.of_feet],
        TO_RIM: marks[view.of_rims],
        TO_PERSON: range(marks.stop, view.spots.shape[1]),
        TO_STAY: [WAIT],
        GO_ON: [KEEP],
    }
    return of_kind[kind]


def own_kind(run: Simulation, robot: Robot, choices: Sequence[Choice]) -> str:
    """Tell the kind of the team's own decision: of CHOICE_KINDS, or "elsewhere".

    The strategy's memory stays as it is.
    """
    team = [mate for mate in run.world.robots if mate.active]
    strategy = deepcopy(run.robot_strategy)
    answers = strategy.decide(run.world, team, deepcopy(run.rng["robots"]))
    point = answers[team.index(robot)]
    if point is None and robot.destination is not None:
        point = tuple(robot.destination.tolist())
    if point is None:
        return TO_STAY
    target = actual_target(run.building, robot.floor, *point)
    for choice in choices:
        other = actual_target(run.building, robot.floor, *choice.point)
        if np.allclose(target, other, atol=0.01):
            return choice.kind
    return "elsewhere"


# -- Futures ------------------------------------------------------------------------


def future_of(run: Simulation, seed: int) -> Simulation:
    """Continue a copy of a run, stopped at a decision, with new random numbers.

    As `another_future`; doors stay full, and who is due to think stays due. Networks
    are replaced by agents that wait to be told, see `play_to_the_end`.
    """
    players = players_of(run)
    robots = AgentRobots() if "robots" in players else run.robot_strategy
    fire = AgentFire() if "fire" in players else run.fire_strategy
    future = another_future(run.world, run.scenario, Held(robots), fire, seed)
    future.full_until[:] = run.full_until
    future.due[:] = run.due
    return future


def branches(
    run: Simulation,
    robot: Robot,
    choices: Sequence[Choice | None],
    decisions: int,
    seeds: Sequence[int],
    mates: Orders = MappingProxyType({}),
) -> list[list[Simulation]]:
    """Play each choice to its end in the same futures: [choice][future].

    choices: None for the own decision;  decisions: for how many a point is held
    mates: where others are sent meanwhile
    """
    orders = []
    for choice in choices:
        own = {robot.body: Order(choice.point, decisions)} if choice else {}
        orders.append({**mates, **own})
    return played_on(run, orders, seeds)


def played_on(
    run: Simulation,
    orders: Sequence[Orders],
    seeds: Sequence[int],
    sample: bool = False,
) -> list[list[Simulation]]:
    """Send robots to places, and play to the end: [orders][future].

    sample: as in `play_to_the_end`
    """
    by_future = []
    for seed in seeds:
        future = future_of(run, seed)
        copies = [future.copy() for _ in orders]
        for copy, given in zip(copies, orders, strict=True):
            own = copy.robot_strategy.strategy  # type: ignore[attr-defined]
            copy.robot_strategy = Held(own, given)
        by_future.append(copies)

    going = [copy for copies in by_future for copy in copies]
    play_to_the_end(going, players_of(run), sample)
    return [list(futures) for futures in zip(*by_future, strict=True)]


def saved(played: Sequence[Sequence[Simulation]]) -> np.ndarray:
    """(choices, S) people who got out in each branch."""
    return np.array([[run.outcome().evacuated for run in runs] for runs in played])


def players_of(run: Simulation) -> dict[Side, Any]:
    """Find the networks that play a run, by side: all futures can ask one at once."""
    sides: dict[Side, Any] = {"robots": run.robot_strategy, "fire": run.fire_strategy}
    return {side: who.player for side, who in sides.items() if hasattr(who, "player")}


def play_to_the_end(
    runs: Sequence[Simulation], players: Mapping[Side, Any], sample: bool = False
) -> None:
    """Play futures side by side, decision by decision, and ask each network once.

    So its calls are fewer, and searches of ways that futures share are made once.
    sample: robots do not do what is likeliest, but draw, as in training
    """
    going = list(runs)
    while going := [run for run in going if not run.done]:
        for side, player in players.items():
            _ask(side, player, going, sample and side == "robots")
        run_to_decision(going)


def _ask(side: Side, player: Any, runs: Sequence[Simulation], sample: bool) -> None:
    """Tell the agents of a side what its network decides."""
    if side == "fire":
        asked = [run for run in runs if run.fire_turn]
    else:
        asked = [run for run in runs if robots_at_work(run.world).any()]
    if not asked:
        return

    worlds = [run.world for run in asked]
    rngs = [run.rng[side] if sample else None for run in asked]
    decided = decide_all(player, player.codec.observe(worlds), worlds, rngs)
    for run, decisions in zip(asked, decided, strict=True):
        who: Any = run.fire_strategy
        if side == "robots":
            who = run.robot_strategy.strategy  # type: ignore[attr-defined]
        who.chosen = decisions


# -- Its worth ----------------------------------------------------------------------


class SearchResult(NamedTuple):
    """What a search has found for a robot.

    choices  how many there were;  best  None: the own decision
    more     (S,) people whom the best saves beyond the own, where it was chosen
    """

    choices: int
    best: Choice | None = None
    more: np.ndarray = np.zeros(1)

    @property
    def believed_in(self) -> bool:
        """Whether the best seems better, and hardly by chance."""
        return surely_more(*mean_and_error(self.more))


def search(
    run: Simulation,
    robot: Robot,
    decisions: int,
    rounds: Sequence[Sequence[int]],
    mates: Orders = MappingProxyType({}),
) -> SearchResult:
    """Find the best choice for a robot now, held for some decisions.

    run     stopped at a decision;  mates: where others are sent meanwhile
    rounds  two: the seeds of the futures of each
    """
    sift, choose = rounds
    choices = choices_of(run, robot)
    own, *played = branches(run, robot, [None, *choices], decisions, sift, mates)

    # the same events in all futures: the own decision under another name
    others = [
        (choice, runs)
        for choice, runs in zip(choices, played, strict=True)
        if any(a.events != b.events for a, b in zip(own, runs, strict=True))
    ]
    if not others:
        return SearchResult(len(choices))
    means = saved([runs for _, runs in others]).mean(axis=1)
    first = np.argsort(-means, kind="stable")[:SIFTED]
    best = [others[k][0] for k in first]

    means = saved(branches(run, robot, [None, *best], decisions, choose, mates))
    more = means[1:] - means[0]
    k = int(more.mean(axis=1).argmax())
    if more[k].mean() <= 0:
        return SearchResult(len(choices))
    return SearchResult(len(choices), best[k], more[k])


def worth_of(
    run: Simulation, robot: Robot, decisions: int, rounds: Sequence[Sequence[int]]
) -> Worth:
    """Find the best choice for a robot now, and what it is worth in fresh futures.

    run     stopped at a decision
    rounds  three: the seeds of the futures of each
    """
    *searching, measure = rounds
    found = search(run, robot, decisions, searching)
    if found.best is None:
        return Worth(found.choices)
    own, best = saved(branches(run, robot, [None, found.best], decisions, measure))
    believed, believed_error = mean_and_error(found.more)
    gain, gain_error = mean_and_error(best - own)
    return Worth(
        choices=found.choices,
        best=found.best,
        believed=believed,
        believed_error=believed_error,
        gain=gain,
        gain_error=gain_error,
    )


def play_searching(
    run: Simulation, decisions: int, futures: Sequence[int], rng: Rng
) -> int:
    """Play a run to its end with robots that search; count what they chose so.

    Every so many decisions robots search one after the other, and each knows where
    those before it are sent.  One goes where it believes in, until the next search.

    futures: how many each of the two rounds of `search` has;  rng: draws their seeds
    """
    team: Any = run.robot_strategy
    held = Held(team)
    chosen = 0
    passed = 0
    while not run.done:
        if passed % decisions == 0:
            held.orders = _searched(run, decisions, futures, rng)
            chosen += len(held.orders)
        passed += 1

        run.robot_strategy = held
        run_to_decision([run])
        run.robot_strategy = team
    return chosen


def _searched(
    run: Simulation, decisions: int, futures: Sequence[int], rng: Rng
) -> dict[int, Order]:
    """Search for each robot in turn: where those go who believe in something better."""
    orders = dict[int, Order]()
    for robot in run.world.robots:
        if robot.active:
            rounds = [rng.integers(2**62, size=size).tolist() for size in futures]
            found = search(run, robot, decisions, rounds, orders)
            if found.best and found.believed_in:
                orders[robot.body] = Order(found.best.point, decisions)
    return orders


def mean_and_error(values: np.ndarray) -> tuple[float, float]:
    """Compute the mean of (S,) values, and its standard error; 0 for a single one."""
    spread = values.std(ddof=1) if len(values) > 1 else 0.0
    return float(values.mean()), float(spread / len(values) ** 0.5)


def surely_more(mean: float, error: float) -> bool:
    """Whether a mean is above 0 by more than twice its standard error."""
    return mean > 2 * error
