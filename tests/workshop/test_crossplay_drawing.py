"""Pictures of a cross-play: who beats whom, and how fast people get out."""

import numpy as np
import pytest
from pages import overlaps

from reference.evaluation.score import PAPER
from reference.workshop.crossplay import RunResult, cells
from reference.workshop.drawing.crossplay import curves, matrix, names

ROBOTS = (
    "none",
    "sweep",
    "patrol",
    "nearest",
    "out/laptop-a/checkpoint-000120.pt",
    "out/laptop-b/checkpoint-000120.pt",
    "out/laptop-c",
    "random",
)
FIRES = (
    "none",
    "random",
    "greedy",
    "worst-case",
    "out/laptop",
    "out/another/laptop",
    "out/a-folder-with-a-name-that-nobody-types-twice",
    "$x_1$",
)


def results(robots, fires, runs=5):
    """Runs made up: the further down or right a match stands, the fewer get out."""
    rng = np.random.default_rng(0)
    return [
        result(robot, fire, seed, rng.gamma(4, 10, max(0, 40 - 3 * k - 2 * j)))
        for k, robot in enumerate(robots)
        for j, fire in enumerate(fires)
        for seed in range(runs)
    ]


def result(robots, fire, seed, out):
    """A run of forty people, of whom some are out at these times."""
    times = tuple(sorted(out.tolist()))
    last = times[-1] if times else None
    number = len(times)
    saved = (40, number, 40 - number, 0, number / 40)
    return RunResult(robots, fire, seed, *saved, 0.0, 100.0, last, last, 200.0, times)


SIZES = [(1, 1), (8, 8)]


# -- Who beats whom -----------------------------------------------------------------


@pytest.mark.parametrize("size", SIZES)
def test_nothing_in_a_matrix_overlaps(size):
    """From one match to eight by eight, with checkpoints among the names."""
    found = results(ROBOTS[: size[0]], FIRES[-size[1] :], runs=2)
    assert overlaps(matrix(cells(found, PAPER))) == []


@pytest.mark.paper("F12")
def test_every_match_is_a_box_with_its_mean_and_interval():
    """Robots go down, fires across."""
    found = cells(results(("none", "sweep"), ("random",)), PAPER)
    page = matrix(found)
    (axes,) = (axes for axes in page.axes if axes.get_xlabel() == "fire")
    written = [(*text.get_position(), text.get_text()) for text in axes.texts]
    assert [text for *_, text in sorted(written, key=lambda t: t[1])] == [
        f"{found[0].survival.mean:.1%}"[:-1],
        "[{:.1f}, {:.1f}]".format(*(100 * v for v in found[0].survival[1:])),
        f"{found[1].survival.mean:.1%}"[:-1],
        "[{:.1f}, {:.1f}]".format(*(100 * v for v in found[1].survival[1:])),
    ]
    assert [tick.get_text() for tick in axes.get_yticklabels()] == ["none", "sweep"]


def test_orange_is_where_the_fire_wins_and_blue_where_the_robots_do():
    """Told apart by every eye; half of the people is white between them."""
    runs = [result("one", "none", 0, np.ones(40)), result("two", "none", 0, np.ones(0))]
    page = matrix(cells(runs, PAPER))
    page.draw_without_rendering()
    one, two = page.axes[0].collections[0].get_facecolors()
    assert one[2] > one[0] + 0.3
    assert two[0] > two[2] + 0.3


def test_a_single_run_has_no_interval():
    """An interval without width would look like certainty."""
    page = matrix(cells(results(("none",), ("random",), runs=1), PAPER))
    assert [t.get_text() for t in page.axes[0].texts if "[" in t.get_text()] == []
    assert page.legends[0].get_title().get_text().startswith("one run a match")


# -- Names --------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("given", "short"),
    [
        (["sweep", "out/laptop"], ["sweep", "laptop"]),
        (["a/run", "b/run"], ["a\nrun", "b\nrun"]),
        (["out/run/checkpoint-000120.pt"], ["run\ncheckpoint-000120"]),
        (["an-exceedingly-long-folder"], ["an-exceedin…-long-folder"]),
        (["x" * 30, "x" * 31], [f"{'x' * 11}…{'x' * 12} ({k})" for k in (1, 2)]),
    ],
)
def test_names_are_short_and_all_different(given, short):
    """Of a path no more than tells it from the others."""
    assert names(given) == short


# -- How fast people get out --------------------------------------------------------


@pytest.mark.parametrize("size", SIZES)
def test_nothing_among_the_curves_overlaps(size):
    """The legend is whole, and below the panels."""
    found = results(ROBOTS[: size[0]], FIRES[-size[1] :], runs=1)
    assert overlaps(curves(found)) == []


def test_a_curve_ends_at_the_mean_survival_within_its_band():
    """A panel for each fire, a line for each robots."""
    runs = results(("none", "sweep"), ("random", "greedy"))
    panels = curves(runs).axes
    assert len(panels) == 2
    mean = cells(runs, PAPER)[0].survival.mean
    line, band = panels[0].lines[0], panels[0].collections[0].get_paths()[0]
    assert line.get_ydata()[-1] == pytest.approx(100 * mean)
    low, high = band.get_extents().y0, band.get_extents().y1
    assert low <= 100 * mean <= high


# -- Refusals -----------------------------------------------------------------------


def test_refuses_to_draw_nothing():
    """One message for people."""
    with pytest.raises(ValueError, match="nothing to draw"):
        curves([])
    with pytest.raises(ValueError, match="nothing to draw"):
        matrix([])
