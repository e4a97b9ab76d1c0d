"""The words of `annotations.toml`: clauses, and what is printed, place by place.

A place is a line, an equation, a table or a figure, as citations and marks name it:
"Alg. 2:13", "Eq. 3", "Tab. I", "Fig. 4".
"""

import re
import tomllib
from pathlib import Path
from typing import Any

ANNOTATIONS: dict[str, Any] = tomllib.loads(
    Path(__file__).with_name("annotations.toml").read_text(encoding="utf-8")
)
KINDS: tuple[str, ...] = tuple(ANNOTATIONS["kinds"])
CLAUSES: dict[str, str] = {
    key: kind for key, (kind, _) in ANNOTATIONS["clauses"].items()
}
"""The kind of each clause, A1 to F12."""

TITLES: dict[str, str] = {
    **{key: title for key, (_, title) in ANNOTATIONS["clauses"].items()},
    **ANNOTATIONS["algorithms"],
    **{
        f"{name}:{number}": line.strip()
        for name, lines in ANNOTATIONS["lines"].items()
        for number, line in enumerate(lines.splitlines(), 1)
    },
    **{place: told["title"] for place, told in ANNOTATIONS["equations"].items()},
    **ANNOTATIONS["tables"],
    **ANNOTATIONS["figures"],
}
"""Each clause and each place, in our words."""

_RANGE = (
    r"(Alg\. \d:|Alg\. |Eq\. |Tab\. |Fig\. |\b[A-F](?=\d))([0-9IVX]+)(?:-[A-F]?(\d+))?"
)


def keys_named_in(text: str) -> list[str]:
    """Clauses and places that a text names, ranges understood.

    "Alg. 2:13-15" are three lines, "Figs. 4-6" three figures, "Alg. 1" is the whole.
    """
    names = []
    one = re.sub(r"\b(Alg|Eq|Tab|Fig)s\.", r"\1.", text)
    for kind, first, last in re.findall(_RANGE, one):
        numbers = range(int(first), int(last or first) + 1) if first.isdigit() else ()
        names += [f"{kind}{number}" for number in numbers or [first]]
    return [name for name in names if name in TITLES]
