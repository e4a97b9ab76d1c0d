"""Pictures of a cross-play: who beats whom, and how fast people get out."""

import numpy as np
import pytest
from matplotlib.colors import to_rgb
from outcomes import result
from pages import overlaps, to_lab, writing

from reference.evaluation.score import paper_ruler
from reference.workshop.comparing import cells
from reference.workshop.comparing.results import mean_and_interval
from reference.workshop.drawing.colours import OF_THOSE_THAT_SHIP, OTHERS, lines_of
from reference.workshop.drawing.crossplay import (
    MEANS_OVER,
    evacuation_curves,
    matrix,
)
from reference.workshop.strategies import ANY_MAP, LEARNED
from reference.workshop.strategies import ROBOTS as ROBOTS_THAT_SHIP

ROBOTS = ["none", *(f"out/laptop-{k}/checkpoint-000120.pt" for k in range(25))]
FIRES = [*"abcdef", "out/a-folder-with-a-name-that-nobody-types-twice", "$x_1$"]


def results(robots, fires, runs=5):
    """Runs made up: the further down or right a match stands, the fewer get out."""
    rng = np.random.default_rng(0)
    return [
        result(robot, fire, seed, sorted(rng.gamma(4, 10, max(0, 40 - 3 * k - 2 * j))))
        for k, robot in enumerate(robots)
        for j, fire in enumerate(fires)
        for seed in range(runs)
    ]


@pytest.mark.parametrize("size", [(1, 1), (8, 8), (26, 1)])
def test_nothing_overlaps_in_either_picture(size):
    """From one match to many, with checkpoints among the names; nor do curves agree.

    Below stands where and over what.
    """
    found = results(ROBOTS[: size[0]], FIRES[-size[1] :], runs=2)
    told = f"A house of many rooms, 12 people, {'a=1, ' * 20}: {MEANS_OVER}"
    assert overlaps(matrix(cells(found, paper_ruler()), told)) == []
    figure = evacuation_curves(found, told)
    assert "intervals" in " ".join(writing(figure.legends[0]))
    assert overlaps(figure) == []
    looks = [
        (line.get_color(), line.get_linestyle(), line.get_linewidth())
        for line in figure.axes[0].lines
    ]
    assert len({*looks}) == size[0]


NAMES = [*ROBOTS, *OF_THOSE_THAT_SHIP, *(f"mine:Guide{k}" for k in range(40))]


def test_a_strategy_has_one_colour_whoever_else_is_compared():
    """In every evaluation, in whatever order; what ships has one of its own."""
    alone = {name: lines_of([name])[name]["color"] for name in NAMES}
    for names in (NAMES, NAMES[::-1], ["mine:Guide3", "escort"]):
        together = {name: look["color"] for name, look in lines_of(names).items()}
        assert together == {name: alone[name] for name in together}
    assert len({*alone.values()}) == 8 + len(OTHERS)
    assert {alone[name] for name in NAMES if name not in OF_THOSE_THAT_SHIP} == {
        *OTHERS
    }


def test_every_robots_that_ship_have_a_colour():
    """None is taken for somebody's own."""
    assert {*ROBOTS_THAT_SHIP, LEARNED, ANY_MAP} == OF_THOSE_THAT_SHIP.keys()


def test_own_code_looks_like_nothing_that_ships():
    """By far more than the just noticeable difference of 2.3, in CIE L*a*b*."""
    own, ships = (
        to_lab(np.array([to_rgb(colour) for colour in colours]) ** 2.2)
        for colours in (OTHERS, [colour for colour, _ in OF_THOSE_THAT_SHIP.values()])
    )
    apart = np.linalg.norm(own[:, None] - ships[None], axis=2)
    assert apart.min() > 25


def test_a_line_of_own_code_is_seen_on_white_and_is_not_dotted():
    """A student looks for it; dots are those of nobody who guides."""
    own = [name for name in NAMES if name not in OF_THOSE_THAT_SHIP]
    looks = lines_of(own).values()
    assert all(look["ls"] != ":" for look in looks)
    colours = np.array([to_rgb(look["color"]) for look in looks])
    assert to_lab(colours**2.2)[:, 0].max() < 70  # lightness, of 100


@pytest.mark.paper("F12")
def test_every_match_is_a_box_with_its_mean_and_interval():
    """Robots go down, fires across; a single run has no interval."""
    for runs in (5, 1):
        found = cells(results(("none", "sweep"), ("random",), runs), paper_ruler())
        page = matrix(found)
        axes = page.axes[0]
        written = [text.get_text() for text in axes.texts]
        expected = [mean_and_interval(cell, "survival") for cell in found]
        assert [text.split("\n") for text in written] == [
            [mean, interval] if runs > 1 else [mean] for mean, interval in expected
        ]
        told = page.get_supxlabel()
        assert ("intervals" in told, "one run" in told) == (runs > 1, runs == 1)
        assert [text.get_position()[1] for text in axes.texts] == [0, 1]
        assert [t.get_text() for t in axes.get_yticklabels()] == ["none", "sweep"]
        assert ("[" in written[0]) == (runs > 1)


def test_orange_is_where_the_fire_wins_and_blue_where_the_robots_do():
    """Told apart by every eye; half of the people is white between them."""
    figure = matrix(cells(results(("none",), ("none",)), paper_ruler()))
    image = figure.axes[0].images[0]
    lost, won = image.to_rgba([0.0, 1.0])[:, :3]
    assert won[2] > won[0] + 0.3
    assert lost[0] > lost[2] + 0.3


def test_a_curve_ends_at_the_mean_survival_within_its_band():
    """A panel for each fire, a line for each robots."""
    runs = results(("none", "sweep"), ("random", "greedy"))
    panels = evacuation_curves(runs).axes
    assert len(panels) == 2
    mean = cells(runs, paper_ruler())[0].survival.mean
    line = panels[0].lines[0]
    band = panels[0].collections[0].get_paths()[0].get_extents()
    assert line.get_ydata()[-1] == pytest.approx(100 * mean)
    assert band.y0 <= 100 * mean <= band.y1


@pytest.mark.parametrize(("runs", "told"), [(1, ""), (2, ", with 95 % intervals")])
def test_a_title_promises_intervals_where_there_are_some(runs, told):
    """One run has none."""
    figure = evacuation_curves(results(("none",), ("random",), runs))
    assert figure.get_suptitle() == f"Evacuation curves{told}"


def test_seconds_stand_below_every_column_of_curves():
    """The second and third of four panels stand over empty places."""
    figure = evacuation_curves(results(("none",), [*"abcd"], runs=2))
    labels = [axes.get_xlabel() for axes in figure.axes]
    assert labels == ["", *["seconds"] * 3]
    assert [axes.get_ylabel() for axes in figure.axes[1:3]] == ["", ""]
