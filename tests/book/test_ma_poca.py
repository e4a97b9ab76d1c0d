"""MA-POCA in one file, `tutorials/ma_poca.py`, computes what `reference.learning` does.

Both have the same weights here. The networks of `reference` see an image too, but all
numbers of its encoder are 0, so nothing comes of it.
"""

import ast
import importlib.util
import sys
from types import ModuleType, SimpleNamespace

import numpy as np
import pytest
import torch
from conftest import ROOT
from lives import SIZES, batch, doubled, life, settings

from reference.learning.poca import LEARNERS

FILE = ROOT / "tutorials" / "ma_poca.py"
spec = importlib.util.spec_from_file_location("ma_poca", FILE)
ma_poca = importlib.util.module_from_spec(spec)
spec.loader.exec_module(ma_poca)

LEARNERS_HERE = {"poca": ma_poca.MAPOCA, "ppo": ma_poca.PPO}
BOTH = pytest.mark.parametrize("kind", LEARNERS_HERE)


def pair(kind, dtype):
    """The file's learner and that of `reference`, with the same random weights."""
    table = settings(kind, normalize=False)
    same = {"hidden": table.hidden_units, "layers": table.num_layers}
    same |= {"gamma": table.gamma, "lam": table.lambd}
    same |= {"beta": table.beta, "epsilon": table.epsilon}
    V = SIZES.vector
    K = SIZES.continuous
    ours = LEARNERS_HERE[kind](V, K, ma_poca.Settings(**same))
    theirs = LEARNERS[kind](table, SIZES, seed=1)
    for network in (ours.actor, ours.critic, theirs.actor, theirs.critic):
        network.to(dtype)
    torch.manual_seed(1)
    with torch.no_grad():
        for network in (theirs.actor, theirs.critic):
            for name, p in network.named_parameters():
                p.copy_(torch.randn(p.shape) * (0.0 if "encoder" in name else 0.4))
        for mine, p in zip(weights(ours), weights(theirs), strict=True):
            mine.copy_(without_image(p, mine))
    return ours, theirs


def weights(learner):
    """All parameters but an image encoder's, the actor's deviations last."""
    networks = (learner.actor, learner.critic)
    found = [named for network in networks for named in network.named_parameters()]
    there = [(name, p) for name, p in found if "encoder" not in name]
    return [p for name, p in sorted(there, key=lambda named: "log_sigma" in named[0])]


def without_image(theirs, mine):
    """Leave out columns for what the image's encoder says; it follows the vector."""
    V = SIZES.vector
    image = theirs.shape[-1] - mine.shape[-1]
    if not image:
        return theirs
    return torch.cat([theirs[..., :V], theirs[..., V + image :]], dim=-1)


def close(x, y):
    """Equal to 1e-5."""
    return torch.allclose(x, y.to(x.dtype), atol=1e-5, rtol=1e-5)


@pytest.mark.paper("E1", "E2", "E3")
@BOTH
def test_the_file_has_the_same_loss_and_gradients(kind):
    """Of six group decisions of three agents, not all of them alive."""
    ours, theirs = pair(kind, torch.float64)
    b = doubled(batch(6, 3))
    mine = ma_poca.Batch(
        b.vectors, b.alive, b.actions, b.log_probs, b.advantages, b.returns, b.baselines
    )
    loss = ours.loss(mine)
    expected, _ = theirs.loss(b, ours.s.epsilon, ours.s.beta)
    assert close(loss, expected)
    loss.backward()
    expected.backward()
    for p, q in zip(weights(ours), weights(theirs), strict=True):
        assert close(p.grad, without_image(q.grad, p))


LIVES = {
    "together": ("####", "####", "####"),
    "early finishers": ("#...", "##..", "####"),
    "interrupted": ("##..", "####>", "####>"),
}


@pytest.mark.paper("E1", "E2", "C8")
@pytest.mark.parametrize("rows", LIVES.values(), ids=LIVES)
@BOTH
def test_the_file_has_the_same_returns_and_advantages(kind, rows):
    """However an agent's part in the episode ends."""
    ours, theirs = pair(kind, torch.float32)
    t = life(*rows)
    theirs.add([t])
    (expected,) = theirs.buffer
    episode = (t.vectors, t.alive, t.actions, t.log_probs, t.rewards.astype("float32"))
    found = ours.targets(ma_poca.Episode(*map(torch.from_numpy, episode)))
    live = found.alive
    assert torch.equal(live, expected.alive)
    assert close(found.A[live], expected.advantages[live])
    assert close(found.y[live], expected.returns[live])
    if kind == "poca":
        assert close(found.Q[live], expected.baselines[live])


class Parallel:
    """As PettingZoo's environments: `b` leaves after two steps, time cuts `a` off."""

    possible_agents = ("a", "b")

    def observation_space(self, agent):
        """Two numbers."""
        return SimpleNamespace(shape=(2,))

    def action_space(self, agent):
        """One of three choices, counted from 1."""
        return SimpleNamespace(n=3, start=1, shape=())

    def reset(self, seed):
        """Begin at time 0."""
        self.agents = ["a", "b"]
        self.time = 0
        self.taken = []
        return self.seen(), {}

    def seen(self):
        """The time, for those who are there."""
        return {agent: np.full(2, float(self.time)) for agent in self.agents}

    def step(self, actions):
        """One more; the reward is the same for all."""
        there = self.agents
        self.time += 1
        self.taken.append(actions)
        self.agents = [["a", "b"], ["a"], ["a"], []][self.time - 1]
        seen = {agent: np.full(2, float(self.time)) for agent in there}
        ended = {agent: agent == "b" and self.time == 2 for agent in there}
        cut = dict.fromkeys(there, self.time == 4)
        return seen, dict.fromkeys(there, 1.0), ended, cut, {}


def test_the_file_plays_in_an_environment_of_pettingzoo_whose_agents_leave(monkeypatch):
    """Who has left keeps the last observation; whom time cuts off is alive after it."""
    module = ModuleType("small_zoo")
    module.parallel_env = Parallel
    monkeypatch.setitem(sys.modules, "small_zoo", module)
    zoo = ma_poca.Zoo("small_zoo")
    assert (zoo.G, zoo.D, zoo.K) == (2, 2, 3)
    episode = ma_poca.play(zoo, ma_poca.Actor(2, 3, ma_poca.Settings()))
    assert episode.alive.tolist() == [[1, 1], [1, 1], [1, 0], [1, 0], [1, 0]]
    assert episode.o[:, 1, 0].tolist() == [0, 1, 2, 2, 2]
    assert episode.r.tolist() == [1, 1, 1, 1]
    chosen = (episode.a.clamp(-3, 3) / 3).argmax(dim=-1) + 1
    assert [taken["a"] for taken in zoo.env.taken] == chosen[:, 0].tolist()
    assert [[*taken] for taken in zoo.env.taken] == [["a", "b"]] * 2 + [["a"]] * 2


def test_the_file_needs_torch_alone():
    """So that it can be read at once, and copied."""
    text = FILE.read_text(encoding="utf-8")
    imported = {
        node.module.split(".")[0] if isinstance(node, ast.ImportFrom) else name.name
        for node in ast.walk(ast.parse(text))
        if isinstance(node, ast.Import | ast.ImportFrom)
        for name in node.names
    }
    assert imported - sys.stdlib_module_names == {"torch"}
