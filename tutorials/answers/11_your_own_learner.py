"""Exercise 11: the fire against `sweep`, by hand. It takes 2 seconds.

The first choice is read after 10 s, the next ones 25 s apart: every fifth step. The
reward is what the robots lose. Here everybody gets out, so it is negative.
"""

import numpy as np

from reference import Scenario

try:
    from reference.workshop.zoo import parallel_env
except ImportError:
    install = ".venv/bin/pip install -c constraints.txt -e '.[pettingzoo]'"
    raise SystemExit(f"This answer needs PettingZoo: {install}") from None

evening = Scenario(people=12, time_limit=120.0, robots_per_floor=1, sources=3)
world = parallel_env("tiny", evening, robots="sweep", flat=True)
_, infos = world.reset(seed=0)
upstairs = np.array([1.0, 0.0, 0.0], dtype=np.float32)
read = []  # the steps at which a choice was read
total = 0.0
step = 0
while world.agents:
    if infos["fire_0"]["acts"]:
        read.append(step)
    _, rewards, _, _, infos = world.step({"fire_0": upstairs})
    total += rewards["fire_0"]
    step += 1
print("read at steps", read, "of", step)
#> read at steps [2, 7, 12] of 13
print(f"reward {total:.2f}, {infos['fire_0']['evacuated']:.0f} of 12 get out")
#> reward -2.35, 12 of 12 get out
