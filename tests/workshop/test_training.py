"""The adversarial loop: whose turn it is, what comes out, how it goes on."""

import csv
import signal
from concurrent.futures import BrokenExecutor
from copy import deepcopy
from dataclasses import replace
from itertools import chain, pairwise, product

import pytest
import torch
from trainings import TINY, Stopped, begun, equal, tiny, trained

from reference.fire import NoFire, RandomFire
from reference.learning.adversarial import learner_for, player_of
from reference.learning.players import LearnedNetwork
from reference.learning.ppo import Learner
from reference.learning.rollouts import Job, play
from reference.learning.settings import SIDES
from reference.paper import InputError
from reference.workshop.storage.records import SettingsError
from reference.workshop.storage.workers import InProcess, workers
from reference.workshop.strategies.fires import BusiestFire
from reference.workshop.strategies.guides import RandomRobots
from reference.workshop.training.checkpoints import load_checkpoint, newest_checkpoint
from reference.workshop.training.loop import run_training
from reference.workshop.training.rounds import Training, seeds_of
from reference.workshop.training.summaries import (
    EPISODE_COLUMNS,
    SUMMARIES,
    SUMMARY_COLUMNS,
    RunningMeans,
    table_until,
)


def rows(folder):
    """The rows of a training's summaries."""
    with (folder / SUMMARIES).open() as file:
        return list(csv.DictReader(file))


def actors(training):
    """Both sides' weights as they are now."""
    return {s: deepcopy(who.actor.state_dict()) for s, who in training.learners.items()}


def fires(training, rounds):
    """Who plays the fire in the jobs of some rounds."""
    kinds = []
    for training.round in range(rounds):
        kinds += [type(job.fire) for job in training.jobs()]
    return kinds


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """A training from beginning to end, and its folder."""
    folder = tmp_path_factory.mktemp("whole")
    training = begun(seed=1)
    trained(training, folder)
    return training, folder


# -- What comes out -----------------------------------------------------------------


@pytest.mark.paper("E3")
def test_it_ends_when_both_sides_are_past_their_max_steps(whole):
    """A step is one agent's decision."""
    training, folder = whole
    for learner in training.learners.values():
        assert learner.steps >= learner.settings.max_steps
    assert training.finished and load_checkpoint(folder).round == training.round


class Counted(Training):
    """Learns nothing: a round is ten decisions of the robots and one of the fire."""

    def learn(self, episodes):
        """Count the steps."""
        self.round += 1
        self.learners["robots"].steps += 10
        self.learners["fire"].steps += 1
        return []


@pytest.mark.paper("E1", "Tab. I")
@pytest.mark.paper("E2", "Tab. II")
def test_each_side_keeps_as_many_checkpoints_as_its_table_says(tmp_path, monkeypatch):
    """Robots two, every third round; the fire three, every second.

    The beginning counts; what a stop leaves is nobody's and goes with the next: 11.
    """
    robots = {"checkpoint_interval": 30, "keep_checkpoints": 2, "max_steps": 130}
    fire = {"checkpoint_interval": 2, "keep_checkpoints": 3, "max_steps": 13}
    monkeypatch.setattr("reference.workshop.training.loop._play", lambda jobs: [])
    training = Counted(begun(tiny(robots=robots, fire=fire)).task)
    kept = []
    for rounds in (3, 5, 3, None):
        trained(training, tmp_path, rounds)
        kept.append([int(path.stem[-6:]) for path in sorted(tmp_path.glob("*.pt"))])
        training = Counted.resumed(load_checkpoint(tmp_path))
    assert kept == [[0, 2, 3], [3, 4, 6, 8], [6, 8, 9, 10, 11], [10, 12, 13]]


@pytest.mark.paper("E6")
def test_both_sides_learn_from_the_same_episodes(whole):
    """Their rows tell of the same episodes, at their own decision rates."""
    robots, fire = rows(whole[1])[:2]
    assert (robots["side"], fire["side"]) == ("robots", "fire")
    assert robots["phase"] == fire["phase"] == "together"
    for column in ("round", "episodes", "Environment/Survival"):
        assert robots[column] == fire[column]
    assert int(robots["step"]) > 5 * int(fire["step"])


