"""Re-scoring: the same moments, and fresh futures for all."""

import pickle

import numpy as np
import pytest
from movies import shipped

from reference.building import plan_of
from reference.paper import Scenario
from reference.workshop.evaluation.contestants import Evacuation, contestant
from reference.workshop.evaluation.gap import (
    LATEST,
    Comparison,
    Result,
    comparisons,
    gap,
    moment_of,
    optimism,
    placement_of,
    rescore,
)

PLAN = plan_of(shipped("tiny"))
SCENARIO = Scenario(people=20, time_limit=70.0, sources=2)


def compared(*fires, robots="none", before=1, futures=2):
    """About one moment in the tiny building."""
    evacuation = Evacuation(PLAN, SCENARIO, robots, "random", seed=3)
    return Comparison(evacuation, fires, before, futures)


@pytest.fixture(scope="module")
def found():
    """What became of one moment at which three fires were asked."""
    return rescore(compared("none", "greedy", "worst-case"))


def made(unlit=(10.0, 20.0), foreseen=None, **rewards):
    """A result of which only the rewards matter."""
    rewards = {word.replace("_", "-"): values for word, values in rewards.items()}
    return Result(compared(*rewards), rewards | {"none": unlit}, foreseen)


# -- One moment ---------------------------------------------------------------------


@pytest.mark.paper("F4", "chosen")
def test_every_fire_is_asked_at_the_same_moment():
    """When it is its turn after one random fire: at 35 s; each breaks out then."""
    now = moment_of(compared("random"))
    assert now.world.time == pytest.approx(35)
    assert len(now.world.flames.sources) == 1
    assert placement_of(contestant("none", "fire"), now) is None
    places = {placement_of(contestant("greedy", "fire"), now) for _ in range(2)}
    assert len(places) == 1 and None not in places


@pytest.mark.paper("F4", "chosen")
def test_a_fire_that_does_not_break_out_does_no_harm(found):
    """It is re-scored in the same futures as no fire at all."""
    assert {len(rewards) for rewards in found.rewards.values()} == {2}
    without = rescore(compared("greedy"))
    assert found.rewards["none"] == without.rewards["none"] != found.rewards["greedy"]
    assert gap([found], "none", "greedy").mean != 0


@pytest.mark.paper("F4", "chosen")
def test_the_same_placement_has_the_same_rewards(found):
    """Futures belong to the moment and not to who asks."""
    assert rescore(compared("greedy")).rewards["greedy"] == found.rewards["greedy"]


@pytest.mark.paper("F4", "chosen")
def test_futures_differ(found):
    """Flames spread otherwise in each."""
    assert len(set(found.rewards["greedy"])) == 2


@pytest.mark.paper("F4", "Eq. 5")
def test_what_looking_ahead_foresaw_is_kept(found):
    """To be compared with what then came; other fires foresee nothing."""
    assert isinstance(found.foreseen, float)
    assert rescore(compared("none", futures=1)).foreseen is None


def test_an_evacuation_that_is_over_has_no_such_moment():
    """Three fires more than there are sources never break out."""
    assert rescore(compared("greedy", before=5)) is None


def test_moments_take_turns_over_evacuations():
    """One of each, after 0, 1, 2, 3, 0, ... fires."""
    found = list(comparisons(PLAN, Scenario(), "sweep", ["random"], range(6)))
    assert [q.before for q in found] == [0, 1, 2, 3, 0, 1] and LATEST == 4
    assert [q.evacuation.seed for q in found] == list(range(6))


def test_any_executor_can_do_it():
    """Jobs and results are plain data, and functions stand at the top of a module."""
    work = compared("none", robots="none", before=0, futures=1)
    assert pickle.loads(pickle.dumps((rescore, work))) == (rescore, work)
    found = rescore(work)
    assert pickle.loads(pickle.dumps(found)) == found


def test_refuses_a_fire_that_nobody_knows():
    """As the command line does."""
    with pytest.raises(ValueError, match="names nobody who plays the fire"):
        rescore(compared("gredy", before=0))


# -- Many moments -------------------------------------------------------------------


def test_figures_are_means_over_futures_then_over_moments():
    """By hand: two moments of two futures."""
    results = [
        made(unlit=(10, 20), greedy=(1, 3), random=(10, 14)),
        made(unlit=(30, 30), greedy=(6, 8), random=(20, 20)),
    ]
    assert gap(results, "random", "greedy").mean == pytest.approx((10 + 13) / 2)
    assert gap(results, "none", "greedy").mean == pytest.approx((13 + 23) / 2)


@pytest.mark.paper("F4", "chosen")
def test_the_least_of_noisy_values_is_too_low():
    """Twenty placements of equal worth: who takes the least expects too little."""
    rng = np.random.default_rng(0)
    results = [
        made(
            worst_case=tuple(rng.normal(0, 100, 8)),
            foreseen=min(rng.normal(0, 100, 20)),
        )
        for _ in range(30)
    ]
    assert optimism(results).low > 100
    nowhere = made(worst_case=(1.0, 2.0), foreseen=None)
    assert optimism([*results, nowhere]) == optimism(results)
    assert optimism([nowhere]) is None


NARROW = """building: Narrow
size:     8 x 4

floor 1: ground
########
E...#AA#
E...+AA#
########

floor 2: up
########
#...#AA#
#...+AA#
########
"""


def test_where_no_fire_can_break_out_none_is_foreseen():
    """Everywhere is too near to a door; the moment counts all the same."""
    scenario = Scenario(people=12, sources=2)
    (one,) = comparisons(NARROW, scenario, "none", ("worst-case",), [1])
    found = rescore(one)
    assert found.foreseen is None
    assert found.rewards["worst-case"] == found.rewards["none"]


def test_refuses_to_sum_up_nothing():
    """No moment, no figure."""
    with pytest.raises(ValueError, match="at least one value"):
        gap([], "none", "greedy")
