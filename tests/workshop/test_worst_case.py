"""The worst case: what fire and errors try out, what they take, and what that costs."""

from copy import deepcopy
from itertools import pairwise

import numpy as np
import pytest
from movies import built, found, shipped, stage, wait
from scipy.stats import ks_2samp
from trainings import begun

from reference.beginning import world_with_people_at
from reference.fire import NoFire, Spread, free_places
from reference.game.observations import fire_vectors, vector_layout
from reference.navigation import navigation_of
from reference.paper import Scenario
from reference.robots import NoRobots
from reference.simulation import Simulation
from reference.workshop.comparing import begin_evaluation
from reference.workshop.comparing.named import set_up_match
from reference.workshop.strategies import ROBOTS, worst_case
from reference.workshop.strategies.fires import APART_METRES, BusiestFire, busiest
from reference.workshop.strategies.guides import Observer, Patrol
from reference.workshop.strategies.worst_case import (
    DisturbedRobots,
    FirstDecision,
    WorstCase,
    another_future,
    with_errors,
)
from reference.workshop.training.checkpoints import save_checkpoint
from reference.workshop.training.policies import LearnedRobots
from reference.world import FireLit


def against(robots="sweep", seed=0, **scenario):
    """An evacuation of a small building against the worst case, not yet begun."""
    scene = Scenario(**{"people": 12, **scenario})
    return set_up_match(shipped("tiny"), scene, ROBOTS[robots](), WorstCase(), seed)


# -- What it chooses among ----------------------------------------------------------


@pytest.mark.paper("F4", "chosen")
@pytest.mark.paper("D6")
def test_it_chooses_among_free_cells_that_people_cross_and_that_lie_apart():
    """The busiest first."""
    sim = Simulation(shipped("paper"), Scenario())
    nav = navigation_of(sim.building)
    free = free_places(sim.world)
    places = [nav.place(*decision) for decision in busiest(sim.world, 6)]
    assert len(places) == 6 and free[places].all()
    for one, other in pairwise(places):
        same_floor = one // nav.floor_size == other // nav.floor_size
        metres = np.hypot(*(nav.centres[one] - nav.centres[other]))
        assert not same_floor or metres >= APART_METRES


# -- What it takes ------------------------------------------------------------------


@pytest.mark.paper("F4", "Eq. 5")
def test_it_takes_the_cell_that_leaves_least_reward_to_the_end():
    """Of the busiest, each played out in the same future."""
    sim = against("none", people=10, seed=2)
    wait(sim, 10)
    world = sim.world
    rng = np.random.default_rng(5)
    taken = sim.fire_strategy.decide(world, rng)
    seed = int(np.random.default_rng(5).integers(2**32))
    left = {}
    for place in busiest(world, 4):
        fire = FirstDecision(place, BusiestFire())
        future = another_future(world, sim.scenario, NoRobots(), fire, seed)
        left[place] = future.run().reward
    assert len(left) == 4 and left[taken] == min(left.values()) < max(left.values())


@pytest.mark.paper("F4", "Eq. 5")
def test_it_burns_the_only_way_out():
    """One source against four people behind a door: before the way, not behind them."""
    sim = stage("#.pqrs..+........E", fire=WorstCase(), sources=1)
    sim.run()
    (source,) = sim.world.flames.sources
    assert sim.building.cell(source.x, source.y)[1] > 5


def test_it_asks_copies_of_the_robots():
    """What these imagine does not change what they do."""
    sim = against("patrol", seed=4, people=8, sources=2, time_limit=50.0)
    wait(sim, 10)
    before = repr(vars(sim.robot_strategy))
    sim.fire_strategy.decide(sim.world, np.random.default_rng(0))
    assert repr(vars(sim.robot_strategy)) == before


# -- What it costs ------------------------------------------------------------------


