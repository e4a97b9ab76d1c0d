"""The fire that a critic chooses: the placement it values least, all asked at once."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from movies import robots_named, shipped, wait
from trainings import begun, tiny

from reference.game.moments import Moment
from reference.game.observations import grid, robot_vectors
from reference.simulation import Simulation
from reference.strategies import RandomFire
from reference.workshop.decoding import decode
from reference.workshop.evaluation.worst_case import placements
from reference.workshop.evaluation.worst_case.critic import CriticFire, imagined
from reference.workshop.strategies.robots import Sweep
from reference.workshop.training.checkpoints import CheckpointError

TRAINERS = ["poca", "ppo"]


def fire(trainer="poca", **task):
    """A critic that has learned nothing yet, of robots in the tiny building."""
    settings = tiny(robots={"trainer_type": trainer})
    return CriticFire(begun(settings, **task).checkpoint())


def moment(fire, seconds=12, robots="sweep"):
    """An evacuation of the tiny building after some seconds."""
    scenario = replace(fire.scenario_to_evaluate(), time_limit=60.0)
    sim = Simulation(
        shipped("tiny"), scenario, robots_named(robots), RandomFire(), seed=1
    )
    wait(sim, seconds)
    return sim


@pytest.mark.paper("F4", "chosen")
@pytest.mark.parametrize("trainer", TRAINERS)
def test_it_takes_the_placement_of_lowest_value(trainer):
    """Of all that there are."""
    critic = fire(trainer)
    world = moment(critic).world
    choice = placements(world, critic.scenario)
    values = critic.values(world, choice)
    assert len(choice) > 5 and len(set(values.tolist())) > 1
    decision = critic.decide(world, np.random.default_rng(0))
    assert decision == choice[values.argmin()]


@pytest.mark.paper("F4", "chosen")
@pytest.mark.parametrize("trainer", TRAINERS)
def test_placements_are_valued_together_as_they_are_alone(trainer):
    """One call of the network for all of them."""
    critic = fire(trainer)
    world = moment(critic).world
    choice = placements(world, critic.scenario)
    alone = [critic.values(world, [decision])[0] for decision in choice]
    np.testing.assert_allclose(critic.values(world, choice), alone, rtol=1e-4)


def test_a_value_is_what_the_learners_own_critic_says():
    """In health points: reward_scale is taken back."""
    training = begun(tiny())
    critic, learner = CriticFire(training.checkpoint()), training.learners["robots"]
    world = moment(critic).world
    decision = placements(world, critic.scenario)[0]
    lit = imagined(world, decision)
    everybody = np.ones(len(world.robots), dtype=bool)
    seen = Moment.of(lit, robot_vectors(lit, critic.scenario), everybody)
    with torch.no_grad():
        value = learner.critic(
            torch.from_numpy(critic.player.seen(seen))[None],
            torch.from_numpy(seen.grid)[None],
            torch.ones(1, len(world.robots), dtype=torch.bool),
        )
    told = critic.values(world, [decision])
    assert told == pytest.approx(value.numpy() / learner.reward_scale, rel=1e-4)


def test_the_source_is_imagined_where_robots_would_see_it():
    """In their vectors and in the grid; the world itself stays as it is."""
    critic = fire()
    world = moment(critic).world
    before = grid(world), len(world.flames.sources)
    decision = placements(world, critic.scenario)[0]
    lit = imagined(world, decision)
    seen = robot_vectors(lit, critic.scenario)[0]
    scene = decode(seen, world.building, critic.scenario)
    floor, x, y = decision
    assert scene.fires[before[1]].tolist() == [x, y, floor]
    assert (grid(lit) != before[0]).sum() == 1
    assert np.array_equal(grid(world), before[0])
    assert len(world.flames.sources) == before[1]


def test_it_plays_whole_evacuations():
    """As any fire: same seed, same sources."""
    critic = fire()
    runs = [
        Simulation(
            shipped("tiny"), critic.scenario_to_evaluate(), Sweep(), critic, seed=3
        )
        for _ in range(2)
    ]
    for run in runs:
        run.run()
    sources = [run.world.flames.sources for run in runs]
    assert sources[0] == sources[1] and len(sources[0]) >= 2


def test_with_nobody_inside_it_burns_anywhere():
    """There is no worst placement any more."""
    critic = fire()
    sim = moment(critic)
    sim.world.bodies.fate[:] = 1
    sim.world.occupancy = [0, 0]
    assert critic.decide(sim.world, np.random.default_rng(0))[0] in (0, 1)


def test_refuses_a_checkpoint_whose_robots_did_not_learn():
    """They have no critic; whose checkpoint does is said."""
    with pytest.raises(CheckpointError, match="nobody learned for the robots"):
        fire(fixed={"robots": "sweep"})
    fixed = begun(tiny()).checkpoint().player("robots")
    with pytest.raises(CheckpointError, match="there is no robots' critic"):
        fire(fixed={"robots": fixed})


def test_refuses_a_building_without_robots():
    """Their critic has nothing to go by there."""
    critic = fire()
    with pytest.raises(CheckpointError, match="learned with 4 robots; here it is 0"):
        critic.decide(moment(critic, robots="none").world, np.random.default_rng(0))


def test_refuses_a_critic_of_another_shape():
    """A damaged file says so instead of a traceback of torch."""
    checkpoint = begun(tiny()).checkpoint()
    del checkpoint.learners["robots"]["critic"]["value.weight"]
    with pytest.raises(CheckpointError, match="critic is not of the shape"):
        CriticFire(checkpoint)
