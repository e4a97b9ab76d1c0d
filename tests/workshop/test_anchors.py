"""What helps learning: heads, ways to read and speak."""

import math
from dataclasses import replace

import lives
import numpy as np
import pytest
import torch
from torch.distributions import Independent, MixtureSameFamily

from reference.fire import burnable
from reference.game.codec import Moment, decision_in
from reference.learning.adversarial import learner_for, player_of
from reference.learning.networks import REFUSED, Actor
from reference.learning.settings import SIDES
from reference.navigation import navigation_of
from reference.paper import Scenario
from reference.simulation import Simulation
from reference.workshop.anchors.frame import UNIT, AnchorSizes
from reference.workshop.anchors.heads import Mixture, MixtureActor, MixtureHead
from reference.workshop.anchors.set_networks import SetActor
from reference.workshop.maps import load, plan_of
from reference.workshop.training.presets import preset
from reference.world import FireLit

# -- Heads --------------------------------------------------------------------------


def mixture(rows=7, anchors=4, sigma=0.3):
    """A mixture for each row, with an anchor that may not be meant; in float64."""
    logits = lives.random(1, rows, anchors)
    logits[:, -1] = REFUSED
    return Mixture(lives.random(0, rows, anchors, 2), sigma, logits)


@pytest.mark.paper("C5", "chosen")
def test_a_mixture_s_log_probability_is_torch_s():
    """One number for both floats, whichever anchor they were drawn around."""
    policy = mixture()
    actions = lives.random(2, 7, 2)
    oracle = MixtureSameFamily(policy.choice, Independent(policy.gaussian, 1))
    found = policy.log_probs(actions)
    assert found.shape == (7, 1)
    assert torch.allclose(found[:, 0], oracle.log_prob(actions))


@pytest.mark.paper("C5", "chosen")
def test_a_mixture_s_entropy_is_that_of_its_choice_and_of_one_gaussian():
    """Two equally likely anchors: log 2, and log sigma + log(2 pi e) / 2."""
    policy = Mixture(torch.zeros(1, 2, 2), 0.3, torch.zeros(1, 2))
    gaussian = math.log(0.3) + math.log(2 * math.pi * math.e) / 2
    assert policy.entropy().item() == pytest.approx(math.log(2) + gaussian)


@pytest.mark.paper("C5", "chosen")
def test_a_mixture_is_drawn_around_its_anchors_as_often_as_they_weigh():
    """The one that may not be meant never; without noise, at the likeliest itself."""
    rng = np.random.default_rng(0)
    n = 20_000
    anchors = torch.tensor([[0.0, 0.0], [5.0, 0.0], [0.0, 9.0]]).expand(n, 3, 2)
    logits = torch.tensor([0.0, 1.0, REFUSED]).expand(n, 3)
    policy = Mixture(anchors, 0.2, logits)
    normals, gumbels = policy.noise_sizes()
    noise = [rng.standard_normal((n, normals)), rng.gumbel(size=(n, gumbels))]
    drawn = policy.act(torch.from_numpy(np.hstack(noise)).float())
    second = drawn[:, 0] > 2.5
    share = 1 / (1 + math.exp(-1))
    assert second.float().mean().item() == pytest.approx(share, abs=0.01)
    off = drawn - torch.where(second[:, None], anchors[:, 1], anchors[:, 0])
    assert torch.allclose(off.std(dim=0), torch.tensor(0.2), atol=0.005)
    assert off.abs().max() < 1.2
    assert torch.equal(policy.act(), anchors[:, 1])


def head_of_three(commitment):
    """A head of three anchors, after a body of 8 hidden units."""
    sizes = AnchorSizes(
        vector=14,
        grid=lives.SIZES.grid,
        continuous=2,
        anchors=3,
        spread=0.4,
        commitment=commitment,
    )
    return MixtureHead(8, sizes)


@pytest.mark.paper("C7", "Alg. 3:3")
def test_commitment_is_a_bonus_for_the_anchor_where_a_mixture_is_headed():
    """Where it is headed somewhere; else that anchor is refused."""
    head = head_of_three(commitment=2.5)
    torch.nn.init.zeros_(head.weights.weight)
    allowed = torch.tensor([[1.0, 1, 1], [0, 1, 1]])
    vectors = torch.cat([torch.zeros(2, 6), allowed, torch.randn(2, 5)], dim=1)
    probs = head(torch.randn(2, 8), vectors).choice.probs
    keep = math.exp(2.5) / (math.exp(2.5) + 2)
    assert probs[0].tolist() == pytest.approx([keep, (1 - keep) / 2, (1 - keep) / 2])
    assert probs[1].tolist() == pytest.approx([0, 0.5, 0.5])


@pytest.mark.paper("C5", "chosen")
def test_a_mixture_reads_its_anchors_from_the_numbers():
    """The first 2K of them, in the units that an action has."""
    head = head_of_three(commitment=0.0)
    rng = np.random.default_rng(0)
    vectors = torch.from_numpy(rng.normal(size=(4, 20))).float()
    vectors[:, 6:9] = 1.0
    spots = head(torch.randn(4, 8), vectors).act()
    off = (vectors[:, :6].view(4, 3, 2) - spots[:, None]).norm(dim=-1)
    assert off.min(dim=1).values.tolist() == [0.0] * 4


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize(
    "head, actor", [("floor", Actor), ("mixture", MixtureActor), ("set", SetActor)]
)
def test_who_learns_and_who_plays_have_the_network_of_the_head(head, actor, side):
    """Settings say which class it is; in the paper's place, or the paper's itself."""
    table = replace(getattr(preset("tiny"), side), head=head)
    tiny = load("tiny")
    learner = learner_for(side, plan_of(tiny), Scenario(people=6), table, seed=0)
    player = player_of(learner).player(side, tiny, Scenario(people=6))
    assert type(learner.actor) is type(player.actor) is actor


# -- Interfaces ---------------------------------------------------------------------


@pytest.mark.paper("D2", "chosen")
@pytest.mark.parametrize("name", ["tiny", "paper"])
def test_the_fires_anchors_stand_beside_all_ways_and_can_burn(name):
    """One for each exit, entrance and door; said as floor, x and y."""
    building = load(name)
    scenario = Scenario()
    fire = preset("laptop").fire.codec("fire", building, scenario)
    assert len(fire.anchors) == len(building.landmarks)
    for anchor, mark in zip(fire.anchors, building.landmarks, strict=True):
        floor, x, y = decision_in(fire.actions(anchor, []))
        assert floor == mark.floor
        assert np.hypot(*np.subtract((x, y), mark.position)) < 8
        assert burnable(building).ravel()[navigation_of(building).place(floor, x, y)]


@pytest.mark.paper("D2", "chosen")
def test_where_a_fire_burns_none_is_lit_again():
    """The anchor beside a source is refused; all the others are allowed."""
    building = load("tiny")
    scenario = Scenario()
    fire = preset("laptop").fire.codec("fire", building, scenario)
    world = Simulation(building, scenario).world
    storey, x, y = fire.anchors[3] * (1, UNIT, UNIT)
    K = len(fire.anchors)

    def allowed():
        (vectors,) = fire.observe([world])
        moment = Moment(vectors, np.ones(1, dtype=bool), world)
        return fire.read([moment])[0, 0, 3 * K : 4 * K]

    assert allowed().all()
    world.flames.sources.append(FireLit(0.0, int(storey), float(x), float(y)))
    assert not allowed()[3] and allowed().sum() >= K - 3