@pytest.mark.paper("F4", "linear complexity")
def test_its_cost_is_linear_in_the_number_of_decisions(monkeypatch):
    """Four futures at most at every decision, whatever was decided before."""
    begun = []
    monkeypatch.setattr(
        "reference.workshop.strategies.worst_case.run_to_end",
        lambda futures: begun.append(len(futures)),
    )
    for sources in (0, 1, 2):
        begun.clear()
        sim = against(people=6, sources=sources, time_limit=60.0)
        sim.world.bodies.pace[:] = 0  # nobody gets out, so that every turn comes
        sim.run()
        assert len(begun) == sources and max(begun, default=0) <= 4


# -- Errors of observation ----------------------------------------------------------


def observers(seconds):
    """Robots that observe in a small building, some seconds later; a fire at 10 s."""
    fire = FirstDecision((0, 5.5, 0.5), NoFire())
    sim = Simulation(shipped("tiny"), Scenario(people=20), Observer(), fire, seed=3)
    wait(sim, seconds)
    return sim


@pytest.mark.paper("C4")
@pytest.mark.paper("F4", "Eq. 5")
def test_errors_shift_points_that_are_observed_and_nothing_else():
    """Each by ε at most in x and in y, however far from walls; the world stays."""
    sim = observers(20)
    rng = np.random.default_rng(1)
    layout = vector_layout(sim.building, sim.scenario)
    before = fire_vectors([sim.world], layout)
    off = fire_vectors([with_errors(sim.world, 2.0, rng)], layout) - before
    for name in layout.blocks:
        rows = layout.block_of(off[0, 0], name)
        if name in ("humans", "robots", "fires"):
            there = layout.block_of(before[0, 0], name)[:, 2] >= 0
            assert 1 < np.abs(rows[there, :2]).max() <= 2 and not rows[:, 2].any()
            rows = rows[~there]
        assert not rows.any()
    assert np.array_equal(fire_vectors([sim.world], layout), before)
    seen, exact = (with_errors(sim.world, most, rng) for most in (9.0, 0.0))
    assert sim.building.walkable.flat[seen.bodies.place].all()
    for name in ("place", "position"):
        found, wanted = (getattr(w.bodies, name) for w in (exact, sim.world))
        assert np.array_equal(found, wanted)


@pytest.mark.paper("F4", "Eq. 5")
def test_of_a_few_errors_robots_make_the_one_that_leaves_least_reward():
    """Of four and none, each played out in the same future."""
    sim = observers(10)
    rng = np.random.default_rng(5)
    world = sim.world
    scene = sim.scenario
    robots = DisturbedRobots(Observer(), NoFire(), scene, 4.0)
    taken = robots.decide(world, world.robots, rng)
    rng = np.random.default_rng(5)
    answers = []
    for most in (0, 4, 4, 4, 4):
        seen = with_errors(world, most, rng)
        answers.append(Observer().decide(seen, seen.robots, rng))
    seed = int(rng.integers(2**32))
    left = []
    for answer in answers:
        guides = FirstDecision(answer, Observer())
        left.append(another_future(world, scene, guides, NoFire(), seed).run().reward)
    worst = int(np.argmin(left))
    assert taken == answers[worst] != answers[0] and left[worst] < left[0]


@pytest.mark.paper("F4", "Eq. 5")
def test_the_worst_fire_tries_disturbed_robots_with_what_they_remember(monkeypatch):
    """And without errors: nobody adds them twice."""
    tried = []

    def noted(world, scenario, tries, rng):
        tried.extend(deepcopy(robots) for robots, _ in tries)
        return 0

    monkeypatch.setattr(worst_case, "_worst_try", noted)
    scene = Scenario(people=12)
    met = set_up_match(shipped("tiny"), scene, Patrol(), WorstCase(), 0, errors=2.0)
    wait(met, 26)  # the fire decides at 0 and 25 s
    assert type(met.robot_strategy) is DisturbedRobots
    by_fire = [robots for robots in tried if type(robots) is not FirstDecision]
    assert len(by_fire) > 2 and {type(robots) for robots in by_fire} == {Patrol}
    remembered = met.robot_strategy.robots._stops
    assert by_fire[-1]._stops.keys() == remembered.keys() != set()


