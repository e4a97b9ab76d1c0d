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
from lives import MIXED, SIZES
from torch.distributions import Independent, MixtureSameFamily

from reference.learning.networks import (
    REFUSED,
    SIGMAS,
    Actor,
    Encoder,
    GaussianHead,
    GridEncoder,
    Mixture,
    MixtureHead,
    Normaliser,
    Options,
    PointerHead,
    Policy,
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
    """1 and 3 after the pseudo-sample 0: n = 3, mean 4/3, S = 1 + 1·(−1/3) + 3·5/3."""
    normaliser = Normaliser(1)
    normaliser.update(torch.tensor([[1.0], [3.0]]))
    assert normaliser.count == 3
    assert normaliser.mean.item() == pytest.approx(4 / 3)
    assert normaliser.squares.item() == pytest.approx(17 / 3)
    z = (2 - 4 / 3) / math.sqrt(17 / 9)
    assert normaliser(torch.tensor([2.0])).item() == pytest.approx(z)


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


@pytest.mark.paper("E4")
def test_a_normalised_number_is_cut_off_at_five_deviations():
    """However far out: 5 and −5."""
    normaliser = Normaliser(2)
    assert normaliser(torch.tensor([[7.0, -5.5]])).tolist() == [[5.0, -5.0]]
    assert normaliser(torch.tensor([[4.5, -1.0]])).tolist() == [[4.5, -1.0]]


# -- The encoders -------------------------------------------------------------------


@pytest.mark.paper("C3")
@WIDE
def test_the_simple_encoder_makes_288_features_of_40_by_40(dtype):
    """9 x 40 x 40 → 16 x 9 x 9 → 32 x 3 x 3; and patch by patch the same numbers."""
    torch.manual_seed(0)
    encoder = GridEncoder((9, 40, 40), 16).to(dtype)
    assert encoder.dense.in_features == 288
    grids = (torch.rand(3, 9, 40, 40) < 0.3).to(dtype)
    p = {f"grid.{k}": v for k, v in oracle.parameters(encoder).items()}
    p = {f"e.{k}": v for k, v in p.items()}
    naive = oracle.encoded(p, "e", torch.zeros(3, 0, dtype=dtype), grids)
    assert torch.allclose(encoder(grids), naive, atol=CLOSE[dtype], rtol=0)


@pytest.mark.paper("C4")
def test_a_group_s_image_is_encoded_once_and_stands_beside_every_vector():
    """The same as a copy of it for each agent."""
    encoder = made(Encoder)
    rows = lives.batch(B=2, G=3)
    together = encoder(rows.vectors, rows.grids)
    for agent in range(3):
        alone = encoder(rows.vectors[:, agent], rows.grids)
        assert torch.equal(together[:, agent], alone)
    assert together.shape == (2, 3, SIZES.vector + 16)


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
ACTOR_BEGINS = {
    "body.encoder.grid.dense": 1.41 / math.sqrt(288),
    "body.layers.0": 1 / math.sqrt(167 + H),
    "body.layers.2": 1 / math.sqrt(H),
    "body.layers.4": 1 / math.sqrt(H),
    "gaussian.mean": 0.2 / math.sqrt(H),
    "gaussian.branches.0": 0.1 / math.sqrt(H),
}
CRITIC_BEGINS = {
    "encoder.grid.dense": 1.41 / math.sqrt(288),
    **dict.fromkeys(["g.0", "f.0"], TFIXUP),
    **{f"attention.{a}": TFIXUP for a in ("query", "key", "to_value", "out")},
    **{f"trunk.{k}": math.sqrt(0.125) / H for k in (0, 2, 4)},
    "value": math.sqrt(2 / (H + 2)),
}


@pytest.mark.paper("E3")
def test_a_new_actor_s_weights_have_the_spread_of_the_original():
    """Each layer's standard deviation, zero biases, log sigma 0."""
    torch.manual_seed(0)
    check_begins(Actor(replace(PAPER, branches=(3,)), paper_net()), ACTOR_BEGINS)


@pytest.mark.paper("E3")
def test_a_new_group_critic_is_tiny():
    """So that only Adam's rescaling lets it start; its value head is Glorot's."""
    torch.manual_seed(0)
    critic = GroupCritic(PAPER, paper_net())
    check_begins(critic, CRITIC_BEGINS)
    assert critic.value.weight.abs().max() <= math.sqrt(6 / (H + 2))
    assert critic.most == 1


def paper_net():
    """Tables I and II: three layers of 256."""
    return lives.settings(hidden_units=H, num_layers=3)


def check_begins(network, begins):
    """Spread within four standard errors, and nothing is left out."""
    for name, p in network.named_parameters():
        layer, kind = name.rsplit(".", 1)
        if "conv" in name:  # torch's own: uniform within 1/√fan_in
            fan_in = network.get_submodule(layer).weight[0].numel()
            assert p.abs().max() <= 1 / math.sqrt(fan_in)
        elif kind == "weight":
            error = 4 / math.sqrt(2 * p.numel())
            assert p.std(correction=0).item() == pytest.approx(begins[layer], rel=error)
        else:
            assert not p.any(), name


# -- Policies -----------------------------------------------------------------------


@pytest.mark.paper("E3")
def test_log_probabilities_are_a_table_with_an_entry_for_each_component():
    """N(0, 1) at 0 and 1: −½log 2π and ½ less; a third of three: −log 3. No sum."""
    policy = Policy(torch.zeros(1, 2), torch.zeros(2), [torch.zeros(1, 3)])
    entries = policy.log_probs(torch.tensor([[0.0, 1.0, 2.0]]))
    assert entries.tolist() == [pytest.approx([-0.918939, -1.418939, -1.098612])]


@pytest.mark.paper("E3")
def test_entropy_is_a_mean_over_dimensions_and_a_sum_over_branches():
    """½log 2πe + log σ on average, and log 2 + log 3."""
    branches = [torch.zeros(1, 2), torch.zeros(1, 3)]
    policy = Policy(torch.zeros(1, 2), torch.tensor([0.0, -1.0]), branches)
    expected = (1.418939 + 0.418939) / 2 + math.log(2) + math.log(3)
    assert policy.entropy().item() == pytest.approx(expected)


@pytest.mark.paper("D2")
@WIDE
@pytest.mark.parametrize("sizes", [SIZES, MIXED], ids=["gaussian", "mixed"])
def test_the_actor_agrees_with_a_naive_one(sizes, dtype):
    """Log-probabilities and entropy, an image of its own for every agent."""
    rows, actor = lives.doubled(lives.batch(sizes=sizes)), made(Actor, sizes).to(dtype)
    vectors, actions = rows.vectors.to(dtype), rows.actions.to(dtype)
    policy = actor(vectors, rows.grids)
    p = oracle.parameters(actor)
    log_probs, entropy = oracle.acted(p, vectors, rows.grids, actions)
    close = {"atol": CLOSE[dtype], "rtol": CLOSE[dtype]}
    assert torch.allclose(policy.log_probs(actions), log_probs, **close)
    assert torch.allclose(policy.entropy(), entropy, **close)


@pytest.mark.paper("E3")
def test_without_noise_the_mean_action_is_taken():
    """The Gaussian's mean, and each branch's best option."""
    policy = Policy(torch.tensor([[0.5, -7.0]]), torch.zeros(2), [torch.eye(3)[1:2]])
    assert policy.act().tolist() == [[0.5, -7.0, 1.0]]


@pytest.mark.paper("E3")
def test_noise_makes_samples_of_the_distribution():
    """Normal numbers are scaled and shifted, Gumbel numbers pick by softmax."""
    rng = np.random.default_rng(0)
    n, logits = 20_000, torch.tensor([1.0, 0.0, -1.0])
    noise = np.hstack([rng.standard_normal((n, 1)), rng.gumbel(size=(n, 3))])
    mean, log_sigma = torch.full((n, 1), 2.0), torch.tensor([math.log(3)])
    policy = Policy(mean, log_sigma, [logits.expand(n, 3)])
    raw, index = policy.act(torch.from_numpy(noise).float()).T
    assert torch.allclose(raw, 2 + 3 * torch.from_numpy(noise[:, 0]).float())
    odds = torch.bincount(index.long()) / n
    assert torch.allclose(odds, logits.softmax(0), atol=0.015)


def pointer(features=4):
    """A head whose options differ clearly, and what it is asked about."""
    torch.manual_seed(1)
    head = PointerHead(8, features)
    torch.nn.init.normal_(head.score.weight)
    x, seen = torch.randn(2, 8), torch.randn(2, 5, features)
    return head, x, seen


@pytest.mark.paper("C5")
def test_an_option_that_is_not_there_is_never_pointed_at():
    """Probability 0; and what stands in its row changes nothing."""
    head, x, features = pointer()
    action_mask = torch.tensor([[1, 1, 0, 1, 0], [0, 1, 1, 1, 1]], dtype=torch.bool)
    probs = head(x, Options(features, action_mask)).branches[0].probs
    assert not probs[~action_mask].any()
    features[~action_mask] = 1e3
    other = head(x, Options(features, action_mask))
    assert torch.equal(other.branches[0].probs, probs)
    assert torch.isfinite(other.entropy()).all()


@pytest.mark.paper("C5")
def test_where_an_option_stands_in_the_list_does_not_matter():
    """One small network scores all of them."""
    head, x, features = pointer()
    order, action_mask = (
        torch.tensor([3, 1, 4, 0, 2]),
        torch.ones(2, 5, dtype=torch.bool),
    )
    probs = head(x, Options(features, action_mask)).branches[0].probs
    moved = head(x, Options(features[:, order], action_mask)).branches[0].probs
    assert torch.allclose(moved, probs[:, order])
    assert probs.std() > 0.02


@pytest.mark.paper("C5")
def test_without_context_options_are_all_that_a_pointer_looks_at():
    """What is observed besides changes nothing; how an option looks does."""
    sizes, features = replace(SIZES, continuous=0, features=4), torch.randn(2, 5, 4)
    there = torch.ones(2, 5, dtype=torch.bool)
    for context in (True, False):
        actor = made(Actor, sizes, context=context)

        def probs(seen, features, actor=actor):
            grids = torch.full((2, *SIZES.grid), seen)
            options = Options(features, there)
            return actor(torch.full((2, 5), seen), grids, options).branches[0].probs

        first = probs(0.0, features)
        assert torch.equal(first, probs(1.0, features)) != context
        assert not torch.allclose(first, probs(0.0, features + 1))


# -- The mixture ----------------------------------------------------------------------


def mixture(rows=7, anchors=4, sigma=0.3):
    """A mixture for each row, with an anchor that may not be meant; in float64."""
    logits = lives.random(1, rows, anchors)
    logits[:, -1] = REFUSED
    return Mixture(lives.random(0, rows, anchors, 2), sigma, logits)


@pytest.mark.paper("C5", "chosen")
def test_a_mixture_s_log_probability_is_torch_s():
    """One number for both floats, whichever anchor they were drawn around."""
    policy, actions = mixture(), lives.random(2, 7, 2)
    oracle = MixtureSameFamily(policy.choice, Independent(policy.gaussian, 1))
    found = policy.log_probs(actions)
    assert found.shape == (7, 1)
    assert torch.allclose(found[:, 0], oracle.log_prob(actions))


@pytest.mark.paper("C5", "chosen")
def test_a_mixture_s_gradient_is_that_of_finite_differences():
    """In its weights, in float64."""
    anchors, actions = lives.random(0, 3, 4, 2), lives.random(2, 3, 2)

    def log_probs(logits):
        return Mixture(anchors, 0.5, logits).log_probs(actions)

    assert torch.autograd.gradcheck(log_probs, lives.random(1, 3, 4).requires_grad_())


@pytest.mark.paper("C5", "chosen")
def test_a_mixture_s_entropy_is_that_of_its_choice_and_of_one_gaussian():
    """Two equally likely anchors: log 2, and log sigma + log(2 pi e) / 2."""
    policy = Mixture(torch.zeros(1, 2, 2), 0.3, torch.zeros(1, 2))
    gaussian = math.log(0.3) + math.log(2 * math.pi * math.e) / 2
    assert policy.entropy().item() == pytest.approx(math.log(2) + gaussian)


@pytest.mark.paper("C5", "chosen")
def test_a_mixture_is_drawn_around_its_anchors_as_often_as_they_weigh():
    """The one that may not be meant never; without noise, at the likeliest itself."""
    rng, n = np.random.default_rng(0), 20_000
    anchors = torch.tensor([[0.0, 0.0], [5.0, 0.0], [0.0, 9.0]]).expand(n, 3, 2)
    logits = torch.tensor([0.0, 1.0, REFUSED]).expand(n, 3)
    policy = Mixture(anchors, 0.2, logits)
    normals, gumbels = policy.noise()
    noise = [rng.standard_normal((n, normals)), rng.gumbel(size=(n, gumbels))]
    drawn = policy.act(torch.from_numpy(np.hstack(noise)).float())
    second = drawn[:, 0] > 2.5
    assert second.float().mean().item() == pytest.approx(
        1 / (1 + math.exp(-1)), abs=0.01
    )
    off = drawn - torch.where(second[:, None], anchors[:, 1], anchors[:, 0])
    assert torch.allclose(off.std(dim=0), torch.tensor(0.2), atol=0.005)
    assert off.abs().max() < 1.2
    assert torch.equal(policy.act(), anchors[:, 1])


@pytest.mark.paper("C7", "Alg. 3:3")
def test_commitment_is_a_bonus_for_the_anchor_where_a_mixture_is_headed():
    """Where it is headed somewhere; else that anchor is refused."""
    head = MixtureHead(8, 3, 0.04, 2.5)
    torch.nn.init.zeros_(head.weights.weight)
    mask = torch.tensor([[True, True, True], [False, True, True]])
    probs = head(torch.randn(2, 8), Options(torch.zeros(2, 3, 2), mask)).choice.probs
    keep = math.exp(2.5) / (math.exp(2.5) + 2)
    assert probs[0].tolist() == pytest.approx([keep, (1 - keep) / 2, (1 - keep) / 2])
    assert probs[1].tolist() == pytest.approx([0, 0.5, 0.5])


@pytest.mark.paper("C5", "chosen")
def test_a_gaussian_in_the_robot_s_frame_begins_with_five_metres():
    """Its deviation follows from what is seen, between bounds; as printed, it is 1."""
    x = torch.randn(200, 8)
    as_printed = GaussianHead(8, 2, ())(x).gaussian.stddev
    assert as_printed.unique().tolist() == [1.0]
    head = GaussianHead(8, 2, (), robots_frame=True)
    assert head(x).gaussian.stddev.median().item() == pytest.approx(0.5, abs=0.05)
    torch.nn.init.normal_(head.log_sigma.weight, std=10)
    sigma = head(x).gaussian.stddev
    assert [sigma.min().item(), sigma.max().item()] == pytest.approx(SIGMAS)


# -- Critics ------------------------------------------------------------------------


@pytest.mark.paper("E2")
@WIDE
def test_ppo_s_critic_agrees_with_a_naive_one(dtype):
    """A second body with its own head, on the agent's own observation."""
    rows, critic = lives.doubled(lives.batch()), made(Critic).to(dtype)
    vectors = rows.vectors.to(dtype)
    p = oracle.parameters(critic)
    naive = oracle.dense(p, "value", oracle.body(p, vectors, rows.grids))[..., 0]
    values = critic(vectors, rows.grids)
    assert torch.allclose(values, naive, atol=CLOSE[dtype], rtol=CLOSE[dtype])


@pytest.mark.paper("E1")
@WIDE
@pytest.mark.parametrize("G", [1, 2, 6])
def test_the_group_critic_agrees_with_one_that_encodes_every_mate_anew(G, dtype):
    """Values and all baselines, for groups of whoever is there."""
    rows, critic = lives.doubled(lives.batch(8, G)), made(GroupCritic).to(dtype)
    vectors, shown = rows.vectors.to(dtype), rows.shown.to(dtype)
    value, baselines = critic.with_baselines(vectors, rows.grids, rows.alive, shown)
    naive = oracle.group_worth(
        oracle.parameters(critic), vectors, rows.grids, rows.alive, shown
    )
    live = rows.alive
    found = (value[:, None].expand_as(live), baselines)
    for ours, theirs in zip(found, naive, strict=True):
        assert (ours - theirs)[live].abs().max() < CLOSE[dtype]
    assert torch.allclose(critic(vectors, rows.grids, live), value)
    assert baselines[live].std() > 0.01


@pytest.mark.paper("E1")
@pytest.mark.parametrize("G", [1, 2, 6])
def test_all_baselines_at_once_are_those_of_one_set_after_the_other(G):
    """Each agent's action taken out in turn, through the same attention."""
    attention, alive = made(GroupCritic).attention, lives.batch(8, G).alive
    f, g = torch.randn(2, 8, G, 16)
    one_by_one = attention.counterfactual(f, g, alive)
    at_once = attention.counterfactual_at_once(f, g, alive)
    assert (at_once - one_by_one).abs().max() < 1e-6


def asked(critic, rows):
    """Values, and baselines with 0 for the absent."""
    value, baselines = critic.with_baselines(
        rows.vectors, rows.grids, rows.alive, rows.shown
    )
    return value, baselines.masked_fill(~rows.alive, 0.0)


@pytest.mark.paper("E1")
def test_the_order_of_mates_does_not_matter():
    """Baselines move with their agents, values stay."""
    critic, rows = made(GroupCritic).double(), lives.doubled(lives.batch(G=4))
    value, baselines = asked(critic, rows)
    order = [2, 0, 3, 1]
    moved = {
        name: getattr(rows, name)[:, order] for name in ("vectors", "alive", "shown")
    }
    value_moved, baselines_moved = asked(critic, replace(rows, **moved))
    assert torch.allclose(value_moved, value, atol=1e-12)
    assert torch.allclose(baselines_moved, baselines[:, order], atol=1e-12)


@pytest.mark.paper("E1")
def test_what_stands_in_the_rows_of_absent_agents_changes_nothing():
    """Not a bit of it; nor do more absent agents."""
    critic, rows = made(GroupCritic), lives.batch(G=3)
    value, baselines = asked(critic, rows)
    absent = ~rows.alive[..., None]
    garbage = replace(
        rows,
        vectors=rows.vectors.masked_fill(absent, 1e3),
        shown=rows.shown.masked_fill(absent, -1e3),
    )
    assert all(map(torch.equal, asked(critic, garbage), (value, baselines)))
    wider = {n: torch.cat([x := getattr(rows, n), x], 1) for n in ("vectors", "shown")}
    nobody = torch.cat([rows.alive, torch.zeros_like(rows.alive)], dim=1)
    value_wide, baselines_wide = asked(critic, replace(rows, alive=nobody, **wider))
    assert torch.allclose(value_wide, value, atol=1e-5)
    assert torch.allclose(baselines_wide[:, :3], baselines, atol=1e-5)


@pytest.mark.paper("E1")
def test_a_lone_agent_s_baseline_is_its_value():
    """With no mates there is nothing that the baseline knows and the value does not."""
    critic, rows = made(GroupCritic).double(), lives.doubled(lives.batch(G=3))
    rows.alive = torch.eye(3, dtype=torch.bool).repeat(2, 1)
    value, baselines = asked(critic, rows)
    assert torch.allclose(baselines.sum(1), value, atol=1e-12)


@pytest.mark.paper("E1")
def test_a_baseline_knows_what_the_mates_did_but_not_what_the_agent_did():
    """That is what makes it counterfactual; the value knows of no action."""
    critic, rows = made(GroupCritic).double(), lives.doubled(lives.batch(G=3))
    rows.alive[:] = True
    value, baselines = asked(critic, rows)
    other = rows.shown.clone()
    other[:, 1] += 1.0
    value_then, baselines_then = asked(critic, replace(rows, shown=other))
    assert torch.equal(value_then, value)
    same = torch.isclose(baselines_then, baselines, atol=1e-12).all(dim=0)
    assert same.tolist() == [False, True, False]


@pytest.mark.paper("E1")
def test_the_critic_is_told_how_many_agents_are_there():
    """2n/n_max − 1, where n_max is the largest group it has seen; kept with it."""
    critic, rows = made(GroupCritic).double(), lives.doubled(lives.batch(4, 4))
    with torch.no_grad():
        critic.value.weight.zero_()
        critic.value.weight[0, -1], critic.value.bias[:] = 1.0, 0.0
    alone = torch.eye(4, dtype=torch.bool)
    assert critic(rows.vectors, rows.grids, alone).tolist() == [1.0] * 4
    growing = torch.ones(4, 4, dtype=torch.bool).tril()
    shares = critic(rows.vectors, rows.grids, growing).tolist()
    assert shares == [-0.5, 0.0, 0.5, 1.0]
    assert critic(rows.vectors, rows.grids, alone).tolist() == [-0.5] * 4
    assert critic.state_dict()["most"] == 4


@pytest.mark.paper("C7", "Alg. 3:3")
@pytest.mark.parametrize("bonus", [0.0, 4.0])
def test_commitment_is_a_bonus_for_the_first_option_alone(bonus):
    """Its odds grow by e^bonus, those among the others stay; only where it is there."""
    head, x, features = pointer()
    mask = torch.ones(2, 5, dtype=torch.bool)
    mask[1, 0] = False
    before = head(x, Options(features, mask)).branches[0].probs
    head.commitment = bonus
    after = head(x, Options(features, mask)).branches[0].probs
    odds = [(p[0, 0] / p[0, 1:].sum()).item() for p in (before, after)]
    assert odds[1] == pytest.approx(odds[0] * math.exp(bonus), rel=1e-4)
    assert torch.allclose(after[1], before[1])


@pytest.mark.paper("C7", "Alg. 3:3")
def test_a_gaussian_that_is_not_taken_says_nothing():
    """Whoever keeps a destination has no log-probability of the numbers drawn."""
    mask = torch.tensor([[True, True], [False, True]])
    policy = GaussianHead(8, 2, (2,), 4.0)(
        torch.randn(2, 8), Options(torch.zeros(2, 2, 0), mask)
    )
    keep, new = torch.tensor([0.3, 0.4, 0.0]), torch.tensor([0.3, 0.4, 1.0])
    kept, taken = policy.log_probs(torch.stack([keep, new]))
    assert kept[:2].tolist() == [0, 0] and kept[2] > -0.1  # e^4 to 1
    assert taken[:2].abs().min() > 0 and taken[2] == 0  # nothing else was there
