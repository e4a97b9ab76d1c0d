"""The second candidate for the difficulty, and how well it agrees with h."""

import pickle
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from movies import shipped
from scipy import stats

from reference.building import plan_of
from reference.flames import rim
from reference.navigation import navigation_of
from reference.paper import FIRE_SOURCES, Scenario
from reference.simulation import Simulation
from reference.strategies import NoFire, NoRobots
from reference.workshop.evaluation.agreement import (
    FIRES,
    KINDS,
    DoorstepFire,
    Measured,
    agreement,
    fires_to_measure,
    measure,
)
from reference.workshop.evaluation.contestants import Evacuation

FEW = Scenario(people=8, time_limit=60.0)
NO_FIRES = replace(FEW, sources=0)
TINY = plan_of(shipped("tiny"))


def measured(difficulties, losses, sources=None, fire="random"):
    """Fires as if measured so."""
    sources = sources or [1] * len(losses)
    rows = zip(sources, difficulties, losses, strict=True)
    return tuple(Measured(fire, n, seed=0, difficulty=h, loss=r) for n, h, r in rows)


# -- The second candidate -----------------------------------------------------------


@pytest.mark.paper("F11")
def test_unguided_people_lose_nothing_without_fire():
    """Not a hundredth of a point: both runs are one."""
    found = measure(Evacuation(TINY, NO_FIRES, "none", "random", seed=4))
    assert (found.loss, found.difficulty) == (0, 0)


@pytest.mark.paper("F11")
@pytest.mark.parametrize("fire", KINDS)
def test_the_loss_is_what_two_simulations_of_one_seed_differ_in(fire):
    """Played by hand, with the fire and without it."""
    scenario = replace(FEW, sources=3)
    runs = [
        Simulation(shipped("tiny"), scenario, NoRobots(), played, seed=8).run()
        for played in (NoFire(), KINDS[fire]())
    ]
    found = measure(Evacuation(TINY, scenario, "none", fire, seed=8))
    assert found.loss == runs[0].reward - runs[1].reward != 0
    assert found.difficulty > 0


def test_a_doorstep_fire_breaks_out_right_before_a_way_out():
    """Before every one of them sooner or later."""
    world = Simulation(shipped("tiny"), FEW, NoRobots(), NoFire()).world
    nav, rng, struck = navigation_of(world.building), np.random.default_rng(0), set()
    ways = [m.index for m in world.building.landmarks if m.leads_out]
    rims = {way: set(rim(world.building, way).tolist()) for way in ways}
    for _ in range(60):
        p = nav.place(*DoorstepFire().decide(world, rng))
        near = [way for way in ways if p in rims[way]]
        assert near
        struck.update(near)
    assert struck == set(ways)


# -- Agreement ----------------------------------------------------------------------


def test_all_kinds_of_fires_take_turns_with_none_to_eight_sources():
    """Each with a seed of its own."""
    todo = fires_to_measure(TINY, FEW, FIRES, seed=100)
    arms = {(job.fire, job.scenario.sources) for job in todo}
    assert arms == {(fire, n) for fire in KINDS for n in range(FIRE_SOURCES + 1)}
    assert [job.seed for job in todo] == list(range(100, 100 + FIRES))


@pytest.mark.paper("F11")
def test_any_executor_can_measure():
    """Jobs and results are plain data; `measure` stands at the top of its module."""
    (job,) = fires_to_measure(TINY, NO_FIRES, 1, seed=5)
    assert pickle.loads(pickle.dumps((measure, job))) == (measure, job)
    found = measure(job)
    assert pickle.loads(pickle.dumps(found)) == found and found.seed == 5


NUMBERS = st.lists(st.integers(0, 50), min_size=12, max_size=12)


@pytest.mark.paper("F11")
@given(NUMBERS, NUMBERS)
@settings(max_examples=30)
def test_the_coefficients_are_those_of_scipy(difficulties, losses):
    """Over all fires, of every strength."""
    assume(len(set(difficulties)) > 1 < len(set(losses)))
    found = agreement(measured(difficulties, losses))
    spearman, pearson = stats.spearmanr, stats.pearsonr
    assert found.spearman == pytest.approx(spearman(difficulties, losses)[0])
    assert found.pearson == pytest.approx(pearson(difficulties, losses)[0])
    assert found.within == pytest.approx(found.spearman)  # all have one source


def test_agreement_within_is_not_owed_to_the_number_of_sources():
    """More sources are harder by both; among equally many the order is reversed."""
    found = agreement(
        measured([1, 2, 3, 11, 12, 13], [3, 2, 1, 13, 12, 11], [1, 1, 1, 2, 2, 2])
    )
    assert found.spearman > 0.5
    assert found.within == pytest.approx(-1)


# -- Refusals -----------------------------------------------------------------------


@pytest.mark.parametrize("losses", [[], [5], [3, 3, 3]])
def test_refuses_to_correlate_what_does_not_differ(losses):
    """A coefficient would be nan."""
    with pytest.raises(ValueError, match="Judge more of them"):
        agreement(measured(range(len(losses)), losses))


def test_refuses_to_compare_within_numbers_that_stand_alone():
    """One fire with one source, one with two."""
    with pytest.raises(ValueError, match="equally many sources"):
        agreement(measured([1, 2], [3, 4], [1, 2]))
