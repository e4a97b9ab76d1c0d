"""The bounds: by hand on small boards, as printed on the paper's, never beaten."""

import numpy as np
import pytest
from movies import built, shipped, stage

from reference.evaluation.bounds import (
    best_reward,
    best_reward_carried,
    best_reward_of,
    critical_points,
    losses,
    mean_ways,
    worst_reward,
)
from reference.evaluation.score import PAPER, base_and_control
from reference.paper import (
    BEST_POINT,
    FIXED_REWARD,
    FRAMES_PER_SECOND,
    HEALTH,
    HEALTH_RATE,
    PEOPLE,
    STAIRS_SECONDS,
    WALKING_SPEED,
    WORST_POINT,
    Scenario,
)
from reference.simulation import Simulation
from reference.strategies import NoFire, NoRobots, RandomFire
from reference.workshop.strategies import robots_named
from reference.workshop.strategies.fires import GreedyFire
from reference.workshop.strategies.robots import Sweep

THIRD = (0, 0, PEOPLE)
"""Everybody starts on the third floor."""

CORRIDOR = """
#########
E......p#
#########
"""

STOREYS = """
   ######
####....#
#AA+....E
####....#
   ######

   ######
####....#
#AA+....#
####....#
   ######

   ######
####....#
#AA+...p#
####....#
   ######
"""


class Knowing(Simulation):
    """People who know the map: each walks to the nearest way out of their floor."""

    def _people_decide(self, who, views):
        bodies = self.world.bodies
        for i in who:
            ways = self.building.ways_out(int(bodies.floor[i]))
            d = self.navigation.distance[ways, bodies.place[i]]
            bodies.landmark[i] = ways[int(np.argmin(d))]


# -- Equations 6 and 7 --------------------------------------------------------------


@pytest.mark.paper("F4", "Eq. 6")
def test_the_worst_reward_is_everybodys_death():
    """-12000 for forty, and Critical Point 1 lies there."""
    assert worst_reward() == -12000 == WORST_POINT[0]


@pytest.mark.paper("F6")
def test_the_mean_way_is_taken_over_all_cells_of_a_floors_rooms():
    """Seven cells in a row before an exit: 1 to 7 metres, 4 on average."""
    assert mean_ways(built(CORRIDOR)) == (4.0,)


@pytest.mark.paper("F6")
def test_the_mean_way_leads_to_the_nearer_of_two_ways_out():
    """1, 2, 2 and 1 metres: Min in Eq. 7."""
    board = """
    ######
    E....E
    ######
    """
    assert mean_ways(built(board)) == (1.5,)


@pytest.mark.paper("F6", "Eq. 7")
@pytest.mark.paper("F8")
def test_the_best_reward_of_the_papers_building_is_the_papers():
    """Ways of 23, 22 and 19 m at 1.35 m/s make 15000 within two in a hundred."""
    building = shipped("paper")
    assert mean_ways(building) == pytest.approx((23.4, 21.7, 19.0), abs=0.1)
    assert best_reward(building) == pytest.approx(15_000, rel=0.02)


@pytest.mark.paper("F7")
@pytest.mark.paper("F8")
@pytest.mark.parametrize(
    ("frames", "divided", "fixed_reward", "best"),
    [
        (FRAMES_PER_SECOND, False, 100, 15_050),  # what we read
        (FRAMES_PER_SECOND, True, 100, 12_200),  # framesp × rate as a denominator
        (1 / FRAMES_PER_SECOND, True, 100, -9_480_000),  # framesp as seconds a frame
        (FRAMES_PER_SECOND, True, 175, 15_200),  # literal again, another FixReward
    ],
)
def test_the_readings_of_equation_7(frames, divided, fixed_reward, best):
    """As printed it gives 15000 only with a FixReward of 175, of which nothing is said;
    health lost is seconds × frames a second × rate."""
    seconds = np.array(mean_ways(shipped("paper"))) / WALKING_SPEED
    rate = frames * HEALTH_RATE
    loss = seconds / rate if divided else seconds * rate
    R_b = PEOPLE * ((HEALTH - loss).sum() + fixed_reward)
    assert R_b == pytest.approx(best, rel=0.01)


@pytest.mark.paper("F6")
@pytest.mark.parametrize("name", ["museum", "tiny", "tower"])
def test_equation_7_sums_over_as_many_floors_as_there_are(name):
    """One, two, five: people × (floors × 100 + 100), less what is lost on the way."""
    building = shipped(name)
    lost = PEOPLE * sum(losses(building))
    full = PEOPLE * (building.floors * HEALTH + FIXED_REWARD)
    assert best_reward(building) == pytest.approx(full - lost)
    assert best_reward(building, speed=1e9) == pytest.approx(full)


# -- Health carried over ------------------------------------------------------------


@pytest.mark.paper("F8")
@pytest.mark.parametrize(
    ("starters", "best"), [(THIRD, 14_000), ((13, 13, 14), 10_970), ((1, 0, 0), 191.7)]
)
def test_what_is_lost_on_one_floor_is_missing_on_the_next(starters, best):
    """40 (3·100 - 6·8.33 + 100) = 14000, when all start on the third floor."""
    assert best_reward_carried([25 / 3] * 3, starters) == pytest.approx(best, rel=1e-3)


