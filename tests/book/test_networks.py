"""The networks of both trainers, against a naive second computation of them."""

import math
from dataclasses import replace

import lives
import numpy as np
import oracle
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st
from lives import SIZES
from torch.nn.functional import leaky_relu

from reference.learning.networks import (
    ActionDistribution,
    Actor,
    Encoder,
    GaussianHead,
    GridEncoder,
    Normaliser,
)
from reference.learning.poca import GroupCritic
from reference.learning.ppo import Critic

CLOSE = {torch.float32: 1e-5, torch.float64: 1e-12}
WIDE = pytest.mark.parametrize("dtype", CLOSE, ids=str)
PAPER = replace(SIZES, vector=167, grid=(9, 40, 40))


def made(kind, sizes=SIZES, seed=0, **changes):
    """A network whose every number matters: biases and layers are far from zero."""
    torch.manual_seed(seed)
    network = kind(sizes, lives.settings(**changes))
    with torch.no_grad():
        for parameter in network.parameters():
            parameter.add_(0.3 * torch.randn_like(parameter))
        for module in network.modules():
            if isinstance(module, Normaliser):
                module.update(1 + 2 * torch.randn(50, sizes.vector))
    return network


# -- The normaliser -----------------------------------------------------------------


@pytest.mark.paper("E4")
def test_the_normaliser_begins_with_one_pseudo_sample_and_keeps_it():
    """1 and 3 after the pseudo-sample 0: n = 3, mean 4/3, S = 1 + 1·(−1/3) + 3·5/3.

    A number is cut off at five deviations.
    """
    normaliser = Normaliser(1)
    normaliser.update(torch.tensor([[1.0], [3.0]]))
    assert normaliser.count == 3
    assert normaliser.mean.item() == pytest.approx(4 / 3)
    assert normaliser.squares.item() == pytest.approx(17 / 3)
    z = (2 - 4 / 3) / math.sqrt(17 / 9)
    found = normaliser(torch.tensor([[2.0], [70.0], [-70.0]]))[:, 0]
    assert found.tolist() == pytest.approx([z, 5, -5])


@pytest.mark.paper("E4")
@given(st.lists(st.integers(1, 5), min_size=1, max_size=4), st.integers(0, 99))
def test_what_the_normaliser_knows_is_the_variance_of_all_rows(lengths, seed):
    """However they were cut into updates: those of all rows and one 0, S one more."""
    rows = np.random.default_rng(seed).normal(3, 2, (sum(lengths), 2))
    normaliser = Normaliser(2)
    for part in np.split(rows, np.cumsum(lengths)[:-1]):
        normaliser.update(torch.from_numpy(part))
    everything = np.vstack([np.zeros((1, 2)), rows])
    assert normaliser.mean.numpy() == pytest.approx(everything.mean(axis=0))
    squares = 1 + everything.var(axis=0) * len(everything)
    assert normaliser.squares.numpy() == pytest.approx(squares)


# -- The encoders -------------------------------------------------------------------


@pytest.mark.paper("C3")
def test_the_simple_encoder_makes_288_features_of_40_by_40():
    """9 x 40 x 40 → 16 x 9 x 9 → 32 x 3 x 3; a hundredth of what is below 0 passes."""
    encoder = GridEncoder((9, 40, 40), 16)
    grids = torch.rand(2, 9, 40, 40)
    x = leaky_relu(encoder.conv1(grids), 0.01)
    assert x.shape == (2, 16, 9, 9)
    x = leaky_relu(encoder.conv2(x), 0.01)
    assert x.shape == (2, 32, 3, 3)
    found = leaky_relu(encoder.dense(x.flatten(1)), 0.01)
    assert torch.allclose(encoder(grids), found, atol=1e-6)


@pytest.mark.paper("C3")
@pytest.mark.parametrize("alike", [(), (0, 1, 2), (0, 1, 2, 6, 7, 8), range(9)])
def test_channels_alike_in_a_batch_are_convolved_once_with_the_same_result(alike):
    """Batches of two buildings, of one, and of one in which nothing happens."""
    encoder = GridEncoder((9, 40, 40), 16).double()
    grids = torch.randint(0, 2, (4, 9, 40, 40), dtype=torch.uint8)
    grids[:, list(alike)] = grids[:1, list(alike)]
    weights = [encoder.conv1.weight, encoder.conv1.bias]
    x = leaky_relu(encoder.conv1(grids.double()), 0.01)
    x = leaky_relu(encoder.conv2(x), 0.01)
    expected = leaky_relu(encoder.dense(x.flatten(1)), 0.01)
    found = encoder(grids)
    assert found.shape == expected.shape
    assert torch.allclose(found, expected, atol=1e-12)
    gradients = [
        torch.autograd.grad(y.square().sum(), weights) for y in (found, expected)
    ]
    for one, other in zip(*gradients, strict=True):
        assert torch.allclose(one, other, atol=1e-12)


