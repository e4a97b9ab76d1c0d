"""Trainer settings of one side: Table I for the robots, Table II for the fire.

A row has its name in ML-Agents; its value stands in `paper`, or in one of the smaller
presets.
"""

from dataclasses import dataclass
from typing import Literal, TypeVar

from reference.building import Building
from reference.game.codec import PolicyCodec
from reference.paper import Scenario

Network = TypeVar("Network")

Side = Literal["robots", "fire"]
SIDES: tuple[Side, ...] = ("robots", "fire")

ATTENTION_HEADS = 4  # [E3, torch/attention.py] `hidden_units` is divided among them

REWARD_SCALE = 0.001
"""[E4, deviation] an episode is worth thousands of health points; scaled returns are of
order one. MA-POCA's baseline is clipped by epsilon, 0.2, in units of return."""


@dataclass(frozen=True)
class TrainerSettings:
    """One side's table [E1] [E2], and our scale; a step is one agent's decision."""

    trainer_type: str  # "poca", a group, or "ppo", each alone
    batch_size: int  # steps of a minibatch
    buffer_size: int  # steps: once more of them wait, an update uses all
    learning_rate: float
    learning_rate_schedule: str  # "linear", to a floor at max_steps, or "constant"
    beta: float  # weight of the entropy
    beta_schedule: str
    epsilon: float  # clip
    epsilon_schedule: str
    lambd: float  # λ: of PPO's GAE, of MA-POCA's λ-returns
    num_epoch: int  # times an update goes through the buffer
    vis_encode_type: str  # "simple": two convolutions
    normalize: bool  # the numbers observed; the grid never is
    hidden_units: int
    num_layers: int
    gamma: float  # discount [E5]
    strength: float  # weight of the reward
    keep_checkpoints: int
    checkpoint_interval: int  # steps
    max_steps: int
    time_horizon: int  # decisions of one agent's segment, at most: see `segments`
    summary_freq: int  # steps
    reward_scale: float = REWARD_SCALE

    def codec(self, side: Side, building: Building, scenario: Scenario) -> PolicyCodec:
        """Make the codec of this side's networks: the paper's."""
        return PolicyCodec(side, building, scenario)

    def network(self, kind: type[Network]) -> type[Network]:
        """Return the class of network to build; subclasses of this return others."""
        return kind
