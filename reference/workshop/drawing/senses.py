"""What an agent observes: its grid, channel by channel, and what its numbers say.

The pages decode the very arrays that the networks are given; they show nothing else of
the world.

    vector  (V,) numbers of one agent
    cells   (channels, height, width), 0 or 1 [C3]
    point   x and y in metres, and the storey; below the ground: gone
"""

from collections.abc import Iterable, Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure

from reference.building import Kind
from reference.game.observations import (
    GRID_KINDS,
    Block,
    Layout,
    fire_vectors,
    grid,
    robot_vectors,
    vector_layout,
)
from reference.paper import Scenario
from reference.workshop.drawing import evacuation, page
from reference.workshop.drawing.page import COLOURS, Style
from reference.world import World

_LOOKS = evacuation.looks(5.0)
_LOOKS["human"] = _LOOKS["follower"]
_LOOKS["the observer"] = _LOOKS["robot"] | {"mfc": evacuation.INK}

_INKS = {
    "wall": COLOURS[Kind.WALL],
    "in flames": evacuation.FLAME,
    "exit, or entrance where there is none": COLOURS[Kind.EXIT],
}


# inches
_WIDE = 13.0
_AXES_WIDE = 2.5  # what numbers and names of axes take of it
_TITLE_HIGH = 0.6  # above a floor, with numbers below it
_TABLE_HIGH = 1.5


def robot_senses(world: World, scenario: Scenario, robot: int = 0) -> Figure:
    """Draw what a robot observes; scenario: the simulation's own [C1] [C3] [C4].

    Human 1 is the nearest on its own floor. Raises IndexError where there is no such
    robot.
    """
    layout = vector_layout(world.building, scenario)
    vector = robot_vectors([world], layout)[0, robot]
    return _page(f"robot_{robot}", world, layout, vector, observers=1)


def fire_senses(world: World, scenario: Scenario) -> Figure:
    """Draw what the fire agent observes; scenario: the simulation's own [D1].

    People and robots are numbered as they always are.
    """
    layout = vector_layout(world.building, scenario)
    ((vector,),) = fire_vectors([world], layout)
    return _page("fire_0", world, layout, vector, observers=0)


def _page(
    agent: str, world: World, layout: Layout, vector: np.ndarray, observers: int
) -> Figure:
    """Draw a row for each floor, points and channels; below a table and a legend.

    observers: how many of the first robots observe themselves
    """
    building = world.building
    cells = grid(world)
    robots = layout.block_of(vector, "robots")
    points = {
        "human": layout.block_of(vector, "humans"),
        "robot": robots[observers:],
        "the observer": robots[:observers],
        "fire source": layout.block_of(vector, "fires"),
    }
    points = {name: spots for name, spots in points.items() if len(spots)}

    floors = building.floors
    columns = 1 + len(GRID_KINDS)
    widths, high = _plan_and_grids(building.kind.shape[1:], cells.shape[1:])
    height = (high + _TITLE_HIGH) * floors + _TABLE_HIGH
    about = f": what {agent} sees"
    figure = page.sheet(building.title, _WIDE, height + 0.6, about)
    look: Style = {"height_ratios": [high + _TITLE_HIGH] * floors + [_TABLE_HIGH]}
    look |= {"width_ratios": widths}
    spec = figure.add_gridspec(floors + 1, columns, **look)
    for floor in range(floors):
        first, *others = (figure.add_subplot(spec[floor, k]) for k in range(columns))
        page.paint_floor(first, building, floor, alpha=0.25)
        _plot_points(first, floor, points)
        _paint_channels(others, floor, cells)

    below = figure.add_subplot(spec[-1, :])
    _write_table(below, number_table(vector, layout.blocks.values()))
    marks = page.samples({name: _LOOKS[name] for name in points})
    handles = [*marks, *page.patches(_INKS)]
    below.legend(handles=handles, loc="upper right", ncols=2)
    return figure


def _plot_points(axes: Axes, floor: int, points: Mapping[str, np.ndarray]) -> None:
    """Plot the points on a floor, (k, 3) of each name."""
    for name, spots in points.items():
        here = spots[spots[:, 2] == floor, :2]
        if len(here):  # the layout makes room for no points, unless clipped
            axes.plot(*here.T, **_LOOKS[name], clip_on=False, label=name)


def _paint_channels(panels: Sequence[Axes], floor: int, cells: np.ndarray) -> None:
    """Paint a floor's channels of the grid, one a panel."""
    floors = len(cells) // len(GRID_KINDS)
    for kind, (axes, ink) in enumerate(zip(panels, _INKS.values(), strict=True)):
        channel = kind * floors + floor
        axes.imshow(cells[channel], ListedColormap(["white", ink]), vmax=1)
        axes.set_title(f"{channel}: {GRID_KINDS[kind]}, floor {floor + 1}")
        axes.spines[:].set_visible(True)
        axes.set(xlabel="column", ylabel="row")


def _write_table(axes: Axes, rows: Sequence[Sequence[str]]) -> None:
    """Write a table without lines where nothing else is drawn."""
    axes.set_axis_off()
    look: Style = {"edges": "open", "cellLoc": "left", "loc": "upper left"}
    words = axes.table(rows, **look)
    words.auto_set_font_size(False)
    words.set_fontsize(8)
    words.auto_set_column_width(range(3))


def _plan_and_grids(
    plan: tuple[int, ...], grid: tuple[int, ...]
) -> tuple[list[float], float]:
    """Choose widths of a plan and its grids, and the height of all, inches.

    plan, grid: how many cells down and across
    """
    plan_slope, grid_slope = (down / across for down, across in (plan, grid))
    shares = [float(np.clip(grid_slope / plan_slope, 1, 2)), *[1.0] * len(GRID_KINDS)]
    share = (_WIDE - _AXES_WIDE) / sum(shares)
    widths = [share * each for each in shares]
    return widths, max(widths[0] * plan_slope, share * grid_slope)


def number_table(
    vector: np.ndarray, blocks: Iterable[Block]
) -> list[tuple[str, str, str]]:
    """Explain all numbers of a vector: which, what, and the first values of a kind."""
    rows = []
    for block in blocks:
        numbers = vector[block.start : block.stop]
        last = block.stop - 1
        which = f"{block.start} to {last}" if last > block.start else f"{last}"
        words = f"{block.rows} × {block.what} ({block.unit})"
        values = ", ".join(f"{v:.3g}" for v in numbers[:6])
        more = ", …" if len(numbers) > 6 else ""
        rows.append((which, words, values + more))
    return rows
