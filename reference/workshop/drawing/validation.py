"""Charts of two standard cases: the fundamental diagram, and a door's flow.

Clause: A7.
"""

import numpy as np
from matplotlib.figure import Figure

from reference.workshop.drawing.page import FAINT, TEXT, Style, foot, sheet
from reference.workshop.validation import cases

OURS: Style = {"color": "#0072b2", "marker": "o", "lw": 1.9}
THEIRS: Style = {"color": "#d55e00", "ls": (0, (5, 1.5)), "lw": 1.9}
WINDOW = 5  # seconds over which a flow is taken


def diagram(seed: int) -> Figure:
    """Draw speed by density, beside Weidmann's curve."""
    page = sheet("The fundamental diagram: walking in a crowd", 9.2, 4.6)
    axes = page.subplots()
    curve = np.linspace(0.1, cases.DENSITIES[-1] + 0.5, 200)
    ours = [cases.speed_in_ring(d, seed) for d in cases.DENSITIES]
    theirs = np.array([cases.weidmann(d) for d in curve])
    low, high = np.maximum(theirs - cases.BESIDE, 0), theirs + cases.BESIDE
    band = f"within {cases.BESIDE} m/s of it"
    axes.fill_between(curve, low, high, color=FAINT, alpha=0.18, lw=0, label=band)
    axes.plot(curve, theirs, **THEIRS, label="Weidmann (1993)")
    axes.plot(cases.DENSITIES, ours, **OURS, label="measured, in a ring of 20 m × 4 m")
    axes.set(xlim=(0, curve[-1]), xlabel="people per square metre", ylabel="m/s")
    axes.set_ylim(bottom=0)
    axes.grid()
    foot(page)
    return page


def door(seed: int) -> Figure:
    """Draw how many pass an inner door of one metre, over time."""
    when = cases.passages("+", 1, seed)
    mean, when = cases.flow(when), when[np.isfinite(when)]
    page = sheet(f"An inner door of 1 m: {len(when)} of 100 people pass", 9.2, 4.2)
    axes = page.subplots()
    edges = np.arange(0, when.max() + 2 * WINDOW, WINDOW)
    passed = np.histogram(when, edges)[0] / WINDOW
    name = f"people per second, over {WINDOW} s"
    axes.stairs(passed, edges, color=OURS["color"], lw=1.9, label=name)
    axes.axhline(cases.MOST_FLOW, **THEIRS, label="the most that IMO 4 allows")
    name = f"from first to last: {mean:.2f}"
    axes.axhline(mean, color=TEXT, lw=1, ls=":", label=name)
    axes.set(xlim=(0, edges[-1]), xlabel="seconds", ylabel="people per second")
    axes.set_ylim(bottom=0)
    axes.grid(axis="y")
    foot(page)
    return page
