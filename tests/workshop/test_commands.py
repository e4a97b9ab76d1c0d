"""The commands: what they print, where, and with which exit status they end."""

import json
import os
import re
import signal
import subprocess
import sys
import time
from argparse import Namespace
from concurrent.futures import BrokenExecutor, Future
from dataclasses import replace
from importlib.util import find_spec
from inspect import getdoc
from pathlib import Path
from subprocess import PIPE

import numpy as np
import pytest
from conftest import ROOT
from matplotlib import pyplot
from matplotlib.backends.backend_agg import FigureCanvasAgg
from processes import ended, python
from refusals import refusal
from trainings import room_for

from reference.__main__ import COMMANDS, main
from reference.paper import InputError
from reference.simulation import Simulation
from reference.workshop.commands import evacuation
from reference.workshop.commands.common import (
    format_figure,
    format_table,
    run_in_folder,
)
from reference.workshop.commands.options import CORES, LEAST_PEOPLE, MOST_PEOPLE
from reference.workshop.comparing.matches import begin_evaluation
from reference.workshop.comparing.named import PLAYER_NAMES
from reference.workshop.engine import run_to_end
from reference.workshop.maps.generated import generated_text
from reference.workshop.measuring import bench
from reference.workshop.storage.files import (
    refuse_unwritable,
    replacing,
    write_whole,
)
from reference.workshop.storage.workers import InProcess
from reference.workshop.strategies.fires import BusiestFire
from reference.workshop.strategies.guides import Escort
from reference.world import Evacuated

pytestmark = pytest.mark.usefixtures("in_an_empty_folder")

SHED = """\
building: Shed
size: 9 x 5

floor 1:
#########
#...#...#
#...+...E
#...#...#
#########
"""

PROMISED = """building robots fire seed episodes people evacuated died inside
mean_health reward simulated_seconds person_seconds runs"""


@pytest.mark.parametrize(
    ("asked", "ended", "told"),
    [
        (CORES, KeyboardInterrupt, ""),
        (CORES + 6, KeyboardInterrupt, f"--workers {CORES + 6} "),
        (CORES + 6, BrokenExecutor, f"--workers {CORES // 2 + 3} "),
    ],
)
def test_how_to_go_on_tells_how_many_workers(asked, ended, told):
    """As many as were asked for; half as many where one has died: it would again."""
    arguments = Namespace(workers=asked, resume=False)
    how = re.escape(f"python -m reference train {told}--resume --out run")
    with (
        pytest.raises((InputError, KeyboardInterrupt), match=f"Go on with:\n  {how}$"),
        run_in_folder(arguments, Path("run"), list, "train"),
    ):
        Path("run/checkpoint").touch()
        raise ended


@pytest.fixture
def shed(tmp_path):
    """The path of a small map: two rooms, a door, an exit."""
    path = tmp_path / "shed.txt"
    path.write_text(SHED)
    return str(path)


# -- check --------------------------------------------------------------------------


def test_check_counts_what_is_in_a_map_that_is_fine(shed, capsys):
    """One line, which begins with ok, and what to try next; for programs an object."""
    assert main(["check", shed]) == 0
    line = "ok: Shed, floors 1, rooms [2], doors 1, exits 1, stairwells 0\n"
    assert capsys.readouterr() == (line, f"next: python -m reference draw {shed}\n")
    assert main(["check", shed, "--json"]) == 0
    facts = json.loads(capsys.readouterr().out)
    assert (facts["title"], facts["rooms"], facts["exits"]) == ("Shed", [2], 1)
    assert facts["file"] == shed


CORNER = """building: Corner
size: 9 x 7
floor 1:
#########
E.one+..#
#....#..#
#####...#
#....####
#two....E
#########
"""


