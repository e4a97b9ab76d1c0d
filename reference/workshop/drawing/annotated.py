"""Pictures of the annotated paper: formulas, and where Eq. 2 puts a coordinate.

X   what the fire decides, metres;  X′  where its source appears
"""

from base64 import b64encode
from io import BytesIO

import numpy as np
from matplotlib import rc_context
from matplotlib.figure import Figure
from matplotlib.path import Path
from matplotlib.textpath import TextPath
from matplotlib.transforms import Affine2D
from PIL import Image

from reference.fire import snapped
from reference.workshop.drawing import page

_PEN = {
    Path.MOVETO: "M",
    Path.LINETO: "L",
    Path.CURVE3: "Q",
    Path.CURVE4: "C",
    Path.CLOSEPOLY: "Z",
}
"""Commands of an SVG path for matplotlib's."""


def formula(tex: str) -> str:
    """Typeset a formula of matplotlib's mathtext: SVG, in the colour of the text.

    Raises ValueError for what mathtext does not know.
    """
    with rc_context({"text.parse_math": True, "mathtext.fontset": "stix"}):
        text = TextPath((0, 0), f"${tex}$", size=16.0)
    path = text.transformed(Affine2D().scale(1, -1))  # SVG counts downwards
    drawn = []
    for points, code in path.iter_segments():
        drawn.append(_PEN[code])
        if code != Path.CLOSEPOLY:  # matplotlib gives it a point, SVG none
            drawn.append(" ".join(f"{v:.1f}" for v in points))
    left, top, wide, tall = path.get_extents().padded(1).bounds
    return (
        f'<svg viewBox="{left:.1f} {top:.1f} {wide:.1f} {tall:.1f}" '
        f'width="{wide:.0f}" height="{tall:.0f}"><path d="{"".join(drawn)}"/></svg>'
    )


def data_uri(figure: Figure) -> str:
    """Write a figure into a data URI: a PNG of 64 colours, enough for flat areas."""
    drawn = BytesIO()
    small = BytesIO()
    figure.savefig(drawn, format="png", dpi=110)
    picture = Image.open(drawn).convert("RGB")
    palette = page.palette_of(picture, 64)
    few = picture.quantize(palette=palette, dither=Image.Dither.NONE)
    few.save(small, "png", optimize=True)
    return f"data:image/png;base64,{b64encode(small.getvalue()).decode()}"


TILES = {"#": "wall", "E": "exit", ",": "ash", ":": "hole"}
TILES |= dict.fromkeys("ABCD", "stairs")
DISCS = {"R": "robot", "!": "goal", "?": "goal"}
DISCS |= dict.fromkeys("pqrstuvwxyz", "person")


def board(rows: list[str]) -> str:
    """Draw a board of a test as shapes of SVG, a unit a cell; page.css colours them."""
    tiles = dict.fromkeys(["floor", *TILES.values()], "")  # the lower first
    flames = ""
    signs = ""
    for y, row in enumerate(rows):
        for x, sign in enumerate(row):
            if sign != " ":
                kind = _door_at(rows, x, y) if sign == "+" else TILES.get(sign, "floor")
                tiles[kind] = tiles.get(kind, "") + f"M{x} {y}h1v1h-1z"
            if sign in DISCS:
                disc = f'class="b-{DISCS[sign]}" cx="{x}.5" cy="{y}.5" r=".46"'
                signs += f"<circle {disc}/>"
            if sign in DISCS or sign.isdigit() or sign == "_":
                of = DISCS.get(sign, "note")
                signs += f'<text class="b-{of}" x="{x}.5" y="{y}.8">{sign}</text>'
            if sign == "*":
                flames += f"M{x}.1 {y}.9l.4-.8.4.8z"
    shapes = tiles | {"flame": flames}
    paths = [f'<path class="b-{kind}" d="{d}"/>' for kind, d in shapes.items() if d]
    return "".join(paths) + signs


def _door_at(rows: list[str], x: int, y: int) -> str:
    """Tell an entrance, which a stairwell's letter touches, from a door."""
    around = rows[max(y - 1, 0) : y + 2]
    near = "".join(line[max(x - 1, 0) : x + 2] for line in around)
    return "entrance" if set("ABCD") & set(near) else "door"


def snapping() -> Figure:
    """Draw X′ over X: each coordinate becomes the middle of its cell [D3, Eq. 2]."""
    figure = page.sheet("The middle of the nearest cell", 4.6, 4.6)
    axes = figure.subplots()
    X = np.linspace(-2, 3, 500, endpoint=False)
    axes.plot(X, [snapped(x) for x in X], ".", ms=3, color=page.BLUE, label="X′")
    axes.plot(X, X, ":", lw=1, color=page.FAINT, label="X")
    axes.set(xlabel="X, metres: what the fire decides", ylabel="X′, metres")
    axes.set(aspect="equal")
    axes.grid()
    axes.legend(loc="upper left")
    return figure
