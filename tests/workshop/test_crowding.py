"""Where people were dense and where they died: counts, and the picture of them."""

import weakref
from types import SimpleNamespace

import numpy as np
import pytest
from movies import shipped, stage
from pages import overlaps, writing

from reference.building import Kind
from reference.fire import RandomFire
from reference.paper import Scenario
from reference.simulation import Simulation
from reference.workshop.drawing import crowding_map
from reference.workshop.measuring.crowding import Crowding, measure_crowding
from reference.world import Fate

ROOMS = """#########
           #pq.#r..#
           #s..+...E
           #...#...#
           #########"""


def test_density_is_people_per_square_metre_of_floor_around():
    """Three people on the four square metres of a corner; no wall counts as floor."""
    simulation = stage(ROOMS)
    seen = Crowding()
    seen.watch(simulation)()
    (density,) = seen.density
    (kind,) = simulation.building.kind
    assert density[1, 1] == 3 / 4
    assert density[1, 3] == 1 / 5  # q, on four cells and a door; r is two metres away
    assert density[3, 7] == 0
    assert not density[kind == Kind.WALL].any()


@pytest.mark.paper("B7")
def test_everybody_who_died_is_counted_where_they_lie():
    """Over all evacuations together; density is the mean of each one's highest."""
    rule = Scenario(people=12, time_limit=40.0)
    tiny = shipped("tiny")
    runs = [Simulation(tiny, rule, fire=RandomFire(), seed=seed) for seed in (1, 2)]
    for run in runs:
        run.world.bodies.health[:4] = 1.0
    seen = measure_crowding(runs)
    dead = [run.world.bodies.fate == Fate.DEAD for run in runs]
    assert (seen.runs, seen.building) == (2, tiny)
    assert seen.deaths.sum() == sum(map(np.sum, dead)) >= 8
    places = [run.world.bodies.place[who] for run, who in zip(runs, dead, strict=True)]
    assert set(np.flatnonzero(seen.deaths)) == set(np.concatenate(places))
    assert 0 < seen.density.max() <= 12


def test_each_evacuation_counts_as_much_as_any_other_and_is_not_kept():
    """The mean of the highest densities; the dead of all."""
    seen = Crowding()
    kept = []
    for number in range(3):
        simulation = stage(ROOMS)
        bodies = simulation.world.bodies
        bodies.fate[:number] = Fate.DEAD
        note = seen.watch(simulation)
        note()
        kept.append(weakref.ref(seen._last_highest))
    assert seen.runs == 3 and seen.deaths.sum() == 0 + 1 + 2
    assert seen.density[0, 1, 1] == pytest.approx((3 + 2 + 1) / 4 / 3)
    del note
    assert [ref() is None for ref in kept] == [True, True, False]


def test_the_picture_says_over_how_many_evacuations_and_how_many_died():
    """Below a long name, too; nothing overlaps, and no cross is explained in vain."""
    tiny = shipped("tiny")
    deaths = np.zeros(tiny.kind.shape, dtype=int)
    deaths[0, 3, 5] = 2
    density = np.where(tiny.walkable, 0.5, 0.0)
    seen = SimpleNamespace(building=tiny, runs=7, density=density, deaths=deaths)
    figure = crowding_map(seen)
    assert "Tiny office: 7 evacuations, 2 died" in writing(figure)
    assert "died here (larger: more people)" in writing(figure)
    density = "highest people per m², in 3 m x 3 m,\nmean of 7 evacuations"
    assert {density, "density: people on stairs are not counted"} <= {*writing(figure)}
    assert overlaps(figure) == []
    name = "out/with-a-very-long-name/seed-3/checkpoints/checkpoint-000120.pt"
    seen.deaths = 0 * deaths
    said = " ".join(writing(crowding_map(seen, f"guided by {name}, no fire")))
    assert "7 evacuations, 0 died" in said and "died here" not in said
    assert "Tiny office, guided by out/" in said
    short = " ".join(writing(crowding_map(seen, "guided by escort, no fire")))
    assert "Tiny office, guided by escort, no fire: 7 evacuations, 0 died" in short


def test_rooms_are_named_in_a_corner_below_the_crosses():
    """A cross in the middle of each room hides no name; each lies in its own room."""
    institute = shipped("paper")
    deaths = np.where(institute.walkable, 1, 0)
    density = np.where(institute.walkable, 0.5, 0.0)
    seen = SimpleNamespace(building=institute, runs=1, density=density, deaths=deaths)
    figure = crowding_map(seen)
    figure.draw_without_rendering()
    named = 0
    for floor in range(institute.floors):
        axes = figure.axes[floor]
        (crosses,) = axes.collections
        for text in axes.texts:
            assert text.get_zorder() < crosses.get_zorder()
            assert text.get_path_effects()  # it is read where people were densest
            box = text.get_window_extent().transformed(axes.transData.inverted())
            cells = [(floor, *institute.cell(x, y)) for x, y in box.corners()]
            (area,) = {int(institute.area[cell]) for cell in cells}
            assert institute.areas[area].name == text.get_text()
            named += 1
    assert named > 30
