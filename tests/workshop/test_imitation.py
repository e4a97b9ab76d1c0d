"""Imitation: robots that copied a strategy go where it would have gone."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from movies import wait
from trainings import TINY, begun, tiny

from reference.building import building_of
from reference.fire import RandomFire
from reference.game.codec import Moment, PolicyCodec
from reference.game.observations import from_normalised
from reference.learning.adversarial import player_of
from reference.learning.experience import Decisions, decisions_of
from reference.learning.players import LearnedNetwork
from reference.learning.rollouts import play
from reference.simulation import Simulation
from reference.workshop.anchors.frame import KEEP, UNIT, WAIT, robot_destinations
from reference.workshop.strategies.guides import Sweep
from reference.workshop.training.imitation import Demonstration, clone


def off_course(training, seed=5):
    """Metres from where the teacher goes to where robots would, time by time."""
    jobs = begun(training.settings, imitate="sweep", seed=seed).jobs()
    played = [episode.robots for job in jobs for episode in play(job)]
    seen = Decisions.joined([decisions_of(trajectory) for trajectory in played])
    policy = training.learners["robots"].actor(seen.vectors, seen.grids)
    off = (policy.act() - seen.actions).norm(dim=-1)
    return UNIT * off[seen.alive].detach()


def after_8_s(scenario):
    """What robots decide from, in an evacuation that `sweep` guides."""
    sim = Simulation(building_of(TINY), scenario, Sweep(), RandomFire(), 1)
    wait(sim, 8)
    (vectors,) = PolicyCodec("robots", sim.building, scenario).observe([sim.world])
    return Moment(vectors, np.ones(len(vectors), dtype=bool), sim.world)


def weights(learner):
    """All weights of the policy, and all of the critic, as they are now."""
    both = learner.actor, learner.critic
    return [torch.cat([w.detach().ravel() for w in net.parameters()]) for net in both]


@pytest.mark.paper("C7", "chosen")
@pytest.mark.paper("E1", "chosen")
@pytest.mark.parametrize("head", ["mixture", "set"])
def test_robots_that_copied_sweep_go_where_it_would(head):
    """In evacuations that they have not seen; they did not before."""
    settings = tiny(robots={"hidden_units": 32, "head": head})
    settings = replace(settings, imitation_episodes=16, imitation_epochs=40)
    training = begun(settings, imitate="sweep")
    before = off_course(training)
    for _ in range(settings.imitation_rounds):
        training.learn([e for job in training.jobs() for e in play(job)])
    after = off_course(training)
    assert len(after) == len(before) > 60
    assert (after < 1).float().mean() > (before < 1).float().mean() + 0.15
    assert after.mean() < 0.75 * before.mean()


def test_the_teacher_plays_first_then_its_pupil_and_the_teacher_says_what_it_would():
    """So the copy learns what to do where it gets by itself (DAgger)."""
    training = begun(imitate="sweep")
    asked = []
    side = "robots", building_of(TINY), training.settings.scenario
    moment = after_8_s(training.settings.scenario)
    while not training.imitated:
        asked.append(training.jobs()[0].robots.player(*side).act([moment]))
        (alone, _) = player_of(training.learners["robots"]).player(*side).act([moment])
        training.learn([e for job in training.jobs() for e in play(job)])
    (teachers, (said,)), (pupils, (still_said,)) = asked
    assert all(np.array_equal(said[name], still_said[name]) for name in said)
    assert np.array_equal(pupils, alone)
    assert not np.array_equal(pupils, teachers, equal_nan=True)


def test_each_episode_of_a_job_has_a_guide_of_its_own():
    """What one remembers, and its random numbers, reach no other."""
    training = begun(imitate="patrol")
    job = training.jobs()[0]
    (one,) = play(replace(job, seeds=(1,)))
    (other,) = play(replace(job, seeds=(2,)))
    both = play(replace(job, seeds=(1, 2)))
    for alone, beside in zip((one, other), both, strict=True):
        assert np.array_equal(alone.robots.actions, beside.robots.actions)


def test_no_evacuation_is_demonstrated_twice_or_learned_from_again():
    """Each round of copying, and the first that learns, has seeds of its own."""
    training = begun(imitate="sweep")
    seeds = []
    for _ in range(training.settings.imitation_rounds + 1):
        jobs = training.jobs()
        seeds += [seed for job in jobs for seed in job.seeds]
        training.learn([e for job in jobs for e in play(job)])
    assert len({*seeds}) == len(seeds) == 6


@pytest.mark.paper("E1", "chosen")
@pytest.mark.parametrize("imitates", [True, False])
def test_the_critic_of_a_policy_made_elsewhere_learns_alone_at_first(imitates):
    """A copy, or of another training: a critic that knows nothing would undo it."""
    settings = replace(tiny(), critic_rounds=1, imitation_rounds=1)
    if imitates:
        training = begun(settings, imitate="sweep")
        training.learn([e for job in training.jobs() for e in play(job)])
    else:
        theirs = begun(settings, seed=1).learners["robots"]
        given = LearnedNetwork(theirs.settings, theirs.actor.state_dict())
        training = begun(settings, initial={"robots": given})
    robots = training.learners["robots"]
    for moves in (False, True):
        policy, critic = weights(robots)
        training.learn([e for job in training.jobs() for e in play(job)])
        now, critic_now = weights(robots)
        assert torch.equal(policy, now) != moves
        assert not torch.equal(critic, critic_now)


@pytest.mark.paper("E1", "chosen")
def test_the_critic_learns_alone_for_an_update_even_where_that_takes_rounds():
    """A buffer of more steps than a round has, and one critic round."""
    theirs = begun(seed=1).learners["robots"]
    given = LearnedNetwork(theirs.settings, theirs.actor.state_dict())
    settings = replace(tiny(robots={"buffer_size": 100}), critic_rounds=1)
    training = begun(settings, initial={"robots": given})
    robots = training.learners["robots"]
    policy, critic = weights(robots)
    while torch.equal(critic, weights(robots)[1]):
        training.learn([e for job in training.jobs() for e in play(job)])
    assert training.round > settings.critic_rounds
    assert torch.equal(policy, weights(robots)[0])


def test_robots_imitate_under_the_fires_that_they_then_learn_under():
    """One that learns, and those that stand in for it."""
    training = begun(replace(tiny(), random_fires=0.5), imitate="sweep")
    before = {type(job.fire) for job in training.jobs()}
    assert not any(job.scenario.training for job in training.jobs())  # [D6]
    while not training.imitated:
        training.learn([e for job in training.jobs() for e in play(job)])
    assert before == {type(job.fire) for job in training.jobs()}
    assert before == {RandomFire, LearnedNetwork}


@pytest.mark.paper("C5", "chosen")
def test_a_mixture_is_taught_the_point_that_the_teacher_means():
    """In units from the robot: a new one, the one it is headed to, or its own place."""
    settings = tiny(robots={"head": "mixture", "masks": False})
    teacher = Demonstration(settings.robots, {}, "patrol").player(
        "robots", building_of(TINY), settings.scenario
    )
    moment = after_8_s(settings.scenario)
    under_way = ~np.isnan(robot_destinations(moment.world)[:, 0])
    assert under_way.any()
    nothing_new = np.full((len(moment.alive), 2), np.nan, dtype=np.float32)
    (seen,) = teacher.codec.read([moment])
    (grid,) = teacher.codec.grids([moment])
    told = teacher._recorded(moment, nothing_new, seen, grid)
    K = teacher.codec.anchors
    anchors = seen[:, : 2 * K].reshape(-1, K, 2)
    keep = anchors[:, KEEP]
    stay = anchors[:, WAIT]
    assert np.allclose(told["actions"], np.where(under_way[:, None], keep, stay))
    assert told["alive"].all() and not stay.any()
    going = from_normalised(teacher.codec.building, robot_destinations(moment.world))
    told = teacher._recorded(moment, going, seen, grid)
    assert np.allclose(told["actions"], keep) and told["alive"][under_way].all()


def asked(head):
    """A teacher of this head, what it sees and the moment."""
    settings = tiny(robots={"head": head})
    teacher = Demonstration(settings.robots, {}, "sweep").player(
        "robots", building_of(TINY), settings.scenario
    )
    moment = after_8_s(settings.scenario)
    (seen,) = teacher.codec.read([moment])
    (grid,) = teacher.codec.grids([moment])
    return teacher, moment, seen, grid


@pytest.mark.paper("C5", "chosen")
def test_a_gaussian_of_the_floor_is_taught_the_metres_that_the_teacher_means():
    """It cannot keep a destination: such decisions teach it nothing."""
    teacher, moment, seen, grid = asked("floor")
    wanted = np.full((len(moment.alive), 2), (3.5, -1.5))
    wanted[0] = np.nan
    told = teacher._recorded(moment, wanted, seen, grid)
    assert told["alive"].tolist() == [False] + [True] * (len(wanted) - 1)
    metres = teacher.codec.actions(told["actions"], moment.vectors)
    assert np.allclose(metres[1:], wanted[1:], atol=1e-3)


@pytest.mark.paper("C5", "chosen")
def test_a_mixture_is_not_taught_what_is_near_no_anchor():
    """A metre beside one it is taught, nine it is not."""
    teacher, moment, seen, grid = asked("mixture")
    here = np.array([robot.position for robot in moment.world.robots])
    east = np.array([1.0, 0.0])
    for metres, learns in ((1.0, True), (40.0, False)):
        told = teacher._recorded(moment, here + metres * east, seen, grid)
        assert (told["alive"] == learns).all()


@pytest.mark.paper("E4")
def test_normalisers_see_what_is_demonstrated():
    """Each decision once, before the fit."""
    training = begun(imitate="sweep")
    demonstrations = [e.robots for job in training.jobs() for e in play(job)]
    learner = training.learners["robots"]
    before = float(learner.actor.body.encoder.normaliser.count)
    clone(learner, demonstrations, 1)
    shown = sum(int(each.alive[:-1].sum()) for each in demonstrations)
    assert float(learner.actor.body.encoder.normaliser.count) == before + shown
