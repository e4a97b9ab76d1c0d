"""What the fire reads as sets: places to light, people, robots and sources.

[D2, chosen] As `sets` does it for robots: every element of a set has the same numbers,
whatever the building, so one network scores the places of all buildings. All of it is
computed from what the fire observes [D1] and the map.

Its anchors are places to light: for each exit, entrance and door the cell nearest to it
that is free as far as the fire sees and not within LIT of a source, and of such cells
those that most people are about to cross.

    S   worlds;  K  anchors;  m  of them at landmarks;  N  numbers of an element
    n   people;  R  robots;  F  sources;  p  place;  way  metres on foot
"""

from collections.abc import Sequence

import numpy as np

from reference import paper
from reference.building import Building, Kind, lengths
from reference.fire import (
    cells_around_clearance,
    cells_beside,
    cost_of_flames,
    lightable,
)
from reference.game.codec import Moment, PolicyCodec
from reference.navigation import navigation_of
from reference.paper import Scenario
from reference.workshop.anchors.frame import CROWD, UNIT, fire_decisions, nearness
from reference.workshop.anchors.known_ways import known_ways_of
from reference.workshop.anchors.shapes import (
    AWAY,
    BLAZE,
    CREW,
    EXITS,
    GROUP,
    NO_IMAGE,
    SOURCES,
    WIDE,
    SetShapes,
    SetSizes,
)
from reference.workshop.strategies.fires import apart
from reference.workshop.strategies.guides import GROUP_RADIUS
from reference.workshop.strategies.observed import (
    FAR,
    guess_guides,
    kept_under_numbers,
    known_map_of,
    metres_between,
)
from reference.workshop.strategies.traffic import traffic
from reference.world import NOBODY

LIT = 2.0
"""[D2, chosen] metres: an anchor so near to a source is not lit again."""

CROWDED = 6  # [D2, chosen] anchors where most people will cross
SOON_THERE = 10.0  # [D2, chosen] metres on foot: people so near may be there soon
CELLS = 10.0  # what counts as one: cells to burn before a way is closed
FIRE_AXES = 3  # storey, x and y

# Numbers of an anchor. What it is at, as far as the map tells; then what is there.
AT_EXIT, AT_STAIRS, AT_FOOT, AT_DOOR, IN_CROWD, METRES_WIDE, TO_CLOSE, PASS = range(8)
MAP_NUMBERS = PASS + 1


class KnownMarks:
    """What the fire knows of a building's exits, entrances and doors.

    fuel     (places,) bool, what may be lit
    storeys  (m,) of those beside which something may be lit, in the building's order
    way      (m, floor_size) metres to each from a place of its floor
    goals, rims  of each: places of its cells; those whose flames close it
    numbers  (m, MAP_NUMBERS)
    share    (places,) share of all room cells from which one crosses it on the way out
    """

    def __init__(self, building: Building):
        nav = navigation_of(building)
        self.fuel = lightable(building).ravel()
        by_floor = self.fuel.reshape(building.floors, -1)
        marks = [
            mark
            for mark in building.landmarks
            if np.isfinite(nav.metres[mark.index][by_floor[mark.floor]]).any()
        ]
        self.storeys = np.array([mark.floor for mark in marks], dtype=int)
        self.way = nav.metres[[mark.index for mark in marks]]
        self.goals = [nav.goals[mark.index] for mark in marks]
        self.rims = [
            goals
            if mark.kind is Kind.DOOR
            else cells_around_clearance(building, mark.index)
            for mark, goals in zip(marks, self.goals, strict=True)
        ]

        # who crosses what on the way out
        room = np.flatnonzero(building.kind.ravel() == Kind.FLOOR)
        nobody = np.zeros(0, dtype=int)
        no_flames = np.ones(building.kind.shape)
        passed, _ = traffic(building, room, nobody, no_flames)
        self.share = passed / max(len(room), 1)

        # what they are
        self.numbers = np.zeros((len(marks), MAP_NUMBERS))
        for row, mark, goals, rim in zip(
            self.numbers, marks, self.goals, self.rims, strict=True
        ):
            down = mark.kind is Kind.ENTRANCE and mark.leads_out
            row[AT_EXIT] = mark.kind is Kind.EXIT
            row[AT_STAIRS] = down
            row[AT_FOOT] = mark.kind is Kind.ENTRANCE and not down
            row[AT_DOOR] = mark.kind is Kind.DOOR
            row[METRES_WIDE] = mark.width / WIDE
            row[TO_CLOSE] = len(rim) / CELLS
            row[PASS] = min(self.share[goals].sum(), 1)


