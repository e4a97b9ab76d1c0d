"""An evacuation, or several side by side, as a moving picture: GIF, web page, or MP4.

The paper's figures, extended in time [A8].  A web page holds data, see `web_film`.  In
the others what stands still is painted once, and only what moved is painted on top
(blitting); a GIF stores only the pixels that changed.
"""

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from errno import EIO
from pathlib import Path
from shutil import which
from subprocess import DEVNULL, PIPE, Popen
from tempfile import TemporaryFile
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from PIL import Image
from tqdm import tqdm

from reference.fire import NoFire
from reference.paper import InputError
from reference.simulation import Simulation
from reference.workshop.drawing import web_film
from reference.workshop.drawing.evacuation import (
    INKS,
    NUMBERS,
    STEPS,
    Scene,
    history_of,
    tally,
)
from reference.workshop.drawing.page import palette_of
from reference.workshop.drawing.web_film import seconds_per_frame
from reference.workshop.measuring.recording import ticks
from reference.workshop.storage.files import replacing

SPEED_UP = 6  # times real time
HOLD_SECONDS = 3.0  # seconds that the last frame stays
CLEAR_COLOUR = 255  # the palette's last place: a pixel that did not change

Frame = tuple[np.ndarray, float]  # pixels (rows, cols, 4), and seconds they are seen


def animate(
    simulations: Simulation | Iterable[Simulation],
    path: str | Path,
    headings: str | Sequence[str] = "",
    going: Iterable[None] | None = None,
) -> None:
    """Run one simulation, or several in one building, to the end and film them.

    path: .gif, .html or .mp4.  headings: of each, "" is the building's title, which is
    the default of all; further lines of one say who plays
    going: runs them instead, and pauses after each tick; see `recording.ticks`.

    A film begins where its simulations stand, all at the same second.  All of the file
    is written, or nothing.
    Raises InputError for what cannot be filmed, such as runs that have ended, for
    headings of another number, for another suffix and for .mp4 without ffmpeg; OSError
    for an unwritable path.
    """
    runs = [simulations] if isinstance(simulations, Simulation) else simulations
    simulations = _filmable(runs)
    heads = [headings] if isinstance(headings, str) else list(headings)
    if heads in ([], [""]):
        heads = [""] * len(simulations)
    if len(heads) != len(simulations):
        raise InputError(
            f"{len(simulations)} evacuations have {len(heads)} headings: give a list "
            "with one for each, or none"
        )
    target = Path(path)
    suffix = target.suffix.lower()
    if suffix not in (".gif", ".html", ".mp4"):
        raise InputError(f"{target}: write a .gif, .html or .mp4")
    if suffix == ".mp4" and which("ffmpeg") is None:
        raise InputError(f"{target}: needs ffmpeg; install it or write a .gif or .html")

    instants = _instants(simulations, going or ticks(simulations))
    with replacing(target) as partial:
        if suffix == ".html":
            web_film.write_web_film(partial, simulations, heads, instants)
            return
        first = simulations[0]
        scene = Scene(first.building, len(first.world.bodies), heads)
        scene.leave_out_of_legend(_names_of_nothing(simulations))
        pace = seconds_per_frame(first) / SPEED_UP
        frames = _frames(scene, simulations, instants, pace)
        if suffix == ".gif":
            _gif(partial, frames)
        else:
            _mp4(partial, scene, frames, pace)


def _filmable(runs: Iterable[Simulation]) -> list[Simulation]:
    """List what is to be filmed. Raises InputError for what cannot be."""
    is_list = isinstance(runs, Iterable) and not isinstance(runs, str)
    listed: list[Any] = list(runs) if is_list else [runs]
    strange = [run for run in listed if not isinstance(run, Simulation)]
    if strange or not listed:
        what = f"{strange[0]!r:.60}" if strange else "nothing"
        raise InputError(f"animate takes a Simulation, or a list of them, not {what}")
    if any(run.building.drawing != listed[0].building.drawing for run in listed):
        raise InputError("evacuations side by side need the same building: film each")
    if len({*map(id, listed)}) < len(listed):
        raise InputError("the same simulation is there twice: give a copy of it")
    if any(run.done and run.ticks for run in listed):
        raise InputError(
            "this evacuation has ended, and a film plays it to its end: give a new "
            "simulation that has not run"
        )
    if len({round(run.world.time, 9) for run in listed}) > 1:
        raise InputError(
            "evacuations side by side begin at the same second: film each, or run "
            "them as far as the others"
        )
    return listed


