"""Damaged files of every kind: each is read, or refused in a sentence that names it."""

import json
import random
import shutil
import tomllib
from collections.abc import Callable
from contextlib import suppress
from copy import deepcopy
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import pytest
import torch
import yaml
from conftest import ROOT
from trainings import Stopped, begun, tiny, trained

from reference.paper import InputError
from reference.workshop.comparing import (
    begin_evaluation,
    design,
    play_evaluation,
    resume_evaluation,
)
from reference.workshop.comparing.buildings import (
    begin_in_buildings,
    play_in_buildings,
    resume_in_buildings,
)
from reference.workshop.drawing.curves import read_summaries as read_summaries
from reference.workshop.storage.files import read_json, write_json
from reference.workshop.storage.records import record_from
from reference.workshop.storage.settings import read_yaml_file
from reference.workshop.storage.workers import InProcess
from reference.workshop.training.mlagents import with_trainer_file
from reference.workshop.training.policies import LearnedRobots
from reference.workshop.training.presets import preset
from reference.workshop.training.starting import resume_training as resume_training

ODD = (
    *(None, True, -1, 0, 1, 2, 0.5, 10**9, 10**30, -(10**400), 1e18, 1e-300),
    *(float("nan"), float("inf"), "", "nan", "1e9", "a" * 5000, "\0", "\ud800", "/"),
    *([], {}, [1, 2], {"a": 1}, [["tiny"]], "tiny", "sweep", "ppo"),
)
SIGNS = (*(bytes([sign]) for sign in b'\0\xff{[,"\n-'), b": ", b"9" * 40, b"&a *a")


def of_parts(plain: Any, rng: random.Random) -> Any:
    """Change, remove or exchange one to three parts of plain data, however deep."""
    top = [deepcopy(plain)]
    for _ in range(rng.randint(1, 3)):
        places = list(_places(top))
        here, key = rng.choice(places)
        there, other = rng.choice(places)
        change = rng.randrange(4)
        if change == 0 and here is not top:
            del here[key]
        elif change == 1:
            here[key] = deepcopy(there[other])
        else:
            here[key] = deepcopy(rng.choice(ODD))
    return top[0]


def _places(plain):
    """Every part of plain data: the dict or list that it is in, and its key there."""
    for key, part in plain.items() if isinstance(plain, dict) else enumerate(plain):
        yield plain, key
        if isinstance(part, dict | list):
            yield from _places(part)


def of_bytes(content: bytes, rng: random.Random) -> bytes:
    """Change, cut or repeat one to three places of a file."""
    for _ in range(rng.randint(1, 3)):
        a = rng.randint(0, len(content))
        b = a + rng.randint(0, 30)
        new = rng.choice([b"", 2 * content[a:b], rng.choice(SIGNS)])
        content = content[:a] + new + content[b:]
    return content


# -- The kinds ----------------------------------------------------------------------


class Kind(NamedTuple):
    """A file and who reads it.

    named  what must be in a refusal;  cases  fewer of what takes long to read
    """

    file: str
    read: Callable[[Path], object]
    named: str = ""
    cases: int = 200


FORMATS = {
    ".json": (json.load, json.dump),
    ".yaml": (yaml.safe_load, yaml.safe_dump),
    ".pt": (partial(torch.load, weights_only=True), torch.save),
}
"""How files of parts are read and written; others are damaged byte by byte."""


def parts_of(path: Path) -> Any:
    """Read a file as plain data."""
    with path.open("rb") as file:
        return FORMATS[path.suffix][0](file)


def write(parts: Any, path: Path) -> None:
    """Write plain data."""
    with path.open("wb" if path.suffix == ".pt" else "w") as file:
        FORMATS[path.suffix][1](parts, file)


def _evaluation(path: Path) -> None:
    with suppress(KeyboardInterrupt):
        play_evaluation(resume_evaluation(path.parent), path.parent, Stopped())


def settings_in(path):
    """What a trainer file makes of preset tiny."""
    return with_trainer_file(preset("tiny"), read_yaml_file(path), path)


OURS = {
    "reference": {
        "Robot": {"head": "mixture"},
        "scenario": {"people": 6, "people_per_floor": None, "rooms": ["1/hall"]},
        "episodes_per_job": 2,
    }
}
KINDS = {
    "evaluation.json": Kind("evaluation/evaluation.json", _evaluation, "evaluation"),
    "runs.csv": Kind("evaluation/runs.csv", _evaluation),
    "buildings.json": Kind(
        "both/buildings.json",
        lambda p: resume_in_buildings(p.parent, (), ()),
        "both",
        cases=50,
    ),
    "settings": Kind("settings.yaml", settings_in, cases=50),
    "summaries.csv": Kind("run/summaries.csv", read_summaries),
    "checkpoint played": Kind("run/checkpoint-000002.pt", LearnedRobots, cases=50),
    "checkpoint resumed": Kind(
        "run/checkpoint-000002.pt", lambda p: resume_training(p.parent), "run", 50
    ),
    "experiment": Kind("tiny.toml", design.read_experiment, cases=50),
    "experiment's parts": Kind(
        "tiny.json",
        lambda p: record_from(design.Experiment, read_json(p), str(p)),
        cases=50,
    ),
}


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """A folder with a file of every kind, all whole."""
    folder = tmp_path_factory.mktemp("whole")
    few = begin_evaluation(("none",), ("none", "random"), "tiny", people=2, episodes=1)
    play_evaluation(few, folder / "evaluation", InProcess())
    both = begin_in_buildings(("tiny", "museum"), ("none",), ("none",), people=2)
    with suppress(KeyboardInterrupt):
        play_in_buildings(both, folder / "both", Stopped())
    shutil.copy(ROOT / "tutorials" / "experiments" / "tiny.toml", folder)
    write(tomllib.loads((folder / "tiny.toml").read_text()), folder / "tiny.json")
    unity = parts_of(ROOT / "tests" / "workshop" / "trainers" / "unity.yaml")
    write(unity | OURS, folder / "settings.yaml")
    trained(begun(tiny(robots={"buffer_size": 200})), folder / "run", rounds=2)
    return folder


@pytest.mark.parametrize("name", KINDS)
def test_refuses_a_damaged_file_by_its_name_or_reads_it(name, whole, monkeypatch):
    """Damaged again and again: nothing but an InputError ever comes of it."""
    monkeypatch.setattr("os.fsync", lambda descriptor: None)
    kind = KINDS[name]
    rng = random.Random(0)
    refused = 0
    path = whole / kind.file
    before = path.read_bytes()
    parts = parts_of(path) if path.suffix in FORMATS else None
    for case in range(kind.cases):
        if parts is None or case % 3 == 0:
            path.write_bytes(of_bytes(before, rng))
        else:
            write(of_parts(parts, rng), path)
        try:
            kind.read(path)
        except InputError as error:
            assert (kind.named or path.name) in str(error)
            assert str(error).count(path.name) < 2
            refused += 1
        path.write_bytes(before)
    assert refused


def test_refuses_to_write_a_name_that_is_no_text(tmp_path):
    """Such as one in Latin-1: nobody could read the record again."""
    name = b"caf\xe9.pt".decode(errors="surrogateescape")
    with pytest.raises(InputError, match=r"a\.json: would hold a name"):
        write_json(tmp_path / "a.json", {"files": {"--robots": name}})
    assert list(tmp_path.iterdir()) == []