@kept_under_numbers(8)
def known_marks_of(building: Building) -> KnownMarks:
    """What the fire knows of a building's ways, computed once."""
    return KnownMarks(building)


class FireView:
    """What the fire observes in one world, as sets.

    Places of the map.
    free    (p,) bool: it can be lit, as far as the fire sees
    lit     (p,) bool: it is near a source
    passed  (p,) people who cross it on their cheapest ways out
    out     (p,) metres from there to the way out

    People, robots and sources: points of each, and their places.
    people, robots, sources  (n, 3), (R, 3), (F, 3) metres and storey
    stand, post, source      (n,), (R,), (F,)
    inside, on_stairs, walks  (n,) bool: neither out nor dead; of them, on stairs or not
    guide, led               (n,) who seems to lead them;  bool: somebody does
    at_work, begun           (R,), (F,) bool: robots, and sources, that are there

    Anchors.
    at      (K,) places;  real  (K,) bool: they are somewhere
    off     (K,) metres from the landmark that it is at
    known   (K, MAP_NUMBERS)
    """

    def __init__(self, codec: PolicyCodec, vector: np.ndarray, burning: np.ndarray):
        """vector (layout.size,): observed;  burning (places,) bool: the grid's."""
        building = codec.building
        self.building = building
        self.scenario = codec.scenario
        self.map = known_map_of(building)
        self.ways = known_ways_of(building)
        self.marks = known_marks_of(building)
        self.nav = self.map.nav
        self.burning = burning
        blocks = ("humans", "robots", "fires")
        # Metres in float64, as the simulation has them.
        points = [codec.layout.block_of(vector, name).astype(float) for name in blocks]
        self.people, self.robots, self.sources = points
        self.time = float(codec.layout.block_of(vector, "time")[0, 0])
        self._find_people()
        self._find_free()
        self._find_anchors()

    def _find_people(self) -> None:
        """Find where people and robots are, and whom people seem to follow."""
        self.stand = self.map.places(self.people)
        self.post = self.map.places(self.robots)
        self.source = self.map.places(self.sources)
        self.inside = self.people[:, 2] > -0.5
        self.on_stairs = self.inside & self.map.stairs[self.stand]
        self.walks = self.inside & ~self.on_stairs
        self.at_work = self.robots[:, 2] > -0.5
        self.begun = self.sources[:, 2] > -0.5
        guide = guess_guides(self.nav, self.post, self.at_work, self.stand, self.walks)
        self.guide = guide
        self.led = guide != NOBODY

    def _find_free(self) -> None:
        """Find what can be lit, and how many people will cross each place."""
        self.free = self.marks.fuel & ~self.burning
        self.free[self.stand[self.walks]] = False
        self.free[self.post[self.at_work]] = False

        self.lit = np.zeros_like(self.free)
        floors = np.arange(self.nav.places) // self.nav.floor_size
        for x, y, storey in self.sources[self.begun]:
            near = lengths(self.nav.centres - (x, y)) < LIT
            self.lit |= near & (floors == storey)

        burning = self.burning.reshape(self.building.kind.shape)
        cost = cost_of_flames(burning, cells_beside(self.building, burning))
        stairs = self.ways.well_of[self.stand[self.on_stairs]]
        walking = self.stand[self.walks]
        self.passed, self.out = traffic(self.building, walking, stairs, cost)

    def _find_anchors(self) -> None:
        """Find the free cell nearest to each landmark, and where most people cross."""
        m = len(self.marks.storeys)
        K = m + CROWDED
        self.at = np.zeros(K, dtype=int)
        self.real = np.zeros(K, dtype=bool)
        self.off = np.zeros(K)  # metres from the landmark that it is at
        self.known = np.zeros((K, MAP_NUMBERS))

        # beside landmarks
        unlit = self.free & ~self.lit
        open_here = unlit.reshape(self.building.floors, -1)[self.marks.storeys]
        way = np.where(open_here, self.marks.way, np.inf)
        nearest = way.argmin(axis=1)
        self.off[:m] = np.minimum(way[np.arange(m), nearest], FAR)
        self.at[:m] = nearest + self.marks.storeys * self.nav.floor_size
        self.real[:m] = self.off[:m] < FAR
        self.known[:m] = self.marks.numbers

        # where people cross
        crowded = apart(self.nav, self.passed * unlit, self.out, CROWDED)
        here = slice(m, m + len(crowded))
        self.at[here] = crowded
        self.real[here] = True
        self.known[here, IN_CROWD] = 1
        self.known[here, PASS] = self.marks.share[crowded]

    # -- As numbers -----------------------------------------------------------------

    @property
    def anchors(self) -> np.ndarray:
        """(K, 3) storey, x and y, units of an action; zeros where there is none."""
        storey = self.at // self.nav.floor_size
        found = np.column_stack([storey, self.nav.centres[self.at] / UNIT])
        return found * self.real[:, None]

    @property
    def allowed(self) -> np.ndarray:
        """(K,) bool: those that are somewhere; a mixture needs one."""
        return self.real if self.real.any() else np.ones_like(self.real)

    def shapes(self) -> SetShapes:
        """Count what `numbers` returns; robots stand where a robot's mates do."""
        anchors, people, robots, sources = (
            (part.shape[0], part.shape[1]) for part in self._sets()
        )
        return SetShapes(anchors, people, robots, sources, len(self._counts()))

    def numbers(self) -> np.ndarray:
        """(V,) float32, see `SetShapes`."""
        sets = self._sets()
        elements = np.array([len(part) for part in sets])
        parts = [self.anchors, self.allowed, *sets, self._counts(), elements]
        return np.concatenate([part.ravel() for part in parts], dtype=np.float32)

    def _sets(self) -> list[np.ndarray]:
        return [
            self._set_of_anchors(),
            _at_least_one(self._set_of_people()),
            _at_least_one(self._set_of_robots()),
            _at_least_one(self._set_of_sources()),
        ]

    def _set_of_anchors(self) -> np.ndarray:
        """(K, N) what each anchor is at, who passes it, who is near, what burns."""
        storey = self.at // self.nav.floor_size
        people = storey[:, None] == self.people[:, 2]
        way = self._ways(self.stand, self.walks)
        soon = way <= SOON_THERE
        robots = self._ways(self.post, self.at_work)
        sources = self._ways(self.source, self.begun)
        inside = max(int(self.inside.sum()), 1)
        through = self._through()
        cells = np.flatnonzero(self.burning)
        flames = self._ways(cells, np.ones(len(cells), dtype=bool))
        columns = [
            storey,
            storey == 0,
            self.off / UNIT,
            self.ways.outside[self.at] / AWAY,
            self.passed[self.at] / GROUP,
            through / GROUP,
            through / inside,
            (way <= GROUP_RADIUS).sum(axis=1) / GROUP,
            soon.sum(axis=1) / GROUP,
            (soon & self.led).sum(axis=1) / GROUP,
            (people & self.walks).sum(axis=1) / CROWD,
            (robots <= GROUP_RADIUS).sum(axis=1) / CREW,
            nearness(_nearest(robots)),
            nearness(_nearest(flames)),
            self._closed(),
            nearness(_nearest(sources)),
            self.allowed,
            self.real,
        ]
        rest = np.stack(columns, axis=-1, dtype=float)
        found = np.concatenate([self.known, rest], axis=1)
        return found * self.real[:, None]

    def _ways(self, places: np.ndarray, there: np.ndarray) -> np.ndarray:
        """(K, k) metres on foot from anchors to places (k,); inf where not there."""
        way = metres_between(self.nav, self.at[:, None], places)
        return np.where(there, way, np.inf)

    def _through(self) -> np.ndarray:
        """(K,) how many people will pass the landmark, or else the anchor itself."""
        found = self.passed[self.at]
        for k, goals in enumerate(self.marks.goals):
            found[k] = self.passed[goals].sum()
        return found

    def _closed(self) -> np.ndarray:
        """(K,) share of a way's rim that burns; once all of it does, it is closed."""
        found = np.zeros(len(self.at))
        for k, rim in enumerate(self.marks.rims):
            found[k] = self.burning[rim].mean() if len(rim) else 0
        return found

    def _set_of_people(self) -> np.ndarray:
        """(n, N): storey, metres outside, on stairs, led, flames near, is inside."""
        columns = [
            self.people[:, 2],
            self.ways.outside[self.stand] / AWAY,
            self.on_stairs,
            self.led,
            self._by_flames(self.stand),
            self.inside,
        ]
        return np.stack(columns, axis=-1, dtype=float) * self.inside[:, None]

    def _set_of_robots(self) -> np.ndarray:
        """(R, N): storey, metres outside, followers, flames near, is at work."""
        leads = self.guide == np.arange(len(self.robots))[:, None]
        columns = [
            self.robots[:, 2],
            self.ways.outside[self.post] / AWAY,
            leads.sum(axis=1) / GROUP,
            self._by_flames(self.post),
            self.at_work,
        ]
        return np.stack(columns, axis=-1, dtype=float) * self.at_work[:, None]

    def _set_of_sources(self) -> np.ndarray:
        """(F, N): storey, metres outside, burns still, people who pass, is lit."""
        columns = [
            self.sources[:, 2],
            self.ways.outside[self.source] / AWAY,
            self.burning[self.source],
            self.passed[self.source] / GROUP,
            self.begun,
        ]
        return np.stack(columns, axis=-1, dtype=float) * self.begun[:, None]

    def _by_flames(self, places: np.ndarray) -> np.ndarray:
        """(k,) bool: is a place in flames or heat?"""
        burning = self.burning.reshape(self.building.kind.shape)
        hot = burning | cells_beside(self.building, burning)
        return hot.ravel()[places]

    def _counts(self) -> np.ndarray:
        """(C,) how many there are, the time, how many sources are left."""
        storeys = self.people[:, 2]
        burning = float(self.burning.sum())
        lit = int(self.begun.sum())
        ground = self.walks & (storeys == 0)
        columns = [
            self.inside.sum() / CROWD,
            ground.sum() / CROWD,
            (self.walks & (storeys > 0)).sum() / CROWD,
            self.on_stairs.sum() / GROUP,
            self.led.sum() / CROWD,
            self.at_work.sum() / CREW,
            lit / SOURCES,
            (self.scenario.sources - lit) / SOURCES,
            burning / (burning + BLAZE),
            self.time / paper.health_seconds(),
            self.building.floors,
            len(self.building.exits) / EXITS,
        ]
        return np.array(columns, dtype=float)


