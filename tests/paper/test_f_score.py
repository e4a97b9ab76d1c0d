"""The ruler: what the paper prints of it, how it is calibrated, what it refuses."""

from itertools import cycle
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from reference.evaluation import score
from reference.evaluation.score import (
    RulerError,
    base_and_control,
    calibrate,
    paper_ruler,
)
from reference.paper import BEST_POINT, BETA, PEOPLE, WORST_POINT, K
from reference.workshop.comparing.results import ruler_of
from reference.workshop.drawing.ruler import difficulty_at

POINTS = (WORST_POINT, BEST_POINT)
EASY = (14_000.0, 2418.0)
HARD = (10_000.0, 3559.0)
"""Two cases on the paper's line E = 1 [F10]."""

REWARDS = st.floats(-1e9, paper_ruler().reward_at(score.LARGEST_Y) - 1)
DIFFICULTIES = st.floats(0, 4000)


def baseline(runs, seed=0):
    """Rewards and difficulties as `sweep` had them on the paper's building: a third of
    the runs without fire, a third against random, a third against greedy fires."""
    rng = np.random.default_rng(seed)
    fires = np.array(
        [(8950, 425, 0, 0), (6080, 2820, 1160, 320), (1880, 2310, 1520, 300)]
    )
    R, of_R, h, of_h = fires[np.arange(runs) % 3].T
    return rng.normal(R, of_R), np.abs(rng.normal(h, of_h))


def ruler(rewards, difficulties, points=POINTS, fires=("any",)):
    """The ruler of runs that met these fires in turn."""
    runs = [
        SimpleNamespace(robots="sweep", fire=fire, reward=reward, difficulty=h)
        for reward, h, fire in zip(rewards, difficulties, cycle(fires))
    ]
    return ruler_of(runs, "sweep", *points)


# -- What the paper prints ----------------------------------------------------------


@pytest.mark.paper("F2", "Eq. 4")
def test_b_and_c_follow_from_the_two_critical_points():
    """b = 1.4251 and c = 1/7.017, to the digits that are printed."""
    b, c = base_and_control(*POINTS)
    assert b == pytest.approx(10 ** (4 / 26), rel=1e-12)
    assert (f"{b:.4f}", f"{1 / c:.3f}") == ("1.4251", "7.017")


@pytest.mark.paper("F1", "Eq. 4")
@pytest.mark.parametrize(("reward", "y"), POINTS)
def test_equation_4_passes_through_both_critical_points(reward, y):
    """y(-12000) = 0.1 and y(14000) = 1000."""
    assert paper_ruler().reward_part(reward) == pytest.approx(y)
    assert paper_ruler().reward_at(y) == pytest.approx(reward)


@pytest.mark.paper("F3", "Eq. 4")
@pytest.mark.parametrize(
    ("reward", "slope", "printed"),
    [(-12000, 3.54e-5, 0.00004), (14000, 0.354, 0.4), (15000, 0.505, 0.5)],
)
def test_the_slopes_of_equation_4_are_those_of_the_text(reward, slope, printed):
    """Exact to three digits, and to the one digit that is printed."""
    assert paper_ruler().slope(reward) == pytest.approx(slope, rel=2e-3)
    assert float(f"{paper_ruler().slope(reward):.0e}") == printed


@pytest.mark.paper("F9", "Eq. 8")
def test_e_is_one_where_e_prime_is_1649_7():
    """Reward 10000 and difficulty 3558.83 are such a case: y = 242.4, the rest is h."""
    y = paper_ruler().reward_part(10_000)
    of_h = paper_ruler().difficulty_part(3558.83)
    assert (y, of_h) == pytest.approx((242.4, 1407.3), abs=0.1)
    assert y + of_h == pytest.approx(1649.7, abs=0.01)
    assert paper_ruler().score(10_000, 3558.83) == pytest.approx(1, abs=1e-5)


@pytest.mark.paper("F10")
@pytest.mark.parametrize(
    ("reward", "difficulty"), [(0, 3845), (10000, 3559), (14000, 2418), (15000, 1422)]
)
def test_the_baselines_score_is_one_along_this_difficulty(reward, difficulty):
    """h = √((β - y(R)) k) α, on a scale of 0 to about 4000."""
    assert difficulty_at(paper_ruler(), reward) == pytest.approx(difficulty, abs=0.5)
    h = difficulty_at(paper_ruler(), reward)
    assert paper_ruler().score(reward, h) == pytest.approx(1)


@pytest.mark.paper("F10")
def test_without_fire_even_the_best_reward_scores_below_one():
    """E = 1 would take 15413 health points, more than R_b."""
    assert paper_ruler().reward_at(BETA) == pytest.approx(15_413, abs=1)
    assert paper_ruler().score(15_000, 0) == pytest.approx(0.863, abs=1e-3)


# -- Calibration --------------------------------------------------------------------


@pytest.mark.paper("F9", "F12")
def test_the_procedure_reproduces_the_papers_constants():
    """Two critical points, two equal cases, in any order, and a baseline of E = 1."""
    ruler = calibrate(*POINTS, (EASY, HARD), [HARD])
    assert ruler == calibrate(*POINTS, (HARD, EASY), [HARD])
    assert ruler.k == pytest.approx(K, rel=1e-3)
    assert ruler.beta == pytest.approx(BETA, rel=1e-3)
    assert (ruler.base, ruler.control) == (paper_ruler().base, paper_ruler().control)
    assert ruler.score(*EASY) == pytest.approx(ruler.score(*HARD))


