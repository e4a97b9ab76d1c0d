"""Boards as tests: draw a scene, let people think or seconds pass, read it again.

    # . + E A-D   the building, as in a floor file but without names of rooms
    :             a door that has burnt
    p q r ...     people, in this order; a later letter outranks an earlier one
    R             robots, in reading order, equally many on every floor
    * ,           flames that do not spread, and the ash that is left of them
    x             who died there
    _             floor that p has explored before
    !             where somebody sets off to: a door, stair, exit, patch or leader
    ?             where an unexplored direction leads that somebody sets off in
    1 2 ...       where the first, the second ... robot goes, in reading order
    1 2 ... 0     doors on the way back, as they were passed, and all others visited

Floors are drawn one below the other, the first floor first, with a blank line between;
a floor of one row stands between two walls.  A line "then" parts one board from the
next; boards that stand beside each other, before and after, are parted by `beside`.
People walk at WALKING_SPEED, robots stand still unless a strategy is given, and nothing
is left to chance.  What no board shows is said in words of a scene:

    leads="pq"              these lead; all others follow nobody yet
    follows="pq rR2"        p follows q, r the second robot, seen where it is just now
    lost="pq"               the same, but p has not seen q for ten seconds
    visited="+2 q+1"        p has passed the second `+` of the board, q the first
    at="p+2"                p stands in this door
    says="R2E"              the second robot sends to the exit; "R" says "follow me"
    still="p"               p stands still for good
    time=7.0                seconds since the evacuation began
    health={"p": 5}         of 100
"""

import inspect
import re
import sys
from contextlib import contextmanager
from functools import cache
from itertools import groupby, zip_longest
from math import ceil

import numpy as np
from hypothesis import strategies as st
from rules import Board, drawn

from reference import humans, paper
from reference.beginning import starting_world
from reference.building import Building, Kind
from reference.fire import Spread
from reference.floorplan import Drawing, Storey, parse
from reference.navigation import navigation_of
from reference.paper import WALKING_SPEED, Scenario
from reference.rays import sight_of
from reference.simulation import Simulation
from reference.view import look
from reference.workshop.annotated.index import captioned_boards
from reference.workshop.comparing.named import strategy_of
from reference.workshop.maps import load
from reference.world import NOBODY, NOWHERE, Aim, Fate, FireLit, Mode, Passed

PEOPLE = "pqrstuvwxyz"

GAPS = """building: gaps
size: 6 x 5
floor 1: walls without corners
 ####
#....#
###+##
#....E
 ####
"""
"""A map of which rays meet the outside, where people walk on both sides of a door."""

GRIDS = st.integers(3, 9).flatmap(
    lambda width: st.lists(
        st.text(st.sampled_from("..#"), min_size=width, max_size=width),
        min_size=3,
        max_size=9,
    )
)
"""Random floors, for hypothesis; `walled` builds them."""


# -- A scene, and what becomes of it ------------------------------------------------


def stage(board, robots=None, fire="none", **said):
    """A simulation that begins as drawn and as said, in words of scene or scenario."""
    words = {word: said.pop(word) for word in WORDS if word in said}
    floors = split(board)
    people = tuple(len(found([rows], PEOPLE)) for rows in floors)
    guides = len(found(floors[:1], "R"))
    building = built(board)
    scene = Scenario(people_per_floor=people, robots_per_floor=guides, **said)
    world = as_drawn(floors, building, scene, np.random.default_rng(0))

    # what is said, in the order of WORDS
    for word, comes_true in WORDS.items():
        if word in words:
            comes_true(world, words[word])

    # who plays
    sent = {}
    for floor, row, col in found(floors, "123456789"):
        digit = int(floors[floor][row][col])
        sent[digit] = building.metres(row, col)
    robots = strategy_of(robots or Sent(sent), "robots", building, scene)
    fire = strategy_of(fire, "fire", building, scene)
    return Simulation(building, scene, robots, fire, world=world)


