"""Checkpoints: whole or not at all, refused elsewhere, and used as strategies."""

import os
from copy import deepcopy
from dataclasses import replace
from functools import reduce
from zipfile import ZipFile

import numpy as np
import pytest
import torch
from movies import shipped
from trainings import begun, equal, room_for, tiny

from reference import paper
from reference.fire import RandomFire
from reference.game.codec import Moment, decision_in
from reference.game.environment import AgentRobots, until_next_decision
from reference.learning.rollouts import play
from reference.paper import InputError, Scenario
from reference.robots import NoRobots
from reference.simulation import Simulation
from reference.workshop.comparing.named import strategy_named
from reference.workshop.strategies import LEARNED
from reference.workshop.training import checkpoints
from reference.workshop.training.checkpoints import (
    CheckpointError,
    keep_checkpoint,
    load_checkpoint,
    newest_checkpoint,
    save_checkpoint,
    state_of,
)
from reference.workshop.training.policies import LearnedFire, LearnedRobots
from reference.workshop.training.rounds import Training
from reference.workshop.training.starting import resume_training
from reference.world import FireLit


@pytest.fixture(scope="module")
def checkpoint():
    """A training that has just begun; its networks are as they are made."""
    return begun(seed=3).checkpoint()


@pytest.fixture
def path(checkpoint, tmp_path):
    """The file of that checkpoint."""
    save_checkpoint(checkpoint, tmp_path / "own.pt")
    return tmp_path / "own.pt"


# -- Files --------------------------------------------------------------------------


def test_what_is_read_is_what_was_written(checkpoint, path):
    """Settings, who plays, networks, optimisers and random states, to the last bit."""
    read = load_checkpoint(path)
    assert read.task == checkpoint.task
    assert (read.round, read.version) == (checkpoint.round, checkpoint.version)
    assert equal(read.learners, checkpoint.learners)
    assert equal(read.progress, checkpoint.progress)


def test_networks_that_are_fixed_or_begun_with_are_in_the_file_too(
    checkpoint, tmp_path
):
    """So that a training needs nothing beside its folder to go on."""
    robots = checkpoint.player("robots")
    fire = checkpoint.player("fire")
    training = begun(fixed={"fire": (fire,)}, initial={"robots": robots})
    save_checkpoint(training.checkpoint(), tmp_path / "own.pt")
    task = load_checkpoint(tmp_path / "own.pt").task
    for read, who in (*task.fixed["fire"], fire), (task.initial["robots"], robots):
        assert read.settings == who.settings
        assert equal(read.weights, who.weights)


def test_learners_of_your_own_loop_are_written_by_what_state_of_gives(
    checkpoint, tmp_path
):
    """No league has kept versions of them."""
    learners = {side: state_of(who) for side, who in begun(seed=3).learners.items()}
    save_checkpoint(replace(checkpoint, learners=learners), tmp_path / "own.pt")
    read = load_checkpoint(tmp_path / "own.pt")
    assert equal(read.learners, checkpoint.learners)
    assert equal(Training.resumed(read).checkpoint().learners, checkpoint.learners)


def test_a_training_does_not_go_on_in_the_checkpoint_that_it_resumed(tmp_path):
    """Another one can go on from there too; an optimiser's moments are its own."""
    training = begun()
    training.learn([e for job in training.jobs() for e in play(job)])
    save_checkpoint(training.checkpoint(), tmp_path / "own.pt")
    read = load_checkpoint(tmp_path / "own.pt")
    before = deepcopy(read.learners)
    resumed = Training.resumed(read)
    resumed.learn([e for job in resumed.jobs() for e in play(job)])
    assert not equal(resumed.checkpoint().learners, before)
    assert equal(read.learners, before)


