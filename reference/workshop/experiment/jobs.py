"""The two kinds of jobs of an experiment: train, and test.

Clauses: E6, F12.  Pure functions of plain data, a checkpoint's bytes among it, so that
any process of any machine can do them.
"""

import json
from collections.abc import Mapping
from contextlib import ExitStack, redirect_stderr
from dataclasses import asdict, dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory

from reference.learning.networks import one_thread
from reference.learning.settings import Side
from reference.workshop.evaluation.contestants import Evacuation
from reference.workshop.evaluation.crossplay import Arena, Match, Record
from reference.workshop.evaluation.crossplay.playing import play
from reference.workshop.files import make_folder, write_whole
from reference.workshop.training.checkpoints import load, newest
from reference.workshop.training.loop import CLOCK, SUMMARIES, train
from reference.workshop.training.session import Training
from reference.workshop.workers import InProcess

BEGINNING, LOG, DONE = "checkpoint-000000.pt", "log.txt", "training.json"
LEARNED = "learned.pt"


@dataclass(frozen=True)
class Fit:
    """A training to go through, alone and with one thread.

    beginning  a checkpoint's bytes
    side       whose max_steps ends it
    folder     of this machine, to go on from; None: nothing is there, or stays there
    """

    beginning: bytes
    side: Side
    folder: str | None = None


def fit(job: Fit) -> dict[str, bytes]:
    """Train to the end: the files that are worth keeping, by name."""
    with ExitStack() as stack:
        stack.enter_context(one_thread())
        temporary = job.folder or stack.enter_context(TemporaryDirectory())
        make_folder(folder := Path(temporary))
        log = stack.enter_context((folder / LOG).open("a"))
        stack.enter_context(redirect_stderr(log))
        if newest(folder) is None:
            write_whole(folder / BEGINNING, job.beginning)
        training = Training.resumed(load(folder))
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
    """Evacuations of one match. learned: a checkpoint's bytes, of a side that has."""

    arena: Arena
    match: Match
    seeds: range
    learned: Mapping[Side, bytes] = field(default_factory=dict)


def trial(job: Trial) -> list[Record]:
    """Play all evacuations by mean actions; their records in the seeds' order."""
    arena, words = job.arena, job.match._asdict()
    with TemporaryDirectory() as folder, one_thread():
        for side, content in job.learned.items():
            path = Path(folder) / f"{side}.pt"
            path.write_bytes(content)
            words[side] = str(path)
        runs = (
            Evacuation(arena.plan, arena.scenario, **words, seed=seed)
            for seed in job.seeds
        )
        return [play((job.match, run)) for run in runs]
