"""Evacuations: the first look, which compares three, and the command evacuate."""

import json
import sys
from argparse import Namespace
from collections import deque
from collections.abc import Callable, Iterable, Sequence
from contextlib import nullcontext
from dataclasses import asdict
from math import isnan
from pathlib import Path
from statistics import mean
from time import perf_counter
from typing import Any

from tqdm import tqdm

from reference.building import building_of
from reference.learning.settings import SIDES
from reference.simulation import Simulation
from reference.workshop.commands import options
from reference.workshop.commands.common import Command, figures, writable
from reference.workshop.crossplay.matches import Evaluation, begin
from reference.workshop.crowding import Crowd, together
from reference.workshop.recording import recording, ticks
from reference.workshop.runs import ContradictionError
from reference.workshop.strategies import LEARNED

Pair = tuple[str, str]
"""Who plays the robots, and who the fire."""

UNGUIDED, GUIDED = ("none", "random"), ("escort", "random")
ATTACKED = ("escort", "busiest")
TYPICAL = 3
"""A seed whose three evacuations end near the means over a hundred seeds."""

FILM = Path("evacuation.html")
SAME = ("building", "people", "seed", "episodes", "sample")
"""Options with the names of what `begin` takes."""


# -- The first look -----------------------------------------------------------------


def first_look(arguments: Namespace) -> None:
    """Plays one seed without guides, with guides, and with guides and a worse fire."""
    pairs = [UNGUIDED, GUIDED, ATTACKED]
    seed = TYPICAL if arguments.seed is None else arguments.seed
    evaluation = _evaluation(pairs, seed=seed, episodes=1)
    simulations = [_begun(evaluation, pair, evaluation.seed) for pair in pairs]
    _play(simulations[:2], pairs[:2], arguments.animate)
    simulations[2].run()
    runs = [_facts(simulation) for simulation in simulations]
    if arguments.json:
        names = [{"robots": robots, "fire": fire} for robots, fire in pairs]
        told = [name | run for name, run in zip(names, runs, strict=True)]
        print(json.dumps({"seed": evaluation.seed, "runs": told}))
        return
    title = building_of(evaluation.arena.plan).title
    print(f"{title}, {runs[0]['people']} people, seed {evaluation.seed}")
    for pair, run in zip(pairs, runs, strict=True):
        health = run["mean_health"]
        mean = "" if health is None else f", with {health:.0f} of 100 health on average"
        print(f"{_heading(pair) + ':':32}{run['evacuated']:3} get out alive{mean}")


# -- evacuate -----------------------------------------------------------------------


def evacuate(arguments: Namespace) -> None:
    """Evacuates a building and tells who got out; episode i uses seed + i."""
    pairs = _pairs(arguments.robots, arguments.fire)
    for option in ("record", "density"):
        if len(pairs) > 1 and getattr(arguments, option):
            raise ContradictionError(f"--{option} goes with one pair. Leave one out.")
    evaluation = _evaluation(pairs, **{name: getattr(arguments, name) for name in SAME})
    if arguments.density:
        writable(arguments.density)
    runs, crowds = _played(evaluation, pairs, arguments)
    if arguments.density:
        from reference.workshop.drawing import crowded, save

        save(crowded(together(crowds), _heading(pairs[0])), arguments.density)
        print(f"the picture is in {arguments.density}", file=sys.stderr)
    told = [_told(evaluation, *each) for each in zip(pairs, runs, strict=True)]
    if arguments.json:
        print(json.dumps(told[0] if len(told) == 1 else {"pairs": told}))
    else:
        print("\n\n".join(_summary(evaluation, facts) for facts in told))


def _played(
    evaluation: Evaluation, pairs: Sequence[Pair], arguments: Namespace
) -> tuple[list[list[dict[str, Any]]], list[Crowd]]:
    """Play all episodes, the first one to be seen; return each pair's runs, crowds."""
    runs: list[list[dict[str, Any]]] = [[] for _ in pairs]
    crowds = list[Crowd]()
    for seed in tqdm(evaluation.seeds, unit="episode", disable=None, leave=False):
        simulations = [_begun(evaluation, pair, seed) for pair in pairs]
        if arguments.density:
            crowds.append(Crowd(simulations[0]))
        notes, first = [crowd.note for crowd in crowds[-1:]], seed == evaluation.seed
        film, folder = (arguments.animate, arguments.record) if first else (None, None)
        start = perf_counter()
        _play(simulations, pairs, film, folder, notes)
        took = None if film or folder else (perf_counter() - start) / len(pairs)
        for found, simulation in zip(runs, simulations, strict=True):
            facts = {"seed": seed, **_facts(simulation), "wall_seconds": took}
            found.append(facts)
    return runs, crowds


def _pairs(robots: Sequence[str], fires: Sequence[str]) -> list[Pair]:
    """Pair the first robots with the first fire, and so on; one name goes with all."""
    count = max(len(robots), len(fires))
    if count > 2:
        raise ContradictionError(
            "evacuate plays one pair or two, as with --robots none sweep. "
            "To compare more: evaluate."
        )
    return [(robots[k % len(robots)], fires[k % len(fires)]) for k in range(count)]


