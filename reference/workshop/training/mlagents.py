"""Trainer files of ML-Agents: find the rows of Tables I and II in their sections.

Clauses: E3 (ML-Agents 0.29.0), E1, E2 (its keys are the rows of Tables I and II).

    behaviors:
      Robot:                  one table: its rows lie in the sections that `Row` names
        trainer_type: poca
        hyperparameters: {batch_size: 1024, ...}
      Fire: ...
    default_settings: ...     what a behaviour leaves out
    reference: ...            what ML-Agents has no key for: {Robot: {head, ...},
                              Fire: ..., scenario: {...}, episodes_per_job, ...}

[E3, chosen] What the file leaves out stays as in the preset, not as ML-Agents would
have it: files of a few lines can then vary one of the tables.  The head alone is
ML-Agents' own, one Gaussian, unless `reference` or the command line names another.
Keys without a counterpart here pass if their value switches them off, or if they are
about Unity's program or the machine; others are refused, all sections at once.
"""

import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from reference.learning.settings import Side
from reference.workshop.remedies.settings import SideSettings
from reference.workshop.storage.files import read_text
from reference.workshop.storage.records import SettingsError, mapping, rows_of, unknown
from reference.workshop.training.presets import Settings, changed

ROWS = rows_of(SideSettings)
PLACES = {
    ".".join((*row.section, name)): name
    for name, row in ROWS.items()
    if row.section is not None
}
"""Rows of the tables by where ML-Agents keeps them, as in hyperparameters.beta."""

OTHERS = {  # what ML-Agents has besides the choices of a row
    "trainer_type": ("sac",),
    "network_settings.vis_encode_type": ("nature_cnn", "resnet", "match3"),
}
OFF = (  # sections and keys of a behaviour that are not built
    *("init_path", "even_checkpoints", "self_play", "behavioral_cloning"),
    *("hyperparameters.shared_critic", "network_settings.memory"),
    *("network_settings.deterministic", "network_settings.goal_conditioning_type"),
    *("reward_signals.curiosity", "reward_signals.gail", "reward_signals.rnd"),
)
PASS = (False, "hyper", "none")  # the last two of goal_conditioning_type
LESSONS = "environment_parameters"  # what Unity's environment varies: not built
NO_EFFECT = ("threaded", "reward_signals.extrinsic.network_settings")
OF_UNITY = ("env_settings", "engine_settings", "torch_settings", "debug")
TOP = ("behaviors", "default_settings", "reference", "checkpoint_settings", *OF_UNITY)
NAMES: dict[Side, str] = {"robots": "Robot", "fire": "Fire"}  # of behaviours
MOST_BYTES = 1 << 16  # of a file


def read_yaml(path: Path, base: Settings, head: str | None = None) -> Settings:
    """Replace in `base` what a trainer file of ML-Agents, or one of ours, states.

    head: of the robots, if the command line names one.  Notes on stderr which behaviour
    is taken for which side, and with which head. Raises SettingsError, also without
    PyYAML, and OSError for an unreadable file.
    """
    text = read_text(path, MOST_BYTES)
    try:
        top = mapping(_parsed(text), "the file")
        top["behaviors"] = mapping(top.get("behaviors"), "behaviors")
        _refuse_old(top)
        _refuse_not_built(top)
        rows = _stated(top, names := _sides(top["behaviors"]))
    except SettingsError as error:
        raise SettingsError(f"{path}: {error}") from None
    if head:
        rows["robots"]["head"] = head
    made = changed(base, rows, str(path))
    for side, name in names.items():
        word = getattr(made, side).head
        own = ", ML-Agents' own: one Gaussian" if word == "floor" else ""
        note = f"'{name}' is taken for {side}, with head '{word}'{own}"
        print(f"note: {path}: {note}", file=sys.stderr)
    return made


def _parsed(text: str) -> Any:
    """Parse a text of YAML into plain dicts, lists, numbers and words."""
    try:
        import yaml
    except ImportError:
        raise SettingsError("a YAML file needs PyYAML: pip install PyYAML") from None
    try:
        if any(isinstance(event, yaml.AliasEvent) for event in yaml.parse(text)):
            raise ValueError("write out what *aliases stand for")
        for line, name in _twice(yaml.compose(text, yaml.SafeLoader)):
            raise ValueError(f"line {line}: '{name}' is there already")
        return yaml.safe_load(text)
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        words = " ".join(str(error).replace('in "<unicode string>",', "at").split())
        raise SettingsError(f"this is no YAML: {words}") from None


def _twice(node: Any) -> Iterator[tuple[int, str]]:
    """Lines and names of keys that a mapping has already; YAML would take the last."""
    seen = set[str]()
    if node is None or node.id == "scalar":
        return
    for part in node.value:
        key, value = part if isinstance(part, tuple) else (None, part)
        if key is not None:
            if (name := str(key.value)) in seen:
                yield key.start_mark.line + 1, name
            seen.add(name)
        yield from _twice(value)


# -- What is not built --------------------------------------------------------------


