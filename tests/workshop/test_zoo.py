"""The wrapper for those who have PettingZoo: its own suites, and whole episodes."""

import subprocess
import sys

import numpy as np
import pytest
from alike import same
from movies import shipped, turns

from reference.game.environment import FIRE, Environment
from reference.paper import Scenario

pytest.importorskip("pettingzoo", reason="the extra pettingzoo is not installed")

from gymnasium import spaces
from pettingzoo import ParallelEnv
from pettingzoo.test import parallel_api_test, parallel_seed_test, render_test

from reference.strategies import RandomFire
from reference.workshop import zoo
from reference.workshop.strategies.fires import GreedyFire
from reference.workshop.strategies.robots import Sweep

pytestmark = pytest.mark.extra
SCENE = Scenario(people=6, training=True)
SIDES = [{}, {"robots": Sweep()}, {"fire": RandomFire()}]


def made(**chosen):
    """A small environment as PettingZoo has it."""
    return zoo.parallel_env(shipped("tiny"), SCENE, **chosen)


@pytest.mark.parametrize("sides", SIDES)
def test_pettingzoos_test_of_the_parallel_api_passes(sides):
    """Its warnings are errors here; whole episodes, for it never needs 60 cycles."""
    parallel_api_test(made(**sides), num_cycles=60)


@pytest.mark.parametrize("sides", SIDES)
def test_pettingzoos_test_of_seeds_passes(sides):
    """Two environments with the same seeds."""
    parallel_seed_test(lambda: made(**sides), num_cycles=60)


def test_pettingzoos_test_of_pictures_passes():
    """Through its conversion to agents that act in turn."""
    render_test(
        lambda render_mode: zoo.env(shipped("tiny"), SCENE, None, None, render_mode)
    )


@pytest.mark.parametrize("sides", SIDES)
def test_whole_episodes_are_the_same_with_and_without_pettingzoo(sides):
    """Same seed, same actions: every observation, reward and flag to the end."""
    wrapped, bare = made(**sides), Environment(shipped("tiny"), SCENE, **sides)
    ours, theirs = bare.reset(5), wrapped.reset(5)
    rng, steps = np.random.default_rng(0), 0
    for _ in turns(bare):
        assert same(ours[:-1], theirs[:-1]) and wrapped.agents == bare.agents
        for agent, info in ours[-1].items():
            assert theirs[-1][agent].items() >= info.items()
        actions = {
            agent: rng.uniform(-1, 1, wrapped.action_space(agent).shape)
            for agent in bare.agents
        }
        ours, theirs, steps = bare.step(actions), wrapped.step(actions), steps + 1
    assert same(ours[:-1], theirs[:-1]) and wrapped.agents == [] and steps > 5


def test_it_is_one_of_pettingzoos_with_gymnasiums_spaces():
    """Observations are in them to the end, and their samples can be played."""
    environment = made()
    assert isinstance(environment, ParallelEnv)
    seen, _ = environment.reset(seed=1)
    assert environment.num_agents == environment.max_num_agents == 5
    for _ in turns(environment.environment):
        for agent, numbers in seen.items():
            assert environment.observation_space(agent).contains(numbers)
        seen, *_ = environment.step(
            {a: environment.action_space(a).sample() for a in environment.agents}
        )
    for agent in environment.possible_agents:
        space = environment.observation_space(agent)
        assert isinstance(space, spaces.Dict)
        assert space is environment.observation_space(agent)
        assert environment.action_space(agent) is environment.action_space(agent)
        assert all(box.dtype == np.float32 for box in space.values())
        assert environment.action_space(agent).shape == (
            (3,) if agent == FIRE else (2,)
        )


def test_infos_tell_how_the_episode_stands():
    """In the end the same as the simulation's outcome, all of it floats."""
    environment = made(robots=Sweep())
    _, infos = environment.reset(seed=2)
    names = infos[FIRE].keys()
    for _ in turns(environment.environment):
        *_, infos = environment.step({FIRE: np.zeros(3)})
        assert infos[FIRE].keys() == names
        assert all(type(number) is float for number in infos[FIRE].values())
    outcome, info = environment.environment.simulation.outcome(), infos[FIRE]
    assert (info["evacuated"], info["died"]) == (outcome.evacuated, outcome.died)
    assert info["reward"] == outcome.reward and info["acts"] == 0


def test_the_same_seeds_sample_the_same_actions():
    """Every agent has a space of its own."""
    one, other = made(), made()
    for environment in (one, other):
        for k, agent in enumerate(environment.possible_agents):
            environment.action_space(agent).seed(k)
    for agent in one.possible_agents:
        sample = one.action_space(agent).sample()
        assert np.array_equal(sample, other.action_space(agent).sample())


def test_a_building_may_be_named():
    """So that a framework's registry needs no more than words."""
    environment = zoo.parallel_env("museum", fire=GreedyFire())
    assert environment.environment.building.title == shipped("museum").title


def test_refuses_to_be_imported_without_pettingzoo():
    """And says how to get it, and how to do without."""
    code = "import sys; sys.modules['pettingzoo'] = None; import reference.workshop.zoo"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 1
    message = done.stderr.split("ImportError: ")[-1]
    assert message.startswith("pettingzoo is not installed, and reference.workshop.zoo")
    assert "pip install pettingzoo gymnasium" in message
    assert "reference.game.environment" in message


def test_a_picture_is_a_frame_of_the_film():
    """Bytes, the same after the same seed, and another one a step later."""
    environment = made(robots=Sweep())
    environment.reset(seed=1)
    before = environment.render()
    environment.step({FIRE: np.zeros(3)})
    assert not np.array_equal(environment.render(), before)
    environment.reset(seed=1)
    assert np.array_equal(environment.render(), before)
    assert before.dtype == np.uint8 and before.shape[1:] == (1100, 3)


def test_a_picture_before_the_first_episode_shows_its_building():
    """Everybody is still inside."""
    before = made(robots=Sweep())
    assert before.render().shape[1:] == (1100, 3)
    assert [count.inside for count in before._history] == [SCENE.people]


def test_refuses_a_kind_of_picture_there_is_not():
    """There is one."""
    environment = zoo.ZooEnvironment("tiny", render_mode="human")
    with pytest.raises(ValueError, match="no render_mode 'human'; there is rgb_array"):
        environment.render()
    assert environment.metadata["render_modes"] == ["rgb_array"]
