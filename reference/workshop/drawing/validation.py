"""Chart of one standard case: the fundamental diagram, beside real people's [A9]."""

import numpy as np
from matplotlib.figure import Figure

from reference.workshop.drawing.evacuation import EMBER
from reference.workshop.drawing.page import BLUE, FAINT, TEXT, Style, sheet
from reference.workshop.measuring import validation


def diagram(seed: int) -> Figure:
    """Draw speed by density, from a seed on, beside Weidmann's and real people's."""
    page = sheet("The fundamental diagram: walking in a crowd", 9.2, 5.2)
    axes = page.subplots()
    densities = validation.DENSITIES
    case = validation.CASES["fundamental-diagram"]
    seeds = range(seed, seed + case["runs"])
    ours = [[validation.speed_in_ring(d, k) for d in densities] for k in seeds]

    curve = np.linspace(0.1, densities[-1] + 0.5, 200)
    theirs = np.array([validation.weidmann(d) for d in curve])
    low = np.maximum(theirs - validation.BAND, 0)
    high = theirs + validation.BAND
    band = f"within {validation.BAND} m/s of Weidmann"
    axes.fill_between(curve, low, high, color=FAINT, alpha=0.18, lw=0, label=band)
    axes.plot(curve, theirs, "--", color=EMBER, label="Weidmann (1993)")

    words = "this model, 20 m × 4 m ring"
    axes.plot(densities, np.mean(ours, axis=0), color=BLUE, label=words)
    words = f"its {len(ours)} seeds, of which the line is the mean"
    x = len(ours) * densities  # once more for each seed
    axes.plot(x, np.ravel(ours), "o", color=BLUE, ms=4, label=words)

    for words, real, marker in (
        ("one way", validation.ONE_WAY, "s"),
        ("counterflow in 4 m", validation.OPPOSED, "^"),
    ):
        look: Style = {"color": TEXT, "mfc": "white", "label": f"real people, {words}"}
        x, y = np.transpose([*real.items()])
        axes.plot(x, y, marker, **look)

    axes.set(xlim=(0, curve[-1]), xlabel="people per square metre")
    axes.set(ylim=(0, 2), ylabel="speed, m/s")
    axes.grid()
    title = f"Real people: {validation.REAL_PEOPLE_SOURCE}"
    axes.legend(title=title, title_fontsize=8, frameon=True, edgecolor="none")
    return page
