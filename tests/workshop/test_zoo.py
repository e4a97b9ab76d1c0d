"""The wrapper for those who have PettingZoo: its own suites, and whole episodes."""

import pickle
from dataclasses import replace

import numpy as np
import pytest
from alike import same
from movies import shipped, turns

from reference.game.environment import FIRE, Environment
from reference.paper import Scenario

pytest.importorskip("pettingzoo", reason="the extra pettingzoo is not installed")

from pettingzoo import ParallelEnv
from pettingzoo.test import (
    parallel_api_test,
    parallel_seed_test,
    render_test,
    state_test,
)
from pettingzoo.utils import parallel_to_aec

from reference.fire import RandomFire
from reference.workshop import engine, zoo
from reference.workshop.strategies.guides import Sweep
from reference.workshop.strategies.trained import FlatRobots

pytestmark = pytest.mark.extra
SCENE = Scenario(people=6, training=True)
SIDES = [
    {},
    {"robots": Sweep()},
    {"fire": RandomFire()},
    {"robots": "none"},
    {"flat": True},
    {"fire": "random", "flat": True},
]


def made(**chosen):
    """A small environment as PettingZoo has it."""
    return zoo.parallel_env(shipped("tiny"), SCENE, **chosen)


def random_actions(environment, rng):
    """An action for each agent that is there."""
    spaces = {agent: environment.action_space(agent) for agent in environment.agents}
    return {agent: rng.uniform(-1, 1, space.shape) for agent, space in spaces.items()}


@pytest.mark.parametrize("sides", SIDES)
def test_pettingzoos_tests_of_the_parallel_api_and_of_seeds_pass(sides):
    """Warnings are errors here; whole episodes, for none needs 60 cycles."""
    parallel_api_test(made(**sides), num_cycles=60)
    parallel_seed_test(lambda: made(**sides), num_cycles=60)


@pytest.mark.parametrize("flat", [False, True])
def test_pettingzoos_tests_of_states_and_pictures_pass(flat):
    """For a central critic; through the conversion to agents that act in turn."""
    environment = made(flat=flat)
    modes = {"human": None}  # refused here, and asked for to read the modes only
    environment.reset(seed=1)
    state_test(parallel_to_aec(made(flat=flat)), environment)
    render_test(
        lambda render_mode: parallel_to_aec(
            made(render_mode=modes.get(render_mode, render_mode))
        )
    )


@pytest.mark.parametrize("sides", SIDES[:3])
def test_whole_episodes_are_the_same_with_and_without_pettingzoo(sides):
    """Same seed, same actions: every observation, reward and flag to the end."""
    wrapped = made(**sides)
    bare = Environment(shipped("tiny"), SCENE, **sides)
    assert isinstance(wrapped, ParallelEnv)
    ours = bare.reset(5)
    theirs = wrapped.reset(5)
    rng = np.random.default_rng(0)
    steps = 0
    for _ in turns(bare):
        assert same(ours[:-1], theirs[:-1]) and wrapped.agents == bare.agents
        for agent, info in ours[-1].items():
            assert theirs[-1][agent].items() >= info.items()
        for agent, seen in theirs[0].items():
            assert wrapped.observation_space(agent).contains(seen)
        actions = random_actions(wrapped, rng)
        ours = bare.step(actions)
        theirs = wrapped.step(actions)
        steps = steps + 1
    assert same(ours[:-1], theirs[:-1]) and wrapped.agents == [] and steps > 5


def test_the_engine_plays_from_one_decision_to_the_next():
    """Where numba is; also in what comes out of a pickle."""
    pytest.importorskip("numba")
    if not engine.engine_is_ready():
        pytest.skip("a rule has changed: see test_engine_mirrors")
    environment = made()
    environment.reset(seed=3)
    for _ in range(2):
        environment = pickle.loads(pickle.dumps(environment))
        environment.step(random_actions(environment, np.random.default_rng(1)))
        assert hasattr(environment.environment.simulation.world.minds, "arrays")


def test_infos_tell_how_the_episode_stands():
    """In the end the same as the simulation's outcome, all of it floats."""
    environment = made(robots=Sweep())
    _, infos = environment.reset(seed=2)
    names = infos[FIRE].keys()
    for _ in turns(environment.environment):
        *_, infos = environment.step({FIRE: np.zeros(3)})
        assert infos[FIRE].keys() == names
    assert {type(number) for number in infos[FIRE].values()} == {float}
    outcome = environment.environment.simulation.outcome()
    info = infos[FIRE]
    assert (info["evacuated"], info["died"]) == (outcome.evacuated, outcome.died)
    assert info["reward"] == outcome.reward and info["acts"] == 0


