"""Strategies of one's own: code from the current folder, policies learned elsewhere."""

import json
import pickle
import sys
from copy import copy
from hashlib import sha256
from itertools import count
from pathlib import Path

import numpy as np
import pytest
from movies import shipped, turns
from refusals import refusal
from trainings import Stopped

from reference import load, paper
from reference.__main__ import main
from reference.building import Building
from reference.paper import InputError, Scenario
from reference.simulation import Simulation
from reference.workshop.comparing import design, jobs, matches, report, runs
from reference.workshop.storage.workers import InProcess
from reference.workshop.strategies.guides import Sweep
from reference.workshop.strategies.own import from_code
from reference.workshop.strategies.trained import FlatFire, FlatRobots
from reference.workshop.strategies.untouched import untouched

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
        ("evacuate --robots MINE:Guid", 1, "has no 'Guid'. Did you mean 'Guide'?"),
        (
            "evacuate --robots MINE:idle",
            1,
            "robots has decide(self, world, robots, ",
        ),
        (
            "evaluate --robots MINE:Spark",
            1,
            "robots has decide(self, world, robots, ",
        ),
        ("evaluate --fire MINE:Guide", 1, "the fire has decide(self, world, rng)"),
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
        ("robots", "__import__('numpy').zeros((4, 3))"),
        ("robots", "__import__('numpy').ma.masked_all((4, 2))"),
        ("robots", "[(__import__('numpy').complex128(1), 1.0)] * len(asked[1])"),
        ("robots", "[(1.0, 2e6)] * len(asked[1])"),
        ("robots", "[(1.0, -(10**400))] * len(asked[1])"),
        ("fire", "(0, 1.0)"),
        ("fire", "(float('inf'), 1.0, 1.0)"),
        ("fire", "(0, 1e300, 1.0)"),
        ("fire", "(None, 1.0, 1.0)"),
        ("fire", "__import__('numpy').array(3.0)"),
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
    assert (side == "fire") or message.endswith(
        "for each of the robots at work, 4 now.\n"
    )


@pytest.mark.parametrize(
    ("place", "noted"),
    [("0, 1000.0, 1000.0", 1), ("0, *world.building.metres(0, 0)", 1), (None, 0)],
)
def test_a_fire_that_can_start_nowhere_near_is_told_of_once(place, noted, mine, capsys):
    """Outside or in a wall: another cell burns instead [D6]."""
    free = "fire.decision_at(world, fire.free_places(world).argmax())"
    code = f"""from reference import fire
class Off:
    def decide(self, world, rng):
        return {place or free}
"""
    Path(f"{mine}.py").write_text(code)
    played = f"evacuate --building tiny --people 4 --fire {mine}:Off"
    assert main(played.split()) == 0
    told = capsys.readouterr().err
    assert told.count(f"{mine}:Off decided floor 0") == noted
    assert ("where no fire may start" in told) == bool(noted)


def test_a_slip_in_the_syntax_is_shown_where_it_is(mine, capsys):
    """The file, the line and a caret, without the way that led there."""
    Path(f"{mine}.py").write_text("class Guide:\n    def decide(self:\n")
    words = f"evacuate --building tiny --robots {mine}:Guide"
    status, message = refusal(capsys, *words.split())
    lines = message.splitlines()
    assert (status, lines[0]) == (1, f"{mine}:Guide: its module is no Python.")
    assert lines[1].endswith(f'{mine}.py", line 2')
    assert lines[2].strip() == "def decide(self:"
    assert lines[3].strip() == "^"
    assert len(lines) == 5


def test_a_file_that_code_itself_misses_is_told_with_its_line(mine):
    """Not as one that the command misses."""
    write(mine, "open('nowhere/at-all')")
    with pytest.raises(RuntimeError, match=f"{mine}:Odd: decide raised") as raised:
        main(f"{MATCH} {mine}:Odd".split())
    assert isinstance(raised.value.__cause__, FileNotFoundError)


