"""Tutorial 7: learning to guide.

You learn what robots learn from: the advantages of PPO (Schulman et al. 2017) and of
MA-POCA (Cohen et al. 2021), by hand in a game of three decisions. Then you see what
each of them teaches a robot that finishes its work early. It takes 12 seconds. The same
game is in `ma_poca.py`, which has both trainers in one short file.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
import torch
from matplotlib.figure import Figure
from torch import tensor

from reference.game.codec import Sizes
from reference.learning import poca, ppo
from reference.learning.experience import Trajectory
from reference.workshop import drawing
from reference.workshop.training.presets import preset

# %% Two robots, one of them finished early
# A game of three decisions, for robot A upstairs and robot B at the exit. At first A
# tosses a coin. If it goes, it brings everybody down and is done: robots leave the game
# when their floor and all above it are empty [C8]. Then the group gets 0, then 1, then
# 1 or 3 by luck: 3 in all on average. If A waits, the group gets 0, 0, 1. What B does
# changes nothing. In this episode A went, and the last reward was 3, in thousands of
# health points.

r = tensor([0.0, 1.0, 3.0])
gamma = 1.0  # the paper's is 0.9; this is easier by hand
lambd = 0.5  # the paper's is 0.95

# %% PPO: each robot by itself
# The advantage of a decision is what came of it less what was expected [E2]; `gae`
# computes it (Schulman et al. 2016). A expects 0.5: nothing if it goes, because for A
# nothing follows, and 1 if it waits. B expects 2 at first, 3 when it knows that A went,
# then 2.

ppo_a = ppo.gae(r[:1], tensor([0.5]), tensor(0.0), gamma, lambd)
ppo_b = ppo.gae(r, tensor([2.0, 3.0, 2.0]), tensor(0.0), gamma, lambd)
print("A", ppo_a.tolist(), " B", ppo_b.tolist())
#> A [-0.5]  B [1.25, 0.5, 1.0]

# By hand, backwards: 3 - 2 = 1; then 1 + 2 - 3 = 0, and half of 1 is 0.5; then
# 0 + 3 - 2 = 1, and half of 0.5 is 0.25. A's decision, which earned all of this, has a
# negative advantage: A learns to wait. B's, which changed nothing, have positive ones.

# %% Posthumous credit
# MA-POCA's critic values the group: V. For a robot that is done while its mates go on,
# the value at its end is not 0 but V of what follows, here 3 [E1].

V = tensor([2.0, 3.0, 2.0])
R_a = poca.lambda_returns(r[:1], V[:1], V[1], gamma, lambd)
R_b = poca.lambda_returns(r, V, tensor(0.0), gamma, lambd)
print("returns:  A", R_a.tolist(), " B", R_b.tolist())
#> returns:  A [3.0]  B [3.25, 3.5, 3.0]
group_a = R_a - V[:1]
group_b = R_b - V
print("less V:   A", group_a.tolist(), " B", group_b.tolist())
#> less V:   A [1.0]  B [1.25, 0.5, 1.0]

# The λ-return minus V is what `gae` computes, so B's advantages are those of PPO.

# %% Counterfactual baselines
# Instead of V, a baseline of each robot is subtracted (Foerster et al. 2018): the value
# of the group, given what the robot's mates did, but not what it did itself. A's
# baseline is 2, as before: what B does makes no difference. B's is 3: A went.

b_a = tensor([2.0])
b_b = tensor([3.0, 3.0, 2.0])
poca_a = R_a - b_a
poca_b = R_b - b_b
print("less b:   A", poca_a.tolist(), " B", poca_b.tolist())
#> less b:   A [1.0]  B [0.25, 0.5, 1.0]

# What is left for B is luck: the last reward was 3, where 2 was expected.

# %% The picture
# Posthumous credit lifts A's only decision from below 0 to +1. The counterfactual
# baseline takes B's first from +1.25 to +0.25.

names = ("A's only\ndecision", "B's 1st", "B's 2nd", "B's 3rd")
steps = {
    "PPO": (ppo_a, ppo_b),
    "+ posthumous credit": (group_a, group_b),
    "+ counterfactual baseline = MA-POCA": (poca_a, poca_b),
}
COLOURS = "#9a9a9a", "#e0a030", "#0868ac"
figure = Figure(figsize=(7, 4), layout="constrained")
axes = figure.subplots()
for k, (step, parts) in enumerate(steps.items()):
    x = np.arange(4) + 0.27 * (k - 1)
    heights = torch.cat(parts).tolist()
    bars = axes.bar(x, heights, width=0.25, label=step, color=COLOURS[k])
    axes.bar_label(bars, fmt="{:+.2f}", padding=2, fontsize=8)
axes.axhline(0, color="#333333", lw=1)
axes.set(xticks=range(4), xticklabels=names, ylim=(-0.8, 2.4), ylabel="advantage")
axes.set_title("Advantages: A went, what B did changed nothing", loc="left")
axes.legend(loc="upper left", frameon=False)
Path("out").mkdir(exist_ok=True)
print(drawing.save(figure, "out/07_advantages.png"))
#> out/07_advantages.png

# %% From advantages to a loss
# Advantages are normalised over a whole buffer, then multiplied by the ratios rho of
# new to old probability. Each component of an action (x and y) has a ratio of its own.
# Ratios are clipped to 0.8 to 1.2 [E3]. Where the clipped product is the smaller one,
# the gradient is 0.

rho = tensor([[1.5, 1.0], [0.5, 1.1]], requires_grad=True)
A = tensor([1.0, -0.5])  # of two decisions
old = torch.zeros(2, 2)  # logarithms of the old probabilities, which are 1
loss = ppo.policy_loss(rho.log(), old, A, epsilon=0.2)
loss.backward()
print(f"{loss.item():.4f}")
#> -0.3125
print([[round(x, 3) + 0.0 for x in row] for row in rho.grad.tolist()])
#> [[0.0, -0.25], [0.0, 0.125]]

# By hand: the mean of 1.2, 1.0, -0.4 and -0.55, with the other sign.
#
# The critic's losses are squares. The value's is not clipped: (3 - 2.5)² = 0.25. The
# baseline's is: by one update it may move by 0.2 from 2, so (3 - 2.2)² = 0.64 counts.

now = tensor([2.5])
before = tensor([2.0])
goal = tensor([3.0])
print(f"{ppo.value_loss(now, goal).item():.2f}")
#> 0.25
print(f"{poca.baseline_loss(now, before, goal, epsilon=0.2).item():.2f}")
#> 0.64

# %% The same game, learned
# A learner gets episodes as `Trajectory` objects. In this game robots see who they are,
# what time it is, and whether A went. What they do is one number, drawn from a
# Gaussian: above 0, A goes.

torch.set_num_threads(1)  # networks as small as these are quickest on one core
SIZES = Sizes(vector=4, grid=(1, 20, 20), continuous=1)


def seen(t: int, went: bool) -> np.ndarray:
    """What A and B observe, (2, 4)."""
    return np.array([[1, 0, t, went], [0, 1, t, went]], dtype=np.float32)


@torch.no_grad()
def play(actor, rng) -> Trajectory:
    """One episode; A's first decision is all that matters."""
    went = False
    vectors = []
    alive = []
    actions = []
    log_probs = []
    for t in range(3):
        vectors.append(seen(t, went))
        alive.append([not went, True])
        policy = actor(tensor(vectors[t][None]), torch.zeros(1, 1, 20, 20))
        noise = tensor(rng.normal(size=(1, 2, 1)), dtype=torch.float32)
        action = policy.act(noise)
        actions.append(action[0])
        log_probs.append(policy.log_probs(action)[0])
        if t == 0:
            went = action[0, 0].item() > 0
    vectors.append(seen(3, went))
    alive.append([False, False])  # nobody is cut off by time
    last = rng.choice([1000, 3000]) if went else 1000
    return Trajectory(
        vectors=np.stack(vectors),
        grids=np.zeros((4, 1, 20, 20), np.uint8),
        alive=np.array(alive),
        actions=np.stack(actions),
        log_probs=np.stack(log_probs),
        rewards=np.array([0, 1000 if went else 0, last]),
    )


