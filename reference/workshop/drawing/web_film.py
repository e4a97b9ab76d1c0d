"""An evacuation, or several side by side, as a web page that holds data and a player.

The paper's figures, extended in time [A8].  The page draws: `web_film.html` is its
template, here is what it asks for.  Floors are SVG, whose colours the page's style
chooses; names of rooms are painted over flames, letters of stairwells over people.

    B  bodies: people, then robots
"""

from base64 import b64encode
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any
from zlib import compress

import numpy as np
from jinja2 import Template

from reference import paper
from reference.building import Building, Kind
from reference.simulation import Simulation
from reference.workshop.drawing import page, plans
from reference.workshop.drawing.evacuation import INKS, ONE_SPOT, STEPS, TRAIL_SECONDS
from reference.workshop.strategies import FIRES
from reference.world import NOWHERE, DoorBurnt, Fate, Flames

FRAME = 0.6  # simulated seconds
TEMPLATE = Path(__file__).with_name("web_film.html")
CLASSES = {kind: kind.name.lower() for kind in Kind}  # of cells, on the page
NEVER = -1
DONE = -2  # what a robot says whose work is done [C8]
LARGEST_NAME = 2.5  # metres, of a room's; the player writes none higher than 15 pixels
ROBOT = len(Fate) + 1  # a state; a human's is its mode while inside, 2 out, 3 dead
BODY = "x y floor health state stairwell leader says toX toY"
"""What a frame tells of a body: whole numbers, -1 for nothing; places in decimetres.

A robot says -1 for "follow me", or DONE, or a landmark; nothing as long as it goes to
nowhere.
"""


def write_web_film(
    path: Path,
    runs: Sequence[Simulation],
    headings: Sequence[str],
    instants: Iterable[object],
) -> None:
    """Note simulations of one building at each instant, then write their page.

    headings: of each evacuation; further lines of one say who plays
    """
    reels = [Reel(run) for run in runs]
    for _ in instants:
        for reel in reels:
            reel.note()

    building = runs[0].building
    content = Template(TEMPLATE.read_text("utf-8"), autoescape=True).render(
        film=_film_of(runs, reels),
        script=TEMPLATE.with_suffix(".js").read_text("utf-8"),
        title=building.title,
        rules=rules_in_words(runs),
        verdicts=[verdict(run, runs[0], headings[0]) for run in runs],
        headings=[(words or building.title).split("\n") for words in headings],
        names=[page.floor_title(building, k) for k in range(building.floors)],
        floors=[floor_svg(building, k) for k in range(building.floors)],
        kinds={CLASSES[k]: v for k, v in page.MEANINGS.items() if k in building.kind},
        inks={CLASSES[kind]: ink for kind, ink in page.COLOURS.items()} | INKS,
    )
    path.write_text(content, "utf-8")


def _film_of(runs: Sequence[Simulation], reels: "Sequence[Reel]") -> dict[str, Any]:
    """Collect what the player reads; reels: of each run."""
    building = runs[0].building
    down, across = building.kind.shape[1:]
    return {
        "step": seconds_per_frame(runs[0]),
        "begin": reels[0].begin,
        "end": round(max(run.world.time for run in runs), 9),
        "trail": TRAIL_SECONDS,
        "spot": 10 * ONE_SPOT,
        "size": [across, down],
        "columns": BODY.split(),
        "health": STEPS,
        "marks": [
            {"name": m.id.split("/")[1], "floor": m.floor, "cells": m.cells.tolist()}
            for m in building.landmarks
        ],
        "rooms": [
            name for k in range(building.floors) for name in floor_names(building, k)
        ],
        "runs": [reel.packed() for reel in reels],
    }


def rules_in_words(runs: Sequence[Simulation]) -> str:
    """Explain in a few sentences what a newcomer sees [B4] [B7]."""
    words = (
        f"All begin with {paper.HEALTH:g} health and lose "
        f"{paper.loss_per_second():g} a second, {paper.BURN_LOSS:g} more in flames; "
        f"who is inside after {paper.health_seconds():g} s is dead. "
        "Leaders find their own way; followers go after a leader"
    )
    if any(run.world.robots for run in runs):
        return f"{words} or a robot. Robots lead whom they meet."
    return f"{words}."


def verdict(run: Simulation, first: Simulation, heading: str) -> str:
    """Say how an evacuation ended: "35 of 40 got out, 5 more than without guides".

    first: the run to compare with, whose heading is this; itself is compared with none
    """
    ended = run.outcome()
    words = f"{ended.evacuated} of {len(run.world.bodies)} got out"
    if ended.inside:
        words += f", {ended.inside} still inside"
    if run is first:
        return words

    more = ended.evacuated - first.outcome().evacuated
    # one that learned or is somebody's own has a class that tells nothing
    kinds = {type(run.fire_strategy), type(first.fire_strategy)}
    same_fire = len(kinds) == 1 and kinds <= {*FIRES.values()}
    than = f"with “{heading.splitlines()[0] if heading else 'the first'}”"
    if same_fire and run.world.robots and not first.world.robots:
        than = "without guides"
    if more == 0:
        return f"{words}, as many as {than}"
    return f"{words}, {abs(more)} {'more' if more > 0 else 'fewer'} than {than}"


