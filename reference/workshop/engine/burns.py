"""How flames spread and burn doors, and what health is lost.

Mirrors `fire` and part of `simulation`.

N  the numbers;  clock  the time, and what burns;  p, q  places
"""

from math import inf

from reference.building import Kind
from reference.workshop.engine.mirrors import mirrors
from reference.workshop.engine.sees import FATE_INSIDE

DOOR = int(Kind.DOOR)


@mirrors("fire.Spread.advance 512656", "fire.cost_of_flames 329dbf")
def advance_flames(N, clock, cells, arrival, burning, ash, harm, cost):
    """Burn every cell whose time has come, till its time is over: then it is ash."""
    coming = inf
    alight = 0
    for p in range(N.places):
        ends = arrival[p] + N.burn_seconds
        ash[p] = ends <= clock.time
        burning[p] = arrival[p] <= clock.time and not ash[p]
        alight += burning[p]
        if not ash[p]:
            coming = min(coming, ends if burning[p] else arrival[p])
    for p in range(N.places):
        if burning[p]:
            harm[p] = N.BURN_LOSS
            cost[p] = N.BURN_COST
        elif is_beside(N, cells, burning, p):
            harm[p] = N.HEAT_LOSS
            cost[p] = N.HEAT_COST
        else:
            harm[p] = 0.0
            cost[p] = 1.0
    clock.alight = alight
    clock.flames_change = coming
    clock.flames_moved = 1


@mirrors("fire.cells_beside 60bd01", "navigation.shifted b245e7")
def is_beside(N, cells, burning, p):
    """Is this a walkable cell that shares a side with one that burns?"""
    if not cells[p].walkable:
        return False
    row = p % N.floor_size // N.cols
    col = p % N.cols
    if col + 1 < N.cols and burning[p + 1]:
        return True
    if row + 1 < N.rows and burning[p + N.cols]:
        return True
    if col > 0 and burning[p - 1]:
        return True
    return row > 0 and burning[p - N.cols]


@mirrors("simulation.Simulation._burn_doors 83bce2")
def burn_doors(N, cells, marks, burning, burnt, fresh):
    """Destroy the regular doors that have flames beside them [A6]; `fresh`: these."""
    for p in range(N.places):
        mark = cells[p].mark
        if mark >= 0 and marks[mark].kind == DOOR and not burnt[mark]:
            if burning[p] or is_beside(N, cells, burning, p):
                fresh[mark] = 1


@mirrors("simulation.Simulation.lose_health e4a007")
def lose_health(N, clock, bodies, harm):
    """Lower everybody's health, and more in and beside flames [B7]."""
    for i in range(N.people):
        body = bodies[i]
        if body.fate == FATE_INSIDE:
            body.health -= N.health_rate
            if clock.sources and body.stairwell < 0:
                body.health -= harm[body.place] * N.tick
