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
    "learning.workers",  # who does the jobs
    "learning.checkpoints",  # files to go on from
    "learning.policies",  # a learned policy is a strategy
    "learning.summaries",  # what is written down on the way
    "learning.starting",  # from the beginning, or from where it was left
    "learning.training",  # the adversarial loop
    "learning.speed",  # how fast all this runs
    "bench",  # how fast the world runs
    "drawing",  # figures and animations
    "__main__",  # the commands
)

__version__ = "0.2.0"
