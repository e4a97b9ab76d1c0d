"""An evacuation, or two side by side, as a moving picture: GIF, web page, or MP4.

Clause: A8, extended in time.  What stands still is painted once and only what moved is
painted on top (blitting); GIF and web page store only the pixels that changed.
"""

import json
from base64 import b64encode
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from errno import EIO
from html import escape
from io import BytesIO
from pathlib import Path
from shutil import which
from string import Template
from subprocess import DEVNULL, PIPE, Popen
from tempfile import TemporaryFile

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from PIL import GifImagePlugin, Image
from tqdm import tqdm

from reference.paper import InputError
from reference.simulation import Simulation
from reference.workshop.drawing.evacuation import Scene, Tally, tally
from reference.workshop.files import replacing
from reference.workshop.recording import ticks

SECONDS_PER_FRAME = 0.6  # simulated
PACE = SECONDS_PER_FRAME / 6  # seconds that a frame is seen: six times real time
HOLD = 3.0  # seconds that the last frame stays
KEY_FRAMES = 25  # of the player: how far it goes back to jump to a place
PLAYER = Path(__file__).with_name("player.html")
CLEAR = 255  # the palette's last place: a pixel that did not change

Frame = tuple[np.ndarray, float]  # pixels (rows, cols, 4), and seconds they are seen


def animate(
    simulations: Sequence[Simulation],
    path: str | Path,
    headings: Sequence[str] = ("",),
    going: Iterable[None] | None = None,
) -> None:
    """Run one simulation, or two in one building, to the end and film them.

    path: .gif, .html or .mp4.  headings: one for each; "" is the building's title.
    going: runs them instead, and pauses after each tick; see `recording.ticks`.

    All of the file is written, or nothing. Raises ValueError for .mp4 without ffmpeg,
    OSError for an unwritable path.
    """
    target = Path(path)
    write = FORMATS[target.suffix.lower()]
    if write is _mp4 and which("ffmpeg") is None:
        raise InputError(f"{target}: needs ffmpeg; install it or write a .gif or .html")
    first = simulations[0]
    scene = Scene(first.building, len(first.world.bodies), headings)
    frames = _frames(scene, simulations, going or ticks(simulations))
    with replacing(target) as partial:
        write(partial, scene, frames)


def _frames(
    scene: Scene, runs: Sequence[Simulation], going: Iterable[None]
) -> Iterator[Frame]:
    """Paint the first instant, then one every SECONDS_PER_FRAME, then the last."""
    pixels, histories = painter(scene), [list[Tally]() for _ in runs]
    every = max(1, round(SECONDS_PER_FRAME / runs[0].tick))
    limit = round(runs[0].scenario.time_limit)
    with tqdm(total=limit, unit=" s", disable=None, desc="filming") as bar:
        for tick, _ in enumerate(going):
            over = all(run.done for run in runs)
            if tick % every and not over:
                continue
            for side, (run, history) in enumerate(zip(runs, histories, strict=True)):
                history.append(tally(run.world))
                scene.show(run.world, history, side)
            bar.update(int(max(run.world.time for run in runs)) - bar.n)
            yield pixels(), HOLD if over else PACE


def painter(scene: Scene) -> Callable[[], np.ndarray]:
    """Make a function that paints pixels of the scene, valid until its next call."""
    canvas, page = FigureCanvasAgg(scene.figure), None
    for artist in scene.moving:
        artist.set_animated(True)

    def pixels() -> np.ndarray:
        """Paint the page if it changed, and on it what moves."""
        nonlocal page
        if page is None or not scene.still:
            canvas.draw()
            page, scene.still = canvas.copy_from_bbox(scene.figure.bbox), True
        canvas.restore_region(page)
        for artist in scene.moving:
            scene.figure.draw_artist(artist)
        return np.asarray(canvas.buffer_rgba())

    return pixels


# -- Only what changed --------------------------------------------------------------


