"""What a training is made of: both sides' settings, a scenario, and three presets.

Clauses: D6 (rule of training), E1, E2 (Tables I and II), E6 (both learn).  The tables'
numbers stand in `paper`; those of the smaller presets are chosen here.
"""

import dataclasses
import os
from collections.abc import Callable
from dataclasses import MISSING, dataclass, replace
from typing import Any, TypeVar, get_type_hints

from reference.learning.settings import (
    Rows,
    SettingsError,
    TrainerSettings,
    check_rows,
    check_type,
    mapping,
    unknown,
)
from reference.paper import TABLE_I, TABLE_II, Scenario
from reference.workshop.training import mlagents


@dataclass(frozen=True)
class Settings:
    """A whole training: both sides, what happens in the building, and in what order.

    episodes_per_job     episodes one worker plays in lockstep, network calls batched
    jobs_per_round       rollouts between two updates; it does not depend on the number
                         of workers, so that this number changes no result
    schedule             "together", or "alternate": one side, then the other, ...
    switch_every         ... each for so many rounds
    random_fires         share of the jobs in which random fire stands in for one that
                         learns: robots easily overfit to a single adversary
    imitation_episodes   if a strategy is imitated first: how many of its episodes,
    imitation_epochs     how many times through them, and for how many rounds after
    critic_rounds        that the critic alone learns what the imitator is worth
    """

    preset: str
    robots: TrainerSettings
    fire: TrainerSettings
    scenario: Scenario
    episodes_per_job: int
    jobs_per_round: int
    schedule: str = "together"
    switch_every: int = 5
    random_fires: float = 0.0
    imitation_episodes: int = 256
    imitation_epochs: int = 10
    critic_rounds: int = 5

    def __post_init__(self) -> None:
        check_rows(self)
        if self.fire.trainer_type != "ppo":
            raise SettingsError(
                "fire: trainer_type is 'poca', but there is one fire: a group of one "
                "has nobody to share credit with; write ppo, as Table II does"
            )
        if not self.scenario.training:
            raise SettingsError(
                "scenario: training is false, but rule D6 holds in training: an "
                "occupied place yields no fire; write true"
            )


# -- Records made of rows ------------------------------------------------------------

Record = TypeVar("Record", TrainerSettings, Settings, Scenario)


def _made(kind: type[Record], rows: Rows, where: str) -> Record:
    """A record whose rows are all known, all there, and such as can be meant."""
    rows = {name: _as_tuple(row) for name, row in mapping(rows, where).items()}
    try:
        _check_names(kind, rows)
        return kind(**rows)
    except ValueError as error:
        raise SettingsError(f"{where}: {error}") from None


def _check_names(kind: type[Record], rows: Rows) -> None:
    """Scenarios leave types to Python, so all are looked at here."""
    kinds = get_type_hints(kind)
    for name, row in rows.items():
        if name not in kinds:
            raise SettingsError(unknown(name, kinds))
        check_type(name, row, kinds[name])
    for field in dataclasses.fields(kind):
        missing = field.default is MISSING and field.default_factory is MISSING
        if missing and field.name not in rows:
            raise SettingsError(f"{field.name} is missing")


def _as_tuple(row: Any) -> Any:
    return tuple(row) if isinstance(row, list) else row


def _changed(base: Record, rows: Any, where: str) -> Record:
    """A record with some rows as a file states them."""
    kinds = get_type_hints(type(base))
    said = mapping(rows, where).items()
    unchanged = {name: getattr(base, name) for name in kinds}
    stated = {name: _number(row, kinds.get(name)) for name, row in said}
    return _made(type(base), {**unchanged, **stated}, where)


def _number(value: Any, kind: Any) -> Any:
    """[E3] YAML reads 1e-4 as a word and 5.0e5 as a real number; both are meant."""
    if kind not in (int, float) or not isinstance(value, str | float):
        return value
    try:
        real = float(value)
    except ValueError:
        return value
    return int(real) if kind is int and real.is_integer() else real


# -- Presets ------------------------------------------------------------------------


def preset(name: str) -> Settings:
    """The settings called `name`: tiny, laptop or paper. Raises SettingsError."""
    if name not in PRESETS:
        raise SettingsError(f"preset {unknown(name, PRESETS)}")
    return PRESETS[name]()


def _paper() -> Settings:
    """[E1, Tab. I] [E2, Tab. II] as printed; a cluster's work, not a laptop's."""
    return Settings(
        preset="paper",
        robots=_made(TrainerSettings, TABLE_I, "Table I"),
        fire=_made(TrainerSettings, TABLE_II, "Table II"),
        scenario=Scenario(training=True),  # [D6]
        episodes_per_job=16,
        jobs_per_round=4,  # [E1, chosen] about half of Table I's buffer
    )


def _laptop() -> Settings:
    """[E1, E2, chosen] What learns visibly on two cores in about half an hour.

    Less than a tenth of the paper's decisions, so ten times its learning rate, small
    minibatches and buffers (an update after each round, for the fire after several)
    and half its width; pointer heads, since raw Gaussians need millions of decisions;
    an entropy bonus that fades, so that the likeliest action becomes as good as a
    sampled one. Half of the fires are random, since a learning one soon leaves nobody
    to learn from.
    """
    net = {"hidden_units": 128, "num_layers": 2, "head": "pointer"}
    robots = {
        "batch_size": 256,
        "buffer_size": 2560,
        "learning_rate": 1e-3,
        "beta_schedule": "linear",
        "max_steps": 750_000,
        "keep_checkpoints": 25,
        "checkpoint_interval": 30_000,
        "summary_freq": 5000,
    }
    fire = {
        "batch_size": 128,
        "buffer_size": 500,
        "learning_rate": 1e-3,
        "max_steps": 30_000,
        "keep_checkpoints": 20,
        "checkpoint_interval": 1500,
    }
    paper = _paper()
    return replace(
        paper,
        preset="laptop",
        robots=_changed(paper.robots, net | robots, "laptop"),
        fire=_changed(paper.fire, net | fire, "laptop"),
        episodes_per_job=8,
        jobs_per_round=2,
        random_fires=0.5,
    )


