"""An evacuation as a moving picture: GIF, a page with a player, or MP4.

Clause: A8, extended in time.  What stands still is painted once and only what moved is
painted on top (blitting); GIF and player store only the pixels that changed.
"""

import json
from base64 import b64encode
from collections.abc import Callable, Collection, Iterator
from contextlib import AbstractContextManager, contextmanager, suppress
from html import escape
from io import BytesIO
from pathlib import Path
from shutil import which
from string import Template
from subprocess import DEVNULL, PIPE, Popen

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_rgb
from PIL import GifImagePlugin, Image
from scipy.spatial import KDTree
from tqdm import tqdm

from reference.building import Kind
from reference.paper import InputError
from reference.simulation import Outcome, Simulation
from reference.strategies import NoFire
from reference.workshop.drawing.evacuation import (
    CHAR,
    EMBER,
    FLAME,
    INK,
    SOURCE,
    STEPS,
    Scene,
    Tally,
    possible,
    tally,
)
from reference.workshop.drawing.page import COLOURS, FAINT, TEXT, with_suffix
from reference.workshop.files import replacing

DPI = 100  # 1100 pixels wide
SECONDS_PER_FRAME = 0.4  # simulated
PACE = SECONDS_PER_FRAME / 4  # seconds that a frame is seen: four times real time
HOLD = 3.0  # seconds that the last frame stays
KEY_FRAMES = 25  # of the player: how far it goes back to jump to a place
PLAYER = Path(__file__).with_name("player.html")
WHITE = "#ffffff"
CLEAR = 255  # the palette's last place: a pixel that did not change

Add = Callable[[np.ndarray, float], None]
"""Appends (rows, cols, 4) pixels, to be seen for so many seconds."""


def animate(simulation: Simulation, path: str | Path) -> Outcome:
    """Run a simulation to its end and film it, as .gif, .html or .mp4.

    All of the file is written, or nothing. Raises ValueError for another suffix and for
    .mp4 without ffmpeg, OSError for an unwritable path.
    """
    target = with_suffix(path, FORMATS, "an animation")
    if target.suffix.lower() == ".mp4" and which("ffmpeg") is None:
        raise InputError(
            f"{target}: an MP4 needs ffmpeg; install it, or end the name in .gif or "
            ".html."
        )
    scene = scene_of(simulation)
    write, pixels = FORMATS[target.suffix.lower()], painter(scene)
    with replacing(target) as partial, write(partial, scene) as add:
        history: list[Tally] = []
        for _ in _frames(simulation):
            history.append(tally(simulation.world))
            scene.show(simulation.world, history)
            add(pixels(), HOLD if simulation.done else PACE)
    return simulation.run()


def scene_of(simulation: Simulation, without: Collection[str] = ()) -> Scene:
    """Make the page of a film; its legend lists what can occur in this film.

    without: names that cannot, all the same
    """
    world, sources = simulation.world, simulation.scenario.sources
    fire = sources > 0 and not isinstance(simulation.fire_strategy, NoFire)
    scene = Scene(world.building, len(world.bodies), DPI)
    names = possible(world.building, bool(world.robots), fire)
    scene.explain(names.difference(without))
    return scene


def _frames(simulation: Simulation) -> Iterator[None]:
    """Run the simulation to its end, with a pause for each frame."""
    ticks = max(1, round(SECONDS_PER_FRAME / simulation.tick))
    limit = round(simulation.scenario.time_limit)
    with tqdm(total=limit, unit=" s", disable=None, desc="filming") as bar:
        yield
        while not simulation.done:
            for _ in range(ticks):
                if not simulation.done:
                    simulation.step()
            bar.update(int(simulation.world.time) - bar.n)
            yield
        bar.total = bar.n


def painter(scene: Scene) -> Callable[[], np.ndarray]:
    """Make a function that paints the scene as it is: (rows, cols, 4) pixels.

    They are valid until its next call.
    """
    canvas = FigureCanvasAgg(scene.figure)
    for artist in scene.moving:
        artist.set_animated(True)
    page = None

    def pixels() -> np.ndarray:
        """Paint the page if it changed, and on it what moves."""
        nonlocal page
        if page is None or not scene.still:
            canvas.draw()
            page = canvas.copy_from_bbox(scene.figure.bbox)
        canvas.restore_region(page)
        for artist in scene.moving:
            scene.figure.draw_artist(artist)
        return np.asarray(canvas.buffer_rgba())

    return pixels


# -- Only what changed --------------------------------------------------------------


class Patches:
    """Turns frames into 8-bit images of the smallest box around changed pixels."""

    def __init__(self) -> None:
        colours = _palette()
        self.bytes, self.table = colours.tobytes(), _nearest(colours)
        self.before: np.ndarray | None = None

    def next(
        self, pixels: np.ndarray, whole: bool = False
    ) -> tuple[Image.Image, tuple[int, int]]:
        """The patch that turns the last frame into this one, and its (left, top)."""
        packed = pixels.view(np.uint32)[..., 0].copy()
        changed = np.ones(packed.shape, dtype=bool)
        if self.before is not None and not whole:
            changed = packed != self.before
        self.before = packed
        rows, cols = (_span(np.flatnonzero(changed.any(axis=k))) for k in (1, 0))
        changed = changed[rows, cols]
        patch = np.full(changed.shape, CLEAR, dtype=np.uint8)
        patch[changed] = self._indices(pixels[rows, cols][changed])
        image = Image.fromarray(patch)
        image.putpalette(self.bytes)
        return image, (cols.start, rows.start)

    def _indices(self, colours: np.ndarray) -> np.ndarray:
        """Places (k,) in the palette of (k, 4) colours."""
        red, green, blue = (colours[:, :3] >> 3).astype(np.uint16).T
        return self.table[red << 10 | green << 5 | blue]


