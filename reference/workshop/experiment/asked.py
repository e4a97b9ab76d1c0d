"""What an experiment is: arms, seeds, budgets and tests, read from a TOML file.

Clauses: E6, F12.

    question = "Do robots learn more from a fire that learns?"
    decisions = 480_000           # of the robots, in every training
    seeds = [0, 1, 2]             # of each arm's trainings
    compare = [["learning", "random_fire"]]
    [arms.random_fire]
    fire = "random"
    [arms.learning]               # rows of settings that differ from the preset's;
    fire = "learns"               # fire: by name, or rows of the one that learns
    [test]
    fires = ["none", "random", "learning"]  # by name, or an arm's that learned
    robots = ["none", "sweep"]    # written by hand, beside those that learned
    [best_response]
    decisions = 9_000             # of every fire that learns against frozen robots
"""

import json
import re
import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import reference
from reference.building import load, plan_of
from reference.learning.players import Learned
from reference.learning.settings import SettingsError, TrainerSettings, unknown
from reference.workshop.evaluation.contestants import WORST
from reference.workshop.evaluation.crossplay import EPISODES, Arena
from reference.workshop.evaluation.crossplay.asked import NOBODY
from reference.workshop.files import read_json, read_text, write_whole
from reference.workshop.plain import mapping, record_from
from reference.workshop.runs import (
    RunError,
    refuse_contradictions,
    refuse_version,
    rows_of_both,
)
from reference.workshop.strategies import FIRES, ROBOTS
from reference.workshop.training.checkpoints import Task
from reference.workshop.training.presets import Settings, changed, preset

LEARNS = "learns"
BEST = "best response"  # the fire that does
ABOUT = "experiment.json"
NAME = re.compile(r"[a-z][a-z0-9_]*")  # of an arm; files are named after it
ROWS, SAVED = 100, 20  # rows of a curve; checkpoints of a training on its way
RESPONSES = 10_000  # seed of the first fire that learns against a team


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
    """Fires that learn against each frozen team, `seeds` of them; the best is kept."""

    decisions: int
    seeds: int = 3


@dataclass(frozen=True)
class Experiment:
    """A checked file. Raises SettingsError, and what loading the map raises.

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
        response, test = self.best_response or Response(1), self.test
        counts = (self.decisions, response.decisions, response.seeds, test.episodes)
        if min(counts) < 1 or min(test.looking_ahead, test.seed, *self.seeds, 0) < 0:
            raise SettingsError("decisions, seeds and episodes are counted upwards")
        if not self.arms or not self.seeds:
            raise SettingsError("name at least one arm and one seed")
        for arm in self.arms:
            if not NAME.fullmatch(arm) or arm in {*FIRES, *ROBOTS}:
                raise SettingsError(
                    f"'{arm}' can be no arm's name: take lower-case letters, digits "
                    "and _, and no strategy's name"
                )
            self.of_arm(arm)
        baseline = () if test.baseline is None else (test.baseline,)
        for what, words, known in (
            ("fires", test.fires, (*FIRES, *self.adversarial)),
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

    def of_arm(self, arm: str) -> tuple[Settings, str]:
        """Make the settings of an arm's trainings; name its fire, or LEARNS."""
        where = f"arms: {arm}"
        rows = mapping(self.arms[arm], where)
        if "scenario" in rows:
            raise SettingsError(f"{where}: the scenario is everybody's: [settings]")
        fire = rows.pop("fire", LEARNS)
        if not isinstance(fire, str):
            rows["fire"], fire = fire, LEARNS
        if fire not in (known := (LEARNS, *FIRES)):
            raise SettingsError(f"{where}: fire {unknown(fire, known)}")
        made = changed(self.base, rows, where)
        learner = replace(made.fire, keep_checkpoints=1)
        robots = _with_budget(made.robots, self.decisions)
        return replace(made, robots=robots, fire=learner), fire

    @property
    def adversarial(self) -> list[str]:
        """The arms whose fire learns."""
        return [arm for arm in self.arms if self.of_arm(arm)[1] == LEARNS]

    @property
    def teams(self) -> list[str]:
        """All robots: those of every training, and those written by hand."""
        return [*self.trainings, *self.test.robots]

    @property
    def trainings(self) -> dict[str, Task]:
        """Every training by its team's name."""
        return dict(self._trainings())

    def _trainings(self) -> Iterator[tuple[str, Task]]:
        for arm in self.arms:
            settings, fire = self.of_arm(arm)
            fixed: Any = {} if fire == LEARNS else {"fire": fire}
            for seed in self.seeds:
                task = Task(self.building, self.arena.plan, settings, seed, fixed)
                yield f"{arm}-{seed}", task

    def response(self, robots: Learned | str, number: int) -> Task:
        """The training of a fire against frozen robots."""
        assert self.best_response is not None
        fire = _with_budget(self.base.fire, self.best_response.decisions)
        settings, seed = replace(self.base, fire=fire), RESPONSES + number
        if robots == NOBODY:  # as in `train`: the fire then sees none
            scenario = replace(settings.scenario, robots_per_floor=0)
            settings = replace(settings, scenario=scenario)
        fixed: Any = {"robots": robots}
        return Task(self.building, self.arena.plan, settings, seed, fixed)

    # -- Tests ----------------------------------------------------------------------

    @cached_property
    def arena(self) -> Arena:
        """The tests' arena: the trainings' scenario, without the rule of training."""
        scenario = replace(self.base.scenario, training=False)
        return Arena(self.building, plan_of(load(self.building)), scenario)

    @property
    def responses(self) -> range:
        """The numbers of the fires that learn against each team."""
        return range(self.best_response.seeds if self.best_response else 0)

    @property
    def fires(self) -> dict[str, range]:
        """Each fire that every team meets, and the seeds of these evacuations."""
        test, first = self.test, self.test.seed
        words = [word for word in test.fires if word in FIRES]
        arms = [word for word in test.fires if word not in FIRES]
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


