"""What robots read as sets: anchors, people, mates and fires, in any order and number.

[C5, chosen] Every element of a set has the same numbers, whatever the building: where
it is from the robot, how far on foot, and what is there. The grid is read as a `crop`
around the robot. All of it is computed from the observations [C1] [C3], the map, and
where robots are headed; numbers are scaled by hand to be of order one.

    S   worlds;  G  robots of each;  B  robots of all worlds, S x G;  M  mates, G - 1
    K   anchors;  m  marks, the anchors that the map knows;  n  people
    F   fire sources;  k  cells that burn on a robot's floor;  p  place
    way, near, lost  as in `frame`
"""

from collections.abc import Sequence

import numpy as np

from reference import paper
from reference.building import lengths
from reference.game.codec import PolicyCodec
from reference.game.environment import DECIMALS
from reference.game.observations import me_first
from reference.workshop.anchors.frame import (
    CROWD,
    FIRST_MARK,
    KEEP,
    UNIT,
    WAIT,
    RobotView,
    nearness,
)
from reference.workshop.anchors.known_ways import known_ways_of
from reference.workshop.anchors.reckoning import FARTHEST, CostsNow, gains
from reference.workshop.anchors.shapes import (
    AWAY,
    BLAZE,
    CREW,
    GROUP,
    SOURCES,
    WIDE,
    SetShapes,
)
from reference.workshop.strategies.guides import GROUP_RADIUS
from reference.workshop.strategies.observed import (
    FAR,
    decisions_to_next_fire,
    may_lead,
    metres_between,
)
from reference.world import Flames

MATES_READ = 7
"""[C5, chosen] of a robot's own floor, the nearest: as many as generated ones have."""
RIMS_NUMBERED = 4  # [C5, chosen] rims of a floor that are told apart by their number
SLACK = 1.0  # [C5, chosen] metres of detour at which flames are half on the way
APART = 2.0  # [C5, chosen] metres between anchors at people, at least
GROUPS = 10  # [C5, chosen] anchors at people
HASTE = 0.2  # people for a metre of way
# what a network reads of it, at most: where a robot stands at an exit it is unbounded
MOST_EXTRA = 10.0
MOST_GAIN = 5.0
MOST_DETOUR = 3.0

# Numbers of a mark. Two that tell its kind: a rim guards an exit or stairs.
(
    EXIT,
    STAIRS,
    FOOT,
    RIM,
    WIDTH,
    LEADS,
    BURNS,
    BURNS_NEAR,
    COMING,
    STATION,  # a foot at which it is my turn to wait
    NUMBER,
) = range(11)
MARK_NUMBERS = NUMBER + RIMS_NUMBERED


