"""The environment: who acts when, what it pays, how it ends."""

from itertools import pairwise
from math import inf, nan

import numpy as np
import pytest
from alike import same
from movies import built, events_of, shipped, turns

from reference.fire import RandomFire
from reference.game import observations
from reference.game.environment import (
    FIRE,
    Environment,
    destination,
    fire_decision,
    until_next_decision,
)
from reference.paper import InputError, Scenario
from reference.rewards import fire_reward, group_reward
from reference.simulation import Simulation
from reference.workshop.anchors.frame import to_normalised
from reference.workshop.comparing.named import strategy_of
from reference.workshop.strategies import ROBOTS
from reference.workshop.strategies.guides import Patrol
from reference.world import Fate, FireLit, FireRefused

CALM = np.array([-1.0, 1.0, 1.0], dtype=np.float32)
"""A fire that is refused: the corner of the main body is outside."""


def game(name="tiny", robots=None, fire=None, seed=0, people=6, **scenario):
    """An environment that has been reset."""
    building = shipped(name)
    scene = Scenario(people=people, training=True, **scenario)
    robots = strategy_of(robots, "robots", building, scene)
    fire = strategy_of(fire, "fire", building, scene)
    environment = Environment(building, scene, robots, fire)
    environment.reset(seed)
    return environment


def idle(environment):
    """Nobody goes anywhere, and no fire breaks out."""
    keep = np.full(2, np.nan, dtype=np.float32)
    return {agent: CALM if agent == FIRE else keep for agent in environment.agents}


def sampled(environment, rng):
    """An action for all who are there."""
    return {
        agent: rng.uniform(-1, 1, 3 if agent == FIRE else 2)
        for agent in environment.agents
    }


def episode(environment, seed, actions=7):
    """All returns of an episode of random actions, the reset's first."""
    rng = np.random.default_rng(actions)
    told = [environment.reset(seed)]
    for _ in turns(environment):
        told.append(environment.step(sampled(environment, rng)))
    return told


def gone(environment, *floors):
    """Let everybody on these floors be out."""
    world = environment.simulation.world
    world.bodies.fate[np.isin(world.bodies.floor, floors)] = Fate.EVACUATED


# -- Who acts -----------------------------------------------------------------------


def test_all_agents_are_there_after_a_reset():
    """Six robots and the fire of the paper, also if a floor has no work for them."""
    environment = game("paper", people=5, people_per_floor=(5, 0, 0))
    names = [f"robot_{k}" for k in range(6)] + ["fire_0"]
    assert environment.agents == environment.possible_agents == names
    seen, infos = environment.reset(1)
    assert list(seen) == list(infos) == names
    assert [info["acts"] for info in infos.values()] == [1, 1, 0, 0, 0, 0, 0]


def test_a_side_that_a_strategy_plays_is_not_among_the_agents():
    """Robots against a scripted fire, the fire against scripted robots."""
    assert game(fire="greedy").possible_agents == [f"robot_{k}" for k in range(4)]
    assert game(robots="sweep").possible_agents == ["fire_0"]
    assert game(robots="none").possible_agents == ["fire_0"]
    assert game(robots_per_floor=0).possible_agents == ["fire_0"]


@pytest.mark.parametrize("given", [{"people": 3}, {}, Scenario])
def test_refuses_what_is_no_scenario(given):
    """In words, as a simulation does; an empty dict is not the default scenario."""
    with pytest.raises(InputError, match="scenario is "):
        Environment(shipped("tiny"), given)


def test_refuses_a_game_without_agents():
    """Both sides scripted: that is a simulation; nor, at once, what that refuses."""
    with pytest.raises(InputError, match="nobody acts"):
        game(robots="sweep", fire="random")
    with pytest.raises(InputError, match="people do not fit"):
        Environment(shipped("tiny"), Scenario(people=5000))


