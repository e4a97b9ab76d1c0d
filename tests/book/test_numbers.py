"""Numbers of `paper` that change at run time are heard by the next simulation."""

import json
import os
import sys
from subprocess import PIPE, Popen

import pytest
from changing import what_happens
from conftest import ROOT

from reference import paper

CHANGED = {
    "FLIGHT": 9.0,
    "STAIRS_SPEED": 1.2,
    "LOOK_AHEAD_METRES": 1,
    "DOOR_FLOW": 0.3,
    "PEOPLE": 12,
    "HEALTH": 30.0,
    "HEALTH_RATE": 0.02,
    "FRAMES_PER_TICK": 5,
    "SIGHT_RANGE": 2.0,
    "RAYS": 90,
    "PATCH_METRES": 1,
    "DIM_METRES": 0.0,
    "WALKING_SPEED": 1.0,
    "BODY_RADIUS": 0.15,
    "RECONSIDER_TICKS": 5,
    "ROBOTS_PER_FLOOR": 1,
    "ROBOT_SPEED": 0.5,
    "DECISION_SECONDS": 8.0,
    "FIRE_SOURCES": 1,
    "FIRE_FIRST_DECISION": 0,
    "PROTECTED_METRES": 2.0,
    "SPREAD_RATE": 0.3,
    "BURN_SECONDS": 12.0,
    "FLAME_SECONDS": 3.0,
    "FIXED_PENALTY": 1000.0,
    "FIXED_REWARD": 7.0,
}
"""Other values; each of them alone changes what happens."""


@pytest.fixture(scope="module")
def before():
    """What happens first, under the numbers as they are."""
    return what_happens()


@pytest.fixture(scope="module")
def always():
    """A function: what happens where a number was another before anything was built."""
    command = [sys.executable, str(ROOT / "tests" / "changing.py")]
    env = os.environ | {"PYTHONPATH": str(ROOT)}
    with Popen(command, env=env, text=True, stdin=PIPE, stdout=PIPE) as process:

        def happens(number):
            asked = json.dumps([number, CHANGED[number]])
            print(asked, file=process.stdin, flush=True)
            return process.stdout.readline().strip()

        yield happens


@pytest.mark.parametrize("number", CHANGED)
def test_a_number_changed_at_run_time_is_heard_by_the_next_run(
    number, before, always, monkeypatch
):
    """As if it had always been so: nothing kept from the first run is used again."""
    monkeypatch.setattr(paper, number, CHANGED[number])
    assert before != always(number) == what_happens()
