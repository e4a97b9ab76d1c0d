"""Re-scoring: the same moments, fresh futures for all, and what looking ahead costs."""

import pickle
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from movies import shipped

from reference.building import plan_of
from reference.paper import Scenario
from reference.workshop.evaluation.gap import (
    LATEST,
    Answer,
    Attempt,
    Cost,
    Question,
    answer,
    cost,
    gap,
    harm,
    optimism,
    questions,
    rescored,
)
from reference.workshop.workers import in_order

PLAN = plan_of(shipped("tiny"))
SCENARIO = Scenario(people=12, time_limit=90.0)


def asked(*fires, seed=3, before=1, futures=3, **scenario):
    """What became of one moment in the tiny building."""
    scene = Scenario(people=12, time_limit=90.0, **scenario)
    return answer(Question(PLAN, scene, "sweep", fires, seed, before, futures))


def made(unlit=(10.0, 20.0), foreseen=None, **rewards):
    """An answer of which only the rewards matter."""
    question = Question(PLAN, SCENARIO, "sweep", tuple(rewards), 0, 0, len(unlit))
    rewards = {word.replace("_", "-"): values for word, values in rewards.items()}
    return Answer(question, 10.0, dict.fromkeys(rewards), rewards, unlit, foreseen)


# -- One moment ---------------------------------------------------------------------


@pytest.mark.paper("F4", "chosen")
def test_every_fire_is_asked_at_the_same_moment():
    """When it is its turn after one random fire: at 25 s."""
    found = asked("random", "greedy", "none")
    assert found.time == pytest.approx(25)
    assert set(found.placements) == {"random", "greedy", "none"}
    assert found.placements["none"] is None
    assert {len(found.rewards[fire]) for fire in found.rewards} == {3}


@pytest.mark.paper("F4", "chosen")
def test_a_fire_that_does_not_break_out_does_no_harm():
    """It is re-scored in the same futures as no fire at all."""
    found = asked("none", "greedy")
    assert found.rewards["none"] == found.unlit
    assert harm([found], "none") == (0, 0, 0)
    assert found.rewards["greedy"] != found.unlit


@pytest.mark.paper("F4", "chosen")
def test_the_same_placement_has_the_same_rewards():
    """Futures belong to the moment and not to who asks."""
    one, other = asked("greedy", "random"), asked("greedy")
    assert one.placements["greedy"] == other.placements["greedy"]
    assert one.rewards["greedy"] == other.rewards["greedy"]


@pytest.mark.paper("F4", "chosen")
def test_futures_differ():
    """Flames spread otherwise in each."""
    assert len(set(asked("greedy", futures=4, seed=4).rewards["greedy"])) > 1


@pytest.mark.paper("F4", "Eq. 5")
def test_what_looking_ahead_foresaw_is_kept():
    """To be compared with what then came; other fires foresee nothing."""
    assert asked("worst-case", futures=1).foreseen is not None
    assert asked("greedy", futures=1).foreseen is None


def test_an_evacuation_that_is_over_has_no_such_moment():
    """Three fires more than there are sources never break out."""
    assert asked("greedy", before=5, sources=2) is None


def test_moments_take_turns_over_evacuations():
    """One of each, after 0, 1, 2, 3, 0, ... fires."""
    found = list(questions(PLAN, SCENARIO, "sweep", ["random"], range(6)))
    assert [q.before for q in found] == [0, 1, 2, 3, 0, 1] and LATEST == 4
    assert [q.seed for q in found] == list(range(6))


@pytest.mark.parametrize("job", [answer, cost])
def test_any_executor_can_do_it(job):
    """Jobs and results are plain data, and functions stand at the top of a module."""
    question = Question(PLAN, SCENARIO, "none", ("random",), 0, 0, futures=1)
    work = question if job is answer else Attempt(PLAN, SCENARIO, "none", 0, 0)
    assert pickle.loads(pickle.dumps((job, work))) == (job, work)
    with ThreadPoolExecutor(1) as executor:
        (found,) = in_order(executor, job, [work], lambda: False)
    assert type(pickle.loads(pickle.dumps(found))) is type(found)


def test_refuses_a_fire_that_nobody_knows():
    """As the command line does."""
    with pytest.raises(ValueError, match="names nobody who plays the fire"):
        asked("gredy")


# -- Many moments -------------------------------------------------------------------


def test_figures_are_means_over_futures_then_over_moments():
    """By hand: two moments of two futures."""
    answers = [
        made(unlit=(10, 20), greedy=(1, 3), random=(10, 14)),
        made(unlit=(30, 30), greedy=(6, 8), random=(20, 20)),
    ]
    assert rescored(answers, "greedy").mean == pytest.approx((2 + 7) / 2)
    assert gap(answers, "random", "greedy").mean == pytest.approx((10 + 13) / 2)
    assert harm(answers, "greedy").mean == pytest.approx((13 + 23) / 2)


@pytest.mark.paper("F4", "chosen")
def test_the_least_of_noisy_values_is_too_low():
    """Twenty placements of equal worth: who takes the least expects too little."""
    rng = np.random.default_rng(0)
    answers = [
        made(
            worst_case=tuple(rng.normal(0, 100, 8)),
            foreseen=min(rng.normal(0, 100, 20)),
        )
        for _ in range(30)
    ]
    assert optimism(answers).low > 100


def test_refuses_to_sum_up_nothing():
    """No moment, no figure."""
    with pytest.raises(ValueError, match="at least one value"):
        rescored([], "greedy")


# -- Cost ---------------------------------------------------------------------------


@pytest.mark.paper("F4", "linear complexity")
def test_a_fire_without_sources_looks_nowhere():
    """Decisions and simulated seconds are counted, and begin at nothing."""
    nothing = cost(Attempt(PLAN, SCENARIO, "none", 0, sources=0))
    once = cost(Attempt(PLAN, SCENARIO, "none", 0, sources=1))
    assert isinstance(nothing, Cost)
    assert (nothing.decisions, nothing.simulated_seconds) == (0, 0)
    assert once.decisions == 1 and once.simulated_seconds > 0
    assert once.process_seconds > 0
