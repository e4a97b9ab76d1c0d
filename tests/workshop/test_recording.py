"""Recordings: what stands in them, and what PedPy measures in them."""

import gc
import sqlite3
import warnings
from collections import Counter
from contextlib import closing
from errno import ENOSPC

import numpy as np
import pytest

from reference.__main__ import main
from reference.building import Kind
from reference.fire import RandomFire
from reference.paper import InputError, Scenario
from reference.simulation import Simulation
from reference.workshop.maps import load
from reference.workshop.measuring import recording
from reference.workshop.measuring.recording import record
from reference.workshop.strategies.guides import Sweep
from reference.world import Died, LeftFloor

NO_PEDPY = "PedPy is not installed: pip install -e '.[pedpy]'"
NO_JUPEDSIM = "JuPedSim is not installed: pip install -e '.[others]'"
BOUNDS = ("xmin", "xmax", "ymin", "ymax")
COLUMNS = ["frame", "id", "pos_x", "pos_y", "ori_x", "ori_y", "mode", "leader"]


def begun():
    """A crowd on two floors, robots and a fire; some come to harm."""
    scenario = Scenario(people=40, time_limit=90)
    return Simulation(load("tiny"), scenario, Sweep(), RandomFire(), seed=1)


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """The folder of a recording, empty before, and the simulation that it shows."""
    folder = tmp_path_factory.mktemp("recording")
    run = begun()
    record(run, folder)
    return folder, run


def asked(folder, floor, question):
    """The rows that answer a question to the file of a floor, 0 is the first."""
    with closing(sqlite3.connect(folder / f"floor-{floor + 1}.sqlite")) as file:
        return file.execute(question).fetchall()


def rows(folder, floor):
    """All rows of one floor by (frame, id)."""
    found = asked(folder, floor, "SELECT * FROM trajectory_data")
    return {row[:2]: row[2:] for row in found}


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
    west, east, south, north = (float(facts[name]) for name in BOUNDS)
    first = run.building.cell(west + 0.5, north - 0.5)
    last = run.building.cell(east - 0.5, south + 0.5)
    free = np.argwhere(run.building.walkable[0])
    assert [first, last] == [tuple(free.min(axis=0)), tuple(free.max(axis=0))]
    ((key, text),) = asked(folder, 0, "SELECT hash, wkt FROM geometry")
    assert text.startswith("GEOMETRYCOLLECTION (POLYGON ((")
    frames = asked(folder, 0, "SELECT * FROM frame_data")
    assert frames == [(frame, key) for frame in range(run.ticks + 2)]


def test_a_run_that_has_begun_is_recorded_from_there_on(tmp_path):
    """As `animate` films it."""
    run = begun()
    for _ in range(10):
        run.step()
    record(run, tmp_path / "rest")
    found = rows(tmp_path / "rest", 0)
    assert min(frame for frame, _ in found) == 10


def test_a_recording_shows_everybody_who_walks_in_every_tick(recorded):
    """As the same run without one; nobody on stairs, but who goes a moment longer."""
    folder, watched = recorded
    run = begun()
    floors = [rows(folder, floor) for floor in (0, 1)]
    shown = 0
    bodies = run.world.bodies
    while True:
        for i in np.flatnonzero(bodies.walking).tolist():
            x, y, _, _, *mind = floors[bodies.floor[i]][run.ticks, i]
            assert (x, y) == tuple(bodies.position[i])
            assert mind == [bodies.mode[i], bodies.leader[i], bodies.health[i]]
            shown += 1
        if run.done:
            break
        run.step()
    assert run.outcome() == watched.outcome()
    gone = Counter(type(event) for event in run.events)
    assert sum(map(len, floors)) == shown + 2 * gone[LeftFloor] + gone[Died]


