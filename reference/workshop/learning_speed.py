"""How fast it learns: samples a learner takes in, decisions a rollout makes.

Clauses: E1, E2, E3.  Sizes are the paper's: 167 numbers and 9 x 40 x 40 cells, three
layers of 256, six robots, minibatches of about 1024 decisions.

    N  group decisions of a buffer;  G  agents
"""

from dataclasses import replace
from time import perf_counter

import torch

from reference.building import Building
from reference.floorplan import to_text
from reference.learning import poca, ppo
from reference.learning.experience import Decisions
from reference.learning.networks import one_thread
from reference.learning.rollouts import Job, Learned, Player, play
from reference.learning.settings import SIDES, Side
from reference.workshop.landmarks import landmarks_for
from reference.workshop.training.presets import preset

BATCHES = 4  # minibatches of a measured update
EPISODES = 8  # in lockstep, in one process with one thread


def learner_samples_per_second(building: Building, seed: int) -> dict[str, float]:
    """Agent-decisions that one epoch takes in per second, on all cores."""
    return {
        "poca": _samples_per_second("robots", building, seed),
        "ppo": _samples_per_second("fire", building, seed),
    }


def decisions_per_second(building: Building, seed: int) -> float:
    """Robot decisions of rollouts per second and core: both sides act by networks.

    The world, the observations and the networks; new ones, which are in no hurry to
    end an episode.
    """
    sides = {}
    for side in SIDES:
        learner = _learner(side, building, seed)
        sides[side] = Learned(
            learner.settings,
            learner.actor.state_dict(),
            landmarks_for(side, learner.settings),
        )
    seeds = tuple(range(seed, seed + EPISODES))
    scenario = preset("paper").scenario
    job = Job(to_text(building.plan), scenario, **sides, seeds=seeds)
    with one_thread():
        play(replace(job, seeds=seeds[:1]))  # warm up
        start = perf_counter()
        played = play(job)
        seconds = perf_counter() - start
    return sum(e.robots.steps for e in played if e.robots) / seconds


def _samples_per_second(side: Side, building: Building, seed: int) -> float:
    learner = _learner(side, building, seed)
    trainer = learner.settings
    team = preset("paper").scenario.robots_per_floor * building.floors
    agents = team if side == "robots" else 1
    made_up = _decisions(learner, BATCHES * trainer.batch_size // agents + 1, agents)
    seconds = []
    for _ in range(2):  # the first one warms up
        learner.buffer.add(made_up)
        start = perf_counter()
        learner.update()
        seconds.append(perf_counter() - start)
    return BATCHES * trainer.batch_size * trainer.num_epoch / seconds[-1]


def _learner(side: Side, building: Building, seed: int) -> ppo.Learner:
    """A new one of the paper's."""
    settings = preset("paper")
    trainer = getattr(settings, side)
    sizes = Player(
        side, building, settings.scenario, trainer, landmarks_for(side, trainer)
    ).sizes
    return poca.LEARNERS[trainer.trainer_type](trainer, sizes, seed)


def _decisions(learner: ppo.Learner, N: int, G: int) -> Decisions:
    """Made-up experience of the right shapes; everybody is there."""
    sizes, rng = learner.sizes, learner.rng

    def normal(*shape: int) -> torch.Tensor:
        return torch.randn(*shape, generator=rng)

    actions = normal(N, G, sizes.continuous + len(sizes.branches))
    actions[..., sizes.continuous :] = 0.0  # the first option of each branch
    unknown = normal(4, N, G)
    return Decisions(
        vectors=normal(N, G, sizes.vector),
        grids=(normal(N, *sizes.grid) > 1).to(torch.uint8),
        alive=torch.ones(N, G, dtype=torch.bool),
        actions=actions,
        shown=normal(N, G, sizes.shown),
        log_probs=torch.full(actions.shape, -1.0),
        values=unknown[0],
        baselines=unknown[1],
        returns=unknown[2],
        advantages=unknown[3],
    )
