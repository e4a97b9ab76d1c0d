"""Trainer files of ML-Agents: brought along, or refused with the place."""

import re
import sys
from dataclasses import replace
from pathlib import Path

import pytest
from conftest import ROOT

from reference.paper import TABLE_I
from reference.workshop.storage.records import SettingsError
from reference.workshop.storage.settings import read_yaml_file
from reference.workshop.training.mlagents import PLACES, with_trainer_file
from reference.workshop.training.presets import preset

yaml = pytest.importorskip("yaml")

UNITY = Path(__file__).parent / "trainers" / "unity.yaml"
LAPTOP = preset("laptop")
ROBOT = "behaviors:\n  Robot:\n"


@pytest.fixture
def read(noted):
    """Reads a text as a trainer file onto preset laptop."""

    def read(text):
        made, _ = noted(text)
        return made

    return read


@pytest.fixture
def noted(tmp_path):
    """Reads a text likewise; returns notes, too."""

    def noted(text):
        (path := tmp_path / "trainer.yaml").write_text(text)
        return with_trainer_file(LAPTOP, read_yaml_file(path), path)

    return noted


@pytest.fixture
def refusal(read, tmp_path):
    """The message about a text, without the path that it begins with."""

    def refusal(text):
        with pytest.raises(SettingsError) as refused:
            read(text)
        path, _, message = str(refused.value).partition("trainer.yaml: ")
        assert path == f"{tmp_path}/"
        return message

    return refusal


# -- Reading ------------------------------------------------------------------------


@pytest.mark.paper("E3")
def test_a_unity_user_can_bring_the_file_of_a_run():
    """Whole, as ML-Agents writes it; what it calls its behaviours does not matter."""
    settings, _ = with_trainer_file(preset("paper"), read_yaml_file(UNITY), UNITY)
    assert settings.robots == replace(
        preset("paper").robots,
        batch_size=2048,
        learning_rate=1e-4,  # which YAML takes for a word
        beta=0.01,
        num_epoch=4,
        learning_rate_schedule="constant",
        hidden_units=512,
        num_layers=2,
        gamma=0.95,
        keep_checkpoints=5,
        checkpoint_interval=500_000,
        max_steps=5_000_000,  # which it wrote as 5.0e6
        time_horizon=128,
        summary_freq=50_000,
    )
    assert settings.fire.buffer_size == 2048
    assert settings.scenario == preset("paper").scenario


@pytest.mark.paper("E5")
def test_the_file_that_ships_changes_the_discount_alone():
    """To the paper's, for robots of preset laptop."""
    file = ROOT / "tutorials" / "experiments" / "discount.yaml"
    settings, _ = with_trainer_file(LAPTOP, read_yaml_file(file), file)
    robots = LAPTOP.robots
    assert settings == replace(LAPTOP, robots=replace(robots, gamma=TABLE_I["gamma"]))
    assert settings != LAPTOP


@pytest.mark.paper("E3")
def test_schedules_follow_the_learning_rate_s_unless_stated(read):
    """As ML-Agents documents its defaults."""
    both = "hyperparameters: {learning_rate_schedule: constant, beta_schedule: linear}"
    robots = read(f"{ROBOT}    {both}").robots
    assert (robots.beta_schedule, robots.epsilon_schedule) == ("linear", "constant")


@pytest.mark.paper("E3")
def test_default_settings_lie_under_both_behaviours_section_by_section(read):
    """A behaviour's own rows win; one that is not there has them as well."""
    settings = read(
        "default_settings:\n  network_settings: {num_layers: 4, hidden_units: 64}\n"
        "behaviors: {Robot: {network_settings: {num_layers: 1}}}"
    )
    assert (settings.robots.num_layers, settings.robots.hidden_units) == (1, 64)
    assert (settings.fire.num_layers, settings.fire.hidden_units) == (4, 64)


@pytest.mark.paper("E1", "Tab. I")
def test_every_row_of_table_i_is_read_from_its_section(read):
    """Where ML-Agents keeps it, and onto any preset."""
    nested = {}
    for place, name in PLACES.items():
        section = nested
        for key in place.split(".")[:-1]:
            section = section.setdefault(key, {})
        section[name] = TABLE_I[name]
    robots = read(yaml.safe_dump({"behaviors": {"Robot": nested}})).robots
    assert {name: getattr(robots, name) for name in TABLE_I} == dict(TABLE_I)


