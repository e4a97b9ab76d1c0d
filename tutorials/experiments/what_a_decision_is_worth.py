"""What is one decision worth? Branch there, and play every choice on.

    python tutorials/experiments/what_a_decision_is_worth.py play out/worth.csv
    python tutorials/experiments/what_a_decision_is_worth.py show out/worth.csv

`play` draws evacuations, in each a decision, and there a robot; it sends the robot to
each of its anchors for some decisions; then the team's own strategy goes on. How it is
measured stands in `workshop/measuring/branching.py`. A row is appended to the table for
each decision; what is in the table is not played again. `show` prints gains with
intervals, and draws where and when a better decision exists, and what it is.

To check the method where the answer is known, `play --fires fixed --where guard --held
1 4 8` draws among the decisions at which `guard` would set off.
"""

import sys
from argparse import ArgumentParser
from dataclasses import asdict, dataclass, replace
from itertools import product
from math import nan
from pathlib import Path
from time import process_time
from typing import NamedTuple

import numpy as np
from kept_rows import begun, measure_all, read_rows

from reference import Simulation, load
from reference.building import distance
from reference.paper import InputError
from reference.robots import followers_of
from reference.workshop.commands.common import exit_status
from reference.workshop.commands.options import whole
from reference.workshop.comparing.intervals import format_interval, interval_of_mean
from reference.workshop.drawing import page
from reference.workshop.drawing.choices import GUARDED
from reference.workshop.engine import run_to_decision
from reference.workshop.measuring.branching import (
    CHOICE_KINDS,
    FUTURES,
    GO_ON,
    TO_FOOT,
    TO_PERSON,
    TO_RIM,
    TO_STAY,
    TO_WAY_OUT,
    Choice,
    branches,
    choices_of,
    mean_and_error,
    own_kind,
    saved,
    surely_more,
    worth_of,
)
from reference.workshop.storage.workers import one_thread
from reference.workshop.strategies.guard import Guard
from reference.workshop.strategies.guides import Observer

FIRES = ("random", "closer", "busiest", "fixed", "learned")
BASES = ("observer", "learned")
ANY, GUARD = "any", "guard"
OWN = "own"  # the kind of a decision that nothing beats
AT_GUARD = 1.0  # metres
TIMES = ((0, 50), (50, 100), (100, 250))  # seconds


@dataclass(frozen=True)
class Job:
    """One decision to measure; seed: of its evacuation."""

    building: str
    where: str
    held: int
    base: str
    fire: str
    seed: int


@dataclass(frozen=True)
class Row(Job):
    """What came of it; people are counted, of those of the scenario.

    led      by the robot at (x, y);  own  what the team decides
    kind     of the best choice, at (to_x, to_y), `way` metres away
    helps    whether the robot's masks allow it
    gain     in fresh futures;  believed  where it was chosen
    guards   gain of standing where `guard` would;  found  whether that is the best
    error    of each, the standard error of the mean
    seconds  of a processor
    """

    time: float
    floor: int
    robot: int
    x: float
    y: float
    led: int
    choices: int
    own: str
    kind: str
    to_x: float = nan
    to_y: float = nan
    way: float = nan
    helps: int = 1
    believed: float = 0.0
    believed_error: float = 0.0
    gain: float = 0.0
    gain_error: float = 0.0
    guards: float = nan
    guards_error: float = nan
    found: int = 0
    seconds: float = 0.0


# -- One decision -------------------------------------------------------------------


class Drawn(NamedTuple):
    """A decision, and a robot; guard: where `guard` would send it, or None."""

    run: Simulation
    robot: int
    guard: tuple[float, float] | None


def decision_drawn(job, rng):
    """Draw one of all decisions of all robots of an evacuation; None if none counts."""
    run = begun(job)
    guard = Guard()
    found = []
    while not run.done:
        team = {k: None for k, robot in enumerate(run.world.robots) if robot.active}
        if job.where == GUARD:
            team = guards_now(run, guard, rng)
        if team:
            now = run.copy()
            found += [Drawn(now, robot, to) for robot, to in team.items()]
        run_to_decision([run])
    return found[rng.integers(len(found))] if found else None


