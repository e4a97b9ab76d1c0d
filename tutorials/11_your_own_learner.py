"""Tutorial 11: your own learner.

You train robots with a learner that knows nothing of this project: a loop of torch and
an environment with PettingZoo's methods. It takes 30 seconds. PettingZoo is an extra:

    .venv/bin/pip install -c constraints.txt -e '.[pettingzoo]'
"""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import torch
from torch import nn
from torch.distributions import Normal

from reference import Scenario, Simulation, load
from reference.robots import NoRobots
from reference.workshop.drawing import save
from reference.workshop.drawing.colours import lines_of
from reference.workshop.strategies.guides import Sweep
from reference.workshop.strategies.trained import FlatRobots
from reference.world import Evacuated

try:
    from reference.workshop.zoo import parallel_env
except ImportError:
    install = ".venv/bin/pip install -c constraints.txt -e '.[pettingzoo]'"
    raise SystemExit(f"This tutorial needs PettingZoo: {install}") from None

torch.set_num_threads(1)  # networks as small as these are quickest on one core
torch.manual_seed(0)

# %% The environment
# A fire drill: nothing burns, and whoever is still inside after a minute earns
# nothing. `fire="none"` is a strategy by its name, so only robots are agents. With
# `flat=True` everything is what common learners expect: observations are boxes from -1
# to 1, and all agents stay to the end. `help("reference.workshop.zoo")` is the page
# about spaces, units, rewards and who acts when. A tick is 0.5 s instead of 0.2 s,
# which is quicker.

drill = Scenario(people=12, time_limit=60.0, robots_per_floor=1, frames_per_tick=25)
world = parallel_env("tiny", drill, fire="none", flat=True)
print(world.possible_agents)
#> ['robot_0', 'robot_1']
print(world.observation_space("robot_0").shape, world.action_space("robot_0").shape)
#> (70,) (2,)

# %% A policy
# A small network, which both robots share. From 70 numbers it makes the means of two
# Gaussians, x and y of the next destination.

(numbers,) = world.observation_space("robot_0").shape
policy = nn.Sequential(nn.Linear(numbers, 64), nn.Tanh(), nn.Linear(64, 2))
adam = torch.optim.Adam(policy.parameters(), lr=0.004)

# %% An episode
# One step is one decision of all agents. A robot has left once its floor and all above
# it are empty: its info `acts` is 0, so its action should not be learned from. The team
# has one reward.


def play(seed: int, spread: float) -> tuple[torch.Tensor, torch.Tensor]:
    """Log-probability of the team's actions, and its reward, decision by decision."""
    seen, infos = world.reset(seed)
    logs = []
    paid = []
    while world.agents:
        observed = torch.tensor(np.stack(list(seen.values())))
        gaussians = Normal(policy(observed), spread)
        actions = gaussians.sample()
        acts = torch.tensor([info["acts"] for info in infos.values()])
        logs.append(gaussians.log_prob(actions).sum(dim=1) @ acts)
        chosen = dict(zip(world.agents, actions.numpy(), strict=True))
        seen, rewards, _, _, infos = world.step(chosen)
        paid.append(max(rewards.values(), key=abs))  # who has left gets 0
    return torch.stack(logs), torch.tensor(paid)


def tested() -> float:
    """Mean reward of sixteen drills that are not for training.

    Actions are almost the policy's means.
    """
    rewards = []
    with torch.no_grad():
        for seed in range(1000, 1016):
            _, paid = play(seed, spread=1e-3)
            rewards.append(paid.sum().item())
    return np.mean(rewards)


# %% Learning
# REINFORCE (Williams 1992): make all decisions of an episode more likely if it was
# better than the mean of its round, and less likely if it was worse.

before = tested()
for k in range(20):
    episodes = [play(seed, spread=0.4) for seed in range(16 * k, 16 * (k + 1))]
    log = torch.stack([logs.sum() for logs, _ in episodes])
    reward = torch.stack([paid.sum() for _, paid in episodes])
    advantage = (reward - reward.mean()) / reward.std()
    loss = -(log * advantage).mean()
    adam.zero_grad()
    loss.backward()
    adam.step()
