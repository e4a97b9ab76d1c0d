"""Small trainings for tests: preset tiny, in this process, a second or two each."""

import resource
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import torch
from alike import same

from reference.workshop.maps import load, plan_of
from reference.workshop.storage.workers import InProcess
from reference.workshop.training.checkpoints import Task
from reference.workshop.training.loop import run_training
from reference.workshop.training.presets import Settings, preset
from reference.workshop.training.rounds import Training

torch.set_num_threads(1)  # sums in one order; on a busy machine also faster

TINY = plan_of(load("tiny"))


def tiny(**changes) -> Settings:
    """Preset tiny, yet smaller; `robots` and `fire` are rows of theirs.

    A round is two episodes of 40 s: about 64 decisions of robots, 4 of the fire. Both
    sides' buffers are full then; robots are over after 3 rounds, the fire after 4.
    """
    settings = preset("tiny")
    robots = {
        "hidden_units": 8,
        "num_epoch": 1,
        "batch_size": 16,
        "buffer_size": 40,
        "max_steps": 180,
        "summary_freq": 40,
        "checkpoint_interval": 40,
    }
    fire = {
        "hidden_units": 8,
        "num_epoch": 1,
        "batch_size": 2,
        "buffer_size": 3,
        "max_steps": 16,
        "summary_freq": 4,
        "checkpoint_interval": 4,
    }
    robots |= changes.pop("robots", {})
    fire |= changes.pop("fire", {})
    rows = {
        "robots": replace(settings.robots, **robots),
        "fire": replace(settings.fire, **fire),
        "scenario": replace(settings.scenario, time_limit=40.0),
        "episodes_per_job": 1,
        "imitation_rounds": 2,
        "imitation_episodes": 2,
        "imitation_epochs": 1,
    }
    return replace(settings, **rows | changes)


def begun(settings: Settings | None = None, **task) -> Training:
    """A training at its beginning."""
    return Training(Task("tiny", TINY, settings or tiny(), **task))


def trained(training: Training, folder: Path, rounds: int | None = None) -> Path:
    """Train on, for so many rounds or to the end; the last checkpoint's path."""
    end = None if rounds is None else training.round + rounds

    def stop() -> bool:
        return end is not None and training.round >= end

    return run_training(training, folder, InProcess(), stop)


class Stopped(InProcess):
    """Does some jobs; then somebody presses Ctrl-C, or a worker dies."""

    def __init__(self, jobs: int = 0, why: type[BaseException] = KeyboardInterrupt):
        self.jobs = jobs
        self.why = why

    def submit(self, fn, /, *given):
        """As `InProcess` does, while there are jobs to do."""
        if not self.jobs:
            raise self.why
        self.jobs -= 1
        return super().submit(fn, *given)


equal = same
"""Are two states the same number by number, tensors and plain values?"""


@contextmanager
def room_for(size: int):
    """No file of this process can grow beyond so many bytes, as on a full disk."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