def _names_of_nothing(runs: Sequence[Simulation]) -> set[str]:
    """Name what cannot come in any of the runs, as `evacuation.looks` does."""
    names = set[str]()
    if not any(run.world.robots for run in runs):
        names |= {"robot", "destination"}
    floors = [Counter(robot.floor for robot in run.world.robots) for run in runs]
    if all(max(counts.values(), default=0) < 2 for counts in floors):
        names.add(NUMBERS)
    fires = [run.fire_strategy for run in runs]
    burning = any(run.world.flames.sources for run in runs)
    if not burning and all(type(f) is NoFire and not vars(f) for f in fires):
        names |= {"flames", "ash", "burnt door", "fire source"}
    return names


def _instants(runs: Sequence[Simulation], going: Iterable[None]) -> Iterator[bool]:
    """Pause at 0 s, then for every frame, then at the end; yield whether it is that."""
    every = round(seconds_per_frame(runs[0]) / runs[0].tick)
    limit = round(runs[0].scenario.time_limit)
    with tqdm(total=limit, unit=" s", disable=None, desc="filming") as bar:
        for tick, _ in enumerate(going):
            over = all(run.done for run in runs)
            if over or tick % every == 0:
                bar.update(int(max(run.world.time for run in runs)) - bar.n)
                yield over


def _frames(
    scene: Scene, runs: Sequence[Simulation], instants: Iterable[bool], pace: float
) -> Iterator[Frame]:
    """Paint each instant, to be seen for `pace` seconds, the last one longer."""
    pixels = painter(scene)
    histories = [history_of(run) for run in runs]
    for over in instants:
        for side, (run, history) in enumerate(zip(runs, histories, strict=True)):
            if run.world.time > history[-1].time:  # it has not ended
                history.append(tally(run.world))
            scene.show(run.world, history, side)
        yield pixels(), HOLD_SECONDS if over else pace


def painter(scene: Scene) -> Callable[[], np.ndarray]:
    """Make a function that paints pixels of the scene, valid until its next call."""
    canvas = FigureCanvasAgg(scene.figure)
    for artist in scene.moving:
        artist.set_animated(True)
    canvas.draw()
    page = canvas.copy_from_bbox(scene.figure.bbox)

    def pixels() -> np.ndarray:
        """Paint on the page what moves."""
        canvas.restore_region(page)
        for artist in scene.moving:
            scene.figure.draw_artist(artist)
        return np.asarray(canvas.buffer_rgba())

    return pixels


# -- Formats ------------------------------------------------------------------------


def _gif(path: Path, frames: Iterable[Frame]) -> None:
    """Write frames in the colours of the first; Pillow stores what changes."""
    pages = _in_few_colours(frames)
    first = next(pages)
    palette = bytes(first.getpalette() or [])
    look: dict[str, Any] = {"palette": palette, "transparency": CLEAR_COLOUR, "loop": 0}
    look |= {"append_images": pages, "optimize": True}
    with path.open("wb") as file:
        first.save(file, "GIF", save_all=True, **look)


def _in_few_colours(frames: Iterable[Frame]) -> Iterator[Image.Image]:
    """Reduce frames to 8-bit images of one palette, without CLEAR_COLOUR.

    A GIF counts whole hundredths of a second: a frame ends with the nearest one.
    """
    palette = None
    end = 0.0
    for pixels, seconds in frames:
        begin = round(100 * end)
        end += seconds
        page = Image.fromarray(pixels).convert("RGB")
        if palette is None:  # the legend shows the colours of later frames, too
            palette = palette_of(page, CLEAR_COLOUR, [*INKS.values(), *STEPS])
        image = page.quantize(palette=palette, dither=Image.Dither.NONE)
        image.info["duration"] = 10 * (round(100 * end) - begin)
        yield image


def _mp4(path: Path, scene: Scene, frames: Iterable[Frame], pace: float) -> None:
    """Pipe raw frames into ffmpeg, which wants even sizes and a steady rate.

    Whatever it complains of is a failure: on a full disk it may exit with status 0.
    """
    width, height = scene.figure.canvas.get_width_height()
    raw = f"-f rawvideo -pix_fmt rgba -s {width}x{height} -r {1 / pace:g} -i -"
    even = "-vf pad=ceil(iw/2)*2:ceil(ih/2)*2:color=white -pix_fmt yuv420p -y"
    command = ["ffmpeg", "-v", "error", "-xerror", *raw.split(), *even.split()]
    with TemporaryFile() as said:
        ffmpeg = Popen([*command, str(path)], stdin=PIPE, stdout=DEVNULL, stderr=said)
        pipe = ffmpeg.stdin
        assert pipe is not None
        with suppress(BrokenPipeError), ffmpeg:
            try:
                for pixels, seconds in frames:
                    pipe.write(pixels.tobytes() * round(seconds / pace))
            except KeyboardInterrupt:  # else it may begin the file when we are gone
                ffmpeg.kill()
                ffmpeg.wait()
                raise
        said.seek(0)
        words = said.read().decode(errors="replace").splitlines()
    if ffmpeg.returncode or words:
        raise OSError(EIO, f"ffmpeg: {words[-1] if words else 'it says no reason'}")