def test_a_training_that_stops_after_every_round_goes_on_to_the_same_end(tmp_path):
    """Imitation, what waits in buffers and summaries, earlier versions: all is kept."""
    robots = {"buffer_size": 80, "summary_freq": 80, "max_steps": 500}
    fire = {"buffer_size": 6, "summary_freq": 8}
    settings = tiny(league=0.5, random_fires=0.25, robots=robots, fire=fire)
    apart = tmp_path / "apart"
    at_once = tmp_path / "at once"
    trained(begun(settings, imitate="patrol"), at_once, rounds=5)
    run_training(begun(settings, imitate="patrol"), apart, InProcess(), lambda: True)
    assert not load_checkpoint(apart).progress["imitated"]
    waiting = []
    for _ in range(5):
        training = Training.resumed(load_checkpoint(apart))
        trained(training, apart, rounds=1)
        waiting.append(len(training.learners["robots"].buffer))
    assert equal(load_checkpoint(apart).learners, load_checkpoint(at_once).learners)
    assert equal(load_checkpoint(apart).progress, load_checkpoint(at_once).progress)
    assert rows(apart) == rows(at_once)
    phases = [row["phase"] for row in rows(apart)]
    assert phases[:3] == ["imitation", "imitation", "together"]
    assert [*training.versions["fire"]] == [1, 2, 3, 4, 5] and any(waiting)


def test_no_time_left_is_told_while_robots_copy(tmp_path, capsys):
    """Copying takes no decisions, by which the rest is estimated."""
    trained(begun(tiny(), imitate="patrol"), tmp_path, rounds=4)
    told = [line for line in capsys.readouterr().err.splitlines() if "done" in line]
    copies = [line for line in told if "imitation" in line]
    assert len(copies) == 2 and all(line.endswith("; 0% done") for line in copies)
    others = [line for line in told if line not in copies]
    assert others and all(line.endswith(" left") for line in others)


@pytest.mark.slow
def test_how_many_workers_there_are_changes_nothing(whole, tmp_path):
    """Two processes of one thread each, or this process: the same to the last bit."""
    training = begun(seed=1)
    (_, here) = whole
    with workers(2) as pool:
        run_training(training, tmp_path, pool, lambda: training.round >= 2)
    same = load_checkpoint(here / newest_checkpoint(tmp_path).name)
    assert equal(load_checkpoint(tmp_path).learners, same.learners)
    assert rows(tmp_path) == rows(here)[:4]


@pytest.mark.paper("E6", "chosen")
def test_updates_run_on_as_many_threads_as_the_settings_say(tmp_path, monkeypatch):
    """Not on those of the machine; a checkpoint keeps their number."""
    seen = []
    update = Learner.update

    def watched(learner):
        seen.append(torch.get_num_threads())
        return update(learner)

    monkeypatch.setattr(Learner, "update", watched)
    before = torch.get_num_threads()
    trained(begun(tiny(threads=3), seed=1), tmp_path, 1)
    resumed = Training.resumed(load_checkpoint(tmp_path))
    trained(resumed, tmp_path)
    assert len(seen) > 4
    assert {*seen} == {3}
    assert torch.get_num_threads() == before


def test_seeds_follow_from_the_run_and_the_round_alone():
    """Another run, purpose or round has others; asking twice gives the same."""
    assert seeds_of(1, 0, 0, 4) == seeds_of(1, 0, 0, 4)
    every = [seeds_of(*asked, 4) for asked in product((1, 2), (0, 1), (0, 1))]
    assert len({*chain(*every)}) == 32


# -- Whose turn it is ---------------------------------------------------------------


@pytest.mark.paper("E6")
def test_random_fire_stands_in_for_a_share_of_the_jobs():
    """Evenly spread over the rounds, only while the robots learn."""
    training = begun(tiny(random_fires=0.25))
    assert (
        fires(training, 4)
        == [LearnedNetwork, LearnedNetwork, LearnedNetwork, RandomFire] * 2
    )
    training.learners["robots"].steps = tiny().robots.max_steps
    assert fires(training, 4) == [LearnedNetwork] * 8


@pytest.mark.paper("E6")
@pytest.mark.parametrize("fixed", [{}, {"fire": ("random",)}])
def test_calm_comes_before_the_fires(fixed):
    """Nobody sets any until robots have made their share of decisions."""
    training = begun(tiny(calm=0.5, random_fires=0.5), fixed=fixed)
    robots = training.learners["robots"]
    assert all(isinstance(job.fire, NoFire) for job in training.jobs())
    training.learn([e for job in training.jobs() for e in play(job)])
    assert training.learning() == ["robots"] and 0 < robots.steps < 90
    robots.steps = 90
    assert not any(isinstance(job.fire, NoFire) for job in training.jobs())
    assert training.learning() == ["robots", "fire"][: 2 - len(fixed)]