def test_check_notes_each_two_rooms_that_touch_at_a_corner(
    tmp_path, monkeypatch, capsys
):
    """Where, once: people see through and cannot pass, no mistake, but rarely meant."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "corner.txt").write_text(CORNER)
    assert main(["check", "corner.txt"]) == 0
    what = (
        "two rooms touch at this corner; nobody passes there. Draw a wall, or a door."
    )
    assert capsys.readouterr().err.splitlines()[:-1] == [
        f"note: corner.txt:6:5: {what}",
        f"note: corner.txt:7:6: {what}",
    ]


def test_check_notes_a_row_a_little_shorter_than_those_beside_it(shed, capsys):
    """A sign left out shifts what is behind it; with one too many it is a mistake."""
    Path(shed).write_text(SHED.replace("#...#...#", "#..#...#", 1))
    assert main(["check", shed]) == 0
    assert capsys.readouterr().err.splitlines()[0] == (
        f"note: {shed}:6:8: this row has 8 columns, those above and below 9: "
        "is a sign missing?"
    )


# -- floors -------------------------------------------------------------------------


def test_floors_lists_the_maps_that_ship_or_prints_one(capsys, tmp_path):
    """By the names that other commands know; what it prints, saved, is a map."""
    assert main(["floors"]) == 0
    listed = capsys.readouterr().out.splitlines()
    assert "tiny      Tiny office, floors 2" in listed
    names = {path.stem for path in (ROOT / "floors").glob("*.txt")}
    assert {line.split()[0] for line in listed} == names
    assert main(["floors", "museum"]) == 0
    (tmp_path / "mine.txt").write_text(capsys.readouterr().out)
    assert main(["check", "mine.txt"]) == 0


def test_floors_draws_a_new_building_that_check_passes(capsys, tmp_path):
    """The same for the same seed; its first note is the command that draws it."""
    command = "floors --new --seed 5 --size 15x10 --floors 2"
    assert main(command.split()) == 0
    drawn = capsys.readouterr().out
    assert drawn == generated_text(5, 15, 10, 2)
    assert drawn.splitlines()[1] == f"; python -m reference {command}"
    (tmp_path / "new.txt").write_text(drawn)
    assert main(["check", "new.txt"]) == 0
    assert main(["floors", "--new"]) == 0
    assert "--seed 0 --size 40x40 --floors 3" in capsys.readouterr().out


def test_check_watches_a_map_until_ctrl_c(shed, tmp_path, capsys, monkeypatch):
    """At every save it says again what is wrong, or that the map is fine."""
    left = [SHED.replace("+", "|"), SHED.replace("#...#...#", "#...##..#")]

    def wait(_):
        if not left:
            raise KeyboardInterrupt
        (tmp_path / "shed.txt").write_text(left.pop(0))

    monkeypatch.setattr("reference.workshop.commands.building.sleep", wait)
    assert main(["check", shed, "--watch"]) == 0
    told = capsys.readouterr()
    assert told.out.count("ok: Shed") == 2
    line = r"-{40} \d\d:\d\d:\d\d\n"
    assert re.match(f"{line}{line}{re.escape(shed)}:7:5: ", told.err)
    assert re.search(f"\n{line}$", told.err)


def test_check_watches_on_when_a_map_becomes_a_pipe(
    shed, tmp_path, capsys, monkeypatch
):
    """It does not wait for whoever writes there, and sees the next save."""
    file = tmp_path / "shed.txt"

    def become_a_pipe():
        file.unlink()
        os.mkfifo(file)

    def become_a_file():
        file.unlink()
        file.write_text(SHED)

    left = [become_a_pipe, become_a_file]

    def wait(_):
        if not left:
            raise KeyboardInterrupt
        left.pop(0)()

    monkeypatch.setattr("reference.workshop.commands.building.sleep", wait)
    assert main(["check", shed, "--watch"]) == 0
    told = capsys.readouterr()
    assert told.out.count("ok: Shed") == 2
    assert told.err.count(f"{shed}: is a folder, a device or a pipe. Name a file.") == 1


def test_check_watches_a_save_that_keeps_its_time(shed, tmp_path, capsys, monkeypatch):
    """As some editors and `cp -p` do: the same length, too."""
    file = tmp_path / "shed.txt"
    before = file.stat()
    left = [SHED.replace("Shed", "Barn")]

    def wait(_):
        if not left:
            raise KeyboardInterrupt
        file.write_text(left.pop(0))
        os.utime(file, ns=(before.st_atime_ns, before.st_mtime_ns))

    monkeypatch.setattr("reference.workshop.commands.building.sleep", wait)
    assert main(["check", shed, "--watch"]) == 0
    assert "ok: Barn" in capsys.readouterr().out


def test_check_tells_people_and_programs_what_is_wrong(shed, tmp_path, capsys):
    """All mistakes of a stage, each with its place; the JSON stands beside the page."""
    (tmp_path / "shed.txt").write_text(SHED.replace("+", "|"))
    status, page = refusal(capsys, "check", shed)
    mistake = {"line": 7, "column": 5, "hint": "Type '#' instead.", "more": 0}
    mistake["message"] = "'|' has no meaning in a drawing"
    assert status == 1 and page.startswith(f"{shed}:7:5: {mistake['message']}\n")
    assert main(["check", shed, "--json"]) == 1
    told = capsys.readouterr()
    assert json.loads(told.out) == {"file": shed, "mistakes": [mistake]}
    assert told.err == page
    assert page.endswith(f"\nnext: python -m reference check {shed} --fix\n")


# -- draw ---------------------------------------------------------------------------


@pytest.mark.paper("A8")
@pytest.mark.parametrize("view", ["top", "oblique", "walkable", "closeup", "graph"])
def test_draw_writes_a_picture_and_says_where(shed, view, tmp_path, capsys):
    """Each view by its name; the file is named after map and view."""
    assert main(["draw", shed, "--view", view]) == 0
    assert capsys.readouterr().out == f"shed-{view}.png\n"
    assert (tmp_path / f"shed-{view}.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(("framework", "windows"), [("tk", 1), (None, 0)])
def test_draw_watches_in_a_window_where_there_is_one(
    framework, windows, shed, tmp_path, monkeypatch
):
    """One window, whose picture is drawn anew at each save; without a display none."""
    pyplot.switch_backend("agg")
    monkeypatch.setattr(FigureCanvasAgg, "required_interactive_framework", framework)
    wider = SHED.replace("#...#...#", "#...##..#")
    seen = []

    def pause(_):
        seen.append(
            [list(pyplot.figure(n).axes[0].images) for n in pyplot.get_fignums()]
        )
        if len(seen) == 2:
            raise KeyboardInterrupt
        (tmp_path / "shed.txt").write_text(wider)

    monkeypatch.setattr(pyplot, "pause", pause)
    assert main(["draw", shed, "--watch"]) == 0
    assert [len(pictures) for pictures in seen] == [windows, windows]
    pyplot.close("all")
    if windows:
        one, other = (pictures[0][0].get_array() for pictures in seen)
        assert (one != other).any()


# -- strategies -----------------------------------------------------------------------


def test_strategies_says_of_everybody_what_they_do(capsys):
    """The first lines of their docstrings; `evacuate` and `evaluate` end with them."""
    assert main(["strategies"]) == 0
    listed = capsys.readouterr().out
    assert f"  escort      {getdoc(Escort).splitlines()[0]}\n" in listed
    assert f"  busiest     {getdoc(BusiestFire).splitlines()[0]}\n" in listed
    assert main(["strategies", "--json"]) == 0
    about = json.loads(capsys.readouterr().out)
    assert {side: (*words,) for side, words in about.items()} == PLAYER_NAMES
    lines = [line for words in about.values() for line in words.values()]
    assert all(line.endswith(".") and len(line) <= 74 for line in lines)
    for command in ("evacuate", "evaluate"):
        with pytest.raises(SystemExit, match="0"):
            main([command, "--help"])
        assert listed in capsys.readouterr().out


# -- evacuate -----------------------------------------------------------------------


def evacuated(capsys, *options):
    """The JSON object of a small evacuation."""
    building = ["--building", "tiny", "--people", "6"]
    assert main(["evacuate", *building, "--json", *options]) == 0
    return json.loads(capsys.readouterr().out)


def test_evacuate_prints_one_object_with_means_over_episodes(capsys):
    """Episode i uses seed + i, and equals the same evacuation run alone."""
    facts = evacuated(capsys, "--seed", "5", "--episodes", "3")
    alone = evacuated(capsys, "--seed", "7")
    assert list(facts) == list(alone) == PROMISED.split()
    assert alone["people"] == alone["evacuated"] + alone["died"] + alone["inside"] == 6
    assert [run["seed"] for run in facts["runs"]] == [5, 6, 7]
    assert facts["reward"] == pytest.approx(sum(r["reward"] for r in facts["runs"]) / 3)
    assert facts["runs"][2]["reward"] == alone["reward"]


def test_numbers_in_json_are_as_long_as_in_tables(capsys):
    """A sum of ticks of 0.2 s has no more than its digits; nothing else is changed."""
    facts = evacuated(capsys, "--seed", "5")
    numbers = [value for value in facts.values() if isinstance(value, float)]
    assert numbers
    assert all(value == round(value, 6) for value in numbers)


def test_evacuate_prints_a_table_for_people(capsys):
    """One figure a row, means over episodes; one pair a column."""
    command = "evacuate --building tiny --people 6 --robots none sweep --episodes 2"
    assert main(command.split()) == 0
    rows = [row.rsplit(maxsplit=2) for row in capsys.readouterr().out.splitlines()]
    assert rows[1] == ["robots", "none", "sweep"]
    assert rows[5] == ["people", "6", "6"]
    assert rows[9][0] == "mean health of those out"


def test_evacuate_plays_what_it_films_and_records_once(tmp_path, capsys, monkeypatch):
    """The same evacuation as unseen, tick by tick; the files are beside the numbers."""
    unseen = evacuated(capsys, "--seed", "2")
    step = Simulation.step
    steps = []

    def counted(simulation):
        steps.append(simulation)
        return step(simulation)

    monkeypatch.setattr(Simulation, "step", counted)
    files = "--animate=run.gif", "--record=rows", "--density=dense.png"
    seen = evacuated(capsys, "--seed=2", *files)
    assert len(steps) == round(seen["simulated_seconds"] / steps[0].tick)
    assert seen == unseen
    assert (tmp_path / "run.gif").read_bytes().startswith(b"GIF89a")
    assert {file.suffix for file in (tmp_path / "rows").iterdir()} == {".sqlite"}
    assert (tmp_path / "dense.png").read_bytes().startswith(b"\x89PNG")


@pytest.fixture
def filmed(monkeypatch):
    """The films that are made: simulations, path and headings; none is drawn."""
    films = []
    monkeypatch.setattr(
        "reference.workshop.drawing.film.animate",
        lambda simulations, path, headings, _: films.append(
            (path.name, [heading.split("\n") for heading in headings])
        ),
    )
    return films


def test_evacuate_plays_two_pairs_and_films_them_side_by_side(capsys, filmed):
    """One name goes with both; each pair is told as if it had been played alone."""
    both = evacuated(capsys, "--robots", "none", "sweep", "--animate", "both.html")
    assert [pair["robots"] for pair in both["pairs"]] == ["none", "sweep"]
    assert [pair["fire"] for pair in both["pairs"]] == ["random", "random"]
    alone = evacuated(capsys, "--robots", "none")
    assert both["pairs"][0]["reward"] == alone["reward"]
    ((path, headings),) = filmed
    assert path == "both.html"
    assert headings[0][:2] == [
        "nobody guides, fire random",
        "robots: none, nobody guides",
    ]
    heading, robots, fire = headings[1]
    assert heading == "guided by sweep, fire random"
    assert robots.startswith("robots: sweep, fetch groups of people")
    assert fire.startswith("fire: random, lights a random cell")


def test_evacuate_films_three_pairs_side_by_side(capsys, filmed):
    """As robots in three ages, or none, scripted and learned."""
    command = ("--robots", "none", "sweep", "escort", "--animate", "three.html")
    three = evacuated(capsys, *command)
    robots = [pair["robots"] for pair in three["pairs"]]
    assert robots == ["none", "sweep", "escort"]
    ((path, headings),) = filmed
    assert path == "three.html"
    assert [first.split(",")[0] for first, *_ in headings] == [
        "nobody guides",
        "guided by sweep",
        "guided by escort",
    ]


def test_the_first_look_compares_three_evacuations_from_one_seed(capsys, filmed):
    """Nobody, guides, and a network that ships; the film shows the first two."""
    assert main(["--json", "--seed", "5"]) == 0
    runs = json.loads(capsys.readouterr().out)["runs"]
    assert {run["seed"] for run in runs} == {5}
    pairs = [(run["robots"], run["fire"]) for run in runs]
    assert pairs == [("none", "random"), ("escort", "random"), ("learned", "random")]
    ((path, headings),) = filmed
    assert path == "evacuation.html"
    firsts = [heading[0] for heading in headings]
    assert firsts == ["nobody guides, fire random", "guided by escort, fire random"]


def test_the_first_look_tells_people_in_three_lines(capsys, filmed):
    """With the means of RESULTS; that the seed was chosen is said."""
    assert main([]) == 0
    title, *lines = capsys.readouterr().out.splitlines()
    seed = f"seed {evacuation.CHOSEN_SEED}, chosen to show the difference early"
    assert title == f"paper, 40 people, {seed}"
    told = (
        r"[a-z, ]+:  +(\d+) get out alive, health \d+ of 100; mean of 200 seeds: (.+)"
    )
    out, means = zip(
        *[re.fullmatch(told, line).groups() for line in lines], strict=True
    )
    table = json.loads((ROOT / "tutorials/tables/contest.json").read_text("utf-8"))
    survival = {
        (cell["robots"], cell["fire"]): cell["survival"]["mean"]
        for cell in table["cells"]
    }
    pairs = [*evacuation.FILMED, evacuation.LEARNED_TOO]
    known = [40 * survival[pair] for pair in pairs]
    assert [float(mean) for mean in means] == pytest.approx(known, abs=0.051)
    assert [int(count) for count in out] == pytest.approx(known, abs=3)


def test_the_first_looks_film_shows_from_its_middle_on_what_guides_are_worth():
    """At each moment from 100 s on, five more are out; before, never fewer."""
    evaluation = begin_evaluation(
        ("none", "escort"), ("random",), seed=evacuation.CHOSEN_SEED, episodes=1
    )
    matches = [(*pair, evacuation.CHOSEN_SEED) for pair in evacuation.FILMED]
    times = []
    for run in evaluation.simulations(matches):
        run_to_end([run])
        times.append([e.time for e in run.events if isinstance(e, Evacuated)])
    moments = np.arange(20, 201, 5)
    alone, led = (np.searchsorted(out, moments, "right") for out in times)
    assert (led - alone >= 0).all()
    assert (led - alone)[moments >= 100].min() >= 5


def test_the_first_look_says_that_its_worker_has_died(capsys, filmed, monkeypatch):
    """In one line, as other mishaps."""

    class Dead(InProcess):
        def submit(self, *given):
            future = Future()
            future.set_exception(BrokenExecutor("terminated abruptly"))
            return future

    monkeypatch.setattr(evacuation, "workers", lambda _: Dead())
    assert main([]) == 1
    assert capsys.readouterr().err == "terminated abruptly\n"


def test_figures_are_printed_although_the_film_cannot_be_written(capsys, monkeypatch):
    """The disk is full at its end; what was played is told first."""

    def animate(simulations, path, headings, going):
        next(iter(going))
        raise OSError(f"{path}: cannot be written (No space left on device)")

    monkeypatch.setattr("reference.workshop.drawing.film.animate", animate)
    command = "evacuate --building tiny --people 2 --episodes 2 --animate film.html"
    assert main([*command.split(), "--json"]) == 1
    out, err = capsys.readouterr()
    assert [run["inside"] for run in json.loads(out)["runs"]] == [0, 0]
    assert err.endswith("film.html: cannot be written (No space left on device)\n")


# -- Outputs ------------------------------------------------------------------------

OUTPUTS = [
    (name, *names[-1:], told)
    for name, command in COMMANDS.items()
    for names, told in command.options
    if getattr(told.get("type"), "__name__", "") == "writable"
]
"""Every option of every command that names a file to write."""


@pytest.mark.parametrize(("name", "option", "told"), OUTPUTS)
def test_every_file_to_write_may_lie_in_a_folder_that_is_not_there_yet(
    name, option, told, tmp_path
):
    """One rule for all; only what no folder can be made for is refused, at once."""
    suffix = re.search(r"\.\w+", told["help"][told["help"].rindex("(") :])[0]
    wanted = tmp_path / "new" / f"deeper/file{suffix}"
    assert told["type"](str(wanted)) == wanted
    (tmp_path / "file").write_text("in the way")
    for place in (tmp_path / "file/deeper", Path("/dev/null")):
        with pytest.raises(OSError, match="Name a file in a folder that is yours"):
            told["type"](str(place / f"file{suffix}"))


@pytest.mark.parametrize(
    ("command", "default"),
    [
        ([], "evacuation.html"),
        (["draw", "tiny"], "tiny-top.png"),
        (["curves", "."], "curves.png"),
        (["paper"], "paper.html"),
    ],
)
def test_refuses_a_default_that_cannot_be_written(command, default, tmp_path, capsys):
    """Before anything is played or drawn, as what is typed."""
    (tmp_path / default).mkdir()
    status, message = refusal(capsys, *command)
    assert (status, message.count("\n")) == (1, 1)
    assert message.startswith(f"{default}: cannot be written (Is a directory)")


def test_refuses_a_file_on_a_full_disk():
    """Before there is anything to write; nothing is left."""
    with room_for(0), pytest.raises(OSError, match=r"cannot be written \(File too la"):
        refuse_unwritable(Path("film.gif"))
    assert list(Path().iterdir()) == []


def test_refuses_a_file_that_may_not_be_written(monkeypatch):
    """Also in a folder that is ours, where it could be replaced."""
    Path("film.gif").write_text("mine")
    refuse_unwritable(Path("film.gif"))
    monkeypatch.setattr(os, "access", lambda path, mode: False)  # root may always
    with pytest.raises(OSError, match=r"cannot be written \(Permission denied\)"):
        refuse_unwritable(Path("film.gif"))


def test_a_file_that_is_replaced_keeps_who_may_read_it(tmp_path):
    """What was for its owner only stays so."""
    (tmp_path / "rows.csv").touch()
    (tmp_path / "rows.csv").chmod(0o600)
    mode = (tmp_path / "rows.csv").stat().st_mode
    write_whole(tmp_path / "rows.csv", b"new")
    assert (tmp_path / "rows.csv").read_bytes() == b"new"
    assert (tmp_path / "rows.csv").stat().st_mode == mode


def test_every_output_of_an_evacuation_makes_its_folder():
    """A film, a picture and a recording; `draw` does, too."""
    played = "evacuate --building tiny --people 2 --scenario time_limit=2"
    outputs = "--animate a/b/film.html --density c/d/dense.png --record e/f/paths"
    assert main([*played.split(), *outputs.split()]) == 0
    assert main(["draw", "tiny", "-o", "g/h/tiny.png"]) == 0
    made = "a/b/film.html c/d/dense.png e/f/paths/floor-1.sqlite g/h/tiny.png"
    assert all(Path(path).is_file() for path in made.split())


def test_a_folder_that_was_made_for_nothing_is_removed(tmp_path):
    """What fails leaves all as it was; a folder that was there stays."""
    (tmp_path / "old").mkdir()
    for place in ("old/new/deep/film.gif", "new/deep/film.gif"):
        with pytest.raises(ZeroDivisionError), replacing(tmp_path / place) as partial:
            partial.write_text("half")
            raise ZeroDivisionError
    assert [path.name for path in tmp_path.rglob("*")] == ["old"]


@pytest.mark.parametrize(
    ("command", "said"),
    [
        ("evacuate", "the first robots meet the first fire"),
        ("evaluate", "each plays against all of --fire"),
        ("evacuate", "a new or empty folder"),
        ("evacuate", "replaces a film of that name"),
    ],
)
def test_the_help_says_what_surprises(command, said, capsys):
    """Who pairs, who crosses; how many; what is written over and what is not."""
    with pytest.raises(SystemExit):
        main([command, "--help"])
    assert said in " ".join(capsys.readouterr().out.split())


def test_the_help_names_all_that_a_checked_map_has_in_json(shed, capsys):
    """Of one that is fine, and of one with mistakes."""
    assert main(["check", shed, "--json"]) == 0
    names = {*json.loads(capsys.readouterr().out)}
    Path(shed).write_text(SHED.replace("E", "#"))
    assert main(["check", shed, "--json"]) == 1
    mistaken = json.loads(capsys.readouterr().out)
    names |= {*mistaken}
    with pytest.raises(SystemExit):
        main(["check", "--help"])
    listed = capsys.readouterr().out.partition("--json ")[2]
    assert names == {*re.findall(r"\w+", listed)} & names


# -- Refusals -----------------------------------------------------------------------


def test_an_option_without_its_value_says_what_it_wants(capsys):
    """Any of any command, also where the value looks like an option: --size -3x4."""
    asked = 0
    for name, command in COMMANDS.items():
        for names, told in command.options:
            if names[0].startswith("-") and told.get("action") != "store_true":
                wanted = f"argument, {told.get('metavar')}: "
                if "choices" in told:
                    wanted = f"one of {', '.join(told['choices'])}"
                for word in names:
                    status, said = refusal(capsys, name, "tiny", word, "-3x4")
                    assert status == 2 and said.count("\n") == 1
                    assert wanted in said
                    asked += 1
    assert asked > 50


def test_people_are_limited_in_one_wording(capsys):
    """By the option, by a scenario's words, and in the list of what these can be."""
    wording = f"{LEAST_PEOPLE} to {MOST_PEOPLE:,}"
    for words in (["--people", "-1"], ["--scenario", "people=-1"]):
        _, said = refusal(capsys, "evacuate", *words)
        assert f"it must be a whole number from {wording}" in said
    with pytest.raises(SystemExit):
        main(["evacuate", "--help"])
    listed = " ".join(capsys.readouterr().out.split())
    assert f"--people N {wording}; default" in listed
    assert f"people {wording} people; default" in listed