ANSWERS_LATE = """
class Number:
    def __init__(self, act):
        self.act = act
    def __float__(self):
        self.act()
        return 1.0
class Place(Number):
    def __iter__(self):
        yield self.act() or 1.0
        yield 1.0
class Odd:
    def decide(self, world, robots, rng):
        def act(*robot):
            return DO
        ANSWER
"""
LATE = {
    "yielded": "yield from map(act, robots)",
    "mapped": "return map(act, robots)",
    "a place of its own": "return [Place(act) for _ in robots]",
    "a number of its own": "return [(Number(act), 1.0) for _ in robots]",
}


@pytest.fixture(params=LATE)
def late(request, mine):
    """Write code that does something when its answer is read; make the strategy."""

    def writing(do):
        code = ANSWERS_LATE.replace("DO", do).replace("ANSWER", LATE[request.param])
        Path(f"{mine}.py").write_text(code)
        return from_code(f"{mine}:Odd", "robots")

    return writing


def first_tick(robots=None, fire=None):
    """Play a tick, in which both sides decide."""
    world = Simulation(shipped("tiny"), Scenario(people=2), robots, fire)
    world.step()
    return world


def test_an_answer_that_is_read_late_is_code_of_ones_own_too(late, capsys):
    """What it prints goes to stderr; what it changes and what it ends is refused."""
    first_tick(late("print('me')"))
    told = capsys.readouterr()
    assert (told.out, told.err) == ("", "me\n" * 4)
    with pytest.raises(InputError, match=r"changes world\.bodies\.health"):
        first_tick(late("world.bodies.health.fill(7)"))
    with pytest.raises(InputError, match=r"ends the program by SystemExit\(0\)"):
        first_tick(late("exit(0)"))


@pytest.mark.parametrize("kind", [KeyError, TypeError, ValueError])
def test_what_an_answer_raises_when_it_is_read_is_told_with_its_time(kind, late):
    """It is a slip in the code, not a decision that is none."""
    with pytest.raises(kind) as raised:
        first_tick(late(f"exec('raise {kind.__name__}')"))
    assert "Odd: decide raised this after 0 s" in raised.value.__notes__[0]


@pytest.mark.parametrize(
    "answer",
    [
        "iter(int, 1)",
        "map(iter, [int] * 9, [1] * 9)",
        "[iter(lambda: 1.0, 2)] * len(asked[1])",
    ],
)
def test_refuses_an_answer_without_end(answer, mine):
    """One item too many is enough to see it."""
    write(mine, f"return {answer}")
    with pytest.raises(InputError, match=f"{mine}:Odd: decide "):
        first_tick(from_code(f"{mine}:Odd", "robots"))


def test_a_late_answer_that_is_no_decision_is_shown_as_it_was_read(mine):
    """Its place in memory would tell nothing."""
    write(mine, "return map(lambda robot: (1, 2, 3), asked[1])")
    told = r"decide returned \[\[1.0, 2.0, 3.0\], \[1.0"
    with pytest.raises(InputError, match=told):
        first_tick(from_code(f"{mine}:Odd", "robots"))


def test_a_list_that_code_is_given_is_its_own(mine):
    """It may take out of it whom it has sent somewhere."""
    write(mine, "return [(1.0, 1.0) for _ in range(4) if asked[1].pop()]")
    world = first_tick(from_code(f"{mine}:Odd", "robots")).world
    assert [robot.destination.tolist() for robot in world.robots] == [[1.0, 1.0]] * 4


def test_a_decision_is_plain_numbers_whatever_it_was_written_in(mine):
    """Arrays, also of single places and numbers; what is masked is no number."""
    write(mine, "import numpy as np; return [None, np.ones(2), (np.float32(2), 3)]")
    world = first_tick().world
    strategy = from_code(f"{mine}:Odd", "robots")
    found = strategy.decide(world, [None] * 3, None)
    assert found == [None, (1.0, 1.0), (2.0, 3.0)]
    assert {type(x) for place in found[1:] for x in place} == {float}
    write(mine, "import numpy as np; return np.array([1, 2, 3])")
    found = from_code(f"{mine}:Odd", "fire").decide(world, None)
    assert found == (1, 2.0, 3.0)
    assert [type(x) for x in found] == [int, float, float]


def test_what_code_itself_raises_is_not_told_as_a_slip_in_its_name(mine):
    """Whoever wrote it wants to see the line."""
    Path(f"{mine}.py").write_text("import no_such_library")
    with pytest.raises(ModuleNotFoundError, match="no_such_library"):
        main(["evacuate", "--robots", f"{mine}:Guide"])


