"""An evacuation, or several side by side, as a web page that holds data and a player.

Clause: A8, extended in time.  The page draws: `web_film.html` is its template, here is
what it asks for.  Floors are SVG, whose colours the page's style chooses.

    B  bodies: people, then robots
"""

from base64 import b64encode
from collections.abc import Iterable, Sequence
from html import escape
from pathlib import Path
from typing import Any
from zlib import compress

import numpy as np
from jinja2 import Template

from reference import paper
from reference.building import Building, Kind
from reference.simulation import Simulation
from reference.workshop.drawing import page, plans
from reference.workshop.drawing.evacuation import INKS, STEPS, TRAIL_SECONDS
from reference.world import NOWHERE, DoorBurnt, Fate

FRAME = 0.6  # simulated seconds
TEMPLATE = Path(__file__).with_name("web_film.html")
CLASSES = {kind: kind.name.lower() for kind in Kind}  # of cells, on the page
NEVER = -1
ROBOT = len(Fate) + 1  # a state, as a human's are: its mode while inside, 2 out, 3 dead
BODY = "x y floor health state stairwell leader says toX toY"
"""What a frame tells of a body: whole numbers, -1 for nothing; places in decimetres."""


def write(
    path: Path,
    runs: Sequence[Simulation],
    headings: Sequence[str],
    instants: Iterable[object],
) -> None:
    """Note simulations of one building at each instant, then write their page.

    headings: of each evacuation; further lines of one say who plays
    """
    building, reels = runs[0].building, [Reel(run) for run in runs]
    for _ in instants:
        for reel in reels:
            reel.note()
    down, across = building.kind.shape[1:]
    film = {
        "step": seconds_per_frame(runs[0]),
        "limit": min(runs[0].scenario.time_limit, paper.health_seconds()),
        "trail": TRAIL_SECONDS,
        "size": [across, down],
        "columns": BODY.split(),
        "health": STEPS,
        "marks": [
            {"name": m.id.split("/")[1], "floor": m.floor, "cells": m.cells.tolist()}
            for m in building.landmarks
        ],
        "runs": [reel.packed() for reel in reels],
    }
    content = Template(TEMPLATE.read_text("utf-8"), autoescape=True).render(
        film=film,
        script=TEMPLATE.with_suffix(".js").read_text("utf-8"),
        title=building.title,
        headings=[(words or building.title).split("\n") for words in headings],
        names=[page.floor_title(building, k) for k in range(building.floors)],
        floors=[floor_svg(building, k) for k in range(building.floors)],
        kinds={CLASSES[k]: v for k, v in page.MEANINGS.items() if k in building.kind},
        inks={CLASSES[kind]: ink for kind, ink in page.COLOURS.items()} | INKS,
    )
    path.write_text(content, "utf-8")


def seconds_per_frame(run: Simulation) -> float:
    """Simulated seconds from one frame to the next: whole ticks, about FRAME."""
    return round(max(1, round(FRAME / run.tick)) * run.tick, 9)


class Reel:
    """What a film holds of one evacuation, noted frame by frame.

    bodies    of each frame (B, 10), columns of BODY
    lit, ash  frames in which each cell begins to burn and has burnt out, or NEVER
    """

    def __init__(self, run: Simulation):
        self.run, self.bodies = run, list[np.ndarray]()
        self.lit = np.full(run.building.kind.shape, NEVER)
        self.ash = self.lit.copy()

    def note(self) -> None:
        """Note where everybody is, and what burns."""
        world, frame = self.run.world, len(self.bodies)
        bodies, robots, burning = world.bodies, world.robots, world.flames.burning
        self.lit[burning & (self.lit == NEVER)] = frame
        self.ash[~burning & (self.lit != NEVER) & (self.ash == NEVER)] = frame
        now = np.full((len(bodies) + len(robots), 10), NOWHERE, np.int16)
        people, others = now[: len(bodies)], now[len(bodies) :]
        people[:, :2] = self._spots(bodies.position)
        people[:, 2] = bodies.floor
        people[:, 3] = np.ceil(bodies.health)
        people[:, 4] = np.where(bodies.inside, bodies.mode, bodies.fate + 1)
        people[:, 5:7] = np.column_stack([bodies.stairwell, bodies.leader])
        for row, robot in zip(others, robots, strict=True):
            row[:5] = *self._spots(robot.position), robot.floor, paper.HEALTH, ROBOT
            if robot.active and robot.destination is not None:
                row[7:] = robot.says, *self._spots(robot.destination)
        self.bodies.append(now)

    def _spots(self, points: Any) -> np.ndarray:
        """Metres of points (..., 2) -> decimetres from the north-west corner."""
        left, _, _, top = page.extent_of(self.run.building)
        return np.rint((np.asarray(points) - (left, top)) * (10, -10)).astype(int)

    def packed(self) -> dict[str, Any]:
        """All of it, for JSON."""
        events, sources = self.run.events, self.run.world.flames.sources
        order = np.argsort(self.lit, axis=None)[(self.lit == NEVER).sum() :]
        cells = np.unravel_index(order, self.lit.shape)
        return {
            "people": len(self.run.world.bodies),
            "bodies": pack(np.transpose(self.bodies, (1, 2, 0))),
            "flames": pack(np.array([*cells, self.lit[cells], self.ash[cells]])),
            "doors": [[e.landmark, e.time] for e in events if isinstance(e, DoorBurnt)],
            "sources": [
                [s.floor, *self._spots((s.x, s.y)).tolist(), s.time] for s in sources
            ],
        }


def pack(numbers: np.ndarray) -> list[Any]:
    """How long the last axis is, and whole numbers as steps along it, compressed."""
    steps = np.diff(numbers, axis=-1, prepend=0).astype("<i2")
    return [numbers.shape[-1], b64encode(compress(steps.tobytes(), 9)).decode()]


def floor_svg(building: Building, floor: int) -> str:
    """Draw a floor's cells, one path for each kind, and names of rooms; decimetres."""
    drawn = []
    for kind in page.MEANINGS:
        here = np.pad(building.kind[floor] == kind, ((0, 0), (1, 1))).astype(int)
        rows = np.argwhere(np.diff(here)).reshape(-1, 4).tolist()
        ways = "".join(f"M{x} {y}H{end}v1H{x}z" for y, x, _, end in rows)
        drawn.append(f'<path class="{CLASSES[kind]}" d="{ways}"/>')
    names = []
    for area in (area for area in building.areas if area.floor == floor):
        size, upright = plans.lettering(area, 10.0, 14.0)
        if size:
            y, x = 10 * plans.widest(area.cells)[0] + 5
            turn = f' transform="rotate(-90 {x:g} {y:g})"' if upright else ""
            place = f'x="{x:g}" y="{y:g}" style="--room:{size:.1f}px"{turn}'
            names.append(f"<text {place}>{escape(area.name)}</text>")
    return f'<g transform="scale(10)">{"".join(drawn)}</g>{"".join(names)}'
