"""Pictures of the annotated paper: formulas, and where Eq. 2 puts a coordinate.

Clauses: D3.

    X   what the fire decides, metres;  X′  where its source appears
"""

from base64 import b64encode
from io import BytesIO

import numpy as np
from matplotlib import rc_context
from matplotlib.figure import Figure
from matplotlib.path import Path
from matplotlib.textpath import TextPath
from PIL import Image

from reference.fire import snapped
from reference.workshop.drawing import page

INKS = 64  # colours of an inline picture: flat areas need no more
DOTS = 110  # of it, per inch
_PEN = {Path.MOVETO: "M", Path.LINETO: "L", Path.CURVE3: "Q", Path.CURVE4: "C"}


def formula(tex: str, size: float = 16.0) -> str:
    """Typeset a formula of matplotlib's mathtext: SVG, in the colour of the text.

    Raises ValueError for what mathtext does not know.
    """
    with rc_context({"text.parse_math": True, "mathtext.fontset": "stix"}):
        path = TextPath((0, 0), f"${tex}$", size=size)
    drawn = []
    for points, code in path.iter_segments():
        numbers = (points.reshape(-1, 2) * (1, -1)).ravel().tolist()
        ends = code == Path.CLOSEPOLY
        drawn.append(
            "Z" if ends else _PEN[code] + " ".join(f"{v:.1f}" for v in numbers)
        )
    (left, low), (right, high) = path.vertices.min(axis=0), path.vertices.max(axis=0)
    wide, tall = right - left + 2, high - low + 2
    return (
        f'<svg viewBox="{left - 1:.1f} {-high - 1:.1f} {wide:.1f} {tall:.1f}" '
        f'width="{wide:.0f}" height="{tall:.0f}"><path d="{"".join(drawn)}"/></svg>'
    )


def inline(figure: Figure) -> str:
    """Write a figure into a data URI: a PNG of few colours."""
    drawn, small = BytesIO(), BytesIO()
    figure.savefig(drawn, format="png", dpi=DOTS)
    picture = Image.open(drawn).convert("RGB").quantize(INKS, Image.Quantize.FASTOCTREE)
    picture.save(small, "png", optimize=True)
    return f"data:image/png;base64,{b64encode(small.getvalue()).decode()}"


def snapping() -> Figure:
    """Draw X′ over X: each coordinate becomes the middle of its cell [D3, Eq. 2]."""
    figure = page.sheet("The middle of the nearest cell", 4.6, 4.6)
    axes, X = figure.subplots(), np.linspace(-2, 3, 500, endpoint=False)
    axes.plot(X, [snapped(x) for x in X], ".", ms=3, color=page.BLUE, label="X′")
    axes.plot(X, X, ":", lw=1, color=page.FAINT, label="X")
    axes.set(xlabel="X, metres: what the fire decides", ylabel="X′, metres")
    axes.set(aspect="equal")
    axes.grid()
    axes.legend(loc="upper left")
    return figure
