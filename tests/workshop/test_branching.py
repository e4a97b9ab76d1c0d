"""What a decision is worth: the same futures for every choice, and none is the own."""

from argparse import Namespace
from dataclasses import replace
from importlib import import_module

import numpy as np
import pytest
from conftest import ROOT
from movies import shipped, stage, wait

from reference.fire import RandomFire
from reference.paper import InputError, Scenario
from reference.robots import actual_target
from reference.simulation import Simulation
from reference.workshop.comparing.named import strategy_named
from reference.workshop.engine import run_to_decision, run_to_end
from reference.workshop.measuring import branching
from reference.workshop.measuring.branching import (
    TO_RIM,
    TO_STAY,
    TO_WAY_OUT,
    Held,
    Order,
    branches,
    choices_of,
    future_of,
    mean_and_error,
    own_kind,
    play_searching,
    play_to_the_end,
    players_of,
    saved,
    search,
    surely_more,
    worth_of,
)
from reference.workshop.storage.workers import one_thread
from reference.workshop.strategies.guides import Observer

HALL = """
    #################################
    #...............................#
    E.........p.....................E
    #.......q.R.....................#
    #.........r.....................#
    #################################
    """
ROUNDS = ((1, 2), (3, 4, 5), (6, 7, 8))


def office(seconds=15, robots=None):
    """An evacuation of a small building in which something burns."""
    scene = Scenario(people=12, time_limit=60.0)
    robots = robots or Observer()
    sim = Simulation(shipped("tiny"), scene, robots, RandomFire(), seed=3)
    wait(sim, seconds)
    return sim


def hall():
    """Three people who follow a robot, 10 m from one exit and 21 m from the other."""
    return stage(HALL, time_limit=12.0)


# -- Futures ------------------------------------------------------------------------


@pytest.mark.paper("D7", "chosen")
def test_no_future_is_the_evacuation_s_own():
    """What has burnt has burnt; what will burn, and all random numbers, are others."""
    sim = office()
    own = sim.world.flames.arrival
    past = own <= sim.world.time
    futures = [future_of(sim, seed) for seed in (1, 2)]
    arrivals = [future.world.flames.arrival for future in futures]
    assert past.any()
    assert all(np.array_equal(arrival[past], own[past]) for arrival in arrivals)
    three = [own, *arrivals]
    assert len({arrival.tobytes() for arrival in three}) == 3
    for purpose, rng in sim.rng.items():
        states = [f.rng[purpose].bit_generator.state for f in futures]
        states.append(rng.bit_generator.state)
        assert len(set(map(repr, states))) == 3


def test_a_future_begins_with_the_present():
    """People, robots, doors that are full, and who is due to think."""
    sim = office()
    sim.full_until[0] = 99.0
    sim.due[:4] = False
    future = future_of(sim, 1)
    assert future.full_until[0] == 99.0 and not future.due[:4].any()
    for name in ("position", "health", "leader"):
        mine, theirs = (getattr(s.world.bodies, name) for s in (sim, future))
        assert np.array_equal(mine, theirs)
    before = sim.world.time
    play_to_the_end([future], {})
    assert sim.world.time == before < future.world.time


def test_choices_share_their_futures():
    """The same choice ends the same; another seed is another future."""
    sim = office()
    (robot, *_) = sim.world.robots
    one, other = branches(sim, robot, [None, None], 4, (1, 2))
    assert [run.events for run in one] == [run.events for run in other]
    assert one[0].events != one[1].events
    delays = [run.spread.delays for run in (one[0], other[0], one[1])]
    assert delays[0] is delays[1] is not delays[2]


@pytest.mark.slow
def test_a_network_that_is_asked_once_for_all_futures_decides_as_alone():
    """In each future, whatever the others do."""
    robots = strategy_named("learned", "robots")
    fire = strategy_named("learned", "fire")
    sim = Simulation(shipped("paper"), Scenario(time_limit=120.0), robots, fire, 1)
    with one_thread():
        for _ in range(18):
            run_to_decision([sim])
        some = [future_of(sim, seed) for seed in (1, 2)]
        alone = [future_of(sim, seed) for seed in (1, 2)]
        for run in alone:
            run.robot_strategy = robots
            run.fire_strategy = fire
        play_to_the_end(some, players_of(sim))
        play_to_the_end(alone, {})
    assert [run.events for run in some] == [run.events for run in alone]


