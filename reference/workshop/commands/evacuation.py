"""Evacuations: the first look, which compares three, and the command evacuate."""

from argparse import Namespace
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import asdict
from math import isnan
from pathlib import Path
from statistics import mean
from typing import Any

from tqdm import tqdm

from reference.learning.settings import SIDES
from reference.simulation import Simulation
from reference.workshop.commands import options
from reference.workshop.commands.common import format_table, print_note, print_report
from reference.workshop.comparing.matches import (
    Arena,
    Evaluation,
    begin_evaluation,
    notes,
)
from reference.workshop.comparing.named import DESCRIPTIONS, describe
from reference.workshop.measuring.crowding import Crowding
from reference.workshop.measuring.recording import recording, remarks, ticks
from reference.workshop.storage.files import refuse_unwritable
from reference.workshop.storage.runs import ContradictionError
from reference.workshop.storage.scenarios import list_keys
from reference.workshop.storage.workers import workers
from reference.workshop.strategies import LEARNED

Pair = tuple[str, str]
"""Who plays the robots, and who the fire."""

Facts = dict[str, Any]

PLAYED = ("robots", "fire", "seed")  # what a run played; the rest came of it
FILMED: list[Pair] = [("none", "random"), ("escort", "random")]
LEARNED_TOO: Pair = (LEARNED, "random")
FILM_FILE = Path("evacuation.html")
PAIRED = (
    "at most three: the first robots meet the first fire, the second the second, and "
    "one alone meets all; default: {}"
)
EPISODES_HELP = "how many; episode i uses seed + i; default: 1"
MOST_FILMED = 3  # pairs side by side
CHOSEN_SEED = 56
"""A seed whose film shows, from 80 s on, what guides are worth.

Its three evacuations end within three people of the means.
"""
MEAN_OUT = {FILMED[0]: 28.9, FILMED[1]: 37.5, LEARNED_TOO: 37.5}
"""How many of 40 get out on average: `tutorials/tables/contest.json`, 200 seeds."""


@options.command(
    "--seed 7 --animate film.gif",
    options.output("--animate", options.FILMS, "the film", FILM_FILE),
    options.seed("one that shows the difference early"),
    options.json("seed", "runs"),
)
def first_look(arguments: Namespace) -> None:
    """Plays one seed without guides, with guides, and with a network that ships."""
    seed = CHOSEN_SEED if arguments.seed is None else arguments.seed
    film = _Film(arguments.animate)
    with workers(1) as other:  # it loads torch, which is slow, in the meantime
        learned = other.submit(_play_one_seed, [LEARNED_TOO], seed)
        arena, runs = _play_one_seed(FILMED, seed, film)
        runs += learned.result()[1]  # its arena is the same

    chosen = ", chosen to show the difference early" if seed == CHOSEN_SEED else ""
    lines = [f"{arena.building}, {arena.people} people, seed {seed}{chosen}"]
    for pair, run in zip([*FILMED, LEARNED_TOO], runs, strict=True):
        health = f"health {run['mean_health'] or 0:.0f} of 100"
        run["mean_evacuated"] = MEAN_OUT[pair]
        mean_out = f"mean of 200 seeds: {MEAN_OUT[pair]:.1f}"
        out = f"{run['evacuated']:3} get out alive, {health}; {mean_out}"
        lines.append(f"{_heading(pair) + ':':33}{out}")
    print_report(arguments, {"seed": seed, "runs": runs}, "\n".join(lines))
    film.tell()


class _Output:
    """Something to write; why it could not be written is told after the figures."""

    def __init__(self, path: Path):
        self.path = path
        self.error: OSError | None = None

    @contextmanager
    def writing(self) -> Iterator[None]:
        """Keep an OSError of the block for later."""
        try:
            yield
        except OSError as error:
            self.error = error

    def tell(self) -> None:
        """Say that it is written. Raises OSError if it is not."""
        if self.error:
            raise self.error
        print_note(f"written: {self.path}")


