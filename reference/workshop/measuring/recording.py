"""Record trajectories of an evacuation for other programs, one file per floor.

The format is JuPedSim's SQLite, version 2, which PedPy loads. Both want one connected
walkable area: a floor that walls divide becomes a file per part, northernmost first,
`floor-2-part-1.sqlite`. People on stairs are on no floor; robots, which hinder nobody,
are left out. A row of `trajectory_data`:

    frame          ticks since the beginning
    id             index of a human, the same in all files
    pos_x, pos_y   metres, as everywhere
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
from scipy import ndimage

from reference.building import Building, lengths
from reference.paper import InputError
from reference.simulation import Simulation
from reference.workshop.storage.files import replacing
from reference.workshop.storage.runs import refuse_used, remove_left_lock

SQL_TABLES = """
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
HAIR_METRES = 1e-6  # metres from a cell's edge
NOBODY_THERE = "nobody was ever there; PedPy refuses to load it"


def ticks(
    simulations: Sequence[Simulation], notes: Sequence[Callable[[], None]] = ()
) -> Iterator[None]:
    """Run simulations side by side to their ends; pause at 0 s and after each tick.

    notes: called before each pause, such as what `recording` yields
    """
    while True:
        for note in notes:
            note()
        yield
        going = [simulation for simulation in simulations if not simulation.done]
        if not going:
            return
        for simulation in going:
            simulation.step()


def record(simulation: Simulation, folder: str | Path) -> None:
    """Run a simulation to its end and record it, as `recording` does."""
    with recording(simulation, folder) as note:
        for _ in ticks([simulation], [note]):
            pass


@contextmanager
def recording(
    simulation: Simulation, folder: str | Path
) -> Iterator[Callable[[], None]]:
    """Yield what notes an instant; at the end write floor-1.sqlite, floor-2.sqlite, ...

    Call it at 0 s and after each tick. Writes all files or none. Raises InputError for
    a tick that was not noted and for a folder that is not empty, OSError for one that
    cannot be written.
    """
    folder = Path(folder)
    remove_left_lock(folder)
    refuse_used(folder, "Name another folder.")
    with replacing(folder) as partial:
        partial.mkdir(parents=True)
        recorder = _Recorder(simulation)
        yield recorder.note
        recorder.refuse_gap(simulation.ticks)
        rows = np.concatenate(recorder.rows)
        for floor in range(simulation.building.floors):
            of_floor = rows[rows[:, 0] == floor, 1:]
            for name, part in parts_of(simulation.building, floor).items():
                content = _file(simulation, part, of_floor)
                (partial / f"{name}.sqlite").write_bytes(content)


def remarks(folder: Path) -> list[str]:
    """Say what to know of a recording's files: parts of a floor, and empty ones."""
    told = []
    files = sorted(folder.glob("*.sqlite"))
    divided = [file.name for file in files if "-part-" in file.name]
    if divided:
        told.append(f"walls divide a floor: a file for each part, {', '.join(divided)}")
    for file in files:
        with closing(sqlite3.connect(file)) as content:
            someone = content.execute("SELECT 1 FROM trajectory_data LIMIT 1")
            if someone.fetchone() is None:
                told.append(f"{file.name}: {NOBODY_THERE}")
    return told


