"""The numbers: as printed where the appendix states them, else recomputed."""

from math import inf, nan

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from reference import paper
from reference.paper import InputError, Scenario

TABLES = """
trainer type            poca      ppo
batch size              1024      1024
buffer size             20480     10240
learning rate           0.0001    0.0003
learning rate schedule  linear    linear
beta                    0.005     0.005
beta schedule           constant  constant
epsilon                 0.2       0.2
epsilon schedule        linear    linear
lambd                   0.95      0.95
num epoch               3         3
vis encode type         simple    simple
normalize               true      false
hidden units            256       256
num layers              3         3
gamma                   0.90      0.99
strength                1.0       1.0
keep checkpoints        100       80
checkpoint interval     1000      500
max steps               10000000  500000
time horizon            64        64
summary freq            1000      500
"""
"""Tables I and II: the name of a row, what the robots have, what the fire has."""


def printed(column):
    """Name and value, as texts, of each row of a printed table."""
    for row in TABLES.strip().splitlines():
        *name, robots, fire = row.split()
        yield "_".join(name), (robots, fire)[column]


def agrees(value, printed):
    """Does a number, word or truth value stand there as printed?"""
    if isinstance(value, bool | str):
        return str(value).lower() == printed
    return value == float(printed)


@pytest.mark.paper("E1", "Tab. I")
@pytest.mark.paper("E2", "Tab. II")
@pytest.mark.paper("E4", "E5")
@pytest.mark.parametrize(
    ("column", "ours"), [(0, paper.TABLE_I), (1, paper.TABLE_II)], ids=["I", "II"]
)
def test_the_tables_are_complete_and_as_printed(column, ours):
    """Both trainers, every row."""
    rows = dict(printed(column))
    assert set(ours) == set(rows)
    assert all(agrees(ours[name], value) for name, value in rows.items())


def test_the_tables_cannot_be_changed_by_accident():
    """They are what is printed; settings are copies."""
    with pytest.raises(TypeError):
        paper.TABLE_I["gamma"] = 0.5


# -- Derived numbers ----------------------------------------------------------------


@pytest.mark.paper("B7", "F8")
def test_fifty_frames_a_second_and_reward_100_reproduce_equation_7():
    """15000 / 40 = 3 (100 - loss) + 100: 8.33 health, 16.7 s, 22 to 25 m of walking."""
    loss = paper.HEALTH - (15000 / paper.PEOPLE - paper.FIXED_REWARD) / 3
    seconds = loss / (paper.FRAMES_PER_SECOND * paper.HEALTH_RATE)
    assert (loss, seconds) == pytest.approx((8.33, 16.7), abs=0.05)
    assert 21.5 < seconds * paper.WALKING_SPEED < 25


# -- Scenario -----------------------------------------------------------------------


@pytest.mark.paper("B8")
@pytest.mark.paper("C2", "chosen")
def test_the_scenario_of_the_paper_is_the_default():
    """Forty people, six robots, eight sources."""
    scenario = Scenario()
    robots = scenario.robots_per_floor * paper.FLOORS
    assert (scenario.people, robots, scenario.sources) == (40, 6, 8)


@given(st.integers(0, 1000), st.integers(1, 30))
def test_people_are_spread_evenly_over_the_floors(people, floors):
    """Everybody has a floor, and no floor has two more than another."""
    counts = Scenario(people=people).start_counts(floors)
    assert (len(counts), sum(counts)) == (floors, people)
    assert max(counts) - min(counts) <= 1


def test_people_can_be_counted_floor_by_floor():
    """Lowest floor first, instead of `people`."""
    scenario = Scenario(people_per_floor=[0, 2, 5])
    assert scenario.start_counts(3) == (0, 2, 5)
    assert hash(scenario)  # what is drawn once for a scenario is looked up by it


def test_decisions_are_whole_ticks_apart():
    """What asks for other moments gets the nearest."""
    assert Scenario(decision_seconds=0.5).decision_seconds == pytest.approx(0.4)
    assert Scenario(frames_per_tick=7).decision_seconds == pytest.approx(36 * 0.14)


def test_refuses_a_scenario_for_another_number_of_floors():
    """With both numbers."""
    with pytest.raises(ValueError, match="people_per_floor: 2, of the building: 3"):
        Scenario(people_per_floor=(1, 2)).start_counts(3)


SECONDS_AND_METRES = (
    "time_limit",
    "sight_range",
    "spread_rate",
    "burn_seconds",
    "decision_seconds",
)