@pytest.mark.parametrize("flat", [False, True])
def test_how_an_episode_ended_is_read_through_wrappers_that_begin_the_next(flat):
    """They lay the infos of `reset` over the last step's, or take its keys for all."""
    environment = made(robots=Sweep(), flat=flat)
    for seed in (2, 3):
        _, begun = environment.reset(seed=seed)
        assert begun[FIRE].keys() == {"acts", *zoo.SO_FAR}
        for _ in turns(environment.environment):
            *_, infos = environment.step({FIRE: np.zeros(3)})
        assert infos[FIRE].keys() == begun[FIRE].keys()
        outcome = environment.environment.simulation.outcome()
        _, again = environment.reset()
        laid_over = infos[FIRE] | again[FIRE]
        for name in zoo.SO_FAR:
            assert laid_over[name] == getattr(outcome, name)


def test_copies_of_an_environment_that_was_never_reset_play_unlike_episodes():
    """As vector environments copy one; copies of one that was reset go on alike."""
    environment = made()
    copies = [pickle.loads(pickle.dumps(environment)) for _ in range(3)]
    begun = [each.reset()[0] for each in copies]
    assert not any(same(begun[0], other) for other in begun[1:])
    environment.reset(seed=1)
    copies = [pickle.loads(pickle.dumps(environment)) for _ in range(2)]
    assert same(*(each.reset()[0] for each in copies))


def test_the_chance_that_wrappers_ask_for_follows_from_the_seed():
    """`np_random`, which frame_skip_v0 draws from; it goes on in later episodes."""
    drawn = []
    for environment in (made(), made()):
        environment.reset(seed=4)
        first = environment.np_random.random(3).tolist()
        environment.reset()
        drawn.append((first, environment.np_random.random(3).tolist()))
    assert drawn[0] == drawn[1] and drawn[0][0] != drawn[0][1]


def test_supersuits_vectors_tell_how_episodes_ended_and_skip_frames():
    """With the library itself: an end is told, and chance is there to draw from."""
    supersuit = pytest.importorskip("supersuit", reason="SuperSuit is not installed")
    scene = replace(SCENE, time_limit=10.0)
    flat = zoo.parallel_env(shipped("tiny"), scene, fire="random", flat=True)
    skipping = supersuit.frame_skip_v0(flat, (1, 2))
    skipping.reset(seed=0)
    skipping.step({agent: np.zeros(2) for agent in skipping.agents})
    vector = supersuit.pettingzoo_env_to_vec_env_v1(flat)
    worlds = supersuit.concat_vec_envs_v1(vector, 2, num_cpus=1)
    worlds.reset(seed=0)
    for _ in range(2):
        *_, ended, cut, infos = worlds.step(np.zeros((worlds.num_envs, 2)))
    assert (ended | cut).all()
    for info in infos:
        assert info["simulated_seconds"] == 10
        assert info["evacuated"] + info["died"] + info["inside"] == SCENE.people


@pytest.mark.filterwarnings("ignore:PettingZoo in TorchRL is tested")
def test_torchrls_wrapper_plays_a_whole_episode():
    """With the library itself: its infos have the keys that it asks for."""
    libraries = pytest.importorskip("torchrl.envs.libs.pettingzoo")
    scene = replace(SCENE, time_limit=10.0)
    flat = zoo.parallel_env(shipped("tiny"), scene, fire="random", flat=True)
    wrapped = libraries.PettingZooWrapper(flat, use_mask=True, done_on_any=False)
    told = wrapped.rollout(10)
    assert len(told) == 2 and told["next", "robot", "info", "acts"].shape[:2] == (2, 4)


def moved(environment, seed):
    """What two further steps with the same random actions return."""
    rng = np.random.default_rng(seed)
    return [environment.step(random_actions(environment, rng)) for _ in range(2)]


@pytest.mark.parametrize("flat", [False, True])
def test_a_pickled_environment_goes_on_like_the_original(flat):
    """In the middle of an episode, whether or not it was drawn: for other processes."""
    environment = made(flat=flat)
    environment.reset(seed=3)
    moved(environment, 0)
    environment.render()
    copied = pickle.loads(pickle.dumps(environment))
    assert np.array_equal(copied.render(), environment.render())
    assert same(moved(copied, 1), moved(environment, 1))


def test_refuses_a_player_who_cannot_decide_here_and_a_mode_that_there_is_not():
    """At the door, not with the first decision or picture; a slip in a name is told."""
    with pytest.raises(ValueError, match="Did you mean 'sweep'"):
        made(robots="sweeep")
    elsewhere = FlatRobots(np.zeros_like, "museum", SCENE)
    with pytest.raises(ValueError, match="it has learned in Museum"):
        made(robots=elsewhere)
    with pytest.raises(ValueError, match=r"'human': there is None, \['rgb_array'\]"):
        made(render_mode="human")


