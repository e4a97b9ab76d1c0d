"""The adversarial loop: robots and fire play whole episodes, then each learns.

It runs in one process and writes no files.  The workshop's training uses the same
functions and adds workers and checkpoints.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

from reference.building import building_of
from reference.fire import FireStrategy
from reference.game.environment import Advance, until_next_decision
from reference.learning.experience import Trajectory
from reference.learning.players import LearnedNetwork
from reference.learning.poca import LEARNERS
from reference.learning.ppo import Learner, Summary
from reference.learning.rollouts import Episode, Job, play
from reference.learning.settings import Side, TrainerSettings
from reference.paper import Scenario
from reference.robots import RobotStrategy


def adversarial_rounds(
    plan: str,
    scenario: Scenario,
    sides: Mapping[Side, Learner | LearnedNetwork | RobotStrategy | FireStrategy],
    rounds: Iterable[Sequence[int]],
    advance: Advance = until_next_decision,
) -> Iterator[list[Episode]]:
    """Play and learn, round after round; yield each round's episodes [E6].

    plan: the text of a floor file; sides: who plays "robots" and "fire"; a `Learner`
    also learns; rounds: the seeds of each round's episodes; advance: see `play`.
    """
    learners = {s: who for s, who in sides.items() if isinstance(who, Learner)}
    for seeds in rounds:
        # PLAY
        players: Any = dict(sides)
        players |= {side: player_of(learner) for side, learner in learners.items()}
        job = Job(plan, scenario, **players, seeds=tuple(seeds))
        episodes = play(job, advance)

        # LEARN
        for side, learner in learners.items():
            learn(side, learner, episodes)
        yield episodes


def learn(side: Side, learner: Learner, episodes: Sequence[Episode]) -> Summary:
    """Add a side's trajectories; if the buffer is full, update and summarise."""
    learner.add(trajectories_of(side, episodes))
    if learner.full:
        return learner.update()
    return {}


def trajectories_of(side: Side, episodes: Sequence[Episode]) -> list[Trajectory]:
    """Collect a side's trajectories, of episodes in which it was recorded."""
    trajectories = [getattr(episode, side) for episode in episodes]
    return [t for t in trajectories if t is not None]


def player_of(learner: Learner) -> LearnedNetwork:
    """Copy the learner's policy; later updates do not change the copy."""
    weights = {
        name: tensor.numpy().copy()
        for name, tensor in learner.actor.state_dict().items()
    }
    return LearnedNetwork(learner.settings, weights)


def learner_for(
    side: Side, plan: str, scenario: Scenario, settings: TrainerSettings, seed: int
) -> Learner:
    """Make a side's new learner; `trainer_type` says which [E1] [E2]."""
    sizes = settings.codec(side, building_of(plan), scenario).sizes
    return LEARNERS[settings.trainer_type](settings, sizes, seed)
