"""Robots that stable-baselines3 trains in tutorial 11's drill, and their strategy.

    .venv/bin/pip install -e '.[pettingzoo]' stable-baselines3 supersuit
    .venv/bin/python tutorials/experiments/sb3_robots.py    # trains, some two minutes
    .venv/bin/python -m reference evaluate --fire none \\
        --robots none sweep tutorials.experiments.sb3_robots:Guide
"""

from pathlib import Path

import supersuit
from stable_baselines3 import PPO

from reference import Scenario
from reference.workshop.strategies.trained import FlatRobots
from reference.workshop.zoo import parallel_env

DRILL = Scenario(people=12, time_limit=60.0, robots_per_floor=1, frames_per_tick=25)
FILE = Path("out/sb3_robots.zip")


class Guide(FlatRobots):
    """What was trained last; `evaluate` calls it by the name of this file and class."""

    def __init__(self):
        self.model = PPO.load(FILE, device="cpu")
        super().__init__(self.likeliest, "tiny", DRILL)

    def likeliest(self, seen):
        """The likeliest actions, a row for each robot."""
        actions, _ = self.model.predict(seen, deterministic=True)
        return actions


if __name__ == "__main__":
    world = parallel_env("tiny", DRILL, fire="none", flat=True)
    teams = supersuit.pettingzoo_env_to_vec_env_v1(world)
    worlds = supersuit.concat_vec_envs_v1(teams, 4, base_class="stable_baselines3")
    # No `seed=0` here: it fails inside supersuit, whose environments have no `seed`.
    model = PPO("MlpPolicy", worlds, n_steps=96, batch_size=96, gamma=0.97)
    model.learn(50_000)
    model.save(FILE)
