"""What an experiment was when it began: recorded in its folder, compared on resume.

Clause: E6.
"""

import json
from dataclasses import asdict
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np

import reference
from reference.learning.players import Learned
from reference.workshop.experiment.asked import RESPONSES, Experiment
from reference.workshop.files import read_json, write_json
from reference.workshop.plain import mapping
from reference.workshop.runs import (
    RunError,
    refuse_contradictions,
    refuse_version,
    rows_of_both,
)

ABOUT = "experiment.json"


def begin(experiment: Experiment, folder: Path) -> None:
    """Record the experiment in its folder, beside what it was. Raises OSError.

    An arm no longer asked for stays recorded: it may return, and has its trainings.
    """
    path, now = folder / ABOUT, _unchangeable(experiment)
    if path.exists():
        begun = read_json(path)
        now["arms"] = mapping(begun.get("arms"), ABOUT) | now["arms"]
        now["best_response"] = now["best_response"] or begun.get("best_response")
    content = {"version": reference.__version__, "game": reference.GAME} | now
    write_json(path, content)


def refuse_changed(experiment: Experiment, folder: Path) -> None:
    """Raise RunError where the experiment in a folder is another one.

    More seeds, arms, fires and robots may be asked for than were, and other best
    responses as long as none has begun.
    """
    path = folder / ABOUT
    if not path.exists():
        raise RunError(f"{folder}: there is no experiment to go on with.")
    begun = read_json(path)
    refuse_version(path, begun.get("version"), begun.get("game"))
    now = json.loads(json.dumps(_unchangeable(experiment)))
    arms, known = now.pop("arms"), mapping(begun.get("arms"), ABOUT)
    if now.pop("plan") != begun.get("plan"):
        raise RunError(f"building: the map differs from that of {path}.")
    none_yet = not (folder / RESPONSES).exists()
    if none_yet or None in (now["best_response"], begun.get("best_response")):
        del now["best_response"]  # they may come later, and be left out
    now["arms"] = {arm: arms[arm] for arm in arms if arm in known}
    refuse_contradictions(f"the experiment in {folder}", rows_of_both(now, begun, ""))


def _unchangeable(experiment: Experiment) -> dict[str, Any]:
    """Collect what may not change during an experiment, as plain data."""
    test, response = experiment.test, experiment.best_response
    network = experiment.first_response.get("fire")
    arms = {}
    for name in experiment.arms:
        settings, fire, imitate, initial = experiment.of_arm(name)
        networks = experiment.networks(initial)
        arms[name] = asdict(settings) | {
            "against": fire,
            "imitate": imitate,
            "initial": {side: _digest(who) for side, who in networks.items()},
        }
    return {
        "plan": experiment.arena.plan,
        "tests": [test.seed, test.episodes, test.looking_ahead],
        "best_response": response
        and asdict(response) | {"network": network and _digest(network)},
        "arms": arms,
    }


def _digest(network: Learned) -> str:
    """Digest a network's weights."""
    sha = sha256()
    for name, tensor in sorted(network.weights.items()):
        sha.update(name.encode() + np.asarray(tensor).tobytes())
    return sha.hexdigest()
