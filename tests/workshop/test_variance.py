"""What noise is made of: parts of a variance that are known are found again."""

from dataclasses import replace
from runpy import run_path
from types import SimpleNamespace

import numpy as np
import pytest
from conftest import ROOT
from movies import shipped

from reference.paper import Scenario
from reference.simulation import Simulation
from reference.workshop.comparing.named import strategy_named
from reference.workshop.engine import run_to_decision
from reference.workshop.storage.workers import one_thread

SCRIPT = ROOT / "tutorials" / "experiments" / "what_noise_is_made_of.py"
noise = SimpleNamespace(**run_path(str(SCRIPT)))

SHAPE = (3, 4, 5)  # own actions, mates' actions, futures
AXES = {
    noise.STATE: (),
    noise.OWN: (0,),
    noise.MATES: (1,),
    noise.LATER: (2,),
    noise.OWN_MATES: (0, 1),
    "own action x what follows": (0, 2),
    "mates' actions x what follows": (1, 2),
    "all three": (0, 1, 2),
}


def effect(rng, axes, deviation):
    """Random numbers that differ along these axes alone."""
    shape = [SHAPE[axis] if axis in axes else 1 for axis in range(3)]
    return rng.normal(0, deviation, shape)


@pytest.mark.parametrize("part", noise.PARTS[1:])
def test_what_one_thing_changes_is_its_own_part_alone(part):
    """Nothing is estimated for those that change nothing, but below their noise."""
    drawn = effect(np.random.default_rng(1), AXES[part], 2.0)
    found = noise.components(np.broadcast_to(drawn, SHAPE))
    others = {name for name in found if set(AXES[name]) > set(AXES[part])}
    for name in others:  # what holds more than this cannot be needed
        assert abs(found[name]) < 1e-9
    if len(AXES[part]) == 1:
        assert found[part] == pytest.approx(drawn.var(ddof=1))


def test_all_parts_are_estimated_without_bias():
    """Over many states, each with effects of its own."""
    rng = np.random.default_rng(2)
    sizes = (9.0, 0.5, 1.0, 4.0, 0.25, 0.0, 2.0, 1.0)
    true = dict(zip(noise.PARTS, sizes, strict=True))
    results = [
        sum(effect(rng, AXES[name], true[name] ** 0.5) for name in noise.PARTS)
        for _ in range(4000)
    ]
    found = noise.parts_of(np.stack(results))
    assert found == pytest.approx(true, abs=0.35)
    assert list(found) == list(noise.PARTS)


@pytest.mark.slow
def test_the_same_action_in_the_same_future_saves_the_same():
    """Where a network always says the same, only what follows makes a difference."""
    robots = strategy_named("learned", "robots")
    fire = strategy_named("busiest", "fire")
    run = Simulation(shipped("paper"), Scenario(), robots, fire, 4)
    with one_thread():
        for _ in range(5):
            run_to_decision([run])
        decided = robots.player.act
        robot = run.world.robots[0]

        # as it is: combinations differ
        seeds = (1, 2)
        free = noise.crossed(run, robot, 3, np.random.default_rng(1), seeds)
        assert len(np.unique(free)) > 2 and free.shape == (3, 3, 2)

        # without any noise
        def likeliest(moments):
            return decided([replace(moment, rng=None) for moment in moments])

        run.robot_strategy.player.act = likeliest
        same = noise.crossed(run, robot, 3, np.random.default_rng(1), seeds)
    assert (same == same[:1, :1]).all()