class _Film(_Output):
    """The file of a film."""

    def __init__(self, path: Path):
        """Raise OSError if it cannot be written now."""
        refuse_unwritable(path)
        super().__init__(path)

    def make(
        self,
        simulations: Sequence[Simulation],
        headings: Sequence[str],
        going: Iterator[None],
    ) -> None:
        """Film simulations while they run."""
        from reference.workshop.drawing.film import animate  # loads matplotlib

        with self.writing():
            animate(simulations, self.path, headings, going)


class _Record(_Output):
    """The folder of a recording."""

    @contextmanager
    def of(self, simulation: Simulation) -> Iterator[Callable[[], None]]:
        """Record a simulation in the block, as `recording` does."""
        with ExitStack() as stack:
            yield stack.enter_context(recording(simulation, self.path))
            with self.writing():
                stack.close()

    def tell(self) -> None:
        """Say what to know of it, too."""
        super().tell()
        for line in remarks(self.path):
            print_note(f"in {self.path}: {line}")


def _play_one_seed(
    pairs: Sequence[Pair], seed: int, film: _Film | None = None
) -> tuple[Arena, list[Facts]]:
    """Play a seed with each pair in the paper's building; return what came of each."""
    robots, fires = zip(*pairs, strict=True)
    evaluation = begin_evaluation(robots, fires, seed=seed, episodes=1)
    return evaluation.arena, _play_episode(evaluation, pairs, seed, film)


@options.command("strategies", options.json("robots", "fire"))
def strategies(arguments: Namespace) -> None:
    """Says in a line each what every robot strategy and every fire does."""
    print_report(arguments, DESCRIPTIONS, options.list_players().strip())


@options.command(
    "evacuate --robots none sweep --animate both.html",
    options.BUILDING,
    options.PEOPLE_OPTION,
    options.SCENARIO,
    options.player("robots", PAIRED.format("sweep"), default=["sweep"], nargs="+"),
    options.player("fire", PAIRED.format("random"), default=["random"], nargs="+"),
    options.number("--episodes", 1, EPISODES_HELP, default=1),
    options.SAMPLE,
    options.ERRORS,
    options.folder(
        "--record",
        "trajectories of the first episode and pair, for PedPy; a new or empty folder",
    ),
    options.output(
        "--density",
        options.PICTURES,
        "how dense people were and where they died, in all episodes of the first pair",
    ),
    options.output(
        "--animate",
        options.FILMS,
        "film the first episode, pairs side by side; replaces a film of that name; "
        ".mp4 needs ffmpeg",
    ),
    options.SEED,
    options.json(*PLAYED, "all figures of the table", "runs; of several, pairs"),
    end=options.list_players() + "\n" + list_keys(),
)
def evacuate(arguments: Namespace) -> None:
    """Evacuates a building and tells how many get out."""
    pairs = _pairs(arguments)
    _refuse_within_record(arguments)
    robots, fires = zip(*pairs, strict=True)
    evaluation = begin_evaluation(
        robots, fires, **options.evaluation_options(arguments)
    )
    if {*evaluation.arena.changes} - {"people"} or evaluation.errors:
        print_note(evaluation.where())
    for line in notes(evaluation):
        print_note(line)
    crowding = Crowding() if arguments.density else None

    played = []
    film = _Film(arguments.animate) if arguments.animate else None
    record = _Record(arguments.record) if arguments.record else None
    of_first = film, record
    for seed in tqdm(evaluation.seeds, unit="episode", disable=None, leave=False):
        played.append(_play_episode(evaluation, pairs, seed, *of_first, crowding))
        of_first = None, None

    told = [_report(evaluation, runs) for runs in zip(*played, strict=True)]
    report = {"pairs": told} if len(told) > 1 else told[0]
    titles = evaluation.titles
    named = [facts | {side: titles[facts[side]] for side in SIDES} for facts in told]
    print_report(arguments, report, _table_of(named))

    if crowding:
        from reference.workshop.drawing import crowding_map, save  # loads matplotlib

        guides, foe = pairs[0]
        heading = _heading((titles[guides], titles[foe]))
        path = save(crowding_map(crowding, heading), arguments.density)
        print_note(f"written: {path}")
    if record:
        record.tell()
    if film:
        film.tell()


FIGURE_TITLES = {"mean_health": "mean health of those out"}
"""What the table calls figures, where it is not by their names."""


