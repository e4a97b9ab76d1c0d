"""Exercise of `ma_poca.py`: what is the baseline worth? It takes 12 seconds.

Agent 1's first decision changes nothing. With V its advantage still says what agent 0
did at that moment; Q knows that already. When this was written, y − V spread half as
far again as y − Q in the updates 5 to 10, hardly farther before and after. So MA-POCA
learns from less noise while there is something to learn.
"""

import sys
from pathlib import Path

import torch

sys.path.insert(0, str(Path(__file__).parents[1]))
from ma_poca import EPISODES, MAPOCA, UPDATES, Batch, Episode, trained

SEEDS = 3
first = []  # of every episode: y - V and y - Q, for agent 1's first decision


class Watched(MAPOCA):
    """MA-POCA that notes two advantages in each episode."""

    @torch.no_grad()
    def targets(self, e: Episode) -> Batch:
        b = super().targets(e)
        V = self.critic(b.o, b.alive)  # (T,)
        around_v = b.y[0, 1] - V[0]
        around_q = b.A[0, 1]
        first.append([around_v, around_q])
        return b


torch.set_num_threads(1)
for seed in range(SEEDS):
    trained(Watched, seed)
spread = torch.tensor(first).view(SEEDS, UPDATES, EPISODES, 2).std(dim=2)
around_v, around_q = spread[:, 4:10].mean(dim=(0, 1)).tolist()
print("the baseline takes away noise:", around_q < around_v)
#> the baseline takes away noise: True
