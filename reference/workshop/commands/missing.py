"""What is said where a package is missing that the program itself needs.

This module imports none of them.
"""

import sys
from types import TracebackType

REQUIRED = (
    "numpy",
    "scipy",
    "networkx",
    "matplotlib",
    "jinja2",
    "pygments",
    "torch",
    "filelock",
    "tqdm",
)
"""What pyproject.toml asks for, by the names under which it is imported."""


def tell_what_is_missing(
    kind: type[BaseException], error: BaseException, trace: TracebackType | None
) -> None:
    """Tell in a line which package is missing and what to do; any other error as ever.

    As `sys.excepthook`: the exit status is 1.
    """
    if isinstance(error, ModuleNotFoundError) and error.name in REQUIRED:
        told = f"{sys.executable} has no package {error.name}: type .venv/bin/python "
        told += "instead, or set it up as README.md says"
        print(told, file=sys.stderr)
    else:
        sys.__excepthook__(kind, error, trace)