@pytest.mark.parametrize("workers", ["0", "2"])
def test_what_code_itself_raises_is_told_with_its_time(workers, mine):
    """By a worker, too."""
    write(mine, "return [None] * len(asked[1]) if asked[0].time < 7 else 1 / 0")
    match = f"{MATCH} {mine}:Odd".replace("--workers 0", f"--workers {workers}")
    with pytest.raises(ZeroDivisionError) as raised:
        main(match.split())
    assert f"{mine}:Odd: decide raised this after 10 s" in raised.value.__notes__


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


def test_code_is_known_by_its_runs_though_others_are_asked_for_meanwhile(mine):
    """What a folder has of it is not taken for what it became since."""

    def asked(robots):
        return matches.begin_evaluation(
            (robots,), ("none",), "tiny", people=2, episodes=1
        )

    def play(robots, jobs):
        return runs.play_evaluation(asked(robots), Path("out"), Stopped(jobs))

    before = play(f"{mine}:Guide", jobs=1)
    with pytest.raises(KeyboardInterrupt):
        play("none", jobs=0)
    assert play(f"{mine}:Guide", jobs=0) == before
    with pytest.raises(KeyboardInterrupt):
        play("none", jobs=0)
    Path(f"{mine}.py").write_text(CODE + "# faster\n")
    with pytest.raises(InputError, match=f"{mine}.py has changed since"):
        play(f"{mine}:Guide", jobs=1)


def test_code_that_raised_may_be_mended_before_an_evaluation_goes_on(mine):
    """It has no runs yet; those of others stay."""
    raises = "    def decide(self, *asked):\n        raise KeyError(asked)\n"
    Path(f"{mine}.py").write_text(f"class Guide:\n{raises}")
    asked = (
        f"evaluate --building tiny --people 2 --episodes 1 --robots none {mine}:Guide"
    )
    with pytest.raises(KeyError):
        main(f"{asked} --fire none --workers 0 --out out".split())
    before = Path("out/runs.csv").read_text()
    Path(f"{mine}.py").write_text(CODE)
    assert main(["evaluate", "--resume", "--workers", "0", "--out", "out"]) == 0
    after = Path("out/runs.csv").read_text()
    assert after.startswith(before) and len(after) > len(before)


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
    scene = Scenario(people=6)  # so long that robots leave an empty floor
    seen = []
    asked = []

    def policy(observed):
        """Robots go east, until one has left; the fire goes to the ground floor."""
        asked.append(observed)
        if side == "fire":
            return np.insert(nearest(observed), 0, -1, axis=1)
        way = 1.0 if observed.any(axis=1).all() else -1.0
        return np.tile([way, 0.0], (len(observed), 1))

    other = {"fire": "random"} if side == "robots" else {"robots": "sweep"}
    environment = zoo.parallel_env("tiny", scene, flat=True, **other)
    observed, _ = environment.reset(seed=4)
    for _ in turns(environment.environment):
        rows = np.stack([observed[agent] for agent in environment.agents])
        seen.append(rows)
        chosen = dict(zip(environment.agents, policy(rows), strict=True))
        observed, *_ = environment.step(chosen)
    expected = environment.environment.simulation
    asked.clear()
    if side == "robots":
        guide = FlatRobots(policy, "tiny", scene)
        fire = expected.fire_strategy
    else:
        guide = Sweep()
        fire = FlatFire(policy, "tiny", scene)
    ours = Simulation(shipped("tiny"), scene, guide, fire, seed=4)
    assert ours.run() == expected.outcome()
    assert ours.events == expected.events
    if side == "fire":  # it is asked only when it is its turn
        assert all(any(np.array_equal(a, b) for b in seen) for a in asked)
    else:
        assert len(asked) == len(seen)
        assert all(map(np.array_equal, asked, seen))


