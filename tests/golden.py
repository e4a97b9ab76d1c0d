"""Hashes of results, for changes that may not change any.

`python -m tests.golden [evacuations] [learning] [film]` (default: all) computes what
this checkout computes, compares with `golden.json` and names what differs; with
`--record` it writes the file anew, in a commit that says why. The hashes hold for one
machine and the pinned versions: elsewhere, record them at the parent commit first.
"""

import contextlib
import hashlib
import io
import json
import os
import sys
import tempfile
from itertools import product
from pathlib import Path

os.environ["OMP_NUM_THREADS"] = "1"  # sums depend on how many threads share them

import numpy as np
from PIL import Image, ImageSequence

from reference.__main__ import main
from reference.building import load
from reference.paper import Scenario
from reference.simulation import Simulation
from reference.workshop.strategies import SCRIPTS
from reference.workshop.training import checkpoints

HERE = Path(__file__).with_name("golden.json")
BUILDINGS = {"paper": range(2), "museum": range(2), "school": range(1)}
ROBOTS, FIRES = ("none", "random", "patrol", "sweep"), ("none", "random", "greedy")
TRAININGS = {
    "both": "",
    "gaussian": "--head gaussian",
    "robots alone": "--fire greedy",
    "fire alone": "--robots sweep",
    "ppo robots": "--trainer ppo --schedule alternate",
    "imitation": "--imitate sweep --fire random",
}


def digest(*parts: object) -> str:
    """A short hash of arrays and of what else there is, as it prints itself."""
    sha = hashlib.sha256()
    for part in parts:
        array = isinstance(part, np.ndarray)
        sha.update(part.tobytes() if array else repr(part).encode())
    return sha.hexdigest()[:16]


def evacuations() -> dict[str, str]:
    """Sixty of them: every pair on three maps; what happened, and where all ended."""
    found = {}
    for name, robots, fire in product(BUILDINGS, ROBOTS, FIRES):
        parts: list[object] = []
        for seed in BUILDINGS[name]:
            run = Simulation(
                load(name),
                Scenario(),
                SCRIPTS["robots"][robots](),
                SCRIPTS["fire"][fire](),
                seed,
            )
            parts.append(run.run())
            parts += [(type(e).__name__, *vars(e).values()) for e in run.events]
            bodies = run.world.bodies
            parts += [bodies.position, bodies.health, bodies.fate]
            parts += [robot.position for robot in run.world.robots]
        found[f"evacuation, {name}: {robots}, {fire}"] = digest(*parts)
    return found


def trainings(folder: Path) -> dict[str, str]:
    """Preset tiny, every trainer: weights, and what is written down."""
    found = {}
    for name, options in TRAININGS.items():
        out = folder / name
        command = f"train --preset tiny --workers 0 --seed 3 {options}".split()
        silent([*command, "--out", str(out)])
        state = checkpoints.load(out)
        for side, learner in state.learners.items():
            tensors = [
                (key, tensor.numpy())
                for network in ("actor", "critic")
                for key, tensor in sorted(learner[network].items())
            ]
            flat = [part for pair in tensors for part in pair]
            found[f"weights, {name}: {side}"] = digest(*flat)
        text = (out / "summaries.csv").read_text()
        found[f"summaries, {name}"] = digest(text)
    return found


def commands(folder: Path) -> dict[str, str]:
    """One evaluation, and evacuations that learned policies play."""
    learned = str(folder / "both")
    told = {
        "evaluation": "evaluate --building tiny --robots none sweep --fire none "
        "random greedy busiest --episodes 4 --workers 0 --json",
        "gap": f"gap --robots {learned} --fire critic:{learned} --moments 2 "
        "--workers 0 --json",
        "agreement": "agree --building tiny --fires 12 --workers 0 --json",
        "learned": f"evacuate --robots {learned} --fire {learned} --episodes 2 --json",
        "sampled": f"evacuate --robots {learned} --fire critic:{learned} --sample "
        "--seed 4 --json",
        "perturbed": f"evacuate --robots perturbed:{learned} --fire worst-case --json",
    }
    found = {}
    for name, line in told.items():
        text = silent(line.split()).replace(learned, "LEARNED")
        found[name] = digest(without_clocks(json.loads(text)))
    return found


def silent(arguments: list[str]) -> str:
    """A command's standard output; its exit status must be 0."""
    out, errors = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(errors):
        status = main(arguments)
    assert status == 0, (arguments, errors.getvalue())
    return out.getvalue()


def without_clocks(told: object) -> object:
    """What a command told, but for seconds on the wall."""
    if isinstance(told, dict):
        return {k: without_clocks(v) for k, v in told.items() if "wall" not in k}
    return [without_clocks(x) for x in told] if isinstance(told, list) else told


def learning() -> dict[str, str]:
    """Weights after some rounds, and what commands say that use them."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        return trainings(folder) | commands(folder)


def film() -> dict[str, str]:
    """Every frame of one film."""
    with tempfile.TemporaryDirectory() as name:
        path = Path(name) / "film.gif"
        silent(f"evacuate --building tiny --seed 2 --animate {path}".split())
        with Image.open(path) as gif:
            frames = [np.array(f.convert("RGB")) for f in ImageSequence.Iterator(gif)]
    return {"film": digest(*frames)}


PARTS = {"evacuations": evacuations, "learning": learning, "film": film}

if __name__ == "__main__":
    chosen = [name for name in PARTS if name in sys.argv] or list(PARTS)
    now = {k: v for name in chosen for k, v in PARTS[name]().items()}
    then = json.loads(HERE.read_text()) if HERE.exists() else {}
    if "--record" in sys.argv:
        HERE.write_text(json.dumps(then | now, indent=1) + "\n")
        sys.exit()
    changed = [name for name in now if then.get(name) != now[name]]
    print("\n".join(changed) or f"all {len(now)} as recorded")
    sys.exit(bool(changed))
