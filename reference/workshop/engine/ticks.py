"""The tick, from one decision to the next: mirrors `simulation.step`.

A call goes on until something is the book's to do, and says what: the strategies
decide, a row of the tables is missing, there is no more room.

    N  the numbers;  T  the tables;  S  the state
    np.int64(x)  a variable, and what a function returns, have one type in all branches
"""

from math import inf

import numpy as np

from reference.workshop.engine.burns import advance_flames, burn_doors, lose_health
from reference.workshop.engine.mirrors import compiled, mirrors
from reference.workshop.engine.robots import act
from reference.workshop.engine.sees import (
    ENTRANCE,
    EXIT,
    FATE_INSIDE,
    Observe,
    find_row,
    grid_cell,
    lay_grid,
    look,
    turn_towards_goal,
)
from reference.workshop.engine.state import DIED, DOOR_BURNT, EVACUATED, LEFT_FLOOR
from reference.workshop.engine.thinks import pass_landmark, show_decision, think
from reference.workshop.engine.walks import (
    Obstacles,
    advance,
    descend,
    enter_stairs,
    neighbours,
    step,
    target,
)
from reference.workshop.engine.ways import place_beyond
from reference.world import FLOOR_APART, Fate

FATE_EVACUATED = int(Fate.EVACUATED)
FATE_DEAD = int(Fate.DEAD)

# where a call goes on
SENSE, ROBOTS, MOVE = range(3)
# why it came back
PLAYED, OVER, STRATEGIES, ROW, MEMORY, PAIRS, EVENTS = range(7)


@mirrors(
    "simulation.Simulation.step 5b2e4c",
    "simulation.Simulation.robots_move 33a19e",
    entry=True,
)
def play(T, S, rng):
    """Go on until the book has something to do; say what."""
    N = S.numbers[0]
    clock = S.clock[0]
    observe = Observe(
        S.now, S.seen, T.cells, T.square, T.hits, T.opens, T.lists, S.burning
    )  # fmt: skip
    while True:
        if clock.phase == SENSE:
            if clock.left == 0:
                return PLAYED
            if is_done(N, clock, S.bodies):
                return OVER
            # a tick brings no more: four of a person, one of a landmark
            if clock.events + 4 * N.people + N.landmarks > len(S.events):
                return EVENTS
            for i in range(N.people):
                mind = S.minds[i]
                if mind.been == N.most_been or mind.trail == N.most_trail:
                    return MEMORY
            for k in range(len(S.robots)):
                if S.robots[k].end == S.ways.shape[1]:  # by corners that it would cut
                    return MEMORY
            if not sense(N, T, S, clock):
                return ROW
            decide(N, T, S, clock, observe)
            clock.phase = ROBOTS
            if clock.ticks % N.decision_ticks == 0:
                if len(S.robots) or (clock.fire and fire_turn(N, clock)):
                    return STRATEGIES

        if clock.phase == ROBOTS:
            for k in range(len(S.robots)):
                act(N, T, S, clock, k)
            clock.phase = MOVE

        if not people_move(N, T, S, rng):
            return PAIRS  # nobody has moved yet, and no number is drawn
        burn(N, T, S, clock)
        lose_health(N, clock, S.bodies, S.harm)
        settle(N, T, S, clock)
        clock.phase = SENSE
        clock.left -= 1


@mirrors(
    "simulation.Simulation.done 2d1bf3",
    "world.Bodies.inside 88092e",
    "world.Bodies.walking ddf493",
    "world.Bodies.__len__ af79bb",
)
def is_done(N, clock, bodies):
    """Nobody is inside any more, or time is up."""
    if clock.time >= N.time_limit - 1e-9:
        return True
    for i in range(N.people):
        if bodies[i].fate == FATE_INSIDE:
            return False
    return True


@mirrors(
    "simulation.Simulation.fire_turn 37158f",
    "simulation.Simulation.strategies_decide ba9a4c",
    "fire.NoFire.decide 2603f8",
)
def fire_turn(N, clock):
    """Is it the fire's turn, with sources left, at a decision? [D2, D6]"""
    since = clock.ticks // N.decision_ticks - N.fire_first
    return since >= 0 and since % N.fire_every == 0 and clock.sources < N.most_sources


