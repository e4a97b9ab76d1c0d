"""Trainer files of ML-Agents: find the rows of Tables I and II in their sections.

Its keys are the rows of the tables [E1] [E2].

    behaviors:
      Robot:                  one table; `Allowed` names the section of each row
        trainer_type: poca
        hyperparameters: {batch_size: 1024, ...}
      Fire: ...
    default_settings: ...     what a behaviour leaves out
    reference: ...            what ML-Agents has no key for: {Robot: {head, ...},
                              Fire: ..., scenario: {...}, episodes_per_job, ...}

[E3, chosen] What the file leaves out stays as in the preset, not as ML-Agents would
have it: files of a few lines can then vary one of the tables.  The head alone is
ML-Agents' own, one Gaussian, unless `reference` or the command line names another.
A row may stand in one place, by one name.

What becomes of keys without a counterpart here:

    their value switches them off                    they pass
    about Unity's program or the machine             they pass
    `train` has an option for it                     a note names the option
    the same, and it would make another training     refused
    all others                                       refused, all at once
"""

from collections.abc import Iterator, Mapping
from itertools import accumulate
from pathlib import Path
from typing import Any, NamedTuple

from reference.learning.settings import Side
from reference.workshop.anchors.settings import SideSettings
from reference.workshop.storage.records import SettingsError, allowed_values
from reference.workshop.storage.settings import (
    Section,
    checked_section,
    settings_errors_naming,
    twice,
)
from reference.workshop.storage.words import did_you_mean, some_of
from reference.workshop.training.presets import Settings, with_rows

PLACES = {
    ".".join((*row.section, name)): name
    for name, row in allowed_values(SideSettings).items()
    if row.section is not None
}
"""Rows of the tables by where ML-Agents keeps them, as in hyperparameters.beta."""

SECTIONS = {
    head for place in PLACES for head in accumulate(place.split("."), "{}.{}".format)
} - {*PLACES}

PASSED_OVER = {
    "hyperparameters.shared_critic": (False,),
    "network_settings.deterministic": (False,),
    "network_settings.goal_conditioning_type": ("hyper", "none"),
    "network_settings.memory": (None,),
    "even_checkpoints": (False,),
    "threaded": (False, True),
    "init_path": (None,),
    "self_play": (None,),
    "behavioral_cloning": (None,),
}
"""What passes without a counterpart: values that switch it off or have no effect."""

NO_EFFECT = "reward_signals.extrinsic.network_settings."
BEHAVIOUR_NAMES: dict[Side, str] = {"robots": "Robot", "fire": "Fire"}  # of behaviours

IN_PLACE_OF = {
    "checkpoint_settings.initialize_from": "--initialize-from",
    "checkpoint_settings.load_model": "--resume",
    "checkpoint_settings.resume": "--resume",
    "checkpoint_settings.inference": "evaluate, not train",
    "checkpoint_settings.run_id": "--out",
    "checkpoint_settings.results_dir": "--out",
    "checkpoint_settings.force": "--out, which names a new folder",
    "env_settings.seed": "--seed",
    "env_settings.num_envs": "--workers",
}
"""What a command line says here, by where ML-Agents keeps it."""

OTHER_TRAINING = ("initialize_from", "load_model", "resume", "inference")
"""Of these, what makes another training: it is refused, the rest is noted."""

OF_UNITY = {
    "checkpoint_settings": ("train_model",),
    "env_settings": (
        "env_path",
        "env_args",
        "base_port",
        "num_areas",
        "timeout_wait",
        "max_lifetime_restarts",
        "restarts_rate_limit_n",
        "restarts_rate_limit_period_s",
    ),
    "engine_settings": (
        "width",
        "height",
        "quality_level",
        "time_scale",
        "target_frame_rate",
        "capture_frame_rate",
        "no_graphics",
        "no_graphics_monitor",
    ),
    "torch_settings": ("device",),
}
"""Keys about Unity's program or the machine, which change nothing here."""

ONLY_EMPTY = ("environment_parameters",)  # at the top
NOT_ASKED = (None, False, -1)  # values that ask for nothing
UNKNOWN = "unknown, or not built here"
TOP = ("behaviors", "default_settings", "reference", *OF_UNITY, "debug")