def learn(kind, updates: int = 15) -> list[float]:
    """Train a learner; return how often A goes, update by update."""
    learner = kind(settings, SIZES, seed=0)
    rng = np.random.default_rng(0)
    often = []
    for _ in range(updates):
        episodes = [play(learner.actor, rng) for _ in range(40)]
        often.append(np.mean([not episode.alive[1, 0] for episode in episodes]))
        learner.add(episodes)
        learner.update()
    return often


# %% An ablation
# MA-POCA, PPO, and MA-POCA with one rule changed: for a robot that is done, what
# follows is worth 0.


class Forgetful(poca.GroupLearner):
    """MA-POCA without posthumous credit."""

    def next_values(self, t, ends):
        after = [end + 1 for end in ends]
        at_work = torch.from_numpy(t.alive[after])
        return super().next_values(t, ends) * at_work


game = dict(gamma=gamma, lambd=lambd, batch_size=64, learning_rate=0.01)
game |= dict(head="floor", learning_rate_schedule="constant")  # floor: one Gaussian
settings = replace(preset("tiny").robots, **game)
curves = {
    "MA-POCA": learn(poca.GroupLearner),
    "without posthumous credit": learn(Forgetful),
    "PPO": learn(ppo.Learner),
}
for name, often in curves.items():
    at_last = "goes" if np.mean(often[-5:]) > 0.5 else "waits"
    print(f"{name + ':':<26} A {at_last}")
#> MA-POCA:                   A goes
#> without posthumous credit: A waits
#> PPO:                       A waits

figure = Figure(figsize=(7, 4), layout="constrained")
axes = figure.subplots()
CURVES = "#0868ac", "#c43c00", "#9a9a9a"
for k, (name, often) in enumerate(curves.items()):
    axes.plot(often, marker="os^"[k], color=CURVES[k], label=name)
axes.set(xlabel="updates", ylabel="share of episodes in which A goes")
axes.set_title("Finishing early for what the group gets later", loc="left")
axes.legend(loc="center right")
print(drawing.save(figure, "out/07_finishing_early.png"))
#> out/07_finishing_early.png

# For PPO, and without posthumous credit, going is worth nothing to A. So it waits.
#
# The robots that ship for the paper's building are a copy of `guard`, and learned
# nothing after it; RESULTS.md tells why. Watch one stand in the way of a fire, in a
# page for a browser (`.gif` and `.mp4` work as well):
#
#     .venv/bin/python -m reference evacuate \
#         --robots learned --fire fixed --animate learned.html

# %% Exercise
# In another episode A waits, and the rewards are 0, 0, 1. Which advantages do A and B
# have now, by PPO and by MA-POCA? Who is blamed for what?
# Hint: expected is what was expected above, but after the first decision everybody
# knows that A has waited. So V is 2, 1, 1, and the first baseline of B is 1.
