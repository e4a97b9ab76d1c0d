"""What robots observe of a building and of people, beside the numbers themselves.

Places of points, ways on foot, who seems to lead whom, the points that mean a way out:
hand-written robots and the robot's frame share them.

    p, q  places;  n  people;  R  robots
"""

from collections.abc import Callable, Iterable, Sequence
from functools import lru_cache, wraps
from operator import itemgetter
from typing import Any, NamedTuple, TypeVar, cast

import numpy as np
from scipy import ndimage
from scipy.sparse.csgraph import dijkstra

from reference import paper
from reference.building import Building, Kind, Landmark
from reference.fire import lightable
from reference.game.environment import DECIMALS
from reference.navigation import Navigation, navigation_of
from reference.robots import Destination, actual_target
from reference.workshop.storage.numbers import paper_numbers
from reference.world import NOBODY, World

FAR = 100.0  # metres: whatever is farther, or unreachable, counts as this far
BEHIND = 0.5
"""[C1, chosen] metres: who follows a robot under way is so much farther from where it
goes. With 0.8 m as many guesses are right, with 0 or 1.2 m fewer."""

Function = TypeVar("Function", bound=Callable[..., Any])


def kept_under_numbers(most: int) -> Callable[[Function], Function]:
    """Keep up to so many answers of a function, each under the numbers it came from.

    Whoever changes a number of `paper` at run time is heard: it is another question.
    """

    numbers_in = itemgetter(*paper_numbers())

    def keep(function: Function) -> Function:
        @lru_cache(maxsize=most)
        def answer(numbers: tuple[Any, ...], *asked: Any) -> Any:
            return function(*asked)

        @wraps(function)
        def ask(*asked: Any) -> Any:
            return answer(numbers_in(vars(paper)), *asked)

        return cast(Function, ask)

    return keep


class KnownMap:
    """What robots know of a building.

    origin  as `Building.origin`
    free    (floors, rows, cols) the nearest place where one can stand
    stairs  (places,) bool
    outs, feet, rims  (floors, k, 2) metres of ways out, feet of stairs and cells to
            guard, nan for none
    marks   (floors, m, 2) metres: these three side by side;  kinds  how many of each
    mark_places  (floors, m) of them
    """

    def __init__(self, building: Building):
        self.nav = navigation_of(building)
        self.origin = building.origin
        self.stairs = building.kind.ravel() == Kind.STAIRS
        nearest = ndimage.distance_transform_edt(
            ~building.walkable,
            sampling=(FAR, 1, 1),  # never a place of another floor
            return_distances=False,
            return_indices=True,
        )
        self.free = np.ravel_multi_index(nearest, building.walkable.shape)
        floors = range(building.floors)
        marks = [way_marks(building, floor) for floor in floors]
        self.outs = _padded_points([outs for outs, _ in marks])
        self.feet = _padded_points([feet for _, feet in marks])
        self.rims = _padded_points([guard_points(building, floor) for floor in floors])
        kinds = [self.outs, self.feet, self.rims]
        self.kinds = [kind.shape[1] for kind in kinds]
        self.marks = np.concatenate(kinds, axis=1)
        floor = np.arange(building.floors)[:, None]
        self.mark_places = self.places(np.nan_to_num(self.marks), floor)

    def places(self, points: np.ndarray, floor: np.ndarray | None = None) -> np.ndarray:
        """(...) places of points (..., 2), or (..., 3) with floors of their own.

        What is outside the drawing counts as on its edge, `ABSENT_POINT` as on the
        first floor.
        """
        if floor is None:
            floor = points[..., 2].round().clip(0).astype(int)
        top, left = self.origin
        _, rows, cols = self.free.shape
        cells = np.floor(points[..., :2]).astype(int)
        row = (top - 1 - cells[..., 1]).clip(0, rows - 1)
        col = (left + cells[..., 0]).clip(0, cols - 1)
        return self.free[floor, row, col]


@kept_under_numbers(8)
def known_map_of(building: Building) -> KnownMap:
    """What robots know of a building, computed once."""
    return KnownMap(building)