def test_the_last_two_rows_of_who_leaves_are_in_the_exit_or_entrance(recorded):
    """Nobody jumps there or on: no row is farther from the one before than a step."""
    folder, run = recorded
    ways = set()
    steps = []
    for event in run.events:
        if isinstance(event, LeftFloor):
            found = rows(folder, event.floor)
            frame = round(event.time / run.tick)
            last = [found[frame + k, event.person][:2] for k in (-1, 0, 1)]
            cells = [run.building.cell(*place) for place in last[1:]]
            ways |= {run.building.kind[event.floor, *cell] for cell in cells}
            steps += np.hypot(*np.diff(last, axis=0).T).tolist()
    assert ways == {Kind.EXIT, Kind.ENTRANCE}
    assert max(steps) <= 2 * run.world.bodies.pace.max() * run.tick


def test_people_look_where_they_walk(recorded):
    """Along the last step; at first nowhere.

    Who has left keeps the orientation, and who comes down stairs.
    """
    found = rows(recorded[0], 0)
    above = {i: row for (_, i), row in sorted(rows(recorded[0], 1).items())}  # the last
    came_down = 0
    for (frame, i), (x, y, *heading, _, _, _) in found.items():
        if frame == 0:
            assert heading == [0, 0]
        elif (before := found.get((frame - 1, i))) is not None:
            step = np.subtract((x, y), before[:2])
            ahead = step / np.hypot(*step) if step.any() else before[2:4]
            kept = (frame + 1, i) not in found and heading == list(before[2:4])
            assert kept or heading == pytest.approx(ahead, abs=1e-6)
        else:
            assert heading == list(above[i][2:4])
            came_down += 1
    assert came_down


# -- With PedPy ---------------------------------------------------------------------


def loaded(folder, floor):
    """Trajectories and walkable area of a floor, as PedPy reads them."""
    return read_by_pedpy(folder / f"floor-{floor + 1}.sqlite")


def read_by_pedpy(path):
    """Trajectories and walkable area of a file, as PedPy reads them."""
    pedpy = pytest.importorskip("pedpy", reason=NO_PEDPY)
    file = {"trajectory_file": path}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ResourceWarning)
        trajectories = pedpy.load_trajectory_from_jupedsim_sqlite(**file)
        area = pedpy.load_walkable_area_from_jupedsim_sqlite(**file)
        gc.collect()  # PedPy leaves its connections open: since Python 3.13 it is told
    return trajectories, area


def threshold(building, mark):
    """Both ends of the line where the floor ends and a way out begins, metres.

    They reach a little into the walls: a straight step may cut a corner.
    """
    kind = np.pad(building.kind[mark.floor], 1)
    for step in np.array([(1, 0), (-1, 0), (0, 1), (0, -1)]):
        if (kind[*(mark.cells + step + 1).T] == Kind.FLOOR).all():
            along = (mark.width / 2 + 0.3) * step[::-1]
            middle = mark.cells.mean(axis=0) + step / 2
            return [building.metres(*(middle + end)) for end in (along, -along)]


@pytest.mark.paper("A7")
@pytest.mark.extra
@pytest.mark.parametrize("floor", [0, 1])
def test_pedpy_finds_nobody_outside_the_walls(floor, recorded):
    """In any frame; the area is that of the cells one can stand in."""
    folder, run = recorded
    trajectories, area = loaded(folder, floor)
    assert trajectories.frame_rate == 1 / run.tick
    assert area.area == run.building.walkable[floor].sum()
    assert trajectories.data.point.map(area.polygon.covers).all()


@pytest.mark.extra
def test_pedpy_counts_everybody_who_left_on_a_line_just_before_the_way_out(recorded):
    """By each exit and each entrance of stairs down: N of N-t is that of the events."""
    pedpy = pytest.importorskip("pedpy", reason=NO_PEDPY)
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
        trajectories, _ = loaded(folder, mark.floor)
        line = pedpy.MeasurementLine(threshold(run.building, mark))
        n_t, _ = pedpy.compute_n_t(traj_data=trajectories, measurement_line=line)
        assert n_t.cumulative_pedestrians.max() == people


