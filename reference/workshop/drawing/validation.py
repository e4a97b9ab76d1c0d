"""Charts of two standard cases: the fundamental diagram, and how many pass a door.

Clauses: A5, A7.  Beside the model stand measurements of real people.
"""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from reference.workshop.drawing.page import FAINT, TEXT, Style, foot, sheet
from reference.workshop.validation import cases

OURS: Style = {"color": "#0072b2", "marker": "o", "lw": 1.9}
THEIRS: Style = {"color": "#d55e00", "ls": (0, (5, 1.5)), "lw": 1.9}
REAL: Style = {"color": TEXT, "ls": "", "marker": "s", "ms": 7, "mfc": "white"}
OPPOSED: Style = REAL | {"marker": "^", "ms": 8}
SOURCE = f"Real people: {cases.MEASURED}"
LIMIT = "the most that IMO 4 allows"
WINDOW = 5  # seconds over which a flow is taken


def diagram(seed: int) -> Figure:
    """Draw speed by density, beside Weidmann's curve and measurements."""
    page = sheet("The fundamental diagram: walking in a crowd", 9.2, 5.2)
    axes = page.subplots()
    curve = np.linspace(0.1, cases.DENSITIES[-1] + 0.5, 200)
    ours = [cases.speed_in_ring(d, seed) for d in cases.DENSITIES]
    theirs = np.array([cases.weidmann(d) for d in curve])
    low, high = np.maximum(theirs - cases.BESIDE, 0), theirs + cases.BESIDE
    band = f"within {cases.BESIDE} m/s of Weidmann"
    axes.fill_between(curve, low, high, color=FAINT, alpha=0.18, lw=0, label=band)
    axes.plot(curve, theirs, **THEIRS, label="Weidmann (1993)")
    axes.plot(cases.DENSITIES, ours, **OURS, label="this model, 20 m × 4 m ring")
    axes.plot(*_points(cases.ONE_WAY), **REAL, label="real people, one way")
    name = "real people, counterflow in 4 m"
    axes.plot(*_points(cases.OPPOSED), **OPPOSED, label=name)
    axes.set(xlim=(0, curve[-1]), xlabel="people per square metre", ylabel="m/s")
    axes.set_ylim(bottom=0)
    axes.grid()
    foot(page, caption=SOURCE, columns=3)
    return page


def _points(facts: dict[float, float]) -> tuple[list[float], list[float]]:
    """Places and values, to plot."""
    return [*facts], [*facts.values()]


def door(seed: int) -> Figure:
    """Draw how many pass an inner door of one metre, and exits, by their width."""
    page = sheet("Doors and exits let a limited flow through", 11, 4.6)
    over_time, by_width = page.subplots(1, 2, width_ratios=(1.4, 1))
    _over_time(over_time, seed)
    _by_width(by_width, seed)
    foot(page, caption=SOURCE, columns=3)
    return page


def _over_time(axes: Axes, seed: int) -> None:
    when = cases.passages("+", 1, seed)
    mean, when = cases.flow(when), when[np.isfinite(when)]
    axes.set_title(f"An inner door of 1 m: {len(when)} of 100 people pass")
    edges = np.arange(0, when.max() + 2 * WINDOW, WINDOW)
    passed = np.histogram(when, edges)[0] / WINDOW
    name = f"people per second, over {WINDOW} s"
    axes.stairs(passed, edges, color=OURS["color"], lw=1.9, label=name)
    axes.axhline(cases.MOST_FLOW, **THEIRS, label=LIMIT)
    name = f"from first to last: {mean:.2f}"
    axes.axhline(mean, color=TEXT, lw=1, ls=":", label=name)
    axes.set(xlim=(0, edges[-1]), xlabel="seconds", ylabel="people per second")
    axes.set_ylim(bottom=0)
    axes.grid(axis="y")


def _by_width(axes: Axes, seed: int) -> None:
    axes.set_title("Exits by width")
    ours = [cases.flow(cases.passages("E", w, seed)) / w for w in cases.WIDTHS]
    axes.axhline(cases.MOST_FLOW, **THEIRS, label=LIMIT)
    axes.plot(cases.WIDTHS, ours, **OURS, label="this model: its limit is a parameter")
    axes.plot(*_points(cases.EXITS_OF), **REAL, label="real exits")
    most = max(cases.EXITS_OF.values())
    axes.set(xlim=(0, cases.WIDTHS[-1] + 0.3), ylim=(0, 1.1 * most))
    axes.set(xlabel="metres wide", ylabel="people per second and metre")
    axes.grid(axis="y")
