"""Style sheet, pages, legends, labels and numbers of all pictures; and saving them.

Clauses: A2, A3 and A4 for the colours of doors, entrances and exits.  All sizes of a
page are inches, all places in a building metres, as in `building`.  Importing this
module sets matplotlib's style.
"""

from collections.abc import Iterable, Mapping, Sequence
from io import BytesIO
from math import ceil, log10
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import style
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MultipleLocator
from matplotlib.transforms import Bbox

from reference.building import Building, Kind
from reference.paper import InputError
from reference.workshop.files import write_whole

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

Style = dict[str, Any]
"""Settings of matplotlib, or how one of its artists looks."""

style.use(Path(__file__).with_name("pictures.mplstyle"))

_ROOM = (12.0, 6.2)  # inches for all panels of a page together
_SPARE = (0.75, 0.9)  # inches around a panel: ticks, its title
_TITLE, _FOOT, _NARROWEST = 0.55, 0.45, 9.2
_LARGEST = 0.3  # inches a metre may take


def show(path: Path) -> None:
    """Show a PNG file in a window, always the same; without a display do nothing."""
    from matplotlib import pyplot

    window = pyplot.figure("floor map", figsize=(11, 7))
    if window.canvas.required_interactive_framework and path.suffix == ".png":
        window.clear()
        axes = window.add_axes((0, 0, 1, 1))
        axes.imshow(pyplot.imread(path))
        axes.set_axis_off()
        window.canvas.draw_idle()
    else:
        pyplot.close(window)


def pause(seconds: float) -> None:
    """Wait, while the window, if there is one, answers the mouse."""
    from matplotlib import pyplot

    pyplot.pause(seconds)


def save(figure: Figure, path: str | Path) -> Path:
    """Write a figure as .png, .svg or .pdf; all of it, or nothing.

    Raises ValueError for another suffix, OSError where the path cannot be written.
    """
    target = with_suffix(path, PICTURES, "a picture")
    content = BytesIO()
    figure.savefig(content, format=target.suffix[1:].lower())
    write_whole(target, content.getbuffer())
    return target


def with_suffix(path: str | Path, known: Iterable[str], what: str) -> Path:
    """Check how a path ends; ValueError names the known formats."""
    path = Path(path)
    if path.suffix.lower() not in known:
        *most, last = known
        ends = f"{', '.join(most)} or {last}" if most else last
        raise InputError(
            f"{path}: {what} cannot be written as '{path.suffix or path.name}'. "
            f"End the name in {ends}."
        )
    return path


def frame_of(building: Building) -> Bbox:
    """Box around all cells of a building's floors, metres."""
    rows, cols = building.kind.shape[1:]
    left, top = building.metres(-0.5, -0.5)
    right, bottom = building.metres(rows - 0.5, cols - 0.5)
    return Bbox.from_extents(left, bottom, right, top)


def step_of(frame: Bbox) -> int:
    """Metres between two ticks, or of a scale bar."""
    longest = max(frame.size)
    return 10 if longest > 35 else 5 if longest > 12 else 1


def sheet(title: str, width: float, height: float) -> Figure:
    """Make a titled figure, in inches, with constrained layout."""
    figure = blank(width, height)
    figure.set_layout_engine("constrained")
    figure.suptitle(title, fontsize=text_size(title, width - 0.4, 15))
    return figure


def blank(width: float, height: float, dpi: int = DPI) -> Figure:
    """Make an empty figure, in inches, that needs no display."""
    figure = Figure(figsize=(width, height), dpi=dpi, facecolor="white")
    FigureCanvasAgg(figure)
    return figure


def arrange(
    count: int,
    size: Sequence[float],
    room: tuple[float, float],
    spare: tuple[float, float],
) -> tuple[int, float]:
    """Choose the columns that show panels largest, and inches per metre.

    size   of a panel, metres;  room  for all of them, spare  around each, inches
    """

    def scale(columns: int) -> float:
        across = (room[0] / columns - spare[0]) / size[0]
        down = (room[1] / ceil(count / columns) - spare[1]) / size[1]
        return min(across, down)

    columns = max(range(1, count + 1), key=scale)
    return columns, min(scale(columns), _LARGEST)


def floor_page(
    building: Building, title: str, floors: tuple[int, ...], fade: float = 0.0
) -> tuple[Figure, list[Axes]]:
    """Make a titled figure with a panel in metres for each of the floors."""
    size = frame_of(building).size
    columns, scale = arrange(len(floors), size, _ROOM, _SPARE)
    rows = ceil(len(floors) / columns)
    width = max(columns * (size[0] * scale + _SPARE[0]), _NARROWEST)
    height = rows * (size[1] * scale + _SPARE[1]) + _TITLE + _FOOT
    figure, panels = sheet(title, width, height), []
    for place, floor in enumerate(floors, 1):
        panels.append(figure.add_subplot(rows, columns, place))
        paint_floor(panels[-1], building, floor, size[0] * scale, fade)
        panels[-1].yaxis.label.set_visible(place % columns == 1 or columns == 1)
    return figure, panels


