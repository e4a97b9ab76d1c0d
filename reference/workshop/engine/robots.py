"""Robots on their way: mirrors `robots`; where they go is decided by the book.

N  the numbers;  T  the tables;  S  the state;  W  what ways are found with
robot  a record ROBOT;  way  places, from `at` to `end`
np.int64(x)  a variable, and what a function returns, have one type in all branches
"""

from math import inf, sqrt

import numpy as np

from reference.workshop.engine.mirrors import mirrors
from reference.workshop.engine.sees import FATE_INSIDE
from reference.workshop.engine.state import ROOM_IN_FRONT
from reference.workshop.engine.walks import place_around
from reference.workshop.engine.ways import (
    nearest_free,
    next_place,
    reaches,
    search_to,
)


@mirrors("world.World.anybody_at_or_above bbe873", "world.World.occupancy 28a901")
def anybody_at_or_above(N, bodies, floor):
    """Is anybody inside on a floor, or above? [C8]"""
    for i in range(N.people):
        if bodies[i].fate == FATE_INSIDE and bodies[i].floor >= floor:
            return True
    return False


@mirrors("robots.RobotAlgorithm.act 4dd1f5")
def act(N, T, S, clock, k):
    """One pass of Algorithm 3; lines 4 and 5 are done in `going.instruct`."""
    robot = S.robots[k]
    robot.active = anybody_at_or_above(N, S.bodies, robot.floor)  # Alg. 3:1
    if robot.active:
        speed = speed_while_leading(N, T.cells, S.bodies, robot)  # Alg. 3:2
        if robot.decided:  # Alg. 3:3
            plan(N, T, S, clock, robot, S.ways[k])
        move(N, T.cells, robot, S.ways[k], speed * N.tick)  # Alg. 3:7
    robot.decided = 0


@mirrors(
    "robots.flame_cost 58862a",
    "navigation.Navigation.way 28245e",
    "navigation.Navigation.shortest 47c82d",
    "navigation.Navigation.corners 8d95f4",
)
def plan(N, T, S, clock, robot, way):
    """Find the way to where a robot has decided to go: places, from `at` to `end`."""
    W = T.ways
    goal = nearest_free(N, T.cells, robot.floor, robot.to_x, robot.to_y)
    start = robot.floor * N.floor_size
    costly = False
    if clock.alight:
        for p in range(start, start + N.floor_size):
            costly = costly or S.burning[p]
    at = robot.place
    robot.at = ROOM_IN_FRONT
    robot.end = ROOM_IN_FRONT
    if costly:
        search_to(N, W, S.cost[start : start + N.floor_size], goal, at - start)
        if W.d[at - start] == inf:
            return
        while at != goal and W.after[at - start] != at - start:
            at = start + np.int64(W.after[at - start])
            way[robot.end] = at
            robot.end += 1
    else:
        corner = at
        if at != goal and next_place(N, W, at, goal) == at:
            return
        while at != goal:
            after = next_place(N, W, at, goal)
            if not reaches(N, T.clear, corner, after):
                corner = at
                way[robot.end] = at
                robot.end += 1
            at = after
        way[robot.end] = goal
        robot.end += 1
    if robot.end == robot.at:
        way[robot.end] = at
        robot.end += 1


@mirrors("robots.speed_while_leading e73d24", "robots.followers_of 7ebcdd")
def speed_while_leading(N, cells, bodies, robot):
    """The speed (m/s) at which followers keep up [C7, chosen]."""
    if robot.at == robot.end:
        return N.ROBOT_SPEED
    if cells[robot.place].to_landmarks < N.DOORWAY_METRES:
        return N.ROBOT_SPEED
    count = 0
    metres = 0.0
    for i in range(N.people):
        body = bodies[i]
        if body.leader == robot.body:
            x = body.x - robot.x
            y = body.y - robot.y
            metres += sqrt(x * x + y * y)
            count += 1
    if not count:
        return N.ROBOT_SPEED
    waits = metres / count > N.FOLLOWER_GAP + N.CROWD_GAP * sqrt(count)
    return 0.0 if waits else N.ROBOT_SPEED


@mirrors("robots.RobotAlgorithm._move 8b2ec0", "building.distance cdc4c8")
def move(N, cells, robot, way, metres):
    """Walk along the way, as far as the metres carry.

    A strategy may have put the robot anywhere: outside the drawing, too, where the book
    would look elsewhere or fail.
    """
    x = robot.x
    y = robot.y
    while robot.at < robot.end and metres > 0:
        to = cells[way[robot.at]]
        off_x = to.x - x
        off_y = to.y - y
        left = sqrt(off_x * off_x + off_y * off_y)
        if left > metres:
            x += (to.x - x) * metres / left
            y += (to.y - y) * metres / left
            break
        robot.at += 1
        metres -= left
        x = to.x
        y = to.y
    place = place_around(N, robot.floor, x, y)
    if 0 <= place < N.places and cells[place].walkable:
        robot.x = x
        robot.y = y
        robot.place = place
    else:  # it would cut a corner: go to its cell's middle first
        if robot.at == 0:
            for k in range(robot.end, 0, -1):
                way[k] = way[k - 1]
            robot.end += 1
            robot.at = 1
        robot.at -= 1
        way[robot.at] = robot.place
