"""Films as web pages: what data they hold, and that they need nothing else."""

import json
import re
import subprocess
from base64 import b64decode
from dataclasses import dataclass, field, replace
from shutil import which
from types import SimpleNamespace
from zlib import decompress

import numpy as np
import pytest
from conftest import ROOT

from reference.building import Building, Kind
from reference.fire import NoFire, RandomFire
from reference.paper import InputError, Scenario
from reference.simulation import Simulation
from reference.workshop import drawing
from reference.workshop.drawing import page
from reference.workshop.drawing.evacuation import looks
from reference.workshop.drawing.web_film import (
    BODY,
    DONE,
    NEVER,
    Reel,
    floor_names,
    floor_svg,
    rules_in_words,
    verdict,
)
from reference.workshop.maps import load
from reference.workshop.measuring.recording import ticks
from reference.workshop.strategies.guides import Escort
from reference.workshop.strategies.own import CheckedStrategy
from reference.world import Fate

SCRIPT = ROOT / "reference" / "workshop" / "drawing" / "web_film.js"
PLAYER = SCRIPT.read_text(encoding="utf-8")
STEP = 3  # ticks from frame to frame
MARKUP = "Tiny office </script><script>alert(1)</script>"
OFFICE = Building(replace(load("tiny").drawing, title=MARKUP))


def evacuation(limit=80.0):
    """Time enough for stairs, deaths by fire and burnt doors."""
    scenario = Scenario(people=30, robots_per_floor=1, time_limit=limit)
    return Simulation(OFFICE, scenario, Escort(), RandomFire(), seed=2)


@pytest.fixture(scope="module")
def text(tmp_path_factory):
    """The page of a film of one evacuation."""
    path = tmp_path_factory.mktemp("film") / "film.html"
    drawing.animate([evacuation()], path, ["<b>one</b>\nrobots: x & y"])
    return path.read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def film(text):
    """The data in it, which its player reads."""
    return data(text)


def data(text):
    """What a page's player reads."""
    return json.loads(re.search(r"^const film = (.*)$", text, re.MULTILINE)[1])


def unpacked(packed, *rows):
    """Numbers (*rows, length): sums of the steps that are stored."""
    length, told = packed
    steps = np.frombuffer(decompress(b64decode(told)), "<i2")
    return np.cumsum(steps.reshape(*rows, length), axis=-1)


def instants():
    """The evacuation once more: its world at every frame."""
    run = evacuation()
    for tick, _ in enumerate(ticks([run])):
        if run.done or tick % STEP == 0:
            yield run.world


def corner(points):
    """Metres east and south of the north-west corner."""
    left, _, _, top = page.extent_of(load("tiny"))
    return (np.asarray(points) - (left, top)) * (1, -1)


@pytest.mark.paper("A8")
@pytest.mark.paper("C5")
@pytest.mark.paper("C7")
def test_the_film_holds_where_everybody_is_and_robots_go_to_the_decimetre(film):
    """In every frame; also who is dead, leads or is led, and what robots say."""
    (run,) = film["runs"]
    numbers = unpacked(run["bodies"], -1, 10)
    sent = 0
    for k, world in enumerate(instants()):
        bodies = world.bodies
        robots = world.robots
        now = dict(zip(BODY.split(), numbers[..., k].T, strict=True))
        where = corner([*bodies.position, *(robot.position for robot in robots)])
        shown = np.stack([now["x"], now["y"]], axis=1) / 10
        np.testing.assert_allclose(shown, where, atol=0.0501)
        assert now["floor"].tolist() == [*bodies.floor, *(r.floor for r in robots)]
        people = {name: column[: len(bodies)] for name, column in now.items()}
        assert (people["leader"] == bodies.leader).all()
        assert (people["stairwell"] == bodies.stairwell).all()
        assert (people["state"] == np.choose(bodies.fate, [bodies.mode, 2, 3])).all()
        assert (np.abs(people["health"] - bodies.health) < 1).all()
        for robot, (says, *goal) in zip(robots, numbers[-2:, -3:, k], strict=True):
            if robot.active and robot.destination is not None:
                there = corner(robot.destination)
                np.testing.assert_allclose(np.divide(goal, 10), there, atol=0.0501)
                assert says == robot.says
                sent += 1
            else:
                assert [says, *goal] == [-1 if robot.active else DONE, -1, -1]
    assert k + 1 == run["bodies"][0] > 100 and sent > 100
    assert {*bodies.fate} == {*Fate}