@pytest.mark.parametrize(
    "wrong",
    [
        {"people": -1},
        {"people": 2.5},
        {"people_per_floor": (3, -1)},
        {"robots_per_floor": -1},
        {"sources": -1},
        {"time_limit": 0},
        {"sight_range": 0.5},
        {"frames_per_tick": 0},
        {"frames_per_tick": 26},
        {"rooms": ("1/hall",), "people_per_floor": (1, 0, 0)},
        {"decision_seconds": 0.1},
        {"decision_seconds": inf},
        {"sight_range": "far"},
        {"people": True},
        {"spread_rate": 0},
        {"spread_rate": -0.06},
        {"burn_seconds": 0.5},
        {"burn_seconds": "long"},
        *({name: nan} for name in SECONDS_AND_METRES),
        *({name: inf} for name in SECONDS_AND_METRES),
    ],
    ids=lambda wrong: next(iter(wrong)),
)
def test_refuses_numbers_that_make_no_sense(wrong):
    """Before anything is built from them."""
    with pytest.raises(InputError):
        Scenario(**wrong)


def test_says_which_number_makes_no_sense_and_what_would():
    """By the field's name, with range and unit."""
    flames = "ignitions per second and border of cells"
    told = f"spread_rate is 0: it must be a number from 0.001 to 100 {flames}"
    with pytest.raises(InputError, match=f"^{told}$"):
        Scenario(spread_rate=0)
    told = "one of people_per_floor is -1: it must be a whole number from 0 to 10,000"
    with pytest.raises(InputError, match=told):
        Scenario(people_per_floor=(3, -1))


@pytest.mark.parametrize("room", ["1/hall", ""])
def test_refuses_a_word_where_a_list_of_rooms_is_needed(room):
    """Else each letter would be a room."""
    told = f"^rooms is '{room}': give a list, \\['{room}'\\]$"
    with pytest.raises(InputError, match=told):
        Scenario(rooms=room)
    assert Scenario(rooms=[room]).rooms == (room,)


@pytest.mark.parametrize(
    ("wrong", "told"),
    [
        ({"rooms": 5}, r"rooms is 5: give a list, \[5\]"),
        ({"rooms": None}, r"rooms is None: give a list, \[\]"),
        ({"rooms": [["1/hall"]]}, r"one of rooms is \['1/hall'\]: it must be an id"),
        ({"people_per_floor": 5}, r"people_per_floor is 5: give a list, \[5\]"),
        ({"training": "no"}, "training is 'no': give True or False"),
    ],
)
def test_refuses_what_is_no_list_and_what_is_neither_true_nor_false(wrong, told):
    """The word "no" would count as true."""
    with pytest.raises(InputError, match=told):
        Scenario(**wrong)


def test_takes_numbers_and_arrays_of_numpy_as_plain_ones():
    """Sums of its small integers would overflow."""
    counts = np.array([200, 100], np.uint8)
    for floors in (counts, tuple(counts)):
        scenario = Scenario(people=300, people_per_floor=floors)
        assert scenario.people_per_floor == (200, 100)
        assert {type(count) for count in scenario.people_per_floor} == {int}
    scenario = Scenario(people=np.uint8(200), sight_range=np.float32(4))
    assert type(scenario.people) is int and type(scenario.sight_range) is float
    assert Scenario(rooms=np.array(["1/hall"])).rooms == ("1/hall",)


def test_refuses_two_counts_of_people_that_differ():
    """The default of `people` was not asked for."""
    with pytest.raises(InputError, match="people is 7, people_per_floor comes to 5"):
        Scenario(people=7, people_per_floor=(3, 2))
    assert Scenario(people=5, people_per_floor=(3, 2)).start_counts(2) == (3, 2)
    assert Scenario(people_per_floor=(3, 2)).start_counts(2) == (3, 2)


def test_limits_of_a_scenario_follow_the_numbers(monkeypatch):
    """They, too, are read when a scenario is made."""
    monkeypatch.setattr(paper, "MOST_FRAMES_PER_TICK", 12)
    with pytest.raises(InputError, match=r"frames_per_tick is 20: .* from 1 to 12 "):
        Scenario(frames_per_tick=20)


@pytest.mark.paper("F8")
def test_a_tick_is_a_whole_number_of_frames():
    """Ten frames of 1/50 s cost 0.1 health."""
    scenario = Scenario()
    frames = scenario.tick * paper.FRAMES_PER_SECOND
    assert frames == pytest.approx(scenario.frames_per_tick) == paper.FRAMES_PER_TICK
