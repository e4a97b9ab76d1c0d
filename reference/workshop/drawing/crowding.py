"""Where people were dense and where they died, on the floors of `plans` [A8] [B7]."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure

from reference.building import Building, Kind
from reference.workshop.drawing import page, plans
from reference.workshop.drawing.evacuation import INK
from reference.workshop.drawing.page import COLOURS, Style
from reference.workshop.measuring.crowding import SQUARE, Crowding

_INKS = COLOURS[Kind.FLOOR], "#e5a9c6", "#b3437f", "#5e1150"
CROSS: dict[str, Style] = {
    "died here (larger: more people)": {"ls": "", "marker": "x", "color": INK}
}
LEAST_CROSS = 10  # square points: one death in many evacuations is seen, too
DENSITY_COLOURS = LinearSegmentedColormap.from_list("density", _INKS)


def crowding_map(crowding: Crowding, heading: str = "") -> Figure:
    """Colour floors by how dense people were; a cross, the larger the more died there.

    heading: who played, after the building's title
    """
    building = crowding.building
    runs = crowding.runs
    density = crowding.density
    deaths = crowding.deaths

    over = f"{runs} evacuations" if runs > 1 else "one evacuation"
    counts = f": {over}, {deaths.sum():.0f} died"
    name = page.shortened(building.title, 36)
    named = f"{name}, {heading}" if heading else name
    figure, panels = page.floor_page(building, named, range(building.floors), counts)

    look: Style = {"vmin": 0, "vmax": max(1.0, density.max())}
    look |= {"cmap": DENSITY_COLOURS, "extent": page.extent_of(building)}
    for floor, axes in panels.items():
        apart = building.kind[floor] != Kind.FLOOR  # doors keep their colours
        seen = np.ma.masked_where(apart, density[floor])
        image = axes.imshow(seen, **look)
        mark_deaths(axes, building, deaths[floor], runs)

    label = f"highest people per m², in {SQUARE} m x {SQUARE} m"
    if runs > 1:
        label = f"{label},\nmean of {over}"
    figure.colorbar(image, ax=[*panels.values()], shrink=0.7, aspect=40, label=label)
    died = page.samples(CROSS if deaths.any() else {})
    note = "density: people on stairs are not counted" if building.stairwells else ""
    handles = [*page.swatches(building.kind), *died]
    page.legend(figure, handles, title=note, title_fontsize=8)
    page.lay_out(figure, building, panels)
    for area in building.areas:
        plans.write_in_corner(panels[area.floor], building, area)
    return figure


def mark_deaths(
    axes: Axes,
    building: Building,
    deaths: np.ndarray,
    runs: int,
    move: tuple[float, float] = (0.0, 0.0),
) -> None:
    """Put a cross on each cell of a floor, the larger the more died there in all runs.

    deaths: (rows, cols) how many;  move: of the floor on the axes, metres
    """
    cells = np.argwhere(deaths)
    x, y = building.metres(*cells.T)
    sizes = LEAST_CROSS + 22 * deaths[tuple(cells.T)] / runs**0.5
    look: Style = {"color": INK, "marker": "x", "zorder": 3}
    axes.scatter(x + move[0], y + move[1], sizes, **look)
