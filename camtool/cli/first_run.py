"""The first run of `post` after an installation: its kernels are compiled by two processes.

The run itself compiles what it comes to; beside it a process compiles from the other end what
nearly every drawing needs: the search for the order, judging by a small job of its own, and the
rest of the order. Neither compiles what the other one is at: it waits, and loads that
(`camtool.kernels.compiled`).
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from camtool.cli.messages import say

SMALL_JOB = b"""<svg xmlns="http://www.w3.org/2000/svg" width="2mm" height="2mm" viewBox="0 0 2 2">
<circle cx="1" cy="1" r="0.2"/></svg>"""
"""A drawing of one contour: nothing is to be put into an order."""


def say_first_run(*, quiet: bool, judging: bool = False) -> None:
    """A message before the long silence of the first run; `judging` as below."""
    if first_run(judging=judging):
        say("camtool: first run: compiling the kernels, once, for some 12 s", quiet=quiet)


def first_run(*, judging: bool = False) -> bool:
    """Whether no kernel has been compiled yet; with `judging`, none of the judge's: most of the
    time goes there, and reading a drawing compiles others.

    Their compiled form lies beside them or in NUMBA_CACHE_DIR; where their folder cannot be
    written, numba keeps it elsewhere, and nobody can know: False.
    """
    import camtool.kernels

    folder = Path(str(camtool.kernels.__file__)).parent
    given = os.environ.get("NUMBA_CACHE_DIR")
    if given is None and not os.access(folder, os.W_OK):
        return False
    kept = Path(given) if given else folder / "__pycache__"
    return not any(kept.rglob("judge*.nbi" if judging else "*.nbi"))


@contextmanager
def compiled_beside(target: str, *, quiet: bool, judging: bool) -> Iterator[None]:
    """On a first run say so, and let a second process compile along as long as the body runs;
    `judging` as `first_run` has it."""
    helper = None
    if first_run(judging=judging):
        say_first_run(quiet=quiet, judging=judging)
        none = subprocess.DEVNULL
        command = [sys.executable, "-m", "camtool.cli.first_run", target]
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
    from camtool.kernels.tour import Tour
    from camtool.kernels.tour_search import settled
    from camtool.pipeline import post_drawing
    from camtool.planning.job import job_of
    from camtool.planning.order import Choices, best_order
    from camtool.target.registry import load_target

    # Of one item, with no neighbours and nothing before it or after it.
    places, rows, none = np.zeros((3, 4)), np.arange(3), np.empty(0, dtype=np.int64)
    first, nothing = rows[:2].copy(), np.zeros(2, dtype=np.int64)
    item, place = np.array([1, 0, 2]), np.array([1, 0, 2])
    around = (none, nothing, none, nothing, none, nothing)
    settled(Tour(places, rows, first, *around, -1, False, item, place, rows.copy()))
    post_drawing(read_bytes(SMALL_JOB, "small.svg"), job_of(), load_target(target))
    two = places[:2, :2].copy()
    best_order(Choices(rows[:2], two, two), none.reshape(0, 2))


if __name__ == "__main__":
    compile_ahead(sys.argv[1])
