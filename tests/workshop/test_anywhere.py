"""What has learned plays where it can: in every map, or where cells are the same."""

import json
import re
from dataclasses import replace
from runpy import run_path
from subprocess import PIPE

import numpy as np
import pytest
from conftest import ROOT
from movies import shipped
from processes import ended, python
from trainings import begun, equal, tiny

from reference.__main__ import main
from reference.building import Kind, building_of
from reference.paper import InputError, Scenario
from reference.simulation import Simulation
from reference.workshop.comparing.matches import begin_evaluation, notes, with_digests
from reference.workshop.comparing.named import strategy_of
from reference.workshop.maps import load, plan_of, same_cells, to_text
from reference.workshop.maps.generated import generated_text
from reference.workshop.strategies import ANY_MAP, ANYWHERE, LEARNED, SHIPPED
from reference.workshop.training.checkpoints import (
    CheckpointError,
    load_checkpoint,
    save_checkpoint,
)
from reference.workshop.training.policies import (
    LearnedFire,
    LearnedRobots,
    fixed_player,
)

SIDES = ("robots", "fire")
shipping = run_path(str(ROOT / "tutorials" / "experiments" / "ship.py"))


# -- Cells, not names ---------------------------------------------------------------


def with_other_names(building, rng):
    """The text of a map: rooms, floors and the building are called otherwise.

    Labels stand elsewhere in their rooms, or are gone; notes are new.
    """
    text = to_text(building.drawing)
    head, _, rest = text.partition("\nfloor")
    head = f"; noted\nbuilding: {word(rng)} {word(rng)}\n" + head.split("\n", 1)[1]
    lines = []
    for line in f"floor{rest}".splitlines():
        if line.startswith("floor"):
            number = line.split(":")[0]
            lines.append(f"; a note\n{number}: {word(rng)}")
            continue
        line = re.sub("[a-z][a-z0-9]*", lambda label: "." * len(label[0]), line)
        lines.append(line)
    return labelled("\n".join([head, *lines, ""]), building, rng)


def labelled(text, building, rng):
    """Write a word into some rooms, each into a row of four free cells or more."""
    rooms = load(text).areas
    lines = text.splitlines()
    heads = [k for k, line in enumerate(lines) if line.startswith("floor")]
    for room in rooms:
        row, col = room.cells[rng.integers(len(room.cells))].tolist()
        line = heads[room.floor] + 1 + row
        free = lines[line][col - 1 : col + 6]
        if room.kind == "room" and free == "......." and rng.random() < 0.7:
            cells = list(lines[line])
            cells[col : col + 4] = f"{word(rng)}"
            lines[line] = "".join(cells)
    return "\n".join(lines) + "\n"


def word(rng):
    """Four letters."""
    return "".join(rng.choice([*"abcdefghijklmnopqrstuvwxyz"], 4))


def with_a_moved_door(building, rng):
    """The building, one of whose doors is now a cell further on in its wall."""
    plan = plan_of(building)
    doors = [mark for mark in building.landmarks if mark.kind is Kind.DOOR]
    for mark in rng.permutation(doors):
        row, col = mark.cells[0].tolist()
        for d_row, d_col in ((0, 1), (1, 0), (0, -1), (-1, 0)):
            lines = plan.splitlines()
            heads = [k for k, line in enumerate(lines) if line.startswith("floor")]
            first = heads[mark.floor] + 1
            cells = [list(line) for line in lines]
            there = first + row + d_row, col + d_col
            if cells[there[0]][there[1]] != "#":
                continue
            cells[first + row][col] = "#"
            cells[there[0]][there[1]] = "+"
            try:
                return load("\n".join("".join(line) for line in cells) + "\n")
            except InputError:  # not in this wall
                continue
    raise AssertionError("no door that can be moved")


MAPS = ["paper", "tiny", "museum", "school", "tower", "maze", 0, 1, 2, 3]


def map_of(name):
    """One that ships, or one that is drawn by lot."""
    if isinstance(name, str):
        return shipped(name)
    return building_of(generated_text(name, 24, 16, 2))


@pytest.mark.parametrize("name", MAPS)
def test_names_labels_and_notes_never_matter_one_moved_door_does(name):
    """In any map, however it is called and noted."""
    building = map_of(name)
    for seed in range(3):
        rng = np.random.default_rng(seed)
        renamed = load(with_other_names(building, rng))
        assert renamed.drawing != building.drawing
        assert same_cells(renamed.drawing, building.drawing)
        moved = with_a_moved_door(building, rng)
        assert not same_cells(moved.drawing, building.drawing)
        assert not same_cells(moved.drawing, renamed.drawing)


