"""One instant of an evacuation on all floors, or of two side by side, and its curves.

Clauses: B4 and B7 for people's modes and health, C5 for robots and their destinations,
D3, D7 and A6 for sources, flames and burnt doors.  Shapes tell things apart as well as
colours do: disc follower, triangle leader, diamond robot, drop fire source.  A faint
line is where a person walked lately: who walks in circles draws one.
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field
from math import ceil
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import PathCollection
from matplotlib.colors import ListedColormap, Normalize
from matplotlib.figure import Figure
from matplotlib.path import Path
from matplotlib.text import Text
from matplotlib.ticker import MaxNLocator

from reference.building import Building, Kind
from reference.paper import HEALTH
from reference.workshop.drawing import page, plans
from reference.workshop.drawing.page import COLOURS, Style
from reference.world import Fate, Mode, World

_LEFT_HALF = [(-0.4, -1), (-0.8, -0.9), (-0.8, -0.4), (-0.8, 0.2), (-0.25, 0.5)]
_RIGHT_HALF = [(-x, y) for x, y in reversed(_LEFT_HALF)]
DROP = Path(  # a flame, as a marker
    [(0, 1.1), *_RIGHT_HALF, (0, -1), *_LEFT_HALF, (0, 1.1)],
    [Path.MOVETO, *[Path.CURVE4] * 12],
)
STEPS = ["#101b46", "#2c3a78", "#565a86", "#807c83", "#ada06f", "#dcc64f", "#ffe838"]
HEALTHS = ListedColormap(STEPS, name="health")
"""Dark at death, bright in full health, for every eye; few steps keep films small."""

MODES = {Mode.FOLLOWER: "follower", Mode.LEADER: "leader"}
FIRES = ("flames", "fire source", "burnt door")
TRAIL_SECONDS = 10
TRAIL = f"walked in {TRAIL_SECONDS} s"
ENTRIES = (*MODES.values(), TRAIL, "robot", "destination", *FIRES, "died here")
"""What the legend can list, besides the kinds of cells and the curves."""

INK = "#16191d"
FLAME, EMBER, SOURCE, CHAR = "#f47b20", "#c43c00", "#d11a1a", "#1d120c"
CURVES: dict[str, Style] = {
    "out": {"label": "out", "color": COLOURS[Kind.EXIT]},
    "inside": {"label": "inside", "color": page.FAINT, "ls": (0, (4, 1.5))},
    "dead": {"label": "dead", "color": INK, "ls": (0, (1, 1))},
}
OF_TWO: tuple[Style, ...] = (
    CURVES["out"] | {"label": "out, left", "ls": (0, (4, 1.5))},
    CURVES["out"] | {"label": "out, right"},
)
"""Of two evacuations one curve each."""

_WIDTHS = {1: 11.0, 2: 13.0}  # inches, of a page with one evacuation or two
_HIGH = 5.2  # inches for all floors
_SPARE = (0.15, 0.3)  # inches beside and above each floor
_TITLE, _STRIP = 0.66, 1.45  # inches for the title, and for legend and curve below
_COUNTS = "after {:.0f} s: {} inside, {} out, {} dead"
_CELLS = (Kind.WALL, Kind.DOOR, Kind.ENTRANCE, Kind.EXIT, Kind.STAIRS)


@dataclass(frozen=True)
class Tally:
    """How many people were where at a time (seconds).

    spots: (n, 3) each one's floor, and x and y in metres, NaN for who does not walk
    """

    time: float
    out: int
    inside: int
    dead: int
    spots: np.ndarray | None = field(default=None, compare=False, repr=False)


def tally(world: World) -> Tally:
    """Count the people of a world."""
    bodies = world.bodies
    count = np.bincount(bodies.fate, minlength=len(Fate)).tolist()
    out, inside, dead = (count[f] for f in (Fate.EVACUATED, Fate.INSIDE, Fate.DEAD))
    walked = np.where(bodies.walking[:, None], bodies.position, np.nan)
    spots = np.column_stack([bodies.floor, walked])
    return Tally(world.time, out, inside, dead, spots)


def frame(
    world: World, history: Sequence[Tally] | None = None, heading: str = ""
) -> Figure:
    """Draw people, robots and fire on all floors at one instant.

    history: the tallies up to now, oldest first, for the curve of who is out and for
    people's trails; without it there are none.  heading: instead of the building's
    title.
    """
    shown = possible(world.building, bool(world.robots), bool(world.flames.sources))
    if history is None:
        shown -= {TRAIL, *CURVES}
    scene = Scene(world.building, len(world.bodies), shown, [heading])
    scene.show(world, history or [tally(world)])
    return scene.figure


def possible(building: Building, robots: bool, fire: bool) -> set[str]:
    """Name all that can occur: the legend of a film must not change.

    robots, fire: whether there are any
    """
    doors = any(mark.kind is Kind.DOOR for mark in building.landmarks)
    names = {*MODES.values(), TRAIL, "died here", *CURVES}
    names |= {"robot", "destination"} if robots else set()
    names |= {*FIRES} if fire else set()
    return names if doors else names - {"burnt door"}


class Scene:
    """A page of one evacuation, or of two in the same building, side by side.

    What stands still is drawn once.

    title   all headings
    sides   what moves in each evacuation
    moving  the artists that `show` changes, in the order of painting
    still   set to False by `show` if it had to change the page itself
    """

    def __init__(
        self,
        building: Building,
        people: int,
        shown: Collection[str],
        headings: Sequence[str] = ("",),
        dpi: int = page.DPI,
    ):
        """shown: what the legend lists; headings: of each, "" is the building's."""
        self.still = True
        self.title = " | ".join(heading or building.title for heading in headings)
        count, width = len(headings), _WIDTHS[len(headings)]
        share = width / count
        layout = Layout(building, (share - 0.3, _HIGH))
        self.figure = page.blank(width, layout.height, dpi)
        self.sides = [
            Side(self.figure, building, layout, (k * share, share), heading)
            for k, heading in enumerate(headings)
        ]
        self.curve = _curve(self.figure, people, width - (0.85 + 0.15 * count))
        looks = [CURVES] if count == 1 else [{"out": look} for look in OF_TWO]
        self.lines = [
            {k: self.curve.plot([], [], lw=2, **c[k])[0] for k in c if k in shown}
            for c in looks
        ]
        self._explain([name for name in ENTRIES if name in shown], building)
        _health_bar(self.figure)
        self.moving: list[Artist] = [a for side in self.sides for a in side.moving]
        for lines in self.lines:
            self.moving += lines.values()

    def show(self, world: World, history: Sequence[Tally], side: int = 0) -> None:
        """Move everything of one evacuation to where it is in a world."""
        self.sides[side].show(world, history)
        times = [tally.time for tally in history]
        for name, line in self.lines[side].items():
            line.set_data(times, [getattr(tally, name) for tally in history])
        if times[-1] > (end := self.curve.get_xlim()[1]):
            self.curve.set_xlim(0, max(times[-1], 1.5 * end))
            self.still = False

    def _explain(self, names: Sequence[str], building: Building) -> None:
        """Add legends of shapes by name, of kinds of cells, and of curves if any."""
        looks = _looks(7.5) | {
            "follower": _marker("o", 8, STEPS[-1], INK, 0.7),
            "leader": _marker("^", 9, STEPS[-1], INK, 0.7),
        }
        shapes = page.samples({name: looks[name] for name in names})
        cells = page.swatches(page.present(building.kind, _CELLS))
        across, up = self.figure.get_size_inches()
        for handles, rows, bottom in ((shapes, 2, 0.4), (cells, 1, 0.08)):
            place = (0.1 / across, bottom / up)
            look: Style = {"loc": "lower left", "bbox_to_anchor": place}
            look |= {"handlelength": 1.3, "columnspacing": 1.1}
            look["ncols"] = max(ceil(len(handles) / rows), 1)
            self.figure.legend(handles=handles, **look)
        if any(self.lines):
            look = {"loc": "center left", "bbox_to_anchor": (1.0, 0.5)}
            self.curve.legend(fontsize=9, handlelength=1.8, **look)
        else:
            self.curve.set_visible(False)


