"""Robots that stable-baselines3 trains in tutorial 11's drill, and their strategy.

    .venv/bin/pip install -e '.[pettingzoo]' stable-baselines3 supersuit
    .venv/bin/python tutorials/experiments/sb3_robots.py    # trains, some two minutes
    .venv/bin/python -m reference evaluate --fire none \\
        --robots none sweep tutorials.experiments.sb3_robots:Guide
"""

from pathlib import Path

from tqdm import trange

from reference import Scenario
from reference.paper import InputError
from reference.workshop.strategies.trained import FlatRobots

try:
    import supersuit
    from stable_baselines3 import PPO

    from reference.workshop.zoo import parallel_env
except ImportError:
    install = ".venv/bin/pip install -e '.[pettingzoo]' stable-baselines3 supersuit"
    told = SystemExit if __name__ == "__main__" else InputError  # evaluate imports it
    raise told(f"This needs stable-baselines3: {install}") from None

DRILL = Scenario(people=12, time_limit=60.0, robots_per_floor=1, frames_per_tick=25)
FILE = Path("out/sb3_robots.zip")
WORLDS = 4
STEPS = 96  # of each robot in a round, before an update
ROUNDS = 65


class Guide(FlatRobots):
    """What was trained last; `evaluate` calls it by the name of this file and class."""

    def __init__(self):
        if not FILE.exists():
            train = ".venv/bin/python tutorials/experiments/sb3_robots.py"
            raise FileNotFoundError(f"{FILE} is not there: train it first, by {train}")
        self.model = PPO.load(FILE, device="cpu")
        super().__init__(self.likeliest, "tiny", DRILL)

    def likeliest(self, seen):
        """The likeliest actions, a row for each robot."""
        actions, _ = self.model.predict(seen, deterministic=True)
        return actions


if __name__ == "__main__":
    world = parallel_env("tiny", DRILL, fire="none", flat=True)
    teams = supersuit.pettingzoo_env_to_vec_env_v1(world)
    worlds = supersuit.concat_vec_envs_v1(teams, WORLDS, base_class="stable_baselines3")
    # No `seed=0` here: it fails inside supersuit, whose environments have no `seed`.
    model = PPO("MlpPolicy", worlds, n_steps=STEPS, batch_size=96, gamma=0.97)
    for _ in trange(ROUNDS, unit="round"):
        model.learn(STEPS * worlds.num_envs, reset_num_timesteps=False)
    FILE.parent.mkdir(exist_ok=True)
    model.save(FILE)
    print(f"written: {FILE}")