@pytest.mark.parametrize(
    ("command", "status", "hint"),
    [
        ("check nowhere.txt", 1, "nowhere.txt"),
        ("floors /dev/zero", 1, "/dev/zero: is a folder,"),
        ("floors --new --size 3x3", 2, "'3x3' is not WIDTHxHEIGHT, both from 6 to 180"),
        ("floors --new --size big", 2, "'big' is not WIDTHxHEIGHT"),
        ("floors --new --floors 0", 2, "'0': it must be a whole number from 1 to 30"),
        ("floors --new --size 180x180 --floors 9", 2, "Take at most 100,000 cells"),
        ("floors --size 20x20 --seed 1", 2, "--seed, --size: add --new."),
        ("floors tiny --new", 2, "a new building has no name"),
        ("draw tiny -o /dev/null/tiny.png", 1, "Name a file in a folder that is yours"),
        ("draw tiny -o tiny.bmp", 2, "does not end in one of .png, .svg, .pdf"),
        ("draw tiny --view inside", 2, "invalid choice: 'inside'"),
        ("evacuate --building=", 1, "there is no floor file"),
        ("evacuate --people 100000", 2, "it must be a whole number from 0 to 10,000"),
        ("evacuate --animate run.avi", 2, "does not end in one of .gif, .html, .mp4"),
        ("evacuate --robots none sweep patrol escort", 2, "at most 3 pairs"),
        ("evacuate --robots none sweep escort --fire none random", 2, "name as many,"),
        ("evacuate --record rec --animate rec/f.gif", 2, "in the folder of --record"),
        ("evacuate --record rec --density ./rec/f.png", 2, "Name another place"),
        ("evacuate tiny", 2, "unrecognized arguments: tiny; a map is named by --bui"),
        ("evacuate --frie none", 2, "unrecognized arguments: --frie none; see --help"),
        ("paper tiny", 2, "unrecognized arguments: tiny; see --help"),
        ("check tiny --seed 3", 2, "reference check: unrecognized arguments: --seed 3"),
        ("check tiny --jso", 2, "unrecognized arguments: --jso"),
        ("train --building random:0", 2, "write random:N, with N from 1"),
        ("train --building random tiny", 2, "random stands alone"),
        ("--animate run.gif evacuate", 2, "--animate: write options behind the com"),
        ("--animate run.gif check tiny", 2, "--animate: write options behind the c"),
        ("--seed 7 check tiny", 2, "--seed: write options behind the command"),
        ("--json curves .", 2, "--json: write options behind the command"),
        ("evacuate --fire busy", 2, "Did you mean 'busiest'?"),
        ("evacuate --fire sweep", 2, "'sweep' is no file"),
        ("evacuate --robots worst-case", 2, "nobody who plays the robots: none, r"),
        ("evacuate --people -1", 2, "'-1': it must be a whole number from 0 to 10,000"),
        (f"evacuate --seed {10**30}", 2, "it must be a whole number from 0 to"),
        ("evaluate --resume", 2, "--resume goes with --out"),
        ("evaluate --resume --out nowhere", 1, "there is no evaluation"),
        ("evaluate --baseline patrol --workers 0", 2, "add it to --robots.\n"),
        ("evaluate --baseline swep --workers 0", 2, "Did you mean 'sweep'?"),
        ("evaluate --sample", 2, "--sample goes with a checkpoint"),
        ("evaluate --people 9000", 1, "fit"),
        (f"curves {'a' * 5000}", 1, "File name too long"),
        ("train --settings /dev/zero", 1, "/dev/zero"),
        ("evaluate --out caf\udce9", 2, "is no UTF-8, and no record could name it"),
    ],
)
def test_refuses_what_cannot_be(command, status, hint, capsys, tmp_path):
    """One message with a hint, the right exit status, and nothing is written."""
    found, message = refusal(capsys, *command.split())
    assert (found, hint in message) == (status, True), message
    assert message.count("\n") == 1 or "no floor file" in message  # which hints
    assert "[Errno" not in message
    assert list(tmp_path.iterdir()) == []


