"""Tutorial 8: learning to attack.

You learn what the fire agent sees and does, train it for a few seconds against the
hand-written guides, and look at where it then strikes, and why that is no proof of much.
"""

from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np
import torch

from reference import drawing
from reference.learning import ppo
from reference.learning.environment import Environment, fire_decision
from reference.learning.observations import fire_layout
from reference.learning.players import Player
from reference.learning.rollouts import Job, Learned, building_of, play
from reference.learning.settings import preset
from reference.paper import Scenario
from reference.rewards import fire_reward
from reference.simulation import Simulation

torch.set_num_threads(1)  # networks as small as these are quickest on one core

# %% A place to attack
# Eight visitors, one robot that guides by the strategy `sweep`, and two fires. There is
# one way out. In training rule D6 holds: where something is already, nothing is lit.

PLAN = """
building: Gallery
size:     34 x 12

floor 1: gallery
##################################
#.......#.......#.......#........#
#.......#.......#.......#........#
#.......#.......#.......#........#
#.goya..#.monet.#.klee..#.miro...#
####+#######+#######+#######+#####
#................................#
E......................corridor..#
#................................#
####+########+##########+#########
#.cafe....#.durer....#.rubens....#
##################################
"""
gallery = building_of(PLAN)
evening = Scenario(
    people=8, robots_per_floor=1, sources=2, training=True, frames_per_tick=25
)

# %% What it observes
# Where everybody is [D1], and as 0 and 1 what the floor looks like: walls, flames, ways
# out. It plays a game in which it is the only agent, and `sweep` its opponent.

game = Environment(gallery, evening, robots="sweep")
seen, infos = game.reset(seed=0)
for name, array in seen["fire_0"].items():
    print(name, array.shape)
#> vector (27,)
#> grid (3, 20, 32)
first = fire_layout(gallery, evening)[0]
print(first.what, seen["fire_0"]["vector"][first.start : first.stop].round(2), first.unit)

# %% What it does
# Three numbers from -1 to 1: a floor and a place on it [D2]. They are read before the
# third decision of the robots, 10 s after the start, and then every 15 s.

print("floor and metres:", fire_decision(gallery, np.array([0.3, -0.9, 0.1])))
while not infos["fire_0"]["acts"]:
    _, _, _, _, infos = game.step({"fire_0": np.zeros(3)})
print("its first decision is read at", infos["fire_0"]["seconds"], "s")

# %% What it gets
# What the robots lose, less a penalty for what rule D6 refuses [D6]. Random fires are
# what it has to beat, on evenings that it will not be trained on.

SEEDS = tuple(range(1000, 1024))
runs = [Simulation(gallery, evening, "sweep", "random", seed) for seed in SEEDS]
random_out = sum(run.run().evacuated for run in runs)
print(random_out, "of", 8 * len(SEEDS), "get out of random fires")
reward = np.mean([fire_reward(run.events) for run in runs])
print(f"reward of an evening: {reward:.0f}")

# %% Two heads, not trained yet
# With the paper's Gaussian head a network says any numbers, and runs into walls. With a
# pointer head it chooses among free cells beside doors, exits, people and robots, and
# emits the coordinates of its choice: it is told what could be worth burning.

table = replace(
    preset("tiny").fire, hidden_units=32, batch_size=20, buffer_size=30, num_epoch=8
)
table = replace(table, learning_rate=0.01, learning_rate_schedule="constant")


def beginner(head: str) -> ppo.Learner:
    """A learner that has seen nothing yet."""
    settings = replace(table, head=head)
    sizes = Player("fire", gallery, evening, settings).sizes
    return ppo.Learner(settings, sizes, seed=0)


def evenings(learner: ppo.Learner, seeds) -> list:
    """Whole episodes against `sweep`; it samples what it does."""
    fire = Learned(learner.settings, learner.actor.state_dict())
    return play(Job(PLAN, evening, "sweep", fire, tuple(seeds)))


def total(episodes, what: str) -> int:
    """A fact, summed over episodes."""
    return int(sum(episode.facts[what] for episode in episodes))


for head in ("gaussian", "pointer"):
    before = evenings(beginner(head), SEEDS)
    refused, out = total(before, "refused"), total(before, "evacuated")
    print(f"{head + ':':<9} {refused:2} fires refused, {out} get out")

# %% Training
# Two hundred evenings, twenty at a time; each time PPO's update of the last tutorial.
# `python -m reference train` does the same for hours, with both sides learning.

learner, rewards = beginner("pointer"), []
for k in range(10):
    episodes = evenings(learner, range(20 * k, 20 * (k + 1)))
    rewards.append(np.mean([episode.facts["fire_reward"] for episode in episodes]))
    learner.add([episode.fire for episode in episodes if episode.fire])
    learner.update()
print([round(float(r)) for r in rewards])
after = evenings(learner, SEEDS)
print(total(after, "evacuated"))