@pytest.mark.parametrize(
    ("said", "told"),
    [
        (lambda seen: seen[:, :1], "an action is 2 numbers from -1 to 1"),
        (lambda seen: seen[:, :3], "an action is 2 numbers from -1 to 1"),
        (lambda seen: seen[:1, :2], "a policy gave 1 actions for 4"),
        (lambda seen: [["a", "b"]] * len(seen), "an action is 2 numbers from -1 to 1"),
        (lambda seen: seen[:, :2] + [np.nan, 0], "an action is 2 numbers from -1 to 1"),
    ],
)
def test_refuses_actions_of_a_policy_that_are_no_actions(said, told):
    """Of another shape, or no numbers: none is spread over all robots in silence."""
    run = Simulation(shipped("tiny"), SCENE, FlatRobots(said, "tiny", SCENE))
    with pytest.raises(InputError, match=told):
        run.run()


def test_a_fire_s_policy_says_numbers_for_each_decision():
    """Not-a-number is no place; robots keep their destination by it."""
    fire = FlatFire(lambda seen: np.full((1, 3), np.nan), "tiny", SCENE)
    with pytest.raises(InputError, match="an action is 3 numbers from -1 to 1"):
        Simulation(shipped("tiny"), SCENE, fire=fire).run()
    keep = FlatRobots(lambda seen: np.full((len(seen), 2), np.nan), "tiny", SCENE)
    run = Simulation(shipped("tiny"), SCENE, keep)
    run.run()
    assert all(robot.destination is None for robot in run.world.robots)


@pytest.mark.parametrize(
    ("name", "scenario"), [("museum", SCENE), ("tiny", Scenario(people=5))]
)
def test_refuses_a_world_that_a_policy_cannot_read(name, scenario):
    """Of other cells, or other people."""
    robots = FlatRobots(lambda seen: seen[:, :2], "tiny", SCENE)
    fire = FlatFire(lambda seen: seen[:, :3], "tiny", SCENE)
    for players in ({"robots": robots}, {"robots": Sweep(), "fire": fire}):
        run = Simulation(shipped(name), scenario, **players)
        told = r"tiny: this policy plays in Tiny office, with \d+ people and \d+ robots"
        with pytest.raises(InputError, match=told):
            run.run()


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


# -- Code that goes astray ----------------------------------------------------------

RUN = ["evaluate", "--building", "tiny", "--people", "3", "--episodes", "2"]
RUN += ["--fire", "none", "--json"]
BESIDE = ["--workers", "1"], ["--workers", "0"]


def write(mine, body):
    """Write a class Odd, whose `decide` has this body."""
    rows = ["import sys", "class Two(Exception):", "    def __init__(self, a, b):"]
    rows += ["        super().__init__(f'{a} {b}')", "class Odd:"]
    rows += ["    def decide(self, *asked):", f"        {body}"]
    Path(f"{mine}.py").write_text("\n".join(rows) + "\n")


@pytest.mark.parametrize("body", ["raise Two('mine', 7)", "raise NoPickle('mine', 7)"])
def test_an_error_keeps_its_text_on_its_way_out_of_a_worker(body, mine):
    """One that cannot be pickled, or not be read again, does not kill the worker."""
    write(mine, body)
    with Path(f"{mine}.py").open("a") as file:
        file.write(
            "class NoPickle(Two):\n"
            "    def __init__(self, *words):\n"
            "        super().__init__(*words)\n"
            "        self.inside = lambda: None\n"
        )
    with pytest.raises(RuntimeError, match="mine 7") as raised:
        main([*RUN, "--workers", "1", "--robots", f"{mine}:Odd"])
    assert body in "".join(raised.value.__notes__)


def test_a_policy_of_ones_own_can_be_copied_and_pickled(mine):
    """Before a copy has the policy, it is asked for what the policy may tell."""
    Path(f"{mine}.py").write_text(
        "from reference.workshop.strategies.trained import FlatRobots\n"
        "guide = FlatRobots(print, 'tiny')\n"
    )
    guide = from_code(f"{mine}:guide", "robots")
    for twin in (copy(guide), pickle.loads(pickle.dumps(guide))):
        assert twin.name == guide.name


ENDS = {  # what is written, at what the message points
    "class Odd:\n    def decide(self, *asked):\n        exit(0)\n": "decide ends",
    "class Odd:\n    def __init__(self):\n        exit(0)\n": "it ends",
    "exit(0)\n": "its module ends",
    "class Odd:\n    def decide(self, *asked): pass\n"
    "    def __deepcopy__(self, memo): exit(0)\n": "copying it ends",
}


