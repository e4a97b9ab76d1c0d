#!/usr/bin/env bash
# Two optimizers that load one state dict train each other's moments.
#
# Seen with torch 2.13.0: `Adam.load_state_dict` keeps the very tensors of the dict it is
# given where device and type already fit, so two learners begun from one loaded
# checkpoint share `exp_avg` and `exp_avg_sq`; a step of one moves the other's. And the
# settings come from the dict: an optimizer made with fused=True and lr=0.5 has the
# dict's lr and fused=None afterwards, without a word.
#
# Guess, written before running: the tensors are copied, since parameters are copied by
# `Module.load_state_dict`; the constructor's `fused` wins over the dict's.
# Output seen:
#     the first one's moment before and after the second one's step: 0.1 0.59
#     lr 0.1, fused None
set -euo pipefail
place=$(mktemp -d)
trap 'rm -rf "$place"' EXIT
python3 -m venv "$place/venv"
"$place/venv/bin/pip" install --quiet numpy==2.4.6 torch==2.13.0
"$place/venv/bin/python" - <<'PY'
import torch


def learner(**settings):
    weight = torch.nn.Parameter(torch.zeros(1))
    return weight, torch.optim.Adam([weight], **settings)


def step(weight, adam, gradient):
    weight.grad = torch.tensor([gradient])
    adam.step()


old, saved = learner(lr=0.1)
step(old, saved, 1.0)
checkpoint = saved.state_dict()

one, first = learner(lr=0.5, fused=True)
two, second = learner(lr=0.5)
first.load_state_dict(checkpoint)
second.load_state_dict(checkpoint)
moment = first.state[one]["exp_avg"]
before = moment.item()
step(two, second, 5.0)
after = moment.item()
group = first.param_groups[0]
print("the first one's moment before and after the second one's step:",
      round(before, 2), round(after, 2))
print(f"lr {group['lr']}, fused {group['fused']}")
assert after != before, "moments are no longer shared"
assert moment.data_ptr() == checkpoint["state"][0]["exp_avg"].data_ptr()
assert (group["lr"], group["fused"]) == (0.1, None), "the constructor's settings stay now"
PY
