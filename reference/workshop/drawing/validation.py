"""Chart of one standard case: the fundamental diagram, beside real people's.

Clauses: A7.
"""

import numpy as np
from matplotlib.figure import Figure

from reference.workshop.drawing.page import FAINT, TEXT, Style, sheet
from reference.workshop.validation import cases

OURS: Style = {"color": "#0072b2", "marker": "o", "lw": 1.9}
THEIRS: Style = {"color": "#d55e00", "ls": (0, (5, 1.5)), "lw": 1.9}
REAL: Style = {"color": TEXT, "ls": "", "marker": "s", "ms": 7, "mfc": "white"}


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
    real = {"one way": (cases.ONE_WAY, "s"), "counterflow in 4 m": (cases.OPPOSED, "^")}
    for name, (speeds, marker) in real.items():
        look = REAL | {"marker": marker, "label": f"real people, {name}"}
        axes.plot([*speeds], [*speeds.values()], **look)
    axes.set(xlim=(0, curve[-1]), xlabel="people per square metre")
    axes.set(ylim=(0, 2), ylabel="m/s")
    axes.grid()
    axes.legend(title=f"Real people: {cases.MEASURED}", title_fontsize=8)
    return page
