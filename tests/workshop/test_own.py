"""Strategies of one's own: code from the current folder, policies learned elsewhere."""

import json
import sys
from hashlib import sha256
from itertools import count
from pathlib import Path

import numpy as np
import pytest
from movies import shipped, turns
from refusals import refusal

from reference.__main__ import main
from reference.paper import InputError, Scenario
from reference.simulation import Simulation
from reference.workshop.comparing import design, jobs, report
from reference.workshop.storage.workers import InProcess
from reference.workshop.strategies.guides import Sweep
from reference.workshop.strategies.trained import FlatFire, FlatRobots

CODE = """
from reference.fire import RandomFire
from reference.workshop.strategies.guides import Sweep

class Guide(Sweep):
    pass

class Spark(RandomFire):
    pass

ready = Guide()
idle = 3
"""
MATCH = "evaluate --building tiny --people 4 --workers 0 --episodes 2 --robots sweep"
NUMBERS = count()


@pytest.fixture(autouse=True)
def mine(tmp_path, monkeypatch):
    """The name of a module in the current folder, which Python has not loaded yet."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", ["somewhere", *sys.path])
    Path(f"{(name := f'mine_{next(NUMBERS)}')}.py").write_text(CODE)
    return name


def test_code_of_ones_own_meets_everybody_under_the_name_that_was_typed(mine, capsys):
    """A class, or an object with `decide`; results have digests of the code."""
    words = f"{MATCH} {mine}:Guide {mine}:ready --fire random {mine}:Spark --json"
    assert main(words.split()) == 0
    facts = json.loads(capsys.readouterr().out)
    found = {(cell["robots"], cell["fire"]): cell["reward"] for cell in facts["cells"]}
    both = {(r, f) for r, f in found if ":" in r and ":" in f}
    assert both == {(f"{mine}:{r}", f"{mine}:Spark") for r in ("Guide", "ready")}
    assert {tuple(reward.values()) for reward in found.values()} == {
        tuple(found["sweep", "random"].values())
    }
    own = [f"{mine}:{name}" for name in ("Guide", "ready", "Spark")]
    digest = sha256(CODE.encode()).hexdigest()
    assert all(facts["digests"][word] == {f"{mine}.py": digest} for word in own)
    played = f"evacuate --robots {mine}:Guide --people 2 --building tiny"
    assert main(played.split()) == 0
    assert f"{mine}:Guide" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("command", "status", "hint"),
    [
        ("evacuate --robots nowhere:Guide", 1, "there is no module 'nowhere'"),
        ("evacuate --robots MINE:Guid", 1, "has no 'Guid'"),
        ("evacuate --robots MINE:idle", 1, "robots has decide(world, robots, rng)"),
        ("evaluate --robots MINE:Spark", 1, "robots has decide(world, robots, rng)"),
        ("evaluate --fire MINE:Guide", 1, "the fire has decide(world, rng)"),
        ("train --robots MINE:Guide", 2, "names nobody who plays the robots"),
    ],
)
def test_refuses_code_that_is_not_there_or_cannot_play(
    command, status, hint, mine, capsys
):
    """Before anything is played; a training keeps no code."""
    asked = command.replace("MINE", mine).split()
    found, message = refusal(capsys, *asked)
    assert (found, hint in message, message.count("\n")) == (status, True, 1), message
    assert message.count(asked[-1]) == 1


@pytest.mark.parametrize(
    ("side", "answer"),
    [
        ("robots", "None"),
        ("robots", "[(1.0, 2.0)]"),
        ("robots", "[(float('nan'), 1.0)] * len(asked[1])"),
        ("robots", "['ab'] * len(asked[1])"),
        ("fire", "(0, 1.0)"),
        ("fire", "(float('inf'), 1.0, 1.0)"),
    ],
)
def test_refuses_a_decision_that_is_none(side, answer, mine, capsys):
    """In a line that shows the answer."""
    code = f"class Odd:\n    def decide(self, *asked):\n        return {answer}\n"
    Path(f"{mine}.py").write_text(code)
    played = f"evacuate --building tiny --people 2 --{side} {mine}:Odd"
    found, message = refusal(capsys, *played.split())
    assert (found, message.count("\n")) == (1, 1)
    assert f"{mine}:Odd: decide returned " in message


def test_what_code_itself_raises_is_not_told_as_a_slip_in_its_name(mine):
    """Whoever wrote it wants to see the line."""
    Path(f"{mine}.py").write_text("import no_such_library")
    with pytest.raises(ModuleNotFoundError, match="no_such_library"):
        main(["evacuate", "--robots", f"{mine}:Guide"])


def test_an_evaluation_does_not_go_on_with_code_that_has_changed(mine, capsys):
    """Nor with a module that it imports: one name would stand for two strategies."""
    Path("helper.py").write_text("STEP = 1\n")
    Path(f"{mine}.py").write_text(CODE + "import helper\n")
    match = f"evaluate --building tiny --people 2 --episodes 1 --robots {mine}:Guide"
    assert main(f"{match} --fire none --workers 0 --out out".split()) == 0
    assert main(["evaluate", "--resume", "--workers", "0", "--out", "out"]) == 0
    for file, named in (
        ("helper.py", f"helper.py, which {mine}.py imports, has changed since"),
        (f"{mine}.py", f"{mine}.py has changed since"),
    ):
        before = Path(file).read_text()
        Path(file).write_text(before + "# faster\n")
        capsys.readouterr()
        found, message = refusal(capsys, *["evaluate", "--resume", "--out", "out"])
        assert (found, named in message) == (1, True), message
        Path(file).write_text(before)
    assert main(["evaluate", "--resume", "--workers", "0", "--out", "out"]) == 0


def test_an_experiment_tests_code_and_plays_it_anew_when_it_has_changed(mine):
    """Its page has the name that was typed."""
    rows = f"""
        decisions = 100
        building = "tiny"
        preset = "tiny"
        compare = [["{mine}:Guide", "none"]]
        [arms.learns]
        [test]
        robots = ["none", "{mine}:Guide"]
        fires = ["none", "{mine}:Spark"]
        episodes = 2
    """
    Path("asked.toml").write_text(rows)
    asked = design.read_experiment(Path("asked.toml"))
    found = jobs.play_tests(asked, Path("out"), InProcess())
    results = report.Results(asked, found)
    names = {(cell.robots, cell.fire) for cell in results.cells()}
    assert (f"{mine}:Guide", f"{mine}:Spark") in names and len(names) == 4
    assert f"`{mine}:Guide` less `none` under {mine}:Spark" in results.answer()
    Path(f"{mine}.py").write_text(CODE + "# faster\n")
    anew = jobs.play_tests(asked, Path("out"), InProcess())
    assert len(anew) == len(found)
    assert len([*Path("out").glob("tests-*/runs.csv")]) == 2
    Path("asked.toml").write_text(rows.replace("Guide", "Gide"))
    with pytest.raises(InputError, match="has no 'Gide'"):
        design.read_experiment(Path("asked.toml"))


# -- Policies that learned elsewhere ------------------------------------------------

SCENE = Scenario(people=6, time_limit=90.0)


def nearest(seen):
    """Robots go to the person nearest to them, or where nobody is left, to a corner."""
    return np.where(seen[:, 2:3] > -1, seen[:, :2], 1.0)


@pytest.mark.extra
@pytest.mark.parametrize("side", ["robots", "fire"])
def test_a_policy_on_flat_observations_plays_as_it_does_in_the_environment(side):
    """From the same seed, to the same end; robots that have left see zeros in both."""
    zoo = pytest.importorskip("reference.workshop.zoo")
    seen = []
    asked = []

    def policy(observed):
        """Remember what is observed; the fire goes to the ground floor."""
        asked.append(observed)
        places = nearest(observed)
        return places if side == "robots" else np.insert(places, 0, -1, axis=1)

    other = {"fire": "random"} if side == "robots" else {"robots": "sweep"}
    environment = zoo.parallel_env("tiny", SCENE, flat=True, **other)
    observed, _ = environment.reset(seed=4)
    for _ in turns(environment.environment):
        rows = np.stack([observed[agent] for agent in environment.agents])
        seen.append(rows)
        chosen = dict(zip(environment.agents, policy(rows), strict=True))
        observed, *_ = environment.step(chosen)
    expected = environment.environment.simulation
    asked.clear()
    if side == "robots":
        guide = FlatRobots(policy, "tiny", SCENE)
        fire = expected.fire_strategy
    else:
        guide = Sweep()
        fire = FlatFire(policy, "tiny", SCENE)
    ours = Simulation(shipped("tiny"), SCENE, guide, fire, seed=4)
    assert ours.run() == expected.outcome()
    assert ours.events == expected.events
    assert all(any(np.array_equal(a, b) for b in seen) for a in asked)


def test_a_policy_brings_the_building_and_scenario_that_it_has_learned_in(mine, capsys):
    """As a checkpoint does; elsewhere it is refused."""
    Path(f"{mine}.py").write_text(
        "from reference.paper import Scenario\n"
        "from reference.workshop.strategies.trained import FlatRobots\n"
        "scene = Scenario(people=5, robots_per_floor=1)\n"
        "guide = FlatRobots(lambda seen: seen[:, :2], 'tiny', scene)\n"
    )
    match = ["evacuate", "--robots", f"{mine}:guide", "--json"]
    assert main(match) == 0
    facts = json.loads(capsys.readouterr().out)
    assert (facts["building"], facts["people"]) == ("tiny", 5)
    status, message = refusal(capsys, *match, "--building", "museum")
    assert (status, "it has learned in Tiny office" in message) == (1, True)
    status, message = refusal(capsys, *match, "--people", "6")
    assert (status, "its robots learned with people=5" in message) == (1, True)
    status, message = refusal(capsys, *match, "--sample")
    assert (status, "--sample goes with a checkpoint" in message) == (2, True)


@pytest.mark.parametrize(
    ("command", "hint"),
    [
        ("evacuate --robots plain", "write plain:Guide\n"),
        ("evacuate --robots plain.py", "write plain:Guide\n"),
        ("evaluate --fire plain", "write plain:Spark\n"),
        ("evaluate --fire empty", "write empty:NAME\n"),
        ("evaluate --fire broken", "write broken:NAME\n"),
    ],
)
def test_a_file_of_code_is_told_how_it_is_named(command, hint, tmp_path, capsys):
    """With the class in it that plays this side, if one can be found."""
    (tmp_path / "plain.py").write_text(
        "class Guide:\n    def decide(self, world, robots, rng): ...\n"
        "class Spark:\n    def decide(self, world, rng): ...\n"
    )
    (tmp_path / "empty.py").write_text("")
    (tmp_path / "broken.py").write_text("class Guide(:")
    found, message = refusal(capsys, *command.split())
    assert (found, message.count("\n")) == (2, 1)
    assert message.endswith(hint)
