"""The second candidate for the difficulty, and how well it agrees with h."""

import pickle
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from movies import built, shipped
from scipy import stats

from reference.building import plan_of
from reference.navigation import navigation_of
from reference.paper import FIRE_SOURCES, Scenario
from reference.simulation import Simulation
from reference.strategies import NoFire, NoRobots
from reference.workshop.evaluation.agreement import (
    DOORSTEP,
    FIRES,
    KINDS,
    Agreement,
    Doorstep,
    Judged,
    agreement,
    jobs,
    judge,
    unguided_loss,
)
from reference.world import Source

FEW = Scenario(people=6)
TINY = plan_of(shipped("tiny"))

HALL = """
    ########################################
    #......................................#
    #......................................E
    #......................................#
    ########################################
    """


def judged(difficulties, losses, sources=None, fire="random"):
    """Fires as if judged so."""
    sources = sources or [1] * len(losses)
    rows = zip(sources, difficulties, losses, strict=True)
    return tuple(Judged(fire, n, seed=0, difficulty=h, loss=r) for n, h, r in rows)


# -- The second candidate -----------------------------------------------------------


@pytest.mark.paper("F11")
def test_unguided_people_lose_nothing_without_fire():
    """Not a hundredth of a point: both runs are one."""
    assert unguided_loss(shipped("tiny"), FEW, seed=4, sources=[]) == 0


@pytest.mark.paper("F11")
def test_unguided_people_lose_to_a_fire_before_the_only_exit():
    """Lit when the first of them are out."""
    building = built(HALL)
    source = Source(0, *building.metres(2, 38), 10.0)
    everybody = replace(FEW, people=20)
    spared = Simulation(building, everybody, NoRobots(), NoFire(), seed=1).run()
    loss = unguided_loss(building, everybody, seed=1, sources=[source])
    assert 0 < loss / spared.reward < 2


@pytest.mark.paper("F11")
@pytest.mark.parametrize("fire", KINDS)
def test_a_judged_fire_is_judged_as_its_replay(fire):
    """Same seed, same people, the same sources at the same times: the same loss."""
    job = next(j for j in jobs(TINY, FEW, FIRES, seed=7) if j.fire == fire)
    job = replace(job, scenario=replace(FEW, sources=3))
    building = shipped("tiny")
    run = Simulation(building, job.scenario, NoRobots(), KINDS[fire](), job.seed)
    run.run()
    sources = run.world.flames.sources
    assert sources and judge(job).loss == unguided_loss(
        building, FEW, job.seed, sources
    )


def test_a_doorstep_fire_breaks_out_right_before_a_way_out():
    """Before every one of them sooner or later."""
    world = Simulation(shipped("paper"), FEW, NoRobots(), NoFire()).world
    nav, rng, struck = navigation_of(world.building), np.random.default_rng(0), set()
    for _ in range(60):
        p = nav.place(*Doorstep().decide(world, rng))
        ways = [m.index for m in world.building.landmarks if m.leads_out]
        near = [way for way in ways if nav.distance[way, p] <= DOORSTEP]
        assert near
        struck.update(near)
    assert struck == set(ways)


# -- Agreement ----------------------------------------------------------------------


def test_all_kinds_of_fires_take_turns_with_none_to_eight_sources():
    """Each with a seed of its own."""
    todo = jobs(TINY, FEW, FIRES, seed=100)
    arms = {(job.fire, job.scenario.sources) for job in todo}
    assert arms == {(fire, n) for fire in KINDS for n in range(FIRE_SOURCES + 1)}
    assert [job.seed for job in todo] == list(range(100, 100 + FIRES))


@pytest.mark.paper("F11")
def test_fires_are_judged_alike_by_any_executor():
    """Jobs travel, and come back in their order."""
    with ThreadPoolExecutor(2) as threads:
        there = agreement(TINY, FEW, count=8, seed=5, executor=threads)
    assert there == agreement(TINY, FEW, count=8, seed=5)
    assert [fire.seed for fire in there.fires] == list(range(5, 13))
    todo = jobs(TINY, FEW, 3, seed=0)
    assert pickle.loads(pickle.dumps(todo)) == todo


NUMBERS = st.lists(st.integers(0, 50), min_size=12, max_size=12)


@pytest.mark.paper("F11")
@given(NUMBERS, NUMBERS)
def test_the_coefficients_are_those_of_scipy(difficulties, losses):
    """Over all fires, of every strength."""
    assume(len(set(difficulties)) > 1 < len(set(losses)))
    found = Agreement(judged(difficulties, losses))
    spearman, pearson = stats.spearmanr, stats.pearsonr
    assert found.spearman == pytest.approx(spearman(difficulties, losses)[0])
    assert found.pearson == pytest.approx(pearson(difficulties, losses)[0])
    assert found.within == pytest.approx(found.spearman)  # all have one source


def test_agreement_within_is_not_owed_to_the_number_of_sources():
    """More sources are harder by both; among equally many the order is reversed."""
    found = Agreement(
        judged([1, 2, 3, 11, 12, 13], [3, 2, 1, 13, 12, 11], [1, 1, 1, 2, 2, 2])
    )
    assert found.spearman > 0.5
    assert found.within == pytest.approx(-1)


def test_kinds_of_fires_can_be_looked_at_alone():
    """As if no others had been judged."""
    random, greedy = judged([1, 2], [5, 6]), judged([3, 4], [8, 7], fire="greedy")
    both = Agreement(random + greedy)
    assert both.of("greedy") == Agreement(greedy)
    assert both.of("greedy").spearman == pytest.approx(-1)


# -- Refusals -----------------------------------------------------------------------


@pytest.mark.parametrize("losses", [[], [5], [3, 3, 3]])
def test_refuses_to_correlate_what_does_not_differ(losses):
    """A coefficient would be nan."""
    with pytest.raises(ValueError, match="Judge more of them"):
        Agreement(judged(range(len(losses)), losses))


def test_refuses_to_compare_within_numbers_that_stand_alone():
    """One fire with one source, one with two."""
    with pytest.raises(ValueError, match="equally many sources"):
        _ = Agreement(judged([1, 2], [3, 4], [1, 2])).within
