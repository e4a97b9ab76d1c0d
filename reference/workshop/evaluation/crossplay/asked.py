"""What an evaluation plays: which robots meet which fires, where, from which seeds.

Clause: F12.  All matches share one building and one scenario, so that their runs can be
paired by seed.  Checkpoints, if any, determine both.  A training's folder is pinned to
its newest checkpoint, though more may come while runs are played.
"""

import hashlib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field, replace
from itertools import product
from os.path import exists
from pathlib import Path
from typing import Any

import reference
from reference.building import building_of, plan_of
from reference.evaluation.bounds import critical_points
from reference.evaluation.score import Point
from reference.learning.settings import Side
from reference.paper import ROBOTS_PER_FLOOR, Scenario
from reference.simulation import Simulation
from reference.workshop.evaluation.contestants import CRITIC, WORST, contestant
from reference.workshop.evaluation.crossplay.records import Key, Match
from reference.workshop.files import naming, read_json, refuse_no_file, write_json
from reference.workshop.maps import load
from reference.workshop.plain import record_from
from reference.workshop.runs import (
    ContradictionError,
    RunError,
    building_asked,
    refuse_contradictions,
    refuse_used,
    refuse_version,
)
from reference.workshop.strategies import LEARNED, SCRIPTS, SHIPPED

BUILDING, ROBOTS, FIRES = "paper", ("sweep",), ("random",)  # unless asked otherwise
EPISODES = 100
"""[F12, chosen] runs of a match: half the width of survival's interval is then about
3 percentage points."""

ABOUT = "evaluation.json"
MOST_RUNS = 1_000_000
UNGUIDED = "none"  # no robots: people are unguided


@dataclass(frozen=True)
class Asked:
    """What was asked for by the options of `evaluate`; None where nothing was."""

    robots: tuple[str, ...] | None = None
    fire: tuple[str, ...] | None = None
    building: str | None = None
    people: int | None = None
    seed: int | None = None
    episodes: int | None = None
    sample: bool | None = None


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
class File:
    """The checkpoint that a word names: the word with its path, and its content."""

    word: str
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
    files: Mapping[str, File] = field(default_factory=dict)

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
    def matches(self) -> list[Match]:
        """All robots against all fires."""
        return [Match(*pair) for pair in product(self.robots, self.fires)]

    @property
    def runs(self) -> list[Key]:
        """Everything there is to play, in order."""
        return [(*match, seed) for match in self.matches for seed in self.seeds]

    def word(self, word: str) -> str:
        """Look up a contestant's word, with its checkpoint's file for a folder."""
        return self.files[word].word if word in self.files else word

    def about(self) -> str:
        """Describe the evaluation in a line."""
        return (
            f"{building_of(self.arena.plan).title}, {self.arena.people} people: "
            f"{len(self.robots)} robots x {len(self.fires)} fires x {self.episodes} "
            f"seeds from {self.seed} on, {len(self.runs):,} runs"
        )


# -- Begin, and go on ----------------------------------------------------------------


def begin(asked: Asked, folder: Path | None = None) -> Evaluation:
    """Make a new evaluation; its folder, if any, is empty or not there yet.

    Raises RunError for any other folder, for an unknown word, and for contestants that
    do not fit the arena; ValueError for more people than fit; MistakesError for the
    map; OSError for a file that cannot be read.
    """
    if folder is not None:
        refuse_used(folder)
    robots, fires = _once(asked.robots or ROBOTS), _once(asked.fire or FIRES)
    _refuse_unguided(robots, fires)
    files = _files(robots, fires)
    if asked.sample and not files:
        raise ContradictionError("--sample goes with a checkpoint. Leave it out here.")
    return Evaluation(
        arena=_arena(asked, robots, _trained(robots, fires, files)),
        robots=robots,
        fires=fires,
        seed=asked.seed or 0,
        episodes=EPISODES if asked.episodes is None else asked.episodes,
        sample=bool(asked.sample),
        files=files,
    )


def resume(asked: Asked, folder: Path) -> Evaluation:
    """Resume the evaluation in a folder, with any further robots and fires.

    Raises RunError if there is none, or if it is another version's; InputError if it
    is damaged or its checkpoints have changed; ContradictionError for the first option
    that differs from what was begun; else as `begin`.
    """
    path = folder / ABOUT
    begun = read(path)
    arena = begun.arena
    refuse_contradictions(
        f"the evaluation in {folder}",
        (
            ("--people", asked.people, arena.people),
            ("--seed", asked.seed, begun.seed),
            ("--episodes", asked.episodes, begun.episodes),
            ("--sample", asked.sample, begun.sample),
            building_asked(asked.building, arena.building, arena.plan),
        ),
    )
    with naming(path):
        for file in begun.files.values():
            _refuse_changed(file)
        _refuse_misfits(_trained(begun.robots, begun.fires, begun.files), arena)
    robots = _once([*begun.robots, *(asked.robots or ())])
    fires = _once([*begun.fires, *(asked.fire or ())])
    _refuse_unguided(robots, fires)
    files = {**_files(robots, fires), **begun.files}
    _refuse_misfits(_trained(robots, fires, files), arena)
    return replace(begun, robots=robots, fires=fires, files=files)


def _refuse_unguided(robots: Sequence[str], fires: Sequence[str]) -> None:
    """Raise ContradictionError for a critic of robots who are not there."""
    if UNGUIDED in robots and any(fire.startswith(CRITIC) for fire in fires):
        raise ContradictionError(
            f"--fire {CRITIC}FILE asks what the robots' critic expects, and with "
            f"--robots {UNGUIDED} there are none. Leave one of them out."
        )


def _once(words: Iterable[str]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(words))


