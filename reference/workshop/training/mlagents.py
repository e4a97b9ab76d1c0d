"""ML-Agents' trainer files: where their keys stand, and what some of them mean here.

Clauses: E3 (ML-Agents 0.29.0), E1, E2 (its keys are the rows of Tables I and II).
This module knows places and names; `settings` knows what values may be.

    behaviors:
      Robot:                  one table: its rows lie in the sections that PLACES names
        trainer_type: poca
        hyperparameters: {batch_size: 1024, ...}
      Fire: ...
    default_settings: ...     what a behaviour leaves out
    reference: ...            ours, see OURS

[E3, chosen] ML-Agents refuses keys that it does not know. Ours are therefore written
behind `#= `, a comment to it; read here is what follows that mark. Keys of ML-Agents
that have no counterpart here pass if their value switches them off, and those about
Unity's program or the machine always; others are refused, each with a sentence.
"""

import os
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from types import ModuleType
from typing import Any

from reference.learning.settings import Rows, SettingsError, mapping, unknown

Place = tuple[str, ...]  # keys that lead to a section of a behaviour

PLACES: dict[Place, tuple[str, ...]] = {  # section: its rows  [E1, Tab. I]
    (): (
        "trainer_type",
        "keep_checkpoints",
        "checkpoint_interval",
        "even_checkpoints",
        "max_steps",
        "time_horizon",
        "summary_freq",
    ),
    ("hyperparameters",): (
        "batch_size",
        "buffer_size",
        "learning_rate",
        "beta",
        "epsilon",
        "lambd",
        "num_epoch",
        "learning_rate_schedule",
        "beta_schedule",
        "epsilon_schedule",
    ),
    ("network_settings",): (
        "normalize",
        "hidden_units",
        "num_layers",
        "vis_encode_type",
    ),
    ("reward_signals",): (),
    ("reward_signals", "extrinsic"): ("gamma", "strength"),
}

NO_OTHER_REWARD = "the paper's reward is the only one here"
OFF: dict[Place, dict[str, tuple[tuple[Any, ...], str]]] = {  # values, what else to do
    (): {
        "init_path": ((None,), "a training goes on from its own folder with --resume"),
        "self_play": ((None,), "the fire is the opponent, and both learn at once"),
        "behavioral_cloning": ((None,), "a strategy is imitated first with --imitate"),
    },
    ("hyperparameters",): {
        "shared_critic": ((None, False), "actor and critic are separate networks here"),
    },
    ("network_settings",): {
        "memory": ((None,), "policies here have no memory, as in Tables I and II"),
        "deterministic": ((None, False), "learners explore; evaluation takes the mean"),
        "goal_conditioning_type": ((None, "hyper", "none"), "there is no goal signal"),
    },
    ("reward_signals",): {
        name: ((None,), NO_OTHER_REWARD) for name in ("curiosity", "gail", "rnd")
    },
}
NO_EFFECT: dict[Place, tuple[str, ...]] = {
    (): ("threaded",),  # nothing is in flight between rounds
    ("reward_signals", "extrinsic"): ("network_settings",),  # this signal has none
}

TOP = ("behaviors", "default_settings", "reference", "environment_parameters")
ELSEWHERE = (  # seeds, devices, folders: the command line says these
    "env_settings",
    "engine_settings",
    "checkpoint_settings",
    "torch_settings",
    "debug",
)

OURS = "reference"
"""The block of what ML-Agents has no key for: {Robot: {head, reward_scale}, Fire: ...,
scenario: {...}, episodes_per_job, ...}."""
MARK = re.compile(r"^#= ?", re.MULTILINE)
HEADING = """\
# A trainer configuration of ML-Agents 0.29.0, and of this project.
# Lines behind "#=" are a comment to ML-Agents; this project reads them too.

"""


@dataclass(frozen=True)
class TrainerFile:
    """What a file says: the rows of each side by name, and our own block."""

    robots: Rows
    fire: Rows
    ours: Rows


# -- Reading ------------------------------------------------------------------------