def sets_off(board, who="p", passes=1, **said):
    """The board, with where somebody sets off to: `!`, in an unexplored direction `?`.

    who leads if nothing else is said.  Before, all others who lead think, the highest
    rank first.  Nobody walks: more passes are more boards.
    """
    first_follows = said.get("follows", "").startswith(who)
    first_lost = said.get("lost", "").startswith(who)
    if not first_follows and not first_lost:
        said.setdefault("leads", who)
    sim = stage(board, **said)
    others = set(said.get("leads", "")) - {who}
    for other in sorted(others, reverse=True):
        decide(sim, other)
    boards = [thinks(sim, who) for _ in range(passes)]
    return Board("\nthen\n".join(boards))


def thinks(sim, who="p"):
    """Let somebody think once, and nothing else: the board with `!` or `?`."""
    return heading(sim, decide(sim, who))


def heading(sim, goal):
    """The board with a goal."""
    floors = canvas(sim)
    sign = "?" if goal.aim is Aim.DIRECTION else "!"
    places = [goal.place] if goal.place != NOWHERE else []
    if goal.aim is Aim.LANDMARK:
        places = sim.navigation.goals[goal.which].tolist()
    for p in places:
        floor, row, col = np.unravel_index(p, sim.building.kind.shape)
        floors[floor][row][col] = sign
    return framed(sim, floors)


def remembers(sim, who="p"):
    """The board with the doors that somebody has visited: `1` is passed first on the
    way back, `0` is not on it."""
    me = mind(sim, who)
    floors = canvas(sim)
    order = {passed.door: number for number, passed in enumerate(me.trail, 1)}
    for index in me.doors:
        door = sim.building.landmarks[index]
        sign = str(order.get(index, 0))
        for row, col in door.cells:
            floors[door.floor][row][col] = sign
    return framed(sim, floors)


def later(board, seconds, robots=None, fire="none", **said):
    """The board some seconds later."""
    return play(stage(board, robots, fire, **said), seconds)


def goes(sim):
    """The board with each robot's destination: `1` of the first in reading order."""
    floors = canvas(sim)
    for number, robot in enumerate(sim.world.robots, 1):
        if robot.destination is not None:
            row, col = sim.building.cell(*robot.destination)
            floors[robot.floor][row][col] = str(number)
    return framed(sim, floors)


class Sent:
    """Robots that go where the board has their digits; others never decide."""

    def __init__(self, where):
        self.where = where

    def decide(self, world, robots, rng):
        """The same each time."""
        first = len(world.bodies) - 1
        return [self.where.get(robot.body - first) for robot in robots]


class Script:
    """Robots that all go to the next of some places, in metres, at each decision."""

    def __init__(self, *places):
        self.left = list(places)
        self.asked = []  # at which times

    def __deepcopy__(self, memo):
        """Itself: a test reads in it what a simulation's copy was shown."""
        return self

    def decide(self, world, robots, rng):
        """Nothing more at the end of the list."""
        self.asked.append(world.time)
        goal = self.left.pop(0) if self.left else None
        return [goal] * len(robots)


def ticks(sim, seconds=None):
    """Step to the end, or some seconds long at most; the events of each tick.

    Counted, so that a test also ends where the clock stands still.
    """
    limit = sim.scenario.time_limit if seconds is None else seconds
    for _ in range(ceil((limit - 1e-9) / sim.tick)):
        if sim.done:
            break
        yield sim.step()
    assert sim.done or seconds is not None, "time is up, and it is not done"


def turns(environment):
    """Count the steps of an environment until no agent is left, or time must be up."""
    scenario = environment.simulation.scenario
    for k in range(ceil(scenario.time_limit / scenario.decision_seconds)):
        if not environment.agents:
            break
        yield k
    assert not environment.agents, "time is up, and agents are left"


def wait(sim, seconds):
    """Let some seconds pass."""
    for _ in ticks(sim, seconds):
        pass


def play(sim, seconds):
    """The board some seconds later."""
    wait(sim, seconds)
    return show(sim)


def play_until(sim, happened, seconds=240):
    """Let time pass until something is so; fail if it does not come about."""
    left = ticks(sim, seconds)
    while not happened():
        waits = next(left, None) is not None
        assert waits, f"it has not happened by {sim.world.time:.1f} s:\n{show(sim)}"


def events_of(sim, kind):
    """The events of one kind so far."""
    return [event for event in sim.events if isinstance(event, kind)]