@pytest.mark.paper("F4", "Eq. 5")
def test_a_learned_policy_can_be_disturbed_and_the_worst_fire_plays_on(tmp_path):
    """Neither imagines the other's futures; without robots nobody is disturbed."""
    save_checkpoint(begun(seed=3).checkpoint(), tmp_path / "own.pt")
    word = str(tmp_path / "own.pt")
    ways = {}
    for errors in (0, 3):
        made = begin_evaluation(
            (word, "none"), ("worst-case",), episodes=1, errors=errors
        )
        one, other = made.simulations(made.runs)
        attacked = one.fire_strategy.robots
        assert type(attacked.robots if errors else attacked) is LearnedRobots
        assert type(other.robot_strategy) is NoRobots
        one.step()
        ways[errors] = [robot.destination.tolist() for robot in one.world.robots]
    assert type(one.robot_strategy.fire) is BusiestFire
    assert ways[0] != ways[3]


# -- Another future -----------------------------------------------------------------


@pytest.mark.paper("F4", "chosen")
def test_another_future_has_the_same_past_and_draws_the_rest_anew():
    """What burns has burnt since the same time; flames spread otherwise from there."""
    fire = FirstDecision((0, 5.5, 0.5), BusiestFire())
    sim = Simulation(shipped("tiny"), Scenario(), fire=fire)
    wait(sim, 20)
    before = sim.world.flames.arrival.copy()
    now = sim.world.time
    one, other = (
        another_future(sim.world, sim.scenario, NoRobots(), NoFire(), seed).world
        for seed in (1, 2)
    )
    past = before <= now
    assert past.any() and np.array_equal(one.flames.arrival[past], before[past])
    assert one.flames.arrival[~past].min() > now
    assert not np.array_equal(one.flames.arrival, other.flames.arrival)
    assert np.array_equal(sim.world.flames.arrival, before)


@pytest.mark.paper("D7", "chosen")
@pytest.mark.usefixtures("unprotected")
@pytest.mark.parametrize("burn_seconds", [40, 1_000_000])
def test_what_burns_for_longer_may_light_its_neighbours_for_longer(burn_seconds):
    """Imagined fires last as long as the scenario's."""
    sim = stage("#*...pE", still="p", burn_seconds=burn_seconds)
    sim.world.time = 50.0
    futures = [
        another_future(sim.world, sim.scenario, NoRobots(), NoFire(), seed)
        for seed in range(20)
    ]
    reached = {bool(np.isfinite(f.world.flames.arrival[0, 1, 2])) for f in futures}
    assert reached == {burn_seconds > 50}


@pytest.mark.paper("D7", "chosen")
@pytest.mark.usefixtures("unprotected")
@pytest.mark.parametrize("lane", ["#.pq..E", "#p+q..E"])
def test_fresh_delays_are_distributed_like_what_is_left_of_the_old(lane):
    """A delay that is not over forgets how long it has lasted, a door's too."""
    building = built(f"{'#' * len(lane)}\n{lane}\n{'#' * len(lane)}")
    (_, _, p), (_, _, q) = found([[lane]], "pq")
    source = FireLit(0.0, 0, *building.metres(1, p))
    rng = np.random.default_rng(0)
    scenario = Scenario(people=0)
    came = []
    comes = []
    empty = np.zeros(0, dtype=int), np.zeros((0, 2))
    while len(came) < 200:
        world = world_with_people_at(building, scenario, *empty, rng)
        Spread(building, scenario, rng).ignite(world.flames, source)
        world.time = 12.0
        arrival = world.flames.arrival
        if (arrival <= 12).sum() == 2 and arrival[0, 1, q] > 12:
            came.append(arrival[0, 1, q])
            seed = len(came)
            after = another_future(world, scenario, NoRobots(), NoFire(), seed)
            comes.append(after.world.flames.arrival[0, 1, q])
    assert ks_2samp(came, comes).pvalue > 0.01
