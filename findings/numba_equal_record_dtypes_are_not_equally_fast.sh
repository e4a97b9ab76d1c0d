#!/usr/bin/env bash
# Of two equal record dtypes, numba calls quickly only with the one that it has met first.
#
# Seen with numba 0.68.1 and numpy 2.4.6: records made with align=True, saved by np.save
# and loaded again have an equal dtype (`==`, same offsets), which has forgotten that it
# is aligned. Whichever of the two a process first passes to any compiled function stays
# quick. Every function that is first called with the other looks its argument's type up
# in Python at each call, for ever and without a word, 30 us instead of 0.2. A function
# that was compiled for the one which came first takes the other quickly, too.
#
# Guess, written before running: equal dtypes share a compiled version, so all calls cost
# the same.
# Output seen; the cost is that of a call of the first function with the loaded records,
# which came first; the factor depends on the machine:
#     equal True, aligned True and False
#     a new function called with the records as made: 158 times the cost
#     a new function called with the loaded records: 1 times the cost
#     the first function called with the records as made: 2 times the cost
set -euo pipefail
place=$(mktemp -d)
trap 'rm -rf "$place"' EXIT
python3 -m venv "$place/venv"
"$place/venv/bin/pip" install --quiet numpy==2.4.6 numba==0.68.1
"$place/venv/bin/python" - <<'PY'
from io import BytesIO
from time import process_time

import numba
import numpy as np

made = np.zeros(3, np.dtype([("x", "f8"), ("n", "i4")], align=True))
file = BytesIO()
np.save(file, made)
file.seek(0)
loaded = np.load(file)
print(f"equal {made.dtype == loaded.dtype}, aligned {made.dtype.isalignedstruct}",
      f"and {loaded.dtype.isalignedstruct}")
assert made.dtype == loaded.dtype


def function():
    """Compile one more function, of the same content."""

    @numba.njit
    def first(records):
        return records[0].x

    return first


def seconds(compiled, records, calls=2000):
    """Time a call: the quickest of ten rounds."""
    compiled(records)
    rounds = []
    for _ in range(10):
        start = process_time()
        for _ in range(calls):
            compiled(records)
        rounds.append(process_time() - start)
    return min(rounds) / calls


one = function()
base = seconds(one, loaded)
new_made = seconds(function(), made) / base
new_loaded = seconds(function(), loaded) / base
first_made = seconds(one, made) / base
print(f"a new function called with the records as made: {new_made:.0f} times the cost")
print(f"a new function called with the loaded records: {new_loaded:.0f} times the cost")
print(f"the first function called with the records as made: {first_made:.0f} times the cost")
assert new_made > 20, "equal dtypes are equally fast now"
assert new_loaded < 5 and first_made < 5, "what came first is no longer quick"
PY