STOPPED = "stopped; nothing half-written is left\n"


@pytest.fixture
def stopped(tmp_path):
    """A function: stop the first look once its film is begun, say what it says."""

    def stop(number):
        before = set(tmp_path.iterdir())
        words = ["-m", "reference", "--animate", "film.gif"]
        process = python(*words, stdout=PIPE, stderr=PIPE)
        while set(tmp_path.iterdir()) == before and process.poll() is None:
            time.sleep(0.05)
        process.send_signal(number)
        out, err = ended(process)
        assert (process.returncode in (130, -number), out) == (True, "")
        return err

    return stop


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_stopped_it_ends_with_one_line_and_leaves_nothing_half_written(
    number, stopped, tmp_path
):
    """Ctrl-C, SIGTERM or a closed terminal in the middle of its animation."""
    err = stopped(number)
    assert err.endswith(STOPPED) and "Traceback" not in err
    assert list(tmp_path.iterdir()) == []


SLOW = "open('loading', 'w').close(); time.sleep(60)"
IN_ITS_PLACE = f"""
try:
    {SLOW}
except KeyboardInterrupt:
    pass
raise ValueError("no bounding box")
"""
IGNORED = f"""
import weakref
def callback(reference):
    {SLOW}
thing = {{1}}
reference = weakref.ref(thing, callback)
del thing
for _ in range(600):
    time.sleep(0.1)
"""