def show(sim):
    """The board now: people before robots before flames before the building."""
    return framed(sim, canvas(sim))


def canvas(sim):
    """The signs of the board now, floor by floor and row by row."""
    world = sim.world
    bodies = world.bodies
    floors = []
    for storey in sim.building.drawing.storeys:
        floors.append([list(row) for row in storey.rows])

    def put(sign, floor, position):
        row, col = sim.building.cell(*position)
        floors[floor][row][col] = sign

    for index in world.burnt:
        door = sim.building.landmarks[index]
        for row, col in door.cells:
            floors[door.floor][row][col] = ":"
    for sign, cells in {"*": world.flames.burning, ",": world.flames.ash}.items():
        for floor, row, col in np.argwhere(cells):
            floors[floor][row][col] = sign
    for robot in world.robots:
        put("R", robot.floor, robot.position)
    for i in np.flatnonzero(bodies.fate == Fate.DEAD):
        put("x", bodies.floor[i], bodies.position[i])
    for i in reversed(np.flatnonzero(bodies.inside)):
        put(PEOPLE[i], bodies.floor[i], bodies.position[i])
    return floors


def framed(sim, floors):
    """A board from signs, without the walls that no row draws."""
    if sim.building.title == CORRIDOR:
        floors = [[row] for _, row, _ in floors]
    boards = []
    for floor in floors:
        rows = ["".join(row).rstrip() for row in floor]
        boards.append("\n".join(rows))
    return Board("\n\n".join(boards))


# -- Films --------------------------------------------------------------------------


def film(sim, seconds, algorithm):
    """A strip of boards: the first; each time p passes other lines of their algorithm,
    or sets off to something else; and the end of its loop, line 1."""
    me = mind(sim, "p")
    printed = printed_lines(algorithm)
    strip = []

    def add(words, board):
        strip.append(f"{sim.world.time:.1f} s: {words}\n{board}")

    add("the beginning", show(sim))
    known = set()
    while sim.world.time < seconds - 1e-9 and sim.world.bodies.inside[0]:
        with lines_run(algorithm.__code__, me) as run:
            sim.step()
        lines = sorted({n for line in run for n in printed.get(line, ())})
        key = (*lines, me.goal.aim)
        if lines and key not in known:
            known.add(key)
            add(f"lines {', '.join(map(str, lines))}", heading(sim, me.goal))
    add("line 1, out", show(sim))
    return Board("\n".join(strip))


def printed_lines(algorithm):
    """The paper's lines that each line of a method carries, as its comment says."""
    lines = {}
    first = algorithm.__code__.co_firstlineno
    for number, line in enumerate(inspect.getsource(algorithm).splitlines(), first):
        comment = re.search(r"  # ([\d, ]+)(?:\D|$)", line)
        if comment:
            lines[number] = [int(n) for n in re.findall(r"\d+", comment[1])]
    return lines


def opening(strip):
    """The first board of a film."""
    _, board = captioned_boards(drawn(strip))[0]
    return "\n".join(board)


@contextmanager
def lines_run(code, mine):
    """The lines that a method runs while it is about one of its arguments."""
    run = set()
    before = sys.gettrace()

    def watch(frame, event, _):
        if frame.f_code is not code or mine not in frame.f_locals.values():
            return None
        run.add(frame.f_lineno)
        return watch

    sys.settrace(watch)
    try:
        yield run
    finally:
        sys.settrace(before)


# -- Who is on the board ------------------------------------------------------------


def body(sign, people=0):
    """The number of a body: "p" of the first human, "R2" of the second robot."""
    if sign[0] == "R":
        return people + nth(sign) - 1
    return PEOPLE.index(sign)


def nth(sign):
    """The number behind a sign, 1 if there is none: 2 of "R2"."""
    return int(sign[1:] or 1)


def mind(sim, letter):
    """What the human with a letter remembers."""
    return sim.world.minds[body(letter)]


def mode(sim, letter="p"):
    """LEADER or FOLLOWER, and the sign of who is followed, as in "FOLLOWER of q"."""
    me = mind(sim, letter)
    if me.leader == NOBODY:
        return me.mode.name
    robot = me.leader - len(sim.world.minds)
    who = PEOPLE[me.leader] if robot < 0 else f"R{robot + 1}"
    return f"{me.mode.name} of {who}"