@pytest.mark.paper("F8")
def test_the_floor_that_people_start_on_is_the_first_to_cost():
    """70, 50 and 40 are left, and then the exit; not 90, 70 and 40."""
    assert best_reward_carried([10, 20, 30], (0, 0, 1)) == 70 + 50 + 40 + FIXED_REWARD


@pytest.mark.paper("F8")
def test_nobody_has_less_than_no_health():
    """Floors further down pay nothing to whoever is spent."""
    assert best_reward_carried([60, 60, 60], (0, 0, 1)) == 40 + FIXED_REWARD


def test_refuses_people_on_more_floors_than_losses():
    """With both numbers."""
    with pytest.raises(ValueError, match="losses on 2 floors, people on 3"):
        best_reward_carried([8, 8], (1, 1, 1))


@pytest.mark.paper("F12")
def test_the_papers_points_are_those_of_everybody_on_its_third_floor():
    """-12000 and 14000, rounded as the paper rounds: b and c are the printed ones."""
    points = critical_points(shipped("paper"), Scenario(people_per_floor=THIRD))
    assert points == (WORST_POINT, BEST_POINT)
    assert base_and_control(*points) == (PAPER.base, PAPER.control)


@pytest.mark.paper("F12")
def test_critical_point_2_lies_where_a_scenarios_best_runs_end():
    """Spread over three floors people earn less; twice as many, twice as much."""
    building = shipped("paper")
    assert critical_points(building) == ((-12_000, 0.1), (11_000, 1000))
    many = critical_points(building, Scenario(people=80))
    assert many == ((-24_000, 0.1), (22_000, 1000))


# -- A given placement --------------------------------------------------------------


@pytest.mark.paper("F8")
def test_who_walks_straight_out_comes_near_the_bound():
    """6.5 m from the middle of a cell to the exit's edge cost 2.4 health."""
    sim = stage(CORRIDOR)
    bound = best_reward_of(sim.world)
    by_hand = HEALTH - 0.5 * (6.5 - 0.1) / WALKING_SPEED + FIXED_REWARD
    assert bound == pytest.approx(by_hand)
    assert bound - 0.5 < sim.run().reward <= bound


@pytest.mark.paper("F8")
def test_each_floor_left_pays_and_stairs_take_their_time():
    """Off the third floor, past the second's landing, through the first and out."""
    sim = stage(STOREYS)
    walk = (3.5 - 0.1) / WALKING_SPEED
    at = [walk, walk + STAIRS_SECONDS, 2 * STAIRS_SECONDS + walk + 3.9 / WALKING_SPEED]
    by_hand = sum(HEALTH - 0.5 * seconds for seconds in at) + FIXED_REWARD
    bound = best_reward_of(sim.world)
    assert bound == pytest.approx(by_hand)
    assert bound - 3 < sim.run().reward <= bound


def test_the_better_of_two_ways_out_counts():
    """Not the nearer one: the stairs pay for two floors, the exit for one."""
    down = """
       #######
    ####.....#
    #AA+.....E
    ####.....#
       #######

       #######
    ####.....#
    #AA+....pE
    ####.....#
       #######
    """
    assert best_reward_of(stage(down).world) > HEALTH * 2


def test_walls_between_rooms_count():
    """Three rooms in a row: through both doors, however near the exit lies."""
    board = """
    #######
    #p#...E
    #.#...#
    #.#.###
    #.+.###
    #######
    """
    lost = 2 * HEALTH - best_reward_of(stage(board).world)
    assert lost > 0.5 * 6 / WALKING_SPEED


@pytest.mark.paper("F8")
@pytest.mark.parametrize("robots", ["none", "sweep"])
@pytest.mark.parametrize("people", [1, 6])
def test_nobody_does_better(people, robots):
    """Neither alone nor in a crowd, led or not; thousands of runs said the same."""
    for seed in range(3):
        sim = Simulation(
            shipped("tiny"), Scenario(people), robots_named(robots), NoFire(), seed
        )
        bound = best_reward_of(sim.world)
        assert sim.run().reward <= bound


@pytest.mark.paper("F8")
@pytest.mark.parametrize(("name", "people"), [("tiny", 20), ("paper", 6), ("tower", 4)])
def test_not_even_who_knows_the_map_does_better(name, people):
    """And they come within a twentieth of the bound."""
    for seed in range(3):
        sim = Knowing(shipped(name), Scenario(people), seed=seed)
        bound = best_reward_of(sim.world)
        assert 0.95 * bound < sim.run().reward <= bound


@pytest.mark.paper("F8")
@pytest.mark.parametrize("seed", range(2))
def test_fire_helps_nobody_beyond_the_bound(seed):
    """It burns doors, blocks ways and costs health."""
    sim = Simulation(shipped("tiny"), Scenario(8), Sweep(), GreedyFire(), seed)
    bound = best_reward_of(sim.world)
    assert sim.run().reward <= bound


def test_the_bound_lies_near_what_the_mean_ways_say():
    """Two ways to the same number, within two in a hundred."""
    building = shipped("paper")
    placed = best_reward_of(
        Simulation(building, robots=NoRobots(), fire=RandomFire()).world
    )
    carried = best_reward_carried(losses(building), (14, 13, 13))
    assert placed == pytest.approx(carried, rel=0.02)


def test_refuses_a_world_that_has_gone_on():
    """What was earned by then, it does not know."""
    sim = stage(CORRIDOR)
    sim.step()
    with pytest.raises(ValueError, match=r"at 0\.2 s: a bound is known at 0 s only"):
        best_reward_of(sim.world)
