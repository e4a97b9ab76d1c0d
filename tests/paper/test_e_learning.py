"""What is learned from: who trains by which table, what is recorded, when it counts."""

from types import SimpleNamespace

import numpy as np
import pytest
import torch
from lives import SIZES, life, settings

from reference.fire import NoFire
from reference.learning import poca, ppo
from reference.learning.adversarial import learn, learner_for, player_of
from reference.learning.rollouts import Job, play
from reference.paper import TABLE_I, TABLE_II, Scenario
from reference.robots import NoRobots
from reference.workshop.maps import load, plan_of

TINY = plan_of(load("tiny"))
SCENE = Scenario(people=6, sources=3, training=True, time_limit=60)
SMALL = {"hidden_units": 8, "num_layers": 1}


@pytest.mark.paper("E1", "Tab. I")
@pytest.mark.paper("E2", "Tab. II")
def test_robots_are_trained_by_ma_poca_and_the_fire_by_ppo():
    """As the tables' first rows say."""

    def by(side, table):
        return learner_for(side, TINY, SCENE, settings(**dict(table) | SMALL), 0)

    assert type(by("robots", TABLE_I)) is poca.GroupLearner
    assert type(by("fire", TABLE_II)) is ppo.Learner


@pytest.fixture(scope="module")
def played():
    """What new robots observed and did in an episode, and their policy there."""
    learner = learner_for("robots", TINY, SCENE, settings("ppo", **SMALL), 1)
    sides = {"robots": player_of(learner), "fire": NoFire()}
    (episode,) = play(Job(TINY, SCENE, **sides, seeds=(1,)))
    t = episode.robots
    vectors = torch.from_numpy(t.vectors[:-1])
    grids = torch.from_numpy(t.grids[:-1])
    with torch.no_grad():
        return t, learner.actor(vectors, grids)


@pytest.mark.paper("E3")
def test_what_is_recorded_is_how_likely_the_actions_were_that_were_done(played):
    """Not how likely the mean is: a ratio of probabilities begins at 1."""
    t, policy = played
    said = policy.log_probs(torch.from_numpy(t.actions)).numpy()
    live = t.alive[:-1]
    np.testing.assert_allclose(t.log_probs[live], said[live], atol=1e-4)
    mean = policy.log_probs(policy.act()).numpy()
    assert np.abs(t.log_probs[live] - mean[live]).min() > 0


@pytest.mark.paper("E3")
def test_each_robot_draws_noise_of_its_own(played):
    """At every decision, and for both coordinates."""
    t, policy = played
    means = policy.act().numpy()
    live = t.alive[:-1]
    noise = (t.actions - means)[live]
    assert len(np.unique(noise.round(6))) == noise.size


@pytest.mark.paper("E3", "E6")
def test_the_fire_draws_other_noise_than_the_robots():
    """Though an episode has one seed: its first two numbers and those of robot 0."""
    learners = {
        side: learner_for(side, TINY, SCENE, settings("ppo", **SMALL), 1)
        for side in ("robots", "fire")
    }
    players = {side: player_of(learner) for side, learner in learners.items()}
    (episode,) = play(Job(TINY, SCENE, **players, seeds=(1,)))
    noise = []
    for side, learner in learners.items():
        t = getattr(episode, side)
        seen = torch.from_numpy(t.vectors[:1]), torch.from_numpy(t.grids[:1])
        mean = learner.actor(*seen).act().detach().numpy()
        noise.append((t.actions[:1] - mean)[0, 0, :2])
    assert not np.isclose(*noise, atol=1e-3).any()


@pytest.mark.paper("D2", "E3")
def test_the_fire_s_floor_is_drawn():
    """Not always the likeliest one: in eight episodes it chooses another, too."""
    learner = learner_for("fire", TINY, SCENE, settings("ppo", **SMALL), 1)
    job = Job(TINY, SCENE, NoRobots(), player_of(learner), seeds=tuple(range(8)))
    others = 0
    for episode in play(job):
        t = episode.fire
        seen = torch.from_numpy(t.vectors[:-1]), torch.from_numpy(t.grids[:-1])
        likeliest = learner.actor(*seen).act().detach().numpy()
        others += (t.actions[..., 2] != likeliest[..., 2]).sum()
    assert others > 0


@pytest.mark.paper("E3")
def test_a_side_learns_from_all_episodes_once_its_buffer_is_full():
    """Nothing changes with 4 or 8 decisions of 8; the ninth and all before it count.

    What two agents decide at once are two decisions.
    """
    learner = ppo.Learner(settings("ppo", buffer_size=8), SIZES, seed=1)
    weights = [p.detach().clone() for p in learner.actor.parameters()]
    once = [SimpleNamespace(robots=life("##", "##", seed=0))]
    twice = [*once, SimpleNamespace(robots=life("##", "##", seed=1))]
    assert learn("robots", learner, once) == learn("robots", learner, once) == {}
    assert len(learner.buffer) == 2 and learner.steps == 8
    same = zip(weights, learner.actor.parameters(), strict=True)
    assert all(torch.equal(old, new) for old, new in same)
    assert learn("robots", learner, twice)
    assert not learner.buffer and learner.steps == 16


@pytest.mark.paper("E3")
@pytest.mark.parametrize("falls", ["learning_rate", "epsilon", "beta"])
def test_each_schedule_is_its_own(falls):
    """One that is linear is lower after an episode, two that are constant are not."""
    rows = ("learning_rate", "epsilon", "beta")
    kinds = dict.fromkeys([f"{row}_schedule" for row in rows], "constant")
    kinds[f"{falls}_schedule"] = "linear"
    learner = ppo.Learner(settings("ppo", max_steps=9, **kinds), SIZES, seed=1)
    before = learner.schedules()
    learner.add([life("####")])
    after = zip(rows, before, learner.schedules(), strict=True)
    assert [row for row, old, new in after if new < old] == [falls]
