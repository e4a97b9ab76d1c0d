"""The jobs of an experiment: all trainings, then all robots meet all fires.

A job is a pure function of plain data, for any executor whose
workers share the experiment's folder.  The name of what it makes has a digest of all
that it follows from: what is made is not made again, and what changed is made anew.
What was made with other numbers of the paper is refused.

    trainings/NAME-DIGEST/  of an arm and a seed: checkpoint, curve, log
    tests-DIGEST/           an evaluation; digest: of the arena, own code, what ships
"""

import json
import sys
from concurrent.futures import Executor
from contextlib import redirect_stderr
from dataclasses import asdict
from hashlib import sha256
from pathlib import Path
from traceback import print_exc
from typing import Any

from tqdm import tqdm

import reference
from reference.paper import InputError
from reference.workshop.comparing.design import Experiment, arm_of
from reference.workshop.comparing.matches import Evaluation, with_digests
from reference.workshop.comparing.runs import RunResult, play_evaluation
from reference.workshop.engine import make_ready
from reference.workshop.storage.files import (
    make_folder,
    message_of,
    read_json,
    write_json,
)
from reference.workshop.storage.numbers import paper_numbers
from reference.workshop.storage.runs import (
    LOCK_FILE,
    locked,
    refuse_numbers,
    remove_left_lock,
)
from reference.workshop.storage.workers import (
    InProcess,
    import_early,
    map_as_done,
    one_thread,
)
from reference.workshop.strategies import ANYWHERE, LEARNED, SHIPPED
from reference.workshop.strategies.own import is_code
from reference.workshop.training.checkpoints import (
    Task,
    load_checkpoint,
    newest_checkpoint,
)
from reference.workshop.training.loop import run_training
from reference.workshop.training.rounds import Training

LOG_FILE = "log.txt"
DONE_FILE = "training.json"
TRAININGS_FOLDER = "trainings"


def training_folders(experiment: Experiment, folder: Path) -> dict[str, Path]:
    """The folder of each training, by its name."""
    paths = {}
    for training in experiment.trainings:
        settings, fires = experiment.arm(arm_of(training))
        made_of = [experiment.arena.plan, asdict(settings), fires]
        if LEARNED in fires:
            made_of.append(_digest_of_shipped())
        name = f"{training}-{_digest(*made_of)}"
        paths[training] = folder.absolute() / TRAININGS_FOLDER / name
    return paths


def finished(experiment: Experiment, folder: Path) -> dict[str, Path]:
    """The folders of the trainings that are over, by name."""
    own = training_folders(experiment, folder).items()
    return {
        name: at
        for name, at in own
        if (at / DONE_FILE).exists() and newest_checkpoint(at)
    }


def _digest(*plain: Any) -> str:
    """Digest plain data, with the version."""
    parts = [reference.__version__, reference.GAME, plain]
    return sha256(json.dumps(parts).encode()).hexdigest()[:8]


def _digest_of_shipped() -> str:
    """Digest the policies that ship."""
    return sha256(SHIPPED.read_bytes() + ANYWHERE.read_bytes()).hexdigest()


def finish_trainings(
    experiment: Experiment, folder: Path, executor: Executor
) -> dict[str, str]:
    """Finish all trainings, on any number of workers; return which failed, why [E6].

    Raises InputError for trainings that were made with other numbers.
    """
    make_folder(folder / TRAININGS_FOLDER)  # from here on it can be resumed
    own = training_folders(experiment, folder)
    done = finished(experiment, folder)
    for at in done.values():
        path = at / DONE_FILE
        refuse_numbers(path, read_json(path).get("numbers"))
    left = [name for name in own if name not in done]
    jobs = [(experiment.trainings[name], str(own[name])) for name in left]
    if jobs:
        import_early(executor, (__name__, "reference.workshop.engine.going"), len(jobs))
        make_ready()
    failed = dict[str, str]()
    with tqdm(total=len(own), initial=len(done), unit="training", disable=None) as bar:
        for k, why in map_as_done(executor, train_in, jobs):
            name = left[k]
            if not why and not (own[name] / DONE_FILE).exists():
                why = f"{own[name]}: a worker has another. Name one that all share."
            if why:
                failed[name] = why
            bar.update()
            tqdm.write(f"{name}: {why or 'done'}", file=sys.stderr)
    return failed


def train_in(job: tuple[Task, str]) -> str:
    """Train in a folder to the end; return why it failed, whose traceback is logged."""
    task, path = job
    folder = Path(path)
    log = folder / LOG_FILE
    try:
        make_folder(folder)
        with log.open("a") as file, redirect_stderr(file):
            try:
                _train_on(task, folder)
            except Exception:
                print_exc()
                raise
    except (InputError, OSError) as error:
        return message_of(error)
    except Exception as error:
        return f"{type(error).__name__}: {error}; see {log}"
    return ""


def _train_on(task: Task, folder: Path) -> None:
    """Train in a folder to the end, alone and with one thread.

    What is there already is resumed, unless another process is at work in it.
    """

    def begin() -> Training:
        if not newest_checkpoint(folder):
            return Training(task)
        checkpoint = load_checkpoint(folder)
        refuse_numbers(folder, checkpoint.numbers)
        return Training.resumed(checkpoint)

    with one_thread(), locked(folder, True, begin) as training:
        robots = training.learners["robots"]
        end = robots.settings.max_steps
        run_training(training, folder, InProcess(), lambda: robots.steps >= end)
    # last: it says that all is there
    facts = training.facts() | {"numbers": paper_numbers()}
    write_json(folder / DONE_FILE, facts)


def refuse_not_begun(folder: Path) -> None:
    """Raise InputError for a folder in which no experiment has begun."""
    if not (folder / TRAININGS_FOLDER).is_dir():
        raise InputError(
            f"{folder}: there is no experiment to go on with. Leave --resume out to "
            "begin, or name the folder of one."
        )


def remove_left_locks(folder: Path) -> None:
    """Remove the locks of trainings that a stop has ended; others are at work still."""
    for lock in (folder / TRAININGS_FOLDER).glob(f"*/{LOCK_FILE}"):
        remove_left_lock(lock.parent)


def play_tests(
    experiment: Experiment, folder: Path, executor: Executor
) -> list[RunResult]:
    """Let all robots meet all fires, as far as their trainings are over.

    Results name a training as its folder, whose digest is of all that made it.
    """
    test = experiment.test
    arena = experiment.arena
    done = finished(experiment, folder).values()
    files = {path.name: str(newest_checkpoint(path)) for path in done}

    robots = (*files, *test.robots)
    named_fires = [fire for fire in test.fires if fire not in experiment.arms]
    learned_fires = [name for name in files if arm_of(name) in test.fires]
    fires = (*named_fires, *learned_fires)
    if not robots or not fires:
        return []
    evaluation = with_digests(
        Evaluation(arena, robots, fires, test.seed, test.episodes, files=files)
    )
    code = {word: of for word, of in evaluation.digests.items() if is_code(word)}
    there = folder / f"tests-{_digest(asdict(arena), code, _digest_of_shipped())}"
    return play_evaluation(evaluation, there, executor)