def read(path: str | os.PathLike[str]) -> TrainerFile:
    """The rows that a file states; the caller checks their values.

    Raises SettingsError with the file's name, OSError if it cannot be read.
    """
    try:
        return _file(_loaded(_text(Path(path))))
    except SettingsError as error:
        raise SettingsError(f"{path}: {error}") from None


def _text(path: Path) -> str:
    try:
        return path.read_bytes().decode("utf-8-sig")
    except UnicodeDecodeError:
        raise SettingsError("this is no text: save it as UTF-8") from None
    except OSError as error:
        raise type(error)(f"cannot read {path}: {error.strerror}") from None


def _loaded(text: str) -> Any:
    """A text of YAML as plain dicts, lists, numbers and words."""
    yaml = _yaml()
    text = MARK.sub("", text)
    try:
        _refuse_repetitions(yaml.compose(text, yaml.SafeLoader), set())
        return yaml.safe_load(text)
    except yaml.MarkedYAMLError as error:
        place = error.problem_mark or error.context_mark
        raise SettingsError(f"line {place.line + 1}: {error.problem}") from None
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        if isinstance(error, SettingsError):
            raise
        raise SettingsError(f"this is no YAML: {error}") from None


def _refuse_repetitions(node: Any, seen: set[int]) -> None:
    """YAML would silently keep the last of two equal keys."""
    if node is None or isinstance(node.value, str) or id(node) in seen:
        return
    seen.add(id(node))
    pairs = [item for item in node.value if isinstance(item, tuple)]
    lines: dict[str, int] = {}
    for key, _ in pairs:
        line = key.start_mark.line + 1
        if isinstance(key.value, str) and lines.setdefault(key.value, line) != line:
            first = f"first on line {lines[key.value]}: keep one"
            raise SettingsError(
                f"line {line}: '{key.value}' stands here again, {first}"
            )
    for item in node.value:
        for child in item if isinstance(item, tuple) else (item,):
            _refuse_repetitions(child, seen)


def _file(top: Any) -> TrainerFile:
    """A whole file sorted into the two sides and ours."""
    if top is None:
        raise SettingsError("this file is empty: give it `behaviors:`")
    top = mapping(top, "the file")
    for key in top:
        if key not in TOP + ELSEWHERE:
            raise SettingsError(unknown(key, TOP + ELSEWHERE))
    if top.get("environment_parameters"):
        raise SettingsError(
            "environment_parameters: parameters that Unity draws or teaches in lessons "
            "have no counterpart here: leave them out, state `reference: scenario:`"
        )
    behaviours = mapping(top.get("behaviors"), "behaviors")
    default = mapping(top.get("default_settings"), "default_settings")
    names = {side: name for name, side in _sides(behaviours).items()}
    robots, fire = (_side(behaviours, names.get(s), s, default) for s in SIDES)
    return TrainerFile(robots, fire, mapping(top.get(OURS), OURS))


def _side(
    behaviours: Mapping[str, Any], name: str | None, side: str, default: Rows
) -> Rows:
    """The rows of one side: its behaviour's, over the default settings'."""
    own = behaviours[name] if name else None
    where = name or (f"default_settings, for {side}" if default else side)
    return dict(_rows(_merged(default, mapping(own, where)), (), where))


def _merged(under: Rows, over: Rows) -> dict[str, Any]:
    """Section by section, `over` wins."""
    both = {key: _both(under[key], over[key]) for key in over if key in under}
    return {**under, **over, **both}


def _both(under: Any, over: Any) -> Any:
    nested = isinstance(under, dict) and isinstance(over, dict)
    return _merged(under, over) if nested else over


def _rows(section: Any, place: Place, where: str) -> Iterator[tuple[str, Any]]:
    """Every row of a behaviour, out of whichever section it stands in."""
    where = ": ".join((where, *place[-1:]))
    for key, value in mapping(section, where).items():
        if (*place, key) in PLACES:
            yield from _rows(value, (*place, key), where)
        elif key in PLACES[place]:
            yield key, value
        elif key not in NO_EFFECT.get(place, ()):
            _refuse_unless_off(key, value, place, where)


