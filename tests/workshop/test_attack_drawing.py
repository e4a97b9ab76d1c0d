"""The picture of worst cases: what is drawn is what was measured, and is readable."""

import numpy as np
import pytest
from matplotlib.colors import to_hex
from pages import overlaps, writing

from reference.paper import Scenario
from reference.workshop.drawing import attack
from reference.workshop.evaluation.contestants import Evacuation
from reference.workshop.evaluation.gap import Comparison, Result, gap

FIRES = ("random", "greedy", "critic:out/robots-0/checkpoint-000245.pt", "worst-case")


def results(count=12, fires=FIRES, foreseen=-900.0):
    """Moments at which each fire does more harm than the last."""
    rng = np.random.default_rng(0)
    evacuation = Evacuation("", Scenario(), "sweep", "random", 0)
    comparison = Comparison(evacuation, fires, before=0, futures=4)

    def one(level):
        harms = {fire: 500.0 * k for k, fire in enumerate(fires)}
        rewards = {f: tuple(level - h - rng.normal(0, 50, 4)) for f, h in harms.items()}
        return Result(comparison, rewards | {"none": (level,) * 4}, level + foreseen)

    return [one(level) for level in rng.uniform(-5000, 5000, count)]


@pytest.mark.paper("F4", "chosen")
def test_each_fire_has_a_row_with_its_harm_and_interval():
    """Of the mean over moments, as `gap` tells it; a faint dot for each moment."""
    found = results()
    (left,) = attack.figure(found).axes
    bars = [line for line in left.lines if line.get_linewidth() == 3]
    assert len(bars) == len(FIRES)
    for row, (bar, fire) in enumerate(zip(bars, FIRES, strict=True)):
        mean, low, high = gap(found, "none", fire)
        assert bar.get_xdata().tolist() == pytest.approx([low, mean, high])
        assert set(bar.get_ydata()) == {row}
    dots = [line for line in left.lines if line.get_marker() == "."]
    assert [len(line.get_xdata()) for line in dots] == [12] * len(FIRES)


@pytest.mark.paper("F4", "chosen")
def test_what_looking_ahead_foresaw_stands_beside_what_came():
    """900 less was foreseen, 1500 less came; without `worst-case` there is neither."""
    (left,) = attack.figure(results()).axes
    (mark,) = [line for line in left.lines if line.get_marker() == "D"]
    assert to_hex(mark.get_markeredgecolor()) == attack.FORESEEN
    assert mark.get_xdata()[0] == pytest.approx(900) and mark.get_ydata()[0] == 3
    (left,) = attack.figure(results(fires=FIRES[:2])).axes
    assert not [line for line in left.lines if line.get_marker() == "D"]


@pytest.mark.parametrize(
    ("fires", "count"), [(FIRES[:1], 1), (FIRES + tuple("abcd"), 40)]
)
def test_nothing_overlaps_and_nothing_is_clipped(fires, count):
    """However many fires and moments there are."""
    assert overlaps(attack.figure(results(count, fires))) == []


def test_the_caption_says_what_stands_behind_it():
    """How many moments, futures, and which robots."""
    text = writing(attack.figure(results()))
    (caption,) = [t for t in text if t.startswith("robots: sweep")]
    assert "12 moments" in caption and "4 fresh futures" in caption