@pytest.mark.paper("F12")
@pytest.mark.parametrize("equal", [((50, 10), (20, 5)), ((50, 10), (50, 20))])
def test_refuses_equal_cases_of_which_the_poorer_had_no_harder_fire(equal):
    """Its ruler would reward easy fires."""
    with pytest.raises(RulerError, match="less reward had harder fires"):
        calibrate(*POINTS, equal, [HARD])


@pytest.mark.paper("F12")
def test_all_cases_of_a_baseline_score_one_on_average():
    """Not the first of them alone."""
    cases = [HARD, (0.0, 1000.0), (12_000.0, 0.0)]
    ruler = calibrate(*POINTS, (EASY, HARD), cases)
    assert np.mean([ruler.score(*case) for case in cases]) == pytest.approx(1)


@pytest.mark.paper("F12")
def test_runs_of_a_baseline_make_a_ruler():
    """Their easiest and hardest third score alike, all of them together 1."""
    rewards, difficulties = baseline(90)
    made = ruler(rewards, difficulties)
    order = np.argsort(difficulties)

    def scored(part):
        return made.score(rewards[part].mean(), difficulties[part].mean())

    assert scored(order[:30]) == pytest.approx(scored(order[-30:]))
    assert made.score(rewards.mean(), difficulties.mean()) == pytest.approx(1)


@pytest.mark.paper("F12")
def test_a_baseline_that_met_several_fires_scores_one_on_their_mean():
    """Each fire by itself lies about there; by one mean of all, all would lie above."""
    rewards, difficulties = baseline(90)
    by_fire = ruler(rewards, difficulties, fires=("none", "random", "greedy"))
    at_once = ruler(rewards, difficulties)
    cells = [(rewards[k::3].mean(), difficulties[k::3].mean()) for k in range(3)]
    scores = [by_fire.score(*cell) for cell in cells]
    assert np.mean(scores) == pytest.approx(1)
    assert min(scores) > 0.8 and max(scores) < 1.2
    assert min(at_once.score(*cell) for cell in cells) > 1.3


@pytest.mark.paper("F12")
def test_a_ruler_may_be_made_for_another_number_of_people():
    """A tenth of the people have a tenth of the rewards, and the same scores."""
    rewards, difficulties = baseline(60)
    points = [(reward / 10, y) for reward, y in POINTS]
    few = ruler(rewards / 10, difficulties, points)
    many = ruler(rewards, difficulties)
    assert few.score(900.0, 1000.0) == pytest.approx(many.score(9000.0, 1000.0))


# -- E of runs ----------------------------------------------------------------------


@given(REWARDS, REWARDS, DIFFICULTIES, DIFFICULTIES)
def test_more_reward_and_more_difficulty_never_score_less(R_1, R_2, h_1, h_2):
    """And no reading of the ruler is negative, nan or inf."""
    least = paper_ruler().score(min(R_1, R_2), min(h_1, h_2))
    most = paper_ruler().score(max(R_1, R_2), max(h_1, h_2))
    assert 0 <= least <= most < np.inf


# -- Limits -------------------------------------------------------------------------


@pytest.mark.paper("F2")
@pytest.mark.parametrize("best", POINTS)
def test_refuses_a_best_reward_that_is_no_more_than_the_worst(best):
    """Less, or the same: no b and c pass through both points."""
    with pytest.raises(RulerError, match="best reward is the worst"):
        base_and_control(BEST_POINT, best)


@pytest.mark.paper("F1", "chosen")
@pytest.mark.parametrize("reward", [73_000, 1e308, float("inf")])
def test_refuses_rewards_that_lie_off_the_ruler(reward):
    """Forty people earn 16000 at most; who has more of them calibrates anew."""
    assert paper_ruler().score(PEOPLE * 400.0, 4000.0) == pytest.approx(2.31, abs=0.01)
    with pytest.raises(RulerError, match="reads at most 72500: calibrate"):
        paper_ruler().score(np.array([0.0, reward]), 0.0)


@pytest.mark.paper("F12")
@pytest.mark.parametrize(
    ("rewards", "difficulties", "why"),
    [
        ([], [], "a ruler takes at least 6 runs: 0 here"),
        ([1.0] * 5, [1.0] * 5, "a ruler takes at least 6 runs: 5 here"),
        ([*range(6)], [1000] * 6, "run more seeds, or weak and strong fires"),
        ([*range(6)], [*range(6)], "run more seeds, or weak and strong fires"),
        ([0, 9000] * 4 + [0, 8000] * 2, [*range(12)], "give or take 3476: run more"),
    ],
    ids=["none", "too few", "fires alike", "more in hard fires", "hardly less"],
)
def test_refuses_runs_that_make_no_ruler(rewards, difficulties, why):
    """k is inverse to what the baseline earned less, and would be anything."""
    with pytest.raises(RulerError, match=why):
        ruler(rewards, difficulties)