def _span(changed: np.ndarray) -> slice:
    """Slice from the first changed row or column to the last; one if none has."""
    return slice(int(changed[0]), int(changed[-1]) + 1) if len(changed) else slice(0, 1)


def _palette() -> np.ndarray:
    """Colours (256, 3) that we draw with, and mixes of them at smoothed edges."""
    inks = [*COLOURS.values(), *STEPS, TEXT, FAINT, INK, CHAR, SOURCE, FLAME, EMBER]
    grounds = (COLOURS[Kind.WALL], COLOURS[Kind.STAIRS], INK, FLAME)
    mixes = [(ink, ink, 0.0) for ink in (WHITE, *inks)]
    mixes += [(ink, ground, 1 / 2) for ink in inks for ground in grounds]
    mixes += [(i, COLOURS[Kind.FLOOR], t) for i in inks for t in (1 / 3, 2 / 3)]
    mixes += [(i, WHITE, t / 10) for i in (TEXT, FAINT) for t in range(1, 10)]
    mixes += [(FAINT, COLOURS[Kind.FLOOR], t / 10) for t in range(5, 10)]  # trails
    colours = np.full((256, 3), 255, dtype=np.uint8)
    for place, (ink, ground, share) in enumerate(mixes):
        one, other = np.array(to_rgb(ink)), np.array(to_rgb(ground))
        colours[place] = np.round(255 * (one * (1 - share) + other * share))
    return colours


def _nearest(colours: np.ndarray) -> np.ndarray:
    """Find the nearest place but CLEAR for colours of 5 bits a channel: (32768,)."""
    levels = np.arange(32) * 8 + 4
    cube = np.stack(np.meshgrid(levels, levels, levels, indexing="ij"), axis=-1)
    return KDTree(colours[:CLEAR]).query(cube.reshape(-1, 3))[1].astype(np.uint8)


# -- Formats ------------------------------------------------------------------------


@contextmanager
def _gif(path: Path, scene: Scene) -> Iterator[Add]:
    """Write a GIF: one palette, each frame a patch on the last."""
    patches = Patches()
    with open(path, "wb") as file:

        def add(pixels: np.ndarray, seconds: float) -> None:
            """Write the first frame with a header, the others as bare patches."""
            image, corner = patches.next(pixels)
            look = {"duration": 1000 * seconds}
            if not file.tell():
                whole = BytesIO()
                image.save(whole, "GIF", optimize=False, loop=0, **look)
                file.write(whole.getvalue().removesuffix(b";"))
                return
            look |= {"transparency": CLEAR, "disposal": 1}
            file.writelines(GifImagePlugin.getdata(image, corner, **look))

        yield add
        file.write(b";")


@contextmanager
def _html(path: Path, scene: Scene) -> Iterator[Add]:
    """Write a page that needs no other file: patches as PNGs, and a player."""
    patches, count = Patches(), 0
    title = escape(scene.building.title)
    width, height = scene.figure.canvas.get_width_height()
    head, foot = map(Template, PLAYER.read_text("utf-8").split("$frames"))
    with open(path, "w", encoding="utf-8") as file:
        file.write(head.substitute(title=title, width=width, height=height))

        def add(pixels: np.ndarray, seconds: float) -> None:
            """Write a line of the page's script for a frame."""
            nonlocal count
            image, corner = patches.next(pixels, whole=count % KEY_FRAMES == 0)
            png = BytesIO()
            image.save(png, "PNG", transparency=CLEAR)
            frame = [*corner, b64encode(png.getvalue()).decode()]
            file.write(json.dumps(frame) + ",\n")
            count += 1

        yield add
        file.write(foot.substitute(pace=1000 * PACE, key=KEY_FRAMES))


@contextmanager
def _mp4(path: Path, scene: Scene) -> Iterator[Add]:
    """Pipe raw frames into ffmpeg, which wants even sizes and a steady rate."""
    width, height = scene.figure.canvas.get_width_height()
    raw = f"-f rawvideo -pix_fmt rgba -s {width}x{height} -r {1 / PACE:g} -i -"
    even = "-vf pad=ceil(iw/2)*2:ceil(ih/2)*2:color=white -pix_fmt yuv420p -y"
    command = ["ffmpeg", *raw.split(), *even.split(), str(path)]
    ffmpeg = Popen(command, stdin=PIPE, stdout=DEVNULL, stderr=DEVNULL)
    pipe = ffmpeg.stdin
    assert pipe is not None

    def add(pixels: np.ndarray, seconds: float) -> None:
        pipe.write(pixels.tobytes() * round(seconds / PACE))

    with suppress(BrokenPipeError), ffmpeg:  # its exit status tells what went wrong
        yield add
    if ffmpeg.returncode:
        raise OSError(f"{path}: ffmpeg could not write it. Try .gif or .html.")


FORMATS: dict[str, Callable[[Path, Scene], AbstractContextManager[Add]]] = {
    ".gif": _gif,
    ".html": _html,
    ".mp4": _mp4,
}
