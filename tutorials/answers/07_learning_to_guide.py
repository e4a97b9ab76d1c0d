"""Exercise 7: advantages in an episode in which A waits. It takes 2 seconds.

PPO praises A for waiting, and blames B, which could do nothing about it. MA-POCA blames
A alone: the group expected 2 and got 1.
"""

import torch
from torch import tensor

from reference.learning import poca, ppo

r, gamma, lambd = tensor([0.0, 0.0, 1.0]), 1.0, 0.5
nothing = torch.tensor(0.0)  # follows for anybody: all decide three times

ppo_a = ppo.gae(r, tensor([0.5, 1.0, 1.0]), nothing, gamma, lambd)
ppo_b = ppo.gae(r, tensor([2.0, 1.0, 1.0]), nothing, gamma, lambd)
print("PPO:     A", ppo_a.tolist(), " B", ppo_b.tolist())
#> PPO:     A [0.5, 0.0, 0.0]  B [-1.0, 0.0, 0.0]

R = poca.lambda_returns(r, tensor([2.0, 1.0, 1.0]), nothing, gamma, lambd)
poca_a, poca_b = R - tensor([2.0, 1.0, 1.0]), R - tensor([1.0, 1.0, 1.0])
print("MA-POCA: A", poca_a.tolist(), " B", poca_b.tolist())
#> MA-POCA: A [-1.0, 0.0, 0.0]  B [0.0, 0.0, 0.0]
