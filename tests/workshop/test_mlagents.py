"""Trainer files of ML-Agents: brought along, or refused with the place."""

import re
import sys
from dataclasses import replace
from pathlib import Path

import pytest
from conftest import ROOT

from reference.paper import TABLE_I
from reference.workshop.storage.records import SettingsError
from reference.workshop.training.mlagents import PLACES, read_yaml
from reference.workshop.training.presets import preset

yaml = pytest.importorskip("yaml")

UNITY = Path(__file__).parent / "trainers" / "unity.yaml"
LAPTOP = preset("laptop")
ROBOT = "behaviors:\n  Robot:\n"


@pytest.fixture
def read(tmp_path):
    """Reads a text as a trainer file onto preset laptop."""

    def read(text):
        (path := tmp_path / "trainer.yaml").write_text(text)
        return read_yaml(path, LAPTOP)

    return read


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
    settings = read_yaml(UNITY, preset("paper"))
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
    settings = read_yaml(file, LAPTOP)
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
def test_behaviours_are_known_by_name_or_trainer(read, robots, trainer, fire, capsys):
    """In either order; only a group learns by poca. Who was taken for whom is noted."""
    lines = [
        f"  {robots}: {{trainer_type: {trainer}, max_steps: 11}}",
        f"  {fire}: {{trainer_type: ppo, max_steps: 22}}",
    ]
    for order in (lines, lines[::-1]):
        settings = read("\n".join(("behaviors:", *order)))
        noted = capsys.readouterr().err
        assert f"'{robots}' is taken for robots" in noted
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
        ("a: !!python/object/apply:os.getcwd []", "no YAML: could not determine"),
        ("a: &a {x: 1}\nb: {<<: [*a, *a]}\n", "write out what .aliases stand for"),
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
