"""The picture of both measures of the difficulty: a dot for each fire."""

import numpy as np
import pytest
from pages import overlaps, writing

from reference.evaluation.difficulty import HARDEST
from reference.workshop.drawing import agreement as drawing
from reference.workshop.evaluation.agreement import KINDS, Measured, agreement


def fires(count=60, most=8, kinds=tuple(KINDS)):
    """So many fires, the harder the more sources they have."""
    rng = np.random.default_rng(0)
    found = []
    for k in range(count):
        n = k % (most + 1)
        h = HARDEST * rng.uniform(0, (n + 1) / (most + 1))
        loss = 2 * h + rng.normal(0, 1500)
        found.append(Measured(kinds[k % len(kinds)], n, k, h, loss))
    return agreement(found)


@pytest.mark.paper("F11")
def test_every_fire_is_a_dot_where_both_measures_put_it():
    """h to the right, what unguided people lose upwards; a marker for each kind."""
    measured = fires()
    axes = drawing.figure(measured).axes[0]
    dots = np.concatenate([c.get_offsets() for c in axes.collections])
    pairs = np.array([(fire.difficulty, fire.loss) for fire in measured.fires])
    np.testing.assert_allclose(np.sort(dots, axis=0), np.sort(pairs, axis=0))
    assert len(axes.collections) == len(KINDS)
    assert axes.get_xlim()[1] > HARDEST


def test_the_picture_tells_both_coefficients():
    """And how many fires it shows."""
    measured = fires()
    figure = drawing.figure(measured)
    assert any("60 fires" in text for text in writing(figure))
    told = figure.axes[0].get_title("left")
    for name in ("spearman", "pearson", "within"):
        assert f"{getattr(measured, name):.2f}" in told


def test_equally_many_sources_have_one_colour():
    """Whatever the kind of fire; another number has another."""
    measured = fires()
    figure = drawing.figure(measured)
    figure.draw_without_rendering()
    axes = figure.axes[0]
    ink = {}
    for dots in axes.collections:
        for xy, colour in zip(dots.get_offsets(), dots.get_facecolors(), strict=True):
            ink[tuple(np.round(xy, 6))] = tuple(colour)
    by_number = {}
    for fire in measured.fires:
        place = (round(fire.difficulty, 6), round(fire.loss, 6))
        by_number.setdefault(fire.sources, set()).add(ink[place])
    assert all(len(colours) == 1 for colours in by_number.values())
    assert len(set.union(*by_number.values())) == 9


@pytest.mark.parametrize("most", [2, 12])
def test_no_words_overlap_and_all_lie_on_the_page(most):
    """For few sources and for more than the paper has."""
    assert overlaps(drawing.figure(fires(most=most))) == []


def test_the_legend_names_the_kinds_that_there_are():
    """And no others."""
    (legend,) = drawing.figure(fires(kinds=("greedy", "random"))).legends
    told = [text.get_text() for text in legend.get_texts()]
    assert told == ["where most people are about to pass", "at a random place"]