def _refuse_unless_off(key: str, value: Any, place: Place, where: str) -> None:
    """Raises SettingsError for a key of no trainer, or for one that is not built."""
    off = OFF.get(place, {})
    if key not in off:
        raise SettingsError(
            f"{where}: {_misplaced(key, place) or unknown(key, _keys(place))}"
        )
    values, instead = off[key]
    if value not in values:
        raise SettingsError(f"{where}: {key} is not built: {instead}; leave it out")


def _keys(place: Place) -> list[str]:
    """Whatever may stand in a section, sections included."""
    sections = [other[-1] for other in PLACES if other and other[:-1] == place]
    return [*PLACES[place], *sections]


def _misplaced(key: str, place: Place) -> str | None:
    """Where a key should have stood, if it is, or is nearly, one of another section."""
    homes = {row: other for other, rows in PLACES.items() for row in rows}
    meant = next(iter(get_close_matches(key, [*homes, *_keys(place)], 1, 0.8)), None)
    if meant not in homes or homes[meant] == place:
        return None
    section = ": ".join(homes[meant]) or "the behaviour itself"
    return f"'{key}' is unknown here: '{meant}' belongs under {section}"


# -- Whose behaviour it is ----------------------------------------------------------

SIDES = ("Robot", "Fire")


def _sides(behaviours: Mapping[str, Any]) -> dict[str, str]:
    """Side of each behaviour; a last one without a sign has the side that is left."""
    found = {str(name): _sign(name, rows) for name, rows in behaviours.items()}
    left = [side for side in SIDES if side not in found.values()]
    if len(found) == 2 and len(left) == 1:
        found = {name: side or left[0] for name, side in found.items()}
    sides = {name: side for name, side in found.items() if side}
    if len(sides) < len(found) or len(set(sides.values())) < len(sides):
        raise SettingsError(
            "behaviors: one must be the robots' and one the fire's, and this file has "
            f"{', '.join(found)}: name them {' and '.join(SIDES)}"
        )
    return sides


def _sign(name: str, rows: Any) -> str | None:
    """The side that a behaviour's name or, since the fire is alone, trainer shows."""
    word = str(name).casefold()
    for side in SIDES:
        if word in (side.casefold(), f"{side.casefold()}s"):
            return side
    if isinstance(rows, dict) and rows.get("trainer_type") == "poca":
        return SIDES[0]
    shown = [side for side in SIDES if side.casefold() in word]
    return shown[0] if len(shown) == 1 else None


# -- Writing ------------------------------------------------------------------------


def write(path: str | os.PathLike[str], file: TrainerFile) -> None:
    """Writes a file that `read` reads and ML-Agents 0.29.0 takes, whole or not at all.

    Raises OSError where it cannot be written, SettingsError without PyYAML.
    """
    sides = {"Robot": _behaviour(file.robots), "Fire": _behaviour(file.fire)}
    ours = _dumped({OURS: dict(file.ours)}, None)
    marked = "".join(f"#= {line}" for line in ours.splitlines(keepends=True))
    text = f"{HEADING}{_dumped({'behaviors': sides}, False)}\n{marked}"
    target = Path(path)
    partial = target.with_name(f".{target.name}.part")
    try:
        partial.write_text(text, encoding="utf-8")
        os.replace(partial, target)
    except OSError as error:
        raise type(error)(f"cannot write {path}: {error.strerror}") from None
    finally:
        partial.unlink(missing_ok=True)


def _dumped(plain: Rows, flow: bool | None) -> str:
    return _yaml().safe_dump(plain, sort_keys=False, default_flow_style=flow, width=88)


def _behaviour(rows: Rows, place: Place = ()) -> dict[str, Any]:
    """Rows in the sections they belong to."""
    here = {key: rows[key] for key in PLACES[place] if key in rows}
    below = [other for other in PLACES if other and other[:-1] == place]
    return here | {other[-1]: _behaviour(rows, other) for other in below}


def _yaml() -> ModuleType:
    """PyYAML, which only these files need. Raises SettingsError without it."""
    try:
        import yaml
    except ImportError:
        raise SettingsError(
            "ML-Agents' files need PyYAML: install the extra `yaml`, "
            "pip install -e '.[yaml]'"
        ) from None
    return yaml