def seconds_per_frame(run: Simulation) -> float:
    """Choose the seconds from one frame to the next: whole ticks, about FRAME."""
    ticks = max(1, round(FRAME / run.tick))
    return round(ticks * run.tick, 9)


class Reel:
    """What a film holds of one evacuation, noted frame by frame.

    begin     s, of the first frame
    bodies    of each frame (B, 10), columns of BODY
    lit, ash  frames in which each cell begins to burn and has burnt out, or NEVER
    """

    def __init__(self, run: Simulation):
        self.run = run
        self.begin = round(run.world.time, 9)
        self.bodies = list[np.ndarray]()
        self.lit = np.full(run.building.kind.shape, NEVER)
        self.ash = self.lit.copy()

    def note(self) -> None:
        """Note where everybody is, and what burns."""
        world = self.run.world
        self._note_flames(world.flames, frame=len(self.bodies))

        bodies = world.bodies
        now = np.full((len(bodies) + len(world.robots), 10), NOWHERE, np.int16)
        people = now[: len(bodies)]
        people[:, :2] = self._spots(bodies.position)
        people[:, 2] = bodies.floor
        people[:, 3] = np.ceil(bodies.health)
        people[:, 4] = np.where(bodies.inside, bodies.mode, bodies.fate + 1)
        people[:, 5] = bodies.stairwell
        people[:, 6] = bodies.leader

        for row, robot in zip(now[len(bodies) :], world.robots, strict=True):
            row[:2] = self._spots(robot.position)
            row[2] = robot.floor
            row[3] = paper.HEALTH
            row[4] = ROBOT
            if not robot.active:
                row[7] = DONE
            elif robot.destination is not None:
                row[7] = robot.says
                row[8:] = self._spots(robot.destination)
        self.bodies.append(now)

    def _note_flames(self, flames: Flames, frame: int) -> None:
        """Note the frame in cells that burn for the first time, or no longer."""
        has_burnt = flames.burning | flames.ash
        self.lit[has_burnt & (self.lit == NEVER)] = frame
        self.ash[flames.ash & (self.ash == NEVER)] = frame

    def _spots(self, points: Any) -> np.ndarray:
        """Turn metres (..., 2) into decimetres from the north-west corner."""
        left, _, _, top = page.extent_of(self.run.building)
        return np.rint((np.asarray(points) - (left, top)) * (10, -10)).astype(int)

    def packed(self) -> dict[str, Any]:
        """Pack all of it for JSON."""
        never = (self.lit == NEVER).sum()
        order = np.argsort(self.lit, axis=None)[never:]  # in which cells began to burn
        cells = np.unravel_index(order, self.lit.shape)
        doors = [event for event in self.run.events if isinstance(event, DoorBurnt)]
        return {
            "people": len(self.run.world.bodies),
            "bodies": pack(np.transpose(self.bodies, (1, 2, 0))),
            "flames": pack(np.array([*cells, self.lit[cells], self.ash[cells]])),
            "doors": [[event.landmark, event.time] for event in doors],
            "sources": [
                [s.floor, *self._spots((s.x, s.y)).tolist(), s.time]
                for s in self.run.world.flames.sources
            ],
        }


def pack(numbers: np.ndarray) -> list[Any]:
    """Compress whole numbers, as steps along the last axis; its length stands first."""
    steps = np.diff(numbers, axis=-1, prepend=0).astype("<i2")
    return [numbers.shape[-1], b64encode(compress(steps.tobytes(), 9)).decode()]


def floor_svg(building: Building, floor: int) -> str:
    """Draw a floor's cells, one path for each kind; decimetres."""
    drawn = []
    for kind in page.MEANINGS:
        here = np.pad(building.kind[floor] == kind, ((0, 0), (1, 1))).astype(int)
        # Two changes in a row, in and out again, are one run of cells of the kind.
        runs = np.argwhere(np.diff(here)).reshape(-1, 4).tolist()
        ways = "".join(f"M{x} {y}H{end}v1H{x}z" for y, x, _, end in runs)
        drawn.append(f'<path class="{CLASSES[kind]}" d="{ways}"/>')
    return f'<g transform="scale(10)">{"".join(drawn)}</g>'


def floor_names(building: Building, floor: int) -> list[list[Any]]:
    """Place names of rooms: floor, x, y, size, whether upright, name; decimetres."""
    names = []
    for area in building.areas:
        if area.floor != floor:
            continue
        size, upright = plans.lettering(area, 10.0, 10 * LARGEST_NAME)
        if size:
            middle, sides = plans.widest(area.cells)
            y, x = (10 * middle + 5).tolist()
            size = min(size, 8.0 * float(sides[1 if upright else 0]))
            if area.kind == "stairwell":  # robots stand in its middle
                y, x = (10 * plans.north_end(area) + 5).tolist()
                size = 14.0
            names.append([floor, x, y, round(size, 1), upright, area.name])
    return names
