"""What an evaluation plays: which robots meet which fires, where, from which seeds.

Clause: F12.  All matches share one building and one scenario, so that their runs can be
paired by seed.  Checkpoints, if any, determine both.  A training's folder is pinned to
its newest checkpoint, though more may come while runs are played.
"""

import json
from collections.abc import Iterable, Mapping, Sequence
from copy import deepcopy
from dataclasses import asdict, dataclass, field, replace
from functools import lru_cache
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
from reference.workshop.crossplay.contestants import WORST, contestant, encounter
from reference.workshop.files import naming, read_json, refuse_no_file, write_json
from reference.workshop.maps import load
from reference.workshop.plain import record_from
from reference.workshop.runs import ContradictionError, RunError, refuse_version
from reference.workshop.strategies import LEARNED, SCRIPTS, SHIPPED

EPISODES = 100
"""[F12, chosen] runs of a match: half the width of survival's interval is then about
3 percentage points."""

ABOUT = "evaluation.json"
MOST_RUNS = 1_000_000

Players = list[tuple[Side, str]]
"""Sides and words, robots first."""

_loaded = lru_cache(maxsize=32)(contestant)  # copies are played: networks are read once


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

    @classmethod
    def of(cls, path: Path) -> "Pinned":
        """Digest a file. Raises OSError."""
        return cls(str(path), sha256(path.read_bytes()).hexdigest())


@dataclass(frozen=True)
class Evaluation:
    """All that determines its runs; run i of each match has seed + i.

    Plain data, from which any process can play. Raises RunError for too many runs.

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

    def simulation(self, run: Run) -> Simulation:
        """Set up a run, before its first tick."""
        sides: Players = [("robots", run.robots), ("fire", run.fire)]
        words = [(_word(word, self.files), side) for side, word in sides]
        both = [deepcopy(_loaded(*word, self.sample)) for word in words]
        building = building_of(self.arena.plan)
        return encounter(building, self.arena.scenario, both[0], both[1], run.seed)

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
    Raises InputError for an unknown word, for contestants that do not fit the arena,
    for more people than fit and for the map; OSError for a file that cannot be read.
    """
    players = _players(robots, fires)
    files = _pinned(players)
    if sample and not files:
        raise ContradictionError("--sample goes with a checkpoint. Leave it out here.")
    learned = _learned(players, files)
    arena = _arena(building, people, next(iter(learned.values()), None))
    if not arena.scenario.robots_per_floor and {*robots} != {"none"}:
        scenario = replace(arena.scenario, robots_per_floor=ROBOTS_PER_FLOOR)
        arena = replace(arena, scenario=scenario)
    _refuse_misfits(learned, arena)
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
    begun = _read(folder / ABOUT)
    for file in begun.files.values():
        if not Path(file.path).is_file() or Pinned.of(Path(file.path)) != file:
            raise RunError(
                f"{file.path}: is not here, or no more the checkpoint that runs were "
                "played with. Bring it back, or begin anew in another folder."
            )
    words = _once(begun.robots, robots), _once(begun.fires, fires)
    players = _players(*words)
    files = _pinned(players) | dict(begun.files)
    _refuse_misfits(_learned(players, files), begun.arena)
    return replace(begun, robots=words[0], fires=words[1], files=files)


def _once(*words: Iterable[str]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(chain(*words)))


def _players(robots: Iterable[str], fires: Iterable[str]) -> Players:
    return [*(("robots", word) for word in robots), *(("fire", word) for word in fires)]


def _arena(building: str | None, people: int | None, policy: Any) -> Arena:
    """The arena of a learned policy, if any, else the paper's; or as asked for."""
    if policy is not None:
        scenario = policy.scenario_to_evaluate(people)
        if building is None:
            return Arena(policy.task.building, plan_of(policy.building), scenario)
    else:
        scenario = Scenario() if people is None else Scenario(people=people)
    name = "paper" if building is None else building
    return Arena(name, plan_of(load(name)), scenario)


# -- Checkpoints ---------------------------------------------------------------------


def _pinned(players: Players) -> dict[str, Pinned]:
    """Pin each word that names a checkpoint to the file that it means now."""
    words = [word for side, word in players if word not in (*SCRIPTS[side], WORST)]
    paths = {word: SHIPPED if word == LEARNED else Path(word) for word in words}
    # for a path that is not there `contestant` has the better message
    return {w: Pinned.of(_file(path)) for w, path in paths.items() if exists(path)}


def _file(path: Path) -> Path:
    """The checkpoint that a path means: the newest one in a folder."""
    if path.is_dir():
        from reference.workshop.training.checkpoints import newest

        if (found := newest(path)) is None:
            raise RunError(f"{path}: there is no checkpoint in this folder.")
        path = found
    refuse_no_file(path)
    return path


def _word(word: str, files: Mapping[str, Pinned]) -> str:
    return files[word].path if word in files else word


def _learned(players: Players, files: Mapping[str, Pinned]) -> dict[str, Any]:
    """Load the learned policies; by the options that name them, for messages."""
    found = {}
    for side, word in players:
        with naming(option := f"--{side} {word}"):
            made = contestant(_word(word, files), side)
        if hasattr(made, "refuse_elsewhere"):
            found[option] = made
    return found


def _refuse_misfits(learned: Mapping[str, Any], arena: Arena) -> None:
    """Raise InputError for the first policy that does not fit here."""
    for option, policy in learned.items():
        with naming(option):
            policy.refuse_elsewhere(building_of(arena.plan), arena.scenario)


# -- In a file -----------------------------------------------------------------------


def write(evaluation: Evaluation, folder: Path) -> None:
    """Write the evaluation into its folder, whole or not at all. Raises OSError."""
    written_by = {"version": reference.__version__, "game": reference.GAME}
    content = written_by | asdict(evaluation)
    write_json(folder / ABOUT, content | {"sha256": _seal(content)})


def _read(path: Path) -> Evaluation:
    """Read what `write` wrote. Raises InputError for anything else, even if edited."""
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
    return record_from(Evaluation, content, str(path))


def _seal(content: dict[str, Any]) -> str:
    """Digest all that was written, so that no edit passes unnoticed."""
    return sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()
