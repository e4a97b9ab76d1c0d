"""The paper's numbers by name: kept beside results, and sent to workers."""

from typing import Any

from reference import paper


def paper_numbers() -> dict[str, Any]:
    """Collect the numbers of `paper` by name, as they are now; not the tables."""
    kinds = (int, float, tuple)
    return {
        name: value
        for name, value in vars(paper).items()
        if name.isupper() and isinstance(value, kinds)
    }