def _with_budget(settings: TrainerSettings, decisions: int) -> TrainerSettings:
    return replace(
        settings,
        max_steps=decisions,
        summary_freq=max(1, decisions // ROWS),
        checkpoint_interval=max(1, decisions // SAVED),
        keep_checkpoints=1,
    )


# -- In files -----------------------------------------------------------------------


def read(path: Path) -> Experiment:
    """Read an experiment's file. Raises SettingsError, OSError."""
    try:
        content = tomllib.loads(read_text(path))
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        raise SettingsError(f"{path}: this is no TOML: {error}") from None
    return record_from(Experiment, content, str(path))


def begin(experiment: Experiment, folder: Path) -> None:
    """Record the experiment in its folder, beside what it was. Raises OSError.

    An arm no longer asked for stays recorded: it may return, and has its trainings.
    """
    path, now = folder / ABOUT, _fixed(experiment)
    if path.exists():
        begun = read_json(path)
        now["arms"] = mapping(begun.get("arms"), ABOUT) | now["arms"]
        now["best_response"] = now["best_response"] or begun.get("best_response")
    content = {"version": reference.__version__, "game": reference.GAME} | now
    write_whole(path, json.dumps(content, indent=2).encode())


def refuse_changed(experiment: Experiment, folder: Path) -> None:
    """Raise RunError where the experiment in a folder is another one.

    More seeds, arms, fires and robots may be asked for than were.
    """
    path = folder / ABOUT
    if not path.exists():
        raise RunError(f"{folder}: there is no experiment to go on with.")
    begun = read_json(path)
    refuse_version(path, begun.get("version"), begun.get("game"))
    now = json.loads(json.dumps(_fixed(experiment)))
    arms, known = now.pop("arms"), mapping(begun.get("arms"), ABOUT)
    if now.pop("plan") != begun.get("plan"):
        raise RunError(f"building: the map differs from that of {path}.")
    if begun.get("best_response") is None:  # none was asked for yet
        del now["best_response"]
    now["arms"] = {arm: arms[arm] for arm in arms if arm in known}
    refuse_contradictions(f"the experiment in {folder}", rows_of_both(now, begun, ""))


def _fixed(experiment: Experiment) -> dict[str, Any]:
    """Collect what may not change during an experiment, as plain data."""
    test, response = experiment.test, experiment.best_response
    arms = map(experiment.of_arm, experiment.arms)
    plain = [asdict(settings) | {"against": fire} for settings, fire in arms]
    return {
        "plan": experiment.arena.plan,
        "tests": [test.seed, test.episodes, test.looking_ahead],
        "best_response": response and asdict(response),
        "arms": dict(zip(experiment.arms, plain, strict=True)),
    }