@pytest.mark.parametrize(
    ("number", "library", "code", "told"),
    [
        (signal.SIGINT, "numpy", SLOW, ""),
        (signal.SIGTERM, "matplotlib", IN_ITS_PLACE, STOPPED),
        (signal.SIGHUP, "matplotlib", IGNORED, STOPPED),
    ],
)
def test_stopped_while_it_is_loaded_or_drawing(
    number, library, code, told, stopped, tmp_path
):
    """In silence before it works; no library's own error takes a stop's place."""
    (tmp_path / f"{library}.py").write_text(f"import time\n{code}")
    assert stopped(number) == told


LATE = """
import signal, sys
from reference.__main__ import _process
sys.argv = ["reference", "check", "tiny"]
status = _process()
signal.raise_signal(signal.{number})
sys.exit(status)
"""


@pytest.mark.parametrize("number", ["SIGINT", "SIGTERM", "SIGHUP"])
def test_a_stop_after_all_is_done_does_not_change_the_status(number):
    """While Python unloads what was loaded, which takes half a second with torch."""
    process = python("-c", LATE.format(number=number), stdout=PIPE, stderr=PIPE)
    out, err = ended(process)
    told = "next: python -m reference draw tiny\n"
    assert (process.returncode, out[:3], err) == (0, "ok:", told)


