"""A sign of life on a terminal, where a command works for longer than a few seconds.

The sign is a short text that the next line overwrites; it counts the seconds. It stands still
while one compiled loop runs, which is seldom long: motion is judged in chunks.
"""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from typing import TextIO

AFTER_S = 3.0
"""Whoever waits for less needs no sign."""

EVERY_S = 1.0
"""How often it changes."""

_OWN = ("batch", "--watch")
_QUIET = ("-q", "--quiet")


@contextmanager
def life_signs(stream: TextIO | None, words: Sequence[str]) -> Iterator[None]:
    """While the block runs, seconds on `stream` if that is a terminal; none for the `words` of a
    command line that is to be quiet, or that has signs of its own."""
    if stream is None or not _wanted(stream, words):
        yield
        return
    done = threading.Event()
    teller = threading.Thread(target=_tell, args=(stream, done), daemon=True)
    teller.start()
    try:
        yield
    finally:
        done.set()
        teller.join()


def _wanted(stream: TextIO, words: Sequence[str]) -> bool:
    if any(word in words for word in (*_OWN, *_QUIET)) or os.environ.get("TERM") == "dumb":
        return False
    with suppress(ValueError):  # closed
        return stream.isatty()
    return False


def _tell(stream: TextIO, done: threading.Event) -> None:
    begun, sign = time.monotonic(), ""
    ended = done.wait(AFTER_S)
    with suppress(OSError, ValueError):  # a terminal that goes away stops no command
        while not ended:
            sign = f"camtool: {time.monotonic() - begun:.0f} s"
            stream.write(f"{sign}\r")
            stream.flush()
            ended = done.wait(EVERY_S)
        if sign:
            stream.write(f"{' ' * len(sign)}\r")
            stream.flush()
