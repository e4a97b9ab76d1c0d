"""The design of an experiment: arms, seeds, budget and tests, read from a TOML file.

What stands in such a file:

    question = "Do robots learn more from a fire that learns?"  # the page's title
    building = "paper"            # default
    preset = "laptop"             # default
    decisions = 480_000           # of the robots, in every training
    seeds = [0, 1, 2]             # one training of each arm per seed
    compare = [["adversary", "random_fire"]]  # arms or robots: first less second
    [settings]                    # rows that differ from the preset's, in all arms
    scenario.time_limit = 300.0
    [arms.random_fire]
    fire = "random"               # by name, or ["random", "busiest"] in turn; left out:
                                  # a fire that learns
    [arms.adversary]              # further rows differ in this arm
    random_fires = 0.25           # share of jobs in which a scripted fire stands in
    robots.gamma = 0.98
    scenario.sight_range = 8.0    # it learns under this; tests are as in [settings]
    [test]
    fires = ["none", "random", "adversary"]  # by name, or arms whose fire learned
    robots = ["none", "mine:Guide"]  # by name or your code, beside those that learned
    seed = 5000                   # default
    episodes = 100                # default
"""

import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import product
from pathlib import Path
from typing import Annotated, Any

from reference.learning.settings import SIDES, Side
from reference.workshop.comparing.matches import DEFAULT_EPISODES, Arena, Evaluation
from reference.workshop.comparing.named import WORST, strategy_of
from reference.workshop.maps import load, plan_of
from reference.workshop.storage.files import errors_naming
from reference.workshop.storage.records import (
    Allowed,
    SettingsError,
    check_values,
    checked_mapping,
    record_from,
)
from reference.workshop.storage.settings import read_toml_file
from reference.workshop.storage.words import unknown_name
from reference.workshop.strategies import FIRES, LEARNED, ROBOTS
from reference.workshop.strategies.own import is_code
from reference.workshop.strategies.trained import refuse_other_counts
from reference.workshop.training.checkpoints import Task
from reference.workshop.training.families import HEADS_OF_SEVERAL
from reference.workshop.training.policies import fixed_player
from reference.workshop.training.presets import Settings, preset, with_rows
from reference.workshop.training.rounds import Training

FIXED_FIRES = (*FIRES, LEARNED)  # fires that learn nothing in an experiment
# of an arm; files are named after it
NAME_PATTERN = re.compile(r"[a-z][a-z0-9_]{0,39}")
CURVE_ROWS = 100  # rows of a curve
CHECKPOINTS_SAVED = 20  # by a training on its way
IMITATION_ROWS = {f"imitation_{row}" for row in ("rounds", "episodes", "epochs")}
IMITATION_ROWS |= {"critic_rounds"}
BUDGET_ROWS: dict[Side, tuple[str, ...]] = {
    "robots": (
        "max_steps",
        "summary_freq",
        "checkpoint_interval",
        "keep_checkpoints",
    ),
    "fire": ("max_steps", "keep_checkpoints"),
}
"""Rows of each side that follow from `decisions`."""


@dataclass(frozen=True)
class Test:
    """Evacuations of all robots against all fires, from the same seeds."""

    fires: tuple[str, ...] = ("random",)
    robots: tuple[str, ...] = ()
    seed: Annotated[int, Allowed(low=0)] = 5000
    episodes: int = DEFAULT_EPISODES

    def __post_init__(self) -> None:
        check_values(self)