@pytest.mark.paper("C4", "E2")
@pytest.mark.parametrize("kind", [Actor, Critic])
def test_a_group_s_image_is_encoded_once_as_if_for_each_agent(kind):
    """Of policies the means; PPO's critic is told each agent's own observation."""
    network = made(kind).double()
    rows = lives.doubled(lives.batch(G=3))
    found = network(rows.vectors, rows.grids)
    alone = [network(rows.vectors[:, [k]], rows.grids) for k in range(3)]
    if kind is Actor:
        found = found.act()
        alone = [policy.act() for policy in alone]
    assert torch.allclose(found, torch.cat(alone, dim=1), atol=1e-12)
    assert found.std() > 0.01


@pytest.mark.paper("E4", "erratum")
@pytest.mark.parametrize("kind", [Actor, Critic])
def test_no_connection_skips_a_layer(kind):
    """Where one layer passes nothing on, nothing that is observed gets through."""
    network = made(kind, num_layers=3).double()
    rows = lives.doubled(lives.batch(G=3))
    network.body.layers[2].weight.data.zero_()
    found = network(rows.vectors, rows.grids)
    found = found.act() if kind is Actor else found[..., None]
    assert torch.allclose(found, found[0, 0].expand_as(found), atol=1e-12)


@pytest.mark.paper("E4")
def test_inputs_are_normalised_only_where_the_table_says_so():
    """Table I: true; Table II: false. The grid never is."""
    rows = lives.batch()
    as_it_is = made(Encoder, normalize=False)(rows.vectors, rows.grids)
    assert torch.equal(as_it_is[..., : SIZES.vector], rows.vectors)
    normalised = made(Encoder, normalize=True)(rows.vectors, rows.grids)
    assert not torch.allclose(normalised[..., : SIZES.vector], rows.vectors)
    assert torch.equal(normalised[..., SIZES.vector :], as_it_is[..., SIZES.vector :])


# -- How they begin -----------------------------------------------------------------

H = 256
TFIXUP = math.sqrt(0.125 / H)
GRID_BEGINS = {
    "encoder.grid.conv1": 1 / math.sqrt(3 * 9 * 8 * 8),
    "encoder.grid.conv2": 1 / math.sqrt(3 * 16 * 4 * 4),
    "encoder.grid.dense": 1.41 / math.sqrt(288),
}
BODY_BEGINS = {
    **{f"body.{layer}": deviation for layer, deviation in GRID_BEGINS.items()},
    "body.layers.0": 1 / math.sqrt(167 + H),
    "body.layers.2": 1 / math.sqrt(H),
    "body.layers.4": 1 / math.sqrt(H),
}
ACTOR_BEGINS = {
    **BODY_BEGINS,
    "head.mean": 0.2 / math.sqrt(H),
    "head.branches.0": 0.1 / math.sqrt(H),
}
VALUE_BEGINS = BODY_BEGINS | {"value": math.sqrt(2 / (H + 1))}
CRITIC_BEGINS = {
    **GRID_BEGINS,
    **dict.fromkeys(["g.0", "f.0"], TFIXUP),
    **{f"attention.{a}": TFIXUP for a in ("query", "key", "to_value", "out")},
    **{f"trunk.{k}": math.sqrt(0.125) / H for k in (0, 2, 4)},
    "value": math.sqrt(2 / (H + 2)),
}


@pytest.mark.paper("E3")
@pytest.mark.parametrize(
    ("kind", "begins"),
    [(Actor, ACTOR_BEGINS), (Critic, VALUE_BEGINS), (GroupCritic, CRITIC_BEGINS)],
)
def test_a_new_network_s_weights_have_the_spread_of_the_original(kind, begins):
    """Each layer's standard deviation, zero biases, log sigma 0.

    The critic is tiny, so that only Adam's rescaling lets it start.
    """
    torch.manual_seed(0)
    sizes = replace(PAPER, branches=(3,)) if kind is Actor else PAPER
    check_begins(kind(sizes, lives.settings(hidden_units=H, num_layers=3)), begins)


def check_begins(network, begins):
    """Spread within four standard errors; no layer is missing, none is one more."""
    weights = {}
    for name, p in network.named_parameters():
        layer, kind = name.rsplit(".", 1)
        if kind == "weight":
            weights[layer] = p
        elif "conv" in name:  # torch's own: uniform within 1/√fan_in
            assert p.abs().max() <= 1 / math.sqrt(weights[layer][0].numel())
        else:
            assert not p.any(), name
    assert set(weights) == set(begins)
    for layer, p in weights.items():
        error = 4 / math.sqrt(2 * p.numel())
        assert p.std(correction=0).item() == pytest.approx(begins[layer], rel=error)


# -- Policies -----------------------------------------------------------------------


@pytest.mark.paper("E3")
def test_log_probabilities_are_a_table_with_an_entry_for_each_component():
    """N(0, 1) at 0 and 1: −½log 2π and ½ less; a third of three: −log 3; three to one:
    log ¾. No sum."""
    branches = [torch.zeros(1, 3), torch.tensor([[0.0, math.log(3)]])]
    policy = ActionDistribution(torch.zeros(1, 2), torch.zeros(2), branches)
    (entries,) = policy.log_probs(torch.tensor([[0.0, 1.0, 0.0, 1.0]])).tolist()
    assert entries == pytest.approx([-0.918939, -1.418939, -1.098612, -0.287682])


