"""What a robot that learns chooses between: the anchors of each floor, by kind [C5].

Ways out, feet of stairs and cells to guard belong to the map.  A point that means a way
out may lie in a wall; it is drawn where it leads.  A point near stairs means them [C6],
so their foot may be in the next room.  The other anchors belong to a
moment, and stand here for one: ten seconds into an evacuation that `Escort` guides.
What `learned` reads is drawn: groups of people have anchors.
"""

from collections.abc import Iterable
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from reference import paper
from reference.building import Building, Kind
from reference.fire import NoFire
from reference.game.codec import PolicyCodec
from reference.paper import Scenario
from reference.simulation import Simulation
from reference.workshop.anchors.frame import FIRST_MARK, KEEP, WAIT, robot_destinations
from reference.workshop.anchors.sets import SetView
from reference.workshop.drawing import page, plans
from reference.workshop.drawing.evacuation import FLAME, INK, STEPS, marker
from reference.workshop.drawing.page import COLOURS, Style
from reference.workshop.strategies.guides import Escort
from reference.workshop.strategies.observed import way_marks, ways_out_of

MOMENT = 10.0  # s, when people have begun to walk and robots are under way
EXAMPLE_SEED = 0
_PALE = 0.45  # of the floors

KEEPING = "keep: where the robot is headed"
STAYING = "stay: where it stands"
WAY_OUT = "means this way out [C6]"
FOOT_OF_STAIRS = "where to wait for who comes down [C6]"
GUARDED = "where to guard a way from fire"
LOST = "a person whom nobody leads"
A_ROBOT = "robot"
PERSON = "another person, no anchor"

ANCHOR_LOOKS: dict[str, Style] = {
    A_ROBOT: marker("D", 7, "white", INK, 1.8) | {"zorder": 6},
    STAYING: marker("o", 13, "none", page.BLUE, 1.8) | {"zorder": 6},
    KEEPING: marker("+", 13, INK, INK, 2) | {"zorder": 7} | plans.HALO,
    WAY_OUT: marker("*", 15, COLOURS[Kind.EXIT], "white", 0.8) | {"zorder": 5},
    FOOT_OF_STAIRS: marker("s", 7, COLOURS[Kind.ENTRANCE], "white", 1) | {"zorder": 5},
    GUARDED: marker("h", 11, "none", FLAME, 1.6) | {"zorder": 4},
    LOST: marker("^", 8, STEPS[-1], INK, 0.8) | {"zorder": 5},
    PERSON: marker(".", 5, page.FAINT, page.FAINT, 1) | {"zorder": 3},
}
"""How kinds of anchors look, and what is no anchor; the upper have a higher zorder.

A disc would be a follower: see `evacuation`.
"""


def anchors(building: Building) -> Figure:
    """Draw what a robot on each floor chooses between, at a moment [C5] [C6]."""
    simulation = moment_of(building)
    about = f": what robots choose between after {simulation.world.time:.0f} s"
    floors = range(building.floors)
    figure, panels = page.floor_page(building, building.title, floors, about, _PALE)
    found = anchors_of(simulation)
    counts = dict[int, str]()
    for floor, by_kind in found.items():
        stars = ways_on_floor(building, floor, way_marks(building, floor)[0])
        _draw_anchors(panels[floor], {**by_kind, WAY_OUT: stars})
        signs = [np.unique(spots.round(6), axis=0) for spots in by_kind.values()]
        count = sum(map(len, signs))
        counts[floor] = f", {count} anchors"
    _draw_people(simulation, panels)
    for robot in simulation.world.robots:
        panels[robot.floor].plot(*robot.position, **ANCHOR_LOOKS[A_ROBOT])

    there = {kind for by_kind in found.values() for kind in by_kind} | {A_ROBOT, PERSON}
    marks = page.samples(
        {kind: ANCHOR_LOOKS[kind] for kind in ANCHOR_LOOKS if kind in there}
    )
    columns = int(figure.get_figwidth() / 2.9)
    page.legend(figure, marks, ncols=columns, labelspacing=0.9)
    page.lay_out(figure, building, panels, counts)
    return figure