# -- SENSE and DECIDE ---------------------------------------------------------------


@compiled
def sense(N, T, S, clock):
    """Find the row of all who are due; False: one is missing."""
    clock.thinking = 0
    for i in range(N.people):
        body = S.bodies[i]
        if S.due[i] and body.fate == FATE_INSIDE and body.stairwell < 0:
            row = find_row(
                T.rows, T.cells, T.hits, T.lists, S.burnt, S.wanted, body.place
            )
            if row < 0:
                return False
            S.who[clock.thinking] = i
            S.row_of[i] = row
            clock.thinking += 1
    return True


@mirrors("humans.decide fb2cbf")
def decide(N, T, S, clock, observe):
    """Let those who are due think; then show on their bodies what they have decided."""
    if not clock.thinking:
        return
    place_people(N, S, S.grid[0])
    for k in range(clock.thinking):
        i = S.who[k]
        body = S.bodies[i]
        me = S.minds[i]
        look(
            N, clock, S.bodies, S.spots, S.grid[0], S.heads, S.robots, S.burnt, T.cells,
            T.rows[S.row_of[i]], observe, S.row_of[i], i,
        )  # fmt: skip
        if think(N, me, S.memory[i], observe, S.some):
            turn_towards_goal(me, body.place, T.cells, T.marks)
    for k in range(clock.thinking):
        i = S.who[k]
        show_decision(N, S.minds[i], S.bodies[i], T.cells, T.clear, T.ways)


@compiled
def place_people(N, S, grid):
    """Put all who walk on a floor into the grid, low numbers first."""
    lay_grid(N, grid, S.heads, N.reach)
    for i in range(N.people - 1, -1, -1):
        body = S.bodies[i]
        if body.fate == FATE_INSIDE and body.stairwell < 0:
            spot = S.spots[i]
            spot.x = body.x + FLOOR_APART * body.floor
            spot.y = body.y
            spot.cell = grid_cell(N, grid, body.floor, body.x, body.y)
            spot.later = S.heads[spot.cell]
            S.heads[spot.cell] = i


# -- MOVE ---------------------------------------------------------------------------


@mirrors("simulation.Simulation._people_move 25036e")
def people_move(N, T, S, rng):
    """Walk people one tick; False: there is no room for so many pairs."""
    clock = S.clock[0]
    n = 0
    for i in range(N.people):
        body = S.bodies[i]
        if body.fate == FATE_INSIDE and body.stairwell < 0:
            w = S.walkers[n]
            w.i = i
            w.floor = body.floor
            w.x = body.x
            w.y = body.y
            w.pace = body.pace
            n += 1
    count = neighbours(N, S.walkers, n, S.pairs, S.grid[0], S.heads)
    if count < 0:
        return False

    for k in range(n):
        w = S.walkers[k]
        body = S.bodies[w.i]
        w.inside = T.cells[body.place].mark
        reckless = body.reckless_until > clock.time - 1e-9
        w.fearless = S.burning[body.place] or reckless
        target(N, T.cells, T.ways, T.after, T.waypoint, clock, body, w)
    obstacles = Obstacles(T.cells, S.full_until, S.burning, S.clock)
    step(N, obstacles, S.walkers, n, S.pairs, count, rng)
    clock.touched = 0
    clock.walked = n
    for k in range(n):
        advance(N, T.cells, clock, S.bodies, S.touched, S.walkers[k])
    fill_doors(N, T, S, clock)
    return True


@mirrors("simulation.Simulation.fill_doors 48ef6c")
def fill_doors(N, T, S, clock):
    """Close the doors, entrances and exits just entered until they have room [A5]."""
    for k in range(clock.touched):
        mark = T.cells[S.bodies[S.touched[k].i].place].mark
        count = 0
        first = True
        for other in range(clock.touched):
            if T.cells[S.bodies[S.touched[other].i].place].mark == mark:
                count += 1
                first = first and other >= k
        if not first:
            continue
        way = T.marks[mark]
        flow = N.STAIRS_FLOW if way.kind == ENTRANCE else N.DOOR_FLOW
        since = S.full_until[mark]
        if since <= clock.time - N.tick + 1e-9:  # free for a tick or longer
            since = clock.time
        S.full_until[mark] = since + count / (flow * way.width)