@pytest.mark.paper("E3")
def test_entropy_is_a_mean_over_dimensions_and_a_sum_over_branches():
    """½log 2πe + log σ on average, and log 2 + log 3."""
    branches = [torch.zeros(1, 2), torch.zeros(1, 3)]
    policy = ActionDistribution(torch.zeros(1, 2), torch.tensor([0.0, -1.0]), branches)
    expected = (1.418939 + 0.418939) / 2 + math.log(2) + math.log(3)
    assert policy.entropy().item() == pytest.approx(expected)


@pytest.mark.paper("E3", "D2")
def test_each_branch_has_a_layer_of_its_own():
    """Two of three options each."""
    head = GaussianHead(4, replace(SIZES, branches=(3, 3)))
    x = torch.randn(5, 4)
    for branch, layer in zip(head(x).branches, head.branches, strict=True):
        assert torch.allclose(branch.probs, layer(x).softmax(-1), atol=1e-6)
    one, other = head(x).branches
    assert not torch.allclose(one.probs, other.probs)


@pytest.mark.paper("E3")
def test_without_noise_the_mean_action_is_taken():
    """The Gaussian's mean, and each branch's best option."""
    policy = ActionDistribution(
        torch.tensor([[0.5, -7.0]]), torch.zeros(2), [torch.eye(3)[1:2]]
    )
    assert policy.act().tolist() == [[0.5, -7.0, 1.0]]


@pytest.mark.paper("E3")
def test_noise_makes_samples_of_the_distribution():
    """Normal numbers are scaled and shifted, Gumbel numbers pick by softmax, in two
    branches alike independently."""
    rng = np.random.default_rng(0)
    n = 20_000
    logits = torch.tensor([1.0, 0.0, -1.0])
    noise = np.hstack([rng.standard_normal((n, 1)), rng.gumbel(size=(n, 6))])
    mean = torch.full((n, 1), 2.0)
    log_sigma = torch.tensor([math.log(3)])
    policy = ActionDistribution(mean, log_sigma, [logits.expand(n, 3)] * 2)
    raw, one, other = policy.act(torch.from_numpy(noise).float()).T
    assert torch.allclose(raw, 2 + 3 * torch.from_numpy(noise[:, 0]).float())
    odds = torch.bincount(3 * one.long() + other.long()) / n
    p = logits.softmax(0)
    assert torch.allclose(odds, torch.outer(p, p).flatten(), atol=0.015)


# -- Critics ------------------------------------------------------------------------


@pytest.mark.paper("E1")
@WIDE
@pytest.mark.parametrize("G", [1, 2, 6])
def test_the_group_critic_agrees_with_one_that_encodes_every_mate_anew(G, dtype):
    """Values and all baselines, for groups of whoever is there."""
    rows = lives.doubled(lives.batch(8, G))
    critic = made(GroupCritic).to(dtype)
    vectors = rows.vectors.to(dtype)
    actions = rows.actions.to(dtype)
    value, baselines = critic.with_baselines(vectors, rows.grids, rows.alive, actions)
    naive = oracle.group_worth(critic, vectors, rows.grids, rows.alive, actions)
    live = rows.alive
    found = value[:, None].expand_as(live), baselines
    for ours, theirs in zip(found, naive, strict=True):
        assert (ours - theirs)[live].abs().max() < CLOSE[dtype]
    assert torch.allclose(critic(vectors, rows.grids, live), value)
    assert baselines[live].std() > 0.01


@pytest.mark.paper("E1")
def test_a_baseline_knows_what_the_mates_did_but_not_what_the_agent_did():
    """That is what makes it counterfactual; the value knows of no action."""
    critic = made(GroupCritic).double()
    rows = lives.doubled(lives.batch(G=3))
    seen = rows.vectors, rows.grids, torch.ones_like(rows.alive)
    value, baselines = critic.with_baselines(*seen, rows.actions)
    other = rows.actions.clone()
    other[:, 1] += 1.0
    value_then, baselines_then = critic.with_baselines(*seen, other)
    assert torch.equal(value_then, value)
    same = torch.isclose(baselines_then, baselines, atol=1e-12).all(dim=0)
    assert same.tolist() == [False, True, False]


@pytest.mark.paper("E1")
def test_the_critic_is_told_how_many_agents_are_there():
    """2n/n_max − 1, where n_max is the largest group it has seen; kept with it."""
    critic = made(GroupCritic).double()
    rows = lives.doubled(lives.batch(4, 4))
    with torch.no_grad():
        critic.value.weight.zero_()
        critic.value.weight[0, -1] = 1.0
        critic.value.bias[:] = 0.0
    alone = torch.eye(4, dtype=torch.bool)
    assert critic(rows.vectors, rows.grids, alone).tolist() == [1.0] * 4
    growing = torch.ones(4, 4, dtype=torch.bool).tril()
    shares = critic(rows.vectors, rows.grids, growing).tolist()
    assert shares == [-0.5, 0.0, 0.5, 1.0]
    assert critic(rows.vectors, rows.grids, alone).tolist() == [-0.5] * 4
    assert critic.state_dict()["most"] == 4