def test_who_learned_in_a_building_plays_the_same_where_rooms_are_called_otherwise():
    """What ships for the paper's building: the same events, to the last bit."""
    renamed = load(with_other_names(shipped("paper"), np.random.default_rng(0)))
    scenario = Scenario(time_limit=30.0)
    events = []
    for building in (shipped("paper"), renamed):
        sides = [strategy_of(LEARNED, side, building, scenario) for side in SIDES]
        assert [who.title for who in sides] == [LEARNED, LEARNED]
        sim = Simulation(building, scenario, *sides, seed=1)
        sim.run()
        events.append(sim.events)
    assert events[0] == events[1]


@pytest.fixture(scope="module")
def own(tmp_path_factory):
    """Files of networks that learned nothing in tiny, by their head."""
    folder = tmp_path_factory.mktemp("own")
    files = {}
    for head in ("floor", "mixture", "set"):
        settings = tiny(robots={"head": head}, fire={"head": head})
        files[head] = folder / f"{head}.pt"
        save_checkpoint(begun(settings).checkpoint(), files[head])
    return files


@pytest.mark.parametrize("head", ["floor", "mixture"])
def test_refuses_another_building_for_a_network_that_knows_its_own(own, head):
    """One door is enough; a name is not."""
    rng = np.random.default_rng(0)
    scenario = tiny().scenario
    renamed = load(with_other_names(shipped("tiny"), rng))
    moved = with_a_moved_door(shipped("tiny"), rng)
    for side in SIDES:
        strategy_of(str(own[head]), side, renamed, scenario)
        with pytest.raises(InputError, match="learned in Tiny office, not in this"):
            strategy_of(str(own[head]), side, moved, scenario)
        with pytest.raises(InputError, match="learned with people=6; here it is 7"):
            more = replace(scenario, people=7)
            strategy_of(str(own[head]), side, renamed, more)


def test_a_network_of_sets_plays_elsewhere_and_says_where_it_learned(own):
    """With other counts, too; what it has learned in stays known."""
    word = str(own["set"])
    begun_there = begin_evaluation([word], [word], "school", people=9, episodes=1)
    told = "\n".join(notes(begun_there))
    assert told.count("learned in Tiny office; here it plays in School") == 2
    assert told.count("people=6") == told.count("people=9") == 2
    assert begun_there.titles[word] == word
    (sim,) = begun_there.simulations([(word, word, 3)])
    for _ in range(50):
        sim.step()
    assert all(robot.destination is not None for robot in sim.world.robots)


def test_a_map_that_was_only_renamed_has_not_changed(tmp_path, own):
    """An evaluation goes on, and so says nothing of it; after a moved door it does."""
    rng = np.random.default_rng(0)
    path = tmp_path / "office.txt"
    path.write_text(plan_of(shipped("tiny")))
    begun_there = begin_evaluation(["sweep"], ["random"], str(path), episodes=1)
    path.write_text(with_other_names(shipped("tiny"), rng))
    assert with_digests(begun_there).digests == begun_there.digests
    assert notes(begun_there) == []
    path.write_text(plan_of(with_a_moved_door(shipped("tiny"), rng)))
    assert with_digests(begun_there).digests != begun_there.digests
    assert "has changed since" in notes(begun_there)[0]


# -- What ships, everywhere ---------------------------------------------------------

