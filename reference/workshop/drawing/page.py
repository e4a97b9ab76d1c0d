"""Style sheet, pages and legends of all pictures; and saving them.

All sizes of a page are inches, all places in a building metres, as in `building`.
Importing this module sets matplotlib's style.
"""

import re
from collections.abc import Iterable, Mapping, Sequence
from io import BytesIO
from math import ceil, log
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import style
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb, to_rgba_array
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.text import Text
from numpy.typing import ArrayLike
from PIL import Image

from reference.building import Building, Kind
from reference.paper import InputError
from reference.workshop.storage.files import write_whole

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
    Kind.WALL: "wall",
    Kind.FLOOR: "floor",
    Kind.DOOR: "door",
    Kind.ENTRANCE: "stairwell entrance",
    Kind.EXIT: "exit",
    Kind.STAIRS: "stairwell",
}
TEXT = "#23272e"
FAINT = "#6b7480"
BLUE = "#1b5e9e"  # of curves
EDGE = 0.1  # inches at the edge of a page, without a title
MOST_LETTERS = 200  # of a title, which are more than fit
NEAR_AN_INK = 11  # red, green and blue of 255: Pillow may take one for the other

Style = dict[str, Any]
"""Settings of matplotlib, or how one of its artists looks."""

style.use(Path(__file__).with_name("pictures.mplstyle"))


class Picture(Figure):
    """A figure that a notebook shows, whether or not matplotlib is inline there."""

    def _repr_png_(self) -> bytes:
        content = BytesIO()
        self.savefig(content, format="png")
        return content.getvalue()


def show(path: Path) -> None:
    """Show a PNG file in a window, always the same; without a display do nothing."""
    from matplotlib import pyplot  # slow, and only for a window

    window = pyplot.figure("floor map", figsize=(11, 7), clear=True)
    if window.canvas.required_interactive_framework and path.suffix == ".png":
        window.add_axes((0, 0, 1, 1)).imshow(pyplot.imread(path))
    else:
        pyplot.close(window)


def pause(seconds: float) -> None:
    """Wait, while the window, if there is one, answers the mouse."""
    from matplotlib import pyplot

    pyplot.pause(seconds)


def save(figure: Figure, path: str | Path) -> Path:
    """Write a figure as .png, .svg or .pdf; all of it, or nothing.

    Raises InputError for another suffix, OSError where the path cannot be written.
    """
    target = Path(path)
    if target.suffix.lower() not in (".png", ".svg", ".pdf"):
        raise InputError(f"{target}: write a .png, .svg or .pdf")
    content = BytesIO()  # first of all in memory: a full disk leaves nothing half-made
    figure.savefig(content, format=target.suffix[1:].lower())
    write_whole(target, content.getbuffer())
    return target


def palette_of(
    picture: Image.Image, most: int, inks: Iterable[str] = ()
) -> Image.Image:
    """Choose colours: white, those of cells, more inks, and some of a picture.

    most: how many of all
    """
    names = ["white", *COLOURS.values(), *inks]
    own = np.unique(np.rint(255 * to_rgba_array(names)[:, :3]), axis=0)
    few = picture.quantize(most - len(own), Image.Quantize.MAXCOVERAGE)
    others = np.reshape(few.getpalette() or [], (-1, 3))
    apart = np.linalg.norm(others[:, None] - own, axis=2).min(axis=1)
    colours = np.concatenate([own, others[apart > NEAR_AN_INK]])
    palette = Image.new("P", (1, 1))
    palette.putpalette(colours.astype(int).ravel().tolist())
    return palette


def sheet(
    title: str, width: float, height: float, about: str = "", layout: Any = None
) -> Picture:
    """Make a titled figure, in inches, that needs no display.

    about: the end of the title, which stays whole however long the rest is
    """
    figure = Picture(figsize=(width, height), layout=layout or "constrained")
    wide = figure.bbox.width - 2 * EDGE * figure.dpi
    write_title(figure.suptitle(""), title, wide, about)
    return figure


def write_title(text: Text, title: str, wide: float, about: str = "") -> None:
    """Write a title, as much of it as fits in so many pixels, and all of its end."""
    longest = min(len(title), MOST_LETTERS)
    choices = [shortened(title, k) + about for k in range(longest, 0, -1)]
    write_fitting(text, choices or [about], wide)


def write_fitting(text: Text, choices: Iterable[str], wide: float) -> None:
    """Write the first of the choices that is no wider, else the last; wide: pixels."""
    for words in choices:
        text.set_text(words)
        if text.get_window_extent().width <= wide:
            break


def shortened(words: str, longest: int) -> str:
    """Cut the middle out of long words, such as paths, then the end of all off."""
    words = of_shorter_words(words, longest)
    return words if len(words) <= longest else f"{words[: longest - 1]}…"


