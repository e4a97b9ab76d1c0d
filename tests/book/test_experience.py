"""Trajectories are cut into segments, fill a buffer, and come out as minibatches."""

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st
from lives import life

from reference.learning.experience import decisions_of, minibatches, segments


@pytest.mark.paper("E3")
def test_a_step_is_one_agent_s_decision():
    """Three of one and one of the other are four, whoever is cut off at the end."""
    assert life("###", "#..").steps == 4
    assert life("##>", "##>").steps == 4
    assert len(life("###", "#..")) == 3


@pytest.mark.paper("C8")
def test_a_trajectory_ends_with_its_agent_and_with_the_horizon():
    """Five and three decisions, cut after every two."""
    cuts = list(segments(life("#####", "###..", "#####").alive, horizon=2))
    assert cuts == [(0, 2, [0, 1, 2]), (2, 3, [1]), (2, 4, [0, 2]), (4, 5, [0, 2])]


@pytest.mark.paper("E3")
@given(st.lists(st.integers(0, 9), min_size=1, max_size=4), st.integers(1, 10))
def test_segments_hold_every_decision_of_every_agent_once(lengths, horizon):
    """Agent by agent: 0, h, 2h, ... and what is left."""
    found = list(segments(life(*("#" * n for n in lengths)).alive, horizon))
    for agent, length in enumerate(lengths):
        parts = [(first, last) for first, last, agents in found if agent in agents]
        starts = range(0, length, horizon)
        assert parts == [(k, min(k + horizon, length)) for k in starts]


# -- Minibatches --------------------------------------------------------------------


def drawn(decisions, batch_size, seed=0):
    """The minibatches, as lists of the rewards that mark their rows."""
    rng = torch.Generator().manual_seed(seed)
    return list(minibatches(decisions, batch_size, rng))


def numbered(*agents):
    """Decisions whose advantages say which row they were."""
    decisions = decisions_of(life(*agents))
    rows = torch.arange(len(decisions))[:, None].expand_as(decisions.alive)
    decisions.advantages = rows.clone().float()
    return decisions


@pytest.mark.paper("E3")
@given(st.integers(1, 40), st.integers(1, 4), st.integers(1, 40), st.integers(0, 9))
def test_there_are_as_many_minibatches_as_whole_batches_of_steps(T, G, size, seed):
    """Each of a size, no decision in two of them, however the group shrinks."""
    lengths = np.random.default_rng(seed).integers(1, T + 1, G)
    lengths[0] = T
    decisions = numbered(*("#" * n for n in lengths))
    batches = drawn(decisions, size, seed)
    each = max(1, T * size // sum(lengths))
    assert len(batches) == min(sum(lengths) // size, T)
    assert all(len(b) == each and b.alive.any() for b in batches)
    rows = [row for b in batches for row in b.advantages[:, 0].tolist()]
    assert len(rows) == len(set(rows))


@pytest.mark.paper("E3", "deviation")
def test_a_batch_smaller_than_the_group_is_one_decision_of_it():
    """Nothing would be the mean of no rows, which is no number."""
    assert [len(b) for b in drawn(numbered("##", "##", "##"), 2)] == [1, 1]


@pytest.mark.paper("E3")
def test_a_minibatch_s_rows_stay_together():
    """All tensors are shuffled alike."""
    decisions = numbered("######", "####..")
    decisions.values, decisions.baselines, decisions.returns = torch.randn(3, 6, 2)
    (batch, _) = drawn(decisions, 4)
    rows = decisions.rows(batch.advantages[:, 0].long())
    for name, column in vars(rows).items():
        assert torch.equal(getattr(batch, name), column.float()), name


@pytest.mark.paper("E3")
def test_each_epoch_shuffles_anew():
    """The same eight rows twice, in two orders."""
    decisions = numbered("#" * 8)
    rng = torch.Generator().manual_seed(0)
    first, second = (
        torch.cat([b.advantages[:, 0] for b in minibatches(decisions, 4, rng)]).tolist()
        for _ in range(2)
    )
    assert sorted(first) == sorted(second) == list(range(8))
    assert first != second