class Stated(NamedTuple):
    """What a file states: where ML-Agents keeps it, in which line."""

    place: str
    value: Any
    line: int


Rows = dict[str, Stated]
"""Rows that a behaviour states, by the names of `SideSettings`."""


def with_trainer_file(
    base: Settings, read: Any, path: Path
) -> tuple[Settings, list[str]]:
    """Replace in `base` what a trainer file of ML-Agents, or one of ours, states.

    read: the file's content, as of `read_yaml_file`; path: the file, for messages
    Returns notes, too: which behaviour is taken for which side, and which options say
    what the file cannot. Raises SettingsError.
    """
    with settings_errors_naming(path):
        top = _checked_top(read)
        notes = list(_options_in(top))
        behaviours = checked_section(top.get("behaviors"), "behaviors")
        defaults, of_each = _rows(top.get("default_settings"), behaviours)
        names = _sides(of_each, defaults)
        ours = checked_section(top.get("reference"), "reference")
        rows: dict[str, Any] = dict(ours)
        for side in BEHAVIOUR_NAMES:
            rows[side] = _rows_of_side(side, names, of_each, defaults, ours)
            rows.pop(BEHAVIOUR_NAMES[side], None)
    made = with_rows(base, rows, str(path))
    for side, name in names.items():
        own = BEHAVIOUR_NAMES[side]
        if name != own:
            notes.append(f"'{name:.60}' is taken for {side}")
        head = getattr(base, side).head
        stated = "head" in (ours.get(own) or ours.get(side) or {})
        if not stated and getattr(made, side).head != head:
            notes.append(
                f"{side}: head floor, as ML-Agents has it, not {head}; to keep the "
                f"preset's: reference: {{{own}: {{head: {head}}}}}, or --head {head}"
            )
    return made, [f"{path}: {note}" for note in notes]


# -- The top ------------------------------------------------------------------------


def _checked_top(read: Any) -> Section:
    """Check the names at the top of a file."""
    top = checked_section(read, "the file")
    for key, value in top.items():
        if key not in TOP and (value or key not in ONLY_EMPTY):
            hint = did_you_mean(key, TOP)
            raise SettingsError(f"{UNKNOWN}: {key:.60}. Leave it out.{hint}")
    return top


def _options_in(top: Section) -> Iterator[str]:
    """Say which options of `train` take the place of what a file states.

    Raises SettingsError for what would make another training, and for unknown keys.
    """
    for name, passed in OF_UNITY.items():
        section = checked_section(top.get(name), name)
        for key, value in section.items():
            place = f"{name}.{key}"
            if place in IN_PLACE_OF:
                if value in NOT_ASKED:
                    continue
                instead = IN_PLACE_OF[place]
                if key in OTHER_TRAINING:
                    raise SettingsError(
                        f"line {section.lines[key]}: {place} is not read here. Leave "
                        f"it out, and take {instead}."
                    )
                yield f"{place} is not read; take {instead}"
            elif key not in passed:
                here = [k for k in IN_PLACE_OF if k.startswith(f"{name}.")]
                hint = did_you_mean(place, [*here, *(f"{name}.{k}" for k in passed)])
                raise SettingsError(f"{UNKNOWN}: {place:.60}. Leave it out.{hint}")


# -- Behaviours ---------------------------------------------------------------------


def _rows(default_settings: Any, behaviours: Section) -> tuple[Rows, dict[str, Rows]]:
    """Collect the rows of the defaults, and those of behaviours by their names.

    Raises SettingsError that names keys without a counterpart.
    """
    lost = set[tuple[str, str]]()
    default = "default_settings"
    defaults = _rows_of_part(default, default_settings, lost)
    of_each = {name: _rows_of_part(name, of, lost) for name, of in behaviours.items()}
    if lost:
        known = {*PLACES, *SECTIONS}
        hint = did_you_mean(min(lost)[1], known) if len(lost) == 1 else ""
        words = some_of((f"{part}: {at}" for part, at in sorted(lost)), between="; ")
        raise SettingsError(f"{UNKNOWN}: {words}. Leave it out.{hint}")
    return defaults, of_each


