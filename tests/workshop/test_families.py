"""Trainings in families: which building a job plays in, and one buffer of all."""

import gc
from dataclasses import replace
from weakref import WeakSet

import numpy as np
import pytest
import torch
from trainings import TINY, equal, tiny, trained

from reference.__main__ import main
from reference.building import Kind, building_of
from reference.learning.experience import Decisions
from reference.learning.players import LearnedNetwork
from reference.learning.rollouts import Job
from reference.navigation import Navigation, navigation_of
from reference.paper import InputError, Scenario
from reference.workshop.maps import load, parse_map
from reference.workshop.maps.generated import generated_text
from reference.workshop.storage.records import SettingsError
from reference.workshop.storage.workers import workers
from reference.workshop.strategies import FIRES, ROBOTS
from reference.workshop.training.batches import (
    Ragged,
    averaged,
    joined_mixed,
    pieces_of,
    strips,
)
from reference.workshop.training.checkpoints import Task, load_checkpoint
from reference.workshop.training.families import (
    FIRST_SEED,
    Family,
    LotJob,
    family_of,
    job_in,
    plan_in,
    prepare,
)
from reference.workshop.training.loop import _play_in_family, run_training
from reference.workshop.training.rounds import ROUNDS, Training
from reference.workshop.training.summaries import SUMMARIES

HUT = """building: Hut
size: 12 x 7

floor 1: ground
############
#....#.....#
#....+.....E
#.a..#..b..#
#....+.....#
#....#.....#
############
"""
SMALL = Family(widths=(15, 18), heights=(10, 12), floors=(1, 2), people=(3, 9))
MAPS = Family(names=("tiny", "hut"), plans=(TINY, HUT))
FIXED = {"fire": ("random", "none")}


def begun(family, fixed=FIXED, imitate=None, **changes):
    """A small training in a family."""
    robots = {"head": "set"} | changes.pop("robots", {})
    settings = tiny(robots=robots, jobs_per_round=2, **changes)
    return Training(Task("some", "", settings, 3, fixed, {}, imitate, family))


def weights(training):
    """Of the robots' policy, as they are now."""
    state = training.learners["robots"].actor.state_dict()
    return {name: weight.clone() for name, weight in state.items()}


@pytest.fixture(scope="module")
def learner():
    """A learner whose buffer holds two maps; its advantages are random."""
    training = begun(MAPS)
    learner = training.learners["robots"]
    for job in training.jobs():
        episodes, _, _ = _play_in_family(job)
        learner.add([episode.robots for episode in episodes])
    for part in learner.buffer:
        part.advantages = torch.randn(part.advantages.shape, generator=learner.rng)
    return learner


# -- Batches of several buildings ---------------------------------------------------


@pytest.mark.paper("E3")
def test_a_loss_of_two_buildings_is_the_mean_over_their_decisions(learner):
    """Value, baseline, policy and entropy, as if all were read at once."""
    both = joined_mixed(learner.buffer)
    assert isinstance(both.vectors, Ragged)
    lives = [int(part.alive.sum()) for part in learner.buffer]
    assert int(both.alive.sum()) == sum(lives)
    found, parts = learner.loss(both, 0.2, 0.01)
    alone = [learner.loss(part, 0.2, 0.01) for part in learner.buffer]
    mean = sum(n * loss for n, (loss, _) in zip(lives, alone, strict=True)) / sum(lives)
    assert torch.allclose(found, mean, atol=1e-6)
    for name, part in parts.items():
        told = [n * p[name] for n, (_, p) in zip(lives, alone, strict=True)]
        assert torch.allclose(part, sum(told) / sum(lives), atol=1e-6)


@pytest.mark.paper("E3")
def test_the_order_of_buildings_means_nothing(learner):
    """Neither to a batch's loss, nor to what its rows hold."""
    one = joined_mixed(learner.buffer)
    other = joined_mixed(learner.buffer[::-1])
    assert torch.allclose(*(learner.loss(b, 0.2, 0.01)[0] for b in (one, other)))
    first = len(learner.buffer[0])
    turned = torch.cat([torch.arange(first, len(one)), torch.arange(first)])
    for _, mine in pieces_of(one.rows(turned)):
        shares = [
            theirs for _, theirs in pieces_of(other) if equal(vars(mine), vars(theirs))
        ]
        assert len(shares) == 1


