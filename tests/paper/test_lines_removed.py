"""Every printed line of Algorithms 1-3 counts: taken out, it is missed.

`CHANGES` takes out one line after the other, or a part of what it asks; at least one of
the tests that are filed under that line must then fail.  Only "end" says nothing that
could be taken out, and lines 2 and 3 of Algorithm 1 are not taken out together: line 11
does the same then.
"""

import inspect
import sys

import pytest
from conftest import ROOT

from reference.humans import Follower, Leader
from reference.robots import RobotAlgorithm
from reference.simulation import Simulation
from reference.workshop.annotated.words import TITLES, keys_named_in

FILES = [
    str(ROOT / "tests" / "paper" / f"test_{k}.py")
    for k in ("b_humans", "c_robots", "b_tick")
]

CHANGES = [
    (Simulation, "Alg. 1:1", "self._leave(i, Fate.EVACUATED)", "pass"),
    (Follower, "Alg. 1:2", "not stuck(me, observe) and ", ""),
    (Follower, "Alg. 1:2", " and me.leader == NOBODY", ""),
    (Follower, "Alg. 1:3", "return switch_mode(me)", "return STAY"),
    (Follower, "Alg. 1:3", "return switch_mode(me)", "switch_mode(me)"),
    (Follower, "Alg. 1:5", "leader_in_sight(me, observe)", "True"),
    (Follower, "Alg. 1:5", "leader_in_sight(me, observe)", "False"),
    (Follower, "Alg. 1:6", "towards_leader(me, observe)", "STAY"),
    (Follower, "Alg. 1:7", "leader_is_robot(me)", "False"),
    (Follower, "Alg. 1:8", "setoff = act_on_instruction(me, observe, setoff)", "pass"),
    (Follower, "Alg. 1:10", "return setoff", "pass"),
    (Follower, "Alg. 1:11", "return disconnect(me, observe)", "return STAY"),
    (Simulation, "Alg. 2:1", "self._leave(i, Fate.EVACUATED)", "pass"),
    (Leader, "Alg. 2:2", "exit_in_view(observe)", "None"),
    (Leader, "Alg. 2:2", "exit_in_view(", "None if observe.robots else exit_in_view("),
    (Leader, "Alg. 2:3", "return go_to(nearest)", "pass"),
    (Leader, "Alg. 2:5", "desired(me, observe)", "None"),
    (Leader, "Alg. 2:6-7", "observe.robots:", "False:"),
    (Leader, "Alg. 2:6-7", "robots:", "robots and not observe.landmarks:"),
    (Leader, "Alg. 2:6", "suitable_leader(me, observe, wanted)", "None"),
    (Leader, "Alg. 2:7", "return follow(me, leader, observe)", "pass"),
    (Leader, "Alg. 2:8-9", "return go_to(wanted)", "pass"),
    (Leader, "Alg. 2:11-12", "not_yet_visited(me, observe)", "None"),
    (Leader, "Alg. 2:13", "fresh is None", "True"),
    (Leader, "Alg. 2:14", "unexplored(me, observe)", "None"),
    (Leader, "Alg. 2:15", "return direction", "pass"),
    (Leader, "Alg. 2:16-17", "return back_to_last_door(me, observe)", "return STAY"),
    (Leader, "Alg. 2:19-20", "return go_to(fresh)", "return STAY"),
    (RobotAlgorithm, "Alg. 3:1", "world.anybody_at_or_above(robot.floor)", "True"),
    (RobotAlgorithm, "Alg. 3:2", "speed_while_leading(robot, world)", "ROBOT_SPEED"),
    (RobotAlgorithm, "Alg. 3:3", "decision is not None", "False"),
    (RobotAlgorithm, "Alg. 3:4", "robot.destination = np.array(target)", "pass"),
    (RobotAlgorithm, "Alg. 3:4", "goal, flame_cost", "robot.place, flame_cost"),
    (RobotAlgorithm, "Alg. 3:5", "robot.says = said_on_the_way", "said_on_the_way"),
    (RobotAlgorithm, "Alg. 3:7", "speed * seconds", "0.0"),
]
"""Class, printed place, its source, and what stands there instead."""


def change(monkeypatch, kind, old, new):
    """Compile a class anew, with a piece of its source replaced."""
    source = inspect.getsource(kind)
    made = {}
    assert source.count(old) == 1, f"not once in {kind.__name__}: {old}"
    exec(source.replace(old, new), vars(sys.modules[kind.__module__]), made)
    for name, method in vars(made[kind.__name__]).items():
        if inspect.isfunction(method):
            monkeypatch.setattr(kind, name, method)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "line", "old", "new"),
    [
        (kind, k, *texts)
        for kind, place, *texts in CHANGES
        for k in keys_named_in(place)
    ],
)
def test_a_line_taken_out_is_missed(kind, line, old, new, monkeypatch):
    """By one of its own tests at least."""
    change(monkeypatch, kind, old, new)
    options = ["-q", "-x", "-p", "no:cacheprovider"]
    ended = pytest.main([*options, "--paper", line, *FILES])
    assert ended == pytest.ExitCode.TESTS_FAILED


def test_every_printed_line_but_end_is_taken_out():
    """And nothing that is not printed."""
    taken = {line for _, place, *_ in CHANGES for line in keys_named_in(place)}
    assert taken == {p for p, text in TITLES.items() if ":" in p and text != "end"}
