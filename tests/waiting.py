"""Waiting for other processes and for long work, so that no test goes by the clock.

A test waits for what a process says, or for its end, as long as the process lives: a busy machine
makes it slower and nothing else. What could hang is bounded by `HANG_S`, which is far beyond what
any of this takes, or by processor time, which other people's work on the machine does not use up.
"""

import os
import re
import signal
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from types import FrameType

HANG_S = 900.0
"""What has not ended after so long (of wall clock) hangs, however busy the machine is."""

CHEWED_S = 60
"""Work of a moment that has used so many seconds of processor is chewed, not done."""


def heard_from(running: subprocess.Popen[str], said: str) -> str:
    """Read the output of a process up to this pattern; AssertionError if it ends first."""
    stream = running.stdout or running.stderr
    assert stream is not None
    heard = ""
    while not re.search(said, heard):
        line = stream.readline()
        assert line, heard
        heard += line
    return heard


def all_written(terminal: int) -> bytes:
    """Read a pseudo-terminal until its other end is closed, then close this end too.

    The caller has passed its own copy of the other end on and closed it.
    """
    written = b""
    with suppress(OSError):  # what Linux says when the other end is closed
        while part := os.read(terminal, 65536):
            written += part
    os.close(terminal)
    return written


@contextmanager
def no_chewing(seconds: int = CHEWED_S) -> Iterator[None]:
    """AssertionError when what is inside uses more processor time of this process than that."""

    def fail(_signal: int, _frame: FrameType | None) -> None:
        raise AssertionError(f"not done after {seconds} s of processor time")

    before = signal.signal(signal.SIGPROF, fail)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.signal(signal.SIGPROF, before)