def _sides(robots: Iterable[str], fires: Iterable[str]) -> list[tuple[Side, str]]:
    return [*(("robots", word) for word in robots), *(("fire", word) for word in fires)]


# -- Where they meet ----------------------------------------------------------------

Trained = dict[tuple[Side, str], Any]
"""Learned policies by side and word: each knows one building and one scenario."""


def _arena(asked: Asked, robots: tuple[str, ...], trained: Trained) -> Arena:
    """Take the first checkpoint's arena, else the paper's, unless asked otherwise."""
    if not trained:
        name = BUILDING if asked.building is None else asked.building
        scenario = Scenario()
        if asked.people is not None:
            scenario = replace(scenario, people=asked.people)
        building = load(name)
    else:
        first = next(iter(trained.values()))
        name, building = first.task.building, first.building
        if asked.building is not None:
            name, building = asked.building, load(asked.building)
        scenario = first.scenario_to_evaluate(asked.people)
        if not scenario.robots_per_floor and robots != (UNGUIDED,):
            scenario = replace(scenario, robots_per_floor=ROBOTS_PER_FLOOR)
    arena = Arena(name, plan_of(building), scenario)
    _refuse_misfits(trained, arena)
    _refuse_crowds(arena)
    return arena


def _refuse_crowds(arena: Arena) -> None:
    """Raise RunError for no people, InputError for more people than fit."""
    if not arena.people:
        raise RunError("there is nobody to evacuate. Ask for at least 1 person.")
    Simulation(building_of(arena.plan), arena.scenario)


def _trained(
    robots: tuple[str, ...], fires: tuple[str, ...], files: Mapping[str, File]
) -> Trained:
    """Load the learned policies, robots first."""
    found = {}
    for side, word in _sides(robots, fires):
        with _named(side, word):
            made = contestant(files[word].word if word in files else word, side)
        if hasattr(made, "refuse_elsewhere"):
            found[side, word] = made
    return found


def _refuse_misfits(trained: Trained, arena: Arena) -> None:
    """Raise RunError for the first policy that does not fit here."""
    for (side, word), player in trained.items():
        with _named(side, word):
            player.refuse_elsewhere(building_of(arena.plan), arena.scenario)


def unlike_training(evaluation: Evaluation) -> Iterator[str]:
    """Yield a line for each checkpoint that learned in another scenario.

    This is allowed: where people start, how far they see and the time limit do not
    affect a network's shape. Raises as `begin` for a checkpoint that has gone since.
    """
    here = asdict(evaluation.arena.scenario)
    trained = _trained(evaluation.robots, evaluation.fires, evaluation.files)
    for (side, word), player in trained.items():
        there = asdict(player.scenario_to_evaluate())
        other = [name for name in there if here[name] != there[name]]
        if other:
            told = (f"{name} {there[name]} (here {here[name]})" for name in other)
            yield f"the {side} {word} learned with {', '.join(told)}"


@contextmanager
def _named(side: Side, word: str) -> Iterator[None]:
    """Name the contestant in its errors: there may be many."""
    try:
        yield
    except ValueError as error:
        raise RunError(f"--{side} {word}: {error}") from error


# -- Which checkpoint a word means --------------------------------------------------


def _files(robots: tuple[str, ...], fires: tuple[str, ...]) -> dict[str, File]:
    """Pin each word that names a checkpoint to the file that it means now."""
    named = [w for side, w in _sides(robots, fires) if w not in (*SCRIPTS[side], WORST)]
    return {word: file for word in named if (file := _file(word))}


def _file(word: str) -> File | None:
    """Find the checkpoint that a word names, as a whole or behind a colon."""
    parts = word.split(":")
    ends = [":".join(parts[k:]) for k in range(len(parts))]
    named = next((end for end in ends if end and exists(end)), None)
    if word == LEARNED:
        return File(str(SHIPPED), str(SHIPPED), _digest(SHIPPED))
    if named is None:  # `contestant` gives the better message
        return None
    path = Path(named)
    if path.is_dir():
        from reference.workshop.training.checkpoints import newest

        if (found := newest(path)) is None:
            raise RunError(f"{path}: there is no checkpoint in this folder.")
        path = found
    refuse_no_file(path)
    pinned = word.removesuffix(named) + str(path)
    return File(pinned, str(path), _digest(path))


def _digest(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def _refuse_changed(file: File) -> None:
    """Raise RunError unless the checkpoint is as it was when runs were played."""
    path = Path(file.path)
    if not path.is_file():
        raise RunError(
            f"{path}: runs were played with this checkpoint, which is not here. "
            "Go on where the evaluation was begun, or bring it back."
        )
    if _digest(path) != file.sha256:
        raise RunError(
            f"{path}: is no more the checkpoint that runs were played with. "
            "Bring that one back, or begin anew in another folder."
        )


# -- In a file ----------------------------------------------------------------------


def write(evaluation: Evaluation, folder: Path) -> None:
    """Write the evaluation into its folder, whole or not at all. Raises OSError."""
    written_by = {"version": reference.__version__, "game": reference.GAME}
    write_json(folder / ABOUT, written_by | asdict(evaluation))


def read(path: Path) -> Evaluation:
    """Read what `write` wrote. Raises ValueError for anything else."""
    if not path.exists():
        raise RunError(
            f"{path.parent}: there is no evaluation to go on with. Leave --resume out "
            "to begin, or name the folder of one."
        )
    content = read_json(path)
    version, game = content.pop("version", "unknown"), content.pop("game", 1)
    refuse_version(path, version, game)
    found = record_from(Evaluation, content, str(path))
    with naming(path):
        _refuse_crowds(found.arena)
    return found