class SetView(RobotView):
    """What robots observe, as sets; anchors of the map stand in the map's order.

    world    (B,) index of my world
    burning  (S, p) bool;  sources  (B, F, 3) points
    at       (B, K) places of anchors

    People.
    people  (B, n, 3) points;  stand  (B, n) their places
    inside  (B, n) bool: neither out nor dead;  here  those on foot on my floor

    Mates.
    mates   (B, M, 3) points;  mate_places  (B, M)
    mate_destinations  (B, M, 2) metres, nan for none: where they are headed
    beside  (B, M) bool: on my floor
    number  (B,) mine among the robots of a floor
    before  (B, M) bool: mates of a lower number. Guides choose in turn; without it
            two robots at one place would always do the same

    Metres, round flames.
    to, out  (B, K) from me to an anchor, and from there to the outside
    total    (B, K) outside by that anchor;  outside  (B,) by the cheapest way
    """

    def __init__(
        self,
        codec: PolicyCodec,
        vectors: np.ndarray,
        headed: np.ndarray,
        masks: bool,
        flames: Sequence[Flames | None],
    ):
        """vectors (B, layout.size), headed (B, 2): of all robots of all worlds.

        masks: as `RobotView`;  flames: of each world, None for none
        """
        super().__init__(codec, vectors, headed, masks)
        building = codec.building
        self.ways = known_ways_of(building)
        none = np.zeros(building.kind.size, dtype=bool)
        burning = [none if one is None else one.burning.ravel() for one in flames]
        self.burning = np.stack(burning)
        self.world = np.repeat(np.arange(len(flames)), len(vectors) // len(flames))
        self.people = self.points[:, self.of_people]
        self.sources = self.points[:, self.of_fires]
        self.stand = self.places[:, self.of_people]
        self.at = self.map.places(np.nan_to_num(self.spots), self.floor[:, None])
        self.inside = self.there[:, self.of_people]
        walks = self.inside & ~self.map.stairs[self.stand]
        self.here = walks & (self.people[..., 2] == self.floor[:, None])
        self._find_mates()
        self._measure_ways(
            CostsNow(building, self.ways.marks, self.ways.by_mark, flames)
        )

    def _sort_people(self, places: np.ndarray) -> None:
        """As `RobotView`; who seems to lead nobody counts whom it may lead as its."""
        super()._sort_people(places)
        self.mine = may_lead(self.mine, self.led, self.far[:, self.of_people])

    def _headed(self) -> np.ndarray:
        """(B, R) places where robots are headed, or stand; in the order of each."""
        spot = np.nan_to_num(self.destination).round(DECIMALS)
        ends = self.map.places(spot, self.floor)
        ends = np.where(np.isnan(self.destination[:, 0]), self.place, ends)
        R = self.of_robots.stop - self.of_robots.start
        floor = np.arange(R) // self.scenario.robots_per_floor
        return ends.reshape(-1, R)[:, me_first(floor)].reshape(-1, R)

    def _order_of_marks(self, way: np.ndarray) -> np.ndarray:
        """(B, m) the map's order: a set has none, and the map knows their ways."""
        return np.broadcast_to(np.arange(way.shape[1]), way.shape)

    def _people_at_anchors(self) -> tuple[np.ndarray, np.ndarray]:
        """The nearest lost, the nearest that is APART from that one, and so on.

        So a group takes few anchors, and the next group has some, too. Returns
        (B, GROUPS) numbers of people, and (B, GROUPS) bool: is there one?
        """
        each = np.arange(len(self.lost))
        if not self.lost.shape[1]:
            nobody = np.zeros((len(each), 0), dtype=int)
            return nobody, nobody > 0
        point = self.points[:, self.of_people, :2]
        left = np.where(self.lost, self.far[:, self.of_people], np.inf)
        chosen = []
        found = []
        for _ in range(GROUPS):
            nearest = left.argmin(axis=1)
            chosen.append(nearest)
            found.append(np.isfinite(left[each, nearest]))
            off = lengths(point - point[each, nearest][:, None])
            left = np.where(off < APART, np.inf, left)
        return np.stack(chosen, axis=1), np.stack(found, axis=1)

    def _measure_ways(self, costs: CostsNow) -> None:
        """Reckon metres (B, K): to anchors, on from there, and outside by them.

        By a way out one gets outside through it; else by whichever is cheapest.
        """
        world = self.world
        self.out = costs.outside[world[:, None], self.at]
        self.to = self.way.astype(float)
        for b in np.flatnonzero(self.there[:, self.of_robots][:, 0]):
            self.to[b] = costs.to_places(
                world[b], self.place[b], self.at[b], unburnt=self.to[b]
            )
        self.total = np.minimum(self.to + self.out, FARTHEST)
        outs = costs.by_way[world, self.floor, :, self.place % self.map.nav.floor_size]
        self.total[:, FIRST_MARK:][:, self.of_outs] = outs
        self.outside = costs.outside[world, self.place]

    def _find_mates(self) -> None:
        """Find where the robots of the same world are, and where they are headed."""
        S = len(self.burning)
        own = self.points[:, self.of_robots][:, 0].reshape(S, -1, 3)
        destinations = self.destination.reshape(S, -1, 2)
        G = own.shape[1]
        self.number = np.tile(np.arange(G), S) % max(1, self.scenario.robots_per_floor)

        if G == 1:  # a set has at least one element, there or not
            self.mates = np.full((S, 1, 3), paper.ABSENT_POINT)
            self.mate_destinations = np.full((S, 1, 2), np.nan)
            self.before = np.zeros((S, 1), dtype=bool)
        else:
            # (G, G - 1) of each robot, the indices of the others
            others = np.array([[j for j in range(G) if j != g] for g in range(G)])
            self.mates = own[:, others].reshape(S * G, G - 1, 3)
            ends = destinations[:, others]
            self.mate_destinations = ends.reshape(S * G, G - 1, 2)
            self.before = np.tile(others < np.arange(G)[:, None], (S, 1))
        self.beside = self.mates[..., 2] == self.floor[:, None]
        self._forget_far_mates()
        self.mate_places = self.map.places(self.mates)

    def _forget_far_mates(self) -> None:
        """Take those of my floor beyond the nearest MATES_READ for absent."""
        metres = lengths(self.mates[..., :2] - self.me[:, None])
        metres = np.where(self.beside, metres, np.inf)
        rank = metres.argsort(axis=1, kind="stable").argsort(axis=1, kind="stable")
        far = self.beside & (rank >= MATES_READ)
        self.mates[far] = paper.ABSENT_POINT
        self.mate_destinations[far] = np.nan
        self.beside &= ~far

    def shapes(self) -> SetShapes:
        """Count what `numbers` returns."""
        anchors, people, mates, fires = (
            (part.shape[1], part.shape[2]) for part in self._sets()
        )
        counts = self._counts().shape[1]
        return SetShapes(anchors, people, mates, fires, counts)

    def numbers(self) -> np.ndarray:
        """(B, V) float32, see `SetShapes`."""
        sets = self._sets()
        elements = np.tile([part.shape[1] for part in sets], (len(self.me), 1))
        parts = [self.anchors, self.allowed, *sets, self._counts(), elements]
        rows = [part.reshape(len(part), -1) for part in parts]
        return np.concatenate(rows, axis=1, dtype=np.float32)

    def _sets(self) -> list[np.ndarray]:
        known = self._points_from_me()
        people = self._set_of_people(known[:, self.of_people])
        fires = self._set_of_fires(known[:, self.of_fires])
        return [self._set_of_anchors(), people, self._set_of_mates(), fires]

    # -- Anchors --------------------------------------------------------------------

    def _set_of_anchors(self) -> np.ndarray:
        """(B, K, numbers) what each anchor is, how far, and what is there."""
        B, K = self.allowed.shape
        marks = self._map_numbers()
        m = marks.shape[1]
        end = FIRST_MARK + m
        of_map = np.zeros((B, K, MARK_NUMBERS))
        of_map[:, FIRST_MARK:end] = marks
        of_map[:, KEEP] = self._mark_at_destination(marks)
        kinds = np.zeros((B, K, 3))
        kinds[:, KEEP, 0] = 1
        kinds[:, WAIT, 1] = 1
        kinds[:, end:, 2] = 1  # people

        real = ~np.isnan(self.spots[..., 0])
        on_way, near = self._flames()
        lost, led = self._people_near()
        mates = self.mate_places[:, None]
        from_mates = metres_between(self.map.nav, self.at[..., None], mates)
        all_mates = self._mates_at_anchors(self.beside, from_mates)
        mates_before = self._mates_at_anchors(self.beside & self.before, from_mates)
        columns = [
            self.way / UNIT,
            nearness(self.way),
            self.ways.outside[self.at] / AWAY,
            on_way,
            near,
            self._nearness_of_sources(),
            lost / GROUP,
            led / GROUP,
            *all_mates,
            *mates_before,
            self._count_at_anchors(self.destination[:, None]),
            *self._guide_columns(lost),
            self.allowed,
            real,
        ]
        rest = np.stack(columns, axis=-1, dtype=float)
        parts = [kinds, of_map, self.anchors, rest]
        return np.concatenate(parts, axis=-1) * real[..., None]

    def _guide_columns(self, lost: np.ndarray) -> list[np.ndarray]:
        """(B, K) each: what a guide would weigh; lost (B, K): people in groups."""
        extra = self.total - self.outside[:, None]
        outs = self.total[:, FIRST_MARK:][:, self.of_outs]
        least = outs.min(axis=1, keepdims=True)
        cheapest = np.zeros_like(self.allowed)
        cheapest[:, FIRST_MARK:][:, self.of_outs] = outs == least
        more, detour = gains(self.total, self.outside, lost, self.mine.sum(axis=1))
        return [
            self.out / AWAY,
            np.minimum(self.to, FARTHEST) / UNIT,
            self.total / AWAY,
            (extra / UNIT).clip(-MOST_EXTRA, MOST_EXTRA),
            cheapest,
            (more / HASTE).clip(-MOST_GAIN, MOST_GAIN),
            np.minimum(detour, MOST_DETOUR),
        ]

    def _map_numbers(self) -> np.ndarray:
        """(B, m, MARK_NUMBERS) what the map and the flames tell of its anchors."""
        ways = self.ways
        floor = self.floor
        out_wells = ways.wells[floor]
        foot_wells = ways.feet[floor]
        rim_wells = ways.rim_wells[floor]
        wells = (out_wells, foot_wells, rim_wells)
        ends = np.cumsum([part.shape[1] for part in wells])
        marks = np.zeros((len(floor), ends[-1], MARK_NUMBERS))
        outs, feet, rims = np.split(marks, ends[:-1], axis=1)

        # ways out
        outs[..., EXIT] = out_wells < 0
        outs[..., STAIRS] = out_wells >= 0
        outs[..., WIDTH] = ways.width[floor] / WIDE
        outs[..., LEADS] = ways.metres_out[floor] / AWAY
        outs[..., BURNS] = self._burn_on(ways.on_way)
        outs[..., BURNS_NEAR] = self._burn_on(ways.near_way)

        # feet of stairs
        feet[..., STAIRS] = 1
        feet[..., FOOT] = 1
        on_stairs = np.where(self.inside, ways.well_of[self.stand], -1)
        coming = on_stairs[:, None] == foot_wells[..., None]
        real = foot_wells >= 0
        feet[..., COMING] = coming.sum(axis=-1) * real / GROUP
        turn = self.number % np.maximum(real.sum(axis=1), 1)
        feet[..., STATION] = turn[:, None] == np.arange(real.shape[1])

        # rims
        rims[..., EXIT] = rim_wells < 0
        rims[..., STAIRS] = rim_wells >= 0
        rims[..., RIM] = 1
        rims[..., WIDTH] = ways.rim_width[floor] / WIDE
        numbered = min(rims.shape[1], RIMS_NUMBERED)
        rims[:, :numbered, NUMBER : NUMBER + numbered] = np.eye(numbered)
        return marks

    def _burn_on(self, ways: np.ndarray) -> np.ndarray:
        """(B, k) how much burns on or near the ways on from my floor's ways out."""
        places, floors, k = ways.shape
        counts = self.burning.astype(np.float32) @ ways.reshape(places, -1)
        mine = counts.reshape(-1, floors, k)[self.world, self.floor]
        return mine / (mine + BLAZE)

    def _mark_at_destination(self, marks: np.ndarray) -> np.ndarray:
        """(B, MARK_NUMBERS) of the mark where a robot is headed, or zeros."""
        which = self.headed_to.argmax(axis=1)
        found = marks[np.arange(len(marks)), which]
        return found * np.any(self.headed_to, axis=1, keepdims=True)

    def _flames(self) -> tuple[np.ndarray, np.ndarray]:
        """(B, K) each: how much flames are on my way to an anchor, and near it."""
        p, burns = self._burning_here()
        if not p.shape[1]:
            return np.zeros(self.way.shape), np.zeros(self.way.shape)
        nav = self.map.nav
        from_me = np.where(burns, metres_between(nav, self.place[:, None], p), np.inf)
        to_anchor = metres_between(nav, self.at[..., None], p[:, None])
        by_flames = (from_me[:, None] + to_anchor).min(axis=-1)
        slack = np.maximum(by_flames - self.way, 0)
        near = np.where(burns[:, None], to_anchor, np.inf).min(axis=-1)
        return SLACK / (SLACK + slack), nearness(near)

    def _burning_here(self) -> tuple[np.ndarray, np.ndarray]:
        """(B, k) places that burn on my floor; (B, k) bool, False for mere padding."""
        floors = self.map.nav.floors
        world, place = np.nonzero(self.burning)
        storey = world * floors + place // self.map.nav.floor_size
        counts = np.bincount(storey, minlength=len(self.burning) * floors)
        number = np.arange(len(place)) - np.repeat(np.cumsum(counts) - counts, counts)
        places = np.zeros((len(counts), counts.max()), dtype=int)
        places[storey, number] = place
        mine = self.world * floors + self.floor
        return places[mine], np.arange(places.shape[1]) < counts[mine, None]

    def _nearness_of_sources(self) -> np.ndarray:
        """(B, K) nearness of the nearest source lit so far on my floor."""
        mine = self.sources[..., 2] == self.floor[:, None]
        metres = np.sqrt(self._squares(self.sources))
        metres = np.where(mine[:, None], metres, FAR)
        return nearness(metres.min(axis=-1, initial=FAR))

    def _people_near(self) -> tuple[np.ndarray, np.ndarray]:
        """(B, K) each: how many lost and led people are in a group at an anchor."""
        near = self._squares(self.people) < GROUP_RADIUS**2
        led = self.here & ~self.alone
        lost = (near & self.lost[:, None]).sum(axis=-1)
        return lost, (near & led[:, None]).sum(axis=-1)

    def _count_at_anchors(self, points: np.ndarray) -> np.ndarray:
        """(B, K) how many of these points (B, k, 2) are at an anchor."""
        return (self._squares(points) <= paper.AT_EXIT_METRES**2).sum(axis=-1)

    def _squares(self, points: np.ndarray) -> np.ndarray:
        """(B, K, k) squared metres from anchors to points (B, k, 2 or 3); or nan."""
        x = self.spots[..., :1] - points[:, None, :, 0]
        y = self.spots[..., 1:] - points[:, None, :, 1]
        return x * x + y * y

    def _mates_at_anchors(self, which: np.ndarray, way: np.ndarray) -> list[np.ndarray]:
        """(B, K) each: mates headed there, nearness of the nearest, is it before me?

        which: (B, M) bool, of which mates;  way: (B, K, M) metres from them to anchors
        """
        ends = np.where(which[..., None], self.mate_destinations, np.nan)
        way = np.where(which[:, None], way, np.inf).min(axis=-1)
        return [self._count_at_anchors(ends) / CREW, nearness(way), way < self.way]

    # -- People, mates, fires -------------------------------------------------------

    def _set_of_people(self, known: np.ndarray) -> np.ndarray:
        """(B, n, numbers): point, led by nobody, by me, on stairs, metres outside."""
        if not known.shape[1]:  # as with fires
            return np.zeros((len(known), 1, known.shape[2] + 4))
        columns = [
            self.mine,
            self.map.stairs[self.stand],
            self.ways.outside[self.stand] / AWAY,
            np.ones_like(self.inside),
        ]
        rest = np.stack(columns, axis=-1, dtype=float) * self.inside[..., None]
        return np.concatenate([known, rest], axis=-1)

    def _set_of_mates(self) -> np.ndarray:
        """(B, M, numbers): where it is, on my floor, where headed, before me, is it."""
        off = (self.mates[..., :2] - self.me[:, None]) / UNIT
        up = self.mates[..., 2:] - self.floor[:, None, None]
        way = metres_between(self.map.nav, self.place[:, None], self.mate_places)
        near = nearness(way)
        headed = np.nan_to_num((self.mate_destinations - self.me[:, None]) / UNIT)
        goes = ~np.isnan(self.mate_destinations[..., :1])
        present = self.mates[..., 2:] > -0.5
        flags = np.stack([self.beside, self.before], axis=-1)
        parts = [off, up, near[..., None], flags, headed, goes]
        return np.concatenate([*parts, present], axis=-1) * present

    def _set_of_fires(self, known: np.ndarray) -> np.ndarray:
        """(B, F, numbers): whether a source burns still, and its point."""
        if not known.shape[1]:  # a set has at least one element, there or not
            return np.zeros((len(known), 1, known.shape[2] + 1))
        lit = self.there[:, self.of_fires]
        burns = self.burning[self.world[:, None], self.places[:, self.of_fires]] & lit
        return np.concatenate([burns[..., None], known], axis=-1)

    # -- Counts ---------------------------------------------------------------------

    def _counts(self) -> np.ndarray:
        """(B, numbers) how many there are, the time, and what I am about."""
        scenario = self.scenario
        time = self.seen["time"][:, 0, 0]
        step = scenario.decision_seconds
        inside = self.inside
        up = self.people[..., 2] - self.floor[:, None]
        storeys = self.sources[..., 2] - self.floor[:, None]
        lit = self.there[:, self.of_fires]
        floors = self.burning.reshape(len(self.burning), -1, self.map.nav.floor_size)
        burning = floors.sum(axis=-1)
        here = burning[self.world, self.floor]
        elsewhere = burning.sum(axis=-1)[self.world] - here
        columns = [
            self.lost.sum(axis=1) / GROUP,
            self.mine.sum(axis=1) / GROUP,
            self.here.sum(axis=1) / CROWD,
            (inside & (up > 0)).sum(axis=1) / CROWD,
            (inside & (up < 0)).sum(axis=1) / CROWD,
            self.beside.sum(axis=1) / CREW,
            lit.sum(axis=1) / SOURCES,
            (lit & (storeys == 0)).sum(axis=1) / SOURCES,
            here / (here + BLAZE),
            elsewhere / (elsewhere + BLAZE),
            self.floor,
            self.floor == 0,
            self.ways.outside[self.place] / AWAY,
            self.outside / AWAY,
            time / paper.health_seconds(),
            decisions_to_next_fire(time, step) / paper.FIRE_EVERY_DECISIONS,
            ~np.isnan(self.destination[:, 0]),
            self.to_way_out,
            self.number,
        ]
        return np.stack(columns, axis=-1, dtype=float)