def flat_episode(**rules):
    """The flat environment of the robots, and all that an episode of it returns."""
    scene = replace(SCENE, **rules)
    environment = zoo.parallel_env(shipped("tiny"), scene, fire="random", flat=True)
    seen, infos = environment.reset(seed=5)
    told = [(seen, {}, {}, {}, infos)]
    for _ in turns(environment.environment):
        actions = {a: np.zeros(environment.action_space(a).shape) for a in seen}
        told.append(environment.step(actions))
    return environment, told


def test_flat_observations_are_boxes_and_all_agents_end_together():
    """Robots of an empty floor have left: they see zeros and are paid nothing."""
    environment, told = flat_episode(people_per_floor=(6, 0))
    everybody = set(environment.possible_agents)
    for returned in told[1:]:
        assert all(set(part) == everybody for part in returned)
        for agent, numbers in returned[0].items():
            assert environment.observation_space(agent).contains(numbers)
    seen, rewards, *_ = told[2]
    gone = [agent for agent in everybody if not seen[agent].any()]
    assert len(gone) == 2 and all(rewards[agent] == 0 for agent in gone)
    ends = [set(ended.values()) | set(cut.values()) for _, _, ended, cut, _ in told[1:]]
    assert ends[:-1] == [{False}] * (len(told) - 2)
    *_, (_, _, ended, cut, _) = told
    assert {*ended.values(), *cut.values()} == {True, False}


def test_flat_rewards_are_shares_of_the_health_that_all_begin_with():
    """One that stayed to the end has been paid the outcome's reward, divided by it."""
    environment, told = flat_episode()
    outcome = environment.environment.simulation.outcome()
    paid = [sum(r[1].get(agent, 0) for r in told) for agent in told[0][0]]
    assert max(paid, key=abs) == pytest.approx(outcome.reward / (100 * SCENE.people))


def test_a_picture_is_a_frame_of_the_film():
    """Bytes, the same after the same seed, and another one a step later."""
    environment = made(robots=Sweep())
    assert environment.render().any()  # its building, before the first episode
    environment.reset(seed=1)
    before = environment.render()
    environment.step({FIRE: np.zeros(3)})
    assert not np.array_equal(environment.render(), before)
    environment.reset(seed=1)
    assert np.array_equal(environment.render(), before)
    assert before.dtype == np.uint8 and before.shape[1:] == (1100, 3)


# -- Mistakes -----------------------------------------------------------------------


def idle(environment):
    """Actions that change nothing: robots keep their destinations."""
    nothing = {agent: np.full(2, np.nan) for agent in environment.agents}
    return nothing | {FIRE: np.zeros(3)}


def test_refuses_a_step_before_the_first_reset_and_a_negative_seed():
    """And says what to do."""
    with pytest.raises(RuntimeError, match=r"call reset\(\)"):
        made().step({})
    for seed in (-1, "7", 1.5, True, [1]):
        with pytest.raises(ValueError, match=r"seed is .*: it must be a whole number"):
            made().reset(seed=seed)
    made().reset(seed=np.int64(7))


@pytest.mark.parametrize("flat", [False, True])
def test_a_step_after_the_end_tells_nothing_of_anybody(flat):
    """Five empty dicts, as PettingZoo has it."""
    environment = made(flat=flat, robots="none")
    environment.reset(seed=1)
    while environment.agents:
        environment.step(random_actions(environment, np.random.default_rng(1)))
    assert environment.step({}) == ({}, {}, {}, {}, {})


def test_refuses_actions_that_are_no_mapping():
    """A list or an array, as vector environments take; it says what to give."""
    environment = made()
    environment.reset(seed=1)
    for actions in ([np.zeros(2)] * 5, np.zeros((5, 2)), None):
        with pytest.raises(ValueError, match="give a dict with an action for each"):
            environment.step(actions)


@pytest.mark.parametrize(
    "action",
    [
        [0.0],
        [0.0, 0.0, 0.0],
        [[0.0, 0.0]],
        1.0,
        "east",
        None,
        [np.nan, 0],
        [np.inf, 0],
        np.zeros(2, complex),
    ],
)
def test_refuses_an_action_that_is_none_by_the_name_of_the_agent(action):
    """Too few numbers, too many, no numbers; and the fire has no old one to keep."""
    environment = made()
    environment.reset(seed=1)
    with pytest.raises(ValueError, match="robot_2: an action is 2 numbers"):
        environment.step(idle(environment) | {"robot_2": action})
    with pytest.raises(ValueError, match="fire_0: an action is 3 numbers"):
        environment.step(idle(environment) | {FIRE: np.full(3, np.nan)})


def test_refuses_a_missing_action_by_the_name_of_the_agent():
    """Nothing has happened then, and the step can be taken again."""
    environment = made()
    environment.reset(seed=1)
    actions = idle(environment)
    del actions["robot_3"]
    with pytest.raises(ValueError, match="robot_3 is still there, but has no action"):
        environment.step(actions)
    inside = environment.environment
    assert inside.simulation.ticks == 0
