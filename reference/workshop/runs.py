"""Runs in folders, trainings and evaluations alike: begin one, or go on with it.

Whoever goes on may ask for nothing else than what was begun, with the same version.
"""

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import reference
from reference.building import load, plan_of


class RunError(ValueError):
    """A run that can neither begin nor go on; one message for people."""


class ContradictionError(RunError):
    """What was asked for contradicts itself, or what was begun."""


def refuse_used(folder: Path) -> None:
    """Raises RunError for a folder with something in it: a new run needs its own."""
    if folder.exists() and not folder.is_dir():
        raise RunError(f"{folder}: is a file. Name a folder.")
    if folder.exists() and any(folder.iterdir()):
        raise RunError(
            f"{folder}: is not empty. Name another folder, or add --resume to go on "
            "with what is in it."
        )


def refuse_version(path: Path, version: object) -> None:
    """Raises RunError for what another version wrote."""
    if version != reference.__version__:
        raise RunError(
            f"{path}: was written by version {version}, this is "
            f"{reference.__version__}, in which runs may end otherwise. Go on with the "
            "version that wrote it, or begin anew in another folder."
        )


def refuse_contradictions(run: str, asked: Iterable[tuple[str, Any, Any]]) -> None:
    """Raises ContradictionError for the first thing that is not as it was begun.

    run    such as "the training in out"
    asked  option, what was asked for (None: nothing), and what the run has
    """
    for option, here, there in asked:
        if here is not None and here != there:
            raise ContradictionError(
                f"{option}: {here} was asked for, but {run} has {there}. "
                "Leave it out, or begin anew in another folder."
            )


def building_asked(name: str | None, begun: str, plan: str) -> tuple[str, Any, Any]:
    """The row of --building for `refuse_contradictions`: the drawing counts.

    begun  the building's name in the run;  plan  its floor file's text
    """
    same = name is not None and plan_of(load(name)) == plan
    return "--building", name, name if same else f"{begun}, drawn otherwise"