@dataclass(frozen=True)
class Experiment:
    """A checked file, whose rows stand above.

    Raises SettingsError, InputError for what loading the map or a network raises.
    """

    arms: Mapping[str, Any]
    decisions: int
    question: str = "An experiment"
    preset: str = "laptop"
    building: str = "paper"
    seeds: tuple[int, ...] = (0, 1, 2)
    settings: Mapping[str, Any] = field(default_factory=dict)
    compare: tuple[tuple[str, ...], ...] = ()
    test: Test = field(default_factory=Test)

    def __post_init__(self) -> None:
        check_values(self)
        if not self.arms or min(self.seeds, default=-1) < 0:
            raise SettingsError("name at least one arm and one seed, from 0 upwards")
        _refuse_twice("seeds", self.seeds)
        try:
            self._refuse_names()
            if not self.test.fires:
                raise SettingsError("test: fires: name at least one")
            self._refuse_too_many_runs()
            self._refuse_players_that_misfit()
            for name in self.arms:  # a training refuses what does not fit
                Training(self.trainings[f"{name}-{self.seeds[0]}"])
        except OSError as error:  # of the map
            raise SettingsError(str(error)) from None

    def _refuse_too_many_runs(self) -> None:
        """Raise InputError for more tests than an evaluation may have."""
        Evaluation(
            self.arena,
            robots=(*self.trainings, *self.test.robots),
            fires=self._fires_met(),
            seed=self.test.seed,
            episodes=self.test.episodes,
        )

    def _fires_met(self) -> tuple[str, ...]:
        """Name the fires of the tests: trainings of arms that are asked for, others."""
        asked = self.test.fires
        learned = [name for name in self.trainings if arm_of(name) in asked]
        return (*learned, *(fire for fire in asked if fire not in self.arms))

    def _refuse_players_that_misfit(self) -> None:
        """Raise InputError for code, network or arm that cannot play in the tests."""
        building = self.arena.drawn
        for name in self.arms:
            settings, _ = self.arm(name)
            if settings.robots.head in HEADS_OF_SEVERAL:  # it plays with any numbers
                continue
            with errors_naming(f"arms: {name}"):
                refuse_other_counts(
                    "robots", building, settings.scenario, self.arena.scenario
                )
        words_of = zip(SIDES, (self.test.robots, self.test.fires), strict=True)
        for side, words in words_of:
            for word in words:
                if word == LEARNED or is_code(word):
                    strategy_of(word, side, building, self.arena.scenario)

    def _refuse_names(self) -> None:
        """Raise SettingsError for names that are unknown, taken or there twice."""
        for name in self.arms:
            if not NAME_PATTERN.fullmatch(name) or name in (*ROBOTS, *FIXED_FIRES):
                raise SettingsError(
                    f"'{name:.60}' can be no arm's name: take up to 40 lower-case "
                    "letters, digits and _, and no strategy's name"
                )
        learning = [name for name in self.arms if not self.arm(name)[1]]
        fires = self.test.fires
        known_fires = (*FIXED_FIRES, WORST, *learning, *filter(is_code, fires))
        _refuse_unknown("fires", fires, known_fires)
        robots = self.test.robots
        known_robots = (*ROBOTS, LEARNED, *filter(is_code, robots))
        _refuse_unknown("robots", robots, known_robots)
        for pair in self.compare:
            _refuse_unknown("compare", pair, (*self.arms, *self.test.robots))
            if len(pair) != 2:
                raise SettingsError("compare: name two at a time")

    @cached_property
    def base(self) -> Settings:
        """The settings of all arms, before what each changes.

        [E6, chosen] A fire learns for as long as the robots do, and nearly as fast at
        the end as at the beginning: one that had stopped would be no adversary.
        """
        stated = _checked_rows(self.settings, "settings")
        made = with_rows(preset(self.preset), stated, "settings")
        fire = replace(made.fire, max_steps=self.decisions, keep_checkpoints=1)
        robots = replace(
            made.robots,
            max_steps=self.decisions,
            keep_checkpoints=1,
            summary_freq=max(1, self.decisions // CURVE_ROWS),
            checkpoint_interval=max(1, self.decisions // CHECKPOINTS_SAVED),
        )
        return replace(made, robots=robots, fire=fire)

    def arm(self, name: str) -> tuple[Settings, tuple[str, ...]]:
        """Make an arm's settings, and name its fires, none for one that learns.

        Raises SettingsError.
        """
        arm = f"arms: {name}"
        rows = _checked_rows(self.arms[name], arm)
        fires: tuple[str, ...] = ()
        if isinstance(rows.get("fire"), str | list):
            named = rows.pop("fire")
            fires = (named,) if isinstance(named, str) else tuple(map(str, named))
            if not fires:
                raise SettingsError(
                    f"{arm}: fire names nobody: leave it out for a fire that learns"
                )
            _refuse_unknown(f"{arm}: fire", fires, FIXED_FIRES)
            if "random_fires" in rows:
                raise SettingsError(f"{arm}: random_fires needs a fire that learns")
        return with_rows(self.base, rows, arm), fires

    @cached_property
    def trainings(self) -> dict[str, Task]:
        """Every training by its name, such as "adversary-0" of an arm and a seed.

        Seeds come first: what an interrupted experiment has made compares all arms.
        """
        trainings = {}
        building = self.arena.drawn
        for seed, name in product(self.seeds, self.arms):
            settings, fires = self.arm(name)
            scenario = settings.scenario
            players = tuple(
                fixed_player(fire, "fire", building, scenario) for fire in fires
            )
            fixed: dict[Side, Any] = {"fire": players} if fires else {}
            task = Task(self.building, self.arena.plan, settings, seed, fixed)
            trainings[f"{name}-{seed}"] = task
        return trainings

    @cached_property
    def arena(self) -> Arena:
        """The tests' arena: the trainings' scenario, without the rule of training."""
        scenario = replace(self.base.scenario, training=False)
        return Arena(self.building, plan_of(load(self.building)), scenario)


def arm_of(training: str) -> str:
    """The arm of a training, which is the first part of its name."""
    return training.partition("-")[0]


def _refuse_unknown(name: str, words: Collection[str], known: Collection[str]) -> None:
    for word in words:
        if word not in known:
            raise SettingsError(f"{name} {unknown_name(word, known)}")
    _refuse_twice(name, words)


def _refuse_twice(name: str, named: Collection[Any]) -> None:
    if len({*named}) < len(named):
        raise SettingsError(f"{name}: name each once")


def _checked_rows(rows: Any, where: str) -> dict[str, Any]:
    """Check that rows change nothing that the experiment itself decides."""
    rows = checked_mapping(rows, where)
    if "preset" in rows:
        raise SettingsError(f"{where}: preset stands at the top, the same for all arms")
    idle = rows.keys() & IMITATION_ROWS
    if idle:
        raise SettingsError(f"{where}: nobody imitates here: leave out {min(idle)}")
    for side in SIDES:
        stated = rows.get(side)
        for row in BUDGET_ROWS[side]:
            if isinstance(stated, Mapping) and row in stated:
                raise SettingsError(
                    f"{where}: {side}.{row} follows from `decisions`. Leave it out."
                )
    return rows


def read_experiment(path: Path) -> Experiment:
    """Read an experiment's file. Raises SettingsError, OSError."""
    return record_from(Experiment, read_toml_file(path), str(path))
