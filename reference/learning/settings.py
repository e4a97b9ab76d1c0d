"""How one side learns: a row of Table I or II for each setting.

Clauses: E1, E2 (Tables I and II), E3 (what a row means), E4 (networks), E5 (discounts).
Rows have ML-Agents' names where it has them.
"""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from typing import Any, Literal, get_args, get_origin, get_type_hints

Side = Literal["robots", "fire"]
SIDES: tuple[Side, ...] = ("robots", "fire")

Rows = Mapping[str, Any]

ATTENTION_HEADS = 4
"""[E3] of MA-POCA's critic: its width, `hidden_units`, is divided among them."""

REWARD_SCALE = 0.001
"""[E3, chosen] an episode is worth thousands of health points; returns of order one
are learnt, since the baseline's clip (epsilon) is in units of return."""


@dataclass(frozen=True)
class TrainerSettings:
    """One table: how one side learns. All but the last two rows are ML-Agents' keys.

    trainer_type     "poca" (a group) or "ppo" (everybody for themselves)
    batch_size       agent decisions of a minibatch;  buffer_size  of an update
    beta             weight of the entropy;  epsilon  clip;  lambd  of the returns
    num_epoch        times an update goes through the buffer
    vis_encode_type  "simple": two convolutions
    normalize        whether numbers observed are normalised; the grid never is
    gamma, strength  discount and weight of the reward
    max_steps        agent decisions in all; so are checkpoint_interval, summary_freq
    time_horizon     decisions of a trajectory, at most
    *_schedule       "linear", down to a floor at max_steps, or "constant"
    head             ours: "gaussian", the paper's two floats drawn from a Gaussian, or
                     "pointer": it scores landmarks, the floats are the chosen one's
    reward_scale     ours: what rewards are multiplied with before they are learnt
    """

    trainer_type: str
    batch_size: int
    buffer_size: int
    learning_rate: float
    learning_rate_schedule: str
    beta: float
    beta_schedule: str
    epsilon: float
    epsilon_schedule: str
    lambd: float
    num_epoch: int
    vis_encode_type: str
    normalize: bool
    hidden_units: int
    num_layers: int
    gamma: float
    strength: float
    keep_checkpoints: int
    checkpoint_interval: int
    max_steps: int
    time_horizon: int
    summary_freq: int
    head: str = "gaussian"
    reward_scale: float = REWARD_SCALE

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


class SettingsError(ValueError):
    """A setting that cannot be meant: which, why, and what to write instead."""


# -- What each row may be -----------------------------------------------------------

CHOICES = {
    "trainer_type": ("poca", "ppo"),
    "learning_rate_schedule": ("linear", "constant"),
    "beta_schedule": ("linear", "constant"),
    "epsilon_schedule": ("linear", "constant"),
    "vis_encode_type": ("simple",),
    "head": ("gaussian", "pointer"),
    "schedule": ("together", "alternate"),
}
POSITIVE = ("learning_rate", "epsilon", "reward_scale")  # with 0 nothing is learnt
FROM_ZERO = (  # others: from 1
    "beta",
    "lambd",
    "gamma",
    "strength",
    "critic_rounds",
    "random_fires",
)
UP_TO_ONE = ("learning_rate", "beta", "epsilon", "lambd", "gamma", "random_fires")

WORDS: dict[Any, str] = {
    int: "a whole number",
    float: "a number",
    bool: "true or false",
    str: "a word",
    tuple[str, ...]: "a list of words",
    tuple[int, ...] | None: "a list of whole numbers",
}


def check_rows(record: object) -> None:
    """Raises SettingsError for the first row of a wrong type or out of its range."""
    for name, kind in get_type_hints(type(record)).items():
        value = getattr(record, name)
        check_type(name, value, kind)
        if name in CHOICES and value not in CHOICES[name]:
            raise SettingsError(f"{name} {unknown(value, CHOICES[name])}")
        if kind in (int, float):
            _check_range(name, value, kind)


def check_type(name: str, value: object, kind: Any) -> None:
    if not _fits(value, kind):
        words = WORDS.get(kind) or f"a {kind.__name__}"
        raise SettingsError(f"{name} is {value!r}: it must be {words}")


def _fits(value: object, kind: Any) -> bool:
    """Whether a value is of a kind: a whole number is a real one, true is neither."""
    if get_origin(kind) is tuple:
        items = value if isinstance(value, tuple) else (None,)
        return all(_fits(item, get_args(kind)[0]) for item in items)
    if get_args(kind):  # this or that
        return any(_fits(value, either) for either in get_args(kind))
    if kind is float and isinstance(value, float):
        return math.isfinite(value)
    number = int if kind is float else kind
    return isinstance(value, number) and (kind is bool) == isinstance(value, bool)


def _check_range(name: str, value: float, kind: type) -> None:
    low, high = int(name not in POSITIVE + FROM_ZERO), 1 if name in UP_TO_ONE else None
    inside = value > 0 if name in POSITIVE else value >= low
    if not inside or (high is not None and value > high):
        start = "above 0" if name in POSITIVE else f"from {low}"
        limits = f"{start} upwards" if high is None else f"{start} up to {high}"
        raise SettingsError(f"{name} is {value}: it must be {WORDS[kind]} {limits}")


def unknown(name: object, known: Iterable[str]) -> str:
    """The message about a name that is none of the known ones."""
    known = tuple(known)
    close = get_close_matches(str(name).lower(), known, 1)
    meant = f" Did you mean '{close[0]}'?" if close else ""
    return f"'{name}' is unknown.{meant} There is: {', '.join(known)}"


def mapping(value: Any, where: str) -> dict[str, Any]:
    """The keys and values there; nothing at all stands for no keys."""
    if not isinstance(value, Mapping | None):
        raise SettingsError(f"{where}: this must be `key: value` lines, not {value!r}")
    return {str(key): row for key, row in (value or {}).items()}