@pytest.mark.parametrize("workers", BESIDE)
@pytest.mark.parametrize("code", ENDS)
def test_code_that_ends_the_program_is_told(code, workers, mine, capsys):
    """With a status that is not 0, though it asked for 0."""
    Path(f"{mine}.py").write_text("from sys import exit\n" + code)
    status, message = refusal(capsys, *RUN, *workers, "--robots", f"{mine}:Odd")
    told = f"{mine}:Odd: {ENDS[code]} the program by SystemExit(0)."
    assert (status, told in message) == (1, True)


def test_a_ctrl_c_that_code_raises_by_itself_is_told_by_a_worker(mine, capsys):
    """Nobody has stopped it: a worker hears no signal."""
    write(mine, "raise KeyboardInterrupt")
    words = [*RUN, "--workers", "1", "--robots", f"{mine}:Odd"]
    status, message = refusal(capsys, *words)
    told = "decide ends the program by KeyboardInterrupt()"
    assert (status, told in message) == (1, True)


def test_an_exception_of_its_own_that_is_no_error_is_told(mine):
    """It would end this program as SystemExit does."""
    write(mine, "raise type('Enough', (BaseException,), {})('said')")
    with pytest.raises(InputError, match=r"ends the program by Enough\(said\)\."):
        first_tick(from_code(f"{mine}:Odd", "robots"))


def test_a_policy_that_ends_the_program_where_it_is_to_play_is_told(mine, capsys):
    """What it prints there goes to stderr, too."""
    Path(f"{mine}.py").write_text(
        "from reference.workshop.strategies.trained import FlatRobots\n"
        "class Odd(FlatRobots):\n"
        "    def __init__(self):\n"
        "        super().__init__(None, 'tiny')\n"
        "    def playing_in(self, building, scenario):\n"
        "        print('here')\n"
        "        exit(0)\n"
    )
    words = ["evacuate", "--building", "tiny", "--robots", f"{mine}:Odd"]
    status, message = refusal(capsys, *words)
    told = f"here\n{mine}:Odd: playing_in ends the program by SystemExit(0)."
    assert (status, message.startswith(told)) == (1, True), message


@pytest.mark.parametrize(
    ("code", "told"),
    [
        (
            "def Odd(world, robots, rng): pass",
            "or a class that is made without argu",
        ),
        ("class Odd:\n    def __init__(self, n): pass", "is made without arguments"),
        (
            "class Odd:\n    def decide(self, *asked): pass\n"
            "    def __init__(self): self.f = (i for i in ())",
            "cannot be copied",
        ),
        (
            "class Odd:\n    def decide(self, *asked): pass\n"
            "    def __deepcopy__(self, memo): pass",
            "cannot be copied (its copy is None)",
        ),
        (
            "class Odd:\n    async def decide(self, *asked): pass",
            "nobody awaits it, so write no `async`",
        ),
    ],
)
def test_refuses_what_can_be_no_strategy_in_one_line(code, told, mine, capsys):
    """Before anything is played."""
    Path(f"{mine}.py").write_text(code + "\n")
    status, message = refusal(capsys, *RUN, "--workers", "0", "--robots", f"{mine}:Odd")
    assert (status, told in message, message.count("\n")) == (1, True, 1), message


PRINTS = """
print("imported")
from reference.workshop.strategies.trained import FlatRobots
from reference import Scenario
def policy(seen):
    print("a policy")
    return seen[:, :2]
flat = FlatRobots(policy, "tiny", Scenario(people=3))
class Odd:
    def __init__(self):
        print("made")
    def decide(self, world, robots, rng):
        print("decided")
        answer = [None] * len(robots)
        robots.clear()
        return answer
"""


def test_what_code_prints_while_an_evaluation_is_resumed_goes_to_stderr(mine, capfd):
    """There a module is imported first for its digest."""
    Path(f"{mine}.py").write_text("print('imported')\n" + CODE)
    words = ["--workers", "0", "--out", "out", "--json"]
    asked = [*RUN[:-1], "--robots", f"{mine}:Guide", *words]
    for command in (asked, ["evaluate", "--resume", *words]):
        sys.modules.pop(mine, None)
        capfd.readouterr()
        assert main(command) == 0
        assert json.loads(capfd.readouterr().out)