@pytest.mark.paper("D7")
@pytest.mark.paper("A6")
def test_the_film_holds_what_burns_and_what_has_burnt_out(film):
    """Flames of every frame, sources and doors with their times."""
    (run,) = film["runs"]
    *cells, lit, ash = unpacked(run["flames"], 5)
    assert (np.diff(lit) >= 0).all()
    for k, world in enumerate(instants()):
        burning = np.zeros_like(world.flames.burning)
        now = (lit <= k) & ((ash == NEVER) | (k < ash))
        burning[tuple(cell[now] for cell in cells)] = True
        assert (burning == world.flames.burning).all()
    assert burning.any()
    times = [source.time for source in world.flames.sources]
    assert [fire[3] for fire in run["sources"]] == times
    assert {door for door, _ in run["doors"]} == world.burnt
    assert film["marks"][0]["cells"] == load("tiny").landmarks[0].cells.tolist()


@pytest.mark.skipif(which("node") is None, reason="needs node")
def test_the_player_reads_the_numbers_that_were_packed(film):
    """Its own function, run by node, sums up the same rows; no flames, no rows."""
    unpack = re.search(r"^async function unpack.*?^}", PLAYER, re.M | re.S)[0]
    calm = Reel(Simulation(OFFICE, Scenario(people=2)))
    calm.note()
    for flames in (film["runs"][0]["flames"], calm.packed()["flames"]):
        code = f"""const range = n => [...Array(n).keys()]; {unpack}
        unpack({json.dumps(flames)}).then(rows =>
          console.log(JSON.stringify(rows.map(row => [...row]))))"""
        said = subprocess.check_output(["node", "-e", code], text=True)
        assert json.loads(said) == [row for row in unpacked(flames, 5).tolist() if row]
    subprocess.run(["node", "--check", str(SCRIPT)], check=True)


def test_the_page_needs_no_other_file_and_fits_a_phone(text):
    """No link leads out of it; a map's title and a heading are words, not markup."""
    assert not re.search(r"https?:|<link|<script .*src|@import|url\(", text)
    for part in ("<canvas", 'type="range"', "Tiny office", "device-width"):
        assert part in text
    assert "<b>one</b>" not in text and "<script>alert" not in text
    assert '<p class="who">robots: x &amp; y</p>' in text


@pytest.mark.paper("A8", "Figs. 4-6")
@pytest.mark.parametrize("name", ["paper", "museum"])
def test_a_floor_as_svg_has_every_cell_in_the_class_of_its_kind(name):
    """The paths' rectangles, painted back onto a grid, are the floor."""
    building = load(name)
    for floor in range(building.floors):
        svg = floor_svg(building, floor)
        painted = np.full(building.kind.shape[1:], Kind.OUTSIDE)
        for kind, ways in re.findall(r'<path class="(\w+)" d="(.*?)"', svg):
            for x, y, end, back in re.findall(r"M(\d+) (\d+)H(\d+)v1H(\d+)z", ways):
                assert x == back
                painted[int(y), int(x) : int(end)] = Kind[kind.upper()]
        assert (painted == building.kind[floor]).all()
        names = [area.name for area in building.areas if area.floor == floor]
        written = {name for *_, name in floor_names(building, floor)}
        assert written == {name for name in names if not name.startswith("room-")}


@pytest.mark.parametrize("frames_per_tick", [7, 10, 25])
def test_a_film_lasts_as_long_as_its_evacuation(frames_per_tick, tmp_path):
    """A frame is whole ticks, of whatever length."""
    scenario = Scenario(people=2, time_limit=20.0, frames_per_tick=frames_per_tick)
    run = Simulation(load("tiny"), scenario)
    path = tmp_path / "film.html"
    drawing.animate(run, path)
    film = data(path.read_text(encoding="utf-8"))
    frames = film["runs"][0]["bodies"][0]
    assert (frames - 1) * film["step"] == pytest.approx(run.world.time, abs=0.6)
    assert film["end"] == pytest.approx(run.world.time)


def test_a_film_may_begin_in_the_middle_of_a_run(tmp_path):
    """It tells the run's own seconds, and what has burnt out by then."""
    run = evacuation()
    while run.world.time < 70.0:
        run.step()
    assert run.world.flames.ash.any()
    begin = run.world.time
    path = tmp_path / "film.html"
    drawing.animate(run, path)
    film = data(path.read_text(encoding="utf-8"))
    assert film["begin"] == pytest.approx(begin)
    packed = film["runs"][0]
    frames = packed["bodies"][0]
    played_seconds = film["end"] - film["begin"]
    assert (frames - 1) * film["step"] == pytest.approx(played_seconds, abs=0.6)
    ash = unpacked(packed["flames"], 5)[4]
    assert (ash == 0).sum() > 0


@pytest.mark.parametrize(
    ("people", "told"), [(1, "1 person evacuates"), (2, "2 people evacuate")]
)
def test_the_page_says_how_many_evacuate(people, told, tmp_path):
    """One is a person."""
    path = tmp_path / "film.html"
    drawing.animate(
        Simulation(load("tiny"), Scenario(people=people, time_limit=0.4)), path
    )
    assert f"<h1>Tiny office: {told}</h1>" in path.read_text(encoding="utf-8")