@pytest.mark.parametrize(
    ("command", "status", "message"),
    [
        ("check tiny | sleep 0", 0, ""),
        ("check tiny > /dev/full", 1, "stdout: cannot be read or written (No space"),
        ("-u check tiny > /dev/full", 1, "stdout: cannot be read or written (No sp"),
        ("train --help > /dev/full", 1, "No space left"),
        ("check tiny 2>&-", 0, ""),
        ("check nowhere 2>&-", 1, ""),
    ],
)
def test_ends_quietly_when_its_output_cannot_be_written(command, status, message):
    """A reader that has gone is no mistake; a full disk is told in one line."""
    env = os.environ | {"PYTHONPATH": str(ROOT), "PYTHONUNBUFFERED": ""}
    option = ""
    if command.startswith("-u "):  # nothing waits to be printed
        option, command = command.split(" ", 1)
    line = f'"{sys.executable}" {option} -m reference {command}'
    done = subprocess.run(line, shell=True, env=env, capture_output=True, text=True)
    assert done.returncode == status
    assert message in done.stderr
    assert done.stderr.count("\n") == bool(message)


def test_a_mistake_of_our_own_is_not_told_as_the_users(monkeypatch):
    """Only errors meant for people become one line; others keep their traceback."""

    def mistaken(name):
        raise ValueError("operands could not be broadcast together")

    monkeypatch.setattr("reference.workshop.commands.building.build", mistaken)
    with pytest.raises(ValueError, match="broadcast"):
        main(["check", "tiny"])


