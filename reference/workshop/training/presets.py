"""Settings of a whole training: both sides, a scenario, and four presets.

The tables' numbers stand in `paper`; those of the smaller presets in presets.toml.
"""

import tomllib
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any

from reference import paper
from reference.paper import Scenario
from reference.workshop.anchors.settings import SideSettings
from reference.workshop.storage.records import (
    Allowed,
    SettingsError,
    check_values,
    checked_mapping,
    record_from,
)
from reference.workshop.storage.scenarios import with_stated
from reference.workshop.storage.words import unknown_name
from reference.workshop.strategies import FIRES

PRESET_ROWS = tomllib.loads(Path(__file__).with_name("presets.toml").read_text("utf-8"))
PRESETS = ("tiny", "laptop", "any", "paper")
ROBOTS_ONLY = ("commitment", "masks")  # rows that the fire cannot have


# Limits of rows belong to the form people fill in, not to the model: they catch slips
# of the keyboard. So `paper.MOST` is read here once, when the form is made.


@dataclass(frozen=True)
class Settings:
    """Settings of a whole training: both sides, the scenario and rounds [E6].

    episodes_per_job     episodes one worker plays in lockstep, network calls batched
    jobs_per_round       rollouts of a round; an update comes when a buffer is full. It
                         does not depend on the number of workers, so that this number
                         changes no result
    random_fires         share of the jobs in which a scripted fire stands in for one
                         that learns: robots easily overfit to a single adversary
    stand_ins            these fires, in turn
    league               while robots learn, of the other jobs, the share in which one
                         side, robots and fire in turn, plays as it did earlier:
                         fictitious play (Brown 1951)
    calm                 share of the robots' max_steps before anybody sets fires: a
                         curriculum, the building first
    imitation_rounds     before robots learn, if they imitate a strategy: it plays the
                         first; in the others robots play, and it says what it would do
    imitation_episodes   of such a round
    imitation_epochs     passes through all these episodes, after each of the rounds
    critic_rounds        of the training's first, in which the critic learns alone, at
                         least one update long, if its policy was copied or learned
                         elsewhere: an untrained critic would undo that. Rounds count
                         in which the side does not learn, too
    threads              torch's, in updates; the order of its sums depends on their
                         number, so it is not taken from the machine
    """

    preset: str
    robots: SideSettings
    fire: SideSettings
    scenario: Scenario
    episodes_per_job: Annotated[int, Allowed(high=paper.MOST)]
    jobs_per_round: Annotated[int, Allowed(high=paper.MOST)]
    random_fires: Annotated[float, Allowed(low=0, high=1)] = 0.0
    stand_ins: tuple[str, ...] = ("random",)
    league: Annotated[float, Allowed(low=0, high=1)] = 0.0
    calm: Annotated[float, Allowed(low=0, high=1)] = 0.0
    imitation_rounds: Annotated[int, Allowed(high=paper.MOST)] = 4
    imitation_episodes: Annotated[int, Allowed(high=paper.MOST)] = 240
    imitation_epochs: Annotated[int, Allowed(high=paper.MOST)] = 10
    critic_rounds: Annotated[int, Allowed(low=0, high=paper.MOST)] = 6
    threads: Annotated[int, Allowed(high=64)] = 1

    def __post_init__(self) -> None:
        check_values(self)
        if self.fire.trainer_type != "ppo":
            raise SettingsError("fire: trainer_type must be ppo: one fire is no group")
        # Refused rather than ignored: somebody would wait for an effect.
        for row in ROBOTS_ONLY:
            if getattr(self.fire, row):
                raise SettingsError(f"fire: {row} is about robots only")
        if not self.stand_ins:
            raise SettingsError("stand_ins: name at least one fire")
        for name in {*self.stand_ins} - {*FIRES}:
            raise SettingsError(f"stand_ins: {unknown_name(name, FIRES)}")
        if not self.scenario.training:
            raise SettingsError("scenario: training must be true [D6]")


def with_rows(base: Settings, rows: Any, where: str) -> Settings:
    """Replace rows of whole settings; robots, fire and scenario hold rows of their own.

    where: the rows stand, for messages. Raises SettingsError.
    """
    rows = checked_mapping(rows, where)
    if "preset" in rows:
        raise SettingsError(
            f"{where}: leave preset out: --preset or an experiment's top names it"
        )
    for name in rows.keys() & {"robots", "fire", "scenario"}:
        part = getattr(base, name)
        there = f"{where}: {name}"
        stated = checked_mapping(rows[name], there)
        if name == "scenario":
            rows[name] = with_stated(part, stated, there)
        else:
            rows[name] = record_from(type(part), vars(part) | stated, there)
    return record_from(Settings, vars(base) | rows, where)


def preset(name: str) -> Settings:
    """The settings called `name`, one of PRESETS. Raises SettingsError."""
    if name not in PRESETS:
        raise SettingsError(f"preset {unknown_name(name, PRESETS)}")
    largest = Settings(
        preset="paper",
        robots=record_from(SideSettings, paper.TABLE_I, "Table I"),  # [E1, Tab. I]
        fire=record_from(SideSettings, paper.TABLE_II, "Table II"),  # [E2, Tab. II]
        scenario=Scenario(training=True),  # [D6]
        episodes_per_job=8,
        jobs_per_round=2,  # [E1, chosen] a round fills under 19 % of Table I's buffer
        threads=2,  # updates of networks as large take 0.6 times as long on two cores
    )
    return replace(with_rows(largest, PRESET_ROWS.get(name, {}), name), preset=name)
