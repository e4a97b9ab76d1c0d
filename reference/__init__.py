"""Adversarial fire and rescue robots: an educational reference implementation.

The package has two shelves. The book carries the paper and is meant to be read from
front to back in the order below; the workshop, in the folder of that name, makes it
practical. A test holds every import to it: a module imports only modules that stand
before it, and no module of the book imports the workshop.
"""

BOOK = (
    "paper",  # every number, with its clause
    "floorplan",  # text -> a checked drawing
    "building",  # drawing -> a graph of rooms, doors and stairwells
    "navigation",  # walkable cells, shortest ways
    "sight",  # who sees what, rays
    "world",  # what exists at one instant
    "events",  # what can happen in it
    "flames",  # how fire spreads
    "fire",  # the fire generator, Eqs. 2-3
    "perception",  # what one human sees now
    "humans",  # Algorithms 1 and 2
    "robots",  # Algorithm 3, Eq. 1
    "strategies",  # the simplest: nobody, and at random
    "motion",  # bodies move without overlap
    "stairs",  # down, past landings, out
    "beginning",  # who stands where before the first tick
    "game.rewards",  # events -> rewards
    "simulation",  # one tick: SENSE, DECIDE, MOVE, BURN, SETTLE
    "game",  # what is learned:
    "game.observations",  # the 167 numbers and the grid
    "game.moments",  # what a side is asked
    "game.environment",  # who decides when, what an action means, who leaves
    "learning",  # how:
    "learning.settings",  # rows of Tables I and II
    "learning.networks",  # actors and critics
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
    "workshop.files",  # files and tables, written whole or not at all
    "workshop.plain",  # records from plain data, checked by their types
    "workshop.runs",  # begin one in a folder, or go on with it
    "workshop.workers",  # who does the jobs, here or in other processes
    "workshop.traffic",  # who comes past where on the way out
    "workshop.lockstep",  # many simulations tick together
    "workshop.strategies",  # hand-written robots and fires, by name
    "workshop.decoding",  # from observations back to points
    "workshop.landmarks",  # what a pointer head chooses among
    "workshop.training",  # trainings that are kept:
    "workshop.training.mlagents",  # ML-Agents' trainer files
    "workshop.training.presets",  # whole settings: tiny, laptop, paper
    "workshop.training.imitation",  # an option: copy a strategy first
    "workshop.training.states",  # learners as plain data
    "workshop.training.checkpoints",  # files to go on from
    "workshop.training.policies",  # a learned policy is a strategy
    "workshop.training.summaries",  # what is written down on the way
    "workshop.training.session",  # who learns, and from what
    "workshop.training.starting",  # from the beginning, or from where it was left
    "workshop.training.shipping",  # the policies that ship
    "workshop.training.loop",  # the adversarial loop, with files
    "workshop.evaluation",  # comparisons:
    "workshop.evaluation.intervals",  # bootstrap
    "workshop.evaluation.worst_case",  # Eq. 5, the worst fires and the worst inputs
    "workshop.evaluation.contestants",  # from a word to a strategy, and an evacuation
    "workshop.evaluation.agreement",  # h beside a simulated measure
    "workshop.evaluation.gap",  # is a critic to be believed?
    "workshop.evaluation.crossplay",  # robots x fires x seeds
    "workshop.experiment",  # arms x seeds x tests, from one file
    "workshop.recording",  # trajectories that PedPy reads
    "workshop.validation",  # standard cases of pedestrian dynamics
    "workshop.bench",  # how fast all of it runs
    "workshop.drawing",  # figures and animations
    "workshop.zoo",  # the environment for those who have PettingZoo
    "workshop.commands",  # what each is asked, does and says
    "__main__",  # the command line
)

READING_ORDER = BOOK + WORKSHOP

__version__ = "0.9.0"

GAME = 4
"""Grows when rules or numbers of the game change: what was learned in another game is
not played, and what was measured in it is not gone on with."""