def _tiny() -> Settings:
    """[E1, E2, chosen] Seconds, on a small building: every part runs, little is learnt.

    Six people and a minute; buffers that each round fills, so that each ends in an
    update.
    """
    net = {"hidden_units": 16, "num_layers": 1, "head": "pointer"}
    often = {"keep_checkpoints": 3, "learning_rate": 3e-3}
    robots = {"batch_size": 32, "buffer_size": 64, "max_steps": 600}
    fire = {"batch_size": 4, "buffer_size": 8, "max_steps": 60}
    saved = {"checkpoint_interval": 200, "summary_freq": 100}
    fire_saved = {"checkpoint_interval": 20, "summary_freq": 10}
    paper = _paper()
    return Settings(
        preset="tiny",
        robots=_changed(paper.robots, {**net, **often, **robots, **saved}, "tiny"),
        fire=_changed(paper.fire, {**net, **often, **fire, **fire_saved}, "tiny"),
        scenario=Scenario(people=6, sources=3, time_limit=60.0, training=True),
        episodes_per_job=2,
        jobs_per_round=2,
        switch_every=1,
        imitation_episodes=4,
        imitation_epochs=2,
        critic_rounds=1,
    )


PRESETS: dict[str, Callable[[], Settings]] = {
    "tiny": _tiny,
    "laptop": _laptop,
    "paper": _paper,
}


# -- As plain numbers and words -----------------------------------------------------


def asdict(settings: Settings) -> dict[str, Any]:
    """All of it as plain dicts, numbers, words and tuples, for a checkpoint."""
    return dataclasses.asdict(settings)


def fromdict(plain: Rows) -> Settings:
    """What `asdict` was made of; its tuples may have become lists on the way.

    Raises SettingsError for a name or value that cannot be meant.
    """
    kinds: dict[str, Any] = {
        "robots": TrainerSettings,
        "fire": TrainerSettings,
        "scenario": Scenario,
    }
    rows = mapping(plain, "settings")
    parts = {
        name: _made(kinds[name], rows[name], name) for name in kinds if name in rows
    }
    return _made(Settings, {**rows, **parts}, "settings")


# -- ML-Agents' files ---------------------------------------------------------------

OWN_ROWS = ("head", "reward_scale")


def read_yaml(path: str | os.PathLike[str], base: Settings) -> Settings:
    """`base` with whatever an ML-Agents trainer file, or one of ours, states instead.

    [E3, chosen] What the file leaves out stays as in `base`, not as ML-Agents would
    have it: files of a few lines can then vary one of the tables.
    Raises SettingsError, also without PyYAML, and OSError for an unreadable file.
    """
    file = mlagents.read(path)
    try:
        return _read(file, base)
    except SettingsError as error:
        raise SettingsError(f"{path}: {error}") from None


def write_yaml(settings: Settings, path: str | os.PathLike[str]) -> None:
    """A file that `read_yaml` reads onto any base, and that ML-Agents 0.29.0 takes.

    Raises OSError where it cannot be written, SettingsError without PyYAML.
    """
    plain = asdict(settings)
    robots, fire = plain.pop("robots"), plain.pop("fire")
    sides = zip(mlagents.SIDES, (robots, fire), strict=True)
    own = {side: {name: rows[name] for name in OWN_ROWS} for side, rows in sides}
    mlagents.write(path, mlagents.TrainerFile(robots, fire, {**own, **plain}))


def _read(file: mlagents.TrainerFile, base: Settings) -> Settings:
    ours = dict(file.ours)
    own_robots, own_fire = (_own_rows(ours.pop(s, None), s) for s in mlagents.SIDES)
    whole = {
        "robots": _trainer(base.robots, {**file.robots, **own_robots}, "robots"),
        "fire": _trainer(base.fire, {**file.fire, **own_fire}, "fire"),
        "scenario": _changed(base.scenario, ours.pop("scenario", None), "scenario"),
    }
    known = [field.name for field in dataclasses.fields(Settings)]
    for name in ours:
        if name not in known or name in whole:
            also = [*mlagents.SIDES, *(other for other in known if other not in whole)]
            raise SettingsError(
                f"{mlagents.OURS}: {unknown(name, [*also, 'scenario'])}"
            )
    return _changed(base, {**ours, **whole}, "settings")


def _own_rows(rows: Any, side: str) -> dict[str, Any]:
    where = f"{mlagents.OURS}: {side}"
    for name in (rows := mapping(rows, where)):
        if name not in OWN_ROWS:
            raise SettingsError(f"{where}: {unknown(name, OWN_ROWS)}")
    return rows


def _trainer(base: TrainerSettings, said: Rows, where: str) -> TrainerSettings:
    """[E3] Schedules left out are the learning rate's; an interval may follow, too.

    With `even_checkpoints`, `keep_checkpoints` of them are spread over `max_steps`.
    """
    rows = dict(said)
    even = rows.pop("even_checkpoints", False)
    check_type(f"{where}: even_checkpoints", even, bool)
    for name in ("beta_schedule", "epsilon_schedule"):
        if "learning_rate_schedule" in rows:
            rows.setdefault(name, rows["learning_rate_schedule"])
    made = _changed(base, rows, where)
    interval = max(1, made.max_steps // made.keep_checkpoints)
    return replace(made, checkpoint_interval=interval) if even else made
