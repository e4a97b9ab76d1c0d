"""The fire that a learned critic values least.

Clauses: F4, E1, E2.  A critic predicts the reward of the robots that it learned with,
against the fires that it has seen.  It is cheap to ask and easy to fool: `gap`
re-scores what it says.

    B  placements
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import torch

from reference.fire import Decision
from reference.game.moments import Moment
from reference.game.observations import robot_vectors, robots_at_work
from reference.learning.networks import one_thread
from reference.learning.poca import LEARNERS, GroupCritic
from reference.learning.ppo import Critic
from reference.learning.settings import Side
from reference.navigation import navigation_of
from reference.strategies import RandomFire
from reference.workshop.evaluation.worst_case.placements import placements
from reference.workshop.training.checkpoints import CheckpointError, must_fit
from reference.workshop.training.policies import CheckpointLike, LearnedPolicy
from reference.world import Source, World


class CriticFire(LearnedPolicy):
    """A fire that breaks out where the robots' critic says it is worst [F4, chosen].

    For each placement it imagines the world with that source lit, as the robots would
    observe it, and takes the one of lowest value.
    """

    side: Side = "robots"

    def __init__(self, source: CheckpointLike):
        """Load the critic of a checkpoint's robots; it may attack other robots.

        Raises what `LearnedPolicy` raises, also where the robots did not learn.
        """
        super().__init__(source)
        self.critic = critic_of(self)

    def decide(self, world: World, rng: np.random.Generator) -> Decision | None:
        """Take the placement of lowest value; a random cell if nobody is inside."""
        self._check_fits(world)
        choice = placements(world)
        if not choice:
            return RandomFire().decide(world, rng)
        return choice[int(self.values(world, choice).argmin())]

    def values(self, world: World, choice: Sequence[Decision]) -> np.ndarray:
        """Estimate the discounted reward after each placement: (B,) health points.

        One call of the network does all.
        """
        at_work = robots_at_work(world)
        worlds = [imagined(world, decision) for decision in choice]
        moments = [
            Moment.of(each, robot_vectors(each, self.scenario), at_work)
            for each in worlds
        ]
        seen = [self.player.seen(moment) for moment in moments]
        vectors = torch.from_numpy(np.stack(seen))
        grids = torch.from_numpy(np.stack([moment.grid for moment in moments]))
        there = torch.from_numpy(np.tile(at_work, (len(choice), 1)))
        with one_thread(), torch.no_grad():
            if isinstance(self.critic, GroupCritic):
                value = self.critic(vectors, grids, there)
            else:  # PPO's critic values the group's reward as each robot sees it
                each = self.critic(vectors, grids) * there
                value = each.sum(dim=1) / there.sum(dim=1).clamp(min=1)
        s = self.learned.settings
        return np.asarray(value.numpy() / (s.strength * s.reward_scale))


def critic_of(robots: LearnedPolicy) -> Critic | GroupCritic:
    """Load the critic that robots learned with. Raises CheckpointError without one."""
    learners = robots.checkpoint.learners
    if "robots" not in learners:
        raise CheckpointError(
            "there is no robots' critic in this checkpoint: only the fire learned. "
            "Name the checkpoint of its robots."
        )
    settings = robots.learned.settings
    learner = LEARNERS[settings.trainer_type](settings, robots.player.sizes, seed=0)
    critic = learner.critic.eval()
    with must_fit("critic is not of the shape its settings tell"):
        critic.load_state_dict(learners["robots"]["critic"])
    return critic


def imagined(world: World, decision: Decision) -> World:
    """Copy the world with one more source, already burning; share the rest."""
    floor, x, y = decision
    flames = world.flames
    burning = flames.burning.copy()
    burning.ravel()[navigation_of(world.building).place(floor, x, y)] = True
    sources = [*flames.sources, Source(floor, x, y, world.time)]
    return replace(world, flames=replace(flames, burning=burning, sources=sources))