@pytest.mark.parametrize("seed", ["x", -1, 2.5, True])
def test_refuses_a_seed_that_is_no_whole_number(seed):
    """In words, as a simulation does; the episode goes on."""
    environment = game()
    before = environment.simulation
    with pytest.raises(InputError, match="seed is "):
        environment.reset(seed)
    assert environment.simulation is before


@pytest.mark.parametrize(
    ("action", "told"),
    [
        ([0.0] * 3, "robot_1: an action is 2 numbers from -1 to 1"),
        ([0.0, nan], "robot_1: an action is 2 numbers"),
        ([0.0, inf], "robot_1: an action is 2 numbers"),
        (np.ma.masked_all(2), "robot_1: an action is 2 numbers"),
        ("north", "robot_1: an action is 2 numbers"),
    ],
)
def test_refuses_an_action_that_is_none_by_its_agent(action, told):
    """In words, and before anything moves."""
    environment = game()
    actions = dict.fromkeys(environment.agents, [0.0] * 2) | {FIRE: [0.0] * 3}
    with pytest.raises(InputError, match=told):
        environment.step(actions | {"robot_1": action})
    with pytest.raises(InputError, match="fire_0: an action is 3 numbers"):
        environment.step(actions | {FIRE: [nan] * 3})
    with pytest.raises(InputError, match="fire_0 is still there, but has no action"):
        environment.step({name: actions[name] for name in actions if name != FIRE})
    assert environment.simulation.world.time == 0


def test_refuses_a_step_before_the_first_reset():
    """After an episode's end it is none either, but does no harm."""
    environment = Environment(shipped("tiny"), Scenario(people=2))
    with pytest.raises(RuntimeError, match=r"call reset\(\) before step\(\)"):
        environment.step({})


def test_somebody_else_may_play_from_one_decision_to_the_next():
    """Such as the workshop's engine; the environment does the rest."""
    lengths = []

    def play(simulations):
        until_next_decision(simulations)
        lengths.extend(run.ticks for run in simulations)

    environment = Environment(
        shipped("tiny"), Scenario(people=2), fire=RandomFire(), advance=play
    )
    environment.reset(seed=1)
    for _ in range(2):
        environment.step({agent: [0.0, 0.0] for agent in environment.agents})
    assert lengths == [25, 50]


# -- Observations and infos ---------------------------------------------------------


@pytest.mark.parametrize("name", ["tiny", "tower"])
def test_observations_keep_their_shape_for_whoever_leaves_too(name):
    """Float32 vectors and grids, as laid out for all alike; infos say who acts."""
    environment = game(name, time_limit=20)
    layout = observations.vector_layout(
        environment.building, environment.simulation.scenario
    )
    for told in episode(environment, seed=3):
        for agent, seen in told[0].items():
            assert seen["vector"].shape == (layout.size,)
            assert seen["grid"].shape == observations.grid_shape(environment.building)
            assert seen["vector"].dtype == seen["grid"].dtype == np.float32
            assert told[-1][agent]["acts"] in (0.0, 1.0)


def test_what_is_returned_belongs_to_whoever_gets_it():
    """Writing into one agent's observation or info spoils nobody else's."""
    one = game()
    other = game()
    for _ in range(3):
        seen, _, _, _, infos = one.step(idle(one))
        expected = other.step(idle(other))
        for numbers in (seen["robot_0"]["vector"], seen["robot_0"]["grid"]):
            numbers[:] = 99
        infos["robot_0"]["acts"] = 99.0
        for agent in ("robot_1", FIRE):
            assert same(seen[agent], expected[0][agent])
            assert infos[agent] == expected[4][agent]


# -- The robots' actions ------------------------------------------------------------


