"""The command evacuate: one evacuation, or some; who got out, a film, a recording."""

import json
import sys
from argparse import Namespace
from dataclasses import asdict
from math import isnan
from pathlib import Path
from statistics import mean
from time import perf_counter
from typing import Any

from tqdm import tqdm

from reference.building import Building, building_of
from reference.learning.settings import SIDES
from reference.simulation import Simulation
from reference.workshop.commands import options
from reference.workshop.commands.common import (
    Command,
    figures,
    noted,
    writable,
)
from reference.workshop.crossplay.matches import Evaluation, Run, begin
from reference.workshop.recording import record
from reference.workshop.runs import refuse_used
from reference.workshop.strategies import LEARNED

SAME = ("building", "people", "seed", "episodes", "sample")
"""Options with the names of what `begin` takes."""


def evacuate(arguments: Namespace) -> None:
    """Evacuates a building and tells who got out; episode i uses seed + i."""
    evaluation = _evaluation(arguments)
    noted(evaluation)
    if arguments.record:
        refuse_used(arguments.record, "Name another folder.")
    if arguments.animate:
        _animate(_begun(evaluation, evaluation.seed), arguments.animate)
    if arguments.record:
        record(_begun(evaluation, evaluation.seed), arguments.record)
        print(f"the recording is in {arguments.record}", file=sys.stderr)
    progress = tqdm(evaluation.seeds, unit="episode", disable=None, leave=False)
    runs = [_episode(evaluation, seed) for seed in progress]
    facts: dict[str, Any] = {
        "building": evaluation.arena.building,
        "robots": arguments.robots,
        "fire": arguments.fire,
        "seed": evaluation.seed,
        "episodes": evaluation.episodes,
        **_means(runs),
    }
    if arguments.json:
        print(json.dumps(facts | {"runs": runs}))
    else:
        _summarise(building_of(evaluation.arena.plan), facts, runs)


def _evaluation(arguments: Namespace) -> Evaluation:
    """Make one match; building and people are a checkpoint's, unless asked for."""
    asked = {name: getattr(arguments, name) for name in SAME}
    known = {name: value for name, value in asked.items() if value is not None}
    return begin((arguments.robots,), (arguments.fire,), **known)


def _begun(evaluation: Evaluation, seed: int) -> Simulation:
    (robots,), (fire,) = evaluation.robots, evaluation.fires
    return evaluation.evacuation(Run(robots, fire, seed)).simulation()


def _animate(simulation: Simulation, path: Path) -> None:
    """Film one evacuation."""
    from reference.workshop.drawing import film

    writable(path, film.FORMATS, "an animation")
    film.animate(simulation, path)
    print(f"the animation is in {path}", file=sys.stderr)


def _episode(evaluation: Evaluation, seed: int) -> dict[str, Any]:
    start = perf_counter()
    outcome = asdict(_begun(evaluation, seed).run())
    known = {name: None if isnan(value) else value for name, value in outcome.items()}
    return {"seed": seed, **known, "wall_seconds": perf_counter() - start}


def _means(runs: list[dict[str, Any]]) -> dict[str, Any]:
    """The mean of every figure over the episodes that have one."""
    values = {name: _known(runs, name) for name in runs[0] if name != "seed"}
    return {name: mean(known) if known else None for name, known in values.items()}


def _known(runs: list[dict[str, Any]], name: str) -> list[float]:
    return [run[name] for run in runs if run[name] is not None]


def _summarise(
    building: Building, facts: dict[str, Any], runs: list[dict[str, Any]]
) -> None:
    first, last = runs[0]["seed"], runs[-1]["seed"]
    seeds = f"seed {first}" if first == last else f"seeds {first} to {last}"
    print(f"{building.title}: robots {facts['robots']}, fire {facts['fire']}, {seeds}")
    for side in (side for side in SIDES if facts[side] == LEARNED):
        from reference.workshop.training.shipping import about

        print(f"learned {side}: {about(side)}")
    if len(runs) > 1:
        print(f"{'':18}{'mean':>10}{'lowest':>10}{'highest':>10}")
    for name in list(runs[0])[1:]:
        known = _known(runs, name)
        spread = [min(known), max(known)] if known and len(runs) > 1 else []
        print(f"{name.replace('_', ' '):18}{figures([facts[name], *spread])}")


EVACUATE_OPTIONS: options.Table = {
    **options.PLACE,
    **options.player("robots", "default: sweep", default="sweep"),
    **options.player("fire", "default: random", default="random"),
    "--episodes": options.number(1, "how many to play; default: 1", default=1),
    **options.SAMPLE,
    "--record": options.path(
        "DIR", "write the first episode's trajectories, a file per floor, for PedPy"
    ),
    "--animate": options.path(
        "FILE", "film the first episode as .gif, .html or .mp4 (needs ffmpeg)"
    ),
}

EVACUATE = Command(
    evacuate, EVACUATE_OPTIONS, "evacuate --robots patrol --episodes 20 --json"
)
