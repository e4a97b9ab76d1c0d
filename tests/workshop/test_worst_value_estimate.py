"""The estimate of the reward to come: by hand on small boards, about right on large."""

import numpy as np
import pytest
from movies import play_until, shipped, stage

from reference.paper import (
    BURN_LOSS,
    FIXED_PENALTY,
    FIXED_REWARD,
    FRAMES_PER_SECOND,
    HEALTH,
    HEALTH_RATE,
    PEOPLE,
    STAIRS_SECONDS,
    WALKING_SPEED,
    Scenario,
)
from reference.simulation import Simulation
from reference.strategies import NoFire
from reference.workshop.evaluation.worst_case.value_estimate import (
    SEARCH,
    SOON,
    value_estimate,
)
from reference.workshop.strategies.robots import Sweep
from reference.world import Fate

PER_SECOND = HEALTH_RATE * FRAMES_PER_SECOND
PER_METRE = PER_SECOND * SEARCH / WALKING_SPEED
STOREY = PER_SECOND * STAIRS_SECONDS


def test_one_human_hopes_for_what_the_way_leaves():
    """Eight metres to the exit, SEARCH times."""
    sim = stage("##########\n#p.......E\n##########")
    hoped = HEALTH - 8 * PER_METRE + FIXED_REWARD
    assert value_estimate(sim.world) == pytest.approx(hoped)


@pytest.mark.paper("F8", "chosen")
def test_every_floor_that_is_left_pays():
    """From the second floor: at the entrance, and at the exit after the stairs."""
    board = """
           ######
        ####....#
        #AA+....E
        ####....#
           ######

           ######
        ####....#
        #AA+..p.#
        ####....#
           ######
        """
    sim = stage(board)
    first = HEALTH - 3 * PER_METRE
    last = first - STOREY - 5 * PER_METRE
    assert value_estimate(sim.world) == pytest.approx(first + last + FIXED_REWARD)


@pytest.mark.parametrize(("floor", "landings"), [(1, 0), (2, 1)])
def test_whoever_is_on_the_stairs_has_been_paid_for_the_floor(floor, landings):
    """Landings and the exit are to come, all later if the stairs take longer."""
    sim = Simulation(
        shipped("paper"), Scenario(people=PEOPLE), Sweep(), NoFire(), seed=1
    )
    bodies = sim.world.bodies

    def on_the_stairs():
        return ((bodies.stairwell >= 0) & (bodies.floor == floor)).any()

    play_until(sim, on_the_stairs)
    (i, *_) = np.flatnonzero((bodies.stairwell >= 0) & (bodies.floor == floor))
    bodies.fate[:] = Fate.DEAD
    bodies.fate[i] = Fate.INSIDE
    hopes = []
    for seconds in (0, 10):
        bodies.stairs_until[i] = sim.world.time + seconds
        hopes.append(value_estimate(sim.world))
    most = FIXED_REWARD + (1 + landings) * bodies.health[i] - landings * STOREY
    assert most - HEALTH < hopes[0] < most
    assert hopes[0] - hopes[1] == pytest.approx((1 + landings) * 10 * PER_SECOND)


def test_flames_are_walked_through_at_the_health_that_costs():
    """One burning cell, two hot ones beside it, in a corridor."""
    board = "############\n#p....{}....E\n############"
    free, burning = (stage(board.format(cell)).world for cell in ".*")
    lost = value_estimate(free) - value_estimate(burning)
    assert BURN_LOSS / WALKING_SPEED < lost < 4 * BURN_LOSS / WALKING_SPEED


def test_whoever_cannot_get_through_is_given_up():
    """Fourteen metres of flames cost more than all health."""
    sim = stage("#" * 20 + "\n#p..." + "*" * 14 + "E\n" + "#" * 20)
    assert value_estimate(sim.world) == -FIXED_PENALTY


def test_flames_count_as_they_will_be_soon():
    """A cell that burns within SOON seconds does already, a later one does not."""
    sim = stage("############\n#p.........E\n############")
    before = value_estimate(sim.world)
    for arrival, worse in ((SOON + 1, False), (SOON - 1, True)):
        sim.world.flames.arrival[0, 1, 6] = arrival
        assert (value_estimate(sim.world) < before) == worse


def test_nobody_inside_hopes_for_nothing():
    """Zero, not nan."""
    assert value_estimate(stage("#######\n#.....E\n#######").world) == 0


def test_one_more_flame_never_gives_hope():
    """Cell by cell, in a room with two ways."""
    sim = stage(
        """
        ##########
        #p..q....E
        #...##...#
        #r..##.s.#
        #........E
        ##########
        """
    )
    rng, arrival = np.random.default_rng(0), sim.world.flames.arrival
    cells = np.argwhere(sim.building.kind == 2)
    hopes = [value_estimate(sim.world)]
    for cell in rng.permutation(cells)[:20]:
        arrival[tuple(cell)] = 0.0
        hopes.append(value_estimate(sim.world))
    assert hopes == sorted(hopes, reverse=True) and hopes[-1] < hopes[0]


@pytest.mark.slow
@pytest.mark.paper("F4", "chosen")
def test_it_is_about_what_then_comes():
    """The paper's building with no fire, against `sweep`: within a fifth."""
    hoped, came = [], []
    for seed in range(2):
        sim = Simulation(shipped("paper"), Scenario(), Sweep(), NoFire(), seed)
        hoped.append(value_estimate(sim.world))
        came.append(sim.run().reward)
    assert np.mean(hoped) == pytest.approx(np.mean(came), rel=0.2)