def patches(
    frames: Iterable[Frame], key: int = 0
) -> Iterator[tuple[Image.Image, tuple[int, int], float]]:
    """Reduce frames to 8-bit images of the smallest box around changed pixels.

    key: every key-th is whole; 0: only the first.  Yields the patch, its (left, top) on
    the frame before, and for how many seconds it is seen.
    """
    before, palette = None, None
    for k, (pixels, seconds) in enumerate(frames):
        rows, cols, _ = pixels.shape
        page = Image.frombuffer("RGBA", (cols, rows), pixels)
        palette = palette or _palette(page.convert("RGB"))
        now = pixels.view(np.uint32)[..., 0].copy()
        whole = before is None or (key and k % key == 0)
        changed = np.ones(now.shape, dtype=bool) if whole else now != before
        down, across = (_span(np.flatnonzero(changed.any(axis=k))) for k in (1, 0))
        box = page.crop((across.start, down.start, across.stop, down.stop))
        part = box.convert("RGB").quantize(palette=palette, dither=Image.Dither.NONE)
        patch = np.where(changed[down, across], np.asarray(part), np.uint8(CLEAR))
        image = Image.fromarray(patch)
        image.putpalette(palette.getpalette() or [])
        yield image, (across.start, down.start), seconds
        before = now


def _span(changed: np.ndarray) -> slice:
    """Slice from the first changed row or column to the last; one if none has."""
    return slice(int(changed[0]), int(changed[-1]) + 1) if len(changed) else slice(0, 1)


def _palette(page: Image.Image) -> Image.Image:
    """Choose all colours but CLEAR: the legend shows those of later frames, too."""
    palette = page.quantize(CLEAR, Image.Quantize.MAXCOVERAGE)
    colours = palette.getpalette() or []
    palette.putpalette((colours + 256 * colours[:3])[: 3 * 256])  # the rest: unused
    return palette


# -- Formats ------------------------------------------------------------------------


def _gif(path: Path, scene: Scene, frames: Iterable[Frame]) -> None:
    """Write the first frame with a header, the others as bare patches."""
    with open(path, "wb") as file:
        for image, corner, seconds in patches(frames):
            look = {"duration": 1000 * seconds}
            if file.tell():
                look |= {"transparency": CLEAR, "disposal": 1}
                file.writelines(GifImagePlugin.getdata(image, corner, **look))
            else:
                whole = BytesIO()
                image.save(whole, "GIF", optimize=False, loop=0, **look)
                file.write(whole.getvalue().removesuffix(b";"))
        file.write(b";")


def _html(path: Path, scene: Scene, frames: Iterable[Frame]) -> None:
    """Write a page that needs no other file: patches as PNGs, and a player."""
    width, height = scene.figure.canvas.get_width_height()
    known = {"title": escape(scene.title), "width": width, "height": height}
    known |= {"key": KEY_FRAMES, "step": SECONDS_PER_FRAME, "pace": 1000 * PACE}
    page = Template(PLAYER.read_text("utf-8")).substitute(known, frames="\0")
    head, foot = page.split("\0")
    with open(path, "w", encoding="utf-8") as file:
        file.write(head)
        for image, corner, _ in patches(frames, KEY_FRAMES):
            png = BytesIO()
            image.save(png, "PNG", transparency=CLEAR)
            patch = [*corner, b64encode(png.getvalue()).decode()]
            file.write(json.dumps(patch) + ",\n")
        file.write(foot)


def _mp4(path: Path, scene: Scene, frames: Iterable[Frame]) -> None:
    """Pipe raw frames into ffmpeg, which wants even sizes and a steady rate.

    Whatever it complains of is a failure: on a full disk it may exit with status 0.
    """
    width, height = scene.figure.canvas.get_width_height()
    raw = f"-f rawvideo -pix_fmt rgba -s {width}x{height} -r {1 / PACE:g} -i -"
    even = "-vf pad=ceil(iw/2)*2:ceil(ih/2)*2:color=white -pix_fmt yuv420p -y"
    command = ["ffmpeg", "-v", "error", "-xerror", *raw.split(), *even.split()]
    with TemporaryFile() as said:
        ffmpeg = Popen([*command, str(path)], stdin=PIPE, stdout=DEVNULL, stderr=said)
        pipe = ffmpeg.stdin
        assert pipe is not None
        with suppress(BrokenPipeError), ffmpeg:
            for pixels, seconds in frames:
                pipe.write(pixels.tobytes() * round(seconds / PACE))
        said.seek(0)
        words = said.read().decode(errors="replace").splitlines()
    if ffmpeg.returncode or words:
        raise OSError(EIO, f"ffmpeg: {words[-1] if words else 'it says no reason'}")


FORMATS: dict[str, Callable[[Path, Scene, Iterable[Frame]], None]] = {
    ".gif": _gif,
    ".html": _html,
    ".mp4": _mp4,
}