ROOM = """building: Room
size: 30 x 6
floor 1: ground
##############################
#............................#
#............................E
#............................#
#............................#
##############################
"""
HUT = """building: Hut
size: 6 x 4
floor 1: ground
######
#....#
#....E
######
"""
STAIRS = """building: Stack
size: 24 x 8
floor 1: ground
########################
#..................#AA##
#..................+AA##
#..................#AA##
E..................#####
#..................#
#..................#
####################
floor 2-4: above
########################
#..................#AA##
#..................+AA##
#..................#AA##
#..................#####
#..................#
#..................#
####################
"""
LANDING = """building: Landing
size: 24 x 8
floor 1: ground
########################
#..................#AA##
#..................+AA##
#..................#AA##
E..................#####
#..................#
#..................#
####################
floor 2: hardly a floor
                ########
                #..#AA##
                #..+AA##
                ####AA##
                   #####
#
#
#
"""
PARTS = """building: Two parts
size: 31 x 8
floor 1: ground
#############   ###############
#...........#   #.............#
#...........#   #.............#
#...........#   #.............#
E...........#   #.............E
#...........#   #.............#
#...........#   #.............#
#############   ###############
"""
CASES = {
    "one room, no doors": (ROOM, {"people": 8}),
    "one person": (ROOM, {"people": 1}),
    "an empty building": (ROOM, {"people": 0}),
    "the paper's building, empty": ("paper", {"people": 0}),
    "nothing can burn": (HUT, {"people": 3}),
    "eight robots in a hut": (HUT, {"people": 3, "robots_per_floor": 8}),
    "only stairs lead down": (STAIRS, {"people": 12}),
    "hardly a floor above": (LANDING, {"people": 8}),
    "a floor in two parts": (PARTS, {"people": 12}),
    "no robots": (STAIRS, {"people": 12, "robots_per_floor": 0}),
    "one robot a floor": (STAIRS, {"people": 12, "robots_per_floor": 1}),
    "no sources": (PARTS, {"people": 12, "sources": 0}),
    "many sources": (ROOM, {"people": 8, "sources": 40}),
    "everybody upstairs": (STAIRS, {"people_per_floor": (0, 0, 0, 9)}),
    "nobody above": (STAIRS, {"people_per_floor": (9, 0, 0, 0)}),
    "quick decisions": (ROOM, {"people": 8, "decision_seconds": 1.0}),
    "eight robots a floor": ("tiny", {"people": 20, "robots_per_floor": 8}),
    "the paper's building, one person": ("paper", {"people": 1}),
    "the paper's building, 400 people": ("paper", {"people": 400}),
    "museum": ("museum", {}),
    "school": ("school", {}),
    "tower": ("tower", {}),
    "maze": ("maze", {}),
    **{f"drawn by lot, {seed}": (seed, {"people": 30}) for seed in range(4)},
}


@pytest.mark.parametrize("case", CASES)
def test_learned_robots_and_fire_play_in_every_building(case):
    """For any number of people, robots and sources; who guides is asked and answers."""
    place, fields = CASES[case]
    building = load(place) if "\n" in str(place) else map_of(place)
    scenario = Scenario(time_limit=12.0, **fields)
    sides = [strategy_of(LEARNED, side, building, scenario) for side in SIDES]
    assert [who.title for who in sides] == [ANY_MAP, ANY_MAP]
    sim = Simulation(building, scenario, *sides, seed=1)
    outcome = sim.run()
    assert outcome.people == sum(scenario.start_counts(building.floors))
    assert len(sim.world.robots) == scenario.robots_per_floor * building.floors
    asked = [robot for robot in sim.world.robots if robot.destination is not None]
    assert bool(asked) == bool(sim.world.robots and outcome.people)
    lit = len(sim.world.flames.sources)
    nothing_to_light = "nothing can burn", "eight robots in a hut", "no sources"
    if not outcome.people or case in nothing_to_light:
        assert not lit


@pytest.mark.parametrize("seed", range(3))
def test_the_learned_fire_lights_all_it_may_in_any_map(seed):
    """So that it has not been refused, or asked in vain."""
    building = building_of(generated_text(seed, 24, 16, 2))
    scenario = Scenario(people=20, decision_seconds=1.0, sources=3, time_limit=30.0)
    sim = Simulation(
        building,
        scenario,
        strategy_of("escort", "robots", building, scenario),
        strategy_of(LEARNED, "fire", building, scenario),
    )
    sim.run()
    assert len(sim.world.flames.sources) == 3


@pytest.mark.parametrize(
    ("name", "fields", "title"),
    [
        ("paper", {}, LEARNED),
        ("paper", {"time_limit": 60.0}, LEARNED),
        ("paper", {"people_per_floor": (40, 0, 0)}, LEARNED),
        ("paper", {"people": 41}, ANY_MAP),
        ("paper", {"robots_per_floor": 3}, ANY_MAP),
        ("paper", {"sources": 3}, ANY_MAP),
        ("school", {}, ANY_MAP),
    ],
)
def test_in_the_papers_building_the_network_made_for_it_plays(name, fields, title):
    """With its counts; elsewhere the one for any map. Digests are of what plays."""
    scenario = Scenario(**fields)
    building = shipped(name)
    ships = SHIPPED if title == LEARNED else ANYWHERE
    for side in SIDES:
        assert strategy_of(LEARNED, side, building, scenario).title == title
        network = fixed_player(LEARNED, side, building, scenario)
        assert equal(network.weights, load_checkpoint(ships).player(side).weights)
    asked = begin_evaluation([LEARNED], [LEARNED], name, scenario=fields, episodes=1)
    assert [*asked.digests[LEARNED]] == [ships.name]
    assert asked.titles == {LEARNED: title}
    told = "\n".join(notes(asked))
    assert told.count(ANY_MAP) == (2 if title == ANY_MAP else 0)