def test_only_checkpoints_of_the_rounds_named_are_kept(checkpoint, tmp_path):
    """Others' files stay; a folder stands for its newest, even the millionth."""
    (tmp_path / "mine.pt").write_text("my own")
    for number in (2, 999_999, 1_000_000):
        keep_checkpoint(replace(checkpoint, round=number), tmp_path, [999_999])
    names = ["checkpoint-1000000.pt", "checkpoint-999999.pt", "mine.pt"]
    assert sorted(p.name for p in tmp_path.iterdir()) == names
    assert load_checkpoint(tmp_path).round == 1_000_000


@pytest.mark.parametrize("name", ["checkpoint-000000-good", "checkpoint-000012 (1)"])
def test_a_copy_beside_the_checkpoints_is_nobody_s_newest(name, checkpoint, tmp_path):
    """It is not resumed from, and stays."""
    copy = tmp_path / f"{name}.pt"
    save_checkpoint(checkpoint, copy)
    assert newest_checkpoint(tmp_path) is None
    for number in (3, 4):
        kept = keep_checkpoint(replace(checkpoint, round=number), tmp_path)
        assert newest_checkpoint(tmp_path) == kept
    assert copy.exists() and load_checkpoint(tmp_path).round == 4


def test_a_full_disk_leaves_the_last_good_checkpoint_as_it_was(checkpoint, path):
    """And nothing half-written beside it; the message says what to do."""
    before = path.read_bytes()
    with room_for(1000), pytest.raises(OSError, match=r"cannot be written.*Make room"):
        save_checkpoint(replace(checkpoint, round=1), path)
    assert path.read_bytes() == before
    assert list(path.parent.iterdir()) == [path]


# -- Refusals -----------------------------------------------------------------------


