"""Ctrl-C and SIGTERM as a note that the run looks at between two drawings."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from types import FrameType


@dataclass
class Stop:
    """The signal that asked to stop; None as long as none did."""

    signal: int | None = None


@contextmanager
def stoppable() -> Iterator[Stop]:
    """Within, the first signal is only noted, so that no file is left half-written; a second
    Ctrl-C is a KeyboardInterrupt, for whoever will not wait."""
    stop = Stop()
    if threading.current_thread() is not threading.main_thread():
        yield stop
        return

    def note(number: int, frame: FrameType | None) -> None:
        if stop.signal is not None and number == signal.SIGINT:
            raise KeyboardInterrupt
        stop.signal = number

    old = {each: signal.signal(each, note) for each in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield stop
    finally:
        for each, handler in old.items():
            signal.signal(each, handler)
