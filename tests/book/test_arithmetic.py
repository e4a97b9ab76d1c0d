"""The same numbers on every processor, to the last bit.

Run as a program, it plays what the first test compares: `test_arithmetic.py FILE`.
"""

import ast
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import reference
from reference.building import building_of
from reference.fire import RandomFire
from reference.paper import Scenario
from reference.robots import NoRobots
from reference.simulation import Simulation
from reference.workshop.maps import load
from reference.workshop.strategies.guides import Sweep

HALL = """building: Hall
size: 12 x 9
floor 1:
############
#..........#
#..........#
#..........#
#..........E
#..........#
#..........#
#..........#
############
"""
"""Sixty people in 70 square metres, and one exit."""


def played() -> dict[str, np.ndarray]:
    """A dense crowd, and an evacuation of the paper's building: bodies at each tick."""
    crowd = Simulation(building_of(HALL), Scenario(people=60), NoRobots(), seed=1)
    house = Simulation(load("paper"), Scenario(), Sweep(), RandomFire(), seed=1)
    found = {}
    for name, simulation in (("hall", crowd), ("paper", house)):
        bodies = simulation.world.bodies
        places = []
        while not simulation.done:
            simulation.step()
            robots = [robot.position for robot in simulation.world.robots]
            places.append(
                np.concatenate([bodies.position, *np.reshape(robots, (-1, 1, 2))])
            )
        found[f"{name} places"] = np.array(places)
        found[f"{name} health"] = bodies.health
        found[f"{name} events"] = np.array(list(map(repr, simulation.events)))
    return found


def features() -> list[str]:
    """What numpy has found in this processor, beyond what it is built for."""
    return list(np.show_config(mode="dicts")["SIMD Extensions"].get("found", []))


@pytest.mark.paper("A9", "chosen")
def test_a_processor_with_fewer_features_computes_the_same(tmp_path):
    """Every place of every body at every tick, and every event, to the last bit."""
    if not (extra := features()):
        pytest.skip("numpy has found no feature here that could be disabled")
    environment = os.environ | {
        "NPY_DISABLE_CPU_FEATURES": " ".join(extra),
        "GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX2,-FMA",
        "PYTHONPATH": str(Path(reference.__file__).parents[1]),
    }
    path = tmp_path / "played.npz"
    subprocess.run([sys.executable, __file__, path], env=environment, check=True)
    with np.load(path) as without:
        assert not without["features"].size
        for name, expected in played().items():
            assert np.array_equal(without[name], expected), name


UNSAFE = {"exp", "exp2", "log", "log2", "log10", "log1p", "power", "pow", "float_power"}
UNSAFE |= {"sin", "cos", "tan", "arctan2", "atan2", "arccos", "acos"}
UNSAFE |= {"hypot", "dist", "norm", "einsum"}
"""Functions whose last digit IEEE 754 leaves open, or whose order of adding."""

MODULES = """building navigation world rewards fire view humans robots motion walking
simulation game/observations workshop/engine/sees workshop/engine/thinks
workshop/engine/walks workshop/engine/robots workshop/engine/burns
workshop/engine/ticks workshop/engine/tables workshop/strategies/fires
workshop/strategies/guard workshop/strategies/guides workshop/strategies/observed
workshop/strategies/traffic workshop/strategies/worst_case"""


@pytest.mark.parametrize("module", MODULES.split())
def test_nothing_in_a_tick_is_rounded_differently_elsewhere(module):
    """No exp, no hypot, no power of a variable; sorts are stable."""
    path = Path(reference.__file__).parent / f"{module}.py"
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        match node:
            case ast.BinOp(op=ast.Pow(), left=base):
                assert isinstance(base, ast.Constant), node.lineno
            case ast.ImportFrom(module="math" | "numpy", names=names):
                assert not UNSAFE & {name.name for name in names}, node.lineno
            case ast.Attribute(attr=name):
                assert name not in UNSAFE, node.lineno
            case ast.Call(func=ast.Attribute(attr="argsort"), keywords=words):
                assert [word.arg for word in words][-1:] == ["kind"], node.lineno


if __name__ == "__main__":
    np.savez(sys.argv[1], features=np.array(features()), **played())