@pytest.mark.paper("C5")
def test_a_robot_goes_where_its_action_says():
    """Two floats: (0.25, -0.5) of a body of 40 x 40 m is 5 m east and 10 m south.

    What lies beyond is cut off at the walls. All nan keeps a destination.
    """
    environment = game("paper")
    actions = idle(environment) | {"robot_0": [-7.0, 0.0]}
    environment.step(actions | {"robot_3": np.float32([0.25, -0.5])})
    robots = environment.simulation.world.robots
    assert robots[0].destination.tolist() == [-20.0, 0.0]
    assert robots[3].destination.tolist() == [5.0, -10.0]
    others = [*robots[1:3], *robots[4:]]
    assert all(robot.destination is None for robot in others)
    before = robots[3].position
    environment.step(idle(environment))
    robot = environment.simulation.world.robots[3]
    assert robot.destination.tolist() == [5.0, -10.0]
    assert not np.array_equal(robot.position, before)


@pytest.mark.paper("C5", "chosen")
def test_an_action_in_float32_names_a_point_exactly():
    """To four decimals of a metre, such as a strategy may name."""
    building = shipped("paper")
    spot = to_normalised(building, np.array([0.1234, -4.5678])).astype(np.float32)
    assert destination(building, spot) == (0.1234, -4.5678)


@pytest.mark.paper("C6")
def test_an_action_near_a_stairwell_means_the_stairwell():
    """It lies outside the main body, but its middle can be chosen by Eq. 1."""
    environment = game("paper")
    well = environment.building.stairwells[0]
    spot = to_normalised(environment.building, np.array(well.centre))
    assert np.abs(spot).max() > 1
    environment.step(idle(environment) | {"robot_2": spot})
    robot = environment.simulation.world.robots[2]
    assert robot.destination.tolist() == list(well.centre)
    assert robot.says in well.entrances[1]


class Noted:
    """A strategy that notes what another decides: destinations by body."""

    def __init__(self, name):
        self.strategy = ROBOTS[name]()
        self.decisions = []

    def decide(self, world, robots, rng):
        """What the other decides."""
        answers = self.strategy.decide(world, robots, rng)
        bodies = [robot.body - len(world.bodies) for robot in robots]
        self.decisions.append(dict(zip(bodies, answers, strict=True)))
        return answers


@pytest.mark.paper("C7")
@pytest.mark.parametrize("name", ["patrol", "sweep", "random"])
def test_a_strategys_decisions_played_as_actions_give_the_strategys_run(name):
    """A model and an algorithm are interchangeable; float32 is enough."""
    environment = game("paper", people=6, fire="random", seed=2, time_limit=40)
    building = environment.building
    scene = environment.simulation.scenario
    scripted = Simulation(building, scene, Noted(name), RandomFire(), seed=2)
    scripted.run()
    for decided in scripted.robot_strategy.decisions:
        actions = idle(environment)
        for k, where in decided.items():
            if where is not None:
                spot = to_normalised(building, np.array(where))
                actions[f"robot_{k}"] = spot.astype(np.float32)
        environment.step(actions)
    assert environment.simulation.done
    ours = environment.simulation.events
    theirs = scripted.events
    assert [type(event) for event in ours] == [type(event) for event in theirs]
    assert [event.time for event in ours] == [event.time for event in theirs]
    assert group_reward(ours) == pytest.approx(group_reward(theirs))


# -- The fire's action --------------------------------------------------------------


