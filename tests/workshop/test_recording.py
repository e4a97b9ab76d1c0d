"""Recordings: what stands in them, and what PedPy measures in them."""

import sqlite3
from collections import Counter
from contextlib import closing

import numpy as np
import pytest

from reference.__main__ import main
from reference.building import Kind
from reference.events import Died, LeftFloor
from reference.paper import Scenario
from reference.simulation import Simulation
from reference.strategies import RandomFire
from reference.workshop.maps import load
from reference.workshop.recording import record
from reference.workshop.strategies.robots import Sweep

NO_PEDPY = "PedPy is not installed: pip install -e '.[pedpy]'"
COLUMNS = ["frame", "id", "pos_x", "pos_y", "ori_x", "ori_y", "mode", "leader"]


def begun():
    """A crowd on two floors, robots and a fire; some come to harm."""
    scenario = Scenario(people=40, time_limit=90)
    return Simulation(load("tiny"), scenario, Sweep(), RandomFire(), seed=1)


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """The folder of a recording, and the simulation that it shows."""
    folder, run = tmp_path_factory.mktemp("made") / "recording", begun()
    record(run, folder)
    return folder, run


@pytest.fixture
def pedpy():
    """The library, or no test."""
    return pytest.importorskip("pedpy", reason=NO_PEDPY)


@pytest.fixture
def shapely():
    """The library, or no test; it comes with PedPy."""
    return pytest.importorskip("shapely", reason=NO_PEDPY)


def asked(folder, floor, question):
    """The rows that answer a question to the file of a floor, 0 is the first."""
    with closing(sqlite3.connect(folder / f"floor-{floor + 1}.sqlite")) as file:
        return file.execute(question).fetchall()


def rows(folder, floor):
    """All rows of one floor by (frame, id)."""
    found = asked(folder, floor, "SELECT * FROM trajectory_data")
    return {row[:2]: row[2:] for row in found}


def kind_at(building, floor, x, y):
    """What a cell around a point is."""
    return building.kind[floor, *building.cell(x, y)]


# -- With nothing but sqlite3 -------------------------------------------------------


def test_a_file_is_what_jupedsim_writes_in_version_2_and_more(recorded):
    """Tables, columns and keys that its readers ask for; mode, leader and health."""
    folder, run = recorded
    assert sorted(path.name for path in folder.iterdir()) == [
        "floor-1.sqlite",
        "floor-2.sqlite",
    ]
    table = asked(folder, 0, "SELECT name FROM pragma_table_info('trajectory_data')")
    assert [name for (name,) in table] == [*COLUMNS, "health"]
    facts = dict(asked(folder, 0, "SELECT * FROM metadata"))
    assert (facts["version"], float(facts["fps"])) == ("2", 1 / run.tick)
    ((key, text),) = asked(folder, 0, "SELECT hash, wkt FROM geometry")
    assert text.startswith("GEOMETRYCOLLECTION (POLYGON ((")
    frames = asked(folder, 0, "SELECT * FROM frame_data")
    assert frames == [(frame, key) for frame in range(run.ticks + 2)]


def test_a_recording_shows_everybody_who_walks_in_every_tick(recorded):
    """As the same run shows them without a recording; who is on stairs is on no floor.

    In the tick in which somebody dies there is a last row, in that in which somebody
    leaves a floor and the next one too.
    """
    folder, watched = recorded
    run, floors = begun(), [rows(folder, floor) for floor in (0, 1)]
    bodies, gone, going = run.world.bodies, set(), set()
    for _ in range(round(run.scenario.time_limit / run.tick) + 1):
        for floor, found in enumerate(floors):
            here = np.flatnonzero(bodies.walking & (bodies.floor == floor)).tolist()
            in_frame = {i for frame, i in found if frame == run.ticks}
            assert set(here) <= in_frame <= set(here) | gone | going
            for i in here:
                x, y, _, _, mode, leader, health = found[run.ticks, i]
                assert (x, y) == tuple(bodies.position[i])
                now = bodies.mode[i], bodies.leader[i], bodies.health[i]
                assert (mode, leader, health) == now
        if run.done:
            break
        events = [e for e in run.step() if isinstance(e, LeftFloor | Died)]
        gone, going = going, {event.person for event in events}
    assert run.outcome() == watched.outcome()


def test_the_last_two_rows_of_who_leaves_are_in_the_exit_or_entrance(recorded):
    """Nobody jumps there or on: no row is farther from the one before than a step."""
    folder, run = recorded
    ways, steps = set(), []
    for event in run.events:
        if isinstance(event, LeftFloor):
            found, frame = rows(folder, event.floor), round(event.time / run.tick)
            last = [found[frame + k, event.person][:2] for k in (-1, 0, 1)]
            ways |= {kind_at(run.building, event.floor, *place) for place in last[1:]}
            steps += np.hypot(*np.diff(last, axis=0).T).tolist()
            assert (frame + 2, event.person) not in found
    assert ways == {Kind.EXIT, Kind.ENTRANCE}
    assert max(steps) <= 2 * run.world.bodies.pace.max() * run.tick


