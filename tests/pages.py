"""What one can read on a picture, and what lies in its way."""

from itertools import combinations

import numpy as np
from matplotlib.axis import Axis
from matplotlib.text import Text


def words(figure):
    """All texts that can be seen: no labels of ticks that are out of view."""
    hidden = set()
    for axis in figure.findobj(Axis):
        low, high = sorted(axis.get_view_interval())
        ticks = [t for t in axis.get_major_ticks() if not low <= t.get_loc() <= high]
        hidden.update(label for tick in ticks for label in (tick.label1, tick.label2))
    found = figure.findobj(lambda artist: isinstance(artist, Text))
    shown = [text for text in found if text not in hidden and text.get_visible()]
    return [text for text in shown if text.get_text().strip()]


def writing(figure):
    """What these texts say, in the order in which they are found."""
    return [text.get_text() for text in words(figure)]


def overlaps(figure):
    """Pairs of texts that lie on each other, and texts that leave the page."""
    figure.draw_without_rendering()
    boxes = [
        (t.get_text(), Text.get_window_extent(t).padded(-1)) for t in words(figure)
    ]
    wide, high = figure.bbox.size
    off = [w for w, b in boxes if b.x0 < 0 or b.y0 < 0 or b.x1 > wide or b.y1 > high]
    return off + [(v, w) for (v, a), (w, b) in combinations(boxes, 2) if a.overlaps(b)]


def to_lab(light):
    """(k, 3) linear red, green, blue -> CIE L*a*b*."""
    to_xyz = [(0.412, 0.358, 0.180), (0.213, 0.715, 0.072), (0.019, 0.119, 0.950)]
    x, y, z = np.cbrt(light @ np.array(to_xyz).T / (0.950, 1.0, 1.089)).T
    return np.stack([116 * y - 16, 500 * (x - y), 200 * (y - z)], axis=1)