def _evaluation(pairs: Iterable[Pair], **asked: Any) -> Evaluation:
    """Make the matches; building and people are a checkpoint's, unless asked for."""
    robots, fires = (tuple(dict.fromkeys(side)) for side in zip(*pairs, strict=True))
    known = {name: value for name, value in asked.items() if value is not None}
    return begin(robots, fires, **known)


def _begun(evaluation: Evaluation, pair: Pair, seed: int) -> Simulation:
    return evaluation.simulation(*pair, seed)


def _play(
    simulations: Sequence[Simulation],
    pairs: Sequence[Pair],
    film: Path | None = None,
    folder: Path | None = None,
    notes: Sequence[Callable[[], None]] = (),
) -> None:
    """Run simulations to their ends; film all of them, record the first."""
    recorded = recording(simulations[0], folder) if folder else nullcontext()
    with recorded as note:
        going = ticks(simulations, [*notes, note] if note else notes)
        if film:
            from reference.workshop.drawing.film import FORMATS, animate

            writable(film, "an animation", FORMATS)
            animate(simulations, film, [_heading(pair) for pair in pairs], going)
            print(f"the animation is in {film}", file=sys.stderr)
        deque(going, maxlen=0)
    if folder:
        print(f"the recording is in {folder}", file=sys.stderr)


def _heading(pair: Pair) -> str:
    robots, fire = pair
    guides = "nobody guides" if robots == "none" else f"guided by {robots}"
    return f"{guides}, {'no fire' if fire == 'none' else f'fire {fire}'}"


# -- What is told -------------------------------------------------------------------


def _facts(simulation: Simulation) -> dict[str, Any]:
    """Name the figures of an outcome; None for those that it lacks."""
    outcome = asdict(simulation.outcome()).items()
    return {name: None if isnan(value) else value for name, value in outcome}


def _told(
    evaluation: Evaluation, pair: Pair, runs: list[dict[str, Any]]
) -> dict[str, Any]:
    """Say what was played, the mean of every figure, and all runs."""
    known = {name: _known(runs, name) for name in runs[0] if name != "seed"}
    return {
        "building": evaluation.arena.building,
        "robots": pair[0],
        "fire": pair[1],
        "seed": evaluation.seed,
        "episodes": evaluation.episodes,
        **{name: mean(values) if values else None for name, values in known.items()},
        "runs": runs,
    }


def _known(runs: list[dict[str, Any]], name: str) -> list[float]:
    return [run[name] for run in runs if run[name] is not None]


def _summary(evaluation: Evaluation, facts: dict[str, Any]) -> str:
    """Lay out what was played and its figures, one a row."""
    title, runs = building_of(evaluation.arena.plan).title, facts["runs"]
    first, last = runs[0]["seed"], runs[-1]["seed"]
    seeds = f"seed {first}" if first == last else f"seeds {first} to {last}"
    lines = [f"{title}: robots {facts['robots']}, fire {facts['fire']}, {seeds}"]
    for side in (side for side in SIDES if facts[side] == LEARNED):
        from reference.workshop.training.shipping import about

        lines.append(f"learned {side}: {about(side)}")
    if len(runs) > 1:
        lines.append(f"{'':18}{'mean':>10}{'lowest':>10}{'highest':>10}")
    for name in list(runs[0])[1:]:
        known = _known(runs, name)
        spread = [min(known), max(known)] if known and len(runs) > 1 else []
        words = NAMES.get(name, name.replace("_", " "))
        lines.append(f"{words:18}{figures([facts[name], *spread])}")
    return "\n".join(lines)


NAMES = {"mean_health": "health of those out"}
FILMED = ".gif, .html or .mp4 (needs ffmpeg)"
FIRST_OPTIONS: options.Table = {
    "--seed": options.SEED["--seed"]
    | {"help": f"default: {TYPICAL}, which ends near the means over many"},
    "--animate": options.path(
        "FILE", f"the film, {FILMED}; default: {FILM}", default=FILM
    ),
}
EVACUATE_OPTIONS: options.Table = {
    **options.PLACE,
    **options.player("robots", "default: sweep", default=("sweep",), nargs="+"),
    **options.player("fire", "default: random", default=("random",), nargs="+"),
    "--episodes": options.number(1, "how many to play; default: 1", default=1),
    **options.SAMPLE,
    "--record": options.path(
        "DIR", "write the first episode's trajectories, a file per floor, for PedPy"
    ),
    "--density": options.path(
        "FILE", "draw how dense people were, and where they died, in all episodes"
    ),
    "--animate": options.path(
        "FILE", f"film the first episode as {FILMED}; two pairs side by side"
    ),
}

FIRST_LOOK = Command(first_look, FIRST_OPTIONS, "--seed 7 --animate film.gif")
EVACUATE = Command(
    evacuate, EVACUATE_OPTIONS, "evacuate --robots none sweep --animate both.html"
)
