"""Ink and paper: the colours, the legend, the layout of a page, and its saving.

Clauses: A2, A3 and A4 for the colours of doors, entrances and exits.  All sizes of a
page are inches, all places in a building metres, as in `building`.
"""

import os
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from math import ceil
from pathlib import Path

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.ticker import MultipleLocator

from reference.building import Building, Kind

COLOURS = {
    Kind.OUTSIDE: "#e7ecef",
    Kind.WALL: "#2b2f36",
    Kind.FLOOR: "#faf8f2",
    Kind.DOOR: "#3f9fe0",  # blue [A2]
    Kind.ENTRANCE: "#6d2c96",  # purple, darker than a door for every eye [A3]
    Kind.EXIT: "#0f9d58",  # green [A4]
    Kind.STAIRS: "#d8cbe6",
}
MEANINGS = {
    Kind.OUTSIDE: "outside",
    Kind.WALL: "wall",
    Kind.FLOOR: "floor",
    Kind.DOOR: "door",
    Kind.ENTRANCE: "stairwell entrance",
    Kind.EXIT: "exit",
    Kind.STAIRS: "stairwell",
}
TEXT = "#23272e"
FAINT = "#6b7480"
PICTURES = (".png", ".svg", ".pdf")
DPI = 150

_ROOM = (12.0, 6.2)  # inches for all panels of a page together
_SPARE = (0.75, 0.9)  # inches around a panel: ticks, its title
_TITLE, _FOOT, _NARROWEST = 0.55, 0.45, 9.2
_LARGEST = 0.3  # inches a metre may take


def save(figure: Figure, path: str | Path) -> Path:
    """Write a figure as .png, .svg or .pdf; all of it, or nothing.

    Raises ValueError for another suffix, OSError where the path cannot be written.
    """
    target = with_suffix(path, PICTURES, "a picture")
    with replacing(target) as partial:
        figure.savefig(partial)
    return target


def with_suffix(path: str | Path, known: Iterable[str], what: str) -> Path:
    """The path, if it ends as one of the known formats; else ValueError."""
    path = Path(path)
    if path.suffix.lower() not in known:
        *most, last = known
        raise ValueError(
            f"{path}: {what} cannot be written as '{path.suffix or path.name}'. "
            f"End the name in {', '.join(most)} or {last}."
        )
    return path


@contextmanager
def replacing(target: Path) -> Iterator[Path]:
    """A partial file beside the target that takes its place when the block is done.

    Whatever ends the block early, Ctrl-C too, takes the partial file with it.
    """
    partial = target.with_name(f".{target.stem}-{os.getpid()}-part{target.suffix}")
    try:
        partial.touch()
        yield partial
        os.replace(partial, target)
    except OSError as error:
        if error.strerror is None:  # it was told for people already
            raise
        raise OSError(
            f"{target}: cannot be written ({error.strerror}). "
            "Name a file in a folder that exists, is yours and has room."
        ) from error
    finally:
        partial.unlink(missing_ok=True)


@dataclass(frozen=True)
class Frame:
    """The edges of all cells of a floor, metres."""

    left: float
    bottom: float
    right: float
    top: float

    @property
    def size(self) -> tuple[float, float]:
        """Width and height, metres."""
        return self.right - self.left, self.top - self.bottom

    @property
    def step(self) -> int:
        """Metres between two ticks, or of a scale bar."""
        longest = max(self.size)
        return 10 if longest > 35 else 5 if longest > 12 else 1

    @property
    def extent(self) -> tuple[float, float, float, float]:
        """In matplotlib's order: left, right, bottom, top."""
        return self.left, self.right, self.bottom, self.top


def frame_of(building: Building) -> Frame:
    """Where the drawn page of a building's floors ends."""
    rows, cols = building.kind.shape[1:]
    left, top = building.metres(-0.5, -0.5)
    right, bottom = building.metres(rows - 0.5, cols - 0.5)
    return Frame(left, bottom, right, top)


def blank(width: float, height: float, dpi: int = DPI) -> Figure:
    """An empty figure that needs no display; width and height in inches."""
    figure = Figure(figsize=(width, height), dpi=dpi, facecolor="white")
    FigureCanvasAgg(figure)
    return figure


def arrange(
    count: int,
    size: tuple[float, float],
    room: tuple[float, float],
    spare: tuple[float, float],
) -> tuple[int, float]:
    """How many columns show so many panels largest, and the inches a metre then takes.

    size   of a panel, metres;  room  for all of them, spare  around each, inches
    """

    def scale(columns: int) -> float:
        across = (room[0] / columns - spare[0]) / size[0]
        down = (room[1] / ceil(count / columns) - spare[1]) / size[1]
        return min(across, down)

    columns = max(range(1, count + 1), key=scale)
    return columns, min(scale(columns), _LARGEST)


