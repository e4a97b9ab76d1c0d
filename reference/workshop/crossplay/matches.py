"""What an evaluation plays: which robots meet which fires, where, from which seeds.

Clause: F12.  All matches share one building and one scenario, so that their runs can be
paired by seed.  Checkpoints, if any, determine both.  A training's folder is pinned to
its newest checkpoint, though more may come while runs are played.
"""

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field, replace
from hashlib import sha256
from itertools import chain, product
from os.path import exists  # False for what no path can be, too
from pathlib import Path
from typing import Any, NamedTuple

import reference
from reference.building import building_of, plan_of
from reference.evaluation.bounds import critical_points
from reference.evaluation.score import Point
from reference.learning.settings import Side
from reference.paper import ROBOTS_PER_FLOOR, Scenario
from reference.simulation import Simulation
from reference.workshop.crossplay.contestants import WORST, Evacuation, contestant
from reference.workshop.files import naming, read_json, refuse_no_file, write_json
from reference.workshop.maps import load
from reference.workshop.plain import record_from
from reference.workshop.runs import (
    ContradictionError,
    RunError,
    refuse_version,
)
from reference.workshop.strategies import LEARNED, SCRIPTS, SHIPPED

BUILDING = "paper"  # unless asked otherwise
EPISODES = 100
"""[F12, chosen] runs of a match: half the width of survival's interval is then about
3 percentage points."""

ABOUT = "evaluation.json"
MOST_RUNS = 1_000_000
UNGUIDED = "none"  # no robots: people are unguided


Sides = list[tuple[Side, str]]
"""Contestants' words with their side, robots first."""


class Run(NamedTuple):
    """What a run follows from, in one arena; robots and fire by the words asked for."""

    robots: str
    fire: str
    seed: int


@dataclass(frozen=True)
class Arena:
    """Where all matches are played: building by name and as text, and scenario."""

    building: str
    plan: str
    scenario: Scenario

    @property
    def people(self) -> int:
        """How many people start."""
        return sum(self.scenario.start_counts(building_of(self.plan).floors))

    @property
    def points(self) -> tuple[Point, Point]:
        """The critical points of this building and scenario, reward and y each."""
        return critical_points(building_of(self.plan), self.scenario)


@dataclass(frozen=True)
class Pinned:
    """The checkpoint that a word named when the evaluation began."""

    path: str
    sha256: str


@dataclass(frozen=True)
class Evaluation:
    """All that determines its runs; run i of each match has seed + i.

    Raises RunError for none or too many runs.

    sample  draw learned policies' actions instead of taking the likeliest
    files   the checkpoint of each word that names one
    """

    arena: Arena
    robots: tuple[str, ...]
    fires: tuple[str, ...]
    seed: int = 0
    episodes: int = EPISODES
    sample: bool = False
    files: Mapping[str, Pinned] = field(default_factory=dict)

    def __post_init__(self) -> None:
        runs = len(self.robots) * len(self.fires) * self.episodes
        if not 1 <= runs <= MOST_RUNS or self.seed < 0:
            raise RunError(
                f"{runs} runs from seed {self.seed} on: ask for 1 to {MOST_RUNS:,}."
            )

    @property
    def seeds(self) -> range:
        """Seeds of the runs, the same for every match."""
        return range(self.seed, self.seed + self.episodes)

    @property
    def runs(self) -> list[Run]:
        """Everything there is to play, in order."""
        return [Run(*r) for r in product(self.robots, self.fires, self.seeds)]

    @property
    def sides(self) -> Sides:
        """All contestants."""
        return _sides(self.robots, self.fires)

    def evacuation(self, run: Run) -> Evacuation:
        """Describe one run for any process, with the files that its words mean."""
        robots, fire = (_word(word, self.files) for word in run[:2])
        where = self.arena.plan, self.arena.scenario
        return Evacuation(*where, robots, fire, run.seed, self.sample)

    def about(self) -> str:
        """Describe the evaluation in a line."""
        return (
            f"{building_of(self.arena.plan).title}, {self.arena.people} people: "
            f"{len(self.robots)} robots x {len(self.fires)} fires x {self.episodes} "
            f"seeds from {self.seed} on, {len(self.runs):,} runs"
        )


# -- Begin, and go on ----------------------------------------------------------------


def begin(
    robots: Sequence[str] = ("sweep",),
    fires: Sequence[str] = ("random",),
    building: str | None = None,
    people: int | None = None,
    seed: int = 0,
    episodes: int = EPISODES,
    sample: bool = False,
) -> Evaluation:
    """Make a new evaluation of some robots and fires, by the words of `contestant`.

    building, people: by default the first checkpoint's, else the paper's.
    Raises RunError for an unknown word, and for contestants that do not fit the arena;
    ValueError for more people than fit; MistakesError for the map; OSError for a file
    that cannot be read.
    """
    sides = _sides(robots, fires)
    files = _pinned(sides)
    if sample and not files:
        raise ContradictionError("--sample goes with a checkpoint. Leave it out here.")
    learned = _learned(sides, files)
    arena = _arena(building, people, next(iter(learned.values()), None))
    if not arena.scenario.robots_per_floor and {*robots} != {UNGUIDED}:
        scenario = replace(arena.scenario, robots_per_floor=ROBOTS_PER_FLOOR)
        arena = replace(arena, scenario=scenario)
    _refuse_misfits(learned, arena)
    if not arena.people:
        raise RunError("there is nobody to evacuate. Ask for at least 1 person.")
    Simulation(building_of(arena.plan), arena.scenario)  # refuses who does not fit
    words = _once(robots), _once(fires)
    return Evaluation(arena, *words, seed, episodes, sample, files)