def guards_now(run, guard, rng):
    """Who sets off now to stand where `fixed` will light, by number: and where to."""
    active = [robot for robot in run.world.robots if robot.active]
    answers = guard.decide(run.world, active, rng)
    others = Observer().decide(run.world, active, rng)
    sent = {}
    for robot, to, other in zip(active, answers, others, strict=True):
        if to != other:
            sent[run.world.robots.index(robot)] = to
    return sent


def measured(job):
    """Measure one decision: a Row, or None where there is none to draw."""
    began = process_time()
    rng = np.random.default_rng([job.seed, 1])  # the same whoever plays
    with one_thread():
        drawn = decision_drawn(job, rng)
        if drawn is None:
            return None
        rounds = [rng.integers(2**62, size=size).tolist() for size in FUTURES]
        row = searched(job, drawn, rounds)
        if drawn.guard is not None:
            row = guarded(row, drawn, rounds[-1])
    return replace(row, seconds=round(process_time() - began, 2))


def searched(job, drawn, rounds):
    """Search for the best choice of a decision: a Row without what `guard` would do."""
    run = drawn.run
    robot = run.world.robots[drawn.robot]
    worth = worth_of(run, robot, job.held, rounds)
    x, y = robot.position.tolist()
    row = Row(
        **asdict(job),
        time=round(run.world.time, 1),
        floor=robot.floor,
        robot=robot.number,
        x=x,
        y=y,
        led=len(followers_of(run.world, robot)),
        choices=worth.choices,
        own=own_kind(run, robot, choices_of(run, robot)),
        kind=OWN,
    )
    best = worth.best
    if best is None:
        return row
    to_x, to_y = best.point
    return replace(
        row,
        kind=best.kind,
        to_x=to_x,
        to_y=to_y,
        way=best.way,
        helps=int(best.helps),
        believed=worth.believed,
        believed_error=worth.believed_error,
        gain=worth.gain,
        gain_error=worth.gain_error,
    )


def guarded(row, drawn, futures):
    """Add what standing where `guard` would is worth, and whether that was found."""
    run = drawn.run
    robot = run.world.robots[drawn.robot]
    stands = Choice(TO_RIM, drawn.guard, nan, True)
    own, other = saved(branches(run, robot, [None, stands], row.held, futures))
    guards, guards_error = mean_and_error(other - own)
    near = distance((row.to_x, row.to_y), drawn.guard) < AT_GUARD
    return replace(row, guards=guards, guards_error=guards_error, found=int(near))


# -- Many ---------------------------------------------------------------------------


def play(asked):
    """Measure decisions: one of each cell, then the next, so that all have as many."""
    seeds = range(asked.seed, asked.seed + asked.decisions)
    each = product(seeds, asked.held, asked.base, asked.fires)
    jobs = [
        Job(asked.building, asked.where, held, base, fire, seed)
        for seed, held, base, fire in each
    ]
    for row in measure_all(Row, measured, jobs, asked):
        print(
            f"{row.base} {row.fire} {row.seed} held {row.held}: {row.kind} "
            f"{row.gain:+.2f}, {row.seconds:.1f} s",
            file=sys.stderr,
        )


# -- What came of it ----------------------------------------------------------------


def told(rows):
    """The mean gain with its interval, in words; a star for an interval above 0."""
    gains = [row.gain for row in rows]
    if len(gains) < 2:
        return f"{len(gains):5}  {sum(gains):+.2f}"
    gain = interval_of_mean(gains)
    star = " *" if gain.low > 0 else ""
    words = format_interval(gain, 2, signed=True, ends=True)
    return f"{len(gains):5}  {words}{star}"


def believed_in(row):
    """Was the best choice surely better where it was chosen?"""
    return surely_more(row.believed, row.believed_error)


