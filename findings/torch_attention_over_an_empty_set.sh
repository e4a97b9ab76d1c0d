#!/usr/bin/env bash
# What attention over a set makes of a set of which nobody is left depends on the mode.
#
# Seen with torch 2.13.0, `nn.MultiheadAttention` with a key_padding_mask that masks all
# keys of a row (a team whose members have all left): in training mode the output has
# no nan; in evaluation mode, by the fast path, or in training with need_weights=True,
# it has, and there nan reaches the gradient of the weights.
# `scaled_dot_product_attention` with a bool mask returns zeros and finite gradients.
# So a critic that learned without trouble can answer nan when it is evaluated.
#
# Guess, written before running: nan in all cases, since a softmax over nothing is 0 / 0.
# Output seen:
#     training, need_weights=False: nan False, gradient nan False
#     training, need_weights=True: nan True, gradient nan True
#     evaluation, need_weights=False: nan True
#     scaled_dot_product_attention: nan False, gradient nan False
set -euo pipefail
place=$(mktemp -d)
trap 'rm -rf "$place"' EXIT
python3 -m venv "$place/venv"
"$place/venv/bin/pip" install --quiet numpy==2.4.6 torch==2.13.0
"$place/venv/bin/python" -W ignore - <<'PY'
import torch
from torch.nn.functional import scaled_dot_product_attention

torch.manual_seed(0)
team = torch.randn(2, 3, 8)  # two teams of three
gone = torch.tensor([[False, False, True], [True, True, True]])  # nobody in the second


def nans(tensor):
    return bool(torch.isnan(tensor).any())


seen = {}
for weights in (False, True):
    attention = torch.nn.MultiheadAttention(8, 2, batch_first=True)
    out, _ = attention(team, team, team, key_padding_mask=gone, need_weights=weights)
    out.sum().backward()
    seen["training", weights] = nans(out), nans(attention.in_proj_weight.grad)
    print(f"training, need_weights={weights}: nan {seen['training', weights][0]},",
          f"gradient nan {seen['training', weights][1]}")

attention = torch.nn.MultiheadAttention(8, 2, batch_first=True).eval()
with torch.inference_mode():
    out, _ = attention(team, team, team, key_padding_mask=gone, need_weights=False)
seen["evaluation"] = nans(out)
print("evaluation, need_weights=False: nan", seen["evaluation"])

query = torch.randn(2, 1, 3, 8, requires_grad=True)
out = scaled_dot_product_attention(query, query, query, attn_mask=~gone[:, None, None])
out.sum().backward()
seen["function"] = nans(out), nans(query.grad)
print(f"scaled_dot_product_attention: nan {seen['function'][0]},",
      f"gradient nan {seen['function'][1]}")
assert seen == {
    ("training", False): (False, False),
    ("training", True): (True, True),
    "evaluation": True,
    "function": (False, False),
}, seen
PY
