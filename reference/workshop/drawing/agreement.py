"""Two candidates for the difficulty of a fire, one dot a fire: do they agree?

Clauses: F11.  To the right what the fire did to the ways out, upwards what it cost
people without robots; colour and shape say how many sources of which kind it had.
"""

from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import BoundaryNorm
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from reference.evaluation.difficulty import HARDEST
from reference.workshop.drawing.page import FAINT, TEXT, blank, foot, heading
from reference.workshop.evaluation.agreement import Agreement

SHAPES = "osD^vP"
"""A marker for each kind of fire, in the order in which they appear."""

INK = colormaps["viridis_r"]
_NOTE: dict[str, Any] = {"color": FAINT, "fontsize": 9, "ha": "right", "va": "top"}
_SMALLEST = 8  # sources that the colours reach to, at least


def figure(agreement: Agreement) -> Figure:
    """The fires in the plane of both candidates, and how well the two agree."""
    page = blank(9.2, 6.6)
    heading(page, f"How hard were {len(agreement.fires)} fires, by two candidates?")
    axes = page.add_axes((0.105, 0.17, 0.755, 0.70))
    axes.set_title(_coefficients(agreement), loc="left", fontsize=10, color=TEXT)
    _dots(page, axes, agreement)
    axes.axhline(0, color=FAINT, lw=1, ls=":", zorder=1)
    lower_right = axes.get_yaxis_transform()
    axes.text(1, -60, "below: the fire helped", transform=lower_right, **_NOTE)
    axes.set(xlim=(-0.02 * HARDEST, 1.02 * HARDEST))
    axes.set_xlabel(f"difficulty h: ways out lost, 0 to {HARDEST:.0f}")
    axes.set_ylabel("reward that unguided people lose, health points")
    axes.spines[["top", "right"]].set_visible(False)
    return page


def _coefficients(agreement: Agreement) -> str:
    """Both of all fires, and how much of the order is owed to the number of sources."""
    return (
        f"Spearman {agreement.spearman:.2f}, Pearson {agreement.pearson:.2f}; "
        f"among fires of equally many sources: Spearman {agreement.within:.2f}"
    )


def _dots(page: Figure, axes: Axes, agreement: Agreement) -> None:
    fires = agreement.fires
    most = max(_SMALLEST, *(fire.sources for fire in fires))
    colours = ScalarMappable(BoundaryNorm(np.arange(most + 2) - 0.5, INK.N), INK)
    kinds = dict(zip(dict.fromkeys(f.fire for f in fires), SHAPES, strict=False))
    for kind, shape in kinds.items():
        h, loss, sources = np.transpose(
            [(f.difficulty, f.loss, f.sources) for f in fires if f.fire == kind]
        )
        ink = colours.to_rgba(sources)
        axes.scatter(
            h, loss, s=42, c=ink, marker=shape, edgecolors=TEXT, lw=0.5, zorder=3
        )
    foot(page, [_sample(kind, shape) for kind, shape in kinds.items()])
    bar = page.colorbar(colours, cax=page.add_axes((0.89, 0.17, 0.022, 0.70)))
    bar.set_ticks(range(most + 1))
    bar.ax.tick_params(which="both", length=0)
    bar.set_label("sources")


def _sample(kind: str, shape: str) -> Line2D:
    return Line2D(
        [],
        [],
        ls="",
        marker=shape,
        color="white",
        markeredgecolor=TEXT,
        label=f"{kind} fire",
    )