def floor_pages(
    building: Building, title: str, floors: tuple[int, ...]
) -> tuple[Figure, list[Axes]]:
    """A titled figure with one panel in metres for each of the floors, side by side."""
    frame = frame_of(building)
    columns, scale = arrange(len(floors), frame.size, _ROOM, _SPARE)
    wide, high = frame.size[0] * scale, frame.size[1] * scale
    rows = ceil(len(floors) / columns)
    width = max(columns * (wide + _SPARE[0]) + 0.3, _NARROWEST)
    height = rows * (high + _SPARE[1]) + _TITLE + _FOOT
    figure = blank(width, height)
    heading(figure, title)
    margin = (width - columns * (wide + _SPARE[0])) / 2
    panels = []
    for place, floor in enumerate(floors):
        row, column = divmod(place, columns)
        x = margin + column * (wide + _SPARE[0]) + 0.6
        y = height - _TITLE - (row + 1) * (high + _SPARE[1]) + 0.52
        axes = figure.add_axes((x / width, y / height, wide / width, high / height))
        _rule(axes, frame, floor_title(building, floor), column == 0)
        panels.append(axes)
    return figure, panels


def _rule(axes: Axes, frame: Frame, title: str, first: bool) -> None:
    """Title and ticks of a panel; the first of a row says what goes up."""
    axes.set(xlim=(frame.left, frame.right), ylim=(frame.bottom, frame.top))
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(MultipleLocator(frame.step))
    axes.tick_params(labelsize=8, color=FAINT, labelcolor=FAINT, length=3)
    axes.spines[:].set_visible(False)
    size = text_size(title, axes.get_window_extent().width / axes.figure.dpi, 11)
    axes.set_title(
        title, fontsize=size, color=TEXT, loc="left", pad=5, parse_math=False
    )
    axes.set_xlabel("x, metres east", fontsize=8, color=FAINT, labelpad=2)
    if first:
        axes.set_ylabel("y, metres north", fontsize=8, color=FAINT, labelpad=0)


def floor_title(building: Building, floor: int) -> str:
    """ "Floor 2: offices", or "Floor 2" where the drawing gives no name."""
    name = building.plan.storeys[floor].name
    return f"Floor {floor + 1}: {name}" if name else f"Floor {floor + 1}"


def text_size(words: str, width: float, largest: float) -> float:
    """Points at which the words fit into so many inches, if not the largest."""
    return min(largest, 72 * width / (0.62 * len(words)))


def chosen_floors(building: Building, floor: int | None) -> tuple[int, ...]:
    """All floors, or the one asked for; ValueError where the building has no such."""
    if floor is None:
        return tuple(range(building.floors))
    if not 0 <= floor < building.floors:
        raise ValueError(
            f"there is no floor {floor + 1} in {building.title}. "
            f"Choose one from 1 to {building.floors}."
        )
    return (floor,)


def heading(figure: Figure, title: str) -> None:
    """The one clear title of a page."""
    width, height = figure.get_size_inches()
    figure.text(
        0.5,
        1 - 0.18 / height,
        title,
        ha="center",
        va="top",
        fontsize=text_size(title, width - 0.4, 15),
        color=TEXT,
        parse_math=False,
    )


def foot(figure: Figure, handles: Sequence[Artist], columns: int = 7) -> None:
    """The legend along the bottom edge of a page."""
    figure.legend(
        handles=handles,
        loc="lower center",
        ncols=min(columns, len(handles)),
        fontsize=9,
        frameon=False,
        labelcolor=TEXT,
        handlelength=1.4,
        handleheight=1.1,
        columnspacing=1.6,
        bbox_to_anchor=(0.5, 0.005),
    )


def swatches(kinds: Iterable[Kind] = MEANINGS) -> list[Artist]:
    """Legend entries of what a cell can be."""
    return [
        Patch(facecolor=COLOURS[k], edgecolor=FAINT, linewidth=0.5, label=MEANINGS[k])
        for k in kinds
    ]


def paint(kind: np.ndarray, fade: float = 0.0) -> np.ndarray:
    """(rows, cols) kinds -> (rows, cols, 3) colours 0 to 1, faded towards white."""
    ink = np.array([to_rgb(COLOURS[k]) for k in Kind])
    return (ink * (1 - fade) + fade)[kind]