after = tested()

# %% What was learned
# Rewards are shares of the health that all have at first. Rounding differs between
# machines, torch's own kernels by processor too, so what was learned is not printed.
# It earns 1.7 to 2.1, by machine and seed. Robots that nobody trained call people into
# the middle of the building; these lead them out.

print("more than before training:", after > before + 0.3)
#> more than before training: True

# %% Your robots beside others
# `FlatRobots` makes a strategy of any policy on these observations. A strategy plays
# wherever `sweep` of tutorial 6 does: here in the same sixteen drills. In so small a
# building without fire nobody needs a guide, and robots that lead cost people time.
# Make such a comparison before you trust a learning curve.


def means(seen: np.ndarray) -> np.ndarray:
    """The likeliest actions, a row for each robot."""
    with torch.no_grad():
        return policy(torch.tensor(seen)).numpy()


guides = {
    "nobody": NoRobots,
    "sweep": Sweep,
    "yours": lambda: FlatRobots(means, "tiny", drill),
}
looks = lines_of(("none", "sweep", "yours"))  # as in other pictures
looks["yours"]["ls"] = "--"
figure, axes = plt.subplots(layout="constrained")
for (name, guide), look in zip(guides.items(), looks.values(), strict=True):
    runs = [Simulation(load("tiny"), drill, guide(), seed=1000 + k) for k in range(16)]
    reward = np.mean([run.run().reward for run in runs]) / world.unit
    events = [event for run in runs for event in run.events]
    out = [event.time for event in events if isinstance(event, Evacuated)]
    inside = [np.inf] * (16 * 12 - len(out))  # who was never out
    axes.ecdf(out + inside, label=f"{name}: {reward:.2f}", **look)
    if name != "yours":
        print(f"{name} {reward:.2f}, {len(out) / 16:.1f} of 12 are out after a minute")
#> nobody 2.16, 10.8 of 12 are out after a minute
#> sweep 2.00, 9.8 of 12 are out after a minute
axes.set(xlabel="seconds", ylabel="share of people who are out", xlim=(0, 60))
axes.set_title("Who is out, by guide")
axes.legend(title="guided by: reward", handlelength=3.6)
Path("out").mkdir(exist_ok=True)
print(save(figure, "out/11_beside_sweep.png"))
#> out/11_beside_sweep.png

# %% Others' learners
# Each wants the environment in its own form, and supersuit converts it.
# `experiments/sb3_robots.py` trains robots in this drill by stable-baselines3, in few
# lines, and has a class `Guide` that plays what was trained. `evacuate` and `evaluate`
# take code in the current folder by its name, so these robots get a line in the table
# of `evaluate`, with survivors, R, h, E and intervals:
#
#     .venv/bin/pip install stable-baselines3 supersuit
#     .venv/bin/python tutorials/experiments/sb3_robots.py
#     .venv/bin/python -m reference evaluate --fire none \
#         --robots none sweep tutorials.experiments.sb3_robots:Guide
#
# A class `Guide` in your file `mine.py` is named `mine:Guide`. Leave `seed` out of
# `PPO(..., seed=0)`: supersuit's environments have no `seed`, so it fails. A learner
# with a central critic, such as MAPPO, reads `world.state()`. Without `fire=` the fire
# is one more agent. With `robots="sweep"` it is the only one, and `FlatFire` makes a
# strategy of its policy.

# %% Exercise
# Be the fire yourself in `tiny`, against `sweep` by its name. Use
# `Scenario(people=12, time_limit=120.0, robots_per_floor=1, sources=3)`. Choose the
# middle of the second floor at every step. At which steps is your choice read? How much
# reward does it earn?
# Hint: the info `acts` tells before a step whether its action is read.
