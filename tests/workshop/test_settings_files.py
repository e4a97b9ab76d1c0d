"""Settings files of either kind, before anybody asks what their rows mean."""

import time
import tomllib

import pytest
from hypothesis import given
from hypothesis import strategies as some
from refusals import refusal

from reference.workshop.comparing.design import read_experiment
from reference.workshop.storage.records import SettingsError
from reference.workshop.storage.settings import (
    LARGEST_SETTINGS,
    number_or_word,
    read_toml_file,
    read_yaml_file,
)
from reference.workshop.storage.words import did_you_mean

READERS = {"yaml": read_yaml_file, "toml": read_toml_file}


@pytest.fixture
def read(tmp_path):
    """Reads a text as a file of this kind."""

    def read(kind, text):
        if kind == "yaml":
            pytest.importorskip("yaml")
        (path := tmp_path / f"settings.{kind}").write_text(text)
        return READERS[kind](path)

    return read


# -- Numbers ------------------------------------------------------------------------

DIGITS = "0123456789_.:xobeE+-"


@given(some.text(DIGITS, min_size=1, max_size=7))
def test_a_word_is_the_number_that_toml_reads_or_none(word):
    """Two readers of one number would make two trainings of one file."""
    try:
        there = tomllib.loads(f"row = {word}")["row"]
    except ValueError:
        return
    if isinstance(there, int | float):
        assert number_or_word(word) == there


@pytest.mark.parametrize(
    "word", ["010", "-007", "00", "0_1", "1:30", "-1:30:00", "1:2.5"]
)
def test_refuses_a_word_that_readers_of_yaml_read_in_two_ways(word):
    """TOML refuses it as well."""
    with pytest.raises(SettingsError, match=word):
        number_or_word(word)
    with pytest.raises(ValueError):
        tomllib.loads(f"row = {word}")


def test_scenarios_in_words_read_numbers_as_files_do(capsys):
    """Whole ones too, where they are written as real ones; 010 is refused."""
    for word in ("people=010", "time_limit=1:30"):
        status, message = refusal(capsys, "evacuate", "--scenario", word)
        assert (status, "Write " in message) == (2, True)


def test_yaml_is_words_numbers_switches_and_nothing(read):
    """Quotes make a word of anything; a name is a word, whatever it looks like."""
    text = "{1: 1.0e6, on: yes, '2': '010', 3: ~, x: [1_000, .5, 0x10, 2026-01-01]}"
    assert read("yaml", text) == {
        "1": 1e6,
        "on": True,
        "2": "010",
        "3": None,
        "x": [1000, 0.5, 16, "2026-01-01"],
    }


# -- Files that eat the machine -----------------------------------------------------


@pytest.mark.parametrize("kind", READERS)
def test_a_large_file_is_refused_before_any_reader_sees_it(read, kind):
    """A comment alone would harm nobody: size counts."""
    comment = "#" * LARGEST_SETTINGS
    assert read(kind, comment[1:] + "\n") in (None, {})
    with pytest.raises(ValueError, match="has more than 65,536 bytes"):
        read(kind, comment + "\n")


@pytest.mark.parametrize(
    ("kind", "part"),
    [
        ("yaml", "["),
        ("yaml", "{"),
        ("yaml", "{a: "),
        ("yaml", "? "),
        ("yaml", "- "),
        ("toml", "a."),
        ("toml", "[a."),
        ("toml", "a=["),
        ("toml", "a={a="),
        ("toml", "a=[{a.a.a="),
    ],
)
def test_no_file_keeps_its_reader_busy(read, kind, part):
    """Nesting and long keys cost a square of their length, or a reader's stack."""
    begun = time.process_time()
    with pytest.raises(ValueError, match=r"levels|points|no TOML|no YAML"):
        read(kind, part * ((LARGEST_SETTINGS - 1) // len(part)))
    assert time.process_time() - begun < 10


def test_messages_name_ten_and_a_count(tmp_path):
    """Also of what an experiment knows."""
    (path := tmp_path / "many.toml").write_text(
        "decisions = 500\ncompare = [['a', 'b']]\n"
        + "".join(f"[arms.arm{k}]\n" for k in range(3000))
    )
    with pytest.raises(SettingsError, match=r"and 2,\d\d\d more") as refused:
        read_experiment(path)
    assert len(str(refused.value)) < 1000


# -- Did you mean -------------------------------------------------------------------

KNOWN = ("hyperparameters.beta", "hyperparameters.batch_size", "max_steps", "observer")


@pytest.mark.parametrize(
    ("name", "meant"),
    [
        ("hyperparameters.batch_sise", "hyperparameters.batch_size"),
        ("beta", "hyperparameters.beta"),
        ("network_settings.betta", "hyperparameters.beta"),
        ("Max_Step", "max_steps"),
        ("obsever", "observer"),
        ("obstacle", "observer"),  # which begins alike
        ("hyperparameters.memory", None),
        ("hyperparameters.curiosity", None),
        ("people", None),
        ("steps_to_go", None),
        ("x" * 10**6, None),
    ],
)
def test_suggests_what_is_alike_and_nothing_else(name, meant):
    """Two names in one section are not alike for that."""
    told = did_you_mean(name, KNOWN)
    assert told == (f" Did you mean '{meant}'?" if meant else "")
