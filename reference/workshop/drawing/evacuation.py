"""One instant of an evacuation on all floors, or of several, and its curves.

Shapes tell things apart as well as colours do: disc follower, triangle leader [B4],
diamond robot [C5], star fire source [D3].  People darken as they lose health [B7];
flames, ash and burnt doors are boxes [D7] [A6], below the names of rooms.  A faint line
is where a person walked lately: who walks in circles draws one.  A number beside a
robot is how many stand there; a stairwell's letter is over its people.
"""

from collections.abc import Collection, Sequence
from textwrap import wrap
from typing import Any, NamedTuple

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import ListedColormap, Normalize
from matplotlib.lines import Line2D
from matplotlib.path import Path
from matplotlib.text import Text
from matplotlib.textpath import TextPath
from matplotlib.transforms import ScaledTranslation

from reference import paper
from reference.building import Area, Building, Kind, Stairwell
from reference.navigation import navigation_of
from reference.simulation import Simulation
from reference.workshop.drawing import page, plans
from reference.workshop.drawing.page import COLOURS, Style
from reference.world import Died, Evacuated, Fate, Mode, World

STEPS = ["#101b46", "#333f82", "#6a78ad", "#c2b05c", "#ffe838"]
HEALTHS = ListedColormap(STEPS, name="health")
"""Dark at death, bright in full health, for every eye; none is as grey as ash.

A step is 20 of 100, as the scale is marked; few steps keep films small.
"""

OVER_FLAMES = 3.8  # where names of rooms are drawn, below all that moves
OVER_ALL = 7  # where letters of stairwells are drawn, and numbers of robots
SIGN_SIZE = 7.5  # points, of these
ONE_SPOT = 0.5  # metres between robots of which one hides the other
TO_NUMBER = (0.11, -0.09)  # inches from a robot to the number of those on its spot
MOST_COUNTED = 9  # robots on one spot: "9+" are nine or more
NUMBERED = "robot (2: two on one spot)"  # in the legend, if a number may be seen
NUMBERS = "numbers of robots"  # among the names of what is nowhere to be seen
ALONE_WIDE = 11  # inches of a page with one evacuation
MORE_WIDE = 2  # inches that each further one adds
MOST_HIGH = 5.2  # inches of floors
LEAST_SCALE = 0.9  # inches, of health beside floors that are lower
FLOORS_WIDE = 0.85  # of an evacuation's share of the page
BELOW = 3.5  # inches of the page for headings, curves and legends
LETTERS_PER_INCH = 13.6  # of lines below a title
POINTS_PER_INCH = 72
TRAIL_SECONDS = 10
TRAIL = f"walked in {TRAIL_SECONDS} s"
INK = "#16191d"
ASH = "#8d8782"
FLAME = "#f47b20"
EMBER = "#c43c00"
SOURCE = "#d11a1a"
CHAR = "#1d120c"
INKS = {"ink": INK, "flame": FLAME, "ember": EMBER, "source": SOURCE, "char": CHAR}
INKS |= {"ash": ASH, "text": page.TEXT, "faint": page.FAINT}
CURVES: dict[str, Style] = {
    "out": {"color": COLOURS[Kind.EXIT], "lw": 2},
    "inside": {"color": page.FAINT, "lw": 2, "ls": (0, (4, 1.5))},
    "dead": {"color": INK, "lw": 2, "ls": (0, (1, 1))},
}


class Tally(NamedTuple):
    """How many people were where at a time (seconds).

    spots: (n, 3) each one's floor, and x and y in metres, NaN for who does not walk
    """

    time: float
    out: int
    inside: int
    dead: int
    spots: np.ndarray | None = None


def tally(world: World) -> Tally:
    """Count the people of a world."""
    bodies = world.bodies
    inside, out, dead = np.bincount(bodies.fate, minlength=len(Fate)).tolist()
    walked = np.where(bodies.walking[:, None], bodies.position, np.nan)
    spots = np.column_stack([bodies.floor, walked])
    return Tally(world.time, out, inside, dead, spots)


def history_of(simulation: Simulation) -> list[Tally]:
    """Tally a simulation by its events; only now has spots.

    From 0 s on, or, if people had left or died in the world that it began with, from
    its first event on.
    """
    now = tally(simulation.world)
    people = now.out + now.inside + now.dead
    # before the first event
    out = now.out - sum(isinstance(e, Evacuated) for e in simulation.events)
    dead = now.dead - sum(isinstance(e, Died) for e in simulation.events)
    tallies = [] if out or dead else [Tally(0.0, 0, people, 0)]
    for event in simulation.events:
        out += isinstance(event, Evacuated)
        dead += isinstance(event, Died)
        tallies.append(Tally(event.time, out, people - out - dead, dead))
    return [*tallies, now]


