"""Signs of life: on a terminal, a command that takes longer than a second shows what it is doing.

    camtool: simulating and judging, 43 %, 12 s

The line stands on stderr, where the next one or a message takes its place, and is gone at the end.
It is written by a thread of its own from the `Progress` of the command, which stages set as they
begin. It stands still while a compiled loop runs that gives no other thread a turn.
"""

from __future__ import annotations

import os
import shutil
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from typing import TextIO

import click

from camtool.plain import one_line
from camtool.progress import Progress

AFTER_S = 1.0
"""No sign is shown before this."""

EVERY_S = 0.5
"""How often the sign changes."""

_OWN = ("batch",)
_QUIET = ("-q", "--quiet")


class LifeSigns:
    """The line on `stream` about a `progress`, and the time since which it is counted."""

    def __init__(self, stream: TextIO | None, progress: Progress) -> None:
        self.progress = progress
        self._stream = stream
        self._begun: float | None = time.monotonic()
        self._shown = ""
        self._writing = threading.Lock()

    @contextmanager
    def counting(self) -> Iterator[None]:
        """Count the time from now to the end of the block; nothing is shown behind it."""
        self.progress.begin("")
        self._begun = time.monotonic()
        try:
            yield
        finally:
            self._begun = None
            self.hide()

    @contextmanager
    def hidden(self) -> Iterator[None]:
        """Show nothing within the block, where the user is asked."""
        begun, self._begun = self._begun, None
        self.hide()
        try:
            yield
        finally:
            self._begun = begun

    def show(self) -> None:
        """Write the line, once the command takes long."""
        begun, progress = self._begun, self.progress
        if begun is None:
            return
        seconds = time.monotonic() - begun
        share = "" if progress.share is None else f"{progress.share:.0%}".replace("%", " %")
        parts = (progress.stage, share, f"{seconds:.0f} s")
        line = one_line(f"camtool: {', '.join(filter(None, parts))}")
        if seconds >= AFTER_S:
            self._write(line[: shutil.get_terminal_size().columns - 1])

    def hide(self) -> None:
        """Take the line away."""
        if self._shown:
            self._write("")

    def _write(self, line: str) -> None:
        with self._writing, suppress(OSError, ValueError):  # a terminal that goes away
            if self._stream is not None:
                self._stream.write(f"{line.ljust(len(self._shown))}\r")
                self._stream.flush()
                self._shown = line


@contextmanager
def life_signs(stream: TextIO | None, words: Sequence[str]) -> Iterator[LifeSigns]:
    """While the block runs, show what is done on `stream` if that is a terminal, unless the
    `words` of the command line ask for quiet, or the command has signs of its own."""
    if stream is None or not _are_wanted(stream, words):
        yield LifeSigns(None, Progress())
        return
    signs, done = LifeSigns(stream, Progress()), threading.Event()

    def tell() -> None:
        while not done.wait(EVERY_S):
            signs.show()

    teller = threading.Thread(target=tell, daemon=True)
    teller.start()
    try:
        yield signs
    finally:
        done.set()
        teller.join()
        signs.hide()


def _are_wanted(stream: TextIO, words: Sequence[str]) -> bool:
    if any(word in words for word in (*_OWN, *_QUIET)) or os.environ.get("TERM") == "dumb":
        return False
    with suppress(ValueError):  # closed
        return stream.isatty()
    return False


def signs_of_command() -> LifeSigns:
    """The signs of the running command; without one, signs that nobody sees."""
    context = click.get_current_context(silent=True)
    found = None if context is None else context.find_object(LifeSigns)
    return LifeSigns(None, Progress()) if found is None else found


def progress() -> Progress:
    """What the running command is doing."""
    return signs_of_command().progress


def hide_signs() -> None:
    """Take the line of the running command away, for another one."""
    signs_of_command().hide()
