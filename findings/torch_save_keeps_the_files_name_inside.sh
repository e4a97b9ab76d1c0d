#!/usr/bin/env bash
# Equal content saved under two names makes two unlike files.
#
# Seen with torch 2.13.0: `torch.save(content, path)` names the folder inside its zip
# archive after the file's stem, so equal tensors saved as a.pt and b.pt have unlike
# bytes, and a file that is written under a temporary name and then moved into place
# keeps the temporary name for ever. Saved into a buffer, or through an open file, the
# folder is called "archive" and bytes are equal. So whoever compares checkpoints by a
# digest of the file compares names, too: compare tensors, or save through an open file.
#
# Guess, written before running: equal bytes, since the content is equal.
# Output seen:
#     by path: a and b inside, equal bytes False
#     through open files: archive inside, equal bytes True
set -euo pipefail
place=$(mktemp -d)
trap 'rm -rf "$place"' EXIT
python3 -m venv "$place/venv"
"$place/venv/bin/pip" install --quiet numpy==2.4.6 torch==2.13.0
cd "$place"
"$place/venv/bin/python" - <<'PY'
from pathlib import Path
from zipfile import ZipFile

import torch

content = {"weight": torch.arange(4.0)}


def folder_in(name):
    return ZipFile(name).namelist()[0].split("/")[0]


for name in ("a.pt", "b.pt"):
    torch.save(content, name)
same = Path("a.pt").read_bytes() == Path("b.pt").read_bytes()
inside = [folder_in("a.pt"), folder_in("b.pt")]
print(f"by path: {' and '.join(inside)} inside, equal bytes {same}")

for name in ("c.pt", "d.pt"):
    with open(name, "wb") as file:
        torch.save(content, file)
same_through_files = Path("c.pt").read_bytes() == Path("d.pt").read_bytes()
print(f"through open files: {folder_in('c.pt')} inside, equal bytes {same_through_files}")
assert inside == ["a", "b"] and not same, "bytes no longer depend on the name"
assert folder_in("c.pt") == folder_in("d.pt") == "archive" and same_through_files
PY
