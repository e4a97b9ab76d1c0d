"""What an experiment is: arms, seeds, budgets and tests, read from a TOML file.

Clauses: E6, F12.

    question = "Do robots learn more from a fire that learns?"  # the page's title
    building = "paper"            # default
    preset = "laptop"             # default
    decisions = 480_000           # of the robots, in every training
    seeds = [0, 1, 2]             # one training of each arm per seed
    compare = [["pool", "random_fire"]]  # differences, the first minus the second
    [settings]                    # rows that differ from the preset's, in all arms
    random_fires = 0.0            # share of rollout jobs with random fire
    [arms.random_fire]
    fire = "random"               # by name; left out: a fire that learns
    [arms.pool]                   # further rows differ in this arm
    random_fires = 0.25
    fire.initialize_from = "learned"  # the policy to begin with: a path, or what ships
    [arms.copied]
    imitate = "observer"          # these robots imitate a strategy first
    robots.context = true
    [test]
    fires = ["none", "random", "pool"]   # by name, or arms whose fire learned
    robots = ["none", "sweep"]    # written by hand, beside those that learned
    seed = 5000                   # default
    episodes = 100                # default
    looking_ahead = 0             # so many of them against `worst-case`, too
    baseline = "sweep"            # scores E = 1; left out: the paper's ruler
    [best_response]               # a new fire learns against each frozen team
    decisions = 9_000
    seeds = 3                     # default: the strongest of three is kept
    initialize_from = "learned"
"""

import re
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

from reference.building import Building, building_of, plan_of
from reference.learning.players import Learned
from reference.learning.settings import (
    SIDES,
    SettingsError,
    Side,
    unknown,
)
from reference.workshop.crossplay.contestants import WORST
from reference.workshop.crossplay.matches import EPISODES, MOST_RUNS, Arena
from reference.workshop.files import read_text
from reference.workshop.maps import load
from reference.workshop.plain import checked, mapping, record_from
from reference.workshop.remedies import SideSettings
from reference.workshop.strategies import FIRES, GUIDES, LEARNED, ROBOTS
from reference.workshop.training.checkpoints import Task
from reference.workshop.training.presets import Settings, changed, preset
from reference.workshop.training.session import Training
from reference.workshop.training.starting import fixed_player, initial_of

LEARNS = "learns"
FIXED_FIRES = (*FIRES, LEARNED)  # that learn nothing in an experiment
BEST = "best response"  # the fire that does
NAME = re.compile(r"[a-z][a-z0-9_]*")  # of an arm; files are named after it
ROWS, SAVED = 100, 20  # rows of a curve; checkpoints of a training on its way
RESPONSES = "responses"  # the folder of best responses
FIRST_RESPONSE = 10_000  # seed of the first fire that learns against a team


@dataclass(frozen=True)
class Test:
    """Evacuations of every team against every fire, all from the same seeds.

    looking_ahead  how many of them against the fire that looks ahead, which is slow
    baseline       robots that score E = 1 on average; None: by the paper's ruler
    """

    fires: tuple[str, ...] = ("random",)
    robots: tuple[str, ...] = ()
    seed: int = 5000
    episodes: int = EPISODES
    looking_ahead: int = 0
    baseline: str | None = None


@dataclass(frozen=True)
class Response:
    """Fires that learn against each frozen team, `seeds` of them; the best is kept.

    initialize_from  a checkpoint's path or LEARNED: with whose fire they begin. One
                     that is strong already needs fewer decisions [E6, chosen].
    """

    decisions: int
    seeds: int = 3
    initialize_from: str | None = None


class Arm(NamedTuple):
    """What an arm's trainings have in common.

    fire     who plays it, by name, or LEARNS
    imitate  whom the robots copy first
    initial  by side: with whose network it begins, a checkpoint's path or LEARNED
    """

    settings: Settings
    fire: str
    imitate: str | None
    initial: Mapping[Side, str]