def _table_of(told: Sequence[Facts]) -> str:
    """Write every figure but the single runs, a column for each pair."""
    rows = []
    for name in told[0]:
        if name != "runs":
            words = FIGURE_TITLES.get(name, name).replace("_", " ")
            rows.append([words, *(of_pair[name] for of_pair in told)])
    return format_table(rows, "<" + ">" * len(told))


def _pairs(arguments: Namespace) -> list[Pair]:
    """Pair the first robots with the first fire, and so on; one name goes with all."""
    robots = arguments.robots
    fires = arguments.fire
    count = max(len(robots), len(fires))
    if count > min(len(robots), len(fires)) > 1:
        raise ContradictionError(
            f"--robots names {len(robots)}, --fire {len(fires)}: name as many, which "
            "are paired in order, or one, which goes with all."
        )
    if count > MOST_FILMED:
        raise ContradictionError(
            f"evacuate plays at most {MOST_FILMED} pairs; evaluate plays more."
        )
    return [(robots[k % len(robots)], fires[k % len(fires)]) for k in range(count)]


def _refuse_within_record(arguments: Namespace) -> None:
    """Raise ContradictionError for a file in the folder that is to be new or empty."""
    if not arguments.record:
        return
    for option in ("density", "animate"):
        path = getattr(arguments, option)
        if path and path.resolve().is_relative_to(arguments.record.resolve()):
            raise ContradictionError(
                f"--{option}: is in the folder of --record, which is to hold "
                "trajectories alone. Name another place."
            )


def _play_episode(
    evaluation: Evaluation,
    pairs: Sequence[Pair],
    seed: int,
    film: _Film | None = None,
    record: _Record | None = None,
    crowding: Crowding | None = None,
) -> list[Facts]:
    """Play a seed with each pair, side by side; return what came of each.

    film: gets all;  record: gets the first one's trajectories;  crowding: watches it
    """
    matches = [(robots, fire, seed) for robots, fire in pairs]
    simulations = list(evaluation.simulations(matches))
    watchers = list[Callable[[], None]]()
    with ExitStack() as stack:
        if record:
            watchers.append(stack.enter_context(record.of(simulations[0])))
        if crowding:
            watchers.append(crowding.watch(simulations[0]))
        going = ticks(simulations, watchers)  # nothing is played before it is asked for
        if film:
            titles = evaluation.titles
            headings = [
                f"{_heading((robots, fire))}\n"
                f"{_players_in_words(titles[robots], titles[fire])}"
                for robots, fire in pairs
            ]
            film.make(simulations, headings, going)
        deque(going, maxlen=0)  # plays what a film has not played

    each = zip(pairs, simulations, strict=True)
    return [_facts_of(pair, seed, simulation) for pair, simulation in each]


def _facts_of(pair: Pair, seed: int, simulation: Simulation) -> Facts:
    """Collect who played, and what came of it."""
    robots, fire = pair
    played: Facts = {"robots": robots, "fire": fire, "seed": seed}
    for name, value in asdict(simulation.outcome()).items():
        played[name] = None if isnan(value) else value  # JSON knows no NaN
    return played


def _players_in_words(robots: str, fire: str) -> str:
    """Say who plays, a line for each side."""
    return f"robots: {describe(robots, 'robots')}\nfire: {describe(fire, 'fire')}"


def _heading(pair: Pair) -> str:
    """Say in a few words who guides and what burns."""
    robots, fire = pair
    guides = "nobody guides" if robots == "none" else f"guided by {robots}"
    burns = "no fire" if fire == "none" else f"fire {fire}"
    return f"{guides}, {burns}"


def _report(evaluation: Evaluation, runs: Sequence[Facts]) -> Facts:
    """Say what a pair played, the mean of every figure, and all runs."""
    facts: Facts = {"building": evaluation.arena.building}
    for name in PLAYED:
        facts[name] = runs[0][name]
    facts["episodes"] = len(runs)
    for name in runs[0]:
        if name not in PLAYED:
            known = [run[name] for run in runs if run[name] is not None]
            facts[name] = mean(known) if known else None
    facts["runs"] = runs
    return facts