@pytest.mark.parametrize("workers", BESIDE)
def test_what_code_prints_goes_to_stderr(workers, mine, capfd):
    """So that `--json` stays one object; from a worker as well."""
    Path(f"{mine}.py").write_text(PRINTS)
    assert main([*RUN, *workers, "--robots", f"{mine}:Odd", f"{mine}:flat"]) == 0
    told = capfd.readouterr()
    assert json.loads(told.out)
    for word in ("imported", "made", "decided", "a policy"):
        assert word in told.err


@pytest.mark.parametrize("floor", ["-1", "2", "99", "0.9", "'0'", "10**30", "2**63"])
def test_refuses_a_floor_that_is_not_there(floor, mine, capsys):
    """It would be a fire at a random place."""
    write(mine, f"return {floor}, 2.0, 2.0")
    played = f"evacuate --building tiny --people 30 --fire {mine}:Odd".split()
    status, message = refusal(capsys, *played)
    assert (status, f"{mine}:Odd: decide returned (" in message) == (1, True), message


@pytest.mark.parametrize(
    ("side", "line", "told"),
    [
        ("robots", "asked[1][0].position += 1", "robot.position"),
        ("robots", "asked[1][0].way.append(3)", "robot.way"),
        ("robots", "asked[1][0].floor = 7", "robot.floor"),
        ("robots", "world.robots.pop()", "world.robots"),
        ("robots", "world.bodies.health[:] = 99", "world.bodies.health"),
        ("fire", "world.flames.burning[:] = True", "world.flames.burning"),
        ("fire", "world.burnt.add(3)", "world.burnt"),
        ("fire", "world.time = 0.0", "world.time"),
    ],
)
def test_refuses_to_let_code_change_the_world(side, line, told, mine, capsys):
    """A strategy that moves its robots would look like a good one."""
    write(mine, f"world = asked[0]\n        {line}\n        return None")
    played = f"evacuate --building tiny --people 30 --{side} {mine}:Odd".split()
    status, message = refusal(capsys, *played)
    assert (status, message.count("\n")) == (1, 1)
    assert f"{mine}:Odd: decide changes {told}. " in message


@pytest.mark.parametrize("name", ["kind", "walkable", "area", "landmark"])
def test_refuses_to_let_code_change_the_map(name):
    """All runs that follow would be played in it."""
    own = Building(shipped("tiny").drawing)  # no other test plays in it
    cells = getattr(own, name)
    cells.flags.writeable = True  # as no array of a building comes
    changes = pytest.raises(InputError, match=rf"changes world\.building\.{name}\.")
    with changes, untouched(Simulation(own).world, "mine:Odd"):
        cells[0, 1, 1] = not cells[0, 1, 1]


def test_refuses_to_let_code_change_the_paper(monkeypatch):
    """All runs that follow would be played with it."""
    world = Simulation(shipped("tiny")).world
    changes_paper = pytest.raises(InputError, match=r"decide changes paper\.HEALTH\.")
    with changes_paper, untouched(world, "mine:Odd"):
        monkeypatch.setattr(paper, "HEALTH", 7.0)


def test_code_may_change_copies_of_the_world(mine):
    """And try there what it likes."""
    asked = "world = deepcopy(asked[0]); world.robots[0].position += 1"
    write(mine, f"from copy import deepcopy; {asked}; return [None] * len(asked[1])")
    run = Simulation(
        load("tiny"), Scenario(people=2), from_code(f"{mine}:Odd", "robots")
    )
    assert run.run().people == 2


@pytest.mark.parametrize("answer", ["'12'", "b'12'", "('1', '2')"])
def test_refuses_words_for_metres(answer, mine, capsys):
    """Two digits are no place."""
    write(mine, f"return [{answer}] * len(asked[1])")
    played = f"evacuate --building tiny --people 2 --robots {mine}:Odd".split()
    status, message = refusal(capsys, *played)
    assert (status, "decide returned [" in message) == (1, True)


