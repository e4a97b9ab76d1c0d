"""Python in a process of its own, which a test stops, kills or reads."""

import os
import sys
from subprocess import Popen

from conftest import LIMIT, ROOT


def python(*words, env=None, **more) -> Popen:
    """Begin `python WORDS`, which finds this checkout wherever it runs."""
    surroundings = os.environ | {"PYTHONPATH": str(ROOT)} | (env or {})
    return Popen([sys.executable, *words], env=surroundings, text=True, **more)


def ended(process: Popen) -> tuple[str, str]:
    """Wait for the end of a process, as long as a test may take; return what it says.

    A test that gives up leaves none behind.
    """
    try:
        return process.communicate(timeout=LIMIT)
    finally:
        process.kill()