def test_one_building_is_one_batch_as_in_the_book(learner):
    """The same columns, the same loss and the same order to the bit."""
    part = learner.buffer[0]
    same = joined_mixed([part, part])
    assert equal(vars(same), vars(Decisions.joined([part, part])))
    ((share, piece),) = pieces_of(same)
    assert share == 1 and piece is same
    loss = averaged(same, lambda batch: batch.values[batch.alive].mean())
    assert loss == same.values[same.alive].mean()
    generator = torch.Generator().manual_seed(1)
    order = torch.cat([*strips(same, 7, generator)])
    generator.manual_seed(1)
    assert order.equal(torch.randperm(len(same), generator=generator))


def test_strips_hold_every_row_once(learner):
    """Also where shapes differ."""
    both = joined_mixed(learner.buffer * 5)
    found = torch.cat([*strips(both, 7, torch.Generator())])
    assert sorted(found.tolist()) == [*range(len(both))]


def test_strips_of_two_buildings_are_mixed(learner):
    """A large batch holds rows of both."""
    both = joined_mixed(learner.buffer * 5)
    batches = [*strips(both, len(both) // 3, torch.Generator().manual_seed(0))]
    for which in batches[:3]:
        assert len(both.vectors.at[which, 0].unique()) == 2


# -- Which building a job plays in --------------------------------------------------


def lots(family, count, seed=5):
    """What the first jobs of a run draw."""
    job = Job("", Scenario(), ROBOTS["sweep"](), FIRES["none"](), (1,))
    return [job_in(family, seed, ROUNDS, number, job) for number in range(count)]


def test_every_job_of_random_has_a_new_building():
    """Within the ranges, the same for the same seed; people and robots vary too."""
    family = family_of(["random"], {})
    drawn = [job.lot for job in lots(family, 200)]
    assert drawn == [job.lot for job in lots(family, 200)]
    assert drawn[:9] != [job.lot for job in lots(family, 9, seed=6)]
    assert len({lot.seed for lot in drawn}) == 200
    assert min(lot.seed for lot in drawn) >= FIRST_SEED
    rows = [(*lot.size, lot.people, lot.robots_per_floor) for lot in drawn]
    bounds = zip(*rows, strict=True)
    ranges = "widths", "heights", "floors", "people", "robots_per_floor"
    for values, name in zip(bounds, ranges, strict=True):
        low, high = getattr(family, name)
        assert low <= min(values) <= low + 3 and high - 3 <= max(values) <= high


def test_people_do_not_follow_from_the_size_of_a_building():
    """Nor robots; all are drawn from the same numbers here."""
    alike = (15, 18)
    family = Family(widths=alike, heights=alike, people=alike, robots_per_floor=alike)
    drawn = [job.lot for job in lots(family, 100)]
    rows = {
        (lot.size[0], lot.size[1], lot.people, lot.robots_per_floor) for lot in drawn
    }
    assert len(rows) > 80


def test_so_many_buildings_come_in_turn():
    """N of them, each as often as the others, the first of more; fires go round."""
    few, more = (family_of([f"random:{n}"], {}) for n in (10, 100))
    drawn = [(job.lot.seed, *job.lot.size) for job in lots(few, 50)]
    assert sorted(map(drawn.count, {*drawn})) == [5] * 10
    assert {*drawn} < {(job.lot.seed, *job.lot.size) for job in lots(more, 100)}
    met = {(plan, number % 5) for number, plan in enumerate(drawn)}
    assert len(met) > 25  # in one order each would meet one fire for ever
    assert len({job.lot.people for job in lots(few, 50)}) > 20


def test_buildings_of_a_training_are_found_by_their_number():
    """Whoever asks what robots have learned by heart takes the very same ones."""
    family = family_of(["random:5"], {})
    played = {job.placed().plan for job in lots(family, 5)}
    assert played == {plan_in(family, 5, which) for which in range(5)}
    assert played.isdisjoint(plan_in(family, 6, which) for which in range(5))


def test_maps_come_in_turn():
    """And the scenario stays as it is."""
    jobs = lots(MAPS, 10)
    assert sorted(job.plan for job in jobs) == sorted([TINY, HUT] * 5)
    assert {job.scenario for job in jobs} == {Scenario()}


def test_what_a_scenario_states_does_not_vary():
    """People and robots."""
    stated = {"people": 30, "robots_per_floor": 3}
    (job,) = lots(family_of(["random"], stated), 1)
    assert (job.lot.people, job.lot.robots_per_floor) == (30, 3)


def test_people_fit_into_the_smallest_building():
    """There are as many as have room, ROOM cells each."""
    family = Family(widths=(15, 15), heights=(10, 10), floors=(3, 3), people=(400, 400))
    for job in lots(family, 3):
        placed = job.placed()
        building = building_of(placed.plan)
        rooms = (building.kind == Kind.FLOOR).sum(axis=(1, 2))
        assert 1 <= max(placed.scenario.start_counts(3)) <= rooms.min() / 4 + 1
        parse_map(placed.plan)


@pytest.mark.parametrize(
    ("words", "stated", "told"),
    [
        (["random", "paper"], {}, "random stands alone"),
        (["random:0"], {}, "write random:N"),
        (["random:x"], {}, "write random:N"),
        (["tiny", "tiny"], {}, "a map is named twice"),
        (["random"], {"rooms": ("1/hall",)}, "rooms is of one building"),
    ],
)
def test_refuses_words_that_mean_no_family(words, stated, told):
    """In one message."""
    with pytest.raises(InputError, match=told):
        family_of(words, stated)


def test_one_map_is_no_family():
    """But the training of before."""
    assert family_of(["tiny"], {}) is None


# -- Trainings ----------------------------------------------------------------------


@pytest.mark.paper("C5", "chosen")
def test_robots_learn_in_two_maps(tmp_path):
    """Losses are finite, weights move, summaries are written."""
    training = begun(MAPS)
    before = weights(training)
    trained(training, tmp_path)
    after = weights(training)
    assert not any(before[name].equal(after[name]) for name in before)
    assert all(weight.isfinite().all() for weight in after.values())
    text = (tmp_path / SUMMARIES).read_text()
    assert text.count("\n") > 2 and "nan" not in text and "inf" not in text
    assert training.about().startswith("Tiny office, Hut, people=6, sources=3, ")


@pytest.mark.paper("E6")
@pytest.mark.parametrize("family", [MAPS, SMALL], ids=["maps", "random"])
def test_a_resumed_training_equals_an_uninterrupted_one(family, tmp_path):
    """To the last bit, with a policy that is copied first."""
    changes = {"imitate": "sweep", "robots": {"buffer_size": 70, "max_steps": 300}}
    whole = trained(begun(family, **changes), tmp_path / "whole")
    part = trained(begun(family, **changes), tmp_path / "part", rounds=2)
    checkpoint = load_checkpoint(part)
    assert checkpoint.task.family == family
    resumed = trained(Training.resumed(checkpoint), tmp_path / "part")
    one, other = (load_checkpoint(path) for path in (whole, resumed))
    assert one.round > 2
    assert equal(one.learners, other.learners) and one.progress == other.progress
    tables = [(tmp_path / name / SUMMARIES).read_text() for name in ("whole", "part")]
    assert tables[0] == tables[1]


@pytest.mark.paper("E6")
@pytest.mark.parametrize("family", [MAPS, SMALL], ids=["maps", "random"])
def test_a_training_against_a_fire_that_learned_is_resumed(family, tmp_path):
    """That network knows no building, and plays in all."""
    trained(begun(family, fixed={"robots": ("sweep",)}, fire={"head": "set"}), tmp_path)
    foe = load_checkpoint(tmp_path).player("fire")
    fixed = {"fire": (foe,)}
    path = trained(begun(family, fixed=fixed), tmp_path / "next", rounds=1)
    resumed = Training.resumed(load_checkpoint(path))
    assert resumed.round == 1 and resumed.learners.keys() == {"robots"}


@pytest.mark.slow
@pytest.mark.paper("E6")
def test_workers_change_nothing_in_a_family(tmp_path):
    """Two processes, or this one."""
    here = load_checkpoint(trained(begun(SMALL), tmp_path / "here"))
    with workers(2) as pool:
        path = run_training(begun(SMALL), tmp_path / "there", pool)
    assert equal(load_checkpoint(path).learners, here.learners)


@pytest.mark.paper("C5", "chosen")
@pytest.mark.parametrize("family", [MAPS, SMALL], ids=["maps", "random"])
@pytest.mark.parametrize("head", ["mixture", "floor"])
def test_refuses_heads_that_know_one_building(family, head):
    """The robots', and the fire's; a network that does not learn likewise."""
    with pytest.raises(SettingsError, match=f"robots: head {head} knows one building"):
        begun(family, robots={"head": head})
    with pytest.raises(SettingsError, match="fire: head mixture knows one building"):
        begun(family, fixed={})
    network = LearnedNetwork(replace(tiny().robots, head=head), {})
    with pytest.raises(SettingsError, match=f"robots: head {head} knows one building"):
        begun(family, fixed={"robots": (network,)})


def test_tables_of_few_buildings_are_kept(tmp_path):
    """However many there were; what other tests keep is not counted."""
    others = WeakSet(navigations())
    training = begun(SMALL)
    seen = set()
    for _ in range(7):
        for job in training.jobs():
            assert isinstance(job, LotJob)
            seen.add(job.lot.seed)
            _play_in_family(job)
        training.round += 1
    kept = [one for one in navigations() if one not in others]
    assert len(seen) == 14 and 1 <= len(kept) <= 9  # and the engine's own


def test_tables_that_nobody_keeps_are_freed():
    """Some buildings later, also while Python itself does not look for them."""
    alive = WeakSet()
    gc.collect()
    gc.disable()
    try:
        for seed in range(28):
            plan = generated_text(seed, 15, 10, 1)
            prepare(Job(plan, Scenario(), ROBOTS["none"](), FIRES["none"](), ()))
            alive.add(navigation_of(building_of(plan)))
    finally:
        gc.enable()
    assert len(alive) <= 18


def navigations():
    """All that anybody in this process still holds."""
    gc.collect()
    return [thing for thing in gc.get_objects() if type(thing) is Navigation]


def test_a_policy_of_a_family_plays_elsewhere(tmp_path):
    """Its file keeps no geometry; where it learned is told."""
    path = trained(begun(SMALL), tmp_path, rounds=1)
    checkpoint = load_checkpoint(path)
    assert checkpoint.task.plan == "" and checkpoint.task.family.plans == ()
    assert b"####" not in path.read_bytes()
    player = checkpoint.player("robots").player("robots", load("school"), Scenario())
    assert np.isfinite(player.codec.shapes.counts)


def test_the_command_trains_in_maps_and_at_random(tmp_path, capsys):
    """A run that is resumed keeps its buildings."""
    words = ["train", "--preset", "tiny", "--head", "set", "--fire", "none"]
    words += ["--workers", "0", "--building"]
    out = ["--out", str(tmp_path / "maps")]
    assert main([*words, "tiny", "museum", *out]) == 0
    err = capsys.readouterr().err
    assert "Tiny office, " in err and "making buildings took " in err
    assert main(["train", "--resume", "--building", "tiny", *out]) == 2
    assert "--building: a resumed run keeps its options" in capsys.readouterr().err
    assert main(["train", "--resume", "--building", "tiny", "museum", *out]) == 0
    mixture = ["train", "--preset", "tiny", "--building", "random", "--fire", "none"]
    assert main([*mixture, "--out", str(tmp_path / "no")]) in (1, 2)
    assert "head mixture knows one building, and here" in capsys.readouterr().err