REMEMBERS = """
from HELPER import COUNT
NUMBER = [0]
class Place:
    count = 0
    def __init__(self):
        self.count = 0
    def decide(self, world, robots, rng):
        counted()
        return [(1.0 + number() % 7, 1.0)] * len(robots)
def number(): return HERE
def counted(): COUNTING
Odd = Place
ready = Place()
"""
WHERE = {
    "the module": ("NUMBER[0]", "NUMBER[0] += 1"),
    "a module that it imports": ("COUNT[0]", "COUNT[0] += 1"),
    "the class": ("Place.count", "Place.count += 1"),
    "the object": ("ready.count", "ready.count += 1"),
}


@pytest.mark.parametrize("where", WHERE)
def test_no_run_depends_on_what_was_played_before_it(where, mine):
    """Wherever code remembers: so it makes no difference how many workers there are."""
    Path(f"{mine}_helper.py").write_text("COUNT = [0]\n")
    here, counting = WHERE[where]
    code = (
        REMEMBERS.replace("HELPER", f"{mine}_helper")
        .replace("HERE", here)
        .replace("COUNTING", counting)
    )
    Path(f"{mine}.py").write_text(code)

    def played(seed, episodes):
        words = [f"{mine}:Odd", f"{mine}:ready"]
        evaluation = matches.begin_evaluation(
            words, ["none"], "tiny", people=3, seed=seed, episodes=episodes
        )
        return runs.play_evaluation(evaluation, None, InProcess())

    together = {result.run: result for result in played(0, 2)}
    assert together == {result.run: result for k in (0, 1) for result in played(k, 1)}


def test_what_a_package_imports_from_itself_is_imported_anew(tmp_path):
    """As what a module imports from its folder is."""
    package = tmp_path / f"kit_{next(NUMBERS)}"
    package.mkdir()
    (package / "helper.py").write_text("COUNT = [0]\n")
    (package / "__init__.py").write_text("from .helper import COUNT\n" + CODE)
    for _ in range(2):
        from_code(f"{package.name}:Guide", "robots")
        count = sys.modules[f"{package.name}.helper"].COUNT
        assert count == [0]
        count[0] += 1


def test_code_that_imports_numbers_changes_them_once(mine, monkeypatch):
    """However often its module is imported anew."""
    monkeypatch.setattr(paper, "FIXED_PENALTY", 1000.0)
    write(mine, "return None")
    with Path(f"{mine}.py").open("a") as file:
        file.write("from reference import paper\npaper.FIXED_PENALTY *= 2\n")
    for _ in range(3):
        from_code(f"{mine}:Odd", "fire")
    assert paper.FIXED_PENALTY == 2000


@pytest.mark.parametrize("name", ["numpy", "json", "os.path", "time", "numpy.random"])
def test_refuses_modules_that_the_program_itself_needs_and_leaves_them(name, capsys):
    """Imported anew, they and all that they import were there twice."""
    before = dict(sys.modules)
    status, told = refusal(capsys, *f"{MATCH} {name}:Guide --fire none".split())
    assert f"{name}:Guide: '{name}' is no code of yours, but Python's own" in told
    assert status == 1
    assert all(sys.modules.get(each) is module for each, module in before.items())


def test_code_that_changes_while_it_is_played_is_refused(mine):
    """One name would stand for two strategies in a table."""
    evaluation = matches.begin_evaluation([f"{mine}:Guide"], ["none"], "tiny", people=2)
    played = evaluation.simulations([*evaluation.runs[:2]])
    next(played)
    Path(f"{mine}.py").write_text(CODE + "# faster\n")
    with pytest.raises(InputError, match=f"{mine}.py has changed since"):
        next(played)


@pytest.mark.parametrize(
    ("command", "hint"),
    [
        ("evacuate --robots plain", "write plain:Guide\n"),
        ("evacuate --robots plain.py", "write plain:Guide\n"),
        ("evacuate --robots ./plain.py", "to mine.py there, and write mine:Guide\n"),
        ("evaluate --fire plain", "write plain:Spark\n"),
        ("evaluate --robots heir", "write heir:Pupil\n"),
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
    (tmp_path / "heir.py").write_text("class Pupil(Sweep): ...\n")
    (tmp_path / "empty.py").write_text("")
    (tmp_path / "broken.py").write_text("class Guide(:")
    found, message = refusal(capsys, *command.split())
    assert (found, message.count("\n")) == (2, 1)
    assert message.endswith(hint)