def moment_of(building: Building) -> Simulation:
    """Play the first seconds with a robot a floor, and as many people as may fit."""
    cells = (building.kind == Kind.FLOOR).sum(axis=(1, 2))
    people = min(paper.PEOPLE, int(cells.min()) * building.floors)
    scenario = Scenario(people=people, robots_per_floor=1)
    for moment in (MOMENT, MOMENT / 5, 0.0):  # in a small map all are soon out
        simulation = Simulation(building, scenario, Escort(), NoFire(), EXAMPLE_SEED)
        while simulation.world.time < moment and not simulation.done:
            simulation.step()
        if not simulation.done:
            break
    return simulation


def anchors_of(simulation: Simulation) -> dict[int, dict[str, np.ndarray]]:
    """Find the anchors of the first robot of each floor: by kind (k, 2) metres."""
    building = simulation.building
    world = simulation.world
    codec = PolicyCodec("robots", building, simulation.scenario)
    (vectors,) = codec.observe([world])
    headed = robot_destinations(world)
    view = SetView(codec, vectors, headed, masks=False, flames=[world.flames])
    marks = view.spots[:, FIRST_MARK:]

    found = dict[int, dict[str, np.ndarray]]()
    for k, robot in enumerate(world.robots):
        if robot.floor in found or not robot.active:
            continue
        kinds = {
            KEEPING: view.spots[k, [KEEP]],
            STAYING: view.spots[k, [WAIT]],
            WAY_OUT: marks[k, view.of_outs],
            FOOT_OF_STAIRS: marks[k, view.of_feet],
            GUARDED: marks[k, view.of_rims],
            LOST: marks[k, view.of_rims.stop :],
        }
        there = {kind: _there(spots) for kind, spots in kinds.items()}
        found[robot.floor] = {kind: s for kind, s in there.items() if len(s)}
    return found


def ways_on_floor(building: Building, floor: int, spots: Iterable[Any]) -> np.ndarray:
    """Move points that mean ways out, and lie in a wall, to where they lead: (k, 2).

    That is a stairwell's middle or an exit. spots: as in `observed.way_marks`
    """
    ways = ways_out_of(building, floor)
    drawn = [
        spot if _is_walkable(building, floor, *spot) else way.middle
        for spot, way in zip(spots, ways, strict=True)
    ]
    return np.array(drawn).reshape(-1, 2)


def _is_walkable(building: Building, floor: int, x: float, y: float) -> bool:
    row, col = building.cell(x, y)
    rows, cols = building.walkable[floor].shape
    inside = 0 <= row < rows and 0 <= col < cols
    return inside and bool(building.walkable[floor, row, col])


def _there(spots: np.ndarray) -> np.ndarray:
    """Leave out anchors that are not there, which are nan."""
    return spots[~np.isnan(spots[:, 0])]


def _draw_anchors(axes: Axes, by_kind: dict[str, np.ndarray]) -> None:
    """Draw all anchors of a robot, and a line to where it is headed."""
    for kind, spots in by_kind.items():
        axes.plot(*spots.T, clip_on=False, **ANCHOR_LOOKS[kind])
    if KEEPING in by_kind:
        way = np.concatenate([by_kind[STAYING], by_kind[KEEPING]])
        axes.plot(*way.T, color=INK, lw=0.8, ls=(0, (4, 2)), zorder=4)


def _draw_people(simulation: Simulation, panels: dict[int, Axes]) -> None:
    """Draw everybody who walks; anchors at people lie upon them."""
    bodies = simulation.world.bodies
    for floor, axes in panels.items():
        here = bodies.walking & (bodies.floor == floor)
        axes.plot(*bodies.position[here].T, **ANCHOR_LOOKS[PERSON])
