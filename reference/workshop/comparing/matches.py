"""What an evaluation plays: which robots meet which fires, where, from which seeds.

All matches share one building and scenario, so that runs are paired
by seed.  Checkpoints bring both, where nothing else is asked for, and must agree: the
order of words changes no number.  A training's folder stands for the checkpoint that is
its newest when the evaluation begins.
"""

import json
import os
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from copy import deepcopy
from dataclasses import asdict, dataclass, field, replace
from itertools import product
from math import inf
from pathlib import Path
from typing import Annotated, Any

import reference
from reference import paper
from reference.building import Building, building_of
from reference.floorplan import Drawing
from reference.learning.settings import SIDES, Side
from reference.paper import InputError, Scenario
from reference.simulation import Simulation
from reference.workshop.comparing.named import (
    PLAYER_NAMES,
    meaning_of,
    set_up_match,
    strategy_named,
    strategy_of,
    title_of,
)
from reference.workshop.maps import drawing_now, load, plan_of, same_cells
from reference.workshop.storage.files import errors_naming, read_json, write_json
from reference.workshop.storage.numbers import paper_numbers
from reference.workshop.storage.records import (
    Allowed,
    check_values,
    checked_value,
    record_from,
)
from reference.workshop.storage.runs import (
    ContradictionError,
    digest_of,
    other_numbers,
    refuse_changed,
    refuse_numbers,
    refuse_version,
)
from reference.workshop.storage.scenarios import differing, in_words, with_stated
from reference.workshop.strategies import ANY_MAP
from reference.workshop.strategies.own import is_code

DEFAULT_EPISODES = 100
"""[F12, chosen] runs of a match: half the width of survival's interval is then about
3 percentage points."""

EVALUATION_FILE = "evaluation.json"
MAP = "--building"  # in digests, as no player can be called
MOST_RUNS = 1_000_000

RunKey = tuple[str, str, int]
"""Robots and fire, by the words asked for, and a seed."""


@dataclass(frozen=True)
class Arena:
    """Where all matches are played: building by name and as text, and scenario."""

    building: str
    plan: str
    scenario: Scenario

    @property
    def drawn(self) -> Building:
        """The building."""
        return building_of(self.plan)

    @property
    def people(self) -> int:
        """How many people start."""
        return sum(self.scenario.start_counts(self.drawn.floors))

    @property
    def changes(self) -> dict[str, Any]:
        """The scenario's fields that differ from the default, by name."""
        default = Scenario()
        names = differing(self.scenario, default)
        return {name: getattr(self.scenario, name) for name in names}

    def about(self) -> str:
        """Say where and under what: all of the scenario that is not the default."""
        names = [name for name in self.changes if name != "people"]  # told anyway
        under = f", {in_words(self.scenario, names)}" if names else ""
        people = _count(self.people, "person", "people")
        return f"{self.drawn.title}, {people}{under}"