def metres_between(nav: Navigation, p: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Measure metres on foot from places p to q, whose shapes broadcast.

    float32, inf between floors. They come from a table; a row is computed when it is
    first asked for.
    """
    table = _table(nav)
    row = table.rows(p)
    floor, there = np.divmod(q, nav.floor_size)
    same = p // nav.floor_size == floor
    return np.where(same, table.metres[row, there], np.inf)


class _Table:
    """Metres on foot from places to all of their floor.

    It has a row for each place that was asked for: one for every place would take
    gigabytes in a large building.

    row     (places,) of `metres`, -1 where none was asked for
    metres  (rows, floor_size) float32; the first `count` are measured
    """

    def __init__(self, nav: Navigation):
        self.nav = nav
        self.row = np.full(nav.places, -1)
        self.metres = np.empty((0, nav.floor_size), dtype=np.float32)
        self.count = 0

    def rows(self, places: np.ndarray) -> np.ndarray:
        """(...) rows of places (...), measured by now."""
        rows = self.row[places]
        new = places[rows < 0]
        if not new.size:
            return rows
        self._measure(np.unique(new))
        return self.row[places]

    def _measure(self, new: np.ndarray) -> None:
        """Add rows; if there is no room, make room for twice as many."""
        first = self.count
        end = first + len(new)
        if end > len(self.metres):
            larger = np.empty((2 * end, self.nav.floor_size), dtype=np.float32)
            larger[:first] = self.metres[:first]
            self.metres = larger
        floors, cells = np.divmod(new, self.nav.floor_size)
        for floor in np.unique(floors).tolist():
            here = np.flatnonzero(floors == floor)
            steps = self.nav.steps[floor]
            self.metres[first + here] = dijkstra(steps, indices=cells[here])
        self.row[new] = np.arange(first, end)
        self.count = end


@lru_cache(maxsize=8)
def _table(nav: Navigation) -> _Table:
    return _Table(nav)


def ends_of_ways(world: World) -> np.ndarray:
    """(R,) places where robots are headed, or where they stand."""
    low, high = np.reshape(world.building.body, (2, 2))
    known = known_map_of(world.building)
    ends = np.array([robot.place for robot in world.robots], dtype=int)
    for k, robot in enumerate(world.robots):
        if robot.destination is not None and robot.way:
            to = robot.destination.clip(low, high).round(DECIMALS)
            ends[k] = known.places(to, np.array(robot.floor))
    return ends


def guess_guides(
    nav: Navigation,
    robots: np.ndarray,
    at_work: np.ndarray,
    people: np.ndarray,
    walking: np.ndarray,
    headed: np.ndarray | None = None,
) -> np.ndarray:
    """Guess who leads whom [C1, chosen]: (..., n) index of a robot, or NOBODY.

    robots (..., R), people (..., n): places; at_work (..., R), walking (..., n) bool.
    headed (..., R): places where robots go, or where they stand; None: nobody knows.
    It is the nearest robot at work, if that is within SIGHT_RANGE, measured on foot and
    without flames; robots do not observe whether people see farther. A follower walks
    behind its robot, seen from where that goes. So a robot that has somebody in front
    is the guess only if all robots in sight have. In the paper's building 95 of 100
    guesses are right, of eight robots in a small office 60 (52 by the nearest alone).
    """
    if not robots.shape[-1]:
        return np.full(people.shape, NOBODY)
    people = people[..., None, :]
    way = metres_between(nav, robots[..., None], people)
    in_sight = at_work[..., None] & (way <= paper.SIGHT_RANGE)
    if headed is not None:
        # metres that robots, and people, have to where a robot goes
        robot_to_go = metres_between(nav, headed, robots)[..., None]
        person_to_go = metres_between(nav, headed[..., None], people)
        under_way = robot_to_go > 0
        in_front = person_to_go < robot_to_go + BEHIND
        # farther than any other robot in sight, so the last choice
        way = np.where(under_way & in_front, way + paper.SIGHT_RANGE, way)
    led = walking & in_sight.any(axis=-2)
    return np.where(led, np.where(in_sight, way, np.inf).argmin(axis=-2), NOBODY)


def may_lead(own: np.ndarray, led: np.ndarray, way: np.ndarray) -> np.ndarray:
    """Tell whom a robot leads, or may lead [C1, chosen]: (..., n) bool.

    Of robots side by side any may be the one that is followed, but the guess names one.
    So who leads nobody by the guess may lead all led people within its sight.

    own (..., n) bool, whom it leads by the guess;  led (..., n) bool, whom any leads;
    way (..., n) metres from it to them
    """
    in_sight = led & (way <= paper.SIGHT_RANGE)
    return np.where(own.any(axis=-1, keepdims=True), own, in_sight)


class WayOut(NamedTuple):
    """A way out of a floor: stairs that lead down, or an exit.

    landmarks  indices: the stairwell's entrances on this floor, or the exit
    stairwell  index; -1 for an exit
    middle     metres, of the stairwell or of the exit
    """

    landmarks: list[int]
    stairwell: int
    middle: Destination


def ways_out_of(building: Building, floor: int) -> list[WayOut]:
    """List a floor's ways out: stairs that lead down, then exits; as the map does."""
    ways = []
    for k, well in enumerate(building.stairwells):
        if well.leads_down(floor):
            ways.append(WayOut(list(well.entrances[floor]), k, well.centre))
    for mark in building.landmarks:
        if mark.kind is Kind.EXIT and mark.floor == floor:
            ways.append(WayOut([mark.index], -1, mark.position))
    return ways


def way_marks(building: Building, floor: int) -> tuple[list[Any], list[Any]]:
    """Find a floor's ways out and the feet of its stairs, points in metres [C6].

    Ways out come as `ways_out_of` lists them: exits, and where stairs lead down the
    nearest point of the main body, from which Eq. 1 leads inside. Feet of stairs are
    points before them, where people come out.
    """
    low, high = np.reshape(building.body, (2, 2))
    ways = ways_out_of(building, floor)
    outs = [np.clip(way.middle, low, high) for way in ways]
    ends = stairs_that_end(building, floor)
    return outs, [before_stairwell(building, floor, k) for k in ends]


def stairs_that_end(building: Building, floor: int) -> list[int]:
    """List the stairwells from which people come out on a floor, by index."""
    return [k for k, well in enumerate(building.stairwells) if well.lowest == floor]


def guard_points(building: Building, floor: int) -> list[Any]:
    """Find where one guards a floor's exits and entrances, points in metres [D6]."""
    centres = navigation_of(building).centres
    return [centres[place] for _, place in guarded_ways(building, floor)]


def guarded_ways(building: Building, floor: int) -> list[tuple[int, int]]:
    """List a floor's exits and entrances that one can guard: landmark, and place [D6].

    [C5, chosen] The place is the nearest cell on foot that flames may enter and that is
    not near a stairwell, where Eq. 1 would move the robot.
    """
    can_guard = lightable(building).ravel() & keeps_destination(building)
    found = []
    for mark in building.landmarks:
        if mark.floor == floor and mark.kind is not Kind.DOOR:
            places = nearest_places(building, [mark.index], can_guard)
            found += [(mark.index, place) for place in places]
    return found


@kept_under_numbers(8)
def keeps_destination(building: Building) -> np.ndarray:
    """(places,) bool: where Eq. 1 keeps a destination [C6]."""
    nav = navigation_of(building)
    keeps = np.empty(nav.places, dtype=bool)
    for place, point in enumerate(nav.centres.tolist()):
        floor = place // nav.floor_size
        keeps[place] = actual_target(building, floor, *point) == tuple(point)
    return keeps


def nearest_places(
    building: Building, marks: Iterable[int], among: np.ndarray
) -> list[int]:
    """Find the place nearest on foot to each landmark, where there is one.

    among: (places,) bool, those that count
    """
    nav = navigation_of(building)
    # where nothing counts, or there is no way, a landmark has none
    metres = [np.where(among, nav.distance_to(mark), np.inf) for mark in marks]
    return [int(d.argmin()) for d in metres if np.isfinite(d).any()]


@kept_under_numbers(64)
def before_stairwell(building: Building, floor: int, index: int) -> Destination:
    """Find the room cell nearest to a stairwell that Eq. 1 does not pull inside.

    If it pulls from everywhere, the cell nearest to the entrance.
    """
    entrance = building.stairwells[index].entrances[floor][:1]
    room = building.kind.ravel() == Kind.FLOOR
    found = nearest_places(building, entrance, room & keeps_destination(building))
    if not found:
        found = nearest_places(building, entrance, room)
    x, y = navigation_of(building).centres[found[0]].tolist()
    return x, y


def at_way_out(building: Building, way: Landmark) -> Destination:
    """Find a point that means this way out: an exit, or the stairwell's middle [C6]."""
    wells = building.stairwells
    return wells[way.stairwell].centre if way.stairwell >= 0 else way.position


def decisions_to_next_fire(time: Any, decision_seconds: float) -> np.ndarray:
    """Count decisions until the fire decides again, from times (...), s [D2]."""
    # rounded: times are sums of ticks
    since = np.round(time / decision_seconds - paper.FIRE_FIRST_DECISION, 3)
    later = paper.FIRE_EVERY_DECISIONS - since % paper.FIRE_EVERY_DECISIONS
    return np.where(since < 0, -since, later)


def padded(rows: Sequence[Sequence[Any]], filler: Any) -> np.ndarray:
    """(rows, most, ...) of rows of any lengths; the filler where one is shorter."""
    most = max(map(len, rows))
    return np.array([[*row, *[filler] * (most - len(row))] for row in rows])


def _padded_points(floors: Sequence[Sequence[Any]]) -> np.ndarray:
    """(floors, most, 2) of points on each floor; nan where there are fewer."""
    return padded(floors, (np.nan, np.nan)).reshape(len(floors), -1, 2)