@pytest.mark.parametrize("part", [0.0, 0.5, 0.98])
def test_refuses_a_file_that_was_cut_off_or_has_a_wrong_bit(path, part):
    """Torch does not look at the archive's check sums; we do."""
    content = path.read_bytes()
    end = int(len(content) * part)
    odd = bytearray(content)
    odd[end // 2] ^= 16
    for damaged in (content[:end], odd):
        path.write_bytes(damaged)
        with pytest.raises(CheckpointError, match=r"own\.pt: is damaged"):
            load_checkpoint(path)


def test_a_folder_whose_newest_is_damaged_has_one_before_it(checkpoint, tmp_path):
    """Whoever deletes the damaged one goes on from there; so it is told by its name."""
    for number in (999_999, 1_000_000):
        save_checkpoint(checkpoint, tmp_path / f"checkpoint-{number:06}.pt")
    newest = tmp_path / "checkpoint-1000000.pt"
    newest.write_bytes(newest.read_bytes()[:100])
    told = r"checkpoint-1000000\.pt: is damaged.* Delete it, and checkpoint-999999\.pt"
    for path in (tmp_path, newest):
        with pytest.raises(CheckpointError, match=told):
            load_checkpoint(path)
    newest.unlink()
    assert load_checkpoint(tmp_path).task == checkpoint.task


def test_names_that_recur_are_kept_once_and_take_no_room(checkpoint, path):
    """As those of weights in earlier versions: what is read is longer than the file."""
    content = torch.load(path, weights_only=True)
    name = "weight" * 1_000
    content["more"] = [name] * (path.stat().st_size // (2 * len(name)))
    torch.save(content, path)
    assert load_checkpoint(path).task == checkpoint.task


NAN = {"weight": torch.tensor([0.0, torch.nan])}
HALF = {"weight": torch.zeros(2, dtype=torch.float16)}
NARROW = {"weight": torch.zeros(2)}
VAST = {"weight": torch.zeros(1).expand(10**6, 10**6)}
SHARED = reduce(lambda inner, _: [inner, inner], range(20), [])
HOLE = "building: x\nsize: 4 x 3\nfloor 1:\n####\n#..E\n#.##\n"


@pytest.mark.parametrize(
    ("place", "value", "message"),
    [
        ("kind", "something else", "is no checkpoint"),
        ("format", 10, "and format 10, written by version .*; here they are"),
        ("game", 1, "is of game 1 and"),
        ("task", {}, "lacks a part"),
        ("task settings robots batch_size", -1, "batch_size"),
        ("task settings robots gamma", 10**400, "gamma is 10+: it must be a number"),
        ("learners robots actor", NAN, "no finite numbers"),
        ("learners fire optimiser", NAN, "no finite numbers"),
        ("learners robots actor", HALF, "weights of another type, torch.float16"),
        ("learners robots optimiser", VAST, "parts far larger than the file"),
        ("learners robots versions", {0: NARROW}, "of another shape, of round 0"),
        ("learners fire versions", {0: {}}, "of another shape, of round 0"),
        ("learners fire versions", {-1: {}}, "a version of round -1"),
        ("learners fire versions", {"0": {}}, "a version of round 0"),
        ("more", SHARED, "parts far larger than the file"),
        ("task plan", HOLE, "there is a hole in the outer wall"),
        ("task plan", HOLE.replace("4 x 3", "9000 x 300"), "1 to 200 columns"),
    ],
)
def test_refuses_content_that_is_not_a_checkpoint_s(path, place, value, message):
    """By what is odd; nothing of torch or Python shows."""
    content = torch.load(path, weights_only=True)
    *names, last = place.split()
    inner = content
    for name in names:
        inner = inner[name]
    inner[last] = value
    torch.save(content, path)
    with pytest.raises(CheckpointError, match=message):
        load_checkpoint(path)


def test_refuses_a_file_of_torch_s_older_kind_with_an_archive_behind_it(path):
    """The archive's check sums would be looked at, the older kind be read."""
    with ZipFile(path.with_suffix(".zip"), "w") as archive:
        archive.writestr("room", bytes(path.stat().st_size))
    content = torch.load(path, weights_only=True)
    torch.save(content, path, _use_new_zipfile_serialization=False)
    with path.open("ab") as file:
        file.write(path.with_suffix(".zip").read_bytes())
    with pytest.raises(CheckpointError, match="is damaged, or is no checkpoint"):
        load_checkpoint(path)


@pytest.mark.parametrize("content", [torch.zeros(3), [1, 2], "words"])
def test_refuses_what_torch_saved_and_is_no_mapping(content, tmp_path):
    """Without a warning: a tensor cannot be asked for a word."""
    torch.save(content, tmp_path / "x.pt")
    with pytest.raises(CheckpointError, match="is no checkpoint"):
        load_checkpoint(tmp_path / "x.pt")


def test_refuses_to_run_code_that_a_file_brings(tmp_path):
    """Loading is `weights_only`: not even a function's name is looked up."""
    torch.save({"kind": checkpoints.KIND, "task": os.mkdir}, tmp_path / "x.pt")
    with pytest.raises(CheckpointError, match="is no checkpoint"):
        load_checkpoint(tmp_path / "x.pt")


@pytest.mark.parametrize(
    ("part", "value"),
    [
        ("episodes", -(10**400)),
        ("latest", {"survival": "x"}),
        ("latest", {"group_reward": 1.0}),
        ("summaries", {"robots": {"last": 0, "sums": {"x": 1.0}, "counts": {"x": 1}}}),
    ],
)
def test_refuses_progress_that_is_none(checkpoint, part, value, tmp_path):
    """When a training is to go on, not rounds later."""
    odd = replace(checkpoint, progress=checkpoint.progress | {part: value})
    save_checkpoint(odd, tmp_path / "checkpoint-000001.pt")
    with pytest.raises(CheckpointError, match="its parts do not fit each other"):
        resume_training(tmp_path)


def test_refuses_networks_of_another_shape(checkpoint):
    """Before anything is played."""
    wider = replace(checkpoint.task, settings=tiny(robots={"hidden_units": 16}))
    other = replace(checkpoint, task=wider)
    with pytest.raises(CheckpointError, match="its network does not fit its settings"):
        LearnedRobots(other)
    with pytest.raises(CheckpointError, match=r"made by version 0\.1\.2, "):
        LearnedRobots(replace(other, version="0.1.2"))


def test_refuses_to_go_on_with_moments_of_another_shape(checkpoint):
    """An optimiser takes them as they are; they would be added to every weight."""
    training = begun(seed=3)
    training.learn([e for job in training.jobs() for e in play(job)])
    odd = deepcopy(training.checkpoint())
    moments = odd.learners["robots"]["optimiser"]["state"][0]
    moments["exp_avg"] = moments["exp_avg"].reshape(-1)[:1]
    with pytest.raises(ValueError, match="moments of another shape"):
        Training.resumed(odd)


@pytest.fixture(scope="module")
def waiting():
    """A training whose robots wait for more decisions before they update."""
    training = begun(tiny(robots={"buffer_size": 200}))
    training.learn([e for job in training.jobs() for e in play(job)])
    return training.checkpoint()


@pytest.mark.parametrize(
    ("column", "change"),
    [
        ("actions", lambda x: x[..., :1]),
        ("vectors", lambda x: x[..., 1:]),
        ("vectors", lambda x: x.double()),
        ("alive", lambda x: x.float()),
        ("returns", lambda x: x * torch.nan),
        ("returns", lambda x: x.double()),
        ("advantages", lambda x: x[:, :2]),
        ("log_probs", lambda x: x[1:]),
    ],
)
def test_refuses_to_go_on_from_decisions_of_another_kind(waiting, column, change):
    """When a training is to go on, not at its next update."""
    odd = deepcopy(waiting)
    assert Training.resumed(odd).learners["robots"].buffer
    part = odd.learners["robots"]["buffer"][-1]
    part[column] = change(part[column])
    with pytest.raises((ValueError, RuntimeError, IndexError, TypeError)):
        Training.resumed(odd)


def test_refuses_to_go_on_with_an_optimiser_that_lacks_a_row(waiting):
    """Torch would miss it at the next update."""
    odd = deepcopy(waiting)
    del odd.learners["fire"]["optimiser"]["param_groups"][0]["eps"]
    with pytest.raises(ValueError, match="without all of its rows"):
        Training.resumed(odd)


def test_refuses_to_go_on_against_a_network_of_another_shape(checkpoint):
    """When a training is to go on, not in a worker."""
    fire = checkpoint.player("fire")
    other = replace(fire, settings=tiny(fire={"hidden_units": 16}).fire)
    odd = begun(fixed={"fire": (other,)}).checkpoint()
    with pytest.raises(RuntimeError, match="size mismatch"):
        Training.resumed(odd)


@pytest.mark.parametrize(
    ("fixed", "message"),
    [
        ({"fire": ("gredy",)}, "fire 'gredy' is unknown. Did you mean 'greedy'"),
        ({"fire": ()}, "nobody plays fire"),
        ({"fir": ("greedy",)}, "nobody plays fir"),
    ],
)
def test_refuses_to_go_on_against_a_player_that_is_not_there(
    fixed, message, checkpoint
):
    """Such as a fire of one's own that has another name now."""
    odd = replace(checkpoint, task=replace(checkpoint.task, fixed=fixed))
    with pytest.raises(ValueError, match=message):
        Training.resumed(odd)


# -- A learned policy is a strategy -------------------------------------------------


OFFICE = shipped("tiny")
SMALL = tiny().scenario


@pytest.mark.paper("C5")
@pytest.mark.paper("C7")
@pytest.mark.paper("D2")
def test_learned_policies_play_both_sides_of_an_evacuation(path):
    """By file name, where a strategy's name would stand; same seed, same run."""
    robots = LearnedRobots(str(path))
    fire = LearnedFire(path)
    runs = [Simulation(OFFICE, SMALL, robots, fire, seed=5) for _ in range(2)]
    outcomes = [run.run() for run in runs]
    assert outcomes[0] == outcomes[1]
    assert runs[0].events == runs[1].events
    assert any(isinstance(event, FireLit) for event in runs[0].events)
    assert all(robot.destination is not None for robot in runs[0].world.robots)


def test_a_learned_strategy_does_what_its_network_would_do_as_an_agent(path):
    """Robots that are told the mean actions go the same ways."""
    policy = LearnedRobots(path)
    alone = Simulation(OFFICE, SMALL, policy, RandomFire(), seed=7)
    guided = Simulation(OFFICE, SMALL, AgentRobots(), RandomFire(), seed=7)
    while not guided.done:
        world = guided.world
        (vectors,) = policy.player.codec.observe([world])
        moment = Moment(vectors, np.ones(len(vectors), bool), world)
        (rows,), _ = policy.player.act([moment])
        guided.robot_strategy.chosen = list(map(decision_in, rows))
        until_next_decision([guided])
    assert alone.run() == guided.outcome()


def test_copies_of_a_simulation_share_the_network(path):
    """Look-ahead copies a simulation hundreds of times."""
    policy = LearnedRobots(path)
    assert deepcopy(policy) is policy
    simulation = Simulation(OFFICE, SMALL, policy, RandomFire(), seed=2)
    ahead = simulation.copy()
    assert ahead.run() == simulation.run()


def test_a_fire_that_learned_against_robots_can_burn_without_any(path):
    """It sees them as gone home."""
    simulation = Simulation(OFFICE, SMALL, NoRobots(), LearnedFire(path), seed=0)
    assert simulation.run().people == 6


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"people": 7}, "learned with people=6; here it is 7"),
        ({"robots_per_floor": 1}, "learned with robots_per_floor=2; here it is 1"),
        ({"decision_seconds": 1.0}, "learned with decision_seconds=5; here it is 1"),
    ],
)
def test_refuses_a_scenario_that_its_network_cannot_read(path, changes, message):
    """By what differs, before anything runs."""
    other = replace(SMALL, **changes)
    elsewhere = replace(SMALL, people_per_floor=(0, SMALL.people), time_limit=90.0)
    for policy in (LearnedRobots(path), LearnedFire(path)):
        with pytest.raises(InputError, match=message):
            policy.refuse_elsewhere(OFFICE, other)
        policy.refuse_elsewhere(OFFICE, elsewhere)  # the network reads the same


