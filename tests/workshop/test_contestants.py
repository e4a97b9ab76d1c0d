"""Words for whoever plays: scripts, checkpoints, worst cases; and slips of the pen."""

import pytest
from trainings import TINY, begun, tiny

from reference.paper import Scenario
from reference.workshop.evaluation import contestants
from reference.workshop.evaluation.contestants import NAMES, Evacuation, contestant
from reference.workshop.evaluation.worst_case import WorstCase
from reference.workshop.evaluation.worst_case.critic import CriticFire
from reference.workshop.evaluation.worst_case.perturbed import EPSILON, PerturbedRobots
from reference.workshop.strategies import SCRIPTS
from reference.workshop.strategies.robots import Sweep
from reference.workshop.training.checkpoints import CheckpointError, save
from reference.workshop.training.policies import LearnedFire, LearnedRobots


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    """A checkpoint of both sides, at its beginning."""
    path = tmp_path_factory.mktemp("run") / "checkpoint-000000.pt"
    save(begun(tiny()).checkpoint(), path)
    return str(path)


@pytest.mark.parametrize("side", ["robots", "fire"])
def test_a_scripts_name_is_the_strategy_of_that_name(side):
    """A new one each time."""
    known = SCRIPTS[side]
    assert [type(contestant(name, side)) for name in known] == list(known.values())
    assert NAMES[side][: len(known)] == tuple(known)


@pytest.mark.paper("F4", "chosen")
def test_worst_case_is_the_fire_that_looks_ahead():
    """Each time another one."""
    one, other = (contestant("worst-case", "fire") for _ in range(2))
    assert isinstance(one, WorstCase) and one is not other


@pytest.mark.parametrize(
    ("word", "side", "kind"),
    [
        ("{}", "robots", LearnedRobots),
        ("{}", "fire", LearnedFire),
        ("critic:{}", "fire", CriticFire),
        ("perturbed:{}", "robots", PerturbedRobots),
        ("perturbed:0.5:{}", "robots", PerturbedRobots),
    ],
)
def test_what_a_checkpoint_can_be(path, word, side, kind):
    """By its file, and by the folder it is in."""
    for named in (path, path.rpartition("/")[0]):
        assert type(contestant(word.format(named), side)) is kind


def test_how_far_observations_are_off_stands_before_the_file(path):
    """In metres; without it they are off by EPSILON."""
    words = f"perturbed:{path}", f"perturbed:0.5:{path}"
    found = [contestant(word, "robots").epsilon for word in words]
    assert found == [EPSILON, 0.5]


def test_only_a_learned_policy_is_sampled(path):
    """As asked; scripts and worst cases have nothing to sample."""
    assert contestant(path, "robots", sample=True).sample
    assert isinstance(contestant("sweep", "robots", sample=True), Sweep)
    assert not contestant(f"perturbed:{path}", "robots", sample=True).sample


def test_a_strategy_remembers_nothing_of_the_evacuation_before(monkeypatch):
    """It begins each as it was made, though it is made once."""
    made = WorstCase()
    monkeypatch.setattr(contestants, "_loaded", lambda *_: made)
    evacuation = Evacuation(TINY, Scenario(people=2), "sweep", "worst-case", seed=0)
    for _ in range(2):
        fire = evacuation.simulation().fire_strategy
        assert fire.foreseen == []
        fire.foreseen.append("something")


@pytest.mark.parametrize(
    ("word", "side", "message"),
    [
        ("swep", "robots", "names nobody who plays the robots.*mean 'sweep'"),
        ("worst_case", "fire", "mean 'worst-case'"),
        ("worst-case", "robots", "names nobody who plays the robots: none, random"),
        ("sweep", "fire", "'sweep' is no file"),
        ("critic:nowhere.pt", "fire", "'nowhere.pt': there is no such file"),
        ("critic:", "fire", "'': there is no such file. Name a checkpoint"),
        ("perturbed:0.5", "robots", "there is no such file. Name a checkpoint"),
        ("perturbed:-1:{}", "robots", "give metres from 0 upwards"),
    ],
)
def test_refuses_a_word_that_means_nothing(path, word, side, message):
    """With the nearest that does, or what is missing."""
    with pytest.raises(ValueError, match=message):
        contestant(word.format(path), side)


def test_refuses_a_folder_without_a_checkpoint(tmp_path):
    """As for a policy."""
    with pytest.raises(CheckpointError, match="there is no checkpoint in this folder"):
        contestant(f"critic:{tmp_path}", "fire")
