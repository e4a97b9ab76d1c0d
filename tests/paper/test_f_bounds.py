"""The bounds: by hand on small boards, and as printed on the paper's building."""

import numpy as np
import pytest
from movies import built, shipped

from reference import paper
from reference.evaluation.bounds import (
    best_reward,
    best_reward_carried,
    critical_points,
    health_losses,
    mean_ways,
    worst_reward,
)
from reference.evaluation.score import base_and_control, paper_ruler
from reference.paper import Scenario

THIRD = (0, 0, paper.PEOPLE)
"""Everybody starts on the third floor."""

# -- Equations 6 and 7 --------------------------------------------------------------


@pytest.mark.paper("F4", "Eq. 6")
@pytest.mark.paper("F5", "B8")
def test_the_worst_reward_is_everybodys_death():
    """-12000 for forty, and Critical Point 1 lies there."""
    assert worst_reward(paper.PEOPLE) == -12000 == paper.WORST_POINT[0]


@pytest.mark.paper("F6")
@pytest.mark.parametrize(("row", "metres"), [("E.......#", 4.0), ("E....E", 1.5)])
def test_the_mean_way_is_taken_over_all_cells_of_a_floors_rooms(row, metres):
    """1 to 7 metres before one exit; 1, 2, 2, 1 between two: Min in Eq. 7."""
    assert mean_ways(built(row)) == (metres,)


@pytest.mark.paper("F6", "Eq. 7")
@pytest.mark.paper("F8")
def test_the_best_reward_of_the_papers_building_is_the_papers():
    """Ways of 23, 22 and 19 m at 1.34 m/s make 15000 within two in a hundred."""
    building = shipped("paper")
    assert mean_ways(building) == pytest.approx((23.4, 21.7, 19.0), abs=0.1)
    assert best_reward(building, paper.PEOPLE) == pytest.approx(15_000, rel=0.02)


@pytest.mark.paper("F7", "Eq. 7")
@pytest.mark.paper("F6")
def test_half_a_point_of_health_is_lost_in_a_second_of_the_way():
    """Four metres on average, at 1.34 m/s: 3 seconds, 1.5 points."""
    assert health_losses(built("E.......#")) == pytest.approx((1.5,), abs=0.05)
    lower_and_upper = built("#AA+....E\n\n#AA+........#")  # 2.5 and 4.5 m
    assert health_losses(lower_and_upper) == pytest.approx((0.93, 1.68), abs=0.01)


@pytest.mark.paper("F7", "Eq. 7")
@pytest.mark.paper("F8")
@pytest.mark.parametrize(
    ("frames", "divided", "fixed_reward", "best"),
    [
        (50, False, 100, 15_050),  # what we read
        (50, True, 100, 12_200),  # framesp × rate as a denominator
        (1 / 50, True, 100, -9_480_000),  # framesp as seconds a frame
        (50, True, 175, 15_200),  # literal again, another FixReward
    ],
)
def test_the_readings_of_equation_7(frames, divided, fixed_reward, best):
    """As printed it gives 15000 only with a FixReward of 175, of which nothing is said;
    health lost is seconds × frames a second × rate."""
    seconds = np.array(mean_ways(shipped("paper"))) / paper.WALKING_SPEED
    rate = frames * paper.HEALTH_RATE
    loss = seconds / rate if divided else seconds * rate
    R_b = paper.PEOPLE * ((paper.HEALTH - loss).sum() + fixed_reward)
    assert R_b == pytest.approx(best, rel=0.01)
    ours = best_reward(shipped("paper"), paper.PEOPLE)
    assert (abs(R_b - ours) < 1) == (best == 15_050)


# -- Health carried over ------------------------------------------------------------


@pytest.mark.paper("F8")
@pytest.mark.parametrize(
    ("losses", "starters", "best"),
    [
        ([25 / 3] * 3, THIRD, 14_000),
        ([25 / 3] * 3, (14, 13, 13), 10_808),
        ([10, 20, 30], (0, 0, 1), 70 + 50 + 40 + paper.FIXED_REWARD),
        ([60, 60, 60], (0, 0, 1), 40 - paper.FIXED_PENALTY),
        ([np.inf], (1,), -paper.FIXED_PENALTY),
    ],
    ids=["from the third", "spread", "own floor first", "dies below", "no way out"],
)
def test_what_is_lost_on_one_floor_is_missing_on_the_next(losses, starters, best):
    """40 (3·100 - 6·8.33 + 100) = 14000, when all start on the third floor."""
    assert best_reward_carried(losses, starters) == pytest.approx(best, abs=1)


@pytest.mark.paper("F12")
def test_the_papers_points_are_those_of_everybody_on_its_third_floor():
    """-12000 and 14000, rounded as the paper rounds: b and c are the printed ones."""
    points = critical_points(shipped("paper"), Scenario(people_per_floor=THIRD))
    assert points == (paper.WORST_POINT, paper.BEST_POINT)
    assert base_and_control(*points) == (paper_ruler().base, paper_ruler().control)


@pytest.mark.paper("F12")
@pytest.mark.paper("F4", "Eq. 6")
@pytest.mark.paper("F5")
def test_critical_point_2_is_the_best_reward_of_a_scenario():
    """Spread over three floors people earn less; twice as many, twice as much."""
    building = shipped("paper")
    assert critical_points(building, Scenario()) == ((-12_000, 0.1), (11_000, 1000))
    many = critical_points(building, Scenario(people=80))
    assert many == ((-24_000, 0.1), (22_000, 1000))