def frame(world: World, history: Sequence[Tally] | None = None) -> page.Picture:
    """Draw people, robots and fire on all floors at one instant.

    history: the tallies up to now, oldest first, for the curve of who is out and for
    people's trails
    """
    scene = Scene(world.building, len(world.bodies))
    scene.show(world, history or [tally(world)])
    scene.leave_out_of_legend(scene.sides[0].absent())
    return scene.figure


class Scene:
    """A page of one evacuation, or of several in the same building, side by side.

    What stands still is drawn once.

    sides   what moves in each evacuation
    moving  the artists that `show` changes, in the order of painting
    """

    def __init__(
        self, building: Building, people: int, headings: Sequence[str] = ("",)
    ):
        """headings: of each; "" is the building's title, further lines are small."""
        count = len(headings)
        rows, columns = page.arranged(building, building.floors)
        cells_down, cells_across = building.kind.shape[1:]
        down = rows * cells_down
        across = columns * cells_across
        width = ALONE_WIDE - MORE_WIDE + MORE_WIDE * count
        high = min(MOST_HIGH, FLOORS_WIDE * width / count * down / across)

        self.figure = page.Picture((width, high + BELOW), layout="constrained")
        look: Style = {"height_ratios": (high, 1), "squeeze": False}
        pairs = self.figure.subplots(2, count, **look).T
        for (axes, curve), heading in zip(pairs, headings, strict=True):
            moves = paint_floors(axes, building, POINTS_PER_INCH * high / down)
            _write_heading(axes, heading or building.title, width / count)
            curve.set(xlim=(0, paper.health_seconds()), ylim=(0, 1.05 * max(people, 1)))
            curve.set(xlabel="seconds", ylabel="people")
            curve.locator_params(axis="y", integer=True)
        health = self._add_legends(pairs[:, 0], building)

        for _ in range(2):  # to lay out ticks, then the page around them
            self.figure.draw_without_rendering()
        self.figure.set_layout_engine("none")  # a film's page must not jump
        self._move_beside(health, pairs[-1, 0])
        self.sides = [
            EvacuationPanel(axes, curve, building, moves) for axes, curve in pairs
        ]
        self.moving = [artist for side in self.sides for artist in side.moving]

    def _add_legends(self, axes: np.ndarray, building: Building) -> Axes:
        """Add the scale of health beside the floors, returned, and all shapes below."""
        health = ScalarMappable(Normalize(0, paper.HEALTH), HEALTHS)
        look: Style = {"label": "health", "pad": 0.01, "panchor": (0, 1)}
        look |= {"ticks": np.linspace(0, paper.HEALTH, len(STEPS) + 1)}
        scale = self.figure.colorbar(health, ax=axes, **look)
        shapes = page.samples(looks(7.5) | CURVES)
        cells = page.swatches(building.kind[building.kind != Kind.FLOOR])
        self._tell([*shapes, *cells])
        return scale.ax

    def _move_beside(self, scale: Axes, floors: Axes) -> None:
        """Move a scale to the right edge of floors, which may not fill their place."""
        floors.apply_aspect()
        plan = floors.get_position()
        across, up = 1 / self.figure.get_size_inches()  # an inch
        high = max(plan.height, LEAST_SCALE * up)
        low = (plan.y0 + plan.y1 - high) / 2
        scale.set_box_aspect(None)
        scale.set_position((plan.x1 + 0.15 * across, low, 0.12 * across, high))

    def _tell(self, entries: list[Artist], numbers: bool = True) -> None:
        """Make the legend below, of entries labelled as `looks` names them.

        numbers: of robots on one spot may be seen
        """
        self.entries = entries
        page.legend(self.figure, entries, ncols=9)
        for text in self.figure.legends[0].get_texts():
            if numbers and text.get_text() == "robot":
                text.set_text(NUMBERED)

    def leave_out_of_legend(self, names: Collection[str]) -> None:
        """Make the legend again, without these names of what is not to be seen."""
        self.figure.legends[0].remove()
        left = [each for each in self.entries if each.get_label() not in names]
        self._tell(left, numbers=NUMBERS not in names)

    def show(self, world: World, history: Sequence[Tally], side: int = 0) -> None:
        """Move everything of one evacuation to where it is in a world."""
        self.sides[side].show(world, history)