def test_runs_side_by_side_tell_the_same_seconds(tmp_path):
    """Another second for each would need a slider of its own."""
    later = evacuation()
    later.step()
    with pytest.raises(InputError, match="begin at the same second"):
        drawing.animate([evacuation(), later], tmp_path / "film.html")


# -- What the player shows and says ---------------------------------------------------


def played(code, **known):
    """What node says of the player's functions that code names as `name()`."""
    constants = "".join(f"const {k} = {json.dumps(v)}; " for k, v in known.items())
    said = subprocess.check_output(["node", "-e", constants + code], text=True)
    return json.loads(said)


def of_player(*names):
    """The player's text of some functions."""
    whole = r"^(?:const {0} = .*?(?=^\S)|function {0}\(.*?^}}\n)"
    found = [re.search(whole.format(name), PLAYER, re.M | re.S) for name in names]
    return "".join(match[0] for match in found)


needs_node = pytest.mark.skipif(which("node") is None, reason="needs node")


@needs_node
@pytest.mark.parametrize("begin", [0.0, 40.0])
@pytest.mark.parametrize(("step", "end"), [(0.6, 200.0), (0.6, 177.8), (0.5, 60.0)])
def test_the_last_value_of_the_slider_shows_the_last_frame(begin, step, end, text):
    """Also where the end is between two frames; before it others are shown."""
    frames = [begin + k * step for k in range(int((end - begin) / step + 1e-9) + 1)]
    if end - frames[-1] > 1e-9:
        frames.append(end)
    last = len(frames) - 1
    code = f"""{of_player("{ begin, end }", "when", "frame")}
    const run = {{frames: Array({last + 1})}}
    console.log(JSON.stringify([frame(run, end), frame(run, end - 0.01),
      frame(run, begin), frame(run, begin + film.step), when({last}), when(1)]))"""
    shown = played(code, film={"step": step, "begin": begin, "end": end})
    assert shown == [last, last - 1, 0, 1, end, begin + step]
    assert re.search(r'type="range" min="0.0" value="0.0" step="any" max="80.0"', text)


@needs_node
def test_flames_hide_no_names_and_names_no_people():
    """They are painted in this order: flames, names, people, letters of stairwells."""
    code = f"""const log = [], metre = 8, size = 4, density = 1
    const OUT = 2, DEAD = 3, ROBOT = 4
    const STATES = ["follower", "leader", "out", "died here", "robot"]
    const put = (_, name) => log.push(name), line = () => 0, colour = () => ""
    const write = (_, room) => log.push(room[5])
    const context = new Proxy({{}}, {{get: () => () => 0, set: () => true}})
    {of_player("{ begin, end }", "when", "frame", "isStairwell", "together", "paint")}
    const one = {{i: 0, x: 5, y: 5, floor: 0, state: 0, toX: -1, leader: -1}}
    const run = {{frames: [[one], [one]], flames: [[0, 1, 1, 0, -1]], chosen: -1,
      doors: [], sources: []}}
    paint(run, 0, {{getContext: () => context}}, [one], 0)
    console.log(JSON.stringify(log))"""
    names = [[0, "A"], [0, "hall"], [1, "attic"]]
    rooms = [[floor, 15, 15, 10, False, name] for floor, name in names]
    film = {
        "step": 0.6,
        "begin": 0.0,
        "end": 0.6,
        "trail": 10,
        "marks": [],
        "rooms": rooms,
    }
    assert played(code, film=film) == ["flames", "hall", "follower", "A"]


@needs_node
def test_robots_on_one_spot_are_counted():
    """Beside the first of them; people and a robot farther off do not count."""
    spots = [(0, 4), (2, 4), (0, 4), (40, 4), (0, 0)]
    bodies = [{"x": x, "y": 0, "state": state} for x, state in spots]
    code = f"""{of_player("together")}
    const told = together(bodies).map(([one, count]) => [one.x, count])
    console.log(JSON.stringify(told))"""
    assert played(code, film={"spot": 5}, bodies=bodies, ROBOT=4) == [[0, 3]]


@needs_node
@pytest.mark.paper("C8")
@pytest.mark.parametrize(
    ("says", "x", "told"),
    [
        (-1, 40, ", says “follow me”"),
        (0, 40, ", says “go to exit-1”"),
        (-1, -1, ""),
        (DONE, -1, ", its work is done"),
    ],
)
def test_who_clicks_a_robot_reads_what_it_says(says, x, told):
    """Before its first decision, and when its work is done, it says nothing."""
    robot = {"i": 2, "state": 4, "floor": 0, "leader": -1, "health": 100}
    robot |= {"says": says, "toX": x}
    code = f"""const ROBOT = 4, OUT = 2, DEAD = 3, LEADER = 1, begin = 0
    const frame = () => 0, since = () => 0
    {of_player("DONE", "words", "facts")}
    const run = {{frames: [[0, 1, robot]], people: 2, chosen: 2}}
    console.log(JSON.stringify(facts(run, 0)))"""
    film = {"marks": [{"name": "exit-1"}]}
    assert played(code, film=film, robot=robot) == f"robot 1, floor 1{told}"