def test_a_policy_is_kept_until_its_file_or_a_number_is_another(tmp_path, monkeypatch):
    """It remembers nothing; where it plays elsewhere, that is kept, too."""
    path = tmp_path / "mine.pt"
    changes = {"head": "set"}
    settings = tiny(robots=changes, fire=changes)
    save_checkpoint(begun(settings, seed=1).checkpoint(), path)
    school = shipped("school")

    def made():
        policy = strategy_named(str(path), "robots")
        return policy, policy.playing_in(school, Scenario())

    first, there = made()
    assert made() == (first, there) and there.building is school
    assert strategy_named(str(path), "robots", sample=True).sample
    assert first.playing_in(school, Scenario(people=9)).scenario.people == 9

    second = begun(settings, seed=2).checkpoint()
    save_checkpoint(second, path)
    policy, there = made()
    assert not equal(policy.learned.weights, first.learned.weights)
    assert equal(there.learned.weights, second.player("robots").weights)

    monkeypatch.setattr(paper, "HEALTH", 50.0)
    assert not {policy, there} & {*made()}


def test_a_policy_of_your_own_class_is_never_kept():
    """It may remember something."""

    class Mine(LearnedRobots):
        """Counts."""

    home = Mine(LEARNED)
    school = shipped("school")
    one, other = (home.playing_in(school, Scenario()) for _ in range(2))
    assert one is not other and isinstance(one, Mine)


def test_refuses_a_side_that_nobody_learned(tmp_path):
    """The message names the strategy that stood there."""
    save_checkpoint(
        begun(fixed={"fire": ("greedy",)}).checkpoint(), tmp_path / "half.pt"
    )
    with pytest.raises(CheckpointError, match="Write --fire greedy"):
        LearnedFire(tmp_path / "half.pt")