def test_people_look_where_they_walk(recorded):
    """The orientation is a unit vector along the last step; at first there is none."""
    folder, _ = recorded
    found = rows(folder, 0)
    for (frame, i), (x, y, *heading, _, _, _) in found.items():
        if frame == 0:
            assert heading == [0, 0]
        elif (before := found.get((frame - 1, i))) is not None:
            step = np.subtract((x, y), before[:2])
            if step.any():
                assert heading == pytest.approx(step / np.hypot(*step), abs=1e-6)
            else:
                assert heading == list(before[2:4])


# -- With PedPy ---------------------------------------------------------------------


def loaded(pedpy, folder, floor):
    """Trajectories and walkable area of a floor."""
    file = {"trajectory_file": folder / f"floor-{floor + 1}.sqlite"}
    trajectories = pedpy.load_trajectory_from_jupedsim_sqlite(**file)
    return trajectories, pedpy.load_walkable_area_from_jupedsim_sqlite(**file)


def threshold(building, mark):
    """Both ends of the line where the floor ends and a way out begins, metres.

    They reach a little into the walls: a straight step may cut a corner.
    """
    floor, ends = np.argwhere(building.kind[mark.floor] == Kind.FLOOR).tolist(), []
    for row, col in mark.cells.tolist():
        x, y = building.metres(row, col)
        for right, up in ((1, 0), (-1, 0), (0, 1), (0, -1)):
            if [row - up, col + right] in floor:
                middle = np.array((x + right / 2, y + up / 2))
                aside = 0.8 * np.array((abs(up), abs(right)))
                ends += [tuple(middle - aside), tuple(middle + aside)]
    return min(ends), max(ends)


@pytest.mark.paper("A7")
@pytest.mark.extra
def test_pedpy_finds_nobody_outside_the_walls(recorded, pedpy, shapely):
    """In any frame on any floor; the area is that of the cells one can stand in."""
    folder, run = recorded
    for floor in (0, 1):
        trajectories, area = loaded(pedpy, folder, floor)
        assert trajectories.frame_rate == 1 / run.tick
        cells = np.argwhere(run.building.walkable[floor]).tolist()
        middles = np.array([run.building.metres(*cell) for cell in cells])
        assert area.area == len(cells)
        assert shapely.contains_xy(area.polygon, middles).all()
        assert shapely.covers(area.polygon, trajectories.data.point).all()


@pytest.mark.extra
def test_pedpy_counts_everybody_who_left_on_a_line_just_before_the_way_out(
    recorded, pedpy
):
    """By each exit and each entrance of stairs down: N of N-t is that of the events."""
    folder, run = recorded
    left = Counter()
    for event in run.events:
        if isinstance(event, LeftFloor):
            frame = round(event.time / run.tick)
            x, y, *_ = rows(folder, event.floor)[frame, event.person]
            cell = run.building.cell(x, y)
            left[int(run.building.landmark[event.floor, *cell])] += 1
    assert len(left) >= 2
    for index, people in left.items():
        mark = run.building.landmarks[index]
        trajectories, _ = loaded(pedpy, folder, mark.floor)
        line = pedpy.MeasurementLine(threshold(run.building, mark))
        n_t, _ = pedpy.compute_n_t(traj_data=trajectories, measurement_line=line)
        assert n_t.cumulative_pedestrians.max() == people


# -- The folder ---------------------------------------------------------------------


def test_refuses_a_folder_with_something_in_it(tmp_path, capsys):
    """Before any work; what is in it stays as it was."""
    (tmp_path / "notes.txt").write_text("mine")
    for path, hint in ((tmp_path, "is not empty"), (tmp_path / "notes.txt", "a file")):
        assert main(["evacuate", "--building", "tiny", "--record", str(path)]) == 1
        out, told = capsys.readouterr()
        assert out == ""
        assert hint in told
        assert "Name a" in told
        assert "--resume" not in told
    assert [path.read_text() for path in tmp_path.iterdir()] == ["mine"]


def test_a_recording_that_is_stopped_leaves_nothing(tmp_path):
    """Whatever stops it: an empty folder is as it was, a new one is not made."""
    (tmp_path / "empty").mkdir()

    class Interrupted(RandomFire):
        def decide(self, world, rng):
            raise KeyboardInterrupt

    for name in ("new", "empty"):
        run = Simulation(load("tiny"), Scenario(people=3), fire=Interrupted())
        with pytest.raises(KeyboardInterrupt):
            record(run, tmp_path / name)
    assert [path.name for path in tmp_path.iterdir()] == ["empty"]
    assert list((tmp_path / "empty").iterdir()) == []


def test_a_recording_takes_the_place_of_an_empty_folder(tmp_path):
    """The same run is the same files."""
    for name in ("one", "other"):
        (tmp_path / name).mkdir()
        record(Simulation(load("tiny"), Scenario(people=3), seed=2), tmp_path / name)
    one, other = ((tmp_path / name).iterdir() for name in ("one", "other"))
    assert sorted(p.read_bytes() for p in one) == sorted(p.read_bytes() for p in other)