def ablaze(environment, floor=0):
    """The fire asks for a free cell in the middle of a room of a floor."""
    room = max(environment.building.rooms(floor), key=lambda area: area.size)
    row, col = room.cells[len(room.cells) // 2].tolist()
    x, y = environment.building.metres(row, col)
    spot = to_normalised(environment.building, np.array([x, y]))
    share = (2 * floor + 1) / environment.building.floors - 1
    return idle(environment) | {FIRE: np.float32([share, *spot])}


def asked(environment):
    """What has become of the fire's decisions."""
    return events_of(environment.simulation, FireLit | FireRefused)


@pytest.mark.paper("D2")
def test_the_fires_action_is_read_at_every_fifth_decision():
    """From the third on: numbers 2, 7, 12, ..., and infos say so a step before."""
    environment = game("paper", people=4)
    environment.simulation.world.bodies.pace[:] = 0  # nobody gets out
    read = []
    told = []
    for number in range(13):
        before = len(asked(environment))
        infos = environment.step(ablaze(environment))[-1]
        read += [number] * (len(asked(environment)) - before)
        told += [number + 1] * int(infos[FIRE]["acts"])
    assert read == told == [2, 7, 12]
    first, *others = asked(environment)
    assert isinstance(first, FireLit)
    assert first.time == 10.0
    assert all(isinstance(event, FireRefused) for event in others)  # it burns there


@pytest.mark.paper("D2", "deviation")
@pytest.mark.parametrize(
    ("number", "floor"), [(-1, 0), (-0.34, 0), (-0.3, 1), (0.3, 1), (0.34, 2), (1, 2)]
)
def test_the_fires_first_number_is_the_floor(number, floor):
    """Thirds of [-1, 1] for three floors; the others are x and y."""
    environment = game("paper", people=1)
    actions = idle(environment)
    for _ in range(3):
        environment.step(actions | {FIRE: [number, 0.26, -0.51]})
    (event,) = asked(environment)
    assert (event.floor, event.x, event.y) == (floor, 5.5, -10.5)


@pytest.mark.paper("D2", "deviation")
@pytest.mark.parametrize("storeys", range(1, 9))
def test_a_floor_s_share_goes_from_its_lower_edge_up_to_the_next_floor_s(storeys):
    """All shares are equal, however many there are; the last one has both edges."""
    building = built("\n\n".join(["#....E"] * storeys))

    def floor(number):
        chosen, _, _ = fire_decision(building, np.array([number, 0.0, 0.0]))
        return chosen

    edges = 2 * np.arange(1, storeys) / storeys - 1
    assert [floor(edge - 1e-9) for edge in edges] == list(range(storeys - 1))
    assert [floor(edge + 1e-9) for edge in edges] == list(range(1, storeys))
    assert (floor(-1.0), floor(1.0)) == (0, storeys - 1)
    if storeys <= 5:  # from six on an edge itself may be rounded down
        assert [floor(edge) for edge in edges] == list(range(1, storeys))


def test_a_fire_without_sources_never_acts_again():
    """It stays to the end, for its rewards go on."""
    environment = game("paper", people=4, sources=1)
    environment.simulation.world.bodies.pace[:] = 0
    told = [environment.step(ablaze(environment)) for _ in range(12)]
    acts = [step[-1][FIRE]["acts"] for step in told]
    assert sum(acts) == 1 and acts[1] == 1
    assert FIRE in environment.agents


# -- Rewards ------------------------------------------------------------------------


@pytest.fixture(scope="module")
def paid():
    """An episode of 20 people in the paper's building, and what each step paid."""
    environment = game("paper", people=20, time_limit=90)
    _, *steps = episode(environment, 6, actions=6)
    return environment, [step[1] for step in steps]


@pytest.mark.paper("E5")
def test_every_robot_is_paid_what_the_group_earns(paid):
    """Step by step what the events are worth; the sum is the episode's reward."""
    environment, steps = paid
    group = [{step[agent] for agent in step if agent != FIRE} for step in steps]
    assert len(group) == 18  # in 90 seconds
    assert max(map(len, group)) == 1
    earned = group_reward(environment.simulation.events)
    assert sum(map(sum, group)) == pytest.approx(earned)


@pytest.mark.paper("D2", "chosen")
@pytest.mark.paper("D6")
def test_the_fire_is_paid_what_the_robots_lose_less_its_penalties(paid):
    """A refused fire costs it something, in training."""
    environment, steps = paid
    events = environment.simulation.events
    total = sum(step[FIRE] for step in steps)
    assert total == pytest.approx(fire_reward(events))
    assert any(isinstance(event, FireRefused) for event in events)
    assert total < -group_reward(events)


# -- Who leaves, and how it ends ----------------------------------------------------


@pytest.mark.paper("C8")
def test_a_robot_leaves_when_its_floor_and_all_above_are_empty():
    """With a last observation and reward; the others go on."""
    environment = game("paper", people=12)
    gone(environment, 2)
    seen, rewards, terminations, truncations, infos = environment.step(
        idle(environment)
    )
    assert [a for a in terminations if terminations[a]] == ["robot_4", "robot_5"]
    assert not any(truncations.values())
    for told in (seen, rewards, infos):
        assert {"robot_4", "robot_5"} <= told.keys()
    assert infos["robot_4"]["acts"] == 0
    assert environment.agents == ["robot_0", "robot_1", "robot_2", "robot_3", FIRE]
    seen, *_ = environment.step(idle(environment) | {"robot_4": "ignored"})
    assert "robot_4" not in seen


def test_when_nobody_is_inside_all_who_are_there_are_terminated():
    """At once, in the middle of a step too; a step then is empty until a reset."""
    environment = game("paper", people=12)
    gone(environment, 0, 1, 2)
    _, _, terminations, truncations, infos = environment.step(idle(environment))
    assert all(terminations.values())
    assert not any(truncations.values())
    assert list(terminations) == environment.possible_agents
    assert {info["acts"] for info in infos.values()} == {0.0}
    assert environment.step({}) == ({}, {}, {}, {}, {})
    environment.reset()
    assert environment.agents == environment.possible_agents


def test_when_time_is_up_all_who_have_work_are_truncated():
    """A robot whose floor has emptied in this very step is terminated; nobody acts."""
    environment = game("paper", people=12, time_limit=12)
    for _ in range(2):
        environment.step(idle(environment))
    gone(environment, 2)
    _, _, terminations, truncations, infos = environment.step(idle(environment))
    robots = observations.robots_at_work(environment.simulation.world).tolist()
    at_work = {**dict(zip(truncations, robots, strict=False)), "fire_0": True}
    assert 0 < sum(robots) < len(robots)
    assert truncations == at_work
    assert terminations == {agent: not works for agent, works in at_work.items()}
    assert {info["acts"] for info in infos.values()} == {0.0}
    assert environment.simulation.world.time == pytest.approx(12)
    assert environment.agents == []


# -- Seeds --------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["tiny", "museum"])
def test_the_same_seed_and_actions_give_the_same_episode_to_the_end(name):
    """Observations, rewards, ends, infos: in two environments, and in one again."""
    said = {"people": 12, "time_limit": 30}
    one = game(name, **said)
    other = game(name, **said, seed=8)
    first = episode(one, seed=3)
    assert len(first) > 5
    assert same(first, episode(other, seed=3))
    assert same(first, episode(one, seed=3))


def test_a_scripted_side_begins_anew_in_every_episode():
    """Also one that is given as an object and remembers its round."""
    patrol = Patrol()
    environment = game(robots=patrol, time_limit=20)
    first = episode(environment, seed=3)
    assert same(first, episode(environment, seed=3))
    assert vars(patrol) == vars(Patrol())


def test_resets_without_a_seed_follow_from_the_last_one_given():
    """As gymnasium's environments do: another episode each, the same series again.

    Without any seed every environment is another.
    """
    environment = game()

    def series():
        told = [environment.reset(seed) for seed in (7, None, None, None)]
        return [seen[FIRE]["vector"] for seen, _ in told]

    one = series()
    other = series()
    assert same(one, other)
    assert not any(np.array_equal(a, b) for a, b in pairwise(one))
    fresh = Environment(shipped("tiny")), Environment(shipped("tiny"))
    seen = [environment.reset()[0][FIRE]["vector"] for environment in fresh]
    assert not np.array_equal(*seen)
