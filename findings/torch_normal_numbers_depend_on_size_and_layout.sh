#!/usr/bin/env bash
# From one seed, how many normal numbers are drawn and where they go decides which ones.
#
# Seen with torch 2.13.0 on a CPU: up to 15 numbers are drawn one after the other, from
# 16 on by another method, so randn(8) has no number in common with randn(16). Where the
# size is no multiple of 16 the last 16 are drawn anew, so randn(17) shares one number
# with randn(16), and randn(32) all. `normal_` into a view with gaps uses the first method
# at any size. So a layer of another width, or one initialised in a view, begins with
# other weights; rand has one stream: rand(8) begins rand(16).
#
# Guess, written before running: one stream, so the shorter draw begins the longer one,
# and a view with gaps gets the same numbers.
# Output seen:
#     randn(8) begins randn(15) for 8 numbers
#     randn(8) begins randn(16) for 0 numbers
#     randn(16) begins randn(17) for 1 numbers
#     randn(16) begins randn(24) for 8 numbers
#     randn(16) begins randn(32) for 16 numbers
#     randn(15) begins 32 numbers in a view with gaps for 15 numbers
#     randn(32) begins 32 numbers in a view with gaps for 0 numbers
#     rand(8) begins rand(16) for 8 numbers
set -euo pipefail
place=$(mktemp -d)
trap 'rm -rf "$place"' EXIT
python3 -m venv "$place/venv"
"$place/venv/bin/pip" install --quiet numpy==2.4.6 torch==2.13.0
"$place/venv/bin/python" - <<'PY'
import torch


def drawn(draw, *size):
    """Draw from the same seed."""
    torch.manual_seed(0)
    return draw(*size)


def in_a_view(size):
    """Fill every second place of a table."""
    return torch.empty(size, 2)[:, 0].normal_()


def shared(shorter, longer):
    """Count the numbers with which both begin."""
    size = min(len(shorter), len(longer))
    same = shorter[:size] == longer[:size]
    return int(same.cumprod(0).sum())


seen = []
for short, long in ((8, 15), (8, 16), (16, 17), (16, 24), (16, 32)):
    count = shared(drawn(torch.randn, short), drawn(torch.randn, long))
    print(f"randn({short}) begins randn({long}) for {count} numbers")
    seen.append(count)
for short in (15, 32):
    count = shared(drawn(torch.randn, short), drawn(in_a_view, 32))
    print(f"randn({short}) begins 32 numbers in a view with gaps for {count} numbers")
    seen.append(count)
count = shared(drawn(torch.rand, 8), drawn(torch.rand, 16))
print(f"rand(8) begins rand(16) for {count} numbers")
assert count == 8, "rand has more than one stream"
assert seen == [8, 0, 1, 8, 16, 15, 0], seen
PY