class _Recorder:
    """Collects rows (k, 10) of all instants noted, floor in the first column."""

    def __init__(self, simulation: Simulation) -> None:
        self.simulation = simulation
        self.rows: list[np.ndarray] = []
        self.noted = simulation.ticks - 1  # the last tick
        self.position = simulation.world.bodies.position.copy()
        self.heading = np.zeros_like(self.position)
        self.walked = np.empty(0, int)  # who walked in the tick to come

    def note(self) -> None:
        """Note who walks, or walked until now; one step more for those who left."""
        bodies = self.simulation.world.bodies
        tick = self.simulation.ticks
        if tick == self.noted:  # it is over, and others beside it are not
            return
        self.refuse_gap(tick - 1)
        self.noted = tick
        position = bodies.position.copy()
        if len(self.walked):  # none before the first tick that is recorded
            # before stairs took any in
            position[self.walked] = self.simulation.walked_to
        step = position - self.position
        far = lengths(step)
        turned = np.zeros(len(step), bool)
        turned[self.walked] = far[self.walked] > 0  # not who came out of stairs
        self.heading[turned] = step[turned] / far[turned, None]
        walking = np.flatnonzero(bodies.walking)
        self._add(np.union1d(self.walked, walking), tick, position)

        # who has left goes on a step, within the cell
        left = np.flatnonzero(~bodies.walking & (bodies.health > 0))
        cell = np.floor(position)
        beyond = np.clip(position + step, cell + HAIR_METRES, cell + 1 - HAIR_METRES)
        self._add(np.intersect1d(self.walked, left), tick + 1, beyond)

        self.position = position
        self.walked = walking

    def refuse_gap(self, tick: int) -> None:
        """Raise InputError unless all has been noted up to a tick."""
        if self.noted != tick:
            raise InputError(
                "a recording lacks some instants: call what `recording` yields at 0 s "
                "and after each tick"
            )

    def _add(self, who: np.ndarray, frame: int, position: np.ndarray) -> None:
        """Add rows of these people; position: (n, 2) of everybody."""
        bodies = self.simulation.world.bodies
        columns = [
            bodies.floor[who],
            np.full(len(who), frame),
            who,
            position[who],
            self.heading[who],
            bodies.mode[who],
            bodies.leader[who],
            bodies.health[who],
        ]
        self.rows.append(np.column_stack(columns))


def _file(simulation: Simulation, part: np.ndarray, rows: np.ndarray) -> bytes:
    """Make the content of one part's file.

    part: (rows, cols) bool, its cells
    rows: (k, 9) as in `trajectory_data`, of the whole floor
    """
    building = simulation.building
    ground = np.zeros(len(rows), dtype=int)
    places = simulation.navigation.places_at(ground, rows[:, 2:4])
    inside = rows[part.ravel()[places]]
    metadata = [("version", "2"), ("fps", str(1 / simulation.tick))]
    metadata += [(name, str(metres)) for name, metres in _bounds(building, part)]
    area = (0, well_known_text(building, part))
    frames = ((frame, 0) for frame in range(simulation.ticks + 2))
    marks = ", ".join("?" * rows.shape[1])
    with closing(sqlite3.connect(":memory:")) as file:
        file.executescript(SQL_TABLES)
        file.executemany("INSERT INTO metadata VALUES (?, ?)", metadata)
        file.execute("INSERT INTO geometry VALUES (?, ?)", area)
        file.executemany("INSERT INTO frame_data VALUES (?, ?)", frames)
        file.executemany(f"INSERT INTO trajectory_data VALUES ({marks})", inside)
        file.commit()
        return file.serialize()


def parts_of(building: Building, floor: int) -> dict[str, np.ndarray]:
    """Find what of a floor hangs together, doors open [A7].

    Returns (rows, cols) bool of each part, by the name of its file.
    """
    labels, count = ndimage.label(building.walkable[floor])  # cells that share a side
    name = f"floor-{floor + 1}"
    if count == 1:
        return {name: building.walkable[floor]}
    return {f"{name}-part-{k}": labels == k for k in range(1, count + 1)}


def _bounds(building: Building, part: np.ndarray) -> list[tuple[str, int]]:
    """Find the metres within which a part lies, by JuPedSim's names for them."""
    row, col = np.nonzero(part)
    up, left = building.origin
    return [
        ("xmin", int(col.min() - left)),
        ("xmax", int(col.max() + 1 - left)),
        ("ymin", int(up - row.max() - 1)),
        ("ymax", int(up - row.min())),
    ]


def well_known_text(building: Building, part: np.ndarray) -> str:
    """Cover where bodies may stand: well-known text of rectangles [A7].

    part: (rows, cols) bool.  One rectangle for each run of cells in a row; readers
    unite them.
    """
    free = np.pad(part, ((0, 0), (1, 1))).astype(int)
    ends = np.argwhere(np.diff(free)).reshape(-1, 2, 2) - building.origin
    boxes = []
    for (row, west), (_, east) in ends.tolist():
        south = -row - 1
        north = -row
        boxes.append(
            f"POLYGON (({west} {south}, {east} {south}, {east} {north}, "
            f"{west} {north}, {west} {south}))"
        )
    return f"GEOMETRYCOLLECTION ({', '.join(boxes)})"