class EvacuationPanel:
    """One evacuation on a page: what moves on its floors, and its curves."""

    def __init__(self, axes: Axes, curve: Axes, building: Building, moves: np.ndarray):
        """moves: (floors, 2) metres, see `paint_floors`."""
        self.axes = axes
        self.curve = curve
        self.building = building
        self.moves = moves
        self.centres = navigation_of(building).centres
        self.names = {
            area.index: written
            for area in building.areas
            if area.kind == "room" and (written := self._write_name(area))
        }

        own = looks(plans.points_per_metre(axes))
        crowd: Style = {"cmap": HEALTHS, "vmin": 0, "vmax": paper.HEALTH, "c": []}
        crowd |= {"ec": INK, "lw": 0.7, "zorder": 5, "clip_on": False}
        self.people = {}
        for mode in Mode:
            look = own.pop(mode.name.lower())
            crowd |= {"marker": look["marker"], "s": look["ms"] ** 2}
            self.people[mode] = axes.scatter([], [], **crowd)
        self.marks = {
            name: axes.plot([], [], clip_on=False, in_layout=False, **look)[0]
            for name, look in own.items()
        }
        scale = axes.figure.dpi_scale_trans
        beside = axes.transData + ScaledTranslation(*TO_NUMBER, scale)
        numbers = {count: str(count) for count in range(2, MOST_COUNTED)}
        numbers[MOST_COUNTED] = f"{MOST_COUNTED}+"
        self.counts = {
            count: _write_signs(axes, number, transform=beside)
            for count, number in numbers.items()
        }
        self.letters = [self._write_letters(well) for well in building.stairwells]
        self.lines = {k: curve.plot([], [], **look)[0] for k, look in CURVES.items()}
        self.texts = [_note(axes, "", x, 20, 12) for x in (0, 80)]

        there = [*self.marks.values(), *self.people.values(), *self.names.values()]
        for signs in [*self.counts.values(), *self.letters]:
            there += signs
        there.sort(key=Artist.get_zorder)
        self.moving: list[Artist] = [*self.texts, *there, *self.lines.values()]

    def _write_name(self, area: Area) -> Text | None:
        """Write a room's name, and again what is to be seen over flames there."""
        here: Any = (self.axes, self.building, area, 7.0, self.moves[area.floor])
        plans.write_name(*here)
        again = plans.write_name(*here)
        if again:
            again.set(visible=False, zorder=OVER_FLAMES)
        return again

    def _write_letters(self, well: Stairwell) -> list[Line2D]:
        """Write a stairwell's letter at its north end: robots stand in its middle."""
        storeys = [self.building.areas[index] for index in well.areas.values()]
        ends = [self.building.metres(*plans.north_end(area)) for area in storeys]
        signs = _write_signs(self.axes, well.letter)
        _move(signs, self.on_page([*well.areas], ends))
        return signs

    def show(self, world: World, history: Sequence[Tally]) -> None:
        """Move everything to where it is in a world."""
        self._show_fire(world)
        self._show_robots(world)
        self._show_trails(world, history)
        self._show_people(world)
        now = history[-1]
        times = [tally.time for tally in history]
        clock, counts = self.texts
        clock.set_text(f"after {now.time:.0f} s:")
        counts.set_text(f"{now.inside} inside, {now.out} out, {now.dead} dead")
        for name, line in self.lines.items():
            line.set_data(times, [getattr(tally, name) for tally in history])

    def absent(self) -> set[str]:
        """Name what moves and is nowhere to be seen now, as `looks` does."""
        drawn = {name: mark.get_xdata() for name, mark in self.marks.items()}
        for mode, crowd in self.people.items():
            drawn[mode.name.lower()] = crowd.get_offsets()
        names = {name for name, places in drawn.items() if not np.size(places)}
        if not any(np.size(signs[0].get_xdata()) for signs in self.counts.values()):
            names.add(NUMBERS)
        return names

    def on_page(self, floor: Any, position: Any) -> np.ndarray:
        """Find places on the axes, (2, k), of k floors and (k, 2) metres."""
        floors = np.asarray(floor, dtype=int).reshape(-1)
        places = np.asarray(position, dtype=float).reshape(-1, 2)
        return (places + self.moves[floors]).T

    def _show_people(self, world: World) -> None:
        bodies = world.bodies
        for mode, crowd in self.people.items():
            who = bodies.inside & (bodies.mode == mode)
            crowd.set_offsets(self.on_page(bodies.floor[who], bodies.position[who]).T)
            crowd.set_array(bodies.health[who])
        dead = bodies.fate == Fate.DEAD
        self._put("died here", bodies.floor[dead], bodies.position[dead])

    def _show_trails(self, world: World, history: Sequence[Tally]) -> None:
        """Draw where people inside walked, unless tallies are over a second apart."""
        since = history[-1].time - TRAIL_SECONDS
        recent = [t.spots for t in history if t.time > since and t.spots is not None]
        if len(recent) < max(2, min(TRAIL_SECONDS, history[-1].time)):
            return
        floor, x, y = np.stack(recent, axis=1)[world.bodies.inside].T  # (tallies, n)
        places = self.on_page(floor, np.stack([x, y], axis=2)).reshape(2, *x.shape)
        # One line draws all trails: after each a NaN, where it is interrupted.
        trails = np.pad(places, ((0, 0), (0, 1), (0, 0)), constant_values=np.nan)
        x, y = trails.swapaxes(1, 2).reshape(2, -1)
        self.marks[TRAIL].set_data(x, y)

    def _show_robots(self, world: World) -> None:
        robots = world.robots
        self._put("robot", [r.floor for r in robots], [r.position for r in robots])
        self._count_robots(world)

        sent = [r for r in robots if r.active and r.destination is not None]
        floors = [r.floor for r in sent]
        start = self.on_page(floors, [r.position for r in sent])
        there = self.on_page(floors, [r.destination for r in sent])
        between = np.full_like(there, np.nan)  # where the line is interrupted
        x, y = np.stack([start, there, between], axis=2).reshape(2, -1)
        self.marks["destination"].set_data(x, y)

    def _count_robots(self, world: World) -> None:
        """Write beside the first of several robots on one spot how many there are."""
        if not world.robots:
            return
        floors = np.array([robot.floor for robot in world.robots], int)
        places = np.array([robot.position for robot in world.robots])
        apart = np.hypot(*(places[:, None] - places[None]).T)
        near = (apart < ONE_SPOT) & (floors[:, None] == floors)
        counts = np.minimum(near.sum(axis=1), MOST_COUNTED)
        first = np.argmax(near, axis=1) == np.arange(len(near))
        for count, signs in self.counts.items():
            here = (counts == count) & first
            _move(signs, self.on_page(floors[here], places[here]))

    def _show_fire(self, world: World) -> None:
        flames = world.flames
        self._put_cells("flames", flames.burning)
        self._put_cells("ash", flames.ash)
        burnt = np.isin(self.building.landmark, [*world.burnt])
        self._put_cells("burnt door", burnt)
        self._show_names(flames.burning | flames.ash)
        lit = [(source.x, source.y) for source in flames.sources]
        self._put("fire source", [source.floor for source in flames.sources], lit)

    def _show_names(self, lit: np.ndarray) -> None:
        """Show the names of rooms with fire or ash once more, over it.

        lit: (floors, rows, columns) bool.  All names at each instant would take long.
        """
        burns = {*self.building.area[lit].tolist()}
        for area, name in self.names.items():
            name.set_visible(area in burns)

    def _put_cells(self, name: str, cells: np.ndarray) -> None:
        """Put marks on some cells; cells: (floors, rows, columns), which of all."""
        place = np.flatnonzero(cells)
        self._put(name, place // cells[0].size, self.centres[place])

    def _put(self, name: str, floor: Any, position: Any) -> None:
        self.marks[name].set_data(*self.on_page(floor, position))


def _write_heading(axes: Axes, heading: str, wide: float) -> None:
    """Write a title, and all further lines small below it, on so many inches."""
    title, *lines = heading.split("\n")
    longest = int(LETTERS_PER_INCH * wide)
    words = [
        part
        for line in lines
        for part in wrap(page.of_shorter_words(line, longest), longest)
    ]
    look: Style = {"fontsize": 14, "weight": "bold", "pad": 38 + 13 * len(words)}
    room = FLOORS_WIDE * wide * axes.figure.dpi
    page.write_title(axes.set_title("", **look), title, room)
    for row, line in enumerate(reversed(words)):
        _note(axes, line, 0, 36 + 13 * row, 9)


def _note(axes: Axes, words: str, x: float, y: float, size: float) -> Text:
    """Write words above axes that keep their size, x and y points from their corner."""
    at: Style = {"xycoords": "axes fraction", "textcoords": "offset points"}
    return axes.annotate(words, (0, 1), (x, y), fontsize=size, in_layout=False, **at)


def paint_floors(
    axes: Axes, building: Building, metre: float, names: Sequence[str] = ()
) -> np.ndarray:
    """Paint all floors on the same axes, and a scale.

    metre: in points, about;  names: of the floors, if not their titles
    Returns each one's move from the building to the axes, (floors, 2) metres.
    """
    left, right, low, high = page.extent_of(building)
    _, columns = page.arranged(building, building.floors)
    row, column = np.divmod(np.arange(building.floors), columns)
    across = 1.1 * (right - left)
    down = high - low + 20 / metre  # with room for names
    moves = np.stack([column * across, -row * down], axis=1)
    letters = int(across * metre / 6.5)
    for floor, (x, y) in enumerate(moves):
        extent = (left + x, right + x, low + y, high + y)
        axes.imshow(page.paint(building.kind[floor]), extent=extent)
        name = page.floor_title(building, floor)
        if len(name) > letters:
            name = f"Floor {floor + 1}"
        if names:
            name = page.shortened(names[floor], letters)
        axes.annotate(name, (left + x, high + y), (0, 3), textcoords="offset points")
    axes.set_xlim(left, right + max(moves[:, 0]))
    axes.set_ylim(low + min(moves[:, 1]), high)
    scale = 5 * int(np.ceil(5 / metre))  # whose labels stay apart
    axes.set(yticks=[], xticks=[left, left + scale], xticklabels=["0", f"{scale} m"])
    axes.spines[:].set_visible(False)
    return moves


def looks(metre: float) -> dict[str, Style]:
    """Choose the look of all that moves, the upper later; metre: in points."""
    mark = float(np.clip(metre, 5, 10))
    line: Style = {"ls": (0, (4, 2)), "lw": 0.8, "color": INK, "markevery": (1, 3)}
    seen = line | plans.HALO  # on walls, too
    return {
        "follower": marker("o", 0.9 * mark, STEPS[-1], INK, 0.7),
        "leader": marker("^", 1.1 * mark, STEPS[-1], INK, 0.7),
        "robot": marker("D", 1.05 * mark, "white", INK, 1.8) | {"zorder": 6},
        TRAIL: {"color": page.FAINT, "lw": 1.0, "alpha": 0.5, "zorder": 4},
        "flames": marker("s", 0.94 * metre, FLAME, EMBER, 0.6) | {"zorder": 3.5},
        "ash": marker("s", metre, ASH, ASH, 0.6) | {"zorder": 3.2},
        "burnt door": marker("s", 0.9 * metre, CHAR, FLAME, 1.0) | {"zorder": 3.5},
        "fire source": marker("*", 2.6 * mark, SOURCE, "white", 0.9),
        "destination": marker("+", 1.3 * mark, INK, INK, 1.4) | seen,
        "died here": marker("x", 0.9 * mark, INK, INK, 1.6),
    }


def _write_signs(axes: Axes, word: str, **look: Any) -> list[Line2D]:
    """Write a letter or a number over all else, with a halo; marks cost less than text.

    They are nowhere until they are moved.
    """
    outline = TextPath((0, 0), word, size=SIGN_SIZE)
    middle = outline.get_extents().get_points().mean(axis=0)
    glyph = Path(outline.vertices - middle, outline.codes)
    size = 2 * np.abs(glyph.vertices).max()  # of the square around it, points
    look |= {"ls": "", "marker": glyph, "ms": size, "zorder": OVER_ALL}
    look |= {"clip_on": False}
    inks: tuple[Style, ...] = (
        {"color": "white", "mew": 2.4},
        {"color": INK, "mew": 0.2},
    )
    return [axes.plot([], [], **look, **ink)[0] for ink in inks]


def _move(signs: Sequence[Line2D], places: np.ndarray) -> None:
    """Move a letter to (2, k) places on its axes; nothing is painted for none."""
    for sign in signs:
        sign.set_data(*places)
        sign.set_visible(bool(places.size))


def marker(shape: Any, size: float, fill: str, edge: str, width: float) -> Style:
    """Choose the look of marks without a line; sizes in points."""
    colours = {"mfc": fill, "mec": edge, "mew": width}
    return {"ls": "", "marker": shape, "ms": size, "zorder": 4, **colours}