def view(sim, letter):
    """What the human with a letter sees now."""
    (seen,) = look(sim.world, sim.sight, np.array([body(letter)]))
    return seen


def light(sim, *places):
    """Let these burn from now on."""
    sim.world.flames.arrival.ravel()[list(places)] = sim.world.time
    sim.spread.advance(sim.world.flames, sim.world.time)


def decide(sim, letter):
    """Let the human with a letter think once, and nothing else; its goal."""
    me = mind(sim, letter)
    humans.decide(sim.world, np.array([body(letter)]), [view(sim, letter)])
    return me.goal


def mark(scene, sign, number=1):
    """The landmark of a sign, "+2" the second `+` in reading order, the first floor
    first; or of a Kind and a number. scene: a simulation or its world."""
    landmarks = scene.building.landmarks
    if isinstance(sign, str):
        number = nth(sign)
        is_exit = sign[0] == "E"
        fit = [m for m in landmarks if (m.kind is Kind.EXIT) == is_exit]
    else:
        fit = [m for m in landmarks if m.kind is sign]
    fit.sort(key=lambda m: (m.floor, *m.cells[0].tolist()))
    return fit[number - 1].index


# -- The words of a scene -----------------------------------------------------------


def named(text):
    """Who is named, p if nobody is, and the signs that follow: "q+1E", "+2", "pR2"."""
    for word in text.split():
        first, *others = re.findall(r"[p-zR+:E]\d*", word)
        if first[0] in "+:E":
            yield "p", [first, *others]
        else:
            yield first, others


def leads(world, letters):
    """These lead."""
    for letter in letters:
        world.minds[body(letter)].mode = Mode.LEADER
        world.bodies.mode[body(letter)] = Mode.LEADER


def follows(world, text, ago=0.0):
    """One follows another, whom it saw so many seconds ago where it is now."""
    bodies = world.bodies
    for letter, (sign,) in named(text):
        i = body(letter)
        leader = body(sign, len(world.minds))
        me = world.minds[i]
        me.mode = Mode.FOLLOWER
        me.leader = leader
        bodies.mode[i] = me.mode
        bodies.leader[i] = leader

        # what it has seen and heard
        me.seen_at = world.time - ago
        if sign[0] == "R":
            robot = world.robots[body(sign)]
            me.seen_place = robot.place
            me.told = robot.says
        else:
            me.seen_place = int(bodies.place[leader])
            me.told = None


def lost(world, text):
    """One follows another whom it has not seen for long."""
    follows(world, text, ago=10.0)


def visited(world, text):
    """One has passed doors, the last one last."""
    for letter, signs in named(text):
        me = world.minds[body(letter)]
        for sign in signs:
            door = mark(world, sign)
            me.doors.add(door)
            me.trail.append(Passed(door, NOWHERE))


def at(world, text):
    """One stands in a door, entrance or exit."""
    nav = navigation_of(world.building)
    for letter, (sign,) in named(text):
        i = body(letter)
        place = nav.goals[mark(world, sign)][0]
        world.bodies.place[i] = place
        world.bodies.position[i] = nav.centres[place]


def says(world, text):
    """A robot sends people to a landmark, or says "follow me"."""
    for robot, signs in named(text):
        told = [mark(world, sign) for sign in signs]
        world.robots[body(robot)].says = told[0] if told else NOWHERE


def still(world, letters):
    """These stand still for good."""
    world.bodies.pace[[body(letter) for letter in letters]] = 0.0


def clock(world, seconds):
    """So many seconds have passed; everybody made headway just now."""
    world.time = world.bodies.headway_time[:] = seconds


def health(world, points):
    """Some have lost health."""
    for letter, left in points.items():
        world.bodies.health[body(letter)] = left


WORDS = {"time": clock, "at": at, "says": says, "visited": visited, "leads": leads}
WORDS |= {"follows": follows, "lost": lost, "still": still, "health": health}
"""What is said of a scene, in the order in which it comes true."""


# -- From text to world -------------------------------------------------------------


CORRIDOR = "a row between two walls"