@dataclass(frozen=True)
class Experiment:
    """A checked file.

    Raises SettingsError, CheckpointError for a fire that does not fit, and what loading
    the map or that fire raises.

    settings  rows that differ from the preset's, in all arms
    compare   pairs of arms or robots: the first less the second
    """

    arms: Mapping[str, Any]
    decisions: int
    question: str = ""
    preset: str = "laptop"
    building: str = "paper"
    seeds: tuple[int, ...] = (0, 1, 2)
    settings: Mapping[str, Any] = field(default_factory=dict)
    compare: tuple[tuple[str, ...], ...] = ()
    test: Test = field(default_factory=Test)
    best_response: Response | None = None

    def __post_init__(self) -> None:
        self._refuse_numbers()
        self._refuse_names()
        try:
            if LEARNED in self.test.fires:
                self._frozen(LEARNED)
            tasks = [task for _, task in self._trainings(self.seeds[:1])]
            if self.best_response:
                tasks.append(self.response("none", 0))
        except OSError as error:  # of the map, or of a fire's file
            raise SettingsError(str(error)) from None
        for task in tasks:
            Training(task)  # refuses what does not fit

    def _refuse_numbers(self) -> None:
        """Raise SettingsError for numbers of nothing."""
        response, test = self.best_response or Response(1), self.test
        counts = (self.decisions, response.decisions, response.seeds, test.episodes)
        if min(counts) < 1 or min(test.looking_ahead, test.seed, *self.seeds, 0) < 0:
            raise SettingsError("decisions, seeds and episodes are counted upwards")
        if not self.arms or not self.seeds:
            raise SettingsError("name at least one arm and one seed")
        trainings = len(self.arms) * len(self.seeds)
        teams = trainings + len(test.robots)
        fires = trainings + len(test.fires) + response.seeds
        if (runs := teams * (fires * test.episodes + test.looking_ahead)) > MOST_RUNS:
            raise SettingsError(
                f"some {runs:,} evacuations in all: ask for {MOST_RUNS:,} at most"
            )

    def _refuse_names(self) -> None:
        """Raise SettingsError for names that are unknown, taken or there twice."""
        test = self.test
        for what, named in (
            ("seeds", self.seeds),
            ("fires", test.fires),
            ("robots", test.robots),
        ):
            if len(set(named)) < len(named):
                raise SettingsError(f"{what}: name each once")
        for arm in self.arms:
            if not NAME.fullmatch(arm) or arm in {*FIXED_FIRES, *ROBOTS}:
                raise SettingsError(
                    f"'{arm}' can be no arm's name: take lower-case letters, digits "
                    "and _, and no strategy's name"
                )
            self.of_arm(arm)
        baseline = () if test.baseline is None else (test.baseline,)
        for what, words, known in (
            ("fires", test.fires, (*FIXED_FIRES, *self.adversarial)),
            ("robots", test.robots, ROBOTS),
            ("baseline", baseline, test.robots),
            ("compare", sum(self.compare, ()), (*self.arms, *test.robots)),
        ):
            for word in words:
                if word not in known:
                    raise SettingsError(f"{what}: {unknown(word, known)}")
        if any(len(pair) != 2 for pair in self.compare):
            raise SettingsError("compare: name two in each pair")

    # -- Arms -----------------------------------------------------------------------

    @cached_property
    def base(self) -> Settings:
        """The settings of all arms, before what each changes.

        [E6, chosen] A fire learns for as long as the robots do, and nearly as fast at
        the end as at the beginning: one that had stopped would be no adversary.
        """
        made = preset(self.preset)
        made = replace(made, fire=replace(made.fire, max_steps=self.decisions))
        return changed(made, self.settings, "settings")

    def of_arm(self, arm: str) -> Arm:
        """Make an arm's settings and players. Raises SettingsError."""
        where = f"arms: {arm}"
        rows = mapping(self.arms[arm], where)
        if "scenario" in rows:
            raise SettingsError(f"{where}: the scenario is everybody's: [settings]")
        fire, imitate = rows.pop("fire", LEARNS), rows.pop("imitate", None)
        if not isinstance(fire, str):
            rows["fire"], fire = fire, LEARNS
        if fire not in (known := (LEARNS, *FIXED_FIRES)):
            raise SettingsError(f"{where}: fire {unknown(fire, known)}")
        if imitate not in (None, *GUIDES):
            raise SettingsError(f"{where}: imitate {unknown(imitate, GUIDES)}")
        initial = {}
        for side in SIDES:
            rows[side] = mapping(rows.get(side), f"{where}: {side}")
            if (word := rows[side].pop("initialize_from", None)) is not None:
                initial[side] = checked("initialize_from", word, str)
        made = changed(self.base, rows, where)
        learner = replace(made.fire, keep_checkpoints=1)
        robots = _with_budget(made.robots, self.decisions)
        return Arm(replace(made, robots=robots, fire=learner), fire, imitate, initial)

    @property
    def adversarial(self) -> list[str]:
        """The arms whose fire learns."""
        return [arm for arm in self.arms if self.of_arm(arm).fire == LEARNS]

    @property
    def teams(self) -> list[str]:
        """All robots: those of every training, and those written by hand."""
        return [*self.trainings, *self.test.robots]

    @cached_property
    def trainings(self) -> dict[str, Task]:
        """Every training by its team's name."""
        return dict(self._trainings(self.seeds))

    def _trainings(self, seeds: Sequence[int]) -> Iterator[tuple[str, Task]]:
        for arm in self.arms:
            settings, fire, imitate, initial = self.of_arm(arm)
            more = {
                "fixed": {} if fire == LEARNS else {"fire": self._frozen(fire)},
                "initial": self.networks(initial),
                "imitate": imitate,
            }
            for seed in seeds:
                yield f"{arm}-{seed}", self._task(settings, seed, **more)

    def _frozen(self, fire: str) -> Learned | str:
        """Find a fire that learns nothing here. Raises CheckpointError."""
        return fixed_player(fire, "fire", self._building, self.arena.scenario)

    def networks(self, words: Mapping[Side, str]) -> dict[Side, Learned]:
        """Find the networks with which sides begin. Raises CheckpointError."""
        found: dict[Side, Learned] = {}
        for side, word in words.items():
            found |= initial_of(word, [side], self._building, self.arena.scenario)
        return found

    def _task(self, settings: Settings, seed: int, **more: Any) -> Task:
        return Task(self.building, self.arena.plan, settings, seed, **more)

    def response(self, robots: Learned | str, number: int) -> Task:
        """The training of a fire against frozen robots. Raises CheckpointError."""
        asked = self.best_response
        assert asked is not None
        fire = _with_budget(self.base.fire, asked.decisions)
        return self._task(
            replace(self.base, fire=fire),
            FIRST_RESPONSE + number,
            fixed={"robots": robots},
            initial=self.first_response,
        )

    @cached_property
    def first_response(self) -> dict[Side, Learned]:
        """The network with which best responses begin, if any."""
        asked = self.best_response
        word = asked.initialize_from if asked else None
        return self.networks({"fire": word} if word else {})

    # -- Tests ----------------------------------------------------------------------

    @cached_property
    def arena(self) -> Arena:
        """The tests' arena: the trainings' scenario, without the rule of training."""
        scenario = replace(self.base.scenario, training=False)
        return Arena(self.building, plan_of(load(self.building)), scenario)

    @property
    def _building(self) -> Building:
        return building_of(self.arena.plan)

    @property
    def responses(self) -> range:
        """The numbers of the fires that learn against each team."""
        return range(self.best_response.seeds if self.best_response else 0)

    @property
    def fires(self) -> dict[str, range]:
        """Each fire that every team meets, and the seeds of these evacuations."""
        test, first = self.test, self.test.seed
        words = [word for word in test.fires if word in FIXED_FIRES]
        arms = [word for word in test.fires if word not in FIXED_FIRES]
        words += [f"{arm}-{seed}" for arm in arms for seed in self.seeds]
        words += [BEST] if self.responses else []
        found = dict.fromkeys(words, range(first, first + test.episodes))
        ahead = range(first, first + test.looking_ahead)
        return found | ({WORST: ahead} if ahead else {})

    @property
    def choices(self) -> range:
        """Seeds after the tests', on which the best of several responses is chosen."""
        end = self.test.seed + self.test.episodes
        return range(end, end + max(1, self.test.episodes // 2))


def _with_budget(settings: SideSettings, decisions: int) -> SideSettings:
    return replace(
        settings,
        max_steps=decisions,
        summary_freq=max(1, decisions // ROWS),
        checkpoint_interval=max(1, decisions // SAVED),
        keep_checkpoints=1,
    )


def read(path: Path) -> Experiment:
    """Read an experiment's file. Raises SettingsError, OSError."""
    try:
        content = tomllib.loads(read_text(path))
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        raise SettingsError(f"{path}: this is no TOML: {error}") from None
    return record_from(Experiment, content, str(path))
