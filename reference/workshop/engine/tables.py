"""What never moves, from the book's `Navigation` and `Sight`: no geometry of its own.

What is seen from a place depends on the holes in view [A6]: each (place, holes) that
somebody stood in has a row, made by `rows` when it is first asked for.

    p  place;  L  landmarks;  S  places of a floor;  row  a place and holes in view
"""

from collections.abc import Iterable
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from reference.building import Kind
from reference.navigation import Navigation, navigation_of
from reference.rays import Sight
from reference.workshop.engine.keeping import kept_with
from reference.workshop.engine.rows import Room, Still, cells_along, fill_row
from reference.workshop.engine.ways import Ways, ways_of


def record_kind(**kinds: str) -> np.dtype:
    """Make a kind of records, once: numba is slow with an equal one.

    See `findings/numba_equal_record_dtypes_are_not_equally_fast.sh`.
    """
    return np.dtype(list(kinds.items()), align=True)


CELL = record_kind(
    x="f8", y="f8", to_landmarks="f8", down="i4", right="i4", mark="i4", area="i4",
    patch="i4", row="i4", walkable="u1", outside="u1",
)  # fmt: skip
MARK = record_kind(
    x="f8", y="f8", width="f8", floor="i4", kind="i4", stairwell="i4", leads_out="i4"
)
WELL = record_kind(
    lowest="i4", cells="i4", cells_end="i4", landings="i4", landings_end="i4"
)
ROW = record_kind(
    place="i4", next="i4", holes="i4", holes_end="i4", hits="i4", hits_end="i4",
    opens="i4", opens_end="i4", looked="i4", looked_end="i4",
)  # fmt: skip
HIT = record_kind(distance="f8", mark="i4", kind="i4", end="i4", of_room="i4")
OPEN = record_kind(x="f8", y="f8", patch="i4", place="i4")
LANDING = record_kind(place="i4", mark="i4", beyond="i4")
NUMBERS = record_kind(half="i8", side="i8", cols="i8", reach="i8", well="f8")


class Arrays(NamedTuple):
    """The tables as compiled functions take them."""

    cells: np.ndarray  # (places,) CELL
    marks: np.ndarray  # (L,) MARK
    wells: np.ndarray  # WELL
    landings: np.ndarray  # LANDING
    waypoint: np.ndarray  # (L, S) see Navigation
    after: np.ndarray  # (L, S) the next place, cell by cell
    clear: np.ndarray  # (places, k) bool, see StraightLines
    ways: Ways  # what ways are found with
    rows: np.ndarray  # ROW
    square: np.ndarray  # (rows, side * side) bits, of the square around a place
    hits: np.ndarray  # HIT, of rows in turn
    opens: np.ndarray  # OPEN
    lists: np.ndarray  # holes and patches looked at; cells of stairwells


