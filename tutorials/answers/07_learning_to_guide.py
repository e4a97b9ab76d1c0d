"""Exercise 7: advantages in an episode in which A waits. It takes 2 seconds.

PPO praises A for waiting, and blames B, which could do nothing about it. MA-POCA blames
A alone: the group expected 2 and got 1.
"""

from torch import tensor

from reference.learning import poca, ppo

r = tensor([0.0, 0.0, 1.0])
gamma = 1.0
lambd = 0.5
nothing = tensor(0.0)  # follows for anybody: all decide three times

ppo_a = ppo.gae(r, tensor([0.5, 1.0, 1.0]), nothing, gamma, lambd)
ppo_b = ppo.gae(r, tensor([2.0, 1.0, 1.0]), nothing, gamma, lambd)
print("PPO:     A", ppo_a.tolist(), " B", ppo_b.tolist())
#> PPO:     A [0.5, 0.0, 0.0]  B [-1.0, 0.0, 0.0]

V = tensor([2.0, 1.0, 1.0])
b_a = tensor([2.0, 1.0, 1.0])
b_b = tensor([1.0, 1.0, 1.0])
R = poca.lambda_returns(r, V, nothing, gamma, lambd)
poca_a = R - b_a
poca_b = R - b_b
print("MA-POCA: A", poca_a.tolist(), " B", poca_b.tolist())
#> MA-POCA: A [-1.0, 0.0, 0.0]  B [0.0, 0.0, 0.0]
