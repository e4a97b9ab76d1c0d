"""Imitation: robots that copied a strategy go where it would have gone."""

from dataclasses import replace

import numpy as np
import pytest
from trainings import TINY, begun, tiny

from reference.building import building_of
from reference.game.environment import destination
from reference.game.interface import Moment
from reference.game.observations import headed, robot_vectors, to_normalised
from reference.learning.adversarial import player_of
from reference.learning.rollouts import play
from reference.simulation import Simulation
from reference.strategies import RandomFire
from reference.workshop.frame import KEEP, STAY
from reference.workshop.strategies.robots import GROUP_RADIUS, Sweep
from reference.workshop.training.imitation import Demonstration


class Observed(Sweep):
    """`sweep`, and how far from each destination a player would most likely go.

    Where an option is near it: the player is not offered a way out if it leads nobody.
    """

    def __init__(self, player):
        super().__init__()
        self.player, self.metres = player, []

    def decide(self, world, robots, rng):
        """As always; the player sees the same."""
        decided = super().decide(world, robots, rng)
        vectors = robot_vectors(world, self.player.interface.scenario)
        everybody = np.ones(len(vectors), dtype=bool)
        moment = Moment(vectors, everybody, world)
        (emitted,), _ = self.player.act([moment])
        (seen,) = self.player.read([moment])
        row = {robot.body: k for k, robot in enumerate(world.robots)}
        for robot, spot in zip(robots, decided, strict=True):
            if spot is None:
                continue
            k, interface = row[robot.body], self.player.interface
            aim = to_normalised(world.building, np.array([spot]))
            raw = interface.raw(aim, vectors[k : k + 1])
            if interface.off_anchors(raw, seen[k : k + 1]) <= GROUP_RADIUS:
                end = destination(world.building, emitted[k])
                self.metres.append(float(np.hypot(*np.subtract(spot, end))))
        return decided


def off_course(training):
    """Metres from where `sweep` goes to where the robots would, time by time."""
    learner, scenario = training.learners["robots"], training.settings.scenario
    learned = player_of(learner)
    building = building_of(TINY)
    guide = Observed(learned.player("robots", building, scenario))
    for seed in range(1, 5):
        Simulation(building, scenario, guide, RandomFire(), seed).run()
    return np.array(guide.metres)


@pytest.mark.paper("C7", "chosen")
@pytest.mark.paper("E1", "chosen")
def test_robots_that_copied_sweep_go_where_it_would():
    """In evacuations that they have not seen; they did not before."""
    settings = tiny(robots={"hidden_units": 32})
    settings = replace(settings, imitation_episodes=32, imitation_epochs=100)
    training = begun(settings, imitate="sweep")
    before = off_course(training)
    training.learn([e for job in training.jobs() for e in play(job)])
    after = off_course(training)
    assert len(after) == len(before) > 60
    assert np.mean(after < 1) > np.mean(before < 1) + 0.15
    assert after.mean() < 0.75 * before.mean()


@pytest.mark.paper("C5", "chosen")
def test_a_mixture_is_taught_the_point_that_the_teacher_means():
    """In units from the robot: a new one, the one it is headed to, or its own place."""
    settings = tiny(robots={"head": "mixture", "masks": False})
    teacher = Demonstration(settings.robots, {}, "patrol").player(
        "robots", building_of(TINY), settings.scenario
    )
    sim = Simulation(building_of(TINY), settings.scenario, Sweep(), RandomFire(), 1)
    for _ in range(40):
        sim.step()
    vectors = robot_vectors(sim.world, sim.scenario)
    moment = Moment(vectors, np.ones(len(vectors), dtype=bool), sim.world)
    under_way = ~np.isnan(headed(sim.world)[:, 0])
    assert under_way.any()
    nothing_new = np.full((len(vectors), 2), np.nan, dtype=np.float32)
    told = teacher._recorded(moment, nothing_new)
    (seen,), K = teacher.read([moment]), teacher.interface.anchors
    anchors = seen[:, : 2 * K].reshape(-1, K, 2)
    keep, stay = anchors[:, KEEP], anchors[:, STAY]
    assert np.allclose(told["actions"], np.where(under_way[:, None], keep, stay))
    assert told["alive"].all() and not stay.any()
    told = teacher._recorded(moment, headed(sim.world))
    assert np.allclose(told["actions"], keep) and told["alive"][under_way].all()