@needs_node
def test_the_scale_of_health_has_the_steps_of_people():
    """No shade between them, which nobody has."""
    code = f"""{of_player("colour", "steps")}
    console.log(JSON.stringify([steps, [1, 50, 51, 100].map(colour)]))"""
    steps = ["dark 0% 50%", "pale 50% 100%"]
    shown = [steps, ["dark", "dark", "pale", "pale"]]
    assert played(code, film={"health": ["dark", "pale"]}) == shown


def test_films_and_pictures_have_one_word_for_each_thing():
    """The player's shapes, which its legend names, are those of pictures and GIFs."""
    shapes = re.search(r"^const SHAPES = {.*?^}", PLAYER, re.M | re.S)[0]
    words = {
        first or second
        for first, second in re.findall(r'^  (?:(\w+)|"([^"]+)"): \[', shapes, re.M)
    }
    assert words - {"ring"} == {*looks(5)} - {"walked in 10 s"}
    occurs = re.search(r"const occurs = {(.*?)}\n", PLAYER, re.S)[1]
    assert words - {"ring"} == {
        first or second
        for first, second in re.findall(r'(?:(\w+)|"([^"]+)"): ', occurs)
    }


@pytest.mark.paper("B7")
def test_a_film_explains_itself_in_a_few_sentences(text):
    """With the paper's numbers; of robots it speaks where there are some."""
    alone = rules_in_words([Simulation(OFFICE, Scenario(people=2))])
    assert "100 health and lose 0.5 a second" in alone
    assert "inside after 200 s is dead" in alone
    assert "robot" not in alone.lower()
    led = rules_in_words([evacuation()])
    assert led.endswith("Robots lead whom they meet.")
    assert f'<p class="rules">{led}</p>' in text


@dataclass
class Ended:
    """A run as far as a verdict reads it."""

    evacuated: int
    inside: int = 0
    robots: bool = False
    fire_strategy: object = field(default_factory=NoFire)

    @property
    def world(self):
        return SimpleNamespace(bodies=range(40), robots=[0] * self.robots)

    def outcome(self):
        return self


@pytest.mark.parametrize(
    ("run", "first", "told"),
    [
        (Ended(30, 2), None, "30 of 40 got out, 2 still inside"),
        (
            Ended(35, robots=True),
            Ended(30),
            "35 of 40 got out, 5 more than without guides",
        ),
        (
            Ended(29, robots=True),
            Ended(30),
            "29 of 40 got out, 1 fewer than without guides",
        ),
        (
            Ended(30, robots=True),
            Ended(30),
            "30 of 40 got out, as many as without guides",
        ),
        (
            Ended(20, robots=True, fire_strategy=RandomFire()),
            Ended(30),
            "20 of 40 got out, 10 fewer than with “nobody guides, no fire”",
        ),
        (
            Ended(35, robots=True, fire_strategy=CheckedStrategy(NoFire(), "fire", "")),
            Ended(30, fire_strategy=CheckedStrategy(RandomFire(), "fire", "")),
            "35 of 40 got out, 5 more than with “nobody guides, no fire”",
        ),
        (
            Ended(35, robots=True),
            Ended(30, robots=True),
            "35 of 40 got out, 5 more than with “nobody guides, no fire”",
        ),
    ],
)
def test_a_verdict_compares_with_the_first_evacuation(run, first, told):
    """It says without guides only where nothing else differs."""
    heading = "nobody guides, no fire\nrobots: none"
    assert verdict(run, first or run, heading) == told


def test_a_minute_of_two_crowds_is_a_small_page(tmp_path):
    """Nobody outlives 200 s, which are far below 600 kB then."""
    scenario = Scenario(time_limit=60.0)
    runs = [Simulation(load("paper"), scenario, None, RandomFire(), k) for k in (1, 2)]
    drawing.animate(runs, tmp_path / "film.html", ["one", "two"])
    assert (tmp_path / "film.html").stat().st_size < 100_000


def test_three_evacuations_stand_side_by_side_and_one_can_be_chosen(tmp_path):
    """As three ages of robots that learn."""
    runs = [evacuation(3.0) for _ in range(3)]
    path = tmp_path / "film.html"
    drawing.animate(runs, path, ["young", "older", "old"])
    text = path.read_text(encoding="utf-8")
    assert text.count("<article") == 3
    shown = re.findall(r'name="shown".*?> *(\w+)</label>', text)
    assert shown == ["all", "young", "older", "old"]
