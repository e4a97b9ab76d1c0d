"""Play the same evacuations of the paper's building with one team or another.

Imported by scripts that ask how many people are saved.
"""

import numpy as np

from reference import Simulation, load
from reference.workshop.engine import run_to_end
from reference.workshop.storage.workers import one_thread


def played(robots, fire, seeds, scenario=None):
    """Play an evacuation of each seed to its end, with copies of both strategies."""
    runs = [Simulation(load("paper"), scenario, robots, fire, seed) for seed in seeds]
    with one_thread():
        run_to_end(runs)
    return runs


def saved(runs):
    """Per cent of people saved in each evacuation."""
    outcomes = [run.outcome() for run in runs]
    return np.array([100 * one.evacuated / one.people for one in outcomes])
