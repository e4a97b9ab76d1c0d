"""Settings of a whole training: both sides, a scenario, and three presets.

Clauses: D6 (rule of training), E1, E2 (Tables I and II), E3, E6 (both learn).  The
tables' numbers stand in `paper`; those of the smaller presets are chosen here.
"""

import os
import sys
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Annotated, Any, TypeVar

from reference.learning.settings import Row
from reference.paper import TABLE_I, TABLE_II, Scenario
from reference.workshop.plain import (
    SettingsError,
    check_rows,
    mapping,
    record_from,
    rows_of,
    unknown,
)
from reference.workshop.remedies import SideSettings, refuse_of_robots
from reference.workshop.training import mlagents


@dataclass(frozen=True)
class Settings:
    """Settings of a whole training: both sides, the scenario and rounds.

    episodes_per_job     episodes one worker plays in lockstep, network calls batched
    jobs_per_round       rollouts between two updates; it does not depend on the number
                         of workers, so that this number changes no result
    random_fires         share of the jobs in which random fire stands in for one that
                         learns: robots easily overfit to a single adversary
    calm                 share of the robots' max_steps before anybody sets fires: a
                         curriculum, the building first
    imitation_episodes   of a strategy that is imitated first, if any
    imitation_epochs     passes through these episodes
    """

    preset: str
    robots: SideSettings
    fire: SideSettings
    scenario: Scenario
    episodes_per_job: int
    jobs_per_round: int
    random_fires: Annotated[float, Row(low=0, high=1)] = 0.0
    calm: Annotated[float, Row(low=0, high=1)] = 0.0
    imitation_episodes: int = 256
    imitation_epochs: int = 10

    def __post_init__(self) -> None:
        check_rows(self)
        if self.fire.trainer_type != "ppo":
            raise SettingsError(
                "fire: trainer_type is 'poca', but there is one fire: a group of one "
                "has nobody to share credit with; write ppo, as Table II does"
            )
        refuse_of_robots(self.fire)
        if not self.scenario.training:
            raise SettingsError(
                "scenario: training is false, but rule D6 holds in training: an "
                "occupied place yields no fire; write true"
            )


# -- Records from rows --------------------------------------------------------------

Record = TypeVar("Record", SideSettings, Settings, Scenario)


def _changed(base: Record, rows: Any, where: str) -> Record:
    """Replace some rows of a record by what a file states."""
    known = rows_of(type(base))
    stated = {
        name: _number(row, known[name].kind) if name in known else row
        for name, row in mapping(rows, where).items()
    }
    return record_from(type(base), {**vars(base), **stated}, where)


def _number(value: Any, kind: Any) -> Any:
    """Read 1e-4, a word to YAML, and 5.0e5, no whole number to it, as numbers [E3]."""
    if kind not in (int, float) or not isinstance(value, str | float):
        return value
    try:
        real = float(value)
    except ValueError:
        return value
    return int(real) if kind is int and real.is_integer() else real


def changed(base: Settings, rows: Any, where: str) -> Settings:
    """Replace rows of whole settings; robots, fire and scenario hold rows of their own.

    where: the rows stand, for messages. Raises SettingsError.
    """
    rows = mapping(rows, where)
    for name in ("robots", "fire", "scenario"):
        if name in rows:
            rows[name] = _changed(getattr(base, name), rows[name], f"{where}: {name}")
    return _changed(base, rows, where)


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
        robots=record_from(SideSettings, TABLE_I, "Table I"),
        fire=record_from(SideSettings, TABLE_II, "Table II"),
        scenario=Scenario(training=True),  # [D6]
        episodes_per_job=2,
        jobs_per_round=4,  # [E1, chosen] a round fills under 10 % of Table I's buffer
    )


def _laptop() -> Settings:
    """[E1, E2, chosen] Settings that learn visibly in less than an hour.

    Robots have a twentieth of the paper's decisions, the fire a twenty-sixth, which is
    as many episodes. So the learning rate is higher, minibatches and buffers are small
    (an update after each round, for the fire after several), layers half as wide, and
    heads are mixtures around anchors: a Gaussian of the whole floor does not learn.
    Robots finish what they begin (commitment), the clock is taken out of their reward
    (shaping), and they look 33 decisions ahead instead of 10 (gamma). Their entropy
    bonus is a fifth and fades, so the likeliest action becomes as good as a sampled
    one. Half of the fires are random: a learning one soon leaves nobody to learn from.
    """
    net = {"hidden_units": 128, "num_layers": 2, "head": "mixture"}
    net |= {"learning_rate": 1e-3}
    robots: dict[str, Any] = {"batch_size": 512, "buffer_size": 2560}
    robots |= {"beta": 1e-3, "beta_schedule": "linear"}
    robots |= {"commitment": 2.5, "shaping": 300.0, "gamma": 0.97, "masks": True}
    robots |= {"max_steps": 480_000, "summary_freq": 5000}
    robots |= {"keep_checkpoints": 25, "checkpoint_interval": 24_000}
    fire = {"batch_size": 64, "buffer_size": 250, "max_steps": 19_200}
    fire |= {"keep_checkpoints": 20, "checkpoint_interval": 960}
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
    """[E1, E2, chosen] Seconds in a small building: every part runs, little is learnt.

    Six people and a minute; buffers that each round fills, so that each ends in an
    update.
    """
    net = {"hidden_units": 16, "num_layers": 1, "head": "mixture"}
    net |= {"learning_rate": 3e-3, "keep_checkpoints": 3}
    robots: dict[str, Any] = {"batch_size": 32, "buffer_size": 64, "max_steps": 600}
    robots |= {"commitment": 5.0, "shaping": 300.0, "masks": True}
    robots |= {"checkpoint_interval": 200, "summary_freq": 100}
    fire = {"batch_size": 2, "buffer_size": 4, "max_steps": 30}
    fire |= {"checkpoint_interval": 10, "summary_freq": 5}
    paper = _paper()
    return Settings(
        preset="tiny",
        robots=_changed(paper.robots, net | robots, "tiny"),
        fire=_changed(paper.fire, net | fire, "tiny"),
        scenario=Scenario(people=6, sources=3, time_limit=60.0, training=True),
        episodes_per_job=2,
        jobs_per_round=2,
        imitation_episodes=4,
        imitation_epochs=2,
    )


PRESETS: dict[str, Callable[[], Settings]] = {
    "tiny": _tiny,
    "laptop": _laptop,
    "paper": _paper,
}


# -- ML-Agents' files ---------------------------------------------------------------


def read_yaml(path: str | os.PathLike[str], base: Settings) -> Settings:
    """Replace in `base` what a trainer file of ML-Agents, or one of ours, states.

    [E3, chosen] What the file leaves out stays as in `base`, not as ML-Agents would
    have it: files of a few lines can then vary one of the tables. Notes on stderr
    which behaviour is taken for which side.
    Raises SettingsError, also without PyYAML, and OSError for an unreadable file.
    """
    try:
        rows, names = mlagents.read(path)
    except SettingsError as error:
        raise SettingsError(f"{path}: {error}") from None
    if names:
        taken = ", ".join(f"'{name}' for {side}" for side, name in names.items())
        print(f"note: {path}: {taken}", file=sys.stderr)
    return changed(base, rows, str(path))
