"""Checkpoints: a whole training in one file, written whole or not at all.

A file holds tensors and plain data alone, and loading it never executes code.  It
records its building, scenario, game, version and the paper's numbers, and is refused
where it does not belong.
"""

from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from copy import deepcopy
from dataclasses import asdict, dataclass, field, fields, replace
from hashlib import sha256
from io import BytesIO
from itertools import accumulate
from pathlib import Path
from re import fullmatch
from sys import intern
from typing import Any
from zipfile import BadZipFile, ZipFile

import numpy as np
import torch
from torch import Tensor

import reference
from reference.learning.experience import Decisions
from reference.learning.players import LearnedNetwork
from reference.learning.ppo import Learner
from reference.learning.settings import SIDES, Side
from reference.paper import InputError
from reference.workshop.anchors.settings import SideSettings
from reference.workshop.maps import parse_map
from reference.workshop.storage.files import refuse_no_file, write_whole
from reference.workshop.storage.numbers import paper_numbers
from reference.workshop.storage.records import check_type, checked_mapping, record_from
from reference.workshop.strategies import LEARNED, SHIPPED
from reference.workshop.training.families import Family
from reference.workshop.training.presets import Settings

KIND = "checkpoint of fire-rescue-reference"
ARCHIVE = b"PK\3\4"
"""How a zip begins that has something in it."""
MOST_CLAIMED = 2
"""Times the bytes of a file: names that recur in it are kept once."""
FORMAT = 9
"""Grows whenever settings, observations, actions or networks mean something else."""


class CheckpointError(InputError):
    """A file that is no checkpoint, or does not fit here; one message for people."""


@contextmanager
def must_fit(path: object, what: str, advice: str = "Name another.") -> Iterator[None]:
    """Raise CheckpointError where the parts of a checkpoint do not fit together."""
    try:
        yield
    except Exception as error:  # torch tells damage in many ways
        why = f" ({error!s:.200})" if isinstance(error, ValueError) else ""
        raise CheckpointError(f"{path}: {what}{why}. {advice}") from error


@dataclass(frozen=True)
class Task:
    """What defines a training [E6]; it stays the same until the training is over.

    building  as it was asked for;  plan  the text of its floor file; "" for a family
    fixed     who play a side that does not learn, in turn: named strategies or networks
    initial   networks with which a side begins to learn, if not with random ones
    imitate   the strategy that robots copy first, if any
    family    the buildings, if there are several
    """

    building: str
    plan: str
    settings: Settings
    seed: int = 0
    fixed: Mapping[Side, tuple[LearnedNetwork | str, ...]] = field(default_factory=dict)
    initial: Mapping[Side, LearnedNetwork] = field(default_factory=dict)
    imitate: str | None = None
    family: Family | None = None

    @property
    def plans(self) -> tuple[str, ...]:
        """The texts of the maps, or of one that was generated, as an example."""
        if self.family is None:
            return (self.plan,)
        return self.family.plans or (self.family.example(),)


@dataclass(frozen=True)
class Checkpoint:
    """A training between two rounds.

    round     how many rounds are over
    learners  for each side that learns, what `state_of` gave
    progress  plain numbers: what is counted and what waits for the next summary
    numbers   of the paper, by name; none where an older version wrote it
    """

    task: Task
    round: int
    learners: dict[Side, dict[str, Any]]
    progress: dict[str, Any]
    version: str = reference.__version__
    numbers: Mapping[str, Any] = field(default_factory=paper_numbers)

    def player(self, side: Side) -> LearnedNetwork | str:
        """The policy of a side: its network as learned so far, or the first fixed."""
        if side in self.learners:
            weights = self.learners[side]["actor"]
            return LearnedNetwork(getattr(self.task.settings, side), weights)
        return self.task.fixed[side][0]

    def learned(self, side: Side) -> LearnedNetwork | None:
        """The network that a side learned in this training; None if it learned none.

        What ships has no learner any more, and both sides' networks fixed.
        """
        who = self.player(side)
        here = side in self.learners or not self.learners
        return who if here and isinstance(who, LearnedNetwork) else None