# -- BURN ---------------------------------------------------------------------------


@mirrors("simulation.Simulation.burn 6e91f8")
def burn(N, T, S, clock):
    """Advance the clock; spread flames and burn doors [A6] [D7]."""
    inside = 0
    for i in range(N.people):
        inside += S.bodies[i].fate == FATE_INSIDE
    clock.ticks += 1
    clock.time = clock.ticks * N.tick
    clock.person_seconds += N.tick * inside
    if clock.time < clock.flames_change or clock.ticks % N.flame_ticks:
        return
    advance_flames(N, clock, T.cells, S.arrival, S.burning, S.ash, S.harm, S.cost)
    burn_doors(N, T.cells, T.marks, S.burning, S.burnt, S.fresh)
    for mark in range(N.landmarks):  # in the order of their numbers
        if S.fresh[mark]:
            S.fresh[mark] = 0
            S.burnt[mark] = True
            note_event(S, clock, DOOR_BURNT, -1, -1, 0.0, mark)


# -- SETTLE -------------------------------------------------------------------------


@mirrors("simulation.Simulation.settle fda0cb")
def settle(N, T, S, clock):
    """Settle deaths, triggers and stairs; set who thinks in the next tick [B4]."""
    for i in range(N.people):
        body = S.bodies[i]
        if body.health <= N.NO_HEALTH and body.fate == FATE_INSIDE:
            body.health = 0.0
            leave(body, FATE_DEAD)
            note_event(S, clock, DIED, i, body.floor, 0.0, -1)

    turn = clock.ticks % N.RECONSIDER_TICKS
    for i in range(N.people):
        S.due[i] = S.turn[i] == turn
    for k in range(clock.touched):
        i = S.touched[k].i
        if S.bodies[i].fate == FATE_INSIDE:
            touch(N, T, S, clock, i, S.touched[k].before)

    for i in range(N.people):
        body = S.bodies[i]
        if body.stairs_until <= clock.time:
            passed = descend(N, T, clock, S, i)
            if passed >= 0:
                note_event(S, clock, LEFT_FLOOR, i, passed, body.health, -1)
            S.due[i] = body.fate == FATE_INSIDE and body.stairwell < 0


@mirrors("simulation.Simulation._touch 54a21f")
def touch(N, T, S, clock, i, before):
    """Fire the trigger of the door, entrance or exit that a body touches [A5]."""
    body = S.bodies[i]
    mark = np.int64(T.cells[body.place].mark)
    landmark = T.marks[mark]
    if landmark.leads_out:
        note_event(S, clock, LEFT_FLOOR, i, landmark.floor, body.health, -1)
    if landmark.kind == EXIT:  # out: the loop ends [A4, Alg. 1:1, Alg. 2:1]
        leave(body, FATE_EVACUATED)
        note_event(S, clock, EVACUATED, i, landmark.floor, body.health, mark)
    elif landmark.leads_out:
        enter_stairs(N, T, clock, S, i, mark)
    elif not S.burnt[mark]:
        side = np.int64(T.cells[before].area)
        beyond = place_beyond(N, T.cells, body.place, side)
        pass_landmark(N, S.minds[i], S.memory[i], mark, side, beyond)
        S.due[i] = True


@mirrors("simulation.Simulation._leave 4785c3")
def leave(body, fate):
    """Take a human out of the simulation."""
    body.fate = fate
    body.leader = -1
    body.landmark = -1
    body.stairwell = -1
    body.stairs_until = inf


@mirrors("simulation.Simulation._record_floor_left de79c9")
def note_event(S, clock, kind, person, floor, health, mark):
    """Note an event, to be told to the book."""
    event = S.events[clock.events]
    event.time = clock.time
    event.health = health
    event.kind = kind
    event.person = person
    event.floor = floor
    event.mark = mark
    clock.events += 1
