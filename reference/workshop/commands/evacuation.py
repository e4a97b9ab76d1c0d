"""Evacuations: the first look, which compares three, and the command evacuate."""

from argparse import Namespace
from collections import deque
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import asdict
from math import isnan
from pathlib import Path
from statistics import mean
from typing import Any

from tqdm import tqdm

from reference.workshop.commands import options
from reference.workshop.commands.common import note, table, tell
from reference.workshop.comparing.matches import Arena, Evaluation, begin, notes
from reference.workshop.comparing.named import ABOUT, said_of
from reference.workshop.measuring.crowding import Crowding
from reference.workshop.measuring.recording import recording, ticks
from reference.workshop.storage.runs import ContradictionError
from reference.workshop.storage.workers import workers
from reference.workshop.strategies import LEARNED

Pair = tuple[str, str]
"""Who plays the robots, and who the fire."""

Facts = dict[str, Any]

FILMED: list[Pair] = [("none", "random"), ("escort", "random")]
LEARNED_BOTH: Pair = (LEARNED, LEARNED)
FILM = Path("evacuation.html")
EPISODES = "how many; episode i uses seed + i; default: 1"
TYPICAL = 37
"""A seed whose three evacuations end within three people of the means in RESULTS."""


@options.command(
    "--seed 7 --animate film.gif",
    options.output("--animate", options.FILMS, "the film", FILM),
    options.SEED,
    options.JSON,
)
def first_look(arguments: Namespace) -> None:
    """Plays one seed without guides, with guides, and with both sides that learned."""
    seed = TYPICAL if arguments.seed is None else arguments.seed
    with workers(1) as other:  # it loads torch in the meantime
        learned = other.submit(_one_seed, [LEARNED_BOTH], seed)
        arena, runs = _one_seed(FILMED, seed, arguments.animate)
        runs += learned.result()[1]
    lines = [f"{arena.building}, {arena.people} people, seed {seed}"]
    for pair, run in zip([*FILMED, LEARNED_BOTH], runs, strict=True):
        health = f"{run['mean_health'] or 0:.0f} of 100 health on average"
        out = f"{run['evacuated']:3} get out alive, with {health}"
        lines.append(f"{_heading(pair) + ':':33}{out}")
    tell(arguments, {"seed": seed, "runs": runs}, "\n".join(lines))
    note(f"written: {arguments.animate}")


def _one_seed(
    pairs: Sequence[Pair], seed: int, film: Path | None = None
) -> tuple[Arena, list[Facts]]:
    """Play a seed with each pair in the paper's building; return what came of each."""
    robots, fires = zip(*pairs, strict=True)
    evaluation = begin(robots, fires, seed=seed, episodes=1)
    return evaluation.arena, _episode(evaluation, pairs, seed, film)


@options.command("strategies", options.JSON)
def strategies(arguments: Namespace) -> None:
    """Says in a line each what every robot strategy and every fire does."""
    tell(arguments, {side: ABOUT[side] for side in ABOUT}, options.strategies().strip())