@pytest.mark.paper("E6", "chosen")
def test_a_fire_may_wait_for_its_first_job_after_the_calm():
    """Others stand in for it in whole rounds: it has decided nothing, and goes on."""
    training = begun(tiny(calm=0.3, random_fires=0.9))
    robots = training.learners["robots"]
    while training.calm:
        training.learn([e for job in training.jobs() for e in play(job)])
    assert training.learning() == ["robots", "fire"]
    jobs = training.jobs()
    assert [job.record for job in jobs] == [("robots",)] * 2
    before = robots.steps
    training.learn([e for job in jobs for e in play(job)])
    assert robots.steps > before
    assert training.learners["fire"].steps == 0


@pytest.mark.paper("E6")
def test_several_that_do_not_learn_play_in_turn():
    """Job by job, on from one round to the next; scripts and networks."""
    network = player_of(begun().learners["fire"])
    tensors = {n: torch.from_numpy(w) for n, w in network.weights.items()}
    fixed = "random", replace(network, weights=tensors), "none"
    training = begun(fixed={"fire": fixed})
    assert fires(training, 2) == [RandomFire, LearnedNetwork, NoFire, RandomFire]
    assert [job.record for job in training.jobs()] == [("robots",)] * 2


@pytest.mark.paper("E6", "chosen")
def test_scripted_fires_stand_in_in_turn():
    """Half of the jobs, busiest before none."""
    training = begun(tiny(random_fires=0.5, stand_ins=("busiest", "none")))
    assert fires(training, 2)[1::2] == [BusiestFire, NoFire]
    with pytest.raises(SettingsError, match=r"stand_ins: 'bussy' .* mean 'busiest'"):
        tiny(stand_ins=("bussy",))
    with pytest.raises(SettingsError, match="stand_ins: name at least one"):
        tiny(stand_ins=())


@pytest.mark.paper("E6", "chosen")
def test_in_the_league_each_side_meets_the_other_as_it_was_earlier():
    """In every second job, in turn; only who plays as of now is recorded."""
    training = begun(tiny(league=0.5))
    for _ in range(3):
        training.learn([e for job in training.jobs() for e in play(job)])
    now = actors(training)
    past = training.versions
    assert [*past["robots"]] == [*past["fire"]] == [1, 2, 3]
    turns = (2, "robots", 1), (4, "robots", 3), (5, "fire", 3), (6, "robots", 1)
    for training.round, side, version in turns:
        both, one = training.jobs()
        (other,) = {*SIDES} - {side}
        assert (both.record, one.record) == (SIDES, (other,))
        assert equal(getattr(both, side).weights, now[side])
        assert equal(getattr(one, other).weights, now[other])
        assert equal(getattr(one, side).weights, past[side][version])
        (episode,) = play(one)
        assert getattr(episode, side) is None and getattr(episode, other) is not None


@pytest.mark.paper("E6", "chosen")
def test_earlier_versions_are_four_to_eight_at_even_distances():
    """From the first rounds to the last; none is made after the fact."""
    training = begun(tiny(league=0.5))
    before = set()
    for training.round in range(1, 100):
        training._remember()
        rounds = [*training.versions["fire"]]
        assert {*rounds} <= before | {training.round}
        assert len({b - a for a, b in pairwise([0, *rounds])}) == 1
        assert min(4, training.round) <= len(rounds) <= 8
        before = {*rounds}
    assert rounds == [16, 32, 48, 64, 80, 96]


def test_a_fire_reports_only_episodes_it_played():
    """The fire learns from its own episodes and reports them; robots from all."""
    often = {"summary_freq": 1}
    training = begun(tiny(random_fires=0.5, robots=often, fire=often))
    episodes = [episode for job in training.jobs() for episode in play(job)]
    assert [episode.fire is None for episode in episodes] == [False, True]
    robots, fire = training.learn(episodes)
    everybody = [episode.facts["survival"] for episode in episodes]
    assert robots["Environment/Survival"] == pytest.approx(sum(everybody) / 2)
    assert fire["Environment/Survival"] == pytest.approx(everybody[0])


def test_a_fire_that_has_not_played_for_rounds_reports_none_of_them():
    """Where another stands in for whole rounds, its row tells its own ones alone."""
    often = {"summary_freq": 1}
    training = begun(tiny(random_fires=0.5, jobs_per_round=1, fire=often))
    own = []
    told = []
    for _ in range(3):
        (job,) = training.jobs()
        (episode,) = play(job)
        if episode.fire is not None:
            own.append(episode.facts["survival"])
        told += [row for row in training.learn([episode]) if row["side"] == "fire"]
    assert [row["Environment/Survival"] for row in told] == pytest.approx(own)
    assert len(own) == 2


