"""Trainer settings of one side: Table I for the robots, Table II for the fire.

Clauses: E1, E2 (Tables I and II), E3 (what a row means), E4 (networks), E5 (γ).
A row here has its name in ML-Agents, its type, its section in ML-Agents' files, and its
allowed values; its value stands in `paper`, or in one of the smaller presets.
"""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from typing import Annotated, Any, Literal, NamedTuple, get_type_hints

from reference.building import Building
from reference.game.interface import Interface
from reference.paper import InputError, Scenario

Side = Literal["robots", "fire"]
SIDES: tuple[Side, ...] = ("robots", "fire")

Rows = Mapping[str, Any]

ATTENTION_HEADS = 4
"""[E3] of MA-POCA's critic: its width, `hidden_units`, is divided among them."""

REWARD_SCALE = 0.001
"""[E3, chosen] an episode is worth thousands of health points; scaled returns are of
order one, since the baseline's clip (epsilon) is in units of return."""

HYPER, NETWORK = ("hyperparameters",), ("network_settings",)
REWARD = ("reward_signals", "extrinsic")
ABOVE_0 = math.ulp(0.0)  # the smallest number above 0
LARGEST = 2.0**64  # limit of numbers in files: larger ones would overflow


class Row(NamedTuple):
    """Allowed values of a setting: one of the choices, or a number from low to high.

    section  in ML-Agents' files; () the behaviour itself, None: a setting of our own
    """

    section: tuple[str, ...] | None = ()
    choices: tuple[str, ...] = ()
    low: float = 1
    high: float = math.inf
    kind: Any = None


Share = Annotated[float, Row(HYPER, low=0, high=1)]
Schedule = Annotated[str, Row(HYPER, ("linear", "constant"))]  # to a floor at max_steps


@dataclass(frozen=True)
class TrainerSettings:
    """One side's table; a step is one agent's decision. Raises SettingsError.

    reward_scale  ours: factor on rewards before anything is learned from them
    """

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
    hidden_units: Annotated[int, Row(NETWORK)]
    num_layers: Annotated[int, Row(NETWORK)]
    gamma: Annotated[float, Row(REWARD, low=0, high=1)]  # discount
    strength: Annotated[float, Row(REWARD, low=0)]  # weight of the reward
    keep_checkpoints: int
    checkpoint_interval: int  # steps
    max_steps: int
    time_horizon: int  # decisions of a trajectory, at most
    summary_freq: int  # steps
    reward_scale: Annotated[float, Row(None, low=ABOVE_0)] = REWARD_SCALE

    def __post_init__(self) -> None:
        check_rows(self)
        if self.buffer_size < self.batch_size:
            raise SettingsError(
                f"buffer_size {self.buffer_size} holds no minibatch of batch_size "
                f"{self.batch_size}: make it a few times as large"
            )
        if self.trainer_type == "poca" and self.hidden_units % ATTENTION_HEADS:
            raise SettingsError(
                f"hidden_units {self.hidden_units} cannot be shared among the "
                f"{ATTENTION_HEADS} attention heads of poca: take a multiple of them"
            )

    def interface(
        self, side: Side, building: Building, scenario: Scenario
    ) -> Interface:
        """How this side's networks read and speak: as the paper does."""
        return Interface(side, building, scenario)

    def extra_reward(self, gone: int, time: float, seconds: float) -> float:
        """A reward beside the game's; the paper has none.

        gone: people who left or died during a decision of so many seconds that began
        at `time`.
        """
        return 0.0


class SettingsError(InputError):
    """A setting with an impossible value: which, why, and what to write instead."""


# -- Checks -------------------------------------------------------------------------

WORDS = {int: "a whole number", float: "a number", bool: "true or false", str: "a word"}


def rows_of(record: type) -> dict[str, Row]:
    """The rows of a dataclass by name; a field without a `Row` has the defaults."""
    rows = {}
    for name, hint in get_type_hints(record, include_extras=True).items():
        (row,) = getattr(hint, "__metadata__", (Row(),))
        kind = hint.__origin__ if hasattr(hint, "__metadata__") else hint
        rows[name] = row._replace(kind=kind)
    return rows


def check_rows(record: object) -> None:
    """Raises SettingsError for the first row of a wrong type or out of its range."""
    for name, row in rows_of(type(record)).items():
        value = getattr(record, name)
        check_type(name, value, row.kind)
        if row.choices and value not in row.choices:
            raise SettingsError(f"{name} {unknown(value, row.choices)}")
        if row.kind in (int, float) and not row.low <= value <= row.high:
            start = "above 0" if row.low == ABOVE_0 else f"from {row.low}"
            end = "upwards" if row.high == math.inf else f"up to {row.high}"
            must = f"it must be {WORDS[row.kind]} {start} {end}"
            raise SettingsError(f"{name} is {value}: {must}")


def check_type(name: str, value: object, kind: Any) -> None:
    """Raise SettingsError unless a value is of a kind; true and nan are not numbers.

    A whole number counts as a float too.
    """
    fits = isinstance(value, int | float if kind is float else kind)
    odd = isinstance(value, bool) != (kind is bool)
    absurd = isinstance(value, int | float) and not abs(value) <= LARGEST
    if not fits or odd or absurd:
        words = WORDS.get(kind) or f"a {kind.__name__}"
        words += f" up to {LARGEST:g}" * (fits and not odd)
        raise SettingsError(f"{name} is {value!r:.60}: it must be {words}")


def unknown(name: object, known: Iterable[str]) -> str:
    """Say that a name is none of the known ones, and which may be meant."""
    known = tuple(known)
    return (
        f"'{name}' is unknown.{did_you_mean(name, known)} There is: {', '.join(known)}"
    )


def did_you_mean(name: object, known: Iterable[str]) -> str:
    """Suggest the closest known name in a question; empty where none is close."""
    close = get_close_matches(str(name).lower(), list(known), 1, cutoff=0.5)
    return f" Did you mean '{close[0]}'?" if close else ""