def _rows_of_part(part: str, sections: Any, lost: set[tuple[str, str]]) -> Rows:
    """Collect the rows of a behaviour; add to `lost` what has no counterpart.

    Raises SettingsError for a row that is there twice or has no value.
    """
    rows: Rows = {}
    seen: dict[str, Stated] = {}
    for stated in _flat(checked_section(sections, f"{part:.60}")):
        place = stated.place
        if place in seen:
            raise twice(f"{part:.60}: {place}", seen[place].line, stated.line)
        seen[place] = stated
        if place not in PLACES:
            if not _passes(stated):
                lost.add((part, _section(place)))
        elif stated.value is None:
            raise SettingsError(
                f"line {stated.line}: {part:.60}: {place} has no value. Write one, or "
                "leave it out."
            )
        else:
            rows[PLACES[place]] = stated
    return rows


def _passes(stated: Stated) -> bool:
    """Whether what has no counterpart has no effect either."""
    if f"{stated.place}.".startswith(NO_EFFECT):
        return True
    return stated.value in PASSED_OVER.get(stated.place, ())


def _flat(section: Section, over: str = "") -> Iterator[Stated]:
    """Yield all values of a section and those in it, by their places."""
    for key, value in section.items():
        place = f"{over}{key}"
        if place in SECTIONS or (value and isinstance(value, Section)):
            yield from _flat(checked_section(value, place), f"{place}.")
        else:
            yield Stated(place, value, section.lines[key])


def _section(at: str) -> str:
    """The part of a place that ends where no row of the tables is below any more."""
    for head in accumulate(at.split("."), "{}.{}".format):
        if head not in SECTIONS:
            return head
    return at


# -- Sides --------------------------------------------------------------------------


def _sides(of_each: Mapping[str, Rows], defaults: Rows) -> dict[Side, str]:
    """Match sides to behaviours: by name, or as a poca, which is the robots'."""
    of_sides: dict[Side, list[str]] = {"robots": [], "fire": []}
    clear = not of_each
    for name, rows in of_each.items():
        trainer = (defaults | rows).get("trainer_type")
        poca = trainer is not None and trainer.value == "poca"
        fire = "fire" in name.lower()
        robot = "robot" in name.lower()
        # FireRobots, or neither word: a group can only be the robots.
        robots = robot if fire != robot else poca
        of_sides["robots" if robots else "fire"].append(name)
        clear |= poca or fire or robot
    if not clear or max(map(len, of_sides.values())) > 1:
        raise SettingsError(
            f"behaviors: who are {some_of(of_each)}? Name the robots' Robot, the "
            "fire's Fire, and leave others out"
        )
    return {side: names[0] for side, names in of_sides.items() if names}


def _rows_of_side(
    side: Side,
    names: Mapping[Side, str],
    of_each: Mapping[str, Rows],
    defaults: Rows,
    ours: Section,
) -> dict[str, Any]:
    """Collect what a file states of a side, by the names of `SideSettings`.

    names: of behaviours;  ours: rows that ML-Agents does not have
    Raises SettingsError for a row that is there by two names.
    """
    # A side that is not named keeps its trainer.
    rows = {n: s.value for n, s in defaults.items() if n != "trainer_type"}
    named: Rows = {}
    if side in names:  # written for ML-Agents, which has that head alone
        named = of_each[names[side]]
        rows = {n: s.value for n, s in (defaults | named).items()} | {"head": "floor"}
    if "learning_rate_schedule" in rows:  # as ML-Agents documents
        both = ("beta_schedule", "epsilon_schedule")
        rows = dict.fromkeys(both, rows["learning_rate_schedule"]) | rows

    one, other = BEHAVIOUR_NAMES[side], side
    if one in ours and other in ours:
        name = f"reference: {one}, or {other},"
        raise twice(name, ours.lines[one], ours.lines[other])
    key = one if one in ours else other
    own = checked_section(ours.get(key), f"reference: {key}")
    for row in own:
        if row in named:
            name = f"{named[row].place} of {one}, here and in reference,"
            raise twice(name, named[row].line, own.lines[row])
    return rows | own