@dataclass(frozen=True)
class Evaluation:
    """All that determines its runs; run i of each match has seed + i.

    Plain data, from which any process can play. Raises InputError for values that
    cannot be, and for too many runs.

    sample  draw learned policies' actions instead of taking the likeliest
    errors  metres that robots observe wrongly by, in the worst case [F4]
    files   the checkpoint that a word means, if it names a folder
    digests  of all files that words and the map's name meant at the beginning
    """

    arena: Arena
    robots: tuple[str, ...]
    fires: tuple[str, ...]
    seed: Annotated[int, Allowed(low=0)] = 0
    episodes: int = DEFAULT_EPISODES
    sample: bool = False
    files: Mapping[str, str] = field(default_factory=dict)
    errors: Annotated[int, Allowed(low=0)] = 0
    digests: Mapping[str, Mapping[str, str]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if hasattr(value, "tolist"):  # numpy's, which JSON cannot write
                object.__setattr__(self, name, value.tolist())
        object.__setattr__(self, "robots", _checked_words("robots", self.robots))
        object.__setattr__(self, "fires", _checked_words("fires", self.fires))
        check_values(self)
        runs = len(self.robots) * len(self.fires) * self.episodes
        if not 1 <= runs <= MOST_RUNS:
            raise InputError(
                f"{runs} runs from seed {self.seed} on: ask for 1 to {MOST_RUNS:,}."
            )

    @property
    def seeds(self) -> range:
        """Seeds of the runs, the same for every match."""
        return range(self.seed, self.seed + self.episodes)

    @property
    def runs(self) -> list[RunKey]:
        """Everything there is to play, in order."""
        return list(product(self.robots, self.fires, self.seeds))

    def simulations(self, runs: Iterable[RunKey]) -> Iterator[Simulation]:
        """Set up runs one by one, before their first tick; copies of the same players.

        Raises as `strategy_named` does, and InputError for a network or code whose file
        is another one than at the beginning.
        """
        building = self.arena.drawn
        kept: dict[tuple[str, Side], Any] = {}
        for robots, fire, seed in runs:
            yield set_up_match(
                building,
                self.arena.scenario,
                robots=self._player(robots, "robots", building, kept),
                fire=self._player(fire, "fire", building, kept),
                seed=seed,
                errors=self.errors,
            )

    def _player(
        self,
        word: str,
        side: Side,
        building: Building,
        kept: dict[tuple[str, Side], Any],
    ) -> Any:
        """Make who plays a side by a word, or a copy of the one that was kept."""
        if is_code(word):  # it may remember something elsewhere than in itself
            return self._made(word, side, building)
        if (word, side) not in kept:
            kept[word, side] = self._made(word, side, building)
        return deepcopy(kept[word, side])

    def _made(self, word: str, side: Side, building: Building) -> Any:
        """Make who plays a side by a word; refuse files that are not as at first."""
        scenario = self.arena.scenario
        file = self.files.get(word, word)
        named = strategy_named(file, side, self.sample)
        player = strategy_of(named, side, building, scenario)
        refuse_changed(self.digests, {word: meaning_of(file, building, scenario)})
        return player

    @property
    def titles(self) -> dict[str, str]:
        """What tables and pictures call those who play, by their words."""
        words = {*self.robots, *self.fires}
        here = self.arena.drawn, self.arena.scenario
        return {word: title_of(word, *here) for word in words}

    def about(self) -> str:
        """Describe the evaluation in a line: where, under what, who, how often."""
        played = [
            _count(len(self.robots), "robot strategy", "robot strategies"),
            _count(len(self.fires), "fire", "fires"),
            f"{_count(self.episodes, 'seed', 'seeds')} each from {self.seed} on",
        ]
        runs = _count(len(self.runs), "run", "runs")
        return f"{self.where()}: {', '.join(played)}: {runs}"

    def where(self) -> str:
        """Say where and under what, errors of observation included."""
        off = f", errors of observation up to {self.errors} m" if self.errors else ""
        return self.arena.about() + off


def _count(number: int, one: str, several: str) -> str:
    """Say how many there are of something."""
    return f"{number:,} {one if number == 1 else several}"


def begin_evaluation(
    robots: Sequence[str] = ("sweep",),
    fires: Sequence[str] = ("random",),
    building: str | None = None,
    people: int | None = None,
    seed: int = 0,
    episodes: int = DEFAULT_EPISODES,
    sample: bool = False,
    errors: int = 0,
    scenario: Mapping[str, Any] | None = None,
) -> Evaluation:
    """Make a new evaluation of some robots and fires, by the words of `strategy_named`.

    building, people: by default those of the checkpoints, else the paper's
    scenario: fields that are stated, by name; others are those of the checkpoints
    Raises InputError for an unknown word, for strategies that do not fit the arena or
    each other, for more people than fit and for the map; OSError for a file that cannot
    be read.
    """
    # who has learned
    robots = _checked_words("robots", robots)
    fires = _checked_words("fires", fires)
    files = _newest_checkpoints((*robots, *fires))
    learned = _load_policies(robots, fires, files)
    if sample and not any(hasattr(policy, "sample") for policy in learned.values()):
        raise ContradictionError("--sample goes with a checkpoint. Leave it out here.")

    # under what: as they learned, but for what is stated
    stated = dict(scenario or {})
    if people is not None:
        stated |= {"people": people, "people_per_floor": None}
    common = with_stated(_scenario_of(learned, stated), stated, "scenario")
    asked = "robots_per_floor" in stated
    if not asked and not common.robots_per_floor and {*robots} != {"none"}:
        common = replace(common, robots_per_floor=paper.ROBOTS_PER_FLOOR)

    arena = _arena_of(learned, building, common)
    _refuse_misfits(learned, arena)
    begun = Evaluation(
        arena=arena,
        robots=robots,
        fires=fires,
        seed=seed,
        episodes=episodes,
        sample=sample,
        files=files,
        errors=errors,
    )
    return with_digests(begun)


def _arena_of(
    learned: Mapping[str, Any], building: str | None, scenario: Scenario
) -> Arena:
    """Choose where to play: as is asked, else where the first policy learned."""
    policy = next(iter(learned.values()), None)
    if policy and building is None:
        return Arena(policy.name, plan_of(policy.building), scenario)
    name = "paper" if building is None else building
    return Arena(name, plan_of(load(name)), scenario)


def _scenario_of(learned: Mapping[str, Any], stated: Collection[str]) -> Scenario:
    """Take the scenario in which all policies learned, or the default without any.

    stated: fields in which they may differ. Raises InputError where others differ: no
    order of words may say which of two scenarios a table is of.
    """
    common = Scenario()
    first = ""
    for option, policy in learned.items():
        own = replace(policy.scenario, training=False)
        if not first:
            first = option
            common = own
        names = [name for name in differing(own, common) if name not in stated]
        if names:
            words = " ".join(f"{name}=VALUE" for name in names)
            raise InputError(
                f"{option}: learned under {in_words(own, names)}, {first} under "
                f"{in_words(common, names)}, and a table is of one scenario. Evaluate "
                f"them apart, or say which: --scenario {words}"
            )
    return common


def notes(evaluation: Evaluation) -> list[str]:
    """Say what a reader of the runs would not expect, a line each.

    That the drawing is not the one in the file of its name, that nobody guides, and
    that a policy learned under another scenario or with other numbers. Raises as
    `strategy_named` does.
    """
    arena = evaluation.arena
    guides = [word for word in evaluation.robots if word != "none"]
    lines = []
    if guides and not arena.scenario.robots_per_floor:
        lines.append(f"robots_per_floor is 0: no robot for {', '.join(guides)}")
    if evaluation.errors and not (guides and arena.scenario.robots_per_floor):
        lines.append("no robot observes anything: --errors changes nothing")
    kept = {arena.building: _digest_of_drawing(arena.drawn.drawing)}
    now = _meaning_of_map(arena)
    if now and now != kept:
        lines.append(f"{arena.building} has changed since; this plays the kept drawing")
    learned = _load_policies(evaluation.robots, evaluation.fires, evaluation.files)
    for option, policy in learned.items():
        plays = policy.playing_in(arena.drawn, arena.scenario)
        lines += [f"{option}: {line}" for line in _notes_on(policy, plays, arena)]
    return lines


def _notes_on(policy: Any, plays: Any, arena: Arena) -> Iterator[str]:
    """Say where and with what a policy learned, if it plays elsewhere or with others.

    plays: the policy that plays in the arena for it
    """
    if plays.title == ANY_MAP:
        yield f"{ANY_MAP}: the network that knows no building plays here"
    else:
        same = same_cells(policy.building.drawing, arena.drawn.drawing)
        where = getattr(policy, "where", policy.building.title)
        if not same or where != policy.building.title:
            yield f"learned in {where}; here it plays in {arena.drawn.title}"
        others = differing(policy.scenario, arena.scenario)
        names = [name for name in others if name not in policy.varied]
        if names:
            here = in_words(arena.scenario, names)
            own = in_words(policy.scenario, names)
            yield f"learned under {own}; here it plays under {here}"
    _, most = plays.varied.get("robots_per_floor", (0, inf))
    if plays.side == "robots" and arena.scenario.robots_per_floor > most:
        yield f"it learned with at most {most} robots a floor"
    numbers = other_numbers(plays.numbers)
    if numbers:
        yield f"learned with {numbers}"


def with_digests(evaluation: Evaluation) -> Evaluation:
    """Add digests of all that its words and the name of its map mean now."""
    words = dict.fromkeys((*evaluation.robots, *evaluation.fires))
    files = evaluation.files
    here = evaluation.arena.drawn, evaluation.arena.scenario
    digests = {word: meaning_of(files.get(word, word), *here) for word in words}
    digests[MAP] = _meaning_of_map(evaluation.arena)
    known = {word: found for word, found in digests.items() if found}
    return replace(evaluation, digests=known)


def _meaning_of_map(arena: Arena) -> dict[str, str]:
    """Digest the drawing that a map's name loads; nothing where there is none.

    One that differs from the arena's in names and labels alone counts as the same.
    """
    name = arena.building
    if "\n" in name:  # it is the map itself
        return {}
    try:
        drawing = drawing_now(name)
    except InputError:  # it cannot be built now
        return {name: ""}
    if drawing is None:
        return {}
    if same_cells(drawing, arena.drawn.drawing):
        drawing = arena.drawn.drawing
    return {name: _digest_of_drawing(drawing)}


def _digest_of_drawing(drawing: Drawing) -> str:
    return digest_of(repr(drawing).encode())


def refuse_mixing(
    evaluation: Evaluation, folder: Path, played: set[str]
) -> Mapping[str, Mapping[str, str]]:
    """Raise InputError if a folder's runs are of other files, numbers or terms.

    played: the words of these runs; a word without runs may mean what it likes

    Returns the digests that these runs were made with.
    """
    path = folder / EVALUATION_FILE
    if not played:
        return {}
    if not path.exists():
        raise InputError(
            f"{path}: is gone, and with it what the runs beside it are of. Put it "
            "back, or take another folder."
        )
    content = read_json(path)
    refuse_numbers(path, content.get("numbers"))
    if content.get("terms", _terms_of(evaluation)) != _terms_of(evaluation):
        raise InputError(
            f"{path}: the runs beside it are of another scenario, --sample or --errors."
            " Put these back, or take another folder."
        )
    digests = content.get("digests", {})
    with errors_naming(path):
        begun = checked_value("digests", digests, Mapping[str, Mapping[str, str]])
        mixed = {word: begun[word] for word in begun if word in {*played, MAP}}
        refuse_changed(mixed, evaluation.digests)
    return mixed


def resume_evaluation(
    folder: str | Path,
    robots: Sequence[str] = (),
    fires: Sequence[str] = (),
    files: Mapping[str, str] | None = None,
) -> Evaluation:
    """Resume the evaluation in a folder, with any further robots and fires.

    files: the checkpoints that words mean elsewhere, and so here, too
    Raises InputError if there is none or if it is another version's or was begun with
    other numbers; else as `begin_evaluation`.
    """
    robots = _checked_words("robots", robots)
    fires = _checked_words("fires", fires)
    path = Path(folder) / EVALUATION_FILE
    if not path.exists():
        raise InputError(
            f"{folder}: there is no evaluation to go on with. Leave --resume out to "
            "begin, or name the folder of one."
        )
    content = read_json(path)
    refuse_version(path, content.pop("version", "unknown"), content.pop("game", 1))
    numbers = content.pop("numbers", None)
    content.pop("terms", None)  # `refuse_mixing` knows what has played
    begun = record_from(Evaluation, content, str(path))
    with errors_naming(path):
        # code that raised may be mended: `refuse_mixing` knows what has played, later
        kept = {word: x for word, x in begun.digests.items() if not is_code(word)}
        refuse_changed(kept, with_digests(begun).digests)
    refuse_numbers(path, numbers)  # after code of your own, which may change some
    known = dict(files or {}) | dict(begun.files)
    files = _newest_checkpoints((*robots, *fires)) | known
    robots = _checked_words("robots", (*begun.robots, *robots))
    fires = _checked_words("fires", (*begun.fires, *fires))
    with errors_naming(path):
        _refuse_misfits(_load_policies(robots, fires, files), begun.arena)
    return with_digests(replace(begun, robots=robots, fires=fires, files=files))


def _checked_words(name: str, given: Any) -> tuple[str, ...]:
    """Take words for those who play a side, each once. Raises InputError for others."""
    if isinstance(given, str) or not isinstance(given, Collection):
        raise InputError(f"{name} is {given!r:.60}: give a list, [{given!r:.60}]")
    for word in given:
        if not isinstance(word, str):
            raise InputError(
                f"one of {name} is {word!r:.60}: it must be a word, such as 'random'"
            )
    return tuple(dict.fromkeys(given))


def _newest_checkpoints(words: Iterable[str]) -> dict[str, str]:
    """The newest checkpoint of each word that names a folder, and no strategy."""
    names = {*PLAYER_NAMES["robots"], *PLAYER_NAMES["fire"]}
    folders = [word for word in words if word not in names and os.path.isdir(word)]
    if not folders:
        return {}
    from reference.workshop.training.checkpoints import newest_checkpoint

    return {word: str(newest_checkpoint(Path(word)) or word) for word in folders}


def _load_policies(
    robots: Iterable[str], fires: Iterable[str], files: Mapping[str, str]
) -> dict[str, Any]:
    """Load the policies that learned, by option."""
    policies = dict[str, Any]()
    for side, words in zip(SIDES, (robots, fires), strict=True):
        for word in words:
            made = strategy_named(files.get(word, word), side)
            if hasattr(made, "refuse_elsewhere"):
                policies[f"--{side} {word}"] = made
    return policies


def _refuse_misfits(learned: Mapping[str, Any], arena: Arena) -> None:
    """Raise InputError for the first policy that does not fit, or too many people."""
    for option, policy in learned.items():
        with errors_naming(option):
            policy.refuse_elsewhere(arena.drawn, arena.scenario)
    Simulation(arena.drawn, arena.scenario)


def write_evaluation(evaluation: Evaluation, folder: Path) -> None:
    """Write the evaluation into its folder, whole or not at all. Raises OSError.

    Beside it stand version, game, the paper's numbers and a digest of the terms.
    """
    head: dict[str, Any] = {"version": reference.__version__, "game": reference.GAME}
    head |= {"numbers": paper_numbers(), "terms": _terms_of(evaluation)}
    write_json(folder / EVALUATION_FILE, head | asdict(evaluation))


def _terms_of(evaluation: Evaluation) -> str:
    """Digest under what its runs are played: they do not tell it themselves."""
    scenario = asdict(evaluation.arena.scenario)
    terms = [scenario, evaluation.sample, evaluation.errors]
    return digest_of(json.dumps(terms).encode())