@pytest.mark.parametrize(
    "robots, trainer, fire",
    [
        ("Robot", "ppo", "Fire"),
        ("FireRescueRobot", "poca", "FireGenerator"),
        ("1", "poca", "2"),
        ("Robot", "ppo", "FireNearRobots"),
    ],
)
def test_behaviours_are_known_by_name_or_trainer(noted, robots, trainer, fire):
    """In either order; only a group learns by poca. Who was taken for whom is noted."""
    lines = [
        f"  {robots}: {{trainer_type: {trainer}, max_steps: 11}}",
        f"  {fire}: {{trainer_type: ppo, max_steps: 22}}",
    ]
    for order in (lines, lines[::-1]):
        settings, notes = noted("\n".join(("behaviors:", *order)))
        assert (f"'{robots}' is taken for robots" in "".join(notes)) == (
            robots != "Robot"
        )
        assert (settings.robots.max_steps, settings.fire.max_steps) == (11, 22)
        assert settings.robots.trainer_type == trainer


@pytest.mark.parametrize("names", ["A, B", "A", "Robot1, Robot2", "Robot, Fire, Cat"])
def test_refuses_behaviours_that_show_no_side_and_lists_them(refusal, names):
    """Nothing is guessed."""
    rows = ", ".join(f"{name}: {{max_steps: 5}}" for name in names.split(", "))
    message = refusal(f"behaviors: {{{rows}}}")
    assert f"who are {names}? Name the robots' Robot, the fire's Fire" in message


@pytest.mark.paper("E1", "E2")
def test_one_group_learns_by_poca_and_it_is_the_robots(refusal):
    """A fire called so is no group, whatever its trainer."""
    fire = refusal("behaviors: {Fire: {trainer_type: poca}}")
    assert "trainer_type must be ppo: one fire is no group" in fire


@pytest.mark.paper("E3", "C5")
def test_a_user_s_file_trains_ml_agents_own_head(read):
    """One Gaussian for a side that it names, unless `reference` names another."""
    settings = read(f"{ROBOT}    trainer_type: poca\n")
    assert (settings.robots.head, settings.fire.head) == ("floor", LAPTOP.fire.head)
    own = "reference: {Robot: {head: mixture}}"
    assert read(f"{ROBOT}    trainer_type: poca\n{own}\n").robots.head == "mixture"


# -- Refusing -----------------------------------------------------------------------

REFUSED = {  # what stands under `Robot`: what the message says
    "hyperparameters: {batch_sise: 4}": "Did you mean 'hyperparameters.batch_size'?",
    "network_settings: {memory: {memory_size: 128}}": "Robot: network_settings.memory",
    "network_settings: {vis_encode_type: resnet}": "'resnet' is unknown. There is: s",
    "trainer_type: sac": "'sac' is unknown. There is: poca, ppo",
    "network_settings: {normalise: false}": "Did you mean 'network_settings.normalize'",
    "reward_signals: {curiosity: {strength: 0.02}}": "Robot: reward_signals.curiosity",
    "behavioral_cloning: {demo_path: d}": "built here: Robot: behavioral_cloning.",
    "init_path: results/old": "Robot: init_path",
    "max_steps: 0.5": "robots: max_steps is 0.5: it must be a whole number",
    "hyperparameters: {batch_size: 99999}": "is less than batch_size",
}


@pytest.mark.paper("E3")
@pytest.mark.parametrize("rows", REFUSED)
def test_refuses_by_name_what_cannot_be_meant_or_is_not_built(refusal, rows):
    """With the place, and with what to write or use instead."""
    assert REFUSED[rows] in refusal(f"{ROBOT}    {rows}")


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("behaviours: {}", "Did you mean 'behaviors'?"),
        ("- Robot\n- Fire\n", "the file: this must be"),
        (f"{ROBOT}    a: [1,\n", "no YAML: .* found .<stream end>. at line 4"),
        ("a: !!python/object/apply:os.getcwd []", "line 1: leave out the tag"),
        ("a: &a {x: 1}\nb: {<<: [*a, *a]}\n", "line 2: .a stands for .* Write it out"),
        ("environment_parameters: {height: 3}", "not built here: environment_par"),
    ],
)
def test_refuses_what_is_no_trainer_file(refusal, text, why):
    """In a line, with the place."""
    assert re.search(why, refusal(text))


