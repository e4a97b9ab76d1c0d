#!/usr/bin/env bash
# SuperSuit 3.11.0 (with PettingZoo 1.25.0, Gymnasium 1.1.1): vectors in several processes
# hand the same seed to several environments.
#
# `concat_vec_envs_v1(env, 4, num_cpus=2)` makes four copies of an environment in two
# processes.  Whoever calls `reset(seed=10)` expects four environments with four seeds,
# as with one process.
#
# Guess, written down before the run: process i is given seed + i, and adds 0, 1, ... for
# its own environments; so two of the four get the same seed, and play the same episode.
# Output seen, as guessed:
#     supersuit 3.11.0
#     1 [10, 11, 12, 13]
#     2 [10, 11, 11, 12]
#
# Who trains so learns from fewer different episodes than the vector is wide.  One
# process, or seeds that the environments draw for themselves, are a way out.
set -euo pipefail
place=$(mktemp -d)
trap 'rm -rf "$place"' EXIT
python3 -m venv "$place/venv"
"$place/venv/bin/pip" install --quiet supersuit==3.11.0 pettingzoo==1.25.0 gymnasium==1.1.1 numpy

cat > "$place/seen.py" <<'PY'
from importlib.metadata import version

import numpy as np
import supersuit
from gymnasium.spaces import Box, Discrete
from pettingzoo import ParallelEnv


class Tells(ParallelEnv):
    """One agent, who observes the seed of the last reset."""

    metadata = {"name": "tells"}
    render_mode = None
    possible_agents = ["a"]

    def observation_space(self, agent):
        return Box(-1.0, 1e6, (1,), np.float32)

    def action_space(self, agent):
        return Discrete(2)

    def reset(self, seed=None, options=None):
        self.agents = ["a"]
        self.seen = np.float32([-1 if seed is None else seed])
        return {"a": self.seen}, {"a": {}}

    def step(self, actions):
        return {"a": self.seen}, {"a": 0.0}, {"a": False}, {"a": False}, {"a": {}}


def seeds(cpus):
    vector = supersuit.pettingzoo_env_to_vec_env_v1(Tells())
    many = supersuit.concat_vec_envs_v1(vector, 4, num_cpus=cpus, base_class="gymnasium")
    seen, _ = many.reset(seed=10)
    found = [int(x) for x in np.ravel(seen)]
    many.close()
    return found


if __name__ == "__main__":
    print("supersuit", version("supersuit"))
    for cpus in (1, 2):
        print(cpus, seeds(cpus))
PY
"$place/venv/bin/python" "$place/seen.py" | tee "$place/out"
grep -qx '1 \[10, 11, 12, 13\]' "$place/out"
grep -qx '2 \[10, 11, 11, 12\]' "$place/out"
