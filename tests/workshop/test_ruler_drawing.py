"""The ruler's pictures: what is marked, where it stands, and that it can be read."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from matplotlib.colors import to_hex
from outcomes import result
from pages import overlaps, writing

from reference.evaluation.score import base_and_control, paper_ruler
from reference.paper import BETA
from reference.workshop.comparing import Cell
from reference.workshop.comparing.intervals import Interval
from reference.workshop.drawing import ruler as drawing
from reference.workshop.drawing.crossplay import evacuation_curves

B, C = base_and_control((-1200, 0.1), (1100, 1000))
FEW = type(paper_ruler())(alpha=1000, base=B, control=C, k=0.02, beta=300)
"""A ruler for four people."""


def cell(robots, fire, R, h, dR=0, dh=0):
    """A match, of which the picture shows no more: R ± dR and h ± dh."""
    half = Interval(0.5, 0.5, 0.5)
    figures = {"survival": half, "reward": Interval(R, R - dR, R + dR)}
    figures |= {"difficulty": Interval(h, h - dh, h + dh), "score": half}
    return Cell(robots=robots, fire=fire, n=9, **figures)


def cells(count, folder=""):
    """Matches as an evaluation has them, in two dense groups."""
    rng = np.random.default_rng(0)
    for k in range(count):
        R = 7500 + rng.normal(0, 700)
        h = (1500, 2400)[k % 2] + rng.normal(0, 60)
        yield cell(f"{folder}robots-{k}", f"fire-{k}", R, h, 300, 50)


def dots(axes):
    """(k, 2) places of all dots, in the order in which they were drawn."""
    found = [line.get_xydata() for line in axes.lines if line.get_marker() in "Dos^vPX"]
    return np.concatenate(found)


@pytest.fixture(scope="module")
def papers():
    """What a reward is worth on the paper's ruler."""
    return drawing.curve()


@pytest.mark.paper("F1")
@pytest.mark.paper("F2")
def test_the_curve_marks_both_critical_points_r_b_and_where_e_is_one(papers):
    """At the rewards that the paper names, and at 15413 where y = β."""
    R, y = dots(papers.axes[0]).T
    assert pytest.approx([-12e3, 14e3, 15e3, 15413, 0], abs=1) == R
    assert y == pytest.approx([0.1, 1000, 1425.1, BETA, 7.017], abs=0.1)


@pytest.mark.paper("F3")
def test_the_tangents_have_the_slopes_that_the_text_names(papers):
    """Which the paper rounds to 0.00004, 0.4 and 0.5."""
    drawn = [line.get_xydata() for line in papers.axes[0].lines[2:8:2]]
    slopes = [(y[1] - y[0]) / (x[1] - x[0]) for x, y in (line.T for line in drawn)]
    assert slopes == pytest.approx([3.54e-5, 0.354, 0.505], rel=2e-3)
    assert all(f"slope {slope:.3g}" in " ".join(writing(papers)) for slope in slopes)


@pytest.mark.paper("F10")
def test_e_is_one_along_the_bold_line():
    """From reward alone to difficulty alone, about 3850."""
    axes = drawing.contours(paper_ruler(), []).axes[0]
    (line,) = (lines for lines in axes.collections if 2 < lines.get_linewidth()[0] < 3)
    R, h = np.concatenate([path.vertices for path in line.get_paths()]).T
    assert paper_ruler().score(R, h) == pytest.approx(np.ones(len(R)), abs=0.01)
    assert h.max() == pytest.approx(3855, rel=5e-3)


def test_every_match_is_a_point_with_its_intervals_and_its_score():
    """Mean reward and difficulty; what lies off the ruler is left out."""
    match = cell("sweep", "random", 9000, 2000, 200, 150)
    lost = replace(cell("sweep", "none", 9e4, 0), score=None)
    figure = drawing.contours(paper_ruler(), [lost, match], caption="A house, 9 runs")
    assert "A house, 9 runs" in writing(figure)
    axes = figure.axes[0]
    assert dots(axes).tolist() == [[9000, 2000]]
    across, up = (line.get_xydata().tolist() for line in axes.lines[:2])
    assert across == [[8800, 2000], [9200, 2000]]
    assert up == [[9000, 1850], [9000, 2150]]
    score = paper_ruler().score(9000, 2000)
    assert f"sweep, fire random  {score:.2f}" in writing(figure)


def test_robots_have_the_colours_of_their_evacuation_curves():
    """Also where others, whose reward lies off the ruler, are left out."""
    lost = replace(cell("none", "random", 9e4, 0), score=None)
    own = cell("mine:Guide", "random", 9000, 2000)
    axes = drawing.contours(paper_ruler(), [lost, own]).axes[0]
    (curve,) = (
        evacuation_curves([result("mine:Guide", "random", 0, [5.0])]).axes[0].lines
    )
    assert to_hex(axes.lines[2].get_markerfacecolor()) == to_hex(curve.get_color())


def test_the_axes_of_scores_fit_their_points():
    """All points are on the page, and fill more than half of its width and height."""
    pairs = [
        cell("sweep", "random", 6000 + 900 * k, 300 + 150 * k, 90, 30) for k in range(4)
    ]
    for shown in (pairs, [*pairs, cell("none", "busiest", -2300, 1190, 90, 30)]):
        axes = drawing.contours(paper_ruler(), shown).axes[0]
        left, right = axes.get_xlim()
        low, high = axes.get_ylim()
        R, h = dots(axes).T
        assert left < R.min() and R.max() < right
        assert low < h.min() and h.max() < high
        assert np.ptp(R) > 0.5 * (right - left)
        assert np.ptp(h) > 0.5 * (high - low)


@pytest.mark.parametrize(
    "baseline", ["escort here", f"out/{'long/' * 40}checkpoint.pt"]
)
def test_the_page_says_what_e_is_one_means(baseline):
    """Above the picture, in words that fit."""
    figure = drawing.contours(paper_ruler(), list(cells(2)), baseline)
    (title,) = (words for words in writing(figure) if "Bold line: E = 1" in words)
    assert f"E = 1, as good as {baseline[:9]}" in title
    assert overlaps(figure) == []


def test_a_colour_is_a_team_and_a_shape_is_a_fire():
    """Wherever their pairs stand in the list."""
    pairs = [
        cell(robots, fire, 5000 + 500 * k, 900 * k)
        for k, (robots, fire) in enumerate(product(("none", "sweep"), "abcdefgh"))
    ]
    axes = drawing.contours(paper_ruler(), pairs).axes[0]
    drawn = axes.lines[2::3]
    colours = [line.get_markerfacecolor() for line in drawn]
    shapes = [line.get_marker() for line in drawn]
    assert colours[:8] == 8 * [colours[0]]
    assert colours[8:] == 8 * [colours[8]]
    assert colours[0] != colours[8]
    assert shapes[:8] == shapes[8:] and len({*shapes}) == 8


WHERE = f"A house, 12 people, {'a=1, ' * 30}means over 200 runs"

PAGES = {
    "for few people": lambda: drawing.curve(FEW, 1500),
    "twelve pairs": lambda: drawing.contours(paper_ruler(), list(cells(12))),
    "forty paths": lambda: drawing.contours(
        paper_ruler(), list(cells(40, "out/of-a/" * 9)), caption=WHERE
    ),
    "of few people": lambda: drawing.contours(FEW, [cell("sweep", "none", 800, 1500)]),
}


@pytest.mark.parametrize("page", PAGES)
def test_no_two_texts_overlap_and_none_is_cut_off(page):
    """Twelve pairs in two dense groups have room as well."""
    assert overlaps(PAGES[page]()) == []
