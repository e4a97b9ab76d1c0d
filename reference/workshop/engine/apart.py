"""Compile in a process of its own, which a stop may kill at any moment.

A KeyboardInterrupt in the middle of LLVM's work may crash Python.
"""

import os
import signal
import sys
from pathlib import Path
from subprocess import DEVNULL, PIPE, Popen
from threading import Thread

# what is imported here is imported there from the same places
PROGRAM = """
import sys
sys.path[:] = {path!r}
from reference.workshop.engine.apart import end_with_parent
end_with_parent()
from reference.workshop.engine.going import compile_into
compile_into({folder!r})
"""


def compile_apart(folder: Path) -> None:
    """Let another process compile the engine into a folder.

    Whether it did is seen in the folder only: it may lack memory or room on the disk.
    """
    if not sys.executable:  # Python is part of another program
        return
    program = PROGRAM.format(path=sys.path, folder=str(folder))
    # numba finds what it kept by its bytecode, which these change
    flags = ["-O"] * sys.flags.optimize
    command = [sys.executable, *flags, "-c", program]
    with Popen(command, stdin=PIPE, stdout=DEVNULL, stderr=DEVNULL) as process:
        try:
            process.wait()
        finally:
            process.kill()
            process.wait()


def end_with_parent() -> None:
    """End this process at Ctrl-C, and when the one that has started it is gone."""
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    Thread(target=_wait_for_the_end, daemon=True).start()


def _wait_for_the_end() -> None:
    os.read(0, 1)  # nothing is ever written: the parent's end closes it
    os._exit(1)