class Side:
    """One evacuation on a page: the building, and what moves in it."""

    def __init__(
        self,
        figure: Figure,
        building: Building,
        layout: "Layout",
        span: tuple[float, float],
        heading: str,
    ):
        """span: inches from the page's left edge, and how wide."""
        self.building = building
        self.axes = _floors(figure, building, layout, span)
        self.offset = layout.corners - page.frame_of(building).min
        for area in building.areas:
            plans.write_name(self.axes, building, area, self.offset[area.floor], 7.0)
        counts = _title(figure, heading or building.title, span)
        metre = layout.scale * 72  # in points
        looks = _looks(metre).items()
        self.marks = {name: self.axes.plot([], [], **look)[0] for name, look in looks}
        self.people = {mode: self._crowd(mode, metre) for mode in Mode}
        robots = self.marks["robot"]
        below = [mark for mark in self.marks.values() if mark is not robots]
        self.moving = [*below, *self.people.values(), robots, counts]
        for order, artist in enumerate(self.moving):
            artist.set_zorder(3 + order / 100)
        self.counts = counts

    def show(self, world: World, history: Sequence[Tally]) -> None:
        """Move everything to where it is in a world."""
        self._show_fire(world)
        self._show_robots(world)
        self._show_trails(world, history)
        self._show_people(world)
        now = history[-1]
        counts = _COUNTS.format(now.time, now.inside, now.out, now.dead)
        self.counts.set_text(counts)

    def _crowd(self, mode: Mode, metre: float) -> PathCollection:
        """Add discs for followers or triangles for leaders; metre: in points."""
        shape, share = ("o", 1.0) if mode is Mode.FOLLOWER else ("^", 1.25)
        size = (float(np.clip(0.85 * metre, 4.5, 10)) * share) ** 2
        look: Style = {"cmap": HEALTHS, "vmin": 0, "vmax": HEALTH, "edgecolors": INK}
        return self.axes.scatter([], [], size, marker=shape, c=[], lw=0.7, **look)

    def on_page(self, floor: Any, position: Any) -> np.ndarray:
        """Places (2, k) on the page of k floors and (k, 2) metres."""
        floor = np.asarray(floor, dtype=int).reshape(-1)
        return (np.asarray(position, float).reshape(-1, 2) + self.offset[floor]).T

    def _show_people(self, world: World) -> None:
        bodies = world.bodies
        for mode, crowd in self.people.items():
            who = bodies.inside & (bodies.mode == mode)
            crowd.set_offsets(self.on_page(bodies.floor[who], bodies.position[who]).T)
            crowd.set_array(bodies.health[who])
        dead = bodies.fate == Fate.DEAD
        spots = self.on_page(bodies.floor[dead], bodies.position[dead])
        self.marks["died here"].set_data(*spots)

    def _show_trails(self, world: World, history: Sequence[Tally]) -> None:
        """Draw where people inside walked, unless tallies are over a second apart."""
        since = history[-1].time - TRAIL_SECONDS
        recent = [t.spots for t in history if t.time > since and t.spots is not None]
        if len(recent) < 2 or len(recent) < min(TRAIL_SECONDS, history[-1].time):
            self.marks[TRAIL].set_data([], [])
            return
        floor, x, y = np.stack(recent, axis=1)[world.bodies.inside].T  # (tallies, n)
        ways = self.on_page(floor, np.stack([x, y], axis=2)).reshape(2, *x.shape)
        apart = np.full((2, 1, x.shape[1]), np.nan)  # from one person to the next
        ways = np.concatenate([ways, apart], axis=1)
        self.marks[TRAIL].set_data(*ways.swapaxes(1, 2).reshape(2, -1))

    def _show_robots(self, world: World) -> None:
        robots = world.robots
        sent = [r for r in robots if r.active and r.destination is not None]
        start = self.on_page([r.floor for r in sent], [r.position for r in sent])
        there = self.on_page([r.floor for r in sent], [r.destination for r in sent])
        here = self.on_page([r.floor for r in robots], [r.position for r in robots])
        self.marks["robot"].set_data(*here)
        self.marks["destination"].set_data(*there)
        gaps = np.full_like(there, np.nan)
        ways = np.stack([start, there, gaps], axis=2).reshape(2, -1)
        self.marks["way"].set_data(*ways)

    def _show_fire(self, world: World) -> None:
        sources = world.flames.sources
        burnt = [self.building.landmarks[k] for k in world.burnt]
        doors = [(mark.floor, *cell) for mark in burnt for cell in mark.cells]
        self._mark_cells("flames", np.argwhere(world.flames.burning))
        self._mark_cells("burnt door", np.array(doors, dtype=int).reshape(-1, 3))
        lit = self.on_page([s.floor for s in sources], [(s.x, s.y) for s in sources])
        self.marks["fire source"].set_data(*lit)

    def _mark_cells(self, name: str, cells: np.ndarray) -> None:
        """Put marks on cells: (k, 3) floor, row and column."""
        floor, *cell = cells.T
        x, y = self.building.metres(*cell)  # of all at once
        self.marks[name].set_data(*self.on_page(floor, np.stack([x, y], axis=-1)))