# -- Choices ------------------------------------------------------------------------


def test_a_robot_may_be_sent_to_each_of_its_targets_once():
    """Both exits, a cell to guard each, people whom nobody leads; it may stay."""
    sim = hall()
    (robot,) = sim.world.robots
    choices = choices_of(sim, robot)
    kinds = [choice.kind for choice in choices]
    assert kinds.count(TO_WAY_OUT) == kinds.count(TO_RIM) == 2 and kinds[-1] == TO_STAY
    targets = [actual_target(sim.building, 0, *choice.point) for choice in choices]
    assert len(set(targets)) == len(targets)


def test_a_choice_is_held_for_some_decisions_of_one_robot():
    """Then, and for all others, the strategy's own decisions count."""

    class Own:
        def decide(self, world, robots, rng):
            return [(0.0, 0.0) for _ in robots]

    sim = stage(HALL.replace("E.........p", "E.....R...p"))
    robots = sim.world.robots
    held = Held(Own(), {robots[1].body: Order((1.0, 2.0), 2)})
    answers = [held.decide(sim.world, robots, None) for _ in range(3)]
    sent = [(0.0, 0.0), (1.0, 2.0)]
    assert answers == [sent, sent, [(0.0, 0.0), (0.0, 0.0)]]


# -- Their worth --------------------------------------------------------------------


def test_the_exit_that_is_near_enough_is_the_best_choice():
    """Nobody reaches the other in time, and the team would have stayed."""
    sim = hall()
    (robot,) = sim.world.robots
    worth = worth_of(sim, robot, 4, ROUNDS)
    assert worth.best.kind == TO_WAY_OUT and worth.best.point[0] < robot.position[0]
    assert worth.gain == worth.believed > 1
    assert own_kind(sim, robot, choices_of(sim, robot)) == TO_STAY


def test_a_mean_is_surely_more_than_nothing_beyond_two_standard_errors():
    """Which is 1 of a draw of 0 and one of 2."""
    assert mean_and_error(np.array([0.0, 2.0])) == (1, 1)
    assert mean_and_error(np.array([3.0])) == (3, 0)
    assert not surely_more(2.0, 1.0)
    assert surely_more(2.1, 1.0)


def test_the_own_decision_gains_exactly_nothing():
    """Where it is the best, and under another name."""
    sim = hall()
    (robot,) = sim.world.robots
    choices = choices_of(sim, robot)
    near = min(choices, key=lambda choice: choice.point[0])
    sim.robot_strategy = Held(sim.robot_strategy, {robot.body: Order(near.point, 99)})
    assert own_kind(sim, robot, choices) == near.kind == TO_WAY_OUT
    assert sim.robot_strategy.orders[robot.body].decisions == 99  # it was asked a copy
    own, same = saved(branches(sim, robot, [None, near], 4, (1, 2, 3)))
    assert own.tolist() == same.tolist()
    worth = worth_of(sim, robot, 4, ROUNDS)
    assert worth.best is None and worth.gain == worth.gain_error == 0


def test_what_changes_nothing_is_not_played_again(monkeypatch):
    """Nobody walks, so no choice brings anything about: one round tells."""
    begun = []
    real = branching.branches

    def counted(*asked):
        begun.append(asked)
        return real(*asked)

    monkeypatch.setattr(branching, "branches", counted)
    sim = hall()
    sim.world.bodies.pace[:] = 0
    worth = worth_of(sim, sim.world.robots[0], 4, ROUNDS)
    assert worth.best is None and len(begun) == 1


def test_robots_that_search_lead_to_the_exit_that_is_near_enough():
    """A team that never leads anybody saves nobody."""
    usual = hall()
    run_to_end([usual])
    searching = hall()
    chosen = play_searching(searching, 4, (1, 2), np.random.default_rng(1))
    assert chosen == 1
    assert searching.outcome().evacuated == 3 > usual.outcome().evacuated == 0


