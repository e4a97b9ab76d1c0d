"""Chart of one standard case: the fundamental diagram, beside real people's.

Clause: A9.
"""

import numpy as np
from matplotlib.figure import Figure

from reference.workshop.drawing.evacuation import EMBER
from reference.workshop.drawing.page import BLUE, FAINT, TEXT, sheet
from reference.workshop.measuring import validation


def diagram(seed: int) -> Figure:
    """Draw speed by density, beside Weidmann's curve and measurements."""
    page = sheet("The fundamental diagram: walking in a crowd", 9.2, 5.2)
    axes = page.subplots()
    curve = np.linspace(0.1, validation.DENSITIES[-1] + 0.5, 200)
    ours = [validation.speed_in_ring(d, seed) for d in validation.DENSITIES]
    theirs = np.array([validation.weidmann(d) for d in curve])
    low, high = np.maximum(theirs - validation.BESIDE, 0), theirs + validation.BESIDE
    band = f"within {validation.BESIDE} m/s of Weidmann"
    axes.fill_between(curve, low, high, color=FAINT, alpha=0.18, lw=0, label=band)
    axes.plot(curve, theirs, "--", color=EMBER, label="Weidmann (1993)")
    words = "this model, 20 m × 4 m ring"
    axes.plot(validation.DENSITIES, ours, "o-", color=BLUE, label=words)
    real = {
        "one way": (validation.ONE_WAY, "s"),
        "counterflow in 4 m": (validation.OPPOSED, "^"),
    }
    for name, (speeds, marker) in real.items():
        xy, words = ([*speeds], [*speeds.values()]), f"real people, {name}"
        axes.plot(*xy, marker, color=TEXT, mfc="white", label=words)
    axes.set(xlim=(0, curve[-1]), xlabel="people per square metre")
    axes.set(ylim=(0, 2), ylabel="m/s")
    axes.grid()
    axes.legend(title=f"Real people: {validation.MEASURED}", title_fontsize=8)
    return page
