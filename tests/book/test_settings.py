"""Tables I and II as settings, the presets, and what is refused."""

import json
from dataclasses import asdict, replace
from functools import partial

import pytest

from reference.paper import TABLE_I, TABLE_II, Scenario
from reference.workshop.storage.records import SettingsError, record_from
from reference.workshop.training.presets import (
    PRESETS,
    ROBOTS_ONLY,
    Settings,
    preset,
    with_rows,
)

ROBOTS = preset("paper").robots
FIRE = preset("paper").fire


def refusal(make, **rows) -> str:
    """What `make` says about rows that cannot be meant."""
    with pytest.raises(SettingsError) as refused:
        make(**rows)
    return str(refused.value)


def change(**rows):
    """Table I with some rows changed."""
    return replace(ROBOTS, **rows)


# -- Presets ------------------------------------------------------------------------


@pytest.mark.paper("E1", "Tab. I")
@pytest.mark.paper("E2", "Tab. II")
def test_the_preset_paper_is_the_two_tables_row_by_row():
    """Nothing is left out, nothing repeated by hand; what is ours is switched off."""
    for settings, table in ((ROBOTS, TABLE_I), (FIRE, TABLE_II)):
        rows = asdict(settings)
        assert (rows.pop("head"), rows.pop("reward_scale")) == ("floor", 0.001)
        assert rows.pop("spread")  # of a mixture
        assert {rows.pop(name) for name in ROBOTS_ONLY} == {0}
        assert rows == dict(table)


def test_what_is_about_robots_is_refused_for_the_fire():
    """It does not walk."""
    settings = preset("tiny")
    for name in ROBOTS_ONLY:
        fire = replace(settings.fire, **{name: getattr(settings.robots, name)})
        with pytest.raises(SettingsError, match=f"fire: {name} is about robots"):
            replace(settings, fire=fire)


@pytest.mark.paper("E1", "E2", "D6")
@pytest.mark.parametrize("name", PRESETS)
def test_every_preset_trains_a_group_against_one_fire(name):
    """MA-POCA against PPO, normalised against not, by the rule of training."""
    settings = preset(name)
    assert settings.preset == name
    assert (settings.robots.trainer_type, settings.fire.trainer_type) == ("poca", "ppo")
    assert (settings.robots.normalize, settings.fire.normalize) == (True, False)
    assert settings.robots.hidden_units <= 256 and settings.scenario.training
    with pytest.raises(SettingsError, match="D6"):
        replace(settings, scenario=Scenario())


def test_a_round_of_tiny_fills_the_buffers():
    """Otherwise whole rounds would end without an update."""
    tiny = preset("tiny")
    floors = 2
    episodes = tiny.episodes_per_job * tiny.jobs_per_round
    decisions = tiny.scenario.time_limit / tiny.scenario.decision_seconds
    robots = tiny.scenario.robots_per_floor * floors
    assert episodes * decisions * robots > tiny.robots.buffer_size
    assert episodes * tiny.scenario.sources > tiny.fire.buffer_size


def test_refuses_a_preset_that_is_not_there():
    """And says which was meant."""
    message = refusal(lambda: preset("labtop"))
    assert "'labtop' is unknown. Did you mean 'laptop'?" in message
    assert "tiny, laptop, any, paper" in message


# -- What rows may be ---------------------------------------------------------------

WRONG = {
    "batch_size": (0, "64", 64.0, True),
    "learning_rate": (0.0, 1.5, -1e-3, float("nan"), "fast", None),
    "learning_rate_schedule": ("cosine", 3),
    "beta": (-0.1, 2),
    "epsilon": (0, float("inf")),
    "normalize": (1, "yes"),
    "max_steps": (0, 1e6),
    "head": ("softmax",),
    "reward_scale": (0, -1.0),
    "jobs_per_round": (0,),
    "random_fires": (1.5,),
}


@pytest.mark.parametrize("name", WRONG)
def test_refuses_a_row_of_a_wrong_type_or_out_of_range_by_its_name(name):
    """Whoever reads the message knows which row to change."""
    base = ROBOTS if hasattr(ROBOTS, name) else preset("tiny")
    for value in WRONG[name]:
        assert refusal(partial(replace, base), **{name: value}).startswith(name)


def test_says_what_a_row_must_be():
    """Kind and range, in words."""
    told = "it must be a whole number from 1 upwards"
    assert refusal(change, num_epoch=0) == f"num_epoch is 0: {told}"
    told = "it must be a number above 0 up to 1"
    assert refusal(change, epsilon=2.0) == f"epsilon is 2.0: {told}"
    assert refusal(change, normalize=1).endswith("it must be true or false")
    told = "it must be a whole number up to 1.84467e+19"
    assert refusal(change, max_steps=10**20) == f"max_steps is {10**20}: {told}"
    assert "Did you mean 'constant'?" in refusal(change, beta_schedule="constnat")


@pytest.mark.paper("E3")
def test_refuses_a_buffer_smaller_than_a_minibatch_and_widths_of_no_attention():
    """An update would have nothing to learn from; only poca has four heads."""
    assert "buffer_size 512" in refusal(change, buffer_size=512)
    assert "4 attention heads" in refusal(change, hidden_units=30)
    assert change(hidden_units=30, trainer_type="ppo").hidden_units == 30


@pytest.mark.paper("E2")
def test_refuses_a_fire_that_learns_as_a_group():
    """There is one; the robots may learn each for themselves."""
    paper = preset("paper")
    fire = replace(FIRE, trainer_type="poca")
    assert "one fire is no group" in refusal(lambda: replace(paper, fire=fire))
    alone = replace(paper, robots=change(trainer_type="ppo"))
    assert alone.robots.trainer_type == "ppo"


# -- As plain numbers and words -----------------------------------------------------

HALL = Scenario(people=3, rooms=("1/hall",), training=True)
UPPER = Scenario(people_per_floor=(0, 5), training=True)


@pytest.mark.parametrize("scenario", [HALL, UPPER])
@pytest.mark.parametrize("name", PRESETS)
def test_settings_survive_as_plain_numbers_and_words(name, scenario):
    """In a checkpoint, where tuples stay, and in JSON, where they become lists."""
    settings = replace(preset(name), scenario=scenario)
    plain = asdict(settings)
    assert record_from(Settings, plain, "task") == settings
    again = json.loads(json.dumps(plain))
    assert record_from(Settings, again, "task") == settings
    assert plain["scenario"]["rooms"] == scenario.rooms


@pytest.mark.parametrize(
    ("rows", "told"),
    [
        ({"fire": {"gamma": 2}}, "settings: fire: gamma is 2"),
        ({"robots": {"gama": 0.9}}, "settings: robots: .* Did you mean 'gamma'"),
        ({"robots": [1]}, "settings: robots: this must be names and values"),
        ({"scenario": {"people": "six"}}, "settings: scenario: people is 'six'"),
    ],
)
def test_refuses_rows_by_where_they_stand(rows, told):
    """Every part says which part it is."""
    with pytest.raises(SettingsError, match=f"^{told}"):
        with_rows(preset("tiny"), rows, "settings")