# -- What stands still --------------------------------------------------------------


class Layout:
    """Places of the floors of one evacuation: inches from the lower left of them all.

    scale    inches to a metre
    page     width and height of all floors together
    height   of the whole page
    corners  (floors, 2) lower left corner of each, metres
    """

    def __init__(self, building: Building, room: tuple[float, float]):
        size, floors = page.frame_of(building).size, building.floors
        columns, self.scale = page.arrange(floors, size, room, _SPARE)
        rows = ceil(floors / columns)
        panel = np.array(size) * self.scale + _SPARE
        self.page = panel * (columns, rows)
        self.height = float(_TITLE + self.page[1] + _STRIP)
        row, column = np.divmod(np.arange(floors), columns)
        places = np.stack([column, rows - 1 - row], axis=1)
        self.corners = (places * panel + (_SPARE[0] / 2, 0)) / self.scale


def _panel(
    figure: Figure, left: float, bottom: float, width: float, height: float
) -> Axes:
    """Add axes at a place in inches."""
    across, up = figure.get_size_inches()
    return figure.add_axes((left / across, bottom / up, width / across, height / up))


def _floors(
    figure: Figure, building: Building, layout: Layout, span: tuple[float, float]
) -> Axes:
    """Paint all floors, and a scale, on one set of axes in metres."""
    wide, high = layout.page
    axes = _panel(figure, span[0] + (span[1] - wide) / 2, _STRIP, wide, high)
    axes.set(xlim=(0, wide / layout.scale), ylim=(0, high / layout.scale))
    axes.set_axis_off()
    frame = page.frame_of(building)
    for floor, (x, y) in enumerate(layout.corners):
        where, top = (x, x + frame.width, y, y + frame.height), y + frame.height
        axes.imshow(page.paint(building.kind[floor]), extent=where, aspect="auto")
        name = page.floor_title(building, floor)
        size = page.text_size(name, frame.width * layout.scale, 10)
        axes.text(x, top + 0.05 / layout.scale, name, fontsize=size, va="bottom")
    metres, left, low = page.step_of(frame), *np.array((0.08, -0.13)) / layout.scale
    line: Style = {"color": page.FAINT, "lw": 2, "clip_on": False}
    axes.plot([left, left + metres], [low, low], **line)
    look: Style = {"fontsize": 8, "color": page.FAINT, "va": "center"}
    axes.text(left + metres, low, f"  {metres} m", **look)
    return axes