def player_names(players: Iterable[LearnedNetwork | str]) -> str:
    """Name players that do not learn: strategies, and networks by their weights."""
    return ", ".join(who if isinstance(who, str) else _name_of(who) for who in players)


def _name_of(network: LearnedNetwork) -> str:
    """Name a network by a digest of its weights."""
    weights = [network.weights[name] for name in sorted(network.weights)]
    digest = sha256(b"".join(weight.numpy().tobytes() for weight in weights))
    return f"network {digest.hexdigest()[:6]}"


# -- Files --------------------------------------------------------------------------


def keep_checkpoint(
    checkpoint: Checkpoint, folder: Path, rounds: Iterable[int] = ()
) -> Path:
    """Write a checkpoint; delete the folder's others but for these rounds'."""
    path = _file_of(checkpoint.round, folder)
    save_checkpoint(checkpoint, path)
    # Only now: a disk that is full must not cost the checkpoint before.
    stay = {path, *(_file_of(number, folder) for number in rounds)}
    for old in {*checkpoints_in(folder)} - stay:
        old.unlink(missing_ok=True)
    return path


def _file_of(number: int, folder: Path) -> Path:
    return folder / f"checkpoint-{number:06}.pt"


def _round_of(path: Path) -> int | None:
    """The round in a checkpoint's name; None where the name is not ours: a copy's."""
    named = fullmatch(r"checkpoint-([0-9]{6,})\.pt", path.name)
    return int(named[1]) if named else None


def newest_checkpoint(folder: Path) -> Path | None:
    """The latest checkpoint in a folder, if there is one."""
    return next(reversed(checkpoints_in(folder)), None)


def checkpoints_in(folder: Path) -> list[Path]:
    """All checkpoints in a folder, the latest last."""
    rounds = {path: _round_of(path) for path in folder.glob("*.pt")}
    own = {path: number for path, number in rounds.items() if number is not None}
    return sorted(own, key=own.__getitem__)


def save_checkpoint(checkpoint: Checkpoint, path: Path) -> None:
    """Write the whole file, or nothing so that what was there stays.

    Raises OSError, with a message for people.
    """
    head = {"kind": KIND, "format": FORMAT, "game": reference.GAME}
    memory = BytesIO()
    torch.save(_equal_bytes(head | asdict(checkpoint)), memory)
    with memory.getbuffer() as content:  # released before the memory is
        write_whole(path, content)


def checkpoint_file(path: str | Path) -> Path:
    """Find the file that is meant; see `load_checkpoint`.

    Raises CheckpointError for a folder without a checkpoint.
    """
    path = SHIPPED if path == LEARNED else Path(path)
    if not path.is_dir():
        return path
    newest = newest_checkpoint(path)
    if newest is None:
        raise CheckpointError(f"{path}: there is no checkpoint in this folder.")
    return newest


def load_checkpoint(path: str | Path) -> Checkpoint:
    """Read the checkpoint in a file, or the newest one in a training's folder.

    path: LEARNED stands for what ships. Raises CheckpointError for anything else,
    OSError for an unreadable file.
    """
    path = checkpoint_file(path)
    advice = "Name another."
    kept = checkpoints_in(path.parent)
    if len(kept) > 1 and path == kept[-1]:
        advice = f"Delete it, and {kept[-2].name} is the newest."
    content = _content(path, advice)
    # Before anything else is read: what follows may mean something else there.
    made = content.get("format")
    game = content.get("game")
    version = content.get("version")
    if (made, game) != (FORMAT, reference.GAME):
        raise CheckpointError(
            f"{path}: is of game {game!s:.9} and format {made!s:.9}, written by "
            f"version {version!s:.40}; here they are {reference.GAME} and {FORMAT}. "
            "Use that version, or train anew."
        )
    with must_fit(path, "lacks a part, or is damaged", advice):
        return _checkpoint(content)


