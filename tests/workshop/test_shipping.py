"""What ships: robots and a fire that learned, by the name of learned."""

import json
from dataclasses import replace
from runpy import run_path

import pytest
from conftest import ROOT
from trainings import begun, equal, trained

from reference.__main__ import main
from reference.paper import InputError
from reference.workshop.comparing.named import strategy_named
from reference.workshop.strategies import LEARNED, SHIPPED
from reference.workshop.training.checkpoints import CheckpointError, load_checkpoint

shipped = run_path(str(ROOT / "tutorials" / "experiments" / "ship.py"))["shipped"]


def test_both_sides_ship_as_weights_alone_in_less_than_five_megabytes():
    """Nobody learns any more; who made them is told."""
    assert SHIPPED.stat().st_size < 5e6
    checkpoint = load_checkpoint(SHIPPED)
    assert not checkpoint.learners
    for side, head in (("robots", "set"), ("fire", "mixture")):
        assert strategy_named(LEARNED, side).learned.settings.head == head
        assert checkpoint.progress[side]["decisions"][side] > 9_000


def test_the_robots_of_one_training_and_the_fire_of_another_ship(tmp_path):
    """The file's policies are those of the two checkpoints, to the last bit."""
    robots, fire = (
        load_checkpoint(trained(begun(fixed={other: (script,)}), tmp_path / other))
        for other, script in (("fire", "random"), ("robots", "sweep"))
    )
    both = shipped(robots, fire)
    for side, source in (("robots", robots), ("fire", fire)):
        assert equal(both.player(side).weights, source.player(side).weights)
    anew = shipped(load_checkpoint(SHIPPED), load_checkpoint(SHIPPED))
    # as one of its sides may stay
    assert anew.progress == load_checkpoint(SHIPPED).progress
    begun_so = replace(robots.task, initial={"robots": robots.player("robots")})
    again = shipped(replace(robots, task=begun_so), fire)
    assert not again.task.initial
    assert [again.progress[s]["initial"] for s in ("robots", "fire")] == [True, False]
    with pytest.raises(CheckpointError, match="nobody learned for the fire"):
        shipped(robots, robots)
    slow = {**robots.numbers, "HEALTH": 50.0}
    both = [replace(one, numbers=slow) for one in (robots, fire)]
    assert shipped(*both).numbers == slow
    with pytest.raises(InputError, match="learned with other numbers"):
        shipped(robots, both[1])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("robots", "fire", "claimed"),
    [(LEARNED, "random", 94.8), (LEARNED, LEARNED, 52.0), ("escort", LEARNED, 52.2)],
)
def test_the_policies_do_what_is_claimed(robots, fire, claimed, capsys):
    """The first ten of the evacuations in RESULTS.md, within their spread."""
    command = (
        f"evacuate --robots {robots} --fire {fire} --episodes 10 --seed 5000 --json"
    )
    assert main(command.split()) == 0
    facts = json.loads(capsys.readouterr().out)
    assert 100 * facts["evacuated"] / facts["people"] == pytest.approx(claimed, abs=8)