def test_a_side_past_its_max_steps_learns_no_more(tmp_path):
    """It plays on as it is while the other goes on."""
    training = begun(tiny(fire={"max_steps": 3}))
    trained(training, tmp_path, rounds=1)
    before = actors(training)
    steps = training.learners["fire"].steps
    trained(training, tmp_path, rounds=1)
    assert training.learning() == ["robots"]
    assert equal(actors(training)["fire"], before["fire"])
    assert not equal(actors(training)["robots"], before["robots"])
    assert training.learners["fire"].steps == steps >= 3


@pytest.mark.paper("D1")
@pytest.mark.parametrize("fixed", [{"fire": ("random",)}, {"robots": ("random",)}])
def test_against_a_script_the_other_side_learns_alone(fixed, tmp_path):
    """That is how robots without an adversary are trained."""
    training = begun(fixed=fixed)
    trained(training, tmp_path, rounds=1)
    (side,) = training.learners
    assert side not in fixed
    assert {row["side"] for row in rows(tmp_path)} == {side}
    assert list(load_checkpoint(tmp_path).learners) == [side]


def test_refuses_a_scenario_in_which_there_is_nothing_to_decide(tmp_path):
    """Without fire sources the fire would never be past its max_steps."""
    idle = tiny(scenario=replace(tiny().scenario, sources=0))
    with pytest.raises(SettingsError, match="nothing to learn while sources is 0"):
        begun(idle)
    nobody = tiny(scenario=replace(tiny().scenario, people=0))
    with pytest.raises(SettingsError, match="nobody to evacuate"):
        begun(nobody)
    short = tiny(scenario=replace(tiny().scenario, time_limit=1.0))
    with pytest.raises(SettingsError, match="fire: nothing to decide in a whole round"):
        trained(begun(short), tmp_path, rounds=1)


def test_refuses_a_network_to_begin_with_that_means_something_else(whole):
    """Layers, heads, or what it observes: by name, what it has and what is here."""
    robots = load_checkpoint(whole[1]).player("robots")
    for row, other, told in ("hidden_units", 16, 8), ("commitment", 0.0, 5.0):
        with pytest.raises(SettingsError, match=f"{row} {told}"):
            begun(tiny(robots={row: other}), initial={"robots": robots})
    begun(tiny(robots={"gamma": 0.5}), initial={"robots": robots})  # it fits


# -- Stopping -----------------------------------------------------------------------


def test_a_round_that_is_being_played_is_dropped(tmp_path):
    """As if it had never begun: the next one has the same seeds."""
    training = begun()
    with pytest.raises(KeyboardInterrupt):
        run_training(training, tmp_path, Stopped())
    assert training.round == 0
    assert equal(load_checkpoint(tmp_path).learners, begun().checkpoint().learners)


@pytest.mark.parametrize("why", [BrokenExecutor, MemoryError, ZeroDivisionError])
def test_a_worker_that_has_died_costs_the_round_that_it_played(why, tmp_path):
    """Though no side would keep a checkpoint yet; so does any error of a job."""
    late = {"checkpoint_interval": 1000}
    training = begun(tiny(robots=late, fire=late))
    with pytest.raises(why):
        run_training(training, tmp_path, Stopped(1, why))
    assert load_checkpoint(tmp_path).round == training.round == 1


def test_a_stop_that_comes_again_waits_until_all_is_saved(tmp_path, monkeypatch):
    """Else all rounds since the last checkpoint that a side keeps were lost."""
    late = {"checkpoint_interval": 1000}
    training = begun(tiny(robots=late, fire=late))
    collect = training.checkpoint

    def stopped():
        if training.round:
            signal.raise_signal(signal.SIGINT)
        return collect()

    monkeypatch.setattr(training, "checkpoint", stopped)
    with pytest.raises(KeyboardInterrupt):
        run_training(training, tmp_path, Stopped(1))
    assert load_checkpoint(tmp_path).round == training.round == 1


def test_a_stop_while_robots_copy_leaves_the_first_checkpoint(tmp_path, capsys):
    """Half a copy would play by its name; that copying begins anew is told, twice."""
    training = begun(imitate="patrol")
    with pytest.raises(KeyboardInterrupt):
        run_training(training, tmp_path, Stopped(1))
    assert "robots have not copied all: they begin anew" in capsys.readouterr().err
    assert len(training.shown) == 1
    first = load_checkpoint(tmp_path)
    assert equal(first.learners, begun(imitate="patrol").checkpoint().learners)
    told = Training.resumed(first).about()
    assert told.endswith(", once robots have copied patrol, from its beginning")