def _refuse_old(top: Mapping[str, Any]) -> None:
    """Raise SettingsError for rows without sections, as in ML-Agents' releases 1, 2."""
    for rows in (*top.values(), *top["behaviors"].values()):
        flat = _flat(rows) if isinstance(rows, Mapping) else {}
        if lost := [at for at, name in PLACES.items() if at != name and name in flat]:
            raise SettingsError(
                "this is laid out as in ML-Agents' releases 1 and 2. Write all "
                f"behaviours under `behaviors:`, and there {', '.join(lost)}"
            )


def _refuse_not_built(top: Mapping[str, Any]) -> None:
    """Raise SettingsError for what is not built: a trainer first, then all sections."""
    not_built = [LESSONS] if top.get(LESSONS) else []
    parts = {"default_settings": top.get("default_settings"), **top["behaviors"]}
    flat = {name: _flat(mapping(rows, name)) for name, rows in parts.items()}
    for name, rows in flat.items():
        for path, others in OTHERS.items():
            if (word := rows.get(path)) in others:
                instead = " or ".join(ROWS[PLACES[path]].choices)
                raise SettingsError(
                    f"{name}: {PLACES[path]} {word} is not built here: write {instead}"
                )
        off = {key for path in rows if rows[path] not in PASS if (key := _off(path))}
        if off:
            not_built.append(f"{name}: {', '.join(sorted(off))}")
    if not_built:
        sections = "; ".join(not_built)
        raise SettingsError(f"this is not built here, leave it out: {sections}")


def _off(path: str) -> str:
    """The section or key that is not built and that a path is in, if any."""
    return next((key for key in OFF if f"{path}.".startswith(f"{key}.")), "")


# -- What is read -------------------------------------------------------------------


def _stated(top: dict[str, Any], names: Mapping[Side, str]) -> dict[str, Any]:
    """Collect the rows of whole settings that a file states; names: of behaviours."""
    for key in {k for k, value in top.items() if value is not None} - {*TOP, LESSONS}:
        raise SettingsError(unknown(key, TOP))
    ours = mapping(top.get("reference"), "reference")
    if "preset" in ours:
        raise SettingsError("reference: preset is an option of the command line")
    for side, name in NAMES.items():
        own = mapping(ours.pop(name, ours.get(side)), f"reference: {name}")
        own = {row: _number(value) for row, value in own.items()}
        rows = _rows(top.get("default_settings"), "default_settings")
        if side in names:
            behaviour = names[side]
            rows |= {"head": "floor"} | _rows(top["behaviors"][behaviour], behaviour)
        if "learning_rate_schedule" in rows:  # as ML-Agents documents
            both = ("beta_schedule", "epsilon_schedule")
            rows = dict.fromkeys(both, rows["learning_rate_schedule"]) | rows
        ours[side] = rows | own
    return ours


def _rows(section: Any, where: str) -> dict[str, Any]:
    """Collect the rows of a behaviour from its sections."""
    rows = {}
    for path, value in _flat(mapping(section, where)).items():
        if path in PLACES:
            rows[PLACES[path]] = _number(value)
        elif not _off(path) and not path.startswith(NO_EFFECT):
            raise SettingsError(f"{where}: {unknown(path, PLACES)}")
    return rows


def _flat(section: Mapping[Any, Any], over: str = "") -> dict[str, Any]:
    """Values by their paths, as in {"hyperparameters.beta": 0.01}; nulls left out."""
    flat: dict[str, Any] = {}
    for key, value in section.items():
        if isinstance(value, Mapping):
            flat |= _flat(value, f"{over}{key}.")
        elif value is not None:
            flat[f"{over}{key}"] = value
    return flat


def _number(value: Any) -> Any:
    """Read 1e-4, a word to YAML, and 5.0e6, none whole [E3, settings.py]."""
    try:
        real = float(value) if isinstance(value, str | float) else value
    except ValueError:
        return value
    return int(real) if isinstance(real, float) and real.is_integer() else real


def _sides(behaviours: Mapping[str, Any]) -> dict[Side, str]:
    """Match sides to behaviours: by name, or as a poca, which is the robots'."""
    of_sides: dict[Side, list[str]] = {"robots": [], "fire": []}
    clear, pocas = not behaviours, list[str]()
    for name, rows in behaviours.items():
        poca = isinstance(rows, Mapping) and rows.get("trainer_type") == "poca"
        fire, robot = "fire" in name.lower(), "robot" in name.lower()
        robots = robot if fire != robot else poca
        of_sides["robots" if robots else "fire"].append(name)
        clear |= poca or fire or robot
        if poca:
            pocas.append(name)
    if len(pocas) > 1:
        names = " and ".join(pocas)
        raise SettingsError(
            f"behaviors: {names} are poca; one group learns here, the robots. "
            "Leave all but one out"
        )
    if not clear or max(map(len, of_sides.values())) > 1:
        names = ", ".join(behaviours)
        raise SettingsError(
            f"behaviors: who are {names}? Name the robots' Robot, the fire's Fire, and "
            "leave others out"
        )
    return {side: names[0] for side, names in of_sides.items() if names}