def _nearest(way: np.ndarray) -> np.ndarray:
    """(K,) the least of (K, k) metres, at most FAR."""
    return way.min(axis=1, initial=FAR)


def _at_least_one(elements: np.ndarray) -> np.ndarray:
    """Elements (k, N) of a set; where there are none, one that is not there."""
    return elements if len(elements) else np.zeros((1, elements.shape[1]))


class SetsOfFire(PolicyCodec):
    """The fire draws around places that one network scores, in any building [D2].

    shapes  of what a network reads; the numbers of an element are those of any building
    """

    def __init__(self, building: Building, scenario: Scenario, spread: float):
        super().__init__("fire", building, scenario)
        self.spread = spread
        # Nobody's observation, of the right size.
        nothing = np.zeros(self.layout.size)
        view = FireView(self, nothing, np.zeros(building.kind.size, dtype=bool))
        self.shapes = view.shapes()
        self.size = len(view.numbers())

    @property
    def sizes(self) -> SetSizes:
        """Sets, and no image."""
        return SetSizes(
            vector=self.size,
            grid=NO_IMAGE,
            continuous=FIRE_AXES,
            anchors=self.shapes.anchors[0],
            spread=self.spread,
            commitment=0.0,  # a fire is headed nowhere
            sets=self.shapes,
        )

    def read(self, moments: Sequence[Moment]) -> np.ndarray:
        """(S, 1, V) float32, see `SetShapes`."""
        # Flames never leave the main body, so it is what the grid tells [D1].
        rows = [
            FireView(self, moment.vectors[0], moment.world.flames.burning.ravel())
            for moment in moments
        ]
        return np.stack([view.numbers() for view in rows])[:, None]

    def grids(self, moments: Sequence[Moment]) -> np.ndarray:
        """(S, 0, 0, 0): what burns is told beside each anchor."""
        return np.zeros((len(moments), *NO_IMAGE), dtype=np.uint8)

    def actions(self, raw: np.ndarray, moments: Sequence[Moment]) -> np.ndarray:
        """Floor and metres (..., 3) of storey and place (..., 3) [D2].

        nan, which is no fire, in a building where nothing can burn.
        """
        if not known_marks_of(self.building).fuel.any():
            return np.full(raw.shape, np.nan)
        return fire_decisions(self.building, raw)