def of_shorter_words(words: str, longest: int) -> str:
    """Cut the middle out of long words, such as paths, if all is too long."""
    for kept in range(longest // 2, longest // 4, -1):  # letters at each end of a word
        if len(words) > longest:
            end = rf"(\S{{{kept}}})"
            words = re.sub(rf"{end}\S\S+{end}", r"\1…\2", words)
    return words


def legend(figure: Figure, handles: Sequence[Artist], **look: Any) -> None:
    """Add a legend along the lower edge; for a high one the page becomes higher."""
    look = {"ncols": 8, "handleheight": 1.1} | look
    drawn = figure.legend(handles=handles, loc="outside lower center", **look)
    inches = drawn.get_window_extent().height / figure.dpi
    figure.set_figheight(figure.get_figheight() + max(0, inches - 1))


def swatches(cells: ArrayLike, inks: Mapping[Kind, str] = COLOURS) -> list[Artist]:
    """Make legend entries for kinds that occur among cells."""
    kinds = [kind for kind in MEANINGS if kind in np.asarray(cells)]
    return patches({MEANINGS[kind]: inks[kind] for kind in kinds})


def patches(inks: Mapping[str, str]) -> list[Artist]:
    """Make legend entries for colours, by name."""
    return [Patch(fc=ink, ec=FAINT, lw=0.5, label=name) for name, ink in inks.items()]


def samples(looks: Mapping[str, Style]) -> list[Artist]:
    """Make legend entries for lines and markers, by name."""
    return [Line2D([], [], label=name, **look) for name, look in looks.items()]


# -- Floors -------------------------------------------------------------------------


def floor_page(
    building: Building,
    title: str,
    floors: Sequence[int],
    about: str = "",
    alpha: float = 1.0,
) -> tuple[Picture, dict[int, Axes]]:
    """Make a titled figure with a panel in metres for each of the floors.

    about: the end of the title, see `sheet`.  Call `lay_out` once all is on the page.
    """
    rows, columns = arranged(building, len(floors))
    down, across = np.multiply((rows, columns), building.kind.shape[1:])
    width = min(12, 6 * across / down) + 0.7
    height = max(0.9, min(6, 12 * down / across)) + 1.5
    figure = sheet(title, max(width, 9), height, about, "compressed")

    panels = {}
    for place, floor in enumerate(floors, 1):
        panels[floor] = figure.add_subplot(rows, columns, place)
        paint_floor(panels[floor], building, floor, alpha)
    label_outer([*panels.values()], columns)
    return figure, panels


def label_outer(panels: Sequence[Axes], columns: int) -> None:
    """Keep labels of x where no panel is below, of y where none is to the left."""
    for place, axes in enumerate(panels):
        if place + columns < len(panels):
            axes.set_xlabel("")
            axes.tick_params(labelbottom=False)
        if place % columns:
            axes.set_ylabel("")
            axes.tick_params(labelleft=False)


def lay_out(
    figure: Figure,
    building: Building,
    panels: Mapping[int, Axes],
    about: Mapping[int, str] | None = None,
) -> None:
    """Lay out a page of floors; their titles end before the next panel.

    about: what the titles of floors say after their names
    """
    figure.draw_without_rendering()
    _, columns = arranged(building, len(panels))
    starts = [axes.get_window_extent().x0 for axes in panels.values()]
    for place, (floor, axes) in enumerate(panels.items()):
        is_last = (place + 1) % columns == 0 or place + 1 == len(panels)  # of its row
        end = figure.bbox.width if is_last else starts[place + 1]
        wide = end - starts[place] - EDGE * figure.dpi
        more = (about or {}).get(floor, "")
        number = f"Floor {floor + 1}"
        choices = (floor_title(building, floor) + more, number + more, number)
        write_fitting(axes.set_title(""), choices, wide)


def arranged(building: Building, floors: int) -> tuple[int, int]:
    """Choose rows and columns of floors for a page about twice as wide as high."""
    high, wide = building.kind.shape[1:]

    def unlike(columns: int) -> float:
        """How far a page is from twice as wide as high; half and double are alike."""
        rows = ceil(floors / columns)
        return abs(log(columns * wide / (rows * high) / 2))

    columns = min(range(1, floors + 1), key=unlike)
    return ceil(floors / columns), columns


def paint_floor(axes: Axes, building: Building, floor: int, alpha: float = 1.0) -> None:
    """Paint a floor's cells in the colours of their kinds, and its name above."""
    cells = paint(building.kind[floor])
    axes.imshow(cells, extent=extent_of(building), alpha=alpha, zorder=0)
    axes.spines[:].set_visible(False)
    axes.set_title(floor_title(building, floor))
    axes.set(xlabel="x, metres east", ylabel="y, metres north")


def floor_title(building: Building, floor: int) -> str:
    """Name a floor: "Floor 2: offices", or "Floor 2" where the drawing has no name."""
    name = building.drawing.storeys[floor].name
    title = f"Floor {floor + 1}"
    return shortened(f"{title}: {name}" if name else title, 28)


def extent_of(building: Building) -> tuple[float, float, float, float]:
    """Measure left, right, bottom and top of a building's floors, metres."""
    rows, cols = building.kind.shape[1:]
    left, top = building.metres(-0.5, -0.5)
    return left, left + cols, top - rows, top


def paint(kind: np.ndarray, inks: Mapping[Kind, str] = COLOURS) -> np.ndarray:
    """Colour cells by their kinds: (...) -> (..., 3), from 0 to 1."""
    return np.array([to_rgb(inks[k]) for k in Kind])[kind]
