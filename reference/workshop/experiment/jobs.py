"""The two kinds of jobs of an experiment: train, and test.

Clauses: E6, F12.  Pure functions of plain data, which includes checkpoints as bytes, so
that any process of any machine can do them.
"""

import json
from collections.abc import Mapping
from contextlib import ExitStack, redirect_stderr
from copy import deepcopy
from dataclasses import asdict, dataclass, field
from io import BytesIO
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from reference.building import building_of
from reference.learning.networks import one_thread
from reference.learning.settings import SIDES, Side
from reference.simulation import Simulation
from reference.workshop.crossplay.contestants import contestant, encounter
from reference.workshop.crossplay.matches import Arena, Match, Run
from reference.workshop.crossplay.runs import IN_LOCKSTEP, RunResult, played
from reference.workshop.files import make_folder
from reference.workshop.training.checkpoints import Checkpoint, load, newest, unpacked
from reference.workshop.training.loop import CLOCK, train
from reference.workshop.training.policies import POLICIES
from reference.workshop.training.session import Training
from reference.workshop.training.summaries import SUMMARIES
from reference.workshop.workers import InProcess, chunks

LOG, DONE = "log.txt", "training.json"


@dataclass(frozen=True)
class Fit:
    """A training to run, alone and with one thread.

    beginning  a checkpoint's bytes
    side       whose max_steps ends it
    folder     of this machine, to resume from; None: a temporary one
    """

    beginning: bytes
    side: Side
    folder: str | None = None


def fit(job: Fit) -> dict[str, bytes]:
    """Train to the end; return the files worth keeping, by name."""
    with ExitStack() as stack:
        stack.enter_context(one_thread())
        temporary = job.folder or stack.enter_context(TemporaryDirectory())
        make_folder(folder := Path(temporary))
        log = stack.enter_context((folder / LOG).open("a"))
        stack.enter_context(redirect_stderr(log))
        there = newest(folder)
        training = Training.resumed(
            load(there) if there else _checkpoint(job.beginning)
        )
        learner = training.learners[job.side]
        path = train(
            training,
            folder,
            InProcess(),
            lambda: learner.steps >= learner.settings.max_steps,
        )
        log.flush()
        about = {"facts": training.facts(), "settings": asdict(training.settings)}
        kept = {path.name: path, LOG: folder / LOG}
        kept |= {name: folder / name for name in (SUMMARIES, CLOCK)}
        files = {name: file.read_bytes() for name, file in kept.items()}
        return files | {DONE: json.dumps(about, indent=2).encode()}


@dataclass(frozen=True)
class Trial:
    """Evacuations of one match; learned: checkpoints' bytes of sides that learned."""

    arena: Arena
    match: Match
    seeds: range
    learned: Mapping[Side, bytes] = field(default_factory=dict)


def trial(job: Trial) -> list[RunResult]:
    """Play all evacuations by mean actions; return records in the seeds' order."""
    with one_thread():
        players = [_player(job, side) for side in SIDES]
        return [
            record
            for seeds in chunks(job.seeds, IN_LOCKSTEP)
            for record in played([_set_up(job, players, seed) for seed in seeds])
        ]


def _set_up(job: Trial, players: list[Any], seed: int) -> tuple[Run, Simulation]:
    scenario = job.arena.scenario
    robots, fire = deepcopy(players)  # they may keep state
    run = Run(*job.match, seed)
    return run, encounter(building_of(job.arena.plan), scenario, robots, fire, seed)


def _player(job: Trial, side: Side) -> Any:
    if (content := job.learned.get(side)) is None:
        return contestant(getattr(job.match, side), side)
    return POLICIES[side](_checkpoint(content))


def _checkpoint(content: bytes) -> Checkpoint:
    return unpacked(BytesIO(content), Path("a checkpoint that came with a job"))
