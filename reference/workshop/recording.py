"""Record trajectories of an evacuation for other programs, one file per floor.

Clauses: A7, A8, B4, B7.  The format is JuPedSim's SQLite, version 2, which PedPy
loads. People on stairs are on no floor; robots, which hinder nobody, are left out. A
row of `trajectory_data`:

    frame          ticks since the beginning
    id             index of a human, the same on all floors
    pos_x, pos_y   metres, as everywhere [A8]
    ori_x, ori_y   unit vector last walked along; 0, 0 before the first step
    mode           0 follows, 1 leads [B4]
    leader         body followed, -1 for nobody; robots are numbered after people
    health         100 at the start, 0 for the dead [B7]

People who reach an exit, or an entrance of stairs down, get that position and one more,
a step on in the same cell: PedPy counts who crosses a line if a row follows.
"""

import sqlite3
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing, contextmanager
from pathlib import Path

import numpy as np

from reference.building import Building
from reference.simulation import Simulation
from reference.workshop.files import making_folder
from reference.workshop.runs import refuse_used
from reference.world import Bodies

FORMAT = """
CREATE TABLE metadata (key TEXT NOT NULL UNIQUE PRIMARY KEY, value TEXT NOT NULL);
CREATE TABLE geometry (hash INTEGER NOT NULL, wkt TEXT NOT NULL);
CREATE TABLE frame_data (frame INTEGER NOT NULL, geometry_hash INTEGER NOT NULL);
CREATE TABLE trajectory_data (
    frame INTEGER NOT NULL, id INTEGER NOT NULL,
    pos_x REAL NOT NULL, pos_y REAL NOT NULL, ori_x REAL NOT NULL, ori_y REAL NOT NULL,
    mode INTEGER NOT NULL, leader INTEGER NOT NULL, health REAL NOT NULL
);
CREATE INDEX frame_id_idx ON trajectory_data (frame, id);
"""
HAIR = 1e-6  # metres from a cell's edge


def ticks(
    simulations: Sequence[Simulation], notes: Sequence[Callable[[], None]] = ()
) -> Iterator[None]:
    """Run simulations side by side to their ends; pause at 0 s and after each tick.

    notes: called before each pause, such as what `recording` yields
    """
    running = True
    while running:
        for note in notes:
            note()
        yield
        running = False
        for simulation in simulations:
            if not simulation.done:
                simulation.step()
                running = True


def record(simulation: Simulation, folder: Path) -> None:
    """Run a simulation to its end and record it, as `recording` does."""
    with recording(simulation, folder) as note:
        for _ in ticks([simulation], [note]):
            pass


@contextmanager
def recording(simulation: Simulation, folder: Path) -> Iterator[Callable[[], None]]:
    """Yield what notes an instant; at the end write floor-1.sqlite, floor-2.sqlite, ...

    Call it at 0 s and after each tick. Writes all files or none. Raises RunError for a
    folder that is not empty, OSError for one that cannot be written.
    """
    refuse_used(folder, "Name another folder.")
    with making_folder(folder) as partial:
        frames, noted = _frames(simulation), list[np.ndarray]()
        yield lambda: noted.append(next(frames))
        rows = np.concatenate(noted)
        for floor in range(simulation.building.floors):
            content = _file(simulation, floor, rows[rows[:, 0] == floor, 1:])
            (partial / f"floor-{floor + 1}.sqlite").write_bytes(content)


def _frames(simulation: Simulation) -> Iterator[np.ndarray]:
    """Yield rows (k, 10), floor in the first column; each time asked, of the tick."""
    bodies = simulation.world.bodies
    position, heading = bodies.position.copy(), np.zeros_like(bodies.position)
    rows = _rows(bodies, np.flatnonzero(bodies.walking), 0, position, heading)
    while True:
        before, walked = position, np.flatnonzero(bodies.walking)
        yield rows
        position = bodies.position.copy()
        position[walked] = simulation.walked_to  # before stairs took anybody in
        step = position - before
        far = np.hypot(*step.T)[:, None]
        heading = np.where(far > 0, step / np.maximum(far, 1e-9), heading)
        here = np.union1d(walked, np.flatnonzero(bodies.walking))
        rows = _rows(bodies, here, simulation.ticks, position, heading)
        left = walked[~bodies.walking[walked] & (bodies.health[walked] > 0)]
        cell = np.floor(position)
        beyond = np.clip(position + step, cell + HAIR, cell + 1 - HAIR)
        more = _rows(bodies, left, simulation.ticks + 1, beyond, heading)
        rows = np.concatenate([rows, more])


def _rows(
    bodies: Bodies, who: np.ndarray, frame: int, position: np.ndarray, ori: np.ndarray
) -> np.ndarray:
    """Build rows (k, 10) of these people; position, ori: (n, 2) of everybody."""
    columns = position, ori, bodies.mode, bodies.leader, bodies.health
    first = bodies.floor[who], np.full(len(who), frame), who
    return np.column_stack([*first, *(column[who] for column in columns)])


def _file(simulation: Simulation, floor: int, rows: np.ndarray) -> bytes:
    """Make the content of one floor's file; rows: (k, 9) as in `trajectory_data`."""
    facts = [("version", "2"), ("fps", str(1 / simulation.tick))]
    area = 0, walkable_area(simulation.building, floor)
    frames = ((frame, 0) for frame in range(simulation.ticks + 2))
    with closing(sqlite3.connect(":memory:")) as file:
        file.executescript(FORMAT)
        file.executemany("INSERT INTO metadata VALUES (?, ?)", facts)
        file.execute("INSERT INTO geometry VALUES (?, ?)", area)
        file.executemany("INSERT INTO frame_data VALUES (?, ?)", frames)
        places = ", ".join("?" * rows.shape[1])
        insert = f"INSERT INTO trajectory_data VALUES ({places})"
        file.executemany(insert, rows.tolist())
        file.commit()
        return file.serialize()


def walkable_area(building: Building, floor: int) -> str:
    """Cover where bodies may stand, doors open: well-known text of rectangles [A7].

    One for each run of cells in a row; readers unite them.
    """
    top, left = building.origin
    free = np.pad(building.walkable[floor], ((0, 0), (1, 1))).astype(int)
    ends = np.argwhere(np.diff(free)).reshape(-1, 2, 2) - (top, left)
    boxes = []
    for (y, west), (_, east) in ends.tolist():
        corners = (west, -y - 1), (east, -y - 1), (east, -y), (west, -y), (west, -y - 1)
        boxes.append(f"POLYGON (({', '.join(f'{x} {y}' for x, y in corners)}))")
    return f"GEOMETRYCOLLECTION ({', '.join(boxes)})"