def _content(path: Path, advice: str) -> dict[str, Any]:
    """Read what torch saved, without executing it. Raises CheckpointError, OSError."""
    refuse_no_file(path)
    damaged = must_fit(path, "is damaged, or is no checkpoint", advice)
    with path.open("rb") as file, damaged:
        if file.read(4) != ARCHIVE:  # torch would read an older kind, unchecked
            raise BadZipFile
        archive = ZipFile(file)
        packed = [part for part in archive.infolist() if part.compress_type]
        if packed or archive.testzip():  # torch compresses nothing, and does not look
            raise BadZipFile
        file.seek(0)
        content = torch.load(file, map_location="cpu", weights_only=True)
        # A tensor of stride 0 claims gigabytes in a file of a few bytes, as does a list
        # of a list twice, of a list twice, ...
        claimed = accumulate(map(_size_of, _leaves(content, object)))
        there = sum(part.file_size for part in archive.infolist())
        if any(size > MOST_CLAIMED * there for size in claimed):
            raise ValueError("parts far larger than the file")
        if not isinstance(content, Mapping) or content["kind"] != KIND:
            raise ValueError("of another program")
        return dict(content)


# -- As plain data ------------------------------------------------------------------


def _equal_bytes(plain: Any) -> Any:
    """Make equal contents equal bytes: pickle tells which words are one object."""
    if isinstance(plain, str):
        return intern(plain)
    if isinstance(plain, Mapping):
        return {_equal_bytes(key): _equal_bytes(value) for key, value in plain.items()}
    if isinstance(plain, list | tuple):
        return type(plain)(map(_equal_bytes, plain))
    return plain


def _checkpoint(content: dict[str, Any]) -> Checkpoint:
    """Make a checkpoint of plain data. Raises SettingsError, KeyError, ..."""
    # Players are records of their own, which `record_from` cannot tell from names.
    task = checked_mapping(content["task"], "task")
    fixed = task.pop("fixed")
    initial = task.pop("initial")
    sides: Any = {
        "fixed": {side: tuple(map(_player, who)) for side, who in fixed.items()},
        "initial": {side: _player(who) for side, who in initial.items()},
    }
    rows = {f.name: content[f.name] for f in fields(Checkpoint) if f.name in content}
    rows.setdefault("numbers", {})
    rows["task"] = replace(record_from(Task, task, "task"), **sides)
    checkpoint = record_from(Checkpoint, rows, "checkpoint")
    for plan in checkpoint.task.plans:
        parse_map(plan, "its plan")
    _refuse_numbers(checkpoint)
    _refuse_versions(checkpoint)
    return checkpoint


def _refuse_numbers(checkpoint: Checkpoint) -> None:
    """Raise ValueError for numbers with which no training could go on.

    These are weights of another type, weights that are not finite, and counts below 0:
    torch would load them.
    """
    # all networks: of those who play, the critics, and earlier versions
    learners = checkpoint.learners.values()
    players = [checkpoint.player(side) for side in SIDES]
    everybody = [players, checkpoint.task.fixed, checkpoint.task.initial]
    networks = [who.weights for who in _leaves(everybody, LearnedNetwork)]
    for state in learners:
        networks += [state["critic"], *state["versions"].values()]

    for weights in networks:
        for name, weight in weights.items():
            wanted = torch.float64 if NORMALISER in name else torch.float32
            if weight.dtype != wanted:
                raise ValueError(f"weights of another type, {weight.dtype}")
    states = [{name: state[name] for name in NETWORKS} for state in learners]
    for leaf in _leaves([states, networks], Tensor | float):
        if not torch.as_tensor(leaf).isfinite().all():
            raise ValueError("weights that are no finite numbers")

    counts = [checkpoint.round, *(state["steps"] for state in learners)]
    if min(counts) < 0:
        raise ValueError("counts below 0")


def _refuse_versions(checkpoint: Checkpoint) -> None:
    """Raise ValueError for earlier versions that are of no round, or no such network.

    They play in a worker, rounds later.
    """
    for state in checkpoint.learners.values():
        shapes = _shapes_of(state["actor"])
        for number, weights in state["versions"].items():
            if not isinstance(number, int) or not 0 <= number <= checkpoint.round:
                raise ValueError(f"a version of round {number!s:.40}")
            if _shapes_of(weights) != shapes:
                raise ValueError(f"weights of another shape, of round {number}")


