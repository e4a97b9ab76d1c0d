"""Words for whoever plays: scripts, checkpoints, worst cases; and slips of the pen."""

import pytest
from trainings import begun, tiny

from reference.workshop.crossplay import begin
from reference.workshop.crossplay.contestants import contestant
from reference.workshop.training.checkpoints import save
from reference.workshop.training.policies import POLICIES


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    """A checkpoint of both sides, at its beginning."""
    path = tmp_path_factory.mktemp("run") / "checkpoint-000000.pt"
    save(begun(tiny()).checkpoint(), path)
    return str(path)


@pytest.mark.parametrize(("side", "kind"), POLICIES.items())
def test_a_file_is_the_policy_that_was_learned_for_a_side(path, side, kind):
    """And so is the folder it is in."""
    for named in (path, path.rpartition("/")[0]):
        assert type(contestant(named, side)) is kind


def test_each_run_has_strategies_of_its_own_and_the_worst_case_knows_whom_it_meets():
    """They begin as they were made, though they are made once."""
    evaluation = begin(("patrol",), ("worst-case",), "tiny", people=2)
    runs = [evaluation.simulation(*run) for run in evaluation.runs[:2]]
    one, other = (run.robot_strategy for run in runs)
    assert one is not other and vars(one) == vars(other)
    assert all(run.fire_strategy.robots is run.robot_strategy for run in runs)
    assert runs[0].fire_strategy.scenario == evaluation.arena.scenario


@pytest.mark.parametrize(
    ("word", "side", "message"),
    [
        ("swep", "robots", "names nobody who plays the robots.*mean 'sweep'"),
        ("worst_case", "fire", "mean 'worst-case'"),
        ("worst-case", "robots", "names nobody who plays the robots: none, random"),
        ("sweep", "fire", "'sweep' is no file"),
    ],
)
def test_refuses_a_word_that_means_nothing(word, side, message):
    """With the nearest that does."""
    with pytest.raises(ValueError, match=message):
        contestant(word, side)
