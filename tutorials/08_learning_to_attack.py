"""Tutorial 8: learning to attack.

You learn what the fire agent sees and does. You train it for some seconds against a
guide written by hand, look at where it then lights fires, and compare it with a simple
rule. It takes 8 seconds.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
import torch

from reference import Scenario, Simulation
from reference.building import building_of
from reference.fire import RandomFire, free_places
from reference.game.codec import PolicyCodec
from reference.game.environment import Environment, fire_decision
from reference.game.observations import vector_layout
from reference.learning.adversarial import learn, learner_for, player_of
from reference.learning.rollouts import Episode, Job, play
from reference.navigation import navigation_of
from reference.rewards import fire_reward
from reference.workshop import drawing
from reference.workshop.engine import run_to_decision, run_to_end
from reference.workshop.strategies.guides import Sweep
from reference.workshop.training.presets import preset

torch.set_num_threads(1)  # networks as small as these are quickest on one core

# %% A building with one exit
# Eight visitors, one robot that guides by the strategy `sweep`, and two fires.
# `training=True` is rule D6 alone: no fire starts at a place that is not free (somebody
# stands there, it burns, or it is protected). It holds in all evenings here, also in
# those that only test. A tick is 0.5 s instead of 0.2 s, which is quicker.

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

# %% Observations
# Where everybody is [D1], and a grid of 0 and 1: walls, flames, ways out. Here the fire
# is the only agent that learns. `sweep` is its opponent.

game = Environment(gallery, evening, robots=Sweep())
seen, infos = game.reset(seed=0)
for name, array in seen["fire_0"].items():
    print(name, array.shape)
#> vector (36,)
#> grid (3, 20, 34)
place = seen["fire_0"]["vector"][:3]
block = vector_layout(gallery, evening).blocks["humans"]
print(f"the first {block.what} in metres:", place.round(2))
#> the first human: x, y, storey in metres: [-4.64 -4.39  0.  ]

# %% Actions
# Three numbers from -1 to 1: a floor, and x and y on it [D2].

print("floor and metres:", fire_decision(gallery, np.array([0.3, 0.5, -0.3])))
#> floor and metres: (0, 8.5, -1.8)
while not infos["fire_0"]["acts"]:
    _, _, _, _, infos = game.step({"fire_0": np.zeros(3)})
print("its first decision is read at", game.simulation.world.time, "s")
#> its first decision is read at 10.0 s

# Let it light that place. Then all that is observed as a picture, for the fire and for
# the robot: the grid, who is where, and what each number means. The grid has at least
# 20 x 20 cells; those below the building are 0. Human 1 is not the same person in both
# pictures: a robot's list of people begins with the nearest.

game.step({"fire_0": np.array([0.3, 0.5, -0.3])})
Path("out").mkdir(exist_ok=True)
world = game.simulation.world
print(drawing.save(drawing.fire_senses(world, evening), "out/08_the_fire_sees.png"))
#> out/08_the_fire_sees.png
print(drawing.save(drawing.robot_senses(world, evening), "out/08_a_robot_sees.png"))
#> out/08_a_robot_sees.png

# %% Reward
# The fire's reward is what the robots lose, less a penalty for each refused fire [D6].
# First, what do random fires reach, on 24 evenings that only test?

SEEDS = range(1000, 1024)


def scripted(fire) -> list[Simulation]:
    """Run all those evenings with a fire that nobody trained."""
    runs = [Simulation(gallery, evening, Sweep(), fire, seed) for seed in SEEDS]
    run_to_end(runs)
    return runs


def saved(runs: list[Simulation]) -> int:
    """Count who gets out, over all evenings."""
    return sum(run.outcome().evacuated for run in runs)


runs = scripted(RandomFire())
print("random:", saved(runs), "of", 8 * len(SEEDS), "get out")
#> random: 155 of 192 get out
reward = np.mean([fire_reward(run.events) for run in runs])
print(f"the fire's reward for an evening: {reward:.0f}")
#> the fire's reward for an evening: -675

# %% Before any training
# The network draws x and y from two Gaussians, as in the paper. They begin around 0,
# the middle of the floor. Here that is the corridor. So these fires do more harm than
# random ones, even though a quarter of the choices are refused. A refused fire is asked
# again 25 s later, so there are more choices than fires. The settings are those of
# Table II [E2], made small; `head="floor"` means the paper's Gaussians.

settings = replace(
    preset("tiny").fire,
    head="floor",
    hidden_units=32,
    batch_size=20,
    buffer_size=30,
    num_epoch=8,
    learning_rate=0.01,
    learning_rate_schedule="constant",
)
learner = learner_for("fire", PLAN, evening, settings, seed=0)


def evenings(seeds: range) -> list[Episode]:
    """Play against `sweep`; the learner's policy decides, with sampled actions."""
    job = Job(PLAN, evening, Sweep(), player_of(learner), tuple(seeds))
    return play(job, advance=run_to_decision)


