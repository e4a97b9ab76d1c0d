"""Adversarial fire and rescue robots: an educational reference implementation.

The package is meant to be read from front to back in the order below, which a test
holds every import to: a module imports only modules that stand before it.
"""

READING_ORDER = (
    "paper",  # every number, with its clause
    "floorplan",  # text -> a checked drawing
    "building",  # drawing -> a graph of rooms, doors and stairwells
    "navigation",  # walkable cells, shortest ways
    "sight",  # who sees what, rays
    "world",  # what exists at one instant
    "fire",  # flames, the fire generator, scripted fires
    "perception",  # what one human sees now
    "humans",  # Algorithms 1 and 2
    "robots",  # Algorithm 3, Eq. 1, hand-written strategies
    "motion",  # bodies move without overlap
    "stairs",  # down, past landings, out
    "beginning",  # who stands where before the first tick
    "rewards",  # events -> rewards
    "simulation",  # one tick: SENSE, DECIDE, MOVE, BURN, SETTLE
    "files",  # written whole or not at all
    "workers",  # who does the jobs, here or in other processes
    "learning",  # both sides learn, against each other:
    "learning.mlagents",  # ML-Agents' trainer files: where their keys stand
    "learning.settings",  # Tables I and II, and smaller presets
    "learning.observations",  # the 167 numbers and the grid
    "learning.landmarks",  # what a pointer head chooses among
    "learning.pixels",  # the world as a picture of cells
    "learning.environment",  # PettingZoo's parallel API
    "learning.zoo",  # ... for those who have PettingZoo
    "learning.networks",  # actors and critics
    "learning.experience",  # trajectories and the buffer
    "learning.ppo",  # the fire's trainer
    "learning.poca",  # the robots' trainer, MA-POCA
    "learning.players",  # a network plays one side
    "learning.rollouts",  # jobs: weights and seeds -> whole episodes
    "learning.imitation",  # an option: copy a strategy first
    "learning.checkpoints",  # files to go on from
    "learning.policies",  # a learned policy is a strategy
    "learning.summaries",  # what is written down on the way
    "learning.starting",  # from the beginning, or from where it was left
    "learning.training",  # who learns, and from what
    "learning.loop",  # the adversarial loop
    "learning.speed",  # how fast all this runs
    "evaluation",  # how good are robots, given how hard the fire is:
    "evaluation.score",  # Eqs. 4 and 8, the score E and its calibration
    "evaluation.bounds",  # Eqs. 6 and 7, the worst and the best reward
    "evaluation.difficulty",  # h, how hard a fire was
    "evaluation.intervals",  # bootstrap
    "evaluation.agreement",  # ... and by another yardstick
    "evaluation.worst_case",  # Eq. 5, the worst fires and the worst inputs
    "evaluation.contestants",  # from a word to a strategy
    "evaluation.gap",  # is a critic to be believed?
    "evaluation.crossplay",  # robots x fires x seeds
    "bench",  # how fast the world runs
    "drawing",  # figures and animations
    "commands",  # what each is asked, does and says
    "__main__",  # the command line
)

__version__ = "0.3.0"