def test_a_copy_that_is_done_stays_where_there_is_nothing_to_decide_later(tmp_path):
    """It plays by its name; what copied nothing leaves nothing."""
    short = tiny(scenario=replace(tiny().scenario, time_limit=1.0))
    with pytest.raises(SettingsError, match="nothing to decide in a whole round"):
        trained(begun(short, imitate="escort"), tmp_path / "copy")
    assert load_checkpoint(tmp_path / "copy").progress["imitated"]
    with pytest.raises(SettingsError, match="nothing to decide in a whole round"):
        trained(begun(short), tmp_path / "nothing")
    assert not [*(tmp_path / "nothing").iterdir()]


def test_a_round_that_is_being_learned_from_is_finished(tmp_path, monkeypatch):
    """What is saved is what it would have been; its rows are there too."""
    training = begun()
    whole = tmp_path / "whole"
    trained(begun(), whole, rounds=1)
    learn = training.learn

    def stopped(episodes):
        signal.raise_signal(signal.SIGINT)
        return learn(episodes)

    monkeypatch.setattr(training, "learn", stopped)
    with pytest.raises(KeyboardInterrupt):
        run_training(training, tmp_path / "run", InProcess())
    assert equal(
        load_checkpoint(tmp_path / "run").learners, load_checkpoint(whole).learners
    )
    assert rows(tmp_path / "run") == rows(whole)


# -- Summaries ----------------------------------------------------------------------


FACTS = dict.fromkeys(EPISODE_COLUMNS.values(), 1.0)
FACTS |= {"group_reward": 100.0, "fire_reward": -90.0, "survival": 0.5}


@pytest.mark.paper("E1")
@pytest.mark.paper("E2")
@pytest.mark.paper("E5")
@pytest.mark.parametrize(("side", "own"), [("robots", 100.0), ("fire", -90.0)])
def test_a_row_of_means_is_due_every_summary_freq_steps(side, own):
    """Over all episodes and updates since the one before; the group's reward counts."""
    summary = RunningMeans(0, {}, {})
    summary.add(side, [FACTS, FACTS | {"survival": 1.0}], {"Losses/Value Loss": 4.0})
    assert summary.row(9, every=10) is None
    summary.add(side, [FACTS | {"survival": 0.0}], {"Losses/Value Loss": 2.0})
    row = summary.row(25, every=10)
    assert row["Environment/Survival"] == 0.5
    assert row["Losses/Value Loss"] == 3.0
    assert row["Environment/Cumulative Reward"] == own
    assert summary.row(29, every=10) is None


def test_every_column_that_a_learner_fills_is_in_the_table(whole):
    """By ML-Agents' names; only what the fire has none of, and copying, stays empty."""
    robots, fire = rows(whole[1])[:2]
    empty = {name for name in SUMMARY_COLUMNS if not robots[name]}
    assert empty == {"Losses/Pretraining Loss"}
    empty |= {"Losses/Baseline Loss", "Policy/Extrinsic Baseline Estimate"}
    assert {name for name in SUMMARY_COLUMNS if not fire[name]} == empty


def test_a_table_begins_with_one_header_and_goes_on_where_it_was(tmp_path):
    """Rows of later rounds and a half-written one are dropped; numbers stay exact."""
    table_until(tmp_path, 0).append([{"round": 1, "step": 1 / 3}, {"round": 2}])
    with (tmp_path / SUMMARIES).open("a") as file:
        file.write("robots,4")
    table_until(tmp_path, 1).append([{"round": 2, "step": 0.5}])
    told = [(row["round"], row["step"]) for row in rows(tmp_path)]
    assert told == [("1", repr(1 / 3)), ("2", "0.5")]


def test_a_table_that_a_spreadsheet_has_saved_can_be_moved_away(tmp_path):
    """A training goes on in its own folder alone, and does not read it."""
    (tmp_path / SUMMARIES).write_text(";".join(SUMMARY_COLUMNS))
    with pytest.raises(InputError, match=r"is no table of these runs\. Move it away"):
        table_until(tmp_path, 1)


@pytest.mark.paper("D2")
@pytest.mark.parametrize("sources, follows", [(1, False), (50, True)])
def test_time_cuts_off_a_fire_only_while_it_has_sources_left(sources, follows):
    """With none left it has nothing to decide: no value follows its last decision."""
    scenario = replace(tiny().scenario, sources=sources)
    table = replace(tiny().fire, head="floor")
    made = learner_for("fire", TINY, scenario, table, seed=0)
    episodes = play(Job(TINY, scenario, RandomRobots(), player_of(made), (0, 1, 2)))
    cut = [e for e in episodes if e.facts["survival"] + e.facts["died"] / 6 < 1]
    assert cut and all(e.fire.alive[-1].item() is follows for e in cut)
