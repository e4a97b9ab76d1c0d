"""Adversarial fire and rescue robots: an educational reference implementation.

From a map's text to a picture:

    from reference import Scenario, Simulation, draw, load
    from reference.fire import RandomFire
    from reference.workshop.strategies.guides import Escort

    hut = load('''building: Hut
    size: 24 x 6
    floor 1: ground
    ########################
    #..........#...........#
    #..........+...........#
    #..........#...........E
    #..........#...........#
    ########################''')
    simulation = Simulation(hut, Scenario(people=4), Escort(), RandomFire())
    while simulation.world.time < 20:  # seconds
        simulation.step()
    draw(simulation, "hut.png")
    outcome = simulation.run()  # to the end
    print(outcome.evacuated, "of", outcome.people, "got out")

`load` takes a path, too, or the name of a map that ships; `animate` films. These five
names are the front door. Without a guide and a fire nobody guides and nothing burns.

The package has two parts. BOOK implements the paper; read it from front to back in the
order below. WORKSHOP, the folder `workshop`, makes it practical. A test checks every
import: a module imports only modules listed before it, and no module of the book
imports the workshop.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:  # at run time `__getattr__` imports them when they are asked for
    from reference.paper import Scenario
    from reference.simulation import Simulation
    from reference.workshop.drawing import animate, draw
    from reference.workshop.maps import load

BOOK = (
    "paper",  # the appendix's numbers, each with its clause
    "floorplan",  # text -> rows of cells
    "building",  # drawing -> a graph of rooms, doors and stairwells
    "navigation",  # walkable cells, shortest ways
    "rays",  # who sees what from where
    "world",  # what exists at one instant, what can happen in it
    "rewards",  # events -> rewards
    "fire",  # who lights it, Eqs. 2-3, how flames spread
    "view",  # what one human sees now
    "humans",  # Algorithms 1 and 2
    "robots",  # Algorithm 3, Eq. 1, who guides
    "motion",  # bodies walk, give way and push
    "walking",  # people walk, take the stairs
    "beginning",  # who stands where before the first tick
    "simulation",  # one tick: SENSE, DECIDE, MOVE, BURN, SETTLE
    "game",  # the learning problem:
    "game.observations",  # the 167 numbers and the grid
    "game.codec",  # what networks read, what their actions mean
    "game.environment",  # who decides when, what an action means, who leaves
    "learning",  # the learners:
    "learning.settings",  # rows of Tables I and II
    "learning.networks",  # encoders and actors
    "learning.experience",  # trajectories and the buffer
    "learning.ppo",  # the fire's trainer
    "learning.poca",  # the robots' trainer, MA-POCA
    "learning.players",  # a network plays a side
    "learning.rollouts",  # jobs: weights and seeds -> whole episodes
    "learning.adversarial",  # PLAY, LEARN: both sides
    "evaluation",  # how good are robots, given how hard the fire is:
    "evaluation.score",  # Eqs. 4 and 8, the score E and its calibration
    "evaluation.bounds",  # Eqs. 6 and 7, the worst and the best reward
    "evaluation.difficulty",  # h, how hard a fire was
)

WORKSHOP = (
    "workshop",  # what makes the book practical:
    "workshop.storage",  # files, records, folders of runs, workers
    "workshop.maps",  # floor files: find, check, load
    "workshop.engine.mirrors",  # many evacuations at once, compiled:
    "workshop.engine.keeping",  # what is kept with objects of the book
    "workshop.engine.ways",  # as `navigation`
    "workshop.engine.rows",  # as `rays`
    "workshop.engine.tables",  # what never moves
    "workshop.engine.state",  # a simulation as arrays, and back
    "workshop.engine.sees",  # as `view` and `rays`
    "workshop.engine.thinks",  # as `humans`
    "workshop.engine.walks",  # as `motion` and `walking`
    "workshop.engine.robots",  # as `robots`
    "workshop.engine.burns",  # as `fire`
    "workshop.engine.ticks",  # as `simulation`
    "workshop.engine.apart",  # compiled in another process, which a stop may kill
    "workshop.engine.storing",  # compiled code is kept on disk
    "workshop.engine.going",  # the engine and the book in turn
    "workshop.engine",  # by the engine, or by the book where a rule has changed
    "workshop.strategies",  # hand-written robots and fires by name, the worst fire
    "workshop.anchors",  # the robots' frame, anchors to choose among, heads
    "workshop.training",  # trainings, kept in files:
    "workshop.training.presets",  # whole settings: tiny, laptop, any, paper
    "workshop.training.mlagents",  # ML-Agents' trainer files
    "workshop.training.batches",  # of buildings that differ
    "workshop.training.imitation",  # an option: copy a strategy first
    "workshop.training.families",  # of buildings: which one a job plays in
    "workshop.training.checkpoints",  # files to resume from
    "workshop.training.differing",  # what tells trainings apart
    "workshop.training.policies",  # a learned policy is a strategy
    "workshop.training.summaries",  # what a training writes down as it runs
    "workshop.training.levels",  # what guides achieve in the same task
    "workshop.training.gradient",  # signal and noise of an update
    "workshop.training.rounds",  # who learns, and from what
    "workshop.training.starting",  # begun or resumed
    "workshop.training.loop",  # the adversarial loop, with files
    "workshop.comparing",  # robots x fires x seeds, experiments, with intervals
    "workshop.measuring",  # trajectories, density, standard cases, speed
    "workshop.drawing",  # figures and animations
    "workshop.annotated",  # the paper beside the code, and the index of its clauses
    "workshop.zoo",  # the environment, for PettingZoo
    "workshop.commands",  # what each command takes, does and prints
    "__main__",  # the command line
)

READING_ORDER = BOOK + WORKSHOP

FRONT_DOOR = {
    "load": "workshop.maps",
    "Scenario": "paper",
    "Simulation": "simulation",
    "draw": "workshop.drawing",
    "animate": "workshop.drawing",
}
"""Names that `from reference import ...` knows, and where each is made."""

# once more, as a list that type checkers can read
__all__ = ["Scenario", "Simulation", "animate", "draw", "load"]

__version__ = "0.27.0"

GAME = 8
"""Increases when rules or numbers of the game change: policies learned in another game
are refused, and runs begun in it are not resumed."""


def __getattr__(name: str) -> Any:
    """Import a name of the front door when it is first asked for (PEP 562)."""
    if name not in FRONT_DOOR:
        raise AttributeError(f"module 'reference' has no attribute '{name}'")
    return getattr(import_module(f"reference.{FRONT_DOOR[name]}"), name)


def __dir__() -> list[str]:
    """Name what is here, for completion: the front door, too."""
    return sorted(globals() | FRONT_DOOR)
