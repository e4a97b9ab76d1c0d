"""Trainer settings of one side: Table I for the robots, Table II for the fire.

A row here has its name in ML-Agents, its type, its section in ML-Agents' files, and its
allowed values; its value stands in `paper`, or in one of the smaller presets.
"""

import math
from dataclasses import dataclass
from typing import Annotated, Any, Literal, NamedTuple

from reference.building import Building
from reference.game.codec import PolicyCodec
from reference.paper import Scenario

Side = Literal["robots", "fire"]
SIDES: tuple[Side, ...] = ("robots", "fire")

ATTENTION_HEADS = 4  # [E3, torch/attention.py] `hidden_units` is divided among them

REWARD_SCALE = 0.001
"""[E4, deviation] an episode is worth thousands of health points; scaled returns are of
order one, since the baseline's clip (epsilon) is in units of return."""

HYPER = ("hyperparameters",)
NETWORK = ("network_settings",)
REWARD = ("reward_signals", "extrinsic")
ABOVE_0 = math.ulp(0.0)  # the smallest number above 0


class Row(NamedTuple):
    """Allowed values of a setting: one of the choices, or a number from low to high."""

    section: tuple[str, ...] | None = ()  # in ML-Agents' files; (): top; None: ours
    choices: tuple[str, ...] = ()
    low: float = 1
    high: float = math.inf
    kind: Any = None


Share = Annotated[float, Row(HYPER, low=0, high=1)]
Schedule = Annotated[str, Row(HYPER, ("linear", "constant"))]  # to a floor at max_steps


@dataclass(frozen=True)
class TrainerSettings:
    """One side's table [E1] [E2], and our scale; a step is one agent's decision."""

    trainer_type: Annotated[str, Row((), ("poca", "ppo"))]  # a group, or each alone
    batch_size: Annotated[int, Row(HYPER)]  # steps of a minibatch ...
    buffer_size: Annotated[int, Row(HYPER)]  # ... and of an update
    learning_rate: Annotated[float, Row(HYPER, low=ABOVE_0, high=1)]
    learning_rate_schedule: Schedule
    beta: Share  # weight of the entropy
    beta_schedule: Schedule
    epsilon: Annotated[float, Row(HYPER, low=ABOVE_0, high=1)]  # clip
    epsilon_schedule: Schedule
    lambd: Share  # of the λ-returns
    num_epoch: Annotated[int, Row(HYPER)]  # times an update goes through the buffer
    vis_encode_type: Annotated[str, Row(NETWORK, ("simple",))]  # two convolutions
    normalize: Annotated[bool, Row(NETWORK)]  # the numbers observed; the grid never is
    hidden_units: Annotated[int, Row(NETWORK, high=2**13)]
    num_layers: Annotated[int, Row(NETWORK, high=2**5)]
    gamma: Annotated[float, Row(REWARD, low=0, high=1)]  # discount [E5]
    strength: Annotated[float, Row(REWARD, low=0)]  # weight of the reward
    keep_checkpoints: int
    checkpoint_interval: int  # steps
    max_steps: int
    time_horizon: int  # decisions of a trajectory, at most
    summary_freq: int  # steps
    reward_scale: Annotated[float, Row(None, low=ABOVE_0)] = REWARD_SCALE

    def codec(self, side: Side, building: Building, scenario: Scenario) -> PolicyCodec:
        """Make the codec of this side's networks: the paper's."""
        return PolicyCodec(side, building, scenario)
