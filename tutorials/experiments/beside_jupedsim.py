"""Person-seconds simulated per CPU second, here and in JuPedSim.

It takes three minutes, and needs JuPedSim, which this project does not install:

    pip install "jupedsim==1.4.*"
    python tutorials/experiments/beside_jupedsim.py

Both play the first 20 s on the ground floor of the paper's building, its doors to the
stairs walled up, and in an empty hall of that size with one exit, from places and at
walking speeds drawn alike: JuPedSim's are those of the first of our runs. Its people
(CollisionFreeSpeedModelV2) know the nearest exit and walk there; ours look for one,
think and remember. The steps in the table are JuPedSim's, 0.01 s, its default, and
0.05 s; our ticks are always 0.2 s. Only steps are timed, not what comes before. Both
take turns.
"""

from collections.abc import Sequence
from statistics import median
from time import process_time

try:
    import jupedsim
except ImportError:
    install = "pip install 'jupedsim==1.4.*'"
    raise SystemExit(f"This needs JuPedSim: {install}") from None
from shapely import Polygon, box, union_all

from reference import paper
from reference.building import Building
from reference.navigation import navigation_of
from reference.paper import Scenario
from reference.simulation import Simulation
from reference.workshop.engine import run_to_end
from reference.workshop.maps import load
from reference.workshop.measuring.halls import build_floors

SECONDS = 20.0
PEOPLE = (40, 400)
STEPS = (0.01, 0.05)  # s, of JuPedSim
WORLDS = 8  # of ours in a measurement
ROUNDS = 3
LONG_WALL = 30  # cells; the first and the last row of more are the outer walls
EXIT_ROWS = slice(17, 21)  # of the hall: in the middle of its side, four metres


def ground_floor() -> Building:
    """Return the main body of the paper's ground floor, as a building of its own."""
    rows = load("paper").drawing.storeys[0].rows
    walls = [number for number, row in enumerate(rows) if row.count("#") > LONG_WALL]
    wall = "#" * len(rows[0])
    return build_floors([wall, *rows[walls[0] + 1 : walls[-1]], wall])


def empty_hall() -> Building:
    """Return a hall of that size with one exit, four metres wide."""
    size = paper.BODY_SIZE
    wall = "#" * size
    closed = "#" + "." * (size - 2) + "#"
    rows = [closed] * (size - 2)
    for row in range(size - 2)[EXIT_ROWS]:
        rows[row] = closed[:-1] + "E"
    return build_floors([wall, *rows, wall])


def begin(building: Building, people: int, seed: int) -> Simulation:
    """Begin a run of ours, without robots and fire."""
    scenario = Scenario(
        people=people, robots_per_floor=0, sources=0, time_limit=SECONDS
    )
    return Simulation(building, scenario, seed=seed)


def our_speed(building: Building, people: int) -> float:
    """Simulated person-seconds per CPU second."""
    for _ in range(2):  # the first time warms up
        runs = [begin(building, people, seed) for seed in range(WORLDS)]
        start = process_time()
        run_to_end(runs)
        seconds = process_time() - start
    return sum(run.person_seconds for run in runs) / seconds


def area(building: Building, cells: Sequence[Sequence[int]]) -> Polygon:
    """Return the area of cells, each a row and a column."""
    middles = [building.metres(row, col) for row, col in cells]
    return union_all([box(x - 0.5, y - 0.5, x + 0.5, y + 0.5) for x, y in middles])


def their_speed(building: Building, people: int, step: float) -> float:
    """Simulated person-seconds per CPU second of JuPedSim, from our first places."""
    free = [cell[1:] for cell in zip(*building.walkable.nonzero(), strict=True)]
    simulation = jupedsim.Simulation(
        model=jupedsim.CollisionFreeSpeedModelV2(),
        geometry=area(building, free),
        dt=step,
    )
    ways = {}
    for exit in building.exits:
        stage = simulation.add_exit_stage(
            area(building, building.landmarks[exit].cells)
        )
        journey = simulation.add_journey(jupedsim.JourneyDescription([stage]))
        ways[exit] = {"stage_id": stage, "journey_id": journey}

    metres = navigation_of(building).metres
    bodies = begin(building, people, 0).world.bodies
    for position, place, pace in zip(
        bodies.position, bodies.place, bodies.pace, strict=True
    ):
        nearest = min(building.exits, key=lambda exit: metres[exit, place])
        simulation.add_agent(
            jupedsim.CollisionFreeSpeedModelV2AgentParameters(
                position=tuple(position),
                desired_speed=pace,
                radius=paper.BODY_RADIUS,
                **ways[nearest],
            )
        )

    person_steps = 0
    start = process_time()
    for _ in range(round(SECONDS / step)):
        person_steps += simulation.agent_count()
        simulation.iterate()
    return person_steps * step / (process_time() - start)


if __name__ == "__main__":
    print(f"JuPedSim {jupedsim.__version__}; person-seconds per CPU second")
    print(f"our ticks: {Scenario().tick} s, in each row")
    print("| where | people | ours | JuPedSim's step | JuPedSim | times |")
    print("|---|---|---|---|---|---|")
    for where, floor in (("floor", ground_floor()), ("hall", empty_hall())):
        for people in PEOPLE:
            for step in STEPS:
                here = []
                there = []
                for _ in range(ROUNDS):
                    here.append(our_speed(floor, people))
                    there.append(their_speed(floor, people, step))
                times = median(a / b for a, b in zip(here, there, strict=True))
                cells = f"{median(here):,.0f} | {step} s | {median(there):,.0f}"
                print(f"| {where} | {people} | {cells} | {times:.1f} |", flush=True)
