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
    "bench",  # how fast the world runs
    "drawing",  # figures and animations
    "__main__",  # the commands
)

__version__ = "0.1.0"