def split(board):
    """The rows of each floor of a board, with walls around a single one."""
    floors = []
    for floor in drawn(board).split("\n\n"):
        rows = floor.splitlines()
        if len(rows) == 1:
            wall = "#" * len(rows[0])
            rows = [wall, *rows, wall]
        floors.append(rows)
    return floors


def beside(picture):
    """The boards that stand beside each other in a picture, from left to right."""
    columns = zip_longest(*drawn(picture).splitlines(), fillvalue=" ")
    boards = []
    for blank, part in groupby(columns, key=lambda column: set(column) == {" "}):
        if not blank:
            rows = zip(*part, strict=True)
            boards.append(Board("\n".join("".join(row).rstrip() for row in rows)))
    return boards


def built(board):
    """The building under a board, without people, robots and flames."""
    bare = dict.fromkeys(PEOPLE + "R*,_123456789", ".") | {":": "+"}
    walls = drawn(board).translate(str.maketrans(bare))
    return built_once(Board(walls), paper.PROTECTED_METRES)


@cache
def built_once(board, _):
    """The same building for the same walls, as long as nothing else changes it."""
    floors = split(board)
    width = max(len(row) for rows in floors for row in rows)
    title = CORRIDOR if "\n" not in board.replace("\n\n", "") else "board"
    text = f"building: {title}\nsize: {width} x {len(floors[0])}\n"
    for number, rows in enumerate(floors, 1):
        text += f"floor {number}:\n" + "\n".join(rows) + "\n"
    return Building(parse(text))


shipped = cache(load)
"""A building that ships, prepared only once for all tests."""


def walled(rows):
    """A building of one floor: these cells, with one free, and walls around them."""
    first, *others = rows
    free = ["." + first[1:], *others]
    wall = "#" * (len(first) + 2)
    drawn_rows = (wall, *(f"#{row}#" for row in free), wall)
    storey = Storey("", drawn_rows)
    return Building(Drawing("grid", len(wall), len(drawn_rows), (storey,)))


def empty(building):
    """The world of a building without people, robots and flames."""
    return Simulation(building, Scenario(people=0)).world


def flames(spread, *sources):
    """The flames after these sources, all that they will ever reach."""
    world = empty(spread.building)
    for source in sources:
        spread.ignite(world.flames, source)
    return world.flames


def found(floors, letters):
    """(floor, row, col) of every letter that is one of these, letter by letter."""
    return [
        (floor, row, col)
        for letter in letters
        for floor, rows in enumerate(floors)
        for row, line in enumerate(rows)
        for col, here in enumerate(line)
        if here == letter
    ]


def as_drawn(floors, building, scenario, rng):
    """The world at 0 s, with everybody and every flame where the board has them."""
    world = starting_world(building, scenario, rng)
    nav = navigation_of(building)
    bodies = world.bodies
    shape = building.kind.shape

    # people and robots
    for i, cell in enumerate(found(floors, PEOPLE)):
        p = int(np.ravel_multi_index(cell, shape))
        bodies.place[i] = p
        bodies.floor[i] = cell[0]
        bodies.pace[i] = WALKING_SPEED
        bodies.rank[i] = i / len(bodies)
        for array in (bodies.position, bodies.target, bodies.goal, bodies.headway):
            array[i] = nav.centres[p]
    for robot, cell in zip(world.robots, found(floors, "R"), strict=True):
        robot.place = int(np.ravel_multi_index(cell, shape))
        robot.position = nav.centres[robot.place]

    # what p has explored
    patches = sight_of(building, scenario.sight_range).patches.reshape(shape)
    for cell in found(floors, "_"):
        world.minds[0].patches.add(int(patches[cell]))

    # fire
    world.burnt = {int(building.landmark[cell]) for cell in found(floors, ":")}
    for floor, row, col in found(floors, "*,"):
        is_ash = floors[floor][row][col] == ","
        world.flames.arrival[floor, row, col] = (
            -scenario.burn_seconds if is_ash else 0.0
        )
        x, y = building.metres(row, col)
        world.flames.sources.append(FireLit(0.0, floor, x, y))
    Spread(building, scenario, rng).advance(world.flames, 0.0)
    return world