def groups(rows):
    """Yield names of parts of these rows, and the parts."""
    yield "all", rows
    yield "believed in", [row for row in rows if believed_in(row)]
    for low, high in TIMES:
        part = [row for row in rows if low <= row.time < high]
        yield f"{low} to {high} s", part
    for floor in sorted({row.floor for row in rows}):
        yield f"floor {floor + 1}", [row for row in rows if row.floor == floor]
    for kind in (*CHOICE_KINDS, OWN):
        yield f"best: {kind}", [row for row in rows if row.kind == kind]
    yield "best: masked", [row for row in rows if not row.helps]


def cell(row):
    """What is told together."""
    return row.building, row.where, row.base, row.fire, row.held


def tell(rows):
    """Print the gains of one cell, and of its parts."""
    building, where, base, fire, held = cell(rows[0])
    seconds = np.mean([row.seconds for row in rows])
    print(f"\n{base} under {fire} in {building}, a choice held for {held} decisions")
    print(f"    CPU {seconds:.1f} s a decision")
    if where == GUARD:
        tell_guard(rows)
        return
    for name, part in groups(rows):
        if part:
            print(f"    {name:28}{told(part)}")


def tell_guard(rows):
    """Print whether the search finds what `guard` does, and what that is worth."""
    parts = {"all": rows}
    for low, high in TIMES:
        parts[f"{low} to {high} s"] = [row for row in rows if low <= row.time < high]
    surely = [row for row in rows if surely_more(row.guards, row.guards_error)]
    parts["where to stand there is surely better"] = surely
    for name, part in parts.items():
        if not part:
            continue
        guards = [replace(row, gain=row.guards) for row in part]
        found = sum(row.found for row in part)
        print(f"    {name}")
        print(f"        {'the best choice':26}{told(part)}")
        print(f"        {'to stand where guard does':26}{told(guards)}")
        print(f"        {'that is the best choice':26}{found:5}")


def show(asked):
    """Print tables, and draw the picture."""
    rows = read_rows(Path(asked.table), Row)
    if not rows:
        raise InputError(f"{asked.table}: there is no row in it, or no file.")
    print("decisions, and people gained by one in fresh futures; * interval above 0")
    for one in sorted(set(map(cell, rows))):
        tell([row for row in rows if cell(row) == one])
    if asked.picture:
        chosen = asked.building, ANY, asked.base, asked.held
        drawn = [
            row
            for row in rows
            if (row.building, row.where, row.base, row.held) == chosen
        ]
        if not drawn:
            raise InputError(
                f"{asked.table}: has no row of {asked.base} in {asked.building}, held "
                f"for {asked.held} decisions, to draw."
            )
        print(page.save(picture(drawn), asked.picture))


# -- The picture --------------------------------------------------------------------

LOOKS = {
    TO_WAY_OUT: ("#009e73", "^"),
    TO_FOOT: ("#cc79a7", "s"),
    TO_RIM: ("#d55e00", "X"),
    TO_PERSON: ("#0072b2", "o"),
    TO_STAY: ("#23272e", "D"),
    GO_ON: ("#e69f00", ">"),
}
"""Colour and marker of each kind."""

NAMES = {TO_RIM: GUARDED}
"""What kinds are called in the legend, as where anchors are drawn."""