# -- With JuPedSim ------------------------------------------------------------------


@pytest.mark.extra
@pytest.mark.parametrize("floor", [0, 1])
def test_jupedsim_reads_all_that_its_reader_can_tell(floor, recorded):
    """Each public method of `jupedsim.Recording`; a new one fails here until asked."""
    jupedsim = pytest.importorskip("jupedsim", reason=NO_JUPEDSIM)
    folder, run = recorded
    reader = jupedsim.Recording(str(folder / f"floor-{floor + 1}.sqlite"))
    with closing(reader.db):
        asked_for = {"bounds", "fps", "frame", "geometry", "num_frames"}
        asked_for |= {"geometry_id_for_frame", "db"}
        assert {name for name in dir(reader) if not name.startswith("_")} == asked_for
        assert (reader.num_frames, reader.fps) == (run.ticks + 2, 1 / run.tick)
        area = reader.geometry()
        assert area.area == run.building.walkable[floor].sum()
        assert reader.geometry_id_for_frame(run.ticks) == 0
        box = reader.bounds()
        assert (box.xmin, box.ymin, box.xmax, box.ymax) == area.bounds

        found = rows(folder, floor)
        frame = next(frame for frame, _ in found)
        shown = {
            (frame, agent.id): (*agent.position, *agent.orientation)
            for agent in reader.frame(frame).agents
        }
        assert shown == {key: row[:4] for key, row in found.items() if key[0] == frame}


# -- Floors that walls divide, and empty ones ---------------------------------------

TOWERS = """building: Two stair towers
size: 25 x 6
floor 1: ground
#########################
#AA#........#........#BB#
#AA+........+........+BB#
####........#........####
#...........#...........#
######EE#########EE######
floor 2: upstairs
#########################
#AA#........#........#BB#
#AA+........#........+BB#
####........#........####
#...........#...........#
#########################
"""


@pytest.fixture(scope="module")
def towers(tmp_path_factory):
    """The folder of a recording in which the upper floor has two parts."""
    folder = tmp_path_factory.mktemp("towers")
    run = Simulation(load(TOWERS), Scenario(people=8, time_limit=40), seed=1)
    record(run, folder)
    return folder, run


def test_a_floor_that_walls_divide_becomes_a_file_for_each_part(towers):
    """Everybody stands in the file of their part, and nobody in two."""
    folder, _ = towers
    assert sorted(path.stem for path in folder.iterdir()) == [
        "floor-1",
        "floor-2-part-1",
        "floor-2-part-2",
    ]
    started = {}
    for path in folder.iterdir():
        with closing(sqlite3.connect(path)) as file:
            first = "SELECT id, pos_x FROM trajectory_data WHERE frame = 0"
            bounds = dict(file.execute("SELECT * FROM metadata").fetchall())
            for person, x in file.execute(first):
                assert person not in started
                assert float(bounds["xmin"]) <= x <= float(bounds["xmax"])
                started[person] = path.stem
    assert sorted(started) == list(range(8)) and len(set(started.values())) == 3


@pytest.mark.extra
def test_pedpy_and_jupedsim_take_each_part_of_a_floor(towers):
    """Where one file for the whole floor is refused."""
    folder, run = towers
    areas = [read_by_pedpy(path)[1].area for path in folder.iterdir()]
    assert sum(areas) == run.building.walkable.sum()


def test_the_command_says_where_a_floor_has_parts_and_where_nobody_ever_was(
    tmp_path, capsys
):
    """At its end, beside what is written."""
    plan = tmp_path / "towers.txt"
    plan.write_text(TOWERS)
    told = ["evacuate", "--building", str(plan), "--robots", "none", "--fire", "none"]
    told += ["--scenario", "people_per_floor=1,0", "time_limit=2"]
    assert main([*told, "--record", str(tmp_path / "new")]) == 0
    notes = capsys.readouterr().err
    assert "a file for each part, floor-2-part-1.sqlite, floor-2-part-2.sqlite" in notes
    for part in (1, 2):
        assert f"floor-2-part-{part}.sqlite: nobody was ever there" in notes
    assert "floor-1.sqlite:" not in notes