def total(episodes: list[Episode], fact: str) -> int:
    """Sum a fact over all evenings."""
    return round(sum(episode.facts[fact] for episode in episodes))


before = evenings(SEEDS)
out = total(before, "evacuated")
refused = total(before, "refused")
choices = sum(len(episode.fire.actions) for episode in before)
print(f"before: {out} get out, {refused} of {choices} choices are refused")
#> before: 131 get out, 17 of 62 choices are refused

# %% Training
# Two hundred other evenings, ten at a time: play, then learn. After a round
# or two there are enough decisions for an update by PPO, as in the last tutorial.
# `.venv/bin/python -m reference train` does the same for both sides at once, with
# checkpoints; `.venv/bin/python -m reference curves` draws how it went.

for k in range(20):
    episodes = evenings(range(10 * k, 10 * (k + 1)))  # PLAY
    learn("fire", learner, episodes)  # LEARN

after = evenings(SEEDS)
more = total(after, "fire_reward") > total(before, "fire_reward")
fewer = total(after, "evacuated") < total(before, "evacuated")
print(f"on the same 24 evenings: more reward {more}, fewer people get out {fewer}")
#> on the same 24 evenings: more reward True, fewer people get out True

# %% Where it lights fires
# Rounding differs between machines, torch's own kernels by processor too, and such
# differences grow in training. So no number of what was learned is printed above. In
# the picture rings are choices before training, discs those after. Choices in walls are
# not drawn: they are refused.


def places(episodes: list[Episode]) -> np.ndarray:
    """Metres of all choices but those in walls, (2, n)."""
    raw = np.concatenate([episode.fire.actions for episode in episodes])
    decisions = PolicyCodec("fire", gallery, evening).actions(raw, ())
    metres = decisions[:, 0, 1:]  # behind the floor
    centres = navigation_of(gallery).centres[gallery.walkable.ravel()]
    off = abs(metres[:, None] - centres).max(axis=2)  # of each choice from each cell
    on_floor = (off < 0.5).any(axis=1)  # a cell reaches half a metre from its centre
    return metres[on_floor].T


figure = drawing.top(gallery)
axes = figure.axes[0]
axes.scatter(*places(before), s=60, fc="none", ec="#0868ac", lw=2, zorder=3.1)
axes.scatter(*places(after), s=60, color="#f47b20", alpha=0.8, zorder=3.2)
axes.set_title("Choices before (rings) and after training (discs)", loc="left")
print(drawing.save(figure, "out/08_where_it_strikes.png"))
#> out/08_where_it_strikes.png

# %% Compared with a simple rule
# Here is a fire without a network. It always burns as near to the exit as it can.


class Ambush:
    """Light the free cell that is nearest to the exit on foot."""

    def decide(self, world, rng):
        nav = navigation_of(world.building)
        (way_out,) = world.building.exits
        metres = np.where(free_places(world), nav.distance_to(way_out), np.inf)
        x, y = nav.centres[metres.argmin()].tolist()
        return 0, x, y  # a map's floor 1 is 0


ambushed = saved(scripted(Ambush()))
print("ambush:", ambushed, "of", 8 * len(SEEDS), "get out")
#> ambush: 156 of 192 get out

# The rule that comes to mind first does about as much harm as chance: near the exit
# nothing burns [D7], and `sweep` sees the flames. The network was told nothing but its
# reward, and found places that do more harm. In the paper it trains for much longer,
# and the robots learn too: each side has to answer the other.
#
# A fire that learned in the paper's building ships; see RESULTS.md. Watch it:
#
#     .venv/bin/python -m reference evacuate \
#         --robots escort --fire learned --animate learned.html

# %% Exercise
# Cut a second exit into the corridor's other end. How many get out with random fires,
# and how many if the ambush guards both exits in turn?
# Hint: `len(world.flames.sources)` tells how many fires were lit already.