@pytest.mark.paper("E3")
def test_names_all_sections_that_are_not_built_at_once(refusal):
    """By their own names, and not leaf by leaf: one round mends the file."""
    assert refusal(
        "behaviors:\n"
        "  Robot: {trainer_type: poca, self_play: {window: 10, save_steps: 5}}\n"
        "  Fire:\n"
        "    reward_signals: {gail: {strength: 1, demo_path: d}, rnd: {gamma: 0.9}}\n"
        "    self_play: null\n"
    ) == (
        "unknown, or not built here: Fire: reward_signals.gail; Fire: "
        "reward_signals.rnd; Robot: self_play. Leave it out."
    )


def test_says_what_to_install_where_there_is_no_pyyaml(monkeypatch, refusal):
    """It is an extra: whoever only plays does not need it."""
    monkeypatch.setitem(sys.modules, "yaml", None)
    assert "pip install PyYAML" in refusal(ROBOT)


TWICE = {  # what is there twice, and in which lines
    "behaviors:\n  Robot: {max_steps: 5}\nbehaviors:\n  Fire: {}\n": (
        "behaviors",
        1,
        3,
    ),
    f"{ROBOT}  Fire: {{}}\n  Robot: {{}}\n": ("Robot", 2, 4),
    f"{ROBOT}    max_steps: 5\n    max_steps: 5\n": ("max_steps", 3, 4),
    f"{ROBOT}    hyperparameters: {{beta: 0.1}}\n\n    hyperparameters.beta: 0.1\n": (
        "Robot: hyperparameters.beta",
        3,
        5,
    ),
    "reference:\n  Robot: {head: floor}\n  robots: {spread: 1}\n": (
        "reference: Robot, or robots,",
        2,
        3,
    ),
    "reference:\n  Fire: {max_steps: 5}\nbehaviors:\n  Fire:\n    max_steps: 5\n": (
        "max_steps of Fire, here and in reference,",
        2,
        5,
    ),
    "reference:\n  scenario:\n    people: 5\n    people: 5\n": ("people", 3, 4),
}


@pytest.mark.parametrize("text", TWICE)
def test_refuses_a_row_that_is_there_twice_by_any_of_its_names(refusal, text):
    """At every depth, equal or not, and tells both lines: one of them would be lost."""
    name, one, other = TWICE[text]
    message = f"{name} is there twice, in lines {one} and {other}. Leave one out."
    assert refusal(text) == message


@pytest.mark.parametrize("value", ["null", "{}", "{a: null}", "0", "[]", ""])
@pytest.mark.parametrize("over", ["", "hyperparameters", "network_settings.more"])
def test_no_name_that_is_unknown_is_lost_whatever_its_value(refusal, over, value):
    """A misspelt one would change nothing, in silence."""
    row = f"{over or 'self_pley'}: {{self_pley: {value}}}" if over else ""
    row = row or f"self_pley: {value}"
    assert "unknown, or not built here: Robot: " in refusal(f"{ROBOT}    {row}")
    assert "unknown, or" in refusal(f"behaviurs: {value}")


@pytest.mark.paper("E3")
def test_refuses_what_stands_for_something_though_it_says_nothing(refusal):
    """An empty section is switched on; a row without a value asks for nothing."""
    assert "Robot: self_play" in refusal(f"{ROBOT}    self_play: {{}}")
    assert "line 3: Robot: max_steps has no value" in refusal(f"{ROBOT}    max_steps:")


# -- Options ------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("row", "option"),
    [
        ("checkpoint_settings: {initialize_from: earlier}", "--initialize-from"),
        ("checkpoint_settings: {resume: true}", "--resume"),
        ("checkpoint_settings: {load_model: true}", "--resume"),
        ("checkpoint_settings: {inference: true}", "evaluate"),
    ],
)
def test_refuses_what_would_be_another_training_and_names_the_option(
    refusal, row, option
):
    """What the file asks for, the command line says here."""
    assert re.search(
        f"line 3: .* is not read here.* take {option}", refusal(ROBOT + row)
    )


