#!/usr/bin/env bash
# In a GIF that matplotlib writes, what moves passes faster than what stands still.
#
# Seen with matplotlib 3.11.2 and Pillow 13.0.0: `PillowWriter(fps=30)` asks for 33 ms a
# frame. Pillow adds up the milliseconds of frames that are equal, stores them as one, and
# only then cuts to the format's hundredths of a second. So a frame that differs from its
# neighbours is shown for 30 ms, and 30 equal ones for 990 ms, not 900: a film is not only
# short, its clock runs unevenly. At 60 frames a second what moves is 1.7 times as fast as
# asked for, what stands still nearly right. At 10, 20, 25 and 50 both are right. So
# measure no speed in such a film, and choose a rate that divides 100.
#
# Guess, written before running: every frame is cut alike, 30 ms at 30 frames a second,
# and what is asked for in sum, since a writer would carry the remainder on.
# Output seen:
#     30 fps: 30 moving frames in 900 ms, 30 still ones in 990 ms
#     60 fps: 30 moving frames in 300 ms, 30 still ones in 480 ms
#     10 fps: 30 moving frames in 3000 ms, 30 still ones in 3000 ms
#     20 fps: 30 moving frames in 1500 ms, 30 still ones in 1500 ms
#     25 fps: 30 moving frames in 1200 ms, 30 still ones in 1200 ms
#     50 fps: 30 moving frames in 600 ms, 30 still ones in 600 ms
set -euo pipefail
place=$(mktemp -d)
trap 'rm -rf "$place"' EXIT
python3 -m venv "$place/venv"
"$place/venv/bin/pip" install --quiet numpy==2.4.6 matplotlib==3.11.2 pillow==13.0.0
cd "$place"
MPLBACKEND=Agg "$place/venv/bin/python" - <<'PY'
import matplotlib.pyplot as plt
from matplotlib.animation import PillowWriter
from PIL import Image

MOVING = 30
STILL = 30
seen = {}
for rate in (30, 60, 10, 20, 25, 50):
    figure, axes = plt.subplots(figsize=(4, 1))
    axes.set(xlim=(-1, MOVING), ylim=(-1, 1))
    (dot,) = axes.plot([0], [0], "ko")
    writer = PillowWriter(fps=rate)
    with writer.saving(figure, "film.gif", dpi=50):
        for step in range(MOVING + STILL):
            dot.set_xdata([min(step, MOVING)])
            writer.grab_frame()
    plt.close(figure)
    shown = []
    with Image.open("film.gif") as film:
        for number in range(film.n_frames):
            film.seek(number)
            shown.append(film.info["duration"])
    assert len(shown) == MOVING + 1, "equal frames are not stored as one any more"
    seen[rate] = sum(shown[:-1]), shown[-1]
    moving, still = seen[rate]
    print(f"{rate} fps: {MOVING} moving frames in {moving} ms, {STILL} still ones in {still} ms")
assert seen.pop(30) == (900, 990) and seen.pop(60) == (300, 480)
assert seen == {rate: (30_000 // rate, 30_000 // rate) for rate in (10, 20, 25, 50)}
PY
