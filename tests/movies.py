"""Boards as tests: draw a scene, let seconds pass, and read the board again.

    # . + E A-D   the building, as in a floor file but without names of rooms
    p q r ...     people, in this order; a later letter outranks an earlier one
    R             robots, in reading order, equally many on every floor
    *             flames that stay as they are drawn

Floors are drawn one below the other, the first floor first, with a blank line between.
People walk at WALKING_SPEED, robots stand still unless a strategy is given, and nothing
is left to chance.
"""

from functools import cache
from inspect import cleandoc
from math import ceil

import numpy as np
from hypothesis import strategies as st

from reference import walking
from reference.beginning import beginning
from reference.building import Building
from reference.fire import Spread
from reference.floorplan import Plan, Storey, parse
from reference.navigation import navigation_of
from reference.paper import WALKING_SPEED, Scenario
from reference.perception import look
from reference.simulation import Simulation
from reference.workshop.maps import load
from reference.workshop.strategies import FIRES, ROBOTS
from reference.world import FireLit, Mode

PEOPLE = "pqrstuvwxyz"

GRIDS = st.integers(3, 9).flatmap(
    lambda width: st.lists(
        st.text(st.sampled_from("..#"), min_size=width, max_size=width),
        min_size=3,
        max_size=9,
    )
)
"""Random floors, for hypothesis; `walled` builds them."""


# -- A scene, and what becomes of it ------------------------------------------------


def stage(board, robots=None, fire="none", **scenario):
    """A simulation that begins as drawn; scenario: what else differs from the paper."""
    floors = split(board)
    people = tuple(len(found([rows], PEOPLE)) for rows in floors)
    guides = len(found(floors[:1], "R"))
    scene = Scenario(people_per_floor=people, robots_per_floor=guides, **scenario)
    world = as_drawn(floors, built(board), scene, np.random.default_rng(0))
    sides = robots_named(robots or Idle()), fire_named(fire)
    return Simulation(world.building, scene, *sides, world=world)


def robots_named(who):
    """Robots by a name of ROBOTS, or the strategy itself."""
    return ROBOTS[who]() if isinstance(who, str) else who


def fire_named(who):
    """A fire by a name of FIRES, or the strategy itself."""
    return FIRES[who]() if isinstance(who, str) else who


class Idle:
    """Robots that are there and never decide."""

    def decide(self, world, robots, rng):
        """Nothing."""
        return [None] * len(robots)


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


def show(sim):
    """The board now: people before robots before flames before the building."""
    floors = [[list(row) for row in s.rows] for s in sim.building.plan.storeys]
    bodies, cell = sim.world.bodies, sim.building.cell
    for floor, row, col in np.argwhere(sim.world.flames.burning):
        floors[floor][row][col] = "*"
    for robot in sim.world.robots:
        row, col = cell(*robot.position)
        floors[robot.floor][row][col] = "R"
    for i in np.flatnonzero(bodies.inside)[::-1]:
        row, col = cell(*bodies.position[i])
        floors[bodies.floor[i]][row][col] = PEOPLE[i]
    return joined(["".join(row).rstrip() for row in rows] for rows in floors)


def drawn(board):
    """A board as `show` draws it, however it is indented in a test."""
    return joined(split(board))


# -- Who is on the board ------------------------------------------------------------


def body(letter):
    """The body that a letter marks."""
    return PEOPLE.index(letter)


def mind(sim, letter):
    """What the human with a letter remembers."""
    return sim.world.minds[body(letter)]


def view(sim, letter):
    """What the human with a letter sees now."""
    return look(sim.world, sim.sight, np.array([body(letter)]))[0]


def light(sim, *places):
    """Let these burn from now on."""
    sim.world.flames.arrival.ravel()[list(places)] = sim.world.time
    sim.spread.advance(sim.world.flames, sim.world.time)


def decide(sim, letter):
    """Let the human with a letter think once, and nothing else; its goal."""
    me = mind(sim, letter)
    walking.decide(sim.world, np.array([body(letter)]), [view(sim, letter)])
    return me.goal


def lead(sim, *letters):
    """Let these people be leaders."""
    for letter in letters:
        mind(sim, letter).mode = Mode.LEADER
        sim.world.bodies.mode[body(letter)] = Mode.LEADER


def follow(sim, letter, leader):
    """Let one human follow a body, as if it had seen it a moment ago where it is."""
    me, bodies, n = mind(sim, letter), sim.world.bodies, len(sim.world.minds)
    me.mode, me.leader = Mode.FOLLOWER, leader
    bodies.mode[body(letter)], bodies.leader[body(letter)] = me.mode, leader
    robot = sim.world.robots[leader - n] if leader >= n else None
    me.seen_at, me.told = sim.world.time, robot and robot.says
    me.seen_place = robot.place if robot else int(bodies.place[leader])


def mark(sim, kind, nth=1):
    """The nth landmark of a kind in reading order, the first floor first."""
    return [m.index for m in sim.building.landmarks if m.kind is kind][nth - 1]


class Send:
    """A strategy that sends all robots to one place, in metres."""

    def __init__(self, x, y):
        self.destination = (x, y)

    def decide(self, world, robots, rng):
        """Always the same."""
        return [self.destination] * len(robots)


# -- From text to world -------------------------------------------------------------


def split(board):
    """The rows of each floor of a board."""
    floors = cleandoc(board).split("\n\n")
    return [[row.rstrip() for row in floor.splitlines()] for floor in floors]


def joined(floors):
    """A board from the rows of each floor."""
    return "\n\n".join("\n".join(rows) for rows in floors)


def built(board):
    """The building under a board, without people, robots and flames."""
    floors = split(board)
    width = max(len(row) for rows in floors for row in rows)
    text = f"building: board\nsize: {width} x {len(floors[0])}\n"
    bare = str.maketrans(dict.fromkeys(PEOPLE + "R*", "."))
    for number, rows in enumerate(floors, 1):
        text += f"floor {number}:\n" + "\n".join(rows).translate(bare) + "\n"
    return Building(parse(text))


@cache
def shipped(name):
    """A building that ships, prepared only once for all tests."""
    return load(name)


def walled(rows):
    """A building of one floor: these cells, with one free, and walls around them."""
    rows = ["." + rows[0][1:], *rows[1:]]
    side = "#" * (len(rows[0]) + 2)
    rows = (side, *(f"#{row}#" for row in rows), side)
    return Building(Plan("grid", len(side), len(rows), (Storey("", rows),)))


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
    world = beginning(building, scenario, rng)
    nav, bodies = navigation_of(building), world.bodies
    for i, cell in enumerate(found(floors, PEOPLE)):
        p = int(np.ravel_multi_index(cell, building.kind.shape))
        bodies.place[i], bodies.floor[i], bodies.pace[i] = p, cell[0], WALKING_SPEED
        for array in (bodies.position, bodies.target, bodies.anchor):
            array[i] = nav.centres[p]
        bodies.rank[i] = i / len(bodies)
    for robot, cell in zip(world.robots, found(floors, "R"), strict=True):
        robot.place = int(np.ravel_multi_index(cell, building.kind.shape))
        robot.position = nav.centres[robot.place]
    for floor, row, col in found(floors, "*"):
        world.flames.arrival[floor, row, col] = 0.0
        world.flames.sources.append(FireLit(0.0, floor, *building.metres(row, col)))
    Spread(building, rng).advance(world.flames, 0.0)
    return world