def test_notes_by_their_names_here_what_the_command_line_says(noted):
    """It changes no weight, or one sees which; what is switched off is not noted."""
    text = "env_settings: {seed: 7, num_envs: 4}\ncheckpoint_settings: {run_id: one}\n"
    settings, notes = noted(text)
    assert settings == LAPTOP
    assert [note.split("trainer.yaml: ")[1] for note in notes] == [
        "checkpoint_settings.run_id is not read; take --out",
        "env_settings.seed is not read; take --seed",
        "env_settings.num_envs is not read; take --workers",
    ]
    _, notes = noted("checkpoint_settings: {initialize_from: null, resume: false}\n")
    assert not notes


def test_notes_that_the_head_is_another_than_the_presets(noted):
    """A file of one line would else change the network without a word."""
    line = "behaviors: {Robot: {max_steps: 5}}\n"
    settings, (note,) = noted(line)
    assert settings.robots.head == "floor"
    assert "robots: head floor" in note
    for head in ("mixture", "floor"):
        settings, notes = noted(f"{line}reference: {{Robot: {{head: {head}}}}}\n")
        assert settings.robots.head == head
        assert not notes


@pytest.mark.parametrize(
    ("section", "key", "meant"),
    [
        ("checkpoint_settings", "initialise_from", "initialize_from"),
        ("env_settings", "num_env", "num_envs"),
        ("engine_settings", "widht", "width"),
        ("torch_settings", "devise", "device"),
    ],
)
def test_refuses_misspelt_names_in_what_is_not_read(refusal, section, key, meant):
    """They are Unity's or the machine's; a slip is a slip."""
    message = refusal(f"{section}: {{{key}: 1}}")
    assert f"Did you mean '{section}.{meant}'?" in message


# -- Sides --------------------------------------------------------------------------


@pytest.mark.paper("E3")
def test_a_trainer_in_the_defaults_tells_who_is_a_group(read):
    """As if it stood in the behaviour; who is not named keeps the preset's."""
    settings = read(
        "default_settings: {trainer_type: poca, max_steps: 7}\n"
        "behaviors: {Helper: {time_horizon: 9}}\n"
    )
    assert (settings.robots.trainer_type, settings.robots.time_horizon) == ("poca", 9)
    assert (settings.fire.trainer_type, settings.fire.max_steps) == ("ppo", 7)


# -- Numbers ------------------------------------------------------------------------


def test_a_whole_number_may_be_written_as_a_real_one_in_every_row(read):
    """As ML-Agents writes 5.0e6: a side's, the rounds', a scenario's, a list's."""
    settings = read(
        "behaviors: {Robot: {max_steps: 5.0e6}}\n"
        "reference: {Fire: {max_steps: 1e+3}, jobs_per_round: 2.0, scenario:\n"
        "  {robots_per_floor: 1.0, people_per_floor: [2.0, 1e1]}}\n"
    )
    assert settings.robots.max_steps == 5_000_000
    assert (settings.fire.max_steps, settings.jobs_per_round) == (1000, 2)
    scenario = settings.scenario
    assert repr((scenario.robots_per_floor, scenario.people_per_floor)) == (
        "(1, (2, 10))"
    )


@pytest.mark.parametrize("place", ["max_steps", "hyperparameters.beta"])
@pytest.mark.parametrize(("word", "why"), [("010", "Write 10"), ("1:30", "Write one")])
def test_refuses_numbers_that_are_read_in_two_ways(refusal, place, word, why):
    """Eight or ten, ninety or a word: with the line."""
    assert re.search(f"line 3: {word} .*{why}", refusal(f"{ROBOT}    {place}: {word}"))
    assert word in refusal(f"reference: {{scenario: {{people: {word}}}}}")


# -- Our own rows -------------------------------------------------------------------


def test_our_own_rows_stand_in_a_block_of_their_own(read, refusal):
    """They are refused by name, too, the scenario's and the rounds' as well."""
    ours = "reference:\n  Robot: {head: floor}\n  scenario: {people: 12}\n"
    scenario = replace(LAPTOP.scenario, people=12)
    robots = replace(LAPTOP.robots, head="floor")
    assert read(ours) == replace(LAPTOP, robots=robots, scenario=scenario)
    assert "Did you mean 'scenario'?" in refusal("reference: {scenarios: {}}")
    assert "Did you mean 'head'?" in refusal("reference: {Robot: {haed: pointer}}")
    assert "scenario: 'peple' is" in refusal("reference: {scenario: {peple: 1}}")
    assert "leave preset out" in refusal("reference: {preset: tiny}")
    assert "people is 'x'" in refusal("reference: {scenario: {people: x}}")