@pytest.fixture
def quick_bench(monkeypatch):
    """Measure a little of each thing."""
    nine = bench.TimedRuns(9, "none", "none", 2.0, 1)
    many = replace(nine, people=10**5)
    monkeypatch.setattr(bench, "cases_to_time", lambda: {"9": nine, "too many": many})
    monkeypatch.setattr(bench, "BATCHES", 1)
    monkeypatch.setattr(bench, "FIRST_DECISION", "print(0.5)")


NO_NUMBA = find_spec("numba") is None
WITH_OR_WITHOUT = (
    pytest.param(
        "", marks=[pytest.mark.extra, pytest.mark.skipif(NO_NUMBA, reason="no numba")]
    ),
    "numba is not installed",
)


@pytest.mark.slow
@pytest.mark.parametrize("missing", WITH_OR_WITHOUT)
def test_bench_measures_the_world_both_learners_and_rollouts(
    missing, quick_bench, capsys, monkeypatch
):
    """By the book and by the engine; without it, it says why the column is empty."""
    monkeypatch.setattr(bench, "why_no_engine", lambda: missing)
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    assert main(["bench", "--building", "tiny", "--json"]) == 0
    out, shown = capsys.readouterr()
    assert "crowds:   0%" in shown
    assert "presets:   0%" in shown
    assert ("numba is not installed" in shown) == bool(missing)

    facts = json.loads(out)
    assert {what: list(cases) for what, cases in facts.items()} == {
        "load_seconds": ["tiny"],
        "compile_seconds": ["from nothing", "from the cache"],
        "microseconds_per_tick": ["9"],
        "person_seconds_per_second": ["9"],
        "decisions_per_second": ["paper", "laptop"],
        "samples_per_second": [
            "paper, robots",
            "paper, fire",
            "laptop, robots",
            "laptop, fire",
        ],
    }
    for cases in facts.values():
        for figures in cases.values():
            for player, figure in figures.items():
                if player == "engine" and missing:
                    assert figure is None
                else:
                    assert figure > 0