def test_a_robot_that_searches_knows_where_those_before_it_are_sent(monkeypatch):
    """The first leads out, in all futures of the second, which finds nothing to do."""
    searches = []

    def noted(run, robot, decisions, rounds, mates):
        found = search(run, robot, decisions, rounds, mates)
        searches.append((robot.number, dict(mates), found.best))
        return found

    monkeypatch.setattr(branching, "search", noted)
    sim = stage(HALL.replace("r.........", "r........R"), time_limit=12.0)
    (first, _) = sim.world.robots
    play_searching(sim, 99, (1, 2), np.random.default_rng(1))
    (_, _, best), second = searches
    assert best.kind == TO_WAY_OUT
    assert second == (1, {first.body: Order(best.point, 99)}, None)


@pytest.mark.slow
@pytest.mark.paper("D6")
def test_it_finds_where_a_guard_would_stand():
    """A fire that repeats itself comes next beside an exit, a few steps away."""
    robots = strategy_named("observer", "robots")
    fire = strategy_named("fixed", "fire")
    sim = Simulation(shipped("paper"), Scenario(), robots, fire, 100_000)
    for _ in range(6):
        run_to_decision([sim])
    (robot, *_) = sim.world.robots
    worth = worth_of(sim, robot, 1, ((1, 2), (3, 4, 5, 6), (7, 8, 9, 10)))
    assert (worth.best.kind, worth.best.point) == (TO_RIM, (17.5, -11.5))
    assert worth.gain > 2


# -- The experiment -----------------------------------------------------------------


@pytest.fixture
def experiment(monkeypatch):
    """The script, with few futures."""
    monkeypatch.syspath_prepend(ROOT / "tutorials" / "experiments")
    script = import_module("what_a_decision_is_worth")
    monkeypatch.setattr(script, "FUTURES", (1, 2, 2))
    return script


def asks(table, **more):
    """What its command line would say."""
    usual = {
        "table": str(table), "decisions": 1, "fires": ["random", "fixed"],
        "base": ["observer"], "held": [2], "where": "any", "building": "tiny",
        "seed": 5, "workers": 0, "minutes": 9.0,
    }  # fmt: skip
    return Namespace(**usual | more)


def test_a_table_that_was_stopped_ends_as_one_that_was_not(experiment, tmp_path):
    """Row by row, but for the seconds that it took."""

    def rows(table):
        found = experiment.read_rows(table, experiment.Row)
        return [replace(row, seconds=0) for row in found]

    whole = tmp_path / "whole.csv"
    experiment.play(asks(whole))
    stopped = tmp_path / "stopped.csv"
    experiment.play(asks(stopped, minutes=0.0))
    assert len(rows(stopped)) == 1
    with stopped.open("a") as file:
        file.write("tiny,any,2,obs")  # killed while it wrote
    experiment.play(asks(stopped))
    assert repr(rows(stopped)) == repr(rows(whole))
    assert len(rows(whole)) == 2

    drawn = tmp_path / "whole.png"
    asked = {"table": str(whole), "picture": drawn, "base": "observer", "held": 2}
    experiment.show(Namespace(building="tiny", **asked))
    assert drawn.exists()
    with pytest.raises(InputError, match="no row of observer in paper, held for 2"):
        experiment.show(Namespace(building="paper", **asked))


def test_where_guard_sets_off_it_is_told_what_standing_there_is_worth(
    experiment, tmp_path, capsys
):
    """And whether that is what was found."""
    table = tmp_path / "guard.csv"
    experiment.play(asks(table, fires=["fixed"], where="guard", held=[1, 4]))
    rows = experiment.read_rows(table, experiment.Row)
    assert {row.held for row in rows} == {1, 4}
    assert all(np.isfinite(row.guards) for row in rows)
    experiment.show(Namespace(table=str(table), picture=None))
    assert "to stand where guard does" in capsys.readouterr().out