def _shapes_of(weights: Mapping[str, Tensor]) -> dict[str, torch.Size]:
    return {name: weight.shape for name, weight in weights.items()}


def _leaves(plain: Any, kind: Any) -> Iterator[Any]:
    """Find all of a kind in plain data, however deep; what is shared, each time."""
    if isinstance(plain, kind):
        yield plain
    if isinstance(plain, Mapping):
        plain = [*plain, *plain.values()]
    if isinstance(plain, list | tuple):
        for part in plain:
            yield from _leaves(part, kind)


def _size_of(part: Any) -> int:
    """Bytes that a part has in a file, at least, without those in it."""
    if isinstance(part, Tensor):
        return part.numel() * part.element_size()
    return len(part) if isinstance(part, str) else 1


def _player(plain: Any) -> LearnedNetwork | str:
    if isinstance(plain, str):
        return plain
    settings = record_from(SideSettings, plain["settings"], "settings of a network")
    return LearnedNetwork(settings, plain["weights"])


NETWORKS = ("actor", "critic", "optimiser")
NORMALISER = ".normaliser."  # in the names of its weights, of 64 bits


def state_of(
    learner: Learner, versions: Mapping[int, Mapping[str, Tensor]] = {}
) -> dict[str, Any]:
    """Collect all that a learner needs to resume, as plain data and its own tensors.

    versions: the weights of earlier rounds that are kept, by round
    """
    buffer = [vars(p) | {"grids": _packed(p.grids)} for p in learner.buffer]
    return {
        **{name: getattr(learner, name).state_dict() for name in NETWORKS},
        "buffer": buffer,
        "rng": learner.rng.get_state(),
        "steps": learner.steps,
        "versions": versions,
    }


def restore(learner: Learner, state: dict[str, Any]) -> None:
    """Load what `state_of` gave. Raises ValueError and others for what misfits."""
    wanted = learner.optimiser.param_groups[0].keys()
    for name in NETWORKS:
        # Copied: an optimiser would go on in the tensors that it is given.
        getattr(learner, name).load_state_dict(deepcopy(state[name]))
    if any(wanted - group.keys() for group in learner.optimiser.param_groups):
        raise ValueError("an optimiser without all of its rows")
    for weight, moments in learner.optimiser.state.items():
        for moment in _leaves(dict(moments), Tensor):
            if moment.dim() and moment.shape != weight.shape:  # a count has no shape
                raise ValueError("moments of another shape")
    learner.buffer = [
        Decisions(**part | {"grids": _unpacked(part["grids"])})
        for part in state["buffer"]
    ]
    _refuse_decisions(learner)
    learner.rng.set_state(state["rng"])
    check_type("steps", state["steps"], int)
    learner.steps = state["steps"]


def _refuse_decisions(learner: Learner) -> None:
    """Raise an error for a buffer from which its learner could not learn, rounds later.

    Its networks read a decision of each part.
    """
    for part in learner.buffer:
        columns = vars(part).values()
        if len({len(column) for column in columns}) > 1:
            raise ValueError("columns of decisions that differ in length")
        if not all(column.isfinite().all() for column in columns):
            raise ValueError("decisions that are no finite numbers")
        with torch.no_grad():
            loss, _ = learner.loss(part.rows(torch.arange(1)), epsilon=0.2, beta=0.0)
        if loss.dtype != torch.float32:
            raise ValueError(f"decisions of another type, {loss.dtype}")
    if learner.buffer:
        learner.joined(learner.buffer)


def _packed(grids: Tensor) -> dict[str, Any]:
    """Pack cells of 0 and 1 into bits: grids are most of a file."""
    bits = np.packbits(grids.numpy().reshape(len(grids), -1), axis=1)
    return {"bits": torch.from_numpy(bits), "shape": list(grids.shape)}


def _unpacked(packed: dict[str, Any]) -> Tensor:
    shape = packed["shape"]
    count = int(np.prod(shape[1:]))
    if not 0 <= count <= 8 * packed["bits"].shape[1]:
        raise ValueError("grids that are not there")
    bits = np.unpackbits(packed["bits"].numpy(), axis=1, count=count)
    return torch.from_numpy(bits.reshape(shape))
