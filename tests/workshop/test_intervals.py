"""Bootstrap intervals: what they hold, how often, and what they refuse."""

import tracemalloc
from functools import partial

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from reference.evaluation.score import paper_ruler
from reference.workshop.comparing.intervals import (
    RESAMPLES,
    interval_of_mean,
    interval_of_means,
    interval_over_trainings,
    intervals_of_columns,
)

NUMBERS = st.floats(-1e6, 1e6)


def share_that_hold(truth, of, values, experiments=200):
    """Share of experiments whose interval holds the truth; values: rng -> values."""
    found = [of(values(np.random.default_rng(seed))) for seed in range(experiments)]
    return np.mean([low <= truth <= high for _, low, high in found])


# -- What they hold -----------------------------------------------------------------


@pytest.mark.parametrize(
    ("truth", "values"),
    [
        (7000, lambda rng: rng.normal(7000, 3000, 30)),
        (0.9, lambda rng: rng.beta(9, 1, 100)),
    ],
)
def test_nineteen_of_twenty_intervals_hold_the_true_mean(truth, values):
    """Of rewards around 7000, and of shares near 1, which no bell describes."""
    assert 0.90 <= share_that_hold(truth, interval_of_mean, values) <= 0.98


@pytest.mark.paper("F12")
def test_the_interval_of_a_score_is_that_of_its_runs_together():
    """Where difficult fires cost reward, their parts of E move against each other."""
    rng = np.random.default_rng(0)
    h = rng.uniform(1000, 3500, 200)
    together = np.stack([15000 - 2 * h, h], axis=1)
    apart = np.stack([rng.permutation(15000 - 2 * h), h], axis=1)
    one, other = (
        interval_of_means(paper_ruler().score, rows) for rows in (together, apart)
    )
    assert one.mean == pytest.approx(paper_ruler().score(*together.mean(axis=0)))
    assert one.mean == pytest.approx(other.mean)
    assert one.high - one.low < other.high - other.low


@given(values=st.lists(NUMBERS, min_size=1, max_size=8))
def test_an_interval_is_made_of_numbers_and_lies_within_the_values(values):
    """Whatever they are."""
    mean, low, high = interval_of_mean(values)
    assert min(values) - 1e-6 <= low <= high <= max(values) + 1e-6
    assert mean == pytest.approx(np.mean(values), abs=1e-6)


@given(value=NUMBERS, runs=st.integers(1, 9))
def test_equal_values_make_an_interval_without_width(value, runs):
    """To the last bit; so does a single one, which tells nothing of scatter."""
    assert interval_of_mean([value] * runs) == (value, value, value)


def test_samples_are_drawn_at_once_or_not_and_are_the_same():
    """By the formula written out."""
    rows = np.random.default_rng(5).normal(3, 2, (37, 2))
    drawn = np.random.default_rng(0).integers(37, size=(RESAMPLES, 37))
    means = rows[drawn].mean(axis=1)
    found = intervals_of_columns(rows)
    wanted = [rows.mean(axis=0), *np.quantile(means, [0.025, 0.975], axis=0)]
    np.testing.assert_allclose(found, wanted, rtol=1e-12)


def test_many_runs_take_little_memory():
    """Of 5,000 all samples at once had taken 300 MB."""
    tracemalloc.start()
    try:
        interval_of_mean(np.arange(5000.0))
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert peak < 2e7


# -- Training runs ------------------------------------------------------------------


def trainings(rng, number=10, mean=0.5):
    """(number, 30) trainings that differ, on seeds that they share."""
    seeds = rng.normal(0, 0.2, 30)
    luck = rng.normal(0, 0.05, (number, 30))
    return mean + rng.normal(0, 0.1, (number, 1)) + seeds + luck


@pytest.mark.paper("F12")
def test_ten_trainings_hold_the_truth_where_their_episodes_alone_do_not():
    """The unit is the training run; three are too few, as the docstring says."""
    share = partial(share_that_hold, 0.5, experiments=100)
    assert share(lambda values: interval_of_mean(values.ravel()), trainings) < 0.7
    assert share(interval_over_trainings, trainings) > 0.88
    assert share(interval_over_trainings, partial(trainings, number=3)) < 0.9


def test_the_mean_over_trainings_is_that_of_the_middle_half():
    """The interquartile one: of five the middle three, of three all."""
    five = np.array([[0.0], [1.0], [2.0], [3.0], [100.0]])
    assert interval_over_trainings(five).mean == 2
    assert interval_over_trainings(five[2:]).mean == 35


def test_the_difference_of_two_arms_does_not_suffer_from_seeds_they_share():
    """Hard seeds are hard for both; the truth is held, and told more narrowly."""

    def both(rng):
        seeds = rng.normal(0, 0.5, 30)
        return [seeds + m + rng.normal(0, 0.02, (10, 30)) for m in (0.6, 0.5)]

    share = share_that_hold(0.1, lambda pair: interval_over_trainings(*pair), both, 100)
    assert share > 0.88
    one, other = both(np.random.default_rng(0))
    apart = interval_over_trainings(one)
    together = interval_over_trainings(one, other)
    assert together.high - together.low < 0.1 * (apart.high - apart.low)


# -- Refusals -----------------------------------------------------------------------


@pytest.mark.parametrize("of", [interval_of_mean, intervals_of_columns])
def test_refuses_no_values(of):
    """There is no figure of nothing."""
    with pytest.raises(ValueError, match="at least one value"):
        of([])