def paint_floor(
    axes: Axes, building: Building, floor: int, width: float, fade: float = 0.0
) -> None:
    """Paint a floor's cells in the colours of their kinds, and its name above.

    width: of the axes, inches;  fade: towards white
    """
    frame, name = frame_of(building), floor_title(building, floor)
    edges = (*frame.intervalx, *frame.intervaly)
    axes.imshow(paint(building.kind[floor], fade), extent=edges, zorder=0)
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(MultipleLocator(step_of(frame)))
    axes.spines[:].set_visible(False)
    axes.set_title(name, fontsize=text_size(name, width, 11))
    axes.set(xlabel="x, metres east", ylabel="y, metres north")


def floor_title(building: Building, floor: int) -> str:
    """Name a floor: "Floor 2: offices", or "Floor 2" where the plan has no name."""
    name = building.plan.storeys[floor].name
    return f"Floor {floor + 1}: {name}" if name else f"Floor {floor + 1}"


def text_size(words: str, width: float, largest: float) -> float:
    """Font size, points, at which words fit into so many inches, or the largest."""
    return min(largest, 72 * width / (0.62 * len(words)))


def chosen_floors(building: Building, floor: int | None) -> tuple[int, ...]:
    """All floors, or the one asked for; ValueError where there is no such floor."""
    if floor is None:
        return tuple(range(building.floors))
    if not 0 <= floor < building.floors:
        raise InputError(
            f"there is no floor {floor + 1} in {building.title}. "
            f"Choose one from 1 to {building.floors}."
        )
    return (floor,)


def foot(
    figure: Figure,
    handles: Sequence[Artist] | None = None,
    caption: str = "",
    columns: int | None = None,
    **look: Any,
) -> None:
    """Add a legend along the lower edge, in as few rows as fit, under its caption.

    handles: entries; else whatever has a label on the axes of the page
    columns: at most so many
    """
    if handles is None:
        found = (axes.get_legend_handles_labels() for axes in figure.axes)
        named = {h.get_label(): h for each, _ in found for h in each}
        handles = [*named.values()]
    look |= {"handles": list(handles), "title": caption or None, "handleheight": 1.1}
    for count in range(columns or max(len(handles), 1), 0, -1):
        legend = figure.legend(loc="outside lower center", ncols=count, **look)
        legend.get_title().set(fontsize=8, color=FAINT, multialignment="center")
        if legend.get_window_extent().width <= figure.bbox.width:
            break
        legend.remove()


def swatches(kinds: Iterable[Kind] = MEANINGS, **more: str) -> list[Artist]:
    """Legend entries for kinds of cells, and for more colours by name."""
    colours = {MEANINGS[kind]: COLOURS[kind] for kind in kinds} | more
    return [
        Patch(fc=ink, ec=FAINT, lw=0.5, label=name) for name, ink in colours.items()
    ]


def present(kind: np.ndarray, kinds: Iterable[Kind] = MEANINGS) -> list[Kind]:
    """Those of the kinds that occur among cells, an array of any shape."""
    found = set(np.unique(kind).tolist())
    return [each for each in kinds if each in found]


def samples(looks: Mapping[str, Style]) -> list[Artist]:
    """Legend entries for lines and markers, by name."""
    return [Line2D([], [], label=name, **look) for name, look in looks.items()]


def paint(kind: np.ndarray, fade: float = 0.0) -> np.ndarray:
    """(rows, cols) kinds -> (rows, cols, 3) colours 0 to 1, faded towards white."""
    ink = np.array([to_rgb(COLOURS[k]) for k in Kind])
    return (ink * (1 - fade) + fade)[kind]


# -- Numbers ------------------------------------------------------------------------


def number(value: float, digits: int = 10) -> str:
    """Format a number to so many digits: 1,234.5 and −2 and 0.0000354."""
    decimals = digits - 1 - int(log10(abs(value)) // 1) if value else 0
    words = f"{value:,.{max(decimals, 0)}f}"
    if "." in words:
        words = words.rstrip("0").rstrip(".")
    return words.replace("-", "−")


def shortened(words: str, longest: int) -> str:
    """Shorten words to so many letters: their beginning and end."""
    half = longest // 2
    if len(words) <= longest:
        return words
    return f"{words[: longest - half - 1]}…{words[-half:]}"


def write_numbers(*axis: Axis) -> None:
    """Label the ticks of an axis, or of several, by `number`."""
    for each in axis:
        each.set_major_formatter(lambda value, _: number(value))