def _title(figure: Figure, heading: str, span: tuple[float, float]) -> Text:
    """Add a heading; return the line below it, for counts."""
    across, up = figure.get_size_inches()
    size = page.text_size(heading, span[1] - 0.4, 14)
    left = (span[0] + 0.2) / across
    figure.text(left, 1 - 0.1 / up, heading, fontsize=size, weight="bold", va="top")
    return figure.text(left, 1 - 0.42 / up, "", fontsize=12, va="top")


def _curve(figure: Figure, people: int, right: float) -> Axes:
    """Add axes for how many are where over time; right: inches from the left edge."""
    axes = _panel(figure, 7.45, 0.42, right - 7.45, _STRIP - 0.6)
    axes.set(xlim=(0, 60), ylim=(-0.03 * people, 1.06 * people + 0.1))
    axes.spines[:].set_color("black")
    axes.yaxis.set_major_locator(MaxNLocator(3, integer=True))
    axes.set_xlabel("seconds", fontsize=8, labelpad=1)
    axes.set_ylabel("people", fontsize=8)
    return axes


def _health_bar(figure: Figure) -> None:
    """Add the colour scale of health, between legend and curve."""
    axes = _panel(figure, 5.75, 0.62, 1.05, 0.14)
    scale = ScalarMappable(Normalize(0, HEALTH), HEALTHS)
    look: Style = {"orientation": "horizontal", "ticks": (0, HEALTH)}
    figure.colorbar(scale, axes, **look)
    axes.set_title("health", fontsize=9, loc="center", pad=3)


def _looks(metre: float) -> dict[str, Style]:
    """Markers of all that moves but the people; metre: in points."""
    mark = float(np.clip(metre, 5, 11))
    return {
        TRAIL: {"color": page.FAINT, "lw": 1.0, "alpha": 0.5},
        "flames": _marker("s", 0.94 * metre, FLAME, EMBER, 0.6),
        "burnt door": _marker("s", 0.9 * metre, CHAR, FLAME, 1.0),
        "fire source": _marker(DROP, 1.9 * mark, SOURCE, "white", 0.9),
        "way": {"color": INK, "lw": 0.8, "ls": (0, (4, 2))},
        "destination": _marker("+", 1.3 * mark, INK, INK, 1.4),
        "died here": _marker("x", 0.9 * mark, INK, INK, 1.6),
        "robot": _marker("D", 1.05 * mark, "white", INK, 1.8),
    }


def _marker(shape: Any, size: float, fill: str, edge: str, width: float) -> Style:
    colours = {"mfc": fill, "mec": edge, "mew": width}
    return {"ls": "", "marker": shape, "ms": size, **colours}