# -- The folder ---------------------------------------------------------------------


def test_refuses_a_folder_with_something_in_it(tmp_path, capsys):
    """Before any work; what is in it stays as it was."""
    (tmp_path / "notes.txt").write_text("mine")
    file = tmp_path / "notes.txt"
    for path, hint in ((tmp_path, "not empty. Name"), (file, "Not a directory")):
        assert main(["evacuate", "--building", "tiny", "--record", str(path)]) == 1
        out, told = capsys.readouterr()
        assert out == "" and hint in told
    assert [path.read_text() for path in tmp_path.iterdir()] == ["mine"]


def test_what_came_is_told_though_it_cannot_be_recorded(tmp_path, capsys, monkeypatch):
    """As with a film: the figures are there, then why the recording is not."""

    def full(*_):
        raise OSError(ENOSPC, "No space left on device", "rows")

    monkeypatch.setattr(recording, "_file", full)
    told = ["evacuate", "--building", "tiny", "--people", "2"]
    assert main([*told, "--record", str(tmp_path / "rows")]) == 1
    out, why = capsys.readouterr()
    assert "person seconds" in out and "rows: cannot be written" in why
    assert list(tmp_path.iterdir()) == []


def test_a_folder_that_holds_only_a_lock_that_was_left_is_empty(tmp_path):
    """Its run was killed; to record into it must not fail after the evacuation."""
    folder = tmp_path / "left"
    folder.mkdir()
    (folder / ".lock").touch()
    record(Simulation(load("tiny"), Scenario(people=2, time_limit=1)), folder)
    files = sorted(path.name for path in folder.iterdir())
    assert files == ["floor-1.sqlite", "floor-2.sqlite"]


def test_refuses_a_recording_in_which_a_tick_is_missing(tmp_path):
    """Nothing noted, not every tick, or not the last ones; nothing is written."""

    def seldom(run, note):
        while not run.done:
            note()
            for _ in range(run.decision_ticks):
                run.step()

    def at_first(run, note):
        note()
        run.run()

    for go in (lambda run, _: run.run(), seldom, at_first, lambda *_: None):
        run = Simulation(load("tiny"), Scenario(people=2, time_limit=10))
        missing = pytest.raises(InputError, match="at 0 s and after each tick")
        with missing, recording.recording(run, tmp_path / "gaps") as note:
            go(run, note)
    assert list(tmp_path.iterdir()) == []


def test_a_folder_may_be_named_by_a_word_and_an_instant_be_noted_twice(tmp_path):
    """A run that is over waits for others beside it: nobody is there twice."""
    one, other = (
        Simulation(load("tiny"), Scenario(people=2, time_limit=10)) for _ in range(2)
    )
    record(one, str(tmp_path / "once"))
    with recording.recording(other, str(tmp_path / "twice")) as note:
        for _ in recording.ticks([other], [note, note]):
            pass
    count = "SELECT frame, id FROM trajectory_data ORDER BY frame, id"
    assert asked(tmp_path / "once", 0, count) == asked(tmp_path / "twice", 0, count)


class Interrupted(RandomFire):
    """A fire that is stopped by Ctrl-C."""

    def decide(self, world, rng):
        """Stop everything."""
        raise KeyboardInterrupt


def test_a_recording_that_is_stopped_leaves_nothing(tmp_path):
    """Whatever stops it: an empty folder is as it was, a new one is not made."""
    (tmp_path / "empty").mkdir()
    for name in ("new", "empty"):
        run = Simulation(load("tiny"), Scenario(people=3), fire=Interrupted())
        with pytest.raises(KeyboardInterrupt):
            record(run, tmp_path / name)
    assert list(tmp_path.rglob("*")) == [tmp_path / "empty"]