def test_bench_refuses_a_map_without_room_for_the_papers_people(tmp_path, capsys):
    """How many they are, it is not asked; so another map is what helps."""
    path = tmp_path / "hut.txt"
    path.write_text("building: Hut\nsize: 5 x 3\nfloor 1: ground\n#####\n#...E\n#####")
    status, told = refusal(capsys, "bench", "--building", str(path))
    assert status == 1
    assert f"{path}: is too small: 40 people take part in what is measured" in told


def test_a_figure_that_rounds_to_0_has_no_sign():
    """Nothing is less than nothing."""
    figures = [format_figure(value) for value in (-0.001, 0.001, -0.01, 1234.5)]
    assert figures == ["0", "0", "-0.01", "1,234.50"]


def test_figures_of_a_row_have_as_many_decimals():
    """Two, where one has any; each row for itself, and words stay."""
    rows = [["R", 961, 955.5, None], ["out", 34, 1039.8, "fire"], ["dead", 6, 0.0, 1]]
    assert format_table(rows, "<>>>").splitlines() == [
        "R     961.00    955.50     -",
        "out    34.00  1,039.80  fire",
        "dead       6         0     1",
    ]


@pytest.mark.parametrize(
    ("package", "words"), [("filelock", ""), ("matplotlib", "draw tiny")]
)
def test_a_package_that_is_missing_is_told_in_a_line(package, words, tmp_path):
    """As outside the environment: before any command, or when it is needed."""
    gone = f'raise ModuleNotFoundError("none", name="{package}")'
    (tmp_path / f"{package}.py").write_text(gone)
    env = {"PYTHONPATH": f"{tmp_path}:{ROOT}"}
    words = ("-m", "reference", *words.split())
    process = python(*words, env=env, stdout=PIPE, stderr=PIPE)
    out, err = ended(process)
    assert (process.returncode, out) == (1, "")
    assert f"has no package {package}: type .venv/bin/python instead" in err
    assert err.count("\n") == 1


def test_a_module_that_code_of_ones_own_lacks_is_told_as_ever():
    """With a traceback, which says where it is imported."""
    Path("mine.py").write_text("import no_such_library")
    words = ("evacuate", "--building", "tiny", "--robots", "mine:Guide")
    process = python("-m", "reference", *words, stdout=PIPE, stderr=PIPE)
    _, err = ended(process)
    assert process.returncode == 1
    assert "Traceback" in err and "No module named 'no_such_library'" in err


def test_bench_prints_one_table(capsys, monkeypatch):
    """Book beside engine, in three digits, and how many times as fast it is."""
    measured = {
        "microseconds_per_tick": {"alone": {"book": 353.16, "engine": 14.16}},
        "load_seconds": {"tiny": {"both": 0.0123}},
        "compile_seconds": {"from nothing": {"engine": None}},
    }
    monkeypatch.setattr(bench, "measure_speed", lambda name, seed: measured)
    monkeypatch.setattr(bench, "why_no_engine", lambda: "")
    assert main(["bench"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split() for line in lines] == [
        ["what", "of", "what", "book", "engine", "times"],
        ["microseconds", "per", "tick", "alone", "353", "14.20", "24.9"],
        ["load", "seconds", "tiny", "0.01", "same"],
        ["compile", "seconds", "from", "nothing", "-", "-"],
    ]


# -- All of them --------------------------------------------------------------------


WITHOUT_NUMBERS = {"draw", "floors", "curves", "paper"}
WITHOUT_CHANCE = {"draw", "curves", "paper", "check", "experiment", "strategies"}


@pytest.mark.parametrize("command", ["", *COMMANDS])
def test_every_command_explains_itself_with_an_example(command, capsys):
    """`--help` tells what it does and shows one line to type."""
    with pytest.raises(SystemExit, match="0"):
        main([*command.split(), "--help"])
    text = capsys.readouterr().out
    assert f"example:\n  python -m reference {command}" in text
    assert ("--json" in text) == (command not in WITHOUT_NUMBERS)
    assert ("--seed" in text) == (command not in WITHOUT_CHANCE)