@options.command(
    "evacuate --robots none sweep --animate both.html",
    options.BUILDING,
    options.PEOPLE,
    options.player("robots", "default: sweep", default=["sweep"], nargs="+"),
    options.player("fire", "default: random", default=["random"], nargs="+"),
    options.number("--episodes", 1, EPISODES, default=1),
    options.SAMPLE,
    options.ERRORS,
    options.folder("--record", "trajectories of the first episode and pair, for PedPy"),
    options.output(
        "--density",
        options.PICTURES,
        "how dense people were and where they died, in all episodes of the first pair",
    ),
    options.output(
        "--animate",
        options.FILMS,
        "film the first episode; two pairs side by side; .mp4 needs ffmpeg",
    ),
    options.SEED,
    options.JSON,
    end=options.strategies(),
)
def evacuate(arguments: Namespace) -> None:
    """Evacuates a building and tells how many get out."""
    pairs = _pairs(arguments)
    robots, fires = zip(*pairs, strict=True)
    evaluation = begin(robots, fires, **options.of_evaluation(arguments))
    if {*evaluation.arena.changes} - {"people"}:  # no option asked for that
        note(evaluation.arena.about())
    for line in notes(evaluation):
        note(line)
    crowding, played = Crowding() if arguments.density else None, []
    film, folder = arguments.animate, arguments.record
    for seed in tqdm(evaluation.seeds, unit="episode", disable=None, leave=False):
        played.append(_episode(evaluation, pairs, seed, film, folder, crowding))
        film = folder = None  # of the first one only
    told = [_told(evaluation, runs) for runs in zip(*played, strict=True)]
    rows = []
    for name in list(told[0])[:-1]:
        words = name.replace("health", "health_of_those_out").replace("_", " ")
        rows.append((words, *(of_pair[name] for of_pair in told)))
    report = {"pairs": told} if len(told) > 1 else told[0]
    tell(arguments, report, table(rows, "<" + ">" * len(told)))
    if crowding:
        from reference.workshop.drawing import crowded, save

        save(crowded(crowding, _heading(pairs[0])), arguments.density)
    for path in filter(None, (arguments.animate, arguments.record, arguments.density)):
        note(f"written: {path}")


def _pairs(arguments: Namespace) -> list[Pair]:
    """Pair the first robots with the first fire, and so on; one name goes with all."""
    robots, fires = arguments.robots, arguments.fire
    count = max(len(robots), len(fires))
    if count > 2:
        raise ContradictionError("evacuate plays one pair or two; evaluate plays more.")
    return [(robots[k % len(robots)], fires[k % len(fires)]) for k in range(count)]


def _episode(
    evaluation: Evaluation,
    pairs: Sequence[Pair],
    seed: int,
    film: Path | None = None,
    folder: Path | None = None,
    crowding: Crowding | None = None,
) -> list[Facts]:
    """Play a seed with each pair, side by side; return what came of each.

    film: gets all;  folder: gets the first one's trajectories;  crowding: watches it
    """
    simulations = evaluation.simulations([(*pair, seed) for pair in pairs])
    notes = list[Callable[[], None]]()
    with ExitStack() as stack:
        if folder:
            notes.append(stack.enter_context(recording(simulations[0], folder)))
        if crowding:
            notes.append(crowding.watch(simulations[0]))
        going = ticks(simulations, notes)
        if film:
            from reference.workshop.drawing.film import animate

            headings = [f"{_heading(pair)}\n{_who(*pair)}" for pair in pairs]
            animate(simulations, film, headings, going)
        deque(going, maxlen=0)
    outcomes = [asdict(simulation.outcome()) for simulation in simulations]
    known = [{k: None if isnan(v) else v for k, v in one.items()} for one in outcomes]
    return [
        {"robots": robots, "fire": fire, "seed": seed, **one}
        for (robots, fire), one in zip(pairs, known, strict=True)
    ]


def _who(robots: str, fire: str) -> str:
    """Say who plays, a line for each side."""
    return f"robots: {said_of(robots, 'robots')}\nfire: {said_of(fire, 'fire')}"


def _heading(pair: Pair) -> str:
    robots, fire = pair
    guides = "nobody guides" if robots == "none" else f"guided by {robots}"
    return f"{guides}, {'no fire' if fire == 'none' else f'fire {fire}'}"


def _told(evaluation: Evaluation, runs: Sequence[Facts]) -> Facts:
    """Say what a pair played, the mean of every figure, and all runs."""
    means = {}
    for name in list(runs[0])[3:]:
        known = [run[name] for run in runs if run[name] is not None]
        means[name] = mean(known) if known else None
    return {
        "building": evaluation.arena.building,
        **{name: runs[0][name] for name in ("robots", "fire", "seed")},
        "episodes": len(runs),
        **means,
        "runs": runs,
    }
