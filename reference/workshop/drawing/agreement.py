"""Chart of two measures of a fire's difficulty, one dot per fire: do they agree?

Clauses: F11.  The x axis is what the fire did to the ways out, the y axis what it cost
people without robots; colour is its number of sources, shape its kind.
"""

import numpy as np
from matplotlib import colormaps
from matplotlib.figure import Figure

from reference.evaluation.difficulty import HARDEST
from reference.workshop.drawing.page import (
    FAINT,
    TEXT,
    Style,
    foot,
    samples,
    sheet,
    write_numbers,
)
from reference.workshop.evaluation.agreement import Agreement

SHAPES = "osD^vP"
"""A marker for each kind of fire, in the order in which they appear."""

NAMES = {
    "random": "at a random place",
    "greedy": "where most people are about to pass",
    "doorstep": "around a way out",
}
"""What the legend calls a kind of fire; others by their own name."""

_BELOW = "where fires broke out, by shape; below the dotted line a fire helped people"
_LEAST = 8  # sources that the colour scale covers, at least


def figure(agreement: Agreement) -> Figure:
    """Draw the fires by both measures; tell in the title how well these agree."""
    fires = agreement.fires
    page = sheet(f"How hard were {len(fires)} fires, by two measures?", 9.2, 6.6)
    axes = page.subplots()
    most = max(_LEAST, *(fire.sources for fire in fires))
    shapes = dict(zip(dict.fromkeys(f.fire for f in fires), SHAPES, strict=False))
    ink: Style = {"vmin": -0.5, "vmax": most + 0.5, "ec": TEXT, "lw": 0.5}
    ink["cmap"] = colormaps["viridis_r"].resampled(most + 1)
    for kind, shape in shapes.items():
        h, loss, sources = np.transpose(
            [(f.difficulty, f.loss, f.sources) for f in fires if f.fire == kind]
        )
        dots = axes.scatter(h, loss, s=42, c=sources, marker=shape, **ink)
    axes.axhline(0, color=FAINT, lw=1, ls=":", zorder=0.5)
    axes.set_title(_coefficients(agreement))
    axes.set_xlim(-0.02 * HARDEST, 1.02 * HARDEST)
    axes.set_xlabel(f"difficulty h, at most {HARDEST:,.0f}")
    axes.set_ylabel("reward that unguided people lose, health points")
    bar = page.colorbar(dots, ticks=range(most + 1), pad=0.02)
    bar.set_label("fire sources", labelpad=6)
    bar.ax.tick_params(which="both", length=0)
    write_numbers(axes.xaxis, axes.yaxis)
    dot: Style = {"ls": "", "mfc": "white", "mec": TEXT}
    looks = {NAMES.get(k, k): {"marker": s, **dot} for k, s in shapes.items()}
    foot(page, samples(looks), caption=_BELOW)
    return page


def _coefficients(agreement: Agreement) -> str:
    """Correlations of all fires, and among those with equally many sources."""
    return (
        f"Spearman {agreement.spearman:.2f}, Pearson {agreement.pearson:.2f}; "
        f"among fires of equally many sources: Spearman {agreement.within:.2f}"
    )