def picture(rows):
    """Draw where and when a better decision exists, and what it is.

    Above, the floors: robots by the kind of the choice that was believed in, and arrows
    to it. Below, a panel for each fire: people gained, by time.
    """
    first = rows[0]
    building = load(first.building)
    played = {row.fire for row in rows}
    fires = [fire for fire in FIRES if fire in played] + sorted(played - {*FIRES})
    better = sum(map(believed_in, rows))
    title = (
        f"{first.base}: at {better} of {len(rows)} decisions a better choice is found, "
        f"held for {first.held}"
    )
    figure = page.sheet(title, 15, 10)
    above, below = figure.subfigures(2, 1, height_ratios=(1.25, 1))
    floors = above.subplots(1, building.floors, squeeze=False)[0]
    for floor, axes in enumerate(floors):
        page.paint_floor(axes, building, floor, alpha=0.5)
        draw_floor(axes, [row for row in rows if row.floor == floor])
        axes.label_outer()

    times = below.subplots(1, len(fires), sharex=True, sharey=True, squeeze=False)[0]
    for fire, axes in zip(fires, times, strict=True):
        draw_times(axes, [row for row in rows if row.fire == fire])
        axes.set_title(f"fire: {fire}")
    times[0].set_ylabel("people gained, fresh futures")

    looks = {
        NAMES.get(kind, kind): {"color": colour, "marker": marker, "ls": ""}
        for kind, (colour, marker) in LOOKS.items()
    }
    looks["hollow: no gain"] = {"color": GREY, "marker": "o", "mfc": "w", "ls": ""}
    looks["no better one found"] = {"color": GREY, "marker": ".", "ls": ""}
    looks["mean of all, with interval"] = {"color": page.TEXT, "marker": "_"}
    page.legend(figure, page.samples(looks), ncols=9)
    return figure


GREY = "#9aa3ab"


def draw_mark(axes, x, y, row):
    """Mark a decision by the kind of the best choice; hollow where it gains nothing."""
    if not believed_in(row):
        axes.plot(x, y, ".", color=GREY, ms=4, zorder=1)
        return
    colour, marker = LOOKS[row.kind]
    face = colour if row.gain > 0 else "white"
    axes.plot(x, y, marker, mec=colour, mfc=face, ms=7, zorder=4)


def draw_floor(axes, rows):
    """Draw where robots were, and thin arrows to the better choices."""
    for row in rows:
        draw_mark(axes, row.x, row.y, row)
        if believed_in(row):
            look = {"arrowstyle": "->", "color": LOOKS[row.kind][0], "alpha": 0.5}
            ends = (row.to_x, row.to_y), (row.x, row.y)
            axes.annotate("", *ends, arrowprops=look, zorder=2)


def draw_times(axes, rows):
    """Draw what the decisions of one fire are worth, by time."""
    axes.axhline(0, color=page.FAINT, lw=0.8)
    for row in rows:
        draw_mark(axes, row.time, row.gain, row)
    for low, high in TIMES:
        gains = [row.gain for row in rows if low <= row.time < high]
        if len(gains) > 1:
            mean, least, most = interval_of_mean(gains)
            ends = [[mean - least], [most - mean]]
            last = min(high, 200)
            middle = (low + last) / 2
            half = (last - low) / 2
            axes.errorbar(middle, mean, ends, half, color=page.TEXT, lw=1.5, zorder=5)
    axes.set(xlim=(-5, 205), xlabel="time, s")


def main():
    parser = ArgumentParser(description=__doc__.split("\n")[0])
    commands = parser.add_subparsers(dest="command", required=True)
    player = commands.add_parser("play", help="measure decisions")
    player.add_argument("table", metavar="CSV")
    player.add_argument("--decisions", type=whole(1), default=200, metavar="N")
    player.add_argument("--fires", nargs="+", default=FIRES, metavar="S")
    player.add_argument("--base", nargs="+", default=BASES, metavar="S")
    player.add_argument("--held", nargs="+", type=whole(1), default=[4], metavar="H")
    player.add_argument("--where", choices=(ANY, GUARD), default=ANY)
    player.add_argument("--building", default="paper", metavar="NAME")
    player.add_argument("--seed", type=whole(0), default=100_000, metavar="N")
    player.add_argument("--workers", type=whole(0), default=2, metavar="N")
    player.add_argument("--minutes", type=float, default=240, metavar="CPU")
    shower = commands.add_parser("show", help="print tables, draw the picture")
    shower.add_argument("table", metavar="CSV")
    shower.add_argument("--picture", metavar="FILE")
    shower.add_argument("--building", default="paper", metavar="NAME")
    shower.add_argument("--base", default="observer", metavar="S")
    shower.add_argument("--held", type=whole(1), default=4, metavar="H")
    asked = parser.parse_args()
    play(asked) if asked.command == "play" else show(asked)


if __name__ == "__main__":
    sys.exit(exit_status(main))
