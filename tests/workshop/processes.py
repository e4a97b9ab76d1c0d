"""Python in a process of its own, which a test stops, kills or reads."""

import os
import sys
from subprocess import Popen

from conftest import ROOT


def python(*words, env=None, **more) -> Popen:
    """Begin `python WORDS`, which finds this checkout wherever it runs."""
    surroundings = os.environ | {"PYTHONPATH": str(ROOT)} | (env or {})
    return Popen([sys.executable, *words], env=surroundings, text=True, **more)
