"""MA-POCA and PPO of `ma_poca.py` in PettingZoo's simple spread: curves of three seeds.

    .venv/bin/pip install mpe2 pygame
    .venv/bin/python tutorials/experiments/simple_spread.py  # 20 minutes

Three agents shall cover three landmarks without collisions, and are paid together. An
update takes in 40 episodes of 25 steps. Thin lines are seeds, thick ones their means.
"""

import sys
from argparse import ArgumentParser
from importlib.util import find_spec
from pathlib import Path

from matplotlib.figure import Figure

TUTORIALS = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(TUTORIALS))

from ma_poca import EPISODES, main

COLOURS = {"MAPOCA": "#0868ac", "PPO": "#c43c00"}
LABELS = {"MAPOCA": "MA-POCA", "PPO": "PPO"}


def drawn(found):
    """Draw what `main` returns: of each learner (seeds, updates)."""
    figure = Figure(figsize=(7, 4), layout="constrained")
    axes = figure.subplots()
    for name, runs in found.items():
        episodes = [EPISODES * (update + 1) for update in range(runs.shape[1])]
        axes.plot(episodes, runs.T, color=COLOURS[name], lw=0.7, alpha=0.5)
        mean = runs.mean(dim=0)
        axes.plot(episodes, mean, color=COLOURS[name], lw=2.2, label=LABELS[name])
    axes.set(xlabel="episodes", ylabel="what an episode earns, the mean of its agents")
    axes.set_title("Simple spread: three agents, three seeds each", loc="left")
    axes.legend(loc="lower right", frameon=False)
    return figure


if __name__ == "__main__":
    parser = ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--updates", type=int, default=75, metavar="N")
    picture = TUTORIALS / "pictures" / "simple_spread.png"
    parser.add_argument("-o", default=picture, metavar="FILE")
    asked = parser.parse_args()
    if find_spec("mpe2") is None:
        sys.exit("This needs mpe2: .venv/bin/pip install mpe2 pygame")
    found = main("mpe2.simple_spread_v3", asked.updates)
    for name, runs in found.items():
        print(name, "in the last ten updates:", runs[:, -10:].mean(dim=1).tolist())
    drawn(found).savefig(asked.o, dpi=130)