def resume(
    folder: Path, robots: Sequence[str] = (), fires: Sequence[str] = ()
) -> Evaluation:
    """Resume the evaluation in a folder, with any further robots and fires.

    Raises RunError if there is none, if it is another version's, if it was edited or
    its checkpoints have changed; else as `begin`.
    """
    begun = read(folder / ABOUT)
    for file in begun.files.values():
        _refuse_changed(file)
    all_robots, all_fires = _once(begun.robots, robots), _once(begun.fires, fires)
    more = replace(begun, robots=all_robots, fires=all_fires)
    files = _pinned(more.sides) | dict(begun.files)
    _refuse_misfits(_learned(more.sides, files), begun.arena)
    return replace(more, files=files)


def _once(*words: Iterable[str]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(chain(*words)))


def _sides(robots: Iterable[str], fires: Iterable[str]) -> Sides:
    return [*(("robots", word) for word in robots), *(("fire", word) for word in fires)]


# -- Where they meet ----------------------------------------------------------------

Learned = dict[tuple[Side, str], Any]
"""Learned policies by side and word: each knows one building and one scenario."""


def _arena(building: str | None, people: int | None, policy: Any) -> Arena:
    """The arena of a learned policy, if any, else the paper's; or as asked for."""
    if policy is None:
        name = BUILDING if building is None else building
        scenario = Scenario() if people is None else Scenario(people=people)
        return Arena(name, plan_of(load(name)), scenario)
    scenario = policy.scenario_to_evaluate(people)
    if building is None:
        return Arena(policy.task.building, plan_of(policy.building), scenario)
    return Arena(building, plan_of(load(building)), scenario)


def _learned(sides: Sides, files: Mapping[str, Pinned]) -> Learned:
    """Load the learned policies, each from the file that its word is pinned to."""
    found = {}
    for side, word in sides:
        with _named(side, word):
            made = contestant(_word(word, files), side)
        if hasattr(made, "refuse_elsewhere"):
            found[side, word] = made
    return found


def _refuse_misfits(learned: Learned, arena: Arena) -> None:
    """Raise RunError for the first policy that does not fit here."""
    for (side, word), policy in learned.items():
        with _named(side, word):
            policy.refuse_elsewhere(building_of(arena.plan), arena.scenario)


@contextmanager
def _named(side: Side, word: str) -> Iterator[None]:
    """Name the contestant in its errors: there may be many."""
    try:
        yield
    except ValueError as error:
        raise RunError(f"--{side} {word}: {error}") from error


def unlike_training(evaluation: Evaluation) -> Iterator[str]:
    """Yield a line for each checkpoint that learned in another scenario.

    This is allowed: where people start, how far they see and the time limit do not
    affect a network's shape.
    """
    here = asdict(evaluation.arena.scenario)
    for (side, word), policy in _learned(evaluation.sides, evaluation.files).items():
        there = asdict(policy.scenario_to_evaluate())
        told = [f"{k} {v} (here {here[k]})" for k, v in there.items() if v != here[k]]
        if told:
            yield f"the {side} {word} learned with {', '.join(told)}"


# -- Which checkpoint a word means --------------------------------------------------


def _pinned(sides: Sides) -> dict[str, Pinned]:
    """Pin each word that names a checkpoint to the file that it means now."""
    words = [word for side, word in sides if word not in (*SCRIPTS[side], WORST)]
    paths = {word: SHIPPED if word == LEARNED else Path(word) for word in words}
    # for a path that is not there `contestant` has the better message
    return {word: _pin(path) for word, path in paths.items() if exists(path)}


def _pin(path: Path) -> Pinned:
    if path.is_dir():
        from reference.workshop.training.checkpoints import newest

        if (found := newest(path)) is None:
            raise RunError(f"{path}: there is no checkpoint in this folder.")
        path = found
    refuse_no_file(path)
    return Pinned(str(path), sha256(path.read_bytes()).hexdigest())


def _word(word: str, files: Mapping[str, Pinned]) -> str:
    return files[word].path if word in files else word


def _refuse_changed(file: Pinned) -> None:
    """Raise RunError unless the checkpoint is as it was when runs were played."""
    path = Path(file.path)
    if not path.is_file():
        raise RunError(
            f"{path}: runs were played with this checkpoint, which is not here. "
            "Go on where the evaluation was begun, or bring it back."
        )
    if sha256(path.read_bytes()).hexdigest() != file.sha256:
        raise RunError(
            f"{path}: is no more the checkpoint that runs were played with. "
            "Bring that one back, or begin anew in another folder."
        )


# -- In a file ----------------------------------------------------------------------


def write(evaluation: Evaluation, folder: Path) -> None:
    """Write the evaluation into its folder, whole or not at all. Raises OSError."""
    written_by = {"version": reference.__version__, "game": reference.GAME}
    content = written_by | asdict(evaluation)
    write_json(folder / ABOUT, content | {"sha256": _seal(content)})


def read(path: Path) -> Evaluation:
    """Read what `write` wrote. Raises ValueError for anything else, even if edited."""
    if not path.exists():
        raise RunError(
            f"{path.parent}: there is no evaluation to go on with. Leave --resume out "
            "to begin, or name the folder of one."
        )
    content = read_json(path)
    seal = content.pop("sha256", None)
    refuse_version(path, content.get("version", "unknown"), content.get("game", 1))
    if seal != _seal(content):
        raise RunError(
            f"{path}: was edited since its runs were played. Bring back what it was, "
            "or begin anew in another folder."
        )
    del content["version"], content["game"]
    with naming(path):
        return record_from(Evaluation, content, ABOUT)


def _seal(content: dict[str, Any]) -> str:
    """Digest all that was written, so that no edit passes unnoticed."""
    return sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()