class Tables:
    """The tables of one Sight, which grow."""

    def __init__(self, sight: Sight):
        """Build what does not depend on who stands where."""
        nav = navigation_of(sight.building)
        building = sight.building
        self.navigation = nav
        self.half = int(sight.reach) + 1
        self.side = 2 * self.half + 1
        self.patches = int(sight.patches.max()) + 2
        self._ends = {"rows": 0, "hits": 0, "opens": 0, "lists": 0}

        cells = np.zeros(nav.places, CELL)
        cells["x"], cells["y"] = nav.centres.T
        cells["to_landmarks"] = nav.to_landmarks
        cells["down"], cells["right"] = np.divmod(np.arange(nav.places), nav.cols)
        cells["mark"] = building.landmark.ravel()
        cells["area"] = building.area.ravel()
        cells["patch"] = sight.patches
        cells["row"] = -1
        cells["walkable"] = nav.walkable
        cells["outside"] = building.kind.ravel() == Kind.OUTSIDE

        marks = np.zeros(len(building.landmarks), MARK)
        after = np.zeros((len(marks), nav.floor_size), np.int32)
        for k, mark in enumerate(building.landmarks):
            marks[k] = (
                *mark.position, mark.width, mark.floor, int(mark.kind),
                mark.stairwell, mark.leads_out,
            )  # fmt: skip
            goals = tuple(nav.goals[k].tolist())
            after[k] = nav._search_floor(mark.floor, None, goals)[1]

        self.arrays = Arrays(
            cells=cells,
            marks=marks,
            wells=np.zeros(len(building.stairwells), WELL),
            landings=_landings(nav),
            waypoint=_only_read(nav.waypoint),
            after=after,
            clear=nav.clear.table,
            ways=ways_of(nav),
            rows=np.zeros(64, ROW),
            square=np.zeros((64, self.side * self.side), np.uint8),
            hits=np.zeros(256, HIT),
            opens=np.zeros(256, OPEN),
            lists=np.zeros(1024, np.int32),
        )
        self._wells(nav)
        self._still = _still(sight, self.arrays, self.half, self.side)
        rays = len(sight.hits)
        self._most = {
            "hits": len(marks),
            "opens": rays,
            "lists": self.side * self.side + 1,
        }
        nothing = np.zeros(0)
        self._found = Room(
            square=nothing,
            hits=nothing,
            opens=nothing,
            looked=nothing,
            counts=np.zeros(3, np.int64),
            stops=np.zeros(rays, np.int64),
            metres=np.zeros(rays),
            plain=np.zeros(len(marks), bool),
        )

    def _wells(self, nav: Navigation) -> None:
        end = 0
        for k, well in enumerate(nav.building.stairwells):
            first, last = self._append_list(nav.places_of(0, well.cells).tolist())
            begin = end
            end += sum(len(nav.goals[m]) for m in well.entrances[well.lowest])
            self.arrays.wells[k] = (well.lowest, first, last, begin, end)

    # -- Rows -----------------------------------------------------------------------

    def add_row(self, p: int, holes: frozenset[int]) -> None:
        """Add what is seen from a place through these holes."""
        number = self._room("rows", 1)
        self._grow("square", number + 1)
        for name in ("hits", "opens", "lists"):
            self._grow(name, self._ends[name] + self._most[name])
        arrays = self.arrays
        first = dict(self._ends)
        found = self._found._replace(
            square=arrays.square[number],
            hits=arrays.hits[first["hits"] :],
            opens=arrays.opens[first["opens"] :],
            looked=arrays.lists[first["lists"] :],
        )
        fill_row(self._still, found, p, np.array(sorted(holes), np.int32))

        row = arrays.rows[number]
        row["place"] = p
        for name, key, count in zip(
            ("hits", "opens", "lists"),
            ("hits", "opens", "looked"),
            found.counts.tolist(),
            strict=True,
        ):
            self._ends[name] += count
            row[key] = first[name]
            row[f"{key}_end"] = self._ends[name]
        row["holes"], row["holes_end"] = self._append_list(sorted(holes))

        # the row without holes comes first: others are asked for after it
        cell = self.arrays.cells[p]
        row["next"] = -1
        if cell["row"] < 0:
            cell["row"] = number
        else:
            first_row = self.arrays.rows[cell["row"]]
            row["next"] = first_row["next"]
            first_row["next"] = number

    def need(self, places: Iterable[int]) -> None:
        """See to it that these places have a row without holes."""
        for p in places:
            if self.arrays.cells["row"][p] < 0:
                self.add_row(p, frozenset())

    def _append_list(self, numbers: list[int]) -> tuple[int, int]:
        return self._append("lists", numbers)

    def _append(self, name: str, things: list[Any]) -> tuple[int, int]:
        first = self._room(name, len(things))
        array = getattr(self.arrays, name)
        for k, thing in enumerate(things, first):
            array[k] = thing
        return first, first + len(things)

    def _room(self, name: str, count: int) -> int:
        """Make room for so many more; return where they begin."""
        first = self._ends[name]
        self._ends[name] = first + count
        self._grow(name, first + count)
        return first

    def _grow(self, name: str, least: int) -> None:
        array = getattr(self.arrays, name)
        if len(array) < least:
            longer = np.zeros((2 * least, *array.shape[1:]), array.dtype)
            longer[: len(array)] = array
            grown: dict[str, Any] = {name: longer}
            self.arrays = self.arrays._replace(**grown)


def _still(sight: Sight, arrays: Arrays, half: int, side: int) -> Still:
    """What all rows are made from."""
    numbers = np.zeros(1, NUMBERS)
    clear = sight._clear_metres
    numbers[0] = (half, side, sight.navigation.cols, sight.sees.reach, clear)
    useful = np.zeros(len(arrays.marks), bool)
    useful[list(sight._useful)] = True
    rooms = np.zeros(len(arrays.cells), bool)
    rooms[list(sight.rooms)] = True
    return Still(
        numbers=numbers,
        cells=arrays.cells,
        marks=arrays.marks,
        useful=useful,
        clear=_only_read(sight._clear),
        rooms=rooms,
        line=sight.sees.table,
        hits=_only_read(sight.hits),
        ends=_only_read(sight.ends),
        along=cells_along(sight),
    )


def _only_read(array: np.ndarray) -> np.ndarray:
    """A view that cannot be written: to numba another type than one that can.

    The book's own arrays are so, but not in a copy.
    """
    view = array.view()
    view.flags.writeable = False
    return view


def _landings(nav: Navigation) -> np.ndarray:
    """Where people step out of each stairwell, in the order in which they try."""
    found = []
    for well in nav.building.stairwells:
        for mark in well.entrances[well.lowest]:
            for p in nav.goals[mark].tolist():
                beyond = nav.place_beyond(p, well.areas[well.lowest])
                found.append((p, mark, beyond))
    return np.array(found, LANDING)


def tables_of(sight: Sight) -> Tables:
    """The tables of a Sight, begun once; they go when it goes."""
    nav = navigation_of(sight.building)  # another when a number in `paper` changes

    def fits(tables: Tables) -> bool:
        return tables.navigation is nav

    return kept_with(sight, "tables", partial(Tables, sight), fits)
