"""The first run of `post` after an installation: its kernels are compiled by two processes.

The run itself compiles what it comes to; beside it a process compiles from the other end what
nearly every drawing needs: the order first, then what follows by a small job of its own. Neither
compiles what the other one is at: it waits, and loads that (`camtool.kernels.compiled`).
"""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager

from camtool.cli.talk import first_run, say_first_run

SMALL_JOB = b"""<svg xmlns="http://www.w3.org/2000/svg" width="4mm" height="2mm" viewBox="0 0 4 2">
<circle cx="1" cy="1" r="0.2"/><rect x="2" y="0.5" width="0.5" height="0.5"/></svg>"""
"""A drawing that needs no more than every drawing does."""


@contextmanager
def compiled_beside(target: str, *, quiet: bool) -> Iterator[None]:
    """On a first run say so, and let a second process compile along as long as the body runs."""
    helper = None
    if first_run():
        say_first_run(quiet=quiet)
        none = subprocess.DEVNULL
        command = [sys.executable, "-m", "camtool.cli.ahead", target]
        helper = subprocess.Popen(command, stdin=none, stdout=none, stderr=none)
    try:
        yield
    finally:
        if helper is not None:
            helper.terminate()
            helper.wait()


def compile_ahead(target: str) -> None:
    """Compile what a job for this target ends with, the last first."""
    import numpy as np

    from camtool.importers.read import read_bytes
    from camtool.machine.registry import load_target
    from camtool.pipeline import post_drawing
    from camtool.planning.job import job_of
    from camtool.planning.order import Choices, best_order

    places = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    best_order(Choices(np.arange(3), places, places), np.empty((0, 2), dtype=np.int64))
    post_drawing(read_bytes(SMALL_JOB, "small.svg"), job_of(), load_target(target))


if __name__ == "__main__":
    compile_ahead(sys.argv[1])
