"""Rows of the engine's tables: what the book's Sight sees from every place."""

import numpy as np
import pytest
from movies import GAPS, shipped

pytest.importorskip("numba")

from reference.building import Kind, building_of
from reference.navigation import navigation_of
from reference.rays import Sight, sight_of
from reference.workshop.engine import engine_is_ready
from reference.workshop.engine.rows import (
    GROUND,
    IN_LINE,
    SEEN,
    SEEN_ON_ALL_SIDES,
    cast_rays,
    sight_made_quickly,
)
from reference.workshop.engine.tables import Tables
from reference.workshop.maps.generated import generated_text


def places_with(tables: Tables, number: int, p: int, bit: int) -> set[int]:
    """The places in a row that have a bit."""
    k = np.flatnonzero(tables.arrays.square[number] & bit)
    down, right = np.divmod(k, tables.side)
    cols = tables.navigation.cols
    return set((p + (down - tables.half) * cols + right - tables.half).tolist())


def compare(sight: Sight, tables: Tables, p: int, holes: frozenset[int]) -> None:
    """Assert that the newest row is what the book says."""
    number = tables._ends["rows"] - 1
    row = tables.arrays.rows[number]
    assert (
        row["place"],
        tables.arrays.lists[row["holes"] : row["holes_end"]].tolist(),
    ) == (
        p,
        sorted(holes),
    )
    line = sight.in_line(p, holes)
    assert places_with(tables, number, p, IN_LINE) == line
    assert places_with(tables, number, p, SEEN) == sight.seen(p, holes)
    assert places_with(tables, number, p, GROUND) == (line & sight.rooms or line)
    if not holes:
        assert places_with(
            tables, number, p, SEEN_ON_ALL_SIDES
        ) == sight.seen_on_all_sides(p)
    looked = tables.arrays.lists[row["looked"] : row["looked_end"]]
    assert looked.tolist() == sorted(sight.looked_at(p, holes))
    opens = tables.arrays.opens[row["opens"] : row["opens_end"]]
    ways = [(*way.unit, way.patch, way.place) for way in sight.open(p, holes)]
    assert opens.tolist() == ways

    hits = []
    stops = sorted(sight._stops(p, holes))
    for mark, hit in sight.landmarks(p, holes).items():
        met = [q for q in stops if sight._marks[q] == mark]
        end = min(met, key=lambda q: sight._metres(p, q))
        kind = int(Kind[hit.kind.upper()])
        hits.append((hit.distance, mark, kind, end, mark in sight.landmarks(p)))
    found = tables.arrays.hits[row["hits"] : row["hits_end"]]
    assert found.tolist() == hits


@pytest.mark.paper("A6", "B2")
@pytest.mark.parametrize("reach", [2.0, 15.0])
@pytest.mark.parametrize("name", ["tiny", "museum", "school", "lot", "gaps"])
def test_a_row_is_what_the_book_sees(name, reach):
    """From a sample of places, through no holes, some doors and all of them."""
    assert engine_is_ready()
    plans = {"lot": generated_text(11, 40, 18, 3), "gaps": GAPS}
    building = building_of(plans[name]) if name in plans else shipped(name)
    sight = sight_of(building, reach)
    tables = Tables(sight)
    rng = np.random.default_rng(0)
    doors = [m.index for m in building.landmarks if m.kind is Kind.DOOR]
    walked = np.flatnonzero(navigation_of(building).walkable)
    for p in rng.permutation(walked)[:25].tolist():
        some = rng.choice(doors, min(3, len(doors)), replace=False).tolist()
        for holes in ([], some, doors):
            tables.add_row(p, frozenset(holes))
            compare(sight, tables, p, frozenset(holes))


@pytest.mark.paper("B1")
@pytest.mark.parametrize("reach", [2.0, 9.5, 400.0])
def test_rays_are_cast_as_by_the_book(reach):
    """The same tables, in buildings of odd shapes, at any range."""
    assert engine_is_ready()
    for building in (shipped("school"), building_of(generated_text(12, 31, 17, 2))):
        book = Sight(building, reach)
        again = Sight(building, reach)
        again.hits = np.full_like(book.hits, -1)
        again.ends = np.full_like(book.ends, -1)
        cast_rays(again, again._clear.reshape(building.kind.shape))
        assert np.array_equal(book.hits, again.hits)
        assert np.array_equal(book.ends, again.ends)
    made = sight_made_quickly(building, reach)
    assert made is sight_of(building, reach) and type(made) is Sight
    assert np.array_equal(made.hits, book.hits)