def test_more_robots_than_the_network_learned_with_are_told():
    """Of robots: the fire learned with others."""
    asked = begin_evaluation(
        [LEARNED], [LEARNED], "tiny", scenario={"robots_per_floor": 9}, episodes=1
    )
    told = [line for line in notes(asked) if "at most" in line]
    assert told == ["--robots learned: it learned with at most 8 robots a floor"]


def test_people_and_robots_that_were_drawn_by_lot_are_no_others():
    """Only more robots than ever are; what did not vary is told."""
    fields = {"robots_per_floor": 9, "people": 7, "sight_range": 6.0}
    asked = begin_evaluation([str(ANYWHERE)], ["none"], "tiny", scenario=fields)
    where, under, most = notes(asked)
    assert "learned in generated buildings" in where
    assert "learned under sight_range=5; here it plays under sight_range=6" in under
    assert most.endswith("it learned with at most 8 robots a floor")


def test_what_plays_anywhere_ships_as_weights_alone():
    """It has no building in it, and is small."""
    assert ANYWHERE.stat().st_size < 5e6
    assert not load_checkpoint(ANYWHERE).learners
    for policy in (LearnedRobots(ANYWHERE), LearnedFire(ANYWHERE)):
        assert policy.anywhere


def test_refuses_to_ship_a_network_with_a_building_in_it_for_any_map(own):
    """Before the file is written."""
    sets, mixture = (load_checkpoint(own[head]) for head in ("set", "mixture"))
    made = shipping["shipped_anywhere"](sets, sets)
    assert made.task.fixed["robots"][0].settings.head == "set"
    for robots, fire in ((sets, mixture), (mixture, sets)):
        with pytest.raises(InputError, match="is of one building"):
            shipping["shipped_anywhere"](robots, fire)


# -- What people see ----------------------------------------------------------------


def test_tables_and_films_say_which_network_plays(tmp_path, capsys):
    """In words; a program reads what was asked for."""
    film = tmp_path / "film.html"
    words = "--building tiny --robots none learned --fire random --people 3"
    asked = f"{words} --scenario time_limit=6".split()
    assert main(["evacuate", *asked, "--animate", str(film)]) == 0
    shown = capsys.readouterr()
    assert f"  {ANY_MAP}\n" in shown.out
    assert "--robots learned: learned, any map" in shown.err
    assert f"robots: {ANY_MAP}: a network that knows no" in film.read_text()
    baseline = ["--baseline", "learned", "--episodes", "2", "--workers", "0"]
    assert main(["evaluate", *asked, *baseline]) == 0
    assert f"E, {ANY_MAP} = 1" in capsys.readouterr().out
    assert main(["evacuate", *asked, "--json"]) == 0
    pairs = json.loads(capsys.readouterr().out)["pairs"]
    assert [pair["robots"] for pair in pairs] == ["none", LEARNED]


def test_evaluate_tells_in_its_table_which_network_played(tmp_path, capsys):
    """And in its notes; cells in the file keep the word that was asked for."""
    words = "--building tiny --robots learned --fire none --people 3 --workers 0"
    asked = f"{words} --episodes 1 --scenario time_limit=6 --out".split()
    assert main(["evaluate", *asked, str(tmp_path)]) == 0
    assert re.search(f"^{ANY_MAP} ", capsys.readouterr().out, re.MULTILINE)
    kept = json.loads((tmp_path / "cells.json").read_text())
    assert [cell["robots"] for cell in kept["cells"]] == [LEARNED]
    assert [*kept["digests"][LEARNED]] == [ANYWHERE.name]


def test_a_new_map_of_60_by_40_with_100_people_plays_in_one_command(tmp_path):
    """By the book: nothing is compiled, nor is numba loaded."""
    path = tmp_path / "new.txt"
    path.write_text(plan_of(building_of(generated_text(5, 60, 40, 3))))
    (tmp_path / "numba.py").write_text("raise SystemExit('numba was loaded')")
    asked = "--robots learned --fire learned --people 100 --scenario time_limit=8"
    words = ["evacuate", "--building", str(path), *asked.split(), "--json"]
    env = {"PYTHONPATH": f"{tmp_path}:{ROOT}"}
    process = python("-m", "reference", *words, env=env, stdout=PIPE, stderr=PIPE)
    out, err = ended(process)
    assert process.returncode == 0, err
    assert json.loads(out)["people"] == 100


def test_refuses_learned_where_nobody_has_shipped_a_network(monkeypatch):
    """The file's name, and no traceback."""
    missing = ANYWHERE.with_name("no_such_file.pt")
    monkeypatch.setattr(
        "reference.workshop.training.policies.ANYWHERE", missing, raising=True
    )
    with pytest.raises((CheckpointError, OSError), match=missing.name):
        strategy_of(LEARNED, "robots", shipped("tiny"), Scenario())
